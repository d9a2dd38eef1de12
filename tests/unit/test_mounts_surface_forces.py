"""Characterised mounts in other runs, and the scatter of parts."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.mounts import part_scatter, surface_forces
from deboom.mounts.characterised_mount import (
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.mount import Mount
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points

FREQUENCY = np.arange(20.0, 60.5, 0.5)
TORQUES = (200.0, 400.0, 600.0, 700.0, 800.0)


def points(axis, force_per_torque):
    """Five runs whose stiffness follows the force along x, 2 N per N m."""
    frequency = np.tile(FREQUENCY, len(TORQUES))
    torque = np.repeat(TORQUES, FREQUENCY.size)
    along = 2.0 * torque
    amplitude = 1e-4 * (1 + 0.3 * np.sin(frequency) + torque / 800)
    return MapPoints(
        preload=force_per_torque * torque + (0 if axis == "x" else 30 * np.sin(torque)),
        wheel_torque=torque,
        amplitude=amplitude,
        frequency=frequency,
        dynamic_stiffness=1e5 + 50.0 * along + 100.0 * frequency + 50j * frequency,
        confidence=np.where(frequency < 21, 0.0, 1.0),
        run=[f"t{value:.0f}" for value in torque],
    )


def mount(**new):
    directions = {"x": points("x", 2.0), "z": points("z", 0.1), **new}
    return CharacterisedMount(
        MountIdentity("spring", "TSM", "M1"),
        Mount("TSM", "", ("",), ((0.2, 0.0, -0.3),), ("x",)),
        tuple(
            CharacterisedDirection(axis, map_points, DirectionQuality(identified=False))
            for axis, map_points in directions.items()
        ),
        {},
    )


def test_the_main_axis_is_that_of_the_widest_static_force():
    assert surface_forces.main_axis(mount()) == "x"


def test_a_surface_over_the_force_along_the_main_axis():
    surface = surface_forces.surface_over_main_force(mount(), "z")
    assert surface.preload_unit == "N"
    assert surface.n_lines_ == len(TORQUES) * (FREQUENCY.size - 2)
    stiffness = surface.predict([1000.0, 1.6e-4, 40.0], extrapolate=True)
    assert stiffness == pytest.approx(1e5 + 50e3 + 4e3 + 2e3j, rel=1e-3)


def test_noise_of_the_static_force_is_smoothed_run_by_run():
    run = np.repeat(["a", "b"], FREQUENCY.size)
    frequency = np.tile(FREQUENCY, 2)
    true = np.where(run == "a", 0.05 * frequency**2, 500.0)
    noise = np.random.default_rng(1).normal(0, 5.0, true.size)
    assert surface_forces.smooth_static_force(true, frequency, run) == pytest.approx(true)
    noisy = true + noise
    error = surface_forces.smooth_static_force(noisy, frequency, run) - true
    assert 1.0 < np.std(error) < 3.2
    coarse = slice(None, None, 5)
    kept = surface_forces.smooth_static_force(noisy[coarse], frequency[coarse], run[coarse])
    assert np.array_equal(kept, noisy[coarse])
    five = slice(None, None, 2)  # lines within the width: a parabola, not a mean of them
    smoothed = surface_forces.smooth_static_force(noisy[five], frequency[five], run[five])
    assert 0.5 < np.std(smoothed - true[five]) / 5.0 < 0.9
    parabola = np.polyfit(range(5), noisy[five][:5], 2)
    assert smoothed[:3] == pytest.approx(np.polyval(parabola, range(3)))
    uneven = np.sort(np.random.default_rng(2).uniform(20, 60, 50))
    names = np.full(50, "a")
    assert np.array_equal(surface_forces.smooth_static_force(noise[:50], uneven, names), noise[:50])


def test_what_cannot_be_fitted_is_refused_in_words():
    masked = replace(points("z", 0.1), confidence=np.zeros(len(points("z", 0.1))))
    with pytest.raises(InputError, match="direction z: none of its 405 lines is above the noise"):
        surface_forces.surface_over_main_force(mount(z=masked), "z")
    other = replace(points("z", 0.1), run=["other"] * 405)
    with pytest.raises(InputError, match="the lines of z and x are not those of the same runs"):
        surface_forces.surface_over_main_force(mount(z=other), "z")
    none = MapPoints.none()
    with pytest.raises(InputError, match="it has no measured line"):
        surface_forces.main_axis(mount(x=none, z=none))


LINES = np.linspace(20.0, 60.0, 41)
TORQUE = np.linspace(20.0, 220.0, 41)
RATIO = 3.4
CHANNELS = ("TSM x", "TSM y", "TSM z", "Du left x", "Du right x")
NO_POINTS = MapPoints.none()


def stiffness(wheel_torque, amplitude, frequency):
    """Return a cubic that a surface represents exactly [N/m]."""
    torque, motion = wheel_torque / 700, amplitude / 1e-3
    real = 2e5 * (1 + 0.8 * torque**2 - 0.2 * motion + 0.1 * torque * motion)
    return real + 2e4j * (1 + frequency / 60)


def fitted(preload_unit="N m", highest=1.05):
    rng = np.random.default_rng(3)
    torque = rng.uniform(0, highest * RATIO * TORQUE[-1], 4000)
    amplitude = rng.uniform(0, 1.2e-3, 4000)
    frequency = rng.uniform(19, 61, 4000)
    values = stiffness(torque, amplitude, frequency)
    lines = operating_points(torque, amplitude, frequency)
    return DynamicStiffnessSurface(preload_unit=preload_unit).fit(lines, values)


SURFACE = fitted()
KNOWN = DirectionQuality(identified=True)
UNKNOWN = DirectionQuality(identified=False)


def characterised(name, pieces, directions):
    mount = Mount(name, "", pieces, ((0.0, 0.0, 0.0),) * len(pieces), ("x",))
    identity = MountIdentity("spring", name, "M0")
    return CharacterisedMount(
        identity,
        mount,
        tuple(CharacterisedDirection(a, NO_POINTS, q, s) for a, q, s in directions),
        {},
    )


TSM = characterised("TSM", ("",), [("x", KNOWN, SURFACE), ("y", UNKNOWN, SURFACE)])
DU = characterised("Du", ("left", "right"), [("x", KNOWN, SURFACE)])


def load_case():
    rng = np.random.default_rng(1)
    size = rng.uniform(1e-4, 1e-3, (41, 5))
    displacement = size * np.exp(1j * rng.uniform(-np.pi, np.pi, (41, 5)))
    force = rng.normal(size=(41, 5)) + 1j
    motion, pushed = (
        Spectrum(LINES, displacement, CHANNELS, "m"),
        Spectrum(LINES, force, CHANNELS, "N"),
    )
    return LoadCase("g5", "5th gear", 5, RATIO, 220.0, 1.5, motion, pushed, TORQUE)


def truth(case):
    s = case.displacement.values
    return stiffness((RATIO * TORQUE)[:, None], np.abs(s), LINES[:, None]) * s


def test_force_is_stiffness_at_the_point_of_operation_times_motion():
    case = load_case()
    result = surface_forces.surface_forces(case, [TSM, DU])
    modelled = result.load_case
    assert (modelled.name, modelled.force.unit) == ("g5", "N")
    assert modelled.displacement is case.displacement
    for channel in ("TSM x", "Du left x", "Du right x"):
        column = CHANNELS.index(channel)
        expected = truth(case)[:, column]
        error = np.abs(modelled.force.values[:, column] - expected)
        assert error.max() < 1e-6 * np.abs(expected).max()


def test_directions_that_cannot_be_believed_keep_the_measured_force_and_say_so():
    case = load_case()
    result = surface_forces.surface_forces(case, [TSM, DU])
    for channel in ("TSM y", "TSM z"):
        column = CHANNELS.index(channel)
        np.testing.assert_array_equal(
            result.load_case.force.values[:, column], case.force.values[:, column]
        )
    assert result.measured == {"TSM y": "not identified", "TSM z": "not characterised"}
    assert result.outside == {"TSM x": 0, "Du left x": 0, "Du right x": 0}


def test_a_direction_without_a_surface_says_so():
    bare = characterised("TSM", ("",), [(axis, UNKNOWN, None) for axis in "xyz"])
    reasons = surface_forces.surface_forces(load_case(), [bare, DU]).measured
    assert reasons == dict.fromkeys(CHANNELS[:3], "no surface")


def test_lines_outside_of_the_measured_region_are_refused_by_name():
    low = fitted(highest=0.5)
    tsm = characterised("TSM", ("",), [("x", KNOWN, low)])
    case = load_case()
    with pytest.raises(InputError) as refusal:
        surface_forces.surface_forces(case, [tsm, DU])
    sentence = str(refusal.value)
    outside = np.flatnonzero(1.02 * low.ranges["preload"][1] < RATIO * TORQUE)
    assert f"{outside.size} of 41 lines, from {LINES[outside[0]]:g} to 60 Hz" in sentence
    for word in ("load case g5", "'TSM x'", "TSM M0 of campaign spring", "keep the measured force"):
        assert word in sentence

    kept = surface_forces.surface_forces(case, [tsm, DU], surface_forces.Outside.KEEP_MEASURED)
    assert kept.measured["TSM x"] == f"{outside.size} of 41 lines are outside"
    np.testing.assert_array_equal(
        kept.load_case.force.values[outside, 0], case.force.values[outside, 0]
    )
    inside = np.setdiff1d(np.arange(41), outside)
    error = np.abs(kept.load_case.force.values[inside, 0] - truth(case)[inside, 0])
    assert error.max() < 1e-6 * np.abs(truth(case)[inside, 0]).max()


ELSEWHERE = characterised("EnM", ("",), [("x", KNOWN, SURFACE)])
STATIC = characterised("TSM", ("",), [("x", KNOWN, fitted("N"))])


@pytest.mark.parametrize(
    ("mounts", "words"),
    [
        (
            [TSM],
            r"no characterised mount has the channels \['Du left x', 'Du right x'\], the .* TSM",
        ),
        ([], "the mounts are none at all"),
        ([TSM, DU, ELSEWHERE], "EnM M0 of campaign spring has no channel in it"),
        ([TSM, DU, TSM], "two characterised mounts are TSM: keep one"),
        ([STATIC, DU], "its surface is over static force, which a load case does not carry"),
    ],
)
def test_mounts_that_do_not_fit_the_run_are_refused(mounts, words):
    with pytest.raises(InputError, match=words):
        surface_forces.surface_forces(load_case(), mounts)


def test_a_run_without_engine_torque_has_no_preload():
    with pytest.raises(InputError, match="g5: its engine torque was not recorded"):
        surface_forces.surface_forces(replace(load_case(), engine_torque=None), [TSM, DU])


RNG = np.random.default_rng(5)
THIRTY = 0.04 * RNG.standard_normal(30)


def test_thirty_parts_have_the_textbooks_interval():
    """Chi-square with 29 degrees of freedom: 16.047 and 45.722 (any table of quantiles)."""
    scatter = part_scatter.direction_scatter("TSM x", THIRTY)
    variance = THIRTY.var(ddof=1)
    assert scatter.sigma == pytest.approx(np.sqrt(variance), rel=1e-12)
    expected = np.sqrt(29.0 * variance / [45.722, 16.047])
    assert [scatter.lower, scatter.upper] == pytest.approx(expected, rel=1e-4)
    assert (scatter.prior_share, scatter.note, scatter.n_batches) == (0.0, "", 0)


def test_few_parts_are_combined_with_the_prior():
    """Scaled inverse chi-square: degrees of freedom add up, and so do sums of squares."""
    values, prior = THIRTY[:6], part_scatter.ScatterPrior(0.08, 10.0)
    scatter = part_scatter.direction_scatter("TSM x", values, prior=prior)
    combined = (10.0 * 0.08**2 + 5.0 * values.var(ddof=1)) / 15.0
    assert scatter.sigma == pytest.approx(np.sqrt(combined), rel=1e-12)
    assert scatter.prior_share == pytest.approx(10.0 / 15.0)
    assert scatter.note == "67 % assumed, 6 parts"
    # 15 degrees of freedom: 6.2621 and 27.488
    expected = np.sqrt(15.0 * combined / [27.488, 6.2621])
    assert [scatter.lower, scatter.upper] == pytest.approx(expected, rel=1e-4)


def test_without_parts_the_prior_stands_alone():
    scatter = part_scatter.direction_scatter("TSM x", np.empty(0))
    assert scatter.sigma == pytest.approx(0.05)
    assert scatter.note == "assumed: not identified in every part, or fewer than two parts"
    assert np.isnan(scatter.observed)
    assert not scatter.dominated


def test_measuring_is_taken_off_and_said_when_it_dominates():
    error = np.full(30, 0.02)
    scatter = part_scatter.direction_scatter("TSM x", THIRTY, error)
    assert scatter.sigma**2 == pytest.approx(THIRTY.var(ddof=1) - 0.02**2)
    bare = part_scatter.direction_scatter("TSM x", THIRTY)
    assert scatter.upper**2 == pytest.approx(bare.upper**2 - 0.02**2)
    common = part_scatter.direction_scatter("TSM x", THIRTY, error, has_common=True)
    assert (common.sigma, common.lower, common.upper) == (scatter.sigma, scatter.lower, bare.upper)
    lost = part_scatter.direction_scatter("TSM x", 0.02 * THIRTY / THIRTY.std(ddof=1), error)
    assert (lost.sigma, lost.lower) == (0.0, 0.0)
    assert lost.upper > 0.0
    assert "measuring dominates" in lost.note


def test_batches_add_their_scatter():
    """Two variances by hand: balanced one-way analysis of variance."""
    of_batch = np.repeat([0.03, -0.03, 0.01, -0.01, 0.0], 6)
    of_part = np.tile([0.01, -0.01, 0.02, -0.02, 0.005, -0.005], 5)
    labels = np.repeat(list("abcde"), 6)
    scatter = part_scatter.direction_scatter("TSM x", of_batch + of_part, batches=labels)
    between = 6.0 * np.var([0.03, -0.03, 0.01, -0.01, 0.0], ddof=1)
    within = (of_part**2).sum() / 25.0
    total = between / 6.0 + (1.0 - 1.0 / 6.0) * within
    assert scatter.sigma == pytest.approx(np.sqrt(total))
    assert scatter.n_batches == 5
    # few batches count little: the interval is wider than that of 30 parts of no batch
    bare = part_scatter.direction_scatter("TSM x", of_batch + of_part)
    assert scatter.upper / scatter.sigma > 1.3 * bare.upper / bare.sigma
    single_batch = part_scatter.direction_scatter("TSM x", THIRTY, batches=["a"] * 30)
    assert single_batch.note == "one batch: what batches differ by is not in it"
    share = part_scatter.batch_share((of_batch + of_part)[:, None], labels)
    exact = (between - within) / (between + 5.0 * within)
    assert share.value == pytest.approx(exact)
    assert share.lower < exact < share.upper


def test_parts_that_differ_no_more_between_batches_are_one_population():
    values = np.tile([0.01, -0.01], 15)
    scatter = part_scatter.direction_scatter("TSM x", values, batches=np.repeat(list("abc"), 10))
    assert scatter.sigma == pytest.approx(np.sqrt((values**2).sum() / 27.0))
    assert part_scatter.batch_share(values[:, None], np.repeat(list("abc"), 10)).value == 0.0


def test_the_share_of_hardness_is_recovered():
    rng = np.random.default_rng(3)
    common = rng.standard_normal((400, 1))
    values = 0.05 * (np.sqrt(0.7) * common + np.sqrt(0.3) * rng.standard_normal((400, 3)))
    share = part_scatter.hardness_share([values[:200] + 1.0, values[200:, :2]])
    assert share.value == pytest.approx(0.7, abs=0.05)
    assert share.lower < 0.7 < share.upper
    noisy = values + 0.05 * rng.standard_normal((400, 3))
    assert part_scatter.hardness_share([noisy]).value == pytest.approx(0.35, abs=0.06)
    stiffer_axes = part_scatter.hardness_share([noisy * [1.0, 30.0, 0.02]])
    assert stiffer_axes.value == pytest.approx(part_scatter.hardness_share([noisy]).value)
    assert part_scatter.hardness_share([noisy], reliability=0.5).value == pytest.approx(
        0.7, abs=0.1
    )
    assert part_scatter.hardness_share([values[:1], values[:, :1], np.ones((5, 2))]) is None


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
    identity_of_part = {"campaign": "spring", "variant": "M1", "serial": serial} | identity
    mount = Mount(name, "", ("",), ((0.1, 0.2, 0.3),), ("x", "z"))
    return CharacterisedMount(MountIdentity(mount=name, **identity_of_part), mount, directions, {})


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
    scatter = part_scatter.library_scatter(parts)
    assert [direction.name for direction in scatter.directions] == ["TSM x", "TSM y", "TSM z"]
    batches = np.repeat(["B0", "B1", "B2", "B3"], 6)
    for axis, column in zip("xz", factors.T, strict=True):
        wanted = part_scatter.direction_scatter(
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
    scatter = part_scatter.library_scatter([*parts, part((1.02, 1.0), "1", campaign="autumn")])
    direction = scatter.direction("TSM x")
    assert (direction.n_parts, direction.n_batches, scatter.batches) == (2, 0, {})
    difference = np.log(1.1) - 0.5 * np.log(1.02)
    assert direction.observed == pytest.approx(difference / np.sqrt(2), rel=1e-9)


def test_an_axis_that_is_not_identified_everywhere_is_left_to_the_prior():
    parts = [part((1.0, 1.0), "1"), part((1.1, 1.0), "2")]
    unknown = replace(parts[0].directions[1], quality=DirectionQuality(False))
    parts[0] = replace(parts[0], directions=(parts[0].directions[0], unknown))
    scatter = part_scatter.library_scatter(parts)
    assert scatter.direction("TSM x").n_parts == 2
    assert scatter.direction("TSM z").prior_share == 1.0


def test_parts_that_cannot_be_compared_are_refused():
    with pytest.raises(InputError, match="no part to learn"):
        part_scatter.library_scatter([])
    both = [part((1.0, 1.0), "1", part_number="A"), part((1.1, 1.0), "2", part_number="B")]
    with pytest.raises(InputError, match=r"numbers \['A', 'B'\].*choose one number"):
        part_scatter.library_scatter(both)
    parts = [part((1.0, 1.0), "1"), part((1.1, 1.0), "2")]
    far = surface()
    points = far.region_.points
    over_torque = DynamicStiffnessSurface(preload_unit="N m").fit(points, far.predict(points, True))
    other = replace(parts[1].directions[0], surface=over_torque)
    mixed = [parts[0], replace(parts[1], directions=(other, parts[1].directions[1]))]
    with pytest.raises(InputError, match="TSM x: its parts are characterised over different"):
        part_scatter.library_scatter(mixed)
    moved_away = points + np.array([1e5, 0, 0])
    shifted = DynamicStiffnessSurface().fit(moved_away, far.predict(points, True))
    moved = replace(parts[1].directions[0], surface=shifted)
    parts[1] = replace(parts[1], directions=(moved, parts[1].directions[1]))
    with pytest.raises(InputError, match="TSM x: its 2 parts were measured at only 0 common"):
        part_scatter.library_scatter(parts)
