from __future__ import annotations

import pickle

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.vehicles.booming_model import BoomingIndex, booming_index, levels
from deboom.vehicles.fleet import Fleet, PathContributions, Vehicle, path_contributions
from deboom.vehicles.kernel_numpy import NUMPY

FREQUENCY = np.linspace(20.0, 60.0, 41)
VEHICLES = ("U06-1", "U06-2", "U06-3")
VARIABLES = ("TSM x", "TSM y", "TSM z", "Du x")


def _case(name, seed, frequency=FREQUENCY, vehicles=VEHICLES):
    rng = np.random.default_rng(seed)
    shape = (len(vehicles), frequency.size, len(VARIABLES))
    values = 1e-3 * (rng.normal(size=shape) + 1j * rng.normal(size=shape))
    return PathContributions(name, frequency, values, vehicles, VARIABLES)


ONE, TWO = _case("g5", 1), _case("g6", 2)
DESIGNS = np.random.default_rng(3).uniform(0.8, 1.2, (10, 4))


def test_splv_is_the_sum_of_the_levels_of_the_lines():
    found = BoomingIndex((ONE,), (1.0,), NUMPY)(DESIGNS)
    np.testing.assert_allclose(found, levels(ONE, DESIGNS).sum(axis=-1), rtol=0, atol=1e-10)


def test_weights_average_the_load_cases_and_are_normalised():
    found = BoomingIndex((ONE, TWO), (1.0, 3.0), NUMPY)
    expected = 0.25 * levels(ONE, DESIGNS).sum(-1) + 0.75 * levels(TWO, DESIGNS).sum(-1)
    assert found.weights == (0.25, 0.75)
    np.testing.assert_allclose(found(DESIGNS), expected, rtol=0, atol=1e-10)


def test_levels_of_each_load_case():
    index = BoomingIndex((ONE, TWO), (1.0, 3.0), NUMPY)
    assert index.load_case_names == ("g5", "g6")
    np.testing.assert_array_equal(index.frequency, FREQUENCY)
    np.testing.assert_array_equal(index.levels(DESIGNS), levels(ONE, DESIGNS))
    np.testing.assert_array_equal(index.levels(DESIGNS, "g6"), levels(TWO, DESIGNS))
    with pytest.raises(InputError, match=r"no load case 'g7' in the index: use one of"):
        index.levels(DESIGNS, "g7")


def test_a_load_case_of_weight_zero_takes_no_part():
    silent = PathContributions("g7", FREQUENCY, np.zeros((3, 41, 4)), VEHICLES, VARIABLES)
    found = BoomingIndex((silent, ONE), (0.0, 2.0), NUMPY)
    assert found.weights == (1.0,)
    np.testing.assert_array_equal(found(DESIGNS), BoomingIndex((ONE,), (1.0,), NUMPY)(DESIGNS))


def test_names_unit_and_lines():
    index = BoomingIndex((ONE,), (1.0,), NUMPY)
    assert index.variable_names == VARIABLES
    assert index.response_names == VEHICLES
    assert index.response_unit == "dB(A)"
    assert index.n_lines == 41
    assert index.kernel.name == "numpy"


def test_a_process_pool_can_carry_it():
    index = BoomingIndex((ONE, TWO), (1.0, 3.0), NUMPY)
    carried = pickle.loads(pickle.dumps(index))
    np.testing.assert_array_equal(carried(DESIGNS), index(DESIGNS))
    np.testing.assert_array_equal(carried.gradient(DESIGNS), index.gradient(DESIGNS))
    assert carried.variable_names == index.variable_names
    assert carried.response_names == index.response_names
    assert carried.weights == index.weights
    assert carried.kernel == index.kernel


def test_a_design_gives_the_same_bits_alone_and_in_a_batch():
    index = BoomingIndex((ONE, TWO), (1.0, 3.0), NUMPY)
    alone = np.concatenate([index(design[np.newaxis]) for design in DESIGNS[::-1]])
    np.testing.assert_array_equal(alone[::-1], index(DESIGNS))


def test_a_silenced_line_is_not_finite_for_that_design_only():
    values = np.ones((1, 2, 2), dtype=complex)
    values[0, 1, 1] = -1.0
    case = PathContributions("g5", FREQUENCY[:2], values, ("A",), ("x", "y"))
    index = BoomingIndex((case,), (1.0,), NUMPY)
    designs = np.array([[1.0, 1.0], [1.0, 0.5]])
    assert np.isneginf(index(designs)[0, 0])
    assert np.isfinite(index(designs)[1, 0])
    assert np.isnan(index.gradient(designs)[0]).all()
    assert np.isfinite(index.gradient(designs)[1]).all()


def test_built_from_a_fleet_it_equals_the_synthesis():
    mount = Mount("TSM", "strut", ("",), ((0.0, 0.0, 0.0),), ("x", "z"))
    rng = np.random.default_rng(4)
    channels = ("TSM x", "TSM z")

    def spectrum(unit):
        return Spectrum(FREQUENCY, rng.normal(size=(41, 2)) + 0.5j, channels, unit)

    def vehicle(name):
        values = rng.normal(size=(41, 1, 2)) + 0.1j
        return Vehicle(name, "A", Frf(FREQUENCY, values, ("ear",), channels, "Pa/N"))

    cases = [
        LoadCase(name, name, 5, 3.4, 220.0, 1.5, spectrum("m"), spectrum("N"))
        for name in ("g5", "g6")
    ]
    fleet = Fleet((vehicle("A-1"), vehicle("A-2")))
    band = (25.0, 40.0)
    weighted = list(zip(cases, (3.0, 1.0), strict=True))
    index = booming_index(fleet, (mount,), weighted, band, NUMPY)
    designs = rng.uniform(0.8, 1.2, (6, 3))
    first, second = (
        levels(path_contributions(fleet, (mount,), case, band), designs).sum(axis=-1)
        for case in cases
    )
    np.testing.assert_allclose(index(designs), 0.75 * first + 0.25 * second, rtol=0, atol=1e-10)
    assert index.n_lines == 16
    assert index.response_names == ("A-1", "A-2")


@pytest.mark.parametrize(
    ("cases", "weights", "message"),
    [
        ((ONE,), (1.0, 2.0), r"2 weights for the load cases \['g5'\]"),
        ((ONE, TWO), (1.0, -1.0), "load case g6: weight -1.0 is not"),
        ((ONE,), (np.nan,), "load case g5: weight nan is not"),
        ((ONE, TWO), (0.0, 0.0), r"\['g5', 'g6'\]: give at least one"),
        ((), (), r"\[\]: give at least one"),
        ((ONE, _case("g7", 5, FREQUENCY + 0.5)), (1.0, 1.0), "g5 and g7 differ"),
        ((ONE, _case("g7", 5, vehicles=("a", "b", "c"))), (1.0, 1.0), "g5 and g7 differ"),
    ],
)
def test_refuses(cases, weights, message):
    with pytest.raises(InputError, match=message):
        BoomingIndex(cases, weights, NUMPY)


def test_refuses_a_line_to_which_nothing_contributes():
    values = ONE.values.copy()
    values[1, 4] = 0.0
    case = PathContributions("g5", FREQUENCY, values, VEHICLES, VARIABLES)
    with pytest.raises(InputError, match=r"load case g5: no path .* in vehicle U06-2 at 24 Hz"):
        BoomingIndex((case,), (1.0,), NUMPY)


@pytest.mark.parametrize("method", ["__call__", "gradient"])
def test_refuses_designs_of_another_shape_or_not_finite(method):
    evaluate = getattr(BoomingIndex((ONE,), (1.0,), NUMPY), method)
    with pytest.raises(InputError, match=r"designs of shape \(4,\)"):
        evaluate(np.ones(4))
    with pytest.raises(InputError, match="design 0: the factor of TSM z is nan"):
        evaluate([[1.0, 1.0, np.nan, 1.0]])
