"""Virtual point transformation: channels of a rigid body → motion and load at any of its points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channel_geometry import (
    RIGID_LOADS,
    ChannelGeometry,
    sensor_geometry,
)
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.conditioning import Conditioning, column_scale, conditioning
from deboom.measurement.sensors import SENSOR_AXES, Sensor
from deboom.physics.rigid_body import forward_matrices


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
