"""What deboom 0.3.0 wrote still opens, or is refused with the remedy."""

import re
import shutil
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import deboom
from command_line import call, refused
from deboom.errors import InputError
from deboom.files.acceptance import checksum, read_specification
from deboom.files.shipped_studies import MOVED_NAMES
from deboom.runs.runner import load_study

OLD = Path(__file__).parents[1] / "data" / "deboom-0.3.0"
RESULTS = OLD / "results"
FRONT = RESULTS / "u06_robust_front" / "2026-11-28_213048_seed1"
UNFINISHED = "2026-11-28_213746_seed1"
PLATFORM = RESULTS / "u06_platform" / "2026-11-28_213805_seed1"
SENSITIVITY = RESULTS / "u06_sensitivity" / "2026-11-28_213047_seed1"
BOX = RESULTS / "solution_box" / "2026-11-28_213837_seed1"
SHEET = OLD / "supplier_sheet_TSM.xlsx"
MEAN, SIGMA = "SPLV mean sum [dB(A)]", "SPLV sigma sum [dB]"


@pytest.mark.parametrize("folder", [FRONT, PLATFORM])
def test_the_front_of_a_run_opens(folder):
    front = deboom.read_run(folder).front
    table = pd.read_csv(folder / "front.csv").fillna({"pick": ""})
    np.testing.assert_array_equal(front.objectives, table[[MEAN, SIGMA]])
    np.testing.assert_array_equal(front.designs, table[list(front.variables)])
    assert len(front.variables) == 12
    for name, row in front.picks.items():
        assert name in table["pick"][row]
    assert front.convergence.shape == (len(pd.read_csv(folder / "convergence.csv")),)


def test_designs_and_indices_of_a_run_open():
    assert deboom.read_run(PLATFORM).doe.doe.designs.shape == (32, 12)
    indices = pd.read_csv(SENSITIVITY / "sobol.csv")
    pd.testing.assert_frame_equal(deboom.read_run(SENSITIVITY).sobol, indices)


def test_runs_are_listed_and_shown():
    lines = call("list", RESULTS).stdout
    for run in (FRONT, PLATFORM, SENSITIVITY, BOX):
        assert f"finished    {run.parent.name}  {run.as_posix()}" in lines
        assert "All files are as the run wrote them." in call("show", run).stdout
    assert f"unfinished  u06_robust_front  {FRONT.parent}/{UNFINISHED}.unfinished" in lines


def test_runs_are_served_with_the_search_of_the_unfinished_one():
    serve = pytest.importorskip("deboom.runs.serve")
    folder = serve.ResultsFolder(RESULTS, "/files/")
    shown = folder.runs()
    assert not shown["problems"]
    assert {run["folder"] for run in shown["runs"] if run["picks"]} == {
        run.relative_to(RESULTS).as_posix() for run in (FRONT, PLATFORM)
    }
    assert len(shown["runs"]) == 5
    (search,) = folder.search(f"u06_robust_front/{UNFINISHED}.unfinished")["searches"]
    assert (search["generation"], search["planned"]) == (2, 3)


def test_fronts_are_compared_and_begin_a_box():
    """The models are built again and give the runs' own figures, or the runs are refused."""
    compare, box = load_study("compare"), load_study("solution_box")
    runs = compare.model(compare.effective({"runs": [FRONT, PLATFORM]}))
    assert {run.entry.study for run in runs} == {"u06_robust_front", "u06_platform"}
    options = box.module.Options(front=FRONT)
    begin = box.module.pareto_point(box.module.prepare(options), options, lambda *_: None)
    front = deboom.read_run(FRONT).front
    np.testing.assert_array_equal(begin, front.designs[front.picks["best-mean"]])


def test_sheets_for_a_supplier_are_made_of_a_run_box_and_sheet(tmp_path):
    words = ("--box", BOX, "--since", SHEET, "--mount", "TSM", "--out", tmp_path)
    call("report", FRONT, "--supplier", *words)
    assert FRONT.name in (tmp_path / "supplier_sheet_TSM.html").read_text("utf-8")


def test_a_page_to_explore_is_made_of_a_run(tmp_path):
    call("report", FRONT, "--interactive", "--out", tmp_path)
    assert "best-mean = none-louder" in (tmp_path / "interactive.html").read_text("utf-8")


def test_box_sheet_and_library_open():
    box = deboom.read_solution_box(BOX)
    assert (box.group, box.limit_below_today_db) == ("U06", 0.5)
    sheet = read_specification(SHEET)
    assert sheet.mount == "TSM"
    assert sheet.box_sha256 == checksum(box.model_dump(mode="json"))
    with deboom.open_library(OLD / "du.db") as library:
        (identity,) = library.identities()
        assert library.load(identity).mount.name == "Du"


def test_an_unfinished_run_is_refused_with_the_remedy_and_stays(tmp_path):
    shutil.copytree(FRONT.parent, tmp_path / "u06_robust_front")
    folder = tmp_path / "u06_robust_front" / f"{UNFINISHED}.unfinished"
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    refused(
        ("run", "u06_robust_front", "--out", tmp_path, "--resume", UNFINISHED),
        "resume it with the versions that wrote it (deboom 0.3.0), start a new run",
    )
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def is_there(module, name):
    """Whether a module has a name, or is a package with a module of this name."""
    try:
        return hasattr(import_module(module), name) or bool(import_module(f"{module}.{name}"))
    except ModuleNotFoundError:
        return False


def test_what_a_copied_study_imports_is_there_or_told_where_it_is():
    """A study that was copied from 0.3.0 runs, or each import that fails says what to write."""
    imported = [
        line.split() for line in (OLD / "study_imports.txt").read_text("utf-8").splitlines()
    ]
    lost = {(module, name) for module, name in imported if not is_there(module, name)}
    assert lost == {(module, name) for module, homes in MOVED_NAMES.items() for name in homes}
    for homes in MOVED_NAMES.values():
        for home in homes.values():
            assert is_there(*home.rsplit(".", 1)), home


def test_a_copied_study_is_told_where_its_names_are(tmp_path):
    study = tmp_path / "mine.py"
    study.write_text(
        '"""Which mine?"""\n\nfrom deboom.arrays import RealArray\n'
        "from deboom.runs.progress import counted, progress_bar\n"
    )
    with pytest.raises(
        InputError,
        match=r"mine.py imports names that have moved since it was written: counted of "
        r"deboom.runs.progress is deboom.progress.counted now; progress_bar of",
    ):
        load_study(study)


def test_the_change_log_lists_what_moved():
    log = (Path(__file__).parents[2] / "CHANGELOG.md").read_text("utf-8")
    rows = re.findall(r"^\| `(deboom[\w.]+)` \| (.*) \| `(deboom[\w.]+)` \|$", log, re.MULTILINE)
    listed = {
        (module, name): f"{home}.{today or name}"
        for module, names, home in rows
        for name, today in re.findall(r"`(\w+)`(?: \(now `(\w+)`\))?", names)
    }
    assert listed == {
        (module, name): home
        for module, homes in MOVED_NAMES.items()
        for name, home in homes.items()
    }
