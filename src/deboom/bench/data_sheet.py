"""The platform's data sheet: nominal values within their tolerances, never the exact truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.frozen import freeze_arrays
from deboom.bench.parameters import VirtualBench

MASS_TOLERANCE = 1.0
"""[kg]"""

INERTIA_TOLERANCE = 0.02
"""Of each entry, relative to the diagonal: of entry ij, relative to ``√(J_ii J_jj)`` [1]."""

CENTRE_TOLERANCE = 0.002
"""Of the centre of gravity, per axis [m]."""

WHEEL_END_TOLERANCE = 1.0
"""Of the mass of one wheel end [kg]."""

WITHIN = 0.9
"""Share of a tolerance that deviations fill, so that rounding stays inside."""


@dataclass(frozen=True, eq=False)
class DataSheet:
    """What the platform file states about the powertrain.

    Parameters
    ----------
    mass : float
        [kg].
    inertia : array, shape (3, 3)
        About the centre of gravity [kg m²].
    centre_error : array, shape (3,)
        True centre of gravity from the stated one [m]; every stated position is off by it.
    """

    mass: float
    inertia: RealArray
    centre_error: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def draw_data_sheet(bench: VirtualBench, generator: np.random.Generator) -> DataSheet:
    """Draw stated values within the tolerances around the true ones, rounded as on a sheet.

    Parameters
    ----------
    bench : VirtualBench
        With the true values.
    generator : Generator
        Draws the deviations, uniform within 90 % of the tolerances.
    """
    mass = bench.mass + WITHIN * MASS_TOLERANCE * generator.uniform(-1, 1)
    radii = np.sqrt(np.diag(bench.inertia))
    upper = np.triu(generator.uniform(-1, 1, (3, 3)))
    deviation = upper + np.triu(upper, 1).T
    inertia = bench.inertia + WITHIN * INERTIA_TOLERANCE * deviation * np.outer(radii, radii)
    return DataSheet(
        mass=round(mass, 1),
        inertia=np.round(inertia, 3),
        centre_error=np.round(WITHIN * CENTRE_TOLERANCE * generator.uniform(-1, 1, 3), 4),
    )


def draw_wheel_end_mass(bench: VirtualBench, generator: np.random.Generator) -> float:
    """Draw the stated mass of one wheel end [kg], within its tolerance around the true one."""
    true = float(bench.wheel_end.mass_matrix[0, 0])
    return round(true + WITHIN * WHEEL_END_TOLERANCE * generator.uniform(-1, 1), 1)
