"""What excites the powertrain: engine torque over a full-load ramp and its dominant order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray


@dataclass(frozen=True)
class OrderTorque:
    """Torque reaction of the engine block at one engine order.

    Parameters
    ----------
    order : float
        Engine order [1].
    at_no_load : float
        Amplitude at zero engine torque [N m].
    per_torque : float
        Growth of the amplitude per engine torque [1].
    phase, low_speed_phase : float
        Phase against the tacho at high speed, and what is added to it at `low_speed` [rad].
    low_speed, speed_scale : float
        Where and over which speed the phase settles [rpm].
    inertia : float
        Reciprocating inertia torque per squared angular speed [kg m²]: ``2 m r²`` at order 2 of
        four cylinders with the reciprocating mass m per cylinder and the crank radius r.

    Notes
    -----
    With the gas torque ``a + b T`` and, a quarter turn ahead of the tacho, the inertia J::

        M = (a + b T) e^{jφ(n)} + j J ω²

    A fit to a zero-dimensional cycle with Wiebe heat release of a 1.5 l three-cylinder engine
    with turbocharger. Order 1.5 of a three-cylinder engine is gas torque alone: its reciprocating
    inertia gives only the orders 3, 6, … Overrun (negative torque) counts as no load.
    """

    order: float
    at_no_load: float
    per_torque: float
    phase: float
    low_speed_phase: float
    low_speed: float
    speed_scale: float
    inertia: float = 0.0

    def torque(self, engine_torque: RealArray, rpm: RealArray) -> ComplexArray:
        """Return the complex peak amplitude [N m] at engine torque [N m] and speed [rpm]."""
        amplitude = self.at_no_load + self.per_torque * np.maximum(engine_torque, 0.0)
        settling = np.exp(-(rpm - self.low_speed) / self.speed_scale)
        phase = self.phase + self.low_speed_phase * settling
        reciprocating = 1j * self.inertia * (2 * np.pi * rpm / 60) ** 2
        return np.asarray(amplitude * np.exp(1j * phase) + reciprocating, dtype=complex)


@dataclass(frozen=True)
class FullLoadRamp:
    """Engine torque over a run-up with wide open throttle.

    Parameters
    ----------
    start, scale : float
        Speed at which the torque begins to build up, and over which it does [rpm].
    natural_torque, exponent : float
        Torque the charge would reach [N m] and exponent of its build-up [1].
    """

    start: float
    scale: float
    natural_torque: float
    exponent: float

    def torque(self, limit: float, rpm: RealArray) -> RealArray:
        """Return the engine torque [N m] at `rpm`, limited to `limit` [N m].

        Notes
        -----
        ``T = T_lim tanh(T_n s^e / T_lim) / tanh(T_n / T_lim)``,
        ``s = 1 - exp(-(n - n_0)/n_s)``, zero below the start.
        """
        built_up = 1 - np.exp(-np.maximum(rpm - self.start, 0.0) / self.scale)
        natural = self.natural_torque * built_up**self.exponent
        reached: RealArray = np.tanh(natural / limit) / np.tanh(self.natural_torque / limit)
        return limit * reached


THREE_CYLINDER_TORQUE = OrderTorque(
    order=1.5,
    at_no_load=38.0,
    per_torque=1.92,
    phase=np.deg2rad(-80.0),
    low_speed_phase=np.deg2rad(-5.0),
    low_speed=800.0,
    speed_scale=700.0,
)

FULL_LOAD_RAMP = FullLoadRamp(start=790.0, scale=260.0, natural_torque=235.0, exponent=1.15)
