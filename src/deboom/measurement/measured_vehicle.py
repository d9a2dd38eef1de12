"""A vehicle as it was measured: noise transfer functions both ways, runs on the road, paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import MeasuredMount
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.driving_points import refuse_other_functions
from deboom.measurement.modal import PanelMeasurement
from deboom.measurement.noise_transfer import (
    noise_transfer_at_points,
    noise_transfer_of_paths,
    reciprocal_noise_transfer,
)
from deboom.measurement.quality import HALFWAY, likeness
from deboom.measurement.sensors import SENSOR_AXES, Impact, PlacementTolerances, Sensor
from deboom.measurement.virtual_point import (
    ChannelGeometry,
    conditioning,
    impact_geometry,
    sensor_geometry,
    virtual_point,
)
from deboom.physics.frf import msf

UNLIKE_ENOUGH, BETTER = 0.15, 3.0
"""Loudspeaker and hammer agree once what is named is undone if no more of the likeness is missing
than this, and this many times less than before [1]."""


class Method(Enum):
    """How noise transfer functions were acquired: hammer or loudspeaker."""

    DIRECT = "direct"
    RECIPROCAL = "reciprocal"


@dataclass(frozen=True, eq=False)
class VehicleRun:
    """One run of a vehicle: spectra over its engine order.

    - `pressure`, `acceleration`: pressure at the ears [Pa], and all accelerometers in sensor axes
      [m/s²], complex peak.
    - `engine_torque` (n_frequency,), optional: at every line [N m]; None: not recorded.
    """

    name: str
    gear: int
    total_ratio: float
    torque_limit: float
    order: float
    pressure: Spectrum
    acceleration: Spectrum
    engine_torque: RealArray | None = None


@dataclass(frozen=True, eq=False)
class MeasuredVehicle:
    """Everything measured on one vehicle.

    - `body_sensors`, `impacts`: point (``TSM``, ``Du left``) to the accelerometers and the blows on
      the body around it.
    - `source_sensors`: sensors on the other side of the mounts: powertrain, wheel ends.
    - `powertrain_mounts`: mounts whose source side is the one rigid powertrain; every other piece
      has a source sensor of its own.
    - `tolerances`: of sensors, hammer and their places; `assumed`: sentence on those that nobody
      stated and defaults stand in for.
    """

    name: str
    group: str
    ears: tuple[str, ...]
    mounts: tuple[MeasuredMount, ...]
    body_sensors: Mapping[str, tuple[Sensor, ...]]
    source_sensors: tuple[Sensor, ...]
    powertrain_mounts: tuple[str, ...]
    impacts: Mapping[str, tuple[Impact, ...]]
    direct: Frf
    reciprocal: Frf
    accelerance: Frf | None
    runs: tuple[VehicleRun, ...]
    panels: PanelMeasurement | None = None
    tolerances: PlacementTolerances = field(default_factory=PlacementTolerances)
    assumed: tuple[str, ...] = ()

    @property
    def points(self) -> tuple[str, ...]:
        """Every mount, or every piece of it, such as ``TSM``, ``Du left``."""
        return tuple(self._positions())

    def position(self, point: str) -> tuple[float, float, float]:
        """Return the virtual point of a mount or piece [m]."""
        positions = self._positions()
        if point not in positions:
            raise InputError(
                f"vehicle {self.name}: no point '{point}', there are {list(positions)}"
            )
        return positions[point]

    def _positions(self) -> dict[str, tuple[float, float, float]]:
        return {
            f"{mount.name} {piece}".strip(): position
            for mount in self.mounts
            for piece, position in zip(mount.pieces, mount.positions, strict=True)
        }

    def geometry(self, point: str, method: Method) -> ChannelGeometry:
        """Return the blows, or the body accelerometers, around a point."""
        position = self.position(point)
        if method is Method.DIRECT:
            return impact_geometry(self.impacts.get(point, ()), position)
        return sensor_geometry(self.body_sensors.get(point, ()), position)

    def run(self, name: str) -> VehicleRun:
        """Return a run by its name; an unknown one raises InputError."""
        for run in self.runs:
            if run.name == name:
                return run
        raise InputError(
            f"vehicle {self.name}: no run '{name}', there are {[run.name for run in self.runs]}"
        )


def point_noise_transfer(
    vehicle: MeasuredVehicle, method: Method, points: Sequence[str] | None = None
) -> Frf:
    """Return the noise transfer functions of six loads at virtual points, by default all.

    Outputs are the ears, inputs ``<point> x y z`` [Pa/N] and ``mx my mz`` [Pa/(N m)].
    """
    measured = (
        vehicle.direct if method is Method.DIRECT else reciprocal_noise_transfer(vehicle.reciprocal)
    )
    wanted = vehicle.points if points is None else points
    return noise_transfer_at_points(
        measured, {point: vehicle.geometry(point, method) for point in wanted}
    )


def path_noise_transfer(vehicle: MeasuredVehicle, method: Method, ear: str) -> Frf:
    """Return one noise transfer function per path ``<mount> <axis>`` at one ear [Pa/N]."""
    points = point_noise_transfer(vehicle, method)
    return noise_transfer_of_paths(points, piece_paths(vehicle.mounts), ear)


@dataclass(frozen=True)
class _OtherSource:
    """What makes loudspeaker functions unlike hammer functions: a factor ``±(jω)^n``, or Y*."""

    sign: int
    power: int
    conjugated: bool
    words: str

    def undone(self, values: ComplexArray, omega: RealArray) -> ComplexArray:
        """Return functions (f, ...) without it."""
        factor = self.sign * (1j * omega) ** float(-self.power)
        values = values.conj() if self.conjugated else values
        return np.asarray(values * factor.reshape(-1, *(1,) * (values.ndim - 1)))


_POWERS = {
    1: "factor jω: volume velocity, stated as volume acceleration",
    2: "factor (jω)²: volume displacement, stated as volume acceleration",
    -1: "factor 1/jω: velocity of the body, stated as acceleration",
    -2: "factor 1/(jω)²: displacement of the body, stated as acceleration",
}
_OTHER_SOURCES = (
    _OtherSource(
        -1, 0, False, "polarity reversed: of the loudspeaker, the microphone or the hammer"
    ),
    _OtherSource(1, 0, True, "conjugated: either hammer or loudspeaker follows exp(−jωt)"),
    *(_OtherSource(1, power, False, words) for power, words in _POWERS.items()),
    *(
        _OtherSource(-1, power, False, f"{words}; and polarity reversed")
        for power, words in _POWERS.items()
    ),
)


def refuse_contradictions_of_vehicle(vehicle: MeasuredVehicle) -> None:
    """Refuse functions whose sign, convention or quantity other functions of the vehicle deny.

    - raises InputError: accelerances that no body has at its driving points, see
      `driving_points.refuse_other_functions`; loudspeaker functions that agree with those of the
      hammer, in phase as well, only without a factor such as ``−1``, ``jω`` or 9.81, or conjugated.

    Only points whose blows and sensors determine six loads and motions are compared; functions that
    agree in neither way are left to the study that compares them.
    """
    points = [
        point
        for point in vehicle.points
        if all(
            geometry.channels and conditioning(geometry).complete
            for geometry in (vehicle.geometry(point, method) for method in Method)
        )
    ]
    if vehicle.accelerance is not None:
        bodies = [
            (vehicle.geometry(point, Method.RECIPROCAL), vehicle.geometry(point, Method.DIRECT))
            for point in points
        ]
        whose = f"accelerance of vehicle {vehicle.name}"
        refuse_other_functions(vehicle.accelerance, bodies, whose)
    if not points:
        return
    direct, reciprocal = (point_noise_transfer(vehicle, method, points) for method in Method)
    frequency, *rows = np.intersect1d(direct.frequency, reciprocal.frequency, return_indices=True)
    rows = [lines[frequency > 0] for lines in rows]
    omega = 2 * np.pi * frequency[frequency > 0]
    forces = [name for name in direct.inputs if name.rpartition(" ")[2] in SENSOR_AXES]
    for ear in vehicle.ears:
        struck, heard = (
            each.select((ear,), forces).values[lines, 0]
            for each, lines in zip((direct, reciprocal), rows, strict=True)
        )
        unlike = 1.0 - _alike(struck, heard)
        if unlike <= 1.0 - HALFWAY:
            continue
        undone = [(each.words, each.undone(heard, omega)) for each in _OTHER_SOURCES]
        scale = float(np.median(np.abs(msf(heard, struck))))
        if scale > 0:
            words = f"a factor of {scale:.3g}: unit or calibration, such as g for m/s²"
            undone.append((words, heard / scale))
        tried = [(1.0 - _alike(struck, values), words) for words, values in undone]
        least, likely = min(tried)
        if least < UNLIKE_ENOUGH and BETTER * least < unlike:
            raise InputError(
                f"vehicle {vehicle.name}: at the {ear} the functions of loudspeaker and hammer "
                f"have a likeness of {1 - unlike:.2f}, and of {1 - least:.2f} once this is undone "
                f"in the loudspeaker's: {likely}; correct it where they are exported"
            )


def _alike(first: ComplexArray, second: ComplexArray) -> float:
    """Median likeness over the columns, each over all lines: 0 opposite, 0.5 unrelated, 1 equal."""
    return float(np.median(likeness(first, second, axis=0))) if first.size else 1.0


def piece_paths(mounts: Sequence[MeasuredMount]) -> dict[str, tuple[str, ...]]:
    """Return the paths ``<mount> <axis>`` into a body with their pieces, for all transfer axes."""
    return {
        f"{mount.name} {axis}": mount.channels(axis)
        for mount in mounts
        for axis in mount.transfer_axes
    }


def path_accelerance(vehicle: MeasuredVehicle) -> Frf:
    """Return what the body's sensors show of a force at every path, source removed [(m/s²)/N].

    Outputs are the channels of all body sensors, inputs the pieces of `piece_paths`: the matrix of
    `path_forces.forces_by_inversion`. Raises InputError: accelerometers that were not recorded in
    the hammer test, or a path without blows around it.

    Blows around a mount are referred to its virtual point by least squares, ``Y_VP = Y (U⁺)ᵀ``. Its
    moments are found and left out: mounts pass forces on.
    """
    measured = vehicle.accelerance
    if measured is None:
        raise InputError(
            f"vehicle {vehicle.name}: the accelerometers were not recorded in its hammer test, so "
            "no force can be found by inversion: use the stiffness of the mounts"
        )
    wanted = [piece for pieces in piece_paths(vehicle.mounts).values() for piece in pieces]
    at_points = {}
    for point in dict.fromkeys(piece.rpartition(" ")[0] for piece in wanted):
        excitation = virtual_point(vehicle.geometry(point, Method.DIRECT))
        blows = measured.select(inputs=excitation.channels).values
        at_points[point] = blows @ excitation.inverse.T
    columns = [
        at_points[point][:, :, SENSOR_AXES.index(axis)]
        for point, _, axis in (piece.rpartition(" ") for piece in wanted)
    ]
    values = np.stack(columns, axis=2)
    return replace(measured, values=values, inputs=tuple(wanted))


def path_receptance(vehicle: MeasuredVehicle) -> Frf:
    """Return the receptance of the body at the pieces of its paths, source removed [m/N].

    Outputs and inputs are the pieces of `piece_paths`. Accelerances of the hammer test are referred
    to the virtual points on both sides: blows as in `path_accelerance`, sensors by least squares.
    ``Y = −A/ω²``, of which the symmetric part is kept: a body is reciprocal. Raises InputError as
    `path_accelerance` does.
    """
    measured = path_accelerance(vehicle)
    at_points = {}
    for point in dict.fromkeys(piece.rpartition(" ")[0] for piece in measured.inputs):
        sensed = virtual_point(vehicle.geometry(point, Method.RECIPROCAL))
        at_points[point] = sensed.inverse @ measured.select(outputs=sensed.channels).values
    rows = [
        at_points[point][:, SENSOR_AXES.index(axis)]
        for point, _, axis in (piece.rpartition(" ") for piece in measured.inputs)
    ]
    squared = (2.0 * np.pi * measured.frequency[:, np.newaxis, np.newaxis]) ** 2
    values = -np.stack(rows, axis=1) / squared
    reciprocal = (values + values.swapaxes(1, 2)) / 2.0
    return Frf(measured.frequency, reciprocal, measured.inputs, measured.inputs, "m/N")


def summed_over_pieces(force: Spectrum, paths: Mapping[str, Sequence[str]]) -> Spectrum:
    """Add the forces of the pieces that share a path, from `piece_paths` [N].

    For noise transfer functions per newton of the summed force. A piece without force raises
    InputError; further channels are not looked at.
    """
    for path, pieces in paths.items():
        missing = [piece for piece in pieces if piece not in force.channels]
        if missing:
            raise InputError(f"path {path} has no force of {missing}, there are {force.channels}")
    columns = [force.select(pieces).values.sum(axis=1) for pieces in paths.values()]
    return Spectrum(force.frequency, np.column_stack(columns), tuple(paths), force.unit)
