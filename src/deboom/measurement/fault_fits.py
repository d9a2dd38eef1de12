"""What may be wrong with one sensor, fitted to what the other sensors say it should have shown."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from itertools import permutations, product

import numpy as np
import numpy.typing as npt

from deboom.measurement.channel_geometry import ChannelGeometry
from deboom.measurement.sensors import SENSOR_AXES
from deboom.physics.arrays import RealArray
from deboom.physics.rigid_body import forward_matrices

DEAD_BELOW = 0.1
"""Share of the expected signal below which a channel counts as dead."""
REVERSED_WITHIN = 0.2
"""How far from −1 a factor may lie and still be called a reversed sign."""
AS_GOOD = 1.05
"""Ratio of two misfits (squared) up to which the simpler explanation is preferred."""


class Fault(Enum):
    """Kinds of fault that leave-one-out can tell apart."""

    SIGN = "reversed sign"
    DEAD = "dead channel"
    GAIN = "wrong sensitivity"
    AXES = "swapped axes"
    OFFSET = "wrong position"
    TILT = "wrong orientation"
    UNEXPLAINED = "unexplained"


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
        Forward matrix of all channels with the fault as a fact.
    """

    fault: Fault
    channels: tuple[str, ...]
    detail: str
    forward: RealArray


def fault_fits(
    geometry: ChannelGeometry,
    rows: npt.NDArray[np.intp],
    measured: RealArray,
    motion: RealArray,
) -> Iterator[FaultFit]:
    """Fit every kind of fault to one sensor or impact, the simplest kinds first.

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
    Factor of a channel, offset and rotation of a sensor are linear least squares or a Procrustes
    problem, once the motion is known from the others. A sensor with channels switched off is not
    asked for its axes and orientation.
    """
    expected = geometry.forward[rows] @ motion
    for row, shown, wanted in zip(rows, measured, expected, strict=True):
        if np.any(wanted != 0):
            yield _factor(geometry, int(row), float(shown @ wanted / (wanted @ wanted)))
    if len(rows) == len(SENSOR_AXES):
        yield _axes(geometry, rows, measured, expected)
    yield _offset(geometry, rows, measured - expected, motion)
    if len(rows) == len(SENSOR_AXES):
        yield _tilt(geometry, rows, measured, motion)


def _factor(geometry: ChannelGeometry, row: int, factor: float) -> FaultFit:
    forward = geometry.forward
    forward[row] *= factor
    fault = Fault.GAIN
    if abs(factor + 1.0) < REVERSED_WITHIN:
        fault = Fault.SIGN
    elif abs(factor) < DEAD_BELOW:
        fault = Fault.DEAD
    detail = f"shows {factor:.3g} times what the others imply"
    return FaultFit(fault, (geometry.channels[row],), detail, forward)


def _axes(
    geometry: ChannelGeometry,
    rows: npt.NDArray[np.intp],
    measured: RealArray,
    expected: RealArray,
) -> FaultFit:
    """Of all ways to mix up three axes, the one with the fewest changes that fits."""
    turns = list(_signed_permutations())
    misfits = np.array([np.sum((measured - turn @ expected) ** 2) for turn in turns])
    plausible = [t for t, m in zip(turns, misfits, strict=True) if m <= AS_GOOD * misfits.min()]
    turn = max(plausible, key=np.trace)
    forward = geometry.forward
    forward[rows] = turn @ forward[rows]
    changed = [
        (channel, ("" if turn[axis].sum() > 0 else "−") + SENSOR_AXES[int(np.argmax(abs(turn[axis])))])
        for axis, channel in enumerate(geometry.channels[row] for row in rows)
        if turn[axis, axis] != 1.0
    ]
    detail = ", ".join(f"{channel} carries {carried}" for channel, carried in changed)
    return FaultFit(Fault.AXES, tuple(channel for channel, _ in changed), detail, forward)


def _signed_permutations() -> Iterator[RealArray]:
    """All 3×3 signed permutations that change more than one axis."""
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.array(signs)[:, np.newaxis] * np.eye(3)[list(order)]
        if np.count_nonzero(np.diag(turn) == 1.0) < 2:
            yield turn


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
    return FaultFit(Fault.OFFSET, channels, detail, replace(geometry, levers=levers).forward)


def _tilt(
    geometry: ChannelGeometry,
    rows: npt.NDArray[np.intp],
    measured: RealArray,
    motion: RealArray,
) -> FaultFit:
    """Rotation between sheet and sensor, by the Procrustes problem of the two accelerations."""
    directions = geometry.directions[rows]
    here = forward_matrices(geometry.levers[rows[:1]]) @ motion[:6]
    left, _, right = np.linalg.svd(directions.T @ measured @ here.T)
    handed = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    rotation = left @ handed @ right
    turned = geometry.directions.copy()
    turned[rows] = directions @ rotation
    degrees = np.degrees(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0)))
    detail = f"is turned by {degrees:.1f}° against the position sheet"
    channels = tuple(geometry.channels[row] for row in rows)
    return FaultFit(Fault.TILT, channels, detail, replace(geometry, directions=turned).forward)
