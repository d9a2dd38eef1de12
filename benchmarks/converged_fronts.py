"""How near a search comes to fronts of many starts: share of hypervolume, ends, gaps, time.

The reference fronts in ``tests/data/converged_fronts`` belong to 128 draws of seed 1; their README
says how each was made. Run it as

    python benchmarks/converged_fronts.py [--problem u06_prescribed] [--seeds 5]
    python benchmarks/converged_fronts.py --gradient     # cost of a gradient, side by side
    python benchmarks/converged_fronts.py --write 3      # reference fronts anew, NSGA-II of 3 seeds
    python benchmarks/converged_fronts.py --drawn 10 --seeds 3   # fleets that no test uses
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
from scipy.optimize import minimize as scipy_minimize

import deboom
from deboom.arrays import RealArray
from deboom.explore.descent import converged_front, objectives_and_gradients
from deboom.explore.front import pareto_front, thinned
from deboom.explore.robust import RobustValues
from deboom.explore.search import SHOWN, Search, nsga2
from deboom.vehicles.booming_model import BoomingModel

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from samples import drawn_cars
from samples.reference_fronts import REFERENCE, figures

PROBLEMS = {
    "u06_coupled": (None, "U06", "coupled"),
    "u06_prescribed": (None, "U06", "prescribed"),
    "fleet5001_U06_coupled": (5001, "U06", "coupled"),
    "fleet5001_U06_prescribed": (5001, "U06", "prescribed"),
    "fleet5003_F39_coupled": (5003, "F39", "coupled"),
}
"""Seed of a virtual fleet or None for the shipped platform, vehicles, and motion, by problem."""

MOST_OF_A_GRADIENT = {
    "u06_prescribed": 2.5,
    "u06_coupled": 4.0,
    "drawn, prescribed": 2.5,
    "drawn, coupled": 4.0,
    "drawn, tilted": 6.0,
    "drawn, with receptances": 6.0,
}
"""Robust evaluations that a gradient may cost, of the shipped platform and of drawn cars."""
CARS = drawn_cars.Shape("size of U06", 128, 5, 241, 3, 2, 1)

TARGETS, POINTS = 100, 1500
"""Bounds of each objective that descents keep, and points of a reference front."""


DRAWN = 6001
"""Seed of the first of the fleets that are drawn for a table."""


def problem(fleet: int | None, vehicles: str | None, motion: str, folder: Path) -> deboom.Robust:
    """Return the robust response of a fleet; a virtual one is written first.

    - `vehicles`: group of vehicles; None: the first of the fleet.
    """
    platform, source = "u06", {"mounts": "library"}
    if fleet is not None:
        platform, source = str(folder / f"fleet{fleet}"), {"mounts": "spectra"}
        if not Path(platform).exists():
            deboom.bench.write_platform(Path(platform), fleet, truth_seed=4100 + fleet)
    cars = deboom.read_platform(platform)
    model = cars.model(
        vehicles=vehicles or cars.fleet.vehicles[0].group, band=(20, 60), motion=motion, **source
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


def gradient_cost(robust: deboom.Robust, calls: int) -> float:
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


def gradient_costs(calls: int) -> pd.DataFrame:
    """Return what gradients cost, in turns of a few calls of each model."""
    coupled = drawn_cars.coupled_problem(CARS)
    cases = {
        "prescribed": drawn_cars.prescribed_problem(CARS),
        "coupled": coupled,
        "tilted": drawn_cars.tilted(coupled),
        "with receptances": drawn_cars.flexible_problem(CARS),
    }
    names = ("u06_prescribed", "u06_coupled")
    robusts = {name: problem(*PROBLEMS[name], Path()) for name in names}
    for name, case in cases.items():
        model = BoomingModel((case,), (1.0,))
        robusts[f"drawn, {name}"] = deboom.Robust(model, model.design_space(), draws=128, seed=1)
    for robust in robusts.values():
        objectives_and_gradients(robust, robust.space.nominal)  # compile
    rounds = [
        {name: gradient_cost(robust, calls) for name, robust in robusts.items()} for _ in range(3)
    ]
    table = pd.DataFrame(rounds).median().to_frame("evaluations")
    return table.assign(**{"at most": pd.Series(MOST_OF_A_GRADIENT)})


def constrained(robust: deboom.Robust, begin: RealArray, seed: int) -> RealArray:
    """Return all designs of descents of the mean sum under a bound of the sigma sum, and reverse.

    Each of `TARGETS` bounds between the ends of a front begins at the best of its designs so far,
    at the end of the bound before, and at a random design.
    """
    space = robust.space
    visited: list[RealArray] = []
    cache: dict[bytes, tuple[RealArray, RealArray]] = {}

    def at(design: RealArray) -> tuple[RealArray, RealArray]:
        if design.tobytes() not in cache:
            cache.clear()
            inside = np.clip(design, space.lower, space.upper)
            cache[design.tobytes()] = objectives_and_gradients(robust, inside)
            visited.append(inside)
        return cache[design.tobytes()]

    values = robust(begin).objectives
    size = np.ptp(values, axis=0)
    random = np.random.default_rng(seed)
    for row, other in ((0, 1), (1, 0)):
        before = begin[values[:, row].argmin()]
        # a bound that all keep is the end itself
        bounds = np.linspace(values[:, other].max(), values[:, other].min(), TARGETS)
        for bound in np.r_[np.inf, bounds]:
            kept = values[:, other] <= bound
            nearest = begin[kept][values[kept, row].argmin()]
            ends = []
            for start in (nearest, before, random.uniform(space.lower, space.upper)):
                end = scipy_minimize(
                    lambda x, row=row: at(x)[0][row] / size[row],
                    start,
                    jac=lambda x, row=row: at(x)[1][row] / size[row],
                    method="SLSQP",
                    bounds=list(zip(space.lower, space.upper, strict=True)),
                    constraints=[] if np.isinf(bound) else [{
                        "type": "ineq",
                        "fun": lambda x, o=other, e=bound: (e - at(x)[0][o]) / size[o],
                        "jac": lambda x, o=other: -at(x)[1][o] / size[o],
                    }],
                    options={"maxiter": 80, "ftol": 1e-8},
                ).x  # fmt: skip
                value = at(end)[0]
                ends.append((value[row] + 1e3 * max(0.0, value[other] - bound), end))
            before = min(ends, key=lambda pair: pair[0])[1]
    return np.array(visited)


def write(robust: deboom.Robust, path: Path, seeds: int) -> RobustValues:
    """Write the front of long searches by NSGA-II, and of descents under bounds from there.

    Nothing of `converged_front` has a part in it.

    - returns: the whole front.
    """
    per_line = 1.0 / (robust.evaluate.n_lines * len(robust.evaluate.response_names))
    long = [nsga2(robust, Search(100, 200, seed=101 + number)).front for number in range(seeds)]
    begin = pareto_front(*long)
    print(f"{path.stem}: {len(begin)} points by NSGA-II", flush=True)
    visited = robust(constrained(robust, np.asarray(begin.designs), seed=101))
    reference = pareto_front(begin, visited)
    front = thinned(reference, POINTS).objectives * per_line
    print(f"{path.stem}: ends {front.min(axis=0)}, NSGA-II alone "
          f"{begin.objectives.min(axis=0) * per_line}", flush=True)  # fmt: skip
    header = "mean per line [dB(A)],sigma per line [dB]"
    np.savetxt(path, front, fmt="%.7f", delimiter=",", header=header, comments="")
    return reference


def drawn_fleets(n: int, seeds: int) -> pd.DataFrame:
    """Return how near the descents of each seed come on fleets that are drawn anew."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for fleet in range(DRAWN, DRAWN + n):
            for motion in ("coupled", "prescribed"):
                robust = problem(fleet, None, motion, Path(folder))
                objectives_and_gradients(robust, robust.space.nominal)  # compile
                path = Path(folder) / f"{fleet}_{motion}.csv"
                best = figures(robust, write(robust, path, 1), path)
                for seed in range(1, seeds + 1):
                    begun = time.process_time()
                    front = converged_front(robust, seed=seed)
                    spent = time.process_time() - begun
                    names = {"fleet": fleet, "motion": motion, "seed": seed}
                    rows.append({**names, **figures(robust, front, path)})
                    share = f"share of {SHOWN} points [%]"
                    rows[-1][f"{SHOWN} of the reference [%]"] = best[share]
                    rows[-1]["processor time [s]"] = spent
                    print(pd.DataFrame(rows[-1:]).to_string(index=False, header=len(rows) == 1))
    return pd.DataFrame(rows)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--problem", choices=PROBLEMS, action="append")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--gradient", action="store_true")
    parser.add_argument("--write", type=int, metavar="SEEDS")
    parser.add_argument("--drawn", type=int, metavar="FLEETS")
    options = parser.parse_args()
    if options.gradient:
        print(gradient_costs(calls=20).round(2).to_string())
        return
    if options.drawn:
        table = drawn_fleets(options.drawn, options.seeds).drop(columns=["fleet", "seed"])
        print(table.groupby("motion").agg(["min", "median", "max"]).T.to_string())
        return
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.problem or PROBLEMS:
            robust = problem(*PROBLEMS[name], Path(folder))
            objectives_and_gradients(robust, robust.space.nominal)  # compile
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
