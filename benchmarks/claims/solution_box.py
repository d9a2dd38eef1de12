"""Acceptance boxes against known ones, and on the shipped fleet.

Known boxes: below a plane the share of a box is a sum over its corners, and with equal weights the
largest box follows from the Irwin-Hall distribution; in a quadratic bowl of two variables it is a
square about the middle, in units of the curvature; for QUAD2, whose two responses disagree, the
share is integrated by quadrature and maximised with Leibniz' derivatives, without a sample. The box
found is a little smaller by intent: it keeps the stated share plus what the bound of its
verification needs. With 12 variables 0.1 % of share is 1.6 % of volume: there 4 million parts
verify it, elsewhere 1 million.

Repetitions: QUAD2 with two variables, one instance per seed, share 90 %. The bound is one-sided,
with 95 % confidence, over parts (empirical Bernstein).

Fleet: the five U06 vehicles, mean level of the lines, motion prescribed, bounds 0.68 to 1.38. The
limit of each is today's level, and 95 % of the parts keep all five.
"""

from __future__ import annotations

import numpy as np

from claims import Claim, at_least, at_most, between, draws, in_processes
from deboom.explore.box import BoxQuestion
from deboom.explore.largest_box import BoxEffort, largest_box
from deboom.runs.platform_options import MotionOptions
from deboom.runs.runner import load_study
from deboom.vehicles.booming_model import Motion
from samples.known_boxes import exact_share, ratio_of, two_vehicles

STUDY = load_study("solution_box").module
EFFORT = BoxEffort(calibration=2**20, verification=2**20)
MOST = BoxEffort(calibration=2**20, verification=2**22)
REPEATED = BoxEffort(starts=1, calibration=16384)
REPETITIONS = draws(40)


def volume_ratio(task: tuple[str, int, int]) -> tuple[float, bool, bool]:
    """Return volume over the exact one, and what holds.

    The true share is above its bound and the stated one; the bound is above the stated one.
    """
    return ratio_of(*task, MOST if task[1] > 10 else EFFORT)[:3]


def repetition(seed: int) -> tuple[bool, bool, bool]:
    """Return whether the true share is above its bound and above the stated one, and verified."""
    problem, limit, bounds, _ = two_vehicles(2, seed)
    question = BoxQuestion(problem, limit, 0.9, bounds.lower, bounds.upper)
    largest = largest_box(question, seed=seed, effort=REPEATED)
    true = exact_share(problem, limit, largest.box)
    return true >= largest.verified.bound, true >= 0.9, largest.verified.share >= 0.9


def fleet_claims() -> list[Claim]:
    """Return what the box of the shipped fleet shows where no vehicle may become louder."""
    options = STUDY.Options(motion=MotionOptions(Motion.prescribed))
    model = STUDY.prepare(options)
    point = STUDY.pareto_point(model, options, lambda *_: None)
    study = STUDY.box_about(model, point, options, lambda *_: None)
    solution, check = study.solution, study.solution.verified
    where = "U06, none louder than today"
    return [
        at_most(f"{where}: seconds to the verified box", 60, solution.seconds, 1),
        at_least(
            f"{where}: bound of the verified share, {check.n_parts} parts [%]",
            95,
            100 * check.bound,
        ),
        at_least(
            f"{where}: width over ±15 %, geometric mean of the axes with an effect "
            f"({study.on_bounds.sum()} ends lie on bounds)",
            1,
            study.width_over_plain,
        ),
    ]


def claims() -> list[Claim]:
    """Measure volumes, shares and the shipped fleet."""
    seeds = {("plane", 2): 5, ("plane", 4): 5, ("plane", 12): 2}
    seeds |= {("bowl", 2): 5, ("QUAD2", 2): 5, ("QUAD2", 3): 2}
    tasks = [(*kind, seed) for kind, count in seeds.items() for seed in range(1, 1 + count)]
    tasks.sort(key=lambda task: -task[1])  # the longest first
    outcomes = dict(zip(tasks, in_processes(volume_ratio, tasks), strict=True))
    repeated = np.array(in_processes(repetition, range(1, REPETITIONS + 1)))
    lines = []
    for kind, count in seeds.items():
        ratios = [outcomes[task][0] for task in tasks if task[:2] == kind]
        lines.append(
            between(
                f"{kind[0]}, {kind[1]} variables: volume over the exact one, {count} instances",
                (0.98, 1.02),
                [min(ratios), max(ratios)],
                4,
            )
        )
    true_in, confirmed = (100 * np.mean([row[k] for row in outcomes.values()]) for k in (1, 2))
    lines += [
        at_least(
            f"of these {len(outcomes)} instances: true share at least its bound and the stated "
            "share; bound at least the stated share (two standard errors of reserve) [%]",
            [100, 90],
            [true_in, confirmed],
            0,
        ),
        at_least(
            f"{REPETITIONS} repetitions: true share above its 95 % bound; true share, and verified "
            "share, at least the stated one [%]",
            95,
            100 * repeated.mean(axis=0),
            1,
        ),
    ]
    return lines + fleet_claims()
