"""Error budget: what alignment, calibration and noise leave unknown of a dynamic stiffness."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.uncertainty import complex_normals
from deboom.mounts.measuring_chain import (
    Alignment,
    AlignmentEstimate,
    BodyRecord,
    ErrorSource,
    stated_alignment,
)
from deboom.mounts.operating_map import OperatingMap, Preload, operating_maps
from deboom.mounts.response_surface import DynamicStiffnessSurface

IDENTIFIED = 0.15
"""Largest half width of the 95 % band of a direction that counts as identified [1]."""

TWO_SIDED = 1.959964
"""Standard deviations on both sides that hold 95 % of a normal distribution [1]."""

LEAST_DRAWS = 200

LINES = 2000
"""Lines of each body that drawn surfaces are fitted to at most. The effect of noise on the surface
is slightly overstated where there are more."""

LINES_PER_SOURCE = 300
"""Lines on which each source of error is looked at alone."""

_BAND = (0.025, 0.975)


@checked(points="n 3", lower="n ?", upper="n ?", imag_half_width="n ?")
class DirectionBudget:
    """Uncertainty of the surface of one direction at n lines that it was fitted to.

    `points` (n, 3) are these lines; `lower` and `upper` (n,) the 95 % band of |K| about the
    surface, relative to it; `imag_half_width` (n,) half the band of Im K relative to |Im K|;
    `misfit` the rms part of the residuals that noise does not explain, which is in the band;
    `sources` half the band by each stated tolerance alone, without self-calibration, medians over
    lines [1]. `enlargement` is the factor in the band by what contradicts the measuring chain,
    `AlignmentEstimate.enlargement` [1]. `contradicted`: an alarm says that the mount does not stand
    as stated, `CrossStiffness.clear`: the band is of another direction.
    """

    name: str
    points: RealArray
    lower: RealArray
    upper: RealArray
    imag_half_width: RealArray
    misfit: float
    sources: Mapping[ErrorSource, float]
    enlargement: float = 1.0
    contradicted: bool = False

    @property
    def half_width_95(self) -> float:
        """Half width of the 95 % band of |K|, median over the lines [1]."""
        return float(np.median(self.upper - self.lower) / 2)

    @property
    def imag_half_width_95(self) -> float:
        """Half width of the 95 % band of Im K, median over the lines [1]."""
        return float(np.median(self.imag_half_width))

    @property
    def identified(self) -> bool:
        """Whether the band is narrow enough to speak of a measured stiffness, uncontradicted."""
        unopposed = self.enlargement == 1.0 and not self.contradicted
        return unopposed and self.half_width_95 <= IDENTIFIED


def error_budget(
    chains: Sequence[AlignmentEstimate],
    records: Sequence[BodyRecord],
    surfaces: Mapping[str, DynamicStiffnessSurface],
    variable: Preload,
    static_force_noise: float,
    *,
    seed: int,
    n_draws: int = LEAST_DRAWS,
) -> dict[str, DirectionBudget]:
    """Propagate what is unknown of the measuring chains into the response surfaces.

    - `chains`, `records`: measuring chains of the bodies, stated or calibrated, and the lines that
      the surfaces were fitted to, in one order.
    - `surfaces`: surfaces by ``<mount> <axis>``, over the preload `variable`.
    - `static_force_noise`: standard deviation of a static force reading [N].
    - `seed`: seed of the draws, from 1.
    - `n_draws`: measuring chains that are drawn, at least `LEAST_DRAWS` for a 95 % band.
    - raises InputError: a seed below 1.

    Notes
    -----
    A chain that is drawn replaces the laboratory's knowledge, not the recordings: what would the
    stiffness be, if the sensors were like this? Noise is drawn line by line for displacement, force
    and preload. To each draw a surface with the same split points is fitted. Quantiles over the
    draws, joined in squares with the misfit of the surface, give the band, times the enlargement by
    what contradicts the chain.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    generator = np.random.default_rng(seed)
    thinned = [_thinned(record.mean_over_repeats(), LINES) for record in records]
    maps = operating_maps(chains, thinned)
    drawn: list[_DrawnChain] = []
    by_source: dict[ErrorSource, list[_DrawnChain]] = {}
    for chain, record in zip(chains, thinned, strict=True):
        alignment, few_lines = chain.alignment, _thinned(record, LINES_PER_SOURCE)
        drawn.append(_drawn_chain(alignment, record, chain.draw(n_draws, generator)))
        stated = stated_alignment(alignment).draw(n_draws, generator)
        for source in dict.fromkeys(alignment.sources):
            acting = [source is name for name in alignment.sources]
            alone = _drawn_chain(alignment, few_lines, stated * acting)
            by_source.setdefault(source, []).append(alone)
    budgets = {}
    for name, surface in surfaces.items():
        pieces = [chain for chain in drawn if name in chain.columns]
        enlargement = max(
            chain_today.enlargement
            for chain_today, chain in zip(chains, drawn, strict=True)
            if name in chain.columns
        )
        stiffness = np.vstack([chain.stiffness(name, generator) for chain in pieces])
        widths = {
            source: _half_width_alone(name, [c for c in of_source if name in c.columns])
            for source, of_source in by_source.items()
            if any(name in c.columns for c in of_source)
        }
        noise = np.concatenate([chain.record.wheel_torque_noise for chain in pieces])
        if variable is Preload.STATIC_FORCE:
            noise = np.full_like(noise, static_force_noise)
        budgets[name] = _direction_budget(
            maps[name], surface, stiffness, widths, variable, noise, generator, enlargement
        )
    return budgets


def _thinned(record: BodyRecord, most: int) -> BodyRecord:
    return record.part(slice(None, None, -(-len(record) // most)))


@dataclass(frozen=True, eq=False)
class _DrawnChain:
    """One body's channels → motion and force at its points, for each of t drawn alignments."""

    columns: Mapping[str, int]
    record: BodyRecord
    motion: RealArray
    force: RealArray

    def stiffness(self, name: str, generator: np.random.Generator | None = None) -> ComplexArray:
        """Stiffness of a direction for every line and draw, shape (n, t) [N/m]."""
        motion, force = self.motion[:, self.columns[name]], self.force[:, self.columns[name]]
        record = self.record
        omega = record.squared_omega[:, np.newaxis]
        moved = -(record.acceleration @ motion.T) / omega
        pushed = record.cell_force @ force.T
        if generator is not None:
            of_motion = np.sqrt(record.acceleration_noise**2 @ motion.mean(axis=0) ** 2)
            of_force = np.sqrt(record.cell_noise**2 @ force.mean(axis=0) ** 2)
            moved += (of_motion[:, np.newaxis] / omega) * complex_normals(moved.shape, generator)
            pushed += of_force[:, np.newaxis] * complex_normals(pushed.shape, generator)
        return np.asarray(pushed / moved)


def _drawn_chain(alignment: Alignment, record: BodyRecord, parameters: RealArray) -> _DrawnChain:
    directions = alignment.body.measured_directions
    columns = {f"{point.mount} {axis}": column for point, axis, column in directions}
    motion, force = alignment.motion_matrix(parameters), alignment.force_matrix(parameters)
    return _DrawnChain(columns, record, motion, force)


def _half_width_alone(name: str, pieces: Sequence[_DrawnChain]) -> float:
    """Half width by one source, median over lines; pieces of a mount are averaged."""
    magnitudes = [np.abs(chain.stiffness(name)) for chain in pieces]
    relative = np.mean([m / np.median(m, axis=1, keepdims=True) for m in magnitudes], axis=0)
    return float(np.median(_half_width(relative)))


def _half_width(values: RealArray) -> RealArray:
    lower, upper = np.quantile(values, _BAND, axis=1)
    return np.asarray((upper - lower) / 2)


def _direction_budget(
    measured: OperatingMap,
    surface: DynamicStiffnessSurface,
    drawn: ComplexArray,
    widths: Mapping[ErrorSource, float],
    variable: Preload,
    preload_noise: RealArray,
    generator: np.random.Generator,
    enlargement: float,
) -> DirectionBudget:
    """Budget of one direction from drawn stiffnesses (n, t)."""
    used = ~measured.near_floor
    samples = measured.samples(variable)
    points, drawn = samples.points, drawn[used]
    shift = preload_noise[used, np.newaxis] * generator.standard_normal(drawn.shape)
    shifted = drawn - surface.gradient(points)[:, :1] * shift
    refitted = surface.predict_refitted(points, shifted, points)
    fitted = surface.predict(points, extrapolate=True)
    magnitude = np.abs(refitted) / np.abs(fitted)[:, np.newaxis] - 1
    lower, upper = np.quantile(magnitude, _BAND, axis=1)

    relative_noise = (measured.displacement_noise[used] / samples.amplitude) ** 2
    relative_noise = relative_noise + (measured.force_noise[used] / np.abs(samples.force)) ** 2
    # half of the variance of a complex noise lies along the magnitude
    magnitude_noise, of_imag = relative_noise / 2, np.abs(fitted.imag)
    misfit = _misfit(np.abs(samples.stiffness) / np.abs(fitted) - 1, magnitude_noise)
    imag_misfit = _misfit(
        (samples.stiffness - fitted).imag / of_imag,
        magnitude_noise * (np.abs(fitted) / of_imag) ** 2,
    )
    middle = (lower + upper) / 2
    half_width = enlargement * np.hypot((upper - lower) / 2, TWO_SIDED * misfit)
    imag_half_width = np.hypot(_half_width(refitted.imag) / of_imag, TWO_SIDED * imag_misfit)
    return DirectionBudget(
        name=measured.name,
        points=points,
        lower=middle - half_width,
        upper=middle + half_width,
        imag_half_width=enlargement * imag_half_width,
        misfit=misfit,
        sources=widths,
        enlargement=enlargement,
    )


def _misfit(residual: RealArray, noise_variance: RealArray) -> float:
    """Rms of the residuals beyond what noise explains."""
    return math.sqrt(max(0.0, float(np.mean(residual**2) - np.mean(noise_variance))))
