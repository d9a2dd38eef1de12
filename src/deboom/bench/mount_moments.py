"""The moments that a mount of finite size carries besides its forces."""

from __future__ import annotations

import numpy as np

from deboom.arrays import ComplexArray
from deboom.bench.operating_run import OperatingRun

RUBBER_RADIUS = 0.015
"""Radius of gyration of a mount's rubber about its virtual point, each axis [m]; judgement."""


def mount_moments(run: OperatingRun) -> ComplexArray:
    """Find the moment of every powertrain mount on its receiver, about its virtual point.

    Parameters
    ----------
    run : OperatingRun
        The truth.

    Returns
    -------
    array, shape (f, n_mount, 3)
        [N m].

    Notes
    -----
    Rubber that lies around the virtual point, ρ per axis, turns with the powertrain::

        M = ρ² diag(k_y + k_z, k_z + k_x, k_x + k_y) θ

    The moments are below 1 % of the engine's and are not fed back into its motion.
    """
    stiffness = run.powertrain.stiffness.reshape(run.frequency.size, -1, 3)
    turning = stiffness.sum(axis=2, keepdims=True) - stiffness
    rotation = run.powertrain.motion[:, np.newaxis, 3:]
    return np.asarray(RUBBER_RADIUS**2 * turning * rotation)
