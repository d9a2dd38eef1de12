"""Shared part numbers against all partitions, and against answers known beforehand."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.commonality import _library, fewest_part_numbers, separate_sets
from deboom.explore.sharing import Sharing, SharingProblem, separate_optima, shared_design
from deboom.explore.space import DesignSpace


@dataclass(frozen=True, eq=False)
class Bowls:
    """Level of vehicle v: squared distance of its design from its own centre."""

    centres: np.ndarray

    @property
    def variable_names(self):
        """Of two parts with two axes, or with one."""
        return tuple(f"{part} {axis}" for part in "AB" for axis in "xz")[: self.centres.shape[1]]

    @property
    def response_names(self):
        """One per centre."""
        return tuple(f"car {n}" for n in range(1, len(self.centres) + 1))

    response_unit = "dB"

    def __call__(self, designs):
        """Return squared distances."""
        return np.einsum("nvk,nvk->nv", *2 * [designs[:, np.newaxis] - self.centres])

    def gradient(self, designs):
        """Return twice the distance."""
        return 2 * (designs[:, np.newaxis] - self.centres)


def problem_of(centres, radius, together=None):
    bowls = Bowls(np.asarray(centres, dtype=float))
    k = bowls.centres.shape[1]
    space = DesignSpace(
        bowls.variable_names, ("1",) * k, np.zeros(k), -3 * np.ones(k), 3 * np.ones(k), np.zeros(k)
    )
    parts = {
        part: [name for name in space.names if name.startswith(part)]
        for part in "AB"
        if any(name.startswith(part) for name in space.names)
    }
    limits = np.full(len(bowls.centres), radius**2)
    optima = separate_optima(bowls, space, starts=2, seed=1)
    return SharingProblem(bowls, space, parts, limits, together or {}), optima


def partitions(count):
    """Every way to number vehicles in the order of first use."""
    return [
        row
        for row in product(range(count), repeat=count)
        if all(n <= max(row[:place], default=-1) + 1 for place, n in enumerate(row))
    ]


def fewest_of_all(problem, optima):
    """Fewest numbers over every partition of every part."""
    best = None
    for rows in product(partitions(len(problem.vehicles)), repeat=len(problem.part_names)):
        sharing = Sharing(problem.part_names, problem.vehicles, np.array(rows))
        if best is not None and sharing.total >= best:
            continue
        if shared_design(problem, sharing, [optima.designs]).worst <= 1e-6:
            best = sharing.total
    return best


def test_two_clusters_of_one_part_and_one_of_the_other():
    # A: cars 1, 2 near -1 and cars 3, 4 near +1; B: the same for all
    centres = [[-1.0, 0, 0.5, 0], [-1.1, 0, 0.5, 0], [1.0, 0, 0.5, 0], [1.1, 0, 0.5, 0]]
    problem, optima = problem_of(centres, 0.06)
    first, second = _library(problem, optima)
    assert (len(optima.candidates), len(first), len(second)) == (4, 4, 1)
    assert first[0].tolist() == optima.designs[0, :2].tolist()
    said = []
    shared = fewest_part_numbers(problem, optima, step=lambda *step: said.append(step[:2]))
    assert (said[0], said[1], said[-1]) == ((0, 8), (1, 8), (8, 8))
    assert shared.fewest.sharing.counts == (2, 1)
    assert shared.fewest.sharing.numbers.tolist() == [[0, 0, 1, 1], [0, 0, 0, 0]]
    assert shared.fewest.sharing.members(0, 1) == ("car 3", "car 4")
    assert not shared.fewest.sharing.numbers.flags.writeable
    assert shared.lower_bound == 3
    # one number of each part lies in the middle: 1.05 away from the outermost
    assert shared.by_count[0].worst == pytest.approx(1.1**2 - 0.06**2, rel=1e-4)
    # two numbers of A: half of 0.1 away
    assert shared.by_count[1].worst == pytest.approx(0.05**2 - 0.06**2, rel=1e-3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_as_few_numbers_as_over_all_partitions(seed):
    random = np.random.default_rng(seed)
    problem, optima = problem_of(random.uniform(-1, 1, (4, 4)), random.uniform(0.5, 1.1))
    shared = fewest_part_numbers(problem, optima)
    assert shared.fewest.worst <= 0
    assert shared.fewest.sharing.total == fewest_of_all(problem, optima)
    assert shared.lower_bound <= shared.fewest.sharing.total


def test_limits_hold_and_the_rest_is_as_quiet_as_can_be():
    centres = [[-1.0, 0.0], [1.0, 0.0], [0.0, 0.0]]
    problem, optima = problem_of(centres, 1.5)
    shared = fewest_part_numbers(problem, optima)
    assert shared.fewest.sharing.total == 1
    # the least sum of squared distances is at the mean
    assert shared.fewest.designs == pytest.approx(np.zeros((3, 2)), abs=1e-3)
    # where only car 2 needs more, the sum goes down until its limit holds
    problem, optima = problem_of([[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0]], 1.2)
    shared = fewest_part_numbers(problem, optima)
    assert shared.fewest.designs == pytest.approx(np.tile([-0.2, 0.0], (3, 1)), abs=1e-3)


def test_vehicles_that_belong_together_share():
    centres = [[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 0.0]]
    problem, optima = problem_of(centres, 1.02, {"A": [["car 2", "car 3"]]})
    shared = fewest_part_numbers(problem, optima)
    numbers = shared.fewest.sharing.numbers[0]
    assert numbers[1] == numbers[2]
    assert shared.fewest.worst <= 0
    problem, optima = problem_of(centres, 0.5, {"A": [["car 1", "car 4"], ["car 4", "car 2"]]})
    with pytest.raises(InputError, match="loosen what belongs together"):
        fewest_part_numbers(problem, optima)


def test_every_set_gets_the_best_values_of_its_own():
    # the sets lie 1 and 0.2 about their middles; the second is not the worst and still counts
    centres = [[-1.0, 0.0], [1.0, 0.0], [-0.2, 0.0], [0.2, 0.0]]
    problem, optima = problem_of(centres, 0.5)
    sets = Sharing(problem.part_names, problem.vehicles, np.array([[0, 0, 1, 1]]))
    levels = separate_sets(problem, optima, sets).levels
    assert levels == pytest.approx([1.0, 1.0, 0.04, 0.04], abs=1e-4)


def test_an_unreachable_limit_names_the_vehicle_that_binds():
    problem, optima = problem_of([[-1.0, 0.0], [4.0, 0.0]], 0.5)
    with pytest.raises(
        InputError, match=r"car 2 cannot keep its limit of 0\.25 dB.*0\.75 too much"
    ):
        fewest_part_numbers(problem, optima)
