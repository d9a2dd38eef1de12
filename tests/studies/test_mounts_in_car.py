"""Mounts from the car alone, through the same command as a user, and on to a platform."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from deboom.bench.layout import LOAD_CASES
from deboom.bench.platform_writer import write_platform
from deboom.bench.vehicle_writer import write_vehicle
from deboom.files.platform import read_platform
from deboom.mounts.surface_forces import identified_surfaces, surface_forces
from deboom.runs.runner import load_study, run_study
from pinned_pages import hold
from samples.driven_cars import CASE, coupled_model

STUDY = load_study("mounts_in_car")
CASES = tuple(case for case in LOAD_CASES if case.name in (CASE, "g6_wot120"))


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    folder = tmp_path_factory.mktemp("car") / "U06-1"
    return write_vehicle(folder, 1, "U06-1", "M0", load_cases=CASES)


@pytest.fixture(scope="module")
def finished(car, tmp_path_factory):
    return run_study(STUDY, tmp_path_factory.mktemp("results"), {"vehicle": car})


def test_the_page_says_which_directions_may_be_used(finished):
    hold(finished / "report.html", "mounts_in_car")
    summary = json.loads((finished / "summary.json").read_text(encoding="utf-8"))
    directions = pd.read_csv(finished / "directions.csv").set_index("direction")
    sure = directions[directions["identified"]]
    assert summary["n_identified"] == len(sure) >= 4
    assert {"EnM x", "GeM x", "TSM x", "Du x"} <= set(sure.index)
    assert sure["error of |K| [%]"].max() < 20


def test_a_platform_goes_on_from_library_and_load_cases(car, finished, tmp_path):
    """The same files as of a test bench: read, checked and modelled."""
    cases = tuple(case for case in CASES if case.name == CASE)
    folder = write_platform(tmp_path / "platform", 1, load_cases=cases, groups=("U06",))
    shutil.copy(finished / "mounts.library.json", folder)
    shutil.copy(finished / f"operating_{CASE}.csv", folder / "operating" / f"{CASE}.csv")
    torque = f"operating/{CASE}_torque.csv"
    shutil.copy(car / torque, folder / torque)
    toml = folder / "platform.toml"
    text = toml.read_text(encoding="utf-8")
    toml.write_text(text.replace(f"{CASE}.uff", f"{CASE}.csv"), encoding="utf-8")
    platform = read_platform(folder)
    assert platform.library_fault is None
    assert "TSM x" in identified_surfaces(platform.library)
    modelled = surface_forces(platform.load_case(CASE), platform.library)
    assert not any(modelled.outside.values())
    in_car = coupled_model(platform, platform.fleet)
    toml.write_text(text, encoding="utf-8")
    bench = coupled_model(read_platform(folder), platform.fleet)
    design = np.ones((1, len(bench.variable_names)))
    off = (in_car(design) - bench(design)) / bench.n_lines
    assert np.abs(off).max() < 1.5  # dB: mounts are 3 % softer on the road, and the body moves
    soft = design.copy()
    soft[0, bench.variable_names.index("TSM x")] = 0.8
    change = [(model(soft) - model(design)) / model.n_lines for model in (in_car, bench)]
    np.testing.assert_allclose(change[0], change[1], atol=0.3)
