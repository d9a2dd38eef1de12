"""Passivity: whatever the forces at the driving point, a structure takes power and gives none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channel_geometry import RIGID_LOADS, RIGID_MOTIONS
from deboom.measurement.channels import Frf
from deboom.physics.frf import FrfForm, convert

SLACK = 0.05
"""Power given, relative to the largest mobility, that noise on a weakly damped body explains."""

ROTATIONS = (*RIGID_MOTIONS[3:], *RIGID_LOADS[3:])


@dataclass(frozen=True, eq=False)
class Passivity:
    """Power that a driving point takes.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    names : tuple of str
        Degrees of freedom, by their output.
    margin : array, shape (n_frequency,)
        Least power over all forces of one size, −1 … 1; negative where power comes out [1].
    driving_point : array, shape (n_frequency, n)
        Share of its apparent power that each degree of freedom takes when pushed alone, −1 … 1
        (cosine of the phase between force and velocity) [1].
    """

    frequency: RealArray
    names: tuple[str, ...]
    margin: RealArray
    driving_point: RealArray

    def __post_init__(self) -> None:
        for name in ("frequency", "margin", "driving_point"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def active_share(self) -> float:
        """Share of the lines at which more power comes out than noise explains [1]."""
        return float(np.mean(self.margin < -SLACK))

    @property
    def worst(self) -> str:
        """The degree of freedom that takes the least power when pushed alone."""
        return self.names[int(np.argmin(self.driving_point.mean(axis=0)))]


def passivity(frf: Frf, form: FrfForm, length: float) -> Passivity:
    """Check the sign of the power at a driving point.

    Parameters
    ----------
    frf : Frf
        Output i and input i are one degree of freedom; outputs named rx ry rz (mx my mz of an
        inverse form) are rotations.
    form : FrfForm
        Motion per force, or force per motion.
    length : float
        Characteristic length by which rotations are made comparable with translations [m].

    Raises
    ------
    InputError
        A matrix that is not square, a line at 0 Hz where it is divided by, a length that is not
        positive, or a driving point function that is 0.

    Notes
    -----
    The power ``½ Re Fᴴ v = ½ Fᴴ Y F`` is positive for every F if and only if the Hermitian part of
    the mobility Y (or of the impedance) has no negative eigenvalue; the margin is the smallest one
    over the norm of Y. For one degree of freedom: the phase of an inertance lies within 0 … 180°.
    """
    n_output, n_input = frf.values.shape[1:]
    if n_output != n_input:
        raise InputError(f"passivity needs as many inputs as outputs, not {n_output} by {n_input}")
    if not length > 0:
        raise InputError(f"a characteristic length is positive, not {length} m")
    target = FrfForm.IMPEDANCE if form.is_inverse else FrfForm.MOBILITY
    values = convert(frf.values, frf.frequency, form, target)
    turning = np.isin(frf.outputs, ROTATIONS)
    scale = np.where(turning, 1 / length if form.is_inverse else length, 1.0)
    values = values * np.outer(scale, scale)
    diagonal = np.einsum("fii->fi", values)
    if np.any(diagonal == 0):
        where = frf.outputs[int(np.argwhere(diagonal == 0)[0, 1])]
        raise InputError(f"the driving point function of {where} is 0: passivity needs it")
    hermitian = (values + np.swapaxes(values, 1, 2).conj()) / 2
    return Passivity(
        frequency=frf.frequency,
        names=frf.outputs,
        margin=np.linalg.eigvalsh(hermitian)[:, 0] / np.linalg.norm(values, ord=2, axis=(1, 2)),
        driving_point=diagonal.real / np.abs(diagonal),
    )
