"""Minimal parametrisation: all that inertance at one virtual point can say of a compressor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain import GainFactor
from deboom.compressor.gain_parameters import (
    GAIN_SHAPE_NAMES,
    gain_derivatives,
    gain_from_parameters,
    gain_parameters,
)
from deboom.compressor.mass_parameters import (
    MASS_PARAMETER_NAMES,
    mass_matrix_derivatives,
    mass_matrix_from_parameters,
    mass_parameters,
)
from deboom.compressor.model import CompressorModel
from deboom.physics.mass_properties import RigidBody, mass_properties

N_MASS, N_STIFFNESS = 10, 20
_ENTRIES = [
    (row, column) for row in range(6) for column in range(row, 6) if (row, column) != (2, 5)
]


@dataclass(frozen=True)
class MinimalParameters:
    """Ten numbers of mass, twenty of stiffness, five of gain.

    Parameters
    ----------
    length : float
        Characteristic length by which rotations are scaled, printed with every result [m].
    stiffness_scale : float
        A typical mount stiffness [N/m].
    reference_frequency : float
        Where the real part of the gain is 1, so that K_VP is the real stiffness of that line [Hz].

    Notes
    -----
    The trace of the coupling block of K_VP is zero, since mounts have no rotational stiffness of
    their own; the entry z–rz follows from it. The gain has five numbers left of six because its
    scale and that of K_VP are one.
    """

    length: float
    stiffness_scale: float = 1e4
    reference_frequency: float = 20.0

    @property
    def names(self) -> tuple[str, ...]:
        """One per parameter."""
        axes = ("x", "y", "z", "rx", "ry", "rz")
        entries = tuple(f"K {axes[row]} {axes[column]} / scale" for row, column in _ENTRIES)
        return MASS_PARAMETER_NAMES + entries + GAIN_SHAPE_NAMES

    @property
    def units(self) -> tuple[str, ...]:
        """One per parameter: all are scaled to pure numbers."""
        return ("1",) * len(self.names)

    @property
    def stiffness_basis(self) -> RealArray:
        """6×6 matrix that each stiffness parameter multiplies, shape (20, 6, 6)."""
        unit = np.repeat([1.0, self.length], 3)
        basis = np.zeros((N_STIFFNESS, 6, 6))
        for number, (row, column) in enumerate(_ENTRIES):
            entry = self.stiffness_scale * unit[row] * unit[column]
            basis[number, row, column] = basis[number, column, row] = entry
            if (row, column) in ((0, 3), (1, 4)):
                basis[number, 2, 5] = basis[number, 5, 2] = -entry
        return basis

    def gain(self, values: RealArray) -> GainFactor:
        """Gain factor of the last five parameters, 1 in its real part at the reference line."""
        return gain_from_parameters(values[N_MASS + N_STIFFNESS :], self.reference_frequency)

    def stiffness(self, values: RealArray) -> RealArray:
        """K_VP at the reference line, shape (6, 6) [N/m, N/rad, N m/rad]."""
        numbers = values[N_MASS : N_MASS + N_STIFFNESS]
        return np.asarray(np.tensordot(numbers, self.stiffness_basis, axes=1))

    def model(self, values: RealArray) -> CompressorModel:
        """Build the compressor that the numbers stand for."""
        body = mass_properties(mass_matrix_from_parameters(values[:N_MASS], self.length))
        stiffness, gain = self.stiffness(values), self.gain(values)
        return CompressorModel(body.mass, body.centre, body.inertia, stiffness, gain)

    def sensitivities(self, values: RealArray, frequency: RealArray) -> ComplexArray:
        """Differentiate the apparent mass, shape (35, n_frequency, 6, 6)."""
        lines = np.asarray(frequency, dtype=float)
        squared = (2 * np.pi * lines) ** 2
        result = np.zeros((len(self.names), lines.size, 6, 6), dtype=complex)
        result[:N_MASS] = self.mass_sensitivities(values)[:N_MASS, np.newaxis]
        factor = -self.gain(values).at(lines) / squared
        result[N_MASS : N_MASS + N_STIFFNESS] = (
            factor[:, np.newaxis, np.newaxis] * self.stiffness_basis[:, np.newaxis]
        )
        derivatives = gain_derivatives(
            values[N_MASS + N_STIFFNESS :], self.reference_frequency, lines
        )
        shape = -derivatives / squared
        result[N_MASS + N_STIFFNESS :] = shape[..., np.newaxis, np.newaxis] * self.stiffness(values)
        return result

    def mass_sensitivities(self, values: RealArray) -> RealArray:
        """Differentiate the 6×6 mass matrix, shape (35, 6, 6)."""
        result = np.zeros((len(self.names), 6, 6))
        result[:N_MASS] = mass_matrix_derivatives(values[:N_MASS], self.length)
        return result

    def values_of(self, model: CompressorModel) -> RealArray:
        """Find the parameters of a compressor, the inverse of `model`.

        Parameters
        ----------
        model : CompressorModel
            Its K_VP must have a coupling block of trace zero.

        Returns
        -------
        array, shape (35,)
            [1].
        """
        body = RigidBody(model.mass, model.centre, model.inertia)
        reference = float(model.gain.real.at(self.reference_frequency))
        unit = np.repeat([1.0, self.length], 3)
        scaled = model.stiffness * reference / (self.stiffness_scale * np.outer(unit, unit))
        gain = gain_parameters(model.gain, self.reference_frequency)
        stiffness = [scaled[row, column] for row, column in _ENTRIES]
        return np.concatenate([mass_parameters(body, self.length), stiffness, gain])
