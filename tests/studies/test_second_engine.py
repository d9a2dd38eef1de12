"""The study of a second engine at a tiny budget, through the same command as a user."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from deboom.bench.campaign import second_engine_plan, training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import load_second_engine
from deboom.errors import InputError
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.library import open_library
from deboom.runs.campaigns import characterise_into_library
from deboom.runs.runner import load_study, run_study
from pinned_pages import hold

STUDY = load_study("second_engine")
OPTIONS = CharacteriseOptions()
FIRST = replace(training_plan("M1"), shaker_repeats=1, frequency=np.arange(20.0, 80.5, 3.0))
SECOND = replace(
    second_engine_plan("M1"),
    runs=second_engine_plan("M1").runs[2::3],
    shaker_repeats=1,
    frequency=np.arange(27.0, 80.5, 1.5),
)


@pytest.fixture(scope="module")
def second(tmp_path_factory):
    """Three runs of the second engine."""
    return write_campaign(
        tmp_path_factory.mktemp("measured") / "second", 501, SECOND, bench=load_second_engine()
    )


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """Keep the mounts of the first engine, characterised over wheel torque."""
    folder = tmp_path_factory.mktemp("measured") / "first"
    write_campaign(folder, 1, FIRST)
    path = folder.parent / "mounts.db"
    characterise_into_library(folder, str(path), OPTIONS, lambda *_: None)
    return path


@pytest.fixture(scope="module")
def budget(second, library):
    return {"second": second, "library": str(library)}


def test_forces_of_the_second_engine_are_predicted(summary):
    assert 0.0 < summary["second_rms_force_percent_TSM_x"] < 4.0
    assert summary["second_r2_force_imag_TSM_x"] > 99.0
    assert 0.0 < summary["second_truth_error_percent_TSM_x"] < 5.0
    assert 60 < summary["second_inside_percent_TSM_x"] <= 100
    assert 0 < summary["second_static_difference_n_TSM_x"] < 30


def test_stiffness_across_follows_the_force_along_the_main_axis(finished):
    hold(finished, "second_engine")
    forces = pd.read_csv(finished / "second_forces.csv").set_index("direction")
    assert forces.loc["TSM z", "rms error of F [%]"] < 5.0


def test_both_engines_are_measured_on_virtual_benches_without_files_that_stay():
    plans = (replace(FIRST, runs=FIRST.runs[::5]), replace(SECOND, runs=SECOND.runs[:1]))
    said = []
    done = STUDY.module.virtual_engine(2, "M1", OPTIONS, lambda *s: said.append(s), plans)
    assert (done.title, done.campaign.name) == ("bench 2", "virtual_bench_502")
    assert done.campaign.order == 2.0
    assert not any(path.exists() for path in done.input_files)
    steps = STUDY.module.STEPS_PER_ENGINE
    assert said[-1][:2] == (steps, steps)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"second": None}, "name another engine with --second"),
        ({"library": None}, "give one of both"),
        ({"mount_set": "M7"}, "no mount fits"),
    ],
)
def test_bad_requests_are_refused_in_words(second, library, tmp_path, changes, message):
    options = {"second": second, "library": str(library), **changes}
    with pytest.raises(InputError, match=message):
        run_study(STUDY, tmp_path, options)


def test_a_mount_that_was_never_characterised_is_named(second, library, tmp_path):
    few = tmp_path / "few.db"
    with open_library(library) as opened, open_library(few, create=True) as other:
        mounts = [
            opened.load(identity) for identity in opened.identities() if identity.mount != "GeM"
        ]
        other.add(opened.campaigns(), mounts)
    with pytest.raises(InputError, match=r"\['GeM'\], which are not among the characterised"):
        run_study(STUDY, tmp_path, {"second": second, "library": str(few)})
