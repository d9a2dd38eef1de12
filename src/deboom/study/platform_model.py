"""From the options of a study to the booming model of a platform, and what is to say about it."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator
from typer import Option

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.check import band_in_words, pieces_in_words, unidentified_in_words
from deboom.files.platform import DEMONSTRATION, read_platform
from deboom.report import Report
from deboom.vehicles.amplitude_motion import SAME, STARTS, AmplitudeMotion, compare_starts
from deboom.vehicles.booming_model import BoomingModel, Motion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.platform import MountSource, Runs
from deboom.vehicles.surface_check import PEAK_AGREEMENT

DEMONSTRATED = "U06"
"""Its group of vehicles that studies serve."""
ALL = "all"
"""All groups of a platform, as --group has it."""
BAND_DEFAULT = "20 60; all lines of data that miss 20 or 60 by a line or more"


def _listed_groups(recorded: Any) -> Any:
    """Return the groups of a run's record; up to 0.2.0 it was one, or an empty text."""
    return [recorded] * bool(recorded) if isinstance(recorded, str) else recorded


@dataclass(frozen=True)
class PlatformOptions:
    """Options of a study: whose noise, in which runs, and where the forces come from.

    Of the groups None means all, and no group the one that the platform was made for.
    """

    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None
    group: Annotated[
        list[str] | None,
        BeforeValidator(_listed_groups),
        Option(
            help=f"Vehicles to serve; repeatable, or '{ALL}'.",
            show_default=f"{DEMONSTRATED}, or the only one",
        ),
    ] = field(default_factory=list)
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = DEMONSTRATION
    band: Annotated[
        tuple[float, float] | None,
        Option(help="Lines that count, from and to [Hz].", show_default=BAND_DEFAULT),
    ] = None
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library

    def runs(self) -> Runs:
        """Read the platform and look up the runs; see `deboom.vehicles.platform.Platform.runs`."""
        platform = read_platform(self.platform)
        fleet = self.served(platform.fleet)
        return platform.runs(self.load_case, fleet=fleet, mounts=self.mounts, band=self.band)

    def served(self, fleet: Fleet) -> Fleet:
        """Return the vehicles of the groups; of a platform with one group all, by default."""
        single = len({vehicle.group for vehicle in fleet.vehicles}) == 1
        if self.group is None or ALL in self.group or (single and not self.group):
            return fleet
        return fleet.group(*(self.group or [DEMONSTRATED]))


PART_WARNING = (
    "A stiffness factor means the rubber itself, with its stops where they were: a softer part "
    "rides deeper into its stop and most of the benefit is lost."
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

    def model(self, runs: Runs, *, loss_factors: bool = False) -> BoomingModel:
        """Build the booming model of the runs; the warning that ``part`` needs is printed."""
        model = runs.model(self.motion, self.factor, loss_factors=loss_factors)
        if self.factor is Factor.part:
            print(PART_WARNING, file=sys.stderr)
        return model


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


def report_runs(report: Report, runs: Runs) -> None:
    """Add to a report how far surfaces and spectra agree, and print it on standard error.

    The report gets a table ``surface_check``, the key ``surface_difference_at_peaks_db``, a
    section, and a warning where they do not agree; nothing if forces are the measured ones. It
    also says what coupled motion lacks.
    """
    report.warn(runs.not_coupled)
    report.warn(band_in_words(runs.platform, runs.band))
    if words := pieces_in_words(runs.platform):
        report.facts["pieces"] = words
    if words := unidentified_in_words(runs.platform, [case for case, _ in runs.cases]):
        report.facts["not identified"] = words
    check = runs.check
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


def in_all_load_cases(
    platform: PlatformOptions, runs: Runs, motion: MotionOptions, *, loss_factors: bool = False
) -> BoomingModel | None:
    """Return the model of a study in all load cases; None where their data do not allow it."""
    names = [case.name for case in runs.platform.load_cases]
    source = platform.mounts
    if source is MountSource.library:
        source = MountSource.library_inside
    try:
        every = replace(platform, load_case=names, mounts=source).runs()
        return motion.model(replace(every, fleet=runs.fleet), loss_factors=loss_factors)
    except InputError:
        return None
