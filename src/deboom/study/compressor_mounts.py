"""From measured cars to the model whose mounts are explored."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.compressor.cabin_index import CabinIndex
from deboom.compressor.car_seam import car_seam, free_compressor, measured_body
from deboom.compressor.hose_beams import hose_matrices
from deboom.compressor.identify import Identification, IdentifyOptions, identify
from deboom.compressor.mount_statics import MountStatics
from deboom.compressor.mount_variables import DATUM, MountVariables, mount_variables
from deboom.compressor.running_in_car import RunningInCar, running_in_car
from deboom.compressor.source_load import case_name, source_loads
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace
from deboom.study.compressor_fleet import CompressorFleet
from deboom.study.compressor_pressures import weights_of

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
        found = identify(first.operation.hammer, IdentifyOptions(held_out=0))
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
