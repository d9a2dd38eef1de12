"""Where mounts and ears meet the body: six motions per interface, pressure at two ears."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.fleet import Body, Cabin
from deboom.bench.frozen import freeze_arrays
from deboom.bench.layout import WISHBONE_POSITIONS
from deboom.bench.operating_run import SIDES
from deboom.bench.powertrain import AXES, VirtualBench

INTERFACE_SEED = 20
"""Draws the map for every vehicle of every fleet: it belongs to the truth."""

ROTATION_LENGTH = 0.4
"""A mode that moves the interfaces by 1 turns them by 1 over this length [m]; judgement, between
the span of the front carrier and that of a long member."""

SIDE_SPREAD = 0.3
"""Part in which the sides of the wishbone differ, against their common shape [1]; judgement."""

N_MOTION = 6


@dataclass(frozen=True, eq=False)
class Interface:
    """One place at which the body carries a mount or a piece of one.

    Parameters
    ----------
    mount, piece : str
        Such as ``Du``, ``left``; a mount of one piece has the piece ``""``.
    position : array, shape (3,)
        Of its virtual point, from the true centre of gravity of the powertrain [m].
    """

    mount: str
    piece: str
    position: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def name(self) -> str:
        """Such as ``TSM`` or ``Du left``."""
        return f"{self.mount} {self.piece}".strip()


def interfaces(bench: VirtualBench) -> tuple[Interface, ...]:
    """Return the powertrain mounts, then the sides of the wishbone mount."""
    powertrain = zip(bench.mount_names, bench.positions, strict=True)
    sides = zip(SIDES, WISHBONE_POSITIONS, strict=True)
    return (
        *(Interface(name, "", position) for name, position in powertrain),
        *(Interface("Du", side, np.array(position)) for side, position in sides),
    )


@cache
def _map(n_mount: int) -> RealArray:
    """Shapes along the paths → motions of all interfaces, shape (6 n_interface, n_path)."""
    n_path = len(AXES) * n_mount + 1
    generator = np.random.default_rng(INTERFACE_SEED)
    n_interface = n_mount + len(SIDES)
    turning = generator.normal(0, 1 / ROTATION_LENGTH, (n_interface, len(AXES), n_path))
    apart = generator.normal(0, SIDE_SPREAD, n_path)
    to_motion = np.zeros((n_interface, N_MOTION, n_path))
    to_motion[:, len(AXES) :] = turning / np.sqrt(n_path)
    for mount in range(n_mount):
        for axis in range(len(AXES)):
            to_motion[mount, axis, len(AXES) * mount + axis] = 1.0
    for side, sign in enumerate((1.0, -1.0), n_mount):
        to_motion[side, 0] = sign * apart / np.sqrt(n_path)
        to_motion[side, 0, -1] += 1.0
    flat = to_motion.reshape(-1, n_path)
    flat.setflags(write=False)
    return flat


def interface_shapes(body: Body) -> RealArray:
    """Return the modes of a body at its interfaces.

    Parameters
    ----------
    body : Body
        Paths ``<mount> x y z`` of each powertrain mount, then ``Du x`` of both sides in phase.

    Returns
    -------
    array, shape (n_mode, n_interface, 6)
        Translations along x, y, z [kg^-1/2] and rotations about them [kg^-1/2/m], at the virtual
        points. Translations along the paths are the body's own; the mean of the wishbone's sides is
        its ``Du x``, and along y and z nothing reaches the body there.
    """
    n_mount = (body.shapes_at_paths.shape[1] - 1) // len(AXES)
    flat = body.shapes_at_paths @ _map(n_mount).T
    return np.asarray(flat.reshape(len(flat), -1, N_MOTION))


def local_flexibility(body: Body) -> RealArray:
    """Return the flexibility of the body right at each interface.

    Returns
    -------
    array, shape (n_interface, 3)
        Displacement per force at the same interface and axis, besides the modes [m/N].

    Notes
    -----
    Two sides that carry half of a force each give way half as much as one: each side of the
    wishbone has half the stiffness that stands for both.
    """
    stiffness = body.local_stiffness
    sides = np.full((len(SIDES), len(AXES)), stiffness[-1] / len(SIDES))
    return np.asarray(1 / np.vstack([stiffness[:-1].reshape(-1, len(AXES)), sides]))


def point_shapes(body: Body, forward: RealArray, interface: int) -> RealArray:
    """Return what channels around one interface see of the modes, shape (n_mode, n_channel).

    Parameters
    ----------
    body : Body
    forward : array, shape (n_channel, 6)
        Motion at the virtual point → channel.
    interface : int
        Its place in `interfaces`.
    """
    return np.asarray(interface_shapes(body)[:, interface] @ forward.T)


def point_receptance(
    body: Body,
    frequency: RealArray,
    responses: tuple[RealArray, ...],
    forces: tuple[RealArray, ...],
) -> ComplexArray:
    """Find the displacement at channels around the interfaces per force at others.

    Parameters
    ----------
    body : Body
    frequency : array, shape (f,)
        [Hz].
    responses, forces : tuple of array, shape (n_channel, 6)
        Per interface: motion at the virtual point → channels.

    Returns
    -------
    array, shape (f, n_response, n_force)
        [m/N].
    """
    seen = np.hstack([point_shapes(body, rows, k) for k, rows in enumerate(responses)])
    pushed = np.hstack([point_shapes(body, rows, k) for k, rows in enumerate(forces)])
    modal = body.modal_receptance(frequency)
    values = np.asarray((seen.T * modal[:, None, :]) @ pushed)
    row = column = 0
    for own, rows, columns in zip(local_flexibility(body), responses, forces, strict=True):
        patch = (rows[:, : len(AXES)] * own) @ columns[:, : len(AXES)].T
        values[:, row : row + len(rows), column : column + len(columns)] += patch
        row, column = row + len(rows), column + len(columns)
    return values


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
