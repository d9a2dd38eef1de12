"""What a campaign measures: which runs, with which mount sets on the bench, and which errors."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from deboom.arrays import RealArray, checked
from deboom.bench.layout import FREQUENCY
from deboom.bench.operating_run import PlannedRun
from deboom.bench.powertrain import MIX, read_data
from deboom.bench.sensors import ErrorBudget
from deboom.errors import InputError

_LIMITS = (120.0, 160.0, 220.0)
_SLICES = (20.0, 60.0, 100.0, 140.0, 180.0, 220.0)

TRAINING_RUNS = tuple(
    PlannedRun(gear, torque, full_load)
    for gear in (5, 6, 7)
    for full_load, torques in ((True, _LIMITS), (False, _SLICES))
    for torque in torques
)
"""The 27 rising runs in gears 5 to 7 that mounts are characterised with."""

LOW_GEAR_RUNS = tuple(PlannedRun(gear, limit) for gear in (3, 4) for limit in _LIMITS)

FALLING_RUNS = tuple(
    PlannedRun(gear, torque, full_load, rising=False)
    for gear in (5, 6, 7)
    for torque, full_load in ((220.0, True), (100.0, False))
)


@dataclass(frozen=True)
class TimeRunPlan:
    """One run recorded over time: speeds [rpm], duration [s], sample rate [Hz], tacho pulses.

    - raises InputError: speeds that do not go the run's way, or a duration, rate or tacho that is
      not positive.
    """

    mount_set: str = "M1"
    run: PlannedRun = field(default_factory=lambda: PlannedRun(5, 220.0))
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


@checked(frequency="f")
class CampaignPlan:
    """Everything that is to be measured on one bench.

    - `mount_sets`, `runs`: names that `with_mount_set` understands, and the runs with every one of
      them.
    - `shaker_repeats`: repeats of every shaker run, between uses of the bench.
    - `time_run`: run recorded over time as well.
    - `third_cell`: three cells below every powertrain mount instead of two, and pushes beside its
      virtual point: all six loads of a mount can be told apart.
    - `frequency` (f,): lines of the dominant order [Hz].
    - raises InputError: no mount set, run or repeat, or one that comes twice.
    """

    mount_sets: tuple[str, ...] = ("M1", "M2", "M3", "M4", "M5", MIX)
    runs: tuple[PlannedRun, ...] = (*LOW_GEAR_RUNS, *TRAINING_RUNS, *FALLING_RUNS)
    shaker_repeats: int = 3
    time_run: TimeRunPlan | None = None
    third_cell: bool = False
    frequency: RealArray = field(default_factory=lambda: FREQUENCY)

    def __post_init__(self) -> None:
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


def second_engine_plan(*mount_sets: str) -> CampaignPlan:
    """Return the plan of full-load ramps in gears 5 to 7 with the second engine."""
    data = read_data("second_engine.json")
    low, high, step = data["lines_Hz"]
    return CampaignPlan(
        mount_sets=mount_sets,
        runs=tuple(
            PlannedRun(gear, limit) for gear in (5, 6, 7) for limit in data["torque_limits_Nm"]
        ),
        frequency=np.linspace(low, high, round((high - low) / step) + 1),
    )


@dataclass(frozen=True)
class CampaignErrors:
    """Every error of a campaign; all are standard deviations unless said otherwise.

    - `chain`: errors of sensors, shaker and order tracking, and how the bench gives way.
    - `torque`, `static_force`: noise of the engine torque [N m] and of the quasi-static cell force
      [N], per line.
    - `side_cell_gain`, `side_cell_cross`: errors of the cells at the wishbone mounts, which no
      shaker calibrates [1]; the cross-talk is uniform within ± this.
    - `shaker_drift`, `shaker_noise`: relative change of a mount's cells from one shaker repeat to
      the next, and noise per line and channel relative to the answer of the cell [1].
    - `curve_scale`: scale error of a supplier's force-deflection curve, one per curve [1].
    - `data_sheet`: whether the powertrain's data are stated within their tolerances, or exactly.
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


_CALIBRATED = ("cell_gain", "cell_cross", "cell_shunt")
_NO_ERROR = ("bench_frequency", "bench_flexibility", "tilt", "chain", "data_sheet")


def _zeros(errors: type[ErrorBudget | CampaignErrors]) -> dict[str, Any]:
    """Return zeros for everything that is an error and is not calibrated."""
    kept = (*_CALIBRATED, *_NO_ERROR)
    return {field.name: 0.0 for field in fields(errors) if field.name not in kept}


NO_ERRORS = CampaignErrors(
    chain=replace(ErrorBudget(), **_zeros(ErrorBudget)),
    data_sheet=False,
    **_zeros(CampaignErrors),
)
"""Nothing is wrong or noisy; what the shaker calibrates stays: cell gain, cross-talk and shunt."""
