"""Words that the virtual test bench accepts; a light module, so that help starts at once."""

from __future__ import annotations

from enum import Enum


class CompressorCase(Enum):
    """Where the true compressor comes from."""

    TABLE11 = "table11"
    """Mounts of the thesis's table 11."""
    RANDOM = "random"
    """Drawn around table 10, inside the tolerances of a drawing."""


class CalibrationLevel(Enum):
    """How well sensors and impacts are calibrated and placed, 1 σ, places per axis."""

    C05 = "C0.5"
    """0.5 %, 0.5 mm, 0.5°, hammer 0.5 %: calibrated and digitised."""
    C1 = "C1"
    """1 %, 1 mm, 1°, hammer 1 %."""
    C2 = "C2"
    """2 %, 1.5 mm, 1.5°, hammer 1 %: catalogue sensitivities, a tape measure."""
    C3 = "C3"
    """3 %, 2 mm, 2°, hammer 1 %."""


class HoseCase(Enum):
    """Where the true hoses come from."""

    DRAWN = "drawn"
    """Exactly as drawn and catalogued."""
    SCATTERED = "scattered"
    """Stiffness, mass and loss from 0.75 to 1.3 times the catalogue's."""
    DISPLACED = "displaced"
    """Scattered, and off by at most: ports 4 mm per axis, lengths 4 %, directions 9°."""
