"""How much the channels may disagree, by the stated tolerances of placement and calibration."""

from __future__ import annotations

import numpy as np

from deboom.arrays import RealArray
from deboom.measurement.channel_geometry import ChannelGeometry
from deboom.measurement.tolerances import Tolerances
from deboom.physics.rigid_body import forward_matrices


def error_variance(
    geometry: ChannelGeometry, motion: RealArray, tolerances: Tolerances
) -> RealArray:
    """Variance of each channel's error, summed over several states of motion.

    Parameters
    ----------
    geometry : ChannelGeometry
        n channels, seen from the virtual point.
    motion : array, shape (n_motion, n_state)
        Of the virtual point.
    tolerances : Tolerances
        Of the sensors; the noise floor, an absolute value, is left out.

    Returns
    -------
    array, shape (n,)
        In the squared unit of the channels.

    Notes
    -----
    To first order, with the acceleration b of the sensor and the angular acceleration α: a gain
    error adds ``g d·b``, an angle ``φ·(d × b)``, the cross-axis sensitivity ``κ`` times the two
    other axes, an offset ``δ·(d × α)``.
    """
    own = np.sum((geometry.forward @ motion) ** 2, axis=1)
    here = np.einsum("cab,bs->cas", forward_matrices(geometry.levers).reshape(-1, 3, 6), motion[:6])
    norm = np.sum(here**2, axis=(1, 2))
    across = np.maximum(norm - own, 0.0)
    turning = np.cross(geometry.directions[:, np.newaxis, :], motion[3:6].T[np.newaxis, :, :])
    swing = np.sum(turning**2, axis=(1, 2))
    return np.asarray(
        (tolerances.sensor_gain**2 + tolerances.acceleration_own**2) * own
        + (tolerances.sensor_angle**2 + tolerances.sensor_cross_axis**2) * across
        + tolerances.acceleration_norm**2 * norm
        + tolerances.sensor_position**2 * swing
    )
