"""The page on the stiffnesses within which parts may be delivered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.stats import gmean

from deboom import plot
from deboom.arrays import AXES, PERCENT, RealArray
from deboom.errors import listed
from deboom.explore.box import Box, BoxQuestion, face_shares, verified_share
from deboom.explore.largest_box import LargestBox, tolerance_box
from deboom.explore.selection import variables_without_effect
from deboom.explore.space import DesignSpace, sobol_points
from deboom.files.acceptance import AcceptanceBox, BoxResponse, BoxVariable, box_document
from deboom.files.platform import platform_sha256
from deboom.measurement.uncertainty import Interval
from deboom.pages.front import drawn_rows, left_out, report_cells
from deboom.pages.front_answer import abbreviations
from deboom.pages.motion import motion_name, motion_report, report_runs
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.plot.style import mount_colours, signed
from deboom.report import Report, Step, Table
from deboom.vehicles.booming_model import BoomingModel
from deboom.vehicles.fleet_front import PeakRise
from deboom.vehicles.free_directions import NOTICEABLE, DirectionFreedom, free_directions
from deboom.vehicles.limits import MeanLevel, PeakLevel
from deboom.vehicles.platform import MountSource, Runs

SHOWN_PARTS, PEAK_PARTS = 4096, 256
"""Parts of the box whose levels are drawn, and of each of its ends; those with peaks."""
USUAL_SHARE = 0.8
"""Of what a front's design brings each vehicle, that limits keep where nobody states any [1]."""
TIGHTEST = 2
"""Directions in the headline: the narrowest intervals that the limit sets."""


def box_report(
    study: BoxStudy,
    certainty: Interval,
    *,
    softer_and_harder: tuple[float, float],
    inputs: Sequence[Path],
    run: str,
) -> Report:
    """Report within which stiffnesses parts may be delivered.

    - `certainty`: share that keeps the limit, with all measurements drawn again [1].
    - `softer_and_harder`: shares where all rubber is softer, and harder, by the common factor
      of the question [1].
    - `inputs`: files read; `run`: its name.
    """
    softer, harder = softer_and_harder
    together = _percent(study.question.common, 0)
    origin = study.limit_origin
    check, of_study = study.solution.verified, study.question
    what = "parts, in all vehicles," if of_study.together else "parts and vehicles"

    report = Report(
        "Acceptance box of the mounts",
        "Within which stiffnesses may parts be delivered, each direction independent of all "
        f"others, so that {_percent(of_study.share, 1)} of {what} keep {origin}?",
    )
    report.explain("SPL", "stiffness factor", "dynamic stiffness", "tolerance", "Pareto front")
    limited = study.effective & ~study.on_bounds.all(axis=0)
    tight = np.argsort(np.where(limited, study.box.width / study.box.centre, np.inf))
    ends = (
        f"{study.variables[k]} {study.box.lower[k]:.2f} to {study.box.upper[k]:.2f}"
        for k in tight[: min(TIGHTEST, limited.sum())]
    )
    report.number(
        "tightest", ", ".join(ends), "", "tightest directions, of today's stiffness", headline="s"
    )
    _numbers(report, study, certainty)
    report.number(
        "share_softer",
        softer,
        "1",
        f"share that keeps the limit where all rubber is {together} softer in the cars",
    )
    report.number(
        "share_harder",
        harder,
        "1",
        f"share that keeps the limit where all rubber is {together} harder in the cars",
    )
    _answer(report, study, certainty, what, run)
    report.warn(
        f"{_percent(softer, 1)} of {what} keep {origin} where the rubber of all mounts together is "
        f"{together} softer in the cars than in the test of a part, and {_percent(harder, 1)} "
        "where it is as much harder, as temperature, age or a batch make it; "
        f"{_percent(of_study.share, 0)} is the mean over all factors between. Where the cars have "
        "one of the ends, demand more with --below-today."
        if of_study.common and min(softer, harder) < of_study.share
        else ""
    )
    if not of_study.together and study.missed.max() > 1.0 - of_study.share:
        report.warn(
            f"The share is one over all vehicles: {study.binding} alone misses its limit with "
            f"{_percent(float(study.missed.max()), 1)} of the parts. --worst-vehicle asks every "
            "part to keep the limit in all vehicles."
        )
    if study.gain_kept is not None and study.gain_kept < USUAL_SHARE:
        report.warn(
            f"No box keeps {_percent(USUAL_SHARE, 0)} of the vehicles' gains; "
            f"{_percent(study.gain_kept, 0)} is the largest share, in steps of 10 %, that has one."
        )
    outside = study.effective & ((study.point < study.box.lower) | (study.point > study.box.upper))
    if outside.any():
        names = ", ".join(
            f"{study.variables[k]} {study.point[k]:.2f}" for k in np.flatnonzero(outside)
        )
        report.warn(
            f"The design that was asked for lies outside the box in {names}: the largest box asks "
            "for other parts there, so that the other directions may be wide."
        )
    if not study.solution.confirmed:
        report.warn(
            f"The verification does not confirm the stated share: {_percent(check.bound, 2)} with "
            f"confidence against {_percent(of_study.share, 2)}."
        )
    designs = np.stack([study.space.nominal, study.point])
    report.warn(*motion_report(study.index, designs).warnings)
    report.facts |= {"kernel": study.index.kernel, "law": study.law}
    report.inputs += inputs
    report.document("acceptance_box", box_document(acceptance_box(study, certainty)))

    _box(report, study, origin)
    _levels(report, study, certainty, what)
    report_runs(report, study.runs)
    return report


def _numbers(report: Report, study: BoxStudy, certainty: Interval) -> None:
    """Say which share of the parts keeps the limit, how sure that is, and how wide the box is."""
    check, of_study = study.solution.verified, study.question
    report.number("share_stated", of_study.share, "1", "share of the parts that was asked for")
    report.number(
        "share_verified",
        check.share,
        "1",
        "share of the parts that keeps the limit, verified with new draws",
        headline=".3f",
    )
    report.number(
        "share_bound",
        check.bound,
        "1",
        "share of parts that keep the limits, at least, with 95 % confidence",
    )
    report.number(
        "share_missed_worst",
        float(study.missed.max()),
        "1",
        "share of the parts that miss the limit of binding_vehicle",
        headline=".3f",
    )
    report.number(
        "binding_vehicle", study.binding, "", "vehicle whose limit most parts miss", headline="s"
    )
    report.number(
        "width_ratio_pm15",
        study.width_over_plain,
        "1",
        "width of the box over ±15 % about the Pareto point: geometric mean, axes with an effect",
    )
    plain = verified_share(
        of_study,
        study.plain,
        seed=study.seed,
        n_parts=check.n_parts,
        confidence=check.confidence,
    )
    report.number("share_pm15", plain.share, "1", "share of ±15 % that keeps the limit")
    report.number("n_axes", int(study.effective.sum()), "", "directions with an effect")
    report.number(
        "n_ends_on_bounds",
        int(study.on_bounds.sum()),
        "",
        "ends of the box on bounds of the search",
    )
    report.number(
        "limit_db_first_vehicle",
        float(of_study.limit[0]),
        "dB(A)",
        "limit of the mean level in the first vehicle",
    )
    report.number(
        "limit_could_be_lowered_db",
        study.solution.room,
        "dB",
        "by how much the limit could be lowered, until the box is a point",
    )
    report.number(
        "change_inside_db",
        study.change_inside,
        "dB",
        "change of what is limited with parts all over the box, mean of the vehicles, in the model",
        headline="+.1f",
    )
    report.number(
        "change_of_design_db",
        study.change_of_design,
        "dB",
        "the same by the design that the box lies about",
    )
    if study.gain_kept is not None:
        report.number(
            "gain_kept",
            study.gain_kept,
            "1",
            "share of each vehicle's gain by the design that its limit keeps",
        )
    report.number("n_parts_verified", check.n_parts, "", "parts of the verification")
    report.number("seconds", round(study.solution.seconds, 3), "s", "time for the box")
    report.number(
        "share_measured_from",
        float(certainty.lower),
        "1",
        "lower end of the 90 % interval of the share, with all measurements drawn again",
    )
    report.number(
        "share_measured_to",
        float(certainty.upper),
        "1",
        "upper end of the 90 % interval of the share, with all measurements drawn again",
    )


@dataclass(frozen=True, eq=False)
class BoxStudy:
    """An acceptance box with what it is compared with.

    - `runs`: platform, vehicles and load cases.
    - `index`: the model.
    - `space`: designs and their tolerance.
    - `point` (k,): the Pareto point [1].
    - `solution`: the largest box, verified.
    - `seed`: of what is drawn for the page.
    - `limit_below_today`: how far each vehicle's limit lies below its level today; None: one limit
      for all, or of the gain [dB].
    - `gain_kept`: share of each vehicle's gain by the design that its limit keeps [1]; None: limits
      were stated, or are today's levels.
    """

    runs: Runs
    index: BoomingModel
    space: DesignSpace
    point: RealArray
    solution: LargestBox
    seed: int
    limit_below_today: float | None
    gain_kept: float | None = None

    @property
    def question(self) -> BoxQuestion:
        """What was asked."""
        return self.solution.question

    @property
    def limit_origin(self) -> str:
        """Where the limit comes from, in words."""
        below = self.limit_below_today
        if self.gain_kept is not None:
            return f"{_percent(self.gain_kept, 0)} of each vehicle's gain by the design"
        if below is None:
            return "the limit that was stated"
        return f"each vehicle's level of today{f' less {below:g} dB' if below else ''}"

    @cached_property
    def today(self) -> RealArray:
        """What is limited of each vehicle with today's parts, shape (n_vehicle,) [dB(A)]."""
        return np.asarray(self.response(self.space.nominal[np.newaxis])[0])

    @property
    def change_of_design(self) -> float:
        """Change by the Pareto point, mean of the vehicles [dB]."""
        return float(np.mean(self.response(self.point[np.newaxis])[0] - self.today))

    @property
    def change_inside(self) -> float:
        """Change with all parts anywhere in the box, mean of parts and vehicles [dB]."""
        return float(np.mean(self.shown_excess + self.question.limit - self.today))

    @property
    def response(self) -> MeanLevel | PeakLevel:
        """What is limited."""
        response = self.question.response
        assert isinstance(response, MeanLevel | PeakLevel)
        return response

    @property
    def box(self) -> Box:
        """The largest box."""
        return self.solution.box

    @property
    def law(self) -> str:
        """How parts lie in the box, as an acceptance test promises, and what all have in common."""
        together = f"all rubber within ± {_percent(self.question.common, 0)} together in the cars"
        return "uniform in the box" + (f", {together}" if self.question.common else "")

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names."""
        return self.question.response.response_names

    @property
    def variables(self) -> tuple[str, ...]:
        """Names."""
        return self.question.names

    @property
    def tolerance(self) -> float:
        """Half width of the box that is compared with [1]."""
        return float(self.space.tolerance.max())

    @property
    def band(self) -> tuple[float, float]:
        """Lines that count [Hz]."""
        if isinstance(self.response, PeakLevel):
            return self.response.band
        return float(self.index.frequency[0]), float(self.index.frequency[-1])

    @cached_property
    def plain(self) -> Box:
        """The box of one tolerance about the Pareto point."""
        return tolerance_box(self.variables, self.point, self.tolerance)

    @cached_property
    def effective(self) -> npt.NDArray[np.bool_]:
        """Variables that a vehicle depends on, shape (k,)."""
        free = variables_without_effect(self.index, self.space)
        return np.array([name not in free for name in self.variables])

    @cached_property
    def freedom(self) -> DirectionFreedom:
        """How far each variable may leave the Pareto point before a vehicle changes noticeably."""
        without = [
            name
            for name, effective in zip(self.variables, self.effective, strict=True)
            if not effective
        ]
        return free_directions(self.index, self.point, self.space, without_effect=without)

    @cached_property
    def width_over_plain(self) -> float:
        """Geometric mean width of the intervals with an effect over those of one tolerance [1]."""
        return float(gmean(self.box.width[self.effective] / self.plain.width[self.effective]))

    @cached_property
    def shown_excess(self) -> RealArray:
        """Levels of some parts of the box, above their limits, (SHOWN_PARTS, n_vehicle) [dB]."""
        return self.question.excess(self.question.parts(self.box.ends, self._unit))

    @cached_property
    def peak_rises(self) -> RealArray:
        """Rise of the booming peak that rises most, of parts of the box, (PEAK_PARTS,) [dB]."""
        parts = self.question.parts(self.box.ends, self._unit[:PEAK_PARTS])
        return PeakRise(self.index, self.space.nominal)(parts)[:, 0]

    @cached_property
    def faces(self) -> RealArray:
        """Share of the parts at each end of each interval, shape (2, k) [1]."""
        return face_shares(self.question, self.box, self._unit)

    @property
    def missed(self) -> RealArray:
        """Share of the verified parts that miss the limit of each vehicle, shape (n_vehicle,)."""
        return np.asarray(1.0 - self.solution.verified.by_response)

    @property
    def on_bounds(self) -> npt.NDArray[np.bool_]:
        """Ends of intervals with an effect that the bounds set, not the limit, shape (2, k)."""
        span = self.question.upper - self.question.lower
        near = np.stack(
            [self.box.lower - self.question.lower, self.question.upper - self.box.upper]
        )
        return np.asarray((near <= 1e-6 * span) & self.effective)

    @property
    def binding(self) -> str:
        """Vehicle that most parts miss."""
        return self.vehicles[int(np.argmax(self.missed))]

    @cached_property
    def reference_stiffness(self) -> RealArray:
        """Mean |K| over the lines of the first load case, shape (k,) [N/m]; nan: not measured."""
        lines = self.index.frequency
        return self.runs.stiffness(self.runs.cases[0][0], (float(lines[0]), float(lines[-1])))

    @cached_property
    def identified(self) -> npt.NDArray[np.bool_]:
        """Directions whose stiffness is known well enough to be asked in N/m, shape (k,)."""
        runs = self.runs
        return np.array(
            [
                not runs.parts or runs.identified(mount.name, axis)
                for mount in runs.platform.mounts
                for axis in AXES
            ]
        )

    @property
    def condition(self) -> str:
        """At which the reference stiffness was read."""
        lines, case = self.index.frequency, self.runs.cases[0][0]
        return (
            f"mean magnitude of the dynamic stiffness of one piece over {lines[0]:g} to "
            f"{lines[-1]:g} Hz, load case {case.name}, motion as in that run"
        )

    @property
    def _unit(self) -> RealArray:
        size = self.question.n_draws
        return sobol_points(size, SHOWN_PARTS, seed=self.seed, purpose="parts of a box to show")


def _answer(report: Report, study: BoxStudy, certainty: Interval, what: str, run: str) -> None:
    """Fill the first screen: intervals, vehicles, how sure the share is, and what comes next."""
    box, limit = study.box, study.question.limit
    report.answer(*_answer_in_words(study, certainty, what))
    needed = ~study.on_bounds & study.effective
    words = np.select(
        [needed.all(axis=0), needed[0], needed[1]],
        ["both ends", "lower end", "upper end"],
        "nothing",
    )
    rows = np.flatnonzero(study.effective)
    table = pd.DataFrame(
        {
            "direction": [study.variables[k] for k in rows],
            "from [1]": box.lower[rows],
            "to [1]": box.upper[rows],
            "the limit sets": words[rows],
        }
    )
    report.panel(
        "Intervals, each direction independent of all others",
        Table(table, "", dict.fromkeys(("from [1]", "to [1]"), 2)),
        "From and to: shares of today's stiffness, at every state. The supplier's sheet has N/mm "
        "with preload, amplitude and frequency.",
        wide=True,
    )
    levels = study.shown_excess + limit
    each = pd.DataFrame(
        {
            "vehicle": list(study.vehicles),
            "limit [dB(A)]": limit,
            "today [dB(A)]": study.today,
            "in the box [dB(A)]": levels.mean(axis=0),
            "P95 [dB(A)]": np.quantile(levels, 0.95, axis=0),
            "parts that miss [%]": PERCENT * study.missed,
        }
    )
    report.panel("Each vehicle", Table(each, ""), f"{study.response.quantity.capitalize()}.")
    report.panel(
        "What to do next",
        Step(f"deboom accept {run} PARTS", "judge a delivery by it"),
        Step(f"deboom report FRONT --supplier --box {run}", "sheets with these intervals"),
        Step("deboom run solution_box --below-today 1", "ask each vehicle to be quieter"),
    )


def _worth(study: BoxStudy) -> str:
    """Say what parts anywhere in the box bring, and what they give up against the design."""
    inside, design = study.change_inside, study.change_of_design
    sentence = (
        f"With all parts inside, the {study.response.quantity} changes by {signed(inside, 1)} dB "
        f"on average; by the design itself {signed(design, 1)} dB."
    )
    if design - inside > NOTICEABLE:
        return f"{sentence} The box is quieter, as it reaches beyond the design where that helps."
    if inside - design < NOTICEABLE:
        return sentence
    remedy = (
        "narrower intervals keep more: --below-today."
        if study.gain_kept is not None
        else "--front RUN asks each vehicle to keep 80 % of its gain."
    )
    return f"{sentence} {inside - design:.1f} dB are given up for wide intervals; {remedy}"


def _peaks(study: BoxStudy) -> str:
    """Say in how many parts of the box a booming peak is louder than today's."""
    rises = study.peak_rises
    louder = np.count_nonzero(rises > NOTICEABLE)
    if louder:
        return (
            f"In {_percent(louder / len(rises), 1)} of the parts a booming peak is louder than "
            f"today, by up to {rises.max():.1f} dB."
        )
    return f"No booming peak is louder than today in {len(rises)} parts drawn from the box."


def _answer_in_words(study: BoxStudy, certainty: Interval, what: str) -> tuple[str, ...]:
    """Return which ends to keep, what that reaches and brings, how sure it is, and the limit."""
    check, box = study.solution.verified, study.box
    origin = study.limit_origin
    needed = ~study.on_bounds & study.effective
    ends = [
        f"{name} "
        + " ".join(
            f"{word} {end:.2f}"
            for word, end, of_limit in (
                ("from", box.lower[k], needed[0, k]),
                ("up to", box.upper[k], needed[1, k]),
            )
            if of_limit
        )
        for k, name in enumerate(study.variables)
        if needed[:, k].any()
    ]
    free = int(study.effective.sum()) - len(ends)
    deliver = f"Deliver {listed(tuple(ends))} of today's" if ends else "No direction needs an end"
    return (
        f"{deliver}: {_percent(check.share, 1)} of {what} keep {origin}. {free} other directions "
        f"may be anywhere in the bounds of the search. {study.binding} is the closest to its "
        f"limit: {_percent(float(study.missed.max()), 1)} of the parts miss it.",
        f"{_worth(study)} {_peaks(study)}",
        f"How sure: at least {_percent(check.bound, 1)} with {_percent(check.confidence, 0)} "
        f"confidence over parts; with all measurements drawn again "
        f"{_percent(float(certainty.lower), 0)} to {_percent(float(certainty.upper), 0)} (90 %). "
        f"Parts are {study.law}. Shares are the model's: what bodies and amplitudes do in cars is "
        "not in them.",
        abbreviations(study.runs.platform.mounts),
    )


def _box(report: Report, study: BoxStudy, origin: str) -> None:
    """Show the interval of every direction."""
    question, solution, limit = study.question, study.solution, study.question.limit
    low, high = study.band
    limits = " to ".join(dict.fromkeys(f"{end:.2f}" for end in (limit.min(), limit.max())))
    report.section(
        "The box",
        f"Limit: {origin}, {limits} dB(A), {study.response.quantity}, "
        f"{low:g} to {high:g} Hz. A part is accepted if every direction lies in its interval. The "
        "largest box, by the sum of weight times logarithm of width, was found from "
        f"{len(solution.start_log_volumes)} starts in {solution.seconds:.1f} s; stiffness in N/mm "
        f"is the {study.condition}. {study.on_bounds.sum()} of the {2 * study.effective.sum()} "
        "ends lie on the bounds that were searched: there the limit demands nothing. In the "
        f"geometric mean the intervals are {study.width_over_plain:.1f} times as wide as those of "
        f"±{PERCENT * study.tolerance:g} % about the Pareto point.\n\n"
        "The last two columns give, for parts exactly at an end, the share that keeps the limit. "
        "In the largest box every end that the limit sets costs the same share; an end with a much "
        "higher share lies on a bound of the search.",
    )
    box, plain = study.box, study.plain
    report.figure(
        "box",
        lambda: plot.box_intervals(
            study.variables,
            plot.Intervals("acceptance box", box.lower, box.upper),
            plot.Intervals(f"±{PERCENT * study.tolerance:g} %", plain.lower, plain.upper),
            plot.Intervals("bounds", question.lower, question.upper),
            study.freedom.with_todays_parts(study.point),
            study.reference_stiffness * N_PER_MM,
            [not effective for effective in study.effective],
            mount_colours([mount.name for mount in study.runs.platform.mounts]),
        ),
        "Interval of every direction, with today's stiffness and its ends in N/mm.",
    )
    table = _box_table(study)
    report.table(
        "box",
        table,
        "Directions that a vehicle depends on; the others have no requirement.",
        {"from [N/mm]": 0, "to [N/mm]": 0},
        shown=table[study.effective].filter(regex="^(variable|Pareto|from|to |half|lower|upper)"),
    )


def _box_table(study: BoxStudy) -> pd.DataFrame:
    """List the interval of every direction, what sets it, and what its ends are worth."""
    question, box, plain = study.question, study.box, study.plain
    reference = study.reference_stiffness * N_PER_MM
    lower, upper = ~study.on_bounds
    by_limit = np.select([lower & upper, lower, upper], ["from and to", "from", "to"], "neither")
    by_limit = np.where(study.effective, by_limit, "neither")
    return pd.DataFrame(
        {
            "variable": list(study.variables),
            "requirement": np.where(
                by_limit != "neither", "interval", [need.value for need in study.freedom.needs]
            ),
            "Pareto point [1]": study.point,
            "from [1]": box.lower,
            "to [1]": box.upper,
            "half width [%]": PERCENT * 0.5 * box.width / box.centre,
            "from [N/mm]": np.where(study.effective, box.lower * reference, np.nan),
            "to [N/mm]": np.where(study.effective, box.upper * reference, np.nan),
            "set by the limit": by_limit,
            "today [N/mm]": reference,
            "one tolerance from [1]": plain.lower,
            "one tolerance to [1]": plain.upper,
            "weight [1]": question.weight,
            "lower end: parts that keep the limit [%]": PERCENT * study.faces[0],
            "upper end: parts that keep the limit [%]": PERCENT * study.faces[1],
        }
    )


def _levels(report: Report, study: BoxStudy, certainty: Interval, what: str) -> None:
    """Show the levels of the parts inside the box, and how surely their share is known."""
    check, question = study.solution.verified, study.question
    report.section(
        "Levels inside the box",
        f"{check.n_parts} parts, {study.law}, that the search has not seen: "
        f"{_percent(check.share, 2)} of {what} keep the limit, at least "
        f"{_percent(check.bound, 2)} with {_percent(check.confidence, 0)} confidence (the "
        "vehicles of one part are not independent, so each part counts once).\n\nThis is the "
        "share in the cars as they were measured. With the errors of every measurement it lies "
        f"between {_percent(float(certainty.lower), 0)} and "
        f"{_percent(float(certainty.upper), 0)}, with 90 % confidence: the level of a car is "
        "known to half a decibel only.",
    )
    levels = study.shown_excess + question.limit
    today = study.today
    limit = np.broadcast_to(question.limit, today.shape)
    drawn = drawn_rows(np.quantile(levels - limit, 0.95, axis=0))
    report.figure(
        "levels",
        lambda: plot.interval_panels(
            [study.vehicles[row] for row in drawn],
            [
                plot.IntervalPanel(
                    f"{study.response.quantity} [dB(A)]",
                    {
                        "parts of the box, median, 5 to 95 %": tuple(
                            np.quantile(levels[:, drawn], [0.5, 0.05, 0.95], axis=0)
                        ),
                        "limit": (limit[drawn],) * 3,
                        "today": (today[drawn],) * 3,
                    },
                )
            ],
        ),
        "Levels of the parts of the box about their limit."
        + left_out(len(study.vehicles), "that come nearest to it", "vehicles"),
    )
    report_cells(
        report,
        "levels_others",
        "level beyond the limit",
        ("median", "95 % below", "today"),
        study.vehicles,
        np.array([*np.quantile(study.shown_excess, [0.5, 0.95], axis=0), today - limit]),
        drawn,
        unit="dB",
    )
    table = {
        "vehicle": list(study.vehicles),
        "limit [dB(A)]": question.limit,
        "today [dB(A)]": today,
        "Pareto point [dB(A)]": study.response(study.point[np.newaxis])[0],
        "in the box, mean [dB(A)]": levels.mean(axis=0),
        "95 % of the parts below [dB(A)]": np.quantile(levels, 0.95, axis=0),
        "parts that miss the limit [%]": PERCENT * study.missed,
    }
    report.table("vehicles", pd.DataFrame(table), f"{study.response.quantity}: limits, levels.")


def acceptance_box(study: BoxStudy, certainty: Interval) -> AcceptanceBox:
    """Return the box as the file by which deliveries are judged."""
    platform, check = study.runs.platform, study.solution.verified
    reference = np.where(study.identified, study.reference_stiffness, np.nan)
    # nobody can measure a direction that is not identified, and where the limit sets no end of its
    # interval, nobody needs to
    limited = study.identified | (study.effective & ~study.on_bounds.all(axis=0))
    groups = dict.fromkeys(vehicle.group for vehicle in study.runs.fleet.vehicles)
    return AcceptanceBox(
        title=f"{platform.title}: acceptance box",
        platform=platform.name,
        platform_sha256=platform_sha256(platform),
        group=", ".join(groups),
        motion=motion_name(study.index).removesuffix("-dependent"),
        mounts=(MountSource.library_inside if study.runs.parts else MountSource.spectra).value,
        load_cases=tuple((case.name, float(weight)) for case, weight in study.runs.cases),
        band_hz=study.band,
        quantity=study.response.quantity,
        unit=study.response.response_unit,
        limit_below_today_db=study.limit_below_today,
        gain_kept=study.gain_kept,
        together=study.question.together,
        variables=tuple(
            BoxVariable(
                name=name,
                lower=float(study.box.lower[k]),
                upper=float(study.box.upper[k]),
                searched=(float(study.question.lower[k]), float(study.question.upper[k])),
                nominal=float(study.point[k]),
                reference_stiffness_n_per_m=float(reference[k])
                if np.isfinite(reference[k])
                else None,
                condition=study.condition,
                weight=float(study.question.weight[k]),
                required=bool(study.effective[k] and limited[k]),
            )
            for k, name in enumerate(study.variables)
        ),
        responses=tuple(
            BoxResponse(name=name, limit=float(limit), share=float(share))
            for name, limit, share in zip(
                study.vehicles, study.question.limit, check.by_response, strict=True
            )
        ),
        share_stated=study.question.share,
        share_verified=check.share,
        share_bound=check.bound,
        share_measured_again=(float(certainty.lower), float(certainty.upper)),
        confidence=check.confidence,
        n_parts=check.n_parts,
        law=study.law,
        common=study.question.common,
        seed=study.seed,
    )


def _percent(value: float, decimals: int) -> str:
    return f"{PERCENT * value:.{decimals}f} %"
