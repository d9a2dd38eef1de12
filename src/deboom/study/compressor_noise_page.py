"""The page on the sound of a running compressor: how loud, by which way, how sure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import pandas as pd

from deboom.measurement.operating_sweep import HoseState
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.compressor_identification_words import in_words
from deboom.study.compressor_noise_words import CAPTIONS

if TYPE_CHECKING:
    from deboom.study.compressor_noise import MeasuredNoise
    from deboom.study.result import Scalar


PEAK_COLUMNS = ("peak [Hz]", "synthesised peak [Hz]")


def page_of(
    measured: MeasuredNoise,
    tables: Mapping[str, pd.DataFrame],
    figures: Mapping[str, bytes],
    summary: Mapping[str, Scalar],
    more: Sequence[Section] = (),
) -> Page:
    """Write the page of one car.

    Parameters
    ----------
    measured : MeasuredNoise
    tables : mapping of str to DataFrame
        From `tables_of`, with ``peaks`` and ``errors``.
    figures : mapping of str to bytes
        May be empty.
    summary : mapping of str to float, int or str
        Headline numbers.
    more : sequence of Section
        Of a study of several cars; at the end.

    Returns
    -------
    Page
    """
    there, noise = measured.there, measured.noise
    return Page(
        title=f"Cabin noise of the compressor: {noise.car}",
        question=(
            "How loud is the running compressor at the driver's ear, by which mount and which hose "
            "does its sound get there, and how far may the synthesis be believed?"
        ),
        sections=(
            _asked(measured),
            _without_hoses(tables, figures),
            *(
                [_with_hoses(measured, figures, tables)]
                if there.car.operation.with_hoses(HoseState.STANDARD)
                else []
            ),
            _paths(tables, figures),
            _mounts(measured, tables, figures),
            *more,
        ),
        headlines=_headlines(summary),
        warnings=(*noise.alarms, *there.source.notices),
    )


def pictures(figures: Mapping[str, bytes], *stems: str) -> tuple[Picture, ...]:
    """Give figures their captions, those that were drawn."""
    return tuple(
        Picture(figures[stem], alt=CAPTIONS[stem], caption=CAPTIONS[stem])
        for stem in stems
        if stem in figures
    )


def _headlines(summary: Mapping[str, Scalar]) -> tuple[Headline, ...]:
    shown = (
        ("spl_peak_deviation_db", "largest deviation at a peak, soft hoses, outside 25–35 Hz"),
        ("spl_90_140_p90_db_with_hoses", "90 of 100 lines at 90–140 Hz, hoses modelled"),
        ("spl_90_140_p90_db_by_mounts", "the same, hoses left out"),
        ("hose_gain_db_90_140", "median gain by hoses over drawn fleets, 90–140 Hz"),
    )
    return tuple(
        Headline(f"{float(summary[key]):.1f} dB".replace("-", "−"), label)
        for key, label in shown
        if key in summary
    )


def _asked(measured: MeasuredNoise) -> Section:
    there = measured.there
    sweeps = "; ".join(
        f"{one.sweep}: {60 * one.frequency[0]:.0f}–{60 * one.frequency[-1]:.0f} rpm"
        for one in measured.noise.sweeps
    )
    return Section(
        "What was asked, and with which data",
        "A hammer test on a rig shows mass and mounts of the compressor. In the car its motion, "
        "and that of the body at each mount, were recorded while it ran up; with the stiffness of "
        "a mount, what both sides move apart is its force. Hammer tests on the body without "
        "compressor say how loud a force or a moment at each mount and each end of a hose is. "
        f"Force times that, summed with phases, is the sound. Sweeps: {sweeps}.\n\n"
        f"{there.shares.statement}\n\n{there.source.state.statement} To see this, the motion of "
        "the body was taken off the sweeps, which otherwise look like changed mounts.",
    )


def _without_hoses(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]) -> Section:
    peaks = tables["peaks"]
    own = peaks.drop(columns=["car", "laboratory", "paths"]) if len(peaks) else peaks
    return Section(
        "Without hoses",
        "Levels are compared at peaks of at least 6 dB prominence, paired within 1.5 Hz: in a "
        "notch the difference of two lines says nothing about noise. The thesis leaves out "
        "25–35 Hz, where the compressor swings on its mounts; the last column tells these peaks.",
        figures=pictures(figures, "figure_65_soft_hoses"),
        tables=(
            (Table(own, "Peaks with soft hoses.", dict.fromkeys(PEAK_COLUMNS, 0)),)
            if len(own)
            else ()
        ),
    )


def _with_hoses(
    measured: MeasuredNoise, figures: Mapping[str, bytes], tables: Mapping[str, pd.DataFrame]
) -> Section:
    hoses = measured.there.hoses
    if hoses is None:
        text = "The paths of the hoses were left out on request."
    else:
        fit = "; ".join(f"{name}: {chi:.2f}" for name, chi in hoses.reduced_chi)
        text = (
            "The hoses were identified as beams from the sweeps with standard and with soft hoses; "
            f"residuals over noise: {fit}. Their loads on the body at six degrees of freedom per "
            "end are further paths.\n\n" + "\n\n".join(hoses.statements)
        )
    shown = (
        (Table(in_words(tables["hoses"]), "Hoses, as drawn and as found; deviation: 1 σ."),)
        if "hoses" in tables
        else ()
    )
    return Section(
        "With the hoses of the car",
        text,
        figures=pictures(figures, "figure_66_standard_hoses"),
        tables=shown,
    )


def _paths(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]) -> Section:
    return Section(
        "By which way",
        "Parts add up to 100 %: each is the share of the A-weighted energy of the sum that is in "
        "phase with it. A negative part works against the others.",
        figures=pictures(figures, "contributions"),
        tables=(
            Table(
                tables["ranking"],
                "Mounts and hoses ranked, per sweep and band.",
                {
                    "part of the sound [%]": 0,
                    "alone [dB(A)]": 1,
                    "cut, the level changes by [dB]": 1,
                },
            ),
        ),
    )


def _mounts(
    measured: MeasuredNoise, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    there = measured.there
    scale = there.found.calibrated.parametrisation
    reference = getattr(scale, "reference_frequency", 20.0)
    return Section(
        "Single mounts, and the body under them",
        "Places come from the sheet of the car, directions and stiffness from the drawing, their "
        "sum from the hammer test. Where a deviation hardly falls from before to after, the number "
        "is the drawing's. The stiffness found is dynamic, its real part at "
        f"{reference:g} Hz; the drawn one static.",
        figures=pictures(figures, "body_motion"),
        tables=(Table(in_words(tables["mounts"]), "Mounts; deviations are 1 σ."),),
    )
