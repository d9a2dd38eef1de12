"""Parametrisation by identical round mounts: their places and tilts become visible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain_parameters import (
    GAIN_SHAPE_NAMES,
    gain_derivatives,
    gain_from_parameters,
)
from deboom.compressor.mass_parameters import (
    MASS_PARAMETER_NAMES,
    mass_matrix_derivatives,
    mass_matrix_from_parameters,
)
from deboom.compressor.model import CompressorModel, mounts_at_virtual_point
from deboom.compressor.mount_derivatives import (
    mount_stiffness_derivatives,
    plus_transpose,
    rotation_derivative,
)
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.mass_properties import mass_properties
from deboom.physics.rigid_body import forward_matrix, rotation_matrix

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class IdenticalMountParameters:
    """Identical mounts that are round about their axes: 17 numbers of mounting for three mounts.

    Parameters
    ----------
    nominal : tuple of CompressorMount
        Drawing values; positions and tilts are counted from them, the stiffness is common.
    length : float
        Characteristic length of the body [m].
    reference_frequency : float
        Where the real part of the gain is 1, so that the stiffness is that of this line [Hz].

    Notes
    -----
    Per mount three of position and two of tilt; in common the axial and the radial stiffness. The
    rotation of a round mount about its own axis has no effect and is no parameter. All are seen at
    the virtual point: no null space is left.
    """

    nominal: tuple[CompressorMount, ...]
    length: float
    reference_frequency: float = 20.0

    @property
    def names(self) -> tuple[str, ...]:
        """One per parameter."""
        mounts = [mount.name for mount in self.nominal]
        return (
            *MASS_PARAMETER_NAMES,
            *(f"{mount} offset {axis}" for mount in mounts for axis in AXES),
            *(f"{mount} tilt {axis}" for mount in mounts for axis in AXES[1:]),
            "ln axial stiffness",
            "ln radial stiffness",
            *GAIN_SHAPE_NAMES,
        )

    @property
    def units(self) -> tuple[str, ...]:
        """One per parameter."""
        n_mounts = len(self.nominal)
        return (*("1",) * 10, *("m",) * (3 * n_mounts), *("rad",) * (2 * n_mounts), *("1",) * 7)

    def mounts(self, values: RealArray) -> tuple[CompressorMount, ...]:
        """Mounts that the numbers stand for, with their stiffness at the reference line."""
        offset, tilt, stiffness, _ = self._parts(values)
        axial, radial = np.exp(stiffness)
        return tuple(
            CompressorMount(
                mount.name,
                mount.position + offset[i],
                _angles_of(mount.orientation @ rotation_matrix([0.0, *tilt[i]])),
                np.array([axial, radial, radial]),
            )
            for i, mount in enumerate(self.nominal)
        )

    def model(self, values: RealArray) -> CompressorModel:
        """Build the compressor that the numbers stand for."""
        body = mass_properties(mass_matrix_from_parameters(values[:10], self.length))
        gain = gain_from_parameters(values[-5:], self.reference_frequency)
        return CompressorModel.on_mounts(
            body.mass, body.centre, body.inertia, self.mounts(values), gain
        )

    def sensitivities(self, values: RealArray, frequency: RealArray) -> ComplexArray:
        """Differentiate the apparent mass, shape (n_parameters, n_frequency, 6, 6)."""
        lines = np.asarray(frequency, dtype=float)
        squared = (2 * np.pi * lines) ** 2
        gain = gain_from_parameters(values[-5:], self.reference_frequency)
        by_mounting = self._mounting_derivatives(values)
        result = np.zeros((len(self.names), lines.size, 6, 6), dtype=complex)
        result[:10] = self.mass_sensitivities(values)[:10, np.newaxis]
        factor = -gain.at(lines) / squared
        result[10:-5] = factor[:, np.newaxis, np.newaxis] * by_mounting[:, np.newaxis]
        shape = -gain_derivatives(values[-5:], self.reference_frequency, lines) / squared
        stiffness = mounts_at_virtual_point(self.mounts(values))
        result[-5:] = shape[..., np.newaxis, np.newaxis] * stiffness
        return result

    def mass_sensitivities(self, values: RealArray) -> RealArray:
        """Differentiate the 6×6 mass matrix, shape (n_parameters, 6, 6)."""
        result = np.zeros((len(self.names), 6, 6))
        result[:10] = mass_matrix_derivatives(values[:10], self.length)
        return result

    def _parts(self, values: RealArray) -> tuple[RealArray, RealArray, RealArray, RealArray]:
        """Offsets (n, 3), tilts (n, 2), the two logarithmic stiffnesses, the gain's numbers."""
        n_mounts = len(self.nominal)
        offset = values[10 : 10 + 3 * n_mounts].reshape(n_mounts, 3)
        tilt = values[10 + 3 * n_mounts : 10 + 5 * n_mounts].reshape(n_mounts, 2)
        return offset, tilt, values[-7:-5], values[-5:]

    def _mounting_derivatives(self, values: RealArray) -> RealArray:
        """Differentiate K_VP at the reference line, shape (5 n_mounts + 2, 6, 6)."""
        _, tilt, _, _ = self._parts(values)
        offsets, tilts = [], []
        common = np.zeros((2, 6, 6))
        for nominal, mount, angles in zip(self.nominal, self.mounts(values), tilt, strict=True):
            forward, turn = forward_matrix(mount.position), mount.orientation
            each = mount_stiffness_derivatives(mount)
            offsets.append(each[:3])
            for axis in (1, 2):
                turned = nominal.orientation @ rotation_derivative(np.array([0.0, *angles]), axis)
                half = turned @ np.diag(mount.stiffness) @ turn.T
                tilts.append(plus_transpose(forward.T @ half @ forward))
            by_stiffness = each[6:] * mount.stiffness[:, np.newaxis, np.newaxis]
            common += np.stack([by_stiffness[0], by_stiffness[1] + by_stiffness[2]])
        return np.concatenate([*offsets, np.stack(tilts), common])


def _angles_of(rotation: RealArray) -> RealArray:
    """Angles x, y, z of ``R = Rz Ry Rx``, shape (3,) [rad]."""
    about_y = np.arcsin(np.clip(-rotation[2, 0], -1.0, 1.0))
    about_x = np.arctan2(rotation[2, 1], rotation[2, 2])
    about_z = np.arctan2(rotation[1, 0], rotation[0, 0])
    return np.array([about_x, about_y, about_z])
