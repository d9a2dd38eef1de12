"""What the written measurements are worth: near the truth by the study's error levels, never it."""

import numpy as np
import pytest

from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import load_bench
from deboom.bench.sensors import ErrorBudget, draw_instrumentation, measured_run
from deboom.files.platform import read_platform

BENCH = load_bench()
SEEDS = range(1, 201)


@pytest.fixture(scope="module")
def stiffness_errors():
    """RMS over the lines of the error of |K| in per cent, shape (seed, channel)."""
    run = true_run(BENCH, PlannedRun(5, 220.0), np.linspace(20.0, 80.0, 241))
    budget, errors = ErrorBudget(), []
    for seed in SEEDS:
        generator = np.random.default_rng(seed)
        instrumentation = draw_instrumentation(BENCH, budget, generator)
        found = measured_run(instrumentation, run, budget, generator)
        ratio = np.abs(found.force / found.displacement) / np.abs(run.stiffness)
        errors.append(100 * np.sqrt(np.mean((ratio - 1) ** 2, axis=0)))
    return run.channels, np.array(errors)


def columns(channels, axis):
    return [k for k, channel in enumerate(channels) if channel.endswith(axis)]


# The study's targets are 2 (3) % along x and 5 (10) % along z for a response surface over many
# runs; here it is one run, line by line, so that its noise comes on top.
@pytest.mark.parametrize(("axis", "median", "at_90"), [("x", 2.0, 3.0), ("z", 5.5, 12.0)])
def test_x_and_z_have_the_errors_of_the_study(stiffness_errors, axis, median, at_90):
    channels, errors = stiffness_errors
    found = errors[:, columns(channels, axis)]
    assert np.all(np.median(found, axis=0) < median)
    assert np.all(np.quantile(found, 0.9, axis=0) < at_90)
    assert np.all(np.median(found, axis=0) > 0.3)


def test_y_cannot_be_identified_with_half_a_degree(stiffness_errors):
    channels, errors = stiffness_errors
    found = np.median(errors[:, columns(channels, "y")], axis=0)
    # engine, gearbox, strut mount: the less they move along y, the worse
    assert np.all(found > [50, 25, 15])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = write_platform(tmp_path_factory.mktemp("bench") / "platform", seed=1)
    with np.load(folder / "truth" / "operating.npz", allow_pickle=False) as file:
        operating = dict(file)
    with np.load(folder / "truth" / "noise_transfer.npz", allow_pickle=False) as file:
        transfer = dict(file)
    return read_platform(folder), operating, transfer


def test_no_operating_spectrum_is_exact_and_none_is_wild(written):
    platform, truth, _ = written
    for k, name in enumerate(truth["load_cases"]):
        case = platform.load_case(str(name))
        assert case.displacement.channels == tuple(truth["channels"])
        for spectrum, quantity in ((case.displacement, "displacement"), (case.force, "force")):
            true = truth[quantity][k]
            error = np.abs(spectrum.values - true)
            assert np.all(error > 0)
            # per virtual point: what leaks into y is small against the motion along x
            for channel in columns(truth["channels"], "x"):
                largest = np.abs(true[:, channel]).max()
                assert np.sqrt(np.mean(error[:, channel] ** 2)) < 0.03 * largest
    # one sensor and one cell per side
    force = platform.load_case("g5_wot220").force
    assert np.all(force.values[:, -1] != force.values[:, -2])


def test_every_vehicle_has_its_own_calibration(written):
    platform, _, truth = written
    offsets = []
    for vehicle, true in zip(platform.fleet.vehicles, truth["noise_transfer"], strict=True):
        assert vehicle.noise_transfer.inputs == tuple(truth["paths"])
        error = vehicle.noise_transfer.values[:, 0] / true - 1
        assert np.all(error != 0)
        # the weakest paths drown in the floor of 0.02 mPa/N
        strong = np.abs(true) > 2e-3
        offsets.append(np.median(20 * np.log10(np.abs(1 + error[strong]))))
        assert np.median(np.abs(error[strong])) < 0.25
    assert 0.25 < np.std(offsets) < 0.9


def test_the_stated_powertrain_is_not_the_true_one(written):
    platform, _, _ = written
    stated = np.array([mount.positions[0] for mount in platform.mounts[:3]])
    offset = stated - BENCH.positions
    assert offset == pytest.approx(np.broadcast_to(offset[0], (3, 3)), abs=1e-9)
    assert np.all(np.abs(offset[0]) <= 0.002)
    assert np.all(offset[0] != 0)
