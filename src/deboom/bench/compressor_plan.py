"""What is written: which compressor, on what it stands, how well the laboratory places things."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from deboom.errors import InputError

COMPRESSOR_DATA = "compressor.json"
"""The bench's frozen data of compressor, rig, operation and hoses."""


class CompressorCase(Enum):
    """Where the true compressor comes from."""

    TABLE11 = "table11"
    """Mounts of the thesis's table 11."""
    RANDOM = "random"
    """Drawn around table 10, inside the tolerances of a drawing."""


class CalibrationLevel(Enum):
    """How well sensors and impacts are calibrated and placed; 1 σ stand in the bench's data."""

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
    """Scattered, and off the drawing: ports by up to 4 mm, lengths by 4 %, directions by 9°."""


@dataclass(frozen=True)
class CompressorPlan:
    """The compressor under test and what is recorded of it.

    Parameters
    ----------
    case : CompressorCase
        Where its true parameters come from.
    identical_mounts : bool
        One axial and one radial stiffness for all mounts.
    softening : bool
        Mounts soften with their amplitude; each hit meets mounts of its own.
    flexible_receiver : bool
        A subframe with a mode inside the band carries the mounts.
    flexible_body : float
        The compressor is two parts that swing against each other at this frequency; 0 is rigid
        [Hz].
    hits : bool
        Write the blocks over time as well.
    hoses : HoseCase or None
        Joined to it; None where there are none.

    Raises
    ------
    InputError
        A frequency of the body that is negative or not finite.
    """

    case: CompressorCase = CompressorCase.RANDOM
    identical_mounts: bool = False
    softening: bool = False
    flexible_receiver: bool = False
    flexible_body: float = 0.0
    hits: bool = False
    hoses: HoseCase | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.flexible_body) and self.flexible_body >= 0):
            raise InputError(
                f"a body cannot swing at {self.flexible_body} Hz: state a frequency, such as 400, "
                "or 0 for a rigid one"
            )
        if self.flexible_body and self.hoses is not None:
            raise InputError("hoses hang on a rigid body here: leave out hoses or flexible body")
