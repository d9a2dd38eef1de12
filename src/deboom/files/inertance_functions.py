"""Matrices of FRFs and of coherences of a roving-hammer test, out of UFF files by their DoF."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.inertance_test_tables import PlacedImpact, PlacedSensor
from deboom.files.uff import UffFunction, read_uff

FRF, COHERENCE = 4, 6
"""UFF function types."""

FARTHEST_DIRECTION = 25.0
"""Between the direction in a UFF file and the one of the position sheet [deg]."""

_AXES = ("x", "y", "z")
_NAMES = {FRF: "FRF", COHERENCE: "coherence"}


@dataclass(frozen=True)
class Places:
    """The position sheets that give the nodes of a UFF file a meaning.

    Parameters
    ----------
    sensors : tuple of PlacedSensor
        Rows: three channels each.
    impacts : tuple of PlacedImpact
        Columns.
    """

    sensors: tuple[PlacedSensor, ...]
    impacts: tuple[PlacedImpact, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Such as ``A1 x``."""
        return tuple(f"{sensor.sensor} {axis}" for sensor in self.sensors for axis in _AXES)


def read_inertances(path: Path, places: Places) -> tuple[RealArray, ComplexArray]:
    """Read the FRFs from all impacts to all channels.

    Parameters
    ----------
    path : Path
        UFF file; functions of other types in it are left alone.
    places : Places
        Which node is what.

    Returns
    -------
    frequency : array, shape (f,)
        [Hz].
    values : array, shape (f, n_channel, n_impact)
        Along positive axes of the sensors [m/s² per N].

    Raises
    ------
    InputError
        An FRF that is missing, doubled, at an unknown node, of other lines, real, or of another
        unit than acceleration over force.
    """
    frequency, found = _matrix(path, places, FRF)
    for function, _ in found.values():
        if function.ordinate != "acceleration" or function.unit != "m/s^2/N":
            raise InputError(
                f"{path}: {function.dof}: it is {function.ordinate} in '{function.unit}': export "
                "acceleration per force with its units"
            )
        if not np.iscomplexobj(function.values):
            raise InputError(f"{path}: {function.dof}: it is real: phase is needed, export both")
    return frequency, np.asarray(_stacked(found, places, with_sign=True), dtype=np.complex128)


def read_coherences(path: Path, places: Places) -> tuple[RealArray, RealArray]:
    """Read the ordinary coherences of all channels and impacts.

    Parameters
    ----------
    path : Path
        UFF file; functions of other types in it are left alone.
    places : Places
        Which node is what.

    Returns
    -------
    frequency : array, shape (f,)
        [Hz].
    values : array, shape (f, n_channel, n_impact)
        [1].

    Raises
    ------
    InputError
        A coherence that is missing, doubled, at an unknown node, of other lines, complex, or
        outside 0 to 1.
    """
    frequency, found = _matrix(path, places, COHERENCE)
    for function, _ in found.values():
        values = function.values
        if np.iscomplexobj(values) or np.any((values < 0) | (values > 1 + 1e-6)):
            raise InputError(
                f"{path}: {function.dof}: a coherence is real and lies between 0 and 1; export it "
                "again"
            )
    values = np.minimum(_stacked(found, places, with_sign=False).real, 1.0)
    return frequency, np.asarray(values, dtype=np.float64)


_Found = dict[tuple[str, str], tuple[UffFunction, float]]


def _matrix(path: Path, places: Places, kind: int) -> tuple[RealArray, _Found]:
    """Find every function of one type; by channel and impact, with the sign of its direction."""
    functions = [function for function in read_uff(path) if function.function_type == kind]
    if not functions:
        raise InputError(f"{path} holds no {_NAMES[kind]} (UFF function type {kind}): export it")
    frequency = functions[0].abscissa
    found: _Found = {}
    for function in functions:
        if not np.array_equal(function.abscissa, frequency):
            raise InputError(f"{path}: {function.dof} has other lines than {functions[0].dof}")
        try:
            channel, sign = _channel(function, places)
            key = (channel, _impact(function, places))
            if key in found:
                raise InputError(
                    f"the {_NAMES[kind]} of {key[0]} to {key[1]} comes twice: keep one"
                )
        except InputError as error:
            raise InputError(f"{path}: {function.dof}: {error}") from None
        found[key] = function, sign
    for impact in places.impacts:
        for channel in places.channels:
            if (channel, impact.impact) not in found:
                raise InputError(
                    f"{path}: the {_NAMES[kind]} of {channel} to {impact.impact} (reference node "
                    f"{impact.node} {impact.uff_direction}) is missing: export it, or take the "
                    "sensor or the impact out of the position sheet"
                )
    return frequency, found


def _stacked(found: _Found, places: Places, *, with_sign: bool) -> ComplexArray:
    rows = []
    for channel in places.channels:
        pairs = [found[channel, impact.impact] for impact in places.impacts]
        rows.append([f.values * (sign if with_sign else 1.0) for f, sign in pairs])
    return np.moveaxis(np.array(rows, dtype=np.complex128), 2, 0)


def _channel(function: UffFunction, places: Places) -> tuple[str, float]:
    """Name of the response channel, and −1 where it was recorded against its axis."""
    direction = function.response_direction
    for sensor in places.sensors:
        if sensor.node == function.response_node:
            if direction[1:] not in _AXES:
                raise InputError(
                    f"its direction is {direction}: export the sensor's axis, such as +x"
                )
            return f"{sensor.sensor} {direction[1:]}", -1.0 if direction[0] == "-" else 1.0
    raise InputError(
        f"node {function.response_node} is no sensor of the position sheet: add it there, or "
        "export without it"
    )


def _impact(function: UffFunction, places: Places) -> str:
    direction = function.reference_direction
    there = [one for one in places.impacts if one.node == function.reference_node]
    if not there:
        raise InputError(
            f"reference node {function.reference_node} is no impact of the position sheet: add it "
            "there, or export without it"
        )
    if direction == "scalar" and len(there) == 1:
        return there[0].impact
    for impact in there:
        if _agree(direction, impact.direction):
            return impact.impact
    stated = " or ".join(str(one.direction) for one in there)
    raise InputError(
        f"the force is recorded along {direction}, the position sheet says {stated}: correct the "
        "wrong one"
    )


def _agree(direction: str, vector: Sequence[float]) -> bool:
    if direction[1:] not in _AXES:
        return False
    along = (-1.0 if direction[0] == "-" else 1.0) * vector[_AXES.index(direction[1:])]
    return along > math.cos(math.radians(FARTHEST_DIRECTION))
