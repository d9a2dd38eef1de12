"""`deboom bench compressor`: options reach the bench, refusals are one sentence."""

import json

import pytest
from typer.testing import CliRunner

from deboom.cli import app
from deboom.files.inertance_test import read_inertance_test


def call(*arguments):
    return CliRunner().invoke(app, ["bench", "compressor", *map(str, arguments)])


def test_options_reach_the_bench(tmp_path):
    folder = tmp_path / "test"
    options = ("--level", "C0.5", "--seed", 2, "--case", "table11", "--identical-mounts")
    receiver = ("--flexible-receiver", "--flexible-body", 400, "--noise-free")
    done = call(folder, *options, *receiver)
    assert done.exit_code == 0, done.stderr
    assert done.stdout.strip() == folder.as_posix()
    test = read_inertance_test(folder)
    assert test.tolerances.sensor_gain == 0.005
    truth = json.loads((folder / "truth/truth.json").read_text(encoding="utf-8"))
    assert (truth["case"], truth["level"], truth["mass_kg"]) == ("table11", "C0.5", 7.2)
    assert truth["flexible_receiver"]
    assert truth["flexible_body_hz"] == 400
    assert truth["hammer_gain"] == 0
    assert not truth["softening"]
    assert not (folder / "hits").exists()
    assert "positions.xlsx" in (folder / "README.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--seed", 0), "seeds are whole numbers from 1"),
        (("--flexible-body", -1), "a body cannot swing at -1.0 Hz"),
        (("--flexible-body", "nan"), "a body cannot swing at nan Hz"),
    ],
)
def test_refusals(tmp_path, options, words):
    done = call(tmp_path / "new", *options)
    assert done.exit_code == 2
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "new").exists()


def test_a_folder_that_is_not_empty_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    done = call(tmp_path)
    assert done.exit_code == 2
    assert "not empty" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
