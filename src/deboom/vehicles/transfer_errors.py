"""What may be wrong with measured noise transfer functions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.vehicles.uncertainty_source import MeasuredArrays, complex_normals, refuse_negative

NEPER_PER_DB = np.log(10.0) / 20.0
SMALLEST_SHARE = 1e-9
"""Components of a smooth error with a smaller share of its variance are left out [1]."""


@dataclass(frozen=True)
class TransferCalibration:
    """Level of a vehicle's noise transfer functions: microphone and source, all paths alike.

    Parameters
    ----------
    decibels : float
        Standard deviation [dB].
    origin : str
        Where it comes from.
    name : str
        Of the source.
    degrees_of_freedom : float
        Behind the standard deviation; infinite where it is stated.
    """

    decibels: float
    origin: str
    name: str = "calibration of the transfer functions"
    degrees_of_freedom: float = np.inf

    def __post_init__(self) -> None:
        refuse_negative(self.name, self.decibels)

    @property
    def size(self) -> str:
        """Standard deviation in words."""
        return f"{self.decibels:.2g} dB per vehicle"

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""
        normals = generator.standard_normal((len(data.transfer), 1, 1))
        deviation = self.decibels * _scale(self.degrees_of_freedom, generator)
        gain = np.exp(NEPER_PER_DB * deviation * normals)
        return replace(data, transfer=data.transfer * gain)


@dataclass(frozen=True)
class TransferPaths:
    """Smooth complex error of every noise transfer function: place and direction.

    Parameters
    ----------
    relative : float
        Root mean square of the complex error over the magnitude around the line, in the phase of
        the function, see `deboom.measurement.method_difference.local_magnitude` [1].
    length : float
        Correlation length over frequency [Hz].
    origin : str
        Where they come from.
    name : str
        Of the source.
    degrees_of_freedom : float
        Behind the root mean square; infinite where it is stated.
    """

    relative: float
    length: float
    origin: str
    name: str = "transfer functions, path by path"
    degrees_of_freedom: float = np.inf

    def __post_init__(self) -> None:
        refuse_negative(self.name, self.relative)
        smooth_basis(np.zeros(1), self.length)

    @property
    def size(self) -> str:
        """Standard deviation in words."""
        return f"{100 * self.relative:.2g} % rms, correlated over {self.length:.2g} Hz"

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""
        basis = _kept_basis(data.frequency.tobytes(), self.length)
        n_vehicle, _, n_path = data.transfer.shape
        normals = complex_normals((n_vehicle, basis.shape[1], n_path), generator)
        error = self.relative * _scale(self.degrees_of_freedom, generator) * (basis @ normals)
        around, size = data.transfer_around, np.abs(data.transfer)
        phase = np.divide(data.transfer, size, out=np.ones_like(data.transfer), where=size > 0)
        return replace(data, transfer=data.transfer + around * phase * error)


@dataclass(frozen=True)
class TransferBody:
    """Smooth complex factor on all paths of a vehicle: damping and resonances of another day.

    Parameters
    ----------
    relative : float
        Root mean square of the complex error [1].
    length : float
        Correlation length over frequency, about the width of a resonance [Hz].
    origin : str
        Where they come from.
    name : str
        Of the source.
    """

    relative: float
    length: float
    origin: str
    name: str = "body of the vehicles, day by day"

    def __post_init__(self) -> None:
        refuse_negative(self.name, self.relative)
        smooth_basis(np.zeros(1), self.length)

    @property
    def size(self) -> str:
        """Standard deviation in words."""
        return f"{100 * self.relative:.2g} % rms, correlated over {self.length:.2g} Hz"

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""
        basis = _kept_basis(data.frequency.tobytes(), self.length)
        normals = complex_normals((len(data.transfer), basis.shape[1], 1), generator)
        factor = np.exp(self.relative * (basis @ normals))
        return replace(data, transfer=data.transfer * factor)


@dataclass(frozen=True)
class TransferFloor:
    """Noise floor of the noise transfer functions, line by line.

    Parameters
    ----------
    floor : float
        Of the real and of the imaginary part [Pa/N].
    origin : str
        Where it comes from.
    """

    floor: float
    origin: str
    name: str = "noise floor of the transfer functions"

    def __post_init__(self) -> None:
        refuse_negative(self.name, self.floor)

    @property
    def size(self) -> str:
        """Standard deviation in words."""
        return f"{self.floor:.2g} Pa/N per line"

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""
        noise = np.sqrt(2.0) * self.floor * complex_normals(data.transfer.shape, generator)
        return replace(data, transfer=data.transfer + noise)


def smooth_basis(frequency: RealArray, length: float) -> RealArray:
    """Return the functions that a smooth random error of unit variance is made of.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    length : float
        Correlation length, above 0 [Hz].

    Returns
    -------
    array, shape (n_frequency, n)
        ``B``: the error ``B z`` of standard normals z has the correlation
        ``exp(-(Δf/length)²/2)`` between lines.

    Raises
    ------
    InputError
        A length that is not positive and finite.

    Notes
    -----
    Karhunen-Loève expansion on the lines: the eigenvectors of the correlation matrix times the
    roots of their eigenvalues, without those that carry no variance.
    """
    if not (np.isfinite(length) and length > 0):
        raise InputError(f"a correlation length of {length} Hz: give one above 0")
    distance = (frequency[:, np.newaxis] - frequency) / length
    values, vectors = np.linalg.eigh(np.exp(-(distance**2) / 2.0))
    kept = values > SMALLEST_SHARE * frequency.size
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


@lru_cache(maxsize=16)
def _kept_basis(frequency: bytes, length: float) -> RealArray:
    return smooth_basis(np.frombuffer(frequency), length)


def _scale(degrees_of_freedom: float, generator: np.random.Generator) -> float:
    """Draw the true standard deviation over one that was estimated: errors follow Student's t."""
    if np.isinf(degrees_of_freedom):
        return 1.0
    return float(np.sqrt(degrees_of_freedom / generator.chisquare(degrees_of_freedom)))
