"""Loss factors as variables: the split parts add up, and mean what they say."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

import kernel_coupled as bench
from deboom.errors import InputError
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.vehicles.booming_model import (
    CoupledIndex,
    LossFactorIndex,
    booming_index,
    booming_loss_index,
    split_forces,
)
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numpy import NUMPY
from deboom.vehicles.kernel_split_numpy import NUMPY_SPLIT, split_motion

RNG = np.random.default_rng(5)
FREQUENCY = np.arange(20.0, 41.0)
MOUNTS = (
    Mount("A", "", ("",), ((0.0, 0.4, 0.2),), ("x", "y", "z")),
    Mount("B", "", ("left", "right"), ((0.1, -0.4, 0.2), (0.1, 0.4, 0.2)), ("x",)),
)
CHANNELS = tuple(name for mount in MOUNTS for axis in "xyz" for name in mount.channels(axis))
PATHS = tuple(path for mount in MOUNTS for path in mount.paths)


def drawn(*shape):
    return RNG.normal(size=shape) + 1j * RNG.normal(size=shape)


MOTION = drawn(FREQUENCY.size, len(CHANNELS)) * 1e-4
STIFFNESS = (1.0 + RNG.random((FREQUENCY.size, len(CHANNELS)))) * (1e5 + 2e4j)
FLEET = Fleet(
    tuple(
        Vehicle(
            name, "G", Frf(FREQUENCY, drawn(FREQUENCY.size, 1, len(PATHS)), ("ear",), PATHS, "Pa/N")
        )
        for name in ("one", "two")
    )
)
BAND = (20.0, 40.0)
FACTORS = 0.8 + 0.4 * RNG.random((5, 12))  # six of stiffness, six of loss


def load_case(stiffness):
    return LoadCase(
        *("run", "", 5, 4.0, 220.0, 1.5),
        Spectrum(FREQUENCY, MOTION, CHANNELS, "m"),
        Spectrum(FREQUENCY, stiffness * MOTION, CHANNELS, "N"),
    )


def prescribed(stiffness=STIFFNESS):
    return booming_loss_index(FLEET, MOUNTS, [(load_case(stiffness), 1.0)], BAND, NUMPY)


SHAPE = bench.Shape("small", 4, 3, 41, 3, 2, 4)
COUPLED = bench.problem(SHAPE, 1)


def coupled(motion=COUPLED):
    return LossFactorIndex(CoupledIndex((split_motion(motion),), (1.0,), NUMPY_SPLIT))


def test_without_a_change_of_losses_it_is_the_index_without_them():
    stiffness = FACTORS[:, :6]
    plain = booming_index(FLEET, MOUNTS, [(load_case(STIFFNESS), 1.0)], BAND, NUMPY)
    both = np.hstack([stiffness, np.ones_like(stiffness)])
    np.testing.assert_allclose(prescribed()(both), plain(stiffness), atol=1e-9)
    designs = bench.designs(SHAPE)
    exact = CoupledIndex((COUPLED,), (1.0,), NUMPY_COUPLED)
    both = np.hstack([designs, np.ones_like(designs)])
    np.testing.assert_allclose(coupled()(both), exact(designs), atol=1e-9)


def test_a_loss_factor_multiplies_the_imaginary_part_of_its_direction_alone():
    """Mount A in z, measured with 1.2 times its K'': the loss factor 1.2 says the same."""
    lossier = STIFFNESS.copy()
    column = CHANNELS.index("A z")
    lossier[:, column] = STIFFNESS[:, column].real + 1.2j * STIFFNESS[:, column].imag
    design = np.ones((1, 12))
    design[0, prescribed().variable_names.index("A z loss")] = 1.2
    np.testing.assert_allclose(
        prescribed()(design), prescribed(lossier)(np.ones((1, 12))), atol=1e-9
    )


def test_the_same_in_coupled_motion_with_bodies_of_their_own():
    factor = np.full(COUPLED.stiffness.shape[1], 1.3)
    lossier = replace(
        COUPLED,
        stiffness=COUPLED.stiffness.real + 1j * factor * COUPLED.stiffness.imag,
        own_stiffness=COUPLED.own_stiffness.real + 1.3j * COUPLED.own_stiffness.imag,
    )
    ones = np.ones((1, len(COUPLED.variable_names)))
    expected = CoupledIndex((lossier,), (1.0,), NUMPY_COUPLED)(ones)
    assert COUPLED.own_mass.size > 0
    np.testing.assert_allclose(coupled()(np.hstack([ones, 1.3 * ones])), expected, atol=1e-9)


def test_splv_is_the_sum_of_the_levels_of_the_lines():
    designs = np.hstack([bench.designs(SHAPE), bench.designs(SHAPE)[::-1]])
    for index, rows in ((prescribed(), FACTORS), (coupled(), designs)):
        np.testing.assert_allclose(index(rows), index.levels(rows).sum(axis=-1), atol=1e-9)


def test_the_gradient_is_that_of_small_steps():
    design = np.hstack([bench.designs(SHAPE)[:1], bench.designs(SHAPE)[1:2]])
    for index, row in ((prescribed(), FACTORS[:1]), (coupled(), design)):
        step = 1e-5 * np.eye(row.size)
        slopes = (index(row + step) - index(row - step)) / 2e-5
        gradient = index.gradient(row)[0]
        np.testing.assert_allclose(gradient, slopes.T, rtol=1e-4, atol=1e-4 * np.abs(slopes).max())


def test_split_forces_add_up_to_the_measured_ones():
    elastic, lossy = split_forces(load_case(STIFFNESS))
    whole = load_case(STIFFNESS).force.values
    np.testing.assert_allclose(elastic.force.values + lossy.force.values, whole, rtol=1e-12)


def test_names_and_a_process_pool():
    index = prescribed()
    assert index.variable_names[:2] == ("A x", "A y")
    assert index.variable_names[6:8] == ("A x loss", "A y loss")
    assert (index.response_names, index.n_lines) == (("one", "two"), 21)
    carried = pickle.loads(pickle.dumps(index))
    np.testing.assert_array_equal(carried(FACTORS), index(FACTORS))


def test_a_line_without_motion_is_refused():
    still = load_case(STIFFNESS)
    motion = still.displacement.values.copy()
    motion[3, 0] = 0.0
    spectrum = replace(still.displacement, values=motion)
    with pytest.raises(InputError, match="displacement"):
        split_forces(replace(still, displacement=spectrum))
