"""Motion whose amplitude softens the mounts: every line is a fixed point, solved along the lines.

This is the model and its plain solution; `deboom.vehicles.kernel_amplitude_numba` runs the same
iteration many times faster.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.design_factor import DynamicRatio, StiffnessRatio

TOLERANCE = 1e-4
"""Largest relative change of an amplitude in the last sweep [1]. The stiffness follows the
amplitude weakly, so a level is a hundred times closer."""

MOST_SWEEPS = 100
"""After which a line counts as not solved."""

CALM, CALMER = 12, 40
"""Sweeps after which the logarithms of the amplitudes go only half, then a quarter of the way: an
iteration that swings from side to side comes to rest."""

LEAST_STEP, MOST_STEP = 0.7, 1.4
"""Change of an amplitude from line to line that is expected to go on, at most [1]."""


@dataclass(frozen=True, eq=False)
class AmplitudeMotion:
    """Equations of motion of one load case whose stiffnesses follow the amplitude.

    Directions are those of the powertrain, then the bodies of their own, as in the coupled motion.

    Parameters
    ----------
    coupled : CoupledMotion
        The same at the measured amplitudes.
    cubic : array, shape (n_frequency, n_direction + n_own, 4)
        Stiffness at an amplitude over that at the nominal one: coefficients of the powers 0 to 3 of
        the ratio of the amplitudes, complex; 1, 0, 0, 0 where it does not depend on it [1].
    lowest, highest : array, shape (n_frequency, n_direction + n_own)
        Ratios of amplitudes between which measurements back the cubic; beyond, the stiffness keeps
        the value at the bound [1].
    ratio : StiffnessRatio
        What a stiffness factor does beside scaling the stiffness; by default nothing.

    Raises
    ------
    InputError
        Arrays of other shapes, or bounds that leave out the nominal amplitude.
    """

    coupled: CoupledMotion
    cubic: ComplexArray
    lowest: RealArray
    highest: RealArray
    ratio: StiffnessRatio = field(default_factory=DynamicRatio)
    amplitude: RealArray = field(init=False, repr=False)
    """Nominal peak amplitude of each line and direction [m]."""

    def __post_init__(self) -> None:
        base = self.coupled
        shape = (base.frequency.size, len(base.forward) + base.own_mass.size)
        for name, expected in (("cubic", (*shape, 4)), ("lowest", shape), ("highest", shape)):
            values = np.array(getattr(self, name))
            if values.shape != expected:
                raise InputError(
                    f"load case {base.load_case}: {name} of shape {values.shape}, expected "
                    f"{expected}"
                )
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        if np.any(self.lowest > 1.0) or np.any(self.highest < 1.0):
            raise InputError(
                f"load case {base.load_case}: bounds of the amplitude leave out the measured one"
            )
        amplitude = base.nominal_amplitude
        amplitude.setflags(write=False)
        object.__setattr__(self, "amplitude", amplitude)

    @property
    def load_case(self) -> str:
        """Name of the load case."""
        return self.coupled.load_case

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_frequency,) [Hz]."""
        return self.coupled.frequency

    @property
    def vehicle_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.coupled.vehicle_names

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of each design variable."""
        return self.coupled.variable_names

    @property
    def variables(self) -> npt.NDArray[np.intp]:
        """Design variable of each direction, bodies of their own last."""
        return np.concatenate([self.coupled.variables, self.coupled.own_variables])

    @property
    def follows(self) -> npt.NDArray[np.bool_]:
        """Directions whose stiffness follows the amplitude at any line."""
        return np.asarray((self.cubic[..., 1:] != 0).any(axis=(0, 2)))

    def relative_stiffness(self, ratio: RealArray, lines: slice = slice(None)) -> ComplexArray:
        """Stiffness at `ratio` (..., lines, direction) of the nominal amplitude over nominal."""
        t, c = np.clip(ratio, self.lowest[lines], self.highest[lines]), self.cubic[lines]
        return np.asarray(c[..., 0] + t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3])))

    def held(self, ratio: RealArray) -> npt.NDArray[np.bool_]:
        """Where amplitudes, over nominal, lie beyond what measurements back; shape of `ratio`."""
        beyond = (ratio < self.lowest) | (ratio > self.highest)
        return np.asarray(beyond & self.follows)


@dataclass(frozen=True, eq=False)
class AmplitudeSolution:
    """Motion of designs at all lines.

    Parameters
    ----------
    ratio : array, shape (n, n_frequency, n_direction + n_own)
        Amplitude over the nominal one [1].
    displacement : array, of that shape
        Complex peak [m].
    stiffness : array, of that shape
        Of the design, at that amplitude [N/m].
    sweeps : array of int, shape (n, n_frequency)
        Solutions that a line took; more than the allowed number where it was given up.
    """

    ratio: RealArray
    displacement: ComplexArray
    stiffness: ComplexArray
    sweeps: npt.NDArray[np.intp]

    @property
    def solved(self) -> npt.NDArray[np.bool_]:
        """Lines whose amplitudes came to rest, shape (n, n_frequency)."""
        return np.asarray(self.sweeps <= MOST_SWEEPS)


def solve_along_lines(
    motion: AmplitudeMotion, designs: RealArray, tolerance: float = TOLERANCE
) -> AmplitudeSolution:
    """Solve designs (n, n_variable) line after line, each from the solution of the one before.

    Parameters
    ----------
    motion : AmplitudeMotion
        Equations of motion.
    designs : array, shape (n, n_variable)
        Stiffness factors [1].
    tolerance : float
        Largest relative change of an amplitude in the last sweep [1].

    Notes
    -----
    Fixed point ``ln a ← ln |v q(K(a))|`` in all directions at once. A line begins with the ratios
    of the amplitudes to the nominal ones that the line before ended with, continued by their last
    change; the first line begins with 1. The ratios vary slowly even where the amplitudes do not.
    """
    n_line = motion.frequency.size
    found = []
    start = before = np.ones((len(designs), 1, motion.lowest.shape[1]))
    factors = line_factors(motion, designs)
    for line in range(n_line):
        at = slice(line, line + 1)
        found.append(_fixed_point(motion, factors[:, at], at, start, tolerance))
        ratio = found[-1].ratio
        start = ratio * np.clip(ratio / before, LEAST_STEP, MOST_STEP)
        before = ratio
    return AmplitudeSolution(
        *(
            np.concatenate([getattr(one, name) for one in found], axis=1)
            for name in ("ratio", "displacement", "stiffness", "sweeps")
        )
    )


def solve_from(
    motion: AmplitudeMotion,
    designs: RealArray,
    amplitude: float,
    tolerance: float = TOLERANCE,
) -> AmplitudeSolution:
    """Solve every line for itself, all directions starting from one `amplitude` [m]."""
    factors = line_factors(motion, designs)
    start = np.broadcast_to(amplitude / motion.amplitude, factors.shape)
    return _fixed_point(motion, factors, slice(None), start, tolerance)


def pressure(motion: AmplitudeMotion, solution: AmplitudeSolution) -> ComplexArray:
    """Pressure at the ears, shape (n, n_vehicle, n_frequency) [Pa]; NaN where not solved."""
    force = solution.stiffness * solution.displacement
    force = np.where(solution.solved[..., np.newaxis], force, np.nan)
    transfer = np.concatenate([motion.coupled.transfer, motion.coupled.own_transfer], axis=2)
    return np.asarray(np.einsum("vfi,dfi->dvf", transfer, force))


def line_factors(motion: AmplitudeMotion, designs: RealArray) -> ComplexArray:
    """Stiffness at nominal amplitude over that of factor 1, shape (n, n_frequency, n_direction)."""
    factors = designs[:, np.newaxis, motion.variables]
    shape = (len(designs), *motion.lowest.shape)
    ratio = motion.ratio(designs)
    return np.broadcast_to(factors if ratio is None else factors * ratio, shape)


def _fixed_point(
    motion: AmplitudeMotion,
    factors: ComplexArray,
    lines: slice,
    start: RealArray,
    tolerance: float,
) -> AmplitudeSolution:
    """Iterate lines of designs; a line rests once its amplitudes have come to rest."""
    base, n_body = motion.coupled, len(motion.coupled.forward)
    squared = base.angular_frequency_squared[lines, np.newaxis]
    nominal = np.hstack([base.stiffness, base.own_stiffness])[lines]
    scaled = factors * nominal
    inertia = squared[..., np.newaxis] * base.mass_matrix
    follows = motion.follows
    ratio = np.array(start, dtype=float)
    displacement = np.empty(ratio.shape, dtype=complex)
    stiffness = np.empty(ratio.shape, dtype=complex)
    moving = np.ones(ratio.shape[:2], dtype=bool)
    sweeps = np.zeros(ratio.shape[:2], dtype=np.intp)
    while moving.any() and sweeps.max() < MOST_SWEEPS:
        sweeps[moving] += 1
        at = np.nonzero(moving)
        whole = scaled * motion.relative_stiffness(ratio, lines)
        springs, line = whole[at], at[1]
        matrix = base.forward.T @ (springs[:, :n_body, np.newaxis] * base.forward) - inertia[line]
        body = np.linalg.solve(matrix, base.load[lines][line][..., np.newaxis])[..., 0]
        own = base.own_load[lines][line] / (springs[:, n_body:] - squared[line] * base.own_mass)
        moved = (base.forward @ body[..., np.newaxis])[..., 0]
        displacement[at] = np.hstack([moved, own])
        stiffness[at] = springs
        found = np.abs(displacement[at]) / motion.amplitude[lines][line]
        change = np.abs(found - ratio[at]) > tolerance * found
        still = (change & follows).any(axis=1)
        here = ratio[at]
        for after in (CALM, CALMER):
            if sweeps.max() > after:
                found = np.sqrt(here * found)
        ratio[at] = np.where(still[:, np.newaxis], found, here)
        moving[at] = still
    return AmplitudeSolution(ratio, displacement, stiffness, sweeps + moving)
