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

import pandas as pd

from claims import Claim, at_least, at_most, draws, in_processes
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.operating_map import Preload
from deboom.study.second_engine import engine_numbers, virtual_engine

SEEDS = range(1, 1 + draws(20))
SETS = ("M1", "M2", "M3", "M4", "M5")


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    numbers = pd.concat(in_processes(_bench, SEEDS))
    numbers = numbers.assign(r2=numbers[["r2_real", "r2_imag"]].min(axis=1))
    return [*_forces(numbers), *_truth(numbers), _statics(numbers)]


def _bench(seed: int) -> pd.DataFrame:
    options = CharacteriseOptions(preload=Preload.STATIC_FORCE, draws=20)  # no row shows a budget
    done = virtual_engine(seed, SETS[seed % len(SETS)], options, lambda *_: None)
    return engine_numbers(done)


def _along(numbers: pd.DataFrame, axis: str) -> pd.DataFrame:
    return numbers[numbers["direction"].str.endswith(f" {axis}")]


def _medians(numbers: pd.DataFrame, column: str) -> pd.Series[float]:
    return numbers.groupby("direction", sort=False)[column].median()


def _forces(numbers: pd.DataFrame) -> list[Claim]:
    rows = []
    for axis in "xz":
        r2 = _medians(_along(numbers, axis), "r2")
        rows.append(
            at_least(
                f"R² of the predicted force, worse of Re and Im, {', '.join(r2.index)}, median [%]",
                99.5,
                100 * r2,
                1,
            )
        )
    return rows


def _truth(numbers: pd.DataFrame) -> list[Claim]:
    rows = []
    for axis, limits in (("x", (2, 3)), ("z", (5, 10))):
        own = _along(numbers, axis).groupby("direction", sort=False)["truth_error"]
        for limit, share in zip(limits, (0.5, 0.9), strict=True):
            errors = own.quantile(share)
            rows.append(
                at_most(
                    f"predicted |K| against the truth under the second engine, "
                    f"{', '.join(errors.index)}, {share:.0%} of the benches [%]",
                    limit,
                    100 * errors,
                    1,
                )
            )
    return rows


def _statics(numbers: pd.DataFrame) -> Claim:
    found = _medians(numbers.dropna(subset=["static_difference"]), "static_difference")
    return at_most(
        "static force of the second engine by suppliers' curves against its cells (5 N noise), "
        f"{', '.join(found.index)}, rms [N]",
        15,
        found,
        1,
    )
