"""How surely levels, changes and rankings are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.front import verify
from deboom.explore.robust import RobustResponse
from deboom.explore.search import nsga2
from deboom.explore.selection import pick
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Frf
from deboom.measurement.measured_vehicle import Method, path_noise_transfer
from deboom.measurement.uncertainty import (
    LEAST_DRAWS,
    Interval,
    NextMeasurement,
    VariancePart,
    crossed_spread,
    half_width,
    half_width_after,
    method_difference,
    pivotal_interval,
    probability_below,
)
from deboom.plot import IntervalPanel
from deboom.plot.style import signed
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study import pngs as figures
from deboom.study.platform_model import motion_report
from deboom.study.progress import Progress
from deboom.study.rebuilt import DESIGNS, FRONT
from deboom.study.result import Scalar, StudyResult
from deboom.study.uncertain_index import UncertainIndex
from deboom.vehicles.fleet import Band, lines_inside
from deboom.vehicles.platform_uncertainty import (
    BUDGET,
    CALIBRATION,
    CELLS,
    DAY,
    FLOOR,
    MOTION,
    NOISE,
    PATHS,
    PRIOR,
    SHAKER,
    TransferUncertainty,
)

TODAY = "today's"


@dataclass(frozen=True, eq=False)
class Drawn:
    """What one index says of the designs; levels are means over the lines.

    Parameters
    ----------
    level : array, shape (..., n_design, n_vehicle)
        Without scatter [dB(A)].
    loudest : array, shape (..., n_design, n_vehicle)
        Loudest line of the first load case [dB(A)].
    mean, sigma : array, shape (..., n_design + n_front, n_vehicle)
        Over the scatter of parts, of the designs and of the front [dB(A)], [dB].
    share : array, shape (..., n_vehicle, n_variable)
        Of each direction in the variance by its tolerance, to first order, at today's design [1].
    """

    level: RealArray
    loudest: RealArray
    mean: RealArray
    sigma: RealArray
    share: RealArray


@dataclass(frozen=True, eq=False)
class MeasuredUncertainty:
    """Designs of a front, and what measuring again does to them.

    Parameters
    ----------
    uncertain : UncertainIndex
        Of the study.
    robust : RobustResponse
        How parts scatter; its model is the index of `uncertain`.
    designs : mapping of str to array, shape (k,)
        Named designs, `TODAY` first [1].
    front : array, shape (n, k)
        Designs of the front [1].
    cases : index
        Of the same data over every load case of the platform, to see how load cases differ.
    n_draws : int
        Measurements that are drawn, at least 40.
    seed : int
        From 1.

    Raises
    ------
    InputError
        No design besides today's; fewer draws than `LEAST_DRAWS`.
    """

    uncertain: UncertainIndex
    robust: RobustResponse
    designs: Mapping[str, RealArray]
    front: RealArray
    cases: Any
    n_draws: int
    seed: int

    def __post_init__(self) -> None:
        if list(self.designs)[:1] != [TODAY] or len(self.designs) < 2:
            raise InputError("name today's design first, then at least one other")
        if self.n_draws < LEAST_DRAWS:
            raise InputError(
                f"{self.n_draws} draws do not give an interval: take at least {LEAST_DRAWS}"
            )

    @property
    def index(self) -> Any:
        """The study's index, from the data as measured."""
        return self.uncertain.index

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the designs."""
        return tuple(self.designs)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return tuple(self.index.response_names)

    @cached_property
    def rows(self) -> RealArray:
        """The designs, shape (n_design, k) [1]."""
        return np.stack(list(self.designs.values()))

    @cached_property
    def measured(self) -> Drawn:
        """From the data as measured."""
        return self._drawn(self.index)

    def measure_again(self, progress: Progress) -> MeasuredAgain:
        """Draw all measurements, and those of each source alone.

        Parameters
        ----------
        progress : callable
            ``progress(done, total, text)``.
        """
        names = self.uncertain.data.names
        total = (1 + len(names)) * self.n_draws
        every, alone = [], {}
        for done, index in enumerate(self.uncertain.draws(self.n_draws, self.seed)):
            progress(done, total, "all errors")
            every.append(self._drawn(index))
        for place, name in enumerate(names, 1):
            levels = []
            for done, index in enumerate(self.uncertain.draws(self.n_draws, self.seed, [name])):
                progress(place * self.n_draws + done, total, name)
                levels.append(index(self.rows) / self.index.n_lines)
            alone[name] = np.stack(levels)
        progress(total, total, "done")
        fields = {name: np.stack([getattr(one, name) for one in every]) for name in vars(every[0])}
        return MeasuredAgain(self, Drawn(**fields), alone)

    def _drawn(self, index: Any) -> Drawn:
        n_lines = index.n_lines
        scattered = replace(self.robust, evaluate=index)(np.concatenate([self.rows, self.front]))
        if scattered.failed.any():
            raise InputError("a design could not be computed from data that were measured again")
        space = self.robust.space
        slope = index.gradient(self.rows[:1])[0] * self.rows[0] * space.relative_sigma
        squared = slope**2
        return Drawn(
            level=index(self.rows) / n_lines,
            loudest=index.levels(self.rows).max(axis=2),
            mean=scattered.mean / n_lines,
            sigma=scattered.sigma / n_lines,
            share=squared / squared.sum(axis=1, keepdims=True),
        )


@dataclass(frozen=True, eq=False)
class MeasuredAgain:
    """Intervals, probabilities and shares of variance.

    Parameters
    ----------
    study : MeasuredUncertainty
        Of what.
    again : Drawn
        With a leading axis of draws.
    alone : mapping of str to array, shape (n_draws, n_design, n_vehicle)
        Source → mean level if nothing else errs [dB(A)].
    """

    study: MeasuredUncertainty
    again: Drawn
    alone: Mapping[str, RealArray]

    @property
    def measured(self) -> Drawn:
        """From the data as measured."""
        return self.study.measured

    @cached_property
    def level(self) -> Interval:
        """Mean level of each design and vehicle, shape (n_design, n_vehicle) [dB(A)]."""
        return pivotal_interval(self.measured.level, self.again.level)

    @cached_property
    def loudest(self) -> Interval:
        """Loudest line, shape (n_design, n_vehicle) [dB(A)]."""
        return pivotal_interval(self.measured.loudest, self.again.loudest)

    @cached_property
    def change(self) -> Interval:
        """Change of the mean level against today's, shape (n_design, n_vehicle) [dB]."""
        return pivotal_interval(_change(self.measured.level), _change(self.again.level))

    @cached_property
    def change_of_loudest(self) -> Interval:
        """Change of the loudest line, shape (n_design, n_vehicle) [dB]."""
        return pivotal_interval(_change(self.measured.loudest), _change(self.again.loudest))

    @cached_property
    def mean_level(self) -> Interval:
        """Mean over the vehicles, shape (n_design,) [dB(A)]."""
        return pivotal_interval(self.measured.level.mean(-1), self.again.level.mean(-1))

    @cached_property
    def mean_change(self) -> Interval:
        """Its change against today's, shape (n_design,) [dB]."""
        return pivotal_interval(
            _change(self.measured.level).mean(-1), _change(self.again.level).mean(-1)
        )

    @cached_property
    def sigma(self) -> Interval:
        """Scatter by tolerance, mean over the vehicles, shape (n_design,) [dB]."""
        n = len(self.study.designs)
        return pivotal_interval(self.measured.sigma[:n].mean(-1), self.again.sigma[:, :n].mean(-1))

    @cached_property
    def front_change(self) -> Interval:
        """First objective of the front against today's, shape (n_front,) [dB]."""
        return pivotal_interval(self._front(self.measured.mean), self._front(self.again.mean))

    @cached_property
    def front_level(self) -> Interval:
        """First objective of the front, shape (n_front,) [dB(A)]."""
        n = len(self.study.designs)
        return pivotal_interval(self.measured.mean[n:].mean(-1), self.again.mean[:, n:].mean(-1))

    @cached_property
    def front_sigma(self) -> Interval:
        """Second objective of the front, shape (n_front,) [dB]."""
        n = len(self.study.designs)
        return pivotal_interval(self.measured.sigma[n:].mean(-1), self.again.sigma[:, n:].mean(-1))

    @cached_property
    def front_kept(self) -> RealArray:
        """Share of draws in which a point of the front is not dominated, (n_front,) [1]."""
        n = len(self.study.designs)
        objectives = np.stack(
            [self.again.mean[:, n:].mean(-1), self.again.sigma[:, n:].mean(-1)], axis=-1
        )
        return np.asarray(np.mean([_nondominated(values) for values in objectives], axis=0))

    @cached_property
    def quieter(self) -> RealArray:
        """Probability that design A is quieter than B, mean of the vehicles, (A, B) [1]."""
        mean, again = self.measured.level.mean(-1), self.again.level.mean(-1)
        return probability_below(
            mean[:, np.newaxis] - mean, again[:, :, np.newaxis] - again[:, np.newaxis]
        )

    @cached_property
    def leads(self) -> RealArray:
        """Share of draws in which a direction scatters a vehicle most, (n_vehicle, k) [1]."""
        first = self.again.share.argmax(axis=2)
        columns = np.arange(self.again.share.shape[2])
        return np.asarray((first[..., np.newaxis] == columns).mean(axis=0))

    @cached_property
    def rank_kept(self) -> RealArray:
        """Share of draws in which a direction keeps its place as measured, (n_vehicle, k) [1]."""
        return np.asarray((_ranks(self.again.share) == _ranks(self.measured.share)).mean(axis=0))

    def variances(self, design: str | None) -> dict[str, RealArray]:
        """Variance of the level, or of a design's change, by each source alone, (n_vehicle + 1,).

        Parameters
        ----------
        design : str or None
            Whose change against today's; None: level of today's.

        Returns
        -------
        dict of str to array
            Of every vehicle, and last of their mean [dB²].
        """
        found = {}
        for name, levels in self.alone.items():
            values = levels[:, 0]
            if design is not None:
                values = _change(levels)[:, self.study.names.index(design)]
            both = np.concatenate([values, values.mean(axis=1, keepdims=True)], axis=1)
            found[name] = both.var(axis=0, ddof=1)
        return found

    def _front(self, mean: RealArray) -> RealArray:
        n, of_vehicles = len(self.study.designs), mean.mean(axis=-1)
        return np.asarray(of_vehicles[..., n:] - of_vehicles[..., :1])


def _change(level: RealArray) -> RealArray:
    """Against today's, the first design, shape (..., n_design, n_vehicle)."""
    return np.asarray(level - level[..., :1, :])


def _ranks(share: RealArray) -> RealArray:
    return np.asarray((-share).argsort(axis=-1, kind="stable").argsort(axis=-1))


def _nondominated(values: RealArray) -> npt.NDArray[np.bool_]:
    """Say which rows (n, 2) no other row beats in both columns."""
    difference = values[:, np.newaxis] - values
    beaten = np.all(difference >= 0.0, axis=2) & np.any(difference > 0.0, axis=2)
    return np.asarray(~beaten.any(axis=1))


VEHICLES = "choice of the vehicles"
LOAD_CASES = "choice of the load cases"
HERE = "change, these vehicles and load cases"
SERIES = "change, any vehicle and load case"
LEVEL = "level, these vehicles and load cases"
TRANSFER = (CALIBRATION, PATHS, DAY, FLOOR)
HALVED = 0.25
"""Share of a variance that is left when a standard deviation is halved [1]."""
TWICE = 0.5
"""Share of a variance that is left by the mean of two independent measurements [1]."""


@dataclass(frozen=True, eq=False)
class Question:
    """A number whose interval is to become narrower.

    Parameters
    ----------
    name : str
        `HERE`, `SERIES` or `LEVEL`.
    parts : tuple of VariancePart
        What its variance consists of [dB²].
    """

    name: str
    parts: tuple[VariancePart, ...]

    @property
    def now(self) -> float:
        """Half width of its 90 % interval [dB]."""
        return half_width(self.parts)

    def after(self, measurement: NextMeasurement) -> float:
        """Return the half width expected after one more measurement [dB]."""
        own = {part.name for part in self.parts}
        remaining = {n: share for n, share in measurement.remaining.items() if n in own}
        more = {n: f for n, f in measurement.more_degrees_of_freedom.items() if n in own}
        return half_width_after(self.parts, NextMeasurement(measurement.name, remaining, more))


def questions(found: MeasuredAgain, design: str) -> tuple[Question, ...]:
    """Return what is asked of the mean over the vehicles, with its variances.

    Parameters
    ----------
    found : MeasuredAgain
        Drawn.
    design : str
        Whose change against today's.

    Notes
    -----
    "Any vehicle and load case" takes those that were measured for a sample: their spread is split
    into vehicles, load cases and rest by `crossed_spread` over all load cases of the platform, and
    of that between vehicles the part that errors of measurement make is taken off.
    """
    of_change, of_level = found.variances(design), found.variances(None)
    here = tuple(VariancePart(name, float(v[-1])) for name, v in of_change.items())
    level = tuple(VariancePart(name, float(v[-1])) for name, v in of_level.items())
    here_asked, level_asked = Question(HERE, here), Question(LEVEL, level)
    n_vehicle, n_used = len(found.study.vehicles), len(found.study.index.load_case_names)
    if n_vehicle < 2:
        return (here_asked, level_asked)
    spread = crossed_spread(changes_by_load_case(found, design))
    by_errors = sum(float(v[:-1].mean()) for name, v in of_change.items() if name in TRANSFER)
    vehicles = max(float(spread.rows + spread.rest / n_used) - by_errors, 0.0) / n_vehicle
    parts = [*here, VariancePart(VEHICLES, vehicles, n_vehicle - 1)]
    if spread.n_column > 1:
        parts.append(VariancePart(LOAD_CASES, float(spread.columns) / n_used, spread.n_column - 1))
    return (here_asked, Question(SERIES, tuple(parts)), level_asked)


def changes_by_load_case(found: MeasuredAgain, design: str) -> np.ndarray:
    """Change of the mean level by a design, (n_vehicle, n_load_case) [dB]."""
    study = found.study
    rows = np.stack([study.rows[0], study.designs[design]])
    columns = []
    for name in study.cases.load_case_names:
        levels = study.cases.levels(rows, name).mean(axis=2)
        columns.append(levels[1] - levels[0])
    return np.stack(columns, axis=1)


def candidates(found: MeasuredAgain) -> tuple[NextMeasurement, ...]:
    """Return measurements that may come next, as far as they touch a source of the study."""
    known = set(found.study.uncertain.data.names)
    n, m = len(found.study.vehicles), len(found.study.index.load_case_names)
    one_more, one_case = n / (n + 1), m / (m + 1)
    vehicles = {name: one_more for name in (*TRANSFER, VEHICLES)}
    every: Mapping[str, tuple[Mapping[str, float], Mapping[str, float]]] = {
        "one more vehicle": (vehicles, {VEHICLES: 1.0}),
        "one more load case": ({LOAD_CASES: one_case, NOISE: one_case}, {}),
        "transfer functions, another method and day": (
            {name: TWICE for name in TRANSFER},
            {},
        ),
        "transfer functions, same setup, another day": (
            {DAY: TWICE, FLOOR: TWICE},
            {},
        ),
        "microphone, source calibrated twice as well": ({CALIBRATION: HALVED}, {}),
        "shaker aligned twice as well": ({SHAKER: HALVED, CELLS: HALVED}, {}),
        "mounts characterised anew": ({SHAKER: TWICE, BUDGET: TWICE}, {}),
        "accelerometers placed twice as well": ({MOTION: HALVED}, {}),
        "run repeated, sensors set up anew": ({MOTION: TWICE, NOISE: TWICE}, {}),
    }
    return tuple(
        NextMeasurement(name, remaining, more)
        for name, (remaining, more) in every.items()
        if known & set(remaining) or {VEHICLES, LOAD_CASES} & set(remaining)
    )


PERCENT = 100.0
AS_IT_IS = "none: as it is"


def source_table(found: MeasuredAgain, design: str) -> pd.DataFrame:
    """One row per source: its size, where that comes from, and what it does to the mean."""
    level, change = found.variances(None), found.variances(design)
    totals = [sum(float(v[-1]) for v in of.values()) for of in (level, change)]
    rows = []
    for source in found.study.uncertain.data.sources:
        own = [float(of[source.name][-1]) for of in (level, change)]
        shares = [
            PERCENT * v / total if total > 0 else 0.0 for v, total in zip(own, totals, strict=True)
        ]
        rows.append(
            {
                "source": source.name,
                "size, 1 σ": source.size,
                "from": source.origin,
                "σ of the level [dB]": np.sqrt(own[0]),
                "share of its variance [%]": shares[0],
                "σ of the change [dB]": np.sqrt(own[1]),
                "share of that variance [%]": shares[1],
            }
        )
    return pd.DataFrame(rows)


def pick_table(found: MeasuredAgain) -> pd.DataFrame:
    """One row per named design: mean of the vehicles, with 90 % intervals."""
    table: dict[str, object] = {"design": list(found.study.names)}
    for what, unit, interval in (
        ("mean level", "dB(A)", found.mean_level),
        ("change", "dB", found.mean_change),
        ("sigma", "dB", found.sigma),
    ):
        table |= _columns(what, unit, interval, slice(None))
    table["quieter than today's [%]"] = PERCENT * found.quieter[:, 0]
    return pd.DataFrame(table)


def vehicle_table(found: MeasuredAgain) -> pd.DataFrame:
    """One row per named design and vehicle: level, loudest line and changes, with intervals."""
    rows = []
    for place, name in enumerate(found.study.names):
        columns: dict[str, object] = {
            "design": [name] * len(found.study.vehicles),
            "vehicle": list(found.study.vehicles),
        }
        for what, unit, interval in (
            ("mean level", "dB(A)", found.level),
            ("change", "dB", found.change),
            ("loudest line", "dB(A)", found.loudest),
            ("change of the loudest line", "dB", found.change_of_loudest),
        ):
            columns |= _columns(what, unit, interval, place)
        rows.append(pd.DataFrame(columns))
    return pd.concat(rows, ignore_index=True)


def front_table(found: MeasuredAgain) -> pd.DataFrame:
    """One row per design of the front: both objectives, per vehicle and line, with intervals."""
    table: dict[str, object] = {"point": np.arange(1, len(found.study.front) + 1)}
    for what, unit, interval in (
        ("mean level", "dB(A)", found.front_level),
        ("change", "dB", found.front_change),
        ("sigma", "dB", found.front_sigma),
    ):
        table |= _columns(what, unit, interval, slice(None))
    table["on the front in [% of draws]"] = PERCENT * found.front_kept
    return pd.DataFrame(table)


def probability_table(found: MeasuredAgain) -> pd.DataFrame:
    """Probability that the design of the row is quieter than that of the column."""
    columns = {
        f"than {name} [%]": PERCENT * column
        for name, column in zip(found.study.names, found.quieter.T, strict=True)
    }
    return pd.DataFrame({"quieter": list(found.study.names), **columns})


def ranking_table(found: MeasuredAgain) -> pd.DataFrame:
    """One row per vehicle: which directions scatter it, and how sure their order is."""
    names = found.study.robust.space.names
    rows = []
    for place, vehicle in enumerate(found.study.vehicles):
        share = found.measured.share[place]
        order = np.argsort(-share, kind="stable")
        first, second = order[0], order[1]
        rows.append(
            {
                "vehicle": vehicle,
                "first": names[first],
                "its share [%]": PERCENT * share[first],
                "first in [% of draws]": PERCENT * found.leads[place, first],
                "second": names[second],
                "share of the second [%]": PERCENT * share[second],
                "second in [% of draws]": PERCENT * found.rank_kept[place, second],
            }
        )
    return pd.DataFrame(rows)


def next_table(found: MeasuredAgain, design: str) -> pd.DataFrame:
    """One row per measurement that may come next: expected half widths of the 90 % intervals.

    Those that narrow the first question most come first; of equals, the next question decides.
    """
    asked = questions(found, design)
    rows: list[dict[str, object]] = []
    for measurement in (None, *candidates(found)):
        row: dict[str, object] = {"measurement": measurement.name if measurement else AS_IT_IS}
        for one in asked:
            after = one.now if measurement is None else one.after(measurement)
            # fewer effective degrees of freedom may outweigh a gain in what hardly counts
            gain = max(1.0 - after / one.now, 0.0) if one.now > 0.0 else 0.0
            row |= {f"{one.name}, ± [dB]": after, f"{one.name}: narrower by [%]": PERCENT * gain}
        rows.append(row)
    table = pd.DataFrame(rows)
    gains = [f"{one.name}: narrower by [%]" for one in asked]
    rest = table.iloc[1:].sort_values(gains, ascending=False, kind="stable")
    return pd.concat([table.iloc[:1], rest], ignore_index=True)


def best_next(following: pd.DataFrame, question: str) -> tuple[str, float]:
    """Return the measurement that narrows a question most, and by how much [%]."""
    gains = following[f"{question}: narrower by [%]"]
    row = int(gains.to_numpy().argmax())
    return str(following["measurement"].iloc[row]), float(gains.iloc[row])


def uncertainty_summary(found: MeasuredAgain, design: str) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    place = found.study.names.index(design)
    following = next_table(found, design)
    asked = [one.name for one in questions(found, design)]
    here, series = (
        best_next(following, name if name in asked else HERE) for name in (HERE, SERIES)
    )
    level, change = found.mean_level, found.mean_change
    summary: dict[str, Scalar] = {
        "level_db": float(level.value[0]),
        "level_half_width_db": float(level.half_width[0]),
        "change_db": float(change.value[place]),
        "change_lower_db": float(change.lower[place]),
        "change_upper_db": float(change.upper[place]),
        "change_half_width_db": float(change.half_width[place]),
        "probability_quieter": float(found.quieter[place, 0]),
        "front_half_width_db": float(np.median(found.front_change.half_width)),
        "front_kept_share": float(found.front_kept.mean()),
        "next_measurement": here[0],
        "next_narrower_percent": here[1],
        "next_measurement_series": series[0],
        "next_narrower_percent_series": series[1],
        "least_leading_share": float(found.leads.max(axis=1).min()),
    }
    for vehicle, half in zip(found.study.vehicles, found.change.half_width[place], strict=True):
        summary[f"change_half_width_db_{vehicle}"] = float(half)
    return summary


def best_pick(found: MeasuredAgain) -> str:
    """Return the design whose change is asked about: the first besides today's."""
    return next(name for name in found.study.names if name != TODAY)


def _columns(what: str, unit: str, interval: Interval, place: int | slice) -> dict[str, object]:
    return {
        f"{what} [{unit}]": interval.value[place],
        f"{what}, from [{unit}]": interval.lower[place],
        f"{what}, to [{unit}]": interval.upper[place],
    }


TERMS = ("booming noise", "SPL", "SPLV", "noise transfer function", "dynamic stiffness", "σ")
_SHOWN = 25
_LABELS = {
    HERE: "change, here",
    SERIES: "change, anywhere",
    LEVEL: "level, here",
}


def uncertainty_result(found: MeasuredAgain, inputs: tuple[Path, ...] = ()) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    found : MeasuredAgain
        Drawn.
    inputs : tuple of Path
        Files read beside the platform's.

    Returns
    -------
    StudyResult
        Tables ``sources``, ``picks``, ``vehicles``, ``front``, ``quieter``, ``ranking``, ``next``.
    """
    design = best_pick(found)
    tables = {
        "sources": source_table(found, design),
        "picks": pick_table(found),
        "vehicles": vehicle_table(found),
        "front": front_table(found),
        "quieter": probability_table(found),
        "ranking": ranking_table(found),
        "next": next_table(found, design),
    }
    pictures = uncertainty_figures(found, tables["next"])
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=uncertainty_summary(found, design),
        page=_page(found, design, tables, pictures),
        inputs=(*found.study.uncertain.platform.input_files, *inputs),
        facts={"kernel": found.study.index.kernel, "draws": found.study.n_draws},
    )


def uncertainty_figures(found: MeasuredAgain, following: pd.DataFrame) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    names = found.study.names
    changed = {
        name: _bounds(found.change, place) for place, name in enumerate(names) if name != TODAY
    }
    picks = {name: row for row, name in enumerate(_front_names(found)) if name}
    columns = {
        label: f"{name}, ± [dB]"
        for name, label in _LABELS.items()
        if f"{name}, ± [dB]" in following
    }
    return {
        "changes": figures.interval_panels(
            found.study.vehicles,
            [
                IntervalPanel("mean level [dB(A)]", {TODAY: _bounds(found.level, 0)}),
                IntervalPanel("change against today's [dB]", changed),
            ],
        ),
        "front": figures.front_intervals(
            _whole(found.front_change),
            _whole(found.front_sigma),
            picks,
            mean_label="change of the mean level over vehicles and parts [dB]",
            sigma_label="σ of the mean level [dB]",
        ),
        "next": figures.interval_panels(
            following["measurement"].to_list(),
            [
                IntervalPanel("half width [dB]", {"expected": _from_zero(following[column])}, label)
                for label, column in columns.items()
            ],
        ),
    }


def _from_zero(values: pd.Series) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    own = values.to_numpy(dtype=float)
    return own, np.zeros_like(own), own


def _page(
    found: MeasuredAgain,
    design: str,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
) -> Page:
    study = found.study
    place = study.names.index(design)
    change, level = found.mean_change, found.mean_level
    following, gain = best_next(tables["next"], HERE)
    vehicles = tables["vehicles"]
    priors = tables["sources"].loc[tables["sources"]["from"] == PRIOR, "source"]
    assumed = (
        (
            f"Stated, not measured: {', '.join(priors)}. Measure some vehicles in two ways "
            "(--vehicle) to replace what concerns transfer functions.",
        )
        if len(priors)
        else ()
    )
    return Page(
        title="How surely we know what the mounts bring",
        question=(
            "With the errors of all measurements: how sure are levels, changes, the front and the "
            f"order of its designs in {', '.join(study.vehicles)}, and what should be measured "
            "next?"
        ),
        headlines=(
            Headline(
                f"{signed(float(change.value[place]), 2)} ± {change.half_width[place]:.2f} dB",
                f"change of the mean level, {design}",
            ),
            Headline(
                f"{level.value[0]:.1f} ± {level.half_width[0]:.1f} dB(A)", "mean level, today's"
            ),
            Headline(f"{100 * found.quieter[place, 0]:.0f} %", f"{design} is quieter than today's"),
            Headline(f"−{gain:.0f} %", f"of the change's interval by: {following}"),
        ),
        terms=TERMS,
        warnings=(*assumed, *motion_report(study.index, study.rows[:1]).warnings),
        sections=(
            Section(
                "Levels and changes",
                "Every measurement is drawn again with its errors, the same for all designs and "
                f"vehicles, {study.n_draws} times, and everything is computed from what comes out. "
                "A wrong calibration moves all levels of a vehicle and no change; so changes are "
                "known much better. Intervals hold the truth in 90 % of all cases; they need not "
                "lie evenly about the measured value, because noise fills notches.",
                figures=(_picture(pictures, "changes", "Measured values and 90 % intervals."),),
                tables=(
                    Table(
                        tables["picks"],
                        "Mean of the vehicles; σ is the scatter of parts within their tolerance.",
                        _decimals(tables["picks"]),
                    ),
                    *(
                        Table(
                            vehicles.loc[vehicles["design"] == name, list(columns)],
                            f"Vehicle by vehicle, {name}.",
                            {c: 2 for c in columns if c.endswith("dB]")},
                        )
                        for name, columns in (
                            (TODAY, ["vehicle", *_of_level(vehicles)]),
                            (
                                design,
                                ["vehicle", *(c for c in map(str, vehicles) if "change" in c)],
                            ),
                        )
                    ),
                ),
            ),
            Section(
                "Where it comes from",
                f"Each source alone; the change is that of {design}, mean of the vehicles.",
                tables=(Table(tables["sources"], "Sources, independent of each other."),),
            ),
            Section(
                "The front and the order of designs",
                "The intervals of neighbours move together: the share of draws in which a point "
                "stays on the front, and the probability that one design is quieter than another, "
                "count with that.",
                figures=(_picture(pictures, "front", "The front against today's design."),),
                tables=(
                    Table(tables["quieter"], "Probability that the row is quieter, mean level."),
                    Table(
                        tables["front"].iloc[_few(len(tables["front"]))],
                        "Designs of the front.",
                        _decimals(tables["front"]),
                    ),
                ),
            ),
            Section(
                "Which direction scatters a vehicle most",
                "Share of each direction in the variance by its tolerance, to first order at "
                "today's design, and how often the order stays when everything is measured again.",
                tables=(Table(tables["ranking"], "The two leading directions."),),
            ),
            Section(
                "What to measure next",
                "Half widths of 90 % intervals that are to be expected after one more measurement, "
                "computed from the variances as they are. “Any vehicle and load case” takes those "
                "measured for a sample of all; their choice then counts, with Student's t for so "
                "few.",
                figures=(
                    _picture(
                        pictures,
                        "next",
                        "Expected half widths of 90 % intervals, shorter is better; here: these "
                        "vehicles and load cases, anywhere: any.",
                    ),
                ),
                tables=(
                    Table(
                        tables["next"],
                        "Sorted by what they are worth for the first question.",
                        {n: 3 for n in map(str, tables["next"]) if n.endswith("[dB]")},
                    ),
                ),
            ),
        ),
    )


def _of_level(table: pd.DataFrame) -> list[str]:
    return [name for name in map(str, table) if name.startswith(("mean level", "loudest line"))]


def _front_names(found: MeasuredAgain) -> list[str]:
    """Name of each point of the front that is a named design."""
    return [
        next((n for n, x in found.study.designs.items() if np.array_equal(x, row)), "")
        for row in found.study.front
    ]


def _bounds(interval: Interval, place: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return interval.value[place], interval.lower[place], interval.upper[place]


def _whole(interval: Interval) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return interval.value, interval.lower, interval.upper


def _few(count: int) -> list[int]:
    return sorted({int(row) for row in np.linspace(0, count - 1, min(_SHOWN, count))})


def _decimals(table: pd.DataFrame) -> dict[str, int]:
    names = [name for name in map(str, table) if name.endswith("dB]")]
    return {name: 3 if name.startswith("sigma") else 2 for name in names}


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


MOST_POINTS = 60
"""Of a front, evenly over it, that are drawn again."""
VERIFICATION = 1024


def front_designs(
    run: Path | None,
    robust: RobustResponse,
    population: int,
    generations: int,
    seed: int,
    progress: Progress,
) -> tuple[dict[str, RealArray], RealArray]:
    """Return today's design with the picks, and the front.

    Parameters
    ----------
    run : Path or None
        Finished run of a front study of the same variables; None: a search of its own.
    robust : RobustResponse
        What a search minimises.
    population, generations, seed : int
        Of that search.
    progress : callable
        Of that search.

    Returns
    -------
    designs : dict of str to array, shape (k,)
        `TODAY` first [1].
    front : array, shape (n, k)
        At most `MOST_POINTS` of it, picks included [1].

    Raises
    ------
    InputError
        A run that misses its front or its designs, or has other variables.
    """
    if run is not None:
        designs, picks = _of_run(run, robust)
    else:
        search = nsga2(robust, population, generations, seed=seed, progress=progress)
        designs = np.asarray(search.front.designs)
        rows = pick(verify(search.front, robust, n_samples=VERIFICATION, seed=seed).values)
        picks = {"best mean": rows.best_mean, "best sigma": rows.best_sigma, "knee": rows.knee}
    few = np.linspace(0, len(designs) - 1, min(MOST_POINTS, len(designs))).astype(int)
    kept = sorted({*few.tolist(), *picks.values()})
    named = {name: designs[row] for name, row in picks.items()}
    return {TODAY: np.asarray(robust.space.nominal), **named}, designs[kept]


def measured_transfer(
    folders: Sequence[Path], ear: str | None, band: Band, *, averaged: bool
) -> tuple[TransferUncertainty | None, tuple[Path, ...]]:
    """Estimate the errors of noise transfer functions from vehicles measured in two ways.

    Parameters
    ----------
    folders : sequence of Path
        Of measured vehicles; none: the stated priors stay.
    ear : str or None
        Such as ``driver ear``; by default the first of each vehicle.
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    averaged : bool
        Whether the platform's functions are means of both methods.

    Returns
    -------
    TransferUncertainty or None
        None without a vehicle.
    tuple of Path
        Files that were read.

    Raises
    ------
    InputError
        See `deboom.files.vehicle.read_vehicle` and `method_difference`.
    """
    if not folders:
        return None, ()
    pairs = []
    for folder in folders:
        vehicle = read_vehicle(folder)
        whose = ear or vehicle.ears[0]
        hammer, loudspeaker = (
            _inside(path_noise_transfer(vehicle, method, whose), band)
            for method in (Method.DIRECT, Method.RECIPROCAL)
        )
        pairs.append((hammer, loudspeaker))
    names = ", ".join(folder.name for folder in folders)
    found = method_difference(pairs)
    files = tuple(
        path for folder in folders for path in sorted(folder.rglob("*")) if path.is_file()
    )
    origin = f"both methods in {names}"
    return TransferUncertainty.of_methods(found, origin, averaged=averaged), files


def _of_run(folder: Path, robust: RobustResponse) -> tuple[RealArray, dict[str, int]]:
    for name in (DESIGNS, FRONT):
        if not (folder / name).is_file():
            raise InputError(
                f"{folder} has no {name}: give the folder of a finished run of a front study"
            )
    table, front = pd.read_csv(folder / DESIGNS), pd.read_csv(folder / FRONT)
    labels = [f"{name} [{unit}]" for name, unit in zip(*_labels(robust), strict=True)]
    missing = [label for label in labels if label not in table.columns]
    if missing:
        raise InputError(
            f"{folder / DESIGNS} has no column '{missing[0]}': the run belongs to other mounts, or "
            "to another meaning of the factors"
        )
    named = front["pick"].fillna("") if "pick" in front else [""] * len(front)
    picks = {str(name): row for row, name in enumerate(named) if name}
    if not picks:
        raise InputError(f"{folder / FRONT} names no design: its study picks none")
    return table[labels].to_numpy(dtype=float), picks


def _labels(robust: RobustResponse) -> tuple[Sequence[str], Sequence[str]]:
    return robust.space.names, robust.space.units


def _inside(transfer: Frf, band: Band) -> Frf:
    lines = lines_inside(transfer.frequency, band, "measured vehicle")
    return Frf(
        transfer.frequency[lines],
        transfer.values[lines],
        transfer.outputs,
        transfer.inputs,
        transfer.unit,
    )
