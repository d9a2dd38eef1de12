"""Comparing fronts.

Searches with shared Sobol draws and as many with fresh draws for every design, the literal thesis,
over the shipped fleet; 40 × 40 designs each, 128 draws per design, a sixth of the study's default
budget, judged as `deboom compare` does, with 1024 common draws and each pair in its own box. Pairs
of two seeds are neighbours. Searches fork on the last bits of a processor: on another one 10 of 10
pairs differed really. All ten of each together differ by three times their noise on both.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from claims import Claim, at_least, draws
from deboom.explore.front import FrontVerdict
from deboom.explore.robust import Robust
from deboom.explore.search import Search, nsga2
from deboom.files.front_run import ComparedRun
from deboom.files.front_table import FrontTable
from deboom.files.platform import read_platform
from deboom.files.run_folder import RunEntry
from deboom.pages.comparison import Comparison, JudgedRun, judged
from deboom.runs.options import Sampler, tolerance_sample
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.design_factor import factor_space

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
SEEDS = range(1, 1 + draws(10))
DESIGNS, GENERATIONS, DRAWS, COMMON_DRAWS = 40, 40, 128, 1024


def claims() -> list[Claim]:
    """Search many times, judge once, and compare pair by pair and all with all."""
    whole = judged(_runs(), COMMON_DRAWS, 1, lambda *_: None)
    half = len(SEEDS)
    shared, fresh = whole.fronts[:half], whole.fronts[half:]
    same = [_pair(whole, run, shared[(place + 1) % half]) for place, run in enumerate(shared)]
    other = [_pair(whole, run, beside) for run, beside in zip(shared, fresh, strict=True)]
    noise = sum(verdict is not FrontVerdict.real for verdict in same)
    real = sum(verdict is FrontVerdict.real for verdict in other)
    names = list(whole.groups)
    difference = whole.pairs[names[0], names[1]]
    volumes = [float(whole.hypervolumes[name].mean()) for name in names]
    lost = 100.0 * (1.0 - volumes[1] / volumes[0])
    gap = -whole.gap(names[0], names[1]) * whole.per_line
    return [
        at_least(
            f"two seeds of one study that are not told apart, one run with shared and one with "
            f"fresh draws that differ really, of {half}",
            0.9 * half,
            [noise, real],
            0,
        ),
        Claim(
            f"{half} seeds of each: hypervolume that fresh draws lose [%]",
            "real difference",
            f"{lost:.0f} ({difference.verdict.value}; "
            f"noise ±{100 * difference.noise / volumes[0]:.1f})",
            difference.verdict is FrontVerdict.real,
        ),
        at_least("the same as level per line at equal σ, louder by [dB]", 0.1, gap),
    ]


@dataclass(frozen=True)
class Searched:
    """What a study of such a front would prepare."""

    robust: Robust


def _runs() -> list[ComparedRun]:
    platform = read_platform(PLATFORM)
    runs = platform.runs(fleet=platform.fleet.group("U06"))
    index = runs.model(Motion.prescribed)
    space = factor_space(index.variable_names, half_width=0.20, tolerance=0.15)
    searched = []
    for sampler in (Sampler.sobol, Sampler.fresh):
        for seed in SEEDS:
            sample = tolerance_sample(sampler, space.n_variables, DRAWS, seed=seed)
            model = Robust(index, space, sample)
            search = nsga2(model, Search(DESIGNS, GENERATIONS, seed=seed))
            record = {"seed": seed, "arguments": {"sampler": sampler.value}}
            entry = RunEntry(Path("search", f"{sampler.value}{seed}"), record)
            rows = pd.DataFrame(search.front.designs, columns=list(space.labels))
            front = FrontTable(rows, space.labels, search.hypervolume)
            searched.append(ComparedRun(entry=entry, prepared=Searched(model), front=front))
    return searched


def _pair(whole: Comparison, first: JudgedRun, second: JudgedRun) -> FrontVerdict:
    """Compare two runs alone, in their own box."""
    two = (replace(first, name="first"), replace(second, name="second"))
    return replace(whole, fronts=two).pairs["first", "second"].verdict
