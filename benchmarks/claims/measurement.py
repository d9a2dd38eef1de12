"""Measurement: virtual points, the culprit, force transfer.

The hammer test is synthetic: a rigid 7 kg body of 0.22 x 0.13 x 0.13 m on soft mounts, six triaxial
sensors in any orientation and 18 impacts at random places, 36 lines from 10 to 150 Hz, 1 % noise.
One fault per set-up: a reversed channel, two swapped axes, or a sensor 10 mm off. "Careful" sheets
err by 1 mm, 1° and 1 % (1 σ) in every sensor. Seeds from 1 upwards. Blows pass the steep filters of
analyzers (`tests/samples/filtered_hits.py`): what rings there is no second hit; one of 5 % or more
follows 50 samples later or anywhere in the block.

Zebra tapes: seam of 0.3 to 3.5 pitches, 8 to 180 stripes that differ by up to 5 %, jitter of a
pulse of up to 1 % of a pitch, four runs of 4 s (`tests/samples/zebra_tapes.py`). The error is
that of seams that lie beyond 3 σ of 2 or 3 whole pitches, where missing teeth look alike; refused
are shares of all.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from claims import Claim, at_least, at_most
from deboom.measurement.culprit import Fault, culprit_of_responses
from deboom.measurement.impact_test import check_hits
from deboom.measurement.sensors import Tolerances
from deboom.measurement.virtual_point import sensor_geometry, virtual_point
from samples.filtered_hits import blows
from samples.hammer_test import CAREFUL, EXACT, draw_fault, draw_hammer_test, measure
from samples.zebra_tapes import draw_tapes, speed_error

GROSS = (Fault.SIGN, Fault.AXES)
KINDS = (*GROSS, Fault.OFFSET)
N_TESTS = 100
N_TAPES = 512


def claims() -> list[Claim]:
    return [
        _blows(),
        *_tapes(),
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


def _tapes() -> list[Claim]:
    """Follow the speed of shafts by tapes whose seam has any width."""
    tapes = draw_tapes(N_TAPES)
    errors = [speed_error(tape, seed) for seed, tape in enumerate(tapes, start=1)]
    refused = 100 * float(np.mean([error is None for error in errors]))
    right = max(
        error
        for error, tape in zip(errors, tapes, strict=True)
        if error is not None and not tape.like_teeth
    )
    words = f"zebra tapes, {N_TAPES} of any seam"
    return [
        at_most(f"{words}: largest error of the speed where not refused [%]", 0.5, right, 2),
        at_most(f"{words}: refused [%]", 15, refused, 1),
    ]


def _sheets(words: str, errors: Tolerances, sure: tuple[Fault, ...]) -> list[Claim]:
    """Search the culprit in hammer tests with one fault, and in some without."""
    rows, alarms = [], 0
    for seed in range(1, 1 + N_TESTS):
        for kind in (*KINDS, None):
            generator = np.random.default_rng(seed)
            test = draw_hammer_test(generator)
            fault = None if kind is None else draw_fault(test, kind, generator)
            measured = measure(test, generator, fault=fault, errors=errors)
            point = virtual_point(sensor_geometry(test.sensors))
            culprit = culprit_of_responses(point, measured, errors)
            if fault is None:
                alarms += culprit.named
                continue
            suspect = culprit.suspect
            who = suspect.name.split()[0] == fault.sensor
            same = kind is Fault.OFFSET or set(suspect.channels) == set(fault.channels)
            right = culprit.named and who
            rows.append((kind, culprit.named, who, right, right and suspect.fault is kind and same))
    words = f"hammer tests with {words}"
    columns = ["kind", "named", "first suspect", "sensor", "fault"]
    counts = pd.DataFrame(rows, columns=columns).groupby("kind", sort=False).sum()
    offset = counts.loc[Fault.OFFSET]
    return [
        at_least(
            f"{words}, {', '.join(kind.value for kind in sure)}: sensor named; with its fault [%]",
            99,
            100 / N_TESTS * counts.loc[list(sure), ["sensor", "fault"]].mean(),
            1,
        ),
        Claim(
            f"{words}, 10 mm offset, where named: the right sensor [%]",
            "at least 95",
            f"{100 * offset['sensor'] / max(offset['named'], 1):.0f} of the {offset['named']} "
            f"named; first suspect right in {offset['first suspect']}",
            bool(offset["sensor"] >= 0.95 * offset["named"]),
        ),
        at_most(f"{words}, false accusation without a fault [%]", 1, alarms, 0),
    ]
