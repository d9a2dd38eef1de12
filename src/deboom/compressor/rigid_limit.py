"""Up to which frequency the compressor is rigid: its mass line must not drift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.compressor.model import CompressorModel
from deboom.errors import InputError

SMALLEST_LINES = 8


@dataclass(frozen=True)
class RigidLimit:
    """Drift of the measured mass line.

    Parameters
    ----------
    drift : float
        Change of the apparent mass, less that of the mounts, from 0 Hz to the highest line,
        relative [1].
    deviation : float
        Its standard deviation, from the scatter of the lines [1].
    holds_to : float
        Frequency at which the drift reaches the tolerance; infinite where it never does [Hz].
    tolerance : float
        Relative change of mass that still counts as rigid [1].
    highest : float
        Highest line judged [Hz].
    """

    drift: float
    deviation: float
    holds_to: float
    tolerance: float
    highest: float

    @property
    def is_rigid(self) -> bool:
        """Whether the model holds on all lines."""
        return self.holds_to >= self.highest

    @property
    def statement(self) -> str:
        """One sentence for the report."""
        if self.is_rigid:
            return (
                f"The mass line does not drift: the compressor is rigid to {self.highest:.0f} Hz."
            )
        return (
            f"The apparent mass drifts by {self.drift:+.1%} to {self.highest:.0f} Hz: the rigid "
            f"model holds to {self.holds_to:.0f} Hz; fit lines below it only."
        )


def rigid_limit(
    model: CompressorModel,
    frequency: npt.ArrayLike,
    apparent_mass: npt.ArrayLike,
    *,
    above: float = 60.0,
    tolerance: float = 0.03,
) -> RigidLimit:
    """Judge whether the apparent mass above the mount modes is constant.

    Parameters
    ----------
    model : CompressorModel
        Its mounts are taken off before.
    frequency : array, shape (n_frequency,)
        [Hz].
    apparent_mass : array, shape (n_frequency, 6, 6)
        Measured, at the virtual point [kg, kg m, kg m²].
    above : float
        Lowest line judged: below it the mounts dominate [Hz].
    tolerance : float
        Relative change that still counts as rigid [1].

    Returns
    -------
    RigidLimit

    Raises
    ------
    InputError
        Fewer than eight lines above `above`.

    Notes
    -----
    A first flexible mode at f_n lets the apparent mass fall as ``1 − c (f/f_n)²``, while that of a
    rigid body is constant: the slope of ``tr(M_meas + v K/ω²)`` over f², translations and rotations
    each relative to the model, is the drift. Three standard deviations count as none.
    """
    lines = np.asarray(frequency, dtype=float)
    judged = lines >= above
    if np.count_nonzero(judged) < SMALLEST_LINES:
        raise InputError(
            f"fewer than {SMALLEST_LINES} lines lie above {above:g} Hz: the drift of the mass line "
            "cannot be judged"
        )
    lines = lines[judged]
    mounts = (model.gain.at(lines) / (2 * np.pi * lines) ** 2)[:, np.newaxis, np.newaxis]
    left = np.asarray(apparent_mass)[judged].real + (mounts * model.stiffness).real
    diagonal = np.diagonal(left, axis1=1, axis2=2) / np.diag(model.mass_matrix)
    relative = diagonal.mean(axis=1)
    squared = (lines / lines[-1]) ** 2
    columns = np.stack([np.ones_like(squared), squared], axis=1)
    (level, slope), misfit, *_ = np.linalg.lstsq(columns, relative)
    scatter = float(misfit[0]) / (lines.size - 2) if misfit.size else 0.0
    deviation = float(np.sqrt(scatter * np.linalg.inv(columns.T @ columns)[1, 1])) / abs(level)
    drift = float(slope / level)
    seen = abs(drift) > 3 * deviation and abs(drift) > tolerance
    holds_to = float(lines[-1] * np.sqrt(tolerance / abs(drift))) if seen else np.inf
    return RigidLimit(drift, deviation, holds_to, tolerance, float(lines[-1]))
