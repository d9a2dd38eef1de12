"""What a mount supplier is asked for, from the finished run of a front study."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from html import unescape
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.choices import Pick
from deboom.errors import InputError
from deboom.explore.front import verification_response
from deboom.explore.robust import RobustResponse
from deboom.explore.selection import at_nominal, indifference_intervals, variables_without_effect
from deboom.explore.space import DesignSpace
from deboom.files.platform import Platform, read_platform
from deboom.measurement.channels import LoadCase
from deboom.mounts.characterised_mount import CharacterisedDirection, CharacterisedMount
from deboom.mounts.mount import AXES, Mount
from deboom.study.platform_model import operation
from deboom.study.rebuilt import FRONT, ComparedRun, compared_run, study_of
from deboom.study.robust_front import NOTICEABLE
from deboom.study.runner import arguments_of

DRAWS = 1024
"""Draws of the tolerance behind every scatter on the page; no search has seen them."""
LOSS = " loss"
"""End of the name of a variable that is a loss factor."""


class Need(Enum):
    """What is asked of a direction."""

    wanted = "as wanted"
    anything = "any in bounds"
    nothing = "no requirement"
    unknown = "not identified"


@dataclass(frozen=True, eq=False)
class Direction:
    """One direction of a mount, a design variable.

    Parameters
    ----------
    mount : Mount
        On the platform.
    axis : str
        ``x``, ``y`` or ``z``.
    column : int
        Of its stiffness factor in a design.
    loss_column : int or None
        Of its loss factor, where that is a variable.
    characterised : CharacterisedDirection or None
        Where its force comes from; None where that is the measured spectrum.
    need : Need
        What is asked of it.
    """

    mount: Mount
    axis: str
    column: int
    loss_column: int | None
    characterised: CharacterisedDirection | None
    need: Need

    @property
    def name(self) -> str:
        """Name of the design variable."""
        return f"{self.mount.name} {self.axis}"

    @property
    def half_width_95(self) -> float:
        """Of the 95 % band of today's stiffness, relative; nan where nobody stated it [1]."""
        part = self.characterised
        stated = None if part is None else part.quality.half_width_95
        return float("nan") if stated is None else stated


@dataclass(frozen=True, eq=False)
class SupplierStudy:
    """A front study, as far as the supplier of its mounts needs it.

    Parameters
    ----------
    run : ComparedRun
        Finished, checked, with its model built again.
    platform : Platform
        With the forces of the run.
    parts : tuple of CharacterisedMount
        The forces come from; empty if they are the measured ones.
    pick : Pick
        The design that is wanted.
    """

    run: ComparedRun
    platform: Platform
    parts: tuple[CharacterisedMount, ...]
    pick: Pick

    @property
    def model(self) -> RobustResponse:
        """Of the run, with the draws of its search."""
        return self.run.model

    @property
    def space(self) -> DesignSpace:
        """Design variables and their tolerances."""
        return self.model.space

    @property
    def index(self) -> Any:
        """What the run evaluated."""
        return self.model.evaluate

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles that were served."""
        return tuple(self.index.response_names)

    @property
    def per_vehicle(self) -> float:
        """Factor from SPLV to the mean level of one line [1]."""
        return float(1.0 / self.index.n_lines)

    @property
    def band(self) -> tuple[float, float]:
        """First and last line [Hz]."""
        return float(self.index.frequency[0]), float(self.index.frequency[-1])

    @property
    def load_cases(self) -> tuple[tuple[LoadCase, float], ...]:
        """Load cases that count, with their weights; the levels shown are those of the first."""
        names = self.index.load_case_names
        pairs = zip(names, self.index.weights, strict=True)
        return tuple((self.platform.load_case(name), float(weight)) for name, weight in pairs)

    @cached_property
    def picked(self) -> RealArray:
        """The design as the search found it, shape (k,) [1]."""
        front = pd.read_csv(self.run.entry.folder / FRONT)
        name = self.pick.value.replace("-", " ")
        rows = [row for row, named in enumerate(front.get("pick", ())) if named == name]
        if len(rows) != 1:
            raise InputError(
                f"{self.run.entry.folder / FRONT} names no design '{name}' of its own: it is the "
                "same as another pick, or the study picks none; use best-mean"
            )
        return np.asarray(self.run.designs[rows[0]])

    @cached_property
    def without_effect(self) -> tuple[str, ...]:
        """Variables that no vehicle depends on."""
        return variables_without_effect(self.index, self.space)

    @cached_property
    def unidentified(self) -> tuple[str, ...]:
        """Variables whose direction nobody knows well enough to ask for a number."""
        names = []
        for mount in self.platform.mounts if self.parts else ():
            for name, axis in zip(mount.variables, AXES, strict=True):
                found = self._characterised(mount.name, axis)
                known = found is not None and found.surface is not None and found.quality.identified
                if not known:
                    names += [n for n in (name, name + LOSS) if n in self.space.names]
        return tuple(name for name in names if name not in self.without_effect)

    @cached_property
    def wanted(self) -> RealArray:
        """The picked design with today's value where nothing can be asked, shape (k,) [1]."""
        back = (*self.without_effect, *self.unidentified)
        return np.asarray(at_nominal(self.picked[np.newaxis], self.space, back)[0])

    @cached_property
    def interval(self) -> RealArray:
        """Range of each variable around `wanted` without a noticeable change, (k, 2) [1]."""
        change = NOTICEABLE * self.index.n_lines
        return np.column_stack(indifference_intervals(self.model, self.wanted, change))

    @cached_property
    def directions(self) -> tuple[Direction, ...]:
        """All stiffness factors, in the order of the design."""
        found = []
        names = self.space.names
        for mount in self.platform.mounts:
            for name, axis in zip(mount.variables, AXES, strict=True):
                if name not in names:
                    raise InputError(
                        f"run {self.run.entry.folder} has no stiffness factor '{name}': a page for "
                        "suppliers needs one for every mount and axis of its platform"
                    )
                column = names.index(name)
                loss = names.index(name + LOSS) if name + LOSS in names else None
                part = self._characterised(mount.name, axis)
                found.append(Direction(mount, axis, column, loss, part, self._need(name, column)))
        return tuple(found)

    @cached_property
    def check(self) -> RobustResponse:
        """The model with draws that the search never saw."""
        return verification_response(self.model, DRAWS, seed=self.run.seed)

    def of(self, mount: str | None) -> tuple[Direction, ...]:
        """Return the directions of a mount; of all for None.

        Raises
        ------
        InputError
            No such mount.
        """
        known = [one.name for one in self.platform.mounts]
        if mount is not None and mount not in known:
            raise InputError(
                f"run {self.run.entry.folder} has no mount '{mount}': use {', '.join(known)}"
            )
        return tuple(d for d in self.directions if mount in (None, d.mount.name))

    def only(self, mount: str) -> RealArray:
        """Return the design with one mount as wanted and the others as today, shape (k,) [1]."""
        design = np.array(self.space.nominal)
        for direction in self.of(mount):
            for column in (direction.column, direction.loss_column):
                if column is not None:
                    design[column] = self.wanted[column]
        return design

    def _characterised(self, mount: str, axis: str) -> CharacterisedDirection | None:
        for part in self.parts:
            if part.mount.name == mount:
                return next((one for one in part.directions if one.axis == axis), None)
        return None

    def _need(self, name: str, column: int) -> Need:
        if name in self.without_effect:
            return Need.nothing
        if name in self.unidentified:
            return Need.unknown
        low, high = self.interval[column]
        if low <= self.space.lower[column] and high >= self.space.upper[column]:
            return Need.anything
        return Need.wanted


def supplier_study(folder: Path, studies: Path | None, pick: Pick) -> SupplierStudy:
    """Read the run of a front study and build its model again.

    Parameters
    ----------
    folder : Path
        Of the finished run.
    studies : Path or None
        Folder with the studies; None: `studies` here, else deboom's own.
    pick : Pick
        The design that is wanted.

    Raises
    ------
    InputError
        See `deboom.study.rebuilt.compared_run`; a study without platform and mounts.
    """
    run = compared_run(folder, studies)
    given = arguments_of(run.entry, study_of(run.entry, studies))
    missing = [name for name in ("platform", "mounts", "group", "load_case") if name not in given]
    if missing:
        raise InputError(
            f"run {folder}: its study {run.entry.study} has no option --{missing[0]}, so there is "
            "no mount whose supplier could read about it"
        )
    frequency = run.model.evaluate.frequency  # type: ignore[attr-defined]
    runs = operation(
        read_platform(given["platform"]),
        given["load_case"],
        given["mounts"],
        given["group"],
        (float(frequency[0]), float(frequency[-1])),
    )
    return SupplierStudy(run, runs.platform, runs.parts, pick)


_PICTURE = re.compile(r"data:image/png;base64,[A-Za-z0-9+/=]*")
_TAG = re.compile(r"<[^>]*>")
_CELL = re.compile(r'\b(?:r|ref|sqref|activeCell|topLeftCell)="[A-Z0-9: ]*"')
"""Places of cells, such as F39: no names of vehicles."""
_CONTEXT = 30


@dataclass(frozen=True)
class ShownNames:
    """How vehicles are called, and what must not be read.

    Parameters
    ----------
    vehicles : mapping of str to str
        Own name → shown name.
    secrets : tuple of str
        Names and paths that an anonymous report may not hold; empty if it is not anonymous.
    """

    vehicles: Mapping[str, str]
    secrets: tuple[str, ...] = ()

    @property
    def anonymous(self) -> bool:
        """Whether there is anything to hide."""
        return bool(self.secrets)

    def __call__(self, vehicle: str) -> str:
        """Return the shown name of a vehicle."""
        return self.vehicles[vehicle]


def shown_names(study: SupplierStudy, *, anonymous: bool) -> ShownNames:
    """Return the vehicles' own names, or vehicle A, vehicle B, … in their order.

    Parameters
    ----------
    study : SupplierStudy
        Its platform's vehicles, groups and names are the secrets.
    anonymous : bool
        Whether to hide them.
    """
    if not anonymous:
        return ShownNames({name: name for name in study.vehicles})
    platform, entry = study.platform, study.run.entry
    vehicles = platform.fleet.vehicles
    paths = [path for folder in (platform.folder, entry.folder) for path in _spellings(folder)]
    secrets = [
        *(vehicle.name for vehicle in vehicles),
        *(vehicle.group for vehicle in vehicles),
        *(platform.name, platform.title, platform.description),
        *(str(entry.record.get("question", "")), entry.study),
        *paths,
    ]
    return ShownNames(
        {name: f"vehicle {letters(place)}" for place, name in enumerate(study.vehicles)},
        tuple(dict.fromkeys(secret for secret in secrets if secret.strip())),
    )


def letters(place: int) -> str:
    """Return A, B, … Z, AA, AB, … for 0, 1, …"""
    text = ""
    place += 1
    while place:
        place, rest = divmod(place - 1, len(ascii_uppercase))
        text = ascii_uppercase[rest] + text
    return text


def refuse_leaks(secrets: Sequence[str], texts: Mapping[str, str]) -> None:
    """Refuse a report that holds a secret.

    Parameters
    ----------
    secrets : sequence of str
        Names and paths. A name counts where no letter or digit stands beside it, in upper or lower
        case.
    texts : mapping of str to str
        What the text is → all of it.

    Raises
    ------
    InputError
        Names the secret and the words around it.
    """
    for what, text in texts.items():
        for secret in secrets:
            found = re.search(rf"(?<![^\W_]){re.escape(secret)}(?![^\W_])", text, re.IGNORECASE)
            if found:
                start = max(found.start() - _CONTEXT, 0)
                around = " ".join(text[start : found.end() + _CONTEXT].split())
                raise InputError(
                    f"an anonymous report would show '{secret}' in its {what} (… {around} …): give "
                    "the load case, mount or campaign there a name that does not tell it; if the "
                    "name is an everyday word, give the vehicle, group or platform another one"
                )


def page_text(html: str) -> str:
    """Return all that can be read in a page, tags included, without the bytes of its pictures."""
    plain = _PICTURE.sub("", html)
    return f"{unescape(plain)}\n{unescape(_TAG.sub(' ', plain))}"


def workbook_text(data: bytes) -> str:
    """Return all that can be read in an xlsx file, properties included, without cells' places."""
    with zipfile.ZipFile(io.BytesIO(data)) as parts:
        names = parts.namelist()
        texts = [parts.read(name).decode("utf-8", "replace") for name in names]
    return unescape("\n".join([*names, *(_CELL.sub("", text) for text in texts)]))


def _spellings(folder: Path) -> tuple[str, ...]:
    return (folder.as_posix(), str(folder), folder.resolve().as_posix(), str(folder.resolve()))
