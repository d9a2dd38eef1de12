"""Tables of the mount library, their units, and the steps from older versions to this one."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from sqlalchemy import JSON, Connection, Dialect, ForeignKey, LargeBinary, String, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship
from sqlalchemy.types import TypeDecorator

from deboom.errors import InputError
from deboom.mounts.named_arrays import NamedArrays
from deboom.mounts.stored_values import LONGEST_TEXT

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
