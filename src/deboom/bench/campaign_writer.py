"""Writes a measurement campaign: raw channels of every run, tables, and the truth apart."""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import AXES, RealArray, RealOrComplexArray
from deboom.bench import campaign, layout, writing
from deboom.bench.families import Family, draw_family
from deboom.bench.operating_run import PlannedRun, static_direction_forces, true_run
from deboom.bench.platform_writer import (
    engine_section,
    mount_rows,
    mount_sections,
    powertrain_section,
    write_powertrain_truth,
)
from deboom.bench.powertrain import SIDES, VirtualBench, load_bench, with_mount_set
from deboom.bench.sensors import DataSheet, draw_data_sheet, exact_data_sheet
from deboom.files import campaign as campaign_file
from deboom.files import rows, tables
from deboom.files.disk import complete_or_not_at_all
from deboom.files.schema import dump_toml
from deboom.files.uff import AxisDriftWarning, UffFunction, write_uff
from deboom.files.units import parse_unit
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.progress import Progress

MOUNT_TABLE, SENSOR_TABLE, CHANNEL_TABLE = "mounts.csv", "sensors.csv", "channels.csv"

CURVE_REACH, CURVE_STEP = 15e-3, 0.1e-3
"""To which suppliers measure their force-deflection curves, both ways, and in which steps [m]."""


def write_campaign(
    folder: Path,
    seed: int,
    plan: campaign.CampaignPlan = campaign.FULL_PLAN,
    errors: campaign.CampaignErrors | None = None,
    progress: Progress | None = None,
    bench: VirtualBench | None = None,
    family: Family | None = None,
) -> Path:
    """Measure a campaign on the virtual bench and write its files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        Seed of one bench, from 1: the errors of its sensors once for all runs, and the noise of
        every run. A run does not depend on which others are planned. The data sheet is that of the
        virtual platform of the same seed.
    plan : CampaignPlan
        Mount sets and runs; by default everything.
    errors : CampaignErrors, optional
        Sizes of the errors; by default those of a good bench, with
        `deboom.bench.campaign.NO_ERRORS` there are none.
    progress : callable, optional
        Called with the files written so far, all files, and the name of the last one.
    bench : VirtualBench, optional
        Powertrain and mounts as drawn; by default the virtual platform's.
    family : Family, optional
        Rubber and laboratory, see `deboom.bench.families.draw_family`; the tolerances that the
        folder states stay those of `errors`.

    Returns
    -------
    Path
        The folder, with ``campaign.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; a mount set or gear that does not exist; a family with lines or sensors that
        are missing; a folder that is not empty or cannot be written.
    """
    writing.check_seed(seed)
    family = family or draw_family("", seed, 1)
    family.refuse(("gaps", "dead"), "a campaign")
    bench, errors = family.bench(bench or load_bench()), errors or campaign.CampaignErrors()
    for name in plan.mount_sets:
        with_mount_set(bench, name)  # refuse before any work
    # the first four children belong to the virtual platform of the same seed
    for_sheet, *_, for_sensors = np.random.SeedSequence(seed).spawn(5)
    drawn = draw_data_sheet(bench, np.random.default_rng(for_sheet))
    sheet = drawn if errors.data_sheet else exact_data_sheet(bench)
    sensors = campaign.draw_campaign_sensors(bench, errors, for_sensors)
    true_errors = replace(errors, chain=family.budget(errors.chain))
    file = _campaign_file(bench, sheet, plan, errors, seed)
    entries = (file.shaker_runs, file.static_curves, file.runs, file.time_runs)
    n_file = sum(map(len, entries)) + 1
    with complete_or_not_at_all(Path(folder)) as unfinished:
        session = _Session(unfinished, seed, plan, true_errors, bench, sensors)
        for done, name in enumerate(_write_files(session, sheet, file), 1):
            if progress is not None:
                progress(done, n_file, name)
    return Path(folder)


@dataclass(frozen=True, eq=False)
class _Session:
    """One bench with its sensors, and where its files go."""

    folder: Path
    seed: int
    plan: campaign.CampaignPlan
    errors: campaign.CampaignErrors
    bench: VirtualBench
    sensors: campaign.CampaignSensors

    def generator(self, name: str) -> np.random.Generator:
        """Return the noise of one recording, which depends on its file and not on the plan."""
        return np.random.default_rng([self.seed, zlib.crc32(name.encode())])

    def path(self, name: str) -> Path:
        """Return the path of a file whose folder exists."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path


def _write_files(
    session: _Session, sheet: DataSheet, file: campaign_file.CampaignFile
) -> Iterator[str]:
    """Write every file that ``campaign.toml`` names; give its name as soon as it is there."""
    folder, bench = session.folder, session.bench
    (folder / "truth").mkdir()
    for push in file.shaker_runs:
        yield _write_push(session, push)
    for curve in file.static_curves:
        yield _write_static_curve(session, curve)
    for mount_set in session.plan.mount_sets:
        entries = [entry for entry in file.runs if entry.mount_set == mount_set]
        yield from _write_runs(session, mount_set, entries)
    for time_run in file.time_runs:
        yield _write_time_run(session, time_run)
    write_powertrain_truth(folder / "truth", bench)
    tables.write_table(folder / MOUNT_TABLE, rows.MountRow, mount_rows(bench, sheet))
    tables.write_table(folder / SENSOR_TABLE, rows.SensorRow, _sensor_rows(session, sheet))
    tables.write_table(folder / CHANNEL_TABLE, rows.CampaignChannel, _channels(bench))
    dump_toml(folder / "campaign.toml", file)
    plan, (first, last) = session.plan, session.plan.frequency[[0, -1]]
    shares = ", ".join(f"{100 * share:.0f}" for share in layout.CELL_SHARES)
    writing.write_readme(
        folder,
        f"Measurement campaign on the virtual bench, seed {session.seed}",
        f"Mount sets {', '.join(plan.mount_sets)}: M0 is as drawn; M1 and higher are units with "
        "their manufacturing spread, the same parts in every campaign. Runs: "
        f"{plan.frequency.size} lines from {first:g} to {last:g} Hz, engine order "
        f"{bench.order_torque.order:g}, phase to the tacho. {writing.VEHICLE_AXES} The force cells "
        f"under a mount carry {shares} %; their sum is its force.",
        "campaign",
        "campaign.toml",
    )
    yield "campaign.toml"


def _write_push(session: _Session, entry: campaign_file.ShakerEntry) -> str:
    """Push at a virtual point: cells of the mount per stated newton, UFF type 4."""
    bench, sensors, frequency = session.bench, session.sensors, session.plan.frequency
    mount = bench.mount_names.index(entry.mount)
    point, load = layout.points(bench)[mount], sensors.pushes[mount, :, AXES.index(entry.axis)]
    title = f"shaker at the virtual point, {point.channel(entry.axis)}"
    generator = session.generator(entry.file)
    answer = campaign.push_answer(
        sensors, mount, load, entry.repeat, frequency, session.errors, generator
    )
    push = writing.Dof(point.node, f"+{entry.axis}", entry.mount, "force")
    cells = [
        writing.Dof(place.node, f"+{axis}", f"{place.name} {axis}", "force")
        for place in layout.cell_places(bench)
        if place.point.mount == entry.mount
        for axis in AXES
    ]
    functions = [
        writing.function(writing.FRF, frequency, values, cell, push, title)
        for cell, values in zip(cells, answer.T, strict=True)
    ]
    write_uff(session.path(entry.file), functions, binary=True)
    return entry.file


def _write_static_curve(session: _Session, entry: campaign_file.CurveEntry) -> str:
    """Write a force-deflection curve as a supplier sends it."""
    mounts = with_mount_set(session.bench, entry.mount_set).mounts
    laws = next(mount.laws for mount in mounts if mount.name == entry.mount)
    n_step = round(CURVE_REACH / CURVE_STEP)
    deflection = np.linspace(-CURVE_REACH, CURVE_REACH, 2 * n_step + 1)
    force = laws[AXES.index(entry.axis)].static_force(deflection)
    scale = 1 + session.generator(entry.file).normal(0, session.errors.curve_scale)
    rows.write_curve(session.path(entry.file), deflection, scale * force)
    return entry.file


def _write_runs(
    session: _Session, mount_set: str, entries: list[campaign_file.RunEntry]
) -> Iterator[str]:
    """Run one mount set, and write what is recorded and the truth."""
    bench, frequency = with_mount_set(session.bench, mount_set), session.plan.frequency
    order = bench.order_torque.order
    runs, static = [], []
    for entry, planned in zip(entries, session.plan.runs, strict=True):
        run = true_run(bench, planned, frequency)
        preload = static_direction_forces(bench, run)
        generator = session.generator(entry.file)
        columns = campaign.record(session.sensors, run, preload, session.errors, generator)
        columns["engine speed"] = rpm_of_frequency(frequency, order)[:, None]
        lines = (
            f"order {order:g}",
            f"{planned.name}, mount set {mount_set}",
            "complex peak amplitude, phase referred to the tacho",
        )
        functions = _functions(session, writing.SPECTRUM, frequency, columns, lines)
        write_uff(session.path(entry.file), functions, binary=True)
        yield entry.file
        runs.append(run)
        static.append(preload)
    np.savez(
        session.folder / "truth" / f"{mount_set}.npz",
        frequency=frequency,
        runs=np.array([planned.name for planned in session.plan.runs]),
        channels=np.array(runs[0].channels),
        **writing.stacked(runs, "displacement", "force", "stiffness"),
        **writing.stacked([run.powertrain for run in runs], "motion"),
        **writing.stacked(runs, "engine_torque"),
        static_force=np.array(static),
    )


def _write_time_run(session: _Session, entry: campaign_file.TimeRunEntry) -> str:
    """Run up or down, and write the channels over time and the steady states behind them."""
    plan = session.plan.time_run
    assert plan is not None
    bench = with_mount_set(session.bench, plan.mount_set)
    generator = session.generator(entry.file)
    columns, truth = campaign.record_over_time(
        bench, session.sensors, plan, session.errors, generator
    )
    lines = (f"{plan.run.name} over time, mount set {plan.mount_set}",)
    functions = _functions(session, writing.TIME_SIGNAL, truth["time"], columns, lines)
    with warnings.catch_warnings():
        # tacho and channels share the time axis, so orders do not feel its last digit
        warnings.simplefilter("ignore", AxisDriftWarning)
        write_uff(session.path(entry.file), functions, binary=True)
    np.savez(session.folder / "truth" / f"{entry.name}.npz", **truth)
    return entry.file


def _functions(
    session: _Session,
    kind: int,
    abscissa: RealArray,
    columns: Mapping[str, RealOrComplexArray],
    id_lines: tuple[str, ...],
) -> list[UffFunction]:
    """Return the channels of one run; a name is cut to the ten characters of UFF."""
    channels = _channels(session.bench)
    functions = []
    for quantity, values in columns.items():
        of_quantity = [channel for channel in channels if channel.quantity == quantity]
        for channel, column in zip(of_quantity, values.T, strict=True):
            name = channel.channel.removeprefix("engine ")
            for side in SIDES:
                name = name.replace(side, side[0])
            dof = writing.Dof(
                channel.node, channel.direction, name, *rows.CAMPAIGN_QUANTITIES[quantity]
            )
            functions.append(writing.function(kind, abscissa, column, dof, None, *id_lines))
    return functions


def _channels(bench: VirtualBench) -> tuple[rows.CampaignChannel, ...]:
    """Return every channel of every run: sensors, static forces, engine, tacho."""
    channels = [
        (f"{place.name} {axis}", quantity, place.node, f"+{axis}")
        for quantity, places in (
            ("acceleration", layout.accelerometer_places(bench)),
            ("cell force", layout.cell_places(bench)),
        )
        for place in places
        for axis in AXES
    ]
    channels += [
        (point.channel(axis), "static force", point.node, f"+{axis}")
        for point in layout.points(bench)
        for axis in point.axes
    ]
    channels += [
        ("engine torque", "engine torque", layout.ENGINE_NODE, "+ry"),
        ("engine speed", "engine speed", layout.ENGINE_NODE, "scalar"),
        ("tacho", "tacho", layout.TACHO_NODE, "scalar"),
    ]
    return tuple(
        rows.CampaignChannel(
            name, quantity, node, direction, parse_unit(rows.CAMPAIGN_QUANTITIES[quantity][1])
        )
        for name, quantity, node, direction in channels
    )


def _sensor_rows(session: _Session, sheet: DataSheet) -> list[rows.SensorRow]:
    """Return the position sheet: nominal places from the stated centre of gravity."""
    bench, sensors = session.bench, session.sensors
    cells = layout.cell_places(bench)
    return [
        writing.sensor_row(
            place, kind, model, place.position + sheet.centre_error, np.deg2rad(angles)
        )
        for kind, model, places, all_angles in (
            (
                "accelerometer",
                layout.ACCELEROMETER_MODEL,
                layout.accelerometer_places(bench),
                sensors.accelerometer_angles,
            ),
            ("force cell", layout.CELL_MODEL, cells, sensors.cell_angles),
        )
        for place, angles in zip(places, all_angles, strict=True)
    ]


def _campaign_file(
    bench: VirtualBench,
    sheet: DataSheet,
    plan: campaign.CampaignPlan,
    errors: campaign.CampaignErrors,
    seed: int,
) -> campaign_file.CampaignFile:
    """Return the content of ``campaign.toml``."""
    repeats = range(1, plan.shaker_repeats + 1)
    return campaign_file.CampaignFile(
        format=1,
        name=f"virtual_bench_{seed}",
        title=f"Virtual bench, seed {seed}",
        description=(
            "Virtual measurements of the deboom bench, with the errors of real sensors; nobody "
            "measured this. The exact truth lies in truth/."
        ),
        mount_table=MOUNT_TABLE,
        sensor_table=SENSOR_TABLE,
        channel_table=CHANNEL_TABLE,
        engine=campaign_file.CampaignEngine(
            **engine_section(bench).model_dump(),
            # three cylinders have no mass force at their order, with or without shafts
            balancer_shafts=bench.reciprocating is None if bench.cylinders != 3 else None,
        ),
        powertrain=powertrain_section(sheet, exact=not errors.data_sheet),
        tolerances=_tolerances(errors),
        mounts=tuple(
            campaign_file.CampaignMount(
                **mount.model_dump(), on_powertrain=mount.name in bench.mount_names
            )
            for mount in mount_sections(bench)
        ),
        runs=tuple(
            campaign_file.RunEntry(
                **_run_keys(run, mount_set, run.name), file=f"runs/{mount_set}/{run.name}.uff"
            )
            for mount_set in plan.mount_sets
            for run in plan.runs
        ),
        shaker_runs=tuple(
            campaign_file.ShakerEntry(
                mount=mount, piece="", axis=axis, repeat=n, file=f"shaker/{mount}_{axis}_{n}.uff"
            )
            for mount in bench.mount_names
            for axis in AXES
            for n in repeats
        ),
        static_curves=tuple(
            campaign_file.CurveEntry(
                mount=mount.name,
                axis=axis,
                mount_set=mount_set,
                force_uncertainty=errors.curve_scale,
                file=f"static_curves/{mount_set}/{mount.name}_{axis}.csv",
            )
            for mount_set in plan.mount_sets
            for mount in bench.mounts
            for axis in AXES[: len(mount.laws)]
        ),
        time_runs=() if plan.time_run is None else (_time_run(plan.time_run),),
    )


def _run_keys(run: PlannedRun, mount_set: str, name: str) -> dict[str, Any]:
    """Return the keys of a run under a name."""
    return {
        "name": name,
        "mount_set": mount_set,
        "gear": run.gear,
        "full_load": run.full_load,
        "torque_nm": run.torque,
        "rising": run.rising,
    }


def _time_run(plan: campaign.TimeRunPlan) -> campaign_file.TimeRunEntry:
    """Return the entry of a run over time."""
    name = f"{plan.run.name}_time"
    return campaign_file.TimeRunEntry(
        **_run_keys(plan.run, plan.mount_set, name),
        file=f"time/{name}.uff",
        pulses_per_revolution=plan.pulses_per_revolution,
    )


def _tolerances(errors: campaign.CampaignErrors) -> campaign_file.ToleranceEntry:
    """Return the stated tolerances: the sizes of the errors."""
    chain = errors.chain
    return campaign_file.ToleranceEntry(
        sensor_position_m=chain.position,
        sensor_angle_rad=chain.angle,
        sensor_gain=chain.gain,
        sensor_cross_axis=chain.cross_axis,
        acceleration_own=chain.acceleration_own,
        acceleration_norm=chain.acceleration_norm,
        acceleration_floor_m_s2=chain.acceleration_floor,
        cell_gain=errors.side_cell_gain,
        force_own=chain.force_own,
        force_norm=chain.force_norm,
        force_floor_n=chain.force_floor,
        shaker_angle_rad=chain.shaker_angle,
        shaker_gain=chain.shaker_gain,
        torque_nm=errors.torque,
        static_force_n=errors.static_force,
    )
