"""The mount library of a virtual platform: its parts on the bench, characterised, beside its files.

A study takes its mounts from this file by default, see `deboom.study.mount_source`.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from deboom.bench.campaign_plan import training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.mount_sets import DRAWING
from deboom.files.campaign import read_campaign
from deboom.files.library_export import write_library_json
from deboom.files.run_folder import hash_files
from deboom.mounts.characterise import STEPS, characterise
from deboom.mounts.characterised_direction import MapPoints
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.study.progress import Progress

LIBRARY_STEPS = 2 + len(STEPS)
"""Measuring, reading, and the steps of the characterisation."""


def write_platform_library(path: Path, seed: int, progress: Progress) -> Path:
    """Measure the parts of a virtual platform on its bench, characterise and export them.

    Parameters
    ----------
    path : Path
        JSON, for a platform `deboom.study.mount_source.LIBRARY_FILE` in its folder; replaced if it
        is there.
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
    none = np.zeros(0)
    empty = MapPoints(none, none, none, none, none.astype(complex), none, none.astype(str))
    directions = tuple(replace(one, map_points=empty) for one in mount.directions)
    return replace(mount, directions=directions)
