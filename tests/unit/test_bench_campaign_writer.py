"""A written campaign: complete or not there, repeatable, independent runs, refused plans."""

import numpy as np
import pytest

from deboom.bench.campaign_layout import CELL_OFFSETS
from deboom.bench.campaign_operation import true_run
from deboom.bench.campaign_plan import (
    FULL_PLAN,
    TRAINING_RUNS,
    CampaignPlan,
    PlannedRun,
    TimeRunPlan,
    training_plan,
)
from deboom.bench.campaign_sensors import cell_distribution
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.mount_sets import DRAWING, MIX, mount_set, with_mount_set
from deboom.bench.parameters import load_bench
from deboom.errors import InputError
from deboom.files.campaign import read_campaign

BENCH = load_bench()
FREQUENCY = np.linspace(20.0, 80.0, 25)
RAMP = PlannedRun(5, 220.0, full_load=True)
SLICE = PlannedRun(6, 60.0, full_load=False)
SMALL = CampaignPlan(("M1",), (RAMP, SLICE), shaker_repeats=1, frequency=FREQUENCY)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_campaign(tmp_path_factory.mktemp("campaign") / "small", 3, SMALL)


def files_of(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def test_the_same_seed_gives_the_same_bytes(written, tmp_path):
    seen = []
    again = write_campaign(tmp_path / "again", 3, SMALL, progress=lambda *now: seen.append(now))
    assert files_of(again) == files_of(written)
    for name in files_of(written):
        assert (again / name).read_bytes() == (written / name).read_bytes(), name
    assert [done for done, _, _ in seen] == list(range(1, len(seen) + 1))
    assert {total for _, total, _ in seen} == {len(seen)}
    assert seen[-1][2] == "campaign.toml"


def test_a_run_does_not_depend_on_the_plan(written, tmp_path):
    runs = (PlannedRun(7, 120.0, full_load=True), RAMP)
    plan = CampaignPlan(("M2", "M1"), runs, shaker_repeats=2, frequency=FREQUENCY)
    other = write_campaign(tmp_path / "other", 3, plan)
    for name in ("runs/M1/g5_wot220.uff", "shaker/TSM_y_1.uff", "static_curves/M1/EnM_z.csv"):
        assert (other / name).read_bytes() == (written / name).read_bytes(), name


def test_another_seed_is_another_bench_on_the_same_mounts(written, tmp_path):
    other = write_campaign(tmp_path / "other", 4, SMALL)
    for name in files_of(written):
        differs = (other / name).read_bytes() != (written / name).read_bytes()
        assert differs == (name not in ("channels.csv", "truth/M1.npz")), name


def test_the_truth_is_not_asked_for(written, tmp_path):
    campaign = read_campaign(written)
    assert not any("truth" in path.parts for path in campaign.input_files)
    readme = (written / "README.txt").read_text(encoding="utf-8")
    for sensor in campaign.sensors:
        assert f" {sensor.name} " in readme


def test_a_failed_campaign_leaves_nothing(tmp_path):
    plan = CampaignPlan(("M1",), (PlannedRun(9, 100.0, True),), frequency=FREQUENCY)
    with pytest.raises(InputError, match="gear 9: the gearbox has the gears 1 to 7"):
        write_campaign(tmp_path / "failed", 1, plan)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("seed", [0, -1])
def test_seeds_below_one_are_refused(tmp_path, seed):
    with pytest.raises(InputError, match="seeds are whole numbers from 1"):
        write_campaign(tmp_path / "refused", seed, SMALL)


def test_the_plans_hold_what_is_characterised():
    assert len(TRAINING_RUNS) == 27
    assert {run.gear for run in TRAINING_RUNS} == {5, 6, 7}
    assert all(run.rising for run in TRAINING_RUNS)
    assert training_plan("M1", "M3").mount_sets == ("M1", "M3")
    assert len(FULL_PLAN.mount_sets) == 6
    assert {run.gear for run in FULL_PLAN.runs} == {3, 4, 5, 6, 7}
    assert 0 < sum(not run.rising for run in FULL_PLAN.runs) < 10
    assert FULL_PLAN.time_run is not None
    assert PlannedRun(5, 60.0, False, rising=False).name == "g5_slice060_falling"


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: CampaignPlan(mount_sets=()), "without a mount set"),
        (lambda: CampaignPlan(runs=()), "without a run"),
        (lambda: CampaignPlan(runs=(RAMP, RAMP)), "run 'g5_wot220' comes twice"),
        (lambda: CampaignPlan(mount_sets=("M1", "M1")), "mount set 'M1' comes twice"),
        (lambda: CampaignPlan(shaker_repeats=0), "at least one is needed"),
        (lambda: PlannedRun(5, 0.0, full_load=True), "above 0 N m"),
        (lambda: TimeRunPlan(first_speed=2000.0, last_speed=1500.0), "not a rising run"),
        (lambda: TimeRunPlan(duration=0.0), "must be positive"),
    ],
)
def test_plans_that_make_no_sense_are_refused(make, says):
    with pytest.raises(InputError, match=says):
        make()


def test_units_scatter_and_stay_the_same_part():
    first = with_mount_set(BENCH, mount_set("M1", BENCH))
    mix = with_mount_set(BENCH, mount_set(MIX, BENCH))
    fourth = with_mount_set(BENCH, mount_set("M4", BENCH))
    drawn = with_mount_set(BENCH, mount_set(DRAWING, BENCH))
    assert drawn.powertrain.laws == BENCH.powertrain.laws
    assert mix.powertrain.laws[:3] == first.powertrain.laws[:3]
    assert mix.powertrain.laws[3:] != first.powertrain.laws[3:]
    assert mix.wheel_end.laws == fourth.wheel_end.laws
    units = [with_mount_set(BENCH, mount_set(f"M{k}", BENCH)) for k in range(1, 200)]
    drawn_stiffness = np.array([law.stiffness for law in BENCH.powertrain.laws])
    stiffness = [[law.stiffness for law in unit.powertrain.laws] for unit in units]
    ratios = np.array(stiffness) / drawn_stiffness
    assert np.std(ratios) == pytest.approx(0.05, rel=0.1)
    assert np.abs(ratios - 1).max() <= 0.15 + 1e-12


@pytest.mark.parametrize("name", ["A1", "M", "EnM1-GeM2", "EnM1-GeM2-TSM3-TSM4", "EnM1-x"])
def test_unknown_mount_sets_are_refused(name):
    with pytest.raises(InputError, match=f"unknown mount set '{name}'"):
        mount_set(name, BENCH)


def test_cells_carry_the_whole_force_and_its_moment():
    for offsets in map(np.array, CELL_OFFSETS.values()):
        shares = cell_distribution(offsets)
        assert shares.sum(axis=0) == pytest.approx(np.eye(3), abs=1e-14)
        force = np.array([3.0, -2.0, 5.0])
        centre = np.array([0.55, 0.45]) @ offsets
        moment = np.cross(offsets - centre, shares @ force).sum(axis=0)
        wanted = np.cross(-centre, force)
        # what turns about the line through the cells (y) is carried inside them
        assert moment == pytest.approx(wanted * [1, 0, 1], abs=1e-14)


def test_falling_runs_remember_the_higher_torque():
    rising = true_run(BENCH, SLICE, FREQUENCY)
    falling = true_run(BENCH, PlannedRun(6, 60.0, False, rising=False), FREQUENCY)
    assert falling.frequency == pytest.approx(FREQUENCY)
    assert falling.powertrain.static_deflection == pytest.approx(
        rising.powertrain.static_deflection, abs=1e-12
    )
    strut = rising.channels.index("TSM x")
    difference = np.abs(falling.stiffness[:, strut]) / np.abs(rising.stiffness[:, strut]) - 1
    assert np.all(difference > 0.002)
