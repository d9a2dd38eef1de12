"""Check a folder of any kind: list its faults, or show its content."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import DataWarning, InputError
from deboom.files.campaign import CampaignFile, read_campaign, read_time_run
from deboom.files.folders import FOLDERS, kind_of_folder
from deboom.files.platform import PlatformFile, assembled, read_functions, read_tables
from deboom.files.schema import load_toml, noting, telling
from deboom.files.units import RANGES
from deboom.measurement.campaign import OperatingRun
from deboom.measurement.channels import Band, LoadCase
from deboom.measurement.order_tracking import tracked_run
from deboom.mounts.campaign_findings import at_mounts, campaign_findings
from deboom.mounts.characterise import cross_stiffness_of_campaign
from deboom.mounts.cross_stiffness import CrossStiffness, cross_stiffness_of_runs
from deboom.mounts.losses import Loss, loss_faults, losses
from deboom.mounts.measuring_chain import InstrumentedBody, instrumented_bodies
from deboom.mounts.mount import in_mount_axes, not_identified, refuse_active_mounts
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.rigid_body import not_rigid
from deboom.physics.sound_level import spl
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.expected_change import Information, known_of_body
from deboom.vehicles.fleet import Fleet, path_contributions
from deboom.vehicles.idle import IdleModel, IdleRun, idle_model
from deboom.vehicles.platform import BAND, LIBRARY_FILE, PLATFORM_FILE, MountSource, Platform
from deboom.vehicles.plausibility import of_moving_body, rigid_share
from deboom.vehicles.receivers import Receiver


class Stage(Enum):
    """Stages of a check: each has to be without a fault before the next one is looked at."""

    keys = "the keys of its TOML file"
    tables = "tables"
    functions = "files of functions"
    physics = "signs, frequency band and mount library"

    @property
    def later(self) -> tuple[str, ...]:
        """What is not looked at while this stage has a fault, in words."""
        stages = list(Stage)
        return tuple(stage.value for stage in stages[stages.index(self) + 1 :])


@dataclass(frozen=True, eq=False)
class PlatformCheck:
    """What a check found.

    - `faults`: all of the first stage that has one, a sentence each.
    - `waiting`: the later stages, which were not looked at because of them.
    - `platform`: what studies would read; None with a fault in its files.
    """

    faults: tuple[str, ...]
    waiting: tuple[str, ...]
    platform: Platform | None

    @property
    def summary(self) -> str:
        """What a platform without a fault holds, one item a line; empty with one."""
        if self.faults or self.platform is None:
            return ""
        return _aligned(list(_summary(self.platform)))


def _aligned(lines: Sequence[tuple[str, str]]) -> str:
    width = max(len(name) for name, _ in lines) + 2
    return "\n".join(f"{name:<{width}}{text}" for name, text in lines)


def check_folder(folder: Path) -> tuple[tuple[str, ...], tuple[str, ...], str]:
    """List what is wrong in a folder of any kind, or say what it holds.

    - `folder`: its file, such as ``campaign.toml``, says of which kind it is.
    - returns `faults`, `waiting`, `summary`: as in `PlatformCheck`.
    """
    waiting: tuple[str, ...] = ()
    try:
        record = FOLDERS[kind_of_folder(folder)]
        if record.lines is None:
            check = check_platform(folder)
            return check.faults, check.waiting, check.summary
        waiting = ("the files that it names",)
        file = load_toml(folder / record.file, record.keys)
        waiting = ()
        lines = list(record.lines(folder))
        if isinstance(file, CampaignFile):
            lines += _campaign(folder, file)
        return (), (), _aligned(lines)
    except InputError as error:
        return error.sentences, waiting, ""


def _campaign(folder: Path, file: CampaignFile) -> Iterator[tuple[str, str]]:
    """Track the runs over time of a campaign, and judge them with its other runs.

    - raises InputError: a run over time that cannot be read or tracked.
    """
    campaign = read_campaign(folder)
    over_time = []
    with telling() as tell:
        for entry in file.untracked_runs:
            with noting(tell):
                tracked = tracked_run(read_time_run(folder, entry.name))
                over_time.append(tracked.run)
                for line in tracked.report():
                    word, warns, text = line.rpartition("WARNING: ")
                    yield ("WARNING" if warns else "time run"), f"{entry.name}: {word}{text}"
    # sensors that do not allow a judgement are refused where mounts are characterised
    with suppress(InputError):
        doubts = campaign_findings(campaign, over_time)
        for finding in doubts:
            yield finding.word, finding.sentence
        # cross stiffness of channels that contradict each other says nothing
        if not doubts:
            for sentence in _alarms(cross_stiffness_of_campaign(campaign)):
                yield "ALARM", sentence
        runs = (*campaign.runs, *over_time)
        for body in instrumented_bodies(campaign):
            if body.is_rigid_body:
                yield from _losses_of_campaign(body, runs)


def _losses_of_campaign(
    body: InstrumentedBody, runs: Sequence[OperatingRun]
) -> Iterator[tuple[str, str]]:
    """Say how the mounts of each set lose energy, and how much of their motion is rigid."""
    for mount_set in dict.fromkeys(run.mount_set for run in runs):
        of_set = [run for run in runs if run.mount_set == mount_set]
        rows = [row for run in of_set for row in losses(at_mounts(body, run))]
        share = 1.0 - max(
            not_rigid(body.forward, run.acceleration.select(body.channels).values) for run in of_set
        )
        yield (
            "losses",
            f"{mount_set}, {len(of_set)} runs: {losses_in_words(rows, share)} in the worst",
        )


def check_platform(folder: Path) -> PlatformCheck:
    """Read a platform folder to its end and list what is wrong.

    Parameters
    ----------
    folder : Path
        With ``platform.toml``.

    Returns
    -------
    PlatformCheck
        All faults of the first of four stages that has one: keys of ``platform.toml``, tables,
        files of functions, physics. The first three are what
        `deboom.files.platform.read_platform` refuses. The last one is mounts that would be
        active, a channel whose reversal makes the powertrain's motion rigid, what
        `Platform.findings` is certain of, and a mount library that does not fit. What is only
        likely is a WARNING of the summary. A study refuses and warns of the same.

    Raises
    ------
    InputError
        Never for a fault of the platform: faults are in the result.

    See Also
    --------
    deboom.read_platform, deboom.Platform

    Examples
    --------
    >>> import deboom
    >>> from pathlib import Path
    >>> deboom.check_platform(Path("nowhere")).faults[0]
    'nowhere: there is no such folder: `deboom new platform nowhere` writes one'
    """
    stage, platform = Stage.keys, None
    try:
        if not folder.is_dir():
            raise InputError(
                f"{folder}: there is no such folder: `deboom new platform {folder}` writes one"
            )
        file = load_toml(folder / PLATFORM_FILE, PlatformFile)
        stage = Stage.tables
        tables = read_tables(folder, file)
        stage = Stage.functions
        functions = read_functions(folder, file, tables)
        platform = assembled(folder, file, tables, functions)
        stage = Stage.physics
        with warnings.catch_warnings():
            # what is likely is part of the summary
            warnings.simplefilter("ignore", DataWarning)
            _refuse_physics(platform)
    except InputError as error:
        return PlatformCheck(error.sentences, stage.later, platform)
    return PlatformCheck((), (), platform)


def _refuse_physics(platform: Platform) -> None:
    """Refuse what no car does, and a mount library that does not fit."""
    with telling() as tell:
        cases = [in_mount_axes(platform.mounts, case) for case in platform.load_cases]
        active: list[InputError] = []
        for case in cases:
            with noting(active.append):
                refuse_active_mounts(case)
        # a delay explains active mounts
        late = loss_faults(cases)[0] if active else ()
        for fault in (*map(InputError, late), *active):
            tell(fault)
        with noting(tell):
            platform.refuse_contradictions()
        for run in platform.idle:
            with noting(tell):
                _at_idle(platform, run)
    if platform.library_file.exists():
        every = [case.name for case in platform.load_cases]
        platform.runs(every, mounts=MountSource.library_inside)


def _at_idle(platform: Platform, run: IdleRun) -> IdleModel:
    """Return the model of a run at idle with the motion as measured."""
    with warnings.catch_warnings():
        # brackets do not count in this motion, which the summary says elsewhere
        warnings.simplefilter("ignore", DataWarning)
        return idle_model(
            run,
            platform.fleet,
            platform.mounts,
            motion=Motion.prescribed,
            powertrain=platform.powertrain,
        )


def idle_in_words(idle: IdleModel) -> str:
    """Say which orders of a run at idle count, and how loud it is where it is loudest."""
    run, orders = idle.run, idle.orders
    words = (
        f"{run.name}: {run.case.title}; {run.speed:g} rpm, orders "
        f"{', '.join(f'{order:g}' for order in orders)}"
    )
    if idle.left_out.size:
        words += (
            f"; orders {', '.join(f'{order:g}' for order in idle.left_out)} are left out, because "
            "no functions were measured there"
        )
    levels = idle(np.ones((1, len(idle.variable_names))))[0]
    loudest: dict[str, tuple[float, str]] = {}
    for name, receiver, level in zip(idle.response_names, idle.receivers, levels, strict=True):
        unit = receiver.level_unit
        loudest[unit] = max(loudest.get(unit, (-np.inf, "")), (float(level), name))
    most = ", ".join(f"{level:.1f} {unit} in {name}" for unit, (level, name) in loudest.items())
    return f"{words}; largest level of all orders {most}"


def _summary(platform: Platform) -> Iterator[tuple[str, str]]:
    case = platform.load_cases[0]
    lines = case.force.frequency
    band = platform.band
    inside = lines[(lines >= band[0]) & (lines <= band[1])]
    rpm = rpm_of_frequency(inside[[0, -1]], case.order)
    variables = sum(len(mount.variables) for mount in platform.mounts)
    groups = dict.fromkeys(vehicle.group for vehicle in platform.fleet.vehicles)
    steps = np.diff(lines)
    even = np.ptp(steps) <= 1e-3 * steps.mean()
    yield "platform", f"{platform.name}: {platform.title}"
    engine = (
        f"engine of {platform.cylinders} cylinders"
        if platform.cylinders
        else "electric drive, because [engine] states no cylinders"
    )
    yield "drive", engine
    yield (
        "mounts",
        f"{len(platform.mounts)}, {variables} variables: "
        + ", ".join(
            mount.name
            + (f" ({', '.join(mount.pieces)})" if len(mount.pieces) > 1 else "")
            + f" {''.join(mount.transfer_axes) or 'no path'}"
            for mount in platform.mounts
        ),
    )
    if words := pieces_in_words(platform):
        yield "pieces", words
    if words := unidentified_in_words(platform, platform.load_cases):
        yield "not identified", words
    for finding in platform.findings:
        yield finding.word, finding.sentence
    crossed = _alarms(cross_stiffness_of_runs(platform.mounts, platform.load_cases))
    # motion of the body looks like cross stiffness
    if crossed and not of_moving_body(platform.mounts, platform.load_cases):
        for sentence in crossed:
            yield "ALARM", sentence
    for group in groups:
        names = [entry.name for entry in platform.fleet.vehicles if entry.group == group]
        yield "vehicles", f"{len(names)} in group {group}: {', '.join(names)}"
    for words in receivers_in_words(platform.fleet):
        yield "receivers", words
    if words := rubber_in_words(platform):
        yield "rubber", f"stiffness in the car over that in the test: {words}"
    if words := brackets_in_words(platform):
        yield "brackets", words
    if words := bodies_in_words(platform):
        yield "bodies", words
    yield (
        "lines",
        f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz, "
        + (f"every {steps.mean():.4g} Hz" if even else "unevenly spaced"),
    )
    for entry in platform.load_cases:
        default = " (default)" if entry.name == platform.default_load_case else ""
        torque = "with engine torque" if entry.engine_torque is not None else "no engine torque"
        yield "load case", f"{entry.name}{default}: {entry.title}; gear {entry.gear}, {torque}"
    for run in platform.idle:
        yield "idle", idle_in_words(_at_idle(platform, run))
    for entry in platform.load_cases:
        rows = losses(in_mount_axes(platform.mounts, entry))
        words = losses_in_words(rows, rigid_share(platform.mounts, entry))
        yield "losses", f"{entry.name}: {words}"
    yield (
        "band",
        f"{inside.size} lines in {band[0]:g} to {band[1]:g} Hz: {rpm[0]:.0f} to {rpm[1]:.0f} rpm "
        f"of order {case.order:g}",
    )
    if words := band_in_words(platform, band):
        yield "other band", words
    for name, sizes in _sizes(platform).items():
        words = RANGES[name].sentence(float(np.min(sizes)), float(np.max(sizes)))
        yield name, words + _peak_in_words(platform, name)
    if (platform.folder / LIBRARY_FILE).exists():
        yield "library", f"{LIBRARY_FILE} fits all mounts"
    else:
        yield "library", f"no {LIBRARY_FILE}: studies need --mounts spectra"


def losses_in_words(rows: Sequence[Loss], share: float | None) -> str:
    """Say how mounts lose energy in runs, and how much of it is a rigid motion.

    - `share`: `deboom.vehicles.plausibility.rigid_share`.
    """
    judged = [row for row in rows if row.judged]
    words = "no direction moves enough to tell a loss factor"
    if judged:
        factors, phases = [row.factor for row in judged], [row.phase for row in judged]
        words = (
            f"loss factors {min(factors):.2g} to {max(factors):.2g}, phases {min(phases):+.0f} to "
            f"{max(phases):+.0f} degrees"
        )
    return words if share is None else f"{words}; {100 * share:.1f} % of the motion is rigid"


def _peak_in_words(platform: Platform, name: str) -> str:
    """Say that channels are shown by their median over the lines, and the largest value of all."""
    if name not in ("displacement", "force"):
        return ""
    peak, case, channel = max(
        (float(np.max(np.abs(column))), case.name, channel)
        for case in platform.load_cases
        for spectrum in [getattr(case, name)]
        for channel, column in zip(spectrum.channels, spectrum.values.T, strict=True)
    )
    shown = RANGES[name]
    return (
        f", medians of the channels over the lines; largest {shown.factor * peak:.3g} "
        f"{shown.shown} ({channel} in {case})"
    )


def _alarms(judged: Sequence[CrossStiffness]) -> list[str]:
    """Return a sentence for each mount that seems to stand at an angle that is not stated."""
    return [mount.sentence for mount in judged if mount.clear]


def bodies_in_words(platform: Platform) -> str:
    """Say of how many vehicles what is known of the body; empty where nothing is."""
    numbers = Counter(map(known_of_body, platform.fleet.vehicles))
    numbers.pop(Information.unknown, None)
    words = ", ".join(f"{state.value} of {number} vehicles" for state, number in numbers.items())
    if Information.driving_points in numbers:
        words += "; in coupled motion a driving point gives way to its own force alone"
    return words


def brackets_in_words(platform: Platform) -> str:
    """Name the mounts with a bracket, and on which side; empty where none is stated."""
    words = [
        f"{mount.name} ({' and '.join(bracket.side for bracket in mount.brackets)})"
        for mount in platform.mounts
        if mount.brackets
    ]
    if not words:
        return ""
    return f"{', '.join(words)}; factors are of the rubber, cars have it in series with them"


def receivers_in_words(fleet: Fleet) -> Iterator[str]:
    """Give the receivers beside the ears, each with its vehicles and the unit of its level."""
    vehicles: dict[Receiver, list[str]] = {}
    for vehicle in fleet.vehicles:
        for receiver in vehicle.receivers:
            vehicles.setdefault(receiver, []).append(vehicle.name)
    for receiver, names in vehicles.items():
        kind = "sound" if receiver.is_sound else receiver.quantity
        yield f"{receiver.name}, {kind} [{receiver.level_unit}], in {', '.join(names)}"


def rubber_in_words(platform: Platform) -> str:
    """Say how stiff rubber is expected to be in the car, over its test; empty where unstated."""
    return ", ".join(
        f"{mount.name} {mount.rubber.factor:.2f}" for mount in platform.mounts if mount.rubber
    )


def pieces_in_words(platform: Platform) -> str:
    """Say whether the pieces of a mount keep their own noise transfer functions."""
    inputs = platform.fleet.vehicles[0].noise_transfer.inputs
    words = []
    for mount in platform.mounts:
        if len(mount.pieces) > 1 and mount.paths:
            apart = set(mount.channels(mount.transfer_axes[0])) <= set(inputs)
            words.append(
                f"{mount.name}: each piece with its own noise transfer function"
                if apart
                else f"{mount.name}: one noise transfer function times the summed forces of its "
                "pieces, right only where these are alike"
            )
    return "; ".join(words)


def band_in_words(platform: Platform, band: Band) -> str:
    """Name both bands where the data do not span the usual one; empty where they do."""
    if platform.spans_band:
        return ""
    lines = platform.load_cases[0].force.frequency
    return (
        f"The booming index counts the lines from {band[0]:g} to {band[1]:g} Hz instead of the "
        f"usual {BAND[0]:g} to {BAND[1]:g} Hz, which the data do not span ({lines[0]:g} to "
        f"{lines[-1]:g} Hz): compare it with no index of the usual band."
    )


def unidentified_in_words(platform: Platform, load_cases: Sequence[LoadCase]) -> str:
    """Name the mount directions that hardly move; empty where all of them do."""
    along = [in_mount_axes(platform.mounts, case) for case in load_cases]
    cases = {case.name: not_identified(case) for case in along}
    words = [f"{', '.join(names)} ({case})" for case, names in cases.items() if names]
    if not words:
        return ""
    return (
        f"{'; '.join(words)}: hardly moves, so that force and displacement do not go together; the "
        "force counts as measured, the stiffness is not known"
    )


def _sizes(platform: Platform) -> dict[str, RealArray]:
    """Return magnitudes of what was measured: of a channel, the median over its lines."""
    cases = platform.load_cases
    forces = [np.median(np.abs(case.force.values), axis=0) for case in cases]
    motions = [np.median(np.abs(case.displacement.values), axis=0) for case in cases]
    vehicles = platform.fleet.vehicles
    transfer = [np.median(np.abs(each.noise_transfer.values), axis=0) for each in vehicles]
    levels = []
    for case in cases:
        paths = path_contributions(platform.fleet, platform.mounts, case, platform.band)
        pressure = paths.pressure(np.ones((1, len(paths.variable_names))))[0]
        heard = [receiver.is_sound for receiver in platform.fleet.receivers]
        levels.append(spl(pressure[heard], paths.frequency, axis=-1).max(axis=-1))
    sizes = {
        "position": np.abs([place for mount in platform.mounts for place in mount.positions]),
        "displacement": np.concatenate(motions),
        "force": np.concatenate(forces),
        "stiffness": np.concatenate([f / s for f, s in zip(forces, motions, strict=True)]),
        "noise transfer function": np.concatenate(transfer, axis=None),
        "level": np.concatenate(levels),
    }
    torques = [np.abs(case.engine_torque) for case in cases if case.engine_torque is not None]
    return sizes | ({"engine torque": np.concatenate(torques)} if torques else {})
