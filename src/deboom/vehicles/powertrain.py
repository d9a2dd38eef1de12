"""The powertrain as a rigid body: what its data sheet states, and how well."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.physics import rigid_body


@dataclass(frozen=True, eq=False)
class Powertrain:
    """Mass, inertia and centre of gravity with their tolerances.

    Parameters
    ----------
    mass : float
        [kg].
    inertia : array, shape (3, 3)
        Matrix entries about the centre of gravity, vehicle axes [kg m²].
    centre : array, shape (3,)
        Centre of gravity from the origin of the mounts' positions, which is the stated one [m].
    mass_tolerance : float
        Half width [kg].
    inertia_tolerance : float
        Half width of entry ij relative to ``√(J_ii J_jj)`` [1].
    centre_tolerance : float
        Half width per axis [m].

    Raises
    ------
    InputError
        A mass that is not positive, an inertia that is not symmetric and positive definite, a
        negative tolerance.
    """

    mass: float
    inertia: RealArray
    centre: RealArray = field(default_factory=lambda: np.zeros(3))
    mass_tolerance: float = 0.0
    inertia_tolerance: float = 0.0
    centre_tolerance: float = 0.0

    def __post_init__(self) -> None:
        for name, shape in (("inertia", (3, 3)), ("centre", (3,))):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.isfinite(array).all():
                raise InputError(f"powertrain: {name} needs {shape} finite numbers, not {array}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not 0.0 < self.mass < np.inf:
            raise InputError(f"powertrain: a mass of {self.mass} kg: give more than 0 kg")
        symmetric = np.array_equal(self.inertia, self.inertia.T)
        if not symmetric or np.linalg.eigvalsh(self.inertia)[0] <= 0:
            raise InputError(
                f"powertrain: inertia {self.inertia.tolist()} is not symmetric and positive "
                "definite: check its entries"
            )
        if min(self.mass_tolerance, self.inertia_tolerance, self.centre_tolerance) < 0:
            raise InputError("powertrain: a tolerance is negative: give its half width")

    @property
    def mass_matrix(self) -> RealArray:
        """6×6 mass matrix at the origin of the mounts' positions [kg, kg m, kg m²]."""
        return rigid_body.mass_matrix(self.mass, self.inertia, self.centre)

    def within_tolerance(self, generator: np.random.Generator) -> Powertrain:
        """Draw a powertrain that the data sheet would also describe.

        Parameters
        ----------
        generator : Generator
            Draws mass, inertia and centre of gravity, uniform and independent.

        Returns
        -------
        Powertrain
            Without tolerances.
        """
        radii = np.sqrt(np.diag(self.inertia))
        upper = np.triu(generator.uniform(-1, 1, (3, 3)))
        deviation = upper + np.triu(upper, 1).T
        return replace(
            self,
            mass=self.mass + self.mass_tolerance * generator.uniform(-1, 1),
            inertia=self.inertia + self.inertia_tolerance * deviation * np.outer(radii, radii),
            centre=self.centre + self.centre_tolerance * generator.uniform(-1, 1, 3),
            mass_tolerance=0.0,
            inertia_tolerance=0.0,
            centre_tolerance=0.0,
        )
