"""Sources of uncertainty of a platform: from what was measured of them, or from stated priors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from deboom.errors import InputError
from deboom.measurement.channels import LoadCase
from deboom.measurement.sensors import Tolerances
from deboom.measurement.uncertainty import MethodDifference
from deboom.mounts.characterised_mount import CharacterisedDirection, CharacterisedMount
from deboom.mounts.error_budget import TWO_SIDED
from deboom.mounts.mount import AXES, Mount
from deboom.vehicles.fleet import Band, lines_inside
from deboom.vehicles.uncertain_data import (
    ForceCells,
    MotionError,
    RunNoise,
    StiffnessError,
    TransferBody,
    TransferCalibration,
    TransferFloor,
    TransferPaths,
    UncertaintySource,
)

PRIOR = "stated prior"
LOSS_FACTOR = 0.2
"""Of rubber mounts, for the phase of their stiffness [1]."""

LEAST_VEHICLES = 3
"""Measured in two ways, to know the calibration by their differences."""

UNSTATED = 0.05
"""Standard deviation of an identified stiffness whose library states none [1]."""

CALIBRATION = "calibration of the transfer functions"
PATHS = "transfer functions, path by path"
DAY = "day of the measurement"
FLOOR = "noise floor of the transfer functions"
SHAKER = "stiffness: alignment of the shaker"
BUDGET = "stiffness: rest of the error budget"
MOTION = "motion in the runs"
CELLS = "measured forces: cells and shaker"
NOISE = "noise of the runs"


@dataclass(frozen=True)
class TransferUncertainty:
    """How well noise transfer functions are known; the defaults are judgement.

    - `calibration_db`: level common to all paths of a vehicle, standard deviation [dB].
    - `path`: smooth complex error of every path, root mean square [1].
    - `length`: correlation length [Hz].
    - `day`: smooth complex factor on all paths of a vehicle, on the day it was measured against its
      mean, root mean square [1].
    - `day_length`: correlation length of the day's factor, about the width of a resonance of the
      body [Hz].
    - `floor`: noise of real and of imaginary part [Pa/N].
    - `origin`, `day_origin`: where the numbers come from.
    - `calibration_degrees_of_freedom`, `path_degrees_of_freedom`: degrees of freedom of the
      estimates; infinite where a number is stated.
    """

    calibration_db: float = 0.5
    path: float = 0.05
    length: float = 10.0
    day: float = 0.03
    day_length: float = 3.0
    floor: float = 2e-5
    origin: str = PRIOR
    day_origin: str = PRIOR
    calibration_degrees_of_freedom: float = math.inf
    path_degrees_of_freedom: float = math.inf

    @classmethod
    def of_methods(
        cls, found: MethodDifference, origin: str, *, averaged: bool
    ) -> TransferUncertainty:
        """Take the errors that the difference of two methods shows.

        - `found`: difference of methods that were used on different days: what differs in all paths
          alike counts as the day. Below `LEAST_VEHICLES` the calibration stays the prior.
        - `origin`: name of the vehicles that were compared.
        - `averaged`: whether the functions in use are means of both methods, or those of one: then
          their variances are twice as large.
        """
        prior, scale = cls(), 1.0 if averaged else math.sqrt(2.0)
        enough = found.calibration_degrees_of_freedom >= LEAST_VEHICLES
        return cls(
            calibration_db=scale * found.calibration_db if enough else prior.calibration_db,
            path=scale * found.path,
            length=found.length,
            day=scale * found.body,
            day_length=found.body_length,
            floor=scale * found.floor,
            origin=origin,
            day_origin=origin,
            calibration_degrees_of_freedom=(
                found.calibration_degrees_of_freedom if enough else math.inf
            ),
            path_degrees_of_freedom=found.path_degrees_of_freedom,
        )

    @property
    def sources(self) -> tuple[UncertaintySource, ...]:
        """Each as a source; one of size 0 is left out."""
        found: list[tuple[float, UncertaintySource]] = [
            (
                self.calibration_db,
                TransferCalibration(
                    self.calibration_db,
                    PRIOR if math.isinf(self.calibration_degrees_of_freedom) else self.origin,
                    CALIBRATION,
                    self.calibration_degrees_of_freedom,
                ),
            ),
            (
                self.path,
                TransferPaths(
                    self.path, self.length, self.origin, PATHS, self.path_degrees_of_freedom
                ),
            ),
            (self.day, TransferBody(self.day, self.day_length, self.day_origin, DAY)),
            (self.floor, TransferFloor(self.floor, self.origin, FLOOR)),
        ]
        return tuple(source for size, source in found if size > 0)


@dataclass(frozen=True)
class ForceUncertainty:
    """How well forces and motions of the runs are known.

    - `tolerances`: tolerances of sensors, cells and shaker.
    - `origin`: where they come from.
    """

    tolerances: Tolerances = field(default_factory=Tolerances)
    origin: str = PRIOR


def force_sources(
    mounts: Sequence[Mount],
    load_cases: Sequence[LoadCase],
    parts: Sequence[CharacterisedMount],
    band: Band,
    known: ForceUncertainty | None = None,
) -> tuple[UncertaintySource, ...]:
    """Return what may be wrong with the forces of the runs.

    - `mounts`: mounts of the platform.
    - `load_cases`: load cases with the forces that are used.
    - `parts`: parts whose surfaces the forces come from; empty if all forces were measured.
    - `band` (lower, upper): lines that count, both edges included [Hz].
    - `known`, optional: uncertainty of the measuring chains; by default `Tolerances` as they are.
    - returns: those without any effect are left out.

    A force from a surface is ``K s``: K errs as the library's error budget states, s as one
    triaxial accelerometer at the mount would have it: by its gain, by what its angle and its
    cross-axis sensitivity take from the other axes, and by its place, which in a rotation about the
    centre of gravity counts by place over distance. Of the budget, the share of the shaker's
    alignment is ``θ² Σ_b |F_b/F_a|²`` over the other axes b, at most all of it. A measured force
    errs by the shaker's gain and angle; the motion beside it counts where it is used, in coupled
    motion and in stiffnesses.
    """
    known = known or ForceUncertainty()
    stated, origin = known.tolerances, known.origin
    channels = {
        f"{mount.name} {axis}": mount.channels(axis)
        for mount in mounts
        for axis in AXES
        if set(mount.channels(axis)) <= set(load_cases[0].force.channels)
    }
    surfaces = {d: one for d in channels if (one := _surface(parts, d)) is not None}
    from_surface = tuple(name for d in surfaces for name in channels[d])
    aligned, rest = {}, {}
    for direction, found in surfaces.items():
        total = _stiffness_deviation(found)
        leak = stated.shaker_angle * _leverage(load_cases, channels, direction, band)
        aligned[direction] = min(leak, total)
        rest[direction] = math.sqrt(total**2 - aligned[direction] ** 2)
    budget = "error budget in the mount library"
    measured = tuple(n for names in channels.values() for n in names if n not in from_surface)
    powertrain = [mount for mount in mounts if mount.body_mass is None]
    own = [mount for mount in mounts if mount.body_mass is not None]
    sources: list[UncertaintySource] = []
    if surfaces:
        shared = f"{budget}, its share by {origin}"
        sources += [
            StiffnessError(rest, channels, LOSS_FACTOR, budget, BUDGET),
            StiffnessError(aligned, channels, LOSS_FACTOR, shared, SHAKER),
        ]
    sources.append(_motion(powertrain, own, stated, from_surface, origin))
    if measured:
        calibrated = {f"{m.name} {piece}".strip() for m in powertrain for piece in m.pieces}
        gains = {
            point: stated.shaker_gain if point in calibrated else stated.cell_gain
            for m in mounts
            for piece in m.pieces
            for point in (f"{m.name} {piece}".strip(),)
        }
        angles = {point: stated.shaker_angle if point in calibrated else 0.0 for point in gains}
        sources.append(ForceCells(gains, angles, measured, origin, CELLS))
    sources.append(RunNoise(math.hypot(stated.force_own, stated.acceleration_own), origin, NOISE))
    return tuple(sources)


def tolerances_of_record(stated: Mapping[str, float], default: Tolerances) -> Tolerances:
    """Return the tolerances that a library's campaign was characterised with.

    - `stated`: ``name [unit]`` to standard deviation, SI.
    - `default`: tolerances of what is not stated.
    """
    values = {name.partition(" [")[0]: value for name, value in stated.items()}
    known = {name: values[name] for name in vars(default) if name in values}
    return Tolerances(**{**vars(default), **known})


def _surface(parts: Sequence[CharacterisedMount], direction: str) -> CharacterisedDirection | None:
    """Return the direction of a part whose surface gives the force."""
    mount, _, axis = direction.rpartition(" ")
    for part in parts:
        for one in part.directions if part.mount.name == mount else ():
            if one.axis == axis and one.surface is not None and one.quality.identified:
                return one
    return None


def _stiffness_deviation(direction: CharacterisedDirection) -> float:
    stated = direction.quality.half_width_95
    return UNSTATED if stated is None else stated / TWO_SIDED


def _leverage(
    load_cases: Sequence[LoadCase],
    channels: dict[str, tuple[str, ...]],
    direction: str,
    band: Band,
) -> float:
    """Return how much a radian of the shaker's angle changes the force of a direction [1/rad]."""
    mount, _, axis = direction.rpartition(" ")
    others = [f"{mount} {a}" for a in AXES if a != axis and f"{mount} {a}" in channels]
    squared = []
    for case in load_cases if others else ():
        inside = lines_inside(case.force.frequency, band, f"load case {case.name}")
        own, *beside = (
            np.mean(np.abs(case.force.select(channels[name]).values[inside]) ** 2, axis=1)
            for name in (direction, *others)
        )
        squared.append(float(np.median(sum(beside) / own)))
    return float(np.sqrt(np.mean(squared))) if squared else 0.0


def _motion(
    powertrain: Sequence[Mount],
    own: Sequence[Mount],
    stated: Tolerances,
    from_surface: tuple[str, ...],
    origin: str,
) -> MotionError:
    gain, leakage = {}, {}
    turned = math.hypot(stated.sensor_angle, stated.sensor_cross_axis)
    for mount in (*powertrain, *own):
        for piece, position in zip(mount.pieces, mount.positions, strict=True):
            point = f"{mount.name} {piece}".strip()
            distance = math.hypot(*position)
            moved = 0.0
            if mount in powertrain:
                if distance == 0.0:
                    raise InputError(
                        f"mount {mount.name} sits at the centre of gravity: its motion has no "
                        "lever; check the positions"
                    )
                moved = stated.sensor_position / distance
            gain[point] = math.hypot(stated.sensor_gain, moved)
            leakage[point] = math.hypot(turned, moved)
    return MotionError(gain, leakage, from_surface, origin, MOTION)
