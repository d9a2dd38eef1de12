"""Versions of a library's tables: made new, checked at every call, migrated only on demand."""

from __future__ import annotations

from sqlalchemy import inspect, select
from sqlalchemy.orm import Session

import deboom
from deboom.errors import InputError
from deboom.mounts import library_schema as schema
from deboom.mounts.library_database import Database
from deboom.mounts.library_schema import Base, UnitRow, VersionRow


def stored_version(session: Session) -> VersionRow | None:
    """Return the version of a library; None where there is none."""
    if not inspect(session.connection()).has_table(VersionRow.__tablename__):
        return None
    return session.scalars(select(VersionRow)).one_or_none()


def make_tables(session: Session, place: Database) -> None:
    """Make the tables of a new library.

    Raises
    ------
    InputError
        An SQLite file of something else.
    """
    others = inspect(session.connection()).get_table_names()
    if others and place.path is not None:
        raise InputError(
            f"{place.name} holds other tables ({', '.join(others[:3])}): give the library a file "
            "of its own"
        )
    Base.metadata.create_all(session.connection(), checkfirst=False)
    session.add_all(UnitRow(quantity=name, unit=unit) for name, unit in schema.UNITS.items())
    session.add(_this_version())


def migrate_tables(session: Session, name: str) -> tuple[int, int]:
    """Run the migrations that a library lacks; return its versions before and after.

    Raises
    ------
    InputError
        No library, or a newer one.
    """
    row = _known_version(session, name)
    before, after = row.version, schema.current_version()
    if before < after:
        for step in schema.MIGRATIONS[before - 1 :]:
            step(session.connection())
        session.delete(row)
        session.add(_this_version())
        session.flush()
    check_version(session, name)
    return before, after


def check_version(session: Session, name: str) -> None:
    """Refuse tables of another version, or in other units, than this deboom's.

    Raises
    ------
    InputError
        The sentence names version and remedy.
    """
    version = _known_version(session, name).version
    if version < schema.current_version():
        raise InputError(
            f"{name} is a library of the older version {version}: back it up, then run "
            "`deboom library migrate` on it"
        )
    stored = {unit.quantity: unit.unit for unit in session.scalars(select(UnitRow))}
    for quantity, unit in schema.UNITS.items():
        if stored.get(quantity) != unit:
            raise InputError(
                f"{name} states {quantity} in {stored.get(quantity)}, expected {unit}; restore it "
                "from a backup, deboom does not guess units"
            )


def _known_version(session: Session, name: str) -> VersionRow:
    row = stored_version(session)
    if row is None:
        raise InputError(f"{name} holds no mount library; check the address")
    known = schema.current_version()
    if row.version > known:
        raise InputError(
            f"{name} is a library of version {row.version}, and this deboom knows versions up to "
            f"{known}: install {row.written_by} or a newer one"
        )
    return row


def _this_version() -> VersionRow:
    written_by = f"deboom {deboom.__version__}"
    return VersionRow(version=schema.current_version(), written_by=written_by)
