"""Numbers that an engineer asks for, with their standard deviations, out of scaled parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.thesis_parameters import AXES, INERTIA_ENTRIES, INERTIA_NAMES

if TYPE_CHECKING:
    from deboom.compressor.model import CompressorModel
    from deboom.compressor.self_calibration import SelfCalibration

REFERENCE_FREQUENCY = 20.0
"""Line at which the stiffness is stated: there the real part of the gain is 1 [Hz]."""
_MOTIONS = (*AXES, "rx", "ry", "rz")
_STIFFNESS = [(row, column) for row in range(6) for column in range(row, 6)]
_STEP = 1e-3
"""Of the differences, in posterior standard deviations: far below curvature, far above rounding."""


@dataclass(frozen=True, eq=False)
class Quantities:
    """What a compressor is, in engineering units.

    Parameters
    ----------
    names, units : tuple of str
        One per quantity.
    values : array, shape (n,)
        Of these units.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: RealArray


def quantities(model: CompressorModel) -> Quantities:
    """Read mass, centre, inertia, stiffness and gain off a model.

    Parameters
    ----------
    model : CompressorModel

    Returns
    -------
    Quantities
        11 of mass and inertia [kg, mm, kg cm²], 21 of the stiffness at `REFERENCE_FREQUENCY`
        [N/mm, N/rad, N m/rad], and the gain at 10, 30 and 100 Hz, 1 in its real part at the
        reference [1].
    """
    scale = float(model.gain.real.at(REFERENCE_FREQUENCY))
    stiffness = scale * model.stiffness
    lines = np.array([10.0, 30.0, 100.0])
    gain = model.gain.at(lines) / scale
    translation = [(row, column) for row, column in _STIFFNESS if column < 3]
    coupling = [(row, column) for row, column in _STIFFNESS if row < 3 <= column]
    rotation = [(row, column) for row, column in _STIFFNESS if row >= 3]
    entries = [*translation, *coupling, *rotation]
    per_mm = [1e-3] * len(translation) + [1.0] * (len(coupling) + len(rotation))
    return Quantities(
        (
            "mass",
            *(f"centre {axis}" for axis in AXES),
            *INERTIA_NAMES,
            *(f"K {_MOTIONS[row]} {_MOTIONS[column]}" for row, column in entries),
            *(f"Re gain at {line:g} Hz" for line in lines),
            *(f"Im gain at {line:g} Hz" for line in lines),
        ),
        (
            "kg",
            *("mm",) * 3,
            *("kg cm²",) * 6,
            *("N/mm",) * len(translation),
            *("N/rad",) * len(coupling),
            *("N m/rad",) * len(rotation),
            *("1",) * 6,
        ),
        np.concatenate(
            [
                [model.mass],
                1e3 * model.centre,
                [1e4 * model.inertia[entry] for entry in INERTIA_ENTRIES],
                [factor * stiffness[entry] for factor, entry in zip(per_mm, entries, strict=True)],
                gain.real,
                gain.imag,
            ]
        ),
    )


def quantity_deviations(found: SelfCalibration) -> RealArray:
    """Propagate the posterior to the quantities.

    Parameters
    ----------
    found : SelfCalibration

    Returns
    -------
    array, shape (n,)
        Standard deviations, of the units of `quantities`.
    """
    return np.sqrt(np.diag(propagated(found, lambda model: quantities(model).values)))


def gain_deviation(found: SelfCalibration, frequency: npt.ArrayLike) -> ComplexArray:
    """Propagate the posterior to the gain.

    Parameters
    ----------
    found : SelfCalibration
    frequency : array, shape (n_frequency,)
        [Hz].

    Returns
    -------
    array, shape (n_frequency,)
        Standard deviation of the real part, and of the imaginary one as imaginary part, where the
        real part is 1 at `REFERENCE_FREQUENCY` [1].
    """
    lines = np.asarray(frequency, dtype=float)

    def gain(model: CompressorModel) -> RealArray:
        values = model.gain.at(lines) / model.gain.real.at(REFERENCE_FREQUENCY)
        return np.concatenate([values.real, values.imag])

    real, imaginary = np.split(np.sqrt(np.diag(propagated(found, gain))), 2)
    return np.asarray(real + 1j * imaginary)


def propagated(found: SelfCalibration, of: Callable[[CompressorModel], RealArray]) -> RealArray:
    """Covariance of any function of the model, to first order; see `propagated_from`."""
    return propagated_from(
        found.parametrisation.model, found.values, found.parameter_covariance, of
    )


def propagated_from(
    model: Callable[[RealArray], CompressorModel],
    values: RealArray,
    covariance: RealArray,
    of: Callable[[CompressorModel], RealArray],
) -> RealArray:
    """Covariance of any function of a model whose parameters have a covariance, to first order.

    Parameters
    ----------
    model : callable
        Parameters → model.
    values : array, shape (n_parameters,)
    covariance : array, shape (n_parameters, n_parameters)
    of : callable
        Model → array, shape (n,).

    Returns
    -------
    array, shape (n, n)
    """
    unit = np.sqrt(np.diag(covariance))
    slopes = []
    for number, step in enumerate(_STEP * unit):
        change = np.zeros(unit.size)
        change[number] = step
        above, below = (of(model(values + s * change)) for s in (1, -1))
        slopes.append((above - below) / (2 * _STEP))
    columns = np.stack(slopes, axis=1)
    return np.asarray(columns @ (covariance / np.outer(unit, unit)) @ columns.T)
