"""A measuring chain that calibrates itself by noisy runs of a drawn bench."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.campaign import TRAINING_RUNS, CampaignErrors, CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import DRAWING, load_bench
from deboom.files.campaign import read_campaign
from deboom.mounts.campaign_findings import campaign_findings
from deboom.mounts.characterise import characterise, measuring_chains
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


FEW_RUNS = CampaignPlan((DRAWING,), TRAINING_RUNS[::9])


def forces(folder, bench_frequency):
    """Write few runs of a bench whose first mode adds 15 % of the force there; read its forces."""
    errors = CampaignErrors()
    chain = replace(errors.chain, bench_frequency=bench_frequency, bench_flexibility=0.15)
    chain = replace(chain, force_own=0.0, force_norm=0.0, force_floor=0.0)
    quiet = replace(errors, chain=chain)
    campaign = read_campaign(write_campaign(folder, 31, FEW_RUNS, quiet, bench=load_bench(31)))
    body, *_ = instrumented_bodies(campaign)
    record = body_record(body, campaign.runs, campaign.tolerances)
    return campaign, record.cell_force @ body.force_matrix.T


@pytest.fixture(scope="module")
def benches(tmp_path_factory):
    folder = tmp_path_factory.mktemp("benches")
    return {hertz: forces(folder / f"{hertz:g}", hertz) for hertz in (120.0, 1e6)}


def test_a_mode_of_the_test_bench_is_divided_out_of_the_forces(benches):
    """Uncorrected, a bench with a mode at 120 Hz shows 4.5 % more force at 80 than at 20 Hz."""
    (campaign, moved), (_, stiff) = benches[120.0], benches[1e6]
    frequency = np.concatenate([run.frequency for run in campaign.runs])
    size = np.linalg.norm(moved, axis=1) / np.linalg.norm(stiff, axis=1)
    at_ends = [size[frequency == line].mean() for line in (20.0, 80.0)]
    assert at_ends == pytest.approx([1.0, 1.0], abs=2e-3)


def test_a_mode_of_the_test_bench_is_named(benches):
    sentence = r"matrix of EnM, GeM, TSM changes by up to \d\.\d % over .* most at 80 Hz"
    findings = {hertz: campaign_findings(campaign) for hertz, (campaign, _) in benches.items()}
    assert any(re.search(sentence, finding.sentence) for finding in findings[120.0])
    assert not findings[1e6]


def test_mounts_are_withdrawn_where_the_shaker_does_not_reach_a_bench_that_gives_way(benches):
    campaign, _ = benches[120.0]
    below = campaign.shaker_runs[0].response.frequency <= 70
    short = []
    for run in campaign.shaker_runs:
        frf = run.response
        part = replace(frf, frequency=frf.frequency[below], values=frf.values[below])
        short.append(replace(run, response=part))
    result = characterise(replace(campaign, shaker_runs=tuple(short)), DRAWING)
    assert any("shaker's from 20 to 70 Hz do not reach" in alarm for alarm in result.alarms)
    assert not result.directions["TSM x"].budget.identified
    assert not characterise(campaign, DRAWING).alarms
