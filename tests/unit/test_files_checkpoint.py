"""What a search leaves on disk: complete or not at all, never pickled, tied to its inputs."""

import json
import zipfile

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files import checkpoint
from deboom.files.checkpoint import CheckpointFolder, read_evaluations

INPUTS = {"data/platform.toml": "a1", "data/mounts.csv": "b2"}


def test_a_state_comes_back_as_it_was(tmp_path):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    assert store.load() is None
    assert store.kept(1) is None
    assert list(tmp_path.iterdir()) == []  # asking makes nothing
    arrays = {"population.X": np.array([[0.1, np.nan, -0.0]]), "failed": np.array([True, False])}
    facts = {"random": {"state": 2**127 + 1}, "variables": ["Größe x"]}
    store.save({"old": np.zeros(1)}, {})
    store.save(arrays, facts)
    back, told = CheckpointFolder(tmp_path / "search", INPUTS).load()
    assert told == facts
    assert list(back) == list(arrays)
    for name, array in arrays.items():
        assert back[name].tobytes() == array.tobytes()


def test_the_same_state_gives_the_same_bytes(tmp_path):
    states = []
    for name in ("one", "two"):
        CheckpointFolder(tmp_path / name, INPUTS).save({"x": np.arange(3.0)}, {"n": 1})
        states.append((tmp_path / name / "state.npz").read_bytes())
    assert states[0] == states[1]


def test_nothing_is_pickled(tmp_path):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        store.save({"x": np.array([None])}, {})
    assert not (tmp_path / "search" / "state.npz").exists()
    np.savez(tmp_path / "search" / "state.npz", x=np.array([{}]))
    with pytest.raises(InputError, match=r"state\.npz cannot be read"):
        store.load()


def test_an_interrupted_write_leaves_the_state_before(tmp_path, monkeypatch):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    store.save({"x": np.zeros(2)}, {"n": 1})

    def full(path, data):
        raise InputError("disk full")

    monkeypatch.setattr(checkpoint, "replace_bytes", full)
    with pytest.raises(InputError, match="disk full"):
        store.save({"x": np.ones(2)}, {"n": 2})
    assert store.load()[1] == {"n": 1}


def test_evaluations_are_read_together(tmp_path):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    with pytest.raises(InputError, match="no evaluations"):
        read_evaluations(tmp_path / "search")
    for number, size in ((1, 3), (2, 2), (10, 1)):
        store.keep(number, {"designs": np.full((size, 4), float(number)), "failed": np.zeros(size)})
    both = read_evaluations(tmp_path / "search")
    np.testing.assert_array_equal(both["generation"], [1, 1, 1, 2, 2, 10])
    np.testing.assert_array_equal(both["designs"][:, 0], both["generation"])
    np.testing.assert_array_equal(store.kept(2)["designs"], np.full((2, 4), 2.0))


@pytest.mark.parametrize(
    ("now", "named"),
    [
        ({**INPUTS, "data/mounts.csv": "c3"}, "data/mounts.csv"),
        ({"data/mounts.csv": "b2"}, "data/platform.toml"),
        ({**INPUTS, "new.uff": "d4"}, "new.uff"),
    ],
)
def test_other_inputs_are_refused_by_name(tmp_path, now, named):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    CheckpointFolder(tmp_path / "search", now)  # nothing has been computed yet
    store.keep(1, {"designs": np.zeros((1, 2))})
    CheckpointFolder(tmp_path / "search", dict(reversed(INPUTS.items())))
    with pytest.raises(InputError, match=f"{named} has changed since the run began"):
        CheckpointFolder(tmp_path / "search", now)


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04", "cut"])
def test_damaged_files_are_named(tmp_path, damage):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    store.save({"x": np.arange(100.0)}, {})
    store.keep(1, {"designs": np.zeros((1, 2))})
    for name in ("state.npz", "evaluations/000001.npz"):
        path = tmp_path / "search" / name
        data = path.read_bytes()
        path.write_bytes(data[: len(data) // 2] if damage == "cut" else damage)
    with pytest.raises(InputError, match=r"state\.npz cannot be read"):
        store.load()
    with pytest.raises(InputError, match=r"000001\.npz cannot be read"):
        store.kept(1)
    (tmp_path / "search" / "inputs.json").write_text("{")
    with pytest.raises(InputError, match=r"inputs\.json is not JSON.*start a new run"):
        CheckpointFolder(tmp_path / "search", INPUTS)


def test_the_facts_are_json_within_the_file(tmp_path):
    CheckpointFolder(tmp_path / "search", INPUTS).save({"x": np.zeros(1)}, {"seed": 3})
    with zipfile.ZipFile(tmp_path / "search" / "state.npz") as archive:
        assert archive.namelist() == ["x.npy", "facts.json.npy"]
    with np.load(tmp_path / "search" / "state.npz", allow_pickle=False) as archive:
        assert json.loads(str(archive["facts.json"])) == {"seed": 3}
