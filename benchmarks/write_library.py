"""Characterise the shipped platform's mounts and export them beside its files.

    python benchmarks/write_library.py

The virtual bench of the platform's seed measures its campaign with the parts as drawn (mount set
M0), ``characterise`` turns raw channels into mounts, and the surfaces, static curves and qualities
go to ``mounts.library.json``. Map points stay out: they are a hundred times as long, and a
platform's forces come from the surfaces.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from deboom.bench.campaign_plan import training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.files.campaign import read_campaign
from deboom.files.library_export import write_library_json
from deboom.files.run_folder import hash_files
from deboom.mounts.characterise import characterise
from deboom.mounts.characterised_direction import MapPoints
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.study.mount_source import LIBRARY_FILE
from deboom.study.progress import progress_bar

PLATFORM = Path(__file__).parents[1] / "studies" / "data" / "u06_f39_f45"
SEED = 1
MOUNT_SET = "M0"


def write_platform_library(path: Path, seed: int) -> None:
    """Measure and characterise the mounts of one bench, and export them.

    Parameters
    ----------
    path : Path
        JSON; replaced if it is there.
    seed : int
        Of the bench, from 1.
    """
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary) / "campaign"
        write_campaign(folder, seed, training_plan(MOUNT_SET))
        campaign = read_campaign(folder, (MOUNT_SET,))
        with progress_bar("characterise") as progress:
            result = characterise(campaign, MOUNT_SET, progress=progress)
        record = result.record(hash_files(campaign.input_files, relative_to=folder))
    write_library_json(path, [record], [_without_map(mount) for mount in result.mounts])


def _without_map(mount: CharacterisedMount) -> CharacterisedMount:
    none = np.zeros(0)
    empty = MapPoints(none, none, none, none, none, none, none.astype(str))
    directions = tuple(replace(one, map_points=empty) for one in mount.directions)
    return replace(mount, directions=directions)


if __name__ == "__main__":
    write_platform_library(PLATFORM / LIBRARY_FILE, SEED)
