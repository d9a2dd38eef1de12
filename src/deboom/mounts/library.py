"""The mount library: characterised mounts in an SQLite or PostgreSQL database.

An SQLite file by default, PostgreSQL by its URL. Every import is one transaction: after a crash the
library is as it was before. Writers come one after the other, and each sees all of its
predecessor's work: SQLite locks the file from the start of a writing transaction
(``BEGIN IMMEDIATE``), PostgreSQL takes an advisory lock that ends with the transaction. Tables are
made inside of such a transaction, too. A reader sees one state from its first query to its last.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np
import numpy.typing as npt
from sqlalchemy import (
    JSON,
    URL,
    Connection,
    Dialect,
    Engine,
    ForeignKey,
    LargeBinary,
    NullPool,
    Select,
    String,
    UniqueConstraint,
    create_engine,
    delete,
    event,
    inspect,
    make_url,
    select,
)
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, OperationalError
from sqlalchemy.orm import DeclarativeBase, Mapped, Session, mapped_column, relationship
from sqlalchemy.types import TypeDecorator

import deboom
from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.characterised_mount import (
    LONGEST_TEXT,
    CampaignRecord,
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    FittedSurface,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.mount import Mount
from deboom.mounts.piecewise_cubic import named_arrays

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    D = TypeVar("D", bound=DataclassInstance)

T = TypeVar("T")
Arrays = dict[str, npt.NDArray[Any]]

VERSION = 1
"""Version of the tables that are read and written."""

TIMEOUT = 10.0
"""How long a transaction waits for other programs, unless said otherwise [s]."""

UNITS = {
    "campaign.engine_order": "1",
    "mount.body_mass": "kg",
    "mount.body_mass_tolerance": "kg",
    "piece.x": "m",
    "piece.y": "m",
    "piece.z": "m",
    "direction.half_width_95": "1",
    "direction.r2_real": "1",
    "direction.r2_imag": "1",
    "direction.r2_force": "1",
    "map.arrays.preload": "N",
    "map.arrays.wheel_torque": "N m",
    "map.arrays.amplitude": "m",
    "map.arrays.frequency": "Hz",
    "map.arrays.dynamic_stiffness": "N/m",
    "map.arrays.confidence": "1",
    "surface.lower": "as in surface.units",
    "surface.upper": "as in surface.units",
    "surface.arrays": "as in surface.units, values in N/m",
    "static_curve.arrays.deflection": "m",
    "static_curve.arrays.force": "N",
    "static_curve.force_uncertainty": "1",
    "campaign.tolerances": "in the name",
    "mount.quality": "in the name",
}
"""Unit of every stored number; a library carries this list and is refused if it says otherwise."""

_ADVISORY_LOCK = 0x6465626F6F6D  # "deboom", one number for all libraries of a database
_SQLITE_SIGNATURE = b"SQLite format 3\0"
_LOCK_NOT_AVAILABLE, _NO_PRIVILEGE, _READ_ONLY = "55P03", "42501", "25006"


class Npz(TypeDecorator[Arrays]):
    """Named arrays as the bytes of an npz file, without pickle."""

    impl = LargeBinary
    cache_ok = True

    def process_bind_param(self, value: Arrays | None, _dialect: Dialect) -> bytes | None:
        """Write the arrays."""
        if value is None:
            return None
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w") as archive:
            for name, array in value.items():
                with archive.open(f"{name}.npy", "w") as entry:
                    np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
        return buffer.getvalue()

    def process_result_value(self, value: bytes | None, _dialect: Dialect) -> Arrays | None:
        """Read the arrays; a checksum guards each of them."""
        if value is None:
            return None
        try:
            with np.load(io.BytesIO(value), allow_pickle=False) as stored:
                return {name: stored[name] for name in stored.files}
        except (ValueError, EOFError, RuntimeError, zipfile.BadZipFile) as error:
            raise InputError(
                f"the library holds damaged arrays ({error}); restore it from a backup"
            ) from None


class Base(DeclarativeBase):
    """All tables of a library; attributes are called as those of the dataclasses they keep."""

    type_annotation_map: ClassVar[dict[Any, Any]] = {
        str: String(LONGEST_TEXT),
        list[Any]: JSON,
        dict[str, Any]: JSON,
        Arrays: Npz,
    }


def _key_of(table: str, *, primary: bool = False) -> Any:
    """Column that refers to a parent row and is deleted with it."""
    return mapped_column(ForeignKey(f"deboom_{table}.id", ondelete="CASCADE"), primary_key=primary)


class VersionRow(Base):
    """One row: the version of the tables."""

    __tablename__ = "deboom_version"
    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    written_by: Mapped[str]


class UnitRow(Base):
    """Unit of one stored number."""

    __tablename__ = "deboom_unit"
    quantity: Mapped[str] = mapped_column(primary_key=True)
    unit: Mapped[str]


class CampaignRow(Base):
    """A measurement campaign."""

    __tablename__ = "deboom_campaign"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    order: Mapped[float] = mapped_column("engine_order")
    runs: Mapped[list[Any]]
    tolerances: Mapped[dict[str, Any]]
    inputs_sha256: Mapped[dict[str, Any]]


class MountRow(Base):
    """A characterised mount."""

    __tablename__ = "deboom_mount"
    __table_args__ = (UniqueConstraint("campaign_id", "mount", "variant", "part_number", "serial"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    campaign_id: Mapped[int] = _key_of("campaign")
    mount: Mapped[str]
    variant: Mapped[str]
    part_number: Mapped[str]
    supplier: Mapped[str]
    serial: Mapped[str]
    description: Mapped[str]
    transfer_axes: Mapped[list[Any]]
    body_mass: Mapped[float | None]
    body_mass_tolerance: Mapped[float]
    quality: Mapped[dict[str, Any]]
    campaign: Mapped[CampaignRow] = relationship()
    pieces: Mapped[list[PieceRow]] = relationship(order_by="PieceRow.number", lazy="selectin")
    directions: Mapped[list[DirectionRow]] = relationship(
        order_by="DirectionRow.number", lazy="selectin"
    )


class PieceRow(Base):
    """Virtual point of one piece of a mount, from the powertrain's centre of gravity."""

    __tablename__ = "deboom_piece"
    mount_id: Mapped[int] = _key_of("mount", primary=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    name: Mapped[str]
    x: Mapped[float]
    y: Mapped[float]
    z: Mapped[float]


class DirectionRow(Base):
    """One direction of a mount, and how far it may be believed."""

    __tablename__ = "deboom_direction"
    __table_args__ = (UniqueConstraint("mount_id", "axis"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    mount_id: Mapped[int] = _key_of("mount")
    number: Mapped[int]
    axis: Mapped[str]
    identified: Mapped[bool]
    half_width_95: Mapped[float | None]
    r2_real: Mapped[float | None]
    r2_imag: Mapped[float | None]
    r2_force: Mapped[float | None]
    map: Mapped[MapRow] = relationship(lazy="selectin")
    surface: Mapped[SurfaceRow | None] = relationship(lazy="selectin")
    static_curve: Mapped[StaticCurveRow | None] = relationship(lazy="selectin")


class MapRow(Base):
    """Map points of one direction: arrays of equal length."""

    __tablename__ = "deboom_map"
    direction_id: Mapped[int] = _key_of("direction", primary=True)
    n_points: Mapped[int]
    arrays: Mapped[Arrays]


class SurfaceRow(Base):
    """Response surface of one direction."""

    __tablename__ = "deboom_surface"
    direction_id: Mapped[int] = _key_of("direction", primary=True)
    model: Mapped[str]
    variables: Mapped[list[Any]]
    units: Mapped[list[Any]]
    lower: Mapped[list[Any]]
    upper: Mapped[list[Any]]
    settings: Mapped[dict[str, Any]]
    arrays: Mapped[Arrays]


class StaticCurveRow(Base):
    """Quasi-static force over deflection of one direction."""

    __tablename__ = "deboom_static_curve"
    direction_id: Mapped[int] = _key_of("direction", primary=True)
    mount_set: Mapped[str]
    force_uncertainty: Mapped[float]
    arrays: Mapped[Arrays]


class MountLibrary:
    """Characterised mounts and their campaigns; made by `open_library`, a context manager.

    A connection lasts for one call only: nothing is locked, and no server is kept waiting, between
    two calls. The context manager gives back what the engine still holds.
    """

    def __init__(self, name: str, engine: Engine, timeout: float) -> None:
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
        with self._reading() as session:
            rows = session.scalars(select(CampaignRow).order_by(CampaignRow.name))
            return tuple(_built(CampaignRecord, row) for row in rows)

    def identities(
        self,
        campaign: str | None = None,
        mount: str | None = None,
        variant: str | None = None,
        part_number: str | None = None,
        serial: str | None = None,
    ) -> tuple[MountIdentity, ...]:
        """Return which mounts are kept, sorted; what is left out is not asked for."""
        asked = {
            CampaignRow.name: campaign,
            MountRow.mount: mount,
            MountRow.variant: variant,
            MountRow.part_number: part_number,
            MountRow.serial: serial,
        }
        names = (CampaignRow.name, *(getattr(MountRow, name) for name in _IDENTITY))
        query = select(*names).join(MountRow.campaign)
        for column, value in asked.items():
            if value is not None:
                query = query.where(column == value)
        with self._reading() as session:
            return tuple(sorted(MountIdentity(*row) for row in session.execute(query)))

    def find(
        self,
        campaign: str | None = None,
        mount: str | None = None,
        variant: str | None = None,
        part_number: str | None = None,
        serial: str | None = None,
    ) -> MountIdentity:
        """Return the one mount that is asked for, as `identities` does.

        - raises InputError: None, or more than one: the candidates are named.
        """
        matching = self.identities(campaign, mount, variant, part_number, serial)
        if len(matching) == 1:
            return matching[0]
        if matching:
            raise InputError(
                f"{self.name}: {len(matching)} mounts fit, say which one by its campaign, variant, "
                f"part number or serial: {_listed(matching)}"
            )
        known = _listed(self.identities()) or "is none at all"
        raise InputError(f"{self.name}: no such mount; there {known}")

    def load(self, identity: MountIdentity) -> CharacterisedMount:
        """Return a mount exactly as it was added.

        - raises InputError: it is not in the library, or its arrays are damaged.
        """
        with self._reading() as session:
            row = session.scalar(_matching(select(MountRow), identity))
            if row is None:
                raise InputError(f"{self.name}: {identity} is not in the library")
            return _mount_of(row)

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
        with self._writing() as session:
            self._check_version(session)
            parents = {
                campaign.name: self._campaign_row(session, campaign, replace)
                for campaign in campaigns
            }
            for value in mounts:
                known = session.scalar(_matching(select(MountRow.id), value.identity))
                if known is not None and not replace:
                    raise InputError(
                        f"{self.name}: {value.identity} is there already; replace it, or give the "
                        "new one another serial"
                    )
                session.execute(delete(MountRow).where(MountRow.id == known))
                session.add(_mount_row(value, parents[value.identity.campaign]))
                session.flush()

    def _campaign_row(
        self, session: Session, campaign: CampaignRecord, replace: bool
    ) -> CampaignRow:
        """Row of a campaign, of one that is kept already or a new one."""
        named = select(CampaignRow).where(CampaignRow.name == campaign.name)
        known = session.scalars(named).one_or_none()
        if known is not None:
            if _built(CampaignRecord, known) == campaign:
                return known
            if not replace:
                raise InputError(
                    f"{self.name}: there is another campaign {campaign.name}, of other files or "
                    "tolerances; replace it with all its mounts, or rename the new one"
                )
            session.delete(known)
            session.flush()
        row = CampaignRow(**_columns(campaign))
        session.add(row)
        return row

    def _make_tables(self) -> None:
        """Make the tables where none are; refuse an SQLite file of something else."""
        with self._writing() as session:
            if _stored_version(session) is not None:
                return
            others = inspect(session.connection()).get_table_names()
            if others and self._is_sqlite:
                raise InputError(
                    f"{self.name} holds other tables ({', '.join(others[:3])}): give the library "
                    "a file of its own"
                )
            Base.metadata.create_all(session.connection(), checkfirst=False)
            session.add_all(UnitRow(quantity=name, unit=unit) for name, unit in UNITS.items())
            session.add(VersionRow(version=VERSION, written_by=f"deboom {deboom.__version__}"))

    def _check_version(self, session: Session) -> None:
        """Refuse tables of another version, or in other units, than this deboom's."""
        stored = _stored_version(session)
        if stored is None:
            raise InputError(f"{self.name} holds no mount library; check the address")
        if stored.version != VERSION:
            raise InputError(
                f"{self.name} is a library of version {stored.version}, and this deboom knows "
                f"version {VERSION}: install {stored.written_by} or a newer one"
            )
        units = {row.quantity: row.unit for row in session.scalars(select(UnitRow))}
        for quantity, unit in UNITS.items():
            if units.get(quantity) != unit:
                raise InputError(
                    f"{self.name} states {quantity} in {units.get(quantity)}, expected {unit}; "
                    "restore it from a backup, deboom does not guess units"
                )

    @property
    def _is_sqlite(self) -> bool:
        return self._engine.dialect.name == "sqlite"

    @contextmanager
    def _reading(self, *, check: bool = True) -> Iterator[Session]:
        """Open a transaction that sees one state of the library."""
        with self._in_words(), self._engine.connect() as connection:
            if not self._is_sqlite:
                connection = connection.execution_options(isolation_level="REPEATABLE READ")
            with Session(connection) as session:
                if check:
                    self._check_version(session)
                yield session

    @contextmanager
    def _writing(self) -> Iterator[Session]:
        """Open a transaction that is alone in writing, and commit it at the end of the block."""
        with self._in_words(), self._engine.connect() as connection:
            connection = connection.execution_options(deboom_begin="BEGIN IMMEDIATE")
            with connection.begin(), Session(connection) as session:
                if not self._is_sqlite:
                    patience = max(1, round(1000 * self._timeout))
                    connection.exec_driver_sql(f"SET LOCAL lock_timeout = {patience}")
                    connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_ADVISORY_LOCK})")
                yield session
                session.flush()

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
        engine = create_engine(url, poolclass=NullPool, connect_args={"timeout": timeout})
        event.listen(engine, "connect", _connected_to_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
    else:
        name = url.render_as_string(hide_password=True)
        try:
            engine = create_engine(url, poolclass=NullPool)
        except ModuleNotFoundError:
            raise InputError(f"{name} needs a driver: pip install 'deboom[postgres]'") from None
    library = MountLibrary(name, engine, timeout)
    with library._reading(check=False) as session:
        missing = create and _stored_version(session) is None
    if missing:
        library._make_tables()
    with library._reading():
        return library


def _url(where: str | Path) -> URL:
    """Address of a database; a path is one of SQLite."""
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
    """Refuse a path that is no SQLite file and may not become one."""
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


def _stored_version(session: Session) -> VersionRow | None:
    """Version of a library; None where there is none."""
    if not inspect(session.connection()).has_table(VersionRow.__tablename__):
        return None
    return session.scalars(select(VersionRow)).one_or_none()


_IDENTITY = ("mount", "variant", "part_number", "supplier", "serial")


def _matching(query: Select[T], identity: MountIdentity) -> Select[T]:
    """Restrict a query to one mount; the supplier belongs to a part number."""
    query = query.join(MountRow.campaign).where(CampaignRow.name == identity.campaign)
    for name in ("mount", "variant", "part_number", "serial"):
        query = query.where(getattr(MountRow, name) == getattr(identity, name))
    return query


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


def _columns(value: DataclassInstance, *left_out: str) -> dict[str, Any]:
    """Fields of a dataclass as the plain values that columns keep."""
    columns: dict[str, Any] = {}
    for name in [field.name for field in fields(value) if field.name not in left_out]:
        content = getattr(value, name)
        if isinstance(content, tuple):
            content = list(content)
        elif isinstance(content, np.ndarray):
            content = content.tolist()
        elif isinstance(content, Mapping):
            content = dict(content)
        columns[name] = content
    return columns


def _built(kind: type[D], row: Base, **known: Any) -> D:
    """Build a dataclass of the columns of a row and of what is known otherwise."""
    names = [field.name for field in fields(kind) if field.name not in known]
    return kind(**{name: getattr(row, name) for name in names}, **known)


def _mount_row(value: CharacterisedMount, campaign: CampaignRow) -> MountRow:
    """Rows of a characterised mount, those of its directions within."""
    pieces = zip(value.mount.pieces, value.mount.positions, strict=True)
    return MountRow(
        **_columns(value.identity, "campaign"),
        **_columns(value.mount, "name", "pieces", "positions"),
        campaign=campaign,
        quality=dict(value.quality),
        pieces=[
            PieceRow(number=number, name=name, x=float(x), y=float(y), z=float(z))
            for number, (name, (x, y, z)) in enumerate(pieces)
        ],
        directions=[_direction_row(*numbered) for numbered in enumerate(value.directions)],
    )


def _direction_row(number: int, direction: CharacterisedDirection) -> DirectionRow:
    points, surface, curve = direction.map_points, direction.surface, direction.static_curve
    curve_row = None
    if curve is not None:
        curve_row = StaticCurveRow(
            mount_set=curve.mount_set,
            force_uncertainty=float(curve.force_uncertainty),
            arrays={"deflection": curve.deflection, "force": curve.force},
        )
    arrays = {field.name: getattr(points, field.name) for field in fields(points)}
    return DirectionRow(
        number=number,
        axis=direction.axis,
        **_columns(direction.quality),
        map=MapRow(n_points=len(points), arrays=arrays),
        surface=None if surface is None else SurfaceRow(**_columns(surface)),
        static_curve=curve_row,
    )


def _mount_of(row: MountRow) -> CharacterisedMount:
    """Characterised mount of its rows."""
    mount = _built(
        Mount,
        row,
        name=row.mount,
        pieces=tuple(piece.name for piece in row.pieces),
        positions=tuple((piece.x, piece.y, piece.z) for piece in row.pieces),
        transfer_axes=tuple(row.transfer_axes),
    )
    identity = _built(MountIdentity, row, campaign=row.campaign.name)
    directions = tuple(_direction_of(row.mount, direction) for direction in row.directions)
    return CharacterisedMount(identity, mount, directions, row.quality)


def _direction_of(mount: str, row: DirectionRow) -> CharacterisedDirection:
    names = tuple(field.name for field in fields(MapPoints))
    curve = row.static_curve
    return CharacterisedDirection(
        axis=row.axis,
        map_points=MapPoints(**named_arrays(row.map.arrays, "", names)),
        quality=_built(DirectionQuality, row),
        surface=None if row.surface is None else _built(FittedSurface, row.surface),
        static_curve=None
        if curve is None
        else _built(StaticCurve, curve, mount=mount, axis=row.axis, **curve.arrays),
    )
