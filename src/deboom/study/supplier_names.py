"""Names that a supplier may read: the vehicles' own, or letters and nothing that tells them."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from string import ascii_uppercase

from deboom.errors import InputError
from deboom.study.supplier_study import SupplierStudy

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
