"""Scatter of parts.

Coverage of the intervals of a measured scatter by simulation; and eight mount sets of the virtual
bench through the whole characterisation, their scatter against that of the bench's own curves at
equal static force. Its rubber scatters by 5 %; where stops carry the load the curves differ by
less.
"""

import tempfile
from pathlib import Path

import numpy as np

from claims import Claim, at_most, between, draws
from deboom.arrays import RealArray
from deboom.bench.campaign import training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import VirtualBench, load_bench, with_mount_set
from deboom.files.campaign import read_campaign
from deboom.mounts.characterise import characterise, measuring_chains
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.part_scatter import (
    ScatterPrior,
    batch_share,
    direction_scatter,
    hardness_share,
    library_scatter,
)

REPETITIONS = draws(4000)
SETS = tuple(f"M{number}" for number in range(1, 9))


def claims() -> list[Claim]:
    """Simulate, and characterise eight mount sets."""
    return [*_coverage(), *_bench()]


def _coverage() -> list[Claim]:
    rng = np.random.default_rng(2)
    sigma, error, prior = 0.05, 0.02, ScatterPrior(0.05, 4.0)

    def parts(count: int, true: float) -> RealArray:
        return true * rng.standard_normal(count) + error * rng.standard_normal(count)

    def covered(count: int, true: float) -> bool:
        one = direction_scatter("x", parts(count, true), np.full(count, error), prior=prior)
        return one.lower <= true <= one.upper

    thirty = np.mean([covered(30, sigma) for _ in range(REPETITIONS)])
    # a scatter that comes from the prior itself, on the variance that is observed
    few = []
    for _ in range(REPETITIONS):
        observed = prior.weight * (prior.sigma**2 + error**2) / rng.chisquare(prior.weight)
        if observed > error**2:
            few.append(covered(6, np.sqrt(observed - error**2)))
    batches = np.repeat(np.arange(6), 5)
    total, share, axes = [], [], []
    for _ in range(REPETITIONS):
        shared = np.sqrt(0.5) * sigma * rng.standard_normal((6, 1))[batches]
        values = shared + np.sqrt(0.5) * sigma * rng.standard_normal((30, 1))
        one = direction_scatter("x", values[:, 0], batches=batches)
        total.append(one.lower <= sigma <= one.upper)
        found = batch_share(values, batches)
        share.append(found is not None and found.lower <= 0.5 <= found.upper)
        common = np.sqrt(0.6) * rng.standard_normal((12, 1))
        hard = hardness_share([common + np.sqrt(0.4) * rng.standard_normal((12, 3))])
        axes.append(hard is not None and hard.lower <= 0.6 <= hard.upper)
    rows = {
        "30 parts, known uncertainty of measuring": (thirty, 94.0, 96.0),
        "6 parts, scatter drawn from the stated prior": (np.mean(few), 94.0, 96.0),
        "6 batches of 5 parts, half of the variance the batch's": (np.mean(total), 92.0, 98.0),
        "share of the batch, the same parts": (np.mean(share), 94.0, 96.0),
        "share of the hardness, 12 parts of 3 axes": (np.mean(axes), 92.0, 98.0),
    }
    return [
        between(f"coverage of the 95 % interval, {name} [%]", (low, high), 100 * value, 1)
        for name, (value, low, high) in rows.items()
    ]


def _bench() -> list[Claim]:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "campaign"
        write_campaign(folder, 1, training_plan(*SETS))
        campaign = read_campaign(folder)
        chains = measuring_chains(campaign)
        found = [characterise(campaign, name, chains=chains).mounts for name in SETS]
    parts = [mount for mounts in found for mount in mounts]
    scatter = library_scatter(parts)
    bench = load_bench()
    trusted, dominated, words = [], [], []
    for mount in dict.fromkeys(part.mount.name for part in parts):
        one = scatter.direction(f"{mount} x")
        assert one is not None
        true = float(np.std(_truth([p for p in parts if p.mount.name == mount], bench), ddof=1))
        measured = np.sqrt(max(one.observed**2 - one.measurement**2, 0.0))
        words.append(f"{mount} {100 * measured:.1f} / {100 * true:.1f}")
        (dominated if one.dominated else trusted).append((mount, measured / true))
    ratios = [ratio for _, ratio in trusted]
    hardness = scatter.hardness
    assert hardness is not None
    return [
        Claim(
            "σ of eight parts, x, measured less measuring over that of the bench's curves, "
            "where measuring does not dominate",
            "0.9 to 1.1",
            f"{min(ratios):.2f} to {max(ratios):.2f} (measured / true [%]: {', '.join(words)}; "
            f"measuring dominates: {', '.join(name for name, _ in dominated) or 'nowhere'})",
            min(ratios) >= 0.9 and max(ratios) <= 1.1,
        ),
        at_most(
            "lower end of the 95 % interval of the share of hardness, where axes have nothing in "
            "common [1]",
            0,
            hardness.lower,
        ),
    ]


def _truth(parts: list[CharacterisedMount], bench: VirtualBench) -> RealArray:
    """Mean of ln |K| of the bench's own x curves at the points where the parts were measured."""
    surface = parts[0].direction("x").surface
    assert surface is not None
    points = surface.region_.points
    deflection = np.linspace(-0.05, 0.05, 20_001)
    levels = []
    for part in parts:
        made = with_mount_set(bench, part.identity.variant)
        mounts = (*made.powertrain.mounts, *made.wheel_end.mounts)
        law = next(one for one in mounts if one.name == part.mount.name).laws[0]
        place = np.interp(points[:, 0], law.static_force(deflection), deflection)
        factor = law.dynamic_factor(points[:, 1], points[:, 2])
        levels.append(np.log(np.abs(law.tangent_stiffness(place) * factor)).mean())
    return np.array(levels)
