"""The cabin index against the bench's coupled cars, closed forms, and differences."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from compressor_cabin_samples import (
    CASES,
    LINES,
    body_of,
    cars,
    index_of,
    mounts,
    running,
    some_designs,
    there,
)

from deboom.bench.electric_car import design_pressure
from deboom.compressor.cabin_index import CabinIndex
from deboom.compressor.car_seam import BodySide, car_seam
from deboom.compressor.mount_statics import GRAVITY, MountStatics
from deboom.compressor.mount_variables import mount_variables
from deboom.explore.design_space import DesignSpace
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import sobol_sample
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.rigid_body import forward_matrices, mass_matrix, shift_matrix
from deboom.physics.sound_level import a_weighting, spl


@pytest.mark.parametrize("with_hoses", [False, True])
def test_any_mounts_sound_as_in_the_coupled_bench(with_hoses):
    index = index_of(with_hoses=with_hoses, places=False)
    compressor = there().laboratory.compressor
    designs = some_designs(index, 20, seed=1)
    stiffness = index.variables.factors(designs).reshape(-1, 3, 3) * compressor.stiffness
    hoses = compressor.hoses if with_hoses else ()
    for case, gas in CASES.items():
        exact = np.stack(
            [
                design_pressure(car, compressor, there().source, LINES, stiffness, hoses, gas)
                for car in cars()
            ],
            axis=1,
        )
        found = index.pressure(designs, case)
        assert np.abs(found / exact - 1).max() < 1e-11
        np.testing.assert_allclose(index.levels(designs, case), spl(exact, LINES, axis=-1))


def test_the_sum_is_weighted_over_the_pressures():
    index = index_of(places=False, weights=(1.0, 3.0))
    designs = some_designs(index, 3, seed=2)
    low, high = (index.levels(designs, case).sum(axis=-1) for case in CASES)
    np.testing.assert_allclose(index(designs), 0.25 * low + 0.75 * high, rtol=1e-13)


@pytest.mark.parametrize("identical", [False, True])
@pytest.mark.parametrize("with_hoses", [False, True])
def test_gradient_is_that_of_differences(identical, with_hoses):
    index = index_of(identical=identical, with_hoses=with_hoses)
    designs = some_designs(index, 3, seed=3, place_mm=3.0)
    gradient = index.gradient(designs)
    for column in range(designs.shape[1]):
        step = np.zeros(designs.shape[1])
        step[column] = 1e-4 * designs[:, column].mean()
        near, far = (index(designs + n * step) - index(designs - n * step) for n in (1, 2))
        found = (8 * near - far) / (12 * step[column])
        np.testing.assert_allclose(
            gradient[:, :, column], found, rtol=1e-6, atol=1e-7 * np.abs(gradient).max()
        )


def test_a_mount_that_stands_off_is_a_mount_that_stands_there():
    """Compressor and body seen from where the mounts are, with nothing left to shift."""
    index = index_of()
    designs = some_designs(index, 1, seed=4, place_mm=8.0)
    off = 1e-3 * (designs[0, -9:] - 100.0).reshape(3, 3)
    moved = tuple(replace(m, position=m.position + d) for m, d in zip(mounts(), off, strict=True))
    seams = []
    for car in cars():
        body = body_of(car)
        shift = np.zeros((18, 18))
        for number, at in enumerate(off):
            rows = slice(6 * number, 6 * number + 6)
            shift[rows, rows] = shift_matrix(-at)
        there_body = BodySide(
            body.name,
            LINES,
            body.points,
            shift @ body.receptance @ shift.T,
            body.transfer @ shift.T,
        )
        seams.append(car_seam(running(), np.array([m.position for m in moved]), there_body))
    plain = mount_variables(moved, identical=False, pieces=False, places=False)
    at_place = CabinIndex(plain, moved, index.gain, tuple(seams), index.weights)
    np.testing.assert_allclose(
        index.pressure(designs), at_place.pressure(designs[:, :6]), rtol=1e-11
    )


def test_rigid_holders_leave_the_body_to_the_ear_alone():
    """Closed form: six equations of motion, forces on holders that stand still."""
    index = index_of(rigid=True, places=False)
    designs = some_designs(index, 2, seed=5)
    factors = index.variables.factors(designs)
    static = np.concatenate([mount.stiffness for mount in mounts()])
    rows = forward_matrices(
        np.array([mount.position for mount in mounts()]),
        np.array([mount.orientation for mount in mounts()]),
    )
    turn = np.zeros((9, 9))
    for number, mount in enumerate(mounts()):
        turn[3 * number : 3 * number + 3, 3 * number : 3 * number + 3] = mount.orientation
    forces_at = [6 * number + axis for number in range(3) for axis in range(3)]
    free, gain = running(), index.gain
    for number, factor in enumerate(factors):
        stiffness = gain[:, None, None] * np.diag(factor * static)
        whole = free.dynamic_stiffness + rows.T @ stiffness @ rows
        motion = np.linalg.solve(whole, free.load[0][..., None])
        force = turn @ stiffness @ rows @ motion
        for place, car in enumerate(cars()):
            heard = np.einsum("fi,fi->f", body_of(car).transfer[:, forces_at], force[..., 0])
            found = index.pressure(designs)[number, place]
            np.testing.assert_allclose(found, heard, rtol=1e-11)


def test_far_above_its_modes_a_compressor_swings_freely():
    """Very soft mounts: forces grow in proportion to stiffness, 20 dB for a factor of ten."""
    index = index_of(places=False)
    soft = np.full((1, 6), 1e-6)
    step = index.levels(10 * soft) - index.levels(soft)
    np.testing.assert_allclose(step, 20.0, atol=1e-3)


def test_one_line_is_its_a_weighted_level():
    index = index_of(places=False, weights=(1.0, 0.0))
    design = some_designs(index, 1, seed=6)
    heard = np.abs(index.pressure(design))
    level = 20 * np.log10(heard / (np.sqrt(2) * 2e-5)) + a_weighting(LINES)
    np.testing.assert_allclose(index(design), level.sum(axis=-1), rtol=1e-12)


def test_a_design_gives_the_same_however_it_is_batched_or_carried():
    index = index_of(identical=True)
    designs = some_designs(index, 300, seed=7, place_mm=1.0)
    whole = index(designs)
    np.testing.assert_allclose(whole[250:251], index(designs[250:251]), rtol=1e-12)
    assert np.array_equal(pickle.loads(pickle.dumps(index))(designs), whole)


def test_a_worker_finds_the_same_bits():
    """One design with all its draws is what a worker gets, pickled."""
    index = index_of(places=False)
    one = np.ones(6)
    space = DesignSpace(index.variable_names, ("1",) * 6, one, 0.6 * one, 1.4 * one, 0.15 * one)
    robust = RobustResponse(index, space, sobol_sample(6, 8, seed=1))
    designs = some_designs(index, 4, seed=8)
    here, carried = robust(designs), pickle.loads(pickle.dumps(robust))
    for number, design in enumerate(designs):
        away = carried(design[np.newaxis])
        assert np.array_equal(here.mean[number], away.mean[0])
        assert np.array_equal(here.sigma[number], away.sigma[0])


def test_travel_and_modes_of_a_symmetrical_body():
    """Four equal mounts around the centre of gravity: springs in parallel."""
    corners = [(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)]
    stiffness = np.array([2e4, 1e4, 1e4])
    four = tuple(
        CompressorMount(f"mount {n}", np.array([x, y, 0.0]), np.zeros(3), stiffness)
        for n, (x, y) in enumerate(corners)
    )
    inertia = np.diag([0.02, 0.03, 0.04])
    statics = MountStatics(
        mount_variables(four, identical=True, pieces=False, places=False),
        four,
        1.5,
        7.2,
        np.zeros(3),
        mass_matrix(7.2, inertia),
    )
    # radial along y and z is the softest: 4 x 1.5 x 1e4 x 0.8
    travel = statics(np.array([[1.0, 0.8]]))
    assert travel[0, 0] == pytest.approx(1e3 * 7.2 * GRAVITY / (4 * 1.5 * 0.8e4), rel=1e-12)
    modes = statics.modes(np.array([[1.0, 0.8]]))[0]
    sideways = np.sqrt(4 * 1.5 * 0.8e4 / 7.2) / (2 * np.pi)
    along = np.sqrt(4 * 1.5 * 2e4 / 7.2) / (2 * np.pi)
    assert np.min(np.abs(modes - sideways)) < 1e-9
    assert np.min(np.abs(modes - along)) < 1e-9
