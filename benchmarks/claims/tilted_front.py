"""The front study on tilted mounts.

`studies/front.py` on platforms of drawn benches whose powertrain mounts stand 20° away
from the vehicle's axes, each about an axis of its own, and on the same with parallel mounts: every
error of a laboratory, stated angles, the study's chain of search, verification and picks with a
budget of 40 × 20 designs and 32 draws, 20 to 60 Hz, 5th gear with full load. Its best mean is
driven in the five cars of U06, which the bench solves with the modes of their bodies.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import matplotlib.pyplot as plt
import numpy as np

from claims import Claim, at_most, draws, in_processes, listed, reported
from deboom.bench.fleet import load_fleet
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import load_bench
from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.runs.runner import load_study
from samples.driven_cars import BAND, CASE, GROUP, PATHS, driven_change

SEEDS = range(31, 31 + draws(3))
"""Of benches and fleets."""
ANGLE = 20.0
"""At which tilted mounts stand [deg]."""
BUDGET = {"population": 40, "generations": 20, "samples": 32}


def claims() -> list[Claim]:
    """Search and drive; two processes."""
    parallel, tilted = (
        np.array(in_processes(_best_mean, SEEDS, [tilt] * len(SEEDS))) for tilt in (0.0, ANGLE)
    )
    words = f"best mean of {len(SEEDS)} benches"
    shares = [true / predicted for predicted, true in (parallel.T, tilted.T)]
    return [
        reported(
            f"{words}, predicted with parallel mounts, and tilted [dB]",
            f"{listed(parallel[:, 0], 2)}; {listed(tilted[:, 0], 2)}",
        ),
        reported(
            f"{words}, true with parallel mounts, and tilted [dB]",
            f"{listed(parallel[:, 1], 2)}; {listed(tilted[:, 1], 2)}",
        ),
        at_most(
            f"{words}: true change with tilted mounts less that with parallel ones [dB]",
            0.4,
            tilted[:, 1] - parallel[:, 1],
        ),
        at_most(
            f"{words}: part of the prediction that cars bring, difference of both [1]",
            0.05,
            np.abs(shares[1] - shares[0]),
        ),
    ]


def _best_mean(seed: int, tilt: float) -> tuple[float, float]:
    """Return predicted and true mean change of the group's cars by the study's best mean [dB]."""
    with TemporaryDirectory() as scratch:
        path = write_platform(Path(scratch) / "platform", seed, truth_seed=seed, tilt=tilt)
        options = {
            "platform": path,
            "group": [GROUP],
            "load_case": [CASE],
            "band": BAND,
            "mounts": "spectra",
            "with_": "none",
            **BUDGET,
        }
        with patch.object(Report, "figure", lambda *_: plt.close("all")):
            report = load_study("front").report(options)
        cars = read_platform(path).fleet.group(GROUP).names
    design = report.tables["stiffness"]["best-mean factor [1]"].to_numpy()[:PATHS]
    true = driven_change(load_bench(seed, tilt), load_fleet(seed), cars, design)
    predicted = [report.summary[f"splv_change_db_per_line_{car}"] for car in cars]
    return float(np.mean(predicted)), float(true.mean())
