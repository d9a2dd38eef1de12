"""What a measurement says about a compressor: combinations seen, quantities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.parameters import AXES, INERTIA_ENTRIES, INERTIA_NAMES
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


@dataclass(frozen=True, eq=False)
class NullDirection:
    """A change of parameters that no measurement at the virtual point can see.

    Parameters
    ----------
    names : tuple of str
        Parameters that take part, the largest share first.
    shares : array, shape (n,)
        Change of each, in units of its tolerance, relative to the largest [1].
    """

    names: tuple[str, ...]
    shares: RealArray

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

    Parameters
    ----------
    names : tuple of str
        Of the parameters.
    singular_values : array, shape (n_parameters,)
        Of the Jacobian with its columns in units of the tolerances, decreasing [1].
    rank : int
        How many combinations the measurement sees.
    participation : array, shape (n_parameters,)
        Share of each parameter in the null space: 1 is invisible, 0 is free of it [1].
    null_space : tuple of NullDirection
        One per invisible combination, in its sparsest form.
    """

    names: tuple[str, ...]
    singular_values: RealArray
    rank: int
    participation: RealArray
    null_space: tuple[NullDirection, ...]

    @property
    def invisible(self) -> tuple[str, ...]:
        """Parameters that lie almost wholly in the null space."""
        marked = zip(self.names, self.participation, strict=True)
        return tuple(name for name, share in marked if share >= ALONE)


def identifiability(
    names: tuple[str, ...], jacobian: RealArray, tolerances: RealArray
) -> Identifiability:
    """Find the rank of a Jacobian and the words for its null space.

    Parameters
    ----------
    names : tuple of str
        One per parameter.
    jacobian : array, shape (n_residuals, n_parameters)
        Of weighted residuals.
    tolerances : array, shape (n_parameters,)
        Step by which each parameter may change, such as its bound or its 1 σ; makes metres and
        newtons comparable.

    Returns
    -------
    Identifiability

    Raises
    ------
    InputError
        Shapes that do not fit, or fewer residuals than parameters.
    """
    if jacobian.ndim != 2 or jacobian.shape[1] != len(names) or tolerances.shape != (len(names),):
        raise InputError("identifiability needs one column, one name and one tolerance each")
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
    directions = tuple(_direction(names, row) for row in _sparse_rows(null))
    return Identifiability(names, values, rank, participation, directions)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What a measurement added to what was known, parameter by parameter.

    Parameters
    ----------
    names : tuple of str
    posterior, prior : array, shape (n_parameters,)
        1 σ after and before; infinite where nothing was known.
    correlation : array, shape (n_parameters, n_parameters)
        After [1].
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
    """Compare a posterior covariance with the prior deviations.

    Parameters
    ----------
    names : tuple of str
        One per parameter.
    covariance : array, shape (n_parameters, n_parameters)
        Posterior.
    prior : array, shape (n_parameters,)
        1 σ before the measurement; infinite where nothing was known.

    Returns
    -------
    Knowledge
    """
    posterior = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(posterior, posterior)
    return Knowledge(names, posterior, np.asarray(prior, dtype=float), correlation)


def _sparse_rows(null: RealArray) -> RealArray:
    """Turn a basis of the null space so that each row moves few parameters.

    Reduced row echelon form with the pivots chosen by size: every pivot parameter takes part in one
    row only.
    """
    rows = null.copy()
    for number in range(rows.shape[0]):
        remaining = np.abs(rows[number:])
        pivot_row, pivot = np.unravel_index(int(np.argmax(remaining)), remaining.shape)
        rows[[number, number + int(pivot_row)]] = rows[[number + int(pivot_row), number]]
        rows[number] /= rows[number, pivot]
        others = np.arange(rows.shape[0]) != number
        rows[others] -= np.outer(rows[others, pivot], rows[number])
    return rows


def _direction(names: tuple[str, ...], row: RealArray) -> NullDirection:
    size = np.abs(row)
    order = [int(n) for n in np.argsort(-size) if size[n] > NAMED * size.max()]
    return NullDirection(tuple(names[n] for n in order), row[order] / size.max())


if TYPE_CHECKING:
    from deboom.compressor.calibrate import SelfCalibration
    from deboom.compressor.model import CompressorModel

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
