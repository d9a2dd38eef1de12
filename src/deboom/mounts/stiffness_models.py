"""Other models of the dynamic stiffness (Kelvin-Voigt, Berg, regressors) and their comparison."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from sklearn.base import clone

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.mounts.response_surface import (
    DynamicStiffnessSurface,
    StiffnessModel,
    StiffnessSamples,
    agreement,
)
from deboom.physics.dynamic_stiffness import kelvin_voigt

if TYPE_CHECKING:
    import pandas as pd

SMALL = 1e-4
"""Relative amplitude below which the closed form cancels and its leading terms are exact enough."""

PROCESS_LINES = 600
"""Lines that the Gaussian process is fitted to: its effort grows with their cube."""

Fit = Callable[[StiffnessSamples], StiffnessModel]
"""A way from measured lines to a fitted model."""


def friction_stiffness(relative_amplitude: npt.ArrayLike) -> ComplexArray:
    """Return the first harmonic of Berg's friction force in the steady state.

    Parameters
    ----------
    relative_amplitude : array, shape (...)
        Displacement amplitude over the displacement at which half of the friction force is reached,
        at least 0 [1].

    Returns
    -------
    array, shape (...)
        Complex stiffness over the stiffness at vanishing amplitude [1]: from 1 without loss at rest
        to 0 at large amplitudes.

    Raises
    ------
    InputError
        A negative amplitude.

    Notes
    -----
    M. Berg, Vehicle System Dynamics 30 (1998), 197-212: from the turning point (x_s, F_s) on,
    ``F = F_s + (x - x_s) (F_max - F_s) / (x_2 (1 - F_s/F_max) + x - x_s)``. Over a cycle of
    amplitude ``r x_2`` the force at the turning points is ``m F_max`` with
    ``m = (√(1 + 6 r + r²) - 1 - r)/2``. With ``B = 1 + m``, ``c = B + r`` and ``q = √(c² - r²)``
    the first Fourier coefficients are::

        Re = 2 B² / (q (c + q))
        Im = 2/(π r²) [2 r - B² ln(1 + 2 r/B)]        (the loss of Berg's eq. 8)
    """
    r = np.asarray(relative_amplitude, dtype=float)
    if np.any(r < 0):
        raise InputError("a displacement amplitude is a peak value of at least 0")
    base = 1 + (np.sqrt(1 + 6 * r + r**2) - 1 - r) / 2
    middle = base + r
    root = np.sqrt(middle**2 - r**2)
    storage = 2 * base**2 / (root * (middle + root))
    # far from cancelling, then replaced by the leading term of the series
    safe = np.maximum(r, SMALL)
    loss = 2 / (np.pi * safe**2) * (2 * safe - base**2 * np.log1p(2 * safe / base))
    loss = np.where(r < SMALL, 8 * r / (3 * np.pi), loss)
    return np.asarray(storage + 1j * loss, dtype=complex)


class KelvinVoigtModel(StiffnessModel):
    """A spring and a viscous damper that follow the preload, ``K = k(F0) + jω c(F0)``.

    Parameters
    ----------
    regressor : PiecewiseCubicRegressor, optional
        Cubics over the preload, fitted to the spring [N/m] and to the damper [N s/m].
    preload_unit : str
        ``N`` for a static force, ``N m`` for a wheel torque.

    Notes
    -----
    It knows no amplitude, and its loss grows with the frequency.
    """

    def __init__(
        self, regressor: PiecewiseCubicRegressor | None = None, *, preload_unit: str = "N"
    ) -> None:
        self.regressor = regressor
        self.preload_unit = preload_unit

    def _fit(
        self,
        points: RealArray,
        stiffness: ComplexArray,
        weight: RealArray,
        runs: npt.NDArray[Any] | None,
    ) -> None:
        preload, omega = points[:, :1], 2 * np.pi * points[:, 2]
        self.spring_, self.damper_ = _copy(self.regressor), _copy(self.regressor)
        self.spring_.fit(preload, stiffness.real, weight, runs)
        self.damper_.fit(preload, stiffness.imag / omega, weight * omega**2, runs)

    @property
    def n_parameters(self) -> int:
        """Coefficients of spring and damper."""
        return int(self.spring_.coefficients_.size + self.damper_.coefficients_.size)

    def _values(self, points: RealArray) -> ComplexArray:
        spring, damper = self.spring_.predict(points[:, :1]), self.damper_.predict(points[:, :1])
        return kelvin_voigt(points[:, 2], spring, damper)


@dataclass(frozen=True)
class BergShape:
    """Amplitude and frequency dependence of Berg's element, relative to its elastic part.

    Parameters
    ----------
    friction : float
        Stiffness of the friction element at vanishing amplitude [1].
    friction_amplitude : float
        Displacement at which half of the friction force is reached [m].
    viscous : float
        Stiffness of the Maxwell element far above its corner frequency [1].
    corner_frequency : float
        Corner frequency of the Maxwell element [Hz].
    """

    friction: float
    friction_amplitude: float
    viscous: float
    corner_frequency: float

    def __call__(self, amplitude: RealArray, frequency: RealArray) -> ComplexArray:
        """Return the stiffness over the elastic one [1] at amplitude [m] and frequency [Hz]."""
        relative = 1j * frequency / self.corner_frequency
        maxwell = relative / (1 + relative)
        friction = friction_stiffness(amplitude / self.friction_amplitude)
        return np.asarray(1 + self.friction * friction + self.viscous * maxwell, dtype=complex)


class BergModel(StiffnessModel):
    """Elastic, friction and Maxwell element side by side, all following the preload alike.

    Parameters
    ----------
    regressor : PiecewiseCubicRegressor, optional
        Cubics over the preload, fitted to the elastic stiffness [N/m].
    preload_unit : str
        ``N`` for a static force, ``N m`` for a wheel torque.

    Notes
    -----
    ``K = k(F0) [1 + φ κ(|s|/x_2) + v jf/(f_c + jf)]`` with κ from `friction_stiffness`. For given
    shape, k(F0) is a linear least-squares problem, solved inside of the search for the shape
    (variable projection; Golub and Pereyra, 1973).
    """

    def __init__(
        self, regressor: PiecewiseCubicRegressor | None = None, *, preload_unit: str = "N"
    ) -> None:
        self.regressor = regressor
        self.preload_unit = preload_unit

    def _fit(
        self,
        points: RealArray,
        stiffness: ComplexArray,
        weight: RealArray,
        runs: npt.NDArray[Any] | None,
    ) -> None:
        preload, amplitude, frequency = points[:, :1], points[:, 1], points[:, 2]
        middle = np.array([0.5, np.median(amplitude), 0.5, np.median(frequency)])
        root = np.sqrt(weight)

        def elastic_for(
            shape: BergShape, regressor: PiecewiseCubicRegressor
        ) -> PiecewiseCubicRegressor:
            relative = shape(amplitude, frequency)
            squared = np.abs(relative) ** 2
            projected = (stiffness * relative.conj()).real / squared
            elastic = _copy(regressor)
            return elastic.fit(preload, projected, weight * squared, runs)

        def shape_of(logarithms: RealArray) -> BergShape:
            return BergShape(*(middle * np.exp(logarithms)).tolist())

        regressor = _copy(self.regressor)
        first = elastic_for(shape_of(np.zeros(4)), regressor)
        same_pieces = _copy(self.regressor).set_params(split=first.split_points_)

        def misfit(logarithms: RealArray) -> RealArray:
            shape = shape_of(logarithms)
            elastic = elastic_for(shape, same_pieces).predict(preload)
            modelled = elastic * shape(amplitude, frequency)
            error = root * (modelled - stiffness) / np.abs(stiffness).mean()
            return np.concatenate([error.real, error.imag])

        # four decades to either side: beyond them an element is not there
        best = least_squares(misfit, np.zeros(4), bounds=(-np.log(1e4), np.log(1e4)))
        self.shape_ = shape_of(best.x)
        self.elastic_ = elastic_for(self.shape_, regressor)

    @property
    def n_parameters(self) -> int:
        """Coefficients of the elastic part and four of the shape."""
        return int(self.elastic_.coefficients_.size) + 4

    def _values(self, points: RealArray) -> ComplexArray:
        relative = self.shape_(points[:, 1], points[:, 2])
        return np.asarray(self.elastic_.predict(points[:, :1]) * relative)


def gaussian_process() -> Any:
    """Return a Gaussian process with one length per variable and white noise, for ≤ 1000 lines."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MinMaxScaler

    kernel = ConstantKernel(1.0, (1e-3, 1e4)) * RBF(np.ones(3), (5e-2, 1e3))
    noise = WhiteKernel(1e-4, (1e-10, 1.0))
    process = GaussianProcessRegressor(kernel + noise, normalize_y=True)
    return make_pipeline(MinMaxScaler((-1, 1)), process)


def spline_surface(n_knots: int = 6) -> Any:
    """Return cubic splines in each variable and their pairwise products, as a ridge regression.

    Parameters
    ----------
    n_knots : int
        Knots along each variable, at quantiles.
    """
    from sklearn.linear_model import RidgeCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, SplineTransformer

    return make_pipeline(
        SplineTransformer(n_knots=n_knots, degree=3, knots="quantile", include_bias=False),
        PolynomialFeatures(degree=2, interaction_only=True, include_bias=False),
        RidgeCV(np.logspace(-9, 1, 11)),
    )


def standard_models() -> dict[str, Fit]:
    """Return models worth comparing: cubics in one, two and cross-validated pieces, and others."""

    def fit(model: StiffnessModel, most: int | None = None) -> Fit:
        def fitted(samples: StiffnessSamples) -> StiffnessModel:
            chosen = samples
            if most is not None and len(samples) > most:
                picked = np.linspace(0, len(samples) - 1, most).round().astype(int)
                chosen = samples.select(np.isin(np.arange(len(samples)), picked))
            fresh: StiffnessModel = clone(model)
            return fresh.fit(chosen.points, chosen.stiffness, groups=chosen.run)

        return fitted

    def cubics(**parameters: Any) -> Fit:
        return fit(DynamicStiffnessSurface(PiecewiseCubicRegressor(**parameters)))

    return {
        "one cubic": cubics(pieces=1),
        "two cubics, threshold": cubics(split="threshold"),
        "two cubics, least squares": cubics(),
        "cubics, cross-validated": cubics(pieces="cv"),
        "Kelvin-Voigt": fit(KelvinVoigtModel()),
        "Berg": fit(BergModel()),
        "splines": fit(DynamicStiffnessSurface(spline_surface())),
        "Gaussian process": fit(DynamicStiffnessSurface(gaussian_process()), PROCESS_LINES),
    }


def compare_models(
    fits: Mapping[str, Fit],
    training: StiffnessSamples,
    check: StiffnessSamples,
    truth: ComplexArray | None = None,
) -> pd.DataFrame:
    """Fit several models to the same lines and compare them at others.

    Parameters
    ----------
    fits : mapping of str to callable
        Name of each model, and how it is fitted; `standard_models` gives some.
    training : StiffnessSamples
        Lines to fit, with the names of their runs where a model is cross-validated.
    check : StiffnessSamples
        Lines to compare with, such as runs left out. Those inside of every model's region count.
    truth : array, shape (n_check,), optional
        True stiffness at the lines of `check`, where a virtual bench knows it [N/m].

    Returns
    -------
    pandas.DataFrame
        One row per model: number of parameters, lines compared and their share, R² of both parts of
        stiffness and force, rms error against measurement (and truth), seconds to fit.

    Raises
    ------
    InputError
        No models; or no line to check inside of the region of all models.
    """
    import pandas as pd

    if not fits:
        raise InputError("there are no models to compare")
    models, seconds = {}, {}
    for name, fit in fits.items():
        begin = time.perf_counter()
        models[name] = fit(training)
        seconds[name] = time.perf_counter() - begin
    inside = np.all([model.supported(check.points) for model in models.values()], axis=0)
    if not inside.any():
        raise InputError("no line to check lies where all models were measured")
    compared = check.select(inside)
    rows = []
    for name, model in models.items():
        modelled = model.predict(compared.points)
        result = agreement(compared, modelled)
        row = {
            "model": name,
            "parameters [1]": model.n_parameters,
            "lines compared [1]": result.n_lines,
            "share of lines [%]": 100 * result.n_lines / len(check),
            "R² Re K [%]": 100 * result.r2_real,
            "R² Im K [%]": 100 * result.r2_imag,
            "R² Re force [%]": 100 * result.r2_force_real,
            "R² Im force [%]": 100 * result.r2_force_imag,
            "rms error [%]": 100 * result.rms_error,
        }
        if truth is not None:
            true = np.asarray(truth)[inside]
            error = np.abs(modelled - true) / np.abs(true)
            row["rms error against truth [%]"] = 100 * float(np.sqrt(np.mean(error**2)))
        rows.append({**row, "time to fit [s]": seconds[name]})
    return pd.DataFrame(rows)


def _copy(regressor: PiecewiseCubicRegressor | None) -> PiecewiseCubicRegressor:
    return PiecewiseCubicRegressor() if regressor is None else clone(regressor)
