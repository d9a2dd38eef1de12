"""How parts scatter, from a TOML file with strict keys."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from deboom.errors import InputError
from deboom.files.strict_toml import StrictModel, load_toml

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class PartEntry(StrictModel):
    """A part number.

    Parameters
    ----------
    number : str
        Its name.
    places : tuple of str
        Mounts that take it.
    pieces : int
        Behind each variable of a place, such as 2 for left and right.
    hardness_share, batch_share : float, optional
        Of the variance, where they are not those of the file [1].
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

    Parameters
    ----------
    library : str
        Mount library (SQLite), or its export as JSON; a path from the file.
    prior_sigma : float
        Standard deviation that was assumed before any part was measured [1].
    prior_weight : float
        Degrees of freedom that the assumption counts like.
    """

    library: str
    prior_sigma: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05
    prior_weight: Annotated[float, Field(gt=0.0)] = 4.0


class PartScatterFile(StrictModel):
    """Content of a file of parts.

    Parameters
    ----------
    format : int
        1.
    hardness_share : float, optional
        Share of the variance that all axes of a piece have in common [1]. Default is what was
        measured, or 0.
    batch_share : float, optional
        Share of the variance that all pieces of a batch have in common [1]. Likewise.
    measured : MeasuredEntry, optional
        Tolerances come from there: three standard deviations.
    parts, tolerances : tuple
        Part numbers; tolerances of single variables, before those that were measured.
    """

    format: Literal[1]
    hardness_share: Share | None = None
    batch_share: Share | None = None
    measured: MeasuredEntry | None = None
    parts: Annotated[tuple[PartEntry, ...], Field(strict=False)] = ()
    tolerances: Annotated[tuple[ToleranceEntry, ...], Field(strict=False)] = ()


def load_parts(path: Path) -> PartScatterFile:
    """Read a file of parts.

    Raises
    ------
    InputError
        The file is missing or no TOML; a key is unknown, missing, mistyped or out of range; a part
        number or a variable stands there twice.
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
