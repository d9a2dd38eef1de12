"""Compressor test: what is refused, what raises an alarm.

Every reversed channel and impact, every exchange of two channels, sensors or impacts of one test at
level C2; bodies that are not rigid; good tests that must raise no alarm; mounts that soften with
their own amplitude.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from claims import Claim
from deboom.arrays import ComplexArray
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.choices import CalibrationLevel
from deboom.compressor.identify import IdentifyOptions, identify, refuse_sheet_faults
from deboom.compressor.model import AmplitudeGain, GainFactor, amplitude_response
from deboom.compressor.unbalance_load import unbalance_load
from deboom.errors import InputError
from deboom.files.inertance_test import read_inertance_test
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import CompressorMount, InertanceTest
from deboom.measurement.virtual_point import impact_geometry, sensor_geometry, virtual_point
from deboom.physics.rigid_body import mass_matrix

QUICK = IdentifyOptions(largest_lines=20, held_out=6)
RESONANCES = (250.0, 300.0, 400.0)
TOLERANCE = 0.03
SCALE = np.repeat([1.0, 1 / 0.055], 3)
Fault = tuple[tuple[str, ...], ComplexArray]


def claims() -> list[Claim]:
    """Measure everything afresh."""
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        return [*_sheet_faults(folder), _rigid_limit(folder), _no_alarms(folder), _softening()]


def _test(folder: Path, **plan: float) -> InertanceTest:
    write_compressor_test(folder, plan=CompressorPlan(**plan))
    return read_inertance_test(folder)


def _faults(test: InertanceTest) -> Iterator[tuple[str, Fault]]:
    """Every fault of one kind, with the names that the refusal must hold."""
    values, outputs, inputs = test.frf.values, test.frf.outputs, test.frf.inputs
    for n in range(len(outputs)):
        sign = np.where(np.arange(len(outputs)) == n, -1, 1)
        yield "reversed", ((outputs[n],), values * sign[:, np.newaxis])
    for n in range(len(inputs)):
        yield "reversed", ((inputs[n],), values * np.where(np.arange(len(inputs)) == n, -1, 1))
    for a, b in combinations(range(len(outputs)), 2):
        order = _exchanged(len(outputs), a, b)
        yield "channels", ((outputs[a], outputs[b]), values[:, order])
    for a, b in combinations(range(len(inputs)), 2):
        order = _exchanged(len(inputs), a, b)
        yield "impacts", ((inputs[a], inputs[b]), values[:, :, order])
    names = [sensor.name for sensor in test.sensors]
    for a, b in combinations(range(len(names)), 2):
        rows = np.arange(len(outputs)).reshape(-1, 3)[_exchanged(len(names), a, b)].ravel()
        yield "sensors", ((names[a], names[b]), values[:, rows])


def _exchanged(size: int, a: int, b: int) -> list[int]:
    order = list(range(size))
    order[a], order[b] = b, a
    return order


def _sheet_faults(folder: Path) -> list[Claim]:
    whole = _test(folder / "good")
    every = slice(None, None, 4)
    frf = whole.frf
    test = replace(
        whole,
        frf=Frf(frf.frequency[every], frf.values[every], frf.outputs, frf.inputs, frf.unit),
        coherence=whole.coherence[every],
    )
    response = virtual_point(sensor_geometry(test.sensors))
    excitation = virtual_point(impact_geometry(test.impacts))
    counts: dict[str, list[bool]] = {}
    for kind, (names, values) in _faults(test):
        faulty = replace(
            test,
            frf=Frf(test.frf.frequency, values, test.frf.outputs, test.frf.inputs, test.frf.unit),
        )
        text = ""
        try:
            refuse_sheet_faults(faulty, response, excitation)
        except InputError as refusal:
            text = str(refusal)
        counts.setdefault(kind, []).append(all(name in text for name in names))
    words = {
        "reversed": "reversed channels and impacts named",
        "channels": "exchanges of two channels named",
        "impacts": "exchanges of two impacts named",
        "sensors": "exchanges of two sensors named",
    }
    return [
        Claim(words[kind], f"all {len(found)}", f"{sum(found)} of {len(found)}", all(found))
        for kind, found in counts.items()
    ]


def _rigid_limit(folder: Path) -> Claim:
    told, true = [], []
    for resonance in RESONANCES:
        place = folder / f"flexible{resonance:g}"
        found = identify(_test(place, flexible_body=resonance), replace(QUICK, held_out=0))
        told.append(found.rigid.holds_to)
        true.append(_true_limit(place / "truth" / "truth.npz"))
    worst = max(abs(a / b - 1) for a, b in zip(told, true, strict=True))
    resonances = ", ".join(f"{f:.0f}" for f in RESONANCES)
    return Claim(
        f"flexible body at {resonances} Hz: rigid model holds to, told (true) [Hz]",
        "within 20 %",
        ", ".join(f"{a:.0f} ({b:.0f})" for a, b in zip(told, true, strict=True)),
        worst < 0.2,
    )


def _true_limit(path: Path) -> float:
    """Where the exact apparent mass leaves that of the rigid body by the tolerance [Hz]."""
    truth = np.load(path)
    response, excitation = truth["response_matrix"], truth["excitation_matrix"]
    seen = np.linalg.pinv(response) @ truth["frf"] @ np.linalg.pinv(excitation).T
    weight = np.outer(SCALE, SCALE)
    change = np.linalg.norm(weight * (np.linalg.inv(seen) - truth["apparent_mass"]), axis=(1, 2))
    size = np.linalg.norm(weight * truth["apparent_mass"][-1])
    above = truth["frequency"] > 40
    return float(truth["frequency"][above][np.argmax(change[above] > TOLERANCE * size)])


def _no_alarms(folder: Path) -> Claim:
    alarms, tests = [], 0
    for level in CalibrationLevel:
        for seed in (31, 32, 33):
            place = folder / f"{level.value}-{seed}"
            write_compressor_test(place, seed, level)
            alarms += identify(read_inertance_test(place), QUICK).alarms
            tests += 1
    return Claim(
        f"alarms of {tests} good tests, levels C0.5 to C3", "none", f"{len(alarms)}", not alarms
    )


def _softening() -> Claim:
    """Table 11 of the thesis, unbalance from a hundredth to a hundred times the usual one."""
    places = 1e-3 * np.array([[-155.9, 3.75, 20.0], [-19.4, -67.5, 78.0], [-8.5, 73.6, 82.3]])
    turns = np.deg2rad([[-4.9, -4.9, 185.0], [2.5, 43.3, 87.5], [2.2, 131.5, 89.4]])
    mounts = [
        CompressorMount(f"mount {n}", place, turn, np.array([29.6e3, 11.4e3, 11.4e3]))
        for n, (place, turn) in enumerate(zip(places, turns, strict=True), 1)
    ]
    body = mass_matrix(7.2, np.diag([0.0158, 0.0291, 0.0302]), [0.0015, -0.002, 0.001])
    gain = GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5])
    rubber = AmplitudeGain(1 - 0.3 / (1 + 200 / 30), 1 / (0.3 * 30e-6), 1 / 0.3)
    each = [(rubber, rubber)] * len(mounts)
    lines = np.arange(10.0, 150.5, 0.5)
    steps = [
        amplitude_response(
            body, mounts, gain, each, strength * unbalance_load(2e-5, 0.06, lines), lines
        ).iterations
        for strength in (0.01, 0.1, 1.0, 10.0, 100.0)
    ]
    return Claim(
        "mounts that soften with their own amplitude: steps to 1e-11, all lines and loads",
        "at most 80",
        f"{max(steps)}",
        max(steps) <= 80,
    )
