"""The file ``operation.toml``: strict keys of a test on a running compressor."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from deboom.errors import InputError
from deboom.files.platform_file import Positive, RelativePath, Row3
from deboom.files.strict_toml import StrictModel, dump_toml, load_toml

OPERATING_TEST_FILE = "operation.toml"

Title = Annotated[str, Field(min_length=1)]
Node = Annotated[int, Field(ge=1)]


class DeviationSection(StrictModel):
    """Standard deviation of the real and of the imaginary part of an order spectrum.

    Both add as squares: what scatters from run to run with the amplitude, and the floor
    ``floor √(1 + (corner/f)²)`` of the channels.
    """

    relative: Positive
    """Over the amplitude [1]."""
    floor_m_s2: Positive
    """Far above the corner."""
    corner_hz: Positive
    """Below it the floor grows as 1/f."""


class SweepSection(StrictModel):
    """One run-up at one pressure, as spectra of first order or over time."""

    name: Title
    """Such as ``standard 7.5 bar``."""
    hoses: Literal["standard", "soft"]
    """Those of the vehicle, or long soft ones with masses on them."""
    pressure_bar: Positive
    """Of the gas at the outlet."""
    spectra: RelativePath | None = None
    """UFF file of the order spectra."""
    record: RelativePath | None = None
    """UFF file of the channels over time, with the tacho; instead of `spectra`."""
    sample_rate_hz: Positive | None = None
    """Of the record, exact; UFF keeps six digits of it."""


class HoseSection(StrictModel):
    """A hose as drawn and catalogued: start values, not truth."""

    name: Title
    """Such as ``suction hose``."""
    position_m: Row3
    """Of the port on the compressor, from the origin of the position sheet."""
    direction: Row3
    """From the port to the body, of any length."""
    length_m: Positive
    """Between its ends."""
    tension_n: Positive
    """EA."""
    torsion_n_m2: Positive
    """GJ."""
    bending_n_m2: Positive
    """EI."""
    line_mass_kg_per_m: Positive
    """With what flows in it."""
    loss_factor: Positive
    """Of all three stiffnesses."""
    torsion_radius_m: Positive
    """Radius of gyration of the section about its axis."""


class HolderSection(StrictModel):
    """A triaxial accelerometer on the body side of a mount, along the axes of the position sheet.

    An accelerometer under an angle is turned before it is delivered.
    """

    name: Title
    """Of the mount, such as ``mount 1``; its channels are ``mount 1 x`` and so on."""
    node: Node
    """In the UFF files."""


class MicrophoneSection(StrictModel):
    """A microphone."""

    name: Title
    """Such as ``driver``."""
    node: Node
    """In the UFF files, direction scalar."""


class OperatingTestFile(StrictModel):
    """The whole file ``operation.toml``."""

    format: Literal[1]
    """Version of this format."""
    title: Title
    """What a reader calls the test."""
    hammer: RelativePath
    """Folder of the hammer test without hoses, with its ``compressor_test.toml``."""
    hammer_with_hoses: RelativePath | None = None
    """Folder of the one with the standard hoses, compressor off."""
    sensor_table: RelativePath
    """Position sheet of the accelerometers as they stood in the sweeps, CSV or Excel."""
    tacho_node: Node
    """In the UFF files, direction scalar; one pulse per revolution, where the rotor's mark is on
    the y axis."""
    rotor_inertia_kg_m2: Positive | None = None
    """Polar moment of the rotor, from its data sheet."""
    deviations: DeviationSection
    """How well the spectra of the accelerometers are known."""
    sweeps: Annotated[tuple[SweepSection, ...], Field(strict=False, min_length=1)]
    """All run-ups."""
    hoses: Annotated[tuple[HoseSection, ...], Field(strict=False)] = ()
    """Left out where there is no drawing."""
    holders: Annotated[tuple[HolderSection, ...], Field(strict=False)] = ()
    """Left out where there were none."""
    microphones: Annotated[tuple[MicrophoneSection, ...], Field(strict=False)] = ()
    """Left out where there were none."""


def load_operating_test_file(path: Path) -> OperatingTestFile:
    """Read and check ``operation.toml``.

    Raises
    ------
    InputError
        The file is missing or is not TOML; a key is unknown, missing, mistyped or out of range; a
        sweep without a file, with two, or with a record of unknown rate; doubled names or nodes.
    """
    file = load_toml(path, OperatingTestFile)
    _check(path, file)
    return file


def dump_operating_test_file(path: Path, file: OperatingTestFile) -> None:
    """Write ``operation.toml``; what is written is read back and compared first.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    _check(path, file)
    dump_toml(path, file)


def _check(path: Path, file: OperatingTestFile) -> None:
    for sweep in file.sweeps:
        where = f"{path}: [[sweeps]] '{sweep.name}'"
        if (sweep.spectra is None) == (sweep.record is None):
            raise InputError(
                f"{where}: name its order spectra with the key 'spectra', or its channels over "
                "time with the key 'record', one of both"
            )
        if (sweep.record is None) != (sweep.sample_rate_hz is None):
            raise InputError(f"{where}: the keys 'record' and 'sample_rate_hz' come together")
    for section, entries in (
        ("sweeps", file.sweeps),
        ("hoses", file.hoses),
        ("holders", file.holders),
        ("microphones", file.microphones),
    ):
        names = [entry.name for entry in entries]
        doubled = next((name for name in names if names.count(name) > 1), None)
        if doubled is not None:
            raise InputError(f"{path}: two [[{section}]] are named '{doubled}': keep or rename one")
    nodes = [file.tacho_node]
    nodes += [holder.node for holder in file.holders]
    nodes += [microphone.node for microphone in file.microphones]
    twice = next((node for node in nodes if nodes.count(node) > 1), None)
    if twice is not None:
        raise InputError(
            f"{path}: node {twice} stands for two of tacho, holders and microphones: give each its "
            "own"
        )
