"""`deboom orders` and `deboom characterise --time-runs`: from time data to the library."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from deboom.bench.campaign import CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.cli import app
from deboom.files.campaign import read_campaign
from deboom.mounts.library import open_library

RUNS = tuple(
    PlannedRun(gear, torque, full_load=False)
    for gear, torque in ((5, 60.0), (5, 220.0), (6, 120.0), (7, 220.0))
)
LINES = np.arange(30.0, 60.5, 1.5)
NAME = "g5_wot220_time"


def call(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Measure four slices, and a short run over time."""
    over_time = TimeRunPlan(last_speed=1700.0, duration=2.0, sample_rate=2048.0)
    plan = CampaignPlan(("M1",), RUNS, 1, frequency=LINES, time_run=over_time)
    return write_campaign(tmp_path_factory.mktemp("bench") / "campaign", 1, plan)


@pytest.fixture
def campaign(written, tmp_path):
    return Path(shutil.copytree(written, tmp_path / "campaign"))


def test_one_command_leads_from_time_data_to_stiffness(campaign, tmp_path):
    library = tmp_path / "mounts.db"
    done = call("characterise", campaign, "--library", library, "--time-runs")
    assert done.exit_code == 0, done.output
    assert f"{NAME} -> run {NAME} of mount set M1" in done.output
    with open_library(library) as opened:
        points = opened.load(opened.only(opened.identities(mount="TSM"))).direction("x").map_points
    own = points.run == NAME
    assert np.count_nonzero(own) == 13
    with np.load(campaign / "truth" / f"{NAME}.npz") as truth:
        column = truth["channels"].tolist().index("TSM x")
        true = np.interp(
            points.frequency[own], truth["frequency"], np.abs(truth["stiffness"][:, column])
        )
    assert np.abs(points.dynamic_stiffness[own]) == pytest.approx(true, rel=0.04)
    again = call("characterise", campaign, "--library", library, "--time-runs", "--replace")
    assert again.exit_code == 0
    assert "->" not in again.output


def test_orders_adds_a_run_and_says_how_far_to_believe_it(campaign):
    arguments = ("--name", "g5", "--rpm-step", "20")
    done = call("orders", campaign, NAME, *arguments)
    assert done.exit_code == 0, done.output
    assert "it smears what is finer than" in done.output
    assert read_campaign(campaign).runs[-1].name == "g5"
    again = call("orders", campaign, NAME, *arguments)
    assert again.exit_code == 2
    assert "is there already: choose another name" in again.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("other",), "there is no time run 'other', use g5_wot220_time"),
        ((NAME, "--rpm-to", "1800"), "the run does not pass"),
        ((NAME, "--rpm-step", "0"), "rpm step 0 is not positive"),
        ((NAME, "--bandwidth", "1"), "too short for the filter"),
    ],
)
def test_bad_requests_end_in_one_sentence_and_change_nothing(campaign, arguments, message):
    before = sorted(campaign.rglob("*"))
    toml = (campaign / "campaign.toml").read_bytes()
    done = call("orders", campaign, *arguments)
    assert done.exit_code == 2
    assert message in done.output
    assert sorted(campaign.rglob("*")) == before
    assert (campaign / "campaign.toml").read_bytes() == toml
