"""Uncertainty that cannot be drawn or combined is refused in one sentence."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.measurement.uncertainty import (
    method_difference,
    pivotal_interval,
)
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.platform_uncertainty import transfer_sources
from deboom.vehicles.uncertain_data import (
    UncertainData,
    run_noise,
)

LINES = np.arange(20.0, 61.0)


def frf(paths=("M x", "M z"), lines=LINES, value=1.0 + 0j):
    values = np.full((lines.size, 1, len(paths)), value)
    return Frf(lines, values, ("ear",), paths, "Pa/N")


def case(name="run", lines=LINES):
    values = np.ones((lines.size, 2), dtype=complex)
    channels = ("M x", "M z")
    return LoadCase(
        name,
        "",
        5,
        3.4,
        220.0,
        1.5,
        Spectrum(lines, values, channels, "m"),
        Spectrum(lines, values, channels, "N"),
    )


NOISE = run_noise("test", 0.01)


def data(sources=(NOISE,), cases=None, transfers=None, band=(20.0, 60.0)):
    vehicles = [Vehicle(f"V-{k}", "V", one) for k, one in enumerate(transfers or (frf(), frf()), 1)]
    return UncertainData(Fleet(tuple(vehicles)), cases or (case(),), sources, band)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: data(band=(200.0, 300.0)).measured, "no line between 200 and 300 Hz"),
        (lambda: pivotal_interval(1.0, np.ones(39)), "39 draws do not give an interval"),
        (lambda: pivotal_interval([1.0, 2.0], np.ones((50, 3))), "one row per draw"),
        (lambda: pivotal_interval(1.0, np.full(50, -np.inf)), "finite values"),
        (lambda: pivotal_interval(1.0, np.ones(50), 90.0), "a coverage of 90.0"),
        (lambda: method_difference([]), "at least one vehicle"),
        (lambda: method_difference([(frf(), frf(("M x", "M y")))]), "vehicle 1: its two"),
        (lambda: method_difference([(frf(("M x",)), frf(("M x",)))]), "at least two paths"),
        (lambda: method_difference([(frf(value=0j), frf(value=0j))]), "without any answer"),
    ],
)
def test_what_makes_no_interval_is_refused(call, sentence):
    with pytest.raises(InputError, match=sentence):
        call()


def test_a_calibration_seen_on_two_vehicles_keeps_its_prior():
    generator = np.random.default_rng(1)

    def noisy():
        noise = generator.normal(size=(2, LINES.size, 1, 2))
        return replace(frf(), values=frf().values + 0.01 * (noise[0] + 1j * noise[1]))

    few, enough = (
        transfer_sources(method_difference([(noisy(), noisy()) for _ in range(n)]), "two ways")
        for n in (2, 3)
    )
    prior = transfer_sources()[0]
    assert (few[0].name, few[0].size, few[0].origin) == (prior.name, prior.size, "stated prior")
    assert {source.origin for source in few[1:]} == {"two ways"}
    assert float(enough[0].size.split()[0]) < 0.2
    assert {source.origin for source in enough} == {"two ways"}
