"""Rigid-body modes of a mounted compressor with a gain that depends on frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.model import CompressorModel
from deboom.errors import InputError
from deboom.physics.rigid_body import rigid_body_modes

MOTIONS = ("x", "y", "z", "rx", "ry", "rz")
_LARGEST_STEPS = 200


@dataclass(frozen=True, eq=False)
class ModalTable:
    """Natural frequencies, loss factors and shapes.

    Parameters
    ----------
    frequency : array, shape (6,)
        Undamped, where the stiffness is that of the mode's own frequency [Hz].
    loss_factor : array, shape (6,)
        Imaginary over real part of the gain there [1].
    shapes : array, shape (6, 6)
        One mode per column, mass-normalised.
    energy : array, shape (6, 6)
        Share of each motion in the kinetic energy, one mode per column; coupling through the mass
        matrix can make a share negative [1].
    """

    frequency: RealArray
    loss_factor: RealArray
    shapes: RealArray
    energy: RealArray

    @property
    def leading(self) -> tuple[str, ...]:
        """Motion with the largest share of each mode."""
        return tuple(MOTIONS[int(np.argmax(column))] for column in self.energy.T)


def modal_table(model: CompressorModel) -> ModalTable:
    """Solve for the six rigid-body modes.

    Parameters
    ----------
    model : CompressorModel

    Returns
    -------
    ModalTable

    Raises
    ------
    InputError
        A stiffness with a negative direction, or a gain that has no natural frequency.

    Notes
    -----
    With one gain for all directions the shapes are those of the static stiffness, and each
    frequency solves ``f = f_s √v'(f)``; exact for the common gain only.
    """
    static, shapes = rigid_body_modes(model.mass_matrix, model.stiffness)
    frequency = static.copy()
    for _ in range(_LARGEST_STEPS):
        gain = model.gain.real.at(frequency)
        if np.any(gain <= 0):
            raise InputError("the gain factor is not positive at a natural frequency")
        following = static * np.sqrt(gain)
        settled = np.allclose(following, frequency, rtol=1e-12, atol=0)
        frequency = following
        if settled:
            break
    gain_there = model.gain.at(frequency)
    energy = shapes * (model.mass_matrix @ shapes)
    return ModalTable(frequency, gain_there.imag / gain_there.real, shapes, energy)
