"""The numbers behind the report of a mount selection: parts, benefit, comparison with all sets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.fronts import ParetoFront, Verification, pareto_front, verification_response
from deboom.explore.problems import SearchResult
from deboom.explore.robust import Robust, RobustResponse, RobustValues, joined
from deboom.explore.selection import pick
from deboom.files.platform import Platform
from deboom.study.mount_catalogue import Catalogue
from deboom.vehicles.catalogue_index import CatalogueIndex

BATCH = 100
"""Sets evaluated between two steps of the progress bar."""


@dataclass(frozen=True, eq=False)
class MountSelection:
    """A search over the parts of a catalogue, verified.

    Parameters
    ----------
    platform : Platform
        Whose mounts they are.
    catalogue : Catalogue
        Parts to choose from.
    index : CatalogueIndex
        What was evaluated.
    robust : RobustResponse
        How it was made robust.
    search : SearchResult
        What was found.
    verification : Verification
        The found front, re-evaluated.
    sets : RobustValues or None
        Every set of parts at factors 1, in the order of `Catalogue.all_sets`; None if there were
        too many to evaluate.
    """

    platform: Platform
    catalogue: Catalogue
    index: CatalogueIndex
    robust: RobustResponse
    search: SearchResult
    verification: Verification
    sets: RobustValues | None

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        return 1.0 / (self.index.n_lines * len(self.index.response_names))

    @property
    def retuning(self) -> float:
        """Half width of the stiffness factors [1]."""
        return float(self.robust.space.upper[-1] - 1.0)

    @property
    def n_mounts(self) -> int:
        """Number of part choices at the head of each design."""
        return len(self.catalogue.parts)

    @cached_property
    def picks(self) -> dict[str, int]:
        """Rows of the front by name of the pick, chosen on verified values."""
        rows = pick(self.verification.values)
        return {"best mean": rows.best_mean, "best sigma": rows.best_sigma, "knee": rows.knee}

    @cached_property
    def baseline(self) -> RobustValues:
        """Today's set under the verification's draws; one row."""
        return self._verified(self.robust.space.nominal[np.newaxis, :])

    @cached_property
    def set_front(self) -> ParetoFront | None:
        """Front of all sets of parts as they are, from the draws of the search."""
        return None if self.sets is None else pareto_front(self.sets)

    @cached_property
    def best_set(self) -> RobustValues | None:
        """The quietest set of parts as they are, verified; one row."""
        if self.set_front is None:
            return None
        return self._verified(self.set_front.designs[:1])

    @property
    def found_percent(self) -> float:
        """Sets of the enumerated front that the search found or beat; nan if not enumerated [%]."""
        if self.set_front is None:
            return float("nan")
        found = [
            np.any(np.all(self.search.front.objectives <= wanted, axis=1))
            for wanted in self.set_front.objectives
        ]
        return float(100.0 * np.mean(found))

    def splv_change(self, design: RealArray) -> RealArray:
        """Change of SPLV over the number of lines against today's set, shape (n_vehicle,) [dB]."""
        both = self.index(np.stack([self.robust.space.nominal, design]))
        return np.asarray((both[1] - both[0]) / self.index.n_lines)

    def _verified(self, designs: RealArray) -> RobustValues:
        check = self.verification
        return verification_response(self.robust, check.n_samples, seed=check.seed)(designs)


def evaluate_sets(
    robust: Robust, catalogue: Catalogue, at_most: int, progress: Callable[[int, int, str], None]
) -> RobustValues | None:
    """Evaluate every set of parts as they are.

    Parameters
    ----------
    robust : Robust
        Of the catalogue's index.
    catalogue : Catalogue
        Its parts.
    at_most : int
        None is returned where there are more sets.
    progress : callable
        ``progress(done, total, text)``.

    Raises
    ------
    InputError
        A set that cannot be computed.
    """
    if catalogue.n_sets > at_most:
        return None
    sets = catalogue.all_sets()
    factors = np.tile(robust.space.nominal[sets.shape[1] :], (len(sets), 1))
    designs = np.hstack([sets, factors])
    parts = []
    for start in range(0, len(designs), BATCH):
        parts.append(robust(designs[start : start + BATCH]))
        progress(min(start + BATCH, len(designs)), len(designs), "sets of parts")
    values = joined(parts)
    if values.failed.any():
        raise InputError(f"the parts {catalogue.labels(sets[values.failed][0])} cannot be computed")
    return values
