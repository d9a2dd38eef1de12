"""Dynamic stiffness over the displacement amplitude alone, for an amplitude-dependent solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray

_CHEBYSHEV = np.cos(np.pi * (np.arange(4) + 0.5) / 4)


@dataclass(frozen=True, eq=False)
class AmplitudeCubic:
    """Cubics in the displacement amplitude, one per operating point.

    Parameters
    ----------
    coefficients : array, shape (..., 4)
        Of the powers 0 to 3 of the amplitude scaled to [-1, 1], complex [N/m].
    lowest, highest : float
        Amplitudes that are scaled to -1 and 1: the measured range [m].
    """

    coefficients: ComplexArray
    lowest: float
    highest: float

    def __post_init__(self) -> None:
        coefficients = np.array(self.coefficients, dtype=complex)
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)

    @staticmethod
    def nodes(lowest: float, highest: float) -> RealArray:
        """Four amplitudes that determine a cubic well (Chebyshev's), shape (4,) [m]."""
        return (lowest + highest) / 2 + _span(lowest, highest) / 2 * _CHEBYSHEV

    @classmethod
    def through(cls, values: ComplexArray, lowest: float, highest: float) -> AmplitudeCubic:
        """Interpolate `values` (..., 4) [N/m] at the amplitudes of `nodes`."""
        powers = np.vander(_CHEBYSHEV, 4, increasing=True)
        return cls(values @ np.linalg.inv(powers).T, lowest, highest)

    def __call__(self, amplitude: npt.ArrayLike) -> ComplexArray:
        """Stiffness [N/m] at `amplitude` [m], broadcastable to the operating points."""
        z = self._scaled(amplitude)
        c = self.coefficients
        return np.asarray(c[..., 0] + z * (c[..., 1] + z * (c[..., 2] + z * c[..., 3])))

    def derivative(self, amplitude: npt.ArrayLike) -> ComplexArray:
        """Differentiate by the amplitude [N/m²] at `amplitude` [m]."""
        z = self._scaled(amplitude)
        c = self.coefficients
        by_scaled = c[..., 1] + z * (2 * c[..., 2] + z * 3 * c[..., 3])
        return np.asarray(by_scaled * 2 / _span(self.lowest, self.highest))

    def held(self, amplitude: npt.ArrayLike) -> RealArray:
        """Limit `amplitude` [m] to the measured range, for iterations on their way there."""
        limited = np.clip(np.asarray(amplitude, dtype=float), self.lowest, self.highest)
        return np.asarray(limited)

    def _scaled(self, amplitude: npt.ArrayLike) -> RealArray:
        z = 2 * np.asarray(amplitude, dtype=float) - self.lowest - self.highest
        return np.asarray(z / _span(self.lowest, self.highest))


def _span(lowest: float, highest: float) -> float:
    """Measured range, or 1 where a single amplitude was measured [m]."""
    return highest - lowest if highest > lowest else 1.0
