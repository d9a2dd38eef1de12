"""Sensor models and what their makers state: sensitivity, cross-axis sensitivity, noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from deboom.errors import InputError


@dataclass(frozen=True)
class SensorModel:
    """What the maker states of every sensor of one model.

    Parameters
    ----------
    name : str
        Such as ``Kistler 9077C``.
    quantity_unit : str
        SI unit of what it measures: ``m/s^2`` or ``N``.
    signal_unit : str
        SI unit of what it delivers: ``C`` (charge) or ``V``.
    sensitivity : tuple of float
        Nominal, per axis; one for a single-axis sensor [signal_unit/quantity_unit].
    gain_tolerance : float
        Half width about the nominal sensitivity, before the single sensor is calibrated [1].
    cross_axis : tuple of float
        Largest sensitivity of an axis to the other two, per axis [1].
    noise_floor : float
        Threshold [quantity_unit].
    frequency_range : (float, float)
        [Hz]; ``(0, inf)`` where the maker states none.
    source : str
        Where the figures stand.

    Raises
    ------
    InputError
        Sensitivity and cross-axis sensitivity of different axes, or a tolerance below 0.
    """

    name: str
    quantity_unit: str
    signal_unit: str
    sensitivity: tuple[float, ...]
    gain_tolerance: float
    cross_axis: tuple[float, ...]
    noise_floor: float
    frequency_range: tuple[float, float]
    source: str

    def __post_init__(self) -> None:
        if len(self.sensitivity) != len(self.cross_axis):
            raise InputError(
                f"sensor model {self.name}: {len(self.sensitivity)} sensitivities, but "
                f"{len(self.cross_axis)} cross-axis limits: state both for every axis"
            )
        for what, value in (
            ("gain_tolerance", self.gain_tolerance),
            ("noise_floor", self.noise_floor),
            *(("cross_axis", limit) for limit in self.cross_axis),
        ):
            if not (math.isfinite(value) and value >= 0):
                raise InputError(
                    f"sensor model {self.name}: {what} is {value}: use a number from 0"
                )

    @property
    def cross_axis_deviation(self) -> tuple[float, ...]:
        """Standard deviation of the cross-axis sensitivity, any value within ± the limit alike."""
        return tuple(limit / math.sqrt(3) for limit in self.cross_axis)


_G = 9.80665
_PICO = 1e-12

SENSOR_CATALOGUE: Mapping[str, SensorModel] = MappingProxyType(
    {
        model.name: model
        for model in (
            SensorModel(
                name="B&K 4321",
                quantity_unit="m/s^2",
                signal_unit="C",
                sensitivity=(9.81 * _PICO / _G,) * 3,
                gain_tolerance=0.02,
                cross_axis=(0.010, 0.012, 0.004),
                noise_floor=0.005,
                frequency_range=(0.1, 12000.0),
                source="Thesis, table 4; noise floor: bench",
            ),
            SensorModel(
                name="B&K 4326",
                quantity_unit="m/s^2",
                signal_unit="C",
                sensitivity=(3.0 * _PICO / _G,) * 3,
                gain_tolerance=0.15,
                cross_axis=(0.05, 0.05, 0.05),
                noise_floor=0.005,
                frequency_range=(0.1, 12000.0),
                source="Thesis, table 4; noise floor: bench",
            ),
            SensorModel(
                # a piezoelectric cell delivers charge: the table's mV/N belongs to its amplifier
                name="Kistler 9077C",
                quantity_unit="N",
                signal_unit="C",
                sensitivity=(-4.2 * _PICO, -4.2 * _PICO, -2.0 * _PICO),
                gain_tolerance=0.02,
                cross_axis=(0.03, 0.03, 0.03),
                noise_floor=0.01,
                frequency_range=(0.0, math.inf),
                source="Thesis, table 5; gain and cross-talk: usual for three-axis piezo cells",
            ),
            SensorModel(
                name="PCB 356A",
                quantity_unit="m/s^2",
                signal_unit="V",
                sensitivity=(10.2e-3,) * 3,
                gain_tolerance=0.10,
                cross_axis=(0.05, 0.05, 0.05),
                noise_floor=0.002,
                frequency_range=(2.0, 5000.0),
                source="Thesis, section 4.4; gain, cross-axis and floor: usual for the series",
            ),
            SensorModel(
                name="PCB 086D05",
                quantity_unit="N",
                signal_unit="V",
                sensitivity=(0.23e-3,),
                gain_tolerance=0.15,
                cross_axis=(0.0,),
                noise_floor=0.1,
                frequency_range=(0.0, math.inf),
                source="Thesis, section 4.4; gain and floor: usual for the series",
            ),
        )
    }
)
"""Sensors of the thesis, by the name of their model.

Figures that the thesis does not state are marked as usual ones in `SensorModel.source`: replace
them by the calibration sheets of the sensors in use.
"""


def sensor_model(name: str) -> SensorModel:
    """Return a model of the catalogue.

    Raises
    ------
    InputError
        No such model.
    """
    try:
        return SENSOR_CATALOGUE[name]
    except KeyError:
        raise InputError(
            f"sensor model '{name}' is not in the catalogue, use {', '.join(SENSOR_CATALOGUE)}"
        ) from None
