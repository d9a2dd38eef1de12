"""Whose certainty is asked for, and from whose differences the sizes of errors come."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.fronts import verify
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.selection import pick
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Frf
from deboom.measurement.measured_vehicle import Method, path_noise_transfer
from deboom.measurement.method_difference import method_difference
from deboom.study.compare_runs import DESIGNS, FRONT
from deboom.study.measured_uncertainty import TODAY
from deboom.study.progress import Progress
from deboom.vehicles.fleet import Band, lines_inside
from deboom.vehicles.platform_uncertainty import TransferUncertainty

MOST_POINTS = 60
"""Of a front, evenly over it, that are drawn again."""
VERIFICATION = 1024


def front_designs(
    run: Path | None,
    robust: RobustResponse,
    population: int,
    generations: int,
    seed: int,
    progress: Progress,
) -> tuple[dict[str, RealArray], RealArray]:
    """Return today's design with the picks, and the front.

    Parameters
    ----------
    run : Path or None
        Finished run of a front study of the same variables; None: a search of its own.
    robust : RobustResponse
        What a search minimises.
    population, generations, seed : int
        Of that search.
    progress : callable
        Of that search.

    Returns
    -------
    designs : dict of str to array, shape (k,)
        `TODAY` first [1].
    front : array, shape (n, k)
        At most `MOST_POINTS` of it, picks included [1].

    Raises
    ------
    InputError
        A run that misses its front or its designs, or has other variables.
    """
    if run is not None:
        designs, picks = _of_run(run, robust)
    else:
        search = nsga2(robust, population, generations, seed=seed, progress=progress)
        designs = np.asarray(search.front.designs)
        rows = pick(verify(search.front, robust, n_samples=VERIFICATION, seed=seed).values)
        picks = {"best mean": rows.best_mean, "best sigma": rows.best_sigma, "knee": rows.knee}
    few = np.linspace(0, len(designs) - 1, min(MOST_POINTS, len(designs))).astype(int)
    kept = sorted({*few.tolist(), *picks.values()})
    named = {name: designs[row] for name, row in picks.items()}
    return {TODAY: np.asarray(robust.space.nominal), **named}, designs[kept]


def measured_transfer(
    folders: Sequence[Path], ear: str | None, band: Band, *, averaged: bool
) -> tuple[TransferUncertainty | None, tuple[Path, ...]]:
    """Estimate the errors of noise transfer functions from vehicles measured in two ways.

    Parameters
    ----------
    folders : sequence of Path
        Of measured vehicles; none: the stated priors stay.
    ear : str or None
        Such as ``driver ear``; by default the first of each vehicle.
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    averaged : bool
        Whether the platform's functions are means of both methods.

    Returns
    -------
    TransferUncertainty or None
        None without a vehicle.
    tuple of Path
        Files that were read.

    Raises
    ------
    InputError
        See `deboom.files.vehicle.read_vehicle` and `method_difference`.
    """
    if not folders:
        return None, ()
    pairs = []
    for folder in folders:
        vehicle = read_vehicle(folder)
        whose = ear or vehicle.ears[0]
        hammer, loudspeaker = (
            _inside(path_noise_transfer(vehicle, method, whose), band)
            for method in (Method.DIRECT, Method.RECIPROCAL)
        )
        pairs.append((hammer, loudspeaker))
    names = ", ".join(folder.name for folder in folders)
    found = method_difference(pairs)
    files = tuple(
        path for folder in folders for path in sorted(folder.rglob("*")) if path.is_file()
    )
    origin = f"both methods in {names}"
    return TransferUncertainty.of_methods(found, origin, averaged=averaged), files


def _of_run(folder: Path, robust: RobustResponse) -> tuple[RealArray, dict[str, int]]:
    for name in (DESIGNS, FRONT):
        if not (folder / name).is_file():
            raise InputError(
                f"{folder} has no {name}: give the folder of a finished run of a front study"
            )
    table, front = pd.read_csv(folder / DESIGNS), pd.read_csv(folder / FRONT)
    labels = [f"{name} [{unit}]" for name, unit in zip(*_labels(robust), strict=True)]
    missing = [label for label in labels if label not in table.columns]
    if missing:
        raise InputError(
            f"{folder / DESIGNS} has no column '{missing[0]}': the run belongs to other mounts, or "
            "to another meaning of the factors"
        )
    named = front["pick"].fillna("") if "pick" in front else [""] * len(front)
    picks = {str(name): row for row, name in enumerate(named) if name}
    if not picks:
        raise InputError(f"{folder / FRONT} names no design: its study picks none")
    return table[labels].to_numpy(dtype=float), picks


def _labels(robust: RobustResponse) -> tuple[Sequence[str], Sequence[str]]:
    return robust.space.names, robust.space.units


def _inside(transfer: Frf, band: Band) -> Frf:
    lines = lines_inside(transfer.frequency, band, "measured vehicle")
    return Frf(
        transfer.frequency[lines],
        transfer.values[lines],
        transfer.outputs,
        transfer.inputs,
        transfer.unit,
    )
