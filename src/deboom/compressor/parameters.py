"""Numbers that describe a compressor on its mounts, with their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain import (
    GAIN_PARAMETERS,
    GAIN_SHAPE_NAMES,
    GainFactor,
    HyperbolicGain,
    gain_derivatives,
    gain_from_parameters,
    gain_parameters,
)
from deboom.compressor.model import CompressorModel, mounts_at_virtual_point
from deboom.measurement.compressor_test import CompressorMount
from deboom.physics.rigid_body import (
    RigidBody,
    forward_matrix,
    mass_matrix,
    mass_properties,
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
_LAST = 3


def _factor(values: RealArray, length: float) -> RealArray:
    """Upper triangular U of the pseudo-inertia ``J = U Uᵀ``."""
    (mass, cx, cy, cz, szz, syz, syy, sxz, sxy, sxx) = values
    root = np.exp(mass)
    scale = root * length
    return np.array(
        [
            [scale * np.exp(sxx), scale * sxy, scale * sxz, scale * cx],
            [0.0, scale * np.exp(syy), scale * syz, scale * cy],
            [0.0, 0.0, scale * np.exp(szz), scale * cz],
            [0.0, 0.0, 0.0, root],
        ]
    )


def _factor_derivatives(values: RealArray, length: float) -> RealArray:
    """Differentiate `_factor`, shape (10, 4, 4)."""
    derivatives = np.zeros((10, 4, 4))
    derivatives[0] = _factor(values, length)
    scale = np.exp(values[0]) * length
    for parameter, (row, column) in enumerate(
        [(0, 3), (1, 3), (2, 3), (2, 2), (1, 2), (1, 1), (0, 2), (0, 1), (0, 0)], start=1
    ):
        logarithmic = row == column
        slope = np.exp(values[parameter]) if logarithmic else 1.0
        derivatives[parameter, row, column] = scale * slope
    return derivatives


def mass_matrix_of_pseudo_inertia(pseudo: RealArray) -> RealArray:
    """Read the 6×6 mass matrix off a pseudo-inertia; the map is linear.

    Parameters
    ----------
    pseudo : array, shape (..., 4, 4)
        ``∫ [r; 1] [r; 1]ᵀ dm``, symmetric [kg m², kg m, kg].

    Returns
    -------
    array, shape (..., 6, 6)
        At the same point [kg, kg m, kg m²].
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

    Parameters
    ----------
    values : array, shape (10,)
        In the order of `MASS_PARAMETER_NAMES` [1].
    length : float
        Characteristic length of the body, such as its radius of gyration [m].

    Returns
    -------
    array, shape (6, 6)
        Positive definite [kg, kg m, kg m²].

    Notes
    -----
    Pseudo-inertia ``J = ∫ [r; 1] [r; 1]ᵀ dm = U Uᵀ`` with U upper triangular and a positive
    diagonal: the log-Cholesky parameters of Rucker and Wensing (2022). Every distribution of mass
    has one such U, and every such U has a distribution of mass.
    """
    factor = _factor(values, length)
    return mass_matrix_of_pseudo_inertia(factor @ factor.T)


def mass_matrix_derivatives(values: RealArray, length: float) -> RealArray:
    """Differentiate `mass_matrix_from_parameters`.

    Parameters
    ----------
    values, length
        As there.

    Returns
    -------
    array, shape (10, 6, 6)
        [kg, kg m, kg m²] per unit of each parameter.
    """
    factor = _factor(values, length)
    half = _factor_derivatives(values, length) @ factor.T
    return mass_matrix_of_pseudo_inertia(half + np.swapaxes(half, -1, -2))


def mass_parameters(body: RigidBody, length: float) -> RealArray:
    """Find the ten numbers of a body, the inverse of `mass_matrix_from_parameters`.

    Parameters
    ----------
    body : RigidBody
        Physically consistent: positive principal moments that obey the triangle inequality.
    length : float
        As there [m].

    Returns
    -------
    array, shape (10,)
        [1].

    Raises
    ------
    numpy.linalg.LinAlgError
        A body that cannot exist.
    """
    at_point = mass_matrix(body.mass, body.inertia, body.centre)[3:, 3:]
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = np.trace(at_point) / 2 * np.eye(3) - at_point
    pseudo[:3, _LAST] = pseudo[_LAST, :3] = body.mass * np.asarray(body.centre)
    pseudo[_LAST, _LAST] = body.mass
    return parameters_of_pseudo_inertia(pseudo, length)


def parameters_of_pseudo_inertia(pseudo: RealArray, length: float) -> RealArray:
    """Find the ten numbers of a pseudo-inertia.

    Parameters
    ----------
    pseudo : array, shape (4, 4)
        Positive definite [kg m², kg m, kg].
    length : float
        Characteristic length [m].

    Returns
    -------
    array, shape (10,)
        [1].

    Raises
    ------
    numpy.linalg.LinAlgError
        Not positive definite.
    """
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


_UNIT_VECTORS = np.eye(3)


def mount_stiffness_derivatives(mount: CompressorMount) -> RealArray:
    """Differentiate the 6×6 stiffness that one mount adds at the virtual point.

    Parameters
    ----------
    mount : CompressorMount

    Returns
    -------
    array, shape (9, 6, 6)
        With respect to position [1/m], rotation [1/rad] and stiffness [m/N], three each.
    """
    turn, forward = mount.orientation, forward_matrix(mount.position)
    in_vehicle = turn @ np.diag(mount.stiffness) @ turn.T
    derivatives = np.empty((9, 6, 6))
    for axis in range(3):
        moved = np.hstack([np.zeros((3, 3)), skew(_UNIT_VECTORS[axis]).T])
        derivatives[axis] = plus_transpose(forward.T @ in_vehicle @ moved)
        turned = rotation_derivative(mount.rotation, axis)
        half = turned @ np.diag(mount.stiffness) @ turn.T
        derivatives[3 + axis] = plus_transpose(forward.T @ half @ forward)
        row = turn[:, axis] @ forward
        derivatives[6 + axis] = np.outer(row, row)
    return derivatives


def plus_transpose(matrix: RealArray) -> RealArray:
    """Add the transpose: the derivative of ``A B Aᵀ`` out of its first half, shape (n, n)."""
    return np.asarray(matrix + matrix.T)


def rotation_derivative(angles: RealArray, axis: int) -> RealArray:
    """Differentiate ``R = Rz Ry Rx`` with respect to one of its angles.

    Parameters
    ----------
    angles : array, shape (3,)
        About the fixed axes x, then y, then z [rad].
    axis : int
        0, 1 or 2: which angle.

    Returns
    -------
    array, shape (3, 3)
        [1/rad].
    """
    before, after = angles.copy(), angles.copy()
    before[axis:] = 0.0
    after[:axis] = 0.0
    return np.asarray(rotation_matrix(after) @ skew(_UNIT_VECTORS[axis]) @ rotation_matrix(before))


class Parametrisation(Protocol):
    """Numbers that an optimiser moves, and the compressor they stand for.

    Every parametrisation is a set of functions of one vector `values`, shape (n_parameters,), of
    the units it states. Its derivatives are analytic.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """One per parameter."""
        ...

    @property
    def units(self) -> tuple[str, ...]:
        """One per parameter."""
        ...

    def model(self, values: RealArray) -> CompressorModel:
        """Build the compressor that the numbers stand for; InputError where they stand for none."""
        ...

    def sensitivities(self, values: RealArray, frequency: RealArray) -> ComplexArray:
        """Differentiate the apparent mass, shape (n_parameters, n_frequency, 6, 6)."""
        ...

    def mass_sensitivities(self, values: RealArray) -> RealArray:
        """Differentiate the 6×6 mass matrix, shape (n_parameters, 6, 6)."""
        ...


N_MASS, N_STIFFNESS = 10, 20
_ENTRIES = [
    (row, column) for row in range(6) for column in range(row, 6) if (row, column) != (2, 5)
]


@dataclass(frozen=True)
class MinimalParameters:
    """Ten numbers of mass, twenty of stiffness, five of gain.

    Parameters
    ----------
    length : float
        Characteristic length by which rotations are scaled, printed with every result [m].
    stiffness_scale : float
        A typical mount stiffness [N/m].
    reference_frequency : float
        Where the real part of the gain is 1, so that K_VP is the real stiffness of that line [Hz].

    Notes
    -----
    The trace of the coupling block of K_VP is zero, since mounts have no rotational stiffness of
    their own; the entry z–rz follows from it. The gain has five numbers left of six because its
    scale and that of K_VP are one.
    """

    length: float
    stiffness_scale: float = 1e4
    reference_frequency: float = 20.0

    @property
    def names(self) -> tuple[str, ...]:
        """One per parameter."""
        axes = ("x", "y", "z", "rx", "ry", "rz")
        entries = tuple(f"K {axes[row]} {axes[column]} / scale" for row, column in _ENTRIES)
        return MASS_PARAMETER_NAMES + entries + GAIN_SHAPE_NAMES

    @property
    def units(self) -> tuple[str, ...]:
        """One per parameter: all are scaled to pure numbers."""
        return ("1",) * len(self.names)

    @property
    def stiffness_basis(self) -> RealArray:
        """6×6 matrix that each stiffness parameter multiplies, shape (20, 6, 6)."""
        unit = np.repeat([1.0, self.length], 3)
        basis = np.zeros((N_STIFFNESS, 6, 6))
        for number, (row, column) in enumerate(_ENTRIES):
            entry = self.stiffness_scale * unit[row] * unit[column]
            basis[number, row, column] = basis[number, column, row] = entry
            if (row, column) in ((0, 3), (1, 4)):
                basis[number, 2, 5] = basis[number, 5, 2] = -entry
        return basis

    def gain(self, values: RealArray) -> GainFactor:
        """Gain factor of the last five parameters, 1 in its real part at the reference line."""
        return gain_from_parameters(values[N_MASS + N_STIFFNESS :], self.reference_frequency)

    def stiffness(self, values: RealArray) -> RealArray:
        """K_VP at the reference line, shape (6, 6) [N/m, N/rad, N m/rad]."""
        numbers = values[N_MASS : N_MASS + N_STIFFNESS]
        return np.asarray(np.tensordot(numbers, self.stiffness_basis, axes=1))

    def model(self, values: RealArray) -> CompressorModel:
        """Build the compressor that the numbers stand for."""
        body = mass_properties(mass_matrix_from_parameters(values[:N_MASS], self.length))
        stiffness, gain = self.stiffness(values), self.gain(values)
        return CompressorModel(body.mass, body.centre, body.inertia, stiffness, gain)

    def sensitivities(self, values: RealArray, frequency: RealArray) -> ComplexArray:
        """Differentiate the apparent mass, shape (35, n_frequency, 6, 6)."""
        lines = np.asarray(frequency, dtype=float)
        squared = (2 * np.pi * lines) ** 2
        result = np.zeros((len(self.names), lines.size, 6, 6), dtype=complex)
        result[:N_MASS] = self.mass_sensitivities(values)[:N_MASS, np.newaxis]
        factor = -self.gain(values).at(lines) / squared
        result[N_MASS : N_MASS + N_STIFFNESS] = (
            factor[:, np.newaxis, np.newaxis] * self.stiffness_basis[:, np.newaxis]
        )
        derivatives = gain_derivatives(
            values[N_MASS + N_STIFFNESS :], self.reference_frequency, lines
        )
        shape = -derivatives / squared
        result[N_MASS + N_STIFFNESS :] = shape[..., np.newaxis, np.newaxis] * self.stiffness(values)
        return result

    def mass_sensitivities(self, values: RealArray) -> RealArray:
        """Differentiate the 6×6 mass matrix, shape (35, 6, 6)."""
        result = np.zeros((len(self.names), 6, 6))
        result[:N_MASS] = mass_matrix_derivatives(values[:N_MASS], self.length)
        return result

    def values_of(self, model: CompressorModel) -> RealArray:
        """Find the parameters of a compressor, the inverse of `model`.

        Parameters
        ----------
        model : CompressorModel
            Its K_VP must have a coupling block of trace zero.

        Returns
        -------
        array, shape (35,)
            [1].
        """
        body = RigidBody(model.mass, model.centre, model.inertia)
        reference = float(model.gain.real.at(self.reference_frequency))
        unit = np.repeat([1.0, self.length], 3)
        scaled = model.stiffness * reference / (self.stiffness_scale * np.outer(unit, unit))
        gain = gain_parameters(model.gain, self.reference_frequency)
        stiffness = [scaled[row, column] for row, column in _ENTRIES]
        return np.concatenate([mass_parameters(body, self.length), stiffness, gain])


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
