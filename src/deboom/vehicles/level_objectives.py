"""Levels of single vehicles, or of the worst one, as objectives and limits of a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.moments import STATISTICS, Limit, Objective
from deboom.explore.space import units_of
from deboom.vehicles.fleet_front import load_cases_of, sound_rows

TAIL = 0.95
"""Share of all parts below the quantile, and above which the worst parts are [1]."""


@dataclass(frozen=True, eq=False)
class LoudestLine:
    """SPL of the loudest line of vehicles, over all load cases.

    - `model`: with ``frequency`` and ``levels``.
    - `vehicles`: some of its vehicles.
    """

    model: Any
    vehicles: tuple[str, ...]

    quantity = "loudest line"
    smooth = False

    @property
    def response_unit(self) -> str:
        """Unit of the levels of these vehicles."""
        unit_of = dict(zip(self.model.response_names, level_units(self.model), strict=True))
        return ", ".join(dict.fromkeys(unit_of[vehicle] for vehicle in self.vehicles))

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Those of the model."""
        return tuple(self.model.variable_names)

    @property
    def response_names(self) -> tuple[str, ...]:
        """The vehicles."""
        return self.vehicles

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the SPL of designs (n, k), shape (n, v) [dB(A)]."""
        names = list(self.model.response_names)
        rows = [names.index(vehicle) for vehicle in self.vehicles]
        cases = [
            np.asarray(self.model.levels(designs, case))[:, rows].max(axis=2)
            for case in load_cases_of(self.model)
        ]
        return np.asarray(np.max(cases, axis=0))


@dataclass(frozen=True, eq=False)
class IdleLevel:
    """Level of receivers at idle, all orders together; of several idle runs the largest.

    - `model`: with ``idle``, see `deboom.vehicles.idle.IdleModel`.
    - `receivers`: some of its responses.
    """

    model: Any
    receivers: tuple[str, ...]

    quantity = "level at idle"

    @property
    def smooth(self) -> bool:
        """Whether it has derivatives: the largest of several runs has none."""
        return len(self.model.idle) == 1

    @property
    def response_unit(self) -> str:
        """Unit of the levels of these receivers."""
        unit_of = dict(zip(self.model.response_names, level_units(self.model), strict=True))
        return ", ".join(dict.fromkeys(unit_of[name] for name in self.receivers))

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Those of the model."""
        return tuple(self.model.variable_names)

    @property
    def response_names(self) -> tuple[str, ...]:
        """The receivers."""
        return self.receivers

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the level of designs (n, k), shape (n, v) [`response_unit`]."""
        names = list(self.model.response_names)
        rows = [names.index(name) for name in self.receivers]
        return np.asarray(np.max([idle(designs)[:, rows] for idle in self.model.idle], axis=0))


def level_units(model: Any) -> tuple[str, ...]:
    """Return the unit of the level of each response of a model."""
    return units_of(model.response_names, model.response_unit)


def ears_of(model: Any) -> tuple[str, ...]:
    """Return the responses that are sounds: the worst vehicle is one of these."""
    return tuple(model.response_names[row] for row in sound_rows(model))


PEAK = "peak"
"""Name of the mean of the loudest line, in options and files of limits."""
IDLE = "idle"
"""Name of the mean of the level at idle there."""


def level_statistics() -> dict[str, str]:
    """Return the statistic of a vehicle's level behind each name in options and files of limits.

    Those of `deboom.explore.moments.STATISTICS`, which all but `PEAK` and `IDLE` are of SPLV.
    """
    names = {
        statistic.short or name: name
        for name, statistic in STATISTICS.items()
        if statistic.is_estimate and not statistic.takes_level
    }
    return {**names, PEAK: "mean", IDLE: "mean"}


def known_statistic(name: str) -> str:
    """Return the name of a level's statistic.

    - raises ValueError: there is none of that name.
    """
    if name not in level_statistics():
        raise ValueError(f"'{name}' is no statistic: take one of {', '.join(level_statistics())}")
    return name


def level_objective(model: Any, statistic: str, vehicle: str | None = None) -> Objective:
    """Return a number of a vehicle's level over its scatter, to be minimised or limited.

    The peak is the mean of the loudest line, and that of idle the mean of the level of all orders;
    all others are of SPLV, the sum over the lines [unit of the response].

    - `model`: of a fleet, with ``levels``.
    - `statistic`: one of `level_statistics`.
    - `vehicle`: its name, or that of another receiver, such as ``U06-1, seat rail z``; None: the
      worst ear.
    - raises InputError: no such statistic or vehicle; a level at idle of no run, or of no receiver.
    """
    vehicles = tuple(model.response_names)
    if vehicle is not None and vehicle not in vehicles:
        raise InputError(f"there is no vehicle '{vehicle}': use one of {', '.join(vehicles)}")
    try:
        of_levels = level_statistics()[known_statistic(statistic)]
    except ValueError as error:
        raise InputError(str(error)) from None
    plain = Objective(of_levels, worst=vehicle is None, share=TAIL)
    name, whose = plain.name.partition(",")[0], vehicle or "worst vehicle"
    if statistic == IDLE:
        _refuse_no_idle(model)
        if vehicle is None:
            raise InputError(
                "levels at idle of ears, seats and wheels are not compared: name the receiver, "
                f"such as '{vehicles[-1]}'"
            )
        idle = IdleLevel(model, (vehicle,))
        return replace(plain, response=idle, label=f"{name} of the level at idle, {whose}")
    if statistic == PEAK:
        line = LoudestLine(model, ears_of(model) if vehicle is None else (vehicle,))
        return replace(plain, response=line, label=f"{name} of the loudest line, {whose}")
    unit = "" if plain.rule.is_level else "dB"
    return replace(plain, response=vehicle, unit=unit, label=f"{name} of SPLV, {whose}")


def _refuse_no_idle(model: Any) -> None:
    if not getattr(model, "idle", ()):
        raise InputError(
            'there is no level at idle: state a load case with kind = "idle" in platform.toml, and '
            "take coupled or prescribed motion with --factor dynamic"
        )


TARGET = "target"
"""A bound that is the target of its receiver."""


def _targets(model: Any) -> dict[str, float]:
    """Return the target of each response that has one, of a model of any kind [its unit]."""
    receivers = getattr(model, "receivers", ())
    pairs = zip(model.response_names, receivers, strict=False)
    return {name: each.target for name, each in pairs if each.target is not None}


def level_limits(
    model: Any,
    statistic: str,
    at_most: float | str,
    vehicle: str | None = None,
    *,
    source: str = "",
) -> tuple[Limit, ...]:
    """Return the limits that a vehicle, or every vehicle, keeps a level.

    - `at_most`: mean over the lines, or the loudest line [unit of the response; dB of sigma];
      ``"today"``: each vehicle's own of today's design; ``"target"``: that of the receiver.
    - `vehicle`: its name, or that of another receiver; None: every ear, or every receiver that has
      a target; at idle, every seat and wheel.
    - `source`: who states the limits, such as a file and the place in it.
    - raises InputError: as `level_objective`; a bound of another text.
    """
    if at_most == TARGET and statistic == IDLE:
        raise InputError(
            "the target of a receiver is a mean level over lines, not one at idle: state "
            'at_most_db in dB, or "today"'
        )
    if at_most == TARGET:
        targets = _targets(model)
        names = targets if vehicle is None else [vehicle]
        if not targets or any(name not in targets for name in names):
            raise InputError(
                f"{vehicle or 'no receiver'} has {'no' if vehicle else 'a'} target: state its "
                "target_db in platform.toml, or at_most_db in dB"
            )
        return tuple(
            limit
            for name in names
            for limit in level_limits(model, statistic, targets[name], name, source=source)
        )
    of_each: Sequence[str | None] = [vehicle]
    if vehicle is None and isinstance(at_most, str):
        ears = ears_of(model)
        felt = [name for name in model.response_names if name not in ears]
        of_each = (felt or ears) if statistic == IDLE else ears
    numbers = [level_objective(model, statistic, name) for name in of_each]
    n_lines = 1
    if statistic not in (PEAK, IDLE):
        n_lines = model.n_lines
        words = f"SPLV over {n_lines} lines"  # so that the bound can be told from the stated one
        numbers = [replace(each, label=each.label.replace("SPLV", words)) for each in numbers]
    bound = at_most if isinstance(at_most, str) else n_lines * at_most
    return tuple(Limit(number, at_most=bound, source=source, n_lines=n_lines) for number in numbers)
