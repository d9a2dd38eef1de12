"""The electric car: a running compressor on its mounts and hoses, on a body that gives way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_sources import Source
from deboom.bench.compressor_truth import Compressor
from deboom.bench.electric_body import HOSES, MOUNTS, ElectricCarBody, columns_of
from deboom.bench.frozen import freeze_arrays
from deboom.bench.hoses import Hose
from deboom.errors import InputError
from deboom.physics.rigid_body import forward_matrices, rotation_matrix


@dataclass(frozen=True, eq=False)
class CarRun:
    """Everything that happens in the car while the compressor runs, complex peak amplitudes.

    Parameters
    ----------
    frequency : array, shape (f,)
        Of the rotation [Hz].
    load : array, shape (f, 6)
        Of the source on the compressor, at its virtual point [N, N m].
    displacement : array, shape (f, 6)
        Of the compressor at its virtual point [m, rad].
    body_motion : array, shape (f, 30)
        Of the body at every point, six motions each [m, rad].
    body_load : array, shape (f, 30)
        On the body there [N, N m].
    pressure : array, shape (f,)
        At the driver's ear [Pa].
    """

    frequency: RealArray
    load: ComplexArray
    displacement: ComplexArray
    body_motion: ComplexArray
    body_load: ComplexArray
    pressure: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def mount_force(self) -> ComplexArray:
        """On the body at the mounts, x, y, z of each, shape (f, 9) [N]."""
        return np.asarray(self.body_load[:, columns_of(MOUNTS, 3)])

    @property
    def hose_load(self) -> ComplexArray:
        """On the body at the ends of the hoses, six of each, shape (f, 12) [N, N m]."""
        return np.asarray(self.body_load[:, columns_of(HOSES)])


def run_car(
    car: ElectricCarBody,
    compressor: Compressor,
    source: Source,
    frequency: RealArray,
    hoses: Sequence[Hose] = (),
    gas_factor: float = 1.0,
) -> CarRun:
    """Run the compressor in the car.

    Parameters
    ----------
    car : ElectricCarBody
        Trimmed, without the compressor.
    compressor : Compressor
        Rigid, on mounts that do not soften; its own hoses are left alone.
    source : Source
        In the compressor, gyroscopic moment of the rotor included.
    frequency : array, shape (f,)
        Of the rotation, above 0 [Hz].
    hoses : sequence of Hose
        To the hose ends of the body; none where long soft hoses cut these paths.
    gas_factor : float
        On the gas forces [1].

    Returns
    -------
    CarRun

    Raises
    ------
    InputError
        A compressor that is not rigid, softens or brings its own receiver; other than no or two
        hoses.

    Notes
    -----
    Primal coupling without any truncation besides the body's own modes. Mounts and hoses are an
    element with the stiffness Z between compressor (c) and body (b); the body answers its loads
    with ``y = -Y (Z_bc x + Z_bb y)``, hence ``y = -(I + Y Z_bb)⁻¹ Y Z_bc x`` and
    ``(D + Z_cc) x + Z_cb y = F``.
    """
    _check(compressor, hoses)
    body = _Side(car, frequency, bool(hoses))
    own = _own_stiffness(compressor, source, frequency)
    load = source.load(frequency, gas_factor)
    joint = _mounts(compressor, frequency, body) + _hoses(hoses, frequency, body)
    return _solve(body, own, joint, load, frequency)


def design_pressure(
    car: ElectricCarBody,
    compressor: Compressor,
    source: Source,
    frequency: RealArray,
    stiffness: RealArray,
    hoses: Sequence[Hose] = (),
    gas_factor: float = 1.0,
) -> ComplexArray:
    """Return the pressure at the driver's ear for other mounts under the same compressor.

    Parameters
    ----------
    car, compressor, source, frequency, hoses, gas_factor
        As in `run_car`.
    stiffness : array, shape (n, n_mount, 3)
        Static stiffness of each mount of each design, axial and two radial [N/m].

    Returns
    -------
    array, shape (n, f)
        [Pa].

    Raises
    ------
    InputError
        As in `run_car`, or designs of another number of mounts.
    """
    _check(compressor, hoses)
    designs = np.asarray(stiffness, dtype=float)
    if designs.ndim != 3 or designs.shape[1:] != compressor.stiffness.shape:
        raise InputError(
            f"designs have shape (n, {len(compressor.positions)}, 3), not {designs.shape}"
        )
    body = _Side(car, frequency, bool(hoses))
    own = _own_stiffness(compressor, source, frequency)
    load = source.load(frequency, gas_factor)
    held = _hoses(hoses, frequency, body)
    pressures = []
    for design in designs:
        joint = _mounts(replace(compressor, stiffness=design), frequency, body) + held
        pressures.append(_solve(body, own, joint, load, frequency).pressure)
    return np.array(pressures, dtype=complex).reshape(len(designs), np.size(frequency))


class _Side:
    """The body at those of its motions that mounts and hoses touch."""

    def __init__(self, car: ElectricCarBody, frequency: RealArray, with_hoses: bool) -> None:
        self.n_at_mounts = len(columns_of(MOUNTS, 3))
        self.columns = columns_of(MOUNTS, 3) + (columns_of(HOSES) if with_hoses else [])
        self.transfer = car.noise_transfer(frequency)[:, self.columns]
        whole = car.receptance(frequency)
        self.receptance = whole[:, self.columns][:, :, self.columns]
        # what is touched moves the rest as well
        self.everywhere = whole[:, :, self.columns]

    @property
    def n_joint(self) -> int:
        """Of the compressor's six motions and the body's touched ones."""
        return 6 + len(self.columns)


def _check(compressor: Compressor, hoses: Sequence[Hose]) -> None:
    if compressor.joint or compressor.softening or compressor.receiver:
        raise InputError(
            "the bench drives cars with a rigid compressor whose mounts do not soften, on the "
            "car's own body: leave flexible body, softening and receiver out"
        )
    if len(compressor.positions) != len(MOUNTS) or len(hoses) not in (0, len(HOSES)):
        raise InputError(
            f"a car has {len(MOUNTS)} mounts and none or {len(HOSES)} hoses, not "
            f"{len(compressor.positions)} and {len(hoses)}"
        )


def mount_stiffnesses(compressor: Compressor, frequency: RealArray) -> ComplexArray:
    """Dynamic stiffness of each mount in fixed axes, shape (f, n_mount, 3, 3) [N/m]."""
    turn = rotation_matrix(compressor.rotations)
    static = (turn * compressor.stiffness[:, None, :]) @ np.swapaxes(turn, 1, 2)
    return np.asarray(compressor.gain_at(frequency)[:, None, None, None] * static)


def _own_stiffness(compressor: Compressor, source: Source, frequency: RealArray) -> ComplexArray:
    squared = ((2 * np.pi * frequency) ** 2)[:, None, None]
    return np.asarray(source.gyroscopic(frequency) - squared * compressor.mass_matrix)


def _mounts(compressor: Compressor, frequency: RealArray, body: _Side) -> ComplexArray:
    """Stiffness of the mounts between compressor and body, shape (f, n_joint, n_joint)."""
    stretch = np.zeros((body.n_at_mounts, body.n_joint))
    stretch[:, :6] = forward_matrices(compressor.positions)
    stretch[:, 6 : 6 + body.n_at_mounts] = -np.eye(body.n_at_mounts)
    by_mount = stretch.reshape(-1, 3, body.n_joint)
    joint: ComplexArray = np.zeros((np.size(frequency), body.n_joint, body.n_joint), dtype=complex)
    stiffness = mount_stiffnesses(compressor, frequency)
    for number, rows in enumerate(by_mount):
        joint += rows.T @ stiffness[:, number] @ rows
    return joint


def _hoses(hoses: Sequence[Hose], frequency: RealArray, body: _Side) -> ComplexArray:
    """Stiffness of the hoses between compressor and body, shape (f, n_joint, n_joint)."""
    joint: ComplexArray = np.zeros((np.size(frequency), body.n_joint, body.n_joint), dtype=complex)
    for number, hose in enumerate(hoses):
        first = 6 + body.n_at_mounts + 6 * number
        ends = np.r_[0:6, first : first + 6]
        joint[:, ends[:, None], ends] += hose.stiffness(frequency)
    return joint


def _solve(
    body: _Side,
    own: ComplexArray,
    joint: ComplexArray,
    load: ComplexArray,
    frequency: RealArray,
) -> CarRun:
    across, receiver = joint[:, 6:, :6], joint[:, 6:, 6:]
    flexible = np.eye(len(body.columns)) + body.receptance @ receiver
    follows = -np.linalg.solve(flexible, body.receptance @ across)
    whole = own + joint[:, :6, :6] + joint[:, :6, 6:] @ follows
    displacement = np.linalg.solve(whole, load[:, :, None])
    touched = -(across @ displacement + receiver @ (follows @ displacement))
    on_body = np.zeros((np.size(frequency), body.everywhere.shape[1]), dtype=complex)
    on_body[:, body.columns] = touched[:, :, 0]
    return CarRun(
        frequency=np.asarray(frequency, dtype=float),
        load=load,
        displacement=np.asarray(displacement[:, :, 0], dtype=np.complex128),
        body_motion=(body.everywhere @ touched)[:, :, 0],
        body_load=on_body,
        pressure=np.einsum("fj,fj->f", body.transfer, touched[:, :, 0]),
    )
