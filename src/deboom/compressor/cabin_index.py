"""The seam to the exploration of a compressor's mounts: designs in, one level per car out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.car_seam import CarSeam
from deboom.compressor.mount_variables import MountVariables
from deboom.errors import InputError
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics import sound_level
from deboom.physics.rigid_body import skew

PART = 2**19
"""Complex numbers of the matrices that are solved at a time: they stay near the processor."""


@dataclass(frozen=True, eq=False)
class CabinIndex:
    """SPLV of every car over weighted cases, as a function of stiffnesses and places of the mounts.

    The motion is solved anew for every design: six motions of the running compressor with its
    gyroscopic moment, on mounts whose holders give way as the free bodies do.

    Parameters
    ----------
    variables : MountVariables
        Columns of a design.
    mounts : tuple of CompressorMount, length m
        As they are at factor 1, where they are drawn.
    gain : array, shape (f,)
        Dynamic over static stiffness of all mounts, in operation [1].
    seams : tuple of CarSeam
        One per car; same lines, cases and mounts.
    weights : tuple of float
        Of the cases, not negative; kept normalised to a sum of 1 [1].

    Raises
    ------
    InputError
        Seams that differ in lines or cases, no car, other mounts than variables, weights that are
        negative or all zero.

    Notes
    -----
    With the loads q of the mounts along their own axes, ``(diag(1/(v k)) + P C Pᵀ) q = P r₀`` and
    ``p = p₀ + tᵀ Pᵀ q``; see `CarSeam` for C, r₀, t, p₀. P takes six motions at the drawn place to
    three along the axes of the mount where it stands, ``Rᵀ [I, −skew(δ)]``: matrix and right side
    are polynomials in the offsets δ. SPLV as in thesis, eq. 35.
    """

    variables: MountVariables
    mounts: tuple[CompressorMount, ...]
    gain: ComplexArray
    seams: tuple[CarSeam, ...]
    weights: tuple[float, ...]
    one_pascal: float = field(init=False, repr=False)
    """SPLV of 1 Pa at every line."""
    compliance: ComplexArray = field(init=False, repr=False)
    """Of every car and line, per product of two offsets, (n_pair, v f, 3 m, 3 m)."""
    free: ComplexArray = field(init=False, repr=False)
    """Per offset, case, car and line, (n_offset, c, v f, 3 m)."""
    transfer: ComplexArray = field(init=False, repr=False)
    """Per offset, car and line, (n_offset, v f, 3 m)."""
    direct: ComplexArray = field(init=False, repr=False)
    """Per case, car and line, (c, v f)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", _normalised(self.weights))
        self._check()
        lines = self.frequency
        one = float(sound_level.splv(sound_level.spl(np.ones(lines.size), lines)))
        object.__setattr__(self, "one_pascal", one)
        basis = self._basis()
        first, second = self._pairs
        parts = []
        for one_way, other in zip(first, second, strict=True):
            part = [basis[one_way] @ seam.compliance @ basis[other].T for seam in self.seams]
            if one_way != other:
                for number, seam in enumerate(self.seams):
                    part[number] = part[number] + basis[other] @ seam.compliance @ basis[one_way].T
            parts.append(np.concatenate(part))
        free = np.concatenate([seam.free for seam in self.seams], axis=1)
        transfer = np.concatenate([seam.transfer for seam in self.seams])
        prepared = {
            "gain": np.array(self.gain, dtype=complex),
            "compliance": np.array(parts),
            "free": np.array([free @ one_way.T for one_way in basis]),
            "transfer": np.array([transfer @ one_way.T for one_way in basis]),
            "direct": np.concatenate([seam.direct for seam in self.seams], axis=1),
        }
        for name, array in prepared.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def _check(self) -> None:
        if not self.seams:
            raise InputError("a cabin index needs at least one car")
        first = self.seams[0]
        for seam in self.seams:
            same = np.array_equal(seam.frequency, first.frequency)
            if not same or seam.case_names != first.case_names:
                raise InputError(
                    f"cars {first.car} and {seam.car} have different lines or cases: join both to "
                    "the same running compressor"
                )
        if len({seam.car for seam in self.seams}) < len(self.seams):
            raise InputError(f"two cars have one name: {list(self.response_names)}")
        if len(self.weights) != len(first.case_names):
            raise InputError(
                f"{len(self.weights)} weights for the cases {list(first.case_names)}: one each"
            )
        size = 3 * len(self.mounts)
        if self.variables.scaled.shape[1] != size or first.transfer.shape[1] != 2 * size:
            raise InputError(
                f"{len(self.mounts)} mounts, but variables of {self.variables.scaled.shape[1] // 3}"
                f" and a seam of {first.transfer.shape[1] // 6}"
            )
        if np.shape(self.gain) != first.frequency.shape:
            raise InputError("the gain of the mounts needs one number per line")

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
        """Return SPLV of each design in each car.

        Parameters
        ----------
        designs : array_like, shape (n, k)
            [units of the variables]

        Returns
        -------
        array, shape (n, v)
            [dB(A)]; mean of the cases.

        Raises
        ------
        InputError
            Designs of another shape, not finite, or with a factor that is not positive.
        """
        array = self.variables.checked(designs)
        total = np.full((len(array), len(self.seams)), self.one_pascal)
        for rows, case, pressure in self._solved(array):
            with np.errstate(divide="ignore"):
                total[rows] += self.weights[case] * 20 * np.log10(np.abs(pressure)).sum(axis=2)
        return total

    def levels(self, designs: npt.ArrayLike, case: str | None = None) -> RealArray:
        """Return the sound pressure level of every line in one case.

        Parameters
        ----------
        designs : array_like, shape (n, k)
            [units of the variables]
        case : str, optional
            By default the first one.

        Returns
        -------
        array, shape (n, v, f)
            [dB(A)]

        Raises
        ------
        InputError
            No such case; designs as in `__call__`.
        """
        return sound_level.spl(self.pressure(designs, case), self.frequency, axis=-1)

    def pressure(self, designs: npt.ArrayLike, case: str | None = None) -> ComplexArray:
        """Return the pressure at the ear of every car, (n, v, f) [Pa]; arguments as `levels`."""
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

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivative of SPLV by every variable.

        Parameters
        ----------
        designs : array_like, shape (n, k)
            [units of the variables]

        Returns
        -------
        array, shape (n, v, k)
            [dB(A) per unit of the variable]

        Raises
        ------
        InputError
            As in `__call__`.

        Notes
        -----
        Adjoint: with ``S q = b`` and ``Sᵀ y = t``, ``dp = dtᵀ q + yᵀ db − yᵀ dS q``, exact.
        """
        array = self.variables.checked(designs)
        n_cars, k = len(self.seams), len(self.variables.names)
        total = np.zeros((len(array), n_cars, k))
        for rows in self._parts(array):
            total[rows] = self._gradient(array[rows]).reshape(-1, n_cars, k)
        return np.asarray(20 / np.log(10) * total)

    def _gradient(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f Re(dp/p)``, weighted over the cases, shape (n, v, k)."""
        n, n_cars = len(designs), len(self.seams)
        matrices, right, transfer, stiffness = self._equations(designs)
        adjoint = np.linalg.solve(np.swapaxes(matrices, 2, 3), transfer[..., np.newaxis])[..., 0]
        loads = np.linalg.solve(matrices, np.moveaxis(right, 1, -1))
        pressure = self.direct + np.einsum("nfi,ncfi->ncf", adjoint, right)
        weight = np.array(self.weights)[:, np.newaxis] / pressure
        loads = np.einsum("nfic,ncf->nfi", loads, weight)
        by_car = (n, n_cars, self.n_lines, -1)
        # 1/(v k) falls by dk/(v k²), and dk/dx = k/x
        softer = (adjoint * loads).reshape(by_car) / self.gain[:, np.newaxis]
        by_log = softer.real.sum(axis=2) / stiffness[:, np.newaxis]
        result = by_log @ (self.variables.scaled / designs[:, :, np.newaxis]).swapaxes(1, 2)
        offsets = self.variables.offsets(designs)
        first, second = self._pairs
        terms = np.column_stack([np.ones(n), offsets])
        for place, column in enumerate(self.variables.places, start=1):
            slope = (first == place) * terms[:, second] + (second == place) * terms[:, first]
            turned = np.tensordot(slope, self.compliance, axes=1)
            change = np.einsum("fi,nfi->nf", self.transfer[place], loads)
            change -= np.einsum("nfi,nfij,nfj->nf", adjoint, turned, loads)
            change += np.einsum("nfi,cfi,ncf->nf", adjoint, self.free[place], weight)
            result[:, :, column] = 1e-3 * change.reshape(by_car[:3]).real.sum(axis=2)
        return np.asarray(result)

    def _parts(self, designs: RealArray) -> Iterator[slice]:
        """Yield designs whose matrices stay small together."""
        step = max(1, PART // max(self.compliance[0].size, 1))
        for start in range(0, len(designs), step):
            yield slice(start, start + step)

    def _solved(self, designs: RealArray) -> Iterator[tuple[slice, int, ComplexArray]]:
        """Yield designs, case, and pressure (n, v, f) [Pa]."""
        for rows in self._parts(designs):
            matrices, right, transfer, _ = self._equations(designs[rows])
            turned = np.swapaxes(matrices, 2, 3)
            adjoint = np.linalg.solve(turned, transfer[..., np.newaxis])[..., 0]
            for case in range(len(self.case_names)):
                heard = self.direct[case] + np.einsum("nfi,nfi->nf", adjoint, right[:, case])
                yield rows, case, heard.reshape(len(heard), len(self.seams), -1)

    def _equations(
        self, designs: RealArray
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, RealArray]:
        """Return S (n, v f, 3 m, 3 m), b (n, c, v f, 3 m), t (n, v f, 3 m), k (n, 3 m)."""
        static = np.concatenate([mount.stiffness for mount in self.mounts])
        stiffness = self.variables.factors(designs) * static
        terms = np.column_stack([np.ones(len(designs)), self.variables.offsets(designs)])
        first, second = self._pairs
        matrices = _combined(terms[:, first] * terms[:, second], self.compliance)
        gain = np.tile(self.gain, len(self.seams))
        diagonal = np.einsum("nfii->nfi", matrices)
        diagonal += 1 / (gain[:, np.newaxis] * stiffness[:, np.newaxis])
        right, transfer = _combined(terms, self.free), _combined(terms, self.transfer)
        return matrices, right, transfer, stiffness


def _combined(factors: RealArray, parts: ComplexArray) -> ComplexArray:
    """Sum parts (m, …) with real factors (n, m), (n, …)."""
    flat = parts.reshape(len(parts), -1).view(float)
    summed = (factors @ flat).view(complex)
    return np.asarray(summed.reshape(len(factors), *parts.shape[1:]), dtype=np.complex128)


def _normalised(weights: Sequence[float]) -> tuple[float, ...]:
    total = float(sum(weights))
    if not (all(np.isfinite(weight) and weight >= 0 for weight in weights) and total > 0):
        raise InputError(f"weights {list(weights)}: give numbers of at least 0, one above 0")
    return tuple(float(weight / total) for weight in weights)
