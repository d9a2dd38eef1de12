"""Unbalance and gas forces as one set of numbers for all speeds, with their deviations."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.source_load import case_name
from deboom.compressor.source_problem import N_ROTOR
from deboom.compressor.source_structure import GAS_NAMES, GAS_UNITS, N_GAS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from deboom.compressor.operating_load import OperatingLoad
    from deboom.compressor.source_fit import SourceFit
    from deboom.compressor.unbalance_load import RotationSense

RESIDUAL_BANDS = ((20.0, 40.0), (40.0, 60.0), (60.0, 90.0), (90.0, 120.0), (120.0, 150.0))
"""In which the rest is looked at [Hz]."""


@dataclass(frozen=True)
class Estimate:
    """A complex number of the source.

    Parameters
    ----------
    value : complex
    deviation : float
        Of its amplitude, 1 σ.
    lower, upper : float
        Confidence interval of its amplitude.
    unit : str
    """

    value: complex
    deviation: float
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True)
class GasEstimate:
    """Gas forces at one pressure.

    Parameters
    ----------
    pressure : float
        [Pa].
    axial, moment, rotating : Estimate
        Along x [N], about x [N m], across x and turning with the rotor [N].
    """

    pressure: float
    axial: Estimate
    moment: Estimate
    rotating: Estimate


@dataclass(frozen=True)
class ResidualBand:
    """What neither rotor nor gas nor mounts explain.

    Parameters
    ----------
    low, high : float
        [Hz].
    share : float
        Rms of the rest over rms of the load, rotations scaled by the radius of gyration, noise
        taken off [1].
    reduced_chi : float
        Rms of the rest in units of its noise [1].
    """

    low: float
    high: float
    share: float
    reduced_chi: float


@dataclass(frozen=True, eq=False)
class Sources:
    """Result of the global weighted least squares.

    Parameters
    ----------
    sense : RotationSense
    static, dynamic : Estimate
        Unbalance [kg m], [kg m²].
    gas : tuple of GasEstimate
        One per pressure, rising.
    names, units : tuple of str
        Of all complex numbers: both unbalances, then the gas of each pressure.
    values : array, shape (n,)
        Of them.
    covariance : array, shape (2 n, 2 n)
        Of their real and imaginary parts by turns.
    reduced_chi : float
        Rms of the residuals in units of their noise [1].
    remaining_chi : float
        The same, with what the mounts do beyond a common factor taken for noise [1].
    residual_bands : tuple of ResidualBand
    """

    sense: RotationSense
    static: Estimate
    dynamic: Estimate
    gas: tuple[GasEstimate, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: ComplexArray
    covariance: RealArray
    reduced_chi: float
    remaining_chi: float
    residual_bands: tuple[ResidualBand, ...]


def sources(
    fit: SourceFit, loads: Sequence[OperatingLoad], length: float, confidence: float
) -> Sources:
    """State the numbers of a fit.

    Parameters
    ----------
    fit : SourceFit
    loads : sequence of OperatingLoad
        That were fitted.
    length : float
        Characteristic length by which moments are scaled [m].
    confidence : float
        Of the intervals [1].

    Returns
    -------
    Sources
    """
    gas = fit.gas_values
    values = np.concatenate([fit.rotor, gas.ravel()])
    own = slice(0, fit.gas_slice.stop)
    by_gas = fit.gas_derivatives().reshape(fit.n_gas, -1)
    slopes = np.zeros((2 * values.size, own.stop))
    slopes[:N_ROTOR, :N_ROTOR] = np.eye(N_ROTOR)
    slopes[N_ROTOR::2, N_ROTOR:], slopes[N_ROTOR + 1 :: 2, N_ROTOR:] = by_gas.real.T, by_gas.imag.T
    covariance = slopes @ fit.covariance[own, own] @ slopes.T
    names = ["static unbalance", "dynamic unbalance"]
    units = ["kg m", "kg m²"]
    for pressure in fit.pressure:
        names += [f"{name} at {case_name(pressure)}" for name in GAS_NAMES]
        units += GAS_UNITS
    quantile = NormalDist().inv_cdf(0.5 + confidence / 2)
    estimates = [
        _estimate(complex(value), covariance[2 * i : 2 * i + 2, 2 * i : 2 * i + 2], unit, quantile)
        for i, (value, unit) in enumerate(zip(values, units, strict=True))
    ]
    return Sources(
        fit.sense,
        estimates[0],
        estimates[1],
        tuple(
            GasEstimate(float(pressure), *estimates[2 + N_GAS * i : 2 + N_GAS * (i + 1)])
            for i, pressure in enumerate(fit.pressure)
        ),
        tuple(names),
        tuple(units),
        values,
        covariance,
        fit.reduced_chi,
        _remaining_chi(fit),
        tuple(
            band
            for low, high in RESIDUAL_BANDS
            if (band := _residual_band(fit, loads, length, low, high)) is not None
        ),
    )


def _estimate(value: complex, covariance: RealArray, unit: str, quantile: float) -> Estimate:
    along = np.array([value.real, value.imag]) / abs(value)
    deviation = float(np.sqrt(along @ covariance @ along))
    amplitude = abs(value)
    return Estimate(
        value,
        deviation,
        max(amplitude - quantile * deviation, 0.0),
        amplitude + quantile * deviation,
        unit,
    )


def _remaining_chi(fit: SourceFit) -> float:
    white = np.concatenate([part[np.isfinite(part)] for part in fit.whitened])
    return float(np.sqrt(np.mean(np.abs(white) ** 2) / 2))


def _residual_band(
    fit: SourceFit, loads: Sequence[OperatingLoad], length: float, low: float, high: float
) -> ResidualBand | None:
    scale = np.repeat([1.0, 1 / length], 3)
    rest, whole, chi = [], [], []
    for load, residual, white in zip(loads, fit.residuals, fit.whitened, strict=True):
        lines = (load.frequency >= low) & (load.frequency < high) & np.isfinite(white[:, 0])
        rest.append((scale * residual[lines]).ravel())
        whole.append((scale * load.load[lines]).ravel())
        chi.append(white[lines].ravel())
    if sum(part.size for part in chi) == 0:
        return None
    squares = [float(np.sum(np.abs(np.concatenate(parts)) ** 2)) for parts in (rest, whole, chi)]
    mean = squares[2] / (2 * sum(part.size for part in chi))
    beyond = max(1 - 1 / mean, 0.0)
    return ResidualBand(
        low, high, float(np.sqrt(beyond * squares[0] / squares[1])), float(np.sqrt(mean))
    )
