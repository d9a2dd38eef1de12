"""Characterise further parts for the shipped platform's mounts: the catalogue of `mount_selection`.

    python benchmarks/write_catalogue.py

The virtual bench of the platform's seed measures the mount sets M1 to M5 in one campaign: parts of
the same drawings that differ from unit to unit as bought parts do. Each gets a part number, and all
go to ``catalogue.library.json`` beside the platform's own mounts, without map points and with as
many digits as the study of these parts can tell apart.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from pathlib import Path

from deboom.bench.campaign import training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.files.campaign import read_campaign
from deboom.files.library_export import write_library_json
from deboom.files.platform import CATALOGUE_FILE
from deboom.files.run_folder import hash_files
from deboom.mounts.characterise import characterise, measuring_chains
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.progress import progress_bar
from deboom.runs.campaigns import without_map
from write_library import PLATFORM, SEED

MOUNT_SETS = ("M1", "M2", "M3", "M4", "M5")
DIGITS = 9


def write_catalogue(path: Path, seed: int, mount_sets: tuple[str, ...] = MOUNT_SETS) -> None:
    """Measure and characterise one part of every mount of each set, and export them."""
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary) / "campaign"
        write_campaign(folder, seed, training_plan(*mount_sets))
        campaign = read_campaign(folder, mount_sets)
        chains = measuring_chains(campaign)
        parts = []
        for name in mount_sets:
            with progress_bar(f"characterise {name}") as progress:
                result = characterise(campaign, name, progress=progress, chains=chains)
            parts += [_numbered(without_map(mount)) for mount in result.mounts]
        record = result.record(hash_files(campaign.input_files, relative_to=folder))
    write_library_json(path, [record], parts)
    rounded = json.loads(
        path.read_text(), parse_float=lambda text: float(f"{float(text):.{DIGITS}g}")
    )
    path.write_text(json.dumps(rounded, ensure_ascii=False) + "\n")


def _numbered(part: CharacterisedMount) -> CharacterisedMount:
    name = f"{part.mount.name}-{part.identity.variant}"
    return replace(part, identity=replace(part.identity, part_number=name))


if __name__ == "__main__":
    write_catalogue(PLATFORM / CATALOGUE_FILE, SEED)
