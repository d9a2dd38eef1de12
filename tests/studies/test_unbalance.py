"""The study of running compressors with one of them, through the same command as a user."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from openpyxl import load_workbook

from command_line import call
from deboom.bench.compressor_rig import OperationPlan
from deboom.bench.compressor_writer import write_operating_test
from deboom.files.operating_test import OPERATING_TEST_FILE, OperatingTestFile
from deboom.files.schema import dump_toml, load_toml
from pinned_pages import hold

LIMITS = """
format = 1
[static_unbalance]
at_most_g_mm = 22.0
[dynamic_unbalance]
at_most_g_mm2 = 1000.0
[[stiffness]]
direction = "x"
from_hz = 20.0
to_hz = 160.0
at_most_n_per_mm = 300.0
"""


@pytest.fixture(scope="module")
def finished(thesis_run):
    return thesis_run("unbalance")


@pytest.fixture(scope="module")
def part(tmp_path_factory):
    """Folder of a part whose mounts changed; run with soft hoses only, which halves the work."""
    plan = OperationPlan(mount_storage=0.9, mount_loss=1.1)
    folder = write_operating_test(tmp_path_factory.mktemp("part") / "test", 2, plan=plan)
    path = folder / OPERATING_TEST_FILE
    file = load_toml(path, OperatingTestFile)
    soft = tuple(sweep for sweep in file.sweeps if sweep.hoses == "soft")
    dump_toml(path, file.model_copy(update={"sweeps": soft}))
    return folder


def test_a_compressor_as_struck_is_found_by_the_measured_route(finished, summary):
    hold(finished, "unbalance")
    assert summary["u_stat_first_error_percent"] < 1.5
    assert summary["u_dyn_first_error_percent"] < 3.0


def test_a_model_of_another_hammer_test_is_refused(finished, part, tmp_path):
    done = call("unbalance", part, "--identified", finished, "--out", tmp_path / "results", code=2)
    assert "identified from another hammer test" in done.stderr
    assert not list((tmp_path / "results").glob("unbalance/*"))


@pytest.mark.slow("measures compressors with two parts")
def test_a_part_is_judged(part, tmp_path):
    """Mounts changed: route e counts; one limit kept, one broken, one beyond the hammer test."""
    limits = tmp_path / "limits.toml"
    limits.write_text(LIMITS, encoding="utf-8")
    options = ("--limits", limits, "--out", tmp_path, "--band", "18-150", "--sense", "positive")
    done = call("unbalance", part, *options)
    *_, decision, place = done.stdout.splitlines()
    assert decision == "fail"
    run = Path(place)
    assert run.parent == tmp_path / "unbalance"
    hold(run, "judged_compressor", like="unbalance")
    book = load_workbook(run / "supplier_sheet.xlsx", read_only=True)
    assert book.sheetnames == ["verdicts", "not decided", "conditions"]
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    assert "supplier_sheet.xlsx" in record["files_sha256"]
    assert any("limits.toml" in name for name in record["inputs_sha256"])


@pytest.fixture(scope="module")
def identified(thesis_run):
    return thesis_run("compressor")


def test_a_compressor_is_identified(identified):
    summary = json.loads((identified / "summary.json").read_text(encoding="utf-8"))
    # 1.5 times what twenty compressors reach in nine of ten cases
    assert summary["cog_error_mm"] < 1.8
    assert summary["jacobian_rank"] == 35


def test_tables_say_what_is_known(identified):
    hold(identified, "identify")
    parameters = pd.read_csv(identified / "parameters.csv").set_index("parameter")
    score = (parameters["identified"] - parameters["truth"]) / parameters["standard deviation"]
    assert np.sqrt(np.mean(score**2)) < 2.5
