"""The file ``platform.toml``: strict keys in, one clear sentence out when a key is wrong."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Annotated, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    ValidationInfo,
    field_validator,
)

from deboom.errors import InputError
from deboom.files.faults import Note, refuse
from deboom.files.function_files import TABLE_ENDINGS
from deboom.files.strict_toml import StrictModel, dump_toml, load_toml, load_what_is_right


def _plain_name(name: str) -> str:
    if not name or any(character.isspace() for character in name):
        raise ValueError("a name needs at least one character and no blanks")
    return name


def _inside(name: str) -> str:
    path = PurePosixPath(name)
    if not name or path.is_absolute() or ".." in path.parts or "\\" in name or ":" in name:
        raise ValueError("a file is named relative to the platform folder, with / and without ..")
    return name


def _symmetric_positive(rows: Matrix3) -> Matrix3:
    matrix = np.array(rows)
    if not np.array_equal(matrix, matrix.T) or np.any(np.linalg.eigvalsh(matrix) <= 0):
        raise ValueError("an inertia tensor is symmetric and positive definite")
    return rows


Name = Annotated[str, AfterValidator(_plain_name)]
RelativePath = Annotated[str, AfterValidator(_inside)]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
# TOML has arrays only, no tuples: the container is converted, its items stay strict
Row3 = Annotated[tuple[float, float, float], Field(strict=False)]
Matrix3 = Annotated[tuple[Row3, Row3, Row3], Field(strict=False)]


class Engine(StrictModel):
    """The engine and its gearbox."""

    cylinders: Annotated[int, Field(ge=1)]
    """Number of cylinders."""
    dominant_order: Positive
    """Engine order of the operating spectra [cycles per revolution]."""
    total_ratios: Annotated[tuple[Positive, ...], Field(strict=False, min_length=1)]
    """Engine speed over wheel speed, gear 1 first [1]."""


class Powertrain(StrictModel):
    """Nominal rigid-body data from the data sheet, with tolerances."""

    mass_kg: Positive
    """Mass [kg]."""
    mass_tolerance_kg: NotNegative
    """Half width [kg]."""
    inertia_kg_m2: Annotated[Matrix3, AfterValidator(_symmetric_positive)]
    """Matrix entries about the centre of gravity, vehicle axes [kg m²]."""
    inertia_tolerance: NotNegative
    """Half width relative to the diagonal [1]."""
    centre_of_gravity_tolerance_m: NotNegative
    """Half width per axis [m]."""


class MountEntry(StrictModel):
    """One mount."""

    name: Name
    """Short, such as ``TSM``."""
    description: str
    """In words, for the report."""
    pieces: Annotated[tuple[Name, ...], Field(strict=False, min_length=2)] | None = None
    """Pieces that share the part number; left out for a single piece."""
    transfer_axes: Annotated[tuple[Literal["x", "y", "z"], ...], Field(strict=False)]
    """Axes whose force reaches the cabin."""
    body_mass_kg: Positive | None = None
    """Mass of the body on each piece where that is not the powertrain, from the data sheet [kg]."""
    body_mass_tolerance_kg: NotNegative | None = Field(default=None, validate_default=True)
    """Half width [kg]; stated with the mass."""

    @field_validator("body_mass_tolerance_kg")
    @classmethod
    def _mass_and_tolerance(cls, tolerance: float | None, others: ValidationInfo) -> float | None:
        mass = others.data.get("body_mass_kg")
        if mass is None and tolerance is not None:
            raise ValueError("a tolerance needs the key 'body_mass_kg' beside it")
        if mass is not None and (tolerance is None or tolerance >= mass):
            raise ValueError("a body mass needs a tolerance below it; state 0.0 for a weighed one")
        return tolerance

    @property
    def piece_names(self) -> tuple[str, ...]:
        """Names of the pieces; ``("",)`` for a single one."""
        return self.pieces or ("",)


class VehicleEntry(StrictModel):
    """One vehicle and the file of its noise transfer functions."""

    name: Name
    """Such as ``U06-1``."""
    group: Name
    """Vehicles of one body, such as ``U06``."""
    noise_transfer: RelativePath
    """UFF file, or a table: CSV, xlsx or MATLAB's mat."""
    ear_node: Annotated[int, Field(ge=1)] | None = Field(default=None, validate_default=True)
    """Response node of the driver's ear in a UFF file; a table has none."""

    @field_validator("ear_node")
    @classmethod
    def _node_of_a_uff_file(cls, node: int | None, others: ValidationInfo) -> int | None:
        name = others.data.get("noise_transfer", "")
        if node is None and PurePosixPath(name).suffix.lower() not in ("", *TABLE_ENDINGS):
            raise ValueError("a UFF file needs the response node of the driver's ear: add it")
        return node


class LoadCaseEntry(StrictModel):
    """One run and the file of its operating spectra."""

    name: Name
    """Short key, such as ``g5_wot220``."""
    title: str
    """In words, for the report."""
    gear: Annotated[int, Field(ge=1)]
    """Gear of the run."""
    torque_limit_nm: Positive
    """Engine torque limit [N m]."""
    operating: RelativePath
    """UFF file, or a table: CSV, xlsx or MATLAB's mat."""
    torque_table: RelativePath | None = None
    """CSV or xlsx with the engine torque at every line; left out where it was not recorded."""


class PlatformFile(StrictModel):
    """The whole file ``platform.toml``."""

    format: Literal[1]
    """Version of this format."""
    name: Name
    """Short key of the platform."""
    title: str
    """What a reader calls it."""
    description: str
    """A paragraph for the report."""
    mount_table: RelativePath
    """CSV or xlsx with the positions of the mounts."""
    channel_table: RelativePath
    """CSV or xlsx that says which UFF node and direction is which channel."""
    default_load_case: Name
    """Name of the load case that is meant when none is asked for."""
    engine: Engine
    """Engine and gearbox."""
    powertrain: Powertrain
    """Nominal rigid-body data."""
    mounts: Annotated[tuple[MountEntry, ...], Field(strict=False, min_length=1)]
    """In the order of the design variables."""
    vehicles: Annotated[tuple[VehicleEntry, ...], Field(strict=False, min_length=1)]
    """In the order of the report."""
    load_cases: Annotated[tuple[LoadCaseEntry, ...], Field(strict=False, min_length=1)]
    """In the order of the report."""


def load_platform_file(path: Path) -> PlatformFile:
    """Read and check ``platform.toml``.

    Parameters
    ----------
    path : Path
        The TOML file.

    Returns
    -------
    PlatformFile
        Every key checked for its name, type and range.

    Raises
    ------
    InputError
        The file is missing or is not TOML; a key is unknown, missing, mistyped or out of range; two
        items share a name; a gear has no ratio; the default load case does not exist.
    """
    platform = load_toml(path, PlatformFile)
    _check_names(path, platform)
    return platform


def load_right_platform_file(path: Path, note: Note) -> PlatformFile:
    """Read ``platform.toml``, tell all its faults, and return what is right of it.

    Raises
    ------
    InputError
        The file is missing or is not TOML; see also
        `deboom.files.strict_toml.load_what_is_right`.
    """
    platform = load_what_is_right(path, PlatformFile, note)
    _check_names(path, platform, note)
    return platform


def dump_platform_file(path: Path, platform: PlatformFile) -> None:
    """Write ``platform.toml``; what is written is read back and compared first.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    _check_names(path, platform)
    dump_toml(path, platform)


def _check_names(path: Path, platform: PlatformFile, note: Note = refuse) -> None:
    """Compare the entries with each other; keys at fault, which may be missing, are passed over."""
    named: list[tuple[str, list[str]]] = [
        ("[[mounts]]", [mount.name for mount in platform.mounts]),
        ("[[vehicles]]", [vehicle.name for vehicle in platform.vehicles]),
        ("[[load_cases]]", [case.name for case in platform.load_cases]),
    ]
    for mount in platform.mounts:
        named.append((f"pieces of mount {mount.name}", list(mount.piece_names)))
        axes = list(getattr(mount, "transfer_axes", ()))
        named.append((f"transfer_axes of mount {mount.name}", axes))
    for section, names in named:
        doubled = next((name for name in names if names.count(name) > 1), None)
        if doubled is not None:
            note(InputError(f"{path}: two {section} are named '{doubled}': keep or rename one"))
    ratios = getattr(getattr(platform, "engine", None), "total_ratios", None)
    for case in platform.load_cases:
        if ratios is not None and getattr(case, "gear", 0) > len(ratios):
            note(
                InputError(
                    f"{path}: load case '{case.name}' is in gear {case.gear}, but total_ratios in "
                    f"[engine] has {len(ratios)} gears: add the ratio"
                )
            )
    known = [case.name for case in platform.load_cases]
    default = getattr(platform, "default_load_case", None)
    if default is not None and default not in known:
        note(
            InputError(
                f"{path}: default_load_case '{default}' is not among the load cases "
                f"{', '.join(known)}: name one of them"
            )
        )
