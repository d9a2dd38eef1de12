"""What a search leaves on disk: complete or not at all, never pickled, tied to its inputs."""

import os

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files import run_folder
from deboom.files.run_folder import CheckpointFolder

INPUTS = {"data/platform.toml": "a1", "data/mounts.csv": "b2"}


def test_facts_and_evaluations_come_back_as_they_were(tmp_path):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    assert store.load() is None
    assert store.kept(1) is None
    assert list(tmp_path.iterdir()) == []  # asking makes nothing
    facts = {"seed": 2**70 + 1, "variables": ["Größe x"], "seconds": 0.1}
    store.save({})
    store.save(facts)
    arrays = {"designs": np.array([[0.1, np.nan, -0.0]]), "failed": np.array([True])}
    store.keep(1, arrays)
    again = CheckpointFolder(tmp_path / "search", INPUTS)
    assert again.load() == facts
    assert list(again.kept(1)) == list(arrays)
    for name, array in arrays.items():
        assert again.kept(1)[name].tobytes() == array.tobytes()


def test_nothing_is_pickled(tmp_path):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        store.keep(1, {"x": np.array([None])})
    assert store.kept(1) is None
    store.keep(1, {"x": np.zeros(1)})
    np.savez(tmp_path / "search" / "evaluations" / "000001.npz", x=np.array([{}]))
    with pytest.raises(InputError, match=r"000001\.npz cannot be read"):
        store.kept(1)


@pytest.mark.parametrize("method", [8, 99])
def test_evaluations_of_another_compression_are_refused(tmp_path, method):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    store.keep(1, {"x": np.zeros(1)})
    path = tmp_path / "search" / "evaluations" / "000001.npz"
    data = bytearray(path.read_bytes())
    data[data.index(b"PK\1\2") + 10] = method
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"000001\.npz cannot be read"):
        store.kept(1)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
def test_a_pipe_in_place_of_evaluations_is_refused(tmp_path):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    store.keep(1, {"x": np.zeros(1)})
    os.mkfifo(tmp_path / "search" / "evaluations" / "000002.npz")
    with pytest.raises(InputError, match="is a device or a pipe"):
        store.kept(2)


def test_an_interrupted_write_leaves_the_facts_before(tmp_path, monkeypatch):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    facts = {"variables": ["x"], "seconds": 1.0}
    store.save(facts)

    def full(path, data):
        raise InputError("disk full")

    monkeypatch.setattr(run_folder, "replace_bytes", full)
    with pytest.raises(InputError, match="disk full"):
        store.save({**facts, "seconds": 2.0})
    assert store.load() == facts


def test_facts_without_what_a_search_needs_and_rows_without_designs_are_refused(tmp_path):
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    for facts in ({}, {"variables": "x", "seconds": 1.0}, {"variables": ["x"], "seconds": -1}):
        store.save(facts)
        with pytest.raises(InputError, match=r"search\.json: key .* is damaged, start a new run"):
            store.load()
    (tmp_path / "search" / "search.json").write_text('{"variables": ["\\ud800"], "seconds": 1}')
    with pytest.raises(InputError, match=r"search\.json holds an endless number or half a letter"):
        store.load()
    for arrays in (
        {"failed": np.zeros(2)},
        {"designs": np.zeros(2)},
        {"designs": np.zeros((2, 1)), "failed": np.zeros(3)},
        {"designs": np.zeros((2, 1)), "failed": np.zeros(())},
    ):
        store.keep(1, arrays)
        with pytest.raises(InputError, match=r"000001\.npz has no row for each design"):
            store.kept(1)


def test_no_link_leads_a_search_elsewhere(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    store = CheckpointFolder(tmp_path / "search", INPUTS)
    store.save({})
    (tmp_path / "search" / "evaluations").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="is a link out of"):
        store.keep(1, {"designs": np.zeros((1, 2))})
    with pytest.raises(InputError, match="is a link out of"):
        store.kept(1)
    assert list((tmp_path / "elsewhere").iterdir()) == []


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
    store.save({"variables": ["TSM x", "Du x"]})
    store.keep(1, {"designs": np.zeros((1, 2))})
    for name in ("search.json", "evaluations/000001.npz"):
        path = tmp_path / "search" / name
        data = path.read_bytes()
        path.write_bytes(data[: len(data) // 2] if damage == "cut" else damage)
    with pytest.raises(InputError, match=r"search\.json .*damaged"):
        store.load()
    with pytest.raises(InputError, match=r"000001\.npz cannot be read"):
        store.kept(1)
    (tmp_path / "search" / "inputs.json").write_text("{")
    with pytest.raises(InputError, match=r"inputs\.json is not JSON.*start a new run"):
        CheckpointFolder(tmp_path / "search", INPUTS)
