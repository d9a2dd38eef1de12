"""From a campaign folder into the mount library: what ``deboom characterise`` does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.files.run_folder import hash_files
from deboom.mounts.characterisation import Characterisation, CharacteriseOptions
from deboom.mounts.characterise import STEPS, characterise, measuring_chains
from deboom.mounts.library import MountLibrary, open_library
from deboom.study.progress import Progress


def characterise_into_library(
    folder: Path,
    library: str,
    options: CharacteriseOptions,
    progress: Progress,
    *,
    mount_sets: Sequence[str] = (),
    overwrite: bool = False,
) -> tuple[Characterisation, ...]:
    """Characterise mount sets of a campaign and keep their mounts: all of them, or none.

    Parameters
    ----------
    folder : Path
        Holds ``campaign.toml``.
    library : str
        SQLite file, made where it is missing, or database URL.
    options : CharacteriseOptions
        How. Chosen gears that the campaign does not have are an error.
    progress : callable
        ``progress(done, total, text)``.
    mount_sets : sequence of str
        By default all of the campaign.
    overwrite : bool
        Whether mounts that are in the library already are exchanged.

    Returns
    -------
    tuple of Characterisation
        One per mount set.

    Raises
    ------
    InputError
        A campaign that cannot be read or characterised, a library that cannot be written, or
        mounts that are there already; the latter before any work.
    """
    # the whole campaign, so that its record does not depend on the sets asked for
    campaign = read_campaign(folder)
    for name in mount_sets:
        campaign.runs_of(name)
    wanted = tuple(dict.fromkeys(mount_sets)) or campaign.mount_sets
    total = 1 + len(STEPS) * len(wanted)
    # one thread: the matrices are too small to share
    with open_library(library, create=True) as opened, threadpool_limits(1):
        if not overwrite:
            _refuse_known(opened, campaign.name, wanted)
        progress(0, total, "measuring chains")
        chains = measuring_chains(campaign, options)
        results = []
        for place, name in enumerate(wanted):

            def step(done: int, _of: int, text: str, place: int = place, name: str = name) -> None:
                progress(1 + place * len(STEPS) + done, total, f"{name}: {text}")

            results.append(characterise(campaign, name, options, step, chains))
        record = results[0].record(hash_files(campaign.input_files, relative_to=folder))
        opened.add([record], [m for one in results for m in one.mounts], replace=overwrite)
    return tuple(results)


def described(result: Characterisation) -> str:
    """Say in a few lines how far each direction of a mount set may be believed."""
    lines = [f"mount set {result.mount_set}, {len(result.runs)} runs"]
    for name, one in result.directions.items():
        if one.budget is None:
            lines.append(f"  {name:8} not identified: {one.complaint or 'no error budget'}")
            continue
        word = "identified" if one.budget.identified else "not identified"
        width = 100 * one.budget.half_width_95
        lines.append(f"  {name:8} ± {width:.1f} % of |K| (95 %), {word}")
    return "\n".join(lines)


def _refuse_known(opened: MountLibrary, campaign: str, wanted: Sequence[str]) -> None:
    known = [one for one in opened.identities(campaign=campaign) if one.variant in wanted]
    if known:
        raise InputError(
            f"{opened.name}: {replace(known[0], supplier='')} and {len(known) - 1} more are there "
            "already: exchange them with --replace, or choose other mount sets"
        )
