"""Files of limits of a component, and of how parts scatter."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from deboom.compressor.acceptance import RISK, Bounds, ComponentLimits, StiffnessLimit
from deboom.errors import naming
from deboom.files.schema import (
    AtLeastOne,
    Positive,
    Several,
    Share,
    StrictModel,
    doubled,
    load_toml,
)
from deboom.physics.dynamic_stiffness import N_PER_MM

G_MM, G_MM2 = 1e-6, 1e-9
"""In kg m and kg m²."""


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
    limits = [_window(path, entry, 1.0 / N_PER_MM) for entry in content.stiffness]
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
    low, high = bounds_of(entry)
    least, most = -math.inf if low is None else low, math.inf if high is None else high
    with naming(f"{path}: stiffness {entry.direction}"):
        Bounds(least, most)  # a refusal states the numbers of the file
    return StiffnessLimit(
        entry.direction, (entry.from_hz, entry.to_hz), Bounds(unit * least, unit * most)
    )


def bounds_of(entry: StrictModel) -> list[float | None]:
    """Lower and upper bound of an entry, whatever their unit."""
    keys = dict(entry)
    return [
        next((value for key, value in keys.items() if key.startswith(side)), None)
        for side in ("at_least_", "at_most_")
    ]


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
