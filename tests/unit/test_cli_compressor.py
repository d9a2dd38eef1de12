"""`deboom identify` and `deboom unbalance`: from a folder to a run folder, or one sentence."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from command_line import call, refused
from deboom.bench.choices import CalibrationLevel
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.files.compressor_model import read_fitted_bands
from deboom.files.rows import PlacedSensor
from deboom.files.run_folder import hash_files
from deboom.files.tables import read_table
from deboom.files.uff import read_uff, write_uff
from deboom.report import Report


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch):
    """Pictures take longer than all else here; tests of the studies draw them."""
    monkeypatch.setattr(Report, "figure", lambda *_, **__: None)


def finished(*arguments):
    return Path(call(*arguments).output.splitlines()[-1])


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Write a test whose truth is no file to read: only `--truth` may open it."""
    folder = write_compressor_test(
        tmp_path_factory.mktemp("bench") / "test", 3, CalibrationLevel.C05
    )
    for path in (folder / "truth").iterdir():
        path.write_bytes(b"")
    return folder


@pytest.fixture(scope="module")
def hanging(tmp_path_factory):
    """Write the test of a body on soft cords."""
    folder = tmp_path_factory.mktemp("free") / "test"
    return write_compressor_test(folder, 3, CalibrationLevel.C05, CompressorPlan(free=True))


@pytest.mark.parametrize("test", ["hanging", "measured"])
def test_a_sensor_turned_by_180_degrees_is_named_free_mounted_and_by_check(test, request, tmp_path):
    folder = shutil.copytree(request.getfixturevalue(test), tmp_path / "turned")
    node = read_table(folder / "positions.xlsx", PlacedSensor)[1].node
    functions = [
        replace(each, values=-each.values)
        if each.response_node == node and each.response_direction[1] in "xy"
        else each
        for each in read_uff(folder / "frf.uff")
    ]
    write_uff(folder / "frf.uff", functions, binary=True)
    words = "sensor A2 contradicts all others: A2: swapped axes, A2 x carries −x, A2 y carries −y"
    free = ["--free"] if test == "hanging" else []
    for arguments in (["identify", folder, "--out", tmp_path, *free], ["check", folder]):
        result = call(*arguments, code=2)
        assert words in result.stderr
    assert call("check", request.getfixturevalue(test)).stderr == ""


def test_a_test_becomes_a_model_that_others_load(measured, tmp_path):
    few = ("--lines", 12, "--no-thesis")
    folder = finished("identify", measured, "--out", tmp_path, *few)
    assert folder.parent == tmp_path / "identify"
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    path = folder / "compressor_model.json"
    kept = json.loads(path.read_text(encoding="utf-8"))
    assert kept["mass_kg"] == summary["mass_kg"]
    assert kept["alarms"] == []
    assert read_fitted_bands(path)[1] == hash_files(
        [path for path in measured.iterdir() if path.suffix in (".toml", ".xlsx", ".uff")], measured
    )
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    assert record["command"] == f"deboom identify {measured.as_posix()}"
    assert not any("truth" in name for name in record["inputs_sha256"])


@pytest.mark.parametrize("with_truth", [True, False])
def test_a_free_body_gives_its_mass_properties_and_truth_is_opened_when_asked(
    hanging, tmp_path, with_truth
):
    truth = ["--truth"] if with_truth else []
    folder = finished("identify", hanging, "--free", *truth, "--out", tmp_path)
    table = pd.read_csv(folder / "parameters.csv").set_index("quantity")
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    assert ("truth" in table) is with_truth
    assert any("truth" in name for name in record["inputs_sha256"]) is with_truth
    if with_truth:
        score = (table["value"] - table["truth"]) / table["standard deviation"]
        assert score.abs().max() < 4
        assert abs(table.loc["m", "value"] / table.loc["m", "truth"] - 1) < 0.005
        assert (table["value"] - table["truth"])[["cx", "cy", "cz"]].abs().max() < 1e-3


LIMITS = "format = 1\n[static_unbalance]\nat_most_gmm = 20.0\n"


@pytest.mark.parametrize(
    ("command", "folder", "options", "words"),
    [
        ("identify", "nowhere", (), "there is no such folder"),
        ("identify", "nowhere", ("--band", "10..30"), "FROM TO"),
        ("identify", "nowhere", ("--band", "30-10"), "must rise"),
        ("identify", "nowhere", ("--lines", 3), "largest_lines is 3: give a number at least 12"),
        ("identify", "", (), "compressor_test.toml"),
        (
            "identify",
            None,
            ("--band", "200-300"),
            "no line of the measurement lies in the band 200",
        ),
        ("unbalance", "nowhere", (), "there is no such folder; `deboom bench operation"),
        ("unbalance", "nowhere", ("--band", "17"), "write it as FROM TO"),
        ("unbalance", "nowhere", ("--confidence", 1.5), "confidence is 1.5: give a number"),
        ("unbalance", "nowhere", ("--limits", "none.toml"), "none.toml cannot be read"),
        ("unbalance", "", ("--limits", "limits.toml"), "did you mean 'at_most_g_mm'?"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(
    measured, tmp_path, monkeypatch, command, folder, options, words
):
    monkeypatch.chdir(tmp_path)
    Path("limits.toml").write_text(LIMITS, encoding="utf-8")
    place = measured if folder is None else tmp_path / folder
    done = call(command, place, "--out", tmp_path / "results", *options, code=2)
    assert words in done.stderr
    assert len([line for line in done.stderr.splitlines() if line.startswith("deboom:")]) == 1
    assert not (tmp_path / "results").exists()


def test_a_folder_of_another_kind_names_the_command_that_takes_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call("new", "operation", "sweeps")
    refused(("identify", "sweeps"), "`deboom unbalance sweeps` takes it")
    call("new", "compressor", "hit")
    refused(("unbalance", "hit"), "`deboom identify hit` takes it")
    assert not (tmp_path / "results").exists()
