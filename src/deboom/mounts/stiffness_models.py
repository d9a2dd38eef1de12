"""Other models of the dynamic stiffness (Kelvin-Voigt, Berg, any regressor)."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.mounts.piecewise_cubic import (
    PieceOptions,
    PiecewiseCubic,
    TrainingRegion,
    fit_piecewise_cubic,
)
from deboom.mounts.response_surface import (
    DynamicStiffnessSurface,
    StiffnessModel,
    StiffnessSamples,
    agreement,
)
from deboom.physics.dynamic_stiffness import kelvin_voigt

SMALL = 1e-4
"""Relative amplitude below which the closed form cancels and its leading terms are exact enough."""


def friction_stiffness(relative_amplitude: npt.ArrayLike) -> ComplexArray:
    """First harmonic of Berg's friction force in the steady state.

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


if TYPE_CHECKING:
    import pandas as pd

Fit = Callable[[StiffnessSamples], StiffnessModel]
"""How a model comes out of measured lines."""

PROCESS_LINES = 600
"""Lines that the Gaussian process is fitted to: its effort grows with their cube."""


def standard_models() -> dict[str, Fit]:
    """Models worth comparing: cubics in one, two and cross-validated pieces, and alternatives."""
    fit_surface = DynamicStiffnessSurface.fit

    def cubics(options: PieceOptions) -> Fit:
        return lambda samples: fit_surface(*samples.lines, options=options, run=samples.run)

    return {
        "one cubic": cubics(PieceOptions(pieces=1)),
        "two cubics, threshold": cubics(PieceOptions(split="threshold")),
        "two cubics, least squares": cubics(PieceOptions()),
        "cubics, cross-validated": cubics(PieceOptions(pieces="cv")),
        "Kelvin-Voigt": lambda samples: KelvinVoigtModel.fit(*samples.lines),
        "Berg": lambda samples: BergModel.fit(*samples.lines),
        "splines": lambda samples: RegressionModel.fit(*samples.lines, regressor=spline_surface()),
        "Gaussian process": lambda samples: RegressionModel.fit(
            *samples.lines, regressor=gaussian_process(), max_lines=PROCESS_LINES
        ),
    }


def compare_models(
    fits: Mapping[str, Fit],
    training: StiffnessSamples,
    check: StiffnessSamples,
    truth: ComplexArray | None = None,
) -> pd.DataFrame:
    """Fit several models to the same lines and hold them against others.

    Parameters
    ----------
    fits : mapping of str to callable
        Name of each model, and how it is fitted; `standard_models` gives some.
    training : StiffnessSamples
        Lines to fit, with the names of their runs where a model is cross-validated.
    check : StiffnessSamples
        Lines to compare with, such as runs held out. Those inside of every model's region count.
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
    variables = (check.preload, check.amplitude, check.frequency)
    models, seconds = {}, {}
    for name, fit in fits.items():
        begin = time.perf_counter()
        models[name] = fit(training)
        seconds[name] = time.perf_counter() - begin
    inside = np.all([model.inside(*variables) for model in models.values()], axis=0)
    if not inside.any():
        raise InputError("no line to check lies where all models were measured")
    compared = StiffnessSamples(
        check.preload[inside],
        check.displacement[inside],
        check.frequency[inside],
        check.stiffness[inside],
    )
    rows = []
    for name, model in models.items():
        modelled = model.predict(compared.preload, compared.amplitude, compared.frequency)
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
