"""``deboom bench electric-car``: options reach the bench, refusals are one sentence."""

import pytest
from typer.testing import CliRunner

from deboom.bench import electric_car_writer
from deboom.bench.compressor_rig import OperationPlan
from deboom.bench.compressor_truth import CompressorPlan
from deboom.choices import CalibrationLevel, CompressorCase, HoseCase
from deboom.cli import app


def call(*arguments):
    return CliRunner().invoke(app, ["bench", "electric-car", *map(str, arguments)])


def test_options_reach_the_bench(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(
        electric_car_writer,
        "write_electric_car",
        lambda *given, noise_free: asked.append((*given, noise_free)),
    )
    options = ("--car", "EV-3", "--fleet", 7, "--seed", 2, "--level", "C1", "--hoses", "displaced")
    more = ("--identical-mounts", "--hammer-with-hoses", "--noise-free")
    done = call(tmp_path, *options, *more, "--mount-storage", 0.9, "--mount-loss", 1.1)
    assert done.exit_code == 0, done.stderr
    assert done.stdout.strip() == tmp_path.as_posix()
    body = CompressorPlan(CompressorCase.TABLE11, identical_mounts=True)
    plan = OperationPlan(body, HoseCase.DISPLACED, True, 0.9, 1.1)
    assert asked == [(tmp_path, 2, "EV-3", 7, CalibrationLevel.C1, plan, True)]


def test_what_is_written_without_options_is_the_frozen_first_car(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(
        electric_car_writer,
        "write_electric_car",
        lambda *given, noise_free: asked.append((*given, noise_free)),
    )
    assert call(tmp_path).exit_code == 0
    plan = electric_car_writer.CAR_PLAN
    assert asked == [(tmp_path, 1, "EV-1", None, CalibrationLevel.C2, plan, False)]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--car", "EV-8"), "there is no car 'EV-8' in the fleet: use EV-1"),
        (("--seed", 0), "seed 0 is refused"),
        (("--fleet", 0), "seed 0 is refused"),
        (("--mount-storage", 0), "is no factor on a stiffness"),
    ],
)
def test_refusals_are_one_sentence(tmp_path, options, sentence):
    done = call(tmp_path / "car", *options)
    assert done.exit_code != 0
    assert sentence in done.stderr
    assert not (tmp_path / "car").exists()
