"""The page on how certain levels and changes are, and what to measure next."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT, RealArray
from deboom.errors import listed
from deboom.files.uncertain_index import UncertainIndex
from deboom.measurement.uncertainty import (
    Interval,
    NextMeasurement,
    VariancePart,
    crossed_spread,
    half_width,
    half_width_after,
    pivotal_interval,
    probability_below,
)
from deboom.pages.front import drawn_rows, left_out, report_cells
from deboom.pages.front_answer import (
    certainty_sentence,
    expected_column,
    expected_on_average,
    model_sentence,
    report_expected,
    report_expected_numbers,
)
from deboom.pages.motion import motion_report
from deboom.plot import IntervalPanel
from deboom.plot.style import signed
from deboom.report import Report, Step, Table
from deboom.vehicles.expected_change import CarMeasurement, ExpectedChange
from deboom.vehicles.free_directions import NOTICEABLE
from deboom.vehicles.platform_uncertainty import PRIOR
from deboom.vehicles.uncertain_data import (
    BUDGET,
    CALIBRATION,
    CELLS,
    DAY,
    FLOOR,
    MOTION,
    NOISE,
    PATHS,
    SHAKER,
)

TODAY = "today's"
VEHICLES = "choice of the vehicles"
LOAD_CASES = "choice of the load cases"
TRANSFER = (CALIBRATION, PATHS, DAY, FLOOR)
HALVED = 0.25
"""Share of a variance that is left when a standard deviation is halved [1]."""
TWICE = 0.5
"""Share of a variance that is left by the mean of two independent measurements [1]."""
CARS = "what cars do that the model does not"
DECISION = "expected change in cars of the group"
HERE = "change, these vehicles and load cases"
SERIES = "change, any vehicle and load case"
LEVEL = "level, these vehicles and load cases"
MOST_NEXT = 6
"""Measurements that the first screen lists."""
MOST_FACTORS = 3
"""Factors that the first screen names of the design."""
AS_IT_IS = "none: as it is"
Questions = dict[str, tuple[VariancePart, ...]]
"""Number whose interval is to become narrower → what its variance consists of [dB²]."""


@dataclass(frozen=True, eq=False)
class _Answer:
    """How sure level and change are, and what to measure next.

    `row`: of the design among those of `repeated`; `level`, `change`: mean of the vehicles; `scope`
    is the widest question that errors of measurement answer, `question` that of the decision for
    the design: what cars are expected to show, or the model's change where nothing is expected.
    `nearest` narrows `question` by `gain` [%], `nearest_of_scope` that of the scope.
    """

    repeated: Repeated
    design: str
    row: int
    level: Interval
    change: Interval
    sources: pd.DataFrame
    following: pd.DataFrame
    scope: str
    question: str
    nearest: str
    gain: float
    nearest_of_scope: str
    gain_of_scope: float

    @property
    def expected(self) -> ExpectedChange | str:
        """What cars are expected to show of the design; or why nothing is."""
        expected = self.repeated.expected
        return expected if isinstance(expected, str) else expected.of(self.row - 1)

    @property
    def half_width(self) -> float:
        """Half width of the change's interval [dB]."""
        return float(self.change.half_width[self.row])

    @property
    def is_sure(self) -> bool:
        """Whether nobody hears the half width of the question that decides."""
        return self.deciding_half_width < NOTICEABLE

    @property
    def deciding_half_width(self) -> float:
        """Half width of the question that decides [dB]."""
        return _half_width(self.following, self.question)

    @property
    def next_half_width(self) -> float:
        """The same after the measurement that narrows it most [dB]."""
        return self.deciding_half_width * (1.0 - self.gain / PERCENT)


def _answered(repeated: Repeated) -> _Answer:
    """Take the first design that is not today's, and ask what narrows its change most."""
    design = next(name for name in repeated.designs if name != TODAY)
    following = _next_table(repeated, design)
    scope = SERIES if f"{SERIES}, ± [dB]" in following else HERE
    question = DECISION if f"{DECISION}, ± [dB]" in following else HERE
    nearest, gain = _best_next(following, question)
    nearest_of_scope, gain_of_scope = _best_next(following, scope)
    return _Answer(
        repeated=repeated,
        design=design,
        row=list(repeated.designs).index(design),
        level=repeated.mean_level,
        change=repeated.mean_change,
        sources=_source_table(repeated, design),
        following=following,
        scope=scope,
        question=question,
        nearest=nearest,
        gain=gain,
        nearest_of_scope=nearest_of_scope,
        gain_of_scope=gain_of_scope,
    )


def uncertainty_report(repeated: Repeated, inputs: Sequence[Path], origin: str) -> Report:
    """Report how certain levels and changes are, and what to measure next.

    `inputs`: files read; `origin`: where the designs come from, in words that follow "it".
    """
    answer = _answered(repeated)
    report = Report(
        "How certain is the effect of the mounts",
        "With the errors of all measurements: how certain are levels and changes in "
        f"{', '.join(repeated.vehicles)}, and what should be measured next?",
    )
    report.explain(
        "booming noise",
        "SPL",
        "SPLV",
        "noise transfer function",
        "dynamic stiffness",
        "σ",
    )
    report.inputs += inputs
    report.facts |= {"kernel": repeated.index.kernel, "draws": repeated.n_draws}
    report.answer(*_answer_in_words(answer, origin))
    _panels(report, answer)
    sources = answer.sources
    priors = sources.loc[sources["from"] == PRIOR, "source"]
    report.warn(
        f"Stated, not measured: {', '.join(priors)}. Measure some vehicles in two ways "
        "(--vehicle) to replace the values for transfer functions."
        if len(priors)
        else "",
        *motion_report(repeated.index, repeated.rows[:1]).warnings,
    )
    _numbers(report, answer)
    _levels(report, answer)
    report.section(
        "Where it comes from",
        f"Each source alone; the change is that of {answer.design}, mean of the vehicles.",
    )
    report.table("sources", sources, "Sources, independent of each other.")
    picks = [name for name in repeated.designs if name != TODAY]
    report_expected(report, repeated.expected, picks, repeated.vehicles)
    _next(report, answer.following)
    return report


def _answer_in_words(answer: _Answer, origin: str) -> tuple[str, ...]:
    """Return the answer for these vehicles, for any vehicle, and what it leaves out."""
    level, half = answer.level, answer.half_width
    change = float(answer.change.value[answer.row])
    next_measurement = (
        f"Nothing needs to be measured: ± {answer.deciding_half_width:.2f} dB is not heard."
        if answer.is_sure
        else f"Measure next: {answer.nearest}; ± {answer.deciding_half_width:.2f} dB for the "
        f"{answer.question} becomes ± {answer.next_half_width:.2f} dB."
    )
    # what would narrow that stands in the table, beside what narrows the other questions
    for_any = (
        "With the choice of vehicles and load cases, the model's change in any vehicle and load "
        f"case is known to ± {_half_width(answer.following, answer.scope):.1f} dB."
        if answer.scope == SERIES
        else ""
    )
    best = f"{answer.design[0].upper()}{answer.design[1:]}"
    return (
        f"{best} brings {expected_on_average(answer.expected, change)}. {next_measurement}",
        certainty_sentence(answer.expected),
        "By errors of measurement alone the model's change is "
        f"{signed(change, 1)} ± {half:.2f} dB, and today's mean level {level.value[0]:.1f} ± "
        f"{level.half_width[0]:.1f} dB(A) (90 %).",
        for_any,
        f"{best} {origin}. Most of its change comes from {_strongest(answer)}.",
        model_sentence(answer.expected, change, bodies=False),
    )


def _strongest(answer: _Answer) -> str:
    """Name the factors of the design that alone bring most."""
    index, designs = answer.repeated.index, answer.repeated.designs
    today, chosen = designs[TODAY], designs[answer.design]
    alone = np.where(np.eye(len(chosen), dtype=bool), chosen, today)
    order = np.argsort(index(alone).mean(axis=1), kind="stable")[:MOST_FACTORS]
    return listed(tuple(f"{index.variable_names[k]} × {chosen[k]:.2f}" for k in order))


def _panels(report: Report, answer: _Answer) -> None:
    """Show each vehicle, what to measure next and what to do next."""
    repeated, row = answer.repeated, answer.row
    changes = repeated.interval(lambda drawn: _change(drawn.level))
    levels = repeated.interval(lambda drawn: drawn.level)
    each = pd.DataFrame(
        {
            "vehicle": list(repeated.vehicles),
            "today [dB(A)]": levels.value[0],
            "± [dB]": levels.half_width[0],
            **expected_column(answer.expected, range(len(repeated.vehicles))),
            "change [dB]": changes.value[row],
            "from [dB]": changes.lower[row],
            "to [dB]": changes.upper[row],
        }
    )
    decimals = {"± [dB]": 1, "change [dB]": 1, "from [dB]": 1, "to [dB]": 1}
    report.panel(
        "Each vehicle",
        Table(each, "", decimals),
        "90 % intervals; ±, change, from and to are the model's, with errors of measurement alone.",
        wide=True,
    )
    half_width = f"{answer.question}, ± [dB]"
    following = answer.following[["measurement", half_width]].head(MOST_NEXT)
    others = (
        f"± for other cars of the group than these {len(repeated.vehicles)}."
        if answer.question == DECISION
        else ""
    )
    report.panel("What to measure next", Table(following, "", {half_width: 2}), others)
    report.panel(
        "What to do next",
        Step("deboom run measured_uncertainty --vehicle FOLDER", "errors from your own vehicles"),
        Step("deboom run measured_uncertainty --front RUN", "for the picks of a front"),
    )


def _numbers(report: Report, answer: _Answer) -> None:
    """Say level and change with their intervals, and what to measure next."""
    repeated, level, change, row = answer.repeated, answer.level, answer.change, answer.row
    report.number(
        "level_db",
        float(level.value[0]),
        "dB(A)",
        "today's mean level, mean of the vehicles",
        headline=".1f",
    )
    report.number(
        "level_half_width_db",
        float(level.half_width[0]),
        "dB",
        "half width of the 90 % interval of level_db by errors of measurement",
    )
    report.number(
        "change_db",
        float(change.value[row]),
        "dB",
        "change of the mean level by best-mean in the model",
        headline="+.2f",
    )
    report.number(
        "change_lower_db",
        float(change.lower[row]),
        "dB",
        "lower end of the 90 % interval of change_db by errors of measurement",
    )
    report.number(
        "change_upper_db",
        float(change.upper[row]),
        "dB",
        "upper end of the 90 % interval of change_db by errors of measurement",
    )
    report.number(
        "change_half_width_db",
        answer.half_width,
        "dB",
        "half width of the 90 % interval of change_db by errors of measurement",
        headline=".2f",
    )
    report.number(
        "probability_quieter",
        float(repeated.quieter[row]),
        "1",
        "probability that best-mean is quieter than today's, by errors of measurement",
        headline=".2f",
    )
    report.number(
        "next_measurement",
        answer.nearest,
        "",
        f"what to measure next for the {answer.question}",
        headline="" if answer.is_sure else "s",
    )
    report.number(
        "next_narrower_percent",
        answer.gain,
        "%",
        f"by how much next_measurement narrows the interval of the {answer.question}",
        headline="" if answer.is_sure else ".0f",
    )
    report.number(
        "next_measurement_series",
        answer.nearest_of_scope,
        "",
        "what to measure next for any vehicle and load case",
    )
    report.number(
        "next_narrower_percent_series",
        answer.gain_of_scope,
        "%",
        "by how much next_measurement_series narrows the interval of the change",
    )
    of_vehicles = repeated.interval(lambda drawn: _change(drawn.level)).half_width[row]
    for vehicle, half in zip(repeated.vehicles, of_vehicles, strict=True):
        report.number(
            f"change_half_width_db_{vehicle}",
            float(half),
            "dB",
            "half width of the 90 % interval of the vehicle's change by errors of measurement",
        )
    report_expected_numbers(report, answer.expected, repeated.vehicles)


@dataclass(frozen=True, eq=False)
class Drawn:
    """What one index says of the designs; levels are means over the lines.

    All of shape (..., n_design, n_vehicle): ``level``, ``loudest`` (line of the first load case)
    [dB(A)], and ``sigma`` over the scatter of parts [dB].
    """

    level: RealArray
    loudest: RealArray
    sigma: RealArray


@dataclass(frozen=True, eq=False)
class Repeated:
    """Designs as measured and as measured again, and what follows.

    ``uncertain``: the model with the errors of its data; ``every_case``: that of all load cases.
    ``again`` has a leading axis of draws; ``alone`` is source → mean level if nothing else errs,
    shape (n_draws, n_design, n_vehicle) [dB(A)]. ``expected`` is what cars are expected to show of
    the designs after today's; or why nothing is. ``widths``: of the interval of the first of them
    after a measurement, see `deboom.vehicles.expected_change.widths_if_measured`; empty where
    nothing is expected.
    """

    uncertain: UncertainIndex
    every_case: Any
    designs: Mapping[str, RealArray]
    measured: Drawn
    again: Drawn
    alone: Mapping[str, RealArray]
    expected: ExpectedChange | str
    widths: Mapping[CarMeasurement | None, RealArray]

    @property
    def n_draws(self) -> int:
        """How often all measurements were drawn again."""
        return len(self.again.level)

    @property
    def index(self) -> Any:
        """The study's index, from the data as measured."""
        return self.uncertain.index

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return tuple(self.index.response_names)

    @property
    def rows(self) -> RealArray:
        """The named designs, shape (n_design, k) [1]."""
        return np.stack(list(self.designs.values()))

    def interval(self, of: Callable[[Drawn], RealArray]) -> Interval:
        """Return the 90 % interval of a number that is computed from a `Drawn`."""
        return pivotal_interval(of(self.measured), of(self.again))

    @property
    def mean_level(self) -> Interval:
        """Mean over the vehicles, shape (n_design,) [dB(A)]."""
        return self.interval(lambda drawn: drawn.level.mean(-1))

    @property
    def mean_change(self) -> Interval:
        """Its change against today's, shape (n_design,) [dB]."""
        return self.interval(lambda drawn: _change(drawn.level).mean(-1))

    @property
    def quieter(self) -> RealArray:
        """Probability that a design is quieter than today's, mean of the vehicles, (n_design,)."""
        mean, again = self.measured.level.mean(-1), self.again.level.mean(-1)
        return probability_below(mean - mean[0], again - again[:, :1])

    def variances(self, design: str | None) -> dict[str, RealArray]:
        """Variance by each source alone, of every vehicle and last of their mean [dB²].

        Of the change by a design against today's; None: of today's level.
        """
        variances = {}
        for name, levels in self.alone.items():
            values = levels[:, 0]
            if design is not None:
                values = _change(levels)[:, list(self.designs).index(design)]
            both = np.concatenate([values, values.mean(axis=1, keepdims=True)], axis=1)
            variances[name] = both.var(axis=0, ddof=1)
        return variances


def _change(level: RealArray) -> RealArray:
    """Return the change against today's, the first design, shape (..., n_design, n_vehicle)."""
    return np.asarray(level - level[..., :1, :])


def _levels(report: Report, answer: _Answer) -> None:
    """Show levels and changes with their intervals."""
    repeated = answer.repeated
    report.section(
        "Levels and changes",
        "The errors of every measurement are drawn again, the same for all designs and vehicles, "
        f"{len(repeated.again.level)} times, and everything is computed from each draw. An error "
        "of calibration shifts all levels of a vehicle alike and cancels in changes, so changes "
        "are much more certain. Intervals contain the truth in 90 % of all cases. They may be "
        "asymmetric about the measured value, because noise fills notches.",
    )
    level = repeated.interval(lambda drawn: drawn.level)
    change = repeated.interval(lambda drawn: _change(drawn.level))
    loudest = repeated.interval(lambda drawn: drawn.loudest)
    change_of_loudest = repeated.interval(lambda drawn: _change(drawn.loudest))
    shown = drawn_rows(change.value[answer.row])
    changed = {
        name: _bounds(change, (place, shown))
        for place, name in enumerate(repeated.designs)
        if place
    }
    panels = [
        IntervalPanel("mean level [dB(A)]", {TODAY: _bounds(level, (0, shown))}),
        IntervalPanel("change against today's [dB]", changed),
    ]
    report.figure(
        "changes",
        lambda: plot.interval_panels([repeated.vehicles[row] for row in shown], panels),
        "Measured values and 90 % intervals."
        + left_out(len(repeated.vehicles), f"that gain least by {answer.design}", "vehicles"),
    )
    report_cells(
        report,
        "changes_others",
        "change against today's",
        [f"{name}{end}" for name in list(repeated.designs)[1:] for end in ("", ", from", ", to")],
        repeated.vehicles,
        np.concatenate(
            [_bounds(change, place) for place in range(1, len(repeated.designs))], axis=0
        ),
        shown,
        unit="dB",
    )
    picks = pd.DataFrame(
        {
            "design": list(repeated.designs),
            **_columns("mean level", "dB(A)", repeated.mean_level),
            **_columns("change", "dB", repeated.mean_change),
            **_columns("sigma", "dB", repeated.interval(lambda drawn: drawn.sigma.mean(-1))),
            "quieter than today's [%]": PERCENT * repeated.quieter,
        }
    )
    caption = "Mean of the vehicles; σ is the scatter of parts within their tolerance."
    report.table("picks", picks, caption)
    vehicles = pd.concat(
        [
            pd.DataFrame(
                {
                    "design": [name] * len(repeated.vehicles),
                    "vehicle": list(repeated.vehicles),
                    **_columns("mean level", "dB(A)", level, place),
                    **_columns("change", "dB", change, place),
                    **_columns("loudest line", "dB(A)", loudest, place),
                    **_columns("change of the loudest line", "dB", change_of_loudest, place),
                }
            )
            for place, name in enumerate(repeated.designs)
        ],
        ignore_index=True,
    )
    report.table("vehicles", vehicles)


def _next(report: Report, following: pd.DataFrame) -> None:
    """Show what one more measurement would narrow."""
    report.section(
        "What to measure next",
        "Expected half widths of the 90 % intervals after one more measurement, from the "
        "variances of today. Measurements in cars count for the expected change: bodies that agree "
        "with what is known are measured in thought, and the interval is stated as it would be "
        "then; where it becomes wider, known bodies give way more than most. “Any vehicle and load "
        "case” treats the measured vehicles and load cases as a sample of all, with Student's t "
        "for their small number.",
    )
    decimals = {name: 3 for name in map(str, following) if name.endswith("[dB]")}
    caption = "Sorted by their worth for the first question."
    report.table("next", following, caption, decimals)


def _source_table(repeated: Repeated, design: str) -> pd.DataFrame:
    """One row per source: its size, where that comes from, and what it does to the mean."""
    sources = repeated.uncertain.data.sources
    columns: dict[str, Any] = {
        "source": [source.name for source in sources],
        "size, 1 σ": [source.size for source in sources],
        "from": [source.origin for source in sources],
    }
    for what, share, of in (
        ("level", "share of its variance [%]", None),
        ("change", "share of that variance [%]", design),
    ):
        variances = repeated.variances(of)
        variance = np.array([float(variances[source.name][-1]) for source in sources])
        total = sum(float(values[-1]) for values in variances.values())
        columns[f"σ of the {what} [dB]"] = np.sqrt(variance)
        columns[share] = PERCENT * variance / total if total > 0 else np.zeros_like(variance)
    return pd.DataFrame(columns)


def _questions(repeated: Repeated, design: str) -> Questions:
    """Return what is asked of the mean over the vehicles, with its variances.

    "Any vehicle and load case" takes those that were measured for a sample: their spread is split
    into vehicles, load cases and rest by `crossed_spread` over all load cases of the platform, and
    of that between vehicles the part that errors of measurement make is taken off. The expected
    change comes first where there is one: its interval has these errors, what cars do besides, and
    the choice of the vehicles.
    """
    decision = _decision(repeated, design)
    of_decision = {DECISION: tuple(decision)} if decision else {}
    of_change, of_level = repeated.variances(design), repeated.variances(None)
    here = tuple(VariancePart(name, float(v[-1])) for name, v in of_change.items())
    level = tuple(VariancePart(name, float(v[-1])) for name, v in of_level.items())
    n_vehicle, n_used = len(repeated.vehicles), len(repeated.index.load_case_names)
    if n_vehicle < 2:
        return {**of_decision, HERE: here, LEVEL: level}
    rows = np.stack([repeated.rows[0], repeated.designs[design]])
    every = repeated.every_case
    levels = [every.levels(rows, name).mean(axis=2) for name in every.load_case_names]
    spread = crossed_spread(np.stack([level[1] - level[0] for level in levels], axis=1))
    by_errors = sum(float(v[:-1].mean()) for name, v in of_change.items() if name in TRANSFER)
    vehicles = max(float(spread.rows + spread.rest / n_used) - by_errors, 0.0) / n_vehicle
    parts = [*here, VariancePart(VEHICLES, vehicles, n_vehicle - 1)]
    if spread.n_column > 1:
        parts.append(VariancePart(LOAD_CASES, float(spread.columns) / n_used, spread.n_column - 1))
    return {**of_decision, HERE: here, SERIES: tuple(parts), LEVEL: level}


def _decision(repeated: Repeated, design: str) -> list[VariancePart]:
    """Return what the variance of the expected change consists of; empty where none is [dB²]."""
    expected = repeated.expected
    if isinstance(expected, str):
        return []
    errors = [VariancePart(name, float(v[-1])) for name, v in repeated.variances(design).items()]
    parts = [*errors, VariancePart(CARS, _of_cars(repeated.widths[None], errors))]
    n_vehicle = len(repeated.vehicles)
    if n_vehicle > 1:
        changes = expected.cars.expected[list(repeated.designs).index(design) - 1]
        parts.append(VariancePart(VEHICLES, float(changes.var(ddof=1)) / n_vehicle, n_vehicle - 1))
    return parts


def _of_cars(width: RealArray, errors: Sequence[VariancePart]) -> float:
    """Return the variance of an interval of some width that errors of measurement leave [dB²]."""
    of_deviation = half_width([VariancePart("", 1.0)])
    total = (float(width[0]) / 2.0 / of_deviation) ** 2
    return max(total - sum(part.variance for part in errors), 0.0)


def _in_cars(repeated: Repeated, design: str) -> list[NextMeasurement]:
    """Return the measurements in cars that would tell something new, with what they leave."""
    errors = [part for part in _decision(repeated, design) if part.name in repeated.alone]
    now = _of_cars(repeated.widths[None], errors) if errors else 0.0
    return [
        NextMeasurement(step.value, {CARS: _of_cars(width, errors) / now}, {})
        for step, width in repeated.widths.items()
        if step is not None and now > 0.0
    ]


def _candidates(repeated: Repeated, design: str) -> list[NextMeasurement]:
    """Return measurements that may come next, as far as they touch a source of the study."""
    names = {*repeated.uncertain.data.names, VEHICLES, CARS}
    if len(repeated.every_case.load_case_names) > 1:
        names.add(LOAD_CASES)  # what differs between load cases is known from several alone
    n, m = len(repeated.vehicles), len(repeated.index.load_case_names)
    one_more, one_case = n / (n + 1), m / (m + 1)
    twice = dict.fromkeys(TRANSFER, TWICE)
    more_vehicles = dict.fromkeys((*TRANSFER, VEHICLES), one_more)
    every = [
        *_in_cars(repeated, design),
        NextMeasurement("one more vehicle", more_vehicles, {VEHICLES: 1.0}),
        *(
            [NextMeasurement("one more load case", {LOAD_CASES: one_case, NOISE: one_case}, {})]
            if LOAD_CASES in names
            else []
        ),
        NextMeasurement("transfer functions, another method and day", twice, {}),
        NextMeasurement(
            "transfer functions, same setup, another day", {DAY: TWICE, FLOOR: TWICE}, {}
        ),
        NextMeasurement("microphone, source calibrated twice as well", {CALIBRATION: HALVED}, {}),
        NextMeasurement("shaker aligned twice as well", {SHAKER: HALVED, CELLS: HALVED}, {}),
        NextMeasurement("mounts characterised anew", {SHAKER: TWICE, BUDGET: TWICE}, {}),
        NextMeasurement("accelerometers placed twice as well", {MOTION: HALVED}, {}),
        NextMeasurement("run repeated, sensors set up anew", {MOTION: TWICE, NOISE: TWICE}, {}),
    ]
    return [measurement for measurement in every if names & set(measurement.remaining)]


def _next_table(repeated: Repeated, design: str) -> pd.DataFrame:
    """One row per measurement that may come next: expected half widths of the 90 % intervals.

    Those that narrow the first question most come first; of equals, the next question decides.
    """
    questions = _questions(repeated, design)
    rows: list[dict[str, object]] = []
    for measurement in (None, *_candidates(repeated, design)):
        row: dict[str, object] = {"measurement": measurement.name if measurement else AS_IT_IS}
        for name, parts in questions.items():
            now = half_width(parts)
            after = now if measurement is None else _after(parts, measurement)
            # fewer effective degrees of freedom may outweigh a gain in what hardly counts
            gain = max(1.0 - after / now, 0.0) if now > 0.0 else 0.0
            row |= {f"{name}, ± [dB]": after, f"{name}: narrower by [%]": PERCENT * gain}
        rows.append(row)
    table = pd.DataFrame(rows)
    gains = [f"{name}: narrower by [%]" for name in questions]
    rest = table.iloc[1:].sort_values(gains, ascending=False, kind="stable")
    return pd.concat([table.iloc[:1], rest], ignore_index=True)


def _after(parts: tuple[VariancePart, ...], measurement: NextMeasurement) -> float:
    """Return the half width expected after one more measurement [dB]."""
    names = {part.name for part in parts}
    remaining = {n: share for n, share in measurement.remaining.items() if n in names}
    more = {n: f for n, f in measurement.more_degrees_of_freedom.items() if n in names}
    return half_width_after(parts, NextMeasurement(measurement.name, remaining, more))


def _best_next(following: pd.DataFrame, question: str) -> tuple[str, float]:
    """Return the measurement that narrows a question most, and by how much [%]."""
    gains = following[f"{question}: narrower by [%]"]
    row = int(gains.to_numpy().argmax())
    return str(following["measurement"].iloc[row]), float(gains.iloc[row])


def _half_width(following: pd.DataFrame, question: str) -> float:
    """Return the half width of a question as it is [dB]."""
    return float(following[f"{question}, ± [dB]"].iloc[0])


def _columns(
    what: str, unit: str, interval: Interval, place: int | slice = slice(None)
) -> dict[str, RealArray]:
    """Return a value with both ends of its interval as columns of a table."""
    labels = (f"{what} [{unit}]", f"{what}, from [{unit}]", f"{what}, to [{unit}]")
    return dict(zip(labels, _bounds(interval, place), strict=True))


def _bounds(
    interval: Interval, place: int | slice | tuple[int, list[int]] = slice(None)
) -> tuple[RealArray, RealArray, RealArray]:
    """Return value, lower and upper end."""
    return interval.value[place], interval.lower[place], interval.upper[place]
