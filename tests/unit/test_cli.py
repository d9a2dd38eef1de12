"""The command line as a user meets it: help that teaches, one sentence for bad input."""

import io
import re
import shutil
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import pytest
import typer
from broken_files import content, edited, functions
from typer.testing import CliRunner

import deboom
from command_line import call, refused
from deboom.cli import COMMANDS, app
from deboom.errors import DataWarning
from deboom.files.kinds import FolderKind
from deboom.progress import announce, progress_bar
from deboom.runs.options import bands_as_declared
from deboom.runs.overview import command_of
from deboom.runs.runner import study_command, study_files
from deboom.runs.sentences import errors_as_sentences

ROOT = Path(__file__).parents[2]
STUDY = ROOT / "studies" / "front.py"
PLATFORM = ROOT / "studies" / "data" / "u06_f39_f45"
TINY = ["--generations", "1", "--population", "8", "--samples", "16"]


@pytest.fixture(autouse=True)
def at_home(monkeypatch):
    monkeypatch.chdir(ROOT)


def test_help_starts_without_heavy_imports():
    heavy = ("pandas", "matplotlib", "pymoo", "SALib", "numba", "scipy", "numpy", "sqlalchemy")
    code = (
        "import sys\nfrom deboom.cli import app\n"
        "try:\n    app(['--help'])\nexcept SystemExit:\n    pass\n"
        f"print([name for name in {heavy!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "deboom run front" in done.stdout
    assert done.stderr.strip() == "[]"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--version",), [f"deboom {deboom.__version__}"]),
        (("run",), ["own options"]),
        (("run", STUDY, "--help"), ["Which mount stiffnesses", "--seed", "--motion", "--out"]),
        (("studies",), ["front\n", "Which mount stiffnesses"]),
    ],
)
def test_help_teaches(arguments, words):
    assert all(word in call(*arguments).output for word in words)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--seed", "0"], ["seed 0", "from 1"]),
        (["--load-case", "g9"], ["g9", "g5_wot220"]),
        (["--load-case", "g5_wot220=-1"], ["g5_wot220=-1", "above 0"]),
        (["--group", "U07"], ["U07", "U06"]),
        (["--samples", "100"], ["100", "128"]),
        (["--tolerance", "-0.1"], ["tolerance"]),
        (["--population", "1"], ["population"]),
    ],
)
def test_bad_options_end_with_one_sentence_and_write_nothing(tmp_path, options, words):
    out = tmp_path / "results"
    refused(("run", STUDY, *TINY, "--out", out, *options), *words)
    assert not out.exists()


@pytest.mark.parametrize(
    ("study", "options", "words"),
    [
        ("front", ["--resamples", "20"], ["--resamples 20", "at least 100"]),
        ("front", ["--n", "100"], ["--n 100", "64 or 128"]),
        ("compressor_noise", ["--draws", "8"], ["--draws 8", "at least 20"]),
        ("mount_characterisation", ["--pieces", "0"], ["--pieces 0", "at least 1"]),
    ],
)
def test_options_of_late_steps_are_refused_before_any_work(
    tmp_path, monkeypatch, study, options, words
):
    monkeypatch.setattr("deboom.runs.runner.run_study", lambda *_: pytest.fail("work began"))
    refused(("run", study, "--out", tmp_path, *options), *words)


def test_missing_study_and_file_that_is_no_study(tmp_path):
    refused(("run", "studies/nothing.py"), "studies/nothing.py", "deboom studies")
    script = tmp_path / "script.py"
    script.write_text("print('no study')\n")
    refused(("run", script), "docstring")
    script.write_text('"""A question?"""\n')
    refused(("run", script), "Options", "prepare(options)")
    refused(("run", "correlatio"), "did you mean correlation?")
    refused(("run", "second_engine"), "is an example now, examples/mounts/plot_second_engine.py")
    script.write_text("def main(:\n")
    refused(("run", script), "line 1")


def test_a_file_in_the_way_of_a_folder_is_named_and_kept(tmp_path):
    (tmp_path / "mine.txt").write_text("keep")
    refused(("run", STUDY, *TINY, "--out", tmp_path / "mine.txt" / "results"), "mine.txt", "--out")
    refused(("bench", "write", tmp_path), "not empty")
    refused(("bench", "write", tmp_path / "new", "--seed", 0), "seed")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["keep"]


def test_bench_writes_a_platform_that_passes_its_check(tmp_path):
    folder = tmp_path / "platform"
    written = call("bench", "write", folder, "--seed", "2")
    assert "--mounts spectra" in written.stderr
    assert Path(written.stdout.splitlines()[-1]) == folder
    assert "5 in group U06" in call("check", folder).stdout


VEHICLE = "noise_transfer/U06-2.uff"


def cut(folder):
    data = (folder / VEHICLE).read_bytes()
    (folder / VEHICLE).write_bytes(data[: len(data) // 2])


def turned(functions):
    return [
        replace(f, values=-f.values) if (f.response_node, f.ordinate) == (103, "force") else f
        for f in functions
    ]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (content(VEHICLE, None), ["U06-2.uff"]),
        (cut, ["U06-2.uff"]),
        (edited("platform.toml", "gear = 5", "gaer = 5"), ["gaer", "gear"]),
        (edited(VEHICLE, "2.50000e-01", "2.50100e-01", count=-1), ["U06-2.uff"]),
        (
            functions("operating/g5_wot220.uff", turned, binary=False),
            ["TSM x", "negative stiffness", "sign"],
        ),
    ],
)
def test_a_fault_of_a_platform_is_named_and_nothing_is_written(fault, words, tmp_path):
    platform, out = tmp_path / "platform", tmp_path / "results"
    shutil.copytree(PLATFORM, platform, ignore=shutil.ignore_patterns("truth"))
    fault(platform)
    result = call("run", STUDY, "--platform", platform, "--out", out, code=2)
    assert 1 <= len(result.stderr.strip().splitlines()) <= 11, result.stderr
    assert all(word in result.stderr for word in words)
    assert not out.exists()


def test_a_run_names_the_command_that_makes_it_again():
    given = {"band": [20.0, 60.0], "load_case": ["g5 wot", "g7=0.5"], "free": True, "plan": False}
    again = "deboom run studies/u.py --band 20.0 60.0 --load-case 'g5 wot' --load-case g7=0.5"
    assert command_of({"study": "u", "arguments": given}) == f"{again} --free --no-plan"


def test_a_warning_about_the_data_is_a_sentence_and_others_stay_as_they_are():
    layout = warnings.formatwarning
    with errors_as_sentences():
        said = warnings.formatwarning(DataWarning("frf.uff: a line"), DataWarning, "file.py", 3)
        other = warnings.formatwarning(UserWarning("else"), UserWarning, "file.py", 3, "code")
    assert said == "deboom: warning: frf.uff: a line\n"
    assert "file.py:3: UserWarning: else" in other
    assert warnings.formatwarning is layout


def test_each_command_stands_in_one_group_of_the_help_with_its_whole_sentence():
    command = typer.main.get_command(app)
    grouped = [name for names in COMMANDS.values() for name in names]
    assert sorted(grouped) == sorted(command.commands)
    words = " ".join(CliRunner().invoke(app, []).output.split())
    for name in grouped:
        first = " ".join(command.commands[name].help.partition("\n\n")[0].split())
        assert f"{name} {first}" in words


def test_progress_counts_says_how_good_and_how_long(capsys):
    with progress_bar("search") as progress:
        for done in range(1, 9):
            progress(done, 8, f"generation {done} of 8, best mean −{done / 4:.1f} dB")
        for done, text in enumerate(("seams", "shares", "levels", "page"), 1):
            progress(done, 4, text)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "search: generation 2 of 8, best mean −0.5 dB, 0 s left"
    assert lines[3] == "search: generation 8 of 8, best mean −2.0 dB"
    assert lines[4:] == [
        "search: 1 of 4, seams, 0 s left",
        "search: 2 of 4, shares, 0 s left",
        "search: 3 of 4, levels, 0 s left",
        "search: 4 of 4, page",
    ]


def test_what_takes_long_says_so_before_it_begins(monkeypatch, capsys):
    """Steps of 2 s by the second one, the first of which compiled for a minute."""
    clock, steps = iter([0.0, 2.0]), []
    monkeypatch.setattr("deboom.progress.time.perf_counter", lambda: next(clock))
    announce("box", lambda: steps.append(1), 300)
    assert capsys.readouterr().err == "box: takes about 10 min\n"
    assert len(steps) == 2


def test_a_search_tells_its_progress_in_a_log_a_notebook_or_a_callback(monkeypatch, capsys):
    model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    robust = deboom.Robust(model, model.design_space(), draws=16)
    budget = {"population": 8, "generations": 8, "verified_with": 16}
    deboom.search(robust, **budget, progress=True)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 4
    left = r"search: generation [2468] of 8, best mean [−+]\d.*? dB(, \d+ s left)?"
    assert all(re.fullmatch(left, line) for line in lines), lines
    told = []
    deboom.search(robust, **budget, progress=lambda *step: told.append(step))
    assert [(number, total) for number, total, _ in told] == [(n, 8) for n in range(1, 9)]

    class Cell(io.StringIO):
        """The output of a cell in a notebook."""

    Cell.__module__ = "ipykernel.iostream"
    monkeypatch.setattr(sys, "stderr", Cell())
    deboom.search(robust, **budget, progress=True)
    line = sys.stderr.getvalue()
    # one line, written anew
    assert (line.count("\n"), "\rsearch: generation 1 of 8" in line) == (1, True)
    assert "generation 8 of 8" in line


@pytest.mark.parametrize(
    ("typed", "declared_one", "declared_two"),
    [
        (["20", "60"], ["20-60"], ["20", "60"]),
        (["20-60"], ["20-60"], ["20", "60"]),
        (["20,60"], ["20-60"], ["20", "60"]),
        (["20.5–60"], ["20.5-60"], ["20.5", "60"]),
        (["20", "my_folder"], ["20", "my_folder"], ["20", "my_folder"]),
        (["all"], ["all"], ["all"]),
    ],
)
def test_a_band_may_be_typed_in_three_ways(typed, declared_one, declared_two):
    for width, wanted in ((1, declared_one), (2, declared_two)):
        widths = {"--band": width, "--seed": 1}
        read = bands_as_declared(["x", "--band", *typed, "--seed", "2"], widths)
        assert read == ["x", "--band", *wanted, "--seed", "2"]
    assert bands_as_declared(["--band=20-60"], {"--band": 2}) == ["--band", "20", "60"]
    joined = ["--band=20-60", "--seed", "2"]
    assert bands_as_declared(joined, {"--band": 1}) == ["--band", "20-60", "--seed", "2"]
    assert bands_as_declared(["--band", "20-60"], {}) == ["--band", "20-60"]
    assert bands_as_declared(["--band"], {"--band": 2}) == ["--band"]


def test_every_band_of_a_study_says_from_to():
    for path in study_files():
        for option in typer.main.get_command(study_command(path)).params:
            if "--band" in option.opts:
                assert option.metavar == "FROM TO", path


def test_a_new_folder_says_what_to_fill_in_first_and_the_guide(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    guides = [path.read_text(encoding="utf-8") for path in (ROOT / "docs/guides").glob("*.md")]
    for kind in FolderKind:
        done = call("new", kind.value, f"my_{kind.value}")
        assert done.stdout.strip() == f"my_{kind.value}"
        first, then, guide = done.stderr.splitlines()
        named = Path(first.split()[3].rstrip(","))
        assert "FILL IN" in named.read_text(encoding="utf-8")
        command = then.rpartition(", and ")[2].split()
        assert named.parent.as_posix() in command
        title = guide.removeprefix("guide: ").removesuffix(", in the documentation")
        assert f"# {title}" in {text.partition("\n")[0] for text in guides}


QUICK = '''"""What is quick?"""
from dataclasses import dataclass

from deboom.report import Report, Step


@dataclass(frozen=True)
class Options:
    """Nothing but a seed."""

    seed: int = 1


def prepare(options):
    """Read nothing."""


def run(model, options, context=None):
    """Answer at once."""
    report = Report("Quick", "What is quick?")
    report.answer("Softer is quieter.")
    report.panel("Next", Step("deboom list", "see all runs"))
    return report
'''


@pytest.mark.parametrize("display", [True, False])
def test_a_run_ends_with_its_answer_its_page_and_the_next_command(tmp_path, monkeypatch, display):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if display:
        monkeypatch.setenv("DISPLAY", ":0")
    study = tmp_path / "quick.py"
    study.write_text(QUICK, encoding="utf-8")
    done = call("run", study, "--open", "--out", tmp_path / "results")
    run = Path(done.stdout.splitlines()[-1])
    assert done.stderr.splitlines()[:3] == [
        "Softer is quieter.",
        f"page: {run.as_posix()}/report.html",
        "next: deboom list  (see all runs)",
    ]
    assert opened == ([(run / "report.html").resolve().as_uri()] if display else [])
    assert ("there is no display" in done.stderr) != display


def test_output_has_no_colours():
    shown = CliRunner().invoke(app, [], color=True)
    assert "\x1b" not in shown.output
    assert "\x1b" not in CliRunner().invoke(app, ["nothing"], color=True).output
