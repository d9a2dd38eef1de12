"""Sums of levels, compiled and plain: bit-stable, and right where products leave the range."""

from __future__ import annotations

import itertools
import pickle
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from deboom.vehicles import kernels
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.fleet import ROWS, PathContributions
from deboom.vehicles.kernels import LevelSum, level_sum
from samples import drawn_cars

SHAPE = drawn_cars.Shape("small", 40, 3, 101, 3, 2, 7)
CASES = {motion: problem(SHAPE) for motion, problem in drawn_cars.PROBLEMS.items()}
DESIGNS = drawn_cars.designs(SHAPE)
TIERS = pytest.mark.parametrize("compiled", [False, True])
MOTIONS = pytest.mark.parametrize("motion", list(Motion))


def contributions(values):
    n_vehicle, n_lines, n_variable = np.shape(values)
    names = tuple(f"m{k} x" for k in range(n_variable))
    lines = np.linspace(20.0, 60.0, n_lines)
    return PathContributions("drawn", lines, values, tuple("ABCDE"[:n_vehicle]), names)


def random(n_vehicle=3, n_lines=101, n_variable=10, seed=1):
    rng = np.random.default_rng(seed)
    shape = (n_vehicle, n_lines, n_variable)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def uniform(n, n_variable, seed=2):
    return np.random.default_rng(seed).uniform(0.6, 1.4, (n, n_variable))


def assert_same_bits_in_any_company(summed, designs, sizes):
    whole = summed(designs)
    for size in sizes:
        parts = [summed(designs[i : i + size]) for i in range(0, len(designs), size)]
        np.testing.assert_array_equal(np.concatenate(parts), whole)
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(designs))
        np.testing.assert_array_equal(summed(designs[order]), whole[order])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(summed))(designs), whole)
    before = designs.copy()
    np.testing.assert_array_equal(summed(np.repeat(designs, 2, axis=1)[:, ::2]), whole)
    np.testing.assert_array_equal(designs, before)
    assert summed(designs[:0]).shape == (0, whole.shape[1])


@TIERS
def test_products_of_several_parts_keep_the_bits_of_a_design(compiled):
    summed = level_sum(contributions(random(2, 385, 12)), compiled=compiled)
    designs = uniform(2 * ROWS + 61, 12)
    assert_same_bits_in_any_company(summed, designs, (1, 100, ROWS - 1, ROWS, ROWS + 1))


@MOTIONS
@TIERS
def test_a_design_gives_the_same_bits_in_any_company(motion, compiled):
    n = 16 if motion is Motion.amplitude and not compiled else 269
    summed = level_sum(CASES[motion], compiled=compiled)
    assert (summed.tables is not None) == compiled
    assert_same_bits_in_any_company(summed, DESIGNS[:n], (1, 7, 63, 64, 65, 128))


@MOTIONS
def test_tiers_agree(motion, monkeypatch):
    plain = level_sum(CASES[motion], compiled=False)(DESIGNS)
    monkeypatch.setattr(LevelSum, "_plain", None)  # no design falls back on numpy
    compiled = level_sum(CASES[motion], compiled=True)(DESIGNS)
    np.testing.assert_allclose(compiled, plain, rtol=0, atol=1e-9)
    notch = kernels._line_exponents(np.array([[[8.0, -8.0, 1e-9]]]))
    assert 2.0 ** notch.item() == pytest.approx(8e-3, rel=1)


def test_tiers_agree_where_each_spring_has_an_elastic_and_a_lossy_part():
    shape = drawn_cars.Shape("one mount", 4, 3, 41, 1, 1, 2)
    case, designs = drawn_cars.coupled_problem(shape).with_loss_factors(), drawn_cars.designs(shape)
    both = np.hstack([designs, designs * designs[::-1]])
    plain, compiled = (level_sum(case, compiled=tier)(both) for tier in (False, True))
    np.testing.assert_allclose(compiled, plain, rtol=0, atol=1e-9)


@MOTIONS
def test_neighbours_out_of_range_change_no_bit_and_are_right_themselves(motion):
    plain, compiled = (level_sum(CASES[motion], compiled=tier) for tier in (False, True))
    designs = DESIGNS[:140]
    crowd = designs.copy()
    crowd[[3, 70]] = designs[[3, 70]] * [[1e-5], [1e5]]
    sums = compiled(crowd)
    ordinary = np.setdiff1d(np.arange(len(designs)), [3, 70])
    np.testing.assert_array_equal(sums[ordinary], compiled(designs)[ordinary])
    np.testing.assert_array_equal(sums[[3, 70]], plain(crowd[[3, 70]]))
    assert np.isfinite(sums).all()


@pytest.mark.parametrize("motion", [Motion.coupled, Motion.amplitude])
def test_tilted_mounts_are_compiled(motion, monkeypatch):
    case = drawn_cars.tilted(CASES[motion])
    n = 16 if motion is Motion.amplitude else 128
    plain, compiled = (level_sum(case, compiled=tier) for tier in (False, True))
    assert compiled.tables is not None
    expected = plain(DESIGNS[:n])
    monkeypatch.setattr(LevelSum, "_plain", None)  # no design falls back on numpy
    np.testing.assert_allclose(compiled(DESIGNS[:n]), expected, rtol=0, atol=1e-9)
    assert_same_bits_in_any_company(compiled, DESIGNS[:n], (1, 7, 64))


def test_bodies_that_give_way_are_compiled(monkeypatch):
    shape = drawn_cars.Shape("small", 20, 2, 21, 3, 2, 4)
    case, rows = drawn_cars.flexible_problem(shape), drawn_cars.designs(shape)
    plain, compiled = (level_sum(case, compiled=tier) for tier in (False, True))
    expected = plain(rows)
    monkeypatch.setattr(LevelSum, "_plain", None)  # no design falls back on numpy
    np.testing.assert_allclose(compiled(rows), expected, rtol=0, atol=1e-9)
    assert_same_bits_in_any_company(compiled, rows, (1, 7, 16))


def test_bodies_that_the_loops_do_not_know_are_computed_in_numpy():
    motion = CASES[Motion.coupled]
    end = replace(motion.bodies[1], forward=np.full((1, 1), 0.5))
    other = level_sum(replace(motion, bodies=(motion.bodies[0], end)), compiled=True)
    assert other.tables is None
    assert level_sum(motion, compiled=True).tables is not None
    assert np.isfinite(other(DESIGNS[:3])).all()


@TIERS
def test_a_design_gives_the_same_bits_beside_one_that_overflows_and_one_that_is_silent(compiled):
    values = random(3, 161, 12)
    values[:, 20, 1:] = 0.0  # the first factor alone rules this line
    summed = level_sum(contributions(values), compiled=compiled)
    designs = uniform(60, 12)
    alone = summed(designs)
    assert np.isfinite(alone).all()
    for i, factor in itertools.product((0, 31, 60), (1e-30, 1e30)):
        crowd = np.insert(designs, i, designs[5] * factor, axis=0)
        crowd = np.insert(crowd, 17, np.eye(12)[0] == 0.0, axis=0)
        sums = summed(crowd)
        assert np.isneginf(sums[17]).all()
        ordinary = np.delete(sums, [17, i if i < 17 else i + 1], axis=0)
        np.testing.assert_array_equal(ordinary, alone)


@TIERS
def test_silence_is_minus_infinity_of_that_design_and_vehicle_only(compiled):
    values = np.ones((2, 5, 2), dtype=complex)
    values[0, 3] = [1.0, -1.0]
    values[1, :, 1] = 2.0
    summed = level_sum(contributions(values), compiled=compiled)
    sums = summed(np.array([[1.0, 1.0], [1.0, 0.5], [2.0, 2.0]]))
    silent = [[True, False], [False, False], [True, False]]
    np.testing.assert_array_equal(np.isneginf(sums), silent)
    assert sums[1, 1] == pytest.approx(5 * 20 * np.log10(2.0))
    nothing = level_sum(contributions(np.zeros((1, 5, 2))), compiled=compiled)
    assert np.isneginf(nothing(np.ones((3, 2)))).all()


@TIERS
def test_variables_without_effect_have_none(compiled):
    values = random(2, 161, 12)
    values[:, :, [1, 4]] = 0.0
    prescribed, designs = level_sum(contributions(values), compiled=compiled), uniform(50, 12)
    other = designs.copy()
    other[:, [1, 4]] = 1e300
    np.testing.assert_array_equal(prescribed(designs), prescribed(other))
    coupled, other = level_sum(CASES[Motion.coupled], compiled=compiled), DESIGNS[:50].copy()
    other[:, 10:] = 1e300
    np.testing.assert_array_equal(coupled(DESIGNS[:50]), coupled(other))


def test_blas_threads_do_not_matter_and_are_given_back():
    def blas_threads():
        return [lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"]

    summed, designs = level_sum(contributions(random(5, 161, 12)), compiled=False), uniform(300, 12)
    results = []
    for n_threads in (1, 2, 3):
        with threadpool_limits(n_threads, user_api="blas"):
            before = blas_threads()
            results.append(summed(designs))
            assert blas_threads() == before
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[0], results[2])


@pytest.mark.parametrize(("options", "kernel"), [({}, "numba"), ({"compiled": False}, "numpy")])
def test_a_model_names_what_sums_its_levels(options, kernel):
    from deboom.vehicles.booming_model import BoomingModel

    model = BoomingModel((CASES[Motion.coupled],), (1.0,), **options)
    assert model.kernel == kernel
    assert np.isfinite(model(DESIGNS[:2])).all()
