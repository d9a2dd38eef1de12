"""How far synthesised cabin noise may be off: draws of everything that is known with an error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.body_loads import body_receptance, loads_by_measured_holders
from deboom.compressor.cabin_noise import BAND, lines_in_band, modelled_hoses, path_names
from deboom.compressor.mount_shares import STIFFNESS_NUMBERS
from deboom.compressor.rigid_foundation import holder_displacement
from deboom.errors import InputError
from deboom.physics.sound_level import spl

if TYPE_CHECKING:
    from collections.abc import Sequence

    from deboom.compressor.gain import GainFactor
    from deboom.compressor.running_in_car import RunningInCar
    from deboom.measurement.inertance_test import CompressorMount
    from deboom.measurement.operating_sweep import HoseDrawing, OperatingSweep
    from deboom.measurement.wrench_noise_transfer import WrenchNoiseTransfer

CONFIDENCE = 0.9


@dataclass(frozen=True, eq=False)
class NoiseBand:
    """Levels between which the sound of a sweep lies, with and without the paths of hoses.

    Parameters
    ----------
    sweep : str
        Its name.
    lower, upper : array, shape (n_frequency,)
        Of all paths [dB(A)].
    lower_mounts, upper_mounts : array, shape (n_frequency,)
        Of the mounts' paths alone [dB(A)].
    confidence : float
        Of each line [1].
    """

    sweep: str
    lower: RealArray
    upper: RealArray
    lower_mounts: RealArray
    upper_mounts: RealArray
    confidence: float


@dataclass(frozen=True, eq=False)
class _Draw:
    """One compressor that the measurements allow."""

    gain: GainFactor
    mounts: tuple[CompressorMount, ...]
    inverse: RealArray
    hoses: tuple[HoseDrawing, ...]
    state: complex


def noise_bands(
    there: RunningInCar,
    transfer: WrenchNoiseTransfer,
    band: tuple[float, float] = BAND,
    *,
    draws: int = 64,
    seed: int = 1,
    confidence: float = CONFIDENCE,
) -> tuple[NoiseBand, ...]:
    """Draw the sound of every sweep many times.

    Parameters
    ----------
    there : RunningInCar
    transfer : WrenchNoiseTransfer
        Of the same car.
    band : (float, float)
        Lines that are kept [Hz].
    draws : int
        At least 20.
    seed : int
        From 1.
    confidence : float
        Of the band at each line [1].

    Returns
    -------
    tuple of NoiseBand
        In the order of the sweeps.

    Raises
    ------
    InputError
        Seed below 1, too few draws, a confidence outside 0 to 1; see `cabin_noise`.

    Notes
    -----
    Every draw has its own compressor from the joint posterior of model and placement, its own
    single mounts, hoses, state of the mounts in operation and noise transfer functions. Left out:
    noise of the sweeps, which is a hundredth of these, and gains and places of the holders'
    accelerometers, since the body moves little against the compressor.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    if draws < 20:
        raise InputError(f"{draws} draws make no band: ask for at least 20")
    if not 0 < confidence < 1:
        raise InputError(f"a confidence lies between 0 and 1, not at {confidence:g}")
    tails = (50 * (1 - confidence), 50 * (1 + confidence))
    drawn = _draws(there, draws, seed)
    bands = []
    for number, sweep in enumerate(there.car.operation.sweeps):
        generator = np.random.default_rng([seed, 2, number])
        both = _levels(there, transfer, sweep, band, drawn, generator)
        limits = np.percentile(both, tails, axis=0)
        bands.append(
            NoiseBand(
                sweep.name, limits[0, 0], limits[1, 0], limits[0, 1], limits[1, 1], confidence
            )
        )
    return tuple(bands)


def _draws(there: RunningInCar, count: int, seed: int) -> list[_Draw]:
    """Compressors, mounts, hoses and states of the mounts that agree with the measurements."""
    calibrated = there.found.calibrated
    n = calibrated.values.size
    variance, directions = np.linalg.eigh(calibrated.covariance)
    spread = directions * np.sqrt(np.maximum(variance, 0.0))
    hoses = [()] * count if there.hoses is None else there.hoses.samples(count, seed)
    generator = np.random.default_rng([seed, 1])
    result = []
    for own in hoses:
        off = spread @ generator.standard_normal(variance.size)
        forward = calibrated.placement.response_matrix(calibrated.errors + off[n:])
        result.append(
            _Draw(
                gain=calibrated.parametrisation.model(calibrated.values + off[:n]).gain,
                mounts=there.shares.at_random(off[:n][STIFFNESS_NUMBERS], generator),
                inverse=np.asarray(np.linalg.pinv(forward), dtype=float),
                hoses=own,
                state=complex(*generator.standard_normal(2)) / np.sqrt(2),
            )
        )
    return result


def _levels(
    there: RunningInCar,
    transfer: WrenchNoiseTransfer,
    sweep: OperatingSweep,
    band: tuple[float, float],
    drawn: Sequence[_Draw],
    generator: np.random.Generator,
) -> RealArray:
    """Levels of all paths and of the mounts' alone, shape (n_draw, 2, n_frequency) [dB(A)]."""
    inside = lines_in_band(sweep, band)
    lines = sweep.frequency[inside]
    known = modelled_hoses(there, sweep)
    paths = path_names(there, known)
    here = transfer.at(lines)
    columns = [here.transfer.inputs.index(path) for path in paths]
    functions, deviation = here.transfer.values[:, 0, columns], here.deviation[:, columns]
    names = [mount.name for mount in there.shares.drawn]
    receptance = body_receptance(there.accelerance, lines, names, [hose.name for hose in known])
    holder = holder_displacement(sweep, there.shares.mounts)[inside]
    square = (2 * np.pi * lines[:, np.newaxis]) ** 2
    recorded = -sweep.acceleration.values[inside] / square
    change, unsure = there.change(lines), there.change_deviation(lines)
    levels = []
    for one in drawn:
        factor = one.gain.at(lines) * (1 + change + unsure * one.state)
        hoses = one.hoses if known else ()
        loads = loads_by_measured_holders(
            one.mounts, factor, recorded @ one.inverse.T, holder, hoses, lines, receptance
        )
        error = generator.standard_normal((2, *deviation.shape)) / np.sqrt(2)
        heard = (functions + deviation * (error[0] + 1j * error[1])) * np.hstack(
            [loads.mounts, loads.hoses]
        )
        n = loads.mounts.shape[1]
        sounds: ComplexArray = np.stack([heard.sum(axis=1), heard[:, :n].sum(axis=1)], axis=1)
        levels.append(spl(sounds, lines).T)
    return np.array(levels)
