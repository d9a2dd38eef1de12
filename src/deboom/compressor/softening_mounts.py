"""Mounts that soften with their own stroke: one law of rubber for all, each mount at its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.mount_forces import stiffness_of_mounts
from deboom.compressor.mount_shares import mount_shares
from deboom.measurement.inertance_test import freeze_field
from deboom.physics.rigid_body import forward_matrices

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification

REFERENCE_STROKE = 20e-6
"""From which decades are counted, about the middle of what a compressor does [m]."""
SMALLEST_STROKE = 1e-7
"""Below it no rubber softens, and a mount at rest has no logarithm [m]."""
DEVIATIONS = (0.3, 0.3, 0.2)
"""1 σ of change, slope per decade and curvature per decade², real and imaginary part [1]."""


@dataclass(frozen=True, eq=False)
class SofteningMounts:
    """Factor ``1 + δ(s_i)`` on each mount, a parabola over the logarithm of its own stroke s_i.

    Parameters
    ----------
    positions : array, shape (n, 3)
        Of the mounts, from the virtual point [m].
    stiffness : array, shape (n, 6, 6)
        What each of them adds to K_VP [N/m, N/rad, N m/rad].

    Raises
    ------
    InputError
        Shapes that do not fit together.

    Notes
    -----
    ``δ(s) = a + b lg(s/s₀) + c lg²(s/s₀)`` with complex a, b, c common to all mounts: linear in six
    real unknowns and close to the hyperbola of the thesis's eq. 54 and 55 over the one and a half
    decades that a run-up covers; it says nothing outside of them. The stroke is measured, not
    solved for.
    """

    positions: RealArray
    stiffness: RealArray

    def __post_init__(self) -> None:
        n = len(self.positions)
        freeze_field(self, "positions", (n, 3), "softening mounts")
        freeze_field(self, "stiffness", (n, 6, 6), "softening mounts")

    def strokes(self, frequency: RealArray, motion: ComplexArray) -> RealArray:
        """Largest distance of each mount from rest over a turn.

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            [Hz].
        motion : array, shape (n_frequency, 6)
            Acceleration of the virtual point [m/s², rad/s²].

        Returns
        -------
        array, shape (n_frequency, n)
            [m].

        Notes
        -----
        ``|Re(x e^{jφ})|² = (xᴴx + Re(e^{2jφ} xᵀx))/2`` is largest at ``(xᴴx + |xᵀx|)/2``: an
        unbalance drives ellipses, whose root of the sum of squares is up to √2 times as large.
        """
        displacement = motion / (2 * np.pi * frequency[:, np.newaxis]) ** 2
        moved = (displacement @ forward_matrices(self.positions).T).reshape(len(motion), -1, 3)
        squares = np.sum(np.abs(moved) ** 2, axis=2) + np.abs(np.sum(moved**2, axis=2))
        return np.asarray(np.sqrt(squares / 2))

    def matrices(
        self, frequency: RealArray, mounts: ComplexArray, motion: ComplexArray
    ) -> ComplexArray:
        """Scale each mount by its own stroke, shape (6, n_frequency, 6, 6)."""
        over_stroke = _powers(self.strokes(frequency, motion))
        ratio = np.trace(mounts, axis1=1, axis2=2) / np.trace(self.stiffness.sum(axis=0))
        real = np.einsum("f,kfn,nab->kfab", ratio, over_stroke, self.stiffness)
        return np.stack([real, 1j * real], axis=1).reshape(-1, *mounts.shape)

    @property
    def deviations(self) -> RealArray:
        """Of both parts of a, of b and of c."""
        return np.repeat(DEVIATIONS, 2)

    def change_at(self, values: RealArray, stroke: npt.ArrayLike) -> ComplexArray:
        """Change δ of a mount's stiffness.

        Parameters
        ----------
        values : array, shape (6,)
            The unknowns [1].
        stroke : array, any shape
            [m].

        Returns
        -------
        array, shape of `stroke`
            [1].
        """
        numbers = np.asarray(values, dtype=float).view(complex)
        return np.asarray(np.tensordot(numbers, _powers(stroke), axes=1))


def softening_mounts(found: Identification) -> SofteningMounts | None:
    """Share the stiffness that a hammer test found out to the mounts of its drawing.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    SofteningMounts or None
        None without a drawing of at least two mounts: nothing says then what is where.

    Notes
    -----
    Mounts of `mount_shares`, which add up to K_VP within its uncertainty only; ``C K_i Cᵀ`` with
    ``C = L_VP L⁻¹`` of both Cholesky factors makes them add up.
    """
    drawing = found.test.drawing
    if drawing is None or len(drawing.mounts) < 2:
        return None
    mounts = mount_shares(found, drawing.mounts).mounts
    positions = np.array([mount.position for mount in mounts])
    rows = forward_matrices(positions).reshape(len(mounts), 3, 6)
    parts = np.swapaxes(rows, 1, 2) @ stiffness_of_mounts(mounts) @ rows
    whole = np.linalg.cholesky(found.calibrated.model.stiffness)
    fitting = whole @ np.linalg.inv(np.linalg.cholesky(parts.sum(axis=0)))
    return SofteningMounts(positions, fitting @ parts @ fitting.T)


def _powers(stroke: npt.ArrayLike) -> RealArray:
    """Of the decades above `REFERENCE_STROKE`: zeroth, first and second."""
    decades = np.log10(np.maximum(stroke, SMALLEST_STROKE) / REFERENCE_STROKE)
    return np.stack([np.ones_like(decades), decades, decades**2])
