"""`deboom bench operation`: options reach the bench, refusals are one sentence."""

import json

import pytest
from typer.testing import CliRunner

from deboom.bench import compressor_writer as compressor_operation_writer
from deboom.bench.compressor_rig import OperationPlan
from deboom.bench.compressor_truth import CompressorPlan
from deboom.choices import CalibrationLevel, CompressorCase, HoseCase
from deboom.cli import app
from deboom.errors import InputError
from deboom.files.operating_test import read_operating_test


def call(*arguments):
    return CliRunner().invoke(app, ["bench", "operation", *map(str, arguments)])


def test_options_reach_the_bench(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(
        compressor_operation_writer,
        "write_operating_test",
        lambda *given, noise_free: asked.append((*given, noise_free)),
    )
    options = ("--level", "C0.5", "--seed", 2, "--case", "table11", "--hoses", "displaced")
    state = ("--mount-storage", 0.9, "--mount-loss", 1.1, "--softening", "--sense", -1)
    more = ("--flexible-receiver", "--noise-free", "--hammer-with-hoses", "--time-record")
    done = call(tmp_path, *options, *state, *more)
    assert done.exit_code == 0, done.stderr
    body = CompressorPlan(CompressorCase.TABLE11, softening=True, flexible_receiver=True)
    plan = OperationPlan(body, HoseCase.DISPLACED, True, 0.9, 1.1, True, -1, True)
    assert asked == [(tmp_path, 2, CalibrationLevel.C05, plan, True)]


def test_what_is_asked_for_is_written(tmp_path):
    folder = tmp_path / "test"
    options = ("--sense", -1, "--mount-storage", 0.9, "--hoses", "displaced", "--hammer-with-hoses")
    done = call(folder, *options)
    assert done.exit_code == 0, done.stderr
    assert done.stdout.strip() == folder.as_posix()
    test = read_operating_test(folder)
    assert test.hammer_with_hoses is not None
    assert len(test.sweeps) == 4
    truth = json.loads((folder / "truth/operation.json").read_text(encoding="utf-8"))
    assert (truth["mount_storage"], truth["mount_loss"], truth["sense"]) == (0.9, 1.0, -1)
    assert truth["hose_case"] == "displaced"
    assert truth["hoses"][0]["length"] != 0.36
    for name, hoses in (("hammer", None), ("hammer_with_hoses", "displaced")):
        struck = json.loads((folder / name / "truth/truth.json").read_text(encoding="utf-8"))
        assert struck["hoses"] == hoses
    words = (folder / "README.txt").read_text(encoding="utf-8")
    assert "operation.toml" in words
    assert "hammer_with_hoses/" in words


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--seed", 0), "seeds are whole numbers from 1"),
        (("--mount-storage", 0), "mount storage 0.0 is no factor"),
        (("--mount-loss", "nan"), "mount loss nan is no factor"),
        (("--sense", 2), "sense 2 is no sense of rotation"),
    ],
)
def test_refusals(tmp_path, options, words):
    done = call(tmp_path / "new", *options)
    assert done.exit_code == 2
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "new").exists()


def test_plans_that_contradict_themselves_are_refused():
    with pytest.raises(InputError, match="hoses hang on a rigid body"):
        CompressorPlan(flexible_body=400.0, hoses=HoseCase.DRAWN)
    for wrong in (CompressorPlan(flexible_body=400.0), CompressorPlan(hoses=HoseCase.DRAWN)):
        with pytest.raises(InputError, match="planned rigid and without hoses"):
            OperationPlan(wrong)
