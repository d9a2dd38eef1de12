"""The fleet of the virtual platform: frozen for seed 1, drawn from the prior for other seeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from deboom.bench.body import Body, Cabin
from deboom.bench.fleet_prior import draw_fleet
from deboom.bench.parameters import read_data

FROZEN_SEED = 1


@dataclass(frozen=True, eq=False)
class BenchFleet:
    """Bodies of one platform and the air they enclose.

    Parameters
    ----------
    paths : tuple of str
        Forces into the body, such as ``TSM x``; ``Du x`` stands for both sides in phase.
    cabin : Cabin
        The same in all vehicles.
    bodies : mapping of str to Body
        Vehicle name ``<group>-<number>`` to its body.
    """

    paths: tuple[str, ...]
    cabin: Cabin
    bodies: Mapping[str, Body]

    def __post_init__(self) -> None:
        object.__setattr__(self, "bodies", MappingProxyType(dict(self.bodies)))


def load_fleet(seed: int) -> BenchFleet:
    """Return the fleet that belongs to a seed.

    Seed 1 is the frozen fleet of ``data/fleet.json``, one draw of the prior that was chosen by
    rejection sampling because it shows every phenomenon the thesis reports. Every other seed is a
    draw of the prior as it comes.
    """
    data = read_data("fleet.json")
    cabin = Cabin(
        bulk_modulus=data["rho_c2_Pa"],
        volume=data["cabin_volume_m3"],
        panel_areas=np.array(data["panel_net_volume_area_m2"]),
        panel_shape=np.array(data["cabin_mode_shape_at_panel"]),
        ear_shape=data["cabin_mode_shape_at_driver_ear"],
        frequency=data["cabin_mode_Hz"],
        damping_ratio=data["cabin_mode_damping_ratio"],
    )
    if seed != FROZEN_SEED:
        return BenchFleet(tuple(data["paths"]), cabin, draw_fleet(seed))
    bodies = {
        name: Body(
            frequencies=np.array(modes["natural_frequency_Hz"]),
            damping_ratios=np.array(modes["damping_ratio"]),
            shapes_at_paths=np.array(modes["mode_shape_at_paths"]),
            shapes_at_panels=np.array(modes["mode_shape_at_panels"]),
            local_stiffness=np.array(modes["local_stiffness_N_per_m"]),
        )
        for name, modes in data["vehicles"].items()
    }
    return BenchFleet(tuple(data["paths"]), cabin, bodies)
