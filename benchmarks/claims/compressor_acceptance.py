"""The compressor's acceptance: verdicts with guard bands, and how often they are wrong.

First the rule alone: simulated measurements of parts that lie exactly on their limit, the worst
place, at a stated risk of 5 %. Then the whole chain: random virtual compressors (level C2: gains of
2 %, places of 1.5 mm, angles of 1.5°, hammer 1 %), hammer test and sweeps written and read as
files, identified, unbalance by route d, with limits laid exactly on each part's true values. A part
that passes its limit there is a false accept, one that fails a false reject; deviations that are
too small would show as more of them than stated. The deviations of one test hang together: ten
tests are no more than ten draws, and five percent of them is one half.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.stats import binom
from threadpoolctl import threadpool_limits

from claims import Claim, draws
from deboom.arrays import AXES
from deboom.bench.compressor_writer import write_operating_test
from deboom.choices import CalibrationLevel
from deboom.compressor.acceptance import (
    DYNAMIC,
    RISK,
    STATIC,
    Bounds,
    Characteristic,
    Decision,
    StiffnessLimit,
    Verdict,
    judge,
    stiffness_characteristic,
    unbalance_characteristic,
)
from deboom.compressor.identify import IdentifyOptions, identified_compressor, identify
from deboom.compressor.routes import CALIBRATED_MEASUREMENT
from deboom.compressor.unbalance import UnbalanceOptions, unbalance
from deboom.files.operating_test import read_operating_test
from deboom.study.compressor_identification import read_compressor_truth
from deboom.study.compressor_unbalance import read_unbalance_truth

SEEDS = range(1, 1 + draws(10))
BAND = (20.0, 60.0)
N_PARTS = draws(4000)
LEVEL = CalibrationLevel.C2


@dataclass(frozen=True)
class Judged:
    """Verdicts on one part with each limit on its true value: as upper and as lower bound."""

    unbalance: tuple[Verdict, ...]
    stiffness: tuple[Verdict, ...]
    guards: dict[str, float]
    """Guard band over value [1]."""


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        parts = list(pool.map(partial(_judged, LEVEL), SEEDS))
    return [
        *_rule(),
        _wrong("unbalance", [one.unbalance for one in parts]),
        _wrong("dynamic stiffness, six directions, 20-60 Hz", [one.stiffness for one in parts]),
        _guards(parts),
    ]


def _rule() -> list[Claim]:
    """Simulate parts on their limit."""
    rng = np.random.default_rng(1)
    along, across = rng.standard_normal((2, N_PARTS))
    nine = 10 + 0.7 * rng.standard_normal((N_PARTS, 1)) + 0.7 * rng.standard_normal((N_PARTS, 9))
    rows = []
    for name, values, spread, is_radius in (
        ("a number", 10 + along, 1.0, False),
        ("an unbalance of five deviations", np.hypot(5 + along, across), 1.0, True),
        ("a band of nine lines", nine, np.hypot(0.7, 0.7), False),
    ):
        limit = Bounds(at_most=5.0 if is_radius else 10.0)
        found = [
            judge(_read(np.atleast_1d(value), spread, is_radius), limit).decision
            for value in values
        ]
        shares = [
            100 * found.count(decision) / N_PARTS for decision in (Decision.PASS, Decision.FAIL)
        ]
        rows.append(
            Claim(
                f"{N_PARTS} simulated parts on their limit, {name}: false accepts, rejects [%]",
                "at most 5, 5",
                f"{shares[0]:.1f}, {shares[1]:.1f}",
                max(shares) <= 100 * (RISK + 3 * np.sqrt(RISK * (1 - RISK) / N_PARTS)),
            )
        )
    return rows


def _read(values: np.ndarray, spread: float, is_radius: bool) -> Characteristic:
    deviations = np.full(values.size, spread)
    return Characteristic("x", values, deviations, np.zeros(values.size), is_radius=is_radius)


def _judged(level: CalibrationLevel, seed: int) -> Judged:
    with threadpool_limits(1), tempfile.TemporaryDirectory() as scratch:
        folder = write_operating_test(Path(scratch) / "test", seed, level)
        test, truth = read_operating_test(folder), read_unbalance_truth(folder)
        true = read_compressor_truth(folder / "hammer")
        assert truth is not None
        assert true is not None
        struck = identify(test.hammer, IdentifyOptions())
        route = CALIBRATED_MEASUREMENT
        found = unbalance(test, struck, UnbalanceOptions(routes=(route,), chosen=route))
        kept = identified_compressor(struck, ((10.0, 150.0),), {})
        on_limit: list[Verdict] = []
        guards = {}
        for name, size in ((STATIC, abs(truth.static)), (DYNAMIC, abs(truth.dynamic))):
            measured = unbalance_characteristic(found, name)
            on_limit += _both(measured, size, size)
            guards[name] = on_limit[-1].pass_guard / size
        stiffness: list[Verdict] = []
        for place, direction in enumerate(AXES):
            limit = StiffnessLimit(direction, BAND, Bounds(at_most=1.0))
            measured = stiffness_characteristic(kept, limit)
            size = np.abs(true.model.gain.at(measured.lines)) * true.model.stiffness[place, place]
            stiffness += _both(measured, float(size.max()), float(size.min()))
            guards[direction] = stiffness[-1].pass_guard / float(size.min())
        return Judged(tuple(on_limit), tuple(stiffness), guards)


def _both(measured: Characteristic, high: float, low: float) -> list[Verdict]:
    """Judge by an upper bound on the largest true value, then by a lower one on the smallest."""
    return [judge(measured, Bounds(at_most=high)), judge(measured, Bounds(at_least=low))]


def _wrong(name: str, parts: Sequence[Sequence[Verdict]]) -> Claim:
    verdicts = [verdict for one in parts for verdict in one]
    counts = [
        sum(verdict.decision is decision for verdict in verdicts)
        for decision in (Decision.PASS, Decision.FAIL)
    ]
    # all verdicts of a test may hang together: count tests
    share = counts[0] / len(verdicts)
    most = binom.ppf(0.99, len(parts), RISK) / len(parts)
    return Claim(
        f"{len(parts)} virtual compressors on their limit, {name}: false accepts, rejects "
        f"of {len(verdicts)} verdicts",
        f"5 %; at most {most:.0%} with so few tests",
        f"{counts[0]} ({share:.1%}), {counts[1]} ({counts[1] / len(verdicts):.1%})",
        bool(share <= most),
    )


def _guards(parts: Sequence[Judged]) -> Claim:
    names = (STATIC, DYNAMIC, "x", "rz")
    found = [100 * float(np.median([one.guards[name] for one in parts])) for name in names]
    return Claim(
        "guard band over value, median: static and dynamic unbalance, |K| of x and rz [%]",
        "as small as the unbalance is to be known: 2, 2.5",
        ", ".join(f"{value:.2f}" for value in found),
        bool(found[0] <= 2 and found[1] <= 2.5),
    )
