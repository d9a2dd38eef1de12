"""What a synthesis is validated with: mounts on the bench, the same mounts in driven vehicles."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from deboom.bench.campaign_plan import training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.fleet import load_fleet
from deboom.bench.mount_sets import mount_names
from deboom.bench.parameters import load_bench
from deboom.bench.platform_layout import LOAD_CASES
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import InputError
from deboom.files.vehicle import read_vehicle
from deboom.measurement.campaign import Campaign
from deboom.measurement.measured_vehicle import MeasuredVehicle
from deboom.study.progress import Progress
from deboom.study.synthesis_validation_bench import BenchSet, bench_sets
from deboom.study.synthesis_validation_truth import VehicleTruth, read_vehicle_truth

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
    mix = "-".join(f"{m}{1 + k % n_sets}" for k, m in enumerate(mount_names(load_bench())))
    on_bench = n_sets + 1
    total = 2 * on_bench + n_vehicles * n_sets
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary)
        progress(0, total, "mounts on the bench")
        write_campaign(folder / "bench", seed, training_plan(*sets, mix))
        campaign, benches = bench_sets(
            folder / "bench",
            plan.gear,
            plan.torque_limit,
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
