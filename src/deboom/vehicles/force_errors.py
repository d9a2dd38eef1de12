"""What may be wrong with the forces and motions of the runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from deboom.arrays import RealArray
from deboom.mounts.mount import AXES
from deboom.vehicles.uncertainty_source import MeasuredArrays, complex_normals, refuse_negative


@dataclass(frozen=True, eq=False)
class StiffnessError:
    """Dynamic stiffness of each direction: a common gain and turn of all its lines.

    Alignment and calibration of the characterisation are the same at all lines and in all load
    cases, so their error is as well; all pieces of a mount share it.

    Parameters
    ----------
    magnitude : mapping of str to float
        Direction ``<mount> <axis>`` → standard deviation of ln |K| [1].
    channels : mapping of str to tuple of str
        Direction → channels of its pieces.
    loss_factor : float
        Of the mounts: Re K and Im K err alike by the magnitude, and independently by as much, so
        the phase of K by ``√2`` loss factor times the magnitude's [1].
    origin : str
        Where they come from.
    name : str
        Of this share of the budget.
    """

    magnitude: Mapping[str, float]
    channels: Mapping[str, tuple[str, ...]]
    loss_factor: float
    origin: str
    name: str = "stiffness of the mounts"

    def __post_init__(self) -> None:
        for direction, deviation in self.magnitude.items():
            refuse_negative(f"{self.name}, {direction}", deviation)
        refuse_negative("loss factor", self.loss_factor)
        for name in ("magnitude", "channels"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @property
    def size(self) -> str:
        """Standard deviation in words."""
        return _range_of(self.magnitude)

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""
        turn = 1j * np.sqrt(2.0) * self.loss_factor
        gain = np.ones(len(data.channels), dtype=complex)
        for direction, deviation in self.magnitude.items():
            along, across = generator.standard_normal(2)
            own = np.isin(data.channels, self.channels[direction])
            gain[own] = np.exp(deviation * (along + turn * across))
        return replace(data, force=data.force * gain)


@dataclass(frozen=True, eq=False)
class ForceCells:
    """Measured forces: gain of each axis of a cell, and leakage by the angle of the shaker.

    Parameters
    ----------
    gain : mapping of str to float
        Point ``<mount> [<piece>]`` → standard deviation of each axis' gain [1].
    angle : mapping of str to float
        Point → of the shaker that calibrates its cell, per pair of axes [rad].
    channels : tuple of str
        That err; the others only leak.
    origin : str
        Where they come from.
    """

    gain: Mapping[str, float]
    angle: Mapping[str, float]
    channels: tuple[str, ...]
    origin: str
    name: str = "force cells and shaker"

    def __post_init__(self) -> None:
        _check_points(self, "gain", "angle")

    @property
    def size(self) -> str:
        """Standard deviation in words."""
        angles = {point: np.rad2deg(angle) for point, angle in self.angle.items()}
        return f"gain {_range_of(self.gain)}, shaker up to {max(angles.values(), default=0):.2g}°"

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""
        mixing = _mixing(data.channels, self.channels, self.gain, self.angle, generator)
        return replace(data, force=data.force + data.force @ mixing.T)


@dataclass(frozen=True, eq=False)
class MotionError:
    """Measured motion of the mounts, and with it the forces that surfaces make of it.

    Parameters
    ----------
    gain, leakage : mapping of str to float
        Point ``<mount> [<piece>]`` → standard deviation of each axis' gain, and of what each other
        axis leaks into it [1].
    surface_channels : tuple of str
        Whose force is stiffness times motion; measured forces stay.
    origin : str
        Where they come from.
    """

    gain: Mapping[str, float]
    leakage: Mapping[str, float]
    surface_channels: tuple[str, ...]
    origin: str
    name: str = "motion in the runs"

    def __post_init__(self) -> None:
        _check_points(self, "gain", "leakage")

    @property
    def size(self) -> str:
        """Standard deviation in words."""
        return f"gain {_range_of(self.gain)}, other axes {_range_of(self.leakage)}"

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""
        mixing = _mixing(data.channels, data.channels, self.gain, self.leakage, generator)
        moved = data.displacement @ mixing.T
        from_surface = np.isin(data.channels, self.surface_channels)
        moves = (np.abs(data.displacement) > 0.0) & from_surface
        relative = np.divide(moved, data.displacement, out=np.zeros_like(moved), where=moves)
        return replace(
            data,
            displacement=data.displacement + moved,
            force=data.force * (1.0 + relative),
        )


@dataclass(frozen=True)
class RunNoise:
    """Order-tracking noise of the forces, line by line, another one in every load case.

    Parameters
    ----------
    relative : float
        Root mean square of the complex error [1].
    origin : str
        Where it comes from.
    """

    relative: float
    origin: str
    name: str = "noise of the runs"

    def __post_init__(self) -> None:
        refuse_negative(self.name, self.relative)

    @property
    def size(self) -> str:
        """Standard deviation in words."""
        return f"{100 * self.relative:.2g} % per line"

    def measured_again(
        self, data: MeasuredArrays, generator: np.random.Generator
    ) -> MeasuredArrays:
        """Return the data with one draw of this error."""
        noise = self.relative * complex_normals(data.force.shape, generator)
        return replace(data, force=data.force * (1.0 + noise))


def point_of(channel: str) -> str:
    """Return ``<mount> [<piece>]`` of a channel."""
    return channel.rpartition(" ")[0]


def _mixing(
    channels: Sequence[str],
    erring: Sequence[str],
    gain: Mapping[str, float],
    leakage: Mapping[str, float],
    generator: np.random.Generator,
) -> RealArray:
    """Draw what each channel gets of itself and of the other axes of its point, beyond itself."""
    matrix = np.zeros((len(channels), len(channels)))
    normals = generator.standard_normal((len(channels), len(AXES)))
    for row, channel in enumerate(channels):
        point = point_of(channel)
        for column, other in enumerate(channels):
            if channel in erring and point_of(other) == point:
                deviation = (gain if row == column else leakage).get(point, 0.0)
                matrix[row, column] = deviation * normals[row, AXES.index(other[-1])]
    return matrix


def _check_points(source: ForceCells | MotionError, *names: str) -> None:
    for name in names:
        of_points = dict(getattr(source, name))
        for point, deviation in of_points.items():
            refuse_negative(f"{source.name}, {name} of {point}", deviation)
        object.__setattr__(source, name, MappingProxyType(of_points))


def _range_of(deviations: Mapping[str, float]) -> str:
    if not deviations:
        return "none"
    low, high = 100 * min(deviations.values()), 100 * max(deviations.values())
    return f"{low:.2g} %" if low == high else f"{low:.2g} to {high:.2g} %"
