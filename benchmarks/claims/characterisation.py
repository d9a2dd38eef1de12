"""Characterisation of mounts.

Raw channels to response surfaces with error budget on 20 virtual benches: each has its own sensor,
shaker and noise errors, and one of the mount sets M1 to M5. Surfaces over wheel torque, amplitude
and frequency, two pieces, fitted to the 27 rising runs in gears 5 to 7. "True error" is the rms
error of |K| over all lines of a bench; "held out" leaves out the thesis's six full-load runs.

The measuring chains calibrate themselves: six sensors on one rigid body contradict each other where
they are misaligned, and the forces of the mounts must be mass times acceleration. "Stated" is the
same without it. y is reported without a claim. R² falls along y where self-calibration takes
cross-talk away that repeats, and fits, but is wrong.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context

import numpy as np
from threadpoolctl import threadpool_limits

from claims import Claim
from deboom.bench.campaign_plan import (
    LOW_GEAR_RUNS,
    NO_ERRORS,
    TRAINING_RUNS,
    CampaignErrors,
    PlannedRun,
)
from deboom.measurement.campaign import Campaign
from deboom.mounts.agreement import agreement
from deboom.mounts.alignment_estimate import stated_alignment
from deboom.mounts.body_record import body_record
from deboom.mounts.characterisation import Characterisation, CharacteriseOptions
from deboom.mounts.characterise import characterise
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.error_budget import same_pieces
from deboom.mounts.operating_map import OperatingMap, operating_maps
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.mounts.training_region import TrainingRegion
from deboom.physics.arrays import ComplexArray
from deboom.vehicles.kinematic_model import KinematicModel
from virtual_campaign import truth, virtual_campaign

SEEDS = range(1, 21)
SETS = ("M1", "M2", "M3", "M4", "M5")
NOISE_FREE = CharacteriseOptions(folds=0)
CHECK = ((5, 120.0), (5, 220.0), (6, 120.0), (6, 160.0), (6, 220.0), (7, 220.0))
LOOKED_AT = ("EnM", "GeM", "TSM")


@dataclass(frozen=True)
class _Figures:
    """What one bench gave for one direction; ratios [1]."""

    r2: tuple[float, float, float, float]
    r2_held_out: tuple[float, float, float, float]
    error: float
    error_held_out: float
    error_stated: float
    imag_error: float
    coverage: float
    half_width: float
    half_width_stated: float
    identified: bool


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        benches = list(pool.map(_bench, SEEDS))
        noise_free = list(pool.map(_noise_free, SETS))
        all_gears = list(pool.map(_all_gears, list(SEEDS)[:6]))
    figures = {name: [bench[name] for bench in benches] for name in benches[0]}
    return [
        *_surface_claims(figures),
        *_truth_claims(figures),
        *_budget_claims(figures),
        *_self_calibration_claims(figures),
        _noise_free_claim(noise_free),
        _all_gears_claim(all_gears),
        _speed(),
        *_kinematics(),
    ]


def _parts(seed: int) -> str:
    return SETS[seed % len(SETS)]


def _true_stiffness(measured: OperatingMap, parts: str, runs: tuple[PlannedRun, ...]) -> ComplexArray:
    """Truth at the lines of a map, whose labels are a run and maybe a piece."""
    by_name = {planned.name: planned for planned in runs}
    values = np.empty(len(measured), dtype=complex)
    for label in np.unique(measured.run):
        name, _, piece = str(label).partition(" ")
        run, _ = truth(parts, by_name[name])
        channel = " ".join(filter(None, (measured.mount, piece, measured.axis)))
        rows = measured.run == label
        lines = np.searchsorted(run.frequency, measured.frequency[rows])
        values[rows] = run.stiffness[lines, run.channels.index(channel)]
    return values
