"""What a measurement says of a compressor: combinations seen, quantities and their deviations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import qr

from deboom.arrays import AXES, DOFS, ComplexArray, RealArray, derivatives
from deboom.compressor.model import CompressorModel
from deboom.compressor.parameters import INERTIA_ENTRIES, INERTIA_NAMES
from deboom.compressor.self_calibration import SelfCalibration
from deboom.errors import InputError

RANK_TOLERANCE = 1e-9
"""Singular values below this part of the largest one are zero but for rounding."""
PRIOR_DOMINATED = 0.5
"""A posterior deviation above this part of the prior one means: the prior said most of it."""
ALONE = 0.9
"""Share of a parameter in the null space from which on it is invisible by itself."""
NAMED = 0.2
"""Smallest entry, relative to the largest, that is named in a combination."""
STRONG_CORRELATION = 0.8
REFERENCE_FREQUENCY = 20.0
"""Line at which the stiffness is stated: there the real part of the gain is 1 [Hz]."""
GAIN_LINES = np.array([10.0, 30.0, 100.0])
"""Lines at which the gain is stated [Hz]."""
_STEP = 1e-3
"""Of the differences, in posterior standard deviations: far below curvature, far above rounding."""


@dataclass(frozen=True, eq=False)
class NullDirection:
    """A change of parameters that no measurement at the virtual point can see.

    `names`: parameters that take part, the largest share first.
    """

    names: tuple[str, ...]

    @property
    def statement(self) -> str:
        """One sentence for the report."""
        if len(self.names) == 1:
            return f"{self.names[0]} is not visible"
        if len(self.names) > 6:
            others = len(self.names) - 5
            return f"{', '.join(self.names[:5])} and {others} others are visible together only"
        return f"{', '.join(self.names[:-1])} and {self.names[-1]} are visible together only"


@dataclass(frozen=True, eq=False)
class Identifiability:
    """Rank and null space of a Jacobian.

    `rank`: number of combinations that the measurement sees; `participation` (n_parameters,): share
    of each parameter in the null space: 1 is invisible, 0 is free of it [1].
    """

    names: tuple[str, ...]
    rank: int
    participation: RealArray
    null_space: tuple[NullDirection, ...]


def identifiability(
    names: tuple[str, ...], jacobian: RealArray, tolerances: RealArray
) -> Identifiability:
    """Find the rank of a Jacobian and the words for its null space.

    `jacobian` (n_residuals, n_parameters): derivatives of weighted residuals; `tolerances`
    (n_parameters,): step by which each parameter may change, such as its bound or its 1 σ; makes
    metres and newtons comparable. InputError: fewer residuals than parameters.
    """
    if jacobian.shape[0] < len(names):
        raise InputError(
            f"{jacobian.shape[0]} measured numbers cannot fix {len(names)} parameters: measure "
            "more lines"
        )
    scaled = jacobian * tolerances
    # the triangular factor has the same singular values and right vectors at a fraction of the size
    _, values, right = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    rank = int(np.sum(values > RANK_TOLERANCE * values[0]))
    null = right[rank:]
    participation = np.sum(null**2, axis=0)
    # a basis of the null space in which each row moves few parameters
    _, pivots = qr(null, mode="r", pivoting=True)
    sparse = np.abs(np.linalg.solve(null[:, np.sort(pivots[: len(null)])], null))
    directions = tuple(
        NullDirection(tuple(names[n] for n in np.argsort(-row) if row[n] > NAMED * row.max()))
        for row in sparse
    )
    return Identifiability(names, rank, participation, directions)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What a measurement added to what was known, parameter by parameter.

    `posterior`, `prior` (n_parameters,): 1 σ after and before; infinite where nothing was known;
    `correlation` (n_parameters, n_parameters): correlation after the measurement [1].
    """

    names: tuple[str, ...]
    posterior: RealArray
    prior: RealArray
    correlation: RealArray

    @property
    def ratio(self) -> RealArray:
        """Posterior over prior deviation, 0 where nothing was known before [1]."""
        return np.asarray(self.posterior / self.prior)

    @property
    def prior_dominated(self) -> tuple[str, ...]:
        """Parameters of which the measurement said little."""
        marked = zip(self.names, self.ratio, strict=True)
        return tuple(name for name, ratio in marked if ratio > PRIOR_DOMINATED)

    @property
    def strong_correlations(self) -> tuple[tuple[str, str, float], ...]:
        """Pairs that the measurement hardly tells apart, the strongest first."""
        rows, columns = np.triu_indices(len(self.names), 1)
        values = self.correlation[rows, columns]
        order = [n for n in np.argsort(-np.abs(values)) if abs(values[n]) > STRONG_CORRELATION]
        return tuple((self.names[rows[n]], self.names[columns[n]], float(values[n])) for n in order)


def knowledge(names: tuple[str, ...], covariance: RealArray, prior: RealArray) -> Knowledge:
    """Compare a posterior covariance with prior deviations, infinite where nothing was known."""
    posterior = np.sqrt(np.diag(covariance))
    return Knowledge(names, posterior, prior, covariance / np.outer(posterior, posterior))


@dataclass(frozen=True, eq=False)
class Quantities:
    """What a compressor is, in engineering units.

    `names`, `units`: name and unit of each quantity; `values` (n,): quantities in these units.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: RealArray


def quantities(model: CompressorModel) -> Quantities:
    """Read mass, centre, inertia, stiffness and gain off a model.

    - `model`: identified or true compressor.
    - returns: 11 of mass and inertia [kg, mm, kg cm²], 21 of the stiffness at `REFERENCE_FREQUENCY`
      [N/mm, N/rad, N m/rad], and the gain at 10, 30 and 100 Hz, 1 in its real part at the reference
      [1].
    """
    scale = float(model.gain.real.at(REFERENCE_FREQUENCY))
    gain = model.gain.at(GAIN_LINES) / scale
    rows: list[tuple[str, str, float]] = [("mass", "kg", model.mass)]
    rows += [
        (f"centre {axis}", "mm", 1e3 * value)
        for axis, value in zip(AXES, model.centre, strict=True)
    ]
    rows += [
        (name, "kg cm²", 1e4 * model.inertia[entry])
        for name, entry in zip(INERTIA_NAMES, INERTIA_ENTRIES, strict=True)
    ]
    blocks = (("N/mm", 1e-3, 0, 0), ("N/rad", 1.0, 0, 3), ("N m/rad", 1.0, 3, 3))
    for unit, factor, first_row, first_column in blocks:
        rows += [
            (
                f"K {DOFS[row]} {DOFS[column]}",
                unit,
                factor * (scale * model.stiffness[row, column]),
            )
            for row in range(first_row, first_row + 3)
            for column in range(max(row, first_column), first_column + 3)
        ]
    for part, values in (("Re", gain.real), ("Im", gain.imag)):
        rows += [
            (f"{part} gain at {line:g} Hz", "1", value)
            for line, value in zip(GAIN_LINES, values, strict=True)
        ]
    names, units, numbers = zip(*rows, strict=True)
    return Quantities(names, units, np.array(numbers, dtype=float))


def quantity_deviations(calibration: SelfCalibration) -> RealArray:
    """Propagate the posterior to the standard deviations of `quantities`, shape (n,)."""
    return np.sqrt(np.diag(propagated(calibration, lambda model: quantities(model).values)))


def gain_deviation(calibration: SelfCalibration, frequency: npt.ArrayLike) -> ComplexArray:
    """Propagate the posterior to the gain.

    `frequency` (n_frequency,): lines [Hz]. Returns (n_frequency,) standard deviation of the real
    part, and of the imaginary one as imaginary part, where the real part is 1 at
    `REFERENCE_FREQUENCY` [1].
    """
    lines = np.asarray(frequency, dtype=float)

    def gain(model: CompressorModel) -> RealArray:
        values = model.gain.at(lines) / model.gain.real.at(REFERENCE_FREQUENCY)
        return np.concatenate([values.real, values.imag])

    real, imaginary = np.split(np.sqrt(np.diag(propagated(calibration, gain))), 2)
    return np.asarray(real + 1j * imaginary)


def propagated(
    calibration: SelfCalibration, of: Callable[[CompressorModel], RealArray]
) -> RealArray:
    """Propagate the posterior of the parameters to any function of the model, to first order.

    Returns (n, n) covariance of the function.
    """

    def function(rows: RealArray) -> RealArray:
        return np.stack([of(calibration.parametrisation.model(row)) for row in rows])

    covariance = calibration.parameter_covariance
    unit = np.sqrt(np.diag(covariance))
    slopes = derivatives(function, calibration.values, _STEP * unit) * unit[:, np.newaxis]
    return np.asarray(slopes.T @ (covariance / np.outer(unit, unit)) @ slopes)
