"""The validation of a synthesis at a tiny budget, through the same command as a user."""

import json
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import ten_questions
from deboom import plot
from deboom.bench.campaign import TRAINING_RUNS, CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.layout import LOAD_CASES
from deboom.bench.operating_run import CarErrors
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import InputError
from deboom.pages.synthesis_validation import criterion, synthesis_report
from deboom.pages.thesis import read_thesis
from deboom.runs.campaigns import virtual_vehicles
from deboom.runs.runner import load_study, run_study
from deboom.vehicles import synthesis
from samples.thesis_runs import wrong_in_run

STUDY = load_study("synthesis_validation")
MIX = "EnM1-GeM2-TSM1-Du2"
PLAN = CampaignPlan(("M1", "M2", MIX), TRAINING_RUNS[:9:2], shaker_repeats=1)
CASE = LOAD_CASES[1]
pytestmark = [
    pytest.mark.usefixtures("few_chains"),
    pytest.mark.slow("measures a bench and a vehicle, and synthesises one from the other"),
]
PICTURE = b"\x89PNG\r\n\x1a\n" + bytes(8) + b"\0\0\0\1\0\0\0\1"


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("measured") / "U06-2"
    return write_vehicle(folder, 1, "U06-2", "M1", load_cases=(CASE,))


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Two mount sets and a mix of them, in 5th gear."""
    return write_campaign(tmp_path_factory.mktemp("measured") / "bench", 1, PLAN)


@pytest.fixture(scope="module")
def validation(bench, vehicle):
    """Validate once: what was measured, report, curves of each picture over speed by panel."""
    drawn = []

    def record(panels, order=None, **_):
        if order is not None:
            drawn.append({panel.title: panel.curves for panel in panels})
        assert all(len(c) == len(p.abscissa) for p in panels for c in p.curves.values())
        return PICTURE

    options = STUDY.module.Options(campaign=bench, vehicle=[vehicle], load_case=CASE.name)
    data = STUDY.module.prepare(options)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plot, "curve_panels", record)
        report = STUDY.module.run(data, options)
        assert report.figures
        return data, report, drawn


@pytest.fixture(scope="module")
def small_campaign(tmp_path_factory):
    """One mount set in five runs."""
    plan = replace(PLAN, mount_sets=("M1",))
    return write_campaign(tmp_path_factory.mktemp("measured") / "small", 1, plan)


def test_the_car_says_how_stiff_its_mounts_are_and_how_strong_the_loudspeaker_was(validation):
    (row,) = validation[1].tables["car_factors"].to_dict("records")
    factors = [value for name, value in row.items() if "over bench" in name]
    assert len(factors) == 4
    np.testing.assert_allclose(factors, CarErrors().mount_stiffness, atol=0.05)
    assert row["taken over"]
    assert row["left of forces by inversion [%]"] < 10
    road = validation[1].tables["comparisons"].groupby("comparison")["corr_s magnitude [%]"].max()
    assert road[synthesis.ON_ROAD] < road[synthesis.ON_ROAD_AS_TESTED]


def test_mounts_of_another_stiffness_are_refused_where_they_do_not_explain_the_road(validation):
    """The same road with the bench's forces of another excitation: no stiffness explains it."""
    data, *_ = validation
    (driven,), bench = data.driven, data.sets["M1"]
    vehicle = driven.vehicle
    body, struck = synthesis.path_receptance(vehicle), synthesis.path_accelerance(vehicle)
    forces, _ = synthesis.road_forces(vehicle, data.run, struck)
    case = bench.load_case
    half = replace(case.displacement, values=0.5 * case.displacement.values)
    force = replace(case.force, values=0.5 * case.force.values)
    weaker = replace(bench, load_case=replace(case, displacement=half, force=force))
    listening = synthesis.Listening("driver ear", (20.0, 55.0))
    result = synthesis.synthesise(
        driven, data.run, weaker, listening, data.powertrain, body, forces
    )
    assert not result.factors.believed
    as_tested = synthesis.interface_forces(vehicle, weaker.load_case, data.powertrain, body)
    np.testing.assert_array_equal(result.force.values, as_tested.values)


def test_the_synthesis_is_near_the_road_and_each_step_nearer(validation):
    summary = validation[1].summary
    # the vehicle of seed 1 whose peaks are nearest; corr_f pinned to what was found
    assert summary["corr_f_percent"] == pytest.approx(0.540, abs=0.01)
    assert summary["corr_s_percent"] == pytest.approx(0.977, abs=0.05)
    assert 0.0 < summary["peak_deviation_db"] < 0.5
    assert 0.0 < summary["virtual_design_peak_db"] < 0.5


def test_the_modes_of_the_body_are_part_of_it(validation):
    pytest.importorskip("sdypy.EMA", reason="modal analysis is an extra")
    summary = validation[1].summary
    assert all(summary[f"mode_{n}_hz"] > 20.0 for n in range(1, 6))
    assert min(summary[f"mode_{n}_mac"] for n in range(1, 6)) > 0.95
    assert {"modes", "panel_contributions"} <= set(validation[1].tables)


def test_the_run_on_the_bench_is_what_its_cells_and_sensors_saw(bench, validation):
    case = validation[0].sets["M1"].load_case
    with np.load(bench / "truth" / "M1.npz", allow_pickle=False) as truth:
        run = truth["runs"].tolist().index(CASE.name)
        columns = [truth["channels"].tolist().index(name) for name in case.force.channels]
        true = {name: truth[name][run][:, columns] for name in ("displacement", "force")}
    along_x = [name.endswith("x") for name in case.force.channels]
    for name in true:
        error = np.linalg.norm(getattr(case, name).values - true[name], axis=0)
        relative = error / np.linalg.norm(true[name], axis=0)
        assert 0 < relative[along_x].max() < 0.02
    assert set(along_x) == {True, False}
    assert case.order == 1.5
    assert case.total_ratio == validation[0].campaign.total_ratios[4]


def test_blocked_forces_cost_more_than_transfer_functions(validation):
    tables = validation[1].tables
    corr_f = tables["causes"].set_index("what is compared")["corr_f complex [%]"]
    assert (
        corr_f[synthesis.BLOCKED] > corr_f[synthesis.FUNCTIONS] > corr_f[synthesis.OTHER_PATHS] > 0
    )
    assert corr_f[synthesis.INVERSION] < corr_f[synthesis.EVERYTHING]
    forces = tables["forces"]
    assert forces["forces by inversion, rms error [%]"].item() < 12.0
    assert forces["bench forces, rms error [%]"].item() > 12.0


def test_every_figure_stands_beside_the_thesis(validation):
    table = validation[1].tables["validation"]
    rows = table.set_index("name")
    corr_f = rows.loc["corr_f, complex pressure, median [%]"]
    assert (corr_f["thesis"], corr_f["target"], corr_f["holds"]) == ("5", "≤ 1", "yes")
    assert rows.loc["forces from surfaces, at peaks, largest [dB]"]["measured"] < 0.3
    # without a target nothing is judged
    assert set(rows.loc[rows["target"] == "", "holds"]) == {""}


def test_a_target_missed_is_said():
    missed = criterion("peaks [dB]", 3.1, "3", most=3)
    assert (missed["target"], missed["holds"]) == ("≤ 3", "no")
    assert criterion("MAC [1]", 0.96, least=0.95)["holds"] == "yes"
    assert criterion("MAC [1]", float("nan"), least=0.95)["holds"] == "no"


def test_peaks_are_listed_with_and_without_partner(validation):
    tables = validation[1].tables
    peaks, comparisons = tables["peaks"], tables["comparisons"]
    paired = peaks["deviation [dB]"].notna()
    assert paired.sum() == comparisons["paired peaks"].sum() > 0
    assert (~paired).sum() == comparisons["unpaired peaks"].sum()
    frequency = peaks["reference at [Hz]"].fillna(peaks["compared at [Hz]"])
    assert np.allclose(peaks["engine speed [rpm]"], 40 * frequency)


def test_every_figure_shows_its_curves(validation):
    """What goes into the drawing; the drawing itself has tests of its own."""
    drawn = validation[2]
    ways = [way.value for way in synthesis.DesignMotion]
    (design,) = drawn[3].values()
    assert list(design) == ["measured forces of the design", *ways]
    contributions = drawn[5]
    assert {"sum of all paths", "TSM x", "Du x", "all z"} <= set(contributions)
    for methods in contributions.values():  # the two stand over each other
        one, other = methods.values()
        assert 0.0 < np.median(np.abs(one - other)) < 2.0


def test_the_error_is_told_band_by_band(validation):
    _, report, drawn = validation
    (errors,) = drawn[1].values()
    frequency = np.arange(20.0, 55.1, 0.25)
    (row,) = report.tables["synthesis_error"].to_dict("records")
    lines = (frequency >= 30.0) & (frequency < 40.0)
    expected = np.median(np.abs(errors["U06-2"][lines]))
    assert row["30 to 40 Hz [dB]"] == pytest.approx(expected)
    worst = max(value for name, value in row.items() if name != "vehicle")
    assert report.summary["band_error_db"] == pytest.approx(worst)
    where = report.summary["band_of_largest_error"].removeprefix("U06-2, ")
    assert row[f"{where} [dB]"] == worst


def test_two_vehicles_show_what_the_page_of_the_thesis_says(validation, monkeypatch, tmp_path):
    data = validation[0]
    result = synthesis.validate(data, synthesis.Listening("driver ear", (20.0, 55.0)))
    (level,) = result.measured_levels.values()
    both = {"U06-2": level, "U06-3": level + 12.0}
    monkeypatch.setattr(synthesis.Validation, "measured_levels", both)
    two = synthesis_report(data, result)
    assert two.summary["level_spread_db"] == pytest.approx(12.0)
    two.write(tmp_path)
    assert list(wrong_in_run(read_thesis(), "sound", tmp_path, two.numbers)) == []
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert ten_questions.unanswered(page, ten_questions.PAGES["synthesis_validation"]) == []


def test_without_truth_accelerances_and_mix_what_is_unknown_is_left_out(
    small_campaign, vehicle, tmp_path
):
    bare = tmp_path / "bare"
    shutil.copytree(vehicle, bare, ignore=shutil.ignore_patterns("truth", "accelerance.uff"))
    settings = bare / "vehicle.toml"
    lines = settings.read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line.startswith("accelerance")]
    settings.write_text("\n".join(kept) + "\n", encoding="utf-8")
    options = {"campaign": small_campaign, "vehicle": [bare]}
    done = run_study(STUDY, tmp_path / "results", options)
    assert not (done / "causes.csv").exists()
    names = pd.read_csv(done / "validation.csv")["name"]
    assert not names.str.contains("truth|virtual design").any()
    summary = json.loads((done / "summary.json").read_text(encoding="utf-8"))
    assert "virtual_design_peak_db" not in summary
    assert "corr_s_percent" in summary
    record = json.loads((done / "run.json").read_text(encoding="utf-8"))
    read = list(record["inputs_sha256"])
    assert any(name.endswith("small/campaign.toml") for name in read)
    assert any(name.endswith(f"operating/{CASE.name}.uff") for name in read)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vehicle": None}, "needs --vehicle and --campaign"),
        ({"mount_set": "M7"}, "'M7' was not on the bench"),
        ({"load_case": "g7_wot220"}, "no run 'g7_wot220'"),
    ],
)
def test_bad_requests_are_refused_in_words(small_campaign, vehicle, tmp_path, changes, message):
    options = {"campaign": small_campaign, "vehicle": [vehicle], **changes}
    with pytest.raises(InputError, match=message):
        run_study(STUDY, tmp_path, options)


@pytest.mark.parametrize(
    ("seed", "vehicles", "sets", "run", "message"),
    [
        (0, 1, 2, CASE.name, "seed 0 is refused"),
        (1, 6, 2, CASE.name, "group U06 has 1 to 5"),
        (1, 1, 1, CASE.name, "at least 2"),
        (1, 1, 2, "g1_wot220", "no run 'g1_wot220'"),
    ],
)
def test_impossible_virtual_measurements_are_refused(seed, vehicles, sets, run, message):
    with pytest.raises(InputError, match=message):
        virtual_vehicles(seed, vehicles, sets, run, lambda *_: None)


def test_a_spread_is_that_of_the_first_mount_set_and_the_vehicle_that_differs_most_is_named():
    def car(name, mount_set, level):
        driven = SimpleNamespace(mount_set=mount_set, vehicle=SimpleNamespace(name=name))
        heard = SimpleNamespace(levels=[np.array([level])])
        return SimpleNamespace(driven=driven, comparisons={synthesis.ON_ROAD: heard})

    def of(*cars):
        return synthesis.Validation(None, None, cars, None, (), (), None, "")

    two = of(car("A", "M1", 60.0), car("C", "M2", 90.0), car("B", "M1", 71.0))
    assert two.spread.range == pytest.approx(11.0)
    assert two.spread_without is None
    three = of(*two.syntheses, car("C", "M1", 62.0))
    name, others = three.spread_without
    assert (name, others.range) == ("B", pytest.approx(2.0))
    assert three.spread.range == pytest.approx(11.0)


def test_a_mix_names_the_set_of_every_part():
    assert synthesis.parts_of(MIX) == {"EnM": "M1", "GeM": "M2", "TSM": "M1", "Du": "M2"}
    assert synthesis.parts_of("Du1-EnM2") == {"Du": "M1", "EnM": "M2"}
    assert synthesis.parts_of("M1") == {}
