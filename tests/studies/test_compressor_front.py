"""The study of a compressor's mounts on a tiny budget, through the same command as a user."""

import json
from functools import cache

import numpy as np
import pandas as pd
import pytest
from compare_samples import COMPARE, compare_runs
from openpyxl import load_workbook

from command_line import call, refused
from deboom.compressor.cabin_index import mount_variables
from deboom.errors import InputError
from deboom.measurement.compressor_test import CompressorMount
from deboom.runs.runner import load_study, run_study
from deboom.supplier.sources import page_text, workbook_text
from pinned_pages import hold, pictures_described, run_aloud

STUDY = load_study("compressor_front")
MODULE = STUDY.module
TINY = {"population": 8, "samples": 8, "checks": 32, "n": 16, "line_step": 20.0}
TINY |= {"hoses": MODULE.Hoses.identified}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two runs of one question; cars are measured and identified once, not six times."""
    results, mounted, models = tmp_path_factory.mktemp("results"), MODULE.mounted_fleet, []

    def identified_once(*arguments, **options):
        if not models:
            models.append(mounted(*arguments, **options))
        return models[0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MODULE, "virtual_fleet", cache(MODULE.virtual_fleet))
        patch.setattr(MODULE, "mounted_fleet", identified_once)
        short = run_study(STUDY, results, {**TINY, "generations": 2})
        with pictures_described():
            pinned = run_aloud(STUDY, results, {**TINY, "generations": 8})
        yield [short, pinned]


@pytest.fixture(scope="module")
def finished(runs):
    return runs[-1]


def test_runs_get_a_verdict_in_any_order(runs, tmp_path, monkeypatch):
    monkeypatch.setattr(COMPARE.module, "FEWEST", 64)
    options = {"out": tmp_path, "studies": None, "samples": 64, "seed": 1}
    in_order, swapped = (compare_runs(order, **options) for order in (runs, runs[::-1]))
    assert in_order[1] == swapped[1]
    (verdict,) = in_order[1]
    assert "generations 8" in verdict
    assert not verdict.startswith("generations 2 is")
    fronts = [pd.read_csv(folder / "fronts.csv") for folder, _ in (in_order, swapped)]
    pd.testing.assert_frame_equal(*fronts)


def test_the_cars_become_quieter_by_the_exact_model_too(finished, summary):
    hold(finished, "compressor_front")
    assert summary["exact_mean_change_db"] == pytest.approx(summary["mean_change_db"], abs=0.3)
    assert summary["travel_ratio"] <= 1.2


def test_a_search_may_limit_the_rise_of_peaks(runs, tmp_path):
    options = {**TINY, "generations": 2, "population": 16, "peak_rise": 1.5}
    run = run_study(STUDY, tmp_path, options)
    limits = pd.read_csv(run / "limits.csv").set_index("number")
    rise = limits.loc["rise of a booming peak [dB]"]
    assert rise["at most"] == 1.5
    assert rise["best-mean"] <= 1.5
    peaks = pd.read_csv(run / "peaks.csv")
    assert peaks["change [dB]"].max() <= 1.5 + 1e-9
    beyond = pd.read_csv(run / "beyond_limits.csv")
    assert beyond.filter(like="rise of a booming peak").to_numpy().max() > 0.0


def test_the_supplier_gets_the_sheet_of_every_mount(finished, summary, tmp_path):
    call("report", finished, "--supplier", "--out", tmp_path)
    hold(tmp_path / "supplier_sheet_mounts.html", "supplier_compressor")
    book = load_workbook(tmp_path / "supplier_sheet_mounts.xlsx", read_only=True)
    head, axial, radial = book["data block"].iter_rows(values_only=True)
    rows = [dict(zip(head, row, strict=True)) for row in (axial, radial)]
    required = pd.read_csv(finished / "requirements.csv").set_index("requirement")
    for row, name in zip(rows, ("mounts axial", "mounts radial"), strict=True):
        wanted = required.loc[name]
        assert row["direction"] == name
        ratio = wanted["wanted / today [1]"]
        assert row["new, of today's [%]"] == pytest.approx(100.0 * ratio)
        assert row["from, of today's [%]"] == pytest.approx(100.0 * ratio * 0.85)
        for key, column in (("new |K|", "wanted"), ("today |K|", "today")):
            assert row[f"{key} [N/mm]"] == pytest.approx(wanted[f"{column} [N/mm]"], rel=1e-9)
    worth = dict(zip(*list(book["worth"].iter_rows(values_only=True))[::2], strict=True))
    share = required.loc["mounts radial", "share of sigma [%]"]
    assert worth["share of the scatter [%]"] == pytest.approx(share, rel=1e-6)


def test_an_anonymous_german_sheet_of_a_compressor_names_no_car_run_or_level(finished, tmp_path):
    words = ("--supplier", "--anonymous", "--language", "de", "--out", tmp_path)
    call("report", finished, *words)
    html = (tmp_path / "supplier_sheet_mounts_anonymous.html").read_text(encoding="utf-8")
    book = (tmp_path / "supplier_sheet_mounts_anonymous.xlsx").read_bytes()
    told = page_text(html) + workbook_text(book)
    cars = [f"EV-{number}" for number in range(1, 6)]
    for secret in (*cars, finished.name, "compressor_front", "dB(A)", "deboom report"):
        assert secret not in told
    assert all(word in told for word in ("Kompressorlager", "bevorzugt", "ISO 10846-2"))
    refused(("report", finished, "--supplier", "--mount", "EnM"), "no mount 'EnM': use mounts")
    refused(("report", finished, "--supplier", "--box", "b.json"), "belong to a platform's mounts")


MOUNTS = [CompressorMount(f"mount {n}", np.ones(3), np.zeros(3), np.ones(3)) for n in (1, 2)]


def test_own_parts_scatter_on_their_own():
    options = MODULE.Options(
        parts=MODULE.Parts.separate, reach=0.3, tolerance=0.1, place_tolerance=2.0
    )
    variables = mount_variables(MOUNTS, identical=False, pieces=False, places=True)
    space = MODULE.design_space(variables, options)
    np.testing.assert_allclose(space.tolerance, [0.1] * 4 + [0.02] * 6)
    np.testing.assert_allclose(space.upper - space.lower, [0.6] * 4 + [0.0] * 6)
    assert options.lines.size == 61


def test_a_batch_and_its_pieces_scatter_as_one_part():
    variables = mount_variables(MOUNTS, identical=True, pieces=True, places=False)
    variance = MODULE.design_space(variables, MODULE.Options(batch=0.2)).tolerance ** 2
    np.testing.assert_allclose(variance[:2], 0.2 * 0.15**2)
    np.testing.assert_allclose(variance[2:], 0.8 * 0.15**2)


@pytest.mark.parametrize(
    "wrong",
    [
        {"reach": 1.0},
        {"tolerance": 0.0},
        {"batch": 1.5},
        {"place_tolerance": 200.0},
        {"line_step": 0.0},
        {"travel": 0.0},
    ],
)
def test_questions_without_sense_are_refused(wrong):
    with pytest.raises(InputError):
        MODULE.Options(**wrong)


def test_pressures_as_they_are_typed():
    typed = MODULE.Options(pressure=["7.5=2", "13.50"])
    assert typed.weights == {"7.5 bar": 2.0, "13.5 bar": 1.0}
    assert MODULE.Options().weights == {}
    for wrong in (["high"], ["7.5=0"], ["7.5", "7.50"], ["7.5=x"]):
        with pytest.raises(InputError, match="BAR=WEIGHT"):
            _ = MODULE.Options(pressure=wrong).weights


def test_a_folder_that_is_no_car_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"car\.toml"):
        run_study(STUDY, tmp_path, {**TINY, "cars": [tmp_path]})


@pytest.fixture(scope="module")
def heard(thesis_run):
    return thesis_run("cabin")


@pytest.mark.slow("measures a car, identifies its compressor and synthesises its noise")
def test_the_sound_is_synthesised(heard):
    hold(heard, "compressor_noise")
    summary = json.loads((heard / "summary.json").read_text(encoding="utf-8"))
    assert summary["spl_peak_deviation_db"] < 1.0
    assert summary["spl_90_140_p90_db_with_hoses"] < 3.0
    assert summary["spl_90_140_p90_db_by_mounts"] > 3.0


@pytest.mark.slow("measures a car, identifies its compressor and synthesises its noise")
def test_tables_hold_the_paths_with_their_phases(heard):
    paths = pd.read_csv(heard / "contributions.csv")
    levels = pd.read_csv(heard / "levels.csv")
    at_100_hz = paths[(paths["sweep"] == "standard 7.5 bar") & (paths["frequency [Hz]"] == 100.0)]
    assert len(at_100_hz) == 9 + 12
    sound = at_100_hz["real"].sum() + 1j * at_100_hz["imaginary"].sum()
    row = levels[(levels["sweep"] == "standard 7.5 bar") & (levels["frequency [Hz]"] == 100.0)]
    unweighted = 20 * np.log10(np.abs(sound) / np.sqrt(2) / 2e-5)
    # A-weighting of 100 Hz, IEC 61672-1
    assert row["synthesised [dB(A)]"].item() == pytest.approx(unweighted - 19.1, abs=0.06)
    assert (levels["synthesised from [dB(A)]"] <= levels["synthesised to [dB(A)]"]).all()


def test_limits_of_mounts_are_refused_before_any_work(tmp_path):
    path = tmp_path / "limits.toml"
    path.write_text('format = 1\n[[sag]]\nmount = "EnM"\nat_most_mm = 3.0\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"limits\.toml: here only levels are limited"):
        MODULE.prepare(MODULE.Options(limits=path))
