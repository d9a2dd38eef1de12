"""The true parameters of the virtual bench, from the package's data."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, Literal

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.excitation import (
    FULL_LOAD_RAMP,
    THREE_CYLINDER_TORQUE,
    FullLoadRamp,
    OrderTorque,
)
from deboom.bench.frozen import freeze_arrays
from deboom.bench.mount_law import DirectionLaw, FluidBranch, Stage
from deboom.bench.suspended_body import BenchMount, SuspendedBody
from deboom.bench.wishbone import Driveline
from deboom.physics.rigid_body import forward_matrix, mass_matrix

AXES: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")

AMPLITUDE_COUPLING = 0.15
"""Weight of a mount's other axes in the amplitude that softens one axis; judgement."""

PLAY = 0.25e-3
"""Half width of the hysteresis play of the powertrain's static deflection [m]; judgement."""

TRACTION_SHARE = 0.5
"""Half of a wheel's traction force goes through the rear wishbone mount; judgement."""


@dataclass(frozen=True, eq=False)
class VirtualBench:
    """Powertrain and wheel end on their true mounts, with what excites them.

    Parameters
    ----------
    mass : float
        Of the powertrain [kg].
    inertia : array, shape (3, 3)
        About the centre of gravity [kg m²].
    positions : array, shape (n_mount, 3)
        Of the powertrain mounts from the centre of gravity [m].
    powertrain : SuspendedBody
        Six degrees of freedom.
    wheel_end : SuspendedBody
        One side, along x.
    driveline : Driveline
        From engine torque to the wheel end.
    total_ratios : tuple of float
        Engine speed over wheel speed, gear 1 first [1].
    order_torque : OrderTorque
        Dominant order of the engine.
    ramp : FullLoadRamp
        Torque over a run-up.
    """

    mass: float
    inertia: RealArray
    positions: RealArray
    powertrain: SuspendedBody
    wheel_end: SuspendedBody
    driveline: Driveline
    total_ratios: tuple[float, ...]
    order_torque: OrderTorque
    ramp: FullLoadRamp

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def mount_names(self) -> tuple[str, ...]:
        """Names of the powertrain mounts."""
        return tuple(mount.name for mount in self.powertrain.mounts)


def read_data(name: str) -> dict[str, Any]:
    """Read one of the bench's own JSON files, such as ``powertrain.json``."""
    text = resources.files("deboom.bench").joinpath("data", name).read_text(encoding="utf-8")
    data: dict[str, Any] = json.loads(text)
    return data


def _direction_law(data: Mapping[str, Any]) -> DirectionLaw:
    return DirectionLaw(
        stiffness=data["k0_N_per_m"],
        stages=tuple(Stage(*stage) for stage in data["stages_u_m_w_m_dk_N_per_m"]),
        dynamic_ratio=data["dynamic_factor"],
        payne_storage=data["payne_storage"],
        payne_amplitude=data["payne_amplitude_m"],
        payne_exponent=data["payne_exponent"],
        payne_loss=data["payne_loss"],
        fractional_weight=data["fractional_weight"],
        fractional_order=data["fractional_order"],
        fractional_frequency=data["fractional_f0_Hz"],
        cross_stiffening=data["cross_stiffening"],
        fluid=FluidBranch(*data["hydraulic"]) if data["hydraulic"] else None,
    )


def load_bench() -> VirtualBench:
    """Build the bench with the frozen truth of ``data/powertrain.json``."""
    data = read_data("powertrain.json")
    laws = {name: _direction_law(law) for name, law in data["directions"].items()}
    positions = {name: np.array(r) for name, r in data["mount_position_m"].items()}
    powertrain = SuspendedBody(
        mass_matrix=mass_matrix(data["mass_kg"], data["inertia_kg_m2"]),
        mounts=tuple(
            BenchMount(
                name=name,
                forward=forward_matrix(position),
                laws=tuple(laws[f"{name} {axis}"] for axis in AXES),
                cross_deflection=data["cross_amplitude_m"][name],
            )
            for name, position in positions.items()
        ),
        amplitude_coupling=AMPLITUDE_COUPLING,
        play=PLAY,
    )
    wishbone = data["wishbone"]
    wheel_end = SuspendedBody(
        mass_matrix=np.array([[wishbone["wheel_end_mass_kg"]]]),
        mounts=(BenchMount("Du", np.eye(1), (laws["Du x"],), cross_deflection=np.inf),),
        amplitude_coupling=0.0,
        play=0.0,
    )
    driveline = Driveline(
        wheel_radius=wishbone["wheel_radius_m"],
        factor=wishbone["driveline_factor"],
        frequency=wishbone["driveline_mode_Hz"],
        damping_ratio=wishbone["driveline_damping_ratio"],
        traction_share=TRACTION_SHARE,
    )
    return VirtualBench(
        mass=data["mass_kg"],
        inertia=np.array(data["inertia_kg_m2"]),
        positions=np.array(list(positions.values())),
        powertrain=powertrain,
        wheel_end=wheel_end,
        driveline=driveline,
        total_ratios=tuple(data["total_gear_ratio"]),
        order_torque=THREE_CYLINDER_TORQUE,
        ramp=FULL_LOAD_RAMP,
    )
