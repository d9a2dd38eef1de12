"""The coupled seam: the same promises as the prescribed one."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

import kernel_coupled as bench
from deboom.errors import InputError
from deboom.vehicles.booming_model import CoupledIndex
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED, ROWS

SHAPE = bench.Shape("small", 4, 3, 41, 3, 2, 4)
ONE, TWO = replace(bench.problem(SHAPE, 1), load_case="g5"), bench.problem(SHAPE, 2)
DESIGNS = bench.designs(SHAPE)


def test_splv_is_the_sum_of_the_levels_of_the_lines():
    index = CoupledIndex((ONE, TWO), (1.0, 3.0), NUMPY_COUPLED)
    levels = [index.levels(DESIGNS, case).sum(axis=-1) for case in ("g5", "drawn 2")]
    assert index.weights == (0.25, 0.75)
    expected = 0.25 * levels[0] + 0.75 * levels[1]
    np.testing.assert_allclose(index(DESIGNS), expected, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(index.levels(DESIGNS), index.levels(DESIGNS, "g5"))


def test_names_unit_and_lines():
    index = CoupledIndex((ONE, TWO), (1.0, 1.0), NUMPY_COUPLED)
    assert index.variable_names == ONE.variable_names
    assert index.response_names == ONE.vehicle_names
    assert index.response_unit == "dB(A)"
    assert index.n_lines == 41
    assert index.load_case_names == ("g5", "drawn 2")
    assert index.kernel.name == "numpy"
    np.testing.assert_array_equal(index.frequency, ONE.frequency)


def test_a_process_pool_can_carry_it():
    index = CoupledIndex((ONE, TWO), (1.0, 3.0), NUMPY_COUPLED)
    carried = pickle.loads(pickle.dumps(index))
    np.testing.assert_array_equal(carried(DESIGNS), index(DESIGNS))
    np.testing.assert_array_equal(carried.gradient(DESIGNS), index.gradient(DESIGNS))


def test_a_design_gives_the_same_bits_in_any_company():
    index = CoupledIndex((ONE,), (1.0,), NUMPY_COUPLED)
    designs = np.random.default_rng(3).uniform(0.8, 1.2, (ROWS + 30, 12))
    whole = index(designs)
    for size in (1, 7, ROWS, ROWS + 1):
        parts = [index(designs[i : i + size]) for i in range(0, len(designs), size)]
        np.testing.assert_array_equal(np.concatenate(parts), whole)
    order = np.random.default_rng(4).permutation(len(designs))
    np.testing.assert_array_equal(index(designs[order]), whole[order])
    assert index(np.empty((0, 12))).shape == (0, 3)


def test_null_factors_have_no_effect_at_all():
    index = CoupledIndex((ONE,), (1.0,), NUMPY_COUPLED)
    other = DESIGNS.copy()
    other[:, 10:] = 7.0
    np.testing.assert_array_equal(index(DESIGNS), index(other))
    assert not index.gradient(DESIGNS)[:, :, 10:].any()


def test_without_inertia_a_common_factor_changes_no_level():
    """Forces then balance the load whatever the stiffness, and ``Σ_k x_k ∂SPLV/∂x_k = 0``."""
    light = replace(
        ONE,
        mass_matrix=1e-9 * ONE.mass_matrix,
        own_mass=1e-9 * ONE.own_mass,
    )
    found = CoupledIndex((light,), (1.0,), NUMPY_COUPLED).gradient(DESIGNS)
    common = np.einsum("dvk,dk->dv", found, DESIGNS)
    np.testing.assert_allclose(common, 0.0, atol=1e-3)


def test_refuses_load_cases_that_do_not_fit_and_silent_lines():
    other = replace(TWO, frequency=TWO.frequency + 0.5)
    with pytest.raises(InputError, match="g5 and drawn 2 differ"):
        CoupledIndex((ONE, other), (1.0, 1.0), NUMPY_COUPLED)
    transfer, own = ONE.transfer.copy(), ONE.own_transfer.copy()
    transfer[1, 4] = own[1, 4] = 0.0
    silent = replace(ONE, transfer=transfer, own_transfer=own)
    with pytest.raises(InputError, match=r"no path contributes .* vehicle 1 at 24 Hz"):
        CoupledIndex((silent,), (1.0,), NUMPY_COUPLED)


def test_refuses_an_unknown_load_case_and_bad_designs():
    index = CoupledIndex((ONE,), (1.0,), NUMPY_COUPLED)
    with pytest.raises(InputError, match=r"no load case 'g9' in the index: use one of \['g5'\]"):
        index.levels(DESIGNS, "g9")
    for evaluate in (index, index.levels, index.gradient):
        with pytest.raises(InputError, match=r"designs of shape \(12,\)"):
            evaluate(np.ones(12))
