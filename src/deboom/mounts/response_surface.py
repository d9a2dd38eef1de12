"""The response surface: operating dynamic stiffness as complete cubics in pieces of the preload."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.mounts.agreement import r_squared
from deboom.mounts.amplitude_cubic import AmplitudeCubic
from deboom.mounts.cubic_fit import PieceOptions, fit_piecewise_cubic
from deboom.mounts.cubic_pieces import PiecewiseCubic
from deboom.mounts.named_arrays import NamedArrays, from_arrays, to_arrays
from deboom.mounts.stiffness_model import StiffnessModel, StiffnessSamples, broadcast_points
from deboom.mounts.training_region import REACH, TrainingRegion

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
