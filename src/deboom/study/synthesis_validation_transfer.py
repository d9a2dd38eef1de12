"""Transfer path analysis on the road: what blocked forces cost, and what transfer functions do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.measured_vehicle import Method, point_noise_transfer
from deboom.measurement.on_board_validation import OnBoardValidation, validate_on_board
from deboom.measurement.path_forces import PathForces, forces_by_inversion
from deboom.measurement.vehicle_paths import path_accelerance
from deboom.study.synthesis_validation import Listening, Synthesis
from deboom.study.synthesis_validation_data import ValidationData
from deboom.study.synthesis_validation_truth import VehicleTruth
from deboom.vehicles.path_analysis import analyse_paths
from deboom.vehicles.pressure_comparison import PressureComparison, compare_pressure

HELD_OUT = 2
"""Of the accelerometers around a mount the one with this place judges the others' forces."""

EVERYTHING = "bench forces, measured functions, against the microphone"
INVERSION = "forces by inversion on the road, measured functions, against the microphone"
BLOCKED = "bench forces, true functions, against the sound through the mounts"
FUNCTIONS = "true forces, measured functions, against the sound through the mounts"
OTHER_PATHS = "true sound through the mounts, against the microphone"


@dataclass(frozen=True, eq=False)
class RoadAnalysis:
    """Forces of one driven vehicle found by inversion, and where a synthesis loses its accuracy.

    Parameters
    ----------
    synthesis : Synthesis
        Of the same vehicle and mount set.
    forces : PathForces
        Classical: from accelerations on the body and its accelerances without powertrain. They are
        exact with the noise transfer functions of that body; bench forces are blocked ones.
    on_board : OnBoardValidation
        Accelerometers that were kept out of the inversion.
    causes : dict of str to PressureComparison
        What is compared; those that need the truth are missing where nobody knows it.
    force_error, blocked_error : float
        Rms deviation of forces by inversion, and of bench forces, from the true interface forces
        relative to their rms, within the band; nan where nobody knows these [1].
    """

    synthesis: Synthesis
    forces: PathForces
    on_board: OnBoardValidation
    causes: dict[str, PressureComparison]
    force_error: float
    blocked_error: float

    @property
    def largest_condition(self) -> float:
        """Of the inverted accelerances, columns scaled, over the lines; nan without inversion."""
        found = self.forces.inversion
        return float("nan") if found is None else float(found.condition_number.max())


def road_analyses(
    data: ValidationData, done: tuple[Synthesis, ...], listening: Listening
) -> tuple[RoadAnalysis, ...]:
    """Analyse every driven vehicle whose accelerometers were recorded under the hammer.

    Parameters
    ----------
    data : ValidationData
    done : tuple of Synthesis
        Of these data.
    listening : Listening

    Raises
    ------
    InputError
        Fewer than three accelerometers at a mount; see `deboom.measurement.path_forces`.
    """
    struck = [one for one in done if one.driven.vehicle.accelerance is not None]
    return tuple(_analysis(data, one, listening) for one in struck)


def _analysis(data: ValidationData, synthesis: Synthesis, listening: Listening) -> RoadAnalysis:
    vehicle, truth = synthesis.driven.vehicle, synthesis.driven.truth
    run = vehicle.run(data.run)
    accelerance = path_accelerance(vehicle)
    kept_out = [
        name
        for sensors in vehicle.body_sensors.values()
        for sensor in sensors[HELD_OUT : HELD_OUT + 1]
        for name in sensor.channels
    ]
    used = [name for name in accelerance.outputs if name not in kept_out]
    forces = forces_by_inversion(accelerance.select(outputs=used), run.acceleration)
    on_board = validate_on_board(accelerance.select(outputs=kept_out), forces, run.acceleration)

    points = point_noise_transfer(vehicle, Method.RECIPROCAL).select(outputs=[listening.ear])
    blocked = data.sets[synthesis.driven.mount_set].load_case.force
    lines = run.pressure.frequency

    def beside(reference: ComplexArray, other: ComplexArray) -> PressureComparison:
        return compare_pressure(lines, run.order, reference, other, listening.band)

    def heard(transfer: Frf, force: Spectrum) -> ComplexArray:
        return analyse_paths(transfer.select(inputs=force.channels), force).pressure

    causes = {
        EVERYTHING: synthesis.on_road,
        INVERSION: beside(synthesis.measured, heard(points, forces.force)),
    }
    force_error = blocked_error = float("nan")
    if truth is not None:
        exact = truth.noise_transfer.select(outputs=[listening.ear])
        through = truth.pressure.select([listening.ear]).values[:, 0]
        own = truth.force.select(forces.force.channels)
        causes |= {
            BLOCKED: beside(through, heard(exact, blocked.select(own.channels))),
            FUNCTIONS: beside(through, heard(points, own)),
            OTHER_PATHS: beside(synthesis.measured, through),
        }
        force_error = _deviation(forces.force, truth, listening)
        blocked_error = _deviation(blocked.select(own.channels), truth, listening)
    return RoadAnalysis(synthesis, forces, on_board, causes, force_error, blocked_error)


def _deviation(force: Spectrum, truth: VehicleTruth, listening: Listening) -> float:
    inside = (force.frequency >= listening.band[0]) & (force.frequency <= listening.band[1])
    true = truth.force.select(force.channels).values[inside]
    found = force.values[inside]
    return float(np.linalg.norm(found - true) / np.linalg.norm(true))
