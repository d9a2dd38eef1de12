"""Sensors, laboratory, data sheet: without errors the truth comes back, with them it does not."""

from dataclasses import fields, replace

import numpy as np
import pytest

from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.powertrain import load_bench
from deboom.bench.sensors import (
    CENTRE_TOLERANCE,
    INERTIA_TOLERANCE,
    MASS_TOLERANCE,
    ErrorBudget,
    TransferErrors,
    draw_data_sheet,
    draw_instrumentation,
    measured_noise_transfer,
    measured_run,
)

BENCH = load_bench()
RUN = true_run(BENCH, PlannedRun(5, 220.0), np.linspace(20.0, 80.0, 61))
NO_ERRORS = ErrorBudget(
    **{field.name: 0.0 for field in fields(ErrorBudget)} | {"bench_frequency": 248.0}
)


def measured(budget, seed):
    generator = np.random.default_rng(seed)
    instrumentation = draw_instrumentation(BENCH, budget, generator)
    return measured_run(instrumentation, RUN, budget, generator)


def test_without_errors_the_truth_comes_back():
    found = measured(NO_ERRORS, 1)
    assert found.displacement == pytest.approx(RUN.displacement, rel=1e-9, abs=1e-18)
    assert found.force == pytest.approx(RUN.force, rel=1e-9)


def test_cells_that_lose_and_mix_force_are_repaired_by_the_force_transfer_matrix():
    budget = replace(NO_ERRORS, cell_gain=0.05, cell_cross=0.05, cell_shunt=0.06, tilt=0.5)
    found = measured(budget, 1)
    assert found.force[:, :9] == pytest.approx(RUN.force[:, :9], rel=1e-9)
    assert found.displacement == pytest.approx(RUN.displacement, rel=1e-9, abs=1e-18)


SPOILS = {
    "displacement": "position angle gain cross_axis "
    "acceleration_own acceleration_norm acceleration_floor",
    "force": "shaker_angle shaker_gain force_own force_norm force_floor bench_flexibility",
}


@pytest.mark.parametrize(
    ("error", "quantity"), [(error, q) for q, errors in SPOILS.items() for error in errors.split()]
)
def test_each_error_spoils_its_own_quantity_in_proportion(error, quantity):
    size = getattr(ErrorBudget(), error)

    def deviation(scale):
        found = measured(replace(NO_ERRORS, **{error: scale * size}), 3)
        others = {"displacement": "force", "force": "displacement"}[quantity]
        assert getattr(found, others)[:, :9] == pytest.approx(getattr(RUN, others)[:, :9], rel=1e-9)
        return getattr(found, quantity)[:, :9] - getattr(RUN, quantity)[:, :9]

    full, tenth = deviation(1.0), deviation(0.1)
    assert np.linalg.norm(full) > 1e-5 * np.linalg.norm(getattr(RUN, quantity)[:, :9])
    assert np.linalg.norm(tenth) == pytest.approx(0.1 * np.linalg.norm(full), rel=0.05)


def test_noise_transfer_errors_have_the_stated_size():
    true = np.full((241, 10), 0.01 + 0.02j)
    clean = measured_noise_transfer(
        true, TransferErrors(calibration_db=0.0, relative=0.0, floor=0.0), np.random.default_rng(1)
    )
    assert np.array_equal(clean, true)
    only_calibration = TransferErrors(relative=0.0, floor=0.0)
    levels = [
        20 * np.log10(np.abs(found[0, 0] / true[0, 0]))
        for found in (
            measured_noise_transfer(true, only_calibration, np.random.default_rng(seed))
            for seed in range(1, 401)
        )
    ]
    assert np.std(levels) == pytest.approx(0.5, rel=0.1)
    only_smooth = TransferErrors(calibration_db=0.0, floor=0.0)
    errors = np.concatenate(
        [
            measured_noise_transfer(true, only_smooth, np.random.default_rng(seed)) / true - 1
            for seed in range(1, 101)
        ]
    )
    # cos² is 1 for the constant and 1/2 on average for the other five ripples
    expected = 0.05 * np.sqrt((1 + 5 / 2) / 6)
    assert np.sqrt(np.mean(np.abs(errors) ** 2)) == pytest.approx(expected, rel=0.05)


def test_data_sheet_stays_within_its_tolerances_and_never_states_the_truth():
    scale = np.sqrt(np.outer(np.diag(BENCH.inertia), np.diag(BENCH.inertia)))
    for seed in range(1, 201):
        sheet = draw_data_sheet(BENCH, np.random.default_rng(seed))
        assert abs(sheet.mass - BENCH.mass) <= MASS_TOLERANCE
        assert np.all(np.abs(sheet.inertia - BENCH.inertia) <= INERTIA_TOLERANCE * scale)
        assert np.array_equal(sheet.inertia, sheet.inertia.T)
        assert np.all(np.abs(sheet.centre_error) <= CENTRE_TOLERANCE)
        assert not np.array_equal(sheet.inertia, BENCH.inertia)
