"""What the library promises on every database: exact, whole, one writer at a time."""

import multiprocessing
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import mounts_library_samples as samples
import pytest
from mounts_library_samples import assert_same, campaign, mount, wishbone
from sqlalchemy import Float, NullPool, create_engine, text

from deboom.errors import InputError
from deboom.mounts import library_schema
from deboom.mounts.library import migrate_library, open_library

_PROCESSES = multiprocessing.get_context("forkserver" if os.name == "posix" else "spawn")
if os.name == "posix":  # the imports are made once, each process starts from them
    _PROCESSES.set_forkserver_preload(["deboom.mounts.library", "deboom.mounts.response_surface"])


def _postgres(program):
    found = shutil.which(program)
    if found is None:
        installed = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{program}"))
        found = str(installed[-1]) if installed else None
    return found


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


@pytest.fixture(params=["sqlite", "postgresql"])
def where(request, tmp_path):
    if request.param == "postgresql":
        return request.getfixturevalue("new_database")
    return str(tmp_path / "mounts.db")


@pytest.fixture
def library(where):
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


def test_a_mount_comes_back_bit_for_bit(library):
    given = [mount(), wishbone(), mount(2, name="EnM", part_number="7", supplier="Ø & Söhne")]
    library.add([campaign()], given)
    assert len(library.identities()) == 3
    for value in given:
        assert_same(library.load(value.identity), value)
    assert_same(library.campaigns(), (campaign(),))


def test_a_surface_from_the_library_predicts_as_the_one_that_was_fitted(library):
    library.add([campaign()], [mount()])
    stored = library.load(library.find(mount="TSM")).direction("x").surface
    fitted, points = samples.surface(), samples.map_points(3)
    place = (points.preload, points.amplitude, points.frequency)
    assert_same(stored.response_surface().predict(*place), fitted.predict(*place))


def test_every_number_has_its_unit_in_the_database(where, library):
    units = dict(_execute(where, "SELECT quantity, unit FROM deboom_unit"))
    assert units["map.arrays.dynamic_stiffness"] == "N/m"
    for table in library_schema.Base.metadata.sorted_tables:
        short = table.name.removeprefix("deboom_")
        for column in table.columns:
            if isinstance(column.type, Float):
                assert f"{short}.{column.name}" in units
    for part, value in (("map", samples.map_points(1)), ("static_curve", None)):
        names = vars(value) if value else ("deflection", "force")
        assert {f"{part}.arrays.{name}" for name in names} - {"map.arrays.run"} <= units.keys()


def test_another_unit_is_refused(where, library):
    _execute(where, "UPDATE deboom_unit SET unit = 'kN' WHERE quantity = 'map.arrays.preload'")
    with pytest.raises(InputError, match=r"map.arrays.preload in kN, expected N; restore"):
        library.identities()


def test_replacing_exchanges_a_mount_and_leaves_no_orphans(where, library):
    library.add([campaign()], [mount(1), mount(1, serial="2")])
    with pytest.raises(InputError, match="TSM M3 of campaign spring is there already"):
        library.add([campaign()], [mount(5)])
    library.add([campaign()], [mount(5, supplier="other")], replace=True)
    assert_same(library.load(mount(5).identity), mount(5, supplier="other"))
    assert_same(library.load(mount(1, serial="2").identity), mount(1, serial="2"))
    for table, count in (("mount", 2), ("piece", 2), ("direction", 6), ("map", 6), ("surface", 4)):
        assert _execute(where, f"SELECT count(*) FROM deboom_{table}") == [(count,)]


def test_another_campaign_of_the_same_name_is_refused_or_replaces_all_its_mounts(library):
    library.add([campaign(), campaign("summer")], [mount(), mount(campaign_name="summer")])
    other = campaign(inputs_sha256={"campaign.toml": "cd" * 32})
    with pytest.raises(InputError, match="another campaign spring, of other files or tolerances"):
        library.add([other], [wishbone()])
    library.add([other], [wishbone()], replace=True)
    assert [(i.campaign, i.mount) for i in library.identities()] == [
        ("spring", "Du"),
        ("summer", "TSM"),
    ]


def test_an_import_that_fails_halfway_leaves_the_library_as_it_was(library):
    library.add([campaign()], [mount()])
    with pytest.raises(InputError, match="is there already"):
        library.add([campaign(), campaign("summer")], [wishbone(), mount()])
    assert library.identities() == (mount().identity,)
    assert [record.name for record in library.campaigns()] == ["spring"]


def test_a_newer_library_is_refused_by_name(where, library):
    _execute(where, "UPDATE deboom_version SET version = 9, written_by = 'deboom 4.2'")
    sentence = r"library of version 9, .* knows versions up to 1: install deboom 4.2 or a newer one"
    with pytest.raises(InputError, match=sentence):
        open_library(where)
    with pytest.raises(InputError, match=sentence):
        library.add([campaign()], [mount()])
    with pytest.raises(InputError, match=sentence):
        migrate_library(where)


def test_an_older_library_is_migrated_only_by_command_and_all_or_nothing(
    where, library, monkeypatch
):
    library.add([campaign()], [mount()])

    def add_a_table(connection):
        connection.execute(text("CREATE TABLE deboom_rubber (hardness INTEGER)"))

    def fail(connection):
        connection.execute(text("INSERT INTO deboom_rubber VALUES (55)"))
        raise RuntimeError("power cut")

    monkeypatch.setattr(library_schema, "MIGRATIONS", (add_a_table, fail))
    with pytest.raises(
        InputError, match="older version 1: back it up, then run `deboom library mi"
    ):
        open_library(where)
    with pytest.raises(RuntimeError, match="power cut"):
        migrate_library(where)
    assert _execute(where, "SELECT version FROM deboom_version") == [(1,)]

    monkeypatch.setattr(library_schema, "MIGRATIONS", (add_a_table,))
    assert migrate_library(where) == (1, 2)
    assert migrate_library(where) == (2, 2)
    assert _execute(where, "SELECT count(*) FROM deboom_rubber") == [(0,)]
    with open_library(where) as migrated:
        assert_same(migrated.load(mount().identity), mount())


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

    with open_library(where) as library:
        names = {f"{name} {i}" for name in ("left", "right") for i in range(4)}
        assert {record.name for record in library.campaigns()} == names | {"wanted by all"}
        assert len(library.identities()) == 17
        for identity in library.identities():
            seed = int(identity.serial or 1)
            same = mount(seed, campaign_name=identity.campaign, serial=identity.serial)
            assert_same(library.load(identity), same)
    if "://" not in where:
        assert _execute(where, "PRAGMA integrity_check") == [("ok",)]


def test_a_program_killed_amid_an_import_leaves_the_library_as_it_was(where, library, tmp_path):
    library.add([campaign()], [mount(21, serial="21"), wishbone()])
    before = library.identities()
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

    assert library.identities() == before
    assert_same(library.load(before[-1]), mount(21, serial="21"))
    library.add([campaign()], [mount(22, serial="22")])
    assert len(library.identities()) == 3
    if "://" not in where:
        assert _execute(where, "PRAGMA integrity_check") == [("ok",)]


def test_a_reader_of_postgresql_may_not_write(new_database):
    with open_library(new_database, create=True) as library:
        library.add([campaign()], [mount()])
    _execute(new_database, "DROP ROLE IF EXISTS reader")
    _execute(new_database, "CREATE ROLE reader LOGIN")
    _execute(new_database, "GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader")
    with open_library(new_database.replace("deboom@", "reader@")) as library:
        assert_same(library.load(mount().identity), mount())
        with pytest.raises(InputError, match=r"may not be written to \(permission denied for"):
            library.add([campaign("summer")], [mount(campaign_name="summer")])
    _execute(new_database, "DROP OWNED BY reader; DROP ROLE reader")


def test_a_password_is_never_shown():
    pytest.importorskip("psycopg")
    with pytest.raises(InputError, match=r"^postgresql\+psycopg://me:\*\*\*@.*cannot be used") as e:
        open_library("postgresql://me:secret@127.0.0.1:1/mounts")
    assert "secret" not in str(e.value)
