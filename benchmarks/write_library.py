"""Characterise the shipped platform's mounts and export them beside its files.

    python benchmarks/write_library.py

The virtual bench of the platform's seed measures its campaign with the parts as drawn (mount set
M0), ``characterise`` turns raw channels into mounts, and the surfaces, static curves and qualities
go to ``mounts.library.json``; the same as ``deboom bench write FOLDER --library`` does for a new
platform.
"""

from __future__ import annotations

from pathlib import Path

from deboom.progress import progress_bar
from deboom.runs.campaigns import without_map, write_platform_library
from deboom.vehicles.platform import LIBRARY_FILE

__all__ = ["PLATFORM", "SEED", "without_map", "write_platform_library"]

PLATFORM = Path(__file__).parents[1] / "studies" / "data" / "u06_f39_f45"
SEED = 1


if __name__ == "__main__":
    with progress_bar("mount library") as progress:
        write_platform_library(PLATFORM / LIBRARY_FILE, SEED, progress)
