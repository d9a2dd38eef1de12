"""Scatter of parts.

Coverage of the intervals of a measured scatter, by simulation.
"""

import numpy as np

from claims import Claim, between, draws
from deboom.arrays import RealArray
from deboom.mounts.part_scatter import ScatterPrior, batch_share, direction_scatter, hardness_share

REPETITIONS = draws(4000)


def claims() -> list[Claim]:
    """Draw parts and count the intervals."""
    rng = np.random.default_rng(2)
    sigma, error, prior = 0.05, 0.02, ScatterPrior(0.05, 4.0)

    def parts(count: int, true: float) -> RealArray:
        return true * rng.standard_normal(count) + error * rng.standard_normal(count)

    def covered(count: int, true: float) -> bool:
        scatter = direction_scatter("x", parts(count, true), np.full(count, error), prior=prior)
        return scatter.lower <= true <= scatter.upper

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
        scatter = direction_scatter("x", values[:, 0], batches=batches)
        total.append(scatter.lower <= sigma <= scatter.upper)
        estimated = batch_share(values, batches)
        share.append(estimated is not None and estimated.lower <= 0.5 <= estimated.upper)
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
