"""The response surface and its alternatives against the virtual bench's true stiffness."""

import numpy as np
import pytest

from deboom.bench.campaign_operation import static_direction_forces, true_run
from deboom.bench.campaign_plan import LOW_GEAR_RUNS, TRAINING_RUNS, PlannedRun
from deboom.bench.parameters import load_bench
from deboom.bench.suspended_body import operating_stiffness
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.model_comparison import compare_models, standard_models
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.mounts.stiffness_model import StiffnessSamples

BENCH = load_bench()
FREQUENCY = np.linspace(20, 80, 81)
DIRECTIONS = [f"{mount} {axis}" for mount in BENCH.mount_names for axis in "xyz"]
CHECK = [
    PlannedRun(gear, limit, full_load=True)
    for gear, limit in ((5, 120), (5, 220), (6, 120), (6, 160), (6, 220), (7, 220))
]
UNTRAINED = [
    PlannedRun(gear, limit, full_load=True) for gear in (5, 6, 7) for limit in (140.0, 190.0)
]
RUNS = {
    plan: true_run(BENCH, plan, FREQUENCY)
    for plan in dict.fromkeys([*TRAINING_RUNS, *LOW_GEAR_RUNS, *CHECK, *UNTRAINED])
}


def samples(plans, direction, preload="wheel torque"):
    """Lines of true runs, over wheel torque or over the static force of the direction."""
    column = RUNS[plans[0]].channels.index(direction)
    if preload == "wheel torque":
        parts = [RUNS[plan].engine_torque * BENCH.total_ratios[plan.gear - 1] for plan in plans]
    else:
        parts = [static_direction_forces(BENCH, RUNS[plan])[:, column] for plan in plans]
    return StiffnessSamples(
        np.concatenate(parts),
        np.concatenate([RUNS[plan].displacement[:, column] for plan in plans]),
        np.tile(FREQUENCY, len(plans)),
        np.concatenate([RUNS[plan].stiffness[:, column] for plan in plans]),
        run=np.repeat([plan.name for plan in plans], FREQUENCY.size),
    )


def rms_error(surface, lines):
    fitted = surface.predict(lines.preload, lines.amplitude, lines.frequency)
    return np.sqrt(np.mean(np.abs(fitted / lines.stiffness - 1) ** 2))


@pytest.mark.parametrize("preload", ["wheel torque", "static force"])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_two_pieces_follow_the_true_law_in_every_direction(direction, preload):
    """Noise-free: at most 1 % rms on the training runs and on the thesis's six load cases."""
    training = samples(TRAINING_RUNS, direction, preload)
    surface = DynamicStiffnessSurface.fit(*training.lines)
    assert rms_error(surface, training) < 0.01
    assert rms_error(surface, samples(CHECK, direction, preload)) < 0.01
    assert surface.r2_real > 0.998
    assert surface.r2_imag > 0.99


@pytest.mark.parametrize("direction", ["EnM x", "GeM z", "TSM x"])
def test_runs_at_other_torque_limits_are_predicted(direction):
    surface = DynamicStiffnessSurface.fit(*samples(TRAINING_RUNS, direction).lines)
    assert rms_error(surface, samples(UNTRAINED, direction)) < 0.01


def test_the_best_split_halves_the_error_of_the_threshold():
    training = samples(TRAINING_RUNS, "TSM x")
    best = DynamicStiffnessSurface.fit(*training.lines)
    threshold = DynamicStiffnessSurface.fit(
        *training.lines, options=PieceOptions(split="threshold")
    )
    assert rms_error(best, training) < 0.5 * rms_error(threshold, training)


def test_seven_inflections_need_a_third_piece_and_cross_validation_finds_it():
    """Gears 3 to 7 take the strut through all its stops."""
    training = samples([*TRAINING_RUNS, *LOW_GEAR_RUNS], "TSM x")
    two = DynamicStiffnessSurface.fit(*training.lines)
    chosen = DynamicStiffnessSurface.fit(
        *training.lines, options=PieceOptions(pieces="cv", max_pieces=4), run=training.run
    )
    assert two.real.n_pieces == 2
    assert rms_error(two, training) > 0.02
    assert chosen.real.n_pieces >= 3
    assert rms_error(chosen, training) < 0.005


@pytest.mark.parametrize("direction", ["EnM z", "TSM x"])
def test_the_guard_separates_known_from_unknown(direction):
    """True law asked anywhere in the box of the ranges: inside the error is small, outside not."""
    training = samples(TRAINING_RUNS, direction)
    surface = DynamicStiffnessSurface.fit(*training.lines)
    assert surface.inside(training.preload, training.amplitude, training.frequency).all()
    generator = np.random.default_rng(1)
    lower, upper = surface.region.lower, surface.region.upper
    rows = generator.uniform(
        lower - 0.1 * (upper - lower), upper + 0.1 * (upper - lower), (2500, 3)
    )
    rows[:, 1] = np.maximum(rows[:, 1], 5e-6)
    truth = _true_stiffness(training, rows, direction)
    stiffness, inside = surface.predict_masked(*rows.T)
    error = np.abs(stiffness / truth - 1)
    assert 0.02 < inside.mean() < 0.4
    assert np.median(error[inside]) < 0.03
    assert np.quantile(error[inside], 0.95) < 0.15
    assert np.median(error[~inside]) > 0.2
    # convex hull and ranges alone would have let most of the bad points pass
    in_range = surface.region.in_range(rows).all(axis=1)
    assert np.quantile(error[in_range & ~inside], 0.5) > 0.1


def _true_stiffness(training, rows, direction):
    """Ask the true law at wheel torque, own amplitude and frequency, on the rising branch."""
    column = DIRECTIONS.index(direction)
    run = RUNS[TRAINING_RUNS[0]]
    wheel = np.concatenate(
        [RUNS[plan].engine_torque * BENCH.total_ratios[plan.gear - 1] for plan in TRAINING_RUNS]
    )
    static = np.concatenate([RUNS[plan].powertrain.static_deflection for plan in TRAINING_RUNS])
    order = np.argsort(wheel)
    deflection = np.stack(
        [
            np.interp(rows[:, 0], wheel[order], static[order, k])
            for k in range(run.powertrain.static_deflection.shape[1])
        ],
        axis=1,
    )
    play = BENCH.powertrain.play
    remembered = np.sign(deflection) * np.maximum(np.abs(deflection) - play, 0)
    others = np.concatenate([np.abs(RUNS[plan].powertrain.displacement) for plan in TRAINING_RUNS])
    scaled = (training.points - rows.min(axis=0)) / np.ptp(rows, axis=0)
    asked = (rows - rows.min(axis=0)) / np.ptp(rows, axis=0)
    nearest = np.array([np.argmin(np.sum((scaled - row) ** 2, axis=1)) for row in asked])
    # the other axes of the mount move in the proportion of the nearest measured line
    amplitude = others[nearest] * (rows[:, 1] / others[nearest, column])[:, np.newaxis]
    return operating_stiffness(BENCH.powertrain, remembered, amplitude, rows[:, 2])[:, column]


def test_the_interval_covers_new_noisy_lines():
    generator = np.random.default_rng(2)
    training, check = samples(TRAINING_RUNS, "TSM x"), samples(UNTRAINED, "TSM x")

    def noisy(stiffness):
        noise = generator.normal(size=(2, stiffness.size)) * 2e4
        return stiffness + noise[0] + 1j * noise[1]

    surface = DynamicStiffnessSurface.fit(*training.lines[:3], noisy(training.stiffness))
    lower, upper = surface.prediction_interval(check.preload, check.amplitude, check.frequency)
    measured = noisy(check.stiffness)
    for part in (np.real, np.imag):
        covered = (part(lower) <= part(measured)) & (part(measured) <= part(upper))
        assert 0.92 < covered.mean() < 0.98


def test_the_amplitude_of_a_run_comes_back_from_the_surface():
    """Fixed point on the collapsed cubic: a run never trained, with the bench's own force."""
    direction = "TSM x"
    surface = DynamicStiffnessSurface.fit(*samples(TRAINING_RUNS, direction).lines)
    lines = samples(UNTRAINED, direction)
    cubic = surface.at_amplitude(lines.preload, lines.frequency)
    force = np.abs(lines.force)
    amplitude = np.full(len(lines), 1e-4)
    for _ in range(60):
        amplitude = cubic.held(force / np.abs(cubic(amplitude)))
    assert surface.inside(lines.preload, amplitude, lines.frequency).mean() > 0.95
    np.testing.assert_allclose(amplitude, lines.amplitude, rtol=0.06)


def test_the_table_ranks_the_models_as_the_law_asks():
    """The bench's rubber softens with the amplitude, which Kelvin-Voigt cannot follow."""
    fits = standard_models()
    del fits["Gaussian process"], fits["cubics, cross-validated"]
    check = samples(UNTRAINED, "TSM x")
    table = compare_models(fits, samples(TRAINING_RUNS, "TSM x"), check, check.stiffness)
    error = table.set_index("model")["rms error against truth [%]"]
    assert error["splines"] < error["two cubics, least squares"] < 1
    assert error["two cubics, least squares"] < error["one cubic"] < 3
    assert error["Berg"] < 2
    assert error["Kelvin-Voigt"] > 5
    assert (table["R² Re force [%]"] > 98).all()
