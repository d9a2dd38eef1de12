"""The specification sheet of a front's design."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm

from deboom.errors import InputError
from deboom.files.acceptance import AcceptanceBox, BoxVariable, read_solution_box
from deboom.files.run_folder import RunEntry, check_files, hash_files, read_run
from deboom.study.accept import box_file
from deboom.study.made_parts import MadeParts
from deboom.study.platform_model import Factor, factor_name, motion_name, platform_sha256
from deboom.study.robust_front import N_PER_MM
from deboom.study.supplier_numbers import (
    FREQUENCY,
    MICRO,
    STATIC_FORCE,
    WHEEL_TORQUE,
    StiffnessCurve,
    SupplierCertainty,
    loudest_line,
    preload_factor,
)
from deboom.study.supplier_study import Direction, Need, ShownNames, SupplierStudy

BOX_TABLE, SET_BY_LIMIT = "box.csv", "set by the limit"
MEASURED_AGAIN = ("share_measured_from", "share_measured_to")
ALLOCATION, MARGINAL, VERIFICATION = "allocation.csv", "marginal_values.csv", "verification.csv"
PART_NUMBERS = "part_numbers.csv"


@dataclass(frozen=True)
class SpecificationFiles:
    """Where the pieces of a sheet are; each may be missing.

    Parameters
    ----------
    box : Path or None
        Acceptance box, or the run of ``solution_box`` that found it.
    tolerances : Path or None
        Run of ``tolerance_allocation`` for this front.
    sharing : Path or None
        Run of ``commonality`` for this platform.
    """

    box: Path | None = None
    tolerances: Path | None = None
    sharing: Path | None = None


@dataclass(frozen=True, eq=False)
class BoxSource:
    """An acceptance box.

    Parameters
    ----------
    box : AcceptanceBox
    sha256 : str
        Of its file, in hexadecimal.
    set_by_limit : mapping of str to str
        Variable → ``from``, ``to``, both or ``neither``; empty where only the box is known.
    measured_again : (float, float) or None
        Share within the limit if all measurements were made again, 90 % interval; None where only
        the box is known [1].
    """

    box: AcceptanceBox
    sha256: str
    set_by_limit: Mapping[str, str]
    measured_again: tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class ToleranceSource:
    """Allocated tolerances.

    Parameters
    ----------
    run : RunEntry
    directions : DataFrame
        Indexed by variable: the tables ``allocation`` and ``marginal_values`` side by side.
    summary : mapping of str
        Headline numbers of the run.
    """

    run: RunEntry
    directions: pd.DataFrame
    summary: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class SharingSource:
    """Part numbers that vehicles share.

    Parameters
    ----------
    run : RunEntry
    part_numbers : DataFrame
        Table ``part_numbers`` of the run.
    summary : mapping of str
        Headline numbers of the run.
    """

    run: RunEntry
    part_numbers: pd.DataFrame
    summary: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class SpecificationSources:
    """The pieces that were given."""

    box: BoxSource | None
    tolerances: ToleranceSource | None
    sharing: SharingSource | None


def specification_sources(study: SupplierStudy, files: SpecificationFiles) -> SpecificationSources:
    """Read the pieces of a sheet and refuse those that belong to something else.

    Parameters
    ----------
    study : SupplierStudy
        The front.
    files : SpecificationFiles

    Returns
    -------
    SpecificationSources

    Raises
    ------
    InputError
        A file that cannot be read, an edited run, a run of another study; a box of other
        vehicles, directions, data or of another kind of stiffness factor; tolerances of another
        front or design; shared parts of other data.
    """
    return SpecificationSources(
        None if files.box is None else _box(study, files.box),
        None if files.tolerances is None else _tolerances(study, files.tolerances),
        None if files.sharing is None else _sharing(study, files.sharing),
    )


def _box(study: SupplierStudy, path: Path) -> BoxSource:
    file = box_file(path)
    box = read_solution_box(file)
    again = f"run solution_box --front {study.run.entry.folder.as_posix()}"
    for what, mine, theirs in (
        ("directions", [one.name for one in study.directions], [v.name for v in box.variables]),
        ("vehicles", list(study.vehicles), [response.name for response in box.responses]),
    ):
        if mine != theirs:
            raise InputError(
                f"--box {path}: its {what} are {', '.join(theirs)}, those of run "
                f"{study.run.entry.folder} {', '.join(mine)}: {again}"
            )
    if factor_name(study.index) == Factor.part.value:
        raise InputError(
            f"--box {path}: a box has intervals of the dynamic stiffness, run "
            f"{study.run.entry.folder} has factors of the part: search the front with --factor "
            "dynamic"
        )
    if box.platform_sha256 != platform_sha256(study.platform):
        raise InputError(f"--box {path}: it was found with other files of the platform: {again}")
    set_by_limit: dict[str, str] = {}
    measured_again = None
    if path.is_dir():
        entry = read_run(path)
        check_files(entry)
        table = pd.read_csv(entry.folder / BOX_TABLE)
        summary = _summary(entry)
        if SET_BY_LIMIT not in table or not set(MEASURED_AGAIN) <= set(summary):
            raise InputError(f"--box {path}: an older deboom wrote it: {again}")
        set_by_limit = dict(zip(table["variable"], table[SET_BY_LIMIT], strict=True))
        measured_again = (summary[MEASURED_AGAIN[0]], summary[MEASURED_AGAIN[1]])
    sha256 = hash_files([file], relative_to=file.parent)[file.name]
    return BoxSource(box, sha256, set_by_limit, measured_again)


def _tolerances(study: SupplierStudy, path: Path) -> ToleranceSource:
    entry = _run("--tolerances", path, ALLOCATION, "tolerance_allocation")
    front, arguments = study.run.entry, entry.record["arguments"]
    record = hash_files([front.folder / "run.json"], relative_to=front.folder)["run.json"]
    known = record in entry.record["inputs_sha256"].values()
    if not known or arguments["pick"] != study.pick.value or arguments["point"] is not None:
        raise InputError(
            f"--tolerances {path}: its tolerances belong to another design: run "
            f"tolerance_allocation --from-run {front.folder.as_posix()} --pick {study.pick.value}"
        )
    tables = [
        pd.read_csv(entry.folder / name, keep_default_na=False).set_index("variable")
        for name in (ALLOCATION, MARGINAL)
    ]
    return ToleranceSource(entry, pd.concat(tables, axis=1), _summary(entry))


def _sharing(study: SupplierStudy, path: Path) -> SharingSource:
    entry = _run("--sharing", path, PART_NUMBERS, "commonality")
    files = study.platform.input_files
    mine = hash_files(files, relative_to=study.platform.folder).values()
    if not set(mine) <= set(entry.record["inputs_sha256"].values()):
        raise InputError(
            f"--sharing {path}: it was found with other files of the platform: run commonality "
            f"--platform {study.platform.folder.as_posix()}"
        )
    table = pd.read_csv(entry.folder / PART_NUMBERS, dtype={"vehicles": str})
    unknown = set(table["direction"]) ^ {one.name for one in study.directions}
    if unknown:
        raise InputError(
            f"--sharing {path}: its directions are not those of run {study.run.entry.folder} "
            f"({sorted(unknown)[0]}): run commonality for the same platform"
        )
    return SharingSource(entry, table, _summary(entry))


def _run(option: str, path: Path, file: str, study: str) -> RunEntry:
    entry = read_run(path)
    check_files(entry)
    if file not in entry.record["files_sha256"]:
        raise InputError(f"{option} {path} has no {file}: give a run folder of the study {study}")
    return entry


def _summary(entry: RunEntry) -> Mapping[str, Any]:
    found: dict[str, Any] = json.loads((entry.folder / "summary.json").read_text(encoding="utf-8"))
    return found


SAMPLE = 20
"""Measured parts for which the asked capability is stated."""
CONFIDENCE = 0.95
"""Of the bound of that capability [1]."""
NAN = float("nan")


@dataclass(frozen=True)
class MachineSetting:
    """One state of a direction in the load case: what a dynamic test machine is set to.

    Parameters
    ----------
    preload_label : str
        ``static force [N]`` or ``wheel torque [N m]``; empty where there is none.
    preload : float
        [unit of the label]; nan without one.
    frequency, amplitude : float
        [Hz, m peak].
    stiffness : float
        Today's, magnitude [N/mm]; nan where the direction is not identified.
    loss_factor : float
        Today's [1]; likewise.
    """

    preload_label: str
    preload: float
    frequency: float
    amplitude: float
    stiffness: float
    loss_factor: float


@dataclass(frozen=True, eq=False)
class SpecifiedDirection:
    """What is asked of one direction.

    Parameters
    ----------
    direction : Direction
    box : BoxVariable or None
        Interval of its stiffness factor; None without a box.
    set_by_limit : str
        Which ends the limit sets: ``from``, ``to``, both, ``neither``; empty: not known.
    best : float
        Factor of the design of the front; nan where nothing is asked [1].
    tolerance : float
        Wanted half width of the scatter about it, three standard deviations [1].
    today : float
        Mean magnitude of today's stiffness that factors are of [N/mm]; nan: not identified, or
        not measured.
    half_width : float
        Of its 90 % interval, relative [1].
    setting : MachineSetting or None
        None where the load case has no state.
    capability : float
        Cpk that is asked of the process; nan without a box [1].
    """

    direction: Direction
    box: BoxVariable | None
    set_by_limit: str
    best: float
    tolerance: float
    today: float
    half_width: float
    setting: MachineSetting | None
    capability: float

    @property
    def limited(self) -> bool:
        """Whether the box has an interval for it that means something."""
        return self.box is not None and self.box.required

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of its interval, factors; nan without one [1]."""
        if self.box is None or not self.box.required:
            return NAN, NAN
        return self.box.lower, self.box.upper

    @property
    def scatter_fits(self) -> bool | None:
        """Whether the wanted value with its tolerance lies inside; None: nothing to compare."""
        low, high = self.ends
        if not np.isfinite([low, self.best, self.tolerance]).all():
            return None
        return low <= self.best * (1.0 - self.tolerance) and (
            self.best * (1.0 + self.tolerance) <= high
        )


@dataclass(frozen=True, eq=False)
class SpecificationSheet:
    """All numbers of the sheet.

    Parameters
    ----------
    study : SupplierStudy
    sources : SpecificationSources
    directions : tuple of SpecifiedDirection
        That are shown.
    names : ShownNames
        Of the vehicles.
    """

    study: SupplierStudy
    sources: SpecificationSources
    directions: tuple[SpecifiedDirection, ...]
    names: ShownNames

    @property
    def mounts(self) -> tuple[str, ...]:
        """Names of the mounts that are shown."""
        return tuple(dict.fromkeys(one.direction.mount.name for one in self.directions))


def specification_sheet(
    study: SupplierStudy,
    sources: SpecificationSources,
    directions: Sequence[Direction],
    curves: Sequence[StiffnessCurve],
    sure: SupplierCertainty,
    names: ShownNames,
) -> SpecificationSheet:
    """Put the pieces of a sheet together.

    Parameters
    ----------
    study : SupplierStudy
    sources : SpecificationSources
        Of this study.
    directions : sequence of Direction
        That are shown.
    curves : sequence of StiffnessCurve
        Of these.
    sure : SupplierCertainty
        Of the study.
    names : ShownNames
        Of the vehicles.
    """
    by_name = {curve.direction.name: curve for curve in curves}
    frequency = loudest_line(study)
    found = tuple(
        _specified(study, sources, one, by_name.get(one.name), frequency, sure)
        for one in directions
    )
    return SpecificationSheet(study, sources, found, names)


def asked_capability(share: float, n_axes: int) -> float:
    """Return the Cpk per axis with which a share of the pieces lies inside in all axes [1].

    Parameters
    ----------
    share : float
        Between 0 and 1 [1].
    n_axes : int
        Limited axes of a part.

    Notes
    -----
    ``2Φ(3 Cpk) − 1 ≥ share^(1/n)``: of a normal process with this Cpk at least so much lies inside,
    and independent axes are the worst case of correlated ones (Šidák, J. Am. Stat.
    Assoc. 62 (1967) 626).
    """
    return float(norm.ppf(0.5 * (1.0 + share ** (1.0 / n_axes))) / 3.0)


def measured_capability(asked: float, n_parts: int, confidence: float) -> float:
    """Return the Cpk that a sample must show so that its lower bound is the asked one [1].

    Parameters
    ----------
    asked : float
        [1].
    n_parts : int
        Measured, more than 2.
    confidence : float
        Of the one-sided bound [1].

    Notes
    -----
    The bound of `deboom.explore.scatter.capability`, solved for the sample's value.
    """
    z = float(norm.ppf(confidence))
    a = 1.0 - z**2 / (2.0 * (n_parts - 1))
    c = asked**2 - z**2 / (9.0 * n_parts)
    return float((asked + np.sqrt(asked**2 - a * c)) / a)


def _specified(
    study: SupplierStudy,
    sources: SpecificationSources,
    direction: Direction,
    curve: StiffnessCurve | None,
    frequency: float,
    sure: SupplierCertainty,
) -> SpecifiedDirection:
    column, known = direction.column, direction.need is not Need.unknown
    asked = direction.need in (Need.wanted, Need.anything)
    place = study.directions.index(direction)
    today = float(sure.stiffness.value[place]) * N_PER_MM
    half_width = float(sure.stiffness.half_width[place] / sure.stiffness.value[place])
    tolerance = float(study.space.tolerance[column])
    if sources.tolerances is not None:
        allocated = sources.tolerances.directions["cheapest ± [%]"]
        tolerance = float(allocated.get(direction.name, 100.0 * tolerance)) / 100.0
    variable, ends, capability = None, "", NAN
    if sources.box is not None:
        box = sources.box.box
        variable = box.variable(direction.name)
        ends = sources.box.set_by_limit.get(direction.name, "")
        if variable.reference_stiffness is not None:
            today = variable.reference_stiffness * N_PER_MM
        own = [v for v in study.of(direction.mount.name) if box.variable(v.name).required]
        if variable.required:
            capability = asked_capability(box.share_stated, len(own))
    return SpecifiedDirection(
        direction,
        variable,
        ends,
        best=float(study.wanted[column]) if asked else NAN,
        tolerance=tolerance if asked else NAN,
        today=today if known else NAN,
        half_width=half_width,
        setting=_setting(study, curve, frequency) if curve else None,
        capability=capability,
    )


def _setting(
    study: SupplierStudy, curve: StiffnessCurve, frequency: float
) -> MachineSetting | None:
    """Return the state nearest to a frequency in the first load case."""
    if curve.n_first == 0:
        return None
    line = int(np.argmin(np.abs(curve.frequency[: curve.n_first] - frequency)))
    has_preload = curve.label != FREQUENCY
    loss, known = float(curve.loss_factor[line]), curve.direction.need is not Need.unknown
    return MachineSetting(
        preload_label=curve.label if has_preload else "",
        preload=preload_factor(study, curve) * float(curve.preload[line]) if has_preload else NAN,
        frequency=float(curve.frequency[line]),
        amplitude=float(curve.amplitude[line]),
        stiffness=float(curve.stiffness[line]) if known else NAN,
        loss_factor=loss if known and loss > 0.0 else NAN,
    )


def shared_vehicles(names: ShownNames, vehicles: str) -> str:
    """Return the shown names of vehicles in a list; those that have none are counted.

    Parameters
    ----------
    names : ShownNames
    vehicles : str
        Own names, with commas.
    """
    own = [name.strip() for name in vehicles.split(",")]
    known: Mapping[str, str] = names.vehicles
    if not names.anonymous:
        return ", ".join(known.get(name, name) for name in own)
    shown = [known[name] for name in own if name in known]
    others = len(own) - len(shown)
    counted = [f"{others} other{'s' if others > 1 else ''}"] if others else []
    return ", ".join([*shown, *counted])


PERCENT = 100.0
SHORT_HASH = 16
"""Characters of a box's hash that a sheet shows."""
DIRECTIONS = "specification"
PROMISE = "specification, promise"
PARTS = "specification, parts"
MISSING = "specification, missing"
FACTOR = "stiffness factor [1]"
NO_BOX = "no box given"
RATIO_ONLY = "of today's part only"
WHICH_ENDS = {
    "from": "from",
    "to": "to",
    "from and to": "from and to",
    "neither": "none",
    "": "not known",
}


def specification_tables(sheet: SpecificationSheet) -> dict[str, pd.DataFrame]:
    """Return all tables of a sheet, by the name of their sheet in the workbook."""
    return {
        DIRECTIONS: direction_table(sheet),
        PROMISE: promise_table(sheet),
        PARTS: part_table(sheet),
        MISSING: missing_table(sheet),
    }


def direction_table(sheet: SpecificationSheet) -> pd.DataFrame:
    """One row per direction: interval, wanted value, test condition, scatter and its worth."""
    case, _ = sheet.study.load_cases[0]
    rows = []
    for one in sheet.directions:
        low, high = one.ends
        setting, asked = one.setting, one.capability
        there = setting.stiffness if setting else NAN
        preload = {setting.preload_label: setting.preload} if setting else {}
        sample = measured_capability(asked, SAMPLE, CONFIDENCE) if np.isfinite(asked) else NAN
        rows.append(
            {
                "direction": one.direction.name,
                "requirement": _requirement(one),
                "accepted from [N/mm]": low * one.today,
                "accepted to [N/mm]": high * one.today,
                "from, of today's [%]": PERCENT * low,
                "to, of today's [%]": PERCENT * high,
                "set by the limit": WHICH_ENDS[one.set_by_limit] if one.limited else "–",
                "best value [N/mm]": one.best * one.today,
                "best value, of today's [%]": PERCENT * one.best,
                "tolerance wanted ± [%]": PERCENT * one.tolerance,
                "best value with tolerance inside": _yes(one.scatter_fits),
                "today [N/mm]": one.today,
                "today ± 90 % [%]": PERCENT * one.half_width,
                "load case": case.name if setting else "–",
                STATIC_FORCE: preload.get(STATIC_FORCE, NAN),
                WHEEL_TORQUE: preload.get(WHEEL_TORQUE, NAN),
                "frequency [Hz]": setting.frequency if setting else NAN,
                "amplitude, peak [µm]": MICRO * setting.amplitude if setting else NAN,
                "there, today [N/mm]": there,
                "there, from [N/mm]": low * there,
                "there, to [N/mm]": high * there,
                "there, loss factor [1]": setting.loss_factor if setting else NAN,
                "Cpk of the process at least [1]": asked,
                f"Cpk of {SAMPLE} parts at least [1]": sample,
                **_worth(sheet, one),
            }
        )
    return pd.DataFrame(rows)


def promise_table(sheet: SpecificationSheet) -> pd.DataFrame:
    """Limits, shares, and which files the sheet follows from: item and value."""
    study, sources = sheet.study, sheet.sources
    items: dict[str, str] = {}
    if sources.box is not None:
        box = sources.box.box
        what = "parts" if box.together else "parts and vehicles"
        low, high = box.band
        items["what is limited"] = f"{box.quantity}, {low:g} to {high:g} Hz, in {box.unit}"
        for response in box.responses:
            items[f"limit of {sheet.names(response.name)}"] = (
                f"{response.limit:.2f} {box.unit}, kept by {_percent(response.share)} of the parts"
            )
        items["share stated"] = f"{_percent(box.share_stated)} of {what}"
        items["share verified"] = (
            f"{_percent(box.share_verified)}, at least {_percent(box.share_bound)} with "
            f"{PERCENT * box.confidence:g} % confidence, {box.n_parts} independent parts, {box.law}"
        )
        again = sources.box.measured_again
        if again is not None:
            items["the same, with all measurements made again"] = (
                f"{_percent(again[0])} to {_percent(again[1])} (90 % interval)"
            )
        cases = ", ".join(f"{name}, weight {weight:g}" for name, weight in box.load_cases)
        items["load cases"] = cases
        items["stiffness"] = box.variables[0].condition
        items["acceptance box, SHA-256"] = sources.box.sha256[:SHORT_HASH]
    if sources.tolerances is not None:
        items |= _tolerance_items(sheet)
    if sources.sharing is not None:
        found = sources.sharing.summary
        items["part numbers of all vehicles"] = (
            f"{found['part_numbers_min']} instead of {found['part_numbers_own']}; sharing costs "
            f"{found['price_db']:.2f} dB in the mean, {found['price_worst_db']:.2f} dB at most"
        )
    items["scatter of parts"] = MadeParts(study.space, study.model.structure).text
    items["a factor"] = f"{factor_name(study.index)}, motion {motion_name(study.index)}"
    items["run of the front"] = f"{study.run.entry.name}, {study.pick.value.replace('-', ' ')}"
    return pd.DataFrame({"item": list(items), "value": list(items.values())})


def part_table(sheet: SpecificationSheet) -> pd.DataFrame:
    """One row per part number: pieces, vehicles, and its stiffness inside the intervals or not.

    Without a run of commonality each mount is one part number in all vehicles of the front. A part
    number of none of these vehicles is held against nothing.
    """
    sharing, rows = sheet.sources.sharing, []
    for mount in sheet.mounts:
        own = {d.direction.name: d for d in sheet.directions if d.direction.mount.name == mount}
        pieces = len(next(iter(own.values())).direction.mount.pieces)
        if sharing is None:
            vehicles = ", ".join(map(sheet.names, sheet.study.vehicles))
            rows.append({"part number": mount, "pieces in a vehicle": pieces, "vehicles": vehicles})
            continue
        table = sharing.part_numbers
        for number, lines in table[table["direction"].isin(own)].groupby("part number", sort=False):
            shared = {
                own[name]: float(factor)
                for name, factor in zip(lines["direction"], lines[FACTOR], strict=True)
            }
            vehicles = str(lines["vehicles"].iloc[0])
            rows.append(
                {
                    "part number": number,
                    "pieces in a vehicle": pieces,
                    "vehicles": shared_vehicles(sheet.names, vehicles),
                    **{
                        f"{one.direction.axis} [N/mm]": factor * one.today
                        for one, factor in shared.items()
                    },
                    **{
                        f"{one.direction.axis}, of today's [%]": PERCENT * factor
                        for one, factor in shared.items()
                    },
                    "inside the intervals": _inside(sheet, shared, vehicles),
                }
            )
    return pd.DataFrame(rows)


def _inside(
    sheet: SpecificationSheet, shared: Mapping[SpecifiedDirection, float], vehicles: str
) -> str:
    """Say which axes of a part number lie outside; a dash where nothing can be compared."""
    served = {name.strip() for name in vehicles.split(",")} & set(sheet.study.vehicles)
    limited = {one: f for one, f in shared.items() if one.limited and np.isfinite(f)}
    if not served or not limited:
        return "–"
    outside = [one.direction.axis for one, f in limited.items() if not _within(one.ends, f)]
    return f"no: {', '.join(outside)}" if outside else "yes"


def _within(ends: tuple[float, float], factor: float) -> bool:
    return ends[0] <= factor <= ends[1]


def missing_table(sheet: SpecificationSheet) -> pd.DataFrame:
    """One row per piece that is not there: what it would say, and the command that gives it."""
    sources, pick = sheet.sources, sheet.study.pick.value
    rows = []
    if sources.box is None:
        rows.append(
            (
                "acceptance intervals, shares, limits, Cpk",
                f"deboom run studies/solution_box.py --front RUN --pick {pick}",
                "--box",
            )
        )
    if sources.tolerances is None:
        rows.append(
            (
                "tolerances by what they are worth (here: those of the front)",
                f"deboom run studies/tolerance_allocation.py --from-run RUN --pick {pick}",
                "--tolerances",
            )
        )
    if sources.sharing is None:
        rows.append(
            (
                "which vehicles share a part number",
                "deboom run studies/commonality.py",
                "--sharing",
            )
        )
    if sheet.study.model.structure is None:
        rows.append(
            (
                "what pieces of a batch and axes of a piece have in common",
                "the study of the front with --parts FILE",
                "a new RUN",
            )
        )
    return pd.DataFrame(rows, columns=["missing", "comes from", "goes to"])


def _tolerance_items(sheet: SpecificationSheet) -> dict[str, str]:
    assert sheet.sources.tolerances is not None
    found = sheet.sources.tolerances.summary
    if "share_stated" in found:
        target = (
            f"{_percent(found['share_stated'])} of parts and vehicles within their limits, "
            f"verified {_percent(found['share_verified'])}"
        )
    else:
        target = (
            f"σ of the mean level {found['sigma_cheapest_db']:.3f} dB, verified "
            f"{found['sigma_verified_db']:.3f} dB"
        )
    return {
        "target of the tolerances": target,
        "cost of these tolerances": f"{PERCENT * found['cost_ratio_to_uniform']:.0f} % of one "
        "tolerance everywhere for the same target",
    }


def _requirement(one: SpecifiedDirection) -> str:
    if one.direction.need is Need.nothing:
        return Need.nothing.value
    if one.direction.need is Need.unknown:
        return RATIO_ONLY if one.limited else Need.unknown.value
    return "interval" if one.limited else NO_BOX


def _worth(sheet: SpecificationSheet, one: SpecifiedDirection) -> dict[str, float]:
    labels = ("sigma saved per % tighter [0.001 dB]", "sigma saved per unit of cost [0.001 dB]")
    if sheet.sources.tolerances is None:
        return dict.fromkeys(labels, NAN)
    table = sheet.sources.tolerances.directions
    columns = (
        "sigma per % of tolerance, cheapest [0.001 dB]",
        "sigma per unit of cost, cheapest [0.001 dB]",
    )
    known = one.direction.name in table.index
    return {
        label: float(table.loc[one.direction.name, column]) if known else NAN  # type: ignore[arg-type]
        for label, column in zip(labels, columns, strict=True)
    }


def _yes(value: bool | None) -> str:
    return {True: "yes", False: "no", None: "–"}[None if value is None else bool(value)]


def _percent(share: float) -> str:
    return f"{PERCENT * share:.2f} %"
