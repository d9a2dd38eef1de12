"""The sound of a running compressor at the ear, and how far it is from the measured one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.arrays import BoolArray, ComplexArray, RealArray
from deboom.compressor.cabin_noise import NoiseBand, SweepNoise
from deboom.measurement.booming_peaks import MatchedPeaks, booming_peaks, match_peaks
from deboom.measurement.compressor_test import HoseState
from deboom.physics.sound_level import a_weighting, energy_sum

ORDER = 1.0
"""Unbalance turns with the rotor."""
MODES = (25.0, 35.0)
"""Around the rigid-body modes, where the thesis's synthesis fails; left out as it does [Hz]."""
HOSE_BAND = (90.0, 140.0)
"""Where the thesis hears the hoses [Hz]."""
QUIET_BAND = (20.0, 80.0)
"""Where the thesis hears no hoses [Hz]."""
RANKED = (QUIET_BAND, HOSE_BAND)
"""Bands of the ranking [Hz]."""
SAME_PRESSURE = 0.02


@dataclass(frozen=True, eq=False)
class CarNoise:
    """Sound at the ear of one car: synthesised, measured, and how far it may be off.

    - `seed`: of the laboratory that measured a virtual car.
    - `bands`: of the same sweeps.
    - `alarms`: reasons not to trust it.
    - `seconds`: from files to result, of one processor [s].
    - `floor`: noise in a tracked pressure of a virtual car, complex peak, root mean square [Pa].
    """

    car: str
    seed: int | None
    sweeps: tuple[SweepNoise, ...]
    bands: tuple[NoiseBand, ...]
    alarms: tuple[str, ...]
    seconds: float
    floor: float | None = None


@dataclass(frozen=True, eq=False)
class SweepErrors:
    """How far a synthesis is from the measured sound of one sweep.

    - `peaks`, `peaks_by_mounts`: of the measured level with that of all paths, and of the mounts'.
    - `lines`, `lines_by_mounts` (n_frequency,): synthesised minus measured level [dB].
    - `complete`: whether no path was left out.
    - `inside`: share of the louder half of the lines at which the measured level lies within the
      band of the synthesis [1].
    - `hose_band`, `hose_band_by_mounts`: level of the energy in `HOSE_BAND`, synthesised minus
      measured [dB]; nan where the sweep does not reach it.
    """

    car: str
    seed: int | None
    sweep: str
    hoses: HoseState
    frequency: RealArray
    peaks: MatchedPeaks
    peaks_by_mounts: MatchedPeaks
    lines: RealArray
    lines_by_mounts: RealArray
    complete: bool
    inside: float
    hose_band: float
    hose_band_by_mounts: float


def sweep_errors(case: CarNoise) -> tuple[SweepErrors, ...]:
    """Compare every sweep of a car with what was measured."""
    return tuple(
        _errors(case, noise, band) for noise, band in zip(case.sweeps, case.bands, strict=True)
    )


def peak_deviations(
    errors: Sequence[SweepErrors],
    hoses: HoseState,
    *,
    only: tuple[float, float] | None = None,
    without: tuple[float, float] | None = None,
    by_mounts: bool = False,
) -> RealArray:
    """Return synthesised minus measured level at the measured peaks that have a partner (n,) [dB].

    - `hoses`: of the sweeps that count; `by_mounts`: of the mounts' paths alone.
    - `only`, `without`: bands of the measured peaks that count, and that do not [Hz].
    """
    deviations = [
        other.level - peak.level
        for sweep in errors
        if sweep.hoses is hoses
        for peak, other in (sweep.peaks_by_mounts if by_mounts else sweep.peaks).pairs
        if (only is None or only[0] <= peak.frequency <= only[1])
        and (without is None or not without[0] <= peak.frequency <= without[1])
    ]
    return np.array(deviations, dtype=float)


def in_band(frequency: RealArray, band: tuple[float, float]) -> BoolArray:
    """Mark lines of a band, shape (n_frequency,)."""
    return np.asarray((frequency >= band[0]) & (frequency <= band[1]))


def band_level(noise: SweepNoise, pressure: ComplexArray) -> float:
    """Level of the energy in `HOSE_BAND`, nan where the sweep has no line there [dB(A)]."""
    lines = in_band(noise.frequency, HOSE_BAND)
    return float(energy_sum(noise.level(pressure)[lines])) if lines.any() else float("nan")


def soft_partner(case: CarNoise, standard: SweepNoise) -> SweepNoise | None:
    """Return the sweep with soft hoses at the pressure of one with standard hoses."""
    for noise in case.sweeps:
        near = abs(noise.pressure / standard.pressure - 1) < SAME_PRESSURE
        same = np.array_equal(noise.frequency, standard.frequency)
        if noise.hoses is HoseState.SOFT and near and same:
            return noise
    return None


def _errors(case: CarNoise, noise: SweepNoise, band: NoiseBand) -> SweepErrors:
    lines = noise.frequency
    measured, total = noise.level(noise.measured), noise.level(noise.total)
    by_mounts = noise.level(noise.by_mounts)
    loud = measured >= np.median(measured)
    reference = booming_peaks(measured, lines, ORDER)
    return SweepErrors(
        car=case.car,
        seed=case.seed,
        sweep=noise.sweep,
        hoses=noise.hoses,
        frequency=lines,
        peaks=match_peaks(reference, booming_peaks(total, lines, ORDER)),
        peaks_by_mounts=match_peaks(reference, booming_peaks(by_mounts, lines, ORDER)),
        lines=total - measured,
        lines_by_mounts=by_mounts - measured,
        complete=noise.complete,
        inside=float(np.mean(((measured >= band.lower) & (measured <= band.upper))[loud])),
        hose_band=band_level(noise, noise.total) - band_level(noise, noise.measured),
        hose_band_by_mounts=band_level(noise, noise.by_mounts) - band_level(noise, noise.measured),
    )


@dataclass(frozen=True, eq=False)
class DrawnCar:
    """What hoses do in a car of a drawn fleet, by the bench's coupled solution.

    - `frequency` (n_frequency,): frequency of the rotation [Hz].
    - `with_hoses`, `without_hoses` (n_frequency,): level at the driver's ear with the hoses joined
      and with long soft ones [dB(A)].
    """

    fleet: int
    car: str
    frequency: RealArray
    with_hoses: RealArray
    without_hoses: RealArray

    @property
    def gain(self) -> float:
        """Level of the energy in `HOSE_BAND` with hoses minus that without [dB]."""
        lines = in_band(self.frequency, HOSE_BAND)
        return float(energy_sum(self.with_hoses[lines]) - energy_sum(self.without_hoses[lines]))

    @property
    def changes_in_quiet_band(self) -> RealArray:
        """Size of what hoses change at each line in `QUIET_BAND` [dB]."""
        lines = in_band(self.frequency, QUIET_BAND)
        return np.abs(self.with_hoses[lines] - self.without_hoses[lines])


def ranking(noise: SweepNoise) -> pd.DataFrame:
    """Rank mounts and hoses of one sweep by their part of the sound.

    A part is ``Σ w Re(p_i p*) / Σ w |p|²`` with the A-weighting w: parts of all points add up to 1,
    and a point that works against the others has a negative one.
    """
    rows: list[dict[str, object]] = []
    points, total = noise.by_point, noise.total
    for band in RANKED:
        lines = in_band(noise.frequency, band)
        if not lines.any():
            continue
        weight = 10 ** (a_weighting(noise.frequency[lines]) / 10)
        sound, parts = total[lines], points[lines]
        energy = weight @ np.abs(sound) ** 2
        part = weight @ (parts * np.conj(sound)[:, np.newaxis]).real / energy
        without = weight @ np.abs(sound[:, np.newaxis] - parts) ** 2
        alone = energy_sum(noise.level(points)[lines])
        for place in np.argsort(-part):
            rows.append(
                {
                    "sweep": noise.sweep,
                    "band": band_words(band),
                    "point": noise.points[place],
                    "part of the sound [%]": 100 * float(part[place]),
                    "alone [dB(A)]": float(alone[place]),
                    "cut, the level changes by [dB]": float(10 * np.log10(without[place] / energy)),
                }
            )
    return pd.DataFrame(rows)


def band_words(band: tuple[float, float]) -> str:
    """Write a band."""
    return f"{band[0]:g}–{band[1]:g} Hz"


def measured_gain_table(case: CarNoise) -> pd.DataFrame:
    """Compare sweeps with standard and with soft hoses, measured as synthesised (figure 66)."""
    rows = []
    for sweep in case.sweeps:
        soft = soft_partner(case, sweep) if sweep.hoses is HoseState.STANDARD else None
        if soft is not None and in_band(sweep.frequency, HOSE_BAND).any():
            gains = {
                f"{name} gain [dB]": band_level(sweep, getattr(sweep, field))
                - band_level(soft, getattr(soft, field))
                for name, field in (("measured", "measured"), ("synthesised", "total"))
            }
            rows.append({"pressure [bar]": 1e-5 * sweep.pressure, **gains})
    return pd.DataFrame(rows)
