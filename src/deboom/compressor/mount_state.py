"""Are the mounts of the running compressor those that were struck? The sweep itself tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.operating_stiffness import OneFactor

if TYPE_CHECKING:
    from deboom.compressor.gain import GainFactor
    from deboom.compressor.operating_stiffness import FactorOverFrequency
    from deboom.compressor.source_fit import SourceFit

STATED_AT = 30.0
"""Line at which the change is put in words: within the rigid-body modes, which show it [Hz]."""
SIGNIFICANCE = 1e-4
SMALLEST_CHANGE = 0.01
"""Of the dynamic stiffness: below it nothing is reported [1]."""


@dataclass(frozen=True, eq=False)
class MountState:
    """Dynamic stiffness in operation over that of the hammer test, minus one.

    Parameters
    ----------
    storage, loss : float
        Relative change of real and imaginary part of the dynamic stiffness at `STATED_AT` [1].
    storage_deviation, loss_deviation : float
        1 σ [1].
    changed : bool
        Significant, and of a size that matters.
    statement : str
        The same in words.
    frequency : array, shape (n_frequency,)
        [Hz].
    curve : array, shape (n_frequency,)
        Complex change over frequency, as far as knots resolve it [1].
    curve_deviation : array, shape (n_frequency,)
        1 σ of its amplitude [1].
    """

    storage: float
    loss: float
    storage_deviation: float
    loss_deviation: float
    changed: bool
    statement: str
    frequency: RealArray
    curve: ComplexArray
    curve_deviation: RealArray


def mount_state(
    common: SourceFit,
    resolved: SourceFit,
    factor: FactorOverFrequency,
    gain: GainFactor,
    frequency: RealArray,
) -> MountState:
    """Compare the mounts of two states.

    Parameters
    ----------
    common : SourceFit
        With `OneFactor` for all speeds.
    resolved : SourceFit
        With `factor`.
    factor : FactorOverFrequency
    gain : GainFactor
        Of the hammer test.
    frequency : array, shape (n_frequency,)
        Of the sweeps [Hz].

    Returns
    -------
    MountState

    Notes
    -----
    χ² test of the common factor with its covariance, in which the hammer test's own uncertainty of
    the stiffness is contained.
    """
    line = np.array([STATED_AT])
    struck = complex(gain.at(line)[0])
    one = OneFactor().basis(line)[:, 0]
    slopes = struck * one
    own = common.covariance[common.change_slice, common.change_slice]
    values = common.values[common.change_slice]
    # relative changes of real and imaginary part of the dynamic stiffness
    parts = np.stack([slopes.real / struck.real, slopes.imag / struck.imag])
    storage, loss = parts @ values
    of_storage, of_loss = np.sqrt(np.diag(parts @ own @ parts.T))
    distance = float(values @ np.linalg.solve(own, values))
    changed = bool(
        chdtrc(values.size, distance) < SIGNIFICANCE and abs(values @ one) > SMALLEST_CHANGE
    )
    basis = factor.basis(frequency)
    own = resolved.line_covariance[resolved.change_slice, resolved.change_slice]
    curve = resolved.line_values[resolved.change_slice] @ basis
    along = (np.exp(-1j * np.angle(curve)) * basis).real
    return MountState(
        float(storage),
        float(loss),
        float(of_storage),
        float(of_loss),
        changed,
        _statement(changed, float(storage), float(loss), float(of_storage), float(of_loss)),
        frequency,
        curve,
        np.sqrt(np.einsum("kf,kl,lf->f", along, own, along)),
    )


def _statement(
    changed: bool, storage: float, loss: float, of_storage: float, of_loss: float
) -> str:
    numbers = (
        f"real part {_change(storage, of_storage)}, imaginary part {_change(loss, of_loss)} at "
        f"{STATED_AT:g} Hz"
    )
    if changed:
        return (
            f"The mounts in operation are not those that were struck: {numbers}. Below 50 Hz only "
            "a route that updates them can be trusted."
        )
    return f"The mounts in operation are those that were struck: {numbers}."


def _change(value: float, deviation: float) -> str:
    """Write a change and its 1 σ in percent; nothing has no sign."""
    percent = round(100 * value, 1) + 0.0
    return f"{percent:{'+' if percent else ''}.1f} % ± {100 * deviation:.1f} %"
