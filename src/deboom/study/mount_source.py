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
from deboom.mounts.surface_forces import Outside, surface_forces
from deboom.report.page import Section, Table
from deboom.study.load_cases import weighted_load_cases
from deboom.study.result import StudyResult
from deboom.study.surface_check import PEAK_AGREEMENT, SurfaceCheck, surface_check
from deboom.vehicles.fleet import Band, Fleet

LIBRARY_FILE = "mounts.library.json"
"""Exported mount library in a platform folder."""


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

    Parameters
    ----------
    platform : Platform
        With these runs, and every file that was read.
    fleet : Fleet
        Vehicles of the group.
    cases : list of (LoadCase, float)
        Runs with their weights.
    band : (lower, upper)
        Both edges belong to the band [Hz].
    check : SurfaceCheck or None
        Surfaces against spectra; None if the forces are the measured ones.
    parts : tuple of CharacterisedMount
        The library's mounts that the forces come from; empty if they are the measured ones.
    """

    platform: Platform
    fleet: Fleet
    cases: list[tuple[LoadCase, float]]
    band: Band
    check: SurfaceCheck | None
    parts: tuple[CharacterisedMount, ...] = ()

    def checked(self, result: StudyResult) -> StudyResult:
        """Add to a study's result how far surfaces and spectra agree, and print it.

        Parameters
        ----------
        result : StudyResult
            Of a study of these runs.

        Returns
        -------
        StudyResult
            With a table ``surface_check``, the key ``surface_difference_at_peaks_db`` and a section
            on the page, which warns where they do not agree; unchanged without a check.

        Notes
        -----
        Printed on standard error, at the end: bad input is to give one sentence and no more.
        """
        check = self.check
        if check is None:
            return result
        print(check.text, file=sys.stderr)
        section = Section(
            "Response surfaces against measured spectra",
            f"{check.text}\n\nPeaks are compared with peaks. Beside them, in a notch where paths "
            "cancel, a small change of one force is a large one of the level.",
            tables=(Table(check.table, "With today's mounts.", {"corr_f [1]": 5}),),
        )
        page = replace(result.page, sections=(*result.page.sections, section))
        if not check.agrees:
            warning = (
                "Response surfaces and measured spectra are not shown to agree within "
                f"{PEAK_AGREEMENT:g} dB at booming peaks: look for the reason before you trust "
                "either."
            )
            page = replace(page, warnings=(*page.warnings, warning))
        return replace(
            result,
            tables={**result.tables, "surface_check": check.table},
            summary={**result.summary, "surface_difference_at_peaks_db": check.at_peaks},
            page=page,
        )


def operation(
    platform: Platform,
    requests: Sequence[str] | None,
    source: MountSource,
    group: str | None,
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
        Whether forces come from the library, and are compared with the measured ones, or stay as
        measured.
    group : str or None
        Vehicles to listen in; None: all of them.
    band : (lower, upper)
        Both edges belong to the band [Hz].

    Raises
    ------
    InputError
        An unknown load case or group; a platform without a mount library; a run without engine
        torque, or with lines outside of the region that a mount was measured in.
    """
    fleet = platform.fleet if group is None else platform.fleet.group(group)
    cases = weighted_load_cases(platform, requests)
    if source is MountSource.spectra:
        return Operation(platform, fleet, cases, band, None)
    path = platform.folder / LIBRARY_FILE
    mounts = _library(path)
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


def _library(path: Path) -> tuple[CharacterisedMount, ...]:
    if not path.is_file():
        raise InputError(
            f"{path}: the platform has no mount library: export one there as JSON (deboom "
            "characterise, then deboom library export; a virtual platform: deboom bench write "
            "--library), or take the mounts from the measured spectra (--mounts spectra)"
        )
    return read_library_json(path)[1]
