"""How the mounts of a running compressor may differ from those of the struck one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


class StiffnessChange(Protocol):
    """Change of the mounts, linear in real unknowns that are 0 for none."""

    def matrices(
        self, frequency: RealArray, mounts: ComplexArray, motion: ComplexArray
    ) -> ComplexArray:
        """Part of the apparent mass that each unknown takes away.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            [Hz].
        mounts : array, shape (n_frequency, 6, 6)
            Part of the mounts as they were struck, ``v K/ω²`` [kg, kg m, kg m²].
        motion : array, shape (n_frequency, 6)
            Of the virtual point in the sweep in question [m/s², rad/s²].

        Returns
        -------
        array, shape (n_unknown, n_frequency, 6, 6)
            [kg, kg m, kg m²].
        """
        ...

    @property
    def deviations(self) -> RealArray:
        """1 σ of each unknown, beforehand, shape (n_unknown,) [1]."""
        ...


@dataclass(frozen=True)
class OneFactor:
    """One complex factor ``1 + δ`` at every speed: another temperature or preload.

    Parameters
    ----------
    deviation : float
        1 σ of real and imaginary part of δ, before the sweep [1].

    Raises
    ------
    InputError
        A deviation that is not positive.
    """

    deviation: float = 0.3

    def __post_init__(self) -> None:
        _refuse_certainty(self.deviation)

    def basis(self, frequency: RealArray) -> ComplexArray:
        """δ per unknown: one, and the imaginary unit, shape (2, n_frequency)."""
        return parts_by_turns(np.ones((1, frequency.size)))

    def matrices(
        self,
        frequency: RealArray,
        mounts: ComplexArray,
        motion: ComplexArray,  # noqa: ARG002  only a law over the stroke needs it
    ) -> ComplexArray:
        """Scale the mounts, however they move."""
        return np.asarray(self.basis(frequency)[..., np.newaxis, np.newaxis] * mounts)

    @property
    def deviations(self) -> RealArray:
        """Of both parts of δ."""
        return np.full(2, self.deviation)


@dataclass(frozen=True)
class FactorOverFrequency:
    """A complex factor common to all speeds, and one more at each knot, linear between them.

    Parameters
    ----------
    knots : tuple of float
        Rising; dense where the motion changes quickly, around the rigid-body modes [Hz].
    common, at_knot : float
        1 σ of real and imaginary part of the common δ, and of what each knot adds to it [1].

    Raises
    ------
    InputError
        Fewer than two knots, knots that do not rise, a deviation that is not positive.
    """

    knots: tuple[float, ...] = (17.0, 22.0, 28.0, 36.0, 50.0, 150.0)
    common: float = 0.3
    at_knot: float = 0.1

    def __post_init__(self) -> None:
        if len(self.knots) < 2 or np.any(np.diff(self.knots) <= 0):
            raise InputError("a stiffness factor over frequency needs two rising knots at least")
        _refuse_certainty(self.common, self.at_knot)

    def hats(self, frequency: RealArray) -> RealArray:
        """One hat around each knot, shape (n_knot, n_frequency)."""
        return np.array([np.interp(frequency, self.knots, row) for row in np.eye(len(self.knots))])

    def basis(self, frequency: RealArray) -> ComplexArray:
        """δ per unknown, shape (2 + 2 n_knot, n_frequency)."""
        return parts_by_turns(np.vstack([np.ones(frequency.size), self.hats(frequency)]))

    def matrices(
        self,
        frequency: RealArray,
        mounts: ComplexArray,
        motion: ComplexArray,  # noqa: ARG002  only a law over the stroke needs it
    ) -> ComplexArray:
        """Scale the mounts, however they move."""
        return np.asarray(self.basis(frequency)[..., np.newaxis, np.newaxis] * mounts)

    @property
    def deviations(self) -> RealArray:
        """Of both parts of the common δ, then of those of each knot."""
        return np.repeat([self.common, *(self.at_knot for _ in self.knots)], 2)


def parts_by_turns(basis: RealArray) -> ComplexArray:
    """Double each row: once for the real, once for the imaginary part of its factor."""
    return np.asarray(np.stack([basis, 1j * basis], axis=1).reshape(-1, basis.shape[-1]))


def static_part(mounts: ComplexArray) -> RealArray:
    """Take the phase, which all entries share, off ``v K/ω²``, shape (n_frequency, 6, 6)."""
    trace = np.trace(mounts, axis1=1, axis2=2)
    return np.asarray((mounts * (np.abs(trace) / trace)[:, np.newaxis, np.newaxis]).real)


def _refuse_certainty(*deviations: float) -> None:
    if not min(deviations) > 0:
        raise InputError("a change of the mounts that is to be found needs a deviation above 0")
