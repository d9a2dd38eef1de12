"""Runs over time of a campaign become operating runs: what ``deboom orders`` does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from deboom.files.campaign import CAMPAIGN_FILE, read_time_run
from deboom.files.campaign_file import load_campaign_file
from deboom.files.campaign_new_run import add_operating_run, new_run_file
from deboom.measurement.tracked_run import (
    DEFAULT_TRACKING,
    OrderTracking,
    TrackedRun,
    TrackingOptions,
    tracked_run,
)


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
