"""Characterisation: from a campaign's raw channels to characterised mounts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.errors import InputError
from deboom.measurement.campaign import (
    Campaign,
    MeasuredMount,
    OperatingRun,
    RunDirection,
    rising_runs,
)
from deboom.measurement.culprit import culprit_of_responses
from deboom.measurement.quality import geometric_consistency
from deboom.measurement.virtual_point import sensor_geometry, virtual_point
from deboom.mounts.characterised_mount import (
    CampaignRecord,
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    FittedSurface,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.error_budget import LEAST_DRAWS, DirectionBudget, error_budget, same_pieces
from deboom.mounts.measuring_chain import (
    AlignmentEstimate,
    InstrumentedBody,
    alignment,
    body_record,
    instrumented_bodies,
    stated_alignment,
)
from deboom.mounts.mount import AXES, Mount
from deboom.mounts.operating_map import Estimate, OperatingMap, Preload, operating_maps
from deboom.mounts.piecewise_cubic import PieceOptions, TrainingRegion
from deboom.mounts.response_surface import (
    Agreement,
    DynamicStiffnessSurface,
    StiffnessSamples,
    agreement,
)
from deboom.mounts.self_calibration import FreeBody, self_calibrated

TOLERANCE_UNITS = {
    "sensor_position": "m",
    "sensor_angle": "rad",
    "acceleration_floor": "m/s^2",
    "force_floor": "N",
    "shaker_angle": "rad",
    "torque": "N m",
    "static_force": "N",
}
"""Of the tolerances that are not plain numbers."""


@dataclass(frozen=True)
class CharacteriseOptions:
    """How mounts are characterised.

    Parameters
    ----------
    gears : tuple of int or None
        Gears whose runs the surfaces are fitted to; None takes all.
    preload : Preload
        Variable of the surfaces.
    estimate : Estimate
        Over repeated runs.
    pieces : PieceOptions
        Of the surfaces.
    self_calibration : bool
        Whether rigid motion and Newton's law improve the stated alignment.
    excited : tuple of str
        Loads ``fx`` … ``mz`` that excite the powertrain at this order; about the crankshaft along y
        alone by default. Four cylinders in line add ``fz`` and its moment ``mx``.
    excitation_deviation : float
        Standard deviation of their direction, per axis [rad].
    folds : int
        Groups of load cases that are held out in turn to judge the surfaces; 0 for none.
    draws : int
        Of the error budget.
    seed : int
        Of the error budget, from 1.

    Raises
    ------
    InputError
        A single fold.
    """

    gears: tuple[int, ...] | None = (5, 6, 7)
    preload: Preload = Preload.WHEEL_TORQUE
    estimate: Estimate = Estimate.BY_NOISE_RATIO
    pieces: PieceOptions = field(default_factory=PieceOptions)
    self_calibration: bool = True
    excited: tuple[str, ...] = ("my",)
    excitation_deviation: float = math.radians(0.2)
    folds: int = 5
    draws: int = LEAST_DRAWS
    seed: int = 1

    def __post_init__(self) -> None:
        if self.folds == 1 or self.folds < 0:
            raise InputError(f"{self.folds} folds leave nothing to fit: take 0 or at least 2")


DEFAULT_OPTIONS = CharacteriseOptions()


@dataclass(frozen=True, eq=False)
class DirectionResult:
    """What came out for one direction.

    Parameters
    ----------
    measured : OperatingMap
        Line by line.
    surface : DynamicStiffnessSurface or None
        Fitted to the lines that are not near the floor.
    training, held_out : Agreement or None
        Of the surface with its own lines; of surfaces with the load cases they were not fitted to.
    budget : DirectionBudget or None
        Uncertainty of the surface.
    complaint : str
        Why there is no surface; empty where there is one.
    """

    measured: OperatingMap
    surface: DynamicStiffnessSurface | None = None
    training: Agreement | None = None
    held_out: Agreement | None = None
    budget: DirectionBudget | None = None
    complaint: str = ""


@dataclass(frozen=True, eq=False)
class Characterisation:
    """Everything that came out for one mount set.

    Parameters
    ----------
    campaign : Campaign
        What it came from.
    mount_set : str
        Parts on the bench.
    runs : tuple of OperatingRun
        That the surfaces were fitted to.
    chains : tuple of AlignmentEstimate
        One per body.
    directions : dict of str to DirectionResult
        By ``<mount> <axis>``.
    options : CharacteriseOptions
        How.
    """

    campaign: Campaign
    mount_set: str
    runs: tuple[OperatingRun, ...]
    chains: tuple[AlignmentEstimate, ...]
    directions: dict[str, DirectionResult]
    options: CharacteriseOptions

    @property
    def mounts(self) -> tuple[CharacterisedMount, ...]:
        """What the library keeps, one per mount."""
        return tuple(_characterised_mount(self, mount) for mount in self.campaign.mounts)

    def record(self, inputs_sha256: Mapping[str, str]) -> CampaignRecord:
        """Return the library's record of the campaign.

        Parameters
        ----------
        inputs_sha256 : mapping of str to str
            Hash of every file of `Campaign.input_files`.
        """
        stated = self.campaign.tolerances
        return CampaignRecord(
            name=self.campaign.name,
            order=self.campaign.order,
            runs=tuple(run.name for run in self.campaign.runs),
            tolerances={
                f"{one.name} [{TOLERANCE_UNITS.get(one.name, '1')}]": getattr(stated, one.name)
                for one in fields(stated)
            },
            inputs_sha256=inputs_sha256,
        )


def _characterised_mount(result: Characterisation, measured: MeasuredMount) -> CharacterisedMount:
    directions = {
        axis: result.directions[f"{measured.name} {axis}"]
        for axis in AXES
        if f"{measured.name} {axis}" in result.directions
    }
    points = [point for c in result.chains for point in c.alignment.body.points]
    scatter = max(p.transfer_scatter.max() for p in points if p.mount == measured.name)
    quality = {"scatter of the force transfer matrix [1]": float(scatter)}
    for chain in result.chains:
        if any(point.mount == measured.name for point in chain.alignment.body.points):
            quality |= {f"misfit of {group} [1]": value for group, value in chain.misfit}
    return CharacterisedMount(
        identity=MountIdentity(result.campaign.name, measured.name, result.mount_set),
        mount=Mount(
            measured.name,
            measured.description,
            measured.pieces,
            measured.positions,
            measured.transfer_axes,
        ),
        directions=tuple(
            _characterised_direction(result, measured.name, axis, one)
            for axis, one in directions.items()
        ),
        quality=quality,
    )


def _characterised_direction(
    result: Characterisation, mount: str, axis: str, one: DirectionResult
) -> CharacterisedDirection:
    curves = [
        curve
        for curve in result.campaign.static_curves
        if (curve.mount_set, curve.mount, curve.axis) == (result.mount_set, mount, axis)
    ]
    budget = one.budget
    quality = DirectionQuality(identified=False)
    if one.surface is not None:
        quality = DirectionQuality(
            identified=budget is not None and budget.identified,
            half_width_95=None if budget is None else budget.half_width_95,
            r2_real=one.surface.r2_real,
            r2_imag=one.surface.r2_imag,
            r2_force=one.surface.r2_force,
        )
    return CharacterisedDirection(
        axis=axis,
        map_points=_map_points(one.measured),
        quality=quality,
        surface=None if one.surface is None else _fitted_surface(one.surface, result.options),
        static_curve=curves[0] if curves else None,
    )


def _map_points(measured: OperatingMap) -> MapPoints:
    """Every line over static force; those near the floor have no confidence."""
    return MapPoints(
        preload=measured.preload(Preload.STATIC_FORCE),
        wheel_torque=measured.wheel_torque,
        amplitude=measured.amplitude,
        frequency=measured.frequency,
        dynamic_stiffness=measured.stiffness,
        confidence=np.where(measured.near_floor, 0.0, measured.confidence),
        run=measured.run,
    )


def _fitted_surface(
    surface: DynamicStiffnessSurface, options: CharacteriseOptions
) -> FittedSurface:
    ranges = surface.ranges
    return FittedSurface(
        model=type(surface).__name__,
        variables=(options.preload.value, *list(ranges)[1:]),
        units=tuple(surface.units[name] for name in ranges),
        lower=np.array([low for low, _ in ranges.values()]),
        upper=np.array([high for _, high in ranges.values()]),
        arrays=surface.to_arrays(),
        settings={
            "preload": options.preload.value,
            "gears": "all" if options.gears is None else ", ".join(map(str, options.gears)),
            "estimate": options.estimate.value,
            "pieces": options.pieces.pieces,
            "self-calibration": options.self_calibration,
        },
    )


Progress = Callable[[int, int, str], None]
"""Called with what is done, the total, and a short text."""

LARGEST_INCONSISTENCY = 0.02
"""Geometric consistency that careful sensors stay below; an inverted channel gives 0.09 [1]."""

STEPS = ("measuring chains", "operating maps", "response surfaces", "error budget")


def measuring_chains(
    campaign: Campaign, options: CharacteriseOptions = DEFAULT_OPTIONS
) -> tuple[AlignmentEstimate, ...]:
    """Settle what is known of a campaign's sensors and cells, once for all its mount sets.

    Parameters
    ----------
    campaign : Campaign
        All its runs count, falling ones as well.
    options : CharacteriseOptions
        Whether and how the chains calibrate themselves.

    Returns
    -------
    tuple of AlignmentEstimate
        One per body: the powertrain, then the bodies on mounts of their own.

    Raises
    ------
    InputError
        Sensors that do not determine the motion of their body, a dead channel, a faulty one that
        the others convict, shaker runs that do not determine the force.
    """
    third = math.sqrt(3)
    free_body = FreeBody(
        mass_matrix=campaign.mass_matrix,
        # half widths within which any value is as likely
        mass_deviation=campaign.mass_tolerance / third,
        inertia_deviation=campaign.inertia_tolerance / third,
        centre_deviation=campaign.centre_of_gravity_tolerance / third,
        excited=options.excited,
        excitation_deviation=options.excitation_deviation,
    )
    with threadpool_limits(1):  # its matrices are too small to share
        return tuple(
            _chain(campaign, body, free_body, options) for body in instrumented_bodies(campaign)
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
        From `measuring_chains`, for several mount sets of one campaign.

    Returns
    -------
    Characterisation
        A direction that was never loaded has no surface and says why.

    Raises
    ------
    InputError
        No such mount set; no run with rising torque in the chosen gears; faulty channels.
    """

    def step(done: int) -> None:
        if progress is not None:
            progress(done, len(STEPS), STEPS[done] if done < len(STEPS) else mount_set)

    runs = training_runs(campaign, mount_set, options)
    step(0)
    known = tuple(measuring_chains(campaign, options) if chains is None else chains)
    step(1)
    with threadpool_limits(1):  # its matrices are too small to share
        bodies = [chain.alignment.body for chain in known]
        records = [body_record(body, runs, campaign.tolerances) for body in bodies]
        maps = operating_maps(known, records, options.estimate)
        step(2)
        directions = {name: _direction(measured, options) for name, measured in maps.items()}
        step(3)
        budgets = error_budget(
            known,
            records,
            {name: one.surface for name, one in directions.items() if one.surface is not None},
            options.preload,
            campaign.tolerances.static_force,
            seed=options.seed,
            n_draws=options.draws,
        )
    for name, budget in budgets.items():
        directions[name] = replace(directions[name], budget=budget)
    step(4)
    return Characterisation(campaign, mount_set, runs, known, directions, options)


def training_runs(
    campaign: Campaign, mount_set: str, options: CharacteriseOptions = DEFAULT_OPTIONS
) -> tuple[OperatingRun, ...]:
    """Return the runs of a mount set that surfaces are fitted to: rising torque, chosen gears.

    Raises
    ------
    InputError
        No such mount set, no run in the chosen gears, or none of them with rising torque.
    """
    there = campaign.runs_of(mount_set)
    runs = [run for run in there if options.gears is None or run.gear in options.gears]
    if not runs:
        raise InputError(
            f"campaign {campaign.name}, mount set {mount_set}: there is no run in the gears "
            f"{options.gears}, only in {sorted({run.gear for run in there})}: choose other gears"
        )
    ways = {True: RunDirection.RISING, False: RunDirection.FALLING}
    direction = {run.name: ways[run.rising] for run in runs}
    rising = rising_runs([run.name for run in runs], direction)
    return tuple(run for run, kept in zip(runs, rising, strict=True) if kept)


def _chain(
    campaign: Campaign, body: InstrumentedBody, free_body: FreeBody, options: CharacteriseOptions
) -> AlignmentEstimate:
    """Settle the measuring chain of one body."""
    stated = alignment(body, campaign.tolerances)
    records = [
        body_record(body, campaign.runs_of(name), campaign.tolerances)
        for name in campaign.mount_sets
    ]
    _refuse_culprit(campaign, body)
    if options.self_calibration:
        return self_calibrated(stated, records, free_body)
    return stated_alignment(stated)


def _refuse_culprit(campaign: Campaign, body: InstrumentedBody) -> None:
    """Refuse runs of a rigid body whose channels disagree, and name the one that is to blame."""
    if not body.is_rigid_body:
        return
    off = [name for s in body.accelerometers for name in s.channels if name not in body.channels]
    point = virtual_point(sensor_geometry(body.accelerometers, switched_off=off))
    for run in campaign.runs:
        worst = max(geometric_consistency(point, run.acceleration).values())
        if worst <= LARGEST_INCONSISTENCY:
            continue
        diagnosis = culprit_of_responses(point, run.acceleration, campaign.tolerances)
        raise InputError(
            f"campaign {campaign.name}, run {run.name}: the accelerometers of the {body.name} "
            f"disagree by {worst:.2f} (geometric consistency, at most {LARGEST_INCONSISTENCY}); "
            f"{diagnosis.verdict}; correct it, or switch the channels off by their names"
        )


def _direction(measured: OperatingMap, options: CharacteriseOptions) -> DirectionResult:
    """Fit the surface of one direction, or say why there is none."""
    try:
        samples = measured.samples(options.preload)
        surface = _fitted(samples, options)
    except InputError as error:
        masked = int(np.count_nonzero(measured.near_floor))
        complaint = f"{measured.name}: {error} ({masked} of {len(measured)} lines near the floor)"
        return DirectionResult(measured, complaint=complaint)
    return DirectionResult(
        measured=measured,
        surface=surface,
        training=agreement(samples, surface.predict_masked(*samples.points.T)[0]),
        held_out=_held_out(samples, surface, options.folds),
    )


def _fitted(samples: StiffnessSamples, options: CharacteriseOptions) -> DynamicStiffnessSurface:
    return DynamicStiffnessSurface.fit(
        *samples.lines, preload_unit=options.preload.unit, options=options.pieces, run=samples.run
    )


def _held_out(
    samples: StiffnessSamples, surface: DynamicStiffnessSurface, folds: int
) -> Agreement | None:
    """Agreement with load cases that cubics of the same pieces were not fitted to.

    Lines away from all that were fitted do not count: there a surface does not speak. Neither does
    a fold without which a piece has no line left.
    """
    runs = np.array(samples.run)
    cases, case = np.unique(runs, return_inverse=True)
    if not 0 < folds <= len(cases):
        return None
    points, stiffness = samples.points, samples.stiffness
    modelled = np.empty(len(samples), dtype=complex)
    inside = np.zeros(len(samples), dtype=bool)
    for fold in range(folds):
        out = case % folds == fold
        try:
            real, imag = (
                same_pieces(part, points[~out], values[~out, np.newaxis])(points[out])[:, 0]
                for part, values in ((surface.real, stiffness.real), (surface.imag, stiffness.imag))
            )
        except InputError:
            continue
        modelled[out] = real + 1j * imag
        inside[out] = TrainingRegion.around(points[~out]).contains(points[out])
    if not inside.any():
        return None
    kept = StiffnessSamples(
        samples.preload[inside],
        samples.displacement[inside],
        samples.frequency[inside],
        stiffness[inside],
    )
    return agreement(kept, modelled[inside])
