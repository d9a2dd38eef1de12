"""Where a second engine and its mounts come from: campaigns, a library, or the virtual bench."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.bench.campaign_plan import CampaignPlan, training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.second_engine import (
    load_second_engine,
    second_engine_cylinders,
    second_engine_plan,
)
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.mounts.characterisation import CharacteriseOptions
from deboom.mounts.characterise import characterise
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.library import open_library
from deboom.study.progress import Progress
from deboom.study.second_engine import SecondEngine, second_engine

SECOND_BENCH = 500
"""Added to a seed for the second engine: another day, other sensors, the same mounts."""

STEPS_PER_BENCH = 4


def mounts_of_campaign(
    folder: Path, mount_set: str, options: CharacteriseOptions
) -> tuple[tuple[CharacterisedMount, ...], tuple[Path, ...]]:
    """Characterise one mount set of a campaign; its mounts, and the files that were read.

    Raises
    ------
    InputError
        A campaign that cannot be read or characterised.
    """
    campaign = read_campaign(folder, (mount_set,))
    with threadpool_limits(1):  # its matrices are too small to share
        return characterise(campaign, mount_set, options).mounts, campaign.input_files


def mounts_of_library(
    library: str, mount_set: str, campaign: str | None = None
) -> tuple[CharacterisedMount, ...]:
    """Take the mounts of one variant out of a library.

    Parameters
    ----------
    library : str
        SQLite file or database URL.
    mount_set : str
        Their variant.
    campaign : str, optional
        Where they were characterised; needed if several know the variant.

    Raises
    ------
    InputError
        No such library, no such mounts, or mounts of several campaigns.
    """
    with open_library(library) as opened:
        found = opened.identities(variant=mount_set, campaign=campaign)
        campaigns = sorted({one.campaign for one in found})
        if not found:
            raise InputError(f"{opened.name}: no mount fits; `deboom library list` shows them all")
        if len(campaigns) > 1:
            raise InputError(
                f"{opened.name}: mount set {mount_set} is there from the campaigns "
                f"{', '.join(campaigns)}: choose one"
            )
        return tuple(opened.load(one) for one in found)


def given_engine(
    second: Path,
    first: Path | None,
    library: str | None,
    library_campaign: str | None,
    mount_set: str,
    options: CharacteriseOptions,
    excited: tuple[str, ...],
    progress: Progress,
) -> SecondEngine:
    """Predict the forces of a measured second engine, under its campaign's name.

    Parameters
    ----------
    second : Path
        Campaign of the second engine.
    first : Path or None
        Campaign that the mounts are characterised from.
    library : str or None
        Or the library that they are taken from.
    library_campaign : str or None
        Whose mounts in the library, if several campaigns have this mount set.
    mount_set : str
        Parts under both engines.
    options : CharacteriseOptions
        How mounts are characterised.
    excited : tuple of str
        Loads that excite the second engine, see `CharacteriseOptions`.
    progress : callable
        ``progress(done, total, text)``.

    Raises
    ------
    InputError
        Not exactly one of campaign and library; as `second_engine`.
    """
    if (first is None) == (library is None):
        raise InputError(
            "the mounts come from the first engine's campaign or from a library: give one of both"
        )
    progress(0, 2, "mounts")
    if first is not None:
        mounts, files = mounts_of_campaign(first, mount_set, options)
    else:
        mounts = mounts_of_library(str(library), mount_set, library_campaign)
        files = (Path(str(library)),) if Path(str(library)).is_file() else ()
    progress(1, 2, "second engine")
    there = replace(options, excited=excited)
    done = second_engine(Path(second).name, mounts, second, mount_set, there)
    progress(2, 2, "")
    return replace(done, first_files=files)


def second_engines(
    seeds: Sequence[int],
    mount_set: str,
    options: CharacteriseOptions,
    progress: Progress,
    plans: tuple[CampaignPlan, CampaignPlan] | None = None,
) -> tuple[SecondEngine, ...]:
    """Measure both engines on virtual benches and keep no files.

    Parameters
    ----------
    seeds : sequence of int
        One bench each, from 1; the second engine gets sensors of its own.
    mount_set : str
        Parts under both engines.
    options : CharacteriseOptions
        How.
    progress : callable
        ``progress(done, total, text)``.
    plans : (CampaignPlan, CampaignPlan), optional
        Of the first and of the second engine; by default everything.

    Raises
    ------
    InputError
        No seed, a seed below 1, or an unknown mount set.
    """
    if not seeds:
        raise InputError("there is no bench to measure on: ask for at least one")
    first, second = plans or (training_plan(mount_set), second_engine_plan(mount_set))
    done = []
    for place, seed in enumerate(seeds):
        title = f"bench {seed}"

        def step(k: int, text: str, before: int = place * STEPS_PER_BENCH) -> None:
            progress(before + k, len(seeds) * STEPS_PER_BENCH, text)

        with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
            one, other = Path(temporary) / "first", Path(temporary) / "second"
            step(0, f"{title}: measuring the first engine")
            write_campaign(one, seed, first)
            step(1, f"{title}: characterising its mounts")
            mounts, _ = mounts_of_campaign(one, mount_set, options)
            step(2, f"{title}: measuring the second engine")
            write_campaign(
                other,
                seed + SECOND_BENCH,
                second,
                bench=load_second_engine(),
                cylinders=second_engine_cylinders(),
            )
            step(3, f"{title}: predicting its forces")
            done.append(second_engine(title, mounts, other, mount_set, options))
            step(4, title)
    return tuple(done)
