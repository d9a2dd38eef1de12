"""Prescribed against coupled motion, and searches end to end.

The same 256 designs within ±15 % under both motions in all vehicles and load cases of the shipped
platform; the table `end_to_end` of `make bench`.
"""

from __future__ import annotations

import pandas as pd

import end_to_end
from claims import Claim
from deboom.files.platform import read_platform
from deboom.study.front import same_designs
from deboom.study.options import factor_space
from deboom.study.platform_model import (
    DEMONSTRATION as PLATFORM,
)
from deboom.study.platform_model import (
    Motion,
    MotionOptions,
    MountSource,
    PlatformOptions,
)

COMPARED = 0.15
"""The same designs lie within ``1 ± COMPARED`` [1]."""


def claims() -> list[Claim]:
    return [*_study(), *_end_to_end()]


def _study() -> list[Claim]:
    tables = []
    names = [case.name for case in read_platform(PLATFORM).load_cases]
    for name in names:
        options = PlatformOptions(
            load_case=[name], group=None, platform=PLATFORM, mounts=MountSource.library_inside
        )
        runs = options.operation()
        prescribed, coupled = (
            MotionOptions(motion).index(runs) for motion in (Motion.prescribed, Motion.coupled)
        )
        space = factor_space(coupled.variable_names, COMPARED, 0.15)
        tables.append(same_designs(prescribed, coupled, space))
    table = pd.concat(tables)
    r, slope = table["correlation [1]"].min(), table["slope [1]"]
    return [
        Claim(
            "SPLV under prescribed against coupled motion, shipped fleet: smallest correlation",
            "at least 0.97",
            f"{r:.3f} over {len(table)} vehicles and load cases",
            bool(r >= 0.97),
        ),
        Claim(
            "the same: slope, coupled over prescribed",
            "1.1 to 1.35",
            f"{slope.min():.2f} to {slope.max():.2f}",
            bool(slope.min() >= 1.1 and slope.max() <= 1.35),
        ),
    ]


def _end_to_end() -> list[Claim]:
    table = end_to_end.measure()
    return [
        Claim(
            f"NSGA-II 100 × 100 end to end, {row}",
            f"at least {least:g} times the element-wise loop in pymoo",
            f"{table.loc[row, 'x loop']:.1f} times ({table.loc[row, 'search [s]']:.1f} s, loop "
            f"extrapolated {table.loc[row, 'loop, extrapolated [s]']:.0f} s)",
            bool(table.loc[row, "x loop"] >= least),
        )
        for row, least in ((end_to_end.PRESCRIBED, 11.0), (end_to_end.COUPLED, 24.0))
    ]
