"""Hoses: what is refused, what is said, and the algebra that needs no bench."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from deboom.bench.compressor_truth import drawn_hoses
from deboom.compressor.hose_presence import hoses_in_sweep
from deboom.compressor.hoses import (
    HammerEvidence,
    hose_matrices,
    motion_at_virtual_point,
    port_forces,
    separation_statement,
    sweep_pairs,
)
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.compressor_test import HoseDrawing, HoseState, OperatingSweep

LINES = np.array([20.0, 60.0, 110.0])
HOSES = SUCTION, _ = [
    HoseDrawing(hose.name, hose.position, hose.direction, *vars(hose.beam).values())
    for hose in drawn_hoses()
]
CHANNELS = ("A1 x", "A1 y", "A1 z")


def sweep(name, hoses, pressure=7.5e5, frequency=None, channels=CHANNELS):
    frequency = np.arange(20.0, 60.0) if frequency is None else frequency
    values = np.ones((frequency.size, len(channels)), dtype=complex)
    return OperatingSweep(
        name,
        hoses,
        pressure,
        Spectrum(frequency, values, channels, "m/s^2"),
        np.full(values.shape, 1e-3),
    )


def identified():
    """As much of an identification as the projection of channels needs."""
    matrix = np.random.default_rng(1).standard_normal((3, 6))
    frf = SimpleNamespace(outputs=CHANNELS, inputs=("I1",))
    return SimpleNamespace(
        calibrated=SimpleNamespace(response_matrix=matrix),
        test=SimpleNamespace(name="a test", frf=frf),
    )


def operating(*sweeps):
    def with_hoses(state):
        return tuple(sweep for sweep in sweeps if sweep.hoses is state)

    return SimpleNamespace(name="a test", sweeps=sweeps, with_hoses=with_hoses, hoses=HOSES)


def test_one_hose_is_separable_and_three_are_less():
    assert port_forces([SUCTION])[1].shape == (0, 3)
    assert "determines the force at the port" in separation_statement([SUCTION])
    third = replace(SUCTION, name="third", position=np.array([0.0, 0.1, 0.0]))
    assert port_forces([*HOSES, third])[0] == 6
    assert "6 of the 9" in separation_statement([*HOSES, third])


def test_pairs_share_pressure_and_lines():
    short = np.arange(30.0, 45.0)
    sweeps = (
        sweep("soft", HoseState.SOFT),
        sweep("soft, short", HoseState.SOFT, frequency=short),
        sweep("standard", HoseState.STANDARD, pressure=7.52e5),
        sweep("standard, high", HoseState.STANDARD, pressure=13.5e5),
    )
    (pair,) = sweep_pairs(operating(*sweeps), identified(), (25.0, 50.0))
    assert (pair.soft_name, pair.standard_name) == ("soft", "standard")
    np.testing.assert_array_equal(pair.frequency, np.arange(25.0, 51.0))


def without_partner(**change):
    """Soft and standard sweeps of which the second differs from the first."""
    other = sweep("b", HoseState.STANDARD, **change)
    return lambda: sweep_pairs(operating(sweep("a", HoseState.SOFT), other), identified())


MOVED = sweep("a", HoseState.SOFT, channels=("B1 x",))


def evidence(with_hoses, band=(20, 50)):
    return HammerEvidence(frf(), with_hoses, identified(), band=band, largest_lines=20)


def frf(inputs=("I1",), step=1.0):
    lines = np.arange(20.0, 60.0, step)
    shape = (lines.size, 3, 1)
    values = Frf(lines, np.ones(shape, dtype=complex), CHANNELS, inputs, "(m/s^2)/N")
    return SimpleNamespace(name="struck", frf=values, coherence=np.ones(shape), n_averages=5)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (without_partner(pressure=13.5e5), "no pressure was run with standard and with soft"),
        (without_partner(frequency=np.arange(20.5, 60)), "common lines"),
        (lambda: hose_matrices([], LINES), "no drawing of a hose"),
        (lambda: hose_matrices([SUCTION], [0.0]), "above 0 Hz"),
        (lambda: motion_at_virtual_point(MOVED, identified()), "sensors must stay where they"),
        (lambda: evidence(frf(inputs=("I2",))), "strike the same points"),
        (lambda: evidence(frf(step=2.0)), "have other lines"),
        (lambda: evidence(frf(), band=(200, 250)), "no line between 200 and 250 Hz"),
    ],
)
def test_refused(what, words):
    with pytest.raises(InputError, match=words):
        what()


def test_few_lines_show_no_hoses():
    few = sweep("a", HoseState.SOFT, frequency=np.arange(20.0, 30.0))
    assert hoses_in_sweep(few, HOSES, identified()) is None
