"""Characterised mounts as tables for people and as one plain document (JSON)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.characterised_mount import (
    CampaignRecord,
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    FittedSurface,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.mount import Mount

FORMAT = "deboom mount library 1"
_MAP_KEYS = {
    "preload": "preload [N]",
    "wheel_torque": "wheel_torque [N m]",
    "amplitude": "amplitude [m]",
    "frequency": "frequency [Hz]",
    "dynamic_stiffness": "dynamic_stiffness [N/m]",
    "confidence": "confidence [1]",
    "run": "run",
}


def to_document(
    campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> dict[str, Any]:
    """Return mounts and their campaigns as plain dicts, lists, text and numbers.

    Parameters
    ----------
    campaigns : sequence of CampaignRecord
        Those of the mounts.
    mounts : sequence of CharacterisedMount
        What to write.
    """
    return {
        "format": FORMAT,
        "campaigns": [
            {
                "name": campaign.name,
                "engine_order [1]": campaign.order,
                "runs": list(campaign.runs),
                "tolerances": dict(campaign.tolerances),
                "inputs_sha256": dict(campaign.inputs_sha256),
            }
            for campaign in campaigns
        ],
        "mounts": [_mount(value) for value in mounts],
    }


def from_document(
    document: Any,
) -> tuple[tuple[CampaignRecord, ...], tuple[CharacterisedMount, ...]]:
    """Return campaigns and mounts exactly as they were given to `to_document`.

    Raises
    ------
    InputError
        Another format or version, an entry that is missing or of another kind.
    """
    stated = document.get("format") if isinstance(document, dict) else None
    if stated != FORMAT:
        raise InputError(f"its format is {stated!r}, and this deboom reads {FORMAT!r}")
    try:
        campaigns = tuple(_campaign_of(entry) for entry in document["campaigns"])
        mounts = tuple(_mount_of(entry) for entry in document["mounts"])
    except KeyError as error:
        raise InputError(f"the entry {error} is missing; export it again") from None
    except InputError:
        raise
    except (TypeError, ValueError, AttributeError) as error:
        raise InputError(f"an entry is of another kind ({error}); export it again") from None
    return campaigns, mounts


def _campaign_of(entry: Mapping[str, Any]) -> CampaignRecord:
    return CampaignRecord(
        entry["name"],
        entry["engine_order [1]"],
        tuple(entry["runs"]),
        entry["tolerances"],
        entry["inputs_sha256"],
    )


def _mount(value: CharacterisedMount) -> dict[str, Any]:
    mount = value.mount
    return {
        "identity": asdict(value.identity),
        "description": mount.description,
        "transfer_axes": list(mount.transfer_axes),
        "body_mass [kg]": mount.body_mass,
        "body_mass_tolerance [kg]": mount.body_mass_tolerance,
        "pieces": [
            {"name": name, "position [m]": [float(x) for x in position]}
            for name, position in zip(mount.pieces, mount.positions, strict=True)
        ],
        "quality": dict(value.quality),
        "directions": [_direction(direction) for direction in value.directions],
    }


def _mount_of(entry: Mapping[str, Any]) -> CharacterisedMount:
    identity = MountIdentity(**entry["identity"])
    x_y_z = [tuple(float(x) for x in piece["position [m]"]) for piece in entry["pieces"]]
    mount = Mount(
        name=identity.mount,
        description=entry["description"],
        pieces=tuple(piece["name"] for piece in entry["pieces"]),
        positions=tuple((x, y, z) for x, y, z in x_y_z),
        transfer_axes=tuple(entry["transfer_axes"]),
        body_mass=entry["body_mass [kg]"],
        body_mass_tolerance=entry["body_mass_tolerance [kg]"],
    )
    directions = tuple(_direction_of(identity.mount, item) for item in entry["directions"])
    return CharacterisedMount(identity, mount, directions, entry["quality"])


def _direction(direction: CharacterisedDirection) -> dict[str, Any]:
    surface, curve = direction.surface, direction.static_curve
    points = {key: _array(getattr(direction.map_points, f)) for f, key in _MAP_KEYS.items()}
    return {
        "axis": direction.axis,
        "quality": asdict(direction.quality),
        "map_points": points,
        "surface": None if surface is None else _surface(surface),
        "static_curve": None
        if curve is None
        else {
            "mount_set": curve.mount_set,
            "force_uncertainty [1]": float(curve.force_uncertainty),
            "deflection [m]": _array(curve.deflection),
            "force [N]": _array(curve.force),
        },
    }


def _direction_of(mount: str, entry: Mapping[str, Any]) -> CharacterisedDirection:
    axis, surface, curve = entry["axis"], entry["surface"], entry["static_curve"]
    points = {field: _array_of(entry["map_points"][key]) for field, key in _MAP_KEYS.items()}
    return CharacterisedDirection(
        axis=axis,
        map_points=MapPoints(**points),
        quality=DirectionQuality(**entry["quality"]),
        surface=None if surface is None else _surface_of(surface),
        static_curve=None
        if curve is None
        else StaticCurve(
            mount=mount,
            axis=axis,
            mount_set=curve["mount_set"],
            deflection=_array_of(curve["deflection [m]"]),
            force=_array_of(curve["force [N]"]),
            force_uncertainty=curve["force_uncertainty [1]"],
        ),
    )


def _surface(surface: FittedSurface) -> dict[str, Any]:
    return {
        "model": surface.model,
        "variables": list(surface.variables),
        "units": list(surface.units),
        "lower": surface.lower.tolist(),
        "upper": surface.upper.tolist(),
        "settings": dict(surface.settings),
        "arrays": {name: _array(array) for name, array in surface.arrays.items()},
    }


def _surface_of(entry: Mapping[str, Any]) -> FittedSurface:
    return FittedSurface(
        model=entry["model"],
        variables=tuple(entry["variables"]),
        units=tuple(entry["units"]),
        lower=np.array(entry["lower"], dtype=float),
        upper=np.array(entry["upper"], dtype=float),
        arrays={name: _array_of(array) for name, array in entry["arrays"].items()},
        settings=entry["settings"],
    )


def _array(array: npt.NDArray[Any]) -> dict[str, Any]:
    flat = array.ravel()
    if array.dtype.kind == "c":
        pairs = zip(flat.real.tolist(), flat.imag.tolist(), strict=True)
        values: list[Any] = [[_spelled(re), _spelled(im)] for re, im in pairs]
    else:
        values = [_spelled(value) for value in flat.tolist()]
    return {"dtype": array.dtype.str, "shape": list(array.shape), "values": values}


def _array_of(entry: Mapping[str, Any]) -> npt.NDArray[Any]:
    dtype, values = np.dtype(entry["dtype"]), entry["values"]
    if dtype.kind not in "biufcU":
        raise InputError(f"an array is of {dtype}, not of numbers; export it again")
    if dtype.kind == "c":
        values = [complex(float(re), float(im)) for re, im in values]
    elif dtype.kind == "f":
        values = [float(value) for value in values]
    return np.array(values, dtype=dtype).reshape(entry["shape"])


def _spelled(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


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
