"""Where the mounts ride under the torque of each line, for many designs in little time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial import chebyshev

from deboom.arrays import RealArray
from deboom.vehicles.kinematic_model import KinematicModel

NODES = 16
"""Wheel torques at which a design's equilibrium is solved; between them it is interpolated."""

STEPS = 1001
"""Torques at which nominal deflections are tabulated, for the way back to the torque."""


@dataclass(frozen=True, eq=False)
class StaticPosition:
    """Static deflections over the lines of a run.

    Parameters
    ----------
    model : KinematicModel
        Powertrain on the quasi-static curves of its mounts.
    nodes : array, shape (n_node,)
        Wheel torques that are solved [N m].
    to_lines : array, shape (n_frequency, n_node)
        Interpolates from them to the lines [1].
    torque : array, shape (n_step,)
        Increasing [N m].
    nominal : array, shape (n_step, n_direction)
        Deflections with factor 1 there [m].

    Notes
    -----
    Polynomial through Chebyshev's points; with 16 of them the tangent stiffness at the interpolated
    deflections is within 1e-3 of that at the solved ones.
    """

    model: KinematicModel
    nodes: RealArray
    to_lines: RealArray
    torque: RealArray
    nominal: RealArray

    @classmethod
    def of(cls, model: KinematicModel, torque: RealArray, highest: float) -> StaticPosition:
        """Prepare the lines of a run.

        Parameters
        ----------
        model : KinematicModel
            Powertrain on its mounts.
        torque : array, shape (n_frequency,)
            Wheel torque of each line, above 0 [N m].
        highest : float
            Torque up to which deflections are turned back into torques [N m]; larger ones only
            read as larger.

        Raises
        ------
        InputError
            A torque that needs more deflection than a curve was measured to.
        """
        low, high = float(torque.min()), float(torque.max())
        half = (high - low) / 2
        n = NODES if half > 0 else 1
        points = np.cos(np.pi * (np.arange(n) + 0.5) / n)
        scaled = (torque - (low + high) / 2) / (half or 1.0)
        from_nodes = np.linalg.inv(chebyshev.chebvander(points, n - 1))
        to_lines: RealArray = chebyshev.chebvander(scaled, n - 1) @ from_nodes
        steps = np.linspace(0.0, 1.1 * highest, STEPS)
        nominal = model.equilibrium(steps).deflection
        nodes = (low + high) / 2 + half * points
        return cls(model, nodes, to_lines, steps, nominal)

    @property
    def rises(self) -> npt.NDArray[np.bool_]:
        """Directions whose deflection goes one way as the torque grows, shape (n_direction,)."""
        steps = np.diff(self.nominal, axis=0)
        return np.asarray((steps > 0).all(axis=0) | (steps < 0).all(axis=0))

    def deflection(self, factors: RealArray) -> RealArray:
        """Deflections of designs whose directions have `factors` (n, n_direction).

        Returns
        -------
        array, shape (n, n_frequency, n_direction)
            [m].

        Raises
        ------
        InputError
            A design that sinks further than a curve was measured to.
        """
        return np.asarray(self.to_lines @ self.model.deflections(self.nodes, factors))

    def nominal_deflection(self, torque: RealArray) -> RealArray:
        """Nominal deflections at wheel torques (..., n_direction), one per direction [m]."""
        columns = [
            np.interp(torque[..., k], self.torque, self.nominal[:, k])
            for k in range(self.nominal.shape[1])
        ]
        return np.stack(columns, axis=-1)

    def nominal_torque(self, deflection: RealArray) -> RealArray:
        """Wheel torques at which each direction rides at `deflection` (..., n_direction) [N m]."""
        columns = []
        for k, column in enumerate(self.nominal.T):
            side = 1.0 if column[-1] > column[0] else -1.0
            columns.append(np.interp(side * deflection[..., k], side * column, self.torque))
        return np.stack(columns, axis=-1)

    def slope(self, deflection: RealArray) -> RealArray:
        """Slope of the quasi-static curve at `deflection` (..., n_direction) [N/m]."""
        curves = self.model.springs
        return np.stack([c.slope(deflection[..., k]) for k, c in enumerate(curves)], axis=-1)
