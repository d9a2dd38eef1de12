"""Cross stiffness: whether a mount stands at an angle that is not stated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.optimize import OptimizeResult, least_squares
from scipy.spatial.transform import Rotation

from deboom.arrays import AXES, ComplexArray, IntArray, RealArray
from deboom.measurement.channels import LoadCase
from deboom.measurement.sensors import Tolerances
from deboom.mounts.mount import Mount, in_mount_axes
from deboom.mounts.operating_map import OperatingMap

LINES = 400
"""Lines that are looked at, at most."""

EFFECTIVE_LINES = 15
"""What the lines count for [1]: a stiffness misses neighbouring ones alike."""

LEAST_MISFIT = 0.003
"""Part of a force that no stiffness of the form that is fitted explains, at least [1]."""

USUAL_ANGLE = np.deg2rad(20.0)
"""Standard deviation of an unstated angle before anything is measured [rad]."""

DEGREE = 3
"""Degree of a stiffness over preload, frequency and amplitude."""

PRELOAD_DEGREE = 9
"""Degree over the preload alone, the first variable of a state: a stop sets in."""

OTHER_AXES = 0.2
"""Weight of the whole motion in the amplitude that an axis' stiffness depends on [1]."""

CLEAR = 5.0
"""Twice the logarithm of the likelihood that an angle must bring. Parallel mounts of drawn benches
stay below 4."""

CLEAR_CROSS = 12.0
"""The same of cross stiffness that no angle explains. Drawn benches stay below 4."""

DECIDED = np.deg2rad(4.0)
"""Largest standard deviation of an angle that is named [rad]."""

MODEL_ERROR = np.deg2rad(1.5)
"""Standard deviation of a named angle by the form of the stiffness [rad]; from drawn benches."""

QUANTILE = 1.645
"""Half width of an interval of 90 % over its standard deviation."""

RIDGE = 1e-9
"""Keeps terms apart that the lines do not tell apart [1]."""

PAIRS = tuple((a, b) for a in range(3) for b in range(3) if a != b)
"""Axes that may lean towards each other."""

GRID = tuple(product(np.deg2rad([-18.0, 0.0, 18.0]), repeat=3))
"""Angles among which starts are chosen [rad]."""

STARTS = 6
"""Starts from which the angles are looked for where they matter."""

NEAR = np.deg2rad(1.0)
"""Fits whose angles differ by less have ended in one maximum [rad]."""

LIKELY = 2.0
"""Maxima of the posterior whose logarithm lies this far below the best are left out."""


@dataclass(frozen=True, eq=False)
class CrossStiffness:
    """What an angle, or displacements across an axis, bring to the force along it.

    - `mount`: ``<mount> [<piece>]``.
    - `by_angle`: twice the logarithm of the likelihood that an angle brings [1].
    - `by_cross`: the same that free cross stiffness brings beyond the angle [1].
    - `angles`, `deviations` (3,): rx, ry, rz from how it is stated to stand, about fixed axes x,
      then y, then z, and their standard deviations [rad].
    """

    mount: str
    by_angle: float
    by_cross: float
    angles: RealArray
    deviations: RealArray

    @property
    def clear(self) -> bool:
        """Whether the mount clearly stands otherwise than stated, or has cross stiffness.

        An angle whose size stays open must bring more: in a laboratory with four times the stated
        noise, three runs bring up to 8 for such angles of a parallel mount.
        """
        strength = max(self.by_angle, self.by_cross)
        return strength > CLEAR_CROSS or (self.by_angle > CLEAR and any(self.decided))

    @property
    def decided(self) -> tuple[bool, bool, bool]:
        """Whether rx, ry, rz are known well enough to be named."""
        x, y, z = (bool(deviation < DECIDED) for deviation in self.deviations)
        return x, y, z

    @property
    def sentence(self) -> str:
        """Alarm in a sentence."""
        start = f"mount {self.mount}: "
        if self.by_cross > CLEAR_CROSS:
            return (
                f"{start}displacements across its axes bring force along them, and no angle "
                "explains it: check its axes and signs, or take it for a mount with cross "
                "stiffness, which factors along axes do not describe"
            )
        named = [
            f"r{axis} = {np.rad2deg(angle):z.0f} ± {np.rad2deg(QUANTILE * deviation):.0f} deg"
            for axis, angle, deviation, decided in zip(
                AXES, self.angles, self.deviations, self.decided, strict=True
            )
            if decided
        ]
        open_angles = [
            f"r{axis}" for axis, decided in zip(AXES, self.decided, strict=True) if not decided
        ]
        if not named:
            return (
                f"{start}it stands at an angle that is not stated, or has cross stiffness; these "
                "runs do not decide its size: look how it stands, and state the angles in the "
                "mount table"
            )
        rest = f"; these runs do not decide {' and '.join(open_angles)}" if open_angles else ""
        return (
            f"{start}it stands at an angle that is not stated: {', '.join(named)} (90 %, errors of "
            f"measurement alone) from how it is stated to stand{rest}: look how it stands, and "
            "state the angles of its drawing, not these, in the mount table"
        )


@dataclass(frozen=True, eq=False)
class _Comparison:
    """A mount's force explained along axes that are turned, sensors and shaker being askew.

    Displacement and force are (n, 3) along the stated axes, the state (n, k) is scaled to -1 … 1;
    `askew` (12,) are standard deviations of the angles between axes of sensors, then of the shaker
    [rad]. Unknowns (15,): three angles [rad], and by how many of their standard deviations
    sensors and shaker are askew. An axis' stiffness is fitted for each choice of them.
    """

    displacement: ComplexArray
    force: ComplexArray
    state: RealArray
    askew: RealArray

    @cached_property
    def state_terms(self) -> tuple[RealArray, IntArray, RealArray]:
        """Terms of a stiffness that the state alone decides, for all choices of the unknowns.

        Products of Legendre polynomials of the state (n, n_term), the degree (n_term,) of the
        polynomial of the amplitude that each is multiplied by, and what the preload has more.
        """
        powers = legvander(self.state, DEGREE)
        degrees = [
            each
            for each in product(range(DEGREE + 1), repeat=self.state.shape[1] + 1)
            if sum(each) <= DEGREE
        ]
        terms = [
            np.prod([powers[:, k, degree] for k, degree in enumerate(each[:-1])], axis=0)
            for each in degrees
        ]
        of_preload = legvander(self.state[:, 0], PRELOAD_DEGREE)[:, DEGREE + 1 :]
        preload = np.asarray(of_preload, dtype=np.float64)
        return np.column_stack(terms), np.array([each[-1] for each in degrees]), preload

    def rest(self, unknowns: RealArray, *, cross: bool = False) -> ComplexArray:
        """Return the unexplained force over the size of the whole force, shape (3, n) [1]."""
        turn = Rotation.from_euler("xyz", unknowns[:3]).as_matrix()
        leaning = self.askew * unknowns[3:]
        sensors, shaker = np.eye(3), np.eye(3)
        for k, (a, b) in enumerate(PAIRS):
            sensors[a, b] -= leaning[k]
            shaker[a, b] -= leaning[len(PAIRS) + k]
        size = np.linalg.norm(self.force, axis=1)
        moved = self.displacement @ sensors.T @ turn / size[:, np.newaxis]
        pushed = self.force @ shaker.T @ turn / size[:, np.newaxis]
        whole = np.linalg.norm(moved, axis=1)
        by_state, degree, preload = self.state_terms
        rests = []
        for axis in range(3):
            along = np.abs(moved[:, axis])
            felt = np.hypot(along, OTHER_AXES * whole) * size
            by_amplitude = legvander(_scaled(np.log(felt)), DEGREE)[:, degree]
            terms = np.hstack([by_state * by_amplitude, preload])
            # with the phase of the displacement for zero the columns are real
            phase = np.exp(-1j * np.angle(moved[:, axis]))
            columns = terms * along[:, np.newaxis]
            if cross:  # a constant stiffness each
                others = np.delete(moved, axis, axis=1) * phase[:, np.newaxis]
                columns = np.hstack([columns, others])
            rests.append(_unexplained(pushed[:, axis] * phase, columns) / phase)
        return np.stack(rests)

    def misfit(self, unknowns: RealArray) -> float:
        """Return the root mean square of the rest [1], at least `LEAST_MISFIT`."""
        return float(np.hypot(np.sqrt(np.mean(np.abs(self.rest(unknowns)) ** 2)), LEAST_MISFIT))

    def weighted(self, rest: ComplexArray, misfit: float) -> RealArray:
        """Return residuals whose squares add up to twice the logarithm of the likelihood."""
        each = (rest * np.sqrt(EFFECTIVE_LINES / len(self.force)) / misfit).ravel()
        return np.concatenate([each.real, each.imag])

    def solve(self, start: RealArray, misfit: float, *, turned: bool = True) -> OptimizeResult:
        """Fit the unknowns, or those of sensors and shaker alone."""
        first = 0 if turned else 3

        def residuals(free: RealArray) -> RealArray:
            unknowns = np.concatenate([np.zeros(first), free])
            prior = np.concatenate([unknowns[:3] / USUAL_ANGLE, unknowns[3:]])
            return np.concatenate([self.weighted(self.rest(unknowns), misfit), prior])

        scale = np.concatenate([np.full(3, 0.1), np.ones(12)])
        return least_squares(
            residuals,
            start[first:],
            x_scale=scale[first:],
            ftol=1e-3,
            xtol=1e-4,
            max_nfev=30,
        )


def cross_stiffness(
    mount: str,
    displacement: ComplexArray,
    force: ComplexArray,
    state: RealArray,
    tolerances: Tolerances,
) -> CrossStiffness:
    """Judge whether a mount's force follows from its own displacements along the stated axes.

    - `mount`: ``<mount> [<piece>]``.
    - `displacement`, `force` (n, 3): along the axes that are stated [m], [N].
    - `state` (n, k): what the stiffness may depend on besides the amplitude, the preload such as a
      wheel torque first.
    - `tolerances`: of sensors, cells and shaker.

    Along the axes of the mount ``f_a = K_a s_a``, K_a a polynomial in state and amplitude by least
    squares; the angles of the mount, of the sensors and of the shaker follow from all lines
    together, those of sensors and shaker within their tolerances (errors in variables, maximum of
    the posterior). Motion that is nearly alike in all lines, or stiffnesses that are nearly alike,
    leave angles open: their deviations say so.
    """
    sensor = np.hypot(tolerances.sensor_angle, tolerances.sensor_cross_axis)
    askew = np.repeat([sensor, tolerances.shaker_angle], len(PAIRS))
    comparison = _comparison(displacement, force, state, np.asarray(askew))
    upright = np.zeros(15)
    grid = [np.concatenate([angles, upright[3:]]) for angles in GRID]
    costs = [np.sum(np.abs(comparison.rest(start)) ** 2) for start in grid]
    order = np.argsort(costs)
    misfit = comparison.misfit(comparison.solve(grid[order[0]], comparison.misfit(upright)).x)
    held = comparison.solve(upright, misfit, turned=False)
    starts = [grid[order[0]], np.concatenate([np.zeros(3), held.x])]
    fits = [comparison.solve(start, misfit) for start in starts]
    if 2.0 * (held.cost - min(fit.cost for fit in fits)) > CLEAR:
        fits += [comparison.solve(grid[k], misfit) for k in order[1:STARTS]]
    best = min(fits, key=lambda fit: float(fit.cost))
    free = np.sum(comparison.weighted(comparison.rest(upright, cross=True), misfit) ** 2)
    return CrossStiffness(
        mount,
        by_angle=float(2.0 * (held.cost - best.cost)),
        by_cross=float(2.0 * best.cost - free),
        angles=best.x[:3],
        deviations=_deviations(best, fits),
    )


def unexplained_along_axes(
    displacement: ComplexArray, force: ComplexArray, state: RealArray
) -> float:
    """Return the part of a force that no stiffness along the stated axes explains, rms [1].

    Arguments as those of `cross_stiffness`, without any error of sensors and shaker.
    """
    exact = _comparison(displacement, force, state, np.zeros(2 * len(PAIRS)))
    rest = exact.rest(np.zeros(3 + 2 * len(PAIRS)))
    return float(np.sqrt(np.mean(np.sum(np.abs(rest) ** 2, axis=0))))


def _comparison(
    displacement: ComplexArray, force: ComplexArray, state: RealArray, askew: RealArray
) -> _Comparison:
    """Compare at most `LINES` lines."""
    every = slice(None, None, -(-len(force) // LINES))
    return _Comparison(displacement[every], force[every], _scaled(state[every]), askew)


def _deviations(best: OptimizeResult, fits: Sequence[OptimizeResult]) -> RealArray:
    """Return standard deviations of the angles, (3,) [rad], over all maxima of the posterior."""
    squares, weights = [], []
    for fit in fits:
        if fit.cost - best.cost > LIKELY:
            continue
        near = [np.allclose(fit.x[:3], other.x[:3], atol=NEAR) for other in fits]
        covariance = np.linalg.inv(fit.jac.T @ fit.jac)[:3, :3]
        squares.append(np.diag(covariance) + (fit.x[:3] - best.x[:3]) ** 2)
        weights.append(np.exp(best.cost - fit.cost) / np.sum(near))
    mean = np.average(np.array(squares), axis=0, weights=weights)
    return np.asarray(np.sqrt(mean + MODEL_ERROR**2))


def cross_stiffness_of_maps(
    maps: Mapping[str, OperatingMap], tolerances: Tolerances
) -> tuple[CrossStiffness, ...]:
    """Judge the mounts of a campaign of which all three axes were measured.

    - `maps`: operating maps by ``<mount> <axis>``.
    - `tolerances`: of the campaign.
    """
    judged = []
    for mount in dict.fromkeys(measured.mount for measured in maps.values()):
        axes = [maps.get(f"{mount} {axis}") for axis in AXES]
        of_axes = [measured for measured in axes if measured is not None]
        if len(of_axes) < len(AXES):
            continue
        first = of_axes[0]
        moved = np.stack([measured.displacement for measured in of_axes], axis=1)
        pushed = np.stack([measured.force for measured in of_axes], axis=1)
        state = np.stack([first.wheel_torque, first.frequency], axis=1)
        judged.append(cross_stiffness(mount, moved, pushed, state, tolerances))
    return tuple(judged)


def cross_stiffness_of_runs(
    mounts: Sequence[Mount], load_cases: Sequence[LoadCase]
) -> tuple[CrossStiffness, ...]:
    """Judge the mounts of a platform of which all three axes were measured.

    - `mounts`: mounts as they are stated to stand.
    - `load_cases`: motion and forces in vehicle axes; runs with engine torque, else by frequency.
    """
    runs = [in_mount_axes(mounts, case) for case in load_cases]
    recorded = all(case.engine_torque is not None for case in runs)
    lines = np.concatenate([case.force.frequency for case in runs])
    columns = [np.concatenate([case.wheel_torque for case in runs])] if recorded else []
    columns.append(lines)
    state = np.stack(columns, axis=1)
    judged = []
    for mount in mounts:
        for piece in range(len(mount.pieces)):
            names = [mount.channels(axis)[piece] for axis in AXES]
            if not all(set(names) <= set(case.force.channels) for case in runs):
                continue
            moved = np.vstack([case.displacement.select(names).values for case in runs])
            pushed = np.vstack([case.force.select(names).values for case in runs])
            title = f"{mount.name} {mount.pieces[piece]}".strip()
            judged.append(cross_stiffness(title, moved, pushed, state, Tolerances()))
    return tuple(judged)


def _scaled(values: RealArray) -> RealArray:
    """Scale columns to -1 … 1."""
    low, high = values.min(axis=0), values.max(axis=0)
    return np.asarray((2.0 * values - low - high) / np.where(high > low, high - low, 1.0))


def _unexplained(force: ComplexArray, columns: RealArray | ComplexArray) -> ComplexArray:
    """Return what columns (n, k) leave of a force by least squares, shape (n,)."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    gram = scaled.conj().T @ scaled + RIDGE * np.eye(scaled.shape[1])
    return np.asarray(force - scaled @ np.linalg.solve(gram, scaled.conj().T @ force))
