"""Many virtual running compressors: every route against the truth, mounts as struck and changed."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from multiprocessing import get_context
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.bench.compressor_operation_plan import OperationPlan
from deboom.bench.compressor_operation_writer import write_operating_test
from deboom.bench.compressor_plan import CalibrationLevel, CompressorCase, CompressorPlan
from deboom.compressor.identify import Identification, IdentifyOptions, identify
from deboom.compressor.routes import (
    CalibratedMeasurementRoute,
    CalibratedModelRoute,
    MeasuredRoute,
    UpdatedRoute,
)
from deboom.compressor.unbalance import RouteResult, Unbalance, UnbalanceOptions, unbalance
from deboom.files.operating_test import read_operating_test
from deboom.study.compressor_unbalance import MeasuredUnbalance, UnbalancePlan, measured_unbalance
from deboom.study.compressor_unbalance_truth import (
    RouteErrors,
    UnbalanceTruth,
    read_unbalance_truth,
    route_errors,
)
from deboom.study.progress import Progress

COMPARED = UnbalanceOptions(routes=(MeasuredRoute(), CalibratedMeasurementRoute(), UpdatedRoute()))
"""Routes of all compressors but the first."""
OUT_OF_CLASS = replace(COMPARED, routes=(*COMPARED.routes, CalibratedModelRoute()))
"""Those of softening mounts and a flexible receiver."""
STORAGE, LOSS = 0.9, 1.1
"""Real and imaginary part of the mounts' stiffness in operation over that struck, where changed."""


class MountCase(Enum):
    """What the mounts and what carries them are like."""

    UNCHANGED = "as struck"
    CHANGED = "−10 % / +10 %"
    SOFTENING = "softening"
    RECEIVER = "flexible receiver"


@dataclass(frozen=True)
class CaseErrors:
    """One virtual compressor in one state, by one route.

    Parameters
    ----------
    seed : int
    case : MountCase
    letter : str
        Of the route.
    errors : RouteErrors
        Line by line.
    static, dynamic : float
        Relative errors of the fit over all sweeps [1].
    gas_moment : float
        The same of the moment of the gas, the worse of all pressures [1].
    alarmed : bool
        Whether hammer test or sweeps gave an alarm.
    """

    seed: int
    case: MountCase
    letter: str
    errors: RouteErrors
    static: float
    dynamic: float
    gas_moment: float
    alarmed: bool


@dataclass(frozen=True, eq=False)
class VirtualRuns:
    """What a study of virtual compressors shows.

    Parameters
    ----------
    first : MeasuredUnbalance
        First compressor, mounts as struck.
    changed : Unbalance
        The same, mounts changed.
    changed_truth : UnbalanceTruth
    cases : tuple of CaseErrors
        Of all compressors, states and routes.
    """

    first: MeasuredUnbalance
    changed: Unbalance
    changed_truth: UnbalanceTruth
    cases: tuple[CaseErrors, ...]


def operation_plan(seed: int, case: MountCase) -> OperationPlan:
    """Plan the virtual test: seed 1 has the mounts of the thesis's table 11."""
    compressor = CompressorPlan(
        case=CompressorCase.TABLE11 if seed == 1 else CompressorCase.RANDOM,
        softening=case is MountCase.SOFTENING,
        flexible_receiver=case is MountCase.RECEIVER,
    )
    plan = OperationPlan(compressor, softening=case is MountCase.SOFTENING)
    if case is MountCase.CHANGED:
        return replace(plan, mount_storage=STORAGE, mount_loss=LOSS)
    return plan


def virtual_runs(
    seeds: Sequence[int],
    level: CalibrationLevel,
    plan: UnbalancePlan,
    progress: Progress,
    *,
    workers: int,
    special: bool = True,
) -> VirtualRuns:
    """Measure virtual compressors and evaluate each in both states.

    Parameters
    ----------
    seeds : sequence of int
        One compressor each.
    level : CalibrationLevel
        Of sensors and impacts.
    plan : UnbalancePlan
        Of the first compressor.
    progress : callable
    workers : int
        Processes beside this one; 0 does all here. The result is the same.
    special : bool
        The first compressor on a flexible receiver and with softening mounts as well.

    Returns
    -------
    VirtualRuns
    """
    pair = (MountCase.UNCHANGED, MountCase.CHANGED)
    tasks = [_Task(seed, level, pair, COMPARED) for seed in seeds[1:]]
    if special:
        tasks += [
            _Task(seeds[0], level, (case,), OUT_OF_CLASS)
            for case in (MountCase.SOFTENING, MountCase.RECEIVER)
        ]
    total = len(tasks) + len(pair)
    with (
        _spread(tasks, workers) as others,
        tempfile.TemporaryDirectory(prefix="deboom-") as scratch,
    ):
        folders = []
        for case in pair:
            folder = Path(scratch) / case.name.lower()
            write_operating_test(folder, seeds[0], level, operation_plan(seeds[0], case))
            folders.append(folder)
        progress(0, total, "first compressor")
        first = measured_unbalance(folders[0], plan, lambda _: None)
        assert first.truth is not None
        progress(1, total, "first compressor, mounts changed")
        struck = first.found.identification
        changed, truth = _evaluated(folders[1], struck, plan.unbalance)
        cases = _rows(seeds[0], MountCase.UNCHANGED, first.found, first.truth)
        cases += _rows(seeds[0], MountCase.CHANGED, changed, truth)
        for number, rows in enumerate(others, start=len(pair)):
            progress(number, total, "other compressors")
            cases += rows
    progress(total, total, "done")
    return VirtualRuns(first, changed, truth, tuple(cases))


def _evaluated(
    folder: Path, struck: Identification | None, options: UnbalanceOptions
) -> tuple[Unbalance, UnbalanceTruth]:
    """Read and evaluate a test; identify its hammer test unless that was done."""
    test, truth = read_operating_test(folder), read_unbalance_truth(folder)
    assert truth is not None
    with threadpool_limits(1):
        if struck is None:
            struck = identify(test.hammer, IdentifyOptions(held_out=0))
        return unbalance(test, struck, options), truth


@dataclass(frozen=True)
class _Task:
    """One compressor in several states."""

    seed: int
    level: CalibrationLevel
    cases: tuple[MountCase, ...]
    options: UnbalanceOptions


def _carried_out(task: _Task) -> list[CaseErrors]:
    """Measure and evaluate; states that differ in operation only share their hammer test."""
    rows: list[CaseErrors] = []
    struck: Identification | None = None
    with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
        for case in task.cases:
            folder = Path(scratch) / case.name.lower()
            write_operating_test(folder, task.seed, task.level, operation_plan(task.seed, case))
            found, truth = _evaluated(folder, struck, task.options)
            struck = found.identification
            rows += _rows(task.seed, case, found, truth)
    return rows


def _rows(seed: int, case: MountCase, found: Unbalance, truth: UnbalanceTruth) -> list[CaseErrors]:
    alarmed = bool(found.alarms)
    return [
        CaseErrors(
            seed,
            case,
            result.route.letter,
            route_errors(result, truth),
            abs(result.sources.static.value / truth.static - 1),
            abs(result.sources.dynamic.value / truth.dynamic - 1),
            _gas_error(result, truth),
            alarmed,
        )
        for result in found.routes
    ]


def _gas_error(result: RouteResult, truth: UnbalanceTruth) -> float:
    """Of the moment of the gas, which is all that acts about x; the worse pressure."""
    true = {
        sweep.pressure: complex(truth.loads[sweep.sweep][0, 3])
        for sweep in result.sweeps
        if sweep.sweep in truth.loads
    }
    return max(
        abs(gas.moment.value / true[gas.pressure] - 1)
        for gas in result.sources.gas
        if gas.pressure in true
    )


@contextmanager
def _spread(tasks: Sequence[_Task], workers: int) -> Iterator[Iterable[list[CaseErrors]]]:
    """Work tasks off in processes, or here; results come in the order of the tasks."""
    if workers == 0 or not tasks:
        yield map(_carried_out, tasks)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield pool.map(_carried_out, tasks)
