"""Up to which frequency the compressor is rigid: its mass line must not drift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.compressor.model import CompressorModel
from deboom.errors import InputError

SMALLEST_LINES = 8
GRID = 1001
"""Steps in which the limit is looked for, in f² from 0 to the highest line."""
NEARNESS = tuple(np.linspace(0.0, 0.95, 39))
"""Of the body's first resonance, as the squared ratio of the highest line to it."""


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
    Towards a first resonance f_n of the body its apparent mass drifts as ``f²/(1 − (f/f_n)²)``,
    while that of a rigid body is constant: ``M_meas + v K/ω² = A + B f²/(1 − (f/f_n)²)`` is fitted
    to all 36 elements, since parts that swing against each other show in the products and the
    coupling as well as on the diagonal; f_n is looked for above the highest line. Three standard
    deviations count as none.
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
    fits = [_fit(squared, elements, nearness) for nearness in NEARNESS]
    best = int(np.argmin([scatter for *_, scatter in fits]))
    level, growth, spread, scatter = fits[best]
    deviation = float(np.sqrt(scatter * spread) / level)
    # at the highest line itself the growth is that of the fitted law
    drift = float(growth / level * _law(1.0, NEARNESS[best]))
    seen = drift > 3 * deviation and drift > tolerance
    grid = np.linspace(0, 1, GRID)
    beyond = growth / level * _law(grid, NEARNESS[best]) > tolerance
    holds_to = float(lines[-1] * np.sqrt(grid[np.argmax(beyond)])) if seen else np.inf
    return RigidLimit(drift, deviation, holds_to, tolerance, float(lines[-1]))


def _law(squared: npt.ArrayLike, nearness: float) -> RealArray:
    """Growth ``f²/(1 − (f/f_n)²)`` with f and f_n relative to the highest line."""
    share = np.asarray(squared, dtype=float)
    return np.asarray(share / (1 - nearness * share))


def _fit(
    squared: RealArray, elements: RealArray, nearness: float
) -> tuple[float, float, float, float]:
    """Norms of constant and growth, variance of the growth at the top over that of a line."""
    columns = np.stack([np.ones_like(squared), _law(squared, nearness)], axis=1)
    fit, *_ = np.linalg.lstsq(columns, elements)
    scatter = float(np.sum((elements - columns @ fit) ** 2)) / (squared.size - 2)
    variance = np.linalg.inv(columns.T @ columns)[1, 1] * float(_law(1.0, nearness)) ** 2
    level, growth = np.linalg.norm(fit, axis=1)
    return float(level), float(growth), float(variance), scatter
