"""Hoses: what is refused, what is said, and the algebra that needs no bench."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

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
SUCTION = HoseDrawing(
    name="suction hose",
    position=np.array([-0.07, 0.035, 0.05]),
    direction=np.array([-0.3, 0.5, 0.81]),
    length=0.36,
    tension=2100.0,
    torsion=3.0,
    bending=4.4,
    line_mass=0.3,
    loss_factor=0.12,
    torsion_radius=0.0077,
)
DISCHARGE = replace(
    SUCTION,
    name="discharge hose",
    position=np.array([0.06, -0.04, 0.045]),
    direction=np.array([0.5, -0.75, 0.43]),
    length=0.32,
)
HOSES = (SUCTION, DISCHARGE)
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


def found(channels=CHANNELS, impacts=("I1",)):
    """As much of an identification as the projection of channels needs."""
    matrix = np.random.default_rng(1).standard_normal((len(channels), 6))
    frf = SimpleNamespace(outputs=channels, inputs=impacts)
    return SimpleNamespace(
        calibrated=SimpleNamespace(response_matrix=matrix),
        test=SimpleNamespace(name="a test", frf=frf),
    )


def operating(*sweeps, **fields):
    def with_hoses(state):
        return tuple(one for one in sweeps if one.hoses is state)

    return SimpleNamespace(
        name="a test", sweeps=sweeps, with_hoses=with_hoses, hoses=HOSES, **fields
    )


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
    (pair,) = sweep_pairs(operating(*sweeps), found(), (25.0, 50.0))
    assert (pair.soft_name, pair.standard_name) == ("soft", "standard")
    np.testing.assert_array_equal(pair.frequency, np.arange(25.0, 51.0))


def without_partner(**change):
    """Soft and standard sweeps of which the second differs from the first."""
    other = sweep("b", HoseState.STANDARD, **change)
    return lambda: sweep_pairs(operating(sweep("a", HoseState.SOFT), other), found())


def frf(outputs=CHANNELS, inputs=("I1",), step=1.0):
    lines = np.arange(20.0, 60.0, step)
    shape = (lines.size, len(outputs), len(inputs))
    values = Frf(lines, np.ones(shape, dtype=complex), outputs, inputs, "(m/s^2)/N")
    return SimpleNamespace(name="struck", frf=values, coherence=np.ones(shape), n_averages=5)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (without_partner(pressure=13.5e5), "no pressure was run with standard and with soft"),
        (without_partner(frequency=np.arange(20.5, 60)), "common lines"),
        (lambda: hose_matrices([], LINES), "no drawing of a hose"),
        (lambda: hose_matrices([SUCTION], [0.0]), "above 0 Hz"),
        (
            lambda: motion_at_virtual_point(
                sweep("a", HoseState.SOFT, channels=("B1 x",)), found()
            ),
            "sensors must stay where they were struck",
        ),
        (
            lambda: HammerEvidence(
                frf(), frf(inputs=("I2",)), found(), band=(20, 50), largest_lines=20
            ),
            "strike the same points",
        ),
        (
            lambda: HammerEvidence(frf(), frf(step=2.0), found(), band=(20, 50), largest_lines=20),
            "have other lines",
        ),
        (
            lambda: HammerEvidence(frf(), frf(), found(), band=(200, 250), largest_lines=20),
            "no line between 200 and 250 Hz",
        ),
    ],
)
def test_refused(what, words):
    with pytest.raises(InputError, match=words):
        what()


def test_few_lines_show_no_hoses():
    few = sweep("a", HoseState.SOFT, frequency=np.arange(20.0, 30.0))
    assert hoses_in_sweep(few, HOSES, found()) is None
