"""What a measurement can say of each parameter, and what it cannot, in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
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
