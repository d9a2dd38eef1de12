"""A second engine on mounts of the library.

Three cylinders of order 1.5 give the response surfaces of the mounts, four cylinders of order 2
with other mass, mount positions and gears measure forces on the same mounts (thesis, 3.6.2).
Virtual benches, each with a mount set of M1 to M5; the second engine has sensors of its own, so the
errors of two measuring chains stand between prediction and measurement. "Against the truth"
compares with the true stiffness under the second engine instead. Lines outside of the region in
which a mount was measured are not predicted. Preload of the surfaces: the static force along the
main axis of the mount. y is not identified, nothing is claimed of it.

No laboratory with these tolerances passes 99.5 % in GeM z: with mounts from a chain without any
error, the second engine's own chain leaves R² at 97.4 and 96.4 % (M2, M3); without its errors it is
99.9 %. Du x errs by 10 % on one bench (M3), 0.7 % if the first chain has no errors: in the first
engine's runs the wheel end had almost one amplitude per preload and frequency, the second moves it
less, and the cubic is hardly bound in between.
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
from deboom.study.second_engine import engine_numbers, virtual_engine

SEEDS = range(1, 1 + draws(2))
SETS = ("M1", "M2", "M3", "M4", "M5")


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        benches = list(pool.map(_bench, SEEDS))
    numbers = pd.concat(benches)
    numbers = numbers.assign(r2=numbers[["r2_real", "r2_imag"]].min(axis=1))
    return [*_forces(numbers), *_truth(numbers), _statics(numbers)]


def _bench(seed: int) -> pd.DataFrame:
    with threadpool_limits(1):
        options = CharacteriseOptions(preload=Preload.STATIC_FORCE)
        done = virtual_engine(seed, SETS[seed % len(SETS)], options, lambda *_: None)
        return engine_numbers(done)


def _along(numbers: pd.DataFrame, axis: str) -> pd.DataFrame:
    return numbers[numbers["direction"].str.endswith(f" {axis}")]


def _medians(numbers: pd.DataFrame, column: str) -> pd.Series[float]:
    return numbers.groupby("direction", sort=False)[column].median()


def _words(values: pd.Series[float], factor: float = 100.0, digits: int = 1) -> str:
    return ", ".join(f"{factor * value:.{digits}f}" for value in values)


def _forces(numbers: pd.DataFrame) -> list[Claim]:
    rows = []
    for axis in "xz":
        r2 = _medians(_along(numbers, axis), "r2")
        rows.append(
            Claim(
                f"R² of the predicted force, worse of Re and Im, {', '.join(r2.index)}, median [%]",
                "at least 99.5",
                _words(r2),
                bool(np.all(r2 >= 0.995)),
            )
        )
    return rows


def _truth(numbers: pd.DataFrame) -> list[Claim]:
    rows = []
    for axis, median, at_90 in (("x", 0.02, 0.03), ("z", 0.05, 0.10)):
        own = _along(numbers, axis)
        found = _medians(own, "truth_error")
        worst = own.groupby("direction", sort=False)["truth_error"].quantile(0.9)
        rows.append(
            Claim(
                f"predicted |K| against the truth under the second engine, {', '.join(found.index)}"
                ", median; 90 % of the benches [%]",
                f"at most {100 * median:.0f}; {100 * at_90:.0f}",
                f"{_words(found)}; {_words(worst)}",
                bool(np.all(found <= median) and np.all(worst <= at_90)),
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
