"""Stated ranges of directions move no vehicle noticeably, boxes keep every vehicle's level."""

import numpy as np
import pytest

import deboom
from deboom.bench.platform_writer import write_platform
from deboom.explore.box import BoxQuestion
from deboom.explore.largest_box import BoxEffort, largest_box
from deboom.explore.selection import variables_without_effect
from deboom.measurement.booming_peaks import compare_peaks
from deboom.vehicles.free_directions import Need, free_directions
from deboom.vehicles.limits import MeanLevel

# in the last two a peak finds another partner just inside where a scan over the range alone ends
SLOW = pytest.mark.slow("draws a platform of its own")
SEEDS = (pytest.param(11, marks=SLOW), 22, pytest.param(23, marks=SLOW))
TRIED, PARTS, SHARE = 80, 2**14, 0.95


def steepest(model, space):
    """Design at the bounds that lowers the mean of the fleet, as a search ends there."""
    slope = model.gradient(space.nominal[np.newaxis])[0].mean(axis=0)
    return np.where(slope > 0.0, space.lower, space.upper)


def change(model, before, after):
    """Largest change of any vehicle, by lines and peaks, written out again; levels (v, f)."""
    moves = [abs(new.mean() - old.mean()) for old, new in zip(before, after, strict=True)]
    for old, new in zip(before, after, strict=True):
        peaks = compare_peaks(old, new, model.frequency, 2.0)
        moves += [abs(peak.level_after - peak.level_before) for peak in peaks]
    return max(moves)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_stated_interval_moves_any_vehicle_by_more_than_stated(tmp_path, seed):
    platform = deboom.read_platform(write_platform(tmp_path / "drawn", seed))
    model = platform.model(motion="prescribed", mounts="spectra")
    space = model.design_space(bounds=0.2, tolerance=0.15)
    design = steepest(model, space)
    without = variables_without_effect(model, space)
    freedom = free_directions(model, design, space, without_effect=without)
    draws = np.random.default_rng(seed)
    assert freedom.free.any()
    assert not freedom.free.all()
    for column, (low, high) in enumerate(freedom.interval):
        moved = np.tile(design, (TRIED + 2, 1))
        moved[:, column] = [low, high, *draws.uniform(low, high, TRIED)]
        levels = model.levels(np.vstack([design, moved]))
        worst = max(change(model, levels[0], after) for after in levels[1:])
        assert worst <= freedom.amount, freedom.names[column]
    reach = freedom.searched[freedom.free]
    assert np.array_equal(freedom.interval[freedom.free], reach)
    assert reach.min() == pytest.approx(0.68)
    assert reach.max() == pytest.approx(1.38)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_box_keeps_the_level_of_today_in_every_vehicle_at_its_share(tmp_path, seed):
    """Parts that are drawn anew, judged by the mean of the levels of the lines."""
    platform = deboom.read_platform(write_platform(tmp_path / "drawn", seed))
    model = platform.model(vehicles="U06", motion="prescribed", mounts="spectra")
    space = model.design_space(bounds=0.2, tolerance=0.15)
    response, today = MeanLevel(model), model.levels(space.nominal[np.newaxis])[0].mean(axis=-1)
    ends = {"lower": space.lower * 0.85, "upper": space.upper * 1.15}
    question = BoxQuestion(response, today, SHARE, **ends, together=True)
    effort = BoxEffort(starts=1, calibration=2**14, verification=2**15)
    solution = largest_box(question, seed=1, points=[steepest(model, space)], effort=effort)
    box = solution.box
    parts = np.random.default_rng(seed).uniform(box.lower, box.upper, (PARTS, len(box.lower)))
    levels = np.concatenate([model.levels(some).mean(axis=-1) for some in np.split(parts, 16)])
    shares = np.mean(levels <= today, axis=0)
    error = np.sqrt(SHARE * (1.0 - SHARE) / PARTS)
    # of the whole part, and therefore of each vehicle
    assert np.mean(np.all(levels <= today, axis=1)) >= SHARE - 3.0 * error
    assert shares.min() >= SHARE - 3.0 * error
    # the box is no smaller than it has to be, unless bounds end it
    assert solution.verified.share <= SHARE + 0.02 or np.all(box.width > 0.69)


def test_what_the_mean_of_a_fleet_hides_is_not_free():
    model = deboom.read_platform("u06").model(vehicles="U06")
    space = model.design_space(bounds=0.2, tolerance=0.15)
    design = steepest(model, space)
    freedom = free_directions(model, design, space)
    place = model.variable_names.index("GeM x")
    ends = np.tile(design, (2, 1))
    ends[:, place] = 0.8, 1.2
    levels = model(ends) / model.n_lines
    # half of the vehicles gain what the other half loses
    assert abs(np.diff(levels.mean(axis=1))[0]) < 0.2
    assert freedom.vehicles[int(freedom.move[place].argmax())] == "U06-5"
    assert freedom.move[place].max() > 2.0
    assert freedom.needs[place] is Need.wanted
