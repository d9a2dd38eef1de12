"""Pareto fronts: made, verified with fresh draws, and compared; the only module with moocore.

All objectives are to be minimised. Fronts to compare are plain arrays of shape (n, m), finite.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import Enum

import moocore
import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from deboom.arrays import BoolArray, IntArray, RealArray, checked
from deboom.errors import InputError, listed
from deboom.explore.moments import CONFIDENCE
from deboom.explore.robust import Robust, RobustValues, chosen, joined
from deboom.explore.scatter import ToleranceSample, ToleranceSampler, sobol_sample
from deboom.tabled import Tabled

REAL_FROM = 0.99
"""Confidence from which a difference of two fronts is called real [1]."""
LAST_PART = 0.2
"""Last part of the generations, whose gain says how far a single search can be trusted [1]."""
ENOUGH_SEEDS = 3
"""Runs whose spread is their own measure of noise; fewer are judged by what each says of itself."""
LEFT_BY_DESCENTS = 5e-4
"""Standard deviation that a converged front of one seed is taken to have, as a share of the box
[1]: that of 15 seeds of F39 in prescribed motion, whose descents end in two or three ways; of 30
seeds of U06 it was 3e-5, and with draws of their own 1e-4."""
VERIFICATION = ("verification sample", *(f"verification sample, set {n}" for n in (2, 3, 4)))
"""Purposes of the draws behind every verified number: one independent scramble for each."""
SETS = 8
"""Independent scrambled sets that the common sample of a comparison consists of."""
_MARGIN = 0.1  # of the common box, by which the reference point lies beyond its worst corner


def pareto_front(*values: RobustValues) -> RobustValues:
    """Return the Pareto front of all feasible rows of all arguments, by the first objective.

    Of designs with equal objectives the one with the smallest first variable (then second, ...)
    stays, so that the order of rows and arguments does not matter.
    """
    merged = joined(values)
    keys = np.column_stack([merged.objectives, merged.designs])
    order = np.lexsort(keys.T[::-1])
    order = order[merged.feasible[order]]
    order = order[nondominated(merged.objectives[order])]
    return chosen(merged, order)


def nondominated(objectives: RealArray) -> BoolArray:
    """Return which rows, shape (n, m), no other row dominates; of equal rows the first."""
    if len(objectives) == 0:
        return np.zeros(0, dtype=bool)
    return np.asarray(moocore.is_nondominated(objectives), dtype=bool)


def hypervolume(objectives: RealArray, reference_point: npt.ArrayLike) -> float:
    """Return the volume that points, (n, m), dominate up to a reference point (m,).

    State the reference point beside every figure: hypervolumes of different ones do not compare.
    Points beyond it add nothing, and values that are not finite are refused.
    """
    reference = np.asarray(reference_point, dtype=float)
    if not (np.all(np.isfinite(objectives)) and np.all(np.isfinite(reference))):
        raise InputError("a hypervolume needs finite objectives: leave failed designs out")
    if len(objectives) == 0:
        return 0.0
    return float(moocore.hypervolume(objectives, ref=reference))


@dataclass(frozen=True, eq=False)
class Replicates:
    """A robust response under several independent scrambles of Sobol draws.

    - `sets`: the same response with each scramble.

    The mean over the scrambles has the standard error of their spread (A. B. Owen, "Scrambled net
    variance for integrals of smooth functions", Annals of Statistics 25, 1997), also where the
    formula for independent draws is many times too large.
    """

    sets: tuple[Robust, ...]

    @property
    def n_samples(self) -> int:
        """Number of draws of each scramble."""
        return self.sets[0].sample.n_samples

    @property
    def interval(self) -> float:
        """Half of a 95 % interval in standard errors, see `interval_of_scrambles` [1]."""
        return interval_of_scrambles(len(self.sets))

    def by_set(self, designs: RealArray) -> list[RobustValues]:
        """Return the values of designs (n, k) under each scramble."""
        return [robust(designs) for robust in self.sets]

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the means over the scrambles, with the standard errors of the two sums."""
        parts = self.by_set(designs)
        stacked = {
            column.name: np.stack([getattr(part, column.name) for part in parts])
            for column in fields(RobustValues)
            if column.name != "message"
        }
        errors = {
            f"standard_error_{name}": stacked[name].std(axis=0, ddof=1) / np.sqrt(len(parts))
            for name in ("mean_sum", "sigma_sum")
        }
        failed = stacked["failed"].any(axis=0)
        means = {name: values.mean(axis=0) for name, values in stacked.items()}
        said = np.stack([part.message for part in parts])
        message = said[(said != "").argmax(axis=0), np.arange(len(designs))]
        others = {"failed": failed, "designs": designs, "message": message}
        return RobustValues(**(means | errors | others))


def interval_of_scrambles(n: int) -> float:
    """Return half of a 95 % interval in standard errors that n scrambles gave [1].

    Student's t: 3.18 of four, whose intervals of ±1.96 standard errors hold 85 to 90 %.
    """
    return float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, n - 1))


def replicates(
    robust: Robust,
    n_samples: int,
    *,
    seed: int,
    purposes: Sequence[str] = VERIFICATION,
) -> Replicates:
    """Return a robust response with one scramble of `n_samples` Sobol draws for each purpose.

    `n_samples` is a power of two. The seed may be that of a search: the draws are others anyway.
    Only limits of numbers that other draws change are judged again.
    """
    # numbers of the design are the same under any draws, and more parts have more extreme ones
    limits = robust.limits.of_estimates
    samples = (
        sobol_sample(robust.n_draws, n_samples, seed=seed, purpose=name) for name in purposes
    )
    return Replicates(tuple(replace(robust, sample=each, limits=limits) for each in samples))


def verification_response(robust: Robust, n_samples: int = 1024, *, seed: int) -> Robust:
    """Return a robust response with the first scramble of `VERIFICATION`, which no search saw."""
    return replicates(robust, n_samples, seed=seed, purposes=VERIFICATION[:1]).sets[0]


def common_judges(judge: Robust, n_samples: int, seed: int) -> Replicates:
    """Return a model with each of the `SETS` of draws that several fronts meet."""
    purposes = [f"comparison sample, set {number}" for number in range(1, SETS + 1)]
    return replicates(judge, n_samples // SETS, seed=seed, purposes=purposes)


def verified(front: RobustValues, judge: Replicates) -> RobustValues:
    """Evaluate designs of a search again, with draws that the search never saw.

    Raises
    ------
    InputError
        Designs that fail altogether under the new draws.
    """
    values = judge(front.designs)
    if values.failed.all():
        raise InputError(
            f"none of the {len(front)} designs of the front could be computed with the "
            f"verification sample, the first one with '{values.message[0]}': check the model near "
            "the bounds of the design space"
        )
    return values


def unbeaten(values: RobustValues) -> BoolArray:
    """Return which rows could be computed and are dominated by no other such row, shape (n,)."""
    ok = np.flatnonzero(~values.failed)
    rows = np.zeros(len(values), dtype=bool)
    rows[ok[nondominated(values.objectives[ok])]] = True
    return rows


def search_bias(searched: RobustValues, verified: RobustValues) -> tuple[float, float]:
    """Return by how much a search misjudged its designs; negative if it was optimistic.

    Mean over the rows of searched minus verified `mean_sum` [response unit], and of the relative
    difference of `sigma_sum` [%]; rows that fail when verified are left out.
    """
    ok = ~verified.failed
    sigma = verified.sigma_sum[ok]
    excess = searched.sigma_sum[ok] - sigma
    relative = np.divide(excess, sigma, out=np.zeros_like(excess), where=sigma > 0.0)
    bias = float(np.mean(searched.mean_sum[ok] - verified.mean_sum[ok]))
    return bias, float(100.0 * np.mean(relative))


def thinned(front: RobustValues, n: int) -> RobustValues:
    """Return at most `n` rows of a front, of which those are left out that add least to it.

    The row whose hypervolume is smallest goes, again and again; the best of each objective stays.
    Of two objectives, each row that is left then gives way to the one between its neighbours that
    adds most.
    """
    if len(front) <= n:
        return front
    low, box = front.objectives.min(axis=0), np.ptp(front.objectives, axis=0)
    scaled = (front.objectives - low) / np.where(box > 0.0, box, 1.0)
    order = np.lexsort(scaled.T[::-1])
    points, rows = scaled[order], np.arange(len(order))
    ends = np.unique(points.argmin(axis=0))
    while len(rows) > max(n, len(ends)):
        adds = _added(points[rows])
        adds[np.isin(rows, ends)] = np.inf
        # of three objectives and more the next few go at once: each step costs many volumes
        leave = 1 if box.size == 2 else 1 + (len(rows) - n) // 16
        rows = np.delete(rows, np.argsort(adds, kind="stable")[:leave])
    if box.size == 2:
        rows = _settled(points, rows)
    return chosen(front, np.sort(order[rows]))


def _settled(points: RealArray, rows: IntArray) -> IntArray:
    """Return rows of points (n, 2), sorted by the first objective, each where it adds most.

    Between its neighbours, that is, until none moves; the first and the last stay.
    """
    kept, moved = rows.copy(), True
    while moved:
        moved = False
        for number in range(1, len(kept) - 1):
            low, high = kept[number - 1], kept[number + 1]
            between = points[low + 1 : high]
            adds = (points[high, 0] - between[:, 0]) * (points[low, 1] - between[:, 1])
            best = low + 1 + int(adds.argmax())
            moved |= bool(adds[best - low - 1] > adds[kept[number] - low - 1])
            kept[number] = best
    return kept


def _added(points: RealArray) -> RealArray:
    """Return the hypervolume that each point, sorted by the first objective, adds, shape (n,)."""
    if points.shape[1] != 2:
        volumes = moocore.hv_contributions(points, ref=np.full(points.shape[1], 1.0 + _MARGIN))
        return np.array(volumes, dtype=float)
    steps = np.diff(points, axis=0)
    adds = np.full(len(points), np.inf)
    adds[1:-1] = -steps[1:, 0] * steps[:-1, 1]
    return adds


@checked(ideal="m", nadir="m")
class CommonBox:
    """The box of the best front that several fronts make together: unit of their figures of merit.

    - `ideal`, `nadir` (m,): best and worst value of each objective on the common front
      [their units].
    """

    ideal: RealArray
    nadir: RealArray

    @property
    def span(self) -> RealArray:
        """Size of the box, shape (m,); 1 where the common front does not extend [their units]."""
        span = self.nadir - self.ideal
        return np.asarray(np.where(span > 0.0, span, 1.0))

    @property
    def reference_point(self) -> RealArray:
        """Reference point of the hypervolume, shape (m,) [their units]."""
        return np.asarray(self.nadir + _MARGIN * self.span)

    def hypervolume(self, objectives: RealArray) -> float:
        """Return the share of the box up to the reference point that a front dominates [1]."""
        m = len(self.ideal)
        scaled = (objectives - self.ideal) / self.span
        return hypervolume(scaled, np.full(m, 1.0 + _MARGIN)) / (1.0 + _MARGIN) ** m

    def share(self, volume: float) -> float:
        """Return a hypervolume in the objectives' own units as a share of the same box [1]."""
        return float(volume / np.prod(self.reference_point - self.ideal))


def common_box(fronts: Sequence[RealArray]) -> CommonBox:
    """Return the box of the union of fronts, each of shape (n_i, m), finite and not empty."""
    if not fronts:
        raise InputError("there are no fronts to compare: bring at least one")
    width = fronts[0].shape[1]
    for number, front in enumerate(fronts, start=1):
        if len(front) == 0 or front.shape[1] != width or not np.all(np.isfinite(front)):
            raise InputError(
                f"front {number} has shape {front.shape}: fronts to compare have at least one row "
                "of finite values and the same objectives"
            )
    union = np.concatenate(fronts)
    best = union[nondominated(union)]
    low, high = best.min(axis=0), best.max(axis=0)
    # one design may beat all others: they say how large a difference is
    return CommonBox(low, np.where(high > low, high, union.max(axis=0)))


def coverage(front: RealArray, other: RealArray) -> float:
    """Return the share of another front's points that a front equals or beats [1].

    Notes
    -----
    C(front, other) of E. Zitzler and L. Thiele, "Multiobjective evolutionary algorithms: a
    comparative case study", IEEE Transactions on Evolutionary Computation 3, 1999. Both directions
    belong together: they need not add up to 1.
    """
    beaten = np.all(front[:, None, :] <= other[None, :, :], axis=2).any(axis=0)
    return float(np.mean(beaten))


def attainment(fronts: Sequence[RealArray], shares: Sequence[float]) -> Mapping[float, RealArray]:
    """Return what a share of all fronts attains.

    - `fronts` (n_i, m): fronts such as of several seeds, with two or three objectives.
    - `shares`: shares above 0, up to 1; 0.5 is the median [1].
    - returns (n, m): points for each share that at least so many fronts equal or beat, themselves a
      front.

    Levels of the empirical attainment function (C. M. Fonseca, V. Grunert da Fonseca, L. Paquete,
    "Exploring the performance of stochastic multiobjective optimisers with the second-order
    attainment function", EMO 2005).
    """
    if any(not 0.0 < share <= 1.0 for share in shares):
        raise InputError(f"attainment of {list(shares)} of all fronts: take shares up to 1")
    points = np.concatenate(fronts)
    sets = np.repeat(np.arange(1, len(fronts) + 1), [len(front) for front in fronts])
    levels = {}
    for share in shares:
        # whole fronts: an attainment of 2.5 of 5 fronts is one of 3
        needed = 100.0 * np.ceil(share * len(fronts) - 1e-9) / len(fronts)
        surface = moocore.eaf(points, sets, percentiles=[needed])[:, :-1]
        levels[share] = np.asarray(surface[np.lexsort(surface.T[::-1])])
    return levels


def level_gap(front: RealArray, other: RealArray) -> float:
    """Return how much better a front is in the first objective at equal second objective.

    Mean of ``front - other`` over 200 values of the second objective, evenly over the
    range that both fronts, (n, 2), have: negative if the front is better; NaN if the ranges do not
    meet.
    """
    low = max(front[:, 1].min(), other[:, 1].min())
    high = min(front[:, 1].max(), other[:, 1].max())
    if not low < high:
        return float("nan")
    levels = np.linspace(low, high, 200)
    return float(np.mean(_best_first(front, levels) - _best_first(other, levels)))


def _best_first(front: RealArray, levels: RealArray) -> RealArray:
    """Smallest first objective of the points whose second one is at most each level."""
    order = np.argsort(front[:, 1], kind="stable")
    best = np.minimum.accumulate(front[order, 0])
    return np.asarray(best[np.searchsorted(front[order, 1], levels, side="right") - 1])


class FrontVerdict(Enum):
    """What a comparison of two fronts says."""

    real = "real difference"
    noise = "within noise"
    open = "not decided"
    equal = "equal fronts"


@dataclass(frozen=True, eq=False)
class JudgedFront:
    """A front under the draws of a comparison, and what is known of the chance of its search.

    - `by_set` (n_sets, n, m): objectives under each set of draws [their units].
    - `gain`: what the last part of the search has gained, see `last_gain` [product of the
      objectives' units]; NaN: not known.
    - `converged`: whether descents have brought the whole front to convergence.
    - `seeds`: fronts (n_i, m) of the searches that were merged, as these saw them [units of the
      objectives]; empty of a single search.
    - `designs` (n, k), `found_with`: designs and the draws of their search [units of the space];
      None where these are not known.
    """

    by_set: RealArray
    designs: RealArray
    gain: float = np.nan
    converged: bool = False
    seeds: tuple[RealArray, ...] = ()
    found_with: ToleranceSampler | None = None

    @property
    def is_trusted(self) -> bool:
        """Whether its noise is known, and not stood in for by the gain of its search."""
        return self.converged or len(self.seeds) >= ENOUGH_SEEDS

    def noise(self, box: CommonBox) -> tuple[float, float]:
        """Return the standard deviation of its merit over seeds, and its degrees of freedom.

        A gain that is not known, or lies outside the box, counts as the whole hypervolume.
        """
        if self.converged:
            return LEFT_BY_DESCENTS, np.inf
        if self.is_trusted:
            volumes = [box.hypervolume(front) for front in self.seeds]
            return float(np.std(volumes, ddof=1)), len(volumes) - 1.0
        return float(np.fmin(box.share(self.gain), self.merit(box).mean())), np.inf

    def merit(self, box: CommonBox) -> RealArray:
        """Return the share of the box that it dominates under each set, shape (n_sets,) [1]."""
        return np.array([box.hypervolume(objectives) for objectives in self.by_set])


@checked(merit="n s ?", noise="n", freedom="n ?")
class Contestant:
    """The runs of one configuration, which differ in nothing but their seed.

    - `name`: name of the configuration.
    - `merit` (n_runs, n_sets): figure of merit, such as the hypervolume, of each run under each of
      at least two independent sets of draws, which all contestants share.
    - `noise` (n_runs,): standard deviation of the merit over seeds, as each run tells it alone.
    - `freedom` (n_runs,): degrees of freedom of `noise`.
    - `is_trusted`: whether `noise` is more than a stand-in.
    - `least`: standard deviation that the spread of several runs does not fall below.
    """

    name: str
    merit: RealArray
    noise: RealArray
    freedom: RealArray
    is_trusted: bool = False
    least: float = 0.0

    @property
    def is_enough(self) -> bool:
        """Whether more seeds would add little."""
        return self.is_trusted or len(self.merit) >= ENOUGH_SEEDS

    @property
    def search_noise(self) -> list[tuple[float, float]]:
        """Standard errors of the mean merit from seed to seed, with their degrees of freedom."""
        n = len(self.merit)
        if n < ENOUGH_SEEDS:
            return [(float(np.sqrt(np.mean(self.noise**2) / n)), float(self.freedom.sum()))]
        spread = float(self.merit.mean(axis=1).std(ddof=1))
        return [(spread / np.sqrt(n), n - 1.0), (self.least / np.sqrt(n), np.inf)]


@dataclass(frozen=True)
class Difference(Tabled):
    """Difference of two fronts, or of two lists of fronts, first minus second.

    - `value`, `draw_error`, `search_error`: difference of the shares of the common box that the
      fronts dominate, and its standard errors from the draws and the searches [1].
    - `noise`, `verdict`: largest difference that 99 % confidence still calls chance [1], and what
      follows.
    - `too_few`: names of those whose seeds are too few for a verdict.
    - `left_out`: designs of either that fail under the common draws, and are left out.

    See Also
    --------
    deboom.compare, deboom.verify
    """

    value: float
    draw_error: float
    search_error: float
    noise: float
    verdict: FrontVerdict
    too_few: tuple[str, ...] = ()
    left_out: tuple[int, int] = (0, 0)

    @property
    def text(self) -> str:
        """The verdict in words, and what would decide it."""
        size = f"{100.0 * self.value:+.2f} % of the common box, noise ±{100.0 * self.noise:.2f} %"
        if self.verdict is FrontVerdict.equal:
            size = "the same designs, or designs of the same values under all draws"
        words = f"{self.verdict.value} ({size})"
        if self.too_few:
            words += (
                f"; what would decide: {ENOUGH_SEEDS} seeds of {listed(self.too_few)}, searched "
                f"with searches={ENOUGH_SEEDS} or given as a list of fronts"
            )
        if any(self.left_out):
            words += (
                f"; {self.left_out[0]} designs of the first and {self.left_out[1]} of the second "
                "fail under the common draws and are left out"
            )
        return words + "."

    @property
    def table(self) -> pd.DataFrame:
        """The verdict in one row; shares of the common box."""
        numbers = {"difference [%]": 100.0 * self.value, "noise ± [%]": 100.0 * self.noise}
        return pd.DataFrame([numbers | {"verdict": self.verdict.value}])


def contestant(name: str, fronts: Sequence[JudgedFront], box: CommonBox) -> Contestant:
    """Return the runs of one configuration with their merits in a common box."""
    noise, freedom = np.array([front.noise(box) for front in fronts]).T
    return Contestant(
        name=name,
        merit=np.array([front.merit(box) for front in fronts]),
        noise=noise,
        freedom=freedom,
        is_trusted=all(front.is_trusted for front in fronts),
        least=LEFT_BY_DESCENTS if all(front.converged for front in fronts) else 0.0,
    )


def front_difference(
    first: Sequence[JudgedFront],
    second: Sequence[JudgedFront],
    *,
    box: CommonBox,
    names: tuple[str, str],
    judge: Robust,
    may_cover_by_chance: bool = True,
) -> Difference:
    """Say whether fronts are equal, really different, or different by chance.

    - `first`, `second`: runs of two configurations, which differ in nothing but their seed.
    - `names`: of the configurations.
    - `judge`: the model that judges all.
    - `may_cover_by_chance`: whether the two may differ in nothing but their seed, so that one front
      may cover the other by chance.

    See `difference`. A front that covers all of another under all draws, and not the reverse, is
    really better also where the search of the other is not to be trusted, if what is known of the
    noise is smaller than the difference: its own search is trusted, or the configurations differ.
    """
    if sorted(map(_content, first)) == sorted(map(_content, second)):
        return Difference(0.0, 0.0, 0.0, 0.0, FrontVerdict.equal)
    sides = contestant(names[0], first, box), contestant(names[1], second, box)
    advantage = home_advantage(first, second, judge)
    result = difference(*sides, advantage)
    if result.verdict is FrontVerdict.real:
        return result
    order = 1 if result.value > 0.0 else -1
    better, worse = (first, second)[::order]
    if may_cover_by_chance and not sides[::order][0].is_enough:
        return result
    trusted = [replace(side, noise=side.noise * side.is_trusted) for side in sides]
    by_trusted = difference(trusted[0], trusted[1], advantage)
    if by_trusted.verdict is FrontVerdict.real and _covers(better, worse):
        return replace(result, verdict=FrontVerdict.real, too_few=())
    return result


def home_advantage(
    first: Sequence[JudgedFront], second: Sequence[JudgedFront], judge: Robust
) -> float:
    """Return how much better two converged fronts are under the draws of their own search [1].

    Better than under those of the other, as a share of their box, in the mean of both. Descents fit
    a front to the draws of its search: what two fronts with different draws differ by under any
    third ones is then of this size. 0 where the draws are the same, not known or not the judge's,
    or where the spread of several seeds tells it.
    """
    if min(len(first), len(second)) >= ENOUGH_SEEDS:
        return 0.0
    both = first[0], second[0]
    samples = [
        front.found_with
        for front in both
        if isinstance(front.found_with, ToleranceSample)
        and front.found_with.n_variables == judge.n_draws
    ]
    if len(samples) < 2 or not all(front.converged for front in both):
        return 0.0
    volumes = []
    for sample in samples:
        values = [replace(judge, sample=sample)(front.designs).objectives for front in both]
        finite = [rows[np.isfinite(rows).all(axis=1)] for rows in values]
        if not all(map(len, finite)):
            return 0.0
        box = common_box(finite)
        volumes.append(box.hypervolume(finite[0]) - box.hypervolume(finite[1]))
    return 0.5 * abs(volumes[0] - volumes[1])


def _content(front: JudgedFront) -> bytes:
    """Return what equal fronts have in common, whatever the order of their designs."""
    rows = np.moveaxis(front.by_set, 1, 0).reshape(front.by_set.shape[1], -1)
    return bytes(np.unique(rows, axis=0).tobytes())


def _covers(better: Sequence[JudgedFront], worse: Sequence[JudgedFront]) -> bool:
    """Tell whether each front covers all of each other one under all draws, and not the reverse."""
    pairs = [
        (coverage(front, other), coverage(other, front))
        for run in better
        for rival in worse
        for front, other in zip(run.by_set, rival.by_set, strict=True)
    ]
    return all(there == 1.0 > back for there, back in pairs)


def difference(first: Contestant, second: Contestant, home_advantage: float = 0.0) -> Difference:
    """Say whether one contestant is really better than another, or whether it could be chance.

    The difference is real when it exceeds ``t s``. ``s²`` adds up the variance from the draws and
    that from the searches. The draws: the difference is taken under each of n_sets independent
    scrambled sets, and its mean has the standard error of their spread (A. B. Owen, "Scrambled net
    variance for integrals of smooth functions", Annals of Statistics 25, 1997); what all fronts
    have in common cancels. The searches: from three seeds on the standard error over the seeds. A
    single run has the noise that `JudgedFront.noise` says: what descents leave of a front that has
    converged (`LEFT_BY_DESCENTS`, below which several of them do not fall either), the spread of
    the seeds that it was merged from, or else the gain of the last fifth of its generations, which
    may be far too large: what it cannot tell from chance is not decided. What `home_advantage`
    gives is added with four degrees of freedom, with which 0 to 2 % of pairs of closed-form
    problems with 16 and 64 draws were called different. ``t`` is Student's, two-sided at
    `REAL_FROM`, with the degrees of freedom of B. L. Welch (Biometrika 34, 1947).
    """
    if first.merit.shape[1] != second.merit.shape[1]:
        raise InputError(f"{first.name} and {second.name} are not judged by the same draws")
    by_set = first.merit.mean(axis=0) - second.merit.mean(axis=0)
    value, n_sets = float(by_set.mean()), by_set.size
    draw_error = float(by_set.std(ddof=1) / np.sqrt(n_sets))
    of_searches = [*first.search_noise, *second.search_noise, (home_advantage, 4.0)]
    search_error = float(np.linalg.norm([size for size, _ in of_searches]))
    error = float(np.hypot(draw_error, search_error))
    noise = _student([(draw_error, n_sets - 1.0), *of_searches], error) * error
    if abs(value) > noise:
        return Difference(value, draw_error, search_error, noise, FrontVerdict.real)
    too_few = tuple(side.name for side in (first, second) if not side.is_enough)
    verdict = FrontVerdict.open if too_few else FrontVerdict.noise
    return Difference(value, draw_error, search_error, noise, verdict, too_few)


def _student(parts: list[tuple[float, float]], error: float) -> float:
    """Quantile for errors of different degrees of freedom."""
    spread = sum(part**4 / freedom for part, freedom in parts)
    freedom = error**4 / spread if spread > 0.0 else np.inf
    quantile = 0.5 + REAL_FROM / 2.0
    t = stats.t.ppf(quantile, freedom) if np.isfinite(freedom) else stats.norm.ppf(quantile)
    return float(t)


def last_gain(hypervolumes: RealArray) -> float:
    """Return what the last part of a search's generations has gained [unit of the hypervolume].

    NaN for a search of fewer than two generations.
    """
    n = len(hypervolumes)
    if n < 2:
        return float("nan")
    before = min(max(round((1.0 - LAST_PART) * n), 1), n - 1)
    return float(hypervolumes[-1] - hypervolumes[before - 1])
