"""Loss and delay of mounts in runs: whether force and displacement belong together in time.

Rubber loses a few to some ten percent of what it stores, and its phase hardly changes over
frequency. A channel that is late turns the phase in proportion to frequency; forces of another run
turn it anyhow.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from deboom.measurement.channels import LoadCase

USUAL_LOSS = (0.02, 0.6)
"""Loss factors of rubber and of hydraulic mounts off their resonance [1]."""
LARGEST_UNUSUAL = 0.5
"""Share of a direction's lines beyond `USUAL_LOSS` that passes [1]."""
NAMED_DELAY = 0.5e-3
"""Delay of all forces from which on it is named [s]."""
NAMED_DELAY_OF_ONE = 1.0e-3
"""The same of one direction alone [s]: hydraulic mounts imitate up to 0.85 ms."""
LEAST_SHARE = 0.2
"""Motion of a direction over that of its mount's most moving one from which on it is judged [1].
Below, cross-talk of sensors and half a degree of angle imitate delays, and loss factors of any
size: in 60 drawn runs up to 13 ms below 0.15, up to 2.5 ms below 0.2, and nothing above."""
SHARE_OF_ONE = 0.4
"""The same from which on the loss factors of one direction alone are named [1]: with an
accelerometer out of order they are wrong by up to 0.3 at 0.28."""
NAMED_PHASE = 10.0
"""Phase of a delay at the last line from which on it is named [degrees]."""
JUDGED = 0.5
"""Coherence over all lines from which on a direction's delay is fitted [1]."""
UNRELATED = 0.2
"""Coherence below which all directions of a run have no phase [1]."""
LONGEST_DELAY = 20e-3
"""Delay that is looked for at most [s]."""
QUANTILE = 1.96
"""Half width of an interval of 95 % over its standard deviation."""


@dataclass(frozen=True)
class Loss:
    """How one direction of a mount loses energy in a run.

    - `channel`: ``<mount> [<piece>] <axis>``, along the axes of the mount.
    - `factor`: median loss factor over the lines [1]. `phase`: of the stiffness over all lines
      [degrees].
    - `unusual`: share of the lines whose loss factor is beyond `USUAL_LOSS` [1].
    - `share`: motion over that of the mount's most moving direction [1].
    - `coherence`: of force and displacement, at its best delay [1].
    - `delay`, `deviation`: force behind displacement, and its standard deviation [s].
    """

    channel: str
    factor: float
    phase: float
    unusual: float
    share: float
    coherence: float
    delay: float
    deviation: float

    @property
    def judged(self) -> bool:
        """Whether the direction moves enough to tell its loss."""
        return self.share >= LEAST_SHARE and self.coherence >= JUDGED


def losses(load_case: LoadCase) -> tuple[Loss, ...]:
    """Return the losses of a run's directions, see `deboom.mounts.mount.in_mount_axes`.

    The delay maximises ``|Σ f s* e^{jωτ}|``; its deviation comes from the scatter of the phases
    that it leaves.
    """
    omega = 2.0 * np.pi * load_case.force.frequency
    grid = np.linspace(-LONGEST_DELAY, LONGEST_DELAY, 81)
    turns = np.exp(1j * np.outer(grid, omega))
    fine = np.linspace(-1.0, 1.0, 81) * (grid[1] - grid[0])
    moved = np.linalg.norm(load_case.displacement.values, axis=0)
    names = load_case.displacement.channels
    largest: dict[str, float] = {}
    for name, size in zip(names, moved, strict=True):
        mount = name.rpartition(" ")[0]
        largest[mount] = max(largest.get(mount, 0.0), float(size))
    rows = []
    for name, force, displacement in zip(
        load_case.force.channels,
        load_case.force.values.T,
        load_case.displacement.values.T,
        strict=True,
    ):
        cross = force * displacement.conj()
        size = np.sqrt(np.vdot(force, force).real * np.vdot(displacement, displacement).real)
        if not size > 0.0:
            continue
        first = grid[int(np.argmax(np.abs(turns @ cross)))]
        finer = np.abs(np.exp(1j * np.outer(first + fine, omega)) @ cross)
        delay = float(first + fine[int(np.argmax(finer))])
        turned = cross * np.exp(1j * omega * delay)
        weight = np.abs(cross) / np.sum(np.abs(cross))
        spread = np.sqrt(np.sum(weight * omega**2) - np.sum(weight * omega) ** 2)
        scatter = np.sqrt(np.sum(weight * np.angle(turned * np.conj(turned.sum())) ** 2))
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = cross.imag / cross.real
        usual = (cross.real > 0) & (factor >= USUAL_LOSS[0]) & (factor <= USUAL_LOSS[1])
        rows.append(
            Loss(
                channel=name,
                factor=float(np.median(factor[np.isfinite(factor)], axis=0)),
                phase=float(np.angle(cross.sum(), deg=True)),
                unusual=float(np.mean(~usual)),
                share=float(np.linalg.norm(displacement)) / largest[name.rpartition(" ")[0]],
                coherence=float(np.abs(turned.sum()) / size) ** 2,
                delay=delay,
                deviation=float(scatter / spread / np.sqrt(omega.size)),
            )
        )
    return tuple(rows)


def loss_faults(
    load_cases: Sequence[LoadCase], what: str = "load case"
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Give a sentence for each run, and each direction, whose force and motion differ in time.

    - `load_cases`: along the axes of the mounts. `what`: what a reader calls them.
    - returns: sentences on delays, and on loss factors that no rubber has.
    """
    of_case = {case.name: losses(case) for case in load_cases}
    last = max((float(case.force.frequency[-1]) for case in load_cases), default=0.0)
    factors = [
        sentence for name, rows in of_case.items() for sentence in _unusual(f"{what} {name}", rows)
    ]
    return tuple(_late(of_case, last)), tuple(factors)


def _unusual(which: str, rows: Sequence[Loss]) -> Iterator[str]:
    judged = [row for row in rows if row.judged]
    if rows and max(row.coherence for row in rows) < UNRELATED:
        yield (
            f"{which}: the phase between force and displacement changes from line to line at all "
            "mounts: record both at once, with the phase of one tacho"
        )
    unusual = [row for row in judged if row.unusual > LARGEST_UNUSUAL]
    beyond = f"beyond {USUAL_LOSS[0]:g} to {USUAL_LOSS[1]:g} on"
    if len(unusual) > 1 and len(unusual) > len(judged) // 2:
        middle = float(np.median([row.factor for row in judged]))
        angle = float(np.median([row.phase for row in judged]))
        yield (
            f"{which}: {len(unusual)} of {len(judged)} directions have loss factors {beyond} more "
            f"than half of their lines (median {middle:.2g}, phase {angle:+.0f} degrees): are its "
            "forces and displacements those of one run, with the phase of one tacho?"
        )
        return
    alone = [row for row in unusual if row.share >= SHARE_OF_ONE]
    if alone:
        names = ", ".join(
            f"{row.channel} ({100 * row.unusual:.0f} % of its lines, median {row.factor:.2g}, "
            f"phase {row.phase:+.0f} degrees)"
            for row in alone
        )
        yield (
            f"{which}: loss factors are {beyond} more than half of the lines of {names}: check the "
            "signs, axes and phases of force and displacement"
        )


def _late(of_case: Mapping[str, Sequence[Loss]], last: float) -> Iterator[str]:
    """Name all forces, or one direction, that are late in most runs; `last` line [Hz]."""
    common: list[float] = []
    single: dict[str, list[float]] = {}
    for rows in of_case.values():
        judged = [row for row in rows if row.judged]
        if not judged:
            continue
        middle = float(np.median([row.delay for row in judged]))
        width = QUANTILE * float(np.median([row.deviation for row in judged]))
        if _named(middle, width, last, NAMED_DELAY):
            common.append(middle)
        for row in judged:
            delay = row.delay - middle
            if _named(delay, QUANTILE * row.deviation, last, NAMED_DELAY_OF_ONE):
                single.setdefault(row.channel, []).append(delay)
    late = {"the forces of all mounts are": common} | {
        f"the force of {channel} is": delays for channel, delays in single.items()
    }
    for which, delays in late.items():
        if 2 * len(delays) > len(of_case):
            middle = float(np.median(delays))
            yield (
                f"{which} {1e3 * abs(middle):.1f} ms {'late' if middle > 0 else 'ahead'} against "
                f"displacement ({1e3 * min(delays):+.2f} to {1e3 * max(delays):+.2f} ms in "
                f"{len(delays)} of {len(of_case)} runs): is a channel late, by a filter or another "
                "recorder? Correct the delay where it is recorded"
            )


def _named(delay: float, width: float, last: float, least: float) -> bool:
    """Whether a delay is beyond its interval and large enough to be named."""
    turned = 360.0 * last * abs(delay)
    return abs(delay) > width and abs(delay) >= least and turned >= NAMED_PHASE
