"""Fit of a compressor's model to inertance at the virtual point, with its linear start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, ComplexArray, RealArray
from deboom.compressor.model import CompressorModel, gain_from_parameters
from deboom.compressor.parameters import (
    MinimalParameters,
    Parametrisation,
    mass_matrix_of_pseudo_inertia,
    parameters_of_pseudo_inertia,
)
from deboom.errors import InputError

THESIS_BANDS = ((10.0, 30.0), (100.0, 150.0))
"""Around the rigid-body modes, and on the mass line [Hz]."""
BAND_SPLIT = 60.0
"""Lines below and above are weighted by sizes of their own in the thesis's objective [Hz]."""
AT_BOUND = 1e-3
"""A parameter this near its bound, relative to the width of its bounds, counts as held by it."""
START_GAIN = (np.log(0.35), np.log(0.03), 0.27, np.log(0.25), np.log(0.05))
"""A rubber of medium stiffening and loss, in the order of `GAIN_SHAPE_NAMES`."""
SMALLEST_SPREAD = 1e-3
"""Smallest eigenvalue of the scaled pseudo-inertia against its largest one."""
PASSES, LARGEST_EVALUATIONS = 3, 200
_PSEUDO_ENTRIES = [(i, j) for i in range(4) for j in range(i, 4)]


def in_bands(
    frequency: npt.ArrayLike, bands: tuple[tuple[float, float], ...] = THESIS_BANDS
) -> BoolArray:
    """Mark the lines inside any of the bands, ends included, shape (n_frequency,).

    InputError: a band without a line.
    """
    lines = np.asarray(frequency, dtype=float)
    marks = [(lines >= low) & (lines <= high) for low, high in bands]
    for (low, high), mark in zip(bands, marks, strict=True):
        if not mark.any():
            raise InputError(f"no line of the measurement lies in the band {low:g}-{high:g} Hz")
    return np.asarray(np.logical_or.reduce(marks))


def thinned(marked: BoolArray, largest: int) -> BoolArray:
    """Keep at most `largest` of the marked lines, spread evenly, shape (n_frequency,)."""
    places = np.flatnonzero(marked)
    kept = np.round(np.linspace(0, places.size - 1, min(largest, places.size))).astype(int)
    lines = np.zeros(marked.size, dtype=bool)
    lines[places[kept]] = True
    return lines


@dataclass(frozen=True, eq=False)
class Objective:
    """Weighted complex deviations of a model from a measurement at the virtual point.

    `frequency` (n_frequency,): lines [Hz]; `measured` (n_frequency, 6, 6): inertance [1/kg, 1/(kg
    m), 1/(kg m²)]; `left`, `right` (6, 6): matrices that weigh the inertance Y as
    ``left Y rightᵀ``, and the apparent mass by their inverses; `weight` (n_frequency,): weight of
    the inertance at each line; `mass_weight` (n_frequency,): weight of the apparent mass at each
    line; None leaves it out.
    """

    frequency: RealArray
    measured: ComplexArray
    left: RealArray
    right: RealArray
    weight: RealArray
    mass_weight: RealArray | None = None

    def residuals(self, apparent: ComplexArray, inertance: ComplexArray) -> ComplexArray:
        """Weigh the deviations of a model's matrices, shape (n_term, n_frequency, 6, 6)."""
        return self.derivatives(apparent - np.linalg.inv(self.measured), inertance - self.measured)

    def derivatives(self, apparent: ComplexArray, inertance: ComplexArray) -> ComplexArray:
        """Weigh changes of both matrices (..., n_frequency, 6, 6), terms before the lines."""
        by_line = (slice(None), np.newaxis, np.newaxis)
        terms: list[ComplexArray] = [self.left @ inertance @ self.right.T * self.weight[by_line]]
        if self.mass_weight is not None:
            left, right = np.linalg.inv(self.left).T, np.linalg.inv(self.right)
            terms.append(np.asarray(left @ apparent @ right * self.mass_weight[by_line]))
        return np.stack(terms, axis=-4)


def whitened_inertance(
    frequency: RealArray,
    measured: ComplexArray,
    response_inverse: RealArray,
    excitation_inverse: RealArray,
    deviation: RealArray,
) -> Objective:
    """Weigh the inertance at the virtual point in units of its own noise.

    `frequency` (n_frequency,): lines [Hz]; `measured` (n_frequency, 6, 6): inertance [1/kg, 1/(kg
    m), 1/(kg m²)]; `response_inverse` (6, n_channel): pseudo-inverse that made the six responses;
    `excitation_inverse` (6, n_impact): pseudo-inverse that made the six loads; `deviation`
    (n_frequency,): standard deviation of the real and of the imaginary part of a raw FRF [1/kg].

    Independent noise of the raw FRFs is coloured by the two pseudo-inverses P and Q; it is white
    again in ``C_P⁻¹ Y_VP C_Q⁻ᵀ`` with ``C_P C_Pᵀ = P Pᵀ``.
    """
    left, right = (
        np.linalg.inv(np.linalg.cholesky(inverse @ inverse.T))
        for inverse in (response_inverse, excitation_inverse)
    )
    return Objective(frequency, measured, left, right, 1 / deviation)


def inertance_and_apparent_mass(
    frequency: RealArray, measured: ComplexArray, length: float
) -> Objective:
    """Weigh inertance and apparent mass together, each against its size in the band: the thesis.

    `frequency` (n_frequency,): lines [Hz]; `measured` (n_frequency, 6, 6): inertance [1/kg, 1/(kg
    m), 1/(kg m²)]; `length`: characteristic length that makes rotations and displacements
    comparable [m].

    Thesis, section 4.4: complex deviations of both matrices in 10-30 and 100-150 Hz. Each entry is
    scaled by the length, each side of `BAND_SPLIT` by its root mean square over all entries.
    """
    unit = np.repeat([1.0, length], 3)
    scale = np.outer(unit, unit)
    low = frequency < BAND_SPLIT
    weights = []
    for values in (measured * scale, np.linalg.inv(measured) / scale):
        weight = np.empty(frequency.shape)
        for band in (low, ~low):
            if band.any():
                weight[band] = 1 / np.sqrt(np.mean(np.abs(values[band]) ** 2))
        weights.append(weight)
    return Objective(frequency, measured, np.diag(unit), np.diag(unit), *weights)


class Bounds(NamedTuple):
    """Smallest and largest value of each parameter, shape (n_parameters,) each."""

    lower: RealArray
    upper: RealArray


@dataclass(frozen=True, eq=False)
class PointFit:
    """Result of a fit at the virtual point.

    `values` (n_parameters,): parameters in their units; `cost`: half the sum of the squared
    residuals [1]; `jacobian` (n_residuals, n_parameters): jacobian of the real residuals at
    `values`; `at_bound`: names of the parameters that a bound holds.
    """

    parametrisation: Parametrisation
    values: RealArray
    cost: float
    jacobian: RealArray
    at_bound: tuple[str, ...]
    converged: bool

    @property
    def model(self) -> CompressorModel:
        """Fitted compressor."""
        return self.parametrisation.model(self.values)


def fit_at_virtual_point(
    parametrisation: Parametrisation,
    objective: Objective,
    start: RealArray,
    bounds: Bounds,
) -> PointFit:
    """Fit by nonlinear least squares.

    `start` (n_parameters,): values inside the bounds. InputError: a start outside its bounds.
    """
    from scipy.optimize import least_squares

    outside = (start < bounds.lower) | (start > bounds.upper)
    if outside.any():
        name = parametrisation.names[int(np.flatnonzero(outside)[0])]
        raise InputError(f"the start value of {name} lies outside its bounds")

    def residuals(values: RealArray) -> RealArray:
        apparent = parametrisation.model(values).apparent_mass(objective.frequency)
        deviations = objective.residuals(apparent, np.asarray(np.linalg.inv(apparent)))
        return real_columns(deviations[np.newaxis])[:, 0]

    def jacobian(values: RealArray) -> RealArray:
        inertance = parametrisation.model(values).inertance(objective.frequency)
        by_mass = parametrisation.sensitivities(values, objective.frequency)
        by_inertance = -(inertance @ by_mass @ inertance)
        return real_columns(objective.derivatives(by_mass, by_inertance))

    width = bounds.upper - bounds.lower
    scale: RealArray | Literal["jac"] = width / 2 if np.isfinite(width).all() else "jac"
    result = least_squares(
        residuals,
        start,
        jac=jacobian,
        bounds=(bounds.lower, bounds.upper),
        x_scale=scale,
        method="trf",
        max_nfev=LARGEST_EVALUATIONS,
        xtol=1e-8,
        ftol=1e-8,
        gtol=1e-8,
    )
    near = np.minimum(result.x - bounds.lower, bounds.upper - result.x) < AT_BOUND * width
    held = near & np.isfinite(width)
    return PointFit(
        parametrisation,
        result.x,
        float(result.cost),
        np.asarray(result.jac),
        tuple(name for name, at in zip(parametrisation.names, held, strict=True) if at),
        bool(result.status > 0),
    )


def linear_start(
    parametrisation: MinimalParameters, frequency: npt.ArrayLike, inertance: npt.ArrayLike
) -> RealArray:
    """Estimate mass and stiffness by weighted linear least squares, without any drawing.

    `frequency` (n_frequency,): above 0, with lines both near and above the rigid-body modes [Hz];
    `inertance` (n_frequency, 6, 6): measured at the virtual point [1/kg, 1/(kg m), 1/(kg m²)].
    Returns (35,) parameters of `parametrisation`: the gain a medium rubber's with the loss found.
    InputError: data whose mass line has no positive mass: a channel or an impact of the wrong sign.

    ``(M − v'(f) K'/ω² − j K''/ω²) H = 1`` with a stiffening v' of medium rubber is linear in the
    entries of M, K' and K''. The first pass weights the lines by ``1/|H|``, the next by the model
    found (Sanathanan and Koerner), which turns the error of the equation into one of H. A mass
    matrix that no body can have is moved to the nearest pseudo-inertia with positive eigenvalues.
    """
    lines = np.asarray(frequency, dtype=float)
    squared = (2 * np.pi * lines) ** 2
    unit = np.repeat([1.0, parametrisation.length], 3)
    scaled = np.asarray(inertance) * np.outer(unit, unit)
    mass_basis = _pseudo_basis(parametrisation.length) / np.outer(unit, unit)
    stiffness_basis = parametrisation.stiffness_basis / np.outer(unit, unit)
    stiffening = gain_from_parameters(START_GAIN, parametrisation.reference_frequency).real
    over_frequency = [
        (mass_basis, np.ones_like(squared)),
        (stiffness_basis, -stiffening.at(lines) / squared),
        (stiffness_basis, -1j / squared),
    ]
    terms = np.concatenate(
        [
            factor[:, np.newaxis, np.newaxis] * (basis[:, np.newaxis] @ scaled)
            for basis, factor in over_frequency
        ]
    )
    unity = np.broadcast_to(np.eye(6), scaled.shape)
    weight: ComplexArray = (
        np.eye(6) / np.linalg.norm(scaled, axis=(1, 2))[:, np.newaxis, np.newaxis]
    )
    for _ in range(PASSES):
        columns = real_columns(weight @ terms)
        right = real_columns((weight @ unity)[np.newaxis])
        solution = np.linalg.lstsq(columns, right[:, 0])[0]
        apparent = sum(
            factor[:, np.newaxis, np.newaxis] * np.tensordot(part, basis, axes=1)
            for part, (basis, factor) in zip(
                np.split(solution, [10, 30]), over_frequency, strict=True
            )
        )
        model = np.linalg.inv(np.asarray(apparent))
        weight = model / np.linalg.norm(model, axis=(1, 2))[:, np.newaxis, np.newaxis]
    mass, real, imaginary = np.split(solution, [10, 30])
    gain = np.array(START_GAIN)
    loss = float(real @ imaginary / (real @ real))
    typical = float(gain_from_parameters(START_GAIN, 20.0).imaginary.at(20.0))
    gain[2] *= loss / typical
    gain[3] += np.log(max(loss, 0.05 * typical) / typical)
    return np.concatenate([_mass_numbers(mass, parametrisation.length), real, gain])


def real_columns(terms: ComplexArray) -> RealArray:
    """Write each term (n_term, ...) as one column, real over imaginary parts."""
    flat = terms.reshape(terms.shape[0], -1)
    return np.concatenate([flat.real, flat.imag], axis=1).T


def _pseudo_basis(length: float) -> RealArray:
    """6×6 mass matrix of each free entry of the pseudo-inertia in units of length, (10, 6, 6)."""
    unit = np.array([length, length, length, 1.0])
    basis = np.zeros((len(_PSEUDO_ENTRIES), 4, 4))
    for number, (row, column) in enumerate(_PSEUDO_ENTRIES):
        basis[number, row, column] = basis[number, column, row] = unit[row] * unit[column]
    return mass_matrix_of_pseudo_inertia(basis)


def _mass_numbers(entries: RealArray, length: float) -> RealArray:
    """Parameters of the body that lies nearest to a linear estimate."""
    pseudo = np.zeros((4, 4))
    for value, (row, column) in zip(entries, _PSEUDO_ENTRIES, strict=True):
        pseudo[row, column] = pseudo[column, row] = value
    if pseudo[3, 3] <= 0:
        raise InputError(
            "the inertance at the virtual point belongs to a negative mass: look for a channel or "
            "an impact of the wrong sign (the quality report names it)"
        )
    values, vectors = np.linalg.eigh(pseudo)
    possible = (vectors * np.maximum(values, SMALLEST_SPREAD * values.max())) @ vectors.T
    unit = np.array([length, length, length, 1.0])
    return parameters_of_pseudo_inertia(possible * np.outer(unit, unit), length)
