"""The study of component TPA on a virtual drive unit, and on a user's folder."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from command_line import call
from deboom.bench import ComponentPlan, write_component_test
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.pages.component_tpa import measured_lines, moved_level
from deboom.runs.runner import load_study
from pinned_pages import hold

STUDY, BUDGET = load_study("component_tpa"), {}


def test_a_virtual_drive_unit_against_its_truth(finished, summary):
    hold(finished, "component_tpa")
    assert summary["completeness"] > 0.99
    assert summary["on_board_db"] < 1.0
    assert summary["sound_db"] < 0.5
    assert summary["receiver_sound_db"] < 1.5
    assert summary["blocked_error_percent"] < 15.0
    assert summary["n_doubts"] == 0


def test_tables_have_units_and_every_line(finished):
    forces = pd.read_csv(finished / "blocked_forces_steady_1.csv")
    assert {"frequency [Hz]", "point 1 x real [N]", "point 3 mz to [N m]"} <= {*forces}
    assert len(forces) == 61
    ranks = pd.read_csv(finished / "contributions.csv")
    shares = ranks[ranks["what"] == "load"].groupby(["run", "ear"])["share of the energy [1]"]
    assert shares.sum().to_numpy() == pytest.approx([1.0] * 4)
    on_board = pd.read_csv(finished / "on_board.csv")
    assert on_board["coherence [1]"].between(0.9, 1.0).all()


def test_another_receiver_is_compared_on_the_lines_of_the_prediction():
    lines = np.arange(20.0, 26.0)
    measured = Spectrum(lines, lines[:, np.newaxis] + 0j, ("driver ear",), "Pa")
    sound = Spectrum(lines[2:4], measured.values[2:4], measured.channels, "Pa")
    moved = SimpleNamespace(receiver="wagon", run="steady", sound=sound, measured=measured)
    assert measured_lines(moved) == pytest.approx(sound.values)
    assert moved_level(moved) == pytest.approx(0.0)
    other = Spectrum(lines[2:4] + 0.5, sound.values, sound.channels, "Pa")
    with pytest.raises(InputError, match="run steady lack lines"):
        measured_lines(SimpleNamespace(**vars(moved) | {"sound": other}))


def test_a_users_folder_with_what_it_leaves_out(tmp_path):
    """A hose that nobody measured, and sound through the air: the page says both first."""
    folder = tmp_path / "drive"
    plan = ComponentPlan(points=1, unmeasured_rotations=True, airborne=1.0, line_step=4.0)
    write_component_test(folder, 5, plan=plan, truth_seed=4)
    done = call(
        "run",
        "component_tpa",
        "--test",
        folder,
        "--out",
        tmp_path / "out",
        "--regularisation",
        "l-curve",
    )
    run = Path(done.stdout.strip().splitlines()[-1])
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    assert summary["n_doubts"] >= 2
    assert "blocked_error_percent" not in summary
    assert "receiver_sound_db" not in summary
