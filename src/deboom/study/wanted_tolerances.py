"""What a user says of wanted tolerances: the target, and the prices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.tolerance_curves import (
    CostCurve,
    CostCurves,
    TabulatedCurve,
    reciprocal_curves,
)
from deboom.files.table_cells import read_rows
from deboom.study.tolerance_cost import tolerance_cost


@dataclass(frozen=True, eq=False)
class WantedTarget:
    """What a user asks of the scatter.

    Parameters
    ----------
    sigma : float or None
        Standard deviation of the mean level, mean over the vehicles [dB]; None: today's.
    limit : sequence of str or None
        Largest mean level of a vehicle's lines: ``52.5`` or ``U06-1=52.5`` [dB(A)], or ``+0.5``
        above that of the design without scatter [dB]. With limits the target is a share of
        parts × vehicles within them, and `sigma` stays None.
    share : float
        That share [1].

    Raises
    ------
    InputError
        Both a sigma and a limit.
    """

    sigma: float | None = None
    limit: Sequence[str] | None = None
    share: float = 0.95

    def __post_init__(self) -> None:
        if self.sigma is not None and self.limit:
            raise InputError("give either --sigma or --limit, not both")

    def limits(self, vehicles: Sequence[str], levels: RealArray) -> RealArray:
        """Return the limit of each vehicle, shape (r,) [dB(A)], from its own level (r,).

        Raises
        ------
        InputError
            An unknown vehicle, one without a limit or with two, or no number.
        """
        found: dict[str, float] = {}
        for text in self.limit or ():
            name, has_name, number = text.rpartition("=")
            try:
                value = float(number)
            except ValueError:
                value = np.nan
            if not np.isfinite(value) or (has_name and name not in vehicles):
                raise InputError(
                    f"limit '{text}': write a level in dB(A), +dB above the design's own, or "
                    f"vehicle=level with one of {', '.join(vehicles)}"
                )
            for vehicle, level in zip(vehicles, levels, strict=True):
                if has_name and vehicle != name:
                    continue
                if vehicle in found:
                    raise InputError(f"limit '{text}': {vehicle} has one already, give it one")
                found[vehicle] = value + float(level) * number.startswith("+")
        missing = [vehicle for vehicle in vehicles if vehicle not in found]
        if missing:
            raise InputError(f"there is no limit of {', '.join(missing)}: give every vehicle one")
        return np.array([found[vehicle] for vehicle in vehicles])


def cost_curves(
    table: Path | None, points: Path | None, variables: Sequence[str]
) -> tuple[CostCurves, tuple[Path, ...]]:
    """Return the prices of tolerances, and the files they were read from.

    Parameters
    ----------
    table : Path or None
        As for `deboom.study.tolerance_cost.tolerance_cost`: a reciprocal law per variable.
    points : Path or None
        Table with the columns ``variable, tolerance, cost``, at least two rows for each of some
        variables, whose law these points replace.
    variables : sequence of str
        All that scatter.

    Raises
    ------
    InputError
        A table that cannot be read, an unknown variable, a price that rises with the width.
    """
    curves: dict[str, CostCurve] = {
        curve.name: curve
        for curve in reciprocal_curves(variables, tolerance_cost(table, variables)).curves
    }
    known: dict[str, list[tuple[float, float]]] = {}
    if points is not None:
        for row in read_rows(points, ("variable", "tolerance", "cost"), {}):
            name = row.filled("variable")
            if name not in curves:
                raise row.error(f"'{name}' is none of {list(variables)}")
            known.setdefault(name, []).append((row.number("tolerance"), row.number("cost")))
    for name, pairs in known.items():
        try:
            curves[name] = TabulatedCurve(name, *np.array(pairs).T)
        except InputError as error:
            raise InputError(f"{points}: {error}") from None
    files = tuple(path for path in (table, points) if path is not None)
    return CostCurves(tuple(curves.values())), files
