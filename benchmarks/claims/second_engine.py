"""A second engine on mounts of the library.

Three cylinders of order 1.5 give the response surfaces of the mounts, four cylinders of order 2
with other mass, mount positions and gears measure forces on the same mounts (thesis, 3.6.2). Six
virtual benches, each with a mount set of M1 to M5; the second engine has sensors of its own, so the
errors of two measuring chains stand between prediction and measurement. "Against the truth"
compares with the true stiffness under the second engine instead. Lines outside of the region in
which a mount was measured are counted and not predicted. Preload of the surfaces: the static force
along the main axis of the mount.

R² of GeM z is below 99.5 % because both chains are misaligned; its stiffness is right. Du x errs by
10 % on one bench (part M3): in the first engine's runs the wheel end had almost one amplitude per
preload and frequency, the second moves it less, and the cubic is hardly bound in between.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from claims import Claim, draws
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.operating_map import Preload
from deboom.mounts.surface_forces import MountState
from deboom.study.second_engine import (
    BY_KINEMATICS,
    engine_numbers,
    preload_numbers,
    second_engines,
)

SEEDS = range(1, 1 + draws(2))
SETS = ("M1", "M2", "M3", "M4", "M5")


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        benches = list(pool.map(_bench, SEEDS))
    numbers, preload = (pd.concat(tables) for tables in zip(*benches, strict=True))
    numbers = numbers.assign(r2=numbers[["r2_real", "r2_imag"]].min(axis=1))
    return [
        *_forces(numbers),
        *_truth(numbers),
        _inside(numbers),
        *_preload(preload),
        _statics(numbers),
    ]


def _bench(seed: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    with threadpool_limits(1):
        options = CharacteriseOptions(preload=Preload.STATIC_FORCE, folds=0)
        done = second_engines((seed,), SETS[seed % len(SETS)], options, lambda *_: None)
        return engine_numbers(done), preload_numbers(done)


def _along(numbers: pd.DataFrame, axis: str) -> pd.DataFrame:
    return numbers[numbers["direction"].str.endswith(f" {axis}")]


def _medians(numbers: pd.DataFrame, column: str) -> pd.Series[float]:
    return numbers.groupby("direction", sort=False)[column].median()


def _words(values: pd.Series[float], factor: float = 100.0, digits: int = 1) -> str:
    return ", ".join(f"{factor * value:.{digits}f}" for value in values)


def _forces(numbers: pd.DataFrame) -> list[Claim]:
    rows = []
    for axis, asked in (("x", 0.995), ("z", 0.995), ("y", None)):
        own = _along(numbers, axis)
        r2, error, peak = (_medians(own, column) for column in ("r2", "error", "peak"))
        rows += [
            Claim(
                f"R² of the predicted force, worse of Re and Im, {', '.join(r2.index)}, median [%]",
                "no claim" if asked is None else f"at least {100 * asked:.1f}",
                _words(r2),
                asked is None or bool(np.all(r2 >= asked)),
            ),
            Claim(
                f"rms error of the predicted force [%]; largest difference of a run's peak [dB], "
                f"{', '.join(error.index)}, median",
                "no claim",
                f"{_words(error)}; {_words(peak, 1.0, 2)}",
                True,
            ),
        ]
    return rows


def _truth(numbers: pd.DataFrame) -> list[Claim]:
    rows = []
    for axis, median, at_90 in (("x", 0.02, 0.03), ("z", 0.05, 0.10), ("y", None, None)):
        own = _along(numbers, axis)
        found = _medians(own, "truth_error")
        worst = own.groupby("direction", sort=False)["truth_error"].quantile(0.9)
        rows.append(
            Claim(
                f"predicted |K| against the truth under the second engine, {', '.join(found.index)}"
                ", median; 90 % of the benches [%]",
                "no claim" if median is None else f"at most {100 * median:.0f}; {100 * at_90:.0f}",
                f"{_words(found)}; {_words(worst)}",
                median is None or bool(np.all(found <= median) and np.all(worst <= at_90)),
            )
        )
    return rows


def _inside(numbers: pd.DataFrame) -> Claim:
    share = _medians(numbers, "inside")
    return Claim(
        f"lines within the region that the mounts were measured in, {', '.join(share.index)} [%]",
        "said",
        _words(share, digits=0),
        True,
    )


def _preload(preload: pd.DataFrame) -> list[Claim]:
    rows = []
    identified = preload[~preload["direction"].str.endswith(" y")]
    for axis in ("x", "z"):
        own = _along(identified, axis)
        own = own[~own["direction"].str.startswith("Du")]
        by_state = {
            label: float(rows_of["error"].median())
            for label, rows_of in own.groupby("preload", sort=False)
        }
        main = by_state[MountState.MAIN_FORCE.value]
        other = MountState.WHEEL_TORQUE if axis == "x" else MountState.OWN_FORCE
        rows.append(
            Claim(
                f"rms error of the force along {axis} over {'; '.join(by_state)}, median over "
                "mounts and benches [%]",
                "first less than third" if axis == "x" else "first less than second",
                "; ".join(f"{100 * value:.1f}" for value in by_state.values()),
                main < by_state[other.value],
            )
        )
    by_kinematics = identified[identified["preload"] == BY_KINEMATICS]
    rows.append(
        Claim(
            "rms error of the force with the static force of the kinematic model, "
            f"{', '.join(_medians(by_kinematics, 'error').index)}, median [%]",
            "no claim",
            _words(_medians(by_kinematics, "error")),
            True,
        )
    )
    return rows


def _statics(numbers: pd.DataFrame) -> Claim:
    known = numbers.dropna(subset=["static_difference"])
    found = _medians(known, "static_difference")
    return Claim(
        "static force of the second engine by suppliers' curves against its cells (5 N noise), "
        f"{', '.join(found.index)}, rms [N]",
        "at most 15",
        _words(found, 1.0),
        bool(np.all(found <= 15)),
    )
