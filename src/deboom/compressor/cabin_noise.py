"""Cabin noise of a running compressor: loads of mounts and hoses times transfer functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.body_loads import (
    BodyLoads,
    body_receptance,
    loads_by_measured_holders,
    loads_by_predicted_holders,
    loads_on_still_body,
)
from deboom.compressor.rigid_foundation import displacement_at_virtual_point, holder_displacement
from deboom.errors import InputError
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.measurement.operating_sweep import HoseState
from deboom.measurement.wrench_noise_transfer import wrench_noise_transfer
from deboom.physics.sound_level import spl
from deboom.physics.transfer_path import contributions

if TYPE_CHECKING:
    from deboom.compressor.running_in_car import RunningInCar
    from deboom.measurement.operating_sweep import HoseDrawing, OperatingSweep
    from deboom.measurement.wrench_noise_transfer import WrenchNoiseTransfer

BAND = (20.0, 140.0)
"""Of the thesis's figures 65 and 66 [Hz]."""


@dataclass(frozen=True, eq=False)
class SweepNoise:
    """Sound at the ear over the speed of one sweep, path by path.

    Parameters
    ----------
    sweep : str
        Its name.
    hoses : HoseState
        Of the sweep.
    pressure : float
        Of the gas [Pa].
    frequency : array, shape (n_frequency,)
        Of the rotation [Hz].
    paths : tuple of str
        ``<point> x y z`` and, of hoses, ``mx my mz`` as well.
    loads : array, shape (n_frequency, n_path)
        On the body, complex peak [N, N m].
    contributions : array, shape (n_frequency, n_path)
        Of each path to the sound, complex peak [Pa].
    n_mount_paths : int
        So many of the paths are those of the mounts; they come first.
    measured : array, shape (n_frequency,)
        At the ear, complex peak [Pa].
    still_body, predicted_body : array, shape (n_frequency,)
        Sound if the motion of the body is left out, and if it is predicted by its accelerances
        instead of measured at the mounts [Pa].
    """

    sweep: str
    hoses: HoseState
    pressure: float
    frequency: RealArray
    paths: tuple[str, ...]
    loads: ComplexArray
    contributions: ComplexArray
    n_mount_paths: int
    measured: ComplexArray
    still_body: ComplexArray
    predicted_body: ComplexArray

    @property
    def total(self) -> ComplexArray:
        """Sound of all paths, shape (n_frequency,) [Pa]."""
        return np.asarray(self.contributions.sum(axis=1))

    @property
    def by_mounts(self) -> ComplexArray:
        """Sound of the mounts' paths alone, shape (n_frequency,) [Pa]."""
        return np.asarray(self.contributions[:, : self.n_mount_paths].sum(axis=1))

    @property
    def complete(self) -> bool:
        """Whether no path was left out: standard hoses are modelled, others cut."""
        modelled = self.contributions.shape[1] > self.n_mount_paths
        return modelled or self.hoses is not HoseState.STANDARD

    @property
    def points(self) -> tuple[str, ...]:
        """Mounts, then hoses."""
        return tuple(dict.fromkeys(path.rpartition(" ")[0] for path in self.paths))

    @property
    def by_point(self) -> ComplexArray:
        """Sound by each of `points`, shape (n_frequency, n_point) [Pa]."""
        owners = [path.rpartition(" ")[0] for path in self.paths]
        belongs = np.array([[owner == point for point in self.points] for owner in owners])
        return np.asarray(self.contributions @ belongs)

    def level(self, pressure: npt.ArrayLike) -> RealArray:
        """A-weighted level of any of the pressures, shape (n_frequency, ...) [dB(A)]."""
        return spl(pressure, self.frequency)


def cabin_noise(
    there: RunningInCar,
    transfer: WrenchNoiseTransfer | None = None,
    band: tuple[float, float] = BAND,
) -> tuple[SweepNoise, ...]:
    """Synthesise the sound at the ear for every sweep of a car.

    Parameters
    ----------
    there : RunningInCar
        Compressor, mounts and hoses.
    transfer : WrenchNoiseTransfer, optional
        Of the car; computed if left out.
    band : (float, float)
        Lines that are kept [Hz].

    Returns
    -------
    tuple of SweepNoise
        In the order of the sweeps; hoses contribute where the sweep had standard ones.

    Raises
    ------
    InputError
        A sweep without lines in the band, or with lines at which no transfer function was measured.

    Notes
    -----
    ``p = Σ H_i F_i`` with ``F_i = v(f) (1 + δ) K_i (T_i x − y_i)`` of the mounts and the loads of
    the hoses as beams; thesis, 4.5, in which y and the hoses are missing.
    """
    transfer = transfer or wrench_noise_transfer(there.car)
    return tuple(_sweep(there, transfer, sweep, band) for sweep in there.car.operation.sweeps)


def modelled_hoses(there: RunningInCar, sweep: OperatingSweep) -> tuple[HoseDrawing, ...]:
    """Return hoses whose paths are part of the sound of a sweep."""
    if there.hoses is None or sweep.hoses is not HoseState.STANDARD:
        return ()
    return there.hoses.hoses


def path_names(there: RunningInCar, hoses: tuple[HoseDrawing, ...]) -> tuple[str, ...]:
    """Name the paths of all mounts and of these hoses, as noise transfer functions do."""
    return (
        *(f"{mount.name} {load}" for mount in there.shares.drawn for load in POINT_LOADS[:3]),
        *(f"{hose.name} {load}" for hose in hoses for load in POINT_LOADS),
    )


def lines_in_band(sweep: OperatingSweep, band: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Mark the lines of a sweep that lie in a band, shape (n_frequency,).

    Raises
    ------
    InputError
        There is none.
    """
    inside = (sweep.frequency >= band[0]) & (sweep.frequency <= band[1])
    if not inside.any():
        raise InputError(
            f"sweep {sweep.name} goes from {sweep.frequency[0]:g} to {sweep.frequency[-1]:g} Hz "
            f"and has no line between {band[0]:g} and {band[1]:g} Hz: choose another band"
        )
    return np.asarray(inside)


def _sweep(
    there: RunningInCar,
    transfer: WrenchNoiseTransfer,
    sweep: OperatingSweep,
    band: tuple[float, float],
) -> SweepNoise:
    inside = lines_in_band(sweep, band)
    lines = sweep.frequency[inside]
    hoses = modelled_hoses(there, sweep)
    mounts = there.shares.mounts
    factor = there.found.calibrated.model.gain.at(lines) * (1 + there.change(lines))
    displacement = displacement_at_virtual_point(sweep, there.found)[inside]
    receptance = body_receptance(
        there.accelerance,
        lines,
        [mount.name for mount in mounts],
        [hose.name for hose in hoses],
    )
    holder = holder_displacement(sweep, mounts)[inside]
    paths = path_names(there, hoses)
    functions = transfer.at(lines).transfer.select(inputs=paths).values[:, 0]

    def heard(loads: BodyLoads) -> ComplexArray:
        return np.asarray(contributions(functions, np.hstack([loads.mounts, loads.hoses])))

    pushed = loads_by_measured_holders(
        mounts, factor, displacement, holder, hoses, lines, receptance
    )
    still = loads_on_still_body(mounts, factor, displacement, hoses, lines)
    predicted = loads_by_predicted_holders(mounts, factor, displacement, receptance, hoses, lines)
    assert sweep.sound is not None  # the door of a car has asked for it
    return SweepNoise(
        sweep=sweep.name,
        hoses=sweep.hoses,
        pressure=sweep.pressure,
        frequency=lines,
        paths=paths,
        loads=np.hstack([pushed.mounts, pushed.hoses]),
        contributions=heard(pushed),
        n_mount_paths=pushed.mounts.shape[1],
        measured=sweep.sound.select([there.car.ear]).values[inside, 0],
        still_body=heard(still).sum(axis=1),
        predicted_body=heard(predicted).sum(axis=1),
    )
