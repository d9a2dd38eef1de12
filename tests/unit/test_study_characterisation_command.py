"""`deboom characterise`: from a campaign folder into the mount library, or a clear refusal."""

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from deboom.bench.campaign_plan import CampaignPlan, PlannedRun
from deboom.bench.campaign_writer import write_campaign
from deboom.cli_library import characterise
from deboom.mounts.library import open_library
from deboom.study import characterisation_library

RUNS = tuple(
    PlannedRun(gear, torque, full_load=False)
    for gear, torque in ((5, 60.0), (5, 200.0), (6, 120.0), (7, 220.0), (7, 80.0))
)
LINES = np.arange(20.0, 80.5, 2.0)


def call(*arguments):
    app = typer.Typer()
    app.command()(characterise)
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Five runs of two mount sets."""
    folder = tmp_path_factory.mktemp("measured") / "campaign"
    return write_campaign(folder, 1, CampaignPlan(("M1", "M2"), RUNS, 1, frequency=LINES))


@pytest.fixture(scope="module")
def kept(campaign, tmp_path_factory):
    """Keep the mounts of M2 in a library; its path, and what the command said."""
    library = tmp_path_factory.mktemp("library") / "mounts.db"
    done = call(campaign, "--library", library, "--mount-set", "M2")
    assert done.exit_code == 0, done.output
    return library, done.output


def test_mounts_of_the_set_asked_for_are_in_the_library_with_their_surfaces(kept):
    library, output = kept
    with open_library(library) as opened:
        found = opened.identities()
        strut = opened.load(opened.find(mount="TSM"))
    assert [(one.mount, one.variant) for one in found] == [
        (mount, "M2") for mount in ("Du", "EnM", "GeM", "TSM")
    ]
    surface = strut.direction("x").surface.response_surface()
    middle = np.mean(list(surface.ranges.values()), axis=1)
    assert surface.units["preload"] == "N m"
    assert 50e3 < abs(surface.predict_masked(*middle)[0]) < 2e6
    assert output.splitlines()[-1] == f"4 mounts kept in {library}"
    assert "TSM x" in output


def test_another_set_of_the_campaign_joins_later(campaign, kept, tmp_path):
    library = tmp_path / "mounts.db"
    library.write_bytes(kept[0].read_bytes())
    assert call(campaign, "--library", library, "--mount-set", "M1").exit_code == 0
    with open_library(library) as opened:
        assert {one.variant for one in opened.identities()} == {"M1", "M2"}


def test_mounts_that_are_there_are_exchanged_if_asked(campaign, kept):
    again = (campaign, "--library", kept[0], "--mount-set", "M2", "--replace")
    assert call(*again).exit_code == 0


def test_mounts_that_are_there_are_refused_before_any_work(campaign, kept, monkeypatch):
    monkeypatch.setattr(characterisation_library, "measuring_chains", None)
    refused = call(campaign, "--library", kept[0], "--mount-set", "M2")
    assert refused.exit_code == 2
    assert "--replace" in refused.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(("--mount-set", "M9"), "no mount set 'M9'"), (("--gear", "2"), "no run in the gears")],
)
def test_bad_requests_end_in_one_sentence(campaign, tmp_path, arguments, message):
    done = call(campaign, "--library", tmp_path / "mounts.db", *arguments)
    assert done.exit_code == 2
    assert message in done.output
