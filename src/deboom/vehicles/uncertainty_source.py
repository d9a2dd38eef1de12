"""What every cause of error has in common: it can measure the data again.

A source changes measured data as another measurement with the same equipment would have changed
them. Its errors are independent standard-normal draws of its own.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


@dataclass(frozen=True, eq=False)
class MeasuredArrays:
    """The measured data of a study as plain arrays.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    transfer : array, shape (n_vehicle, n_frequency, n_path)
        Noise transfer functions [Pa/N].
    transfer_around : array, of that shape
        Magnitude around each line, as measured, see
        `deboom.measurement.method_difference.local_magnitude` [Pa/N].
    displacement, force : array, shape (n_load_case, n_frequency, n_channel)
        Of the mounts [m], [N].
    paths, channels : tuple of str
        ``<mount> <axis>`` and ``<mount> [<piece>] <axis>``.
    """

    frequency: RealArray
    transfer: ComplexArray
    transfer_around: RealArray
    displacement: ComplexArray
    force: ComplexArray
    paths: tuple[str, ...]
    channels: tuple[str, ...]


class UncertaintySource(Protocol):
    """One independent cause of error."""

    @property
    def name(self) -> str:
        """In a few words; unique among the sources of a study."""

    @property
    def origin(self) -> str:
        """Where its size comes from."""

    @property
    def size(self) -> str:
        """Standard deviation, in words with its unit."""

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""


def own_generator(source: UncertaintySource, seed: int, draw: int) -> np.random.Generator:
    """Return the generator of one draw of a source; no other source changes it.

    Raises
    ------
    InputError
        A seed below 1, a draw below 0.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    if draw < 0:
        raise InputError(f"draw {draw} is refused: draws count from 0")
    return np.random.default_rng([seed, zlib.crc32(source.name.encode()), draw])


def complex_normals(shape: tuple[int, ...], generator: np.random.Generator) -> ComplexArray:
    """Draw complex values of unit mean square."""
    parts = generator.standard_normal((2, *shape))
    return np.asarray((parts[0] + 1j * parts[1]) / np.sqrt(2.0))


def refuse_negative(name: str, deviation: float) -> None:
    """Raise `InputError` where a standard deviation is negative or not finite."""
    if not (np.isfinite(deviation) and deviation >= 0):
        raise InputError(f"{name}: a standard deviation of {deviation}: give a number from 0")
