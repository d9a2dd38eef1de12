"""The mount library: characterised mounts in an SQLite or PostgreSQL database.

An SQLite file by default, PostgreSQL by its URL. Every import is one transaction: after a crash the
library is as it was before. Writers come one after the other, and each sees all of its
predecessor's work: SQLite locks the file from the start of a writing transaction
(``BEGIN IMMEDIATE``), PostgreSQL takes an advisory lock that ends with the transaction. Tables are
made inside of such a transaction, too. A reader sees one state from its first query to its last.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Self

import sqlalchemy as sa
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, OperationalError

import deboom
from deboom.errors import InputError
from deboom.mounts.characterised_mount import (
    LONGEST_TEXT,
    CampaignRecord,
    CharacterisedMount,
    MountIdentity,
)
from deboom.mounts.library_tables import campaign_entry, campaign_of, mount_entry, mount_of

VERSION = 2
"""Version of the tables that are read and written."""

TIMEOUT = 10.0
"""How long a transaction waits for other programs, unless said otherwise [s]."""

_ADVISORY_LOCK = 0x6465626F6F6D  # "deboom", one number for all libraries of a database
_SQLITE_SIGNATURE = b"SQLite format 3\0"
_LOCK_NOT_AVAILABLE, _NO_PRIVILEGE, _READ_ONLY = "55P03", "42501", "25006"
_NO_SUCH_LETTER = "22P05"
LARGEST_LIBRARY = 2**30
"""Size of an SQLite file that is opened [bytes]."""
LARGEST_ENTRY = 2**25
"""Size of one row, such as a mount with all of its points [bytes]."""
MOST_STEPS = 10**9
"""Steps of SQLite's virtual machine that one call may take: about half a minute."""
_STEPS_PER_LOOK = 10**6
_KEY = ("campaign", "mount", "variant", "part_number", "serial")  # tells mounts apart


def _text(name: str, *constraint: sa.ForeignKey, key: bool = False) -> sa.Column[str]:
    return sa.Column(name, sa.String(LONGEST_TEXT), *constraint, primary_key=key, nullable=False)


def _document() -> tuple[sa.Column[str], sa.Column[str]]:
    """Everything that is kept of a campaign or mount, as JSON with units, and its hash."""
    return sa.Column("document", sa.Text, nullable=False), _text("sha256")


_TABLES = sa.MetaData()
_VERSION = sa.Table(
    "deboom_version",
    _TABLES,
    sa.Column("version", sa.Integer, primary_key=True, autoincrement=False),
    _text("written_by"),
)
_CAMPAIGN = sa.Table("deboom_campaign", _TABLES, _text("name", key=True), *_document())
_MOUNT = sa.Table(
    "deboom_mount",
    _TABLES,
    _text("campaign", sa.ForeignKey(_CAMPAIGN.c.name, ondelete="CASCADE"), key=True),
    *(_text(name, key=True) for name in _KEY[1:]),
    _text("supplier"),
    *_document(),
)


class MountLibrary:
    """Characterised mounts and their campaigns; made by `open_library`, a context manager.

    A connection lasts for one call only: nothing is locked, and no server is kept waiting, between
    two calls. The context manager gives back what the engine still holds.
    """

    def __init__(self, name: str, engine: sa.Engine, timeout: float) -> None:
        self.name = name
        self._engine = engine
        self._timeout = timeout

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back all connections."""
        self._engine.dispose()

    def campaigns(self) -> tuple[CampaignRecord, ...]:
        """Return all campaigns by name."""
        with self._reading() as connection:
            rows = connection.execute(sa.select(_CAMPAIGN).order_by(_CAMPAIGN.c.name))
            return tuple(campaign_of(self._entry(row)) for row in rows)

    def identities(
        self,
        campaign: str | None = None,
        mount: str | None = None,
        variant: str | None = None,
        part_number: str | None = None,
        serial: str | None = None,
    ) -> tuple[MountIdentity, ...]:
        """Return which mounts are kept, sorted; what is left out is not asked for."""
        query = sa.select(*(_MOUNT.c[name] for name in MountIdentity.__dataclass_fields__))
        for name, value in zip(_KEY, (campaign, mount, variant, part_number, serial), strict=True):
            if value is not None:
                query = query.where(_MOUNT.c[name] == value)
        try:
            with self._reading() as connection:
                # one by one: each is checked before the next is fetched
                return tuple(sorted(MountIdentity(*row) for row in connection.execute(query)))
        except InputError as error:
            if str(error).startswith(self.name):
                raise
            raise InputError(f"{self.name}: {error}; restore it from a backup") from None

    def only(self, matching: Sequence[MountIdentity]) -> MountIdentity:
        """Return the one mount that `identities` told.

        - raises InputError: no mount, or more than one: the candidates are named.
        """
        if len(matching) == 1:
            return matching[0]
        if matching:
            raise InputError(
                f"{self.name}: {len(matching)} mounts fit, say which one by its campaign, variant, "
                f"part number or serial: {_listed(matching)}"
            )
        identities = _listed(self.identities()) or "is none at all"
        raise InputError(f"{self.name}: no such mount; there {identities}")

    def load(self, identity: MountIdentity) -> CharacterisedMount:
        """Return a mount exactly as it was added.

        - raises InputError: it is not in the library, or its document is damaged.
        """
        with self._reading() as connection:
            row = _only_row(connection, sa.select(_MOUNT).where(_same(identity)))
        if row is None:
            raise InputError(f"{self.name}: {identity} is not in the library")
        return mount_of(self._entry(row))

    def add(
        self,
        campaigns: Sequence[CampaignRecord],
        mounts: Sequence[CharacterisedMount],
        *,
        replace: bool = False,
    ) -> None:
        """Import mounts and their campaigns: all of them, or after any failure none.

        A campaign that is kept already, from the same files, stays. `replace` exchanges mounts that
        are kept already, and a campaign of other content with all its mounts.

        - raises InputError: a mount of another campaign or twice; without `replace`, a mount or
          another campaign of this name that is kept already; a library that is locked or may not be
          written to.
        """
        _check_complete(campaigns, mounts)
        with self._writing() as connection:
            self._check_version(connection)
            for campaign in campaigns:
                self._add_campaign(connection, campaign, replace)
            for value in mounts:
                kept = _same(value.identity)
                if (
                    not replace
                    and connection.execute(sa.select(_MOUNT.c.mount).where(kept)).first()
                ):
                    raise InputError(
                        f"{self.name}: {value.identity} is there already; replace it, or give the "
                        "new one another serial"
                    )
                connection.execute(sa.delete(_MOUNT).where(kept))
                columns = asdict(value.identity) | _columns(mount_entry(value))
                connection.execute(sa.insert(_MOUNT).values(columns))

    def _add_campaign(
        self, connection: sa.Connection, campaign: CampaignRecord, replace: bool
    ) -> None:
        """Add a campaign, unless the same one is kept already."""
        named = _CAMPAIGN.c.name == campaign.name
        row = _only_row(connection, sa.select(_CAMPAIGN).where(named))
        if row is not None:
            if campaign_of(self._entry(row)) == campaign:
                return
            if not replace:
                raise InputError(
                    f"{self.name}: there is another campaign {campaign.name}, of other files or "
                    "tolerances; replace it with all its mounts, or rename the new one"
                )
            connection.execute(sa.delete(_CAMPAIGN).where(named))
        columns = _columns(campaign_entry(campaign))
        connection.execute(sa.insert(_CAMPAIGN).values(name=campaign.name, **columns))

    def _entry(self, row: sa.Row[Any]) -> Any:
        """Document of a row; its hash guards it."""
        whole = isinstance(row.document, str)
        if not whole or hashlib.sha256(row.document.encode()).hexdigest() != row.sha256:
            raise InputError(f"{self.name} holds a damaged document; restore it from a backup")
        return json.loads(row.document)

    def _make_tables(self) -> None:
        """Make the tables where none are; refuse an SQLite file of something else."""
        with self._writing() as connection:
            if _stored_version(connection) is not None:
                return
            others = sa.inspect(connection).get_table_names()
            if others and self._is_sqlite:
                raise InputError(
                    f"{self.name} holds other tables ({', '.join(others[:3])}): give the library "
                    "a file of its own"
                )
            _TABLES.create_all(connection, checkfirst=False)
            written_by = f"deboom {deboom.__version__}"
            connection.execute(sa.insert(_VERSION).values(version=VERSION, written_by=written_by))

    def _check_version(self, connection: sa.Connection) -> None:
        """Refuse tables of another version than this deboom's."""
        stored = _stored_version(connection)
        if stored is None:
            raise InputError(f"{self.name} holds no mount library; check the address")
        if stored.version != VERSION:
            remedy = f"install {stored.written_by} or a newer one"
            if stored.version < VERSION:
                remedy = f"export its mounts to JSON with {stored.written_by}, and import that file"
            raise InputError(
                f"{self.name} is a library of version {stored.version}, and this deboom knows "
                f"version {VERSION}: {remedy}"
            )

    @property
    def _is_sqlite(self) -> bool:
        return self._engine.dialect.name == "sqlite"

    @contextmanager
    def _reading(self, *, check: bool = True) -> Iterator[sa.Connection]:
        """Open a transaction that sees one state of the library."""
        with self._in_words(), self._engine.connect() as connection:
            if not self._is_sqlite:
                connection = connection.execution_options(isolation_level="REPEATABLE READ")
            if check:
                self._check_version(connection)
            yield connection

    @contextmanager
    def _writing(self) -> Iterator[sa.Connection]:
        """Open a transaction that is alone in writing, and commit it at the end of the block."""
        with self._in_words(), self._engine.connect() as connection:
            connection = connection.execution_options(deboom_begin="BEGIN IMMEDIATE")
            with connection.begin():
                if not self._is_sqlite:
                    patience = max(1, round(1000 * self._timeout))
                    connection.exec_driver_sql(f"SET LOCAL lock_timeout = {patience}")
                    connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_ADVISORY_LOCK})")
                yield connection

    @contextmanager
    def _in_words(self) -> Iterator[None]:
        """Say what the user can do about an error of the database."""
        try:
            yield
        except DBAPIError as error:
            text = " ".join(str(error.orig).split())
            state = getattr(error.orig, "sqlstate", None)
            if "is locked" in text or state == _LOCK_NOT_AVAILABLE:
                sentence = (
                    f"is locked: another program has been writing to it for {self._timeout:g} s; "
                    "wait for it or end it, then try again"
                )
            elif state in (_NO_PRIVILEGE, _READ_ONLY) or "readonly" in text:
                sentence = f"may not be written to ({text}); ask its owner for the right to"
            elif state == _NO_SUCH_LETTER:
                sentence = f"cannot keep this name ({text}): use a database in UTF8"
            elif "interrupted" in text:
                sentence = "takes too long to read: it is no library of deboom, or damaged"
            elif "too big" in text:
                sentence = (
                    f"holds an entry of more than {LARGEST_ENTRY >> 20} MiB: it is damaged; "
                    "restore it from a backup"
                )
            elif any(word in text for word in ("malformed", "not a database", "no such")):
                sentence = f"is damaged ({text}); restore it from a backup"
            elif isinstance(error, OperationalError):
                sentence = f"cannot be used ({text}); check the address, the server and the disk"
            else:
                raise
            raise InputError(f"{self.name} {sentence}") from error


def open_library(
    where: str | Path, *, create: bool = False, timeout: float = TIMEOUT
) -> MountLibrary:
    """Open a mount library.

    Parameters
    ----------
    where : str or Path
        Path of an SQLite file, or a URL such as ``postgresql://user@host/database``.
    create : bool
        Whether to make it where there is none.
    timeout : float
        How long each call waits while another program writes [s].

    Returns
    -------
    MountLibrary
        A context manager.

    Raises
    ------
    InputError
        There is no library, it is of another version, damaged, locked or cannot be reached; not a
        URL, a database other than SQLite and PostgreSQL, a driver that is not installed.

    See Also
    --------
    deboom.characterise, deboom.CatalogueProblem, deboom.read_platform

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_library(Path(folder) / "mounts.db", create=True) as library:
    ...         library.identities(mount="TSM")
    ()
    """
    url = _url(where)
    if url.get_backend_name() == "sqlite":
        path = Path(url.database or "")
        _check_file(path, create)
        name = str(path)
        engine = sa.create_engine(url, poolclass=sa.NullPool, connect_args={"timeout": timeout})
        sa.event.listen(engine, "connect", _connected_to_sqlite)
        sa.event.listen(engine, "begin", _begin_sqlite)
    else:
        name = url.render_as_string(hide_password=True)
        try:
            # whatever the database is kept in, names travel as UTF-8
            utf8 = {"client_encoding": "utf8"}
            engine = sa.create_engine(url, poolclass=sa.NullPool, connect_args=utf8)
        except ModuleNotFoundError:
            raise InputError(f"{name} needs a driver: pip install 'deboom[postgres]'") from None
    library = MountLibrary(name, engine, timeout)
    with library._reading(check=False) as connection:
        missing = create and _stored_version(connection) is None
    if missing:
        library._make_tables()
    with library._reading():
        return library


def _url(where: str | Path) -> sa.URL:
    """Address of a database; a path is one of SQLite."""
    if "://" not in str(where):
        return sa.URL.create("sqlite", database=str(where))
    try:
        url = sa.make_url(str(where))
        backend = url.get_backend_name()
    except (ArgumentError, NoSuchModuleError, ValueError):
        raise InputError(
            "the address of a library is a path or a URL such as "
            "postgresql://user@host/database, and this is neither"
        ) from None
    if backend not in ("sqlite", "postgresql"):
        raise InputError(
            f"a library cannot live in {backend}: use the path of an SQLite file or a PostgreSQL "
            "URL, where writers and crashes are known to leave it whole"
        )
    if backend == "sqlite" and url.database in (None, "", ":memory:"):
        raise InputError("sqlite:// names no file, and a library in memory keeps nothing")
    return url.set(drivername="postgresql+psycopg") if backend == "postgresql" else url


def _check_file(path: Path, create: bool) -> None:
    """Refuse a path that is no SQLite file and may not become one."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path} is a folder, a device or a pipe; give the file of a library")
    if not path.exists():
        if not create:
            raise InputError(f"{path}: there is no such library; check the path")
        if not path.parent.is_dir():
            raise InputError(f"{path}: its folder does not exist; make it first")
        return
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            start = file.read(len(_SQLITE_SIGNATURE))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check the path") from None
    if start not in (b"", _SQLITE_SIGNATURE):
        raise InputError(f"{path} is not a library: it is no SQLite file")
    if size > LARGEST_LIBRARY:
        raise InputError(
            f"{path} has {size >> 20} MiB, at most {LARGEST_LIBRARY >> 20} MiB are opened: keep "
            "campaigns in several libraries, or in PostgreSQL"
        )


def _connected_to_sqlite(connection: Any, _record: Any) -> None:
    connection.isolation_level = None  # the driver starts no transactions, _begin_sqlite does
    connection.execute("PRAGMA foreign_keys = ON")
    # a file from elsewhere: no functions in its schema, no endless query, no huge value
    connection.execute("PRAGMA trusted_schema = OFF")
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_ENTRY)
    looks = iter(range(MOST_STEPS // _STEPS_PER_LOOK))
    connection.set_progress_handler(lambda: next(looks, None) is None, _STEPS_PER_LOOK)


def _begin_sqlite(connection: sa.Connection) -> None:
    connection.exec_driver_sql(connection.get_execution_options().get("deboom_begin", "BEGIN"))


def _refuse_programs(connection: sa.Connection) -> None:
    """Refuse an SQLite file that does more than hold tables: what it does would run with a query.

    - raises InputError: names the first view, trigger, virtual table or computed column.
    """
    for query in (
        "SELECT replace(type, 'table', 'virtual table'), name FROM sqlite_master"
        " WHERE type NOT IN ('table', 'index') OR sql LIKE 'CREATE VIRTUAL%' LIMIT 1",
        "SELECT 'computed column', c.name FROM sqlite_master m, pragma_table_xinfo(m.name) c"
        " WHERE m.type = 'table' AND c.hidden > 0 LIMIT 1",
    ):
        for kind, name in connection.execute(sa.text(query)):
            raise InputError(
                f"{connection.engine.url.database} has a {kind} '{str(name)[:LONGEST_TEXT]}': a "
                "library holds tables only; export its mounts to JSON where it comes from"
            )


def _stored_version(connection: sa.Connection) -> sa.Row[Any] | None:
    """Version of a library; None where there is none."""
    if connection.dialect.name == "sqlite":
        _refuse_programs(connection)
    if not sa.inspect(connection).has_table(_VERSION.name):
        return None
    return _only_row(connection, sa.select(_VERSION))


def _only_row(connection: sa.Connection, query: sa.Select[Any]) -> sa.Row[Any] | None:
    """Return the row of a query that has at most one; None where it has none.

    - raises InputError: it has two, which the keys of the tables forbid.
    """
    rows = connection.execute(query).fetchmany(2)
    if len(rows) > 1:
        url = connection.engine.url.render_as_string(hide_password=True)
        raise InputError(f"{url} holds an entry twice: it is damaged; restore it from a backup")
    return rows[0] if rows else None


def _same(identity: MountIdentity) -> sa.ColumnElement[bool]:
    """Condition of one mount; the supplier belongs to a part number."""
    return sa.and_(*(_MOUNT.c[name] == getattr(identity, name) for name in _KEY))


def _columns(content: dict[str, Any]) -> dict[str, str]:
    document = json.dumps(content, allow_nan=False)
    return {"document": document, "sha256": hashlib.sha256(document.encode()).hexdigest()}


def _check_complete(
    campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> None:
    """Refuse mounts whose campaign is not imported with them, and twins."""
    names = [campaign.name for campaign in campaigns]
    # the supplier belongs to a part number, it does not tell mounts apart
    keys = [replace(value.identity, supplier="") for value in mounts]
    for value, key in zip(mounts, keys, strict=True):
        if names.count(value.identity.campaign) != 1:
            raise InputError(f"{value.identity}: its campaign must be imported with it, once")
        if keys.count(key) > 1:
            raise InputError(f"{value.identity} is to be imported twice; give each a serial")


def _listed(identities: Sequence[MountIdentity]) -> str:
    more = f"; and {len(identities) - 4} more" if len(identities) > 4 else ""
    return "; ".join(str(identity) for identity in identities[:4]) + more
