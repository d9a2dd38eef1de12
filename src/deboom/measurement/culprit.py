"""Leave-one-out: which sensor contradicts all others, and what is likely to be wrong with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.measurement.channel_geometry import ChannelGeometry
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.conditioning import SINGULAR, characteristic_length, column_scale
from deboom.measurement.fault_fits import AS_GOOD, Fault, FaultFit, fault_fits
from deboom.measurement.virtual_point import VirtualPoint
from deboom.physics.arrays import RealArray

NAMED_BELOW = 0.6
"""A culprit is named if the rest disagrees by less than this share (squared) of all together."""
APART = 1.1
"""And if leaving out the next suspect leaves at least this many times more (squared)."""
EXPLAINED_WITHIN = 4.0
"""A fault explains if, once undone, all disagree less than this many times the rest (squared)."""
PERFECT = 1e-6
"""Relative disagreement (rms) below which data are free of faults: rounding of files."""


@dataclass(frozen=True, eq=False)
class LeaveOneOut:
    """How well the rest fits a rigid body when one item is left out.

    Parameters
    ----------
    items : tuple of str
        Sensors or impacts; channels of those that the rest cannot do without.
    residual : array, shape (n_item,)
        Rms disagreement of the rest, per degree of freedom left, relative to the rms signal [1].
    residual_of_all : float
        The same with nothing left out [1].
    """

    items: tuple[str, ...]
    residual: RealArray
    residual_of_all: float

    def __post_init__(self) -> None:
        array = np.array(self.residual, dtype=float)
        array.setflags(write=False)
        object.__setattr__(self, "residual", array)


@dataclass(frozen=True)
class Culprit:
    """The one sensor, impact or channel that contradicts all others.

    Parameters
    ----------
    name : str
        Of the sensor or impact; of the channel if only that one is at fault.
    fault : Fault
        Its likely kind.
    channels : tuple of str
        Channels concerned.
    detail : str
        Size of the fault, in words.
    residual_undone : float
        Rms disagreement of all channels with the fault undone, relative to the rms signal [1].
    """

    name: str
    fault: Fault
    channels: tuple[str, ...]
    detail: str
    residual_undone: float


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Result of `find_culprit`.

    Parameters
    ----------
    leave_one_out : LeaveOneOut
        Its numbers.
    culprit : Culprit or None
        None where no single item stands out.
    verdict : str
        One sentence.
    """

    leave_one_out: LeaveOneOut
    culprit: Culprit | None
    verdict: str


def culprit_of_responses(point: VirtualPoint, measured: Spectrum | Frf) -> Diagnosis:
    ...


def find_culprit(geometry: ChannelGeometry, channels: npt.ArrayLike) -> Diagnosis:
    states = _states(geometry, np.asarray(channels, dtype=complex))
    return _diagnose(geometry, states)


def _states(geometry: ChannelGeometry, values):
    """n real states of motion that hold all that the lines hold; each line counts alike."""
    size = np.sqrt(np.mean(np.abs(values) ** 2, axis=1))
    lines = values[size > 0] / size[size > 0, np.newaxis]
    stacked = np.vstack([lines.real, lines.imag])
    triangle = np.linalg.qr(stacked, mode="r")
    return triangle.T / np.sqrt(lines.shape[0])


def _disagreement(forward, states, weights, scale):
    """Squared disagreement per degree of freedom left; infinite where there is none"""
    n_channel, n_motion = forward.shape
    if n_channel <= n_motion:
        return np.inf
    root = np.sqrt(weights)[:, None]
    left, singular, _ = np.linalg.svd(root * forward / scale, full_matrices=False)
    if singular[-1] * SINGULAR < singular[0]:
        return np.inf
    seen = root * states
    rest = seen - left @ (left.T @ seen)
    return float(np.sum(rest**2) / (n_channel - n_motion))


def _diagnose(geometry, states):
    scale = column_scale(geometry, characteristic_length(geometry))
    def misfit(forward, rows=slice(None)):
        return _disagreement(forward[rows], states[rows], geometry.weights[rows], scale)
    forward = geometry.forward
    n = len(geometry.channels)
    of_all = misfit(forward)
    items = {}
    for owner in dict.fromkeys(geometry.owners):
        rows = geometry.rows_of(owner)
        rest = np.setdiff1d(np.arange(n), rows)
        without = misfit(forward, rest)
        if np.isfinite(without):
            items[owner] = (rows, without)
            continue
        for row in rows:
            r=np.array([row]); w = misfit(forward, np.setdiff1d(np.arange(n), r))
            if np.isfinite(w): items[geometry.channels[row]] = (r, w)
    order = sorted(items, key=lambda k: items[k][1])
    best = order[0]
    rows, without = items[best]
    if without > NAMED_BELOW * of_all or items[order[1]][1] < APART * without:
        return best, None, without/of_all, items[order[1]][1]/without, None
    rest = np.setdiff1d(np.arange(n), rows)
    motion = np.linalg.lstsq(forward[rest]/scale, states[rest], rcond=None)[0]/scale[:,None]
    fits = list(fault_fits(geometry, rows, states[rows], motion))
    mis = [misfit(f.forward) for f in fits]
    m = min(mis)
    fit = next(f for f, v in zip(fits, mis) if v <= AS_GOOD * m)
    un = m > EXPLAINED_WITHIN * without
    return best, ("unexplained" if un else fit), without/of_all, items[order[1]][1]/without, [(f.fault.value, f.detail, v/without) for f, v in zip(fits, mis)]
