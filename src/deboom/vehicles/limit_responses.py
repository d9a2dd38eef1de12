"""What a limit is stated for in every vehicle: the mean level of the lines, or a band's peak.

All wrap an index of `deboom.vehicles.booming_model` and keep its seam: designs in, one number
per vehicle out, with exact derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics import sound_level
from deboom.vehicles.booming_model import LoadCaseIndex, checked_designs
from deboom.vehicles.booming_model import pressure_1 as pressure
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.fleet import Band, PathContributions, lines_inside
from deboom.vehicles.kernel_numpy import one_blas_thread

DIFFERENCE = 1e-4
"""Step of central differences, relative: of a design's pressure by its factors [1]."""
BLOCK = 512
"""Designs whose levels are in memory at a time."""


@dataclass(frozen=True, eq=False)
class MeanLevel:
    """Mean level of the lines of every vehicle, ``SPLV / n_lines`` [dB(A)].

    Parameters
    ----------
    index : LoadCaseIndex
        Its weighted load cases are averaged.
    """

    index: LoadCaseIndex[Any, Any]
    quantity: str = "mean level of the lines"

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Of the designs."""
        return self.index.variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.index.response_names

    @property
    def response_unit(self) -> str:
        """Of all responses."""
        return self.index.response_unit

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the levels of designs (n, n_variable), shape (n, n_vehicle) [dB(A)]."""
        return np.asarray(self.index(designs) / self.index.n_lines)

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives, shape (n, n_vehicle, n_variable) [dB(A) per unit factor]."""
        return np.asarray(self.index.gradient(designs) / self.index.n_lines)


@dataclass(frozen=True, eq=False)
class PeakLevel:
    """Loudest line of a band in every vehicle, over all load cases that count [dB(A)].

    Parameters
    ----------
    index : LoadCaseIndex
        With prescribed or coupled motion. The weights of its load cases play no role: the loudest
        of them counts.
    band : (lower, upper)
        Both edges belong to the band [Hz].

    Raises
    ------
    InputError
        A band without a line of the index, or a motion that follows the amplitude.

    Notes
    -----
    The derivative is that of the loudest line, ``20/ln 10 Re(∂p_f/∂x_k / p_f)``: exact wherever one
    line is louder than all others, and a subgradient where two are equally loud.
    """

    index: LoadCaseIndex[Any, Any]
    band: Band
    quantity: str = "peak level"
    _cases: tuple[PathContributions | CoupledMotion, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        inside = np.flatnonzero(lines_inside(self.index.frequency, self.band, "the index"))
        cases = tuple(_at_lines(case, inside) for case in _line_cases(self.index, "peak levels"))
        object.__setattr__(self, "_cases", cases)

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Of the designs."""
        return self.index.variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.index.response_names

    @property
    def response_unit(self) -> str:
        """Of all responses."""
        return self.index.response_unit

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the peaks of designs (n, n_variable), shape (n, n_vehicle) [dB(A)]."""
        return self._loudest(checked_designs(designs, self.variable_names))[0]

    def frequency(self, designs: npt.ArrayLike) -> RealArray:
        """Return where the peaks lie, shape (n, n_vehicle) [Hz]."""
        place = self._loudest(checked_designs(designs, self.variable_names))[1]
        lines = np.concatenate([case.frequency for case in self._cases])
        return np.asarray(lines[place])

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives, shape (n, n_vehicle, n_variable) [dB(A) per unit factor]."""
        rows = checked_designs(designs, self.variable_names)
        place = self._loudest(rows)[1]
        found = np.zeros((len(rows), len(self.response_names), len(self.variable_names)))
        first = 0
        for case in self._cases:
            for line in range(case.frequency.size):
                loudest = place == first + line
                asked = np.flatnonzero(loudest.any(axis=1))
                if asked.size:
                    slope = _neper_gradient(_at_lines(case, np.array([line])), rows[asked])
                    found[asked] += np.where(loudest[asked, :, np.newaxis], slope, 0.0)
            first += case.frequency.size
        return np.asarray(20.0 / np.log(10.0) * found)

    def _loudest(self, designs: RealArray) -> tuple[RealArray, npt.NDArray[np.intp]]:
        """Return level and place of the loudest line over all load cases, both (n, n_vehicle)."""
        energy = np.empty((len(designs), len(self.response_names)))
        place = np.empty(energy.shape, dtype=np.intp)
        weighting = [10.0 ** (sound_level.a_weighting(c.frequency) / 10.0) for c in self._cases]
        for start in range(0, len(designs), BLOCK):
            block = slice(start, start + BLOCK)
            lines = np.concatenate(
                [
                    _squared_pressure(case, designs[block]) * weight
                    for case, weight in zip(self._cases, weighting, strict=True)
                ],
                axis=-1,
            )
            place[block] = lines.argmax(axis=-1)
            energy[block] = np.take_along_axis(lines, place[block][..., np.newaxis], -1)[..., 0]
        with np.errstate(divide="ignore"):
            level = 10.0 * np.log10(energy / (2.0 * sound_level.REFERENCE_PRESSURE**2))
        return level, place


@dataclass(frozen=True, eq=False)
class ScatteredLevel:
    """Mean level of the lines of every vehicle, each with the energy that scatter adds [dB(A)].

    Parameters
    ----------
    index : LoadCaseIndex
        With prescribed or coupled motion. Its weighted load cases are averaged.
    design : array, shape (k,)
        At which the energy of the scatter is taken, such as today's [1].
    relative_sigma : array, shape (k,)
        Standard deviation of each factor over the factor itself [1].

    Raises
    ------
    InputError
        A motion that follows the amplitude.

    Notes
    -----
    To first order parts that scatter have the mean energy ``|p|² + Σ_k |σ_k x_k ∂p/∂x_k|²`` in a
    line; the sum is that of `design`. A search needs it: the mean level of a single design falls
    without end where all paths cancel in one line, which no part that is made does.
    """

    index: LoadCaseIndex[Any, Any]
    design: RealArray
    relative_sigma: RealArray
    _cases: tuple[PathContributions | CoupledMotion, ...] = field(init=False, repr=False)
    _scatter: tuple[RealArray, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        cases = _line_cases(self.index, "levels with scatter")
        steps = DIFFERENCE * np.diag(self.design)
        found = []
        for case in cases:
            ahead, behind = (_pressure(case, self.design + step) for step in (steps, -steps))
            change = self.relative_sigma[:, np.newaxis, np.newaxis] * (ahead - behind)
            found.append(np.sum(np.abs(change / (2.0 * DIFFERENCE)) ** 2, axis=0))
        object.__setattr__(self, "_cases", cases)
        object.__setattr__(self, "_scatter", tuple(found))

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Of the designs."""
        return self.index.variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.index.response_names

    @property
    def response_unit(self) -> str:
        """Of all responses."""
        return self.index.response_unit

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the levels of designs (n, n_variable), shape (n, n_vehicle) [dB(A)]."""
        rows = checked_designs(designs, self.variable_names)
        found = np.zeros((len(rows), len(self.response_names)))
        for weight, case, scatter in zip(
            self.index.weights, self._cases, self._scatter, strict=True
        ):
            weighting = sound_level.a_weighting(case.frequency)
            for start in range(0, len(rows), BLOCK):
                block = slice(start, start + BLOCK)
                energy = _squared_pressure(case, rows[block]) + scatter
                level = 10.0 * np.log10(energy / (2.0 * sound_level.REFERENCE_PRESSURE**2))
                found[block] += weight * (level + weighting).mean(axis=-1)
        return found

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives, shape (n, n_vehicle, n_variable) [dB(A) per unit factor]."""
        rows = checked_designs(designs, self.variable_names)
        found = np.zeros((len(rows), len(self.response_names), len(self.variable_names)))
        for weight, case, scatter in zip(
            self.index.weights, self._cases, self._scatter, strict=True
        ):
            for start in range(0, len(rows), BLOCK):
                block = slice(start, start + BLOCK)
                own = _pressure(case, rows[block])
                factor = own.conj() / (np.abs(own) ** 2 + scatter)
                slope = _weighted_gradient(case, rows[block], factor)
                found[block] += weight / case.frequency.size * slope
        return np.asarray(20.0 / np.log(10.0) * found)


def _line_cases(
    index: LoadCaseIndex[Any, Any], what: str
) -> tuple[PathContributions | CoupledMotion, ...]:
    """Return the load cases of an index whose pressure is known line by line."""
    for case in index.contributions:
        if type(case) not in (PathContributions, CoupledMotion):
            raise InputError(f"{what} need prescribed or coupled motion, not {type(case).__name__}")
    return tuple(index.contributions)


def _pressure(case: PathContributions | CoupledMotion, designs: RealArray) -> ComplexArray:
    """Return the pressure of the lines, shape (n, n_vehicle, n_frequency) [Pa]."""
    return case.pressure(designs) if isinstance(case, CoupledMotion) else pressure(case, designs)


def _weighted_gradient(
    case: PathContributions | CoupledMotion, designs: RealArray, factor: ComplexArray
) -> RealArray:
    """Return ``Σ_f Re(a_f ∂p/∂x_k)``, shape (n, n_vehicle, n_variable) [1]."""
    if isinstance(case, CoupledMotion):
        return case.weighted_gradient(designs, factor)
    return np.asarray(np.einsum("vfk,dvf->dvk", case.values, factor).real)


def _at_lines(
    case: PathContributions | CoupledMotion, lines: npt.NDArray[np.intp]
) -> PathContributions | CoupledMotion:
    """Return a load case of some lines only."""
    if isinstance(case, PathContributions):
        return replace(case, frequency=case.frequency[lines], values=case.values[:, lines])
    return replace(
        case,
        frequency=case.frequency[lines],
        stiffness=case.stiffness[lines],
        load=case.load[lines],
        transfer=case.transfer[:, lines],
        own_stiffness=case.own_stiffness[lines],
        own_load=case.own_load[lines],
        own_transfer=case.own_transfer[:, lines],
    )


def _squared_pressure(case: PathContributions | CoupledMotion, designs: RealArray) -> RealArray:
    """Return ``|p|²`` of the lines, shape (n, n_vehicle, n_frequency) [Pa²]."""
    if isinstance(case, CoupledMotion):
        return np.asarray(np.abs(case.pressure(designs)) ** 2)
    table = case.values.reshape(-1, case.values.shape[2]).T
    with one_blas_thread():
        squared = (designs @ table.real) ** 2 + (designs @ table.imag) ** 2
    return np.asarray(squared.reshape(len(designs), *case.values.shape[:2]))


def _neper_gradient(case: PathContributions | CoupledMotion, designs: RealArray) -> RealArray:
    return _weighted_gradient(case, designs, 1.0 / _pressure(case, designs))
