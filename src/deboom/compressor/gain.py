"""Dynamic gain factor of rubber: how a static stiffness grows with frequency and amplitude."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

GAIN_PARAMETERS = (
    "real limit",
    "real slope",
    "real offset",
    "imaginary limit",
    "imaginary slope",
    "imaginary offset",
)
"""Order of the derivatives of `GainFactor.derivatives`."""


@dataclass(frozen=True)
class HyperbolicGain:
    """Real or imaginary part of a gain that rises to a limit.

    Parameters
    ----------
    limit : float
        Value at high frequency [1].
    slope : float
        Positive [s].
    offset : float
        Positive; ``1/offset`` is the rise from 0 Hz to the limit [1].

    Raises
    ------
    InputError
        A number that is not finite, or a slope or an offset that is not positive.

    Notes
    -----
    ``v(f) = limit − 1/(slope·f + offset)``: thesis, eq. 56 and 57. The frequency is in hertz: in
    eq. 56 the name ω stands for it, and the offset, there called ω₀, has no unit. Used from 10 to
    150 Hz; it says nothing outside.
    """

    limit: float
    slope: float
    offset: float

    def __post_init__(self) -> None:
        _refuse_pole(self, "a gain factor", "s", "falls with frequency")

    def at(self, frequency: npt.ArrayLike) -> RealArray:
        """Value at each line.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            [Hz].

        Returns
        -------
        array, shape (n_frequency,)
            [1].
        """
        return self.limit - 1 / (self.slope * np.asarray(frequency, dtype=float) + self.offset)

    def derivatives(self, frequency: npt.ArrayLike) -> RealArray:
        """Differentiate the value with respect to limit, slope and offset.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            [Hz].

        Returns
        -------
        array, shape (3, n_frequency)
            [1, Hz, 1].
        """
        lines = np.asarray(frequency, dtype=float)
        squared = (self.slope * lines + self.offset) ** 2
        return np.stack([np.ones_like(lines), lines / squared, 1 / squared])


@dataclass(frozen=True)
class GainFactor:
    """Complex gain common to all directions of all mounts, ``v(f) = v' + j v''``.

    Parameters
    ----------
    real, imaginary : HyperbolicGain
        Stiffening and loss over frequency.

    Notes
    -----
    Thesis, eq. 53, 56, 57, without its factor v_rel: v_rel, the scale of the gain and the scale of
    the static stiffness are one number, and only their product is seen in a measurement.
    """

    real: HyperbolicGain
    imaginary: HyperbolicGain

    @classmethod
    def of(cls, values: npt.ArrayLike) -> GainFactor:
        """Gain factor from six numbers in the order of `GAIN_PARAMETERS`.

        Parameters
        ----------
        values : array, shape (6,)
            Real limit, slope, offset, imaginary limit, slope, offset [1, s, 1, 1, s, 1].
        """
        numbers = [float(value) for value in np.asarray(values, dtype=float)]
        return cls(HyperbolicGain(*numbers[:3]), HyperbolicGain(*numbers[3:]))

    @property
    def values(self) -> RealArray:
        """The six numbers in the order of `GAIN_PARAMETERS`."""
        parts = (self.real, self.imaginary)
        return np.array([number for p in parts for number in (p.limit, p.slope, p.offset)])

    def at(self, frequency: npt.ArrayLike) -> ComplexArray:
        """Value at each line.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            [Hz].

        Returns
        -------
        array, shape (n_frequency,)
            Complex [1].
        """
        return np.asarray(self.real.at(frequency) + 1j * self.imaginary.at(frequency))

    def derivatives(self, frequency: npt.ArrayLike) -> ComplexArray:
        """Differentiate the value, one row per entry of `GAIN_PARAMETERS`.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            [Hz].

        Returns
        -------
        array, shape (6, n_frequency)
            Complex [1, Hz, 1, 1, Hz, 1].
        """
        return np.concatenate(
            [self.real.derivatives(frequency), 1j * self.imaginary.derivatives(frequency)]
        )

    def expected_loss(self, frequency: npt.ArrayLike) -> RealArray:
        """Imaginary part that causality ties to the real one, ``(π/2) dv'/d ln f``.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            [Hz].

        Returns
        -------
        array, shape (n_frequency,)
            [1]. A rubber whose imaginary part is several times smaller or larger is not plausible.

        Notes
        -----
        First-order Kramers–Kronig relation, good for gains that vary slowly with ln f.
        """
        lines = np.asarray(frequency, dtype=float)
        rise = self.real.slope * lines / (self.real.slope * lines + self.real.offset) ** 2
        return np.pi / 2 * rise


@dataclass(frozen=True)
class AmplitudeGain:
    """Softening of rubber with amplitude, ``v(s) = limit + 1/(slope·s + offset)``.

    Parameters
    ----------
    limit : float
        Value at large amplitude [1].
    slope : float
        Positive [1/m].
    offset : float
        Positive; ``1/offset`` is the fall from rest to the limit [1].

    Raises
    ------
    InputError
        A number that is not finite, or a slope or an offset that is not positive.

    Notes
    -----
    Second factor of the thesis's eq. 54 and 55; s is the displacement amplitude of a mount.
    """

    limit: float
    slope: float
    offset: float

    def __post_init__(self) -> None:
        _refuse_pole(self, "an amplitude gain", "1/m", "does not fall with amplitude")

    def at(self, amplitude: npt.ArrayLike) -> RealArray:
        """Value at each amplitude.

        Parameters
        ----------
        amplitude : array, any shape
            Peak displacement of the mount, from 0 [m].

        Returns
        -------
        array, shape of `amplitude`
            [1].
        """
        return self.limit + 1 / (self.slope * np.asarray(amplitude, dtype=float) + self.offset)


def _refuse_pole(gain: HyperbolicGain | AmplitudeGain, what: str, unit: str, fault: str) -> None:
    """Refuse a hyperbola with a pole on the side where it is used."""
    if not all(map(math.isfinite, (gain.limit, gain.slope, gain.offset))):
        raise InputError(f"{what} needs finite limit, slope and offset")
    if gain.slope <= 0 or gain.offset <= 0:
        raise InputError(
            f"{what} with slope {gain.slope:g} {unit} and offset {gain.offset:g} has a pole or "
            f"{fault}: both must be positive"
        )
