"""Claims that the documentation makes, each measured afresh by ``make validate``."""

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
