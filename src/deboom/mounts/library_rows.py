"""Characterised mounts as rows of the library's tables, and back."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from deboom.measurement.campaign import StaticCurve
from deboom.mounts.characterised_direction import (
    CharacterisedDirection,
    DirectionQuality,
    FittedSurface,
    MapPoints,
)
from deboom.mounts.characterised_mount import CampaignRecord, CharacterisedMount, MountIdentity
from deboom.mounts.library_schema import (
    CampaignRow,
    DirectionRow,
    MapRow,
    MountRow,
    PieceRow,
    StaticCurveRow,
    SurfaceRow,
)
from deboom.mounts.mount import Mount
from deboom.mounts.named_arrays import from_arrays, to_arrays


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
