"""Characterised mounts in other runs: forces from response surfaces, static state elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_filter

from deboom.arrays import AXES, BoolArray, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount, in_mount_axes, in_vehicle_axes
from deboom.mounts.operating_map import OperatingMap, Preload
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points

SMOOTH_WIDTH = 5.0
"""Width over which a run's static force is smoothed: the torque changes more slowly [Hz]."""


class Outside(Enum):
    """Treatment of lines outside of the region that a surface was measured in."""

    REFUSE = "refuse"
    KEEP_MEASURED = "keep measured"


@dataclass(frozen=True, eq=False)
class SurfaceForces:
    """A run with the measured motion and forces from response surfaces.

    `measured` are the channels that keep a measured force, and why; `outside` has how many lines do
    of each channel that has a surface.
    """

    load_case: LoadCase
    measured: dict[str, str]
    outside: dict[str, int]


def surface_forces(
    load_case: LoadCase,
    mounts: Sequence[CharacterisedMount],
    outside: Outside = Outside.REFUSE,
) -> SurfaceForces:
    """Exchange the measured forces of a run for those of its mounts' response surfaces.

    - `load_case`: load case with its engine torque.
    - `mounts`: characterised mounts of the run, with surfaces over wheel torque; they stand in the
      run as they say, see `as_mounted`.
    - `outside`: whether lines outside of the measured region are refused or keep the measured
      force.
    - returns: a direction that was not identified, or has no surface, keeps the measured force.
    - raises InputError: a run without engine torque; a mount that is missing, double or was not
      measured in the run; a surface over static force; lines outside of the measured region, if
      refused.

    ``f = K(T_w, |s|, ω) s`` at every line and for every piece, with the motion s as measured:
    thesis, eq. 30 and 32, along the mount's own axes; the forces are turned back into vehicle axes.
    All pieces of a mount share its surface.
    """
    standing = [part.mount for part in mounts]
    load_case = in_mount_axes(standing, load_case)
    surfaces = identified_surfaces(mounts)
    by_channel = _directions_of_channels(load_case, mounts)
    columns, kept, n_outside = [], {}, {}
    for column, channel in enumerate(load_case.force.channels):
        mount, axis = by_channel[channel]
        force = load_case.force.values[:, column]
        direction, surface = mount.find(axis), surfaces.get(f"{mount.mount.name} {axis}")
        if surface is not None:
            where = f"channel '{channel}', direction {axis} of {mount.identity}"
            force, n_outside[channel] = _force(load_case, column, surface, where, outside)
            if n_outside[channel]:
                kept[channel] = f"{n_outside[channel]} of {force.size} lines are outside"
        elif direction is None:
            kept[channel] = "not characterised"
        else:
            kept[channel] = "no surface" if direction.surface is None else "not identified"
        columns.append(force)
    spectrum = load_case.force
    values = np.column_stack(columns)
    modelled = Spectrum(spectrum.frequency, values, spectrum.channels, spectrum.unit)
    turned_back = in_vehicle_axes(standing, replace(load_case, force=modelled))
    return SurfaceForces(turned_back, kept, n_outside)


def as_mounted(
    parts: Sequence[CharacterisedMount], mounts: Sequence[Mount]
) -> tuple[CharacterisedMount, ...]:
    """Return characterised mounts as they stand in a vehicle: with the rotations of its mounts.

    Surfaces are along the axes of the part, so they go along. Parts of other mounts, and those with
    other pieces, stay as they stood on the bench.
    """
    rotations = {(mount.name, mount.pieces): mount.rotations for mount in mounts}

    def standing(part: CharacterisedMount) -> CharacterisedMount:
        mount = part.mount
        rotations_of_mount = rotations.get((mount.name, mount.pieces), mount.rotations)
        return replace(part, mount=replace(mount, rotations=rotations_of_mount))

    return tuple(map(standing, parts))


def _directions_of_channels(
    load_case: LoadCase, mounts: Sequence[CharacterisedMount]
) -> dict[str, tuple[CharacterisedMount, str]]:
    """Find mount and axis of every channel; each mount must have a channel."""
    by_channel: dict[str, tuple[CharacterisedMount, str]] = {
        channel: (mount, axis)
        for mount in mounts
        for axis in AXES
        for channel in mount.mount.channels(axis)
        if channel in load_case.force.channels
    }
    for mount in mounts:
        if not any(mount is other for other, _ in by_channel.values()):
            raise InputError(
                f"load case {load_case.name}: {mount.identity} has no channel in it; pieces and "
                "names of mounts must be the same in both"
            )
    missing = [name for name in load_case.force.channels if name not in by_channel]
    if missing:
        names = ", ".join(mount.mount.name for mount in mounts) or "none at all"
        raise InputError(
            f"load case {load_case.name}: no characterised mount has the channels {missing}, the "
            f"mounts are {names}: characterise the others too, or take the measured spectra"
        )
    return by_channel


def _force(
    load_case: LoadCase, column: int, surface: DynamicStiffnessSurface, where: str, outside: Outside
) -> tuple[ComplexArray, int]:
    """Force of one channel [N], and how many of its lines keep the measured one."""
    frequency = load_case.displacement.frequency
    displacement = load_case.displacement.values[:, column]
    points = operating_points(load_case.wheel_torque, np.abs(displacement), frequency)
    inside = surface.supported(points)
    n_outside = int(np.count_nonzero(~inside))
    if n_outside and outside is Outside.REFUSE:
        lines = frequency[~inside]
        raise InputError(
            f"load case {load_case.name}, {where}: {n_outside} of {inside.size} lines, from "
            f"{lines[0]:g} to {lines[-1]:g} Hz, lie outside of the region that the mount was "
            "measured in: characterise it with runs of that torque and amplitude, or keep the "
            "measured force at these lines"
        )
    force = surface.predict(points, extrapolate=True) * displacement
    return np.where(inside, force, load_case.force.values[:, column]), n_outside


def identified_surfaces(parts: Sequence[CharacterisedMount]) -> dict[str, DynamicStiffnessSurface]:
    """Return the surfaces over wheel torque of the directions that were identified.

    - `parts`: parts from the mount library.
    - returns: surfaces by ``<mount> <axis>``.
    - raises InputError: a surface over static force, which a load case does not carry; a mount
      twice.
    """
    surfaces: dict[str, DynamicStiffnessSurface] = {}
    for part in parts:
        for direction in part.directions:
            if direction.surface is None or not direction.quality.identified:
                continue
            name = f"{part.mount.name} {direction.axis}"
            surface = direction.surface
            if surface.preload_unit != "N m":
                raise InputError(
                    f"{part.identity}, direction {direction.axis}: its surface is over static "
                    "force, which a load case does not carry: characterise it over wheel torque"
                )
            if name in surfaces:
                raise InputError(f"two characterised mounts are {part.mount.name}: keep one")
            surfaces[name] = surface
    return surfaces


def main_axis(mount: CharacterisedMount) -> str:
    """Return the axis along which the static force of a mount ranges widest.

    Raises
    ------
    InputError
        A mount that was never loaded.
    """
    spans = {
        direction.axis: float(np.ptp(direction.map_points.preload))
        for direction in mount.directions
        if len(direction.map_points)
    }
    if not spans:
        raise InputError(f"{mount.identity}: it has no measured line: characterise it again")
    return max(spans, key=lambda axis: spans[axis])


def surface_over_main_force(
    mount: CharacterisedMount, axis: str, regressor: PiecewiseCubicRegressor | None = None
) -> DynamicStiffnessSurface:
    """Fit a response surface to the lines that the library keeps, over the main static force.

    That force carries over to another powertrain. There the wheel torque means nothing, and the
    static force across the main axis little: stiffness across follows the force along.

    - `mount`: mount with its map points.
    - `axis`: direction.
    - `regressor`, optional: pieces of the surface.
    - raises InputError: no such direction; lines of two directions that are not those of the same
      runs; too few lines, or none above the noise floor.
    """
    main = main_axis(mount)
    points, loaded = mount.direction(axis).map_points, mount.direction(main).map_points
    same_runs = np.array_equal(loaded.run, points.run)
    if not (same_runs and np.array_equal(loaded.frequency, points.frequency)):
        raise InputError(
            f"{mount.identity}: the lines of {axis} and {main} are not those of the same runs: "
            "characterise the mount again"
        )
    preload = smooth_static_force(loaded.preload, loaded.frequency, loaded.run)
    used = points.confidence > 0
    if not used.any():
        raise InputError(
            f"{mount.identity}, direction {axis}: none of its {len(points)} lines is above the "
            "noise floor"
        )
    X = operating_points(preload, points.amplitude, points.frequency)[used]
    surface = DynamicStiffnessSurface(regressor, preload_unit="N")
    return surface.fit(X, points.dynamic_stiffness[used], groups=points.run[used])


def smooth_static_force(
    force: RealArray, frequency: RealArray, run: npt.NDArray[np.str_]
) -> RealArray:
    """Take the noise out of the static force of each run, arrays (n,).

    Parabolas of least squares over `SMOOTH_WIDTH` (Savitzky-Golay). A run that is shorter,
    has fewer than five lines in that width or lines at unequal steps stays as it is.

    Noise in the variable of a surface flattens the surface; a mean over lines does not cure that.
    """
    smooth = np.array(force, dtype=float)
    for label in np.unique(run):
        lines = run == label
        step = np.diff(frequency[lines])
        if step.size == 0 or not np.allclose(step, step[0], rtol=1e-3):
            continue
        count = 2 * round(SMOOTH_WIDTH / step[0] / 2) + 1
        if 5 <= count <= step.size + 1:
            smooth[lines] = savgol_filter(smooth[lines], count, 2)
    return smooth


@dataclass(frozen=True, eq=False)
class PredictedForce:
    """The force of one direction under another engine, at the lines of its operating map.

    - `lines`: what the other engine measured, without lines near the noise floor.
    - `stiffness`: of the surface at these lines, shape (n,) [N/m].
    - `inside`: lines within the region that the surface was measured in, shape (n,): only these
      are predicted.
    """

    lines: OperatingMap
    stiffness: ComplexArray
    inside: BoolArray

    @property
    def force(self) -> ComplexArray:
        """Predicted force at the lines inside, shape (n_inside,) [N]."""
        return np.asarray((self.stiffness * self.lines.displacement)[self.inside])

    @property
    def measured(self) -> ComplexArray:
        """Measured force at the lines inside, shape (n_inside,) [N]."""
        return np.asarray(self.lines.force[self.inside])

    @property
    def error(self) -> float:
        """Rms of the force error over that of the force, at the lines inside [1]; nan if none."""
        if not self.inside.any():
            return float("nan")
        error = np.mean(np.abs(self.force - self.measured) ** 2)
        return float(np.sqrt(error / np.mean(np.abs(self.measured) ** 2)))


def predicted_forces(
    mounts: Sequence[CharacterisedMount],
    maps: Mapping[str, OperatingMap],
    regressor: PiecewiseCubicRegressor,
) -> dict[str, PredictedForce]:
    """Predict what another engine's cells measure, from its motion and the mounts' surfaces.

    ``f = K(F₀, |s|, ω) s`` (thesis, eq. 30, 32; 3.6.2) with motion s and static force F₀ along the
    main axis of the mount, both as the other engine measures them.

    - `mounts`: characterised under the first engine.
    - `maps`: operating map of the other engine by ``<mount> <axis>``; see
      `deboom.mounts.operating_map.operating_maps`.
    - returns: by ``<mount> <axis>``, of each direction with a surface and a map.
    - raises InputError: no map of a mount's main axis.
    """
    predicted = {}
    for mount in mounts:
        main = f"{mount.mount.name} {main_axis(mount)}"
        if main not in maps:
            raise InputError(
                f"the other engine measured no {main}, along which mount {mount.mount.name} "
                "carries its static force: measure it, or leave the mount out"
            )
        loaded = maps[main]
        static_force = loaded.preload(Preload.STATIC_FORCE)
        preload = smooth_static_force(static_force, loaded.frequency, loaded.run)
        for axis in (entry.axis for entry in mount.directions if entry.surface is not None):
            name = f"{mount.mount.name} {axis}"
            if name in maps:
                surface = surface_over_main_force(mount, axis, regressor)
                predicted[name] = _at_lines(surface, preload, maps[name])
    return predicted


def _at_lines(
    surface: DynamicStiffnessSurface, preload: RealArray, lines: OperatingMap
) -> PredictedForce:
    used = ~lines.near_floor
    points = operating_points(preload, lines.amplitude, lines.frequency)[used]
    stiffness = surface.predict(points, extrapolate=True)
    return PredictedForce(lines.select(used), stiffness, surface.supported(points))


def change_per_kelvin(
    parts: Sequence[CharacterisedMount], warm: Sequence[CharacterisedMount], warmer: float
) -> dict[str, tuple[float, float]]:
    """Return how the stiffness of mounts changes with temperature, from two characterisations.

    - `parts`, `warm`: of the same mounts, over wheel torque.
    - `warmer`: temperature of the second over that of the first, not 0 [K].
    - returns: by mount, least and largest change of ln |K| per kelvin among its axes, each the mean
      over the first's measured operating points that the second is backed at, too [1/K].
    - raises InputError: see `identified_surfaces`.
    """
    before, after = identified_surfaces(parts), identified_surfaces(warm)
    slopes: dict[str, list[float]] = {}
    for name in before.keys() & after.keys():
        points = before[name].region_.points
        points = points[after[name].supported(points)]
        if len(points):
            ratio = np.abs(after[name].predict(points) / before[name].predict(points))
            slope = float(np.mean(np.log(ratio))) / warmer
            slopes.setdefault(name.rpartition(" ")[0], []).append(slope)
    return {mount: (min(each), max(each)) for mount, each in slopes.items()}
