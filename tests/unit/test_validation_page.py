"""The page of claims: its format, and that it never passes for fresher than it is."""

import json
import re
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))  # the page is written from there

import validate
from claims import Claim, draws

PAGE = validate.PAGE.read_text(encoding="utf-8")


@pytest.mark.slow("judges every comparison of the page anew")
def test_the_page_is_what_the_command_writes_and_marks_what_is_older():
    assert validate.marked(PAGE) == PAGE, "run: python benchmarks/validate.py --mark"
    plain, top, *sections = PAGE.split("\n## ")[1:]
    for text, bars in ((plain, 4), (top, 6), *((section, 5) for section in sections)):
        rows = [line for line in text.splitlines() if line.startswith("|")]
        assert rows
        assert [row for row in rows if len(re.findall(r"(?<!\\)\|", row)) != bars] == []
    assert set(validate.sections_of(PAGE)) <= set(validate.section_names())


def test_the_page_begins_with_what_holds_and_what_does_not():
    top = validate.marked(PAGE).split("\n## ")[2]
    counts = re.findall(
        r"^\| \[.*\]\(#.*\) \| (\d+) of (\d+) \| (.*) \| (\d*) \| .*\|$", top, flags=re.M
    )
    assert len(counts) == len(validate.sections_of(PAGE))
    rows = validate.claims_of(PAGE)
    claims = [row for row in rows if row[1] != "no claim"]
    assert sum(int(every) for _, every, _, _ in counts) == len(claims)
    assert sum(int(held) for held, _, _, _ in counts) == sum(row[3] for row in claims)
    assert sum(int(without or 0) for *_, without in counts) == len(rows) - len(claims) > 30
    assert all(bool(missed.strip()) == (held != every) for held, every, missed, _ in counts)
    held = sum(row[3] for row in claims)
    total = (f"{held} of {len(claims)}", len(claims) - held, len(rows) - len(claims))
    assert "| **all** | {} | {} | {} |  |".format(*total) in top


def test_a_row_without_a_claim_has_no_verdict():
    text = validate.section_text("bench", [Claim("a", "no claim", "0.5", True)], 2.0)
    assert "| a | no claim | 0.5 |  |" in text
    assert validate.claims_of(text) == [("a", "no claim", "0.5", True)]


def test_numbers_in_plain_words_are_those_of_their_claims():
    rows = validate.plain_rows(PAGE, {})
    assert len(rows) == len(validate.PLAIN)
    by_sentence = {sentence: begin for sentence, begin in validate.PLAIN}
    for row in rows:
        sentence, number, _ = (cell.strip() for cell in row.split("|")[1:-1])
        (measured, *_) = [
            figure for claim, _, figure, _ in validate.claims_of(PAGE)
            if claim.startswith(by_sentence[sentence])
        ]  # fmt: skip
        assert measured.startswith(number)
        assert float(number) > 0
    assert len(validate.coverages(PAGE)) > 20


def test_the_picture_has_the_kind_of_cars_whose_intervals_hold_least():
    (least,) = [
        float(figure.split()[0])
        for claim, _, figure, _ in validate.claims_of(PAGE)
        if claim.startswith("bodies unknown: held in the family")
    ]
    assert (90.0, least) in validate.coverages(PAGE)


def test_a_number_in_plain_words_says_that_it_is_of_older_code():
    sections = "| true error, 3 cylinders, EnM z | 2 | 1.6 | yes |"
    (row,) = validate.plain_rows(sections, {"true error, 3 cylinders, EnM z": "All mounts"})
    assert row.endswith("| 1.6 | [of older code](#all-mounts) |")


@pytest.fixture
def section(monkeypatch):
    monkeypatch.setattr(validate, "section_names", lambda: ["bench"])
    return validate.section_text("bench", [Claim("|K| of a | b", "≤ 1", "0.5", True)], 2.0)


def test_a_section_is_fresh_until_its_code_changes(section, tmp_path, monkeypatch):
    fresh = validate.marked(section)
    assert r"| \|K\| of a \| b | ≤ 1 | 0.5 | yes |" in fresh
    assert validate.OLDER not in fresh
    monkeypatch.setattr(validate, "MEASURED", tmp_path / "measured.json")
    validate.MEASURED.write_text("{}")
    now = validate.hashes("bench")
    changed = {**now, "src/deboom/arrays.py": "0" * 12, "studies/new.py": "0" * 12}
    monkeypatch.setattr(validate, "hashes", lambda _: changed)
    older = validate.marked(fresh)
    assert older.count(f"{validate.OLDER}: the code has changed since.*") == 1
    assert validate.marked(older) == older
    validate.MEASURED.write_text(json.dumps({"bench": now}))
    named = validate.marked(older)
    assert f"{validate.OLDER}: since then arrays, studies/new changed.*" in named
    monkeypatch.setattr(validate, "hashes", lambda _: now)
    assert validate.marked(named) == fresh


def test_a_newer_section_takes_the_place_of_the_older(section):
    page = validate.marked("\n".join([section.replace("0.5", "0.7"), section]))
    assert page.count("## Dynamic stiffness on the virtual bench") == 1
    assert "0.7" not in page


def test_comments_and_docstrings_are_no_code_and_all_else_is(tmp_path):
    def code(text):
        path = tmp_path / f"a{hash(text)}.py"
        path.write_text(text)
        return validate.code(path)

    bare = code("def f():\n    return 1\n")
    assert code('"""M."""\n\n\ndef f():  # why\n    """F."""\n\n    return 1\n') == bare
    assert code("def f():\n    return 2\n") != bare
    assert "'#'" in code("x = '#'  # a\n")


def test_a_section_rests_on_what_it_imports_and_the_studies_it_names():
    names = {str(path.relative_to(validate.ROOT)) for path in validate.sources("front_study")}
    assert {"benchmarks/claims/front_study.py", "studies/front.py"} <= names
    assert not [name for name in names if name.startswith("src/deboom/plot/")]
    assert "src/deboom/physics/sound_level.py" in names
    modules = {path.name for path in validate.sources("robust")}
    assert {"robust.py", "moments.py", "scatter.py"} <= modules
    assert "hoses.py" not in modules


def test_draws_are_a_few_times_what_is_asked_for(monkeypatch):
    monkeypatch.setenv("DRAWS", "2.5")
    assert draws(4) == 10
