"""The seam to the exploration when stiffnesses follow the amplitude, or parts resettle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.measurement.load_case import LoadCase
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.vehicles.amplitude_identification import amplitude_motion, identified_surfaces
from deboom.vehicles.amplitude_motion import AmplitudeMotion, pressure, solve_along_lines
from deboom.vehicles.coupled_identification import coupled_motion
from deboom.vehicles.design_factor import DYNAMIC, DesignFactor
from deboom.vehicles.fleet import Band, Fleet
from deboom.vehicles.load_case_index import LevelSum, LoadCaseIndex
from deboom.vehicles.powertrain import Powertrain

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

    The same seam as `deboom.vehicles.coupled_index.CoupledIndex`: a value that can be pickled, and
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
        See `deboom.vehicles.coupled_identification.coupled_motion`,
        `deboom.vehicles.amplitude_identification.amplitude_motion` and `AmplitudeIndex`.
    """
    surfaces = identified_surfaces(parts)
    cases = []
    for case, _ in load_cases:
        coupled = coupled_motion(fleet, mounts, powertrain, case, band)
        cases.append(amplitude_motion(coupled, surfaces, case, factor, follow))
    weights = tuple(weight for _, weight in load_cases)
    return AmplitudeIndex(tuple(cases), weights, kernel, factor)
