"""Where the mounts of a running compressor meet a car: everything but the mounts themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.wrench_noise_transfer import (
    measured_lines,
    wrench_accelerance,
    wrench_noise_transfer,
)
from deboom.physics.rigid_body import shift_matrix, skew

if TYPE_CHECKING:
    from deboom.compressor.hose_beams import HoseMatrices
    from deboom.compressor.unbalance_load import RotationSense
    from deboom.measurement.electric_car import ElectricCar
    from deboom.measurement.inertance_test import CompressorMount


@dataclass(frozen=True, eq=False)
class FreeCompressor:
    """A running compressor without mounts and hoses, at its virtual point.

    Parameters
    ----------
    frequency : array, shape (f,)
        Of the rotation [Hz].
    dynamic_stiffness : array, shape (f, 6, 6)
        Of the free body with its turning rotor [N/m, N/rad, N m/rad].
    case_names : tuple of str, length c
        Such as ``7.5 bar``.
    load : array, shape (c, f, 6)
        Of the source, complex peak [N, N m].
    """

    frequency: RealArray
    dynamic_stiffness: ComplexArray
    case_names: tuple[str, ...]
    load: ComplexArray


def free_compressor(
    mass_matrix: RealArray,
    rotor_inertia: float,
    sense: RotationSense,
    frequency: RealArray,
    loads: dict[str, ComplexArray],
) -> FreeCompressor:
    """Put together a running compressor.

    Parameters
    ----------
    mass_matrix : array, shape (6, 6)
        At the virtual point [kg, kg m, kg m²].
    rotor_inertia : float
        Polar moment of the rotor [kg m²].
    sense : RotationSense
    frequency : array, shape (f,)
        [Hz].
    loads : dict of str to array, shape (f, 6)
        By name of the case [N, N m].

    Notes
    -----
    ``D = −ω² (M ± jJ skew(e_x))`` in the rotations, see `RouteModel.with_rotor`.
    """
    mass = np.array(mass_matrix, dtype=complex)
    mass[3:, 3:] += 1j * sense.value * rotor_inertia * skew([1.0, 0.0, 0.0])
    squared = (2 * np.pi * np.asarray(frequency, dtype=float)) ** 2
    return FreeCompressor(
        np.asarray(frequency, dtype=float),
        np.multiply.outer(-squared, mass),
        tuple(loads),
        np.array(list(loads.values()), dtype=complex),
    )


@dataclass(frozen=True, eq=False)
class BodySide:
    """The free body of a car at its points: first m mounts, then the ends of hoses.

    Parameters
    ----------
    name : str
        Of the car.
    frequency : array, shape (f,)
        [Hz].
    points : tuple of str
    receptance : array, shape (f, 6 p, 6 p)
        Six motions per six loads of every point [m/N, 1/N, 1/(N m)].
    transfer : array, shape (f, 6 p)
        Pressure at the ear per load [Pa/N, Pa/(N m)].

    Raises
    ------
    InputError
        Shapes that do not fit together.
    """

    name: str
    frequency: RealArray
    points: tuple[str, ...]
    receptance: ComplexArray
    transfer: ComplexArray

    def __post_init__(self) -> None:
        lines, size = np.size(self.frequency), 6 * len(self.points)
        if self.receptance.shape != (lines, size, size) or self.transfer.shape != (lines, size):
            raise InputError(
                f"car {self.name}: {len(self.points)} points at {lines} lines need {size} loads "
                f"each, not {self.receptance.shape} and {self.transfer.shape}"
            )

    def rigid(self) -> BodySide:
        """Return the same body with holders that do not move; the ear still hears them."""
        return replace(self, receptance=np.zeros_like(self.receptance))


def measured_body(
    car: ElectricCar,
    mounts: Sequence[CompressorMount],
    frequency: npt.ArrayLike,
    hoses: Sequence[str] = (),
) -> BodySide:
    """Return the body of a measured car where these mounts stand, and at the ends of hoses.

    Parameters
    ----------
    car : ElectricCar
    mounts : sequence of CompressorMount
        Called like points of the car; loads and motions are referred to where they stand.
    frequency : array, shape (f,)
        Measured lines [Hz].
    hoses : sequence of str
        Names of hose ends.

    Raises
    ------
    InputError
        A line, a mount or a hose that was not measured.
    """
    lines = np.asarray(frequency, dtype=float)
    places = {mount.name: mount.position for mount in mounts}
    moved = tuple(
        replace(point, position=places.get(point.name, point.position)) for point in car.points
    )
    there = replace(car, points=moved)
    points = (*places, *hoses)
    transfer = wrench_noise_transfer(there, points).at(lines).transfer
    accelerance = wrench_accelerance(there, points)
    rows = measured_lines(accelerance.frequency, lines)
    squared = (2 * np.pi * lines)[:, np.newaxis, np.newaxis] ** 2
    return BodySide(
        car.name, lines, points, -accelerance.values[rows] / squared, transfer.values[:, 0]
    )


@dataclass(frozen=True, eq=False)
class CarSeam:
    """What the mounts see of compressor and car, six motions and loads at each of m mounts.

    Parameters
    ----------
    car : str
    frequency : array, shape (f,)
        [Hz].
    case_names : tuple of str, length c
    free : array, shape (c, f, 6 m)
        Motion of the compressor over that of the body with nothing between them [m, rad].
    compliance : array, shape (f, 6 m, 6 m)
        How the loads of the mounts on the body lessen it [m/N, 1/N, 1/(N m)].
    transfer : array, shape (f, 6 m)
        Pressure at the ear per such load, hoses included [Pa/N, Pa/(N m)].
    direct : array, shape (c, f)
        Pressure without mounts, through the hoses [Pa].

    Notes
    -----
    With loads q of the mounts, relative motion ``r = free − compliance q`` and pressure
    ``p = direct + transferᵀ q``.
    """

    car: str
    frequency: RealArray
    case_names: tuple[str, ...]
    free: ComplexArray
    compliance: ComplexArray
    transfer: ComplexArray
    direct: ComplexArray


def car_seam(
    running: FreeCompressor,
    positions: RealArray,
    body: BodySide,
    hoses: HoseMatrices | None = None,
) -> CarSeam:
    """Join compressor, body and hoses, and leave the places of the mounts open.

    Parameters
    ----------
    running : FreeCompressor
    positions : array, shape (m, 3)
        Of the mounts, from the virtual point [m].
    body : BodySide
        At the m mounts and the ends of the hoses, in their order, same lines.
    hoses : HoseMatrices, optional
        None where nothing but the mounts joins both.

    Returns
    -------
    CarSeam

    Raises
    ------
    InputError
        Other lines or points.

    Notes
    -----
    Primal for compressor x and hose ends h, with receptances Y of the body::

        (D + Z_cc) x − Z_hcᵀ h = F − Vᵀ q
        −Y_hh Z_hc x + (I + Y_hh Z_hh) h = Y_hm q
    """
    lines, size = running.frequency.size, 6 * len(positions)
    n_ends = body.transfer.shape[1] - size
    wanted = 0 if hoses is None else 6 * len(hoses.names)
    if not np.array_equal(body.frequency, running.frequency) or n_ends != wanted:
        raise InputError(
            f"car {body.name}: compressor and body have different lines, or {n_ends // 6} hose "
            f"ends for {wanted // 6} hoses"
        )
    rigid = np.concatenate([shift_matrix(-place) for place in positions])
    own = running.dynamic_stiffness
    mounts, ends = slice(0, size), slice(size, size + n_ends)
    y = body.receptance
    onto = np.zeros((lines, n_ends, 6), dtype=complex)
    held = np.zeros((lines, n_ends, n_ends), dtype=complex)
    if hoses is not None:
        own, onto, held = own + hoses.point, hoses.transfer, hoses.body
    back = -np.swapaxes(onto, 1, 2)
    joined = np.block(
        [[own, back], [-y[:, ends, ends] @ onto, np.eye(n_ends) + y[:, ends, ends] @ held]]
    )
    # columns: one per case, then one per load of a mount
    n_cases = len(running.case_names)
    columns = np.zeros((lines, 6 + n_ends, n_cases + size), dtype=complex)
    columns[:, :6, :n_cases] = np.moveaxis(running.load, 0, -1)
    columns[:, :6, n_cases:] = -rigid.T
    columns[:, 6:, n_cases:] = y[:, ends, mounts]
    motion = np.linalg.solve(joined, columns)
    hose_load = onto @ motion[:, :6] - held @ motion[:, 6:]
    relative = rigid @ motion[:, :6] - y[:, mounts, ends] @ hose_load
    relative[:, :, n_cases:] -= y[:, mounts, mounts]
    heard = np.einsum("fe,fec->fc", body.transfer[:, ends], hose_load)
    heard[:, n_cases:] += body.transfer[:, mounts]
    return CarSeam(
        body.name,
        running.frequency,
        running.case_names,
        np.moveaxis(relative[:, :, :n_cases], -1, 0),
        -relative[:, :, n_cases:],
        heard[:, n_cases:],
        heard[:, :n_cases].T,
    )
