"""Finds the equations of motion in what was measured: mounts' motion and forces, data sheet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import AXES, Mount
from deboom.physics import rigid_body
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.fleet import Band, Fleet, lines_inside, path_transfer, refuse_doubled
from deboom.vehicles.powertrain import Powertrain

LARGEST_RESIDUAL = 0.1
"""Largest part of the mounts' motion that no rigid motion explains; beyond it, positions or
channels are wrong rather than noisy [1]."""

Direction = tuple[Mount, int, str, str]
"""Mount, number of its piece, axis, channel."""


def coupled_motion(
    fleet: Fleet,
    mounts: Sequence[Mount],
    powertrain: Powertrain,
    load_case: LoadCase,
    band: Band = (20.0, 60.0),
) -> CoupledMotion:
    """Identify the equations of motion of one load case from its measured motion and forces.

    Parameters
    ----------
    fleet : Fleet
        Noise transfer functions of each vehicle.
    mounts : sequence of Mount
        Powertrain mounts, with all three axes measured, and mounts with a body mass of their own.
    powertrain : Powertrain
        Mass matrix from the data sheet.
    load_case : LoadCase
        Operating motion and force.
    band : (lower, upper)
        Both edges belong to the band [Hz].

    Returns
    -------
    CoupledMotion

    Raises
    ------
    InputError
        A channel that was not measured; powertrain mounts that leave a rigid motion undetermined;
        measured motion that is not rigid; a direction without any motion; see also
        `deboom.vehicles.fleet.path_contributions`.

    Notes
    -----
    Per line, the powertrain's motion q is the least-squares fit ``V q ≈ s`` to the displacements of
    its mounts, and ``K_i = f_i / (V q)_i``: the stiffness belongs to the fitted displacement, which
    is closer to the truth than a single channel. The external load is what keeps the measured
    motion going, ``F = Vᵀ f − ω² M q``, with the nominal mass matrix M; a body of its own has
    ``L = f − ω² m s``. Then the factors change with K and F fixed per line:
    ``(Σ x_i K_i v_i v_iᵀ − ω² M) q(x) = F``. At all factors 1 this gives the measured forces and
    the fitted motion exactly, whatever the data sheet's errors and the residual of the fit.

    K does not feel the new amplitude or the new static position (that would be another model of
    the motion), and the body stays at rest: blocked forces on a trimmed body.
    """
    variables = [variable for mount in mounts for variable in mount.variables]
    refuse_doubled(variables, "design variable")
    inside = lines_inside(load_case.force.frequency, band, f"load case {load_case.name}")
    frequency = load_case.force.frequency[inside]
    paths = [path for mount in mounts for path in mount.paths]
    if not paths:
        raise InputError("no mount transmits anything: give transfer_axes to at least one")
    transfer = path_transfer(fleet, paths, frequency, band, load_case.name)

    on_powertrain = list(_directions([m for m in mounts if m.body_mass is None], AXES))
    own = [
        direction
        for mount in mounts
        if mount.body_mass is not None
        for direction in _directions([mount], mount.transfer_axes)
    ]
    displacement, force = (
        _measured([name for *_, name in (*on_powertrain, *own)], load_case, quantity)[inside]
        for quantity in ("displacement", "force")
    )
    n_on = len(on_powertrain)
    forward = np.array(
        [
            rigid_body.forward_matrix(mount.positions[piece])[AXES.index(axis)]
            for mount, piece, axis, _ in on_powertrain
        ]
    ).reshape(n_on, 6)
    motion, residual = _rigid_motion(forward, displacement[:, :n_on], load_case.name)
    squared = (2.0 * np.pi * frequency[:, np.newaxis]) ** 2
    mass = np.array([float(mount.body_mass or 0.0) for mount, *_ in own])
    fitted = np.hstack([motion @ forward.T, displacement[:, n_on:]])
    _refuse_rest(fitted, [name for *_, name in (*on_powertrain, *own)], frequency, load_case.name)
    stiffness = dynamic_stiffness(force, fitted)

    def columns(directions: Sequence[Direction]) -> tuple[ComplexArray, npt.NDArray[np.intp]]:
        found = np.zeros((*transfer.shape[:2], len(directions)), dtype=complex)
        for column, (mount, _, axis, _) in enumerate(directions):
            if axis in mount.transfer_axes:
                found[..., column] = transfer[..., paths.index(f"{mount.name} {axis}")]
        names = [f"{mount.name} {axis}" for mount, _, axis, _ in directions]
        return found, np.array([variables.index(name) for name in names], dtype=np.intp)

    to_ear, variable = columns(on_powertrain)
    own_to_ear, own_variable = columns(own)
    return CoupledMotion(
        load_case=load_case.name,
        frequency=frequency,
        forward=forward,
        mass_matrix=powertrain.mass_matrix,
        stiffness=stiffness[:, :n_on],
        load=force[:, :n_on] @ forward - squared * (motion @ powertrain.mass_matrix),
        variables=variable,
        transfer=to_ear,
        own_mass=mass,
        own_stiffness=stiffness[:, n_on:],
        own_load=force[:, n_on:] - squared * mass * displacement[:, n_on:],
        own_variables=own_variable,
        own_transfer=own_to_ear,
        rigid_residual=residual,
        vehicle_names=fleet.names,
        variable_names=tuple(variables),
    )


def _directions(mounts: Sequence[Mount], axes: Sequence[str]) -> Iterator[Direction]:
    for mount in mounts:
        for piece in range(len(mount.pieces)):
            for axis in axes:
                yield mount, piece, axis, mount.channels(axis)[piece]


def _measured(names: Sequence[str], load_case: LoadCase, quantity: str) -> ComplexArray:
    spectrum = load_case.force if quantity == "force" else load_case.displacement
    missing = [name for name in names if name not in spectrum.channels]
    if missing:
        raise InputError(
            f"load case {load_case.name}: no {quantity} of {missing}: motion can answer only where "
            "all axes of the powertrain mounts are measured; measure them, or give a mount that "
            "does not carry the powertrain its body_mass_kg"
        )
    return spectrum.select(names).values


def _rigid_motion(
    forward: RealArray, displacement: ComplexArray, load_case: str
) -> tuple[ComplexArray, float]:
    """Fit the rigid motion (f, 6) to displacements (f, n_direction); say what is left."""
    if np.linalg.matrix_rank(forward) < 6:
        raise InputError(
            f"load case {load_case}: the powertrain's mounts do not determine its motion: it needs "
            "three that do not lie on one line; give body_mass_kg to mounts that do not carry it"
        )
    found = np.linalg.lstsq(forward, displacement.T, rcond=None)[0].T
    motion = np.asarray(found, dtype=np.complex128)
    left = np.linalg.norm(displacement - motion @ forward.T)
    residual = float(left / max(np.linalg.norm(displacement), np.finfo(float).tiny))
    if residual > LARGEST_RESIDUAL:
        raise InputError(
            f"load case {load_case}: {100 * residual:.0f} % of the motion of the powertrain's "
            "mounts is not that of a rigid body: check the positions, axes and signs of its mounts"
        )
    return motion, residual


def _refuse_rest(
    displacement: ComplexArray, names: Sequence[str], frequency: RealArray, load_case: str
) -> None:
    still = np.argwhere(displacement == 0)
    if still.size:
        line, column = still[0]
        raise InputError(
            f"load case {load_case}: no displacement of {names[column]} at {frequency[line]:g} Hz, "
            "so its stiffness is unknown: repair the measurement or choose a band without that line"
        )
