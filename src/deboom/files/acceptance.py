"""What is agreed with a mount supplier: acceptance box, programme, sheet, and measured parts."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import pandas as pd
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from deboom.arrays import AXES
from deboom.errors import InputError
from deboom.files.disk import read_document, replace_text
from deboom.files.run_folder import RECORD, check_files, read_run
from deboom.files.schema import (
    AtLeastOne,
    NotNegative,
    Number,
    Positive,
    Row3,
    Several,
    Share,
    StrictModel,
    Title,
    checked_document,
    doubled,
    load_toml,
    refuse_all,
)
from deboom.files.supplier_words import WORDS, said
from deboom.files.tables import Row, read_rows, refuse_second, sheet_names
from deboom.language import Language

FORMAT, VERSION = "deboom acceptance box", 2
BOX_FILE = "acceptance_box.json"

_AGAIN = "run the study solution_box again"
_CHECKSUM = "sha256"
ON_BOUND = 1e-6
"""Distance of an end from the bound of the search at which it lies on it, of the range [1]."""

Pair = Annotated[tuple[float, float], Field(strict=False)]
_Part = Annotated[float, Field(gt=0.0, lt=1.0)]


class BoxVariable(StrictModel):
    """Interval of one stiffness factor.

    Parameters
    ----------
    name : str
        ``<mount> <axis>``.
    lower, upper : float
        Ends of the interval, both accepted [1].
    searched : (float, float)
        Range in which the search looked for the ends [1].
    nominal : float
        Factor of the design that the box was asked for about [1].
    reference_stiffness_n_per_m : float or None
        Magnitude of the dynamic stiffness of one piece at factor 1; None: not measured.
    condition : str
        At which the reference was read, in words.
    weight : float
        Weight of the interval in the search, above 0 [1].
    required : bool
        False where no vehicle depends on the variable: its interval is that of the bounds.
    """

    name: Title
    lower: Positive
    upper: Positive
    searched: Pair
    nominal: Positive
    reference_stiffness_n_per_m: Positive | None
    condition: str
    weight: Positive
    required: bool

    @model_validator(mode="after")
    def _inside(self) -> Self:
        low, high = self.searched
        near = ON_BOUND * (high - low)
        if not low - near <= self.lower < self.upper <= high + near:
            raise ValueError(
                f"'{self.name}': the interval {self.lower:g} to {self.upper:g} is none inside of "
                f"the searched range {low:g} to {high:g}"
            )
        return self

    @property
    def set_by_limit(self) -> str:
        """Ends that the limit sets: ``from``, ``to``, ``from and to``, or nothing: the search."""
        low, high = self.searched
        near = ON_BOUND * (high - low)
        ends = {"from": self.lower > low + near, "to": self.upper < high - near}
        return " and ".join(end for end, by_limit in ends.items() if by_limit)


class BoxResponse(StrictModel):
    """Limit of one vehicle.

    Parameters
    ----------
    name : str
        Name of the vehicle.
    limit : float
        Largest value that is kept [unit of the box].
    share : float
        Share of the verified parts that keep it [1].
    """

    name: Title
    limit: float
    share: Share


class AcceptanceBox(StrictModel):
    """A box with the limit that it keeps, and everything it follows from.

    Parameters
    ----------
    title, platform, platform_sha256, group : str
        Title for people; name and hash of the platform's files; vehicles that were served.
    motion, mounts : str
        Models behind the responses, as the study's options name them.
    load_cases : tuple of (str, float)
        Names and weights [1].
    band_hz : (float, float)
        Lines that count.
    quantity, unit : str
        What is limited, such as ``mean level of the lines``, in dB(A).
    limit_below_today_db : float or None
        How far the limit of each vehicle lies below its level today [dB]; None: one limit was
        stated.
    gain_kept : float or None
        Share of each vehicle's gain by the wanted design that its limit keeps [1]; None: the limit
        was stated.
    together : bool
        A part counts as a whole: all vehicles must keep their limits. Otherwise every pair of part
        and vehicle counts.
    variables : tuple of BoxVariable
    responses : tuple of BoxResponse
    share_stated, share_verified, share_bound : float
        Share asked for, found with independent parts, and its one-sided lower bound [1].
    share_measured_again : (float, float) or None
        Share if all measurements were made again, 90 % interval [1].
    confidence : float
        Confidence of the bound [1].
    n_parts : int
        Independent parts.
    law : str
        How parts were taken to lie in the box.
    common : float
        By how much all rubber of a car may be softer or harder together than in the test of a part;
        0 in files of earlier versions [1].
    seed : int
        Seed of search and verification.
    """

    title: str
    platform: str
    platform_sha256: Title
    group: str
    motion: str
    mounts: str
    load_cases: AtLeastOne[Annotated[tuple[str, float], Field(strict=False)]]
    band_hz: Pair
    quantity: str
    unit: str
    limit_below_today_db: float | None = None
    gain_kept: Share | None = None
    together: bool
    variables: AtLeastOne[BoxVariable]
    responses: AtLeastOne[BoxResponse]
    share_stated: _Part
    share_verified: Share
    share_bound: Share
    share_measured_again: Annotated[tuple[Share, Share], Field(strict=False)] | None
    confidence: _Part
    n_parts: Number
    law: str
    common: Share = 0.0
    seed: Number

    @model_serializer(mode="wrap")
    def _without_what_is_not_stated(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what earlier versions have not: sheets name their box by its content."""
        values: dict[str, Any] = handler(self)
        for name, unstated in (("common", 0.0), ("gain_kept", None)):
            if values[name] == unstated:
                del values[name]
        return values

    def faults(self) -> Iterator[str]:
        """Give a sentence for variables and responses that come twice."""
        yield from doubled("[[variables]] are named", [item.name for item in self.variables])
        yield from doubled("[[responses]] are named", [item.name for item in self.responses])

    def variable(self, name: str) -> BoxVariable:
        """Return a variable by name.

        Raises
        ------
        InputError
            There is none.
        """
        for variable in self.variables:
            if variable.name == name:
                return variable
        raise InputError(
            f"the box has no variable '{name}': use one of {[v.name for v in self.variables]}"
        )


def checksum(entries: Mapping[str, Any]) -> str:
    """Return the SHA-256 of entries as canonical JSON, in hexadecimal."""
    text = json.dumps(entries, sort_keys=True, ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def box_document(box: AcceptanceBox) -> dict[str, Any]:
    """Put a box into what JSON knows, with its format and the checksum of its entries."""
    entries = box.model_dump(mode="json")
    if box.limit_below_today_db is None:  # one limit was stated
        del entries["limit_below_today_db"]
    return {"format": FORMAT, "version": VERSION, _CHECKSUM: checksum(entries), **entries}


def write_solution_box(path: Path, box: AcceptanceBox) -> None:
    """Write a box; the file appears complete or not at all.

    Raises
    ------
    InputError
        A folder that cannot be written.
    """
    text = json.dumps(box_document(box), indent=1, ensure_ascii=False, allow_nan=False)
    replace_text(path, text + "\n")


def box_file(path: Path) -> Path:
    """Return the file of a box: the path itself, or the box of a run, see `read_run`.

    Raises
    ------
    InputError
        A folder without one.
    """
    if not path.exists():
        with suppress(InputError):  # whoever reads the file says that it is not there
            path = read_run(path).folder
    if not path.is_dir():
        return path
    if not (path / BOX_FILE).is_file():
        raise InputError(
            f"{path} holds no {BOX_FILE}: give a run folder of the study solution_box, or the file"
        )
    return path / BOX_FILE


def read_solution_box(path: str | Path) -> AcceptanceBox:
    """Read an acceptance box, or that of a run folder, whose files are checked.

    Parameters
    ----------
    path : str or Path
        File that `write_solution_box` or the study ``solution_box`` wrote, or the study's run.

    Returns
    -------
    AcceptanceBox
        Intervals as factors on today's stiffness [1] with the reference stiffness [N/m], and the
        limits of the vehicles.

    Raises
    ------
    InputError
        The file is missing, no JSON, of another format or version, lacks an entry, has one too
        many or one of the wrong kind or range; it is not what its checksum says, or its run is not
        what its record says: an agreed change is a new box.

    See Also
    --------
    deboom.largest_box, deboom.read_delivered_parts, deboom.judged_delivery

    Examples
    --------
    >>> import deboom
    >>> box = deboom.read_solution_box("results/solution_box/RUN")  # doctest: +SKIP
    """
    file = box_file(Path(path))
    if (file.parent / RECORD).is_file():
        check_files(read_run(file.parent))
    kind = "acceptance box: the study solution_box writes one"
    document = read_document(file, FORMAT, VERSION, kind, _AGAIN)
    stated = document.pop(_CHECKSUM, None)
    box = checked_document(file, document, AcceptanceBox)
    if stated != checksum(document):
        raise InputError(
            f"{file} has been edited: its checksum is not that of its entries; an agreed change "
            f"is a new box: {_AGAIN}"
        )
    return box


PROGRAMME_FILE = "programme.toml"


class TestEntry(StrictModel):
    """How parts are tested, as both sides have agreed."""

    frequencies_hz: AtLeastOne[Positive] | None = None
    """The first one is that of the acceptance lines."""
    temperature_c: float | None = None
    temperature_tolerance_c: NotNegative | None = None
    second_amplitude_mm: Positive | None = None
    """Peak amplitude at which |K| is measured besides, for its dependence on amplitude."""
    loss_factor_tolerance: Share | None = None
    """Relative; the loss factor is reported, and not judged."""
    static_rate_tolerance: Share | None = None
    """Relative; the static rate is reported, and not judged."""
    ageing: Title | None = None
    fixture: Title | None = None
    """What holds the part, and its stiffness."""
    sampling: Title | None = None
    first_articles: Title | None = None
    conditioning_cycles: Annotated[int, Field(ge=0)] | None = None
    uncertainty: Annotated[float, Field(ge=0.0, lt=0.5)] | None = None
    """Measuring uncertainty of a stiffness, relative, expanded to 95 %."""


class ProcessEntry(StrictModel):
    """What is asked of every process, whatever acoustics needs."""

    cpk: NotNegative = 1.33
    """0: the process has to show none."""
    parts_per_sample: Annotated[int, Field(ge=3)] = 20


class ProgrammeMount(StrictModel):
    """One part of the programme."""

    name: Title
    """Name of the mount on the platform."""
    part_number: Title | None = None
    drawing_number: Title | None = None
    revision: Title | None = None
    state: Literal["draft", "released"] = "draft"
    """Of its sheet; a released one needs part number, drawing number and revision."""
    parts_per_year: Number | None = None
    weight_force_n: Row3 | None = None
    """Force of the weight on the body at one piece, x y z."""
    conditioning_force_n: Row3 | None = None
    """Force that conditioning cycles go to, x y z."""
    curve_zero: Literal["unloaded", "under weight"] | None = None
    """Where the deflections of its static curves count from."""
    force_per_wheel_torque: Row3 | None = None
    """Static force of one piece over wheel torque, x y z [N/(N m)]."""
    saving: dict[str, NotNegative] | None = None
    """Price per part of holding one axis, which a free direction saves [currency]."""


class VariantEntry(StrictModel):
    """One variant of the vehicle."""

    name: Title
    mounts: Several[Title]
    """Mounts that it takes from this programme."""
    vehicles_per_year: Number


class Programme(StrictModel):
    """Content of ``programme.toml`` beside a platform; every key is optional but the format."""

    format: Literal[1] = 1
    contact: Title | None = None
    prototypes: Title | None = None
    start_of_production: Title | None = None
    currency: Title = "EUR"
    test: TestEntry = TestEntry()
    process: ProcessEntry = ProcessEntry()
    mounts: Several[ProgrammeMount] = ()
    variants: Several[VariantEntry] = ()

    def faults(self) -> Iterator[str]:
        """Give a sentence for mounts that come twice, or are released without their numbers."""
        yield from doubled("[[mounts]] are named", [mount.name for mount in self.mounts])
        for mount in self.mounts:
            names = ("part_number", "drawing_number", "revision")
            missing = [name for name in names if getattr(mount, name) is None]
            if mount.state == "released" and missing:
                yield (
                    f"the mount '{mount.name}' is released without {', '.join(missing)}: state "
                    'them, or leave state = "draft"'
                )

    def mount(self, name: str) -> ProgrammeMount:
        """Return what is known of a mount, perhaps nothing but its name."""
        mount_by_name = {mount.name: mount for mount in self.mounts}
        return mount_by_name.get(name, ProgrammeMount(name=name))


def read_programme(folder: Path, mounts: tuple[str, ...]) -> Programme:
    """Read ``programme.toml`` of a platform; an empty programme where there is none.

    Raises
    ------
    InputError
        A file that is no TOML, an unknown or mistyped key, a mount that the platform has not or
        that is named twice.
    """
    path = folder / PROGRAMME_FILE
    if not path.is_file():
        return Programme()
    programme = load_toml(path, Programme)
    used = [name for variant in programme.variants for name in variant.mounts]
    refuse_all(
        f"{path}: there is no mount '{name}' on this platform: use {', '.join(mounts)}"
        for name in (*(mount.name for mount in programme.mounts), *used)
        if name not in mounts
    )
    return programme


SHEET_FORMAT: Literal["deboom supplier sheet"] = "deboom supplier sheet"
SHEET_VERSION: Literal[2] = 2
DATA_SHEET = "deboom"
"""Sheet of a workbook that is read back."""
STATE_TOLERANCE = {"preload": 0.05, "amplitude": 0.1, "frequency": 0.02}
"""Relative distance from the state of the sheet at which a measurement still counts [1]."""
AGREES = 0.01
"""Relative difference between |K| and the root of K'² + K''² that is allowed [1]."""
STATE = ("measured_preload", "measured_amplitude", "measured_frequency")
STIFFNESS = ("magnitude", "real", "imaginary")
"""Columns of the table to fill in, by their keys: the state, and what was measured there."""


class SheetDirection(StrictModel):
    """One row of a data block: what is asked of one direction, and the state where it holds.

    Parameters
    ----------
    name : str
        ``<mount> <axis>``.
    duty : str
        ``must``: an end of the band is set by a limit; ``preferred``; ``free``; ``not identified``.
    lower, upper : float or None
        Ends of the band over today's stiffness at any state [1]; None: nothing is asked.
    today_n_per_mm : float or None
        Magnitude of today's dynamic stiffness at the state; None: not known.
    loss_factor : float or None
        Wanted one [1].
    preload_n, preload_mm, amplitude_mm, frequency_hz : float or None
        The state: static force and deflection, peak amplitude, frequency; None: to be agreed.
    static_rate_n_per_mm : float or None
        Slope of the wanted static curve at the preload.
    """

    name: Title
    duty: Literal["must", "preferred", "free", "not identified"]
    lower: Positive | None
    upper: Positive | None
    today_n_per_mm: Positive | None
    loss_factor: float | None
    preload_n: float | None
    preload_mm: float | None
    amplitude_mm: Positive | None
    frequency_hz: Positive | None
    static_rate_n_per_mm: float | None


class SupplierSpecification(StrictModel):
    """What a sheet asks of one part, as `deboom accept` reads it back from the workbook.

    Parameters
    ----------
    mount, revision : str
        The part; the revision of its drawing, empty if not given.
    language : str
        Of the table to fill in.
    box_sha256 : str
        Checksum of the acceptance box; empty where there is none.
    share_stated : float or None
        Share of the pieces that must lie inside [1].
    uncertainty : float or None
        Stated measuring uncertainty, relative, expanded to 95 % [1].
    directions : tuple of SheetDirection
    part_number, issued : str
        Number of the part, empty if not given; day on which the sheet was issued, YYYY-MM-DD.
    drawing : str
        Number of its drawing, empty if not given, as on sheets of deboom 0.3.
    cpk : float or None
        Cpk that the process must show, by the lower bound of a sample [1]; None: not demanded.
    """

    format: Literal["deboom supplier sheet"] = SHEET_FORMAT
    version: Literal[2] = SHEET_VERSION
    mount: Title
    revision: str
    language: Literal["en", "de"]
    box_sha256: str
    share_stated: Share | None
    uncertainty: Annotated[float, Field(ge=0.0, lt=0.5)] | None
    directions: AtLeastOne[SheetDirection]
    part_number: str = ""
    issued: Annotated[str, Field(pattern=r"^(\d{4}-\d{2}-\d{2})?$")] = ""
    cpk: Positive | None = None
    drawing: str = ""

    @property
    def document(self) -> dict[str, Any]:
        """Entries as they stand in the workbook, in what JSON knows."""
        # without an empty drawing, older sheets keep their checksum
        return self.model_dump(mode="json", exclude=None if self.drawing else {"drawing"})

    @property
    def checksum(self) -> str:
        """SHA-256 of the specification, which cells that a supplier fills in do not change."""
        return checksum(self.document)

    @property
    def musts(self) -> dict[str, SheetDirection]:
        """Directions that parts are judged by, by axis."""
        return {d.name.rpartition(" ")[2]: d for d in self.directions if d.duty == "must"}

    @property
    def cells(self) -> dict[str, str]:
        """Entries of the sheet of the workbook that is read back."""
        text = json.dumps(self.document, ensure_ascii=False)
        return {"specification": text, _CHECKSUM: self.checksum}

    @property
    def fill_in(self) -> tuple[str, ...]:
        """Keys of the columns of the table that a supplier fills in."""
        return ("part", "batch", "direction", "part_number", *STATE, *STIFFNESS, "loss_angle")

    def said(self, key: str) -> str:
        """Return a word in the language of the sheet."""
        return said(key, Language(self.language))


def holds_sheet(path: Path) -> bool:
    """Return whether a table of parts is the workbook of a sheet."""
    return path.suffix.lower() == ".xlsx" and DATA_SHEET in sheet_names(path)


def read_specification(path: Path) -> SupplierSpecification:
    """Read the specification back from the workbook of a sheet.

    Raises
    ------
    InputError
        A file that is no workbook of a sheet, or whose specification has been edited.
    """
    remedy = "give the workbook that deboom report --supplier wrote"
    rows = read_rows(path, ("entry", "value"), {}, sheet=DATA_SHEET)
    cells = {row.cells["entry"]: row.cells["value"] for row in rows}
    try:
        raw = json.loads(cells["specification"])
    except (KeyError, ValueError, RecursionError):
        raise InputError(f"{path} holds no specification: {remedy}") from None
    if not isinstance(raw, dict) or raw.get("format") != SHEET_FORMAT:
        raise InputError(f"{path} holds no specification: {remedy}")
    if raw.get("version") != SHEET_VERSION:
        raise InputError(
            f"{path} is a sheet of version {raw.get('version')}, this deboom reads version "
            f"{SHEET_VERSION}: issue the sheet again with deboom report --supplier"
        )
    specification = checked_document(path, raw, SupplierSpecification)
    if specification.checksum != cells.get(_CHECKSUM):
        raise InputError(
            f"{path}: its specification has been edited, its checksum is another one: {remedy}; "
            "an agreed change is a new revision"
        )
    return specification


PLAIN = ("part", "batch", "mount")


@dataclass(frozen=True)
class DeliveredPart:
    """One measured part.

    Parameters
    ----------
    name : str
        Serial number.
    batch : str
    mount : str
    stiffness : mapping of str to float
        Axis → magnitude of the dynamic stiffness [N/m], or over that of today's part at the same
        state [1]; axes that were not measured are missing.
    """

    name: str
    batch: str
    mount: str
    stiffness: Mapping[str, float]


def read_delivered_parts(
    path: str | Path | pd.DataFrame,
    required: Mapping[str, tuple[str, ...]],
    *,
    over_today: bool = False,
) -> tuple[DeliveredPart, ...]:
    """Read the parts of a delivery from a table with one row per part.

    Parameters
    ----------
    path : path or DataFrame
        ``.xlsx`` or ``.csv``, or the table itself, with the columns
        ``part, batch, mount, x [N/mm], y [N/mm], z [N/mm]`` in any order; N/m is read as well.
        A cell may be empty where the axis is not required.
    required : mapping of str to tuple of str
        Mount → axes that must be measured.
    over_today : bool
        The columns are ``x [1], y [1], z [1]``: stiffness over that of today's part, both measured
        at one state on one machine.

    Returns
    -------
    tuple of DeliveredPart
        In the order of the table.

    Raises
    ------
    InputError
        A column that is missing, or in another quantity's unit; a part named twice, of an unknown
        mount, without batch or a required axis, or with a stiffness that is not positive.

    See Also
    --------
    deboom.read_solution_box, deboom.judged_delivery

    Examples
    --------
    >>> import deboom
    >>> deboom.read_delivered_parts("parts.csv", {"TSM": ("x", "z")})  # doctest: +SKIP
    """
    parts, seen = [], dict[str, int]()
    table = path if isinstance(path, pd.DataFrame) else Path(path)
    for row in read_rows(table, PLAIN, dict.fromkeys(AXES, "1" if over_today else "N/m")):
        name, mount = row.filled("part"), row.filled("mount")
        repeated = "give each piece its own name, or one row with the mean of its repeats"
        refuse_second(seen, f"part '{name}'", row, repeated)
        if mount not in required:
            raise row.error(
                f"part '{name}': the box knows no mount '{mount}', only {', '.join(required)}"
            )
        stiffness: dict[str, float] = {}
        for axis in AXES:
            if row.cells[axis]:
                stiffness[axis] = row.number(axis)
            elif axis in required[mount]:
                raise row.error(
                    f"part '{name}': {mount} {axis} was not measured, and the box limits it: "
                    "measure it"
                )
        for direction, value in stiffness.items():
            if not value > 0.0:
                raise row.error(
                    f"part '{name}': {mount} {direction} is {value:g} N/m, a stiffness is above 0: "
                    "correct the measurement"
                )
        parts.append(DeliveredPart(name, row.filled("batch"), mount, stiffness))
    return tuple(parts)


def read_measured_sheet(
    path: Path, specification: SupplierSpecification
) -> tuple[DeliveredPart, ...]:
    """Read the table that a supplier filled in, one row per part and direction.

    Parameters
    ----------
    path : Path
        Workbook of the sheet.
    specification : SupplierSpecification
        What was asked; rows of directions that are no must are left out.

    Returns
    -------
    tuple of DeliveredPart
        With stiffnesses at the state of the sheet [N/m]; where today's is not known in N/mm, over
        that of today's part [1]. Where rows of today's part are there, stiffnesses are scaled so
        that its mean is the sheet's.

    Raises
    ------
    InputError
        No part; a column, unit or required direction that is missing; a direction unknown or twice;
        another part number or state than the sheet's; no row of today's part where only ratios to
        it are known; a stiffness that is not positive or contradicts itself.
    """
    measured, musts = specification.said("sheet_measured"), specification.musts
    plain = [key for key in specification.fill_in if not WORDS[key].unit]
    units = {key: _SI[WORDS[key].unit] for key in specification.fill_in if WORDS[key].unit}
    by_name = {specification.said(key): unit for key, unit in units.items()}
    stated: dict[tuple[str, str], dict[str, float]] = {}
    today, directions = dict[str, list[float]](), [d.name for d in specification.directions]
    for line in read_rows(path, list(map(specification.said, plain)), by_name, measured):
        row = _MeasuredRow(line, specification)
        if not row.part:
            continue
        direction, axis = row["direction"], row["direction"].rpartition(" ")[2]
        row.check_part_number()
        if direction not in directions:
            raise row.error(f"the sheet has no direction '{direction}'")
        if axis not in musts:
            continue
        row.check_state(musts[axis])
        value = row.magnitude()
        if row.part == specification.said("part today"):
            today.setdefault(axis, []).append(value)
            continue
        axes = stated.setdefault((row.part, row["batch"] or "–"), {})
        if axis in axes:
            raise row.error(f"{direction} stands there twice: keep one row, or the mean of repeats")
        axes[axis] = value
    if not stated:
        raise InputError(f"{path} holds no measured part: one row per part and direction")
    for axis, must in musts.items():
        reference, of_sheet = 1.0, must.today_n_per_mm
        if of_sheet is None and axis not in today:
            raise InputError(
                f"{path}: {must.name} is only known as a ratio to today's part: measure that one "
                f"on the same machine and add its row, with '{specification.said('part today')}' "
                "as part"
            )
        if axis in today:
            reference = sum(today[axis]) / len(today[axis])
            reference /= 1.0 if of_sheet is None else 1e3 * of_sheet
        for (part, _), axes in stated.items():
            if axis not in axes:
                raise InputError(f"{path}: part '{part}': {must.name} was not measured: measure it")
            axes[axis] /= reference
    return tuple(
        DeliveredPart(part, batch, specification.mount, axes)
        for (part, batch), axes in stated.items()
    )


_SI = {"N": "N", "mm": "m", "Hz": "Hz", "N/mm": "N/m", "°": "rad"}
"""Unit in which a column of the table is read."""


@dataclass(frozen=True)
class _MeasuredRow:
    """One row of a filled-in sheet, read by the keys of its columns."""

    line: Row
    sheet: SupplierSpecification

    def __getitem__(self, key: str) -> str:
        return self.line.cells[self.sheet.said(key)]

    @property
    def part(self) -> str:
        """Serial number; empty where nothing was filled in."""
        return self["part"]

    def number(self, key: str) -> float:
        """Return a number in SI units; nan where the cell is empty."""
        return self.line.number(self.sheet.said(key)) if self[key] else math.nan

    def error(self, fault: str) -> InputError:
        """Say what is wrong with this row."""
        return self.line.error(f"part '{self.part}': {fault}")

    def check_part_number(self) -> None:
        """Refuse a row of another part number than the sheet's."""
        number = self.sheet.part_number
        if number and self["part_number"] != number:
            raise self.error(
                f"its part number is '{self['part_number']}', the sheet is of {number}: fill in "
                "the sheet of that part"
            )

    def check_state(self, must: SheetDirection) -> None:
        """Refuse a row that was measured at another state than the sheet's."""
        demanded = (must.preload_n, must.amplitude_mm, must.frequency_hz)
        units = (("N", 1.0), ("mm", 1e3), ("Hz", 1.0))
        lines = zip(STATE_TOLERANCE.items(), STATE, demanded, units, strict=True)
        for (what, tolerance), key, wanted, (unit, size) in lines:
            if wanted is None:
                continue
            measured = size * self.line.number(self.sheet.said(key))
            if not abs(measured - wanted) <= tolerance * abs(wanted) + 1e-9:
                raise self.error(
                    f"{must.name} was measured at {measured:g} {unit} {what}, the sheet asks for "
                    f"{wanted:.4g} {unit} within {100 * tolerance:g} %: measure it there"
                )

    def magnitude(self) -> float:
        """Return |K| [N/m], from |K| or from K' and K''."""
        whole, real, imaginary = map(self.number, STIFFNESS)
        from_parts = math.hypot(real, imaginary)
        if math.isnan(whole) and math.isnan(from_parts):
            raise self.error("give |K| or both K' and K''")
        if abs(whole - from_parts) > AGREES * whole:
            raise self.error(
                f"|K| is {1e-3 * whole:.1f} N/mm, K' and K'' make {1e-3 * from_parts:.1f} N/mm: "
                "correct the wrong one"
            )
        value = from_parts if math.isnan(whole) else whole
        if not value > 0.0:
            raise self.error("a stiffness is above 0: correct the measurement")
        return value
