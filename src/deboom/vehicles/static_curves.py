"""Quasi-static force over deflection of a mount direction, as a function."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve

LEAST_SLOPE = 1e-6
"""Of the mean slope: a monotone interpolant may be flat at its very ends [1]."""


class MonotoneCurve:
    """A curve through measured points that rises everywhere, straight beyond its ends.

    Parameters
    ----------
    curve : StaticCurve
        Measured points.

    Attributes
    ----------
    lowest, highest : float
        First and last measured deflection [m].

    Raises
    ------
    InputError
        A force that does not increase with the deflection.

    Notes
    -----
    Piecewise cubic Hermite interpolation without overshoot (Fritsch and Carlson, SIAM J. Numer.
    Anal. 17, 1980). Beyond the ends it goes on with the last secant, for iterations on their way:
    compare with `lowest` and `highest` what came out.
    """

    def __init__(self, curve: StaticCurve) -> None:
        secants = np.diff(curve.force) / np.diff(curve.deflection)
        if np.any(secants <= 0):
            raise InputError(
                f"the static force of {curve.mount} {curve.axis} of {curve.mount_set} does not "
                "increase with the deflection: check its curve"
            )
        self.lowest, self.highest = float(curve.deflection[0]), float(curve.deflection[-1])
        self._force = PchipInterpolator(curve.deflection, curve.force)
        self._slope = self._force.derivative()
        self._first, self._last = secants[0], secants[-1]
        self._least = LEAST_SLOPE * float(np.mean(secants))

    def force(self, deflection: RealArray) -> RealArray:
        """Force [N] at `deflection` [m]."""
        inside = np.clip(deflection, self.lowest, self.highest)
        secant = np.where(deflection < self.lowest, self._first, self._last)
        return np.asarray(self._force(inside) + secant * (deflection - inside))

    def slope(self, deflection: RealArray) -> RealArray:
        """Tangent stiffness [N/m] at `deflection` [m]; above 0."""
        inside = np.clip(deflection, self.lowest, self.highest)
        slope = np.maximum(self._slope(inside), self._least)
        slope = np.where(deflection < self.lowest, self._first, slope)
        return np.asarray(np.where(deflection > self.highest, self._last, slope))


def static_curve_from_stiffness(
    mount: str,
    axis: str,
    mount_set: str,
    static_force: npt.ArrayLike,
    dynamic_stiffness: npt.ArrayLike,
    dynamic_to_static: float,
    uncertainty: float,
) -> StaticCurve:
    """Integrate a curve from dynamic stiffness over static force where no supplier sent one.

    Parameters
    ----------
    mount, axis, mount_set : str
        Direction and part.
    static_force : array, shape (n,)
        Increasing, from below 0 or 0 to above [N].
    dynamic_stiffness : array, shape (n,)
        Magnitude or real part there, above 0 [N/m].
    dynamic_to_static : float
        Dynamic over quasi-static tangent stiffness, above 0 [1]; state where it comes from.
    uncertainty : float
        Standard deviation relative to the force that the curve is believed to have [1].

    Returns
    -------
    StaticCurve
        With no deflection at no force.

    Raises
    ------
    InputError
        Shapes, a force that does not increase or does not include 0, values that are not positive.

    Notes
    -----
    ``u(F) = ∫ dF r / K(F)`` from 0, by trapezoids.
    """
    owner = f"static curve of {mount} {axis} of {mount_set}"
    force = np.asarray(static_force, dtype=float)
    stiffness = np.asarray(dynamic_stiffness, dtype=float)
    if force.ndim != 1 or force.shape != stiffness.shape or force.size < 2:
        raise InputError(f"{owner}: one stiffness per static force, at least two of them")
    if np.any(np.diff(force) <= 0) or not force[0] <= 0 <= force[-1]:
        raise InputError(f"{owner}: its static force must increase and include 0 N")
    if np.any(stiffness <= 0) or not dynamic_to_static > 0:
        raise InputError(f"{owner}: stiffness and dynamic-to-static ratio are above 0")
    compliance = dynamic_to_static / stiffness
    steps = np.diff(force) * (compliance[1:] + compliance[:-1]) / 2
    deflection = np.concatenate([[0.0], np.cumsum(steps)])
    deflection -= np.interp(0.0, force, deflection)
    return StaticCurve(mount, axis, mount_set, deflection, force, uncertainty)
