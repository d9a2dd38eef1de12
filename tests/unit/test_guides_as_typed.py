"""Every shell block of README, docs and guides works as it is printed, after `pip install`.

A page begins in an empty folder. A study that takes long reads its files and builds its model, and
then gets a finished run that tests share in place of its own.
"""

import re
import shlex
import shutil
from functools import partial
from itertools import count
from pathlib import Path

import pytest

from command_line import call
from deboom.bench import campaign, example
from deboom.explore import selection
from deboom.explore.largest_box import BoxEffort, largest_box
from deboom.runs import runner
from deboom.runs.runner import load_study
from deboom.supplier import numbers as supplier_numbers
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.expected_change import N_DRAWS, Information

ROOT = Path(__file__).parents[2]
EXAMPLE_RUN = ROOT / "results" / "sensitivity" / "example"
pytestmark = pytest.mark.usefixtures("no_pictures", "few_chains")
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```", re.MULTILINE | re.DOTALL)
TEXTS = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
}
FOR_THEMSELVES = "docs/guides/your-own-data.md"
"""Page whose sections do not need each other."""
for section in re.split("^## ", TEXTS.pop(FOR_THEMSELVES), flags=re.MULTILINE):
    TEXTS[f"{FOR_THEMSELVES}: {section.partition(chr(10))[0]}"] = section
BLOCKS = {page: BLOCK.findall(text) for page, text in TEXTS.items()}
SLOW = {
    FOR_THEMSELVES: "writes a folder of each kind as the virtual bench measures it",
    "docs/guides/seats-and-idle.md": "writes and reads fifteen cars with receivers and idle",
    "docs/guides/compressors.md": "measures, identifies and searches compressors",
    "docs/guides/from-bench-to-front.md": "characterises a campaign twice, and writes a platform",
}
TYPED = [
    pytest.param(page, marks=[pytest.mark.slow(SLOW[key]) for key in SLOW if page.startswith(key)])
    for page, blocks in BLOCKS.items()
    if any(kind == "sh" for kind, _ in blocks)
]
WITH_PYTHON = ["docs/guides/from-modefrontier.md", "docs/guides/from-bench-to-front.md"]
"""Pages whose Python and commands need what the other has written."""
EXIT_CODE = re.compile(r"# exit code (\d)")
FOR_SUPPLIERS = ("docs/guides/for-mount-suppliers.md", "docs/guides/fuer-lagerlieferanten.md")
OF_THE_CUSTOMER = dict.fromkeys(
    FOR_SUPPLIERS, ("deboom run front", "deboom run solution_box --front front/latest")
)
"""Commands that somebody else has typed before the reader of a page."""
BUDGET = {
    "solution_box": {"motion": Motion.prescribed},
    "tolerance_allocation": {"generations": 1, "population": 8, "samples": 8, "checks": 64},
    "compressor_front": {"generations": 2, "population": 8, "samples": 8, "checks": 32, "n": 16},
    "commonality": {"motion": Motion.prescribed, "group": ["U06"], "starts": 1},
}
"""Options of the runs whose results other commands read."""
FRONT = {"solution_box": "front", "tolerance_allocation": "from_run"}
"""Option by which such a run names the shared front."""


@pytest.fixture
def light_bench(monkeypatch, made_once):
    """Measure few runs, at a low sampling rate, and write the example once for all pages."""
    written = made_once("example", example.write_example)
    monkeypatch.setattr(
        example, "write_example", lambda folder, _: shutil.copytree(written, folder)
    )
    few = partial(campaign.CampaignPlan, runs=campaign.TRAINING_RUNS[::9], shaker_repeats=1)
    monkeypatch.setattr("deboom.bench.campaign.CampaignPlan", few)
    slow = partial(campaign.TimeRunPlan, sample_rate=2048.0)
    monkeypatch.setattr("deboom.bench.campaign.TimeRunPlan", slow)


def as_installed(run, folder):
    """Copy a run of a clone, whose record names the demonstration by its path in the clone."""
    shutil.copytree(run, folder)
    record = folder / "run.json"
    text = record.read_text(encoding="utf-8").replace("studies/data/u06_f39_f45", "u06")
    record.write_text(text, encoding="utf-8")
    return folder


@pytest.fixture
def shared_runs(monkeypatch, made_once, front_run):
    """Give each study of `deboom run` a finished run in place of a search."""
    numbers, run_study = count(1), runner.run_study
    box = load_study("solution_box").module
    effort = BoxEffort(
        starts=1, coarse=((0.5, 256),), fine=((0.15, 512),), calibration=4096, verification=4096
    )
    monkeypatch.setattr(box, "largest_box", partial(largest_box, effort=effort))
    monkeypatch.setattr(box, "POPULATION", 20)
    monkeypatch.setattr(box, "GENERATIONS", 1)
    monkeypatch.setattr(selection._Goal, "descend", lambda _goal, _name, start: start)
    monkeypatch.setattr(supplier_numbers, "REPETITIONS", 40)
    monkeypatch.setitem(N_DRAWS, Information.unknown, 16)

    front = made_once("guide_front", partial(as_installed, front_run))

    def finished(study):
        if study.name in BUDGET:
            of_front = {FRONT[study.name]: front} if study.name in FRONT else {}
            options = BUDGET[study.name] | of_front
            return made_once(f"guide_{study.name}", lambda out: run_study(study, out, options))
        return {"front": front, "sensitivity": EXAMPLE_RUN}.get(study.name)

    for name in ("solution_box", "tolerance_allocation", "commonality"):
        finished(load_study(name))  # here, not in the first test that asks for it

    def run(study, out, arguments):
        if study.positional or study.path.parent != Path(runner.shipped_studies()):
            return run_study(study, out, arguments)
        study.model(arguments)
        folder = Path(out) / study.name / f"2026-01-01_{next(numbers):06d}_seed1"
        if source := finished(study):
            as_installed(source, folder)
        else:
            folder.mkdir(parents=True)
        return folder

    monkeypatch.setattr(runner, "run_study", run)


def type_line(line):
    """Type a command, which must end with the exit code that its comment states, or with 0."""
    program, *words = shlex.split(line, comments=True)
    if program == "pip":
        assert words[0] == "install"
        assert words[1].startswith("deboom")
        return
    assert program == "deboom", line
    stated = EXIT_CODE.search(line)
    call(*words, code=int(stated[1]) if stated else 0)


@pytest.mark.parametrize("page", TYPED)
@pytest.mark.usefixtures("light_bench", "shared_runs")
def test_every_line_works_in_an_empty_folder(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copyfile(ROOT / "docs/guides/example_study.py", "my_study.py")  # what contributing shows
    for line in OF_THE_CUSTOMER.get(page, ()):
        type_line(line)
    names = {}
    for kind, block in BLOCKS[page]:
        if kind == "sh":
            for line in block.splitlines():
                type_line(line)
        elif page in WITH_PYTHON:
            exec(compile(block, page, "exec"), names)
