"""Cabin index of the bench's exact cars: nothing measured, nothing identified."""

from functools import cache

import numpy as np

from deboom.bench.choices import CalibrationLevel
from deboom.bench.compressor_rig import operation
from deboom.bench.electric_car import MOUNTS, POINTS, frozen_fleet
from deboom.bench.electric_car_writer import CAR_PLAN
from deboom.compressor.cabin_index import BodySide, CabinIndex, car_seam, mount_variables
from deboom.compressor.hoses import hose_matrices
from deboom.compressor.unbalance_load import RotationSense, gyroscopic_mass
from deboom.measurement.compressor_test import CompressorMount, HoseDrawing

LINES = np.arange(20.0, 141.0, 10.0)
CASES = {"7.5 bar": 1.0, "13.5 bar": 1.6}


@cache
def bench_operation():
    """Compressor, hoses and source of the bench."""
    return operation(1, CalibrationLevel.C2, CAR_PLAN)


@cache
def cars():
    return tuple(frozen_fleet().values())


def mounts():
    compressor = bench_operation().laboratory.compressor
    numbers = (compressor.positions, compressor.rotations, compressor.stiffness)
    return tuple(map(CompressorMount, MOUNTS, *numbers))


def running():
    """Mass with the gyroscopic moment, and the load of each case."""
    compressor, source = bench_operation().laboratory.compressor, bench_operation().source
    rotor = gyroscopic_mass(source.rotor_inertia, RotationSense(source.sense))
    loads = {name: source.load(LINES, factor) for name, factor in CASES.items()}
    return compressor.mass_matrix + rotor, loads


def body_of(car, *, with_hoses=False):
    points = POINTS if with_hoses else MOUNTS
    n = 6 * len(points)
    receptance, transfer = car.receptance(LINES)[:, :n, :n], car.noise_transfer(LINES)[:, :n]
    return BodySide(car.name, LINES, points, receptance, transfer)


def drawings(hoses):
    """Hoses of the bench in the form of the package `compressor`."""
    return tuple(
        HoseDrawing(hose.name, hose.position, hose.direction, *vars(hose.beam).values())
        for hose in hoses
    )


def index_of(*, with_hoses=False, identical=False, places=True, weights=(1.0, 3.0)):
    """Index of all frozen cars."""
    compressor = bench_operation().laboratory.compressor
    hoses = hose_matrices(drawings(compressor.hoses), LINES) if with_hoses else None
    bodies = [body_of(car, with_hoses=with_hoses) for car in cars()]
    return CabinIndex(
        mount_variables(mounts(), identical=identical, pieces=identical, places=places),
        mounts(),
        compressor.gain_at(LINES),
        tuple(car_seam(*running(), compressor.positions, body, hoses) for body in bodies),
        weights,
    )


def some_designs(index, n, *, seed, place_mm=0.0):
    """Factors from 0.6 to 1.4, mounts up to `place_mm` off."""
    random, moved = np.random.default_rng(seed), index.variables.moved.any(axis=1)
    factors = random.uniform(0.6, 1.4, (n, moved.size))
    return np.where(moved, 100.0 + random.uniform(-place_mm, place_mm, factors.shape), factors)
