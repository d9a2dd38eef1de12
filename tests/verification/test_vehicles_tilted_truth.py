"""Tilted mounts: booming model, campaign and tables against solutions that share none of its code.

A mount of stiffness ``diag(k)`` along axes R is the tensor ``R diag(k) Rᵀ`` in vehicle axes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deboom.bench.campaign import NO_ERRORS, training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import load_bench
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.characterise import measuring_chains
from deboom.mounts.measuring_chain import body_record
from deboom.mounts.mount import Mount, in_mount_axes, in_vehicle_axes, mean_operating_stiffness
from deboom.mounts.operating_map import bench_load_case, operating_maps
from deboom.vehicles.booming_model import Motion, booming_model
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.limits import MountRequirements, NaturalFrequencies
from deboom.vehicles.powertrain import Powertrain

AXES = ("x", "y", "z")
LINES = np.arange(20.0, 60.25, 1.0)
BAND = (20.0, 60.0)
PLACES = {"EnM": (0.05, 0.41, 0.2), "GeM": (-0.02, -0.47, 0.18), "TSM": (0.2, -0.05, -0.28)}
ANGLES = {"EnM": (12.0, -20.0, 5.0), "GeM": (0.0, 30.0, 0.0), "TSM": (-8.0, 3.0, 40.0)}
STIFFNESS = {
    "EnM": np.array([1.5e5, 1.2e5, 4.5e5]),
    "GeM": np.array([1.2e5, 1.0e5, 4.2e5]),
    "TSM": np.array([2.5e5, 0.5e5, 0.6e5]),
}
LOSS = 1 + 0.12j
MASS, INERTIA = 190.0, np.diag([11.0, 7.0, 10.0])
WHEEL_END, WISHBONE = 40.0, np.array([3e5, 2e5, 4e5])
CHANNELS = (*(f"{m} {a}" for m in PLACES for a in AXES), *(f"Du {a}" for a in AXES))


def turn(name):
    angles = ANGLES.get(name, (0.0, 25.0, 10.0))
    return Rotation.from_euler("xyz", angles, degrees=True).as_matrix()


def smooth(generator):
    terms = generator.normal(size=3) + 1j * generator.normal(size=3)
    place = np.linspace(0, 1, LINES.size)
    return terms[0] + terms[1] * np.exp(4j * place) + terms[2] * np.exp(-6j * place)


GENERATOR = np.random.default_rng(3)
TRANSFER = np.stack([1e-2 * smooth(GENERATOR) for _ in CHANNELS], axis=1)
LOAD = np.zeros((LINES.size, 6), dtype=complex)
LOAD[:, [2, 3, 4]] = np.array([20.0, 10.0, 150.0])
END_LOAD = 30.0 * np.stack([smooth(GENERATOR) for _ in AXES], axis=1)


def forward(place):
    x, y, z = place
    return np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])


def tensors(factor, loss=None):
    """Stiffness tensor of every mount in vehicle axes, with factors along its own axes."""
    by_mount = {}
    for number, name in enumerate((*PLACES, "Du")):
        along = STIFFNESS.get(name, WISHBONE)
        x = factor[3 * number : 3 * number + 3]
        y = np.ones(3) if loss is None else loss[3 * number : 3 * number + 3]
        along_axes = np.diag(along * x * (LOSS.real + 1j * LOSS.imag * y))
        by_mount[name] = turn(name) @ along_axes @ turn(name).T
    return by_mount


def solved(factor, loss=None):
    """Displacement and force of all channels in vehicle axes, and the pressure."""
    stiffness = tensors(factor, loss)
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = MASS * np.eye(3), INERTIA
    moved = np.zeros((LINES.size, len(CHANNELS)), dtype=complex)
    force = np.zeros_like(moved)
    for line, frequency in enumerate(LINES):
        squared = (2 * np.pi * frequency) ** 2
        whole = -squared * mass.astype(complex)
        for name, place in PLACES.items():
            whole += forward(place).T @ stiffness[name] @ forward(place)
        motion = np.linalg.solve(whole, LOAD[line])
        points = [forward(place) @ motion for place in PLACES.values()]
        end = stiffness["Du"] - squared * WHEEL_END * np.eye(3)
        points.append(np.linalg.solve(end, END_LOAD[line]))
        moved[line] = np.concatenate(points)
        pushed = [stiffness[n] @ u for n, u in zip((*PLACES, "Du"), points, strict=True)]
        force[line] = np.concatenate(pushed)
    return moved, force, (TRANSFER * force).sum(axis=1)


ONE = np.ones(12)
FACTORS = np.random.default_rng(5).uniform(0.8, 1.2, (3, 12))


def load_case(moved, force):
    displacement = Spectrum(LINES, moved, CHANNELS, "m")
    return LoadCase(
        "r", "r", 3, 5.0, 200.0, 1.5, displacement, Spectrum(LINES, force, CHANNELS, "N")
    )


def mounts(stated=True):
    def rotations(name):
        angles = ANGLES.get(name, (0.0, 25.0, 10.0))
        return (tuple(np.deg2rad(angles)),) if stated else ()

    hung = [Mount(n, "", ("",), (p,), AXES, rotations=rotations(n)) for n, p in PLACES.items()]
    wheel = Mount("Du", "", ("",), ((0.1, -0.7, -0.3),), AXES, WHEEL_END, 1.0, rotations("Du"))
    return (*hung, wheel)


FLEET = Fleet((Vehicle("v", "g", Frf(LINES, TRANSFER[:, None], ("ear",), CHANNELS, "Pa/N")),))
CASE = load_case(*solved(ONE)[:2])


def model(stated=True, motion=Motion.coupled, **options):
    powertrain = Powertrain(MASS, INERTIA)
    parts = FLEET, mounts(stated), [(CASE, 1.0)], BAND
    return booming_model(*parts, motion=motion, powertrain=powertrain, **options)


def test_coupled_motion_of_tilted_mounts_is_the_tensor_model():
    predicted = model().pressure(FACTORS)[:, 0]
    true = np.array([solved(factor)[2] for factor in FACTORS])
    np.testing.assert_allclose(predicted, true, rtol=1e-9)
    unstated = model(stated=False).pressure(FACTORS)[:, 0]
    missed = 20 * np.log10(np.abs(unstated / true))
    assert np.sqrt(np.mean(missed**2)) > 0.2  # what an angle that nobody states costs [dB]


def test_loss_factors_of_tilted_mounts_are_those_of_the_tensor_model():
    loss = np.random.default_rng(6).uniform(0.7, 1.3, 12)
    for motion in (Motion.coupled, Motion.prescribed):
        both = np.concatenate([FACTORS[0], loss])[np.newaxis]
        predicted = model(motion=motion, loss_factors=True).pressure(both)[0, 0]
        true = solved(FACTORS[0], loss)[2]
        if motion is Motion.prescribed:  # the motion stays, the tensors change
            stiffness, moved = tensors(FACTORS[0], loss), CASE.displacement.values
            blocks = zip(stiffness.values(), np.split(moved, 4, axis=1), strict=True)
            true = (TRANSFER * np.hstack([u @ k.T for k, u in blocks])).sum(axis=1)
        np.testing.assert_allclose(predicted, true, rtol=1e-9)


@pytest.mark.parametrize("motion", [Motion.prescribed, Motion.coupled])
def test_compiled_levels_and_gradients_of_tilted_mounts_follow_the_pressure(motion):
    booming = model(motion=motion)
    plain = booming.levels(FACTORS).sum(axis=-1)
    np.testing.assert_allclose(booming(FACTORS), plain, rtol=0, atol=1e-9)
    step = 1e-5 * np.eye(12)
    ahead, behind = (booming(FACTORS[0] + sign * step)[:, 0] for sign in (1, -1))
    slopes = (ahead - behind) / 2e-5
    np.testing.assert_allclose(booming.gradient(FACTORS[:1])[0, 0], slopes, rtol=1e-5, atol=1e-5)


def test_rotations_of_zero_change_no_bit():
    upright = tuple(replace(mount, rotations=((0.0, 0.0, 0.0),)) for mount in mounts(False))
    for motion in (Motion.prescribed, Motion.coupled):
        options = {"motion": motion, "powertrain": Powertrain(MASS, INERTIA)}
        model, stated = (
            booming_model(FLEET, each, [(CASE, 1.0)], BAND, **options)
            for each in (mounts(False), upright)
        )
        np.testing.assert_array_equal(model(FACTORS), stated(FACTORS))
    assert in_mount_axes(upright, CASE) is CASE


def test_stiffness_and_modes_are_along_the_axes_of_the_mount():
    for mount in mounts():
        expected = np.abs(LOSS) * STIFFNESS.get(mount.name, WISHBONE)
        np.testing.assert_allclose(mean_operating_stiffness(mount, CASE, BAND), expected, rtol=1e-9)
    back = in_vehicle_axes(mounts(), in_mount_axes(mounts(), CASE))
    np.testing.assert_allclose(back.force.values, CASE.force.values, rtol=1e-12)
    hung = mounts()[:3]
    rates = {f"{n} {a}": k for n in PLACES for a, k in zip(AXES, STIFFNESS[n], strict=True)}
    modes = NaturalFrequencies(hung, Powertrain(MASS, INERTIA), rates)
    whole = sum(
        forward(p).T @ turn(n) @ np.diag(STIFFNESS[n]) @ turn(n).T @ forward(p)
        for n, p in PLACES.items()
    )
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = MASS * np.eye(3), INERTIA
    squared = np.sort(np.linalg.eigvals(np.linalg.solve(mass, whole)).real)
    judged = MountRequirements(tuple(rates), (modes,))(np.ones((1, 9)))[0]
    np.testing.assert_allclose(judged, np.sqrt(squared) / (2 * np.pi), rtol=1e-9)


def test_tilted_bench_is_identified_along_the_mounts(tmp_path):
    plan = training_plan("M0")
    few = replace(plan, runs=plan.runs[:3], shaker_repeats=1)
    write_campaign(tmp_path / "bench", 1, few, NO_ERRORS, bench=load_bench(1, 30.0))
    campaign = read_campaign(tmp_path / "bench")
    truth = np.load(tmp_path / "bench/truth/M0.npz")
    chains = measuring_chains(campaign)
    records = [body_record(c.alignment.body, campaign.runs, campaign.tolerances) for c in chains]
    maps = operating_maps(chains, records)
    channels = truth["channels"].tolist()
    for name in channels[:9]:
        lines = maps[name].select(~maps[name].near_floor)
        stated = np.concatenate(truth["stiffness"][:, :, channels.index(name)])
        true = stated[~maps[name].near_floor]
        assert np.median(np.abs(lines.stiffness / true - 1)) < 0.005, name
    case = bench_load_case(campaign, campaign.runs[0], chains, "first run")
    force = case.force.select(channels).values
    np.testing.assert_allclose(force, truth["force"][0], rtol=0, atol=0.01 * np.abs(force).max())
    assert any(mount.tilted_pieces for mount in campaign.mounts)


def test_rotations_that_are_none_are_refused():
    def mount(*rotations):
        return Mount("GeM", "", ("",), ((0.0, 0.0, 0.0),), AXES, rotations=rotations)

    for rotations in (((0.1, 0.2),), ((np.nan, 0.0, 0.0),), ((0.0, 30.0, 0.0),), ((0.0,) * 3,) * 2):
        with pytest.raises(InputError, match=r"GeM: rotations .* three angles"):
            mount(*rotations)
    case = replace(
        CASE,
        displacement=CASE.displacement.select(["GeM x", "GeM z"]),
        force=CASE.force.select(["GeM x", "GeM z"]),
    )
    with pytest.raises(InputError, match=r"no displacement of \['GeM y'\]: mount GeM is tilted"):
        in_mount_axes([mount((0.0, 0.5, 0.0))], case)
