"""The bench's true mount law: multi-stage static curve, amplitude-dependent dynamic stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from deboom.arrays import ComplexArray, RealArray

CROSS_WIDTH = 1.0e-3
"""Deflection over which the transverse directions stiffen [m]; an engineering judgement."""

CROSS_SLOPE = 0.15
"""Part of the transverse stiffening that grows linearly with the deflection [1]."""


@dataclass(frozen=True)
class Stage:
    """A stop that comes in softly.

    Parameters
    ----------
    onset : float
        Deflection at which half of the stage's stiffness acts [m]; its sign is the side.
    width : float
        Deflection over which the stage comes in [m].
    stiffness : float
        Stiffness added beyond the onset [N/m].
    """

    onset: float
    width: float
    stiffness: float


@dataclass(frozen=True)
class FluidBranch:
    """The fluid track of a hydromount.

    Parameters
    ----------
    stiffness_ratio : float
        Dynamic stiffness added above the track's resonance, per elastic stiffness [1].
    frequency : float
        Resonance of the fluid column [Hz].
    damping_ratio : float
        Of the fluid column [1].
    """

    stiffness_ratio: float
    frequency: float
    damping_ratio: float

    def factor(self, frequency: RealArray) -> ComplexArray:
        """Return the branch's stiffness per elastic stiffness at `frequency` [Hz]."""
        r = 1j * frequency / self.frequency
        return np.asarray(
            self.stiffness_ratio * r**2 / (r**2 + 2 * self.damping_ratio * r + 1), dtype=complex
        )


@dataclass(frozen=True)
class DirectionLaw:
    """True law of one mount along one axis.

    Parameters
    ----------
    stiffness : float
        Static tangent stiffness far from every stage [N/m].
    stages : tuple of Stage
        Stops on both sides.
    dynamic_ratio : float
        Scales the dynamic stiffness and leaves the static curve alone [1].
    payne_storage, payne_loss : float
        Storage drop and twice the loss maximum of the filler's network, per elastic
        stiffness [1].
    payne_amplitude, payne_exponent : float
        Amplitude at the loss maximum [m] and exponent [1].
    fractional_weight, fractional_order, fractional_frequency : float
        Weight [1], order [1] and reference frequency [Hz] of the fractional Kelvin-Voigt branch.
    cross_stiffening : float
        Relative stiffening by the deflection along the mount's main axis [1].
    fluid : FluidBranch or None
        Only a hydromount has one.

    Notes
    -----
    With the elastic part ``k_t(u)``, amplitude X and frequency f (Kraus's model of the Payne
    effect and a fractional Kelvin-Voigt branch)::

        K(u, X, f) = λ k_t(u) [1 + P/(1 + z²) + 2jL z/(1 + z²) + b (jf/f0)^α + h(f)],
        z = (X/X_c)^m

    Made for 5 µm to 2 mm and 15 to 140 Hz.
    """

    stiffness: float
    stages: tuple[Stage, ...]
    dynamic_ratio: float
    payne_storage: float
    payne_amplitude: float
    payne_exponent: float
    payne_loss: float
    fractional_weight: float
    fractional_order: float
    fractional_frequency: float
    cross_stiffening: float
    fluid: FluidBranch | None

    def static_force(self, deflection: RealArray) -> RealArray:
        """Return the static force [N] at the static `deflection` [m]; zero at zero.

        Notes
        -----
        ``F(u) = k0 u + Σ s dk w [sp((s u - |u_i|)/w) - sp(-|u_i|/w)]``, with sp the softplus and
        s the side of the stage: the integral of :meth:`tangent_stiffness`.
        """
        force = self.stiffness * deflection
        for stage in self.stages:
            side, width = np.sign(stage.onset), stage.width
            beyond = np.logaddexp(0.0, (side * deflection - abs(stage.onset)) / width)
            at_rest = np.logaddexp(0.0, -abs(stage.onset) / width)
            force = force + side * stage.stiffness * width * (beyond - at_rest)
        return force

    def tangent_stiffness(self, deflection: RealArray) -> RealArray:
        """Return the slope of the static curve [N/m] at `deflection` [m]; always positive."""
        tangent = np.full(np.shape(deflection), self.stiffness)
        for stage in self.stages:
            side = np.sign(stage.onset)
            reach = (side * deflection - abs(stage.onset)) / stage.width
            tangent = tangent + stage.stiffness * expit(reach)
        return tangent

    def dynamic_factor(self, amplitude: RealArray, frequency: RealArray) -> ComplexArray:
        """Return the dynamic stiffness per tangent stiffness [1].

        Parameters
        ----------
        amplitude : array
            Peak displacement amplitude [m].
        frequency : array
            Broadcasts with `amplitude` [Hz].
        """
        z = (amplitude / self.payne_amplitude) ** self.payne_exponent
        payne = (self.payne_storage + 2j * self.payne_loss * z) / (1 + z**2)
        fractional = (
            self.fractional_weight
            * (1j * frequency / self.fractional_frequency) ** self.fractional_order
        )
        factor = 1 + payne + fractional
        if self.fluid is not None:
            factor = factor + self.fluid.factor(frequency)
        return np.asarray(self.dynamic_ratio * factor, dtype=complex)

    def cross_factor(self, main_deflection: RealArray, cross_deflection: float) -> RealArray:
        """Return the stiffening by the static deflection along the main axis [1].

        Parameters
        ----------
        main_deflection : array
            Static deflection of the mount along its main axis [m].
        cross_deflection : float
            Main deflection at which half of the stiffening acts [m].

        Notes
        -----
        ``1 + c [sigmoid((|u| - U)/1 mm) + 0.15 |u|/U]``.
        """
        reach = np.abs(main_deflection)
        grown = expit((reach - cross_deflection) / CROSS_WIDTH)
        return np.asarray(
            1 + self.cross_stiffening * (grown + CROSS_SLOPE * reach / cross_deflection)
        )
