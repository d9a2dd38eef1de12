"""Characterised mounts as tables for people and spreadsheets, units in the column names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from deboom.mounts.characterised_direction import CharacterisedDirection, FittedSurface
from deboom.mounts.characterised_mount import CampaignRecord, CharacterisedMount, MountIdentity

Row = dict[str, Any]


def campaign_table(campaigns: Sequence[CampaignRecord]) -> pd.DataFrame:
    """One row per campaign and tolerance; a campaign without tolerances has one row."""
    return pd.DataFrame(
        [
            {
                "campaign": campaign.name,
                "engine_order [1]": campaign.order,
                "runs": len(campaign.runs),
                "tolerance": name,
                "value": value,
            }
            for campaign in campaigns
            for name, value in campaign.tolerances.items() or [("", None)]
        ]
    )


def identity_table(identities: Sequence[MountIdentity]) -> pd.DataFrame:
    """One row per mount: which part, from what."""
    return pd.DataFrame([asdict(identity) for identity in identities])


def mount_table(mounts: Sequence[CharacterisedMount]) -> pd.DataFrame:
    """One row per mount and piece: identity and virtual point."""
    return pd.DataFrame(
        [
            {
                **asdict(value.identity),
                "description": value.mount.description,
                "transfer_axes": " ".join(value.mount.transfer_axes),
                "body_mass [kg]": value.mount.body_mass,
                "body_mass_tolerance [kg]": value.mount.body_mass_tolerance,
                "piece": piece,
                "x [m]": x,
                "y [m]": y,
                "z [m]": z,
            }
            for value in mounts
            for piece, (x, y, z) in zip(value.mount.pieces, value.mount.positions, strict=True)
        ]
    )


def quality_table(mounts: Sequence[CharacterisedMount]) -> pd.DataFrame:
    """One row per number that was kept of a whole mount; its name ends with its unit."""
    return pd.DataFrame(
        [
            {**asdict(value.identity), "quality": name, "value": number}
            for value in mounts
            for name, number in value.quality.items()
        ]
    )


def direction_table(mounts: Sequence[CharacterisedMount]) -> pd.DataFrame:
    """One row per direction: how far to believe it, and the training range of its surface."""
    rows = []
    for start, direction in _directions(mounts):
        surface, curve = direction.surface, direction.static_curve
        row: Row = {**start, "map_points": len(direction.map_points)}
        row |= {
            name if name == "identified" else f"{name} [1]": value
            for name, value in asdict(direction.quality).items()
        }
        row["static_curve_points"] = 0 if curve is None else curve.deflection.size
        row["surface"] = "" if surface is None else surface.model
        rows.append(row | ({} if surface is None else _ranges(surface)))
    return pd.DataFrame(rows)


def map_table(mounts: Sequence[CharacterisedMount]) -> pd.DataFrame:
    """One row per map point: dynamic stiffness over preload, amplitude and frequency."""
    parts = []
    for start, direction in _directions(mounts):
        points = direction.map_points
        columns = {
            "run": points.run,
            "preload [N]": points.preload,
            "wheel_torque [N m]": points.wheel_torque,
            "amplitude [m]": points.amplitude,
            "frequency [Hz]": points.frequency,
            "dynamic_stiffness_real [N/m]": points.dynamic_stiffness.real,
            "dynamic_stiffness_imag [N/m]": points.dynamic_stiffness.imag,
            "confidence [1]": points.confidence,
        }
        parts.append(_long(start, columns))
    return _stacked(parts)


def static_curve_table(mounts: Sequence[CharacterisedMount]) -> pd.DataFrame:
    """One row per point of a quasi-static curve."""
    parts = []
    for start, direction in _directions(mounts):
        curve = direction.static_curve
        if curve is not None:
            columns = {"deflection [m]": curve.deflection, "force [N]": curve.force}
            about = {
                "mount_set": curve.mount_set,
                "force_uncertainty [1]": curve.force_uncertainty,
            }
            parts.append(_long(start | about, columns))
    return _stacked(parts)


def surface_table(mounts: Sequence[CharacterisedMount]) -> pd.DataFrame:
    """One row per number of a response surface: setting, or array with its index."""
    parts = []
    for start, direction in _directions(mounts):
        if direction.surface is None:
            continue
        about = start | {"surface": direction.surface.model}
        for name, value in direction.surface.settings.items():
            parts.append(
                _long(about | {"kind": "setting", "name": name}, {"index": [""], "value": [value]})
            )
        for name, array in direction.surface.arrays.items():
            columns = {
                "index": [" ".join(map(str, index)) for index in np.ndindex(array.shape)],
                "value": array.real.ravel().tolist() if array.dtype.kind == "c" else array.ravel(),
            }
            if array.dtype.kind == "c":
                columns["imag"] = array.imag.ravel().tolist()
            parts.append(_long(about | {"kind": "array", "name": name}, columns))
    return _stacked(parts)


def _directions(
    mounts: Sequence[CharacterisedMount],
) -> Iterator[tuple[Row, CharacterisedDirection]]:
    for value in mounts:
        for direction in value.directions:
            yield {**asdict(value.identity), "axis": direction.axis}, direction


def _ranges(surface: FittedSurface) -> Row:
    return {
        f"{name}_{end} [{unit}]": float(bound)
        for i, (name, unit) in enumerate(zip(surface.variables, surface.units, strict=True))
        for end, bound in (("lower", surface.lower[i]), ("upper", surface.upper[i]))
    }


def _long(start: Row, columns: dict[str, Any]) -> pd.DataFrame:
    table = pd.DataFrame(columns)
    for place, (name, value) in enumerate(start.items()):
        table.insert(place, name, value)
    return table


def _stacked(parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    filled = [part for part in parts if len(part)]
    return pd.concat(filled, ignore_index=True) if filled else pd.DataFrame()
