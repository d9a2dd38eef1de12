"""How independent draws become the scatter of parts that have something in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from deboom.errors import InputError
from deboom.explore.arrays import RealArray, frozen_copy


@dataclass(frozen=True, eq=False)
class ToleranceStructure:
    """A linear map from independent standard-normal draws to the scatter of the variables.

    Parameters
    ----------
    names : tuple of str, length k
        The design variables.
    loadings : array, shape (k, m)
        Scatter of the variables is ``loadings @ draws``, in standard deviations of each [1]. Rows
        have length 1, so that every variable keeps its own tolerance.
    draw_names : tuple of str, length m
        What each draw stands for, such as a part or a batch.

    Raises
    ------
    InputError
        Another shape, a value that is not finite, or a row of another length.

    Notes
    -----
    Draws are cut at three standard deviations one by one. A variable that is made of several may
    go beyond three standard deviations of its own, in a few cases in a thousand.
    """

    names: tuple[str, ...]
    loadings: RealArray
    draw_names: tuple[str, ...]

    def __post_init__(self) -> None:
        loadings = np.asarray(self.loadings, dtype=float)
        if loadings.shape != (len(self.names), len(self.draw_names)):
            raise InputError(
                f"loadings of shape {loadings.shape} for {len(self.names)} variables and "
                f"{len(self.draw_names)} draws: give one row per variable and one column per draw"
            )
        length = np.sqrt(np.einsum("km,km->k", loadings, loadings))
        for name, size in zip(self.names, length, strict=True):
            if not abs(size - 1.0) < 1e-9:
                raise InputError(
                    f"the loadings of '{name}' have the length {size:g}: scale them to 1, or the "
                    "variable's tolerance would change"
                )
        object.__setattr__(self, "loadings", frozen_copy(loadings))

    @property
    def n_draws(self) -> int:
        """Number m of independent draws per part."""
        return int(self.loadings.shape[1])

    @property
    def largest(self) -> RealArray:
        """How far each variable can go for every unit that all draws can go, shape (k,) [1]."""
        return np.asarray(np.abs(self.loadings).sum(axis=1))

    def scatter(self, draws: RealArray) -> RealArray:
        """Return the scatter of the variables, shape (n, k), from draws, shape (n, m) [1]."""
        return np.asarray(np.einsum("tm,km->tk", draws, self.loadings))


def shared_parts(names: Sequence[str], parts: Mapping[str, Sequence[str]]) -> ToleranceStructure:
    """Return the structure of variables that share part numbers.

    Parameters
    ----------
    names : sequence of str
        All variables.
    parts : mapping of str to sequence of str
        Part → the variables that scatter as one, such as one bush used at two mounts. Variables
        of no part scatter on their own.

    Raises
    ------
    InputError
        An unknown variable, or one that belongs to two parts.
    """
    _check_groups(names, parts)
    of = {name: f"part {part}" for part, members in parts.items() for name in members}
    draws = list(dict.fromkeys(of.get(name, name) for name in names))
    loadings = np.zeros((len(names), len(draws)))
    for row, name in enumerate(names):
        loadings[row, draws.index(of.get(name, name))] = 1.0
    return ToleranceStructure(tuple(names), loadings, tuple(draws))


def batches(
    names: Sequence[str], parts: Mapping[str, Sequence[str]], correlation: float
) -> ToleranceStructure:
    """Return the structure of axes that share a batch of rubber and scatter on their own besides.

    Parameters
    ----------
    names : sequence of str
        All variables.
    parts : mapping of str to sequence of str
        Mount → its variables.
    correlation : float
        Between any two variables of one mount, 0 to 1 [1]: the batch's share of the variance.

    Raises
    ------
    InputError
        An unknown variable, one that belongs to two mounts, or a correlation outside 0 to 1.
    """
    _check_groups(names, parts)
    if not 0.0 <= correlation <= 1.0:
        raise InputError(
            f"a correlation of {correlation:g} between the axes of a mount: take one from 0 to 1"
        )
    shared = np.array([[name in members for members in parts.values()] for name in names], float)
    shared = shared.reshape(len(names), len(parts))
    own = np.diag(np.sqrt(1.0 - correlation * shared.sum(axis=1)))
    loadings = np.hstack([own, np.sqrt(correlation) * shared])
    draws = (*names, *(f"batch {part}" for part in parts))
    return ToleranceStructure(tuple(names), loadings, draws)


def correlated(names: Sequence[str], correlation: RealArray) -> ToleranceStructure:
    """Return the structure of variables with a given correlation.

    Parameters
    ----------
    names : sequence of str
        All variables.
    correlation : array, shape (k, k)
        Symmetric, ones on its diagonal, no negative eigenvalue [1].

    Raises
    ------
    InputError
        No such matrix.
    """
    matrix = np.asarray(correlation, dtype=float)
    size = len(names)
    if matrix.shape != (size, size) or not (
        np.allclose(matrix, matrix.T) and np.allclose(np.diag(matrix), 1.0)
    ):
        raise InputError(
            f"the correlation of {size} variables must be a symmetric {size} x {size} matrix with "
            "ones on its diagonal"
        )
    value, vector = np.linalg.eigh(matrix)
    if value[0] < -1e-9:
        raise InputError(
            f"the correlation matrix has the eigenvalue {value[0]:g}: no parts scatter like that; "
            "check the correlations against each other"
        )
    loadings = (vector * np.sqrt(np.maximum(value, 0.0))) @ vector.T
    length = np.sqrt(np.einsum("km,km->k", loadings, loadings))
    draws = tuple(f"draw {number}" for number in range(1, size + 1))
    return ToleranceStructure(tuple(names), loadings / length[:, None], draws)


def _check_groups(names: Sequence[str], parts: Mapping[str, Sequence[str]]) -> None:
    seen: dict[str, str] = {}
    for part, members in parts.items():
        for name in members:
            if name not in names:
                raise InputError(
                    f"part '{part}' has the variable '{name}', which the design space has not: "
                    f"there are {list(names)}"
                )
            if name in seen:
                raise InputError(f"variable '{name}' is part of '{seen[name]}' and of '{part}'")
            seen[name] = part
