"""Pressure in the cabin for any mounts of a compressor, with travel and modes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked
from deboom.compressor.hoses import HoseMatrices
from deboom.errors import InputError
from deboom.explore.space import checked_designs
from deboom.measurement.compressor_test import CompressorMount
from deboom.measurement.electric_car import (
    ElectricCar,
    measured_lines,
    wrench_accelerance,
    wrench_noise_transfer,
)
from deboom.physics import sound_level
from deboom.physics.rigid_body import (
    forward_matrices,
    forward_matrix,
    mount_stiffness_matrix,
    rigid_body_modes,
    shift_matrix,
    skew,
)

STIFFNESS_AXES = ("axial", "radial", "radial")
"""Of the three stiffnesses of a round mount, as part numbers know them."""
COORDINATES = ("x", "y", "z")
DATUM = 100.0
"""A mount that stands where it is drawn has this coordinate: places are counted from a plane so far
before it, so that a tolerance can be a fraction of them [mm]."""
MILLI = 1e-3
GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s²]."""
TRAVEL = "travel under 1 g"
PART = 2**19
"""Complex numbers of the matrices that are solved at a time: they stay near the processor."""


@dataclass(frozen=True, eq=False)
class BodySide:
    """The free body of a car at its points: first m mounts, then the ends of hoses.

    `frequency` (f,): lines [Hz]; `receptance` (f, 6 p, 6 p): six motions per six loads of every
    point [m/N, 1/N, 1/(N m)]; `transfer` (f, 6 p): pressure at the ear per load [Pa/N, Pa/(N m)].
    """

    name: str
    frequency: RealArray
    points: tuple[str, ...]
    receptance: ComplexArray
    transfer: ComplexArray


def measured_body(
    car: ElectricCar,
    mounts: Sequence[CompressorMount],
    frequency: npt.ArrayLike,
    hoses: Sequence[str] = (),
) -> BodySide:
    """Return the body of a measured car where these mounts stand, and at the ends of hoses.

    `frequency` (f,): measured lines [Hz]. InputError: a line, a mount or a hose that was not
    measured.
    """
    lines = np.asarray(frequency, dtype=float)
    places = {mount.name: mount.position for mount in mounts}
    moved = tuple(
        replace(point, position=places.get(point.name, point.position)) for point in car.points
    )
    at_mounts = replace(car, points=moved)
    points = (*places, *hoses)
    transfer = wrench_noise_transfer(at_mounts, points).at(lines).transfer
    accelerance = wrench_accelerance(at_mounts, points)
    rows = measured_lines(accelerance.frequency, lines)
    squared = (2 * np.pi * lines)[:, np.newaxis, np.newaxis] ** 2
    return BodySide(
        car.name, lines, points, -accelerance.values[rows] / squared, transfer.values[:, 0]
    )


@dataclass(frozen=True, eq=False)
class CarSeam:
    """What the mounts see of compressor and car, six motions and loads at each of m mounts.

    `frequency` (f,): lines [Hz]; `free` (c, f, 6 m): motion of the compressor over that of the body
    with nothing between them [m, rad]; `compliance` (f, 6 m, 6 m): how the loads of the mounts on
    the body lessen it [m/N, 1/N, 1/(N m)]; `transfer` (f, 6 m): pressure at the ear per such load,
    hoses included [Pa/N, Pa/(N m)]; `direct` (c, f): pressure without mounts, through the hoses
    [Pa].

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
    mass_matrix: ComplexArray,
    loads: Mapping[str, ComplexArray],
    positions: RealArray,
    body: BodySide,
    hoses: HoseMatrices | None = None,
) -> CarSeam:
    """Join compressor, body and hoses, and leave the places of the mounts open.

    - `mass_matrix` (6, 6): of the running compressor at the virtual point, with the gyroscopic
      moment of its rotor [kg, kg m, kg m²].
    - `loads` (f, 6): load of the source by the name of the case, complex peak [N, N m].
    - `positions` (m, 3): places of the mounts, from the virtual point [m].
    - `body`: body at the m mounts and the ends of the hoses, in their order, same lines.
    - `hoses`, optional: None where nothing but the mounts joins both.

    Primal for the compressor x, ``D = −ω² M``, and hose ends h, with receptances Y of the body::

        (D + Z_cc) x − Z_hcᵀ h = F − Vᵀ q
        −Y_hh Z_hc x + (I + Y_hh Z_hh) h = Y_hm q
    """
    lines, size = body.frequency.size, 6 * len(positions)
    n_ends = body.transfer.shape[1] - size
    rigid = np.concatenate([shift_matrix(-place) for place in positions])
    stiffness = np.multiply.outer(-((2 * np.pi * body.frequency) ** 2), mass_matrix)
    mounts, ends = slice(0, size), slice(size, size + n_ends)
    y = body.receptance
    onto = np.zeros((lines, n_ends, 6), dtype=complex)
    at_ends = np.zeros((lines, n_ends, n_ends), dtype=complex)
    if hoses is not None:
        stiffness, onto, at_ends = stiffness + hoses.point, hoses.transfer, hoses.body
    back = -np.swapaxes(onto, 1, 2)
    joined = np.block(
        [
            [stiffness, back],
            [-y[:, ends, ends] @ onto, np.eye(n_ends) + y[:, ends, ends] @ at_ends],
        ]
    )
    # columns: one per case, then one per load of a mount
    n_cases = len(loads)
    columns = np.zeros((lines, 6 + n_ends, n_cases + size), dtype=complex)
    columns[:, :6, :n_cases] = np.stack(list(loads.values()), axis=-1)
    columns[:, :6, n_cases:] = -rigid.T
    columns[:, 6:, n_cases:] = y[:, ends, mounts]
    motion = np.linalg.solve(joined, columns)
    hose_load = onto @ motion[:, :6] - at_ends @ motion[:, 6:]
    relative = rigid @ motion[:, :6] - y[:, mounts, ends] @ hose_load
    relative[:, :, n_cases:] -= y[:, mounts, mounts]
    heard = np.einsum("fe,fec->fc", body.transfer[:, ends], hose_load)
    heard[:, n_cases:] += body.transfer[:, mounts]
    return CarSeam(
        body.name,
        body.frequency,
        tuple(loads),
        np.moveaxis(relative[:, :, :n_cases], -1, 0),
        -relative[:, :, n_cases:],
        heard[:, n_cases:],
        heard[:, :n_cases].T,
    )


@checked(scaled="k s", moved="k s")
class MountVariables:
    """Columns of a design of m mounts.

    `names`, `units`: name and unit of each variable; `scaled` (k, 3 m): stiffnesses (axial and two
    radial of each mount) that each variable multiplies; `moved` (k, 3 m): coordinate (x, y, z of
    each mount) that each variable is, at most one.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    scaled: BoolArray
    moved: BoolArray

    @property
    def places(self) -> npt.NDArray[np.intp]:
        """Columns of a design that are coordinates, shape (n_place,)."""
        return np.flatnonzero(self.moved.any(axis=1))

    @property
    def coordinates(self) -> npt.NDArray[np.intp]:
        """Which of the 3 m coordinates these are, shape (n_place,)."""
        return np.asarray(np.argmax(self.moved[self.places], axis=1), dtype=np.intp)

    def factors(self, designs: RealArray) -> RealArray:
        """Return the factor on every stiffness, (n, k) → (n, 3 m) [1]."""
        return np.asarray(np.where(self.scaled, designs[:, :, np.newaxis], 1.0).prod(axis=1))

    def offsets(self, designs: RealArray) -> RealArray:
        """Return how far mounts stand off along `coordinates`, (n, k) → (n, n_place) [m]."""
        return np.asarray(MILLI * (designs[:, self.places] - DATUM))

    def checked(self, designs: npt.ArrayLike) -> RealArray:
        """Return the designs as a finite array of shape (n, k), stiffness factors above 0.

        InputError: anything else.
        """
        array = checked_designs(designs, self.names)
        if not np.all(array[:, self.scaled.any(axis=1)] > 0):
            raise InputError("a design has a stiffness factor that is not positive")
        return array


def mount_variables(
    mounts: Sequence[CompressorMount], *, identical: bool, pieces: bool, places: bool
) -> MountVariables:
    """Return the variables of round mounts: axial and radial stiffness factors, and places.

    - `mounts`: at least one mount.
    - `identical`: one part number for all: the factors ``mounts axial`` and ``mounts radial`` are
      common. Otherwise every mount has its own, ``mount 1 axial`` ….
    - `pieces`: whether identical mounts have one more factor per mount and axis,
      ``mount 1 axial piece`` …: what pieces of one part number differ by.
    - `places`: whether coordinates of all mounts, ``mount 1 x`` … [mm], vary; `DATUM` is as drawn.
    """
    columns = np.arange(3 * len(mounts))
    axis_of, mount_of = np.tile(STIFFNESS_AXES, len(mounts)), columns // 3
    axes = list(dict.fromkeys(STIFFNESS_AXES))
    names: list[str] = []
    scaled: list[BoolArray] = []
    if identical:
        names += [f"mounts {axis}" for axis in axes]
        scaled += [axis_of == axis for axis in axes]
    if pieces or not identical:
        for number, mount in enumerate(mounts):
            names += [f"{mount.name} {axis}{' piece' if identical else ''}" for axis in axes]
            scaled += [(mount_of == number) & (axis_of == axis) for axis in axes]
    n_scaled, n_moved = len(scaled), columns.size if places else 0
    if places:
        names += [f"{mount.name} {coordinate}" for mount in mounts for coordinate in COORDINATES]
    return MountVariables(
        tuple(names),
        ("1",) * n_scaled + ("mm",) * n_moved,
        np.vstack([*scaled, np.zeros((n_moved, columns.size), dtype=bool)]),
        np.vstack([np.zeros((n_scaled, columns.size), dtype=bool), np.eye(columns.size)[:n_moved]]),
    )


@dataclass(frozen=True, eq=False)
class MountStatics:
    """Travel under 1 g and rigid-body modes, as functions of the stiffness factors.

    `gain`: stiffness that counts over that of `mounts` [1]; `mass`: mass of the compressor [kg];
    `centre` (3,): centre of gravity, from the virtual point [m]; `mass_matrix` (6, 6): at the
    virtual point [kg, kg m, kg m²].

    Rubber is stiffer over frequency than at rest: with the gain of the lowest line travel comes out
    short and modes high, in the same ratio for all designs.
    """

    variables: MountVariables
    mounts: tuple[CompressorMount, ...]
    gain: float
    mass: float
    centre: RealArray
    mass_matrix: RealArray

    response_names = (TRAVEL,)
    response_unit = "mm"

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of each column of the designs."""
        return self.variables.names

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the largest travel of a mount under 1 g along x, y or z, (n, k) → (n, 1) [mm].

        InputError: designs that are no designs of these variables.
        """
        positions = np.array([mount.position for mount in self.mounts])
        stiffness = self._stiffness(designs)
        # a force at the centre of gravity, along each axis in turn
        weight = self.mass * GRAVITY * forward_matrix(self.centre).T
        bodies = np.linalg.solve(stiffness, np.broadcast_to(weight, (len(stiffness), 6, 3)))
        moved = forward_matrices(positions) @ bodies
        far = np.linalg.norm(moved.reshape(len(stiffness), -1, 3, 3), axis=2)
        return np.asarray(1e3 * far.max(axis=(1, 2))[:, np.newaxis])

    def travel_ratio(self, design: RealArray, reference: RealArray) -> float:
        """Return the largest travel under 1 g with a design (k,) over that with another one [1]."""
        both = self(np.stack([design, reference]))[:, 0]
        return float(both[0] / both[1])

    def modes(self, designs: npt.ArrayLike) -> RealArray:
        """Return the six natural frequencies of designs, increasing, (n, k) → (n, 6) [Hz]."""
        stiffness = self._stiffness(designs)
        rows = [rigid_body_modes(self.mass_matrix, matrix)[0] for matrix in stiffness]
        return np.array(rows).reshape(-1, 6)

    def _stiffness(self, designs: npt.ArrayLike) -> RealArray:
        """Stiffness at the virtual point, shape (n, 6, 6)."""
        factors = self.variables.factors(self.variables.checked(designs))
        positions = np.array([mount.position for mount in self.mounts])
        turn = np.array([mount.orientation for mount in self.mounts])
        static = np.array([mount.stiffness for mount in self.mounts])
        values = self.gain * factors.reshape(-1, *static.shape) * static
        return np.asarray(mount_stiffness_matrix(positions, values, turn), dtype=float)


class CabinIndex:
    """SPLV of every car over weighted cases, as a function of stiffnesses and places of the mounts.

    The motion is solved anew for every design: six motions of the running compressor with its
    gyroscopic moment, on mounts whose holders give way as the free bodies do.

    - `variables`: columns of a design.
    - `mounts`: mounts at factor 1, where they are drawn.
    - `gain` (f,): dynamic over static stiffness of all mounts, in operation [1].
    - `seams`: seam of each car; same lines, cases and mounts.
    - `weights`: weights of the cases, not negative; kept normalised to a sum of 1 [1].

    With the loads q of the mounts along their own axes, ``(diag(1/(v k)) + P C Pᵀ) q = P r₀`` and
    ``p = p₀ + tᵀ Pᵀ q``; see `CarSeam` for C, r₀, t, p₀. P takes six motions at the drawn place to
    three along the axes of the mount where it stands, ``Rᵀ [I, −skew(δ)]``: matrix and right side
    are polynomials in the offsets δ. SPLV as in thesis, eq. 35.
    """

    def __init__(
        self,
        variables: MountVariables,
        mounts: tuple[CompressorMount, ...],
        gain: ComplexArray,
        seams: tuple[CarSeam, ...],
        weights: Sequence[float],
    ) -> None:
        self.variables, self.mounts, self.seams = variables, mounts, seams
        self.gain = np.asarray(gain, dtype=complex)
        self.weights = tuple(float(weight / sum(weights)) for weight in weights)
        lines = self.frequency
        self.one_pascal = float(sound_level.splv(sound_level.spl(np.ones(lines.size), lines)))
        basis = self._basis()
        # of every car and line, per product of two offsets, (n_pair, v f, 3 m, 3 m)
        compliance = np.concatenate([seam.compliance for seam in seams])
        self.compliance = np.array(
            [
                basis[i] @ compliance @ basis[j].T
                + (basis[j] @ compliance @ basis[i].T if i != j else 0)
                for i, j in zip(*self._pairs, strict=True)
            ]
        )
        # per offset, case, car and line, (n_offset, c, v f, 3 m); then without the cases
        free = np.concatenate([seam.free for seam in seams], axis=1)
        transfer = np.concatenate([seam.transfer for seam in seams])
        self.free = np.array([free @ rows.T for rows in basis])
        self.transfer = np.array([transfer @ rows.T for rows in basis])
        # per case, car and line, (c, v f)
        self.direct = np.concatenate([seam.direct for seam in seams], axis=1)

    def _basis(self) -> RealArray:
        """P at the drawn places, then its derivative by every offset, (n_offset, 3 m, 6 m)."""
        m, coordinates = len(self.mounts), self.variables.coordinates
        basis = np.zeros((1 + coordinates.size, 3 * m, 6 * m))
        for number, mount in enumerate(self.mounts):
            rows, turn = slice(3 * number, 3 * number + 3), mount.orientation.T
            basis[0, rows, 6 * number : 6 * number + 3] = turn
            for place in np.flatnonzero(coordinates // 3 == number):
                along = np.eye(3)[coordinates[place] % 3]
                basis[1 + place, rows, 6 * number + 3 : 6 * number + 6] = -turn @ skew(along)
        return basis

    @property
    def _pairs(self) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Which two of 1 and the offsets each product is of."""
        return np.triu_indices(1 + self.variables.coordinates.size)

    @property
    def case_names(self) -> tuple[str, ...]:
        """Name of each case, such as ``7.5 bar``."""
        return self.seams[0].case_names

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (f,) [Hz]."""
        return self.seams[0].frequency

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of each column of the designs."""
        return self.variables.names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each car."""
        return tuple(seam.car for seam in self.seams)

    @property
    def response_unit(self) -> str:
        """Unit of all responses."""
        return "dB(A)"

    @property
    def n_lines(self) -> int:
        """Number of lines in each sum: SPLV over it is the mean level of the lines."""
        return int(self.frequency.size)

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return SPLV of each design in each car, weighted over the cases.

        `designs` (n, k): designs [units of the variables]. Returns (n, v) [dB(A)]. InputError:
        designs of another shape, not finite, or with a factor that is not positive.
        """
        array = self.variables.checked(designs)
        total = np.full((len(array), len(self.seams)), self.one_pascal)
        for rows, case, pressure in self._solved(array):
            with np.errstate(divide="ignore"):
                total[rows] += self.weights[case] * 20 * np.log10(np.abs(pressure)).sum(axis=2)
        return total

    def levels(self, designs: npt.ArrayLike, case: str | None = None) -> RealArray:
        """Return the sound pressure level of every line, (n, v, f) [dB(A)]; as `pressure`."""
        return sound_level.spl(self.pressure(designs, case), self.frequency, axis=-1)

    def pressure(self, designs: npt.ArrayLike, case: str | None = None) -> ComplexArray:
        """Return the pressure at the ear of every car.

        `designs` (n, k): as in `__call__`; `case`: its name, the first if None. Returns (n, v, f)
        complex peak [Pa]. InputError: no such case; designs as in `__call__`.
        """
        array = self.variables.checked(designs)
        if case is not None and case not in self.case_names:
            raise InputError(f"no case {case!r} in the index: use one of {list(self.case_names)}")
        wanted = 0 if case is None else self.case_names.index(case)
        shape = (len(array), len(self.seams), self.n_lines)
        result: ComplexArray = np.empty(shape, dtype=complex)
        for rows, number, pressure in self._solved(array):
            if number == wanted:
                result[rows] = pressure
        return result

    def _solved(self, designs: RealArray) -> Iterator[tuple[slice, int, ComplexArray]]:
        """Yield designs, case, and pressure (n, v, f) [Pa]."""
        step = max(1, PART // max(self.compliance[0].size, 1))
        for start in range(0, len(designs), step):
            rows = slice(start, start + step)
            matrices, right, transfer = self._equations(designs[rows])
            turned = np.swapaxes(matrices, 2, 3)
            adjoint = np.linalg.solve(turned, transfer[..., np.newaxis])[..., 0]
            for case in range(len(self.case_names)):
                heard = self.direct[case] + np.einsum("nfi,nfi->nf", adjoint, right[:, case])
                yield rows, case, heard.reshape(len(heard), len(self.seams), -1)

    def _equations(self, designs: RealArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return S (n, v f, 3 m, 3 m), b (n, c, v f, 3 m), t (n, v f, 3 m)."""
        static = np.concatenate([mount.stiffness for mount in self.mounts])
        stiffness = self.variables.factors(designs) * static
        terms = np.column_stack([np.ones(len(designs)), self.variables.offsets(designs)])
        first, second = self._pairs
        matrices = _combined(terms[:, first] * terms[:, second], self.compliance)
        gain = np.tile(self.gain, len(self.seams))
        diagonal = np.einsum("nfii->nfi", matrices)
        diagonal += 1 / (gain[:, np.newaxis] * stiffness[:, np.newaxis])
        right, transfer = _combined(terms, self.free), _combined(terms, self.transfer)
        return matrices, right, transfer


def _combined(factors: RealArray, parts: ComplexArray) -> ComplexArray:
    """Sum parts (m, …) with real factors (n, m), (n, …)."""
    flat = parts.reshape(len(parts), -1).view(float)
    summed = (factors @ flat).view(complex)
    return np.asarray(summed.reshape(len(factors), *parts.shape[1:]), dtype=np.complex128)
