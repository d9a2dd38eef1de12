"""Effects of a supplier's parts with intervals, and the states at which parts are tested."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.explore.robust import Robust
from deboom.explore.sensitivity import (
    SobolIndices,
    design_inputs,
    fast_sobol_indices,
    sobol_designs,
)
from deboom.files.acceptance import PROGRAMME_FILE, Programme, ProgrammeMount
from deboom.files.uncertain_index import UncertainIndex, uncertain_index
from deboom.measurement.channels import LoadCase
from deboom.measurement.uncertainty import COVERAGE, Interval, pivotal_interval
from deboom.mounts.characterised_mount import FORCE_PER_TORQUE
from deboom.mounts.mount import Mount
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points
from deboom.pages.motion import factor_name
from deboom.pages.sensitivity import TENTH
from deboom.pages.supplier_study import Direction, SupplierStudy
from deboom.vehicles.booming_model import Motion, model_of_other_data
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.expected_change import ExpectedChange, expected_or_why
from deboom.vehicles.powertrain import KinematicModel, MonotoneCurve, library_model

REPETITIONS = 120
"""Draws of all measurements."""
SURE = 0.95
"""Coverage of the interval of today's stiffness, that of a laboratory's own uncertainty [1]."""
STEP = 0.01
"""By which a tolerance is made tighter: one percentage point [1]."""
IMPORTANCE = 512
"""Base points behind the importance of a direction."""
ALL = "all parts"


@dataclass(frozen=True, eq=False)
class SupplierEffects:
    """Effects of the wanted parts; every level is the mean over the lines of a vehicle.

    Parameters
    ----------
    study : SupplierStudy
        Whose parts.
    middle : array, shape (k,)
        Design in the middle of all bands, of which changes and sensitivities are stated [1].
    """

    study: SupplierStudy
    middle: RealArray

    @cached_property
    def designs(self) -> dict[str, RealArray]:
        """Each mount alone in its middle, and all together, each of shape (k,) [1]."""
        mounts = [mount.name for mount in self.study.platform.mounts]
        alone = {name: self.study.only(name, self.middle) for name in mounts}
        return {**alone, ALL: self.middle}

    @cached_property
    def change(self) -> dict[str, RealArray]:
        """Change of the mean level by `designs`, without scatter, shape (n_vehicle,) [dB]."""
        return dict(zip(self.designs, self._changes(self.study.index), strict=True))

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

    @cached_property
    def slope(self) -> RealArray:
        """Change of the mean level over the vehicles per `TENTH` more stiffness, (k,) [dB]."""
        return self._slopes(self.study.index)

    @cached_property
    def importance(self) -> SobolIndices:
        """Sobol indices of the mean level over the vehicles, within the bounds of the search."""
        inputs, seed = design_inputs(self.study.space), self.study.run.seed
        designs = sobol_designs(inputs, IMPORTANCE, seed=seed)
        level = self.study.mean(self.study.index(designs))[:, np.newaxis]
        return fast_sobol_indices(level, inputs.factors, ["mean level"], seed=seed)

    @cached_property
    def certainty(self) -> dict[str, Interval]:
        """Intervals over measurements that are drawn again.

        ``stiffness`` today with `SURE` [N/m]; with `COVERAGE`, ``change`` by `designs`, ``slope``
        and ``gain`` [dB].
        """
        study, case = self.study, self.study.load_cases[0][0]
        measured = self._numbers(study.index, case)
        rows = []
        for draw in range(REPETITIONS):
            fleet, cases = self.uncertain.data.drawn(draw, study.run.seed)
            index = model_of_other_data(
                study.index, fleet, study.platform.mounts, study.platform.powertrain, cases
            )
            rows.append(self._numbers(index, cases[0]))
        again = {name: np.stack([row[name] for row in rows]) for name in measured}
        intervals = {
            name: _interval(value, again[name], SURE if name == "stiffness" else COVERAGE)
            for name, value in measured.items()
        }
        return {**intervals, "gain": intervals["gain"].about(self.tolerance_gain)}

    @cached_property
    def uncertain(self) -> UncertainIndex:
        """The run's index with the errors of its data."""
        return uncertain_index(self.study.index, self.study.platform, self.study.parts)

    @cached_property
    def expected(self) -> ExpectedChange | str:
        """What cars are expected to show of `designs`, in their order; or why nothing is."""
        study = self.study
        return expected_or_why(
            study.index,
            lambda: self.uncertain.expected_change(
                np.stack(list(self.designs.values())),
                weights=study.model.weights,
                seed=study.run.seed,
            ),
        )

    def other_motion(self) -> tuple[str, dict[str, float]] | None:
        """Compute the changes under the other model of the motion, mean over the vehicles [dB].

        None where the data do not allow that model, or a factor means the part.
        """
        index = self.study.index
        motion = Motion.coupled if index.motion is Motion.prescribed else Motion.prescribed
        if factor_name(index) == Factor.part.value:
            return None
        try:
            other = self.study.runs.model(motion, loss_factors=index.loss_factors)
        except InputError:
            return None
        changes = self.study.mean(self._changes(other))
        return motion.value, dict(zip(self.designs, map(float, changes), strict=True))

    def _changes(self, index: Any) -> RealArray:
        rows = np.stack([self.study.space.nominal, *self.designs.values()])
        splv = index(rows)
        return np.asarray((splv[1:] - splv[0]) * self.study.per_vehicle)

    def _slopes(self, index: Any) -> RealArray:
        gradient = index.gradient(self.middle[np.newaxis])[0] * self.study.per_vehicle
        return np.asarray(TENTH * self.study.mean(gradient.T) * self.middle)

    def _numbers(self, index: Any, case: LoadCase) -> dict[str, RealArray]:
        study = self.study
        gradient = index.gradient(study.wanted[np.newaxis])[0] * study.per_vehicle
        squared = (gradient * study.wanted * study.space.relative_sigma) ** 2
        # σ per tolerance to first order: σ_k² / (σ tol_k)
        sigma = np.sqrt(squared.sum(axis=1, keepdims=True))
        scale = sigma * study.space.tolerance
        gain = np.divide(squared, scale, out=np.zeros_like(squared), where=scale > 0.0)
        return {
            "stiffness": study.runs.stiffness(case, study.band),
            "change": study.mean(self._changes(index)),
            "slope": self._slopes(index),
            "gain": STEP * study.mean(gain.T),
        }


def _interval(measured: RealArray, again: RealArray, coverage: float) -> Interval:
    """Give the interval of every number; nan where a draw has none."""
    valid = np.isfinite(measured) & np.isfinite(again).all(axis=0)
    values = np.where(valid, measured, 0.0), np.where(valid, again, 0.0)
    interval = pivotal_interval(*values, coverage)
    lower, upper = (np.where(valid, end, np.nan) for end in (interval.lower, interval.upper))
    return Interval(np.where(valid, measured, np.nan), lower, upper, interval.coverage)


def with_tolerance(robust: Robust, column: int, tolerance: float) -> Robust:
    """Return a response whose variable of one column has another tolerance [1]."""
    tolerances = np.array(robust.space.tolerance)
    tolerances[column] = tolerance
    return replace(robust, space=replace(robust.space, tolerance=tolerances))


LABORATORY = (0.05e-3, 0.1e-3, 0.2e-3, 0.5e-3, 1.0e-3)
"""Peak amplitudes that dynamic test machines are usually set to [m]."""
STEPS = 161
"""Preloads of a curve."""
NAN = float("nan")


@dataclass(frozen=True, eq=False)
class StiffnessOverFrequency:
    """Today's stiffness over frequency at the preload of the test and one amplitude.

    Parameters
    ----------
    amplitude : float
        [m peak].
    frequency : array, shape (n,)
        Lines of the band, and frequencies of the programme [Hz].
    stiffness : array, shape (n,)
        Complex; nan where nothing was measured [N/m].
    """

    amplitude: float
    frequency: RealArray
    stiffness: ComplexArray

    @property
    def backed(self) -> npt.NDArray[np.bool_]:
        """Lines that measurements back, shape (n,)."""
        return np.isfinite(self.stiffness)


@dataclass(frozen=True, eq=False)
class MachineState:
    """State of one direction that a test machine can be set to.

    Parameters
    ----------
    direction : Direction
    wheel_torque : float
        Behind the preload; nan: not recorded [N m].
    preload, deflection : float
        Static force on the body and deflection of the wanted part; nan: not known [N, m].
    with_weight, from_unloaded : bool
        Whether the force contains the weight; whether the deflection counts from the unloaded part.
    amplitude, frequency : float
        [m peak, Hz].
    laboratory : bool
        Whether a laboratory amplitude is backed by measurements; otherwise it is the vehicle's.
    other_axes : float
        By how much a piece is stiffer at most where only this axis moves, as it does on a machine:
        the softening amplitude of the vehicle is then that of all axes, relative [1].
    stiffness : complex
        Today's [N/m].
    static_rate : float
        Slope of today's static curve there; nan: not known [N/m].
    curve : (array, array)
        Static force, or wheel torque where that is not known, and magnitude of today's stiffness at
        this amplitude and frequency, nan where nothing was measured; empty without a surface
        [N or N m, N/m].
    points : (array, array)
        The same of the lines of the first load case.
    over_frequency : tuple of StiffnessOverFrequency
        At the amplitude of the test, and at a second one; empty without a surface.
    static : MonotoneCurve or None
        Today's static force over deflection; None where it was not measured.
    """

    direction: Direction
    wheel_torque: float
    preload: float
    deflection: float
    with_weight: bool
    from_unloaded: bool
    amplitude: float
    frequency: float
    laboratory: bool
    other_axes: float
    stiffness: complex
    static_rate: float
    curve: tuple[RealArray, RealArray]
    points: tuple[RealArray, RealArray]
    over_frequency: tuple[StiffnessOverFrequency, ...]
    static: MonotoneCurve | None

    @property
    def over_force(self) -> bool:
        """Whether static forces are known, so that curves are over them."""
        return bool(np.isfinite(self.preload))


def machine_states(
    study: SupplierStudy,
    directions: Sequence[Direction],
    programme: Programme,
    factors: Mapping[str, float],
) -> dict[str, MachineState]:
    """Return the state of every direction that was measured in the first load case.

    Parameters
    ----------
    study : SupplierStudy
    directions : sequence of Direction
    programme : Programme
        Weight forces, zero of static curves, frequencies.
    factors : mapping of str to float
        Wanted stiffness factor by direction: that of the part moves the preload, that of the
        dynamic stiffness the deflection under it [1].

    Raises
    ------
    InputError
        A frequency of the programme at which a stiffness was not measured.
    """
    case, _ = study.load_cases[0]
    carriers = {mount.name for mount in study.platform.mounts if mount.carries_powertrain}
    parts = [part for part in study.parts if part.mount.name in carriers]
    try:
        model = library_model(parts) if parts else None
    except InputError:  # a static curve is missing: preloads stay wheel torques
        model = None
    moves = factor_name(study.index) == Factor.part.value
    return {
        d.name: _state(study, d, case, model, programme, factors[d.name], moves)
        for d in directions
        if set(d.mount.channels(d.axis)) <= set(case.force.channels)
    }


def loudest_line(study: SupplierStudy) -> float:
    """Return the line with the most sound energy of all vehicles today [Hz]."""
    levels = study.index.levels(study.space.nominal[np.newaxis])[0, study.ears]
    return float(study.index.frequency[np.argmax((10.0 ** (levels / 10.0)).sum(axis=0))])


def _state(
    study: SupplierStudy,
    direction: Direction,
    case: LoadCase,
    model: KinematicModel | None,
    programme: Programme,
    factor: float,
    of_part: bool,
) -> MachineState:
    moved, stretched = (factor, 1.0) if of_part else (1.0, 1.0 / factor)
    channels, lines = direction.mount.channels(direction.axis), case.displacement.frequency
    frequencies = programme.test.frequencies_hz
    wanted = frequencies[0] if frequencies else loudest_line(study)
    line = int(np.argmin(np.abs(lines - wanted)))
    inside = (lines >= study.band[0]) & (lines <= study.band[1])
    torque = np.full(lines.size, NAN) if case.engine_torque is None else case.wheel_torque
    amplitude = np.abs(case.displacement.select(channels).values).mean(axis=1)
    measured = _mean_stiffness(case, channels)
    here, surface = float(torque[line]), _surface(direction)
    setting = (float(amplitude[line]), float(lines[line]), False)
    stiffness = complex(measured[line])
    curve, other_axes = (np.empty(0), np.empty(0)), 0.0
    over_frequency: tuple[StiffnessOverFrequency, ...] = ()
    of_programme = programme.mount(direction.mount.name)
    if surface is not None and np.isfinite(here):
        setting = _setting(surface, here, setting[0], wanted, exact=frequencies is not None)
        stiffness = complex(surface.predict([here, *setting[:2]], extrapolate=True))
        felt = setting[0] * amplitude[line] / _all_axes(direction.mount, case, line)
        alone = surface.predict([here, felt, setting[1]], extrapolate=True)
        other_axes = max(float(abs(alone) / abs(stiffness)) - 1.0, 0.0)
        over = np.linspace(0.0, float(np.nanmax(torque)), STEPS)
        at = operating_points(over, setting[0], setting[1])
        backed = np.where(surface.supported(at), np.abs(surface.predict(at, extrapolate=True)), NAN)
        curve = (_abscissa(direction, of_programme, model, over), backed)
        over_frequency = _over_frequency(
            surface,
            here,
            setting[0],
            programme.test.second_amplitude_mm,
            np.union1d(study.index.frequency, frequencies or ()),
        )
    elif frequencies and abs(lines[line] - wanted) > 0.5:
        raise InputError(
            f"{study.platform.folder / PROGRAMME_FILE}: {direction.name} was not measured at "
            f"{wanted:g} Hz: choose frequencies_hz from {lines[0]:g} to {lines[-1]:g} Hz"
        )
    forces, deflections = _torque_forces(direction, of_programme, model, np.array([here]))
    force, deflection = moved * float(forces[0]), float(deflections[0])
    weight = of_programme.weight_force_n
    unloaded = weight is not None and of_programme.curve_zero == "unloaded"
    static = _static_curve(direction)
    if weight is not None:
        force += weight[AXES.index(direction.axis)]
    if static is not None and (unloaded or np.isnan(deflection)) and np.isfinite(force):
        deflection = _deflection(static, (force if unloaded else float(forces[0])) / moved)
    usable = np.isfinite(measured) & inside
    return MachineState(
        direction,
        here,
        force,
        stretched * deflection,
        weight is not None,
        unloaded,
        *setting,
        other_axes,
        stiffness,
        float(static.slope(np.array(deflection))) if static and np.isfinite(deflection) else NAN,
        curve,
        (
            _abscissa(direction, of_programme, model, torque[usable]),
            np.abs(measured[usable]),
        ),
        over_frequency,
        static,
    )


def _setting(
    surface: DynamicStiffnessSurface, torque: float, moved: float, frequency: float, *, exact: bool
) -> tuple[float, float, bool]:
    """Choose amplitude [m] and frequency [Hz] that measurements back.

    Whole hertz and the laboratory amplitude nearest to the vehicle's come first; the last value
    says whether it is such an amplitude.
    """
    by_distance = sorted(LABORATORY, key=lambda a: abs(np.log(a / moved)))
    rounded = float(f"{moved:.2g}")
    frequencies = (frequency,) if exact else (round(frequency), frequency)
    for line in frequencies:
        for amplitude in (*by_distance, rounded, moved):
            if surface.supported(np.array([[torque, amplitude, line]]))[0]:
                return amplitude, float(line), amplitude in LABORATORY
    if exact:
        raise InputError(
            f"{PROGRAMME_FILE}: at {frequency:g} Hz nothing was measured under {torque:.0f} N m "
            "wheel torque: choose other frequencies_hz, or leave them out"
        )
    return moved, frequency, False


def _over_frequency(
    surface: DynamicStiffnessSurface,
    torque: float,
    amplitude: float,
    second_mm: float | None,
    lines: RealArray,
) -> tuple[StiffnessOverFrequency, ...]:
    """Return the stiffness over the lines at the amplitude of the test and at a second one.

    The second one is the programme's, if it is another one; where that has none, the laboratory
    amplitude that measurements back at most lines where they do not back that of the test, then at
    most lines.
    """

    def at(other: float) -> StiffnessOverFrequency:
        points = operating_points(torque, other, lines)
        values = np.where(
            surface.supported(points), surface.predict(points, extrapolate=True), np.nan
        )
        return StiffnessOverFrequency(other, lines, values)

    of_test = at(amplitude)
    if second_mm is not None:
        second_stated = second_mm * 1e-3
        alike = bool(np.isclose(second_stated, amplitude, rtol=1e-6))
        return (of_test,) if alike else (of_test, at(second_stated))
    others = [at(each) for each in LABORATORY if each != amplitude]
    added = [(int((o.backed & ~of_test.backed).sum()), int(o.backed.sum())) for o in others]
    second = others[max(range(len(others)), key=added.__getitem__)]
    return (of_test, second) if second.backed.any() else (of_test,)


def _all_axes(mount: Mount, case: LoadCase, line: int) -> float:
    """Return the amplitude of all axes of a mount together at a line, mean over its pieces [m]."""
    squared = 0.0
    for axis in AXES:
        channels = mount.channels(axis)
        if set(channels) <= set(case.displacement.channels):
            moved = np.abs(case.displacement.select(channels).values[line])
            squared += float(moved.mean()) ** 2
    return float(np.sqrt(squared))


def _mean_stiffness(case: LoadCase, channels: Sequence[str]) -> ComplexArray:
    """Stiffness of every line, mean over the pieces; nan where a piece does not move [N/m]."""
    force = case.force.select(channels).values
    displacement = case.displacement.select(channels).values
    moves = np.abs(displacement) > 0.0
    ratio = np.divide(force, displacement, out=np.full(force.shape, np.nan + 0j), where=moves)
    return np.asarray(ratio.mean(axis=1))


def _surface(direction: Direction) -> DynamicStiffnessSurface | None:
    """Return the surface of a direction where it is over wheel torque."""
    part = direction.characterised
    surface = part.surface if part is not None else None
    return surface if surface is not None and surface.preload_unit == "N m" else None


def _static_curve(direction: Direction) -> MonotoneCurve | None:
    part = direction.characterised
    return MonotoneCurve(part.static_curve) if part is not None and part.static_curve else None


def _deflection(static: MonotoneCurve, force: float) -> float:
    """Return where a static curve has a force [m]; nan beyond its ends."""
    over = np.linspace(static.lowest, static.highest, 4001)
    return float(np.interp(force, static.force(over), over, left=NAN, right=NAN))


def _abscissa(
    direction: Direction,
    of_programme: ProgrammeMount,
    model: KinematicModel | None,
    torque: npt.NDArray[np.float64],
) -> RealArray:
    """Return static forces under wheel torques, or these where no force is known."""
    force = _torque_forces(direction, of_programme, model, torque)[0]
    return force if np.isfinite(force).all() else torque


def _torque_forces(
    direction: Direction,
    of_programme: ProgrammeMount,
    model: KinematicModel | None,
    torque: npt.NDArray[np.float64],
) -> tuple[RealArray, RealArray]:
    """Return static force [N] and deflection [m] under wheel torques; nan where not known."""
    channels = direction.mount.channels(direction.axis)
    none = np.full(torque.size, NAN)
    if not np.isfinite(torque).all():
        return none, none
    if model is not None and channels[0] in model.names:
        deflection = model.equilibrium(torque)
        places = [model.column(channel) for channel in channels]
        return model.force(deflection)[:, places].mean(axis=1), deflection[:, places].mean(axis=1)
    part = direction.characterised
    ratio = part.settings.get(FORCE_PER_TORQUE) if part is not None else None
    if of_programme.force_per_wheel_torque is not None:
        ratio = of_programme.force_per_wheel_torque[AXES.index(direction.axis)]
    if not isinstance(ratio, float):
        return none, none
    return ratio * torque, none
