"""The dynamic stiffness that a mount had in one operating run."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import AXES, Mount
from deboom.physics.dynamic_stiffness import dynamic_stiffness


def mean_operating_stiffness(
    mount: Mount, load_case: LoadCase, band: tuple[float, float]
) -> npt.NDArray[np.float64]:
    """Mean magnitude of a mount's dynamic stiffness over the lines of a run, per axis.

    One number to read beside a stiffness factor. Over a full-load run the stiffness itself grows
    with the preload.

    Parameters
    ----------
    mount : Mount
        Its pieces are averaged.
    load_case : LoadCase
        Measured run.
    band : (float, float)
        First and last frequency, both included [Hz].

    Returns
    -------
    array, shape (3,)
        ``mean |f / s|`` for x, y, z [N/m]; nan for an axis without channels.

    Raises
    ------
    InputError
        A band without lines.

    Notes
    -----
    Thesis, eq. 30: K = f / s at the virtual point, line by line.
    """
    frequency = load_case.displacement.frequency
    lines = (frequency >= band[0]) & (frequency <= band[1])
    if not lines.any():
        raise InputError(
            f"load case {load_case.name}: no line between {band[0]} and {band[1]} Hz; "
            f"the run covers {frequency[0]} to {frequency[-1]} Hz"
        )
    stiffness = np.full(len(AXES), np.nan)
    for place, axis in enumerate(AXES):
        names = mount.channels(axis)
        if not set(names) <= set(load_case.force.channels):
            continue
        force = load_case.force.select(names).values[lines]
        displacement = load_case.displacement.select(names).values[lines]
        stiffness[place] = np.mean(np.abs(dynamic_stiffness(force, displacement)))
    return stiffness
