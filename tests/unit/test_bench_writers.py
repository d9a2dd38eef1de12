"""Written platforms and campaigns: complete or not there, repeatable, refused with a sentence."""

import json
import shutil
import tomllib

import numpy as np
import pytest

from deboom.bench.campaign import CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import DRAWING, MIX, load_bench, with_mount_set
from deboom.bench.sensors import WHEEL_END_TOLERANCE
from deboom.errors import InputError
from deboom.files.check import check_platform
from deboom.files.platform import read_platform
from deboom.vehicles.fleet import path_contributions

BENCH = load_bench()
FREQUENCY = np.linspace(20.0, 80.0, 25)
RAMP = PlannedRun(5, 220.0, full_load=True)
SLICE = PlannedRun(6, 60.0, full_load=False)
SMALL = CampaignPlan(("M1",), (RAMP, SLICE), shaker_repeats=1, frequency=FREQUENCY)


def write_small(folder, seed, progress=None):
    return write_campaign(folder, seed, SMALL, progress=progress)


# true mounts under the true engine, and the plan of the channels, are those of every seed
WRITERS = {
    "platform": (write_platform, {"channels.csv", "truth/operating.npz", "truth/powertrain.json"}),
    "campaign": (write_small, {"channels.csv", "truth/M1.npz", "truth/powertrain.json"}),
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Each kind of folder, of seeds 3 and 4."""
    root = tmp_path_factory.mktemp("bench")
    return {
        kind: [write(root / kind / str(seed), seed) for seed in (3, 4)]
        for kind, (write, _) in WRITERS.items()
    }


@pytest.fixture
def written(folders):
    return folders["platform"][0]


@pytest.fixture
def small(folders):
    return folders["campaign"][0]


def files_of(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def bytes_of(folder):
    return {name: (folder / name).read_bytes() for name in files_of(folder)}


@pytest.mark.parametrize("kind", WRITERS)
def test_the_same_seed_gives_the_same_bytes_and_progress_counts_the_files(kind, folders, tmp_path):
    told = []
    again = WRITERS[kind][0](tmp_path / "again", 3, progress=lambda *now: told.append(now))
    assert bytes_of(again) == bytes_of(folders[kind][0])
    assert [done for done, _, _ in told] == list(range(1, len(told) + 1))
    assert {total for _, total, _ in told} == {len(told)}
    assert told[-1][2] == f"{kind}.toml"
    assert kind != "platform" or len(told) == 22


@pytest.mark.parametrize("kind", WRITERS)
def test_another_seed_gives_other_measurements(kind, folders):
    first, other = map(bytes_of, folders[kind])
    assert {name for name in first if first[name] == other[name]} == WRITERS[kind][1]


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("seed", [0, -3])
def test_a_seed_below_one_is_refused(kind, tmp_path, seed):
    with pytest.raises(InputError, match=f"seed {seed} is refused: seeds are whole numbers from 1"):
        WRITERS[kind][0](tmp_path / kind, seed)
    assert list(tmp_path.iterdir()) == []


def test_the_readers_take_it_and_the_truth_is_not_asked_for(written):
    before = read_platform(written)
    assert not any("truth" in path.parts for path in before.input_files)
    assert (len(before.fleet.vehicles), len(before.load_cases)) == (15, 6)
    assert before.load_case("g5_wot220").order == 1.5
    frequency = before.load_case("g5_wot220").force.frequency
    assert frequency == pytest.approx(np.linspace(20, 80, 241))


def test_the_data_sheet_states_the_wheel_end_within_its_tolerance(folders, written):
    stated = []
    for folder in folders["platform"]:
        toml = tomllib.loads((folder / "platform.toml").read_text(encoding="utf-8"))
        assert ["body_mass_kg" in mount for mount in toml["mounts"]] == [False, False, False, True]
        assert toml["mounts"][3]["body_mass_tolerance_kg"] == WHEEL_END_TOLERANCE
        stated.append(toml["mounts"][3]["body_mass_kg"])
    truth = json.loads((written / "truth" / "powertrain.json").read_text(encoding="utf-8"))
    assert max(abs(mass - truth["wheel_end_mass_kg"]) for mass in stated) <= WHEEL_END_TOLERANCE
    assert stated[0] != stated[1]


def test_every_load_case_carries_its_engine_torque(written):
    platform = read_platform(written)
    with np.load(written / "truth" / "operating.npz", allow_pickle=False) as truth:
        for case, torque in zip(platform.load_cases, truth["engine_torque"], strict=True):
            error = case.engine_torque - torque
            # 1 N m of noise over 241 lines: mean and spread within four standard errors
            assert abs(error.mean()) < 0.26
            assert 0.81 < error.std() < 1.19


@pytest.mark.parametrize(
    ("taken", "target", "words"),
    [
        ("platform/notes.txt", "platform", "is not empty: name a new or an empty folder"),
        ("platform", "platform", "is a file"),
        ("platform", "platform/below", "cannot be written"),
        ("platform.unfinished/x", "platform", r"platform\.unfinished is left from a run .* delete"),
    ],
)
def test_a_place_in_use_is_refused_and_left_alone(tmp_path, taken, target, words):
    (tmp_path / taken).parent.mkdir(exist_ok=True)
    (tmp_path / taken).write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        write_small(tmp_path / target, seed=1)
    assert files_of(tmp_path) == [taken]


@pytest.mark.parametrize(
    ("failure", "seen"),
    [(KeyboardInterrupt(), KeyboardInterrupt), (OSError(28, "No space left"), InputError)],
)
def test_a_run_that_fails_half_way_leaves_nothing(tmp_path, failure, seen):
    def stop(done, total, text):
        if done == 3:
            raise failure

    with pytest.raises(seen):
        write_small(tmp_path / "campaign", 1, progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_a_run_does_not_depend_on_the_plan(small, tmp_path):
    runs = (PlannedRun(7, 120.0, full_load=True), RAMP)
    plan = CampaignPlan(("M2", "M1"), runs, shaker_repeats=2, frequency=FREQUENCY)
    other = write_campaign(tmp_path / "other", 3, plan)
    for name in ("runs/M1/g5_wot220.uff", "shaker/TSM_y_1.uff", "static_curves/M1/EnM_z.csv"):
        assert (other / name).read_bytes() == (small / name).read_bytes(), name


def test_units_scatter_and_stay_the_same_part():
    first = with_mount_set(BENCH, "M1")
    mix = with_mount_set(BENCH, MIX)
    fourth = with_mount_set(BENCH, "M4")
    assert with_mount_set(BENCH, DRAWING).powertrain.laws == BENCH.powertrain.laws
    assert mix.powertrain.laws[:3] == first.powertrain.laws[:3]
    assert mix.powertrain.laws[3:] != first.powertrain.laws[3:]
    assert mix.wheel_end.laws == fourth.wheel_end.laws
    units = [with_mount_set(BENCH, f"M{k}") for k in range(1, 200)]
    drawn_stiffness = np.array([law.stiffness for law in BENCH.powertrain.laws])
    stiffness = [[law.stiffness for law in unit.powertrain.laws] for unit in units]
    ratios = np.array(stiffness) / drawn_stiffness
    assert np.std(ratios) == pytest.approx(0.05, rel=0.1)
    assert np.abs(ratios - 1).max() <= 0.15 + 1e-12


@pytest.mark.parametrize("name", ["A1", "M", "EnM1-GeM2", "EnM1-GeM2-TSM3-TSM4", "EnM1-x"])
def test_unknown_mount_sets_are_refused(name):
    example = "name it M1, M2, … or a mix like EnM1-GeM2-TSM3-Du4"
    with pytest.raises(InputError, match=f"unknown mount set '{name}': {example}"):
        with_mount_set(BENCH, name)


@pytest.mark.parametrize(("gear", "ordinal"), [(1, "1st"), (2, "2nd"), (3, "3rd"), (4, "4th")])
def test_a_run_is_titled_by_its_gear(gear, ordinal):
    run = PlannedRun(gear=gear, torque=220.0)
    assert run.title == f"{ordinal} gear, full load, 220 Nm"


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


def test_both_wishbone_mounts_may_have_functions_of_their_own(written, tmp_path):
    platform = read_platform(write_platform(tmp_path / "apart", 3, per_piece=True))
    inputs = platform.fleet.vehicles[0].noise_transfer.inputs
    assert inputs[-2:] == ("Du left x", "Du right x")
    together = read_platform(written)
    heard = [
        path_contributions(each.fleet, each.mounts, each.load_cases[0]).values[:, :, 9]
        for each in (platform, together)
    ]
    difference = np.linalg.norm(heard[1] - heard[0]) / np.linalg.norm(heard[0])
    assert 0.01 < difference < 0.1


def test_an_electric_drive_states_rotor_orders_and_lines_of_its_model(
    written, tmp_path, monkeypatch
):
    folder = shutil.copytree(written, tmp_path / "electric")
    path = folder / "platform.toml"
    lines = path.read_text(encoding="utf-8").replace("dominant_order = 1.5", "dominant_order = 6.0")
    kept = [line for line in lines.splitlines() if not line.startswith("cylinders")]
    of_order = 'name = "g5_wot220"'
    kept[kept.index(of_order)] += "\norder = 1.5"
    path.write_text("\n".join(kept), encoding="utf-8")
    for file in (folder / "operating").glob("*.uff"):
        if file.stem != "g5_wot220":
            file.write_bytes(file.read_bytes().replace(b"order 1.5,", b"order 6.0,"))
    orders = {case.name: case.order for case in read_platform(folder).load_cases}
    assert orders.pop("g5_wot220") == 1.5
    assert set(orders.values()) == {6.0}
    assert "electric drive, because [engine] states no cylinders" in (
        check_platform(folder).summary
    )
    monkeypatch.setattr("deboom.files.platform.HIGHEST", 60.0)
    with pytest.raises(InputError, match="lines of 20 to 80 Hz of a rotor order"):
        read_platform(folder)


def test_receivers_are_written_beside_files_that_stay(tmp_path):
    one = {"groups": ("U06-1",), "load_cases": (PlannedRun(5, 220.0, full_load=True),)}
    plain = write_platform(tmp_path / "plain", 3, **one)
    folder = write_platform(tmp_path / "with", 3, receivers=True, **one)
    further = {"receivers/U06-1.uff", "operating/idle.uff"}
    assert set(files_of(folder)) - set(files_of(plain)) == further
    for name in set(files_of(plain)) - {"platform.toml", "README.txt"}:
        assert (folder / name).read_bytes() == (plain / name).read_bytes(), name
    platform = read_platform(folder)
    model = platform.model(motion="coupled", mounts="spectra")
    names = ("U06-1", "U06-1, rear ear", "U06-1, seat rail z", "U06-1, wheel y")
    assert model.response_names == names
    alone = read_platform(plain).model(motion="coupled", mounts="spectra")
    today = np.ones((1, 12))
    levels = model.levels(today)[0]
    np.testing.assert_allclose(levels[0], alone.levels(today)[0, 0], rtol=1e-12)
    assert abs(levels[1].mean() - levels[0].mean()) < 10.0
    # modes of its own: seat and wheel vibrate most below 36 Hz, some mm/s² to 1 m/s²
    for row in (2, 3):
        assert 20.0 <= model.frequency[levels[row].argmax()] <= 36.0
        assert 60.0 < levels[row].max() < 120.0
    # idle: the firing order leads, at 30 to 60 dB(A) and 3 mm/s² to 1 m/s²
    (idle,) = model.idle
    at_idle = idle.levels(today)[0]
    assert set(idle.orders[at_idle.argmax(axis=1)]) == {platform.load_cases[0].order}
    assert 30.0 < idle(today)[0, 0] < 60.0
    assert np.all((idle(today)[0, 2:] > 70.0) & (idle(today)[0, 2:] < 120.0))
