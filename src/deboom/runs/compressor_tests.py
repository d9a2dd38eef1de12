"""Tests of compressors, from folders or a virtual laboratory to what they show."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.bench.choices import CalibrationLevel, CompressorCase
from deboom.bench.compressor_rig import operation, speeds
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.bench.electric_car import SOUND_FLOOR, draw_fleet, frozen_fleet, run_car
from deboom.bench.electric_car_writer import CAR_PLAN, write_electric_car
from deboom.compressor.acceptance import ComponentLimits, ComponentVerdict, component_verdicts
from deboom.compressor.cabin_noise import (
    BAND,
    RunningInCar,
    cabin_noise,
    noise_bands,
    running_in_car,
)
from deboom.compressor.hammer_identification import identify
from deboom.compressor.identification_results import CompressorTruth, IdentifiedTest
from deboom.compressor.identified_compressor import Identification, IdentifyOptions
from deboom.compressor.measured_unbalance import (
    AUTOMATIC,
    MeasuredUnbalance,
    reactions_of_hoses,
    sweeps_with_hoses,
    with_route,
)
from deboom.compressor.mount_shares import mount_shares
from deboom.compressor.noise_comparison import CarNoise, DrawnCar, in_band
from deboom.compressor.thesis_parameter_fit import fit_thesis_parameters
from deboom.compressor.unbalance import UnbalanceOptions, unbalance
from deboom.errors import InputError
from deboom.files.compressor_model import MODEL_FILE, read_fitted_bands
from deboom.files.electric_car import read_electric_car
from deboom.files.folders import refuse_other_kind
from deboom.files.inertance_test import read_inertance_test
from deboom.files.kinds import FolderKind
from deboom.files.operating_test import read_operating_test
from deboom.files.run_folder import hash_files
from deboom.files.truth import read_compressor_truth, read_unbalance_truth
from deboom.measurement.compressor_test import InertanceTest
from deboom.measurement.electric_car import wrench_noise_transfer
from deboom.physics.sound_level import spl

IDENTIFICATION_STEPS = 7
"""Of `identified_test`, for progress."""


@dataclass(frozen=True)
class Beside:
    """What is fitted beside the identification itself.

    `thesis`: the thesis's 44 numbers, where there is a drawing; `identical_mounts`: identical round
    mounts.
    """

    thesis: bool = True
    identical_mounts: bool = False


def read_test(
    folder: Path, *, from_hits: bool = False, truth: bool = False
) -> tuple[InertanceTest, CompressorTruth | None]:
    """Read a test and, where asked for, the truth of a virtual one.

    - raises InputError: a folder that holds no test or truth that can be read.
    """
    if not folder.is_dir():
        raise InputError(
            f"{folder}: there is no such folder; `deboom bench compressor {folder}` writes a "
            "virtual test"
        )
    refuse_other_kind(folder, FolderKind.compressor)
    test = read_inertance_test(folder, from_hits=from_hits)
    return test, read_compressor_truth(folder) if truth else None


def identified_test(
    test: InertanceTest,
    truth: CompressorTruth | None,
    options: IdentifyOptions,
    beside: Beside,
    step: Callable[[str], None],
    relative_to: Path | None = None,
) -> IdentifiedTest:
    """Identify a test and fit what was asked for beside.

    - `truth` or None: kept for comparison.
    - `relative_to`, optional: folder from which input files are named in the saved compressor;
      without it they leave no hashes, since they do not stay.
    - raises InputError: as `identify`; identical mounts without a drawing.
    """
    if beside.identical_mounts and test.drawing is None:
        raise InputError(
            f"{test.name}: identical mounts are counted from a drawing, and the test has none: add "
            "its [drawing] and [[mounts]], or leave out --identical-mounts"
        )
    hashes = {} if relative_to is None else hash_files(test.input_files, relative_to)
    with threadpool_limits(1):  # its matrices are too small to share
        begin = time.perf_counter()
        identification = identify(test, options, step)
        seconds = time.perf_counter() - begin
        thesis, identical = None, None
        if beside.thesis and test.drawing is not None:
            step("the thesis's 44 numbers")
            thesis = fit_thesis_parameters(identification, test.drawing)
        if beside.identical_mounts and test.drawing is not None:
            step("identical mounts")
            identical = mount_shares(identification, test.drawing.mounts, identical=True)
    return IdentifiedTest(identification, thesis, identical, truth, seconds, hashes)


def identified_virtual(
    seed: int, level: CalibrationLevel, beside: Beside, step: Callable[[str], None]
) -> IdentifiedTest:
    """Measure and identify a virtual compressor; seed 1 has the mounts of the thesis's table 11."""
    plan = CompressorPlan(
        case=CompressorCase.TABLE11 if seed == 1 else CompressorCase.RANDOM,
        identical_mounts=beside.identical_mounts,
    )
    with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
        test, truth = read_test(
            write_compressor_test(Path(scratch) / "test", seed, level, plan), truth=True
        )
    return identified_test(test, truth, IdentifyOptions(), beside, step)


UNBALANCE_STEPS = 12
"""Of `measured_unbalance`, for progress."""


@dataclass(frozen=True)
class UnbalancePlan:
    """What is asked of an operating test.

    - `route`: letter of the route whose results are headline and verdict, or `AUTOMATIC`.
    - `identify`: of the hammer test.
    - `unbalance`: of the sweeps.
    - `limits`: to be judged; None where there are none.
    - `identified` or None: run of ``deboom identify``, or its compressor_model.json: its lines are
      fitted again, and the hammer test must be the one that it was made from.
    - `truth`: compare with the truth of a virtual test.
    """

    route: str = AUTOMATIC
    identify: IdentifyOptions = field(default_factory=IdentifyOptions)
    unbalance: UnbalanceOptions = field(default_factory=UnbalanceOptions)
    limits: ComponentLimits | None = None
    identified: Path | None = None
    truth: bool = False


def measured_unbalance(
    folder: Path, plan: UnbalancePlan, step: Callable[[str], None]
) -> MeasuredUnbalance:
    """Evaluate the operating test of a folder.

    - `folder`: holds ``operation.toml``.
    - raises InputError: a test that cannot be read, identified or evaluated, a route that was not
      computed, `plan.identified` of another hammer test.
    """
    begin = time.perf_counter()
    with threadpool_limits(1):  # its matrices are too small to share
        step("reading")
        if not folder.is_dir():
            raise InputError(
                f"{folder}: there is no such folder; `deboom bench operation {folder}` writes a "
                "virtual test"
            )
        refuse_other_kind(folder, FolderKind.operation)
        test = read_operating_test(folder)
        truth = read_unbalance_truth(folder) if plan.truth else None
        hashes = hash_files(test.hammer.input_files, folder)
        options = _identify_options(plan, hashes)
        hammer = identify(test.hammer, options, step, hoses=test.hoses)
        evaluation = with_route(unbalance(test, hammer, plan.unbalance, step), plan.route)
        step("hoses")
        with_hoses = sweeps_with_hoses(test, hammer, evaluation)
        reactions = reactions_of_hoses(evaluation, with_hoses)
        verdicts: tuple[ComponentVerdict, ...] = ()
        if plan.limits is not None:
            verdicts = component_verdicts(evaluation, plan.limits)
    seconds = time.perf_counter() - begin
    return MeasuredUnbalance(
        evaluation, hashes, with_hoses, reactions, plan.limits, verdicts, truth, seconds
    )


def _identify_options(plan: UnbalancePlan, hashes: Mapping[str, str]) -> IdentifyOptions:
    """Take over the lines of an earlier identification of the same hammer test."""
    if plan.identified is None:
        return plan.identify
    path = plan.identified
    path = path / f"{MODEL_FILE}.json" if path.is_dir() else path
    bands, earlier = read_fitted_bands(path)
    if sorted(earlier.values()) != sorted(hashes.values()):
        raise InputError(
            f"{path} was identified from another hammer test than that of these sweeps: identify "
            "the test in their folder, or leave out --identified"
        )
    return replace(plan.identify, bands=bands)


NOISE_STEPS = 8
"""Of `noise_of_car`, for progress."""
ADDING_FLEET, ADDING_CAR = 11, "EV-1"
"""A drawn car whose hoses add, as the thesis's did."""
FLOOR = float(np.sqrt(2.0) * SOUND_FLOOR)
"""Root mean square of the noise in a tracked pressure of a virtual car, complex peak [Pa]: 0.1 mPa
per root of a hertz over the ten seconds of a line, of cabin and microphone together."""


@dataclass(frozen=True)
class NoisePlan:
    """What is asked of a car: lines, standard hoses, draws and seed of the bands, hammer test.

    `band`: lines that are looked at [Hz], InputError without width; `with_hoses`: whether standard
    hoses are identified and their paths modelled; `seed`: from 1.
    """

    band: tuple[float, float] = BAND
    with_hoses: bool = True
    draws: int = 64
    seed: int = 1
    identify: IdentifyOptions = field(default_factory=partial(IdentifyOptions))

    def __post_init__(self) -> None:
        if not 0 < self.band[0] < self.band[1]:
            raise InputError(f"{self.band[0]:g} to {self.band[1]:g} Hz is no band of frequencies")


def noise_of_car(
    folder: Path,
    plan: NoisePlan,
    step: Callable[[str], None],
    *,
    identified: Identification | None = None,
    seed: int | None = None,
) -> tuple[RunningInCar, CarNoise]:
    """Read a car with ``car.toml``, identify what is needed and synthesise its sound.

    - `step`: told what is being done.
    - `identified`: its compressor, where that is known from another car.
    - `seed`: of a virtual laboratory.
    - raises InputError: what reader, identification and synthesis refuse.
    """
    start = time.process_time()
    step("reading")
    car = read_electric_car(folder)
    step("identification of the compressor")
    if identified is None:
        identified = identify(car.operation.hammer, plan.identify, hoses=car.operation.hoses)
    running = running_in_car(car, identified, with_hoses=plan.with_hoses, step=step)
    step("synthesis")
    transfer = wrench_noise_transfer(car)
    sweeps = cabin_noise(running, transfer, plan.band)
    step("bands")
    bands = noise_bands(running, transfer, plan.band, draws=plan.draws, seed=plan.seed)
    seconds = time.process_time() - start
    alarms = (*identified.alarms, *running.alarms)
    floor = None if seed is None else FLOOR
    return running, CarNoise(car.name, seed, sweeps, bands, alarms, seconds, floor)


def virtual_car(
    seed: int, level: CalibrationLevel, plan: NoisePlan, step: Callable[[str], None]
) -> tuple[RunningInCar, CarNoise]:
    """Let a laboratory measure the first car of the frozen fleet, and evaluate it."""
    name = next(iter(frozen_fleet()))
    with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
        folder = write_electric_car(Path(scratch) / name, seed, name, level=level)
        return noise_of_car(folder, plan, step, seed=seed)


def car_whose_hoses_add() -> DrawnCar:
    """Run the shipped compressor with its hoses in a drawn car, as the thesis heard its own.

    In the frozen fleet hoses mostly work against the mounts; in twelve drawn fleets they take up to
    6 dB off or add up to 11 dB, and cars of one fleet resemble each other.
    """
    body = draw_fleet(ADDING_FLEET)[ADDING_CAR]
    running = operation(1, CalibrationLevel.C2, CAR_PLAN)
    compressor = running.laboratory.compressor
    lines = speeds()
    lines = lines[in_band(lines, BAND)]
    joined, free = (
        spl(run_car(body, compressor, running.source, lines, hoses).pressure, lines)
        for hoses in (compressor.hoses, ())
    )
    return DrawnCar(ADDING_FLEET, ADDING_CAR, lines, joined, free)
