"""From a hammer test to a compressor: what is refused, what raises an alarm, what is held out."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.compressor.hammer_identification import identify
from deboom.compressor.identified_compressor import ALARM, IdentifyOptions, misplaced
from deboom.compressor.parameter_information import quantities, quantity_deviations
from deboom.compressor.self_calibration import hold_out_lines
from deboom.errors import InputError
from deboom.files.inertance_test import read_inertance_test
from deboom.files.truth import read_compressor_truth

QUICK = IdentifyOptions(largest_lines=12)


def written(folder, plan=None):
    write_compressor_test(folder / "test", plan=plan)
    return read_inertance_test(folder / "test")


def smaller(test, impacts=slice(None, None, 2)):
    """Five sensors and every second impact: a third of the work."""
    sensors, struck = test.sensors[:5], test.impacts[impacts]
    channels = [name for sensor in sensors for name in sensor.channels]
    frf = test.frf.select(channels, [impact.name for impact in struck])
    coherence = test.coherence[:, : len(channels), impacts]
    return replace(test, sensors=sensors, impacts=struck, frf=frf, coherence=coherence)


def with_values(test, values):
    return replace(test, frf=replace(test.frf, values=values))


def scaled(items, factor):
    return tuple(replace(item, position=factor * item.position) for item in items)


@pytest.fixture(scope="module")
def test(tmp_path_factory):
    return written(tmp_path_factory.mktemp("rigid"))


@pytest.fixture(scope="module")
def identified(test):
    return identify(smaller(test), IdentifyOptions(largest_lines=30))


def test_a_good_test_raises_no_alarm(identified):
    assert identified.alarms == ()
    assert identified.calibrated.reduced_chi == pytest.approx(0.9, abs=0.15)
    assert np.count_nonzero(identified.fitted) == 30
    assert identified.rigid.is_rigid
    assert "does not drift" in identified.rigid.statement
    assert misplaced(identified.calibrated, identified.test.tolerances) == ()
    assert len(identified.modes.frequency) == 6


def test_held_out_lines_are_predicted(identified):
    (lines,) = identified.held_out
    assert lines.what == "251 lines from 10.5 to 149.5 Hz"
    assert lines.reduced_chi == pytest.approx(0.9, abs=0.2)
    assert lines.relative_error < 0.02


def test_held_out_lines_see_a_wrong_model(identified):
    """Mass 5 % off: the prediction misses by many times the noise."""
    values = identified.calibrated.values.copy()
    values[0] += 0.05
    between = ~identified.fitted & (identified.raw.frf.frequency > 100)
    right = hold_out_lines(identified.calibrated, identified.raw.select(between))
    wrong = hold_out_lines(
        replace(identified.calibrated, values=values), identified.raw.select(between)
    )
    assert right.reduced_chi < ALARM < 3 * ALARM < wrong.reduced_chi


def limit_of_the_rigid_body(path, tolerance=0.03):
    """Where the exact apparent mass seen by the true rows leaves that of the rigid body [Hz]."""
    truth = np.load(path)
    response = np.linalg.pinv(truth["response_matrix"])
    seen = response @ truth["frf"] @ np.linalg.pinv(truth["excitation_matrix"]).T
    scale = np.repeat([1.0, 1 / 0.055], 3)
    weight = np.outer(scale, scale)
    change = np.linalg.norm(weight * (np.linalg.inv(seen) - truth["apparent_mass"]), axis=(1, 2))
    size = np.linalg.norm(weight * truth["apparent_mass"][-1])
    above = truth["frequency"] > 40
    return truth["frequency"][above][np.argmax(change[above] > tolerance * size)]


def test_a_flexible_body_is_reported_with_the_limit_of_the_rigid_model(tmp_path):
    test = written(tmp_path, CompressorPlan(flexible_body=300.0))
    identification = identify(smaller(test), QUICK)
    assert not identification.rigid.is_rigid
    true_limit = limit_of_the_rigid_body(tmp_path / "test" / "truth" / "truth.npz")
    assert identification.rigid.holds_to == pytest.approx(true_limit, rel=0.2)
    text = " ".join(identification.alarms)
    assert f"the rigid model holds to {identification.rigid.holds_to:.0f} Hz" in text
    assert "times the noise (alarm at 1.5)" in text
    truth = read_compressor_truth(tmp_path / "test").model
    misses = quantities(identification.calibrated.model).values - quantities(truth).values
    # without the residual term they are some 40 σ off, root mean square
    score = misses / quantity_deviations(identification.calibrated)
    assert np.sqrt(np.mean(score**2)) < 2.5


def test_a_place_beyond_its_tolerance_is_named(test):
    """A sensor 15 mm off its sheet is ten times the tolerance of 1.5 mm."""
    moved = smaller(test)
    off = replace(moved.sensors[2], position=moved.sensors[2].position + 0.015 * np.eye(3)[1])
    identification = identify(
        replace(moved, sensors=(*moved.sensors[:2], off, *moved.sensors[3:])), QUICK
    )
    assert "Further from the sheet than its tolerances allow: A3" in " ".join(identification.alarms)


# ------------------------------------------------------------------ refusals


def taken(axis, **swapped):
    """Take channels (1) or impacts (2) of the test in another order."""

    def change(test):
        places = {int(key[1:]): value for key, value in swapped.items()}
        order = [places.get(n, n) for n in range(test.frf.values.shape[axis])]
        return with_values(test, np.take(test.frf.values, order, axis))

    return change


def reversed_at(*place):
    def change(test):
        values = test.frf.values.copy()
        values[place] *= -1
        return with_values(test, values)

    return change


def stated_as(other):
    """Functions of another convention or quantity under the label of inertances."""

    def change(test):
        jw = 2j * np.pi * test.frf.frequency[:, None, None]
        return with_values(test, other(test.frf.values, jw))

    return change


def moved(**factors):
    return lambda test: replace(
        test, **{name: scaled(getattr(test, name), factor) for name, factor in factors.items()}
    )


def mostly_incoherent(test):
    coherence = test.coherence * np.resize([0.6, 0.6, 0.2], (len(test.coherence), 1, 1))
    return replace(test, coherence=coherence)


EVERY = slice(None)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (reversed_at(EVERY, 4), "sensor A2 contradicts all others: A2 y: reversed sign"),
        (reversed_at(EVERY, EVERY, 5), "impact I06 contradicts all others: I06: reversed sign"),
        (reversed_at(EVERY), "They are reversed: the hammer's force, or all accelerations"),
        (stated_as(lambda a, _: a.conj()), r"They are conjugated: they follow exp\(−jωt\)"),
        (stated_as(lambda a, jw: a / jw), "They are likely mobility"),
        (stated_as(lambda a, jw: a / jw**2), "They are likely receptance"),
        (
            stated_as(lambda a, _: 1 / a),
            "likely force over acceleration, each function the",
        ),
        (taken(1, n6=7, n7=6), "A3: swapped axes, A3 x carries y, A3 y carries x"),
        (taken(1, n6=10, n10=6), "A3 x and A4 y are exchanged"),
        (taken(1, n6=9, n7=10, n8=11, n9=6, n10=7, n11=8), "A3 and A4 are exchanged"),
        (taken(2, n2=9, n9=2), "I03 and I10 are exchanged"),
        (moved(sensors=1e3, impacts=1e3), "check the length unit of the position sheet"),
        (moved(impacts=1e3), "one of the two is in another unit of length"),
        (moved(sensors=1e3), "one of the two is in another unit of length"),
        (lambda test: with_values(test, test.frf.values / 9.81), r"6.81 kg, 9\.\d+ times apart"),
        (mostly_incoherent, "median coherence is 0.60"),
    ],
)
def test_what_contradicts_itself_is_refused_by_name(test, change, words):
    with pytest.raises(InputError, match=words):
        identify(change(test), QUICK)


def test_functions_with_the_decay_of_a_window_are_refused(test):
    windowed = replace(test, frf=replace(test.frf, added_decay_rate=2.5))
    with pytest.raises(InputError, match=r"exponential window, 2\.5 1/s, so their peaks are too"):
        identify(windowed, QUICK)


def test_hits_that_had_not_decayed_are_an_alarm(identified):
    doubtful = replace(
        identified, test=replace(identified.test, doubts=("49 % of the response is left",))
    )
    assert doubtful.alarms == ("49 % of the response is left.",)


def test_a_line_at_0_hz_and_an_impossible_drawing_are_refused(test):
    with pytest.raises(InputError, match="a line at 0 Hz"):
        replace(test, frf=replace(test.frf, frequency=test.frf.frequency - test.frf.frequency[0]))
    with pytest.raises(InputError, match=r"principal moment of -0.015 kg m²"):
        replace(test.drawing, inertia=test.drawing.inertia * [[-1, 1, 1], [1, 1, 1], [1, 1, 1]])
    with pytest.raises(InputError, match="not symmetric"):
        replace(test.drawing, inertia=test.drawing.inertia + 1e-3 * np.eye(3, k=1))
