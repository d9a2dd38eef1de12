"""Tests of a compressor: roving hammer on the mounted body, and operation over speed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from enum import Enum
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.culprit import refuse_sheet_faults
from deboom.measurement.driving_points import refuse_other_functions
from deboom.measurement.sensors import Impact, PlacementTolerances, Sensor
from deboom.measurement.virtual_point import impact_geometry, sensor_geometry, virtual_point
from deboom.physics.rigid_body import rotation_matrix

ACCELERATION_PER_FORCE = "(m/s^2)/N"
"""Unit of an inertance at points, as the FRF estimators state it; equal to 1/kg."""

SMALLEST_SENSORS, SMALLEST_IMPACTS = 3, 6
"""Triaxial sensors and impacts that six motions of a body need at least."""
DIFFERENT_MASS = 3.0
"""Ratio of the drawn mass to the weighed one that no oil or bracket makes [1]."""
MUCH_LARGER = 8.0
"""Ratio of a length of the drawing to the spread of the impacts that no body has [1]."""
SLOWEST, FASTEST = 1.0, 300.0
"""Bounce of a compressor on the mounts of its drawing [Hz]."""
DIFFERENT_UNITS = 8.0
"""Ratio of the spread of the sensors to that of the impacts that no hammer test has [1]."""
FARTHEST_MIDDLES = 0.8
"""Distance between the middles of sensors and of impacts over their spread: both go round [1]."""
UNLIKE_MOUNTS = 50.0
"""Ratio of the stiffness of one mount to that of the others that no drawing has [1]."""


@checked(position="3", rotation="3", stiffness="3 >0")
class CompressorMount:
    """One rubber mount: its place, its direction, its three static stiffnesses.

    - `position` (3,): elastic centre, from the virtual point, the origin of the position sheet [m].
    - `rotation` (3,): rotation of the mount's axes about the fixed axes x, then y, then z [rad];
      local x is axial.
    - `stiffness` (3,): static stiffness along the axial and the two radial axes, above 0 [N/m].
    """

    name: str
    position: RealArray
    rotation: RealArray
    stiffness: RealArray

    @property
    def orientation(self) -> RealArray:
        """Rotation matrix, shape (3, 3): columns are the axial and the radial axes [1]."""
        return rotation_matrix(self.rotation)


@checked(centre="3", inertia="3 3")
class Drawing:
    """The body as drawn: where an identification may start.

    - `mass` [kg]; `centre` (3,): centre of gravity, from the virtual point [m].
    - `inertia` (3, 3): inertia about the centre of gravity, products with their sign as matrix
      elements; symmetric, positive definite [kg m²].
    """

    mass: float
    centre: RealArray
    inertia: RealArray
    mounts: tuple[CompressorMount, ...]

    def __post_init__(self) -> None:
        if not np.allclose(self.inertia, self.inertia.T, rtol=1e-6, atol=0):
            raise InputError("drawing: the inertia is not symmetric")
        moments = np.linalg.eigvalsh(self.inertia)
        if moments[0] <= 0:
            raise InputError(
                f"drawing: the inertia has a principal moment of {moments[0]:.3g} kg m², all must "
                "be positive: check signs and units of its entries"
            )


@checked(coherence="f c i")
class InertanceTest:
    """FRFs from every impact to every accelerometer channel, and what is known besides.

    Raises InputError: a line at 0 Hz, a coherence outside 0 to 1.

    - `frf`: outputs are the channels of the sensors in their order, inputs the impacts
      [`ACCELERATION_PER_FORCE`]; no line at 0 Hz.
    - `coherence` (n_frequency, n_channel, n_impact): ordinary coherence of the hits of an impact, 0
      … 1 [1].
    - `weighed_mass`: mass of the body from a pair of scales; None if it was not weighed [kg].
    - `doubts`: sentences on what the hits leave in doubt, such as responses that had not decayed.
    - `assumed`: sentences on what nobody stated and defaults stand in for.
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
    doubts: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.frf.frequency[0] > 0:
            raise InputError(
                "the FRFs have a line at 0 Hz, where accelerometers measure nothing: leave it out"
            )
        check_coherence(self.coherence, self.frf, self.name)


def check_enough(
    sensors: tuple[Sensor, ...], impacts: tuple[Impact, ...], where: str = "a body"
) -> None:
    """Refuse a test that cannot see or excite all six motions of a body."""
    if len(sensors) < SMALLEST_SENSORS:
        raise InputError(
            f"{len(sensors)} triaxial accelerometers do not see all six motions of {where}: use at "
            "least three that are not on a line"
        )
    if len(impacts) < SMALLEST_IMPACTS:
        raise InputError(
            f"{len(impacts)} impacts do not excite all six motions of {where}: use at least six of "
            "different places and directions"
        )


def check_coherence(coherence: RealArray, frf: Frf, name: str) -> None:
    """Refuse a coherence that does not belong to its functions."""
    if coherence.shape != frf.values.shape:
        raise InputError(
            f"{name}: coherence has shape {coherence.shape}, expected {frf.values.shape}"
        )
    if np.any((coherence < 0) | (coherence > 1 + 1e-9)):
        raise InputError(f"{name}: a coherence lies between 0 and 1: this is another function")


def _refuse_unlike_lengths(test: InertanceTest) -> None:
    """Refuse a sheet whose sensors and impacts are not in one unit of length, or of one origin."""
    sensors = spread([sensor.position for sensor in test.sensors])
    impacts = spread([impact.position for impact in test.impacts])
    if not 1 / DIFFERENT_UNITS < sensors / impacts < DIFFERENT_UNITS:
        raise InputError(
            f"{test.name}: the sensors lie {sensors:.3g} m from their middle and the impacts "
            f"{impacts:.3g} m: one of the two is in another unit of length, look at the headers of "
            "the position sheet"
        )
    middles = [
        np.mean([each.position for each in places], axis=0)
        for places in (test.sensors, test.impacts)
    ]
    apart = float(np.linalg.norm(middles[0] - middles[1]))
    if apart > FARTHEST_MIDDLES * max(sensors, impacts):
        raise InputError(
            f"{test.name}: the middles of sensors and impacts lie {apart:.3g} m apart, and the "
            f"points {max(sensors, impacts):.3g} m from their middle: state the positions of both "
            "from one origin in the position sheet"
        )


def _twins(frf: Frf) -> Iterator[str]:
    """Give a sentence for impacts, and for channels, whose functions are the same."""
    for what, names, columns in (
        ("impacts", frf.inputs, np.moveaxis(frf.values, 2, 0)),
        ("channels", frf.outputs, np.moveaxis(frf.values, 1, 0)),
    ):
        owners: dict[bytes, str] = {}
        for name, column in zip(names, columns, strict=True):
            first = owners.setdefault(column.tobytes(), name)
            if first != name:
                yield f"the functions of the {what} {first} and {name} are the same: export each"


def _drawing_faults(test: InertanceTest) -> Iterator[str]:
    """Give a sentence for what a drawing states and no such body has."""
    drawing = test.drawing
    if drawing is None:
        return
    size = spread([impact.position for impact in test.impacts])
    if test.weighed_mass is not None:
        ratio = drawing.mass / test.weighed_mass
        if not 1 / DIFFERENT_MASS < ratio < DIFFERENT_MASS:
            yield (
                f"drawing: the mass is {drawing.mass:g} kg and the scales say "
                f"{test.weighed_mass:g} kg: is one of them in g?"
            )
    moments = np.linalg.eigvalsh(drawing.inertia)
    radius = float(np.sqrt(moments[-1] / drawing.mass))
    if not 1 / MUCH_LARGER < radius / size < MUCH_LARGER:
        yield (
            f"drawing: inertia_kg_m2 has a principal moment of {moments[-1]:.3g} kg m², with the "
            f"mass a radius of gyration of {radius:.3g} m, and the impacts of the position sheet "
            f"lie {size:.3g} m from their middle: is it in kg mm², or the sheet in another unit?"
        )
    centre = float(np.linalg.norm(drawing.centre))
    if centre > MUCH_LARGER * size:
        yield (
            f"drawing: centre_of_gravity_m lies {centre:.3g} m from the origin of the position "
            f"sheet, whose impacts lie {size:.3g} m from their middle: is it in mm?"
        )
    for mount in drawing.mounts:
        off = float(np.linalg.norm(mount.position))
        if off > MUCH_LARGER * size:
            yield (
                f"{mount.name}: position_m lies {off:.3g} m from the origin of the position sheet, "
                f"whose impacts lie {size:.3g} m from their middle: is it in mm?"
            )
    if not drawing.mounts:
        return
    sizes = [float(mount.stiffness.mean()) for mount in drawing.mounts]
    for mount, size in zip(drawing.mounts, sizes, strict=True):
        ratio = size / float(np.median(sizes))
        if not 1.0 / UNLIKE_MOUNTS < ratio < UNLIKE_MOUNTS:
            yield (
                f"drawing: stiffness_n_per_m of {mount.name} is {ratio:.2g} times that of the "
                "other mounts: is one in N/mm and the others in N/m?"
            )
    stiffness = sum(float(mount.stiffness.mean()) for mount in drawing.mounts)
    bounce = float(np.sqrt(stiffness / drawing.mass) / (2.0 * np.pi))
    if not SLOWEST < bounce < FASTEST:
        yield (
            f"mounts of the drawing: with stiffness_n_per_m the body bounces at {bounce:.2g} Hz: "
            "is the stiffness in N/mm or N/m as the key says?"
        )
    turns = np.array([mount.rotation for mount in drawing.mounts])
    degrees = np.abs(np.rad2deg(turns[turns != 0.0]))
    # an eighth or a twelfth of a turn in radians looks like few and odd degrees
    eighths = np.minimum(np.abs(degrees % (np.pi / 4)), np.abs(degrees % (np.pi / 6)))
    steps = np.minimum(eighths, np.minimum(np.pi / 4, np.pi / 6) - eighths)
    if degrees.size and degrees.max() <= 2.001 * np.pi and np.all(np.abs(steps) < 2e-3):
        yield (
            "mounts of the drawing: rotation_deg holds parts of π, such as "
            f"{degrees.max():.4g}: are the angles in radians? State them in degrees"
        )


def refuse_contradictions(test: InertanceTest) -> None:
    """Refuse what is stated and the functions deny: their sign, form and quantity, and the sheet.

    - raises InputError: functions conjugated, reversed, inverted or of another quantity; a channel
      or impact reversed, swapped or exchanged with another, or the same as another; lengths in two
      units.
    """
    _refuse_unlike_lengths(test)
    for sentence in _twins(test.frf):
        raise InputError(f"{test.name}: {sentence}")
    sensors, impacts = sensor_geometry(test.sensors), impact_geometry(test.impacts)
    refuse_other_functions(test.frf, [(sensors, impacts)], test.name)
    refuse_sheet_faults(
        test.frf,
        virtual_point(sensors),
        virtual_point(impacts),
        test.tolerances,
        test.name,
        test.sensors,
    )


def refuse_drawing(test: InertanceTest) -> None:
    """Refuse a drawing that no body has whose position sheet and weight are those of the test.

    - raises InputError: mass, inertia, places, stiffness or angles in another unit.
    """
    sentences = [f"{test.name}: {sentence}" for sentence in _drawing_faults(test)]
    if sentences:
        raise InputError("\n".join(sentences))


def spread(places: Sequence[RealArray]) -> float:
    """Return the mean distance of places (n, 3) from their middle [m]."""
    points = np.array(places)
    return float(np.mean(np.linalg.norm(points - points.mean(axis=0), axis=1)))


class HoseState(Enum):
    """What was joined to the compressor."""

    ABSENT = "absent"
    """Nothing: possible in a hammer test only."""
    STANDARD = "standard"
    """The hoses of the vehicle."""
    SOFT = "soft"
    """Long soft hoses with masses on them, which cut the path through the hoses."""


@checked(deviation="f c")
class OperatingSweep:
    """First order of one run-up of a running compressor at one `pressure` at its outlet [Pa].

    - `acceleration`: one line per rotational frequency, channels of the accelerometers on the
      compressor; complex peak, the phase from the pulse of the tacho, which stands at the rotor's y
      axis [m/s^2].
    - `deviation` (n_frequency, n_channel): standard deviation of the real and of the imaginary part
      of `acceleration`, above 0 [m/s^2].
    - `holder`: the same of triaxial accelerometers on the body side of the mounts, ``<mount> x`` …
      [m/s^2]; None where there were none.
    """

    name: str
    hoses: HoseState
    pressure: float
    acceleration: Spectrum
    deviation: RealArray
    holder: Spectrum | None = None
    sound: Spectrum | None = None

    @property
    def frequency(self) -> RealArray:
        """Frequency of the rotation, shape (n_frequency,) [Hz]."""
        return self.acceleration.frequency

    @property
    def speed(self) -> RealArray:
        """Speed of the rotation, shape (n_frequency,) [1/min]."""
        return np.asarray(60.0 * self.frequency)


@checked(position="3", direction="3")
class HoseDrawing:
    """A hose as drawn and catalogued: a straight uniform beam from the compressor to the body.

    - `position` (3,): port on the compressor, from the virtual point [m].
    - `direction` (3,): from the port to the body, of any length but 0, else InputError.
    - `tension`, `torsion`, `bending`: EA [N], GJ and EI [N m²], as a supplier may state them: start
      values.
    """

    name: str
    position: RealArray
    direction: RealArray
    length: float
    tension: float
    torsion: float
    bending: float
    line_mass: float
    loss_factor: float
    torsion_radius: float

    def __post_init__(self) -> None:
        if not np.linalg.norm(self.direction) > 0:
            raise InputError(f"{self.name}: the direction has no length")


@checked(sweeps="some distinct")
class OperatingTest:
    """One compressor: struck without hoses, perhaps with them, and run.

    - `hammer_with_hoses`: test with the standard hoses, compressor off; same sensors and impacts.
    - `sweeps`: at least one sweep, with the accelerometers of the hammer test.
    - `rotor_inertia`: polar moment of the rotor, from its data sheet [kg m²]; None where not known.
    - `sound_deviation`: microphone → standard deviation of the real and of the imaginary part of
      its tracked pressures, by noise of cabin and microphone; 0 where none is stated [Pa].
    """

    name: str
    hammer: InertanceTest
    hammer_with_hoses: InertanceTest | None
    sweeps: tuple[OperatingSweep, ...]
    rotor_inertia: float | None = None
    hoses: tuple[HoseDrawing, ...] = ()
    input_files: tuple[Path, ...] = ()
    sound_deviation: Mapping[str, float] = field(default_factory=dict)

    def with_hoses(self, state: HoseState) -> tuple[OperatingSweep, ...]:
        """Sweeps with these hoses, in their order."""
        return tuple(sweep for sweep in self.sweeps if sweep.hoses is state)
