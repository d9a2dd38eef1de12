"""Characterised mounts and the mount library."""

import contextlib
import multiprocessing
import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import mounts_library_samples as samples
import numpy as np
import pytest
from mounts_library_samples import assert_same, campaign, mount, wishbone
from sqlalchemy import NullPool, create_engine, text

from deboom.errors import InputError
from deboom.mounts.characterised_mount import DirectionQuality, MountIdentity
from deboom.mounts.library import open_library

LABEL = {"campaign": "spring", "mount": "TSM", "variant": "M3"}
VALUE = mount()
X = VALUE.direction("x")


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: MountIdentity("", "TSM", "M3"), "campaign .* cannot be kept: use 1 to 255 print"),
        (lambda: MountIdentity("spring", "TSM", ""), "variant .* cannot be kept: use 1 to 255"),
        (lambda: MountIdentity(**LABEL, serial="a\0b"), "serial .* cannot be kept: use 0 to 255"),
        (lambda: MountIdentity(**LABEL, supplier="x" * 256), "supplier .* cannot be kept: use 0"),
        (lambda: replace(X.map_points, amplitude=np.ones(9)), "amplitude: shape .* not .9,"),
        (lambda: replace(X.map_points, run=["a"]), "1 runs for 150 points"),
        (lambda: replace(X.map_points, preload=np.full(150, np.nan)), "preload: a number is not"),
        (lambda: replace(X.map_points, confidence=np.full(150, 1.1)), "lies between 0 and 1"),
        (lambda: replace(X, axis="rx"), "unknown axis 'rx', use x, y, z"),
        (lambda: replace(X, surface=None), "direction x is identified, but it has no surface"),
        (lambda: DirectionQuality(False, r2_real=float("nan")), "r2_real is nan; leave out what"),
        (lambda: replace(VALUE.mount, body_mass=-3.0), "a body of -3.0"),
        (lambda: replace(VALUE, directions=(X, X)), r"every axis once, it has \['x', 'x'\]"),
        (lambda: replace(VALUE, directions=(X,)).direction("y"), "no direction 'y', use x"),
        (
            lambda: replace(VALUE, mount=replace(VALUE.mount, description="two\nlines")),
            "text .* cannot be kept",
        ),
        (lambda: campaign(tolerances={"position": 0.002}), "'position' lacks its unit; write it"),
        (lambda: replace(VALUE, quality={"position": 0.002}), "'position' lacks its unit; write"),
        (lambda: campaign(tolerances={"position [m]": np.inf}), r"position \[m\] is inf"),
        (lambda: replace(VALUE, quality={"position [m]": np.inf}), r"position \[m\] is inf"),
    ],
)
def test_what_cannot_be_kept_is_refused(build, words):
    with pytest.raises(InputError, match=words):
        build()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "mounts.db"


@pytest.fixture
def library(path):
    with open_library(path, create=True) as opened:
        yield opened


def test_identities_are_sorted_asked_for_by_any_field_and_found_alone(library):
    with pytest.raises(InputError, match="no such mount; there is none at all"):
        library.only(library.identities(mount="TSM"))
    library.add(
        [campaign(), campaign("summer")],
        [
            mount(1),
            mount(2, variant="M1", part_number="4711"),
            mount(3, campaign_name="summer", supplier="Rubber Ltd", serial="A7"),
            wishbone(),
        ],
    )
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
    assert library.only(library.identities(mount="Du")) == wishbone().identity
    with pytest.raises(InputError, match=r"2 mounts fit, .* TSM M3 of campaign spring; TSM M3 of"):
        library.only(library.identities(mount="TSM", variant="M3"))
    with pytest.raises(InputError, match=r"no such mount; there Du M3 of .*, serial A7"):
        library.only(library.identities(mount="GeM"))


def test_what_is_not_there_cannot_be_loaded(library):
    with pytest.raises(InputError, match="TSM M3 of campaign spring is not in the library"):
        library.load(mount().identity)


def test_adding_refuses_strangers_and_twins_before_it_writes(library):
    with pytest.raises(InputError, match="its campaign must be imported with it, once"):
        library.add([campaign("summer")], [mount()])
    with pytest.raises(InputError, match="to be imported twice; give each a serial"):
        library.add([campaign()], [mount(1), mount(2, supplier="other")])
    assert library.campaigns() == ()


def test_a_missing_library_is_not_made_in_passing(path):
    with pytest.raises(InputError, match="there is no such library; check the path"):
        open_library(path)
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
        (".", "is a folder, a device or a pipe; give the file of a library"),
        ("/dev/zero", "is a folder, a device or a pipe; give the file of a library"),
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


@pytest.mark.parametrize("table", ["campaign", "mount"])
def test_a_document_carries_its_units_and_its_damage_is_noticed(path, library, table):
    library.add([campaign()], [wishbone()])
    with contextlib.closing(sqlite3.connect(path)) as connection, connection:
        (document,) = connection.execute(f"SELECT document FROM deboom_{table}").fetchone()
        spoilt = document.replace("0", "1", 1)
        connection.execute(f"UPDATE deboom_{table} SET document = ?", (spoilt,))
    units = {"mount": '"dynamic_stiffness [N/m]": {', "campaign": '"engine_order [1]": 1.5'}
    assert units[table] in document
    with pytest.raises(InputError, match=r"a damaged document; restore it from a backup"):
        library.campaigns() if table == "campaign" else library.load(wishbone().identity)


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


_PROCESSES = multiprocessing.get_context("forkserver" if os.name == "posix" else "spawn")


def _postgres(program):
    path = shutil.which(program)
    if path is None:
        installed = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{program}"))
        path = str(installed[-1]) if installed else None
    return path


@pytest.fixture(scope="module")
def postgres_server():
    """Run a PostgreSQL server of our own on a socket in a temporary folder; its address."""
    pytest.importorskip(
        "psycopg", reason="the driver is not installed: pip install deboom[postgres]"
    )
    initdb, pg_ctl = _postgres("initdb"), _postgres("pg_ctl")
    if initdb is None or pg_ctl is None or os.name != "posix":
        pytest.skip("there are no PostgreSQL server programs (initdb, pg_ctl) on this machine")
    folder = Path(tempfile.mkdtemp(prefix="deboom-pg-"))
    run_as = {}
    if os.geteuid() == 0:  # PostgreSQL refuses to run as root
        shutil.chown(folder, "nobody")
        run_as = {"user": "nobody", "cwd": folder}

    def call(*command):
        done = subprocess.run(
            [str(part) for part in command], capture_output=True, text=True, timeout=60, **run_as
        )
        assert done.returncode == 0, done.stderr

    data = folder / "data"
    try:
        call(initdb, "-D", data, "-U", "deboom", "-A", "trust", "-E", "UTF8", "--no-sync")
        options = f"-c listen_addresses='' -c unix_socket_directories={folder} -c fsync=off"
        call(pg_ctl, "-D", data, "-o", options, "-l", folder / "log", "-w", "start")
        try:
            yield f"postgresql+psycopg://deboom@/{{}}?host={folder}"
        finally:
            call(pg_ctl, "-D", data, "-m", "immediate", "-w", "stop")
    finally:
        shutil.rmtree(folder)


@pytest.fixture
def new_database(postgres_server):
    """Make a database; its URL, as a user would write it."""
    name = f"test_{time.monotonic_ns()}"
    _execute(postgres_server.format("postgres"), f"CREATE DATABASE {name}", autocommit=True)
    return postgres_server.format(name).replace("+psycopg", "")


SERVER = pytest.param("postgresql", marks=pytest.mark.slow("starts a PostgreSQL server"))


@pytest.fixture(params=["sqlite", SERVER])
def where(request, tmp_path):
    if request.param == "postgresql":
        return request.getfixturevalue("new_database")
    return str(tmp_path / "mounts.db")


@pytest.fixture
def database(where):
    with open_library(where, create=True) as opened:
        yield opened


def _execute(where, statement, autocommit=False):
    url = where if "://" in where else f"sqlite:///{where}"
    engine = create_engine(
        url.replace("postgresql://", "postgresql+psycopg://"),
        poolclass=NullPool,
        isolation_level="AUTOCOMMIT" if autocommit else None,
    )
    with engine.begin() as connection:
        result = connection.execute(text(statement))
        return result.fetchall() if result.returns_rows else None


def _start(target, *arguments):
    child = _PROCESSES.Process(target=target, args=arguments, daemon=True)
    child.start()
    return child


def _wait_for(path, child):
    for _ in range(6000):
        if path.exists():
            return
        assert child.is_alive()
        time.sleep(0.01)
    raise AssertionError(f"{path} did not appear")


def test_a_mount_comes_back_bit_for_bit(database):
    given = [mount(), wishbone(), mount(2, name="EnM", part_number="7", supplier="Ø & Söhne")]
    database.add([campaign()], given)
    assert len(database.identities()) == 3
    for value in given:
        assert_same(database.load(value.identity), value)
    assert_same(database.campaigns(), (campaign(),))


def test_replacing_exchanges_a_mount_and_leaves_the_others(where, database):
    database.add([campaign()], [mount(1), mount(1, serial="2")])
    with pytest.raises(InputError, match="TSM M3 of campaign spring is there already"):
        database.add([campaign()], [mount(5)])
    database.add([campaign()], [mount(5, supplier="other")], replace=True)
    assert_same(database.load(mount(5).identity), mount(5, supplier="other"))
    assert_same(database.load(mount(1, serial="2").identity), mount(1, serial="2"))
    assert _execute(where, "SELECT count(*) FROM deboom_mount") == [(2,)]


def test_another_campaign_of_the_same_name_is_refused_or_replaces_all_its_mounts(database):
    database.add([campaign(), campaign("summer")], [mount(), mount(campaign_name="summer")])
    other = campaign(inputs_sha256={"campaign.toml": "cd" * 32})
    with pytest.raises(InputError, match="another campaign spring, of other files or tolerances"):
        database.add([other], [wishbone()])
    database.add([other], [wishbone()], replace=True)
    assert [(i.campaign, i.mount) for i in database.identities()] == [
        ("spring", "Du"),
        ("summer", "TSM"),
    ]


def test_an_import_that_fails_halfway_leaves_the_library_as_it_was(database):
    database.add([campaign()], [mount()])
    with pytest.raises(InputError, match="is there already"):
        database.add([campaign(), campaign("summer")], [wishbone(), mount()])
    assert database.identities() == (mount().identity,)
    assert [record.name for record in database.campaigns()] == ["spring"]


@pytest.mark.parametrize(
    ("version", "remedy"),
    [(9, "install deboom 4.2 or a newer one"), (1, "export its mounts to JSON with deboom 4.2")],
)
def test_a_library_of_another_version_is_refused_by_name(where, database, version, remedy):
    _execute(where, f"UPDATE deboom_version SET version = {version}, written_by = 'deboom 4.2'")
    sentence = rf"library of version {version}, .* knows version 2: {remedy}"
    with pytest.raises(InputError, match=sentence):
        open_library(where)
    with pytest.raises(InputError, match=sentence):
        database.add([campaign()], [mount()])


@pytest.mark.slow("begins two processes")
def test_two_programs_that_make_and_write_one_library_at_once_lose_nothing(where, tmp_path):
    children = {
        name: _start(samples.write_many, where, name, tmp_path) for name in ("left", "right")
    }
    for name, child in children.items():
        _wait_for(tmp_path / f"{name} ready", child)
    (tmp_path / "go").touch()
    for child in children.values():
        child.join(60)
    said = [(tmp_path / f"{name} said").read_text() for name in children]
    assert said.count("first") == 1
    assert sum("TSM M3 of campaign wanted by all is there already" in words for words in said) == 1

    with open_library(where) as database:
        names = {f"{name} {i}" for name in ("left", "right") for i in range(4)}
        assert {record.name for record in database.campaigns()} == names | {"wanted by all"}
        assert len(database.identities()) == 17
        for identity in database.identities():
            seed = int(identity.serial or 1)
            same = mount(seed, campaign_name=identity.campaign, serial=identity.serial)
            assert_same(database.load(identity), same)
    if "://" not in where:
        assert _execute(where, "PRAGMA integrity_check") == [("ok",)]


def test_a_program_killed_amid_an_import_leaves_the_library_as_it_was(where, database, tmp_path):
    database.add([campaign()], [mount(21, serial="21"), wishbone()])
    before = database.identities()
    marker = tmp_path / "stalled"
    child = _start(samples.stall, where, marker)
    _wait_for(marker, child)
    try:
        with (
            pytest.raises(InputError, match=r"is locked: another program .* for 0.2 s; wait"),
            open_library(where, timeout=0.2) as other,
        ):
            other.add([campaign()], [mount(1)])
        if "://" not in where:  # half of the import has reached the disk, with a journal beside it
            assert Path(where).stat().st_size > 2_000_000
            assert Path(f"{where}-journal").stat().st_size > 0
    finally:
        child.kill()
        child.join()

    assert database.identities() == before
    assert_same(database.load(before[-1]), mount(21, serial="21"))
    database.add([campaign()], [mount(22, serial="22")])
    assert len(database.identities()) == 3
    if "://" not in where:
        assert _execute(where, "PRAGMA integrity_check") == [("ok",)]


def test_a_reader_of_postgresql_may_not_write(new_database):
    with open_library(new_database, create=True) as database:
        database.add([campaign()], [mount()])
    _execute(new_database, "DROP ROLE IF EXISTS reader")
    _execute(new_database, "CREATE ROLE reader LOGIN")
    _execute(new_database, "GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader")
    with open_library(new_database.replace("deboom@", "reader@")) as database:
        assert_same(database.load(mount().identity), mount())
        with pytest.raises(InputError, match=r"may not be written to \(permission denied for"):
            database.add([campaign("summer")], [mount(campaign_name="summer")])
    _execute(new_database, "DROP OWNED BY reader; DROP ROLE reader")


@pytest.mark.parametrize("encoding", ["LATIN1", "SQL_ASCII"])
def test_a_database_in_another_encoding_is_read_and_written_or_refused(postgres_server, encoding):
    name = f"test_{encoding.lower()}"
    made = f"CREATE DATABASE {name} TEMPLATE template0 ENCODING '{encoding}' LOCALE 'C'"
    _execute(postgres_server.format("postgres"), made, autocommit=True)
    with open_library(postgres_server.format(name), create=True) as database:
        kept = [mount(serial="Größe 1"), mount(serial="Größe 2")]
        database.add([campaign()], kept)
        assert_same(database.load(kept[1].identity), kept[1])
        greek = mount(serial="λ")
        if encoding == "LATIN1":
            with pytest.raises(InputError, match=r"cannot keep this name .*use a database in UTF8"):
                database.add([campaign("summer")], [mount(serial="λ", campaign_name="summer")])
            assert [campaign_row.name for campaign_row in database.campaigns()] == ["spring"]
        else:
            database.add([campaign()], [greek])
            assert_same(database.load(greek.identity), greek)


def test_a_password_is_never_shown():
    pytest.importorskip("psycopg")
    with pytest.raises(InputError, match=r"^postgresql\+psycopg://me:\*\*\*@.*cannot be used") as e:
        open_library("postgresql://me:secret@127.0.0.1:1/mounts")
    assert "secret" not in str(e.value)
