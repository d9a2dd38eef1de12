"""The file ``compressor_test.toml``: strict keys of a roving-hammer test on a mounted body."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from deboom.errors import InputError
from deboom.files.platform_file import Matrix3, Positive, RelativePath, Row3
from deboom.files.strict_toml import StrictModel, dump_toml, load_toml

INERTANCE_TEST_FILE = "compressor_test.toml"


class ToleranceSection(StrictModel):
    """Standard deviations of what is stated only approximately."""

    sensor_gain: Positive
    """Of each channel, relative [1]."""
    sensor_position_m: Positive
    """Per axis."""
    sensor_angle_deg: Positive
    """Per axis."""
    hammer_gain: Positive
    """Common to all impacts, relative [1]."""
    impact_position_m: Positive
    """Per axis."""
    impact_angle_deg: Positive
    """Per axis."""


class DrawingSection(StrictModel):
    """The body as drawn, without its mounts."""

    mass_kg: Positive
    """Nominal mass."""
    centre_of_gravity_m: Row3
    """From the origin of the position sheet."""
    inertia_kg_m2: Matrix3
    """About the centre of gravity, products with their sign as matrix elements."""


class DrawnMountSection(StrictModel):
    """One mount as drawn."""

    name: Annotated[str, Field(min_length=1)]
    """Such as ``mount 1``."""
    position_m: Row3
    """Elastic centre, from the origin of the position sheet."""
    rotation_deg: Row3
    """Of the mount's axes about the fixed axes x, then y, then z; local x is axial."""
    stiffness_n_per_m: Row3
    """Static: axial, radial, radial."""


class InertanceTestFile(StrictModel):
    """The whole file ``compressor_test.toml``."""

    format: Literal[1]
    """Version of this format."""
    title: Annotated[str, Field(min_length=1)]
    """What a reader calls the test."""
    sensor_table: RelativePath
    """Position sheet of the accelerometers, CSV or sheet ``sensors`` of an Excel file."""
    impact_table: RelativePath
    """Position sheet of the impacts, CSV or sheet ``impacts`` of an Excel file."""
    frf: RelativePath | None = None
    """UFF file of the FRFs; left out where only hits are delivered."""
    coherence: RelativePath | None = None
    """UFF file of the ordinary coherence; comes with `frf`, and may be the same file."""
    hits_per_impact: Annotated[int, Field(ge=1)] | None = None
    """How many hits the FRFs average; comes with `frf`."""
    hits: RelativePath | None = None
    """Folder with the hits over time."""
    band_hz: Annotated[tuple[Positive, Positive], Field(strict=False)] | None = None
    """First and last line of FRFs that are made of hits; comes with `hits`."""
    weighed_mass_kg: Positive | None = None
    """From a pair of scales, sensors and brackets included; left out if it was not weighed."""
    weighed_mass_deviation_kg: Positive | None = None
    """1 σ of it; comes with it."""
    tolerances: ToleranceSection
    """How well everything is placed and calibrated."""
    drawing: DrawingSection | None = None
    """Nominal values; left out where there is no drawing."""
    mounts: Annotated[tuple[DrawnMountSection, ...], Field(strict=False)] = ()
    """Mounts of the drawing."""


_NEEDS = (
    ("frf", "coherence", "without it the noise of the FRFs is not known; export it, type 6"),
    ("frf", "hits_per_impact", "a coherence says nothing without the number of averages"),
    ("coherence", "frf", "name the FRFs that it belongs to"),
    ("hits", "band_hz", "state the first and the last line that the FRFs shall have"),
    ("weighed_mass_kg", "weighed_mass_deviation_kg", "state how well the scales know it"),
    ("weighed_mass_deviation_kg", "weighed_mass_kg", "state the mass that it belongs to"),
    ("drawing", "mounts", "add a section [[mounts]] for each, or leave the drawing out"),
    ("mounts", "drawing", "add a section [drawing], or leave the mounts out"),
)
"""Which key needs which other one, and why."""


def load_inertance_test_file(path: Path) -> InertanceTestFile:
    """Read and check ``compressor_test.toml``.

    Raises
    ------
    InputError
        The file is missing or is not TOML; a key is unknown, missing, mistyped or out of range; a
        key lacks the one that belongs to it; neither FRFs nor hits.
    """
    file = load_toml(path, InertanceTestFile)
    _check(path, file)
    return file


def dump_inertance_test_file(path: Path, file: InertanceTestFile) -> None:
    """Write ``compressor_test.toml``; what is written is read back and compared first.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    _check(path, file)
    dump_toml(path, file)


def _check(path: Path, file: InertanceTestFile) -> None:
    for key, needed, why in _NEEDS:
        if getattr(file, key) and not getattr(file, needed):
            raise InputError(f"{path}: key '{key}' needs the key '{needed}': {why}")
    if not (file.frf or file.hits):
        raise InputError(f"{path}: neither key 'frf' nor 'hits': name what was measured")
    if file.band_hz is not None and not file.band_hz[0] < file.band_hz[1]:
        raise InputError(f"{path}: key 'band_hz' is {list(file.band_hz)}: first line, then last")
    names = [mount.name for mount in file.mounts]
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled is not None:
        raise InputError(f"{path}: two [[mounts]] are named '{doubled}': keep or rename one")
