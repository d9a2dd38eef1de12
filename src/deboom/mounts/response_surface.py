"""Response surfaces: dynamic stiffness over preload, displacement amplitude and frequency.

A model gives the complex stiffness of one direction of a mount. It knows where it was measured and
refuses to speak about anything else unless it is told to extrapolate.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.exceptions import ConvergenceWarning

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor, TrainingRegion, named_arrays

VARIABLES = ("preload", "amplitude", "frequency")

STORAGE_FORMAT = 1
"""Format of `DynamicStiffnessSurface.to_arrays`; another number is refused on reading."""

_NODES = np.cos(np.pi * (np.arange(4) + 0.5) / 4)
_PLAIN = ("preload_unit", "n_lines", "r2_real", "r2_imag", "r2_force")
_REGION = ("points", "lower", "upper", "reach")


def operating_points(
    preload: npt.ArrayLike, amplitude: npt.ArrayLike, frequency: npt.ArrayLike
) -> RealArray:
    """Stack preload, amplitude and frequency as points at which a model is asked.

    Parameters
    ----------
    preload, amplitude, frequency : array, broadcastable to one shape
        In the units of the model: [N] or [N m], [m], [Hz].

    Returns
    -------
    array, shape (..., 3)
        One point per element of the common shape.

    Raises
    ------
    InputError
        Shapes that do not broadcast.
    """
    columns = [np.asarray(values, dtype=float) for values in (preload, amplitude, frequency)]
    try:
        return np.stack(np.broadcast_arrays(*columns), axis=-1)
    except ValueError:
        shapes = [column.shape for column in columns]
        raise InputError(f"preload, amplitude and frequency have the shapes {shapes}") from None


@checked(preload="n", displacement="n", frequency="n", stiffness="n")
class StiffnessSamples:
    """Measured dynamic stiffness of one direction, line by line.

    Parameters
    ----------
    preload : array, shape (n,)
        Static force of the direction [N], or wheel torque [N m].
    displacement : array, shape (n,)
        Complex peak at the virtual point [m]; its magnitude is the amplitude.
    frequency : array, shape (n,)
        [Hz].
    stiffness : array, shape (n,)
        Complex dynamic stiffness [N/m].
    run : array of str, shape (n,), optional
        Name of the run that each line belongs to.

    Raises
    ------
    InputError
        Arrays of different lengths, values that are not finite.
    """

    preload: RealArray
    displacement: ComplexArray
    frequency: RealArray
    stiffness: ComplexArray
    run: npt.NDArray[np.str_] | None = None

    def __len__(self) -> int:
        return len(self.preload)

    @property
    def amplitude(self) -> RealArray:
        """Peak displacement amplitude, shape (n,) [m]."""
        return np.abs(self.displacement)

    @property
    def force(self) -> ComplexArray:
        """Complex peak force ``K s``, shape (n,) [N]."""
        return self.stiffness * self.displacement

    @property
    def points(self) -> RealArray:
        """Preload, amplitude and frequency, shape (n, 3)."""
        return np.column_stack([self.preload, self.amplitude, self.frequency])

    def select(self, lines: BoolArray | slice) -> StiffnessSamples:
        """Return some of the lines."""
        return StiffnessSamples(
            self.preload[lines],
            self.displacement[lines],
            self.frequency[lines],
            self.stiffness[lines],
            None if self.run is None else self.run[lines],
        )


@dataclass(frozen=True)
class Agreement:
    """Agreement of a model with measured lines, as in the thesis's tables 6 to 8.

    Parameters
    ----------
    n_lines : int
        Lines compared.
    r2_real, r2_imag : float
        Coefficient of determination of Re K and Im K [1].
    r2_force_real, r2_force_imag : float
        The same of the force ``K s``, in the phase of the measured displacement [1].
    rms_error : float
        Rms of ``|K_model - K| / |K|`` [1].
    """

    n_lines: int
    r2_real: float
    r2_imag: float
    r2_force_real: float
    r2_force_imag: float
    rms_error: float


def r_squared(measured: npt.ArrayLike, modelled: npt.ArrayLike) -> float:
    """Return the coefficient of determination, ``1 - Σ(y - ŷ)² / Σ(y - ȳ)²``.

    Parameters
    ----------
    measured, modelled : array, shape (n,)
        Real, of one unit.

    Returns
    -------
    float
        1 is perfect, 0 is no better than the mean [1].

    Raises
    ------
    InputError
        Shapes that differ, or a measured quantity that does not vary.
    """
    y, fitted = np.asarray(measured, dtype=float), np.asarray(modelled, dtype=float)
    if y.shape != fitted.shape or y.ndim != 1:
        raise InputError(f"{y.shape} measured and {fitted.shape} modelled values: one each")
    total = float(np.sum((y - y.mean()) ** 2))
    if total == 0:
        raise InputError("the measured values are all equal: R² has no meaning for them")
    return float(1 - np.sum((y - fitted) ** 2) / total)


def agreement(samples: StiffnessSamples, modelled: ComplexArray) -> Agreement:
    """Compare measured lines with a model's values.

    Parameters
    ----------
    samples : StiffnessSamples
        Measured lines.
    modelled : array, shape (n,)
        Stiffness of the model at the same lines [N/m].

    Returns
    -------
    Agreement
        R² compares with what was measured, systematic errors included: it is no accuracy.
    """
    force = modelled * samples.displacement
    error = np.abs(modelled - samples.stiffness) / np.abs(samples.stiffness)
    return Agreement(
        n_lines=len(samples),
        r2_real=r_squared(samples.stiffness.real, modelled.real),
        r2_imag=r_squared(samples.stiffness.imag, modelled.imag),
        r2_force_real=r_squared(samples.force.real, force.real),
        r2_force_imag=r_squared(samples.force.imag, force.imag),
        rms_error=float(np.sqrt(np.mean(error**2))),
    )


class StiffnessModel(RegressorMixin, BaseEstimator, ABC):
    """Complex dynamic stiffness over preload, displacement amplitude and frequency.

    A scikit-learn regressor of three variables whose `y` is complex.

    Attributes
    ----------
    region_ : TrainingRegion
        Where lines were measured: preload, amplitude [m], frequency [Hz].
    n_lines_ : int
        Lines it was fitted to.
    """

    preload_unit: str
    region_: TrainingRegion
    n_lines_: int

    def fit(
        self,
        X: npt.ArrayLike,
        y: npt.ArrayLike,
        sample_weight: npt.ArrayLike | None = None,
        groups: npt.ArrayLike | None = None,
    ) -> Self:
        """Fit the model to measured lines.

        Parameters
        ----------
        X : array, shape (n, 3)
            Static force of the direction [N] or wheel torque [N m], peak displacement amplitude at
            the virtual point [m], frequency [Hz].
        y : array, shape (n,)
            Measured stiffness, complex [N/m].
        sample_weight : array, shape (n,), optional
            Inverse to the variance of each line, 1 if not given [1].
        groups : array of str, shape (n,), optional
            Run of each line: a cross-validation of the pieces leaves out whole runs.

        Raises
        ------
        InputError
            Lines that cannot be fitted: shapes, values that are not finite, too few of them; or
            a cross-validation without runs.
        """
        points, stiffness = np.asarray(X, dtype=float), np.asarray(y, dtype=complex)
        if stiffness.size == 0:
            raise InputError("there are no lines to fit a dynamic stiffness to")
        weight = np.ones(len(stiffness))
        if sample_weight is not None:
            weight = np.asarray(sample_weight, dtype=float)
        one_each = stiffness.shape == weight.shape and stiffness.ndim == 1
        if points.shape != (len(stiffness), 3) or not one_each:
            raise InputError(
                "a dynamic stiffness needs one value per line: preload, amplitude and frequency "
                f"have shape {points.shape}, the stiffness {stiffness.shape}, the weights "
                f"{weight.shape}"
            )
        for name, column in zip((*VARIABLES, "stiffness"), (*points.T, stiffness), strict=True):
            bad = np.flatnonzero(~np.isfinite(column))
            if bad.size:
                raise InputError(f"{name} of line {bad[0]} is not finite: leave the line out")
        if np.any(points[:, 1] < 0):
            raise InputError("a displacement amplitude is a peak value of at least 0 m")
        if np.any(points[:, 2] <= 0):
            raise InputError("the frequency of a dynamic stiffness is above 0 Hz")
        if not np.all(weight > 0):
            raise InputError("weights are above 0: leave out lines that do not count")
        runs = None if groups is None else np.asarray(groups)
        if runs is not None and runs.shape != weight.shape:
            raise InputError(f"{runs.size} names of runs for {len(points)} lines: one each")
        self.region_ = TrainingRegion.around(points)
        self.n_lines_ = len(points)
        self._fit(points, stiffness, weight, runs)
        return self

    @abstractmethod
    def _fit(
        self,
        points: RealArray,
        stiffness: ComplexArray,
        weight: RealArray,
        runs: npt.NDArray[Any] | None,
    ) -> None:
        """Fit to checked lines."""

    @abstractmethod
    def _values(self, points: RealArray) -> ComplexArray:
        """Stiffness at any points (n, 3), shape (n,) [N/m]."""

    @property
    @abstractmethod
    def n_parameters(self) -> int:
        """Fitted numbers that make up the model."""

    def predict(self, X: npt.ArrayLike, extrapolate: bool = False) -> ComplexArray:
        """Return the dynamic stiffness at operating points.

        Parameters
        ----------
        X : array, shape (..., 3)
            Preload, amplitude and frequency in `units`, see `operating_points`.
        extrapolate : bool
            Whether points that are not `supported` get the model's value, too.

        Returns
        -------
        array, shape (...)
            Complex [N/m].

        Raises
        ------
        InputError
            A point outside of the measured region, unless `extrapolate`; points that are not
            finite.
        """
        points, shape = _rows(X)
        if not len(points):
            return np.zeros(shape, dtype=complex)
        if not extrapolate:
            inside = self._supported(points)
            if not inside.all():
                raise InputError(self._complaint(points, inside))
        return self._values(points).reshape(shape)

    def supported(self, X: npt.ArrayLike) -> BoolArray:
        """Say where the model is backed by measurements.

        Parameters
        ----------
        X : array, shape (..., 3)
            Preload, amplitude and frequency in `units`.

        Returns
        -------
        array of bool, shape (...)
            False out of the measured ranges, away from every measured line, and where the measured
            lines do not determine the model.
        """
        points, shape = _rows(X)
        inside = self._supported(points) if len(points) else np.zeros(0, dtype=bool)
        return np.asarray(inside.reshape(shape))

    def score(
        self, X: npt.ArrayLike, y: npt.ArrayLike, sample_weight: npt.ArrayLike | None = None
    ) -> float:
        """Return R² of the complex stiffness, ``1 - Σ|y - ŷ|² / Σ|y - ȳ|²`` [1]."""
        measured = np.asarray(y, dtype=complex)
        weight = np.ones(len(measured)) if sample_weight is None else np.asarray(sample_weight)
        squares = np.abs(measured - self.predict(X, extrapolate=True)) ** 2
        spread = np.abs(measured - np.average(measured, weights=weight)) ** 2
        return float(1 - np.sum(weight * squares) / np.sum(weight * spread))

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each variable and of the stiffness."""
        return {
            "preload": self.preload_unit,
            "amplitude": "m",
            "frequency": "Hz",
            "stiffness": "N/m",
        }

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest measured value of each variable, in `units`."""
        bounds = zip(self.region_.lower.tolist(), self.region_.upper.tolist(), strict=True)
        return dict(zip(VARIABLES, bounds, strict=True))

    def _supported(self, points: RealArray) -> BoolArray:
        return self.region_.contains(points)

    def _complaint(self, points: RealArray, inside: BoolArray) -> str:
        """Name the first point outside, and why it is."""
        first = points[[int(np.argmin(inside))]]
        units = list(self.units.values())
        place = ", ".join(
            f"{name} {value:.4g} {unit}"
            for name, value, unit in zip(VARIABLES, first[0], units, strict=False)
        )
        in_range = self.region_.in_range(first)[0]
        if not in_range.all():
            column = int(np.argmin(in_range))
            low, high = self.ranges[VARIABLES[column]]
            reason = (
                f"{VARIABLES[column]} was measured from {low:.4g} to {high:.4g} {units[column]}"
            )
        elif not self.region_.contains(first)[0]:
            reason = "no line was measured near it"
        else:
            reason = "the measured lines do not determine the model there"
        return (
            f"{np.count_nonzero(~inside)} of {len(points)} points lie outside of the measured "
            f"region, the first at {place}: {reason}; measure there, or extrapolate knowingly"
        )


class DynamicStiffnessSurface(StiffnessModel):
    """Complex dynamic stiffness of one direction of a mount, fitted to operating lines.

    Parameters
    ----------
    regressor : scikit-learn regressor, optional
        Real and imaginary part are fitted by one copy each; default is two complete cubics in
        pieces of the preload, `PiecewiseCubicRegressor()`.
    preload_unit : str
        ``N`` for a static force, ``N m`` for a wheel torque.

    Attributes
    ----------
    real_, imag_ : scikit-learn regressor
        Real and imaginary part [N/m].
    r2_real_, r2_imag_, r2_force_ : float
        Coefficient of determination over the lines of the fit, of both parts and of the force
        amplitude ``|K| |s|`` [1].

    Notes
    -----
    Thesis, eq. 32. Both parts choose their own split points: common ones move K by up to 73 % in
    a direction that is hardly loaded. R² compares with what was measured: it is no accuracy.

    `predict_interval`, `gradient`, `at_amplitude`, `predict_refitted` and `to_arrays` need the
    piecewise cubic; other regressors are refused there by name.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.random.default_rng(1).uniform([0, 1e-5, 20], [800, 5e-4, 80], (400, 3))
    >>> K = 2e5 * (1 + (X[:, 0] / 800) ** 2) * (1.1 - 200 * X[:, 1] + 0.1j)
    >>> surface = DynamicStiffnessSurface(preload_unit="N m").fit(X, K)
    >>> bool(abs(surface.predict([400.0, 2e-4, 50.0]) / (2.5e5 * (1.06 + 0.1j)) - 1) < 1e-9)
    True
    """

    def __init__(self, regressor: Any = None, *, preload_unit: str = "N") -> None:
        self.regressor = regressor
        self.preload_unit = preload_unit

    def _fit(
        self,
        points: RealArray,
        stiffness: ComplexArray,
        weight: RealArray,
        runs: npt.NDArray[Any] | None,
    ) -> None:
        regressor = PiecewiseCubicRegressor() if self.regressor is None else self.regressor
        parts = [clone(regressor), clone(regressor)]
        if isinstance(regressor, PiecewiseCubicRegressor):
            if regressor.pieces == "cv" and runs is None:
                raise InputError(
                    "the number of pieces is chosen by leaving out whole runs: name each line's run"
                )
            for part, values in zip(parts, (stiffness.real, stiffness.imag), strict=True):
                part.fit(points, values, weight, runs)
                n_pieces, n_terms, _ = part.coefficients_.shape
                if np.any(part.degrees_of_freedom_ < 1):
                    raise InputError(
                        f"{len(points)} lines are too few for {n_pieces} pieces of {n_terms} "
                        "terms: measure more, or ask for fewer pieces"
                    )
        elif np.ptp(weight) > 0:
            raise InputError(
                f"{type(regressor).__name__} fits all lines alike: leave out the weights"
            )
        else:
            with warnings.catch_warnings():
                # a kernel parameter on its bound is a result, such as "no noise"
                warnings.simplefilter("ignore", ConvergenceWarning)
                for part, values in zip(parts, (stiffness.real, stiffness.imag), strict=True):
                    part.fit(points, values)
        self.real_, self.imag_ = parts
        fitted, amplitude = self._values(points), points[:, 1]
        self.r2_real_ = r_squared(stiffness.real, fitted.real)
        self.r2_imag_ = r_squared(stiffness.imag, fitted.imag)
        self.r2_force_ = r_squared(np.abs(stiffness) * amplitude, np.abs(fitted) * amplitude)

    def predict_interval(
        self,
        X: npt.ArrayLike,
        coverage: float = 0.95,
        sample_weight: npt.ArrayLike | None = None,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return the interval that covers one newly measured line, for each part.

        Parameters
        ----------
        X : array, shape (..., 3)
            Preload, amplitude and frequency in `units`.
        coverage : float
            Probability for the real and for the imaginary part, each [1].
        sample_weight : array, shape (n,), optional
            Weights of the new lines, as in the fit [1].

        Returns
        -------
        lower, upper : array, shape (...)
            Bounds of the real part and, as imaginary part, of the imaginary part [N/m].

        Raises
        ------
        InputError
            A point outside of the measured region, a coverage outside of ]0, 1[, or a regressor
            without an interval.

        Notes
        -----
        Scatter and misfit of the training lines only. Errors that all lines share (sensor angles,
        gains) are not in it; they need an error budget.
        """
        real, imag = self._cubics("interval")
        points, shape = _rows(X)
        self.predict(points)
        of_real = real.predict_interval(points, coverage, sample_weight)
        of_imag = imag.predict_interval(points, coverage, sample_weight)
        lower, upper = (
            (re + 1j * im).reshape(shape) for re, im in zip(of_real, of_imag, strict=True)
        )
        return lower, upper

    def gradient(self, X: npt.ArrayLike) -> ComplexArray:
        """Differentiate by preload, amplitude and frequency at `X` (..., 3), same shape."""
        real, imag = self._cubics("gradient")
        points, shape = _rows(X)
        gradient = real.gradient(points) + 1j * imag.gradient(points)
        return np.asarray(gradient.reshape(*shape, 3))

    def at_amplitude(self, preload: npt.ArrayLike, frequency: npt.ArrayLike) -> ComplexArray:
        """Return the cubics in the amplitude that the surface is at fixed preload and frequency.

        Parameters
        ----------
        preload, frequency : array, broadcastable to one shape
            In `units`.

        Returns
        -------
        array, shape (..., 4)
            Coefficients of the powers 0 to 3 of the amplitude scaled to [-1, 1] over its measured
            range, complex [N/m]. They do not guard: ask `supported` with the amplitudes that come
            out.

        Notes
        -----
        At fixed preload the blend of two cubics is a cubic; four values determine it.
        """
        self._cubics("cubic in the amplitude")
        low, high = self.ranges["amplitude"]
        span = high - low if high > low else 1.0
        nodes = (low + high) / 2 + span / 2 * _NODES
        points = operating_points(
            np.asarray(preload, dtype=float)[..., np.newaxis],
            nodes,
            np.asarray(frequency, dtype=float)[..., np.newaxis],
        )
        powers = np.vander(_NODES, 4, increasing=True)
        return np.asarray(self.predict(points, extrapolate=True) @ np.linalg.inv(powers).T)

    def predict_refitted(self, X: RealArray, y: ComplexArray, at: RealArray) -> ComplexArray:
        """Return the values of cubics with the same split points, fitted to other lines.

        Parameters
        ----------
        X : array, shape (n, 3)
            Preload, amplitude and frequency of the lines to fit.
        y : array, shape (n,) or (n, n_draws)
            Their stiffness, complex [N/m].
        at : array, shape (m, 3)
            Points at which the cubics are asked, wherever they lie.

        Raises
        ------
        InputError
            A piece without lines.
        """
        real, imag = self._cubics("refit")
        values = real.refitted(X, y.real).predict(at) + 1j * imag.refitted(X, y.imag).predict(at)
        return np.asarray(values)

    def to_arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Store the surface as named arrays without Python objects, such as for ``numpy.savez``."""
        real, imag = self._cubics("stored form")
        return {
            "format": np.asarray(STORAGE_FORMAT),
            "preload_unit": np.asarray(self.preload_unit),
            **{name: np.asarray(getattr(self, f"{name}_")) for name in _PLAIN[1:]},
            **{f"region_{name}": np.asarray(getattr(self.region_, name)) for name in _REGION},
            **real.to_arrays("real_"),
            **imag.to_arrays("imag_"),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> Self:
        """Build the surface from the arrays of `to_arrays`, bit for bit.

        Raises
        ------
        InputError
            A format of another version, an array that is missing or of another shape.
        """
        plain = named_arrays(arrays, "", ("format", *_PLAIN))
        if int(plain["format"]) != STORAGE_FORMAT:
            raise InputError(
                f"a response surface of format {int(plain['format'])} cannot be read, this "
                f"version of deboom reads format {STORAGE_FORMAT}: fit it again"
            )
        surface = cls(preload_unit=plain["preload_unit"].item())
        for name in _PLAIN[1:]:
            setattr(surface, f"{name}_", plain[name].item())
        region = named_arrays(arrays, "region_", _REGION)
        surface.region_ = TrainingRegion(*region.values())  # type: ignore[arg-type]
        surface.real_ = PiecewiseCubicRegressor.from_arrays(arrays, surface.region_, "real_")
        surface.imag_ = PiecewiseCubicRegressor.from_arrays(arrays, surface.region_, "imag_")
        return surface

    @property
    def n_parameters(self) -> int:
        """Coefficients of both parts."""
        return sum(_count_parameters(part) for part in (self.real_, self.imag_))

    def _values(self, points: RealArray) -> ComplexArray:
        # some regressors return a column for one response
        real, imag = (np.ravel(part.predict(points)) for part in (self.real_, self.imag_))
        return np.asarray(real + 1j * imag)

    def _supported(self, points: RealArray) -> BoolArray:
        if not isinstance(self.real_, PiecewiseCubicRegressor):
            return self.region_.contains(points)
        return np.asarray(self.real_.supported(points) & self.imag_.supported(points))

    def _cubics(self, what: str) -> tuple[PiecewiseCubicRegressor, PiecewiseCubicRegressor]:
        """Both parts, if they are cubics; other regressors are refused by name."""
        if not isinstance(self.real_, PiecewiseCubicRegressor):
            raise InputError(
                f"a surface of {type(self.real_).__name__} has no {what}: take "
                "PiecewiseCubicRegressor"
            )
        return self.real_, self.imag_


def _rows(X: npt.ArrayLike) -> tuple[RealArray, tuple[int, ...]]:
    """Points (..., 3) as rows (n, 3), and the shape of their values."""
    points = np.asarray(X, dtype=float)
    if points.shape[-1:] != (3,):
        raise InputError(
            f"points of shape {points.shape}: the last axis is preload, amplitude, frequency"
        )
    if not np.all(np.isfinite(points)):
        raise InputError("preload, amplitude and frequency must be finite where K is asked for")
    return points.reshape(-1, 3), points.shape[:-1]


def _count_parameters(fitted: Any) -> int:
    """Coefficients of a linear last step, or training rows and kernel parameters of a process."""
    last = fitted[-1] if hasattr(fitted, "steps") else fitted
    if isinstance(last, PiecewiseCubicRegressor):
        return int(last.coefficients_.size)
    for name in ("coef_", "alpha_"):
        if hasattr(last, name) and np.ndim(getattr(last, name)):
            extra = len(last.kernel_.theta) if hasattr(last, "kernel_") else 1
            return int(np.size(getattr(last, name))) + extra
    raise InputError(f"{type(last).__name__} does not tell its number of parameters")
