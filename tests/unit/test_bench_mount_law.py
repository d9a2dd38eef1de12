"""True mounts and bodies, runs, sensors and data sheets of the bench, and what they refuse."""

from dataclasses import fields, replace

import numpy as np
import pytest

from deboom.bench import sensors
from deboom.bench.fleet import load_fleet, modified_body
from deboom.bench.operating_run import PlannedRun, operate, true_run
from deboom.bench.powertrain import load_bench, play_operator, static_deflection
from deboom.errors import InputError

BENCH = load_bench()
LAWS = dict(
    zip(
        [f"{mount} {axis}" for mount in BENCH.mount_names for axis in "xyz"] + ["Du x"],
        BENCH.powertrain.laws + BENCH.wheel_end.laws,
        strict=True,
    )
)
AMPLITUDE = np.geomspace(1e-7, 5e-3, 40)[:, None]
FREQUENCY = np.linspace(5.0, 150.0, 30)


def test_dynamic_ratio_scales_the_dynamic_stiffness_and_not_the_static_curve():
    law = LAWS["EnM x"]
    softer = replace(law, dynamic_ratio=0.8)
    factor = softer.dynamic_factor(AMPLITUDE, FREQUENCY)
    assert factor == pytest.approx(0.8 * law.dynamic_factor(AMPLITUDE, FREQUENCY))
    deflection = np.linspace(-5e-3, 5e-3, 11)
    assert np.array_equal(softer.static_force(deflection), law.static_force(deflection))


FREQUENCY_2 = np.linspace(20.0, 80.0, 25)


def test_play_follows_a_load_that_rises_and_falls():
    outward = np.linspace(0, 2e-3, 41)
    path = np.concatenate([outward, outward[::-1]])[:, None]
    remembered = play_operator(path, 0.25e-3)[:, 0]
    rising, falling = remembered[:41], remembered[41:]
    assert np.all(rising[outward <= 0.25e-3] == 0)
    assert rising[outward > 0.25e-3] == pytest.approx(outward[outward > 0.25e-3] - 0.25e-3)
    back = outward[::-1]
    assert falling[back >= 1.5e-3 + 1e-9] == pytest.approx(1.75e-3)
    assert falling[back < 1.5e-3] == pytest.approx(back[back < 1.5e-3] + 0.25e-3)


def test_a_load_beyond_all_reach_is_an_error():
    load = np.full((1, 6), 1e9)
    with pytest.raises(ArithmeticError, match="no static equilibrium"):
        static_deflection(BENCH.powertrain, load)


def test_full_load_ramp_builds_up_from_zero_to_its_limit():
    rpm = np.array([700.0, 790.0, 1000.0, 1600.0, 4000.0])
    torque = BENCH.ramp.torque(220.0, rpm)
    assert np.all(torque[:2] == 0)
    assert np.all(np.diff(torque[1:]) > 0)
    assert torque[3] > 0.9 * 220
    assert torque[4] == pytest.approx(220.0, rel=1e-3)


def test_order_torque_grows_with_load_and_overrun_counts_as_no_load():
    rpm = np.full(3, 2000.0)
    none, overrun, loaded = BENCH.order_torque.torque(np.array([0.0, -50.0, 100.0]), rpm)
    assert overrun == none
    assert abs(none) == pytest.approx(38.0)
    assert abs(loaded) == pytest.approx(38 + 192.0)


@pytest.mark.parametrize("gear", [0, 8, -1])
def test_a_gear_that_does_not_exist_is_refused(gear):
    with pytest.raises(InputError, match=f"gear {gear}: the gearbox has the gears 1 to 7"):
        operate(BENCH, gear, np.full(25, 100.0), FREQUENCY_2)


RUN = true_run(BENCH, PlannedRun(5, 220.0), np.linspace(20.0, 80.0, 61))
NO_ERRORS = sensors.ErrorBudget(
    **{field.name: 0.0 for field in fields(sensors.ErrorBudget)} | {"bench_frequency": 248.0}
)


def measured(budget, seed):
    generator = np.random.default_rng(seed)
    instrumentation = sensors.draw_instrumentation(BENCH, budget, generator)
    return sensors.measured_run(instrumentation, RUN, budget, generator)


def test_without_errors_the_truth_comes_back():
    measurement = measured(NO_ERRORS, 1)
    assert measurement.displacement == pytest.approx(RUN.displacement, rel=1e-9, abs=1e-18)
    assert measurement.force == pytest.approx(RUN.force, rel=1e-9)


def test_cells_that_lose_and_mix_force_are_repaired_by_the_force_transfer_matrix():
    budget = replace(NO_ERRORS, cell_gain=0.05, cell_cross=0.05, cell_shunt=0.06, tilt=0.5)
    measurement = measured(budget, 1)
    assert measurement.force[:, :9] == pytest.approx(RUN.force[:, :9], rel=1e-9)
    assert measurement.displacement == pytest.approx(RUN.displacement, rel=1e-9, abs=1e-18)


SPOILS = {
    "displacement": "position angle gain cross_axis "
    "acceleration_own acceleration_norm acceleration_floor",
    "force": "shaker_angle shaker_gain force_own force_norm force_floor bench_flexibility",
}


@pytest.mark.parametrize(
    ("error", "quantity"), [(error, q) for q, errors in SPOILS.items() for error in errors.split()]
)
def test_each_error_spoils_its_own_quantity_in_proportion(error, quantity):
    size = getattr(sensors.ErrorBudget(), error)

    def deviation(scale):
        measurement = measured(replace(NO_ERRORS, **{error: scale * size}), 3)
        others = {"displacement": "force", "force": "displacement"}[quantity]
        assert getattr(measurement, others)[:, :9] == pytest.approx(
            getattr(RUN, others)[:, :9], rel=1e-9
        )
        return getattr(measurement, quantity)[:, :9] - getattr(RUN, quantity)[:, :9]

    full, tenth = deviation(1.0), deviation(0.1)
    assert np.linalg.norm(full) > 1e-5 * np.linalg.norm(getattr(RUN, quantity)[:, :9])
    assert np.linalg.norm(tenth) == pytest.approx(0.1 * np.linalg.norm(full), rel=0.05)


def test_noise_transfer_errors_have_the_stated_size():
    true = np.full((241, 10), 0.01 + 0.02j)

    def drawn(count, calibration_db=0.0, relative=0.0):
        stated = sensors.TransferErrors(calibration_db, relative, floor=0.0)
        made = [
            sensors.measured_noise_transfer(true, stated, np.random.default_rng(seed))
            for seed in range(1, 1 + count)
        ]
        return np.array(made) / true

    assert np.array_equal(drawn(1), np.ones((1, 241, 10)))
    levels = 20 * np.log10(np.abs(drawn(400, calibration_db=0.5)[:, 0, 0]))
    assert np.std(levels) == pytest.approx(0.5, rel=0.1)
    # cos² is 1 for the constant and 1/2 on average for the other five ripples
    expected = 0.05 * np.sqrt((1 + 5 / 2) / 6)
    errors = drawn(100, relative=0.05) - 1
    assert np.sqrt(np.mean(np.abs(errors) ** 2)) == pytest.approx(expected, rel=0.05)


def test_data_sheet_stays_within_its_tolerances_and_never_states_the_truth():
    scale = np.sqrt(np.outer(np.diag(BENCH.inertia), np.diag(BENCH.inertia)))
    for seed in range(1, 201):
        sheet = sensors.draw_data_sheet(BENCH, np.random.default_rng(seed))
        assert abs(sheet.mass - BENCH.mass) <= sensors.MASS_TOLERANCE
        assert np.all(np.abs(sheet.inertia - BENCH.inertia) <= sensors.INERTIA_TOLERANCE * scale)
        assert np.array_equal(sheet.inertia, sheet.inertia.T)
        assert np.all(np.abs(sheet.centre_error) <= sensors.CENTRE_TOLERANCE)
        assert not np.array_equal(sheet.inertia, BENCH.inertia)


BODY = load_fleet(1).bodies["U06-1"]
NOTHING = np.zeros(8)


def test_factors_on_local_shape_and_damping():
    factor, damping = np.linspace(0.5, 1.5, 10), np.linspace(0.5, 2.0, 8)
    changed = modified_body(BODY, NOTHING, NOTHING, factor, damping)
    assert changed.shapes_at_paths == pytest.approx(BODY.shapes_at_paths * factor)
    assert changed.damping_ratios == pytest.approx(BODY.damping_ratios * damping)
    assert changed.shapes_at_panels == pytest.approx(BODY.shapes_at_panels)


def test_a_body_that_loses_its_panels_keeps_a_lowest_frequency():
    flimsy = replace(BODY, damping_ratios=np.zeros(8))
    changed = modified_body(flimsy, NOTHING, np.full(8, -1e7))
    assert changed.frequencies.min() == pytest.approx(8.0)
    assert np.all(changed.damping_ratios == 0.0)
