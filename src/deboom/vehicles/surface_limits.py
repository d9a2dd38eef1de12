"""How far a response surface is backed by measurements, seen from an operating point."""

from __future__ import annotations

from typing import Literal

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.response_surface import DynamicStiffnessSurface

STEPS = 41
"""Values on either side of a line's own one at which a surface is asked how far it goes, in equal
ratios."""


def backed_range(
    surface: DynamicStiffnessSurface,
    torque: RealArray,
    amplitude: RealArray,
    frequency: RealArray,
    variable: Literal["preload", "amplitude"],
    where: str,
) -> tuple[RealArray, RealArray]:
    """Find between which values of one variable a surface is backed, the others as in the run.

    Parameters
    ----------
    surface : DynamicStiffnessSurface
        Over wheel torque.
    torque, amplitude, frequency : array, shape (n_frequency,)
        Lines of a run [N m], [m], [Hz].
    variable : str
        ``preload`` or ``amplitude``.
    where : str
        Run and direction, for a complaint.

    Returns
    -------
    lowest, highest : array, shape (n_frequency,)
        About the line's own value; the nearest that are not backed end the range [N m] or [m].

    Raises
    ------
    InputError
        A line that is not backed itself; a wheel torque that is not above 0.
    """
    at_own = surface.inside(torque, amplitude, frequency)
    if not at_own.all():
        outside = frequency[~at_own]
        raise InputError(
            f"{where}: {outside.size} of {frequency.size} lines, from {outside[0]:g} to "
            f"{outside[-1]:g} Hz, lie outside of the region that the mount was measured in, so "
            f"nothing says how it follows the {variable}: characterise it with runs of that torque "
            "and amplitude"
        )
    own = torque if variable == "preload" else amplitude
    low, high = surface.ranges[variable]
    if np.any(own <= 0.0) or low <= 0.0:
        raise InputError(
            f"{where}: a {variable} of 0 or less: take a run whose wheel torque is above 0"
        )
    bounds = []
    for end in (np.minimum(low, own), np.maximum(high, own)):
        ratio = (end / own)[:, np.newaxis] ** np.linspace(0.0, 1.0, STEPS)
        tried = own[:, np.newaxis] * ratio
        if variable == "preload":
            backed = surface.inside(tried, amplitude[:, np.newaxis], frequency[:, np.newaxis])
        else:
            backed = surface.inside(torque[:, np.newaxis], tried, frequency[:, np.newaxis])
        backed[:, 0] = True
        last = np.logical_and.accumulate(backed, axis=1).sum(axis=1) - 1
        bounds.append(tried[np.arange(own.size), last])
    return np.minimum(bounds[0], own), np.maximum(bounds[1], own)
