"""Mount sets of a campaign for the validation of a synthesis: characterised without one run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.measurement.campaign import Campaign, OperatingRun
from deboom.measurement.load_case import LoadCase
from deboom.mounts.bench_load_case import bench_load_case
from deboom.mounts.characterisation import CharacteriseOptions
from deboom.mounts.characterise import characterise, measuring_chains
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.study.progress import Progress

OPTIONS = CharacteriseOptions(folds=0)


@dataclass(frozen=True, eq=False)
class BenchSet:
    """One mount set on the bench.

    Parameters
    ----------
    name : str
        Such as ``M1``, or ``EnM1-GeM2-TSM3-Du4`` for a mix.
    load_case : LoadCase
        The run that is looked at, as the bench measured it: blocked forces.
    mounts : tuple of CharacterisedMount
        Their surfaces are fitted to all other runs.
    """

    name: str
    load_case: LoadCase
    mounts: tuple[CharacterisedMount, ...]


def bench_sets(
    folder: Path, gear: int, torque_limit: float, progress: Progress, needed: str | None = None
) -> tuple[Campaign, dict[str, BenchSet]]:
    """Characterise every mount set of a campaign, without the run that is to be predicted.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    gear : int
        Of the full-load run with rising torque that is looked at.
    torque_limit : float
        Its limit [N m].
    progress : callable
        ``progress(done, total, text)``; one step per mount set.
    needed : str, optional
        A mount set that must be there.

    Returns
    -------
    Campaign
    dict of str to BenchSet
        By the name of the set.

    Raises
    ------
    InputError
        A campaign that cannot be read or characterised, or without the mount set that is needed; a
        mount set without that run or without any other one.
    """
    progress(0, 1, "reading the bench's files")
    campaign = read_campaign(folder)
    if needed is not None and needed not in campaign.mount_sets:
        raise InputError(
            f"{folder}: the vehicles' mount set '{needed}' was not on the bench, use one of "
            f"{list(campaign.mount_sets)}"
        )
    looked_at = {name: _run(campaign, name, gear, torque_limit) for name in campaign.mount_sets}
    shown = [id(run) for run in looked_at.values()]
    others = replace(campaign, runs=tuple(run for run in campaign.runs if id(run) not in shown))
    total = len(looked_at)
    progress(0, total, "measuring chains")
    chains = measuring_chains(campaign, OPTIONS)
    found = {}
    for place, (name, run) in enumerate(looked_at.items()):
        progress(place, total, f"mount set {name}")
        result = characterise(others, name, OPTIONS, chains=chains)
        with threadpool_limits(1):  # its matrices are too small to share
            case = bench_load_case(campaign, run, chains, f"gear {gear}, {torque_limit:g} N m")
        found[name] = BenchSet(name, case, result.mounts)
    return campaign, found


def _run(campaign: Campaign, mount_set: str, gear: int, torque_limit: float) -> OperatingRun:
    for run in campaign.runs_of(mount_set):
        if run.full_load and run.rising and (run.gear, run.torque_limit) == (gear, torque_limit):
            return run
    raise InputError(
        f"campaign {campaign.name}, mount set {mount_set}: there is no full-load run in gear "
        f"{gear} with {torque_limit:g} N m to compare with the road: measure it, or choose another "
        "run with --load-case"
    )
