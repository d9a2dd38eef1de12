"""A direction that is called free moves no vehicle noticeably, anywhere in its range."""

import numpy as np
import pytest

import deboom
from deboom.bench.platform_writer import write_platform
from deboom.explore.selection import variables_without_effect
from deboom.vehicles.booming_peaks import compare_peaks
from deboom.vehicles.free_directions import Need, free_directions

SEEDS = (11, 12, 13)
TRIED = 40


def steepest(model, space):
    """Design at the bounds that lowers the mean of the fleet, as a search ends there."""
    slope = model.gradient(space.nominal[np.newaxis])[0].mean(axis=0)
    return np.where(slope > 0.0, space.lower, space.upper)


def change(model, before, after):
    """Largest change of any vehicle, by lines and peaks, written out again."""
    levels = [model.levels(design[np.newaxis])[0] for design in (before, after)]
    moves = [abs(new.mean() - old.mean()) for old, new in zip(*levels, strict=True)]
    for old, new in zip(*levels, strict=True):
        peaks = compare_peaks(old, new, model.frequency, 2.0)
        moves += [abs(peak.level_after - peak.level_before) for peak in peaks]
    return max(moves)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_free_direction_moves_any_vehicle_by_more_than_stated(tmp_path, seed):
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
        for value in (low, high, *draws.uniform(low, high, TRIED)):
            moved = design.copy()
            moved[column] = value
            assert change(model, design, moved) <= freedom.amount, freedom.names[column]
    reach = freedom.searched[freedom.free]
    assert np.array_equal(freedom.interval[freedom.free], reach)
    assert reach.min() == pytest.approx(0.68)
    assert reach.max() == pytest.approx(1.38)


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
