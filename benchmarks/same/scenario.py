"""A scenario: the steps of one user, run in a folder of their own against one tree of deboom.

A step is a command line of deboom or a verb: ``put FILE TEXT``, ``sub FILE OLD NEW``,
``cp SOURCE TARGET``, ``rm FILE``, ``cut FILE SHARE``, ``killed PATTERN COMMAND …`` (ended hard as
soon as a file matches) and ``python CODE``. ``@name/path`` stands for what scenario ``name`` wrote
on the base, so that both trees read the same measurement files; ``%name`` for the one run folder of
scenario ``name`` on the same tree; ``studies`` in the folder is that tree's.
"""

from __future__ import annotations

import io
import json
import os
import re
import resource
import shlex
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

REFERENCE = re.compile(r"(?<!\S)([@%])([\w-]+)")
SETTLED = {
    "COLUMNS": "1000",
    "LC_ALL": "C.UTF-8",
    "NO_COLOR": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONHASHSEED": "0",
    "TERM": "dumb",
}
"""Environment of every step."""


@dataclass(frozen=True)
class Scenario:
    """Steps on the base, steps on the work tree where they differ, and how closely they agree.

    Parameters
    ----------
    name : str
        Name, such as ``front-coupled``; the part before the first ``-`` says what is tried.
    steps : tuple of str
        Command lines and verbs.
    new : tuple of str or None
        Steps on the work tree; None: the same ones. Empty: the scenario is gone.
    absolute : float
        Difference of two numbers that is allowed beside 1e-9 of their scale.
    """

    name: str
    steps: tuple[str, ...]
    new: tuple[str, ...] | None = None
    absolute: float = 0.0

    @property
    def needs(self) -> list[tuple[str, str]]:
        """References to other scenarios: the mark and the name."""
        words = (*self.steps, *(self.new or ()))
        return [pair for step in words for pair in REFERENCE.findall(_command(step))]


def _command(step: str) -> str:
    """Return the part of a step in which references count: texts and code are taken literally."""
    return "" if step.split(" ", 1)[0] in ("put", "sub", "python") else step


def record_pictures(pictures: list[dict[str, Any]]) -> None:
    """Make matplotlib note what every saved figure shows, and draw it coarsely."""
    from matplotlib.figure import Figure

    save = Figure.savefig

    def noted(figure: Figure, target: Any, **options: Any) -> None:
        save(figure, target, **{**options, "dpi": 20})
        pictures.append({"axes": [_content(axes) for axes in figure.axes]})

    Figure.savefig = noted  # type: ignore[method-assign]


def _content(axes: Any) -> dict[str, Any]:
    legend = axes.get_legend()
    box = axes.dataLim
    drawn = bool(axes.has_data()) and box.width >= 0
    return {
        "labels": [axes.get_title(), axes.get_title("left"), axes.get_xlabel(), axes.get_ylabel()],
        "legend": [text.get_text() for text in legend.get_texts()] if legend else [],
        "data": [float(v) for v in box.extents] if drawn else [],
        "view": [*map(float, axes.get_xlim()), *map(float, axes.get_ylim())],
    }


def run_in_child(steps: Sequence[str], tree: Path, folder: Path, base: Path) -> int:
    """Fork a child that carries out a scenario in ``folder``; returns its process number.

    The child imports deboom from ``tree`` alone; the parent has never imported it.
    """
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        os.setsid()
        _carry_out(steps, tree, folder, base)
        code = 0
    except BaseException:
        (folder / "log").mkdir(parents=True, exist_ok=True)
        (folder / "log" / "broken.txt").write_text(traceback.format_exc(), encoding="utf-8")
    finally:
        os._exit(code)


def _carry_out(steps: Sequence[str], tree: Path, folder: Path, base: Path) -> None:
    """Run the steps of a scenario in this process; notes go to ``folder/log``."""
    start = time.process_time()
    work, log = folder / "work", folder / "log"
    work.mkdir(parents=True)
    log.mkdir()
    (work / "studies").symlink_to(tree / "studies")
    os.chdir(work)
    os.environ.update(SETTLED, PYTHONPATH=f"{tree / 'src'}{os.pathsep}{tree}")
    sys.path[:0] = [str(tree / "src"), str(tree)]
    pictures: list[dict[str, Any]] = []
    record_pictures(pictures)
    for number, step in enumerate(steps):
        out = (log / f"{number}.out").open("w", encoding="utf-8")
        err = (log / f"{number}.err").open("w", encoding="utf-8")
        sys.stdout.flush(), sys.stderr.flush()
        os.dup2(out.fileno(), 1), os.dup2(err.fileno(), 2)
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), "utf-8", write_through=True)
        sys.stderr = io.TextIOWrapper(io.FileIO(2, "w", closefd=False), "utf-8", write_through=True)
        code = _step(step, base, folder.parent)
        (log / f"{number}.code").write_text(str(code), encoding="utf-8")
    (log / "pictures.json").write_text(json.dumps(pictures), encoding="utf-8")
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = time.process_time() - start + children.ru_utime + children.ru_stime
    (log / "steps.txt").write_text("\n".join(steps), encoding="utf-8")
    (log / "cpu.txt").write_text(f"{seconds:.2f}", encoding="utf-8")


def _step(step: str, base: Path, side: Path) -> int:
    """Carry out one step and return its exit code."""
    verb, _, rest = step.partition(" ")
    if verb == "python":
        exec(compile(rest, "<step>", "exec"), {"__name__": "step"})
        return 0
    if verb in ("put", "sub"):
        name, text = rest.split(" ", 1)
        path = Path(name)
        if verb == "put":
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            return 0
        old, new = text.split(" => ")
        content = path.read_bytes()
        if old.encode() not in content:
            raise ValueError(f"{old!r} is not in {name}")
        path.write_bytes(content.replace(old.encode(), new.encode(), 1))
        return 0
    words = shlex.split(REFERENCE.sub(lambda match: _place(*match.groups(), base, side), step))
    if verb == "cp":
        source, target = map(Path, words[1:])
        copy = shutil.copytree if source.is_dir() else shutil.copy
        copy(source, target)
        return 0
    if verb == "rm":
        path = Path(words[1])
        shutil.rmtree(path) if path.is_dir() else path.unlink()
        return 0
    if verb == "cut":
        path, share = Path(words[1]), float(words[2])
        content = path.read_bytes()
        path.write_bytes(content[: int(share * len(content))])
        return 0
    if verb == "killed":
        return _killed(words[1], words[2:])
    return _deboom(
        [*words[:-1], str(run_folder(Path(words[-1])))] if "--resume" in words else words
    )


def _place(mark: str, name: str, base: Path, side: Path) -> str:
    """Return the folder that a reference stands for."""
    if mark == "@":
        return str(base / name / "work")
    return str(run_folder(side / name / "work" / "results"))


def run_folder(results: Path) -> Path:
    """Return the only run below a folder of results, or the folder itself."""
    runs = sorted(path for path in results.glob("*/*") if path.is_dir())
    return runs[0] if runs else results


def _deboom(words: Sequence[str]) -> int:
    """Run a command line of deboom in this process."""
    from deboom.cli import app

    sys.argv = ["deboom", *words]
    try:
        app(prog_name="deboom")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    except Exception:
        traceback.print_exc()
        return 1
    return 0


def _killed(pattern: str, words: Sequence[str]) -> int:
    """Run a command line in a child and end it hard as soon as a file matches ``pattern``."""
    child = os.fork()
    if not child:
        os.setsid()
        os._exit(_deboom(words))
    while not list(Path().glob(pattern)):
        if os.waitpid(child, os.WNOHANG)[0]:
            raise RuntimeError(f"the command ended before {pattern} was there")
        time.sleep(0.01)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return 0
