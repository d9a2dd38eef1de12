"""The bench's commands: what they write is read by the commands and studies that follow."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from deboom.bench import campaign
from deboom.cli import app
from deboom.files.campaign import read_campaign
from deboom.files.library_export import read_library_json
from deboom.study import campaigns as platform_library
from deboom.study.platform_model import LIBRARY_FILE

RUNS = campaign.TRAINING_RUNS[:1]


@pytest.fixture
def cli(monkeypatch):
    """Call the command line in this process, with one run per campaign."""
    short = campaign.CampaignPlan.__init__

    def plan(self, mount_sets, runs=RUNS, shaker_repeats=1, **rest):
        short(self, mount_sets, runs, shaker_repeats, **rest)

    monkeypatch.setattr(campaign.CampaignPlan, "__init__", plan)

    def call(*arguments):
        return CliRunner().invoke(app, [str(argument) for argument in arguments])

    return call


def test_campaign_with_chosen_mount_sets(cli, tmp_path):
    folder = tmp_path / "campaign"
    done = cli("bench", "campaign", folder, "--seed", 2, "--mount-set", "M3", "--mount-set", "M0")
    assert done.exit_code == 0, done.stderr
    assert Path(done.stdout.splitlines()[-1]) == folder
    campaign = read_campaign(folder)
    assert campaign.name == "virtual_bench_2"
    assert campaign.mount_sets == ("M3", "M0")
    assert campaign.tolerances.sensor_gain > 0
    assert campaign.pushes == ()


def test_campaign_without_errors_with_a_third_cell_and_time_data(cli, tmp_path):
    folder = tmp_path / "campaign"
    options = ("--mount-set", "M1", "--noise-free", "--third-cell", "--time-run")
    done = cli("bench", "campaign", folder, *options)
    assert done.exit_code == 0, done.stderr
    campaign = read_campaign(folder)
    assert campaign.tolerances.sensor_gain == 0
    assert len(campaign.pushes) == 18
    assert [path.name for path in (folder / "time").iterdir()] == ["g5_wot220_time.uff"]


def test_campaign_refuses_what_it_cannot_measure(cli, tmp_path):
    for options, words in (
        (("--seed", 0), "seeds are whole numbers from 1"),
        (("--mount-set", "A1"), "unknown mount set 'A1'"),
        (("--mount-set", "M1", "--mount-set", "M1"), "mount set 'M1' comes twice"),
    ):
        done = cli("bench", "campaign", tmp_path / "new", *options)
        assert done.exit_code == 2
        assert words in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
        assert not (tmp_path / "new").exists()


def test_platform_without_library_says_how_to_get_one(cli, tmp_path):
    done = cli("bench", "write", tmp_path / "platform", "--seed", 2)
    assert done.exit_code == 0
    assert "--mounts spectra" in done.stderr
    assert "--library" in done.stderr
    assert not (tmp_path / "platform" / LIBRARY_FILE).exists()


def test_platform_with_library(tmp_path, monkeypatch):
    """Of few runs: what the studies need is there."""
    few = campaign.TRAINING_RUNS[2::4]
    monkeypatch.setattr(
        platform_library, "training_plan", lambda name: campaign.CampaignPlan((name,), few)
    )
    folder = tmp_path / "platform"
    done = CliRunner().invoke(app, ["bench", "write", str(folder), "--seed", "2", "--library"])
    assert done.exit_code == 0, done.stderr
    _, mounts = read_library_json(folder / LIBRARY_FILE)
    assert [mount.mount.name for mount in mounts] == ["EnM", "GeM", "TSM", "Du"]
    assert all(one.surface is not None for one in mounts[2].directions)
    assert all(one.map_points.frequency.size == 0 for one in mounts[2].directions)
