"""What stands for the static state of a mount: torque, its own force, or that of its main axis.

Within one powertrain all three say the same. On another one the wheel torque means nothing, and the
static force across a mount's main axis little: stiffness across follows the force along.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_filter

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.characterised_direction import MapPoints
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.operating_map import OperatingMap, Preload
from deboom.mounts.response_surface import DynamicStiffnessSurface

TWO_PIECES = PieceOptions()

SMOOTH_WIDTH = 5.0
"""Over which a run's static force is smoothed: the torque of a run-up changes more slowly [Hz]."""


class MountState(Enum):
    """Preload variable of a response surface; the value says it in words."""

    MAIN_FORCE = "static force along the mount's main axis"
    OWN_FORCE = "static force of the direction"
    WHEEL_TORQUE = "wheel torque"


def main_axis(mount: CharacterisedMount) -> str:
    """Return the axis along which the static force of a mount ranges widest.

    Raises
    ------
    InputError
        A mount that was never loaded.
    """
    spans = {
        one.axis: float(np.ptp(one.map_points.preload))
        for one in mount.directions
        if len(one.map_points)
    }
    if not spans:
        raise InputError(f"{mount.identity}: it has no measured line: characterise it again")
    return max(spans, key=lambda axis: spans[axis])


def surface_over(
    mount: CharacterisedMount, axis: str, state: MountState, options: PieceOptions = TWO_PIECES
) -> DynamicStiffnessSurface:
    """Fit a response surface to the lines that the library keeps, over the preload of choice.

    Parameters
    ----------
    mount : CharacterisedMount
        With its map points.
    axis : str
        Direction.
    state : MountState
        Preload variable.
    options : PieceOptions
        Of the surface.

    Returns
    -------
    DynamicStiffnessSurface

    Raises
    ------
    InputError
        No such direction; lines of two directions that are not those of the same runs; too few
        lines, or none above the noise floor.
    """
    own = mount.direction(axis).map_points
    if state is MountState.WHEEL_TORQUE:
        preload = own.wheel_torque
    else:
        loaded = own if state is MountState.OWN_FORCE else _same_lines(mount, axis, own)
        preload = smooth_static_force(loaded.preload, loaded.frequency, loaded.run)
    used = own.confidence > 0
    if not used.any():
        raise InputError(
            f"{mount.identity}, direction {axis}: none of its {len(own)} lines is above the noise "
            "floor"
        )
    return DynamicStiffnessSurface.fit(
        preload[used],
        own.amplitude[used],
        own.frequency[used],
        own.dynamic_stiffness[used],
        preload_unit="N m" if state is MountState.WHEEL_TORQUE else "N",
        options=options,
        run=own.run[used],
    )


def state_at(
    maps: Mapping[str, OperatingMap], mount: CharacterisedMount, axis: str, state: MountState
) -> RealArray:
    """Preload of choice at every line of newly measured maps, shape (n,) [N m or N].

    Parameters
    ----------
    maps : mapping of str to OperatingMap
        By ``<mount> <axis>``, such as those of another powertrain on the same mount.
    mount : CharacterisedMount
        As the library knows it; it says which axis is the main one.
    axis : str
        Direction.
    state : MountState
        Preload variable.

    Raises
    ------
    InputError
        The static force was not measured.
    """
    name = mount.mount.name
    if state is MountState.WHEEL_TORQUE:
        return maps[f"{name} {axis}"].wheel_torque
    of_axis = axis if state is MountState.OWN_FORCE else main_axis(mount)
    loaded = maps[f"{name} {of_axis}"]
    return smooth_static_force(loaded.preload(Preload.STATIC_FORCE), loaded.frequency, loaded.run)


def smooth_static_force(
    force: RealArray, frequency: RealArray, run: npt.NDArray[np.str_]
) -> RealArray:
    """Take the noise out of the static force of each run.

    Parameters
    ----------
    force : array, shape (n,)
        As read, line by line [N].
    frequency : array, shape (n,)
        Increasing within a run [Hz].
    run : array of str, shape (n,)
        Run (and piece) of each line.

    Returns
    -------
    array, shape (n,)
        Parabolas of least squares over `SMOOTH_WIDTH` (Savitzky-Golay). A run with fewer than five
        lines in that width, or with lines at unequal steps, stays as it is [N].

    Notes
    -----
    Noise in the variable of a surface flattens the surface; a mean over lines does not cure that.
    """
    smooth = np.array(force, dtype=float)
    for label in np.unique(run):
        own = run == label
        step = np.diff(frequency[own])
        if step.size == 0 or not np.allclose(step, step[0], rtol=1e-3):
            continue
        count = 2 * round(SMOOTH_WIDTH / step[0] / 2) + 1
        if 5 <= count <= step.size + 1:
            smooth[own] = savgol_filter(smooth[own], count, 2)
    return smooth


def _same_lines(mount: CharacterisedMount, axis: str, own: MapPoints) -> MapPoints:
    """Lines of the main axis, which are those of the direction."""
    main = mount.direction(main_axis(mount)).map_points
    if not (np.array_equal(main.run, own.run) and np.array_equal(main.frequency, own.frequency)):
        raise InputError(
            f"{mount.identity}: the lines of {axis} and {main_axis(mount)} are not those of the "
            "same runs: characterise the mount again"
        )
    return main
