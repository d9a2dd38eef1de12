"""Sources of uncertainty of a platform: from what was measured of them, or from stated priors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from deboom.arrays import AXES
from deboom.errors import InputError
from deboom.measurement.channels import Band, LoadCase, lines_inside
from deboom.measurement.sensors import Tolerances
from deboom.measurement.uncertainty import MethodDifference
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.error_budget import TWO_SIDED
from deboom.mounts.mount import Mount
from deboom.vehicles.uncertain_data import (
    BUDGET,
    SHAKER,
    UncertaintySource,
    force_cells,
    motion_error,
    run_noise,
    stiffness_error,
    transfer_body,
    transfer_calibration,
    transfer_floor,
    transfer_paths,
)

PRIOR = "stated prior"

PRIOR_DIFFERENCE = MethodDifference(
    calibration_db=0.5,
    calibration_degrees_of_freedom=math.inf,
    body=0.03,
    body_length=3.0,
    path=0.05,
    path_degrees_of_freedom=math.inf,
    length=10.0,
    floor=2e-5,
)
"""How well noise transfer functions are known where nothing says it; by judgement."""

LEAST_VEHICLES = 3
"""Fewest vehicles, each measured in two ways, whose differences tell the calibration."""

UNSTATED = 0.05
"""Standard deviation of an identified stiffness whose library states none [1]."""


def transfer_sources(
    difference: MethodDifference = PRIOR_DIFFERENCE, origin: str = PRIOR, *, averaged: bool = True
) -> tuple[UncertaintySource, ...]:
    """Return what may be wrong with noise transfer functions; a source of size 0 is left out.

    - `difference`: difference of methods that were used on different days: what differs in
      all paths alike counts as the day. Below `LEAST_VEHICLES` the calibration stays the prior.
    - `origin`: name of the vehicles that were compared.
    - `averaged`: whether the functions in use are means of both methods, or those of one: then
      their variances are twice as large.
    """
    scale = 1.0 if averaged else math.sqrt(2.0)
    calibration = PRIOR, PRIOR_DIFFERENCE.calibration_db, math.inf
    if LEAST_VEHICLES <= difference.calibration_degrees_of_freedom < math.inf:
        freedom = difference.calibration_degrees_of_freedom
        calibration = origin, scale * difference.calibration_db, freedom
    path, day, floor = scale * difference.path, scale * difference.body, scale * difference.floor
    sources = [
        (calibration[1], transfer_calibration(*calibration)),
        (path, transfer_paths(origin, path, difference.length, difference.path_degrees_of_freedom)),
        (day, transfer_body(origin, day, difference.body_length)),
        (floor, transfer_floor(origin, floor)),
    ]
    return tuple(source for size, source in sources if size > 0)


def force_sources(
    mounts: Sequence[Mount],
    load_cases: Sequence[LoadCase],
    parts: Sequence[CharacterisedMount],
    band: Band,
    tolerances: Tolerances | None = None,
    origin: str = PRIOR,
) -> tuple[UncertaintySource, ...]:
    """Return what may be wrong with the forces of the runs.

    - `mounts`: mounts of the platform.
    - `load_cases`: load cases with the forces that are used.
    - `parts`: parts whose surfaces the forces come from; empty if all forces were measured.
    - `band` (lower, upper): lines that count, both edges included [Hz].
    - `tolerances`, optional: of sensors, cells and shaker; by default `Tolerances` as they are.
    - `origin`: where they come from.
    - raises InputError: a mount at the centre of gravity.

    A force from a surface is ``K s``: K errs as the library's error budget states, s as one
    triaxial accelerometer at the mount would have it: by its gain, by what its angle and its
    cross-axis sensitivity take from the other axes, and by its place, which in a rotation about the
    centre of gravity counts by place over distance. Of the budget, the share of the shaker's
    alignment is ``θ² Σ_b |F_b/F_a|²`` over the other axes b, at most all of it. A measured force
    errs by the shaker's gain and angle, that of a wheel end by its cell's gain; the motion beside
    it counts where it is used, in coupled motion and in stiffnesses.
    """
    stated = tolerances or Tolerances()
    channels = {
        f"{mount.name} {axis}": mount.channels(axis)
        for mount in mounts
        for axis in AXES
        if set(mount.channels(axis)) <= set(load_cases[0].force.channels)
    }
    identified = {
        f"{part.mount.name} {direction.axis}": direction
        for part in parts
        for direction in part.directions
        if direction.quality.identified
    }
    surfaces = {name: identified[name] for name in channels if name in identified}
    from_surface = tuple(name for direction in surfaces for name in channels[direction])
    aligned, rest = {}, {}
    for name, direction in surfaces.items():
        width = direction.quality.half_width_95
        total = UNSTATED if width is None else width / TWO_SIDED
        leak = stated.shaker_angle * _leverage(load_cases, channels, name, band)
        aligned[name] = min(leak, total)
        rest[name] = math.sqrt(total**2 - aligned[name] ** 2)
    budget = "error budget in the mount library"
    measured = tuple(n for names in channels.values() for n in names if n not in from_surface)
    sources: list[UncertaintySource] = []
    if surfaces:
        shared = f"{budget}, its share by {origin}"
        sources += [
            stiffness_error(BUDGET, budget, rest, channels),
            stiffness_error(SHAKER, shared, aligned, channels),
        ]
    motion_gain, leakage, cell_gain, angle = {}, {}, {}, {}
    turned = math.hypot(stated.sensor_angle, stated.sensor_cross_axis)
    for mount in mounts:
        carries = mount.carries_powertrain
        for piece, position in zip(mount.pieces, mount.positions, strict=True):
            point, distance = f"{mount.name} {piece}".strip(), math.hypot(*position)
            if carries and distance == 0.0:
                raise InputError(
                    f"mount {mount.name} sits at the centre of gravity: its motion has no lever; "
                    "check the positions"
                )
            moved = stated.sensor_position / distance if carries else 0.0
            motion_gain[point] = math.hypot(stated.sensor_gain, moved)
            leakage[point] = math.hypot(turned, moved)
            cell_gain[point] = stated.shaker_gain if carries else stated.cell_gain
            angle[point] = stated.shaker_angle if carries else 0.0
    sources.append(motion_error(origin, motion_gain, leakage, from_surface))
    if measured:
        sources.append(force_cells(origin, cell_gain, angle, measured))
    sources.append(run_noise(origin, math.hypot(stated.force_own, stated.acceleration_own)))
    return tuple(sources)


def tolerances_of_record(stated: Mapping[str, float], default: Tolerances) -> Tolerances:
    """Return the tolerances that a library's campaign was characterised with.

    - `stated`: ``name [unit]`` to standard deviation, SI.
    - `default`: tolerances of what is not stated.
    """
    values = {name.partition(" [")[0]: value for name, value in stated.items()}
    recorded = {name: values[name] for name in vars(default) if name in values}
    return Tolerances(**{**vars(default), **recorded})


def _leverage(
    load_cases: Sequence[LoadCase],
    channels: dict[str, tuple[str, ...]],
    direction: str,
    band: Band,
) -> float:
    """Return by what part a radian of the shaker's angle changes a direction's force [1/rad]."""
    mount, _, axis = direction.rpartition(" ")
    others = [f"{mount} {a}" for a in AXES if a != axis and f"{mount} {a}" in channels]
    squared = []
    for case in load_cases if others else ():
        inside = lines_inside(case.force.frequency, band, f"load case {case.name}")
        of_path, *beside = (
            np.mean(np.abs(case.force.select(channels[name]).values[inside]) ** 2, axis=1)
            for name in (direction, *others)
        )
        squared.append(float(np.median(sum(beside) / of_path)))
    return float(np.sqrt(np.mean(squared))) if squared else 0.0
