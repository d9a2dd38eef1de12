"""The one sensor that contradicts all others, by name, and what is likely to be wrong with it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from itertools import combinations, permutations, product
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import SENSOR_AXES, Tolerances
from deboom.measurement.virtual_point import (
    SINGULAR,
    ChannelGeometry,
    VirtualPoint,
    channel_values,
    characteristic_length,
    column_scale,
)
from deboom.physics.rigid_body import forward_matrices


def error_variance(
    geometry: ChannelGeometry, motion: RealArray, tolerances: Tolerances
) -> RealArray:
    """Variance of each channel's error, summed over several states of motion.

    Parameters
    ----------
    geometry : ChannelGeometry
        n channels, seen from the virtual point.
    motion : array, shape (n_motion, n_state)
        Of the virtual point.
    tolerances : Tolerances
        Of the sensors; the noise floor, an absolute value, is left out.

    Returns
    -------
    array, shape (n,)
        In the squared unit of the channels.

    Notes
    -----
    To first order, with the acceleration b of the sensor and the angular acceleration α: a gain
    error adds ``g d·b``, an angle ``φ·(d × b)``, the cross-axis sensitivity ``κ`` times the two
    other axes, an offset ``δ·(d × α)``.
    """
    own = np.sum((geometry.forward @ motion) ** 2, axis=1)
    here = np.einsum("cab,bs->cas", forward_matrices(geometry.levers).reshape(-1, 3, 6), motion[:6])
    norm = np.sum(here**2, axis=(1, 2))
    across = np.maximum(norm - own, 0.0)
    turning = np.cross(geometry.directions[:, np.newaxis, :], motion[3:6].T[np.newaxis, :, :])
    swing = np.sum(turning**2, axis=(1, 2))
    return np.asarray(
        (tolerances.sensor_gain**2 + tolerances.acceleration_own**2) * own
        + (tolerances.sensor_angle**2 + tolerances.sensor_cross_axis**2) * across
        + tolerances.acceleration_norm**2 * norm
        + tolerances.sensor_position**2 * swing
    )


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


@dataclass(frozen=True)
class Diagnosis:
    """Who is the culprit.

    Parameters
    ----------
    residual_of_all : float
        Rms disagreement of all channels, per degree of freedom, relative to the rms signal [1].
    residual_without : mapping of str to float
        The same of the rest when one sensor or impact is left out (one channel, where the rest
        cannot do without its sensor) [1].
    suspect : Suspect or None
        First suspect; None where the data agree to rounding or nothing can be left out.
    named : bool
        Whether the suspect stands out enough to be called the culprit.
    verdict : str
        One sentence.
    """

    residual_of_all: float
    residual_without: Mapping[str, float]
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
    lines = channel_values(point, measured).reshape(-1, len(point.channels))
    return find_culprit(point.geometry, lines, tolerances)


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

    Raises
    ------
    InputError
        A missing impact, or no signal.
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
    channels : array, shape (n_line, n)
        What they show, complex; each row (line and excitation) counts alike.
    tolerances : Tolerances
        Of placement and calibration.

    Raises
    ------
    InputError
        Shapes that disagree, or no signal.

    Notes
    -----
    The least consistent channel need not be the culprit: least squares spreads a fault over its
    neighbours. Without the faulty sensor, however, the rest agrees to its noise. A sensor is named
    if (1) leaving it out removes a good part of the disagreement, and (2) it contradicts what the
    rest implies by more than the tolerances of all sensors together allow. Of all faults that
    explain the contradiction equally well the simplest is reported. With three triaxial sensors
    nothing can be left out but single channels; then only a reversed or dead channel is named.
    """
    states = motion_states(geometry, channels)
    items = states.leave_one_out()
    of_all = states.disagreement(geometry.forward)
    residual = float(np.sqrt(of_all))
    without = MappingProxyType({item.name: float(np.sqrt(item.remaining)) for item in items})

    def no_culprit(reason: str, suspect: Suspect | None = None) -> Diagnosis:
        return Diagnosis(residual, without, suspect, False, f"no culprit: {reason}")

    if not items:
        return no_culprit("no sensor can be left out, there is no redundancy to judge by")
    if residual < PERFECT:
        return no_culprit("all channels agree to rounding")
    item = min(items, key=lambda item: item.remaining)
    suspect = _explain(states, item, of_all - item.remaining, tolerances)
    if item.remaining > STANDS_OUT * of_all:
        return no_culprit(
            f"without {item.name}, first suspect, the rest agrees hardly better", suspect
        )
    if suspect.significance < SIGNIFICANT:
        return no_culprit(
            f"{item.name} disagrees most, by {suspect.significance:.1f} times what the tolerances "
            f"let expect ({suspect.fault.value}: it {suspect.detail})",
            suspect,
        )
    partial = len(item.rows) < len(geometry.rows_of(geometry.owners[item.rows[0]]))
    certain = suspect.residual_undone < BEYOND_DOUBT * residual
    if partial and not (certain and suspect.fault in (Fault.SIGN, Fault.DEAD)):
        return no_culprit(
            "no reversed or dead channel alone explains the disagreement of "
            f"{100 * residual:.2g} %, and only with a fourth triaxial sensor can whole sensors be "
            "left out",
            suspect,
        )
    who = suspect.channels[0] if len(suspect.channels) == 1 else item.name
    verdict = f"{who}: {suspect.fault.value}, {suspect.detail}"
    return Diagnosis(residual, without, suspect, True, verdict)


def _explain(states: MotionStates, item: LeftOut, excess: float, tolerances: Tolerances) -> Suspect:
    """Fit all faults to the suspect and choose the simplest of the best."""
    motion = states.inverse_without(item.rows) @ states.values[states.others(item.rows)]
    significance = _significance(states, item, tolerances)
    share, factor = EXPLAINED
    explained = max(item.remaining + (1.0 - share) * excess, factor * item.remaining)
    fits = [
        (states.disagreement(fit.forward), fit)
        for fit in fault_fits(states.geometry, item.rows, states.values[item.rows], motion)
    ]
    best = min((left for left, _ in fits), default=np.inf)
    if best <= explained:
        share, factor = AS_GOOD
        equal = [pair for pair in fits if pair[0] <= max(best + share * excess, factor * best)]
        left, fit = min(equal, key=lambda pair: (pair[1].complexity, pair[0]))
        undone = float(np.sqrt(left))
        return Suspect(item.name, fit.fault, fit.channels, fit.detail, significance, undone)
    # at least say whether one channel alone carries the disagreement
    alone = {
        states.geometry.channels[row]: states.disagreement(
            states.geometry.forward, states.others(np.array([row]))
        )
        for row in item.rows
    }
    worst = min(alone, key=lambda channel: alone[channel])
    channels = (worst,) if alone[worst] <= explained else tuple(alone)
    detail = f"{', '.join(channels)} follows none of the others: noise, cable or loose sensor"
    undone = float(np.sqrt(item.remaining))
    return Suspect(item.name, Fault.UNEXPLAINED, channels, detail, significance, undone)


def _significance(states: MotionStates, item: LeftOut, tolerances: Tolerances) -> float:
    """Rms of the contradiction to the rest, in standard deviations by the tolerances of all."""
    forward, rest = states.geometry.forward, states.others(item.rows)
    inverse = states.inverse_without(item.rows)
    motion = inverse @ states.values[rest]
    variance = error_variance(states.geometry, motion, tolerances)
    implied = forward[item.rows] @ inverse
    covariance = np.diag(variance[item.rows]) + (implied * variance[rest]) @ implied.T
    if np.linalg.matrix_rank(covariance, hermitian=True) < len(item.rows):
        return float("inf")
    contradiction = states.values[item.rows] - forward[item.rows] @ motion
    squared = np.sum(contradiction * np.linalg.solve(covariance, contradiction))
    return float(np.sqrt(squared / len(item.rows)))


HALVED = 0.5
"""An exchange is named if, undone, less than this share of the disagreement (rms) is left."""


@dataclass(frozen=True)
class Exchange:
    """Two items that agree with all others once they are exchanged.

    Parameters
    ----------
    first, second : str
        Channels, or whole sensors or impacts.
    disagreement : float
        Rms of what no rigid motion explains, relative to the rms signal [1].
    left : float
        The same with the exchange undone [1].
    """

    first: str
    second: str
    disagreement: float
    left: float

    @property
    def verdict(self) -> str:
        """One sentence."""
        return (
            f"{self.first} and {self.second} are exchanged: {self.disagreement:.0%} of the signal "
            f"contradict a rigid body, {self.left:.1%} once they are changed back"
        )


def exchanged_responses(point: VirtualPoint, measured: Frf) -> Exchange | None:
    """Find two channels or two sensors that were exchanged.

    Parameters
    ----------
    point : VirtualPoint
        Of the motion sensors.
    measured : Frf
        With their channels as outputs.

    Returns
    -------
    Exchange or None
        None where no exchange halves the disagreement.

    Raises
    ------
    InputError
        A missing channel.

    Notes
    -----
    An exchange contradicts the rest at two places, so that no single sensor can be left out to make
    the rest agree (`deboom.measurement.culprit` finds nothing). With a right sheet every exchange
    makes matters worse, whatever the tolerances. Two axes of one sensor are a matter of `culprit`.
    """
    return _best_exchange(point, channel_values(point, measured).reshape(-1, len(point.channels)))


def exchanged_impacts(point: VirtualPoint, measured: Frf) -> Exchange | None:
    """Find two impacts that were exchanged; see `exchanged_responses`.

    Parameters
    ----------
    point : VirtualPoint
        Of the impacts.
    measured : Frf
        With them as inputs.

    Returns
    -------
    Exchange or None

    Raises
    ------
    InputError
        A missing impact.
    """
    values = measured.select(inputs=point.channels).values
    return _best_exchange(point, values.reshape(-1, len(point.channels)))


def _best_exchange(point: VirtualPoint, states: ComplexArray) -> Exchange | None:
    energy: RealArray = (states.T @ states.conj()).real
    unexplained = np.eye(len(energy)) - point.forward @ point.inverse
    scale = float(np.trace(energy))

    def left(order: list[int]) -> float:
        part = unexplained @ energy[np.ix_(order, order)] @ unexplained.T
        return float(np.sqrt(max(np.trace(part), 0.0) / scale))

    before = left(list(range(len(energy))))
    if before < PERFECT:
        return None
    tried = [(left(order), names) for names, order in _orders(point)]
    after, (first, second) = min(tried, default=(before, ("", "")))
    return Exchange(first, second, before, after) if after < HALVED * before else None


def _orders(point: VirtualPoint) -> Iterator[tuple[tuple[str, str], list[int]]]:
    """Order of the channels after each exchange of two channels or of two whole sensors."""
    owners = point.geometry.owners
    rows = {name: [n for n, owner in enumerate(owners) if owner == name] for name in owners}
    pairs = [
        ((point.channels[a], point.channels[b]), [a], [b])
        for a, b in combinations(range(len(owners)), 2)
        if owners[a] != owners[b]
    ]
    pairs += [
        ((one, other), rows[one], rows[other])
        for one, other in combinations(rows, 2)
        if len(rows[one]) == len(rows[other]) > 1
    ]
    for names, these, those in pairs:
        order = list(range(len(owners)))
        for a, b in zip(these, those, strict=True):
            order[a], order[b] = b, a
        yield names, order
