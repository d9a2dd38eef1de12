"""Sums of levels against plain loops, long double, LAPACK, and data that break a plain product."""

import math
from dataclasses import replace

import numpy as np
import pytest

from deboom.vehicles.fleet import PathContributions
from deboom.vehicles.kernels import level_sum
from samples import drawn_cars

WITHIN = 1e-9
"""What a sum over all lines may be off [dB]."""

TIERS = pytest.mark.parametrize("compiled", [False, True])


def _sums(values, designs, compiled):
    n_vehicle, n_lines, n_variable = values.shape
    names = tuple(f"m{k} x" for k in range(n_variable))
    lines = np.linspace(20.0, 60.0, n_lines)
    case = PathContributions("drawn", lines, values, tuple("ABCDE"[:n_vehicle]), names)
    return level_sum(case, compiled=compiled)(designs)


def _loop(contributions, designs):
    """``Σ_f 20 lg |Σ_k x_k C_fk|`` with Python's own complex numbers."""
    return np.array(
        [
            [
                math.fsum(
                    20.0 * math.log10(abs(sum(x * c for x, c in zip(design, line, strict=True))))
                    for line in vehicle
                )
                for vehicle in contributions.tolist()
            ]
            for design in designs.tolist()
        ]
    )


def _long_double(contributions, designs):
    x = designs.astype(np.longdouble)
    real = np.einsum("vfk,dk->dvf", contributions.real.astype(np.longdouble), x)
    imaginary = np.einsum("vfk,dk->dvf", contributions.imag.astype(np.longdouble), x)
    return (10 * np.log10(real**2 + imaginary**2)).sum(axis=-1).astype(float)


def _random(n_vehicle, n_lines, n_variable, seed):
    rng = np.random.default_rng(seed)
    shape = (n_vehicle, n_lines, n_variable)
    return 1e-3 * (rng.normal(size=shape) + 1j * rng.normal(size=shape))


def _perturbed(n, n_variable, seed):
    """Designs within 20 % and their manufacturing scatter of 5 %."""
    rng = np.random.default_rng(seed)
    shape = (n, n_variable)
    return rng.uniform(0.8, 1.2, shape) * (1 + 0.05 * rng.normal(size=shape))


@TIERS
@pytest.mark.parametrize(("n_lines", "n_variable"), [(1, 2), (41, 12), (161, 12), (401, 12)])
def test_random_data_agree_with_loops(n_lines, n_variable, compiled):
    contributions = _random(3, n_lines, n_variable, seed=n_lines)
    designs = _perturbed(7, n_variable, seed=2)
    sums = _sums(contributions, designs, compiled)
    np.testing.assert_allclose(sums, _loop(contributions, designs), rtol=0, atol=WITHIN)


@TIERS
@pytest.mark.parametrize("depth", [40.0, 60.0, 80.0])
def test_notches_at_every_line_agree_with_long_double(depth, compiled):
    """The nominal design cancels at all lines, down to `depth` dB below its largest path."""
    contributions = _random(5, 161, 12, seed=4)
    rest = contributions[:, :, :-1].sum(axis=2)
    largest = np.abs(contributions).max(axis=2)
    phase = np.exp(2j * np.pi * np.random.default_rng(5).uniform(size=largest.shape))
    contributions[:, :, -1] = -rest + 10 ** (-depth / 20) * largest * phase
    near = 1 + np.outer([0.0, 1e-5, 1e-4, 1e-3], np.random.default_rng(6).normal(size=12))
    designs = np.vstack([near, _perturbed(200, 12, seed=7)])
    sums = _sums(contributions, designs, compiled)
    np.testing.assert_allclose(sums, _long_double(contributions, designs), rtol=0, atol=WITHIN)


@TIERS
@pytest.mark.parametrize("factor", [1e-200, 1e-100, 1e-12, 1e12, 1e100, 1e200])
def test_extreme_contributions_and_designs_shift_the_sum_and_no_more(factor, compiled):
    contributions, designs = _random(2, 161, 12, seed=8), _perturbed(9, 12, seed=9)
    expected = _loop(contributions, designs) + 161 * 20 * math.log10(factor)
    for sums in (
        _sums(contributions * factor, designs, compiled),
        _sums(contributions, designs * factor, compiled),
    ):
        np.testing.assert_allclose(sums, expected, rtol=1e-14, atol=WITHIN)


@TIERS
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_products_that_leave_the_range_on_the_way_and_come_back(sign, compiled):
    """Quiet lines first and loud lines after them, or the other way round.

    The product of |p|² is near 1 at its end. On the way it reaches 10^(±40 decades): the smallest
    doubles, where digits get lost one by one, then zero, or infinity.
    """
    contributions = np.zeros((1, 160, 2), dtype=complex)
    rng = np.random.default_rng(10)
    contributions[0, :80, 0] = np.exp(2j * np.pi * rng.uniform(size=80)) * rng.uniform(0.5, 1, 80)
    contributions[0, 80:, 1] = np.exp(2j * np.pi * rng.uniform(size=80)) * rng.uniform(0.5, 1, 80)
    # between two lines of the loop's groups, too
    contributions[0, 7:72] = contributions[0, 87:152]
    for decades in np.arange(1.0, 12.0, 0.125):
        quiet = 10.0 ** (-sign * decades)
        designs = np.array([[quiet, 1 / quiet], [1.0, 1.0], [quiet, 1.0]])
        sums = _sums(contributions, designs, compiled)
        np.testing.assert_allclose(
            sums, _loop(contributions, designs), rtol=1e-14, atol=WITHIN, err_msg=str(decades)
        )


@TIERS
def test_one_path_200_decades_below_another_still_counts_alone(compiled):
    contributions = np.array([[[1.0, 3e-200], [1.0, 4e-200j]]])
    sums = _sums(contributions, np.array([[0.0, 1.0], [1.0, 1.0]]), compiled)
    expected = 20 * (math.log10(12.0) - 400)
    np.testing.assert_allclose(sums[:, 0], [expected, 0.0], rtol=1e-14, atol=1e-12)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_coupled_motion_agrees_with_lapack_at_small_losses(seed):
    """No pivots are needed: with losses twenty times too small resonances are sharp."""
    shape = drawn_cars.Shape("as shipped", 64, 5, 161, 3, 2, 1)
    motion, designs = drawn_cars.coupled_problem(shape, seed), drawn_cars.designs(shape, seed)
    for loss in (1.0, 0.05):
        stiffness = motion.stiffness.real + 1j * loss * motion.stiffness.imag
        resonant = motion.with_stiffness(stiffness)
        sums = level_sum(resonant, compiled=True)(designs)
        np.testing.assert_allclose(sums, drawn_cars.at_once(resonant, designs), rtol=0, atol=WITHIN)


def test_amplitudes_of_a_body_off_its_reference_point_agree_with_numpy():
    """Complex cubics, and a centre of gravity beside the reference point."""
    shape = drawn_cars.Shape("small", 2, 3, 21, 3, 2, 4)
    motion, designs = drawn_cars.amplitude_problem(shape), drawn_cars.designs(shape)
    powertrain, *wheel_ends = motion.bodies
    x, y, z = 0.11, -0.07, 0.05
    turn = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    mass = powertrain.mass_matrix + 0.0
    mass[3:, 3:] += mass[0, 0] * turn.T @ turn
    mass[:3, 3:], mass[3:, :3] = mass[0, 0] * turn, mass[0, 0] * turn.T
    bodies = replace(powertrain, mass_matrix=mass), *wheel_ends
    motion = replace(motion, bodies=bodies, tolerance=1e-11)
    loops, plain = (level_sum(motion, compiled=compiled) for compiled in (True, False))
    assert loops.tables is not None
    np.testing.assert_allclose(loops(designs), plain(designs), rtol=0, atol=1e-8)
