"""Coupled motion whose mount stiffnesses follow the amplitude: every line is a fixed point.

This is the model and its plain solution; `deboom.vehicles.kernels` runs the same iteration
compiled.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from deboom.arrays import BoolArray, ComplexArray, IntArray, RealArray, checked, derivatives
from deboom.errors import InputError
from deboom.measurement.channels import LoadCase
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points
from deboom.vehicles.coupled_motion import CoupledMotion, FlexibleMotion
from deboom.vehicles.design_factor import PartRatio, backed_range, part_ratio
from deboom.vehicles.powertrain import KinematicModel

TOLERANCE = 1e-4
"""Largest relative change of an amplitude in the last sweep [1]. The stiffness follows the
amplitude weakly, so a level is a hundred times closer."""

MOST_SWEEPS = 100
"""Sweeps after which plain iteration gives way to secants; the compiled loops end here."""

MOST_SECANTS = 400
"""Further sweeps after which a line counts as not solved."""

LEAST_GAIN, MOST_GAIN = 1 / 16, 32.0
"""Share of the fixed point's own step that a secant takes, in the logarithm of an amplitude [1]."""

LONGEST_STEP = 0.3
"""Largest change of the logarithm of an amplitude by a secant [1]."""

CALM, CALMER = 12, 40
"""Sweeps after which the logarithms of the amplitudes go only half, then a quarter of the way: an
iteration that swings from side to side comes to rest."""

LEAST_STEP, MOST_STEP = 0.7, 1.4
"""Change of an amplitude from line to line that is expected to go on, at most [1]."""

GRADIENT_STEP = 1e-3
"""Step of a factor for differences of fourth order [1]."""

GRADIENT_TOLERANCE = 1e-12
"""Tolerance of the amplitudes that differences are taken from [1]."""

STARTS = (1e-6, 1e-5, 1e-4, 1e-3, 5e-3)
"""Amplitudes of all directions that lines start from in a comparison [m]."""

STARTS_TOLERANCE = 1e-10
"""Tolerance of the solutions that are compared [1]."""

SAME = 1e-6
"""Largest difference of the logarithms of an amplitude that counts as the same solution [1]."""

RESOLVE_TOLERANCE = 1e-6
"""Largest relative change of an amplitude in the last sweep of a resolved design [1]."""

RESOLVE_SWEEPS = 200
"""Sweeps after which a resolved design counts as not solved."""

Surfaces = Mapping[str, DynamicStiffnessSurface]
"""Response surfaces by design variable, ``<mount> <axis>``."""


@checked(frequency="f", cubic="f s 4", lowest="f s", highest="f s ?")
class AmplitudeMotion(CoupledMotion):
    """Equations of motion of one load case whose stiffnesses follow the amplitude.

    The bodies have the stiffnesses of the measured amplitudes.

    - `cubic` (f, s, 4): stiffness at an amplitude over that at the nominal one: coefficients of the
      powers 0 to 3 of the ratio of the amplitudes, complex; 1, 0, 0, 0 where it does not depend on
      it [1].
    - `lowest`, `highest` (f, s): ratios of amplitudes between which measurements back the cubic;
      beyond, the stiffness keeps the value at the bound [1].
    - `ratio`, optional: change of the stiffness where a factor means the part itself; None where it
      means the dynamic stiffness.
    - `tolerance`: largest relative change of an amplitude in the last sweep [1].
    """

    cubic: ComplexArray
    lowest: RealArray
    highest: RealArray
    ratio: PartRatio | None = None
    tolerance: float = TOLERANCE

    @cached_property
    def amplitude(self) -> RealArray:
        """Nominal peak amplitude of each line and spring, shape (f, s) [m]."""
        return self.nominal_amplitude

    @property
    def follows(self) -> BoolArray:
        """Springs whose stiffness follows the amplitude at any line, shape (s,)."""
        return np.asarray((self.cubic[..., 1:] != 0).any(axis=(0, 2)))

    def relative_stiffness(self, ratio: RealArray, lines: IntArray) -> ComplexArray:
        """Return stiffness over nominal at ratios (..., n, s) of the nominal amplitude of lines."""
        t, c = np.clip(ratio, self.lowest[lines], self.highest[lines]), self.cubic[lines]
        return np.asarray(c[..., 0] + t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3])))

    def clipped(self, ratio: RealArray) -> BoolArray:
        """Say where amplitudes, over nominal, lie beyond what measurements back."""
        beyond = (ratio < self.lowest) | (ratio > self.highest)
        return np.asarray(beyond & self.follows)

    def nominal_springs(self, designs: RealArray) -> ComplexArray:
        """Return stiffnesses of designs (n, k) at nominal amplitude, shape (n, f, s) [N/m]."""
        springs = self.springs(designs)
        return springs if self.ratio is None else springs * self.ratio(designs)

    def force(self, designs: RealArray) -> ComplexArray:
        """Return the force of every spring (n, f, s) [N]; NaN where amplitudes do not rest."""
        solution = solve_along_lines(self, designs)
        force = solution.stiffness * solution.displacement
        return np.where(solution.solved[..., np.newaxis], force, np.nan)

    def neper_gradient(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f Re(∂p/∂x_k / p)`` for designs (n, k), by differences, shape (n, v, k)."""
        closely = replace(self, tolerance=GRADIENT_TOLERANCE)

        def levels(rows: RealArray) -> RealArray:
            return np.asarray(np.log(np.abs(closely.pressure(rows))).sum(axis=-1))

        return np.stack([derivatives(levels, row, GRADIENT_STEP).T for row in designs])


class AmplitudeSolution(NamedTuple):
    """Motion of designs at all lines.

    - `ratio` (n, f, s): amplitude over the nominal one [1].
    - `displacement` (n, f, s): complex peak displacement of each spring [m].
    - `stiffness` (n, f, s): stiffness of the design at that amplitude [N/m].
    - `sweeps` (n, f): solutions that a line took; more than the allowed number where it was given
      up.
    """

    ratio: RealArray
    displacement: ComplexArray
    stiffness: ComplexArray
    sweeps: IntArray

    @property
    def solved(self) -> BoolArray:
        """Lines whose amplitudes came to rest, shape (n, f)."""
        return np.asarray(self.sweeps <= MOST_SWEEPS + MOST_SECANTS)


def solve_along_lines(motion: AmplitudeMotion, designs: RealArray) -> AmplitudeSolution:
    """Solve designs (n, k) line after line, each from the solution of the one before.

    Fixed point ``ln a ← ln |v q(K(a))|`` in all directions at once. A line begins with the ratios
    of the amplitudes to the nominal ones that the line before ended with, continued by their last
    change; the first line begins with 1. The ratios vary slowly even where the amplitudes do not.

    A solution exists at every line: stiffness is held between its bounds and has losses, so the
    amplitudes that follow from it are bounded, and the map is continuous (Brouwer). Plain iteration
    crawls where two solutions have just met and vanished, or are about to (a fold); after
    `MOST_SWEEPS` each direction takes secant steps of its own.
    """
    solutions = []
    start = before = np.ones((len(designs), 1, motion.lowest.shape[1]))
    springs = motion.nominal_springs(designs)
    for line in range(motion.frequency.size):
        at = np.array([line])
        solution = _fixed_point(motion, springs[:, at], at, start)
        start = solution.ratio * np.clip(solution.ratio / before, LEAST_STEP, MOST_STEP)
        before = solution.ratio
        solutions.append(solution)
    lines = zip(*solutions, strict=True)
    return AmplitudeSolution(*(np.concatenate(of_line, axis=1) for of_line in lines))


def _fixed_point(
    motion: AmplitudeMotion, nominal: ComplexArray, lines: IntArray, start: RealArray
) -> AmplitudeSolution:
    """Iterate lines of designs; a line rests once its amplitudes have come to rest."""
    follows = motion.follows
    ratio = np.array(start, dtype=float)
    displacement, stiffness = np.empty((2, *ratio.shape), dtype=complex)
    step, taken = np.full((2, *ratio.shape), np.nan)
    moving = np.ones(ratio.shape[:2], dtype=bool)
    sweeps = np.zeros(ratio.shape[:2], dtype=np.intp)
    for sweep in range(1, MOST_SWEEPS + MOST_SECANTS + 1):
        sweeps[moving] += 1
        at = np.nonzero(moving)
        line, before = lines[at[1]], ratio[at]
        springs = nominal[at] * motion.relative_stiffness(before, line)
        stiffness[at] = springs
        displacement[at] = motion.displacement(springs, line)
        after = np.abs(displacement[at]) / motion.amplitude[line]
        moves = np.abs(after - before) > motion.tolerance * after
        still_moving = (moves & follows).any(axis=1)
        if sweep > MOST_SWEEPS:
            last, step[at] = step[at], np.log(after / before)
            taken[at] = _secant(step[at], last, taken[at])
            after = before * np.exp(taken[at])
        for calm in (CALM, CALMER):
            if calm < sweep <= MOST_SWEEPS:
                after = np.sqrt(before * after)
        ratio[at] = np.where(still_moving[:, np.newaxis], after, before)
        moving[at] = still_moving
        if not moving.any():
            break
    return AmplitudeSolution(ratio, displacement, stiffness, sweeps + moving)


def _secant(step: RealArray, last: RealArray, taken: RealArray) -> RealArray:
    """Return what to take of fixed-point steps, from the last ones and what was taken of them."""
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (step - last) / taken
        gain = np.where(slope < 0.0, -1.0 / slope, MOST_GAIN)
    gain = np.where(np.isnan(slope), 1.0, np.clip(gain, LEAST_GAIN, MOST_GAIN))
    return np.clip(gain * step, -LONGEST_STEP, LONGEST_STEP)


def amplitude_motion(
    coupled: CoupledMotion,
    surfaces: Surfaces,
    load_case: LoadCase,
    settling: KinematicModel | None = None,
    *,
    follow: bool = True,
) -> AmplitudeMotion:
    """Let the stiffnesses of one load case follow the amplitude as the surfaces say.

    - `coupled`: motion identified from the same load case.
    - `surfaces`: surfaces by design variable, over wheel torque. A direction without one keeps its
      stiffness.
    - `load_case`: load case with its engine torque.
    - `settling`, optional: where given, a factor means the part itself, which settles elsewhere on
      these curves.
    - `follow`: whether stiffnesses follow the amplitude; if not, the motion is coupled only.
    - raises InputError: bodies with a receptance, or brackets; a run without engine torque; a line
      outside of the region in which a mount was measured; with `settling` see also `part_ratio`.

    ``K(a) = K_run S(T, a, f) / S(T, a_run, f)``: the run's own stiffness times the relative change
    that the surface S gives, so the nominal design moves exactly as measured. At fixed wheel torque
    and line the 20 terms of S collapse to a cubic in the amplitude.

    A surface is believed where lines were measured nearby. Of the amplitudes about the run's own
    one, the nearest that are not believed bound the cubic; beyond a bound the stiffness stays, and
    `AmplitudeMotion.clipped` says where. It never follows the cubic into the void.
    """
    if isinstance(coupled, FlexibleMotion):
        raise InputError(
            "stiffnesses that follow amplitude or preload go with bodies at rest: leave the "
            "receptances or driving points of the vehicles and the brackets of the mounts out, or "
            "take coupled motion with dynamic factors"
        )
    inside = np.isin(load_case.displacement.frequency, coupled.frequency)
    torque = load_case.wheel_torque[inside]
    amplitude = coupled.nominal_amplitude
    cubic = np.zeros((*amplitude.shape, 4), dtype=complex)
    cubic[..., 0] = 1.0
    lowest, highest = np.zeros(amplitude.shape), np.full(amplitude.shape, np.inf)
    for column, variable in enumerate(coupled.variables):
        name = coupled.variable_names[variable]
        if follow and name in surfaces:
            nominal = amplitude[:, column]
            line = (torque, nominal, coupled.frequency)
            where = f"load case {load_case.name}, {name}"
            cubic[:, column] = _relative_cubic(surfaces[name], *line)
            low, high = backed_range(surfaces[name], *line, "amplitude", where)
            lowest[:, column], highest[:, column] = low / nominal, high / nominal
    ratio = None if settling is None else part_ratio(settling, coupled, surfaces, load_case)
    return AmplitudeMotion(
        **vars(coupled), cubic=cubic, lowest=lowest, highest=highest, ratio=ratio
    )


def _relative_cubic(
    surface: DynamicStiffnessSurface, torque: RealArray, amplitude: RealArray, frequency: RealArray
) -> ComplexArray:
    """Return coefficients (f, 4) of the powers of the amplitude over the nominal one."""
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


def compare_starts(motion: AmplitudeMotion, designs: RealArray) -> RealArray:
    """Solve designs (n, k) from the amplitudes `STARTS` as well as from the line before.

    - returns (n, f): largest difference of the logarithm of an amplitude between two of the
      solutions [1]; above `SAME` a line has several of them. NaN where a start did not come to
      rest.
    """
    motion = replace(motion, tolerance=STARTS_TOLERANCE)
    springs, lines = motion.nominal_springs(designs), np.arange(motion.frequency.size)
    solutions = [solve_along_lines(motion, designs)]
    for amplitude in STARTS:
        start = np.broadcast_to(amplitude / motion.amplitude, springs.shape)
        solutions.append(_fixed_point(motion, springs, lines, start))
    logarithms = np.log([solution.ratio[..., motion.follows] for solution in solutions])
    difference = np.ptp(logarithms, axis=0).max(axis=-1, initial=0.0)
    solved = np.logical_and.reduce([solution.solved for solution in solutions])
    return np.where(solved, difference, np.nan)


@dataclass(frozen=True, eq=False)
class ResolvedDesign:
    """The motion of a design whose mounts were never together on a bench.

    - `motion`: coupled motion with the stiffnesses that the solved amplitudes give; at factors 1 it
      is the design.
    - `outside` (f, s): lines whose torque, frequency and amplitude lie outside of what the mount
      was measured at. The stiffness stays at the last amplitude that measurements back; where not
      even that of the reference is backed, the reference's own stiffness stays.
    - `kept`: variables without a surface; they keep the measured stiffness of the reference.
    - `sweeps`: sweeps until the amplitudes came to rest.
    """

    motion: CoupledMotion
    outside: BoolArray
    kept: tuple[str, ...]
    sweeps: int

    @property
    def pressure(self) -> ComplexArray:
        """Pressure at the ears, shape (v, f) [Pa]."""
        return np.asarray(self.motion.pressure(np.ones((1, len(self.motion.variable_names))))[0])


def resolve_design(
    reference: CoupledMotion, surfaces: Surfaces, torque: RealArray
) -> ResolvedDesign:
    """Solve the motion of mounts that are known by their surfaces alone.

    - `reference`: identified from a run with any other mounts: it gives inertia, geometry and
      excitation.
    - `surfaces`: surfaces of the design, by variable ``<mount> <axis>``, over wheel torque.
    - `torque` (f,): wheel torque at the lines of the reference [N m].
    - raises InputError: amplitudes that do not come to rest.

    ``(Σ K_i(T, a_i, f) v_i v_iᵀ − ω² M) q = F`` with ``a_i = |v_i q|``, as a fixed point from the
    reference's amplitudes. F is the excitation that the reference's motion and forces show, with
    the data sheet's inertia; an error of the latter enters both sides and mostly cancels.
    """
    frequency = reference.frequency
    names = [reference.variable_names[k] for k in reference.variables]
    amplitude = reference.nominal_amplitude
    backed = np.zeros(amplitude.shape, dtype=bool)
    lowest, highest = amplitude.copy(), amplitude.copy()
    followed = [column for column, name in enumerate(names) if name in surfaces]
    for column in followed:
        name, nominal = names[column], amplitude[:, column]
        at = surfaces[name].supported(operating_points(torque, nominal, frequency))
        backed[:, column] = at
        if at.any():
            line = torque[at], nominal[at], frequency[at]
            where = f"load case {reference.load_case}, {name}"
            bounds = backed_range(surfaces[name], *line, "amplitude", where)
            lowest[at, column], highest[at, column] = bounds
    for sweep in range(1, RESOLVE_SWEEPS + 1):
        stiffness = reference.stiffness
        clipped = np.clip(amplitude, lowest, highest)
        for column in followed:
            at = backed[:, column]
            points = operating_points(torque[at], clipped[at, column], frequency[at])
            surface = surfaces[names[column]]
            stiffness[at, column] = surface.predict(points, extrapolate=True)
        design = reference.with_stiffness(stiffness)
        moved = design.nominal_amplitude
        if np.max(np.abs(moved / amplitude - 1.0)) < RESOLVE_TOLERANCE:
            outside = np.zeros(backed.shape, dtype=bool)
            outside[:, followed] = (~backed | (clipped != amplitude))[:, followed]
            kept = tuple(dict.fromkeys(name for name in names if name not in surfaces))
            return ResolvedDesign(design, outside, kept, sweep)
        amplitude = moved if sweep <= CALM else np.sqrt(moved * amplitude)
    raise InputError(
        f"load case {reference.load_case}: the amplitudes of the design do not come to rest within "
        f"{RESOLVE_SWEEPS} sweeps"
    )
