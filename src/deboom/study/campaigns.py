"""Folders in, folders out: campaigns into the library, runs into order spectra."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.bench.campaign_plan import training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import DRAWING
from deboom.errors import InputError
from deboom.files.campaign import (
    CAMPAIGN_FILE,
    add_operating_run,
    load_campaign_file,
    new_run_file,
    read_campaign,
    read_time_run,
)
from deboom.files.library_export import write_library_json
from deboom.files.run_folder import hash_files
from deboom.measurement.order_tracking import (
    DEFAULT_TRACKING,
    OrderTracking,
    TrackedRun,
    TrackingOptions,
    tracked_run,
)
from deboom.mounts.characterise import (
    STEPS,
    Characterisation,
    CharacteriseOptions,
    characterise,
    measuring_chains,
)
from deboom.mounts.characterised_mount import CharacterisedMount, MapPoints
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


LIBRARY_STEPS = 2 + len(STEPS)
"""Measuring, reading, and the steps of the characterisation."""


def write_platform_library(path: Path, seed: int, progress: Progress) -> Path:
    """Measure the parts of a virtual platform on its bench, characterise and export them.

    Parameters
    ----------
    path : Path
        JSON, for a platform `deboom.study.platform_model.LIBRARY_FILE` in its folder;
        replaced if it is there.
    seed : int
        Of the platform, from 1.
    progress : callable
        ``progress(done, total, text)``.

    Returns
    -------
    Path
        The file. Surfaces, static curves and qualities; map points stay out: they are a hundred
        times as long, and a platform's forces come from the surfaces.

    Raises
    ------
    InputError
        Seed below 1, or a file that cannot be written.
    """
    progress(0, LIBRARY_STEPS, "measuring the mounts")
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary) / "campaign"
        write_campaign(folder, seed, training_plan(DRAWING))
        progress(1, LIBRARY_STEPS, "reading")
        campaign = read_campaign(folder, (DRAWING,))

        def step(done: int, _total: int, text: str) -> None:
            progress(2 + done, LIBRARY_STEPS, f"mounts: {text}")

        result = characterise(campaign, DRAWING, progress=step)
        record = result.record(hash_files(campaign.input_files, relative_to=folder))
    write_library_json(path, [record], [without_map(mount) for mount in result.mounts])
    return path


def without_map(mount: CharacterisedMount) -> CharacterisedMount:
    """Return a mount without its single measured points."""
    directions = tuple(replace(one, map_points=MapPoints.none()) for one in mount.directions)
    return replace(mount, directions=directions)


def orders_into_campaign(
    folder: Path,
    time_run: str,
    options: TrackingOptions = DEFAULT_TRACKING,
    name: str | None = None,
) -> tuple[TrackedRun, Path]:
    """Track the order of a run over time and add it to the campaign's operating runs.

    Parameters
    ----------
    folder : Path
        Holds ``campaign.toml``.
    time_run : str
        One of its ``[[time_runs]]``.
    options : TrackingOptions
        How.
    name : str, optional
        Of the operating run; that of the time run if left out.

    Returns
    -------
    tracked : TrackedRun
        What was added, and how far it may be believed.
    path : Path
        Its file.

    Raises
    ------
    InputError
        No such time run; an operating run of that name, before any work; a tacho or a range of
        speeds that cannot be tracked; a campaign that cannot be written.
    """
    recorded = read_time_run(folder, time_run)
    new_run_file(folder, recorded.mount_set, name or recorded.name)
    tracked = tracked_run(recorded, options, name)
    if options.method is OrderTracking.VOLD_KALMAN:
        how = f"Vold-Kalman filter, bandwidth {options.bandwidth:g} Hz"
    else:
        how = f"angular resampling, Hann window of {options.revolutions:g} revolutions"
    smear = f"{how}, smear up to {tracked.order.smear.max():.2g} Hz"
    path = add_operating_run(folder, tracked.run, (f"from time run {time_run}", smear))
    return tracked, path


def track_untracked(folder: Path, say: Callable[[str], None]) -> None:
    """Track every run over time that is not yet an operating run of the same name and mount set.

    Parameters
    ----------
    folder : Path
        Holds ``campaign.toml``.
    say : callable
        Called with each line of the reports.

    Raises
    ------
    InputError
        As `orders_into_campaign`; runs that were tracked before stay.
    """
    file = load_campaign_file(Path(folder) / CAMPAIGN_FILE)
    there = [(run.mount_set, run.name) for run in file.runs]
    for entry in file.time_runs:
        if (entry.mount_set, entry.name) not in there:
            tracked, path = orders_into_campaign(folder, entry.name)
            for line in described_orders(entry.name, tracked, path):
                say(line)


def described_orders(time_run: str, tracked: TrackedRun, path: Path) -> list[str]:
    """Say what was made of a run over time and how far it may be believed, line by line."""
    run = tracked.run
    return [
        f"{time_run} -> run {run.name} of mount set {run.mount_set}, {path.as_posix()}",
        *(f"  {line}" for line in tracked.report()),
    ]
