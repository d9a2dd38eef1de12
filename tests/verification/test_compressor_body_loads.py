"""Loads on the body against the exact coupled car of the bench."""

import numpy as np
import pytest

from deboom.bench.compressor_plan import CompressorCase, CompressorPlan
from deboom.bench.compressor_sources import true_source
from deboom.bench.compressor_truth import true_compressor
from deboom.bench.electric_body import HOSES, MOUNTS, columns_of
from deboom.bench.electric_car import run_car
from deboom.bench.electric_fleet import frozen_fleet
from deboom.bench.hoses import drawn_hoses
from deboom.compressor.body_loads import (
    body_receptance,
    loads_by_measured_holders,
    loads_by_predicted_holders,
    loads_on_still_body,
)
from deboom.compressor.mount_forces import load_at_virtual_point, motion_at_mounts, mount_forces
from deboom.errors import InputError
from deboom.measurement.channel_geometry import RIGID_MOTIONS
from deboom.measurement.channels import Frf
from deboom.measurement.inertance_test import CompressorMount
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.measurement.operating_sweep import HoseDrawing

LINES = np.arange(20.0, 141.0, 4.0)
CAR = frozen_fleet().car("EV-2")
COMPRESSOR = true_compressor(CompressorPlan(CompressorCase.TABLE11), np.random.default_rng(1))
OF_MOUNTS, OF_HOSES = columns_of(MOUNTS, 3), columns_of(HOSES)
TRUE_MOUNTS = tuple(
    CompressorMount(name, position, rotation, stiffness)
    for name, position, rotation, stiffness in zip(
        MOUNTS, COMPRESSOR.positions, COMPRESSOR.rotations, COMPRESSOR.stiffness, strict=True
    )
)
TRUE_HOSES = tuple(
    HoseDrawing(
        name,
        hose.position,
        hose.direction,
        hose.beam.length,
        hose.beam.tension,
        hose.beam.torsion,
        hose.beam.bending,
        hose.beam.line_mass,
        hose.beam.loss_factor,
        hose.beam.torsion_radius,
    )
    for name, hose in zip(HOSES, drawn_hoses(), strict=True)
)


def run(with_hoses):
    hoses = drawn_hoses() if with_hoses else ()
    return run_car(CAR, COMPRESSOR, true_source(), LINES, hoses)


def receptance(columns):
    return CAR.receptance(LINES)[:, columns][:, :, columns]


@pytest.mark.parametrize("with_hoses", [False, True])
def test_loads_are_those_of_the_coupled_car(with_hoses):
    true, hoses = run(with_hoses), TRUE_HOSES if with_hoses else ()
    columns = OF_MOUNTS + (OF_HOSES if with_hoses else [])
    factor = COMPRESSOR.gain_at(LINES)
    by_holders = loads_by_measured_holders(
        TRUE_MOUNTS,
        factor,
        true.displacement,
        true.body_motion[:, OF_MOUNTS],
        hoses,
        LINES,
        receptance(columns),
    )
    predicted = loads_by_predicted_holders(
        TRUE_MOUNTS, factor, true.displacement, receptance(columns), hoses, LINES
    )
    expected = true.body_load[:, columns]
    for found in (by_holders, predicted):
        loads = np.hstack([found.mounts, found.hoses])
        assert loads == pytest.approx(expected, rel=1e-7, abs=1e-9 * np.abs(expected).max())
    sound = np.sum(CAR.noise_transfer(LINES)[:, columns] * expected, axis=1)
    assert sound == pytest.approx(true.pressure, rel=1e-9)
    if with_hoses:
        ends = true.body_motion[:, OF_HOSES]
        assert by_holders.hose_ends == pytest.approx(ends, abs=1e-9 * np.abs(ends).max())


def test_a_body_that_stands_still_is_another_load():
    true, factor = run(with_hoses=True), COMPRESSOR.gain_at(LINES)
    still = loads_on_still_body(TRUE_MOUNTS, factor, true.displacement, TRUE_HOSES, LINES)
    expected = true.body_load[:, OF_MOUNTS]
    off = np.linalg.norm(still.mounts - expected) / np.linalg.norm(expected)
    assert 1e-3 < off < 0.1


def test_forces_of_the_mounts_hold_the_compressor():
    """At the virtual point they are the whole of what a compressor without hoses leans on."""
    true = run(with_hoses=False)
    apart = motion_at_mounts(TRUE_MOUNTS, true.displacement) - true.body_motion[:, OF_MOUNTS]
    forces = mount_forces(TRUE_MOUNTS, COMPRESSOR.gain_at(LINES), apart)
    square = (2 * np.pi * LINES)[:, None] ** 2
    own = true_source().gyroscopic(LINES) @ true.displacement[..., None]
    inertia = square * (true.displacement @ COMPRESSOR.mass_matrix.T) - own[..., 0]
    expected = true.load + inertia
    found = load_at_virtual_point(TRUE_MOUNTS, forces)
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(true.load).max())


def test_receptances_come_from_measured_points_and_lines():
    names = [f"p {motion}" for motion in RIGID_MOTIONS]
    loads = [f"p {load}" for load in POINT_LOADS]
    values = np.broadcast_to(np.eye(6), (2, 6, 6))
    frf = Frf(np.array([20.0, 30.0]), values, names, loads, "(m/s^2)/N")
    found = body_receptance(frf, [30.0], ["p"])
    assert found == pytest.approx(-np.eye(3)[None] / (60 * np.pi) ** 2)
    with pytest.raises(InputError, match="no accelerances of the body at 'q': strike it"):
        body_receptance(frf, [30.0], ["p"], ["q"])
    with pytest.raises(InputError, match="no line at 25 Hz"):
        body_receptance(frf, [25.0], ["p"])
