"""What every booming index shares: weighted load cases, names, the sum over the lines."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics import sound_level
from deboom.vehicles.synthesis import checked_designs


class LevelSum(Protocol):
    """What a kernel makes of one load case; a process pool can carry it."""

    def __call__(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f 20 lg |p_vf|`` of designs (n, n_variable), (n, n_vehicle) [dB re 1 Pa].

        The row of a design depends on that design alone, bit for bit. It is not finite when the
        pressure of a line is exactly zero.
        """


class MotionCase(Protocol):
    """One load case in a fleet, with a model of the motion."""

    @property
    def load_case(self) -> str:
        """Name of the load case."""

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_frequency,) [Hz]."""

    @property
    def vehicle_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of each design variable."""


class Kernel(Protocol):
    """What sums the levels, as far as a run's record is concerned."""

    @property
    def name(self) -> str:
        """What the run's record calls it."""


CaseT = TypeVar("CaseT", bound=MotionCase)
KernelT = TypeVar("KernelT", bound=Kernel)


@dataclass(frozen=True, eq=False)
class LoadCaseIndex(ABC, Generic[CaseT, KernelT]):
    """SPLV of every vehicle over weighted load cases; subclasses say how the motion answers.

    Parameters
    ----------
    contributions : sequence
        One per load case, of the same vehicles, lines and variables.
    weights : sequence of float
        Of the load cases, not negative; kept normalised to a sum of 1, without load cases of
        weight 0 [1].
    kernel : object
        Sums the levels; made for this motion.

    Raises
    ------
    InputError
        Weights that are negative or all zero, load cases that differ in vehicles, lines or
        variables, or a line to which no path of a vehicle contributes.
    """

    contributions: tuple[CaseT, ...]
    weights: tuple[float, ...]
    kernel: KernelT
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
            _refuse_silent_lines(case, self._transmits(case))
        object.__setattr__(self, "contributions", cases)
        object.__setattr__(self, "weights", tuple(weight for _, weight in used))
        object.__setattr__(self, "level_sums", tuple(self._level_sum(case) for case in cases))
        lines = cases[0].frequency
        one_pascal = sound_level.splv(sound_level.spl(np.ones(lines.size), lines))
        object.__setattr__(self, "one_pascal", float(one_pascal))

    @abstractmethod
    def _level_sum(self, case: CaseT) -> LevelSum:
        """Prepare the kernel for one load case."""

    @abstractmethod
    def _transmits(self, case: CaseT) -> npt.NDArray[np.bool_]:
        """Say where a path reaches the ear, shape (n_vehicle, n_frequency)."""

    @abstractmethod
    def _pressure(self, case: CaseT, designs: RealArray) -> ComplexArray:
        """Return the pressure of designs, shape (n, n_vehicle, n_frequency) [Pa]."""

    @abstractmethod
    def _neper_gradient(self, case: CaseT, designs: RealArray) -> RealArray:
        """Return ``Σ_f Re(∂p/∂x_k / p)``, shape (n, n_vehicle, n_variable)."""

    @property
    def load_case_names(self) -> tuple[str, ...]:
        """Name of each load case that counts."""
        return tuple(case.load_case for case in self.contributions)

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_lines,) [Hz]."""
        return self.contributions[0].frequency

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

    def levels(self, designs: npt.ArrayLike, load_case: str | None = None) -> RealArray:
        """Return the sound pressure level of every line in one load case.

        Parameters
        ----------
        designs : array_like, shape (n, n_variable)
            Stiffness factors [1].
        load_case : str, optional
            By default the first one.

        Returns
        -------
        array, shape (n, n_vehicle, n_lines)
            [dB(A)]; the sum over the lines is SPLV in that load case.

        Raises
        ------
        InputError
            A load case that does not count here; designs of another shape, or not finite.
        """
        factors = checked_designs(designs, self.variable_names)
        names = self.load_case_names
        if load_case is not None and load_case not in names:
            raise InputError(f"no load case {load_case!r} in the index: use one of {list(names)}")
        case = self.contributions[names.index(load_case) if load_case is not None else 0]
        return sound_level.spl(self._pressure(case, factors), case.frequency, axis=-1)

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
        ``∂SPLV/∂x_k = 20/ln 10 Σ_f Re(∂p_f/∂x_k / p_f)``, exact. In a notch p is small and the
        derivative large, and good for small steps only.
        """
        factors = checked_designs(designs, self.variable_names)
        total = np.zeros((len(factors), len(self.response_names), len(self.variable_names)))
        for weight, case in zip(self.weights, self.contributions, strict=True):
            with np.errstate(divide="ignore", invalid="ignore"):
                total += weight * self._neper_gradient(case, factors)
        return np.asarray(20.0 / np.log(10.0) * total)


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


def _check_same_axes(case: MotionCase, first: MotionCase) -> None:
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


def _refuse_silent_lines(case: MotionCase, transmits: npt.NDArray[np.bool_]) -> None:
    silent = np.argwhere(~transmits)
    if silent.size:
        vehicle, line = silent[0]
        raise InputError(
            f"load case {case.load_case}: no path contributes to the pressure in vehicle "
            f"{case.vehicle_names[vehicle]} at {case.frequency[line]:g} Hz: repair the measurement "
            "or choose a band without that line"
        )
