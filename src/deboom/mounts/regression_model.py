"""Any scikit-learn regressor as a model of the dynamic stiffness: Gaussian process, splines."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.mounts.stiffness_model import StiffnessModel, StiffnessSamples
from deboom.mounts.training_region import TrainingRegion


class Regressor(Protocol):
    """What is used of a scikit-learn regressor."""

    def fit(self, X: RealArray, y: RealArray) -> Any:
        """Fit to scaled rows."""

    def predict(self, X: RealArray) -> npt.NDArray[Any]:
        """Predict at scaled rows."""


@dataclass(frozen=True, eq=False)
class RegressionModel(StiffnessModel):
    """Real and imaginary part by two copies of one regressor.

    Parameters
    ----------
    region : TrainingRegion
        Where lines were measured.
    preload_unit : str
        ``N`` for a static force, ``N m`` for a wheel torque.
    real, imag : Regressor
        Fitted to variables scaled to [-1, 1] over the region, and to stiffness over `reference`.
    reference : float
        Mean magnitude of the measured stiffness [N/m].
    parameters : int
        Fitted numbers in both regressors.
    """

    real: Regressor
    imag: Regressor
    reference: float
    parameters: int

    @classmethod
    def fit(
        cls,
        preload: npt.ArrayLike,
        amplitude: npt.ArrayLike,
        frequency: npt.ArrayLike,
        stiffness: npt.ArrayLike,
        weights: npt.ArrayLike | None = None,
        *,
        regressor: Regressor,
        preload_unit: str = "N",
        max_lines: int | None = None,
    ) -> RegressionModel:
        """Fit two copies of a regressor to measured lines.

        Parameters
        ----------
        preload, amplitude, frequency, stiffness : array, shape (n,)
            As for `DynamicStiffnessSurface`.
        weights : array, shape (n,), optional
            All alike: not every regressor takes them.
        regressor : scikit-learn regressor
            Left as it is.
        preload_unit : str
            ``N`` or ``N m``.
        max_lines : int, optional
            Only so many lines, evenly picked in their order, where effort grows with their cube.

        Returns
        -------
        RegressionModel

        Raises
        ------
        InputError
            Lines that cannot be fitted, weights that differ.
        """
        from sklearn.base import clone
        from sklearn.exceptions import ConvergenceWarning

        samples = StiffnessSamples.of_amplitude(preload, amplitude, frequency, stiffness, weights)
        if np.ptp(samples.weights) > 0:
            raise InputError("a regression model fits all lines alike: leave out the weights")
        if max_lines is not None and max_lines < 2:
            raise InputError(f"max_lines is at least 2, not {max_lines}")
        region = TrainingRegion.around(samples.points)
        count = min(max_lines or len(samples), len(samples))
        picked = np.linspace(0, len(samples) - 1, count).round().astype(int)
        rows = _scaled(region, samples.points[picked])
        reference = float(np.abs(samples.stiffness).mean())
        parts = []
        for values in (samples.stiffness.real, samples.stiffness.imag):
            with warnings.catch_warnings():
                # a kernel parameter on its bound is a result, such as "no noise found"
                warnings.simplefilter("ignore", ConvergenceWarning)
                parts.append(clone(regressor).fit(rows, values[picked] / reference))
        return cls(
            region=region,
            preload_unit=preload_unit,
            real=parts[0],
            imag=parts[1],
            reference=reference,
            parameters=sum(_count_parameters(part) for part in parts),
        )

    @property
    def n_parameters(self) -> int:
        """Fitted numbers in both regressors."""
        return self.parameters

    def _evaluate(self, points: RealArray) -> ComplexArray:
        rows = _scaled(self.region, points)
        # some regressors return a column for one response
        parts = [
            np.asarray(part.predict(rows), dtype=float).ravel() for part in (self.real, self.imag)
        ]
        return np.asarray(self.reference * (parts[0] + 1j * parts[1]))


def gaussian_process() -> Regressor:
    """Gaussian process with one length per variable and white noise, for up to 1000 lines."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    kernel = ConstantKernel(1.0, (1e-3, 1e4)) * RBF(np.ones(3), (5e-2, 1e3))
    process: Regressor = GaussianProcessRegressor(
        kernel + WhiteKernel(1e-4, (1e-10, 1.0)), normalize_y=True
    )
    return process


def spline_surface(n_knots: int = 6) -> Regressor:
    """Cubic splines in each variable and their pairwise products, shrunk by cross-validation.

    Parameters
    ----------
    n_knots : int
        Knots along each variable, at quantiles.
    """
    from sklearn.linear_model import RidgeCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, SplineTransformer

    surface: Regressor = make_pipeline(
        SplineTransformer(n_knots=n_knots, degree=3, knots="quantile", include_bias=False),
        PolynomialFeatures(degree=2, interaction_only=True, include_bias=False),
        RidgeCV(np.logspace(-9, 1, 11)),
    )
    return surface


def _scaled(region: TrainingRegion, points: RealArray) -> RealArray:
    width = np.where(region.upper > region.lower, region.upper - region.lower, 1.0)
    return np.asarray(2 * (points - region.lower) / width - 1)


def _count_parameters(fitted: Any) -> int:
    """Coefficients of a linear last step, or training rows and kernel parameters of a process."""
    last = fitted[-1] if hasattr(fitted, "steps") else fitted
    for name in ("coef_", "alpha_"):
        if hasattr(last, name) and np.ndim(getattr(last, name)):
            extra = len(last.kernel_.theta) if hasattr(last, "kernel_") else 1
            return int(np.size(getattr(last, name))) + extra
    raise InputError(f"{type(last).__name__} does not tell its number of parameters")
