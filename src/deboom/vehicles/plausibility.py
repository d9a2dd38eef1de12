"""Plausibility of a platform: contradictions between data sheet, mounts, runs and vehicles.

Each check compares what was stated with what was measured, or functions with their neighbours, and
names the likely mistake. A finding is certain where nothing right looks like it; the others are
worth a look. ``deboom check`` and the studies use the same list.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.polynomial.legendre import legvander3d

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.errors import Finding, InputError
from deboom.measurement.channels import LoadCase
from deboom.measurement.culprit import odd_channels
from deboom.mounts.campaign_findings import density_doubt
from deboom.mounts.losses import LEAST_SHARE, loss_faults
from deboom.mounts.mount import Mount, in_mount_axes, refuse_active_mounts
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.rigid_body import LARGEST_RESIDUAL, forward_matrices, not_rigid
from deboom.vehicles.coupled_motion import CLEARLY_LESS, reversed_channel
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.powertrain import Powertrain

SMALL_RESIDUAL = 0.03
"""Part of the mounts' motion that sensors leave unexplained by a rigid motion [1]."""
LEAST_RESIDUAL = 0.003
"""The same from which on a late channel, or one of another gain, is looked for [1]."""
REACH = (0.5, 8.0)
"""Distance of the mounts from the centre of gravity over the radius of gyration [1]."""
LARGEST_ECCENTRICITY = 1.5
"""Distance of the centre of gravity from the middle of the mounts over their spread [1]."""
BALANCED = 0.98
"""Coherence from which on the mounts' forces are what the body's inertia takes [1]."""
BALANCE = (0.3, 1.5)
"""Force of the mounts over inertia force along a direction that nothing else excites [1]. The
engine's own force at its order makes it differ from 1."""
TORQUE_GAP = 0.2
"""Difference of an engine's torque from its limit that is named [1]."""
LONGEST_DROPOUT = 2
"""Lines in a row that may read exactly zero."""
FEWEST_LINES = 40
"""Lines from which on anything is judged."""
SPEEDS = (300.0, 9000.0)
"""Speeds at which a combustion engine runs under load [1/min]."""
FEWEST_VEHICLES = 4
"""Vehicles with which another one is compared at least."""
LOUDER, QUIETER = 8.0, 11.0
"""Level of a vehicle's functions above and below those of the others from which on it is named
[dB]: of 900 drawn vehicles the loudest lies 7 dB above; a car with a battery lies 9 dB below."""
DEVIATIONS, LEAST_DEVIATION = 3.0, 1.5
"""Standard deviations of the others' levels that it needs as well [1], and the least of these
[dB]."""
PATH_GAP = 17.0
"""Level of one path beside the vehicle's others, against other vehicles, that is named [dB]: of
30000 drawn ones one lies 16 dB off."""
IN_LINE = 0.98
"""``|Σ h²| / Σ |h|²`` of a function from which on its phase never changes [1]."""
JUMP, SMOOTH = 6.0, 2.0
"""Factor from line to line at most paths that is named where the next lines change by less than the
second one [1]: modes of 6000 drawn vehicles reach 4.8, and a range is switched by 10."""
MAINS = (50.0, 60.0, 100.0, 120.0)
"""Lines of the mains [Hz]. Elsewhere a line that stands out is a mode: one of 0.2 % damping at 25
Hz does so on lines 0.25 Hz apart, and none of 50 Hz or more."""
ROUGH = 1.0
"""Median change from line to line over the size of a function, from which on phases are noise [1]:
1.4 where they are, up to 0.4 in 1800 drawn vehicles."""
FEWEST_RUNS, FEWEST_PER_RUNS = 3, 400
"""Runs, and lines of all of them together, that tell what they have in common from noise."""
STIFFNESS_DEGREES = (5, 3, 2)
"""Of a smooth stiffness over wheel torque, frequency and logarithm of the amplitude."""
ROUGH_STIFFNESS = 0.01
"""Part of a force that no smooth stiffness explains, from which on it is judged [1]."""
COMMON = 0.4
"""Part of its energy that is alike in all runs, beyond that of noise [1]: below 0.2 in drawn
platforms, 0.5 to 0.9 on bodies that move."""
OPPOSITE = -0.5
"""Likeness to the other vehicles of the group below which a path has the other sign [1]: right ones
have 0.1 to 0.98, rarely down to -0.4."""
AGREED = 0.75
"""Size of the mean of the others' functions, each of size 1, from which on they agree on a path."""
LIKELIER, LIKE = 0.5, 0.6
"""Gain in likeness from which on two paths are named as exchanged, and the likeness that both have
then [1]: a vehicle that is unlike its group gains by chance."""


def platform_findings(
    *,
    mounts: Sequence[Mount],
    powertrain: Powertrain | None,
    fleet: Fleet,
    load_cases: Sequence[LoadCase],
    cylinders: int | None,
) -> tuple[Finding, ...]:
    """List what contradicts in a platform.

    - `mounts`: positions from the centre of gravity [m].
    - `powertrain`: of the data sheet; None leaves out what needs mass and inertia.
    - `load_cases`: runs in vehicle axes.
    - `cylinders`: None for an electric drive.

    Nothing is judged on fewer than `FEWEST_LINES` lines.
    """
    if load_cases[0].force.frequency.size < FEWEST_LINES:
        return ()
    carried = tuple(_carried(mounts, powertrain, load_cases))
    dense = () if powertrain is None else density_doubt(powertrain.mass, powertrain.inertia)
    return (
        *_runs(load_cases, cylinders),
        *map(Finding, dense),
        *carried,
        *_out_of_time(mounts, load_cases),
        *map(Finding, filter(None, [of_moving_body(mounts, load_cases)])),
        *_vehicles(fleet.vehicles),
    )


# ---- runs


def _runs(load_cases: Sequence[LoadCase], cylinders: int | None) -> Iterator[Finding]:
    for case in load_cases:
        for quantity in ("displacement", "force"):
            spectrum = getattr(case, quantity)
            for name, values in zip(spectrum.channels, spectrum.values.T, strict=True):
                whose = f"load case {case.name}: {quantity} of {name}"
                if words := _dead(spectrum.frequency, values):
                    yield Finding(f"{whose} {words}", certain=True)
        if not np.any(case.displacement.values.imag):
            yield Finding(
                f"load case {case.name}: displacement and force have no imaginary part: their "
                "phases were lost; export complex spectra with the phase of the tacho",
                certain=True,
            )
        if cylinders is not None:
            yield from _speeds(case)
        if case.engine_torque is not None and case.torque_limit > 0.0:
            reached = float(np.max(case.engine_torque))
            if abs(reached / case.torque_limit - 1.0) > TORQUE_GAP:
                yield Finding(
                    f"load case {case.name}: its engine torque reaches {reached:.0f} N m, and "
                    f"torque_limit_nm says {case.torque_limit:.0f} N m: are both in N m and not in "
                    "lbf ft, and those of this run?"
                )
    for first, second in combinations(load_cases, 2):
        same = [
            quantity
            for quantity in ("displacement", "force")
            if np.array_equal(getattr(first, quantity).values, getattr(second, quantity).values)
        ]
        if same:
            what = "numbers" if len(same) == 2 else f"{same[0]}s"
            yield Finding(
                f"load cases {first.name} and {second.name} hold the same {what}: name the file "
                "of each",
                certain=True,
            )


def _dead(frequency: RealArray, values: ComplexArray) -> str:
    """Say where a channel is zero or constant; empty where it is alive."""
    if np.all(values == 0.0):
        return "is 0 at all lines: measure it again, or leave the axis out"
    # neighbours of the edges of zeros: each pair is where a row of zeros begins and ends
    edges = np.diff(np.concatenate([[0], (values == 0.0).astype(int), [0]]))
    first, behind = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    if first.size and np.max(behind - first) > LONGEST_DROPOUT:
        longest = int(np.argmax(behind - first))
        lower, upper = frequency[first[longest]], frequency[behind[longest] - 1]
        return (
            f"is exactly 0 from {lower:g} to {upper:g} Hz: a sensor that dropped out, or a band "
            "filled up with zeros; export the lines that were measured"
        )
    if np.max(np.abs(values - values.mean())) <= 1e-6 * abs(values.mean()):
        return "is the same at all lines: no channel is; export it again"
    return ""


def _speeds(case: LoadCase) -> Iterator[Finding]:
    speed = rpm_of_frequency(case.force.frequency[[0, -1]], case.order)
    if speed[0] < SPEEDS[0] or speed[1] > SPEEDS[1]:
        yield Finding(
            f"load case {case.name}: its lines are those of {speed[0]:.0f} to {speed[1]:.0f} rpm "
            f"at order {case.order:g}: is the frequency that of the order, in Hz, and neither in "
            "rpm, in rad/s nor that of the shaft?"
        )


# ---- what carries the powertrain


def rigid_share(mounts: Sequence[Mount], load_case: LoadCase) -> float | None:
    """Return the part of a run's motion that a rigid powertrain explains [1].

    None where its mounts do not determine a rigid motion.
    """
    pieces = [(m, n) for m in mounts if m.carries_powertrain for n in range(len(m.pieces))]
    channels = [mount.channels(axis)[piece] for mount, piece in pieces for axis in AXES]
    forward = forward_matrices(np.array([m.positions[n] for m, n in pieces]).reshape(-1, 3))
    if not set(channels) <= set(load_case.displacement.channels) or not pieces:
        return None
    if np.linalg.matrix_rank(forward) < 6:
        return None
    return 1.0 - not_rigid(forward, load_case.displacement.select(channels).values)


def _carried(
    mounts: Sequence[Mount], powertrain: Powertrain | None, load_cases: Sequence[LoadCase]
) -> Iterator[Finding]:
    pieces = [(m, n) for m in mounts if m.carries_powertrain for n in range(len(m.pieces))]
    channels = [mount.channels(axis)[piece] for mount, piece in pieces for axis in AXES]
    places = np.array([mount.positions[piece] for mount, piece in pieces])
    forward = forward_matrices(places) if len(pieces) else np.zeros((0, 6))
    if not len(pieces) or np.linalg.matrix_rank(forward) < 6:
        return
    yield from _places(places, powertrain)
    for mount, piece in pieces:
        names = [mount.channels(axis)[piece] for axis in AXES]
        missing = [n for n in names if n not in load_cases[0].displacement.channels]
        if missing:
            yield Finding(
                f"mount {mount.name}: no motion of {', '.join(missing)}: a mount that carries the "
                "powertrain needs all three axes; measure them, or give it its body_mass_kg where "
                "it carries another body. Without, motion cannot answer"
            )
    if not set(channels) <= set(load_cases[0].displacement.channels):
        return
    moved = [case.displacement.select(channels).values for case in load_cases]
    left = [not_rigid(forward, each) for each in moved]
    wrong = [number for number, each in enumerate(left) if each > SMALL_RESIDUAL]
    if wrong:
        cases = [load_cases[number] for number in wrong]
        which = "" if len(wrong) == len(left) else f"load case {cases[0].name}: "
        displacement = np.vstack([moved[number] for number in wrong])
        residual = not_rigid(forward, displacement)
        frequency = np.concatenate([case.force.frequency for case in cases])
        if residual > SMALL_RESIDUAL:
            alarm = max(left) > LARGEST_RESIDUAL
            for finding in _not_of_a_body(pieces, places, frequency, displacement, residual):
                yield replace(finding, sentence=which + finding.sentence, alarm=alarm)
        return
    displacement = np.vstack(moved)
    frequency = np.concatenate([case.force.frequency for case in load_cases])
    groups = {name: [column] for column, name in enumerate(channels)}
    odd = odd_channels(forward, frequency, displacement[:, np.newaxis], groups)
    if odd is not None and odd.residual > LEAST_RESIDUAL and odd.clear:
        yield Finding(
            f"{100 * odd.residual:.1f} % of the motion of the powertrain's mounts is not that of a "
            f"rigid body: {odd.words}: correct the displacement where it is recorded"
        )
    if powertrain is not None:
        force = np.vstack([case.force.select(channels).values for case in load_cases])
        lines = np.concatenate([case.force.frequency for case in load_cases])
        yield from _unbalanced(powertrain, forward, displacement, force, lines)


def _places(places: RealArray, powertrain: Powertrain | None) -> Iterator[Finding]:
    for first, second in combinations(range(len(AXES)), 2):
        if np.array_equal(places[:, first], places[:, second]):
            yield Finding(
                f"the positions' columns {AXES[first]} and {AXES[second]} in the mount table hold "
                "the same numbers: was one pasted over the other?"
            )
    middle = places.mean(axis=0)
    spread = float(np.sqrt(np.mean(np.sum((places - middle) ** 2, axis=1))))
    off = float(np.linalg.norm(middle))
    if off > LARGEST_ECCENTRICITY * spread:
        yield Finding(
            f"the positions of the powertrain's mounts lie around a point {off:.3g} m from their "
            f"origin and within {spread:.3g} m of it: are they from the centre of gravity, not "
            "from the origin of the vehicle?"
        )
    if powertrain is None:
        return
    radius = float(np.sqrt(np.trace(powertrain.inertia) / (3.0 * powertrain.mass)))
    if not REACH[0] < spread / radius < REACH[1]:
        yield Finding(
            f"the positions of the powertrain's mounts lie {spread:.3g} m from their middle, and "
            f"its radius of gyration is {radius:.3g} m: is the unit in the header of the mount "
            "table that of the numbers (mm, cm, m), and the inertia in kg m²?"
        )


def _not_of_a_body(
    pieces: Sequence[tuple[Mount, int]],
    places: RealArray,
    frequency: RealArray,
    displacement: ComplexArray,
    residual: float,
) -> Iterator[Finding]:
    """Name the mistake in the positions that makes the motion rigid once undone."""
    trials: dict[str, RealArray] = {}
    for first, second in combinations(range(3), 2):
        order = [0, 1, 2]
        order[first], order[second] = second, first
        words = f"the columns {AXES[first]} and {AXES[second]} exchanged"
        trials[words] = places[:, order]
    for axis, words in enumerate(("x reversed", "y reversed (left is right)", "z reversed")):
        trials[words] = places * (1 - 2 * np.eye(3)[axis])
    for first, second in combinations(range(len(pieces)), 2):
        rows = np.arange(len(pieces))
        rows[[first, second]] = second, first
        names = [
            f"{pieces[n][0].name} {pieces[n][0].pieces[pieces[n][1]]}" for n in (first, second)
        ]
        trials[f"{names[0].strip()} and {names[1].strip()} exchanged"] = places[rows]
    for number, (mount, piece) in enumerate(pieces):
        for axis in range(3):
            name = f"{mount.name} {mount.pieces[piece]}".strip()
            signs = np.ones_like(places)
            signs[number, axis] = -1.0
            trials[f"{AXES[axis]} of {name} reversed"] = places * signs
    left = {
        words: not_rigid(forward_matrices(trial), displacement) for words, trial in trials.items()
    }
    best = min(left, key=lambda words: left[words])
    share = f"{100 * residual:.0f} % of the motion of the powertrain's mounts is not that of a "
    channels = [mount.channels(axis)[piece] for mount, piece in pieces for axis in AXES]
    rest = min(residual, left[best])  # a channel must explain more than any position
    words = reversed_channel(forward_matrices(places), displacement, channels, rest)
    groups = {name: [column] for column, name in enumerate(channels)}
    groups |= {
        f"{mount.name} {mount.pieces[piece]}".strip(): list(range(3 * k, 3 * k + 3))
        for k, (mount, piece) in enumerate(pieces)
    }
    odd = odd_channels(forward_matrices(places), frequency, displacement[:, np.newaxis], groups)
    if words and residual <= LARGEST_RESIDUAL:  # it moves little; beyond, the runs are refused
        yield Finding(f"{share}rigid body: {words}")
    elif not words and odd is not None and odd.left < left[best] / 2.0:
        yield Finding(
            f"{share}rigid body: {odd.words}: correct the displacement where it is recorded, or "
            "measure again; motion cannot answer other stiffnesses before"
        )
    elif left[best] < residual / CLEARLY_LESS:
        certain = residual > LARGEST_RESIDUAL > left[best]
        yield Finding(
            f"{share}rigid body; with the positions' {best} {100 * left[best]:.1f} % are left: "
            "correct the positions in the mount table (x rearward, y to the right, z up)",
            certain,
        )
    elif residual > LARGEST_RESIDUAL:
        yield Finding(
            f"{share}rigid body: check the positions, axes and signs of its mounts; motion cannot "
            "answer other stiffnesses before"
        )


def of_moving_body(mounts: Sequence[Mount], load_cases: Sequence[LoadCase]) -> str:
    """Say that displacements look absolute, those of a powertrain on a body that moves; else empty.

    A stiffness that is smooth over wheel torque, frequency and amplitude leaves noise of each run.
    What it leaves of absolute displacements is the body's own motion, alike in all runs over
    frequency, at most directions.

    - `load_cases`: as `platform_findings`.
    """
    cases = [in_mount_axes(mounts, case) for case in load_cases]
    lines = cases[0].force.frequency
    alike = all(np.array_equal(case.force.frequency, lines) for case in cases)
    if len(cases) < FEWEST_RUNS or not alike or len(cases) * lines.size < FEWEST_PER_RUNS:
        return ""
    moving = [
        (mount.name, name)
        for mount in mounts
        for piece in range(len(mount.pieces))
        for name in _moving(cases, [mount.channels(axis)[piece] for axis in AXES])
    ]
    shaped = [(mount, name) for mount, name in moving if _shaped_alike(cases, name)]
    if len({mount for mount, _ in shaped}) < 2 or 2 * len(shaped) <= len(moving):
        return ""
    return (
        f"{len(shaped)} of {len(moving)} directions of the mounts "
        f"({', '.join(name for _, name in shaped)}) change over frequency alike in all "
        f"{len(cases)} runs, as no rubber does and a body with its modes: are these absolute "
        "displacements of the powertrain? State those relative to the body"
    )


def _moving(cases: Sequence[LoadCase], channels: Sequence[str]) -> list[str]:
    """Name the directions of a mount that move enough to be judged, and have a force."""
    size = {
        name: float(np.linalg.norm([case.displacement.select([name]).values for case in cases]))
        for name in channels
        if name in cases[0].force.channels
        and all(np.all(case.force.select([name]).values != 0.0) for case in cases)
    }
    return [name for name in size if size[name] >= LEAST_SHARE * max(size.values())]


def _shaped_alike(cases: Sequence[LoadCase], name: str) -> bool:
    """Whether a stiffness that is smooth over its state leaves the same of a force in all runs."""
    displacement, force = (
        np.concatenate([getattr(case, what).select([name]).values[:, 0] for case in cases])
        for what in ("displacement", "force")
    )
    torque = [
        case.wheel_torque if case.engine_torque is not None else np.zeros(case.force.frequency.size)
        for case in cases
    ]
    frequency = [case.force.frequency for case in cases]
    amplitude = np.log(np.maximum(np.abs(displacement), np.finfo(float).tiny))
    state = np.stack([np.concatenate(torque), np.concatenate(frequency), amplitude])
    size = np.abs(force)
    rest = _not_smooth(displacement / size, force / size, state) * size / force
    of_runs = rest.reshape(len(cases), -1)
    n_run = len(cases)
    energy = float(np.mean(np.abs(of_runs) ** 2))
    of_mean = float(np.mean(np.abs(of_runs.mean(axis=0)) ** 2))
    # the mean over n runs keeps 1/n of the energy of noise
    common = (n_run * of_mean - energy) / (n_run - 1)
    return energy > ROUGH_STIFFNESS**2 and common > COMMON * energy


def _not_smooth(displacement: ComplexArray, force: ComplexArray, state: RealArray) -> ComplexArray:
    """Return what a complex stiffness that is smooth over a state (3, n) leaves of a force (n,)."""
    low, high = state.min(axis=1, keepdims=True), state.max(axis=1, keepdims=True)
    x, y, z = (2.0 * state - low - high) / np.where(high > low, high - low, 1.0)
    smooth = np.asarray(legvander3d(x, y, z, STIFFNESS_DEGREES), dtype=float)
    columns = smooth * displacement[:, np.newaxis]
    fit = np.linalg.lstsq(columns, force, rcond=None)[0]
    return np.asarray(force - columns @ fit)


def _out_of_time(mounts: Sequence[Mount], load_cases: Sequence[LoadCase]) -> Iterator[Finding]:
    """Name runs and directions whose force and displacement do not go together in time."""
    passive = []
    for case in load_cases:
        along = in_mount_axes(mounts, case)
        with suppress(InputError):  # such runs are refused, with their channels
            refuse_active_mounts(along)
            passive.append(along)
    late, unusual = loss_faults(passive)
    for sentence in (*late, *unusual):
        yield Finding(sentence)


def _unbalanced(
    powertrain: Powertrain,
    forward: RealArray,
    displacement: ComplexArray,
    force: ComplexArray,
    frequency: RealArray,
) -> Iterator[Finding]:
    """Compare the mounts' forces with the inertia forces of the body, by direction.

    ``Vᵀ f = ω² M q`` holds along directions in which nothing but the mounts acts.
    """
    motion = np.linalg.lstsq(forward, displacement.T, rcond=None)[0].T
    inertia = (2.0 * np.pi * frequency[:, np.newaxis]) ** 2 * (motion @ powertrain.mass_matrix)
    load = force @ forward
    cross = np.sum(inertia.conj() * load, axis=0)
    size, of_load = np.linalg.norm(inertia, axis=0), np.linalg.norm(load, axis=0)
    coherence = np.abs(cross) / np.maximum(size * of_load, np.finfo(float).tiny)
    ratio = cross.real / np.maximum(size**2, np.finfo(float).tiny)
    for what, part, key in (
        ("mass", slice(0, 3), "mass_kg"),
        ("inertia", slice(3, 6), "inertia_kg_m2"),
    ):
        shown = ratio[part][coherence[part] >= BALANCED]
        if shown.size and np.all((shown < BALANCE[0]) | (shown > BALANCE[1])):
            by = float(shown[np.argmin(np.abs(np.log(np.abs(shown))))])
            yield Finding(
                f"the forces of the mounts are {by:.3g} times what the {what} of [powertrain] "
                f"takes at the measured motion, where both go together: is {key} that of the whole "
                "powertrain, gearbox and fluids included, about its centre of gravity, and are "
                "displacement and force both peak values?"
            )


# ---- vehicles


def _vehicles(vehicles: Sequence[Vehicle]) -> Iterator[Finding]:
    values = {vehicle.name: vehicle.noise_transfer.values[:, 0] for vehicle in vehicles}
    for vehicle in vehicles:
        yield from _functions(vehicle)
    for first, second in combinations(vehicles, 2):
        if np.array_equal(values[first.name], values[second.name]):
            yield Finding(
                f"vehicles {first.name} and {second.name} have the same noise transfer functions: "
                "name the file of each",
                certain=True,
            )
    yield from _unlike_ears(vehicles)
    yield from _unlike_groups(vehicles)
    if len(vehicles) > FEWEST_VEHICLES:
        sizes = [np.sqrt(np.mean(np.abs(each) ** 2)) for each in values.values()]
        level = 20.0 * np.log10(np.maximum(sizes, np.finfo(float).tiny))
        for number, vehicle in enumerate(vehicles):
            others = np.delete(level, number)
            of_group = [level[k] for k, v in enumerate(vehicles) if v.group == vehicle.group]
            alike = of_group if len(of_group) > FEWEST_VEHICLES else others
            # a group may be loud, and a vehicle unlike its group
            middles = float(np.median(alike)), float(np.median(others))
            gap = min((level[number] - middle for middle in middles), key=abs)
            usual = 1.4826 * float(np.median(np.abs(others - np.median(others))))
            least = LOUDER if gap > 0.0 else QUIETER
            if abs(gap) > max(least, DEVIATIONS * max(usual, LEAST_DEVIATION)):
                yield Finding(
                    f"vehicle {vehicle.name}: its noise transfer functions lie {abs(gap):.0f} dB "
                    f"{'above' if gap > 0 else 'below'} those of the others: gain of an amplifier, "
                    "a frequency weighting, dB or another unit, such as lb for N, or a car without "
                    "its trim?"
                )
        yield from _unlike_levels_of_paths(vehicles)
    for group in dict.fromkeys(vehicle.group for vehicle in vehicles):
        yield from _unlike_paths([vehicle for vehicle in vehicles if vehicle.group == group])


def _functions(vehicle: Vehicle) -> Iterator[Finding]:
    """Look at the functions of one vehicle by themselves."""
    frf, whose = vehicle.noise_transfer, f"vehicle {vehicle.name}: its noise transfer functions"
    values = frf.values[:, 0]
    pairs = combinations(range(len(frf.inputs)), 2)
    same = [pair for pair in pairs if np.array_equal(values[:, pair[0]], values[:, pair[1]])]
    if same:
        words = "; ".join(f"{frf.inputs[a]} and {frf.inputs[b]}" for a, b in same)
        yield Finding(
            f"vehicle {vehicle.name}: noise transfer functions are the same ({words}): export each",
            certain=True,
        )
    for name, column in zip(frf.inputs, values.T, strict=True):
        if words := _dead(frf.frequency, column):
            yield Finding(f"{whose[:-1]} of {name} {words}", certain=True)
    if not np.any(values.imag):
        yield Finding(
            f"{whose} have no imaginary part: magnitudes or levels without phase; export them "
            "complex",
            certain=True,
        )
        return
    in_line = np.abs(np.sum(values**2, axis=0)) / np.sum(np.abs(values) ** 2, axis=0)
    if np.median(in_line) > IN_LINE:
        yield Finding(
            f"{whose} have a phase that does not change over frequency: are they means of "
            "magnitudes, of seats or of cars? Average complex functions, or export one"
        )
        return
    if sentence := _jump(frf.frequency, values):
        yield Finding(f"{whose} {sentence}")
        return
    step, middle = np.diff(values, axis=0), (values[1:] + values[:-1]) / 2.0
    # by line, so that a mode between two lines does not count for all
    rough = np.median(np.linalg.norm(step, axis=1) / _size_between(values))
    if rough > ROUGH:
        yield Finding(
            f"{whose} change from line to line by {rough:.1f} times their size: are their phases "
            "in degrees where radians are meant, or are their lines mixed up?"
        )
        return
    omega = 2.0 * np.pi * np.diff(frf.frequency)[:, np.newaxis]
    # of a causal system the mean group delay, weighted by energy, is that of its response in time
    delay = float(np.sum(-np.imag(middle.conj() * step / omega)) / np.sum(np.abs(middle) ** 2))
    if delay < 0.0:
        yield Finding(
            f"{whose} answer {-1e3 * delay:.0f} ms before the force: they are conjugated, "
            "exp(−jωt) or force over pressure exchanged; export them with exp(+jωt)"
        )


def _size_between(values: ComplexArray) -> RealArray:
    """Return the size of functions (f, path) between neighbouring lines, shape (f - 1,)."""
    squares = np.sum(np.abs(values) ** 2, axis=1)
    return np.asarray(np.sqrt(np.maximum((squares[1:] + squares[:-1]) / 2.0, 1e-300)))


def _jump(frequency: RealArray, values: ComplexArray) -> str:
    """Say where functions (f, path) jump at most paths, which no resonance does; else empty."""
    steps = np.diff(frequency)
    logarithm = np.log(np.maximum(np.abs(values), 1e-300))
    change = np.median(np.diff(logarithm, axis=0), axis=1)
    missing = steps > 1.5 * np.median(steps)
    change[missing] = 0.0
    inner = slice(2, -2)
    size = np.abs(change)
    # the other side of a mode may lie in what is missing
    beside = np.where(missing, np.inf, size)
    quiet = np.maximum(beside[1:-3], beside[3:-1]) < np.log(SMOOTH)
    jumps = np.flatnonzero((size[inner] > np.log(JUMP)) & quiet) + 2
    if jumps.size:
        at = frequency[jumps[0] + 1]
        return (
            f"jump by a factor of {np.exp(size[jumps[0]]):.2g} at {at:g} Hz at most paths: was a "
            "range switched, or were two measurements joined?"
        )
    for mains in MAINS:
        k = int(np.argmin(np.abs(frequency - mains)))
        if not 0 < k < frequency.size - 1 or abs(frequency[k] - mains) > np.median(steps) / 2.0:
            continue
        if min(change[k - 1], -change[k]) > np.log(JUMP):
            return (
                f"have a single line at {frequency[k]:g} Hz that stands out by a factor of "
                f"{np.exp(change[k - 1]):.2g} at most paths: hum of the mains? Measure without it"
            )
    return ""


def _unlike_ears(vehicles: Sequence[Vehicle]) -> Iterator[Finding]:
    ears = [vehicle.noise_transfer.outputs[0].strip().lower() for vehicle in vehicles]
    usual = max(ears, key=ears.count)
    others = [n for n, ear in enumerate(ears) if ear != usual and not ear.startswith("node ")]
    if len(vehicles) > FEWEST_VEHICLES and 0 < len(others) <= len(vehicles) // 4:
        for number in others:
            vehicle = vehicles[number]
            yield Finding(
                f"vehicle {vehicle.name}: its microphone is '{vehicle.noise_transfer.outputs[0]}', "
                f"that of the others '{usual}': is it the driver's ear?"
            )


def _unlike_groups(vehicles: Sequence[Vehicle]) -> Iterator[Finding]:
    groups = {vehicle.group for vehicle in vehicles}
    for vehicle in vehicles:
        named = [group for group in groups if vehicle.name.startswith(group)]
        if named and not vehicle.name.startswith(vehicle.group):
            yield Finding(
                f"vehicle {vehicle.name} is in group {vehicle.group}, and its name begins like "
                f"group {max(named, key=len)}: which is right?"
            )


def _unlike_levels_of_paths(vehicles: Sequence[Vehicle]) -> Iterator[Finding]:
    """Compare the level of each path beside the vehicle's others with the other vehicles."""
    sizes = np.stack(
        [np.sqrt(np.mean(np.abs(v.noise_transfer.values[:, 0]) ** 2, axis=0)) for v in vehicles]
    )
    level = 20.0 * np.log10(np.maximum(sizes, np.finfo(float).tiny))
    level = level - np.median(level, axis=1, keepdims=True)
    for number, vehicle in enumerate(vehicles):
        gaps = level[number] - np.median(np.delete(level, number, axis=0), axis=0)
        for name, gap in zip(vehicle.noise_transfer.inputs, gaps, strict=True):
            if abs(gap) > PATH_GAP:
                yield Finding(
                    f"vehicle {vehicle.name}: its noise transfer function of {name} lies "
                    f"{abs(gap):.0f} dB {'above' if gap > 0 else 'below'} what its other paths and "
                    "the other vehicles let expect: check the gain and the blow of this path"
                )


def _unlike_paths(vehicles: Sequence[Vehicle]) -> Iterator[Finding]:
    """Compare each path with the same one of the other vehicles of the group."""
    if len(vehicles) <= FEWEST_VEHICLES:
        return
    values = np.stack([vehicle.noise_transfer.values[:, 0] for vehicle in vehicles])
    values = values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-300)
    for number, vehicle in enumerate(vehicles):
        others = np.delete(values, number, axis=0).mean(axis=0)
        agreed = np.linalg.norm(others, axis=0)
        others = others / np.maximum(agreed, 1e-300)
        likeness = np.real(values[number].conj().T @ others)
        names, same_path = vehicle.noise_transfer.inputs, likeness.diagonal()
        opposite = [
            name
            for name, like, alike in zip(names, same_path, agreed, strict=True)
            if like < OPPOSITE and alike > AGREED
        ]
        if opposite:
            yield Finding(
                f"vehicle {vehicle.name}: its noise transfer functions of {', '.join(opposite)} "
                f"have the opposite sign of those of the other vehicles of group {vehicle.group}: "
                "check the direction of the blow"
            )
        for first, second in combinations(range(len(names)), 2):
            gains = (
                likeness[first, second] - same_path[first],
                likeness[second, first] - same_path[second],
            )
            exchanged = min(likeness[first, second], likeness[second, first])
            if min(gains) > LIKELIER and exchanged > LIKE:
                yield Finding(
                    f"vehicle {vehicle.name}: its noise transfer functions of {names[first]} and "
                    f"{names[second]} look exchanged beside those of group {vehicle.group}: check "
                    "the nodes"
                )
