"""An acceptance box: question, numbers, certainty, tables, figures, page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom import plot as figures
from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.box import (
    Box,
    BoxQuestion,
    VerifiedShare,
    box_sample,
    face_shares,
    verified_share,
)
from deboom.explore.largest_box import (
    BisectionBox,
    BoxEffort,
    FoundBox,
    UnreachableLimit,
    VolumeRatio,
    bisection_box,
    largest_box,
    tolerance_box,
    trade_off,
    volume_ratio,
)
from deboom.explore.selection import variables_without_effect
from deboom.explore.space import DesignSpace
from deboom.files.acceptance import AcceptanceBox, BoxResponse, BoxVariable, box_document
from deboom.measurement.uncertainty import Interval, pivotal_interval
from deboom.mounts.mount import mean_operating_stiffness
from deboom.plot import Intervals
from deboom.plot.style import mount_colours, vehicle_colours
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.platform_model import (
    MountSource,
    Operation,
    motion_name,
    motion_report,
    platform_sha256,
)
from deboom.study.progress import Progress
from deboom.study.result import Scalar, StudyResult
from deboom.study.uncertain_index import uncertain_index
from deboom.vehicles.booming_model import LoadCaseIndex
from deboom.vehicles.limit_responses import MeanLevel, PeakLevel

SHOWN_PARTS = 4096
"""Parts of the box whose levels are drawn, and of each of its faces."""
CURVE = (-0.5, -0.25, 0.0, 0.25, 0.5, 0.75)
"""Steps of the curve over the limit, in parts of what the limit could be lowered by at most [1]."""
CURVE_EFFORT = BoxEffort(starts=1, fine=((0.15, 1024),), calibration=16384)


@dataclass(frozen=True, eq=False)
class BoxStudy:
    """An acceptance box with what it is compared with.

    Parameters
    ----------
    runs : Operation
        Platform, vehicles and load cases.
    index : LoadCaseIndex
        The model.
    space : DesignSpace
        Designs and their tolerance.
    point : array, shape (k,)
        The Pareto point [1].
    found : FoundBox
        The largest box, verified.
    bisection : BisectionBox
        About the Pareto point.
    curve : sequence of (float, FoundBox or UnreachableLimit)
        What the limits were lowered by [dB], and the box there.
    seed : int
    """

    runs: Operation
    index: LoadCaseIndex[Any, Any]
    space: DesignSpace
    point: RealArray
    found: FoundBox
    bisection: BisectionBox
    curve: Sequence[tuple[float, FoundBox | UnreachableLimit]]
    seed: int

    @property
    def question(self) -> BoxQuestion:
        """What was asked."""
        return self.found.question

    @property
    def response(self) -> MeanLevel | PeakLevel:
        """What is limited."""
        response = self.question.response
        assert isinstance(response, MeanLevel | PeakLevel)
        return response

    @property
    def box(self) -> Box:
        """The largest box."""
        return self.found.box

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
    def plain_share(self) -> VerifiedShare:
        """What it keeps, of the parts that verify the largest box."""
        return self.verified(self.plain, self.question)

    @cached_property
    def bisection_share(self) -> VerifiedShare:
        """What the box of the bisection keeps, of the same parts."""
        return self.verified(self.bisection.box, self.question)

    @cached_property
    def effective(self) -> npt.NDArray[np.bool_]:
        """Variables that a vehicle depends on, shape (k,)."""
        free = variables_without_effect(self.index, self.space)
        return np.array([name not in free for name in self.variables])

    @cached_property
    def over_plain(self) -> VolumeRatio:
        """The largest box over that of one tolerance."""
        return volume_ratio(self.box, self.plain, self.effective)

    @cached_property
    def over_bisection(self) -> VolumeRatio:
        """The largest box over that of the bisection."""
        return volume_ratio(self.box, self.bisection.box, self.effective)

    @cached_property
    def shown_excess(self) -> RealArray:
        """Levels of some parts of the box, above their limits, (SHOWN_PARTS, n_vehicle) [dB]."""
        return self.question.excess(self.question.parts(self.box, self._unit))

    @cached_property
    def faces(self) -> RealArray:
        """Share of the parts at each end of each interval, shape (2, k) [1]."""
        return face_shares(self.question, self.box, self._unit)

    @property
    def missed(self) -> RealArray:
        """Share of the verified parts that miss the limit of each vehicle, shape (n_vehicle,)."""
        return np.asarray(1.0 - self.found.verified.by_response)

    @property
    def on_bounds(self) -> npt.NDArray[np.bool_]:
        """Ends of intervals with an effect that the bounds set, not the limit, shape (2, k)."""
        span = self.question.upper - self.question.lower
        near = np.stack(
            [self.box.lower - self.question.lower, self.question.upper - self.box.upper]
        )
        return np.asarray((near <= 1e-6 * span) & self.effective)

    @property
    def ends_on_bounds(self) -> int:
        """How many these are."""
        return int(self.on_bounds.sum())

    @property
    def binding(self) -> str:
        """Vehicle that most parts miss."""
        return self.vehicles[int(np.argmax(self.missed))]

    @cached_property
    def reference_stiffness(self) -> RealArray:
        """Mean |K| over the lines of the first load case, shape (k,) [N/m]; nan: not measured."""
        lines = self.index.frequency
        case = self.runs.cases[0][0]
        edges = (float(lines[0]), float(lines[-1]))
        by_mount = [
            mean_operating_stiffness(mount, case, edges) for mount in self.runs.platform.mounts
        ]
        return np.concatenate(by_mount)

    @cached_property
    def identified(self) -> npt.NDArray[np.bool_]:
        """Directions whose stiffness is known well enough to be asked in N/m, shape (k,)."""
        known = {
            f"{part.mount.name} {one.axis}": one.surface is not None and one.quality.identified
            for part in self.runs.parts
            for one in part.directions
        }
        return np.array([known.get(name, not self.runs.parts) for name in self.variables])

    @property
    def condition(self) -> str:
        """At which the reference stiffness was read."""
        lines, case = self.index.frequency, self.runs.cases[0][0]
        return (
            f"mean magnitude of the dynamic stiffness of one piece over {lines[0]:g} to "
            f"{lines[-1]:g} Hz, load case {case.name}, motion as in that run"
        )

    def verified(self, box: Box, question: BoxQuestion) -> VerifiedShare:
        """Verify another box with the parts that verified the largest one."""
        check = self.found.verified
        return verified_share(
            question, box, seed=self.seed, n_parts=check.n_parts, confidence=check.confidence
        )

    @property
    def _unit(self) -> RealArray:
        size = len(self.variables)
        return box_sample(size, SHOWN_PARTS, seed=self.seed, purpose="parts of a box to show")


def box_study(
    runs: Operation,
    index: LoadCaseIndex[Any, Any],
    space: DesignSpace,
    point: RealArray,
    question: BoxQuestion,
    *,
    seed: int,
    curve: bool = True,
    workers: int = 1,
    progress: Progress,
) -> BoxStudy:
    """Find the box of a question, those at other limits, and what they are compared with.

    Parameters
    ----------
    runs, index, space, point
        See `BoxStudy`.
    question : BoxQuestion
    seed : int
    curve : bool
        Whether boxes at other limits are found too.
    workers : int
        Processes.
    progress : callable
        See `deboom.study.progress.Progress`.

    Raises
    ------
    InputError
        See `deboom.explore.largest_box.largest_box`; variables of the platform that the
        model has not.
    """
    variables = tuple(name for mount in runs.platform.mounts for name in mount.variables)
    if question.names != variables:
        raise InputError(
            f"the model has the variables {list(question.names)}, the mounts {list(variables)}: an "
            "acceptance box needs exactly the stiffness factors of the mounts"
        )
    found = largest_box(question, seed=seed, points=[point], workers=workers, progress=progress)
    steps = [part * found.room for part in CURVE if part != 0.0] if curve else []
    boxes = trade_off(
        question, steps, seed=seed, points=[point], effort=CURVE_EFFORT, workers=workers
    )
    pairs = sorted([(0.0, found), *zip(steps, boxes, strict=True)], key=lambda one: one[0])
    bisection = bisection_box(question, point, seed=seed)
    return BoxStudy(runs, index, space, point, found, bisection, tuple(pairs), seed)


DRAWS, PARTS = 60, 2048
"""Measurements that are drawn again, and parts that each of them judges."""


def share_measured_again(study: BoxStudy) -> Interval:
    """Return the share of the box with the interval that the measurements leave open.

    Parameters
    ----------
    study : BoxStudy

    Returns
    -------
    Interval
        Of parts and vehicles, or parts, that keep the limit, 90 % [1].

    Raises
    ------
    InputError
        Measurements without a stated uncertainty, see `uncertain_index`.

    Notes
    -----
    Noise transfer functions, stiffnesses, motions and forces are drawn again with their errors and
    the box stays as it is. The interval is pivotal, then cut to 0 and 1.
    """
    question = study.question
    places = box_sample(
        len(study.variables), PARTS, seed=study.seed, purpose="parts of a box measured again"
    )
    parts = question.parts(study.box, places)

    def share(response: MeanLevel | PeakLevel) -> float:
        within = np.asarray(response(parts)) <= question.limit
        return float(within.all(axis=1).mean() if question.together else within.mean())

    uncertain = uncertain_index(study.index, study.runs.platform, study.runs.parts)
    again = [
        share(
            PeakLevel(drawn, study.band)
            if isinstance(study.response, PeakLevel)
            else MeanLevel(drawn)
        )
        for drawn in uncertain.draws(DRAWS, seed=study.seed)
    ]
    found = pivotal_interval(share(study.response), np.array(again), coverage=0.9)
    return replace(
        found, lower=np.clip(found.lower, 0.0, 1.0), upper=np.clip(found.upper, 0.0, 1.0)
    )


PERCENT = 100.0
N_PER_MM = 1e-3
NAN = float("nan")


def box_table(study: BoxStudy) -> pd.DataFrame:
    """One row per variable: its interval, in factors and N/mm, and what it is compared with."""
    box, plain, other = study.box, study.plain, study.bisection.box
    reference = study.reference_stiffness * N_PER_MM
    free = study.effective
    return pd.DataFrame(
        {
            "variable": list(study.variables),
            "requirement": np.where(free, "interval", "no requirement"),
            "Pareto point [1]": study.point,
            "from [1]": box.lower,
            "to [1]": box.upper,
            "half width [%]": PERCENT * 0.5 * box.width / box.centre,
            "from [N/mm]": np.where(free, box.lower * reference, NAN),
            "to [N/mm]": np.where(free, box.upper * reference, NAN),
            "set by the limit": _set_by_the_limit(study),
            "today [N/mm]": reference,
            "one tolerance from [1]": plain.lower,
            "one tolerance to [1]": plain.upper,
            "bisection from [1]": other.lower,
            "bisection to [1]": other.upper,
            "weight [1]": study.question.weight,
            "lower end: parts that keep the limit [%]": PERCENT * study.faces[0],
            "upper end: parts that keep the limit [%]": PERCENT * study.faces[1],
        }
    )


def compared_table(study: BoxStudy) -> pd.DataFrame:
    """One row per box: its share and its width."""
    rows = []
    for name, box, check in (
        ("largest box", study.box, study.found.verified),
        (
            f"±{PERCENT * study.tolerance:g} % about the Pareto point",
            study.plain,
            study.plain_share,
        ),
        ("bisection about the Pareto point", study.bisection.box, study.bisection_share),
    ):
        half = 0.5 * box.width[study.effective] / box.centre[study.effective]
        rows.append(
            {
                "box": name,
                "share that keeps the limit [%]": PERCENT * check.share,
                "at least, with confidence [%]": PERCENT * check.bound,
                "geometric mean half width [%]": PERCENT * _geometric_mean(half),
                "narrowest half width [%]": PERCENT * float(half.min()),
            }
        )
    return pd.DataFrame(rows)


def vehicle_table(study: BoxStudy) -> pd.DataFrame:
    """One row per vehicle: its limit, its level today and in the box, and how many parts miss."""
    today = study.response(study.space.nominal[np.newaxis])[0]
    levels = study.shown_excess + study.question.limit
    return pd.DataFrame(
        {
            "vehicle": list(study.vehicles),
            "limit [dB(A)]": study.question.limit,
            "today [dB(A)]": today,
            "Pareto point [dB(A)]": study.response(study.point[np.newaxis])[0],
            "in the box, mean [dB(A)]": levels.mean(axis=0),
            "95 % of the parts below [dB(A)]": np.quantile(levels, 0.95, axis=0),
            "parts that miss the limit [%]": PERCENT * study.missed,
        }
    )


def curve_table(study: BoxStudy) -> pd.DataFrame:
    """One row per limit: the largest box there, and what the box of one tolerance keeps."""
    rows = []
    for step, one in study.curve:
        question = study.question.lowered(step)
        row: dict[str, Any] = {
            "limit against the stated one [dB]": -step,
            "limit of the first vehicle [dB(A)]": question.limit[0],
        }
        if isinstance(one, UnreachableLimit):
            rows.append(row | {"box": "none", "binding vehicle": one.binding})
            continue
        half = 0.5 * one.box.width[study.effective] / one.box.centre[study.effective]
        missed = 1.0 - one.verified.by_response
        rows.append(
            row
            | {
                "box": "found",
                "geometric mean half width [%]": PERCENT * _geometric_mean(half),
                "share [%]": PERCENT * one.verified.share,
                "share at least [%]": PERCENT * one.verified.bound,
                "share of one tolerance [%]": PERCENT * study.verified(study.plain, question).share,
                "binding vehicle": study.vehicles[int(np.argmax(missed))],
                **{
                    f"{name} missed by [%]": PERCENT * value
                    for name, value in zip(study.vehicles, missed, strict=True)
                },
            }
        )
    return pd.DataFrame(rows)


def box_summary(study: BoxStudy) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    check = study.found.verified
    return {
        "share_stated": study.question.share,
        "share_verified": check.share,
        "share_bound": check.bound,
        "volume_ratio_pm15": study.over_plain.volume,
        "width_ratio_pm15": study.over_plain.width,
        "volume_ratio_bisection": _or_words(study.over_bisection.volume),
        "width_ratio_bisection": _or_words(study.over_bisection.width),
        "share_pm15": study.plain_share.share,
        "n_axes": study.over_plain.n_variables,
        "n_ends_on_bounds": study.ends_on_bounds,
        "limit_db_first_vehicle": float(study.question.limit[0]),
        "limit_could_be_lowered_db": study.found.room,
        "binding_vehicle": study.binding,
        "n_parts_verified": check.n_parts,
        "seconds": round(study.found.seconds, 3),
    }


def acceptance_box(study: BoxStudy) -> AcceptanceBox:
    """Return the box as the file that deliveries are held against."""
    platform, check = study.runs.platform, study.found.verified
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
        band=study.band,
        quantity=study.response.quantity,
        unit=study.response.response_unit,
        together=study.question.together,
        variables=tuple(
            BoxVariable(
                name=name,
                lower=float(study.box.lower[k]),
                upper=float(study.box.upper[k]),
                nominal=float(study.point[k]),
                reference_stiffness=float(reference[k]) if np.isfinite(reference[k]) else None,
                condition=study.condition,
                weight=float(study.question.weight[k]),
                required=bool(study.effective[k] and limited[k]),
            )
            for k, name in enumerate(study.variables)
        ),
        responses=tuple(
            BoxResponse(name, float(limit), float(share))
            for name, limit, share in zip(
                study.vehicles, study.question.limit, check.by_response, strict=True
            )
        ),
        share_stated=study.question.share,
        share_verified=check.share,
        share_bound=check.bound,
        confidence=check.confidence,
        n_parts=check.n_parts,
        law=study.question.law.name,
        seed=study.seed,
    )


def box_documents(study: BoxStudy) -> dict[str, dict[str, Any]]:
    """Return what other commands load: ``acceptance_box``."""
    return {"acceptance_box": box_document(acceptance_box(study))}


def _set_by_the_limit(study: BoxStudy) -> list[str]:
    """Name the ends that the limit sets; the others lie on the bounds that were searched."""
    words = []
    for on_bounds, effective in zip(study.on_bounds.T, study.effective, strict=True):
        ends = [end for end, bound in zip(("from", "to"), on_bounds, strict=True) if not bound]
        words.append(" and ".join(ends) if effective and ends else "neither")
    return words


def _or_words(ratio: float) -> float | str:
    """Return a ratio to a box, or words where bisection has found none."""
    return ratio if np.isfinite(ratio) else "no box by bisection"


def _geometric_mean(values: np.ndarray) -> float:
    with np.errstate(divide="ignore"):
        return float(np.exp(np.log(values).mean()))


def box_figures(study: BoxStudy) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    colours = vehicle_colours(study.runs.platform.fleet.names)
    quantity = study.response.quantity
    vehicles = vehicle_table(study)
    pictures = {
        "box": _intervals(study),
        "levels": figures.levels_in_box(
            study.vehicles,
            study.shown_excess + study.question.limit,
            study.question.limit,
            vehicles["today [dB(A)]"],
            PERCENT * study.missed,
            colours,
            level_label=f"{quantity} [dB(A)]",
        ),
    }
    if len(study.curve) > 1:
        pictures["trade_off"] = _trade_off(study, colours)
    return pictures


def _intervals(study: BoxStudy) -> bytes:
    question = study.question
    return figures.box_intervals(
        study.variables,
        Intervals("acceptance box", study.box.lower, study.box.upper),
        [
            Intervals(f"±{PERCENT * study.tolerance:g} %", study.plain.lower, study.plain.upper),
            Intervals(
                f"bisection, ±{PERCENT * study.bisection.tolerance:.3g} %",
                study.bisection.box.lower,
                study.bisection.box.upper,
            ),
        ],
        Intervals("bounds", question.lower, question.upper),
        study.point,
        study.reference_stiffness * N_PER_MM,
        [not one for one in study.effective],
        mount_colours([mount.name for mount in study.runs.platform.mounts]),
    )


def _trade_off(study: BoxStudy, colours: dict[str, str]) -> bytes:
    table = curve_table(study)
    table = table[table["box"] == "found"]
    common = bool(np.ptp(study.question.limit) == 0.0)
    column = "limit of the first vehicle [dB(A)]" if common else "limit against the stated one [dB]"
    asked = table[table["limit against the stated one [dB]"] == 0.0].iloc[0]
    width = "geometric mean half width [%]"
    lowest = -study.found.room + (float(study.question.limit[0]) if common else 0.0)
    unreachable = any(isinstance(one, UnreachableLimit) for _, one in study.curve)
    near = unreachable or table[column].min() - lowest < np.ptp(table[column])
    return figures.box_trade_off(
        table[column],
        table[width],
        table["share of one tolerance [%]"],
        {name: table[f"{name} missed by [%]"] for name in study.vehicles},
        colours,
        stated=(float(asked[column]), float(asked[width])),
        unreachable=lowest if near else None,
        limit_label="limit [dB(A)]" if common else "limit against the stated one [dB]",
        width_label="mean half width of the box [%]",
        plain_label=f"share that ±{PERCENT * study.tolerance:g} % keeps [%]",
    )


TERMS = (
    "booming noise",
    "SPL",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "Pareto front",
)
SHOWN = (
    "variable",
    "Pareto point [1]",
    "from [1]",
    "to [1]",
    "half width [%]",
    "from [N/mm]",
    "to [N/mm]",
    "lower end: parts that keep the limit [%]",
    "upper end: parts that keep the limit [%]",
)


def solution_box_result(study: BoxStudy, inputs: tuple[Path, ...] = ()) -> StudyResult:
    """Make tables, figures, headline numbers, page and box document.

    Parameters
    ----------
    study : BoxStudy
        Found and verified.
    inputs : tuple of Path
        Files read beside the platform's.

    Returns
    -------
    StudyResult
        Tables ``box``, ``boxes``, ``vehicles``, ``curve``; document ``acceptance_box``.
    """
    tables = {
        "box": box_table(study),
        "boxes": compared_table(study),
        "vehicles": vehicle_table(study),
        "curve": curve_table(study),
    }
    pictures = box_figures(study)
    check = study.found.verified
    certainty = share_measured_again(study)
    summary = box_summary(study) | {
        "share_measured_from": float(certainty.lower),
        "share_measured_to": float(certainty.upper),
    }
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures, certainty),
        inputs=(*study.runs.platform.input_files, *inputs),
        facts={
            "kernel": study.index.kernel.name,
            "law": study.question.law.name,
            "verification_parts": check.n_parts,
        },
        documents=box_documents(study),
    )


def _page(
    study: BoxStudy,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
    certainty: Interval,
) -> Page:
    question, found = study.question, study.found
    check = found.verified
    what = "parts" if question.together else "parts and vehicles"
    motion = motion_report(study.index, np.stack([study.space.nominal, study.point]))
    warnings = list(motion.warnings)
    if not found.confirmed:
        warnings.insert(
            0,
            f"The verification does not confirm the stated share: {_percent(check.bound, 2)} with "
            f"confidence against {_percent(question.share, 2)}.",
        )
    sections = [
        Section("The box", _box_text(study), (_picture(pictures, "box", _BOX),), (_box(tables),)),
        Section(
            "Levels inside the box",
            f"{check.n_parts} parts, {question.law.name}, that the search has not seen: "
            f"{_percent(check.share, 2)} of {what} keep the limit, at least "
            f"{_percent(check.bound, 2)} with {_percent(check.confidence, 0)} confidence (the "
            "vehicles of one part are not independent, so each part counts once). Most often "
            f"{study.binding} misses its limit: it binds. {_each(study)}\n\nThat is the share in "
            "the cars as they were measured. With every measurement drawn again with its errors "
            f"it lies between {_percent(float(certainty.lower), 0)} and "
            f"{_percent(float(certainty.upper), 0)}, with 90 % confidence: the level of a car is "
            "known to half a decibel only.",
            (
                _picture(
                    pictures, "levels", "Levels of the parts of the box; dark: above the limit."
                ),
            ),
            (Table(tables["vehicles"], f"Limits and levels: {study.response.quantity}."),),
        ),
        Section(
            "Against other boxes",
            f"Over the {study.over_plain.n_variables} directions that a vehicle depends on, the "
            f"intervals are {study.over_plain.width:.3g} times as wide (geometric mean) as those "
            f"of ±{PERCENT * study.tolerance:g} % about the Pareto point, "
            f"{study.over_plain.volume:.3g} times the volume. {_bisection(study)} "
            "With wider bounds the intervals that lie on them would be wider still.",
            tables=(_shares(tables["boxes"], "Shares are of the same independent parts."),),
        ),
    ]
    if "trade_off" in pictures:
        sections.append(
            Section(
                "What the limit costs",
                f"The limit could be lowered by {found.room:.2f} dB at most, where the box shrinks "
                "to a point. Each box of the curve is verified as the one above.",
                (_picture(pictures, "trade_off", _CURVE),),
                (_shares(_narrow(tables["curve"]), "Boxes over the limit."),),
            )
        )
    return Page(
        title="Acceptance box of the mounts",
        question=(
            "Within which stiffnesses may parts be delivered, each direction independent of all "
            f"others, so that {_percent(question.share, 1)} of {what} keep their limit?"
        ),
        headlines=(
            Headline(
                f"{study.over_plain.width:.2f} ×", f"as wide as ±{PERCENT * study.tolerance:g} %"
            ),
            Headline(_percent(check.share, 2), f"of {what} keep the limit"),
            Headline(study.binding, "binds"),
        ),
        sections=tuple(sections),
        terms=TERMS,
        warnings=tuple(warnings),
    )


_FINE = (
    "share that keeps the limit [%]",
    "at least, with confidence [%]",
    "share [%]",
    "share at least [%]",
    "limit of the first vehicle [dB(A)]",
)
_BOX = "Interval of every direction, with today's stiffness and its ends beside it."
_CURVE = (
    "Width of the box, what one tolerance keeps, and which vehicle's limit the parts of the box "
    "miss, over the limit."
)


def _box_text(study: BoxStudy) -> str:
    found, limit = study.found, study.question.limit
    low, high = study.band
    limits = (
        f"{limit[0]:.2f} dB(A) in every vehicle"
        if np.ptp(limit) == 0.0
        else f"{limit.min():.2f} to {limit.max():.2f} dB(A), by vehicle"
    )
    return (
        f"Limit: {limits}, {study.response.quantity}, {low:g} to {high:g} Hz. A part is accepted "
        "if every direction lies in its interval, whatever the others are. The largest box, by the "
        "sum of weight times logarithm of width, was found from "
        f"{len(found.start_log_volumes)} starts in {found.seconds:.1f} s; stiffness in N/mm is the "
        f"{study.condition}. {study.ends_on_bounds} of the {2 * study.over_plain.n_variables} ends "
        "lie on the bounds that were searched: there the limit asks for nothing.\n\n"
        "The last two columns say what the ends are worth: of parts exactly at that end, so many "
        "keep the limit. At the optimum all ends that are not bounds cost the same share per "
        "weight; an end well above the share lies on its bound."
    )


def _each(study: BoxStudy) -> str:
    if study.question.together:
        return ""
    worst = _percent(float(study.missed.max()), 1)
    return (
        f"The share is one over all vehicles: in {study.binding} alone {worst} of the parts miss. "
        "--worst-vehicle asks every part to keep the limit in all vehicles."
    )


def _bisection(study: BoxStudy) -> str:
    if not np.isfinite(study.over_bisection.width):
        return (
            "About the Pareto point itself the limit is not kept, so bisection finds no box there."
        )
    return (
        f"They are {study.over_bisection.width:.3g} times as wide as those of one tolerance that "
        "bisection finds about the Pareto point at the same limit and share."
    )


def _box(tables: Mapping[str, pd.DataFrame]) -> Table:
    wanted = tables["box"]["requirement"] == "interval"
    frame = tables["box"].loc[wanted, list(SHOWN)]
    return Table(
        frame,
        "Directions that a vehicle depends on; the others have no requirement.",
        {"from [N/mm]": 0, "to [N/mm]": 0},
    )


def _shares(frame: pd.DataFrame, caption: str) -> Table:
    return Table(frame, caption, {name: 2 for name in frame.columns if name in _FINE})


def _narrow(table: pd.DataFrame) -> pd.DataFrame:
    return table[[name for name in table.columns if not name.endswith("missed by [%]")]]


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


def _percent(value: float, decimals: int) -> str:
    return f"{PERCENT * value:.{decimals}f} %"
