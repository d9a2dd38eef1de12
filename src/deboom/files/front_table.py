"""The front of a run as it stands in its folder: ``front.csv`` and ``convergence.csv``.

``front.csv`` has a row per design: objectives as verified and as searched, picks, and the design
variables.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.result import PICK, POINT, Front, FrontColumns
from deboom.explore.selection import ByPick
from deboom.files.tables import read_frame
from deboom.tabled import Tabled

FRONT, CONVERGENCE = "front.csv", "convergence.csv"
FILES = (FRONT, CONVERGENCE)
"""Files of a run folder that a front is read from, as far as they are there."""
CONVERGED = "converged"
"""Fact of a record whose front descents have brought to convergence."""


@dataclass(frozen=True, eq=False)
class FrontTable(Tabled):
    """A front with its designs, as a run folder keeps it.

    - `rows`: one row per design, columns ``name [unit]``.
    - `variables`: labels of the design variables, ``name [unit]``, all of them columns.
    - `convergence` (n_generations,): hypervolume of the search [product of the objectives' units];
      empty if it was not kept.
    - `converged`: whether descents have brought the whole front to convergence.
    """

    rows: pd.DataFrame
    variables: tuple[str, ...]
    convergence: RealArray
    converged: bool = False

    @classmethod
    def of(cls, front: Front) -> FrontTable:
        """Return the table of a front: what it shows, and beside it its designs."""
        designs = front.designs().drop(columns=POINT)
        rows = pd.concat([front.table, designs], axis=1)
        search = front.search
        return cls(rows, tuple(designs.columns), search.hypervolume, search.converged)

    @property
    def table(self) -> pd.DataFrame:
        """One row per design: picks, objectives, design variables."""
        return self.rows

    @property
    def columns(self) -> FrontColumns:
        """Names of the columns of the objectives.

        - raises InputError: a table without verified mean and sigma.
        """
        return FrontColumns.of_table(list(self.rows.columns))

    @property
    def designs(self) -> RealArray:
        """Designs, shape (n, k) [units of the variables]."""
        return self.rows[list(self.variables)].to_numpy(float)

    @property
    def objectives(self) -> RealArray:
        """Verified mean sum and sigma sum, shape (n, 2) [unit of the responses]."""
        columns = self.columns
        return self.rows[[columns.mean_sum, columns.sigma_sum]].to_numpy(float)

    @property
    def picks(self) -> ByPick[int]:
        """Rows by name of the pick."""
        picks: ByPick[int] = ByPick()
        for row, names in enumerate(self.pick_names):
            for name in filter(None, names.split(" = ")):
                picks[name] = row
        return picks

    @property
    def pick_names(self) -> list[str]:
        """Picks of each design, such as ``best-mean = none-louder``; mostly empty."""
        return list(self.rows[PICK]) if PICK in self.rows else [""] * len(self.rows)

    @classmethod
    def read(cls, folder: Path, *, converged: bool = False) -> FrontTable:
        """Read the front of a run folder, whose record says whether it has converged.

        - raises InputError: a file that is missing or no table, or no design variables.
        """
        rows = read_frame(folder / FRONT, (PICK,))
        variables = FrontColumns.variables(list(rows.columns))
        if not variables:
            raise InputError(
                f"{folder / FRONT} has no design variables, columns such as 'TSM x [1]': run the "
                "study again"
            )
        if PICK in rows:
            rows[PICK] = rows[PICK].fillna("")
        path = folder / CONVERGENCE
        kept = read_frame(path).iloc[:, -1].to_numpy(float) if path.is_file() else np.empty(0)
        return cls(rows, variables, kept, converged)


def facts_of(front: Front) -> dict[str, str]:
    """Return what a record says of a front beside its tables."""
    return {CONVERGED: "the whole front, by descents"} if front.search.converged else {}


def tables_of(front: Front) -> dict[str, pd.DataFrame]:
    """Return the tables of a front that a run folder keeps, by the stem of their file."""
    volume = front.search.hypervolume
    generation = np.arange(1, len(volume) + 1)
    convergence = pd.DataFrame({"generation": generation, front.hypervolume_label: volume})
    return {"front": FrontTable.of(front).rows, "convergence": convergence}
