"""The sheets of a sensitivity study: how much hangs on each direction of a mount."""

import re
import shutil
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest

from command_line import call, refused
from deboom.language import Language
from deboom.pages.sensitivity import SLOPE
from deboom.runs.runner import load_study, run_study
from deboom.supplier.sources import page_text
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.platform import MountSource

EXAMPLE = Path(__file__).parents[2] / "results" / "sensitivity" / "example"
BUDGET = {"seed": 1, "n": 64, "resamples": 20, "mounts": MountSource.spectra}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    options = {**BUDGET, "motion": Motion.prescribed}
    return run_study(load_study("sensitivity"), tmp_path_factory.mktemp("results"), options)


def test_a_level_rises_by_what_the_model_says(folder):
    table = pd.read_csv(folder / "sobol.csv").set_index(["vehicle", "variable"])
    runs = load_study("sensitivity").model(BUDGET)
    model = runs.model(Motion.prescribed)
    gradient = model.gradient([[1.0] * 12])[0] / model.n_lines
    for row, vehicle in enumerate(model.response_names):
        for column, variable in enumerate(model.variable_names):
            slope = table.loc[(vehicle, variable), SLOPE]
            assert slope == pytest.approx(0.1 * gradient[row, column], abs=0.01)


def test_every_mount_gets_a_page_and_a_workbook(folder, tmp_path):
    told = call("report", folder, "--supplier", "--out", tmp_path).stdout.split()
    assert len(told) == 8
    book = openpyxl.load_workbook(tmp_path / "supplier_sheet_TSM.xlsx")
    assert book.sheetnames == ["importance", "by vehicle"]
    rows = list(book["importance"].values)
    table = pd.read_csv(folder / "sobol.csv")
    total = table[table["variable"] == "TSM x"]["total [1]"].mean()
    assert rows[1][0] == "TSM x"
    row = dict(zip(rows[0], rows[1], strict=True))
    assert row["share, with others [%]"] == pytest.approx(100.0 * total)
    assert row["class"] == "identified"  # spectra were measured in every direction
    slope = table[table["variable"] == "TSM x"][SLOPE].mean()
    assert row["level, 1 % stiffer [dB]"] == pytest.approx(slope / 10.0)
    assert row["level, upper end of tolerance [dB]"] == pytest.approx(1.5 * slope)
    runs = load_study("sensitivity").model(BUDGET)
    today = runs.stiffness(runs.cases[0][0], runs.band)[6] * 1e-3
    assert row["today |K| [N/mm]"] == pytest.approx(today)
    page = (tmp_path / "supplier_sheet_TSM.html").read_text(encoding="utf-8")
    assert "U06-5" in page
    assert "evenly within ±15 %" in page
    assert "TSM-001" in page
    (case, _), *_ = runs.cases
    lines = case.displacement.frequency
    inside = (lines >= runs.band[0]) & (lines <= runs.band[1])
    moved = np.abs(case.displacement.select(("TSM x",)).values[inside]).mean()
    assert row["amplitude, peak [mm]"] == pytest.approx(1e3 * moved)
    assert "wheel torque [N m]" in page


def test_what_is_not_identified_has_no_share_and_decibels_can_be_left_out(tmp_path):
    words = ("report", EXAMPLE, "--supplier", "--mount", "TSM", "--no-decibels", "--out", tmp_path)
    call(*words)
    book = openpyxl.load_workbook(tmp_path / "supplier_sheet_TSM.xlsx")
    head, *rows = book["importance"].values
    unknown = dict(zip(head, next(r for r in rows if r[0] == "TSM y"), strict=True))
    assert unknown["class"] == "not identified"
    assert {unknown["share, alone [%]"], unknown["share, with others [%]"]} == {None}
    known = dict(zip(head, next(r for r in rows if r[0] == "TSM z"), strict=True))
    assert known["share, with others [%]"] is not None
    assert not [label for label in head if "[dB]" in label]
    assert "dB" not in page_text((tmp_path / "supplier_sheet_TSM.html").read_text("utf-8"))


@pytest.mark.parametrize("language", list(Language))
def test_the_sheets_are_one_or_two_pages_of_paper(folder, tmp_path, browser, language):
    """Also of the mount with the most directions that matter; counted by a browser."""
    words = ("--supplier", "--anonymous", "--language", language.value, "--out", tmp_path)
    call("report", folder, *words)
    for page in tmp_path.glob("*.html"):
        browser.open(page)
        assert browser.printed_pages() <= 2


def test_an_anonymous_german_sheet_names_no_vehicle(folder, tmp_path):
    words = ("--supplier", "--mount", "GeM", "--anonymous", "--language", "de", "--out", tmp_path)
    call("report", folder, *words)
    page = (tmp_path / "supplier_sheet_GeM_anonymous.html").read_text(encoding="utf-8")
    assert "Fahrzeug E" in page
    assert "gleichverteilt" in page
    assert not re.search(r"U06|studies/|deboom report", page)


def test_what_it_cannot_say_is_refused(folder, tmp_path):
    refused(("report", folder, "--supplier", "--mount", "Q"), "no mount 'Q'", "EnM")
    refused(("report", folder, "--supplier", "--box", "box.json"), "no front")
    old = tmp_path / "old"
    shutil.copytree(folder, old)
    (old / "sobol.csv").write_text("edited")
    refused(("report", old, "--supplier"), "sobol.csv")
