"""Free directions and acceptance boxes of drawn fleets.

Twenty fleets of the bench, seeds 5001 to 5020, that no rule was tuned on; group U06 in fifth gear.
Free directions: every stated interval about a design at its bounds, judged at 200 stiffness factors
drawn from it and at its ends, in all vehicles of the platform. Boxes: 95 % of the parts shall keep
each vehicle's level of today; 2^16 parts of each box are drawn anew.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from claims import Claim, at_least, at_most, draws, in_processes, reported
from deboom.bench.platform_writer import write_platform
from deboom.explore.box import BoxQuestion
from deboom.explore.largest_box import largest_box
from deboom.explore.selection import variables_without_effect
from deboom.files.platform import read_platform
from deboom.vehicles.free_directions import NOTICEABLE, free_directions, largest_changes
from deboom.vehicles.limits import MeanLevel

FLEETS = range(5001, 5001 + draws(20))
TRIED, PARTS, SHARE = 200, 2**16, 0.95


def beyond(seed: int) -> tuple[float, int, int]:
    """Return the largest change inside stated intervals [dB], and how many are free of how many."""
    with tempfile.TemporaryDirectory() as folder:
        platform = read_platform(write_platform(Path(folder) / "p", seed))
        model = platform.model(motion="prescribed", mounts="spectra")
    space = model.design_space(bounds=0.2, tolerance=0.15)
    slope = model.gradient(space.nominal[np.newaxis])[0].mean(axis=0)
    design = np.where(slope > 0.0, space.lower, space.upper)
    without = variables_without_effect(model, space)
    freedom = free_directions(model, design, space, without_effect=without)
    generator, most = np.random.default_rng(seed), 0.0
    for column, (low, high) in enumerate(freedom.interval):
        moved = np.tile(design, (TRIED + 2, 1))
        moved[:, column] = [low, high, *generator.uniform(low, high, TRIED)]
        most = max(most, float(largest_changes(model, moved, design).max()))
    return most, int(freedom.free.sum()), len(freedom.names)


def kept(seed: int) -> tuple[float, float]:
    """Return the share of new parts of a box that keep today's level: in all, and in the worst."""
    with tempfile.TemporaryDirectory() as folder:
        platform = read_platform(write_platform(Path(folder) / "p", seed))
        model = platform.model(vehicles="U06", motion="prescribed", mounts="spectra")
    space = model.design_space(bounds=0.2, tolerance=0.15)
    slope = model.gradient(space.nominal[np.newaxis])[0].mean(axis=0)
    design = np.where(slope > 0.0, space.lower, space.upper)
    response = MeanLevel(model)
    today = response(space.nominal[np.newaxis])[0]
    ends = {"lower": space.lower * 0.85, "upper": space.upper * 1.15}
    question = BoxQuestion(response, today, SHARE, **ends, together=True)
    box = largest_box(question, seed=1, points=[design]).box
    parts = np.random.default_rng(seed).uniform(box.lower, box.upper, (PARTS, len(design)))
    quiet = np.concatenate([response(part) <= today for part in np.split(parts, 16)])
    return float(quiet.all(axis=1).mean()), float(quiet.mean(axis=0).min())


def claims() -> list[Claim]:
    """Judge intervals and boxes of every fleet."""
    most, free, directions = np.transpose(in_processes(beyond, FLEETS))
    shares = np.array(in_processes(kept, FLEETS))
    return [
        at_most(
            f"{len(FLEETS)} fleets, {directions.sum():.0f} stated intervals: largest change of a "
            "vehicle's mean level or booming peak inside [dB]",
            NOTICEABLE,
            most.max(),
            3,
        ),
        reported(
            "of these, directions that are free over the whole range",
            f"{free.sum():.0f} of {directions.sum():.0f}",
        ),
        at_least(
            f"{len(FLEETS)} boxes: parts that keep today's level in all vehicles, and in the worst "
            "vehicle, least of the fleets [%]",
            100 * SHARE,
            100 * shares.min(axis=0),
            2,
        ),
    ]
