"""Stiffnesses that follow the amplitude, and scaled parts: agreement, the bench's truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import kernels as bench
import resolved_truth as truth
from claims import Claim
from deboom.arrays import RealArray
from deboom.files.platform import Platform, read_platform
from deboom.vehicles.amplitude_motion import (
    AmplitudeMotion,
    amplitude_motion,
    compare_starts,
    identified_surfaces,
)
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.kernels import level_sum
from deboom.vehicles.powertrain import KinematicModel, library_model

N_PROBLEMS = 6
CASES = {"g5_wot220": 220.0, "g6_wot160": 160.0, "g7_wot220": 220.0}
N_DESIGNS = 8


def claims() -> list[Claim]:
    found = _agreement()
    platform = read_platform(truth.PLATFORM)
    parts = truth.platform_parts(platform)
    carriers = [part for part in parts if part.mount.name != "Du"]
    study = _Study(platform, identified_surfaces(parts), library_model(carriers))
    found.append(_uniqueness(study))
    found += _against_truth(study)
    found.append(_interpolation(study))
    return found


class _Study:
    """The shipped platform's U06 vehicles, their mounts, and designs to try."""

    def __init__(self, platform: Platform, surfaces: dict, part: KinematicModel) -> None:
        self.platform, self.surfaces, self.part = platform, surfaces, part
        self.fleet = platform.fleet.group("U06")
        self.names = tuple(name for mount in platform.mounts for name in mount.variables)
        self.paths = [path for mount in platform.mounts for path in mount.paths]
        drawn = np.random.default_rng(2).uniform(0.8, 1.2, (N_DESIGNS, len(self.names)))
        self.designs = np.vstack([truth.optimum(self.names), drawn])

    def motion(self, case: str, settling: KinematicModel | None = None, follow: bool = True):
        run, data = self.platform.load_case(case), self.platform
        coupled = coupled_motion(self.fleet, data.mounts, data.powertrain, run)
        return amplitude_motion(coupled, self.surfaces, run, settling, follow=follow)

    def change(self, motion: AmplitudeMotion) -> RealArray:
        """Change of the mean level from nominal to the designs, (n, n_vehicle) [dB]."""
        rows = np.vstack([np.ones(len(self.names)), self.designs])
        level = level_sum(motion, compiled=True)(rows) / motion.frequency.size
        return level[1:] - level[0]

    def true_change(self, case: str, part: bool) -> RealArray:
        run = self.platform.load_case(case)
        args = (self.fleet, self.paths, run, CASES[case], self.designs, self.names)
        return truth.true_change(*args, part=part)


def _agreement() -> list[Claim]:
    shape = bench.SHAPES[1]
    tiers, error, linear = [], [], []
    for seed in range(1, N_PROBLEMS + 1):
        motion, designs = bench.amplitude_problem(shape, seed), bench.designs(shape, seed)[:64]
        compiled = level_sum(motion, compiled=True)(designs)
        tiers.append(np.abs(compiled - level_sum(motion, compiled=False)(designs)).max())
        exact = level_sum(replace(motion, tolerance=1e-12), compiled=False)(designs)
        error.append(np.abs(compiled - exact).max())
        constant = np.broadcast_to([1.0, 0.0, 0.0, 0.0], motion.cubic.shape)
        still = level_sum(replace(motion, cubic=constant), compiled=False)(designs)
        coupled = level_sum(motion.coupled, compiled=False)(designs)
        linear.append(np.abs(still - coupled).max())
    sample = f"{N_PROBLEMS} drawn problems x 64 draws x 5 vehicles"
    rows = (
        ("numba against numpy at equal tolerance", tiers, 1e-9),
        ("tolerance 1e-4 against 1e-12", error, 0.1),
        ("surfaces constant in amplitude against coupled motion", linear, 1e-9),
    )
    return [
        Claim(
            topic=f"amplitude-dependent SPLV over 161 lines, {topic}",
            asked=f"at most {bound:g} dB",
            measured=f"{max(values):.1e} dB over {sample}",
            holds=bool(max(values) <= bound),
        )
        for topic, values, bound in rows
    ]


def _uniqueness(study: _Study) -> Claim:
    found = [compare_starts(study.motion(case), study.designs) for case in CASES]
    worst = max(one.difference.max() for one in found)
    return Claim(
        topic="amplitude-dependent motion of the shipped mounts: starts from 1e-6 to 5e-3 m",
        asked="one solution",
        measured=(
            f"amplitudes within {worst:.0e} (logarithm) over {len(CASES)} load cases x "
            f"{len(study.designs)} designs x 161 lines"
        ),
        holds=all(one.unique for one in found),
    )


def _against_truth(study: _Study) -> list[Claim]:
    dynamic, held, part, share, left, best = [], [], [], [], [], []
    for case in CASES:
        true = study.true_change(case, part=False)
        model = study.change(study.motion(case))
        dynamic.append(np.std(model - true))
        held.append(np.std(study.change(study.motion(case, follow=False)) - true))
        true_part = study.true_change(case, part=True)
        model_part = study.change(study.motion(case, study.part))
        part.append(np.sqrt(np.mean((model_part - true_part) ** 2)))
        share.append(part[-1] / np.sqrt(np.mean(true_part**2)))
        best.append((true[0, :4].mean(), model[0, :4].mean()))
        left.append((true_part[0, :4].mean(), model_part[0, :4].mean()))
    sample = f"{', '.join(CASES)}; 5 vehicles x {len(study.designs)} designs within 20 %"

    def pairs(values: list[tuple[float, float]]) -> str:
        return ", ".join(f"{true:.2f} ({model:.2f})" for true, model in values)

    return [
        Claim(
            topic="change of SPLV a line against the bench re-solved, dynamic factor",
            asked="standard deviation at most 0.02 dB, and below that with amplitudes held",
            measured=(
                f"{', '.join(f'{value:.3f}' for value in dynamic)} dB; amplitudes held "
                f"{', '.join(f'{value:.3f}' for value in held)} dB; {sample}"
            ),
            holds=bool(max(dynamic) <= 0.02 and all(np.array(dynamic) < held)),
        ),
        Claim(
            topic="change of SPLV a line against the bench re-solved, scaled parts",
            asked="rms at most 30 % of the change",
            measured=(
                f"{', '.join(f'{value:.3f}' for value in part)} dB, "
                f"{', '.join(f'{100 * value:.0f}' for value in share)} % of the change; {sample}"
            ),
            holds=bool(max(share) <= 0.30),
        ),
        Claim(
            topic="benefit of the prescribed optimum, U06-1 to U06-4: stops re-tuned, or parts",
            asked="falls from about -3 dB to about -0.8 dB a line (-0.5 to -1.3)",
            measured=(
                f"truth (model): dynamic {pairs(best)} dB; part {pairs(left)} dB; "
                f"{', '.join(CASES)}"
            ),
            holds=all(max(pair) < -3.0 for pair in best)
            and all(-1.3 < value < -0.5 for pair in left for value in pair),
        ),
    ]


def _interpolation(study: _Study) -> Claim:
    rng = np.random.default_rng(4)
    worst = 0.0
    for case in CASES:
        ratio = study.motion(case, study.part, follow=False).ratio
        assert ratio is not None
        factors = rng.uniform(0.7, 1.3, (20, 9))
        slope = ratio.position.slope
        direct = study.part.deflections(ratio.torque, factors)
        found = slope(ratio.position.deflection(factors)) / slope(direct)
        worst = max(worst, float(np.abs(found - 1).max()))
    return Claim(
        topic="static slope of scaled parts, interpolated over the torque, against solved lines",
        asked="within 0.1 %",
        measured=f"within {100 * worst:.3f} % over {len(CASES)} load cases x 20 designs, 70-130 %",
        holds=worst <= 1e-3,
    )
