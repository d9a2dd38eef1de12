"""Synthesised against measured sound in every driven vehicle, and what the forces come from."""

from __future__ import annotations

from dataclasses import dataclass

from deboom.arrays import ComplexArray
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.load_case import LoadCase
from deboom.measurement.measured_vehicle import MeasuredVehicle, Method, path_noise_transfer
from deboom.measurement.vehicle_paths import piece_paths, summed_over_pieces
from deboom.mounts.surface_forces import Outside, SurfaceForces, surface_forces
from deboom.study.synthesis_validation_bench import BenchSet
from deboom.study.synthesis_validation_data import DrivenVehicle, ValidationData
from deboom.vehicles.fleet import Band
from deboom.vehicles.path_analysis import PathAnalysis, analyse_paths
from deboom.vehicles.pressure_comparison import PressureComparison, compare_pressure


@dataclass(frozen=True, eq=False)
class Listening:
    """Where and within which lines everything is compared.

    Parameters
    ----------
    ear : str
        Of the vehicles.
    band : (lower, upper)
        Both edges belong to the band [Hz].
    """

    ear: str
    band: Band


@dataclass(frozen=True, eq=False)
class Synthesis:
    """One vehicle with one mount set: three ways to its sound, beside what its microphone heard.

    Parameters
    ----------
    driven : DrivenVehicle
        Vehicle and mount set.
    measured : array, shape (n_frequency,)
        Pressure at the ear on the road [Pa].
    reciprocal, hammer : PathAnalysis
        Measured bench forces times the noise transfer functions of either method.
    surfaces : PathAnalysis
        Bench forces from the response surfaces of the mounts, reciprocal functions.
    on_road, by_hammer, by_surfaces : PressureComparison
        Synthesis against the road; hammer against reciprocal functions; forces from surfaces
        against measured ones. The latter two within the synthesis.
    """

    driven: DrivenVehicle
    measured: ComplexArray
    reciprocal: PathAnalysis
    hammer: PathAnalysis
    surfaces: PathAnalysis
    on_road: PressureComparison
    by_hammer: PressureComparison
    by_surfaces: PressureComparison


def syntheses(data: ValidationData, listening: Listening) -> tuple[Synthesis, ...]:
    """Synthesise the sound of every driven vehicle from the bench forces of its mounts.

    Parameters
    ----------
    data : ValidationData
    listening : Listening

    Raises
    ------
    InputError
        An ear that a vehicle does not have; lines or paths of bench and vehicle that differ.
    """
    modelled = {name: surface_load_case(one, one.load_case) for name, one in data.sets.items()}
    return tuple(
        _synthesis(
            driven, data.run, data.sets[driven.mount_set], modelled[driven.mount_set], listening
        )
        for driven in data.driven
    )


def surface_load_case(mounts: BenchSet, load_case: LoadCase) -> SurfaceForces:
    """Exchange measured forces for those of surfaces; lines that none speaks of stay measured."""
    return surface_forces(load_case, mounts.mounts, Outside.KEEP_MEASURED)


def paths_of(vehicle: MeasuredVehicle, force: Spectrum, transfer: Frf) -> PathAnalysis:
    """Return the contributions of bench forces per piece through functions per path."""
    return analyse_paths(transfer, summed_over_pieces(force, piece_paths(vehicle.mounts)))


def _synthesis(
    driven: DrivenVehicle,
    run_name: str,
    mounts: BenchSet,
    modelled: SurfaceForces,
    listening: Listening,
) -> Synthesis:
    vehicle = driven.vehicle
    run = vehicle.run(run_name)
    measured = run.pressure.select([listening.ear]).values[:, 0]
    by_method = {method: path_noise_transfer(vehicle, method, listening.ear) for method in Method}
    force = mounts.load_case.force
    reciprocal = paths_of(vehicle, force, by_method[Method.RECIPROCAL])
    hammer = paths_of(vehicle, force, by_method[Method.DIRECT])
    surfaces = paths_of(vehicle, modelled.load_case.force, by_method[Method.RECIPROCAL])
    lines = run.pressure.frequency

    def beside(reference: ComplexArray, other: ComplexArray) -> PressureComparison:
        return compare_pressure(lines, run.order, reference, other, listening.band)

    return Synthesis(
        driven=driven,
        measured=measured,
        reciprocal=reciprocal,
        hammer=hammer,
        surfaces=surfaces,
        on_road=beside(measured, reciprocal.pressure),
        by_hammer=beside(reciprocal.pressure, hammer.pressure),
        by_surfaces=beside(reciprocal.pressure, surfaces.pressure),
    )
