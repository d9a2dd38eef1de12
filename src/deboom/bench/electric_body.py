"""The body of an electric car in modal form, where a compressor and its hoses meet it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.body import Body, CavityMode, cavity_pressure
from deboom.bench.frozen import freeze_arrays

MOUNTS = ("mount 1", "mount 2", "mount 3")
HOSES = ("hose 1", "hose 2")
POINTS = (*MOUNTS, *HOSES)
"""Where the compressor and its hoses meet a body."""

MOTIONS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class ElectricCabin:
    """The air in the cabin: uniform compression and some modes.

    Parameters
    ----------
    bulk_modulus : float
        Of air, ρc² [Pa].
    volume : float
        [m³].
    panel_areas : array, shape (n_panel,)
        Net area with which a panel changes the volume, inwards positive [m²].
    modes : tuple of CavityMode
    """

    bulk_modulus: float
    volume: float
    panel_areas: RealArray
    modes: tuple[CavityMode, ...]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def pressure(self, frequency: RealArray) -> ComplexArray:
        """Return the pressure at the driver's ear per displacement of each panel.

        Parameters
        ----------
        frequency : array, shape (f,)
            [Hz].

        Returns
        -------
        array, shape (f, n_panel)
            [Pa/m].
        """
        return cavity_pressure(
            self.bulk_modulus, self.volume, self.panel_areas, self.modes, frequency
        )


@dataclass(frozen=True, eq=False)
class ElectricCarBody:
    """One electric car without its compressor.

    Parameters
    ----------
    name : str
        Such as ``EV-1``.
    body : Body
        Paths are the six motions of every one of `POINTS`: shapes of rotations in kg^-1/2/m, their
        local stiffness in N m/rad.
    cabin : ElectricCabin
    """

    name: str
    body: Body
    cabin: ElectricCabin

    def noise_transfer(self, frequency: RealArray) -> ComplexArray:
        """Find the pressure at the driver's ear per force and moment at every point.

        Returns
        -------
        array, shape (f, 30)
            [Pa/N], and [Pa/(N m)] for moments.
        """
        per_mode = self.cabin.pressure(frequency) @ self.body.shapes_at_panels.T
        modal = per_mode * self.body.modal_receptance(frequency)
        return np.asarray(modal @ self.body.shapes_at_paths)

    def receptance(self, frequency: RealArray) -> ComplexArray:
        """Find the motion of all points per load at all points: modes and local flexibility.

        Returns
        -------
        array, shape (f, 30, 30)
            [m/N, 1/N, 1/(N m)].
        """
        body, shapes = self.body, self.body.shapes_at_paths
        modal = (shapes.T * body.modal_receptance(frequency)[:, None, :]) @ shapes
        return np.asarray(modal + np.diag(1 / body.local_stiffness))


def columns_of(points: tuple[str, ...], n_motion: int = len(MOTIONS)) -> list[int]:
    """Return the places of some points' first motions among all motions of `POINTS`."""
    return [
        len(MOTIONS) * POINTS.index(point) + motion
        for point in points
        for motion in range(n_motion)
    ]
