"""From the options of a study to the booming model of a platform."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from typer import Option

from deboom.arrays import RealArray
from deboom.choices import FolderKind
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.files.library_export import read_library_json
from deboom.files.platform import (
    PLATFORM_FILE,
    Platform,
    PlatformFile,
    assembled,
    read_contents,
    read_platform,
)
from deboom.files.run_folder import hash_files
from deboom.files.schema import load_toml, noting
from deboom.files.units import RANGES
from deboom.measurement.channels import LoadCase
from deboom.mounts.characterise import cross_stiffness_of_campaign
from deboom.mounts.characterised_mount import CharacterisedDirection, CharacterisedMount
from deboom.mounts.cross_stiffness import CrossStiffness, cross_stiffness_of_runs
from deboom.mounts.mount import (
    Mount,
    in_mount_axes,
    mean_operating_stiffness,
    not_identified,
    refuse_active_mounts,
)
from deboom.mounts.surface_forces import Outside, SurfaceForces, as_mounted, surface_forces
from deboom.physics.frf import corr_f
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import spl
from deboom.report import Report
from deboom.study.options import shipped_studies, weighted_load_cases
from deboom.vehicles.amplitude_motion import SAME, STARTS, AmplitudeMotion, compare_starts
from deboom.vehicles.booming_model import BoomingModel, booming_model
from deboom.vehicles.booming_model import Motion as Motion
from deboom.vehicles.booming_peaks import compare_peaks
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.design_factor import Factor as Factor
from deboom.vehicles.fleet import Band, Fleet, path_contributions
from deboom.vehicles.powertrain import library_model

PEAK_AGREEMENT = 0.3
"""Surfaces and spectra agree if no booming peak differs by more [dB]."""

PEAKS = "largest difference at peaks [dB]"
RMS = "rms difference [dB]"


@dataclass(frozen=True, eq=False)
class SurfaceCheck:
    """Levels with forces from response surfaces against those with measured forces.

    - `table`: one row per load case and vehicle, see `level_differences`.
    - `kept`: channels that keep a measured force, each with its reason.
    """

    table: pd.DataFrame
    kept: tuple[str, ...]

    @property
    def at_peaks(self) -> float:
        """Largest difference at a booming peak; nan where no curve has one [dB]."""
        return float(self.table[PEAKS].max())

    @property
    def agrees(self) -> bool:
        """Whether there are booming peaks, and all agree within `PEAK_AGREEMENT`."""
        return self.at_peaks <= PEAK_AGREEMENT

    @property
    def text(self) -> str:
        """The outcome in a few sentences."""
        peaks = f"booming peaks differ by up to {self.at_peaks:.2f} dB"
        if np.isnan(self.at_peaks):
            peaks = "there is no booming peak to compare"
        sentence = (
            "Forces come from the mounts' response surfaces. With the measured spectra instead, "
            f"{peaks}, all lines by {self.table[RMS].max():.2f} dB rms."
        )
        kept = f" The measured force stays in {'; '.join(self.kept)}." if self.kept else ""
        return sentence + kept


def surface_check(
    fleet: Fleet,
    mounts: Sequence[Mount],
    pairs: Sequence[tuple[LoadCase, SurfaceForces]],
    band: Band,
) -> SurfaceCheck:
    """Compare runs with their measured forces and with those from response surfaces.

    - `fleet`, `mounts`: who listens, and the platform's mounts.
    - `pairs`: each run as measured, and with its forces exchanged.
    - `band`: lower and upper edge, both inside [Hz].
    - raises InputError: see `deboom.vehicles.fleet.path_contributions`.
    """
    tables = []
    kept: dict[str, None] = {}
    for measured, modelled in pairs:
        table = level_differences(fleet, mounts, measured, modelled.load_case, band)
        table.insert(0, "load case", measured.name)
        tables.append(table)
        kept |= {f"{name} ({why})": None for name, why in modelled.measured.items()}
    return SurfaceCheck(pd.concat(tables, ignore_index=True), tuple(kept))


def level_differences(
    fleet: Fleet, mounts: Sequence[Mount], measured: LoadCase, modelled: LoadCase, band: Band
) -> pd.DataFrame:
    """Compare the pressure at each ear between two versions of a run.

    - `measured`, `modelled`: the same run with measured and with modelled forces.
    - `band`: lower and upper edge, both inside [Hz].
    - returns one row per vehicle: ``corr_f`` of the complex pressure, rms difference of SPL over
      all lines, number of booming peaks and of those that one curve has alone, largest difference
      at a peak with its frequency (nan where there is none). Peaks are paired by frequency; where
      one curve has none, its highest level nearby counts.
    - raises InputError: see `deboom.vehicles.fleet.path_contributions`.
    """
    both = [path_contributions(fleet, mounts, case, band) for case in (measured, modelled)]
    nominal = np.ones((1, len(both[0].variable_names)))
    first, second = (case.pressure(nominal)[0] for case in both)
    before, after = (spl(heard, both[0].frequency, axis=-1) for heard in (first, second))
    shape = corr_f(second.T, first.T)
    rows = []
    for vehicle, name in enumerate(fleet.names):
        changes = compare_peaks(before[vehicle], after[vehicle], both[0].frequency, measured.order)
        worst = max(changes, key=lambda c: abs(c.level_after - c.level_before), default=None)
        rows.append(
            {
                "vehicle": name,
                "corr_f [1]": float(shape[vehicle]),
                RMS: float(np.sqrt(np.mean((after - before)[vehicle] ** 2))),
                "peaks": len(changes),
                "peaks of one curve only": sum(not (c.before and c.after) for c in changes),
                PEAKS: abs(worst.level_after - worst.level_before) if worst else np.nan,
                "frequency of that peak [Hz]": worst.frequency if worst else np.nan,
            }
        )
    return pd.DataFrame(rows)


LIBRARY_FILE = "mounts.library.json"
"""Exported mount library in a platform folder."""
CATALOGUE_FILE = "catalogue.library.json"
"""Further parts in a platform folder, an exported mount library."""


class MountSource(Enum):
    """Where the forces of the mounts come from.

    ``library`` refuses lines outside of the region that a mount was measured in; at those lines
    ``library_inside`` takes the measured force.
    """

    library = "library"
    library_inside = "library-inside"
    spectra = "spectra"


@dataclass(frozen=True, eq=False)
class Operation:
    """The runs that a study is about, and who listens.

    - `platform`: with these runs, and every file that was read.
    - `fleet`: vehicles of the group.
    - `cases`: runs with their weights.
    - `band`: lower and upper edge, both inside [Hz].
    - `check`: surfaces against spectra; None if the forces are the measured ones.
    - `parts`: the library's mounts that the forces come from; empty if they are the measured ones.
    """

    platform: Platform
    fleet: Fleet
    cases: list[tuple[LoadCase, float]]
    band: Band
    check: SurfaceCheck | None
    parts: tuple[CharacterisedMount, ...] = ()

    @cached_property
    def not_coupled(self) -> str:
        """What coupled motion lacks in these data, in a sentence; empty if nothing."""
        platform = self.platform
        try:
            for case, _ in self.cases:
                coupled_motion(self.fleet, platform.mounts, platform.powertrain, case, self.band)
        except InputError as error:
            return f"These data do not allow coupled motion: {error}."
        return ""

    def characterised(self, mount: str, axis: str) -> CharacterisedDirection | None:
        """Return a direction of the library's mounts; None if it is not among them."""
        directions = (d for part in self.parts if part.mount.name == mount for d in part.directions)
        return next((one for one in directions if one.axis == axis), None)

    def identified(self, mount: str, axis: str) -> bool:
        """Whether a direction's stiffness is known well enough to be asked for in N/m."""
        known = self.characterised(mount, axis)
        return known is not None and known.surface is not None and known.quality.identified

    def stiffness(self, case: LoadCase, band: Band) -> RealArray:
        """Mean |K| of a run in a band by variable, shape (k,) [N/m]; nan: not measured."""
        mounts = self.platform.mounts
        return np.concatenate([mean_operating_stiffness(one, case, band) for one in mounts])

    def append_to(self, report: Report) -> None:
        """Add to a report how far surfaces and spectra agree, and print it on standard error.

        The report gets a table ``surface_check``, the key ``surface_difference_at_peaks_db``, a
        section, and a warning where they do not agree; nothing if forces are the measured ones. It
        also says what coupled motion lacks.
        """
        report.warn(self.not_coupled)
        if words := pieces_in_words(self.platform):
            report.facts["pieces"] = words
        if words := unidentified_in_words(self.platform, [case for case, _ in self.cases]):
            report.facts["not identified"] = words
        check = self.check
        if check is None:
            return
        print(check.text, file=sys.stderr)
        report.section(
            "Response surfaces against measured spectra",
            f"{check.text}\n\nPeaks are compared with peaks. Beside them, in a notch where paths "
            "cancel, a small change of one force is a large one of the level.",
            folded=True,
        )
        report.table("surface_check", check.table, "With today's mounts.", {"corr_f [1]": 5})
        report.summary["surface_difference_at_peaks_db"] = check.at_peaks
        if not check.agrees:
            report.warn(
                "Response surfaces and measured spectra are not shown to agree within "
                f"{PEAK_AGREEMENT:g} dB at booming peaks: look for the reason before you trust "
                "either."
            )


def operation(
    platform: Platform,
    requests: Sequence[str] | None,
    source: MountSource,
    group: str | None,
    band: Band,
) -> Operation:
    """Look up load cases and give them the forces of the mounts' response surfaces.

    - `platform`: as measured; its mount library lies beside its files, see `LIBRARY_FILE`.
    - `requests`: as for `deboom.study.options.weighted_load_cases`.
    - `source`: whether forces come from the library, and are compared with the measured ones.
    - `group`: vehicles to listen in; None: all of them.
    - `band`: lower and upper edge, both inside [Hz].
    - raises InputError: an unknown load case or group; a platform without a mount library; a run
      without engine torque, or with lines outside of the region that a mount was measured in.
    """
    fleet = platform.fleet if group is None else platform.fleet.group(group)
    cases = weighted_load_cases(platform, requests)
    if source is MountSource.spectra:
        return Operation(platform, fleet, cases, band, None)
    path = platform.folder / LIBRARY_FILE
    mounts = as_mounted(_library(path), platform.mounts)
    outside = Outside.REFUSE if source is MountSource.library else Outside.KEEP_MEASURED
    try:
        pairs = [(case, surface_forces(case, mounts, outside)) for case, _ in cases]
    except InputError as error:
        raise InputError(
            f"{path}: {error} (--mounts library-inside keeps the measured force at lines outside, "
            "--mounts spectra everywhere)"
        ) from None
    check = surface_check(fleet, platform.mounts, pairs, band)
    modelled = {case.name: forces.load_case for case, forces in pairs}
    changed = replace(
        platform,
        load_cases=tuple(modelled.get(case.name, case) for case in platform.load_cases),
        input_files=(*platform.input_files, path),
    )
    from_library = [(modelled[case.name], weight) for case, weight in cases]
    return Operation(changed, fleet, from_library, band, check, mounts)


DEMONSTRATION = shipped_studies() / "data" / "u06_f39_f45"
"""The virtual platform that every study runs with if no other is given."""
DEMONSTRATED = "U06"
"""Its group of vehicles that studies serve."""
BAND = (20.0, 60.0)
"""What the studies sum over by default; both edges belong to it [Hz]."""
BAND_DEFAULT = "20 60; all lines of data that begin above 20 or end below 60"


def study_band(platform: Platform) -> Band:
    """Return the lines that count by default: `BAND`, or all of data that do not span it [Hz]."""
    lines = platform.load_cases[0].force.frequency
    spans = lines[0] <= BAND[0] and lines[-1] >= BAND[1]
    return BAND if spans else (float(lines[0]), float(lines[-1]))


@dataclass(frozen=True)
class PlatformOptions:
    """Options of a study: whose noise, in which runs, and where the forces come from."""

    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None
    group: Annotated[
        str | None,
        Option(help="Vehicles to serve.", show_default=f"{DEMONSTRATED}, or the only one"),
    ] = ""
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = DEMONSTRATION
    band: Annotated[
        tuple[float, float] | None,
        Option(help="Lines that count, from and to [Hz].", show_default=BAND_DEFAULT),
    ] = None
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library

    def operation(self) -> Operation:
        """Read the platform and look up what was asked for; see `operation`."""
        platform = read_platform(self.platform)
        band = study_band(platform) if self.band is None else self.band
        served = self.served(platform.fleet)
        group = None if served is platform.fleet else served.vehicles[0].group
        return operation(platform, self.load_case, self.mounts, group, band)

    def served(self, fleet: Fleet) -> Fleet:
        """Return the vehicles of the group; of a platform with one group all, by default."""
        single = len({vehicle.group for vehicle in fleet.vehicles}) == 1
        if self.group is None or (single and not self.group):
            return fleet
        return fleet.group(self.group or DEMONSTRATED)


def _library(path: Path) -> tuple[CharacterisedMount, ...]:
    if not path.is_file():
        raise InputError(
            f"{path}: the platform has no mount library: export one there as JSON (deboom "
            "characterise, then deboom library export; a virtual platform: deboom bench write "
            "--library), or take the mounts from the measured spectra (--mounts spectra)"
        )
    return read_library_json(path)[1]


PART_WARNING = (
    "A stiffness factor means the rubber itself, with its stops where they were: a softer part "
    "rides deeper into its stop and most of the benefit is lost."
)


def motion_index(
    runs: Operation,
    motion: Motion,
    factor: Factor = Factor.dynamic,
    *,
    loss_factors: bool = False,
) -> BoomingModel:
    """Build the booming model of a study's runs under one model of the motion.

    - `factor`: what a stiffness factor means; the warning that ``part`` needs is printed.
    - `loss_factors`: whether the loss factors are variables, too.
    - raises InputError: options that do not go together, or data that do not fit together.
    """
    by_surface = motion is Motion.amplitude or factor is Factor.part
    if loss_factors and by_surface:
        raise InputError(
            "loss factors are variables with --motion prescribed or coupled and --factor dynamic: "
            "there the mounts stay where they are"
        )
    if factor is Factor.part and motion is Motion.prescribed:
        raise InputError(
            "a part that settles elsewhere moves otherwise too: --factor part goes with --motion "
            "coupled or amplitude"
        )
    if by_surface and not runs.parts:
        raise InputError(
            "amplitude-dependent motion and --factor part need the surfaces and static curves of "
            "the mount library: take --mounts library"
        )
    settling = None
    if factor is Factor.part:
        carriers = {mount.name for mount in runs.platform.mounts if mount.body_mass is None}
        settling = library_model([part for part in runs.parts if part.mount.name in carriers])
        print(PART_WARNING, file=sys.stderr)
    return booming_model(
        runs.fleet,
        runs.platform.mounts,
        runs.cases,
        runs.band,
        motion=motion,
        powertrain=runs.platform.powertrain,
        parts=runs.parts,
        settling=settling,
        loss_factors=loss_factors,
    )


MOTION_DEFAULT = "coupled; prescribed where the data do not allow it"


@dataclass(frozen=True)
class MotionOptions:
    """Options of a study: how the powertrain answers, and what a stiffness factor means."""

    motion: Annotated[
        Motion | None,
        Option(help="How the powertrain answers a design.", show_default=MOTION_DEFAULT),
    ] = None
    factor: Annotated[Factor, Option(help="What a stiffness factor means.")] = Factor.dynamic

    def index(self, runs: Operation, *, loss_factors: bool = False) -> BoomingModel:
        """Build the booming model of the runs; see `motion_index`."""
        motion = self.motion
        if motion is None:
            motion = Motion.prescribed if runs.not_coupled else Motion.coupled
        return motion_index(runs, motion, self.factor, loss_factors=loss_factors)


MOTION_WARNING = (
    "The powertrain's motion is prescribed: it stays as measured while stiffnesses change. Nothing "
    "says how much more or less a design does when the powertrain answers it."
)
FACTOR_WARNING = (
    "A stiffness factor scales the whole curve of dynamic stiffness over static force, with the "
    "stops re-tuned. A merely softer rubber in the same shape rides deeper into its stops and "
    "loses most of the benefit."
)


@dataclass(frozen=True)
class MotionReport:
    """Models behind a study's levels, in words and numbers.

    - `warnings`: for the top of the page; `text`: what was checked, may be empty.
    - `terms`: glossary entries that take the place of others.
    - `summary`: keys ``design_factor``, ``held_amplitude_share`` and ``held_preload_share``.
    """

    warnings: tuple[str, ...]
    text: str
    terms: dict[str, str]
    summary: dict[str, str | float]


def motion_name(index: BoomingModel) -> str:
    """In a word, how the powertrain answers a design."""
    name = index.motion.value
    return "amplitude-dependent" if index.motion is Motion.amplitude else str(name)


def factor_name(index: BoomingModel) -> str:
    """In a word, what a stiffness factor means."""
    return str(index.factor.value)


def motion_report(index: BoomingModel, designs: RealArray) -> MotionReport:
    """Check the models of a study at a few designs (n, k) [1], such as nominal and picks."""
    factor = factor_name(index)
    prescribed = (MOTION_WARNING,) if index.motion is Motion.prescribed else ()
    meaning = PART_WARNING if factor == Factor.part.value else FACTOR_WARNING
    summary: dict[str, str | float] = {"design_factor": factor}
    terms = {"prescribed motion": f"{motion_name(index)} motion"}
    if factor == Factor.part.value:
        terms["stiffness factor"] = "stiffness factor of a part"
    by_surface = [case for case in index.cases if isinstance(case, AmplitudeMotion)]
    if not by_surface:
        return MotionReport((*prescribed, meaning), "", terms, summary)
    held_amplitude, held_preload = index.clipped(designs)
    summary["held_amplitude_share"] = held_amplitude
    summary["held_preload_share"] = held_preload
    texts, alarms = [], []
    if index.motion is Motion.amplitude:
        texts.append(
            f"Of the lines and directions of today's mounts and the named designs, "
            f"{100 * held_amplitude:.1f} % have an amplitude beyond what the response surfaces "
            "are backed for; there the stiffness keeps its value at the bound."
        )
        for case in by_surface:
            several = ~(compare_starts(case, designs) <= SAME).all(axis=0)
            lines = case.frequency[several]
            if not several.any():
                texts.append(
                    f"Uniqueness: load case {case.load_case}: starts from {STARTS[0]:g} to "
                    f"{STARTS[-1]:g} m and from the line before give one solution."
                )
                continue
            alarms.append(
                f"load case {case.load_case}: starts from {STARTS[0]:g} to {STARTS[-1]:g} m and "
                f"from the line before do not give one solution at {lines.size} lines from "
                f"{lines[0]:g} to {lines[-1]:g} Hz: results there belong to the branch of the line "
                "before."
            )
    if factor == Factor.part.value:
        texts.append(
            f"{100 * held_preload:.1f} % have a static force beyond what the surfaces are "
            "backed for; there the stiffness of a powertrain mount follows the slope of its "
            "quasi-static curve, and that of a wishbone mount keeps its value at the bound. The "
            "stiffnesses named for the supplier are those at today's static deflection; under load "
            "the part rides elsewhere."
        )
    return MotionReport((meaning, *alarms), "\n\n".join(texts), terms, summary)


def platform_sha256(platform: Platform) -> str:
    """Return a hash over names and contents of every file that was read, in hexadecimal."""
    hashes = hash_files(platform.input_files, relative_to=platform.folder)
    joined = "\n".join(f"{name} {value}" for name, value in sorted(hashes.items()))
    return hashlib.sha256(joined.encode()).hexdigest()


@dataclass(frozen=True, eq=False)
class PlatformCheck:
    """What a check found.

    - `faults`: a sentence each; `waiting`: what could not be looked at because of them.
    - `platform`: what studies would read; None with a fault in its files.
    """

    faults: tuple[str, ...]
    waiting: tuple[str, ...]
    platform: Platform | None

    @property
    def summary(self) -> str:
        """What a platform without a fault holds, one item a line; empty with one."""
        if self.faults or self.platform is None:
            return ""
        return _aligned(list(_summary(self.platform)))


def _aligned(lines: Sequence[tuple[str, str]]) -> str:
    width = max(len(name) for name, _ in lines) + 2
    return "\n".join(f"{name:<{width}}{text}" for name, text in lines)


def check_folder(folder: Path) -> tuple[tuple[str, ...], tuple[str, ...], str]:
    """List what is wrong in a folder of any kind, or say what it holds.

    - `folder`: its file, such as ``campaign.toml``, says of which kind it is.
    - returns `faults`, `waiting`, `summary`: as in `PlatformCheck`.
    """
    from deboom.files.folders import FILES, kind_of_folder, summary_of

    faults: list[InputError] = []
    try:
        kind = kind_of_folder(folder)
        if kind is FolderKind.platform:
            found = check_platform(folder)
            return found.faults, found.waiting, found.summary
        load_toml(folder / FILES[kind][0], FILES[kind][1], faults.append)
        if faults:
            return tuple(map(str, faults)), ("the files that it names",), ""
        lines = list(summary_of(folder, kind))
        if kind is FolderKind.campaign:
            # sensors that do not allow a judgement are refused where mounts are characterised
            with suppress(InputError):
                judged = cross_stiffness_of_campaign(read_campaign(folder))
                lines += [("ALARM", sentence) for sentence in _alarms(judged)]
        return (), (), _aligned(lines)
    except InputError as error:
        return tuple(str(error).splitlines()), (), ""


def check_platform(folder: Path) -> PlatformCheck:
    """Read a platform folder to its end and list what is wrong.

    Parameters
    ----------
    folder : Path
        With ``platform.toml``.

    Returns
    -------
    PlatformCheck
        Beyond what `deboom.files.platform.read_platform` refuses: mounts that would be active, a
        mount library that does not fit.

    Raises
    ------
    InputError
        Never for a fault of the platform: faults are in the result.

    Examples
    --------
    >>> import deboom
    >>> from pathlib import Path
    >>> deboom.check_platform(Path("nowhere")).faults[0]
    'nowhere: there is no such folder: `deboom new platform nowhere` writes one'
    """
    faults: list[InputError] = []
    waiting: list[str] = []
    platform = None
    if not folder.is_dir():
        sentence = f"{folder}: there is no such folder: `deboom new platform {folder}` writes one"
        return PlatformCheck((sentence,), (), None)
    with noting(faults.append):
        file = load_toml(folder / PLATFORM_FILE, PlatformFile, faults.append)
        contents = read_contents(folder, file, faults.append)
        if contents.mounts is None:
            waiting.append("whether the tables fit the mounts")
        if not contents.channels:
            waiting.append("whether the files hold the channels")
        if faults:
            waiting.append("signs, frequency band and mount library")
        else:
            platform = assembled(folder, file, contents)
    if platform is not None:
        for case in platform.load_cases:
            with noting(faults.append):
                refuse_active_mounts(in_mount_axes(platform.mounts, case))
        band = study_band(platform)
        if not faults and (folder / LIBRARY_FILE).exists():
            with noting(faults.append):
                every = [case.name for case in platform.load_cases]
                operation(platform, every, MountSource.library_inside, None, band)
    sentences = dict.fromkeys(str(fault) for fault in faults)
    return PlatformCheck(tuple(sentences), tuple(waiting), platform)


def _summary(platform: Platform) -> Iterator[tuple[str, str]]:
    case = platform.load_cases[0]
    lines = case.force.frequency
    band = study_band(platform)
    inside = lines[(lines >= band[0]) & (lines <= band[1])]
    rpm = rpm_of_frequency(inside[[0, -1]], case.order)
    variables = sum(len(mount.variables) for mount in platform.mounts)
    groups = dict.fromkeys(vehicle.group for vehicle in platform.fleet.vehicles)
    steps = np.diff(lines)
    even = np.ptp(steps) <= 1e-3 * steps.mean()
    yield "platform", f"{platform.name}: {platform.title}"
    engine = (
        f"engine of {platform.cylinders} cylinders"
        if platform.cylinders
        else "electric drive, because [engine] states no cylinders"
    )
    yield "drive", engine
    yield (
        "mounts",
        f"{len(platform.mounts)}, {variables} variables: "
        + ", ".join(
            mount.name
            + (f" ({', '.join(mount.pieces)})" if len(mount.pieces) > 1 else "")
            + f" {''.join(mount.transfer_axes) or 'no path'}"
            for mount in platform.mounts
        ),
    )
    if words := pieces_in_words(platform):
        yield "pieces", words
    if words := unidentified_in_words(platform, platform.load_cases):
        yield "not identified", words
    for sentence in _alarms(cross_stiffness_of_runs(platform.mounts, platform.load_cases)):
        yield "ALARM", sentence
    for group in groups:
        names = [one.name for one in platform.fleet.vehicles if one.group == group]
        yield "vehicles", f"{len(names)} in group {group}: {', '.join(names)}"
    yield (
        "lines",
        f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz, "
        + (f"every {steps.mean():.4g} Hz" if even else "unevenly spaced"),
    )
    for one in platform.load_cases:
        default = " (default)" if one.name == platform.default_load_case else ""
        torque = "with engine torque" if one.engine_torque is not None else "no engine torque"
        yield "load case", f"{one.name}{default}: {one.title}; gear {one.gear}, {torque}"
    yield (
        "band",
        f"{inside.size} lines in {band[0]:g} to {band[1]:g} Hz: {rpm[0]:.0f} to {rpm[1]:.0f} rpm "
        f"of order {case.order:g}",
    )
    for name, sizes in _sizes(platform).items():
        yield name, RANGES[name].sentence(float(np.min(sizes)), float(np.max(sizes)))
    if (platform.folder / LIBRARY_FILE).exists():
        yield "library", f"{LIBRARY_FILE} fits all mounts"
    else:
        yield "library", f"no {LIBRARY_FILE}: studies need --mounts spectra"


def _alarms(judged: Sequence[CrossStiffness]) -> list[str]:
    """Return a sentence for each mount that seems to stand at an angle that is not stated."""
    return [one.sentence for one in judged if one.clear]


def pieces_in_words(platform: Platform) -> str:
    """Say whether the pieces of a mount keep their own noise transfer functions."""
    inputs = platform.fleet.vehicles[0].noise_transfer.inputs
    words = []
    for mount in platform.mounts:
        if len(mount.pieces) > 1 and mount.paths:
            apart = set(mount.channels(mount.transfer_axes[0])) <= set(inputs)
            words.append(
                f"{mount.name}: each piece with its own noise transfer function"
                if apart
                else f"{mount.name}: one noise transfer function times the summed forces of its "
                "pieces, right only where these are alike"
            )
    return "; ".join(words)


def unidentified_in_words(platform: Platform, load_cases: Sequence[LoadCase]) -> str:
    """Name the mount directions that hardly move; empty where all of them do."""
    along = [in_mount_axes(platform.mounts, case) for case in load_cases]
    cases = {case.name: not_identified(case) for case in along}
    words = [f"{', '.join(names)} ({case})" for case, names in cases.items() if names]
    if not words:
        return ""
    return (
        f"{'; '.join(words)}: hardly moves, so that force and displacement do not go together; the "
        "force counts as measured, the stiffness is not known"
    )


def _sizes(platform: Platform) -> dict[str, RealArray]:
    """Return magnitudes of what was measured: of a channel, the median over its lines."""
    cases = platform.load_cases
    forces = [np.median(np.abs(case.force.values), axis=0) for case in cases]
    motions = [np.median(np.abs(case.displacement.values), axis=0) for case in cases]
    vehicles = platform.fleet.vehicles
    transfer = [np.median(np.abs(each.noise_transfer.values), axis=0) for each in vehicles]
    levels = []
    for case in cases:
        paths = path_contributions(platform.fleet, platform.mounts, case, study_band(platform))
        pressure = paths.pressure(np.ones((1, len(paths.variable_names))))[0]
        levels.append(spl(pressure, paths.frequency, axis=-1).max(axis=-1))
    sizes = {
        "position": np.abs([place for mount in platform.mounts for place in mount.positions]),
        "displacement": np.concatenate(motions),
        "force": np.concatenate(forces),
        "stiffness": np.concatenate([f / s for f, s in zip(forces, motions, strict=True)]),
        "noise transfer function": np.concatenate(transfer, axis=None),
        "level": np.concatenate(levels),
    }
    torques = [np.abs(case.engine_torque) for case in cases if case.engine_torque is not None]
    return sizes | ({"engine torque": np.concatenate(torques)} if torques else {})


def in_all_load_cases(
    platform: PlatformOptions, runs: Operation, motion: MotionOptions, *, loss_factors: bool = False
) -> BoomingModel | None:
    """Return the model of a study in all load cases; None where their data do not allow it."""
    names = [case.name for case in runs.platform.load_cases]
    source = platform.mounts
    if source is MountSource.library:
        source = MountSource.library_inside
    try:
        every = replace(platform, load_case=names, mounts=source).operation()
        return motion.index(replace(every, fleet=runs.fleet), loss_factors=loss_factors)
    except InputError:
        return None
