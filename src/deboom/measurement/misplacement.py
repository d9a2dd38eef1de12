"""What a sensor or a blow beside its place does to a noise transfer function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.physics.rigid_body import skew

AXES = POINT_LOADS[:3]


@dataclass(frozen=True, eq=False)
class Misplacement:
    """Change of the three translational noise transfer functions of one point.

    Parameters
    ----------
    point : str
        Mount, or mount and piece.
    distance : float
        Between the place meant and the place taken [m].
    frequency : array, shape (n_frequency,)
        [Hz].
    exact : array, shape (n_frequency, 3)
        At the place meant, along x, y, z [Pa/N].
    rms_change, worst_change : array, shape (n_frequency, 3)
        Magnitude of the complex change: rms over all directions of the misplacement, and in the
        direction that is worst for this line and axis [Pa/N].
    """

    point: str
    distance: float
    frequency: RealArray
    exact: ComplexArray
    rms_change: RealArray
    worst_change: RealArray

    def __post_init__(self) -> None:
        for name in ("frequency", "exact", "rms_change", "worst_change"):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def per_mode(self, modes: npt.ArrayLike, half_width: float = 1.0) -> RealArray:
        """Return the relative change around each mode of the body.

        Parameters
        ----------
        modes : array_like, shape (n_mode,)
            Natural frequencies [Hz].
        half_width : float
            Of the band around each [Hz].

        Returns
        -------
        array, shape (n_mode, 3)
            Rms change over rms function, both over the lines of the band [1].

        Raises
        ------
        InputError
            A mode without a line in its band.
        """
        rows = []
        for mode in np.asarray(modes, dtype=float):
            near = np.abs(self.frequency - mode) <= half_width
            if not near.any():
                raise InputError(
                    f"mode {mode:g} Hz: no line within {half_width:g} Hz, the measurement reaches "
                    f"from {self.frequency[0]:g} to {self.frequency[-1]:g} Hz"
                )
            change = np.sqrt(np.mean(self.rms_change[near] ** 2, axis=0))
            rows.append(change / np.sqrt(np.mean(np.abs(self.exact[near]) ** 2, axis=0)))
        return np.array(rows)


def misplaced_noise_transfer(points: Frf, point: str, offset: npt.ArrayLike) -> Frf:
    """Return what is measured along x, y, z at a place beside a virtual point.

    Parameters
    ----------
    points : Frf
        With inputs ``<point> x y z mx my mz``, from `noise_transfer_at_points`.
    point : str
        Mount, or mount and piece.
    offset : array, shape (3,)
        From the virtual point to the place taken [m].

    Returns
    -------
    Frf
        Inputs ``<point> x``, ``y``, ``z`` [Pa/N].

    Notes
    -----
    A force at r is the force and the moment ``r × F`` at the virtual point; an accelerometer at r
    sees ``a + α × r``. Both give ``Y_t + Y_r skew(r)``. Valid while the body around the mount is
    rigid.
    """
    translation, rotation = _parts(points, point)
    lever = skew(np.asarray(offset, dtype=float))
    names = tuple(f"{point} {axis}" for axis in AXES)
    values = translation + rotation @ lever
    return Frf(points.frequency, values, points.outputs, names, points.unit)


def misplacement(points: Frf, point: str, ear: str, distance: float) -> Misplacement:
    """Find how much a misplacement by a known distance in an unknown direction changes.

    Parameters
    ----------
    points : Frf
        With inputs ``<point> x y z mx my mz``.
    point, ear : str
        Where, and at which ear.
    distance : float
        [m].

    Raises
    ------
    InputError
        No such point or ear, a distance that is not positive.

    Notes
    -----
    The change is ``Σ_j (Y_r skew(r))_j`` per axis, linear in r: for directions spread evenly over
    the sphere its rms is ``d/√3`` times the norm of its gradient, and its largest value ``d`` times
    the largest singular value of the gradient's real and imaginary part.
    """
    if not distance > 0:
        raise InputError(f"a misplacement is a distance above 0, not {distance:g} m")
    translation, rotation = _parts(points.select(outputs=(ear,)), point)
    # gradient[f, i, k]: change of axis i per metre along k
    generators = np.array([skew(unit) for unit in np.eye(3)])
    gradient = np.einsum("fj,kji->fik", rotation[:, 0], generators)
    parts = np.stack([gradient.real, gradient.imag], axis=2)
    return Misplacement(
        point=point,
        distance=distance,
        frequency=points.frequency,
        exact=translation[:, 0],
        rms_change=distance / np.sqrt(3) * np.linalg.norm(gradient, axis=2),
        worst_change=distance * np.linalg.norm(parts, ord=2, axis=(2, 3)),
    )


def _parts(points: Frf, point: str) -> tuple[ComplexArray, ComplexArray]:
    chosen = points.select(inputs=[f"{point} {load}" for load in POINT_LOADS]).values
    return chosen[..., : len(AXES)], chosen[..., len(AXES) :]
