"""Runs of shafts with a zebra tape: its seam is of any width, its stripes differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.tacho import repair_pulses, shaft_angle

RUNS = ((12.0, 3.0), (24.0, -3.0), (15.0, 0.0), (12.0, 9.0))
"""First speed and its change [rev/s], [rev/s²]."""
SECONDS = 4.0
JITTERS = (0.0, 0.002, 0.01)
"""Standard deviation of a pulse [pitches]."""


@dataclass(frozen=True)
class Tape:
    """Seam, unevenness of the stripes and jitter in pitches, and the run of its shaft."""

    stripes: int
    seam: float
    uneven: float
    jitter: float
    run: tuple[float, float]

    @property
    def like_teeth(self) -> bool:
        """Whether the seam lies within 3 σ of a step, or of its mean, of 2 or 3 whole pitches."""
        scatter = np.hypot(np.sqrt(2) * self.jitter, self.uneven / np.sqrt(3))
        return bool(min(abs(self.seam - 2), abs(self.seam - 3)) < max(3 * scatter, 0.03))

    def pulses(self, generator: np.random.Generator, seconds: float = SECONDS) -> RealArray:
        """Return the times at which stripes pass [s]."""
        steps = np.append(1 + self.uneven * generator.uniform(-1, 1, self.stripes - 1), self.seam)
        edges = np.concatenate([[0.0], np.cumsum(steps)])
        fine = np.linspace(0, seconds, 20_001)
        first, slope = self.run
        turned = first * fine + slope * fine**2 / 2
        turns = np.arange(int(turned[-1]) + 2)[:, np.newaxis]
        passing = (turns + edges[:-1] / edges[-1] + generator.uniform()).ravel()
        passing += self.jitter / edges[-1] * generator.standard_normal(passing.size)
        passing = np.unique(passing[(passing > 0) & (passing < turned[-1])])
        return np.interp(passing, turned, fine)


def draw_tapes(n_tape: int) -> list[Tape]:
    """Draw tapes, a power of two of them."""
    return [
        Tape(
            stripes=round(8 * (180 / 8) ** stripes),
            seam=0.3 + 3.2 * seam,
            uneven=0.05 * uneven,
            jitter=JITTERS[int(len(JITTERS) * jitter)],
            run=RUNS[int(len(RUNS) * run)],
        )
        for stripes, seam, uneven, jitter, run in qmc.Sobol(5, seed=1).random(n_tape)
    ]


def speed_error(tape: Tape, seed: int) -> float | None:
    """Return the largest error of the speed away from the ends [%], None where it is refused."""
    times = tape.pulses(np.random.default_rng(seed))
    try:
        shaft = shaft_angle(repair_pulses(times, tape.stripes))
    except InputError:
        return None
    inside = np.linspace(shaft.begin, shaft.end, 1001)[20:-20]
    first, slope = tape.run
    return float(100 * np.abs(shaft.rpm(inside) / (60 * (first + slope * inside)) - 1).max())
