"""Amplitude-dependent motion in plain numpy: the reference, and the careful tier."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.vehicles.amplitude_motion import (
    TOLERANCE,
    AmplitudeMotion,
    pressure,
    solve_along_lines,
)

ROWS = 128
"""Designs solved at once; bounds the memory."""


@dataclass(frozen=True, eq=False)
class AmplitudeSum:
    """Sums of levels over the lines of one load case; `NumpyAmplitudeKernel.prepare` makes it.

    Parameters
    ----------
    motion : AmplitudeMotion
        Of the load case.
    tolerance : float
        Largest relative change of an amplitude in the last sweep [1].
    """

    motion: AmplitudeMotion
    tolerance: float

    def __call__(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f 20 lg |p_f|`` of each design and vehicle.

        Parameters
        ----------
        designs : array, shape (n, n_variable)
            Stiffness factors, finite [1].

        Returns
        -------
        array, shape (n, n_vehicle)
            [dB re 1 Pa]; NaN where amplitudes do not come to rest.
        """
        level = np.empty((len(designs), len(self.motion.vehicle_names)))
        for start in range(0, len(designs), ROWS):
            rows = designs[start : start + ROWS]
            solution = solve_along_lines(self.motion, rows, self.tolerance)
            with np.errstate(divide="ignore"):
                lines = 20.0 * np.log10(np.abs(pressure(self.motion, solution)))
            level[start : start + ROWS] = lines.sum(axis=-1)
        return level


@dataclass(frozen=True)
class NumpyAmplitudeKernel:
    """The kernel of this module, a `deboom.vehicles.booming_model.AmplitudeKernel`.

    Parameters
    ----------
    name : str
        What the run's record calls it.
    tolerance : float
        Largest relative change of an amplitude in the last sweep [1].
    """

    name: str = "numpy"
    tolerance: float = TOLERANCE

    def prepare(self, motion: AmplitudeMotion) -> AmplitudeSum:
        """Take one load case."""
        return AmplitudeSum(motion, self.tolerance)


NUMPY_AMPLITUDE = NumpyAmplitudeKernel()
"""Plain numpy in double precision: no compiler, and no hurry."""
