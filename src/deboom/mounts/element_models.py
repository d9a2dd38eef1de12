"""Mounts as rubber elements whose stiffness follows the preload: Kelvin-Voigt and Berg."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from deboom.arrays import ComplexArray, RealArray
from deboom.mounts.berg import friction_stiffness
from deboom.mounts.cubic_fit import PieceOptions, fit_piecewise_cubic
from deboom.mounts.cubic_pieces import PiecewiseCubic
from deboom.mounts.stiffness_model import StiffnessModel, StiffnessSamples
from deboom.mounts.training_region import TrainingRegion
from deboom.physics.dynamic_stiffness import kelvin_voigt

DEFAULT_OPTIONS = PieceOptions()


@dataclass(frozen=True, eq=False)
class KelvinVoigtModel(StiffnessModel):
    """A spring and a viscous damper that follow the preload.

    Parameters
    ----------
    region : TrainingRegion
        Where lines were measured.
    preload_unit : str
        ``N`` for a static force, ``N m`` for a wheel torque.
    spring : PiecewiseCubic
        Stiffness over the preload [N/m].
    damper : PiecewiseCubic
        Damping over the preload [N s/m].

    Notes
    -----
    ``K = k(F0) + jω c(F0)``: no amplitude, and a loss that grows with the frequency.
    """

    spring: PiecewiseCubic
    damper: PiecewiseCubic

    @classmethod
    def fit(
        cls,
        preload: npt.ArrayLike,
        amplitude: npt.ArrayLike,
        frequency: npt.ArrayLike,
        stiffness: npt.ArrayLike,
        weights: npt.ArrayLike | None = None,
        *,
        preload_unit: str = "N",
        options: PieceOptions = DEFAULT_OPTIONS,
    ) -> KelvinVoigtModel:
        """Fit spring and damper, cubics in pieces of the preload; as `DynamicStiffnessSurface`."""
        samples = StiffnessSamples.of_amplitude(preload, amplitude, frequency, stiffness, weights)
        omega = 2 * np.pi * samples.frequency
        damping = samples.stiffness.imag / omega
        return cls(
            region=TrainingRegion.around(samples.points),
            preload_unit=preload_unit,
            spring=_over_preload(samples, samples.stiffness.real, samples.weights, options),
            damper=_over_preload(samples, damping, samples.weights * omega**2, options),
        )

    @property
    def n_parameters(self) -> int:
        """Coefficients of spring and damper."""
        return self.spring.n_coefficients + self.damper.n_coefficients

    def _evaluate(self, points: RealArray) -> ComplexArray:
        preload = points[:, :1]
        return kelvin_voigt(points[:, 2], self.spring(preload)[:, 0], self.damper(preload)[:, 0])


@dataclass(frozen=True)
class BergShape:
    """How Berg's element follows amplitude and frequency, relative to its elastic part.

    Parameters
    ----------
    friction : float
        Stiffness of the friction element at vanishing amplitude [1].
    friction_amplitude : float
        Displacement at which half of the friction force is reached [m].
    viscous : float
        Stiffness of the Maxwell element far above its corner frequency [1].
    corner_frequency : float
        Of the Maxwell element [Hz].
    """

    friction: float
    friction_amplitude: float
    viscous: float
    corner_frequency: float

    def __call__(self, amplitude: RealArray, frequency: RealArray) -> ComplexArray:
        """Complex stiffness over the elastic one [1] at amplitude [m] and frequency [Hz]."""
        relative = 1j * frequency / self.corner_frequency
        maxwell = relative / (1 + relative)
        friction = friction_stiffness(amplitude / self.friction_amplitude)
        return np.asarray(1 + self.friction * friction + self.viscous * maxwell, dtype=complex)


@dataclass(frozen=True, eq=False)
class BergModel(StiffnessModel):
    """Elastic, friction and Maxwell element side by side, all following the preload alike.

    Parameters
    ----------
    region : TrainingRegion
        Where lines were measured.
    preload_unit : str
        ``N`` for a static force, ``N m`` for a wheel torque.
    elastic : PiecewiseCubic
        Elastic stiffness over the preload [N/m].
    shape : BergShape
        The other elements, relative to it.

    Notes
    -----
    ``K = k(F0) [1 + φ κ(|s|/x_2) + v jf/(f_c + jf)]`` with κ from `friction_stiffness`. For given
    shape, k(F0) is a linear least-squares problem, solved inside of the search for the shape
    (variable projection; Golub and Pereyra, 1973).
    """

    elastic: PiecewiseCubic
    shape: BergShape

    @classmethod
    def fit(
        cls,
        preload: npt.ArrayLike,
        amplitude: npt.ArrayLike,
        frequency: npt.ArrayLike,
        stiffness: npt.ArrayLike,
        weights: npt.ArrayLike | None = None,
        *,
        preload_unit: str = "N",
        options: PieceOptions = DEFAULT_OPTIONS,
    ) -> BergModel:
        """Fit the elements, cubics in pieces of the preload; as `DynamicStiffnessSurface`."""
        samples = StiffnessSamples.of_amplitude(preload, amplitude, frequency, stiffness, weights)
        middle = np.array([0.5, np.median(samples.amplitude), 0.5, np.median(samples.frequency)])
        root = np.sqrt(samples.weights)

        def elastic_for(shape: BergShape, choice: PieceOptions) -> PiecewiseCubic:
            relative = shape(samples.amplitude, samples.frequency)
            squared = np.abs(relative) ** 2
            projected = (samples.stiffness * relative.conj()).real / squared
            return _over_preload(samples, projected, samples.weights * squared, choice)

        def shape_of(logarithms: RealArray) -> BergShape:
            return BergShape(*(middle * np.exp(logarithms)).tolist())

        splits = elastic_for(shape_of(np.zeros(4)), options).split_points

        def misfit(logarithms: RealArray) -> RealArray:
            shape = shape_of(logarithms)
            elastic = elastic_for(shape, PieceOptions(split=splits, overlap=options.overlap))
            modelled = elastic(samples.preload[:, np.newaxis])[:, 0] * shape(
                samples.amplitude, samples.frequency
            )
            error = root * (modelled - samples.stiffness) / np.abs(samples.stiffness).mean()
            return np.concatenate([error.real, error.imag])

        # four decades to either side: beyond them an element is not there
        found = least_squares(misfit, np.zeros(4), bounds=(-np.log(1e4), np.log(1e4)))
        shape = shape_of(found.x)
        return cls(
            region=TrainingRegion.around(samples.points),
            preload_unit=preload_unit,
            elastic=elastic_for(shape, options),
            shape=shape,
        )

    @property
    def n_parameters(self) -> int:
        """Coefficients of the elastic part and four of the shape."""
        return self.elastic.n_coefficients + 4

    def _evaluate(self, points: RealArray) -> ComplexArray:
        relative = self.shape(points[:, 1], points[:, 2])
        return np.asarray(self.elastic(points[:, :1])[:, 0] * relative)


def _over_preload(
    samples: StiffnessSamples, values: RealArray, weights: RealArray, options: PieceOptions
) -> PiecewiseCubic:
    rows = samples.preload[:, np.newaxis]
    return fit_piecewise_cubic(rows, values[:, np.newaxis], weights, options)
