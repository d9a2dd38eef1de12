"""Virtual points: channels of a rigid body to its motion and load, and how well they determine it.

A channel that measures motion and one that measures a force have the same row ``dᵀ [I, skew(r)ᵀ]``:
it maps the motion of the body to the channel, and transposed the force to a load on the body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from deboom.arrays import DOFS, ComplexArray, RealArray, checked, checked_array, frozen_copy
from deboom.errors import InputError
from deboom.measurement.channels import (
    Frf,
    SideUnits,
    Spectrum,
    load_units,
    motion_units,
    refuse_doubled,
    unit_sides,
)
from deboom.measurement.sensors import Impact, Sensor
from deboom.physics.rigid_body import forward_matrices

RIGID_MOTIONS = DOFS
RIGID_LOADS = ("fx", "fy", "fz", "mx", "my", "mz")
SINGULAR = 1e6
"""Scaled condition number from which a motion counts as not seen at all: three sensors that miss a
common line by a millionth of their distance."""


@checked(position="3", channels="n distinct", owners="n", levers="n 3", directions="n 3")
class ChannelGeometry:
    """Channels on one body, seen from a virtual point.

    - `position` (3,): the virtual point, from the origin of the position sheet [m].
    - `levers` (n, 3): place of each channel, from the virtual point [m].
    - `directions` (n, 3): unit vectors along which the channels are positive [1].
    """

    position: RealArray
    channels: tuple[str, ...]
    owners: tuple[str, ...]
    levers: RealArray
    directions: RealArray

    @cached_property
    def forward(self) -> RealArray:
        """Motion at the virtual point → channels, shape (n, 6) [1, m]."""
        of_points = forward_matrices(self.levers).reshape(-1, 3, 6)
        return frozen_copy(np.einsum("ca,cab->cb", self.directions, of_points))

    @cached_property
    def length(self) -> float:
        """Characteristic length, the mean distance of the channels from the virtual point [m].

        No channels, or all of them at the virtual point, raise InputError.
        """
        if not self.channels:
            raise InputError("a virtual point needs channels: all of them are switched off")
        length = float(np.mean(np.linalg.norm(self.levers, axis=1)))
        if not length > 0:
            raise InputError(
                f"the channels {list(self.channels)} all sit at the virtual point: they see no "
                "rotation; check the position sheet"
            )
        return length

    @property
    def scale(self) -> RealArray:
        """Scale of each motion, 1 for translations and `length` for rotations, shape (6,)."""
        return np.repeat([1.0, self.length], 3)

    def rows_of(self, owner: str) -> npt.NDArray[np.intp]:
        """Return the indices of the channels of one sensor or impact."""
        return np.flatnonzero(np.array(self.owners) == owner)


def sensor_geometry(
    sensors: Sequence[Sensor],
    position: npt.ArrayLike = (0.0, 0.0, 0.0),
    *,
    switched_off: Sequence[str] = (),
) -> ChannelGeometry:
    """Return the geometry of triaxial sensors on one body, from the position sheet alone.

    Parameters
    ----------
    sensors : sequence of Sensor
        Sensors of one kind with position [m] and orientation [1].
    position : array, shape (3,)
        The virtual point [m].
    switched_off : sequence of str
        Channels that are left out, such as ``S4 y``.

    Returns
    -------
    ChannelGeometry
        Lever [m] and direction [1] of each channel, shape (n_channel, 3).

    Raises
    ------
    InputError
        Sensors of several kinds, doubled names, or unknown channels.

    See Also
    --------
    deboom.virtual_point, deboom.read_campaign

    Examples
    --------
    See `virtual_point`.
    """
    kinds = sorted({sensor.kind.value for sensor in sensors})
    if len(kinds) > 1:
        raise InputError(f"a virtual point takes sensors of one kind, not {kinds}")
    refuse_doubled([sensor.name for sensor in sensors], "sensor")
    channels = [channel for sensor in sensors for channel in sensor.channels]
    unknown = sorted(set(switched_off) - set(channels))
    if unknown:
        raise InputError(f"there are no channels {unknown} to be switched off: use {channels}")
    used = [row for row, channel in enumerate(channels) if channel not in switched_off]
    positions = np.repeat(np.reshape([s.position for s in sensors], (-1, 3)), 3, axis=0)
    directions = np.reshape([sensor.orientation.T for sensor in sensors], (-1, 3))
    return ChannelGeometry(
        position=np.asarray(position, dtype=float),
        channels=tuple(channels[row] for row in used),
        owners=tuple(sensors[row // 3].name for row in used),
        levers=positions[used] - _point(position),
        directions=directions[used],
    )


def impact_geometry(
    impacts: Sequence[Impact], position: npt.ArrayLike = (0.0, 0.0, 0.0)
) -> ChannelGeometry:
    """Return the geometry of the points of excitation of one body, as `sensor_geometry` does."""
    names = tuple(impact.name for impact in impacts)
    positions = np.reshape([impact.position for impact in impacts], (-1, 3))
    return ChannelGeometry(
        position=np.asarray(position, dtype=float),
        channels=names,
        owners=names,
        levers=positions - _point(position),
        directions=np.reshape([impact.direction for impact in impacts], (-1, 3)),
    )


def _point(position: npt.ArrayLike) -> RealArray:
    point = np.asarray(position, dtype=float)
    if point.shape != (3,):
        raise InputError(f"a virtual point has three coordinates, not shape {point.shape}")
    return point


@checked(redundancy="n")
class Conditioning:
    """What a position sheet promises.

    - `condition_number`: condition number of the forward matrix with rotations counted as motion at
      `length`; infinite where the rank is short [1].
    - `length`: characteristic length; 0 where no rotations are asked for [m].
    - `redundancy` (n_channel,): share of an error in one channel that shows in its own residual, 0
      … 1; a fault in a channel of redundancy 0 cannot be noticed [1].
    """

    rank: int
    condition_number: float
    length: float
    worst_seen: str
    redundancy: RealArray
    n_motion: int = len(RIGID_MOTIONS)

    @property
    def complete(self) -> bool:
        """Whether every motion is seen."""
        return self.rank == self.n_motion


def conditioning(geometry: ChannelGeometry, motions: Sequence[str] = RIGID_MOTIONS) -> Conditioning:
    """Judge a position sheet before any measurement, for all motions or the translations alone.

    ``redundancy = 1 − diag V V⁺``. Without the scaling the condition number depends on the unit of
    length (three sensors of a published rig 30 mm from their virtual point: 49 in metres, 1.5
    scaled).
    """
    turning = len(motions) == len(RIGID_MOTIONS)
    # translations have no length, and need none: all channels may sit at the point
    scale = geometry.scale if turning else np.ones(len(motions))
    scaled = geometry.forward[:, : len(motions)] / scale
    singular, directions = np.linalg.svd(scaled)[1:]
    worst = np.zeros(len(RIGID_MOTIONS))
    worst[: len(motions)] = directions[-1] / scale
    rank = int(np.count_nonzero(singular > singular[0] / SINGULAR))
    complete = rank == scaled.shape[1]
    left = np.linalg.svd(scaled, full_matrices=False)[0]
    return Conditioning(
        rank=rank,
        n_motion=len(motions),
        condition_number=float(singular[0] / singular[-1]) if complete else np.inf,
        length=geometry.length if turning else 0.0,
        worst_seen=_in_words(worst, geometry),
        redundancy=np.clip(1.0 - np.sum(left[:, :rank] ** 2, axis=1), 0.0, 1.0),
    )


def _in_words(motion: RealArray, geometry: ChannelGeometry) -> str:
    """Describe a motion at the virtual point: the axis it turns about, the way it goes."""
    shift, turn = motion[:3], motion[3:]
    angle = float(np.linalg.norm(turn))
    if angle == 0 or angle * geometry.length < 0.1 * np.linalg.norm(shift):
        return f"translation along {_vector(_along(shift))}"
    axis = _along(turn)
    on_axis = geometry.position + np.cross(turn, shift) / angle**2
    return f"rotation about the axis {_vector(axis)} through {_vector(on_axis)} m"


def _along(vector: RealArray) -> RealArray:
    """Return the unit vector along a line, whose first large component is positive.

    The sign of a singular vector is arbitrary: another library takes another one.
    """
    large = np.flatnonzero(np.abs(vector) > 0.5 * np.max(np.abs(vector)))[0]
    return np.asarray(vector * np.sign(vector[large]) / np.linalg.norm(vector))


def _vector(values: RealArray) -> str:
    # adding zero turns -0.0 into 0.0
    return "(" + ", ".join(f"{np.round(value, 3) + 0.0:g}" for value in values) + ")"


@checked(forward="n k", inverse="k n")
class VirtualPoint:
    """A point whose motion the channels determine; made by `virtual_point`.

    - `forward` (n_channel, n_motion): motion of the point → channels [1, m].
    - `inverse` (n_motion, n_channel): channels → motion of the point [1, 1/m].
    """

    geometry: ChannelGeometry
    conditioning: Conditioning
    forward: RealArray
    inverse: RealArray

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels in use."""
        return self.geometry.channels

    def reproject(self, channels: npt.ArrayLike) -> ComplexArray:
        """Return what a rigid body would have shown, ``V V⁺ a``, shape (..., n_channel).

        Thesis, eq. 26 after 27; the difference to the measured values is the inconsistency.
        """
        motion = np.asarray(channels, dtype=complex) @ self.inverse.T
        return np.asarray(motion @ self.forward.T, dtype=complex)


def channel_values(point: VirtualPoint, measured: Spectrum | Frf) -> ComplexArray:
    """Take the channels of a virtual point out, shape (n_frequency, n_input, n_channel)."""
    if isinstance(measured, Frf):
        return np.moveaxis(measured.select(outputs=point.channels).values, 1, 2)
    return measured.select(point.channels).values[:, np.newaxis, :]


def virtual_point(
    geometry: ChannelGeometry,
    *,
    weight: npt.ArrayLike | None = None,
    motions: Sequence[str] = RIGID_MOTIONS,
) -> VirtualPoint:
    """Make the transformation between channels and the motion of their virtual point.

    Parameters
    ----------
    geometry : ChannelGeometry
        Levers and directions of the channels, see `sensor_geometry`.
    weight : array_like, shape (n_channel,), optional
        Weight of each channel's squared residual, above 0, such as 1 over the variance of its
        noise; by default all alike.
    motions : sequence of str
        All six motions, or ``("x", "y", "z")`` for a point that does not turn: a force without
        moment.

    Returns
    -------
    VirtualPoint
        ``forward``, (n_channel, n_motion), from the point's motion to channels [1, m];
        ``inverse``, (n_motion, n_channel), back [1, 1/m]; ``conditioning``.

    Raises
    ------
    InputError
        Channels that do not determine every motion: for six fewer than three triaxial sensors,
        sensors on one line, too many channels switched off. A weight that is not positive. Motions
        that are neither all six nor the translations.

    See Also
    --------
    deboom.sensor_geometry, deboom.Frf, deboom.free_body
    deboom.physics.substructuring.singular_vectors

    Notes
    -----
    ``V⁺ = (Vᵀ W V)⁻¹ Vᵀ W`` (thesis, eq. 27, where W = I; weights: van der Seijs, van den Bosch,
    Rixen and de Klerk, ECCOMAS 2013), computed by QR with scaled columns: the normal equations
    would square the condition number. V is real, so the real and the imaginary part are transformed
    alike. For impacts the same row ``[d, r × d]`` gives, transposed, the load at the point.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> from deboom.measurement.sensors import Sensor, SensorKind
    >>> places = {"S1": [0.1, 0.0, 0.0], "S2": [0.0, 0.1, 0.0], "S3": [0.0, 0.0, 0.1]}
    >>> sensors = [
    ...     Sensor(name, SensorKind.ACCELEROMETER, "triaxial", "", "", np.array(place), np.eye(3))
    ...     for name, place in places.items()
    ... ]
    >>> point = deboom.virtual_point(deboom.sensor_geometry(sensors))
    >>> np.allclose(point.inverse @ point.forward, np.eye(6))
    True
    """
    motions = tuple(motions)
    if motions not in (RIGID_MOTIONS, RIGID_MOTIONS[:3]):
        raise InputError(
            f"a virtual point has the motions {', '.join(RIGID_MOTIONS)}, or x, y, z alone, not "
            f"{', '.join(motions)}"
        )
    state = conditioning(geometry, motions)
    if not state.complete:
        owners = list(dict.fromkeys(geometry.owners))
        needed = (
            "three triaxial sensors, or places of excitation, that are not on one line are needed"
            if motions == RIGID_MOTIONS
            else "channels along three directions are needed"
        )
        raise InputError(
            f"virtual point at {geometry.position.tolist()} m: the {len(geometry.channels)} "
            f"channels of {', '.join(owners)} show only {state.rank} of {len(motions)} motions "
            f"(scaled condition number infinite, characteristic length {state.length:.3g} m); not "
            f"seen: {state.worst_seen}; {needed}"
        )
    root = np.ones(len(geometry.channels))
    if weight is not None:
        given = checked_array(weight, f"{len(root)}", "weights of the channels")
        if not np.all(given > 0):
            channel = geometry.channels[int(np.argmin(given))]
            raise InputError(
                f"the weight of {channel} is {given.min():g}: a weight is above 0; switch off a "
                "channel that shall not count"
            )
        root = np.sqrt(given)
    forward = geometry.forward[:, : len(motions)]
    scale = geometry.scale if motions == RIGID_MOTIONS else np.ones(len(motions))
    orthonormal, triangle = np.linalg.qr(root[:, np.newaxis] * forward / scale)
    inverse = solve_triangular(triangle, orthonormal.T * root) / scale[:, np.newaxis]
    return VirtualPoint(geometry, state, forward, inverse)


def motion_at_point(point: VirtualPoint, measured: Spectrum) -> Spectrum:
    """Return the motion of the virtual point, ``x y z rx ry rz``, out of all its channels.

    Translations in the unit of `measured`, rotations in that unit per metre, such as rad/s²; a
    missing channel, or channels of several units, raise InputError.
    """
    chosen = measured.select(point.channels)
    if not isinstance(chosen.unit, str):
        raise InputError(f"a motion needs channels of one unit, not of {', '.join(chosen.units)}")
    motions = RIGID_MOTIONS[: len(point.inverse)]
    units = motion_units(motions, chosen.unit)
    return Spectrum(measured.frequency, chosen.values @ point.inverse.T, motions, units)


def virtual_point_frf(
    measured: Frf, *, response: VirtualPoint | None = None, excitation: VirtualPoint | None = None
) -> Frf:
    """Return frequency response functions at virtual points: of responses, of forces or both.

    Outputs ``x … rz``, inputs ``fx … mz`` on each transformed side, each with its unit: rad/s²
    beside m/s², N m beside N. A missing channel, or functions of several units, raise InputError.

    ``Y_VP = V⁺ Y (U⁺)ᵀ`` with ``(U⁺)ᵀ = U (Uᵀ U)⁻¹``: of all forces at the points of excitation
    that make up a load, those of least ``Σ f²``.
    """
    if response is None and excitation is None:
        raise InputError("state the virtual point of the responses, of the excitation, or both")
    outputs = measured.outputs if response is None else response.channels
    inputs = measured.inputs if excitation is None else excitation.channels
    chosen = measured.select(outputs, inputs)
    values, (above, below) = chosen.values, unit_sides(chosen.unit)
    of_outputs, of_inputs = (above,) * len(outputs), (below,) * len(inputs)
    if response is not None:
        values, outputs = response.inverse @ values, RIGID_MOTIONS[: len(response.inverse)]
        of_outputs = motion_units(outputs, above)
    if excitation is not None:
        values = values @ excitation.inverse.T
        inputs = RIGID_LOADS[: len(excitation.inverse)]
        of_inputs = load_units(inputs, below)
    unit = SideUnits(of_outputs, of_inputs)
    return replace(measured, values=values, outputs=outputs, inputs=inputs, unit=unit)
