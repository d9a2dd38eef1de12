"""Time data → order spectra → dynamic stiffness, against the bench's truth and its spectra."""

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from deboom.bench.campaign import NO_ERRORS, CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.files.campaign import read_campaign
from deboom.mounts.characterise import measuring_chains
from deboom.mounts.measuring_chain import body_record
from deboom.mounts.operating_map import operating_maps
from deboom.runs.campaigns import orders_into_campaign

RUNS = (
    PlannedRun(5, 220.0, full_load=True),
    PlannedRun(5, 60.0, full_load=False),
    PlannedRun(6, 140.0, full_load=False),
    PlannedRun(7, 100.0, full_load=False),
)
LINES = np.arange(38.5, 51.6, 0.25)
TIME_RUN = "g5_wot220_time"


def measured(folder, runs=RUNS, errors=None):
    over_time = TimeRunPlan(sample_rate=2048.0)
    plan = CampaignPlan(("M1",), runs, 1, frequency=LINES, time_run=over_time)
    return write_campaign(folder, 1, plan, errors)


def maps_and_truth(folder, run):
    """Return maps of one run and of the same one as order spectra; the truth by channel."""
    campaign = read_campaign(folder)
    with threadpool_limits(1):
        chains = measuring_chains(campaign)
        maps, stated = (
            operating_maps(
                chains,
                [
                    body_record(
                        chain.alignment.body,
                        [
                            measured_run
                            for measured_run in campaign.runs
                            if measured_run.name == name
                        ],
                        campaign.tolerances,
                    )
                    for chain in chains
                ],
            )
            for name in (run, "g5_wot220")
        )
    with np.load(folder / "truth" / f"{TIME_RUN}.npz") as data:
        rows = np.searchsorted(data["frequency"], LINES - 1e-6)
        truth = dict(zip(data["channels"].tolist(), data["stiffness"][rows].T, strict=True))
    return maps, stated, truth


def true_stiffness(lines, truth):
    labels = dict.fromkeys(str(label) for label in lines.run)
    pieces = [label.partition(" ")[2] for label in labels]
    channels = [" ".join(filter(None, (lines.mount, piece, lines.axis))) for piece in pieces]
    return np.concatenate([truth[channel] for channel in channels])


def rms(ratio):
    return float(np.sqrt(np.mean(np.abs(ratio - 1) ** 2)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Keep a campaign whose time run was tracked."""
    made = measured(tmp_path_factory.mktemp("measured") / "campaign")
    orders_into_campaign(made, TIME_RUN, name="tracked")
    return made


def test_time_data_give_the_stiffness_that_order_spectra_give(folder):
    maps, stated, truth = maps_and_truth(folder, "tracked")
    assert len(maps["TSM x"]) == LINES.size
    for name, lines in maps.items():
        if not name.endswith("y"):
            true = true_stiffness(lines, truth)
            assert rms(lines.stiffness / true) < rms(stated[name].stiffness / true) + 0.002
            assert rms(lines.stiffness / stated[name].stiffness) < 0.008
    assert rms(maps["TSM x"].stiffness / true_stiffness(maps["TSM x"], truth)) < 0.025
    torque = maps["TSM x"].wheel_torque / stated["TSM x"].wheel_torque
    assert rms(torque) < 0.01
    assert maps["TSM x"].static_force == pytest.approx(stated["TSM x"].static_force, abs=25)


@pytest.mark.slow("writes and characterises another campaign")
def test_without_errors_the_smear_of_the_run_up_leaves_the_stiffness_alone(tmp_path):
    made = measured(tmp_path / "campaign", RUNS[:2], NO_ERRORS)
    tracked, _ = orders_into_campaign(made, TIME_RUN)
    assert 1.5 < tracked.order.smear.max() < 1.8
    maps, _, truth = maps_and_truth(made, TIME_RUN)
    for lines in maps.values():
        assert rms(lines.stiffness / true_stiffness(lines, truth)) < 0.001
