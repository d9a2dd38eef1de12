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

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from claims import CASES, Claim, in_processes, over_draws
from deboom.bench.campaign import second_engine_plan, training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import load_second_engine
from deboom.files.campaign import read_campaign
from deboom.files.truth import read_set_truth
from deboom.measurement.campaign import Campaign
from deboom.mounts.characterise import (
    CharacteriseOptions,
    characterise,
    measuring_chains,
    training_runs,
)
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.measuring_chain import body_record
from deboom.mounts.operating_map import OperatingMap, Preload, operating_maps
from deboom.mounts.response_surface import r_squared
from deboom.mounts.surface_forces import main_axis, predicted_forces
from deboom.vehicles.powertrain import library_model

SETS = ("M1", "M2", "M3", "M4", "M5")
SECOND_BENCH = 500
"""Added to a seed for the second engine: another day, other sensors, the same mounts."""


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
    """Measure both engines on virtual benches, and return a row per predicted direction."""
    how = CharacteriseOptions(preload=Preload.STATIC_FORCE, draws=20)  # no row shows a budget
    mount_set = SETS[(seed - 1) % len(SETS)]
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        first, second = Path(temporary) / "first", Path(temporary) / "second"
        write_campaign(first, seed, training_plan(mount_set))
        plan = second_engine_plan(mount_set)
        write_campaign(second, seed + SECOND_BENCH, plan, bench=load_second_engine())
        mounts = characterise(read_campaign(first, (mount_set,)), mount_set, how).mounts
        campaign = read_campaign(second, (mount_set,))
        truth = read_set_truth(second, mount_set)
    assert truth is not None
    chains, runs = measuring_chains(campaign, how), training_runs(campaign, mount_set, how)
    records = [body_record(chain.alignment.body, runs, campaign.tolerances) for chain in chains]
    maps = operating_maps(chains, records)
    static = _static_differences(mounts, campaign, maps)
    rows = []
    for name, predicted in predicted_forces(mounts, maps, how.regressor).items():
        measured, force, inside = predicted.measured, predicted.force, predicted.inside
        true = truth.at(predicted.lines.select(inside))
        ratio = np.abs(predicted.stiffness[inside]) / np.abs(true)
        rows.append(
            {
                "direction": name,
                "r2_real": r_squared(measured.real, force.real),
                "r2_imag": r_squared(measured.imag, force.imag),
                "truth_error": np.sqrt(np.mean((ratio - 1) ** 2)),
                "static_difference": static.get(name, np.nan),
            }
        )
    return pd.DataFrame(rows).assign(seed=seed)


def _static_differences(
    mounts: Sequence[CharacterisedMount], campaign: Campaign, maps: Mapping[str, OperatingMap]
) -> dict[str, float]:
    """Compare the kinematic model by suppliers' curves with the cells, main axes, rms [N]."""
    places = {entry.name: entry for entry in campaign.mounts}
    moved = []
    for entry in mounts:
        if entry.mount.name in campaign.powertrain_mounts:
            place = places[entry.mount.name]
            mount = replace(entry.mount, positions=place.positions, rotations=place.rotations)
            moved.append(replace(entry, mount=mount))
    model = library_model(moved)
    differences = {}
    for entry in moved:
        name = f"{entry.mount.name} {main_axis(entry)}"
        force = model.force(model.equilibrium(maps[name].wheel_torque))[:, model.column(name)]
        differences[name] = float(np.sqrt(np.mean((force - maps[name].static_force) ** 2)))
    return differences


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
