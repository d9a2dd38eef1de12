"""The thesis's fit: 44 numbers from the drawing, and what the test says of each of them."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain_parameters import gain_from_parameters
from deboom.compressor.identifiability import (
    Identifiability,
    Knowledge,
    identifiability,
    knowledge,
)
from deboom.compressor.linear_start import START_GAIN
from deboom.compressor.minimal_parameters import MinimalParameters
from deboom.compressor.model import CompressorModel
from deboom.compressor.objectives import InertanceAndApparentMass
from deboom.compressor.thesis_parameters import ThesisParameters
from deboom.compressor.virtual_point_fit import (
    Bounds,
    PointFit,
    fit_at_virtual_point,
    fit_by_slsqp,
)

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification
    from deboom.measurement.inertance_test import Drawing

POSITION_BOUND = 0.0126
"""[m]; the thesis states 12.5 mm, and its table 11 has a change of 12.51 mm."""
ROTATION_BOUND = math.radians(5.0)
STIFFNESS_BOUND = 0.35
"""Relative; the axial stiffnesses of table 11 left the 0.25 N/mm, and even 25 %."""
INERTIA_BOUND = 0.10
"""Relative; the thesis prints 300 kg m², which is the size in kg cm²."""
PRODUCT_BOUND = 5e-4
"""[kg m²]: 5 kg cm²."""
CENTRE_BOUND = 3e-3
"""[m]"""
MASS_BOUND = 0.5
"""[kg]"""
GAIN_BOUND = 0.6
"""Relative, and 0.3 of v_rel; the thesis states none."""
SCALE_BOUND = 0.3


@dataclass(frozen=True, eq=False)
class ThesisFit:
    """The 44 numbers of table 11, and how far to believe each.

    Parameters
    ----------
    start : array, shape (44,)
        From the drawing, of the units of the parametrisation.
    bounds : Bounds
        The thesis's, with its misprints mended.
    fit : PointFit
        By least squares.
    seconds : float
        That it took [s].
    reference : PointFit or None
        By sequential quadratic programming, near to the thesis's method.
    reference_seconds : float
        [s]; 0 without it.
    seen : Identifiability
        Of the Jacobian at the result: rank and null space.
    known : Knowledge
        Bounds as 1 σ before; all that the self-calibrated test adds after.
    """

    start: RealArray
    bounds: Bounds
    fit: PointFit
    seconds: float
    reference: PointFit | None
    reference_seconds: float
    seen: Identifiability
    known: Knowledge


def thesis_start(drawing: Drawing) -> tuple[ThesisParameters, RealArray]:
    """Start values: the drawing, and the gain of a medium rubber.

    Parameters
    ----------
    drawing : Drawing

    Returns
    -------
    tuple of ThesisParameters and array, shape (n_parameters,)
        44 values for three mounts.
    """
    mounts = drawing.mounts
    parametrisation = ThesisParameters(tuple(mount.name for mount in mounts))
    drawn = CompressorModel.on_mounts(
        drawing.mass, drawing.centre, drawing.inertia, mounts, gain_from_parameters(START_GAIN, 0.0)
    )
    return parametrisation, parametrisation.values_of(drawn, mounts)


def thesis_bounds(drawing: Drawing, start: RealArray) -> Bounds:
    """Bounds of the thesis around the start, its misprints mended.

    Parameters
    ----------
    drawing : Drawing
    start : array, shape (n_parameters,)
        From `thesis_start`.

    Returns
    -------
    Bounds
    """
    n = 3 * len(drawing.mounts)
    width = np.concatenate(
        [
            np.full(n, POSITION_BOUND),
            np.full(n, ROTATION_BOUND),
            STIFFNESS_BOUND * start[2 * n : 3 * n],
            INERTIA_BOUND * np.diag(drawing.inertia),
            np.full(3, PRODUCT_BOUND),
            np.full(3, CENTRE_BOUND),
            [MASS_BOUND],
            GAIN_BOUND * np.abs(start[-7:-1]),
            [SCALE_BOUND],
        ]
    )
    return Bounds(start - width, start + width)


def fit_thesis_parameters(
    found: Identification, drawing: Drawing, *, with_reference: bool = False
) -> ThesisFit:
    """Fit the thesis's numbers to inertance and apparent mass, and judge each of them.

    Parameters
    ----------
    found : Identification
        Gives the inertance at the virtual point, as the position sheet has it, and the lines.
    drawing : Drawing
        Start and middle of the bounds.
    with_reference : bool
        Whether to repeat the fit by sequential quadratic programming.

    Returns
    -------
    ThesisFit

    Notes
    -----
    What is known of each number after the test is not taken from this fit, whose weights are no
    noise, but from the self-calibration: with the change G of its 35 numbers per change of the 44,
    the information is ``Gᵀ C₃₅⁻¹ G + diag(1/bound²)``. G is exact, since every change of the 44
    moves the apparent mass along the 35.
    """
    parametrisation, start = thesis_start(drawing)
    bounds = thesis_bounds(drawing, start)
    objective = InertanceAndApparentMass(
        found.inertance.frequency[found.fitted], found.inertance.values[found.fitted], found.length
    )
    begin = time.perf_counter()
    fit = fit_at_virtual_point(parametrisation, objective, start, bounds)
    middle = time.perf_counter()
    reference = fit_by_slsqp(parametrisation, objective, start, bounds) if with_reference else None
    end = time.perf_counter()
    width = (bounds.upper - bounds.lower) / 2
    return ThesisFit(
        start,
        bounds,
        fit,
        middle - begin,
        reference,
        end - middle if with_reference else 0.0,
        identifiability(parametrisation.names, fit.jacobian, width),
        knowledge(parametrisation.names, _posterior(found, fit, width), width),
    )


def _posterior(found: Identification, fit: PointFit, prior: RealArray) -> RealArray:
    """Covariance of the thesis's numbers, shape (n_parameters, n_parameters)."""
    lines = found.inertance.frequency[found.fitted]
    by_thesis = fit.parametrisation.sensitivities(fit.values, lines)
    minimal = MinimalParameters(found.length)
    # at the same compressor, where one set of changes lies wholly within the other
    by_minimal = minimal.sensitivities(minimal.values_of(fit.model), lines)
    unit = np.sqrt(np.diag(found.calibrated.parameter_covariance))
    columns = _real(by_minimal) * unit
    change = np.linalg.lstsq(columns, _real(by_thesis) * prior, rcond=None)[0]
    scaled = found.calibrated.parameter_covariance / np.outer(unit, unit)
    information = change.T @ np.linalg.solve(scaled, change) + np.eye(prior.size)
    return np.asarray(np.linalg.inv(information) * np.outer(prior, prior))


def _real(derivatives: ComplexArray) -> RealArray:
    """One column per parameter, real over imaginary parts."""
    flat = derivatives.reshape(derivatives.shape[0], -1)
    return np.concatenate([flat.real, flat.imag], axis=1).T
