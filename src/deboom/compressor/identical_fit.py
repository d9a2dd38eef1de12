"""Where all mounts are one round part, the test says where each of them sits and how it leans."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.compressor.gain_parameters import GAIN_SHAPE_NAMES
from deboom.compressor.identical_mounts import IdenticalMountParameters
from deboom.compressor.linear_start import START_GAIN
from deboom.compressor.minimal_parameters import N_MASS
from deboom.compressor.objectives import WhitenedInertance
from deboom.compressor.self_calibration import (
    Prior,
    SelfCalibration,
    WeighedMass,
    self_calibrate,
)
from deboom.compressor.virtual_point_fit import Bounds, fit_at_virtual_point

if TYPE_CHECKING:
    from deboom.arrays import RealArray
    from deboom.compressor.identify import Identification
    from deboom.measurement.inertance_test import CompressorMount, Drawing

OFFSET_DEVIATION = 6.3e-3
"""1 σ of a mount's place against its drawing: half the thesis's bound [m]."""
TILT_DEVIATION = math.radians(2.5)
"""1 σ of a mount's tilt against its drawing: half the thesis's bound [rad]."""
WORSE = 1.05
"""Reduced χ, against that of any mounts, from which identical mounts are refuted."""


@dataclass(frozen=True, eq=False)
class IdenticalFit:
    """Identical round mounts, and whether the test agrees.

    Parameters
    ----------
    drawn : tuple of CompressorMount
        Where the drawing has them.
    calibrated : SelfCalibration
        With `IdenticalMountParameters`.
    chi_ratio : float
        Reduced χ over that of the minimal parameters, which allow any mounts [1].
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
    """Find place, tilt and stiffness of identical round mounts by self-calibration.

    Parameters
    ----------
    found : Identification
        Of any mounts; where this one starts.
    drawing : Drawing
        Places and tilts are counted from it.

    Returns
    -------
    IdenticalFit
    """
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
    part = found.raw.select(found.fitted)
    objective = WhitenedInertance(
        part.frf.frequency,
        found.inertance.values[found.fitted],
        found.response.inverse,
        found.excitation.inverse,
        np.sqrt(np.mean(part.deviation**2, axis=(1, 2))),
    )
    width = np.concatenate(
        [
            np.full(N_MASS, np.inf),
            np.full(3 * n, 2 * OFFSET_DEVIATION),
            np.full(2 * n, 2 * TILT_DEVIATION),
            np.full(2 + gain.size, np.inf),
        ]
    )
    bounds = Bounds(start - width, start + width)
    point = fit_at_virtual_point(parametrisation, objective, start, bounds)
    prior = Prior(
        np.concatenate([np.zeros(N_MASS + 5 * n + 2), START_GAIN]),
        np.concatenate(
            [
                np.full(N_MASS, np.inf),
                np.full(3 * n, OFFSET_DEVIATION),
                np.full(2 * n, TILT_DEVIATION),
                np.full(2, np.inf),
                found.known.prior[-len(GAIN_SHAPE_NAMES) :],
            ]
        ),
    )
    mass = found.test.weighed_mass
    weighed = None if mass is None else WeighedMass(mass, found.test.weighed_mass_deviation)
    calibrated = self_calibrate(
        parametrisation, part, found.test.tolerances, point.values, weighed=weighed, prior=prior
    )
    return IdenticalFit(drawn, calibrated, calibrated.reduced_chi / found.calibrated.reduced_chi)
