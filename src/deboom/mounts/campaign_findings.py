"""What contradicts in a campaign before anything is characterised.

Statics must balance the wheel torque, mass and inertia must be those of one body, and suppliers'
curves must fit the measured stiffness, as accelerometers must fit each other. Each sentence names
the run, mount, sensor or curve.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.errors import Finding
from deboom.measurement.campaign import Campaign, OperatingRun
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.measurement.culprit import culprit_of_responses, odd_channels
from deboom.measurement.quality import LARGEST_INCONSISTENCY, geometric_consistency
from deboom.mounts.losses import loss_faults
from deboom.mounts.measuring_chain import InstrumentedBody, bench_mode, instrumented_bodies
from deboom.physics.rigid_body import LARGEST_RESIDUAL, box_density, forward_matrices, not_rigid

TORQUE_GAP = 0.15
"""Difference of moment and wheel torque, or of torque and its limit, that is named [1]."""
STATIC_REST = 0.2
"""Sum of the static forces over their size that the wheel torque leaves [1]."""
STIFFNESS_RATIO = (0.3, 15.0)
"""Dynamic stiffness in a run over the slope of the static curve [1]: rubber has 1.2 to 3, and
preload and play add."""
JUDGED = 0.5
"""Coherence of force and displacement from which on their stiffness is compared [1]."""
AGAINST = -0.5
"""Correlation of two cells of a mount below which one looks reversed [1]."""
PUSHED = 0.05
"""Force along an axis over that of its cell from which on this is judged [1]: below 0.025, cells of
drawn benches show the cross-talk of their other axes, of either sign."""
SHIFTED = 1.5
"""Distance between the middles of accelerometers and mounts over their spread [1]."""
DOUBTED_SENSOR = 3.0
"""Contradiction of one sensor over what tolerances let expect that is named [1]: the worst of six
right ones reaches 2.2 in 60 drawn campaigns."""
INCONSISTENT = 1.5 * LARGEST_INCONSISTENCY
"""Mean error of a channel that is named without a culprit [1]: 60 drawn campaigns with up to four
times the stated noise stay below 0.018, inverted and swapped channels have 0.09 and 0.27."""
PLAUSIBLE_DENSITY = (150.0, 6000.0)
"""Of the box with the mass and inertia of a powertrain [kg/m³]: drawn ones have 1100 to 1900,
solid steel 7850; a mass in lb makes it 7.2 times as dense."""


def campaign_findings(
    campaign: Campaign, over_time: Sequence[OperatingRun] = ()
) -> tuple[Finding, ...]:
    """List what contradicts in a campaign, a sentence each.

    - `over_time`: further runs, which were recorded over time.
    - raises InputError: as `deboom.mounts.measuring_chain.instrumented_bodies`.
    """
    powertrain = [body for body in instrumented_bodies(campaign) if body.is_rigid_body]
    copies = tuple(_copies(campaign))
    campaign = replace(campaign, runs=(*campaign.runs, *over_time))
    sentences = [*copies, *_torques(campaign.runs), *_curves(campaign)]
    if (matrix := campaign.mass_matrix) is not None:
        sentences += density_doubt(float(matrix[0, 0]), matrix[3:, 3:])
    findings = [*map(Finding, sentences)]
    for body in powertrain:
        if campaign.runs:
            lines = np.concatenate([run.frequency for run in campaign.runs])
            of_bench = bench_mode(body.points, lines)
            findings += [Finding(sentence, alarm=denies) for sentence, denies in of_bench]
        of_motion = [*map(Finding, _places(body)), *_sensors(campaign, body)]
        findings += of_motion
        findings += map(Finding, (*_statics(campaign.runs, body), *_cells(campaign.runs, body)))
        if not of_motion:  # it denies every mount; name its cause alone
            findings += map(Finding, _forces(campaign, body))
    return tuple(dict.fromkeys(findings))


def density_doubt(mass: float, inertia: RealArray) -> Iterator[str]:
    """Give a sentence for a powertrain whose mass and inertia do not go together.

    - `mass` [kg]; `inertia` (3, 3): about its centre of gravity [kg m²].
    """
    density = box_density(mass, inertia)
    low, high = PLAUSIBLE_DENSITY
    if not low <= density <= high:
        yield (
            f"mass_kg and inertia_kg_m2 of [powertrain] make it a box of {density:.2g} kg/m³, and "
            f"powertrains have {low:g} to {high:g}: is the mass in kg and not in lb, and are both "
            "of the same body, the inertia in kg m² about its centre of gravity?"
        )


def _copies(campaign: Campaign) -> Iterator[str]:
    for first, second in combinations(campaign.runs, 2):
        if np.array_equal(first.acceleration.values, second.acceleration.values):
            yield (
                f"runs {first.name} of {first.mount_set} and {second.name} of {second.mount_set} "
                "hold the same accelerations: name the file of each"
            )
    for one, other in combinations(campaign.static_curves, 2):
        if np.array_equal(one.force, other.force):
            yield f"{one.name} and {other.name} hold the same forces: name the file of each"


def _torques(runs: Sequence[OperatingRun]) -> Iterator[str]:
    for run in runs:
        if run.torque_limit > 0.0:
            reached = float(np.max(run.engine_torque))
            if abs(reached / run.torque_limit - 1.0) > TORQUE_GAP:
                yield (
                    f"run {run.name} of {run.mount_set}: its engine torque reaches {reached:.0f} "
                    f"N m, and torque_nm says {run.torque_limit:.0f} N m: is the channel in N m "
                    "and not in lbf ft, and torque_nm that of this run?"
                )


def _curves(campaign: Campaign) -> Iterator[str]:
    for curve in campaign.static_curves:
        slope = float(np.polyfit(curve.deflection, curve.force, 1)[0])
        if not slope > 0.0:
            yield (
                f"{curve.name} falls over the deflection: turn the sign of its force or of its "
                "deflection"
            )


def _places(body: InstrumentedBody) -> Iterator[str]:
    sensors = np.array([sensor.position for sensor in body.accelerometers])
    mounts = np.array([point.position for point in body.points])
    middles = sensors.mean(axis=0), mounts.mean(axis=0)
    spread = float(np.sqrt(np.mean(np.sum((mounts - middles[1]) ** 2, axis=1))))
    apart = float(np.linalg.norm(middles[0] - middles[1]))
    if apart > SHIFTED * spread:
        yield (
            f"the accelerometers of the {body.name} lie around a point {apart:.3g} m from the "
            f"middle of its mounts, which lie within {spread:.3g} m of it: state the positions of "
            "both from the centre of gravity"
        )


def _sensors(campaign: Campaign, body: InstrumentedBody) -> Iterator[Finding]:
    assert body.virtual_point is not None
    for run in campaign.runs:
        worst = max(geometric_consistency(body.virtual_point, run.acceleration).values())
        if worst <= LARGEST_INCONSISTENCY / 2.0:
            continue
        measured = run.acceleration.select(body.channels)
        groups = {
            sensor.name: [body.channels.index(c) for c in sensor.channels if c in body.channels]
            for sensor in body.accelerometers
        }
        groups |= {name: [k] for k, name in enumerate(body.channels)}
        odd = odd_channels(body.forward, measured.frequency, measured.values[:, np.newaxis], groups)
        diagnosis = culprit_of_responses(body.virtual_point, measured, campaign.tolerances)
        doubted = (
            diagnosis.named
            and diagnosis.suspect is not None
            and diagnosis.suspect.significance > DOUBTED_SENSOR
        )
        if odd is None and not doubted and worst <= INCONSISTENT:
            continue
        yield Finding(
            f"run {run.name} of {run.mount_set}: the accelerometers of the {body.name} contradict "
            f"each other: {odd.words if odd is not None else diagnosis.verdict}; correct it, or "
            "switch the channels off by their names",
            alarm=not_rigid(body.forward, measured.values) > LARGEST_RESIDUAL,
        )
        return


def _statics(runs: Sequence[OperatingRun], body: InstrumentedBody) -> Iterator[str]:
    """Compare the moment of the static forces about y with the wheel torque."""
    names = [f"{point.name} {axis}" for point in body.points for axis in AXES]
    forward = forward_matrices(np.array([point.position for point in body.points]))
    ratios: dict[str, float] = {}
    for run in runs:
        column = dict(zip(run.static_force_names, run.static_force.T, strict=True))
        if not set(names) <= set(column) or not np.any(run.wheel_torque):
            continue
        torque = run.wheel_torque
        force = np.stack([column[name] for name in names], axis=1)
        load = force @ forward
        of_torque = torque @ load / (torque @ torque)
        if (odd := _odd_mount(force, forward, body)) is not None:
            yield (
                f"run {run.name} of {run.mount_set}: the static forces do not balance; with those "
                f"of mount {odd[0]} times {odd[1]:.3g} they do: check their unit and sign"
            )
            return
        ratios[f"{run.name} of {run.mount_set}"] = float(of_torque[4])
    off = {name: ratio for name, ratio in ratios.items() if abs(ratio - 1.0) > TORQUE_GAP}
    if off and len(off) == len(ratios):
        middle = float(np.median(list(off.values())))
        yield (
            f"the static forces of all runs have {middle:.2f} times the moment of the wheel torque "
            "about y: are engine torque in N m and static force in N, the signs of the static "
            "forces those on the bench, and total_ratios those of this gearbox?"
        )
    elif off:
        for name, ratio in off.items():
            yield (
                f"run {name}: its static forces have {ratio:.2f} times the moment of the wheel "
                "torque about y, those of other runs the same: are its gear and the unit of its "
                "engine torque right?"
            )


def _odd_mount(
    force: RealArray, forward: RealArray, body: InstrumentedBody
) -> tuple[str, float] | None:
    """Name the mount whose static forces, times a factor, let all sum up to a torque."""
    size = float(np.linalg.norm(force))
    blocks = np.stack(
        [
            force[:, 3 * k : 3 * k + 3] @ forward[3 * k : 3 * k + 3, :3]
            for k in range(len(body.points))
        ]
    )
    rest = blocks.sum(axis=0)
    if float(np.linalg.norm(rest)) < STATIC_REST * size:
        return None
    best, least = None, np.inf
    for point, block in zip(body.points, blocks, strict=True):
        others = rest - block
        factor = -float(np.sum(block * others)) / max(float(np.sum(block**2)), 1e-300)
        left = float(np.linalg.norm(others + factor * block))
        if left < least:
            best, least = (point.name, factor), left
    return best if least < STATIC_REST * size / 2.0 else None


def _cells(runs: Sequence[OperatingRun], body: InstrumentedBody) -> Iterator[str]:
    """Name cells of a mount that push against each other in every run."""
    for point in body.points:
        for first, second in combinations(point.cells, 2):
            forces = [
                np.vstack([run.cell_force.select(cell.channels).values for run in runs])
                @ cell.orientation.T
                for cell in (first, second)
            ]
            cross = np.sum(forces[0].conj() * forces[1], axis=0).real
            along = np.stack([np.linalg.norm(force, axis=0) for force in forces])
            share = np.min(along / np.linalg.norm(along, axis=1, keepdims=True), axis=0)
            like = cross / np.maximum(along[0] * along[1], 1e-300)
            for axis, against in zip(AXES, (share > PUSHED) & (like < AGAINST), strict=True):
                if against:
                    yield (
                        f"mount {point.name}: the force cells {first.name} and {second.name} push "
                        f"against each other along {axis}: is a channel of one reversed?"
                    )


def at_mounts(body: InstrumentedBody, run: OperatingRun) -> LoadCase:
    """Return a run's motion and forces at the mounts of a rigid body."""
    squared = -((2.0 * np.pi * run.frequency[:, np.newaxis]) ** 2)
    names = tuple(f"{point.name} {axis}" for point in body.points for axis in AXES)
    cells = [
        point.corrected(run.cell_force.select(point.cell_channels).values, run.frequency)
        for point in body.points
    ]
    force = np.hstack(cells) @ body.force_matrix.T
    measured = run.acceleration.select(body.channels).values
    to_points = body.at_points @ np.linalg.pinv(body.forward)
    moved: ComplexArray = (measured / squared) @ to_points.T
    return LoadCase(
        name=f"{run.name} of {run.mount_set}",
        title=run.name,
        gear=run.gear,
        total_ratio=run.total_ratio,
        torque_limit=run.torque_limit,
        order=run.order,
        displacement=Spectrum(run.frequency, moved, names, "m"),
        force=Spectrum(run.frequency, force, names, "N"),
    )


def _forces(campaign: Campaign, body: InstrumentedBody) -> Iterator[str]:
    cases = [at_mounts(body, run) for run in campaign.runs]
    yield from _stiffness(campaign, cases)
    late, unusual = loss_faults(cases, "run")
    yield from late or unusual


def _stiffness(campaign: Campaign, cases: Sequence[LoadCase]) -> Iterator[str]:
    """Compare each supplier's curve with the stiffness in the runs."""
    for curve in campaign.static_curves:
        name = f"{curve.mount} {curve.axis}"
        ratios = []
        middle = np.abs(curve.deflection) <= np.max(np.abs(curve.deflection)) / 3.0
        if np.count_nonzero(middle) < 3:
            continue
        slope = float(np.polyfit(curve.deflection[middle], curve.force[middle], 1)[0])
        for case in cases:
            if name not in case.force.channels or not case.name.endswith(f" of {curve.mount_set}"):
                continue
            force = case.force.select([name]).values[:, 0]
            displacement = case.displacement.select([name]).values[:, 0]
            cross = np.vdot(displacement, force)
            sizes = np.linalg.norm(force) * np.linalg.norm(displacement)
            if abs(cross) ** 2 > JUDGED * sizes**2:
                ratios.append(abs(cross) / np.linalg.norm(displacement) ** 2 / slope)
        if not ratios or not slope > 0.0:
            continue
        ratio = float(np.median(ratios))
        if not STIFFNESS_RATIO[0] < ratio < STIFFNESS_RATIO[1]:
            yield (
                f"mount {curve.mount}: its dynamic stiffness along {curve.axis} is {ratio:.3g} "
                f"times the slope of the {curve.name}: is the curve in the units of its header (mm "
                "or m, N or kN), and the force of the cells in N?"
            )
