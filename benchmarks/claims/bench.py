"""Virtual bench and fleet.

The bench's truth and its measurements over many seeds. Truth parameters are frozen; a figure that
is missed is printed as missed.

Line by line no laboratory with these tolerances knows GeM z better than to 10.5 % in 90 % of the
benches: it moves a third as far as GeM x, so that half a degree of the shaker alone makes 6.6 %,
half a degree and 2 mm of the accelerometers 4.6 % each, and noise 0.4 %. Self-calibration takes it
to 5.5 % (next section).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import qmc

from claims import Claim, draws
from deboom.arrays import RealArray
from deboom.bench.fleet import draw_fleet, load_fleet, noise_transfer
from deboom.bench.layout import LOAD_CASES
from deboom.bench.operating_run import OperatingRun, PlannedRun, true_run
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import VirtualBench, load_bench
from deboom.bench.sensors import ErrorBudget, draw_instrumentation, measured_run
from deboom.physics.sound_level import spl

FREQUENCY = np.linspace(20.0, 80.0, 241)
BAND = FREQUENCY <= 60.0
BENCHES = range(1, 1 + draws(200))
FLEETS = range(1001, 1201)


def claims() -> list[Claim]:
    """Measure everything afresh; about 5 s on one core."""
    bench = load_bench()
    runs = [true_run(bench, case, FREQUENCY) for case in LOAD_CASES]
    fifth = true_run(bench, PlannedRun(5, 220.0), FREQUENCY)
    return [_writing(), _strut(), _transfer_spread(), *_stiffness(runs), *_fleets(fifth)]


def _writing() -> Claim:
    with TemporaryDirectory() as scratch:
        begin = time.perf_counter()
        folder = write_platform(Path(scratch) / "platform", seed=1)
        seconds = time.perf_counter() - begin
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6
    return Claim(
        "write the shipped platform [s], size of its files [MB]",
        "at most 20 s and 20 MB",
        f"{seconds:.1f} s and {size:.1f} MB",
        seconds <= 20 and size <= 20,
    )


def _strut() -> Claim:
    bench = load_bench()
    strut = 3 * bench.mount_names.index("TSM")
    stiffness = np.abs(
        [
            true_run(bench, PlannedRun(gear, 220.0), FREQUENCY).powertrain.stiffness[:, strut]
            for gear in range(1, 8)
        ]
    )
    low, high = stiffness.min() / 1e3, stiffness.max() / 1e3
    return Claim(
        "true |K| of TSM x over gears 1 to 7, full load [N/mm]",
        "103 to 2148",
        f"{low:.0f} to {high:.0f}",
        bool(abs(low - 103) < 1 and abs(high - 2148) < 3),
    )


def _transfer_spread() -> Claim:
    fleet = load_fleet(1)
    transfer = np.array(
        [
            noise_transfer(fleet.bodies[f"U06-{k}"], fleet.cabin, FREQUENCY[BAND])
            for k in range(1, 6)
        ]
    )
    spread = np.ptp(20 * np.log10(np.abs(transfer)), axis=0)
    median, at_90 = np.median(spread), np.quantile(spread, 0.9)
    return Claim(
        "spread of noise transfer functions, U06-1 to 5, median and 90 % of lines and paths [dB]",
        "10 to 18",
        f"{median:.1f} and {at_90:.1f}",
        bool(median >= 10 and at_90 <= 18),
    )


def stiffness_errors(bench: VirtualBench, runs: Sequence[OperatingRun], seed: int) -> RealArray:
    """Measure |K| = |f/s| in all runs: rms error over their lines, shape (n_channel,) [%]."""
    budget, generator = ErrorBudget(), np.random.default_rng(seed)
    truth = np.vstack([run.stiffness for run in runs])
    instrumentation = draw_instrumentation(bench, budget, generator)
    found = [measured_run(instrumentation, run, budget, generator) for run in runs]
    stiffness = np.vstack([one.force / one.displacement for one in found])
    return np.asarray(100 * np.sqrt(np.mean((np.abs(stiffness) / np.abs(truth) - 1) ** 2, axis=0)))


def _stiffness(runs: list[OperatingRun]) -> list[Claim]:
    """Error of |K| line by line, one bench per seed, over the six load cases."""
    errors = [stiffness_errors(load_bench(), runs, seed) for seed in BENCHES]
    channels, table = runs[0].channels, np.array(errors)
    bounds = {"x": (2.0, 3.0), "z": (5.0, 10.0), "y": (np.inf, np.inf)}
    result = []
    for k, channel in enumerate(channels):
        median, at_90 = np.median(table[:, k]), np.quantile(table[:, k], 0.9)
        asked, asked_90 = bounds[channel[-1]]
        result.append(
            Claim(
                f"rms error of |K| of {channel}, line by line without response surface, median "
                f"(90 %) of {len(table)} benches [%]",
                "no claim" if np.isinf(asked) else f"at most {asked:.0f} ({asked_90:.0f})",
                f"{median:.1f} ({at_90:.1f})",
                bool(median <= asked and at_90 <= asked_90 and table[:, k].min() > 0),
            )
        )
    return result


def _fleets(run: OperatingRun) -> list[Claim]:
    """Rates of the fleet's phenomena over draws of the prior, none of them chosen."""
    cabin = load_fleet(1).cabin
    designs = 0.85 + 0.30 * qmc.LatinHypercube(10, rng=5).random(200)
    force = run.path_force[BAND]
    groups, similar, quieter = [], [], []
    for seed in FLEETS:
        levels = {
            name: _levels(noise_transfer(body, cabin, FREQUENCY[BAND]) * force, designs)
            for name, body in draw_fleet(seed).items()
        }
        sums = [
            np.sum([levels[f"{group}-{k}"] for k in range(1, 6)], axis=0)
            for group in ("U06", "F39", "F45")
        ]
        inside = np.corrcoef([levels[f"U06-{k}"] for k in range(1, 5)])
        groups.append(np.corrcoef(sums).min() > 0.9)
        similar.append(inside.min() > 0.9)
        others = np.mean([levels[f"U06-{k}"].mean() for k in range(1, 5)])
        quieter.append(others - levels["U06-5"].mean())
    n = len(FLEETS)
    return [
        # the bounds are the study's rates, less three standard errors of a rate from n draws
        Claim(
            f"draws of the prior whose groups correlate above 0.9, of {n} [1]",
            "at least 0.85 (0.91 in the study)",
            f"{np.mean(groups):.2f}",
            bool(np.mean(groups) >= 0.85),
        ),
        Claim(
            f"draws of the prior whose U06-1 to 4 correlate above 0.9 pairwise, of {n} [1]",
            "at least 0.69 (0.78 in the study)",
            f"{np.mean(similar):.2f}",
            bool(np.mean(similar) >= 0.69),
        ),
        Claim(
            f"draws of the prior in which the battery vehicle is quieter, of {n} [1]",
            "at least 0.97 (0.99 in the study)",
            f"{np.mean(np.array(quieter) > 0):.2f} (median {np.median(quieter):.1f} dB)",
            bool(np.mean(np.array(quieter) > 0) >= 0.97),
        ),
    ]


def _levels(contributions: np.ndarray, designs: np.ndarray) -> np.ndarray:
    """Mean dB(A) over the lines per design."""
    return np.asarray(spl(contributions @ designs.T, FREQUENCY[BAND]).mean(axis=0))
