"""The smooth kernel: close to the exact one on smooth data, and silent on none that are not."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kernel_coupled as bench
from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.vehicles.booming_model import CoupledIndex
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED, solve_symmetric
from deboom.vehicles.kernel_smooth_numpy import ROWS, SMOOTH_COUPLED, SmoothCoupledKernel
from deboom.vehicles.line_interpolation import interpolation_over_lines
from kernel_smooth import smooth_problem

SHIPPED = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
SHAPES = (
    bench.Shape("four mounts", 40, 5, 321, 4, 0, 1),
    bench.Shape("as shipped", 40, 5, 161, 3, 2, 1),
    bench.Shape("odd", 40, 2, 83, 3, 1, 1),
)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.title)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_smooth_data_are_within_a_fifth_of_a_decibel_over_321_lines(shape, seed):
    motion, designs = smooth_problem(shape, seed), bench.designs(shape, seed + 10)
    found, exact = SMOOTH_COUPLED.prepare(motion)(designs), bench.batched(motion, designs)
    assert np.abs(found - exact).max() <= 0.2 * shape.n_lines / 321


def test_more_nodes_come_closer():
    motion, designs = smooth_problem(SHAPES[0]), bench.designs(SHAPES[0])
    exact = bench.batched(motion, designs)
    errors = [
        np.abs(SmoothCoupledKernel(n_nodes=n).prepare(motion)(designs) - exact).max()
        for n in (11, 13, 15)
    ]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


def test_constant_stiffness_and_load_need_seven_nodes():
    """Then determinant and adjugate are polynomials of degree six in one over ω²."""
    motion = smooth_problem(SHAPES[0])
    squared = motion.angular_frequency_squared[:, np.newaxis]
    constant = replace(
        motion,
        stiffness=np.tile(motion.stiffness[80], (321, 1)),
        load=squared * (motion.load[80] / squared[80]),
    )
    designs = bench.designs(SHAPES[0])
    found = SmoothCoupledKernel(n_nodes=7).prepare(constant)(designs)
    np.testing.assert_allclose(found, bench.batched(constant, designs), rtol=0, atol=5e-3)


def test_a_design_gives_the_same_bits_in_any_company_and_any_process():
    index = CoupledIndex((smooth_problem(SHAPES[2]),), (1.0,), SMOOTH_COUPLED)
    designs = np.random.default_rng(3).uniform(0.8, 1.2, (ROWS + 30, 12))
    whole = index(designs)
    for size in (1, 7, ROWS, ROWS + 1):
        parts = [index(designs[i : i + size]) for i in range(0, len(designs), size)]
        np.testing.assert_array_equal(np.concatenate(parts), whole)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(index))(designs), whole)
    assert index(np.empty((0, 12))).shape == (0, 2)


def test_designs_out_of_range_are_solved_exactly():
    motion = smooth_problem(SHAPES[2])
    smooth, exact = SMOOTH_COUPLED.prepare(motion), NUMPY_COUPLED.prepare(motion)
    designs = np.vstack([np.ones((2, 12)), np.full((1, 12), 1e9), np.zeros((1, 12))])
    found, expected = smooth(designs), exact(designs)
    np.testing.assert_array_equal(found[2:], expected[2:])
    np.testing.assert_array_equal(found[:2], smooth(designs[:2]))


@pytest.mark.parametrize("case", ["g5_wot220", "g7_wot220"])
def test_measured_spectra_are_refused(case):
    platform = read_platform(SHIPPED)
    motion = coupled_motion(
        platform.fleet.group("U06"),
        platform.mounts,
        platform.powertrain,
        platform.load_case(case),
    )
    with pytest.raises(InputError, match=rf"{case}: .*stiffness EnM y at .* exact kernel"):
        SMOOTH_COUPLED.prepare(motion)


def test_scatter_of_one_stiffness_is_refused_and_named():
    motion = smooth_problem(SHAPES[1])
    rough = motion.stiffness.copy()
    rough[:, 4] *= 1 + 0.03 * np.random.default_rng(1).normal(size=len(rough))
    with pytest.raises(InputError, match="stiffness m1 y at"):
        SMOOTH_COUPLED.prepare(replace(motion, stiffness=rough))


def test_too_few_lines_are_refused():
    shape = replace(SHAPES[1], n_lines=20)
    with pytest.raises(InputError, match="20 lines are too few to interpolate between 12"):
        SMOOTH_COUPLED.prepare(smooth_problem(shape))


def test_interpolation_is_exact_at_its_nodes_and_for_polynomials():
    frequency = np.linspace(20.0, 60.0, 161)
    found = interpolation_over_lines(frequency, 8)
    np.testing.assert_array_equal(found.weights[found.nodes], np.eye(8))
    assert found.nodes[0] == 0
    assert found.nodes[-1] == 160
    u = (20.0 / frequency) ** 2
    curves = np.column_stack([u**7, np.ones(161), np.sign(frequency - 31.0)])
    rough = found.roughness(curves)
    assert rough[:, :2].max() < 1e-12
    assert rough[:, 2].max() > 0.5
    assert interpolation_over_lines(frequency, 40).nodes.size == 40


def test_pivots_give_the_determinant():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(6, 6)) + 1j * rng.normal(size=(6, 6))
    matrix = root + root.T
    entries = {(i, j): matrix[i, j, np.newaxis] for i in range(6) for j in range(i + 1)}
    solution, inverse_pivots = solve_symmetric(entries, [np.ones(1)] * 6)
    np.testing.assert_allclose(np.ravel(solution), np.linalg.solve(matrix, np.ones(6)), rtol=1e-9)
    np.testing.assert_allclose(1 / np.prod(inverse_pivots), np.linalg.det(matrix), rtol=1e-9)
