"""The front study with stiffnesses that follow the amplitude, and with scaled parts."""

import json
import pickle
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.pages.motion import PART_WARNING, motion_report
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.design_factor import Factor
from pinned_pages import hold_numbers

STUDY = Path(__file__).parents[2] / "studies" / "front.py"
BUDGET = {"seed": 1, "generations": 1, "population": 4, "samples": 4, "checks": 16}
BUDGET |= {"load_case": ["g6_wot160"], "polish": False, "with_": "prescribed"}


@pytest.fixture(scope="module")
def runs():
    platform = read_platform(STUDY.parent / "data" / "u06_f39_f45")
    return platform.runs(["g6_wot160"], fleet=platform.fleet.group("U06"))


def test_part_with_amplitude_is_recorded_warned_of_and_checked(tmp_path, capsys):
    options = {"motion": Motion.amplitude, "factor": Factor.part, "band": (25.0, 27.0)}
    run = run_study(load_study(STUDY), tmp_path, {**BUDGET, **options})
    assert PART_WARNING in capsys.readouterr().err
    hold_numbers(run, "numbers_of_amplitude_and_part")
    record = json.loads((run / "run.json").read_text())
    assert record["facts"]["motion"] == "amplitude-dependent"
    assert record["facts"]["design_factor"] == "part"
    assert record["facts"]["kernel"] == "numba"
    summary = json.loads((run / "summary.json").read_text())
    assert summary["design_factor"] == "part"
    assert 0.0 <= summary["held_amplitude_share"] < 0.05
    assert 0.0 <= summary["held_preload_share"] < 0.05
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "rides deeper into its stop and most of the benefit is lost" in page
    assert "<p>Uniqueness: load case g6_wot160" in page
    assert re.search(r"<p>Compact platform[^<]*</p>\s*<p>Vehicles: U06-1", page)
    assert re.search(r"<p>Of the lines and directions of today[^<]*</p>", page)
    assert "give one solution" in page
    assert "stiffness factor of a part" in page
    assert "amplitude-dependent motion" in page


def test_compiled_and_plain_kernel_agree_on_parts(runs):
    compiled = runs.model(Motion.amplitude, Factor.part)
    plain = replace(compiled, compiled=False)
    designs = np.random.default_rng(1).uniform(0.8, 1.2, (70, 12))
    whole = compiled(designs)
    np.testing.assert_allclose(whole, plain(designs), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(compiled(designs[5:7]), whole[5:7])
    carried = pickle.loads(pickle.dumps(compiled))
    np.testing.assert_array_equal(carried(designs[:3]), whole[:3])


def test_coupled_motion_of_parts_is_that_of_held_amplitudes(runs):
    index = runs.model(Motion.coupled, Factor.part)
    report = motion_report(index, np.ones((1, 12)))
    assert index.cases[0].follows.sum() == 0
    assert report.warnings == (PART_WARNING,)
    assert report.held_amplitude == 0.0
    coupled = runs.model(Motion.coupled)
    np.testing.assert_allclose(index(np.ones((1, 12))), coupled(np.ones((1, 12))), atol=1e-8)


def test_refuses_what_does_not_go_together(runs):
    with pytest.raises(InputError, match="--factor part goes with --motion coupled or amplitude"):
        runs.model(Motion.prescribed, Factor.part)
    spectra = runs.platform.runs(["g6_wot160"], fleet=runs.fleet, mounts="spectra")
    with pytest.raises(InputError, match="take --mounts library"):
        spectra.model(Motion.amplitude)
