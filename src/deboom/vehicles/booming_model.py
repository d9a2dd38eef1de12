"""The booming index of a fleet: designs of the mounts in, SPLV of every vehicle out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import LoadCase
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.physics import sound_level
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.vehicles.amplitude_motion import (
    AmplitudeMotion,
    amplitude_motion,
    identified_surfaces,
    pressure,
    solve_along_lines,
)
from deboom.vehicles.coupled_motion import CoupledMotion, coupled_motion
from deboom.vehicles.design_factor import DYNAMIC, DesignFactor
from deboom.vehicles.fleet import Band, Fleet, PathContributions, path_contributions
from deboom.vehicles.kernel_split_numpy import NUMPY_SPLIT, split_motion, with_loss
from deboom.vehicles.powertrain import Powertrain


def checked_designs(designs: npt.ArrayLike, variable_names: Sequence[str]) -> RealArray:
    """Return designs as an array of one row per design, or say what is wrong with them.

    Parameters
    ----------
    designs : array_like, shape (n, n_variable)
        Stiffness factors [1].
    variable_names : sequence of str
        Name of each column.

    Returns
    -------
    array, shape (n, n_variable)

    Raises
    ------
    InputError
        Another shape, or a factor that is not finite.
    """
    rows = np.asarray(designs, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != len(variable_names):
        raise InputError(
            f"designs of shape {rows.shape}: give one row per design with the "
            f"{len(variable_names)} factors {list(variable_names)}"
        )
    if not np.isfinite(rows).all():
        row, column = (int(index) for index in np.argwhere(~np.isfinite(rows))[0])
        raise InputError(
            f"design {row}: the factor of {variable_names[column]} is {rows[row, column]}, give a "
            "finite number"
        )
    return rows


def path_pressures(contributions: PathContributions, designs: npt.ArrayLike) -> ComplexArray:
    """Return the pressure by design variable, kept complex: paths cancel.

    Parameters
    ----------
    contributions : PathContributions
        Per unit stiffness factor.
    designs : array_like, shape (n_design, n_variable)
        Stiffness factors [1].

    Returns
    -------
    array, shape (n_design, n_vehicle, n_frequency, n_variable)
        ``C_vfk x_dk`` [Pa].
    """
    factors = checked_designs(designs, contributions.variable_names)
    return np.asarray(factors[:, np.newaxis, np.newaxis, :] * contributions.values)


def pressure_1(contributions: PathContributions, designs: npt.ArrayLike) -> ComplexArray:
    """Return the pressure at the ears.

    Parameters
    ----------
    contributions : PathContributions
        Per unit stiffness factor.
    designs : array_like, shape (n_design, n_variable)
        Stiffness factors [1].

    Returns
    -------
    array, shape (n_design, n_vehicle, n_frequency)
        Complex peak amplitudes ``Σ_k C_vfk x_dk`` [Pa].

    Notes
    -----
    Thesis, eq. 12 and 13.
    """
    factors = checked_designs(designs, contributions.variable_names)
    return np.asarray(np.einsum("vfk,dk->dvf", contributions.values, factors))


def levels(contributions: PathContributions, designs: npt.ArrayLike) -> RealArray:
    """Return the sound pressure level of every line.

    Parameters
    ----------
    contributions : PathContributions
        Per unit stiffness factor.
    designs : array_like, shape (n_design, n_variable)
        Stiffness factors [1].

    Returns
    -------
    array, shape (n_design, n_vehicle, n_frequency)
        [dB(A)].
    """
    return sound_level.spl(pressure_1(contributions, designs), contributions.frequency, axis=-1)


def mean_energy_level(level: npt.ArrayLike, frequency: npt.ArrayLike, band: Band) -> RealArray:
    """Return the level of the mean energy of the lines of a band.

    Parameters
    ----------
    level : array_like, shape (..., n_frequency)
        Of the lines [dB(A)].
    frequency : array_like, shape (n_frequency,)
        Of the lines [Hz].
    band : (lower, upper)
        Both edges belong to the band, such as 25 and 40 Hz [Hz].

    Returns
    -------
    array, shape (...)
        ``10 lg mean 10^(L/10)`` [dB(A)].

    Raises
    ------
    InputError
        A band without a line, or a frequency axis of another length than `level` has.

    Notes
    -----
    The loud lines rule it, whereas SPLV counts every line alike. The mean instead of the sum makes
    it independent of the spacing of the lines.
    """
    lines = np.asarray(frequency, dtype=float)
    energy = sound_level.band_energy_level(level, lines, band, axis=-1)
    n_lines = np.count_nonzero((lines >= band[0]) & (lines <= band[1]))
    return np.asarray(energy - 10.0 * np.log10(n_lines))


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


class LevelSumKernel(Protocol):
    """A way to compute sums of levels; all kernels agree within 1e-9 dB."""

    @property
    def name(self) -> str:
        """What the run's record calls it."""

    def prepare(self, contributions: ComplexArray) -> LevelSum:
        """Lay out contributions, shape (n_vehicle, n_frequency, n_variable) [Pa], once."""


@dataclass(frozen=True, eq=False)
class BoomingIndex(LoadCaseIndex[PathContributions, LevelSumKernel]):
    """SPLV of every vehicle, as a function of the stiffness factors; the motion is prescribed.

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
    over load cases. A sum of decibels counts 1 dB in a notch like 1 dB at a peak. The gradient is
    that of ``p = Σ_k x_k C_k``, thus ``∂p/∂x_k = C_k``.
    """

    def _level_sum(self, case: PathContributions) -> LevelSum:
        return self.kernel.prepare(case.values)

    def _transmits(self, case: PathContributions) -> npt.NDArray[np.bool_]:
        return np.asarray(case.values.any(axis=2))

    def _pressure(self, case: PathContributions, designs: RealArray) -> ComplexArray:
        return pressure_1(case, designs)

    def _neper_gradient(self, case: PathContributions, designs: RealArray) -> RealArray:
        inverse = 1.0 / pressure_1(case, designs)
        return np.asarray(np.einsum("vfk,dvf->dvk", case.values, inverse).real)


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


class CoupledKernel(Protocol):
    """A way to re-solve the motion and sum the levels; all kernels agree within 1e-9 dB."""

    @property
    def name(self) -> str:
        """What the run's record calls it."""

    def prepare(self, motion: CoupledMotion) -> LevelSum:
        """Lay out the equations of motion of one load case, once."""


@dataclass(frozen=True, eq=False)
class CoupledIndex(LoadCaseIndex[CoupledMotion, CoupledKernel]):
    """SPLV of every vehicle, as a function of the stiffness factors; the motion is re-solved.

    The same seam as `deboom.vehicles.booming_model.BoomingIndex`: a value that can be pickled, and
    a design gives the same bits however designs are batched or ordered.

    Parameters
    ----------
    contributions : sequence of CoupledMotion
        One per load case, of the same vehicles, lines and variables.
    weights : sequence of float
        Of the load cases, not negative; kept normalised to a sum of 1, without load cases of
        weight 0 [1].
    kernel : CoupledKernel
        Such as `deboom.vehicles.kernel_numba.NUMBA_COUPLED`.

    Raises
    ------
    InputError
        Weights that are negative or all zero, load cases that differ in vehicles, lines or
        variables, or a line to which no path of a vehicle contributes.

    Notes
    -----
    Levels and SPLV as in thesis, eq. 35; the pressure is that of `CoupledMotion.pressure`, and the
    gradient that of its adjoint.
    """

    def _level_sum(self, case: CoupledMotion) -> LevelSum:
        return self.kernel.prepare(case)

    def _transmits(self, case: CoupledMotion) -> npt.NDArray[np.bool_]:
        both = np.concatenate([case.transfer, case.own_transfer], axis=2)
        return np.asarray(both.any(axis=2))

    def _pressure(self, case: CoupledMotion, designs: RealArray) -> ComplexArray:
        return case.pressure(designs)

    def _neper_gradient(self, case: CoupledMotion, designs: RealArray) -> RealArray:
        return case.neper_gradient(designs)


def coupled_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    powertrain: Powertrain,
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
    kernel: CoupledKernel,
) -> CoupledIndex:
    """Return the booming index of a fleet over weighted load cases, with the motion coupled.

    Parameters
    ----------
    fleet : Fleet
        One response per vehicle.
    mounts : sequence of Mount
        Three design variables per mount.
    powertrain : Powertrain
        Mass and inertia from the data sheet.
    load_cases : sequence of (LoadCase, weight)
        Weights are not negative and are normalised to a sum of 1 [1].
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    kernel : CoupledKernel
        Such as `deboom.vehicles.kernel_numba.NUMBA_COUPLED`.

    Returns
    -------
    CoupledIndex

    Raises
    ------
    InputError
        See `deboom.vehicles.coupled_motion.coupled_motion` and `CoupledIndex`.
    """
    cases = tuple(coupled_motion(fleet, mounts, powertrain, case, band) for case, _ in load_cases)
    return CoupledIndex(cases, tuple(weight for _, weight in load_cases), kernel)


BLOCK = 128
"""Designs solved at once; bounds the memory."""

GRADIENT_STEP = 1e-3
"""Of a factor, for differences of fourth order [1]."""

GRADIENT_TOLERANCE = 1e-12
"""Of the amplitudes they are taken from [1]."""


class AmplitudeKernel(Protocol):
    """A way to solve the motion and sum the levels; all agree within 1e-9 dB at one tolerance."""

    @property
    def name(self) -> str:
        """What the run's record calls it."""

    @property
    def tolerance(self) -> float:
        """Largest relative change of an amplitude in the last sweep [1]."""

    def prepare(self, motion: AmplitudeMotion) -> LevelSum:
        """Lay out the equations of motion of one load case, once."""


@dataclass(frozen=True)
class HeldShare:
    """How often designs leave what the mounts' measurements back.

    Parameters
    ----------
    amplitude, preload : float
        Share of lines and directions whose amplitude, or preload, lies beyond [1]. Directions
        without a surface do not count.
    worst : str
        Where it is most often: load case, direction, and its share of lines; empty if nowhere.
    """

    amplitude: float
    preload: float
    worst: str


@dataclass(frozen=True, eq=False)
class AmplitudeIndex(LoadCaseIndex[AmplitudeMotion, AmplitudeKernel]):
    """SPLV of every vehicle, as a function of the stiffness factors; stiffnesses follow the motion.

    The same seam as `deboom.vehicles.booming_model.CoupledIndex`: a value that can be pickled, and
    a design gives the same bits however designs are batched or ordered.

    Parameters
    ----------
    contributions : sequence of AmplitudeMotion
        One per load case, of the same vehicles, lines and variables.
    weights : sequence of float
        Of the load cases, not negative; kept normalised to a sum of 1, without load cases of
        weight 0 [1].
    kernel : AmplitudeKernel
        Such as `deboom.vehicles.kernel_amplitude_numba.NUMBA_AMPLITUDE`.
    factor : DesignFactor
        The meaning of a stiffness factor that the contributions were made with.

    Raises
    ------
    InputError
        Weights that are negative or all zero, load cases that differ in vehicles, lines or
        variables, or a line to which no path of a vehicle contributes.

    Notes
    -----
    A design whose amplitudes do not come to rest has an SPLV of NaN, so it counts as failed. The
    gradient is by differences of fourth order of amplitudes solved to 1e-12.
    """

    factor: DesignFactor = DYNAMIC

    @property
    def follows_amplitude(self) -> bool:
        """Whether any stiffness follows the amplitude; if not, the motion is coupled only."""
        return any(case.follows.any() for case in self.contributions)

    def held(self, designs: RealArray) -> HeldShare:
        """Count where designs (n, n_variable) leave what the mounts' measurements back.

        There the stiffness is held at the bound (amplitude), or follows the quasi-static curve
        (preload), see `deboom.vehicles.design_factor.PartRatio`.
        """
        amplitude, preload, worst, most = [], [], "", 0.0
        for case in self.contributions:
            names = [case.variable_names[k] for k in case.variables]
            beyond = [np.zeros(len(names))]
            if case.follows.any():
                solution = solve_along_lines(case, designs, self.kernel.tolerance)
                beyond.append(case.held(solution.ratio).mean(axis=(0, 1)))
                amplitude.append(beyond[-1][case.follows].mean())
            by_preload = case.ratio.held(designs).mean(axis=(0, 1))
            beyond.append(np.broadcast_to(by_preload, len(names)))
            preload.append(float(beyond[-1].mean()))
            share = np.max(beyond, axis=0)
            if share.max() > most:
                most = float(share.max())
                worst = f"{case.load_case}, {names[int(share.argmax())]}: {100 * most:.0f} %"
        return HeldShare(
            amplitude=float(np.mean(amplitude)) if amplitude else 0.0,
            preload=float(np.mean(preload)),
            worst=worst,
        )

    def _level_sum(self, case: AmplitudeMotion) -> LevelSum:
        return self.kernel.prepare(case)

    def _transmits(self, case: AmplitudeMotion) -> npt.NDArray[np.bool_]:
        both = np.concatenate([case.coupled.transfer, case.coupled.own_transfer], axis=2)
        return np.asarray(both.any(axis=2))

    def _pressure(self, case: AmplitudeMotion, designs: RealArray) -> ComplexArray:
        return _pressures(case, designs, self.kernel.tolerance)

    def _neper_gradient(self, case: AmplitudeMotion, designs: RealArray) -> RealArray:
        found = np.empty((len(designs), len(case.vehicle_names), designs.shape[1]))
        for k in range(designs.shape[1]):
            levels = []
            for steps in (-2, -1, 1, 2):
                moved = designs.copy()
                moved[:, k] += steps * GRADIENT_STEP
                pressures = _pressures(case, moved, GRADIENT_TOLERANCE)
                levels.append(np.log(np.abs(pressures)).sum(axis=-1))
            far_back, back, ahead, far_ahead = levels
            difference = 8.0 * (ahead - back) - (far_ahead - far_back)
            found[:, :, k] = difference / (12.0 * GRADIENT_STEP)
        return found


def _pressures(case: AmplitudeMotion, designs: RealArray, tolerance: float) -> ComplexArray:
    found = np.empty((len(designs), *case.coupled.transfer.shape[:2]), dtype=complex)
    for start in range(0, len(designs), BLOCK):
        rows = slice(start, start + BLOCK)
        found[rows] = pressure(case, solve_along_lines(case, designs[rows], tolerance))
    return found


def amplitude_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    parts: Sequence[CharacterisedMount],
    powertrain: Powertrain,
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
    kernel: AmplitudeKernel,
    factor: DesignFactor = DYNAMIC,
    follow: bool = True,
) -> AmplitudeIndex:
    """Return the booming index of a fleet whose mounts follow the amplitude, or resettle.

    Parameters
    ----------
    fleet : Fleet
        One response per vehicle.
    mounts : sequence of Mount
        Three design variables per mount.
    parts : sequence of CharacterisedMount
        The same mounts, characterised over wheel torque.
    powertrain : Powertrain
        Mass and inertia from the data sheet.
    load_cases : sequence of (LoadCase, weight)
        Weights are not negative and are normalised to a sum of 1 [1].
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    kernel : AmplitudeKernel
        Such as `deboom.vehicles.kernel_amplitude_numba.NUMBA_AMPLITUDE`.
    factor : DesignFactor
        What a stiffness factor means.
    follow : bool
        Whether stiffnesses follow the amplitude; if not, the motion is coupled only.

    Returns
    -------
    AmplitudeIndex

    Raises
    ------
    InputError
        See `deboom.vehicles.coupled_motion.coupled_motion`,
        `deboom.vehicles.amplitude_motion.amplitude_motion` and `AmplitudeIndex`.
    """
    surfaces = identified_surfaces(parts)
    cases = []
    for case, _ in load_cases:
        coupled = coupled_motion(fleet, mounts, powertrain, case, band)
        cases.append(amplitude_motion(coupled, surfaces, case, factor, follow))
    weights = tuple(weight for _, weight in load_cases)
    return AmplitudeIndex(tuple(cases), weights, kernel, factor)


@dataclass(frozen=True, eq=False)
class LossFactorIndex:
    """SPLV of every vehicle, as a function of stiffness and loss factors.

    Parameters
    ----------
    split : LoadCaseIndex
        Of the same paths twice: factors of the elastic parts, then of the lossy parts.

    Notes
    -----
    A variable ``EnM x`` multiplies K' and K'', ``EnM x loss`` multiplies K'' alone: the loss factor
    K''/K' is multiplied by it and K' stays; |K| changes by the square root of ``1 + (yη)²`` over
    that of ``1 + η²``, 0.7 % for η = 0.2 and y = 1.2.
    """

    split: LoadCaseIndex[Any, Any]

    @property
    def _n(self) -> int:
        return len(self.split.variable_names) // 2

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Stiffness factors, then loss factors ``<mount> <axis> loss``."""
        return self.split.variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.split.response_names

    @property
    def response_unit(self) -> str:
        """Unit of all responses."""
        return self.split.response_unit

    @property
    def load_case_names(self) -> tuple[str, ...]:
        """Name of each load case that counts."""
        return self.split.load_case_names

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_lines,) [Hz]."""
        return self.split.frequency

    @property
    def contributions(self) -> tuple[Any, ...]:
        """Each load case that counts."""
        return self.split.contributions

    @property
    def weights(self) -> tuple[float, ...]:
        """Of the load cases [1]."""
        return self.split.weights

    @property
    def kernel(self) -> Any:
        """What sums the levels."""
        return self.split.kernel

    @property
    def n_lines(self) -> int:
        """Number of lines in each sum."""
        return self.split.n_lines

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return SPLV of designs (n, 2 n_variable), shape (n, n_vehicle) [dB(A)]."""
        return self.split(self._split_factors(designs))

    def levels(self, designs: npt.ArrayLike, load_case: str | None = None) -> RealArray:
        """Return the level of every line, shape (n, n_vehicle, n_lines) [dB(A)]."""
        return self.split.levels(self._split_factors(designs), load_case)

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives of SPLV, shape (n, n_vehicle, 2 n_variable) [dB(A) per unit].

        Notes
        -----
        With ``z = x y``: ``∂/∂x = ∂/∂x|_z + y ∂/∂z``, ``∂/∂y = x ∂/∂z``.
        """
        factors = checked_designs(designs, self.variable_names)[:, np.newaxis, :]
        stiffness, loss = factors[..., : self._n], factors[..., self._n :]
        by_part = self.split.gradient(self._split_factors(designs))
        elastic, lossy = by_part[..., : self._n], by_part[..., self._n :]
        return np.concatenate([elastic + loss * lossy, stiffness * lossy], axis=-1)

    def _split_factors(self, designs: npt.ArrayLike) -> RealArray:
        factors = checked_designs(designs, self.variable_names)
        stiffness, loss = factors[:, : self._n], factors[:, self._n :]
        return np.hstack([stiffness, stiffness * loss])


def booming_loss_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
    kernel: LevelSumKernel,
) -> LossFactorIndex:
    """Return the index with loss factors, motion prescribed; arguments as of `booming_index`.

    Raises
    ------
    InputError
        See `deboom.vehicles.booming_model.booming_index`; also a line without displacement.
    """
    cases = tuple(_split_contributions(fleet, mounts, case, band) for case, _ in load_cases)
    return LossFactorIndex(BoomingIndex(cases, tuple(weight for _, weight in load_cases), kernel))


def coupled_loss_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    powertrain: Powertrain,
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
) -> LossFactorIndex:
    """Return the index with loss factors, motion coupled, in numpy.

    Other arguments as of `deboom.vehicles.booming_model.coupled_index`.

    Raises
    ------
    InputError
        See `deboom.vehicles.booming_model.coupled_index`.
    """
    cases = tuple(
        split_motion(coupled_motion(fleet, mounts, powertrain, case, band))
        for case, _ in load_cases
    )
    weights = tuple(weight for _, weight in load_cases)
    return LossFactorIndex(CoupledIndex(cases, weights, NUMPY_SPLIT))


def split_forces(load_case: LoadCase) -> tuple[LoadCase, LoadCase]:
    """Return a run with the elastic forces ``K' s`` alone, and one with the lossy ``j K'' s``.

    Raises
    ------
    InputError
        A line without displacement.
    """
    displacement, force = load_case.displacement.values, load_case.force
    stiffness = dynamic_stiffness(force.values, displacement)
    elastic, lossy = stiffness.real * displacement, 1j * stiffness.imag * displacement
    return (
        replace(load_case, force=replace(force, values=elastic)),
        replace(load_case, force=replace(force, values=lossy)),
    )


def _split_contributions(
    fleet: Fleet, mounts: Sequence[Mount], load_case: LoadCase, band: Band
) -> PathContributions:
    elastic, lossy = (
        path_contributions(fleet, mounts, part, band) for part in split_forces(load_case)
    )
    return replace(
        elastic,
        values=np.concatenate([elastic.values, lossy.values], axis=2),
        variable_names=with_loss(elastic.variable_names),
    )


SUFFIX = " part"
"""What the name of a choice's variable adds to that of its mount."""

Options = npt.NDArray[np.intp]
"""Number of the part of each stiffness factor, shape (n_variable,)."""

Composed = Callable[[Sequence[Any], Options], Any]
"""From one load case of every level, and the part of every factor, to that of a mixed set."""


@dataclass(frozen=True, eq=False)
class CatalogueIndex:
    """SPLV of every vehicle, as a function of the parts chosen and of their stiffness factors.

    Designs are one part number per mount, from 0, then one stiffness factor per mount and axis.

    Parameters
    ----------
    mounts : tuple of Mount
        In the order of the factors.
    levels : tuple of LoadCaseIndex
        Index number o has part number o at every mount; a mount with fewer parts repeats any.
        Number 0 has today's parts.
    n_parts : tuple of int
        How many parts there are for each mount.
    composed : Composed
        `composed_contributions` or `composed_motion`.

    Raises
    ------
    InputError
        Not one number of parts per mount, or more parts than levels.
    """

    mounts: tuple[Mount, ...]
    levels: tuple[LoadCaseIndex[Any, Any], ...]
    n_parts: tuple[int, ...]
    composed: Composed

    def __post_init__(self) -> None:
        fits = len(self.n_parts) == len(self.mounts) and min(self.n_parts, default=0) >= 1
        if not fits or max(self.n_parts) > len(self.levels):
            raise InputError(
                f"{list(self.n_parts)} parts for the mounts {[one.name for one in self.mounts]} "
                f"and {len(self.levels)} indices: give each mount at least one part, and one index "
                "per part number"
            )

    @property
    def variable_names(self) -> tuple[str, ...]:
        """``<mount> part`` of every mount, then the stiffness factors."""
        choices = tuple(f"{mount.name}{SUFFIX}" for mount in self.mounts)
        return (*choices, *self.levels[0].variable_names)

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.levels[0].response_names

    @property
    def response_unit(self) -> str:
        """Unit of all responses."""
        return self.levels[0].response_unit

    @property
    def n_lines(self) -> int:
        """Number of lines in each sum."""
        return self.levels[0].n_lines

    def of_parts(self, parts: Sequence[int]) -> LoadCaseIndex[Any, Any]:
        """Return the index of one set of parts, as a function of the stiffness factors.

        Raises
        ------
        InputError
            Not one number per mount, or a number that is no part's.
        """
        numbers = list(parts)
        there = len(numbers) == len(self.n_parts) and all(
            0 <= number < count for number, count in zip(numbers, self.n_parts, strict=True)
        )
        if not there:
            raise InputError(
                f"there is no set of parts {numbers}: give one number per mount, each below "
                f"{list(self.n_parts)}"
            )
        option = np.repeat(
            np.array(numbers, dtype=np.intp), [len(m.variables) for m in self.mounts]
        )
        cases = zip(*(level.contributions for level in self.levels), strict=True)
        return replace(
            self.levels[0], contributions=tuple(self.composed(case, option) for case in cases)
        )

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return SPLV of each design in each vehicle.

        Parameters
        ----------
        designs : array_like, shape (n, n_mount + n_variable)
            Part numbers and stiffness factors [1].

        Returns
        -------
        array, shape (n, n_vehicle)
            [dB(A)].

        Raises
        ------
        InputError
            Designs of another shape or not finite; a part number with a fraction, or of no part.
        """
        rows = checked_designs(designs, self.variable_names)
        parts, factors = rows[:, : len(self.mounts)], rows[:, len(self.mounts) :]
        if np.any(parts != np.floor(parts)):
            raise InputError("part numbers are whole: round them, or search whole-number variables")
        found = np.empty((len(rows), len(self.response_names)))
        chosen, where = np.unique(parts, axis=0, return_inverse=True)
        for number, numbers in enumerate(chosen.astype(int).tolist()):
            rows_of = np.flatnonzero(where.ravel() == number)
            found[rows_of] = self.of_parts(numbers)(factors[rows_of])
        return found


def composed_contributions(
    levels: Sequence[PathContributions], option: Options
) -> PathContributions:
    """Return the contributions of a mixed set: each factor's column from its own part's level."""
    values = np.stack([level.values for level in levels])
    columns = np.arange(option.size)
    return replace(levels[0], values=np.moveaxis(values[option, :, :, columns], 0, -1))


def composed_motion(levels: Sequence[CoupledMotion], option: Options) -> CoupledMotion:
    """Return the motion of a mixed set: stiffnesses of its parts, external loads of level 0.

    Notes
    -----
    The loads come from the motion and forces that were measured with today's parts; the stiffness
    of another part is that of its surface at today's amplitude.
    """
    first = levels[0]

    def stiffness(name: str, variables: Options) -> npt.NDArray[np.complex128]:
        stacked = np.stack([getattr(level, name) for level in levels])
        return np.asarray(stacked[option[variables], :, np.arange(variables.size)].T)

    return replace(
        first,
        stiffness=stiffness("stiffness", first.variables),
        own_stiffness=stiffness("own_stiffness", first.own_variables),
    )
