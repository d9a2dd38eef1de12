"""A bench's campaign, through its files, against the truth beside them."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from deboom.bench.campaign import NO_ERRORS, TRAINING_RUNS, CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.files.campaign import read_campaign
from deboom.measurement.sensors import Tolerances
from deboom.mounts.characterise import CharacteriseOptions, characterise
from deboom.mounts.operating_map import Preload

LINES = np.linspace(20.0, 80.0, 61)
PLAN = CampaignPlan(mount_sets=("M1",), runs=TRAINING_RUNS, frequency=LINES)
OPTIONS = CharacteriseOptions()


def measured(folder, errors=None, lines=LINES):
    """Characterised mounts, and per direction: true and modelled stiffness, band covers truth."""
    write_campaign(folder, 3, replace(PLAN, frequency=lines), errors)
    campaign = read_campaign(folder)
    result = characterise(campaign, "M1", OPTIONS)
    with np.load(folder / "truth" / "M1.npz", allow_pickle=False) as file:
        truth = {name: file[name] for name in ("runs", "channels", "stiffness")}
    place = {str(name): k for k, name in enumerate(truth["runs"])}
    found = {}
    for name, one in result.directions.items():
        kept = one.measured.select(~one.measured.near_floor)
        true = np.empty(len(kept), dtype=complex)
        for label in np.unique(kept.run):
            run, _, piece = str(label).partition(" ")
            channel = " ".join(filter(None, (kept.mount, piece, kept.axis)))
            column = list(truth["channels"]).index(channel)
            rows = kept.run == label
            at = np.searchsorted(lines, kept.frequency[rows])
            true[rows] = truth["stiffness"][place[run.removeprefix("M1_")], at, column]
        points = kept.samples(Preload.WHEEL_TORQUE).points
        modelled = one.surface.predict(points, extrapolate=True)
        scale = np.ptp(points, axis=0)
        rows = cKDTree(points / scale).query(one.budget.points / scale)[1]
        off = (np.abs(true) / np.abs(modelled) - 1)[rows]
        covered = np.mean((one.budget.lower <= off) & (off <= one.budget.upper))
        found[name] = (true, modelled, covered)
    return result, found


def rms_error(true, modelled):
    return np.sqrt(np.mean((np.abs(modelled) / np.abs(true) - 1) ** 2))


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return measured(tmp_path_factory.mktemp("bench") / "campaign")


# single bench: the study's 90 % bounds; medians over many benches stand in the validation page
@pytest.mark.parametrize(("axis", "bound"), [("x", 0.03), ("z", 0.10)])
def test_true_stiffness(bench, axis, bound):
    for name, (true, modelled, _) in bench[1].items():
        if name.endswith(axis):
            assert rms_error(true, modelled) < bound, name


def test_surfaces_agree_with_what_was_measured(bench):
    for name, one in bench[0].directions.items():
        if name[-1] == "x" and name != "Du x":
            assert one.surface.r2_real_ > 0.998
            assert one.surface.r2_imag_ > 0.992
        if name[-1] != "y":
            assert one.surface.r2_force_ > 0.995


def test_y_is_marked_and_x_and_z_are_not(bench):
    identified = {name: one.budget.identified for name, one in bench[0].directions.items()}
    assert [name for name, known in identified.items() if not known] == ["EnM y", "GeM y", "TSM y"]


def test_truth_lies_in_the_band(bench):
    covered = [c for name, (_, _, c) in bench[1].items() if name[-1] != "y"]
    # one bench is one draw of its alignment: the pooled rate over 20 is claimed elsewhere
    assert np.mean(covered) > 0.8


def test_self_calibration_narrows_the_band(bench):
    for name, one in bench[0].directions.items():
        if name[-1] in "yz":
            assert one.budget.half_width_95 < one.budget.stated_half_width


def test_chains_fit_the_bench_to_their_noise(bench):
    powertrain = dict(bench[0].chains[0].misfit)
    assert all(0.3 < value < 2.0 for value in powertrain.values())


def test_without_errors_nothing_but_the_model_form_is_left(tmp_path):
    _, found = measured(tmp_path / "campaign", NO_ERRORS, LINES[::3])
    for name, (true, modelled, _) in found.items():
        assert rms_error(true, modelled) < 0.0105, name
        # per line nothing but how the bench gives way over frequency
        assert np.median(np.abs(modelled / true - 1)) < 0.01, name


def test_tolerances_of_the_file_are_those_of_the_bench(bench):
    stated = bench[0].campaign.tolerances
    assert isinstance(stated, Tolerances)
    zero = [one.name for one in dataclasses.fields(stated) if getattr(stated, one.name) == 0.0]
    assert zero == []
