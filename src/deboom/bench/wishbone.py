"""The wishbone path: what the drive shafts do to the wheel end and its wishbone mount."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray


@dataclass(frozen=True)
class Driveline:
    """From engine torque to the load on one wheel end along x.

    Parameters
    ----------
    wheel_radius : float
        [m].
    factor : float
        Share of the order torque that the drive shafts pass at low frequency [1].
    frequency, damping_ratio : float
        Isolation mode of flywheel and drive shafts [Hz], [1].
    traction_share : float
        Share of a wheel's traction force that preloads the wishbone mount [1].
    """

    wheel_radius: float
    factor: float
    frequency: float
    damping_ratio: float
    traction_share: float

    def preload(self, wheel_torque: RealArray) -> RealArray:
        """Return the static load on one wishbone mount [N] at the torque of both wheels [N m]."""
        return self.traction_share * wheel_torque / (2 * self.wheel_radius)

    def transmission(self, frequency: RealArray) -> ComplexArray:
        """Return the order torque at the wheels per engine order torque times the ratio [1]."""
        r = frequency / self.frequency
        return np.asarray(self.factor / (1 - r**2 + 2j * self.damping_ratio * r), dtype=complex)

    def load(
        self, order_torque: ComplexArray, total_ratio: float, frequency: RealArray
    ) -> ComplexArray:
        """Return the dynamic load on one wheel end [N] from the engine's order torque [N m]."""
        at_wheels = order_torque * total_ratio * self.transmission(frequency)
        return at_wheels / (2 * self.wheel_radius)
