"""A mount of a drawn bench stands at an angle that its campaign does not state."""

from __future__ import annotations

import numpy as np
import pytest

from deboom.bench.powertrain import load_bench
from deboom.mounts.characterise import characterise, cross_stiffness_of_campaign
from deboom.mounts.cross_stiffness import QUANTILE
from deboom.runs.campaigns import described
from samples.turned_mounts import campaign_of, with_turned_mount, without_angles


@pytest.mark.slow("characterises campaigns of several angles")
def test_the_alarm_names_the_mount_and_the_angles_that_its_runs_decide(tmp_path):
    turned = np.deg2rad([0.0, 0.0, 16.0])
    bench = load_bench(203)
    first, *others = bench.powertrain.mounts
    campaign = campaign_of(with_turned_mount(bench, 0, turned), tmp_path / "bench", 203)
    assert any(mount.tilted_pieces for mount in campaign.mounts)
    alarm, *rest = cross_stiffness_of_campaign(without_angles(campaign))
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
    withdrawn = characterise(without_angles(campaign), "M0")
    budgets = {name: d.budget for name, d in withdrawn.directions.items() if d.budget is not None}
    turned_ones = {name for name in budgets if name.startswith(first.name)}
    assert len(turned_ones) == 3
    assert not any(budgets[name].identified for name in turned_ones)
    assert any(budgets[name].identified for name in set(budgets) - turned_ones)
    assert described(withdrawn).count("not identified: see the alarm for its mount") == 3
    stated = cross_stiffness_of_campaign(campaign)
    assert not any(mount.clear for mount in stated)
