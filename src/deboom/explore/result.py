"""The result of a search: its evaluations, and its front, verified with new draws."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import pandas as pd

from deboom.arrays import PERCENT, BoolArray, RealArray, checked, short_repr
from deboom.errors import InputError
from deboom.explore.front import (
    Difference,
    JudgedFront,
    Replicates,
    common_box,
    common_judges,
    front_difference,
    hypervolume,
    last_gain,
    pareto_front,
    replicates,
    search_bias,
    unbeaten,
    verified,
)
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM
from deboom.explore.robust import Robust, RobustValues, joined
from deboom.explore.selection import (
    ByPick,
    at_nominal,
    knee,
    most_desirable,
    nearest_to_ideal,
    nearest_to_reference,
    nearest_to_weights,
    pick,
    pick_of_any,
    variables_without_effect,
)
from deboom.explore.space import Evaluate, check_same_names, spread_unit
from deboom.tabled import Tabled


@checked(hypervolume="g ?", reference_point="m ?")
class SearchResult:
    """What a search found and how.

    - `front`: front of all designs seen, not only of the last population.
    - `evaluated`: every design that was evaluated.
    - `seed`, `seconds`: seed, and wall time of all parts of the search [s].
    - `stopped`: generations and what ended the search, in words.
    - `algorithm`: name of the algorithm.
    - `converged`: whether descents have brought the whole front to convergence.
    - `seeds`: objectives (n_i, m) of the front of each seed that was merged, unless descents
      followed [their units]; empty of a single search.
    - `hypervolume` (n_generations,), `reference_point` (m,): hypervolume of the front after each
      generation, up to the worst objectives in the first one.

    See Also
    --------
    deboom.search, deboom.explore.result.Front
    """

    front: RobustValues
    evaluated: RobustValues
    hypervolume: RealArray
    reference_point: RealArray
    seed: int
    seconds: float
    stopped: str = ""
    algorithm: str = "NSGA-II"
    converged: bool = False
    seeds: tuple[RealArray, ...] = ()

    @property
    def n_evaluated(self) -> int:
        """Number of designs that were evaluated."""
        return len(self.evaluated)

    @property
    def n_failed(self) -> int:
        """Number of designs that could not be computed."""
        return int(self.evaluated.failed.sum())

    @property
    def failures(self) -> dict[str, int]:
        """What the model said of designs that failed, and of how many; the most frequent first."""
        said, counts = np.unique(self.evaluated.message[self.evaluated.failed], return_counts=True)
        order = np.argsort(-counts, kind="stable")
        return {str(said[row]): int(counts[row]) for row in order}

    @property
    def infeasible(self) -> BoolArray:
        """Evaluated designs that were computed and miss a limit, shape (n_evaluated,)."""
        return np.asarray(~self.evaluated.failed & ~self.evaluated.feasible)


class UnverifiedSearchError(InputError):
    """A search whose designs all fail under the draws of the verification.

    - `search`: the search with every evaluation.
    """

    def __init__(self, words: str, search: SearchResult) -> None:
        super().__init__(words)
        self.search = search


def merge(searches: Sequence[SearchResult]) -> SearchResult:
    """Return several searches of one problem, such as of several seeds, as one.

    It has the front of all fronts, the seed of the first search, counts, failures and seconds added
    up, and of the hypervolumes only the final one, up to the worst reference point.
    """
    if not searches:
        raise InputError("there are no searches to merge: bring at least one")
    front = pareto_front(*(search.front for search in searches))
    reference = np.max([search.reference_point for search in searches], axis=0)
    return SearchResult(
        front=front,
        evaluated=joined([search.evaluated for search in searches]),
        hypervolume=np.array([hypervolume(front.objectives, reference)]),
        reference_point=reference,
        seed=searches[0].seed,
        seconds=sum(search.seconds for search in searches),
        stopped=searches[0].stopped,
        algorithm=searches[0].algorithm,
        converged=all(search.converged for search in searches),
        seeds=tuple(search.front.objectives for search in searches),
    )


RISEN = 0.01
"""Rise up to which nothing counts as louder: that of rounding and of lines beside a peak [dB]."""
POINT, PICK, NONDOMINATED, JUDGED_BY = "point", "pick", "non-dominated when verified", "judged by"
"""Columns of a front's table without a unit; others are those of `FrontColumns`."""
POWERS = {2: "²", 3: "³", 4: "⁴"}
"""Behind a unit that comes several times."""
IN_SEARCH = " in search ["
"""Between the name of an objective and its unit, in a column of what its search saw."""


def label_in_search(label: str) -> str:
    """Return the column of what a search saw of an objective, from that of its verified number."""
    name, _, unit = label.rpartition(" [")
    return f"{name}{IN_SEARCH}{unit}"


@dataclass(frozen=True)
class FrontColumns:
    """Names of the columns of a front's table; levels in dB(A) scatter in dB.

    - `unit`: of the responses.
    """

    unit: str

    @classmethod
    def of_table(cls, names: Sequence[str]) -> FrontColumns:
        """Return the names that a table has; InputError if it has no verified mean and sigma."""
        for name in names:
            unit = re.fullmatch(r"(?:SPLV )?mean sum \[(.+)\]", name)
            if unit and cls(unit[1]).sigma_sum in names:
                return cls(unit[1])
        missing = f"{cls('dB(A)').mean_sum}, {cls('dB(A)').sigma_sum}"
        raise InputError(f"no front with verified mean and sigma (columns such as {missing})")

    @classmethod
    def variables(cls, names: Sequence[str]) -> tuple[str, ...]:
        """Return the columns of design variables, which have a unit and are no others."""
        try:
            mine = cls.of_table(names).names
        except InputError:
            mine = frozenset()
        # objectives stand there twice, as verified and as searched
        searched = {name for name in names if IN_SEARCH in name}
        mine |= searched | {name.replace(IN_SEARCH, " [") for name in searched}
        return tuple(name for name in names if name.endswith("]") and name not in mine)

    @property
    def names(self) -> frozenset[str]:
        """All of them."""
        kinds = (name for name, kind in vars(type(self)).items() if isinstance(kind, property))
        return frozenset(getattr(self, name) for name in kinds if name != "names")

    @property
    def _scatter(self) -> str:
        return spread_unit(self.unit)

    @property
    def _sums(self) -> str:
        return "SPLV " if self.unit == "dB(A)" else ""

    @property
    def mean_sum(self) -> str:
        """Verified sum of the means over the responses."""
        return f"{self._sums}mean sum [{self.unit}]"

    @property
    def sigma_sum(self) -> str:
        """Verified sum of the standard deviations."""
        return f"{self._sums}sigma sum [{self._scatter}]"

    @property
    def mean_error(self) -> str:
        """Standard error of `mean_sum`."""
        return f"standard error of mean sum [{self._scatter}]"

    @property
    def sigma_error(self) -> str:
        """Standard error of `sigma_sum`."""
        return f"standard error of sigma sum [{self._scatter}]"

    @property
    def mean_interval(self) -> str:
        """Half of the 95 % interval of `mean_sum`, by Student's t over the scrambles."""
        return f"mean sum ± 95 % [{self._scatter}]"

    @property
    def sigma_interval(self) -> str:
        """Half of the 95 % interval of `sigma_sum`."""
        return f"sigma sum ± 95 % [{self._scatter}]"

    @property
    def searched_mean_sum(self) -> str:
        """What the search saw of `mean_sum`."""
        return f"{self._sums}mean sum in search [{self.unit}]"

    @property
    def searched_sigma_sum(self) -> str:
        """What the search saw of `sigma_sum`."""
        return f"{self._sums}sigma sum in search [{self._scatter}]"

    @property
    def mean_per_line(self) -> str:
        """Verified mean over responses and lines."""
        return f"mean per line and vehicle [{self.unit}]"

    @property
    def sigma_per_line(self) -> str:
        """Verified standard deviation of it."""
        return f"sigma per line and vehicle [{self._scatter}]"

    @property
    def failed_draws(self) -> str:
        """Share of the draws of the verification that could not be computed."""
        return "failed draws [1]"

    @property
    def other_draws(self) -> str:
        """Mean sum over the draws that could be computed."""
        return f"{self._sums}mean sum of the other draws [{self.unit}]"


@dataclass(frozen=True, eq=False, kw_only=True)
class Front(Tabled):
    """A searched front whose designs were evaluated again with draws that the search never saw.

    Parameters
    ----------
    robust : Robust
        Model, design space and draws of the search.
    search : SearchResult
        What was found.
    searched, values : RobustValues
        Designs of the front as the search saw them, and under the draws of the judge.
    judge : Replicates
        The model with draws that the search never saw.
    note : str
        What else there is to say about the search.
    rise : callable, optional
        Designs, shape (n, k) → by how much that which no design may make louder rises, such as the
        booming peak that rises most, shape (n,) [dB]; none-louder and sigma-kept keep it.

    See Also
    --------
    deboom.search, deboom.verify, deboom.compare, deboom.save_run
    deboom.vehicles.fleet_front.FleetFront
    """

    robust: Robust
    search: SearchResult
    searched: RobustValues
    values: RobustValues
    judge: Replicates
    note: str = ""
    rise: Callable[[RealArray], RealArray] | None = None

    __repr__ = short_repr

    @property
    def model(self) -> Evaluate:
        """The model without scatter."""
        return self.robust.evaluate

    @property
    def responses(self) -> tuple[str, ...]:
        """Names of the responses."""
        return tuple(self.model.response_names)

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the design variables."""
        return self.robust.space.names

    @property
    def judged_by(self) -> str:
        """What computed the verified values in the place of the true model; empty if that did."""
        return str(getattr(self.model, "judges", ""))

    @property
    def n_lines(self) -> int:
        """Lines that each response is the sum of; 1 for a model that does not say."""
        return int(getattr(self.model, "n_lines", 1))

    @property
    def per_line(self) -> float:
        """Factor from a sum over responses and lines to the mean over both [1]."""
        return 1.0 / (self.n_lines * len(self.responses))

    @cached_property
    def picks(self) -> ByPick[int]:
        """Rows by name of the pick, chosen on verified values; see `deboom.explore.selection`."""
        names = {column: objective.name for column, objective in enumerate(self.robust.objectives)}
        picks: ByPick[int] = ByPick()
        if self.robust.begins_with_level_and_sigma:
            kept = None if self.rise is None else self.rise(self.values.designs) <= RISEN
            picks = pick(self.values, self.baseline, kept)
            names = {column: name for column, name in names.items() if column > 1}
        if names:
            picks |= pick_of_any(self.values, names, self.baseline)
        return picks

    def pick(
        self,
        rule: str | None = None,
        *,
        reference: Mapping[str, float] | None = None,
        weights: Mapping[str, float] | None = None,
        desired: Mapping[str, tuple[float, float]] | None = None,
    ) -> int:
        """Return the row of one design, chosen by a rule on verified values.

        Columns are those of `table` that are to be small, such as ``mean per line and vehicle
        [dB(A)]``; without any, the objectives count. Only designs that no other one beats and that
        keep all limits are chosen.

        Parameters
        ----------
        rule : str, optional
            ``"knee"``: where a little of one objective costs most of the others; ``"nearest"``: to
            the best of each; one of `picks` by its name.
        reference : mapping of str to float, optional
            What is wanted of each column [its unit]: the design that misses it least, or beats it
            most, in the worst column.
        weights : mapping of str to float, optional
            How much each column counts [1].
        desired : mapping of str to (float, float), optional
            Value of each column that is fully desired, and the larger one from which it is not
            acceptable [its unit].

        Returns
        -------
        int
            Row of the design: ``front.table.iloc[row]``, ``front.designs().iloc[row]``.

        Raises
        ------
        InputError
            None of these, or several; a column that is not there or is no number; a front without a
            knee; desires that no design meets.
        """
        given = [each for each in (reference, weights, desired) if each is not None]
        if len(given) + (rule is not None) != 1:
            raise InputError(
                "a design is picked by one of: 'knee', 'nearest', a name of front.picks, "
                "reference=, weights= or desired="
            )
        if rule is not None and rule not in ("knee", "nearest"):
            return self.picks[rule]
        rows = np.flatnonzero(self.nondominated & self.values.feasible)
        if rows.size == 0:
            raise InputError("no design of this front keeps all limits: there is nothing to pick")
        values = self._columns(list(given[0]) if given else [])[rows]
        if rule is not None:
            row = knee(values) if rule == "knee" else nearest_to_ideal(values)
        elif reference is not None:
            row = nearest_to_reference(values, np.array(list(reference.values()), dtype=float))
        elif weights is not None:
            row = nearest_to_weights(values, np.array(list(weights.values()), dtype=float))
        else:
            best, worst = np.array(list((desired or {}).values()), dtype=float).T
            row = most_desirable(values, best, worst)
        return int(rows[row])

    def _columns(self, names: Sequence[str]) -> RealArray:
        """Return columns of the table as numbers, (n, m); the objectives without names."""
        if not names:
            return self.values.objectives
        numbers = self.table.select_dtypes("number").drop(columns=POINT)
        for name in names:
            if name not in numbers.columns:
                raise InputError(
                    f"the table of this front has no column '{name}' with numbers: take some of "
                    f"{', '.join(map(str, numbers))}"
                )
        return numbers[list(names)].to_numpy(float)

    @cached_property
    def without_effect(self) -> tuple[str, ...]:
        """Variables that no response depends on."""
        return variables_without_effect(self.model, self.robust.space)

    @cached_property
    def pick_designs(self) -> ByPick[RealArray]:
        """Design of each pick, shape (k,); variables without effect are at nominal [1]."""
        designs = at_nominal(self.values.designs, self.robust.space, self.without_effect)
        return ByPick((name, designs[row]) for name, row in self.picks.items())

    @property
    def named_designs(self) -> dict[str, RealArray]:
        """Today's design and the picks, each of shape (k,) [1]."""
        return {"today's": self.robust.space.nominal, **self.pick_designs}

    @cached_property
    def baseline(self) -> RobustValues:
        """Today's design under the verification's draws; one row."""
        return self.judge(self.robust.space.nominal[np.newaxis, :])

    @cached_property
    def nondominated(self) -> BoolArray:
        """Designs that no other one beats when verified, shape (n,)."""
        return unbeaten(self.values)

    @property
    def mean_bias(self) -> float:
        """Mean sum in the search minus verified, mean over the designs [response unit]."""
        return search_bias(self.searched, self.values)[0]

    @property
    def sigma_bias_percent(self) -> float:
        """The same of the sigma sum, relative [%]; negative if the search was optimistic."""
        return search_bias(self.searched, self.values)[1]

    @cached_property
    def survivors(self) -> RealArray:
        """What is left of designs that fail in some draws of the verification, shape (n, 2).

        Share of draws that failed [1] and mean sum over the others [dB(A)]; 0 and NaN of a design
        that could be computed. Such designs are neither picks nor on the verified front.
        """
        rows = zip(self.values.designs, self.values.failed, strict=True)
        return np.array(
            [self.judge.sets[0].survivors(x) if failed else (0.0, np.nan) for x, failed in rows]
        )

    @property
    def table(self) -> pd.DataFrame:
        """One row per design: objectives as verified and as searched, as sums and per line."""
        names: dict[int, list[str]] = {}
        for name, row in self.picks.items():
            names.setdefault(row, []).append(name)
        columns, searched = FrontColumns(self.robust.sum_unit), self.searched
        values, n = self.values, len(self.values)
        share, mean = self.survivors.T
        failing = {columns.failed_draws: share, columns.other_draws: mean}
        if len(self.robust.weighted_units) > 1:  # which nothing adds up
            return pd.DataFrame(
                {
                    POINT: np.arange(1, n + 1),
                    PICK: [" = ".join(names.get(row, ())) for row in range(n)],
                    **self._minimised,
                    NONDOMINATED: self.nondominated,
                    **({columns.failed_draws: share} if share.any() else {}),
                }
            )
        return pd.DataFrame(
            {
                POINT: np.arange(1, n + 1),
                PICK: [" = ".join(names.get(row, ())) for row in range(n)],
                **self._minimised,
                columns.mean_sum: values.mean_sum,
                columns.sigma_sum: values.sigma_sum,
                columns.mean_error: values.standard_error_mean_sum,
                columns.sigma_error: values.standard_error_sigma_sum,
                columns.mean_interval: self.judge.interval * values.standard_error_mean_sum,
                columns.sigma_interval: self.judge.interval * values.standard_error_sigma_sum,
                columns.searched_mean_sum: searched.mean_sum,
                columns.searched_sigma_sum: searched.sigma_sum,
                NONDOMINATED: self.nondominated,
                columns.mean_per_line: self.per_line * values.mean_sum,
                columns.sigma_per_line: self.per_line * values.sigma_sum,
                **(failing if share.any() else {}),
                **({JUDGED_BY: self.judged_by} if self.judged_by else {}),
            }
        )

    @property
    def _minimised(self) -> dict[str, RealArray]:
        """Columns of objectives that are not the two sums, as verified and as searched."""
        if self.robust.objectives == (MEAN_SUM, SIGMA_SUM):
            return {}
        columns = {}
        for column, label in enumerate(self.robust.objective_labels):
            columns[label] = self.values.objectives[:, column]
            columns[label_in_search(label)] = self.searched.objectives[:, column]
        return columns

    def designs(self) -> pd.DataFrame:
        """Tabulate the variables of every design of the front [units of the space]."""
        designs = self.values.designs
        columns = dict(zip(self.robust.space.labels, designs.T, strict=True))
        return pd.DataFrame({POINT: np.arange(1, len(designs) + 1), **columns})

    def convergence(self) -> pd.DataFrame:
        """Tabulate how far the front so far was from the last one, by generation.

        The gap is what the front lacks to the last one of the search, descents included, in the
        first objective: its mean over the range of the second, per response and line; of three
        objectives and more the share of the hypervolume.
        """
        volume = self.search.hypervolume
        gap, label = self._gap
        return pd.DataFrame(
            {
                "generation": np.arange(1, len(volume) + 1),
                self.hypervolume_label: volume,
                f"gap {label}": gap,
            }
        )

    @property
    def hypervolume_label(self) -> str:
        """Name and unit of the hypervolume: the product of the units of the objectives."""
        units = map(self.robust.unit_of, self.robust.objectives)
        counts = Counter(spread_unit(unit) for unit in units if unit != "1")
        powers = (f"{unit}{POWERS.get(count, '')}" for unit, count in counts.items())
        return f"hypervolume [{'·'.join(powers) or '1'}]"

    @property
    def _gap(self) -> tuple[RealArray, str]:
        """What the front of each generation lacks to the last one, and its unit in brackets."""
        front, reference = self.search.front.objectives, self.search.reference_point
        last = hypervolume(front, reference)
        left = np.maximum(last - self.search.hypervolume, 0.0)
        if self.robust.objectives != (MEAN_SUM, SIGMA_SUM):
            return PERCENT * left / (last or 1.0), "[% of the hypervolume]"
        width = float(reference[1] - front[:, 1].min()) if len(front) else 0.0
        unit = spread_unit(self.robust.sum_unit)
        return left / (width or 1.0) * self.per_line, f"[{unit}]"

    def compared(self, designs: Mapping[str, tuple[RobustValues, int]]) -> pd.DataFrame:
        """Tabulate mean and sigma of named rows of verified values, per response and line.

        Objectives beyond the second follow as they were minimised.

        - `designs`: values and their row by name; changes are against the first one.
        """
        mean = np.array([values.mean_sum[row] for values, row in designs.values()])
        sigma = np.array([values.sigma_sum[row] for values, row in designs.values()])
        further = {
            label: [values.objectives[row, column] for values, row in designs.values()]
            for column, label in enumerate(self.robust.objective_labels)
            if column > 1
        }
        return pd.DataFrame(
            {
                "design": list(designs),
                "mean level [dB(A)]": mean * self.per_line,
                "change [dB]": (mean - mean[0]) * self.per_line,
                "sigma of the level [dB]": sigma * self.per_line,
                "change of sigma [%]": PERCENT * (sigma / sigma[0] - 1.0),
                **further,
            }
        )

    def picture(
        self, beside: Mapping[str, RobustValues] | None = None, width: float | None = None
    ) -> Any:
        """Draw the designs that are not dominated when verified, with the picks and today's.

        Parameters
        ----------
        beside : mapping of str to RobustValues, optional
            Further fronts of the same responses under the same judge, by their label.
        width : float, optional
            Of the figure [inch].
        """
        from deboom import plot  # a notebook asks a front for its picture
        from deboom.plot.style import FULL_WIDTH

        if not (self.robust.begins_with_level_and_sigma and self.robust.n_objectives == 2):
            if beside:
                raise InputError("fronts of level and sigma are drawn beside each other, no others")
            rows = np.flatnonzero(self.nondominated)
            places = {row: place for place, row in enumerate(rows.tolist())}
            kept = {name: places[row] for name, row in self.picks.items() if row in places}
            frame = pd.DataFrame(
                self.values.objectives[rows], columns=list(self.robust.objective_labels)
            )
            today = None if self.baseline.failed[0] else self.baseline.objectives[0]
            return plot.objective_grid(frame, kept, today)

        values, scale, shown = self.values, self.per_line, self.nondominated
        interval = self.judge.interval * scale
        return plot.pareto_front(
            values.mean_sum[shown] * scale,
            values.sigma_sum[shown] * scale,
            values.standard_error_mean_sum[shown] * interval,
            values.standard_error_sigma_sum[shown] * interval,
            None
            if self.baseline.failed[0]
            else (self.baseline.mean_sum[0] * scale, self.baseline.sigma_sum[0] * scale),
            {
                name: (float(values.mean_sum[row]) * scale, float(values.sigma_sum[row]) * scale)
                for name, row in self.picks.items()
            },
            mean_label="mean level over lines [dB(A)]",
            sigma_label="its σ [dB]",
            beside={
                name: (front.mean_sum * scale, front.sigma_sum * scale)
                for name, front in (beside or {}).items()
            },
            width=FULL_WIDTH if width is None else width,
        )

    def parallel_picture(self) -> Any:
        """Draw every design as a line over all objectives, with the picks and today's.

        Beside the pairs of `picture` it shows what one objective costs in all others. Each axis
        runs from the least to the largest of the front, whose numbers stand below it with the unit.
        """
        from deboom import plot

        values = self.values.objectives
        shown = values[self.nondominated]
        low, high = shown.min(axis=0), shown.max(axis=0)
        high = np.where(high > low, high, low + 1.0)
        marks = {} if self.baseline.failed[0] else {"today's": self.baseline.objectives[0]}
        marks |= {name: values[row] for name, row in self.picks.items()}
        labels = self.robust.objective_labels
        ends = zip(labels, low, high, strict=True)
        return plot.parallel_coordinates(
            [f"{label}\n{least:.5g} to {largest:.5g}" for label, least, largest in ends],
            shown,
            np.stack([low, high]),
            shown[:, 0],
            marks,
            value_label=labels[0],
            share_label="share of the range [%]",
        )

    def convergence_picture(self) -> Any:
        """Draw what the front lacks to the last one over the generations, see `convergence`."""
        from deboom import plot

        gap, label = self._gap
        panel = plot.CurvePanel("", np.arange(1, gap.size + 1), {"gap to the last front": gap})
        return plot.curve_panels(
            [panel], x_label="generation [1]", y_label=f"gap left {label}", columns=1
        )

    @property
    def text(self) -> str:
        """How many designs were evaluated and are left, in words."""
        shown = ""
        if len(self.values) < len(self.search.front):
            shown = (
                f"; tables and figures show {len(self.values)} of them, the picks and those that "
                "add most"
            )
        text = (
            f"{self.search.n_evaluated} designs were evaluated, {self.search.n_failed} failed"
            f"{self._reason}. The front has {len(self.search.front)} designs{shown}. {self.note}"
        )
        if self.judged_by:
            text += (
                f" Their numbers come from {self.judged_by}, in the search and when verified, and "
                "not from the model."
            )
        share = self.survivors[:, 0]
        if share.any():
            text += (
                f" {np.count_nonzero(share)} of these could not be computed in up to "
                f"{PERCENT * share.max():.1f} % of the draws of the verification: the table gives "
                "that share and the mean of the other draws; they are no picks and not on the "
                "verified front."
            )
        if self.baseline.failed[0]:
            failed, mean = self.judge.sets[0].survivors(self.robust.space.nominal)
            text += (
                f" Today's design could not be computed in {PERCENT * failed:.1f} % of the draws, "
                "so that changes against it have no number; the mean over the other draws, "
                f"vehicles and lines is {mean * self.per_line:.2f} dB(A)."
            )
        return text

    @property
    def _reason(self) -> str:
        """The most frequent reason of failures, in brackets."""
        failures = self.search.failures
        if not failures:
            return ""
        message, count = next(iter(failures.items()))
        return f" ({count} of them with '{message}')"


class PymooResult(Protocol):
    """What pymoo's ``minimize`` returns for a `deboom.RobustProblem`."""

    X: RealArray | None
    problem: Any
    algorithm: Any
    exec_time: float


def _front_of(result: PymooResult) -> Front:
    """Return the designs that pymoo has found as a front that is not verified yet."""
    robust = getattr(getattr(result, "problem", None), "robust", None)
    if not isinstance(robust, Robust) or result.X is None:
        raise InputError(
            f"{type(result).__name__} is no front: give what deboom.search returns, or the result "
            "of pymoo's minimize for a deboom.RobustProblem, with designs in its X"
        )
    searched = pareto_front(robust(np.unique(np.atleast_2d(result.X), axis=0)))
    worst = searched.objectives.max(axis=0)
    algorithm = result.algorithm
    search = SearchResult(
        front=searched,
        evaluated=searched,
        hypervolume=np.array([hypervolume(searched.objectives, worst)]),
        reference_point=worst,
        seed=int(algorithm.seed or 1),
        seconds=float(result.exec_time),
        stopped=f"{algorithm.n_gen - 1} generations",
        algorithm=type(algorithm).__name__,
    )
    unverified = Replicates((robust,))
    return Front(robust=robust, search=search, searched=searched, values=searched, judge=unverified)


def verify(front: Front | PymooResult, *, draws: int = 1024, seed: int) -> Front:
    """Evaluate the designs of a front again, with draws that its search never saw.

    Parameters
    ----------
    front : Front or pymoo result
        As `search` found it, or what ``minimize`` of pymoo gives for a `deboom.RobustProblem`.
    draws : int
        Draws of the scatter, a power of two.
    seed : int
        Seed from 1; take another than in `search`, whose verification it would only repeat.

    Returns
    -------
    Front
        The same designs under the new draws, with ``mean_bias`` and ``sigma_bias_percent``.

    Raises
    ------
    InputError
        A front that fails altogether under the new draws; draws or a seed that cannot be.

    See Also
    --------
    deboom.search, deboom.explore.result.Front, deboom.compare

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> bool(deboom.verify(front, draws=512, seed=2).nondominated.any())
    True
    """
    front = front if isinstance(front, Front) else _front_of(front)
    judge = replicates(front.robust, draws, seed=seed)
    return replace(front, judge=judge, values=verified(front.searched, judge))


class FrontRows(Protocol):
    """A front as a run keeps it, such as ``deboom.read_run(folder).front``."""

    @property
    def designs(self) -> RealArray:
        """Designs, shape (n, k) [units of the variables]."""

    @property
    def variables(self) -> tuple[str, ...]:
        """Labels of the variables, ``name [unit]``."""

    @property
    def convergence(self) -> RealArray:
        """Hypervolume of the search after each generation, shape (n_generations,)."""

    @property
    def converged(self) -> bool:
        """Whether descents have brought the whole front to convergence."""


def compare(
    first: Front | FrontRows | Sequence[Front | FrontRows],
    second: Front | FrontRows | Sequence[Front | FrontRows],
    *,
    draws: int = 1024,
    seed: int = 1,
) -> Difference:
    """Say whether one front is really better than another, or whether it could be chance.

    Parameters
    ----------
    first, second : Front, or a sequence of them
        Fronts of the same variables and responses; several of one side are runs of one question
        that differ in their seed. What `deboom.read_run` gives of a front is taken as well. Of
        each the designs that its table shows count; the model of the first `Front` judges all.
    draws : int
        Common draws of the scatter that all meet, a power of two of at least 16.
    seed : int
        Seed of these draws, from 1.

    Returns
    -------
    Difference
        First minus second, as a share of the hypervolume of their common box [1]; ``noise``, the
        largest difference that 99 % still call chance; ``verdict``; ``text``, with what would
        decide. Designs that fail under the common draws are left out and counted.

    Raises
    ------
    InputError
        Fronts of other variables or responses; a front whose designs all fail; no front with its
        model; draws that cannot be.

    See Also
    --------
    deboom.verify, deboom.search, deboom.explore.front.Difference

    Notes
    -----
    Noise comes from the draws and from the searches: of three seeds or more (``searches=3``, or a
    list of fronts) their own spread; of a front that descents brought to convergence the little
    that they leave, beyond which 0.5 % of the hypervolume was always found, and 0.2 % with three
    seeds of each; of any other single search the gain of its last generations, which seldom
    decides. See `deboom.explore.front.difference`.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> fronts = [deboom.search(robust, population=8, generations=4, seed=s) for s in (1, 2, 3)]
    >>> deboom.compare(fronts[0], fronts[0]).verdict.value
    'equal fronts'
    >>> deboom.compare(fronts, fronts[::-1]).verdict.value
    'equal fronts'
    """
    sides = [
        [
            getattr(entry, "front", entry)
            for entry in (side if isinstance(side, Sequence) else [side])
        ]
        for side in (first, second)
    ]
    judges = _common_judges(sides, draws, seed)
    judged = [[_judged(front, judges) for front in side] for side in sides]
    box = common_box([front.by_set.mean(axis=0) for side in judged for front, _ in side])
    fronts = [[front for front, _ in side] for side in judged]
    verdict = front_difference(
        fronts[0],
        fronts[1],
        box=box,
        names=("the first", "the second"),
        judge=judges.sets[0],
    )
    left_out = [sum(failed for _, failed in side) for side in judged]
    return replace(verdict, left_out=(left_out[0], left_out[1]))


def _common_judges(
    sides: Sequence[Sequence[Front | FrontRows]], draws: int, seed: int
) -> Replicates:
    """Return the model of the first front with the common draws; refuse what does not compare."""
    fronts = [front for side in sides for front in side]
    models = [front for front in fronts if isinstance(front, Front)]
    if not models or not all(sides):
        raise InputError(
            "a comparison needs a front on each side, one of them from deboom.search with its "
            "model: of two runs take the command `deboom compare`"
        )
    judge = models[0].robust
    for model in models:
        names = (model.variables, model.responses)
        if names != (models[0].variables, models[0].responses):
            raise InputError(
                f"fronts of {(models[0].variables, models[0].responses)} and {names} do not "
                "compare: search both alike"
            )
    for front in fronts:
        if not isinstance(front, Front):
            check_same_names("a run has the variables", front.variables, judge.space.labels)
    return common_judges(judge, draws, seed)


def _judged(front: Front | FrontRows, judges: Replicates) -> tuple[JudgedFront, int]:
    """Return a front under the common draws, and how many of its designs fail there."""
    if isinstance(front, Front):
        designs, search = front.values.designs, front.search
        volumes, converged, seeds = search.hypervolume, search.converged, search.seeds
        found_with = front.robust.sample
    else:
        designs, volumes, converged, seeds = front.designs, front.convergence, front.converged, ()
        found_with = None
    sets = judges.by_set(designs)
    failed = np.any([values.failed for values in sets], axis=0)
    if failed.all():
        raise InputError(
            f"all {failed.size} designs of a front fail under the common draws: there is nothing "
            "to compare"
        )
    judged = JudgedFront(
        by_set=np.stack([values.objectives[~failed] for values in sets]),
        designs=designs[~failed],
        gain=last_gain(volumes),
        converged=converged,
        seeds=seeds,
        found_with=found_with,
    )
    return judged, int(failed.sum())
