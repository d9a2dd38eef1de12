"""Unbalance, gas and mounts of a running compressor, solved for all lines and sweeps at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.model import GainFactor, applied
from deboom.compressor.routes import (
    ONE_FACTOR,
    STATED_AT,
    FactorOverFrequency,
    OperatingLoad,
    RouteModel,
    StiffnessChange,
    mount_covariance,
    noise_covariance,
)
from deboom.compressor.unbalance_load import N_GAS, RotationSense, gas_columns, rotor_columns
from deboom.errors import InputError

N_ROTOR = 4
"""Real unknowns of the rotor: static and dynamic unbalance, real and imaginary part."""
SMALLEST_LINES = 6
LARGEST_STEPS = 30
TOLERANCE = 1e-2
"""Largest step at the end, in standard deviations."""
SHORTEST_STEP = 1 / 64
WORST_STEP = 1.1
"""Cost over the cost before that a step may lead to; a step that leads higher is shortened."""
MOUNTS_BELOW = 60.0
"""Where mounts that differ from their model show [Hz]."""
EXPLAINED = 1.05
"""Reduced χ there up to which the model of the mounts is good enough [1]."""
SMALLEST_MISMATCH, LARGEST_MISMATCH = 1e-4, 1.0
MISMATCH_PASSES = 2
DECISIVE = 10.0
"""Logarithm of the likelihood ratio from which one sense of rotation is certain."""
BEYOND_DOUBT = 100.0
"""The same, from which its size says nothing more."""
MOUNTS_OFF = 0.3
"""Change of the mounts' stiffness that the judgement of the sense bears [1]."""
SIGNIFICANCE = 1e-4
SMALLEST_CHANGE = 0.01
"""Of the dynamic stiffness: below it nothing is reported [1]."""
_WORDS = {RotationSense.POSITIVE: "from y to z", RotationSense.NEGATIVE: "from z to y"}

_Indices: TypeAlias = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class SourceFit:
    """Most probable source, mounts and errors of the route.

    `pressure` (n_pressure,): pressures of the sweeps, each once, rising [Pa]; `values`
    (n_unknown,): rotor, gas, mounts, errors of the route; complex numbers by real and imaginary
    part; `covariance` (n_unknown, n_unknown): posterior; `line_values` (n_unknown,): as `values`,
    with the change of the mounts that comes nearest to what they do at all lines; the same where
    there is no `mismatch`; `line_covariance` (n_unknown, n_unknown): covariance of `line_values`;
    `reduced_chi`: rms of the residuals in units of their noise, nothing allowed for `mismatch` [1];
    `mismatch`: relative change of the mounts' stiffness, 1 σ per direction, that `change` cannot
    describe and that the weights allow for; 0 where noise explains the residuals [1]; `residuals`
    (n_frequency, 6): what no source explains, one array per sweep [N, N m]; `whitened`
    (n_frequency, 6): the same in units of the noise of one part, mixed where loads share their
    lines; not a number outside of the band [1].
    """

    sense: RotationSense
    change: StiffnessChange
    pressure: RealArray
    values: RealArray
    covariance: RealArray
    line_values: RealArray
    line_covariance: RealArray
    reduced_chi: float
    mismatch: float
    converged: bool
    residuals: tuple[ComplexArray, ...]
    whitened: tuple[ComplexArray, ...]

    @property
    def change_slice(self) -> slice:
        """Places of the unknowns of the mounts, between those of rotor and gas and the errors."""
        start = N_ROTOR + 2 * N_GAS * self.pressure.size
        return slice(start, start + self.change.deviations.size)

    @property
    def schwarz(self) -> float:
        """Schwarz's criterion of what the mounts are said to do: the smaller the better [1].

        Two fits of the same sweeps differ in χ² and in the number of unknowns of the mounts.
        """
        count = 2 * sum(int(np.count_nonzero(np.isfinite(part))) for part in self.whitened)
        n_change = self.change.deviations.size
        return float(count * self.reduced_chi**2 + n_change * np.log(count))


def fit_source(
    model: RouteModel,
    loads: Sequence[OperatingLoad],
    sense: RotationSense,
    change: StiffnessChange,
    band: tuple[float, float],
) -> SourceFit:
    """Find what turns and what the gas does, out of all sweeps together.

    `band`: lines that take part, both ends included [Hz]. InputError: fewer than six lines in the
    band.

    ``(AM − Σ c_k C_k − Σ n_k D_k + Σ n_k c_l (L_k C_l + C_l S_k)) s = B x + e``: thesis, eq. 36,
    solved for all lines instead of one; C_k are changes of the mounts, D_k errors of the route with
    unit normal n_k, L_k and S_k what these do to the axes of load and motion (`FrameErrors`), e the
    noise of sweep and hammer test. To take the errors as unknowns with their prior is the same as
    to weight with their full covariance, which ties every line to every other. Where mounts in
    operation do what no C_k describes, the weights of all lines allow for as much of it as brings
    the χ of those below 60 Hz to one.
    """
    problem = _SourceProblem(model, loads, sense, change, band)
    # from mounts as struck, impossible errors of the route would explain the resonances
    start, *_ = problem.solve(
        np.zeros(problem.prior.size), 0.0, problem.n_source + problem.n_change
    )
    values, covariance, converged = problem.solve(start, 0.0)
    reduced_chi, mismatch = problem.chi_over_mismatch(values, np.inf)(0.0), 0.0
    for _ in range(MISMATCH_PASSES):
        chi = problem.chi_over_mismatch(values, MOUNTS_BELOW)
        if chi(mismatch) <= EXPLAINED and mismatch == 0:
            break
        mismatch = _explaining_mismatch(chi)
        # and impossible errors what no change of the mounts describes
        values, covariance, converged = problem.solve(start, mismatch)
    by_line = (
        problem.change_alone(values, covariance, mismatch) if mismatch > 0 else (values, covariance)
    )
    return SourceFit(
        sense,
        change,
        problem.pressure,
        values,
        covariance,
        *by_line,
        reduced_chi,
        mismatch,
        converged,
        *problem.residuals(values, mismatch),
    )


def _explaining_mismatch(chi: Callable[[float], float]) -> float:
    """Change of the mounts, direction by direction, that brings χ to one."""
    low, high = SMALLEST_MISMATCH, LARGEST_MISMATCH
    for _ in range(10):
        middle = float(np.sqrt(low * high))
        if chi(middle) > 1:
            low = middle
        else:
            high = middle
    return high


@dataclass(frozen=True, eq=False)
class _Group:
    """Lines that the same sweeps have, at which the hammer's noise is one and the same.

    `changes` (per sweep, since mounts may go by their motion) and `errors` hold what each unknown
    of mounts and route takes off the apparent mass; `of_changes` (per sweep) and `of_errors` are
    the same line by line, (n, 6 n_unknown, 6); `columns` (per sweep) the load per unknown of rotor
    and gas, shape (n, 6, n_source).
    """

    members: tuple[int, ...]
    picks: tuple[_Indices, ...]
    parts: tuple[OperatingLoad, ...]
    apparent_mass: ComplexArray
    changes: tuple[ComplexArray, ...]
    errors: ComplexArray
    of_changes: tuple[ComplexArray, ...]
    of_errors: ComplexArray
    columns: tuple[ComplexArray, ...]


class _SourceProblem:
    """Residuals, slopes and weights of `fit_source`; order: rotor, gas, mounts, route errors."""

    def __init__(
        self,
        model: RouteModel,
        loads: Sequence[OperatingLoad],
        sense: RotationSense,
        change: StiffnessChange,
        band: tuple[float, float],
    ) -> None:
        self.model, self.loads = model, tuple(loads)
        inside = [
            np.flatnonzero((load.frequency >= band[0]) & (load.frequency <= band[1]))
            for load in loads
        ]
        if sum(lines.size for lines in inside) < SMALLEST_LINES:
            raise InputError(
                f"fewer than {SMALLEST_LINES} lines of the sweeps lie in {band[0]:g} to "
                f"{band[1]:g} Hz: unbalance and gas cannot be told apart"
            )
        self.pressure, which = np.unique([load.pressure for load in loads], return_inverse=True)
        self.n_source = N_ROTOR + 2 * N_GAS * self.pressure.size
        self.n_change = change.deviations.size
        prior_weights = [1 / change.deviations**2, np.ones(model.by_error.shape[0])]
        self.prior = np.concatenate([np.zeros(self.n_source), *prior_weights])
        self.groups = []
        for members, picks in _shared_lines(self.loads, inside):
            parts = tuple(self.loads[m].select(p) for m, p in zip(members, picks, strict=True))
            lines = parts[0].lines
            changes = tuple(
                change.matrices(part.frequency, model.mounts[lines], part.motion) for part in parts
            )
            errors = np.ascontiguousarray(model.by_error[:, lines])
            self.groups.append(
                _Group(
                    members,
                    picks,
                    parts,
                    model.apparent_mass[lines],
                    changes,
                    errors,
                    tuple(_by_line(part) for part in changes),
                    _by_line(errors),
                    tuple(
                        self._source_columns(parts[0].frequency, sense, int(which[member]))
                        for member in members
                    ),
                )
            )

    def solve(
        self, values: RealArray, mismatch: float, n_free: int | None = None
    ) -> tuple[RealArray, RealArray, bool]:
        """Gauss-Newton over the first `n_free` unknowns or all: values, covariance, convergence.

        The slopes are those of the predicted motion: measured ones share the noise of the
        residuals, which would draw the whole load towards zero by many percent. At the solution the
        cost may therefore still fall a little, towards that bias.
        """
        for _ in range(LARGEST_STEPS):
            normal, gradient, cost, parts = self._normal_equations(values, mismatch)
            whiteners = [whitener for whitener, _ in parts]
            covariance = np.zeros_like(normal)
            covariance[:n_free, :n_free] = _inverse(normal[:n_free, :n_free])
            step = -covariance @ gradient
            # the size of the step in the metric of the posterior, whatever its direction
            if np.sqrt(abs(step @ normal @ step)) < TOLERANCE:
                return values + step, covariance, True
            share, most = 1.0, WORST_STEP * cost
            while share > SHORTEST_STEP and self._cost(values + share * step, whiteners) > most:
                share /= 2
            values = values + share * step
        return values, covariance, False

    def change_alone(
        self, values: RealArray, covariance: RealArray, mismatch: float
    ) -> tuple[RealArray, RealArray]:
        """Fit the mounts' change again without mismatch, all else fixed; values and covariance."""
        change = slice(self.n_source, self.n_source + self.n_change)
        others = np.r_[0 : change.start, change.stop : values.size]
        values = values.copy()
        for _ in range(LARGEST_STEPS):
            normal, gradient, _, parts = self._normal_equations(values, 0.0)
            inverse = _inverse(normal[change, change])
            step = -inverse @ gradient[change]
            values[change] += step
            if np.sqrt(step @ normal[change, change] @ step) < TOLERANCE:
                break
        middle = np.zeros((self.n_change,) * 2)
        for group, (whitener, white) in zip(self.groups, parts, strict=True):
            adjoint = np.swapaxes(white[..., change], 1, 2).conj() @ whitener
            added = mismatch**2 * mount_covariance(self.model, group.parts)
            middle += np.sum((adjoint @ added @ np.swapaxes(adjoint, 1, 2).conj()).real, axis=0)
        follow = -inverse @ normal[change, others]
        result = covariance.copy()
        with_others = covariance[np.ix_(others, others)] @ follow.T
        result[others, change], result[change, others] = with_others, with_others.T
        result[change, change] = inverse + inverse @ middle @ inverse + follow @ with_others
        return values, result

    def _normal_equations(
        self, values: RealArray, mismatch: float
    ) -> tuple[RealArray, RealArray, float, list[tuple[ComplexArray, ComplexArray]]]:
        """``Jᵀ J``, ``Jᵀ r`` and ``rᵀ r`` with the priors; whitener, whitened slopes by group."""
        normal, gradient = np.diag(self.prior), self.prior * values
        cost = float(gradient @ values)
        parts = []
        for group in self.groups:
            masses = self._apparent_masses(group, values)
            right, rows = self._equations(group, values, masses)
            whitener = self._whitener(group, masses, mismatch)
            white = whitener @ rows
            flat = _real_rows(white.reshape(-1, values.size))
            left = _real_rows((whitener @ right[..., np.newaxis]).reshape(-1))
            normal += flat.T @ flat
            gradient += flat.T @ left
            cost += float(left @ left)
            parts.append((whitener, white))
        return normal, gradient, cost, parts

    def chi_over_mismatch(self, values: RealArray, below: float) -> Callable[[float], float]:
        """Prepare the rms of the whitened residuals below a line [Hz]; 0 where there is none."""
        parts = []
        for group in self.groups:
            lines = group.parts[0].frequency < below
            now = self._apparent_masses(group, values)
            noise = noise_covariance(self.model, group.parts, now)[lines]
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
            whitener = self._whitener(group, self._apparent_masses(group, values), mismatch)
            mixed = whitener @ right[..., np.newaxis]
            for number, (member, pick) in enumerate(zip(group.members, group.picks, strict=True)):
                rows = slice(6 * number, 6 * number + 6)
                plain[member][pick] = -right[:, rows]
                white[member][pick] = mixed[:, rows, 0]
        return plain, white

    def _source_columns(
        self, frequency: RealArray, sense: RotationSense, pressure: int
    ) -> ComplexArray:
        """Load per real unknown of rotor and gas at one pressure, shape (n, 6, n_source)."""
        columns = np.zeros((frequency.size, 6, self.n_source // 2), dtype=complex)
        columns[..., : N_ROTOR // 2] = rotor_columns(frequency, sense)
        first = N_ROTOR // 2 + N_GAS * pressure
        columns[..., first : first + N_GAS] = gas_columns(sense)
        return np.stack([columns, 1j * columns], axis=-1).reshape(frequency.size, 6, -1)

    def _apparent_masses(self, group: _Group, values: RealArray) -> list[ComplexArray]:
        """Apparent mass in each sweep, with the unknowns of mounts and route as they are."""
        change, errors = np.split(values[self.n_source :], [self.n_change])
        alike = group.apparent_mass - _combined(errors, group.errors)
        taken = [_combined(change, part) for part in group.changes]
        frame = self.model.frame
        return [alike - each + frame.product(errors, each) for each in taken]

    def _misfit(self, group: _Group, values: RealArray) -> ComplexArray:
        """Load of source less load found, all sweeps of a group, shape (n, 6 n_sweep)."""
        source = values[: self.n_source]
        right = [
            columns @ source - applied(mass, part.motion)
            for part, columns, mass in zip(
                group.parts, group.columns, self._apparent_masses(group, values), strict=True
            )
        ]
        return np.concatenate(right, axis=1)

    def _equations(
        self, group: _Group, values: RealArray, masses: Sequence[ComplexArray]
    ) -> tuple[ComplexArray, ComplexArray]:
        """Misfit, and its Jacobian of shape (n, 6 n_sweep, n_unknown)."""
        right, rows = [], []
        change, errors = np.split(values[self.n_source :], [self.n_change])
        frame = self.model.frame
        of_load, of_motion = (np.eye(6) - each for each in frame.combined(errors))
        for part, columns, changes, of_changes, mass in zip(
            group.parts, group.columns, group.changes, group.of_changes, masses, strict=True
        ):
            source = columns @ values[: self.n_source]
            motion = np.asarray(np.linalg.solve(mass, source[..., np.newaxis])[..., 0], complex)
            taken = _combined(change, changes)
            by_change = of_load @ _columns(of_changes, np.asarray(motion @ of_motion.T))
            by_error = _columns(group.of_errors, motion)
            by_error -= np.moveaxis(frame.slopes(taken, motion), 0, -1)
            right.append(source - applied(mass, part.motion))
            rows.append(np.concatenate([columns, by_change, by_error], axis=-1))
        return np.concatenate(right, axis=1), np.concatenate(rows, axis=1)

    def _cost(self, values: RealArray, whiteners: Sequence[ComplexArray]) -> float:
        """Sum of the squared whitened residuals and of the priors."""
        cost = float(self.prior @ values**2)
        for group, whitener in zip(self.groups, whiteners, strict=True):
            white = whitener @ self._misfit(group, values)[..., np.newaxis]
            cost += float(np.sum(np.abs(white) ** 2))
        return cost

    def _whitener(
        self, group: _Group, masses: Sequence[ComplexArray], mismatch: float
    ) -> ComplexArray:
        """Inverse of the Cholesky factor of the noise, shape (n, 6 n_sweep, 6 n_sweep)."""
        covariance = noise_covariance(self.model, group.parts, masses)
        if mismatch > 0:
            covariance += mismatch**2 * mount_covariance(self.model, group.parts)
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def _combined(values: RealArray, matrices: ComplexArray) -> ComplexArray:
    """Sum of matrices, shape (k, ...), each times a real number: half the work of a complex one."""
    flat = matrices.reshape(len(matrices), -1).view(float)
    return np.asarray((values @ flat).view(complex).reshape(matrices.shape[1:]))


def _by_line(matrices: ComplexArray) -> ComplexArray:
    """Put matrices (k, n, 6, 6) below each other at each line, rows first, (n, 6 k, 6)."""
    k, n, *_ = matrices.shape
    return np.ascontiguousarray(np.moveaxis(matrices, 0, 2)).reshape(n, 6 * k, 6)


def _columns(by_line: ComplexArray, motion: ComplexArray) -> ComplexArray:
    """Load per unknown, shape (n, 6, k), of matrices `_by_line` and a motion (n, 6)."""
    return np.asarray((by_line @ motion[..., np.newaxis]).reshape(len(motion), 6, -1))


def _real_rows(values: ComplexArray) -> RealArray:
    """Real parts, then imaginary parts, along the first axis."""
    return np.concatenate([values.real, values.imag])


def _shared_lines(
    loads: Sequence[OperatingLoad], inside: Sequence[_Indices]
) -> list[tuple[tuple[int, ...], tuple[_Indices, ...]]]:
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
    """Invert with a unit diagonal; what nothing sees, or tells apart, stays where it is."""
    diagonal = np.diag(normal)
    unit = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = normal * np.outer(unit, unit) + np.diag((diagonal <= 0).astype(float))
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        inverse = np.linalg.pinv(scaled, hermitian=True)
    return np.asarray(inverse * np.outer(unit, unit))


@dataclass(frozen=True)
class SenseOfRotation:
    """Sense of the rotor, and how certain it is in words."""

    sense: RotationSense
    statement: str


def sense_of_rotation(
    model: RouteModel,
    loads: Sequence[OperatingLoad],
    expected: RotationSense | None = None,
) -> SenseOfRotation:
    """Fit both senses to every sweep and keep the likelier one.

    InputError: sweeps that turn in different senses, no decision, or another sense than expected.

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
    return SenseOfRotation(sense, f"The rotor turns {_WORDS[sense]} ({certainty}).")


def _in_favour_of_positive(model: RouteModel, load: OperatingLoad) -> float:
    """Logarithm of the likelihood ratio of both senses."""
    covariance = noise_covariance(model, (load,), (model.apparent_mass[load.lines],))
    mounts = MOUNTS_OFF * applied(model.mounts[load.lines], load.motion)
    covariance += np.einsum("fa,fb->fab", mounts, mounts.conj())
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
        fit, *_ = np.linalg.lstsq(scaled, right)
        cost[sense] = float(np.sum(np.abs(right - scaled @ fit) ** 2))
    return 0.5 * (cost[RotationSense.NEGATIVE] - cost[RotationSense.POSITIVE])


@dataclass(frozen=True, eq=False)
class MountState:
    """Dynamic stiffness in operation over that of the hammer test, minus one.

    `storage`, `loss`: relative change of real and imaginary part of the dynamic stiffness at
    `STATED_AT` [1]; `changed`: significant, and of a size that matters; `frequency` (n_frequency,):
    lines of the sweeps [Hz]; `curve` (n_frequency,): complex change over frequency, as far as knots
    resolve it [1]; `curve_deviation` (n_frequency,): 1 σ of its amplitude [1]; `single`: name of
    each mount → change of its real part, where they changed apart from each other [1].
    """

    storage: float
    loss: float
    changed: bool
    statement: str
    frequency: RealArray
    curve: ComplexArray
    curve_deviation: RealArray
    single: Mapping[str, float] = field(default_factory=dict)

    def significant(self, frequency: RealArray) -> ComplexArray:
        """Interpolate the change at lines [Hz]; 0 where none is significant, (n_frequency,) [1]."""
        return np.asarray(np.interp(frequency, self.frequency, self.changed * self.curve))


def mount_state(
    common: SourceFit,
    resolved: SourceFit,
    factor: FactorOverFrequency,
    gain: GainFactor,
    frequency: RealArray,
) -> MountState:
    """Compare the mounts in operation with those struck.

    `frequency` (n_frequency,): lines of the sweeps [Hz].

    χ² test of the common factor with its covariance, in which the hammer test's own uncertainty of
    the stiffness is contained.
    """
    line = np.array([STATED_AT])
    struck = complex(gain.at(line)[0])
    basis = ONE_FACTOR.basis(line)[:, 0]
    slopes = struck * basis
    covariance = common.covariance[common.change_slice, common.change_slice]
    values = common.values[common.change_slice]
    # relative changes of real and imaginary part of the dynamic stiffness
    parts = np.stack([slopes.real / struck.real, slopes.imag / struck.imag])
    storage, loss = (float(change) for change in parts @ values)
    of_storage, of_loss = (float(d) for d in np.sqrt(np.diag(parts @ covariance @ parts.T)))
    distance = float(values @ np.linalg.solve(covariance, values))
    changed = bool(
        chdtrc(values.size, distance) < SIGNIFICANCE and abs(values @ basis) > SMALLEST_CHANGE
    )
    numbers = (
        f"real part {_percent(storage, of_storage)}, imaginary part {_percent(loss, of_loss)} at "
        f"{STATED_AT:g} Hz"
    )
    statement = (
        f"The mounts in operation are not those that were struck: {numbers}. Below 50 Hz only "
        "a route that updates them can be trusted."
        if changed
        else f"The mounts in operation are those that were struck: {numbers}."
    )
    over_frequency = factor.basis(frequency)
    covariance = resolved.line_covariance[resolved.change_slice, resolved.change_slice]
    curve = resolved.line_values[resolved.change_slice] @ over_frequency
    along = (np.exp(-1j * np.angle(curve)) * over_frequency).real
    curve_deviation = np.sqrt(np.einsum("kf,kl,lf->f", along, covariance, along))
    return MountState(storage, loss, changed, statement, frequency, curve, curve_deviation)


def _percent(value: float, deviation: float) -> str:
    """Write a change and its 1 σ in percent; nothing has no sign."""
    percent = round(100 * value, 2) + 0.0
    return f"{percent:{'+' if percent else ''}.2f} % ± {100 * deviation:.2f} %"
