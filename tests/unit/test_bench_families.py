"""Families of the bench: other bodies, rubber and laboratories, and nothing else changes."""

from __future__ import annotations

import json

import numpy as np
import pytest

from command_line import call
from deboom.bench.families import FACTORS, KINDS, draw_family
from deboom.bench.fleet import load_fleet, receptance
from deboom.bench.layout import FREQUENCY, LOAD_CASES
from deboom.bench.operating_run import drive, true_run
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import load_bench
from deboom.bench.vehicle_writer import NO_VEHICLE_ERRORS, write_vehicle
from deboom.errors import InputError
from deboom.files.platform import read_platform

RUN = tuple(case for case in LOAD_CASES if case.name == "g5_wot220")
ONE = {"load_cases": RUN, "groups": ("U06",)}


def files_of(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*.*")}


def test_a_family_that_names_todays_prior_gives_todays_bytes(tmp_path):
    usual = write_platform(tmp_path / "usual", 3, receptance=True, **ONE)
    named = write_platform(
        tmp_path / "named", 3, receptance=True, family="brackets,stiffness=1,noise=1", **ONE
    )
    files = files_of(named)
    truth = json.loads(files.pop("truth/family.json"))
    assert files == files_of(usual)
    assert truth == {"kind": "brackets"} | {name: f.usual for name, f in FACTORS.items()}


@pytest.mark.parametrize("name", KINDS)
def test_bodies_lie_within_the_bounds_of_their_kind(name):
    kind, size, local = KINDS[name], [], []
    for seed in range(1, 21):
        fleet = draw_family(name, seed, 1).fleet()
        assert list(fleet.bodies) == list(load_fleet(1).bodies)
        for body in fleet.bodies.values():
            n_mode = len(body.frequencies)
            assert kind.modes[0] <= n_mode <= kind.modes[1]
            size.append(body.shapes_at_paths[:, [0, 2, 3, 5]].std())
            local.append(np.exp(np.log(body.local_stiffness[:-1]).mean()))
            # cars scatter about the bounds of the drawing
            assert np.all(body.damping_ratios > kind.damping[0] * np.exp(-5 * 0.2 * 2.3))
            assert np.all(body.damping_ratios < kind.damping[1] * np.exp(5 * 0.2 * 2.3))
            assert np.all(body.frequencies < kind.frequency[1] * 1.15)
    for drawn, (low, high) in ((size, kind.shape), (local, kind.stiffness)):
        assert low * 0.6 < min(drawn) < low * 1.6
        assert high / 1.6 < max(drawn) < high / 0.6


def test_real_attachments_give_way_more_than_brackets_do():
    """Point receptance at the mounts, median over lines and cars of ten fleets."""
    size = {
        kind: np.median(
            [
                np.abs(receptance(body, FREQUENCY).diagonal(axis1=1, axis2=2))
                for seed in range(2, 12)
                for body in draw_family(kind, seed, 1).fleet().bodies.values()
            ]
        )
        for kind in ("brackets", "attachments")
    }
    assert size["attachments"] > 2 * size["brackets"]


def test_naming_one_factor_leaves_the_draws_of_the_others_alone():
    alone, both = (draw_family(words, 5, 6) for words in ("noise", "payne,truck,noise"))
    assert alone.values["noise"] == both.values["noise"] != 1.0
    assert draw_family("payne", 7, 6).values["payne"] == both.values["payne"]
    assert draw_family("truck", 5, 1).fleet().bodies["U06-1"].frequencies == pytest.approx(
        both.fleet().bodies["U06-1"].frequencies
    )
    drawn = [draw_family("stiffness,payne,noise", seed, seed).values for seed in range(1, 200)]
    for name in ("stiffness", "payne", "noise"):
        values = [each[name] for each in drawn]
        low, high = FACTORS[name].low, FACTORS[name].high
        assert low <= min(values) < low * 1.05 < high / 1.05 < max(values) <= high


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("sedan", "unknown family 'sedan': name one kind of body"),
        ("truck=2", "unknown family 'truck=2'"),
        ("stiffness=1.3", r"family factor stiffness=1.3: .* give 0.85 to 1.15"),
        ("noise=loud", "family factor noise=loud: .* give 0.5 to 4"),
        ("truck,light", "names something twice"),
        ("noise,noise=2", "names something twice"),
    ],
)
def test_families_that_do_not_exist_are_refused_in_a_sentence(words, sentence, tmp_path):
    with pytest.raises(InputError, match=sentence):
        write_platform(tmp_path / "p", 2, family=words)
    assert not (tmp_path / "p").exists()


def test_missing_lines_a_dead_sensor_and_noise_are_in_the_files(tmp_path):
    words = "attachments,gaps=0.1,dead=1,noise=4"
    folder = write_platform(tmp_path / "p", 4, receptance=True, family=words, **ONE)
    platform, fleet = read_platform(folder), draw_family(words, 4, 1).fleet()
    run, vehicle = platform.load_cases[0], platform.fleet.vehicles[0]
    lines = run.force.frequency
    assert 0.8 * FREQUENCY.size < lines.size < FREQUENCY.size
    assert np.array_equal(lines, vehicle.noise_transfer.frequency)
    paths = vehicle.noise_transfer.inputs
    measured = vehicle.receptance.select(outputs=paths, inputs=paths).values
    true = receptance(fleet.bodies["U06-1"], lines)
    # what is not reciprocal is noise of 4 times 5 % in both of a pair; the day is reciprocal
    apart = (measured - measured.swapaxes(1, 2))[:, 0, 2] / np.abs(true[:, 0, 2])
    assert np.sqrt(np.mean(np.abs(apart) ** 2)) == pytest.approx(0.2 * np.sqrt(2.0), rel=0.2)
    with pytest.raises(InputError, match="a vehicle's measurement has no 'dead': leave it out"):
        write_vehicle(tmp_path / "v", 4, family=words.replace("gaps=0.1,", ""))


def test_a_stronger_filler_softens_more_with_the_amplitude():
    bench, runs = load_bench(), []
    for words in ("payne=0.4", "", "payne=3"):
        family = draw_family(words, 1, 1)
        runs.append(true_run(family.bench(bench), RUN[0], FREQUENCY[::20]))
    weak, usual, strong = (np.abs(run.stiffness).mean() for run in runs)
    loss = [np.median(run.stiffness.imag / run.stiffness.real) for run in runs]
    assert weak < usual < strong
    assert loss == sorted(loss)


def test_rubber_is_another_one_in_the_car_and_its_loss_follows(tmp_path):
    words = "stiffness=0.85,apart=0.1"
    folder = write_vehicle(
        tmp_path / "v", 3, "U06-2", "M0", NO_VEHICLE_ERRORS, RUN, accelerance=False, family=words
    )
    with np.load(folder / "truth/g5_wot220.npz") as truth:
        stiffness, torque = truth["stiffness"], truth["engine_torque"]
    fleet, factors = load_fleet(3), draw_family(words, 3, 1).in_car(3)
    body = fleet.bodies["U06-2"]
    run = drive(load_bench(), body, fleet.cabin, 5, torque, FREQUENCY, *factors)
    np.testing.assert_allclose(stiffness, run.stiffness)
    each, loss = factors
    assert np.ptp(each[:3]) == 0.0  # a mount's directions are alike
    assert np.all((each > 0.85 * 0.9) & (each < 0.85 * 1.1))
    assert np.ptp(each) > 0.05
    np.testing.assert_allclose(loss, 0.85**1.5)


def test_commands_take_a_family(tmp_path):
    call("bench", "electric-car", tmp_path / "car", "--family", "attachments,stiffness=0.9,noise=2")
    truth = json.loads((tmp_path / "car/truth/family.json").read_text())
    assert (truth["kind"], truth["stiffness"], truth["noise"]) == ("attachments", 0.9, 2.0)
    done = call("bench", "campaign", tmp_path / "c", "--family", "sedan", code=2)
    assert "unknown family 'sedan'" in done.stderr
