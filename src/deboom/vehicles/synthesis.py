"""Sound synthesised from bench forces, and each step of it compared with measurements.

Thesis, 3.6 and 3.7: blocked forces of the mounts on the bench times the noise transfer functions of
the trimmed body. Where the body's accelerances were measured, blocked forces become the interface
forces of powertrain and body together, and the car says what the bench cannot: how strong the
loudspeaker was, and how stiff its mounts are on the road. Then the same with forces from response
surfaces, a design of parts that were characterised apart, and interface forces that accelerations
on the road give by inversion.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.body_modes import BodyModes, body_modes
from deboom.measurement.booming_peaks import BoomingPeak, PressureComparison, compare_pressure
from deboom.measurement.campaign import Campaign, OperatingRun
from deboom.measurement.channels import Band, Frf, LoadCase, Spectrum
from deboom.measurement.measured_vehicle import (
    MeasuredVehicle,
    Method,
    path_accelerance,
    path_noise_transfer,
    path_receptance,
    piece_paths,
    point_noise_transfer,
    summed_over_pieces,
)
from deboom.measurement.path_forces import PathForces, forces_by_inversion, validate_on_board
from deboom.measurement.uncertainty import LevelSpread, level_spread
from deboom.mounts.characterise import characterise, measuring_chains
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.mounts.operating_map import bench_load_case
from deboom.mounts.surface_forces import Outside, SurfaceForces, identified_surfaces, surface_forces
from deboom.vehicles.amplitude_motion import ResolvedDesign, resolve_design
from deboom.vehicles.coupled_motion import CoupledMotion, coupled_motion, spring_shares
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.path_analysis import PathAnalysis, analyse_paths
from deboom.vehicles.powertrain import Powertrain

MOUNTS_ALIKE, MOUNTS_APART = 0.3, 0.05
"""Standard deviation of the logarithm of the stiffness that mounts have in a car over that on a
bench: of all together, by temperature and age, and of each besides [1]."""
INDEPENDENT_LINES = 15
"""What the lines of a band count for [1]: errors of an inversion are alike in neighbouring ones."""
LARGEST_REST = 2.0
"""Rms of what mounts that are softer or harder leave of forces by inversion, over the error of the
inversion, up to which their factors are believed [1]."""

COMPLEX_90 = float(np.sqrt(np.log(10)))
"""Distance that holds 90 % of a complex normal deviation, over its standard deviation [1]."""

HELD_OUT = 2
"""Of the accelerometers around a mount the one with this place, from 0, judges the forces."""

EVERYTHING = "bench forces, measured functions, against the microphone"
INVERSION = "forces by inversion on the road, measured functions, against the microphone"
BLOCKED = "bench forces, true functions, against the sound through the mounts"
FUNCTIONS = "true forces, measured functions, against the sound through the mounts"
OTHER_PATHS = "true sound through the mounts, against the microphone"

ON_ROAD = "synthesised against measured"
ON_ROAD_AS_TESTED = "synthesised without what the car says against measured"
ON_ROAD_BLOCKED = "synthesised from blocked forces against measured"
BY_SURFACES = "forces from surfaces against measured forces"
BY_HAMMER = "hammer against reciprocal functions"
DESIGN = "virtual design, "

CORR_F, CORR_S = "corr_f complex [%]", "corr_s magnitude [%]"
PEAK = "largest peak deviation [dB]"
PEAK_COLUMNS = (
    "comparison",
    "vehicle",
    "mount set",
    "engine speed [rpm]",
    "reference at [Hz]",
    "compared at [Hz]",
    "reference [dB(A)]",
    "compared [dB(A)]",
    "deviation [dB]",
)

_PART_OF_SET = re.compile(r"([A-Za-z]+)(\d+)")


@dataclass(frozen=True)
class Listening:
    """Where pressures are compared, and in which lines, both edges of the band included [Hz]."""

    ear: str
    band: Band


@dataclass(frozen=True, eq=False)
class BenchSet:
    """One mount set on the bench, such as ``M1``, or ``EnM1-GeM2-TSM3-Du4`` for a mix.

    `load_case` is the run that is predicted, with the bench's blocked forces; the surfaces of
    `mounts` are fitted to all other runs.
    """

    name: str
    load_case: LoadCase
    mounts: tuple[CharacterisedMount, ...]

    @cached_property
    def modelled(self) -> SurfaceForces:
        """The run with forces of the surfaces; lines that none speaks of stay measured."""
        return surface_forces(self.load_case, self.mounts, Outside.KEEP_MEASURED)


def bench_sets(
    campaign: Campaign,
    gear: int,
    torque_limit: float,
    progress: Callable[[int, int, str], None],
) -> dict[str, BenchSet]:
    """Characterise every mount set of a campaign, without the run that is to be predicted.

    That run is the full-load one with rising torque of this gear and torque limit [N m].
    ``progress(done, total, text)`` makes one step per mount set.

    Raises
    ------
    InputError
        A mount set without that run or without any other one.
    """
    predicted = {name: _run(campaign, name, gear, torque_limit) for name in campaign.mount_sets}
    left_out = [id(run) for run in predicted.values()]
    others = replace(campaign, runs=tuple(run for run in campaign.runs if id(run) not in left_out))
    progress(0, len(predicted), "measuring chains")
    chains = measuring_chains(campaign)
    sets = {}
    for place, (name, run) in enumerate(predicted.items()):
        progress(place, len(predicted), f"mount set {name}")
        mounts = characterise(others, name, chains=chains).mounts
        case = bench_load_case(campaign, run, chains, f"gear {gear}, {torque_limit:g} N m")
        sets[name] = BenchSet(name, case, mounts)
    return sets


def _run(campaign: Campaign, mount_set: str, gear: int, torque_limit: float) -> OperatingRun:
    """Return the full-load run of a mount set that is to be predicted."""
    for run in campaign.runs_of(mount_set):
        if run.full_load and run.rising and (run.gear, run.torque_limit) == (gear, torque_limit):
            return run
    raise InputError(
        f"campaign {campaign.name}, mount set {mount_set}: there is no full-load run in gear "
        f"{gear} with {torque_limit:g} N m to compare with the road: measure it, or choose another "
        "run with --load-case"
    )


@dataclass(frozen=True, eq=False)
class VehicleTruth:
    """What is exact about a virtual vehicle and its run.

    - `force`: forces of every mount on the body, channels ``<mount> [<piece>] <axis>`` [N].
    - `pressure`: pressure at the ears through the mounts alone [Pa].
    - `noise_transfer`: ears per ``<mount> [<piece>] x y z mx my mz`` [Pa/N, Pa/(N m)].
    - `natural_frequency`, `damping_ratio` (n_mode,): trimmed body on average [Hz], [1].
    - `shapes` (n_mode, n_output): translations at interfaces, panels inwards [kg^-1/2].
    """

    force: Spectrum
    pressure: Spectrum
    noise_transfer: Frf
    natural_frequency: RealArray
    damping_ratio: RealArray
    shapes: RealArray


@dataclass(frozen=True, eq=False)
class DrivenVehicle:
    """One vehicle that was driven with one mount set; the truth is None where it is unknown."""

    vehicle: MeasuredVehicle
    truth: VehicleTruth | None
    mount_set: str

    @property
    def title(self) -> str:
        """Such as ``U06-1 with M1``."""
        return f"{self.vehicle.name} with {self.mount_set}"

    @property
    def columns(self) -> dict[str, str]:
        """Vehicle and mount set as a table names them."""
        return {"vehicle": self.vehicle.name, "mount set": self.mount_set}


@dataclass(frozen=True, eq=False)
class DrivenVehicles:
    """Vehicles that were driven in one run, and the bench that their mounts were on.

    `sets` are the bench's mount sets by name, mixes included; virtual measurements leave no
    `input_files`.
    """

    campaign: Campaign
    run: str
    sets: dict[str, BenchSet]
    driven: tuple[DrivenVehicle, ...]
    input_files: tuple[Path, ...] = ()

    @property
    def powertrain(self) -> Powertrain:
        """Mass and inertia on the bench."""
        matrix = self.campaign.needed_mass_matrix("the motion of the engine in a vehicle")
        return Powertrain(mass=float(matrix[0, 0]), inertia=matrix[3:, 3:])

    @property
    def vehicles(self) -> tuple[DrivenVehicle, ...]:
        """Every vehicle once."""
        first: dict[str, DrivenVehicle] = {}
        for driven in self.driven:
            first.setdefault(driven.vehicle.name, driven)
        return tuple(first.values())

    @property
    def mixes(self) -> dict[str, dict[str, str]]:
        """Mix → mount → the set in which that part was characterised as well."""
        named = {name: parts_of(name) for name in self.sets}
        return {
            n: p for n, p in named.items() if p and all(part in self.sets for part in p.values())
        }


def parts_of(mix: str) -> dict[str, str]:
    """Return mount → set of a name like ``EnM1-GeM2``; empty for any other name."""
    units = [_PART_OF_SET.fullmatch(part) for part in mix.split("-")]
    if len(units) < 2 or None in units:
        return {}
    return {unit[1]: f"M{unit[2]}" for unit in units if unit is not None}


@dataclass(frozen=True, eq=False)
class CarFactors:
    """What a car says of the loudspeaker in it and of its mounts; the microphone takes no part.

    - `loudspeaker`: factor on the reciprocal functions of the ear, by those of the hammer [1].
    - `mounts`: stiffness of each mount in the car over that on the bench; 1 where nothing says it
      [1].
    - `rest`, `inversion_error`: rms of forces by inversion less those of mounts with these factors,
      and standard error of the inversion, over the rms of the forces; nan without an inversion [1].
    """

    loudspeaker: float
    mounts: dict[str, float]
    rest: float = float("nan")
    inversion_error: float = float("nan")

    @property
    def believed(self) -> bool:
        """Whether the factors explain the forces on the road as well as these are known."""
        return self.rest <= LARGEST_REST * self.inversion_error


@dataclass(frozen=True, eq=False)
class Synthesis:
    """One vehicle with one mount set: ways to its sound, beside what its microphone heard.

    - `measured` (n_frequency,): pressure at the ear on the road [Pa].
    - `force`: forces on the body per piece: interface forces where the body's receptance is known,
      else the bench's blocked forces [N].
    - `factors`: what the car says of loudspeaker and mounts, contained in `force` and `reciprocal`.
    - `reciprocal`, `hammer`: these forces times the transfer functions of either method.
    - `comparisons`: `ON_ROAD`, synthesis against the road, and `ON_ROAD_AS_TESTED` without the
      factors of the car; `ON_ROAD_BLOCKED` where the former has interface forces; `BY_SURFACES`,
      blocked forces from surfaces against measured ones, both within the synthesis; `BY_HAMMER`,
      with the loudspeaker as it was calibrated.
    """

    driven: DrivenVehicle
    measured: ComplexArray
    force: Spectrum
    factors: CarFactors
    reciprocal: PathAnalysis
    hammer: PathAnalysis
    comparisons: dict[str, PressureComparison]


def interface_forces(
    vehicle: MeasuredVehicle,
    bench_run: LoadCase,
    powertrain: Powertrain,
    receptance: Frf,
    factors: Mapping[str, float] | None = None,
) -> Spectrum:
    """Return the forces of the mounts on a body that gives way, from their forces on a bench.

    Parameters
    ----------
    vehicle : MeasuredVehicle
        With mounts that say what they carry.
    bench_run : LoadCase
        Motion and blocked forces on the bench, in vehicle axes.
    powertrain : Powertrain
        Mass and inertia on the bench.
    receptance : Frf
        Of the body, see `deboom.measurement.measured_vehicle.path_receptance` [m/N].
    factors : mapping, optional
        Mount → its stiffness in the car over that on the bench; 1 where it is left out [1].

    Returns
    -------
    Spectrum
        Per piece of every path, in vehicle axes [N].

    Raises
    ------
    InputError
        Mounts that do not say what they carry; see `deboom.vehicles.coupled_motion`.

    Notes
    -----
    ``g = (K⁻¹ + Y_S + Y_B)⁻¹ (K⁻¹ + Y_S) f_bl`` per line, which is
    `deboom.physics.transfer_path.force_on_moving_receiver` behind mounts: ``K⁻¹ = s/f`` with the
    rigidly fitted motion of the bench, ``Y_S = V (−ω² M)⁻¹ Vᵀ`` of the powertrain and ``−1/(ω² m)``
    of wheel ends, the body's receptance Y_B. Without `factors` a mount keeps the stiffness that it
    had on the bench: the amplitude there is nearly that in the car.
    """
    coupled = _coupled(vehicle, bench_run, powertrain, receptance)
    return coupled.force(factors or {})


@dataclass(frozen=True, eq=False)
class _Coupled:
    """Powertrain, mounts and body of one car in one run; pieces are the channels of forces."""

    motion: CoupledMotion
    shares: RealArray
    pieces: tuple[str, ...]

    @property
    def mount_of_variable(self) -> tuple[str, ...]:
        """Mount of each stiffness."""
        return tuple(name.rsplit(" ", 1)[0] for name in self.motion.variable_names)

    def force(self, factors: Mapping[str, float]) -> Spectrum:
        """Return the forces on the body for a stiffness factor per mount [N]."""
        design = np.array([[factors.get(mount, 1.0) for mount in self.mount_of_variable]])
        force = self.motion.force_in(design, 0)[0] @ self.shares
        return Spectrum(self.motion.frequency, force, self.pieces, "N")


def _coupled(
    vehicle: MeasuredVehicle, bench_run: LoadCase, powertrain: Powertrain, receptance: Frf
) -> _Coupled:
    pieces = receptance.inputs
    functions = point_noise_transfer(vehicle, Method.RECIPROCAL)
    heard = functions.select(outputs=functions.outputs[:1], inputs=list(pieces))
    listener = Vehicle(vehicle.name, vehicle.group, heard, receptance)
    lines = receptance.frequency
    band = float(lines[0]), float(lines[-1])
    mounts = _with_bodies(vehicle)
    motion = coupled_motion(Fleet((listener,)), mounts, powertrain, bench_run, band)
    return _Coupled(motion, spring_shares(mounts, list(pieces)), tuple(pieces))


def loudspeaker_factor(reciprocal: Frf, hammer: Frf, band: Band) -> float:
    """Return the real factor on reciprocal functions that brings them closest to the hammer's [1].

    ``Re⟨H_rec, H_dir⟩ / ⟨H_rec, H_rec⟩`` over all paths and the lines of the band: the strength of
    a volume source is calibrated to some tenths of a decibel, a hammer to a hundredth.
    """
    inside = (reciprocal.frequency >= band[0]) & (reciprocal.frequency <= band[1])
    by_source, by_hammer = reciprocal.values[inside], hammer.values[inside]
    return float(np.vdot(by_source, by_hammer).real / np.vdot(by_source, by_source).real)


def mount_factors(
    coupled: _Coupled, on_road: PathForces, band: Band
) -> tuple[dict[str, float], float, float]:
    """Find how stiff mounts are in the car, from forces that accelerations on its body give.

    - `on_road`: forces by inversion on the road, with their half widths.
    - returns: factor per mount over its stiffness on the bench; what is left and the error of the
      inversion, see `CarFactors` [1].

    Most probable logarithms, one of all mounts and one of each besides, with normal priors of
    `MOUNTS_ALIKE` and `MOUNTS_APART`.
    """
    assert on_road.inversion is not None
    columns = np.array([on_road.force.channels.index(piece) for piece in coupled.pieces])
    lines = coupled.motion.frequency
    inside = (lines >= band[0]) & (lines <= band[1])
    rows = np.searchsorted(on_road.force.frequency, lines[inside] - 1e-6)
    measured = on_road.force.values[np.ix_(rows, columns)]
    deviation = on_road.inversion.half_width[np.ix_(rows, columns)] / COMPLEX_90
    mounts = tuple(dict.fromkeys(coupled.mount_of_variable))
    weight = np.sqrt(INDEPENDENT_LINES / len(rows)) / deviation

    def factors(logarithms: RealArray) -> dict[str, float]:
        return dict(zip(mounts, np.exp(logarithms[0] + logarithms[1:]).tolist(), strict=True))

    def residuals(logarithms: RealArray) -> RealArray:
        rest = (coupled.force(factors(logarithms)).values[inside] - measured) * weight
        prior = [logarithms[:1] / MOUNTS_ALIKE, logarithms[1:] / MOUNTS_APART]
        return np.concatenate([rest.real.ravel(), rest.imag.ravel(), *prior])

    told = factors(least_squares(residuals, np.zeros(1 + len(mounts)), x_scale=0.1).x)
    size = np.linalg.norm(measured)
    rest = np.linalg.norm(coupled.force(told).values[inside] - measured) / size
    return told, float(rest), float(np.linalg.norm(deviation) / size)


def synthesise(
    driven: DrivenVehicle,
    run_name: str,
    bench: BenchSet,
    listening: Listening,
    powertrain: Powertrain | None = None,
    receptance: Frf | None = None,
    on_road: PathForces | None = None,
) -> Synthesis:
    """Synthesise the sound of a driven vehicle from the bench forces of its mounts.

    With the body's `receptance` and the `powertrain` from interface forces, else from blocked ones;
    with forces `on_road` by inversion from mounts as stiff as they are in the car.

    Raises
    ------
    InputError
        An ear that the vehicle does not have; lines or paths of bench and vehicle that differ; see
        `interface_forces`.
    """
    vehicle = driven.vehicle
    run = vehicle.run(run_name)
    measured = run.pressure.select([listening.ear]).values[:, 0]
    by_method = {method: path_noise_transfer(vehicle, method, listening.ear) for method in Method}
    by_loudspeaker, by_hammer = by_method[Method.RECIPROCAL], by_method[Method.DIRECT]
    strength = loudspeaker_factor(by_loudspeaker, by_hammer, listening.band)
    factors = CarFactors(strength, {})
    blocked = as_tested = force = bench.load_case.force
    if powertrain is not None and receptance is not None:
        coupled = _coupled(vehicle, bench.load_case, powertrain, receptance)
        as_tested = force = coupled.force({})
        if on_road is not None:
            factors = CarFactors(strength, *mount_factors(coupled, on_road, listening.band))
            if factors.believed:
                force = coupled.force(factors.mounts)
    calibrated = replace(by_loudspeaker, values=strength * by_loudspeaker.values)
    reciprocal = _paths(vehicle, force, calibrated)
    of_blocked = _paths(vehicle, blocked, by_loudspeaker)
    surfaces = _paths(vehicle, bench.modelled.load_case.force, by_loudspeaker)
    hammer = _paths(vehicle, force, by_hammer)
    pairs = {
        ON_ROAD: (measured, reciprocal.pressure),
        ON_ROAD_AS_TESTED: (measured, _paths(vehicle, as_tested, by_loudspeaker).pressure),
        BY_SURFACES: (of_blocked.pressure, surfaces.pressure),
        BY_HAMMER: (_paths(vehicle, force, by_loudspeaker).pressure, hammer.pressure),
    }
    if as_tested is not blocked:
        pairs[ON_ROAD_BLOCKED] = measured, of_blocked.pressure
    comparisons = {
        what: compare_pressure(run.pressure.frequency, run.order, *pair, listening.band)
        for what, pair in pairs.items()
    }
    return Synthesis(driven, measured, force, factors, reciprocal, hammer, comparisons)


def _paths(vehicle: MeasuredVehicle, force: Spectrum, transfer: Frf) -> PathAnalysis:
    """Return the contributions of bench forces per piece through functions per path."""
    return analyse_paths(transfer, summed_over_pieces(force, piece_paths(vehicle.mounts)))


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
        values = [compared.peak_deviation for compared in self.comparisons.values()]
        return max((value for value in values if np.isfinite(value)), default=float("nan"))


def predict_design(
    design: BenchSet,
    other: BenchSet,
    vehicles: tuple[MeasuredVehicle, ...],
    powertrain: Powertrain,
    listening: Listening,
) -> VirtualDesign:
    """Predict the sound of a mix of parts from the surfaces that they had in other sets.

    Parameters
    ----------
    design : BenchSet
        The mix as measured on the bench, with parts characterised in other sets.
    other : BenchSet
        Whose motion and excitation are known beside the design's.
    vehicles : tuple of MeasuredVehicle
        Vehicles of one drawing, each once.
    powertrain : Powertrain
        On the bench.
    listening : Listening
        Ear and band.

    Raises
    ------
    InputError
        A mount that does not say what it carries; see `deboom.vehicles.coupled_motion`.
    """
    measured = design.load_case
    with_other = surface_forces(other.load_case, design.mounts, Outside.KEEP_MEASURED)
    transfers = [path_noise_transfer(alike, Method.RECIPROCAL, listening.ear) for alike in vehicles]
    listeners = [Vehicle(v.name, v.group, t) for v, t in zip(vehicles, transfers, strict=True)]
    reference = coupled_motion(
        Fleet(tuple(listeners)),
        _with_bodies(vehicles[0]),
        powertrain,
        other.load_case,
        listening.band,
    )
    inside = np.isin(other.load_case.force.frequency, reference.frequency)
    resolved = resolve_design(
        reference, identified_surfaces(design.mounts), other.load_case.wheel_torque[inside]
    )
    comparisons = {}
    for vehicle, transfer, solved in zip(vehicles, transfers, resolved.pressure, strict=True):
        true = _paths(vehicle, measured.force, transfer).pressure
        whole = np.zeros_like(true)
        whole[inside] = solved
        forces = {
            DesignMotion.OF_THE_MIX: design.modelled.load_case.force,
            DesignMotion.OF_ANOTHER_SET: with_other.load_case.force,
        }
        ways = {way: _paths(vehicle, force, transfer).pressure for way, force in forces.items()}
        for way, pressure in (ways | {DesignMotion.RESOLVED: whole}).items():
            comparisons[vehicle.name, way] = compare_pressure(
                measured.force.frequency, measured.order, true, pressure, listening.band
            )
    kept = tuple(f"{name} ({why})" for name, why in design.modelled.measured.items())
    return VirtualDesign(design.name, other.name, comparisons, resolved, kept)


def _with_bodies(vehicle: MeasuredVehicle) -> tuple[Mount, ...]:
    """Return the mounts with the mass of what each carries, which a vehicle's file states."""
    mounts = [mount for mount in vehicle.mounts if isinstance(mount, Mount)]
    if len(mounts) < len(vehicle.mounts):
        raise InputError(f"vehicle {vehicle.name}: its mounts do not say what they carry")
    return tuple(mounts)


@dataclass(frozen=True, eq=False)
class RoadAnalysis:
    """Forces of one driven vehicle found by inversion, and where a synthesis loses its accuracy.

    The forces are found from accelerations on the body and its accelerances without powertrain, and
    are exact with the noise transfer functions of that body. Bench forces are blocked forces.

    - `causes`: comparisons by name; those that need the truth are missing where it is unknown.
    - `errors`: columns of `force_table`. Rms deviations from the true interface forces over their
      rms, within the band, are nan where these are unknown.
    """

    synthesis: Synthesis
    causes: dict[str, PressureComparison]
    errors: dict[str, float]


def road_forces(
    vehicle: MeasuredVehicle, run_name: str, accelerance: Frf
) -> tuple[PathForces, RealArray]:
    """Return forces by inversion on the road, and the error of the sensors that judge them.

    - `accelerance`: `path_accelerance` of the same car, under the hammer once for all mount sets.
    - returns: the forces, and the error (n_frequency,) of accelerations which took no part, nan
      without any [1].
    - raises InputError: accelerometers that the hammer test lacks, or too few; see
      `deboom.measurement.path_forces`.
    """
    run = vehicle.run(run_name)
    kept_out = [
        name
        for sensors in vehicle.body_sensors.values()
        for sensor in sensors[HELD_OUT : HELD_OUT + 1]
        for name in sensor.channels
    ]
    used = [name for name in accelerance.outputs if name not in kept_out]
    forces = forces_by_inversion(accelerance.select(outputs=used), run.acceleration)
    if not kept_out:
        return forces, np.full(run.pressure.frequency.size, np.nan)
    on_board = validate_on_board(accelerance.select(outputs=kept_out), forces, run.acceleration)
    return forces, on_board.error_by_line


def analyse_road(
    synthesis: Synthesis,
    run_name: str,
    bench: BenchSet,
    listening: Listening,
    forces: PathForces,
    held_out_error: RealArray,
) -> RoadAnalysis:
    """Analyse a driven vehicle whose accelerometers were recorded under the hammer.

    - `forces`, `held_out_error`: from `road_forces`.
    """
    vehicle, truth = synthesis.driven.vehicle, synthesis.driven.truth
    run = vehicle.run(run_name)
    points = point_noise_transfer(vehicle, Method.RECIPROCAL).select(outputs=[listening.ear])
    points = replace(points, values=synthesis.factors.loudspeaker * points.values)
    lines, band = run.pressure.frequency, listening.band

    def heard(transfer: Frf, force: Spectrum) -> ComplexArray:
        return analyse_paths(transfer.select(inputs=force.channels), force).pressure

    pairs = {INVERSION: (synthesis.measured, heard(points, forces.force))}
    force_error = blocked_error = interface_error = condition = float("nan")
    if truth is not None:
        exact = truth.noise_transfer.select(outputs=[listening.ear])
        through = truth.pressure.select([listening.ear]).values[:, 0]
        true_force = truth.force.select(forces.force.channels)
        blocked = bench.load_case.force.select(true_force.channels)
        pairs |= {
            BLOCKED: (through, heard(exact, blocked)),
            FUNCTIONS: (through, heard(points, true_force)),
            OTHER_PATHS: (synthesis.measured, through),
        }
        force_error = _deviation(forces.force, true_force, band)
        blocked_error = _deviation(blocked, true_force, band)
        synthesised = synthesis.force.select(true_force.channels)
        interface_error = _deviation(synthesised, true_force, band)
    if forces.inversion is not None:
        condition = float(forces.inversion.condition_number.max())
    causes = {what: compare_pressure(lines, run.order, *pair, band) for what, pair in pairs.items()}
    errors = {
        "forces by inversion, rms error [%]": 100 * force_error,
        "bench forces, rms error [%]": 100 * blocked_error,
        "interface forces, rms error [%]": 100 * interface_error,
        "largest condition number [1]": condition,
        "held-out accelerometers, median error [%]": 100 * float(np.median(held_out_error)),
    }
    return RoadAnalysis(synthesis, {EVERYTHING: synthesis.comparisons[ON_ROAD]} | causes, errors)


def _deviation(force: Spectrum, true_force: Spectrum, band: Band) -> float:
    """Return the rms deviation from the true force over its rms, within a band [1]."""
    inside = (force.frequency >= band[0]) & (force.frequency <= band[1])
    true = true_force.values[inside]
    return float(np.linalg.norm(force.values[inside] - true) / np.linalg.norm(true))


@dataclass(frozen=True, eq=False)
class Validation:
    """Everything that was compared.

    Parameters
    ----------
    data : DrivenVehicles
        What was measured.
    listening : Listening
        Ear and band.
    syntheses : tuple of Synthesis
        One per driven vehicle and mount set.
    design : VirtualDesign or None
        None for a campaign without a mix.
    roads : tuple of RoadAnalysis
        Vehicles whose accelerometers were recorded under the hammer.
    shown : tuple of Synthesis
        Every vehicle once, with the mount set that figures show: one of `roads` if there is any.
    modes : BodyModes or None
        Modes of the first vehicle's body.
    complaint : str
        Why there is no modal analysis; empty where there is one.
    """

    data: DrivenVehicles
    listening: Listening
    syntheses: tuple[Synthesis, ...]
    design: VirtualDesign | None
    roads: tuple[RoadAnalysis, ...]
    shown: tuple[Synthesis, ...]
    modes: BodyModes | None
    complaint: str

    @property
    def vehicles(self) -> list[str]:
        """Name of every vehicle."""
        return [synthesis.driven.vehicle.name for synthesis in self.shown]

    @cached_property
    def spread(self) -> LevelSpread | None:
        """Of the measured levels of vehicles with the first mount set; None for a single one."""
        levels = list(self.measured_levels.values())
        return level_spread(levels) if len(levels) > 1 else None

    @cached_property
    def spread_without(self) -> tuple[str, LevelSpread] | None:
        """The vehicle without which the median line spreads least; None for fewer than three."""
        levels = self.measured_levels
        if len(levels) < 3:
            return None
        others = {
            name: level_spread([levels[other] for other in levels if other != name])
            for name in levels
        }
        return min(others.items(), key=lambda item: item[1].quantile(0.5))

    @property
    def measured_levels(self) -> dict[str, RealArray]:
        """Measured levels [dB(A)] of the vehicles with the first mount set, by the name."""
        first = self.syntheses[0].driven.mount_set
        return {
            synthesis.driven.vehicle.name: synthesis.comparisons[ON_ROAD].levels[0]
            for synthesis in self.syntheses
            if synthesis.driven.mount_set == first
        }

    @property
    def true_shapes(self) -> RealArray | None:
        """Of the first vehicle, columns as the outputs of its modes; None where unknown."""
        truth = self.shown[0].driven.truth
        if self.modes is None or truth is None:
            return None
        return truth.shapes[:, : len(self.modes.model.outputs)]

    @property
    def comparisons(self) -> list[tuple[dict[str, str], PressureComparison]]:
        """What is compared, vehicle and mount set as a table names them, and the comparison."""
        rows = [
            ({"comparison": what} | synthesis.driven.columns, synthesis.comparisons[what])
            for what in (ON_ROAD, ON_ROAD_AS_TESTED, ON_ROAD_BLOCKED, BY_SURFACES, BY_HAMMER)
            for synthesis in self.syntheses
            if what in synthesis.comparisons
        ]
        if self.design is not None:
            rows += [
                (
                    {
                        "comparison": f"{DESIGN}{way.value}",
                        "vehicle": vehicle,
                        "mount set": self.design.mix,
                    },
                    compared,
                )
                for (vehicle, way), compared in self.design.comparisons.items()
            ]
        return rows


def validate(data: DrivenVehicles, listening: Listening) -> Validation:
    """Compare everything that the data allow.

    Raises
    ------
    InputError
        Data that do not fit together.
    """
    run, sets = data.run, data.sets
    struck = {
        car.vehicle.name: (path_receptance(car.vehicle), path_accelerance(car.vehicle))
        for car in data.driven
        if car.vehicle.accelerance is not None
    }
    powertrain = data.powertrain
    syntheses, roads = [], []
    for car in data.driven:
        vehicle, bench = car.vehicle, sets[car.mount_set]
        if vehicle.name not in struck:
            syntheses.append(synthesise(car, run, bench, listening))
            continue
        receptance, accelerance = struck[vehicle.name]
        forces, held_out_error = road_forces(vehicle, run, accelerance)
        synthesis = synthesise(car, run, bench, listening, powertrain, receptance, forces)
        syntheses.append(synthesis)
        if vehicle.accelerance is not None:
            roads.append(analyse_road(synthesis, run, bench, listening, forces, held_out_error))
    first = {each.driven.vehicle.name: each for each in reversed(syntheses)}
    first |= {r.synthesis.driven.vehicle.name: r.synthesis for r in reversed(roads)}
    shown = tuple(first[driven.vehicle.name] for driven in data.vehicles)
    modes, complaint = None, ""
    try:
        modes = body_modes(shown[0].driven.vehicle)
    except InputError as error:
        complaint = str(error)
    design = _virtual_design(data, listening)
    return Validation(
        data, listening, tuple(syntheses), design, tuple(roads), shown, modes, complaint
    )


def _virtual_design(data: DrivenVehicles, listening: Listening) -> VirtualDesign | None:
    """Predict the first mix from parts of other sets; None without a mix or without other sets."""
    plain = [name for name in data.sets if name not in data.mixes]
    if not data.mixes or not plain:
        return None
    mix, parts = next(iter(data.mixes.items()))
    apart = [name for name in plain if name not in parts.values()]
    mounts = []
    for mount, of_set in parts.items():
        fitting = [
            candidate for candidate in data.sets[of_set].mounts if candidate.mount.name == mount
        ]
        if not fitting:
            raise InputError(f"mount set {of_set} has no mount '{mount}', which {mix} asks for")
        mounts += fitting
    return predict_design(
        BenchSet(mix, data.sets[mix].load_case, tuple(mounts)),
        data.sets[(apart or plain)[-1]],
        tuple(driven.vehicle for driven in data.vehicles),
        data.powertrain,
        listening,
    )


def comparison_table(result: Validation) -> pd.DataFrame:
    """One row per comparison, vehicle and mount set."""
    return pd.DataFrame(
        {
            **columns,
            **_criteria(comparison),
            "paired peaks": len(comparison.peaks.pairs),
            "unpaired peaks": len(comparison.peaks.only_reference)
            + len(comparison.peaks.only_compared),
        }
        for columns, comparison in result.comparisons
    )


def _criteria(compared: PressureComparison) -> dict[str, float]:
    return {
        CORR_F: 100 * compared.corr_f,
        CORR_S: 100 * compared.corr_s,
        PEAK: compared.peak_deviation,
    }


def peak_table(result: Validation) -> pd.DataFrame:
    """One row per booming peak of either curve; a peak without partner stands alone."""
    rows = []
    for columns, comparison in result.comparisons:
        pairs: list[tuple[BoomingPeak | None, BoomingPeak | None]] = [*comparison.peaks.pairs]
        pairs += [(peak, None) for peak in comparison.peaks.only_reference]
        pairs += [(None, peak) for peak in comparison.peaks.only_compared]
        for pair in pairs:
            frequency, level = (
                [getattr(peak, name) if peak else np.nan for peak in pair]
                for name in ("frequency", "level")
            )
            rpm = next(peak.rpm for peak in pair if peak)
            numbers = (rpm, *frequency, *level, level[1] - level[0])
            rows.append((*columns.values(), *numbers))
    return pd.DataFrame(rows, columns=PEAK_COLUMNS)


def cause_table(result: Validation) -> pd.DataFrame:
    """One row per vehicle and cause: what of a synthesis loses how much."""
    return pd.DataFrame(
        {"what is compared": what} | road.synthesis.driven.columns | _criteria(comparison)
        for road in result.roads
        for what, comparison in road.causes.items()
    )


def factor_table(result: Validation) -> pd.DataFrame:
    """One row per vehicle and mount set: what the car says of its loudspeaker and its mounts."""
    return pd.DataFrame(
        {
            **synthesis.driven.columns,
            "loudspeaker [dB]": 20 * np.log10(synthesis.factors.loudspeaker),
            **{
                f"{mount} in the car over bench [1]": factor
                for mount, factor in synthesis.factors.mounts.items()
            },
            "left of forces by inversion [%]": 100 * synthesis.factors.rest,
            "error of the inversion [%]": 100 * synthesis.factors.inversion_error,
            "taken over": synthesis.factors.believed,
        }
        for synthesis in result.syntheses
    )


def force_table(result: Validation) -> pd.DataFrame:
    """One row per analysed vehicle: forces by inversion on the road, and bench forces."""
    return pd.DataFrame(road.synthesis.driven.columns | road.errors for road in result.roads)
