"""Characterised mounts as tables for people and as one plain document (JSON).

Numbers of the document keep every digit; arrays carry type and shape; complex values are
``[real, imaginary]`` pairs, and what JSON cannot spell is ``"nan"``, ``"inf"`` or ``"-inf"``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any, TypeVar

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

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    D = TypeVar("D", bound=DataclassInstance)

FORMAT = "deboom mount library 1"

_KEYS = {
    "order": "engine_order [1]",
    "body_mass": "body_mass [kg]",
    "body_mass_tolerance": "body_mass_tolerance [kg]",
    "preload": "preload [N]",
    "wheel_torque": "wheel_torque [N m]",
    "amplitude": "amplitude [m]",
    "frequency": "frequency [Hz]",
    "dynamic_stiffness": "dynamic_stiffness [N/m]",
    "confidence": "confidence [1]",
    "deflection": "deflection [m]",
    "force": "force [N]",
    "force_uncertainty": "force_uncertainty [1]",
}
"""Keys of fields that have a unit; other fields are called as in their dataclass."""


def to_document(
    campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> dict[str, Any]:
    """Return mounts and their campaigns as plain dicts, lists, text and numbers."""
    return {
        "format": FORMAT,
        "campaigns": [_entry(campaign) for campaign in campaigns],
        "mounts": [
            {
                "identity": _entry(value.identity),
                **_entry(value.mount, "name", "pieces", "positions"),
                "pieces": [
                    {"name": name, "position [m]": [float(x) for x in position]}
                    for name, position in zip(
                        value.mount.pieces, value.mount.positions, strict=True
                    )
                ],
                "quality": dict(value.quality),
                "directions": [_direction(direction) for direction in value.directions],
            }
            for value in mounts
        ],
    }


def from_document(
    document: Any,
) -> tuple[tuple[CampaignRecord, ...], tuple[CharacterisedMount, ...]]:
    """Return campaigns and mounts exactly as they were given to `to_document`.

    - raises InputError: another format or version, an entry that is missing, unknown or of another
      kind.
    """
    stated = document.get("format") if isinstance(document, dict) else None
    if stated != FORMAT:
        raise InputError(f"its format is {stated!r}, and this deboom reads {FORMAT!r}")
    try:
        campaigns = tuple(_built(CampaignRecord, entry) for entry in document["campaigns"])
        mounts = tuple(_mount_of(entry) for entry in document["mounts"])
    except KeyError as error:
        raise InputError(f"the entry {error} is missing; export it again") from None
    except InputError:
        raise
    except (TypeError, ValueError, AttributeError) as error:
        raise InputError(f"an entry is of another kind ({error}); export it again") from None
    return campaigns, mounts


def _entry(value: DataclassInstance, *left_out: str) -> dict[str, Any]:
    """Fields of a dataclass as plain values by their keys."""
    names = [field.name for field in fields(value) if field.name not in left_out]
    return {_KEYS.get(name, name): _plain(getattr(value, name)) for name in names}


def _built(kind: type[D], entry: Mapping[str, Any], **known: Any) -> D:
    """Build a dataclass of its entry and of what is known otherwise."""
    keys = {f.name: _KEYS.get(f.name, f.name) for f in fields(kind) if f.name not in known}
    unknown = [key for key in entry if key not in keys.values()]
    if unknown:
        raise TypeError(f"{kind.__name__} has no entry {unknown}")
    return kind(**{name: _value(entry[key]) for name, key in keys.items()}, **known)


def _direction(direction: CharacterisedDirection) -> dict[str, Any]:
    """Entry of one direction."""
    surface, curve = direction.surface, direction.static_curve
    surface_entry = None
    if surface is not None:
        bounds = {"lower": surface.lower.tolist(), "upper": surface.upper.tolist()}
        surface_entry = _entry(surface) | bounds
    return {
        "axis": direction.axis,
        "quality": _entry(direction.quality),
        "map_points": _entry(direction.map_points),
        "surface": surface_entry,
        "static_curve": None if curve is None else _entry(curve, "mount", "axis"),
    }


def _mount_of(entry: Mapping[str, Any]) -> CharacterisedMount:
    """Mount of its entry."""
    identity = _built(MountIdentity, entry["identity"])
    x_y_z = [tuple(float(x) for x in piece["position [m]"]) for piece in entry["pieces"]]
    parts = ("identity", "transfer_axes", "pieces", "quality", "directions")
    mount = _built(
        Mount,
        {key: content for key, content in entry.items() if key not in parts},
        name=identity.mount,
        pieces=tuple(piece["name"] for piece in entry["pieces"]),
        positions=tuple((x, y, z) for x, y, z in x_y_z),
        transfer_axes=tuple(entry["transfer_axes"]),
    )
    directions = tuple(_direction_of(identity.mount, item) for item in entry["directions"])
    return CharacterisedMount(identity, mount, directions, entry["quality"])


def _direction_of(mount: str, entry: Mapping[str, Any]) -> CharacterisedDirection:
    axis, surface, curve = entry["axis"], entry["surface"], entry["static_curve"]
    return CharacterisedDirection(
        axis=axis,
        map_points=_built(MapPoints, entry["map_points"]),
        quality=_built(DirectionQuality, entry["quality"]),
        surface=None if surface is None else _built(FittedSurface, surface),
        static_curve=None if curve is None else _built(StaticCurve, curve, mount=mount, axis=axis),
    )


def _plain(value: Any) -> Any:
    """Value of a field as JSON keeps it."""
    if isinstance(value, Mapping):
        return {name: _plain(content) for name, content in value.items()}
    if isinstance(value, tuple):
        return [_plain(content) for content in value]
    if not isinstance(value, np.ndarray):
        return value.item() if isinstance(value, np.generic) else value
    flat = value.ravel()
    if value.dtype.kind == "c":
        pairs = zip(flat.real.tolist(), flat.imag.tolist(), strict=True)
        values: list[Any] = [[_spelled(re), _spelled(im)] for re, im in pairs]
    else:
        values = [_spelled(number) for number in flat.tolist()]
    return {"dtype": value.dtype.str, "shape": list(value.shape), "values": values}


def _spelled(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _value(content: Any) -> Any:
    """Value of a field out of what JSON kept; arrays are told by their keys."""
    if not isinstance(content, Mapping):
        return content
    if set(content) != {"dtype", "shape", "values"}:
        return {name: _value(item) for name, item in content.items()}
    dtype, values = np.dtype(content["dtype"]), content["values"]
    if dtype.kind not in "biufcU":
        raise InputError(f"an array is of {dtype}, not of numbers; export it again")
    if dtype.kind == "c":
        values = [complex(float(re), float(im)) for re, im in values]
    elif dtype.kind == "f":
        values = [float(value) for value in values]
    array: npt.NDArray[Any] = np.array(values, dtype=dtype).reshape(content["shape"])
    return array


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
        parts.append(pd.DataFrame({**start, **columns}))
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
            parts.append(pd.DataFrame({**start, **about, **columns}))
    return _stacked(parts)


def surface_table(mounts: Sequence[CharacterisedMount]) -> pd.DataFrame:
    """One row per number of a response surface: setting, or array with its index."""
    parts = []
    for start, direction in _directions(mounts):
        if direction.surface is None:
            continue
        about = start | {"surface": direction.surface.model}
        for name, value in direction.surface.settings.items():
            setting = {"kind": "setting", "name": name, "index": [""], "value": [value]}
            parts.append(pd.DataFrame(about | setting))
        for name, array in direction.surface.arrays.items():
            columns = {
                "kind": "array",
                "name": name,
                "index": [" ".join(map(str, index)) for index in np.ndindex(array.shape)],
                "value": array.real.ravel().tolist() if array.dtype.kind == "c" else array.ravel(),
            }
            if array.dtype.kind == "c":
                columns["imag"] = array.imag.ravel().tolist()
            parts.append(pd.DataFrame(about | columns))
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


def _stacked(parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    filled = [part for part in parts if len(part)]
    return pd.concat(filled, ignore_index=True) if filled else pd.DataFrame()
