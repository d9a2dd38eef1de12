"""Measurement: virtual points, the culprit, force transfer.

The hammer test is synthetic: a rigid 7 kg body of 0.22 x 0.13 x 0.13 m on soft mounts, six triaxial
sensors in any orientation and 18 impacts at random places, 36 lines from 10 to 150 Hz, 1 % noise.
One fault per set-up: a reversed channel, two swapped axes, or a sensor 10 mm off. "Careful" sheets
err by 1 mm, 1° and 1 % (1 σ) in every sensor. Seeds from 1 upwards. Blows pass the steep filters of
analyzers (`benchmarks/filtered_hits.py`): what rings there is no second hit; one of 5 % or more
follows 50 samples later or anywhere in the block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from claims import Claim, at_least, at_most
from deboom.measurement.culprit import Diagnosis, Fault, culprit_of_responses
from deboom.measurement.impact_test import check_hits
from deboom.measurement.sensors import Tolerances
from deboom.measurement.virtual_point import sensor_geometry, virtual_point
from filtered_hits import blows
from hammer_test import CAREFUL, EXACT, InjectedFault, draw_fault, draw_hammer_test, measure

GROSS = (Fault.SIGN, Fault.AXES)
KINDS = (*GROSS, Fault.OFFSET)
N_TESTS = 100


def claims() -> list[Claim]:
    return [
        _blows(),
        *_sheets("exact sheets", EXACT, KINDS),
        *_sheets("careful sheets", CAREFUL, GROSS),
    ]


def _blows() -> Claim:
    """Tell a second hit from a ringing filter, 500 blows of each."""
    shares = []
    for double in (True, False):
        hits = [check_hits(blows(25, double=double, seed=100 + k)) for k in range(20)]
        reasons = [" ".join(record.reasons) for records in hits for record in records]
        shares.append(100 * float(np.mean(["double hit" in reason for reason in reasons])))
    return at_least(
        "second hits of 5 % or more behind a ringing filter found, single hits not called double, "
        "of 500 each [%]",
        99,
        [shares[0], 100 - shares[1]],
        1,
    )


@dataclass
class Score:
    """How often leave-one-out was right about one kind of fault."""

    named: int = 0
    culprit: int = 0
    fault: int = 0
    first_suspect: int = 0

    def add(self, found: Diagnosis, truth: InjectedFault) -> None:
        """Count one diagnosis."""
        who = found.suspect.name.split()[0]
        self.first_suspect += who == truth.sensor
        if not found.named:
            return
        self.named += 1
        self.culprit += who == truth.sensor
        same = truth.kind is Fault.OFFSET or set(found.suspect.channels) == set(truth.channels)
        self.fault += who == truth.sensor and found.suspect.fault is truth.kind and same


def _sheets(words: str, errors: Tolerances, sure: tuple[Fault, ...]) -> list[Claim]:
    """Search the culprit in hammer tests with one fault, and in some without."""
    scores, alarms = {kind: Score() for kind in KINDS}, 0
    for seed in range(1, 1 + N_TESTS):
        for kind in (*KINDS, None):
            generator = np.random.default_rng(seed)
            test = draw_hammer_test(generator)
            fault = None if kind is None else draw_fault(test, kind, generator)
            measured = measure(test, generator, fault=fault, errors=errors)
            point = virtual_point(sensor_geometry(test.sensors))
            found = culprit_of_responses(point, measured, errors)
            if fault is None:
                alarms += found.named
            else:
                scores[fault.kind].add(found, fault)
    words = f"hammer tests with {words}"
    offset = scores[Fault.OFFSET]
    return [
        at_least(
            f"{words}, {', '.join(kind.value for kind in sure)}: sensor named; with its fault [%]",
            99,
            [
                np.mean([100 * getattr(scores[kind], what) / N_TESTS for kind in sure])
                for what in ("culprit", "fault")
            ],
            1,
        ),
        Claim(
            f"{words}, 10 mm offset, where named: the right sensor [%]",
            "at least 95",
            f"{100 * offset.culprit / max(offset.named, 1):.0f} of the {offset.named} named; first "
            f"suspect right in {offset.first_suspect}",
            offset.culprit >= 0.95 * offset.named,
        ),
        at_most(f"{words}, false accusation without a fault [%]", 1, alarms, 0),
    ]
