"""Writes a measurement campaign on the virtual bench, and the truth beside it."""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_files import (
    CHANNEL_TABLE,
    MOUNT_TABLE,
    SENSOR_TABLE,
    campaign_file,
    channel_table,
    curve_directions,
    curve_file,
    order_functions,
    push_file,
    push_functions,
    run_file,
    sensor_rows,
    shaker_file,
    shaker_functions,
    time_functions,
    time_run_file,
    time_run_name,
)
from deboom.bench.campaign_plan import FULL_PLAN, CampaignErrors, CampaignPlan, TimeRunPlan
from deboom.bench.campaign_recording import (
    CampaignSensors,
    TimeSignals,
    draw_campaign_sensors,
    push_answer,
    record,
    record_over_time,
    shaker_answer,
    static_direction_forces,
    true_run,
)
from deboom.bench.layout import (
    ACCELEROMETER_MODEL,
    CELL_MODEL,
    CELL_SHARES,
    CYLINDERS,
    ENGINE_NODE,
    TACHO_NODE,
    THREE_CELL_SHARES,
    Place,
    accelerometer_places,
    cell_places,
    points,
    push_places,
)
from deboom.bench.operating_run import OperatingRun, mount_moments
from deboom.bench.platform_writer import mount_rows, write_powertrain_truth
from deboom.bench.powertrain import AXES, VirtualBench, load_bench, mount_set, with_mount_set
from deboom.bench.sensors import DataSheet, draw_data_sheet
from deboom.errors import InputError
from deboom.files.campaign import dump_campaign_file
from deboom.files.campaign_tables import write_campaign_channels, write_curve, write_sensor_table
from deboom.files.folders import complete_or_not_at_all, replace_text
from deboom.files.platform import write_mount_table
from deboom.files.uff import AxisDriftWarning, write_uff


def readme_text(bench: VirtualBench, plan: CampaignPlan, seed: int) -> str:
    """Return ``README.txt``: every file, and the map from nodes to sensors and mounts."""
    order, lines = bench.order_torque.order, plan.frequency
    each = THREE_CELL_SHARES if plan.third_cell else CELL_SHARES
    shares = " and ".join(f"{100 * share:.0f} %" for share in each)
    carried = f"{'three' if plan.third_cell else 'two'} under a mount carry {shares}"
    pushes = [
        "shaker/MOUNT_PUSH_N.uff  the same of pushes beside the virtual point, see campaign.toml"
    ]
    title = f"Measurement campaign on the virtual bench, seed {seed}"
    text = [
        title,
        "=" * len(title),
        "",
        "Virtual measurements with the errors of real sensors, shaker and order tracking. Nobody",
        "measured this.",
        "",
        f"Mount sets: {', '.join(plan.mount_sets)}. M0 is as drawn; M1 and higher are units with",
        "their manufacturing spread, the same parts in every campaign.",
        "",
        f"Runs: {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, engine order {order:g},",
        "SI units, complex peak amplitudes, time factor e^{+jwt}, phase to the tacho. x points",
        "rearward, y to the right, z up; positions count from the powertrain's centre of gravity.",
        "UFF files: binary, data set 58.",
        "",
        "campaign.toml            names every other file; engine, data sheet, tolerances",
        f"{MOUNT_TABLE:<24} virtual point of every mount",
        f"{SENSOR_TABLE:<24} position sheet; angles turn vehicle axes into sensor axes, about the",
        "                         fixed axes x, then y, then z",
        f"{CHANNEL_TABLE:<24} which node and direction is which channel, and its unit",
        "runs/SET/RUN.uff         acceleration and cell force in sensor axes (type 0, complex),",
        "                         static force per direction, engine torque and speed (real)",
        "shaker/MOUNT_AXIS_N.uff  cells per newton of the shaker at the virtual point, repeat N",
        *(pushes if plan.third_cell else ()),
        "static_curves/           force over deflection of every direction, as suppliers send it",
        "time/                    a run over time with tacho, where there is one (type 1)",
        "truth/                   the exact values behind the measurements, for verification only",
        "",
        f"Accelerometers ({ACCELEROMETER_MODEL}):",
        *_table(accelerometer_places(bench)),
        f"Force cells ({CELL_MODEL}); {carried}, their sum is its force:",
        *_table(cell_places(bench, plan.third_cell)),
        "Static forces:",
        *(
            f"    node {point.node:<4} {point.channel(axis)}"
            for point in points(bench.mount_names)
            for axis in point.axes
        ),
        f"Engine torque and speed: node {ENGINE_NODE}. Tacho: node {TACHO_NODE}.",
    ]
    return "\n".join(text) + "\n"


def _table(places: tuple[Place, ...]) -> list[str]:
    return [
        f"    node {place.node:<4} {place.sensor:<4} {f'{place.mount} {place.piece}'.strip()}"
        for place in places
    ]


def write_set_truth(
    path: Path,
    names: Sequence[str],
    runs: Sequence[OperatingRun],
    static: Sequence[RealArray],
    moments: Sequence[ComplexArray] | None = None,
) -> None:
    """Write the truth of all runs with one mount set.

    Parameters
    ----------
    path : Path
        ``.npz``; arrays have the shape (run, f, channel).
    names : sequence of str
        Of the runs.
    runs : sequence of OperatingRun
        The truth.
    static : sequence of array, shape (f, n_channel)
        True static force of every channel [N].
    moments : sequence of array, shape (f, n_mount, 3), optional
        Of the powertrain mounts, about their virtual points, where cells show them [N m].
    """
    optional: dict[str, Any] = {} if moments is None else {"moment": np.array(moments)}
    np.savez(
        path,
        frequency=runs[0].frequency,
        runs=np.array(names),
        channels=np.array(runs[0].channels),
        displacement=np.array([run.displacement for run in runs]),
        force=np.array([run.force for run in runs]),
        stiffness=np.array([run.stiffness for run in runs]),
        motion=np.array([run.powertrain.motion for run in runs]),
        engine_torque=np.array([run.engine_torque for run in runs]),
        static_force=np.array(static),
        **optional,
    )


def write_bench_truth(
    folder: Path, bench: VirtualBench, sheet: DataSheet, sensors: CampaignSensors
) -> None:
    """Write what the sensors truly do and the true powertrain.

    Parameters
    ----------
    folder : Path
        Exists.
    bench, sheet, sensors
        What was measured with what.
    """
    optional: dict[str, Any] = {}
    if sensors.third_cell:
        optional["moment_pushes"] = sensors.moment_pushes
    np.savez(
        folder / "sensors.npz",
        positions=sensors.true_positions,
        orientations=sensors.true_orientations,
        sensitivity=sensors.sensitivity,
        cells=sensors.cells,
        side_cells=sensors.side_cells,
        pushes=sensors.pushes,
        drift=sensors.drift,
        **optional,
    )
    write_powertrain_truth(folder, bench, sheet)


def write_time_truth(path: Path, signals: TimeSignals) -> None:
    """Write the steady states that a run over time passes through, and its speed.

    Parameters
    ----------
    path : Path
        ``.npz``.
    signals : TimeSignals
        With their truth.
    """
    np.savez(
        path,
        frequency=signals.steady.frequency,
        acceleration=signals.steady_acceleration,
        cell_force=signals.steady_cell_force,
        channels=np.array(signals.steady.channels),
        displacement=signals.steady.displacement,
        force=signals.steady.force,
        stiffness=signals.steady.stiffness,
        engine_torque=signals.steady.engine_torque,
        time=signals.time,
        speed=signals.speed,
    )


Progress = Callable[[int, int, str], None]

CURVE_REACH = 15e-3
"""To which suppliers measure their force-deflection curves, both ways [m]."""

CURVE_STEP = 0.1e-3
"""[m]"""


def write_campaign(
    folder: Path,
    seed: int,
    plan: CampaignPlan = FULL_PLAN,
    errors: CampaignErrors | None = None,
    progress: Progress | None = None,
    bench: VirtualBench | None = None,
    cylinders: int = CYLINDERS,
) -> Path:
    """Measure a campaign on the virtual bench and write its files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        From 1, of one bench: it draws the errors of its sensors once for all runs, and the noise of
        every run. A run does not depend on which others are planned. The data sheet is that of the
        virtual platform of the same seed.
    plan : CampaignPlan
        Mount sets and runs; by default everything.
    errors : CampaignErrors, optional
        How large the errors are; by default those of a good bench, with
        `deboom.bench.campaign_plan.NO_ERRORS` there are none.
    progress : callable, optional
        Called with the files written so far, all files, and the name of the last one.
    bench : VirtualBench, optional
        Powertrain and mounts as drawn; by default the virtual platform's.
    cylinders : int
        Of its engine.

    Returns
    -------
    Path
        The folder, with ``campaign.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; a mount set or gear that does not exist; a folder that is not empty or cannot
        be written.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    bench, errors = bench or load_bench(), errors or CampaignErrors()
    for name in plan.mount_sets:
        mount_set(name, bench)  # refuse before any work
    # the first four children belong to the virtual platform of the same seed
    for_sheet, *_, for_sensors = np.random.SeedSequence(seed).spawn(5)
    exact = DataSheet(bench.mass, bench.inertia, np.zeros(3))
    drawn = draw_data_sheet(bench, np.random.default_rng(for_sheet))
    with complete_or_not_at_all(Path(folder)) as unfinished:
        session = _Session(
            folder=unfinished,
            seed=seed,
            plan=plan,
            errors=errors,
            bench=bench,
            sheet=drawn if errors.data_sheet else exact,
            sensors=draw_campaign_sensors(bench, errors, for_sensors, plan.third_cell),
        )
        for done, name in enumerate(_write_files(session, cylinders), 1):
            if progress is not None:
                progress(done, session.n_file, name)
    return Path(folder)


@dataclass(frozen=True, eq=False)
class _Session:
    """One bench, its plan, and where its files go."""

    folder: Path
    seed: int
    plan: CampaignPlan
    errors: CampaignErrors
    bench: VirtualBench
    sheet: DataSheet
    sensors: CampaignSensors

    @property
    def n_file(self) -> int:
        """Files whose writing is reported."""
        per_set = len(self.plan.runs) + len(curve_directions(self.bench))
        directions = len(self.bench.mount_names) * len(AXES)
        pushes = len(push_places(self.bench)) if self.plan.third_cell else 0
        shaker = (directions + pushes) * self.plan.shaker_repeats
        over_time = self.plan.time_run is not None
        return len(self.plan.mount_sets) * per_set + shaker + over_time + 1

    def generator(self, name: str) -> np.random.Generator:
        """Noise of one recording; it depends on its file, not on its place in the plan."""
        return np.random.default_rng([self.seed, zlib.crc32(name.encode())])

    def path(self, name: str) -> Path:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def with_set(self, name: str) -> VirtualBench:
        return with_mount_set(self.bench, mount_set(name, self.bench))


def _write_files(session: _Session, cylinders: int) -> Iterator[str]:
    """Write every file; give the name of each as soon as it is there."""
    folder, bench, plan = session.folder, session.bench, session.plan
    (folder / "truth").mkdir()
    yield from _shaker_runs(session)
    if plan.third_cell:
        yield from _pushes(session)
    for name in plan.mount_sets:
        yield from _static_curves(session, name)
        yield from _runs(session, name)
    if plan.time_run is not None:
        yield _time_run(session, plan.time_run)
    write_bench_truth(folder / "truth", bench, session.sheet, session.sensors)
    write_mount_table(folder / MOUNT_TABLE, mount_rows(bench, session.sheet))
    sheet = sensor_rows(bench, session.sensors, session.sheet)
    write_sensor_table(folder / SENSOR_TABLE, sheet)
    write_campaign_channels(folder / CHANNEL_TABLE, channel_table(bench, plan.third_cell))
    content = campaign_file(bench, session.sheet, plan, session.errors, cylinders, session.seed)
    dump_campaign_file(folder / "campaign.toml", content)
    replace_text(folder / "README.txt", readme_text(bench, plan, session.seed))
    yield "campaign.toml"


def _shaker_runs(session: _Session) -> Iterator[str]:
    bench, frequency = session.bench, session.plan.frequency
    for m, mount in enumerate(bench.mount_names):
        for a, axis in enumerate(AXES):
            for repeat in range(1, session.plan.shaker_repeats + 1):
                name = shaker_file(mount, axis, repeat)
                generator = session.generator(name)
                answer = shaker_answer(
                    session.sensors, m, a, repeat, frequency, session.errors, generator
                )
                functions = shaker_functions(
                    bench, m, a, answer, frequency, session.plan.third_cell
                )
                write_uff(session.path(name), functions, binary=True)
                yield name


def _pushes(session: _Session) -> Iterator[str]:
    bench, frequency = session.bench, session.plan.frequency
    places = push_places(bench)
    per_mount = len(places) // len(bench.mount_names)
    for place, push in enumerate(places):
        for repeat in range(1, session.plan.shaker_repeats + 1):
            name = push_file(push, repeat)
            answer = push_answer(
                session.sensors,
                *divmod(place, per_mount),
                repeat,
                frequency,
                session.errors,
                session.generator(name),
            )
            functions = push_functions(bench, push, answer, frequency)
            write_uff(session.path(name), functions, binary=True)
            yield name


def _static_curves(session: _Session, set_name: str) -> Iterator[str]:
    on_bench = session.with_set(set_name)
    n_step = round(CURVE_REACH / CURVE_STEP)
    deflection = np.linspace(-CURVE_REACH, CURVE_REACH, 2 * n_step + 1)
    laws = (*on_bench.powertrain.laws, *on_bench.wheel_end.laws)
    for (mount, axis), law in zip(curve_directions(on_bench), laws, strict=True):
        name = curve_file(set_name, mount, axis)
        scale = 1 + session.generator(name).normal(0, session.errors.curve_scale)
        write_curve(session.path(name), deflection, scale * law.static_force(deflection))
        yield name


def _runs(session: _Session, set_name: str) -> Iterator[str]:
    on_bench = session.with_set(set_name)
    runs, static = [], []
    for planned in session.plan.runs:
        run = true_run(on_bench, planned, session.plan.frequency)
        preload = static_direction_forces(on_bench, run)
        name = run_file(set_name, planned)
        recorded = record(session.sensors, run, preload, session.errors, session.generator(name))
        title = f"{planned.name}, mount set {set_name}"
        functions = order_functions(
            on_bench, recorded, run.frequency, title, session.plan.third_cell
        )
        write_uff(session.path(name), functions, binary=True)
        yield name
        runs.append(run)
        static.append(preload)
    path = session.folder / "truth" / f"{set_name}.npz"
    moments = [mount_moments(run) for run in runs] if session.plan.third_cell else None
    write_set_truth(path, [planned.name for planned in session.plan.runs], runs, static, moments)


def _time_run(session: _Session, plan: TimeRunPlan) -> str:
    on_bench = session.with_set(plan.mount_set)
    name = time_run_file(plan.run)
    signals = record_over_time(
        on_bench, session.sensors, plan, session.errors, session.generator(name)
    )
    columns = {
        "acceleration": signals.acceleration,
        "cell force": signals.cell_force,
        "static force": signals.static_force,
        "engine torque": signals.engine_torque[:, None],
        "tacho": signals.tacho[:, None],
    }
    title = f"{plan.run.name} over time, mount set {plan.mount_set}"
    functions = time_functions(on_bench, signals.time, columns, title, session.plan.third_cell)
    with warnings.catch_warnings():
        # tacho and channels share the time axis, so orders do not feel its last digit
        warnings.simplefilter("ignore", AxisDriftWarning)
        write_uff(session.path(name), functions, binary=True)
    write_time_truth(session.folder / "truth" / f"{time_run_name(plan.run)}.npz", signals)
    return name
