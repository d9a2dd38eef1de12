"""What a component must keep to be accepted, from a TOML file whose keys carry their units."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from deboom.compressor.acceptance import RISK, Bounds
from deboom.compressor.component_limits import ComponentLimits, StiffnessLimit
from deboom.errors import InputError
from deboom.files.strict_toml import StrictModel, load_toml

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

    Parameters
    ----------
    format : int
        1.
    risk_percent : float
        Largest probability that a part which breaks a limit passes.
    static_unbalance, dynamic_unbalance : section, optional
    stiffness, rotational_stiffness : tuple
        Arrays of tables; at least one limit in all.
    """

    format: Literal[1]
    risk_percent: Annotated[float, Field(gt=0.0, lt=50.0)] = 100 * RISK
    static_unbalance: StaticUnbalanceEntry | None = None
    dynamic_unbalance: DynamicUnbalanceEntry | None = None
    stiffness: Annotated[tuple[StiffnessEntry, ...], Field(strict=False)] = ()
    rotational_stiffness: Annotated[tuple[RotationalStiffnessEntry, ...], Field(strict=False)] = ()


def read_component_limits(path: Path) -> ComponentLimits:
    """Read a file of limits and convert it to SI.

    Raises
    ------
    InputError
        The file is missing or no TOML; a key is unknown, missing, mistyped or out of range; there
        is no limit in it, or a stiffness without a bound.
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
    try:
        Bounds(low, high)  # a refusal states the numbers of the file
    except InputError as error:
        raise InputError(f"{path}: stiffness {direction}: {error}") from None
    bounds = Bounds(None if low is None else unit * low, None if high is None else unit * high)
    return StiffnessLimit(direction, (band.from_hz, band.to_hz), bounds)
