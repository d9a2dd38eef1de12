"""`deboom identify`: from a folder with a hammer test to a run folder."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.choices import CalibrationLevel
from deboom.cli import app
from deboom.files.compressor_model import read_compressor_model
from deboom.files.run_folder import hash_files
from deboom.plot import style


def call(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Write a test without its truth, as a laboratory would deliver it."""
    folder = write_compressor_test(
        tmp_path_factory.mktemp("bench") / "test", 3, CalibrationLevel.C05
    )
    shutil.rmtree(folder / "truth")
    return folder


def test_help_teaches():
    shown = call("identify", "--help").output
    for word in ("compressor_test.toml", "--band", "--identical-mounts", "weigh", "alarm"):
        assert word in shown


def test_a_test_becomes_a_model_that_others_load(measured, tmp_path, monkeypatch):
    monkeypatch.setattr(style, "DPI", 50)
    quick = ("--lines", 12, "--no-thesis")
    done = call("identify", measured, "--out", tmp_path, *quick)
    assert done.exit_code == 0, done.output
    folder = Path(done.output.splitlines()[-1])
    assert folder.parent == tmp_path / "identify"
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert list(summary) == [
        "mass_kg",
        "reduced_chi2",
        "n_alarms",
        "condition_scaled_100hz",
        "seconds",
    ]
    kept = read_compressor_model(folder / "compressor_model.json")
    assert kept.model.mass == summary["mass_kg"]
    assert kept.inputs_sha256 == hash_files(
        [path for path in measured.iterdir() if path.suffix in (".toml", ".xlsx", ".uff")], measured
    )
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    assert record["command"] == f"deboom identify {measured.as_posix()}"
    assert kept.alarms == ()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("nowhere",), "there is no such folder"),
        (("nowhere", "--band", "10..30"), "LOW-HIGH"),
        (("nowhere", "--band", "30-10"), "must rise"),
        (("nowhere", "--lines", 3), "at least 12 lines"),
        ((".",), "compressor_test.toml"),
        (
            ("MEASURED", "--band", "200-300"),
            "no line of the measurement lies in the band 200-300",
        ),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(
    measured, options, words, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    done = call("identify", *(measured if o == "MEASURED" else o for o in options))
    assert done.exit_code == 2
    assert words in done.output
    assert "Traceback" not in done.output
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def hanging(tmp_path_factory):
    """Write the test of a body on soft cords."""
    folder = tmp_path_factory.mktemp("free") / "test"
    return write_compressor_test(folder, 3, CalibrationLevel.C05, CompressorPlan(free=True))


def test_a_free_body_gives_its_mass_properties(hanging, tmp_path):
    done = call("identify", hanging, "--free", "--truth", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    folder = Path(done.output.splitlines()[-1])
    table = pd.read_csv(folder / "parameters.csv").set_index("quantity")
    score = (table["value"] - table["truth"]) / table["standard deviation"]
    assert score.abs().max() < 4
    assert abs(table.loc["m", "value"] / table.loc["m", "truth"] - 1) < 0.005
    assert (table["value"] - table["truth"])[["cx", "cy", "cz"]].abs().max() < 1e-3
    assert "truth/truth.json" in (folder / "run.json").read_text(encoding="utf-8")
