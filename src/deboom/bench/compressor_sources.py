"""What shakes a running compressor: up to six unbalances, and the gas that it pumps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_plan import COMPRESSOR_DATA
from deboom.bench.parameters import read_data
from deboom.physics.rigid_body import skew


@dataclass(frozen=True)
class Unbalance:
    """One mass that goes round off the axis x.

    Parameters
    ----------
    name : str
        Such as ``orbiting scroll``.
    mass : float
        [kg]
    radius : float
        From the axis [m].
    arm : float
        Along x, from the virtual point [m].
    phase : float
        Angle ahead of the tacho's mark, in the sense of rotation [rad].
    """

    name: str
    mass: float
    radius: float
    arm: float
    phase: float

    @property
    def rotating(self) -> complex:
        """``m r e^{jφ}`` [kg m]."""
        return complex(self.mass * self.radius * np.exp(1j * self.phase))


PARTS = (
    Unbalance("eccentric shaft", 0.031, 4.2e-3, -0.035, 0.0),
    Unbalance("orbiting scroll", 0.185, 4.2e-3, -0.062, 0.0),
    Unbalance("bushing", 0.022, 4.2e-3, -0.055, 0.12),
    Unbalance("rotor", 0.9, 9e-6, 0.020, 2.1),
)
"""As built; judgement. What they leave is what the two balance weights get wrong."""
WEIGHTS = (("balance weight", 0.017, -0.028), ("counterweight", 0.021, 0.064))
"""Name, radius [m] and arm [m]; mass and phase follow from what shall be left."""


@dataclass(frozen=True)
class Source:
    """All that acts on the compressor from inside at the first order.

    Parameters
    ----------
    unbalances : tuple of Unbalance
    gas_force : complex
        Along x [N].
    gas_moment : complex
        About x [N m].
    rotating_gas_force : complex
        In the plane of y and z; it turns with the rotor [N].
    rotor_inertia : float
        Polar moment of the rotor [kg m²].
    sense : int
        1 from y to z, −1 from z to y.
    """

    unbalances: tuple[Unbalance, ...]
    gas_force: complex
    gas_moment: complex
    rotating_gas_force: complex
    rotor_inertia: float
    sense: int

    @property
    def static_unbalance(self) -> complex:
        """Sum of the unbalances [kg m]."""
        return sum((part.rotating for part in self.unbalances), 0j)

    @property
    def dynamic_unbalance(self) -> complex:
        """Sum of arms times unbalances, about the virtual point [kg m²]."""
        return sum((part.arm * part.rotating for part in self.unbalances), 0j)

    def load(self, frequency: RealArray, gas_factor: float = 1.0) -> ComplexArray:
        """Return the load at the virtual point, source by source.

        Parameters
        ----------
        frequency : array, shape (f,)
            Of the rotation [Hz].
        gas_factor : float
            On force and moment of the gas, which grow with its pressure [1].

        Returns
        -------
        array, shape (f, 6)
            Complex amplitude, phase from the tacho's mark [N, N m].

        Notes
        -----
        ``e^{jωt}`` along y is ``∓j e^{jωt}`` along z. A force F at x = a has the moment
        ``a e_x × F``.
        """
        squared = (2 * np.pi * np.asarray(frequency)) ** 2
        round_x = np.array([0.0, 1.0, -1j * self.sense])
        load = np.zeros((squared.size, 6), dtype=complex)
        load[:, 0] = gas_factor * self.gas_force
        load[:, 3] = gas_factor * self.gas_moment
        load[:, :3] += gas_factor * self.rotating_gas_force * round_x
        for part in self.unbalances:
            force = np.multiply.outer(squared, part.rotating * round_x)
            load[:, :3] += force
            load[:, 3:] += np.cross([part.arm, 0.0, 0.0], force)
        return load

    def gyroscopic(self, frequency: RealArray) -> ComplexArray:
        """Return what the turning rotor adds to the dynamic stiffness.

        Parameters
        ----------
        frequency : array, shape (f,)
            Of the rotation [Hz].

        Returns
        -------
        array, shape (f, 6, 6)
            Hermitian, so that it does no work, but not symmetric [N/m, N/rad, N m/rad].

        Notes
        -----
        The rotor's angular momentum ``h = ±J ω e_x`` turns with the body, which takes the moment
        ``θ̇ × h = ∓jJ ω² skew(e_x) θ``: ``±jJ skew(e_x)`` in the apparent mass.
        """
        squared = (2 * np.pi * np.asarray(frequency)) ** 2
        term = np.zeros((6, 6), dtype=complex)
        term[3:, 3:] = -1j * self.sense * self.rotor_inertia * skew([1.0, 0.0, 0.0])
        return np.multiply.outer(squared, term)


def true_source(sense: int = 1) -> Source:
    """Return the source of the frozen data, built from six unbalances that leave its sums.

    Parameters
    ----------
    sense : int
        1 from y to z, −1 from z to y.
    """
    operation = read_data(COMPRESSOR_DATA)["operation"]

    def number(key: str) -> complex:
        return complex(*operation[key])

    return Source(
        unbalances=balanced(number("static_unbalance_kg_m"), number("dynamic_unbalance_kg_m2")),
        gas_force=number("gas_force_x_N"),
        gas_moment=number("gas_moment_x_N_m"),
        rotating_gas_force=number("gas_force_rotating_N"),
        rotor_inertia=operation["rotor_polar_inertia_kg_m2"],
        sense=sense,
    )


def balanced(static: complex, dynamic: complex) -> tuple[Unbalance, ...]:
    """Add two balance weights to the parts of the compressor, which leave these sums.

    Parameters
    ----------
    static : complex
        [kg m].
    dynamic : complex
        About the virtual point [kg m²].
    """
    left = np.array([static, dynamic])
    for part in PARTS:
        left = left - part.rotating * np.array([1.0, part.arm])
    arms = np.array([[1.0, 1.0], [arm for *_, arm in WEIGHTS]])
    weights = tuple(
        Unbalance(name, float(abs(needed) / radius), radius, arm, float(np.angle(needed)))
        for (name, radius, arm), needed in zip(WEIGHTS, np.linalg.solve(arms, left), strict=True)
    )
    return PARTS + weights
