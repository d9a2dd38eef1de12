"""A delivery against its acceptance box."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.scatter import Capability, capability, fewest_pieces, predicted_pieces
from deboom.explore.space import sobol_points
from deboom.files.acceptance import (
    AXES,
    AcceptanceBox,
    BoxVariable,
    DeliveredPart,
    read_delivered_parts,
    read_solution_box,
)
from deboom.files.disk import replace_bytes
from deboom.files.platform import Platform, read_platform
from deboom.files.tables import workbook_bytes
from deboom.plot.style import mount_of
from deboom.report import Report
from deboom.study.options import Quantity, limited_response
from deboom.study.platform_model import (
    Motion,
    MountSource,
    motion_index,
    operation,
    platform_sha256,
)
from deboom.study.progress import Progress
from deboom.study.runner import run_command
from deboom.tabled import Tabled

PROCESSES, CARS = 100, 256
"""Processes that a batch may come from, and cars of each, for the predicted levels."""
INTERVAL = (0.05, 0.95)
"""Of predicted shares [1]."""
CONFIDENCE = 0.95
"""Of the lower bounds of Cp and Cpk [1]."""


class Verdict(Enum):
    """What the measurement says of a part or a batch."""

    passed = "pass"
    failed = "fail"
    undecided = "undecided"


@dataclass(frozen=True)
class JudgedPart:
    """One part against the intervals of its mount.

    `factors`: axis → stiffness over the reference [1]; `axes`: limited axis → what its stiffness
    says; `reason`: which axis is outside, or too near to an end, empty where it passes.
    """

    part: DeliveredPart
    factors: Mapping[str, float]
    axes: Mapping[str, Verdict]
    reason: str

    @property
    def verdict(self) -> Verdict:
        """Failed with one axis, passed with all."""
        found = set(self.axes.values())
        for verdict in (Verdict.failed, Verdict.undecided):
            if verdict in found:
                return verdict
        return Verdict.passed


@dataclass(frozen=True)
class Share:
    """A share over what the process behind a batch may be: median and ends of `INTERVAL` [1]."""

    middle: float
    low: float
    high: float

    @classmethod
    def of(cls, shares: RealArray) -> Share:
        """Summarise the shares of all processes, shape (n_processes,)."""
        low, middle, high = np.quantile(shares, [INTERVAL[0], 0.5, INTERVAL[1]])
        return cls(float(middle), float(low), float(high))


@dataclass(frozen=True, eq=False)
class Cars:
    """Cars that get their mounts from a batch.

    `levels`: array, shape (n_processes, n_cars, n_vehicles), in the unit of the box; `within`:
    share of parts and vehicles within the limit, as the box counts them.
    """

    levels: RealArray
    within: Share


@dataclass(frozen=True, eq=False)
class Batch:
    """Parts of one mount from one batch.

    `capabilities`: limited axis → capability, empty for a single part; `pieces`: share of the
    batch's pieces, measured or not, inside of all intervals, None where too few were measured;
    `cars`: None without a platform as well; `share_stated`: asked of the pieces [1].
    """

    name: str
    mount: str
    parts: tuple[JudgedPart, ...]
    capabilities: Mapping[str, Capability]
    pieces: Share | None
    cars: Cars | None
    share_stated: float

    @property
    def counts(self) -> dict[Verdict, int]:
        """Parts by verdict."""
        return {verdict: sum(part.verdict is verdict for part in self.parts) for verdict in Verdict}

    @property
    def verdict(self) -> Verdict:
        """Failed with a part outside; passed if all pass and enough pieces beyond doubt will."""
        if self.counts[Verdict.failed]:
            return Verdict.failed
        proven = self.pieces is not None and self.pieces.low >= self.share_stated
        if proven and not self.counts[Verdict.undecided]:
            return Verdict.passed
        return Verdict.undecided

    @property
    def reason(self) -> str:
        """Why it is not passed, and what the cars are warned of; empty where all is well."""
        words = []
        if self.counts[Verdict.failed]:
            words.append(f"{self.counts[Verdict.failed]} of {len(self.parts)} parts are outside")
        elif self.counts[Verdict.undecided]:
            words.append(f"{self.counts[Verdict.undecided]} parts too near to an end to decide")
        elif self.verdict is Verdict.undecided:
            words.append("too few measured parts to speak for the others: measure more")
        if self.cars is not None and self.cars.within.high < self.share_stated:
            words.append("too few cars will keep the limit: the batch lies in a corner of the box")
        return "; ".join(words)


@dataclass(frozen=True, eq=False)
class Delivery(Tabled):
    """A delivery, judged.

    `batches`: by mount, in the order of the table; `uncertainty`: of a measured stiffness,
    relative, expanded to 95 % [1]; `predicted`: a platform was there to predict levels;
    `same_data`: that platform's files are those of the box.
    """

    box: AcceptanceBox
    batches: tuple[Batch, ...]
    uncertainty: float
    predicted: bool
    same_data: bool

    @property
    def table(self) -> pd.DataFrame:
        """One row per part with its verdict."""
        return _part_table(self)

    @property
    def parts(self) -> tuple[JudgedPart, ...]:
        """All parts."""
        return tuple(part for batch in self.batches for part in batch.parts)


def limited_axes(box: AcceptanceBox, *, over_today: bool = False) -> dict[str, tuple[str, ...]]:
    """Return the axes that a box limits, by mount; with `over_today`, parts are ratios to today's.

    Raises
    ------
    InputError
        A limited axis without a reference stiffness: parts cannot be held against it in N/m.
    """
    axes: dict[str, list[str]] = {}
    for variable in box.variables:
        mount, axis = mount_of(variable.name), variable.name.rpartition(" ")[2]
        axes.setdefault(mount, [])
        if not variable.required:
            continue
        if variable.reference_stiffness is None and not over_today:
            raise InputError(
                f"the box limits {variable.name}, whose stiffness nobody knows in N/mm: measure "
                "parts and today's part on one machine and give their ratio (--over-today)"
            )
        axes[mount].append(axis)
    return {mount: tuple(names) for mount, names in axes.items()}


def judged_delivery(
    box: AcceptanceBox,
    parts: Sequence[DeliveredPart],
    platform: Platform | None,
    uncertainty: float,
    seed: int,
    *,
    over_today: bool = False,
) -> Delivery:
    """Hold the parts of a delivery against a box, and predict the cars that they make.

    Parameters
    ----------
    box : AcceptanceBox
        Intervals and limits.
    parts : sequence of DeliveredPart
        Parts, measured at the condition of the box [N/m].
    platform : Platform or None
        Platform that the box was found for; None: no levels are predicted.
    uncertainty : float
        Uncertainty of a measured stiffness, relative, expanded to 95 % [1].
    seed : int
        Seed of the predicted cars, from 1.
    over_today : bool
        Stiffnesses are over those of today's part [1].

    Returns
    -------
    Delivery
        Verdict of each part and batch; ``table``, one row per part.

    Raises
    ------
    InputError
        An uncertainty outside 0 to 0.5; parts of a batch that do not scatter; a platform that is
        not that of the box.

    Notes
    -----
    A part passes where its stiffness, with the uncertainty to either side, lies in every interval
    of its mount; it fails where it lies outside with all of the uncertainty (ISO 14253-1). What was
    not measured of a batch follows from what was, see `predicted_pieces`. Cars of a batch have
    their mount from it and all other mounts anywhere in the box. The box promises its share for
    parts all over it: a batch in a corner may keep every interval and still make loud cars.

    Examples
    --------
    >>> import deboom
    >>> deboom.judged_delivery(box, parts, None, 0.02, seed=1).table  # doctest: +SKIP
    """
    if not 0.0 <= uncertainty < 0.5:
        raise InputError(f"--uncertainty {uncertainty:g}: give a share from 0 to below 0.5")
    judged = [_judged(box, part, uncertainty, over_today) for part in parts]
    levels = None if platform is None else _Levels(box, platform, seed)
    names = dict.fromkeys((one.part.mount, one.part.batch) for one in judged)
    batches = []
    for mount, batch in names:
        members = tuple(one for one in judged if (one.part.mount, one.part.batch) == (mount, batch))
        axes = limited_axes(box, over_today=over_today)[mount]
        batches.append(_batch(box, (batch, mount, axes), members, levels, seed))
    return Delivery(
        box,
        tuple(batches),
        uncertainty,
        predicted=levels is not None,
        same_data=levels is None or levels.same_data,
    )


def _judged(
    box: AcceptanceBox, part: DeliveredPart, uncertainty: float, over_today: bool
) -> JudgedPart:
    factors, verdicts, words = {}, {}, []
    for axis, stiffness in part.stiffness.items():
        variable = box.variable(f"{part.mount} {axis}")
        today = 1.0 if over_today else variable.reference_stiffness
        if not variable.required or today is None:
            continue
        factor = factors[axis] = stiffness / today
        low, high = factor * (1.0 - uncertainty), factor * (1.0 + uncertainty)
        verdicts[axis] = Verdict.passed
        if high < variable.lower or low > variable.upper:
            verdicts[axis] = Verdict.failed
        elif low < variable.lower or high > variable.upper:
            verdicts[axis] = Verdict.undecided
        if verdicts[axis] is not Verdict.passed:
            words.append(_where(variable, axis, factor, verdicts[axis], over_today))
    return JudgedPart(part, factors, verdicts, "; ".join(words))


def _where(
    variable: BoxVariable, axis: str, factor: float, verdict: Verdict, over_today: bool
) -> str:
    what = "outside" if verdict is Verdict.failed else "too near to an end"
    today = None if over_today else variable.reference_stiffness
    if today is None:
        numbers = f"{factor:.3f} of today's, asked {variable.lower:.3f} to {variable.upper:.3f}"
    else:
        found, low, high = (1e-3 * today * f for f in (factor, variable.lower, variable.upper))
        numbers = f"{found:.1f} N/mm, asked {low:.1f} to {high:.1f} N/mm"
    return f"{axis} {what}: {numbers}"


def _batch(
    box: AcceptanceBox,
    which: tuple[str, str, tuple[str, ...]],
    members: tuple[JudgedPart, ...],
    levels: _Levels | None,
    seed: int,
) -> Batch:
    name, mount, axes = which
    measured = np.array([[one.factors[axis] for axis in axes] for one in members])
    variables = [box.variable(f"{mount} {axis}") for axis in axes]
    found: dict[str, Capability] = {}
    if len(members) > 1:
        for axis, variable, values in zip(axes, variables, measured.T, strict=True):
            with _naming(f"{mount} {axis}, batch {name}"):
                found[axis] = capability(values, variable.lower, variable.upper, CONFIDENCE)
    pieces, cars = None, None
    if axes and len(members) >= fewest_pieces(len(axes)):
        with _naming(f"{mount}, batch {name}"):
            drawn = predicted_pieces(measured, PROCESSES, CARS, seed=seed)
        lower = np.array([variable.lower for variable in variables])
        upper = np.array([variable.upper for variable in variables])
        pieces = Share.of(((lower <= drawn) & (drawn <= upper)).all(axis=2).mean(axis=1))
        cars = None if levels is None else levels.cars(mount, axes, drawn)
    return Batch(name, mount, members, found, pieces, cars, box.share_stated)


@contextmanager
def _naming(what: str) -> Iterator[None]:
    """Say of which parts an error is."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{what}: {error}") from None


class _Levels:
    """The model behind a box; lives within one call."""

    def __init__(self, box: AcceptanceBox, platform: Platform, seed: int) -> None:
        self.box, self.seed = box, seed
        groups = {vehicle.group for vehicle in platform.fleet.vehicles}
        runs = operation(
            platform,
            [f"{name}={weight!r}" for name, weight in box.load_cases],
            MountSource(box.mounts),
            box.group if box.group in groups else None,
            box.band,
        )
        index = motion_index(runs, Motion(box.motion))
        wanted = [variable.name for variable in box.variables]
        vehicles = [response.name for response in box.responses]
        if list(index.variable_names) != wanted or list(index.response_names) != vehicles:
            raise InputError(
                f"platform {platform.name} has the variables {list(index.variable_names)} and the "
                f"vehicles {list(index.response_names)}, the box {wanted} and {vehicles}: give the "
                "platform that the box was found for"
            )
        by_name = {
            one.quantity: one
            for one in (limited_response(quantity, index, box.band) for quantity in Quantity)
        }
        if box.quantity not in by_name:
            raise InputError(f"the box limits '{box.quantity}', this deboom knows {list(by_name)}")
        self.response = by_name[box.quantity]
        self.same_data = platform_sha256(runs.platform) == box.platform_sha256

    def cars(self, mount: str, axes: tuple[str, ...], pieces: RealArray) -> Cars:
        """Build cars with drawn pieces of one mount, shape (n_processes, n_cars, n_axes)."""
        variables = self.box.variables
        names = [variable.name for variable in variables]
        lower, upper, nominal = np.array([(v.lower, v.upper, v.nominal) for v in variables]).T
        required = np.array([variable.required for variable in variables])
        # the other mounts are the same for every process, which tells processes apart sooner
        places = sobol_points(len(names), CARS, seed=self.seed, purpose="cars of a delivery")
        designs = np.tile(lower + places * (upper - lower), (len(pieces), 1))
        designs[:, ~required] = nominal[~required]
        for place, axis in enumerate(axes):
            designs[:, names.index(f"{mount} {axis}")] = pieces[..., place].ravel()
        levels = np.asarray(self.response(designs)).reshape(len(pieces), CARS, -1)
        within = levels <= np.array([response.limit for response in self.box.responses])
        kept = within.all(axis=2) if self.box.together else within.mean(axis=2)
        return Cars(levels, Share.of(kept.mean(axis=1)))


PERCENT, MILLI = 100.0, 1e-3
VERDICTS = ["batch", "parts", "passed", "failed", "undecided", "verdict", "reason"]
SHARES = [
    "batch",
    "pieces inside [%]",
    "at least [%]",
    "cars within the limit [%]",
    "from [%]",
    "to [%]",
]


def delivery_report(delivery: Delivery, inputs: Sequence[Path]) -> Report:
    """Report a judged delivery; `inputs` are the files that were read."""
    box, verdicts = delivery.box, [judged.verdict for judged in delivery.parts]
    passed = sum(batch.verdict is Verdict.passed for batch in delivery.batches)
    failed, open_ = verdicts.count(Verdict.failed), verdicts.count(Verdict.undecided)
    report = Report(
        "Acceptance of a delivery",
        f"Do these parts keep the acceptance box of {box.title.partition(':')[0]}?",
    )
    report.explain("stiffness factor", "dynamic stiffness", "tolerance", "SPL")
    report.tile(f"{passed} of {len(delivery.batches)}", "batches pass")
    report.tile(f"{failed}", f"of {len(verdicts)} parts fail")
    report.tile(f"{open_}", "parts undecided")
    if delivery.uncertainty == 0.0:
        report.warn(
            "The uncertainty of the measured stiffnesses was not stated (--uncertainty): parts "
            "near to an end of their interval are decided as if they were known exactly."
        )
    if not delivery.predicted:
        report.warn("No platform was given (--platform): the cars' levels are not predicted.")
    if not delivery.same_data:
        report.warn(
            "The platform's files are not those that the box was found with: the predicted levels "
            "belong to today's files."
        )
    report.summary |= {
        "n_parts": len(verdicts),
        "n_passed": verdicts.count(Verdict.passed),
        "n_failed": failed,
        "n_undecided": open_,
        "n_batches": len(delivery.batches),
        "n_batches_passed": passed,
        "n_batches_failed": sum(b.verdict is Verdict.failed for b in delivery.batches),
        "share_stated": box.share_stated,
    }
    bounds = [c.cpk_bound for batch in delivery.batches for c in batch.capabilities.values()]
    smallest = {
        "cpk_at_least_smallest": bounds,
        "pieces_inside_at_least_smallest": [b.pieces.low for b in delivery.batches if b.pieces],
        "cars_within_limit_smallest": [b.cars.within.middle for b in delivery.batches if b.cars],
    }
    report.summary |= {name: min(values) for name, values in smallest.items() if values}
    report.inputs += inputs

    low, high = (f"{PERCENT * end:g}" for end in INTERVAL)
    report.section(
        "Batches",
        "A batch passes if every measured part passes and at least "
        f"{PERCENT * box.share_stated:g} % of its pieces, measured or not, lie inside beyond "
        "doubt: few measured parts leave much open. Beside it stand the cars that get their "
        "mounts from the batch, all other mounts anywhere in the box, with the interval from "
        f"{low} to {high} %. The box promises its share for parts all over it: a batch in a "
        "corner may keep every interval and still make loud cars.",
    )
    batches = _batch_table(delivery)
    report.table("batches", batches, "One row per batch.", shown=batches[VERDICTS])
    report.table(None, batches[SHARES], "What the measured parts say of all.")

    conditions = dict.fromkeys(v.condition for v in box.variables if v.required)
    report.section(
        "Parts in their intervals",
        f"Stiffness over today's, {'; '.join(conditions)}. Measure deliveries there.",
    )
    report.figure(
        "parts",
        plot.parts_in_intervals(_rows(delivery)),
        "The bar is the interval.",
        alt="Parts in their intervals",
    )
    parts = _part_table(delivery)
    others = parts.loc[parts["verdict"] != Verdict.passed.value, ["part", "verdict", "reason"]]
    caption = "" if others.empty else "Parts that do not pass; parts.csv has all of them."
    report.table("parts", parts, caption, shown=others)

    report.section(
        "Capability",
        "Cp compares the width of the interval with the scatter, Cpk also sees a mean off its "
        "middle. The bounds hold with 95 % confidence for a normal process; Cpk from about 20 "
        "parts upwards.",
    )
    report.table("capability", _capability_table(delivery), "One row per batch and limited axis.")
    if any(batch.cars is not None for batch in delivery.batches):
        _levels(report, delivery)
    return report


def _levels(report: Report, delivery: Delivery) -> None:
    """Show the predicted levels of the cars of each batch against the limits."""
    box = delivery.box
    share = np.linspace(0.0, PERCENT, 101)
    panels, rows = [], []
    for batch in delivery.batches:
        if batch.cars is None:
            continue
        name, curves = f"{batch.mount} {batch.name}", {}
        for place, response in enumerate(box.responses):
            levels = batch.cars.levels[..., place]
            over = levels.ravel() - response.limit
            curves[response.name] = np.quantile(over, share / PERCENT)
            low, middle, high = np.quantile(levels, [0.05, 0.5, 0.95])
            rows.append(
                {
                    "batch": name,
                    "vehicle": response.name,
                    "limit [dB(A)]": response.limit,
                    "median [dB(A)]": middle,
                    "5 % of the cars below [dB(A)]": low,
                    "95 % of the cars below [dB(A)]": high,
                    "cars within the limit [%]": PERCENT * float(np.mean(levels <= response.limit)),
                }
            )
        panels.append(plot.CurvePanel(name, share, curves))
    report.section(
        "Predicted levels",
        f"{box.quantity.capitalize()} of the cars of each batch, with pieces that the "
        "measured ones lead one to expect; few pieces give a wide spread.",
    )
    report.figure(
        "levels",
        plot.curve_panels(
            panels,
            x_label="share of the cars [%]",
            y_label="level less limit [dB]",
            columns=min(3, len(panels)),
            share_y=True,
        ),
        "Cars in the order of their level; above zero they miss the limit.",
        alt="Levels of the predicted cars less the limit",
    )
    report.table("levels", pd.DataFrame(rows), "One row per batch and vehicle.")


def _part_table(delivery: Delivery) -> pd.DataFrame:
    """One row per part: stiffness, share of today's, verdict and reason."""
    axes = sorted({axis for judged in delivery.parts for axis in judged.factors})
    rows = []
    for judged in delivery.parts:
        part, factors = judged.part, {axis: judged.factors.get(axis, np.nan) for axis in axes}
        row: dict[str, object] = {"part": part.name, "batch": part.batch, "mount": part.mount}
        for axis, factor in factors.items():
            today = delivery.box.variable(f"{part.mount} {axis}").reference_stiffness
            row[f"{axis} [N/mm]"] = MILLI * (np.nan if today is None else today) * factor
        row |= {f"{axis} over today's [1]": factor for axis, factor in factors.items()}
        rows.append(row | {"verdict": judged.verdict.value, "reason": judged.reason})
    return pd.DataFrame(rows)


def _batch_table(delivery: Delivery) -> pd.DataFrame:
    """One row per batch: parts by verdict, cars within the limit, verdict and reason."""
    rows = []
    for batch in delivery.batches:
        counts, pieces = batch.counts, batch.pieces
        cars = batch.cars.within if batch.cars else None
        rows.append(
            {
                "batch": f"{batch.mount} {batch.name}",
                "parts": len(batch.parts),
                "passed": counts[Verdict.passed],
                "failed": counts[Verdict.failed],
                "undecided": counts[Verdict.undecided],
                "verdict": batch.verdict.value,
                "pieces inside [%]": PERCENT * pieces.middle if pieces else np.nan,
                "at least [%]": PERCENT * pieces.low if pieces else np.nan,
                "cars within the limit [%]": PERCENT * cars.middle if cars else np.nan,
                "from [%]": PERCENT * cars.low if cars else np.nan,
                "to [%]": PERCENT * cars.high if cars else np.nan,
                "reason": batch.reason,
            }
        )
    return pd.DataFrame(rows)


def _capability_table(delivery: Delivery) -> pd.DataFrame:
    """One row per batch and limited axis: mean, scatter, Cp and Cpk with their lower bounds."""
    rows: list[dict[str, object]] = []
    for batch in delivery.batches:
        for axis, found in batch.capabilities.items():
            variable = delivery.box.variable(f"{batch.mount} {axis}")
            rows.append(
                {
                    "batch": f"{batch.mount} {batch.name}",
                    "axis": axis,
                    "parts": found.n,
                    "from [1]": variable.lower,
                    "to [1]": variable.upper,
                    "mean [1]": found.mean,
                    "sigma [%]": PERCENT * found.sigma / found.mean,
                    "Cp [1]": found.cp,
                    "Cp at least [1]": found.cp_bound,
                    "Cpk [1]": found.cpk,
                    "Cpk at least [1]": found.cpk_bound,
                    "outside, normal law [%]": PERCENT * found.expected_outside,
                }
            )
    return pd.DataFrame(rows, columns=None if rows else ["batch", "axis"])


def _rows(delivery: Delivery) -> list[plot.PartsRow]:
    rows = []
    for batch in delivery.batches:
        axes = dict.fromkeys(axis for one in batch.parts for axis in one.factors)
        for axis in axes:
            variable = delivery.box.variable(f"{batch.mount} {axis}")
            rows.append(
                plot.PartsRow(
                    f"{batch.mount} {axis}, {batch.name}",
                    (variable.lower, variable.upper),
                    {
                        verdict.value: np.array(
                            [one.factors[axis] for one in batch.parts if one.axes[axis] is verdict]
                        )
                        for verdict in Verdict
                    },
                )
            )
    return rows


COMMAND = "accept"
BOX_FILE = "acceptance_box.json"


def box_file(path: Path) -> Path:
    """Return the file of a box: the path itself, or the box of a run folder.

    Raises
    ------
    InputError
        A folder without one.
    """
    if not path.is_dir():
        return path
    if not (path / BOX_FILE).is_file():
        raise InputError(
            f"{path} holds no {BOX_FILE}: give a run folder of the study solution_box, or the file"
        )
    return path / BOX_FILE


def write_parts_template(box_path: Path, path: Path, *, over_today: bool = False) -> None:
    """Write an empty table of parts for a box, one line per mount, to a new ``.xlsx`` file.

    Raises
    ------
    InputError
        The file is there, or is no ``.xlsx``.
    """
    box = read_solution_box(box_file(box_path))
    if path.suffix != ".xlsx" or path.exists():
        raise InputError(f"{path}: a template is a new .xlsx file, give another name")
    axes = limited_axes(box, over_today=over_today)
    unit = "1" if over_today else "N/mm"
    rows = [
        {"part": "", "batch": "", "mount": mount, **{f"{axis} [{unit}]": "" for axis in AXES}}
        for mount, names in axes.items()
        if names
    ]
    replace_bytes(
        path,
        workbook_bytes(
            {"parts": pd.DataFrame(rows), "measure": _measure(box)},
            "Parts of a delivery: one row per part",
        ),
    )


def accept_into_run(
    box_path: Path,
    parts_path: Path,
    out: Path,
    platform: Path | None,
    uncertainty: float,
    seed: int,
    progress: Progress,
    *,
    over_today: bool = False,
) -> Path:
    """Judge a delivery and write a run folder, which is returned.

    Parameters
    ----------
    box_path : Path
        Box, or run folder of the study ``solution_box``.
    parts_path : Path
        Table of parts.
    out : Path
        Folder that gets ``accept/<run>/``.
    platform : Path or None
        Folder of the platform that the box was found for.
    uncertainty, seed, over_today
        As for `judged_delivery`.
    progress : callable

    Raises
    ------
    InputError
        A box, a table or a platform that cannot be read or do not fit together; nothing is left
        behind.
    """
    begin = time.perf_counter()
    progress(0, 3, "reading")
    path = box_file(box_path)
    box = read_solution_box(path)
    axes = limited_axes(box, over_today=over_today)
    parts = read_delivered_parts(parts_path, axes, over_today=over_today)
    data = read_platform(platform) if platform is not None else None
    record: dict[str, Any] = {
        "study": COMMAND,
        "command": f"deboom accept {path.as_posix()} {parts_path.as_posix()}",
        "question": "Do these parts keep the acceptance box?",
        "seed": seed,
        "arguments": {
            "platform": platform.as_posix() if platform is not None else None,
            "uncertainty": uncertainty,
            "over-today": over_today,
            "seed": seed,
        },
    }

    def work() -> Report:
        progress(1, 3, "parts and cars")
        delivery = judged_delivery(box, parts, data, uncertainty, seed, over_today=over_today)
        progress(2, 3, "tables and figures")
        files = data.input_files if data is not None else ()
        return delivery_report(delivery, (path, parts_path, *files))

    run = run_command(out, record, work, relative_to=None, begin=begin)
    progress(3, 3, "done")
    return run


def _measure(box: AcceptanceBox) -> pd.DataFrame:
    """Say what to measure, and the interval of each direction."""
    return pd.DataFrame(
        [
            {
                "direction": variable.name,
                "from [N/mm]": _rounded(variable.lower_stiffness),
                "to [N/mm]": _rounded(variable.upper_stiffness),
                "from, over today's [1]": round(variable.lower, 4),
                "to, over today's [1]": round(variable.upper, 4),
                "condition": variable.condition,
            }
            for variable in box.variables
            if variable.required
        ]
    )


def _rounded(stiffness: float | None) -> float:
    """Return a stiffness in N/mm with one decimal; nan where it is not known."""
    return math.nan if stiffness is None else round(1e-3 * stiffness, 1)
