"""A mount of a drawn bench stands at an angle that its campaign does not state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from deboom.bench.campaign import CampaignErrors, training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import load_bench
from deboom.files.campaign import read_campaign
from deboom.mounts.characterise import cross_stiffness_of_campaign
from deboom.mounts.cross_stiffness import QUANTILE


def test_the_alarm_names_the_mount_and_the_angles_that_its_runs_decide(tmp_path):
    turned = np.deg2rad([0.0, 0.0, 16.0])
    bench = load_bench(203)
    first, *others = bench.powertrain.mounts
    turn = Rotation.from_euler("xyz", turned).as_matrix()
    mounts = (replace(first, forward=turn.T @ first.forward), *others)
    tilted = replace(
        bench,
        powertrain=replace(bench.powertrain, mounts=mounts),
        rotations=np.stack([turned, np.zeros(3), np.zeros(3)]),
    )
    plan = replace(training_plan("M0"), shaker_repeats=1)
    write_campaign(tmp_path / "bench", 203, plan, CampaignErrors(), bench=tilted)
    campaign = read_campaign(tmp_path / "bench")
    assert any(mount.tilted_pieces for mount in campaign.mounts)
    unstated = tuple(replace(mount, rotations=()) for mount in campaign.mounts)
    alarm, *rest = cross_stiffness_of_campaign(replace(campaign, mounts=unstated))
    assert alarm.clear
    assert alarm.mount.startswith(first.name)
    assert len(rest) == len(others)
    assert not any(mount.clear for mount in rest)
    assert any(alarm.decided)
    for angle, deviation, true, decided in zip(
        alarm.angles, alarm.deviations, turned, alarm.decided, strict=True
    ):
        assert abs(angle - true) < QUANTILE * deviation
        if decided:
            assert abs(np.rad2deg(angle - true)) < 4.0
    stated = cross_stiffness_of_campaign(campaign)
    assert not any(mount.clear for mount in stated)
