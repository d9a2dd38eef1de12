"""Which measurement would narrow an interval most, computed before anybody measures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from deboom.measurement.combined_uncertainty import (
    NextMeasurement,
    VariancePart,
    crossed_spread,
    half_width,
    half_width_after,
)
from deboom.study.measured_uncertainty import MeasuredAgain
from deboom.vehicles.platform_uncertainty import (
    BUDGET,
    CALIBRATION,
    CELLS,
    DAY,
    FLOOR,
    MOTION,
    NOISE,
    PATHS,
    SHAKER,
)

VEHICLES = "choice of the vehicles"
LOAD_CASES = "choice of the load cases"
HERE = "change, these vehicles and load cases"
SERIES = "change, any vehicle and load case"
LEVEL = "level, these vehicles and load cases"
TRANSFER = (CALIBRATION, PATHS, DAY, FLOOR)
HALVED = 0.25
"""Share of a variance that is left when a standard deviation is halved [1]."""
TWICE = 0.5
"""Share of a variance that is left by the mean of two independent measurements [1]."""


@dataclass(frozen=True, eq=False)
class Question:
    """A number whose interval is to become narrower.

    Parameters
    ----------
    name : str
        `HERE`, `SERIES` or `LEVEL`.
    parts : tuple of VariancePart
        What its variance consists of [dB²].
    """

    name: str
    parts: tuple[VariancePart, ...]

    @property
    def now(self) -> float:
        """Half width of its 90 % interval [dB]."""
        return half_width(self.parts)

    def after(self, measurement: NextMeasurement) -> float:
        """Return the half width expected after one more measurement [dB]."""
        own = {part.name for part in self.parts}
        remaining = {n: share for n, share in measurement.remaining.items() if n in own}
        more = {n: f for n, f in measurement.more_degrees_of_freedom.items() if n in own}
        return half_width_after(self.parts, NextMeasurement(measurement.name, remaining, more))


def questions(found: MeasuredAgain, design: str) -> tuple[Question, ...]:
    """Return what is asked of the mean over the vehicles, with its variances.

    Parameters
    ----------
    found : MeasuredAgain
        Drawn.
    design : str
        Whose change against today's.

    Notes
    -----
    "Any vehicle and load case" takes those that were measured for a sample: their spread is split
    into vehicles, load cases and rest by `crossed_spread` over all load cases of the platform, and
    of that between vehicles the part that errors of measurement make is taken off.
    """
    of_change, of_level = found.variances(design), found.variances(None)
    here = tuple(VariancePart(name, float(v[-1])) for name, v in of_change.items())
    level = tuple(VariancePart(name, float(v[-1])) for name, v in of_level.items())
    here_asked, level_asked = Question(HERE, here), Question(LEVEL, level)
    n_vehicle, n_used = len(found.study.vehicles), len(found.study.index.load_case_names)
    if n_vehicle < 2:
        return (here_asked, level_asked)
    spread = crossed_spread(changes_by_load_case(found, design))
    by_errors = sum(float(v[:-1].mean()) for name, v in of_change.items() if name in TRANSFER)
    vehicles = max(float(spread.rows + spread.rest / n_used) - by_errors, 0.0) / n_vehicle
    parts = [*here, VariancePart(VEHICLES, vehicles, n_vehicle - 1)]
    if spread.n_column > 1:
        parts.append(VariancePart(LOAD_CASES, float(spread.columns) / n_used, spread.n_column - 1))
    return (here_asked, Question(SERIES, tuple(parts)), level_asked)


def changes_by_load_case(found: MeasuredAgain, design: str) -> np.ndarray:
    """Change of the mean level by a design, (n_vehicle, n_load_case) [dB]."""
    study = found.study
    rows = np.stack([study.rows[0], study.designs[design]])
    columns = []
    for name in study.cases.load_case_names:
        levels = study.cases.levels(rows, name).mean(axis=2)
        columns.append(levels[1] - levels[0])
    return np.stack(columns, axis=1)


def candidates(found: MeasuredAgain) -> tuple[NextMeasurement, ...]:
    """Return measurements that may come next, as far as they touch a source of the study."""
    known = set(found.study.uncertain.data.names)
    n, m = len(found.study.vehicles), len(found.study.index.load_case_names)
    one_more, one_case = n / (n + 1), m / (m + 1)
    vehicles = {name: one_more for name in (*TRANSFER, VEHICLES)}
    every: Mapping[str, tuple[Mapping[str, float], Mapping[str, float]]] = {
        "one more vehicle": (vehicles, {VEHICLES: 1.0}),
        "one more load case": ({LOAD_CASES: one_case, NOISE: one_case}, {}),
        "transfer functions, another method and day": (
            {name: TWICE for name in TRANSFER},
            {},
        ),
        "transfer functions, same setup, another day": (
            {DAY: TWICE, FLOOR: TWICE},
            {},
        ),
        "microphone, source calibrated twice as well": ({CALIBRATION: HALVED}, {}),
        "shaker aligned twice as well": ({SHAKER: HALVED, CELLS: HALVED}, {}),
        "mounts characterised anew": ({SHAKER: TWICE, BUDGET: TWICE}, {}),
        "accelerometers placed twice as well": ({MOTION: HALVED}, {}),
        "run repeated, sensors set up anew": ({MOTION: TWICE, NOISE: TWICE}, {}),
    }
    return tuple(
        NextMeasurement(name, remaining, more)
        for name, (remaining, more) in every.items()
        if known & set(remaining) or {VEHICLES, LOAD_CASES} & set(remaining)
    )
