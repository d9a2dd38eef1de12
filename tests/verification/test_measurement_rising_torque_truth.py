"""The rising-torque filter against the virtual bench: which lines it keeps, and what that buys."""

import numpy as np
import pytest

from deboom.bench.campaign_operation import true_run
from deboom.bench.campaign_plan import PlannedRun
from deboom.bench.parameters import load_bench
from deboom.measurement.rising_torque import RunDirection, rising_lines, rising_runs
from deboom.mounts.response_surface import DynamicStiffnessSurface

BENCH = load_bench()
FREQUENCY = np.linspace(20, 80, 241)
DURATION = 90.0
TORQUE_NOISE = 1.0
WINDOW = 9.0
TIME = np.linspace(0, DURATION, FREQUENCY.size)


def full_load(limit):
    return true_run(BENCH, PlannedRun(5, limit, full_load=True), FREQUENCY).engine_torque


@pytest.mark.parametrize("limit", [120.0, 160.0, 220.0])
def test_good_lines_stay_and_falling_ones_go(limit):
    """On a run-up almost all stay, plateau included; raw differences lose two lines in five."""
    generator = np.random.default_rng(1)
    torque = full_load(limit)
    falling = np.diff(torque[::-1], append=torque[0]) < -0.3
    kept, raw, left = [], [], []
    for _ in range(50):
        noise = generator.normal(0, TORQUE_NOISE, (2, torque.size))
        kept.append(rising_lines(TIME, torque + noise[0], WINDOW, TORQUE_NOISE).mean())
        raw.append((np.gradient(torque + noise[0]) > 0).mean())
        down = rising_lines(TIME, torque[::-1] + noise[1], WINDOW, TORQUE_NOISE)
        left.append(down[falling].mean())
    assert np.mean(kept) > 0.995
    assert 0.5 < np.mean(raw) < 0.75
    assert np.mean(left) < 0.05


def test_the_direction_of_the_run_removes_the_hysteresis():
    """Lines of rising and falling runs lie on two branches: one surface cannot follow both."""
    plans = [
        PlannedRun(gear, torque, full_load, rising)
        for rising in (True, False)
        for gear in (5, 6, 7)
        for torque, full_load in ((120.0, True), (220.0, True), (60.0, False), (140.0, False))
    ]
    runs = [true_run(BENCH, plan, FREQUENCY[::2]) for plan in plans]
    preload = np.concatenate(
        [
            run.engine_torque * BENCH.total_ratios[plan.gear - 1]
            for run, plan in zip(runs, plans, strict=True)
        ]
    )
    column = runs[0].channels.index("TSM x")
    amplitude = np.abs(np.concatenate([run.displacement[:, column] for run in runs]))
    stiffness = np.concatenate([run.stiffness[:, column] for run in runs])
    frequency = np.tile(FREQUENCY[::2], len(runs))
    name = [plan.name for plan in plans for _ in FREQUENCY[::2]]
    directions = {
        plan.name: RunDirection.RISING if plan.rising else RunDirection.FALLING for plan in plans
    }
    rising = rising_runs(name, directions)
    assert rising.sum() == rising.size / 2

    def rms_error(lines):
        surface = DynamicStiffnessSurface.fit(
            preload[lines], amplitude[lines], frequency[lines], stiffness[lines], preload_unit="N m"
        )
        fitted = surface.predict(preload[rising], amplitude[rising], frequency[rising])
        return np.sqrt(np.mean(np.abs(fitted / stiffness[rising] - 1) ** 2))

    assert rms_error(rising) < 0.01
    assert rms_error(np.ones_like(rising)) > 0.05
