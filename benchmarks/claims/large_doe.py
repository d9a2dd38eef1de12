"""Designs by the million.

2^20 Sobol designs of the 12 stiffness factors over ±20 %, SPLV of all 15 vehicles of the shipped
platform, written to chunks of 2^14 designs. The process's peak memory is compared with that after
the first 2^16 designs.
"""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

from claims import Claim
from deboom.explore.doe import SobolDesigns, evaluate_to_store
from deboom.explore.space import stiffness_factor_space
from deboom.files.checkpoint import CheckpointFolder
from deboom.files.platform import read_platform
from deboom.vehicles.booming_model import booming_index
from deboom.vehicles.kernel_numpy import NUMPY

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
CHUNK = 2**14


def peak_mib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def claims() -> list[Claim]:
    data = read_platform(PLATFORM)
    cases = [(data.load_case(data.default_load_case), 1.0)]
    index = booming_index(data.fleet, data.mounts, cases, (20, 60), NUMPY)
    space = stiffness_factor_space(index.variable_names)
    with tempfile.TemporaryDirectory() as folder:
        first = CheckpointFolder(Path(folder) / "first", {})
        evaluate_to_store(index, SobolDesigns(space, 2**16, seed=1), first, CHUNK)
        before, begin = peak_mib(), time.perf_counter()
        store = CheckpointFolder(Path(folder) / "all", {})
        designs = SobolDesigns(space, 2**20, seed=1)
        computed = evaluate_to_store(index, designs, store, CHUNK)
        seconds, growth = time.perf_counter() - begin, peak_mib() - before
        again = evaluate_to_store(index, designs, store, CHUNK)
    return [
        Claim(
            f"2^20 designs × {len(index.response_names)} vehicles: growth of peak memory [MiB]",
            "≤ 16",
            f"{growth:.1f} ({seconds:.0f} s, {computed} chunks)",
            growth <= 16.0,
        ),
        Claim("the same again: chunks computed", "0", f"{again}", again == 0),
    ]
