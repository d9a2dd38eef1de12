"""A campaign takes a new operating run in, whole, or stays as it was."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deboom.bench.campaign_plan import CampaignPlan, PlannedRun
from deboom.bench.campaign_writer import write_campaign
from deboom.errors import InputError
from deboom.files import campaign_new_run
from deboom.files.campaign import read_campaign
from deboom.files.campaign_new_run import add_operating_run, new_run_file

TOML = "campaign.toml"
LINES = np.arange(30.0, 40.5, 1.0)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench") / "campaign"
    plan = CampaignPlan(("M1",), (PlannedRun(5, 220.0, True),), 1, frequency=LINES)
    return write_campaign(folder, 1, plan)


@pytest.fixture
def folder(written, tmp_path):
    return Path(shutil.copytree(written, tmp_path / "campaign"))


@pytest.fixture
def run(written):
    return replace(read_campaign(written).runs[0], name="again", gear=6)


def files(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def edited(path, old, new):
    text = path.read_bytes().decode("utf-8")
    assert old in text
    path.write_bytes(text.replace(old, new).encode("utf-8"))


def without_rows(path, start):
    rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(r for r in rows if not r.startswith(start)), encoding="utf-8")


def test_a_new_run_reads_back_as_it_was_and_comments_stay(folder, run):
    edited(folder / TOML, "[engine]", "# weighed twice\n[engine]")
    place = add_operating_run(folder, run, ("from elsewhere", "x" * 100))
    assert place == folder / "runs" / "M1" / "again.uff"
    assert "# weighed twice" in (folder / TOML).read_text(encoding="utf-8")
    found = read_campaign(folder).runs[-1]
    assert (found.name, found.gear, found.rising) == ("again", 6, True)
    for name in ("engine_torque", "static_force"):
        assert np.array_equal(getattr(found, name), getattr(run, name))
    for name in ("acceleration", "cell_force"):
        assert np.array_equal(getattr(found, name).values, getattr(run, name).values)


def test_channels_in_other_units_and_against_their_axes_read_back_the_same(folder, run):
    table = folder / "channels.csv"
    rows = [
        row.replace("+x", "-x").replace("m/s^2", "g") if ",acceleration," in row else row
        for row in table.read_text(encoding="utf-8").splitlines()
    ]
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    # the run that is there is in m/s^2 still: only the new one is asked for
    edited(folder / TOML, "[[runs]]", "[[time_runs]]\npulses_per_revolution = 2")
    add_operating_run(folder, run)
    (found,) = read_campaign(folder).runs
    assert found.acceleration.values == pytest.approx(run.acceleration.values)


@pytest.mark.parametrize(
    ("change", "spoil", "message"),
    [
        ({"name": "g5_wot220"}, None, "run 'g5_wot220' of mount set M1 is there already"),
        ({"name": "a b"}, None, "'a b' is no name of a run"),
        ({"name": "../out"}, None, "is no name of a run"),
        ({"static_force_names": ("TSM x",), "static_force": np.zeros((11, 1))}, None, "no static"),
        ({}, lambda f: (f / "runs/M1/again.uff").write_bytes(b"x"), "though no run of"),
        (
            {},
            lambda f: without_rows(f / "channels.csv", "engine speed"),
            "add its row",
        ),
    ],
)
def test_what_does_not_fit_is_refused_and_nothing_changes(folder, run, change, spoil, message):
    if spoil is not None:
        spoil(folder)
    before = files(folder)
    with pytest.raises(InputError, match=message):
        add_operating_run(folder, replace(run, **change))
    assert files(folder) == before


def test_a_dead_channel_is_refused_and_nothing_changes(folder, run):
    values = np.array(run.acceleration.values)
    values[:, 3] = 0
    before = files(folder)
    with pytest.raises(InputError, match="is dead"):
        add_operating_run(
            folder, replace(run, acceleration=replace(run.acceleration, values=values))
        )
    assert files(folder) == before


def test_runs_in_another_form_are_refused_and_nothing_changes(folder, run, monkeypatch):
    path = folder / TOML
    monkeypatch.setattr(campaign_new_run, "write_uff", lambda path, *_, **__: path.touch())
    monkeypatch.setattr(campaign_new_run, "_check", lambda *_: None)
    text = path.read_text(encoding="utf-8")
    start, end = text.index("[[runs]]"), text.index("[[shaker_runs]]")
    inline = ", ".join(text[start:end].splitlines()[1:-1])
    path.write_text(
        text[:start].replace("[engine]", f"runs = [{{{inline}}}]\n[engine]") + text[end:],
        encoding="utf-8",
    )
    assert len(read_campaign(folder).runs) == 1
    before = files(folder)
    with pytest.raises(InputError, match=r"write the list as \[\[runs\]\] sections"):
        add_operating_run(folder, run)
    assert files(folder) == before


def test_the_place_of_a_new_run_is_told_before_any_work(folder):
    assert new_run_file(folder, "M1", "new") == folder / "runs" / "M1" / "new.uff"
    with pytest.raises(InputError, match="is there already"):
        new_run_file(folder, "M1", "g5_wot220")
