"""The thesis's 44 numbers and identical round mounts, fitted to a hammer test."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.calibrate import Prior, SelfCalibration, self_calibrate
from deboom.compressor.identifiability import (
    Identifiability,
    Knowledge,
    identifiability,
    knowledge,
)
from deboom.compressor.identify import Identification
from deboom.compressor.model import (
    GAIN_SHAPE_NAMES,
    CompressorModel,
    gain_from_parameters,
    mounts_at_virtual_point,
)
from deboom.compressor.parameters import (
    N_MASS,
    IdenticalMountParameters,
    MinimalParameters,
    ThesisParameters,
)
from deboom.compressor.virtual_point_fit import (
    START_GAIN,
    Bounds,
    PointFit,
    fit_at_virtual_point,
    fit_by_slsqp,
    inertance_and_apparent_mass,
    real_columns,
)
from deboom.measurement.compressor_test import CompressorMount, Drawing

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
OFFSET_DEVIATION = 6.3e-3
"""1 σ of a mount's place against its drawing: half the thesis's bound [m]."""
TILT_DEVIATION = math.radians(2.5)
"""1 σ of a mount's tilt against its drawing: half the thesis's bound [rad]."""
WORSE = 1.05
"""Reduced χ, against that of any mounts, from which identical mounts are refuted."""


@dataclass(frozen=True, eq=False)
class ThesisFit:
    """The 44 numbers of table 11, and how far to believe each.

    `start` (44,): from the drawing, in the units of the parametrisation; `seconds`: time of the fit
    [s]; `reference_seconds`: time of the reference, 0 without it [s].
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


def fit_thesis_parameters(
    found: Identification, drawing: Drawing, *, with_reference: bool = False
) -> ThesisFit:
    """Fit the thesis's numbers to inertance and apparent mass, and judge each of them.

    - `found`: inertance at the virtual point, as the position sheet has it, and the lines.
    - `drawing`: start and middle of the bounds.
    - `with_reference`: whether to repeat the fit by sequential quadratic programming.

    What is known of each number after the test is not taken from this fit, whose weights are no
    noise, but from the self-calibration: with the change G of its 35 numbers per change of the 44,
    the information is ``Gᵀ C₃₅⁻¹ G + diag(1/bound²)``. G is exact, since every change of the 44
    moves the apparent mass along the 35.
    """
    parametrisation, start = thesis_start(drawing)
    bounds = thesis_bounds(drawing, start)
    objective = inertance_and_apparent_mass(
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
    columns = real_columns(by_minimal) * unit
    change = np.linalg.lstsq(columns, real_columns(by_thesis) * prior, rcond=None)[0]
    scaled = found.calibrated.parameter_covariance / np.outer(unit, unit)
    information = change.T @ np.linalg.solve(scaled, change) + np.eye(prior.size)
    return np.asarray(np.linalg.inv(information) * np.outer(prior, prior))


@dataclass(frozen=True, eq=False)
class IdenticalFit:
    """Identical round mounts, and whether the test agrees.

    `chi_ratio`: reduced χ over that of the minimal parameters, which allow any mounts [1].
    """

    drawn: tuple[CompressorMount, ...]
    calibrated: SelfCalibration
    chi_ratio: float

    @property
    def mounts(self) -> tuple[CompressorMount, ...]:
        """Mounts as found, stiffness where the real part of the gain is 1."""
        parametrisation = self.calibrated.parametrisation
        assert isinstance(parametrisation, IdenticalMountParameters)
        return parametrisation.mounts(self.calibrated.values)

    @property
    def deviations(self) -> RealArray:
        """1 σ of the 5 n_mounts + 2 numbers of mounting [m, rad, 1]."""
        covariance = self.calibrated.parameter_covariance
        return np.asarray(np.sqrt(np.diag(covariance))[N_MASS : -len(GAIN_SHAPE_NAMES)])

    @property
    def holds(self) -> bool:
        """Whether identical mounts explain the test as well as any mounts do."""
        return self.chi_ratio < WORSE


def fit_identical_mounts(found: Identification, drawing: Drawing) -> IdenticalFit:
    """Find place, tilt and stiffness of identical round mounts by self-calibration."""
    drawn = drawing.mounts
    parametrisation = IdenticalMountParameters(drawn, found.length)
    n = len(drawn)
    values = found.calibrated.values
    gain = values[-len(GAIN_SHAPE_NAMES) :]
    stiffness = np.array([mount.stiffness for mount in drawn])
    # the drawing's stiffness is static; that of the reference line is larger by the gain's rise
    at_reference = np.trace(found.calibrated.model.stiffness[:3, :3]) / stiffness.sum()
    common = np.log(at_reference * np.array([stiffness[:, 0].mean(), stiffness[:, 1:].mean()]))
    start = np.concatenate([values[:N_MASS], np.zeros(5 * n), common, gain])

    def deviations(of_gain: RealArray) -> RealArray:
        return np.concatenate(
            [
                np.full(N_MASS, np.inf),
                np.full(3 * n, OFFSET_DEVIATION),
                np.full(2 * n, TILT_DEVIATION),
                np.full(2, np.inf),
                of_gain,
            ]
        )

    width = 2 * deviations(np.full(gain.size, np.inf))
    bounds = Bounds(start - width, start + width)
    point = fit_at_virtual_point(parametrisation, found.whitened, start, bounds)
    prior = Prior(
        np.concatenate([np.zeros(N_MASS + 5 * n + 2), START_GAIN]),
        deviations(found.known.prior[-gain.size :]),
    )
    raw = found.raw.select(found.fitted)
    calibrated = self_calibrate(parametrisation, raw, found.test, point.values, prior)
    return IdenticalFit(drawn, calibrated, calibrated.reduced_chi / found.calibrated.reduced_chi)
