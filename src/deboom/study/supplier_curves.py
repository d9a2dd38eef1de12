"""Dynamic stiffness over static force of every direction: the diagram that suppliers know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.load_case import LoadCase
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.report.figures import StiffnessPanel
from deboom.study.motion import Factor
from deboom.study.motion_report import factor_name
from deboom.study.robust_front import N_PER_MM
from deboom.study.supplier_study import Direction, Need, SupplierStudy
from deboom.vehicles.kinematic_model import KinematicModel, library_model

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
    part = factor_name(study.motion_index) == Factor.part.value
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
    stiffness, inside = surface.predict_masked(torque, condition.amplitude, frequency)
    preload = _preload(label, model, channels, torque, np.full(STEPS, frequency))
    return condition, preload, np.where(inside, stiffness, np.nan)


def loudest_line(study: SupplierStudy) -> float:
    """Return the line with the most sound energy of all vehicles today [Hz]."""
    levels = study.index.levels(study.space.nominal[np.newaxis])[0]
    return float(study.index.frequency[np.argmax((10.0 ** (levels / 10.0)).sum(axis=0))])
