"""The bench's commands: options reach the bench, refusals are one sentence, readers take files."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from command_line import call
from deboom.bench import campaign, compressor_writer, electric_car_writer, vehicle_writer
from deboom.bench.choices import CalibrationLevel, CompressorCase, HoseCase
from deboom.bench.compressor_rig import OperationPlan
from deboom.bench.compressor_truth import CompressorPlan
from deboom.files.campaign import read_campaign
from deboom.files.library_export import read_library_json
from deboom.runs import campaigns as platform_library
from deboom.vehicles.platform import LIBRARY_FILE

RUNS = campaign.TRAINING_RUNS[:1]
pytestmark = pytest.mark.usefixtures("few_chains")


@pytest.fixture(autouse=True)
def one_run(monkeypatch):
    """Measure one run per campaign."""
    short = campaign.CampaignPlan.__init__

    def plan(self, mount_sets, runs=RUNS, shaker_repeats=1, **rest):
        short(self, mount_sets, runs, shaker_repeats, **rest)

    slow = partial(campaign.TimeRunPlan, sample_rate=2048.0)
    monkeypatch.setattr(campaign, "TimeRunPlan", slow)
    monkeypatch.setattr(campaign.CampaignPlan, "__init__", plan)


def test_campaign_with_chosen_mount_sets(tmp_path):
    folder = tmp_path / "campaign"
    done = call("bench", "campaign", folder, "--seed", 2, "--mount-set", "M3", "--mount-set", "M0")
    assert Path(done.stdout.splitlines()[-1]) == folder
    written = read_campaign(folder)
    assert written.name == "virtual_bench_2"
    assert written.mount_sets == ("M3", "M0")
    assert written.tolerances.sensor_gain > 0


def test_campaign_without_errors_with_time_data(tmp_path):
    folder = tmp_path / "campaign"
    options = ("--mount-set", "M1", "--noise-free", "--time-run")
    call("bench", "campaign", folder, *options)
    assert read_campaign(folder).tolerances.sensor_gain == 0
    assert [path.name for path in (folder / "time").iterdir()] == ["g5_wot220_time.uff"]


def test_platform_with_library(tmp_path, monkeypatch):
    """Of few runs: what the studies need is there."""
    few, lines = campaign.TRAINING_RUNS[2::4], np.arange(20.0, 80.5, 2.0)

    def plan(name):
        return campaign.CampaignPlan((name,), few, 1, frequency=lines)

    monkeypatch.setattr(platform_library, "training_plan", plan)
    folder = tmp_path / "platform"
    call("bench", "write", folder, "--seed", 2, "--library")
    _, mounts = read_library_json(folder / LIBRARY_FILE)
    assert [mount.mount.name for mount in mounts] == ["EnM", "GeM", "TSM", "Du"]
    assert all(direction.surface is not None for direction in mounts[2].directions)
    assert all(direction.map_points.frequency.size == 0 for direction in mounts[2].directions)


TABLE11 = CompressorCase.TABLE11
BOTH = "--mount-storage 0.9 --mount-loss 1.1 --hoses displaced --hammer-with-hoses --noise-free"
GIVEN = {
    "vehicle": (
        (vehicle_writer, "write_vehicle"),
        "--seed 3 --vehicle F45-2 --mount-set M4 --noise-free --truth-seed 5 --tilt 20 "
        "--body-scatter 2 --family truck,noise=2",
        (3, "F45-2", "M4", vehicle_writer.NO_VEHICLE_ERRORS, 5, 20.0, 2.0, "truck,noise=2"),
    ),
    "compressor": (
        (compressor_writer, "write_compressor_test"),
        "--level C0.5 --seed 2 --case table11 --identical-mounts --noise-free --flexible-receiver "
        "--flexible-body 400 --softening --hits",
        (2, CalibrationLevel.C05, CompressorPlan(TABLE11, True, True, True, 400.0, True), True),
    ),
    "operation": (
        (compressor_writer, "write_operating_test"),
        "--level C0.5 --seed 2 --case table11 --softening --sense -1 --flexible-receiver "
        f"--time-record {BOTH}",
        (
            2,
            CalibrationLevel.C05,
            OperationPlan(
                CompressorPlan(TABLE11, softening=True, flexible_receiver=True),
                HoseCase.DISPLACED,
                True,
                0.9,
                1.1,
                True,
                -1,
                True,
            ),
            True,
        ),
    ),
    "electric-car": (
        (electric_car_writer, "write_electric_car"),
        f"--car EV-3 --fleet 7 --seed 2 --truth-seed 5 --level C1 --identical-mounts {BOTH} "
        "--family light",
        (
            2,
            "EV-3",
            7,
            CalibrationLevel.C1,
            OperationPlan(
                CompressorPlan(TABLE11, True), HoseCase.DISPLACED, True, 0.9, 1.1, truth_seed=5
            ),
            True,
            "light",
        ),
    ),
}


@pytest.mark.parametrize("command", GIVEN)
def test_options_reach_the_bench(command, tmp_path, monkeypatch):
    writer, options, wanted = GIVEN[command]
    received = []

    def write(
        *given,
        noise_free=None,
        progress=None,
        truth_seed=None,
        tilt=None,
        body_scatter=None,
        family=None,
    ):
        stated = (noise_free, truth_seed, tilt, body_scatter, family)
        received.append((*given, *(each for each in stated if each is not None)))

    monkeypatch.setattr(*writer, write)
    done = call("bench", command, tmp_path, *options.split())
    assert done.stdout.strip() == tmp_path.as_posix()
    assert received == [(tmp_path, *wanted)]


@pytest.mark.parametrize(
    ("command", "options", "words"),
    [
        ("campaign", ("--seed", 0), "seeds are whole numbers from 1"),
        ("campaign", ("--mount-set", "A1"), "unknown mount set 'A1'"),
        ("campaign", ("--mount-set", "M1", "--mount-set", "M1"), "mount_sets: duplicated ['M1']"),
        ("vehicle", ("--seed", 0), "seeds are whole numbers from 1"),
        ("vehicle", ("--vehicle", "U07-1"), "no vehicle 'U07-1' in the fleet: use U06-1"),
        ("vehicle", ("--mount-set", "M"), "unknown mount set 'M'"),
        ("compressor", ("--seed", 0), "seeds are whole numbers from 1"),
        ("compressor", ("--flexible-body", -1), "flexible_body is -1.0: give"),
        ("compressor", ("--flexible-body", "nan"), "flexible_body is nan: give"),
        ("operation", ("--seed", 0), "seeds are whole numbers from 1"),
        ("operation", ("--mount-storage", 0), "mount_storage is 0.0: give"),
        ("operation", ("--mount-loss", "nan"), "mount_loss is nan: give"),
        ("operation", ("--sense", 2), "sense 2 is no sense of rotation"),
        ("electric-car", ("--car", "EV-8"), "there is no car 'EV-8' in the fleet: use EV-1"),
        ("electric-car", ("--seed", 0), "seed 0 is refused"),
        ("electric-car", ("--fleet", 0), "seed 0 is refused"),
        ("electric-car", ("--mount-storage", 0), "mount_storage is 0.0: give"),
    ],
)
def test_refusals_are_one_sentence_and_leave_nothing(command, options, words, tmp_path):
    done = call("bench", command, tmp_path / "new", *options, code=2)
    assert words in done.stderr
    assert len([line for line in done.stderr.splitlines() if line.startswith("deboom:")]) == 1
    assert not (tmp_path / "new").exists()
