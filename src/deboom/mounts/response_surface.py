"""Response surfaces: dynamic stiffness over preload, amplitude and frequency."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.mounts.piecewise_cubic import (
    REACH,
    NamedArrays,
    PieceOptions,
    PiecewiseCubic,
    TrainingRegion,
    fit_piecewise_cubic,
    from_arrays,
    to_arrays,
)

VARIABLES = ("preload", "amplitude", "frequency")


@dataclass(frozen=True, eq=False)
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
    weight : array, shape (n,), optional
        Inverse to the variance of each line, 1 if not given [1].
    run : array of str, shape (n,), optional
        Name of the run that each line belongs to.

    Raises
    ------
    InputError
        Arrays of different lengths, values that are not finite, a negative frequency or weight.
    """

    preload: RealArray
    displacement: ComplexArray
    frequency: RealArray
    stiffness: ComplexArray
    weight: RealArray | None = None
    run: npt.NDArray[np.str_] | None = None

    def __post_init__(self) -> None:
        columns: dict[str, RealArray | ComplexArray] = {
            "preload": np.array(self.preload, dtype=float),
            "displacement": np.array(self.displacement, dtype=complex),
            "frequency": np.array(self.frequency, dtype=float),
            "stiffness": np.array(self.stiffness, dtype=complex),
        }
        if self.weight is not None:
            columns["weight"] = np.array(self.weight, dtype=float)
        for name, column in columns.items():
            if column.ndim != 1 or column.shape != columns["preload"].shape:
                raise InputError(
                    "samples of the dynamic stiffness need one value per line: preload has shape "
                    f"{columns['preload'].shape}, {name} has {column.shape}"
                )
            bad = np.flatnonzero(~np.isfinite(column))
            if bad.size:
                raise InputError(f"{name} of line {bad[0]} is not finite: leave the line out")
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        if self.run is not None:
            runs = np.array(self.run, dtype=np.str_)
            if runs.shape != self.preload.shape:
                raise InputError(f"{runs.size} names of runs for {len(self)} lines: one each")
            object.__setattr__(self, "run", runs)
        if not len(self):
            raise InputError("there are no lines to fit a dynamic stiffness to")
        if np.any(self.frequency <= 0):
            raise InputError("the frequency of a dynamic stiffness is above 0 Hz")
        if np.any(self.weights <= 0):
            raise InputError("weights are above 0: leave out lines that do not count")

    @classmethod
    def of_amplitude(
        cls,
        preload: npt.ArrayLike,
        amplitude: npt.ArrayLike,
        frequency: npt.ArrayLike,
        stiffness: npt.ArrayLike,
        weights: npt.ArrayLike | None = None,
        run: npt.ArrayLike | None = None,
    ) -> StiffnessSamples:
        """Build samples whose displacement has no phase, out of its `amplitude` (n,) [m].

        Raises
        ------
        InputError
            As for the class, or a negative amplitude.
        """
        displacement = np.asarray(amplitude, dtype=float)
        if np.any(displacement < 0):
            raise InputError("a displacement amplitude is a peak value of at least 0 m")
        return cls(
            np.asarray(preload, dtype=float),
            displacement.astype(complex),
            np.asarray(frequency, dtype=float),
            np.asarray(stiffness, dtype=complex),
            None if weights is None else np.asarray(weights, dtype=float),
            None if run is None else np.asarray(run, dtype=np.str_),
        )

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

    @property
    def lines(self) -> tuple[RealArray, RealArray, RealArray, ComplexArray, RealArray]:
        """Preload, amplitude, frequency, stiffness and weight, as models are fitted to them."""
        return self.preload, self.amplitude, self.frequency, self.stiffness, self.weights

    @property
    def weights(self) -> RealArray:
        """Weight of each line, shape (n,)."""
        return np.ones(len(self)) if self.weight is None else self.weight


@dataclass(frozen=True, eq=False)
class StiffnessModel(ABC):
    """Complex dynamic stiffness over preload, displacement amplitude and frequency.

    Parameters
    ----------
    region : TrainingRegion
        Where lines were measured: preload, amplitude [m], frequency [Hz].
    preload_unit : str
        ``N`` for a static force, ``N m`` for a wheel torque.
    """

    region: TrainingRegion
    preload_unit: str

    @property
    @abstractmethod
    def n_parameters(self) -> int:
        """Fitted numbers that make up the model."""

    @abstractmethod
    def _evaluate(self, points: RealArray) -> ComplexArray:
        """Stiffness at any points (n, 3), shape (n,) [N/m]."""

    def _held(self, points: RealArray) -> npt.NDArray[np.bool_]:
        """Whether lines hold the model at points (n, 3) of the region, shape (n,)."""
        return np.ones(len(points), dtype=bool)

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each variable and of the stiffness."""
        units = (self.preload_unit, "m", "Hz")
        return {**dict(zip(VARIABLES, units, strict=True)), "stiffness": "N/m"}

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest measured value of each variable, in `units`."""
        bounds = zip(self.region.lower.tolist(), self.region.upper.tolist(), strict=True)
        return dict(zip(VARIABLES, bounds, strict=True))

    def inside(
        self, preload: npt.ArrayLike, amplitude: npt.ArrayLike, frequency: npt.ArrayLike
    ) -> npt.NDArray[np.bool_]:
        """Say where the model is backed by measurements.

        Parameters
        ----------
        preload, amplitude, frequency : array, broadcastable to one shape
            In `units`.

        Returns
        -------
        array of bool, of that shape
            False out of the measured ranges, away from every measured line, and where the measured
            lines do not hold the model.
        """
        points, shape = broadcast_points(preload, amplitude, frequency)
        return (self.region.contains(points) & self._held(points)).reshape(shape)

    def predict(
        self, preload: npt.ArrayLike, amplitude: npt.ArrayLike, frequency: npt.ArrayLike
    ) -> ComplexArray:
        """Dynamic stiffness where the model is backed by measurements.

        Parameters
        ----------
        preload, amplitude, frequency : array, broadcastable to one shape
            In `units`.

        Returns
        -------
        array, of that shape
            Complex [N/m].

        Raises
        ------
        InputError
            A point outside of the measured region; `predict_masked` returns a mask instead.
        """
        stiffness, inside = self.predict_masked(preload, amplitude, frequency)
        if not inside.all():
            points, _ = broadcast_points(preload, amplitude, frequency)
            raise InputError(self._complaint(points, inside.ravel()))
        return stiffness

    def predict_masked(
        self, preload: npt.ArrayLike, amplitude: npt.ArrayLike, frequency: npt.ArrayLike
    ) -> tuple[ComplexArray, npt.NDArray[np.bool_]]:
        """Dynamic stiffness everywhere, and where it may be believed.

        Parameters
        ----------
        preload, amplitude, frequency : array, broadcastable to one shape
            In `units`.

        Returns
        -------
        stiffness : array, of that shape
            Complex [N/m]; extrapolated where the mask is False.
        inside : array of bool, of that shape
            As `inside`.
        """
        points, shape = broadcast_points(preload, amplitude, frequency)
        inside = self.region.contains(points) & self._held(points)
        return self._evaluate(points).reshape(shape), inside.reshape(shape)

    def _complaint(self, points: RealArray, inside: npt.NDArray[np.bool_]) -> str:
        first = int(np.argmin(inside))
        point, units = points[first], list(self.units.values())
        place = ", ".join(
            f"{name} {value:.4g} {unit}"
            for name, value, unit in zip(VARIABLES, point, units, strict=False)
        )
        in_range = self.region.in_range(points[[first]])[0]
        if not in_range.all():
            column = int(np.argmin(in_range))
            low, high = self.region.lower[column], self.region.upper[column]
            reason = (
                f"{VARIABLES[column]} was measured from {low:.4g} to {high:.4g} {units[column]}"
            )
        elif not self.region.contains(points[[first]])[0]:
            reason = "no line was measured near it"
        else:
            reason = "the measured lines do not hold the model there"
        return (
            f"{np.count_nonzero(~inside)} of {len(points)} points lie outside of the measured "
            f"region, the first at {place}: {reason}; measure there, or take predict_masked"
        )


def broadcast_points(
    preload: npt.ArrayLike, amplitude: npt.ArrayLike, frequency: npt.ArrayLike
) -> tuple[RealArray, tuple[int, ...]]:
    """Stack three variables as rows of points.

    Parameters
    ----------
    preload, amplitude, frequency : array, broadcastable to one shape
        In the units of the model.

    Returns
    -------
    points : array, shape (n, 3)
        One row per element of the common shape.
    shape : tuple of int
        The common shape.

    Raises
    ------
    InputError
        Shapes that do not broadcast, values that are not finite.
    """
    try:
        columns = np.broadcast_arrays(
            *(np.asarray(values, dtype=float) for values in (preload, amplitude, frequency))
        )
    except ValueError:
        shapes = [np.shape(values) for values in (preload, amplitude, frequency)]
        raise InputError(f"preload, amplitude and frequency have the shapes {shapes}") from None
    points = np.stack([column.ravel() for column in columns], axis=1)
    if not np.all(np.isfinite(points)):
        raise InputError("preload, amplitude and frequency must be finite where K is asked for")
    return points, columns[0].shape


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
    """Coefficient of determination, ``1 - Σ(y - ŷ)² / Σ(y - ȳ)²``.

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
        Measured.
    modelled : array, shape (n,)
        Stiffness of the model at the same lines [N/m].

    Returns
    -------
    Agreement

    Notes
    -----
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


_CHEBYSHEV = np.cos(np.pi * (np.arange(4) + 0.5) / 4)


@dataclass(frozen=True, eq=False)
class AmplitudeCubic:
    """Cubics in the displacement amplitude, one per operating point.

    Parameters
    ----------
    coefficients : array, shape (..., 4)
        Of the powers 0 to 3 of the amplitude scaled to [-1, 1], complex [N/m].
    lowest, highest : float
        Amplitudes that are scaled to -1 and 1: the measured range [m].
    """

    coefficients: ComplexArray
    lowest: float
    highest: float

    def __post_init__(self) -> None:
        coefficients = np.array(self.coefficients, dtype=complex)
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)

    @staticmethod
    def nodes(lowest: float, highest: float) -> RealArray:
        """Four amplitudes that determine a cubic well (Chebyshev's), shape (4,) [m]."""
        return (lowest + highest) / 2 + _span(lowest, highest) / 2 * _CHEBYSHEV

    @classmethod
    def through(cls, values: ComplexArray, lowest: float, highest: float) -> AmplitudeCubic:
        """Interpolate `values` (..., 4) [N/m] at the amplitudes of `nodes`."""
        powers = np.vander(_CHEBYSHEV, 4, increasing=True)
        return cls(values @ np.linalg.inv(powers).T, lowest, highest)

    def __call__(self, amplitude: npt.ArrayLike) -> ComplexArray:
        """Stiffness [N/m] at `amplitude` [m], broadcastable to the operating points."""
        z = self._scaled(amplitude)
        c = self.coefficients
        return np.asarray(c[..., 0] + z * (c[..., 1] + z * (c[..., 2] + z * c[..., 3])))

    def derivative(self, amplitude: npt.ArrayLike) -> ComplexArray:
        """Differentiate by the amplitude [N/m²] at `amplitude` [m]."""
        z = self._scaled(amplitude)
        c = self.coefficients
        by_scaled = c[..., 1] + z * (2 * c[..., 2] + z * 3 * c[..., 3])
        return np.asarray(by_scaled * 2 / _span(self.lowest, self.highest))

    def held(self, amplitude: npt.ArrayLike) -> RealArray:
        """Limit `amplitude` [m] to the measured range, for iterations on their way there."""
        limited = np.clip(np.asarray(amplitude, dtype=float), self.lowest, self.highest)
        return np.asarray(limited)

    def _scaled(self, amplitude: npt.ArrayLike) -> RealArray:
        z = 2 * np.asarray(amplitude, dtype=float) - self.lowest - self.highest
        return np.asarray(z / _span(self.lowest, self.highest))


def _span(lowest: float, highest: float) -> float:
    """Measured range, or 1 where a single amplitude was measured [m]."""
    return highest - lowest if highest > lowest else 1.0


STORAGE_FORMAT = 1
"""Of `DynamicStiffnessSurface.to_arrays`; another number is refused on reading."""

DEFAULT_OPTIONS = PieceOptions()


BESIDE = 0.025
"""A measured line so near, in fractions of the ranges, is the same state measured again."""

LEVERAGE_BESIDE = 4.0
"""There the leverage may exceed that of all training lines: a standard error up to twice theirs."""


@dataclass(frozen=True, eq=False)
class DynamicStiffnessSurface(StiffnessModel):
    """Complex dynamic stiffness of one direction of a mount, fitted to operating lines.

    Parameters
    ----------
    region : TrainingRegion
        Where lines were measured: preload, amplitude [m], frequency [Hz].
    preload_unit : str
        ``N`` for a static force, ``N m`` for a wheel torque.
    real, imag : PiecewiseCubic
        Real and imaginary part [N/m].
    n_lines : int
        Lines it was fitted to.
    r2_real, r2_imag : float
        Coefficient of determination over those lines [1].
    r2_force : float
        The same of the force amplitude ``|K| |s|`` [1].

    Notes
    -----
    Thesis, eq. 32 with all 20 terms, for each part, in variables scaled to [-1, 1]; two pieces in
    the preload by default. R² compares with what was measured: it is no accuracy.
    """

    real: PiecewiseCubic
    imag: PiecewiseCubic
    n_lines: int
    r2_real: float
    r2_imag: float
    r2_force: float

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
        run: npt.ArrayLike | None = None,
        reach: float = REACH,
    ) -> DynamicStiffnessSurface:
        """Fit a surface to measured lines.

        Parameters
        ----------
        preload : array, shape (n,)
            Static force of the direction [N], or wheel torque [N m].
        amplitude : array, shape (n,)
            Peak displacement at the virtual point [m].
        frequency : array, shape (n,)
            [Hz].
        stiffness : array, shape (n,)
            Measured, complex [N/m].
        weights : array, shape (n,), optional
            Inverse to the variance of each line, 1 if not given [1].
        preload_unit : str
            ``N`` or ``N m``.
        options : PieceOptions
            How many pieces, and where they meet.
        run : array, shape (n,), optional
            Name of the run of each line, for ``PieceOptions(pieces="cv")``: the cross-validation
            leaves out whole runs.
        reach : float
            How far a line vouches for its surroundings, see `TrainingRegion` [1].

        Returns
        -------
        DynamicStiffnessSurface

        Raises
        ------
        InputError
            Lines that cannot be fitted: shapes, values that are not finite, too few of them; or
            a cross-validation without runs.
        """
        samples = StiffnessSamples.of_amplitude(
            preload, amplitude, frequency, stiffness, weights, run
        )
        if options.pieces == "cv" and samples.run is None:
            raise InputError(
                "the number of pieces is chosen by leaving out whole runs: name each line's run"
            )
        real, imag = (
            fit_piecewise_cubic(
                samples.points, part[:, np.newaxis], samples.weights, options, samples.run
            )
            for part in (samples.stiffness.real, samples.stiffness.imag)
        )
        for part in (real, imag):
            if np.any(part.degrees_of_freedom < 1):
                raise InputError(
                    f"{len(samples)} lines are too few for {part.n_pieces} pieces of "
                    f"{part.coefficients.shape[1]} terms: measure more, or ask for fewer pieces"
                )
        surface = cls(
            region=TrainingRegion.around(samples.points, reach),
            preload_unit=preload_unit,
            real=real,
            imag=imag,
            n_lines=len(samples),
            r2_real=np.nan,
            r2_imag=np.nan,
            r2_force=np.nan,
        )
        fitted = surface._evaluate(samples.points)
        return replace(
            surface,
            r2_real=r_squared(samples.stiffness.real, fitted.real),
            r2_imag=r_squared(samples.stiffness.imag, fitted.imag),
            r2_force=r_squared(np.abs(samples.force), np.abs(fitted) * samples.amplitude),
        )

    @property
    def n_parameters(self) -> int:
        """Coefficients of both parts."""
        return self.real.n_coefficients + self.imag.n_coefficients

    def prediction_interval(
        self,
        preload: npt.ArrayLike,
        amplitude: npt.ArrayLike,
        frequency: npt.ArrayLike,
        coverage: float = 0.95,
        weights: npt.ArrayLike = 1.0,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Interval that covers one newly measured line, for each part.

        Parameters
        ----------
        preload, amplitude, frequency : array, broadcastable to one shape
            In `units`.
        coverage : float
            Probability for the real and for the imaginary part, each [1].
        weights : array, broadcastable to that shape
            Of the new lines, as in the fit [1].

        Returns
        -------
        lower, upper : array, of that shape
            Bounds of the real part and, as imaginary part, of the imaginary part [N/m].

        Raises
        ------
        InputError
            A point outside of the measured region, or a coverage outside of ]0, 1[.

        Notes
        -----
        Scatter and misfit of the training lines only. Errors that all lines share (sensor angles,
        gains) are not in it; they need an error budget.
        """
        middle = self.predict(preload, amplitude, frequency)
        points, shape = broadcast_points(preload, amplitude, frequency)
        weight = np.broadcast_to(np.asarray(weights, dtype=float), shape).ravel()
        half_widths = [
            part.half_width(points, coverage, weight)[:, 0] for part in (self.real, self.imag)
        ]
        half_width = (half_widths[0] + 1j * half_widths[1]).reshape(shape)
        return middle - half_width, middle + half_width

    def at_amplitude(self, preload: npt.ArrayLike, frequency: npt.ArrayLike) -> AmplitudeCubic:
        """Stiffness over the amplitude alone, at fixed preload and frequency.

        Parameters
        ----------
        preload, frequency : array, broadcastable to one shape
            In `units`.

        Returns
        -------
        AmplitudeCubic
            One cubic per point, of that shape. It does not guard: ask `inside` with the amplitudes
            that came out.

        Notes
        -----
        At fixed preload the blend of two cubics is a cubic; four values determine it.
        """
        low, high = self.ranges["amplitude"]
        nodes = AmplitudeCubic.nodes(low, high)
        fixed = np.broadcast_arrays(
            np.asarray(preload, dtype=float), np.asarray(frequency, dtype=float)
        )
        points, shape = broadcast_points(
            fixed[0][..., np.newaxis], nodes, fixed[1][..., np.newaxis]
        )
        return AmplitudeCubic.through(self._evaluate(points).reshape(shape), low, high)

    def scaled(self, factor: float) -> DynamicStiffnessSurface:
        """Scale the dynamic stiffness over the same preload, ``K(F0) → x K(F0)``.

        Parameters
        ----------
        factor : float
            Dynamic design factor, above 0 [1].

        Returns
        -------
        DynamicStiffnessSurface
            The loss factor stays the same.

        Raises
        ------
        InputError
            A factor that is not positive and finite.
        """
        if not (np.isfinite(factor) and factor > 0):
            raise InputError(f"a stiffness factor is above 0, not {factor}")
        return replace(self, real=self.real.scaled(factor), imag=self.imag.scaled(factor))

    def to_arrays(self) -> NamedArrays:
        """Store the surface as named arrays without Python objects, such as for ``numpy.savez``."""
        return {
            "format": np.asarray(STORAGE_FORMAT),
            **{name: np.asarray(getattr(self, name)) for name in _PLAIN_FIELDS},
            **to_arrays(self.region, "region_"),
            **to_arrays(self.real, "real_"),
            **to_arrays(self.imag, "imag_"),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> DynamicStiffnessSurface:
        """Build the surface from the arrays of `to_arrays`, bit for bit.

        Parameters
        ----------
        arrays : mapping of str to array
            As stored.

        Returns
        -------
        DynamicStiffnessSurface

        Raises
        ------
        InputError
            A format of another version, or an array that is missing.
        """
        missing = [name for name in ("format", *_PLAIN_FIELDS) if name not in arrays]
        if missing:
            raise InputError(f"a stored response surface lacks the arrays {missing}: fit it again")
        if int(arrays["format"]) != STORAGE_FORMAT:
            raise InputError(
                f"a response surface of format {int(arrays['format'])} cannot be read, this "
                f"version of deboom reads format {STORAGE_FORMAT}: fit it again"
            )
        return cls(
            region=from_arrays(TrainingRegion, arrays, "region_"),
            real=from_arrays(PiecewiseCubic, arrays, "real_"),
            imag=from_arrays(PiecewiseCubic, arrays, "imag_"),
            **{name: arrays[name].item() for name in _PLAIN_FIELDS},
        )

    def _evaluate(self, points: RealArray) -> ComplexArray:
        return np.asarray(self.real(points)[:, 0] + 1j * self.imag(points)[:, 0])

    def _held(self, points: RealArray) -> npt.NDArray[np.bool_]:
        worst = np.maximum(self.real.leverage_ratio(points), self.imag.leverage_ratio(points))
        beside = self.region.distance(points) <= BESIDE
        return np.asarray((worst <= 1 + 1e-9) | (beside & (worst <= LEVERAGE_BESIDE)))


_PLAIN_FIELDS = ("preload_unit", "n_lines", "r2_real", "r2_imag", "r2_force")
