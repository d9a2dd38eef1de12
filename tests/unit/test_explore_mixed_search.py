"""Whole-number variables beside continuous ones: no order among options, found, repeatable."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.checkpoint import Checkpoint
from deboom.explore.design_space import DesignSpace
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.fronts import pareto_front
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import sobol_sample
from deboom.files.checkpoint import CheckpointFolder

OPTIONS = (5, 4, 6)
NAMES = ("a part", "b part", "c part", "x", "y")
TABLES = [np.random.default_rng(7 + k).random((count, 2)) for k, count in enumerate(OPTIONS)]


def levels(designs):
    """Two responses: a random number per option, and a valley in x and y."""
    chosen = [table[designs[:, k].astype(int)] for k, table in enumerate(TABLES)]
    valley = (designs[:, 3:] - [[0.9, 1.1]]) ** 2
    return 3.0 + sum(chosen) + 10.0 * valley


MODEL = ResponseFunction(levels, NAMES, ("one", "two"), "1")
SPACE = DesignSpace(
    names=NAMES,
    units=("1",) * 5,
    nominal=np.array([0, 0, 0, 1.0, 1.0]),
    lower=np.array([0, 0, 0, 0.8, 0.8]),
    upper=np.array([4, 3, 5, 1.2, 1.2]),
    tolerance=np.array([0, 0, 0, 0.15, 0.15]),
    integer=np.array([True, True, True, False, False]),
)
ROBUST = RobustResponse(MODEL, SPACE, sobol_sample(5, 16, seed=1))


class _Recording:
    """Remembers every design that is asked for."""

    def __init__(self, robust):
        self.robust, self.space, self.asked = robust, robust.space, []

    def __call__(self, designs):
        self.asked.append(designs.copy())
        return self.robust(designs)


def test_every_design_of_a_search_has_whole_numbers_within_their_bounds():
    recording = _Recording(ROBUST)
    nsga2(recording, 20, 15, seed=1)
    asked = np.concatenate(recording.asked)
    whole = asked[:, :3]
    np.testing.assert_array_equal(whole, np.floor(whole))
    assert np.all((whole >= SPACE.lower[:3]) & (whole <= SPACE.upper[:3]))
    assert all(set(whole[:, k]) == set(range(count)) for k, count in enumerate(OPTIONS))
    assert len(np.unique(asked[:, 3])) > 100


def test_first_draws_are_even_over_the_options():
    recording = _Recording(ROBUST)
    nsga2(recording, 600, 1, seed=1)
    for k, count in enumerate(OPTIONS):
        share = np.bincount(recording.asked[0][:, k].astype(int), minlength=count) / 600
        np.testing.assert_allclose(share, 1 / count, atol=4 * np.sqrt(1 / count / 600))


def test_the_front_of_options_alone_is_that_of_all_sets():
    fixed = replace(SPACE, lower=np.array([0, 0, 0, 1, 1]), upper=np.array([4, 3, 5, 1, 1]))
    robust = replace(ROBUST, space=fixed)
    sets = np.array(list(itertools.product(*map(range, OPTIONS))), dtype=float)
    truth = pareto_front(robust(np.hstack([sets, np.ones((len(sets), 2))])))
    found = nsga2(robust, 20, 40, seed=1).front
    np.testing.assert_array_equal(found.designs, truth.designs)


def test_options_and_factors_are_found_together():
    found = nsga2(ROBUST, 40, 40, seed=1).front.designs[0]
    sets = np.array(list(itertools.product(*map(range, OPTIONS))), dtype=float)
    best = min(sets, key=lambda row: levels(np.array([[*row, 0.9, 1.1]])).sum())
    np.testing.assert_array_equal(found[:3], best)
    np.testing.assert_allclose(found[3:], [0.9, 1.1], atol=0.02)


def test_one_seed_gives_one_front_and_another_another_way():
    first, again, other = (nsga2(ROBUST, 20, 6, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.front.designs, again.front.designs)
    assert not np.array_equal(first.hypervolume, other.hypervolume)


def test_a_stopped_search_goes_on_bit_for_bit_from_its_folder(tmp_path):
    class Stop(Exception):
        pass

    class Stopping(_Recording):
        def __call__(self, designs):
            if len(self.asked) == 7:
                raise Stop
            return super().__call__(designs)

    whole = nsga2(ROBUST, 20, 12, seed=5)
    kept = Checkpoint(CheckpointFolder(tmp_path / "search", {}), every=3)
    with pytest.raises(Stop):
        nsga2(Stopping(ROBUST), 20, 12, seed=5, checkpoint=kept)
    again = nsga2(ROBUST, 20, 12, seed=5, checkpoint=kept)
    np.testing.assert_array_equal(again.front.designs, whole.front.designs)
    np.testing.assert_array_equal(again.hypervolume, whole.hypervolume)


@pytest.mark.parametrize(
    "changes",
    [
        {"upper": np.array([4, 3, 5.5, 1.2, 1.2])},
        {"nominal": np.array([0.5, 0, 0, 1, 1])},
        {"tolerance": np.array([0.1, 0, 0, 0.15, 0.15])},
    ],
)
def test_a_fraction_or_a_tolerance_is_refused(changes):
    with pytest.raises(InputError, match="takes whole numbers"):
        replace(SPACE, **changes)
