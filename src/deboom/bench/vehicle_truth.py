"""The exact truth behind a written vehicle, for verification only."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.body import Body, Cabin
from deboom.bench.coupled_car import CoupledRun
from deboom.bench.ears import EARS, ear_transfer
from deboom.bench.interfaces import interface_shapes, interfaces, local_flexibility
from deboom.bench.parameters import AXES, VirtualBench


def write_run_truth(
    path: Path, bench: VirtualBench, run: CoupledRun, pressure: ComplexArray
) -> None:
    """Write one run as it truly was.

    Parameters
    ----------
    path : Path
        ``.npz`` file.
    bench, run
        What ran, and how.
    pressure : array, shape (f, n_ear)
        At the ears, other paths included [Pa].
    """
    channels = [
        f"{place.name} {axis}"
        for place in interfaces(bench)
        for axis in (AXES[:1] if place.piece else AXES)
    ]
    np.savez(
        path,
        frequency=run.frequency,
        ears=np.array(EARS),
        channels=np.array(channels),
        interfaces=np.array([place.name for place in interfaces(bench)]),
        engine_torque=run.engine_torque,
        pressure=pressure,
        pressure_of_mounts=run.pressure,
        force=run.force,
        deflection=run.deflection,
        stiffness=run.stiffness,
        body_motion=run.body_motion,
        powertrain_motion=run.powertrain,
        wheel_end_motion=run.wheel_ends,
    )


def write_vehicle_truth(
    path: Path, bench: VirtualBench, body: Body, cabin: Cabin, frequency: RealArray
) -> None:
    """Write a vehicle as it truly is on average over its states.

    Parameters
    ----------
    path : Path
        ``.npz`` file.
    bench, body, cabin
        The vehicle.
    frequency : array, shape (f,)
        [Hz].
    """
    np.savez(
        path,
        frequency=frequency,
        ears=np.array(EARS),
        interfaces=np.array([place.name for place in interfaces(bench)]),
        noise_transfer=ear_transfer(body, cabin, frequency),
        natural_frequencies=body.frequencies,
        damping_ratios=body.damping_ratios,
        shapes_at_interfaces=interface_shapes(body),
        shapes_at_panels=body.shapes_at_panels,
        local_flexibility=local_flexibility(body),
    )
