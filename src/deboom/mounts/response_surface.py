"""Response surfaces and other models of the dynamic stiffness over preload, amplitude, frequency.

A model gives the complex stiffness of one direction of a mount. It knows where it was measured and
refuses to speak about anything else unless it is told to extrapolate. Beside the piecewise cubics
of the thesis: any scikit-learn regressor, Kelvin-Voigt and Berg, compared in one table.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.exceptions import ConvergenceWarning

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked, checked_array
from deboom.errors import InputError
from deboom.mounts.piecewise_cubic import (
    FewLevelsWarning,
    PiecewiseCubicRegressor,
    TrainingRegion,
    named_arrays,
)
from deboom.physics.dynamic_stiffness import kelvin_voigt

if TYPE_CHECKING:
    import pandas as pd

VARIABLES = ("preload", "amplitude", "frequency")

STORAGE_FORMAT = 1
"""Format of `DynamicStiffnessSurface.to_arrays`; another number is refused on reading."""

SMALL = 1e-4
"""Relative amplitude below which Berg's closed form cancels and its leading terms are enough."""

PROCESS_LINES = 600
"""Lines that the Gaussian process is fitted to: its effort grows with their cube."""

COMPARED = {
    "r2_real": "R² Re K [%]",
    "r2_imag": "R² Im K [%]",
    "r2_force_real": "R² Re force [%]",
    "r2_force_imag": "R² Im force [%]",
}
_NODES = np.cos(np.pi * (np.arange(4) + 0.5) / 4)
_PLAIN = ("preload_unit", "n_lines", "r2_real", "r2_imag", "r2_force")
_REGION = ("points", "lower", "upper", "reach")


def operating_points(
    preload: npt.ArrayLike, amplitude: npt.ArrayLike, frequency: npt.ArrayLike
) -> RealArray:
    """Stack preload [N or N m], amplitude [m] and frequency [Hz] as points (..., 3) for a model.

    - raises InputError: shapes that do not broadcast.
    """
    columns = [np.asarray(values, dtype=float) for values in (preload, amplitude, frequency)]
    try:
        return np.stack(np.broadcast_arrays(*columns), axis=-1)
    except ValueError:
        shapes = [column.shape for column in columns]
        raise InputError(f"preload, amplitude and frequency have the shapes {shapes}") from None


@checked(preload="n", displacement="n", frequency="n", stiffness="n")
class StiffnessSamples:
    """Measured dynamic stiffness of one direction, line by line; arrays (n,).

    Preload as static force [N] or wheel torque [N m], displacement as complex peak at the virtual
    point [m], frequency [Hz], complex stiffness [N/m], and maybe the run of each line. InputError:
    different lengths, values that are not finite.
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
        columns = {name: column for name, column in vars(self).items() if column is not None}
        return replace(self, **{name: column[lines] for name, column in columns.items()})


def r_squared(measured: npt.ArrayLike, modelled: npt.ArrayLike) -> float:
    """Return the coefficient of determination, ``1 - Σ(y - ŷ)² / Σ(y - ȳ)²``, of two arrays (n,).

    - raises InputError: a measured quantity that does not vary.
    """
    y, fitted = np.asarray(measured, dtype=float), np.asarray(modelled, dtype=float)
    total = float(np.sum((y - y.mean()) ** 2))
    if total == 0:
        raise InputError("the measured values are all equal: R² has no meaning for them")
    return float(1 - np.sum((y - fitted) ** 2) / total)


def agreement(samples: StiffnessSamples, modelled: ComplexArray) -> dict[str, float]:
    """Compare measured lines with a model's stiffness at the same lines, shape (n,) [N/m].

    R² of Re K and Im K, ``r2_real`` and ``r2_imag``, and of both parts of the force ``K s`` in the
    phase of the measured displacement, ``r2_force_real`` and ``r2_force_imag`` [1], as in the
    thesis's tables 6 to 8. R² compares with what was measured, systematic errors included: it is no
    accuracy.
    """
    force = modelled * samples.displacement
    return {
        "r2_real": r_squared(samples.stiffness.real, modelled.real),
        "r2_imag": r_squared(samples.stiffness.imag, modelled.imag),
        "r2_force_real": r_squared(samples.force.real, force.real),
        "r2_force_imag": r_squared(samples.force.imag, force.imag),
    }


def rms_error(modelled: ComplexArray, reference: ComplexArray) -> float:
    """Return the rms of ``|K_model - K| / |K|`` over lines (n,) [1]."""
    return float(np.sqrt(np.mean((np.abs(modelled - reference) / np.abs(reference)) ** 2)))


class _Lines(NamedTuple):
    """Checked lines of a fit: points (n, 3), stiffness, weight and maybe runs (n,)."""

    points: RealArray
    stiffness: ComplexArray
    weight: RealArray
    runs: npt.NDArray[Any] | None


class StiffnessModel(RegressorMixin, BaseEstimator, ABC):
    """Complex dynamic stiffness over preload, displacement amplitude and frequency.

    A scikit-learn regressor of three variables whose `y` is complex. `region_` is where lines were
    measured, `n_lines_` how many.

    - `regressor`, optional: regressor of real-valued parts; default is two complete cubics,
      `PiecewiseCubicRegressor()`.
    - `preload_unit`: ``N`` for a static force, ``N m`` for a wheel torque.
    """

    region_: TrainingRegion
    n_lines_: int

    def __init__(self, regressor: Any = None, *, preload_unit: str = "N") -> None:
        self.regressor = regressor
        self.preload_unit = preload_unit

    def fit(
        self,
        X: npt.ArrayLike,
        y: npt.ArrayLike,
        sample_weight: npt.ArrayLike | None = None,
        groups: npt.ArrayLike | None = None,
    ) -> Self:
        """Fit the model to measured lines.

        - `X` (n, 3): static force of the direction [N] or wheel torque [N m], peak displacement
          amplitude at the virtual point [m], frequency [Hz].
        - `y` (n,): measured stiffness, complex [N/m].
        - `sample_weight` (n,), optional: inverse to the variance of each line, 1 if not given [1].
        - `groups` (n,), optional: run of each line: a cross-validation of the pieces leaves out
          whole runs.
        - raises InputError: lines that cannot be fitted: shapes, values that are not finite, too
          few of them; or a cross-validation without runs.
        """
        sizes: dict[str, int] = {}
        points = checked_array(X, "n 3", "preload, amplitude and frequency", sizes)
        stiffness = checked_array(y, "n", "stiffness", sizes, complex)
        ones = np.ones(len(points)) if sample_weight is None else sample_weight
        weight = checked_array(ones, "n", "weights of the lines", sizes)
        if stiffness.size == 0:
            raise InputError("there are no lines to fit a dynamic stiffness to")
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
        self._fit(_Lines(points, stiffness, weight, runs))
        return self

    @abstractmethod
    def _fit(self, lines: _Lines) -> None:
        """Fit to checked lines."""

    @abstractmethod
    def _values(self, points: RealArray) -> ComplexArray:
        """Stiffness at any points (n, 3), shape (n,) [N/m]."""

    def predict(self, X: npt.ArrayLike, extrapolate: bool = False) -> ComplexArray:
        """Return the dynamic stiffness at operating points.

        - `X` (..., 3): preload, amplitude and frequency in `units`, see `operating_points`.
        - `extrapolate`: whether points that are not `supported` get the model's value, too.
        - returns (...): complex [N/m].
        - raises InputError: a point outside of the measured region, unless `extrapolate`, or one
          that is not finite.
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
        """Say where the model is backed by measurements, for points (..., 3): shape (...).

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

    def _copy(self, **parameters: Any) -> Any:
        """Unfitted copy of the regressor, two cubics by default."""
        regressor = PiecewiseCubicRegressor() if self.regressor is None else self.regressor
        return clone(regressor).set_params(**parameters)

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
    max_lines : int, optional
        Lines that other regressors are fitted to at most, evenly picked, where their effort grows
        with the cube.

    Attributes
    ----------
    real_, imag_ : scikit-learn regressor
        Real and imaginary part [N/m].
    r2_real_, r2_imag_, r2_force_ : float
        Coefficient of determination over the lines of the fit, of both parts and of the force
        amplitude ``|K| |s|`` [1].

    Raises
    ------
    InputError
        When it is fitted: too few lines for the cubic; lines that are not finite; a regressor that
        cannot do what is asked, by name.

    See Also
    --------
    deboom.compare_models, deboom.characterise, deboom.open_library

    Notes
    -----
    Thesis, eq. 32. Both parts choose their own split points: common ones move K by up to 73 % in a
    direction that is hardly loaded. R² compares with what was measured: it is no accuracy.

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

    def __init__(
        self, regressor: Any = None, *, preload_unit: str = "N", max_lines: int | None = None
    ) -> None:
        super().__init__(regressor, preload_unit=preload_unit)
        self.max_lines = max_lines

    def _fit(self, lines: _Lines) -> None:
        points, stiffness, weight, runs = lines
        if self.max_lines is not None and self.max_lines < 2:
            raise InputError(f"max_lines is at least 2, not {self.max_lines}")
        parts = [self._copy(), self._copy()]
        values = (stiffness.real, stiffness.imag)
        if isinstance(parts[0], PiecewiseCubicRegressor):
            if parts[0].pieces == "cv" and runs is None:
                raise InputError(
                    "the number of pieces is chosen by leaving out whole runs: name each line's run"
                )
            for part, measured in zip(parts, values, strict=True):
                # a piece of lower degree is no surface to believe in
                with warnings.catch_warnings(action="error", category=UserWarning):
                    warnings.simplefilter("default", FewLevelsWarning)
                    try:
                        part.fit(points, measured, weight, runs)
                    except UserWarning as error:
                        raise InputError(str(error)) from None
                if np.any(part.degrees_of_freedom_ < 1):
                    raise InputError(f"{len(points)} lines are too few for cubics: measure more")
        elif np.ptp(weight) > 0:
            name = type(parts[0]).__name__
            raise InputError(f"{name} fits all lines alike: leave out the weights")
        else:
            count = min(self.max_lines or len(points), len(points))
            picked = np.linspace(0, len(points) - 1, count).round().astype(int)
            with warnings.catch_warnings():
                # a kernel parameter on its bound is a result, such as "no noise"
                warnings.simplefilter("ignore", ConvergenceWarning)
                for part, measured in zip(parts, values, strict=True):
                    part.fit(points[picked], measured[picked])
        self.real_, self.imag_ = parts
        fitted, amplitude = self._values(points), points[:, 1]
        self.r2_real_ = r_squared(stiffness.real, fitted.real)
        self.r2_imag_ = r_squared(stiffness.imag, fitted.imag)
        self.r2_force_ = r_squared(np.abs(stiffness) * amplitude, np.abs(fitted) * amplitude)

    def predict_interval(
        self, X: npt.ArrayLike, coverage: float = 0.95
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return the interval that covers one newly measured line at `X` (..., 3), for each part.

        - `X` (..., 3): preload, amplitude and frequency in `units`.
        - `coverage`: probability for the real and for the imaginary part, each [1].
        - raises InputError: a point outside of the measured region, a coverage outside of ]0, 1[,
          or a regressor without an interval.

        Bounds of both parts as complex arrays (...) [N/m], by scatter and misfit of the training
        lines only. Errors that all lines share (sensor angles, gains) are not in it; they need an
        error budget.
        """
        real, imag = self._cubics("interval")
        points, shape = _rows(X)
        self.predict(points)
        of_real = real.predict_interval(points, coverage)
        of_imag = imag.predict_interval(points, coverage)
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

        - `preload`, `frequency`: preload and frequency in `units`.
        - returns (..., 4): coefficients of the powers 0 to 3 of the amplitude scaled to [-1, 1]
          over its measured range, complex [N/m]. They do not guard: ask `supported` with the
          amplitudes that come out.
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

        The lines are `X` (n, 3) and their stiffness `y` (n,) or (n, n_draws) [N/m], the values
        those at the points `at` (m, 3), wherever they lie. A piece with too few of the lines has
        the degree that they determine. InputError: a piece without lines.
        """
        real, imag = self._cubics("refit")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # lines that are left out, not missing
            values = real.refitted(X, y.real).predict(at) + 1j * imag.refitted(X, y.imag).predict(
                at
            )
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

        - raises InputError: a format of another version, an array that is missing, a region or
          coefficients of another shape; no other shape is checked.
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


def friction_stiffness(relative_amplitude: npt.ArrayLike) -> ComplexArray:
    """Return the first harmonic of Berg's friction force in the steady state.

    - `relative_amplitude` (...): displacement amplitude over the displacement at which half of the
      friction force is reached, at least 0 [1].
    - returns (...): complex stiffness over the stiffness at vanishing amplitude [1]: from 1 without
      loss at rest to 0 at large amplitudes.
    - raises InputError: a negative amplitude.

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

    It knows no amplitude, and its loss grows with the frequency.
    """

    def _fit(self, lines: _Lines) -> None:
        preload, omega = lines.points[:, :1], 2 * np.pi * lines.points[:, 2]
        weight = lines.weight
        self.spring_, self.damper_ = self._copy(), self._copy()
        self.spring_.fit(preload, lines.stiffness.real, weight)
        self.damper_.fit(preload, lines.stiffness.imag / omega, weight * omega**2)

    def _values(self, points: RealArray) -> ComplexArray:
        spring, damper = self.spring_.predict(points[:, :1]), self.damper_.predict(points[:, :1])
        return kelvin_voigt(points[:, 2], spring, damper)


def berg_shape(
    parameters: npt.ArrayLike, amplitude: RealArray, frequency: RealArray
) -> ComplexArray:
    """Return the stiffness of Berg's element over its elastic part [1].

    - `parameters` (4,): stiffness of the friction element at vanishing amplitude [1], displacement
      at which half of the friction force is reached [m], stiffness of the Maxwell element far above
      its corner frequency [1], and that frequency [Hz].
    - `amplitude`, `frequency` (n,): displacement amplitude [m], frequency [Hz].
    """
    friction, half_force, viscous, corner_frequency = np.asarray(parameters, dtype=float)
    relative = 1j * frequency / corner_frequency
    maxwell = relative / (1 + relative)
    stuck = friction * friction_stiffness(amplitude / half_force)
    return np.asarray(1 + stuck + viscous * maxwell, dtype=complex)


class BergModel(StiffnessModel):
    """Elastic, friction and Maxwell element side by side, all following the preload alike.

    ``K = k(F0) [1 + φ κ(|s|/x_2) + v jf/(f_c + jf)]`` with κ from `friction_stiffness`; `shape_`
    holds the parameters of `berg_shape`. For a given shape, k(F0) is a linear least-squares
    problem, solved inside of the search for the shape (variable projection; Golub and Pereyra,
    1973).
    """

    def _fit(self, lines: _Lines) -> None:
        preload, amplitude, frequency = lines.points[:, :1], lines.points[:, 1], lines.points[:, 2]
        middle = np.array([0.5, np.median(amplitude), 0.5, np.median(frequency)])
        scale = np.sqrt(lines.weight) / np.abs(lines.stiffness).mean()

        def elastic_for(relative: ComplexArray, **pieces: Any) -> PiecewiseCubicRegressor:
            squared = np.abs(relative) ** 2
            projected = (lines.stiffness * relative.conj()).real / squared
            regressor: PiecewiseCubicRegressor = self._copy(**pieces)
            return regressor.fit(preload, projected, lines.weight * squared)

        def relative_for(logarithms: RealArray) -> ComplexArray:
            return berg_shape(middle * np.exp(logarithms), amplitude, frequency)

        split_points = elastic_for(relative_for(np.zeros(4))).split_points_

        def misfit(logarithms: RealArray) -> RealArray:
            relative = relative_for(logarithms)
            elastic = elastic_for(relative, split=split_points).predict(preload)
            error = scale * (elastic * relative - lines.stiffness)
            return np.concatenate([error.real, error.imag])

        # four decades to either side: beyond them an element is not there
        best = least_squares(misfit, np.zeros(4), bounds=(-np.log(1e4), np.log(1e4)))
        self.shape_ = middle * np.exp(best.x)
        self.elastic_ = elastic_for(relative_for(best.x))

    def _values(self, points: RealArray) -> ComplexArray:
        relative = berg_shape(self.shape_, points[:, 1], points[:, 2])
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


def standard_models() -> dict[str, StiffnessModel]:
    """Return models worth comparing: cubics in one, two and cross-validated pieces, and others."""
    surface, cubics = DynamicStiffnessSurface, PiecewiseCubicRegressor
    return {
        "one cubic": surface(cubics(pieces=1)),
        "two cubics": surface(cubics()),
        "cubics, cross-validated": surface(cubics(pieces="cv")),
        "Kelvin-Voigt": KelvinVoigtModel(),
        "Berg": BergModel(),
        "Gaussian process": surface(gaussian_process(), max_lines=PROCESS_LINES),
    }


def compare_models(
    models: Mapping[str, StiffnessModel],
    training: StiffnessSamples,
    check: StiffnessSamples,
    truth: ComplexArray | None = None,
) -> pd.DataFrame:
    """Fit several models to the same lines and compare them at others.

    Parameters
    ----------
    models : mapping of str to StiffnessModel
        Models by name, left unfitted; `standard_models` gives some.
    training, check : StiffnessSamples
        Lines to fit, with the names of their runs where a model is cross-validated; lines to
        compare with, of which those inside of every model's region count.
    truth : array, shape (n_check,), optional
        True stiffness at the lines of `check`, where a virtual bench knows it [N/m].

    Returns
    -------
    pandas.DataFrame
        One row per model: lines compared and their share, R² of both parts of stiffness and force,
        rms error against measurement (and truth).

    Raises
    ------
    InputError
        No models; or no line to check inside of the region of all models.

    See Also
    --------
    deboom.DynamicStiffnessSurface, deboom.characterise

    Examples
    --------
    >>> import deboom
    >>> import numpy as np
    >>> from deboom.mounts.response_surface import StiffnessSamples
    >>> X = np.random.default_rng(1).uniform([0, 1e-5, 20], [800, 5e-4, 80], (400, 3))
    >>> K = 2e5 * (1 + (X[:, 0] / 800) ** 2) * (1.1 - 200 * X[:, 1] + 0.1j)
    >>> half = [StiffnessSamples(*X[part::2].T, K[part::2]) for part in (0, 1)]
    >>> surface = {"piecewise cubic": deboom.DynamicStiffnessSurface()}
    >>> table = deboom.compare_models(surface, *half)
    >>> bool(table["rms error [%]"][0] < 0.1)
    True
    """
    import pandas as pd

    if not models:
        raise InputError("there are no models to compare")
    fitted: dict[str, StiffnessModel] = {}
    for name, model in models.items():
        fitted[name] = clone(model)
        fitted[name].fit(training.points, training.stiffness, groups=training.run)
    inside = np.all([model.supported(check.points) for model in fitted.values()], axis=0)
    if not inside.any():
        raise InputError("no line to check lies where all models were measured")
    compared = check.select(inside)
    rows = []
    for name, model in fitted.items():
        modelled = model.predict(compared.points)
        agreed = agreement(compared, modelled)
        row = {
            "model": name,
            "lines compared [1]": len(compared),
            "share of lines [%]": 100 * len(compared) / len(check),
            **{COMPARED[part]: 100 * value for part, value in agreed.items()},
            "rms error [%]": 100 * rms_error(modelled, compared.stiffness),
        }
        if truth is not None:
            error = rms_error(modelled, np.asarray(truth)[inside])
            row["rms error against truth [%]"] = 100 * error
        rows.append(row)
    return pd.DataFrame(rows)


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
