"""What may be wrong with one sensor, fitted to what the other sensors say it should have shown."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from itertools import permutations, product

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.measurement.channel_geometry import ChannelGeometry
from deboom.measurement.sensors import SENSOR_AXES
from deboom.physics.rigid_body import forward_matrices

LARGEST_TILT = 30.0
"""Rotation beyond which an orientation is more likely a mix-up of axes [degrees]."""


class Fault(Enum):
    """Kinds of fault that can be told apart."""

    SIGN = "reversed sign"
    DEAD = "dead channel"
    AXES = "swapped axes"
    GAIN = "wrong sensitivity"
    OFFSET = "wrong position"
    TILT = "wrong orientation"
    UNEXPLAINED = "unexplained"


FITTED = 4
"""Complexity of a fault with a fitted size; that of a mix-up is the number of channels changed."""


@dataclass(frozen=True, eq=False)
class FaultFit:
    """One explanation of a sensor's disagreement.

    Parameters
    ----------
    fault : Fault
        Its kind.
    channels : tuple of str
        Channels concerned.
    detail : str
        Its size, in words.
    forward : array, shape (n_channel, n_motion)
        Forward matrix of all channels with the fault taken as a fact.
    complexity : int
        By which equally good explanations are ranked, the simplest first.
    """

    fault: Fault
    channels: tuple[str, ...]
    detail: str
    forward: RealArray
    complexity: int


def fault_fits(
    geometry: ChannelGeometry,
    rows: npt.NDArray[np.intp],
    measured: RealArray,
    motion: RealArray,
) -> Iterator[FaultFit]:
    """Fit every kind of fault to one sensor or impact.

    Parameters
    ----------
    geometry : ChannelGeometry
        What the position sheet says of all channels.
    rows : array of int
        Channels of the suspect.
    measured : array, shape (len(rows), n)
        What they show, in n states of motion.
    motion : array, shape (n_motion, n)
        What the other channels say of the motion at the virtual point in these states.

    Notes
    -----
    Once the motion is known from the others, the factor of a channel and the offset of a sensor are
    linear least squares, its rotation is a Procrustes problem, and of the ways to mix up three
    axes there are 48. A sensor with channels switched off is not asked for axes and orientation; a
    single channel of a triaxial sensor, which the others cannot do without, only for its factor.
    """
    expected = geometry.forward[rows] @ motion
    for row, shown, wanted in zip(rows, measured, expected, strict=True):
        energy = float(wanted @ wanted)
        if energy > 0:
            yield from _factors(geometry, int(row), float(shown @ wanted) / energy)
    if len(rows) == len(SENSOR_AXES):
        yield from _axes(geometry, rows)
        yield from _tilt(geometry, rows, measured, motion)
    if len(rows) == len(geometry.rows_of(geometry.owners[rows[0]])):
        yield _offset(geometry, rows, measured - expected, motion)


def _factors(geometry: ChannelGeometry, row: int, fitted: float) -> Iterator[FaultFit]:
    """One channel reversed, dead, or of another sensitivity."""
    detail = f"shows {fitted:.3g} times what the others imply"
    for fault, factor, complexity in (
        (Fault.SIGN, -1.0, 1),
        (Fault.DEAD, 0.0, 1),
        (Fault.GAIN, fitted, FITTED),
    ):
        forward = geometry.forward.copy()
        forward[row] *= factor
        yield FaultFit(fault, (geometry.channels[row],), detail, forward, complexity)


def _axes(geometry: ChannelGeometry, rows: npt.NDArray[np.intp]) -> Iterator[FaultFit]:
    """All ways to mix up three axes and their signs that change more than one channel."""
    channels = [geometry.channels[row] for row in rows]
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        changed = [axis for axis in range(3) if (order[axis], signs[axis]) != (axis, 1)]
        if len(changed) < 2:
            continue
        forward = geometry.forward.copy()
        forward[rows] = np.array(signs)[:, np.newaxis] * forward[rows[list(order)]]
        carried = [
            f"{channels[axis]} carries {'' if signs[axis] > 0 else '−'}{SENSOR_AXES[order[axis]]}"
            for axis in changed
        ]
        names = tuple(channels[axis] for axis in changed)
        yield FaultFit(Fault.AXES, names, ", ".join(carried), forward, complexity=len(changed))


def _offset(
    geometry: ChannelGeometry,
    rows: npt.NDArray[np.intp],
    excess: RealArray,
    motion: RealArray,
) -> FaultFit:
    """Offset δ: an excess ``d · (ω × δ) = (d × ω) · δ`` in each state of motion."""
    directions = geometry.directions[rows]
    system = np.cross(directions[:, np.newaxis, :], motion[3:6].T[np.newaxis, :, :])
    offset = np.linalg.lstsq(system.reshape(-1, 3), excess.ravel(), rcond=None)[0]
    levers = geometry.levers.copy()
    levers[rows] += offset
    x, y, z = 1e3 * offset
    detail = (
        f"sits {np.linalg.norm(1e3 * offset):.1f} mm from where the position sheet says, by "
        f"({x:+.1f}, {y:+.1f}, {z:+.1f}) mm"
    )
    channels = tuple(geometry.channels[row] for row in rows)
    return FaultFit(
        Fault.OFFSET, channels, detail, replace(geometry, levers=levers).forward, FITTED
    )


def _tilt(
    geometry: ChannelGeometry,
    rows: npt.NDArray[np.intp],
    measured: RealArray,
    motion: RealArray,
) -> Iterator[FaultFit]:
    """Rotation between sheet and sensor, by the Procrustes problem of the two accelerations."""
    directions = geometry.directions[rows]
    here = forward_matrices(geometry.levers[rows[:1]]) @ motion[:6]
    left, _, right = np.linalg.svd(directions.T @ measured @ here.T)
    proper = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    rotation = left @ proper @ right
    degrees = np.degrees(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0)))
    if degrees > LARGEST_TILT:
        return
    turned = geometry.directions.copy()
    turned[rows] = directions @ rotation
    yield FaultFit(
        Fault.TILT,
        tuple(geometry.channels[row] for row in rows),
        f"is turned by {degrees:.1f}° against the position sheet",
        replace(geometry, directions=turned).forward,
        FITTED,
    )
