"""The mount library: characterised mounts in an SQLite or PostgreSQL database."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
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
from deboom.mounts.piecewise_cubic import NamedArrays, from_arrays, to_arrays

MIGRATIONS: tuple[Callable[[Connection], None], ...] = ()
"""Step n takes a library from version n + 1 to n + 2; all steps run in one transaction."""

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


def current_version() -> int:
    """Return the version of the tables that this deboom reads and writes."""
    return 1 + len(MIGRATIONS)


class Npz(TypeDecorator[NamedArrays]):
    """Named arrays as the bytes of an npz file, without pickle."""

    impl = LargeBinary
    cache_ok = True

    def process_bind_param(self, value: NamedArrays | None, _dialect: Dialect) -> bytes | None:
        """Write the arrays."""
        if value is None:
            return None
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w") as archive:
            for name, array in value.items():
                with archive.open(f"{name}.npy", "w") as entry:
                    np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
        return buffer.getvalue()

    def process_result_value(self, value: bytes | None, _dialect: Dialect) -> NamedArrays | None:
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
    """All tables of a library."""

    type_annotation_map: ClassVar[dict[Any, Any]] = {str: String(LONGEST_TEXT)}


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
    engine_order: Mapped[float]
    runs: Mapped[list[Any]] = mapped_column(JSON)
    tolerances: Mapped[dict[str, Any]] = mapped_column(JSON)
    inputs_sha256: Mapped[dict[str, Any]] = mapped_column(JSON)


class MountRow(Base):
    """A characterised mount."""

    __tablename__ = "deboom_mount"
    __table_args__ = (UniqueConstraint("campaign_id", "mount", "variant", "part_number", "serial"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    campaign_id: Mapped[int] = mapped_column(ForeignKey("deboom_campaign.id", ondelete="CASCADE"))
    mount: Mapped[str]
    variant: Mapped[str]
    part_number: Mapped[str]
    supplier: Mapped[str]
    serial: Mapped[str]
    description: Mapped[str]
    transfer_axes: Mapped[list[Any]] = mapped_column(JSON)
    body_mass: Mapped[float | None]
    body_mass_tolerance: Mapped[float]
    quality: Mapped[dict[str, Any]] = mapped_column(JSON)
    campaign: Mapped[CampaignRow] = relationship()
    pieces: Mapped[list[PieceRow]] = relationship(order_by="PieceRow.number", lazy="selectin")
    directions: Mapped[list[DirectionRow]] = relationship(
        order_by="DirectionRow.number", lazy="selectin"
    )


class PieceRow(Base):
    """Virtual point of one piece of a mount, from the powertrain's centre of gravity."""

    __tablename__ = "deboom_piece"
    mount_id: Mapped[int] = mapped_column(
        ForeignKey("deboom_mount.id", ondelete="CASCADE"), primary_key=True
    )
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
    mount_id: Mapped[int] = mapped_column(ForeignKey("deboom_mount.id", ondelete="CASCADE"))
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
    direction_id: Mapped[int] = mapped_column(
        ForeignKey("deboom_direction.id", ondelete="CASCADE"), primary_key=True
    )
    n_points: Mapped[int]
    arrays: Mapped[NamedArrays] = mapped_column(Npz)


class SurfaceRow(Base):
    """Response surface of one direction."""

    __tablename__ = "deboom_surface"
    direction_id: Mapped[int] = mapped_column(
        ForeignKey("deboom_direction.id", ondelete="CASCADE"), primary_key=True
    )
    model: Mapped[str]
    variables: Mapped[list[Any]] = mapped_column(JSON)
    units: Mapped[list[Any]] = mapped_column(JSON)
    lower: Mapped[list[Any]] = mapped_column(JSON)
    upper: Mapped[list[Any]] = mapped_column(JSON)
    settings: Mapped[dict[str, Any]] = mapped_column(JSON)
    arrays: Mapped[NamedArrays] = mapped_column(Npz)


class StaticCurveRow(Base):
    """Quasi-static force over deflection of one direction."""

    __tablename__ = "deboom_static_curve"
    direction_id: Mapped[int] = mapped_column(
        ForeignKey("deboom_direction.id", ondelete="CASCADE"), primary_key=True
    )
    mount_set: Mapped[str]
    force_uncertainty: Mapped[float]
    arrays: Mapped[NamedArrays] = mapped_column(Npz)


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
    session.add_all(UnitRow(quantity=name, unit=unit) for name, unit in UNITS.items())
    session.add(_this_version())


def migrate_tables(session: Session, name: str) -> tuple[int, int]:
    """Run the migrations that a library lacks; return its versions before and after.

    Raises
    ------
    InputError
        No library, or a newer one.
    """
    row = _known_version(session, name)
    before, after = row.version, current_version()
    if before < after:
        for step in MIGRATIONS[before - 1 :]:
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
    if version < current_version():
        raise InputError(
            f"{name} is a library of the older version {version}: back it up, then run "
            "`deboom library migrate` on it"
        )
    stored = {unit.quantity: unit.unit for unit in session.scalars(select(UnitRow))}
    for quantity, unit in UNITS.items():
        if stored.get(quantity) != unit:
            raise InputError(
                f"{name} states {quantity} in {stored.get(quantity)}, expected {unit}; restore it "
                "from a backup, deboom does not guess units"
            )


def _known_version(session: Session, name: str) -> VersionRow:
    row = stored_version(session)
    if row is None:
        raise InputError(f"{name} holds no mount library; check the address")
    known = current_version()
    if row.version > known:
        raise InputError(
            f"{name} is a library of version {row.version}, and this deboom knows versions up to "
            f"{known}: install {row.written_by} or a newer one"
        )
    return row


def _this_version() -> VersionRow:
    written_by = f"deboom {deboom.__version__}"
    return VersionRow(version=current_version(), written_by=written_by)


def campaign_row(record: CampaignRecord) -> CampaignRow:
    """Return the row of a campaign."""
    return CampaignRow(
        name=record.name,
        engine_order=record.order,
        runs=list(record.runs),
        tolerances=dict(record.tolerances),
        inputs_sha256=dict(record.inputs_sha256),
    )


def campaign_of(row: CampaignRow) -> CampaignRecord:
    """Return the campaign of a row."""
    return CampaignRecord(
        row.name, row.engine_order, tuple(row.runs), row.tolerances, row.inputs_sha256
    )


def mount_row(value: CharacterisedMount, campaign: CampaignRow) -> MountRow:
    """Return the rows of a characterised mount, those of its directions within."""
    identity, mount = value.identity, value.mount
    return MountRow(
        campaign=campaign,
        mount=identity.mount,
        variant=identity.variant,
        part_number=identity.part_number,
        supplier=identity.supplier,
        serial=identity.serial,
        description=mount.description,
        transfer_axes=list(mount.transfer_axes),
        body_mass=mount.body_mass,
        body_mass_tolerance=mount.body_mass_tolerance,
        quality=dict(value.quality),
        pieces=[
            PieceRow(number=number, name=name, x=float(x), y=float(y), z=float(z))
            for number, (name, (x, y, z)) in enumerate(
                zip(mount.pieces, mount.positions, strict=True)
            )
        ],
        directions=[_direction_row(i, direction) for i, direction in enumerate(value.directions)],
    )


def mount_of(row: MountRow) -> CharacterisedMount:
    """Return the characterised mount of its rows."""
    mount = Mount(
        name=row.mount,
        description=row.description,
        pieces=tuple(piece.name for piece in row.pieces),
        positions=tuple((piece.x, piece.y, piece.z) for piece in row.pieces),
        transfer_axes=tuple(row.transfer_axes),
        body_mass=row.body_mass,
        body_mass_tolerance=row.body_mass_tolerance,
    )
    directions = tuple(_direction_of(mount.name, direction) for direction in row.directions)
    return CharacterisedMount(identity_of(row), mount, directions, row.quality)


def identity_of(row: MountRow) -> MountIdentity:
    """Return which part a row describes."""
    return MountIdentity(
        row.campaign.name, row.mount, row.variant, row.part_number, row.supplier, row.serial
    )


def _direction_row(number: int, direction: CharacterisedDirection) -> DirectionRow:
    surface, curve = direction.surface, direction.static_curve
    return DirectionRow(
        number=number,
        axis=direction.axis,
        **asdict(direction.quality),
        map=MapRow(n_points=len(direction.map_points), arrays=to_arrays(direction.map_points)),
        surface=None if surface is None else _surface_row(surface),
        static_curve=None if curve is None else _static_curve_row(curve),
    )


def _direction_of(mount: str, row: DirectionRow) -> CharacterisedDirection:
    return CharacterisedDirection(
        axis=row.axis,
        map_points=from_arrays(MapPoints, row.map.arrays),
        quality=DirectionQuality(
            row.identified, row.half_width_95, row.r2_real, row.r2_imag, row.r2_force
        ),
        surface=None if row.surface is None else _surface_of(row.surface),
        static_curve=None
        if row.static_curve is None
        else _static_curve_of(mount, row.axis, row.static_curve),
    )


def _surface_row(surface: FittedSurface) -> SurfaceRow:
    return SurfaceRow(
        model=surface.model,
        variables=list(surface.variables),
        units=list(surface.units),
        lower=surface.lower.tolist(),
        upper=surface.upper.tolist(),
        settings=dict(surface.settings),
        arrays=dict(surface.arrays),
    )


def _surface_of(row: SurfaceRow) -> FittedSurface:
    return FittedSurface(
        model=row.model,
        variables=tuple(row.variables),
        units=tuple(row.units),
        lower=np.array(row.lower, dtype=float),
        upper=np.array(row.upper, dtype=float),
        arrays=row.arrays,
        settings=row.settings,
    )


def _static_curve_row(curve: StaticCurve) -> StaticCurveRow:
    return StaticCurveRow(
        mount_set=curve.mount_set,
        force_uncertainty=float(curve.force_uncertainty),
        arrays={"deflection": curve.deflection, "force": curve.force},
    )


def _static_curve_of(mount: str, axis: str, row: StaticCurveRow) -> StaticCurve:
    return StaticCurve(
        mount=mount,
        axis=axis,
        mount_set=row.mount_set,
        deflection=row.arrays["deflection"],
        force=row.arrays["force"],
        force_uncertainty=row.force_uncertainty,
    )


T = TypeVar("T")
TIMEOUT = 10.0
"""How long a transaction waits for other programs, unless said otherwise [s]."""


class MountLibrary:
    """Characterised mounts and their campaigns; made by `open_library`.

    Parameters
    ----------
    database : Database
        Holds the tables of this version.

    Notes
    -----
    A connection lasts for one call only: nothing is locked, and no server is kept waiting, between
    two calls. The context manager gives back what the engine still holds.
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back all connections."""
        self._database.engine.dispose()

    @property
    def name(self) -> str:
        """Path, or URL without its password."""
        return self._database.name

    def campaigns(self) -> tuple[CampaignRecord, ...]:
        """Return all campaigns by name."""
        with self._reading() as session:
            rows = session.scalars(select(CampaignRow).order_by(CampaignRow.name))
            return tuple(campaign_of(row) for row in rows)

    def identities(
        self,
        *,
        campaign: str | None = None,
        mount: str | None = None,
        variant: str | None = None,
        part_number: str | None = None,
        serial: str | None = None,
    ) -> tuple[MountIdentity, ...]:
        """Return which mounts there are, sorted; what is left out is not asked for.

        Parameters
        ----------
        campaign, mount, variant, part_number, serial : str, optional
            As in `MountIdentity`.
        """
        asked = {
            CampaignRow.name: campaign,
            MountRow.mount: mount,
            MountRow.variant: variant,
            MountRow.part_number: part_number,
            MountRow.serial: serial,
        }
        columns = (
            CampaignRow.name,
            MountRow.mount,
            MountRow.variant,
            MountRow.part_number,
            MountRow.supplier,
            MountRow.serial,
        )
        query = select(*columns).join(MountRow.campaign)
        for column, value in asked.items():
            if value is not None:
                query = query.where(column == value)
        with self._reading() as session:
            return tuple(sorted(MountIdentity(*row) for row in session.execute(query)))

    def find(
        self,
        *,
        campaign: str | None = None,
        mount: str | None = None,
        variant: str | None = None,
        part_number: str | None = None,
        serial: str | None = None,
    ) -> MountIdentity:
        """Return the one mount that is asked for, as `identities` does.

        Raises
        ------
        InputError
            None, or more than one: the candidates are named.
        """
        found = self.identities(
            campaign=campaign,
            mount=mount,
            variant=variant,
            part_number=part_number,
            serial=serial,
        )
        if len(found) == 1:
            return found[0]
        if found:
            raise InputError(
                f"{self.name}: {len(found)} mounts fit, say which one by its campaign, variant, "
                f"part number or serial: {_some(found)}"
            )
        there = self.identities()
        raise InputError(f"{self.name}: no such mount; there {_some(there) or 'is none at all'}")

    def load(self, identity: MountIdentity) -> CharacterisedMount:
        """Return a mount exactly as it was added.

        Raises
        ------
        InputError
            It is not in the library, or its arrays are damaged.
        """
        with self._reading() as session:
            row = session.scalar(_matching(select(MountRow), identity))
            if row is None:
                raise InputError(f"{self.name}: {identity} is not in the library")
            return mount_of(row)

    def add(
        self,
        campaigns: Sequence[CampaignRecord],
        mounts: Sequence[CharacterisedMount],
        *,
        replace: bool = False,
    ) -> None:
        """Import mounts and their campaigns: all of them, or after any failure none.

        Parameters
        ----------
        campaigns : sequence of CampaignRecord
            Those of the mounts. One that is there already, from the same files, is not made anew.
        mounts : sequence of CharacterisedMount
            Of these campaigns.
        replace : bool
            Whether a mount that is there already is exchanged, and a campaign of other content
            with all its mounts.

        Raises
        ------
        InputError
            A mount of another campaign or twice; without `replace`, a mount or another campaign of
            this name that is there already; a library that is locked or may not be written to.
        """
        campaigns, mounts = tuple(campaigns), tuple(mounts)
        _check_complete(campaigns, mounts)
        with self._database.writing() as session:
            check_version(session, self.name)
            parents = {
                campaign.name: self._campaign_row(session, campaign, replace)
                for campaign in campaigns
            }
            for value in mounts:
                there = session.scalar(_matching(select(MountRow.id), value.identity))
                if there is not None and not replace:
                    raise InputError(
                        f"{self.name}: {value.identity} is there already; replace it, or give the "
                        "new one another serial"
                    )
                session.execute(delete(MountRow).where(MountRow.id == there))
                session.add(mount_row(value, parents[value.identity.campaign]))
                session.flush()

    def _campaign_row(
        self, session: Session, campaign: CampaignRecord, replace: bool
    ) -> CampaignRow:
        named = select(CampaignRow).where(CampaignRow.name == campaign.name)
        there = session.scalars(named).one_or_none()
        if there is not None:
            if campaign_of(there) == campaign:
                return there
            if not replace:
                raise InputError(
                    f"{self.name}: there is another campaign {campaign.name}, of other files or "
                    "tolerances; replace it with all its mounts, or rename the new one"
                )
            session.delete(there)
            session.flush()
        row = campaign_row(campaign)
        session.add(row)
        return row

    @contextmanager
    def _reading(self) -> Iterator[Session]:
        with self._database.reading() as session:
            check_version(session, self.name)
            yield session


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
        There is no library, it is of another version, damaged, locked or cannot be reached.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_library(Path(folder) / "mounts.db", create=True) as library:
    ...         library.identities(mount="TSM")
    ()
    """
    place = database(where, create=create, timeout=timeout)
    with place.reading() as session:
        missing = create and stored_version(session) is None
    if missing:
        with place.writing() as session:
            if stored_version(session) is None:
                make_tables(session, place)
    with place.reading() as session:
        check_version(session, place.name)
    return MountLibrary(place)


def migrate_library(where: str | Path, *, timeout: float = TIMEOUT) -> tuple[int, int]:
    """Bring an older library to the version of this deboom, in one transaction.

    Parameters
    ----------
    where, timeout
        As for `open_library`.

    Returns
    -------
    before, after : int
        Versions; equal if there was nothing to do.

    Raises
    ------
    InputError
        There is no library, it is newer than this deboom, damaged, locked or cannot be reached.
    """
    place = database(where, create=False, timeout=timeout)
    with place.writing() as session:
        return migrate_tables(session, place.name)


def _matching(query: Select[T], identity: MountIdentity) -> Select[T]:
    return query.join(MountRow.campaign).where(
        CampaignRow.name == identity.campaign,
        MountRow.mount == identity.mount,
        MountRow.variant == identity.variant,
        MountRow.part_number == identity.part_number,
        MountRow.serial == identity.serial,
    )


def _check_complete(
    campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> None:
    names = [campaign.name for campaign in campaigns]
    # the supplier belongs to a part number, it does not tell mounts apart
    keys = [replace(value.identity, supplier="") for value in mounts]
    for value, key in zip(mounts, keys, strict=True):
        if names.count(value.identity.campaign) != 1:
            raise InputError(f"{value.identity}: its campaign must be imported with it, once")
        if keys.count(key) > 1:
            raise InputError(f"{value.identity} is to be imported twice; give each a serial")


def _some(identities: Sequence[MountIdentity]) -> str:
    more = f"; and {len(identities) - 4} more" if len(identities) > 4 else ""
    return "; ".join(str(identity) for identity in identities[:4]) + more
