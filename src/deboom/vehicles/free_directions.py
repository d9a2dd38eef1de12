"""Demands on each direction of a design, judged in the vehicle with the largest effect."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray, checked_array
from deboom.errors import InputError
from deboom.explore.space import DesignSpace, checked_designs
from deboom.measurement.booming_peaks import compare_peaks
from deboom.vehicles.booming_model import BoomingModel

NOTICEABLE = 0.1
"""Change of the mean level of the lines, or of a booming peak, that counts as noticeable [dB]."""
SCANNED = 21
"""Values of each direction that are tried over its range, and again about the end of it."""
BETWEEN = 41
"""Values between the design and the end of an interval at which it is held again."""


class Need(Enum):
    """What is asked of a direction."""

    wanted = "as chosen"
    """Today's part would be heard: it lies outside the range without an audible difference."""
    today = "as today"
    """Today's part will do, but not any part of the range."""
    anything = "any in bounds"
    nothing = "no requirement"
    unknown = "not identified"


@dataclass(frozen=True, eq=False)
class DirectionFreedom:
    """How far each direction may move alone before a vehicle changes noticeably.

    - `names` (k,): variables.
    - `vehicles` (v,): names.
    - `amount`: change that counts as noticeable [dB].
    - `today` (k,): today's design [1].
    - `searched` (k, 2): range that was tried, scatter of the parts included [1].
    - `interval` (k, 2): range about the design within which nothing moves by `amount` [1].
    - `move` (k, v): largest change anywhere in the range, of the mean level or of a peak [dB].
    - `without_effect`: names of variables that no vehicle depends on.
    """

    names: tuple[str, ...]
    vehicles: tuple[str, ...]
    amount: float
    today: RealArray
    searched: RealArray
    interval: RealArray
    move: RealArray
    without_effect: tuple[str, ...]

    @property
    def free(self) -> BoolArray:
        """Directions that move no vehicle noticeably anywhere in their range, shape (k,)."""
        return np.asarray(np.all(self.move <= self.amount, axis=1))

    @property
    def needs(self) -> tuple[Need, ...]:
        """What is asked of each direction, as far as the vehicles decide it."""
        low, high = self.interval.T
        todays = (low <= self.today) & (self.today <= high)
        return tuple(
            Need.nothing
            if name in self.without_effect
            else Need.anything
            if free
            else Need.today
            if kept
            else Need.wanted
            for name, free, kept in zip(self.names, self.free, todays, strict=True)
        )

    def with_todays_parts(self, design: RealArray) -> RealArray:
        """Return a design (k,) with today's part in each direction in which it does as well."""
        as_well = [need is not Need.wanted for need in self.needs]
        return np.where(as_well, self.today, design)

    @property
    def sentence(self) -> str:
        """What the ranges mean, in words."""
        return (
            f"each direction alone, no vehicle's mean level and no booming peak moves by more than "
            f"{self.amount:g} dB"
        )


def free_directions(
    model: BoomingModel,
    design: npt.ArrayLike,
    space: DesignSpace,
    *,
    without_effect: Collection[str] = (),
    amount: float = NOTICEABLE,
) -> DirectionFreedom:
    """Return how far each direction may move alone before any vehicle changes noticeably.

    Parameters
    ----------
    model : BoomingModel
        Its vehicles and load cases are all judged.
    design : array_like, shape (k,)
        Where the other directions stay [1].
    space : DesignSpace
        Bounds, and the tolerance by which a part may lie beyond them.
    without_effect : collection of str
        Variables that are known to move nothing, see `variables_without_effect`.
    amount : float
        Change that counts as noticeable, above 0 [dB].

    Returns
    -------
    DirectionFreedom

    Raises
    ------
    InputError
        A design of another size or with a level that is not finite; no positive amount.

    Notes
    -----
    Judged is the vehicle, or the seat or wheel, that moves most, by the mean level of its lines
    over all load cases, by its booming peaks in each and by its level at idle: a mean over vehicles
    hides that one gains what another loses. Between two of the `SCANNED` values a curve may pass
    them by an eighth of its second difference, which is added to the change. Where a direction is
    not free, the range between the design and the end is judged again on `BETWEEN` values, and the
    nearest crossing is the end. Other directions stay at the design: several that are free may add
    up.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> model = deboom.read_platform("u06").model(vehicles="U06", motion="prescribed")
    >>> space = model.design_space(bounds=0.2)
    >>> freedom = free_directions(model, np.ones(12), space)
    >>> [name for name, free in zip(freedom.names, freedom.free) if not free]
    ['EnM x', 'EnM z', 'GeM x', 'GeM z', 'TSM x', 'TSM z', 'Du x']
    """
    if not amount > 0.0:
        raise InputError(f"a noticeable change of {amount:g} dB: give one above 0")
    names, vehicles = model.variable_names, model.response_names
    base = checked_array(design, "k", "the design", {"k": len(names)})
    lower = np.minimum(space.lower * (1.0 - space.tolerance), base)
    upper = np.maximum(space.upper * (1.0 + space.tolerance), base)
    interval = np.column_stack([base, base])
    move = np.zeros((len(names), len(vehicles)))
    for column, name in enumerate(names):
        if name in without_effect or not upper[column] > lower[column]:
            interval[column] = lower[column], upper[column]
            continue
        line = _Line(model, base, column)
        values = np.unique(
            np.append(np.linspace(lower[column], upper[column], SCANNED), base[column])
        )
        start = int(np.searchsorted(values, base[column]))
        changes = line.changes(values)
        move[column] = changes.max(axis=0)
        worst = changes.max(axis=1)
        if np.all(move[column] <= amount):
            interval[column] = lower[column], upper[column]
        else:
            interval[column, 0] = line.end(values[start::-1], worst[start::-1], amount)
            interval[column, 1] = line.end(values[start:], worst[start:], amount)
    return DirectionFreedom(
        names=names,
        vehicles=vehicles,
        amount=amount,
        today=space.nominal,
        searched=np.column_stack([lower, upper]),
        interval=interval,
        move=move,
        without_effect=tuple(without_effect),
    )


def largest_changes(model: BoomingModel, designs: npt.ArrayLike, base: RealArray) -> RealArray:
    """Return how much designs change each vehicle: its mean level or a peak, whichever more.

    Parameters
    ----------
    model : BoomingModel
    designs : array_like, shape (n, k)
        [1].
    base : array, shape (k,)
        Design that they are compared with [1].

    Returns
    -------
    array, shape (n, v)
        Largest magnitude of the changes of the mean level of the lines, over all load cases, of
        the level at idle and of the booming peaks of each load case; infinite where a level is not
        finite [dB].

    Raises
    ------
    InputError
        Designs of another shape; a base with a level that is not finite.
    """
    rows = np.vstack([base, checked_designs(designs, model.variable_names)])
    levels = model(rows) / model.n_lines
    changes = np.abs(levels[1:] - levels[0])
    for idle in getattr(model, "idle", ()):
        at_idle = idle(rows)
        changes = np.maximum(changes, np.abs(at_idle[1:] - at_idle[0]))
    for load_case in model.load_case_names:
        curves = model.levels(rows, load_case)
        if not np.isfinite(curves[0]).all():
            raise InputError(f"a level of the design is not finite in load case {load_case}")
        for (row, vehicle), change in np.ndenumerate(changes):
            after = curves[row + 1, vehicle]
            if not np.isfinite(after).all():
                changes[row, vehicle] = np.inf
                continue
            peaks = compare_peaks(curves[0, vehicle], after, model.frequency, 1.0)
            moved = (abs(peak.change) for peak in peaks)
            changes[row, vehicle] = max(change, *moved) if peaks else change
    return np.asarray(np.nan_to_num(changes, nan=np.inf))


@dataclass(frozen=True, eq=False)
class _Line:
    """Designs that differ in one variable: the model, the design and the variable's place."""

    model: BoomingModel
    base: RealArray
    column: int

    def changes(self, values: RealArray) -> RealArray:
        """Largest change of each vehicle at or about values (n,), which are in order: (n, v)."""
        rows = np.tile(self.base, (len(values), 1))
        rows[:, self.column] = values
        changes = largest_changes(self.model, rows, self.base)
        passed = np.array(changes)
        with np.errstate(invalid="ignore"):
            second = np.abs(changes[2:] - 2.0 * changes[1:-1] + changes[:-2]) / 8.0
        passed[1:-1] += np.nan_to_num(second, nan=np.inf)
        passed[values == self.base[self.column]] = 0.0
        return passed

    def end(self, values: RealArray, worst: RealArray, amount: float) -> float:
        """How far along `values`, which lead away from the design, `worst` stays below `amount`.

        A booming peak that appears, or finds another partner, makes a step: the end is a value that
        was judged, and what lies between it and the design is judged again on closer values.
        """
        end = float(values[-1])
        while True:
            beyond = np.flatnonzero(~(worst < amount))
            if beyond.size:
                values = np.linspace(values[beyond[0] - 1], values[beyond[0]], SCANNED)
                worst = self.changes(values).max(axis=1)
                near = np.flatnonzero(~(worst < amount))
                end = float(values[near[0] - 1 if near.size else -1])
            values = np.linspace(self.base[self.column], end, BETWEEN)
            worst = self.changes(values).max(axis=1)
            if np.all(worst < amount):
                return end
