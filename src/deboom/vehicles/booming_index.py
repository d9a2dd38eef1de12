"""The seam to the exploration: designs of the mounts in, one number per vehicle out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import Mount
from deboom.physics import sound_level
from deboom.physics.arrays import ComplexArray, RealArray
from deboom.vehicles.fleet import Band, Fleet, PathContributions, path_contributions
from deboom.vehicles.synthesis import checked_designs, pressure


class LevelSum(Protocol):
    """What a kernel makes of one set of contributions; a process pool can carry it."""

    def __call__(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f 20 lg |Σ_k x_k C_vfk|``, shape (n, n_vehicle) [dB re 1 Pa].

        The row of a design depends on that design alone, bit for bit. It is not finite when the
        pressure of a line is exactly zero.
        """


class LevelSumKernel(Protocol):
    """A way to compute sums of levels; all kernels agree within 1e-9 dB."""

    @property
    def name(self) -> str:
        """What the run's record calls it."""

    def prepare(self, contributions: ComplexArray) -> LevelSum:
        """Lay out contributions, shape (n_vehicle, n_frequency, n_variable) [Pa], once."""


@dataclass(frozen=True, eq=False)
class BoomingIndex:
    """SPLV of every vehicle, as a function of the stiffness factors of the mounts.

    ``index(designs)`` is all that an exploration needs. The object is a value: it can be pickled
    into a process pool, and a design gives the same bits however designs are batched or ordered.

    Parameters
    ----------
    contributions : sequence of PathContributions
        One per load case, of the same vehicles, lines and variables.
    weights : sequence of float
        Of the load cases, not negative; kept normalised to a sum of 1, without load cases of
        weight 0 [1].
    kernel : LevelSumKernel
        Such as `deboom.vehicles.kernel_numpy.NUMPY`.

    Raises
    ------
    InputError
        Weights that are negative or all zero, load cases that differ in vehicles, lines or
        variables, or a line to which no path of a vehicle contributes.

    Notes
    -----
    ``SPLV_v = Σ_c w_c Σ_f [20 lg(|Σ_k x_k C_cvfk| / (√2 p0)) + A(f)]``, thesis, eq. 35, as the mean
    over load cases. A sum of decibels counts 1 dB in a notch like 1 dB at a peak.
    """

    contributions: tuple[PathContributions, ...]
    weights: tuple[float, ...]
    kernel: LevelSumKernel
    level_sums: tuple[LevelSum, ...] = field(init=False, repr=False)
    one_pascal: float = field(init=False, repr=False)
    """SPLV of 1 Pa at every line: the A-weighting and the reference of all lines at once."""

    def __post_init__(self) -> None:
        weights = _normalised(self.weights, [case.load_case for case in self.contributions])
        pairs = zip(self.contributions, weights, strict=True)
        used = [(case, weight) for case, weight in pairs if weight > 0]
        cases = tuple(case for case, _ in used)
        for case in cases:
            _check_same_axes(case, cases[0])
            _refuse_silent_lines(case)
        object.__setattr__(self, "contributions", cases)
        object.__setattr__(self, "weights", tuple(weight for _, weight in used))
        sums = tuple(self.kernel.prepare(case.values) for case in cases)
        object.__setattr__(self, "level_sums", sums)
        lines = cases[0].frequency
        one_pascal = sound_level.splv(sound_level.spl(np.ones(lines.size), lines))
        object.__setattr__(self, "one_pascal", float(one_pascal))

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of each column of the designs, ``<mount> <axis>``."""
        return self.contributions[0].variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.contributions[0].vehicle_names

    @property
    def response_unit(self) -> str:
        """Unit of all responses."""
        return "dB(A)"

    @property
    def n_lines(self) -> int:
        """Number of lines in each sum: SPLV over it is the mean level of the lines."""
        return self.contributions[0].frequency.size

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return SPLV of each design in each vehicle.

        Parameters
        ----------
        designs : array_like, shape (n, n_variable)
            Stiffness factors [1].

        Returns
        -------
        array, shape (n, n_vehicle)
            [dB(A)]; minus infinity where a design silences a line completely.

        Raises
        ------
        InputError
            Designs of another shape, or not finite.
        """
        factors = checked_designs(designs, self.variable_names)
        total = np.full((len(factors), len(self.response_names)), self.one_pascal)
        for weight, level_sum in zip(self.weights, self.level_sums, strict=True):
            total += weight * level_sum(factors)
        return total

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivative of SPLV by each stiffness factor.

        Parameters
        ----------
        designs : array_like, shape (n, n_variable)
            Stiffness factors [1].

        Returns
        -------
        array, shape (n, n_vehicle, n_variable)
            [dB(A) per unit factor]; NaN where a design silences a line completely.

        Raises
        ------
        InputError
            Designs of another shape, or not finite.

        Notes
        -----
        ``∂SPLV/∂x_k = 20/ln 10 Σ_f Re(C_fk / p_f)``, exact. In a notch p is small and the
        derivative large, and good for small steps only.
        """
        factors = checked_designs(designs, self.variable_names)
        total = np.zeros((len(factors), len(self.response_names), len(self.variable_names)))
        for weight, case in zip(self.weights, self.contributions, strict=True):
            with np.errstate(divide="ignore", invalid="ignore"):
                inverse = 1.0 / pressure(case, factors)
                total += weight * np.einsum("vfk,dvf->dvk", case.values, inverse).real
        return np.asarray(20.0 / np.log(10.0) * total)


def booming_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
    kernel: LevelSumKernel,
) -> BoomingIndex:
    """Return the booming index of a fleet over weighted load cases, with the motion prescribed.

    Parameters
    ----------
    fleet : Fleet
        One response per vehicle.
    mounts : sequence of Mount
        Three design variables per mount.
    load_cases : sequence of (LoadCase, weight)
        Weights are not negative and are normalised to a sum of 1 [1].
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    kernel : LevelSumKernel
        Such as `deboom.vehicles.kernel_numpy.NUMPY`.

    Returns
    -------
    BoomingIndex

    Raises
    ------
    InputError
        See `path_contributions` and `BoomingIndex`.
    """
    cases = tuple(path_contributions(fleet, mounts, case, band) for case, _ in load_cases)
    return BoomingIndex(cases, tuple(weight for _, weight in load_cases), kernel)


def _normalised(weights: Sequence[float], names: Sequence[str]) -> list[float]:
    if len(weights) != len(names):
        raise InputError(f"{len(weights)} weights for the load cases {list(names)}: give one each")
    for weight, name in zip(weights, names, strict=True):
        if not (np.isfinite(weight) and weight >= 0):
            raise InputError(f"load case {name}: weight {weight} is not a number of at least 0")
    total = sum(weights)
    if not total > 0:
        raise InputError(f"load cases {list(names)}: give at least one a weight above 0")
    return [float(weight / total) for weight in weights]


def _check_same_axes(case: PathContributions, first: PathContributions) -> None:
    same = (
        case.vehicle_names == first.vehicle_names
        and case.variable_names == first.variable_names
        and np.array_equal(case.frequency, first.frequency)
    )
    if not same:
        raise InputError(
            f"load cases {first.load_case} and {case.load_case} differ in vehicles, variables or "
            "lines: compute their contributions with the same fleet, mounts and band"
        )


def _refuse_silent_lines(case: PathContributions) -> None:
    silent = np.argwhere(~case.values.any(axis=2))
    if silent.size:
        vehicle, line = silent[0]
        raise InputError(
            f"load case {case.load_case}: no path contributes to the pressure in vehicle "
            f"{case.vehicle_names[vehicle]} at {case.frequency[line]:g} Hz: repair the measurement "
            "or choose a band without that line"
        )
