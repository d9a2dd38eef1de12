"""What runs say: their steps, words and tables of each page, two numbers for each column of a file.

A page is pinned as text in `tests/golden/pages`, so that a change of it is read as a difference.
`DEBOOM_PIN=1 make test` writes the pages anew; do so only when a change is meant, and say in the
changelog why.
"""

import json
import os
import re
from collections import defaultdict
from contextlib import contextmanager, redirect_stderr
from html import unescape
from io import BytesIO, StringIO
from itertools import zip_longest
from pathlib import Path
from zlib import crc32

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex, to_rgba_array
from PIL import Image

import ten_questions
from deboom import progress
from deboom.plot import style
from deboom.report import Report, report
from deboom.runs.runner import run_study

PICTURE = b"\x89PNG\r\n\x1a\n" + bytes(8) + b"\0\0\0\1\0\0\0\1"
"""Begin of a PNG of one dot, behind which stands what a picture shows."""
FIGURE = Report.figure
STEPS = "progress.txt"  # beside the runs of a study
PAGES = Path(__file__).parent / "golden" / "pages"
LOOKS = (
    "alpha",
    "axis_on",
    "color",
    "edgecolor",
    "facecolor",
    "fontsize",
    "fontstyle",
    "fontweight",
    "ha",
    "hatch",
    "linestyle",
    "linewidth",
    "marker",
    "markersize",
    "ncols",
    "rotation",
    "subplotspec",
    "tick_params",
    "va",
    "visible",
    "xscale",
    "yscale",
    "zorder",
)
NOT_DETERMINED = (
    "fitted",
    "share in the null space [1]",
    "posterior deviation",
    "posterior over prior [1]",
    "verdict",
)
"""Columns of the thesis's 44 numbers, 9 of whose combinations no test sees: rounding moves them."""
NOT_DETERMINED_TABLE = re.compile(r"(?s)<table(?:(?!</table>).)*?at its bound.*?</table>")
"""The same numbers on the page."""
TICKS = ("major_formatter", "major_locator", "minor_locator", "layout_engine")
"""What an artist of any kind may be asked for: how it looks, and of which type its ticks are."""
CHOSEN_BY_MATPLOTLIB = re.compile(r"looks: |ticks: |[\d.]+ in x ")
"""Begins of lines that matplotlib before 3.11 says otherwise: other defaults, ticks and margins."""
NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
TAG = re.compile(r"<[^>]*>")
IN_A_LINE = re.compile(r"</?(?:a|abbr|b|code|em|i|kbd|small|span|strong|sub|sup)\b[^>]*>")
"""Tags that do not end a paragraph."""
PASSING = re.compile(
    r"(\d+(?:\.\d+)? (?:s\b|(?:min|h)(?= left))|\d{4}-\d\d-\d\d\w*"
    r"|(?<![\w.])[0-9a-f]{12,}|(?<![\w.])/\S+"
    r"|^.*(?:seconds|visible together only|is not visible).*$)",
    re.MULTILINE,
)
"""Seconds, dates, hashes and paths, which differ from run to run; and what is not determined."""


@contextmanager
def pictures_described():
    """Build pictures and keep what they show as words and numbers; drawing takes far longer.

    That the same numbers give the same bytes is the business of the tests of `deboom.plot`.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "as_png", described)
        patch.setattr(Report, "figure", FIGURE)
        yield


@contextmanager
def captions_alone():
    """Keep a dot in place of every picture: what a page says of it costs nothing."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report.Picture, "_drawn", (PICTURE, ""))
        patch.setattr(Report, "figure", FIGURE)
        yield


def run_aloud(study, out, options):
    # every step that it tells is kept beside its folder
    with pytest.MonkeyPatch.context() as patch, redirect_stderr(StringIO()) as said:
        patch.setattr(progress, "LOG_LINES", 40)
        folder = run_study(study, out, options)
    (out / STEPS).write_text(said.getvalue(), encoding="utf-8")
    return folder


def hold(folder, name, like=None):
    """Compare a run, or one page, with what was pinned; write it where that is asked for.

    A second run of one page names the pin that it is `like`: its prose stands there alone. The
    first screen of a page that `ten_questions` knows must answer them.
    """
    if answers := ten_questions.PAGES.get(like or name):
        page = Path(folder) if Path(folder).is_file() else Path(folder) / "report.html"
        page = page.read_text(encoding="utf-8")
        assert ten_questions.unanswered(page, answers) == []
    said = pinned_text(Path(folder))
    if like is not None:
        said = [*_beside(said, (PAGES / f"{like}.txt").read_text(encoding="utf-8"), like)]
    hold_lines(said, name, _alike)


def hold_numbers(folder, name):
    """Compare tables and numbers of a run alone: another run of its page pins the sentences."""
    hold_lines(pinned_text(Path(folder), "*.csv", "summary.json"), name, _alike)


def hold_lines(said, name, same):
    """Compare lines with those that were pinned by a rule for two of them; see `hold`."""
    path = PAGES / f"{name}.txt"
    if os.environ.get("DEBOOM_PIN"):
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join(said) + "\n", encoding="utf-8")
    lines = path.read_text(encoding="utf-8").split("\n")[:-1]
    for number, (line, pinned) in enumerate(zip_longest(said, lines, fillvalue=""), 1):
        assert same(line, pinned), f"{path.name}, line {number}: {line!r} was {pinned!r}"


def pinned_text(folder, *patterns):
    """Return the lines of a run: its steps, and of each file what it says, or of some files alone.

    A column of a table in a file is a line, a row of a table on a page, a list of numbers in JSON,
    and a paragraph.
    """
    files = [folder] if folder.is_file() else sorted(folder.rglob("*"))
    if patterns:
        files = [path for path in files if any(map(path.match, patterns))]
    steps = folder.parents[1] / STEPS
    lines = steps.read_text(encoding="utf-8").split("\n") if steps.exists() else []
    for path in files:
        name = path.name if path == folder else path.relative_to(folder).as_posix()
        lines += [f"== {name}"] if path.is_file() else []
        if path.suffix in SAYS and "evaluations" not in path.parts:
            lines += SAYS[path.suffix](path)
    passing = (PASSING.sub("…", line) for line in lines)
    return [short for line in passing if (short := " ".join(line.split())) not in ("", "…")]


def _of_page(path):
    text = path.read_text(encoding="utf-8").partition('<h2 id="provenance">')[0]
    text = NOT_DETERMINED_TABLE.sub("the thesis's numbers", text)
    text = re.sub(r"(?s)<(script|style)\b.*?</\1>", "\n", text)
    text = re.sub(r"(?s)<tr\b.*?</tr>", _row, text)
    text = IN_A_LINE.sub(" ", re.sub(r"</dt>\s*<dd\b[^>]*>", ": ", text))
    return unescape(TAG.sub("\n", text)).split("\n")


def _row(row):
    """Return a row of a table as a line."""
    cells = (TAG.sub(" ", cell).split() for cell in re.split(r"</t[dh]>", row[0])[:-1])
    return "\n" + " | ".join(map(" ".join, cells)) + "\n"


def _of_json(path):
    record = json.loads(path.read_text(encoding="utf-8"))
    if path.name == "answer.json":  # the page says the rest, and its round trip has a test
        numbers = (number for number in record["numbers"] if number["headline"])
        return [f"{number['label']}: {number['headline']}" for number in numbers]
    if path.name == "run.json":
        inputs = sorted({*map(_last, record["inputs_sha256"])})
        record = {**record["facts"], "inputs": inputs}
    return _leaves(record)


def _leaves(value, name=""):
    """Say each number and word of JSON, a list of them in one line."""
    items = value.values() if isinstance(value, dict) else value
    if isinstance(value, dict) and not all(map(_is_hash, items)):
        for key, item in value.items():
            yield from _leaves(item, f"{name} {key}")
    elif isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        for item in value:
            yield from _leaves(item, name)
    elif isinstance(value, list) and value and all(isinstance(n, int | float) for n in value):
        yield f"{name}: {_numbers(value)}"
    else:
        said = " ".join(map(str, value)) if isinstance(value, dict | list) else value
        yield f"{name}: {said}"


def _is_hash(value):
    return isinstance(value, str) and re.fullmatch("[0-9a-f]{12,}", value) is not None


def _of_table(path):
    moving = NOT_DETERMINED if path.stem == "identifiability" else ()
    return _columns(pd.read_csv(path), moving)


def _of_picture(path):
    said = path.read_bytes()
    return said.removeprefix(PICTURE).decode().split("\n") if said.startswith(PICTURE) else []


SAYS = {".html": _of_page, ".json": _of_json, ".csv": _of_table, ".png": _of_picture}
"""What a file of each kind says."""


def _beside(said, other, like):
    """Leave out what another run of one page says alike: whole files, and words without numbers."""
    others = dict(_files(other.rstrip("\n").split("\n")))
    words = {line for lines in others.values() for line in lines if not NUMBER.search(line)}
    for head, lines in _files(said):
        same = others.get(head, ())
        if len(lines) > 1 and len(lines) == len(same) and all(map(_alike, lines, same)):
            lines = [f"as in {like}"]
        shared = [line for line in lines if line in words]
        yield head
        yield from (line for line in lines if line not in words)
        if shared:
            yield f"and words as in {like}: {_digest(' '.join(shared))}"


def _files(lines):
    """Yield the head of each file and its lines; steps stand before the first."""
    head, inside = "== steps", []
    for line in lines:
        if line.startswith("== "):
            if inside or head != "== steps":
                yield head, inside
            head, inside = line, []
        else:
            inside.append(line)
    yield head, inside


def _within(axis):
    """Return the ticks that show: beyond its ends, an axis has others in each matplotlib."""
    low, high = sorted(axis.get_view_interval())
    ticks = np.asarray(axis.get_ticklocs())
    return ticks[(low <= ticks) & (ticks <= high)]


def described(drawing):
    """Return what a picture shows in place of its PNG: words, and two numbers for each kind."""
    if isinstance(drawing, bytes):
        return PICTURE + "\n".join(_frames(drawing)).encode()
    figure = drawing.get_figure(root=True) or drawing
    lines = ["{:g} in x {:g} in".format(*figure.get_size_inches())]
    lines += [" ".join(w.get_text() for legend in figure.legends for w in legend.texts)]
    for axes in figure.axes:
        title = " ".join(axes.get_title(place) for place in ("left", "center", "right"))
        ends = " ".join(f"{end:.4g}" for end in (*axes.get_xlim(), *axes.get_ylim()))
        labels = f"{title} | {axes.get_xlabel()} | {axes.get_ylabel()} | {ends}"
        legend = axes.get_legend()
        words = " ".join(w.get_text() for w in (*axes.texts, *(legend.texts if legend else ())))
        many = words if len(words) > 300 else ""
        lines.append(f"{labels} | {_digest(NUMBER.sub('#', many)) if many else words}")
        to_data = axes.transData.inverted()
        kinds = {
            "lines": [line.get_xydata() for line in axes.lines],
            "patches": [to_data.transform(p.get_extents().corners()) for p in axes.patches],
            "colours": [kind.get_array() for kind in (*axes.collections, *axes.images)],
            "offsets": [kind.get_offsets() for kind in axes.collections],
            "paths": [path.vertices for kind in axes.collections for path in kind.get_paths()],
            "ticks": [_within(axis) for axis in (axes.xaxis, axes.yaxis)],
            "texts": [text.get_position() for text in axes.texts],
            "numbers": [[float(n.replace("−", "-")) for n in NUMBER.findall(many)]],
        }
        said = []
        for kind, arrays in kinds.items():
            values = [np.ravel(np.ma.filled(a, 0.0)) for a in arrays if a is not None]
            if any(map(np.any, values)):
                digits = 4 if kind == "colours" else 6
                said.append(f"{kind}: {len(values)}, {_numbers(np.concatenate(values), digits)}")
        colours = sorted({to_hex(line.get_color()) for line in axes.lines})
        lines.append("; ".join([*said, *colours]))
    kinds = defaultdict(list)
    for artist in figure.findobj():
        kinds[type(artist).__name__].append(_looks(artist))
    looks = [f"{len(k)} {kind} {_digest(repr(k))}" for kind, k in sorted(kinds.items())]
    lines.append(f"looks: {', '.join(looks)}")
    style.close(figure)
    return PICTURE + "\n".join(lines).encode()


def _looks(artist):
    """Give how something in a picture looks, as far as no data decide it."""
    axis = [type(getattr(artist, f"get_{name}", str)()).__name__ for name in TICKS]
    properties = {name: getattr(artist, f"get_{name}", str)() for name in LOOKS}
    properties |= {name: getattr(artist, name, "") for name in ("xyann", "axison", "_dash_pattern")}
    mapped = getattr(artist, "get_array", str)()
    for name in ("color", "facecolor", "edgecolor"):
        colours = (
            "none"
            if isinstance(properties[name], str) and not properties[name]
            else properties[name]
        )
        properties[name] = "" if np.any(mapped) else np.round(to_rgba_array(colours), 2).tolist()
    properties["place"] = np.round(artist.get_position(), 3) if hasattr(artist, "transAxes") else ""
    return [axis, sorted((name, str(value)) for name, value in properties.items())]


def _frames(moving):
    """Say how dark each place of a picture in motion is, in its first frame and a later one."""
    with Image.open(BytesIO(moving)) as picture:
        yield f"{picture.n_frames} frames of {picture.size}, {picture.info.get('duration')} ms"
        for frame in (0, picture.n_frames // 3):
            picture.seek(frame)
            yield _numbers(np.asarray(picture.convert("L").resize((48, 24))) // 8)


def _numbers(values, digits=6):
    """Say how large numbers are, and where the large ones stand."""
    values = np.nan_to_num(np.ravel(values).astype(float), posinf=0.0, neginf=0.0)
    size = np.linalg.norm(values)
    place = 1.0 + np.cos(np.arange(values.size)) @ values / max(size, 1e-12)
    return f"{values.size} numbers, {size:.{digits}g}, {place:.{digits - 1}f}"


def _digest(text):
    """Give a few letters that change with a text; a digit would be taken for a number."""
    return f"{crc32(text.encode()):x}".translate(str.maketrans("0123456789", "ghijklmnop"))


def _last(path):
    return path.rpartition("/")[2]


def _columns(table, moving):
    for name, column in table.items():
        if "[s]" in name:
            continue
        if name in moving:
            yield f"{name}: {column.size} rows"
        elif column.dtype.kind not in "fiu":
            said = PASSING.sub("…", " ".join(map(str, column)))
            yield f"{name}: {column.size} words, {_digest(said)}"
        else:
            yield f"{name}: {_numbers(column.to_numpy())}"


def _alike(line, pinned):
    if mpl.__version_info__ < (3, 11) and CHOSEN_BY_MATPLOTLIB.match(line):
        return CHOSEN_BY_MATPLOTLIB.match(pinned) is not None
    words = NUMBER.sub("#", line) == NUMBER.sub("#", pinned)
    return words and all(map(_equal, NUMBER.findall(line), NUMBER.findall(pinned)))


def _equal(number, other):
    """Say whether two numbers agree to their last digit but one step, as rounding has it."""
    decimals = len(number.partition("e")[0].partition(".")[2])
    exponent = float(f"1e{number.partition('e')[2] or 0}")
    first, second = (float(text.replace("−", "-")) for text in (number, other))
    step = 1.001 * exponent * 10.0**-decimals
    return abs(first - second) <= max(step, 1e-6 * abs(second), 1e-12)
