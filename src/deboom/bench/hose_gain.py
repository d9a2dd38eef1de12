"""How much louder a car becomes because its compressor has hoses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_sources import Source
from deboom.bench.compressor_truth import Compressor
from deboom.bench.electric_car import run_car
from deboom.bench.electric_fleet import ElectricFleet
from deboom.bench.frozen import freeze_arrays
from deboom.bench.hoses import Hose
from deboom.physics.sound_level import spl

LINES = np.arange(20.0, 140.5, 1.0)
"""Of cabin noise [Hz]."""

HOSE_BAND = (90.0, 140.0)
"""Where the thesis hears its hoses [Hz]."""


@dataclass(frozen=True, eq=False)
class HoseGain:
    """Pressure at the driver's ear of every car, with and without the path through the hoses.

    Parameters
    ----------
    frequency : array, shape (f,)
        Of the rotation [Hz].
    names : tuple of str
        Of the cars.
    soft, standard : array, shape (n_car, f)
        With long soft hoses and with the car's own ones [Pa].
    """

    frequency: RealArray
    names: tuple[str, ...]
    soft: ComplexArray
    standard: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def line_gain(self) -> RealArray:
        """Level with hoses minus level without, shape (n_car, f) [dB]."""
        return np.asarray(20 * np.log10(np.abs(self.standard) / np.abs(self.soft)))

    def band_gain(self, band: tuple[float, float] = HOSE_BAND) -> RealArray:
        """Return the level of the A-weighted energy in a band with hoses minus that without.

        Returns
        -------
        array, shape (n_car,)
            [dB].
        """
        inside = (self.frequency >= band[0]) & (self.frequency <= band[1])
        lines = self.frequency[inside]
        with_hoses, without = (
            np.sum(10 ** (spl(values[:, inside].T, lines) / 10), axis=0)
            for values in (self.standard, self.soft)
        )
        return np.asarray(10 * np.log10(with_hoses / without))


def hose_gain(
    fleet: ElectricFleet,
    compressor: Compressor,
    source: Source,
    hoses: Sequence[Hose],
    frequency: RealArray = LINES,
    gas_factor: float = 1.0,
) -> HoseGain:
    """Run one compressor in every car of a fleet, with hoses and without.

    Parameters
    ----------
    fleet : ElectricFleet
        Its cars.
    compressor, source, hoses, frequency, gas_factor
        As in `deboom.bench.electric_car.run_car`.
    """
    soft, standard = (
        np.array(
            [
                run_car(car, compressor, source, frequency, used, gas_factor).pressure
                for car in fleet.cars.values()
            ]
        )
        for used in ((), hoses)
    )
    return HoseGain(frequency, tuple(fleet.cars), soft, standard)
