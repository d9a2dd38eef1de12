"""How well a set of channels determines the motion of its virtual point, before any measurement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channel_geometry import RIGID_MOTIONS, ChannelGeometry

SINGULAR = 1e6
"""Scaled condition number from which a motion counts as not seen at all: three sensors that miss a
common line by a millionth of their distance."""


@dataclass(frozen=True, eq=False)
class Conditioning:
    """What a position sheet promises.

    Parameters
    ----------
    rank : int
        Independent motions that the channels see.
    n_motion : int
        Motions asked for: six, and the flexible modes.
    condition_number : float
        Of the forward matrix with rotations counted as motion at `length`, flexible modes as their
        rms over the channels; infinite where the rank is short [1].
    length : float
        Characteristic length: mean distance of the channels from the virtual point [m].
    worst_seen : str
        The motion, or mixture of motions, that the channels see least, in words.
    noise_gain : array, shape (n_motion,)
        Standard deviation of each motion per that of a channel of weight 1 [1, 1/m, …]; infinite
        where the rank is short.
    redundancy : array, shape (n_channel,)
        Share of an error in one channel that shows in its own residual, 0 … 1; a fault in a channel
        of redundancy 0 cannot be noticed [1].
    """

    rank: int
    n_motion: int
    condition_number: float
    length: float
    worst_seen: str
    noise_gain: RealArray
    redundancy: RealArray

    def __post_init__(self) -> None:
        for name in ("noise_gain", "redundancy"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def complete(self) -> bool:
        """Whether every motion is seen."""
        return self.rank == self.n_motion


def conditioning(geometry: ChannelGeometry) -> Conditioning:
    """Judge a position sheet.

    Parameters
    ----------
    geometry : ChannelGeometry
        Channels in use, seen from the virtual point.

    Raises
    ------
    InputError
        No channels, or all of them at the virtual point.

    Notes
    -----
    The weights do not enter the condition number: it is a property of the geometry. They enter
    `noise_gain`, ``√diag (Vᵀ W V)⁻¹``, and `redundancy`, ``1 − diag V V⁺``. Without the scaling the
    number depends on the unit of length (three sensors of a published rig 30 mm from their virtual
    point: 49 in metres, 1.5 scaled).
    """
    length = characteristic_length(geometry)
    scaled = geometry.forward / column_scale(geometry, length)
    singular, directions = np.linalg.svd(scaled)[1:]
    n_motion = scaled.shape[1]
    rank = int(np.count_nonzero(singular > singular[0] / SINGULAR))
    noise_gain = np.full(n_motion, np.inf)
    condition_number = np.inf
    root_weight = np.sqrt(geometry.weights)[:, np.newaxis]
    left, weighted, right = np.linalg.svd(root_weight * scaled, full_matrices=False)
    seen = left[:, :rank]
    if rank == n_motion:
        condition_number = float(singular[0] / singular[-1])
        gain = np.linalg.norm(right.T / weighted, axis=1)
        noise_gain = gain / column_scale(geometry, length)
    return Conditioning(
        rank=rank,
        n_motion=n_motion,
        condition_number=condition_number,
        length=length,
        worst_seen=_in_words(directions[-1] / column_scale(geometry, length), geometry),
        noise_gain=noise_gain,
        redundancy=np.clip(1.0 - np.sum(seen**2, axis=1), 0.0, 1.0),
    )


def characteristic_length(geometry: ChannelGeometry) -> float:
    """Mean distance of the channels from the virtual point [m].

    Raises
    ------
    InputError
        No channels, or all of them at the virtual point.
    """
    if not geometry.channels:
        raise InputError("a virtual point needs channels: all of them are switched off")
    length = float(np.mean(np.linalg.norm(geometry.levers, axis=1)))
    if not length > 0:
        raise InputError(
            f"the channels {list(geometry.channels)} all sit at the virtual point: they see no "
            "rotation; check the position sheet"
        )
    return length


def column_scale(geometry: ChannelGeometry, length: float) -> RealArray:
    """Scale of each motion, for columns of the forward matrix that can be compared.

    Parameters
    ----------
    geometry : ChannelGeometry
        n channels and their flexible modes.
    length : float
        Characteristic length [m].

    Returns
    -------
    array, shape (n_motion,)
        1 for translations, `length` for rotations, rms over the channels for flexible modes.
    """
    rms = np.sqrt(np.mean(geometry.mode_shapes**2, axis=0))
    return np.concatenate([[1.0] * 3, [length] * 3, np.where(rms > 0, rms, 1.0)])


def _in_words(motion: RealArray, geometry: ChannelGeometry) -> str:
    """Describe a motion at the virtual point: the axis it turns about, the way it goes."""
    shares = np.abs(motion * column_scale(geometry, characteristic_length(geometry)))
    of_modes = shares[len(RIGID_MOTIONS) :]
    if of_modes.sum() > 0.1 * shares.sum():
        mode = geometry.mode_names[int(np.argmax(of_modes))]
        return f"flexible mode {mode}, hardly to be told from the other motions"
    shift, turn = motion[:3], motion[3:6]
    angle = float(np.linalg.norm(turn))
    if angle * characteristic_length(geometry) < 0.1 * np.linalg.norm(shift):
        return f"translation along {_vector(shift / np.linalg.norm(shift))}"
    axis = turn / angle
    on_axis = geometry.position + np.cross(axis, shift) / angle
    return f"rotation about the axis {_vector(axis)} through {_vector(on_axis)} m"


def _vector(values: RealArray | Sequence[float]) -> str:
    # adding zero turns -0.0 into 0.0
    return "(" + ", ".join(f"{np.round(value, 3) + 0.0:g}" for value in values) + ")"
