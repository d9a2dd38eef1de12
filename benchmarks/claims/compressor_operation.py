"""Virtual compressor in operation.

Six unbalances and the gas shake the bench's compressor from 1000 to 9000 1/min at two pressures,
with its hoses and without: the written sweeps against the laws of motion, their noise, a run-up
over time against its order spectra, and the sizes that the study of the thesis's tool 4 found.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

from claims import Claim
from deboom.bench.compressor_rig import (
    OperationPlan,
    operation,
    speeds,
    true_source,
    true_sweep,
)
from deboom.bench.compressor_truth import CompressorPlan, held_stiffness
from deboom.bench.compressor_writer import write_operating_test
from deboom.choices import CalibrationLevel, CompressorCase, HoseCase
from deboom.compressor.unbalance_load import RotationSense, unbalance_load
from deboom.files.operating_test import read_operating_test
from deboom.physics.rigid_body import skew

SEEDS = range(1, 11)
C2 = CalibrationLevel.C2
LENGTH = 0.055
"""Characteristic length that makes moments comparable with forces: √(I/m) of the study [m]."""
PLANS = (
    OperationPlan(CompressorPlan(CompressorCase.TABLE11), HoseCase.DRAWN),
    OperationPlan(sense=-1),
    OperationPlan(CompressorPlan(flexible_receiver=True)),
)


def claims() -> list[Claim]:
    """Measure everything afresh; about 30 s on one core."""
    return [_sums(), _exact(), *_files(), *_sizes(), _hoses()]


def _sums() -> Claim:
    source = true_source()
    worst = max(
        abs(source.static_unbalance - 20e-6 * np.exp(1j * np.deg2rad(40))) / 20e-6,
        abs(source.dynamic_unbalance - 1200e-9 * np.exp(-1j * np.deg2rad(60))) / 1200e-9,
    )
    return Claim(
        f"sums of the {len(source.unbalances)} unbalances against 20 g mm at 40° and 1200 g mm² "
        "at −60°, which the frozen data state with nine digits",
        "at most 1e-8",
        f"{worst:.1e}",
        worst <= 1e-8,
    )


def _exact() -> Claim:
    """Against the hammer's inertance, the identification's law of unbalance, and a gyroscope."""
    worst = 0.0
    with TemporaryDirectory() as scratch:
        for number, plan in enumerate(PLANS):
            folder = write_operating_test(
                Path(scratch) / str(number), 1 + number, plan=plan, noise_free=True
            )
            test = read_operating_test(folder)
            hammer = np.load(folder / "hammer/truth/truth.npz")
            lines = np.isin(hammer["frequency"], speeds())
            rows = np.load(folder / "truth/operation.npz")["response_matrix"]
            source = true_source(plan.sense)
            turning = unbalance_load(
                [part.rotating for part in source.unbalances],
                [part.arm for part in source.unbalances],
                speeds(),
                RotationSense(plan.sense),
            )
            hoses = operation(1 + number, C2, plan).laboratory.compressor.hoses
            for sweep, factor in zip(test.sweeps, (1.0, 1.6, 1.0, 1.6), strict=True):
                apparent = hammer["apparent_mass"][lines]
                apparent[:, 3:, 3:] += 1j * plan.sense * source.rotor_inertia * skew([1, 0, 0])
                if "standard" in sweep.name:
                    squared = (2 * np.pi * speeds()) ** 2
                    apparent = apparent - held_stiffness(hoses, speeds()) / squared[:, None, None]
                load = turning.copy()
                load[:, 0] += factor * source.gas_force
                load[:, 3] += factor * source.gas_moment
                load[:, 1] += factor * source.rotating_gas_force
                load[:, 2] += -1j * plan.sense * factor * source.rotating_gas_force
                moved = np.linalg.solve(apparent, load[:, :, None])[:, :, 0]
                expected = moved @ rows.T
                off = np.abs(sweep.acceleration.values - expected).max()
                worst = max(worst, float(off / np.abs(expected).max()))
    return Claim(
        "sweeps without errors against apparent mass of the hammer test, law of the unbalance, gas "
        "and gyroscopic term; both senses, flexible receiver, with hoses and without; largest "
        "deviation over largest acceleration",
        "at most 1e-9",
        f"{worst:.1e}",
        worst <= 1e-9,
    )


def _files() -> list[Claim]:
    ratios, tracked, spread, seconds = [], [], [], []
    with TemporaryDirectory() as scratch:
        for seed in SEEDS:
            plan = OperationPlan(hammer_with_hoses=True, time_record=True)
            begin = process_time()
            folder = write_operating_test(Path(scratch) / str(seed), seed, plan=plan)
            seconds.append(process_time() - begin)
            test = read_operating_test(folder)
            for number, sweep in enumerate(test.sweeps[:4]):
                truth = np.load(folder / f"truth/{number}.npz")["acceleration"]
                off = (sweep.acceleration.values - truth) / sweep.deviation
                ratios.append(float(np.sqrt(np.mean(np.abs(off) ** 2) / 2)))
            record = test.sweeps[4]
            there = np.isin(speeds(), record.frequency)
            truth = np.load(folder / "truth/2.npz")["acceleration"][there]
            off = record.acceleration.values - truth
            tracked.append(float(np.linalg.norm(off) / np.linalg.norm(truth)))
            spread.append(float(np.sqrt(np.mean(np.abs(off / record.deviation) ** 2) / 2)))
    return [
        Claim(
            "deviation of the sweeps from the truth over the one that the reader states, least and "
            f"largest of {len(ratios)} sweeps",
            "0.95 to 1.05",
            f"{min(ratios):.3f} to {max(ratios):.3f}",
            0.95 <= min(ratios) <= max(ratios) <= 1.05,
        ),
        Claim(
            "first order that deboom tracks of the run-up over time against the steady states, 50 "
            f"to 60 Hz: median and largest of {len(tracked)} seeds [%]",
            "at most 0.3",
            f"{100 * np.median(tracked):.2f} and {100 * max(tracked):.2f}",
            max(tracked) <= 0.003,
        ),
        Claim(
            "the same over the deviation that the reader states: largest",
            "at most 1",
            f"{max(spread):.2f}",
            max(spread) <= 1.0,
        ),
        Claim(
            "processor time to write two hammer tests, four sweeps and a record, median [s]",
            "a few",
            f"{np.median(seconds):.1f}",
            float(np.median(seconds)) <= 5.0,
        ),
    ]


def _sizes() -> list[Claim]:
    strokes, factors = [], []
    for seed in SEEDS:
        there = operation(seed, C2, OperationPlan(softening=True))
        run = true_sweep(there, 7.5, soft=True, frequency=speeds()).running
        strokes.append([run.amplitudes.min(), run.amplitudes.max()])
        factors.append([run.factors.min(), run.factors.max()])
    least, largest = 1e6 * np.median(strokes, axis=0)
    stiff = np.median(factors, axis=0)
    return [
        Claim(
            "strokes of the mounts over a sweep, least and largest, medians of "
            f"{len(strokes)} compressors [µm]; the study: 5 to 90",
            "said",
            f"{least:.1f} to {largest:.0f}",
            largest > 30,
        ),
        Claim(
            "factors of softening over a sweep against 1 under the hammer, medians; the study: "
            "1.04 to 1.26",
            "said",
            f"{stiff[0]:.2f} to {stiff[1]:.2f}",
            bool(stiff[1] > 1.1),
        ),
    ]


def _hoses() -> Claim:
    shares = []
    scale = np.array([1, 1, 1, 1 / LENGTH, 1 / LENGTH, 1 / LENGTH])
    for seed in SEEDS:
        there = operation(seed, C2, replace(PLANS[0], compressor=CompressorPlan()))
        run = true_sweep(there, 7.5, soft=False, frequency=speeds())
        moved = run.running.displacement[:, :, None]
        reaction = (held_stiffness(run.hoses, speeds()) @ moved)[:, :, 0]
        share = np.linalg.norm(scale * reaction, axis=1) / np.linalg.norm(
            scale * run.running.load, axis=1
        )
        bands = ((30, 60), (60, 90), (90, 120), (120, 151))
        shares.append([share[(speeds() >= a) & (speeds() < b)].mean() for a, b in bands])
    found = 100 * np.median(shares, axis=0)
    return Claim(
        "reaction of the drawn hoses over the force of the source in 30–60, 60–90, 90–120 and "
        "120–150 Hz, medians [%]; the study: 14 below 60 Hz, 8.5 at 90–120 Hz",
        "at least 2 above 60 Hz",
        "; ".join(f"{value:.1f}" for value in found),
        bool(np.all(found[1:] >= 2)),
    )
