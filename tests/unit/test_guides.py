"""The guides, followed literally: own platform, own data, contributing, specification."""

import ast
import json
import re
import runpy
import shlex
import sys
import tomllib
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from typer.main import get_command

import deboom
from command_line import call
from deboom.bench import example
from deboom.cli import StudyCommand, app
from deboom.files.acceptance import read_delivered_parts
from deboom.files.design_limits import read_level_limits
from deboom.files.folders import new_folder
from deboom.files.kinds import FolderKind
from deboom.files.platform import LoadCaseEntry, VehicleEntry
from deboom.files.rows import PlacedImpact
from deboom.files.supplier_words import WORDS
from deboom.files.tables import read_table
from deboom.files.time_data import WavChannel
from deboom.files.units import parse_unit
from deboom.mounts.response_surface import KelvinVoigtModel, StiffnessSamples
from deboom.pages import live_model
from deboom.pages.front import CELLS, PANELS
from deboom.physics.sound_level import a_weighting
from deboom.plot import levels
from deboom.report import interactive, live
from deboom.runs.runner import load_study
from deboom.tabled import MOST_ROWS
from deboom.vehicles.receivers import Receiver

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "guides" / "your-own-platform.md"
pytestmark = pytest.mark.usefixtures("no_pictures", "few_chains")


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.S)


def text_of(name):
    return GUIDE.with_name(f"{name}.md").read_text(encoding="utf-8")


def figures_in(text, pattern):
    """Return what the groups of a pattern say in a text whose lines may break anywhere."""
    return re.search(pattern, " ".join(text.split())).groups()


def run_blocks(text, names):
    """Run the Python of a guide, or of a part of it, with the names of what ran before."""
    for block in blocks(text, "python"):
        exec(compile(block, "guide.md", "exec"), names)


def commands():
    return "".join(blocks(text_of("your-own-platform"), "sh")).splitlines()


def test_the_guide_shows_what_the_check_prints(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    new, check, write, again = commands()[:4]
    call(*shlex.split(new)[1:])
    faults = call(*shlex.split(check, comments=True)[1:], code=2).stderr
    guide = GUIDE.read_text(encoding="utf-8")
    for line in re.findall(r"^ {1,2}\d+  .*", guide, flags=re.M):
        assert line in faults
    assert write == "deboom example example"
    written = new_folder(Path("example/platform"), FolderKind.platform, example.PLATFORM)
    example.fill_platform(written)
    assert call(*shlex.split(again)[1:]).stdout.strip() in guide


def test_the_guide_to_seats_states_keys_and_limits_that_are_taken(tmp_path):
    every = blocks(text_of("seats-and-idle"), "toml")
    receivers, _, case, _ = (tomllib.loads(block) for block in every)
    vehicle = VehicleEntry(
        name="U06-1",
        group="U06",
        noise_transfer="noise_transfer/U06-1.uff",
        receivers=receivers["vehicles"]["receivers"],
    )
    assert [entry.name for entry in vehicle.receivers] == ["driver ear", "rear ear", "seat rail z"]
    (entry,) = case["load_cases"]
    assert LoadCaseEntry(**entry).is_idle
    names = ("U06-1", "U06-1, rear ear", "U06-1, seat rail z")
    seat = Receiver("seat rail z", "acceleration", "Wk", target=vehicle.receivers[2].target_db)
    model = SimpleNamespace(
        response_names=names,
        response_unit=f"dB(A), dB(A), {seat.level_unit}",
        receivers=(Receiver(), Receiver("rear ear"), seat),
        n_lines=161,
        idle=("a run",),
    )
    for block, at_most in ((every[1], 161 * 80.0), (every[3], "today")):
        path = tmp_path / "limits.toml"
        path.write_text(block, encoding="utf-8")
        (limit,) = read_level_limits(path, model)
        assert limit.at_most == at_most
        assert limit.number.name.endswith("U06-1, seat rail z")


def test_a_foreign_response_gets_a_front_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("example").symlink_to(example.DATA)
    names = {}
    run_blocks(text_of("from-modefrontier").partition("## Responses from an Excel table")[2], names)
    front = deboom.search(names["robust"], population=20, generations=30)
    slopes = np.array([[6.5, 1.5, -2.0], [4.0, 5.5, 0.5]])
    values = names["robust"](np.ones((1, 3)))
    assert values.mean[0] == pytest.approx([62.4, 64.1], abs=1e-2)
    # a linear response of independent factors, sigma a third of ±15 %, cut at 3 sigma
    assert values.sigma[0] == pytest.approx(0.05 * np.linalg.norm(slopes, axis=1), rel=0.05)
    # its best-mean lies in a corner: 0.8, 0.8 and 1.2
    best = front.pick_designs["best-mean"]
    assert best == pytest.approx([0.8, 0.8, 1.2], abs=5e-3)


def test_the_guide_shows_the_limits_of_the_example():
    (block,) = blocks(TEXT, "toml")
    assert block == (example.DATA / "limits.toml").read_text(encoding="utf-8")


OWN_DATA = Path(__file__).parents[2] / "docs" / "guides" / "your-own-data.md"
SECTIONS = dict(
    re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", OWN_DATA.read_text("utf-8"), re.M | re.S)
)


@pytest.mark.slow("strikes a compressor, and estimates functions and modes of every hit")
def test_the_python_of_hammer_and_modal_test_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call("bench", "compressor", "example_hits", "--hits")
    call("example", "example")
    lines = "".join(blocks(SECTIONS["Hammer test"] + SECTIONS["Modal test"], "python"))
    values = {}
    exec(lines, values)
    assert values["body"].motion.shape == (len(values["clusters"]), 24, 3)
    assert len(read_table(Path("positions.xlsx"), PlacedImpact)) == 18
    assert values["estimate"].frf.values.shape[1:] == (18, 18)
    assert len(values["clusters"]) >= 4  # rubber damps the modes of the rigid body alike
    assert all(0.05 < mode.damping < 0.12 for mode in values["clusters"])
    assert len(values["modes"].table) == len(values["clusters"])


def test_the_calibration_of_the_guide_is_read(tmp_path):
    (tmp_path / "run.csv").write_text(blocks(SECTIONS["Campaign"], "text")[0])
    rows = read_table(tmp_path / "run.csv", WavChannel)
    assert [(row.channel, row.full_scale) for row in rows] == [
        ("A1 x", 500.0),
        ("driver ear", 20.0),
    ]


DOCS = Path(__file__).parents[2] / "docs"


def shown(name):
    return runpy.run_path(str(DOCS / "guides" / f"example_{name}.py"))


def test_the_figure_takes_axes_and_refuses_nan():
    draw = shown("figure")["level_over_factor"]
    _, axes = plt.subplots()
    assert draw([0.9, 1.0], [60.0, 61.0], ax=axes) is axes
    plt.close("all")
    with pytest.raises(deboom.InputError, match="level"):
        draw([0.9, 1.0], [60.0, np.nan])


def test_the_format_reads_what_numpy_wrote_and_refuses_the_rest(tmp_path):
    read = shown("format")["from_npz"]
    good = {
        "frequency": np.array([20.0, 21.0]),
        "names": np.array(["TSM x", "TSM z"]),
        "values": np.array([[1j, 2.0], [3.0, 4.0]]),
        "units": np.array(["Pa/N", "Pa/N"]),
    }
    np.savez(tmp_path / "car.npz", **good)
    table = read(tmp_path / "car.npz")
    unit, values = table.spectrum("TSM x")
    assert (unit, values.tolist()) == (parse_unit("Pa/N"), [1j, 3.0])
    assert table.frequency.tolist() == [20.0, 21.0]
    damaged = {
        "short": (good | {"values": good["values"][:1]}, "do not fit together"),
        "nameless": ({k: v for k, v in good.items() if k != "names"}, "no array 'names'"),
        "pickled": (good | {"names": np.array([{}, {}])}, "an array of objects"),
    }
    for name, (content, sentence) in damaged.items():
        np.savez(tmp_path / f"{name}.npz", **content)
        with pytest.raises(deboom.InputError, match=sentence):
            read(tmp_path / f"{name}.npz")
    (tmp_path / "text.npz").write_text("frequency", encoding="utf-8")
    with pytest.raises(deboom.InputError, match="File is not a zip file"):
        read(tmp_path / "text.npz")


def test_the_mount_model_finds_its_own_law_and_is_compared():
    model = shown("mount_model")["HystereticModel"](preload_unit="N m")
    rng = np.random.default_rng(1)
    points = rng.uniform([0, 1e-5, 20], [800, 5e-4, 80], (400, 3))
    stiffness = 2e5 * (1 + (points[:, 0] / 800) ** 2) * (1 + 0.12j)
    halves = [StiffnessSamples(*points[k::2].T, stiffness[k::2]) for k in (0, 1)]
    others = {"Kelvin-Voigt": KelvinVoigtModel(preload_unit="N m")}
    table = deboom.compare_models({"hysteretic": model} | others, *halves).set_index("model")
    assert table.loc["hysteretic", "rms error [%]"] < 1e-6
    assert table.loc["Kelvin-Voigt", "rms error [%]"] > 1
    model.fit(points, stiffness)
    assert model.loss_factor_ == pytest.approx(0.12)


SPECIFICATION = ROOT / "docs" / "guides" / "from-front-to-specification.md"
TEXT = SPECIFICATION.read_text(encoding="utf-8")
STUDIES = (
    "front",
    "solution_box",
    "tolerance_allocation",
    "commonality",
    "measured_uncertainty",
)


def options_of(words):
    """Return the options that a command of deboom has, those of its study included."""
    command = get_command(app).commands[words[1]]
    command = command.loaded() if isinstance(command, StudyCommand) else command
    of_command = {name for parameter in command.params for name in parameter.opts}
    if words[1] != "run":
        return of_command
    study = load_study(ROOT / words[2] if words[2].endswith(".py") else words[2])
    names = {name.replace("_", "-"): entry.default for name, entry in study.parameters.items()}
    switched_off = {f"--no-{name}" for name, default in names.items() if isinstance(default, bool)}
    return of_command | {f"--{name}" for name in names} | switched_off


def test_every_option_in_the_text_exists_somewhere():
    options = set().union(*(options_of(["deboom", "run", f"studies/{s}.py"]) for s in STUDIES))
    options |= options_of(["deboom", "report"]) | options_of(["deboom", "accept"])
    named = set(re.findall(r"`(--[a-z-]+)", TEXT))
    assert len(named) > 8
    assert named <= options


def test_every_key_in_the_text_is_on_the_page_of_keys(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    docs = import_module("keys_of_summaries").table()
    sys.modules.pop("keys_of_summaries")
    keys = set(re.findall(r"`([a-z0-9]+_[a-z0-9_]+)`", TEXT)) - set(STUDIES)
    assert len(keys) > 6
    assert {key for key in keys if key not in docs} == set()


def test_the_filled_sheet_is_the_delivery_that_the_guide_tells_of():
    required = {
        "EnM": ("x", "y", "z"),
        "GeM": ("x", "y", "z"),
        "TSM": ("x", "y", "z"),
        "Du": ("x",),
    }
    parts = read_delivered_parts(example.DATA / "delivered_parts.csv", required)
    counts = {}
    for part in parts:
        name = f"{part.mount} {part.batch}"
        counts[name] = counts.get(name, 0) + 1
    told = dict(re.findall(r"^\| ((?:TSM|Du) \w\d) \| (\d+) \|", TEXT, flags=re.M))
    assert {name: str(count) for name, count in counts.items()} == told


MOST_LINES = {
    "Robust front of three objectives": 10,
    "Designs out, to be filled in": 3,
    "Designs that were evaluated, out and in": 3,
    "Is one front better": 3,
    "A run, saved and read": 3,
    "A model that takes minutes": 3,
}
"""Lines that a user of pymoo and of modeFRONTIER accepts for each task, without imports."""
ONE_MORE = {
    "A limit:",
    "Weights of the responses:",
    "Scatter of each variable",
    "Designs to begin with",
    "Another algorithm of pymoo",
    "An end of the search",
    "Progress as a line",
    "A search that may be interrupted",
    "A Dask cluster",
}
"""Tasks that take one line more, beside the call that gets another argument."""


def part_of_python_guide(begin):
    """Return the part of the guide for users of Python whose heading begins so."""
    parts = text_of("for-python-users").split("\n## ")
    return next(part for part in parts if part.startswith(begin))


def lines_of(block):
    return [line for line in block.splitlines() if line and "import" not in line]


@pytest.mark.slow("runs every block of the guide with its own budgets")
def test_tasks_of_a_pymoo_user_run_in_their_lines(tmp_path, monkeypatch):
    """Every block of the guide runs, and none has more lines than its user accepts."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.chdir(tmp_path)
    names, counted = {}, set()
    with distributed.LocalCluster(
        n_workers=1,
        processes=False,
        protocol="tcp://",
        dashboard_address=":0",
        host="127.0.0.1",
    ) as cluster:
        for part in part_of_python_guide("Tasks").split("\n### "):
            run_blocks(part.replace("tcp://node7:8786", cluster.scheduler_address), names)
            title, _, count = part.splitlines()[0].partition(": ")
            if title in MOST_LINES:
                (block,) = blocks(part, "python")
                stated = int(count.split()[0])
                assert len(lines_of(block)) == stated <= MOST_LINES[title], title
                counted.add(title)
            elif title.startswith("One more line"):
                for task in ONE_MORE:
                    block = blocks(part.partition(f"\n{task}")[2], "python")[0]
                    made = [ast.unparse(line) for line in ast.parse(block).body]
                    calls = re.compile(r"deboom\.(Robust|search)\(|import ")
                    assert len([line for line in made if not calls.search(line)]) <= 1, task
                    counted.add(task)
                assert len(blocks(part, "python")) == len(ONE_MORE)
    assert counted == {*MOST_LINES, *ONE_MORE}
    assert "nearest-to-ideal" in names["front"].picks
    assert len(names["limited"].limits) == 1
    assert names["again"].doe.n_failed == 0
    one = deboom.search(names["robust"], population=12, generations=2)
    np.testing.assert_array_equal(names["dask"].values.objectives, one.values.objectives)
    begun = names["more"].search.evaluated.designs[: len(names["front"].values)]
    np.testing.assert_array_equal(begun, names["front"].values.designs)
    assert (tmp_path / "my_search" / "seed1" / "search.json").is_file()
    assert names["front"].nondominated[names["row"]]
    assert names["nsga3"].search.algorithm == "NSGA-III"
    # a quick machine ends by its generations
    assert names["short"].search.stopped.endswith(("ended after 1 s", "100 generations"))
    assert "what would decide" in names["verdict"] or "real" in names["verdict"]
    assert not names["costly"].table.empty


@pytest.mark.usefixtures("plain_loops")
def test_the_same_task_in_both_gives_the_same_numbers():
    names, sections = {}, part_of_python_guide("One task").split("\n### ")[1:]
    for section in sections:
        foreign = section.startswith("Testlab") or bool(blocks(section, "text"))
        assert ("not run here" in section) == foreign
        run_blocks(section, names)
        if section.startswith("modeFRONTIER"):
            sums = names["front"].table["SPLV mean sum [dB(A)]"]
            assert 121.0 < sums.min() < names["robust"](np.ones((1, 2))).mean.sum()
        elif section.startswith("Testlab"):
            shares = names["paths"].table["share of the energy [%]"]
            assert shares.sum() == pytest.approx(100)
            assert shares[0] == shares.max()
        elif section.startswith("pyFBS"):
            assert names["assembly"].receptance == pytest.approx(names["by_hand"], rel=1e-9)
        elif section.startswith("SALib"):
            total = names["sobol"].table["total [1]"].to_numpy()
            assert total == pytest.approx(names["indices"]["ST"], rel=1e-9)
            assert names["indices"]["ST"] == pytest.approx([0.558, 0.442, 0.244], abs=0.01)
        else:
            same = names["front"].searched.objectives.min(axis=0)
            assert same == pytest.approx(names["result"].F.min(axis=0))
    assert len(sections) == 5


@pytest.mark.usefixtures("plain_loops")
def test_a_python_user_runs_the_lines_of_the_guide():
    names = {}
    run_blocks(part_of_python_guide("# For users"), names)
    assert not names["front"].table.empty


MEASURED = [
    (
        "from-front-to-specification",
        r"is ([\d.]+) to ([\d.]+) dB per line quieter",
        "mean level of the lines, U06-1…5, best-mean, seed 1 (figure 47) [dB]",
        lambda numbers: (min(-n for n in numbers), max(-n for n in numbers)),
    ),
    (
        "from-front-to-specification",
        r"`cost_ratio_to_uniform` is ([\d.]+): the same σ for (\d+) %",
        "cost of the cheapest tolerances over one tolerance everywhere, same σ",
        lambda numbers: (numbers[0], 100 * numbers[0]),
    ),
    (
        "from-front-to-specification",
        r"\*\*(\d+) keep each vehicle within 0.5 dB\*\*",
        "part numbers for 15 vehicles within 0.5 dB of mounts of their own",
        list,
    ),
    (
        "component-tpa",
        r"blocked forces are ([\d.]+) % off",
        "blocked forces and moments on trusted lines against the truth",
        list,
    ),
    (
        "component-tpa",
        r"\((\d+) % of all\), the level",
        "trusted lines, 20 benches [%]",
        list,
    ),
    (
        "component-tpa",
        r"at sensors left out ([\d.]+) dB",
        "sensors left out, predicted over measured",
        list,
    ),
    (
        "component-tpa",
        r"of forces in (\d+) %, of the sound in (\d+) %",
        "90 % intervals that hold the truth, all of 20 benches",
        list,
    ),
]
"""Guide, its figures, the claim of the page of validation that measures them, first ones first."""


@pytest.mark.parametrize(("guide", "pattern", "claim", "of"), MEASURED)
def test_a_figure_of_a_guide_is_that_which_validation_measured(guide, pattern, claim, of):
    """A figure that a run gives otherwise fails here, once `make validate` has measured it."""
    page = (DOCS / "validation.md").read_text(encoding="utf-8")
    (row,) = [line for line in page.splitlines() if line.startswith(f"| {claim}")]
    cells = re.split(r"(?<!\\)\|", row)
    numbers = [float(n) for n in re.findall(r"[-−]?\d+(?:\.\d+)?", cells[3].replace("−", "-"))]
    said_figures = figures_in(text_of(guide), pattern)
    for said, measured in zip(said_figures, of(numbers)[: len(said_figures)], strict=True):
        digits = len(said.partition(".")[2])
        assert said == f"{measured:.{digits}f}", (said, measured)


QUOTED = [
    (r"they would need (\d+) part numbers", "part_numbers_own"),
    (r"\*\*(\d+) keep each vehicle within 0.5 dB", "part_numbers_min"),
    (r"part_numbers_lower_bound`\)\. Sharing costs ([\d.]+) dB", "price_db"),
    (r"in the mean and ([\d.]+) dB in the worst", "price_worst_db"),
    (r"in the worst vehicle, ([\w-]+) ", "price_worst_vehicle"),
    (r"its worst vehicle ([\d.]+) dB", "one_set_price_worst_db"),
    (r"\((\d+) part numbers\) still", "group_sets_part_numbers"),
    (r"part numbers\) still ([\d.]+) dB", "group_sets_price_worst_db"),
]


@pytest.mark.parametrize(("pattern", "key"), QUOTED)
def test_a_figure_of_a_guide_is_that_of_the_run_it_quotes(pattern, key):
    """`tests/golden/quoted_runs.json` has the summaries of the runs, by the command."""
    path = ROOT / "tests" / "golden" / "quoted_runs.json"
    value = json.loads(path.read_text(encoding="utf-8"))["deboom run commonality"][key]
    (said,) = figures_in(TEXT, pattern)
    digits = len(said.partition(".")[2])
    assert said == (value if isinstance(value, str) else f"{value:.{digits}f}")


SHOWN = {"6. What the supplier gets": "supplier_sheet", "7. Deliveries": "accept"}
"""Sections of the guide to a specification, and the page whose numbers their tables show."""
FIGURE = re.compile(r"(?<![\w.])\d+(?:\.\d+)?")


def figures_of_page(name):
    """Numbers of a page that `make pictures` has kept."""
    text = (ROOT / "tests" / "golden" / "quoted" / f"{name}.txt").read_text(encoding="utf-8")
    return [float(figure) for figure in FIGURE.findall(text)]


def stands_in(said, figures):
    return any(f"{figure:.{len(said.partition('.')[2])}f}" == said for figure in figures)


@pytest.mark.parametrize(("section", "page"), SHOWN.items())
def test_every_number_of_a_table_stands_on_the_page_that_it_shows(section, page):
    """After a change that moves numbers: `make pictures`, then correct the guide."""
    (text,) = re.findall(rf"^## {section}\n(.*?)(?=^## |\Z)", TEXT, re.M | re.S)
    rows = [line for line in text.splitlines() if line.startswith("| ")][1:]
    assert len(rows) >= 4
    figures = figures_of_page(page)
    strange = {row: [n for n in FIGURE.findall(row) if not stands_in(n, figures)] for row in rows}
    assert {row: numbers for row, numbers in strange.items() if numbers} == {}


PROSE = [
    (r"all bands give −([\d.]+) dB", "supplier_sheet"),
    (r"and only (\d+) % of the cars", "accept"),
    (r"may be as low as (\d+) % for K3", "accept"),
    (r"share of (\d+) parts that the search has not seen", "solution_box"),
]


@pytest.mark.parametrize(("pattern", "page"), PROSE)
def test_a_number_of_a_sentence_stands_on_the_page_that_it_tells_of(pattern, page):
    (said,) = figures_in(TEXT, pattern)
    assert stands_in(said, figures_of_page(page))


LIMITS = [
    ("large-fleets", r"\| picture \| up to (\d+) vehicles", PANELS),
    ("large-fleets", r"all \| the (\d+) that gain least", PANELS),
    ("large-fleets", r"the (\d+) vehicles that a stiffness changes most", PANELS),
    ("large-fleets", r"(\d+) to a row, at most", PANELS),
    ("large-fleets", r"to a row, at most (\d+)", CELLS),
    ("large-fleets", r"the same within (\d+) inches", levels._TALLEST),
    ("large-fleets", r"more than (\d+ 000) rows", MOST_ROWS),
    ("large-fleets", r"stays below (\d+) MB", interactive.MAX_BYTES / 1e6),
    ("large-fleets", r"front and (\d \d+) evaluated designs", interactive._MOST_EVALUATED),
    ("large-fleets", r"model in the page may take (\d+) MB", live.MAX_MODEL_BYTES / 1e6),
    ("live-page", r"model of more than (\d+) MB", live.MAX_MODEL_BYTES / 1e6),
    ("live-page", r"at most (\d+) draws", live_model.MOST_DRAWS),
]
"""Guide, its figure, and the constant of the code that it tells of."""


@pytest.mark.parametrize(("guide", "pattern", "constant"), LIMITS)
def test_a_limit_in_a_guide_is_that_of_the_code(guide, pattern, constant):
    (said,) = figures_in(text_of(guide), pattern)
    assert float(said.replace(" ", "")) == constant


@pytest.mark.parametrize(
    ("page", "language"), [("for-mount-suppliers", "en"), ("fuer-lagerlieferanten", "de")]
)
def test_suppliers_read_about_columns_in_the_words_of_their_sheet(page, language):
    on_the_sheet = {part for word in WORDS.values() for part in getattr(word, language).split(", ")}
    table = text_of(page).split("|---|---|\n")[1].split("\n\n")[0].replace(r"\|", "¦")
    columns = re.findall(r"^\| (.*?) \|", table, flags=re.M)
    terms = {term for column in columns for term in re.split("[,;] ", column.replace("¦", "|"))}
    assert len(columns) == 8
    assert terms <= on_the_sheet


def test_the_sheet_of_the_guide_has_the_state_and_stiffness_of_the_pinned_one():
    page = (ROOT / "tests/golden/pages/supplier_en.txt").read_text(encoding="utf-8")
    cells = {cell.strip() for line in page.splitlines() for cell in line.split("|")}
    force = re.search(r"\| state \| (−\d+) N", TEXT)[1]
    today = re.search(r"today (\d+) N/mm", TEXT)[1]
    assert {force, today} <= cells


def test_the_a_weighting_on_the_page_of_levels_is_that_of_the_code():
    page = (DOCS / "theory" / "levels.md").read_text(encoding="utf-8").replace("−", "-")
    at_30, at_100 = map(
        float, figures_in(page, r"At 30 Hz it is ([-.\d]+) dB, at 100 Hz ([-.\d]+) dB")
    )
    assert a_weighting([30.0, 100.0]).round(1).tolist() == [at_30, at_100]
