"""Rigid compressor on rubber mounts, seen at its virtual point: apparent mass and inertance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain import GainFactor
from deboom.errors import InputError
from deboom.measurement.inertance_test import CompressorMount, freeze_field
from deboom.physics.rigid_body import mass_matrix, mount_stiffness_matrix

TRIANGLE_TOLERANCE = 1e-9
"""How far, relative to the largest, principal moments may break the triangle inequality."""


def mounts_at_virtual_point(mounts: Sequence[CompressorMount]) -> RealArray:
    """Add up the static 6×6 stiffness of all mounts at the virtual point.

    Parameters
    ----------
    mounts : sequence of CompressorMount
        At least one.

    Returns
    -------
    array, shape (6, 6)
        Symmetric [N/m, N/rad, N m/rad].

    Notes
    -----
    ``K_VP = Σ T_iᵀ R_i diag(k_i) R_iᵀ T_i``; the thesis gives one mount (eq. 44) and leaves the
    sum unwritten. Mounts without rotational stiffness of their own make the trace of the coupling
    block zero, so that K_VP has 20 free entries, not 21.
    """
    return np.asarray(
        mount_stiffness_matrix(
            np.array([mount.position for mount in mounts]),
            np.array([mount.stiffness for mount in mounts]),
            np.array([mount.orientation for mount in mounts]),
        ),
        dtype=float,
    )


@dataclass(frozen=True, eq=False)
class CompressorModel:
    """Rigid body, static stiffness at the virtual point and one gain factor.

    Parameters
    ----------
    mass : float
        [kg].
    centre : array, shape (3,)
        Centre of gravity, from the virtual point [m].
    inertia : array, shape (3, 3)
        About the centre of gravity, products with their sign as matrix elements [kg m²].
    stiffness : array, shape (6, 6)
        K_VP, static, real and symmetric [N/m, N/rad, N m/rad].
    gain : GainFactor
        Common to all mounts; ``v(f) K_VP`` is the dynamic stiffness.

    Raises
    ------
    InputError
        Shapes; asymmetry; a mass or principal moment that is not positive; principal moments that
        no distribution of mass can have (one is larger than the sum of the other two).
    """

    mass: float
    centre: RealArray
    inertia: RealArray
    stiffness: RealArray
    gain: GainFactor

    def __post_init__(self) -> None:
        freeze_field(self, "centre", (3,), "the compressor")
        freeze_field(self, "inertia", (3, 3), "the compressor")
        freeze_field(self, "stiffness", (6, 6), "the compressor")
        for matrix, name in ((self.inertia, "inertia"), (self.stiffness, "stiffness")):
            if not np.allclose(matrix, matrix.T, rtol=0, atol=1e-9 * np.abs(matrix).max()):
                raise InputError(f"the {name} of the compressor is not symmetric")
        if not self.mass > 0:
            raise InputError(f"the compressor has a mass of {self.mass:g} kg: it must be positive")
        moments = np.linalg.eigvalsh(self.inertia)
        if moments[0] <= 0 or moments[2] > (moments[0] + moments[1]) * (1 + TRIANGLE_TOLERANCE):
            raise InputError(
                "no body has the principal moments "
                + ", ".join(f"{moment:.4g}" for moment in moments)
                + " kg m²: each must be positive and at most the sum of the other two"
            )

    @classmethod
    def on_mounts(
        cls,
        mass: float,
        centre: npt.ArrayLike,
        inertia: npt.ArrayLike,
        mounts: Sequence[CompressorMount],
        gain: GainFactor,
    ) -> CompressorModel:
        """Compressor whose stiffness is that of its mounts; see `mounts_at_virtual_point`."""
        stiffness = mounts_at_virtual_point(mounts)
        return cls(mass, np.asarray(centre), np.asarray(inertia), stiffness, gain)

    @property
    def mass_matrix(self) -> RealArray:
        """At the virtual point, shape (6, 6) [kg, kg m, kg m²]."""
        return mass_matrix(self.mass, self.inertia, self.centre)

    def apparent_mass(self, frequency: npt.ArrayLike) -> ComplexArray:
        """Force per acceleration at the virtual point.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            Above 0 [Hz].

        Returns
        -------
        array, shape (n_frequency, 6, 6)
            [kg, kg m, kg m²].

        Raises
        ------
        InputError
            A line at or below 0 Hz.

        Notes
        -----
        ``AM = M − v(f) K_VP/ω²``, from the thesis's eq. 48-61 with the sign of its damping term
        mended.
        """
        lines = np.asarray(frequency, dtype=float)
        if np.any(lines <= 0):
            raise InputError("a line at 0 Hz has no apparent mass: start above it")
        factor = self.gain.at(lines) / (2 * np.pi * lines) ** 2
        return np.asarray(self.mass_matrix - factor[:, np.newaxis, np.newaxis] * self.stiffness)

    def inertance(self, frequency: npt.ArrayLike) -> ComplexArray:
        """Acceleration per force at the virtual point, by direct inversion line by line.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            Above 0 [Hz].

        Returns
        -------
        array, shape (n_frequency, 6, 6)
            [1/kg, 1/(kg m), 1/(kg m²)].

        Raises
        ------
        InputError
            As `apparent_mass`.
        """
        return np.asarray(np.linalg.inv(self.apparent_mass(frequency)))
