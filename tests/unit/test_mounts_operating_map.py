"""Body records, operating maps and stiffness in one run."""

from dataclasses import replace

import numpy as np
import pytest
from mounts_campaign_samples import (
    CARRIERS,
    EXACT,
    FREQUENCY,
    OMEGA_2,
    RATIO,
    SIDES,
    Ramp,
    Rig,
    campaign_of,
    engine_torque,
    steady_state,
    true_stiffness,
)

from deboom.errors import InputError
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.measurement.sensors import Tolerances
from deboom.mounts import measuring_chain
from deboom.mounts.mount import (
    Mount,
    mean_operating_stiffness,
    not_identified,
    refuse_active_mounts,
)
from deboom.mounts.operating_map import Preload, operating_maps
from deboom.physics.dynamic_stiffness import loss_factor
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

RAMP = Ramp(120.0, full_load=True)


def records_of(**changes):
    campaign = campaign_of(Rig(ramps=(RAMP,), **changes))
    return [
        measuring_chain.body_record(body, campaign.runs, campaign.tolerances)
        for body in measuring_chain.instrumented_bodies(campaign)
    ]


@pytest.mark.parametrize("tolerances", [EXACT, Tolerances()])
@pytest.mark.parametrize(
    ("name", "left"),
    [
        *((name, 0.0) for name in ("A3 x", "C1 z", "A8 x", "A9 z", "C4 x", "C5 y")),
        # along the motion of a wheel end a channel sets the level of its own neighbours
        *((name, 1e-5) for name in ("A3 x", "C1 z", "A9 z", "C5 y")),
    ],
)
def test_dead_channel_of_any_body(name, left, tolerances):
    with pytest.raises(InputError, match=f"channel '{name}' is dead"):
        records_of(channel_gain={name: left}, tolerances=tolerances)


def with_side_sensors(monkeypatch, angles):
    """Turn the sensors of both wheel ends, in truth and on the position sheet."""
    turned = {side.name: replace(side, orientation=rotation_matrix(angles)) for side in SIDES}
    monkeypatch.setattr("mounts_campaign_samples.SIDES", tuple(turned.values()))
    return tuple(turned.get(side.name, side) for side in Rig().sensors)


def test_wheel_end_without_any_error_shows_nothing_across_its_motion(monkeypatch):
    """An exact sensor across an exact motion reads 0, and is not dead for that."""
    clean = with_side_sensors(monkeypatch, (0.0, 0.0, 0.0))
    _, left, right = records_of(sensors=clean)
    for record in (left, right):
        assert np.all(record.acceleration[:, 1:] == 0)
        assert np.all(record.acceleration[:, 0] != 0)


def test_the_same_reading_is_dead_where_the_bench_states_its_errors(monkeypatch):
    """With stated tilt and cross-talk a channel across the motion cannot read 0."""
    clean = with_side_sensors(monkeypatch, (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="channel 'A8 y' is dead"):
        records_of(sensors=clean, tolerances=Tolerances())


def maps_of(campaign, tolerances=None):
    stated = campaign.tolerances if tolerances is None else tolerances
    bodies = measuring_chain.instrumented_bodies(campaign)
    records = [measuring_chain.body_record(body, campaign.runs, stated) for body in bodies]
    chains = [
        measuring_chain.stated_alignment(measuring_chain.alignment(body, stated)) for body in bodies
    ]
    return operating_maps(chains, records)


@pytest.fixture(scope="module")
def maps():
    return maps_of(campaign_of(Rig(ramps=(RAMP,))))


def test_displacement_force_and_stiffness_are_the_true_ones(maps):
    motion, side, force, stiffness = steady_state(RAMP)
    forward = forward_matrices([mount.positions[0] for mount in CARRIERS])
    displacement = np.column_stack([motion @ forward.T, side])
    assert list(maps) == [*(f"{mount.name} {axis}" for mount in CARRIERS for axis in "xyz"), "W x"]
    for column, mapped in enumerate(maps.values()):
        n_pieces = 2 if mapped.mount == "W" else 1
        assert mapped.displacement == pytest.approx(np.tile(displacement[:, column], n_pieces))
        assert mapped.force == pytest.approx(np.tile(force[:, column], n_pieces))
        assert mapped.stiffness == pytest.approx(np.tile(stiffness[:, column], n_pieces))
        assert mapped.amplitude == pytest.approx(np.abs(mapped.displacement))


def test_loss_factor_and_pieces(maps):
    assert loss_factor(maps["E x"].stiffness) == pytest.approx(0.08)
    assert loss_factor(maps["W x"].stiffness) == pytest.approx(0.2)
    names = [RAMP.name + f" {piece}" for piece in ("left", "right") for _ in FREQUENCY]
    assert maps["W x"].run.tolist() == names


def test_preload_is_wheel_torque_or_static_force_of_the_direction(maps):
    mapped = maps["E z"]
    torque = RATIO * engine_torque(RAMP)
    assert mapped.preload(Preload.WHEEL_TORQUE) == pytest.approx(torque)
    assert mapped.preload(Preload.STATIC_FORCE) == pytest.approx(3 * torque)
    assert (Preload.WHEEL_TORQUE.unit, Preload.STATIC_FORCE.unit) == ("N m", "N")
    samples = mapped.samples(Preload.WHEEL_TORQUE)
    assert samples.preload == pytest.approx(torque)
    assert samples.stiffness == pytest.approx(true_stiffness(torque)[:, 2])


def test_switched_off_channel_is_not_missed():
    rig = Rig(ramps=(RAMP,), switched_off=("A2 y",), channel_gain={"A2 y": 30.0})
    stiffness = maps_of(campaign_of(rig))["S y"].stiffness
    assert stiffness == pytest.approx(steady_state(RAMP)[3][:, 7])


# ------------------------------------------------------------------ noise, repeats, mask

NOISY = Tolerances(**{**EXACT.__dict__, "acceleration_own": 0.05, "force_own": 0.05})


def test_repeats_become_one_line_and_average_noise():
    ramps = tuple(Ramp(120.0, repeat=n) for n in range(1, 41))
    campaign = campaign_of(Rig(tolerances=NOISY, ramps=ramps, noise=0.05))
    mapped = maps_of(campaign)["E x"]
    assert len(mapped) == FREQUENCY.size
    true = steady_state(ramps[0])[3][:, 0]
    single = maps_of(campaign_of(Rig(tolerances=NOISY, ramps=ramps[:1], noise=0.05)))["E x"]
    error, of_single = (np.std(x.stiffness / true - 1) for x in (mapped, single))
    assert error < of_single / 4  # √40 = 6.3
    assert mapped.displacement_noise == pytest.approx(single.displacement_noise / 40**0.5, rel=0.2)
    assert mapped.force_noise == pytest.approx(single.force_noise / 40**0.5, rel=0.2)


def test_noise_of_a_mean_over_four_repeats_is_half_of_that_of_one():
    ramps = tuple(Ramp(120.0, repeat=n) for n in range(1, 5))
    tolerances = replace(EXACT, torque=1.0, acceleration_floor=0.1, force_floor=2.0)
    campaign = campaign_of(Rig(tolerances=tolerances, ramps=ramps))
    body = measuring_chain.instrumented_bodies(campaign)[0]
    several, single = (
        measuring_chain.body_record(body, campaign.runs[:n], tolerances).mean_over_repeats()
        for n in (4, 1)
    )
    for name in ("wheel_torque_noise", "acceleration_noise", "cell_noise"):
        np.testing.assert_allclose(getattr(several, name), getattr(single, name) / 2)


def test_repeats_with_another_zero_mark_of_the_tacho_do_not_cancel():
    ramps = tuple(Ramp(120.0, repeat=n) for n in range(1, 4))
    campaign = campaign_of(Rig(ramps=ramps))
    turned = tuple(
        replace(
            run,
            acceleration=replace(run.acceleration, values=turn * run.acceleration.values),
            cell_force=replace(run.cell_force, values=turn * run.cell_force.values),
        )
        for run, turn in zip(campaign.runs, (1, -1, 1j), strict=True)
    )
    for name, mapped in maps_of(replace(campaign, runs=turned)).items():
        same = maps_of(campaign)[name]
        assert mapped.displacement == pytest.approx(same.displacement)
        assert mapped.stiffness == pytest.approx(same.stiffness)


def test_noise_of_both_sides_does_not_bias_the_stiffness_of_repeats():
    """With noise of 30 % in force and displacement H1 reads 9 % low, H2 9 % high, Hv neither."""
    ramps = tuple(Ramp(120.0, repeat=n) for n in range(1, 201))
    noise = 0.3
    rough = Tolerances(**{**EXACT.__dict__, "acceleration_own": noise, "force_own": noise})
    campaign = campaign_of(Rig(tolerances=rough, ramps=ramps, noise=noise))
    true = steady_state(ramps[0])[3][:, 9]
    # the wheel end moves along x alone; its sensor is turned by up to 5°
    ratio = np.mean(np.abs(maps_of(campaign)["W x"].stiffness[: true.size] / true))
    assert ratio == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("repeats", [1, 3])
def test_confidence_is_what_the_noise_leaves_of_a_coherence(repeats):
    """Repeats that agree by luck are no surer than their noise."""
    tolerances = Tolerances(**{**EXACT.__dict__, "acceleration_own": 0.1})
    ramps = tuple(Ramp(120.0, repeat=n) for n in range(1, repeats + 1))
    mapped = maps_of(campaign_of(Rig(tolerances=tolerances, ramps=ramps)))["W x"]
    # of the sensor's three channels the one along x counts: cos²(5°) …
    assert mapped.confidence == pytest.approx(1 / (1 + 0.1**2), rel=2e-3)


def test_lines_near_the_floor_are_masked():
    motion = steady_state(RAMP)[0]
    forward = forward_matrices([CARRIERS[0].positions[0]])
    s = np.abs(motion @ forward.T)[:, 0]

    def with_floor(floor):
        tolerances = Tolerances(**{**EXACT.__dict__, "acceleration_floor": floor})
        return maps_of(campaign_of(Rig(tolerances=tolerances, ramps=(RAMP,))))["E x"]

    # seen through five sensors, whose noise is the same at every line
    gain = with_floor(1.0).displacement_noise * OMEGA_2
    assert gain == pytest.approx(gain[0], rel=1e-9)
    assert 1 / 5**0.5 < gain[0] < 1.5
    mapped = with_floor(1.001 * float(np.median(s * OMEGA_2)) / gain[0] / 10)
    expected = s < 10 * mapped.displacement_noise
    assert mapped.near_floor.tolist() == expected.tolist()
    assert 0.3 < expected.mean() < 0.7
    assert len(mapped.samples(Preload.WHEEL_TORQUE)) == np.count_nonzero(~expected)


def test_direction_that_was_never_loaded():
    tolerances = Tolerances(**{**EXACT.__dict__, "acceleration_floor": 1e4})
    mapped = maps_of(campaign_of(Rig(tolerances=tolerances, ramps=(RAMP,))))["G y"]
    assert mapped.near_floor.all()
    with pytest.raises(InputError, match="G y was never loaded: in all 41 lines"):
        mapped.samples(Preload.WHEEL_TORQUE)


# ------------------------------------------------------------------ bad input


@pytest.mark.parametrize(
    ("rig", "words"),
    [
        (
            Rig(switched_off=tuple(f"A{k} {a}" for k in (1, 2, 3) for a in "xyz")),
            "three triaxial sensors",
        ),
        (Rig(switched_off=("C1 x",)), r"mount E: the cell channels \['C1 x'\] are switched off"),
        (Rig(switched_off=("A8 y",)), r"W left carries a body .* switched off are \['A8 y'\]"),
        (
            Rig(sensors=tuple(sensor for sensor in Rig().sensors if sensor.name != "C2")),
            "mount G has no force cell",
        ),
    ],
)
def test_sensors_that_do_not_suffice(rig, words):
    with pytest.raises(InputError, match=words):
        measuring_chain.instrumented_bodies(campaign_of(rig))


def test_run_without_a_channel():
    campaign = campaign_of(Rig(ramps=(RAMP,)))
    body = measuring_chain.instrumented_bodies(campaign)[0]
    run = campaign.runs[0]
    fewer = run.acceleration.select(run.acceleration.channels[3:])
    short = replace(run, acceleration=fewer)
    with pytest.raises(InputError, match=r"run g5_wot120_1 lacks the channels \['A1 x'"):
        measuring_chain.body_record(body, [short], EXACT)
    with pytest.raises(InputError, match="no operating run for the powertrain"):
        measuring_chain.body_record(body, [], EXACT)


FREQUENCY_3 = np.arange(20.0, 41.0)
STIFFNESS = 300e3 * (1 + 0.12j) * (FREQUENCY_3 / 30.0) ** 0.2
DU = Mount("Du", "wishbone", ("left", "right"), ((0, -1, 0), (0, 1, 0)), ("x",))


def run(stiffness=STIFFNESS, scale_right=1.0):
    """Two pieces in x that move alike; the right one may be stiffer."""
    names = ("Du left x", "Du right x")
    motion = 1e-4 * np.exp(1j * FREQUENCY_3)[:, None] * np.ones(2)
    force = stiffness[:, None] * motion * [1.0, scale_right]
    return LoadCase(
        "run",
        "a run",
        5,
        3.4,
        220.0,
        1.5,
        Spectrum(FREQUENCY_3, motion, names, "m"),
        Spectrum(FREQUENCY_3, force, names, "N"),
    )


def test_mean_is_over_lines_of_the_band_and_over_pieces():
    inside = (FREQUENCY_3 >= 25) & (FREQUENCY_3 <= 30)
    wanted = np.abs(STIFFNESS[inside]).mean() * 1.1
    means = mean_operating_stiffness(DU, run(scale_right=1.2), (25.0, 30.0))
    assert means[0] == pytest.approx(wanted, rel=1e-12)
    assert np.isnan(means[1:]).all()


def test_a_band_without_lines_is_refused():
    with pytest.raises(InputError, match="no line between 50 and 60"):
        mean_operating_stiffness(DU, run(), (50.0, 60.0))


def test_a_real_mount_passes_and_so_does_one_that_is_barely_askew():
    refuse_active_mounts(run())
    refuse_active_mounts(run(STIFFNESS.real * (1 - 0.04j)))


def test_opposite_signs_and_conjugated_spectra_are_named():
    with pytest.raises(InputError, match=r"run: channel 'Du left x' has a negative stiffness"):
        refuse_active_mounts(run(-STIFFNESS))
    with pytest.raises(InputError, match=r"channel 'Du right x' has a negative stiffness"):
        refuse_active_mounts(run(scale_right=-1.0))
    with pytest.raises(InputError, match=r"negative loss factor of -0\.12 .* e\^\(\+jωt\)"):
        refuse_active_mounts(run(STIFFNESS.conj()))


def test_a_direction_that_hardly_moves_has_no_sign_to_judge():
    def turned(angle):  # to both sides in turn: about cos² of it is coherent
        case = run(scale_right=-1.0)
        hardly = case.displacement.values.copy()
        hardly[:, 1] *= np.exp(1j * angle * (-1.0) ** np.arange(len(hardly)))
        return replace(case, displacement=replace(case.displacement, values=hardly))

    assert not_identified(turned(0.85)) == ("Du right x",)
    refuse_active_mounts(turned(0.85))
    assert not not_identified(turned(0.72))


def test_noise_of_single_lines_does_not_count():
    case = run()
    force = case.force.values.copy()
    force[3] *= -1
    noisy = replace(case, force=replace(case.force, values=force))
    refuse_active_mounts(noisy)
