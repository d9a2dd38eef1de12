"""Files of limits of a design: what mounts must carry, and how loud vehicles may be.

A kind of limit is one class: `limit_kind` makes it an array of tables of the file.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, create_model, model_validator

from deboom.arrays import AXES
from deboom.errors import InputError, naming
from deboom.explore.moments import Limit, Objective
from deboom.explore.robust import numbers_of_designs
from deboom.explore.space import DesignSpace
from deboom.files.limits import bounds_of
from deboom.files.schema import Positive, Several, StrictModel, load_toml
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.level_objectives import known_statistic, level_limits
from deboom.vehicles.limits import (
    MountRequirements,
    NaturalFrequencies,
    OperatingStiffness,
    Quantity,
    TorqueTravel,
    WeightSag,
    natural_frequencies,
    stated_powertrain,
    static_curves,
)
from deboom.vehicles.platform import Runs
from deboom.vehicles.powertrain import KinematicModel


@dataclass(frozen=True, eq=False)
class LimitedMounts:
    """The mounts whose quantities are limited; what several limits need is computed once.

    - `runs`: platform, and the first run, whose operating stiffness counts.
    - `factor`: what a stiffness factor means, for travels.
    """

    runs: Runs
    factor: Factor

    @cached_property
    def curves(self) -> KinematicModel:
        """Static curves of the mounts; InputError without any."""
        return static_curves(self.runs)

    @cached_property
    def modes(self) -> NaturalFrequencies:
        """All rigid-body modes of the powertrain; InputError without its mass."""
        return natural_frequencies(self.runs)

    @cached_property
    def stiffness(self) -> Mapping[str, float]:
        """Operating |K| of one piece by variable [N/m]."""
        names = [name for mount in self.runs.platform.mounts for name in mount.variables]
        values = self.runs.stiffness(self.runs.cases[0][0], self.runs.band)
        return dict(zip(names, values.tolist(), strict=True))


class LimitEntry(StrictModel):
    """A table of the file: keys of its own, and ``at_least_UNIT`` or ``at_most_UNIT`` or both."""

    needs_library: ClassVar[bool] = False
    """Whether the quantity follows from the static curves of the mount library."""

    @model_validator(mode="after")
    def _some_bound(self) -> Self:
        low, high = bounds_of(self)
        if low is None and high is None:
            raise ValueError("give a bound, at_least or at_most")
        if low is not None and high is not None and low > high:
            raise ValueError("at_least is above at_most")
        return self

    @abstractmethod
    def quantity(self, mounts: LimitedMounts) -> Quantity:
        """Return the number that is limited, in the unit of the bounds.

        - raises InputError: there is no such number.
        """

    def limits(self, number: Objective, source: str, *, every_part: bool) -> Iterator[Limit]:
        """Give the limit of a number, or one for each bound that every part keeps.

        - `source`: who states it.
        """
        low, high = bounds_of(self)
        low, high = -np.inf if low is None else low, np.inf if high is None else high
        if not every_part:
            yield Limit(number, low, high, source)
            return
        if np.isfinite(low):
            smallest = replace(number, statistic="smallest")
            yield Limit(smallest, at_least=low, source=source)
        if np.isfinite(high):
            largest = replace(number, statistic="largest")
            yield Limit(largest, at_most=high, source=source)


LIMIT_KINDS: dict[str, type[LimitEntry]] = {}
"""Kinds of limits of mounts, by the name of their array of tables."""
_Entry = TypeVar("_Entry", bound=LimitEntry)


def limit_kind(name: str) -> Callable[[type[_Entry]], type[_Entry]]:
    """Return a decorator that makes an entry a kind of limit, ``[[name]]`` of the file."""

    def registered(entry: type[_Entry]) -> type[_Entry]:
        LIMIT_KINDS[name] = entry
        return entry

    return registered


@limit_kind("sag")
class SagEntry(LimitEntry):
    """How far a mount sinks under the weight of the powertrain; downward is positive."""

    needs_library: ClassVar[bool] = True
    mount: str
    at_most_mm: Positive

    def quantity(self, mounts: LimitedMounts) -> Quantity:
        """Return the sag; InputError without curves, mass or such a mount."""
        return WeightSag(mounts.curves, stated_powertrain(mounts.runs), (self.mount,))


@limit_kind("travel")
class TravelEntry(LimitEntry):
    """How far a direction deflects under a wheel torque, from the position under the weight."""

    needs_library: ClassVar[bool] = True
    direction: str
    wheel_torque_nm: float
    at_least_mm: float | None = None
    at_most_mm: float | None = None

    def quantity(self, mounts: LimitedMounts) -> Quantity:
        """Return the travel; InputError without curves or such a direction."""
        return TorqueTravel(mounts.curves, self.wheel_torque_nm, (self.direction,), mounts.factor)


@limit_kind("natural_frequency")
class NaturalFrequencyEntry(LimitEntry):
    """Window of an undamped mode of the powertrain on its mounts, the lowest being number 1."""

    mode: Annotated[int, Field(ge=1, le=6)]
    at_least_hz: Positive | None = None
    at_most_hz: Positive | None = None

    def quantity(self, mounts: LimitedMounts) -> Quantity:
        """Return the natural frequency; InputError without mass or a stiffness."""
        return replace(mounts.modes, modes=(self.mode,))


@limit_kind("stiffness")
class MountStiffnessEntry(LimitEntry):
    """Operating |K|, mean over the band: ``EnM z`` one piece, ``z`` the sum of all that carry."""

    variable: str
    at_least_n_per_mm: Positive | None = None
    at_most_n_per_mm: Positive | None = None

    def quantity(self, mounts: LimitedMounts) -> Quantity:
        """Return the stiffness; InputError for a variable that was not measured."""
        variables = [self.variable]
        if self.variable in AXES:
            variables = [
                f"{mount.name} {self.variable}"
                for mount in mounts.runs.platform.mounts
                if mount.carries_powertrain
                for _ in mount.pieces
            ]
        return OperatingStiffness(mounts.stiffness, {self.variable: variables})


class LevelEntry(StrictModel):
    """Largest level of a vehicle over the scatter of its parts; without a vehicle, of every one.

    - `vehicle`: its name, or that of another receiver, such as ``U06-1, seat rail z``.
    - `statistic`: see `deboom.vehicles.level_objectives.level_statistics`.
    - `at_most_db`: mean over the lines, the loudest line of ``peak``, or all orders of ``idle``;
      ``today``: today's design; ``target``: `target_db` of the receiver.
    """

    vehicle: str | None = None
    statistic: Annotated[str, AfterValidator(known_statistic)] = "mean"
    at_most_db: float | Literal["today", "target"]


class LimitsFile(StrictModel):
    """Content of a file of limits, beside an array of tables for each of `LIMIT_KINDS`.

    - `format`: 1.
    - `kept_by`: ``design``: the design itself keeps the limits; ``every part``: each of its
      tolerance draws.
    - `level`: limits of the vehicles' levels, which belong to the scatter and not to a part.

    At least one limit in all.
    """

    format: Literal[1]
    kept_by: Literal["design", "every part"] = "design"
    level: Several[LevelEntry] = ()

    def faults(self) -> Iterator[str]:
        """Give a sentence for a file without a limit."""
        if not (self.of_mounts or self.level):
            kinds = ", ".join(f"[[{name}]]" for name in LIMIT_KINDS)
            yield f"there is no limit in it: add {kinds} or [[level]]"

    @property
    def of_mounts(self) -> Sequence[tuple[str, LimitEntry]]:
        """Limits of the mounts, with their place in the file, such as ``[[sag]] 1``."""
        return [
            (f"[[{name}]] {number}", entry)
            for name in LIMIT_KINDS
            for number, entry in enumerate(getattr(self, name), 1)
        ]


def load_limits(path: Path) -> LimitsFile:
    """Read a file of limits.

    - raises InputError: the file is missing or no TOML; a key is unknown, missing, mistyped or out
      of range; there is no limit in it.
    """
    tables: dict[str, Any] = {name: (Several[entry], ()) for name, entry in LIMIT_KINDS.items()}  # type: ignore[valid-type]
    return load_toml(path, create_model("LimitsFile", __base__=LimitsFile, **tables))


def read_level_limits(path: Path | None, model: Any) -> tuple[Limit, ...]:
    """Read the limits of levels of a study.

    - `path`: see `LimitsFile`; None is no limit.
    - `model`: of a fleet, with ``levels``.
    - raises InputError: a file that cannot be read; a vehicle that there is not.
    """
    if path is None:
        return ()
    limits: list[Limit] = []
    for number, entry in enumerate(load_limits(path).level, 1):
        item = f"[[level]] {number}"
        with naming(f"{path}: {item}"):
            limits += level_limits(
                model,
                entry.statistic,
                entry.at_most_db,
                entry.vehicle,
                source=f"{path.name}, {item}",
            )
    return tuple(limits)


def read_mount_limits(
    path: Path | None, runs: Runs, space: DesignSpace, factor: Factor = Factor.dynamic
) -> tuple[Limit, ...]:
    """Read the limits of a study's mounts.

    - `path`: see `LimitsFile`; None is no limit.
    - `runs`: platform, and the first run, whose operating stiffness counts.
    - `space`: of the designs.
    - `factor`: what a stiffness factor means, for travels.
    - raises InputError: a file that cannot be read; a mount, direction or variable that there is
      not; a limit that today's design cannot be held to because a curve was not measured that far.
    """
    if path is None:
        return ()
    content, mounts = load_limits(path), LimitedMounts(runs, factor)
    limits: list[Limit] = []
    for item, entry in content.of_mounts:
        with naming(f"{path}: {item}"):
            number = number_of_design(entry.quantity(mounts), space)
            every_part = content.kept_by == "every part"
            limits += entry.limits(number, f"{path.name}, {item}", every_part=every_part)
    return tuple(limits)


def number_of_design(quantity: Quantity, space: DesignSpace) -> Objective:
    """Return a quantity of the mounts as a number of a design.

    - raises InputError: today's design lies beyond a measured curve.
    """
    number = Objective(
        "nominal", response=MountRequirements(space.names, (quantity,)), unit=quantity.unit
    )
    if not np.isfinite(numbers_of_designs([number], space.nominal[np.newaxis])).all():
        raise InputError(f"{number.name} of today's design lies beyond its measured curve")
    return number


def files_of_limits(path: Path | None, runs: Runs) -> tuple[Path, ...]:
    """Return the files that limits come from: perhaps the mount library, too."""
    if path is None:
        return ()
    needs_library = any(entry.needs_library for _, entry in load_limits(path).of_mounts)
    return (path, runs.platform.library_file) if needs_library else (path,)
