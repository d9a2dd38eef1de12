"""Writes a test of component TPA, a second receiver, and the truth beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.bench import compressor_rig as rig
from deboom.bench import electric_car, writing
from deboom.bench.choices import CalibrationLevel
from deboom.bench.component import (
    BEARINGS,
    HOUSINGS,
    INDICATORS,
    ON_BOARD,
    RUNS,
    Car,
    ComponentPlan,
    ComponentTruth,
    Frame,
    bolted,
    draw_component,
    mounted,
    places_of,
)
from deboom.bench.compressor_writer import hammer_functions, impact_dof, tolerance_section
from deboom.bench.fleet import EARS
from deboom.bench.signals import complex_normal
from deboom.bench.vehicle_acquisition import EAR_NODES, MICROPHONES
from deboom.files.component_test import (
    COMPONENT_FILE,
    RECEIVER_FILE,
    ComponentTestFile,
    PointSection,
    ReceiverFile,
    ReceiverPointSection,
    ReceiverRunSection,
    SourceRunSection,
    SpectrumDeviations,
)
from deboom.files.disk import complete_or_not_at_all, made_folder
from deboom.files.rows import PlacedImpact, PlacedSensor, write_positions
from deboom.files.schema import dump_toml
from deboom.files.uff import UffFunction, write_uff
from deboom.files.vehicle import EarEntry

POSITIONS, ACCELERANCE, PRESSURE = "positions.xlsx", "accelerance.uff", "pressure.uff"
COHERENCE, FREE, RECEIVER = "coherence.uff", "source_free.uff", "receiver"
FIRST_BODY_NODE, FIRST_HOUSING_NODE = 451, 551
FIRST, LAST = 20.0, 140.0
"""Of the lines of functions and spectra [Hz]."""
HITS, IMPULSE = 10, 2.0
"""Hits per function, and the impulse of a usual one [N s]: of a hammer of a kilogram."""
RELATIVE, ACCELERATION_FLOOR, SOUND_FLOOR = 3e-3, 5e-4, 3e-5
"""Deviation of the parts of a spectrum: over the amplitude [1], of channels [m/s²], ears [Pa]."""
SENSOR_ANGLES = ((0.0, 0.0, 0.0), (20.0, -35.0, 90.0), (160.0, 10.0, 25.0))
"""How accelerometers stand at a point, known [deg]."""
BESIDE_NODE = np.array([0.02, 0.0, 0.03])
"""Where an accelerometer elsewhere on the body sits, from its node [m]."""
AIRBORNE_NODE = 0
"""Panel behind which sound from outside enters, of `deboom.bench.component.PANELS`."""

_PLACING, _STRIKING, _FREE, _RUNNING, _SECOND, _EARS, _AIR = range(200, 207)
"""Purposes with random numbers of their own."""


@dataclass(frozen=True, eq=False)
class _Answers:
    """How a frame answers loads at some of its nodes, and what is heard; solved once.

    `moved` (f, 6 n_node, 6 n_input), `pressure` (f, n_ear, 6 n_input); no ears without a car.
    """

    frequency: RealArray
    whole: Frame
    inputs: tuple[str, ...]
    moved: ComplexArray
    pressure: ComplexArray

    def per(self, nodes: Sequence[str]) -> _Answers:
        """Return the answers to loads at these nodes."""
        columns = [6 * self.inputs.index(node) + k for node in nodes for k in range(6)]
        moved, pressure = self.moved[:, :, columns], self.pressure[:, :, columns]
        return replace(self, inputs=tuple(nodes), moved=moved, pressure=pressure)


def _answers(frequency: RealArray, whole: Frame, car: Car | None, *inputs: str) -> _Answers:
    if car is None:
        moved = whole.answer(frequency, whole.nodes, inputs)
        pressure = np.zeros((frequency.size, 0, moved.shape[2]), complex)
    else:
        moved, pressure = car.pressure(whole, frequency, inputs)
    return _Answers(frequency, whole, inputs, moved, pressure)


@dataclass(frozen=True, eq=False)
class _Instrumented:
    """Sensors and hits on an assembly: nodes of the frame, and what is glued and struck there."""

    nodes: tuple[str, ...]
    placed: tuple[rig.Placed, ...]

    @property
    def sensors(self) -> tuple[PlacedSensor, ...]:
        return tuple(row for placed in self.placed for row in placed.sheet.sensors)

    @property
    def impacts(self) -> tuple[PlacedImpact, ...]:
        return tuple(row for placed in self.placed for row in placed.sheet.impacts)

    def sensed(self, answers: _Answers) -> ComplexArray:
        """Accelerations at all channels per load, shape (f, n_channel, 6 n_input)."""
        squared = (2 * np.pi * answers.frequency) ** 2
        seen = [
            placed.response_rows() @ answers.moved[:, answers.whole.motions([node])]
            for node, placed in zip(self.nodes, self.placed, strict=True)
        ]
        return np.asarray(-squared[:, None, None] * np.concatenate(seen, axis=1))


def write_component_test(
    folder: Path | str,
    seed: int = 1,
    level: CalibrationLevel = CalibrationLevel.C2,
    plan: ComponentPlan | None = None,
    *,
    truth_seed: int = 1,
    noise_free: bool = False,
) -> Path:
    """Strike and run a source on a car body, and write what a laboratory delivers.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        Seed, from 1, of the errors of placement and calibration, and of noise.
    level : CalibrationLevel
        Sizes of these errors; the tolerances that the folder states.
    plan : ComponentPlan, optional
        How many points, and what the test leaves out; by default three complete points.
    truth_seed : int
        Seed, from 1, of source, bodies and loads.
    noise_free : bool
        Everything is where it should be, and silent. The folder states the same tolerances.

    Returns
    -------
    Path
        The folder, with ``component.toml`` at its top, a second receiver in ``receiver/`` and the
        exact truth in ``truth/``.

    Raises
    ------
    InputError
        A seed below 1; a folder that is not empty or cannot be written.

    Examples
    --------
    >>> import deboom
    >>> deboom.bench.write_component_test("drive", seed=1).name  # doctest: +SKIP
    'drive'
    """
    plan = plan or ComponentPlan()
    writing.check_seed(seed)
    lines = np.arange(FIRST, LAST + plan.line_step / 2, plan.line_step)
    truth = draw_component(plan, lines, truth_seed)
    errors = rig.NO_PLACEMENT_ERRORS if noise_free else rig.placement_errors(level)
    at_points = _at_points(plan, errors, rig.draw(seed, _PLACING))
    setup = _on_assembly(at_points, truth, errors, rig.draw(seed, _PLACING, 1))
    hits = _hit_plan(lines, noise_free=noise_free)
    title = (
        f"virtual drive unit {truth_seed} in a car, calibration level {level.value}, seed {seed}"
    )
    gains = np.zeros(len(EARS)) if noise_free else rig.draw(seed, _EARS).normal(0, 1, len(EARS))
    microphones = 10 ** (electric_car.MICROPHONE_DB * gains / 20)
    whole = bolted(truth.source, truth.first.body, plan.joints)
    first = _answers(lines, whole, truth.first, *plan.names, *HOUSINGS, *BEARINGS)
    with complete_or_not_at_all(Path(folder)) as unfinished:
        write_positions(unfinished / POSITIONS, setup.sensors, setup.impacts)
        functions = _struck(setup, first, hits, microphones, rig.draw(seed, _STRIKING))
        _write_functions(unfinished, setup, hits, *functions)
        alone = _answers(lines, truth.source, None, *plan.names)
        free, _ = _struck(at_points, alone, hits, np.ones(0), rig.draw(seed, _FREE))
        sheet = rig.Sheet(at_points.sensors, at_points.impacts)
        of_free = hammer_functions(writing.FRF, lines, free, sheet, "free source, {} per {}")
        write_uff(unfinished / FREE, of_free, binary=True)
        second, names = mounted(truth.source, truth.second.body, plan.names, truth.stiffness)
        in_second = _answers(lines, second, _renamed(truth.second, names), *BEARINGS)
        _write_runs(
            unfinished, setup, truth, first, in_second, microphones, seed, noise_free=noise_free
        )
        _write_component_file(unfinished, plan, title, level, hits, at_points)
        _write_receiver(
            made_folder(unfinished / RECEIVER),
            truth,
            in_second,
            _at_points(plan, errors, rig.draw(seed, _SECOND)),
            level,
            hits,
            seed,
            noise_free=noise_free,
        )
        writing.write_readme(
            unfinished,
            title,
            f"A drive unit bolted to a car body at {plan.points} points: struck with a roving "
            "hammer around every point and on its housing, then run. Accelerometers around every "
            "point and elsewhere on the body, microphones at the ears. The source alone, hung up "
            "freely, and another body with mounts (receiver/), on which it ran as well: "
            f"{lines.size} lines from {FIRST:g} to {LAST:g} Hz, H1 of {hits.hits} hits.",
            "component",
            COMPONENT_FILE,
        )
    return Path(folder)


def _hit_plan(lines: RealArray, *, noise_free: bool) -> rig.HitPlan:
    """Return how bodies are struck: with a large modal hammer, ten times."""
    return replace(
        electric_car.body_plan(noise_free=noise_free),
        hits=HITS,
        impulse=IMPULSE,
        duration=1.0 / float(lines[1] - lines[0]),
        band=(float(lines[0]), float(lines[-1])),
    )


def _at_points(
    plan: ComponentPlan, errors: rig.PlacementErrors, generator: np.random.Generator
) -> _Instrumented:
    """Instrument the interface, as one hammer strikes it."""
    places = places_of(plan)
    sheets = [
        electric_car.sheet_around(f"P{number + 1}", 3 * number, places[name], SENSOR_ANGLES)
        for number, name in enumerate(plan.names)
    ]
    placed = [rig.place(sheet, errors, generator) for sheet in sheets]
    one_hammer = [replace(point, hammer_gain=placed[0].hammer_gain) for point in placed]
    return _Instrumented(plan.names, tuple(one_hammer))


def _on_assembly(
    at_points: _Instrumented,
    truth: ComponentTruth,
    errors: rig.PlacementErrors,
    generator: np.random.Generator,
) -> _Instrumented:
    """Add accelerometers elsewhere on the body, and hits on the housing of the source."""
    sheets = []
    for number, node in enumerate((*INDICATORS, *ON_BOARD)):
        place = truth.first.body.at(node)
        name = f"{'B' if node in INDICATORS else 'V'}{number + 1}"
        angles = np.round(generator.uniform(-np.pi, np.pi, 3), 3)
        position = writing.triple(place + BESIDE_NODE, electric_car.SHEET_DIGITS)
        row = PlacedSensor(name, FIRST_BODY_NODE + number, position, writing.triple(angles))
        sheets.append(rig.Sheet((row,), (), place))
    for number, node in enumerate(HOUSINGS):
        place = truth.source.at(node)
        rows = [
            PlacedImpact(
                f"H{number + 1} {axis}",
                FIRST_HOUSING_NODE + number,
                writing.triple(place, electric_car.SHEET_DIGITS),
                writing.triple(push),
            )
            for axis, push in zip(AXES, np.diag([1.0, 1.0, -1.0]), strict=True)
        ]
        sheets.append(rig.Sheet((), tuple(rows), place))
    hammer = at_points.placed[0].hammer_gain
    placed = [replace(rig.place(sheet, errors, generator), hammer_gain=hammer) for sheet in sheets]
    nodes = (*at_points.nodes, *INDICATORS, *ON_BOARD, *HOUSINGS)
    return _Instrumented(nodes, (*at_points.placed, *placed))


def _struck(
    setup: _Instrumented,
    answers: _Answers,
    plan: rig.HitPlan,
    microphones: RealArray,
    generator: np.random.Generator,
) -> tuple[ComplexArray, RealArray]:
    """Strike everything; functions and coherences of channels and ears, (f, n_output, m)."""
    lines, n_ear = plan.lines, len(microphones)
    at = [k for k, placed in enumerate(setup.placed) if placed.sheet.impacts]
    answers = answers.per([setup.nodes[k] for k in at])
    heard = microphones[:, None] * answers.pressure
    answer = np.concatenate([setup.sensed(answers), heard], axis=1)
    density = np.full(answer.shape[1], plan.response_noise)
    noise = np.outer(np.sqrt(1 + (plan.corner / lines) ** 2), density)
    silent = plan.response_noise == 0.0
    noise[:, answer.shape[1] - n_ear :] = 0.0 if silent else electric_car.CABIN_NOISE
    parts = [
        electric_car.strike_point(
            answer[:, :, 6 * place : 6 * place + 6], setup.placed[k], plan, noise, generator
        )
        for place, k in enumerate(at)
    ]
    functions, coherences = zip(*parts, strict=True)
    return np.concatenate(functions, axis=2), np.concatenate(coherences, axis=2)


def _write_functions(
    folder: Path,
    setup: _Instrumented,
    plan: rig.HitPlan,
    functions: ComplexArray,
    coherences: RealArray,
) -> None:
    """Write accelerances and pressures per hit with their coherences."""
    sheet, n_ear = rig.Sheet(setup.sensors, setup.impacts), len(EARS)
    pressures: list[UffFunction] = []
    for kind, values, file in (
        (writing.FRF, functions, ACCELERANCE),
        (writing.COHERENCE, coherences, COHERENCE),
    ):
        of_sensors = hammer_functions(kind, plan.lines, values[:, :-n_ear], sheet, "{} per {}")
        write_uff(folder / file, of_sensors, binary=True)
        pressures += [
            writing.function(
                kind,
                plan.lines,
                values[:, row - n_ear, column],
                _ear_dof(ear),
                impact_dof(impact),
                f"{ear} per {impact.impact}",
            )
            for row, ear in enumerate(EARS)
            for column, impact in enumerate(setup.impacts)
        ]
    write_uff(folder / PRESSURE, pressures, binary=True)


def _ear_dof(ear: str) -> writing.Dof:
    return writing.Dof(EAR_NODES[ear], "scalar", MICROPHONES[ear], "pressure")


def _noisy(
    exact: ComplexArray, floor: float, generator: np.random.Generator, *, noise_free: bool
) -> ComplexArray:
    if noise_free:
        return exact
    scatter = RELATIVE * np.abs(exact) * complex_normal(exact.shape, generator)
    return np.asarray(exact + scatter + floor * complex_normal(exact.shape, generator))


def _write_runs(
    folder: Path,
    setup: _Instrumented,
    truth: ComponentTruth,
    first: _Answers,
    in_second: _Answers,
    microphones: RealArray,
    seed: int,
    *,
    noise_free: bool,
) -> None:
    """Write spectra of every run, and its truth ``truth/<run>.npz``.

    ``frequency`` (f,); ``blocked`` (f, 6 n_point) [N, N m]; ``transfer`` (f, n_ear, 6 n_point)
    [Pa/N, Pa/(N m)] and ``pressure`` (f, n_ear) of the structure, ``airborne`` (f, n_ear) [Pa];
    ``second_pressure`` (f, n_ear) on the second body.
    """
    lines, plan = truth.frequency, truth.plan
    for inside in ("runs", "truth"):
        made_folder(folder / inside)
    of_bearings, of_points = first.per(BEARINGS), first.per(plan.names)
    sensed = setup.sensed(of_bearings)
    entering = np.stack(
        [cabin.pressure(lines)[:, AIRBORNE_NODE] for cabin in truth.first.cabins.values()], axis=1
    )
    for number, run in enumerate(RUNS):
        load = truth.loads[run]
        pressure = np.einsum("fei,fi->fe", of_bearings.pressure, load)
        in_air = complex_normal((2,), rig.draw(seed, _AIR, number))
        rising = in_air[0] + in_air[1] * (lines / 80.0) * np.exp(2j * lines / 80.0)
        airborne = entering * rising[:, None]
        size = np.linalg.norm(pressure) / np.linalg.norm(airborne)
        airborne *= np.sqrt(plan.airborne) * size
        exact = np.einsum("foi,fi->fo", sensed, load)
        generator = rig.draw(seed, _RUNNING, number)
        seen = _noisy(exact, ACCELERATION_FLOOR, generator, noise_free=noise_free)
        sound = microphones * (pressure + airborne)
        sound = _noisy(sound, SOUND_FLOOR, generator, noise_free=noise_free)
        channels = [(row, axis) for row in setup.sensors for axis in AXES]
        functions = [
            writing.function(
                writing.SPECTRUM,
                lines,
                column,
                writing.Dof(row.node, f"+{axis}", row.sensor, "acceleration"),
                None,
                run,
            )
            for (row, axis), column in zip(channels, seen.T, strict=True)
        ]
        functions += [
            writing.function(writing.SPECTRUM, lines, column, _ear_dof(ear), None, run)
            for ear, column in zip(EARS, sound.T, strict=True)
        ]
        write_uff(folder / _run_file(run), functions, binary=True)
        np.savez(
            folder / "truth" / f"{_stem(run)}.npz",
            frequency=lines,
            blocked=truth.blocked(run),
            transfer=of_points.pressure,
            pressure=pressure,
            airborne=airborne,
            second_pressure=np.einsum("fei,fi->fe", in_second.pressure, load),
        )


def _renamed(car: Car, names: dict[str, str]) -> Car:
    return replace(car, body=replace(car.body, nodes=tuple(names[n] for n in car.body.nodes)))


def _stem(run: str) -> str:
    return run.replace(" ", "_")


def _run_file(run: str) -> str:
    return f"runs/{_stem(run)}.uff"


def _ears() -> tuple[EarEntry, ...]:
    return tuple(
        EarEntry(name=ear, node=EAR_NODES[ear], microphone=MICROPHONES[ear]) for ear in EARS
    )


def _point_keys(plan: ComponentPlan, setup: _Instrumented) -> list[dict[str, object]]:
    """Return what both files state of a point."""
    places = places_of(plan)
    return [
        {
            "name": name,
            "position_m": writing.triple(places[name]),
            "degrees_of_freedom": 3 if plan.unmeasured_rotations else 6,
            "sensors": tuple(row.sensor for row in placed.sheet.sensors),
            "impacts": tuple(row.impact for row in placed.sheet.impacts),
        }
        for name, placed in zip(setup.nodes, setup.placed, strict=True)
    ]


def _write_component_file(
    folder: Path,
    plan: ComponentPlan,
    title: str,
    level: CalibrationLevel,
    hits: rig.HitPlan,
    at_points: _Instrumented,
) -> None:
    points = tuple(PointSection.model_validate(keys) for keys in _point_keys(plan, at_points))
    first = len(INDICATORS)
    file = ComponentTestFile(
        format=1,
        title=title,
        sensor_table=POSITIONS,
        impact_table=POSITIONS,
        accelerance=ACCELERANCE,
        coherence=COHERENCE,
        pressure=PRESSURE,
        hits_per_impact=hits.hits,
        on_board=tuple(f"V{first + k + 1}" for k in range(len(ON_BOARD))),
        source_impacts=tuple(f"H{k + 1} {axis}" for k in range(len(HOUSINGS)) for axis in AXES),
        free_accelerance=FREE,
        tolerances=tolerance_section(level),
        deviations=SpectrumDeviations(
            relative=RELATIVE,
            floor_m_s2=ACCELERATION_FLOOR,
            microphone_db=electric_car.MICROPHONE_DB,
        ),
        points=points,
        ears=_ears(),
        runs=tuple(SourceRunSection(name=run, spectra=_run_file(run)) for run in RUNS),
    )
    dump_toml(folder / COMPONENT_FILE, file)


def _write_receiver(
    folder: Path,
    truth: ComponentTruth,
    in_second: _Answers,
    setup: _Instrumented,
    level: CalibrationLevel,
    hits: rig.HitPlan,
    seed: int,
    *,
    noise_free: bool,
) -> None:
    """Write the second body, its mounts, and what is heard on it with the source in place."""
    plan, lines = truth.plan, truth.frequency
    write_positions(folder / POSITIONS, setup.sensors, setup.impacts)
    alone = _answers(lines, truth.second.body, truth.second, *plan.names)
    striking = rig.draw(seed, _SECOND, 1)
    functions, coherences = _struck(setup, alone, hits, np.ones(len(EARS)), striking)
    _write_functions(folder, setup, hits, functions, coherences)
    made_folder(folder / "runs")
    for number, run in enumerate(RUNS):
        exact = np.einsum("fei,fi->fe", in_second.pressure, truth.loads[run])
        generator = rig.draw(seed, _SECOND, 2, number)
        sound = _noisy(exact, SOUND_FLOOR, generator, noise_free=noise_free)
        spectra = [
            writing.function(writing.SPECTRUM, lines, column, _ear_dof(ear), None, run)
            for ear, column in zip(EARS, sound.T, strict=True)
        ]
        write_uff(folder / _run_file(run), spectra, binary=True)
    points = tuple(
        ReceiverPointSection.model_validate(
            {
                **keys,
                "stiffness_n_per_m": writing.triple(springs.real),
                "loss_factor": float(springs[0].imag / springs[0].real),
            }
        )
        for keys, springs in zip(_point_keys(plan, setup), truth.stiffness, strict=True)
    )
    file = ReceiverFile(
        format=1,
        title="another body, the drive unit on rubber mounts",
        sensor_table=POSITIONS,
        impact_table=POSITIONS,
        accelerance=ACCELERANCE,
        pressure=PRESSURE,
        tolerances=tolerance_section(level),
        points=points,
        ears=_ears(),
        runs=tuple(ReceiverRunSection(name=run, spectra=_run_file(run)) for run in RUNS),
    )
    dump_toml(folder / RECEIVER_FILE, file)
