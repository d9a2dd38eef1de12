"""Scatter of parts: textbook intervals, the prior, measuring taken off, batches recognised."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.mounts.characterised_mount import (
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.mount import Mount
from deboom.mounts.part_scatter import (
    ScatterPrior,
    batch_share,
    direction_scatter,
    hardness_share,
    library_scatter,
)
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points

RNG = np.random.default_rng(5)
THIRTY = 0.04 * RNG.standard_normal(30)


def test_thirty_parts_have_the_textbooks_interval():
    """Chi-square with 29 degrees of freedom: 16.047 and 45.722 (any table of quantiles)."""
    found = direction_scatter("TSM x", THIRTY)
    variance = THIRTY.var(ddof=1)
    assert found.sigma == pytest.approx(np.sqrt(variance), rel=1e-12)
    assert found.lower == pytest.approx(np.sqrt(29.0 * variance / 45.722), rel=1e-4)
    assert found.upper == pytest.approx(np.sqrt(29.0 * variance / 16.047), rel=1e-4)
    assert (found.prior_share, found.note, found.n_batches) == (0.0, "", 0)


def test_few_parts_are_combined_with_the_prior():
    """Scaled inverse chi-square: degrees of freedom add up, and so do sums of squares."""
    values, prior = THIRTY[:6], ScatterPrior(0.08, 10.0)
    found = direction_scatter("TSM x", values, prior=prior)
    combined = (10.0 * 0.08**2 + 5.0 * values.var(ddof=1)) / 15.0
    assert found.sigma == pytest.approx(np.sqrt(combined), rel=1e-12)
    assert found.prior_share == pytest.approx(10.0 / 15.0)
    assert found.note == "67 % assumed, 6 parts"
    # 15 degrees of freedom: 6.2621 and 27.488
    assert found.lower == pytest.approx(np.sqrt(15.0 * combined / 27.488), rel=1e-4)
    assert found.upper == pytest.approx(np.sqrt(15.0 * combined / 6.2621), rel=1e-4)


def test_without_parts_the_prior_stands_alone():
    found = direction_scatter("TSM x", np.empty(0), prior=ScatterPrior(0.05, 4.0))
    assert found.sigma == pytest.approx(0.05)
    assert found.note == "assumed: not identified in every part, or fewer than two parts"
    assert np.isnan(found.observed)
    assert not found.dominated


def test_measuring_is_taken_off_and_said_when_it_dominates():
    error = np.full(30, 0.02)
    found = direction_scatter("TSM x", THIRTY, error)
    assert found.sigma**2 == pytest.approx(THIRTY.var(ddof=1) - 0.02**2)
    bare = direction_scatter("TSM x", THIRTY)
    assert found.upper**2 == pytest.approx(bare.upper**2 - 0.02**2)
    common = direction_scatter("TSM x", THIRTY, error, has_common=True)
    assert (common.sigma, common.lower, common.upper) == (found.sigma, found.lower, bare.upper)
    lost = direction_scatter("TSM x", 0.02 * THIRTY / THIRTY.std(ddof=1), error)
    assert (lost.sigma, lost.lower) == (0.0, 0.0)
    assert lost.upper > 0.0
    assert "measuring dominates" in lost.note


def test_batches_add_their_scatter():
    """Two variances by hand: balanced one-way analysis of variance."""
    of_batch = np.repeat([0.03, -0.03, 0.01, -0.01, 0.0], 6)
    own = np.tile([0.01, -0.01, 0.02, -0.02, 0.005, -0.005], 5)
    labels = np.repeat(list("abcde"), 6)
    found = direction_scatter("TSM x", of_batch + own, batches=labels)
    between = 6.0 * np.var([0.03, -0.03, 0.01, -0.01, 0.0], ddof=1)
    within = (own**2).sum() / 25.0
    total = between / 6.0 + (1.0 - 1.0 / 6.0) * within
    assert found.sigma == pytest.approx(np.sqrt(total))
    assert found.n_batches == 5
    # few batches count little: the interval is wider than that of 30 parts of no batch
    bare = direction_scatter("TSM x", of_batch + own)
    assert found.upper / found.sigma > 1.3 * bare.upper / bare.sigma
    one = direction_scatter("TSM x", THIRTY, batches=["a"] * 30)
    assert one.note == "one batch: what batches differ by is not in it"
    share = batch_share((of_batch + own)[:, None], labels)
    exact = (between - within) / (between + 5.0 * within)
    assert share.value == pytest.approx(exact)
    assert share.lower < exact < share.upper


def test_parts_that_differ_no_more_between_batches_are_one_population():
    values = np.tile([0.01, -0.01], 15)
    found = direction_scatter("TSM x", values, batches=np.repeat(list("abc"), 10))
    assert found.sigma == pytest.approx(np.sqrt((values**2).sum() / 27.0))
    assert batch_share(values[:, None], np.repeat(list("abc"), 10)).value == 0.0


def test_the_share_of_hardness_is_recovered():
    rng = np.random.default_rng(3)
    common = rng.standard_normal((400, 1))
    values = 0.05 * (np.sqrt(0.7) * common + np.sqrt(0.3) * rng.standard_normal((400, 3)))
    found = hardness_share([values[:200] + 1.0, values[200:, :2]])
    assert found.value == pytest.approx(0.7, abs=0.05)
    assert found.lower < 0.7 < found.upper
    noisy = values + 0.05 * rng.standard_normal((400, 3))
    assert hardness_share([noisy]).value == pytest.approx(0.35, abs=0.06)
    stiffer_axes = hardness_share([noisy * [1.0, 30.0, 0.02]])
    assert stiffer_axes.value == pytest.approx(hardness_share([noisy]).value)
    assert hardness_share([noisy], reliability=0.5).value == pytest.approx(0.7, abs=0.1)
    assert hardness_share([values[:1], values[:, :1], np.ones((5, 2))]) is None


@cache
def surface(factor=1.0):
    if factor != 1.0:
        arrays = surface().to_arrays()
        names = ("real_coefficients", "imag_coefficients")
        scaled = {name: factor * arrays[name] for name in names}
        return DynamicStiffnessSurface.from_arrays(arrays | scaled)
    rng = np.random.default_rng(3)
    preload, amplitude = rng.normal(0.0, 800.0, 300), rng.uniform(1e-5, 1e-3, 300)
    frequency = rng.uniform(20.0, 80.0, 300)
    stiffness = 2e5 * (1.0 + 1e-4 * preload) * (1.0 + 0.1j) + 100.0 * frequency
    lines = operating_points(preload, amplitude, frequency)
    return DynamicStiffnessSurface().fit(lines, stiffness)


def part(factors, serial, *, name="TSM", half_width=0.004, **identity):
    quality = DirectionQuality(True, half_width, 0.99, 0.99, 0.99)
    surfaces = [surface(float(factor)) for factor in factors]
    directions = tuple(
        CharacterisedDirection(axis, MapPoints.none(), quality, fitted)
        for axis, fitted in zip("xz", surfaces, strict=True)
    )
    known = {"campaign": "spring", "variant": "M1", "serial": serial} | identity
    mount = Mount(name, "", ("",), ((0.1, 0.2, 0.3),), ("x", "z"))
    return CharacterisedMount(MountIdentity(mount=name, **known), mount, directions, {})


def library(n_batches=4, n_parts=6):
    rng = np.random.default_rng(8)
    parts, factors = [], []
    for batch in range(n_batches):
        of_batch = 0.03 * rng.standard_normal()
        for number in range(n_parts):
            factors.append(np.exp(of_batch + 0.03 * rng.standard_normal(2)))
            parts.append(part(factors[-1], f"B{batch}/{number:03d}"))
    return parts, np.log(factors)


def test_parts_of_a_library_are_compared_under_equal_conditions():
    parts, factors = library()
    scatter = library_scatter(parts)
    assert [direction.name for direction in scatter.directions] == ["TSM x", "TSM y", "TSM z"]
    batches = np.repeat(["B0", "B1", "B2", "B3"], 6)
    for axis, column in zip("xz", factors.T, strict=True):
        wanted = direction_scatter(
            f"TSM {axis}", column, np.full(24, 0.004 / 1.959964), batches, has_common=True
        )
        direction = scatter.direction(f"TSM {axis}")
        for name in ("sigma", "lower", "upper", "observed", "measurement"):
            assert getattr(direction, name) == pytest.approx(getattr(wanted, name), rel=1e-8)
        assert (direction.n_parts, direction.n_batches) == (24, 4)
    assert scatter.direction("TSM y").prior_share == 1.0
    assert scatter.direction("EnM x") is None
    assert scatter.batches["TSM"].lower < 0.5 < scatter.batches["TSM"].upper
    assert scatter.hardness.lower < 0.5 < scatter.hardness.upper


def test_a_part_measured_twice_is_one_part():
    parts = [part((1.0, 1.0), "1"), part((1.1, 1.0), "2")]
    scatter = library_scatter([*parts, part((1.02, 1.0), "1", campaign="autumn")])
    direction = scatter.direction("TSM x")
    assert (direction.n_parts, direction.n_batches, scatter.batches) == (2, 0, {})
    difference = np.log(1.1) - 0.5 * np.log(1.02)
    assert direction.observed == pytest.approx(difference / np.sqrt(2), rel=1e-9)


def test_an_axis_that_is_not_identified_everywhere_is_left_to_the_prior():
    parts = [part((1.0, 1.0), "1"), part((1.1, 1.0), "2")]
    unknown = replace(parts[0].directions[1], quality=DirectionQuality(False))
    parts[0] = replace(parts[0], directions=(parts[0].directions[0], unknown))
    scatter = library_scatter(parts)
    assert scatter.direction("TSM x").n_parts == 2
    assert scatter.direction("TSM z").prior_share == 1.0


def test_parts_that_cannot_be_compared_are_refused():
    with pytest.raises(InputError, match="no part to learn"):
        library_scatter([])
    both = [part((1.0, 1.0), "1", part_number="A"), part((1.1, 1.0), "2", part_number="B")]
    with pytest.raises(InputError, match=r"numbers \['A', 'B'\].*choose one number"):
        library_scatter(both)
    parts = [part((1.0, 1.0), "1"), part((1.1, 1.0), "2")]
    far = surface()
    points = far.region_.points
    moved_away = points + np.array([1e5, 0, 0])
    shifted = DynamicStiffnessSurface().fit(moved_away, far.predict(points, True))
    moved = replace(parts[1].directions[0], surface=shifted)
    parts[1] = replace(parts[1], directions=(moved, parts[1].directions[1]))
    with pytest.raises(InputError, match="TSM x: its 2 parts were measured at only 0 common"):
        library_scatter(parts)
