"""The truth of a virtual compressor at the lines that a sweep has left."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from deboom.study.compressor_unbalance_truth import UnbalanceTruth, route_errors

LINES = np.arange(17.0, 151.0)
SQUARE = (2 * np.pi * LINES) ** 2
TRUTH = UnbalanceTruth(
    Path("operation.json"),
    2e-5 + 0j,
    1e-6 + 0j,
    {"soft": np.outer(SQUARE, [0, 2e-5, -2e-5j, 0, 1e-6j, 1e-6])},
    {"soft": LINES},
)


def sweep(frequency, *, name="soft", off=1.0):
    """Build what is read of a sweep whose unbalances are `off` times the true ones."""
    static, dynamic = (
        SimpleNamespace(value=np.full(frequency.size, off * true))
        for true in (TRUTH.static, TRUTH.dynamic)
    )
    return SimpleNamespace(
        sweep=name,
        frequency=frequency,
        static=SimpleNamespace(from_y=static, from_z=static),
        dynamic=SimpleNamespace(from_y=dynamic, from_z=dynamic),
    )


def test_loads_are_taken_at_the_lines_of_the_sweep():
    some = LINES[10:100:7]
    np.testing.assert_array_equal(TRUTH.load_of(sweep(some)), TRUTH.loads["soft"][10:100:7])
    assert TRUTH.load_of(sweep(some + 0.1)) is None
    assert TRUTH.load_of(sweep(some, name="over time")) is None


def test_errors_are_stated_for_bands_with_lines():
    errors = route_errors(SimpleNamespace(sweeps=(sweep(LINES[43:], off=1.02),)), TRUTH)
    assert math.isnan(errors.static[0])
    assert errors.static[1] == pytest.approx(0.02)
    assert errors.dynamic[1] == pytest.approx(0.02)
    unknown = route_errors(SimpleNamespace(sweeps=(sweep(LINES + 0.1),)), TRUTH)
    assert all(math.isnan(one) for one in (*unknown.static, *unknown.static_mismatch))
