"""Where a study's mounts come from: the mount library's surfaces, or the spectra of the runs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from deboom.errors import InputError
from deboom.files.library_export import read_library_json
from deboom.files.platform import Platform
from deboom.measurement.load_case import LoadCase
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.surface_forces import surface_forces
from deboom.report.page import Section, Table
from deboom.study.load_cases import weighted_load_cases
from deboom.study.result import StudyResult
from deboom.study.surface_check import PEAK_AGREEMENT, SurfaceCheck, surface_check
from deboom.vehicles.fleet import Band, Fleet

LIBRARY_FILE = "mounts.library.json"
"""Exported mount library in a platform folder."""


class MountSource(Enum):
    """Where the forces of the mounts come from."""

    library = "library"
    spectra = "spectra"


@dataclass(frozen=True, eq=False)
class Operation:
    """The runs that a study is about.

    Parameters
    ----------
    platform : Platform
        With these runs, and every file that was read.
    cases : list of (LoadCase, float)
        Runs with their weights.
    check : SurfaceCheck or None
        Surfaces against spectra; None if the forces are the measured ones.
    """

    platform: Platform
    cases: list[tuple[LoadCase, float]]
    check: SurfaceCheck | None


def operation(
    platform: Platform,
    requests: Sequence[str] | None,
    source: MountSource,
    fleet: Fleet,
    band: Band,
) -> Operation:
    """Look up load cases and give them the forces of the mounts' response surfaces.

    Parameters
    ----------
    platform : Platform
        As measured. Its mount library lies beside its files, see `LIBRARY_FILE`.
    requests : sequence of str or None
        As for `deboom.study.load_cases.weighted_load_cases`.
    source : MountSource
        Whether forces come from the library or stay as measured.
    fleet : Fleet
        Vehicles in which both are compared; the outcome is printed on standard error.
    band : (lower, upper)
        Of that comparison [Hz].

    Raises
    ------
    InputError
        An unknown load case; a platform without a mount library; a line outside of the region
        that a mount was measured in.
    """
    cases = weighted_load_cases(platform, requests)
    if source is MountSource.spectra:
        return Operation(platform, cases, None)
    path = platform.folder / LIBRARY_FILE
    mounts = _library(path)
    pairs = [(case, surface_forces(case, mounts)) for case, _ in cases]
    check = surface_check(fleet, platform.mounts, pairs, band)
    print(check.text, file=sys.stderr)
    modelled = {case.name: forces.load_case for case, forces in pairs}
    changed = replace(
        platform,
        load_cases=tuple(modelled.get(case.name, case) for case in platform.load_cases),
        input_files=(*platform.input_files, path),
    )
    return Operation(changed, [(modelled[case.name], weight) for case, weight in cases], check)


def _library(path: Path) -> tuple[CharacterisedMount, ...]:
    if not path.is_file():
        raise InputError(
            f"{path}: the platform has no mount library: export one there as JSON, or take the "
            "mounts from the measured spectra (--mounts spectra)"
        )
    return read_library_json(path)[1]


def with_check(result: StudyResult, check: SurfaceCheck | None) -> StudyResult:
    """Add to a study's result how far surfaces and spectra agree.

    Parameters
    ----------
    result : StudyResult
        Of a study whose runs are those of an `Operation`.
    check : SurfaceCheck or None
        The operation's; None leaves the result as it is.

    Returns
    -------
    StudyResult
        With a table ``surface_check``, the key ``surface_difference_at_peaks_db`` and a section on
        the page, which warns where they do not agree.
    """
    if check is None:
        return result
    section = Section(
        "Response surfaces against measured spectra",
        f"{check.text}\n\nPeaks are compared with peaks. Beside them, in a notch where paths "
        "cancel, a small change of one force is a large one of the level.",
        tables=(Table(check.table, "With today's mounts.", {"corr_f [1]": 5}),),
    )
    page = replace(result.page, sections=(*result.page.sections, section))
    if not check.agrees:
        warning = (
            f"Response surfaces and measured spectra differ by {check.at_peaks:.2f} dB at a "
            f"booming peak, more than {PEAK_AGREEMENT:g} dB: look for the reason before you trust "
            "either."
        )
        page = replace(page, warnings=(*page.warnings, warning))
    return replace(
        result,
        tables={**result.tables, "surface_check": check.table},
        summary={**result.summary, "surface_difference_at_peaks_db": check.at_peaks},
        page=page,
    )
