"""A pinned run fails when a number, a column or a sentence of it changes, and only then."""

import json
from contextlib import nullcontext

import pytest

import pinned_pages

PAGE = """<h1>Unbalance</h1><p>Static unbalance <b>20.10</b> g mm.</p>
<table><tr><th>route</th><th>static<br>[g mm]</th></tr><tr><td>a</td><td>20.16</td></tr></table>
<p>The rotor turns from y to z.</p><h2 id="provenance">Provenance</h2><p>1.234 s</p>"""
TABLE = "speed [rpm],static [g mm]\n1000,20.1\n2000,20.3\n"
RECORD = {"facts": {"route": "d"}, "inputs_sha256": {"test/frf.uff": 64 * "a"}}
DRAWN = "6 in x 4 in\nspeed | 0 1 |\nlines: 1, 4 numbers, 20.3\nlooks: 2 Line2D gh, 1 Axes ij"
MODEL = {"mass_kg": 7.1987, "matrix": [[1.0, 0.5], [0.5, 2.0]], "names": ["x", "y"]}


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.delenv("DEBOOM_PIN", raising=False)
    monkeypatch.setattr(pinned_pages, "PAGES", tmp_path / "pages")
    folder = tmp_path / "results" / "unbalance" / "run"
    folder.mkdir(parents=True)
    files = {"report.html": PAGE, "unbalance.csv": TABLE}
    files |= {"run.json": json.dumps(RECORD), "model.json": json.dumps(MODEL)}
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "speed.png").write_bytes(pinned_pages.PICTURE + DRAWN.encode())
    return folder


@pytest.fixture
def pin(run, monkeypatch):
    def write(name, like=None):
        with monkeypatch.context() as patch:
            patch.setenv("DEBOOM_PIN", "1")
            pinned_pages.hold(run, name, like)
        return pinned_pages.PAGES / f"{name}.txt"

    return write


def edit(run, name, old, new):
    text = (run / name).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (run / name).write_text(text.replace(old, new), encoding="utf-8")


CHANGES = {
    "number in a sentence": ("report.html", "20.10", "20.12"),
    "number in a table of the page": ("report.html", "20.16", "20.18"),
    "column of a table of the page": ("report.html", "[g mm]</th>", "[g m]</th>"),
    "sentence": ("report.html", "from y to z", "from z to y"),
    "sentence that is gone": ("report.html", "<p>The rotor turns from y to z.</p>", ""),
    "number of a file": ("unbalance.csv", "2000,20.3", "2000,20.301"),
    "column of a file": ("unbalance.csv", "static [g mm]", "static mean [g mm]"),
    "number of a model": ("model.json", "7.1987", "7.1997"),
    "row of a matrix": ("model.json", "[0.5, 2.0]", "[2.0, 0.5]"),
    "word of a model": ("model.json", '"names": ["x", "y"]', '"names": ["x", "z"]'),
    "fact of the record": ("run.json", '"route": "d"', '"route": "e"'),
    "file that was read": ("run.json", "test/frf.uff", "test/frf.csv"),
}


@pytest.mark.parametrize(("name", "old", "new"), CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("like", [None, "first"])
def test_a_change_is_seen(run, pin, like, name, old, new):
    pin("first")
    pin("second", like)
    pinned_pages.hold(run, "second", like)
    edit(run, name, old, new)
    with pytest.raises(AssertionError, match=r"second\.txt, line \d+"):
        pinned_pages.hold(run, "second", like)


PASSING = {
    "time that it took": ("report.html", "1.234 s", "2.345 s"),
    "last digit, as rounding has it": ("report.html", "20.16", "20.17"),
    "last bits of a number": ("unbalance.csv", "2000,20.3", "2000,20.3000000001"),
    "checksum of a file": ("run.json", 64 * "a", 64 * "b"),
}


@pytest.mark.parametrize(("name", "old", "new"), PASSING.values(), ids=PASSING)
def test_what_differs_from_run_to_run_is_not(run, pin, name, old, new):
    pin("first")
    edit(run, name, old, new)
    pinned_pages.hold(run, "first")


@pytest.mark.parametrize(("version", "seen"), [((3, 11), True), ((3, 10, 9), False)])
@pytest.mark.parametrize("line", ["6 in x 8 in", "looks: 2 Line2D gk, 1 Axes ij"])
def test_looks_of_a_picture_count_from_the_matplotlib_that_drew_the_pins(
    run, pin, monkeypatch, version, seen, line
):
    pin("first")
    monkeypatch.setattr(pinned_pages.mpl, "__version_info__", version)
    pinned_pages.hold(run, "first")
    begin = line.partition(" ")[0]
    lines = [line if old.startswith(begin) else old for old in DRAWN.split("\n")]
    (run / "speed.png").write_bytes(pinned_pages.PICTURE + "\n".join(lines).encode())
    with pytest.raises(AssertionError, match="first") if seen else nullcontext():
        pinned_pages.hold(run, "first")


@pytest.mark.parametrize("version", [(3, 11), (3, 10, 9)])
def test_what_a_picture_draws_counts_with_any_matplotlib(run, pin, monkeypatch, version):
    pin("first")
    monkeypatch.setattr(pinned_pages.mpl, "__version_info__", version)
    drawn = DRAWN.replace("20.3", "20.5").encode()
    (run / "speed.png").write_bytes(pinned_pages.PICTURE + drawn)
    with pytest.raises(AssertionError, match="first"):
        pinned_pages.hold(run, "first")


def test_a_second_run_of_a_page_repeats_neither_its_prose_nor_files_that_are_alike(run, pin):
    first = pin("first").read_text(encoding="utf-8")
    edit(run, "report.html", "20.16", "21.16")
    second = pin("second", like="first").read_text(encoding="utf-8").split("\n")
    assert "The rotor turns from y to z." in first
    assert "The rotor turns from y to z." not in second
    assert "a | 21.16" in second
    assert second.count("as in first") == 4
