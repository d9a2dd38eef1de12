"""Apparent mass and sensors of one route at the lines of a sweep, and what is uncertain in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.unbalance_load import RotationSense
from deboom.errors import InputError
from deboom.physics.rigid_body import skew

_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])


@dataclass(frozen=True, eq=False)
class HammerNoise:
    """Noise that a measured apparent mass brings into the load.

    Parameters
    ----------
    seen : array, shape (n_frequency, 6, n_channel)
        ``AM V⁺``.
    inverse : array, shape (6, n_impact)
        ``U⁺``.
    deviation : array, shape (n_frequency, n_channel, n_impact)
        Of real and imaginary part of each FRF [1/kg].
    columns : array, shape (n_frequency, 6, n_impact)
        ``AM V⁺ Y``: wrench of each impact as the test shows it.
    force_deviation : float
        Relative, of the hammer's signal [1].
    """

    seen: ComplexArray
    inverse: RealArray
    deviation: RealArray
    columns: ComplexArray
    force_deviation: float

    def select(self, lines: npt.NDArray[np.intp]) -> HammerNoise:
        """Keep these lines, given by their indices."""
        return replace(
            self,
            seen=self.seen[lines],
            deviation=self.deviation[lines],
            columns=self.columns[lines],
        )

    def covariance(self, one: ComplexArray, other: ComplexArray) -> ComplexArray:
        """Of two loads that were found with the same measured matrix, per part.

        Parameters
        ----------
        one, other : array, shape (n_frequency, 6)
            Loads [N, N m].

        Returns
        -------
        array, shape (n_frequency, 6, 6)
            Half of ``E[e_one e_otherᴴ]``.

        Notes
        -----
        ``δF = −AM V⁺ δY (U⁺)ᵀ F``.
        """
        first, second = one @ self.inverse, other @ self.inverse
        product = first * second.conj()
        spread = np.einsum("fci,fi->fc", self.deviation**2, product)
        of_channels = np.einsum("fac,fc,fbc->fab", self.seen, spread, self.seen.conj())
        of_force = np.einsum("fai,fi,fbi->fab", self.columns, product, self.columns.conj())
        return np.asarray(of_channels + self.force_deviation**2 * of_force)


@dataclass(frozen=True, eq=False)
class RouteModel:
    """What a route makes of a motion.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    inverse : array, shape (6, n_channel)
        Channels → motion of the virtual point.
    apparent_mass : array, shape (n_frequency, 6, 6)
        With the mounts as they were struck [kg, kg m, kg m²].
    by_error : array, shape (n_error, n_frequency, 6, 6)
        Load per motion, by each of independent errors of unit standard deviation, which are the
        same at every line and in every sweep.
    mounts : array, shape (n_frequency, 6, 6)
        Part of the mounts, ``v K/ω²``: a change δ of their stiffness takes ``δ v K/ω²`` off the
        apparent mass.
    noise : HammerNoise or None
        None where the matrix is a model's.
    """

    frequency: RealArray
    inverse: RealArray
    apparent_mass: ComplexArray
    by_error: ComplexArray
    mounts: ComplexArray
    noise: HammerNoise | None

    def with_rotor(self, inertia: float, sense: RotationSense) -> RouteModel:
        """Add the gyroscopic moment of the turning rotor, which a struck compressor lacks.

        Parameters
        ----------
        inertia : float
            Polar moment of the rotor [kg m²].
        sense : RotationSense

        Returns
        -------
        RouteModel

        Notes
        -----
        ``M = I θ̈ + θ̇ × h`` with the spin ``h = J ω e_x`` and ``θ̇ = θ̈/(jω)``: the rotational block
        of the apparent mass at first order gains ``+j J skew(e_x)``, whatever the speed.
        """
        mass = np.array(self.apparent_mass)
        mass[:, 3:, 3:] += 1j * sense.value * inertia * skew([1.0, 0.0, 0.0])
        return replace(self, apparent_mass=mass)


def between_lines(measured: RealArray, wanted: RealArray) -> Callable[[_Array], _Array]:
    """Prepare linear interpolation along the first axis.

    Parameters
    ----------
    measured : array, shape (n,)
        Rising lines [Hz].
    wanted : array, shape (m,)
        Within them [Hz].

    Returns
    -------
    callable
        Array of shape (n, …) → array of shape (m, …).

    Raises
    ------
    InputError
        A line outside: nothing is extrapolated.
    """
    if wanted.min() < measured[0] or wanted.max() > measured[-1]:
        raise InputError(
            f"lines from {wanted.min():g} to {wanted.max():g} Hz are wanted of a hammer test from "
            f"{measured[0]:g} to {measured[-1]:g} Hz: nothing is extrapolated"
        )
    after = np.clip(np.searchsorted(measured, wanted), 1, measured.size - 1)
    share = (wanted - measured[after - 1]) / (measured[after] - measured[after - 1])

    def interpolated(values: _Array) -> _Array:
        part = share.reshape(-1, *(1,) * (values.ndim - 1))
        between = (1 - part) * values[after - 1] + part * values[after]
        return cast("_Array", between)

    return interpolated
