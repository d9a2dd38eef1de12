"""Residuals, slopes and weights of the global fit of a running compressor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.operating_load import (
    OperatingLoad,
    applied,
    mount_covariance,
    noise_covariance,
)
from deboom.compressor.source_structure import gas_columns, pressures, rotor_columns
from deboom.errors import InputError

if TYPE_CHECKING:
    from deboom.compressor.operating_stiffness import StiffnessChange
    from deboom.compressor.route_model import RouteModel
    from deboom.compressor.source_structure import GasLaw
    from deboom.compressor.unbalance_load import RotationSense

N_ROTOR = 4
"""Real unknowns of the rotor: static and dynamic unbalance, real and imaginary part."""
SMALLEST_LINES = 6
LARGEST_STEPS = 15
TOLERANCE = 1e-2
"""Largest step at the end, in standard deviations."""
SHORTEST_STEP = 1 / 64
WORST_STEP = 1.1
"""Cost over the cost before that a step may lead to; a step that leads higher is shortened."""

Indices: TypeAlias = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class _Group:
    """Lines that the same sweeps have, at which the hammer's noise is one and the same.

    `changes` and `errors` hold what each unknown of mounts and route takes off the apparent mass:
    mounts that go by their motion change sweep by sweep.
    """

    members: tuple[int, ...]
    picks: tuple[Indices, ...]
    parts: tuple[OperatingLoad, ...]
    apparent_mass: ComplexArray
    changes: tuple[ComplexArray, ...]
    errors: ComplexArray

    @property
    def frequency(self) -> RealArray:
        return self.parts[0].frequency

    def now(self, values: RealArray) -> list[ComplexArray]:
        """Apparent mass in each sweep, with the unknowns of mounts and route as they are."""
        n_change = len(self.changes[0])
        alike = self.apparent_mass - _combined(values[n_change:], self.errors)
        return [alike - _combined(values[:n_change], part) for part in self.changes]


class SourceProblem:
    """Holds what does not change from step to step; see `source_fit.fit_source`."""

    def __init__(
        self,
        model: RouteModel,
        loads: Sequence[OperatingLoad],
        sense: RotationSense,
        gas: GasLaw,
        change: StiffnessChange,
        band: tuple[float, float],
    ) -> None:
        self.model, self.loads = model, tuple(loads)
        self.sense, self.gas = sense, gas
        self.pressure, self.which = pressures([load.pressure for load in loads])
        inside = [
            np.flatnonzero((load.frequency >= band[0]) & (load.frequency <= band[1]))
            for load in loads
        ]
        if sum(lines.size for lines in inside) < SMALLEST_LINES:
            raise InputError(
                f"fewer than {SMALLEST_LINES} lines of the sweeps lie in {band[0]:g} to "
                f"{band[1]:g} Hz: unbalance and gas cannot be told apart"
            )
        self.n_gas = gas.start(self.pressure).size
        self.deviations = change.deviations
        n_error = model.by_error.shape[0]
        self.prior = np.concatenate(
            [np.zeros(N_ROTOR + self.n_gas), 1 / self.deviations**2, np.ones(n_error)]
        )
        self.groups = []
        for members, picks in _shared_lines(self.loads, inside):
            parts = tuple(self.loads[m].select(p) for m, p in zip(members, picks, strict=True))
            lines = parts[0].lines
            changes = tuple(
                change.matrices(part.frequency, model.mounts[lines], part.motion) for part in parts
            )
            self.groups.append(
                _Group(
                    members,
                    picks,
                    parts,
                    model.apparent_mass[lines],
                    changes,
                    np.ascontiguousarray(model.by_error[:, lines]),
                )
            )

    def start(self) -> RealArray:
        """No unbalance, no change, no error; gas as its law begins."""
        values = np.zeros(self.prior.size)
        values[N_ROTOR : N_ROTOR + self.n_gas] = self.gas.start(self.pressure)
        return values

    def solve(self, values: RealArray, mismatch: float) -> tuple[RealArray, RealArray, bool]:
        """Gauss-Newton: values, covariance, convergence.

        The slopes are those of the predicted motion: measured ones share the noise of the
        residuals, which would draw the whole load towards zero by many percent. At the solution
        the cost may therefore still fall a little, towards that bias.
        """
        for _ in range(LARGEST_STEPS):
            normal, gradient = np.diag(self.prior), self.prior * values
            whiteners = []
            for group in self.groups:
                right, rows = self._equations(group, values)
                whitener = self._whitener(group, values, mismatch)
                white = _real_rows((whitener @ rows).reshape(-1, values.size))
                misfit = _real_rows((whitener @ right[..., np.newaxis]).reshape(-1))
                normal += white.T @ white
                gradient += white.T @ misfit
                whiteners.append(whitener)
            covariance = _inverse(normal)
            step = -covariance @ gradient
            # the size of the step in the metric of the posterior, whatever its direction
            if np.sqrt(abs(step @ normal @ step)) < TOLERANCE:
                return values + step, covariance, True
            limit, share = WORST_STEP * self._cost(values, whiteners), 1.0
            while share > SHORTEST_STEP and self._cost(values + share * step, whiteners) > limit:
                share /= 2
            values = values + share * step
        return values, covariance, False

    def change_alone(
        self, values: RealArray, covariance: RealArray, mismatch: float
    ) -> tuple[RealArray, RealArray]:
        """Fit the change of the mounts again, everything else held, as if there were no mismatch.

        The change that comes nearest to the loads as a whole, not the one of the few lines that a
        mismatch leaves their weight. Returns values and covariance of all unknowns.
        """
        own = slice(N_ROTOR + self.n_gas, N_ROTOR + self.n_gas + self.deviations.size)
        others = np.r_[0 : own.start, own.stop : values.size]
        values = values.copy()
        for _ in range(LARGEST_STEPS):
            normal, gradient = np.diag(self.prior), self.prior * values
            middle = np.zeros((self.deviations.size,) * 2)
            for group in self.groups:
                right, rows = self._equations(group, values)
                whitener = self._whitener(group, values, 0.0)
                white = whitener @ rows
                flat = _real_rows(white.reshape(-1, values.size))
                normal += flat.T @ flat
                gradient += flat.T @ _real_rows((whitener @ right[..., np.newaxis]).reshape(-1))
                adjoint = np.swapaxes(white[..., own], 1, 2).conj() @ whitener
                added = mismatch**2 * mount_covariance(self.model, group.parts)
                middle += np.sum((adjoint @ added @ np.swapaxes(adjoint, 1, 2).conj()).real, axis=0)
            inverse = _inverse(normal[own, own])
            step = -inverse @ gradient[own]
            values[own] += step
            if np.sqrt(step @ normal[own, own] @ step) < TOLERANCE:
                break
        follow = -inverse @ normal[own, others]
        result = covariance.copy()
        with_others = covariance[np.ix_(others, others)] @ follow.T
        result[others, own], result[own, others] = with_others, with_others.T
        result[own, own] = inverse + inverse @ middle @ inverse + follow @ with_others
        return values, result

    def reduced_chi(self, values: RealArray, mismatch: float, below: float = np.inf) -> float:
        """Rms of the whitened residuals below a line [Hz]; 0 where there is none."""
        return self.chi_over_mismatch(values, below)(mismatch)

    def chi_over_mismatch(self, values: RealArray, below: float) -> Callable[[float], float]:
        """Prepare `reduced_chi` for several mismatches."""
        parts = []
        for group in self.groups:
            lines = group.frequency < below
            noise = noise_covariance(self.model, group.parts, self._now(group, values))[lines]
            mounts = mount_covariance(self.model, group.parts)[lines]
            parts.append((self._misfit(group, values)[lines], noise, mounts))
        count = 2 * sum(right.size for right, _, _ in parts)

        def chi(mismatch: float) -> float:
            squares = sum(
                np.sum(
                    right.conj()
                    * np.linalg.solve(noise + mismatch**2 * mounts, right[..., None])[..., 0]
                )
                for right, noise, mounts in parts
            )
            return float(np.sqrt(squares.real / count)) if count else 0.0

        return chi

    def residuals(
        self, values: RealArray, mismatch: float
    ) -> tuple[tuple[ComplexArray, ...], tuple[ComplexArray, ...]]:
        """Of each sweep: plain [N, N m] and whitened [1], not a number outside of the band."""
        plain = tuple(np.full(load.load.shape, np.nan, dtype=complex) for load in self.loads)
        white = tuple(np.full(load.load.shape, np.nan, dtype=complex) for load in self.loads)
        for group in self.groups:
            right = self._misfit(group, values)
            mixed = self._whitener(group, values, mismatch) @ right[..., np.newaxis]
            for number, (member, pick) in enumerate(zip(group.members, group.picks, strict=True)):
                own = slice(6 * number, 6 * number + 6)
                plain[member][pick] = -right[:, own]
                white[member][pick] = mixed[:, own, 0]
        return plain, white

    def _cost(self, values: RealArray, whiteners: Sequence[ComplexArray]) -> float:
        cost = float(self.prior @ values**2)
        for group, whitener in zip(self.groups, whiteners, strict=True):
            white = whitener @ self._misfit(group, values)[..., np.newaxis]
            cost += float(np.sum(np.abs(white) ** 2))
        return cost

    def _now(self, group: _Group, values: RealArray) -> list[ComplexArray]:
        return group.now(values[N_ROTOR + self.n_gas :])

    def _misfit(self, group: _Group, values: RealArray) -> ComplexArray:
        """Load of source less load found, all sweeps of a group, shape (n, 6 n_sweep)."""
        now = self._now(group, values)
        right = [
            self._source(values, member, group.frequency)[0] - applied(own, part.motion)
            for member, part, own in zip(group.members, group.parts, now, strict=True)
        ]
        return np.concatenate(right, axis=1)

    def _equations(self, group: _Group, values: RealArray) -> tuple[ComplexArray, ComplexArray]:
        """Misfit, and its Jacobian of shape (n, 6 n_sweep, n_unknown)."""
        now = self._now(group, values)
        right, rows = [], []
        for member, part, change, own in zip(
            group.members, group.parts, group.changes, now, strict=True
        ):
            source, by_source = self._source(values, member, group.frequency)
            motion = np.asarray(np.linalg.solve(own, source[..., np.newaxis])[..., 0], complex)
            by_rest = [np.moveaxis(applied(one, motion), 0, -1) for one in (change, group.errors)]
            right.append(source - applied(own, part.motion))
            rows.append(np.concatenate([by_source, *by_rest], axis=-1))
        return np.concatenate(right, axis=1), np.concatenate(rows, axis=1)

    def _source(
        self, values: RealArray, number: int, frequency: RealArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Load of rotor and gas in one sweep, shape (n, 6), and its Jacobian."""
        rotor = rotor_columns(frequency, self.sense)
        by_rotor = np.stack([rotor, 1j * rotor], axis=-1).reshape(*rotor.shape[:2], N_ROTOR)
        unknowns = values[N_ROTOR : N_ROTOR + self.n_gas]
        columns, pressure = gas_columns(self.sense), self.which[number]
        by_gas = columns @ self.gas.derivatives(unknowns)[:, pressure].T
        load = by_rotor @ values[:N_ROTOR] + columns @ self.gas.gas(unknowns)[pressure]
        slopes = [by_rotor, np.broadcast_to(by_gas, (frequency.size, *by_gas.shape))]
        return load, np.concatenate(slopes, axis=-1)

    def _whitener(self, group: _Group, values: RealArray, mismatch: float) -> ComplexArray:
        """Inverse of the Cholesky factor of the noise, shape (n, 6 n_sweep, 6 n_sweep)."""
        now = self._now(group, values)
        covariance = noise_covariance(self.model, group.parts, now)
        if mismatch > 0:
            covariance += mismatch**2 * mount_covariance(self.model, group.parts)
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def _combined(values: RealArray, matrices: ComplexArray) -> ComplexArray:
    """Sum of matrices, shape (k, ...), each times a real number: half the work of a complex one."""
    flat = matrices.reshape(len(matrices), -1).view(float)
    return np.asarray((values @ flat).view(complex).reshape(matrices.shape[1:]))


def _real_rows(values: ComplexArray) -> RealArray:
    """Real parts, then imaginary parts, along the first axis."""
    return np.concatenate([values.real, values.imag])


def _shared_lines(
    loads: Sequence[OperatingLoad], inside: Sequence[Indices]
) -> list[tuple[tuple[int, ...], tuple[Indices, ...]]]:
    """Group lines by the sweeps that have them."""
    n_line = 1 + max(int(load.lines.max()) for load in loads)
    where = np.full((len(loads), n_line), -1)
    for number, load in enumerate(loads):
        where[number, load.lines[inside[number]]] = inside[number]
    kinds, kind = np.unique(where >= 0, axis=1, return_inverse=True)
    groups = []
    for number, has in enumerate(kinds.T):
        members = tuple(int(i) for i in np.flatnonzero(has))
        if members:
            columns = np.flatnonzero(kind.reshape(-1) == number)
            groups.append((members, tuple(where[member, columns] for member in members)))
    return groups


def _inverse(normal: RealArray) -> RealArray:
    """Invert with a unit diagonal; an unknown that nothing sees yet stays where it is."""
    diagonal = np.diag(normal)
    unseen = diagonal <= 0
    unit = 1 / np.sqrt(np.where(unseen, 1.0, diagonal))
    scaled = normal * np.outer(unit, unit) + np.diag(unseen.astype(float))
    return np.asarray(np.linalg.inv(scaled) * np.outer(unit, unit))
