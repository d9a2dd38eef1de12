"""The library's interface, and the sentences that bad addresses, files and requests end with."""

import sqlite3
import sys

import pytest
from mounts_library_samples import assert_same, campaign, mount, wishbone

from deboom.errors import InputError
from deboom.mounts.library import migrate_library, open_library


@pytest.fixture
def path(tmp_path):
    return tmp_path / "mounts.db"


@pytest.fixture
def library(path):
    with open_library(path, create=True) as opened:
        yield opened


def filled(library):
    library.add(
        [campaign(), campaign("summer")],
        [
            mount(1),
            mount(2, variant="M1", part_number="4711"),
            mount(3, campaign_name="summer", supplier="Rubber Ltd", serial="A7"),
            wishbone(),
        ],
    )
    return library


def test_identities_are_sorted_and_asked_for_by_any_field(library):
    filled(library)
    everything = library.identities()
    assert [(i.campaign, i.mount, i.variant) for i in everything] == [
        ("spring", "Du", "M3"),
        ("spring", "TSM", "M1"),
        ("spring", "TSM", "M3"),
        ("summer", "TSM", "M3"),
    ]
    assert library.identities(mount="TSM", variant="M3") == everything[2:]
    assert library.identities(campaign="summer") == everything[3:]
    assert library.identities(part_number="4711") == everything[1:2]
    assert library.identities(serial="A7") == everything[3:]
    assert library.identities(mount="GeM") == ()


def test_find_gives_the_one_mount_or_names_the_candidates(library):
    with pytest.raises(InputError, match="no such mount; there is none at all"):
        library.find(mount="TSM")
    filled(library)
    assert library.find(mount="Du") == wishbone().identity
    with pytest.raises(InputError, match=r"2 mounts fit, .* TSM M3 of campaign spring; TSM M3 of"):
        library.find(mount="TSM", variant="M3")
    with pytest.raises(
        InputError, match=r"no such mount; there Du M3 of campaign spring; .*, serial A7"
    ):
        library.find(mount="GeM")


def test_what_is_not_there_cannot_be_loaded(library):
    with pytest.raises(InputError, match="TSM M3 of campaign spring is not in the library"):
        library.load(mount().identity)


def test_adding_refuses_strangers_and_twins_before_it_writes(library):
    with pytest.raises(InputError, match="its campaign must be imported with it, once"):
        library.add([campaign("summer")], [mount()])
    with pytest.raises(InputError, match="to be imported twice; give each a serial"):
        library.add([campaign()], [mount(1), mount(2, supplier="other")])
    assert library.campaigns() == ()


def test_mounts_join_a_campaign_that_is_there_already(library):
    library.add([campaign()], [mount()])
    library.add([campaign()], [wishbone()])
    assert len(library.identities()) == 2
    assert library.campaigns() == (campaign(),)


def test_a_missing_library_is_not_made_in_passing(path):
    for act in (open_library, migrate_library):
        with pytest.raises(InputError, match="there is no such library; check the path"):
            act(path)
    assert not path.exists()


@pytest.mark.parametrize(
    ("where", "sentence"),
    [
        ("sqlite://", "names no file"),
        ("sqlite:///:memory:", "a library in memory keeps nothing"),
        (
            "mysql://me@host/mounts",
            "cannot live in mysql: use the path of an SQLite file or a Post",
        ),
        ("http://host/mounts", "cannot live in http"),
        ("://", "a path or a URL such as postgresql://user@host/database"),
        ("postgresql://host:port/x", "a path or a URL such as postgresql://user@host/database"),
        (".", "is a folder; give the file of a library"),
        ("missing/folder/mounts.db", "its folder does not exist; make it first"),
    ],
)
def test_an_address_that_cannot_be_a_library_is_refused(where, sentence):
    with pytest.raises(InputError, match=sentence):
        open_library(where, create=True)


def test_the_driver_that_is_missing_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with pytest.raises(InputError, match=r"needs a driver: pip install 'deboom\[postgres\]'"):
        open_library("postgresql://me@host/mounts")


def test_files_of_something_else_are_left_alone(path):
    path.write_text("mount;stiffness\n")
    with pytest.raises(InputError, match="is not a library: it is no SQLite file"):
        open_library(path, create=True)
    assert path.read_text() == "mount;stiffness\n"

    path.unlink()
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE songs (title TEXT)")
    other.close()
    with pytest.raises(InputError, match="holds no mount library; check the address"):
        open_library(path)
    with pytest.raises(
        InputError, match=r"holds other tables \(songs\): give the library a file of"
    ):
        open_library(path, create=True)


def test_an_empty_file_is_no_library_but_may_become_one(path):
    path.touch()
    with pytest.raises(InputError, match="holds no mount library"):
        open_library(path)
    with open_library(path, create=True) as library:
        assert library.identities() == ()


def test_a_damaged_file_is_refused(path, library):
    library.add([campaign()], [mount()])
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.seek(100)
        file.write(b"\xff" * (size // 2))
    with pytest.raises(InputError, match=r"is damaged \(.*malformed\); restore it from a backup"):
        open_library(path)
    path.write_bytes(b"SQLite format 3\0" + b"x" * 2000)
    with pytest.raises(InputError, match=r"is damaged .* restore it from a backup"):
        open_library(path)


@pytest.mark.parametrize(
    "spoil", [lambda data: data[:-30], lambda data: data[:300] + b"?" + data[301:]]
)
def test_damaged_arrays_are_noticed(path, library, spoil):
    library.add([campaign()], [wishbone()])
    connection = sqlite3.connect(path)
    (data,) = connection.execute("SELECT arrays FROM deboom_map").fetchone()
    connection.execute("UPDATE deboom_map SET arrays = ?", (spoil(data),))
    connection.commit()
    connection.close()
    with pytest.raises(InputError, match=r"damaged arrays \(.*\); restore it from a backup"):
        library.load(wishbone().identity)


def test_arrays_are_kept_as_an_npz_file_that_numpy_reads(path, library, tmp_path):
    import numpy as np

    library.add([campaign()], [wishbone()])
    connection = sqlite3.connect(path)
    (data,) = connection.execute("SELECT arrays FROM deboom_map").fetchone()
    connection.close()
    (tmp_path / "map.npz").write_bytes(data)
    with np.load(tmp_path / "map.npz", allow_pickle=False) as arrays:
        points = wishbone().direction("x").map_points
        assert_same(arrays["dynamic_stiffness"], points.dynamic_stiffness)


def test_a_library_that_another_program_writes_to_is_locked(path, library):
    library.add([campaign()], [mount()])
    writer = sqlite3.connect(path, isolation_level=None)
    writer.execute("BEGIN IMMEDIATE")
    with open_library(path, timeout=0.05) as other:
        assert len(other.identities()) == 1  # until the writer commits, there is something to read
        with pytest.raises(InputError, match=r"is locked: .* for 0.05 s; wait for it or end it"):
            other.add([campaign()], [wishbone()])
    writer.execute("ROLLBACK")
    writer.close()
    library.add([campaign()], [wishbone()])
