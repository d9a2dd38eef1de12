"""Reciprocity: a structure answers at A to a push at B as it answers at B to a push at A."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.coherence import likeness


@dataclass(frozen=True, eq=False)
class Reciprocity:
    """How symmetric a matrix of frequency response functions is.

    Parameters
    ----------
    names : tuple of str
        Degrees of freedom, by their output.
    likeness : array, shape (n, n)
        Coherence criterion of each entry and its mirror image, mean over the lines: 1 is
        perfect, 0.5 what two unrelated functions have, 0 opposite sign [1].
    likeness_by_energy : array, shape (n, n)
        The same with each line weighted by ``|Y_ij|² / |Y_ii Y_jj|``, so that lines at which the
        entry is nothing but noise do not count [1].
    size : array, shape (n, n)
        Root of the mean of that weight: how much the entry matters; free of units [1].
    """

    names: tuple[str, ...]
    likeness: RealArray
    likeness_by_energy: RealArray
    size: RealArray

    def __post_init__(self) -> None:
        for name in ("likeness", "likeness_by_energy", "size"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def worst(self, smallest: float = 0.1) -> tuple[str, float]:
        """Return the least reciprocal pair among those that matter.

        Parameters
        ----------
        smallest : float
            Size from which a pair counts: symmetric bodies have entries that are nothing but noise.

        Returns
        -------
        str, float
            ``x–ry`` and its likeness by energy; an empty name and 1 where all pairs are small.
        """
        rows, columns = np.triu_indices(len(self.names), k=1)
        pairs = [
            (float(self.likeness_by_energy[i, j]), f"{self.names[i]}–{self.names[j]}")
            for i, j in zip(rows, columns, strict=True)
            if self.size[i, j] >= smallest
        ]
        value, name = min(pairs, default=(1.0, ""))
        return name, value


def reciprocity(frf: Frf) -> Reciprocity:
    """Compare each entry of a square matrix with its mirror image.

    Parameters
    ----------
    frf : Frf
        Output i and input i are one degree of freedom, such as a virtual point's x and fx.

    Raises
    ------
    InputError
        A matrix that is not square, or an entry on the diagonal that is 0.

    Notes
    -----
    Mind the scale: real virtual points are far from 1. Of the 15 pairs of a published rubber mount
    only three lie above 0.95, and four within 0.1 of the 0.5 of unrelated functions.
    """
    n_output, n_input = frf.values.shape[1:]
    if n_output != n_input:
        raise InputError(
            f"reciprocity needs as many inputs as outputs, not {n_output} by {n_input}"
        )
    mirrored = np.swapaxes(frf.values, 1, 2)
    driving = np.abs(np.einsum("fii->fi", frf.values))
    if np.any(driving == 0):
        where = frf.outputs[int(np.argwhere(driving == 0)[0, 1])]
        raise InputError(f"the driving point function of {where} is 0: reciprocity needs it")
    reference = np.sqrt(driving[:, :, np.newaxis] * driving[:, np.newaxis, :])
    comparable, mirror = frf.values / reference, mirrored / reference
    energy = (np.abs(comparable) ** 2 + np.abs(mirror) ** 2) / 2
    return Reciprocity(
        names=frf.outputs,
        likeness=likeness(frf.values, mirrored).mean(axis=0),
        likeness_by_energy=likeness(comparable, mirror, axis=0),
        size=np.sqrt(energy.mean(axis=0)),
    )
