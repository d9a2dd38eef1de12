"""A finished front driven and heard: predictions against drives, run-ups as sound."""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.io import wavfile
from scipy.signal import hilbert

from command_line import call
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.powertrain import load_bench
from deboom.explore.choices import Pick
from deboom.files.front_run import ComparedRun
from deboom.pages.driven import one_sided_sentence
from deboom.runs.rebuilt import compared_run, supplier_study
from pinned_pages import hold
from samples.resolved_truth import scaled_bench

STUDIES = Path(__file__).parents[2] / "studies"
DRIVES = 3
REPEAT = 0.01
"""Deviation of a drive's pressure, relative: 0.09 dB."""


@pytest.fixture(scope="module")
def cars(front_run):
    """Return the study, and pressures by state (v, f) [Pa] of the bench with its mounts scaled."""
    study = supplier_study(front_run, STUDIES, Pick.best_mean)
    lines = np.asarray(study.index.frequency)
    paths = [f"{mount} {axis}" for mount in ("EnM", "GeM", "TSM") for axis in "xyz"] + ["Du x"]
    of_platform = {vehicle.name: vehicle for vehicle in study.platform.fleet.vehicles}
    transfer = []
    for name in study.vehicles:
        frf = of_platform[name].noise_transfer.select(inputs=paths)
        inside = (frf.frequency >= lines[0]) & (frf.frequency <= lines[-1])
        transfer.append(frf.values[inside, 0])
    pressure = {}
    for state, design in (("today", study.space.nominal), ("new", study.picked)):
        bench = scaled_bench(load_bench(), design, study.space.names, part=False)
        force = true_run(bench, PlannedRun(5, 220.0), lines).path_force
        pressure[state] = np.einsum("vfp,fp->vf", np.array(transfer), force)
    return study, pressure


def drive(folder, cars, states, drives=DRIVES):
    """Write tables of drives whose pressures repeat within `REPEAT`."""
    study, pressure = cars
    rng = np.random.default_rng(3)
    (folder / "photos").mkdir(parents=True)
    for state, source in states.items():
        for number in range(1, drives + 1):
            columns = {"frequency [Hz]": study.index.frequency}
            for name, row in zip(study.vehicles, pressure[source], strict=True):
                heard = row * (1 + REPEAT * rng.standard_normal())
                columns |= {f"{name} real [Pa]": heard.real, f"{name} imag [Pa]": heard.imag}
            pd.DataFrame(columns).to_csv(folder / f"{state} {number}.csv", index=False)
    return folder


def driven(front_run, folder, out, **code):
    return call("driven", front_run, folder, "--out", out, "--studies", STUDIES, **code)


def test_the_truth_of_the_bench_is_as_predicted(front_run, cars, tmp_path):
    folder = drive(tmp_path / "drives", cars, {"today": "today", "new": "new"})
    answer = driven(front_run, folder, tmp_path / "results")
    run = Path(answer.output.split()[-1])
    hold(run, "driven")
    assert "<span>--design</span> <span>best-mean</span>" in (run / "report.html").read_text()
    table = pd.read_csv(run / "driven.csv")
    # both intervals are for 95 %: one of nine peaks may lie outside
    assert (table["verdict"] != "as predicted").sum() <= 1
    error = table["measured change [dB]"] - table["predicted change [dB]"]
    assert error.abs().max() < 0.5
    vehicles = pd.read_csv(run / "vehicles.csv")
    assert (vehicles["verdict"] == "as expected").all()
    assert (vehicles["from [dB]"] < vehicles["expected [dB]"]).all()
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    assert summary["n_as_expected"] == 5
    of_vehicles = [summary[f"expected_change_db_{name}"] for name in vehicles["vehicle"]]
    assert vehicles["expected [dB]"].tolist() == pytest.approx(of_vehicles)


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        ((-3.1, -2.9), "gained more than expected: their mean of −3.0 dB lies at the interval's"),
        ((-3.6, -3.4), "gained more than expected: their mean of −3.5 dB lies beyond"),
        ((-2.5, -2.7), "gained more than expected: their mean of −2.6 dB lies inside"),
        ((-1.0, -1.2), "gained less than expected: their mean of −1.1 dB lies beyond"),
        ((-3.1, -1.9), ""),
    ],
)
def test_vehicles_that_all_gained_more_or_less_than_expected_are_told(measured, words):
    table = pd.DataFrame({"measured change [dB]": measured, "expected [dB]": [-2.4, -2.0]})
    expected = SimpleNamespace(mean=SimpleNamespace(low=-3.0, high=-1.5))
    sentence = one_sided_sentence(table, expected)
    assert words in sentence
    assert bool(words) == bool(sentence)


def test_parts_that_change_nothing_are_not_as_predicted(front_run, cars, tmp_path):
    folder = drive(tmp_path / "drives", cars, {"today": "today", "new": "today"})
    answer = driven(front_run, folder, tmp_path / "results")
    run = Path(answer.output.split()[-1])
    assert (pd.read_csv(run / "driven.csv")["verdict"] == "not as predicted").all()
    assert (pd.read_csv(run / "vehicles.csv")["verdict"] == "not as expected").all()
    assert "0 of " in (run / "report.html").read_text(encoding="utf-8")


def test_the_defaults_that_the_front_rests_on_stand_on_the_page(
    front_run, cars, tmp_path, monkeypatch
):
    defaults = "mounts.json: its mounts rest on defaults: 15 tolerances"
    monkeypatch.setattr(ComparedRun, "assumed", (defaults,))
    folder = drive(tmp_path / "drives", cars, {"today": "today", "new": "new"}, drives=1)
    run = Path(driven(front_run, folder, tmp_path / "results").output.split()[-1])
    assert defaults in (run / "report.html").read_text(encoding="utf-8")
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    assert record["facts"]["assumed"] == defaults


def test_one_drive_each_leaves_the_measured_uncertainty_open(front_run, cars, tmp_path):
    folder = drive(tmp_path / "drives", cars, {"today": "today", "new": "new"}, drives=1)
    answer = driven(front_run, folder, tmp_path / "results")
    run = Path(answer.output.split()[-1])
    assert pd.read_csv(run / "driven.csv")["± measured [dB]"].isna().all()
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "One drive each" in page
    assert "Not decided whether" in page
    for name in ("driven", "vehicles"):
        assert (pd.read_csv(run / f"{name}.csv")["verdict"] == "not decided").all()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda folder: [path.unlink() for path in folder.glob("new*")], "has no table new"),
        (lambda folder: _edit(folder, lambda t: t.drop(columns="U06-3 real [Pa]")), "U06-3"),
        (lambda folder: _edit(folder, lambda t: t[t.index != 7]), "Hz of run"),
        (lambda folder: _edit(folder, lambda t: t.rename(columns=_in_newton)), "give a pressure"),
    ],
)
def test_what_is_missing_is_named(front_run, cars, tmp_path, change, words):
    folder = drive(tmp_path / "drives", cars, {"today": "today", "new": "new"}, drives=1)
    change(folder)
    assert words in driven(front_run, folder, tmp_path / "results", code=2).output
    assert not list((tmp_path / "results").rglob("driven.csv"))


def _edit(folder, change):
    path = folder / "today 1.csv"
    change(pd.read_csv(path)).to_csv(path, index=False)


def _in_newton(name):
    return name.replace("[Pa]", "[N]") if name.startswith("U06-2") else name


@pytest.fixture(scope="module")
def folder(front_run, tmp_path_factory):
    copy = tmp_path_factory.mktemp("results") / front_run.parent.name / front_run.name
    return shutil.copytree(front_run, copy)


def listen(*words, **code):
    return call("listen", *words, "--studies", STUDIES, **code)


def test_every_vehicle_sounds_as_loud_as_the_model_says(folder):
    result = listen(folder, "--seconds", 8)
    *sounds, facts = map(Path, result.stdout.split("\n")[:-1])
    stated = json.loads(facts.read_text())
    model = compared_run(folder, STUDIES).model
    index = model.evaluate
    assert len(sounds) == 2 * len(index.response_names)
    assert stated["heard"].startswith("the model")
    rate, signal = wavfile.read(folder / "listen" / "U06-2 today.wav")
    heard = np.abs(hilbert(signal)) / 32767 * stated["full_scale_Pa"]
    line = int(np.argmax(np.abs(index.pressure(model.space.nominal[None, :])[0, 1, 20:-20]))) + 20
    share = (index.frequency[line] - stated["first_Hz"]) / (stated["last_Hz"] - stated["first_Hz"])
    wanted = np.abs(index.pressure(model.space.nominal[None, :])[0, 1, line])
    assert heard[round(share * 8 * rate)] == pytest.approx(wanted, rel=0.03)
    peaks = [np.abs(wavfile.read(path)[1].astype(int)).max() for path in sounds]
    designs = np.stack([model.space.nominal, compared_run(folder, STUDIES).picked(Pick.best_mean)])
    loudest = np.abs(index.pressure(designs)).max()
    assert stated["full_scale_Pa"] == pytest.approx(1.25 * loudest, rel=1e-12)
    # between two lines the pressure turns, so that a sound may pass its loudest line a little lower
    assert 0.99 * 32767 / 1.25 < max(peaks) <= 32767 / 1.25


def test_what_cannot_be_heard_is_refused(folder, tmp_path):
    assert "--seconds from 1 to 120" in listen(folder, "--seconds", "0.1", code=2).stderr
    front = pd.read_csv(folder / "front.csv")
    names = {name for cell in front["pick"].dropna() for name in cell.split(" = ")}
    for pick in Pick:
        listen(folder, "--design", pick.value, "--seconds", 1, code=0 if pick in names else 2)
    (tmp_path / "file").write_text("")
    taken = listen(folder, "--out", tmp_path / "file", code=2)
    assert "choose another --out" in taken.stderr
