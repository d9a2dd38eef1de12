"""The characterisation study at a tiny budget, through the same command as a user."""

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from deboom.bench.campaign import NO_ERRORS, CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.errors import InputError
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.characterised_bench import (
    direction_numbers,
    model_table,
    shown_run,
    usable_maps,
)
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.mounts.response_surface import DynamicStiffnessSurface, standard_models
from deboom.pages import mount_figures
from deboom.pages.mount_characterisation import characterisation_report
from deboom.report.report import Picture, Report
from deboom.runs.campaigns import characterise_given
from deboom.runs.runner import load_study, run_study
from pinned_pages import hold
from samples.campaign_runs import SEVEN_RUNS

DRAWN = Report.figure
STUDY = load_study("mount_characterisation")
LINES = np.arange(20.0, 80.5, 1.0)


@pytest.fixture(scope="module")
def finished(thesis_run):
    return thesis_run("mounts")


def test_mounts_are_found_within_a_few_percent_of_the_truth(finished):
    """One bench: 90 % bounds; medians over many benches stand in the validation page."""
    numbers = pd.read_csv(finished / "directions.csv").set_index("direction")
    for name in numbers.index.difference(["EnM y", "GeM y", "TSM y"]):
        assert 0 < numbers.loc[name, "error [1]"] < (0.03 if name[-1] == "x" else 0.10), name


def test_most_of_the_truth_lies_within_its_stated_band(finished):
    hold(finished, "mount_characterisation")
    uncertainty = pd.read_csv(finished / "uncertainty.csv").set_index("direction")
    # one bench is one draw of its alignment
    inside = uncertainty["truth inside the band [%]"].drop(["EnM y", "GeM y", "TSM y"])
    assert inside.mean() > 80


@pytest.fixture(scope="module")
def blind(seven_runs, tmp_path_factory):
    """Characterise the same campaign in a folder without truth."""
    folder = tmp_path_factory.mktemp("blind") / "seven_runs"
    shutil.copytree(seven_runs, folder, ignore=shutil.ignore_patterns("truth"))
    return characterise_given(folder, "M1", CharacteriseOptions(), lambda *_: None)


def test_without_truth_the_same_numbers_and_no_comparison(blind, finished):
    assert blind.truth is None
    numbers = direction_numbers(blind)
    assert not {"error", "check_error", "coverage"} & set(numbers.columns)
    with_truth = pd.read_csv(finished / "directions.csv")
    for name in ("r2_real", "r2_imag", "half_width"):
        assert with_truth[f"{name} [1]"].to_numpy() == pytest.approx(numbers[name].to_numpy())


@pytest.mark.slow("draws every figure of a page")
def test_every_figure_has_its_place_on_the_page(blind, monkeypatch):
    strut = {"TSM x": blind.result.directions["TSM x"]}
    bench = replace(blind, result=replace(blind.result, directions=strut))
    monkeypatch.setattr(Report, "figure", DRAWN)
    done = characterisation_report(bench, None)
    assert set(done.figures) == {
        "static_x",
        "stiffness_map_TSM",
        "frequency_map_TSM",
        "stiffness_dependence",
        "splits",
        "stiffness_over_speed_TSM",
        "force_over_speed_TSM",
        "force_transfer",
        "rebuilt_accelerations",
        "motions_beside",
    }
    blocks = [block for section in done.sections for block in section.blocks]
    shown = [block.png for block in blocks if isinstance(block, Picture)]
    assert sorted(shown) == sorted(done.figures.values())
    assert "truth" not in done.tables


def test_every_line_is_in_the_tables_with_its_noise_and_its_surface(blind):
    """The tables that figures are drawn from say what the map and the surface say."""
    table = mount_figures.stiffness_lines(blind)
    measured = blind.result.directions["TSM x"].measured
    lines = table[table["direction"] == "TSM x"]
    assert len(lines) == len(measured)
    assert len(table) == sum(len(d.measured) for d in blind.result.directions.values())
    assert lines["Im K [N/mm]"].to_numpy() == pytest.approx(measured.stiffness.imag / 1e3, rel=1e-5)
    assert lines["displacement [mm]"].to_numpy() == pytest.approx(
        1e3 * measured.amplitude, rel=1e-5
    )
    # what is left beside the surface is noise of the stated size
    left = lines["Im K [N/mm]"] - lines["Im K, surface [N/mm]"]
    assert np.nanstd(left / lines["σ of Re K and of Im K [N/mm]"]) == pytest.approx(1.0, abs=0.3)

    checks = mount_figures.check_lines(blind)
    strut = checks[checks["direction"] == "TSM x"]
    assert set(strut["run"]) == {run.name for run in blind.check_runs}
    for letter, unit in (("K", "N/mm"), ("F", "N")):
        for part in ("Re", "Im"):
            seen = strut[f"{part} {letter} [{unit}]"]
            error = (seen - strut[f"{part} {letter}, surface [{unit}]"]).abs()
            inside = error < strut[f"half width of {part} {letter} [{unit}]"]
            assert inside.mean() > 0.9, (part, letter)


@pytest.mark.parametrize("split", [(), (195.0,), (400.0,)])
def test_inflection_points_of_a_surface_are_those_of_its_curve(split):
    preload, amplitude, frequency = np.meshgrid(
        np.linspace(0.0, 600.0, 61), np.arange(1, 6) * 1e-4, np.linspace(20.0, 80.0, 5)
    )
    points = np.column_stack([preload.ravel(), amplitude.ravel(), frequency.ravel()])
    stiffness = 1e5 + 5e-3 * (points[:, 0] - 200.0) ** 3
    surface = DynamicStiffnessSurface(PiecewiseCubicRegressor(split=split))
    ((at, k),) = mount_figures.inflections(surface.fit(points, stiffness * (1 + 0.1j)), points)
    assert at == pytest.approx(200.0, abs=12.0)  # the width in which two pieces are blended
    assert k == pytest.approx(1e5, abs=10.0)


def test_the_outline_of_a_map_leaves_out_what_no_run_came_near_to():
    """A convex hull would enclose the middle of the ring."""
    angle = np.linspace(0.0, 2 * np.pi, 100)
    x, y, height = mount_figures.outline(np.cos(angle), 2.0 + np.sin(angle), amplitude=False)
    across, up = np.meshgrid(x, y)
    radius = np.hypot(across, up - 2.0)
    assert (height[radius < 0.75] < 0).all()
    assert (height[np.abs(radius - 1.0) < 0.04] > 0).all()


def test_the_scale_is_made_for_most_intervals_and_the_widest_is_named():
    speed, zero = np.linspace(1000.0, 1990.0, 100), np.zeros(100)
    half = np.ones(100)
    even, nothing = mount_figures.without_spikes(speed, {"a": zero}, {"a": (-half, half)})
    assert nothing == ""
    assert even["a"][1].max() == 1.0
    half[30] = 40.0
    cut, named = mount_figures.without_spikes(speed, {"a": zero}, {"a": (-half, half)})
    assert named == "band to ± 40 at 1300 rpm"
    assert cut["a"][1].max() == 1.0


def test_motion_in_a_mount_is_that_of_its_map_and_lies_between_those_beside_it(blind):
    (chain, *_) = blind.result.chains
    run = shown_run(blind)
    motions = mount_figures.motions_beside(chain, run)
    assert set(motions) == {"EnM", "GeM", "TSM"}
    for mount, (in_mount, beside) in motions.items():
        measured = blind.result.directions[f"{mount} x"].measured
        lines = measured.select(measured.run == run.name)
        rows = np.searchsorted(run.frequency, lines.frequency)
        acceleration = (2 * np.pi * lines.frequency) ** 2 * lines.amplitude
        assert in_mount[rows] == pytest.approx(acceleration, rel=1e-4)
        low, high = sorted(np.median(moved / in_mount) for moved in beside.values())
        assert low < 0.95 < 1.05 < high  # one sits above the mount, one below


def test_r2_stops_where_noise_says(blind):
    """A perfect model would reach what noise allows: surfaces of directions that move do."""
    usable = usable_maps(blind)
    numbers = direction_numbers(blind).set_index("direction")
    for name in ("EnM z", "GeM x", "TSM x", "TSM z"):
        real, imag = mount_figures.noise_ceiling(usable[name])
        assert numbers.loc[name, "r2_real"] == pytest.approx(real, abs=0.004)
        assert numbers.loc[name, "r2_imag"] == pytest.approx(imag, abs=0.02)


def test_numbers_keep_six_digits():
    values = np.array([1234567.8, -0.00123456789, 0.0, np.nan])
    kept = mount_figures.significant(values)
    assert kept[:3].tolist() == [1234570.0, -0.00123457, 0.0]
    assert np.isnan(kept[3])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"noise_free": True}, "leave it out, or leave --campaign out"),
        ({"mount_set": "M7"}, "no mount set 'M7'"),
    ],
)
def test_bad_requests_are_refused_in_words(seven_runs, tmp_path, changes, message):
    with pytest.raises(InputError, match=message):
        run_study(STUDY, tmp_path, {"campaign": seven_runs, **changes})


def test_without_errors_nothing_but_the_model_form_is_left(tmp_path):
    plan = CampaignPlan(("M1",), SEVEN_RUNS, 1, frequency=LINES[::2])
    folder = write_campaign(tmp_path / "exact", 1, plan, NO_ERRORS)
    exact = characterise_given(folder, "M1", CharacteriseOptions(), lambda *_: None)
    assert direction_numbers(exact)["error"].max() < 0.0105


def test_other_models_are_compared_on_the_check_runs(blind):
    chosen = {name: standard_models()[name] for name in ("one cubic", "two cubics")}
    table = model_table(blind, chosen)
    assert len(set(table["direction"])) > 5
    assert table["model"].tolist() == list(chosen) * len(set(table["direction"]))
    assert table["lines compared [1]"].min() >= 2
