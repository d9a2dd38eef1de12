"""Coupled motion out of a measured load case: exact at factor 1, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from deboom.arrays import AXES
from deboom.errors import InputError
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.fleet import Fleet, Vehicle, path_contributions
from deboom.vehicles.powertrain import Powertrain

LINES = np.linspace(20.0, 60.0, 9)
POSITIONS = {"EnM": (0.05, 0.43, 0.20), "GeM": (-0.03, -0.45, 0.19), "TSM": (0.20, -0.06, -0.27)}
MOUNTS = (
    *(Mount(name, name, ("",), (place,), AXES) for name, place in POSITIONS.items()),
    Mount("Du", "wishbone", ("left", "right"), ((0, -0.4, 0), (0, 0.4, 0)), ("x",), 40.0, 1.0),
)
POWERTRAIN = Powertrain(193.5, np.diag([11.0, 6.8, 9.6]))
CHANNELS = (*tuple(f"{m} {a}" for m in POSITIONS for a in AXES), "Du left x", "Du right x")
PATHS = tuple(path for mount in MOUNTS for path in mount.paths)
ONE = np.ones((1, 12))


def _random(*shape, seed=1):
    rng = np.random.default_rng(seed)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def _load_case(residual=0.01, channels=CHANNELS):
    forward = np.array(
        [
            [1, 0, 0, 0, z, -y, 0, 1, 0, -z, 0, x, 0, 0, 1, y, -x, 0]
            for x, y, z in POSITIONS.values()
        ]
    ).reshape(9, 6)
    rigid = _random(9, 6) @ forward.T
    noise = _random(9, 9, seed=2)
    noise *= residual * np.linalg.norm(rigid) / np.linalg.norm(noise)
    motion = 1e-4 * np.hstack([rigid + noise, _random(9, 2, seed=3)])
    force = 1e6 * motion * (1 + 0.2 * _random(9, 11, seed=4))
    columns = [CHANNELS.index(name) for name in channels]
    return LoadCase(
        "g5",
        "5th gear",
        5,
        3.4,
        220.0,
        1.5,
        Spectrum(LINES, motion[:, columns], channels, "m"),
        Spectrum(LINES, force[:, columns], channels, "N"),
    )


def _fleet():
    def vehicle(name, seed):
        ear = 1e-3 * _random(9, 1, 10, seed=seed)
        return Vehicle(name, "A", Frf(LINES, ear, ("ear",), PATHS, "Pa/N"))

    return Fleet((vehicle("A-1", 5), vehicle("A-2", 6)))


def forces(motion, design):
    """Force of every spring on the bodywork, shape (f, s) [N]."""
    springs = motion.springs(design)
    return (springs * motion.displacement(springs))[0]


def displacement(motion, design):
    return motion.displacement(motion.springs(design))[0]


def test_all_factors_one_give_the_measured_forces_whatever_the_fit_leaves():
    case = _load_case(residual=0.05)
    motion = coupled_motion(_fleet(), MOUNTS, POWERTRAIN, case)
    np.testing.assert_allclose(forces(motion, ONE), case.force.values, rtol=1e-10)
    moved = displacement(motion, ONE)[:, 9:]
    np.testing.assert_allclose(moved, case.displacement.values[:, 9:])
    prescribed = path_contributions(_fleet(), MOUNTS, case).values.sum(axis=-1)
    np.testing.assert_allclose(motion.pressure(ONE)[0], prescribed, rtol=1e-10)


def test_all_factors_one_give_the_rigid_motion_closest_to_the_measured_one():
    case = _load_case(residual=0.05)
    motion = coupled_motion(_fleet(), MOUNTS, POWERTRAIN, case)
    left = case.displacement.values[:, :9] - displacement(motion, ONE)[:, :9]
    # least squares: what is left is no rigid motion; a third of the noise lies in its 9 - 6 rest
    np.testing.assert_allclose(left @ motion.bodies[0].forward, 0.0, atol=1e-15)
    relative = np.linalg.norm(left) / np.linalg.norm(case.displacement.values[:, :9])
    assert 0.015 < relative < 0.05


def test_an_axis_that_does_not_transmit_still_moves_the_body():
    mounts = (replace(MOUNTS[0], transfer_axes=("x", "z")), *MOUNTS[1:])
    fleet = Fleet(
        tuple(
            replace(
                v, noise_transfer=v.noise_transfer.select(inputs=[p for p in PATHS if p != "EnM y"])
            )
            for v in _fleet().vehicles
        )
    )
    motion = coupled_motion(fleet, mounts, POWERTRAIN, _load_case())
    assert not motion.transfer[..., 1].any()
    design = ONE.copy()
    design[0, 1] = 1.2
    assert (motion.pressure(design) != motion.pressure(ONE)).all()


@pytest.mark.parametrize(
    ("mounts", "case", "message"),
    [
        (
            MOUNTS,
            _load_case(channels=tuple(c for c in CHANNELS if c != "GeM y")),
            "'GeM y'.*all axes",
        ),
        (
            (*MOUNTS[:3], replace(MOUNTS[3], body_mass=None, body_mass_tolerance=0.0)),
            _load_case(),
            "body_mass_kg",
        ),
        (
            (MOUNTS[0], *(replace(m, body_mass=9.0, body_mass_tolerance=0.0) for m in MOUNTS[1:])),
            _load_case(),
            "do not determine its motion",
        ),
        (
            (replace(MOUNTS[0], positions=((0.05, -0.43, 0.20),)), *MOUNTS[1:]),
            _load_case(),
            "% of the motion .* check the positions",
        ),
        (tuple(replace(mount, transfer_axes=()) for mount in MOUNTS), _load_case(), "transmits"),
        (MOUNTS[:3], _load_case(), "belong to no transfer axis"),
    ],
)
def test_refuses(mounts, case, message):
    with pytest.raises(InputError, match=message):
        coupled_motion(_fleet(), mounts, POWERTRAIN, case)


def test_refuses_a_wheel_end_at_rest():
    case = _load_case()
    values = case.displacement.values.copy()
    values[3, 10] = 0.0
    still = replace(case, displacement=Spectrum(LINES, values, CHANNELS, "m"))
    with pytest.raises(InputError, match="no displacement of Du right x at 35 Hz"):
        coupled_motion(_fleet(), MOUNTS, POWERTRAIN, still)
