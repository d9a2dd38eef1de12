"""The robust front of a compressor's mounts."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.bench.compressor_operation import PRESSURES, Operation, gas_factor, operation
from deboom.bench.compressor_rig import draw, placement_errors
from deboom.bench.electric_car import (
    POINTS,
    ElectricCarBody,
    design_pressure,
    draw_fleet,
    frozen_fleet,
)
from deboom.bench.electric_car_writer import CAR_PLAN, write_electric_car
from deboom.bench.electric_recording import (
    CABIN_NOISE,
    body_plan,
    draw_car_sensors,
    draw_setup,
    point_sheets,
    strike_body,
)
from deboom.choices import CalibrationLevel
from deboom.compressor.cabin_index import (
    DATUM,
    CabinIndex,
    MountStatics,
    MountVariables,
    car_seam,
    free_compressor,
    measured_body,
    mount_variables,
)
from deboom.compressor.cabin_noise import RunningInCar, running_in_car
from deboom.compressor.hose_beams import hose_matrices
from deboom.compressor.identify import Identification, IdentifyOptions, identify
from deboom.compressor.sources import case_name, source_loads
from deboom.errors import InputError
from deboom.explore.front import Verification, verification_response, verify
from deboom.explore.robust import (
    Limit,
    LimitedResponse,
    Limits,
    Robust,
    RobustResponse,
    RobustValues,
    SigmaShares,
    sigma_shares,
)
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import SearchResult
from deboom.explore.selection import indifference_intervals, pick
from deboom.explore.sensitivity import (
    SensitivityInputs,
    SobolIndices,
    fast_sobol_indices,
    sobol_designs,
)
from deboom.explore.space import DesignSpace, generator
from deboom.files.electric_car import read_electric_car
from deboom.files.tables import workbook_bytes
from deboom.measurement.channels import Frf
from deboom.measurement.electric_car import ElectricCar
from deboom.physics.sound_level import spl
from deboom.plot import (
    CurvePanel,
    IndexBars,
    convergence,
    curve_panels,
    index_bars,
    pareto_front,
    per_vehicle_change,
    spl_curves,
    stiffness_bars,
)
from deboom.plot.style import mount_colours, mount_of, signed, vehicle_colours
from deboom.report import Report, Scalar
from deboom.study.progress import Progress
from deboom.study.result import RunContext
from deboom.study.search import Budget, robust_search
from deboom.vehicles.booming_model import mean_energy_level
from deboom.vehicles.booming_peaks import PeakChange, compare_peaks

OTHER_CARS = 200
"""Purposes of random numbers from here on belong to the cars that are not written."""


@dataclass(frozen=True, eq=False)
class FleetTruth:
    """What is exactly so in a virtual fleet.

    Parameters
    ----------
    there : Operation
        Compressor, hoses and source.
    bodies : tuple of ElectricCarBody
    """

    there: Operation
    bodies: tuple[ElectricCarBody, ...]

    def levels(
        self, factors: RealArray, frequency: RealArray, pressure: float, *, with_hoses: bool
    ) -> RealArray:
        """Return the sound pressure level for other mounts, coupled and exact.

        Parameters
        ----------
        factors : array, shape (n, 3 m)
            On the true stiffness of every mount [1].
        frequency : array, shape (f,)
            [Hz]
        pressure : float
            Of the gas, one of the bench's [bar].
        with_hoses : bool

        Returns
        -------
        array, shape (n, v, f)
            [dB(A)]
        """
        compressor = self.there.laboratory.compressor
        stiffness = factors.reshape(-1, *compressor.stiffness.shape) * compressor.stiffness
        hoses = compressor.hoses if with_hoses else ()
        heard = [
            design_pressure(
                body,
                compressor,
                self.there.source,
                frequency,
                stiffness,
                hoses,
                gas_factor(pressure),
            )
            for body in self.bodies
        ]
        return spl(np.stack(heard, axis=1), frequency, axis=-1)


@dataclass(frozen=True, eq=False)
class CompressorFleet:
    """Cars whose bodies were struck; in the first one the compressor was struck and run.

    Parameters
    ----------
    cars : tuple of ElectricCar
    inputs : tuple of Path
        Every file that was read.
    truth : FleetTruth or None
        None where cars were measured.
    """

    cars: tuple[ElectricCar, ...]
    inputs: tuple[Path, ...]
    truth: FleetTruth | None = None


def measured_fleet(folders: Sequence[Path]) -> CompressorFleet:
    """Read the folders of cars.

    Parameters
    ----------
    folders : sequence of Path
        Each with ``car.toml``; the compressor is that of the first.

    Raises
    ------
    InputError
        A folder that holds no car, two cars of one name, cars with other mounts than the first.
    """
    cars = tuple(read_electric_car(folder) for folder in folders)
    first = cars[0]
    mounts = {point.name for point in first.mounts}
    for car in cars[1:]:
        if {point.name for point in car.mounts} != mounts:
            raise InputError(
                f"car {car.name} has the mounts {[point.name for point in car.mounts]}, car "
                f"{first.name} {sorted(mounts)}: one compressor stands on mounts of the same names"
            )
    names = [car.name for car in cars]
    if len(set(names)) < len(names):
        raise InputError(f"two cars have one name: {names}")
    files = dict.fromkeys(path for car in cars for path in car.input_files)
    return CompressorFleet(cars, tuple(files))


def virtual_fleet(seed: int, level: CalibrationLevel, fleet: int | None = None) -> CompressorFleet:
    """Measure a fleet of the virtual bench.

    Parameters
    ----------
    seed : int
        Of the laboratory, from 1.
    level : CalibrationLevel
    fleet : int, optional
        Seed of a drawn fleet; the frozen one if left out.

    Returns
    -------
    CompressorFleet
        The first car goes through its files, the others are struck in memory.
    """
    bodies = (frozen_fleet() if fleet is None else draw_fleet(fleet)).cars
    names = list(bodies)
    with tempfile.TemporaryDirectory() as folder:
        first = read_electric_car(
            write_electric_car(Path(folder) / "car", seed, names[0], fleet, level)
        )
    there = operation(seed, level, CAR_PLAN)
    others = [
        _struck(first, bodies[name], there, seed, level, number)
        for number, name in enumerate(names[1:])
    ]
    truth = FleetTruth(there, tuple(bodies.values()))
    return CompressorFleet((replace(first, input_files=()), *others), (), truth)


def bar_of(case: str) -> float:
    """Return the bench's pressure of a case [bar].

    Raises
    ------
    InputError
        A pressure that the bench does not have.
    """
    known = {f"{pressure:g} bar": pressure for pressure in PRESSURES}
    if case not in known:
        raise InputError(f"the bench has no sweep at {case}, only at {', '.join(known)}")
    return known[case]


def _struck(
    first: ElectricCar,
    body: ElectricCarBody,
    there: Operation,
    seed: int,
    level: CalibrationLevel,
    number: int,
) -> ElectricCar:
    """Strike another body where the first was struck, with new errors of placement and noise."""
    compressor = there.laboratory.compressor
    places = [*compressor.positions, *(hose.end for hose in compressor.hoses)]
    sheets = point_sheets(dict(zip(POINTS, places, strict=True)))
    purpose, errors = OTHER_CARS + 3 * number, placement_errors(level)
    setup = draw_setup(sheets, errors, draw(seed, purpose))
    microphone = draw_car_sensors(errors, draw(seed, purpose + 1)).microphone
    found = strike_body(body, setup, body_plan(), CABIN_NOISE, microphone, draw(seed, purpose + 2))
    pressure, accelerance = first.pressure, first.accelerance
    return replace(
        first,
        name=body.name,
        pressure=Frf(
            found.frequency,
            found.pressure[:, np.newaxis],
            pressure.outputs,
            pressure.inputs,
            pressure.unit,
        ),
        coherence=found.coherence[:, np.newaxis],
        accelerance=Frf(
            found.frequency,
            found.acceleration,
            accelerance.outputs,
            accelerance.inputs,
            accelerance.unit,
        ),
        input_files=(),
    )


def weighted_pressures(requests: Sequence[str] | None) -> dict[str, float]:
    """Read ``7.5`` or ``7.5=2``: pressures in bar with their weights.

    Raises
    ------
    InputError
        No number, a weight that is not above 0, a pressure twice.
    """
    chosen: dict[str, float] = {}
    for request in requests or ():
        text, _, weight = request.partition("=")
        try:
            name, share = f"{float(text):g} bar", float(weight or 1)
        except ValueError:
            name, share = "", 0.0
        if not 0 < share < float("inf") or name in chosen:
            raise InputError(
                f"--pressure {request}: write each pressure once, as BAR or BAR=WEIGHT with a "
                "weight above 0, such as 7.5=2"
            )
        chosen[name] = share
    return chosen


def weights_of(asked: dict[str, float], measured: Sequence[str]) -> dict[str, float]:
    """Return the weights of pressures that were measured; of all alike where none is asked for.

    Raises
    ------
    InputError
        A pressure that was not measured.
    """
    unknown = [name for name in asked if name not in measured]
    if unknown:
        raise InputError(f"no sweep at {unknown[0]} was measured, only at {', '.join(measured)}")
    return asked or dict.fromkeys(measured, 1.0)


STEPS = 8
"""Of `mounted_fleet`, for progress."""
REFERENCE = 40.0
"""Line at which dynamic stiffness is stated, where the band has it [Hz]."""


class Parts(Enum):
    """What may be chosen."""

    identical = "identical"
    """One part number: one axial and one radial stiffness for all mounts."""
    own = "own"
    """An axial and a radial stiffness for every mount."""


class Hoses(Enum):
    """What joins compressor and body besides the mounts."""

    none = "none"
    """Nothing."""
    identified = "identified"
    """The standard hoses, as beams identified from the first car's sweeps."""


@dataclass(frozen=True)
class MountQuestion:
    """What is asked of the mounts.

    Parameters
    ----------
    parts : Parts
    hoses : Hoses
    band : (float, float)
        Lines that count [Hz].
    line_step : float
        Between them; all must be measured [Hz].
    pressures : dict of str to float
        Weight of each pressure, such as ``7.5 bar`` → 1; empty for all of them alike [1].
    reach : float
        Stiffness factors run within ``1 ± reach`` [1].
    tolerance : float
        Half width of the scatter of each stiffness of each piece, three standard deviations [1].
    batch : float
        Share of the batch in its variance; with identical parts only, others have no batch in
        common [1].
    place_tolerance : float
        Half width of the scatter of each coordinate, three standard deviations [mm].

    Raises
    ------
    InputError
        Numbers outside of what they can be.
    """

    parts: Parts
    hoses: Hoses
    band: tuple[float, float]
    line_step: float
    pressures: dict[str, float]
    reach: float
    tolerance: float
    batch: float
    place_tolerance: float

    def __post_init__(self) -> None:
        if not 0 < self.reach < 1:
            raise InputError(f"--reach {self.reach:g}: factors run within 1 ± reach, below 1")
        if not 0 < self.tolerance < 1 or not 0 <= self.batch <= 1:
            raise InputError("tolerance and share of the batch lie between 0 and 1")
        if not 0 <= self.place_tolerance < DATUM:
            raise InputError(
                f"--place-tolerance {self.place_tolerance:g}: mounts are placed to some millimetres"
            )
        if not self.line_step > 0:
            raise InputError(f"--line-step {self.line_step:g}: give a step above 0 Hz")

    @property
    def lines(self) -> RealArray:
        """Of the band [Hz]."""
        low, high = self.band
        return np.arange(low, high + 1e-6 * high, self.line_step)

    def space(self, variables: MountVariables) -> DesignSpace:
        """Return the design space: what is no stiffness of a part number is fixed and scatters."""
        identical = self.parts is Parts.identical
        lower, upper, nominal, tolerance = [], [], [], []
        for number, name in enumerate(variables.names):
            if variables.moved[number].any():
                low = high = middle = DATUM
                width = self.place_tolerance / DATUM
            elif name.endswith(" piece"):
                low = high = middle = 1.0
                width = self.tolerance * np.sqrt(1 - self.batch)
            else:
                low, middle, high = 1 - self.reach, 1.0, 1 + self.reach
                width = self.tolerance * (np.sqrt(self.batch) if identical else 1.0)
            lower.append(low)
            upper.append(high)
            nominal.append(middle)
            tolerance.append(width)
        return DesignSpace(
            variables.names,
            variables.units,
            np.array(nominal),
            np.array(lower),
            np.array(upper),
            np.array(tolerance),
        )


@dataclass(frozen=True, eq=False)
class MountedFleet:
    """The model of a fleet, ready to be explored.

    Parameters
    ----------
    fleet : CompressorFleet
    question : MountQuestion
    found : Identification
        Of the compressor's hammer test.
    running : RunningInCar
        Its source, mounts and hoses.
    index : CabinIndex
    rigid : CabinIndex
        The same with holders that do not move.
    statics : MountStatics
        With the stiffness of the lowest line.
    seconds : float
        From measured cars to here [s].
    """

    fleet: CompressorFleet
    question: MountQuestion
    found: Identification
    running: RunningInCar
    index: CabinIndex
    rigid: CabinIndex
    statics: MountStatics
    seconds: float

    @property
    def reference_line(self) -> float:
        """Where dynamic stiffness is stated [Hz]."""
        lines = self.index.frequency
        return float(lines[np.argmin(np.abs(lines - REFERENCE))])

    @property
    def stiffness_at_reference(self) -> RealArray:
        """|K| of every mount there at factor 1, axial and two radial, shape (m, 3) [N/m]."""
        row = int(np.argmin(np.abs(self.index.frequency - self.reference_line)))
        return np.array(
            [abs(self.index.gain[row]) * mount.stiffness for mount in self.index.mounts]
        )

    @property
    def alarms(self) -> tuple[str, ...]:
        """What a reader must know of the data."""
        rotor = (
            ("The rotor's inertia is not stated: its gyroscopic moment is left out.",)
            if self.fleet.cars[0].operation.rotor_inertia is None
            else ()
        )
        return (*self.found.alarms, *self.running.alarms, *rotor)


def mounted_fleet(
    fleet: CompressorFleet, question: MountQuestion, step: Callable[[str], None]
) -> MountedFleet:
    """Identify the compressor, its source and its mounts, and join it to every car.

    Parameters
    ----------
    fleet : CompressorFleet
    question : MountQuestion
    step : callable of str
        Told what is being done.

    Returns
    -------
    MountedFleet

    Raises
    ------
    InputError
        A pressure that was not measured, lines that were not, no drawing of the mounts; see also
        `identify` and `running_in_car`.
    """
    begin = time.perf_counter()
    first, with_hoses = fleet.cars[0], question.hoses is Hoses.identified
    measured = dict.fromkeys(case_name(sweep.pressure) for sweep in first.operation.sweeps)
    weights_of(question.pressures, list(measured))  # before the work begins
    with threadpool_limits(1):  # its matrices are too small to share
        step("identification of the compressor")
        found = identify(
            first.operation.hammer, IdentifyOptions(held_out=0), hoses=first.operation.hoses
        )
        running = running_in_car(first, found, with_hoses=with_hoses, step=step)
        step("seams")
        lines = question.lines
        loads = source_loads(running.source.chosen.sources, lines)
        weights = weights_of(question.pressures, list(loads))
        model, mounts = found.calibrated.model, running.shares.mounts
        inertia = first.operation.rotor_inertia or 0.0
        sense = running.source.sense.sense
        used = {name: loads[name] for name in weights}
        free = free_compressor(model.mass_matrix, inertia, sense, lines, used)
        drawn = () if running.hoses is None else running.hoses.hoses
        beams = hose_matrices(drawn, lines) if drawn else None
        names = [hose.name for hose in drawn]
        bodies = [measured_body(car, mounts, lines, names) for car in fleet.cars]
        places = np.array([mount.position for mount in mounts])
        variables = mount_variables(
            mounts,
            identical=question.parts is Parts.identical,
            pieces=question.parts is Parts.identical,
            places=question.place_tolerance > 0,
        )
        gain = model.gain.at(lines) * (1 + running.change(lines))
        index, rigid = (
            CabinIndex(
                variables,
                mounts,
                gain,
                tuple(car_seam(free, places, body, beams) for body in held),
                tuple(weights.values()),
            )
            for held in (bodies, [body.rigid() for body in bodies])
        )
    statics = MountStatics(
        variables, mounts, float(gain[0].real), model.mass, model.centre, model.mass_matrix
    )
    seconds = time.perf_counter() - begin
    return MountedFleet(fleet, question, found, running, index, rigid, statics, seconds)


@dataclass(frozen=True, eq=False)
class Agreement:
    """Predicted and exact levels of designs within the bounds, in the first case.

    Parameters
    ----------
    designs : array, shape (n, k)
        The first one is today's.
    predicted, exact : array, shape (n, v, f)
        [dB(A)]
    """

    designs: RealArray
    predicted: RealArray
    exact: RealArray

    @property
    def peak_errors(self) -> RealArray:
        """Predicted minus exact level at the local maxima of the exact curves [dB]."""
        middle = self.exact[..., 1:-1]
        peaks = (middle > self.exact[..., :-2]) & (middle >= self.exact[..., 2:])
        return np.asarray((self.predicted - self.exact)[..., 1:-1][peaks])

    @property
    def changes(self) -> tuple[RealArray, RealArray]:
        """Change of the mean level against today, predicted and exact, each (n - 1, v) [dB]."""
        predicted, exact = (
            np.asarray((levels[1:] - levels[:1]).mean(axis=-1))
            for levels in (self.predicted, self.exact)
        )
        return predicted, exact


def agreement(model: MountedFleet, space: DesignSpace, n: int, *, seed: int) -> Agreement | None:
    """Compare with the bench's exact coupled solution.

    Parameters
    ----------
    model : MountedFleet
    space : DesignSpace
        Designs are drawn uniformly within its bounds; mounts stand where they are drawn.
    n : int
        Designs beside today's.
    seed : int
        From 1.

    Returns
    -------
    Agreement or None
        None for cars that were measured: their truth is not known.
    """
    if model.fleet.truth is None:
        return None
    drawn = generator(seed, "agreement").uniform(space.lower, space.upper, (n, space.n_variables))
    designs = np.vstack([space.nominal, drawn])
    exact = _exact(model, model.fleet.truth, designs, model.index.case_names[0])
    return Agreement(designs, model.index.levels(designs), exact)


def exact_change(model: MountedFleet, today: RealArray, design: RealArray) -> RealArray | None:
    """Return what a design truly changes: mean level of the lines, all cases.

    Parameters
    ----------
    model : MountedFleet
    today, design : array, shape (k,)
        Mounts stand where they are drawn.

    Returns
    -------
    array, shape (v,), or None
        [dB]; None for cars that were measured.
    """
    if model.fleet.truth is None:
        return None
    total = np.zeros(len(model.index.response_names))
    for case, weight in zip(model.index.case_names, model.index.weights, strict=True):
        before, after = _exact(model, model.fleet.truth, np.stack([today, design]), case)
        total += weight * (after - before).mean(axis=-1)
    return total


def _exact(model: MountedFleet, truth: FleetTruth, designs: RealArray, case: str) -> RealArray:
    """Levels of the bench's coupled cars, shape (n, v, f) [dB(A)]."""
    return truth.levels(
        model.index.variables.factors(designs),
        model.index.frequency,
        bar_of(case),
        with_hoses=model.question.hoses is Hoses.identified,
    )


FIRST_ORDER = 1.0
"""One cycle per turn: the lines are the rotational frequency."""
NOTICEABLE = 0.1
"""Change of the mean level of the lines that counts as noticeable [dB]."""
TRIED = 11
"""Values of each stiffness that are tried for it."""
TIGHTER = 0.5
"""A tighter tolerance, over today's [1]."""
TODAY, BEST_MEAN, BEST_SIGMA, KNEE = "today", "best mean", "best sigma", "knee"
PLACES = "places"


@dataclass(frozen=True, eq=False)
class CompressorFront:
    """A search over the mounts of a compressor, verified, with everything its report needs.

    Parameters
    ----------
    model : MountedFleet
        What was evaluated.
    robust : RobustResponse
        How it was made robust.
    travel_ratio : float
        Travel allowed over today's [1].
    search : SearchResult
    verification : Verification
    sobol : SobolIndices
        Of the chosen stiffnesses, uniform within their bounds; one output per car.
    agreement : Agreement or None
        With the exact coupled solution; None where cars were measured.
    """

    model: MountedFleet
    robust: RobustResponse
    travel_ratio: float
    search: SearchResult
    verification: Verification
    sobol: SobolIndices
    agreement: Agreement | None

    @property
    def cars(self) -> tuple[str, ...]:
        """Names of the cars."""
        return self.model.index.response_names

    @property
    def space(self) -> DesignSpace:
        """All variables, fixed ones included."""
        return self.robust.space

    @property
    def chosen(self) -> tuple[int, ...]:
        """Columns of a design that the search could choose."""
        return chosen_columns(self.space)

    @property
    def chosen_names(self) -> tuple[str, ...]:
        """Names of these."""
        return tuple(self.space.names[column] for column in self.chosen)

    @property
    def frequency(self) -> RealArray:
        """Lines [Hz]."""
        return self.model.index.frequency

    @property
    def n_lines(self) -> int:
        """Number of lines of each sum."""
        return self.model.index.n_lines

    @property
    def per_line(self) -> float:
        """Factor from a sum over cars and lines to the mean over both [1]."""
        return 1.0 / (self.n_lines * len(self.cars))

    @cached_property
    def picks(self) -> dict[str, int]:
        """Rows of the front by name of the pick, chosen on verified values."""
        rows = pick(self.verification.values)
        return {BEST_MEAN: rows.best_mean, BEST_SIGMA: rows.best_sigma, KNEE: rows.knee}

    @cached_property
    def designs(self) -> dict[str, RealArray]:
        """Today's design and the picks, each of shape (k,)."""
        found = self.verification.values.designs
        return {TODAY: self.space.nominal} | {name: found[row] for name, row in self.picks.items()}

    @property
    def best(self) -> RealArray:
        """Best mean, shape (k,)."""
        return self.designs[BEST_MEAN]

    @cached_property
    def _verified(self) -> RobustResponse:
        check = self.verification
        return verification_response(self.robust, check.n_samples, seed=check.seed)

    @cached_property
    def baseline(self) -> RobustValues:
        """Today's mounts under the verification's draws; one row."""
        return self._verified(self.space.nominal[np.newaxis])

    def row(self, name: str) -> tuple[RobustValues, int]:
        """Return where the verified values of a named design stand."""
        if name == TODAY:
            return self.baseline, 0
        return self.verification.values, self.picks[name]

    def levels(self, design: RealArray) -> RealArray:
        """SPL of one design without scatter in the first case, shape (v, f) [dB(A)]."""
        return np.asarray(self.model.index.levels(design[np.newaxis])[0])

    def level_change(self, design: RealArray) -> RealArray:
        """Change of the mean level of the lines, all cases, shape (v,) [dB]."""
        both = self.model.index(np.stack([self.space.nominal, design]))
        return np.asarray((both[1] - both[0]) / self.n_lines)

    @property
    def mean_change(self) -> float:
        """Change of the mean level over cars, lines and scatter by best mean [dB]."""
        values, row = self.row(BEST_MEAN)
        return float((values.mean_sum[row] - self.baseline.mean_sum[0]) * self.per_line)

    def energy_change(self, design: RealArray) -> RealArray:
        """Change of the mean energy level of the first case, shape (v,) [dB]."""
        lines = self.frequency
        band = (float(lines[0]), float(lines[-1]))
        before, after = (
            mean_energy_level(self.levels(one), lines, band) for one in (self.space.nominal, design)
        )
        return np.asarray(after - before)

    def energy_sigma(self, design: RealArray) -> RealArray:
        """Scatter of the energy level over the search's draws, shape (v,) [dB]."""
        lines = self.frequency
        level = self.model.index.levels(self.robust.made(design))
        energy = mean_energy_level(level, lines, (float(lines[0]), float(lines[-1])))
        return np.asarray(energy.std(axis=0, ddof=1))

    @cached_property
    def peak_changes(self) -> Mapping[str, tuple[PeakChange, ...]]:
        """Peaks of each car in the first case, today and in best mean."""
        before, after = self.levels(self.space.nominal), self.levels(self.best)
        return {
            name: compare_peaks(before[row], after[row], self.frequency, FIRST_ORDER)
            for row, name in enumerate(self.cars)
        }

    def stiffness(self, design: RealArray) -> RealArray:
        """|K| of every mount at the reference line, axial and two radial, shape (m, 3) [N/m]."""
        factors = self.model.index.variables.factors(design[np.newaxis])[0]
        at_one = self.model.stiffness_at_reference
        return np.asarray(factors.reshape(at_one.shape) * at_one)

    def chosen_stiffness(self, design: RealArray) -> RealArray:
        """Mean |K| that each chosen variable stands for, shape (n_chosen,) [N/m]."""
        values = self.stiffness(design).ravel()
        scaled = self.model.index.variables.scaled
        return np.array([values[scaled[column]].mean() for column in self.chosen])

    def travel(self, design: RealArray) -> float:
        """Largest travel of a mount under 1 g [mm]."""
        return float(self.model.statics(design[np.newaxis])[0, 0])

    @cached_property
    def at_bound(self) -> tuple[str, ...]:
        """Chosen variables that best mean has at a bound, in words."""
        reached = []
        for column, name in zip(self.chosen, self.chosen_names, strict=True):
            span = self.space.upper[column] - self.space.lower[column]
            for end, word in ((self.space.lower, "lower"), (self.space.upper, "upper")):
                if abs(self.best[column] - end[column]) < 0.01 * span:
                    reached.append(f"{name} ({word})")
        return tuple(reached)

    @property
    def limit_reached(self) -> bool:
        """Whether best mean travels as far as it may, to 2 %."""
        allowed = self.travel_ratio * self.travel(self.space.nominal)
        return self.travel(self.best) > 0.98 * allowed

    @cached_property
    def leading(self) -> str:
        """Chosen stiffness with the largest mean total index over the cars."""
        return self.chosen_names[int(np.argmax(self.sobol.total.mean(axis=1)))]

    @cached_property
    def exact_change(self) -> RealArray | None:
        """What best mean changes in the exact cars, shape (v,) [dB]; None where none are."""
        return exact_change(self.model, self.space.nominal, self.best)

    @cached_property
    def shares(self) -> SigmaShares:
        """Whose tolerance makes the scatter of best mean."""
        return sigma_shares(self._verified, self.best)

    @cached_property
    def groups(self) -> dict[str, list[int]]:
        """Columns whose tolerance one would tighten together: a part number's axis, or places."""
        variables = self.model.index.variables
        scaled = variables.scaled
        groups: dict[str, list[int]] = {}
        for column, name in zip(self.chosen, self.chosen_names, strict=True):
            pieces = scaled.any(axis=1) & ~(scaled & ~scaled[column]).any(axis=1)
            groups[name] = np.flatnonzero(pieces).tolist()
        if variables.places.size:
            groups[PLACES] = variables.places.tolist()
        return groups

    @cached_property
    def worth(self) -> dict[str, float]:
        """Change of the sum of σ of best mean, where a group is made to `TIGHTER` tolerance [%]."""
        today = float(self.robust(self.best[np.newaxis]).sigma_sum[0])
        found = {}
        for name, columns in self.groups.items():
            tolerance = np.array(self.space.tolerance)
            tolerance[columns] *= TIGHTER
            tight = replace(self.robust, space=replace(self.space, tolerance=tolerance))
            then = float(tight(self.best[np.newaxis]).sigma_sum[0])
            found[name] = 100 * (then / today - 1)
        return found

    @cached_property
    def indifference(self) -> RealArray:
        """Interval of each chosen variable around best mean without a noticeable change, (n, 2)."""
        change = NOTICEABLE * self.n_lines
        both = np.column_stack(indifference_intervals(self.robust, self.best, change, TRIED))
        return np.asarray(both[list(self.chosen)])

    @cached_property
    def rigid_difference(self) -> RealArray:
        """Level with holders that do not move minus level, today, first case, (v, f) [dB]."""
        today = self.space.nominal[np.newaxis]
        return np.asarray((self.model.rigid.levels(today) - self.model.index.levels(today))[0])

    @property
    def facts(self) -> dict[str, str | float]:
        """What ``run.json`` says beside the arguments."""
        return {
            "mounts": self.model.running.shares.statement,
            "mount_state": self.model.running.source.state.statement,
            "parts": Parts(self.model.question.parts).value,
            "tolerance_sample": self.robust.sample.kind,
            "seconds_model": round(self.model.seconds, 3),
        }


def chosen_columns(space: DesignSpace) -> tuple[int, ...]:
    """Return the columns that a search can choose; the others are fixed and only scatter."""
    return tuple(np.flatnonzero(space.upper > space.lower).tolist())


def stiffness_sobol(model: MountedFleet, space: DesignSpace, n: int, *, seed: int) -> SobolIndices:
    """Return the Sobol indices of the chosen stiffnesses, uniform within their bounds.

    Parameters
    ----------
    model : MountedFleet
    space : DesignSpace
    n : int
        Base points, a power of two.
    seed : int
        From 1.

    Returns
    -------
    SobolIndices
        First and total; one output per car.

    Raises
    ------
    InputError
        See `deboom.explore.sensitivity.sobol_designs`.
    """
    columns = list(chosen_columns(space))
    inputs = SensitivityInputs(
        tuple(space.names[c] for c in columns), space.lower[columns], space.upper[columns]
    )
    chosen = sobol_designs(inputs, n, seed=seed, second_order=False)
    designs = np.tile(space.nominal, (len(chosen), 1))
    designs[:, columns] = chosen
    return fast_sobol_indices(
        model.index(designs),
        inputs.factors,
        model.index.response_names,
        seed=seed,
        second_order=False,
    )


N_PER_MM = 1e-3
"""From N/m to N/mm."""
PERCENT = 100.0


def front_table(study: CompressorFront) -> pd.DataFrame:
    """One row per design of the front: verified objectives, chosen factors, travel."""
    check, scale = study.verification.values, study.per_line
    names = {row: name for name, row in reversed(study.picks.items())}
    columns = {
        "point": np.arange(1, len(check) + 1),
        "pick": [names.get(row, "") for row in range(len(check))],
        "mean level [dB(A)]": check.mean_sum * scale,
        "sigma of the level [dB]": check.sigma_sum * scale,
        "standard error of the mean [dB]": check.standard_error_mean_sum * scale,
        "standard error of sigma [dB]": check.standard_error_sigma_sum * scale,
        "non-dominated when verified": study.verification.nondominated,
        "travel under 1 g [mm]": [study.travel(design) for design in check.designs],
    }
    for column, name in zip(study.chosen, study.chosen_names, strict=True):
        columns[f"{name} factor [1]"] = check.designs[:, column]
    return pd.DataFrame(columns)


def convergence_table(study: CompressorFront) -> pd.DataFrame:
    """One row per generation: hypervolume of the front so far, as the search saw it."""
    volume = study.search.hypervolume
    return pd.DataFrame({"generation": np.arange(1, len(volume) + 1), "hypervolume [dB²]": volume})


def pick_table(study: CompressorFront) -> pd.DataFrame:
    """One row per named design: objectives, travel, rigid-body modes."""
    rows = []
    base = study.baseline
    for name, design in study.designs.items():
        values, row = study.row(name)
        modes = study.model.statics.modes(design[np.newaxis])[0]
        rows.append(
            {
                "design": name,
                "mean level [dB(A)]": values.mean_sum[row] * study.per_line,
                "change [dB]": (values.mean_sum[row] - base.mean_sum[0]) * study.per_line,
                "sigma of the level [dB]": values.sigma_sum[row] * study.per_line,
                "change of sigma [%]": PERCENT * (values.sigma_sum[row] / base.sigma_sum[0] - 1),
                "travel under 1 g [mm]": study.travel(design),
                "lowest mode [Hz]": modes[0],
                "highest mode [Hz]": modes[-1],
            }
        )
    return pd.DataFrame(rows)


def stiffness_table(study: CompressorFront) -> pd.DataFrame:
    """One row per chosen stiffness: today's and that of each pick, and what is free."""
    today = study.chosen_stiffness(study.space.nominal) * N_PER_MM
    table: dict[str, object] = {"stiffness": list(study.chosen_names), "today [N/mm]": today}
    for name, design in study.designs.items():
        if name != TODAY:
            table[f"{name} [N/mm]"] = study.chosen_stiffness(design) * N_PER_MM
    low, high = study.indifference.T
    table["best mean from [N/mm]"] = today * low
    table["best mean to [N/mm]"] = today * high
    return pd.DataFrame(table)


def car_table(study: CompressorFront) -> pd.DataFrame:
    """One row per car: what best mean changes, and how far the tolerance scatters it."""
    values, row = study.row("best mean")
    base, n = study.baseline, study.n_lines
    return pd.DataFrame(
        {
            "car": list(study.cars),
            "level today [dB(A)]": base.mean[0] / n,
            "level then [dB(A)]": values.mean[row] / n,
            "change [dB]": study.level_change(study.best),
            "sigma today [dB]": base.sigma[0] / n,
            "sigma then [dB]": values.sigma[row] / n,
            "energy change [dB]": study.energy_change(study.best),
            "sigma of energy [dB]": study.energy_sigma(study.best),
        }
    )


def peak_table(study: CompressorFront) -> pd.DataFrame:
    """Peaks of the first case today, and what became of them in best mean."""
    rows = []
    for car, changes in study.peak_changes.items():
        for change in changes:
            rows.append(
                {
                    "car": car,
                    "frequency [Hz]": change.frequency,
                    "speed [rpm]": 60.0 * change.frequency,
                    "SPL today [dB(A)]": change.level_before,
                    "SPL then [dB(A)]": change.level_after,
                    "change [dB]": change.level_after - change.level_before,
                }
            )
    names = ("car", "frequency [Hz]", "speed [rpm]", "SPL today [dB(A)]", "SPL then [dB(A)]")
    return pd.DataFrame(rows, columns=[*names, "change [dB]"])


def sobol_table(study: CompressorFront) -> pd.DataFrame:
    """One row per chosen stiffness and car: Sobol indices with the half widths of intervals."""
    found = study.sobol
    return pd.DataFrame(
        [
            {
                "stiffness": factor,
                "car": car,
                "total [1]": found.total[row, place],
                "total ± 95 % [1]": found.total_interval[row, place],
                "alone [1]": found.first[row, place],
                "alone ± 95 % [1]": found.first_interval[row, place],
            }
            for row, factor in enumerate(found.factors)
            for place, car in enumerate(found.outputs)
        ]
    )


def requirement_table(study: CompressorFront) -> pd.DataFrame:
    """One row per chosen stiffness, and the places: what is wanted, and what its tolerance costs.

    Importance is the mean total index over the cars. The share of sigma is that of the tolerance of
    all that belongs to the row, at best mean.
    """
    tolerance = study.model.question.tolerance
    today = study.chosen_stiffness(study.space.nominal) * N_PER_MM
    wanted = study.chosen_stiffness(study.best) * N_PER_MM
    total = study.sobol.total.mean(axis=1)
    rows = []
    for name, columns in study.groups.items():
        share = PERCENT * float(study.shares.of_sum[columns].sum())
        gain = study.worth[name]
        if name == PLACES:
            row = dict.fromkeys(("today", "wanted", "at least", "at most"), np.nan)
            row |= {"factor": np.nan, "tolerance": np.nan, "importance": np.nan}
        else:
            place = study.chosen_names.index(name)
            row = {
                "today": today[place],
                "wanted": wanted[place],
                "factor": wanted[place] / today[place],
                "tolerance": PERCENT * tolerance,
                "at least": wanted[place] * (1 - tolerance),
                "at most": wanted[place] * (1 + tolerance),
                "importance": total[place],
            }
        rows.append(
            {
                "requirement": name,
                "today [N/mm]": row["today"],
                "wanted [N/mm]": row["wanted"],
                "wanted / today [1]": row["factor"],
                "tolerance ± [%]": row["tolerance"],
                "at least [N/mm]": row["at least"],
                "at most [N/mm]": row["at most"],
                "importance [1]": row["importance"],
                "share of sigma [%]": share,
                "sigma with half the tolerance [%]": gain,
            }
        )
    return pd.DataFrame(rows)


def agreement_table(study: CompressorFront) -> pd.DataFrame:
    """One row per design and car: predicted and exact change of the level; empty without truth."""
    columns = ["design", "car", "predicted change [dB]", "exact change [dB]"]
    if study.agreement is None:
        return pd.DataFrame(columns=columns)
    predicted, exact = study.agreement.changes
    return pd.DataFrame(
        [
            [number + 1, car, predicted[number, place], exact[number, place]]
            for number in range(len(exact))
            for place, car in enumerate(study.cars)
        ],
        columns=columns,
    )


def front_summary(study: CompressorFront) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    check, base = study.verification.values, study.baseline
    summary: dict[str, Scalar] = {"n_front": len(check)}
    for car, change in zip(study.cars, study.level_change(study.best), strict=True):
        summary[f"level_change_db_{car}"] = float(change)
    summary["mean_change_db"] = study.mean_change
    for name in ("best mean", "best sigma"):
        sigma = check.sigma_sum[study.picks[name]] / base.sigma_sum[0]
        summary[f"sigma_change_percent_{name.replace(' ', '_')}"] = float(PERCENT * (sigma - 1))
    summary["leading_stiffness"] = study.leading
    summary["leading_total_index"] = float(study.sobol.total.mean(axis=1).max())
    summary["travel_ratio"] = study.travel(study.best) / study.travel(study.space.nominal)
    summary["travel_limit_reached"] = str(study.limit_reached).lower()
    summary["at_bound"] = ", ".join(study.at_bound)
    rigid = np.abs(study.rigid_difference)
    summary["rigid_holders_median_db"] = float(np.median(rigid))
    summary["rigid_holders_p90_db"] = float(np.quantile(rigid, 0.9))
    if study.agreement is not None and study.exact_change is not None:
        errors = np.abs(study.agreement.peak_errors)
        predicted, exact = study.agreement.changes
        summary["peak_error_median_db"] = float(np.median(errors))
        summary["peak_error_p90_db"] = float(np.quantile(errors, 0.9))
        summary["exact_mean_change_db"] = float(np.mean(study.exact_change))
        summary["change_error_rms_db"] = float(np.sqrt(np.mean((predicted - exact) ** 2)))
    summary["sigma_bias_percent"] = study.verification.sigma_bias_percent
    summary["mean_bias_db"] = study.verification.mean_bias * study.per_line
    summary["n_evaluated"] = study.search.n_evaluated
    summary["n_failed"] = study.search.n_failed
    summary["seconds_search"] = round(study.search.seconds, 3)
    return summary


TERMS = (
    "SPL",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "σ",
    "Pareto front",
    "knee",
    "sensitivity index",
    "noise transfer function",
)


def compressor_front_report(study: CompressorFront) -> Report:
    """Report which mounts make the cars quiet, with the sheet for their supplier.

    Parameters
    ----------
    study : CompressorFront
        Searched and verified.
    """
    base, check = study.baseline, study.verification
    sigma = 100 * (check.values.sigma_sum[study.picks["best mean"]] / base.sigma_sum[0] - 1)
    low, high = study.model.question.band
    report = Report(
        "Mounts of the compressor: quiet cars in spite of scatter",
        f"Which stiffness of its mounts makes a compressor quiet in {len(study.cars)} electric "
        f"cars, {low:g} to {high:g} Hz, and keeps them quiet as parts scatter?",
    )
    report.tile(f"{signed(study.mean_change, 1)} dB", "mean level, best mean against today")
    report.tile(f"{signed(float(sigma), 0)} %", "its σ over the tolerance")
    report.tile(
        f"{study.travel(study.best) / study.travel(study.space.nominal):.2f}",
        f"travel over today's; {study.travel_ratio:g} is allowed",
    )
    report.tile(study.leading, "stiffness that matters most")
    if study.agreement is not None:
        error = float(np.median(np.abs(study.agreement.peak_errors)))
        report.tile(f"{error:.2f} dB", "median error of the model at peaks")
    report.explain(*TERMS)
    report.warn(*study.model.alarms)
    _choice(report, study)
    _quiet(report, study)
    _matters(report, study)
    _trust(report, study)
    search = study.search
    report.section(
        "How the search went",
        f"NSGA-II, {search.hypervolume.size} generations, {search.n_evaluated} designs, "
        f"{search.seconds:.1f} s. Every design was made {study.robust.sample.n_samples} times "
        f"within its tolerance; the front was verified with {check.n_samples} draws that the "
        "search never saw.",
    )
    report.figure(
        "convergence",
        convergence(
            np.arange(1, len(search.hypervolume) + 1),
            search.hypervolume,
            hypervolume_label="hypervolume [dB²]",
        ),
        "Hypervolume of the front over the generations; flat means that more generations would "
        "not have helped.",
    )
    report.table("front", front_table(study))
    report.table("convergence", convergence_table(study))
    report.table("agreement", agreement_table(study))
    report.summary.update(front_summary(study))
    report.facts |= study.facts
    report.inputs += study.model.fleet.inputs
    for name, content in mount_sheet(study, SOURCE).items():
        report.attach(name, content)
    return report


def _one_decimal(table: pd.DataFrame) -> dict[str, int]:
    """Decimals of a table's stiffnesses."""
    return {name: 1 for name in table.columns if name.endswith("[N/mm]")}


def _shades(study: CompressorFront) -> dict[str, str]:
    """Colour of each mount."""
    return mount_colours(list(dict.fromkeys(mount_of(name) for name in study.chosen_names)))


def _choice(report: Report, study: CompressorFront) -> None:
    """Show the front, the named designs and their stiffness."""
    question = study.model.question
    what = (
        "One part number for all mounts: an axial and a radial stiffness; pieces scatter on their "
        "own, and batch by batch together."
        if question.parts is Parts.identical
        else "Every mount has an axial and a radial stiffness of its own."
    )
    place = (
        f" Mounts stand within ± {question.place_tolerance:g} mm of where they are."
        if question.place_tolerance
        else ""
    )
    bound = f" Best mean is at the bound of {', '.join(study.at_bound)}." if study.at_bound else ""
    reached = " It uses all the travel allowed." if study.limit_reached else ""
    report.section(
        "What to choose",
        f"{what}{place}\n\nSofter mounts nearly always isolate better. What holds them back is how "
        "far the compressor may travel: no mount may move further under 1 g along any axis than "
        f"{study.travel_ratio:g} times today's. Where the limit and the bounds of the search are "
        "reached, they and not the noise decide: the answer is as good as that limit."
        f"{reached}{bound}",
    )
    values, scale, base = study.verification.values, study.per_line, study.baseline
    report.figure(
        "pareto_front",
        pareto_front(
            values.mean_sum * scale,
            values.sigma_sum * scale,
            values.standard_error_mean_sum * scale,
            values.standard_error_sigma_sum * scale,
            (float(base.mean_sum[0]) * scale, float(base.sigma_sum[0]) * scale),
            {
                name: (float(values.mean_sum[at]) * scale, float(values.sigma_sum[at]) * scale)
                for name, at in study.picks.items()
            },
            mean_label="mean level over cars and lines [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
        "Mean level against its scatter; every point is a design that no other beats.",
    )
    chosen = list(study.chosen)
    report.figure(
        "stiffness_bars",
        stiffness_bars(
            study.chosen_names,
            study.best[chosen],
            study.space.lower[chosen],
            study.space.upper[chosen],
            study.chosen_stiffness(study.space.nominal) * N_PER_MM,
            [False] * len(chosen),
            study.indifference,
            _shades(study),
            stiffness_label=f"|K| at {study.model.reference_line:g} Hz [N/mm]",
        ),
        "Best mean: stiffness factors within their bounds. The thin bars are ranges within which "
        f"the mean level stays within {NOTICEABLE} dB.",
    )
    report.table(
        "picks",
        pick_table(study),
        "Named designs, verified. Travel and modes are with the stiffness at "
        f"{study.frequency[0]:g} Hz, which is more than at rest: compare them, do not take them "
        "for a static drawing.",
    )
    stiffness = stiffness_table(study)
    report.table(
        "stiffness",
        stiffness,
        f"Dynamic stiffness |K| at {study.model.reference_line:g} Hz, mean over what a variable "
        "stands for.",
        _one_decimal(stiffness),
    )


def _quiet(report: Report, study: CompressorFront) -> None:
    """Show levels and peaks of every car."""
    before, after = study.levels(study.space.nominal), study.levels(study.best)
    change = after - before
    car, line = np.unravel_index(int(np.argmax(change)), change.shape)
    louder = (
        " Mounts move the resonances of the compressor: where it now swings, levels rise, most of "
        f"all by {change[car, line]:.1f} dB to {after[car, line]:.0f} dB(A) in {study.cars[car]} "
        f"at {study.frequency[line]:g} Hz ({60 * study.frequency[line]:.0f} rpm)."
        if change[car, line] > NOTICEABLE
        else ""
    )
    report.section(
        "What it does in every car",
        "First order of the compressor at the driver's ear. Curves and peaks are those of the "
        f"first pressure; levels and changes are weighted over all.{louder}",
    )
    colours, peaks = vehicle_colours(study.cars), study.peak_changes
    report.figure(
        "spl_curves",
        spl_curves(
            study.frequency,
            FIRST_ORDER,
            before,
            after,
            study.cars,
            [[c.before.frequency for c in peaks[car] if c.before] for car in study.cars],
            [[c.after.frequency for c in peaks[car] if c.after] for car in study.cars],
            colours,
        ),
        "Today and best mean, without scatter.",
    )
    sigma = study.verification.values.sigma[study.picks["best mean"]] / study.n_lines
    report.figure(
        "per_car_change",
        per_vehicle_change(
            study.cars,
            study.level_change(study.best),
            sigma,
            study.energy_change(study.best),
            study.energy_sigma(study.best),
            colours,
            level_label="change of the mean level [dB]",
            energy_label=f"change of energy {study.frequency[0]:g}–{study.frequency[-1]:g} Hz [dB]",
        ),
        "Change against today; whiskers are ± one σ of scatter.",
    )
    report.table("cars", car_table(study), "Levels are means over lines and scatter.")
    report.table("peaks", peak_table(study), "Peaks of at least 6 dB.")


def _matters(report: Report, study: CompressorFront) -> None:
    """Show which stiffness is worth a supplier's effort."""
    report.section(
        "What matters to whoever makes the mounts",
        "Importance is the share of the variance of the level that a stiffness is behind, "
        "couplings included, when all vary within the bounds of the search; mean over the cars. "
        f"The share of σ belongs to the tolerance at best mean. {study.leading} matters most. "
        "supplier_sheet.html is the page for the supplier.",
    )
    found, shades = study.sobol, _shades(study)
    columns = (found.first.T, found.total.T, found.total_interval.T, found.zero.T)
    report.figure(
        "sobol",
        index_bars(
            found.factors,
            [shades[mount_of(name)] for name in found.factors],
            [IndexBars(*one) for one in zip(found.outputs, *columns, strict=True)],
            x_label="share of the variance [1]",
        ),
        "Sobol indices: full bars alone, hatched ones in interaction.",
    )
    report.table("sobol", sobol_table(study))
    wanted = requirement_table(study)
    report.table(
        "requirements",
        wanted,
        "Required stiffness, and what tolerances are worth: change of σ if this one alone were "
        "halved.",
        _one_decimal(wanted),
    )


def _trust(report: Report, study: CompressorFront) -> None:
    """Say what the model leaves out, and how far it is from the exact cars where they are known."""
    running, question = study.model.running, study.model.question
    rigid = np.abs(study.rigid_difference)
    hoses = (
        "Hoses are in as identified beams."
        if question.hoses is Hoses.identified
        else "Hoses are left out: theirs is a path of its own, which mounts do not change."
    )
    report.section("How far to trust it", running.shares.statement)
    report.text(running.source.state.statement)
    report.text(
        "Mounts keep their gain over frequency whatever their stiffness, and do not soften with "
        f"amplitude. {hoses}"
    )
    report.text(
        "The holders of the mounts give way as the free bodies do, by accelerances measured with "
        "the compressor out. Rigid holders would move the level of a line by "
        f"{np.median(rigid):.2f} dB (median), {np.quantile(rigid, 0.9):.2f} dB (90 %)."
    )
    if study.agreement is None or study.exact_change is None:
        return
    errors = np.abs(study.agreement.peak_errors)
    predicted, exact = study.agreement.changes
    rms = float(np.sqrt(np.mean((predicted - exact) ** 2)))
    report.text(
        f"On the virtual bench {len(exact)} designs within the bounds were compared with the "
        f"exact coupled solution: at peaks {np.median(errors):.2f} dB (median), "
        f"{np.quantile(errors, 0.9):.2f} dB (90 %); change of the mean level against today "
        f"{rms:.2f} dB (rms) of {float(np.sqrt(np.mean(exact**2))):.2f} dB. Best mean changes "
        f"it by {signed(float(study.exact_change.mean()), 2)} dB in the exact cars, and by "
        f"{signed(float(study.level_change(study.best).mean()), 2)} dB in the model."
    )
    panels = [
        CurvePanel(car, study.frequency, {"predicted": model_level, "exact": exact_level})
        for car, model_level, exact_level in zip(
            study.cars, study.agreement.predicted[1], study.agreement.exact[1], strict=True
        )
    ]
    report.figure(
        "agreement",
        curve_panels(
            panels,
            x_label="rotational frequency [Hz]",
            y_label="SPL [dB(A)]",
            dashed=("exact",),
            share_y=True,
        ),
        "One design that nobody measured: predicted and exact level.",
    )


STEM = "supplier_sheet"


def mount_sheet(study: CompressorFront, source: str) -> dict[str, bytes]:
    """Write the page and the workbook for the supplier.

    Parameters
    ----------
    study : CompressorFront
    source : str
        Where the sheet comes from.

    Returns
    -------
    dict of str to bytes
        File name → content.
    """
    wanted, conditions = requirement_table(study), condition_table(study, source)
    cars = car_table(study)[["car", "change [dB]", "sigma today [dB]", "sigma then [dB]"]]
    sheet = Report(
        "Mounts of the refrigerant compressor",
        f"Dynamic stiffness |K| at {study.model.reference_line:g} Hz that makes "
        f"{len(study.cars)} electric cars quiet, what its tolerance costs, and which direction "
        "matters.",
        compact=True,
    )
    sheet.tile(f"{signed(study.mean_change, 1)} dB", "first order in the cabin, mean of cars")
    sheet.tile(study.leading, "matters most")
    sheet.section("Requirement")
    sheet.table(
        None,
        wanted,
        "Importance: share of the variance of the level within the range searched. Share of "
        "sigma: of the scatter between cars as built; last column: its change if this tolerance "
        "alone were halved.",
        _one_decimal(wanted),
    )
    sheet.section("Effect")
    sheet.table(None, cars, "Mean level of the lines, and its scatter.")
    sheet.section("Conditions")
    sheet.table(None, conditions, "Under which these hold.")
    sheets = {
        "requirement": wanted,
        "effect": cars,
        "designs": pick_table(study),
        "conditions": conditions,
    }
    return {
        f"{STEM}.html": sheet.html().encode("utf-8"),
        f"{STEM}.xlsx": workbook_bytes(sheets, sheet.title),
    }


def condition_table(study: CompressorFront, source: str) -> pd.DataFrame:
    """List under which conditions the requirement holds, and where it comes from."""
    question, index = study.model.question, study.model.index
    places = "; ".join(
        f"{mount.name} " + ", ".join(f"{1e3 * value:.1f}" for value in mount.position)
        for mount in index.mounts
    )
    parts = "one part number" if question.parts is Parts.identical else "one part per mount"
    cases = zip(index.case_names, index.weights, strict=True)
    rows = {
        "mounts": f"{parts}; places x, y, z from the virtual point [mm]: {places}",
        "directions": "axial along the axis of the mount, radial across it, both alike",
        "stiffness": "magnitude of the complex dynamic stiffness; loss factor as today",
        "band": f"{index.frequency[0]:g}–{index.frequency[-1]:g} Hz, first order",
        "pressures": ", ".join(f"{name} (weight {weight:.2g})" for name, weight in cases),
        "tolerance": f"± {100 * question.tolerance:g} % is three standard deviations"
        + (
            f", {100 * question.batch:g} % of the variance from batch to batch"
            if question.parts is Parts.identical
            else ""
        ),
        "places": f"± {question.place_tolerance:g} mm is three standard deviations",
        "travel": f"under 1 g at most {study.travel_ratio:g} times today's; "
        f"reached {study.travel(study.best) / study.travel(study.space.nominal):.2f}",
        "hoses": "as identified" if question.hoses is Hoses.identified else "left out",
        "source": source,
    }
    return pd.DataFrame({"condition": list(rows), "value": list(rows.values())})


SOURCE = "study compressor_robust_front; its options are in run.json beside this sheet"


COMPARED = 20
"""Designs that are compared with the exact solution."""


@dataclass(frozen=True)
class FrontBudget:
    """How long is searched and verified, and how far mounts may travel.

    Parameters
    ----------
    population, generations : int
        Of NSGA-II.
    samples, checks : int
        Draws per design in the search and in its verification, powers of two.
    base_points : int
        Of the Sobol indices, a power of two.
    travel : float
        Largest travel of a mount under 1 g, over today's [1].

    Raises
    ------
    InputError
        A travel that is not positive.
    """

    population: int
    generations: int
    samples: int
    checks: int
    base_points: int
    travel: float

    def __post_init__(self) -> None:
        if not self.travel > 0:
            raise InputError(f"--travel {self.travel:g}: give a ratio above 0, such as 1.2")


def compressor_front(
    model: MountedFleet,
    budget: FrontBudget,
    seed: int,
    progress: Progress,
    run: RunContext | None,
    workers: Callable[[Robust], AbstractContextManager[Robust]],
) -> CompressorFront:
    """Search, verify, and find out what matters.

    Parameters
    ----------
    model : MountedFleet
    budget : FrontBudget
    seed : int
        From 1.
    progress : callable
        Of the search.
    run : RunContext or None
        Where the search is kept.
    workers : callable
        Puts a robust response where it is computed.

    Returns
    -------
    CompressorFront

    Raises
    ------
    InputError
        No design keeps the limit on travel; counts that are no powers of two; seed 0.
    """
    space = model.question.space(model.index.variables)
    if budget.checks < space.n_variables + 2:
        raise InputError(
            f"--checks {budget.checks}: a verification of {space.n_variables} variables that "
            f"scatter needs at least {space.n_variables + 2} draws"
        )
    sample = sobol_sample(space.n_variables, budget.samples, seed=seed)
    robust = RobustResponse(model.index, space, sample)
    allowed = budget.travel * float(model.statics(space.nominal[None])[0, 0])
    limits = Limits((Limit(model.statics.response_names[0], "mm", at_most=allowed),))
    with workers(robust) as spread:
        limited = LimitedResponse(spread, model.statics, limits)
        search = robust_search(
            limited,
            robust,
            Budget(budget.population, budget.generations),
            seed,
            progress,
            run,
            model.fleet.inputs,
        )
    return CompressorFront(
        model,
        robust,
        budget.travel,
        search,
        verify(search.front, robust, n_samples=budget.checks, seed=seed),
        stiffness_sobol(model, space, budget.base_points, seed=seed),
        agreement(model, space, COMPARED, seed=seed),
    )
