"""Levels with forces from response surfaces against those with measured forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.measurement.booming_peaks import compare_peaks
from deboom.measurement.channels import Band, LoadCase
from deboom.mounts.mount import Mount
from deboom.mounts.surface_forces import SurfaceForces
from deboom.physics.frf import corr_f
from deboom.physics.sound_level import spl
from deboom.vehicles.fleet import Fleet, path_contributions

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
        worst = max(changes, key=lambda c: abs(c.change), default=None)
        rows.append(
            {
                "vehicle": name,
                "corr_f [1]": float(shape[vehicle]),
                RMS: float(np.sqrt(np.mean((after - before)[vehicle] ** 2))),
                "peaks": len(changes),
                "peaks of one curve only": sum(not (c.before and c.after) for c in changes),
                PEAKS: abs(worst.change) if worst else np.nan,
                "frequency of that peak [Hz]": worst.frequency if worst else np.nan,
            }
        )
    return pd.DataFrame(rows)
