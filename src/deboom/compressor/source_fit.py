"""Unbalance, gas and mounts solved for all lines and sweeps at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.routes import (
    OneFactor,
    OperatingLoad,
    applied,
    mount_covariance,
    noise_covariance,
)
from deboom.compressor.unbalance_load import (
    N_GAS,
    RotationSense,
    gas_columns,
    pressures,
    rotor_columns,
)
from deboom.errors import InputError

if TYPE_CHECKING:
    from deboom.compressor.routes import RouteModel, StiffnessChange
    from deboom.compressor.unbalance_load import GasLaw, RotationSense

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


if TYPE_CHECKING:
    from deboom.compressor.routes import OperatingLoad, RouteModel, StiffnessChange
    from deboom.compressor.unbalance_load import GasLaw, RotationSense

MOUNTS_BELOW = 60.0
"""Where mounts that differ from their model show [Hz]."""
EXPLAINED = 1.05
"""Reduced χ there up to which the model of the mounts is good enough [1]."""
SMALLEST_MISMATCH, LARGEST_MISMATCH = 1e-4, 1.0
MISMATCH_PASSES = 2


@dataclass(frozen=True, eq=False)
class SourceFit:
    """Most probable source, mounts and errors of the route.

    Parameters
    ----------
    sense : RotationSense
    change : StiffnessChange
        Of the mounts.
    gas : GasLaw
    pressure : array, shape (n_pressure,)
        Each once, rising [Pa].
    values : array, shape (n_unknown,)
        Rotor, gas, mounts, errors of the route.
    covariance : array, shape (n_unknown, n_unknown)
        Posterior.
    line_values : array, shape (n_unknown,)
        As `values`, with the change of the mounts that comes nearest to what they do at all lines;
        the same where there is no `mismatch`.
    line_covariance : array, shape (n_unknown, n_unknown)
        Of `line_values`.
    n_gas, n_change : int
        Of real unknowns.
    reduced_chi : float
        Rms of the residuals in units of their noise, nothing allowed for `mismatch` [1].
    mismatch : float
        Relative change of the mounts' stiffness, 1 σ per direction, that `change` cannot describe
        and that the weights allow for; 0 where noise explains the residuals [1].
    converged : bool
    residuals : tuple of array, shape (n_frequency, 6)
        What no source explains, one array per sweep [N, N m].
    whitened : tuple of array, shape (n_frequency, 6)
        The same in units of the noise of one part, mixed where loads share their lines; not a
        number outside of the band [1].
    """

    sense: RotationSense
    change: StiffnessChange
    gas: GasLaw
    pressure: RealArray
    values: RealArray
    covariance: RealArray
    line_values: RealArray
    line_covariance: RealArray
    n_gas: int
    n_change: int
    reduced_chi: float
    mismatch: float
    converged: bool
    residuals: tuple[ComplexArray, ...]
    whitened: tuple[ComplexArray, ...]

    @property
    def rotor(self) -> ComplexArray:
        """Static and dynamic unbalance [kg m, kg m²]."""
        return self.values[:N_ROTOR].view(complex)

    @property
    def gas_slice(self) -> slice:
        """Where the unknowns of the gas stand."""
        return slice(N_ROTOR, N_ROTOR + self.n_gas)

    @property
    def change_slice(self) -> slice:
        """Where those of the mounts stand."""
        return slice(N_ROTOR + self.n_gas, N_ROTOR + self.n_gas + self.n_change)

    @property
    def error_slice(self) -> slice:
        """Where those of the route's errors stand."""
        return slice(N_ROTOR + self.n_gas + self.n_change, self.values.size)

    @property
    def gas_values(self) -> ComplexArray:
        """Axial force, moment and rotating force, shape (n_pressure, 3) [N, N m, N]."""
        return self.gas.gas(self.values[self.gas_slice])

    @property
    def schwarz(self) -> float:
        """Schwarz's criterion of what the mounts are said to do: the smaller the better [1].

        Two fits of the same sweeps differ in χ² and in the number of unknowns of the mounts.
        """
        count = 2 * sum(int(np.count_nonzero(np.isfinite(part))) for part in self.whitened)
        return float(count * self.reduced_chi**2 + self.n_change * np.log(count))

    def gas_derivatives(self) -> ComplexArray:
        """By the unknowns of the gas, shape (n_gas, n_pressure, 3)."""
        return self.gas.derivatives(self.values[self.gas_slice])


def fit_source(
    model: RouteModel,
    loads: Sequence[OperatingLoad],
    sense: RotationSense,
    gas: GasLaw,
    change: StiffnessChange,
    band: tuple[float, float],
) -> SourceFit:
    """Find what turns and what the gas does, out of all sweeps together.

    Parameters
    ----------
    model : RouteModel
        That the loads were made with.
    loads : sequence of OperatingLoad
        At least one.
    sense : RotationSense
    gas : GasLaw
        How pressures hang together; the unbalance is the same at all of them.
    change : StiffnessChange
        What the mounts may have done since they were struck.
    band : (float, float)
        Lines that take part, both ends included [Hz].

    Returns
    -------
    SourceFit

    Raises
    ------
    InputError
        Fewer than six lines in the band.

    Notes
    -----
    ``(AM − Σ c_k C_k − Σ n_k D_k) s = B x + e``: thesis, eq. 36, solved for all lines instead of
    one; C_k are changes of the mounts, D_k errors of the route with unit normal n_k, e the noise of
    sweep and hammer test. To take the errors as unknowns with their prior is the same as to weight
    with their full covariance, which ties every line to every other. Where mounts in operation do
    what no C_k describes, the lines below 60 Hz get the share of it into their weights that brings
    their χ to one.
    """
    problem = SourceProblem(model, loads, sense, gas, change, band)
    values, covariance, converged = problem.solve(problem.start(), 0.0)
    reduced_chi, mismatch = problem.reduced_chi(values, 0.0), 0.0
    for _ in range(MISMATCH_PASSES):
        if problem.reduced_chi(values, mismatch, MOUNTS_BELOW) <= EXPLAINED and mismatch == 0:
            break
        mismatch = _mismatch(problem, values)
        values, covariance, converged = problem.solve(values, mismatch)
    by_line = (
        problem.change_alone(values, covariance, mismatch) if mismatch > 0 else (values, covariance)
    )
    return SourceFit(
        sense,
        change,
        gas,
        problem.pressure,
        values,
        covariance,
        *by_line,
        problem.n_gas,
        problem.deviations.size,
        reduced_chi,
        mismatch,
        converged,
        *problem.residuals(values, mismatch),
    )


def _mismatch(problem: SourceProblem, values: RealArray) -> float:
    """Change of the mounts, direction by direction, that explains the residuals below 60 Hz."""
    low, high = SMALLEST_MISMATCH, LARGEST_MISMATCH
    chi = problem.chi_over_mismatch(values, MOUNTS_BELOW)
    for _ in range(10):
        middle = float(np.sqrt(low * high))
        if chi(middle) > 1:
            low = middle
        else:
            high = middle
    return high


if TYPE_CHECKING:
    from deboom.compressor.routes import OperatingLoad, RouteModel

DECISIVE = 10.0
"""Logarithm of the likelihood ratio from which one sense is certain."""
BEYOND_DOUBT = 100.0
"""The same, from which its size says nothing more."""
MOUNTS_OFF = 0.3
"""Change of the mounts' stiffness that the judgement bears [1]."""
_WORDS = {RotationSense.POSITIVE: "from y to z", RotationSense.NEGATIVE: "from z to y"}


@dataclass(frozen=True)
class SenseOfRotation:
    """Sense of the rotor and how certain it is.

    Parameters
    ----------
    sense : RotationSense
    log_likelihood_ratio : float
        In favour of `sense`, natural logarithm.
    statement : str
        The same in words.
    """

    sense: RotationSense
    log_likelihood_ratio: float
    statement: str


def sense_of_rotation(
    model: RouteModel,
    loads: Sequence[OperatingLoad],
    expected: RotationSense | None = None,
) -> SenseOfRotation:
    """Fit both senses to every sweep and keep the likelier one.

    Parameters
    ----------
    model : RouteModel
        That the loads were made with; the gyroscopic moment of the rotor is far too small to matter
        here.
    loads : sequence of OperatingLoad
        One per sweep.
    expected : RotationSense, optional
        As the data sheet states it.

    Returns
    -------
    SenseOfRotation

    Raises
    ------
    InputError
        Sweeps that turn in different senses, no decision, or another sense than expected.

    Notes
    -----
    Linear fit of unbalance and gas to each sweep, with the route's errors and mounts off by
    `MOUNTS_OFF` as if they were independent from line to line. With the wrong sense y and z
    contradict each other by 180°: the likelihood decides by far.
    """
    ratios = [_in_favour_of_positive(model, load) for load in loads]
    total = sum(ratios)
    sense = RotationSense.POSITIVE if total > 0 else RotationSense.NEGATIVE
    against = [
        load.name
        for load, ratio in zip(loads, ratios, strict=True)
        if ratio * sense.value < -DECISIVE
    ]
    if against:
        raise InputError(
            f"sweep {against[0]} turns against the others, which turn {_WORDS[sense]}: check the "
            "sign of its phases (tacho, channels) or the wiring of the motor"
        )
    if abs(total) < DECISIVE:
        raise InputError(
            "the sweeps fit one sense of rotation as badly as the other: a rotor's load is not "
            "visible in them; check the phase reference"
        )
    if expected is not None and expected is not sense:
        raise InputError(
            f"the sweeps turn {_WORDS[sense]}, the data sheet says {_WORDS[expected]}: the "
            "phases are conjugate, the x axis points the other way, or the motor is wired backwards"
        )
    certainty = (
        "beyond doubt"
        if abs(total) > BEYOND_DOUBT
        else f"logarithm of the likelihood ratio {abs(total):.0f}"
    )
    return SenseOfRotation(
        sense,
        abs(total),
        f"The rotor turns {_WORDS[sense]} ({certainty}).",
    )


def _in_favour_of_positive(model: RouteModel, load: OperatingLoad) -> float:
    """Logarithm of the likelihood ratio of both senses."""
    covariance = noise_covariance(model, (load,), (model.apparent_mass[load.lines],))
    held = MOUNTS_OFF * applied(model.mounts[load.lines], load.motion)
    covariance += np.einsum("fa,fb->fab", held, held.conj())
    errors = applied(model.by_error[:, load.lines], load.motion)
    covariance += np.einsum("kfa,kfb->fab", errors, errors.conj())
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    right = (whitener @ load.load[..., np.newaxis]).ravel()
    cost = {}
    for sense in RotationSense:
        gas = np.broadcast_to(gas_columns(sense), (load.frequency.size, 6, N_GAS))
        columns = np.concatenate([rotor_columns(load.frequency, sense), gas], axis=-1)
        rows = (whitener @ columns).reshape(right.size, -1)
        scaled = rows / np.linalg.norm(rows, axis=0)
        found, *_ = np.linalg.lstsq(scaled, right)
        cost[sense] = float(np.sum(np.abs(right - scaled @ found) ** 2))
    return 0.5 * (cost[RotationSense.NEGATIVE] - cost[RotationSense.POSITIVE])


if TYPE_CHECKING:
    from deboom.compressor.gain import GainFactor
    from deboom.compressor.routes import FactorOverFrequency
    from deboom.compressor.source_fit import SourceFit

STATED_AT = 30.0
"""Line at which the change is put in words: within the rigid-body modes, which show it [Hz]."""
SIGNIFICANCE = 1e-4
SMALLEST_CHANGE = 0.01
"""Of the dynamic stiffness: below it nothing is reported [1]."""


@dataclass(frozen=True, eq=False)
class MountState:
    """Dynamic stiffness in operation over that of the hammer test, minus one.

    Parameters
    ----------
    storage, loss : float
        Relative change of real and imaginary part of the dynamic stiffness at `STATED_AT` [1].
    storage_deviation, loss_deviation : float
        1 σ [1].
    changed : bool
        Significant, and of a size that matters.
    statement : str
        The same in words.
    frequency : array, shape (n_frequency,)
        [Hz].
    curve : array, shape (n_frequency,)
        Complex change over frequency, as far as knots resolve it [1].
    curve_deviation : array, shape (n_frequency,)
        1 σ of its amplitude [1].
    """

    storage: float
    loss: float
    storage_deviation: float
    loss_deviation: float
    changed: bool
    statement: str
    frequency: RealArray
    curve: ComplexArray
    curve_deviation: RealArray


def mount_state(
    common: SourceFit,
    resolved: SourceFit,
    factor: FactorOverFrequency,
    gain: GainFactor,
    frequency: RealArray,
) -> MountState:
    """Compare the mounts of two states.

    Parameters
    ----------
    common : SourceFit
        With `OneFactor` for all speeds.
    resolved : SourceFit
        With `factor`.
    factor : FactorOverFrequency
    gain : GainFactor
        Of the hammer test.
    frequency : array, shape (n_frequency,)
        Of the sweeps [Hz].

    Returns
    -------
    MountState

    Notes
    -----
    χ² test of the common factor with its covariance, in which the hammer test's own uncertainty of
    the stiffness is contained.
    """
    line = np.array([STATED_AT])
    struck = complex(gain.at(line)[0])
    one = OneFactor().basis(line)[:, 0]
    slopes = struck * one
    own = common.covariance[common.change_slice, common.change_slice]
    values = common.values[common.change_slice]
    # relative changes of real and imaginary part of the dynamic stiffness
    parts = np.stack([slopes.real / struck.real, slopes.imag / struck.imag])
    storage, loss = parts @ values
    of_storage, of_loss = np.sqrt(np.diag(parts @ own @ parts.T))
    distance = float(values @ np.linalg.solve(own, values))
    changed = bool(
        chdtrc(values.size, distance) < SIGNIFICANCE and abs(values @ one) > SMALLEST_CHANGE
    )
    basis = factor.basis(frequency)
    own = resolved.line_covariance[resolved.change_slice, resolved.change_slice]
    curve = resolved.line_values[resolved.change_slice] @ basis
    along = (np.exp(-1j * np.angle(curve)) * basis).real
    return MountState(
        float(storage),
        float(loss),
        float(of_storage),
        float(of_loss),
        changed,
        _statement(changed, float(storage), float(loss), float(of_storage), float(of_loss)),
        frequency,
        curve,
        np.sqrt(np.einsum("kf,kl,lf->f", along, own, along)),
    )


def _statement(
    changed: bool, storage: float, loss: float, of_storage: float, of_loss: float
) -> str:
    numbers = (
        f"real part {_change(storage, of_storage)}, imaginary part {_change(loss, of_loss)} at "
        f"{STATED_AT:g} Hz"
    )
    if changed:
        return (
            f"The mounts in operation are not those that were struck: {numbers}. Below 50 Hz only "
            "a route that updates them can be trusted."
        )
    return f"The mounts in operation are those that were struck: {numbers}."


def _change(value: float, deviation: float) -> str:
    """Write a change and its 1 σ in percent; nothing has no sign."""
    percent = round(100 * value, 1) + 0.0
    return f"{percent:{'+' if percent else ''}.1f} % ± {100 * deviation:.1f} %"
