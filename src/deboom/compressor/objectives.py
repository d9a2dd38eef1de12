"""What a fit at the virtual point makes small: inertance against its noise, or the thesis's sum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

THESIS_BANDS = ((10.0, 30.0), (100.0, 150.0))
"""Around the rigid-body modes, and on the mass line [Hz]."""


def in_bands(
    frequency: npt.ArrayLike, bands: tuple[tuple[float, float], ...] = THESIS_BANDS
) -> npt.NDArray[np.bool_]:
    """Mark the lines inside any of the bands.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    bands : tuple of (float, float)
        Each from, to, both included [Hz].

    Returns
    -------
    bool array, shape (n_frequency,)

    Raises
    ------
    InputError
        A band without a line.
    """
    lines = np.asarray(frequency, dtype=float)
    marks = [(lines >= low) & (lines <= high) for low, high in bands]
    for (low, high), mark in zip(bands, marks, strict=True):
        if not mark.any():
            raise InputError(f"no line of the measurement lies in the band {low:g}-{high:g} Hz")
    return np.asarray(np.logical_or.reduce(marks))


class Objective(Protocol):
    """Weighted complex deviations of a model from a measurement at the virtual point."""

    @property
    def frequency(self) -> RealArray:
        """Lines, shape (n_frequency,) [Hz]."""
        ...

    def residuals(self, apparent: ComplexArray, inertance: ComplexArray) -> ComplexArray:
        """Weigh the deviations of a model's matrices, shape (n_frequency, 6, 6) each.

        The result has shape (n_term, n_frequency, 6, 6).
        """
        ...

    def derivatives(self, apparent: ComplexArray, inertance: ComplexArray) -> ComplexArray:
        """Weigh derivatives of the matrices, shape (n_parameters, n_frequency, 6, 6) each.

        The result has shape (n_parameters, n_term, n_frequency, 6, 6).
        """
        ...


@dataclass(frozen=True, eq=False)
class WhitenedInertance:
    """Inertance at the virtual point, in units of its own noise.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    measured : array, shape (n_frequency, 6, 6)
        [1/kg, 1/(kg m), 1/(kg m²)].
    response_inverse : array, shape (6, n_channel)
        Pseudo-inverse that made the six responses.
    excitation_inverse : array, shape (6, n_impact)
        Pseudo-inverse that made the six loads.
    deviation : array, shape (n_frequency,)
        Standard deviation of the real and of the imaginary part of a raw FRF [1/kg].

    Notes
    -----
    Independent noise of the raw FRFs is coloured by the two pseudo-inverses P and Q; it is white
    again in ``C_P⁻¹ Y_VP C_Q⁻ᵀ`` with ``C_P C_Pᵀ = P Pᵀ``.
    """

    frequency: RealArray
    measured: ComplexArray
    response_inverse: RealArray
    excitation_inverse: RealArray
    deviation: RealArray

    def residuals(
        self,
        apparent: ComplexArray,  # noqa: ARG002  both matrices go to every objective
        inertance: ComplexArray,
    ) -> ComplexArray:
        """Weigh the deviations of the inertance, shape (1, n_frequency, 6, 6)."""
        return self._white(inertance - self.measured)[np.newaxis]

    def derivatives(
        self,
        apparent: ComplexArray,  # noqa: ARG002  both matrices go to every objective
        inertance: ComplexArray,
    ) -> ComplexArray:
        """Weigh the derivatives of the inertance."""
        return self._white(inertance)[:, np.newaxis]

    def _white(self, values: ComplexArray) -> ComplexArray:
        left = np.linalg.inv(np.linalg.cholesky(self.response_inverse @ self.response_inverse.T))
        right = np.linalg.inv(
            np.linalg.cholesky(self.excitation_inverse @ self.excitation_inverse.T)
        )
        return np.asarray(left @ values @ right.T / self.deviation[:, np.newaxis, np.newaxis])


@dataclass(frozen=True, eq=False)
class InertanceAndApparentMass:
    """Inertance and apparent mass together, each against its size in the band: the thesis.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    measured : array, shape (n_frequency, 6, 6)
        Inertance [1/kg, 1/(kg m), 1/(kg m²)].
    length : float
        Characteristic length that makes rotations and displacements comparable [m].
    split : float
        Lines below and above it are weighted by sizes of their own [Hz].

    Notes
    -----
    Thesis, section 4.4: complex deviations of both matrices in 10-30 and 100-150 Hz. Each entry is
    scaled by the length, each band by its root mean square over all entries.
    """

    frequency: RealArray
    measured: ComplexArray
    length: float
    split: float = 60.0

    def residuals(self, apparent: ComplexArray, inertance: ComplexArray) -> ComplexArray:
        """Weigh the deviations of both matrices, shape (2, n_frequency, 6, 6)."""
        by_inertance, by_mass = self._weights()
        return np.stack(
            [
                by_inertance * (inertance - self.measured),
                by_mass * (apparent - np.linalg.inv(self.measured)),
            ]
        )

    def derivatives(self, apparent: ComplexArray, inertance: ComplexArray) -> ComplexArray:
        """Weigh the derivatives of both matrices."""
        by_inertance, by_mass = self._weights()
        return np.stack([by_inertance * inertance, by_mass * apparent], axis=1)

    def _weights(self) -> tuple[RealArray, RealArray]:
        unit = np.outer(*(np.repeat([1.0, self.length], 3),) * 2)
        low = self.frequency < self.split
        weights = []
        for values, scale in ((self.measured, unit), (np.linalg.inv(self.measured), 1 / unit)):
            weight = np.empty(self.frequency.shape)
            for band in (low, ~low):
                if band.any():
                    size = np.sqrt(np.mean(np.abs(values[band] * scale) ** 2))
                    weight[band] = 1 / size
            weights.append(weight[:, np.newaxis, np.newaxis] * scale)
        return weights[0], weights[1]
