"""What differs between two folders that the same steps have written: one line per difference."""

from __future__ import annotations

import difflib
import html
import json
import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

RELATIVE = 1e-9
"""Difference of two numbers that is allowed, over the scale of their column."""

FLOOR = 1e-14
"""Numbers below are zero."""

BLOCKS = "p|h[1-6]|li|tr|div|section|figcaption|summary|title|br|t[dh]|d[dt]"
"""Elements whose words are a line of their own."""

UNSTEADY = re.compile(
    r"(^|[./ _])seconds|wall_time_s|time \[s\]|^environment|^study_text|(^|\.)created"
)
"""Keys and columns that hold times, versions or texts of the source."""

UNCOMPARED = (".lock", "cpu.txt", "steps.txt", "state.npz", "search.json", "inputs.json")
"""Files of the search's and of our own book-keeping: hashes, times, states of generators."""

PROGRESS = re.compile(r"%\||it/s|\x1b|: \d+/\d+( |$)")
"""Lines that tell how far a command is."""

INPUT_FILE = re.compile(r": [0-9a-f]{64}$")
"""Lines of a page that `run.json` has as well."""

_RUN = re.compile(r"\d{4}-\d\d-\d\d_\d{6}_seed(\d+)(_\d+)?")
_PASSING = (
    (re.compile(r"^(git|packages|wall time \[s\]): .*"), r"\1: …"),
    (re.compile(r"^(deboom run \S+|\w+) --seed .*"), r"\1 …"),
    (re.compile(r"\brevision \w+(, changed)?"), "revision …"),
    (re.compile(r"^ +seconds_\w+ .*"), "seconds"),
    (_RUN, r"RUN_seed\1"),
    (re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d)?([.]\d+)?( ?UTC|Z|[+]00:00)?"), "TIME"),
    (re.compile(r"\b\d{4}-\d\d-\d\d\b"), "DATE"),
    (re.compile(r"\b[0-9a-f]{12,64}\b"), "HASH"),
    (re.compile(r"\b\d+([.]\d+)?\s?(s|ms|min|h|seconds?|minutes?)\b(?!/)"), "DURATION"),
    (re.compile(r"\b\d+ of \d+ designs|\b\d+ designs/s"), "RATE"),
    (re.compile(r"(\.\./)+[\w./-]*/work/"), ""),
    (re.compile(r"((\.\./)+[\w./-]*?|TREE/)(?=studies/)"), ""),
    (re.compile(r"studies/data/"), "data/"),
    (re.compile(r"(HERE|TREE)/(?=studies/|data/)"), ""),
    (re.compile(r"tcp://[\w.:]+"), "ADDRESS"),
)


@dataclass(frozen=True)
class Difference:
    """A difference between two trees.

    Parameters
    ----------
    scenario, file, item : str
        Where it is.
    kind : str
        ``number``, ``name`` (a column, key, file or option), ``words``, ``picture`` or ``code``.
    text : str
        What differs, base first.
    size : float
        Of numbers: their difference over the scale of their column.
    """

    scenario: str
    file: str
    item: str
    kind: str
    text: str
    size: float = np.inf

    def __str__(self) -> str:
        return f"{self.scenario}: {self.file}: {self.kind}: {self.item}: {self.text}"


class Map:
    """Deliberate renames and differences, from a TOML file; every entry has its reason.

    ``[[rename]]`` has ``scenario``, ``old``, ``new``, ``reason``: a column, key, option or file.
    ``[[differs]]`` has ``reason`` and any of ``scenario``, ``file``, ``item``, ``kind``, ``text``:
    shell patterns, or lists of them, of what may differ; ``below``: numbers may by this share.
    """

    def __init__(self, path: Path) -> None:
        content = tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
        self.renames = content.get("rename", [])
        self.differs = content.get("differs", [])
        for entry in (*self.renames, *self.differs):
            if not entry.get("reason"):
                raise ValueError(f"{path}: an entry without reason: {entry}")

    def renamed(self, scenario: str, name: str) -> str:
        """Return what the work tree calls a name of the base."""
        for entry in self.renames:
            if entry["old"] in name and _fits(scenario, entry.get("scenario", "*")):
                whole = re.compile(rf"(?<![\w-]){re.escape(entry['old'])}(?![\w-])")
                name = whole.sub(entry["new"], name)
        return name

    def allows(self, difference: Difference) -> bool:
        """Say whether a difference is deliberate."""
        for entry in self.differs:
            fits = all(
                _fits(getattr(difference, key), pattern)
                for key, pattern in entry.items()
                if key not in ("reason", "below")
            )
            if fits and not difference.size > entry.get("below", np.inf):
                return True
        return False


@dataclass
class Side:
    """One tree's results of a scenario, with what stands for its own places in texts."""

    folder: Path
    places: dict[str, str]

    def settled(self, text: str) -> str:
        """Return a text without times, run names and places."""
        for place, name in self.places.items():
            text = text.replace(place, name)
        for pattern, name in _PASSING:
            text = pattern.sub(name, text)
        return text

    def files(self) -> dict[str, Path]:
        """Return the files by a name that does not change from run to run."""
        found: dict[str, Path] = {}
        for path in sorted(self.folder.rglob("*")):
            if path.is_symlink() or not path.is_file() or path.name in UNCOMPARED:
                continue
            name = path.relative_to(self.folder).as_posix()
            name = re.sub(r"work/results/[\w-]+/", "", name)
            name, number = _RUN.sub("run", name), 1
            while name in found:
                number += 1
                name = re.sub(r"^(run\d*)?", f"run{number}", name, count=1)
            found[name] = path
        return found


class Comparison:
    """All differences of one scenario."""

    def __init__(self, scenario: str, absolute: float, base: Side, new: Side, renames: Map) -> None:
        self.scenario, self.absolute, self.renames = scenario, absolute, renames
        self.base, self.new = base, new

    def differences(self) -> Iterator[Difference]:
        """Compare file by file."""
        before = {self._name(name): path for name, path in self.base.files().items()}
        after = self.new.files()
        for name in sorted(before.keys() | after.keys()):
            if name not in after or name not in before:
                gone = name not in after
                yield self._of(name, "-", "name", "file is gone" if gone else "new file")
            elif before[name].read_bytes() != after[name].read_bytes():
                try:
                    yield from self._file(name, before[name], after[name])
                except Exception as error:
                    yield self._of(name, "-", "code", f"cannot be compared ({error!r})")

    def _name(self, name: str) -> str:
        return self.renames.renamed(self.scenario, name)

    def _old(self, value: object) -> str:
        """Return a text of the base as the work tree would have it."""
        return self._name(self.base.settled(str(value)))

    def _of(self, file: str, item: str, kind: str, text: str) -> Difference:
        return Difference(self.scenario, file, item, kind, text)

    def _file(self, name: str, before: Path, after: Path) -> Iterator[Difference]:
        readers: dict[str, Callable[[Path], Any]] = {
            ".json": _json,
            ".toml": lambda path: tomllib.loads(path.read_text(encoding="utf-8")),
            ".npz": lambda path: dict(np.load(path)),
            ".mat": _matlab,
            ".uff": _uff,
            ".xlsx": _workbook,
        }
        if name.endswith("pictures.json"):
            yield from self._pictures(name, _json(before), _json(after))
        elif before.suffix == ".csv":
            yield from self._tables(name, _table(before), _table(after))
        elif before.suffix in readers:
            read = readers[before.suffix]
            yield from self._trees(name, read(before), read(after))
        elif before.suffix in (".html", ".htm"):
            texts = [path.read_text(encoding="utf-8") for path in (before, after)]
            yield from self._words(name, *(page_words(text) for text in texts))
            yield from self._trees(name, *(_page_data(text) for text in texts))
        elif before.suffix == ".out" and "Usage: " in before.read_text(encoding="utf-8")[:200]:
            # without line ends, which cut long paths anywhere
            options = (_options(path.read_text("utf-8")) for path in (before, after))
            yield from self._trees(name, *options, what="option")
        elif before.suffix in (".out", ".err", ".txt", ".md", ".code"):
            yield from self._words(name, *(_lines(path) for path in (before, after)))
        elif before.suffix not in (".png", ".db", ".pdf"):
            yield self._of(name, "-", "number", "other bytes")

    def _tables(self, file: str, before: pd.DataFrame, after: pd.DataFrame) -> Iterator[Difference]:
        before = before.rename(columns=self._name)
        for column in before.columns.difference(after.columns):
            yield self._of(file, column, "name", "column is gone")
        for column in after.columns.difference(before.columns):
            yield self._of(file, column, "name", "new column")
        if len(before) != len(after):
            yield self._of(file, "-", "number", f"{len(before)} rows, now {len(after)}")
            return
        for column in before.columns.intersection(after.columns):
            if not UNSTEADY.search(column):
                yield from self._column(file, column, before[column], after[column])

    def _column(self, file: str, item: str, before: Any, after: Any) -> Iterator[Difference]:
        try:
            numbers = [pd.to_numeric(v).to_numpy(dtype=float) for v in (before, after)]
        except ValueError:
            pairs = [
                (self._old(a), self.new.settled(str(b))) for a, b in zip(before, after, strict=True)
            ]
            unequal = [(row, a, b) for row, (a, b) in enumerate(pairs) if a != b]
            if unequal:
                row, a, b = unequal[0]
                some = f"row {row}: {a!r}, now {b!r} ({len(unequal)} of {len(pairs)} rows)"
                yield self._of(file, item, "words", some)
            return
        yield from self._arrays(file, item, *numbers)

    def _arrays(self, file: str, item: str, a: Any, b: Any) -> Iterator[Difference]:
        """Compare arrays of numbers by their scale."""
        if a.shape != b.shape:
            yield self._of(file, item, "number", f"shape {a.shape}, now {b.shape}")
            return
        if a.dtype.kind not in "fciub" or b.dtype.kind not in "fciub":
            if a.tolist() != b.tolist():
                yield self._of(file, item, "words", f"{a.tolist()!r:.80}, now {b.tolist()!r:.80}")
            return
        a, b = (v.astype(complex if v.dtype.kind == "c" else float).ravel() for v in (a, b))
        finite = np.isfinite(a)
        if (finite != np.isfinite(b)).any():
            yield self._of(file, item, "number", "other places without a value")
            return
        if not finite.any():
            return
        scale = np.abs(a[finite]).max()
        apart = np.abs(a[finite] - b[finite])
        if apart.max() > max(RELATIVE * scale, self.absolute, FLOOR):
            worst = int(np.argmax(apart))
            values = f"{a[finite][worst]:.12g}, now {b[finite][worst]:.12g}"
            where = f" at {worst} of {a.size}" if a.size > 1 else ""
            size = apart.max() / max(scale, FLOOR)
            some = f"{values}{where}: {size:.1e} of the scale"
            yield Difference(self.scenario, file, item, "number", some, float(size))

    def _trees(self, file: str, before: Any, after: Any, what: str = "key") -> Iterator[Difference]:
        """Compare nested mappings and lists."""
        olds, news = (dict(_leaves("", tree)) for tree in (before, after))
        if olds.keys() != news.keys():
            olds = {self._name(self.base.settled(key)): value for key, value in olds.items()}
            news = {self.new.settled(key): value for key, value in news.items()}
        for key in sorted(olds.keys() | news.keys()):
            if UNSTEADY.search(key):
                continue
            if key not in news or key not in olds:
                gone = key not in news
                yield self._of(file, key, "name", f"{what} is gone" if gone else f"new {what}")
                continue
            a, b = olds[key], news[key]
            if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
                yield from self._arrays(file, key, a, b)
            elif str(a) != str(b) and self._old(a) != self.new.settled(str(b)):
                yield self._of(file, key, "words", f"{a!r:.100}, now {b!r:.100}")

    def _words(self, file: str, before: list[str], after: list[str]) -> Iterator[Difference]:
        a = [self._old(line) for line in before]
        b = [self.new.settled(line) for line in after]
        for tag, i, j, k, m in difflib.SequenceMatcher(None, a, b, autojunk=False).get_opcodes():
            if tag != "equal":
                old, new = " / ".join(a[i:j]), " / ".join(b[k:m])
                yield self._of(file, f"line {i + 1}", "words", f"{old!r:.200}, now {new!r:.200}")

    def _pictures(self, file: str, before: Any, after: Any) -> Iterator[Difference]:
        # two lists of pictures in one order: by their labels
        pairs = (
            sorted(pictures, key=lambda picture: str([axes["labels"] for axes in picture["axes"]]))
            for pictures in (before, after)
        )
        for difference in self._trees(file, *pairs):
            if ".view" not in difference.item:
                yield replace(difference, kind="picture")


def _fits(name: str, patterns: str | list[str]) -> bool:
    """Say whether a name fits a shell pattern, or one of several."""
    return any(fnmatch(name, pattern) for pattern in np.atleast_1d(patterns))


def page_words(text: str) -> list[str]:
    """Return the visible words of a page, a line per block."""
    text = re.sub(r"(?is)<(script|style|svg)\b.*?</\1>", " ", text)
    text = re.sub(r"(?i)</(th|dt)>\s*<(td|dd)\b[^>]*>", ": ", text)
    text = re.sub(rf"(?i)</?({BLOCKS})\b[^>]*>", "\n", text)
    text = html.unescape(re.sub(r"(?s)<[^>]+>", "", text))
    lines = (" ".join(line.split()) for line in text.splitlines())
    return [line for line in lines if line and not INPUT_FILE.search(line)]


def _page_data(text: str) -> list[Any]:
    """Return the data that a page's scripts read."""
    found = re.findall(r"(?is)<script[^>]*application/json[^>]*>(.*?)</script>", text)
    return [json.loads(html.unescape(part)) for part in found]


def _options(text: str) -> dict[str, str]:
    """Return what a help text says of every option, without blanks, and of the command itself."""
    parts = re.split(r"\n +(--[\w-]+)", text)
    names, texts = ["usage", *parts[1::2]], parts[::2]
    return {n: re.sub(r"\s+", "", t) for n, t in zip(names, texts, strict=True)}


def _lines(path: Path) -> list[str]:
    """Return the lines of a text without progress bars."""
    text = path.read_bytes().decode("utf-8", "replace")
    lines = re.split(r"[\r\n]+", text)
    if any(line.startswith("Traceback") for line in lines):
        lines = [line for line in lines if not line.startswith((" ", "Traceback"))]
    return [line.rstrip() for line in lines if line.strip() and not PROGRESS.search(line)]


def _json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def _table(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, dtype=str)


def _uff(path: Path) -> Any:
    import pyuff

    sets = pyuff.UFF(str(path)).read_sets()
    return [
        {k: v for k, v in content.items() if not re.search(r"date|time_db|^id5$", k)}
        for content in (sets if isinstance(sets, list) else [sets])
    ]


def _matlab(path: Path) -> Any:
    import scipy.io

    return {k: v for k, v in scipy.io.loadmat(path).items() if not k.startswith("__")}


def _workbook(path: Path) -> Any:
    import openpyxl

    book = openpyxl.load_workbook(path, data_only=False)
    found: dict[str, Any] = {}
    for sheet in book:
        for number, cells in enumerate(sheet.iter_cols(values_only=True)):
            kinds = [isinstance(value, int | float) for value in cells]
            for name, wanted in (("numbers", True), ("texts", False)):
                values = [v for v, k in zip(cells, kinds, strict=True) if k is wanted]
                found[f"{sheet.title}.{number}.{name}"] = [v for v in values if v is not None]
    return found


def _leaves(prefix: str, tree: Any) -> Iterator[tuple[str, Any]]:
    """Flatten mappings and lists; lists of numbers and numbers become arrays."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from _leaves(f"{prefix}.{key}" if prefix else str(key), value)
    elif isinstance(tree, list | tuple):
        try:
            array = np.array(tree)
        except ValueError:
            array = np.array(None)
        if array.dtype.kind in "fiub" and array.size:
            yield prefix, array
        else:
            for number, value in enumerate(tree):
                yield from _leaves(f"{prefix}[{number}]", value)
    elif isinstance(tree, np.ndarray | bool) or not isinstance(tree, int | float | np.number):
        yield prefix, tree
    else:
        yield prefix, np.array(tree)
