"""Impact tests: hits chosen, windows, refusals."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import ellip

from deboom.errors import DataWarning, InputError
from deboom.measurement.impact_test import (
    ForceWindow,
    HammerMeasurement,
    HammerOptions,
    HammerTest,
    check_hits,
    hammer_frf,
    hammer_frfs,
)
from deboom.measurement.sensors import Impact
from samples.filtered_hits import struck_through

RATE, N_SAMPLE, PRETRIGGER = 2048.0, 2048, 0.0625
TIME = np.arange(N_SAMPLE) / RATE - PRETRIGGER


def push(at=0.0, peak=100.0, duration=4 / 2048):
    inside = (at < TIME) & (at + duration > TIME)
    return np.where(inside, peak * np.sin(np.pi * (TIME - at) / duration) ** 2, 0.0)


def hits(forces, **changes):
    """Two responses that ring after each push."""
    forces = np.array(forces)
    ringing = np.exp(-8 * TIME) * np.sin(2 * np.pi * 40 * TIME) * (TIME > 0)
    response = np.stack(
        [
            [np.convolve(force, gain * ringing)[:N_SAMPLE] / RATE for gain in (30.0, 0.5)]
            for force in forces
        ]
    ).transpose(0, 2, 1)
    values = {
        "impact": "I1",
        "force": forces,
        "response": response,
        "channels": ("A1 x", "ear"),
        "units": ("m/s^2", "Pa"),
        "ranges": (math.inf, math.inf),
        "rate": RATE,
        "pretrigger": PRETRIGGER,
    }
    return HammerMeasurement(**values | changes)


NOISE = np.random.default_rng(1).normal(size=N_SAMPLE)
STRONGER = push(peak=200.0)
# pulls of −17.3 and −4.8 N, then a swing of +2.2 N, all 2.9 ms after the push
RINGING = push(peak=38.0) - push(4 / RATE, 17.3) - push(8 / RATE, 4.8) + push(12 / RATE, 2.2)


@pytest.mark.parametrize(
    ("force", "changes", "words"),
    [
        # the last one is cut by the end of the block: its peak between samples is not known
        *(
            (push() + push(apart, 20.0), {}, "double hit: 2[01] % again")
            for apart in (12 / 2048, 40 / 2048, 0.25, 0.9375 - 3 / 2048)
        ),
        (push() + push(3 / 2048, 40.0), {}, "double hit"),
        (push() + 3.0 * NOISE, {}, "too weak for its noise"),
        (0 * TIME, {}, "no force: peak of 0 N"),
        (0.1 * NOISE, {}, "no force"),
        (STRONGER, {"force_range": 200.0}, "overload of 'force': 200 N in a range of 200 N"),
        (STRONGER, {"ranges": (math.inf, 0.08)}, "overload of 'ear'.*Pa in a range of 0.08 Pa"),
        (push(0.6875), {}, "late: its peak comes 0.751 s into a block of 1 s"),
        (
            push(20 / 2048, 12.0) - push(peak=80.0),
            {},
            "force reversed: it pulls with 80 N and pushes with 12 N",
        ),
        # no fault: a small echo, a swing through zero (filters and amplifiers do that, hammers only
        # push), noise, an offset, a range that is kept, and the ringing of a filter
        (push() + push(0.02, 4.0), {}, "^$"),
        (push() - push(12 / 2048, 20.0), {}, "^$"),
        (push() + 0.3 * NOISE, {}, "^$"),
        (push() + 5.0, {}, "^$"),
        (STRONGER, {"force_range": 250.0}, "^$"),
        (RINGING, {}, "^$"),
    ],
)
def test_a_hit_beside_a_good_one(force, changes, words):
    good, judged = check_hits(hits([push(), force], **changes))
    assert (good.used, good.reasons) == (True, ())
    assert judged.used == (not judged.reasons)
    assert re.search(words, " ".join(judged.reasons))


def test_a_push_that_rises_before_its_trigger_is_no_noise():
    """A trigger level is crossed on the rise: here 12 ms after its begin, of 62 ms before it."""
    soft = push(-0.012, duration=0.02)
    assert all(record.reasons == () for record in check_hits(hits([soft, soft])))


def test_a_push_before_its_trigger_says_that_the_pretrigger_is_wrong():
    (judged,) = check_hits(hits([push()], pretrigger=0.4))
    (reason,) = judged.reasons
    assert reason.startswith("early: its peak comes 0.337 s before the trigger")


def test_hits_through_a_steep_filter_pass_with_their_coherence():
    ringing = struck_through(ellip(8, 0.1, 80, 0.7 / 16, output="sos"))
    assert -ringing.force.min() > 0.2 * ringing.force.max()
    assert all(record.used for record in check_hits(ringing))
    assert hammer_frf(ringing, HammerOptions(band=(20.0, 1300.0))).coherence.min() >= 0.98


FORCES = [push(), push(peak=80.0), push() + push(0.02, 30.0), push(peak=90.0), push(peak=120.0)]


def used(estimate):
    return [record.number for record in estimate.records[0] if record.used]


def test_rejected_hits_stay_in_the_record():
    estimate = hammer_frf(hits(FORCES))
    assert used(estimate) == [1, 2, 4, 5]
    assert estimate.n_averages == (4,)
    assert "double hit" in estimate.records[0][2].reasons[0]
    np.testing.assert_allclose([r.peak for r in estimate.records[0]], [100, 80, 100, 90, 120])


def test_one_hit_has_no_coherence():
    with pytest.raises(InputError, match="coherence of one hit is 1 whatever was measured"):
        hammer_frf(hits(FORCES[:1]))
    alone = hammer_frf(hits(FORCES[:1]), HammerOptions(minimum_hits=1))
    for worth in (alone.coherence, alone.random_error):
        assert np.isnan(worth).all()
    np.testing.assert_allclose(alone.values, hammer_frf(hits(FORCES)).values, atol=1e-12)
    with pytest.raises(InputError, match="minimum_hits is 0"):
        HammerOptions(minimum_hits=0)


def test_a_null_of_the_push_is_no_line():
    """A push of 8 samples has nothing at 512 Hz; rounding over rounding is no FRF."""
    longer = hits([push(duration=8 / 2048), push(duration=8 / 2048, peak=70.0)])
    with pytest.raises(InputError, match="no input at 512 Hz in channel 1: choose a band"):
        hammer_frf(longer)
    assert hammer_frf(longer, HammerOptions(band=(5.0, 400.0))).frequency[-1] == 400


def test_too_few_good_hits_say_why():
    with pytest.raises(InputError, match=r"I1: 0 of 1 hits .*needed \(hit 1: double hit"):
        hammer_frf(hits([push() + push(0.1, 50.0)]))


def test_lines_and_units():
    estimate = hammer_frf(hits(FORCES), HammerOptions(band=(0.0, 100.0)))
    # a block of 1 s; the line at 0 Hz is left out
    np.testing.assert_allclose(estimate.frequency, np.arange(1.0, 101.0))
    with pytest.raises(InputError, match="of one unit first"):
        _ = estimate.frf
    ear = estimate.select(outputs=["ear"])
    assert ear.frf.unit == "Pa/N"
    assert ear.frf.inputs == ("I1",)
    with pytest.raises(InputError, match=r"no line from 100\.2"):
        hammer_frf(hits(FORCES), HammerOptions(band=(100.2, 100.8)))


def test_a_push_outside_the_force_window():
    options = HammerOptions(force_window=ForceWindow(0.001, 0.01, 0.002))
    assert used(hammer_frf(hits(FORCES), options)) == [1, 2, 4, 5]
    late = hits([*FORCES, push(0.125)])
    with pytest.raises(InputError, match=r"hit 6: the push peaks 0\.126 s after the trigger"):
        hammer_frf(late, options)


def test_offsets_are_taken_out_before_windows():
    options = HammerOptions(force_window=ForceWindow(0.001, 0.01), time_constant=0.1)
    shifted = hits([force + 3.0 for force in FORCES], response=hits(FORCES).response + 2.0)
    clean = hammer_frf(hits(FORCES), options)
    np.testing.assert_allclose(hammer_frf(shifted, options).values, clean.values, atol=1e-12)


def test_impacts_become_columns():
    first, second = hits(FORCES), hits(FORCES, impact="I2")
    impacts = tuple(Impact(n, np.zeros(3), np.array([0, 0, 1.0])) for n in ("I1", "I2"))
    both = hammer_frfs(HammerTest("both", impacts, (), (first, second)))
    assert both.inputs == ("I1", "I2")
    assert both.values.shape == (800, 2, 2)
    assert both.select(inputs=["I2"]).inputs == ("I2",)
    np.testing.assert_array_equal(both.values[:, :, 1], hammer_frf(second).values[:, :, 0])
    with pytest.raises(InputError, match="not the same"):
        HammerTest("wrong", impacts[:1], (), (second,))
    for other, words in (
        (hits(FORCES, impact="I2", channels=("A1 x", "seat")), "other outputs"),
        (hits(FORCES, impact="I2", rate=RATE / 2), "other frequency lines"),
    ):
        with pytest.raises(InputError, match=words):
            hammer_frfs(HammerTest("both", impacts, (), (first, other)))
    with pytest.raises(InputError, match="no impact to estimate"):
        hammer_frfs(HammerTest("none", (), (), ()))


def with_nan(array):
    array = array.copy()
    array.reshape(-1)[-1] = np.nan
    return array


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"force": np.zeros((2, N_SAMPLE))}, "impact I1: no force in any hit"),
        ({"force": with_nan(np.array(FORCES[:2]))}, r"I1: force: .* not finite at index \(1, 2047"),
        ({"response": np.zeros((2, 7, 2))}, "I1: response: shape"),
        ({"channels": ("A", "A")}, "impact I1: channels: duplicated"),
        ({"units": ("Pa",)}, "units: 2 are needed, not 1"),
        ({"pretrigger": 1.5}, "does not fit blocks of 2048 samples"),
    ],
)
def test_bad_blocks_are_named(changes, words):
    with pytest.raises(InputError, match=words):
        hits(FORCES[:2], **changes)


# responses that their blocks cut off


def ringing(modes, seconds, *, n_hit=5, noise=0.0, seed=1):
    """Hits of several strengths on modes of frequency [Hz] and damping [1], in closed form."""
    generator = np.random.default_rng(seed)
    rate, before = 512.0, 25
    time = np.arange(int(seconds * rate)) / rate
    receptance = sum(
        np.exp(-damping * 2 * np.pi * frequency * time)
        * np.sin(2 * np.pi * frequency * np.sqrt(1 - damping**2) * time)
        for frequency, damping in modes
    )
    force = np.zeros((n_hit, time.size))
    force[:, before : before + 3] = np.outer(1 + 0.2 * np.arange(n_hit), (50.0, 100.0, 60.0))
    response = np.array([np.convolve(push, receptance)[: time.size] for push in force]) / rate
    response += noise * np.abs(response).max() * generator.normal(size=response.shape)
    return HammerMeasurement(
        "I1",
        force,
        response[:, :, None],
        ("A1 x",),
        ("m/s^2",),
        (math.inf,),
        rate,
        pretrigger=before / rate,
    )


CLOSE = ((30.0, 0.0015), (31.5, 0.002))


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_two_modes_that_ring_on_are_said_to(noise):
    """e^(−ζωT) leaves 0.58 and 0.46 of the amplitudes; the peak is as much too low."""
    measurement = ringing(CLOSE, 2.0, noise=noise)
    with pytest.warns(DataWarning, match=r"of the response of 'A1 x' near 3\d\.\d Hz is left"):
        estimate = hammer_frf(measurement)
    (remainder,) = estimate.remainders
    shares = [math.exp(-2 * np.pi * f * z * remainder.seconds) for f, z in CLOSE]
    assert min(shares) - 0.03 < remainder.share < max(shares) + 0.03
    # blocks and window that it names do
    seconds, tau = (
        float(re.search(pattern, estimate.not_decayed)[1])
        for pattern in (r"blocks of ([\d.]+) s", r"time_constant=([\d.]+) ")
    )
    assert hammer_frf(measurement, HammerOptions(time_constant=tau)).not_decayed == ""
    assert hammer_frf(ringing(CLOSE, seconds + 0.05, noise=noise)).not_decayed == ""
    assert 7.0 < seconds < 14.0


def test_the_share_that_is_left_is_that_of_one_mode():
    with pytest.warns(DataWarning, match="at 1 of 1 impacts"):
        estimate = hammer_frf(ringing([(30.0, 0.004)], 2.0))
    (remainder,) = estimate.remainders
    left = math.exp(-2 * np.pi * 30.0 * 0.004 * remainder.seconds)
    assert remainder.share == pytest.approx(left, rel=0.1)
    assert remainder.frequency == pytest.approx(30.0, abs=0.3)


@pytest.mark.parametrize("seed", range(1, 13))
def test_responses_that_have_decayed_are_not_accused_whatever_the_noise(seed):
    modes = [(25.0, 0.02), (45.0, 0.02), (90.0, 0.02)]
    noise = (0.0, 0.02, 0.1, 0.3)[seed % 4]
    estimate = hammer_frf(ringing(modes, 2.0, n_hit=2 + seed % 3, noise=noise, seed=seed))
    assert estimate.not_decayed == ""


def test_a_short_block_and_one_hit_are_not_judged():
    options = HammerOptions(minimum_hits=1)
    for measurement in (ringing(CLOSE, 2.0, n_hit=1), ringing(CLOSE, 0.15)):
        (remainder,) = hammer_frf(measurement, options).remainders
        assert (remainder.share, remainder.decay_rate) == (0.0, math.inf)


def test_all_impacts_are_warned_of_once_and_selected_with_their_columns():
    impacts = tuple(Impact(name, np.zeros(3), np.eye(3)[2]) for name in ("I1", "I2"))
    measurements = (ringing(CLOSE, 2.0), replace(ringing([(30.0, 0.03)], 2.0), impact="I2"))
    with pytest.warns(DataWarning, match="at 1 of 2 impacts") as warned:
        estimate = hammer_frfs(HammerTest("plate", impacts, (), measurements))
    assert len(warned) == 1
    assert estimate.select(inputs=("I2",)).not_decayed == ""
    assert estimate.select(inputs=("I1",)).not_decayed.endswith("[s]")


def test_late_is_a_share_of_the_block():
    """A peak at 0.6 s of a block of 2 s is not late, one at 1.2 s is."""
    rate, time = 1024.0, np.arange(2048) / 1024.0
    forces = [np.where(abs(time - at) < 3e-3, 100.0, 0.0) for at in (0.6, 1.2)]
    ringing = np.sin(2 * np.pi * 40 * time)[:, np.newaxis] * np.exp(-3 * time)[:, np.newaxis]
    measured = HammerMeasurement(
        impact="I1",
        force=np.array(forces),
        response=np.stack([ringing, ringing]),
        channels=("A1 x",),
        units=("m/s^2",),
        ranges=(np.inf,),
        rate=rate,
        pretrigger=0.5,
    )
    first, second = (" ".join(hit.reasons) for hit in check_hits(measured))
    assert "late" not in first
    assert "late: its peak comes 1.2 s into a block of 2 s" in second
