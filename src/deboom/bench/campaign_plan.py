"""Plans of measurement campaigns on the bench, and the second engine."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.frozen import freeze_arrays
from deboom.bench.layout import FREQUENCY
from deboom.bench.powertrain import (
    MIX,
    FullLoadRamp,
    OrderTorque,
    VirtualBench,
    load_bench,
    read_data,
)
from deboom.bench.sensors import ErrorBudget
from deboom.errors import InputError
from deboom.physics.rigid_body import forward_matrix, mass_matrix


@dataclass(frozen=True)
class PlannedRun:
    """One run over the lines of the dominant order.

    Parameters
    ----------
    gear : int
        From 1.
    torque : float
        Limit of a full-load ramp, engine torque of a slice [N m].
    full_load : bool
        Ramp with wide open throttle; else a slice at constant torque.
    rising : bool
        Direction of the engine speed; a falling run comes from a higher torque.

    Raises
    ------
    InputError
        A torque that is not positive.
    """

    gear: int
    torque: float
    full_load: bool
    rising: bool = True

    def __post_init__(self) -> None:
        if not self.torque > 0:
            raise InputError(f"a run needs an engine torque above 0 N m, not {self.torque}")

    @property
    def name(self) -> str:
        """Such as ``g5_wot220``, ``g6_slice060`` or ``g5_wot220_falling``."""
        kind = "wot" if self.full_load else "slice"
        return f"g{self.gear}_{kind}{self.torque:03g}{'' if self.rising else '_falling'}"


_LIMITS = (120.0, 160.0, 220.0)
_SLICES = (20.0, 60.0, 100.0, 140.0, 180.0, 220.0)


def _ramps_and_slices(gears: tuple[int, ...]) -> tuple[PlannedRun, ...]:
    return tuple(
        PlannedRun(gear, torque, full_load)
        for gear in gears
        for full_load, torques in ((True, _LIMITS), (False, _SLICES))
        for torque in torques
    )


TRAINING_RUNS = _ramps_and_slices((5, 6, 7))
"""The 27 rising runs in gears 5 to 7 that mounts are characterised with."""

LOW_GEAR_RUNS = tuple(PlannedRun(gear, limit, True) for gear in (3, 4) for limit in _LIMITS)

FALLING_RUNS = tuple(
    PlannedRun(gear, torque, full_load, rising=False)
    for gear in (5, 6, 7)
    for torque, full_load in ((220.0, True), (100.0, False))
)


@dataclass(frozen=True)
class TimeRunPlan:
    """One run that is recorded over time.

    Parameters
    ----------
    mount_set : str
        On the bench.
    run : PlannedRun
        Gear and torque.
    first_speed, last_speed : float
        At the start and at the end; rising as `run` says [rpm].
    duration : float
        [s].
    sample_rate : float
        [Hz].
    pulses_per_revolution : int
        Of the tacho.

    Raises
    ------
    InputError
        Speeds that do not go the run's way, or a duration, rate or tacho that is not positive.
    """

    mount_set: str = "M1"
    run: PlannedRun = field(default_factory=lambda: PlannedRun(5, 220.0, full_load=True))
    first_speed: float = 1500.0
    last_speed: float = 2100.0
    duration: float = 6.0
    sample_rate: float = 16384.0
    pulses_per_revolution: int = 2

    def __post_init__(self) -> None:
        rises = self.last_speed > self.first_speed
        if rises != self.run.rising or min(self.first_speed, self.last_speed) <= 0:
            raise InputError(
                f"time run {self.run.name}: {self.first_speed:g} to {self.last_speed:g} rpm is "
                f"not a {'rising' if self.run.rising else 'falling'} run"
            )
        if not (self.duration > 0 and self.sample_rate > 0 and self.pulses_per_revolution >= 1):
            raise InputError(
                f"time run {self.run.name}: duration, sample rate and pulses must be positive"
            )


@dataclass(frozen=True, eq=False)
class CampaignPlan:
    """Everything that is to be measured on one bench.

    Parameters
    ----------
    mount_sets : tuple of str
        Names that `deboom.bench.powertrain.mount_set` understands.
    runs : tuple of PlannedRun
        With every mount set.
    shaker_repeats : int
        Of every shaker run, between uses of the bench.
    time_run : TimeRunPlan or None
        Recorded over time as well.
    third_cell : bool
        Three cells below every powertrain mount instead of two, and pushes beside its virtual
        point: all six loads of a mount can be told apart.
    frequency : array, shape (f,)
        Lines of the dominant order [Hz].

    Raises
    ------
    InputError
        No mount set, run or repeat, or one that comes twice.
    """

    mount_sets: tuple[str, ...] = ("M1", "M2", "M3", "M4", "M5", MIX)
    runs: tuple[PlannedRun, ...] = (*LOW_GEAR_RUNS, *TRAINING_RUNS, *FALLING_RUNS)
    shaker_repeats: int = 3
    time_run: TimeRunPlan | None = None
    third_cell: bool = False
    frequency: RealArray = field(default_factory=lambda: FREQUENCY)

    def __post_init__(self) -> None:
        freeze_arrays(self)
        for what, names in (
            ("mount set", list(self.mount_sets)),
            ("run", [run.name for run in self.runs]),
        ):
            if not names:
                raise InputError(f"a campaign plan without a {what}: name at least one")
            doubled = next((name for name in names if names.count(name) > 1), None)
            if doubled is not None:
                raise InputError(f"campaign plan: {what} '{doubled}' comes twice: keep one")
        if self.shaker_repeats < 1:
            raise InputError(
                f"campaign plan: {self.shaker_repeats} shaker repeats: at least one is needed"
            )


FULL_PLAN = CampaignPlan(time_run=TimeRunPlan())
"""Five mount sets and a mix, gears 3 to 7, rising and falling, and one run over time."""


def training_plan(*mount_sets: str) -> CampaignPlan:
    """Return the plan of the 27 training runs alone, with the named mount sets."""
    return CampaignPlan(mount_sets=mount_sets, runs=TRAINING_RUNS)


@dataclass(frozen=True)
class CampaignErrors:
    """Every error of a campaign; all are standard deviations unless said otherwise.

    Parameters
    ----------
    chain : ErrorBudget
        Of sensors, shaker and order tracking, and how the bench gives way.
    torque : float
        Of the engine torque, per line [N m].
    static_force : float
        Of the quasi-static cell force, per line and direction [N].
    side_cell_gain, side_cell_cross : float
        Of the cells at the wishbone mounts, which no shaker calibrates [1]; the cross-talk is
        uniform within ± this.
    shaker_drift : float
        Relative change of a mount's cells from one shaker repeat to the next [1].
    shaker_noise : float
        Of a shaker run, per line and channel, relative to the answer of the triaxial cell [1].
    curve_scale : float
        Of a supplier's force-deflection curve, one scale error per curve [1].
    data_sheet : bool
        Whether the powertrain's data are stated within their tolerances, or exactly.
    """

    chain: ErrorBudget = field(default_factory=ErrorBudget)
    torque: float = 1.0
    static_force: float = 5.0
    side_cell_gain: float = 0.005
    side_cell_cross: float = 0.005
    shaker_drift: float = 0.001
    shaker_noise: float = 0.001
    curve_scale: float = 0.03
    data_sheet: bool = True


NO_ERRORS = CampaignErrors(
    chain=replace(
        ErrorBudget(),
        position=0.0,
        angle=0.0,
        gain=0.0,
        cross_axis=0.0,
        acceleration_own=0.0,
        acceleration_norm=0.0,
        acceleration_floor=0.0,
        force_own=0.0,
        force_norm=0.0,
        force_floor=0.0,
        shaker_angle=0.0,
        shaker_gain=0.0,
    ),
    torque=0.0,
    static_force=0.0,
    side_cell_gain=0.0,
    side_cell_cross=0.0,
    shaker_drift=0.0,
    shaker_noise=0.0,
    curve_scale=0.0,
    data_sheet=False,
)
"""Nothing is wrong or noisy; what the shaker calibrates stays: cell gain, cross-talk and shunt."""


_FILE = "second_engine.json"


def load_second_engine() -> VirtualBench:
    """Put the second engine on the bench.

    Returns
    -------
    VirtualBench
        Its mass, mount positions, gears and excitation from ``data/second_engine.json``; mounts and
        wheel ends as drawn for the virtual platform.

    Notes
    -----
    Whoever knows the mounts, and measures the motion of this powertrain, must find its forces: the
    mounts do not know what they carry.
    """
    data, bench = read_data(_FILE), load_bench()
    positions = np.array([data["mount_position_m"][name] for name in bench.mount_names])
    inertia = np.array(data["inertia_kg_m2"])
    torque, ramp = data["order_torque"], data["ramp"]
    mounts = tuple(
        replace(mount, forward=forward_matrix(position))
        for mount, position in zip(bench.powertrain.mounts, positions, strict=True)
    )
    return replace(
        bench,
        mass=data["mass_kg"],
        inertia=inertia,
        positions=positions,
        powertrain=replace(
            bench.powertrain, mass_matrix=mass_matrix(data["mass_kg"], inertia), mounts=mounts
        ),
        total_ratios=tuple(data["total_gear_ratio"]),
        order_torque=OrderTorque(
            order=torque["order"],
            at_no_load=torque["at_no_load_Nm"],
            per_torque=torque["per_torque"],
            phase=np.deg2rad(torque["phase_deg"]),
            low_speed_phase=0.0,
            low_speed=ramp["start_rpm"],
            speed_scale=ramp["scale_rpm"],
            inertia=torque["inertia_kg_m2"],
        ),
        ramp=FullLoadRamp(
            start=ramp["start_rpm"],
            scale=ramp["scale_rpm"],
            natural_torque=ramp["natural_torque_Nm"],
            exponent=ramp["exponent"],
        ),
    )


def second_engine_cylinders() -> int:
    """Return the number of cylinders of the second engine."""
    return int(read_data(_FILE)["cylinders"])


def second_engine_plan(*mount_sets: str) -> CampaignPlan:
    """Return the plan of full-load ramps in gears 5 to 7 with the second engine.

    Parameters
    ----------
    mount_sets : str
        Names of the mount sets to put under it.
    """
    data = read_data(_FILE)
    low, high, step = data["lines_Hz"]
    return CampaignPlan(
        mount_sets=mount_sets,
        runs=tuple(
            PlannedRun(gear, limit, full_load=True)
            for gear in (5, 6, 7)
            for limit in data["torque_limits_Nm"]
        ),
        frequency=np.linspace(low, high, round((high - low) / step) + 1),
    )
