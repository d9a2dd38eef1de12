"""Levels of a running compressor: what is compared with what, and what is refused."""

import numpy as np
import pytest

from deboom.compressor.cabin_noise import NoiseBand, SweepNoise
from deboom.compressor.noise_comparison import (
    MODES,
    CarNoise,
    measured_gain_table,
    peak_deviations,
    ranking,
    soft_partner,
    sweep_errors,
)
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import HoseState
from deboom.measurement.electric_car import WrenchNoiseTransfer
from deboom.pages import compressor_noise as page
from deboom.report import Report
from deboom.runs.compressor_tests import FLOOR, NoisePlan

LINES = np.arange(20.0, 141.0)
PATHS = ("left x", "left y", "hose x")


def sweep(hoses, *, pressure=7.5e5, lines=LINES, hose=0.0, measured=1.0):
    """Peaks of 1 mPa and more at 30, 60 and 110 Hz, the last by the hose."""

    def bump(centre, height):
        return height / (1 + ((lines - centre) / 2) ** 2)

    parts = [1e-5 + bump(30, 1e-3), 1e-5 + bump(60, 2e-3), 1e-6 + hose * bump(110, 1e-3)]
    values = np.stack(parts, axis=1).astype(complex)
    total = values.sum(axis=1)
    return SweepNoise(
        f"{hoses.value} {1e-5 * pressure:g} bar",
        hoses,
        pressure,
        lines,
        PATHS,
        values,
        values,
        2,
        measured * total,
    )


def error_summary(noise):
    report = Report("")
    page.report_errors(report, sweep_errors(noise), measured_gain_table(noise))
    return report.summary


def case(*sweeps):
    bands = []
    for each in sweeps:
        level = each.level(each.total)
        ends = [level + off for off in (-1, 1, -1, 1)]
        besides = np.stack([np.full(level.size, off) for off in (-0.5, 0.5)])
        bands.append(NoiseBand(*ends, np.array([-0.3, 0.3]), besides, level))
    return CarNoise("EV", 1, sweeps, tuple(bands), (), 1.0, FLOOR)


def test_deviations_are_those_of_the_peaks():
    soft = sweep(HoseState.SOFT, measured=10 ** (-0.5 / 20))
    standard = sweep(HoseState.STANDARD, hose=1.0)
    errors = sweep_errors(case(soft, standard))
    assert peak_deviations(errors, HoseState.SOFT, without=MODES) == pytest.approx([0.5])
    assert peak_deviations(errors, HoseState.SOFT, only=MODES) == pytest.approx([0.5])
    assert peak_deviations(errors, HoseState.STANDARD) == pytest.approx([0, 0, 0], abs=1e-12)
    high = {"only": (90.0, 140.0)}
    assert peak_deviations(errors, HoseState.STANDARD, **high).size == 1
    assert peak_deviations(errors, HoseState.STANDARD, by_mounts=True, **high).size == 0
    assert errors[0].inside == 1.0
    assert errors[1].hose_band == pytest.approx(0, abs=1e-12)
    assert errors[1].hose_band_by_mounts < -10
    summary = error_summary(case(soft, standard))
    assert summary["spl_peak_deviation_db"] == pytest.approx(0.5)
    assert "spl_peak_deviation_db_by_mounts" not in summary
    assert summary["n_peaks_without_partner"] == 0


def test_gains_compare_sweeps_of_one_pressure():
    soft, standard = sweep(HoseState.SOFT), sweep(HoseState.STANDARD, hose=1.0)
    other = sweep(HoseState.STANDARD, pressure=13.5e5)
    both = case(soft, standard, other)
    assert soft_partner(both, standard) is soft
    assert soft_partner(both, other) is None
    table = measured_gain_table(both)
    assert len(table) == 1
    assert table["measured gain [dB]"].item() == pytest.approx(
        table["synthesised gain [dB]"].item()
    )
    assert table["measured gain [dB]"].item() > 10


def test_a_ranking_without_lines_of_a_band_leaves_it_out():
    low = sweep(HoseState.SOFT, lines=LINES[LINES < 80])
    assert set(ranking(low)["band"]) == {"20–80 Hz"}
    summary = error_summary(case(low, sweep(HoseState.STANDARD, lines=low.frequency)))
    assert "spl_90_140_p90_db_with_hoses" not in summary
    assert "measured_gain_db_90_140" not in summary
    assert all(np.isfinite(value) for value in summary.values())


def test_a_ranking_tells_who_works_against_the_others():
    opposed = sweep(HoseState.STANDARD, hose=-0.5)
    table = ranking(opposed).set_index(["band", "point"])
    part = table["part of the sound [%]"]
    assert part.groupby("band").sum().to_numpy() == pytest.approx(100)
    assert part.groupby("band").is_monotonic_decreasing.all()
    # the hose is louder than the mounts and in opposite phase
    assert part.loc["90–140 Hz", "hose"] > 100
    assert part.loc["90–140 Hz", "left"] < 0
    assert table.loc[("90–140 Hz", "left"), "cut, the level changes by [dB]"] > 0


def test_a_band_without_width_is_refused():
    with pytest.raises(InputError, match="50 to 50 Hz is no band"):
        NoisePlan(band=(50.0, 50.0))


def test_drawn_noise_transfer_functions_scatter_as_stated_and_alike_at_all_lines():
    """A wrong gain of the hammer moves every line and path together; noise does not."""
    lines, paths = np.arange(20.0, 24.0), ("mount 1 x", "mount 1 y")
    values = np.array([[2.0, 1j]] * 4)
    transfer = WrenchNoiseTransfer(
        Frf(lines, values[:, np.newaxis], ("ear",), paths, "Pa/N"),
        np.full((4, 2), 0.02),
        0.1 * values[np.newaxis],
    )
    np.testing.assert_allclose(transfer.deviation[0], np.hypot(0.02, [0.2, 0.1]))
    generator = np.random.default_rng(1)
    off = np.array([transfer.drawn(generator) - values for _ in range(4000)])
    rms = np.sqrt(np.mean(np.abs(off) ** 2, axis=0))
    np.testing.assert_allclose(rms, transfer.deviation, rtol=0.05)
    gain = (off / values).real
    assert np.corrcoef(gain[:, 0, 0], gain[:, 3, 1])[0, 1] > 0.9
