"""Figures of the sound that a running compressor makes at the ear, numbered as in the thesis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from deboom.measurement.operating_sweep import HoseState
from deboom.report.figures import DotPanel, MaskedPanel, dot_panels, masked_panels
from deboom.report.style import VEHICLE_PALETTE
from deboom.study.compressor_noise_levels import (
    HOSE_BAND,
    MODES,
    in_band,
    peak_deviations,
    sweep_errors,
)
from deboom.study.compressor_noise_tables import words

if TYPE_CHECKING:
    from deboom.arrays import RealArray
    from deboom.bench.hose_gain import HoseGain
    from deboom.study.compressor_noise import CarNoise, MeasuredNoise
    from deboom.study.compressor_noise_levels import SweepErrors

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


def figures_of(measured: MeasuredNoise) -> dict[str, bytes]:
    """Draw all pictures of one car; file stem → PNG."""
    noise = measured.noise
    figures = {}
    if _of(noise, HoseState.SOFT):
        figures["figure_65_soft_hoses"] = soft_hoses(noise)
    if _of(noise, HoseState.STANDARD):
        figures["figure_66_standard_hoses"] = standard_hoses(noise)
    figures["contributions"] = contributions(noise)
    figures["body_motion"] = body_motion(noise)
    return figures


def soft_hoses(noise: CarNoise) -> bytes:
    """Figure 65: synthesised against measured, paths of the hoses cut."""
    panels = []
    for place in _of(noise, HoseState.SOFT):
        one, band = noise.sweeps[place], noise.bands[place]
        panels.append(
            MaskedPanel(
                f"{noise.car}, {one.sweep}",
                LEVEL,
                one.frequency,
                {SYNTHESISED: one.level(one.total), MEASURED: one.level(one.measured)},
                ranges={SYNTHESISED: (band.lower, band.upper)},
            )
        )
    return masked_panels(panels, dashed=(MEASURED,))


def standard_hoses(noise: CarNoise) -> bytes:
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
            MaskedPanel(f"{noise.car}, {one.sweep}", LEVEL, one.frequency, curves, ranges=ranges)
        )
    return masked_panels(panels, dashed=(MEASURED,))


def contributions(noise: CarNoise) -> bytes:
    """Level of each mount and hose on its own beside that of all, lowest pressure."""
    lowest = min(one.pressure for one in noise.sweeps)
    panels = [
        MaskedPanel(
            f"{noise.car}, {one.sweep}",
            LEVEL,
            one.frequency,
            dict(zip(one.points, one.level(one.by_point).T, strict=True))
            | {ALL: one.level(one.total)},
        )
        for one in noise.sweeps
        if one.pressure == lowest
    ]
    return masked_panels(panels, dashed=(ALL,))


def body_motion(noise: CarNoise) -> bytes:
    """Change of level where the motion of the body is left out, or predicted."""
    lowest = min(one.pressure for one in noise.sweeps)
    panels = []
    for one in noise.sweeps:
        if one.pressure == lowest:
            total = one.level(one.total)
            panels.append(
                MaskedPanel(
                    f"{noise.car}, {one.sweep}",
                    "change of SPL [dB]",
                    one.frequency,
                    {
                        "body taken to stand still": one.level(one.still_body) - total,
                        "motion of the body predicted": one.level(one.predicted_body) - total,
                    },
                    masked={NOTCH: total < total.max() - NOTCH_DEPTH},
                )
            )
    return masked_panels(panels)


def all_cars(cases: Sequence[CarNoise]) -> bytes:
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
            panels.append(DotPanel(f"{label}\n|deviation| [dB]", values, limit, said))
    return dot_panels(panels, colours)


def hose_gain(gains: Sequence[HoseGain]) -> bytes:
    """How much louder hoses make cars drawn from the prior, line by line."""
    lines = gains[0].frequency
    every = np.vstack([gain.line_gain() for gain in gains])
    low, middle, high = np.percentile(every, SPREAD, axis=0)
    name = "median of all cars, and 10–90 %"
    return masked_panels(
        [
            MaskedPanel(
                "With hoses minus without",
                "gain [dB]",
                lines,
                {name: middle},
                ranges={name: (low, high)},
                levels={"thesis, from 90 Hz on: 5 dB": 5.0, "to 10 dB": 10.0},
                note=f"{len(every)} cars, hoses as drawn",
            )
        ]
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
