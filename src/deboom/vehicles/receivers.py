"""Places where people sit: ears, and points of seats and wheels that vibrate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.physics.sound_level import REFERENCE_PRESSURE, a_weighting
from deboom.physics.vibration_level import REFERENCES, WEIGHTINGS, human_weighting

SOUND = "pressure"
"""Quantity of ears; that of all other receivers is a key of `REFERENCES`."""
UNITS = {
    SOUND: "Pa",
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "displacement": "m",
}
"""Quantity → unit of its amplitude."""
_LEVEL_REFERENCES = {
    "acceleration": "1 µm/s²",
    "velocity": "1 nm/s",
    "displacement": "1 pm",
}


@dataclass(frozen=True)
class Receiver:
    """What is heard or felt at one place of a vehicle.

    - `name`: such as ``seat rail z``; ``""`` for the ear that has the name of its vehicle.
    - `quantity`: key of `UNITS`.
    - `weighting`: of an acceleration, one of `WEIGHTINGS`, or none.
    - `weight`: of a sound in sums over responses, from 0; a vibration is in no sum [1].
    - `target`: mean level of the lines that counts as good enough; None: none is stated
      [`level_unit`].
    - raises InputError: another quantity; a weighting that is not for accelerations or does not
      exist; a negative weight.
    """

    name: str = ""
    quantity: str = SOUND
    weighting: str = ""
    weight: float = 1.0
    target: float | None = None

    def __post_init__(self) -> None:
        owner = f"receiver '{self.name}'" if self.name else "the ear"
        if self.quantity not in UNITS:
            raise InputError(f"{owner} is of {self.quantity}: take one of {', '.join(UNITS)}")
        if self.weighting and self.weighting not in WEIGHTINGS:
            raise InputError(
                f"{owner} has the weighting '{self.weighting}': take one of {', '.join(WEIGHTINGS)}"
            )
        if self.weighting and self.quantity != "acceleration":
            raise InputError(
                f"{owner} is a {self.quantity}, and {self.weighting} weights accelerations: give "
                "functions in m/s² per N, or leave the weighting out"
            )
        if not 0.0 <= self.weight < np.inf:
            raise InputError(f"{owner} has the weight {self.weight:g}: give one from 0")

    @property
    def is_sound(self) -> bool:
        """Whether it is an ear."""
        return self.quantity == SOUND

    @property
    def transfer_unit(self) -> str:
        """Unit of its transfer functions, such as ``Pa/N``."""
        return f"{UNITS[self.quantity]}/N"

    @property
    def transfer_quantity(self) -> str:
        """What its transfer functions are called."""
        return "noise transfer function" if self.is_sound else f"{self.quantity} per force"

    @property
    def level_unit(self) -> str:
        """Unit of its level, such as ``dB(A)`` or ``dB(Wk) re 1 µm/s²``."""
        if self.is_sound:
            return "dB(A)"
        weighting = f"({self.weighting})" if self.weighting else ""
        return f"dB{weighting} re {_LEVEL_REFERENCES[self.quantity]}"

    def response_name(self, vehicle: str) -> str:
        """Return the name of its response in a vehicle, such as ``U06-1, seat rail z``."""
        return f"{vehicle}, {self.name}" if self.name else vehicle

    def pressure_of_same_level(self, frequency: RealArray) -> RealArray:
        """Return the pressure with the same level as an amplitude of 1, shape (f,) [Pa].

        - `frequency` (f,): lines [Hz].

        With it every sum, peak and derivative of levels is that of sound: A-weighted, the pressure
        has the weighted level of the vibration over its own reference. 1 of a sound.
        """
        if self.is_sound:
            return np.ones(frequency.size)
        weighted = human_weighting(self.weighting, frequency) if self.weighting else 1.0
        back = 10.0 ** (-a_weighting(frequency) / 20.0)
        return np.asarray(weighted * back * (REFERENCE_PRESSURE / REFERENCES[self.quantity]))


def car_of(response: str) -> str:
    """Return the vehicle of a response, see `Receiver.response_name`."""
    return response.partition(", ")[0]


EAR = Receiver()
"""The ear of a vehicle for which nothing else is stated."""
