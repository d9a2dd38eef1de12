"""Leave-one-out: which sensor contradicts all others, and what is likely to be wrong with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.measurement.channel_geometry import ChannelGeometry
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.conditioning import SINGULAR, characteristic_length, column_scale
from deboom.measurement.expected_error import error_variance
from deboom.measurement.fault_fits import Fault, FaultFit, fault_fits
from deboom.measurement.tolerances import Tolerances
from deboom.measurement.virtual_point import VirtualPoint
from deboom.physics.arrays import ComplexArray, RealArray

STANDS_OUT = 0.7
"""A suspect stands out if the rest disagrees by less than this share (squared) of all together."""
SIGNIFICANT = 2.0
"""And if it contradicts the rest by more than this many times what the tolerances allow (rms)."""
PERFECT = 1e-6
"""Relative disagreement (rms) that is rounding of files."""
EXPLAINED = 0.9, 2.0
"""A fault is an explanation if, once undone, this share of the disagreement (squared) is gone, or
what is left is less than this many times what the rest has."""
AS_GOOD = 0.02, 1.05
"""Two explanations are equally good if what they leave differs by less than this share of the
disagreement (squared), or by less than this factor; then the simpler one is chosen."""
BEYOND_DOUBT = 0.15
"""What a reversed or dead channel, once undone, may leave of the disagreement (rms) to be named
where no whole sensor can be left out."""


@dataclass(frozen=True, eq=False)
class LeaveOneOut:
    """How well the rest fits a rigid body when one item is left out.

    Parameters
    ----------
    items : tuple of str
        Sensors or impacts; single channels of those that the rest cannot do without.
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
class Suspect:
    """The item without which the rest agrees best.

    Parameters
    ----------
    name : str
        Sensor or impact; the channel if only that one was left out.
    fault : Fault
        Likely kind of its fault.
    channels : tuple of str
        Channels concerned.
    detail : str
        Size of the fault, in words.
    significance : float
        Its contradiction to the rest over what the tolerances of all sensors let expect, rms [1].
    residual_undone : float
        Rms disagreement of all channels with the fault undone, relative to the rms signal [1].
    """

    name: str
    fault: Fault
    channels: tuple[str, ...]
    detail: str
    significance: float
    residual_undone: float


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Who is the culprit.

    Parameters
    ----------
    leave_one_out : LeaveOneOut
        The numbers behind it.
    suspect : Suspect or None
        First suspect; None where the data agree to rounding or nothing can be left out.
    named : bool
        Whether the suspect stands out enough to be called the culprit.
    verdict : str
        One sentence.
    """

    leave_one_out: LeaveOneOut
    suspect: Suspect | None
    named: bool
    verdict: str


def culprit_of_responses(
    point: VirtualPoint, measured: Spectrum | Frf, tolerances: Tolerances
) -> Diagnosis:
    """Find the sensor that contradicts all others.

    Parameters
    ----------
    point : VirtualPoint
        Of the motion sensors.
    measured : Spectrum or Frf
        Their spectra, or frequency response functions with them as outputs.
    tolerances : Tolerances
        Of placement and calibration: what is within them is nobody's fault.

    Raises
    ------
    InputError
        A missing channel, or no signal in any of them.

    Notes
    -----
    See `find_culprit`. Impacts in 18 directions let the six motions vary independently; an engine
    order moves the body in few of them, and a fault that does not show in these stays hidden.
    """
    if isinstance(measured, Frf):
        columns = np.moveaxis(measured.select(outputs=point.channels).values, 1, 2)
        return find_culprit(point.geometry, columns.reshape(-1, len(point.channels)), tolerances)
    return find_culprit(point.geometry, measured.select(point.channels).values, tolerances)


def culprit_of_excitation(point: VirtualPoint, measured: Frf, tolerances: Tolerances) -> Diagnosis:
    """Find the impact that contradicts all others; see `culprit_of_responses`.

    Parameters
    ----------
    point : VirtualPoint
        Of the points of excitation, which are inputs of `measured`.
    measured : Frf
        Frequency response functions.
    tolerances : Tolerances
        Those of the sensors are taken for the impacts as well.
    """
    rows = measured.select(inputs=point.channels).values
    return find_culprit(point.geometry, rows.reshape(-1, len(point.channels)), tolerances)


def find_culprit(
    geometry: ChannelGeometry, channels: npt.ArrayLike, tolerances: Tolerances
) -> Diagnosis:
    """Leave out each sensor in turn, and explain the one without which the rest agrees.

    Parameters
    ----------
    geometry : ChannelGeometry
        Where n channels sit.
    channels : array, shape (n_state, n)
        What they show, complex; each state (line and excitation) counts alike.
    tolerances : Tolerances
        Of placement and calibration.

    Raises
    ------
    InputError
        Shapes that disagree, or no signal.

    Notes
    -----
    The consistency of a channel does not point at the culprit: least squares spreads a fault over
    its neighbours. Without the faulty sensor the rest agrees to its noise. A sensor is named if
    (1) leaving it out removes a good part of the disagreement, and (2) it contradicts what the
    rest implies by more than the tolerances of all sensors together allow. Of all faults that
    explain the contradiction equally well the simplest is reported. With three triaxial sensors
    nothing can be left out but single channels; then only a reversed or dead channel is named.
    """
    values = np.asarray(channels, dtype=complex)
    if values.ndim != 2 or values.shape[1] != len(geometry.channels):
        raise InputError(
            f"{len(geometry.channels)} channels need states of shape (n, "
            f"{len(geometry.channels)}), not {values.shape}"
        )
    search = _Search(geometry, _states(values, geometry.weights))
    items = search.items()
    of_all = search.disagreement(geometry.forward)
    table = LeaveOneOut(
        tuple(items), np.sqrt([without for _, without in items.values()]), float(np.sqrt(of_all))
    )
    if table.residual_of_all < PERFECT:
        return Diagnosis(table, None, False, "all channels agree to rounding")
    if not items:
        return Diagnosis(
            table, None, False, "no sensor can be left out: there is no redundancy to judge by"
        )
    name = min(items, key=lambda item: items[item][1])
    rows, without = items[name]
    suspect = search.explain(name, rows, without, tolerances)
    partial = len(rows) < len(geometry.rows_of(geometry.owners[rows[0]]))
    if without > STANDS_OUT * of_all:
        verdict = f"no culprit: without {name}, the first suspect, the rest agrees hardly better"
    elif suspect.significance < SIGNIFICANT:
        verdict = (
            f"no culprit: {name} disagrees most, by {suspect.significance:.1f} times what the "
            f"tolerances let expect ({suspect.fault.value}: it {suspect.detail})"
        )
    elif partial and not _beyond_doubt(suspect, table):
        verdict = (
            f"no culprit: no reversed or dead channel alone explains the disagreement of "
            f"{100 * table.residual_of_all:.2g} %, and only with a fourth sensor can whole "
            "sensors be left out"
        )
    else:
        verdict = f"{name}: {suspect.fault.value}, {suspect.detail}"
        return Diagnosis(table, suspect, True, verdict)
    return Diagnosis(table, suspect, False, verdict)


def _beyond_doubt(suspect: Suspect, table: LeaveOneOut) -> bool:
    """Whether one channel explains everything although its sensor could not be left out."""
    remaining = suspect.residual_undone / table.residual_of_all
    return suspect.fault in (Fault.SIGN, Fault.DEAD) and remaining < BEYOND_DOUBT


def _states(values: ComplexArray, weights: RealArray) -> RealArray:
    """At most n real states of motion that hold all that many complex ones do, shape (n, ≤ n)."""
    size = np.sqrt(np.average(np.abs(values) ** 2, axis=1, weights=weights))
    moving = size > 0
    if not np.any(moving):
        raise InputError("no channel shows any signal: nothing can be said about a culprit")
    equal = values[moving] / size[moving, np.newaxis]
    triangle = np.linalg.qr(np.vstack([equal.real, equal.imag]))[1]
    return np.asarray(triangle.T / np.sqrt(np.count_nonzero(moving)))


class _Search:
    """The channels and states that all fits of one diagnosis share."""

    def __init__(self, geometry: ChannelGeometry, states: RealArray) -> None:
        self.geometry = geometry
        self.states = states
        self.scale = column_scale(geometry, characteristic_length(geometry))
        self.root_weights = np.sqrt(geometry.weights / geometry.weights.mean())
        self.all_rows = np.arange(len(geometry.channels))

    def disagreement(self, forward: RealArray, rows: npt.NDArray[np.intp] | None = None) -> float:
        """Mean squared residual per degree of freedom left; infinite where none is left."""
        rows = self.all_rows if rows is None else rows
        weighted = self.root_weights[rows, np.newaxis] * forward[rows] / self.scale
        n_channel, n_motion = weighted.shape
        if n_channel <= n_motion:
            return float("inf")
        left, singular, _ = np.linalg.svd(weighted, full_matrices=False)
        if singular[-1] * SINGULAR < singular[0]:
            return float("inf")
        seen = self.root_weights[rows, np.newaxis] * self.states[rows]
        residual = seen - left @ (left.T @ seen)
        return float(np.sum(residual**2) / (n_channel - n_motion))

    def items(self) -> dict[str, tuple[npt.NDArray[np.intp], float]]:
        """All that can be left out, with its channels and the disagreement of the rest."""
        items: dict[str, tuple[npt.NDArray[np.intp], float]] = {}
        for owner in dict.fromkeys(self.geometry.owners):
            rows = self.geometry.rows_of(owner)
            candidates = {owner: rows} | {self.geometry.channels[r]: np.array([r]) for r in rows}
            for name, left_out in candidates.items():
                rest = np.setdiff1d(self.all_rows, left_out)
                without = self.disagreement(self.geometry.forward, rest)
                if np.isfinite(without):
                    items[name] = (left_out, without)
                    if name == owner:
                        break
        return items

    def explain(
        self, name: str, rows: npt.NDArray[np.intp], without: float, tolerances: Tolerances
    ) -> Suspect:
        """Fit all faults to the suspect and choose."""
        geometry = self.geometry
        rest = np.setdiff1d(self.all_rows, rows)
        weighted = self.root_weights[rest, np.newaxis] * geometry.forward[rest] / self.scale
        inverse = np.linalg.pinv(weighted) * self.root_weights[rest] / self.scale[:, np.newaxis]
        motion = inverse @ self.states[rest]
        significance = self._significance(rows, rest, inverse, motion, tolerances)
        fits = [
            (self.disagreement(fit.forward), fit)
            for fit in fault_fits(geometry, rows, self.states[rows], motion)
        ]
        best = min((left for left, _ in fits), default=np.inf)
        excess = self.disagreement(geometry.forward) - without
        if best > _explained_below(without, excess):
            return self._unexplained(name, rows, without, excess, significance)
        limit = max(best + AS_GOOD[0] * excess, AS_GOOD[1] * best)
        equal = [(left, fit) for left, fit in fits if left <= limit]
        left, fit = min(equal, key=lambda pair: (pair[1].complexity, pair[0]))
        return _suspect(name, fit, significance, left)

    def _significance(
        self,
        rows: npt.NDArray[np.intp],
        rest: npt.NDArray[np.intp],
        inverse: RealArray,
        motion: RealArray,
        tolerances: Tolerances,
    ) -> float:
        """Root mean square of the contradiction, in standard deviations by the tolerances."""
        forward = self.geometry.forward
        contradiction = self.states[rows] - forward[rows] @ motion
        variance = error_variance(self.geometry, motion, tolerances)
        implied = forward[rows] @ inverse
        covariance = np.diag(variance[rows]) + (implied * variance[rest]) @ implied.T
        if np.linalg.matrix_rank(covariance, hermitian=True) < len(rows):
            return float("inf")
        solved = np.linalg.solve(covariance, contradiction)
        return float(np.sqrt(np.sum(contradiction * solved) / len(rows)))

    def _unexplained(
        self,
        name: str,
        rows: npt.NDArray[np.intp],
        without: float,
        excess: float,
        significance: float,
    ) -> Suspect:
        """No fault fits: at least say whether one channel alone carries the disagreement."""
        alone = {
            self.geometry.channels[row]: self.disagreement(
                self.geometry.forward, np.setdiff1d(self.all_rows, row)
            )
            for row in rows
        }
        channel = min(alone, key=lambda key: alone[key])
        channels = tuple(alone)
        if alone[channel] <= _explained_below(without, excess):
            channels = (channel,)
        detail = f"{' '.join(channels)} follows none of the others: noise, cable or loose sensor"
        return Suspect(
            name, Fault.UNEXPLAINED, channels, detail, significance, float(np.sqrt(without))
        )


def _suspect(name: str, fit: FaultFit, significance: float, left: float) -> Suspect:
    return Suspect(name, fit.fault, fit.channels, fit.detail, significance, float(np.sqrt(left)))


def _explained_below(without: float, excess: float) -> float:
    share, factor = EXPLAINED
    return max(without + (1.0 - share) * excess, factor * without)
