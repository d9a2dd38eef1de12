"""Virtual electric cars, measured by several laboratories, and what hoses do in whole fleets."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.bench.compressor_plan import CalibrationLevel, CompressorCase, CompressorPlan
from deboom.bench.compressor_sources import true_source
from deboom.bench.compressor_truth import true_compressor
from deboom.bench.electric_car_writer import write_electric_car
from deboom.bench.electric_fleet import draw_fleet, frozen_fleet
from deboom.bench.hose_gain import HoseGain, hose_gain
from deboom.bench.hoses import drawn_hoses
from deboom.errors import InputError
from deboom.study.compressor_noise import CarNoise, MeasuredNoise, NoisePlan, noise_of_car
from deboom.study.progress import Progress


@dataclass(frozen=True, eq=False)
class VirtualCars:
    """What a study of virtual cars shows.

    Parameters
    ----------
    first : MeasuredNoise
        First car of the first laboratory, in detail.
    cases : tuple of CarNoise
        All cars of all laboratories.
    """

    first: MeasuredNoise
    cases: tuple[CarNoise, ...]


def virtual_cars(
    cars: int,
    seeds: Sequence[int],
    level: CalibrationLevel,
    plan: NoisePlan,
    progress: Progress,
    *,
    workers: int,
) -> VirtualCars:
    """Let laboratories measure the frozen cars, and evaluate each.

    Parameters
    ----------
    cars : int
        So many of the frozen fleet's.
    seeds : sequence of int
        One laboratory each, with a hammer test and hoses of its own.
    level : CalibrationLevel
        Of sensors and impacts.
    plan : NoisePlan
    progress : callable
    workers : int
        Processes beside this one; 0 does all here. The result is the same.

    Returns
    -------
    VirtualCars

    Raises
    ------
    InputError
        More cars than the fleet has, or none; no laboratory.
    """
    names = tuple(frozen_fleet().cars)
    if not 1 <= cars <= len(names):
        raise InputError(f"the frozen fleet has {len(names)} cars: ask for 1 to {len(names)}")
    if not seeds:
        raise InputError("no laboratory measures a car: ask for at least one")
    tasks = [_Task(seed, level, names[:cars], plan) for seed in seeds]
    with _spread(tasks[1:], workers) as others:
        own = list(_measured(tasks[0], progress, len(seeds)))
        cases = [one.noise for one in own]
        for number, rows in enumerate(others, start=1):
            progress(number * cars, len(seeds) * cars, "other laboratories")
            cases += rows
    progress(len(seeds) * cars, len(seeds) * cars, "done")
    return VirtualCars(own[0], tuple(cases))


def fleet_gains(fleets: int) -> tuple[HoseGain, ...]:
    """Run one compressor with hoses as drawn, and without, in fleets drawn from their prior.

    Parameters
    ----------
    fleets : int
        Of five cars each, seeds 1 to this.

    Returns
    -------
    tuple of HoseGain

    Raises
    ------
    InputError
        No fleet.

    Notes
    -----
    Nothing is selected and nothing tuned: compressor of table 11, first pressure, every car.
    """
    if fleets < 1:
        raise InputError("a gain over fleets needs at least one fleet")
    plan = CompressorPlan(CompressorCase.TABLE11)
    compressor = true_compressor(plan, np.random.default_rng(1))
    source, hoses = true_source(), drawn_hoses()
    with threadpool_limits(1):
        return tuple(
            hose_gain(draw_fleet(seed), compressor, source, hoses) for seed in range(1, fleets + 1)
        )


@dataclass(frozen=True)
class _Task:
    """One laboratory and its cars."""

    seed: int
    level: CalibrationLevel
    cars: tuple[str, ...]
    plan: NoisePlan


def _measured(task: _Task, progress: Progress, n_task: int) -> Iterator[MeasuredNoise]:
    """Measure and evaluate; all cars share the hammer test on their compressor."""
    found = None
    for number, name in enumerate(task.cars):
        progress(number, n_task * len(task.cars), name)
        with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
            folder = Path(scratch) / name
            write_electric_car(folder, task.seed, name, level=task.level)
            one = noise_of_car(folder, task.plan, lambda _: None, found=found, seed=task.seed)
        found = one.there.found
        yield one


def _carried_out(task: _Task) -> list[CarNoise]:
    return [one.noise for one in _measured(task, lambda *_: None, 1)]


@contextmanager
def _spread(tasks: Sequence[_Task], workers: int) -> Iterator[Iterable[list[CarNoise]]]:
    """Work tasks off in processes, or here; results come in the order of the tasks."""
    if workers == 0 or not tasks:
        yield map(_carried_out, tasks)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield pool.map(_carried_out, tasks)
