"""Synthesised against measured levels of a running compressor: at peaks, lines and in bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.measurement.operating_sweep import HoseState
from deboom.physics.sound_level import energy_sum
from deboom.vehicles.booming_peaks import booming_peaks, match_peaks

if TYPE_CHECKING:
    from deboom.arrays import ComplexArray, RealArray
    from deboom.compressor.cabin_noise import SweepNoise
    from deboom.compressor.cabin_noise_band import NoiseBand
    from deboom.study.compressor_noise import CarNoise
    from deboom.vehicles.booming_peaks import MatchedPeaks

ORDER = 1.0
"""Unbalance turns with the rotor."""
MODES = (25.0, 35.0)
"""Around the rigid-body modes, where the thesis's synthesis fails; left out as it does [Hz]."""
HOSE_BAND = (90.0, 140.0)
"""Where the thesis hears the hoses [Hz]."""
SAME_PRESSURE = 0.02


@dataclass(frozen=True, eq=False)
class SweepErrors:
    """How far a synthesis is from the measured sound of one sweep.

    Parameters
    ----------
    car, sweep : str
    seed : int or None
    hoses : HoseState
        Of the sweep.
    peaks, peaks_by_mounts : MatchedPeaks
        Of the measured level with that of all paths, and of the mounts' paths alone.
    lines, lines_by_mounts : array, shape (n_frequency,)
        Synthesised minus measured level [dB].
    frequency : array, shape (n_frequency,)
        [Hz].
    still_body, predicted_body : array, shape (n_frequency,)
        Level without the motion of the body, and with the predicted one, minus that with the
        measured one [dB].
    complete : bool
        Whether no path was left out.
    inside : float
        Share of the louder half of the lines at which the measured level lies within the band of
        the synthesis; noise of the microphone, which the band has not, fills the notches [1].
    hose_band, hose_band_by_mounts : float
        Level of the energy in `HOSE_BAND`, synthesised minus measured, by all paths and by the
        mounts' alone [dB]; nan where the sweep does not reach it.
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
    still_body: RealArray
    predicted_body: RealArray
    complete: bool
    inside: float
    hose_band: float
    hose_band_by_mounts: float


def sweep_errors(case: CarNoise) -> tuple[SweepErrors, ...]:
    """Compare every sweep of a car.

    Parameters
    ----------
    case : CarNoise

    Returns
    -------
    tuple of SweepErrors
    """
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
    """Collect level deviations at the measured peaks that have a partner.

    Parameters
    ----------
    errors : sequence of SweepErrors
    hoses : HoseState
        Of the sweeps that count.
    only, without : (float, float), optional
        Bands of the measured peaks that count, and that do not [Hz].
    by_mounts : bool
        Of the mounts' paths alone.

    Returns
    -------
    array, shape (n,)
        Synthesised minus measured [dB].
    """
    found = [
        other.level - peak.level
        for one in errors
        if one.hoses is hoses
        for peak, other in (one.peaks_by_mounts if by_mounts else one.peaks).pairs
        if (only is None or only[0] <= peak.frequency <= only[1])
        and (without is None or not without[0] <= peak.frequency <= without[1])
    ]
    return np.array(found, dtype=float)


def in_band(frequency: RealArray, band: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Mark lines of a band, shape (n_frequency,)."""
    return np.asarray((frequency >= band[0]) & (frequency <= band[1]))


def band_level(noise: SweepNoise, pressure: ComplexArray) -> float:
    """Level of the energy in `HOSE_BAND`, nan where the sweep has no line there [dB(A)]."""
    lines = in_band(noise.frequency, HOSE_BAND)
    return float(energy_sum(noise.level(pressure)[lines])) if lines.any() else float("nan")


def soft_partner(case: CarNoise, standard: SweepNoise) -> SweepNoise | None:
    """Find the sweep with soft hoses at the pressure of one with standard hoses."""
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
        still_body=noise.level(noise.still_body) - total,
        predicted_body=noise.level(noise.predicted_body) - total,
        complete=noise.complete,
        inside=float(np.mean(((measured >= band.lower) & (measured <= band.upper))[loud])),
        hose_band=band_level(noise, noise.total) - band_level(noise, noise.measured),
        hose_band_by_mounts=band_level(noise, noise.by_mounts) - band_level(noise, noise.measured),
    )
