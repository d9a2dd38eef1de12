"""What a mount design must keep, from a TOML file with strict keys that carry their units."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

from pydantic import Field, model_validator

from deboom.errors import InputError
from deboom.files.strict_toml import StrictModel, load_toml

Positive = Annotated[float, Field(gt=0.0)]
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


class StiffnessEntry(StrictModel):
    """Mean operating stiffness of a variable, ``EnM z``, or of an axis of all mounts, ``z``."""

    variable: str
    at_least_n_per_mm: Positive | None = None
    at_most_n_per_mm: Positive | None = None

    @model_validator(mode="after")
    def _some_bound(self) -> Self:
        return _bounded(self, self.at_least_n_per_mm, self.at_most_n_per_mm)


class LimitsFile(StrictModel):
    """Content of a file of limits.

    Parameters
    ----------
    format : int
        1.
    kept_by : str
        ``design``: the design itself keeps the limits; ``every part``: each of its tolerance draws.
    sag, travel, natural_frequency, stiffness : tuple
        The limits, each an array of tables; at least one in all.
    """

    format: Literal[1]
    kept_by: Literal["design", "every part"] = "design"
    sag: Annotated[tuple[SagEntry, ...], Field(strict=False)] = ()
    travel: Annotated[tuple[TravelEntry, ...], Field(strict=False)] = ()
    natural_frequency: Annotated[tuple[NaturalFrequencyEntry, ...], Field(strict=False)] = ()
    stiffness: Annotated[tuple[StiffnessEntry, ...], Field(strict=False)] = ()


def load_limits(path: Path) -> LimitsFile:
    """Read a file of limits.

    Raises
    ------
    InputError
        The file is missing or no TOML; a key is unknown, missing, mistyped or out of range; there
        is no limit in it.
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
