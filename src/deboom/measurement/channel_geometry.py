"""What each channel of one rigid body sees: its lever from a virtual point and its direction.

A channel that measures motion and one that measures a force have the same row ``dᵀ [I, skew(r)ᵀ]``:
it maps the motion of the body to the channel, and transposed the force to a load on the body.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.impacts import Impact
from deboom.measurement.sensors import Sensor
from deboom.physics.rigid_body import forward_matrices

RIGID_MOTIONS = ("x", "y", "z", "rx", "ry", "rz")
RIGID_LOADS = ("fx", "fy", "fz", "mx", "my", "mz")
ORIGIN = (0.0, 0.0, 0.0)
NO_WEIGHTS: Mapping[str, float] = MappingProxyType({})
NO_MODES: Mapping[str, npt.ArrayLike] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class ChannelGeometry:
    """Channels on one body, seen from a virtual point.

    Parameters
    ----------
    position : array, shape (3,)
        Of the virtual point, from the origin of the position sheet [m].
    channels : sequence of str
        Names of the n channels in use.
    owners : sequence of str, length n
        Sensor or impact that each channel belongs to.
    levers : array, shape (n, 3)
        Position of each channel, from the virtual point [m].
    directions : array, shape (n, 3)
        Unit vector that each channel measures along [1].
    weights : array, shape (n,)
        Of the squared residual of each channel; 1 / variance, in any common unit.
    mode_names : sequence of str
        Names of the flexible modes beside the six rigid motions.
    mode_shapes : array, shape (n, len(mode_names))
        What each channel sees of a unit of each flexible mode.

    Raises
    ------
    InputError
        Shapes that disagree, doubled names, or weights that are not positive.
    """

    position: RealArray
    channels: tuple[str, ...]
    owners: tuple[str, ...]
    levers: RealArray
    directions: RealArray
    weights: RealArray
    mode_names: tuple[str, ...]
    mode_shapes: RealArray

    def __post_init__(self) -> None:
        for name in ("channels", "owners", "mode_names"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        n, k = len(self.channels), len(self.mode_names)
        for name, shape in (
            ("position", (3,)),
            ("levers", (n, 3)),
            ("directions", (n, 3)),
            ("weights", (n,)),
            ("mode_shapes", (n, k)),
        ):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise InputError(
                    f"channel geometry: {name} needs finite numbers of shape {shape}, "
                    f"not {array.shape}"
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if len(self.owners) != n:
            raise InputError(f"channel geometry: {len(self.owners)} owners for {n} channels")
        _refuse_doubled(self.channels, "channel")
        _refuse_doubled((*RIGID_MOTIONS, *self.mode_names), "motion")
        light = [c for c, w in zip(self.channels, self.weights, strict=True) if not w > 0]
        if light:
            raise InputError(
                f"channels {light}: a weight is positive; switch a channel off by its name instead"
            )

    @property
    def motions(self) -> tuple[str, ...]:
        """Names of the rigid motions and of the flexible modes."""
        return (*RIGID_MOTIONS, *self.mode_names)

    @property
    def loads(self) -> tuple[str, ...]:
        """Names of the forces, moments and generalised forces that belong to `motions`."""
        return (*RIGID_LOADS, *self.mode_names)

    @cached_property
    def forward(self) -> RealArray:
        """Motion at the virtual point → channels, shape (n, 6 + number of modes) [1, m, …]."""
        of_points = forward_matrices(self.levers).reshape(-1, 3, 6)
        rigid = np.einsum("ca,cab->cb", self.directions, of_points)
        forward = np.hstack([rigid, self.mode_shapes])
        forward.setflags(write=False)
        return forward

    def rows_of(self, owner: str) -> npt.NDArray[np.intp]:
        """Return the indices of the channels of one sensor or impact."""
        return np.flatnonzero(np.array(self.owners) == owner)


def sensor_geometry(
    sensors: Sequence[Sensor],
    position: npt.ArrayLike = ORIGIN,
    *,
    switched_off: Sequence[str] = (),
    weights: Mapping[str, float] = NO_WEIGHTS,
    flexible_modes: Mapping[str, npt.ArrayLike] = NO_MODES,
) -> ChannelGeometry:
    """Geometry of triaxial sensors on one body, from the position sheet alone.

    Parameters
    ----------
    sensors : sequence of Sensor
        n sensors of one kind, with names of their own.
    position : array, shape (3,)
        Of the virtual point, from the origin of the position sheet [m].
    switched_off : sequence of str
        Channels not to be used, such as ``A3 y``.
    weights : mapping of channel name to float
        Weight of its squared residual, 1 / variance; 1 for a channel that is not named.
    flexible_modes : mapping of mode name to array, shape (3 n,)
        What each channel of each sensor (switched off or not) sees of a unit of the mode.

    Raises
    ------
    InputError
        Sensors of several kinds, doubled names, unknown channels, or shapes that disagree.
    """
    kinds = sorted({sensor.kind.value for sensor in sensors})
    if len(kinds) > 1:
        raise InputError(f"a virtual point takes sensors of one kind, not {kinds}")
    _refuse_doubled([sensor.name for sensor in sensors], "sensor")
    return _geometry(
        position,
        channels=[channel for sensor in sensors for channel in sensor.channels],
        owners=[sensor.name for sensor in sensors for _ in range(3)],
        positions=np.repeat([sensor.position for sensor in sensors], 3, axis=0),
        directions=np.vstack([sensor.orientation.T for sensor in sensors] or [np.empty((0, 3))]),
        switched_off=switched_off,
        weights=weights,
        flexible_modes=flexible_modes,
    )


def impact_geometry(
    impacts: Sequence[Impact],
    position: npt.ArrayLike = ORIGIN,
    *,
    switched_off: Sequence[str] = (),
    weights: Mapping[str, float] = NO_WEIGHTS,
    flexible_modes: Mapping[str, npt.ArrayLike] = NO_MODES,
) -> ChannelGeometry:
    """Geometry of the points of excitation of one body, from the position sheet alone.

    Parameters
    ----------
    impacts : sequence of Impact
        n of them, with names of their own.
    position : array, shape (3,)
        Of the virtual point, from the origin of the position sheet [m].
    switched_off : sequence of str
        Impacts not to be used.
    weights : mapping of impact name to float
        Weight of its squared residual, 1 / variance; 1 for an impact that is not named.
    flexible_modes : mapping of mode name to array, shape (n,)
        Generalised force of each mode per force of each impact.

    Raises
    ------
    InputError
        Doubled names, unknown impacts, or shapes that disagree.
    """
    names = [impact.name for impact in impacts]
    return _geometry(
        position,
        channels=names,
        owners=names,
        positions=np.reshape([impact.position for impact in impacts], (-1, 3)),
        directions=np.reshape([impact.direction for impact in impacts], (-1, 3)),
        switched_off=switched_off,
        weights=weights,
        flexible_modes=flexible_modes,
    )


def _geometry(
    position: npt.ArrayLike,
    *,
    channels: Sequence[str],
    owners: Sequence[str],
    positions: RealArray,
    directions: RealArray,
    switched_off: Sequence[str],
    weights: Mapping[str, float],
    flexible_modes: Mapping[str, npt.ArrayLike],
) -> ChannelGeometry:
    for named, what in ((switched_off, "switched off"), (weights, "weighted")):
        unknown = sorted(set(named) - set(channels))
        if unknown:
            raise InputError(f"there are no channels {unknown} to be {what}: use {list(channels)}")
    shapes = np.empty((len(channels), len(flexible_modes)))
    for column, (name, shape) in enumerate(flexible_modes.items()):
        values = np.asarray(shape, dtype=float)
        if values.shape != (len(channels),):
            raise InputError(
                f"flexible mode {name}: {len(channels)} channels need as many values, "
                f"not shape {values.shape}"
            )
        shapes[:, column] = values
    used = [row for row, channel in enumerate(channels) if channel not in set(switched_off)]
    origin = np.asarray(position, dtype=float)
    if origin.shape != (3,):
        raise InputError(f"a virtual point has three coordinates, not shape {origin.shape}")
    return ChannelGeometry(
        position=origin,
        channels=tuple(channels[row] for row in used),
        owners=tuple(owners[row] for row in used),
        levers=np.asarray(positions, dtype=float).reshape(-1, 3)[used] - origin,
        directions=np.asarray(directions, dtype=float)[used],
        weights=np.array([weights.get(channels[row], 1.0) for row in used]),
        mode_names=tuple(flexible_modes),
        mode_shapes=shapes[used],
    )


def _refuse_doubled(names: Sequence[str], what: str) -> None:
    doubled = sorted(name for name, count in Counter(names).items() if count > 1)
    if doubled:
        raise InputError(f"duplicated {what} {doubled}: every {what} needs a name of its own")
