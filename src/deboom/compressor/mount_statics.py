"""What soft mounts cost: how far a compressor travels, and where its rigid-body modes lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.compressor.mount_variables import MountVariables
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.rigid_body import (
    forward_matrices,
    forward_matrix,
    mount_stiffness_matrix,
    rigid_body_modes,
)

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s²]."""
TRAVEL = "travel under 1 g"


@dataclass(frozen=True, eq=False)
class MountStatics:
    """Travel under 1 g and rigid-body modes, as functions of the stiffness factors.

    Parameters
    ----------
    variables : MountVariables
        Places do not count here: mounts stand where they are drawn.
    mounts : tuple of CompressorMount
        At factor 1.
    gain : float
        Stiffness that counts over that of `mounts` [1].
    mass : float
        [kg]
    centre : array, shape (3,)
        Centre of gravity, from the virtual point [m].
    mass_matrix : array, shape (6, 6)
        At the virtual point [kg, kg m, kg m²].

    Notes
    -----
    Rubber is stiffer over frequency than at rest: with the gain of the lowest line travel comes out
    short and modes high, in the same ratio for all designs.
    """

    variables: MountVariables
    mounts: tuple[CompressorMount, ...]
    gain: float
    mass: float
    centre: RealArray
    mass_matrix: RealArray

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of each column of the designs."""
        return self.variables.names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Of `__call__`."""
        return (TRAVEL,)

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the largest travel of a mount under 1 g along x, y or z, (n, k) → (n, 1) [mm].

        Raises
        ------
        InputError
            Designs that are no designs of these variables.
        """
        positions = np.array([mount.position for mount in self.mounts])
        stiffness = self._stiffness(designs)
        # a force at the centre of gravity, along each axis in turn
        weight = self.mass * GRAVITY * forward_matrix(self.centre).T
        bodies = np.linalg.solve(stiffness, np.broadcast_to(weight, (len(stiffness), 6, 3)))
        moved = forward_matrices(positions) @ bodies
        far = np.linalg.norm(moved.reshape(len(stiffness), -1, 3, 3), axis=2)
        return np.asarray(1e3 * far.max(axis=(1, 2))[:, np.newaxis])

    def modes(self, designs: npt.ArrayLike) -> RealArray:
        """Return the six rigid-body modes of designs, (n, k) → (n, 6) [Hz].

        Raises
        ------
        InputError
            As in `__call__`.
        """
        rows = [rigid_body_modes(self.mass_matrix, one)[0] for one in self._stiffness(designs)]
        return np.array(rows).reshape(-1, 6)

    def _stiffness(self, designs: npt.ArrayLike) -> RealArray:
        """Stiffness at the virtual point, shape (n, 6, 6)."""
        factors = self.variables.factors(self.variables.checked(designs))
        positions = np.array([mount.position for mount in self.mounts])
        turn = np.array([mount.orientation for mount in self.mounts])
        static = np.array([mount.stiffness for mount in self.mounts])
        values = self.gain * factors.reshape(-1, *static.shape) * static
        return np.asarray(mount_stiffness_matrix(positions, values, turn), dtype=float)
