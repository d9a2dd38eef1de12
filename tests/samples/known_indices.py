"""Functions whose Sobol indices are known exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.explore.sensitivity import SensitivityInputs


@dataclass(frozen=True, eq=False)
class ExactIndices:
    """Indices of one output.

    Parameters
    ----------
    first, total : array, shape (k,)
        [1].
    """

    first: RealArray
    total: RealArray


@dataclass(frozen=True)
class Ishigami:
    """``sin x1 + a sin² x2 + b x3⁴ sin x1`` of three uniform variables within ±π.

    The third variable acts only together with the first one.

    Parameters
    ----------
    a, b : float
        [1].

    Notes
    -----
    T. Ishigami and T. Homma, Proc. ISUMA, 1990. The variance is ``V1 + V2 + V13`` with
    ``V1 = (1 + b π⁴/5)²/2``, ``V2 = a²/8``, ``V13 = b² π⁸ 8/225``.
    """

    a: float = 7.0
    b: float = 0.1

    @property
    def inputs(self) -> SensitivityInputs:
        """Its variables."""
        edge = np.full(3, np.pi)
        return SensitivityInputs(("x1", "x2", "x3"), -edge, edge)

    @property
    def exact(self) -> ExactIndices:
        """Its indices."""
        alone = (0.5 * (1.0 + self.b * np.pi**4 / 5.0) ** 2, self.a**2 / 8.0, 0.0)
        both = 8.0 / 225.0 * self.b**2 * np.pi**8
        first = np.array(alone) / (sum(alone) + both)
        interaction = both / (sum(alone) + both)
        return ExactIndices(first, first + interaction * np.array([1.0, 0.0, 1.0]))

    def __call__(self, designs: RealArray) -> RealArray:
        """Return its value, shape (n, 1)."""
        x1, x2, x3 = designs.T
        value = (1.0 + self.b * x3**4) * np.sin(x1) + self.a * np.sin(x2) ** 2
        return np.asarray(value[:, np.newaxis])


@dataclass(frozen=True)
class SobolG:
    """The product of ``(|4 x - 2| + a) / (1 + a)`` over uniform variables within 0 and 1.

    Parameters
    ----------
    a : tuple of float, length k
        0: as strong as can be; 99: hardly any effect [1].

    Notes
    -----
    A. Saltelli and I. M. Sobol', Matematicheskoe Modelirovanie 7, 1995. With ``V_j = 1/(3 (1 +
    a_j)²)`` the variance is ``V = Π (1 + V_j) - 1``, the first index ``V_j/V`` and the total
    one ``V_j Π_{k≠j} (1 + V_k)/V``.
    """

    a: tuple[float, ...] = (0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0)

    @property
    def inputs(self) -> SensitivityInputs:
        """Its variables."""
        count = len(self.a)
        names = tuple(f"x{place + 1}" for place in range(count))
        return SensitivityInputs(names, np.zeros(count), np.ones(count))

    @property
    def exact(self) -> ExactIndices:
        """Its indices."""
        alone = 1.0 / (3.0 * (1.0 + np.array(self.a)) ** 2)
        product = np.prod(1.0 + alone)
        variance = product - 1.0
        return ExactIndices(alone / variance, alone * product / (1.0 + alone) / variance)

    def __call__(self, designs: RealArray) -> RealArray:
        """Return its value, shape (n, 1)."""
        a = np.array(self.a)
        factors = (np.abs(4.0 * designs - 2.0) + a) / (1.0 + a)
        return np.asarray(factors.prod(axis=1, keepdims=True))
