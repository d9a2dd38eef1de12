"""A second engine on the mounts of the virtual platform: four cylinders, order 2, with inertia."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deboom.bench.campaign_plan import CampaignPlan, PlannedRun
from deboom.bench.excitation import FullLoadRamp, OrderTorque
from deboom.bench.parameters import VirtualBench, load_bench, read_data
from deboom.physics.rigid_body import forward_matrix, mass_matrix

_FILE = "second_engine.json"


def load_second_engine() -> VirtualBench:
    """Put the second engine on the bench.

    Returns
    -------
    VirtualBench
        Its mass, mount positions, gears and excitation from ``data/second_engine.json``; mounts and
        wheel ends as drawn for the virtual platform.

    Notes
    -----
    Whoever knows the mounts, and measures the motion of this powertrain, must find its forces: the
    mounts do not know what they carry.
    """
    data, bench = read_data(_FILE), load_bench()
    positions = np.array([data["mount_position_m"][name] for name in bench.mount_names])
    inertia = np.array(data["inertia_kg_m2"])
    torque, ramp = data["order_torque"], data["ramp"]
    mounts = tuple(
        replace(mount, forward=forward_matrix(position))
        for mount, position in zip(bench.powertrain.mounts, positions, strict=True)
    )
    return replace(
        bench,
        mass=data["mass_kg"],
        inertia=inertia,
        positions=positions,
        powertrain=replace(
            bench.powertrain, mass_matrix=mass_matrix(data["mass_kg"], inertia), mounts=mounts
        ),
        total_ratios=tuple(data["total_gear_ratio"]),
        order_torque=OrderTorque(
            order=torque["order"],
            at_no_load=torque["at_no_load_Nm"],
            per_torque=torque["per_torque"],
            phase=np.deg2rad(torque["phase_deg"]),
            low_speed_phase=0.0,
            low_speed=ramp["start_rpm"],
            speed_scale=ramp["scale_rpm"],
            inertia=torque["inertia_kg_m2"],
        ),
        ramp=FullLoadRamp(
            start=ramp["start_rpm"],
            scale=ramp["scale_rpm"],
            natural_torque=ramp["natural_torque_Nm"],
            exponent=ramp["exponent"],
        ),
    )


def second_engine_cylinders() -> int:
    """Return the number of cylinders of the second engine."""
    return int(read_data(_FILE)["cylinders"])


def second_engine_plan(*mount_sets: str) -> CampaignPlan:
    """Return the plan of full-load ramps in gears 5 to 7 with the second engine.

    Parameters
    ----------
    mount_sets : str
        Names of the mount sets to put under it.
    """
    data = read_data(_FILE)
    low, high, step = data["lines_Hz"]
    return CampaignPlan(
        mount_sets=mount_sets,
        runs=tuple(
            PlannedRun(gear, limit, full_load=True)
            for gear in (5, 6, 7)
            for limit in data["torque_limits_Nm"]
        ),
        frequency=np.linspace(low, high, round((high - low) / step) + 1),
    )
