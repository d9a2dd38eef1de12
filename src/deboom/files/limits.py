"""Files of limits for a mount design or a component."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from deboom.common import AXES
from deboom.compressor.acceptance import RISK, Bounds, ComponentLimits, StiffnessLimit
from deboom.errors import InputError, naming
from deboom.explore.moments import RobustLimit
from deboom.explore.robust import DesignLimits, Limit, Limits, Robust
from deboom.files.schema import (
    AtLeastOne,
    Positive,
    Several,
    Share,
    StrictModel,
    doubled,
    load_toml,
)
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.level_objectives import known_statistic, level_limits
from deboom.vehicles.limits import (
    MountRequirements,
    OperatingStiffness,
    Quantity,
    TorqueTravel,
    WeightSag,
    natural_frequencies,
    stated_powertrain,
    static_curves,
)
from deboom.vehicles.platform import Runs

G_MM, G_MM2, N_PER_MM = 1e-6, 1e-9, 1e3
"""In kg m, kg m² and N/m."""


class StaticUnbalanceEntry(StrictModel):
    """Largest static unbalance of the rotor, all sources together."""

    at_most_g_mm: Positive


class DynamicUnbalanceEntry(StrictModel):
    """Largest dynamic unbalance about the virtual point."""

    at_most_g_mm2: Positive


class _BandEntry(StrictModel):
    from_hz: Positive
    to_hz: Positive

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if self.from_hz > self.to_hz:
            raise ValueError("from_hz is above to_hz")
        return self


class StiffnessEntry(_BandEntry):
    """Window of |K| of the mounted component at the virtual point, one direction over a band."""

    direction: Literal["x", "y", "z"]
    at_least_n_per_mm: Positive | None = None
    at_most_n_per_mm: Positive | None = None


class RotationalStiffnessEntry(_BandEntry):
    """The same of a rotation."""

    direction: Literal["rx", "ry", "rz"]
    at_least_n_m_per_rad: Positive | None = None
    at_most_n_m_per_rad: Positive | None = None


class ComponentLimitsFile(StrictModel):
    """Content of a file of limits of a component.

    - `format`: 1.
    - `risk_percent`: largest probability that a part which breaks a limit passes.
    - `static_unbalance`, `dynamic_unbalance`.
    - `stiffness`, `rotational_stiffness`: arrays of tables; at least one limit in all.
    """

    format: Literal[1]
    risk_percent: Annotated[float, Field(gt=0.0, lt=50.0)] = 100 * RISK
    static_unbalance: StaticUnbalanceEntry | None = None
    dynamic_unbalance: DynamicUnbalanceEntry | None = None
    stiffness: Several[StiffnessEntry] = ()
    rotational_stiffness: Several[RotationalStiffnessEntry] = ()

    def faults(self) -> Iterator[str]:
        """Give a sentence for a file without a limit."""
        unbalance = self.static_unbalance or self.dynamic_unbalance
        if not (unbalance or self.stiffness or self.rotational_stiffness):
            yield (
                "there is no limit in it: add [static_unbalance], [dynamic_unbalance], "
                "[[stiffness]] or [[rotational_stiffness]]"
            )


def read_component_limits(path: Path) -> ComponentLimits:
    """Read a file of limits and convert it to SI.

    - raises InputError: the file is missing or no TOML; a key is unknown, missing, mistyped or out
      of range; there is no limit in it, or a stiffness without a bound.
    """
    content = load_toml(path, ComponentLimitsFile)
    static, dynamic = content.static_unbalance, content.dynamic_unbalance
    limits = [_window(path, entry, N_PER_MM) for entry in content.stiffness]
    limits += [_window(path, entry, 1.0) for entry in content.rotational_stiffness]
    return ComponentLimits(
        path,
        content.risk_percent / 100,
        None if static is None else Bounds(at_most=G_MM * static.at_most_g_mm),
        None if dynamic is None else Bounds(at_most=G_MM2 * dynamic.at_most_g_mm2),
        tuple(limits),
    )


def _window(
    path: Path, entry: StiffnessEntry | RotationalStiffnessEntry, unit: float
) -> StiffnessLimit:
    """Convert one window to SI."""
    low, high = _bounds(entry)
    least, most = -math.inf if low is None else low, math.inf if high is None else high
    with naming(f"{path}: stiffness {entry.direction}"):
        Bounds(least, most)  # a refusal states the numbers of the file
    return StiffnessLimit(
        entry.direction, (entry.from_hz, entry.to_hz), Bounds(unit * least, unit * most)
    )


def _bounds(entry: StrictModel) -> list[float | None]:
    """Lower and upper bound of an entry, whatever their unit."""
    keys = dict(entry)
    return [
        next((value for key, value in keys.items() if key.startswith(side)), None)
        for side in ("at_least_", "at_most_")
    ]


class _BoundedEntry(StrictModel):
    @model_validator(mode="after")
    def _some_bound(self) -> Self:
        low, high = _bounds(self)
        if low is None and high is None:
            raise ValueError("give a bound, at_least or at_most")
        if low is not None and high is not None and low > high:
            raise ValueError("at_least is above at_most")
        return self


class SagEntry(StrictModel):
    """How far a mount sinks under the weight of the powertrain; downward is positive."""

    mount: str
    at_most_mm: Positive


class TravelEntry(_BoundedEntry):
    """How far a direction deflects under a wheel torque, from the position under the weight."""

    direction: str
    wheel_torque_nm: float
    at_least_mm: float | None = None
    at_most_mm: float | None = None


class NaturalFrequencyEntry(_BoundedEntry):
    """Window of an undamped mode of the powertrain on its mounts, the lowest being number 1."""

    mode: Annotated[int, Field(ge=1, le=6)]
    at_least_hz: Positive | None = None
    at_most_hz: Positive | None = None


class MountStiffnessEntry(_BoundedEntry):
    """Operating |K|, mean over the band: ``EnM z`` one piece, ``z`` the sum of all that carry."""

    variable: str
    at_least_n_per_mm: Positive | None = None
    at_most_n_per_mm: Positive | None = None


class LevelEntry(StrictModel):
    """Largest level of a vehicle over the scatter of its parts; without a vehicle, of every one.

    - `vehicle`: its name.
    - `statistic`: see `deboom.vehicles.level_objectives.level_statistics`.
    - `at_most_db`: mean over the lines, or the loudest line of ``peak``; ``today``: today's design.
    """

    vehicle: str | None = None
    statistic: Annotated[str, AfterValidator(known_statistic)] = "mean"
    at_most_db: float | Literal["today"]


class LimitsFile(StrictModel):
    """Content of a file of limits.

    - `format`: 1.
    - `kept_by`: ``design``: the design itself keeps the limits; ``every part``: each of its
      tolerance draws.
    - `sag`, `travel`, `natural_frequency`, `stiffness`: limits of the mounts; `level`: limits of
      the vehicles' levels, which belong to the scatter and not to a part. Each is an array of
      tables; at least one in all.
    """

    format: Literal[1]
    kept_by: Literal["design", "every part"] = "design"
    sag: Several[SagEntry] = ()
    travel: Several[TravelEntry] = ()
    natural_frequency: Several[NaturalFrequencyEntry] = ()
    stiffness: Several[MountStiffnessEntry] = ()
    level: Several[LevelEntry] = ()

    def faults(self) -> Iterator[str]:
        """Give a sentence for a file without a limit."""
        if not (self.of_mounts or self.level):
            yield (
                "there is no limit in it: add [[sag]], [[travel]], [[natural_frequency]], "
                "[[stiffness]] or [[level]]"
            )

    @property
    def of_mounts(self) -> bool:
        """Whether a limit is one of the mounts."""
        return bool(self.sag or self.travel or self.natural_frequency or self.stiffness)


def load_limits(path: Path) -> LimitsFile:
    """Read a file of limits.

    - raises InputError: the file is missing or no TOML; a key is unknown, missing, mistyped or out
      of range; there is no limit in it.
    """
    return load_toml(path, LimitsFile)


class PartEntry(StrictModel):
    """A part number.

    - `number`: its name.
    - `places`: mounts that take it.
    - `pieces`: behind each variable of a place, such as 2 for left and right.
    - `hardness_share`, `batch_share`: of the variance, where they are not those of the file [1].
    """

    number: str
    places: AtLeastOne[str]
    pieces: Annotated[int, Field(ge=1)] = 1
    hardness_share: Share | None = None
    batch_share: Share | None = None


class ToleranceEntry(StrictModel):
    """Half width of a variable's scatter, three standard deviations, by its own value [1]."""

    variable: str
    tolerance: Annotated[float, Field(ge=0.0, lt=1.0)]


class MeasuredEntry(StrictModel):
    """Where scatter was measured.

    - `library`: mount library (SQLite), or its export as JSON; a path from the file.
    - `prior_sigma`: standard deviation that was assumed before any part was measured [1].
    - `prior_weight`: degrees of freedom that the assumption counts like.
    """

    library: str
    prior_sigma: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05
    prior_weight: Annotated[float, Field(gt=0.0)] = 4.0


class PartScatterFile(StrictModel):
    """Content of a file of parts.

    - `format`: 1.
    - `hardness_share`: share of the variance that all axes of a piece have in common [1]. Default
      is what was measured, or 0.
    - `batch_share`: share of the variance that all pieces of a batch have in common [1]. Likewise.
    - `measured`: tolerances come from there: three standard deviations.
    - `parts`, `tolerances`: part numbers; tolerances of single variables, before those that were
      measured.
    """

    format: Literal[1]
    hardness_share: Share | None = None
    batch_share: Share | None = None
    measured: MeasuredEntry | None = None
    parts: Several[PartEntry] = ()
    tolerances: Several[ToleranceEntry] = ()

    def faults(self) -> Iterator[str]:
        """Give a sentence for a part number or a variable that comes twice."""
        yield from doubled("[[parts]] have the number", [part.number for part in self.parts])
        variables = [entry.variable for entry in self.tolerances]
        yield from doubled("[[tolerances]] are of the variable", variables)


def load_parts(path: Path) -> PartScatterFile:
    """Read a file of parts.

    - raises InputError: the file is missing or no TOML; a key is unknown, missing, mistyped or out
      of range; a part number or a variable stands there twice.
    """
    return load_toml(path, PartScatterFile)


def read_level_limits(path: Path | None, model: Any) -> tuple[RobustLimit, ...]:
    """Read the limits of levels of a study.

    - `path`: see `deboom.files.limits`; None is no limit.
    - `model`: of a fleet, with ``levels``.
    - raises InputError: a file that cannot be read; a vehicle that there is not.
    """
    if path is None:
        return ()
    entries = load_limits(path).level
    with naming(path):
        return tuple(
            limit
            for entry in entries
            for limit in level_limits(model, entry.statistic, entry.at_most_db, entry.vehicle)
        )


def mount_limits(
    path: Path | None, runs: Runs, robust: Robust, factor: Factor = Factor.dynamic
) -> DesignLimits | None:
    """Read the limits of a study's mounts.

    - `path`: see `deboom.files.limits`; None is no limit, nor is a file of levels alone.
    - `runs`: platform, and the first run, whose operating stiffness counts.
    - `robust`: its draws count where every part has to keep the limits.
    - `factor`: what a stiffness factor means, for travels.
    - raises InputError: a file that cannot be read; a mount, direction or variable that there is
      not; a limit that today's design cannot be held to because a curve was not measured that far.
    """
    if path is None:
        return None
    content = load_limits(path)
    if not content.of_mounts:
        return None
    try:
        pairs = _quantities(content, runs, factor)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    requirements = MountRequirements(robust.space.names, tuple(quantity for quantity, _ in pairs))
    limits = Limits(tuple(limit for _, bounds in pairs for limit in bounds))
    nominal = requirements(robust.space.nominal[np.newaxis, :])[0]
    for name, number in zip(requirements.response_names, nominal, strict=True):
        if not np.isfinite(number):
            raise InputError(f"{path}: {name} of today's design lies beyond its measured curve")
    library = (runs.platform.library_file,) if content.sag or content.travel else ()
    every_part = robust if content.kept_by == "every part" else None
    return DesignLimits(requirements, limits, every_part, (path, *library))


def _quantities(
    content: LimitsFile, runs: Runs, factor: Factor
) -> list[tuple[Quantity, tuple[Limit, ...]]]:
    """Return what is limited with its limits, one per column."""
    carriers = [mount for mount in runs.platform.mounts if mount.carries_powertrain]
    quantities: list[tuple[Quantity, tuple[Limit, ...]]] = []
    if content.sag or content.travel:
        model = static_curves(runs)
        for sag in content.sag:
            quantity = WeightSag(model, stated_powertrain(runs), (sag.mount,))
            quantities.append((quantity, _limits(quantity, at_most=sag.at_most_mm)))
        for travel in content.travel:
            moved = TorqueTravel(model, travel.wheel_torque_nm, (travel.direction,), factor)
            quantities.append((moved, _limits(moved, travel.at_least_mm, travel.at_most_mm)))
    case = runs.cases[0][0]
    if content.natural_frequency:
        every = natural_frequencies(runs)
        for window in content.natural_frequency:
            modes = replace(every, modes=(window.mode,))
            quantities.append((modes, _limits(modes, window.at_least_hz, window.at_most_hz)))
    if content.stiffness:
        names = [name for mount in runs.platform.mounts for name in mount.variables]
        magnitude = dict(zip(names, runs.stiffness(case, runs.band).tolist(), strict=True))
        for entry in content.stiffness:
            variables = [entry.variable]
            if entry.variable in AXES:
                variables = [
                    f"{carrier.name} {entry.variable}"
                    for carrier in carriers
                    for _ in carrier.pieces
                ]
            stiff = OperatingStiffness(magnitude, {entry.variable: variables})
            quantities.append(
                (stiff, _limits(stiff, entry.at_least_n_per_mm, entry.at_most_n_per_mm))
            )
    return quantities


def _limits(
    quantity: Quantity, at_least: float | None = None, at_most: float | None = None
) -> tuple[Limit, ...]:
    low = -np.inf if at_least is None else at_least
    high = np.inf if at_most is None else at_most
    return tuple(Limit(name, quantity.unit, low, high) for name in quantity.names)
