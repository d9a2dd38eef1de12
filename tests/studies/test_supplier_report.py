"""The supplier's page of a tiny run: its numbers, its words, and what it never tells."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from foreign_platform_samples import GROUP, PLACES, VEHICLES, write_foreign_platform
from matplotlib.figure import Figure
from matplotlib.text import Text
from typer.testing import CliRunner

from deboom.choices import Pick
from deboom.cli import app
from deboom.study.platform_model import MountSource
from deboom.study.runner import load_study, run_study
from deboom.study.supplier_numbers import ALL, SupplierEffects, part_table
from deboom.study.supplier_page import tolerance_table
from deboom.study.supplier_study import Need, page_text, shown_names, supplier_study, workbook_text

STUDIES = Path(__file__).parents[2] / "studies"
UNKNOWN = ("EnM y", "GeM y", "TSM y")
FREE = ("Du y", "Du z")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Run the front study with next to no budget."""
    out = tmp_path_factory.mktemp("results")
    budget = {"generations": 3, "population": 12, "samples": 16}
    return run_study(load_study(STUDIES / "u06_robust_front.py"), out, budget)


@pytest.fixture(scope="module")
def study(folder):
    return supplier_study(folder, STUDIES, Pick.best_mean)


@pytest.fixture(scope="module")
def effects(study):
    return SupplierEffects(study)


def report(*words):
    return CliRunner().invoke(
        app, ["report", *(str(w) for w in words), "--supplier", "--studies", str(STUDIES)]
    )


def rows(path, sheet):
    header, *lines = openpyxl.load_workbook(path)[sheet].iter_rows(values_only=True)
    return {line[0]: dict(zip(header, line, strict=True)) for line in lines}


def test_nothing_is_asked_where_nothing_is_known_or_nothing_depends_on_it(study):
    need = {direction.name: direction.need for direction in study.directions}

    assert all(need[name] is Need.unknown for name in UNKNOWN)
    assert all(need[name] is Need.nothing for name in FREE)
    back = [study.space.names.index(name) for name in (*UNKNOWN, *FREE)]
    assert np.array_equal(study.wanted[back], np.ones(len(back)))
    others = [k for k in range(study.space.n_variables) if k not in back]
    assert np.array_equal(study.wanted[others], study.picked[others])


def test_only_this_part_is_what_the_model_says_directly(study, effects):
    table = part_table(effects, lambda name: name)
    design = np.ones(12)
    of_mount = [k for k, name in enumerate(study.space.names) if name.startswith("TSM ")]
    design[of_mount] = study.wanted[of_mount]

    now, then = (study.index(x[np.newaxis])[0] / study.index.n_lines for x in (np.ones(12), design))

    only = table[table["changed"] == "only TSM"]
    assert only["vehicle"].tolist() == list(study.vehicles)
    assert np.allclose(only["change of level [dB]"], then - now, atol=1e-12)
    assert set(table["changed"]) == {"only EnM", "only GeM", "only TSM", "only Du", ALL}
    # errors of measurement leave the change uncertain, but far less than itself
    half = (only["change of level, to [dB]"] - only["change of level, from [dB]"]) / 2
    assert np.all((half > 0) & (half < 0.3 * np.abs(then - now)))
    for what in ("sigma today", "sigma then"):
        width = only[f"{what}, to [dB]"] - only[f"{what}, from [dB]"]
        assert np.all((width > 0) & (width < 0.5 * only[f"{what} [dB]"]))
    # a level is off by the calibration, a change is not
    assert np.all(only["peak today, to [dB(A)]"] - only["peak today, from [dB(A)]"] > 4 * half)


def test_a_tighter_tolerance_gains_what_its_share_says(study, effects):
    table = tolerance_table(effects, study.directions, shown_names(study, anonymous=False))
    sigma = effects.values.sigma_sum[-2] / study.index.n_lines / len(study.vehicles)

    # dσ/dtol = share σ / tol, to first order
    predicted = table["share of sigma [%]"] / 100 * sigma / 0.15 * 0.01 * 1e3

    assert np.allclose(table["sigma saved per % tighter [0.001 dB]"], predicted, rtol=0.1, atol=0.3)
    assert table["share of sigma [%]"].sum() == pytest.approx(100, abs=5)


@pytest.fixture(scope="module")
def one_part(folder, tmp_path_factory):
    """Write the anonymous page of one mount; returns page, workbook, and the words in pictures."""
    out = tmp_path_factory.mktemp("supplier")
    drawn = []
    save = Figure.savefig

    def spied(self, *arguments, **options):
        drawn.extend(text.get_text() for text in self.findobj(Text))
        return save(self, *arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", spied)
        result = report(folder, "--mount", "TSM", "--anonymous", "--out", out)
    assert result.exit_code == 0, result.output
    return *(Path(line) for line in result.stdout.splitlines()[-2:]), drawn


def test_the_page_of_one_part_stands_alone(one_part, study):
    page, workbook, _ = one_part
    html = page.read_text(encoding="utf-8")

    assert page.stat().st_size < 6_000_000
    assert "What mount TSM should be" in html
    assert not re.search(r"(src|href)=\"(?!data:|#)", html)
    assert "not identified" in html
    asked = rows(workbook, "requirements")
    assert list(asked) == ["TSM x", "TSM y", "TSM z"]
    x, factor = asked["TSM x"], study.wanted[study.space.names.index("TSM x")]
    assert x["wanted [N/mm]"] == pytest.approx(factor * x["today [N/mm]"])
    assert 400 < x["today [N/mm]"] < 700
    assert x["at most [N/mm]"] == pytest.approx(1.15 * x["wanted [N/mm]"])
    assert all(asked["TSM y"][n] is None for n in asked["TSM y"] if n.endswith("]"))
    assert rows(workbook, "quality")["TSM y"]["stiffness ± 95 % [%]"] > 15
    sheet = {item: line["value"] for item, line in rows(workbook, "data sheet").items()}
    assert sheet["run"].startswith(study.run.entry.name)
    assert "220" in sheet["load case g5_wot220"]
    curve = rows(workbook, "curves")["TSM x"]
    assert curve["wanted [N/mm]"] == pytest.approx(factor * curve["today [N/mm]"])
    assert curve["preload wanted"] == curve["preload today"]
    static = rows(workbook, "conditions")["TSM x"]
    assert static["preload"] == "static force [N]"
    assert -2000 < static["least preload"] < static["greatest preload"] < 0


def test_an_anonymous_report_tells_no_name_anywhere(one_part, folder, study):
    page, workbook, drawn = one_part
    html = page.read_text(encoding="utf-8")
    fleet = study.platform.fleet.vehicles
    secrets = [
        *{vehicle.name for vehicle in fleet},
        *{vehicle.group for vehicle in fleet},
        *("u06_f39_f45", "Compact platform", "robust_front", str(folder), str(STUDIES)),
    ]
    texts = [
        page_text(html),
        workbook_text(workbook.read_bytes()),
        *drawn,
        page.name,
        workbook.name,
    ]
    # hexadecimal hashes may hold any three letters by chance
    read = re.sub(r"\b[0-9a-f]{12,}\b", "", "\n".join(texts)).lower()
    assert [secret for secret in secrets if secret.lower() in read] == []
    assert "vehicle E" in html
    assert any("vehicle E" in text for text in drawn)
    assert html.count("data:image/png;base64,") == 5


def edited(folder, tmp_path, change):
    copy = tmp_path / folder.parent.name / folder.name
    shutil.copytree(folder, copy)
    change(copy)
    return copy


def longer(copy):
    path = copy / "designs.csv"
    path.write_text(path.read_text() + "\n")


def of_another_study(copy):
    record = json.loads((copy / "run.json").read_text())
    record["files_sha256"].pop("front.csv")
    (copy / "run.json").write_text(json.dumps(record))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda copy: (copy / "front.csv").unlink(), "front.csv is missing"),
        (longer, "designs.csv has been edited"),
        (lambda copy: (copy / "run.json").unlink(), "is no run folder"),
        (of_another_study, "is no front study"),
    ],
)
def test_a_folder_that_is_not_whole_is_refused_in_one_sentence(folder, tmp_path, change, sentence):
    result = report(edited(folder, tmp_path, change), "--out", tmp_path / "out")

    assert result.exit_code == 2
    assert sentence in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_an_unknown_mount_a_leak_and_a_missing_flag_are_refused(folder, tmp_path, monkeypatch):
    unknown = report(folder, "--mount", "TMS", "--out", tmp_path / "out")
    assert unknown.exit_code == 2
    assert "no mount 'TMS': use EnM, GeM, TSM, Du" in unknown.stderr

    plain = CliRunner().invoke(app, ["report", str(folder)])
    assert plain.exit_code == 2
    assert "--supplier" in plain.stderr
    assert not (tmp_path / "out").exists()


def test_a_load_case_that_names_a_vehicle_is_refused_when_anonymous(study, tmp_path, monkeypatch):
    from dataclasses import replace

    from deboom.study import supplier_page as module

    told = replace(study.platform.load_cases[1], title="U06-1 in 5th gear")
    cases = tuple(told if c.name == told.name else c for c in study.platform.load_cases)
    leaking = replace(study, platform=replace(study.platform, load_cases=cases))
    assert leaking.load_cases[0][0].title == told.title
    monkeypatch.setattr(module, "supplier_study", lambda *_: leaking)
    monkeypatch.setattr(module, "supplier_figures", lambda _: pytest.fail("drawn before checked"))

    result = report(study.run.entry.folder, "--anonymous", "--out", tmp_path / "out")

    assert result.exit_code == 2
    assert "would show 'U06" in result.stderr
    assert not (tmp_path / "out").exists()


def test_another_platform_has_its_own_mounts_vehicles_and_no_static_curves(tmp_path):
    platform = write_foreign_platform(tmp_path / "foreign", library=True)
    options = {"generations": 2, "population": 8, "samples": 4, "group": GROUP}
    options |= {"platform": platform, "mounts": MountSource.library_inside}
    run = run_study(load_study(STUDIES / "u06_robust_front.py"), tmp_path, options)

    result = report(run, "--mount", "Rear", "--out", tmp_path / "out")

    assert result.exit_code == 0, result.output
    page, workbook = (Path(line) for line in result.stdout.splitlines()[-2:])
    assert page.name == "supplier_report_Rear.html"
    asked = rows(workbook, "requirements")
    assert list(asked) == ["Rear x", "Rear y", "Rear z"]
    # y and z of this mount reach no ear
    assert asked["Rear z"]["requirement"] == "no requirement"
    assert asked["Rear x"]["wanted [N/mm]"] > 0
    assert rows(workbook, "conditions")["Rear x"]["preload"] == "wheel torque [N m]"
    text = " ".join(page_text(page.read_text(encoding="utf-8")).split())
    assert all(name in text for name in VEHICLES)
    assert f"deboom report {run.as_posix()} --supplier --mount Rear" in text
    # the other mounts are nobody else's business
    assert not any(f"{mount} x" in text for mount in set(PLACES) - {"Rear"})
