"""How the powertrain answers a design and where forces come from, on the page of a study."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from deboom.arrays import RealArray
from deboom.report import Report
from deboom.vehicles.amplitude_motion import SAME, STARTS, AmplitudeMotion, compare_starts
from deboom.vehicles.booming_model import BoomingModel, Motion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.platform import Runs
from deboom.vehicles.surface_check import PEAK_AGREEMENT

PART_WARNING = (
    "A stiffness factor means the rubber itself, with its stops where they were: a softer part "
    "rides deeper into its stop and most of the benefit is lost."
)


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
    - `factor`: what a stiffness factor means.
    - `held_amplitude`, `held_preload`: shares beyond what response surfaces are backed for [1];
      None without surfaces.
    """

    warnings: tuple[str, ...]
    text: str
    terms: dict[str, str]
    factor: str
    held_amplitude: float | None = None
    held_preload: float | None = None

    def report_numbers(self, report: Report) -> None:
        """Say what a stiffness factor means, and which shares lie beyond the response surfaces."""
        report.number("design_factor", self.factor, "", "what a stiffness factor means")
        if self.held_amplitude is not None:
            report.number(
                "held_amplitude_share",
                self.held_amplitude,
                "1",
                "share of the lines and directions whose amplitude lies beyond the surfaces' data",
            )
            report.number(
                "held_preload_share",
                self.held_preload,
                "1",
                "share of the static forces that lie beyond the surfaces' data",
            )


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
    terms = {"prescribed motion": f"{motion_name(index)} motion"}
    if factor == Factor.part.value:
        terms["stiffness factor"] = "stiffness factor of a part"
    by_surface = [case for case in index.cases if isinstance(case, AmplitudeMotion)]
    if not by_surface:
        return MotionReport((*prescribed, meaning), "", terms, factor)
    held_amplitude, held_preload = index.clipped(designs)
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
    return MotionReport(
        warnings=(meaning, *alarms),
        text="\n\n".join(texts),
        terms=terms,
        factor=factor,
        held_amplitude=held_amplitude,
        held_preload=held_preload,
    )


def report_runs(report: Report, runs: Runs) -> None:
    """Add to a report how far surfaces and spectra agree, and print it on standard error.

    The report gets a table ``surface_check``, a number, a section, and a warning where they do not
    agree; nothing if forces are the measured ones. It also says on which defaults the forces rest,
    what coupled motion lacks, and which receivers are not judged.
    """
    report.assume(*runs.assumed)
    report.warn(runs.not_coupled, runs.not_judged)
    # not above: it imports the readers of every kind of folder, for which a model alone would wait
    from deboom.files.check import (
        band_in_words,
        bodies_in_words,
        brackets_in_words,
        pieces_in_words,
        rubber_in_words,
        unidentified_in_words,
    )

    report.warn(band_in_words(runs.platform, runs.band))
    if words := bodies_in_words(runs.platform):
        report.facts["bodies"] = words
    if words := rubber_in_words(runs.platform):
        report.facts["rubber"] = f"stiffness in the car over that in the test: {words}"
    if words := brackets_in_words(runs.platform):
        report.facts["brackets"] = words
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
    # a table of what agrees is a file alone
    caption = (
        ""
        if check.agrees
        else "With today's mounts. corr_f: difference in shape of the complex pressures, 0 is none."
    )
    report.table("surface_check", check.table, caption, {"corr_f [1]": 5})
    report.number(
        "surface_difference_at_peaks_db",
        check.at_peaks,
        "dB",
        "largest difference of booming peaks: forces by the response surfaces against spectra",
    )
    if not check.agrees:
        report.warn(
            "Response surfaces and measured spectra are not shown to agree within "
            f"{PEAK_AGREEMENT:g} dB at booming peaks: look for the reason before you trust "
            "either."
        )
