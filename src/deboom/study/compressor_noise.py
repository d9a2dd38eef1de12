"""From the folder of an electric car to the sound that its compressor makes at the ear."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.compressor.cabin_noise import BAND, SweepNoise, cabin_noise
from deboom.compressor.cabin_noise_band import NoiseBand, noise_bands
from deboom.compressor.identify import Identification, IdentifyOptions, identify
from deboom.compressor.running_in_car import RunningInCar, running_in_car
from deboom.errors import InputError
from deboom.files.electric_car import read_electric_car
from deboom.measurement.wrench_noise_transfer import wrench_noise_transfer

STEPS = 8
"""Of `noise_of_car`, for progress."""


@dataclass(frozen=True)
class NoisePlan:
    """What is asked of a car.

    Parameters
    ----------
    band : (float, float)
        Lines that are looked at [Hz].
    with_hoses : bool
        Whether standard hoses are identified and their paths modelled.
    draws : int
        For the bands.
    seed : int
        Of these draws, from 1.
    identify : IdentifyOptions
        Of the hammer test.

    Raises
    ------
    InputError
        A band without width.
    """

    band: tuple[float, float] = BAND
    with_hoses: bool = True
    draws: int = 64
    seed: int = 1
    identify: IdentifyOptions = field(default_factory=partial(IdentifyOptions, held_out=0))

    def __post_init__(self) -> None:
        if not 0 < self.band[0] < self.band[1]:
            raise InputError(f"{self.band[0]:g} to {self.band[1]:g} Hz is no band of frequencies")


@dataclass(frozen=True, eq=False)
class CarNoise:
    """Sound at the ear of one car: synthesised, measured, and how far it may be off.

    Parameters
    ----------
    car : str
        Its name.
    seed : int or None
        Of the laboratory that measured a virtual car.
    sweeps : tuple of SweepNoise
    bands : tuple of NoiseBand
        Of the same sweeps.
    alarms : tuple of str
        Reasons not to trust it.
    seconds : float
        From files to result, of one processor [s].
    """

    car: str
    seed: int | None
    sweeps: tuple[SweepNoise, ...]
    bands: tuple[NoiseBand, ...]
    alarms: tuple[str, ...]
    seconds: float

    @property
    def label(self) -> str:
        """Car, and its laboratory where there are several."""
        return self.car if self.seed is None else f"{self.car}, laboratory {self.seed}"


@dataclass(frozen=True, eq=False)
class MeasuredNoise:
    """A car in detail.

    Parameters
    ----------
    there : RunningInCar
        Compressor, mounts, hoses.
    noise : CarNoise
    """

    there: RunningInCar
    noise: CarNoise


def noise_of_car(
    folder: Path,
    plan: NoisePlan,
    step: Callable[[str], None],
    *,
    found: Identification | None = None,
    seed: int | None = None,
) -> MeasuredNoise:
    """Read a car, identify what is needed and synthesise its sound.

    Parameters
    ----------
    folder : Path
        With ``car.toml``.
    plan : NoisePlan
    step : callable of str
        Told what is being done.
    found : Identification, optional
        Of its compressor, where that is known from another car.
    seed : int, optional
        Of a virtual laboratory.

    Returns
    -------
    MeasuredNoise

    Raises
    ------
    InputError
        What reader, identification and synthesis refuse.
    """
    start = time.process_time()
    step("reading")
    car = read_electric_car(folder)
    with threadpool_limits(1):
        step("identification of the compressor")
        if found is None:
            found = identify(car.operation.hammer, plan.identify)
        there = running_in_car(car, found, with_hoses=plan.with_hoses, step=step)
        step("synthesis")
        transfer = wrench_noise_transfer(car)
        sweeps = cabin_noise(there, transfer, plan.band)
        step("bands")
        bands = noise_bands(there, transfer, plan.band, draws=plan.draws, seed=plan.seed)
    seconds = time.process_time() - start
    noise = CarNoise(car.name, seed, sweeps, bands, (*found.alarms, *there.alarms), seconds)
    return MeasuredNoise(there, noise)
