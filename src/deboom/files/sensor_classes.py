"""Tolerances that a folder does not state: the defaults of its sensors' classes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeVar

from deboom.files.schema import StrictModel, key_without_unit
from deboom.measurement.sensor_classes import CLASS_DEFAULTS

_Section = TypeVar("_Section", bound=StrictModel)


def completed(section: _Section, file: str) -> tuple[_Section, tuple[str, ...]]:
    """Give a section the defaults of the tolerances that it does not state.

    - `section`: of a folder's TOML file; keys that are not stated are None.
    - `file`: name of that file.
    - returns the section without None, what is stated as it was; and a sentence for a reader of
      results on which tolerances are defaults, none where all are stated.
    """
    defaults = {key: _default(key) for key, value in section if value is None}
    words = (_words(defaults, file),) if defaults else ()
    return section.model_copy(update=defaults), words


def _default(key: str) -> float:
    value = CLASS_DEFAULTS[key_without_unit(key)].value
    return math.degrees(value) if key.endswith("_deg") else value


def _words(defaults: Mapping[str, float], file: str) -> str:
    sensors: dict[str, list[str]] = {}
    for key, value in defaults.items():
        sensor = CLASS_DEFAULTS[key_without_unit(key)].sensor
        sensors.setdefault(sensor, []).append(f"{key} = {value:.3g}")
    listed = "; ".join(f"{sensor}: {', '.join(keys)}" for sensor, keys in sensors.items())
    many = len(defaults) > 1
    are = f"{len(defaults)} tolerances are defaults" if many else "1 tolerance is a default"
    of = "their sensors' classes" if many else "its sensor's class"
    return (
        f"{are} of {of}, not what the laboratory states ({listed}): intervals are as wide as that "
        f"makes them; state what you know in [tolerances] of {file}."
    )
