"""The file ``car.toml``: strict keys of what was measured on the body of an electric car."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from deboom.errors import InputError
from deboom.files.inertance_test_file import ToleranceSection
from deboom.files.platform_file import Name, RelativePath, Row3
from deboom.files.strict_toml import StrictModel, dump_toml, load_toml
from deboom.files.vehicle_file import EarEntry

ELECTRIC_CAR_FILE = "car.toml"

Title = Annotated[str, Field(min_length=1)]


class PointSection(StrictModel):
    """One place where the compressor or a hose meets the body."""

    name: Title
    """A mount is called as its holder in ``operation.toml``, a hose end as its hose."""
    kind: Literal["mount", "hose"]
    """What meets the body there."""
    position_m: Row3
    """Elastic centre of the mount, or end of the hose, from the compressor's virtual point."""
    sensors: Annotated[tuple[Title, ...], Field(strict=False, min_length=1)]
    """Accelerometers of the position sheet on the body around it."""
    impacts: Annotated[tuple[Title, ...], Field(strict=False, min_length=1)]
    """Impacts of the position sheet on the body around it."""


class ElectricCarFile(StrictModel):
    """The whole file ``car.toml``; ``operation.toml`` lies beside it."""

    format: Literal[1]
    """Version of this format."""
    name: Name
    """Such as ``EV-1``."""
    title: Title
    """In words, for the report."""
    sensor_table: RelativePath
    """Position sheet of the accelerometers on the body, CSV or sheet ``sensors`` of Excel."""
    impact_table: RelativePath
    """Position sheet of the impacts on the body, CSV or sheet ``impacts`` of Excel."""
    pressure: RelativePath
    """UFF: pressure at the ear per force of the hammer, and its ordinary coherence."""
    accelerance: RelativePath
    """UFF: acceleration on the body per force of the hammer."""
    hits_per_impact: Annotated[int, Field(ge=1)]
    """How many hits the functions average."""
    ear: EarEntry
    """The microphone, called as in ``operation.toml``."""
    tolerances: ToleranceSection
    """Of everything placed and struck on the body."""
    points: Annotated[tuple[PointSection, ...], Field(strict=False, min_length=1)]
    """All mounts, and the ends of the hoses."""


def load_electric_car_file(path: Path) -> ElectricCarFile:
    """Read and check ``car.toml``.

    Raises
    ------
    InputError
        The file is missing or is not TOML; a key is unknown, missing, mistyped or out of range; a
        point that comes twice, or a sensor or impact that belongs to two.
    """
    file = load_toml(path, ElectricCarFile)
    for what, names in (
        ("point", [point.name for point in file.points]),
        ("sensor", [name for point in file.points for name in point.sensors]),
        ("impact", [name for point in file.points for name in point.impacts]),
    ):
        doubled = [name for name, count in Counter(names).items() if count > 1]
        if doubled:
            raise InputError(f"{path}: [[points]]: {what} '{doubled[0]}' comes twice: keep one")
    return file


def dump_electric_car_file(path: Path, file: ElectricCarFile) -> None:
    """Write ``car.toml``; what is written is read back and compared first."""
    dump_toml(path, file)
