"""Parts as they are made: part numbers, batches of rubber, pieces, axes of one hardness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from deboom.errors import InputError
from deboom.explore.tolerance_structure import (
    ToleranceStructure,
    averaged,
    beside,
    blended,
    independent,
    shared_parts,
)


@dataclass(frozen=True)
class PartNumber:
    """A part number: where its pieces sit, and what their scatter has in common.

    Parameters
    ----------
    name : str
        Such as ``bush 4711``.
    places : tuple of str
        Mounts that take it, such as ``("Du",)``; all of them get pieces of one batch.
    pieces : int
        How many pieces stand behind the variables of one place, such as 2 for a left and a right
        one: a variable is then the mean of its pieces.
    hardness_share : float
        Share of the variance that all axes of a piece have in common, 0 to 1 [1].
    batch_share : float
        Share of the variance that all pieces of a batch have in common, 0 to 1 [1].

    Raises
    ------
    InputError
        No place, a place twice, no piece, or a share outside 0 to 1.

    Notes
    -----
    Correlations are products: ``h`` between two axes of a piece, ``b`` between one axis of two
    pieces, ``b h`` between two axes of two pieces. Hardness (compound and cure) is common to all
    axes, geometry is each axis's own; of both, the batch settles one part and the piece the rest.
    """

    name: str
    places: tuple[str, ...]
    pieces: int = 1
    hardness_share: float = 0.0
    batch_share: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "places", tuple(self.places))
        if not self.places or len(set(self.places)) < len(self.places):
            raise InputError(
                f"part number '{self.name}' sits at {list(self.places)}: name every place once"
            )
        if self.pieces < 1:
            raise InputError(f"part number '{self.name}' has {self.pieces} pieces: at least 1")
        for what, share in (("hardness", self.hardness_share), ("batch", self.batch_share)):
            if not 0.0 <= share <= 1.0:
                raise InputError(
                    f"part number '{self.name}': a {what} share of {share:g}: take one from 0 to 1"
                )

    def structure(self, names: Sequence[str]) -> ToleranceStructure:
        """Return how its variables scatter.

        Parameters
        ----------
        names : sequence of str
            ``<place> <axis>`` of all its places and no other.
        """
        numbers = range(1, self.pieces + 1)
        of_piece = {
            f"{place} {number}" if self.pieces > 1 else place: [
                name for name in names if _place(name) == place
            ]
            for place in self.places
            for number in numbers
        }
        own = {
            piece: [f"{piece} {_axis(name)}" for name in members]
            for piece, members in of_piece.items()
        }
        directions = [direction for members in own.values() for direction in members]
        hardness, geometry = self.hardness_share, 1.0 - self.hardness_share
        piece = blended(
            [
                (hardness, shared_parts(directions, {f"{p}, hardness": m for p, m in own.items()})),
                (geometry, independent(directions)),
            ]
        )
        # of a single piece nobody can tell what comes from its batch
        batch_share = self.batch_share if len(own) > 1 else 0.0
        by_axis = {
            f"{self.name}, {axis} of the batch": [d for d in directions if _axis(d) == axis]
            for axis in dict.fromkeys(map(_axis, directions))
        }
        batch = blended(
            [
                (hardness, shared_parts(directions, {f"{self.name}, batch": directions})),
                (geometry, shared_parts(directions, by_axis)),
            ]
        )
        made = blended([(batch_share, batch), (1.0 - batch_share, piece)])
        pieces = {
            name: [
                f"{place} {_axis(name)}" for place, members in of_piece.items() if name in members
            ]
            for name in names
        }
        return averaged(made, pieces)


def part_structure(
    names: Sequence[str],
    parts: Sequence[PartNumber],
    hardness_share: float = 0.0,
    batch_share: float = 0.0,
) -> ToleranceStructure:
    """Return how variables scatter that are directions of parts.

    Parameters
    ----------
    names : sequence of str
        All variables, ``<place> <axis>``.
    parts : sequence of PartNumber
        A place of none of them has a part number of its own, of one piece.
    hardness_share, batch_share : float
        Of those places.

    Returns
    -------
    ToleranceStructure
        For a place of one piece that shares its number with no other, the batch share is without
        effect.

    Raises
    ------
    InputError
        A place that no variable has, or that takes two part numbers.

    Examples
    --------
    >>> names = ("TSM x", "Du x", "Du z")
    >>> both = PartNumber("bush", ("Du",), pieces=2, hardness_share=0.5, batch_share=0.2)
    >>> structure = part_structure(names, [both])
    >>> (structure.loadings @ structure.loadings.T).round(3)
    array([[1. , 0. , 0. ],
           [0. , 0.6, 0.3],
           [0. , 0.3, 0.6]])
    """
    places = tuple(dict.fromkeys(map(_place, names)))
    taken: dict[str, str] = {}
    for part in parts:
        for place in part.places:
            if place not in places:
                raise InputError(
                    f"part number '{part.name}' sits at '{place}', which no variable has: use "
                    f"{', '.join(places)}"
                )
            if place in taken:
                raise InputError(
                    f"place '{place}' takes the part numbers '{taken[place]}' and '{part.name}': "
                    "give it one"
                )
            taken[place] = part.name
    alone = [
        PartNumber(place, (place,), 1, hardness_share, batch_share)
        for place in places
        if place not in taken
    ]
    structures = [
        part.structure([name for name in names if _place(name) in part.places])
        for part in (*parts, *alone)
    ]
    return averaged(beside(structures), {name: (name,) for name in names})


def _place(name: str) -> str:
    return name.rpartition(" ")[0]


def _axis(name: str) -> str:
    return name.rpartition(" ")[2]
