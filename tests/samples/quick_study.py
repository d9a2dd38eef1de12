"""Which number is it?"""

from dataclasses import dataclass

from deboom.report import Report


@dataclass(frozen=True)
class Options:
    """The number."""

    number: int = 1


def prepare(options):
    """Return the number."""
    return options.number


def run(model, _):
    """Say the number."""
    report = Report("Number")
    report.number("number", model, "", "the number")
    return report
