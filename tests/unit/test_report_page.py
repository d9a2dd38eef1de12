"""The page: one self-contained, accessible file, and tables as a reader wants them."""

import base64
import json
import re
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.files import tables
from deboom.files.run_folder import hash_files, read_run
from deboom.files.tables import read_frame
from deboom.language import Language
from deboom.plot import CurvePanel, curve_panels
from deboom.plot.style import as_png
from deboom.report import Sound, Step, Table
from deboom.report.report import Report
from deboom.report.sheet import Sheet
from deboom.report.tables import text_columns
from deboom.runs.overview import answer_of, key_lines, show_lines

PANEL = CurvePanel("", np.arange(1, 4), {"hypervolume": np.array([0.1, 0.2, 0.25])})
PNG = as_png(curve_panels([PANEL], x_label="generation [1]", y_label="hypervolume [1]", columns=1))
VOID = {"meta", "img", "br", "link", "input", "hr"}
TABLE = pd.DataFrame({"vehicle": ["U06-1", "U06-2"], "change [dB]": [-2.849, 0.2], "n": [3, 4]})


class Document(HTMLParser):
    """Elements with their attributes and text; refuses tags that do not close in order."""

    def __init__(self, html):
        super().__init__()
        self.open = []
        self.elements = []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        """Note an element; its text follows."""
        self.elements.append((tag, dict(attrs), []))
        if tag not in VOID:
            self.open.append((tag, self.elements[-1]))

    def handle_endtag(self, tag):
        """Refuse a tag that closes another one."""
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        """Give the text to every open element."""
        for _, element in self.open:
            element[2].append(data)

    def every(self, tag):
        """Attributes and text of every element of one kind."""
        return [
            (attributes, " ".join("".join(text).split()))
            for name, attributes, text in self.elements
            if name == tag
        ]


PROVENANCE = {
    "command": "deboom run studies/front.py --seed 1",
    "seed": 1,
    "environment": {"packages": {"numpy": "2.4.6"}, "git": {"revision": "abc"}},
    "inputs": {"data/platform.toml": "0123abcd"},
}


def report_of(text, titles=("The front", "Levels"), frame=TABLE):
    """Write a report with this text wherever a text may stand, else with plain words."""
    report = Report(text or "Robust front", text or "Which mounts?")
    report.number("headline", text or "−2.8 dB", "", text or "U06-1", headline="s")
    report.explain("SPL", "σ")
    report.warn(text or "TSM x stops at its bound.")
    for title in titles:
        report.section(text or title, f"{text or 'First paragraph.'}\n\nSecond one.")
    report.figure(None, PNG, text or "The search has settled.")
    report.table(None, frame, text or "Per vehicle.")
    return report


def page(text="", provenance=PROVENANCE, **changes):
    return report_of(text, **changes).html(provenance)


def test_page_is_one_file_without_scripts_links_or_outside_references():
    html = page()
    assert not re.search(r"https?://|//[a-z]|@import|url\(", html.replace(_data_uris(html), ""))
    document = Document(html)
    tags = {tag for tag, _, _ in document.elements}
    assert not tags & {"script", "link", "iframe", "object", "embed", "base", "form"}
    for _, attributes, _ in document.elements:
        assert attributes.get("src", "data:").startswith("data:")
        assert attributes.get("href", "#").startswith("#")


def _data_uris(html):
    return re.search(r"data:image/png;base64,[A-Za-z0-9+/=]+", html).group()


def test_picture_is_embedded_unchanged_with_alt_text_size_and_caption():
    document = Document(page())
    ((attributes, _),) = document.every("img")
    assert base64.b64decode(attributes["src"].removeprefix("data:image/png;base64,")) == PNG
    assert attributes["alt"] == "The search has settled."
    assert (attributes["width"], attributes["height"]) == ("960", "427")
    assert document.every("figcaption")[0][1] == "Figure 1. The search has settled."


def test_table_has_scoped_headers_units_and_right_aligned_numbers():
    document = Document(page())
    columns = [(text, a.get("class")) for a, text in document.every("th") if a["scope"] == "col"]
    assert columns == [("vehicle", None), ("change [dB]", "numeric"), ("n", "numeric")]
    rows = [text for a, text in document.every("th") if a["scope"] == "row"]
    assert rows[:2] == ["U06-1", "U06-2"]
    numbers = [text for a, text in document.every("td") if a.get("class") == "numeric"]
    assert numbers == ["−2.85", "3", "0.20", "4"]
    assert document.every("caption")[0][1] == "Table 1. Per vehicle."


def test_page_names_its_language_title_and_one_main_heading():
    document = Document(page())
    assert document.every("html")[0][0]["lang"] == "en"
    assert document.every("title")[0][1] == "Robust front"
    assert [text for _, text in document.every("h1")] == ["Robust front"]
    identifiers = [a["id"] for _, a, _ in document.elements if "id" in a]
    assert len(identifiers) == len(set(identifiers))
    for _, attributes, _ in document.elements:
        assert attributes.get("aria-labelledby", identifiers[0]) in identifiers


def test_long_page_has_a_table_of_contents_whose_links_lead_somewhere():
    document = Document(page(titles=[f"Part {place}" for place in range(1, 6)]))
    links = [(a["href"], text) for a, text in document.every("a")]
    assert links == [(f"#section-{place}", f"Part {place}") for place in range(1, 6)]
    headings = {a["id"]: text for a, text in document.every("h2") if "id" in a}
    assert all(headings[target.removeprefix("#")] == text for target, text in links)


EVIL = "</style><script>alert(1)</script>\"'><img src=x onerror=alert(1)> & [dB]"


def test_figures_and_tables_that_are_files_can_be_linked_to():
    part = Report("part")
    part.section("of a part")
    part.table("levels", pd.DataFrame({"name": ["a"]}), "Levels of the part.")
    part.table("lines", pd.DataFrame({"name": ["a"]}))
    report = Report("whole")
    report.section("first")
    report.figure("static x", PNG, "Over the force.")
    report.figure(None, PNG, "No file.")
    report.table("levels", pd.DataFrame({"name": ["a"]}), "Levels.")
    report.include(part, "Part", names={"levels": "part_levels"})
    anchors = re.findall(r' id="((?:figure|table)-[^"]*)"', report.html())
    assert anchors == ["figure-static-x", "table-levels", "table-part_levels"]


def test_a_folded_section_can_be_opened_and_keeps_its_heading():
    report = Report("Fold", "?")
    report.section("Answer", "Build this.")
    report.section("Pictures behind", "Where it comes from.", folded=True)
    page = Document(report.html())
    (_, words), *_ = [d for d in page.every("details") if "Where it comes from." in d[1]]
    assert words.startswith("Pictures behind")
    assert len(page.every("h2")) == 2
    inside = report.html().partition("</summary>")[2].partition("</details>")[0]
    assert 'id="section-2"' in inside  # a browser opens what it is led into


def answered():
    report = report_of("")
    report.answer("Soften TSM x to 0.80: −3.0 dB.", "How sure: ±0.1 dB.", "")
    report.panel("Each vehicle", Table(TABLE, "", {"change [dB]": 1}), "As made.", wide=True)
    report.panel("Hear it", Sound("today", b"RIFF 1"), Sound("after", b"RIFF 2"))
    report.panel("Next", Step("deboom listen results/x/latest", "hear all"))
    report.panel("Nothing to say")
    return report


def test_the_first_screen_begins_with_the_verdict_and_takes_the_place_of_the_tiles():
    html = answered().html()
    page = Document(html)
    assert [text for a, text in page.every("p") if a.get("class") == "verdict"] == [
        "Soften TSM x to 0.80: −3.0 dB."
    ]
    assert page.every("li")[0][1] == "How sure: ±0.1 dB."
    assert "headlines" not in [a.get("class") for a, _ in page.every("ul")]
    assert [text for _, text in page.every("h2")][:3] == ["Each vehicle", "Hear it", "Next"]
    assert "−2.8" in [text for _, text in page.every("td")]
    assert ["Nothing to say" in html, "Before you trust these numbers: 1 point" in html] == [
        False,
        True,
    ]
    # what is behind prints on pages of its own, and tables there keep their numbers
    assert html.index("Each vehicle") < html.index('class="behind"') < html.index("Table 1.")
    assert answered().headlines == report_of("").headlines


def test_a_sound_of_the_first_screen_is_embedded_and_allowed():
    html = answered().html()
    sounds = [a for a, _ in Document(html).every("audio")]
    prefix = "data:audio/wav;base64,"
    heard = [base64.b64decode(a["src"].removeprefix(prefix)) for a in sounds]
    assert heard == [b"RIFF 1", b"RIFF 2"]
    assert [a["aria-label"] for a in sounds] == ["today", "after"]
    assert "media-src data:" in html


def test_no_input_can_add_markup_to_the_first_screen():
    report = report_of("")
    report.answer(EVIL, EVIL)
    frame = pd.DataFrame({EVIL: [EVIL], "x [m]": [1.0]})
    report.panel(EVIL, Table(frame, EVIL), EVIL, Sound(EVIL, b"RIFF"), Step(EVIL, EVIL))
    html = report.html()
    assert "<script" not in html
    assert "<img src=x" not in html
    assert Document(html).every("audio")[0][0]["aria-label"] == EVIL


def test_no_input_can_add_markup():
    frame = pd.DataFrame({EVIL: [EVIL, "b"], "x [m]": [1.0, 2.0], f"n{EVIL}": ["a", "b"]})
    evil = {EVIL: EVIL, "packages": {EVIL: EVIL}, "git": {"a": EVIL}}
    facts = {"command": EVIL, "seed": EVIL, "environment": evil, "inputs": {EVIL: EVIL}}
    html = page(EVIL, facts, frame=frame)
    assert "<script" not in html
    assert "<img src=x" not in html
    tags = [tag for tag, _, _ in Document(html).elements]
    assert tags.count("img") == 1
    assert set(tags) == {tag for tag, _, _ in Document(page()).elements}
    assert Document(html).every("img")[0][0]["alt"] == EVIL


def test_a_sheet_has_the_decimal_sign_of_its_language_and_marks_what_moved():
    frame = pd.DataFrame({"direction": ["x", EVIL], "K [N/mm]": [-1.25, 3.5], "Cpk [1]": 1.33})
    pages = {}
    for language in Language:
        sheet = Sheet(EVIL, EVIL, language)
        sheet.fields({"drawing": "", "part": EVIL})
        sheet.rules((EVIL, "second"))
        sheet.table(frame, EVIL, {"K [N/mm]": 2}, {(1, "K [N/mm]"): EVIL, (0, "gone"): "1"})
        pages[language] = sheet.html()
        assert "<script" not in pages[language]
        assert pages[language].count(' moved"') == 1
    assert "−1.25" in pages["en"]
    assert "to be agreed" in pages["en"]
    assert "−1,25" in pages["de"]
    assert "noch zu vereinbaren" in pages["de"]
    assert '<span class="unit">1</span>' in pages["de"]
    assert Document(pages["en"]).every("li") == [({}, EVIL), ({}, "second")]
    with pytest.raises(InputError, match="needs a caption"):
        Sheet("A").figure(PNG, " ")


def test_a_number_of_the_summary_that_is_not_known_is_null():
    report = Report("Question?")
    report.number("peak_db", np.float64("nan"), "dB", "peak")
    report.number("n", 3, "", "designs")
    assert json.loads(report.contents()["summary.json"]) == {"peak_db": None, "n": 3}


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda r: r.explain("SPL", "loudness"), "does not explain \\['loudness'\\]"),
        (lambda r: r.figure(None, b"GIF89a", "Front"), "'Front' is not a PNG"),
        (lambda r: r.figure(None, PNG, " "), "needs a caption"),
        (lambda r: r.table(None, TABLE, "T", {"x": 1}), "unknown columns \\['x'\\]"),
        (lambda r: r.panel("Each vehicle", Table(TABLE, "")), "call `answer` first"),
        (lambda r: [r.number("a", 1, "", "n") for _ in "xy"], "two things of the name 'a'"),
        (lambda r: [r.answer("Yes."), *(r.panel("Same", "x") for _ in "ab")], "the name 'Same'"),
        (lambda r: [r.number(k, 1, "", "n", headline="d") for k in "xy"], "of the name 'n'"),
    ],
)
def test_bad_input_is_refused_in_words(write, message):
    with pytest.raises(InputError, match=message):
        write(report_of(""))


@pytest.mark.parametrize(
    ("label", "values", "shown"),
    [
        # the unit gives the decimals
        ("f [Hz]", [24.0, 30.25], ("24.00", "30.25")),
        ("f[Hz]", [24.0], ("24.00",)),
        ("range [20, 60]  [Hz]", [24.0], ("24.00",)),
        ("n [rpm]", [960.4, 1210.0], ("960", "1210")),
        ("L [dB(A)]", [73.449], ("73.4",)),
        ("factor [1]", [0.8, 1.197], ("0.800", "1.197")),
        # other units show three digits of the median
        ("k [N/mm]", [14.6, 326.4, 2148.3], ("15", "326", "2148")),
        ("d [m]", [0.0123, 0.0456], ("0.0123", "0.0456")),
        ("d [m]", [0.0, 0.0], ("0", "0")),
        # minus, zero, thousands
        ("L [dB]", [-2.849, -0.001, 43216.5], ("−2.85", "0.00", "43\u202f216.50")),
        ("n", [12, 12000], ("12", "12\u202f000")),
        # missing values
        ("k [N/mm]", [310.0, np.nan], ("310", "–")),
        ("remark", ["soft", None], ("soft", "–")),
        ("n", [1, pd.NA], ("1", "–")),
    ],
)
def test_numbers_are_written_as_their_unit_asks(label, values, shown):
    (column,) = text_columns(pd.DataFrame({label: values}), {})
    assert column.cells == shown
    assert column.numeric == (label != "remark")


def test_decimals_can_be_asked_for():
    (column,) = text_columns(pd.DataFrame({"k [N/mm]": [14.6]}), {"k [N/mm]": 2})
    assert column.cells == ("14.60",)


def test_words_and_flags_stay_words():
    columns = text_columns(pd.DataFrame({"a": [True, False], "b": ["x", 3.0]}), {})
    assert columns[0].cells == ("yes", "no")
    assert not columns[0].numeric
    assert columns[1].cells == ("x", "3.0")


def test_columns_of_the_same_name_stay_apart():
    frame = pd.DataFrame([[1.0, 2.0]], columns=["k [m]", "k [m]"])
    assert [column.cells for column in text_columns(frame, {})] == [("1.00",), ("2.00",)]


def test_a_long_table_is_kept_compressed_and_read_back(tmp_path, monkeypatch):
    monkeypatch.setattr("deboom.tabled.MOST_ROWS", 1)
    report = report_of("")
    report.table("per_vehicle", TABLE)
    report.table("few", TABLE[:1])
    assert report.contents() == report.contents()  # no time of packing
    report.write(tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"per_vehicle.csv.gz", "few.csv", "summary.json", "answer.json", "report.html"}
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "per_vehicle.csv.gz"), TABLE)
    pd.testing.assert_frame_equal(read_frame(tmp_path / "per_vehicle.csv", ("vehicle",)), TABLE)
    (tmp_path / "per_vehicle.csv.gz").write_bytes(b"\x1f\x8b cut")
    with pytest.raises(InputError, match="is no table"):
        read_frame(tmp_path / "per_vehicle.csv")
    monkeypatch.setattr(tables, "LARGEST_PACKED_TEXT", 10)
    report.write(tmp_path)
    with pytest.raises(InputError, match="MiB of text"):
        read_frame(tmp_path / "per_vehicle.csv")


def test_nothing_is_drawn_for_the_results():
    report = report_of("")
    drawn = []

    def draw():
        drawn.append("late")
        return PNG

    report.figure("late", draw, "Drawn last.")
    assert "figures/late.png" not in report.results()
    assert drawn == []
    assert report.contents()["figures/late.png"] == PNG
    assert report.html().count("Drawn last.") == 2
    assert drawn == ["late"]  # once


def test_the_answer_of_a_run_is_what_its_first_screen_says(tmp_path):
    report = answered()
    report.number("mean_db", np.float64(-2.84), "dB", "mean change", headline="+.1f")
    report.number("n", np.int64(3), "", "designs", headline="d")
    report.number("loudest", "U06-3", "", "loudest vehicle", headline="s")
    report.number("ratio", 0.66, "1", "cost over today's", headline=".2f")
    report.number("peak_db", np.nan, "dB", "its peak")
    report.write(tmp_path)
    hashes = hash_files([tmp_path / "answer.json"], relative_to=tmp_path)
    (tmp_path / "run.json").write_text(json.dumps({"study": "x", "files_sha256": hashes}))
    answer = read_run(tmp_path).answer
    assert answer == report.first_screen
    assert list(answer.headlines.values())[1:] == ["−2.8 dB", "3", "U06-3", "0.66"]
    assert report.summary == {
        "headline": "−2.8 dB",
        "mean_db": -2.84,
        "n": 3,
        "loudest": "U06-3",
        "ratio": 0.66,
        "peak_db": None,
    }
    table, *_ = answer.panels["Each vehicle"]
    pd.testing.assert_frame_equal(table.frame, TABLE)
    assert answer.panels["Next"] == (Step("deboom listen results/x/latest", "hear all"),)
    assert "Hear it" not in answer.panels  # sounds are no data
    lines = list(key_lines(read_run(tmp_path)))
    assert "ratio     [1]   cost over today's" in lines
    shown = list(show_lines(read_run(tmp_path)))
    assert {"Soften TSM x to 0.80: −3.0 dB.", "  mean_db   -2.84 dB", "  ratio     0.66"} <= {
        *shown
    }
    (tmp_path / "answer.json").write_text("{}")
    with pytest.raises(InputError, match="has been edited"):
        _ = read_run(tmp_path).answer
    assert "has been edited" in "\n".join(show_lines(read_run(tmp_path)))
    (tmp_path / "run.json").write_text(
        '{"study": "x", "headlines": {"n": "3"}, "verdict": "Good."}'
    )
    older = read_run(tmp_path)
    assert older.answer is None
    assert (answer_of(older).headlines, answer_of(older).verdict) == ({"n": "3"}, "Good.")
    with pytest.raises(InputError, match="does not say what its numbers are"):
        list(key_lines(older))
