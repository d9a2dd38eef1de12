"""Scatter of the parts in a mount library: those of one number, compared under equal conditions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.characterised_direction import CharacterisedDirection
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.error_budget import TWO_SIDED
from deboom.mounts.mount import AXES
from deboom.mounts.part_scatter import (
    DEFAULT_PRIOR,
    DirectionScatter,
    ScatterPrior,
    ShareEstimate,
    batch_share,
    direction_scatter,
    hardness_share,
)

FEWEST_POINTS = 20
"""Points at which all parts of a direction must have been measured."""


@dataclass(frozen=True, eq=False)
class PartValues:
    """Stiffness of the parts of one mount, as far as it was measured.

    Parameters
    ----------
    mount : str
        Its name.
    parts : tuple of str, length n
        What each part is called.
    batches : tuple of str, length n, or None
        None if the library does not record them.
    axes : tuple of str, length a
        Directions that are identified in every part.
    values : array, shape (n, a)
        Logarithm of |K|, mean over the points at which all parts were measured [1].
    uncertainty : array, shape (n, a)
        Standard uncertainty by the error budget, errors common to a campaign included [1].
    """

    mount: str
    parts: tuple[str, ...]
    batches: tuple[str, ...] | None
    axes: tuple[str, ...]
    values: RealArray
    uncertainty: RealArray


@dataclass(frozen=True, eq=False)
class LibraryScatter:
    """Scatter of all mounts in a library.

    Parameters
    ----------
    directions : tuple of DirectionScatter
        Three per mount; a direction that is not identified has the prior alone.
    hardness : ShareEstimate or None
        Share of the variance that all axes of a part have in common, over all mounts.
    batches : mapping of str to ShareEstimate
        Share that all parts of a batch have in common, by mount; where batches are recorded.
    """

    directions: tuple[DirectionScatter, ...]
    hardness: ShareEstimate | None
    batches: dict[str, ShareEstimate]

    def direction(self, name: str) -> DirectionScatter | None:
        """Return one direction; None if its mount is not in the library."""
        return next((one for one in self.directions if one.name == name), None)


def library_scatter(
    parts: Sequence[CharacterisedMount],
    prior: ScatterPrior = DEFAULT_PRIOR,
    confidence: float = 0.95,
) -> LibraryScatter:
    """Estimate the scatter of every mount and axis from a library's parts.

    Parameters
    ----------
    parts : sequence of CharacterisedMount
        Those of one mount are of one part number. A part is told by its variant and serial; if it
        was characterised in several campaigns, the mean counts. A serial such as ``B7/012`` names
        the batch before its slash.
    prior : ScatterPrior
        Counts below 20 parts.
    confidence : float
        Of the intervals [1].

    Raises
    ------
    InputError
        No part, parts of several numbers at one mount, or parts whose measured regions have too
        little in common.

    Notes
    -----
    Parts are compared at the same preload, amplitude and frequency. What a stiffness factor scales
    is the curve of dynamic stiffness over static force; at equal static force a part whose rubber
    is 5 % stiffer differs by less where its stops carry the load.
    """
    if not parts:
        raise InputError("there is no part to learn the scatter from")
    mounts = tuple(dict.fromkeys(part.mount.name for part in parts))
    found = [part_values([one for one in parts if one.mount.name == name]) for name in mounts]
    directions = tuple(
        _direction(values, axis, prior, confidence) for values in found for axis in AXES
    )
    measured = [one for one in directions if np.isfinite(one.observed) and one.observed > 0.0]
    trust = [1.0 - (one.measurement / one.observed) ** 2 for one in measured]
    reliability = float(np.mean(trust)) if trust else 0.0
    hardness = None
    if reliability > 0.0:
        hardness = hardness_share([one.values for one in found], reliability, confidence)
    shares = {
        one.mount: share
        for one in found
        if one.batches is not None
        and (share := batch_share(one.values, one.batches, confidence)) is not None
    }
    return LibraryScatter(directions, hardness, shares)


def part_values(parts: Sequence[CharacterisedMount]) -> PartValues:
    """Return the stiffness of the parts of one mount under equal conditions.

    Parameters
    ----------
    parts : sequence of CharacterisedMount
        Of one mount and part number, at least one.

    Raises
    ------
    InputError
        As `library_scatter`.
    """
    mount = parts[0].mount.name
    numbers = sorted({part.identity.part_number for part in parts})
    if len(numbers) > 1:
        raise InputError(
            f"mount {mount} has parts of the numbers {numbers} in the library: their scatter is "
            "not that of one part, choose one number"
        )
    labels = [_label(part) for part in parts]
    names = tuple(dict.fromkeys(labels))
    columns, errors, axes = [], [], []
    for axis in AXES:
        directions = [_identified(part, axis) for part in parts]
        if any(one is None for one in directions):
            continue
        found = [one for one in directions if one is not None]
        values = _log_stiffness(f"{mount} {axis}", found)
        squares = np.array([_uncertainty(one) ** 2 for one in found])
        of_part = [[place for place, one in enumerate(labels) if one == name] for name in names]
        columns.append([values[places].mean() for places in of_part])
        errors.append([np.sqrt(squares[places].mean()) for places in of_part])
        axes.append(axis)
    shape = (len(axes), len(names))
    return PartValues(
        mount,
        names,
        _batches(parts, labels, names),
        tuple(axes),
        np.reshape(columns, shape).T,
        np.reshape(errors, shape).T,
    )


def _direction(
    found: PartValues, axis: str, prior: ScatterPrior, confidence: float
) -> DirectionScatter:
    name = f"{found.mount} {axis}"
    if axis not in found.axes:
        return direction_scatter(name, np.empty(0), prior=prior, confidence=confidence)
    column = found.axes.index(axis)
    return direction_scatter(
        name,
        found.values[:, column],
        found.uncertainty[:, column],
        found.batches,
        prior,
        confidence,
        has_common=True,
    )


def _log_stiffness(name: str, directions: Sequence[CharacterisedDirection]) -> RealArray:
    """Mean of ln |K| over the points that all surfaces were measured at, one value each."""
    stored = [one.surface for one in directions if one.surface is not None]
    if len({one.variables for one in stored}) > 1:
        raise InputError(f"{name}: its parts are characterised over different variables")
    surfaces = [one.response_surface() for one in stored]
    points = surfaces[0].region.points
    predicted = [one.predict_masked(*points.T) for one in surfaces]
    common = np.all([inside for _, inside in predicted], axis=0)
    if common.sum() < FEWEST_POINTS:
        raise InputError(
            f"{name}: its {len(stored)} parts were measured at only {int(common.sum())} common "
            f"points, {FEWEST_POINTS} are needed: measure them in the same runs"
        )
    return np.array([np.log(np.abs(stiffness[common])).mean() for stiffness, _ in predicted])


def _identified(part: CharacterisedMount, axis: str) -> CharacterisedDirection | None:
    found = next((one for one in part.directions if one.axis == axis), None)
    return found if found is not None and found.quality.identified else None


def _uncertainty(direction: CharacterisedDirection) -> float:
    half_width = direction.quality.half_width_95
    return 0.0 if half_width is None else half_width / TWO_SIDED


def _label(part: CharacterisedMount) -> str:
    return f"{part.identity.variant} {part.identity.serial}".strip()


def _batches(
    parts: Sequence[CharacterisedMount], labels: Sequence[str], names: Sequence[str]
) -> tuple[str, ...] | None:
    serials = dict(zip(labels, (part.identity.serial for part in parts), strict=True))
    if not all("/" in serial for serial in serials.values()):
        return None
    return tuple(serials[name].partition("/")[0] for name in names)
