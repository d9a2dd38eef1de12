"""A virtual design of parts that were characterised apart, three ways, against its measurement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from deboom.errors import InputError
from deboom.measurement.campaign import Campaign
from deboom.measurement.measured_vehicle import MeasuredVehicle, Method, path_noise_transfer
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.study.synthesis_validation import Listening, paths_of, surface_load_case
from deboom.study.synthesis_validation_bench import BenchSet
from deboom.study.synthesis_validation_data import ValidationData
from deboom.vehicles.amplitude_identification import identified_surfaces
from deboom.vehicles.coupled_identification import coupled_motion
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.powertrain import Powertrain
from deboom.vehicles.pressure_comparison import PressureComparison, compare_pressure
from deboom.vehicles.resolved_design import ResolvedDesign, resolve_design


class DesignMotion(Enum):
    """Which motion the surfaces of a virtual design are given."""

    OF_THE_MIX = "motion of the mix"
    """As measured with the design itself on the bench: the thesis; nearly circular."""
    OF_ANOTHER_SET = "motion of another set"
    """As measured with other mounts."""
    RESOLVED = "motion re-solved"
    """From the excitation that another set's run shows, and the surfaces alone."""


@dataclass(frozen=True, eq=False)
class VirtualDesign:
    """One mix of parts in every vehicle.

    Parameters
    ----------
    mix, other : str
        Mount sets: the design, and the one whose motion or excitation is taken.
    comparisons : dict of (str, DesignMotion) to PressureComparison
        By vehicle and motion: from the design's surfaces against its measured forces.
    resolved : ResolvedDesign
        The motion that was solved.
    kept : tuple of str
        Channels of the design that keep a measured force, with the reason.
    """

    mix: str
    other: str
    comparisons: dict[tuple[str, DesignMotion], PressureComparison]
    resolved: ResolvedDesign
    kept: tuple[str, ...]

    @property
    def peak_deviation(self) -> float:
        """Largest one of all ways and vehicles; nan without a pair of peaks [dB]."""
        found = [one.peak_deviation for one in self.comparisons.values()]
        return max((value for value in found if np.isfinite(value)), default=float("nan"))


def virtual_design(data: ValidationData, listening: Listening) -> VirtualDesign | None:
    """Predict the first mix of a campaign from parts that were characterised in other sets.

    Parameters
    ----------
    data : ValidationData
    listening : Listening

    Returns
    -------
    VirtualDesign or None
        None without a mix, or without a set that is none of its own.

    Raises
    ------
    InputError
        A mount that does not say what it carries; see `deboom.vehicles.coupled_identification`.
    """
    mixes = data.mixes
    plain = [name for name in data.sets if name not in mixes]
    if not mixes or not plain:
        return None
    mix, parts = next(iter(mixes.items()))
    apart = [name for name in plain if name not in parts.values()]
    other = data.sets[(apart or plain)[-1]]
    design = _of_parts(mix, parts, data)
    measured = data.sets[mix].load_case
    with_mix = surface_load_case(design, measured)
    with_other = surface_load_case(design, other.load_case)

    fleet = Fleet(tuple(_listener(driven.vehicle, listening.ear) for driven in data.vehicles))
    reference = coupled_motion(
        fleet,
        _with_bodies(data.vehicles[0].vehicle),
        _powertrain(data.campaign),
        other.load_case,
        listening.band,
    )
    inside = np.isin(other.load_case.force.frequency, reference.frequency)
    resolved = resolve_design(
        reference, identified_surfaces(design.mounts), other.load_case.wheel_torque[inside]
    )
    comparisons = {}
    for driven, solved in zip(data.vehicles, resolved.pressure, strict=True):
        vehicle = driven.vehicle
        transfer = path_noise_transfer(vehicle, Method.RECIPROCAL, listening.ear)
        true = paths_of(vehicle, measured.force, transfer).pressure
        whole = np.zeros_like(true)
        whole[inside] = solved
        ways = {
            DesignMotion.OF_THE_MIX: paths_of(vehicle, with_mix.load_case.force, transfer).pressure,
            DesignMotion.OF_ANOTHER_SET: paths_of(
                vehicle, with_other.load_case.force, transfer
            ).pressure,
            DesignMotion.RESOLVED: whole,
        }
        for way, pressure in ways.items():
            comparisons[vehicle.name, way] = compare_pressure(
                measured.force.frequency, measured.order, true, pressure, listening.band
            )
    kept = tuple(f"{name} ({why})" for name, why in with_mix.measured.items())
    return VirtualDesign(mix, other.name, comparisons, resolved, kept)


def _of_parts(mix: str, parts: Mapping[str, str], data: ValidationData) -> BenchSet:
    """Put the surfaces of parts from several sets together."""
    mounts: list[CharacterisedMount] = []
    for mount, of_set in parts.items():
        found = [one for one in data.sets[of_set].mounts if one.mount.name == mount]
        if not found:
            raise InputError(f"mount set {of_set} has no mount '{mount}', which {mix} asks for")
        mounts += found
    return BenchSet(mix, data.sets[mix].load_case, tuple(mounts))


def _listener(vehicle: MeasuredVehicle, ear: str) -> Vehicle:
    transfer = path_noise_transfer(vehicle, Method.RECIPROCAL, ear)
    return Vehicle(vehicle.name, vehicle.group, transfer)


def _with_bodies(vehicle: MeasuredVehicle) -> tuple[Mount, ...]:
    """Mounts with the mass of what each carries, which a vehicle's file states."""
    mounts = [mount for mount in vehicle.mounts if isinstance(mount, Mount)]
    if len(mounts) < len(vehicle.mounts):
        raise InputError(f"vehicle {vehicle.name}: its mounts do not say what they carry")
    return tuple(mounts)


def _powertrain(campaign: Campaign) -> Powertrain:
    matrix = campaign.mass_matrix
    return Powertrain(mass=float(matrix[0, 0]), inertia=matrix[3:, 3:])
