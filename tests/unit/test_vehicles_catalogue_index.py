"""Parts as variables: every set is the index one would build of its parts."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

import kernel_coupled as bench
from deboom.errors import InputError
from deboom.mounts.mount import Mount
from deboom.vehicles.booming_model import (
    BoomingIndex,
    CatalogueIndex,
    CoupledIndex,
    composed_contributions,
    composed_motion,
)
from deboom.vehicles.fleet import PathContributions
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numpy import NUMPY

RNG = np.random.default_rng(2)
MOUNTS = tuple(Mount(name, "", ("",), ((0.0, 0.0, 0.0),), ("x", "y", "z")) for name in "ABC")
NAMES = tuple(name for mount in MOUNTS for name in mount.variables)
VALUES = RNG.normal(size=(3, 2, 21, 9)) + 1j * RNG.normal(size=(3, 2, 21, 9))
N_PARTS = (3, 2, 3)


def contributions(values):
    return PathContributions("run", np.arange(20.0, 41.0), values, ("one", "two"), NAMES)


def prescribed():
    levels = tuple(BoomingIndex((contributions(v),), (1.0,), NUMPY) for v in VALUES)
    return CatalogueIndex(MOUNTS, levels, N_PARTS, composed_contributions)


def test_a_set_is_the_index_of_its_parts():
    index = prescribed()
    sets = np.array([[0, 0, 0], [2, 1, 0], [1, 0, 2], [2, 1, 0]], dtype=float)
    factors = 0.8 + 0.4 * RNG.random((4, 9))
    found = index(np.hstack([sets, factors]))
    for row, numbers, design in zip(found, sets.astype(int), factors, strict=True):
        columns = [VALUES[number][:, :, 3 * m : 3 * m + 3] for m, number in enumerate(numbers)]
        alone = BoomingIndex((contributions(np.concatenate(columns, axis=2)),), (1.0,), NUMPY)
        np.testing.assert_array_equal(row, alone(design[None])[0])


def test_coupled_sets_have_their_stiffness_and_todays_load():
    shape = bench.Shape("small", 4, 3, 41, 3, 2, 4)
    motions = [bench.problem(shape, 1)]
    motions.append(
        replace(motions[0], stiffness=1.3 * motions[0].stiffness, load=2 * motions[0].load)
    )
    option = np.zeros(len(motions[0].variable_names), dtype=np.intp)
    option[: option.size // 2] = 1
    mixed = composed_motion(motions, option)
    np.testing.assert_array_equal(mixed.load, motions[0].load)
    factor = np.where(option == 1, 1.3, 1.0)
    ones = np.ones((1, option.size))
    plain = CoupledIndex((motions[0],), (1.0,), NUMPY_COUPLED)
    found = CoupledIndex((mixed,), (1.0,), NUMPY_COUPLED)
    on_body = np.isin(np.arange(option.size), motions[0].variables)
    scaled = np.where(on_body, factor, 1.0)
    np.testing.assert_allclose(found(ones), plain(scaled[None]), atol=1e-9)


def test_names_and_a_process_pool():
    index = prescribed()
    assert index.variable_names == ("A part", "B part", "C part", *NAMES)
    assert (index.response_names, index.n_lines) == (("one", "two"), 21)
    carried = pickle.loads(pickle.dumps(index))
    design = np.array([[1, 1, 1, *np.ones(9)]])
    np.testing.assert_array_equal(carried(design), index(design))


@pytest.mark.parametrize(
    ("parts", "sentence"),
    [([0, 2, 0], "no set of parts"), ([0.5, 0, 0], "part numbers are whole")],
)
def test_numbers_of_no_part_are_refused(parts, sentence):
    with pytest.raises(InputError, match=sentence):
        prescribed()(np.array([[*parts, *np.ones(9)]]))


def test_more_parts_than_levels_are_refused():
    with pytest.raises(InputError, match="at least one part"):
        replace(prescribed(), n_parts=(3, 4, 1))
