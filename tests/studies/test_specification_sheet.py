"""The specification sheet of a tiny front: its numbers, what it asks for, and what it refuses."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from deboom.choices import Pick
from deboom.cli import app
from deboom.errors import InputError
from deboom.explore.scatter import capability
from deboom.files.acceptance import (
    AcceptanceBox,
    BoxResponse,
    BoxVariable,
    read_solution_box,
    write_solution_box,
)
from deboom.files.run_folder import hash_files
from deboom.mounts.mount import mean_operating_stiffness
from deboom.study import supplier_numbers as supplier_certainty
from deboom.study import supplier_numbers as supplier_effects
from deboom.study.platform_model import platform_sha256
from deboom.study.runner import load_study, run_study
from deboom.study.specification import (
    DIRECTIONS,
    MISSING,
    PARTS,
    PROMISE,
    SpecificationFiles,
    asked_capability,
    measured_capability,
    shared_vehicles,
    specification_sheet,
    specification_sources,
    specification_tables,
)
from deboom.study.supplier_numbers import SupplierEffects, loudest_line, stiffness_curves
from deboom.study.supplier_page import specification_section
from deboom.study.supplier_study import shown_names, supplier_study

STUDIES = Path(__file__).parents[2] / "studies"
INTERVALS = {"TSM x": (0.70, 0.84), "Du x": (0.68, 1.05)}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return tmp_path_factory.mktemp("results")


@pytest.fixture(scope="module")
def front(results):
    budget = {"generations": 2, "population": 12, "samples": 16}
    return run_study(load_study(STUDIES / "u06_robust_front.py"), results, budget)


@pytest.fixture(scope="module")
def study(front):
    return supplier_study(front, STUDIES, Pick.best_mean)


@pytest.fixture(scope="module")
def effects(study):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(supplier_certainty, "MEASURED_AGAIN", 40)
        yield SupplierEffects(study)


def run_folder(folder, inputs, tables, arguments=None):
    """Write what other commands look at in the folder of a finished run."""
    for name, table in tables.items():
        table.to_csv(folder / name, index=False)
    files = [path for path in folder.iterdir() if path.name != "run.json"]
    record = {
        "study": folder.parent.name,
        "arguments": arguments or {},
        "inputs_sha256": inputs,
        "files_sha256": hash_files(files, relative_to=folder),
    }
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def box_run(study, results):
    """Write a box as solution_box does, with intervals that nobody has searched for."""
    folder = results / "solution_box" / "box"
    folder.mkdir(parents=True)
    case, _ = study.load_cases[0]
    today = np.concatenate(
        [mean_operating_stiffness(m, case, study.band) for m in study.platform.mounts]
    )
    variables = [
        BoxVariable(
            name=d.name,
            lower=INTERVALS.get(d.name, (0.68, 1.38))[0],
            upper=INTERVALS.get(d.name, (0.68, 1.38))[1],
            nominal=float(study.picked[d.column]),
            reference_stiffness=float(k) if np.isfinite(k) else None,
            condition="mean over the lines",
            weight=1.0,
            required=d.name not in study.without_effect,
        )
        for d, k in zip(study.directions, today, strict=True)
    ]
    box = AcceptanceBox(
        title=f"{study.platform.title}: acceptance box",
        platform=study.platform.name,
        platform_sha256=platform_sha256(study.platform),
        group="U06",
        motion="prescribed",
        mounts="library-inside",
        load_cases=((case.name, 1.0),),
        band=study.band,
        quantity="mean level of the lines",
        unit="dB(A)",
        together=False,
        variables=tuple(variables),
        responses=tuple(
            BoxResponse(name, 54.4, 0.8 if name == "U06-3" else 1.0) for name in study.vehicles
        ),
        share_stated=0.95,
        share_verified=0.96,
        share_bound=0.955,
        confidence=0.95,
        n_parts=1024,
        law="uniform in the box",
        seed=1,
    )
    write_solution_box(folder / "acceptance_box.json", box)
    measured = {"share_measured_from": 0.90, "share_measured_to": 0.99}
    (folder / "summary.json").write_text(json.dumps(measured))
    ends = ["to" if v.name in INTERVALS else "neither" for v in variables]
    table = pd.DataFrame({"variable": [v.name for v in variables], "set by the limit": ends})
    return run_folder(folder, {}, {"box.csv": table})


@pytest.fixture(scope="module")
def tolerance_run(front, results):
    allocation = load_study(STUDIES / "tolerance_allocation.py")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(allocation.module, "DRAWS", 256)
        patch.setattr(allocation.module, "ON_CURVE", 2)
        patch.setattr(allocation.module, "ALONG_FRONT", 1)
        return run_study(allocation, results, {"from_run": front, "samples": 32})


@pytest.fixture(scope="module")
def sharing_run(study, results):
    """Two strut mounts, the second one for a vehicle that the front knows nothing of."""
    folder = results / "commonality" / "shared"
    folder.mkdir(parents=True)
    rows = []
    for direction in study.directions:
        numbers = {"A": (0.8, ", ".join(study.vehicles))}
        if direction.mount.name == "TSM":
            numbers = {"A": (0.9, "U06-1, U06-2, F39-1"), "B": (0.8, "F45-4")}
        for number, (factor, vehicles) in numbers.items():
            silent = direction.name in study.without_effect
            rows.append(
                {
                    "part number": f"{direction.mount.name} {number}",
                    "direction": direction.name,
                    "stiffness factor [1]": np.nan if silent else factor,
                    "vehicles": vehicles,
                }
            )
    files = study.platform.input_files
    inputs = hash_files(files, relative_to=study.platform.folder)
    summary = {"part_numbers_min": 5, "part_numbers_own": 20, "price_db": 0.2}
    (folder / "summary.json").write_text(json.dumps(summary | {"price_worst_db": 0.5}))
    return run_folder(folder, inputs, {"part_numbers.csv": pd.DataFrame(rows)})


@pytest.fixture(scope="module")
def pieces(box_run, tolerance_run, sharing_run):
    return SpecificationFiles(box_run, tolerance_run, sharing_run)


def sheet_of(study, effects, files, *, anonymous=False):
    return specification_sheet(
        study,
        specification_sources(study, files),
        study.directions,
        stiffness_curves(study, study.directions),
        effects.certainty,
        shown_names(study, anonymous=anonymous),
    )


@pytest.fixture(scope="module")
def sheet(study, effects, pieces):
    return sheet_of(study, effects, pieces)


@pytest.fixture(scope="module")
def tables(sheet):
    return specification_tables(sheet)


def test_the_interval_is_the_box_times_todays_stiffness(study, tables, box_run):
    table = tables[DIRECTIONS].set_index("direction")
    box = read_solution_box(box_run / "acceptance_box.json")

    reference = box.variable("TSM x").reference_stiffness * 1e-3
    assert table.loc["TSM x", "accepted from [N/mm]"] == pytest.approx(0.70 * reference)
    assert table.loc["TSM x", "accepted to [N/mm]"] == pytest.approx(0.84 * reference)
    assert table.loc["TSM x", "set by the limit"] == "to"
    assert table.loc["EnM x", "set by the limit"] == "none"
    assert table.loc["Du y", "requirement"] == "no requirement"
    # what is not identified has no N/mm, only a share of today's part
    assert table.loc["TSM y", "requirement"] == "of today's part only"
    assert np.isnan(table.loc["TSM y", "accepted to [N/mm]"])
    assert table.loc["TSM y", "to, of today's [%]"] == pytest.approx(138.0)
    assert np.isfinite(table.loc["TSM y", "amplitude, peak [µm]"])


def test_the_state_to_measure_at_is_the_loudest_line_of_the_run(study, tables):
    row = tables[DIRECTIONS].set_index("direction").loc["TSM x"]
    case, _ = study.load_cases[0]
    line = int(np.argmin(np.abs(case.force.frequency - loudest_line(study))))
    force, moved = (
        one.select(["TSM x"]).values[line, 0] for one in (case.force, case.displacement)
    )

    assert row["frequency [Hz]"] == case.force.frequency[line]
    assert row["amplitude, peak [µm]"] == pytest.approx(1e6 * abs(moved))
    assert row["there, today [N/mm]"] == pytest.approx(1e-3 * abs(force / moved))
    assert row["there, to [N/mm]"] == pytest.approx(0.84 * row["there, today [N/mm]"])
    assert row["there, loss factor [1]"] == pytest.approx(
        (force / moved).imag / (force / moved).real
    )
    assert -1600 < row["static force [N]"] < -300


def test_tolerances_and_their_worth_are_those_of_their_run(tables, tolerance_run):
    table = tables[DIRECTIONS].set_index("direction")
    allocated = pd.read_csv(tolerance_run / "allocation.csv").set_index("variable")
    worth = pd.read_csv(tolerance_run / "marginal_values.csv").set_index("variable")

    assert table.loc["TSM x", "tolerance wanted ± [%]"] == pytest.approx(
        allocated.loc["TSM x", "cheapest ± [%]"]
    )
    saved = worth.loc["TSM x", "sigma per % of tolerance, cheapest [0.001 dB]"]
    assert table.loc["TSM x", "sigma saved per % tighter [0.001 dB]"] == pytest.approx(saved)


def test_part_numbers_are_held_against_the_intervals_of_their_vehicles(tables, sheet):
    parts = tables[PARTS].set_index("part number")

    assert parts.loc["Du A", "pieces in a vehicle"] == 2
    assert parts.loc["TSM A", "inside the intervals"] == "no: x"
    assert parts.loc["TSM B", "inside the intervals"] == "–"
    assert parts.loc["Du A", "inside the intervals"] == "yes"
    assert parts.loc["TSM A", "vehicles"] == "U06-1, U06-2, F39-1"
    hidden = shown_names(sheet.study, anonymous=True)
    assert shared_vehicles(hidden, "U06-1, U06-2, F39-1") == "vehicle A, vehicle B, 1 other"


def test_the_share_is_stated_verified_and_measured_again(tables, sheet):
    items = tables[PROMISE].set_index("item")["value"]

    assert items["share stated"] == "95.00 % of parts and vehicles"
    assert items["share verified"].startswith("96.00 %, at least 95.50 % with 95 % confidence")
    assert items["limit of U06-3"] == "54.40 dB(A), kept by 80.00 % of the parts"
    assert items["the same, with all measurements made again"] == (
        "90.00 % to 99.00 % (90 % interval)"
    )
    assert list(tables[MISSING]["goes to"]) == ["a new RUN"]


def test_the_words_name_what_does_not_fit(sheet, tables):
    text = specification_section(sheet, tables).text
    assert "in U06-3 alone 80 % of the parts keep the limit" in text
    assert "Of today's part only: EnM y, GeM y, TSM y" in text
    beyond = [one for one in sheet.directions if one.scatter_fits is False]
    assert {one.direction.name for one in beyond} >= {"TSM x"}
    assert "Du y, Du z (no vehicle depends on them)" in text


def test_a_sheet_without_pieces_says_what_is_missing_and_who_gives_it(study, effects):
    sheet = sheet_of(study, effects, SpecificationFiles())
    tables = specification_tables(sheet)

    assert list(tables[MISSING]["goes to"]) == ["--box", "--tolerances", "--sharing", "a new RUN"]
    for command in tables[MISSING]["comes from"][:3]:
        assert (STUDIES / Path(command.split()[2]).name).is_file()
    row = tables[DIRECTIONS].set_index("direction").loc["TSM x"]
    assert row["requirement"] == "no box given"
    assert row["tolerance wanted ± [%]"] == 15.0
    assert "no acceptance box" in specification_section(sheet, tables).text


def test_the_asked_capability_leaves_the_stated_share_inside():
    asked = asked_capability(0.95, 3)
    inside = norm.cdf(3 * asked) - norm.cdf(-3 * asked)
    assert inside**3 == pytest.approx(0.95)
    sample = np.random.default_rng(3).normal(1.0, 0.05, 20)
    half = 3.0 * measured_capability(asked, 20, 0.95) * sample.std(ddof=1)
    found = capability(sample, sample.mean() - half, sample.mean() + half)
    assert found.cpk_bound == pytest.approx(asked)


def changed(tmp_path, box_run, **values):
    path = tmp_path / "box.json"
    write_solution_box(path, replace(read_solution_box(box_run / "acceptance_box.json"), **values))
    return path


def test_pieces_of_something_else_are_refused(study, box_run, tolerance_run, front, tmp_path):
    def refused(sentence, wanted=study, **files):
        with pytest.raises(InputError, match=sentence):
            specification_sources(wanted, SpecificationFiles(**files))

    refused("found with other files", box=changed(tmp_path, box_run, platform_sha256="0" * 64))
    other = tuple(BoxResponse(name, 54.0, 1.0) for name in ("F39-1", "F39-2"))
    refused("its vehicles are F39-1, F39-2", box=changed(tmp_path, box_run, responses=other))
    refused("holds no acceptance_box.json", box=front)
    refused("has no allocation.csv", tolerances=front)
    refused("has no part_numbers.csv", sharing=tolerance_run)
    refused("another design: run", replace(study, pick=Pick.knee), tolerances=tolerance_run)


def test_edited_older_and_foreign_runs_are_refused(study, box_run, sharing_run, tmp_path):
    copy = tmp_path / "commonality" / "other"
    copy.mkdir(parents=True)
    table = pd.read_csv(sharing_run / "part_numbers.csv")
    run_folder(copy, {"platform.toml": "0" * 64}, {"part_numbers.csv": table})
    with pytest.raises(InputError, match="other files of the platform"):
        specification_sources(study, SpecificationFiles(sharing=copy))
    (copy / "part_numbers.csv").write_text("nothing")
    older = tmp_path / "solution_box" / "older"
    shutil.copytree(box_run, older)
    (older / "summary.json").write_text("{}")
    run_folder(older, {}, {})
    with pytest.raises(InputError, match="older deboom wrote it: run solution_box --front"):
        specification_sources(study, SpecificationFiles(box=older))
    with pytest.raises(InputError, match="has been edited"):
        specification_sources(study, SpecificationFiles(sharing=copy))


def test_the_anonymous_sheet_of_one_supplier_is_in_page_and_workbook(front, pieces, tmp_path):
    given = [f"--{name}={path}" for name, path in vars(pieces).items()]
    options = ["--supplier", "--anonymous", "--mount", "TSM", "--studies", str(STUDIES)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(supplier_certainty, "MEASURED_AGAIN", 40)
        patch.setattr(supplier_effects, "BASE_POINTS", 128)
        result = CliRunner().invoke(
            app, ["report", str(front), *options, *given, "--out", str(tmp_path)]
        )
    assert result.exit_code == 0, result.output
    page, workbook = (Path(line) for line in result.stdout.splitlines()[-2:])
    html = page.read_text(encoding="utf-8")
    assert "Specification sheet" in html
    assert "vehicle A, vehicle B, 1 other" in html
    sheets = openpyxl.load_workbook(workbook)
    sheet = sheets[DIRECTIONS]
    header, *rows = sheet.iter_rows(values_only=True)
    assert [row[0] for row in rows] == ["TSM x", "TSM y", "TSM z"]
    assert sheet.freeze_panes == "A2"
    numbers = [n for n, v in zip(header, rows[0], strict=True) if isinstance(v, int | float)]
    assert len(numbers) > 15
    assert all(name.endswith("]") for name in numbers)
    widths = [sheet.column_dimensions[cell.column_letter].width for cell in sheet[1]]
    assert all(len(name) < width for name, width in zip(header, widths, strict=True))


def test_the_pieces_belong_to_the_supplier(tmp_path):
    result = CliRunner().invoke(app, ["report", str(tmp_path), "--interactive", "--box", "b.json"])
    assert result.exit_code == 2
    assert "belong to --supplier" in result.stderr
