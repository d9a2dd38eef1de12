"""Quantities that limits are stated for: levels in every vehicle, and what mounts must carry.

Levels wrap a `BoomingModel` and are called like it: designs in, one number per vehicle out, with
exact derivatives. Requirements on the mounts beside being quiet are columns of `MountRequirements`:
carry the weight and the torque, place the modes. `deboom.explore.robust.Limits` says which values
are allowed.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import AXES, ComplexArray, IntArray, RealArray
from deboom.errors import InputError
from deboom.explore.space import checked_designs
from deboom.measurement.channels import Band, LoadCase, lines_inside
from deboom.mounts.mount import Mount, in_mount_axes
from deboom.physics import rigid_body, sound_level
from deboom.physics.dynamic_stiffness import N_PER_MM, dynamic_stiffness
from deboom.vehicles.amplitude_motion import AmplitudeMotion
from deboom.vehicles.booming_model import BoomingModel
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import PathContributions
from deboom.vehicles.kernels import PullBack
from deboom.vehicles.platform import MissingLibrary, Runs
from deboom.vehicles.powertrain import KinematicModel, Powertrain, mount_forward

DIFFERENCE = 1e-4
"""Step of central differences by the factors of a design [1]."""

BLOCK = 512
"""Designs whose levels are in memory at a time."""

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s²]."""

NEPER_TO_DB = 20.0 / np.log(10.0)
MILLIMETRES = 1e3

_LineCase = PathContributions | CoupledMotion


@dataclass(frozen=True, eq=False)
class _VehicleLevel:
    """A level of every vehicle with the names of a booming model."""

    model: BoomingModel

    @property
    def response_unit(self) -> str:
        """Unit of the levels, those of the model's responses."""
        return self.model.response_unit

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Names of the columns of the designs."""
        return self.model.variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return self.model.response_names

    def _line_cases(self, what: str) -> tuple[_LineCase, ...]:
        """Return the load cases, whose pressure must be known line by line."""
        if self.model.loss_factors:
            raise InputError(f"{what} need stiffness factors alone: leave the loss factors out")
        cases = tuple(case for case in self.model.cases if not isinstance(case, AmplitudeMotion))
        if len(cases) < len(self.model.cases):
            raise InputError(
                f"{what} need prescribed or coupled motion, not motion by response surfaces"
            )
        return cases


@dataclass(frozen=True, eq=False)
class MeanLevel(_VehicleLevel):
    """Mean level of the lines of every vehicle, ``SPLV / n_lines`` [dB(A)].

    - `model`: booming model whose weighted load cases are averaged.
    """

    quantity: str = "mean level of the lines"

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the levels of designs (n, k), shape (n, v) [dB(A)]."""
        return np.asarray(self.model(designs) / self.model.n_lines)

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives, shape (n, v, k) [dB(A) per unit factor]."""
        return np.asarray(self.model.gradient(designs) / self.model.n_lines)

    def linearised(self, designs: npt.ArrayLike) -> tuple[RealArray, PullBack]:
        """Return the levels of designs (n, k), shape (n, v), and the pull-back of weights.

        See `BoomingModel.linearised` [dB(A)].
        """
        total, pull_back = self.model.linearised(designs)
        n_lines = self.model.n_lines
        return total / n_lines, lambda weights: pull_back(weights / n_lines)


@dataclass(frozen=True, eq=False)
class PeakLevel(_VehicleLevel):
    """Loudest line of a band in every vehicle, over all load cases that count [dB(A)].

    - `model`: booming model with prescribed or coupled motion. The weights of its load cases play
      no role: the loudest of them counts.
    - `band` (lower, upper): both edges belong to the band [Hz].
    - raises InputError, when it is called: a band without a line of the model, a motion by
      response surfaces, loss factors.

    The derivative is that of the loudest line, ``20/ln 10 Re(∂p_f/∂x_k / p_f)``: exact wherever one
    line is louder than all others, and a subgradient where two are equally loud.
    """

    band: Band
    quantity: str = "peak level"

    @cached_property
    def _cases(self) -> tuple[_LineCase, ...]:
        inside = np.flatnonzero(lines_inside(self.model.frequency, self.band, "the index"))
        return tuple(case.at_lines(inside) for case in self._line_cases("peak levels"))

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the peaks of designs (n, k), shape (n, v) [dB(A)]."""
        return self._loudest(checked_designs(designs, self.variable_names))[0]

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives, shape (n, v, k) [dB(A) per unit factor]."""
        rows = checked_designs(designs, self.variable_names)
        place = self._loudest(rows)[1]
        gradient = np.zeros((*place.shape, rows.shape[1]))
        for number, line in enumerate((c, k) for c in self._cases for k in range(c.frequency.size)):
            loudest = place == number
            lines = np.flatnonzero(loudest.any(axis=1))
            if lines.size:
                slope = line[0].at_lines(np.array([line[1]])).neper_gradient(rows[lines])
                gradient[lines] += np.where(loudest[lines, :, np.newaxis], slope, 0.0)
        return np.asarray(NEPER_TO_DB * gradient)

    def _loudest(self, designs: RealArray) -> tuple[RealArray, IntArray]:
        """Return level and place of the loudest line over all load cases, both (n, v)."""
        energy = np.empty((len(designs), len(self.response_names)))
        place = np.empty(energy.shape, dtype=np.intp)
        weighting = [10.0 ** (sound_level.a_weighting(c.frequency) / 10.0) for c in self._cases]
        for block in _blocks(len(designs)):
            of_case = [_energy(case.pressure(designs[block])) for case in self._cases]
            pairs = zip(of_case, weighting, strict=True)
            lines = np.concatenate([case * weight for case, weight in pairs], axis=-1)
            place[block], energy[block] = lines.argmax(axis=-1), lines.max(axis=-1)
        return _level(energy), place


@dataclass(frozen=True, eq=False)
class ScatteredLevel(_VehicleLevel):
    """Mean level of the lines of every vehicle, each with the energy that scatter adds [dB(A)].

    - `model`: booming model with prescribed or coupled motion. Its weighted load cases are
      averaged.
    - `design` (k,): design at which the energy of the scatter is taken, such as today's [1].
    - `relative_sigma` (k,): standard deviation of each factor over the factor itself [1].
    - raises InputError, when it is called: a motion by response surfaces, loss factors.

    To first order parts that scatter have the mean energy ``|p|² + Σ_k |σ_k x_k ∂p/∂x_k|²`` in a
    line; the sum is that of `design`. A search needs it: the mean level of a single design falls
    without end where all paths cancel in one line, which no part that is made does.
    """

    design: RealArray
    relative_sigma: RealArray

    @cached_property
    def _cases(self) -> tuple[tuple[float, _LineCase, RealArray], ...]:
        """Weight, load case and energy of the scatter (v, f)."""
        steps = DIFFERENCE * np.diag(self.design)
        scatter = []
        cases = self._line_cases("levels with scatter")
        for case in cases:
            ahead, behind = (case.pressure(self.design + step) for step in (steps, -steps))
            change = self.relative_sigma[:, np.newaxis, np.newaxis] * (ahead - behind)
            scatter.append(_energy(change / (2.0 * DIFFERENCE)).sum(axis=0))
        return tuple(zip(self.model.weights, cases, scatter, strict=True))

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the levels of designs (n, k), shape (n, v) [dB(A)]."""
        rows = checked_designs(designs, self.variable_names)
        levels = np.zeros((len(rows), len(self.response_names)))
        for weight, case, scatter in self._cases:
            weighting = sound_level.a_weighting(case.frequency)
            for block in _blocks(len(rows)):
                lines = _level(_energy(case.pressure(rows[block])) + scatter)
                levels[block] += weight * (lines + weighting).mean(axis=-1)
        return levels

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives, shape (n, v, k) [dB(A) per unit factor]."""
        rows = checked_designs(designs, self.variable_names)
        gradient = np.zeros((len(rows), len(self.response_names), len(self.variable_names)))
        for weight, case, scatter in self._cases:
            for block in _blocks(len(rows)):
                pressure = case.pressure(rows[block])
                factor = pressure.conj() / (_energy(pressure) + scatter)
                slope = case.weighted_gradient(rows[block], factor)
                gradient[block] += weight / case.frequency.size * slope
        return np.asarray(NEPER_TO_DB * gradient)


@dataclass(frozen=True, eq=False)
class MountRequirements:
    """Several quantities as one function of designs.

    - `variable_names`: columns of the designs. A variable that no quantity knows has no effect, a
      direction that is no variable keeps its factor 1.
    - `quantities`: at least one quantity.
    """

    variable_names: tuple[str, ...]
    quantities: tuple[Quantity, ...]

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each column of the result."""
        return tuple(name for quantity in self.quantities for name in quantity.names)

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the quantities of designs.

        - `designs` (n, k): stiffness factors, above 0 [1].
        - returns (n, c): [unit of each quantity]; nan where a curve was not measured that far.
        - raises InputError: designs of another shape, not finite or not above 0.
        """
        factors = self._factors(designs)
        return np.hstack([quantity(factors) for quantity in self.quantities])

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives, shape (n, c, k) [unit of each quantity per unit factor].

        Exact where the quantities are smooth: between the measured points of a static curve, and
        for modes of different frequencies. A variable that no quantity knows, such as a loss
        factor, has none.
        """
        factors = self._factors(designs)
        parts = []
        for quantity in self.quantities:
            slopes = quantity.slopes(factors)
            none = np.zeros_like(next(iter(slopes.values())))
            of_names = [slopes.get(name, none) for name in self.variable_names]
            parts.append(np.stack(of_names, axis=-1))
        return np.concatenate(parts, axis=1)

    def _factors(self, designs: npt.ArrayLike) -> Mapping[str, RealArray]:
        """Return the factors (n,) by variable, 1 of any other direction."""
        rows = checked_designs(designs, self.variable_names)
        if np.any(rows <= 0.0):
            raise InputError("a stiffness factor of 0 or less carries nothing: give more than 0")
        given = zip(self.variable_names, rows.T, strict=True)
        return defaultdict(lambda: np.ones(len(rows)), given)


@dataclass(frozen=True, eq=False)
class WeightSag:
    """How far mounts sink under the weight of the powertrain [mm].

    - `model`: quasi-static curves of the mounts that carry the powertrain.
    - `powertrain`: mass and centre of gravity.
    - `mounts`: names ``<mount> [<piece>]``; downward counts positive, from the unloaded mounts.
    - raises InputError, when it is called: a mount that the kinematic model does not have.

    Linear: the tangents of the curves at no torque stand for the way down to there, which no curve
    shows, because suppliers count deflections from the position under the weight. Both meanings of
    a factor have the same tangent there.
    """

    model: KinematicModel
    powertrain: Powertrain
    mounts: tuple[str, ...]
    unit: str = "mm"

    @property
    def names(self) -> tuple[str, ...]:
        """Names such as ``EnM sag``."""
        return tuple(f"{mount} sag" for mount in self.mounts)

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the sag, shape (n, n_mount) [mm]."""
        downward, _, load = self.linear
        position = np.linalg.solve(self._stiffness(factors), load[:, np.newaxis])[..., 0]
        return np.asarray(-MILLIMETRES * (position @ downward.T)[:, self._columns])

    def slopes(self, factors: Mapping[str, RealArray]) -> dict[str, RealArray]:
        """Return the derivatives (n, n_mount) by variable [mm].

        ``K q = load`` gives ``∂q/∂x_d = −K⁻¹ v_d k_d (v_dᵀ q)`` for a direction d with the tangent
        ``k_d`` along ``v_d``.
        """
        downward, tangents, load = self.linear
        forward, stiffness = self.model.forward, self._stiffness(factors)
        # row by row, as in `balanced_deflection`: no row is rounded by those beside it
        deflection = forward @ np.linalg.solve(stiffness, load[:, np.newaxis])
        moved = np.linalg.solve(stiffness, -forward.T * tangents) * np.swapaxes(deflection, 1, 2)
        return _by_variable(self.model.mounts, -MILLIMETRES * downward[self._columns] @ moved)

    def _stiffness(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the stiffness of the powertrain on its mounts, shape (n, 6, 6)."""
        forward = self.model.forward
        stiffness = _of_directions(self.model.mounts, factors) * self.linear[1]
        return np.asarray(forward.T @ (stiffness[..., np.newaxis] * forward))

    @property
    def _columns(self) -> list[int]:
        return [self.model.column(f"{mount} z") for mount in self.mounts]

    @cached_property
    def linear(self) -> tuple[RealArray, RealArray, RealArray]:
        """What the sag follows from.

        - returns: motion of the powertrain → displacement of every piece along vehicle axes
          (n_direction, 6) [1, m/rad], tangent of every direction at no torque (n_direction,) [N/m],
          and weight (6,) [N, N m].
        """
        tangents = self.model.slope(np.zeros(len(self.model.forward)))
        weight = np.array([0.0, 0.0, -self.powertrain.mass * GRAVITY])
        load = np.concatenate([weight, np.cross(self.powertrain.centre, weight)])
        # down is a vehicle axis, however the mounts stand
        upright = [replace(mount, rotations=()) for mount in self.model.mounts]
        return mount_forward(upright), tangents, load


@dataclass(frozen=True, eq=False)
class TorqueTravel:
    """How far mounts deflect under a wheel torque, from the position under the weight [mm].

    - `model`: quasi-static curves of the mounts that carry the powertrain.
    - `wheel_torque`: engine torque times total ratio [N m].
    - `directions`: ``<mount> [<piece>] <axis>``.
    - `factor`: what a stiffness factor means for the curves.
    - raises InputError, when it is called: a direction that the kinematic model does not have.
    """

    model: KinematicModel
    wheel_torque: float
    directions: tuple[str, ...]
    factor: Factor = Factor.dynamic
    unit: str = "mm"

    @property
    def names(self) -> tuple[str, ...]:
        """Names such as ``TSM x travel at 1400 N m``."""
        return tuple(f"{name} travel at {self.wheel_torque:g} N m" for name in self.directions)

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the travel, shape (n, n_direction) [mm]; nan beyond what was measured."""
        return MILLIMETRES * self._balanced(factors)[0][:, self._columns]

    def slopes(self, factors: Mapping[str, RealArray]) -> dict[str, RealArray]:
        """Return the derivatives (n, n_direction) by variable [mm]; nan beyond what was measured.

        ``Vᵀ f(x, V q) = load`` gives ``∂q/∂x_d = −K⁻¹ v_d ∂f_d/∂x_d`` with the tangent stiffness
        ``K = Vᵀ diag(∂f/∂u) V``.
        """
        deflection, stretch, gain = self._balanced(factors)
        forward, slope = self.model.forward, self.model.slope(stretch * deflection)
        if self.factor is Factor.part:
            by_factor = self.model.force(deflection)
        else:
            by_factor = slope * deflection
        stiffness = forward.T @ ((gain * stretch * slope)[..., np.newaxis] * forward)
        moved = np.linalg.solve(stiffness, -forward.T * by_factor[:, np.newaxis])
        return _by_variable(self.model.mounts, MILLIMETRES * forward[self._columns] @ moved)

    def _balanced(self, factors: Mapping[str, RealArray]) -> tuple[RealArray, RealArray, RealArray]:
        """Return deflections, nan beyond what was measured, and what stretches and gains forces.

        - returns (n, n_direction) thrice [m], [1], [1].
        """
        scale = _of_directions(self.model.mounts, factors)
        # F(x u) for the dynamic stiffness, x F(u) for the part
        stretch, gain = scale, np.ones_like(scale)
        if self.factor is Factor.part:
            stretch, gain = gain, stretch
        torque = np.full(len(scale), self.wheel_torque)
        deflection = self.model.balanced(torque, stretch, gain)
        beyond = self.model.outside(stretch * deflection).any(axis=1, keepdims=True)
        return np.where(beyond, np.nan, deflection), stretch, gain

    @property
    def _columns(self) -> list[int]:
        return [self.model.column(name) for name in self.directions]


@dataclass(frozen=True, eq=False)
class NaturalFrequencies:
    """Undamped natural frequencies of the powertrain on its mounts [Hz].

    - `mounts`: mounts that carry the powertrain.
    - `powertrain`: mass matrix.
    - `stiffness`: real part of the dynamic stiffness of one piece at factor 1, by variable [N/m].
    - `modes`: numbers of the modes, from 1, the lowest, to 6.
    - raises InputError: another mode, or a direction without stiffness.
    """

    mounts: tuple[Mount, ...]
    powertrain: Powertrain
    stiffness: Mapping[str, float]
    modes: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    unit: str = "Hz"

    def __post_init__(self) -> None:
        if not set(self.modes) <= set(range(1, 7)):
            raise InputError(f"a rigid body has the modes 1 to 6, not {list(self.modes)}")
        for name in (name for mount in self.mounts for name in mount.variables):
            if not np.isfinite(self.stiffness.get(name, np.nan)):
                raise InputError(
                    f"natural frequencies need the stiffness of {name}, which was not measured: "
                    "measure all axes of the mounts that carry the powertrain"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Names such as ``mode 1``."""
        return tuple(f"mode {mode}" for mode in self.modes)

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the natural frequencies, shape (n, n_mode) [Hz]."""
        return np.asarray(self.solved(factors)[0][:, self._columns])

    def slopes(self, factors: Mapping[str, RealArray]) -> dict[str, RealArray]:
        """Return the derivatives (n, n_mode) by variable [Hz].

        ``∂(ω²)/∂x_d = k_d (v_dᵀ ψ)²`` for a mode ψ with ``ψᵀ M ψ = 1``.
        """
        frequency, shapes = self.solved(factors)
        moved = (mount_forward(self.mounts) @ shapes)[..., self._columns]
        stiffness = _of_directions(self.mounts, self._nominal)[..., np.newaxis]
        slopes = stiffness * moved**2 / (8.0 * np.pi**2 * frequency[:, np.newaxis, self._columns])
        return _by_variable(self.mounts, np.swapaxes(slopes, 1, 2))

    @property
    def _columns(self) -> list[int]:
        return [mode - 1 for mode in self.modes]

    @property
    def _nominal(self) -> Mapping[str, RealArray]:
        return {name: np.array([value]) for name, value in self.stiffness.items()}

    def solved(self, factors: Mapping[str, RealArray]) -> tuple[RealArray, RealArray]:
        """Return all natural frequencies (n, 6) [Hz] and shapes (n, 6, mode), see rigid_body."""
        positions = [position for mount in self.mounts for position in mount.positions]
        stiffness = _of_directions(self.mounts, self._nominal) * _of_directions(
            self.mounts, factors
        )
        turns = None
        if any(mount.tilted_pieces for mount in self.mounts):
            pieces = [(mount, piece) for mount in self.mounts for piece in range(len(mount.pieces))]
            turns = [mount.orientation(piece) for mount, piece in pieces]
        matrix = rigid_body.mount_stiffness_matrix(positions, stiffness, turns).real
        return rigid_body.rigid_body_modes(self.powertrain.mass_matrix, matrix)


@dataclass(frozen=True, eq=False)
class OperatingStiffness:
    """Magnitude of the dynamic stiffness, of a variable or of a sum of variables [N/mm].

    - `stiffness`: stiffness of one piece at factor 1, by variable [N/m].
    - `sums`: name of each column → the variables it is the sum of, once per piece.
    - raises InputError: a variable without stiffness.
    """

    stiffness: Mapping[str, float]
    sums: Mapping[str, Sequence[str]]
    unit: str = "N/mm"

    def __post_init__(self) -> None:
        for name in (name for variables in self.sums.values() for name in variables):
            if not np.isfinite(self.stiffness.get(name, np.nan)):
                raise InputError(
                    f"there is no measured stiffness of {name} to limit: use one of "
                    f"{[name for name, k in self.stiffness.items() if np.isfinite(k)]}"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Names such as ``EnM z stiffness``."""
        return tuple(f"{name} stiffness" for name in self.sums)

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the stiffnesses, shape (n, n_sum) [N/mm]."""
        columns = [
            np.sum([factors[name] * self.stiffness[name] for name in variables], axis=0)
            for variables in self.sums.values()
        ]
        return N_PER_MM * np.column_stack(columns)

    def slopes(self, factors: Mapping[str, RealArray]) -> dict[str, RealArray]:
        """Return the derivatives (n, n_sum) by variable [N/mm]."""
        sums = [list(variables) for variables in self.sums.values()]
        return {
            name: np.outer(
                np.ones_like(factors[name]),
                [N_PER_MM * self.stiffness[name] * variables.count(name) for variables in sums],
            )
            for name in sorted({name for variables in sums for name in variables})
        }


class Quantity(Protocol):
    """Some numbers of a design without scatter, from the stiffness factors by variable."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers."""

    @property
    def unit(self) -> str:
        """Unit of the numbers."""

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the numbers, shape (n, c) [`unit`]; nan where they are not known."""

    def slopes(self, factors: Mapping[str, RealArray]) -> dict[str, RealArray]:
        """Return the derivatives (n, c) by variable [`unit` per unit factor]."""


def _blocks(n_designs: int) -> Iterator[slice]:
    return (slice(first, first + BLOCK) for first in range(0, n_designs, BLOCK))


def _energy(pressure: ComplexArray) -> RealArray:
    return np.asarray(pressure.real**2 + pressure.imag**2)


def _level(energy: RealArray) -> RealArray:
    """Return the level of ``|p|²`` of complex peaks [dB]."""
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(energy / (2.0 * sound_level.REFERENCE_PRESSURE**2)))


def _of_directions(mounts: Sequence[Mount], values: Mapping[str, RealArray]) -> RealArray:
    """Return the values of every direction of every piece, shape (n, n_direction)."""
    return np.column_stack([values[name] for name in _variables(mounts)])


def _by_variable(mounts: Sequence[Mount], slopes: RealArray) -> dict[str, RealArray]:
    """Return derivatives by every direction, (..., n_direction), summed up by variable, (...)."""
    names = np.array(_variables(mounts))
    return {name: slopes[..., names == name].sum(axis=-1) for name in dict.fromkeys(names.tolist())}


def _variables(mounts: Sequence[Mount]) -> list[str]:
    """Return the variable of every direction of every piece."""
    return [name for mount in mounts for _ in mount.pieces for name in mount.variables]


class LimitedLevel(Enum):
    """What is limited in every vehicle."""

    mean = "mean"
    """Mean level of the lines of the band."""
    peak = "peak"
    """Loudest line of the band."""


def limited_response(
    quantity: LimitedLevel, index: BoomingModel, band: Band
) -> MeanLevel | PeakLevel:
    """Return what is limited of a model's levels; the band [Hz] is that of a peak level."""
    return MeanLevel(index) if quantity is LimitedLevel.mean else PeakLevel(index, band)


def mount_price(runs: Runs, factor: Factor, *, at_idle: bool = False) -> MountRequirements:
    """Return what mounts pay for being quiet: sag, travel at full torque, rigid-body modes.

    Without a mount library, and so without static curves, only modes.

    - `at_idle`: whether the travel at the torque of each run at idle is told, too.

    - raises InputError: no static curve of a direction, no [powertrain], no torque.
    """
    names = tuple(name for mount in runs.platform.mounts for name in mount.variables)
    modes = natural_frequencies(runs)
    if isinstance(runs.platform.library_fault, MissingLibrary):
        return MountRequirements(names, (modes,))
    carriers = [mount for mount in runs.platform.mounts if mount.carries_powertrain]
    model, case = static_curves(runs), runs.cases[0][0]
    places = [
        f"{mount.name} {piece}" if piece else mount.name
        for mount in carriers
        for piece in (mount.pieces if len(mount.pieces) > 1 else ("",))
    ]
    travel = [f"{place} {axis}" for place in places for axis in "xz"]
    cases = (case, *(run.case for run in runs.platform.idle if at_idle))
    travels = [
        TorqueTravel(model, round(float(each.wheel_torque.max())), tuple(travel), factor)
        for each in cases
    ]
    sag = WeightSag(model, stated_powertrain(runs), tuple(places))
    quantities: tuple[Quantity, ...] = (sag, *travels, modes)
    return MountRequirements(names, quantities)


def natural_frequencies(runs: Runs) -> NaturalFrequencies:
    """Return the rigid-body modes of the powertrain, as `price` has them; errors likewise."""
    carriers = [mount for mount in runs.platform.mounts if mount.carries_powertrain]
    real = _real_stiffness(carriers, runs.cases[0][0], runs.band)
    return NaturalFrequencies(tuple(carriers), stated_powertrain(runs), real)


def stated_powertrain(runs: Runs) -> Powertrain:
    """Return mass and inertia of the powertrain; InputError if they are not stated."""
    if runs.platform.powertrain is None:
        raise InputError(
            "sag and natural frequencies need mass and inertia: fill in [powertrain] of "
            "platform.toml, or leave out [[sag]] and [[natural_frequency]]"
        )
    return runs.platform.powertrain


def static_curves(runs: Runs) -> KinematicModel:
    """Return how the powertrain rides on its mounts; InputError without static curves."""
    platform = runs.platform
    if isinstance(platform.library_fault, MissingLibrary):
        raise InputError(
            f"sag and travel need static curves, and there is no mount library "
            f"{platform.library_file}: export one there, or leave out [[sag]] and [[travel]]"
        )
    return platform.static_curves()


def _real_stiffness(
    mounts: Sequence[Mount], case: LoadCase, band: tuple[float, float]
) -> dict[str, float]:
    """Mean real part over the lines of a run, per piece, by variable [N/m]."""
    case = in_mount_axes(mounts, case)
    inside = lines_inside(case.force.frequency, band, f"load case {case.name}")
    stiffness = {}
    for mount in mounts:
        for axis, name in zip(AXES, mount.variables, strict=True):
            channels = mount.channels(axis)
            if set(channels) <= set(case.force.channels):
                force = case.force.select(channels).values[inside]
                displacement = case.displacement.select(channels).values[inside]
                stiffness[name] = float(np.mean(dynamic_stiffness(force, displacement).real))
    return stiffness
