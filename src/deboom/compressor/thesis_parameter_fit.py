"""The thesis's 44 numbers, fitted to a hammer test."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.inertance_fit import (
    START_GAIN,
    Bounds,
    PointFit,
    fit_at_virtual_point,
    inertance_and_apparent_mass,
    real_columns,
)
from deboom.compressor.model import CompressorModel, gain_from_parameters, mounts_at_virtual_point
from deboom.compressor.parameter_information import (
    Identifiability,
    Knowledge,
    identifiability,
    knowledge,
)
from deboom.compressor.parameters import MinimalParameters, ThesisParameters
from deboom.measurement.compressor_test import Drawing

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

    `start` (44,): from the drawing, in the units of the parametrisation; `seconds`: time of the fit
    [s].
    """

    start: RealArray
    bounds: Bounds
    fit: PointFit
    seconds: float
    seen: Identifiability
    knowledge: Knowledge


def thesis_start(drawing: Drawing) -> tuple[ThesisParameters, RealArray]:
    """Start from the drawing with the gain of a medium rubber; 44 values for three mounts."""
    mounts = drawing.mounts
    parametrisation = ThesisParameters(tuple(mount.name for mount in mounts))
    stiffness = mounts_at_virtual_point(mounts)
    gain = gain_from_parameters(START_GAIN, 0.0)
    drawn = CompressorModel(drawing.mass, drawing.centre, drawing.inertia, stiffness, gain)
    return parametrisation, parametrisation.values_of(drawn, mounts)


def thesis_bounds(drawing: Drawing, start: RealArray) -> Bounds:
    """Set the bounds of the thesis around the start, its misprints mended."""
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


def fit_thesis_parameters(identification: Identification, drawing: Drawing) -> ThesisFit:
    """Fit the thesis's numbers to inertance and apparent mass, and judge each of them.

    - `identification`: inertance at the virtual point, as the position sheet has it, and the lines.
    - `drawing`: start and middle of the bounds.

    What is known of each number after the test is not taken from this fit, whose weights are no
    noise, but from the self-calibration: with the change G of its 35 numbers per change of the 44,
    the information is ``Gᵀ C₃₅⁻¹ G + diag(1/bound²)``. G is exact, since every change of the 44
    moves the apparent mass along the 35.
    """
    parametrisation, start = thesis_start(drawing)
    bounds = thesis_bounds(drawing, start)
    objective = inertance_and_apparent_mass(
        identification.inertance.frequency[identification.fitted],
        identification.inertance.values[identification.fitted],
        identification.length,
    )
    begin = time.perf_counter()
    fit = fit_at_virtual_point(parametrisation, objective, start, bounds)
    seconds = time.perf_counter() - begin
    width = (bounds.upper - bounds.lower) / 2
    return ThesisFit(
        start,
        bounds,
        fit,
        seconds,
        identifiability(parametrisation.names, fit.jacobian, width),
        knowledge(parametrisation.names, _posterior(identification, fit, width), width),
    )


def _posterior(identification: Identification, fit: PointFit, prior: RealArray) -> RealArray:
    """Covariance of the thesis's numbers, shape (n_parameters, n_parameters)."""
    lines = identification.inertance.frequency[identification.fitted]
    by_thesis = fit.parametrisation.sensitivities(fit.values, lines)
    minimal = MinimalParameters(identification.length)
    # at the same compressor, where one set of changes lies wholly within the other
    by_minimal = minimal.sensitivities(minimal.values_of(fit.model), lines)
    unit = np.sqrt(np.diag(identification.calibrated.parameter_covariance))
    columns = real_columns(by_minimal) * unit
    change = np.linalg.lstsq(columns, real_columns(by_thesis) * prior, rcond=None)[0]
    scaled = identification.calibrated.parameter_covariance / np.outer(unit, unit)
    information = change.T @ np.linalg.solve(scaled, change) + np.eye(prior.size)
    return np.asarray(np.linalg.inv(information) * np.outer(prior, prior))
