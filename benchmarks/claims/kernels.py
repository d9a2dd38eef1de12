"""Booming model: speed, error, independence of the batch, and prescribed against coupled motion.

Speeds are quiet times side by side in one process on one thread; `make bench` shows the tables.
"The loop" is plain numpy, draw by draw.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.stats import qmc

import kernels as bench
from claims import Claim
from deboom.arrays import RealArray
from deboom.files.platform import Platform, read_platform
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.fleet import PathContributions, path_contributions
from deboom.vehicles.kernels import level_sum

N_DATA_SETS = 60
N_PROBLEMS = 20
N_POWERTRAINS = 40
ERROR = 1e-9
SPEEDS = {
    Motion.prescribed: (17.0, 27.0),
    Motion.coupled: (25.0, 25.0),
    Motion.amplitude: (35.0, 35.0),
}
"""Least speed in times the loop, at both shapes of the benchmark."""
PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"


def claims() -> list[Claim]:
    platform = read_platform(PLATFORM)
    designs = 0.85 + 0.30 * qmc.LatinHypercube(12, seed=5).random(300)
    return [
        *_speeds(),
        *_prescribed_errors(platform),
        *_coupled_errors(),
        *_differences(),
        *_prescribed_against_coupled(platform, designs),
        _data_sheet(platform, designs[:50]),
    ]


def _speeds() -> list[Claim]:
    found = []
    for motion, wanted in SPEEDS.items():
        for shape, least in zip(bench.SHAPES, wanted, strict=True):
            row = bench.measure(motion, shape, seconds=10.0).loc[bench.NUMBA]
            found.append(
                Claim(
                    topic=f"speed, {motion.value} motion, {shape.title}",
                    asked=f"at least {least:g} times the loop",
                    measured=f"{row['x loop']:.1f} times the loop",
                    holds=bool(row["x loop"] >= least),
                )
            )
    return found


def _random(seed: int) -> tuple[PathContributions, RealArray]:
    return bench.prescribed_problem(bench.SHAPES[1], seed), bench.designs(bench.SHAPES[1])


def _notches(seed: int) -> tuple[PathContributions, RealArray]:
    """At each line the nominal design cancels to 60 dB below its largest path."""
    case, designs = _random(seed)
    values = case.values.copy()
    last = int(np.flatnonzero(values.any(axis=(0, 1)))[-1])
    rest = values[:, :, :last].sum(axis=2)
    values[:, :, last] = -rest + 1e-3 * np.abs(values).max(axis=2)
    notched = PathContributions(
        case.load_case, case.frequency, values, case.vehicle_names, case.variable_names
    )
    return notched, 1 + 0.02 * (designs - 1)


def _error(case: PathContributions, designs: RealArray) -> float:
    """Return the largest error against long double, compiled and plain [dB]."""
    x = designs.astype(np.longdouble)
    real = np.einsum("vfk,dk->dvf", case.values.real.astype(np.longdouble), x)
    imaginary = np.einsum("vfk,dk->dvf", case.values.imag.astype(np.longdouble), x)
    exact = (10 * np.log10(real**2 + imaginary**2)).sum(axis=-1)
    sums = [level_sum(case, compiled=compiled)(designs) for compiled in (False, True)]
    return float(max(np.abs(summed - exact).max() for summed in sums))


def _prescribed_errors(platform: Platform) -> list[Claim]:
    designs = bench.designs(bench.SHAPES[1])
    shipped = [
        _error(path_contributions(fleet, platform.mounts, load_case), designs)
        for fleet in map(platform.fleet.group, ("U06", "F39", "F45"))
        for load_case in platform.load_cases
    ]
    seeds = range(1, N_DATA_SETS + 1)
    drawn = f"{N_DATA_SETS} data sets x 128 draws x 5 vehicles"
    errors = (
        ("random data", max(_error(*_random(seed)) for seed in seeds), drawn),
        ("a notch at every line", max(_error(*_notches(seed)) for seed in seeds), drawn),
        ("shipped platform", max(shipped), f"{len(shipped)} groups and load cases x 128 designs"),
    )
    return [
        Claim(
            topic=f"error of SPLV over 161 lines against long double, {title}",
            asked=f"at most {ERROR:g} dB",
            measured=f"{worst:.1e} dB over {sample}",
            holds=bool(worst <= ERROR),
        )
        for title, worst, sample in errors
    ]


def _coupled_errors() -> list[Claim]:
    shape = bench.SHAPES[1]
    worst = 0.0
    for seed in range(1, N_PROBLEMS + 1):
        motion, designs = bench.coupled_problem(shape, seed), bench.designs(shape, seed)
        error = level_sum(motion, compiled=True)(designs) - bench.at_once(motion, designs)
        worst = max(worst, float(np.abs(error).max()))
    return [
        Claim(
            topic="error of coupled SPLV over 161 lines against LAPACK",
            asked=f"at most {ERROR:g} dB",
            measured=f"{worst:.1e} dB over {N_PROBLEMS} problems x 128 draws x 5 vehicles",
            holds=worst <= ERROR,
        )
    ]


def _differences() -> list[Claim]:
    found = []
    for motion, problem in bench.PROBLEMS.items():
        rng = np.random.default_rng(3)
        designs = rng.uniform(0.8, 1.2, (500, bench.SHAPES[1].n_variables))
        summed = level_sum(problem(bench.SHAPES[1]), compiled=True)
        whole, different, sizes = summed(designs), 0, (1, 2, 17, 100, 127, 128, 129)
        for size in sizes:
            order = rng.permutation(len(designs))
            parts = [summed(designs[order[i : i + size]]) for i in range(0, len(order), size)]
            different += int((np.concatenate(parts) != whole[order]).any(axis=1).sum())
        found.append(
            Claim(
                topic=f"designs whose SPLV changes a bit with batch size or order, {motion.value}",
                asked="0",
                measured=f"{different} in {len(sizes)} ways to batch {len(designs)} designs",
                holds=different == 0,
            )
        )
    return found


def _prescribed_against_coupled(platform: Platform, designs: RealArray) -> list[Claim]:
    correlation, slope = [], []
    for fleet in map(platform.fleet.group, ("U06", "F39", "F45")):
        for load_case in platform.load_cases:
            motion = coupled_motion(fleet, platform.mounts, platform.powertrain, load_case)
            coupled = level_sum(motion, compiled=True)(designs).T
            case = path_contributions(fleet, platform.mounts, load_case)
            prescribed = level_sum(case, compiled=True)(designs).T
            for p, c in zip(prescribed, coupled, strict=True):
                correlation.append(np.corrcoef(p, c)[0, 1])
                slope.append(np.polyfit(p, c, 1)[0])
    sample = f"{len(slope)} vehicles and load cases of gears 5 to 7, 300 designs within 15 %"
    return [
        Claim(
            topic="SPLV, prescribed against coupled motion: correlation",
            asked="at least 0.97",
            measured=f"{min(correlation):.3f} to {max(correlation):.3f}; {sample}",
            holds=min(correlation) >= 0.97,
        ),
        Claim(
            topic="SPLV, coupled over prescribed motion: slope",
            asked="1.1 to 1.35",
            measured=f"{min(slope):.2f} to {max(slope):.2f}; {sample}",
            holds=min(slope) >= 1.1 and max(slope) <= 1.35,
        ),
    ]


def _data_sheet(platform: Platform, designs: RealArray) -> Claim:
    fleet = platform.fleet.group("U06")
    load_case = platform.load_case(platform.default_load_case)
    rng = np.random.default_rng(1)
    rows = np.vstack([np.ones(designs.shape[1]), designs])
    changes = []
    for _ in range(N_POWERTRAINS):
        powertrain = bench.within_tolerance(platform.powertrain, rng)
        motion = coupled_motion(fleet, platform.mounts, powertrain, load_case)
        splv = level_sum(motion, compiled=True)(rows)
        changes.append((splv[1:] - splv[0]) / motion.frequency.size)
    spread = float(np.std(changes, axis=0).max())
    return Claim(
        topic="change of coupled SPLV a line: standard deviation by the data sheet's tolerances",
        asked="at most 0.02 dB",
        measured=f"{spread:.3f} dB over {N_POWERTRAINS} powertrains x {len(designs)} designs",
        holds=spread <= 0.02,
    )
