"""From a campaign's raw channels to characterised mounts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.errors import InputError
from deboom.measurement.campaign import Campaign, OperatingRun
from deboom.measurement.channel_geometry import sensor_geometry
from deboom.measurement.consistency import geometric_consistency
from deboom.measurement.culprit import culprit_of_responses
from deboom.measurement.rising_torque import RunDirection, rising_runs
from deboom.measurement.virtual_point import virtual_point
from deboom.mounts.agreement import Agreement, agreement
from deboom.mounts.alignment import alignment
from deboom.mounts.alignment_estimate import AlignmentEstimate, stated_alignment
from deboom.mounts.body_record import body_record
from deboom.mounts.characterisation import (
    DEFAULT_OPTIONS,
    Characterisation,
    CharacteriseOptions,
    DirectionResult,
)
from deboom.mounts.error_budget import error_budget, same_pieces
from deboom.mounts.instrumented_body import InstrumentedBody, instrumented_bodies
from deboom.mounts.operating_map import OperatingMap, operating_maps
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.mounts.self_calibration import FreeBody, self_calibrated
from deboom.mounts.stiffness_model import StiffnessSamples
from deboom.mounts.training_region import TrainingRegion

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
