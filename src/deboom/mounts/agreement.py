"""How well a model of the dynamic stiffness agrees with measured lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray
from deboom.errors import InputError
from deboom.mounts.stiffness_model import StiffnessSamples


@dataclass(frozen=True)
class Agreement:
    """Agreement of a model with measured lines, as in the thesis's tables 6 to 8.

    Parameters
    ----------
    n_lines : int
        Lines compared.
    r2_real, r2_imag : float
        Coefficient of determination of Re K and Im K [1].
    r2_force_real, r2_force_imag : float
        The same of the force ``K s``, in the phase of the measured displacement [1].
    rms_error : float
        Rms of ``|K_model - K| / |K|`` [1].
    """

    n_lines: int
    r2_real: float
    r2_imag: float
    r2_force_real: float
    r2_force_imag: float
    rms_error: float


def r_squared(measured: npt.ArrayLike, modelled: npt.ArrayLike) -> float:
    """Coefficient of determination, ``1 - Σ(y - ŷ)² / Σ(y - ȳ)²``.

    Parameters
    ----------
    measured, modelled : array, shape (n,)
        Real, of one unit.

    Returns
    -------
    float
        1 is perfect, 0 is no better than the mean [1].

    Raises
    ------
    InputError
        Shapes that differ, or a measured quantity that does not vary.
    """
    y, fitted = np.asarray(measured, dtype=float), np.asarray(modelled, dtype=float)
    if y.shape != fitted.shape or y.ndim != 1:
        raise InputError(f"{y.shape} measured and {fitted.shape} modelled values: one each")
    total = float(np.sum((y - y.mean()) ** 2))
    if total == 0:
        raise InputError("the measured values are all equal: R² has no meaning for them")
    return float(1 - np.sum((y - fitted) ** 2) / total)


def agreement(samples: StiffnessSamples, modelled: ComplexArray) -> Agreement:
    """Compare measured lines with a model's values.

    Parameters
    ----------
    samples : StiffnessSamples
        Measured.
    modelled : array, shape (n,)
        Stiffness of the model at the same lines [N/m].

    Returns
    -------
    Agreement

    Notes
    -----
    R² compares with what was measured, systematic errors included: it is no accuracy.
    """
    force = modelled * samples.displacement
    error = np.abs(modelled - samples.stiffness) / np.abs(samples.stiffness)
    return Agreement(
        n_lines=len(samples),
        r2_real=r_squared(samples.stiffness.real, modelled.real),
        r2_imag=r_squared(samples.stiffness.imag, modelled.imag),
        r2_force_real=r_squared(samples.force.real, force.real),
        r2_force_imag=r_squared(samples.force.imag, force.imag),
        rms_error=float(np.sqrt(np.mean(error**2))),
    )
