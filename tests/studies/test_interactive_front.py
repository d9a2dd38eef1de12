"""`deboom report RUN --interactive` on a foreign platform: the page holds the run's own numbers."""

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_platform_samples import GROUP, LINES, ORDER, PLACES, VEHICLES, write_foreign_platform
from interactive_front_samples import data_of

from command_line import call
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.files.run_folder import read_run
from deboom.pages import live_model
from deboom.pages.interactive_front import interactive_front, overlaid
from deboom.report import Report
from deboom.report.interactive import MAX_BYTES
from deboom.runs.interactive_page import write_interactive_page
from deboom.runs.rebuilt import supplier_study
from deboom.runs.runner import load_study, run_study
from deboom.supplier import numbers as supplier_numbers
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.platform import MountSource
from javascript import evaluated, script

STUDIES = Path(__file__).parents[2] / "studies"
VARIABLES = [f"{mount} {axis}" for mount in PLACES for axis in "xyz"]


def arguments_on(platform):
    """Return options of a short search with loss factors and two load cases."""
    return {
        "platform": platform,
        "mounts": MountSource.spectra,
        "motion": Motion.prescribed,
        "group": (GROUP,),
        "generations": 3,
        "population": 12,
        "samples": 4,
        "polish": False,
        "checks": 64,
        "loss_factors": True,
        "load_case": ["high=2", "low=1"],
        "with_": "none",
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Run the front study once, with loss factors and two load cases."""
    home = tmp_path_factory.mktemp("foreign")
    arguments = arguments_on(write_foreign_platform(home / "any"))
    study = load_study("front")
    figure = Report.figure

    def shown(self, stem, *words):
        if stem in ("pareto_front", "spl_curves", "stiffness_bars"):  # those of the page
            figure(self, stem, *words)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Report, "figure", shown)
        return run_study(study, home / "results", arguments)


@pytest.fixture(scope="module")
def page(folder):
    answer = call("report", folder, "--interactive", "--studies", STUDIES)
    assert answer.output.strip() == (folder / "interactive.html").as_posix()
    return folder / "interactive.html"


def test_the_page_holds_the_tables_of_the_run_and_its_levels(folder, page):
    html = page.read_text(encoding="utf-8")
    assert page.stat().st_size <= MAX_BYTES
    assert "order 2. The curves are those of high." in html
    data = data_of(html)
    said = re.sub(r"base64,[\w+/=]+", "", html.replace(data["levels"], ""))
    said = said.replace(numbers_of(html), "")
    assert not any(stranger in said for stranger in ("U06", "EnM", "TSM", "F39"))
    axes = {axis["name"]: axis for axis in data["axes"]}
    losses = [f"{name} loss" for name in VARIABLES]
    assert list(axes) == [*VARIABLES, *losses, "mean level", "σ", *(f"{v} level" for v in VEHICLES)]
    front, stiffness, per_vehicle = (
        pd.read_csv(folder / f"{stem}.csv") for stem in ("front", "stiffness", "per_vehicle")
    )
    table = read_run(folder).front
    designs = table.rows[list(table.variables)]
    n, tried = len(designs), pd.read_csv(folder / "evaluated.csv")
    searched = tried["mean level in search [dB(A)]"]
    np.testing.assert_allclose(axes["mean level"]["values"][n:], searched, rtol=1e-6)
    free = {"Front y", "Rear y", "Rear z"}  # they transmit nothing
    assert {name for name in VARIABLES if axes[name]["note"] == "no requirement"} == free
    for name in free:
        assert set(axes[name]["values"]) == {1.0}
    for name in {*VARIABLES, *losses} - free - {f"{name} loss" for name in free}:
        np.testing.assert_allclose(axes[name]["values"][:n], designs[f"{name} [1]"], rtol=1e-6)
        np.testing.assert_allclose(axes[name]["values"][n:], tried[f"{name} [1]"], rtol=1e-6)
    shown = [axes[name]["stiffness"] or np.nan for name in VARIABLES]
    np.testing.assert_allclose(shown, stiffness["nominal [N/mm]"], rtol=1e-12)
    assert axes[losses[0]]["stiffness"] is None
    assert axes["Front x loss"]["colour"] == axes["Front x"]["colour"]
    band = LINES[(LINES >= 20) & (LINES <= 60)]
    np.testing.assert_allclose(data["frequency"], band, rtol=1e-6)
    np.testing.assert_allclose(data["speed"], 60 * band / ORDER, rtol=1e-6)
    per_line = 1 / (len(band) * len(VEHICLES))
    np.testing.assert_allclose(
        axes["mean level"]["values"][:n], front["SPLV mean sum [dB(A)]"] * per_line, rtol=1e-6
    )
    cabrio = per_vehicle[per_vehicle["vehicle"] == "Cabrio"]
    np.testing.assert_allclose(
        axes["Cabrio level"]["values"][:n], cabrio["mean level of the lines [dB(A)]"], rtol=1e-6
    )
    index = supplier_study(folder, STUDIES, Pick.best_mean).index
    designs = np.vstack([np.ones(30), designs.to_numpy(float)])
    stored = np.frombuffer(base64.b64decode(data["levels"]), "<i2") * data["levelStep"]
    levels = stored.reshape(len(designs), len(VEHICLES), len(band))
    np.testing.assert_allclose(levels, index.levels(designs, "high"), atol=0.00501)


def numbers_of(html):
    return re.search(r'id="live-numbers">(.*?)</script>', html, re.S)[1]


def of_page(html, designs, folder):
    """Return levels in both load cases and SPLV of designs, as the page computes them."""
    header = json.dumps(data_of(html, "live-header"))
    program = f"""
const data = unpack({header}, {json.dumps(numbers_of(html))}), model = makeModel(data);
const weights = data.cases.map((one) => one.weight), coupled = data.motion === "coupled";
return {json.dumps(designs.tolist())}.map((row) => {{
  const x = Float64Array.from(row);
  const levels = data.cases.map((_, c) => Array.from(model.levels(x, c, coupled)));
  return {{ levels, splv: Array.from(model.splv(x, weights, coupled)) }};
}});"""
    return evaluated(script("model.js") + program, folder)


def test_the_page_computes_what_the_model_of_the_run_says(folder, page, tmp_path):
    html = page.read_text(encoding="utf-8")
    header = data_of(html, "live-header")
    assert header["lossFactors"]
    assert header["motions"] == ["prescribed"]
    assert [case["name"] for case in header["cases"]] == ["high", "low"]
    index = supplier_study(folder, STUDIES, Pick.best_mean).index
    designs = np.random.default_rng(8).uniform(0.8, 1.2, (5, 30))
    said = of_page(html, designs, tmp_path)
    for case, name in enumerate(("high", "low")):
        levels = np.array([answer["levels"][case] for answer in said])
        np.testing.assert_allclose(
            levels.reshape(5, len(VEHICLES), -1), index.levels(designs, name), rtol=0, atol=1e-9
        )
    splv = np.array([answer["splv"] for answer in said])
    np.testing.assert_allclose(splv, index(designs), rtol=0, atol=1e-7)
    assert header["starts"][0]["name"].startswith("best-mean")
    heard = call("listen", folder, "--studies", STUDIES, "--out", tmp_path).output.splitlines()
    listened = json.loads(Path(heard[-1]).read_text(encoding="utf-8"))
    assert header["fullScale"] == pytest.approx(listened["full_scale_Pa"], rel=1e-12)


def saved(folder, design):
    """Write the state that the page saves."""
    names = [*VARIABLES, *(f"{name} loss" for name in VARIABLES)]
    path = folder / "saved_design.json"
    pinned = [{"name": "P1", "design": [1.05] * 30}]
    state = {"format": 1, "variables": names, "design": list(design), "pinned": pinned}
    path.write_text(json.dumps(state), encoding="utf-8")
    return path


@pytest.mark.usefixtures("plain_loops", "no_pictures")
def test_a_saved_design_begins_a_search_and_gets_sheets(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(supplier_numbers, "REPETITIONS", 40)
    design = np.full(30, 0.95)
    path = saved(tmp_path, design)
    arguments = {**arguments_on(folder.parents[2] / "any"), "generations": 1, "begin": path}
    run = run_study(load_study("front"), tmp_path, arguments)
    tried = pd.read_csv(run / "evaluated.csv")[[f"{name} [1]" for name in VARIABLES]]
    both = tried.to_numpy()[:, :, np.newaxis] == np.array([0.95, 1.05])
    assert both.all(axis=1).any(axis=0).all()
    assert any("saved_design" in name for name in read_run(run).record["inputs_sha256"])
    options = ("--supplier", "--mount", "Front", "--design", path, "--studies", STUDIES)
    sheet, _ = call("report", folder, *options, "--out", tmp_path / "sheets").stdout.splitlines()
    assert "saved_design" in Path(sheet).read_text(encoding="utf-8")
    study = supplier_study(folder, STUDIES, path)
    np.testing.assert_array_equal(study.picked, design)


def test_a_page_of_some_vehicles_and_one_that_would_be_too_large(folder, tmp_path, monkeypatch):
    page = write_interactive_page(folder, studies=STUDIES, out=tmp_path, vehicles=["Cabrio"])
    header = data_of(page.read_text(encoding="utf-8"), "live-header")
    assert [vehicle["name"] for vehicle in header["vehicles"]] == ["Cabrio"]
    with pytest.raises(InputError, match="has no such vehicle; use one of Wagon, Cabrio"):
        write_interactive_page(folder, studies=STUDIES, vehicles=["Truck"])
    monkeypatch.setattr(live_model, "MAX_MODEL_BYTES", 100_000)
    page = write_interactive_page(folder, studies=STUDIES, out=tmp_path)
    html = page.read_text(encoding="utf-8")
    assert "No sliders for 2 vehicles" in html
    assert "--vehicle NAME" in html
    assert 'id="live-header"' not in html


def test_another_run_lies_beside_and_one_of_other_variables_is_refused(folder, tmp_path):
    page = write_interactive_page(folder, studies=STUDIES, out=tmp_path, beside=folder)
    data = data_of(page.read_text(encoding="utf-8"))
    n = len(read_run(folder).front.rows)
    assert data["runs"] == [0] * n + [1] * n
    values = data["axes"][0]["values"]
    assert values[:n] == values[n : 2 * n]
    assert len(data["axes"][-1]["values"]) == 2 * n + len(pd.read_csv(folder / "evaluated.csv"))
    first = interactive_front(supplier_study(folder, STUDIES, Pick.best_mean))
    with pytest.raises(InputError, match="has other axes"):
        overlaid(first, replace(first, axes=first.axes[1:]))


def test_designs_of_an_experiment_have_a_page_of_the_same_kind(folder, tmp_path):
    platform = load_study("correlation")
    options = {"platform": folder.parents[2] / "any", "mounts": MountSource.spectra, "designs": 20}
    chosen = {**options, "motion": Motion.prescribed, "resamples": 100, "draws": 2}
    run = run_study(platform, tmp_path, chosen)
    page = write_interactive_page(run, studies=STUDIES)
    data, doe = data_of(page.read_text(encoding="utf-8")), pd.read_csv(run / "doe.csv")
    assert data_of(page.read_text(encoding="utf-8"), "live-header")["starts"] == []
    axes = {axis["name"]: axis["values"] for axis in data["axes"]}
    lines = len(data["frequency"])
    for vehicle in VEHICLES:
        level = doe[f"{vehicle} [dB(A)]"] / lines
        np.testing.assert_allclose(axes[f"{vehicle} level"], level, rtol=1e-6)
    np.testing.assert_allclose(axes[VARIABLES[0]], doe[f"{VARIABLES[0]} [1]"], rtol=1e-6)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "--interactive for the one to explore the front"),
        (["--interactive", "--anonymous"], "belong to --supplier"),
        (["--interactive", "--mount", "Roll"], "belong to --supplier"),
        (["--interactive", "--box", "box.json"], "belong to --supplier"),
        (["--interactive", "--studies", "nowhere"], "say with --studies"),
        (["--supplier", "--vehicle", "Cabrio"], "--vehicle belongs to --interactive"),
        (["--supplier", "--design", "best"], "is neither a pick (best-mean, none-louder"),
        (["--interactive", "--studies", STUDIES, "--out", __file__], "choose another --out"),
    ],
)
def test_what_cannot_be_written_is_said_in_one_sentence(folder, options, words):
    assert words in call("report", folder, *options, code=2).output
