"""Cabin noise against the coupled car."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from compressor_cabin_samples import (
    CASES,
    LINES,
    bench_operation,
    body_of,
    cars,
    drawings,
    index_of,
    mounts,
    running,
    some_designs,
)
from threadpoolctl import threadpool_limits

from deboom.bench.choices import CompressorCase
from deboom.bench.compressor_rig import true_source
from deboom.bench.compressor_truth import CompressorPlan, drawn_hoses
from deboom.bench.electric_car import HOSES, MOUNTS, columns_of, design_pressure, run_car
from deboom.bench.electric_car_writer import CAR_PLAN, write_electric_car
from deboom.bench.powertrain import read_data
from deboom.compressor import body_loads, cabin_index
from deboom.compressor.cabin_noise import cabin_noise, noise_bands, running_in_car
from deboom.compressor.hammer_identification import identify
from deboom.compressor.identified_compressor import IdentifyOptions
from deboom.compressor.mount_shares import mount_shares
from deboom.errors import InputError
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.space import DesignSpace
from deboom.files.electric_car import read_electric_car
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import CompressorMount, HoseState
from deboom.measurement.electric_car import wrench_noise_transfer
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.measurement.virtual_point import RIGID_MOTIONS
from deboom.physics.rigid_body import forward_matrices, mass_matrix, shift_matrix
from deboom.physics.sound_level import spl

IDENTICAL = CompressorPlan(CompressorCase.TABLE11, identical_mounts=True)


@pytest.fixture(scope="module")
def running_1(tmp_path_factory):
    """Everything known of the compressor in a car that was measured without errors."""
    folder = tmp_path_factory.mktemp("car") / "EV-1"
    plan = replace(CAR_PLAN, compressor=IDENTICAL, mount_storage=0.9, mount_loss=1.1)
    write_electric_car(folder, 1, "EV-1", plan=plan, noise_free=True)
    car = read_electric_car(folder)
    with threadpool_limits(1):
        return running_in_car(
            car, identify(car.operation.hammer, IdentifyOptions(largest_lines=36))
        )


@pytest.fixture(scope="module")
def sweeps(running_1):
    return cabin_noise(running_1)


def test_the_sound_is_that_of_the_bench(sweeps):
    """Placement is fitted within its tolerances, mounts changed by 10 %: 1e-3 of the sound."""
    assert [sweep.hoses for sweep in sweeps].count(HoseState.SOFT) == 2
    for sweep in sweeps:
        off = np.linalg.norm(sweep.total - sweep.measured) / np.linalg.norm(sweep.measured)
        assert off < 2e-3, sweep.sweep
        assert sweep.total == pytest.approx(sweep.by_point.sum(axis=1))


def test_without_the_hoses_much_is_missing(sweeps):
    for sweep in sweeps:
        high = sweep.frequency >= 90
        off = np.abs(sweep.level(sweep.by_mounts) - sweep.level(sweep.measured))[high]
        assert (np.percentile(off, 90) > 3) == (sweep.hoses is HoseState.STANDARD)


def test_the_noise_of_a_microphone_is_in_the_band(running_1):
    """Far above the sound: half of the draws are below ``σ √(2 ln 2)``, the median of Rayleigh."""
    deviation = 100.0
    operation = replace(running_1.car.operation, sound_deviation={running_1.car.ear: deviation})
    noisy = replace(running_1, car=replace(running_1.car, operation=operation))
    lines = cabin_noise(running_1)[0].frequency
    expected = spl(np.full(lines.size, deviation * np.sqrt(2 * np.log(2))), lines)
    transfer = wrench_noise_transfer(noisy.car)
    middle = noise_bands(noisy, transfer, draws=60)[0].middle
    assert np.median(middle - expected) == pytest.approx(0.0, abs=0.3)


def test_the_state_of_the_mounts_shows_in_spite_of_the_moving_body(running_1):
    assert running_1.source.state.changed
    lines = np.arange(20.0, 51.0)
    gain = running_1.identification.calibrated.model.gain.at(lines)
    true = (0.9 * gain.real + 1.1j * gain.imag) / gain - 1
    change = running_1.source.state.significant(lines)
    assert change == pytest.approx(true, abs=5e-3)
    assert np.median(np.abs(change - true)) < 2e-3


def test_identical_mounts_are_seen_one_by_one(running_1):
    shares = running_1.shares
    assert shares.identical
    assert not shares.alarms
    assert "agrees with identical round mounts" in shares.statement
    true = np.array(read_data("compressor.json")["truth"]["mount_position_m"])
    assert np.abs(np.array([mount.position for mount in shares.mounts]) - true).max() < 5e-5
    stiffness = np.array([mount.stiffness for mount in shares.mounts])
    assert np.ptp(stiffness, axis=0).max() < 1e-9 * stiffness.max()
    # what a round mount does about its own axis no test tells
    assert shares.deviations[:, 3] == pytest.approx(shares.prior_deviations[3])
    # the sheet states its tolerances although nothing is off
    assert shares.deviations[:, :3].max() < 1e-3


def test_draws_of_the_mounts_scatter_as_their_covariance_says(running_1):
    placed = tuple(replace(m, position=m.position + 2e-3) for m in running_1.shares.drawn)
    uneven = tuple(
        replace(m, stiffness=m.stiffness * factor)
        for m, factor in zip(placed, (1.3, 1.0, 0.8), strict=True)
    )
    shares = mount_shares(running_1.identification, uneven, position=1e-5)
    assert not shares.identical
    assert shares.alarms
    assert "contradict" in shares.alarms[0]
    assert "the mounts are not identical and round" in shares.statement
    alike = mount_shares(running_1.identification, uneven, position=1e-5, identical=True)
    stiffness = np.array([mount.stiffness for mount in alike.mounts])
    assert alike.identical
    assert np.ptp(stiffness, axis=0).max() < 1e-9 * stiffness.max()
    generator, zero = np.random.default_rng(1), np.zeros(20)
    drawn = [shares.at_random(zero, generator) for _ in range(400)]
    stiffness = np.log([[mount.stiffness for mount in mounts] for mounts in drawn])
    assert np.all(stiffness.std(axis=0) <= 1.2 * shares.deviations[:, 6:])


def test_bands_hold_the_sound(running_1, sweeps):
    transfer = wrench_noise_transfer(running_1.car)
    bands = noise_bands(running_1, transfer, draws=20)
    again = noise_bands(running_1, transfer, draws=20)
    for sweep, band, twin in zip(sweeps, bands, again, strict=True):
        assert np.array_equal(band.lower, twin.lower)
        level = sweep.level(sweep.total)
        assert np.mean((level >= band.lower) & (level <= band.upper)) > 0.8
        assert np.median(band.upper - band.lower) < 3
        off = level - band.middle
        common = np.median(off)
        assert band.common[0] <= common <= band.common[1]
        assert np.mean((off - common >= band.besides[0]) & (off - common <= band.besides[1])) > 0.8
        # both parts make up the whole, as errors that do not know of each other
        both = np.hypot(band.common_half_width, band.line_half_width)
        assert both == pytest.approx(np.median(band.upper - band.lower) / 2, rel=0.25)


def test_what_cannot_be_answered_is_refused(running_1):
    car, operation, hammer = running_1.car, running_1.car.operation, running_1.car.operation.hammer
    fewer = replace(hammer.drawing, mounts=hammer.drawing.mounts[:2])
    others = tuple(replace(hose, name="other " + hose.name) for hose in operation.hoses)
    for bad, words in (
        ({"hammer": replace(hammer, drawing=None)}, "the hammer test has no drawing"),
        (
            {"hammer": replace(hammer, drawing=fewer)},
            "the drawing has mount 1, mount 2, the car mount 1, mount 2, mount 3",
        ),
        ({"hoses": ()}, "standard hoses, of which there is no drawing: add"),
        ({"hoses": others}, "no noise transfer functions at the body's end of other"),
    ):
        with pytest.raises(InputError, match=words):
            running_in_car(
                replace(car, operation=replace(operation, **bad)), running_1.identification
            )
    with pytest.raises(InputError, match="fewer than two mounts"):
        mount_shares(running_1.identification, running_1.shares.drawn[:1])
    with pytest.raises(InputError, match="has no line between 200 and 300 Hz"):
        cabin_noise(running_1, band=(200.0, 300.0))
    with pytest.raises(InputError, match="no body-side acceleration 'mount 1 x': record it"):
        body_loads.holder_displacement(
            replace(operation.sweeps[0], holder=None), running_1.shares.mounts
        )
    with pytest.raises(InputError, match=r"no line at 20\.3 Hz, they go from 15 to 150 Hz"):
        wrench_noise_transfer(car).at([20.3])


@pytest.mark.parametrize("with_hoses", [False, True])
def test_any_mounts_sound_as_in_the_coupled_bench(with_hoses):
    index = index_of(with_hoses=with_hoses, places=False)
    compressor = bench_operation().laboratory.compressor
    designs = some_designs(index, 20, seed=1)
    stiffness = index.variables.factors(designs).reshape(-1, 3, 3) * compressor.stiffness
    hoses = compressor.hoses if with_hoses else ()
    for case, gas in CASES.items():
        exact = np.stack(
            [
                design_pressure(
                    car, compressor, bench_operation().source, LINES, stiffness, hoses, gas
                )
                for car in cars()
            ],
            axis=1,
        )
        assert np.abs(index.pressure(designs, case) / exact - 1).max() < 1e-11
        np.testing.assert_allclose(index.levels(designs, case), spl(exact, LINES, axis=-1))


def test_the_sum_is_weighted_over_the_pressures():
    index = index_of(places=False, weights=(1.0, 3.0))
    designs = some_designs(index, 3, seed=2)
    low, high = (index.levels(designs, case).sum(axis=-1) for case in CASES)
    np.testing.assert_allclose(index(designs), 0.25 * low + 0.75 * high, rtol=1e-13)
    with pytest.raises(InputError, match="no case 'c'"):
        index.levels(designs, "c")


def test_a_mount_that_stands_off_is_a_mount_that_stands_there():
    """Compressor and body seen from where the mounts are, with nothing left to shift."""
    index = index_of()
    designs = some_designs(index, 1, seed=4, place_mm=8.0)
    off = 1e-3 * (designs[0, -9:] - 100.0).reshape(3, 3)
    moved = tuple(replace(m, position=m.position + d) for m, d in zip(mounts(), off, strict=True))
    seams = []
    for car in cars():
        body = body_of(car)
        shift = np.zeros((18, 18))
        for number, at in enumerate(off):
            rows = slice(6 * number, 6 * number + 6)
            shift[rows, rows] = shift_matrix(-at)
        moved_body = cabin_index.BodySide(
            body.name,
            LINES,
            body.points,
            shift @ body.receptance @ shift.T,
            body.transfer @ shift.T,
        )
        seams.append(
            cabin_index.car_seam(*running(), np.array([m.position for m in moved]), moved_body)
        )
    plain = cabin_index.mount_variables(moved, identical=False, pieces=False, places=False)
    at_place = cabin_index.CabinIndex(plain, moved, index.gain, tuple(seams), index.weights)
    np.testing.assert_allclose(
        index.pressure(designs), at_place.pressure(designs[:, :6]), rtol=1e-11
    )


def test_a_design_gives_the_same_however_it_is_batched():
    index = index_of(identical=True)
    designs = some_designs(index, 300, seed=7, place_mm=1.0)
    whole = index(designs)
    np.testing.assert_allclose(whole[250:251], index(designs[250:251]), rtol=1e-12)


def test_a_worker_finds_the_same_bits():
    """One design with all its draws is what a worker gets, pickled."""
    index = index_of(places=False)
    factors = np.ones(6)
    space = DesignSpace(
        index.variable_names, ("1",) * 6, factors, 0.6 * factors, 1.4 * factors, 0.15 * factors
    )
    robust = Robust(index, space, sobol_sample(6, 8, seed=1))
    designs = some_designs(index, 4, seed=8)
    here, carried = robust(designs), pickle.loads(pickle.dumps(robust))
    for number, design in enumerate(designs):
        away = carried(design[np.newaxis])
        assert np.array_equal(here.mean[number], away.mean[0])
        assert np.array_equal(here.sigma[number], away.sigma[0])


def test_travel_and_modes_of_a_symmetrical_body():
    """Four equal mounts around the centre of gravity: springs in parallel."""
    corners = [(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)]
    stiffness = np.array([2e4, 1e4, 1e4])
    four = tuple(
        CompressorMount(f"mount {n}", np.array([x, y, 0.0]), np.zeros(3), stiffness)
        for n, (x, y) in enumerate(corners)
    )
    inertia = np.diag([0.02, 0.03, 0.04])
    statics = cabin_index.MountStatics(
        cabin_index.mount_variables(four, identical=True, pieces=False, places=False),
        four,
        1.5,
        7.2,
        np.zeros(3),
        mass_matrix(7.2, inertia),
    )
    # radial along y and z is the softest: 4 x 1.5 x 1e4 x 0.8
    travel = statics(np.array([[1.0, 0.8]]))
    assert travel[0, 0] == pytest.approx(
        1e3 * 7.2 * cabin_index.GRAVITY / (4 * 1.5 * 0.8e4), rel=1e-12
    )
    twice = statics.travel_ratio(np.array([1.0, 0.8]), np.array([1.0, 1.6]))
    assert twice == pytest.approx(2.0, rel=1e-12)
    modes = statics.modes(np.array([[1.0, 0.8]]))[0]
    sideways = np.sqrt(4 * 1.5 * 0.8e4 / 7.2) / (2 * np.pi)
    along = np.sqrt(4 * 1.5 * 2e4 / 7.2) / (2 * np.pi)
    assert np.min(np.abs(modes - sideways)) < 1e-9
    assert np.min(np.abs(modes - along)) < 1e-9


SPEEDS = np.arange(20.0, 141.0, 4.0)
CAR = cars()[1]
COMPRESSOR = bench_operation().laboratory.compressor
OF_MOUNTS, OF_HOSES = columns_of(MOUNTS, 3), columns_of(HOSES)


def run(with_hoses):
    hoses = drawn_hoses() if with_hoses else ()
    return run_car(CAR, COMPRESSOR, true_source(), SPEEDS, hoses)


def receptance(columns):
    return CAR.receptance(SPEEDS)[:, columns][:, :, columns]


@pytest.mark.parametrize("with_hoses", [False, True])
def test_loads_are_those_of_the_coupled_car(with_hoses):
    true, hoses = run(with_hoses), drawings(drawn_hoses()) if with_hoses else ()
    columns = OF_MOUNTS + (OF_HOSES if with_hoses else [])
    factor = COMPRESSOR.gain_at(SPEEDS)
    loads, ends = body_loads.loads_by_measured_holders(
        mounts(),
        factor,
        true.displacement,
        true.body_motion[:, OF_MOUNTS],
        hoses,
        SPEEDS,
        receptance(columns),
    )
    expected = true.body_load[:, columns]
    assert loads == pytest.approx(expected, rel=1e-7, abs=1e-9 * np.abs(expected).max())
    sound = np.sum(CAR.noise_transfer(SPEEDS)[:, columns] * expected, axis=1)
    assert sound == pytest.approx(true.pressure, rel=1e-9)
    if with_hoses:
        moved = true.body_motion[:, OF_HOSES]
        assert ends == pytest.approx(moved, abs=1e-9 * np.abs(moved).max())


def test_forces_of_the_mounts_hold_the_compressor():
    """At the virtual point they are the whole of what a compressor without hoses leans on."""
    true = run(with_hoses=False)
    rows = forward_matrices(np.array([mount.position for mount in mounts()]))
    apart = true.displacement @ rows.T - true.body_motion[:, OF_MOUNTS]
    forces = body_loads.mount_forces(mounts(), COMPRESSOR.gain_at(SPEEDS), apart)
    square = (2 * np.pi * SPEEDS)[:, None] ** 2
    gyroscopic = true_source().gyroscopic(SPEEDS) @ true.displacement[..., None]
    inertia = square * (true.displacement @ COMPRESSOR.mass_matrix.T) - gyroscopic[..., 0]
    expected = true.load + inertia
    assert forces @ rows == pytest.approx(expected, abs=1e-9 * np.abs(true.load).max())


def test_receptances_come_from_measured_points_and_lines():
    names = [f"p {motion}" for motion in RIGID_MOTIONS]
    loads = [f"p {load}" for load in POINT_LOADS]
    values = np.broadcast_to(np.eye(6), (2, 6, 6))
    frf = Frf(np.array([20.0, 30.0]), values, names, loads, "(m/s^2)/N")
    receptance = body_loads.body_receptance(frf, [30.0], ["p"])
    assert receptance == pytest.approx(-np.eye(3)[None] / (60 * np.pi) ** 2)
    with pytest.raises(InputError, match="no accelerances of the body at 'q': strike it"):
        body_loads.body_receptance(frf, [30.0], ["p"], ["q"])
    with pytest.raises(InputError, match="no line at 25 Hz, they go from 20 to 30 Hz"):
        body_loads.body_receptance(frf, [25.0], ["p"])
