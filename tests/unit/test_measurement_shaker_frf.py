"""FRFs out of continuous excitation: truth recovered, overload, and what is refused."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.frf_estimate import Estimator, imported_estimate, require_coherence
from deboom.measurement.shaker_frf import BlockWindow, ShakerRecord, WelchOptions, shaker_frf

RATE = 512.0
FILTERS = np.array([[[1.0, 0.5, 0.0], [0.0, -2.0, 1.0]], [[0.3, 0.0, 0.9], [1.5, 0.2, 0.0]]])
"""Impulse responses of three samples, output by input: their FRF is a sum of three terms."""


def truth(frequency):
    delay = np.exp(-2j * np.pi * np.outer(frequency, np.arange(3)) / RATE)
    return np.einsum("oit,ft->foi", FILTERS, delay)


def record(n_sample=40000, noise=0.0, seed=1, n_input=2, **changes):
    generator = np.random.default_rng(seed)
    x = generator.normal(size=(n_sample, n_input))
    y = sum(
        np.convolve(x[:, i], FILTERS[o, i])[:n_sample, np.newaxis] * (np.arange(2) == o)
        for o in range(2)
        for i in range(n_input)
    )
    values = {
        "inputs": x,
        "outputs": y + noise * generator.normal(size=y.shape),
        "input_names": tuple("PQ"[:n_input]),
        "output_names": ("A", "B"),
        "input_units": ("N",) * n_input,
        "output_units": ("m/s^2", "m/s^2"),
        "rate": RATE,
    }
    return ShakerRecord(**values | changes)


@pytest.mark.parametrize("estimator", [Estimator.H1, Estimator.H2, Estimator.HV])
def test_two_shakers_at_once(estimator):
    """Blocks of 512 samples against a memory of 3: bias below 1 %."""
    estimate = shaker_frf(record(), WelchOptions(512, estimator=estimator, band=(5.0, 250.0)))
    expected = truth(estimate.frequency)
    assert np.abs(estimate.values - expected).max() < 0.03
    assert estimate.multiple_coherence.min() > 0.99
    assert estimate.frf.unit == "(m/s^2)/N"
    assert estimate.inputs == ("P", "Q")


def test_random_error_covers_the_truth():
    estimate = shaker_frf(record(noise=1.0), WelchOptions(128, band=(10.0, 240.0)))
    expected = truth(estimate.frequency)
    off = np.abs(np.abs(estimate.values) / np.abs(expected) - 1) / estimate.random_error
    # entries without a zero nearby; two thirds inside one standard deviation
    inside = np.mean(off[np.abs(expected) > 0.3] < 1)
    assert 0.55 < inside < 0.8
    n_block = len(estimate.records[0])
    assert 0.9 * n_block < estimate.n_averages[0] < n_block
    assert np.all(estimate.coherence <= estimate.multiple_coherence + 1e-9)


def test_bursts_need_no_window():
    """Excitation and response begin and die out inside each block: exact without a window."""
    burst = record(n_sample=256 * 8, n_input=1)
    inside = (np.arange(256 * 8) % 256 < 200)[:, np.newaxis]
    x = burst.inputs * inside
    y = np.stack([np.convolve(x[:, 0], FILTERS[o, 0])[: len(x)] for o in range(2)], axis=1)
    bursts = record(n_sample=256 * 8, n_input=1, inputs=x, outputs=y)
    options = WelchOptions(256, overlap=0.0, window=BlockWindow.NONE)
    estimate = shaker_frf(bursts, options)
    # all but the mean, which was taken out of both
    np.testing.assert_allclose(estimate.values, truth(estimate.frequency)[:, :, :1], atol=1e-9)
    assert estimate.n_averages == (8.0,)


def test_a_loudspeaker_is_a_shaker():
    estimate = shaker_frf(
        record(n_input=1, input_units=("m^3/s^2",)), WelchOptions(512, band=(5.0, 100.0))
    )
    assert estimate.frf.unit == "(m/s^2)/(m^3/s^2)"
    again = imported_estimate(estimate.frf)
    assert (again.output_units, again.input_units) == (("m/s^2", "m/s^2"), ("m^3/s^2",))
    assert again.frf.unit == estimate.frf.unit


def test_overload_rejects_its_blocks():
    inputs = record().inputs.copy()
    inputs[1000, 1] = 50.0
    estimate = shaker_frf(record(inputs=inputs, input_ranges=(10.0, 10.0)), WelchOptions(512))
    rejected = [r for r in estimate.records[0] if not r.used]
    # two overlapping blocks hold the sample
    assert [r.number for r in rejected] == [3, 4]
    assert rejected[0].reasons == ("overload of 'Q': 50 N in a range of 10 N",)
    chosen = shaker_frf(record(), WelchOptions(512), blocks=range(10, 30), count=12)
    assert sum(r.used for r in chosen.records[0]) == 12


def test_inputs_that_follow_each_other():
    x = record().inputs
    with pytest.raises(InputError, match="inputs depend on each other"):
        shaker_frf(record(inputs=x[:, [0, 0]] * [1.0, 2.0]), WelchOptions(512))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"inputs": np.ones((5, 2))}, "were not sampled together"),
        ({"inputs": np.ones((5, 3))}, r"have shape \(n_sample, 2\)"),
        ({"inputs": np.zeros((40000, 2))}, r"no excitation in inputs \['P', 'Q'\]"),
        ({"inputs": np.full((40000, 2), np.nan)}, "input 'P' is not finite at sample 0"),
        ({"output_names": ("A", "A")}, "duplicated output"),
        ({"output_units": ("Pa",)}, "state one of each"),
        ({"output_ranges": (1.0, -1.0)}, "a range of outputs is positive"),
        ({"rate": 0.0}, "is not positive"),
    ],
)
def test_bad_records_are_named(changes, words):
    with pytest.raises(InputError, match=words):
        record(**changes)


def test_bad_blocks():
    for wrong in ({"overlap": 1.0}, {"overload": 0.0}):
        with pytest.raises(InputError, match="overlap is from 0"):
            WelchOptions(512, **wrong)
    with pytest.raises(InputError, match="do not fit a record"):
        shaker_frf(record(n_sample=500), WelchOptions(512))
    with pytest.raises(InputError, match="coherence would be 1 whatever"):
        shaker_frf(record(n_sample=1100), WelchOptions(512, overlap=0.0))


def test_the_gate_names_the_worst_function():
    good = shaker_frf(record(noise=0.1), WelchOptions(512))
    require_coherence(good, (10.0, 200.0))
    noisy = record(noise=0.1).outputs.copy()
    noisy[:, 1] = np.random.default_rng(9).normal(size=len(noisy))
    bad = shaker_frf(record(outputs=noisy), WelchOptions(512))
    with pytest.raises(InputError, match=r"'B' to input 'P': median coherence 0\.0.*\(2 of 4"):
        require_coherence(bad, (10.0, 200.0))
    require_coherence(bad.select(outputs=["A"]), (10.0, 200.0))
    with pytest.raises(InputError, match="no line from 300"):
        require_coherence(good, (300.0, 400.0))


def test_an_imported_estimate_knows_what_it_is_told():
    good = shaker_frf(record(noise=0.3, n_input=1), WelchOptions(512))
    told = imported_estimate(good.frf, good.coherence, good.n_averages[0])
    np.testing.assert_array_equal(told.random_error, good.random_error)
    assert told.output_units == good.output_units
    assert np.isnan(imported_estimate(good.frf, good.coherence).random_error).all()
    with pytest.raises(InputError, match="does not belong to FRFs"):
        imported_estimate(good.frf, good.coherence[:, :1])
    with pytest.raises(InputError, match=r"'A' to input 'P': a coherence of 1\.5 at 1 Hz"):
        imported_estimate(good.frf, np.full(good.values.shape, 1.5))
