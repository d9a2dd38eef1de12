"""Campaigns of raw sensor channels.

What the bench's sensors deliver, evaluated the shortest way that is right: least squares for the
motion, one force transfer matrix per mount, quotient. The errors are the bench's, not those of a
fitted model.
"""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from claims import Claim
from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign import (
    NO_ERRORS,
    TRAINING_RUNS,
    CampaignErrors,
    draw_campaign_sensors,
    push_answer,
    record,
    training_plan,
)
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.layout import FREQUENCY, accelerometer_places
from deboom.bench.operating_run import OperatingRun, PlannedRun, static_direction_forces, true_run
from deboom.bench.powertrain import VirtualBench, load_bench, with_mount_set
from deboom.files.campaign import read_campaign
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

BENCHES = range(1, 21)
RUNS = tuple(PlannedRun(g, t, True) for g, t in ((5, 120.0), (5, 220.0), (6, 160.0), (7, 220.0)))


def claims() -> list[Claim]:
    """Measure everything afresh; about 10 s on one core."""
    bench = load_bench()
    on_bench = with_mount_set(bench, "M1")
    runs = [true_run(on_bench, planned, FREQUENCY) for planned in RUNS]
    return [_writing(), _exact(on_bench, runs), *_with_errors(on_bench, runs)]


def _writing() -> Claim:
    with TemporaryDirectory() as scratch:
        begin = time.perf_counter()
        folder = write_campaign(Path(scratch) / "campaign", 1, training_plan("M1"))
        written = time.perf_counter() - begin
        campaign = read_campaign(folder)
        read = time.perf_counter() - begin - written
    return Claim(
        f"write, and read, one mount set with its {len(TRAINING_RUNS)} training runs [s]",
        "write in at most 10 s",
        f"{written:.1f} s, {read:.1f} s ({len(campaign.runs)} runs)",
        written <= 10 and len(campaign.runs) == len(TRAINING_RUNS),
    )


def _measured(
    bench: VirtualBench, run: OperatingRun, errors: CampaignErrors, seed: int
) -> ComplexArray:
    """Stiffness of the powertrain mounts as the laboratory finds it, shape (f, 9)."""
    sensors = draw_campaign_sensors(bench, errors, np.random.SeedSequence(seed))
    generator = np.random.default_rng([seed, 1])
    recorded = record(sensors, run, static_direction_forces(bench, run), errors, generator)
    places = accelerometer_places(bench)[:-2]
    sheet = forward_matrices(
        [place.position for place in places],
        rotation_matrix(np.deg2rad(sensors.accelerometer_angles[:-2])),
    )
    point = forward_matrices(bench.positions) @ np.linalg.pinv(sheet)
    acceleration = recorded["acceleration"][:, : len(sheet)] @ point.T
    displacement = -acceleration / (2 * np.pi * run.frequency[:, None]) ** 2
    turns = rotation_matrix(np.deg2rad(sensors.cell_angles[:-2])).reshape(3, 2, 3, 3)
    columns = [
        [
            push_answer(
                sensors, mount, sensors.pushes[mount, :, axis], 1, run.frequency, errors, generator
            )
            for axis in range(3)
        ]
        for mount in range(3)
    ]
    pushed = np.array(columns).reshape(3, 3, run.frequency.size, 2, 3)
    transfer = np.einsum("mcij,mafcj->mfia", turns, pushed).mean(axis=1).real
    cells = recorded["cell force"][:, :18].reshape(-1, 3, 2, 3)
    summed = np.einsum("mcij,fmcj->fmi", turns, cells)
    force = np.linalg.solve(transfer, summed[..., None])[..., 0].reshape(-1, 9)
    return np.asarray(force / displacement)


def _exact(bench: VirtualBench, runs: list[OperatingRun]) -> Claim:
    worst = max(
        np.max(np.abs(_measured(bench, run, NO_ERRORS, 1) / run.powertrain.stiffness - 1))
        for run in runs
    )
    return Claim(
        "true K without any error, force transfer matrix averaged over 20 to 80 Hz [%]",
        "at most 0.5: the bench's first mode",
        f"{100 * worst:.2f} (largest of {len(runs)} runs, 9 directions)",
        bool(worst <= 0.005),
    )


def _rms_error(bench: VirtualBench, runs: list[OperatingRun], seed: int) -> RealArray:
    """Relative error of |K| of one bench over all lines and runs, shape (9,)."""
    ratios = [
        np.abs(_measured(bench, run, CampaignErrors(), seed) / run.powertrain.stiffness)
        for run in runs
    ]
    return np.asarray(np.sqrt(np.mean((np.array(ratios) - 1) ** 2, axis=(0, 1))))


def _with_errors(bench: VirtualBench, runs: list[OperatingRun]) -> list[Claim]:
    rms = np.array([_rms_error(bench, runs, seed) for seed in BENCHES])
    out = []
    for axis, asked, least, most in (
        (0, "median 0.5 to 2", 0.5, 2.0),
        (2, "median 1.5 to 6", 1.5, 6.0),
        (1, "above 10: no claim on y", 10.0, np.inf),
    ):
        medians = 100 * np.median(rms[:, axis::3], axis=0)
        tails = 100 * np.quantile(rms[:, axis::3], 0.9, axis=0)
        figures = ", ".join(
            f"{name} {median:.1f} ({tail:.1f})"
            for name, median, tail in zip(bench.mount_names, medians, tails, strict=True)
        )
        out.append(
            Claim(
                f"true |K| along {'xyz'[axis]}, rms error before any fit: median (90 %) [%]",
                asked,
                f"{figures}; {len(BENCHES)} benches, {len(runs)} runs",
                bool(np.all((medians >= least) & (medians <= most))),
            )
        )
    return out
