"""Claims that the documentation makes, each measured afresh by ``make validate``.

What follows from an equation, and what a single measurement shows, stands in tests/verification;
here stands what takes many draws, and what the shipped studies find.
"""

import os
from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """One line of ``docs/validation.md``."""

    topic: str
    """What is claimed, in a few words with unit."""
    asked: str
    """The bound, as text."""
    measured: str
    """The figure, as text with its unit and sample."""
    holds: bool
    """Whether the figure meets the bound."""


def draws(few: int) -> int:
    """Return how many draws a claim takes: few, times the environment variable ``DRAWS``."""
    return max(1, round(few * float(os.environ.get("DRAWS", "1"))))
