"""What other forces change at the ears, for changes with a known outcome."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.mounts.surface_forces import SurfaceForces
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.surface_check import PEAKS, SurfaceCheck, level_differences, surface_check

FREQUENCY = np.linspace(20.0, 60.0, 161)
BAND = (20.0, 60.0)
MOUNT = Mount("TSM", "", ("",), ((0.0, 0.0, 0.0),), ("x",))


def resonance(centre, damping=0.03):
    return 1e-3 / (1 - (FREQUENCY / centre) ** 2 + 2j * damping * FREQUENCY / centre)


def vehicle(name, transfer):
    return Vehicle(name, "A", Frf(FREQUENCY, transfer[:, None, None], ("ear",), ("TSM x",), "Pa/N"))


FLEET = Fleet(
    (
        vehicle("peaky", resonance(33.0) + resonance(47.0)),
        vehicle("flat", np.full(FREQUENCY.size, 1e-3)),
    )
)


def load_case(force):
    values = np.asarray(force, dtype=complex).reshape(-1, 1)
    motion = np.ones((FREQUENCY.size, 1))
    return LoadCase(
        "g5",
        "5th gear",
        5,
        3.4,
        220.0,
        1.5,
        Spectrum(FREQUENCY, motion, ("TSM x",), "m"),
        Spectrum(FREQUENCY, values, ("TSM x",), "N"),
    )


MEASURED = load_case(np.ones(FREQUENCY.size))


def differences(force):
    table = level_differences(FLEET, [MOUNT], MEASURED, load_case(force), BAND)
    return table.set_index("vehicle")


def test_the_same_forces_differ_in_nothing():
    table = differences(np.ones(FREQUENCY.size))
    assert table["corr_f [1]"].to_numpy() == pytest.approx([0, 0], abs=1e-12)
    assert (table["rms difference [dB]"] == 0).all()
    assert list(table["peaks"]) == [2, 0]
    assert table.loc["peaky", PEAKS] == 0
    assert np.isnan(table.loc["flat", PEAKS])


def test_a_tenth_more_force_is_the_same_shape_and_0_83_db_everywhere():
    table = differences(np.full(FREQUENCY.size, 1.1))
    expected = 20 * np.log10(1.1)
    assert table["corr_f [1]"].to_numpy() == pytest.approx([0, 0], abs=1e-12)
    assert table["rms difference [dB]"].to_numpy() == pytest.approx(expected)
    assert table.loc["peaky", PEAKS] == pytest.approx(expected)


def test_the_peak_that_changes_most_is_named():
    force = np.where(FREQUENCY < 40, 0.8, 1.05)
    table = differences(force)
    assert table.loc["peaky", PEAKS] == pytest.approx(-20 * np.log10(0.8))
    assert table.loc["peaky", "frequency of that peak [Hz]"] == pytest.approx(33.0, abs=0.5)
    ratio = np.sum(force) ** 2 / (np.sum(force**2) * FREQUENCY.size)
    assert table.loc["flat", "corr_f [1]"] == pytest.approx(1 - ratio)


def test_a_peak_that_vanishes_is_counted_and_still_compared():
    notch = 1 - 0.97 * np.exp(-(((FREQUENCY - 47) / 3) ** 2))
    table = differences(notch)
    assert table.loc["peaky", "peaks of one curve only"] >= 1
    assert table.loc["peaky", PEAKS] > 6


def check_of(force, kept):
    modelled = SurfaceForces(load_case(force), kept, {})
    other = SurfaceForces(replace(load_case(force), name="g6"), kept, {})
    pairs = [(MEASURED, modelled), (replace(MEASURED, name="g6"), other)]
    return surface_check(FLEET, [MOUNT], pairs, BAND)


def test_the_check_names_what_stays_measured_once():
    check = check_of(np.full(FREQUENCY.size, 1.02), {"TSM y": "not identified"})
    assert list(check.table["load case"]) == ["g5", "g5", "g6", "g6"]
    assert check.kept == ("TSM y (not identified)",)
    assert check.at_peaks == pytest.approx(20 * np.log10(1.02))
    assert check.agrees
    assert "booming peaks differ by up to 0.17 dB" in check.text
    assert check.text.endswith("The measured force stays in TSM y (not identified).")


def test_more_than_0_3_db_at_a_peak_is_no_agreement():
    assert not check_of(np.full(FREQUENCY.size, 1.05), {}).agrees


def test_without_any_peak_nothing_is_claimed():
    table = pd.DataFrame(
        {PEAKS: [np.nan], "rms difference [dB]": [0.1], "corr_f [1]": [0.0], "vehicle": ["flat"]}
    )
    check = SurfaceCheck(table, ())
    assert "no booming peak" in check.text
    assert not check.agrees
