"""How near a search comes to fronts of many starts: share of hypervolume, ends, gaps, time.

The reference fronts in ``tests/data/converged_fronts`` belong to 128 draws of seed 1; their README
says how each was made. Run it as

    python benchmarks/converged_fronts.py [--problem u06_prescribed] [--seeds 5]
    python benchmarks/converged_fronts.py --gradient     # cost of a gradient, side by side
    python benchmarks/converged_fronts.py --write 12     # reference fronts of 12 other seeds
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

import deboom
from deboom.explore.descent import converged_front, objectives_and_gradients
from deboom.explore.front import pareto_front
from deboom.explore.robust import RobustValues

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from samples.reference_fronts import REFERENCE, figures

PROBLEMS = {
    "u06_coupled": (None, "U06", "coupled"),
    "u06_prescribed": (None, "U06", "prescribed"),
    "fleet5001_U06_coupled": (5001, "U06", "coupled"),
    "fleet5001_U06_prescribed": (5001, "U06", "prescribed"),
    "fleet5003_F39_coupled": (5003, "F39", "coupled"),
}
"""Seed of a virtual fleet or None for the shipped platform, vehicles, and motion, by problem."""


def problem(name: str, folder: Path) -> deboom.Robust:
    """Return the robust response behind a reference front; a virtual fleet is written first."""
    seed, vehicles, motion = PROBLEMS[name]
    platform, source = "u06", {"mounts": "library"}
    if seed is not None:
        platform, source = str(folder / f"fleet{seed}"), {"mounts": "spectra"}
        if not Path(platform).exists():
            deboom.bench.write_platform(Path(platform), seed, truth_seed=4100 + seed)
    model = deboom.read_platform(platform).model(
        vehicles=vehicles, band=(20, 60), motion=motion, **source
    )
    return deboom.Robust(model, model.design_space(), draws=128, seed=1)


def plain_pymoo(
    robust: deboom.Robust, seed: int, population: int, generations: int
) -> RobustValues:
    """Return the last population of pymoo's own `minimize`."""
    optimum = minimize(
        deboom.RobustProblem(robust), NSGA2(population), ("n_gen", generations), seed=seed
    )
    return robust(np.atleast_2d(optimum.X))


def rivals(seed: int) -> dict[str, Callable[[deboom.Robust], RobustValues]]:
    """Return what is measured side by side, by name."""

    def search(robust: deboom.Robust, **budget: int | bool) -> RobustValues:
        return deboom.search(robust, seed=seed, verified_with=2, **budget).search.front

    return {
        "pymoo minimize 40 x 40": lambda robust: plain_pymoo(robust, seed, 40, 40),
        "search 40 x 40, polish=False": lambda r: search(
            r, population=40, generations=40, polish=False
        ),
        "search 40 x 40": lambda r: search(r, population=40, generations=40),
    }


def gradient_cost(robust: deboom.Robust, calls: int = 100) -> float:
    """Return the processor time of values with all gradients, in robust evaluations."""
    design = np.full(robust.space.n_variables, 1.03)
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(calls):
        # in turns, and of each the quiet calls: others use the machine as well
        begun = time.process_time()
        robust(design[np.newaxis])
        between = time.process_time()
        objectives_and_gradients(robust, design)
        times[0].append(between - begun)
        times[1].append(time.process_time() - between)
    evaluation, gradient = (float(np.percentile(row, 10)) for row in times)
    return gradient / evaluation


def write(robust: deboom.Robust, path: Path, seeds: int) -> None:
    """Write the front that descents of many seeds, from 101, reach together."""
    per_line = 1.0 / (robust.evaluate.n_lines * len(robust.evaluate.response_names))
    designs = [converged_front(robust, seed=101 + number) for number in range(seeds)]
    front = pareto_front(robust(np.vstack(designs))).objectives * per_line
    header = "mean per line [dB(A)],sigma per line [dB]"
    np.savetxt(path, front, fmt="%.7f", delimiter=",", header=header, comments="")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--problem", choices=PROBLEMS, action="append")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--gradient", action="store_true")
    parser.add_argument("--write", type=int, metavar="SEEDS")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.problem or PROBLEMS:
            robust = problem(name, Path(folder))
            objectives_and_gradients(robust, robust.space.nominal)  # compile
            if options.gradient:
                print(f"{name}: a gradient costs {gradient_cost(robust):.2f} evaluations")
                continue
            if options.write:
                write(robust, REFERENCE / f"{name}.csv", options.write)
                continue
            for seed in range(1, options.seeds + 1):
                for rival, run in rivals(seed).items():
                    begun = time.process_time()
                    front = run(robust)
                    spent = time.process_time() - begun
                    measured = figures(robust, front, REFERENCE / f"{name}.csv")
                    rows.append({"problem": name, "search": rival, "seed": seed, **measured})
                    rows[-1]["processor time [s]"] = spent
                    print(pd.DataFrame(rows[-1:]).to_string(index=False, header=len(rows) == 1))
    if rows:
        kept = ["problem", "search"]
        print(pd.DataFrame(rows).drop(columns="seed").groupby(kept).median().to_string())


if __name__ == "__main__":
    main()
