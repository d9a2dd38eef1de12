"""Coupled motion whose mount stiffnesses follow the amplitude."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import LoadCase
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.design_factor import (
    DYNAMIC,
    DesignFactor,
    DynamicRatio,
    StiffnessRatio,
    backed_range,
)

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


Surfaces = Mapping[str, DynamicStiffnessSurface]
"""By design variable, ``<mount> <axis>``."""


def identified_surfaces(parts: Sequence[CharacterisedMount]) -> dict[str, DynamicStiffnessSurface]:
    """Return the surfaces over wheel torque of the directions that were identified.

    Parameters
    ----------
    parts : sequence of CharacterisedMount
        From the mount library.

    Returns
    -------
    dict of str to DynamicStiffnessSurface
        By ``<mount> <axis>``.

    Raises
    ------
    InputError
        A surface over static force, which a load case does not carry; a mount twice.
    """
    found: dict[str, DynamicStiffnessSurface] = {}
    for part in parts:
        for direction in part.directions:
            if direction.surface is None or not direction.quality.identified:
                continue
            name = f"{part.mount.name} {direction.axis}"
            surface = direction.surface.response_surface()
            if surface.preload_unit != "N m":
                raise InputError(
                    f"{part.identity}, direction {direction.axis}: its surface is over static "
                    "force, which a load case does not carry: characterise it over wheel torque"
                )
            if name in found:
                raise InputError(f"two characterised mounts are {part.mount.name}: keep one")
            found[name] = surface
    return found


def amplitude_motion(
    coupled: CoupledMotion,
    surfaces: Surfaces,
    load_case: LoadCase,
    factor: DesignFactor = DYNAMIC,
    follow: bool = True,
) -> AmplitudeMotion:
    """Let the stiffnesses of one load case follow the amplitude as the surfaces say.

    Parameters
    ----------
    coupled : CoupledMotion
        Identified from the same load case.
    surfaces : mapping of str to DynamicStiffnessSurface
        By design variable, over wheel torque. A direction without one keeps its stiffness.
    load_case : LoadCase
        With its engine torque.
    factor : DesignFactor
        What a stiffness factor means.
    follow : bool
        Whether stiffnesses follow the amplitude; if not, the motion is coupled only.

    Returns
    -------
    AmplitudeMotion

    Raises
    ------
    InputError
        A run without engine torque; a line that lies outside of the region in which a mount was
        measured.

    Notes
    -----
    ``K(a) = K_run S(T, a, f) / S(T, a_run, f)``: the run's own stiffness times the relative change
    that the surface S gives, so the nominal design moves exactly as measured. At fixed wheel torque
    and line the 20 terms of S collapse to a cubic in the amplitude.

    A surface is believed where lines were measured nearby. Of the amplitudes about the run's own
    one, the nearest that are not believed bound the cubic; beyond a bound the stiffness stays, and
    `AmplitudeMotion.held` says where. It never follows the cubic into the void.
    """
    variables = [*coupled.variables, *coupled.own_variables]
    inside = np.isin(load_case.displacement.frequency, coupled.frequency)
    torque = load_case.wheel_torque[inside]
    amplitude = coupled.nominal_amplitude
    cubic = np.zeros((*amplitude.shape, 4), dtype=complex)
    cubic[..., 0] = 1.0
    lowest, highest = np.zeros(amplitude.shape), np.full(amplitude.shape, np.inf)
    for column, name in enumerate(coupled.variable_names[k] for k in variables):
        if follow and name in surfaces:
            own = amplitude[:, column]
            line = (torque, own, coupled.frequency)
            where = f"load case {load_case.name}, {name}"
            cubic[:, column] = _relative_cubic(surfaces[name], *line)
            low, high = backed_range(surfaces[name], *line, "amplitude", where)
            lowest[:, column], highest[:, column] = low / own, high / own
    ratio = factor.ratio(coupled, surfaces, load_case)
    return AmplitudeMotion(coupled, cubic, lowest, highest, ratio)


def _relative_cubic(
    surface: DynamicStiffnessSurface, torque: RealArray, amplitude: RealArray, frequency: RealArray
) -> ComplexArray:
    """Coefficients (f, 4) of the powers of the amplitude over the nominal one."""
    c = surface.at_amplitude(torque, frequency).T
    low, high = surface.ranges["amplitude"]
    half = (high - low) / 2 if high > low else 0.5
    middle = (low + high) / 2
    # the scaled amplitude is p g + q with the ratio g
    p, q = amplitude / half, -middle / half
    powers = np.stack(
        [
            c[0] + q * (c[1] + q * (c[2] + q * c[3])),
            p * (c[1] + q * (2 * c[2] + q * 3 * c[3])),
            p**2 * (c[2] + q * 3 * c[3]),
            p**3 * c[3],
        ],
        axis=1,
    )
    return np.asarray(powers / powers.sum(axis=1, keepdims=True))


STARTS = (1e-6, 1e-5, 1e-4, 1e-3, 5e-3)
"""Amplitudes of all directions that lines start from [m]."""

TOLERANCE_3 = 1e-10
"""Of the solutions that are compared [1]."""

SAME = 1e-6
"""Largest difference of the logarithms of an amplitude that counts as the same solution [1]."""


class SeveralSolutionsWarning(UserWarning):
    """The solution of an amplitude-dependent motion depends on where it starts."""


@dataclass(frozen=True, eq=False)
class StartComparison:
    """Solutions of the same lines from several starts.

    Parameters
    ----------
    load_case : str
        Whose lines.
    frequency : array, shape (n_frequency,)
        [Hz].
    starts : tuple of float
        Amplitudes of all directions at the start [m]; beside them stands the start from the line
        before.
    difference : array, shape (n, n_frequency)
        Largest difference of the logarithm of an amplitude between two of the solutions [1].
    solved : array of bool, shape (n, n_frequency)
        Whether every start came to rest.
    """

    load_case: str
    frequency: RealArray
    starts: tuple[float, ...]
    difference: RealArray
    solved: npt.NDArray[np.bool_]

    @property
    def unique(self) -> bool:
        """Whether all starts of all lines and designs ended at the same solution."""
        return bool(self.solved.all() and (self.difference <= SAME).all())

    @property
    def text(self) -> str:
        """What was found, in a sentence."""
        spread = f"{len(self.starts)} starts from {self.starts[0]:g} to {self.starts[-1]:g} m"
        place = f"load case {self.load_case}: {spread} and the start from the line before"
        if self.unique:
            return f"{place} give one solution, amplitudes within {self.difference.max():.0e}"
        where = (self.difference > SAME) | ~self.solved
        lines = self.frequency[where.any(axis=0)]
        return (
            f"{place} do not give one solution: {np.count_nonzero(where.any(axis=1))} of "
            f"{len(where)} designs differ by up to {self.difference.max():.2g} in the logarithm of "
            f"an amplitude, or do not come to rest, at {lines.size} lines from {lines[0]:g} to "
            f"{lines[-1]:g} Hz: results there belong to the branch of the line before"
        )


def compare_starts(
    motion: AmplitudeMotion, designs: RealArray, starts: Sequence[float] = STARTS
) -> StartComparison:
    """Solve designs (n, n_variable) from several amplitudes and compare what comes out.

    Parameters
    ----------
    motion : AmplitudeMotion
        Equations of motion of one load case.
    designs : array, shape (n, n_variable)
        Stiffness factors [1].
    starts : sequence of float
        Amplitudes of all directions at the start [m].

    Returns
    -------
    StartComparison

    Warns
    -----
    SeveralSolutionsWarning
        The starts end at different solutions, or some do not come to rest.
    """
    found = [solve_along_lines(motion, designs, TOLERANCE_3)]
    found += [solve_from(motion, designs, start, TOLERANCE_3) for start in starts]
    follows = motion.follows
    logarithms = np.log([one.ratio[..., follows] for one in found])
    comparison = StartComparison(
        load_case=motion.load_case,
        frequency=motion.frequency,
        starts=tuple(starts),
        difference=np.ptp(logarithms, axis=0).max(axis=-1, initial=0.0),
        solved=np.logical_and.reduce([one.solved for one in found]),
    )
    if not comparison.unique:
        warnings.warn(comparison.text, SeveralSolutionsWarning, stacklevel=2)
    return comparison


TOLERANCE_4 = 1e-6
"""Largest relative change of an amplitude in the last sweep [1]."""

MOST_SWEEPS_4 = 200
CALM_4 = 12
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
    for sweep in range(1, MOST_SWEEPS_4 + 1):
        stiffness, outside = measured.copy(), np.zeros(measured.shape, dtype=bool)
        for column, one in backed.items():
            one.fill(stiffness[:, column], outside[:, column], amplitude[:, column])
        design = replace(
            reference, stiffness=stiffness[:, :n_body], own_stiffness=stiffness[:, n_body:]
        )
        found = design.nominal_amplitude
        change = np.max(np.abs(found / amplitude - 1.0))
        if change < TOLERANCE_4:
            kept = tuple(dict.fromkeys(name for name in columns if name not in surfaces))
            return ResolvedDesign(design, outside, kept, sweep)
        amplitude = found if sweep <= CALM_4 else np.sqrt(found * amplitude)
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
        lines = surface.supported(operating_points(torque, amplitude, reference.frequency))
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
        points = operating_points(self.torque[on], held[on], self.frequency[on])
        stiffness[on] = self.surface.predict(points, extrapolate=True)
        outside[:] = ~on | (held != amplitude)


def _nominal(motion: CoupledMotion) -> RealArray:
    return np.ones((1, len(motion.variable_names)))
