"""One compressor in one laboratory, the same in every test that a seed writes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from deboom.bench.compressor_plan import CalibrationLevel, CompressorPlan
from deboom.bench.compressor_rig import (
    NO_PLACEMENT_ERRORS,
    Placed,
    Sheet,
    place,
    placement_errors,
    position_sheet,
)
from deboom.bench.compressor_truth import Compressor, true_compressor
from deboom.errors import InputError


class Purpose(IntEnum):
    """What random numbers are for: one compressor under every level, and so on."""

    COMPRESSOR = 0
    PLACING = 1
    STRIKING = 2
    WEIGHING = 3
    STRIKING_WITH_HOSES = 4
    RUNNING = 5


@dataclass(frozen=True, eq=False)
class Laboratory:
    """A compressor with its sensors glued on and its impacts marked.

    Parameters
    ----------
    compressor : Compressor
        The truth.
    sheet : Sheet
        Where sensors and impacts should be.
    placed : Placed
        Where they are.
    """

    compressor: Compressor
    sheet: Sheet
    placed: Placed


def draw(seed: int, *purpose: int) -> np.random.Generator:
    """Return the random numbers of a seed for one purpose.

    Raises
    ------
    InputError
        Seed below 1.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    return np.random.default_rng([seed, *purpose])


def laboratory(
    seed: int, level: CalibrationLevel, plan: CompressorPlan, *, noise_free: bool = False
) -> Laboratory:
    """Set up the laboratory of a seed.

    Parameters
    ----------
    seed : int
        From 1.
    level : CalibrationLevel
        How large the errors of placement and calibration are.
    plan : CompressorPlan
        Which compressor; with hoses or without, it is the same one.
    noise_free : bool
        Everything is where it should be.

    Raises
    ------
    InputError
        Seed below 1.
    """
    compressor = true_compressor(plan, draw(seed, Purpose.COMPRESSOR))
    sheet = position_sheet()
    errors = NO_PLACEMENT_ERRORS if noise_free else placement_errors(level)
    return Laboratory(compressor, sheet, place(sheet, errors, draw(seed, Purpose.PLACING)))
