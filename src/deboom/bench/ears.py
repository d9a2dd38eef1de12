"""The ears in the cabin: the driver's, frozen with the fleet, and the passenger's beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.body import Body, Cabin
from deboom.bench.frozen import freeze_arrays
from deboom.bench.interfaces import interface_shapes

EAR_SEED = 21
"""Draws the passenger's seat and the cabin's lateral mode, once for all fleets."""

EARS = ("driver ear", "passenger ear")

SEAT_SPREAD = 0.05
"""How far the seats differ along the first cabin mode, standard deviation [1]; judgement."""

LATERAL_FREQUENCY = 122.0
"""First lateral mode of a cabin 1.4 m wide [Hz]."""

LATERAL_DAMPING = 0.06
LATERAL_AT_EAR = 0.6
LATERAL_AT_PANELS = 0.3
"""What a panel, left and right together, shows of the lateral mode: spread [1]; judgement."""


@dataclass(frozen=True, eq=False)
class Passenger:
    """What makes the pressure at the passenger's ear another one than at the driver's.

    Parameters
    ----------
    ear_shape : float
        First longitudinal cabin mode at the ear [1].
    panel_shape : array, shape (n_panel,)
        Lateral cabin mode at the panels [1].
    """

    ear_shape: float
    panel_shape: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def passenger(cabin: Cabin) -> Passenger:
    """Seat the passenger; the same one in every vehicle."""
    generator = np.random.default_rng(EAR_SEED)
    return Passenger(
        ear_shape=cabin.ear_shape + SEAT_SPREAD * float(generator.normal()),
        panel_shape=generator.normal(0, LATERAL_AT_PANELS, cabin.panel_areas.size),
    )


def panel_pressure(cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Return the pressure at the ears per displacement of each panel.

    Returns
    -------
    array, shape (f, n_ear, n_panel)
        Driver, passenger [Pa/m].

    Notes
    -----
    The driver's pressure is the frozen truth. The difference between two ears at one height is that
    of their seats and of the lateral mode. The frozen truth has nothing of that mode, so the
    passenger carries the whole of it here.
    """
    seat = passenger(cabin)
    other = replace(cabin, ear_shape=seat.ear_shape).pressure(frequency)
    ratio = frequency / LATERAL_FREQUENCY
    mode = ratio**2 / (1 - ratio**2 + 2j * LATERAL_DAMPING * ratio)
    spring = cabin.bulk_modulus * cabin.panel_areas / cabin.volume
    lateral = -2 * LATERAL_AT_EAR * np.outer(mode, seat.panel_shape) * spring
    return np.stack([cabin.pressure(frequency), other + lateral], axis=1)


def ear_transfer(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the pressure at the ears per force and moment at every interface.

    Returns
    -------
    array, shape (f, n_ear, n_interface, 6)
        [Pa/N], and [Pa/(N m)] for moments.
    """
    shapes = interface_shapes(body)
    per_mode = panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    modal = per_mode * body.modal_receptance(frequency)[:, None, :]
    return np.asarray(np.einsum("fen,nia->feia", modal, shapes))


def source_motion(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the motion of the interfaces when a loudspeaker breathes at an ear.

    Parameters
    ----------
    body, cabin
        The vehicle.
    frequency : array, shape (f,)
        [Hz].

    Returns
    -------
    array, shape (f, n_interface, 6, n_ear)
        Displacement per volume displacement [1/m²], rotation per volume displacement [1/m³].

    Notes
    -----
    From the source outwards, with nothing of `ear_transfer` turned round: the volume q raises the
    pressure at every panel; the pressure pushes the panel out of the cabin, against its inward
    shape; the modes answer, and the interfaces move. A cabin answers alike with source and receiver
    exchanged, ``p_panel/q = (p_ear/u_panel)/A``.
    """
    at_panel = panel_pressure(cabin, frequency) / cabin.panel_areas
    outward_force = at_panel * cabin.panel_areas
    modal_force = -outward_force @ body.shapes_at_panels.T
    modal = modal_force * body.modal_receptance(frequency)[:, None, :]
    return np.asarray(np.einsum("fen,nia->fiae", modal, interface_shapes(body)))
