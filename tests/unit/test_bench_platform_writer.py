"""The written platform: complete or not there, repeatable, and refused with a sentence."""

import json
import tomllib

import numpy as np
import pytest

from deboom.bench.data_sheet import WHEEL_END_TOLERANCE
from deboom.bench.platform_writer import write_platform
from deboom.errors import InputError
from deboom.files.platform import read_platform


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_platform(tmp_path_factory.mktemp("bench") / "platform", seed=3)


def files_of(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def test_the_same_seed_gives_the_same_bytes(written, tmp_path):
    again = write_platform(tmp_path / "again", seed=3)
    assert files_of(again) == files_of(written)
    for name in files_of(written):
        assert (again / name).read_bytes() == (written / name).read_bytes(), name


def test_another_seed_gives_other_measurements(written, tmp_path):
    other = write_platform(tmp_path / "other", seed=4)
    for name in files_of(written):
        differs = (other / name).read_bytes() != (written / name).read_bytes()
        # the plan of the channels and the true mounts under the true engine are one platform's
        assert differs == (name not in ("channels.csv", "truth/operating.npz")), name


def test_small_plain_text_and_explained(written):
    names = files_of(written)
    assert sum((written / name).stat().st_size for name in names) <= 20e6
    readme = (written / "README.txt").read_text(encoding="utf-8")
    for name in names:
        if name.startswith("truth/"):
            assert "truth/" in readme
            continue
        (written / name).read_bytes().decode("ascii")
        assert name in readme or name == "README.txt"


def test_the_readers_take_it_and_the_truth_is_not_asked_for(written):
    before = read_platform(written)
    assert not any("truth" in path.parts for path in before.input_files)
    assert len(before.fleet.vehicles) == 15
    assert [case.name for case in before.load_cases] == [
        "g5_wot120",
        "g5_wot220",
        "g6_wot120",
        "g6_wot160",
        "g6_wot220",
        "g7_wot220",
    ]
    assert before.load_case("g5_wot220").order == 1.5
    frequency = before.load_case("g5_wot220").force.frequency
    assert frequency == pytest.approx(np.linspace(20, 80, 241))


def test_the_tables_name_every_axis_that_transmits(written):
    platform = tomllib.loads((written / "platform.toml").read_text(encoding="utf-8"))
    axes = {mount["name"]: mount["transfer_axes"] for mount in platform["mounts"]}
    assert axes == {"EnM": [*"xyz"], "GeM": [*"xyz"], "TSM": [*"xyz"], "Du": ["x"]}
    assert platform["mounts"][3]["pieces"] == ["left", "right"]


def test_the_data_sheet_states_the_wheel_end_within_its_tolerance(written, tmp_path):
    other = write_platform(tmp_path / "other", seed=4)
    stated = []
    for folder in (written, other):
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


def test_the_truth_needs_no_pickle(written):
    with np.load(written / "truth" / "operating.npz", allow_pickle=False) as truth:
        assert truth["stiffness"].shape == (6, 241, 11)
        assert truth["channels"][-1] == "Du right x"


@pytest.mark.parametrize("seed", [0, -3])
def test_a_seed_below_one_is_refused(tmp_path, seed):
    with pytest.raises(InputError, match=f"seed {seed} is refused: seeds are whole numbers from 1"):
        write_platform(tmp_path / "platform", seed=seed)
    assert list(tmp_path.iterdir()) == []


def test_an_empty_folder_is_filled(tmp_path):
    folder = tmp_path / "deep" / "platform"
    folder.mkdir(parents=True)
    assert write_platform(folder, seed=1) == folder
    assert (folder / "platform.toml").is_file()
    assert list(folder.parent.iterdir()) == [folder]


def test_a_folder_with_something_in_it_is_refused_and_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="is not empty: name a new or an empty folder"):
        write_platform(tmp_path, seed=1)
    assert files_of(tmp_path) == ["notes.txt"]


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    file = tmp_path / "platform"
    file.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="is a file"):
        write_platform(file, seed=1)
    with pytest.raises(InputError, match="cannot be written"):
        write_platform(file / "below", seed=1)
    assert file.read_text(encoding="utf-8") == "mine"


def test_the_remains_of_a_killed_run_are_named(tmp_path):
    (tmp_path / "platform.unfinished").mkdir()
    with pytest.raises(InputError, match=r"platform\.unfinished is left from a run .* delete it"):
        write_platform(tmp_path / "platform", seed=1)


@pytest.mark.parametrize(
    ("failure", "seen"),
    [(KeyboardInterrupt(), KeyboardInterrupt), (OSError(28, "No space left"), InputError)],
)
def test_a_run_that_fails_half_way_leaves_nothing(tmp_path, failure, seen):
    def stop(done, total, text):
        if done == 10:
            raise failure

    with pytest.raises(seen):
        write_platform(tmp_path / "platform", seed=1, progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_progress_counts_the_files(tmp_path):
    told = []
    write_platform(tmp_path / "platform", seed=1, progress=lambda *state: told.append(state))
    assert [done for done, _, _ in told] == list(range(1, 23))
    assert {total for _, total, _ in told} == {22}
    assert told[-1][2] == "platform.toml"
