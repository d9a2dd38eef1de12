"""Sign convention and quantity of measured functions, judged where force and motion are at a point.

A structure that is struck takes power, whatever it is. With e^{+jωt} the phase of an inertance at a
driving point therefore lies within 0 … 180°, of a mobility within −90 … 90° and of a receptance
within −180 … 0°; where it hardly loses power, Foster's theorem says how the function slopes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import BoolArray, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.impact_test import FrfEstimate, HammerTest
from deboom.measurement.quality import response_consistency
from deboom.measurement.sensors import SENSOR_AXES, Impact
from deboom.measurement.virtual_point import (
    ChannelGeometry,
    VirtualPoint,
    conditioning,
    virtual_point,
    virtual_point_frf,
)
from deboom.physics.frf import FrfForm

PHASED = 0.1
"""Sine of the angle to 0 and 180° from which on a line says which way power goes [1]."""
REACTIVE = 0.3
"""Largest sine of that angle at which a function is still taken for one without losses [1]."""
FEWEST_LINES = 5
"""Lines that a judgement needs at least."""
CERTAIN = 0.5
"""Share of the power, −1 to 1, from which on its sign is beyond doubt [1]."""
MOSTLY = 0.6
"""Mean squared sine from which on functions are imaginary, as mobilities are [1]."""
PARTLY, ALL_OF_ONE_SIGN, NOT_ALL = 0.25, 0.95, 0.85
"""Mean squared sine, and shares of real and imaginary part, of a mobility between resonances: its
real part is positive throughout, its imaginary part changes sign; an inertance's does not [1]."""
NEARLY_ALL = 0.6
"""Share of the lines within 17° of 90° or −90° from which on functions are imaginary [1]."""
STEP = 1.12
"""Ratio of the frequencies between which a slope is taken: a sixth of an octave [1]."""
SMALL_VIOLATION, LARGE_VIOLATION = 0.5, 1.0
"""Mean excess over Foster's slope, in powers of frequency, that noise makes, and that none does."""
BETTER = 3.0
"""How many times less the inverse functions must miss a rigid body to be the right ones [1]."""
TYPICAL_INERTANCE, LARGEST_INERTANCE = 0.1, 1e4
"""Between a car body's and a compressor's, and that of a body of 0.1 g [1/kg]."""
NEARBY, ALIGNED = 0.02, 0.97
"""Distance [m] and cosine of the angle at which sensor and blow make a driving point."""

_CONJUGATED = (
    "conjugated: they follow exp(−jωt), or their cross spectra were exchanged; export them with "
    "exp(+jωt)"
)
_REVERSED = (
    "reversed: the hammer's force, or all accelerations, have the other sign; a hammer pushes, and "
    "what it pushes moves away"
)
_NAMES = {
    FrfForm.RECEPTANCE: "receptance (displacement over force)",
    FrfForm.MOBILITY: "mobility (velocity over force)",
    FrfForm.INERTANCE: "inertance (acceleration over force)",
    FrfForm.DYNAMIC_STIFFNESS: "dynamic stiffness (force over displacement)",
    FrfForm.IMPEDANCE: "impedance (force over velocity)",
    FrfForm.APPARENT_MASS: "apparent mass (force over acceleration)",
}
_FORM_OF_UNIT = {"m": FrfForm.RECEPTANCE, "m/s": FrfForm.MOBILITY, "m/s^2": FrfForm.INERTANCE}


@dataclass(frozen=True, eq=False)
class DrivingPoints:
    """Translations at driving points, (n_frequency, n) as stated, on lines above 0 Hz [Hz]."""

    frequency: RealArray
    values: ComplexArray
    names: tuple[str, ...]


def fault_of_driving_points(points: DrivingPoints, stated: FrfForm = FrfForm.INERTANCE) -> str:
    """Say in words what functions likely are, where they cannot be what they are stated to be.

    - `stated`: receptance, mobility or inertance.
    - returns: a sentence with the remedy; empty where nothing speaks against the statement, also
      where too few lines say anything.

    Notes
    -----
    The power taken is judged on lines whose phase is clear. Foster's theorem for a mobility ``jB``
    without losses, ``dB/dω ≥ |B|/ω``, says that a positive inertance does not rise, and that a
    negative one falls at least as ω²: a conjugated function keeps that, a reversed one turns it
    round, a receptance or an apparent mass breaks it in a third way. These two are dual to each
    other and told apart by size alone.
    """
    omega = 2 * np.pi * points.frequency[:, np.newaxis]
    as_inertance = np.asarray(points.values * (1j * omega) ** (2 - stated.derivative))
    likely = _likely(points.frequency, as_inertance, omega)
    if not likely:
        return ""
    if isinstance(likely, FrfForm):
        # what is left of the stated number of derivatives
        derivative = likely.derivative - (2 - stated.derivative) * (-1 if likely.is_inverse else 1)
        forms = [form for form in FrfForm if form.value == (derivative, likely.is_inverse)]
        likely = f"likely {_NAMES[forms[0]]}" if forms else "of another quantity"
        likely += ": correct quantity and unit where they are exported"
    shown = ", ".join(points.names[:3]) + (" …" if len(points.names) > 3 else "")
    return (
        f"the functions are no {_NAMES[stated]}: at the driving points ({shown}) their phase or "
        f"their slope over frequency is that of no body. They are {likely}"
    )


def _likely(frequency: RealArray, values: ComplexArray, omega: RealArray) -> FrfForm | str:
    """Judge functions that were stated as inertances; empty where they may be inertances."""
    size = np.abs(values)
    clear = size > 0
    sine, cosine = (
        np.divide(part, size, out=np.zeros_like(size), where=clear)
        for part in (values.imag, values.real)
    )
    taken, n_taken = _signed_share(sine)
    real, n_real = _signed_share(cosine)
    middle = float(np.exp(np.mean(np.log(size[clear])))) if clear.any() else 1.0
    middle_omega = float(np.exp(np.mean(np.log(omega))))
    slopes = _slopes(frequency, values, clear & (np.abs(sine) < REACTIVE))
    if n_taken < FEWEST_LINES:
        wrong = _violation(slopes, rising=0.0, falling=2.0) > LARGE_VIOLATION
        return _by_slope(slopes, middle, middle_omega, lossless=True) if wrong else ""
    beside = np.abs(cosine[clear]) < REACTIVE
    if np.mean(beside) > NEARLY_ALL:
        # also where all of them take power: no body is a damper in every direction
        inverse = _is_inverse(middle, middle_omega, 1)
        return FrfForm.IMPEDANCE if inverse else FrfForm.MOBILITY
    if taken > CERTAIN:
        return FrfForm.DYNAMIC_STIFFNESS if middle > LARGEST_INERTANCE else ""
    imaginary = np.mean(sine[clear] ** 2)
    mostly = imaginary > MOSTLY and (n_real < FEWEST_LINES or real > CERTAIN)
    if mostly or (imaginary > PARTLY and real > ALL_OF_ONE_SIGN and taken < NOT_ALL):
        inverse = _is_inverse(middle, middle_omega, 1)
        return FrfForm.IMPEDANCE if inverse else FrfForm.MOBILITY
    if taken < -CERTAIN:
        return _by_slope(slopes, middle, middle_omega, lossless=False)
    return ""


def _signed_share(part: RealArray) -> tuple[float, int]:
    """Mean sign of what is beyond `PHASED`, weighted by its square, and on how many lines."""
    beyond = part[np.abs(part) >= PHASED]
    share = np.sum(beyond * np.abs(beyond)) / np.sum(beyond**2) if beyond.size else 0.0
    return float(share), int(beyond.size)


def _is_inverse(middle: float, omega: float, lacking: int) -> bool:
    """Tell by size alone whether a function is force over motion.

    A motion that lacks k derivatives is the inertance ``|V| ω^k``; the force over motion of the
    same phase is ``ω^(2−k)/|V|``. These are 1e4 and more apart; `TYPICAL_INERTANCE` is nearer one.
    """
    as_motion = middle * omega**lacking
    as_inverse = omega ** (2 - lacking) / middle
    apart = [abs(np.log(each / TYPICAL_INERTANCE)) for each in (as_motion, as_inverse)]
    return bool(apart[1] < apart[0])


_Slopes = tuple[RealArray, BoolArray]


def _slopes(frequency: RealArray, values: ComplexArray, reactive: BoolArray) -> _Slopes:
    """Slopes of log |V| over log f between lines of one sign a `STEP` apart, and whether V > 0."""
    slopes, positive = [], []
    ends = np.searchsorted(frequency, STEP * frequency)
    for column, lossless in zip(values.T, reactive.T, strict=True):
        same = np.where(lossless, np.sign(column.real), 0.0)
        for begin, end in enumerate(ends):
            if (
                end < frequency.size
                and same[begin]
                and np.all(same[begin : end + 1] == same[begin])
            ):
                rise = np.log(np.abs(column[end] / column[begin]))
                slopes.append(rise / np.log(frequency[end] / frequency[begin]))
                positive.append(same[begin] > 0)
    return np.array(slopes), np.array(positive, dtype=bool)


def _violation(slopes: _Slopes, *, rising: float, falling: float) -> float:
    """Mean excess over ``slope ≤ rising`` where V > 0 and below ``slope ≥ falling`` where V < 0."""
    slope, positive = slopes
    if not slope.size:
        return 0.0
    excess = np.where(positive, slope - rising, falling - slope)
    return float(np.mean(np.maximum(excess, 0.0)))


def _by_slope(slopes: _Slopes, middle: float, omega: float, *, lossless: bool) -> FrfForm | str:
    """Name the hypothesis that Foster's slopes allow; of several the most usual inertance."""
    slope, positive = slopes
    # −V keeps the rule with its signs exchanged, 1/V and V/ω² with its slopes turned
    hypotheses: list[tuple[_Slopes, float, FrfForm | str]] = [
        ((slope, ~positive), middle, _REVERSED),
        ((-slope, positive), omega**2 * middle, FrfForm.RECEPTANCE),
        ((-slope, positive), 1.0 / middle, FrfForm.APPARENT_MASS),
    ]
    if not lossless:
        hypotheses.append((slopes, middle, _CONJUGATED))
    allowed = [
        (abs(np.log(size / TYPICAL_INERTANCE)), number)
        for number, (rule, size, _) in enumerate(hypotheses)
        if _violation(rule, rising=0.0, falling=2.0) < SMALL_VIOLATION
    ]
    if slope.size and allowed:
        return hypotheses[min(allowed)[1]][2]
    return "" if lossless else f"likely {_CONJUGATED}, or another quantity"


def refuse_other_functions(
    frf: Frf, bodies: Sequence[tuple[ChannelGeometry, ChannelGeometry]], whose: str
) -> None:
    """Refuse inertances that are conjugated, reversed, inverted or of another quantity.

    - `frf`: stated as inertances, from all impacts to all channels [(m/s^2)/N].
    - `bodies`: sensors and impacts around each virtual point; where they do not determine its six
      motions and loads nothing is judged.
    - `whose`: file or test, to begin the sentence with.
    - raises InputError: what they likely are, and the remedy.

    Scalar factors and conjugation pass a virtual point, the inverse of every single function does
    not: it moves like no rigid body, and the inverse of these again does.
    """
    pairs = [
        (virtual_point(sensors), virtual_point(impacts))
        for sensors, impacts in bodies
        if all(each.channels and conditioning(each).complete for each in (sensors, impacts))
    ]
    above = frf.frequency > 0
    if not pairs or not above.any():
        return
    frf = replace(frf, frequency=frf.frequency[above], values=frf.values[above])
    inverted = False
    if np.all(frf.values):
        inverse = replace(frf, values=1.0 / frf.values)
        missed = [
            np.mean([1.0 - _consistency(part, *pair) for pair in pairs]) for part in (frf, inverse)
        ]
        inverted = bool(BETTER * missed[1] < missed[0])
        frf = inverse if inverted else frf
    at_points = [
        virtual_point_frf(frf, response=response, excitation=excitation).values
        for response, excitation in pairs
    ]
    # rotations show the noise of their levers where a body hardly turns
    diagonal = [np.einsum("fii->fi", values[:, :3, :3]) for values in at_points]
    names = tuple(
        f"{axis} at ({', '.join(f'{x:g}' for x in response.geometry.position)}) m"
        for response, _ in pairs
        for axis in SENSOR_AXES
    )
    points = DrivingPoints(frf.frequency, np.concatenate(diagonal, axis=1), names)
    fault = fault_of_driving_points(points)
    if inverted:
        above_force = "motion" if fault else "acceleration"
        fault = (
            f"likely force over {above_force}, each function the inverse of what is stated: their "
            "inverses move like a rigid body, they do not; export motion over force"
        )
        raise InputError(f"{whose}: the functions are {fault}")
    if fault:
        raise InputError(f"{whose}: {fault}")


def _consistency(frf: Frf, response: VirtualPoint, excitation: VirtualPoint) -> float:
    used = frf.select(response.channels, excitation.channels)
    return float(np.mean(response_consistency(response, used).overall))


def fault_of_hammer_test(test: HammerTest, estimate: FrfEstimate) -> str:
    """Say in words what is wrong with the functions where a blow fell beside a sensor's channel.

    - `estimate`: functions of its hits.
    - returns: as `fault_of_driving_points`, over all channels of a unit; empty without such a pair.
    """
    axes = {
        channel: (sensor.position, sensor.orientation[:, column])
        for sensor in test.sensors
        for column, channel in enumerate(sensor.channels)
    }
    for unit, form in _FORM_OF_UNIT.items():
        pairs = [
            (row, column, sign)
            for row, channel in enumerate(estimate.outputs)
            if channel in axes and estimate.units[row] == unit
            for column, impact in enumerate(test.impacts)
            if (sign := _alignment(*axes[channel], impact))
        ]
        if not pairs:
            continue
        values = [sign * estimate.values[:, row, column] for row, column, sign in pairs]
        names = tuple(f"{estimate.outputs[r]} at {estimate.inputs[c]}" for r, c, _ in pairs)
        points = DrivingPoints(estimate.frequency, np.stack(values, axis=1), names)
        if fault := fault_of_driving_points(points, form):
            return fault
    return ""


def _alignment(position: RealArray, axis: RealArray, impact: Impact) -> float:
    """Return 1 or −1 where a blow falls beside a channel, along or against its axis; else 0."""
    cosine = float(axis @ impact.direction)
    near = np.linalg.norm(position - impact.position) <= NEARBY
    return float(np.sign(cosine)) if near and abs(cosine) >= ALIGNED else 0.0
