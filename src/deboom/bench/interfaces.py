"""Where mounts and ears meet the body: six motions per interface, pressure at two ears.

The frozen truth of a body holds its shapes along the forces of the paths alone. A measurement
around a mount also feels how the body turns there, and the sides of the wishbone differ. Both are a
fixed linear map of the frozen shapes, drawn once for the platform: a change of a body changes its
rotations with its translations, and nominally identical vehicles stay alike. The interfaces are the
virtual points in the order of `deboom.bench.layout.points`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.fleet import Body, Cabin
from deboom.bench.operating_run import SIDES
from deboom.bench.powertrain import AXES

INTERFACE_SEED, EAR_SEED = 20, 21
"""Draw the map, and the passenger's seat with the cabin's lateral mode, for every vehicle of every
fleet: they belong to the truth."""

ROTATION_LENGTH = 0.4
"""A mode that moves the interfaces by 1 turns them by 1 over this length [m]; judgement, between
the span of the front carrier and that of a long member."""

SIDE_SPREAD = 0.3
"""Part in which the sides of the wishbone differ, against their common shape [1]; judgement."""

N_MOTION = 6

EARS = ("driver ear", "passenger ear")

SEAT_SPREAD = 0.05
"""How far the seats differ along the first cabin mode, standard deviation [1]; judgement."""

LATERAL_FREQUENCY, LATERAL_DAMPING, LATERAL_AT_EAR = 122.0, 0.06, 0.6
"""First lateral mode of a cabin 1.4 m wide [Hz], [1], and its shape at an ear [1]."""

LATERAL_AT_PANELS = 0.3
"""What a panel, left and right together, shows of the lateral mode: spread [1]; judgement."""


@cache
def _map(n_mount: int) -> RealArray:
    """Draw the map from shapes along the paths to interfaces, shape (6 n_interface, n_path)."""
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

    - returns (n_mode, n_interface, 6): translations along x, y, z [kg^-1/2] and rotations about
      them [kg^-1/2/m], at the virtual points. Translations along the paths are the body's own; the
      mean of the wishbone's sides is its ``Du x``, and along y and z nothing reaches the body
      there.
    """
    n_mount = (body.shapes_at_paths.shape[1] - 1) // len(AXES)
    flat = body.shapes_at_paths @ _map(n_mount).T
    return np.asarray(flat.reshape(len(flat), -1, N_MOTION))


def local_flexibility(body: Body) -> RealArray:
    """Return displacement per force right at each interface besides the modes, (n, 3) [m/N].

    Two sides that carry half of a force each give way half as much as one: each side of the
    wishbone has half the stiffness that stands for both.
    """
    stiffness = body.local_stiffness
    sides = np.full((len(SIDES), len(AXES)), stiffness[-1] / len(SIDES))
    return np.asarray(1 / np.vstack([stiffness[:-1].reshape(-1, len(AXES)), sides]))


def point_shapes(body: Body, rows: tuple[RealArray, ...]) -> RealArray:
    """Return what channels around the interfaces see of the modes, shape (n_mode, n_channel).

    Rows are, per interface, motion at the virtual point → channels, shape (n_channel, 6).
    """
    shapes = interface_shapes(body)
    return np.hstack([shapes[:, k] @ forward.T for k, forward in enumerate(rows)])


def point_receptance(
    body: Body,
    frequency: RealArray,
    responses: tuple[RealArray, ...],
    forces: tuple[RealArray, ...],
) -> ComplexArray:
    """Find the displacement at channels around the interfaces per force at others.

    Channels are as in `point_shapes`; the result is (f, n_response, n_force) [m/N].
    """
    modal = body.modal_receptance(frequency)
    seen, pushed = point_shapes(body, responses), point_shapes(body, forces)
    values = np.asarray((seen.T * modal[:, None, :]) @ pushed)
    row = column = 0
    for flexibility, rows, columns in zip(local_flexibility(body), responses, forces, strict=True):
        patch = (rows[:, : len(AXES)] * flexibility) @ columns[:, : len(AXES)].T
        values[:, row : row + len(rows), column : column + len(columns)] += patch
        row, column = row + len(rows), column + len(columns)
    return values


def panel_pressure(cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Return the pressure at the ears per displacement of each panel, (f, n_ear, n_panel) [Pa/m].

    The driver's pressure is the frozen truth. The difference between two ears at one height is that
    of their seats and of the lateral mode. The frozen truth has nothing of that mode, so the
    passenger carries the whole of it here. The passenger is the same one in every vehicle.
    """
    generator = np.random.default_rng(EAR_SEED)
    (mode,) = cabin.modes
    seat = replace(mode, ear_shape=mode.ear_shape + SEAT_SPREAD * float(generator.normal()))
    at_panels = generator.normal(0, LATERAL_AT_PANELS, cabin.panel_areas.size)
    ratio = frequency / LATERAL_FREQUENCY
    answer = ratio**2 / (1 - ratio**2 + 2j * LATERAL_DAMPING * ratio)
    spring = cabin.bulk_modulus * cabin.panel_areas / cabin.volume
    lateral = -2 * LATERAL_AT_EAR * np.outer(answer, at_panels) * spring
    passenger = replace(cabin, modes=(seat,)).pressure(frequency) + lateral
    return np.stack([cabin.pressure(frequency), passenger], axis=1)


def ear_transfer(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the pressure at the ears per load at an interface, (f, n_ear, n_interface, 6) [Pa/N]."""
    per_mode = panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    modal = per_mode * body.modal_receptance(frequency)[:, None, :]
    return np.asarray(np.einsum("fen,nia->feia", modal, interface_shapes(body)))


def source_motion(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the motion of the interfaces when a loudspeaker breathes at an ear.

    Displacement [1/m²] and rotation [1/m³] per volume displacement, shape (f, n_interface, 6,
    n_ear).

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
