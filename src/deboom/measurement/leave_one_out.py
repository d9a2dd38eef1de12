"""How well the channels of a rigid body agree, and how well without one of the sensors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channel_geometry import ChannelGeometry
from deboom.measurement.conditioning import SINGULAR, characteristic_length, column_scale

Rows = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class LeftOut:
    """One sensor or impact, or one channel that its sensor can be without.

    Parameters
    ----------
    name : str
        Of the sensor, impact or channel.
    rows : array of int
        Channels left out.
    remaining : float
        Mean squared disagreement of the others, per degree of freedom left, relative to the mean
        squared signal [1].
    """

    name: str
    rows: Rows
    remaining: float


@dataclass(frozen=True, eq=False)
class MotionStates:
    """What n channels show in a few states of motion; made by `motion_states`.

    Parameters
    ----------
    geometry : ChannelGeometry
        Where the channels sit.
    values : array, shape (n, n_state)
        What they show, so scaled that their mean squared sum over the states is 1.
    """

    geometry: ChannelGeometry
    values: RealArray

    @cached_property
    def _root_weights(self) -> RealArray:
        return np.asarray(np.sqrt(self.geometry.weights / self.geometry.weights.mean()))

    @cached_property
    def _scale(self) -> RealArray:
        return column_scale(self.geometry, characteristic_length(self.geometry))

    def others(self, rows: Rows) -> Rows:
        """Return the channels beside these."""
        return np.setdiff1d(np.arange(len(self.geometry.channels)), rows)

    def disagreement(self, forward: RealArray, rows: Rows | None = None) -> float:
        """Mean squared residual of a forward matrix, per degree of freedom left.

        Parameters
        ----------
        forward : array, shape (n, n_motion)
            That of the position sheet, or of a supposed fault.
        rows : array of int, optional
            Channels to look at; by default all.

        Returns
        -------
        float
            Relative to the mean squared signal [1]; infinite where the channels do not
            overdetermine the motion.
        """
        rows = self.others(np.array([], dtype=np.intp)) if rows is None else rows
        root_weights = self._root_weights[rows, np.newaxis]
        n_channel, n_motion = len(rows), forward.shape[1]
        if n_channel <= n_motion:
            return float("inf")
        left, singular, _ = np.linalg.svd(
            root_weights * forward[rows] / self._scale, full_matrices=False
        )
        if singular[-1] * SINGULAR < singular[0]:
            return float("inf")
        seen = root_weights * self.values[rows]
        residual = seen - left @ (left.T @ seen)
        return float(np.sum(residual**2) / (n_channel - n_motion))

    def inverse_without(self, rows: Rows) -> RealArray:
        """Return all channels but these → motion, shape (n_motion, n − len(rows))."""
        rest = self.others(rows)
        weighted = self._root_weights[rest, np.newaxis] * self.geometry.forward[rest] / self._scale
        return np.asarray(
            np.linalg.pinv(weighted) * self._root_weights[rest] / self._scale[:, np.newaxis]
        )

    def leave_one_out(self) -> tuple[LeftOut, ...]:
        """Leave out each sensor, or each of its channels where the rest cannot do without it."""
        found = []
        for owner in dict.fromkeys(self.geometry.owners):
            rows = self.geometry.rows_of(owner)
            found.append(self._left_out(owner, rows))
            if not np.isfinite(found[-1].remaining) and len(rows) > 1:
                channels = self.geometry.channels
                found.extend(self._left_out(channels[row], np.array([row])) for row in rows)
        return tuple(item for item in found if np.isfinite(item.remaining))

    def _left_out(self, name: str, rows: Rows) -> LeftOut:
        return LeftOut(name, rows, self.disagreement(self.geometry.forward, self.others(rows)))


def motion_states(geometry: ChannelGeometry, channels: npt.ArrayLike) -> MotionStates:
    """Reduce many measured lines to at most n real states of motion that hold all they do.

    Parameters
    ----------
    geometry : ChannelGeometry
        Where n channels sit.
    channels : array, shape (n_line, n)
        What they show, complex, one row per line and excitation; each row counts alike.

    Raises
    ------
    InputError
        Shapes that disagree, or no signal.

    Notes
    -----
    The triangle R of a QR factorisation of the stacked real and imaginary parts has the same
    products ``RᵀR`` as the data, and so the same residuals.
    """
    values = np.asarray(channels, dtype=complex)
    n = len(geometry.channels)
    if values.ndim != 2 or values.shape[1] != n:
        raise InputError(f"{n} channels need lines of shape (n_line, {n}), not {values.shape}")
    size = np.sqrt(np.average(np.abs(values) ** 2, axis=1, weights=geometry.weights))
    moving = size > 0
    if not np.any(moving):
        raise InputError("no channel shows any signal: nothing can be said about a culprit")
    alike = values[moving] / size[moving, np.newaxis]
    triangle = np.linalg.qr(np.vstack([alike.real, alike.imag]))[1]
    return MotionStates(geometry, triangle.T / np.sqrt(np.count_nonzero(moving)))
