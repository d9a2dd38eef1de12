"""The one sensor that contradicts all others, by name, and what is likely to be wrong with it.

Each sensor is left out in turn. The one without which the rest agrees is confronted with a table of
hypotheses: reversed, dead, wrong sensitivity, swapped axes, wrong position, wrong orientation; each
is the forward matrix that the body would have if the fault were a fact. Exchanged cables contradict
the rest at two places and are searched for by themselves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import combinations, permutations, product
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from deboom.arrays import PERCENT, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import SENSOR_AXES, PlacementTolerances, Sensor, Tolerances
from deboom.measurement.virtual_point import (
    SINGULAR,
    ChannelGeometry,
    VirtualPoint,
    channel_values,
    sensor_geometry,
    virtual_point,
)
from deboom.physics.rigid_body import (
    ROTATION_ORDERS,
    forward_matrices,
    rotation_angles,
    rotation_matrix,
)

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
LARGEST_TILT = 30.0
"""Rotation beyond which an orientation is more likely a mix-up of axes [degrees]."""
FITTED = 4
"""Complexity of a fault with a fitted size; that of a mix-up is the number of channels changed."""
HALVED = 0.5
"""An exchange is named if, undone, less than this share of the disagreement (rms) is left."""

CLEARLY_LESS = 3.0
"""Factor by which an odd gain or delay, taken off, reduces what is not rigid, to be named [1]."""
LARGEST_GAIN = 0.2
"""Error of a gain that sensors may have [1]."""
SHORTEST_DELAY = 0.3e-3
"""Delay that is told from a gain [s]."""
LONGEST_DELAY = 20e-3
"""Delay that is looked for at most [s]."""

_Rows = npt.NDArray[np.intp]


class Fault(Enum):
    """Kinds of fault that can be told apart."""

    SIGN = "reversed sign"
    DEAD = "dead channel"
    AXES = "swapped axes"
    GAIN = "wrong sensitivity"
    OFFSET = "wrong position"
    TILT = "wrong orientation"
    UNEXPLAINED = "unexplained"


SHEET_FAULTS = (Fault.SIGN, Fault.AXES)
"""Faults that no tolerance explains."""


@dataclass(frozen=True)
class Suspect:
    """The item without which the rest agrees best.

    - `significance`: contradiction to the rest over what the tolerances of all sensors let expect,
      rms [1].
    - `residual_undone`: rms disagreement of all channels with the fault undone, relative to the rms
      signal [1].
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

    - `residual_of_all`: rms disagreement of all channels, per degree of freedom, relative to the
      rms signal [1].
    - `residual_without`: the same of the rest when one sensor or impact is left out (one channel,
      where the rest cannot do without its sensor) [1].
    - `suspect`: first suspect; None where the data agree to rounding or nothing can be left out.
    """

    residual_of_all: float
    residual_without: Mapping[str, float]
    suspect: Suspect | None
    named: bool
    verdict: str


def culprit_of_responses(
    point: VirtualPoint, measured: Spectrum | Frf, tolerances: Tolerances
) -> Diagnosis:
    """Find the sensor that contradicts all others; see `find_culprit`.

    A missing channel, or no signal in any of them, raises InputError.

    Impacts in 18 directions let the six motions vary independently; an engine order moves the body
    in few of them, and a fault that does not show in these stays hidden.
    """
    lines = channel_values(point, measured).reshape(-1, len(point.channels))
    return find_culprit(point.geometry, lines, tolerances)


def culprit_of_excitation(point: VirtualPoint, measured: Frf, tolerances: Tolerances) -> Diagnosis:
    """Find the impact, an input of `measured`, that contradicts all others.

    As `culprit_of_responses`; tolerances of the sensors are taken for the impacts as well.
    """
    rows = measured.select(inputs=point.channels).values
    return find_culprit(point.geometry, rows.reshape(-1, len(point.channels)), tolerances)


@dataclass(frozen=True)
class RotationOrder:
    """How the angles of a position sheet were read, and by which order the sensors agree best.

    - `disagreement`, `left`: rms of what no rigid motion explains, relative to the rms signal, read
      as stated and read by the best order [1].
    """

    stated: str
    best: str
    disagreement: float
    left: float

    @property
    def another(self) -> bool:
        """Whether another order than the stated one leaves less than `HALVED`."""
        return self.best != self.stated and self.left < HALVED * self.disagreement

    @property
    def words(self) -> str:
        """A clause."""
        read = f"the angles of the position sheet were read as {self.stated}"
        if self.another:
            return (
                f"{read}; read as {self.best} the disagreement falls from "
                f"{100 * self.disagreement:.2g} to {100 * self.left:.2g} %: write a column "
                f"rotation_order with {self.best} into it"
            )
        return f"{read}, and no other order fits better by much"


def best_rotation_order(
    sensors: Sequence[Sensor], measured: Spectrum | Frf, switched_off: Sequence[str] = ()
) -> RotationOrder:
    """Read the angles of a position sheet by every order of rotations, and compare.

    - `sensors`: of one rigid body, as the sheet states them.
    - `measured`: their channels.
    """
    stated = sensors[0].rotation_order
    angles = [rotation_angles(sensor.orientation, sensor.rotation_order) for sensor in sensors]
    left: dict[str, float] = {}
    tried: dict[str, RealArray] = {}
    for order in ROTATION_ORDERS:
        orientations = np.array([rotation_matrix(angle, order) for angle in angles])
        alike = [other for other, seen in tried.items() if np.allclose(orientations, seen)]
        if alike:
            left[order] = left[alike[0]]
            continue
        tried[order] = orientations
        turned = [
            replace(sensor, orientation=orientation)
            for sensor, orientation in zip(sensors, orientations, strict=True)
        ]
        geometry = sensor_geometry(turned, switched_off=switched_off)
        point = virtual_point(geometry)
        lines = channel_values(point, measured).reshape(-1, len(point.channels))
        states = _motion_states(geometry, lines)
        left[order] = math.sqrt(states.disagreement(geometry.forward))
    best = min(left, key=lambda order: left[order])
    return RotationOrder(stated, best, left[stated], left[best])


def explain_rotation_order(
    sensors: Sequence[Sensor], measured: Spectrum | Frf, switched_off: Sequence[str] = ()
) -> str:
    """Say how the angles of a position sheet were read, and by which order the sensors agree.

    - returns a clause; an order other than the stated one is named if less than `HALVED` of the
      disagreement (rms) is left with it.
    """
    return best_rotation_order(sensors, measured, switched_off).words


def refuse_other_rotation_order(
    sensors: Sequence[Sensor], measured: Frf, stated: PlacementTolerances, whose: str
) -> None:
    """Refuse angles that were stated by another order of rotations than the sheet says.

    - raises InputError: with the order by which the sensors agree, where the disagreement as stated
      exceeds what the tolerances allow.
    """
    order = best_rotation_order(sensors, measured)
    allowed = SIGNIFICANT * math.hypot(stated.sensor_gain, stated.sensor_angle)
    if order.another and order.disagreement > allowed:
        raise InputError(f"{whose}: its sensors contradict each other: {order.words}")


def find_culprit(
    geometry: ChannelGeometry, channels: npt.ArrayLike, tolerances: Tolerances
) -> Diagnosis:
    """Leave out each sensor in turn, and explain the one without which the rest agrees.

    Raises InputError: shapes that disagree, or no signal.

    Parameters
    ----------
    geometry : ChannelGeometry — places of n channels
    channels : array, shape (n_line, n)
        Complex values; each row (line and excitation) counts alike.
    tolerances : Tolerances — tolerances of placement and calibration

    Notes
    -----
    The least consistent channel need not be the culprit: least squares spreads a fault over its
    neighbours. Without the faulty sensor, however, the rest agrees to its noise. A sensor is named
    if (1) leaving it out removes a good part of the disagreement, and (2) it contradicts what the
    rest implies by more than the tolerances of all sensors together allow. Of all faults that
    explain the contradiction equally well the simplest is reported. With three triaxial sensors
    nothing can be left out but single channels; then only a reversed or dead channel is named.
    """
    states = _motion_states(geometry, channels)
    items = _leave_one_out(states)
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


@dataclass(frozen=True)
class OddChannels:
    """The channels whose factor over frequency, taken off, makes a body's motion rigid.

    - `name`: of the sensor or channel.
    - `gain`: common factor of what it shows [1]; `delay`: by which it is late [s].
    - `residual`, `left`: rms of what no rigid motion explains, relative to the rms signal, as it is
      and with the factor taken off [1].
    """

    name: str
    gain: complex
    delay: float
    residual: float
    left: float

    @property
    def clear(self) -> bool:
        """Whether the factor is beyond what gains of sensors differ by."""
        return abs(self.delay) > SHORTEST_DELAY or abs(self.gain - 1.0) > LARGEST_GAIN

    @property
    def words(self) -> str:
        """A clause that says what the channels do."""
        turned = abs(np.angle(self.gain, deg=True))
        if abs(self.delay) > SHORTEST_DELAY:
            fault = f"late by {1e3 * self.delay:.1f} ms"
            if self.delay < 0.0:
                fault = f"ahead by {-1e3 * self.delay:.1f} ms"
        elif turned > 150.0:
            fault = "reversed"
        else:
            fault = f"{abs(self.gain):.2g} times what it should be"
        return (
            f"with '{self.name}' taken for {fault}, {100 * self.left:.1f} % are left of "
            f"{100 * self.residual:.0f} %"
        )


def odd_channels(
    forward: RealArray,
    frequency: RealArray,
    values: ComplexArray,
    groups: Mapping[str, Sequence[int]],
) -> OddChannels | None:
    """Find the channels that are late, or have another gain or sign than all others.

    Parameters
    ----------
    forward : array, shape (n_channel, 6)
        Motion of the body → channels.
    frequency : array, shape (n_frequency,) [Hz]
    values : array, shape (n_frequency, n_other, n_channel)
        Motions of one rigid body.
    groups : mapping
        Name → columns of a sensor, or of a channel.

    Returns
    -------
    OddChannels or None
        The group that explains most; None where none leaves less than a third.

    Notes
    -----
    With the projector ``R`` on what no rigid motion explains, the factor of group g that leaves
    least at a line is ``−⟨R a_g, R a_rest⟩ / |R a_g|²``; its inverse over all lines is a gain and a
    delay, ``g e^{−jωτ}``.
    """
    left_over = np.eye(len(forward)) - forward @ np.linalg.pinv(forward)
    total = float(np.sum(np.abs(values) ** 2))
    if not total > 0.0:
        return None
    residual = math.sqrt(float(np.sum(np.abs(values @ left_over.T) ** 2)) / total)
    lines, of_line = np.unique(frequency, return_inverse=True)
    delays = np.arange(-80, 81) * (LONGEST_DELAY / 80.0)
    turns = np.exp(-2j * np.pi * np.outer(delays, lines))
    best: OddChannels | None = None
    for name, columns in groups.items():
        picked = np.zeros(len(forward))
        picked[list(columns)] = 1.0
        of_group = (values * picked) @ left_over.T
        of_rest = (values * (1.0 - picked)) @ left_over.T
        size = np.sum(np.abs(of_group) ** 2, axis=(1, 2))
        cross = np.sum(of_group.conj() * of_rest, axis=(1, 2))
        # of the factor that undoes the fault, exp(+jωτ)/g
        at_lines = np.bincount(of_line, -cross.real) + 1j * np.bincount(of_line, -cross.imag)
        first = delays[int(np.argmax(np.abs(turns @ at_lines)))]
        near = first + np.linspace(-1.0, 1.0, 41) * (delays[1] - delays[0])
        shown = np.exp(-2j * np.pi * np.outer(near, lines)) @ at_lines
        at = int(np.argmax(np.abs(shown)))
        undo = complex(shown[at]) / max(float(size.sum()), 1e-300)
        factor = undo * np.exp(2j * np.pi * near[at] * frequency)
        rest = of_rest + factor[:, np.newaxis, np.newaxis] * of_group
        corrected = values * (1.0 + picked * (factor[:, np.newaxis, np.newaxis] - 1.0))
        left = math.sqrt(
            float(np.sum(np.abs(rest) ** 2)) / max(float(np.sum(np.abs(corrected) ** 2)), 1e-300)
        )
        if abs(undo) > 1e-3 and (best is None or left < best.left):
            best = OddChannels(name, 1.0 / undo, float(near[at]), residual, left)
    if best is None or best.left > residual / CLEARLY_LESS:
        return None
    return best


def tolerances_of_all(stated: PlacementTolerances) -> Tolerances:
    """Return the larger of sensors' and impacts' tolerances, as the search for a culprit asks."""
    return Tolerances(
        sensor_position=max(stated.sensor_position, stated.impact_position),
        sensor_angle=max(stated.sensor_angle, stated.impact_angle),
        sensor_gain=max(stated.sensor_gain, stated.hammer_gain),
        sensor_cross_axis=0.0,
    )


def refuse_sheet_faults(
    frf: Frf,
    response: VirtualPoint,
    excitation: VirtualPoint,
    stated: PlacementTolerances,
    whose: str,
    sensors: Sequence[Sensor],
) -> None:
    """Refuse a reversed or swapped channel or impact, or two exchanged, whichever explains more.

    - `frf`: from all impacts to all channels of one rigid body.
    - `whose`: test, to begin the sentence with.
    - `sensors`: of the position sheet, whose angles another order of rotations may explain.
    - raises InputError: with the name of the channel, impact or pair.
    """
    tolerances = tolerances_of_all(stated)
    for what, diagnosis, exchange in (
        (
            "sensor",
            culprit_of_responses(response, frf, tolerances),
            exchanged_responses(response, frf),
        ),
        (
            "impact",
            culprit_of_excitation(excitation, frf, tolerances),
            exchanged_impacts(excitation, frf),
        ),
    ):
        suspect = diagnosis.suspect if diagnosis.named else None
        if suspect is not None and suspect.fault not in SHEET_FAULTS:
            suspect = None
        left = np.inf if suspect is None else suspect.residual_undone / diagnosis.residual_of_all
        if exchange is not None and exchange.left / exchange.disagreement < left:
            raise InputError(
                f"{whose}: {exchange.verdict}. Mend the position sheet or the cables and start "
                "again"
            )
        if suspect is not None:
            turned = explain_rotation_order(sensors, frf) if what == "sensor" else ""
            raise InputError(
                f"{whose}: {what} {suspect.name} contradicts all others: {diagnosis.verdict}. Mend "
                f"the position sheet and start again{turned and f'; {turned}'}"
            )


@dataclass(frozen=True, eq=False)
class _MotionStates:
    """What n channels show in a few real states of motion, (n, n_state); squares add up to n."""

    geometry: ChannelGeometry
    values: RealArray

    def others(self, rows: _Rows) -> _Rows:
        """Channels beside these."""
        return np.setdiff1d(np.arange(len(self.geometry.channels)), rows)

    def disagreement(self, forward: RealArray, rows: _Rows | None = None) -> float:
        """Mean squared residual per degree of freedom over the signal; infinite without any."""
        rows = np.arange(len(forward)) if rows is None else rows
        n_channel, n_motion = len(rows), forward.shape[1]
        if n_channel <= n_motion:
            return float("inf")
        scaled = forward[rows] / self.geometry.scale
        left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
        if singular[-1] * SINGULAR < singular[0]:
            return float("inf")
        seen = self.values[rows]
        residual = seen - left @ (left.T @ seen)
        return float(np.sum(residual**2) / (n_channel - n_motion))

    def inverse_without(self, rows: _Rows) -> RealArray:
        """All channels but these → motion."""
        scale = self.geometry.scale
        rest = self.geometry.forward[self.others(rows)]
        return np.asarray(np.linalg.pinv(rest / scale) / scale[:, np.newaxis])


def _motion_states(geometry: ChannelGeometry, channels: npt.ArrayLike) -> _MotionStates:
    """Reduce lines to at most n real states with the same residuals, by the triangle of a QR."""
    values = np.asarray(channels, dtype=complex)
    n = len(geometry.channels)
    if values.ndim != 2 or values.shape[1] != n:
        raise InputError(f"{n} channels need lines of shape (n_line, {n}), not {values.shape}")
    size = np.sqrt(np.mean(np.abs(values) ** 2, axis=1))
    moving = size > 0
    if not np.any(moving):
        raise InputError("no channel shows any signal: nothing can be said about a culprit")
    alike = values[moving] / size[moving, np.newaxis]
    triangle = np.linalg.qr(np.vstack([alike.real, alike.imag]))[1]
    return _MotionStates(geometry, triangle.T / np.sqrt(np.count_nonzero(moving)))


@dataclass(frozen=True, eq=False)
class _LeftOut:
    """One sensor, impact or channel left out, and the mean squared disagreement of the others."""

    name: str
    rows: _Rows
    remaining: float


def _leave_one_out(states: _MotionStates) -> list[_LeftOut]:
    """Leave out each sensor, or each of its channels where the rest cannot do without it."""
    geometry = states.geometry

    def left_out(name: str, rows: _Rows) -> _LeftOut:
        return _LeftOut(name, rows, states.disagreement(geometry.forward, states.others(rows)))

    items = []
    for owner in dict.fromkeys(geometry.owners):
        rows = geometry.rows_of(owner)
        items.append(left_out(owner, rows))
        if not np.isfinite(items[-1].remaining) and len(rows) > 1:
            items += [left_out(geometry.channels[row], np.array([row])) for row in rows]
    return [item for item in items if np.isfinite(item.remaining)]


def _explain(
    states: _MotionStates, item: _LeftOut, excess: float, tolerances: Tolerances
) -> Suspect:
    """Fit all faults to the suspect and choose the simplest of the best."""
    geometry = states.geometry
    motion = states.inverse_without(item.rows) @ states.values[states.others(item.rows)]
    significance = _significance(states, item, tolerances)
    share, factor = EXPLAINED
    explained = max(item.remaining + (1.0 - share) * excess, factor * item.remaining)
    tried = [
        (states.disagreement(hypothesis.forward), hypothesis)
        for hypothesis in _hypotheses(geometry, item.rows, states.values[item.rows], motion)
    ]
    best = min((left for left, _ in tried), default=np.inf)
    if best <= explained:
        share, factor = AS_GOOD
        equal = [pair for pair in tried if pair[0] <= max(best + share * excess, factor * best)]
        left, fit = min(equal, key=lambda pair: (pair[1].complexity, pair[0]))
        undone = float(np.sqrt(left))
        return Suspect(item.name, fit.fault, fit.channels, fit.detail, significance, undone)
    # at least say whether one channel alone carries the disagreement
    alone = {
        geometry.channels[row]: states.disagreement(
            geometry.forward, states.others(np.array([row]))
        )
        for row in item.rows
    }
    worst = min(alone, key=lambda channel: alone[channel])
    channels = (worst,) if alone[worst] <= explained else tuple(alone)
    detail = f"{', '.join(channels)} follows none of the others: noise, cable or loose sensor"
    undone = float(np.sqrt(item.remaining))
    return Suspect(item.name, Fault.UNEXPLAINED, channels, detail, significance, undone)


def _significance(states: _MotionStates, item: _LeftOut, tolerances: Tolerances) -> float:
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


def error_variance(
    geometry: ChannelGeometry, motion: RealArray, tolerances: Tolerances
) -> RealArray:
    """Return the variance of each channel's error, summed over states of motion (6, n_state).

    To first order, with the acceleration b of the sensor and the angular acceleration α: a gain
    error adds ``g d·b``, an angle ``φ·(d × b)``, the cross-axis sensitivity ``κ`` times the two
    other axes, an offset ``δ·(d × α)``, noise its shares of d·b and |b|, without its floor.
    """
    along = np.sum((geometry.forward @ motion) ** 2, axis=1)
    at_channel = forward_matrices(geometry.levers).reshape(-1, 3, 6)
    norm = np.sum(np.einsum("cab,bs->cas", at_channel, motion) ** 2, axis=(1, 2))
    across = np.maximum(norm - along, 0.0)
    turning = np.cross(geometry.directions[:, np.newaxis, :], motion[3:].T[np.newaxis, :, :])
    swing = np.sum(turning**2, axis=(1, 2))
    return np.asarray(
        (tolerances.sensor_gain**2 + tolerances.acceleration_own**2) * along
        + (tolerances.sensor_angle**2 + tolerances.sensor_cross_axis**2) * across
        + tolerances.acceleration_norm**2 * norm
        + tolerances.sensor_position**2 * swing
    )


def expected_residual(
    geometry: ChannelGeometry, channels: ComplexArray, tolerances: Tolerances
) -> float:
    """Return what tolerances let expect of the part that no rigid motion explains, rms [1].

    - `channels` (n_line, n): what the n channels of a rigid body show.
    """
    inverse = np.linalg.pinv(geometry.forward)
    motion = channels @ inverse.T
    left_over = np.eye(len(inverse.T)) - geometry.forward @ inverse
    variance = error_variance(geometry, np.vstack([motion.real, motion.imag]).T, tolerances)
    total = float(np.sum(np.abs(channels) ** 2))
    return math.sqrt(float(variance @ np.diag(left_over)) / max(total, np.finfo(float).tiny))


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    """One explanation of a sensor's disagreement: the forward matrix with the fault as a fact."""

    fault: Fault
    channels: tuple[str, ...]
    detail: str
    forward: RealArray
    complexity: int


def _hypotheses(
    geometry: ChannelGeometry, rows: _Rows, measured: RealArray, motion: RealArray
) -> Iterator[_Hypothesis]:
    """Fit every kind of fault to one sensor or impact, in states of motion that the others tell.

    Once the motion is known, the factor of a channel and the offset of a sensor are linear least
    squares, its rotation is a Procrustes problem, and of the ways to mix up three axes there are
    48. A sensor with channels switched off is not asked for axes and orientation; a single channel
    of a triaxial sensor, which the others cannot do without, only for its factor.
    """
    expected = geometry.forward[rows] @ motion
    for row, shown, wanted in zip(rows, measured, expected, strict=True):
        energy = float(wanted @ wanted)
        if energy > 0:
            yield from _factors(geometry, int(row), float(shown @ wanted) / energy)
    if len(rows) == len(SENSOR_AXES):
        yield from _mixed_axes(geometry, rows)
        yield from _tilt(geometry, rows, measured, motion)
    if len(rows) == len(geometry.rows_of(geometry.owners[rows[0]])):
        yield _offset(geometry, rows, measured - expected, motion)


def _factors(geometry: ChannelGeometry, row: int, fitted: float) -> Iterator[_Hypothesis]:
    """One channel reversed, dead, or of another sensitivity."""
    detail = f"shows {fitted:.3g} times what the others imply"
    for fault, factor, complexity in (
        (Fault.SIGN, -1.0, 1),
        (Fault.DEAD, 0.0, 1),
        (Fault.GAIN, fitted, FITTED),
    ):
        forward = geometry.forward.copy()
        forward[row] *= factor
        yield _Hypothesis(fault, (geometry.channels[row],), detail, forward, complexity)


def _mixed_axes(geometry: ChannelGeometry, rows: _Rows) -> Iterator[_Hypothesis]:
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
        yield _Hypothesis(Fault.AXES, names, ", ".join(carried), forward, len(changed))


def _offset(
    geometry: ChannelGeometry, rows: _Rows, excess: RealArray, motion: RealArray
) -> _Hypothesis:
    """Offset δ: an excess ``d · (α × δ) = (d × α) · δ`` in each state of motion."""
    directions = geometry.directions[rows]
    system = np.cross(directions[:, np.newaxis, :], motion[3:].T[np.newaxis, :, :])
    offset = np.linalg.lstsq(system.reshape(-1, 3), excess.ravel(), rcond=None)[0]
    levers = geometry.levers.copy()
    levers[rows] += offset
    x, y, z = 1e3 * offset
    detail = (
        f"sits {np.linalg.norm(1e3 * offset):.1f} mm from where the position sheet says, by "
        f"({x:+.1f}, {y:+.1f}, {z:+.1f}) mm"
    )
    channels = tuple(geometry.channels[row] for row in rows)
    moved = replace(geometry, levers=levers)
    return _Hypothesis(Fault.OFFSET, channels, detail, moved.forward, FITTED)


def _tilt(
    geometry: ChannelGeometry, rows: _Rows, measured: RealArray, motion: RealArray
) -> Iterator[_Hypothesis]:
    """Rotation between sheet and sensor, by the Procrustes problem of the two accelerations."""
    directions = geometry.directions[rows]
    at_sensor = forward_matrices(geometry.levers[rows[:1]]) @ motion
    left, _, right = np.linalg.svd(directions.T @ measured @ at_sensor.T)
    proper = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    rotation = left @ proper @ right
    degrees = np.degrees(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0)))
    if degrees > LARGEST_TILT:
        return
    turned = geometry.directions.copy()
    turned[rows] = directions @ rotation
    channels = tuple(geometry.channels[row] for row in rows)
    detail = f"is turned by {degrees:.1f}° against the position sheet"
    forward = replace(geometry, directions=turned).forward
    yield _Hypothesis(Fault.TILT, channels, detail, forward, FITTED)


@dataclass(frozen=True)
class Exchange:
    """Two items that agree with all others once they are exchanged.

    - `disagreement`, `left`: rms of what no rigid motion explains, relative to the rms signal, as
      measured and with the exchange undone [1].
    """

    first: str
    second: str
    disagreement: float
    left: float

    @property
    def verdict(self) -> str:
        """One sentence."""
        return (
            f"{self.first} and {self.second} are exchanged: {PERCENT * self.disagreement:.0f} % of "
            f"the signal contradict a rigid body, {PERCENT * self.left:.1f} % once they are "
            "changed back"
        )


def exchanged_responses(point: VirtualPoint, measured: Frf) -> Exchange | None:
    """Find two channels or sensors that were exchanged; None where no exchange halves the misfit.

    An exchange contradicts the rest at two places, so that no single sensor can be left out to make
    the rest agree (`find_culprit` finds nothing). With a right sheet every exchange makes matters
    worse, whatever the tolerances. Two axes of one sensor are a matter of `find_culprit`.
    """
    return _best_exchange(point, channel_values(point, measured).reshape(-1, len(point.channels)))


def exchanged_impacts(point: VirtualPoint, measured: Frf) -> Exchange | None:
    """Find two impacts, inputs of `measured`, that were exchanged; see `exchanged_responses`."""
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
    tried = [(left(order), names) for names, order in _exchanges(point.geometry)]
    after, (first, second) = min(tried, default=(before, ("", "")))
    return Exchange(first, second, before, after) if after < HALVED * before else None


def _exchanges(geometry: ChannelGeometry) -> Iterator[tuple[tuple[str, str], list[int]]]:
    """Order of the channels after each exchange of two channels or of two whole sensors."""
    owners, channels = geometry.owners, geometry.channels
    rows = {owner: [int(row) for row in geometry.rows_of(owner)] for owner in owners}
    pairs = [
        ((channels[a], channels[b]), [a], [b])
        for a, b in combinations(range(len(owners)), 2)
        if owners[a] != owners[b]
    ]
    pairs += [
        (sensors, rows[sensors[0]], rows[sensors[1]])
        for sensors in combinations(rows, 2)
        if len(rows[sensors[0]]) == len(rows[sensors[1]]) > 1
    ]
    for names, first, second in pairs:
        order = list(range(len(owners)))
        for a, b in zip(first, second, strict=True):
            order[a], order[b] = b, a
        yield names, order
