"""Curves, effects and certainties of a supplier's parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.explore.robust import RobustResponse, RobustValues, SigmaShares, sigma_shares
from deboom.explore.scatter import sobol_sample
from deboom.explore.sensitivity import (
    SobolIndices,
    design_inputs,
    fast_sobol_indices,
    sobol_designs,
)
from deboom.explore.space import DesignSpace
from deboom.measurement.channels import LoadCase
from deboom.measurement.uncertainty import Interval, pivotal_interval
from deboom.mounts.mount import AXES, mean_operating_stiffness
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points
from deboom.plot import StiffnessPanel
from deboom.study.platform_model import Factor, factor_name
from deboom.study.robust_front import N_PER_MM
from deboom.study.supplier_study import DRAWS, Direction, Need, SupplierStudy
from deboom.study.uncertain_index import UncertainIndex, uncertain_index
from deboom.vehicles.booming_model import model_of_other_data
from deboom.vehicles.booming_peaks import TOLERANCE, PeakChange, compare_peaks
from deboom.vehicles.fleet import lines_inside
from deboom.vehicles.powertrain import KinematicModel, library_model

MEASURED_AGAIN = 120
"""Draws of all measurements."""

MADE = 64
"""Draws of the tolerance in each of them."""


@dataclass(frozen=True, eq=False)
class SupplierCertainty:
    """The same numbers from data as measured and from data measured again.

    Parameters
    ----------
    study : SupplierStudy
        What is asked for.
    designs : mapping of str to array, shape (k,)
        Changed parts → design; today's is not among them [1].
    peak_frequency : array, shape (n_vehicle,)
        Loudest booming peak of each vehicle today, nan where there is none [Hz].
    """

    study: SupplierStudy
    designs: Mapping[str, RealArray]
    peak_frequency: RealArray

    @cached_property
    def uncertain(self) -> UncertainIndex:
        """The run's index with the errors of its data."""
        return uncertain_index(self.study.index, self.study.platform, self.study.parts)

    @cached_property
    def measured(self) -> dict[str, RealArray]:
        """From the data as measured."""
        cases = tuple(case for case, _ in self.study.load_cases)
        return self._drawn(self.study.index, cases)

    @cached_property
    def again(self) -> dict[str, RealArray]:
        """The same with a leading axis of draws."""
        rows = []
        for draw in range(MEASURED_AGAIN):
            fleet, cases = self.uncertain.data.drawn(draw, self.study.run.seed)
            data = self.study.platform
            index = model_of_other_data(
                self.study.index, fleet, data.mounts, data.powertrain, cases
            )
            rows.append(self._drawn(index, cases))
        return {name: np.stack([row[name] for row in rows]) for name in rows[0]}

    def change(self, name: str) -> Interval:
        """Change of the mean level by a design, shape (n_vehicle,) [dB]."""
        return self._interval("change", self._place(name) - 1)

    def mean_change(self, name: str) -> Interval:
        """Its mean over the vehicles [dB]."""
        place = self._place(name) - 1
        return pivotal_interval(
            self.measured["change"][place].mean(), self.again["change"][:, place].mean(axis=1)
        )

    def mean_difference(self, name: str, other: str) -> Interval:
        """Mean level of a design above that of another one [dB]."""
        places = [self._place(one) - 1 for one in (name, other)]
        measured, again = self.measured["change"], self.again["change"]
        return pivotal_interval(
            (measured[places[0]] - measured[places[1]]).mean(),
            (again[:, places[0]] - again[:, places[1]]).mean(axis=1),
        )

    def sigma_ratio(self, name: str) -> Interval:
        """Scatter in a design over today's, both summed over the vehicles [1]."""
        return self._interval("sigma_ratio", self._place(name) - 1)

    def sigma(self, name: str | None) -> Interval:
        """Scatter of the mean level in a design, None: today's, shape (n_vehicle,) [dB]."""
        return self._interval("sigma", self._place(name))

    def peak(self, name: str | None) -> Interval:
        """Level at the loudest peak of today, nan without one, shape (n_vehicle,) [dB(A)]."""
        return self._interval("peak", self._place(name))

    @cached_property
    def stiffness(self) -> Interval:
        """Mean magnitude of every direction over the first load case, nan: none, (n,) [N/m]."""
        return self._interval("stiffness", slice(None))

    @cached_property
    def loss(self) -> Interval:
        """Loss factor of every direction, mean over the same lines, nan: none, (n,) [1]."""
        return self._interval("loss", slice(None))

    @cached_property
    def leads(self) -> RealArray:
        """Share of draws that keep each vehicle's leading direction, to first order [1]."""
        return np.asarray((self.again["leader"] == self.measured["leader"]).mean(axis=0))

    @cached_property
    def share(self) -> Interval:
        """Share of each direction in σ², mean over the vehicles, to first order, (n,) [1]."""
        return self._interval("share", slice(None))

    @cached_property
    def gain(self) -> Interval:
        """σ of the wanted design per unit of each tolerance, to first order, (n,) [dB]."""
        return self._interval("gain", slice(None))

    def _place(self, name: str | None) -> int:
        return 0 if name is None else 1 + list(self.designs).index(name)

    def _interval(self, what: str, place: int | slice) -> Interval:
        measured, again = self.measured[what][place], self.again[what][:, place]
        known = np.isfinite(measured) & np.isfinite(again).all(axis=0)
        found = pivotal_interval(np.where(known, measured, 0.0), np.where(known, again, 0.0))
        lower, upper = (np.where(known, end, np.nan) for end in (found.lower, found.upper))
        return Interval(np.where(known, measured, np.nan), lower, upper, found.coverage)

    def _drawn(self, index: Any, cases: Sequence[LoadCase]) -> dict[str, RealArray]:
        study, scale = self.study, self.study.per_vehicle
        rows = np.stack([study.space.nominal, *self.designs.values()])
        level = index(rows) * scale
        draws = sobol_sample(study.check.n_draws, MADE, seed=study.run.seed)
        robust = replace(study.check, evaluate=index, sample=draws)
        robust_sigma = robust(rows).sigma * scale
        both = np.stack([study.space.nominal, study.wanted])
        today, wanted = index.gradient(both) * scale
        reach = np.abs(today) * (study.space.upper - study.space.lower)
        columns = [direction.column for direction in study.directions]
        squared = (wanted * study.wanted * study.space.relative_sigma) ** 2
        total = squared.sum(axis=1, keepdims=True)
        stiffness, loss = self._stiffness(cases[0])
        return {
            "change": level[1:] - level[0],
            "sigma": robust_sigma,
            "peak": self._peaks(index, rows),
            "sigma_ratio": _sums(robust_sigma)[1:] / _sums(robust_sigma)[0],
            "stiffness": stiffness,
            "loss": loss,
            "leader": reach.argmax(axis=1),
            "share": _over(squared, total)[:, columns].mean(axis=0),
            "gain": _per_tolerance(squared, study.space.tolerance, total)[:, columns].mean(axis=0),
        }

    def _peaks(self, index: Any, rows: RealArray) -> RealArray:
        """Highest level within the tolerance of today's loudest peak, (n, n_vehicle) [dB(A)]."""
        levels, lines = index.levels(rows), np.asarray(index.frequency)
        found = np.full(levels.shape[:2], np.nan)
        for vehicle, frequency in enumerate(self.peak_frequency):
            near = np.abs(lines - frequency) <= TOLERANCE
            if near.any():
                found[:, vehicle] = levels[:, vehicle, near].max(axis=1)
        return found

    def _stiffness(self, case: LoadCase) -> tuple[RealArray, RealArray]:
        """Mean magnitude [N/m] and loss factor [1] of every direction; nan: not measured."""
        mounts, band = self.study.platform.mounts, self.study.band
        lines = lines_inside(case.force.frequency, band, f"load case {case.name}")
        loss = []
        for mount in mounts:
            for axis in AXES:
                names = mount.channels(axis)
                if not set(names) <= set(case.force.channels):
                    loss.append(np.nan)
                    continue
                force = case.force.select(names).values[lines]
                displacement = case.displacement.select(names).values[lines]
                own = (force / displacement).mean(axis=1) if displacement.all() else np.array(1j)
                loss.append(float(np.mean(own.imag / own.real)) if own.size > 1 else np.nan)
        by_mount = [mean_operating_stiffness(mount, case, band) for mount in mounts]
        return np.concatenate(by_mount), np.array(loss)


def _over(values: RealArray, total: RealArray) -> RealArray:
    return np.asarray(np.divide(values, total, out=np.zeros_like(values), where=total > 0))


def _sums(sigma: RealArray) -> RealArray:
    """Over the vehicles, shape (n_design,)."""
    return np.asarray(sigma.sum(axis=-1))


def _per_tolerance(squared: RealArray, tolerance: RealArray, total: RealArray) -> RealArray:
    """``∂σ/∂tol_k = σ_k²/(σ tol_k)``; 0 where there is no tolerance."""
    per_unit = np.divide(squared, tolerance, out=np.zeros_like(squared), where=tolerance > 0)
    return _over(per_unit, np.sqrt(total))


BASE_POINTS = 1024
"""Of the Sobol analysis."""
PART = 4096
"""Designs that are evaluated at a time."""
STEP = 0.01
"""By which a tolerance is made tighter: one percentage point [1]."""
ALL = "all parts"
PICKED = "as searched"
CHANGE = "change of level [dB]"


@dataclass(frozen=True, eq=False)
class SupplierEffects:
    """Effects of the wanted parts; every level is the mean over the lines of a vehicle.

    Parameters
    ----------
    study : SupplierStudy
        Whose parts.
    """

    study: SupplierStudy

    @cached_property
    def designs(self) -> dict[str, RealArray]:
        """Each mount alone as wanted, then all together, each of shape (k,) [1]."""
        alone = {mount.name: self.study.only(mount.name) for mount in self.study.platform.mounts}
        return {**alone, ALL: self.study.wanted}

    @cached_property
    def values(self) -> RobustValues:
        """Today's design, those of `designs`, and the picked one, with independent draws."""
        rows = [self.study.space.nominal, *self.designs.values(), self.study.picked]
        return self.study.check(np.stack(rows))

    @cached_property
    def change(self) -> dict[str, RealArray]:
        """Change of the mean level by `designs`, without scatter, shape (n_vehicle,) [dB]."""
        rows = np.stack([self.study.space.nominal, *self.designs.values()])
        splv = self.study.index(rows)
        return dict(zip(self.designs, (splv[1:] - splv[0]) * self.study.per_vehicle, strict=True))

    @cached_property
    def certainty(self) -> SupplierCertainty:
        """How sure these effects are, from measurements that are drawn again."""
        loudest = [_loudest(changes) for changes in self.peaks(self.study.wanted).values()]
        frequency = [change.frequency if change else np.nan for change in loudest]
        designs = {**self.designs, PICKED: self.study.picked}
        return SupplierCertainty(self.study, designs, np.array(frequency))

    @cached_property
    def half_width(self) -> dict[str, RealArray]:
        """Of the 90 % interval of `change`, shape (n_vehicle,) [dB]."""
        return {name: self.certainty.change(name).half_width for name in self.designs}

    @cached_property
    def importance(self) -> SobolIndices:
        """Sobol indices of every vehicle's level within the bounds of the design."""
        study = self.study
        inputs = design_inputs(study.space)
        designs = sobol_designs(inputs, BASE_POINTS, seed=study.run.seed, second_order=False)
        parts = [study.index(designs[at : at + PART]) for at in range(0, len(designs), PART)]
        return fast_sobol_indices(
            np.concatenate(parts),
            inputs.factors,
            study.vehicles,
            seed=study.run.seed,
            second_order=False,
        )

    @cached_property
    def shares(self) -> SigmaShares:
        """Share of every direction in the scatter of the wanted design.

        Each counts with all of its scatter, also with what parts or axes have in common.
        """
        study = self.study
        if study.check.structure is None:
            return sigma_shares(study.check, study.wanted)
        draws = sobol_sample(study.space.n_variables, DRAWS, seed=study.run.seed)
        return sigma_shares(replace(study.check, sample=draws, structure=None), study.wanted)

    @cached_property
    def tolerance_gain(self) -> RealArray:
        """Fall of σ by a tolerance tighter by one percentage point, shape (k,) [dB].

        σ is the mean over the vehicles, the draws are the same before and after.
        """
        study = self.study
        scale = study.per_vehicle / len(study.vehicles)
        now = study.check(study.wanted[np.newaxis]).sigma_sum[0]
        gains = []
        for column, tolerance in enumerate(study.space.tolerance):
            step = min(STEP, 0.5 * float(tolerance))
            if step == 0.0:
                gains.append(0.0)
                continue
            tighter = with_tolerance(study.check, column, float(tolerance) - step)
            then = tighter(study.wanted[np.newaxis]).sigma_sum[0]
            gains.append(float(now - then) * scale * STEP / step)
        return np.array(gains)

    def peaks(self, design: RealArray) -> dict[str, tuple[PeakChange, ...]]:
        """Booming peaks of each vehicle today and in one design, in the first load case."""
        case, _ = self.study.load_cases[0]
        before, after = self.levels(design)
        frequency = np.asarray(self.study.index.frequency)
        return {
            name: compare_peaks(before[row], after[row], frequency, case.order)
            for row, name in enumerate(self.study.vehicles)
        }

    def levels(self, design: RealArray) -> RealArray:
        """SPL today and in one design, first load case, (2, n_vehicle, n_frequency) [dB(A)]."""
        return np.asarray(self.study.index.levels(np.stack([self.study.space.nominal, design])))


def with_tolerance(robust: RobustResponse, column: int, tolerance: float) -> RobustResponse:
    """Return a response whose variable of one column has another tolerance [1]."""
    space: DesignSpace = robust.space
    tolerances = np.array(space.tolerance)
    tolerances[column] = tolerance
    return replace(robust, space=replace(space, tolerance=tolerances))


def part_table(effects: SupplierEffects, shown: Callable[[str], str]) -> pd.DataFrame:
    """One row per part alone and for all together, and vehicle.

    Parameters
    ----------
    effects : SupplierEffects
        Of all parts.
    shown : callable
        From a vehicle's name to the one that is shown.
    """
    study, sure, rows = effects.study, effects.certainty, []
    scale = study.per_vehicle
    for place, (name, design) in enumerate(effects.designs.items(), 1):
        peaks = effects.peaks(design)
        change, both = sure.change(name), ((None, 0, "today"), (name, place, "then"))
        for row, vehicle in enumerate(study.vehicles):
            loudest = _loudest(peaks[vehicle])
            levels = (loudest.level_before, loudest.level_after) if loudest else (np.nan, np.nan)
            numbers: dict[str, float | str] = {
                "changed": name if name == ALL else f"only {name}",
                "vehicle": shown(vehicle),
                **_with_interval(CHANGE, change.about(effects.change[name]), row),
            }
            for which, at, when in both:
                sigma = sure.sigma(which).about(effects.values.sigma[at] * scale)
                numbers |= _with_interval(f"sigma {when} [dB]", sigma, row)
            numbers["loudest peak [Hz]"] = loudest.frequency if loudest else np.nan
            for (which, _, when), level in zip(both, levels, strict=True):
                peak = sure.peak(which).about(np.full(len(study.vehicles), level))
                numbers |= _with_interval(f"peak {when} [dB(A)]", peak, row)
            rows.append(numbers)
    return pd.DataFrame(rows)


def half_width_label(label: str) -> str:
    """Return the label of the half width that belongs to ``name [unit]``."""
    name, _, unit = label.rpartition(" [")
    return f"{name} ± 90 % [{unit}"


def _with_interval(label: str, interval: Interval, row: int) -> dict[str, float]:
    name, _, unit = label.rpartition(" [")
    return {
        label: float(interval.value[row]),
        f"{name}, from [{unit}": float(interval.lower[row]),
        f"{name}, to [{unit}": float(interval.upper[row]),
    }


def _loudest(changes: Sequence[PeakChange]) -> PeakChange | None:
    """Return the peak that is loudest today."""
    return max(changes, key=lambda change: change.level_before, default=None)


STATIC_FORCE = "static force [N]"
WHEEL_TORQUE = "wheel torque [N m]"
FREQUENCY = "frequency [Hz]"
STEPS = 161
"""Preloads of a curve."""
MICRO = 1e6
"""From m to µm."""


@dataclass(frozen=True)
class CurveCondition:
    """Where on its surface a curve is read: what a dynamic test machine is set to.

    Parameters
    ----------
    frequency : float
        [Hz].
    amplitude : float
        Peak [m].
    """

    frequency: float
    amplitude: float

    def __str__(self) -> str:
        return f"{self.frequency:.4g} Hz, amplitude {self.amplitude * MICRO:.3g} µm"


@dataclass(frozen=True, eq=False)
class StiffnessCurve:
    """Today's dynamic stiffness of one direction over its preload.

    Parameters
    ----------
    direction : Direction
        Which.
    label : str
        Of the preload: static force where it can be computed, else wheel torque, else frequency.
    preload, stiffness : array, shape (n,)
        Of every line of the load cases, magnitude [unit of the label, N/mm].
    loss_factor : array, shape (n,)
        Of the same lines [1].
    frequency, amplitude : array, shape (n,)
        Of the same lines [Hz, m peak].
    n_first : int
        Of them, those of the first load case.
    curve_preload, curve_stiffness : array, shape (m,)
        The surface at one test condition, nan beyond what measurements back; empty without one.
    condition : CurveCondition or None
        Of the curve.
    """

    direction: Direction
    label: str
    preload: RealArray
    stiffness: RealArray
    loss_factor: RealArray
    frequency: RealArray
    amplitude: RealArray
    n_first: int
    curve_preload: RealArray
    curve_stiffness: RealArray
    condition: CurveCondition | None

    @property
    def has_curve(self) -> bool:
        """Whether a part of the curve is backed by measurements."""
        return bool(np.isfinite(self.curve_stiffness).any())

    @property
    def preload_range(self) -> tuple[float, float]:
        """Least and greatest preload in the load cases; nan where there is no line."""
        if self.preload.size == 0:
            return float("nan"), float("nan")
        return float(self.preload.min()), float(self.preload.max())


def stiffness_curves(
    study: SupplierStudy, directions: Sequence[Direction]
) -> tuple[StiffnessCurve, ...]:
    """Return the diagram of every direction that was measured in the load cases.

    Parameters
    ----------
    study : SupplierStudy
        Load cases, surfaces and static curves.
    directions : sequence of Direction
        Which.
    """
    model = _kinematic_model(study)
    found = []
    for direction in directions:
        channels = direction.mount.channels(direction.axis)
        if all(set(channels) <= set(case.force.channels) for case, _ in study.load_cases):
            found.append(_curve(study, direction, channels, model))
    return tuple(found)


def stiffness_panels(
    study: SupplierStudy, curves: Sequence[StiffnessCurve]
) -> tuple[StiffnessPanel, ...]:
    """Return what a figure draws: today's curve and the wanted one with its tolerance.

    Parameters
    ----------
    study : SupplierStudy
        Wanted factors and tolerances.
    curves : sequence of StiffnessCurve
        Of the study.

    Notes
    -----
    A dynamic factor x makes the curve ``x K(F0)``, a factor of the part ``x K(F0/x)``: the part
    rides at the force F0 where today's rides at ``F0/x``.
    """
    panels = []
    for curve in curves:
        direction = curve.direction
        unknown = direction.need is Need.unknown
        asked = direction.need in (Need.wanted, Need.anything)
        factor = float(study.wanted[direction.column])
        shift = preload_factor(study, curve)
        today = (curve.curve_preload, curve.curve_stiffness)
        panels.append(
            StiffnessPanel(
                title=direction.name,
                x_label=curve.label,
                points=(curve.preload, curve.stiffness),
                today=today if curve.has_curve and not unknown else None,
                wanted=(
                    (shift * today[0], factor * today[1]) if curve.has_curve and asked else None
                ),
                wanted_points=(
                    (shift * curve.preload, factor * curve.stiffness)
                    if asked and not curve.has_curve
                    else None
                ),
                tolerance=float(study.space.tolerance[direction.column]),
                note="" if direction.need is Need.wanted else direction.need.value,
            )
        )
    return tuple(panels)


def preload_factor(study: SupplierStudy, curve: StiffnessCurve) -> float:
    """Return the wanted part's preload over today's at the same place of the curve [1]."""
    part = factor_name(study.index) == Factor.part.value
    moves = part and curve.label != FREQUENCY
    return float(study.wanted[curve.direction.column]) if moves else 1.0


def _kinematic_model(study: SupplierStudy) -> KinematicModel | None:
    """Return what gives static forces; None where a static curve is missing."""
    carriers = {mount.name for mount in study.platform.mounts if mount.body_mass is None}
    parts = [part for part in study.parts if part.mount.name in carriers]
    try:
        return library_model(parts) if parts else None
    except InputError:
        return None


def _curve(
    study: SupplierStudy,
    direction: Direction,
    channels: Sequence[str],
    model: KinematicModel | None,
) -> StiffnessCurve:
    label = _label(study, model, channels)
    preload, stiffness, frequency, amplitude = [], [], [], []
    for case, _ in study.load_cases:
        lines = _lines(study, case)
        torque = None if case.engine_torque is None else case.wheel_torque[lines]
        frequency.append(case.displacement.frequency[lines])
        preload.append(_preload(label, model, channels, torque, frequency[-1]))
        stiffness.append(_measured(case, channels, lines))
        moved = np.abs(case.displacement.select(channels).values[lines])
        amplitude.append(moved.mean(axis=1))
    values = np.concatenate(stiffness)
    known = np.isfinite(values)
    condition, x, k = _surface_curve(study, direction, channels, label, model)
    return StiffnessCurve(
        direction,
        label,
        np.concatenate(preload)[known],
        np.abs(values[known]) * N_PER_MM,
        values[known].imag / values[known].real,
        np.concatenate(frequency)[known],
        np.concatenate(amplitude)[known],
        int(np.isfinite(stiffness[0]).sum()),
        x,
        np.abs(k) * N_PER_MM,
        condition,
    )


def _lines(study: SupplierStudy, case: LoadCase) -> npt.NDArray[np.bool_]:
    low, high = study.band
    frequency = case.displacement.frequency
    return np.asarray((frequency >= low) & (frequency <= high))


def _measured(
    case: LoadCase, channels: Sequence[str], lines: npt.NDArray[np.bool_]
) -> ComplexArray:
    """Stiffness of every line, mean over the pieces; nan where a piece does not move [N/m]."""
    force = case.force.select(channels).values[lines]
    displacement = case.displacement.select(channels).values[lines]
    moves = np.abs(displacement) > 0.0
    ratio = np.divide(force, displacement, out=np.full(force.shape, np.nan + 0j), where=moves)
    return np.asarray(ratio.mean(axis=1))


def _label(study: SupplierStudy, model: KinematicModel | None, channels: Sequence[str]) -> str:
    if any(case.engine_torque is None for case, _ in study.load_cases):
        return FREQUENCY
    return STATIC_FORCE if model is not None and channels[0] in model.names else WHEEL_TORQUE


def _preload(
    label: str,
    model: KinematicModel | None,
    channels: Sequence[str],
    torque: RealArray | None,
    frequency: RealArray,
) -> RealArray:
    if torque is None or label == FREQUENCY:
        return frequency
    if model is None or label == WHEEL_TORQUE:
        return torque
    state = model.equilibrium(torque)
    return np.asarray(np.mean([state.of(channel) for channel in channels], axis=0))


def _surface_curve(
    study: SupplierStudy,
    direction: Direction,
    channels: Sequence[str],
    label: str,
    model: KinematicModel | None,
) -> tuple[CurveCondition | None, RealArray, ComplexArray]:
    """Read the surface at the loudest line of the first load case."""
    nothing = (None, np.empty(0), np.empty(0, dtype=complex))
    part = direction.characterised
    if part is None or part.surface is None or label == FREQUENCY:
        return nothing
    surface: DynamicStiffnessSurface = part.surface.response_surface()
    if surface.preload_unit != "N m":
        return nothing
    case, _ = study.load_cases[0]
    frequency = loudest_line(study)
    line = int(np.argmin(np.abs(case.displacement.frequency - frequency)))
    moved = np.abs(case.displacement.select(channels).values[line])
    condition = CurveCondition(frequency, float(moved.mean()))
    torque = np.linspace(0.0, max(c.wheel_torque.max() for c, _ in study.load_cases), STEPS)
    points = operating_points(torque, condition.amplitude, frequency)
    stiffness = surface.predict(points, extrapolate=True)
    preload = _preload(label, model, channels, torque, np.full(STEPS, frequency))
    return condition, preload, np.where(surface.supported(points), stiffness, np.nan)


def loudest_line(study: SupplierStudy) -> float:
    """Return the line with the most sound energy of all vehicles today [Hz]."""
    levels = study.index.levels(study.space.nominal[np.newaxis])[0]
    return float(study.index.frequency[np.argmax((10.0 ** (levels / 10.0)).sum(axis=0))])
