"""The one sensor that contradicts all others, by name, and what is likely to be wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from deboom.measurement.channel_geometry import ChannelGeometry
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.expected_error import error_variance
from deboom.measurement.fault_fits import Fault, fault_fits
from deboom.measurement.leave_one_out import LeftOut, MotionStates, motion_states
from deboom.measurement.tolerances import Tolerances
from deboom.measurement.virtual_point import VirtualPoint, channel_values

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
