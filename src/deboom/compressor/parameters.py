"""Numbers that describe a compressor on its mounts: the minimal ones and the thesis's."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import AXES, DOFS, ComplexArray, RealArray, derivatives
from deboom.compressor.model import (
    GAIN_PARAMETERS,
    GAIN_SHAPE_NAMES,
    CompressorModel,
    GainFactor,
    gain_numbers,
    gain_parameters,
)
from deboom.measurement.compressor_test import CompressorMount
from deboom.physics.rigid_body import (
    RigidBody,
    mass_matrix,
    mass_properties,
    mount_stiffness_matrix,
    rotation_matrix,
    skew,
)

MASS_PARAMETER_NAMES = (
    "ln √mass",
    "x of the centre / length",
    "y of the centre / length",
    "z of the centre / length",
    "ln spread z",
    "shear yz",
    "ln spread y",
    "shear xz",
    "shear xy",
    "ln spread x",
)
N_MASS, N_STIFFNESS = 10, 20
STIFFNESS_AXES = ("axial", "radial 1", "radial 2")
INERTIA_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
INERTIA_NAMES = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
_STIFFNESS_ENTRIES = [
    (row, column) for row in range(6) for column in range(row, 6) if (row, column) != (2, 5)
]
_LAST = 3
STEP, SMALLEST_SIZE = 5e-4, 1e-2
"""Step of differences over the size of a parameter, and the smallest size that counts, in m, rad,
kg m², s or 1, of which the apparent mass is a smooth function."""


class Parametrisation(ABC):
    """Numbers that an optimiser moves, and the compressor that they stand for.

    Every parametrisation maps one vector `values`, shape (n_parameters,), of the stated units, to a
    body, a stiffness and a gain.
    """

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Name of each parameter."""

    @abstractmethod
    def parts(self, values: RealArray) -> tuple[RealArray, RealArray, RealArray]:
        """Return mass matrix and K_VP (..., 6, 6), and gain (..., 6) as `GainFactor.values`."""

    def model(self, values: RealArray) -> CompressorModel:
        """Build the compressor that the numbers stand for; InputError where they stand for none."""
        mass, stiffness, gain = self.parts(values)
        body = mass_properties(mass)
        return CompressorModel(body.mass, body.centre, body.inertia, stiffness, GainFactor.of(gain))

    def sensitivities(self, values: RealArray, frequency: RealArray) -> ComplexArray:
        """Differentiate the apparent mass, shape (n_parameters, n_frequency, 6, 6)."""

        def apparent_mass(rows: RealArray) -> ComplexArray:
            mass, stiffness, gain = self.parts(rows)
            limit, slope, offset = np.moveaxis(gain.reshape(-1, 2, 3, 1), 2, 0)
            real, imaginary = np.moveaxis(limit - 1 / (slope * frequency + offset), 1, 0)
            factor = (real + 1j * imaginary) / (2 * np.pi * frequency) ** 2
            return np.asarray(
                mass[:, np.newaxis] - factor[..., np.newaxis, np.newaxis] * stiffness[:, np.newaxis]
            )

        return derivatives(apparent_mass, values, self.steps(values))

    def mass_slope(self, values: RealArray) -> RealArray:
        """Differentiate the mass, shape (n_parameters,) [kg over the parameter's unit]."""
        return derivatives(lambda rows: self.parts(rows)[0][:, 0, 0], values, self.steps(values))

    def steps(self, values: RealArray) -> RealArray:
        """Return steps of differences, each in the unit of its parameter."""
        return np.asarray(STEP * np.maximum(np.abs(values), SMALLEST_SIZE))


@dataclass(frozen=True)
class MinimalParameters(Parametrisation):
    """Ten numbers of mass, twenty of stiffness, five of gain: all that a virtual point can show.

    `length`: characteristic length by which rotations are scaled, printed with every result [m];
    `stiffness_scale`: typical stiffness of a mount [N/m]; `reference_frequency`: line at which the
    real part of the gain is 1 and K_VP is the real stiffness [Hz].

    The trace of the coupling block of K_VP is zero, since mounts have no rotational stiffness of
    their own; the entry z–rz follows from it. The gain has five numbers left of six because its
    scale and that of K_VP are one.
    """

    length: float
    stiffness_scale: float = 1e4
    reference_frequency: float = 20.0

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each parameter."""
        entries = (f"K {DOFS[row]} {DOFS[column]} / scale" for row, column in _STIFFNESS_ENTRIES)
        return (*MASS_PARAMETER_NAMES, *entries, *GAIN_SHAPE_NAMES)

    @property
    def stiffness_basis(self) -> RealArray:
        """6×6 matrix that each stiffness parameter multiplies, shape (20, 6, 6)."""
        unit = np.repeat([1.0, self.length], 3)
        basis = np.zeros((N_STIFFNESS, 6, 6))
        for number, (row, column) in enumerate(_STIFFNESS_ENTRIES):
            entry = self.stiffness_scale * unit[row] * unit[column]
            basis[number, row, column] = basis[number, column, row] = entry
            if (row, column) in ((0, 3), (1, 4)):
                basis[number, 2, 5] = basis[number, 5, 2] = -entry
        return basis

    def parts(self, values: RealArray) -> tuple[RealArray, RealArray, RealArray]:
        """Return mass matrix and K_VP at the reference line (..., 6, 6), and gain (..., 6)."""
        of_mass, of_stiffness, of_gain = np.split(values, [N_MASS, N_MASS + N_STIFFNESS], axis=-1)
        stiffness = np.tensordot(of_stiffness, self.stiffness_basis, axes=1)
        return (
            mass_matrix_from_parameters(of_mass, self.length),
            np.asarray(stiffness),
            gain_numbers(of_gain, self.reference_frequency),
        )

    def values_of(self, model: CompressorModel) -> RealArray:
        """Find the parameters of a compressor, the inverse of `model`.

        Returns (35,) [1].
        """
        body = RigidBody(model.mass, model.centre, model.inertia)
        reference = float(model.gain.real.at(self.reference_frequency))
        unit = np.repeat([1.0, self.length], 3)
        scaled = model.stiffness * reference / (self.stiffness_scale * np.outer(unit, unit))
        gain = gain_parameters(model.gain, self.reference_frequency)
        stiffness = [scaled[entry] for entry in _STIFFNESS_ENTRIES]
        return np.concatenate([mass_parameters(body, self.length), stiffness, gain])


@dataclass(frozen=True, eq=False)
class ThesisParameters(Parametrisation):
    """The thesis's 44 numbers: three free mounts, a free body, a gain with three scales for one.

    `mount_names`: names of the mounts.

    Thesis, section 4.3: nine positions, nine rotations, nine stiffnesses, six inertia entries,
    three of the centre of gravity, the mass, six of the gain factor and v_rel. Only 35 combinations
    of them are seen at the virtual point; the mode stands for comparison with its table 11.
    """

    mount_names: tuple[str, ...] = ("mount 1", "mount 2", "mount 3")

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each parameter."""
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
        """Unit of each parameter."""
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

    def parts(self, values: RealArray) -> tuple[RealArray, RealArray, RealArray]:
        """Return mass matrix and K_VP (..., 6, 6), and gain (..., 6), v_rel multiplied in."""
        rows = values.shape[:-1]
        n_numbers = 9 * len(self.mount_names)
        position, rotation, stiffness = np.moveaxis(
            values[..., :n_numbers].reshape(*rows, 3, -1, 3), -3, 0
        )
        of_mounts = mount_stiffness_matrix(position, stiffness, rotation_matrix(rotation))
        entries = np.moveaxis(values[..., n_numbers:], -1, 0)
        inertia = np.empty((*rows, 3, 3))
        for entry, (row, column) in zip(entries, INERTIA_ENTRIES, strict=False):
            inertia[..., row, column] = inertia[..., column, row] = entry
        lever = skew(values[..., n_numbers + 6 : n_numbers + 9])
        heavy = entries[9][..., np.newaxis, np.newaxis]
        mass = np.zeros((*rows, 6, 6))
        mass[..., :3, :3] = heavy * np.eye(3)
        mass[..., 3:, :3], mass[..., :3, 3:] = heavy * lever, -heavy * lever
        mass[..., 3:, 3:] = inertia - heavy * lever @ lever
        scale = values[..., -1:]
        limit, slope, offset = np.moveaxis(values[..., -7:-1].reshape(*rows, 2, 3), -1, 0)
        gain = np.stack([limit * scale, slope / scale, offset / scale], axis=-1)
        return mass, np.asarray(of_mounts, dtype=float), gain.reshape(*rows, 6)

    def values_of(self, model: CompressorModel, mounts: Sequence[CompressorMount]) -> RealArray:
        """Find the 44 numbers of a compressor on known mounts, with v_rel = 1.

        Returns (44,) numbers in `units`.
        """
        parts = [
            np.concatenate([getattr(mount, field) for mount in mounts])
            for field in ("position", "rotation", "stiffness")
        ]
        inertia = [model.inertia[entry] for entry in INERTIA_ENTRIES]
        return np.concatenate(
            [*parts, inertia, model.centre, [model.mass], model.gain.values, [1.0]]
        )


def mass_matrix_of_pseudo_inertia(pseudo: RealArray) -> RealArray:
    """Read the 6×6 mass matrix off a pseudo-inertia; the map is linear.

    `pseudo` (..., 4, 4): ``∫ [r; 1] [r; 1]ᵀ dm``, symmetric [kg m², kg m, kg]. Returns (..., 6, 6)
    at the same point [kg, kg m, kg m²].
    """
    second, first, mass = pseudo[..., :3, :3], pseudo[..., :3, _LAST], pseudo[..., _LAST, _LAST]
    matrix = np.zeros((*pseudo.shape[:-2], 6, 6))
    for axis in range(3):
        matrix[..., axis, axis] = mass
    x, y, z = np.moveaxis(first, -1, 0)
    for (row, column), entry in {(0, 1): -z, (0, 2): y, (1, 2): -x}.items():
        matrix[..., 3 + row, column], matrix[..., 3 + column, row] = entry, -entry
    matrix[..., :3, 3:] = np.swapaxes(matrix[..., 3:, :3], -1, -2)
    trace = np.trace(second, axis1=-2, axis2=-1)[..., np.newaxis, np.newaxis]
    matrix[..., 3:, 3:] = trace * np.eye(3) - second
    return matrix


def mass_matrix_from_parameters(values: RealArray, length: float) -> RealArray:
    """Compute the 6×6 mass matrix at the virtual point.

    `values` (..., 10): numbers in the order of `MASS_PARAMETER_NAMES` [1]; `length`: characteristic
    length of the body, such as its radius of gyration [m]. Returns (..., 6, 6) positive definite
    [kg, kg m, kg m²].

    Pseudo-inertia ``J = ∫ [r; 1] [r; 1]ᵀ dm = U Uᵀ`` with U upper triangular and a positive
    diagonal: the log-Cholesky parameters of Rucker and Wensing (2022). Every distribution of mass
    has one such U, and every such U has a distribution of mass.
    """
    mass, cx, cy, cz, szz, syz, syy, sxz, sxy, sxx = np.moveaxis(values, -1, 0)
    factor = np.zeros((*mass.shape, 4, 4))
    for row, entries in enumerate(
        [(np.exp(sxx), sxy, sxz, cx), (np.exp(syy), syz, cy), (np.exp(szz), cz)]
    ):
        factor[..., row, row:] = length * np.stack(entries, axis=-1)
    factor[..., _LAST, _LAST] = 1
    factor *= np.exp(mass)[..., np.newaxis, np.newaxis]
    return mass_matrix_of_pseudo_inertia(factor @ np.swapaxes(factor, -1, -2))


def mass_parameters(body: RigidBody, length: float) -> RealArray:
    """Find the ten numbers of a body that can exist, inverse of `mass_matrix_from_parameters`."""
    at_point = mass_matrix(body.mass, body.inertia, body.centre)[3:, 3:]
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = np.trace(at_point) / 2 * np.eye(3) - at_point
    pseudo[:3, _LAST] = pseudo[_LAST, :3] = body.mass * np.asarray(body.centre)
    pseudo[_LAST, _LAST] = body.mass
    return parameters_of_pseudo_inertia(pseudo, length)


def parameters_of_pseudo_inertia(pseudo: RealArray, length: float) -> RealArray:
    """Find the ten numbers of a positive definite pseudo-inertia, shape (4, 4)."""
    # an upper triangular factor is the lower one of the matrix read backwards
    factor = np.linalg.cholesky(pseudo[::-1, ::-1])[::-1, ::-1]
    root = factor[_LAST, _LAST]
    shape = factor[:3] / (root * length)
    return np.array(
        [
            np.log(root),
            *shape[:, _LAST],
            np.log(shape[2, 2]),
            shape[1, 2],
            np.log(shape[1, 1]),
            shape[0, 2],
            shape[0, 1],
            np.log(shape[0, 0]),
        ]
    )
