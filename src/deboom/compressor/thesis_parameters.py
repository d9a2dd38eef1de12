"""The thesis's parametrisation: 44 numbers, of which 35 combinations can be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain import GAIN_PARAMETERS, GainFactor, HyperbolicGain
from deboom.compressor.model import CompressorModel, mounts_at_virtual_point
from deboom.compressor.mount_derivatives import mount_stiffness_derivatives
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.rigid_body import mass_matrix, skew

AXES = ("x", "y", "z")
STIFFNESS_AXES = ("axial", "radial 1", "radial 2")
INERTIA_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
INERTIA_NAMES = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True, eq=False)
class ThesisParameters:
    """The thesis's 44 numbers: three free mounts, a free body, a gain with three scales for one.

    Parameters
    ----------
    mount_names : tuple of str
        One per mount.

    Notes
    -----
    Thesis, section 4.3: nine positions, nine rotations, nine stiffnesses, six inertia entries,
    three of the centre of gravity, the mass, six of the gain factor and v_rel. Only 35 combinations
    of them are seen at the virtual point; the mode stands for comparison with its table 11.
    """

    mount_names: tuple[str, ...] = ("mount 1", "mount 2", "mount 3")

    @property
    def names(self) -> tuple[str, ...]:
        """One per parameter."""
        mounts = self.mount_names
        return (
            *(f"{mount} position {axis}" for mount in mounts for axis in AXES),
            *(f"{mount} rotation {axis}" for mount in mounts for axis in AXES),
            *(f"{mount} stiffness {axis}" for mount in mounts for axis in STIFFNESS_AXES),
            *INERTIA_NAMES,
            *(f"centre {axis}" for axis in AXES),
            "mass",
            *(f"gain {name}" for name in GAIN_PARAMETERS),
            "gain v_rel",
        )

    @property
    def units(self) -> tuple[str, ...]:
        """One per parameter."""
        per_axis = 3 * len(self.mount_names)
        return (
            *("m",) * per_axis,
            *("rad",) * per_axis,
            *("N/m",) * per_axis,
            *("kg m^2",) * 6,
            *("m",) * 3,
            "kg",
            *("1", "s", "1") * 2,
            "1",
        )

    def mounts(self, values: RealArray) -> tuple[CompressorMount, ...]:
        """Mounts that the first numbers stand for."""
        n_mounts = len(self.mount_names)
        position, rotation, stiffness = values[: 9 * n_mounts].reshape(3, n_mounts, 3)
        return tuple(
            CompressorMount(name, position[i], rotation[i], stiffness[i])
            for i, name in enumerate(self.mount_names)
        )

    def gain(self, values: RealArray) -> GainFactor:
        """Gain factor with v_rel multiplied in."""
        numbers, scale = values[-7:-1].reshape(2, 3), values[-1]
        return GainFactor(
            *(
                HyperbolicGain(float(limit * scale), float(slope / scale), float(offset / scale))
                for limit, slope, offset in numbers
            )
        )

    def model(self, values: RealArray) -> CompressorModel:
        """Build the compressor that the numbers stand for."""
        _, inertia, centre, mass = self._body(values)
        return CompressorModel.on_mounts(
            mass, centre, inertia, self.mounts(values), self.gain(values)
        )

    def sensitivities(self, values: RealArray, frequency: RealArray) -> ComplexArray:
        """Differentiate the apparent mass, shape (44, n_frequency, 6, 6)."""
        lines = np.asarray(frequency, dtype=float)
        squared = (2 * np.pi * lines) ** 2
        mounts, gain = self.mounts(values), self.gain(values)
        stiffness = mounts_at_virtual_point(mounts)
        first_body, _, _, _ = self._body(values)
        result = np.zeros((len(self.names), lines.size, 6, 6), dtype=complex)
        each = np.stack([mount_stiffness_derivatives(mount) for mount in mounts])
        by_mount = each.reshape(len(mounts), 3, 3, 6, 6).swapaxes(0, 1).reshape(-1, 6, 6)
        factor = -gain.at(lines) / squared
        result[:first_body] = factor[:, np.newaxis, np.newaxis] * by_mount[:, np.newaxis]
        result[first_body:-7] = self.mass_sensitivities(values)[first_body:-7, np.newaxis]
        unscaled, scale = GainFactor.of(values[-7:-1]), values[-1]
        shape = np.concatenate(
            [scale * unscaled.derivatives(lines), unscaled.at(lines)[np.newaxis]]
        )
        result[-7:] = (-shape / squared)[..., np.newaxis, np.newaxis] * stiffness
        return result

    def mass_sensitivities(self, values: RealArray) -> RealArray:
        """Differentiate the 6×6 mass matrix, shape (44, 6, 6)."""
        first_body, _, centre, mass = self._body(values)
        result = np.zeros((len(self.names), 6, 6))
        for number, (row, column) in enumerate(INERTIA_ENTRIES):
            result[first_body + number, 3 + row, 3 + column] = 1.0
            result[first_body + number, 3 + column, 3 + row] = 1.0
        lever = skew(centre)
        for axis in range(3):
            change = skew(np.eye(3)[axis])
            block = result[first_body + 6 + axis]
            block[3:, :3], block[:3, 3:] = mass * change, mass * change.T
            block[3:, 3:] = mass * (change @ lever.T + lever @ change.T)
        result[first_body + 9] = mass_matrix(1.0, np.zeros((3, 3)), centre)
        return result

    def values_of(self, model: CompressorModel, mounts: Sequence[CompressorMount]) -> RealArray:
        """Find the 44 numbers of a compressor on known mounts, with v_rel = 1.

        Parameters
        ----------
        model : CompressorModel
            Its body and gain are read.
        mounts : sequence of CompressorMount
            As many as `mount_names`.

        Returns
        -------
        array, shape (44,)
            Of `units`.
        """
        parts = [
            np.concatenate([getattr(mount, field) for mount in mounts])
            for field in ("position", "rotation", "stiffness")
        ]
        inertia = [model.inertia[entry] for entry in INERTIA_ENTRIES]
        return np.concatenate(
            [*parts, inertia, model.centre, [model.mass], model.gain.values, [1.0]]
        )

    def _body(self, values: RealArray) -> tuple[int, RealArray, RealArray, float]:
        """First index of the body's numbers; its inertia, centre and mass."""
        first = 9 * len(self.mount_names)
        inertia = np.empty((3, 3))
        for number, (row, column) in enumerate(INERTIA_ENTRIES):
            inertia[row, column] = inertia[column, row] = values[first + number]
        return first, inertia, values[first + 6 : first + 9], float(values[first + 9])
