"""Electric cars of the virtual bench: five frozen ones, and fleets drawn from the same prior.

A body is held at the places of one compressor: three mounts and two hose ends, six motions each,
along the axes of the compressor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.body import Body, CavityMode
from deboom.bench.compressor_plan import COMPRESSOR_DATA
from deboom.bench.electric_body import (
    MOUNTS,
    POINTS,
    ElectricCabin,
    ElectricCarBody,
    columns_of,
)
from deboom.bench.parameters import read_data
from deboom.errors import InputError

ELECTRIC_FLEET = "electric_fleet.json"

PATCH_RADIUS = 0.05
"""Of the piece of sheet metal that turns under a local moment [m]; judgement. With the stiffness k
of the translations the local rotations have k r²; no mount and no hose is a thousandth as stiff."""

LEVEL = 2.1e-3
"""Median translational noise transfer function of the first car's mounts [Pa/N], as measured."""

LEVEL_LINES = np.arange(30.0, 140.01, 0.5)
"""Lines of that median [Hz]."""

NOMINAL_FREQUENCIES = np.array(
    [24, 31, 38, 44, 52, 60, 67, 75, 83, 90, 98, 106, 113, 121, 129, 137, 146, 155, 164], float
)
"""Of the prior's body modes [Hz]."""

NOMINAL_DAMPING = 0.03
PANEL_SHAPE = 0.04
"""Spread of the modes at the panels [kg^-1/2]."""

ROTATION_LENGTH = 0.35
"""A mode that moves the compressor's carrier by 1 turns it by 1 over this length [m]."""

MOUNT_SCATTER = 0.15
"""Part of a shape that each mount has for itself; the rest is a rigid carrier's [1]."""

HOSE_SHARE, HOSE_SCATTER = 0.6, 0.8
"""Of the carrier's motion, and of an own one, at a hose end [1]."""

FREQUENCY_SPREAD, DAMPING_SPREAD, SHAPE_SPREAD = 0.02, 0.2, 0.2
"""Log-normal, from car to car [1]."""


@dataclass(frozen=True, eq=False)
class ElectricFleet:
    """Electric cars that carry the same compressor.

    Parameters
    ----------
    cars : mapping of str to ElectricCarBody
        By their names, ``EV-1`` first.
    """

    cars: Mapping[str, ElectricCarBody]

    def __post_init__(self) -> None:
        object.__setattr__(self, "cars", MappingProxyType(dict(self.cars)))

    def car(self, name: str) -> ElectricCarBody:
        """Return a car by its name.

        Raises
        ------
        InputError
            No such car.
        """
        if name not in self.cars:
            raise InputError(f"there is no car '{name}' in the fleet: use {', '.join(self.cars)}")
        return self.cars[name]


def frozen_fleet() -> ElectricFleet:
    """Return the five cars of ``data/electric_fleet.json``, an unselected draw of the prior."""
    data = read_data(ELECTRIC_FLEET)
    cabin = _cabin(data)
    return ElectricFleet(
        {
            name: ElectricCarBody(
                name,
                Body(
                    frequencies=np.array(modes["natural_frequency_Hz"]),
                    damping_ratios=np.array(modes["damping_ratio"]),
                    shapes_at_paths=np.array(modes["mode_shape_at_points"]),
                    shapes_at_panels=np.array(modes["mode_shape_at_panels"]),
                    local_stiffness=_local_stiffness(data),
                ),
                cabin,
            )
            for name, modes in data["vehicles"].items()
        }
    )


def draw_fleet(seed: int) -> ElectricFleet:
    """Draw a fleet of as many cars from the prior of the frozen one, and select nothing.

    Parameters
    ----------
    seed : int
        From 1. The frozen fleet is the draw of seed 20261121, rounded to nine digits.

    Returns
    -------
    ElectricFleet

    Raises
    ------
    InputError
        Seed below 1.

    Notes
    -----
    One platform: the first car has the base's shapes, the others theirs with a log-normal factor
    per entry. The mounts stand on a carrier that moves almost as a rigid body; the ends of the
    hoses follow it in part. One factor on all shapes at the points gives the first car the median
    `LEVEL`.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    data, generator = read_data(ELECTRIC_FLEET), np.random.default_rng(seed)
    cabin, n_mode = _cabin(data), NOMINAL_FREQUENCIES.size
    at_points = _draw_shapes(generator)
    at_panels = PANEL_SHAPE * generator.normal(0, 1, (n_mode, cabin.panel_areas.size))

    def spread(shapes: RealArray) -> RealArray:
        return np.asarray(shapes * np.exp(generator.normal(0, SHAPE_SPREAD, shapes.shape)))

    cars: dict[str, ElectricCarBody] = {}
    scale = 1.0
    for name in data["vehicles"]:
        frequencies = NOMINAL_FREQUENCIES * np.exp(generator.normal(0, FREQUENCY_SPREAD, n_mode))
        damping = NOMINAL_DAMPING * np.exp(generator.normal(0, DAMPING_SPREAD, n_mode))
        own_points = spread(at_points) if cars else at_points
        own_panels = spread(at_panels) if cars else at_panels
        if not cars:
            scale = LEVEL / _median_level(
                ElectricCarBody(
                    name,
                    Body(frequencies, damping, at_points, at_panels, _local_stiffness(data)),
                    cabin,
                )
            )
        body = Body(frequencies, damping, scale * own_points, own_panels, _local_stiffness(data))
        cars[name] = ElectricCarBody(name, body, cabin)
    return ElectricFleet(cars)


def point_positions() -> dict[str, RealArray]:
    """Return where the compressor of the prior meets a body, from its virtual point [m].

    Mounts of the thesis's table 11, and the far ends of two straight hoses.
    """
    data = read_data(COMPRESSOR_DATA)
    mounts = [np.array(position) for position in data["truth"]["mount_position_m"]]
    ends = []
    for hose in data["hoses"]:
        direction = np.array(hose["direction"])
        reach = hose["length_m"] * direction / np.linalg.norm(direction)
        ends.append(np.array(hose["port_position_m"]) + reach)
    return dict(zip(POINTS, [*mounts, *ends], strict=True))


def _cabin(data: Mapping[str, Any]) -> ElectricCabin:
    return ElectricCabin(
        bulk_modulus=data["rho_c2_Pa"],
        volume=data["cabin_volume_m3"],
        panel_areas=np.array(data["panel_net_volume_area_m2"]),
        modes=tuple(
            CavityMode(
                mode["frequency_Hz"],
                mode["damping_ratio"],
                np.array(mode["shape_at_panel"]),
                mode["shape_at_driver_ear"],
            )
            for mode in data["cavity_modes"]
        ),
    )


def _local_stiffness(data: Mapping[str, Any]) -> RealArray:
    translation = data["local_stiffness_N_per_m"]
    return np.tile(np.repeat([translation, translation * PATCH_RADIUS**2], 3), len(POINTS))


def _median_level(car: ElectricCarBody) -> float:
    transfer = car.noise_transfer(LEVEL_LINES)[:, columns_of(MOUNTS, 3)]
    return float(np.median(np.abs(transfer)))


def _draw_shapes(generator: np.random.Generator) -> RealArray:
    """Draw the modes at all points, shape (n_mode, 30)."""
    n_mode = NOMINAL_FREQUENCIES.size

    def normal(deviation: float = 1.0) -> RealArray:
        return generator.normal(0, 1, (n_mode, 3)) * deviation

    shift = generator.normal(0, 1, (n_mode, 3))
    turn = generator.normal(0, 1 / ROTATION_LENGTH, (n_mode, 3))
    blocks = []
    of_carrier = (1.0, MOUNT_SCATTER)
    of_hose = (HOSE_SHARE, HOSE_SCATTER)
    for point, place in point_positions().items():
        share, own = of_carrier if point in MOUNTS else of_hose
        blocks.append(share * (shift + np.cross(turn, place)) + normal(own))
        blocks.append(share * turn + normal(own / ROTATION_LENGTH))
    return np.concatenate(blocks, axis=1)
