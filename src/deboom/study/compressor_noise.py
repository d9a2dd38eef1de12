"""The sound that a running compressor makes at the ear."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom import plot
from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_operation import true_source
from deboom.bench.compressor_truth import CompressorPlan, drawn_hoses, true_compressor
from deboom.bench.electric_car import HoseGain, draw_fleet, frozen_fleet, hose_gain
from deboom.bench.electric_car_writer import write_electric_car
from deboom.choices import CalibrationLevel, CompressorCase
from deboom.compressor.cabin_noise import (
    BAND,
    NoiseBand,
    RunningInCar,
    SweepNoise,
    cabin_noise,
    noise_bands,
    running_in_car,
)
from deboom.compressor.hose_beams import BEAM_NUMBERS, BEAM_UNITS
from deboom.compressor.identify import Identification, IdentifyOptions, identify
from deboom.errors import InputError
from deboom.files.electric_car import read_electric_car
from deboom.measurement.compressor_test import HoseState
from deboom.measurement.electric_car import wrench_noise_transfer
from deboom.physics.sound_level import a_weighting, energy_sum
from deboom.plot.style import VEHICLE_PALETTE, signed
from deboom.report import Report, Scalar
from deboom.study.compressor_identification import in_words
from deboom.study.progress import Progress
from deboom.vehicles.booming_peaks import MatchedPeaks, booming_peaks, match_peaks

if TYPE_CHECKING:
    from deboom.plot import Figure

ROTOR = "rotor speed [rpm]"
"""Axis above the panels."""
STEPS = 8
"""Of `noise_of_car`, for progress."""


@dataclass(frozen=True)
class NoisePlan:
    """What is asked of a car.

    Parameters
    ----------
    band : (float, float)
        Lines that are looked at [Hz].
    with_hoses : bool
        Whether standard hoses are identified and their paths modelled.
    draws : int
        For the bands.
    seed : int
        Of these draws, from 1.
    identify : IdentifyOptions
        Of the hammer test.

    Raises
    ------
    InputError
        A band without width.
    """

    band: tuple[float, float] = BAND
    with_hoses: bool = True
    draws: int = 64
    seed: int = 1
    identify: IdentifyOptions = field(default_factory=partial(IdentifyOptions, held_out=0))

    def __post_init__(self) -> None:
        if not 0 < self.band[0] < self.band[1]:
            raise InputError(f"{self.band[0]:g} to {self.band[1]:g} Hz is no band of frequencies")


@dataclass(frozen=True, eq=False)
class CarNoise:
    """Sound at the ear of one car: synthesised, measured, and how far it may be off.

    Parameters
    ----------
    car : str
        Its name.
    seed : int or None
        Of the laboratory that measured a virtual car.
    sweeps : tuple of SweepNoise
    bands : tuple of NoiseBand
        Of the same sweeps.
    alarms : tuple of str
        Reasons not to trust it.
    seconds : float
        From files to result, of one processor [s].
    """

    car: str
    seed: int | None
    sweeps: tuple[SweepNoise, ...]
    bands: tuple[NoiseBand, ...]
    alarms: tuple[str, ...]
    seconds: float

    @property
    def label(self) -> str:
        """Car, and its laboratory where there are several."""
        return self.car if self.seed is None else f"{self.car}, laboratory {self.seed}"


@dataclass(frozen=True, eq=False)
class MeasuredNoise:
    """A car in detail.

    Parameters
    ----------
    there : RunningInCar
        Compressor, mounts, hoses.
    noise : CarNoise
    """

    there: RunningInCar
    noise: CarNoise


def noise_of_car(
    folder: Path,
    plan: NoisePlan,
    step: Callable[[str], None],
    *,
    found: Identification | None = None,
    seed: int | None = None,
) -> MeasuredNoise:
    """Read a car, identify what is needed and synthesise its sound.

    Parameters
    ----------
    folder : Path
        With ``car.toml``.
    plan : NoisePlan
    step : callable of str
        Told what is being done.
    found : Identification, optional
        Of its compressor, where that is known from another car.
    seed : int, optional
        Of a virtual laboratory.

    Returns
    -------
    MeasuredNoise

    Raises
    ------
    InputError
        What reader, identification and synthesis refuse.
    """
    start = time.process_time()
    step("reading")
    car = read_electric_car(folder)
    with threadpool_limits(1):
        step("identification of the compressor")
        if found is None:
            found = identify(car.operation.hammer, plan.identify, hoses=car.operation.hoses)
        there = running_in_car(car, found, with_hoses=plan.with_hoses, step=step)
        step("synthesis")
        transfer = wrench_noise_transfer(car)
        sweeps = cabin_noise(there, transfer, plan.band)
        step("bands")
        bands = noise_bands(there, transfer, plan.band, draws=plan.draws, seed=plan.seed)
    seconds = time.process_time() - start
    noise = CarNoise(car.name, seed, sweeps, bands, (*found.alarms, *there.alarms), seconds)
    return MeasuredNoise(there, noise)


@dataclass(frozen=True, eq=False)
class VirtualCars:
    """What a study of virtual cars shows.

    Parameters
    ----------
    first : MeasuredNoise
        First car of the first laboratory, in detail.
    cases : tuple of CarNoise
        All cars of all laboratories.
    """

    first: MeasuredNoise
    cases: tuple[CarNoise, ...]


def virtual_cars(
    cars: int,
    seeds: Sequence[int],
    level: CalibrationLevel,
    plan: NoisePlan,
    progress: Progress,
    *,
    workers: int,
) -> VirtualCars:
    """Let laboratories measure the frozen cars, and evaluate each.

    Parameters
    ----------
    cars : int
        So many of the frozen fleet's.
    seeds : sequence of int
        One laboratory each, with a hammer test and hoses of its own.
    level : CalibrationLevel
        Of sensors and impacts.
    plan : NoisePlan
    progress : callable
    workers : int
        Processes beside this one; 0 does all here. The result is the same.

    Returns
    -------
    VirtualCars

    Raises
    ------
    InputError
        More cars than the fleet has, or none; no laboratory.
    """
    names = tuple(frozen_fleet().cars)
    if not 1 <= cars <= len(names):
        raise InputError(f"the frozen fleet has {len(names)} cars: ask for 1 to {len(names)}")
    if not seeds:
        raise InputError("no laboratory measures a car: ask for at least one")
    tasks = [_Task(seed, level, names[:cars], plan) for seed in seeds]
    with _spread(tasks[1:], workers) as others:
        own = list(_measured(tasks[0], progress, len(seeds)))
        cases = [one.noise for one in own]
        for number, rows in enumerate(others, start=1):
            progress(number * cars, len(seeds) * cars, "other laboratories")
            cases += rows
    progress(len(seeds) * cars, len(seeds) * cars, "done")
    return VirtualCars(own[0], tuple(cases))


def fleet_gains(fleets: int) -> tuple[HoseGain, ...]:
    """Run one compressor with hoses as drawn, and without, in fleets drawn from their prior.

    Parameters
    ----------
    fleets : int
        Of five cars each, seeds 1 to this.

    Returns
    -------
    tuple of HoseGain

    Raises
    ------
    InputError
        No fleet.

    Notes
    -----
    Nothing is selected and nothing tuned: compressor of table 11, first pressure, every car.
    """
    if fleets < 1:
        raise InputError("a gain over fleets needs at least one fleet")
    plan = CompressorPlan(CompressorCase.TABLE11)
    compressor = true_compressor(plan, np.random.default_rng(1))
    source, hoses = true_source(), drawn_hoses()
    with threadpool_limits(1):
        return tuple(
            hose_gain(draw_fleet(seed), compressor, source, hoses) for seed in range(1, fleets + 1)
        )


@dataclass(frozen=True)
class _Task:
    """One laboratory and its cars."""

    seed: int
    level: CalibrationLevel
    cars: tuple[str, ...]
    plan: NoisePlan


def _measured(task: _Task, progress: Progress, n_task: int) -> Iterator[MeasuredNoise]:
    """Measure and evaluate; all cars share the hammer test on their compressor."""
    found = None
    for number, name in enumerate(task.cars):
        progress(number, n_task * len(task.cars), name)
        with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
            folder = Path(scratch) / name
            write_electric_car(folder, task.seed, name, level=task.level)
            one = noise_of_car(folder, task.plan, lambda _: None, found=found, seed=task.seed)
        found = one.there.found
        yield one


def _carried_out(task: _Task) -> list[CarNoise]:
    return [one.noise for one in _measured(task, lambda *_: None, 1)]


@contextmanager
def _spread(tasks: Sequence[_Task], workers: int) -> Iterator[Iterable[list[CarNoise]]]:
    """Work tasks off in processes, or here; results come in the order of the tasks."""
    if workers == 0 or not tasks:
        yield map(_carried_out, tasks)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield pool.map(_carried_out, tasks)


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


Row = dict[str, str | int | float]
ALL_PATHS, MOUNTS_ALONE = "mounts and hoses", "mounts alone"
BANDS = ((20.0, 80.0), HOSE_BAND)
"""Of the ranking: the thesis hears no hoses in the first [Hz]."""


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


LEVEL = "SPL [dB(A)]"
MEASURED = "measured"
SYNTHESISED = "synthesised"
BY_MOUNTS, WITH_HOSES = "synthesised, mounts alone", "synthesised, mounts and hoses"
ALL = "all paths"
TARGET = 3.0
"""Deviation of a level that is asked for [dB]."""
NOTCH_DEPTH = 30.0
"""Below the loudest line, from which a level is one of a notch [dB]."""
NOTCH = f"a notch, {NOTCH_DEPTH:g} dB below the loudest line"
SPREAD = (10.0, 50.0, 90.0)


def soft_hoses(noise: CarNoise) -> Figure:
    """Figure 65: synthesised against measured, paths of the hoses cut."""
    panels = []
    for place in _of(noise, HoseState.SOFT):
        one, band = noise.sweeps[place], noise.bands[place]
        panels.append(
            plot.CurvePanel(
                f"{noise.car}, {one.sweep}",
                one.frequency,
                {SYNTHESISED: one.level(one.total), MEASURED: one.level(one.measured)},
                y_label=LEVEL,
                ranges={SYNTHESISED: (band.lower, band.upper)},
            )
        )
    return plot.curve_panels(panels, dashed=(MEASURED,), columns=1, order=1.0, speed_label=ROTOR)


def standard_hoses(noise: CarNoise) -> Figure:
    """Figure 66: measured with the car's hoses, synthesised without and with their paths."""
    panels = []
    for place in _of(noise, HoseState.STANDARD):
        one, band = noise.sweeps[place], noise.bands[place]
        curves = {BY_MOUNTS: one.level(one.by_mounts)}
        ranges = {BY_MOUNTS: (band.lower_mounts, band.upper_mounts)}
        if one.contributions.shape[1] > one.n_mount_paths:
            curves |= {WITH_HOSES: one.level(one.total)}
            ranges |= {WITH_HOSES: (band.lower, band.upper)}
        curves |= {MEASURED: one.level(one.measured)}
        panels.append(
            plot.CurvePanel(
                f"{noise.car}, {one.sweep}", one.frequency, curves, y_label=LEVEL, ranges=ranges
            )
        )
    return plot.curve_panels(panels, dashed=(MEASURED,), columns=1, order=1.0, speed_label=ROTOR)


def contributions(noise: CarNoise) -> Figure:
    """Level of each mount and hose on its own beside that of all, lowest pressure."""
    lowest = min(one.pressure for one in noise.sweeps)
    panels = [
        plot.CurvePanel(
            f"{noise.car}, {one.sweep}",
            one.frequency,
            dict(zip(one.points, one.level(one.by_point).T, strict=True))
            | {ALL: one.level(one.total)},
            y_label=LEVEL,
        )
        for one in noise.sweeps
        if one.pressure == lowest
    ]
    return plot.curve_panels(panels, dashed=(ALL,), columns=1, order=1.0, speed_label=ROTOR)


def body_motion(noise: CarNoise) -> Figure:
    """Change of level where the motion of the body is left out, or predicted."""
    lowest = min(one.pressure for one in noise.sweeps)
    panels = []
    for one in noise.sweeps:
        if one.pressure == lowest:
            total = one.level(one.total)
            panels.append(
                plot.CurvePanel(
                    f"{noise.car}, {one.sweep}",
                    one.frequency,
                    {
                        "body taken to stand still": one.level(one.still_body) - total,
                        "motion of the body predicted": one.level(one.predicted_body) - total,
                    },
                    y_label="change of SPL [dB]",
                    masked={NOTCH: total < total.max() - NOTCH_DEPTH},
                )
            )
    return plot.curve_panels(panels, columns=1, order=1.0, speed_label=ROTOR)


def all_cars(cases: Sequence[CarNoise]) -> Figure:
    """Deviations of every car and laboratory: at peaks, and at lines where hoses are heard."""
    groups = {seed: f"laboratory {seed}" for seed in dict.fromkeys(case.seed for case in cases)}
    colours = {
        name: VEHICLE_PALETTE[place % len(VEHICLE_PALETTE)]
        for place, name in enumerate(groups.values())
    }
    panels = []
    for label, of, limit in (
        (f"soft hoses: peaks outside {words(MODES)}", _at_peaks, TARGET),
        (f"standard hoses modelled: {words(HOSE_BAND)}", _with_hoses, TARGET),
        (f"standard, mounts alone: {words(HOSE_BAND)}", _by_mounts, None),
    ):
        values: dict[str, dict[str, RealArray]] = {case.car: {} for case in cases}
        for case in cases:
            found = of(sweep_errors(case))
            if found.size:
                values[case.car][groups[case.seed]] = found
        if all(values.values()):
            said = "" if limit is None else f"asked for: {limit:g} dB"
            panels.append(plot.DotPanel(f"{label}\n|deviation| [dB]", values, limit, said))
    return plot.dot_panels(panels, colours)


def fleet_gain(gains: Sequence[HoseGain]) -> Figure:
    """How much louder hoses make cars drawn from the prior, line by line."""
    lines = gains[0].frequency
    every = np.vstack([gain.line_gain() for gain in gains])
    low, middle, high = np.percentile(every, SPREAD, axis=0)
    name = "median of all cars, and 10–90 %"
    return plot.curve_panels(
        [
            plot.CurvePanel(
                "With hoses minus without",
                lines,
                {name: middle},
                y_label="gain [dB]",
                ranges={name: (low, high)},
                levels={"thesis, from 90 Hz on: 5 dB": 5.0, "to 10 dB": 10.0},
                note=f"{len(every)} cars, hoses as drawn",
            )
        ],
        columns=1,
        order=1.0,
        speed_label=ROTOR,
    )


def _of(noise: CarNoise, hoses: HoseState) -> list[int]:
    return [place for place, one in enumerate(noise.sweeps) if one.hoses is hoses]


def _at_peaks(errors: Sequence[SweepErrors]) -> RealArray:
    return np.abs(peak_deviations(errors, HoseState.SOFT, without=MODES))


def _with_hoses(errors: Sequence[SweepErrors]) -> RealArray:
    return _in_hose_band(errors, by_mounts=False)


def _by_mounts(errors: Sequence[SweepErrors]) -> RealArray:
    return _in_hose_band(errors, by_mounts=True)


def _in_hose_band(errors: Sequence[SweepErrors], *, by_mounts: bool) -> RealArray:
    """Ninety of a hundred lines of each sweep with standard hoses deviate by less."""
    return np.array(
        [
            np.percentile(np.abs(lines[high]), SPREAD[-1])
            for one in errors
            if one.hoses is HoseState.STANDARD
            and (by_mounts or one.complete)
            and (high := in_band(one.frequency, HOSE_BAND)).any()
            for lines in [one.lines_by_mounts if by_mounts else one.lines]
        ],
        dtype=float,
    )


THESIS_GAIN = (5.0, 10.0)
"""Observed on one car between 90 and 140 Hz [dB]."""


def error_summary(cases: Sequence[CarNoise]) -> dict[str, Scalar]:
    """Headline errors; the study's docstring has the keys."""
    errors = [one for case in cases for one in sweep_errors(case)]
    summary: dict[str, Scalar] = {}
    for suffix, hoses, only, without, by_mounts in (
        ("", HoseState.SOFT, None, MODES, False),
        ("_25_35", HoseState.SOFT, MODES, None, False),
        ("_with_hoses", HoseState.STANDARD, HOSE_BAND, None, False),
        ("_by_mounts", HoseState.STANDARD, HOSE_BAND, None, True),
    ):
        off = np.abs(
            peak_deviations(errors, hoses, only=only, without=without, by_mounts=by_mounts)
        )
        if off.size:
            summary[f"spl_peak_deviation_db{suffix}"] = float(off.max())
            summary[f"spl_peak_deviation_db{suffix}_median"] = float(np.median(off))
            summary[f"n_peaks{suffix}"] = int(off.size)
    summary["n_peaks_without_partner"] = sum(len(one.peaks.only_reference) for one in errors)
    summary |= _hose_band(errors)
    gain = measured_gain_table(cases)
    if len(gain):
        measured = gain["measured gain [dB]"].to_numpy()
        off = gain["synthesised gain [dB]"].to_numpy() - measured
        summary["measured_gain_db_90_140"] = float(np.median(measured))
        summary["measured_gain_error_db_90_140"] = float(np.abs(off).max())
    still = np.abs(np.concatenate([one.still_body for one in errors]))
    summary["still_body_error_db_median"] = float(np.median(still))
    summary["still_body_error_db_p90"] = float(np.percentile(still, 90))
    predicted = np.abs(np.concatenate([one.predicted_body for one in errors]))
    summary["predicted_body_error_db_p90"] = float(np.percentile(predicted, 90))
    inside = [one.inside for one in errors if one.complete]
    if inside:
        summary["lines_in_band_percent"] = 100 * float(np.mean(inside))
    if not all(one.complete for one in errors):
        # nobody modelled the hoses
        return {key: value for key, value in summary.items() if "with_hoses" not in key}
    return summary


def gain_summary(gains: Sequence[HoseGain]) -> dict[str, Scalar]:
    """Gain by hoses over all cars of all fleets."""
    every = np.concatenate([gain.band_gain(HOSE_BAND) for gain in gains])
    low, middle, high = np.percentile(every, (10, 50, 90))
    within = (every >= THESIS_GAIN[0]) & (every <= THESIS_GAIN[1])
    return {
        "hose_gain_db_90_140": float(middle),
        "hose_gain_db_90_140_p10": float(low),
        "hose_gain_db_90_140_p90": float(high),
        "hose_gain_as_in_thesis_percent": 100 * float(np.mean(within)),
        "hose_quieter_percent": 100 * float(np.mean(every < 0)),
        "n_fleets": len(gains),
    }


def _hose_band(errors: Sequence[SweepErrors]) -> dict[str, Scalar]:
    """Lines and energy between 90 and 140 Hz with standard hoses."""
    summary: dict[str, Scalar] = {}
    standard = [
        (one, in_band(one.frequency, HOSE_BAND))
        for one in errors
        if one.hoses is HoseState.STANDARD and in_band(one.frequency, HOSE_BAND).any()
    ]
    if not standard:
        return summary
    for name, lines, levels in (
        (
            "with_hoses",
            [one.lines[high] for one, high in standard],
            [one.hose_band for one, _ in standard],
        ),
        (
            "by_mounts",
            [one.lines_by_mounts[high] for one, high in standard],
            [one.hose_band_by_mounts for one, _ in standard],
        ),
    ):
        off: RealArray = np.abs(np.concatenate(lines))
        summary[f"spl_90_140_median_db_{name}"] = float(np.median(off))
        summary[f"spl_90_140_p90_db_{name}"] = float(np.percentile(off, 90))
        summary[f"spl_90_140_energy_db_{name}"] = float(np.abs(levels).max())
    return summary


def noise_report(
    measured: MeasuredNoise,
    inputs: Sequence[Path] = (),
    *,
    cars: VirtualCars | None = None,
    gains: Sequence[HoseGain] = (),
    figures: bool = True,
) -> Report:
    """Report one car, and beside it virtual cars and drawn fleets.

    Parameters
    ----------
    measured : MeasuredNoise
        The car in detail.
    inputs : sequence of Path
        Files that were read.
    cars : VirtualCars, optional
        Of several laboratories, this one among them.
    gains : sequence of HoseGain
        Of drawn fleets, with `cars`.
    figures : bool
        Whether to draw.
    """
    there, noise = measured.there, measured.noise
    cases = (noise,) if cars is None else cars.cases
    report = Report(
        f"Cabin noise of the compressor: {noise.car}",
        "How loud is the running compressor at the driver's ear, by which mount and which hose "
        "does its sound get there, and how far may the synthesis be believed?",
    )
    report.summary |= gain_summary(gains) if cars else {}
    report.summary |= error_summary(cases)
    report.summary |= {
        "identical_mounts": "yes" if there.shares.identical else "no",
        "n_alarms": sum(len(case.alarms) for case in cases),
        "seconds": max(case.seconds for case in cases),
    }
    for key, label in (
        ("spl_peak_deviation_db", "largest deviation at a peak, soft hoses, outside 25–35 Hz"),
        ("spl_90_140_p90_db_with_hoses", "90 of 100 lines at 90–140 Hz, hoses modelled"),
        ("spl_90_140_p90_db_by_mounts", "the same, hoses left out"),
        ("hose_gain_db_90_140", "median gain by hoses over drawn fleets, 90–140 Hz"),
    ):
        if key in report.summary:
            report.tile(f"{float(report.summary[key]):.1f} dB".replace("-", "−"), label)
    report.warn(*noise.alarms, *there.source.notices)
    report.facts["cars"] = len(cases)
    report.inputs += inputs

    _asked(report, measured)
    _soft_hoses(report, measured, cases, figures)
    if there.car.operation.with_hoses(HoseState.STANDARD):
        _standard_hoses(report, measured, figures)
    _paths(report, noise, figures)
    _mounts(report, measured, figures)
    report.table("errors", error_table(cases))
    if cars is not None:
        _all_cars(report, cars, figures)
        _fleets(report, cars, gains, figures)
    return report


def _asked(report: Report, measured: MeasuredNoise) -> None:
    """Say what was asked, and with which data."""
    there = measured.there
    sweeps = "; ".join(
        f"{sweep.sweep}: {60 * sweep.frequency[0]:.0f}–{60 * sweep.frequency[-1]:.0f} rpm"
        for sweep in measured.noise.sweeps
    )
    report.section(
        "What was asked, and with which data",
        "A hammer test on a rig shows mass and mounts of the compressor. In the car its motion, "
        "and that of the body at each mount, were recorded while it ran up; with the stiffness of "
        "a mount, what both sides move apart is its force. Hammer tests on the body without "
        "compressor say how loud a force or a moment at each mount and each end of a hose is. "
        f"Force times that, summed with phases, is the sound. Sweeps: {sweeps}.\n\n"
        f"{there.shares.statement}\n\n{there.source.state.statement} To see this, the motion of "
        "the body was taken off the sweeps, which otherwise look like changed mounts.",
    )
    report.table("levels", level_table(measured.noise))


def _soft_hoses(
    report: Report, measured: MeasuredNoise, cases: Sequence[CarNoise], figures: bool
) -> None:
    """Show sweeps whose paths of the hoses are cut."""
    report.section(
        "Without hoses",
        "Levels are compared at peaks of at least 6 dB prominence, paired within 1.5 Hz: in a "
        "notch the difference of two lines says nothing about noise. The thesis leaves out "
        "25–35 Hz, where the compressor swings on its mounts; the last column tells these peaks.",
    )
    if figures and _of(measured.noise, HoseState.SOFT):
        report.figure(
            "figure_65_soft_hoses",
            soft_hoses(measured.noise),
            "Level at the driver's ear with long soft hoses, which cut the paths "
            "of the hoses (thesis, figure 65): synthesised from mounts and noise transfer "
            "functions against measured. Shade: where 90 % of what the measurements allow lies.",
        )
    own = peak_table((measured.noise,), HoseState.SOFT)
    shown = own.drop(columns=["car", "laboratory", "paths"]) if len(own) else own
    decimals = dict.fromkeys(("peak [Hz]", "synthesised peak [Hz]"), 0) if len(own) else {}
    caption = "Peaks with soft hoses." if len(own) else ""
    report.table("peaks", peak_table(cases), caption, decimals, shown=shown)


def _standard_hoses(report: Report, measured: MeasuredNoise, figures: bool) -> None:
    """Show sweeps with the hoses of the car."""
    hoses = measured.there.hoses
    report.section("With the hoses of the car")
    if hoses is None:
        report.text("The paths of the hoses were left out on request.")
    else:
        fit = "; ".join(f"{name}: {chi:.2f}" for name, chi in hoses.reduced_chi)
        report.text(
            "The hoses were identified as beams from the sweeps with standard and with soft hoses; "
            f"residuals over noise: {fit}. Their loads on the body at six degrees of freedom per "
            "end are further paths.\n\n" + "\n\n".join(hoses.statements)
        )
    if figures:
        report.figure(
            "figure_66_standard_hoses",
            standard_hoses(measured.noise),
            "Level with the car's own hoses (thesis, figure 66). Mounts alone "
            "miss the measurement where hoses carry sound; with the identified hoses the synthesis "
            "follows. The motion is that of the sweep with hoses in both.",
        )
    if hoses is not None:
        table = hose_table(measured.there)
        caption = "Hoses, as drawn and as found; deviation: 1 σ."
        report.table("hoses", table, caption, shown=in_words(table))


def _paths(report: Report, noise: CarNoise, figures: bool) -> None:
    """Show by which mount and hose the sound gets to the ear."""
    report.section(
        "By which way",
        "Parts add up to 100 %: each is the share of the A-weighted energy of the sum that is in "
        "phase with it. A negative part works against the others.",
    )
    if figures:
        report.figure(
            "contributions",
            contributions(noise),
            "Level of each mount and hose on its own, forces and moments summed with "
            "their phases. Where a single one is louder than all together, others cancel it.",
        )
    report.table(
        "ranking",
        pd.concat([ranking(sweep) for sweep in noise.sweeps], ignore_index=True),
        "Mounts and hoses ranked, per sweep and band.",
        {"part of the sound [%]": 0, "alone [dB(A)]": 1, "cut, the level changes by [dB]": 1},
    )
    report.table("contributions", path_table(noise, "contributions"))
    report.table("loads", path_table(noise, "loads"))


def _mounts(report: Report, measured: MeasuredNoise, figures: bool) -> None:
    """Show single mounts, and what the motion of the body under them does."""
    there = measured.there
    reference = getattr(there.found.calibrated.parametrisation, "reference_frequency", 20.0)
    report.section(
        "Single mounts, and the body under them",
        "Places come from the sheet of the car, directions and stiffness from the drawing, their "
        "sum from the hammer test. Where a deviation hardly falls from before to after, the number "
        "is the drawing's. The stiffness found is dynamic, its real part at "
        f"{reference:g} Hz; the drawn one static.",
    )
    if figures:
        report.figure(
            "body_motion",
            body_motion(measured.noise),
            "What it changes to take the body under the mounts as standing still, or to "
            "predict its motion by accelerances instead of measuring it. A sum of paths that "
            "cancel each other is changed most.",
        )
    mounts = mount_table(there)
    report.table("mounts", mounts, "Mounts; deviations are 1 σ.", shown=in_words(mounts))


def _all_cars(report: Report, cars: VirtualCars, figures: bool) -> None:
    """Show the errors of every car and laboratory."""
    report.section(
        "All cars and laboratories",
        "Each laboratory has its own errors of sensors, hammer and microphone, and hoses of "
        "its own; every car is one of the frozen fleet. What is called measured is the coupled "
        "car of the bench at its microphone.",
    )
    if figures:
        report.figure(
            "all_cars",
            all_cars(cars.cases),
            "All cars and laboratories. Left: each peak with soft hoses. Middle and right: 90 "
            "of 100 lines of a sweep with standard hoses deviate by less, with and without "
            "modelled hoses.",
        )
    errors = error_table(cars.cases)
    begins = ("car", "laboratory", "sweep", "peaks", "without", "largest", "energy")
    report.table(
        None,
        errors[[name for name in errors if str(name).startswith(begins)]],
        "Synthesised minus measured, per car and sweep; errors.csv has more.",
    )


def _fleets(report: Report, cars: VirtualCars, gains: Sequence[HoseGain], figures: bool) -> None:
    """Show how much louder hoses make cars of drawn fleets."""
    gained, summary = gain_table(gains), report.summary
    low, middle, high = (
        signed(float(summary[f"hose_gain_db_90_140{end}"]), 1) for end in ("_p10", "", "_p90")
    )
    report.section(
        "What hoses do in other cars",
        f"Level of the A-weighted energy between {HOSE_BAND[0]:g} and {HOSE_BAND[1]:g} Hz with "
        f"hoses minus that without, {len(gained)} cars of {len(gains)} drawn fleets: median "
        f"{middle} dB, 10–90 % {low} to {high} dB. The thesis observed "
        f"{THESIS_GAIN[0]:g} to {THESIS_GAIN[1]:g} dB on its car; "
        f"{float(summary['hose_gain_as_in_thesis_percent']):.0f} % of these lie there, "
        f"{float(summary['hose_quieter_percent']):.0f} % are quieter with hoses: paths add "
        "with phases, and hoses may cancel mounts. Prior, hoses and gain are as they came; "
        "nothing was tuned to that observation.",
    )
    if figures:
        report.figure(
            "hose_gain",
            fleet_gain(gains),
            "How much louder the car's hoses make the compressor, line by line, in cars drawn "
            "from the prior of the fleet; nothing selected, nothing tuned. Dotted: what the thesis "
            "observed on its one car between 90 and 140 Hz.",
        )
    report.table("hose_gain", gained)
    measured = measured_gain_table(cars.cases)
    caption = (
        "The same of the frozen cars, whose hoses scatter around the drawing: "
        "standard against soft hoses, measured and synthesised."
    )
    decimals = {"measured gain [dB]": 1, "synthesised gain [dB]": 1}
    if len(measured):
        report.table("measured_gain", measured, caption, decimals)
    else:
        report.table("measured_gain", measured)
