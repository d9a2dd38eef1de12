"""Synthesised against measured sound in every driven vehicle."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_plan import training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.fleet import load_fleet
from deboom.bench.layout import LOAD_CASES
from deboom.bench.powertrain import load_bench
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.files.vehicle import read_vehicle
from deboom.measurement.campaign import Campaign, OperatingRun
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.measurement.measured_vehicle import (
    MeasuredVehicle,
    Method,
    path_accelerance,
    path_noise_transfer,
    piece_paths,
    point_noise_transfer,
    summed_over_pieces,
)
from deboom.measurement.modal import (
    ModalModel,
    PanelContributions,
    StabilisationChart,
    in_common_phase,
    mac_matrix,
    modal_model,
    panel_contributions,
    pole_clusters,
    poles_over_orders,
)
from deboom.measurement.path_forces import (
    OnBoardValidation,
    PathForces,
    forces_by_inversion,
    validate_on_board,
)
from deboom.measurement.sensors import SENSOR_AXES
from deboom.measurement.uncertainty import LevelSpread, level_spread
from deboom.measurement.virtual_point import virtual_point, virtual_point_frf
from deboom.mounts.characterise import CharacteriseOptions, characterise, measuring_chains
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.mounts.operating_map import bench_load_case
from deboom.mounts.surface_forces import Outside, SurfaceForces, surface_forces
from deboom.physics.frf import FrfForm
from deboom.physics.sound_level import spl
from deboom.plot import BodyMotion, CurvePanel, DotPanel, SpeedPanel
from deboom.plot.style import INK, MUTED, VEHICLE_PALETTE, mount_colours, vehicle_colours
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.tables import split_label
from deboom.study.pngs import (
    curve_panels,
    dot_panels,
    matrix_map,
    mode_shapes,
    moving_mode_shapes,
    speed_panels,
    stabilisation_chart,
)
from deboom.study.progress import Progress
from deboom.study.result import Scalar, StudyResult
from deboom.vehicles.amplitude_motion import ResolvedDesign, identified_surfaces, resolve_design
from deboom.vehicles.booming_peaks import (
    TOLERANCE,
    BoomingPeak,
    PressureComparison,
    compare_pressure,
)
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.fleet import Band, Fleet, Vehicle
from deboom.vehicles.path_analysis import Measure, PathAnalysis, analyse_paths, paths_by_axis
from deboom.vehicles.powertrain import Powertrain

OPTIONS = CharacteriseOptions(folds=0)


@dataclass(frozen=True, eq=False)
class BenchSet:
    """One mount set on the bench.

    Parameters
    ----------
    name : str
        Such as ``M1``, or ``EnM1-GeM2-TSM3-Du4`` for a mix.
    load_case : LoadCase
        The run that is looked at, as the bench measured it: blocked forces.
    mounts : tuple of CharacterisedMount
        Their surfaces are fitted to all other runs.
    """

    name: str
    load_case: LoadCase
    mounts: tuple[CharacterisedMount, ...]


def bench_sets(
    folder: Path, gear: int, torque_limit: float, progress: Progress, needed: str | None = None
) -> tuple[Campaign, dict[str, BenchSet]]:
    """Characterise every mount set of a campaign, without the run that is to be predicted.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    gear : int
        Of the full-load run with rising torque that is looked at.
    torque_limit : float
        Its limit [N m].
    progress : callable
        ``progress(done, total, text)``; one step per mount set.
    needed : str, optional
        A mount set that must be there.

    Returns
    -------
    Campaign
    dict of str to BenchSet
        By the name of the set.

    Raises
    ------
    InputError
        A campaign that cannot be read or characterised, or without the mount set that is needed; a
        mount set without that run or without any other one.
    """
    progress(0, 1, "reading the bench's files")
    campaign = read_campaign(folder)
    if needed is not None and needed not in campaign.mount_sets:
        raise InputError(
            f"{folder}: the vehicles' mount set '{needed}' was not on the bench, use one of "
            f"{list(campaign.mount_sets)}"
        )
    looked_at = {name: _run(campaign, name, gear, torque_limit) for name in campaign.mount_sets}
    shown = [id(run) for run in looked_at.values()]
    others = replace(campaign, runs=tuple(run for run in campaign.runs if id(run) not in shown))
    total = len(looked_at)
    progress(0, total, "measuring chains")
    chains = measuring_chains(campaign, OPTIONS)
    found = {}
    for place, (name, run) in enumerate(looked_at.items()):
        progress(place, total, f"mount set {name}")
        result = characterise(others, name, OPTIONS, chains=chains)
        with threadpool_limits(1):  # its matrices are too small to share
            case = bench_load_case(campaign, run, chains, f"gear {gear}, {torque_limit:g} N m")
        found[name] = BenchSet(name, case, result.mounts)
    return campaign, found


def _run(campaign: Campaign, mount_set: str, gear: int, torque_limit: float) -> OperatingRun:
    for run in campaign.runs_of(mount_set):
        if run.full_load and run.rising and (run.gear, run.torque_limit) == (gear, torque_limit):
            return run
    raise InputError(
        f"campaign {campaign.name}, mount set {mount_set}: there is no full-load run in gear "
        f"{gear} with {torque_limit:g} N m to compare with the road: measure it, or choose another "
        "run with --load-case"
    )


_LOADS = ("x", "y", "z", "mx", "my", "mz")


@dataclass(frozen=True, eq=False)
class VehicleTruth:
    """What is exact about a vehicle and its run.

    Parameters
    ----------
    force : Spectrum
        Of every mount on the body, channels ``<mount> [<piece>] <axis>`` [N].
    pressure : Spectrum
        At the ears, through the mounts alone [Pa].
    noise_transfer : Frf
        Outputs are the ears, inputs ``<mount> [<piece>] x y z mx my mz`` [Pa/N].
    natural_frequency : array, shape (n_mode,)
        Of the trimmed body on average; between two measurements it changes a little [Hz].
    damping_ratio : array, shape (n_mode,)
        [1].
    shapes : array, shape (n_mode, n_interface, 6)
        At the interfaces, x y z rx ry rz [kg^-1/2].
    panel_shapes : array, shape (n_mode, n_panel)
        Inwards [kg^-1/2].
    """

    force: Spectrum
    pressure: Spectrum
    noise_transfer: Frf
    natural_frequency: RealArray
    damping_ratio: RealArray
    shapes: RealArray
    panel_shapes: RealArray

    def mode_shapes(self, n_outputs: int) -> RealArray:
        """Return every mode at the first outputs: translations at the interfaces, then panels.

        Returns
        -------
        array, shape (n_mode, n_outputs)
            [kg^-1/2].
        """
        at_interfaces = self.shapes[:, :, :3].reshape(len(self.shapes), -1)
        return np.hstack([at_interfaces, self.panel_shapes])[:, :n_outputs]


def read_vehicle_truth(folder: Path, run: str) -> VehicleTruth | None:
    """Read the truth of a virtual vehicle.

    Parameters
    ----------
    folder : Path
        Of the vehicle.
    run : str
        On the road.

    Returns
    -------
    VehicleTruth or None
        None for a vehicle that nobody knows the truth of.
    """
    paths = [Path(folder) / "truth" / f"{name}.npz" for name in (run, "vehicle")]
    if not all(path.is_file() for path in paths):
        return None
    driven, body = (_arrays(path) for path in paths)
    frequency = driven["frequency"].real
    ears, interfaces = (tuple(body[name].tolist()) for name in ("ears", "interfaces"))
    transfer: ComplexArray = body["noise_transfer"]
    return VehicleTruth(
        force=Spectrum(frequency, driven["force"], tuple(driven["channels"].tolist()), "N"),
        pressure=Spectrum(frequency, driven["pressure_of_mounts"], ears, "Pa"),
        noise_transfer=Frf(
            body["frequency"],
            transfer.reshape(*transfer.shape[:2], -1),
            ears,
            tuple(f"{name} {load}" for name in interfaces for load in _LOADS),
            "Pa/N",
        ),
        natural_frequency=body["natural_frequencies"],
        damping_ratio=body["damping_ratios"],
        shapes=body["shapes_at_interfaces"],
        panel_shapes=body["shapes_at_panels"],
    )


def _arrays(path: Path) -> dict[str, np.ndarray]:
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


GROUP = "U06"
"""Of the virtual fleet: vehicles of one drawing."""

_UNIT = re.compile(r"([A-Za-z]+)(\d+)")


@dataclass(frozen=True, eq=False)
class DrivenVehicle:
    """One vehicle that was driven with one mount set.

    Parameters
    ----------
    vehicle : MeasuredVehicle
        With its noise transfer functions and its run.
    truth : VehicleTruth or None
        None where nobody knows it.
    mount_set : str
        Under its powertrain.
    """

    vehicle: MeasuredVehicle
    truth: VehicleTruth | None
    mount_set: str

    @property
    def title(self) -> str:
        """Such as ``U06-1 with M1``."""
        return f"{self.vehicle.name} with {self.mount_set}"


@dataclass(frozen=True, eq=False)
class ValidationData:
    """Everything that was measured.

    Parameters
    ----------
    campaign : Campaign
        On the bench.
    run : str
        Name of the vehicles' run that is looked at.
    sets : dict of str to BenchSet
        By name, mixes included.
    driven : tuple of DrivenVehicle
        At least one.
    input_files : tuple of Path
        That stay; virtual measurements leave none.
    """

    campaign: Campaign
    run: str
    sets: dict[str, BenchSet]
    driven: tuple[DrivenVehicle, ...]
    input_files: tuple[Path, ...] = ()

    @property
    def vehicles(self) -> tuple[DrivenVehicle, ...]:
        """Every vehicle once."""
        first: dict[str, DrivenVehicle] = {}
        for one in self.driven:
            first.setdefault(one.vehicle.name, one)
        return tuple(first.values())

    @property
    def mixes(self) -> dict[str, dict[str, str]]:
        """Mix → mount → the set in which that part was characterised as well."""
        found = {}
        for name in self.sets:
            parts = parts_of(name)
            if parts and all(one in self.sets for one in parts.values()):
                found[name] = parts
        return found


def parts_of(mix: str) -> dict[str, str]:
    """Return mount → set of a name like ``EnM1-GeM2``; empty for any other name."""
    units = [_UNIT.fullmatch(part) for part in mix.split("-")]
    if len(units) < 2 or None in units:
        return {}
    return {unit[1]: f"M{unit[2]}" for unit in units if unit is not None}


def virtual_data(
    seed: int, n_vehicles: int, n_sets: int, run: str, progress: Progress
) -> ValidationData:
    """Measure mount sets on the virtual bench, drive them in virtual cars, and keep no files.

    Parameters
    ----------
    seed : int
        Of all errors, from 1; seed 1 takes the frozen fleet.
    n_vehicles, n_sets : int
        Vehicles of one group, and mount sets ``M1``, ``M2``, …; every vehicle drives with every
        set. The bench measures a mix of the sets as well.
    run : str
        Such as ``g5_wot220``.
    progress : callable
        ``progress(done, total, text)``.

    Raises
    ------
    InputError
        More vehicles than the group has, fewer than two mount sets, an unknown run, a seed below 1.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    names = [name for name in load_fleet(seed).bodies if name.startswith(f"{GROUP}-")]
    if not 1 <= n_vehicles <= len(names):
        raise InputError(f"{n_vehicles} vehicles: group {GROUP} has 1 to {len(names)}")
    if n_sets < 2:
        raise InputError(f"{n_sets} mount sets make no virtual design: take at least 2")
    plan = next((plan for plan in LOAD_CASES if plan.name == run), None)
    if plan is None:
        raise InputError(f"there is no run '{run}', use {[plan.name for plan in LOAD_CASES]}")
    sets = [f"M{k}" for k in range(1, n_sets + 1)]
    mounts = load_bench().mounts
    mix = "-".join(f"{mount.name}{1 + k % n_sets}" for k, mount in enumerate(mounts))
    on_bench = n_sets + 1
    total = 2 * on_bench + n_vehicles * n_sets
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary)
        progress(0, total, "mounts on the bench")
        write_campaign(folder / "bench", seed, training_plan(*sets, mix))
        campaign, benches = bench_sets(
            folder / "bench",
            plan.gear,
            plan.torque,
            lambda done, _, text: progress(on_bench + done, total, text),
        )
        driven = []
        for number, name in enumerate(names[:n_vehicles]):
            for place, parts in enumerate(sets):
                done = 2 * on_bench + number * n_sets + place
                progress(done, total, f"{name} with {parts}")
                car = folder / f"{name}_{parts}"
                struck = place == number % n_sets  # accelerances are large: with one set only
                write_vehicle(car, seed, name, parts, load_cases=(plan,), accelerance=struck)
                driven.append(DrivenVehicle(*_read(car, run), parts))
    progress(total, total, "")
    return ValidationData(campaign, run, benches, tuple(driven))


def given_data(
    campaign_folder: Path,
    vehicle_folders: Sequence[Path],
    mount_set: str,
    run: str,
    progress: Progress,
) -> ValidationData:
    """Take a user's own campaign, and vehicles that were driven with one of its mount sets.

    Parameters
    ----------
    campaign_folder : Path
        Of the bench; it has a full-load run of the same gear and torque limit.
    vehicle_folders : sequence of Path
        At least one; vehicles of one drawing.
    mount_set : str
        Under their powertrains.
    run : str
        Name of the vehicles' run.
    progress : callable
        ``progress(done, total, text)``.

    Raises
    ------
    InputError
        Folders that cannot be read or do not fit together, no vehicle, no such run or set.
    """
    if not vehicle_folders:
        raise InputError("there is no vehicle to listen in: name at least one with --vehicle")
    progress(0, 1, "vehicles")
    driven = [DrivenVehicle(*_read(Path(folder), run), mount_set) for folder in vehicle_folders]
    road = driven[0].vehicle.run(run)
    campaign, benches = bench_sets(
        Path(campaign_folder), road.gear, road.torque_limit, progress, needed=mount_set
    )
    progress(len(benches), len(benches), "")
    found = [path for folder in vehicle_folders for path in sorted(Path(folder).rglob("*"))]
    files = tuple(path for path in found if path.is_file())
    return ValidationData(
        campaign, run, benches, tuple(driven), (*campaign.input_files, *dict.fromkeys(files))
    )


def _read(folder: Path, run: str) -> tuple[MeasuredVehicle, VehicleTruth | None]:
    vehicle = read_vehicle(folder)
    vehicle.run(run)  # it must be there
    return vehicle, read_vehicle_truth(folder, run)


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
        A mount that does not say what it carries; see `deboom.vehicles.coupled_motion`.
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


ON_ROAD = "synthesised against measured"
BY_SURFACES = "forces from surfaces against measured forces"
BY_HAMMER = "hammer against reciprocal functions"
DESIGN = "virtual design, "

PEAK = "largest peak deviation [dB]"


@dataclass(frozen=True, eq=False)
class Validation:
    """Everything that was compared.

    Parameters
    ----------
    data : ValidationData
    listening : Listening
    syntheses : tuple of Synthesis
        One per driven vehicle and mount set.
    design : VirtualDesign or None
        None for a campaign without a mix.
    roads : tuple of RoadAnalysis
        Vehicles whose accelerometers were recorded under the hammer.
    """

    data: ValidationData
    listening: Listening
    syntheses: tuple[Synthesis, ...]
    design: VirtualDesign | None
    roads: tuple[RoadAnalysis, ...]

    @property
    def shown(self) -> tuple[Synthesis, ...]:
        """Every vehicle once, with the mount set that figures show; those with most data first."""
        known = [one.synthesis for one in self.roads] + list(self.syntheses)
        first: dict[str, Synthesis] = {}
        for one in known:
            first.setdefault(one.driven.vehicle.name, one)
        return tuple(first[one.vehicle.name] for one in self.data.vehicles)

    @property
    def spread(self) -> LevelSpread | None:
        """Of the measured levels of all vehicles with one mount set; None for a single vehicle."""
        mount_set = self.syntheses[0].driven.mount_set
        levels = [
            spl(one.on_road.reference, one.on_road.frequency)
            for one in self.syntheses
            if one.driven.mount_set == mount_set
        ]
        return level_spread(levels) if len(levels) > 1 else None


def validate(data: ValidationData, listening: Listening) -> Validation:
    """Compare everything that the data allow.

    Raises
    ------
    InputError
        Data that do not fit together.
    """
    done = syntheses(data, listening)
    return Validation(
        data,
        listening,
        done,
        virtual_design(data, listening),
        road_analyses(data, done, listening),
    )


def comparison_table(result: Validation) -> pd.DataFrame:
    """One row per comparison, vehicle and mount set."""
    return pd.DataFrame(
        [
            {
                "comparison": what,
                "vehicle": vehicle,
                "mount set": mount_set,
                "corr_f complex [%]": 100 * one.corr_f,
                "corr_f magnitude [%]": 100 * one.corr_f_magnitude,
                "corr_s magnitude [%]": 100 * one.corr_s_magnitude,
                "corr_s complex [%]": 100 * one.corr_s,
                "corr_s magnitude, over the reference [%]": 100 * one.corr_s_of_reference,
                PEAK: one.peak_deviation,
                "paired peaks": len(one.peaks.pairs),
                "unpaired peaks": len(one.peaks.only_reference) + len(one.peaks.only_compared),
                "rms over all lines [dB]": one.rms_difference,
            }
            for what, vehicle, mount_set, one in _comparisons(result)
        ]
    )


def peak_table(result: Validation) -> pd.DataFrame:
    """One row per booming peak of either curve; a peak without partner stands alone."""
    rows = []
    for what, vehicle, mount_set, one in _comparisons(result):
        found = one.peaks
        pairs: list[tuple[BoomingPeak | None, BoomingPeak | None]] = [*found.pairs]
        pairs += [(peak, None) for peak in found.only_reference]
        pairs += [(None, peak) for peak in found.only_compared]
        for reference, compared in pairs:
            there = [peak for peak in (reference, compared) if peak is not None]
            rows.append(
                {
                    "comparison": what,
                    "vehicle": vehicle,
                    "mount set": mount_set,
                    "engine speed [rpm]": there[0].rpm,
                    "reference at [Hz]": reference.frequency if reference else np.nan,
                    "compared at [Hz]": compared.frequency if compared else np.nan,
                    "reference [dB(A)]": reference.level if reference else np.nan,
                    "compared [dB(A)]": compared.level if compared else np.nan,
                    "deviation [dB]": compared.level - reference.level
                    if reference and compared
                    else np.nan,
                }
            )
    return pd.DataFrame(rows)


def cause_table(result: Validation) -> pd.DataFrame:
    """One row per vehicle and cause: what of a synthesis loses how much."""
    return pd.DataFrame(
        [
            {
                "what is compared": what,
                "vehicle": road.synthesis.driven.vehicle.name,
                "mount set": road.synthesis.driven.mount_set,
                "corr_f complex [%]": 100 * one.corr_f,
                "corr_s magnitude [%]": 100 * one.corr_s_magnitude,
                PEAK: one.peak_deviation,
            }
            for road in result.roads
            for what, one in road.causes.items()
        ]
    )


def force_table(result: Validation) -> pd.DataFrame:
    """One row per analysed vehicle: forces by inversion on the road, and bench forces."""
    return pd.DataFrame(
        [
            {
                "vehicle": road.synthesis.driven.vehicle.name,
                "mount set": road.synthesis.driven.mount_set,
                "forces by inversion, rms error [%]": 100 * road.force_error,
                "bench forces, rms error [%]": 100 * road.blocked_error,
                "largest condition number [1]": road.largest_condition,
                "held-out accelerometers, median error [%]": 100
                * float(np.median(road.on_board.error_by_line)),
            }
            for road in result.roads
        ]
    )


def _comparisons(result: Validation) -> Iterator[tuple[str, str, str, PressureComparison]]:
    for what, of in (
        (ON_ROAD, "on_road"),
        (BY_SURFACES, "by_surfaces"),
        (BY_HAMMER, "by_hammer"),
    ):
        for one in result.syntheses:
            driven = one.driven
            yield what, driven.vehicle.name, driven.mount_set, getattr(one, of)
    if result.design is not None:
        for (vehicle, way), compared in result.design.comparisons.items():
            yield f"{DESIGN}{way.value}", vehicle, result.design.mix, compared


BODY_MODES = (24.0, 30.0, 37.0, 40.0, 47.0)
"""Of the thesis's vehicle, figure 43 [Hz]."""


@dataclass(frozen=True)
class Criterion:
    """One figure that says whether a synthesis can be trusted.

    Parameters
    ----------
    name : str
        With its unit.
    measured : float
        What was found; nan where it could not be.
    thesis : str
        What the thesis reports; empty where it does not.
    most, least : float or None
        What was asked: not above, not below; both None for a figure without target.
    """

    name: str
    measured: float
    thesis: str = ""
    most: float | None = None
    least: float | None = None

    @property
    def target(self) -> str:
        """What was asked, in words."""
        if self.most is not None:
            return f"≤ {self.most:g}"
        return "" if self.least is None else f"≥ {self.least:g}"

    @property
    def holds(self) -> str:
        """``yes``, ``no``, or nothing where nothing was asked; unknown is not held."""
        if not self.target:
            return ""
        low = self.least is None or self.measured >= self.least
        high = self.most is None or self.measured <= self.most
        return "yes" if low and high else "no"


@dataclass(frozen=True)
class ModesAgainstTruth:
    """How far the modes lie from the true ones, each from the nearest.

    Parameters
    ----------
    frequency, damping : float
        Largest relative error of natural frequency and damping ratio [1].
    missed : int
        True modes, of as many of the lowest as were asked for, that none was near.
    """

    frequency: float
    damping: float
    missed: int


def criteria(
    result: Validation,
    comparisons: pd.DataFrame,
    causes: pd.DataFrame,
    forces: pd.DataFrame,
    modes: Mapping[str, Scalar],
    against_truth: ModesAgainstTruth | None = None,
) -> tuple[Criterion, ...]:
    """Gather the figures of a validation.

    Parameters
    ----------
    result : Validation
    comparisons, causes, forces : DataFrame
        Its tables, see `deboom.study.synthesis_validation`.
    modes : mapping of str to float
        ``mode_<n>_hz`` and ``mode_<n>_mac``; empty without modal analysis.
    against_truth : ModesAgainstTruth, optional
        Where the true modes are known.
    """
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    surfaces = comparisons[comparisons["comparison"] == BY_SURFACES]
    hammer = comparisons[comparisons["comparison"] == BY_HAMMER]
    found = [
        Criterion(
            "corr_f, complex pressure, median [%]", _median(road, "corr_f complex [%]"), "5", 5
        ),
        Criterion(
            "corr_f, complex pressure, largest [%]", float(road["corr_f complex [%]"].max()), "", 10
        ),
        Criterion("corr_f, magnitude, median [%]", _median(road, "corr_f magnitude [%]")),
        Criterion("corr_s, magnitude, median [%]", _median(road, "corr_s magnitude [%]"), "10", 15),
        Criterion(
            "corr_s, magnitude, largest [%]", float(road["corr_s magnitude [%]"].max()), "", 20
        ),
        Criterion(
            "corr_s, magnitude, over the measured pressure, median [%]",
            _median(road, "corr_s magnitude, over the reference [%]"),
        ),
        Criterion("corr_s, complex pressure, median [%]", _median(road, "corr_s complex [%]")),
        Criterion("peaks, synthesised against measured, largest [dB]", _largest(road), "3", 3),
        Criterion("peaks of one curve alone, share [%]", _unpaired(road)),
        Criterion("forces from surfaces, at peaks, largest [dB]", _largest(surfaces), "", 0.3),
    ]
    if result.design is not None:
        found += [
            Criterion(
                f"{what}, at peaks, largest [dB]",
                _largest(comparisons[comparisons["comparison"] == what]),
                "",
                0.5,
            )
            for what in dict.fromkeys(comparisons["comparison"])
            if what.startswith(DESIGN)
        ]
    found += [
        Criterion(
            "hammer against reciprocal, at peaks, median [dB]", _median(hammer, PEAK), "1 to 2"
        ),
        Criterion("hammer against reciprocal, at peaks, largest [dB]", _largest(hammer), "1 to 2"),
    ]
    if len(forces):
        inversion = "forces by inversion, rms error [%]"
        blocked = "bench forces, rms error [%]"
        judged = {
            "cost of blocked forces": BLOCKED,
            "cost of measured transfer functions": FUNCTIONS,
        }
        if forces[inversion].notna().any():
            found += [
                Criterion(
                    "interface forces by inversion on the road, rms error, largest [%]",
                    float(forces[inversion].max()),
                    "",
                    10,
                ),
                Criterion(
                    "bench forces as interface forces, rms error, largest [%]",
                    float(forces[blocked].max()),
                ),
            ]
            for name, what in judged.items():
                rows = causes[causes["what is compared"] == what]
                found.append(
                    Criterion(f"{name}, corr_f, median [%]", _median(rows, "corr_f complex [%]"))
                )
        found.append(
            Criterion(
                "held-out accelerometers, median error, largest [%]",
                float(forces["held-out accelerometers, median error [%]"].max()),
            )
        )
    if result.spread is not None:
        found.append(
            Criterion(
                f"spread over {len(result.data.vehicles)} vehicles of one drawing, median [dB]",
                result.spread.quantile(0.5),
                "10 to 15",
            )
        )
    found += [
        Criterion(f"mode {n}, natural frequency [Hz]", float(modes[f"mode_{n}_hz"]), f"{asked:g}")
        for n, asked in enumerate(BODY_MODES, 1)
        if f"mode_{n}_hz" in modes
    ]
    if against_truth is not None:
        found += [
            Criterion(
                "true modes among the lowest that were missed [1]", against_truth.missed, most=0
            ),
            Criterion(
                "natural frequencies against the truth, largest error [%]",
                100 * against_truth.frequency,
                most=0.5,
            ),
            Criterion(
                "damping ratios against the truth, largest error [%]",
                100 * against_truth.damping,
                most=15,
            ),
        ]
    macs = [float(value) for name, value in modes.items() if name.endswith("_mac")]
    if macs and np.isfinite(macs).all():
        found.append(
            Criterion(
                "shapes of the modes against the truth, least MAC [1]", min(macs), "", None, 0.95
            )
        )
    return tuple(found)


def criteria_table(found: tuple[Criterion, ...]) -> pd.DataFrame:
    """Write them down: name, measured, thesis, target, holds."""
    return pd.DataFrame(
        {
            "name": [one.name for one in found],
            "measured": [one.measured for one in found],
            "thesis": [one.thesis for one in found],
            "target": [one.target for one in found],
            "holds": [one.holds for one in found],
        }
    )


def headline_numbers(
    result: Validation, comparisons: pd.DataFrame, modes: Mapping[str, Scalar]
) -> dict[str, Scalar]:
    """Keys of ``summary.json``; the study's docstring explains them."""
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    numbers: dict[str, Scalar] = {
        "corr_f_percent": _median(road, "corr_f complex [%]"),
        "corr_s_percent": _median(road, "corr_s magnitude [%]"),
        "peak_deviation_db": _largest(road),
    }
    if result.design is not None:
        numbers["virtual_design_peak_db"] = result.design.peak_deviation
    return numbers | dict(modes)


def _median(rows: pd.DataFrame, column: str) -> float:
    return float(rows[column].median())


def _largest(rows: pd.DataFrame) -> float:
    return float(rows[PEAK].max())


def _unpaired(rows: pd.DataFrame) -> float:
    alone = float(rows["unpaired peaks"].sum())
    return 100 * alone / max(alone + 2 * float(rows["paired peaks"].sum()), 1.0)


DEPTH = 45.0
"""Of a level axis below the loudest line; deeper notches leave the panel [dB]."""

MEASURED, SYNTHESISED = "measured in the vehicle", "synthesised"
BENCH_FORCES, SURFACE_FORCES = "measured bench forces", "forces from response surfaces"
RECIPROCAL, HAMMER = "reciprocal functions", "hammer functions"
ALL_PATHS = "sum of all paths"
LEVEL = "SPL [dB(A)]"
WAYS = {way.value: VEHICLE_PALETTE[place] for place, way in enumerate(DesignMotion)}


def validation_figures(
    result: Validation, comparisons: pd.DataFrame, causes: pd.DataFrame
) -> dict[str, bytes]:
    """Draw all pictures; file stem → PNG."""
    figures = {
        "measured_synthesised": _pairs(result, "on_road", MEASURED, SYNTHESISED),
        "synthesis_error": _errors(result, comparisons),
        "surface_forces": _pairs(result, "by_surfaces", BENCH_FORCES, SURFACE_FORCES),
    }
    if result.design is not None:
        figures["virtual_design"] = _virtual_design(result)
        figures["virtual_design_deviation"] = _design_deviation(result)
    figures["hammer_reciprocal"] = _pairs(result, "by_hammer", RECIPROCAL, HAMMER)
    figures["contributions"] = _contributions(result)
    if len(causes):
        figures["causes"] = _causes(result, causes)
        figures["interface_forces"] = _interface_forces(result)
    if result.spread is not None:
        figures["vehicle_spread"] = _spread(result)
    return figures


def _pairs(result: Validation, what: str, reference: str, compared: str) -> bytes:
    """Every vehicle once: two curves with their paired peaks."""
    panels = []
    for one in result.shown:
        pair: PressureComparison = getattr(one, what)
        first, second = pair.levels
        peaks = pair.peaks
        several = bool(peaks.pairs)
        panels.append(
            SpeedPanel(
                one.driven.title,
                {reference: first, compared: second},
                f"peaks within {pair.peak_deviation:.2f} dB" if several else "no paired peak",
                {
                    reference: _points([peak for peak, _ in peaks.pairs]),
                    compared: _points([peak for _, peak in peaks.pairs]),
                },
            )
        )
    first_pair: PressureComparison = getattr(result.shown[0], what)
    return speed_panels(
        first_pair.frequency,
        first_pair.order,
        panels,
        y_label=LEVEL,
        colours={reference: INK, compared: VEHICLE_PALETTE[1]},
        dashed=(compared,),
        depth=DEPTH,
    )


def _points(peaks: list[BoomingPeak]) -> tuple[RealArray, RealArray]:
    return np.array([one.frequency for one in peaks]), np.array([one.level for one in peaks])


def _errors(result: Validation, comparisons: pd.DataFrame) -> bytes:
    """Every vehicle and mount set: shape, scale, peaks, for the road and for what leads to it."""
    wanted = {
        ON_ROAD: "against the road",
        BY_HAMMER: "hammer against reciprocal",
        BY_SURFACES: "surfaces against forces",
    }
    return _dots(
        {label: comparisons[comparisons["comparison"] == what] for what, label in wanted.items()},
        result,
        (("corr_f complex [%]", 5.0), ("corr_s magnitude [%]", 15.0), (PEAK, 3.0)),
        "asked of the road",
    )


def _causes(result: Validation, causes: pd.DataFrame) -> bytes:
    """Show what a synthesis loses where."""
    rows = {
        str(what).replace(", against", ",\nagainst"): causes[causes["what is compared"] == what]
        for what in dict.fromkeys(causes["what is compared"])
    }
    measures = (("corr_f complex [%]", None), ("corr_s magnitude [%]", None), (PEAK, None))
    return _dots(rows, result, measures, "")


def _dots(
    rows: Mapping[str, pd.DataFrame],
    result: Validation,
    measures: tuple[tuple[str, float | None], ...],
    limit_label: str,
) -> bytes:
    panels = []
    for column, limit in measures:
        values = {
            category: {
                str(vehicle): part[column].dropna().to_numpy()
                for vehicle, part in frame.groupby("vehicle", sort=False)
                if part[column].notna().any()
            }
            for category, frame in rows.items()
        }
        label = column.replace("largest peak deviation", "largest at peaks")
        panels.append(DotPanel(label, values, limit, limit_label if limit else ""))
    names = [one.vehicle.name for one in result.data.vehicles]
    return dot_panels(panels, vehicle_colours(names))


def _virtual_design(result: Validation) -> bytes:
    design = result.design
    assert design is not None
    measured = "measured forces of the design"
    colours = {measured: INK, **WAYS}
    panels = []
    names = [one.vehicle.name for one in result.data.vehicles]
    for name in names:
        ways = {way: design.comparisons[name, way] for way in DesignMotion}
        first = next(iter(ways.values()))
        worst = max(one.peak_deviation for one in ways.values())
        panels.append(
            SpeedPanel(
                name,
                {measured: first.levels[0]}
                | {way.value: one.levels[1] for way, one in ways.items()},
                f"peaks within {worst:.2f} dB" if np.isfinite(worst) else "no paired peak",
            )
        )
    some = design.comparisons[names[0], DesignMotion.RESOLVED]
    return speed_panels(
        some.frequency,
        some.order,
        panels,
        y_label=LEVEL,
        colours=colours,
        dashed=[way.value for way in DesignMotion],
        depth=DEPTH,
    )


def _design_deviation(result: Validation) -> bytes:
    """Levels of the three ways above those of the measured forces."""
    design = result.design
    assert design is not None
    panels = []
    for name in (one.vehicle.name for one in result.data.vehicles):
        ways = {way.value: design.comparisons[name, way] for way in DesignMotion}
        curves = {label: one.levels[1] - one.levels[0] for label, one in ways.items()}
        panels.append(SpeedPanel(name, curves))
    some = next(iter(design.comparisons.values()))
    return speed_panels(
        some.frequency,
        some.order,
        panels,
        y_label="deviation [dB]",
        colours=WAYS,
    )


def path_groups(paths: PathAnalysis) -> PathAnalysis:
    """Sum all paths across by axis and keep those along x apart, as the thesis's figure 42."""
    by_axis = paths_by_axis(paths.paths)
    groups = {name: [name] for name in by_axis.get("x", ())}
    groups |= {f"all {axis}": [*names] for axis, names in by_axis.items() if axis != "x"}
    return paths.grouped(groups)


def _contributions(result: Validation) -> bytes:
    """First vehicle: partial sums with reciprocal and with hammer functions."""
    one = result.shown[0]
    low, high = result.listening.band
    grouped = {RECIPROCAL: path_groups(one.reciprocal), HAMMER: path_groups(one.hammer)}
    names = grouped[RECIPROCAL].paths
    colours = mount_colours(names) | {ALL_PATHS: INK}
    panels = []
    inside = (one.reciprocal.frequency >= low) & (one.reciprocal.frequency <= high)
    for label, analysis in grouped.items():
        loudest = analysis.level[inside].max()
        curves = {ALL_PATHS: analysis.level[inside]} | {
            name: level
            for name, level in zip(names, analysis.path_levels[inside].T, strict=True)
            if level.max() > loudest - DEPTH
        }
        panels.append(SpeedPanel(f"{one.driven.title}, {label}", curves))
    order = one.on_road.order
    return speed_panels(
        one.reciprocal.frequency[inside],
        order,
        panels,
        y_label=LEVEL,
        colours=colours,
        columns=1,
        depth=DEPTH,
    )


def _interface_forces(result: Validation) -> bytes:
    """First analysed vehicle: strongest directions, bench, road and truth."""
    road: RoadAnalysis = result.roads[0]
    one: Synthesis = road.synthesis
    low, high = result.listening.band
    force = road.forces.force
    inside = (force.frequency >= low) & (force.frequency <= high)
    blocked = result.data.sets[one.driven.mount_set].load_case.force
    by_inversion, on_bench, exact = (
        "by inversion on the road",
        "on the bench",
        "true, in the vehicle",
    )
    channels = [name for name in force.channels if name.endswith(" x")]
    panels = []
    for name in channels:
        curves = {
            on_bench: np.abs(blocked.select([name]).values[inside, 0]),
            by_inversion: np.abs(force.select([name]).values[inside, 0]),
        }
        if one.driven.truth is not None:
            curves[exact] = np.abs(one.driven.truth.force.select([name]).values[inside, 0])
        panels.append(SpeedPanel(name, curves))
    return speed_panels(
        force.frequency[inside],
        one.on_road.order,
        panels,
        y_label="|F| [N]",
        colours={exact: INK, by_inversion: VEHICLE_PALETTE[1], on_bench: VEHICLE_PALETTE[0]},
        dashed=(by_inversion,),
    )


def _spread(result: Validation) -> bytes:
    """Measured levels of all vehicles with the first mount set."""
    first = result.syntheses[0].driven.mount_set
    several = [one for one in result.syntheses if one.driven.mount_set == first]
    lines = several[0].on_road.frequency
    names = [one.driven.vehicle.name for one in several]
    spread = result.spread
    assert spread is not None
    curves = {
        name: spl(one.on_road.reference, lines) for name, one in zip(names, several, strict=True)
    }
    mean = "mean of the levels"
    return speed_panels(
        lines,
        several[0].on_road.order,
        [
            SpeedPanel(
                f"measured in {len(names)} vehicles, mount set {first}",
                {**curves, mean: spread.mean},
                f"lowest to highest: median {spread.quantile(0.5):.1f} dB",
            )
        ],
        y_label=LEVEL,
        colours={**vehicle_colours(names), mean: MUTED},
        dashed=(mean,),
        depth=DEPTH,
    )


TERMS = ("booming noise", "SPL", "booming peak", "dynamic stiffness", "noise transfer function")

_DIGITS = {"%": 1, "dB": 2, "Hz": 2, "1": 3}

MODAL_FIGURES = {
    "stabilisation": "Stabilisation chart: poles over the order of the polynomial.",
    "mode_shapes": "Shapes of the modes at the mounts and panels.",
    "mac": "Shapes found against each other, or against the truth where it is known (MAC).",
    "rebuilt": "Measured functions, and those rebuilt from modes and residuals.",
    "panel_contributions": "What each panel brings to the pressure at the ear in each mode.",
}
"""Captions of `deboom.study.synthesis_validation`."""


def validation_page(
    result: Validation,
    found: Sequence[Criterion],
    tables: Mapping[str, pd.DataFrame],
    figures: Mapping[str, bytes],
    complaint: str,
) -> Page:
    """Write the report.

    Parameters
    ----------
    result : Validation
    found : sequence of Criterion
        Every figure beside thesis and target.
    tables : mapping of str to DataFrame
        Of the study.
    figures : mapping of str to bytes
        PNG by file stem; empty if nothing was drawn.
    complaint : str
        Why there is no modal analysis; empty where there is one.
    """
    missed = [one.name for one in found if one.holds == "no"]
    warnings = []
    if missed:
        warnings.append(f"Not within its target: {'; '.join(missed)}.")
    if complaint:
        warnings.append(f"There is no modal analysis: {complaint}.")
    sections = (
        _criteria(result, found),
        _road(tables, figures),
        _forces(figures),
        *([_design(result, tables, figures)] if result.design is not None else []),
        _functions(result, tables, figures),
        *([_causes_10(tables, figures)] if "causes" in tables else []),
        *([_modes(result, tables, figures)] if "modes" in tables else []),
        *([_spread_10(result, figures)] if result.spread is not None else []),
    )
    return Page(
        title="Is the synthesised sound the measured one?",
        question=(
            "Forces of the mounts on the test bench times noise transfer functions of the trimmed "
            "body give a sound at the ear. How far is it from what a microphone hears in the "
            "driven vehicle, which step costs how much, and do parts that were characterised apart "
            "predict a design that nobody built?"
        ),
        headlines=_headlines(tables["comparisons"], result),
        terms=TERMS,
        warnings=tuple(warnings),
        sections=sections,
    )


def _headlines(comparisons: pd.DataFrame, result: Validation) -> tuple[Headline, ...]:
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    shown = [
        Headline(
            f"{road['corr_f complex [%]'].median():.1f} %",
            "difference in shape of the pressure (corr_f, complex), median; thesis 5 %",
        ),
        Headline(
            f"{road['corr_s magnitude [%]'].median():.1f} %",
            "difference in scale (corr_s, magnitude), median; thesis 10 %",
        ),
    ]
    if np.isfinite(road[PEAK]).any():
        label = "largest deviation of a booming peak from the measured one; thesis 3 dB"
        shown.append(Headline(f"{road[PEAK].max():.1f} dB", label))
    if result.design is not None and np.isfinite(result.design.peak_deviation):
        label = "largest deviation of a booming peak of the virtual design, all three ways"
        shown.append(Headline(f"{result.design.peak_deviation:.2f} dB", label))
    return tuple(shown)


def _criteria(result: Validation, found: Sequence[Criterion]) -> Section:
    low, high = result.listening.band
    sets = list(dict.fromkeys(one.driven.mount_set for one in result.syntheses))
    vehicles = len(result.data.vehicles)
    frame = pd.DataFrame(
        {
            "figure": [one.name for one in found],
            "measured": [_written(one) for one in found],
            "thesis": [one.thesis or "–" for one in found],
            "target": [one.target or "–" for one in found],
            "holds": [one.holds or "–" for one in found],
        }
    )
    return Section(
        "Every figure beside the thesis",
        f"{vehicles} {'vehicles' if vehicles > 1 else 'vehicle'} with mount sets "
        f"{', '.join(sets)}, run {result.data.run}, {result.listening.ear}, {low:g} to {high:g} "
        "Hz. corr_f = |1 − MAC| is the difference in shape, corr_s = |1 − MSF| the scale that "
        "the synthesised pressure still needs to meet the measured one; the scale over the "
        "measured pressure stands beside it. Both are of pressures, complex or as magnitudes, "
        "never of dB curves. Booming peaks are compared with peaks, paired within "
        f"{TOLERANCE:g} Hz; a peak without partner has no deviation and is counted. Line by line, "
        "the largest difference in a notch would say nothing about booming.",
        tables=(Table(frame, "A figure without target is reported, not judged."),),
    )


def _written(one: Criterion) -> str:
    if not np.isfinite(one.measured):
        return "not known"
    return f"{one.measured:.{_DIGITS.get(split_label(one.name)[1], 2)}f}"


def _road(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]) -> Section:
    frame = tables["comparisons"]
    road = frame[frame["comparison"] == ON_ROAD].drop(
        columns=["comparison", "corr_s magnitude, over the reference [%]"]
    )
    return Section(
        "Measured against synthesised",
        "The bench measures with cool mounts on a stiff frame, the vehicle drives with warmer ones "
        "on a body that gives way, and its microphone hears other paths as well. Forces of the "
        "bench are blocked forces; they belong with the transfer functions of the assembled "
        "vehicle, and those of the trimmed body are the thesis's approximation.",
        figures=_pictures(
            figures,
            {
                "measured_synthesised": "Measured and synthesised SPL of every vehicle; dots are "
                "paired booming peaks (thesis, figure 36).",
                "synthesis_error": "Every vehicle and mount set, dots by vehicle: difference in "
                "shape, in scale, and at booming peaks (thesis, figure 37).",
            },
        ),
        tables=(
            Table(road, "Every vehicle and mount set. Notches rule the rms over all lines."),
            *_unpaired_10(tables["peaks"]),
        ),
    )


def _unpaired_10(peaks: pd.DataFrame) -> tuple[Table, ...]:
    """Peaks of one curve alone; no table without any."""
    alone = peaks[(peaks["comparison"] == ON_ROAD) & peaks["deviation [dB]"].isna()]
    if alone.empty:
        return ()
    shown = alone.drop(columns=["comparison", "deviation [dB]"]).rename(
        columns={name: name.replace("reference", "measured") for name in alone.columns}
    )
    shown = shown.rename(columns=lambda name: str(name).replace("compared", "synthesised"))
    return (Table(shown, "Booming peaks of one curve alone: they have no deviation."),)


def _forces(figures: Mapping[str, bytes]) -> Section:
    return Section(
        "Forces from response surfaces",
        "The same forces from the dynamic stiffness of the mounts and the measured motion. The "
        "surfaces are fitted to all runs but this one. Directions that are not identified keep "
        "their measured force.",
        figures=_pictures(
            figures,
            {
                "surface_forces": "SPL from measured bench forces and from the surfaces' forces "
                "(thesis, figure 38)."
            },
        ),
    )


def _design(
    result: Validation, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    design = result.design
    assert design is not None
    frame = tables["comparisons"]
    rows = frame[frame["comparison"].str.startswith(DESIGN)]
    outside = int(design.resolved.outside.sum())
    kept = f" Measured forces stay in {'; '.join(design.kept)}." if design.kept else ""
    return Section(
        "A virtual design",
        f"{design.mix}: every part was characterised in another mount set, and the bench measured "
        "the design itself for comparison. With the motion that was measured with the design the "
        "check is nearly circular. With the motion of "
        f"{design.other} nothing of the design is known but its parts. Re-solved, only the "
        f"excitation comes from {design.other}: inertia from the data sheet, stiffness from the "
        f"surfaces at the amplitude that comes out ({design.resolved.sweeps} sweeps; lines and "
        f"directions outside of the measured region: {outside}).{kept}",
        figures=_pictures(
            figures,
            {
                "virtual_design": "SPL of the design from its measured forces, and from the "
                "surfaces of its parts in three ways (thesis, figure 40); the dashes take turns.",
                "virtual_design_deviation": "The same levels less those of the measured forces, "
                "line by line.",
            },
        ),
        tables=(
            Table(
                rows.drop(
                    columns=[
                        "mount set",
                        "corr_f magnitude [%]",
                        "corr_s complex [%]",
                        "corr_s magnitude, over the reference [%]",
                    ]
                ),
                "Against the forces measured with the design on the bench.",
                {"corr_f complex [%]": 3, "corr_s magnitude [%]": 2},
            ),
        ),
    )


def _functions(
    result: Validation, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    frame = tables["comparisons"]
    rows = frame[frame["comparison"] == BY_HAMMER]
    first = result.shown[0].driven.title
    by_vehicle = rows.groupby("vehicle", sort=False)[
        ["corr_f complex [%]", "corr_s magnitude [%]", PEAK]
    ].median()
    return Section(
        "Hammer against loudspeaker, and contributions",
        "Both methods acquire the same functions with errors of their own: hammer against "
        "accelerometers and a calibrated volume source. Contributions of single paths exceed their "
        "sum where they cancel, so an error of one function is not an error of the sum by its "
        "size alone.",
        figures=_pictures(
            figures,
            {
                "hammer_reciprocal": "SPL with the same bench forces and functions of either "
                "method (thesis, figure 41).",
                "contributions": f"{first}: partial sums per mount along x, and of all "
                "paths across (thesis, figure 42). Groups 45 dB below the loudest line are left "
                "out.",
            },
        ),
        tables=(
            Table(by_vehicle.reset_index(), "Median over the mount sets."),
            Table(
                tables["contributions"],
                f"{first}, reciprocal functions: paths by their own A-weighted size in the "
                "band. The share of the energy counts the phase: below 0 a path takes away.",
            ),
        ),
    )


def _causes_10(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]) -> Section:
    frame = tables["causes"]
    medians = frame.groupby("what is compared", sort=False)[
        ["corr_f complex [%]", "corr_s magnitude [%]", PEAK]
    ].median()
    return Section(
        "Where the accuracy is lost",
        "Interface forces of the driven vehicle, found by inversion from accelerations on its "
        "body, are exact with the trimmed body's functions. What they predict better than bench "
        "forces is the cost of taking blocked forces; what they still miss is the error of the "
        "transfer functions and of the inversion. Where the truth is known each step "
        "stands alone. Accelerometers that took no part in the inversion judge its forces.",
        figures=_pictures(
            figures,
            {
                "causes": "Each step alone, dots by vehicle: difference in shape, in scale, and at "
                "booming peaks.",
                "interface_forces": "Forces along x of one vehicle: measured on the bench, found "
                "by inversion on the road, and the truth where it is known.",
            },
        ),
        tables=(
            Table(medians.reset_index(), "Median over the vehicles."),
            Table(tables["forces"], "Errors over the band, all directions together."),
        ),
    )


def _modes(
    result: Validation, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    more = [name for name in ("panel_contributions",) if name in tables]
    return Section(
        "Modes of the body",
        f"{result.shown[0].driven.vehicle.name}, from the loudspeaker's measurement (thesis, "
        "figure 43): poles by least squares on a common denominator over rising orders, clustered; "
        "shapes with residuals for the modes outside of the band.",
        figures=_pictures(figures, MODAL_FIGURES),
        tables=(
            Table(tables["modes"], "Median over the orders with its spread."),
            *(Table(tables[name], "Panels by mode.") for name in more),
        ),
    )


def _spread_10(result: Validation, figures: Mapping[str, bytes]) -> Section:
    spread = result.spread
    assert spread is not None
    return Section(
        "Vehicles of one drawing",
        f"The measured levels of {len(result.data.vehicles)} nominally identical vehicles lie "
        f"{spread.quantile(0.5):.1f} dB apart in the median line, {spread.quantile(0.9):.1f} dB "
        "in nine of ten. A synthesis that is to tell vehicles apart must be well below that.",
        figures=_pictures(
            figures, {"vehicle_spread": "SPL measured in every vehicle (thesis, figure 10)."}
        ),
    )


def _pictures(figures: Mapping[str, bytes], captions: Mapping[str, str]) -> tuple[Picture, ...]:
    return tuple(
        Picture(figures[stem], alt=caption, caption=caption)
        for stem, caption in captions.items()
        if stem in figures
    )


BAND = (20.0, 80.0)
"""The thesis finds five modes in it [Hz] (figure 43)."""

N_MODES = 5


@dataclass(frozen=True)
class Place:
    """A point whose motion was measured.

    Parameters
    ----------
    label : str
        Mount, piece of a mount, or panel.
    position : (x, y, z)
        [m].
    directions : mapping of str to (x, y, z)
        Output to the unit vector along which it is positive [1].
    """

    label: str
    position: tuple[float, float, float]
    directions: Mapping[str, tuple[float, float, float]]

    @property
    def is_panel(self) -> bool:
        """Whether it is known along its normal only."""
        return len(self.directions) == 1


@dataclass(frozen=True, eq=False)
class ModalPart:
    """Modal analysis of one vehicle.

    Parameters
    ----------
    vehicle : str
    measured : Frf
        Outputs ``<point> x y z`` and panels, inputs the ears [(m/s²)/(m³/s²)].
    chart : StabilisationChart
    model : ModalModel
        All modes of the band.
    places : tuple of Place
        Where the outputs are.
    panels : PanelContributions or None
        At the first ear; None without panels.
    n_modes : int
        Modes reported: those of lowest frequency.
    """

    vehicle: str
    measured: Frf
    chart: StabilisationChart
    model: ModalModel
    places: tuple[Place, ...]
    panels: PanelContributions | None
    n_modes: int

    @property
    def motion(self) -> ComplexArray:
        """Shapes as vectors in vehicle axes, shape (n_modes, n_place, 3), in a common phase [1]."""
        shapes = in_common_phase(self.model.shapes[: self.n_modes])
        vectors = np.zeros((len(shapes), len(self.places), 3), dtype=complex)
        for number, place in enumerate(self.places):
            for output, direction in place.directions.items():
                entry = shapes[:, self.model.outputs.index(output), np.newaxis]
                vectors[:, number] += entry * np.array(direction)
        return vectors


def body_motion_frf(vehicle: MeasuredVehicle) -> Frf:
    """Return how mount points and panels move under the loudspeaker.

    Returns
    -------
    Frf
        Outputs ``<point> x y z``, then panels; inputs the ears [(m/s²)/(m³/s²)]. Rotations of the
        virtual points are left out: their unit would have to be weighed against translations.
    """
    names: list[str] = []
    blocks = []
    for point in vehicle.points:
        seen = virtual_point(vehicle.geometry(point, Method.RECIPROCAL))
        blocks.append(virtual_point_frf(vehicle.reciprocal, response=seen).values[:, :3])
        names += [f"{point} {axis}" for axis in SENSOR_AXES]
    if vehicle.panels is not None:
        panels = vehicle.panels.motion
        if not np.array_equal(panels.frequency, vehicle.reciprocal.frequency):
            raise InputError(f"vehicle {vehicle.name}: panels and body sensors have other lines")
        blocks.append(panels.select(inputs=vehicle.ears).values)
        names += panels.outputs
    measured = vehicle.reciprocal
    values = np.concatenate(blocks, axis=1)
    return Frf(measured.frequency, values, tuple(names), measured.inputs, measured.unit)


def modal_part(
    vehicle: MeasuredVehicle, band: tuple[float, float] = BAND, n_modes: int = N_MODES
) -> ModalPart:
    """Identify the modes of a vehicle from the measurement with the loudspeaker.

    Parameters
    ----------
    vehicle : MeasuredVehicle
    band : tuple of float
        From, to [Hz]; wider than the modes asked for, so that those above have their own poles.
    n_modes : int
        To report, from the lowest.

    Returns
    -------
    ModalPart

    Raises
    ------
    InputError
        Fewer modes than asked for; else as `poles_over_orders`.
    """
    measured = body_motion_frf(vehicle)
    chart = poles_over_orders(measured, FrfForm.RECEPTANCE, band)
    clusters = pole_clusters(chart)
    if len(clusters) < n_modes:
        found = ", ".join(f"{cluster.frequency:.1f}" for cluster in clusters)
        raise InputError(
            f"vehicle {vehicle.name}: {len(clusters)} modes from {band[0]:g} to {band[1]:g} Hz "
            f"({found} Hz), {n_modes} asked for: widen the band or ask for fewer"
        )
    model = modal_model(measured, FrfForm.RECEPTANCE, band, clusters)
    panels = None
    if vehicle.panels is not None:
        panels = panel_contributions(model, vehicle.panels, vehicle.ears[0])
    return ModalPart(vehicle.name, measured, chart, model, _places(vehicle), panels, n_modes)


def _places(vehicle: MeasuredVehicle) -> tuple[Place, ...]:
    unit = {axis: row for axis, row in zip(SENSOR_AXES, np.eye(3).tolist(), strict=True)}
    places = [
        Place(
            point,
            vehicle.position(point),
            {f"{point} {axis}": (x, y, z) for axis, (x, y, z) in unit.items()},
        )
        for point in vehicle.points
    ]
    if vehicle.panels is not None:
        known = vehicle.panels
        for name, (x, y, z), (nx, ny, nz) in zip(
            known.names, known.positions.tolist(), known.normals.tolist(), strict=True
        ):
            places.append(Place(name, (x, y, z), {name: (nx, ny, nz)}))
    return tuple(places)


def truth_mac(part: ModalPart, truth: npt.ArrayLike, mount_points_only: bool = False) -> RealArray:
    """Compare the reported modes with true ones.

    Parameters
    ----------
    part : ModalPart
    truth : array, shape (n_true, n_output)
        In increasing frequency; columns as ``part.model.outputs``.
    mount_points_only : bool
        Leave the panels out, which move most.

    Returns
    -------
    array, shape (n_modes, n_true)
        Modal assurance criterion [1].
    """
    columns = list(range(len(part.model.outputs)))
    if mount_points_only:
        at_points = {
            name for place in part.places if not place.is_panel for name in place.directions
        }
        columns = [k for k, name in enumerate(part.model.outputs) if name in at_points]
    known = np.asarray(truth)
    if known.ndim != 2 or known.shape[1] != len(part.model.outputs):
        raise InputError(
            f"true shapes of shape {known.shape}: one row per mode, one column for each of the "
            f"{len(part.model.outputs)} outputs"
        )
    return mac_matrix(part.model.shapes[: part.n_modes][:, columns], known[:, columns])


def summary(part: ModalPart, truth: npt.ArrayLike | None = None) -> dict[str, float]:
    """Return ``mode_<n>_hz`` and, against true shapes, ``mode_<n>_mac``, n from 1."""
    numbers = {
        f"mode_{n}_hz": float(value)
        for n, value in enumerate(part.model.frequency[: part.n_modes], 1)
    }
    if truth is not None:
        agreement = np.diag(truth_mac(part, truth))
        numbers |= {f"mode_{n}_mac": float(value) for n, value in enumerate(agreement, 1)}
    return numbers


def modal_tables(part: ModalPart, truth: npt.ArrayLike | None = None) -> dict[str, pd.DataFrame]:
    """Return the modes with their spread over the orders and, if known, each panel's share."""
    clusters = part.model.clusters[: part.n_modes]
    numbers = [f"mode {n}" for n in range(1, len(clusters) + 1)]
    modes = pd.DataFrame(
        {
            "mode": numbers,
            "frequency [Hz]": [c.frequency for c in clusters],
            "spread of frequency [Hz]": [c.frequency_spread for c in clusters],
            "damping ratio [%]": [100 * c.damping for c in clusters],
            "spread of damping [%]": [100 * c.damping_spread for c in clusters],
            "orders that agree [%]": [100 * c.share for c in clusters],
            "complexity 1 - MPC [%]": 100 * part.model.complexity[: part.n_modes],
            "residues of one shape [%]": 100 * part.model.rank_one[: part.n_modes],
        }
    )
    if truth is not None:
        modes["MAC with the truth [1]"] = np.diag(truth_mac(part, truth))
        modes["MAC of mount points [1]"] = np.diag(truth_mac(part, truth, mount_points_only=True))
    tables = {"modes": modes}
    if part.panels is not None:
        shares = pd.DataFrame(
            100 * part.panels.shares[: part.n_modes],
            columns=[f"{panel} [%]" for panel in part.panels.panels],
        )
        shares.insert(0, "mode", numbers)
        tables["panel_contributions"] = shares
    return tables


N_REBUILT = 4
"""FRFs shown beside the rebuilt ones: the mount directions and panels that move most."""


def modal_figures(part: ModalPart, truth: npt.ArrayLike | None = None) -> dict[str, bytes]:
    """Draw a modal analysis.

    Parameters
    ----------
    part : ModalPart
    truth : array, shape (n_true, n_output), optional
        True shapes in increasing frequency; columns as ``part.model.outputs``.

    Returns
    -------
    dict of str to bytes
        ``stabilisation``, ``mode_shapes``, ``rebuilt``, then ``mac`` with a truth and
        ``panel_contributions`` with panels; PNG.
    """
    figures = {
        "stabilisation": _stabilisation(part),
        "mode_shapes": mode_shapes(body_motion(part)),
        "rebuilt": _rebuilt(part),
    }
    modes = [f"{value:.1f} Hz" for value in part.model.frequency[: part.n_modes]]
    if truth is not None:
        values = truth_mac(part, truth)
        columns = [f"true {number}" for number in range(1, values.shape[1] + 1)]
        figures["mac"] = matrix_map(values, modes, columns, value_label="MAC [1]")
    if part.panels is not None:
        shares = 100 * part.panels.shares[: part.n_modes]
        figures["panel_contributions"] = matrix_map(
            shares,
            modes,
            part.panels.panels,
            value_label=f"share of the pressure at the {part.panels.ear} [%]",
            limits=(-100.0, 100.0),
            decimals=0,
        )
    return figures


def moving_shapes(part: ModalPart) -> bytes:
    """Return the reported modes in motion, an animated GIF."""
    return moving_mode_shapes(body_motion(part))


def body_motion(part: ModalPart) -> BodyMotion:
    """Return points, normals and shapes as the figures of shapes read them."""
    normals = np.zeros((len(part.places), 3))
    for row, place in enumerate(part.places):
        if place.is_panel:
            normals[row] = next(iter(place.directions.values()))
    modes = zip(part.model.frequency, part.model.damping, strict=True)
    return BodyMotion(
        [place.label for place in part.places],
        np.array([place.position for place in part.places]),
        normals,
        [f"{f:.1f} Hz, ζ {100 * zeta:.1f} %" for f, zeta in list(modes)[: part.n_modes]],
        part.motion,
    )


def _stabilisation(part: ModalPart) -> bytes:
    low, high = part.chart.band
    lines = (part.measured.frequency >= low) & (part.measured.frequency <= high)
    total = np.sqrt(np.sum(np.abs(part.measured.values[lines]) ** 2, axis=(1, 2)))
    return stabilisation_chart(
        part.measured.frequency[lines],
        20 * np.log10(total),
        part.chart.frequency,
        part.chart.order,
        part.chart.stable,
        part.model.frequency,
        level_label="all |a/Q̇|, root of sum of squares [dB re 1/m²]",
    )


def _rebuilt(part: ModalPart) -> bytes:
    """Show the strongest output of each of the strongest places, at the first ear."""
    rebuilt = part.model.rebuilt
    lines = np.isin(part.measured.frequency, rebuilt.frequency)
    measured = part.measured.values[lines][:, :, 0]
    energy = np.sum(np.abs(measured) ** 2, axis=0)
    outputs = list(part.measured.outputs)
    strongest = [
        max((outputs.index(name) for name in place.directions), key=lambda k: float(energy[k]))
        for place in part.places
    ]
    points = [k for k, place in zip(strongest, part.places, strict=True) if not place.is_panel]
    panels = [k for k, place in zip(strongest, part.places, strict=True) if place.is_panel]
    chosen = [
        *sorted(points, key=lambda k: -float(energy[k]))[: N_REBUILT if not panels else 2],
        *sorted(panels, key=lambda k: -float(energy[k]))[:2],
    ]
    frames = [
        CurvePanel(
            f"{outputs[k]}, error {100 * part.model.error[k, 0]:.1f} %",
            rebuilt.frequency,
            {
                "measured": 20 * np.log10(np.abs(measured[:, k])),
                "modes and residuals": 20 * np.log10(np.abs(rebuilt.values[:, k, 0])),
            },
        )
        for k in chosen
    ]
    return curve_panels(
        frames,
        x_label="frequency [Hz]",
        y_label="|a/Q̇| [dB re 1/m²]",
        columns=2,
        dashed=("modes and residuals",),
    )


def synthesis_validation_result(
    data: ValidationData,
    ear: str,
    band: tuple[float, float],
    *,
    with_figures: bool = True,
) -> StudyResult:
    """Compare, and make tables, figures, headline numbers and page.

    Parameters
    ----------
    data : ValidationData
        Bench and vehicles.
    ear : str
        To listen at.
    band : (lower, upper)
        Lines that are compared; both edges belong to the band [Hz].
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        Table ``validation`` with every figure beside the thesis and the target; ``comparisons``,
        ``peaks``, ``causes``, ``forces``, ``contributions`` and those of the modal analysis.

    Raises
    ------
    InputError
        Data that do not fit together, an ear that was not measured.
    """
    with threadpool_limits(1):  # its matrices are too small to share
        result = validate(data, Listening(ear, band))
        part, complaint = _modes_13(result)
        truth = _true_shapes(result, part)
        modes: dict[str, Scalar] = {} if part is None else dict(summary(part, truth))
        comparisons, causes, forces = (
            table(result) for table in (comparison_table, cause_table, force_table)
        )
        against = _against_truth(result, part)
        found = criteria(result, comparisons, causes, forces, modes, against)
        tables = {
            "validation": criteria_table(found),
            "comparisons": comparisons,
            "peaks": peak_table(result),
            "contributions": _ranking(result),
        }
        if len(causes):
            tables |= {"causes": causes, "forces": forces}
        if part is not None:
            tables |= modal_tables(part, truth)
        figures: dict[str, bytes] = {}
        if with_figures:
            figures = validation_figures(result, comparisons, causes)
            if part is not None:
                figures |= modal_figures(part, truth)
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=headline_numbers(result, comparisons, modes),
        page=validation_page(result, found, tables, figures, complaint),
        inputs=data.input_files,
        facts=_facts(result, complaint),
    )


def _modes_13(result: Validation) -> tuple[ModalPart | None, str]:
    """Modes of the first vehicle's body, or why there are none."""
    try:
        return modal_part(result.shown[0].driven.vehicle), ""
    except InputError as error:
        return None, str(error)


def _true_shapes(result: Validation, part: ModalPart | None) -> RealArray | None:
    truth = result.shown[0].driven.truth
    if part is None or truth is None:
        return None
    return truth.mode_shapes(len(part.model.outputs))


def _against_truth(result: Validation, part: ModalPart | None) -> ModesAgainstTruth | None:
    """Give every mode that was found the nearest true one, and see which of these are left."""
    truth = result.shown[0].driven.truth
    if part is None or truth is None:
        return None
    found = part.model.frequency[: part.n_modes]
    true = truth.natural_frequency
    nearest = np.abs(np.subtract.outer(found, true)).argmin(axis=1)
    damping = part.model.damping[: part.n_modes] / truth.damping_ratio[nearest]
    return ModesAgainstTruth(
        frequency=float(np.max(np.abs(found / true[nearest] - 1))),
        damping=float(np.max(np.abs(damping - 1))),
        missed=len(set(range(part.n_modes)) - set(nearest.tolist())),
    )


def _ranking(result: Validation) -> pd.DataFrame:
    """Paths of the first vehicle in order of what they bring."""
    ranking = result.shown[0].reciprocal.ranking(Measure.MAGNITUDE, result.listening.band)
    return pd.DataFrame(
        {
            "path": [one.path for one in ranking.paths],
            "rms contribution [Pa]": [one.magnitude for one in ranking.paths],
            "share of the energy [%]": [100 * one.energy_share for one in ranking.paths],
        }
    )


def _facts(result: Validation, complaint: str) -> dict[str, Scalar]:
    data = result.data
    facts: dict[str, Scalar] = {
        "run": data.run,
        "ear": result.listening.ear,
        "vehicles": _words([one.vehicle.name for one in data.vehicles]),
        "mount_sets": _words([name for name in data.sets if name not in data.mixes]),
        "held_out": "surfaces are fitted to all runs but the one that is looked at",
        "transfer_functions": "reciprocal",
    }
    if result.design is not None:
        design = result.design
        facts |= {
            "virtual_design": design.mix,
            "virtual_design_other_set": design.other,
            "virtual_design_sweeps": design.resolved.sweeps,
            "virtual_design_lines_outside": int(design.resolved.outside.sum()),
        }
    if complaint:
        facts["no_modal_analysis"] = complaint
    return facts


def _words(names: Sequence[str]) -> str:
    return ", ".join(names)
