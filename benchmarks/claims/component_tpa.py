"""Component TPA.

A drive unit of beams, bolted to a body of beams at three points, is struck and run with all errors
of a laboratory of level C2; every draw has its own source, bodies, loads and laboratory; the
shipped case is that of seed 1. The bench solves the whole structure, the analysis inverts measured
functions. Errors of blocked forces are norms over loads, lines and runs, on trusted lines: where
noise of the functions shrinks no load by more than 15 %. The rest of the lines lies below the
first elastic mode of the source and at its resonance with points held, where some loads move no
indicator; the sound needs none of them. Levels are those of the energy of all lines.

Then what a test leaves out: rotations that are not stated, and a bracket that nobody measured, with
as much sound through the air as through the structure. The completeness of the interface hardly
sees either at three points: eighteen, or nine, loads stand for what is missing, reproduce the sound
and are not those of the source.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from claims import CASES, Claim, in_processes, over_draws
from deboom.bench.component import ComponentPlan
from deboom.bench.component_writer import write_component_test
from deboom.files.component_test import COMPONENT_FILE, read_component_test, read_receiver
from deboom.measurement.component_tpa import (
    ComponentTpa,
    component_tpa,
    in_receiver,
    level_difference,
)


def claims() -> list[Claim]:
    complete, incomplete = zip(*in_processes(_bench, CASES), strict=True)
    whole, lacking = np.array(complete), np.array(incomplete)
    names = "20 benches"
    return [
        over_draws(f"trusted lines, {names} [%]", whole[:, 0], {0.5: 70}, 0, least=True),
        over_draws(
            f"blocked forces and moments on trusted lines against the truth, {names}: error [%]",
            whole[:, 1],
            {0.5: 10, 0.9: 20},
            1,
        ),
        over_draws(
            f"sensors left out, predicted over measured, {names}: largest of two sensors and runs "
            "[dB]",
            whole[:, 2],
            {0.5: 0.5, 0.9: 1.0},
        ),
        over_draws(
            f"coherence at sensors left out, median over the lines, least of the runs, {names}",
            whole[:, 3],
            {0.1: 0.95},
            4,
            least=True,
        ),
        over_draws(
            f"sound at the ears of the car of the test, {names}: largest error of level of two "
            "ears and runs, and median error of a line [dB]",
            whole[:, 4:6],
            {0.5: [0.5, 0.5], 0.9: [1.0, 1.0]},
        ),
        over_draws(
            f"sound at the ears of another car, on rubber mounts, {names}: the same [dB]",
            whole[:, 6:8],
            {0.5: [1.0, 1.0], 0.9: [2.0, 2.0]},
        ),
        Claim(
            f"90 % intervals that hold the truth, all of {names}: of blocked forces on trusted "
            "lines, and of the sound [%]",
            "80 to 97",
            f"{whole[1:, 8].mean():.0f}, {whole[1:, 9].mean():.0f} (each bench "
            f"{whole[1:, 8].min():.0f} to {whole[1:, 8].max():.0f}, {whole[1:, 9].min():.0f} to "
            f"{whole[1:, 9].max():.0f})",
            all(80 <= mean <= 97 for mean in whole[1:, 8:10].mean(axis=0)),
        ),
        over_draws(
            f"completeness of the interface, {names}: as measured", whole[:, 10], {0.1: 0.98}, 3,
            least=True,
        ),
        over_draws(
            f"the same with rotations left out, {names}; error of the forces then [%]",
            lacking[:, :2],
        ),
        over_draws(
            f"the same with a bracket that nobody measured, {names}; error of the forces then [%]; "
            "energy at the ears that is told as foreign, where half of it came through the air [%]",
            lacking[:, 2:5],
        ),
    ]  # fmt: skip


def _bench(seed: int) -> tuple[list[float], list[float]]:
    """Figures of one bench, complete and with what a test leaves out."""
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / "test"
        write_component_test(folder, seed, truth_seed=seed)
        result = component_tpa(read_component_test(folder), seed=seed)
        moved = in_receiver(result, read_receiver(folder / "receiver"))
        figures = _figures(folder, result)
        levels, lines = [], []
        for run in moved:
            truth = _truth(folder, run.run)["second_pressure"]
            levels.append(np.abs(level_difference(run.sound.values, truth, 0)).max())
            lines.append(np.median(np.abs(20 * np.log10(np.abs(run.sound.values / truth)))))
        figures[6:8] = [max(levels), float(np.median(lines))]
        path = folder / COMPONENT_FILE
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace("degrees_of_freedom = 6", "degrees_of_freedom = 3"), "utf-8")
        three = component_tpa(read_component_test(folder), seed=seed)
        lacking = [three.completeness.median, _figures(folder, three)[1]]
        other = Path(scratch) / "bracket"
        plan = ComponentPlan(unmeasured_point=True, airborne=1.0, line_step=4.0)
        write_component_test(other, seed, plan=plan, truth_seed=seed)
        bracket = component_tpa(read_component_test(other), seed=seed)
        lacking += [bracket.completeness.median, _figures(other, bracket)[1]]
        foreign = [
            np.sum(np.abs(run.measured_sound.values - run.sound.values) ** 2)
            / np.sum(np.abs(run.measured_sound.values) ** 2)
            for run in bracket.runs
        ]
    return figures, [*lacking, 100 * float(np.mean(foreign))]


def _truth(folder: Path, run: str) -> dict[str, np.ndarray]:
    with np.load(folder / "truth" / f"{run.replace(' ', '_')}.npz") as truth:
        return dict(truth)


def _figures(folder: Path, result: ComponentTpa) -> list[float]:
    """Trusted lines, errors, levels and coverages of one analysis; levels elsewhere stay 0."""
    error = size = 0.0
    kept, boards, coherences, levels, lines, forces, sounds = ([] for _ in range(7))
    for run in result.runs:
        truth = _truth(folder, run.name)
        stated = len(result.test.points[0].motions)
        blocked = truth["blocked"].reshape(len(run.frequency), -1, 6)[:, :, :stated]
        blocked = blocked.reshape(len(run.frequency), -1)
        rows = run.trusted
        kept.append(rows.mean())
        error += np.sum(np.abs((run.blocked.force.values - blocked)[rows]) ** 2)
        size += np.sum(np.abs(blocked[rows]) ** 2)
        boards.append(np.abs(run.on_board_level).max())
        coherences.append(np.median(run.by_line))
        levels.append(np.abs(level_difference(run.sound.values, truth["pressure"], 0)).max())
        lines.append(np.median(np.abs(20 * np.log10(np.abs(run.sound.values / truth["pressure"])))))
        forces.append(run.force_interval().holds(np.abs(blocked))[rows].mean())
        sounds.append(run.sound_interval().holds(np.abs(truth["pressure"])).mean())
    return [
        100 * float(np.mean(kept)),
        100 * float(np.sqrt(error / size)),
        float(max(boards)),
        float(min(coherences)),
        float(max(levels)),
        float(np.median(lines)),
        0.0,
        0.0,
        100 * float(np.mean(forces)),
        100 * float(np.mean(sounds)),
        result.completeness.median,
    ]
