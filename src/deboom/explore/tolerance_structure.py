"""How independent draws become the scatter of parts that have something in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError


@dataclass(frozen=True, eq=False)
class ToleranceStructure:
    """A linear map from independent standard-normal draws to the scatter of the variables.

    Parameters
    ----------
    names : tuple of str, length k
        The design variables.
    loadings : array, shape (k, m)
        Scatter of the variables is ``loadings @ draws``, in standard deviations of each [1]. A row
        has length 1, so that the variable keeps its own tolerance, or less where it is the mean of
        several pieces, which even out.
    draw_names : tuple of str, length m
        What each draw stands for, such as a part or a batch.

    Raises
    ------
    InputError
        Another shape, a value that is not finite, or a row of length 0 or longer than 1.

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
            if not 0.0 < size < 1.0 + 1e-9:
                raise InputError(
                    f"the loadings of '{name}' have the length {size:g}: scale them to 1, or the "
                    "variable's tolerance would grow"
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


def independent(names: Sequence[str]) -> ToleranceStructure:
    """Return the structure of variables that have nothing in common."""
    return ToleranceStructure(tuple(names), np.eye(len(names)), tuple(names))


def blended(parts: Sequence[tuple[float, ToleranceStructure]]) -> ToleranceStructure:
    """Return the sum of independent kinds of scatter, such as that of batches and of pieces.

    Parameters
    ----------
    parts : sequence of (float, ToleranceStructure)
        Share of each kind in the variance of every variable, and how the variables scatter by it.
        Draws are its own, even where another kind has one of the same name.

    Returns
    -------
    ToleranceStructure
        Its correlation is the mean of theirs, weighted with the shares. A kind without a share has
        no draws.

    Raises
    ------
    InputError
        No kind, shares that are negative or do not sum to 1, variables that differ.
    """
    shares = [share for share, _ in parts]
    if not parts or not all(share >= 0.0 for share in shares) or not abs(sum(shares) - 1.0) < 1e-9:
        raise InputError(
            f"kinds of scatter with the shares {shares} of the variance: give shares of at least 0 "
            "that sum to 1"
        )
    names = parts[0][1].names
    if any(structure.names != names for _, structure in parts):
        raise InputError("kinds of scatter that are added must be those of the same variables")
    used = [(share, structure) for share, structure in parts if share > 0.0]
    loadings = np.hstack([np.sqrt(share) * structure.loadings for share, structure in used])
    draws = tuple(name for _, structure in used for name in structure.draw_names)
    return ToleranceStructure(names, loadings, draws)


def beside(structures: Sequence[ToleranceStructure]) -> ToleranceStructure:
    """Return several structures of different variables as one: they have nothing in common.

    Raises
    ------
    InputError
        No structure, or a variable in two of them.
    """
    names = tuple(name for structure in structures for name in structure.names)
    twice = [name for name in names if names.count(name) > 1]
    if not names or twice:
        raise InputError(f"structures side by side need variables of their own: {twice or 'none'}")
    loadings = block_diag(*(structure.loadings for structure in structures))
    draws = tuple(name for structure in structures for name in structure.draw_names)
    return ToleranceStructure(names, loadings, draws)


def averaged(
    structure: ToleranceStructure, pieces: Mapping[str, Sequence[str]]
) -> ToleranceStructure:
    """Return the structure of variables that are the mean of several pieces.

    Parameters
    ----------
    structure : ToleranceStructure
        Of the pieces' variables.
    pieces : mapping of str to sequence of str
        Variable → the variables of its pieces, at least one.

    Raises
    ------
    InputError
        A variable without pieces, or an unknown one.

    Notes
    -----
    A factor on the stiffness of a mount with a left and a right piece is the mean of both pieces'
    factors, exactly so where both contribute the same force.
    """
    rows = []
    for name, members in pieces.items():
        unknown = [member for member in members if member not in structure.names]
        if unknown or not members:
            raise InputError(f"variable '{name}' has no pieces, or unknown ones {unknown}")
        places = [structure.names.index(member) for member in members]
        rows.append(structure.loadings[places].sum(axis=0) / len(places))
    return ToleranceStructure(tuple(pieces), np.array(rows), structure.draw_names)


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
