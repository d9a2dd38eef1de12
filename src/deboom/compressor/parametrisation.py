"""What a parametrisation of the compressor offers to every identification."""

from __future__ import annotations

from typing import Protocol

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.model import CompressorModel


class Parametrisation(Protocol):
    """Numbers that an optimiser moves, and the compressor they stand for.

    Every parametrisation is a set of functions of one vector `values`, shape (n_parameters,), of
    the units it states. Its derivatives are analytic.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """One per parameter."""
        ...

    @property
    def units(self) -> tuple[str, ...]:
        """One per parameter."""
        ...

    def model(self, values: RealArray) -> CompressorModel:
        """Build the compressor that the numbers stand for; InputError where they stand for none."""
        ...

    def sensitivities(self, values: RealArray, frequency: RealArray) -> ComplexArray:
        """Differentiate the apparent mass, shape (n_parameters, n_frequency, 6, 6)."""
        ...

    def mass_sensitivities(self, values: RealArray) -> RealArray:
        """Differentiate the 6×6 mass matrix, shape (n_parameters, 6, 6)."""
        ...
