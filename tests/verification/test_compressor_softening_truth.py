"""Mounts that soften with their own stroke, from samples that share no equation with the code."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from compressor_operation_samples import (
    DYNAMIC,
    GAS_FACTOR,
    STATIC,
    drawing,
    passing_as_unbalance,
    rows_at,
    sample,
)

from deboom.compressor.identify import IdentifyOptions, identify
from deboom.compressor.mount_state import MountState
from deboom.compressor.routes import CalibratedMeasurementRoute, UpdatedRoute
from deboom.compressor.softening_mounts import SofteningMounts, softening_mounts
from deboom.compressor.unbalance import UnbalanceOptions, unbalance
from deboom.errors import InputError

LINES = np.concatenate([np.arange(17.0, 50.0, 1.5), np.arange(50.0, 151.0, 10.0)])
OPTIONS = UnbalanceOptions(routes=(CalibratedMeasurementRoute(), UpdatedRoute()))


@cache
def softened(**options):
    test, body = sample(1, softening=0.3, lines=LINES, drawn=True, **options)
    found = identify(test.hammer, IdentifyOptions(largest_lines=20, held_out=0))
    return test, body, found, unbalance(test, found, OPTIONS)


def errors(result):
    """Rms relative errors of static and dynamic unbalance in 20 to 50 Hz."""
    static, dynamic = [], []
    for sweep in result.sweeps:
        low = (sweep.frequency >= 20) & (sweep.frequency <= 50)
        true = passing_as_unbalance(sweep.frequency, GAS_FACTOR[sweep.pressure])
        for band in (sweep.static.from_y, sweep.static.from_z):
            static.append((band.value - true)[low] / abs(STATIC))
        for band in (sweep.dynamic.from_y, sweep.dynamic.from_z):
            dynamic.append((band.value - DYNAMIC)[low] / abs(DYNAMIC))
    return [float(np.sqrt(np.mean(np.abs(part) ** 2))) for part in (static, dynamic)]


def test_each_mount_softens_by_its_own_stroke():
    test, body, found, result = softened()
    updated = result.by_letter("e")
    assert isinstance(updated.fit.change, SofteningMounts)
    assert "Route e: mounts that soften with their own stroke" in result.notices[0]
    common = unbalance(test, found, replace(OPTIONS, by_stroke=False)).by_letter("e")
    for own, shared in zip(errors(updated), errors(common), strict=True):
        assert own < 0.03
        assert own < 0.5 * shared
    assert updated.fit.schwarz < common.fit.schwarz
    assert updated.sources.reduced_chi < 0.4 * common.sources.reduced_chi
    # the law behind it, which is no parabola
    stroke = np.array([7e-6, 20e-6, 60e-6])
    change = updated.fit.change.change_at(updated.fit.line_values[updated.fit.change_slice], stroke)
    np.testing.assert_allclose(change, body.softened(stroke) - 1, atol=0.03)
    # the route without update is not touched
    assert result.chosen.fit.change == OPTIONS.state


def test_strokes_are_those_of_the_mounts():
    _, body, found, _ = softened()
    mounts = SofteningMounts(body.places, softening_mounts(found).stiffness)
    line = np.array([25.0])
    motion = body.running(25.0, 1.0)
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 2001))
    for place, stroke in zip(body.places, mounts.strokes(line, motion[None])[0], strict=True):
        moved = rows_at(place) @ motion / (2 * np.pi * 25.0) ** 2
        distance = np.linalg.norm((moved[:, None] * turn).real, axis=0).max()
        assert stroke == pytest.approx(distance, rel=1e-5)


def test_mounts_of_the_drawing_add_up_to_the_stiffness_found():
    _, body, found, _ = softened()
    mounts = softening_mounts(found)
    whole = found.calibrated.model.stiffness
    size = np.sqrt(np.outer(np.diag(whole), np.diag(whole)))
    assert np.max(np.abs(mounts.stiffness.sum(axis=0) - whole) / size) < 1e-10
    # at one stroke for all it is a common factor
    lines = np.array([20.0, 80.0])
    held = (2 + 0.5j) * np.stack([whole, 0.1 * whole])
    taken = mounts.matrices(lines, held, np.zeros((2, 6), complex))
    np.testing.assert_allclose(taken[0], held, rtol=1e-7, atol=1e-9 * np.abs(held).max())
    np.testing.assert_allclose(taken[1], 1j * taken[0])
    assert len(taken) == len(mounts.deviations) == 6
    with pytest.raises(InputError, match="softening mounts"):
        SofteningMounts(body.places, np.eye(6)[None])


def test_without_a_drawing_one_factor_stays():
    test, _, found, _ = softened()
    bare = replace(found, test=replace(found.test, drawing=None))
    assert softening_mounts(bare) is None
    one = replace(drawing(), mounts=drawing().mounts[:1])
    assert softening_mounts(replace(found, test=replace(found.test, drawing=one))) is None
    result = unbalance(test, bare, OPTIONS)
    assert result.by_letter("e").fit.change == UpdatedRoute().update
    assert not any("soften" in notice for notice in result.notices)


def test_mounts_that_changed_alike_keep_their_factor():
    test, _ = sample(1, storage=0.9, loss=1.1, lines=LINES, drawn=True)
    result = unbalance(test, softened()[2], OPTIONS)
    assert result.by_letter("e").fit.change == UpdatedRoute().update
    assert result.notices == ()


def test_statements_for_people():
    test, _ = sample(1, lines=LINES, drawn=True)
    result = unbalance(test, softened()[2], replace(OPTIONS, routes=OPTIONS.routes[:1]))
    assert result.sense.statement == "The rotor turns from y to z (beyond doubt)."
    assert isinstance(result.state, MountState)
    assert "real part 0.0 % ± 0.0 %" in result.state.statement
