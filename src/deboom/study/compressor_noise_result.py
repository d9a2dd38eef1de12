"""The sound of a running compressor as the result of a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from deboom.measurement.operating_sweep import HoseState
from deboom.report.page import Section, Table
from deboom.report.style import signed
from deboom.study.compressor_noise_figures import all_cars, figures_of, hose_gain
from deboom.study.compressor_noise_levels import (
    HOSE_BAND,
    MODES,
    in_band,
    peak_deviations,
    sweep_errors,
)
from deboom.study.compressor_noise_page import page_of, pictures
from deboom.study.compressor_noise_tables import (
    error_table,
    gain_table,
    measured_gain_table,
    peak_table,
    tables_of,
)
from deboom.study.result import Scalar, StudyResult

if TYPE_CHECKING:
    from pathlib import Path

    from deboom.arrays import RealArray
    from deboom.bench.hose_gain import HoseGain
    from deboom.study.compressor_noise import CarNoise, MeasuredNoise
    from deboom.study.compressor_noise_cases import VirtualCars
    from deboom.study.compressor_noise_levels import SweepErrors

SHOWN = ("car", "laboratory", "sweep", "peaks", "without", "largest", "energy")
"""Beginnings of the columns that the page has room for."""
THESIS_GAIN = (5.0, 10.0)
"""Observed on one car between 90 and 140 Hz [dB]."""


def measured_result(
    measured: MeasuredNoise, *, inputs: tuple[Path, ...] = (), with_figures: bool = True
) -> StudyResult:
    """Make the result of one car.

    Parameters
    ----------
    measured : MeasuredNoise
    inputs : tuple of Path
        Files that stay.
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
    """
    return _result(measured, (measured.noise,), {}, {}, (), inputs, {}, with_figures=with_figures)


def virtual_result(
    cars: VirtualCars, gains: Sequence[HoseGain], *, with_figures: bool = True
) -> StudyResult:
    """Make the result of virtual cars and drawn fleets.

    Parameters
    ----------
    cars : VirtualCars
    gains : sequence of HoseGain
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        The first car in detail, errors of all, and the gain by hoses.
    """
    table, gained = error_table(cars.cases), gain_table(gains)
    figures = {}
    if with_figures:
        figures = {"all_cars": all_cars(cars.cases), "hose_gain": hose_gain(gains)}
    summary, measured = gain_summary(gains), measured_gain_table(cars.cases)
    sections = (
        Section(
            "All cars and laboratories",
            "Each laboratory has its own errors of sensors, hammer and microphone, and hoses of "
            "its own; every car is one of the frozen fleet. What is called measured is the coupled "
            "car of the bench at its microphone.",
            figures=pictures(figures, "all_cars"),
            tables=(
                Table(
                    table[[name for name in table if str(name).startswith(SHOWN)]],
                    "Synthesised minus measured, per car and sweep; errors.csv has more.",
                ),
            ),
        ),
        Section(
            "What hoses do in other cars",
            f"Level of the A-weighted energy between {HOSE_BAND[0]:g} and {HOSE_BAND[1]:g} Hz with "
            f"hoses minus that without, {len(gained)} cars of {len(gains)} drawn fleets: median "
            f"{signed(float(summary['hose_gain_db_90_140']), 1)} dB, 10–90 % "
            f"{signed(float(summary['hose_gain_db_90_140_p10']), 1)} to "
            f"{signed(float(summary['hose_gain_db_90_140_p90']), 1)} dB. The thesis observed "
            f"{THESIS_GAIN[0]:g} to {THESIS_GAIN[1]:g} dB on its car; "
            f"{float(summary['hose_gain_as_in_thesis_percent']):.0f} % of these lie there, "
            f"{float(summary['hose_quieter_percent']):.0f} % are quieter with hoses: paths add "
            "with phases, and hoses may cancel mounts. Prior, hoses and gain are as they came; "
            "nothing was tuned to that observation.",
            figures=pictures(figures, "hose_gain"),
            tables=(
                (
                    Table(
                        measured,
                        "The same of the frozen cars, whose hoses scatter around the drawing: "
                        "standard against soft hoses, measured and synthesised.",
                        {"measured gain [dB]": 1, "synthesised gain [dB]": 1},
                    ),
                )
                if len(measured)
                else ()
            ),
        ),
    )
    return _result(
        cars.first,
        cars.cases,
        {"hose_gain": gained, "measured_gain": measured},
        figures,
        sections,
        (),
        summary,
        with_figures=with_figures,
    )


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


def _result(
    measured: MeasuredNoise,
    cases: Sequence[CarNoise],
    more_tables: dict[str, pd.DataFrame],
    more_figures: dict[str, bytes],
    sections: Sequence[Section],
    inputs: tuple[Path, ...],
    more_summary: dict[str, Scalar],
    *,
    with_figures: bool,
) -> StudyResult:
    tables = {
        **tables_of(measured),
        "peaks": peak_table(cases),
        "errors": error_table(cases),
        **more_tables,
    }
    own = {**tables, "peaks": peak_table((measured.noise,), HoseState.SOFT)}
    figures = {**(figures_of(measured) if with_figures else {}), **more_figures}
    summary: dict[str, Scalar] = {
        **more_summary,
        **error_summary(cases),
        "identical_mounts": "yes" if measured.there.shares.identical else "no",
        "n_alarms": sum(len(case.alarms) for case in cases),
        "seconds": max(case.seconds for case in cases),
    }
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=summary,
        page=page_of(measured, own, figures, summary, sections),
        inputs=inputs,
        facts={"cars": len(cases)},
    )
