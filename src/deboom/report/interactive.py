"""The page on which designs are changed and a front is explored.

Above, sliders move a design whose levels the page computes itself; below, designs of the run are
brushed, pinned and read. One HTML file with model and data inside, drawn as SVG by scripts of our
own: no library, no network, no server. A reader without scripts gets the run's pictures.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from collections.abc import Sequence
from dataclasses import astuple, dataclass, field
from functools import cache
from importlib.resources import files
from types import SimpleNamespace

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.report.live import LiveModel
from deboom.report.report import Picture, rendered

LEVEL_STEP = 0.01
"""Resolution of the levels in the page [dB]."""
MAX_BYTES = 6_000_000
"""Size of the page that is not exceeded [byte]."""
_MODEL = ("model.js", "live_search.js")
_LIVE = ("live_state.js", "live_sound.js", "live_controls.js", "live_pictures.js", "live_end.js")
_FRONT = ("interactive_state.js", "interactive_pictures.js", "interactive_controls.js")
_BYTES_PER_VALUE = 12
_BYTES_PER_LEVEL = 8 / 3
_PROGRAM = 120_000
_LIVE_PROGRAM = 120_000
_MOST_EVALUATED = 6000


@dataclass(frozen=True, eq=False)
class Axis:
    """A quantity of every design, an axis of the parallel coordinates.

    - `values` (n + m,), `today`: of each design, then of m that were evaluated on the way; of
      today's [`unit`; ``1`` for a factor].
    - `errors` (n,) or None: half of the 95 % interval of each design's value [unit].
    - `colour`: ``#RRGGBB`` of what the axis belongs to; `kind`: variable, objective or vehicle.
    - `limits`: ends of the axis [unit]; None: those of the values and of today's.
    - `stiffness`: what a factor of 1 stands for [N/mm]; nan where it stands for none.
    - `note`: what the reader must know, such as ``no requirement``; may be empty.
    """

    name: str
    unit: str
    values: RealArray
    today: float
    colour: str
    kind: str
    limits: tuple[float, float] | None = None
    stiffness: float = float("nan")
    note: str = ""
    errors: RealArray | None = None


@dataclass(frozen=True, eq=False)
class InteractiveFront:
    """Everything that the page shows.

    - `run`: name of the run; also begins the name of the exported file.
    - `facts`: what the numbers are of, one sentence each.
    - `axes`: variables, objectives, and the mean level of each vehicle in their order.
    - `points`, `picks`: number of each design in the run's tables, and its name or nothing.
    - `frequency`, `speed` (n_frequency,): lines of the curves [Hz] and the engine's speed [rpm].
    - `levels` (1 + n, n_vehicle, n_frequency): SPL without scatter, of today's design first
      [dB(A)].
    - `pictures`: for a reader without scripts.
    - `runs` (n,): 1 for designs of another run beside, 0 for the run's own; empty: all its own.
    - `full_scale`: sound pressure at the loudest that a run-up is played, that of `deboom listen`
      [Pa].
    - `live`: model that the page computes with; None: `not_live` says why there is none.
    - raises InputError: values that are not finite, levels beyond ±300 dB(A), doubled names.
    """

    title: str
    question: str
    run: str
    facts: tuple[str, ...]
    axes: tuple[Axis, ...]
    points: Sequence[int]
    picks: Sequence[str]
    vehicles: tuple[str, ...]
    vehicle_colours: tuple[str, ...]
    frequency: RealArray
    speed: RealArray
    levels: RealArray
    pictures: tuple[Picture, ...] = field(default=())
    runs: Sequence[int] = ()
    full_scale: float = field(kw_only=True)
    live: LiveModel | None = None
    not_live: str = ""

    def __post_init__(self) -> None:
        names = [axis.name for axis in self.axes]
        doubled = sorted({name for name in names if names.count(name) > 1})
        if doubled:
            raise InputError(f"doubled axes {doubled}: every axis needs a name of its own")
        for axis in self.axes:
            if not (np.all(np.isfinite(axis.values)) and math.isfinite(axis.today)):
                raise InputError(f"axis '{axis.name}' has a value that is not finite")
        if not np.all(np.isfinite(self.levels)) or np.max(np.abs(self.levels)) > 300.0:
            raise InputError("a level of the front is not finite or beyond ±300 dB(A)")


def render_interactive(front: InteractiveFront) -> str:
    """Render the page: HTML of at most `MAX_BYTES`, to be saved as UTF-8.

    Texts are escaped: no input can add markup or script. Of a front too large, the picks and evenly
    chosen designs are shown, and the page says so.

    - raises InputError: pictures or lines that leave no room for a single design.
    """
    rows = _shown(front)
    evaluated = _evenly(len(front.axes[0].values) - len(front.points), _MOST_EVALUATED)
    facts = list(front.facts)
    if len(rows) < len(front.points):
        facts.append(
            f"{len(rows)} of the {len(front.points)} designs are shown, evenly along the front and "
            f"with all picks, so that the page stays below {MAX_BYTES // 1_000_000} MB."
        )
    if evaluated:
        facts.append(
            f"All evaluated designs: {len(evaluated)} of {len(front.axes[0].values) - len(rows)}, "
            "with the values that the search saw; they have no curves."
        )
    return _page(front, facts, _json(front, rows, evaluated))


def _page(front: object, facts: Sequence[str], data: str) -> str:
    return rendered(
        "interactive.html",
        front=front,
        facts=facts,
        data=data,
        scripts=_scripts(),
        policy=script_policy(),
        style=_text("live.css"),
        live=_text("live.html"),
    )


@dataclass(frozen=True)
class _Scripts:
    """The program of the page: the same text in every page.

    - `model`: the model, which a worker runs, too.
    - `live`, `front`: the rest of a page with a model, and of one without.
    """

    model: str
    live: str
    front: str


@cache
def _scripts() -> _Scripts:
    parts, front = _text("page_parts.js"), _text(*_FRONT)
    # the live part is one constant, whose names are its own
    live = f"const live = (() => {{\n{_text(*_LIVE)}}})();\n"
    return _Scripts(
        model=_text(*_MODEL),
        live=parts + live + front,
        front=f"{parts}const live = null;\n{front}",
    )


@cache
def script_policy() -> str:
    """Return the Content-Security-Policy under which these scripts run, no others, and offline."""
    digests = " ".join(map(digest_of, astuple(_scripts())))
    return (
        f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {digests}; "
        "worker-src blob:"
    )


def digest_of(text: str) -> str:
    """Return a script or a style as a Content-Security-Policy names it."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def is_interactive(page: str) -> bool:
    """Tell whether a page is this one with other data: it has these scripts and these elements.

    No policy keeps a page from leading elsewhere by itself, as ``<meta http-equiv="refresh">``
    does; so a page that came from elsewhere may run scripts only if it has no element but ours.
    """
    tags = _tags(page)
    return (
        "\0" not in page
        and any("\0" in tag for tag in tags)
        and all(tag in _tags_of_page() or _PICTURE.fullmatch(tag) for tag in tags)
    )


_PICTURE = re.compile(
    r'<img src="data:image/png;base64,[A-Za-z0-9+/=]*" alt="[^"<>]*" width="\d+" height="\d+">'
)


@cache
def _tags_of_page() -> frozenset[str]:
    words = dict.fromkeys(("title", "question", "not_live"), "words")
    models = (None, LiveModel({}, {"none": np.empty(0)}))
    pictures = [Picture(bytes(24), "alt", "caption")]
    fronts = [SimpleNamespace(**words, live=live, pictures=pictures) for live in models]
    return frozenset(tag for front in fronts for tag in _tags(_page(front, ["fact"], "{}")))


def _tags(page: str) -> set[str]:
    """Return all that begins with < up to its end; a script of ours belongs to its element."""
    for script in astuple(_scripts()):
        page = page.replace(f">{script}</script>", "\0>")
    return set(re.findall("<[^<>]*>?", page))


def _text(*names: str) -> str:
    home = files("deboom.report")
    return "".join(home.joinpath(name).read_text(encoding="utf-8") + "\n" for name in names)


def _shown(front: InteractiveFront) -> list[int]:
    """Return the rows that fit into the page: all, or evenly chosen ones and the picks."""
    n, n_vehicles, n_lines = len(front.points), len(front.vehicles), len(front.frequency)
    pictures = sum(len(picture.png) * 4 / 3 for picture in front.pictures)
    evaluated = min(len(front.axes[0].values) - n, _MOST_EVALUATED) * len(front.axes)
    model = front.live.n_bytes + _LIVE_PROGRAM if front.live else 0
    room = MAX_BYTES - _PROGRAM - model - pictures - _BYTES_PER_VALUE * (2 * n_lines + evaluated)
    per_design = (
        _BYTES_PER_LEVEL * n_vehicles * n_lines
        + _BYTES_PER_VALUE * len(front.axes)
        + 4 * _BYTES_PER_VALUE
    )
    most = int(room / per_design) - 1
    named = {row for row, pick in enumerate(front.picks) if pick}
    if most < max(1, len(named)):
        raise InputError(
            f"{n_vehicles} vehicles with {n_lines} lines leave no room for a design in a page of "
            f"{MAX_BYTES // 1_000_000} MB: take a narrower band or fewer vehicles"
        )
    if n <= most:
        return list(range(n))
    return sorted(named | set(_evenly(n, most - len(named))))


def _evenly(n: int, most: int) -> list[int]:
    """Return all of n rows, or as many evenly chosen ones as there may be at most."""
    rows = np.rint(np.linspace(0, n - 1, min(n, most))).astype(int)
    return [int(row) for row in np.unique(rows)]


def _json(front: InteractiveFront, rows: list[int], evaluated: list[int]) -> str:
    """Write the data as JSON that cannot end the script element it stands in."""
    every = [*rows, *(len(front.points) + row for row in evaluated)]
    levels = np.asarray(front.levels)[[0, *(row + 1 for row in rows)]]
    steps = np.rint(levels / LEVEL_STEP).astype("<i2")
    data = {
        "run": front.run,
        "axes": [_axis(axis, rows, every) for axis in front.axes],
        "runs": [int(front.runs[row]) if front.runs else 0 for row in rows],
        "points": [int(front.points[row]) for row in rows],
        "picks": [front.picks[row] for row in rows],
        "vehicles": [
            {"name": name, "colour": colour}
            for name, colour in zip(front.vehicles, front.vehicle_colours, strict=True)
        ],
        "frequency": _numbers(front.frequency),
        "speed": _numbers(front.speed),
        "levelStep": LEVEL_STEP,
        "fullScale": float(f"{front.full_scale:.7g}"),
        "levels": base64.b64encode(steps.tobytes()).decode("ascii"),
    }
    text = json.dumps(data, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _axis(axis: Axis, rows: list[int], every: list[int]) -> dict[str, object]:
    values = np.asarray(axis.values, dtype=float)[every]
    lower, upper = axis.limits or _reach(values[: len(rows)], axis.today)
    return {
        "name": axis.name,
        "unit": axis.unit,
        "kind": axis.kind,
        "colour": axis.colour,
        "note": axis.note,
        "lower": lower,
        "upper": upper,
        "reach": axis.limits or _reach(values, axis.today),
        "today": float(axis.today),
        "stiffness": float(axis.stiffness) if math.isfinite(axis.stiffness) else None,
        "values": _numbers(values),
        "errors": None if axis.errors is None else _numbers(axis.errors[rows]),
    }


def _reach(values: RealArray, today: float) -> tuple[float, float]:
    """Return ends of an axis that shows values and today's; never the same."""
    lower, upper = min(float(values.min()), today), max(float(values.max()), today)
    half = max(abs(lower) * 1e-3, 1e-6) if upper <= lower else 0.0
    return lower - half, upper + half


def _numbers(values: RealArray) -> list[float]:
    return [float(f"{value:.7g}") for value in values]
