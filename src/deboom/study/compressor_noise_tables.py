"""Tables of the sound that a running compressor makes at the ear."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from deboom.compressor.hose_beams import BEAM_NUMBERS, BEAM_UNITS
from deboom.measurement.operating_sweep import HoseState
from deboom.physics.sound_level import a_weighting, energy_sum
from deboom.study.compressor_noise_levels import (
    HOSE_BAND,
    MODES,
    band_level,
    in_band,
    soft_partner,
    sweep_errors,
)

if TYPE_CHECKING:
    from deboom.arrays import RealArray
    from deboom.bench.hose_gain import HoseGain
    from deboom.compressor.cabin_noise import SweepNoise
    from deboom.compressor.running_in_car import RunningInCar
    from deboom.study.compressor_noise import CarNoise, MeasuredNoise
    from deboom.study.compressor_noise_levels import SweepErrors
    from deboom.vehicles.booming_peaks import MatchedPeaks

Row = dict[str, str | int | float]
ALL_PATHS, MOUNTS_ALONE = "mounts and hoses", "mounts alone"
BANDS = ((20.0, 80.0), HOSE_BAND)
"""Of the ranking: the thesis hears no hoses in the first [Hz]."""


def tables_of(measured: MeasuredNoise) -> dict[str, pd.DataFrame]:
    """Make all tables of one car; file stem → table."""
    noise = measured.noise
    tables = {
        "levels": level_table(noise),
        "ranking": pd.concat([ranking(one) for one in noise.sweeps], ignore_index=True),
        "contributions": path_table(noise, "contributions"),
        "loads": path_table(noise, "loads"),
        "mounts": mount_table(measured.there),
    }
    if measured.there.hoses is not None:
        tables["hoses"] = hose_table(measured.there)
    return tables


def level_table(noise: CarNoise) -> pd.DataFrame:
    """Write levels line by line: measured, synthesised with its band, and variants."""
    frames = []
    for one, band in zip(noise.sweeps, noise.bands, strict=True):
        columns: dict[str, RealArray] = {
            "measured": one.level(one.measured),
            "synthesised": one.level(one.total),
            "synthesised from": band.lower,
            "synthesised to": band.upper,
            "mounts alone": one.level(one.by_mounts),
            "body taken to stand still": one.level(one.still_body),
            "motion of the body predicted": one.level(one.predicted_body),
        }
        table = {
            "sweep": [one.sweep] * one.frequency.size,
            "frequency [Hz]": one.frequency,
            "speed [rpm]": 60 * one.frequency,
        }
        table |= {f"{name} [dB(A)]": values for name, values in columns.items()}
        frames.append(pd.DataFrame(table))
    return pd.concat(frames, ignore_index=True)


def path_table(noise: CarNoise, field: str) -> pd.DataFrame:
    """Write loads or contributions of all paths, complex, line by line; units by path."""
    rows = []
    for one in noise.sweeps:
        values = getattr(one, field)
        for number, path in enumerate(one.paths):
            unit = "Pa" if field == "contributions" else _load_unit(path)
            rows.append(
                pd.DataFrame(
                    {
                        "sweep": one.sweep,
                        "path": path,
                        "unit": unit,
                        "frequency [Hz]": one.frequency,
                        "real": values[:, number].real,
                        "imaginary": values[:, number].imag,
                    }
                )
            )
    return pd.concat(rows, ignore_index=True)


def ranking(noise: SweepNoise) -> pd.DataFrame:
    """Rank mounts and hoses of one sweep by their part of the sound.

    Notes
    -----
    A part is ``Σ w Re(p_i p*) / Σ w |p|²`` with the A-weighting w: parts of all points add up to 1,
    and a point that works against the others has a negative one.
    """
    rows: list[Row] = []
    points, total = noise.by_point, noise.total
    for band in BANDS:
        lines = in_band(noise.frequency, band)
        if not lines.any():
            continue
        weight = 10 ** (a_weighting(noise.frequency[lines]) / 10)
        sound, own = total[lines], points[lines]
        energy = weight @ np.abs(sound) ** 2
        part = weight @ (own * np.conj(sound)[:, np.newaxis]).real / energy
        without = weight @ np.abs(sound[:, np.newaxis] - own) ** 2
        alone = energy_sum(noise.level(points)[lines])
        for place in np.argsort(-part):
            rows.append(
                {
                    "sweep": noise.sweep,
                    "band": words(band),
                    "point": noise.points[place],
                    "part of the sound [%]": 100 * float(part[place]),
                    "alone [dB(A)]": float(alone[place]),
                    "cut, the level changes by [dB]": float(10 * np.log10(without[place] / energy)),
                }
            )
    return pd.DataFrame(rows)


def mount_table(there: RunningInCar) -> pd.DataFrame:
    """Show single mounts as found, and how well they are known."""
    shares = there.shares
    n = len(shares.drawn)
    before = shares.prior_deviations[:-1].reshape(n, 9)
    before = np.hstack([before[:, :6], np.hypot(before[:, 6:], shares.prior_deviations[-1])])
    rows: list[Row] = []
    for mount, drawn, own, prior in zip(
        shares.mounts, shares.drawn, shares.deviations, before, strict=True
    ):
        for axis, place in zip("xyz", range(3), strict=True):
            rows.append(
                {
                    "mount": mount.name,
                    "number": f"position {axis}",
                    "unit": "mm",
                    "drawn": 1e3 * drawn.position[place],
                    "found": 1e3 * mount.position[place],
                    "deviation": 1e3 * own[place],
                    "deviation before": 1e3 * prior[place],
                }
            )
        for axis, place in zip("xyz", range(3), strict=True):
            rows.append(
                {
                    "mount": mount.name,
                    "number": f"angle {axis}",
                    "unit": "°",
                    "drawn": float(np.degrees(drawn.rotation[place])),
                    "found": float(np.degrees(mount.rotation[place])),
                    "deviation": float(np.degrees(own[3 + place])),
                    "deviation before": float(np.degrees(prior[3 + place])),
                }
            )
        for axis, place in zip(("axial", "radial 1", "radial 2"), range(3), strict=True):
            stiffness = 1e-3 * mount.stiffness[place]
            rows.append(
                {
                    "mount": mount.name,
                    "number": f"stiffness {axis}",
                    "unit": "N/mm",
                    "drawn": 1e-3 * drawn.stiffness[place],
                    "found": stiffness,
                    "deviation": stiffness * own[6 + place],
                    "deviation before": stiffness * prior[6 + place],
                }
            )
    return pd.DataFrame(rows)


def hose_table(there: RunningInCar) -> pd.DataFrame:
    """Show the numbers of the hoses, as drawn and as identified."""
    assert there.hoses is not None
    rows: list[Row] = []
    found = there.hoses
    for drawn, hose, deviation in zip(found.drawn, found.hoses, found.beam_deviations, strict=True):
        for name, unit, own in zip(BEAM_NUMBERS, BEAM_UNITS, deviation, strict=True):
            value = float(getattr(hose, name))
            rows.append(
                {
                    "hose": hose.name,
                    "number": name.replace("_", " "),
                    "unit": unit,
                    "drawn": float(getattr(drawn, name)),
                    "found": value,
                    "deviation": value * float(own),
                }
            )
    return pd.DataFrame(rows)


def peak_table(cases: Sequence[CarNoise], only: HoseState | None = None) -> pd.DataFrame:
    """List measured peaks with their synthesised partners, of sweeps with these hoses or all."""
    rows: list[Row] = []
    for case in cases:
        for errors in sweep_errors(case):
            if only is not None and errors.hoses is not only:
                continue
            rows += _peak_rows(errors, errors.peaks, ALL_PATHS)
            if errors.hoses is HoseState.STANDARD:
                rows += _peak_rows(errors, errors.peaks_by_mounts, MOUNTS_ALONE)
    return pd.DataFrame(rows)


def error_table(cases: Sequence[CarNoise]) -> pd.DataFrame:
    """Write one row per car and sweep: at peaks, at lines, in the band of the hoses."""
    rows: list[Row] = []
    for case in cases:
        for errors in sweep_errors(case):
            high = in_band(errors.frequency, HOSE_BAND)
            pairs = errors.peaks.level_deviations
            row: Row = {
                "car": case.car,
                "laboratory": case.seed or "–",
                "sweep": errors.sweep,
                "peaks": pairs.size,
                "without partner": len(errors.peaks.only_reference),
                "largest at peaks [dB]": float(np.abs(pairs).max()) if pairs.size else np.nan,
                "median of the lines [dB]": float(np.median(np.abs(errors.lines))),
                "lines within the band [%]": 100 * errors.inside,
                f"energy {words(HOSE_BAND)}, all paths [dB]": errors.hose_band,
                f"energy {words(HOSE_BAND)}, mounts alone [dB]": errors.hose_band_by_mounts,
                "body still, median [dB]": float(np.median(np.abs(errors.still_body))),
                "body still, 90 % [dB]": float(np.percentile(np.abs(errors.still_body), 90)),
            }
            if high.any():
                row["lines there, 90 % [dB]"] = float(np.percentile(np.abs(errors.lines[high]), 90))
                row["lines there, mounts alone, 90 % [dB]"] = float(
                    np.percentile(np.abs(errors.lines_by_mounts[high]), 90)
                )
            rows.append(row)
    return pd.DataFrame(rows)


def measured_gain_table(cases: Sequence[CarNoise]) -> pd.DataFrame:
    """Compare sweeps with standard and with soft hoses, measured as synthesised (figure 66)."""
    rows: list[Row] = []
    for case in cases:
        for one in case.sweeps:
            soft = soft_partner(case, one) if one.hoses is HoseState.STANDARD else None
            if soft is None or not in_band(one.frequency, HOSE_BAND).any():
                continue
            rows.append(
                {
                    "car": case.car,
                    "laboratory": case.seed or "–",
                    "pressure [bar]": 1e-5 * one.pressure,
                    "measured gain [dB]": band_level(one, one.measured)
                    - band_level(soft, soft.measured),
                    "synthesised gain [dB]": band_level(one, one.total)
                    - band_level(soft, soft.total),
                }
            )
    return pd.DataFrame(rows)


def gain_table(gains: Sequence[HoseGain]) -> pd.DataFrame:
    """Write the gain by hoses of every car of every drawn fleet."""
    rows: list[Row] = []
    for fleet, gain in enumerate(gains, start=1):
        high, low = gain.band_gain(HOSE_BAND), gain.band_gain(BANDS[0])
        for name, above, below in zip(gain.names, high, low, strict=True):
            rows.append(
                {
                    "fleet": fleet,
                    "car": name,
                    f"{words(HOSE_BAND)} [dB]": float(above),
                    f"{words(BANDS[0])} [dB]": float(below),
                }
            )
    return pd.DataFrame(rows)


def words(band: tuple[float, float]) -> str:
    """Write a band."""
    return f"{band[0]:g}–{band[1]:g} Hz"


def _peak_rows(errors: SweepErrors, matched: MatchedPeaks, paths: str) -> list[Row]:
    pairs = [(peak, other.frequency, other.level) for peak, other in matched.pairs]
    alone = [(peak, np.nan, np.nan) for peak in matched.only_reference]
    rows: list[Row] = []
    for peak, frequency, level in sorted([*pairs, *alone], key=lambda one: one[0].frequency):
        rows.append(
            {
                "car": errors.car,
                "laboratory": errors.seed or "–",
                "sweep": errors.sweep,
                "paths": paths if errors.hoses is HoseState.STANDARD else MOUNTS_ALONE,
                "peak [Hz]": peak.frequency,
                "measured [dB(A)]": peak.level,
                "synthesised peak [Hz]": frequency,
                "synthesised [dB(A)]": level,
                "deviation [dB]": level - peak.level,
                f"in {words(MODES)}": bool(MODES[0] <= peak.frequency <= MODES[1]),
            }
        )
    return rows


def _load_unit(path: str) -> str:
    return "N m" if path.rpartition(" ")[2].startswith("m") else "N"
