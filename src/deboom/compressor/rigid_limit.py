"""Up to which frequency the compressor is rigid: its mass line must not drift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.compressor.model import CompressorModel
from deboom.errors import InputError

SMALLEST_LINES = 8
GRID = 1001
"""Steps in which the limit is looked for, in f² from 0 to the highest line."""


@dataclass(frozen=True)
class RigidLimit:
    """Drift of the measured mass line.

    Parameters
    ----------
    drift : float
        Change of the apparent mass, less that of the mounts, from 0 Hz to the highest line: norm
        of the 6×6 matrix relative to the mass matrix, rotations scaled by the radius of gyration
        [1].
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
            f"The apparent mass drifts by {self.drift:.1%} to {self.highest:.0f} Hz: the rigid "
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
    A first flexible mode at f_n lets the apparent mass drift as ``c (f/f_n)²``, steeper towards
    f_n, while that of a rigid body is constant: ``M_meas + v K/ω² = A + B f² + C f⁴`` is fitted to
    each of the 36 elements, since two parts that swing against each other show in the products
    and the coupling as well as on the diagonal. Three standard deviations count as none.
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
    length = np.sqrt(np.trace(model.inertia) / (3 * model.mass))
    scale = np.repeat([1.0, 1 / length], 3)
    elements = (left * np.outer(scale, scale)).reshape(lines.size, 36)
    squared = (lines / lines[-1]) ** 2
    columns = np.stack([np.ones_like(squared), squared, squared**2], axis=1)
    fit, *_ = np.linalg.lstsq(columns, elements)
    misfit = elements - columns @ fit
    level = np.linalg.norm(fit[0])
    to_highest = np.array([0.0, 1.0, 1.0])
    scatter = np.sum(misfit**2) / (lines.size - columns.shape[1])
    spread = to_highest @ np.linalg.inv(columns.T @ columns) @ to_highest
    deviation = float(np.sqrt(scatter * spread) / level)
    drift = float(np.linalg.norm(to_highest @ fit) / level)
    grid = np.linspace(0, 1, GRID)
    drifts = np.linalg.norm(np.outer(grid, fit[1]) + np.outer(grid**2, fit[2]), axis=1) / level
    seen = drift > 3 * deviation and drift > tolerance
    holds_to = float(lines[-1] * np.sqrt(grid[np.argmax(drifts > tolerance)])) if seen else np.inf
    return RigidLimit(drift, deviation, holds_to, tolerance, float(lines[-1]))
