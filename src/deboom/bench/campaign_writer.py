"""Writes a measurement campaign: raw channels of every run, tables, and the truth apart."""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.bench.campaign_entries import (
    CHANNEL_TABLE,
    MOUNT_TABLE,
    SENSOR_TABLE,
    campaign_file,
    curve_directions,
    curve_file,
    push_file,
    run_file,
    sensor_rows,
    shaker_file,
    time_run_file,
    time_run_name,
)
from deboom.bench.campaign_functions import (
    channel_table,
    order_functions,
    push_functions,
    shaker_functions,
    time_functions,
)
from deboom.bench.campaign_layout import push_places
from deboom.bench.campaign_operation import static_direction_forces, true_run
from deboom.bench.campaign_plan import FULL_PLAN, CampaignErrors, CampaignPlan, TimeRunPlan
from deboom.bench.campaign_readme import readme_text
from deboom.bench.campaign_sensors import (
    CampaignSensors,
    draw_campaign_sensors,
    push_answer,
    record,
    shaker_answer,
)
from deboom.bench.campaign_truth import (
    write_bench_truth,
    write_set_truth,
    write_time_truth,
)
from deboom.bench.data_sheet import DataSheet, draw_data_sheet
from deboom.bench.measurement_files import mount_rows
from deboom.bench.mount_moments import mount_moments
from deboom.bench.mount_sets import mount_set, with_mount_set
from deboom.bench.parameters import AXES, VirtualBench, load_bench
from deboom.bench.platform_layout import CYLINDERS
from deboom.bench.time_run import record_over_time
from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.campaign_file import dump_campaign_file
from deboom.files.campaign_tables import write_campaign_channels, write_curve, write_sensor_table
from deboom.files.platform_tables import write_mount_table
from deboom.files.uff import AxisDriftWarning, write_uff
from deboom.files.whole_folder import complete_or_not_at_all

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
