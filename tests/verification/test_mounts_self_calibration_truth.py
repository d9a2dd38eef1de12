"""A measuring chain that calibrates itself by noisy runs of a drawn bench."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.campaign import TRAINING_RUNS, CampaignErrors, CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import DRAWING, load_bench
from deboom.files.campaign import read_campaign
from deboom.mounts.characterise import measuring_chains
from deboom.mounts.measuring_chain import body_record, instrumented_bodies

TIMES = 6.0
NOISE = ("acceleration_own", "acceleration_norm", "acceleration_floor")


@pytest.fixture(scope="module")
def noisy_campaign(tmp_path_factory):
    """Nine runs whose accelerometers have six times the usual noise, which is stated."""
    errors = CampaignErrors()
    noisy = {name: TIMES * getattr(errors.chain, name) for name in NOISE}
    folder = write_campaign(
        tmp_path_factory.mktemp("noisy") / "bench",
        31,
        CampaignPlan((DRAWING,), TRAINING_RUNS[::3]),
        replace(errors, chain=replace(errors.chain, **noisy)),
        bench=load_bench(31),
    )
    return read_campaign(folder)


def test_noise_that_a_rigid_body_shows_takes_the_place_of_less_that_is_stated(noisy_campaign):
    body, *_ = instrumented_bodies(noisy_campaign)
    runs, right = noisy_campaign.runs_of(DRAWING), noisy_campaign.tolerances
    less = replace(right, **{name: getattr(right, name) / TIMES for name in NOISE})
    seen, stated = (body_record(body, runs, tolerances) for tolerances in (less, right))
    np.testing.assert_allclose(seen.acceleration_noise / stated.acceleration_noise, 1.0, atol=0.02)


def test_noise_does_not_show_as_gains_along_axes_that_hardly_move(noisy_campaign):
    """Its product with itself, not corrected for, makes gains of 4 tolerances along y."""
    chain, *_ = measuring_chains(noisy_campaign)
    score = chain.mean / chain.alignment.tolerance
    assert np.max(np.abs(score)) < 2.5
    assert np.sqrt(np.mean(score**2)) < 0.8
