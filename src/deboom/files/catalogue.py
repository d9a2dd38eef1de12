"""The parts that may stand at a platform's mounts, read from its libraries."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from deboom.errors import InputError
from deboom.files.library_export import library_parts, read_library_json
from deboom.files.platform import CATALOGUE_FILE
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.surface_forces import as_mounted
from deboom.vehicles.catalogue import Catalogue
from deboom.vehicles.platform import LIBRARY_FILE, Platform


def platform_catalogue(
    platform: Platform, path: Path | None, mounts: Sequence[str] | None = None
) -> Catalogue:
    """Read the parts that may stand at a platform's mounts.

    - `platform`: its mount library has today's parts.
    - `path`: library with further parts, exported as JSON or a database; None: `CATALOGUE_FILE`.
    - `mounts`, optional: mounts whose part may change; all by default.
    - raises InputError: no catalogue, an unknown mount, a part with other pieces than today's,
      parts that share a name, or no further part at all.
    """
    library = platform.folder / LIBRARY_FILE
    further = path or platform.folder / CATALOGUE_FILE
    if not further.exists():
        raise InputError(
            f"{further}: there is no catalogue of further parts: export a mount library there "
            "(deboom library export), or name one with --catalogue"
        )
    # parts stand in the vehicle as its mounts do, however they stood on the bench
    mounted = as_mounted(read_library_json(library)[1], platform.mounts)
    today = {part.mount.name: part for part in mounted}
    names = [mount.name for mount in platform.mounts]
    unknown = [name for name in (mounts or ()) if name not in names]
    if unknown or not set(names) <= set(today):
        raise InputError(
            f"{platform.name}: no mount {unknown or sorted(set(names) - set(today))} with a "
            f"characterised part: the mounts are {names}"
        )
    parts: dict[str, tuple[CharacterisedMount, ...]] = {name: (today[name],) for name in names}
    for part in as_mounted(library_parts(further), platform.mounts):
        name = part.mount.name
        if name in (mounts or names) and name in parts and part.identity != today[name].identity:
            if part.mount.pieces != today[name].mount.pieces:
                raise InputError(f"{further}: {part.identity} has other pieces than today's part")
            parts[name] = (*parts[name], part)
    catalogue = Catalogue(parts, (library, further))
    for name, count in zip(names, catalogue.n_parts, strict=True):
        labels = [catalogue.label(name, number) for number in range(count)]
        if len(set(labels)) < count:
            raise InputError(f"{further}: parts of {name} share a name: {labels}; number them")
    if catalogue.n_sets == 1:
        raise InputError(f"{further}: there is no further part for any of {mounts or names}")
    return catalogue
