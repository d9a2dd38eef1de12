"""Cabin noise of a running compressor from the files of a car without measurement errors."""

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from deboom.bench.compressor_plan import CompressorCase, CompressorPlan
from deboom.bench.electric_car_writer import CAR_PLAN, write_electric_car
from deboom.bench.parameters import read_data
from deboom.compressor.cabin_noise import cabin_noise
from deboom.compressor.cabin_noise_band import noise_bands
from deboom.compressor.identify import IdentifyOptions, identify
from deboom.compressor.mount_shares import MountPrior, mount_shares
from deboom.compressor.rigid_foundation import holder_displacement
from deboom.compressor.running_in_car import running_in_car
from deboom.errors import InputError
from deboom.files.electric_car import read_electric_car
from deboom.measurement.channels import Spectrum
from deboom.measurement.operating_sweep import HoseState
from deboom.measurement.wrench_noise_transfer import wrench_noise_transfer
from deboom.study.compressor_noise_tables import ranking

BAR = 1e5
IDENTICAL = CompressorPlan(CompressorCase.TABLE11, identical_mounts=True)


@pytest.fixture(scope="module")
def there(tmp_path_factory):
    """Everything known of the compressor in a car that was measured without errors."""
    folder = tmp_path_factory.mktemp("car") / "EV-1"
    plan = replace(CAR_PLAN, compressor=IDENTICAL, mount_storage=0.9, mount_loss=1.1)
    write_electric_car(folder, 1, "EV-1", plan=plan, noise_free=True)
    car = read_electric_car(folder)
    with threadpool_limits(1):
        return running_in_car(car, identify(car.operation.hammer, IdentifyOptions(held_out=0)))


@pytest.fixture(scope="module")
def sweeps(there):
    return cabin_noise(there)


def with_sweeps(car, change):
    """Car whose first sweep was changed; the door's checks do not look again at holders."""
    first, *rest = car.operation.sweeps
    return replace(car, operation=replace(car.operation, sweeps=(change(first), *rest)))


def test_the_sound_is_that_of_the_bench(sweeps):
    """Placement is fitted within its tolerances, mounts changed by 10 %: 1e-3 of the sound."""
    assert [one.hoses for one in sweeps].count(HoseState.SOFT) == 2
    for one in sweeps:
        off = np.linalg.norm(one.total - one.measured) / np.linalg.norm(one.measured)
        assert off < 2e-3, one.sweep
        assert one.total == pytest.approx(one.by_point.sum(axis=1))
        predicted = np.linalg.norm(one.predicted_body - one.total) / np.linalg.norm(one.total)
        assert predicted < 1e-3
        still = np.linalg.norm(one.still_body - one.total) / np.linalg.norm(one.total)
        assert 0.01 < still < 0.3


def test_without_the_hoses_much_is_missing(sweeps):
    for one in sweeps:
        high = one.frequency >= 90
        off = np.abs(one.level(one.by_mounts) - one.level(one.measured))[high]
        assert (np.percentile(off, 90) > 3) == (one.hoses is HoseState.STANDARD)


def test_the_state_of_the_mounts_shows_in_spite_of_the_moving_body(there):
    assert there.source.state.changed
    lines = np.arange(20.0, 51.0)
    gain = there.found.calibrated.model.gain.at(lines)
    true = (0.9 * gain.real + 1.1j * gain.imag) / gain - 1
    assert there.change(lines) == pytest.approx(true, abs=5e-3)
    assert np.median(np.abs(there.change(lines) - true)) < 2e-3


def test_identical_mounts_are_seen_one_by_one(there):
    shares = there.shares
    assert shares.identical
    assert not shares.alarms
    assert "agrees with identical round mounts" in shares.statement
    true = np.array(read_data("compressor.json")["truth"]["mount_position_m"])
    found = np.array([mount.position for mount in shares.mounts])
    assert np.abs(found - true).max() < 5e-5
    stiffness = np.array([mount.stiffness for mount in shares.mounts])
    assert np.ptp(stiffness, axis=0).max() < 1e-9 * stiffness.max()
    # what a round mount does about its own axis no test tells
    assert shares.deviations[:, 3] == pytest.approx(shares.prior_deviations[3])
    # the sheet states its tolerances although nothing is off
    assert shares.deviations[:, :3].max() < 1e-3


def test_draws_of_the_mounts_scatter_as_their_covariance_says(there):
    placed = tuple(replace(m, position=m.position + 2e-3) for m in there.shares.drawn)
    uneven = tuple(
        replace(m, stiffness=m.stiffness * factor)
        for m, factor in zip(placed, (1.3, 1.0, 0.8), strict=True)
    )
    prior = MountPrior(position=1e-5, angle=1e-4, stiffness=0.2)
    shares = mount_shares(there.found, uneven, prior)
    assert not shares.identical
    assert shares.alarms
    assert "contradict" in shares.alarms[0]
    assert "refutes identical round mounts" in shares.statement
    generator, zero = np.random.default_rng(1), np.zeros(20)
    drawn = [shares.at_random(zero, generator) for _ in range(400)]
    stiffness = np.log([[mount.stiffness for mount in mounts] for mounts in drawn])
    assert np.all(stiffness.std(axis=0) <= 1.2 * shares.deviations[:, 6:])


def test_bands_hold_the_sound(there, sweeps):
    transfer = wrench_noise_transfer(there.car)
    bands = noise_bands(there, transfer, draws=20)
    again = noise_bands(there, transfer, draws=20)
    for one, band, twin in zip(sweeps, bands, again, strict=True):
        assert np.array_equal(band.lower, twin.lower)
        level = one.level(one.total)
        assert np.mean((level >= band.lower) & (level <= band.upper)) > 0.8
        assert np.median(band.upper - band.lower) < 3
    for seed, draws, confidence, words in (
        (0, 20, 0.9, "seeds are whole numbers"),
        (1, 5, 0.9, "ask for at least 20"),
        (1, 20, 1.0, "between 0 and 1"),
    ):
        with pytest.raises(InputError, match=words):
            noise_bands(there, transfer, draws=draws, seed=seed, confidence=confidence)


def test_parts_of_the_sound_add_up(sweeps):
    table = ranking(sweeps[0])
    parts = table.groupby("band")["part of the sound [%]"].sum()
    assert parts.to_numpy() == pytest.approx(100)
    for _, rows in table.groupby("band"):
        assert rows["part of the sound [%]"].is_monotonic_decreasing


def test_what_cannot_be_answered_is_refused(there):
    car = there.car
    hammer = car.operation.hammer
    drawing = hammer.drawing

    def with_hammer(**changes):
        changed = replace(hammer, **changes)
        return replace(car, operation=replace(car.operation, hammer=changed))

    for bad, words in (
        (with_hammer(drawing=None), "the hammer test has no drawing"),
        (
            with_hammer(drawing=replace(drawing, mounts=drawing.mounts[:2])),
            "the drawing has mount 1, mount 2, the car mount 1, mount 2, mount 3",
        ),
        (
            replace(car, operation=replace(car.operation, hoses=())),
            "standard hoses, of which there is no drawing: add",
        ),
        (
            replace(
                car,
                operation=replace(
                    car.operation,
                    hoses=tuple(replace(h, name="other " + h.name) for h in car.operation.hoses),
                ),
            ),
            "no noise transfer functions at the body's end of other",
        ),
    ):
        with pytest.raises(InputError, match=words):
            running_in_car(bad, there.found)
    with pytest.raises(InputError, match="fewer than two mounts"):
        mount_shares(there.found, there.shares.drawn[:1])
    with pytest.raises(InputError, match="deviation of a mount's angle must be positive"):
        MountPrior(angle=0.0)
    with pytest.raises(InputError, match="has no line between 200 and 300 Hz"):
        cabin_noise(there, band=(200.0, 300.0))


def test_a_sweep_that_does_not_fit_is_refused(there):
    car, first = there.car, there.car.operation.sweeps[0]
    with pytest.raises(InputError, match="no body-side acceleration 'mount 1 x': record it"):
        holder_displacement(replace(first, holder=None), there.shares.mounts)
    lines = first.frequency + 0.3

    def moved(spectrum):
        return Spectrum(lines, spectrum.values, spectrum.channels, spectrum.unit)

    def off(sweep):
        return replace(
            sweep,
            acceleration=moved(sweep.acceleration),
            holder=moved(sweep.holder),
            sound=moved(sweep.sound),
        )

    with pytest.raises(InputError, match=r"no line at 20\.3 Hz, they go from 15 to 150 Hz"):
        cabin_noise(replace(there, car=with_sweeps(car, off)))
    two = tuple(point for point in car.points if point.name != "mount 3")
    with pytest.raises(InputError, match=r"measure mount 3 as well|not those of the points"):
        replace(car, points=two)
    assert car.mounts[2].name == "mount 3"
    assert car.operation.sweeps[2].pressure == pytest.approx(7.5 * BAR)
