"""The page of the thesis leaves nothing out, and what it names is shown by finished runs."""

import re
from pathlib import Path

import pytest

from command_line import call
from deboom.bench.fleet import load_fleet
from deboom.files.run_folder import read_run
from deboom.pages import thesis as page
from deboom.pages.thesis import Thesis, read_thesis, thesis_markdown, thesis_report
from deboom.runs import runner
from deboom.runs import thesis as rerun
from deboom.runs.runner import load_study, run_once
from samples import thesis_runs as walk
from samples.false_statements import BEFORE, NEW

ROOT = Path(__file__).parents[2]
THESIS = read_thesis()
QUICK = ("unbalance", "compressor", "groups", "vehicles", "sensitivity", "mounts", "front")
SLOW = ("cabin",)
OF_OTHER_TESTS = ("sound",)
"""Looked at where its run is made."""


def told(place, changes):
    """Return the data with one statement put into it."""
    data = THESIS.model_dump()
    if place.startswith("run "):
        data["runs"][place.removeprefix("run ")] = changes
        return Thesis.model_validate(data)
    (item,) = (item for of in data["chapters"] for item in of["items"] if item["name"] == place)
    item |= changes
    return Thesis.model_validate(data)


def wrong_without_runs(thesis):
    checks = (walk.wrong_names, walk.wrong_commands, walk.wrong_code, walk.wrong_links)
    return [sentence for check in checks for sentence in check(thesis)]


def test_nothing_is_left_out_and_commands_and_names_exist():
    assert wrong_without_runs(THESIS) == []
    assert sorted(THESIS.runs) == sorted([*QUICK, *SLOW, *OF_OTHER_TESTS])


@pytest.fixture(scope="session")
def made(thesis_run):
    """Return the suite's finished runs by their commands."""
    commands = {**THESIS.runs, **walk.FURTHER}
    names = (*QUICK, *walk.FURTHER)
    return {commands[name]: read_run(thesis_run(name)) for name in names}


@pytest.fixture(scope="session")
def longer(thesis_run):
    """Return the runs that slow tests make."""
    return {name: read_run(thesis_run(name)) for name in SLOW}


def wrong_in(thesis, name, entry):
    return [*walk.wrong_in_run(thesis, name, entry.folder, page.numbers_of(entry))]


@pytest.mark.parametrize("name", QUICK)
def test_a_run_shows_what_the_page_says_of_it(name, made):
    assert wrong_in(THESIS, name, made[THESIS.runs[name]]) == []


@pytest.mark.slow("measures a car, identifies its compressor and synthesises its noise")
@pytest.mark.parametrize("name", SLOW)
def test_a_longer_run_shows_what_the_page_says_of_it(name, longer):
    assert wrong_in(THESIS, name, longer[name]) == []


@pytest.mark.parametrize(("place", "changes"), [*BEFORE, *NEW])
def test_a_false_statement_is_caught(place, changes, made):
    thesis = told(place, changes)
    if wrong_without_runs(thesis):
        return
    assert any(
        wrong_in(thesis, name, made[command])
        for name, command in thesis.runs.items()
        if command in made
    )


def test_a_statement_without_its_number_is_caught(made):
    data = THESIS.model_dump()
    for statement in data["statements"]:
        statement["here"] = statement["here"].replace("{", "{no_")
    thesis = Thesis.model_validate(data)
    for name in QUICK:
        of_run = sum(statement.run == name for statement in thesis.statements)
        assert len(wrong_in(thesis, name, made[THESIS.runs[name]])) == of_run


def test_there_are_thirty_false_statements():
    assert len({repr(statement) for statement in (*BEFORE, *NEW)}) == 30


def test_the_printed_1500_cars_fit_no_product_of_the_printed_design():
    designs = load_study("correlation").module.Options().designs
    vehicles = load_fleet(1).bodies
    assert (designs, len(vehicles)) == (300, 15)
    assert designs * len(vehicles) == 4500
    assert 500 % designs  # printed for each group of five vehicles


def test_proofs_of_misprints_exist():
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "tests").glob("*/test_*.py")]
    defined = set(re.findall(r"^def (test_\w+)", "\n".join(texts), re.M))
    proofs = {misprint.proof for misprint in THESIS.misprints} - {""}
    assert len(proofs) > 4
    assert proofs <= defined


@pytest.fixture
def runs(made):
    """Give all commands a finished run; the longer ones that of another command."""
    other = made[THESIS.runs["unbalance"]]
    return {name: made.get(command, other) for name, command in THESIS.runs.items()}


def masked(markdown):
    return re.sub(r"\*\*[^*]*\*\*", "**…**", markdown)


def test_the_page_of_the_documentation_is_what_the_command_writes(runs):
    text = (ROOT / "docs" / "thesis.md").read_text(encoding="utf-8")
    assert masked(text) == masked(thesis_markdown(THESIS, runs))
    assert page.NOT_KNOWN not in text


def test_the_page_follows_the_answer_of_a_run(runs, monkeypatch):
    before = thesis_markdown(THESIS, runs)
    assert "| numbers of 44 that the test determines | 44 | **35** |" in before
    known = page.numbers_of
    other = {"jacobian_rank": 36, "mass_kg": 9.1994}

    def changed(entry):
        return {**known(entry), **other} if entry.study == "identify" else known(entry)

    monkeypatch.setattr(page, "numbers_of", changed)
    after = thesis_markdown(THESIS, runs)
    assert "| numbers of 44 that the test determines | 44 | **36** |" in after
    assert "| the mass rises from 6.8 to 7.2 kg in the fit | **9.1994** kg |" in after
    assert len(before) == len(after)
    assert "36" in thesis_report(THESIS, runs).html()


def test_the_command_writes_the_page_with_pictures_and_its_markdown(runs, tmp_path, monkeypatch):
    finished = iter(runs.values())
    monkeypatch.setattr(rerun, "run_once", lambda *_: next(finished).folder)
    done = call("thesis", "--out", tmp_path)
    written = tmp_path / "thesis" / "report.html"
    assert done.stdout.splitlines()[-1] == written.as_posix()
    html = written.read_text(encoding="utf-8")
    assert "Thesis, figure 53: inertance matrix (figure_53_inertance)." in html
    assert html.count("(stiffness_map_TSM).") == 2  # once as alt text
    assert "shows it under Characteristic curves (static_*)." in html
    assert "It differs because" in html
    assert "`" not in html.partition("<body>")[2]
    text = (tmp_path / "thesis" / "thesis.md").read_text(encoding="utf-8")
    assert text == thesis_markdown(THESIS, runs)


def test_a_run_that_is_finished_is_not_run_again(tmp_path, monkeypatch):
    study = load_study(ROOT / "tests" / "samples" / "quick_study.py")
    first = run_once(study, {}, tmp_path)
    assert run_once(study, {}, tmp_path) == first
    other = run_once(study, {"number": 2}, tmp_path)
    assert other != first
    assert run_once(study, {"number": 1}, tmp_path) == first
    stopped = other.rename(other.with_name(f"{other.name}.unfinished"))
    assert run_once(study, {"number": 2}, tmp_path) == other
    assert not stopped.exists()
    changed = runner.environment_record
    monkeypatch.setattr(
        runner, "environment_record", lambda names: {**changed(names), "python": "3.99"}
    )
    assert run_once(study, {}, tmp_path) != first
