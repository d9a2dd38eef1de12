"""Characterised mounts as tables for people and as one plain document (JSON).

Numbers of the document keep every digit; arrays carry type and shape; complex values are
``[real, imaginary]`` pairs, and what JSON cannot spell is ``"nan"``, ``"inf"`` or ``"-inf"``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.characterised_mount import (
    CampaignRecord,
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.mount import Mount
from deboom.mounts.response_surface import VARIABLES, DynamicStiffnessSurface

if TYPE_CHECKING:
    import pandas as pd
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
    "test_temperature": "test_temperature [°C]",
}
"""Keys of fields that have a unit; other fields are called as in their dataclass."""


def to_document(
    campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> dict[str, Any]:
    """Return mounts and their campaigns as plain dicts, lists, text and numbers."""
    return {
        "format": FORMAT,
        "campaigns": [campaign_entry(campaign) for campaign in campaigns],
        "mounts": [mount_entry(value) for value in mounts],
    }


@contextmanager
def _refused_by_name() -> Iterator[None]:
    """Say which entry is not as it was written."""
    try:
        yield
    except KeyError as error:
        raise InputError(f"the entry {error} is missing; export it again") from None
    except InputError:
        raise
    except (TypeError, ValueError, AttributeError, SyntaxError, OverflowError) as error:
        raise InputError(f"an entry is of another kind ({error}); export it again") from None


@_refused_by_name()
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
    campaigns, mounts = document["campaigns"], document["mounts"]
    return tuple(map(campaign_of, campaigns)), tuple(map(mount_of, mounts))


@_refused_by_name()
def campaign_of(entry: Mapping[str, Any]) -> CampaignRecord:
    """Return the campaign of its entry; InputError names what is wrong with it."""
    return _built(CampaignRecord, {_KEYS["test_temperature"]: None} | dict(entry))


def campaign_entry(campaign: CampaignRecord) -> dict[str, Any]:
    """Return a campaign as plain values, its temperature where it is stated."""
    unknown = campaign.test_temperature is None
    return entry(campaign, *(["test_temperature"] if unknown else []))


def mount_entry(value: CharacterisedMount) -> dict[str, Any]:
    """Return a mount as plain values."""
    mount = value.mount
    pieces = [
        {"name": name, "position [m]": [*map(float, position)]}
        | ({"rotation [rad]": [*map(float, angles)]} if any(angles) else {})
        for name, position, angles in zip(
            mount.pieces, mount.positions, mount.rotations, strict=True
        )
    ]
    return {
        "identity": entry(value.identity),
        # brackets and the state of the rubber belong to a car, not to the part
        **entry(
            mount,
            "name",
            "pieces",
            "positions",
            "rotations",
            "brackets",
            "rubber",
            "description_de",
        ),
        "pieces": pieces,
        "quality": dict(value.quality),
        "directions": [_direction(direction) for direction in value.directions],
    }


def entry(value: DataclassInstance, *left_out: str) -> dict[str, Any]:
    """Return the fields of a dataclass as plain values by their keys, which state the units."""
    names = [field.name for field in fields(value) if field.name not in left_out]
    return {key: _stored(content) for key, content in _labelled(value, *names).items()}


def _built(kind: type[D], entry: Mapping[str, Any], **given: Any) -> D:
    """Build a dataclass of its entry and of what is known otherwise."""
    keys = {f.name: _KEYS.get(f.name, f.name) for f in fields(kind) if f.name not in given}
    unknown = [key for key in entry if key not in keys.values()]
    if unknown:
        raise TypeError(f"{kind.__name__} has no entry {unknown}")
    return kind(**{name: _value(entry[key]) for name, key in keys.items()}, **given)


def _direction(direction: CharacterisedDirection) -> dict[str, Any]:
    """Entry of one direction."""
    curve = direction.static_curve
    return {
        "axis": direction.axis,
        "quality": entry(direction.quality),
        "map_points": entry(direction.map_points),
        "surface": None if direction.surface is None else _surface(direction),
        "static_curve": None if curve is None else entry(curve, "mount", "axis"),
    }


def _surface(direction: CharacterisedDirection) -> dict[str, Any]:
    """Entry of a response surface: what it is a function of, and everything that it needs."""
    surface = direction.surface
    assert surface is not None
    names, units = _axes(surface)
    return {
        "model": type(surface).__name__,
        "variables": names,
        "units": units,
        "lower": surface.region_.lower.tolist(),
        "upper": surface.region_.upper.tolist(),
        "arrays": _stored(surface.to_arrays()),
        "settings": dict(direction.settings),
    }


def _axes(surface: DynamicStiffnessSurface) -> tuple[list[str], list[str]]:
    """Names and SI units of a surface's variables."""
    preload = "wheel_torque" if surface.preload_unit == "N m" else "preload"
    return [preload, *VARIABLES[1:]], [surface.units[name] for name in VARIABLES]


def _surface_of(entry: Mapping[str, Any]) -> DynamicStiffnessSurface:
    if entry["model"] != DynamicStiffnessSurface.__name__:
        raise InputError(
            f"a surface of model {entry['model']} cannot be built, only "
            f"{DynamicStiffnessSurface.__name__}: characterise the mount again"
        )
    return DynamicStiffnessSurface.from_arrays(_value(entry["arrays"]))


@_refused_by_name()
def mount_of(entry: Mapping[str, Any]) -> CharacterisedMount:
    """Return the mount of its entry; InputError names what is wrong with it."""
    identity = _built(MountIdentity, entry["identity"])
    upright = [0.0, 0.0, 0.0]
    x_y_z = [tuple(float(x) for x in piece["position [m]"]) for piece in entry["pieces"]]
    turns = [tuple(map(float, p.get("rotation [rad]", upright))) for p in entry["pieces"]]
    parts = ("identity", "transfer_axes", "pieces", "quality", "directions")
    mount = _built(
        Mount,
        {key: content for key, content in entry.items() if key not in parts},
        name=identity.mount,
        pieces=tuple(piece["name"] for piece in entry["pieces"]),
        positions=tuple((x, y, z) for x, y, z in x_y_z),
        rotations=tuple((rx, ry, rz) for rx, ry, rz in turns),
        transfer_axes=tuple(entry["transfer_axes"]),
        brackets=(),
        rubber=None,
        description_de="",
    )
    directions = tuple(_direction_of(identity.mount, item) for item in entry["directions"])
    return CharacterisedMount(identity, mount, directions, entry["quality"])


def _direction_of(mount: str, entry: Mapping[str, Any]) -> CharacterisedDirection:
    axis, surface, curve = entry["axis"], entry["surface"], entry["static_curve"]
    return CharacterisedDirection(
        axis=axis,
        map_points=_built(MapPoints, entry["map_points"]),
        quality=_built(DirectionQuality, entry["quality"]),
        surface=None if surface is None else _surface_of(surface),
        settings={} if surface is None else surface["settings"],
        static_curve=None if curve is None else _built(StaticCurve, curve, mount=mount, axis=axis),
    )


def _stored(value: Any) -> Any:
    """Value of a field as JSON keeps it."""
    if isinstance(value, Mapping):
        return {name: _stored(content) for name, content in value.items()}
    if isinstance(value, tuple):
        return [_stored(content) for content in value]
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
_TURNS = ("rx [rad]", "ry [rad]", "rz [rad]")
"""Rotations of a piece, about the fixed axes x, then y, then z; only of libraries that have any."""


def export_tables(
    campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> dict[str, pd.DataFrame]:
    """Return what is kept as tables by their names; headers and names end with SI units.

    Response surfaces are not: nobody reads their coefficients.
    """
    import pandas as pd

    tilted = any(value.mount.tilted_pieces for value in mounts)
    tables = {
        "campaigns": [
            {
                "campaign": campaign.name,
                "engine_order [1]": campaign.order,
                "runs": len(campaign.runs),
                "tolerance": name,
                "value": value,
            }
            for campaign in campaigns
            for name, value in campaign.tolerances.items() or [("", None)]
        ],
        "mounts": [
            {
                **asdict(value.identity),
                "description": value.mount.description,
                "transfer_axes": " ".join(value.mount.transfer_axes),
                **_labelled(value.mount, "body_mass", "body_mass_tolerance"),
                "piece": piece,
                **dict(zip(("x [m]", "y [m]", "z [m]"), position, strict=True)),
                **(dict(zip(_TURNS, angles, strict=True)) if tilted else {}),
            }
            for value in mounts
            for piece, position, angles in zip(
                value.mount.pieces, value.mount.positions, value.mount.rotations, strict=True
            )
        ],
        "quality": [
            {**asdict(value.identity), "quality": name, "value": number}
            for value in mounts
            for name, number in value.quality.items()
        ],
    }
    frames = {name: pd.DataFrame(rows) for name, rows in tables.items()}
    frames["directions"] = direction_table(mounts)
    parts: dict[str, list[Row]] = {"map_points": [], "static_curves": []}
    for start, direction in _directions(mounts):
        points, curve = direction.map_points, direction.static_curve
        if len(points):
            stiffness = points.dynamic_stiffness
            columns = _labelled(points, "run", "preload", "wheel_torque", "amplitude", "frequency")
            columns["dynamic_stiffness_real [N/m]"] = stiffness.real
            columns["dynamic_stiffness_imag [N/m]"] = stiffness.imag
            parts["map_points"].append(start | columns | _labelled(points, "confidence"))
        if curve is not None:
            names = ("mount_set", "force_uncertainty", "deflection", "force")
            parts["static_curves"].append(start | _labelled(curve, *names))
    for name, rows in parts.items():
        filled = [pd.DataFrame(row) for row in rows]
        frames[name] = pd.concat(filled, ignore_index=True) if filled else pd.DataFrame()
    return frames


def _labelled(value: DataclassInstance, *names: str) -> Row:
    """Fields of a dataclass by their keys."""
    return {_KEYS.get(name, name): getattr(value, name) for name in names}


def direction_table(mounts: Sequence[CharacterisedMount]) -> pd.DataFrame:
    """One row per direction: how far to believe it, and the training range of its surface."""
    import pandas as pd

    rows = []
    for start, direction in _directions(mounts):
        surface, curve = direction.surface, direction.static_curve
        row: Row = {**start, "map_points": len(direction.map_points)}
        row |= {
            name if name == "identified" else f"{name} [1]": value
            for name, value in asdict(direction.quality).items()
        }
        row["static_curve_points"] = 0 if curve is None else curve.deflection.size
        row["surface"] = "" if surface is None else type(surface).__name__
        if surface is not None:
            for *axis, ends in zip(*_axes(surface), surface.ranges.values(), strict=True):
                for side, end in zip(("lower", "upper"), ends, strict=True):
                    row[f"{axis[0]}_{side} [{axis[1]}]"] = end
        rows.append(row)
    return pd.DataFrame(rows)


def _directions(
    mounts: Sequence[CharacterisedMount],
) -> Iterator[tuple[Row, CharacterisedDirection]]:
    for value in mounts:
        for direction in value.directions:
            yield {**asdict(value.identity), "axis": direction.axis}, direction
