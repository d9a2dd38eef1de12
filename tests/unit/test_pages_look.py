"""A first look draws every kind of folder as it was measured, and says what check says."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from test_cli_platform import changed_toml, filled, made

import ten_questions
from command_line import call
from deboom.bench.campaign import CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.component import ComponentPlan
from deboom.bench.component_writer import write_component_test
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test, write_operating_test
from deboom.bench.electric_car_writer import write_electric_car
from deboom.bench.operating_run import PlannedRun
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import InputError
from deboom.files.check import check_folder
from deboom.files.kinds import FolderKind
from deboom.files.uff import read_uff, write_uff
from deboom.measurement.channels import TimeRecord
from deboom.pages import look
from deboom.pages.look import look_report
from deboom.pages.look_pictures import show_signals
from deboom.plot import places
from deboom.report import Report


def campaign(folder):
    time_run = TimeRunPlan(last_speed=1600.0, duration=4.0, sample_rate=1024.0)
    lines = np.linspace(20.0, 80.0, 25)
    runs = (PlannedRun(5, 220.0, full_load=True),)
    plan = CampaignPlan(("M1",), runs, shaker_repeats=1, time_run=time_run, frequency=lines)
    return write_campaign(folder, 1, plan)


def hits(folder):
    return write_compressor_test(folder, 1, plan=CompressorPlan(hits=True)) / "hits"


FOLDERS = {
    "platform": (
        lambda folder: filled(made(folder)),
        ["noise_transfer", "operating_force", "operating_displacement", "geometry"],
    ),
    "campaign": (
        campaign,
        ["accelerations", "cell_forces", "campbell_", "orders_", "third_octaves_", "geometry"],
    ),
    "vehicle": (lambda folder: write_vehicle(folder, 1), ["noise_transfer", "run_", "geometry"]),
    "compressor": (
        lambda folder: write_compressor_test(folder, seed=1),
        ["functions", "coherence", "reciprocity", "geometry"],
    ),
    "hammer": (hits, ["blows", "functions", "coherence", "geometry"]),
    "operation": (
        lambda folder: write_operating_test(folder, 1),
        ["sweep_1", "functions", "coherence", "geometry"],
    ),
    "car": (
        lambda folder: write_electric_car(folder, 1),
        ["body_pressure", "sweep_1", "functions", "coherence", "geometry"],
    ),
    "component": (
        lambda folder: write_component_test(folder, plan=ComponentPlan(points=1, line_step=4.0)),
        [
            "functions",
            "coherence",
            "reciprocity",
            "ear_pressure",
            "run_1",
            "run_pressure",
            "geometry",
        ],
    ),
}


DRAWN = ("platform", "campaign", "component")
"""Folders whose pictures are drawn here; those of the others are of the same kinds."""


def test_no_kind_of_folder_is_left_out():
    assert set(FOLDERS) == {kind.value for kind in FolderKind}


@pytest.mark.slow("draws the pictures of every kind of folder")
@pytest.mark.parametrize("kind", FOLDERS)
def test_every_kind_of_folder_is_drawn(tmp_path, kind):
    write, stems = FOLDERS[kind]
    folder = Path(write(tmp_path / "folder"))
    report = look_report(folder)
    pictures = list(report.pictures)
    for stem in stems:
        assert any(name.startswith(stem) for name in pictures), (stem, pictures)
    assert kind not in DRAWN or report.failures == []
    assert report.warnings == []
    assert report.summary == {"n_faults": 0}
    assert report.verdict.startswith("It looks right to deboom check: no fault")
    summary = check_folder(folder)[2]
    assert len(report.tables["held"]) == len(summary.splitlines())
    assert all(path.exists() for path in report.inputs)


def test_a_waterfall_shows_the_level_of_a_tone():
    """Of 2 m/s² rms at 40 Hz in one of two channels: 3 dB, at its own line."""
    line, rate = 40.0, 1024.0
    time = np.arange(2048) / rate
    tone = np.sqrt(2.0) * 2.0 * np.sin(2.0 * np.pi * line * time)
    record = TimeRecord(np.column_stack([tone, 0 * tone]), rate, ("A1 x", "A1 y"), "m/s²")
    report = Report("First look")
    show_signals(report, "slow", {"acceleration": record}, None)
    points = report.pictures["waterfall_slow"].drawing().axes[0].collections[0]
    level, loudest = points.get_array(), np.argmax(points.get_array())
    assert level[loudest] == pytest.approx(20.0 * np.log10(np.sqrt(2.0)), abs=1e-6)
    assert points.get_offsets()[loudest, 0] == line


def test_impacts_without_coherence_are_named_in_the_first_sentence():
    """Channels × lines × impacts: I02 has a dead channel, I01 a notch at 60 Hz."""
    frf = SimpleNamespace(inputs=("I01", "I02"), frequency=np.array([20.0, 40.0, 60.0]))
    coherence = np.full((3, 4, 2), 0.99)
    coherence[2, 1, 0] = 0.05
    words = look._coherence_in_words(frf, coherence)
    assert words.endswith("the least coherence is 0.05, I01 at 60 Hz")
    coherence[:2, 3, 1] = 0.3
    words = look._coherence_in_words(frf, coherence)
    assert words.startswith("look at the coherence of I02 (0.30), whose worst channel")


def test_what_the_numbers_contradict_is_a_warning_beside_its_picture(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    path = folder / "operating/fast.uff"
    functions = read_uff(path)
    for function in functions:
        if function.ordinate == "force":
            object.__setattr__(function, "values", -function.values)
    write_uff(path, functions)
    report = look_report(folder)
    assert report.summary["n_faults"] == len(report.warnings) == 1
    assert "channel 'EnM x' has a negative stiffness" in report.warnings[0]
    assert "operating_force" in report.pictures


def test_files_that_cannot_be_read_are_refused_as_check_does(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    changed_toml(folder, ("gear = 3", "gear = 9"))
    with pytest.raises(InputError, match="load case 'slow' is in gear 9"):
        look_report(folder)


@pytest.mark.usefixtures("no_pictures")
def test_what_check_warns_of_is_in_the_first_sentence(tmp_path, monkeypatch):
    words = "campaign  mine\nWARNING  the force of EnM z is 1.1 ms late.\nWARNING  one more."
    monkeypatch.setattr(look, "check_folder", lambda _: ([], [], words))
    report = look_report(filled(made(tmp_path / "mine")))
    late = "2 warnings, the first: the force of EnM z is 1.1 ms late. No other fault"
    assert report.verdict.startswith(late)


@pytest.mark.usefixtures("no_pictures")
def test_the_command_writes_one_page(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    done = call("look", folder, "--out", tmp_path / "results")
    run = Path(done.stdout.strip())
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "First look: mine" in page
    assert ten_questions.unanswered(page, ten_questions.PAGES["look"]) == []
    shutil.rmtree(folder / "operating")
    assert "slow.uff cannot be read" in call("look", folder, code=2).stderr


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ({}, "one to 4 groups"),
        ({"sensors": {}}, "one to 4 groups"),
        ({"sensors": {"A1": [0.0, np.nan, 1.0]}}, "sensors"),
    ],
)
def test_places_refuses_what_it_cannot_draw(groups, words):
    with pytest.raises(InputError, match=words):
        places(groups)
