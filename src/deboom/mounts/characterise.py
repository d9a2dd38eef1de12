"""Characterisation: from a campaign's raw channels to characterised mounts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import AXES, RealArray, short_repr
from deboom.errors import InputError
from deboom.measurement.campaign import Campaign, MeasuredMount, OperatingRun
from deboom.measurement.culprit import culprit_of_responses, explain_rotation_order
from deboom.measurement.quality import LARGEST_INCONSISTENCY, geometric_consistency
from deboom.mounts.characterised_mount import (
    ASSUMED,
    FORCE_PER_TORQUE,
    CampaignRecord,
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.cross_stiffness import CrossStiffness, cross_stiffness_of_maps
from deboom.mounts.error_budget import LEAST_DRAWS, DirectionBudget, error_budget
from deboom.mounts.library_tables import direction_table
from deboom.mounts.measuring_chain import (
    AlignmentEstimate,
    InstrumentedBody,
    alignment,
    bench_mode,
    body_record,
    instrumented_bodies,
    stated_alignment,
)
from deboom.mounts.mount import Mount
from deboom.mounts.operating_map import OperatingMap, Preload, operating_maps
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.mounts.self_calibration import FreeBody, self_calibrated
from deboom.progress import Progress
from deboom.tabled import Tabled

SCATTER = "scatter of the force transfer matrix [1]"
STEPS = ("measuring chains", "operating maps", "response surfaces", "error budget")

TOLERANCE_UNITS = {
    "sensor_position": "m",
    "sensor_angle": "rad",
    "acceleration_floor": "m/s^2",
    "force_floor": "N",
    "shaker_angle": "rad",
    "torque": "N m",
    "static_force": "N",
}
"""Units of the tolerances that are not plain numbers."""


@dataclass(frozen=True)
class CharacteriseOptions:
    """How mounts are characterised.

    - `gears`: gears whose runs the surfaces are fitted to; None takes all.
    - `preload`: variable of the surfaces.
    - `regressor`: pieces of the surfaces.
    - `self_calibration`: whether rigid motion and Newton's law improve the stated alignment.
    - `excitation_deviation`: standard deviation of the direction of the loads that excite the
      powertrain, `Campaign.excited`, per axis [rad].
    - `draws`: draws of the error budget.
    - `seed`: seed of the error budget, from 1.
    """

    gears: tuple[int, ...] | None = (5, 6, 7)
    preload: Preload = Preload.WHEEL_TORQUE
    regressor: PiecewiseCubicRegressor = field(default_factory=PiecewiseCubicRegressor)
    self_calibration: bool = True
    excitation_deviation: float = math.radians(0.2)
    draws: int = LEAST_DRAWS
    seed: int = 1


DEFAULT_OPTIONS = CharacteriseOptions()


@dataclass(frozen=True, eq=False)
class DirectionResult:
    """Result for one direction.

    `surface` over the lines that are not near the floor and its uncertainty; where there is no
    surface, `complaint` says why.
    """

    measured: OperatingMap
    surface: DynamicStiffnessSurface | None = None
    budget: DirectionBudget | None = None
    complaint: str = ""


@dataclass(frozen=True, eq=False)
class Characterisation(Tabled):
    """Results for one mount set of a campaign.

    `runs` are those that the surfaces were fitted to, `chains` one per body, `directions` the
    results by ``<mount> <axis>``, `cross_stiffness` says of each mount with three measured axes
    whether it seems to stand at another angle than is stated.

    See Also
    --------
    deboom.characterise, deboom.compare_models, deboom.open_library
    """

    campaign: Campaign
    mount_set: str
    runs: tuple[OperatingRun, ...]
    chains: tuple[AlignmentEstimate, ...]
    directions: dict[str, DirectionResult]
    options: CharacteriseOptions
    cross_stiffness: tuple[CrossStiffness, ...] = ()

    __repr__ = short_repr

    @property
    def table(self) -> pd.DataFrame:
        """One row per direction, as `deboom.mounts.library_tables.direction_table`."""
        return direction_table(self.mounts)

    @property
    def mounts(self) -> tuple[CharacterisedMount, ...]:
        """Mounts as the library keeps them."""
        return tuple(self._characterised_mount(mount) for mount in self.campaign.mounts)

    @property
    def alarms(self) -> tuple[str, ...]:
        """Sentences on what the measurement contradicts.

        Directions of measuring chains that contradict Newton's law are withdrawn, those of a mount
        whose force its own displacements do not explain, which is named with its likely angle, and
        those of mounts whose force a mode of the test bench changes where no shaker was.
        """
        of_chains = [
            alarm for chain in self.chains for alarm in chain.alarms(self.campaign.excited)
        ]
        of_mounts = [mount.sentence for mount in self.cross_stiffness if mount.clear]
        points = [point for chain in self.chains for point in chain.alignment.body.points]
        of_bench = [text for text, denies in bench_mode(points, _lines(self.runs)) if denies]
        return (*of_chains, *of_mounts, *of_bench)

    def record(self, inputs_sha256: Mapping[str, str]) -> CampaignRecord:
        """Return the library's record of the campaign, with the hash of every input file."""
        stated = self.campaign.tolerances
        return CampaignRecord(
            name=self.campaign.name,
            order=self.campaign.order,
            runs=tuple(run.name for run in self.campaign.runs),
            tolerances={
                f"{item.name} [{TOLERANCE_UNITS.get(item.name, '1')}]": getattr(stated, item.name)
                for item in fields(stated)
            },
            inputs_sha256=inputs_sha256,
            test_temperature=self.campaign.test_temperature,
        )

    def _characterised_mount(self, mount: MeasuredMount) -> CharacterisedMount:
        quality = {SCATTER: 0.0}
        for chain in self.chains:
            points = [p for p in chain.alignment.body.points if p.mount == mount.name]
            scatter = [float(point.transfer_scatter.max()) for point in points]
            quality[SCATTER] = max([quality[SCATTER], *scatter])
            if points:
                quality |= {f"misfit of {group} [1]": value for group, value in chain.misfit}
        directions = [
            self._characterised_direction(mount.name, axis)
            for axis in AXES
            if f"{mount.name} {axis}" in self.directions
        ]
        part = Mount(
            name=mount.name,
            description=mount.description,
            pieces=mount.pieces,
            positions=mount.positions,
            transfer_axes=mount.transfer_axes,
            rotations=mount.rotations,
        )
        identity = MountIdentity(self.campaign.name, mount.name, self.mount_set)
        return CharacterisedMount(identity, part, tuple(directions), quality)

    def _characterised_direction(self, mount: str, axis: str) -> CharacterisedDirection:
        """One direction; its lines near the floor have no confidence."""
        result, options = self.directions[f"{mount} {axis}"], self.options
        measured, surface, budget = result.measured, result.surface, result.budget
        curves = {(c.mount_set, c.mount, c.axis): c for c in self.campaign.static_curves}
        quality, settings = DirectionQuality(identified=False), {}
        if surface is not None and budget is not None:
            r_squared = surface.r2_real_, surface.r2_imag_, surface.r2_force_
            quality = DirectionQuality(budget.identified, budget.half_width_95, *r_squared)
            # a line through zero
            force, torque = measured.preload(Preload.STATIC_FORCE), measured.wheel_torque
            settings = {
                "preload": options.preload.value,
                "gears": "all" if options.gears is None else ", ".join(map(str, options.gears)),
                "estimate": "Hv",
                "pieces": options.regressor.pieces,
                "self-calibration": options.self_calibration,
                FORCE_PER_TORQUE: float(np.vdot(torque, force) / np.vdot(torque, torque)),
            }
            if self.campaign.assumed:
                settings[ASSUMED] = " ".join(self.campaign.assumed)
        return CharacterisedDirection(
            axis=axis,
            map_points=MapPoints(
                preload=measured.preload(Preload.STATIC_FORCE),
                wheel_torque=measured.wheel_torque,
                amplitude=measured.amplitude,
                frequency=measured.frequency,
                dynamic_stiffness=measured.stiffness,
                confidence=np.where(measured.near_floor, 0.0, measured.confidence),
                run=measured.run,
            ),
            quality=quality,
            surface=surface,
            settings=settings,
            static_curve=curves.get((self.mount_set, mount, axis)),
        )


def measuring_chains(
    campaign: Campaign, options: CharacteriseOptions = DEFAULT_OPTIONS
) -> tuple[AlignmentEstimate, ...]:
    """Settle what is known of a campaign's sensors and cells, once for all its mount sets.

    All runs count, falling ones as well. One estimate per body: the powertrain, then the bodies on
    mounts of their own.

    - raises InputError: sensors that do not determine the motion of their body, a dead channel, a
      faulty one that the others convict, shaker runs that do not determine the force.
    """
    free_body = _free_body(campaign, options)
    chains = []
    with threadpool_limits(1):  # its matrices are too small to share
        for body in instrumented_bodies(campaign):
            stated = alignment(body, campaign.tolerances)
            records = [
                body_record(body, campaign.runs_of(name), campaign.tolerances)
                for name in campaign.mount_sets
            ]
            _refuse_culprit(campaign, body)
            if options.self_calibration:
                chains.append(self_calibrated(stated, records, free_body))
            else:
                chains.append(stated_alignment(stated))
    return tuple(chains)


def _free_body(campaign: Campaign, options: CharacteriseOptions) -> FreeBody | None:
    """Return the powertrain as Newton's law needs it; None where its mass is not stated."""
    if campaign.mass_matrix is None:
        return None
    third = math.sqrt(3)
    return FreeBody(
        mass_matrix=campaign.mass_matrix,
        # half widths within which any value is as likely
        mass_deviation=campaign.mass_tolerance / third,
        inertia_deviation=campaign.inertia_tolerance / third,
        centre_deviation=campaign.centre_of_gravity_tolerance / third,
        excited=campaign.excited,
        excitation_deviation=options.excitation_deviation,
    )


def characterise(
    campaign: Campaign,
    mount_set: str,
    options: CharacteriseOptions = DEFAULT_OPTIONS,
    progress: Progress | None = None,
    chains: Sequence[AlignmentEstimate] | None = None,
) -> Characterisation:
    """Characterise the mounts of one set with their error budget.

    Parameters
    ----------
    campaign : Campaign
        Raw channels.
    mount_set : str
        Parts on the bench.
    options : CharacteriseOptions
        How.
    progress : callable, optional
        Called with steps done, all steps, and the name of the next one.
    chains : sequence of AlignmentEstimate, optional
        Chains from `measuring_chains`, for several mount sets of one campaign.

    Returns
    -------
    Characterisation
        A direction that was never loaded has no surface and says why.

    Raises
    ------
    InputError
        No such mount set; no rising run in the chosen gears; faulty channels; no static force.

    See Also
    --------
    deboom.read_campaign, deboom.mounts.characterise.Characterisation, deboom.compare_models
    deboom.open_library

    Examples
    --------
    >>> import deboom
    >>> campaign = deboom.read_campaign("my_campaign")  # doctest: +SKIP
    >>> deboom.characterise(campaign, "M1").table  # doctest: +SKIP
    """

    def step(done: int) -> None:
        if progress is not None:
            progress(done, len(STEPS), STEPS[done] if done < len(STEPS) else mount_set)

    runs = training_runs(campaign, mount_set, options)
    step(0)
    mount_chains = tuple(measuring_chains(campaign, options) if chains is None else chains)
    step(1)
    with threadpool_limits(1):  # its matrices are too small to share
        bodies = [chain.alignment.body for chain in mount_chains]
        records = [body_record(body, runs, campaign.tolerances) for body in bodies]
        maps = operating_maps(mount_chains, records)
        for measured in maps.values():
            measured.preload(Preload.STATIC_FORCE)  # a mount is kept over it: asked for before work
        step(2)
        directions = {name: _direction(measured, options) for name, measured in maps.items()}
        step(3)
        budgets = error_budget(
            mount_chains,
            records,
            {name: d.surface for name, d in directions.items() if d.surface is not None},
            options.preload,
            campaign.tolerances.static_force,
            seed=options.seed,
            n_draws=options.draws,
        )
    judged = cross_stiffness_of_maps(maps, campaign.tolerances)
    doubted = {mount.mount for mount in judged if mount.clear}
    points = [point for body in bodies for point in body.points]
    doubted |= {point.mount for point in points if point.beyond_shaker(_lines(runs))}
    for name, budget in budgets.items():
        contradicted = maps[name].mount in doubted
        directions[name] = replace(
            directions[name], budget=replace(budget, contradicted=contradicted)
        )
    step(4)
    return Characterisation(campaign, mount_set, runs, mount_chains, directions, options, judged)


def cross_stiffness_of_campaign(campaign: Campaign) -> tuple[CrossStiffness, ...]:
    """Judge the mounts of a campaign with the position sheet as it is stated.

    - returns: by mount set, a judgement of each mount with three measured axes; the names of the
      mounts end with the set.
    - raises InputError: as `measuring_chains`.
    """
    judged = []
    with threadpool_limits(1):  # its matrices are too small to share
        for name, maps in stated_maps(campaign).items():
            of_set = cross_stiffness_of_maps(maps, campaign.tolerances)
            judged += [replace(cross, mount=f"{cross.mount} of {name}") for cross in of_set]
    return tuple(judged)


def stated_maps(campaign: Campaign) -> dict[str, dict[str, OperatingMap]]:
    """Compute the operating maps of each mount set by ``<mount> <axis>``, sensors as stated."""
    bodies = instrumented_bodies(campaign)
    chains = [stated_alignment(alignment(body, campaign.tolerances)) for body in bodies]
    maps = {}
    for name in campaign.mount_sets:
        runs = campaign.runs_of(name)
        records = [body_record(body, runs, campaign.tolerances) for body in bodies]
        maps[name] = operating_maps(chains, [record.mean_over_repeats() for record in records])
    return maps


def training_runs(
    campaign: Campaign, mount_set: str, options: CharacteriseOptions = DEFAULT_OPTIONS
) -> tuple[OperatingRun, ...]:
    """Return the runs of a mount set that surfaces are fitted to: rising torque, chosen gears.

    - raises InputError: no such mount set, no run in the chosen gears, or none of them with rising
      torque.
    """
    of_set = campaign.runs_of(mount_set)
    runs = [run for run in of_set if options.gears is None or run.gear in options.gears]
    if not runs:
        raise InputError(
            f"campaign {campaign.name}, mount set {mount_set}: there is no run in the gears "
            f"{options.gears}, only in {sorted({run.gear for run in of_set})}: choose other gears"
        )
    # a falling run is on another branch of the static curve
    rising = tuple(run for run in runs if run.rising)
    if not rising:
        names = sorted(run.name for run in runs)
        raise InputError(
            f"the runs {names} all have falling torque: measure a run with rising torque"
        )
    return rising


def _lines(runs: Sequence[OperatingRun]) -> RealArray:
    return np.concatenate([run.frequency for run in runs])


def _refuse_culprit(campaign: Campaign, body: InstrumentedBody) -> None:
    """Refuse runs of a rigid body whose channels disagree, and name the one that is to blame."""
    if body.virtual_point is None:
        return
    for run in campaign.runs:
        worst = max(geometric_consistency(body.virtual_point, run.acceleration).values())
        if worst <= LARGEST_INCONSISTENCY:
            continue
        diagnosis = culprit_of_responses(body.virtual_point, run.acceleration, campaign.tolerances)
        turned = explain_rotation_order(body.accelerometers, run.acceleration, body.channels_off)
        raise InputError(
            f"campaign {campaign.name}, run {run.name}: the accelerometers of the {body.name} "
            f"disagree by {worst:.2f} (geometric consistency, at most {LARGEST_INCONSISTENCY}); "
            f"{diagnosis.verdict}; correct it, or switch the channels off by their names; {turned}"
        )


def _direction(measured: OperatingMap, options: CharacteriseOptions) -> DirectionResult:
    """Fit the surface of one direction, or say why there is none."""
    surface = DynamicStiffnessSurface(options.regressor, preload_unit=options.preload.unit)
    try:
        samples = measured.samples(options.preload)
        surface.fit(samples.points, samples.stiffness, groups=samples.run)
    except InputError as error:
        masked = int(np.count_nonzero(measured.near_floor))
        complaint = f"{measured.name}: {error} ({masked} of {len(measured)} lines near the floor)"
        return DirectionResult(measured, complaint=complaint)
    return DirectionResult(measured, surface)
