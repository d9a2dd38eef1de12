"""Idle: a fixed speed, a line per engine order, and the level of all orders together."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.physics.sound_level import energy_sum
from deboom.vehicles.booming_model import BoomingModel, Motion, booming_model
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.powertrain import Powertrain
from deboom.vehicles.receivers import Receiver

ORDERS = np.arange(1, 13) / 2.0
"""Engine orders of idle [1]: a cycle of four strokes takes two revolutions."""
ORDER_TOLERANCE = 0.02
"""How far a line may lie from its order [1]."""
WIDEST_STEP = 1.0
"""Functions are interpolated between lines that lie no further apart [Hz]."""


@dataclass(frozen=True, eq=False)
class IdleRun:
    """Motion and forces of the mounts at idle.

    - `case`: on one line per engine order.
    - `speed`: of the engine [1/min].
    - raises InputError: a line that is none of `ORDERS`, or two of one order.
    """

    case: LoadCase
    speed: float

    def __post_init__(self) -> None:
        exact = self.case.force.frequency * 60.0 / self.speed
        off = np.abs(exact - self.orders)
        is_order = np.isin(self.orders, ORDERS) & (off <= ORDER_TOLERANCE)
        owner = f"load case {self.case.name}"
        if not is_order.all():
            at = int(np.argmin(is_order))
            raise InputError(
                f"{owner}: {self.case.force.frequency[at]:g} Hz is order {exact[at]:.3g} of "
                f"{self.speed:g} rpm: export one line per order, {ORDERS[0]:g} to {ORDERS[-1]:g} "
                "in steps of 0.5, or correct speed_rpm"
            )
        if np.unique(self.orders).size < self.orders.size:
            raise InputError(f"{owner} has two lines of one order: export one line per order")

    @property
    def name(self) -> str:
        """Name of the load case."""
        return self.case.name

    @property
    def orders(self) -> RealArray:
        """Engine order of each line, shape (o,) [1]."""
        return np.asarray(np.round(2.0 * self.case.force.frequency * 60.0 / self.speed) / 2.0)

    def lines_of(self, frequency: RealArray) -> BoolArray:
        """Say which orders lie on functions with lines `frequency` (f,) [Hz], or between two."""
        lines = self.case.force.frequency
        after = np.minimum(np.searchsorted(frequency, lines), frequency.size - 1)
        before = np.maximum(after - 1, 0)
        between = (frequency[before] <= lines) & (lines <= frequency[after])
        narrow = frequency[after] - frequency[before] <= WIDEST_STEP
        return np.asarray((frequency[after] == lines) | (between & narrow))


@dataclass(frozen=True, eq=False)
class IdleModel:
    """Level of every receiver at idle, all orders together, as a function of the factors.

    - `run`: motion and forces as measured.
    - `model`: on the lines of the orders.
    """

    run: IdleRun
    model: BoomingModel

    @property
    def orders(self) -> RealArray:
        """Engine orders that count, shape (o,) [1]."""
        return self.run.orders[np.isin(self.run.case.force.frequency, self.model.frequency)]

    @property
    def left_out(self) -> RealArray:
        """Engine orders of the run at which no functions are known [1]."""
        return np.setdiff1d(self.run.orders, self.orders)

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Those of the model."""
        return self.model.variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Names of the receivers, as of the other load cases."""
        return self.model.response_names

    @property
    def receivers(self) -> tuple[Receiver, ...]:
        """Receiver of each response."""
        return self.model.receivers

    def levels(self, designs: npt.ArrayLike) -> RealArray:
        """Return the level of each order, designs (n, k) [1] → (n, v, o) [unit of the receiver]."""
        return self.model.levels(designs)

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the level of all orders, designs (n, k) [1] → (n, v) [unit of the receiver].

        Orders have different frequencies, so their mean squares add up: ``10 lg Σ_o 10^(L_o/10)``.
        """
        return energy_sum(self.levels(designs), axis=-1)


def idle_model(
    run: IdleRun,
    fleet: Fleet,
    mounts: Sequence[Mount],
    *,
    motion: Motion,
    powertrain: Powertrain | None,
    loss_factors: bool = False,
) -> IdleModel:
    """Build the model of idle, with functions interpolated at the lines of its orders.

    - `fleet`, `mounts`, `powertrain`, `loss_factors`: as of `booming_model`.
    - `motion`: prescribed or coupled.
    - raises InputError: no order on the lines of the functions; see also `booming_model`.

    Stiffnesses are those that the run itself shows, force over displacement at each order.
    """
    frequency = fleet.vehicles[0].noise_transfer.frequency
    covered, lines = run.lines_of(frequency), run.case.force.frequency
    if not covered.any():
        raise InputError(
            f"load case {run.name}: its orders lie at {lines[0]:g} to {lines[-1]:g} Hz, and the "
            f"transfer functions at {frequency[0]:g} to {frequency[-1]:g} Hz: measure functions at "
            "the orders of idle"
        )
    lines = lines[covered]
    case = replace(
        run.case,
        displacement=_some_lines(run.case.displacement, covered),
        force=_some_lines(run.case.force, covered),
        engine_torque=None if run.case.engine_torque is None else run.case.engine_torque[covered],
    )
    model = booming_model(
        Fleet(tuple(_vehicle_at(vehicle, lines) for vehicle in fleet.vehicles)),
        [_mount_at(mount, lines) for mount in mounts],
        [(case, 1.0)],
        (float(lines[0]), float(lines[-1])),
        motion=motion,
        powertrain=powertrain,
        loss_factors=loss_factors,
    )
    return IdleModel(run, model)


def _some_lines(spectrum: Spectrum, rows: BoolArray) -> Spectrum:
    return replace(spectrum, frequency=spectrum.frequency[rows], values=spectrum.values[rows])


def _vehicle_at(vehicle: Vehicle, lines: RealArray) -> Vehicle:
    """Return a vehicle whose functions have other lines."""
    moved = copy(vehicle)
    functions = {
        "noise_transfer": _frf_at(vehicle.noise_transfer, lines),
        "receptance": None if vehicle.receptance is None else _frf_at(vehicle.receptance, lines),
        "receivers": {each: _frf_at(frf, lines) for each, frf in vehicle.receivers.items()},
    }
    # not by `replace`: bodies were judged on all lines, and noise of a few looks like a fault
    for name, values in functions.items():
        object.__setattr__(moved, name, values)
    return moved


def _mount_at(mount: Mount, lines: RealArray) -> Mount:
    """Return a mount whose brackets have other lines."""
    brackets = tuple(
        replace(
            bracket,
            frequency=lines,
            stiffness=_interpolated(bracket.frequency, bracket.stiffness, lines),
        )
        if bracket.frequency.size
        else bracket
        for bracket in mount.brackets
    )
    return replace(mount, brackets=brackets)


def _frf_at(frf: Frf, lines: RealArray) -> Frf:
    return replace(frf, frequency=lines, values=_interpolated(frf.frequency, frf.values, lines))


def _interpolated(
    frequency: RealArray, values: npt.NDArray[np.complex128], lines: RealArray
) -> npt.NDArray[np.complex128]:
    """Return complex values (f, ...) at other lines, linear between their neighbours."""
    after = np.searchsorted(frequency, lines)
    before = np.maximum(after - 1, 0)
    step = np.maximum(frequency[after] - frequency[before], np.finfo(float).tiny)
    share = (lines - frequency[before]) / step
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    exact = (frequency[after] == lines).reshape(share.shape)
    between = (1.0 - share) * values[before] + share * values[after]
    return np.asarray(np.where(exact, values[after], between))
