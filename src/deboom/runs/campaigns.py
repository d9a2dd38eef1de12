"""Campaigns into the library, runs into order spectra, benches and cars given or virtual."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray
from deboom.bench.campaign import (
    NO_ERRORS,
    TRAINING_RUNS,
    CampaignErrors,
    CampaignPlan,
    training_plan,
)
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.families import draw_family
from deboom.bench.fleet import load_fleet
from deboom.bench.layout import LOAD_CASES
from deboom.bench.powertrain import DRAWING, load_bench
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import InputError
from deboom.files.campaign import (
    CAMPAIGN_FILE,
    CampaignFile,
    add_operating_run,
    new_run_file,
    read_campaign,
    read_time_run,
)
from deboom.files.library_export import write_library_json
from deboom.files.run_folder import hash_files
from deboom.files.schema import load_toml
from deboom.files.truth import read_set_truth, read_vehicle_truth
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.measurement.order_tracking import (
    DEFAULT_TRACKING,
    TrackedRun,
    TrackingOptions,
    tracked_run,
)
from deboom.mounts.characterise import (
    STEPS,
    Characterisation,
    CharacteriseOptions,
    characterise,
    measuring_chains,
)
from deboom.mounts.characterised_bench import CharacterisedBench
from deboom.mounts.characterised_mount import CharacterisedMount, MapPoints
from deboom.mounts.library import MountLibrary, open_library
from deboom.mounts.mounts_in_car import MountsInCar, mounts_in_car
from deboom.pages.mounts_in_car import MeasuredInCar
from deboom.progress import Progress
from deboom.vehicles.synthesis import DrivenVehicle, DrivenVehicles, VehicleTruth, bench_sets


def characterise_into_library(
    folder: Path,
    library: str,
    options: CharacteriseOptions,
    progress: Progress,
    *,
    mount_sets: Sequence[str] = (),
    overwrite: bool = False,
) -> tuple[Characterisation, ...]:
    """Characterise mount sets of a campaign and keep their mounts: all of them, or none.

    - `library`: SQLite file, made where it is missing, or database URL.
    - `mount_sets`: by default all of the campaign.
    - `overwrite`: whether mounts that are in the library already are exchanged.
    - raises InputError: a campaign that cannot be read or characterised or lacks a set, a library
      that cannot be written, or mounts that are there already; the latter before any work.
    """
    # the whole campaign, so that its record does not depend on the sets asked for
    campaign = read_campaign(folder)
    for name in mount_sets:
        campaign.runs_of(name)
    wanted = tuple(dict.fromkeys(mount_sets)) or campaign.mount_sets
    total = 1 + len(STEPS) * len(wanted)
    # one thread: the matrices are too small to share
    with open_library(library, create=True) as opened, threadpool_limits(1):
        if not overwrite:
            _refuse_present(opened, campaign.name, wanted)
        progress(0, total, "measuring chains")
        chains = measuring_chains(campaign, options)
        results = []
        for place, name in enumerate(wanted):

            def step(done: int, _of: int, text: str, place: int = place, name: str = name) -> None:
                progress(1 + place * len(STEPS) + done, total, f"{name}: {text}")

            results.append(characterise(campaign, name, options, step, chains))
        record = results[0].record(hash_files(campaign.input_files, relative_to=folder))
        opened.add([record], [m for of_set in results for m in of_set.mounts], replace=overwrite)
    return tuple(results)


def described(result: Characterisation) -> str:
    """Say in a few lines how far each direction of a mount set may be believed."""
    lines = [f"mount set {result.mount_set}, {len(result.runs)} runs"]
    lines += [f"  ALARM: {alarm}" for alarm in result.alarms]
    lines += [f"  ASSUMED: {sentence}" for sentence in result.campaign.assumed]
    for name, direction in result.directions.items():
        if direction.budget is None:
            lines.append(f"  {name:8} not identified: {direction.complaint or 'no error budget'}")
            continue
        word = "identified" if direction.budget.identified else "not identified"
        if direction.budget.contradicted:
            word += ": see the alarm for its mount"
        width = 100 * direction.budget.half_width_95
        lines.append(f"  {name:8} ± {width:.1f} % of |K| (95 %), {word}")
    return "\n".join(lines)


def _refuse_present(opened: MountLibrary, campaign: str, wanted: Sequence[str]) -> None:
    present = [
        identity for identity in opened.identities(campaign=campaign) if identity.variant in wanted
    ]
    if present:
        raise InputError(
            f"{opened.name}: {replace(present[0], supplier='')} and {len(present) - 1} more are "
            "there already: exchange them with --replace, or choose other mount sets"
        )


LIBRARY_STEPS = 2 + len(STEPS)
"""Measuring, reading, and the steps of the characterisation."""


def write_platform_library(
    path: Path,
    seed: int,
    progress: Progress,
    truth_seed: int = 1,
    tilt: float = 0.0,
    family: str = "",
) -> Path:
    """Measure the parts of a virtual platform on its bench, characterise and export them.

    - `path`: JSON, `deboom.vehicles.platform.LIBRARY_FILE` in the platform's folder.
    - `family`: as of `deboom.bench.platform_writer.write_platform`.
    - Map points stay out: they are a hundred times as long, and forces come from the surfaces.
    - raises InputError: seed below 1, or a file that cannot be written.
    """
    progress(0, LIBRARY_STEPS, "measuring the mounts")
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary) / "campaign"
        bench, drawn = load_bench(truth_seed, tilt), draw_family(family, seed, truth_seed)
        write_campaign(folder, seed, training_plan(DRAWING), bench=bench, family=drawn)
        progress(1, LIBRARY_STEPS, "reading")
        campaign = read_campaign(folder, (DRAWING,))

        def step(done: int, _total: int, text: str) -> None:
            progress(2 + done, LIBRARY_STEPS, f"mounts: {text}")

        result = characterise(campaign, DRAWING, progress=step)
        record = result.record(hash_files(campaign.input_files, relative_to=folder))
    write_library_json(path, [record], [without_map(mount) for mount in result.mounts])
    return path


def without_map(mount: CharacterisedMount) -> CharacterisedMount:
    """Return a mount without its single measured points."""
    directions = tuple(
        replace(direction, map_points=MapPoints.none()) for direction in mount.directions
    )
    return replace(mount, directions=directions)


def orders_into_campaign(
    folder: Path,
    time_run: str,
    options: TrackingOptions = DEFAULT_TRACKING,
    name: str | None = None,
) -> tuple[TrackedRun, Path]:
    """Track the order of a run over time and add it to the campaign's operating runs.

    - `time_run`: one of its ``[[time_runs]]``; `name`: of the operating run, by default the same.
    - returns what was added and how far it may be believed, and its file.
    - raises InputError: no such time run; an operating run of that name, before any work; a tacho
      or a range of speeds that cannot be tracked; a campaign that cannot be written.
    """
    recorded = read_time_run(folder, time_run)
    new_run_file(folder, recorded.mount_set, name or recorded.name)
    tracked = tracked_run(recorded, options, name)
    how = f"Vold-Kalman filter, bandwidth {options.bandwidth:g} Hz"
    smear = f"{how}, smear up to {tracked.order.smear.max():.2g} Hz"
    path = add_operating_run(folder, tracked.run, (f"from time run {time_run}", smear))
    return tracked, path


def track_untracked(folder: Path, say: Callable[[str], None]) -> None:
    """Track every run over time that is not yet an operating run of the same name and mount set.

    - `folder`: holds ``campaign.toml``.
    - `say`: called with each line of the reports.
    - raises InputError: as `orders_into_campaign`; runs that were tracked before stay.
    """
    file = load_toml(Path(folder) / CAMPAIGN_FILE, CampaignFile)
    for entry in file.untracked_runs:
        tracked, path = orders_into_campaign(folder, entry.name)
        for line in described_orders(entry.name, tracked, path):
            say(line)


def described_orders(time_run: str, tracked: TrackedRun, path: Path) -> list[str]:
    """Say what was made of a run over time and how far it may be believed, line by line."""
    run = tracked.run
    return [
        f"{time_run} -> run {run.name} of mount set {run.mount_set}, {path.as_posix()}",
        *(f"  {line}" for line in tracked.report()),
    ]


VIRTUAL_GROUP = "U06"
"""Of the virtual fleet: vehicles of one drawing, of which the last carries a battery."""


def given_vehicles(
    folder: Path, folders: Sequence[Path], mount_set: str, run: str, progress: Progress
) -> DrivenVehicles:
    """Take a user's own campaign, and vehicles that were driven with one of its mount sets.

    - `folder`: of the campaign; each of its sets has a full-load run of the same gear and torque
      limit, and another run.
    - `folders`: of the vehicles, at least one; of one drawing.
    - `mount_set`: under their powertrains.
    - `run`: name of the vehicles' run.
    - raises InputError: folders that cannot be read or do not fit together, no vehicle, run or set.
    """
    if not folders:
        raise InputError("there is no vehicle to listen in: name at least one with --vehicle")
    progress(0, 1, "vehicles")
    driven = [_driven(car, run, mount_set) for car in folders]
    road = driven[0].vehicle.run(run)
    progress(0, 1, "reading the bench's files")
    campaign = read_campaign(folder)
    if mount_set not in campaign.mount_sets:
        raise InputError(
            f"{folder}: the vehicles' mount set '{mount_set}' was not on the bench, use one of "
            f"{list(campaign.mount_sets)}"
        )
    campaign.needed_mass_matrix("the motion of the engine in a vehicle")  # before long work
    benches = bench_sets(campaign, road.gear, road.torque_limit, progress)
    progress(len(benches), len(benches), "")
    files = [path for car in folders for path in sorted(car.rglob("*")) if path.is_file()]
    inputs = (*campaign.input_files, *dict.fromkeys(files))
    return DrivenVehicles(campaign, run, benches, tuple(driven), inputs)


def virtual_vehicles(
    seed: int,
    n_vehicles: int,
    n_sets: int,
    run: str,
    progress: Progress,
    *,
    truth_seed: int = 1,
    family: str = "",
) -> DrivenVehicles:
    """Measure mount sets on the virtual bench, drive them in virtual cars, and keep no files.

    - `seed`: of all errors, from 1.
    - `n_vehicles`, `n_sets`: vehicles of one group, and mount sets ``M1``, ``M2``, …; every vehicle
      drives with every set. The bench measures a mix of the sets as well.
    - `run`: such as ``g5_wot220``.
    - `truth_seed`: of powertrain, mounts and bodies, 1 for the frozen ones.
    - `family`: bodies, rubber and laboratory, see `deboom.bench.families.draw_family`.
    - raises InputError: more vehicles than the group has, fewer than two mount sets, an unknown
      run or family, a seed below 1.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    names = [name for name in load_fleet(truth_seed).bodies if name.startswith(f"{VIRTUAL_GROUP}-")]
    if not 1 <= n_vehicles <= len(names):
        raise InputError(f"{n_vehicles} vehicles: group {VIRTUAL_GROUP} has 1 to {len(names)}")
    if n_sets < 2:
        raise InputError(f"{n_sets} mount sets make no virtual design: take at least 2")
    plan = next((plan for plan in LOAD_CASES if plan.name == run), None)
    if plan is None:
        raise InputError(f"there is no run '{run}', use {[plan.name for plan in LOAD_CASES]}")
    sets = [f"M{k}" for k in range(1, n_sets + 1)]
    truth, drawn = load_bench(truth_seed), draw_family(family, seed, truth_seed)
    mounts = truth.mounts
    mix = "-".join(f"{mount.name}{1 + k % n_sets}" for k, mount in enumerate(mounts))
    on_bench = n_sets + 1
    total = 2 * on_bench + n_vehicles * n_sets

    def characterising(done: int, _: int, text: str) -> None:
        progress(on_bench + done, total, text)

    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary)
        progress(0, total, "mounts on the bench")
        runs = training_plan(*sets, mix)
        write_campaign(folder / "bench", seed, runs, bench=truth, family=drawn)
        campaign = read_campaign(folder / "bench")
        benches = bench_sets(campaign, plan.gear, plan.torque, characterising)
        driven = []
        for number, name in enumerate(names[:n_vehicles]):
            for place, parts in enumerate(sets):
                progress(2 * on_bench + number * n_sets + place, total, f"{name} with {parts}")
                car = folder / f"{name}_{parts}"
                struck = place == number % n_sets  # accelerances are large: with one set only
                write_vehicle(
                    car,
                    seed,
                    name,
                    parts,
                    load_cases=(plan,),
                    accelerance=struck,
                    truth_seed=truth_seed,
                    family=family,
                )
                driven.append(_driven(car, run, parts))
    progress(total, total, "")
    return DrivenVehicles(campaign, run, benches, tuple(driven))


def mounts_in_given_car(folder: Path, seed: int, progress: Progress) -> MeasuredInCar:
    """Find the stiffness of the mounts of a user's car, and the truth where there is one.

    - `folder`: of the vehicle; `seed`: of the draws of the intervals.
    - raises InputError: a vehicle that cannot be read, see `mounts_in_car`.
    """
    progress(0, 2, "reading the car")
    vehicle = read_vehicle(folder)
    progress(1, 2, "stiffness of the mounts")
    with threadpool_limits(1):  # its matrices are too small to share
        result = mounts_in_car(vehicle, seed=seed)
    progress(2, 2, "")
    truth = {}
    for run in result.runs:
        arrays = read_vehicle_truth(folder, run.name)
        if arrays is not None:
            truth[run.name] = _true_stiffness(arrays[0], result)
    files = tuple(path for path in sorted(folder.rglob("*")) if path.is_file())
    measured = [path for path in files if path.parent.name != "truth"]
    return MeasuredInCar(result, truth, hash_files(measured, relative_to=folder), files)


def mounts_in_virtual_car(
    seed: int, progress: Progress, *, truth_seed: int = 1, family: str = ""
) -> MeasuredInCar:
    """Measure a virtual car and find the stiffness of its mounts; keep no files.

    - `seed`: of all errors, from 1.
    - `truth_seed`, `family`: as of `virtual_vehicles`.
    """
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary) / "car"
        progress(0, 2, "measuring the car")
        write_vehicle(folder, seed, truth_seed=truth_seed, family=family)
        return replace(mounts_in_given_car(folder, seed, progress), inputs=())


def _true_stiffness(driven: Mapping[str, Any], result: MountsInCar) -> ComplexArray:
    """Return the true stiffness of each direction; pieces are alike."""
    channels = driven["channels"].tolist()
    columns = []
    for mount in result.vehicle.mounts:
        columns += [channels.index(mount.channels(axis)[0]) for axis in mount.transfer_axes]
    return np.asarray(driven["stiffness"][:, columns])


def _driven(folder: Path, run: str, mount_set: str) -> DrivenVehicle:
    """Read a vehicle with its run, and its truth where there is one."""
    vehicle = read_vehicle(folder)
    vehicle.run(run)  # it must be there
    return DrivenVehicle(vehicle, _truth(folder, run), mount_set)


def _truth(folder: Path, run: str) -> VehicleTruth | None:
    """Read the truth of a virtual vehicle; None for a vehicle that nobody knows the truth of."""
    arrays = read_vehicle_truth(folder, run)
    if arrays is None:
        return None
    driven, body = arrays
    frequency = driven["frequency"].real
    ears, interfaces = (tuple(body[name].tolist()) for name in ("ears", "interfaces"))
    transfer = body["noise_transfer"]
    at_interfaces = body["shapes_at_interfaces"][:, :, :3]
    return VehicleTruth(
        force=Spectrum(frequency, driven["force"], tuple(driven["channels"].tolist()), "N"),
        pressure=Spectrum(frequency, driven["pressure_of_mounts"], ears, "Pa"),
        noise_transfer=Frf(
            body["frequency"],
            transfer.reshape(*transfer.shape[:2], -1),
            ears,
            tuple(f"{name} {load}" for name in interfaces for load in POINT_LOADS),
            "Pa/N",
        ),
        natural_frequency=body["natural_frequencies"],
        damping_ratio=body["damping_ratios"],
        shapes=np.hstack([at_interfaces.reshape(len(at_interfaces), -1), body["shapes_at_panels"]]),
    )


STEPS_PER_BENCH = 2 + len(STEPS)
"""Measuring, reading, and the steps of the characterisation."""


def characterise_given(
    folder: Path,
    mount_set: str,
    options: CharacteriseOptions,
    progress: Progress,
    title: str | None = None,
) -> CharacterisedBench:
    """Characterise one mount set of a campaign and find the truth, if there is any.

    - `folder`: of the campaign.
    - `mount_set`: parts on the bench.
    - `options`: how.
    - `title`, optional: of the bench; by default the name of the folder.
    - raises InputError: a campaign that cannot be read or characterised.
    """
    title = title or Path(folder).name
    progress(1, STEPS_PER_BENCH, f"{title}: reading")
    campaign = read_campaign(folder, (mount_set,))

    def step(done: int, _total: int, text: str) -> None:
        progress(2 + done, STEPS_PER_BENCH, f"{title}: {text}")

    begin = time.perf_counter()
    result = characterise(campaign, mount_set, options, step)
    seconds = time.perf_counter() - begin
    return CharacterisedBench(title, result, read_set_truth(folder, mount_set), seconds)


def characterise_virtual(
    seed: int,
    mount_set: str,
    options: CharacteriseOptions,
    progress: Progress,
    *,
    noise_free: bool = False,
) -> CharacterisedBench:
    """Measure the training runs on a virtual bench, characterise them, and keep no files.

    - `noise_free`: without noise and with every sensor as stated: what is left is the error of the
      method.
    - raises InputError: a seed below 1, or an unknown mount set.
    """
    title = f"bench {seed}"
    progress(0, STEPS_PER_BENCH, f"{title}: measuring")
    plan = CampaignPlan((mount_set,), TRAINING_RUNS)
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary) / "campaign"
        write_campaign(folder, seed, plan, NO_ERRORS if noise_free else CampaignErrors())
        return characterise_given(folder, mount_set, options, progress, title)
