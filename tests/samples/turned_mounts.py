"""A mount of a bench that stands at an angle, and campaigns that leave angles out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from deboom.arrays import RealArray
from deboom.bench.campaign import CampaignErrors, training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import VirtualBench
from deboom.files.campaign import read_campaign
from deboom.measurement.campaign import Campaign


def with_turned_mount(bench: VirtualBench, place: int, angles: RealArray) -> VirtualBench:
    """Turn one mount of a bench whose mounts are parallel, about the fixed axes x, y, z [rad]."""
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    mounts, rotations = list(bench.powertrain.mounts), np.zeros((len(bench.mount_names), 3))
    mounts[place] = replace(mounts[place], forward=turn.T @ mounts[place].forward)
    rotations[place] = angles
    powertrain = replace(bench.powertrain, mounts=tuple(mounts))
    return replace(bench, powertrain=powertrain, rotations=rotations)


def campaign_of(bench: VirtualBench, folder: Path, seed: int) -> Campaign:
    """Measure 27 training runs of a bench with every error of a laboratory."""
    plan = replace(training_plan("M0"), shaker_repeats=1)
    write_campaign(folder, seed, plan, CampaignErrors(), bench=bench)
    return read_campaign(folder)


def without_angles(campaign: Campaign) -> Campaign:
    """Leave out at which angles its mounts stand."""
    return replace(
        campaign, mounts=tuple(replace(mount, rotations=()) for mount in campaign.mounts)
    )
