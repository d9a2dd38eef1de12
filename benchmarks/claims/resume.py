"""Runs that are killed.

`benchmarks/quad2_front.py` (60 × 60 designs of QUAD2, every generation kept) is killed
with signal 9 at 20 moments, drawn evenly over its generations and within one, and resumed. A
smaller search is also computed by two processes, and by two processes of which one is killed.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from claims import Claim
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.space import stiffness_factor_space
from deboom.explore.workers import workers_for
from deboom.files.run_folder import read_evaluations
from deboom.study.runner import Study, load_study, resume_study, run_study
from known_truth import quad2

STUDY = Path(__file__).parents[1] / "quad2_front.py"
BUDGET = {"seed": 1, "generations": 60, "population": 60}
KILLS = 20
GENERATION_S = 0.01


def killed_run(out: Path, moment: float) -> Path:
    """Start the study as a user does and kill it after some generations and a fraction of one."""
    options = [word for name, value in BUDGET.items() for word in (f"--{name}", str(value))]
    command = [sys.executable, str(STUDY), "--out", str(out), *options]
    after = f"/search/evaluations/{int(moment):06d}.npz" if moment >= 1.0 else ""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while not list(out.glob(f"quad2_front/*_seed1*{after}")):
            time.sleep(0.001)
        time.sleep(moment % 1.0 * GENERATION_S)
        process.kill()
    (folder,) = out.glob("quad2_front/*_seed1*")
    return folder


def campaign(study: Study, out: Path) -> tuple[int, int, int, int]:
    """Return runs with the identical front, with all evaluations, killed early, and killed late."""
    whole = run_study(study, out / "whole", BUDGET)
    front = (whole / "front.csv").read_bytes()
    designs = read_evaluations(whole / "search")["designs"]
    identical = complete = early = late = 0
    for number, share in enumerate(np.random.default_rng(1).random(KILLS)):
        folder = killed_run(out / str(number), share * BUDGET["generations"])
        early += not (folder / "search" / "evaluations").exists()
        late += not folder.name.endswith(".unfinished")
        resumed = resume_study(study, out / str(number), folder.name, {})
        identical += (resumed / "front.csv").read_bytes() == front
        complete += np.array_equal(read_evaluations(resumed / "search")["designs"], designs)
    return identical, complete, early, late


def pools_agree() -> tuple[bool, bool]:
    """Return whether two processes, and two of which one is killed, find the same front."""
    model = quad2(12, seed=1)
    space = stiffness_factor_space(model.variable_names)
    robust = RobustResponse(model, space, sobol_sample(12, seed=1))
    fronts = [nsga2(robust, 40, 20, seed=1).front]
    for kill in (False, True):
        with workers_for(robust, workers=2) as pooled:

            def progress(number: int, _total: int, _text: str, kill=kill, pooled=pooled) -> None:
                if kill and number == 10:
                    os.kill(next(iter(pooled.pool._executor._processes)), signal.SIGTERM)

            fronts.append(nsga2(pooled, 40, 20, seed=1, progress=progress).front)
    one, two, killed = fronts
    return tuple(
        np.array_equal(one.designs, other.designs) and np.array_equal(one.sigma, other.sigma)
        for other in (two, killed)
    )


def claims() -> list[Claim]:
    study = load_study(STUDY)
    with (
        tempfile.TemporaryDirectory() as folder,
        Path(os.devnull).open("w") as silence,
        contextlib.redirect_stderr(silence),
    ):
        identical, complete, early, late = campaign(study, Path(folder))
    two, killed = pools_agree()
    return [
        Claim(
            "kill −9 at random moments: resumed runs with the identical front.csv",
            f"{KILLS} of {KILLS}",
            f"{identical} of {KILLS} ({early} killed before their first generation, {late} already "
            "finished)",
            identical == KILLS,
        ),
        Claim(
            "the same: all evaluations kept, each once",
            f"{KILLS} of {KILLS}",
            f"{complete} of {KILLS}",
            complete == KILLS,
        ),
        Claim("two processes: front", "same bits", "same" if two else "differs", two),
        Claim(
            "two processes, one killed: front", "same bits", "same" if killed else "differs", killed
        ),
    ]
