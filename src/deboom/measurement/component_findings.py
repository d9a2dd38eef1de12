"""What contradicts in a test of component TPA before its forces are believed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.component_test import ComponentTest, InterfacePoint, ReceiverTest
from deboom.measurement.component_tpa import (
    INCOMPLETE,
    ComponentTpa,
    component_tpa,
    incompleteness,
)
from deboom.measurement.culprit import expected_residual, odd_channels, tolerances_of_all
from deboom.measurement.sensors import Tolerances
from deboom.measurement.uncertainty import DB_PER_NEPER
from deboom.measurement.virtual_point import sensor_geometry

LARGEST_LEVEL_GAP = 10.0
"""Level at an ear, predicted over measured, from which on it is named [dB]: what comes through the
air as well adds 3 dB at as much energy."""
SAME = 1e-4
"""Relative difference of functions that no second measurement leaves [1]."""
LEAST_RESIDUAL, DOUBTED = 0.05, 3.0
"""Part of a point's motion that is not rigid from which on a channel is looked for, and the same
over what tolerances let expect [1]: 18 drawn points have 0.6 to 1.9."""


def component_findings(test: ComponentTest, receiver: ReceiverTest | None) -> tuple[str, ...]:
    """List what contradicts in a test and its receiver, a sentence each."""
    tolerances = tolerances_of_all(test.tolerances)
    findings = [*_nearer(test.points), *_odd(test.points, test.accelerance, tolerances)]
    findings += _copies(test)
    if receiver is not None:
        findings += _odd(receiver.points, receiver.accelerance, tolerances)
        if _same(receiver.accelerance, test.accelerance):
            findings.append(
                f"the receiver {receiver.name} has the functions of the first body: export those "
                "of the body on which the source will stand, with the source taken out"
            )
    # what is wrong at the points denies every run
    return tuple(findings) or tuple(_runs(test))


def _nearer(points: Sequence[InterfacePoint]) -> Iterator[str]:
    """Name sensors and impacts that lie nearer to another point than to their own."""
    for point in points:
        for what, placed in (("sensor", point.sensors), ("impact", point.impacts)):
            for each in placed:
                apart = {
                    other.name: float(np.linalg.norm(each.position - other.position))
                    for other in points
                }
                nearest = min(apart, key=lambda name: apart[name])
                if apart[nearest] < apart[point.name] / 2.0:
                    yield (
                        f"{what} {each.name} belongs to {point.name}, and its position lies "
                        f"{apart[point.name]:.2g} m from it and {apart[nearest]:.2g} m from "
                        f"{nearest}: correct position_m or the lists of the points, or the "
                        "position sheet"
                    )


def _odd(
    points: Sequence[InterfacePoint], accelerance: Frf, tolerances: Tolerances
) -> Iterator[str]:
    for point in points:
        if not point.determined:
            continue
        geometry = sensor_geometry(point.sensors, point.position)
        values = accelerance.select(outputs=geometry.channels).values.swapaxes(1, 2)
        groups = {
            sensor.name: [geometry.channels.index(name) for name in sensor.channels]
            for sensor in point.sensors
        }
        groups |= {name: [k] for k, name in enumerate(geometry.channels)}
        odd = odd_channels(geometry.forward, accelerance.frequency, values, groups)
        lines = values.reshape(-1, len(geometry.channels))
        allowed = DOUBTED * expected_residual(geometry, lines, tolerances)
        if odd is not None and odd.residual > max(LEAST_RESIDUAL, allowed):
            yield (
                f"{point.name}: its sensors contradict a rigid motion: {odd.words}; correct the "
                "channel, or measure it again"
            )


def _copies(test: ComponentTest) -> Iterator[str]:
    for first, second in combinations(test.runs, 2):
        if np.array_equal(first.acceleration.values, second.acceleration.values):
            names = f"{first.name} and {second.name}"
            yield f"runs {names} hold the same spectra: name the file of each"
    if test.free is not None and _same(test.free, test.accelerance):
        yield (
            "the functions of the free source are those of the source on the body: export the ones "
            "that were struck with the source hung up freely"
        )


def _same(one: Frf, other: Frf) -> bool:
    """Whether all functions that both have are the same."""
    outputs = [name for name in one.outputs if name in other.outputs]
    inputs = [name for name in one.inputs if name in other.inputs]
    if not outputs or not inputs or one.frequency.size != other.frequency.size:
        return False
    values = [each.select(outputs, inputs).values for each in (one, other)]
    return bool(np.linalg.norm(values[0] - values[1]) <= SAME * np.linalg.norm(values[1]))


def _runs(test: ComponentTest) -> Iterator[str]:
    """Compare what the functions make of each run with what was measured in it."""
    try:
        result = component_tpa(test)
    except InputError as error:
        yield f"{error}; or the spectra of this run are conjugated, exp(−jωt)"
        return
    contradicted = False
    for run in result.runs:
        middle = float(np.median(run.by_line))
        if run.on_board is not None and middle < INCOMPLETE:
            yield (
                f"run {run.name}: at sensors left out, predicted and measured have a coherence of "
                f"{middle:.2f}: are its spectra conjugated, exp(−jωt), of another assembly or of "
                "other sensors, or is a point missing?"
            )
            contradicted = True
    yield from _levels(result)
    if not contradicted:
        yield from incompleteness(result.runs, result.completeness)


def _levels(result: ComponentTpa) -> Iterator[str]:
    """Name the run, the ear or the functions whose level at the ears cannot be."""
    gaps = {
        (run.name, ear): DB_PER_NEPER
        * float(
            np.log(
                np.linalg.norm(run.sound.values[:, k])
                / np.linalg.norm(run.measured_sound.values[:, k])
            )
        )
        for run in result.runs
        for k, ear in enumerate(run.sound.channels)
    }
    off = {key: gap for key, gap in gaps.items() if abs(gap) > LARGEST_LEVEL_GAP}
    if not off:
        return
    runs, ears = ({key[place] for key in gaps} for place in (0, 1))
    middle = float(np.median(list(off.values())))
    much = f"{abs(middle):.0f} dB {'above' if middle > 0 else 'below'} what was measured"
    if len(off) == len(gaps):
        yield (
            f"the pressure that the functions predict at all ears lies {much} in all runs: are "
            "pressure and force of the noise transfer functions in Pa and N, and the runs in m/s²?"
        )
        return
    for ear in sorted(ears):
        if all((run, ear) in off for run in runs):
            yield f"{ear}: the predicted pressure lies {much}: check the gain of its microphone"
    for run in sorted(runs):
        if all((run, ear) in off for ear in ears):
            yield (
                f"run {run}: the predicted pressure at all ears lies {much}: are its accelerations "
                "in m/s², and its spectra all peak values?"
            )
