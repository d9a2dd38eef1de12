"""Angle and speed of a shaft at any time, from the pulses of its tacho."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline, make_lsq_spline

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.tacho_repair import PulseTrain

KNOT_SPACING = 4.0
"""Revolutions between the knots of the spline: two cycles of a four-stroke engine."""
LARGEST_DIP = 0.02
"""By how much the speed of a run-up may fall in between, of the highest speed."""
_DEGREE = 3


@dataclass(frozen=True, eq=False)
class ShaftAngle:
    """A shaft's angle as a smooth function of time, zero at the tacho's zero mark.

    Made by `shaft_angle`; it holds from its first to its last pulse and is not continued beyond.

    Parameters
    ----------
    begin, end : float
        Times of the first and the last pulse [s].
    jitter : float
        Root mean square distance of the pulses from the smooth course [rad]; it contains what the
        shaft itself turns unevenly within a few revolutions.
    pulses : PulseTrain
        What it was made from, with the report on its repair.
    """

    begin: float
    end: float
    jitter: float
    pulses: PulseTrain
    _revolution: BSpline[np.float64] = field(repr=False)

    def angle(self, time: npt.ArrayLike) -> RealArray:
        """Angle at the times [s], any shape [rad]; InputError outside the pulses."""
        return np.asarray(2 * np.pi * self._revolution(self._inside(time)))

    def rpm(self, time: npt.ArrayLike) -> RealArray:
        """Speed at the times [s], any shape [1/min]; InputError outside the pulses."""
        return np.asarray(60 * self._revolution(self._inside(time), nu=1))

    def rpm_rate(self, time: npt.ArrayLike) -> RealArray:
        """Change of speed at the times [s], any shape [1/(min s)]; InputError outside."""
        return np.asarray(60 * self._revolution(self._inside(time), nu=2))

    def rpm_range(self) -> tuple[float, float]:
        """Lowest and highest speed of the run [1/min]."""
        speed = self.rpm(self._fine_times())
        return float(speed.min()), float(speed.max())

    def time_at(self, rpm: npt.ArrayLike) -> RealArray:
        """Time at which a run-up or run-down first passes each speed.

        Parameters
        ----------
        rpm : array, shape (n,)
            [1/min].

        Returns
        -------
        array, shape (n,)
            [s].

        Raises
        ------
        InputError
            A speed that the run does not reach, or a run that turns from up to down or back by more
            than 2 % of its highest speed.
        """
        wanted = np.atleast_1d(np.asarray(rpm, dtype=float))
        time = self._fine_times()
        speed = self.rpm(time)
        sense = 1.0 if speed[-1] >= speed[0] else -1.0
        reached = np.maximum.accumulate(sense * speed)
        dip = reached - sense * speed
        if dip.max() > LARGEST_DIP * speed.max():
            raise InputError(
                f"{self.pulses.name}: the speed turns back by {dip.max():.0f} 1/min before "
                f"{time[np.argmax(dip)]:.2f} s: cut it into runs that rise or fall throughout"
            )
        outside = (sense * wanted < reached[0]) | (sense * wanted > reached[-1])
        if outside.any():
            raise InputError(
                f"{self.pulses.name}: the run does not pass {wanted[outside][0]:g} 1/min; it goes "
                f"from {speed[0]:.1f} to {sense * reached[-1]:.1f} 1/min"
            )
        first = np.concatenate([[True], np.diff(reached) > 0])
        return np.asarray(np.interp(sense * wanted, reached[first], time[first]))

    def _inside(self, time: npt.ArrayLike) -> RealArray:
        times = np.asarray(time, dtype=float)
        if np.any(times < self.begin) or np.any(times > self.end):
            raise InputError(
                f"{self.pulses.name}: the shaft angle is known from {self.begin:.3f} to "
                f"{self.end:.3f} s only, not at {times.min():.3f} to {times.max():.3f} s"
            )
        return times

    def _fine_times(self) -> RealArray:
        """At least eight times per pulse interval; the spline is almost straight in between."""
        return np.linspace(self.begin, self.end, 8 * int(np.ptp(self.pulses.number)) + 1)


def shaft_angle(
    pulses: PulseTrain, *, knot_spacing: float = KNOT_SPACING, zero_time: float | None = None
) -> ShaftAngle:
    """Smooth course through the pulses of a tacho.

    Parameters
    ----------
    pulses : PulseTrain
        As `repair_pulses` gives it.
    knot_spacing : float
        Revolutions between the knots of the spline; 0 puts the course through every pulse.
    zero_time : float, optional
        The pulse nearest to this time is the zero mark [s]; the first pulse where it is not given.

    Returns
    -------
    ShaftAngle

    Raises
    ------
    InputError
        A knot spacing that is negative, a zero time outside the pulses, or pulses whose course
        stands still or turns back.

    Notes
    -----
    Cubic spline of least squares of the revolutions over time, knots at every
    ``knot_spacing · pulses per revolution``-th pulse, exact for a linear run-up. Averaging over the
    knots takes out jitter and the unevenness within an engine cycle, so the angle is that of the
    mean rotation.

    A half order has two phases a half turn apart in one revolution: whether 1.5 leads or lags by
    180° depends on which pulse is zero. Within a run nothing depends on it; to compare runs give
    the `zero_time` of a mark once per engine cycle, such as an ignition.
    """
    if not knot_spacing >= 0:
        raise InputError(f"a knot spacing of {knot_spacing} revolutions is negative")
    times = pulses.times
    zero = 0
    if zero_time is not None:
        if not times[0] <= zero_time <= times[-1]:
            raise InputError(
                f"{pulses.name}: the zero mark at {zero_time:.3f} s is not within the pulses, "
                f"{times[0]:.3f} to {times[-1]:.3f} s"
            )
        zero = int(pulses.number[np.argmin(np.abs(times - zero_time))])
    revolution = (pulses.number - zero) / pulses.pulses_per_revolution
    every = max(1, round(knot_spacing * pulses.pulses_per_revolution))
    inner = times[2:-2:every]
    ends = _DEGREE + 1
    knots = np.concatenate([[times[0]] * ends, inner, [times[-1]] * ends])
    course = make_lsq_spline(times, revolution, knots, k=_DEGREE)
    jitter = 2 * np.pi * float(np.sqrt(np.mean((course(times) - revolution) ** 2)))
    shaft = ShaftAngle(float(times[0]), float(times[-1]), jitter, pulses, course)
    slowest, _ = shaft.rpm_range()
    if slowest <= 0:
        raise InputError(
            f"{pulses.name}: the shaft stands still or turns back: cut the record there"
        )
    return shaft
