"""Where a mount library lives: connections, transactions, and the database's errors in words.

Writers come one after the other, and each sees all of its predecessor's work: SQLite locks the
file from the start of a writing transaction (``BEGIN IMMEDIATE``), PostgreSQL takes an advisory
lock that ends with the transaction. Tables are made and changed inside of such a transaction, too.
A reader sees one state from its first query to its last.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, NullPool, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, OperationalError
from sqlalchemy.orm import Session

from deboom.errors import InputError

_ADVISORY_LOCK = 0x6465626F6F6D  # "deboom", one number for all libraries of a database
_SQLITE_SIGNATURE = b"SQLite format 3\0"
_LOCK_NOT_AVAILABLE, _NO_PRIVILEGE, _READ_ONLY = "55P03", "42501", "25006"


@dataclass(frozen=True)
class Database:
    """A database that may hold a library.

    Parameters
    ----------
    name : str
        What messages call it: the path, or the URL without its password.
    path : Path or None
        The file of an SQLite database.
    engine : Engine
        Connects anew for each transaction.
    timeout : float
        How long a transaction waits for others [s].
    """

    name: str
    path: Path | None
    engine: Engine
    timeout: float

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Open a transaction that sees one state of the library."""
        with self._in_words(), self.engine.connect() as connection:
            if self.path is None:
                connection = connection.execution_options(isolation_level="REPEATABLE READ")
            with Session(connection) as session:
                yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """Open a transaction that is alone in writing, and commit it at the end of the block."""
        with self._in_words(), self.engine.connect() as connection:
            connection = connection.execution_options(deboom_begin="BEGIN IMMEDIATE")
            with connection.begin(), Session(connection) as session:
                if self.path is None:
                    _lock(connection, self.timeout)
                yield session
                session.flush()

    @contextmanager
    def _in_words(self) -> Iterator[None]:
        try:
            yield
        except DBAPIError as error:
            sentence = self._sentence(error)
            if sentence is None:
                raise
            raise InputError(f"{self.name} {sentence}") from error

    def _sentence(self, error: DBAPIError) -> str | None:
        """Say what the user can do about an error; None for a defect of ours."""
        text = " ".join(str(error.orig).split())
        state = getattr(error.orig, "sqlstate", None)
        if "is locked" in text or state == _LOCK_NOT_AVAILABLE:
            return (
                f"is locked: another program has been writing to it for {self.timeout:g} s; wait "
                "for it or end it, then try again"
            )
        if state in (_NO_PRIVILEGE, _READ_ONLY) or "readonly" in text:
            return f"may not be written to ({text}); ask its owner for the right to"
        if any(word in text for word in ("malformed", "not a database", "no such")):
            return f"is damaged ({text}); restore it from a backup"
        if isinstance(error, OperationalError):
            return f"cannot be used ({text}); check the address, the server and the disk"
        return None


def database(where: str | Path, *, create: bool, timeout: float) -> Database:
    """Name a database by path or URL; nothing is opened yet.

    Parameters
    ----------
    where : str or Path
        A path, which means SQLite, or a URL such as ``postgresql://user@host/database``.
    create : bool
        Whether an SQLite file may be made.
    timeout : float
        How long a transaction waits for others [s].

    Raises
    ------
    InputError
        Not a URL, a database other than SQLite and PostgreSQL, a driver that is not installed, a
        file that is missing or is no SQLite file.
    """
    url = _url(where)
    if url.get_backend_name() == "sqlite":
        path = Path(url.database or "")
        _check_file(path, create)
        engine = create_engine(url, poolclass=NullPool, connect_args={"timeout": timeout})
        event.listen(engine, "connect", _connected_to_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return Database(str(path), path, engine, timeout)
    name = url.render_as_string(hide_password=True)
    try:
        engine = create_engine(url, poolclass=NullPool)
    except ModuleNotFoundError:
        raise InputError(f"{name} needs a driver: pip install 'deboom[postgres]'") from None
    return Database(name, None, engine, timeout)


def _url(where: str | Path) -> URL:
    if "://" not in str(where):
        return URL.create("sqlite", database=str(where))
    try:
        url = make_url(str(where))
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
    if path.is_dir():
        raise InputError(f"{path} is a folder; give the file of a library")
    if not path.exists():
        if not create:
            raise InputError(f"{path}: there is no such library; check the path")
        if not path.parent.is_dir():
            raise InputError(f"{path}: its folder does not exist; make it first")
        return
    try:
        with path.open("rb") as file:
            start = file.read(len(_SQLITE_SIGNATURE))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check the path") from None
    if start not in (b"", _SQLITE_SIGNATURE):
        raise InputError(f"{path} is not a library: it is no SQLite file")


def _connected_to_sqlite(connection: Any, _record: Any) -> None:
    connection.isolation_level = None  # the driver starts no transactions, _begin_sqlite does
    connection.execute("PRAGMA foreign_keys = ON")


def _begin_sqlite(connection: Connection) -> None:
    connection.exec_driver_sql(connection.get_execution_options().get("deboom_begin", "BEGIN"))


def _lock(connection: Connection, timeout: float) -> None:
    connection.exec_driver_sql(f"SET LOCAL lock_timeout = {max(1, round(1000 * timeout))}")
    connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_ADVISORY_LOCK})")
