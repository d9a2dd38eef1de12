"""The virtual compressor in operation: its sweeps, as they truly are and as they are measured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_hits import hit_plan
from deboom.bench.compressor_laboratory import Laboratory, laboratory
from deboom.bench.compressor_operation_plan import PRESSURES, OperationPlan
from deboom.bench.compressor_plan import COMPRESSOR_DATA, CalibrationLevel
from deboom.bench.compressor_running import Running, in_operation, running
from deboom.bench.compressor_sources import Source, true_source
from deboom.bench.frozen import freeze_arrays
from deboom.bench.hoses import Hose
from deboom.bench.parameters import read_data

LINE_STEP = 1.0
"""Of the sweeps [Hz]."""
SCATTER = 3e-3
"""Deviation of a complex amplitude from run to run, over the amplitude [1]; of the study."""


@dataclass(frozen=True, eq=False)
class Operation:
    """A compressor that runs in its laboratory.

    Parameters
    ----------
    laboratory : Laboratory
        With the standard hoses, mounts in the state of operation.
    source : Source
        What shakes it.
    """

    laboratory: Laboratory
    source: Source


@dataclass(frozen=True, eq=False)
class TrueSweep:
    """One sweep as it truly is.

    Parameters
    ----------
    pressure : float
        [bar].
    hoses : tuple of Hose
        That the compressor feels; long soft hoses are none.
    frequency : array, shape (f,)
        Of the rotation [Hz].
    running : Running
        Steady states.
    acceleration : array, shape (f, n_channel)
        Of the channels without noise [m/s²].
    """

    pressure: float
    hoses: tuple[Hose, ...]
    frequency: RealArray
    running: Running
    acceleration: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def state(self) -> str:
        """Of the hoses, as the files call it."""
        return "standard" if self.hoses else "soft"

    @property
    def name(self) -> str:
        """Such as ``standard 7.5 bar``."""
        return f"{self.state} {self.pressure:g} bar"


def operation(
    seed: int, level: CalibrationLevel, plan: OperationPlan, *, noise_free: bool = False
) -> Operation:
    """Set up the running compressor of a seed; parameters as for `laboratory`."""
    there = laboratory(seed, level, plan.running_with_hoses, noise_free=noise_free)
    changed = in_operation(there.compressor, plan.mount_storage, plan.mount_loss)
    return Operation(Laboratory(changed, there.sheet, there.placed), true_source(plan.sense))


def speeds() -> RealArray:
    """Return the lines of the frozen sweeps, 1000 to 9000 1/min [Hz]."""
    low, high = read_data(COMPRESSOR_DATA)["operation"]["frequency_Hz"]
    return np.arange(low, high + LINE_STEP / 2, LINE_STEP)


def gas_factor(pressure: float) -> float:
    """Return the factor of one of `PRESSURES` on force and moment of the gas [1]."""
    second: float = read_data(COMPRESSOR_DATA)["operation"]["second_pressure_gas_factor"]
    return (1.0, second)[PRESSURES.index(pressure)]


def true_sweep(there: Operation, pressure: float, *, soft: bool, frequency: RealArray) -> TrueSweep:
    """Run the compressor at one pressure.

    Parameters
    ----------
    there : Operation
        What runs.
    pressure : float
        One of `PRESSURES` [bar].
    soft : bool
        Long soft hoses with masses on them, which are mechanically absent, instead of the standard
        ones.
    frequency : array, shape (f,)
        Of the rotation [Hz].
    """
    compressor = there.laboratory.compressor
    if soft:
        compressor = replace(compressor, hoses=())
    run = running(compressor, there.source, frequency, gas_factor(pressure))
    squared = (2 * np.pi * frequency[:, np.newaxis]) ** 2
    rows = there.laboratory.placed.response_rows(there.laboratory.sheet)
    seen = -squared * run.displacement @ rows.T
    return TrueSweep(pressure, compressor.hoses, frequency, run, seen)


def floor(frequency: RealArray) -> RealArray:
    """Return the deviation of a complex amplitude without signal, shape (f,) [m/s²]."""
    recorder = hit_plan()
    return np.asarray(recorder.response_noise * np.sqrt(1 + (recorder.corner / frequency) ** 2))


def measured(sweep: TrueSweep, generator: np.random.Generator) -> ComplexArray:
    """Return the order spectra of a sweep with scatter and noise, shape (f, n_channel) [m/s²]."""
    shape = sweep.acceleration.shape

    def normal() -> ComplexArray:
        real, imaginary = generator.standard_normal((2, *shape))
        return np.asarray((real + 1j * imaginary) / np.sqrt(2))

    scattered = sweep.acceleration * (1 + SCATTER * normal())
    return np.asarray(scattered + floor(sweep.frequency)[:, np.newaxis] * normal())
