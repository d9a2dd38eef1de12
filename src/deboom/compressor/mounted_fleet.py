"""Cars with one compressor, and their noise as a function of its mounts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.cabin_index import (
    DATUM,
    CabinIndex,
    MountStatics,
    MountVariables,
    car_seam,
    measured_body,
    mount_variables,
)
from deboom.compressor.cabin_noise import RunningInCar, running_in_car
from deboom.compressor.hammer_identification import identify
from deboom.compressor.hoses import hose_matrices
from deboom.compressor.identified_compressor import Identification, IdentifyOptions
from deboom.compressor.model import CompressorModel
from deboom.compressor.parameter_information import propagated
from deboom.compressor.sources import case_name, source_loads
from deboom.compressor.unbalance_load import gyroscopic_mass
from deboom.errors import InputError
from deboom.explore.moments import Limit, Objective
from deboom.explore.space import DesignSpace
from deboom.measurement.electric_car import ElectricCar
from deboom.physics.rigid_body import forward_matrices

PIECE = " piece"
"""End of the name of a variable that scatters from piece to piece of one part number."""
REFERENCE = 40.0
"""Line at which dynamic stiffness is stated, where the band has it [Hz]."""


class ExactFleet(Protocol):
    """What a virtual laboratory knows exactly of the cars that it measured."""

    def levels(
        self, factors: RealArray, frequency: RealArray, pressure: float, *, with_hoses: bool
    ) -> RealArray:
        """Return the exact coupled level for other mounts, shape (n, v, f) [dB(A)].

        - `factors` (n, 3 m): on the true stiffness of every mount [1].
        - `frequency` (f,): [Hz]; `pressure`: of the gas, one that the bench runs at [bar].
        """


@dataclass(frozen=True, eq=False)
class CompressorFleet:
    """Cars whose bodies were struck; in the first one the compressor was struck and run.

    `inputs`: every file that was read; `truth` is None where cars were measured.
    """

    cars: tuple[ElectricCar, ...]
    inputs: tuple[Path, ...]
    truth: ExactFleet | None = None


@dataclass(frozen=True, eq=False)
class MountedFleet:
    """The noise of a fleet as a function of the compressor's mounts, ready to be explored.

    - `identified`, `running`: the compressor's hammer test; its source, mounts and hoses.
    - `index`: level at the ear; `statics`: travel and modes, with the stiffness of the lowest line.
    """

    fleet: CompressorFleet
    identified: Identification
    running: RunningInCar
    index: CabinIndex
    statics: MountStatics

    @property
    def reference_line(self) -> float:
        """Where dynamic stiffness is stated [Hz]."""
        lines = self.index.frequency
        return float(lines[np.argmin(np.abs(lines - REFERENCE))])

    @property
    def stiffness_at_reference(self) -> RealArray:
        """|K| of every mount there at factor 1, axial and two radial, shape (m, 3) [N/m]."""
        gain = abs(self.index.gain[list(self.index.frequency).index(self.reference_line)])
        return np.array([gain * mount.stiffness for mount in self.index.mounts])

    def deviation_at_reference(self, weights: RealArray) -> float:
        """Return 1 σ of a mean |K| there over it, of hammer test and drawing of the mounts [1].

        - `weights` (m, 3): share of each stiffness in the mean, their sum 1 [1].
        """
        line = np.array([self.reference_line])

        def gain(model: CompressorModel) -> RealArray:
            return np.asarray(np.abs(model.gain.at(line)))

        calibrated = self.identified.calibrated
        of_gain = np.sqrt(propagated(calibrated, gain)[0, 0]) / gain(calibrated.model)[0]
        return float(np.hypot(of_gain, self.running.shares.deviation_of_mean(weights)))

    @property
    def amplitude_at_reference(self) -> RealArray:
        """Peak amplitude of every mount there along its axes, shape (m, 3) [m].

        Of its side at the compressor, in the sweep of the first pressure that counts; that of the
        body is small beside it.
        """
        source, first = self.running.source, self.index.case_names[0]
        pressures = {sweep.name: case_name(sweep.pressure) for sweep in source.test.sweeps}
        motion = next(each.motion for each in source.motions if pressures[each.sweep] == first)
        row = int(np.argmin(np.abs(motion.frequency - self.reference_line)))
        mounts = self.index.mounts
        positions = np.array([mount.position for mount in mounts])
        moved = forward_matrices(positions) @ motion.values[row].ravel()
        moved = moved.reshape(-1, 3) / (2.0 * np.pi * motion.frequency[row]) ** 2
        turn = np.array([mount.orientation for mount in mounts])
        return np.asarray(np.abs(np.einsum("mji,mj->mi", turn, moved)))

    @property
    def alarms(self) -> tuple[str, ...]:
        """What a reader must know of the data."""
        alarms = (*self.identified.alarms, *self.running.alarms)
        if self.fleet.cars[0].operation.rotor_inertia is None:
            left_out = "The rotor's inertia is not stated: its gyroscopic moment is left out."
            alarms = (*alarms, left_out)
        return alarms

    @property
    def assumed(self) -> tuple[str, ...]:
        """Which tolerances of the tests are defaults, in words."""
        return tuple(sentence for car in self.fleet.cars for sentence in car.assumed)


def mounted_fleet(
    fleet: CompressorFleet,
    lines: RealArray,
    weights: Mapping[str, float],
    step: Callable[[str], None],
    *,
    identical: bool,
    with_hoses: bool,
    places: bool,
) -> MountedFleet:
    """Identify the compressor, its source and its mounts, and join it to every car.

    - `lines` (f,): lines that count [Hz].
    - `weights`: of each pressure, such as ``7.5 bar`` → 1; empty for all of them alike.
    - `step`: told what is being done.
    - `identical`: one part number for all mounts; `with_hoses`: the first car's standard hoses;
      `places`: where the mounts stand varies, too.
    - raises InputError: a pressure or lines that were not measured, no drawing of the mounts; see
      also `identify` and `running_in_car`.
    """
    first = fleet.cars[0]
    test = first.operation
    ran = dict.fromkeys(case_name(sweep.pressure) for sweep in test.sweeps)
    unknown = [name for name in weights if name not in ran]
    if unknown:
        raise InputError(f"no sweep at {unknown[0]} was measured, only at {', '.join(ran)}")
    step("identification of the compressor")
    identified = identify(test.hammer, IdentifyOptions(), hoses=test.hoses)
    running = running_in_car(first, identified, with_hoses=with_hoses, step=step)
    step("seams")
    loads = source_loads(running.source.chosen.sources, lines)
    weights = weights or dict.fromkeys(loads, 1.0)
    model, mounts = identified.calibrated.model, running.shares.mounts
    wanted = {name: loads[name] for name in weights}
    mass = model.mass_matrix + gyroscopic_mass(test.rotor_inertia, running.source.sense.sense)
    hoses = () if running.hoses is None else running.hoses.hoses
    beams = hose_matrices(hoses, lines) if hoses else None
    names = [hose.name for hose in hoses]
    bodies = [measured_body(car, mounts, lines, names) for car in fleet.cars]
    positions = np.array([mount.position for mount in mounts])
    variables = mount_variables(mounts, identical=identical, pieces=identical, places=places)
    gain = model.gain.at(lines) * (1 + running.source.state.significant(lines))
    seams = tuple(car_seam(mass, wanted, positions, body, beams) for body in bodies)
    index = CabinIndex(variables, mounts, gain, seams, tuple(weights.values()))
    statics = MountStatics(
        variables, mounts, float(gain[0].real), model.mass, model.centre, model.mass_matrix
    )
    return MountedFleet(fleet, identified, running, index, statics)


def mount_space(
    variables: MountVariables,
    *,
    reach: float,
    tolerance: float,
    batch: float,
    place_tolerance: float,
) -> DesignSpace:
    """Return the design space: what is no stiffness of a part number is fixed and scatters.

    - `reach`: stiffness factors run within ``1 ± reach`` [1].
    - `tolerance`, `batch`: half width of a piece's stiffness, three standard deviations, and the
      share of its batch in that variance where pieces of one part number vary [1].
    - `place_tolerance`: half width of coordinates, where they vary [mm].
    """
    rows = []
    pieces = any(name.endswith(PIECE) for name in variables.names)
    for name, moved in zip(variables.names, variables.moved, strict=True):
        if moved.any():
            rows.append((DATUM, DATUM, DATUM, place_tolerance / DATUM))
        elif name.endswith(PIECE):
            rows.append((1.0, 1.0, 1.0, tolerance * np.sqrt(1 - batch)))
        else:
            width = tolerance * (np.sqrt(batch) if pieces else 1.0)
            rows.append((1.0, 1 - reach, 1 + reach, width))
    return DesignSpace(variables.names, variables.units, *np.array(rows).T)


def travel_limit(model: MountedFleet, space: DesignSpace, most: float) -> Limit:
    """Limit the largest travel of a mount under 1 g to `most` times today's [1]."""
    allowed = most * float(model.statics(space.nominal[None])[0, 0])
    travel = Objective("nominal", response=model.statics)
    return Limit(travel, at_most=allowed, source=f"--travel {most:g}")


def exact_change(model: MountedFleet, today: RealArray, design: RealArray) -> RealArray | None:
    """Return what a design (k,) truly changes against today's (k,), shape (v,) [dB].

    Of the mean level of the lines, weighted over the cases; None for cars that were measured.
    """
    total = np.zeros(len(model.index.response_names))
    for case, weight in zip(model.index.case_names, model.index.weights, strict=True):
        levels = exact_levels(model, np.stack([today, design]), case)
        if levels is None:
            return None
        total += weight * (levels[1] - levels[0]).mean(axis=-1)
    return total


def exact_levels(model: MountedFleet, designs: RealArray, case: str) -> RealArray | None:
    """Return levels of the bench's coupled cars, shape (n, v, f) [dB(A)]; None without truth."""
    if model.fleet.truth is None:
        return None
    pressure = float(case.removesuffix(" bar"))
    factors = model.index.variables.factors(designs)
    hoses = model.running.hoses is not None
    return model.fleet.truth.levels(factors, model.index.frequency, pressure, with_hoses=hoses)
