"""A virtual design whose motion is solved: mounts of response surfaces under a known excitation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.surface_limits import backed_range

TOLERANCE = 1e-6
"""Largest relative change of an amplitude in the last sweep [1]."""

MOST_SWEEPS = 200
CALM = 12
"""Sweeps after which amplitudes go only half of the way, on a logarithmic scale."""


@dataclass(frozen=True, eq=False)
class ResolvedDesign:
    """The motion of a design whose mounts were never together on a bench.

    Parameters
    ----------
    motion : CoupledMotion
        With the stiffnesses that the solved amplitudes give; at factors 1 it is the design.
    outside : array of bool, shape (n_frequency, n_direction + n_own)
        Lines whose torque, frequency and amplitude lie outside of what the mount was measured at.
        The stiffness stays at the last amplitude that measurements back; where not even that of the
        reference is backed, the reference's own stiffness stays.
    kept : tuple of str
        Variables without a surface; they keep the measured stiffness of the reference.
    sweeps : int
        Until the amplitudes came to rest.
    """

    motion: CoupledMotion
    outside: npt.NDArray[np.bool_]
    kept: tuple[str, ...]
    sweeps: int

    @property
    def pressure(self) -> ComplexArray:
        """At the ears, shape (n_vehicle, n_frequency) [Pa]."""
        return np.asarray(self.motion.pressure(_nominal(self.motion))[0])


def resolve_design(
    reference: CoupledMotion,
    surfaces: Mapping[str, DynamicStiffnessSurface],
    wheel_torque: RealArray,
) -> ResolvedDesign:
    """Solve the motion of mounts that are known by their surfaces alone.

    Parameters
    ----------
    reference : CoupledMotion
        Identified from a run with any other mounts: it gives inertia, geometry and excitation.
    surfaces : mapping of str to DynamicStiffnessSurface
        Of the design, by variable ``<mount> <axis>``, over wheel torque.
    wheel_torque : array, shape (n_frequency,)
        At the lines of the reference [N m].

    Returns
    -------
    ResolvedDesign

    Raises
    ------
    InputError
        Not one torque per line, a surface over static force, or amplitudes that do not come to
        rest.

    Notes
    -----
    ``(Σ K_i(T, a_i, f) v_i v_iᵀ − ω² M) q = F`` with ``a_i = |v_i q|``, as a fixed point from the
    reference's amplitudes. F is the excitation that the reference's motion and forces show, with
    the data sheet's inertia; an error of the latter enters both sides and mostly cancels.
    """
    torque = np.asarray(wheel_torque, dtype=float)
    if torque.shape != reference.frequency.shape:
        raise InputError(
            f"wheel torque of shape {torque.shape}, expected one value for each of "
            f"{reference.frequency.size} lines"
        )
    columns = [
        reference.variable_names[k] for k in (*reference.variables, *reference.own_variables)
    ]
    for name in columns:
        if name in surfaces and surfaces[name].preload_unit != "N m":
            raise InputError(f"{name}: its surface is over static force: fit it over wheel torque")
    measured = np.hstack([reference.stiffness, reference.own_stiffness])
    n_body = len(reference.forward)
    amplitude = reference.nominal_amplitude
    backed = {
        column: _Backed.about(surfaces[name], torque, amplitude[:, column], reference, name)
        for column, name in enumerate(columns)
        if name in surfaces
    }
    for sweep in range(1, MOST_SWEEPS + 1):
        stiffness, outside = measured.copy(), np.zeros(measured.shape, dtype=bool)
        for column, one in backed.items():
            one.fill(stiffness[:, column], outside[:, column], amplitude[:, column])
        design = replace(
            reference, stiffness=stiffness[:, :n_body], own_stiffness=stiffness[:, n_body:]
        )
        found = design.nominal_amplitude
        change = np.max(np.abs(found / amplitude - 1.0))
        if change < TOLERANCE:
            kept = tuple(dict.fromkeys(name for name in columns if name not in surfaces))
            return ResolvedDesign(design, outside, kept, sweep)
        amplitude = found if sweep <= CALM else np.sqrt(found * amplitude)
    raise InputError(
        f"load case {reference.load_case}: the amplitudes of the design do not come to rest within "
        f"{MOST_SWEEPS} sweeps"
    )


@dataclass(frozen=True, eq=False)
class _Backed:
    """One surface at the lines of a run, between the amplitudes that measurements back."""

    surface: DynamicStiffnessSurface
    torque: RealArray
    frequency: RealArray
    lines: npt.NDArray[np.bool_]
    lowest: RealArray
    highest: RealArray

    @classmethod
    def about(
        cls,
        surface: DynamicStiffnessSurface,
        torque: RealArray,
        amplitude: RealArray,
        reference: CoupledMotion,
        name: str,
    ) -> _Backed:
        lines = surface.inside(torque, amplitude, reference.frequency)
        own = torque[lines], amplitude[lines], reference.frequency[lines]
        bounds = amplitude.copy(), amplitude.copy()
        if lines.any():
            where = f"load case {reference.load_case}, {name}"
            bounds[0][lines], bounds[1][lines] = backed_range(surface, *own, "amplitude", where)
        return cls(surface, torque, reference.frequency, lines, *bounds)

    def fill(
        self, stiffness: ComplexArray, outside: npt.NDArray[np.bool_], amplitude: RealArray
    ) -> None:
        """Write the stiffness at these amplitudes, and where they are held."""
        held = np.clip(amplitude, self.lowest, self.highest)
        on = self.lines
        own, _ = self.surface.predict_masked(self.torque[on], held[on], self.frequency[on])
        stiffness[on] = own
        outside[:] = ~on | (held != amplitude)


def _nominal(motion: CoupledMotion) -> RealArray:
    return np.ones((1, len(motion.variable_names)))
