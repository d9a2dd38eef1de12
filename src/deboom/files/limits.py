"""What a mount design or a component must keep."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

from pydantic import Field, model_validator

from deboom.compressor.acceptance import RISK, Bounds, ComponentLimits, StiffnessLimit
from deboom.errors import InputError
from deboom.files.schema import StrictModel, load_toml

Positive = Annotated[float, Field(gt=0.0)]
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
    stiffness: Annotated[tuple[StiffnessEntry, ...], Field(strict=False)] = ()
    rotational_stiffness: Annotated[tuple[RotationalStiffnessEntry, ...], Field(strict=False)] = ()


def read_component_limits(path: Path) -> ComponentLimits:
    """Read a file of limits and convert it to SI.

    - raises InputError: the file is missing or no TOML; a key is unknown, missing, mistyped or out
      of range; there is no limit in it, or a stiffness without a bound.
    """
    content = load_toml(path, ComponentLimitsFile)
    static, dynamic = content.static_unbalance, content.dynamic_unbalance
    limits = [
        _window(path, one.direction, one, one.at_least_n_per_mm, one.at_most_n_per_mm, N_PER_MM)
        for one in content.stiffness
    ]
    limits += [
        _window(path, one.direction, one, one.at_least_n_m_per_rad, one.at_most_n_m_per_rad, 1.0)
        for one in content.rotational_stiffness
    ]
    if static is None and dynamic is None and not limits:
        raise InputError(
            f"{path}: there is no limit in it: add [static_unbalance], [dynamic_unbalance], "
            "[[stiffness]] or [[rotational_stiffness]]"
        )
    return ComponentLimits(
        path,
        content.risk_percent / 100,
        None if static is None else Bounds(at_most=G_MM * static.at_most_g_mm),
        None if dynamic is None else Bounds(at_most=G_MM2 * dynamic.at_most_g_mm2),
        tuple(limits),
    )


def _window(
    path: Path,
    direction: str,
    band: _BandEntry,
    low: float | None,
    high: float | None,
    unit: float,
) -> StiffnessLimit:
    """Convert one window to SI."""
    least, most = -math.inf if low is None else low, math.inf if high is None else high
    try:
        Bounds(least, most)  # a refusal states the numbers of the file
    except InputError as error:
        raise InputError(f"{path}: stiffness {direction}: {error}") from None
    bounds = Bounds(unit * least, unit * most)
    return StiffnessLimit(direction, (band.from_hz, band.to_hz), bounds)


_Entry = TypeVar("_Entry", bound=StrictModel)


class SagEntry(StrictModel):
    """How far a mount sinks under the weight of the powertrain; downward is positive."""

    mount: str
    at_most_mm: Positive


class TravelEntry(StrictModel):
    """How far a direction deflects under a wheel torque, from the position under the weight."""

    direction: str
    wheel_torque_nm: float
    at_least_mm: float | None = None
    at_most_mm: float | None = None

    @model_validator(mode="after")
    def _some_bound(self) -> Self:
        return _bounded(self, self.at_least_mm, self.at_most_mm)


class NaturalFrequencyEntry(StrictModel):
    """Window of an undamped mode of the powertrain on its mounts, the lowest being number 1."""

    mode: Annotated[int, Field(ge=1, le=6)]
    at_least_hz: Positive | None = None
    at_most_hz: Positive | None = None

    @model_validator(mode="after")
    def _some_bound(self) -> Self:
        return _bounded(self, self.at_least_hz, self.at_most_hz)


class MountStiffnessEntry(StrictModel):
    """Mean operating stiffness of a variable, ``EnM z``, or of an axis of all mounts, ``z``."""

    variable: str
    at_least_n_per_mm: Positive | None = None
    at_most_n_per_mm: Positive | None = None

    @model_validator(mode="after")
    def _some_bound(self) -> Self:
        return _bounded(self, self.at_least_n_per_mm, self.at_most_n_per_mm)


class LimitsFile(StrictModel):
    """Content of a file of limits.

    - `format`: 1.
    - `kept_by`: ``design``: the design itself keeps the limits; ``every part``: each of its
      tolerance draws.
    - `sag`, `travel`, `natural_frequency`, `stiffness`: the limits, each an array of tables; at
      least one in all.
    """

    format: Literal[1]
    kept_by: Literal["design", "every part"] = "design"
    sag: Annotated[tuple[SagEntry, ...], Field(strict=False)] = ()
    travel: Annotated[tuple[TravelEntry, ...], Field(strict=False)] = ()
    natural_frequency: Annotated[tuple[NaturalFrequencyEntry, ...], Field(strict=False)] = ()
    stiffness: Annotated[tuple[MountStiffnessEntry, ...], Field(strict=False)] = ()


def load_limits(path: Path) -> LimitsFile:
    """Read a file of limits.

    - raises InputError: the file is missing or no TOML; a key is unknown, missing, mistyped or out
      of range; there is no limit in it.
    """
    content = load_toml(path, LimitsFile)
    if not (content.sag or content.travel or content.natural_frequency or content.stiffness):
        raise InputError(
            f"{path}: there is no limit in it: add [[sag]], [[travel]], [[natural_frequency]] or "
            "[[stiffness]]"
        )
    return content


def _bounded(entry: _Entry, low: float | None, high: float | None) -> _Entry:
    if low is None and high is None:
        raise ValueError("give a bound, at_least or at_most")
    if low is not None and high is not None and low > high:
        raise ValueError("at_least is above at_most")
    return entry


Share = Annotated[float, Field(ge=0.0, le=1.0)]


class PartEntry(StrictModel):
    """A part number.

    - `number`: its name.
    - `places`: mounts that take it.
    - `pieces`: behind each variable of a place, such as 2 for left and right.
    - `hardness_share`, `batch_share`: of the variance, where they are not those of the file [1].
    """

    number: str
    places: Annotated[tuple[str, ...], Field(strict=False, min_length=1)]
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
    parts: Annotated[tuple[PartEntry, ...], Field(strict=False)] = ()
    tolerances: Annotated[tuple[ToleranceEntry, ...], Field(strict=False)] = ()


def load_parts(path: Path) -> PartScatterFile:
    """Read a file of parts.

    - raises InputError: the file is missing or no TOML; a key is unknown, missing, mistyped or out
      of range; a part number or a variable stands there twice.
    """
    content = load_toml(path, PartScatterFile)
    for what, names in (
        ("part number", [entry.number for entry in content.parts]),
        ("tolerance of", [entry.variable for entry in content.tolerances]),
    ):
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise InputError(f"{path}: {what} '{twice[0]}' stands there twice: keep one")
    return content
