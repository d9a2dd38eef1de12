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

from claims import CASES, Claim, in_processes, over_draws
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.operating_map import Preload
from deboom.runs.runner import load_study

STUDY = load_study("second_engine").module
SETS = ("M1", "M2", "M3", "M4", "M5")


def claims() -> list[Claim]:
    numbers = pd.concat(in_processes(_bench, CASES))
    r2 = 100 * numbers[["r2_real", "r2_imag"]].min(axis=1)
    truth = "predicted |K| against the truth under the second engine"
    static = (
        "static force of the second engine by suppliers' curves against its cells (5 N noise), rms"
    )
    return [
        *(
            _over(
                "R² of the predicted force, worse of Re and Im", numbers, r2, axis, "%", {0.5: 99.5}
            )
            for axis in "xz"
        ),
        *(
            _over(truth, numbers, 100 * numbers["truth_error"], axis, "%", {0.5: median, 0.9: most})
            for axis, median, most in (("x", 2, 3), ("z", 5, 10))
        ),
        _over(static, numbers, numbers["static_difference"], "x", "N", {0.5: 15}),
    ]


def _bench(seed: int) -> pd.DataFrame:
    options = CharacteriseOptions(preload=Preload.STATIC_FORCE, draws=20)  # no row shows a budget
    done = STUDY.virtual_engine(seed, SETS[(seed - 1) % len(SETS)], options, lambda *_: None)
    return STUDY.engine_numbers(done).assign(seed=seed)


def _over(
    topic: str,
    numbers: pd.DataFrame,
    values: pd.Series[float],
    axis: str,
    unit: str,
    limits: dict[float, float],
) -> Claim:
    of_axis = numbers.assign(value=values)[numbers["direction"].str.endswith(f" {axis}")]
    names = of_axis.dropna(subset=["value"])["direction"].unique()
    table = of_axis.pivot(index="seed", columns="direction", values="value")[names]
    topic = f"{topic}, {', '.join(names)} [{unit}]"
    return over_draws(topic, table, limits, 1, least=topic.startswith("R²"))
