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


def test_a_test_becomes_a_model_that_others_load(measured, tmp_path):
    done = call(
        "identify",
        measured,
        "--out",
        tmp_path,
        "--lines",
        30,
        "--held-out",
        0,
        "--no-thesis",
    )
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
        ((), "there is no such folder"),
        (("--band", "10..30"), "LOW-HIGH"),
        (("--band", "30-10"), "must rise"),
        (("--held-out", 2), "every third impact"),
        (("--lines", 3), "at least 12 lines"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(options, words, tmp_path):
    out = tmp_path / "results"
    done = call("identify", tmp_path / "nowhere", "--out", out, *options)
    assert done.exit_code == 2
    assert words in done.output
    assert "Traceback" not in done.output
    assert not out.exists()


def test_a_folder_without_a_test_leaves_nothing(tmp_path):
    done = call("identify", tmp_path, "--out", tmp_path / "results")
    assert done.exit_code == 2
    assert "compressor_test.toml" in done.output
    assert not (tmp_path / "results").exists()


def test_a_failed_identification_leaves_nothing(measured, tmp_path):
    done = call("identify", measured, "--out", tmp_path / "results", "--band", "200-300")
    assert done.exit_code == 2
    assert "no line of the measurement lies in the band 200-300 Hz" in done.output
    assert not (tmp_path / "results").exists()


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


def test_truth_is_opened_only_when_asked(hanging, tmp_path):
    done = call("identify", hanging, "--free", "--out", tmp_path)
    folder = Path(done.output.splitlines()[-1])
    assert "truth" not in pd.read_csv(folder / "parameters.csv").columns
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    assert not any("truth" in name for name in record["inputs_sha256"])
