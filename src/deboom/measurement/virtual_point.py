"""Virtual points: channels of a rigid body to its motion and load,."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import SENSOR_AXES, Impact, Sensor
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


SINGULAR = 1e6
"""Scaled condition number from which a motion counts as not seen at all: three sensors that miss a
common line by a millionth of their distance."""


@dataclass(frozen=True, eq=False)
class Conditioning:
    """What a position sheet promises.

    Parameters
    ----------
    rank : int
        Independent motions that the channels see.
    n_motion : int
        Motions asked for: six, and the flexible modes.
    condition_number : float
        Of the forward matrix with rotations counted as motion at `length`, flexible modes as their
        rms over the channels; infinite where the rank is short [1].
    length : float
        Characteristic length: mean distance of the channels from the virtual point [m].
    worst_seen : str
        The motion, or mixture of motions, that the channels see least, in words.
    noise_gain : array, shape (n_motion,)
        Standard deviation of each motion per that of a channel of weight 1 [1, 1/m, …]; infinite
        where the rank is short.
    redundancy : array, shape (n_channel,)
        Share of an error in one channel that shows in its own residual, 0 … 1; a fault in a channel
        of redundancy 0 cannot be noticed [1].
    """

    rank: int
    n_motion: int
    condition_number: float
    length: float
    worst_seen: str
    noise_gain: RealArray
    redundancy: RealArray

    def __post_init__(self) -> None:
        for name in ("noise_gain", "redundancy"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def complete(self) -> bool:
        """Whether every motion is seen."""
        return self.rank == self.n_motion


def conditioning(geometry: ChannelGeometry) -> Conditioning:
    """Judge a position sheet.

    Parameters
    ----------
    geometry : ChannelGeometry
        Channels in use, seen from the virtual point.

    Raises
    ------
    InputError
        No channels, or all of them at the virtual point.

    Notes
    -----
    The weights do not enter the condition number: it is a property of the geometry. They enter
    `noise_gain`, ``√diag (Vᵀ W V)⁻¹``, and `redundancy`, ``1 − diag V V⁺``. Without the scaling the
    number depends on the unit of length (three sensors of a published rig 30 mm from their virtual
    point: 49 in metres, 1.5 scaled).
    """
    length = characteristic_length(geometry)
    scaled = geometry.forward / column_scale(geometry, length)
    singular, directions = np.linalg.svd(scaled)[1:]
    n_motion = scaled.shape[1]
    rank = int(np.count_nonzero(singular > singular[0] / SINGULAR))
    noise_gain = np.full(n_motion, np.inf)
    condition_number = np.inf
    root_weight = np.sqrt(geometry.weights)[:, np.newaxis]
    left, weighted, right = np.linalg.svd(root_weight * scaled, full_matrices=False)
    seen = left[:, :rank]
    if rank == n_motion:
        condition_number = float(singular[0] / singular[-1])
        gain = np.linalg.norm(right.T / weighted, axis=1)
        noise_gain = gain / column_scale(geometry, length)
    return Conditioning(
        rank=rank,
        n_motion=n_motion,
        condition_number=condition_number,
        length=length,
        worst_seen=_in_words(directions[-1] / column_scale(geometry, length), geometry),
        noise_gain=noise_gain,
        redundancy=np.clip(1.0 - np.sum(seen**2, axis=1), 0.0, 1.0),
    )


def characteristic_length(geometry: ChannelGeometry) -> float:
    """Mean distance of the channels from the virtual point [m].

    Raises
    ------
    InputError
        No channels, or all of them at the virtual point.
    """
    if not geometry.channels:
        raise InputError("a virtual point needs channels: all of them are switched off")
    length = float(np.mean(np.linalg.norm(geometry.levers, axis=1)))
    if not length > 0:
        raise InputError(
            f"the channels {list(geometry.channels)} all sit at the virtual point: they see no "
            "rotation; check the position sheet"
        )
    return length


def column_scale(geometry: ChannelGeometry, length: float) -> RealArray:
    """Scale of each motion, for columns of the forward matrix that can be compared.

    Parameters
    ----------
    geometry : ChannelGeometry
        n channels and their flexible modes.
    length : float
        Characteristic length [m].

    Returns
    -------
    array, shape (n_motion,)
        1 for translations, `length` for rotations, rms over the channels for flexible modes.
    """
    rms = np.sqrt(np.mean(geometry.mode_shapes**2, axis=0))
    return np.concatenate([[1.0] * 3, [length] * 3, np.where(rms > 0, rms, 1.0)])


def _in_words(motion: RealArray, geometry: ChannelGeometry) -> str:
    """Describe a motion at the virtual point: the axis it turns about, the way it goes."""
    shares = np.abs(motion * column_scale(geometry, characteristic_length(geometry)))
    of_modes = shares[len(RIGID_MOTIONS) :]
    if of_modes.sum() > 0.1 * shares.sum():
        mode = geometry.mode_names[int(np.argmax(of_modes))]
        return f"flexible mode {mode}, hardly to be told from the other motions"
    shift, turn = motion[:3], motion[3:6]
    angle = float(np.linalg.norm(turn))
    if angle * characteristic_length(geometry) < 0.1 * np.linalg.norm(shift):
        return f"translation along {_vector(shift / np.linalg.norm(shift))}"
    axis = turn / angle
    on_axis = geometry.position + np.cross(axis, shift) / angle
    return f"rotation about the axis {_vector(axis)} through {_vector(on_axis)} m"


def _vector(values: RealArray | Sequence[float]) -> str:
    # adding zero turns -0.0 into 0.0
    return "(" + ", ".join(f"{np.round(value, 3) + 0.0:g}" for value in values) + ")"


@dataclass(frozen=True, eq=False)
class VirtualPoint:
    """A point whose motion the channels determine; made by `virtual_point`.

    Parameters
    ----------
    geometry : ChannelGeometry
        Channels in use, seen from the point.
    conditioning : Conditioning
        How well they determine it.
    forward : array, shape (n_channel, n_motion)
        Motion at the point → channels, ``V``.
    inverse : array, shape (n_motion, n_channel)
        Channels → motion by weighted least squares, ``V⁺``.
    """

    geometry: ChannelGeometry
    conditioning: Conditioning
    forward: RealArray
    inverse: RealArray

    def __post_init__(self) -> None:
        for name in ("forward", "inverse"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels in use."""
        return self.geometry.channels

    def reproject(self, channels: npt.ArrayLike) -> ComplexArray:
        """Return what a rigid body (with the chosen modes) would have shown, ``V V⁺ a``.

        Parameters
        ----------
        channels : array, shape (..., n_channel)

        Returns
        -------
        array, shape (..., n_channel)
            Thesis, eq. 26 after 27; the difference to the measured values is the inconsistency.
        """
        motion = np.asarray(channels, dtype=complex) @ self.inverse.T
        return np.asarray(motion @ self.forward.T, dtype=complex)


def channel_values(point: VirtualPoint, measured: Spectrum | Frf) -> ComplexArray:
    """Take the channels of a virtual point of responses out of a measurement.

    Parameters
    ----------
    point : VirtualPoint
        Of the motion sensors.
    measured : Spectrum or Frf
        Of their channels, or with them as outputs.

    Returns
    -------
    array, shape (n_frequency, n_input, n_channel)
        One input for a spectrum.

    Raises
    ------
    InputError
        A missing channel.
    """
    if isinstance(measured, Frf):
        return np.moveaxis(measured.select(outputs=point.channels).values, 1, 2)
    return measured.select(point.channels).values[:, np.newaxis, :]


def virtual_point(geometry: ChannelGeometry) -> VirtualPoint:
    """Make the transformation between channels and the motion of their virtual point.

    Parameters
    ----------
    geometry : ChannelGeometry
        Of sensors (`sensor_geometry`) or of points of excitation (`impact_geometry`).

    Raises
    ------
    InputError
        Channels that do not determine every motion: fewer than three triaxial sensors, sensors on
        one line, too many channels switched off, a flexible mode that looks like a rigid motion.

    Notes
    -----
    ``V⁺ = (Vᵀ W V)⁻¹ Vᵀ W`` (thesis, eq. 27, there without weights), computed by QR of ``√W V``
    with scaled columns: the normal equations would square the condition number. V is real, so the
    real and the imaginary part are transformed alike. For impacts the same row ``[d, r × d]``
    gives, transposed, the load at the point.
    """
    state = conditioning(geometry)
    if not state.complete:
        owners = list(dict.fromkeys(geometry.owners))
        raise InputError(
            f"virtual point at {geometry.position.tolist()} m: the {len(geometry.channels)} "
            f"channels of {', '.join(owners)} show only {state.rank} of {state.n_motion} motions "
            f"(scaled condition number infinite, characteristic length {state.length:.3g} m); not "
            f"seen: {state.worst_seen}; three triaxial sensors, or places of excitation, that are "
            "not on one line are needed"
        )
    scale = column_scale(geometry, state.length)
    root_weight = np.sqrt(geometry.weights)
    orthonormal, triangle = np.linalg.qr(root_weight[:, np.newaxis] * geometry.forward / scale)
    inverse = solve_triangular(triangle, orthonormal.T) * root_weight / scale[:, np.newaxis]
    return VirtualPoint(geometry, state, geometry.forward, inverse)


def motion_at_point(point: VirtualPoint, measured: Spectrum) -> Spectrum:
    """Motion of the virtual point out of all its channels.

    Parameters
    ----------
    point : VirtualPoint
        Made of motion sensors.
    measured : Spectrum
        Holds at least the channels in use; others are not looked at.

    Returns
    -------
    Spectrum
        Channels ``x y z rx ry rz`` and the flexible modes; translations in the unit of `measured`,
        rotations in that unit per metre.

    Raises
    ------
    InputError
        A channel that is not in `measured`.
    """
    values = measured.select(point.channels).values @ point.inverse.T
    return Spectrum(measured.frequency, values, point.geometry.motions, measured.unit)


def motion_at_mounts(
    point: VirtualPoint, measured: Spectrum, mounts: Mapping[str, npt.ArrayLike]
) -> Spectrum:
    """Motion of several points of the body, such as the virtual points of its mounts.

    Parameters
    ----------
    point : VirtualPoint
        Made of motion sensors, with rigid motions only.
    measured : Spectrum
        Holds at least the channels in use.
    mounts : mapping of name to array, shape (3,)
        Positions, from the origin of the position sheet [m].

    Returns
    -------
    Spectrum
        Channels ``<name> x``, ``<name> y``, ``<name> z``, in the unit of `measured`.

    Raises
    ------
    InputError
        A missing channel, or a virtual point with flexible modes, whose shape at other points
        nobody has stated.

    Notes
    -----
    ``a_i = V_i a_B`` with the forward matrix of the mount (thesis, eq. 28).
    """
    if point.geometry.mode_names:
        raise InputError(
            f"flexible modes {list(point.geometry.mode_names)} are known at the sensors only: "
            "place a rigid virtual point for the motion of other points"
        )
    positions = np.reshape([np.asarray(r, dtype=float) for r in mounts.values()], (-1, 3))
    forward = forward_matrices(positions - point.geometry.position)
    values = motion_at_point(point, measured).values @ forward.T
    names = tuple(f"{name} {axis}" for name in mounts for axis in SENSOR_AXES)
    return Spectrum(measured.frequency, values, names, measured.unit)


def load_at_point(cells: Sequence[Sensor], measured: Spectrum, position: npt.ArrayLike) -> Spectrum:
    """Sum of the forces of several cells, and their moment about a point.

    Parameters
    ----------
    cells : sequence of Sensor
        All that carry the body or mount; a sum cannot do without one of them.
    measured : Spectrum
        Holds at least their channels [N].
    position : array, shape (3,)
        Of the point, from the origin of the position sheet [m].

    Returns
    -------
    Spectrum
        Channels ``fx fy fz mx my mz``, in the unit of `measured`, moments times metre.

    Raises
    ------
    InputError
        A cell whose channel is not in `measured`.

    Notes
    -----
    ``F = Σ V_iᵀ R_i f_i``, hence moments ``r × F``. No least squares: cells measure forces, they do
    not estimate them.
    """
    geometry = sensor_geometry(cells, position)
    missing = [name for name in geometry.channels if name not in measured.channels]
    if missing:
        raise InputError(f"the sum of the cells {[c.name for c in cells]} lacks {missing}")
    values = measured.select(geometry.channels).values @ geometry.forward
    return Spectrum(measured.frequency, values, RIGID_LOADS, measured.unit)


def virtual_point_frf(
    measured: Frf, *, response: VirtualPoint | None = None, excitation: VirtualPoint | None = None
) -> Frf:
    """Matrix of frequency response functions at virtual points: of responses, of forces or both.

    Parameters
    ----------
    measured : Frf
        Outputs and inputs hold at least the channels of the given virtual points.
    response : VirtualPoint, optional
        Of the motion sensors; without it the outputs stay channels.
    excitation : VirtualPoint, optional
        Of the points of excitation; without it the inputs stay channels.

    Returns
    -------
    Frf
        Outputs ``x … rz``, inputs ``fx … mz`` (and flexible modes) on each transformed side, in the
        unit of `measured`; per metre for each rotation or moment.

    Raises
    ------
    InputError
        Neither side given, or a missing channel.

    Notes
    -----
    ``Y_VP = V⁺ Y (U⁺)ᵀ`` with ``(U⁺)ᵀ = W U (Uᵀ W U)⁻¹``: of all forces at the points of excitation
    that make up a load, those of least ``Σ f²/w``.
    """
    if response is None and excitation is None:
        raise InputError("state the virtual point of the responses, of the excitation, or both")
    outputs, inputs = measured.outputs, measured.inputs
    if response is not None:
        outputs = response.channels
    if excitation is not None:
        inputs = excitation.channels
    values = measured.select(outputs, inputs).values
    if response is not None:
        values, outputs = response.inverse @ values, response.geometry.motions
    if excitation is not None:
        values, inputs = values @ excitation.inverse.T, excitation.geometry.loads
    return Frf(measured.frequency, values, outputs, inputs, measured.unit)
