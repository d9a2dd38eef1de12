"""A roving-hammer test on a mounted body: FRFs, position sheet, what is known besides."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.impacts import Impact
from deboom.measurement.placement_tolerances import PlacementTolerances
from deboom.measurement.sensors import Sensor
from deboom.physics.rigid_body import rotation_matrix

ACCELERATION_PER_FORCE = "(m/s^2)/N"
"""Unit of an inertance at points, as the FRF estimators state it; equal to 1/kg."""

SMALLEST_SENSORS, SMALLEST_IMPACTS = 3, 6


@dataclass(frozen=True, eq=False)
class CompressorMount:
    """One rubber mount: its place, its direction, its three static stiffnesses.

    Parameters
    ----------
    name : str
        Such as ``mount 1``.
    position : array, shape (3,)
        Elastic centre, from the virtual point, the origin of the position sheet [m].
    rotation : array, shape (3,)
        Of the mount's axes about the fixed axes x, then y, then z [rad]; local x is axial.
    stiffness : array, shape (3,)
        Static, along the axial and the two radial axes [N/m].

    Raises
    ------
    InputError
        Not three finite numbers, or a stiffness that is not positive.
    """

    name: str
    position: RealArray
    rotation: RealArray
    stiffness: RealArray

    def __post_init__(self) -> None:
        for field in ("position", "rotation", "stiffness"):
            freeze_field(self, field, (3,), self.name)
        if np.any(self.stiffness <= 0):
            raise InputError(f"{self.name}: a static stiffness must be positive")

    @property
    def orientation(self) -> RealArray:
        """Rotation matrix, shape (3, 3): columns are the axial and the radial axes [1]."""
        return rotation_matrix(self.rotation)


@dataclass(frozen=True, eq=False)
class Drawing:
    """The body as drawn: where an identification may start.

    Parameters
    ----------
    mass : float
        [kg].
    centre : array, shape (3,)
        Centre of gravity, from the origin of the position sheet [m].
    inertia : array, shape (3, 3)
        About the centre of gravity, products with their sign as matrix elements [kg m²].
    mounts : tuple of CompressorMount

    Raises
    ------
    InputError
        Shapes, a mass that is not positive, an inertia that is not symmetric or not positive.
    """

    mass: float
    centre: RealArray
    inertia: RealArray
    mounts: tuple[CompressorMount, ...]

    def __post_init__(self) -> None:
        freeze_field(self, "centre", (3,), "drawing")
        freeze_field(self, "inertia", (3, 3), "drawing")
        if not self.mass > 0:
            raise InputError(f"drawing: the mass is {self.mass:g} kg, it must be positive")
        if not np.allclose(self.inertia, self.inertia.T, rtol=1e-6, atol=0):
            raise InputError("drawing: the inertia is not symmetric")
        moments = np.linalg.eigvalsh(self.inertia)
        if moments[0] <= 0:
            raise InputError(
                f"drawing: the inertia has a principal moment of {moments[0]:.3g} kg m², all must "
                "be positive: check signs and units of its entries"
            )


@dataclass(frozen=True, eq=False)
class InertanceTest:
    """FRFs from every impact to every accelerometer channel, and what is known besides.

    Parameters
    ----------
    name : str
        Title of the test.
    sensors : tuple of Sensor
        Triaxial accelerometers of the position sheet.
    impacts : tuple of Impact
        Of the position sheet.
    frf : Frf
        Outputs are the channels of the sensors in their order, inputs the impacts
        [`ACCELERATION_PER_FORCE`].
    coherence : array, shape (n_frequency, n_channel, n_impact)
        Ordinary, of the hits of an impact [1].
    n_averages : int
        Hits per impact, the fewest where they differ.
    tolerances : PlacementTolerances
        What gains, positions and angles are stated with.
    weighed_mass : float or None
        Of the body from a pair of scales; None if it was not weighed [kg].
    weighed_mass_deviation : float
        1 σ; 0 if it was not weighed [kg].
    drawing : Drawing or None
        None where there is none.
    input_files : tuple of Path
        Every file that was read.

    Raises
    ------
    InputError
        Too few sensors or impacts for the six motions of a body, names or shapes that do not fit
        together, a line at 0 Hz, a coherence outside 0 to 1, a mass without its deviation.
    """

    name: str
    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]
    frf: Frf
    coherence: RealArray
    n_averages: int
    tolerances: PlacementTolerances
    weighed_mass: float | None = None
    weighed_mass_deviation: float = 0.0
    drawing: Drawing | None = None
    input_files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        check_enough(self.sensors, self.impacts)
        channels = tuple(name for sensor in self.sensors for name in sensor.channels)
        if self.frf.outputs != channels:
            raise InputError("the FRFs' outputs are not the channels of the position sheet")
        if self.frf.inputs != tuple(impact.name for impact in self.impacts):
            raise InputError("the FRFs' inputs are not the impacts of the position sheet")
        if self.frf.unit != ACCELERATION_PER_FORCE:
            raise InputError(
                f"the FRFs are in '{self.frf.unit}', an inertance is in {ACCELERATION_PER_FORCE}"
            )
        if not self.frf.frequency[0] > 0:
            raise InputError(
                "the FRFs have a line at 0 Hz, where accelerometers measure nothing: leave it out"
            )
        freeze_field(self, "coherence", self.frf.values.shape, "coherence")
        if np.any((self.coherence < 0) | (self.coherence > 1 + 1e-9)):
            raise InputError("a coherence lies between 0 and 1: this is another function")
        if self.n_averages < 1:
            raise InputError(f"{self.n_averages} hits per impact: an FRF needs at least one")
        if self.weighed_mass is not None and not (
            self.weighed_mass > 0
            and self.weighed_mass_deviation > 0
            and math.isfinite(self.weighed_mass + self.weighed_mass_deviation)
        ):
            raise InputError("a weighed mass and its deviation must be positive")


def check_enough(sensors: tuple[Sensor, ...], impacts: tuple[Impact, ...]) -> None:
    """Refuse a test that cannot see or excite all six motions of a body.

    Raises
    ------
    InputError
        Fewer than three triaxial sensors or six impacts.
    """
    if len(sensors) < SMALLEST_SENSORS:
        raise InputError(
            f"{len(sensors)} triaxial accelerometers do not see all six motions of a body: use at "
            "least three that are not on a line"
        )
    if len(impacts) < SMALLEST_IMPACTS:
        raise InputError(
            f"{len(impacts)} impacts do not excite all six motions of a body: use at least six of "
            "different places and directions"
        )


def freeze_field(owner: object, field: str, shape: tuple[int, ...], who: str) -> None:
    """Replace an array field by a checked, read-only copy."""
    array = np.array(getattr(owner, field), dtype=float)
    if array.shape != shape:
        raise InputError(f"{who}: {field} has shape {array.shape}, expected {shape}")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{who}: {field} holds a value that is not finite")
    array.setflags(write=False)
    object.__setattr__(owner, field, array)
