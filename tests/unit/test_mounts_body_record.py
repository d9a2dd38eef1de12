"""A dead channel is refused by what physics allows it to show, not by its neighbours alone."""

from dataclasses import replace

import numpy as np
import pytest
from mounts_campaign_samples import EXACT, SIDES, Ramp, Rig, campaign_of

from deboom.errors import InputError
from deboom.measurement.tolerances import Tolerances
from deboom.mounts.body_record import body_record
from deboom.mounts.instrumented_body import instrumented_bodies
from deboom.physics.rigid_body import rotation_matrix

RAMP = Ramp(120.0, full_load=True)


def records_of(**changes):
    campaign = campaign_of(Rig(ramps=(RAMP,), **changes))
    return [
        body_record(body, campaign.runs, campaign.tolerances)
        for body in instrumented_bodies(campaign)
    ]


@pytest.mark.parametrize("tolerances", [EXACT, Tolerances()])
@pytest.mark.parametrize(
    ("name", "left"),
    [
        *((name, 0.0) for name in ("A3 x", "C1 z", "A8 x", "A9 z", "C4 x", "C5 y")),
        # along the motion of a wheel end a channel sets the level of its own neighbours
        *((name, 1e-5) for name in ("A3 x", "C1 z", "A9 z", "C5 y")),
    ],
)
def test_dead_channel_of_any_body(name, left, tolerances):
    with pytest.raises(InputError, match=f"channel '{name}' is dead"):
        records_of(channel_gain={name: left}, tolerances=tolerances)


def with_side_sensors(monkeypatch, angles):
    """Turn the sensors of both wheel ends, in truth and on the position sheet."""
    turned = {one.name: replace(one, orientation=rotation_matrix(angles)) for one in SIDES}
    monkeypatch.setattr("mounts_campaign_samples.SIDES", tuple(turned.values()))
    return tuple(turned.get(one.name, one) for one in Rig().sensors)


def test_wheel_end_without_any_error_shows_nothing_across_its_motion(monkeypatch):
    """An exact sensor across an exact motion reads 0, and is not dead for that."""
    known = with_side_sensors(monkeypatch, (0.0, 0.0, 0.0))
    _, left, right = records_of(sensors=known)
    for record in (left, right):
        assert np.all(record.acceleration[:, 1:] == 0)
        assert np.all(record.acceleration[:, 0] != 0)


def test_the_same_reading_is_dead_where_the_bench_states_its_errors(monkeypatch):
    """With stated tilt and cross-talk a channel across the motion cannot read 0."""
    known = with_side_sensors(monkeypatch, (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="channel 'A8 y' is dead"):
        records_of(sensors=known, tolerances=Tolerances())


def test_body_that_never_moves():
    silent = {f"{name} {axis}": 0.0 for name in ("A8",) for axis in "xyz"}
    with pytest.raises(InputError, match="channel 'A8 x' is dead"):
        records_of(channel_gain=silent)


def test_small_tilt_without_errors_is_alive(monkeypatch):
    """A small share of the motion is what the position sheet lets the channel show."""
    known = with_side_sensors(monkeypatch, (0.0, 2e-4, 0.26))
    assert len(records_of(sensors=known)) == 3
    with pytest.raises(InputError, match="channel 'A9 z' is dead"):
        records_of(sensors=known, channel_gain={"A9 z": 1e-4})
