"""`deboom orders` and `deboom characterise --time-runs`: from time data to the library."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from command_line import call
from deboom.bench.campaign import CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.files.truth import read_set_truth
from deboom.mounts.library import open_library
from deboom.runs import campaigns as characterisation_library

RUNS = tuple(
    PlannedRun(gear, torque, full_load=False)
    for gear, torque in ((5, 60.0), (5, 220.0), (6, 120.0), (7, 220.0))
)
LINES = np.arange(30.0, 60.5, 1.5)
NAME = "g5_wot220_time"
pytestmark = pytest.mark.usefixtures("few_chains")


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
    assert f"{NAME} -> run {NAME} of mount set M1" in done.output
    with open_library(library) as opened:
        points = opened.load(opened.only(opened.identities(mount="TSM"))).direction("x").map_points
    of_run = points.run == NAME
    assert np.count_nonzero(of_run) == 13
    with np.load(campaign / "truth" / f"{NAME}.npz") as truth:
        column = truth["channels"].tolist().index("TSM x")
        true = np.interp(
            points.frequency[of_run], truth["frequency"], np.abs(truth["stiffness"][:, column])
        )
    assert np.abs(points.dynamic_stiffness[of_run]) == pytest.approx(true, rel=0.04)
    again = call("characterise", campaign, "--library", library, "--time-runs", "--replace")
    assert "->" not in again.output


def test_orders_adds_a_run_and_says_how_far_to_believe_it(campaign):
    arguments = ("--name", "g5", "--rpm-step", "20")
    done = call("orders", campaign, NAME, *arguments)
    assert "it smears what is finer than" in done.output
    assert read_campaign(campaign).runs[-1].name == "g5"
    again = call("orders", campaign, NAME, *arguments, code=2)
    assert "is there already: choose another name" in again.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("other",), "there is no time run 'other', use g5_wot220_time"),
        ((NAME, "--rpm-to", "1800"), "the run does not pass"),
        ((NAME, "--rpm-step", "0"), "rpm_step is 0.0: give a number above 0"),
        ((NAME, "--bandwidth", "1"), "too short for the filter"),
    ],
)
def test_bad_requests_end_in_one_sentence_and_change_nothing(campaign, arguments, message):
    before = sorted(campaign.rglob("*"))
    toml = (campaign / "campaign.toml").read_bytes()
    assert message in call("orders", campaign, *arguments, code=2).output
    assert sorted(campaign.rglob("*")) == before
    assert (campaign / "campaign.toml").read_bytes() == toml


SLICES = tuple(
    PlannedRun(gear, torque, full_load=False)
    for gear, torque in ((5, 60.0), (5, 200.0), (6, 120.0), (7, 220.0), (7, 80.0))
)
COARSE = np.arange(20.0, 80.5, 2.0)


@pytest.fixture(scope="module")
def two_sets(tmp_path_factory):
    """Five runs of two mount sets."""
    folder = tmp_path_factory.mktemp("measured") / "campaign"
    return write_campaign(folder, 1, CampaignPlan(("M1", "M2"), SLICES, 1, frequency=COARSE))


@pytest.fixture(scope="module")
def kept(two_sets, tmp_path_factory):
    """Keep the mounts of M2 in a library; its path, and what the command said."""
    library = tmp_path_factory.mktemp("library") / "mounts.db"
    done = call("characterise", two_sets, "--library", library, "--mount-set", "M2")
    return library, done.output


def test_mounts_of_the_set_asked_for_are_in_the_library_with_their_surfaces(kept):
    library, output = kept
    with open_library(library) as opened:
        identities = opened.identities()
        strut = opened.load(opened.only(opened.identities(mount="TSM")))
    assert [(identity.mount, identity.variant) for identity in identities] == [
        (mount, "M2") for mount in ("Du", "EnM", "GeM", "TSM")
    ]
    surface = strut.direction("x").surface
    middle = np.mean(list(surface.ranges.values()), axis=1)
    assert surface.units["preload"] == "N m"
    assert 50e3 < abs(surface.predict(middle, extrapolate=True)) < 2e6
    assert output.splitlines()[-1] == f"4 mounts kept in {library}"
    assert "TSM x" in output


def test_mounts_that_are_there_are_exchanged_and_another_set_joins_if_asked(
    two_sets, kept, tmp_path
):
    library = tmp_path / "mounts.db"
    library.write_bytes(kept[0].read_bytes())
    call("characterise", two_sets, "--library", library, "--replace")
    with open_library(library) as opened:
        assert {identity.variant for identity in opened.identities()} == {"M1", "M2"}


def test_mounts_that_are_there_are_refused_before_any_work(two_sets, kept, monkeypatch):
    monkeypatch.setattr(characterisation_library, "measuring_chains", None)
    refused = call("characterise", two_sets, "--library", kept[0], "--mount-set", "M2", code=2)
    assert "--replace" in refused.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(("--mount-set", "M9"), "no mount set 'M9'"), (("--gear", "2"), "no run in the gears")],
)
def test_bad_requests_end_in_one_sentence(two_sets, tmp_path, arguments, message):
    done = call("characterise", two_sets, "--library", tmp_path / "mounts.db", *arguments, code=2)
    assert message in done.output


FREQUENCY = np.array([20.0, 20.25, 20.5])
RUNS_2 = ("g5_wot120", "g5_wot220")
CHANNELS = ("TSM x", "Du left x", "Du right x")


def lines_of(mount, axis, run, frequency):
    """Make the names of the lines of a map."""
    return SimpleNamespace(mount=mount, axis=axis, run=np.array(run), frequency=np.array(frequency))


@pytest.fixture
def truth(tmp_path):
    """Stiffness that tells run, line and channel: 100, 10 and 1 each."""
    (tmp_path / "truth").mkdir()
    run, line, channel = np.meshgrid(range(2), range(3), range(3), indexing="ij")
    np.savez(
        tmp_path / "truth" / "M1.npz",
        runs=np.array(RUNS_2),
        channels=np.array(CHANNELS),
        frequency=FREQUENCY,
        stiffness=100.0 * run + 10.0 * line + channel + 0j,
    )
    return read_set_truth(tmp_path, "M1")


def test_every_line_finds_its_run_frequency_and_piece(truth):
    strut = lines_of("TSM", "x", ["g5_wot220", "g5_wot120", "g5_wot220"], [20.5, 20.0, 20.0])
    assert truth.at(strut).tolist() == [120.0, 0.0, 100.0]
    wishbone = lines_of("Du", "x", ["g5_wot120 left", "g5_wot120 right"], [20.25, 20.25])
    assert truth.at(wishbone).tolist() == [11.0, 12.0]


@pytest.mark.parametrize(
    ("mount", "run", "frequency", "message"),
    [
        ("TSM", "g6_wot120", 20.0, "no truth of channel TSM x in run g6_wot120"),
        ("EnM", "g5_wot120", 20.0, "no truth of channel EnM x"),
        ("TSM", "g5_wot120", 20.1, "frequency lines are not those of the campaign"),
        ("TSM", "g5_wot120", 30.0, "frequency lines are not those of the campaign"),
    ],
)
def test_a_line_that_the_truth_does_not_know_is_refused(truth, mount, run, frequency, message):
    with pytest.raises(InputError, match=message):
        truth.at(lines_of(mount, "x", [run], [frequency]))


def test_a_campaign_without_truth_has_none(tmp_path):
    assert read_set_truth(tmp_path, "M1") is None
