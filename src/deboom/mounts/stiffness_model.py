"""What every model of a mount's operating dynamic stiffness offers, and what it is fitted to.

A model gives the complex stiffness of one direction over preload, displacement amplitude and
frequency. It knows where it was measured and refuses to speak about anything else.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.mounts.training_region import TrainingRegion

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
