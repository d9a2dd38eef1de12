"""Draw fleets from the prior and keep what each shows: the rates beside the studies' figures.

    python benchmarks/write_fleet_rates.py

None of the fleets is chosen. The file is part of the package; the claims draw the fleets again.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import qmc

import deboom.bench
from deboom.arrays import ComplexArray, RealArray
from deboom.bench.fleet import load_fleet, noise_transfer
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.platform_writer import NAME
from deboom.bench.powertrain import load_bench, read_data
from deboom.bench.unselected_fleets import DATA, UnselectedFleets
from deboom.files.disk import replace_text
from deboom.physics.sound_level import spl

SEEDS = range(1001, 1301)
GEAR, TORQUE_LIMIT = 5, 220.0
HALF_WIDTH = 0.15
N_DESIGNS = 300
N_SOBOL = 256
SEED = 5
BAND = np.linspace(20.0, 60.0, 161)
"""Lines of the index [Hz]."""


def draw_unselected(seeds: Iterable[int]) -> UnselectedFleets:
    """Draw fleets and find what each of them shows; about 0.2 s per fleet.

    Correlations are those of `N_DESIGNS` Latin hypercube designs within ±15 %, total indices
    Jansen's estimate from `N_SOBOL` times as many points as forces plus two, of the sum of dB over
    the lines.
    """
    force = true_run(load_bench(), PlannedRun(GEAR, TORQUE_LIMIT), BAND).path_force
    figures = pd.DataFrame([fleet_figures(seed, force) for seed in seeds])
    return UnselectedFleets(NAME, *_first_group(), figures)


def _first_group() -> tuple[tuple[str, ...], str]:
    """Vehicles of the first group without, and the one with the battery."""
    prior = read_data("body_prior.json")
    numbers = range(1, prior["vehicles_per_group"] + 1)
    names = [f"{prior['groups'][0]}-{number}" for number in numbers]
    battery: str = prior["battery"]["vehicle"]
    return tuple(name for name in names if name != battery), battery


def fleet_figures(seed: int, force: ComplexArray) -> dict[str, float]:
    """Find what the fleet of a seed shows with given forces at the paths (f, n_path) [N]."""
    prior = read_data("body_prior.json")
    paths = list(prior["paths"])
    alike, battery = _first_group()
    fleet = load_fleet(seed)
    pressures = {
        name: noise_transfer(body, fleet.cabin, BAND) * force for name, body in fleet.bodies.items()
    }
    designs = _within(qmc.LatinHypercube(len(paths), rng=SEED).random(N_DESIGNS))
    sums = {name: _index(pressure, designs) for name, pressure in pressures.items()}
    groups = [
        np.sum([sums[name] for name in sums if name.startswith(f"{group}-")], axis=0)
        for group in prior["groups"]
    ]
    among = np.corrcoef([sums[name] for name in (*alike, battery)])
    leaders = [
        {paths[place] for place in np.argsort(_total_indices(pressures[name]))[-2:]}
        for name in alike
    ]
    largest = int(np.argmax(_total_indices(pressures[battery])))
    return dict(
        seed=seed,
        r_groups_min=round(float(np.corrcoef(groups).min()), 4),
        r_alike_min=round(float(among[:-1, :-1].min()), 4),
        r_battery_mean=round(float(among[-1, :-1].mean()), 4),
        strut_and_wishbone_lead=all(pair == {"TSM x", "Du x"} for pair in leaders),
        gearbox_leads=paths[largest] == "GeM x",
    )


def _within(points: RealArray) -> RealArray:
    return np.asarray(1.0 + HALF_WIDTH * (2.0 * points - 1.0))


def _index(pressure: ComplexArray, designs: RealArray) -> RealArray:
    """Mean level of the lines, shape (n_design,) [dB(A)]."""
    return np.asarray(spl(pressure @ designs.T, BAND).mean(axis=0))


def _total_indices(pressure: ComplexArray) -> RealArray:
    """Total index of every path, shape (n_path,) [1]."""
    k = pressure.shape[1]
    points = _within(qmc.Sobol(2 * k, rng=SEED).random(N_SOBOL))
    base, other = points[:, :k], points[:, k:]
    level = _index(pressure, base)
    variance = np.concatenate([level, _index(pressure, other)]).var()
    totals = []
    for column in range(k):
        mixed = base.copy()
        mixed[:, column] = other[:, column]
        totals.append(np.mean((level - _index(pressure, mixed)) ** 2) / (2.0 * variance))
    return np.array(totals)


def _json(fleets: UnselectedFleets) -> str:
    """Text of the data file."""
    head = {"platform": fleets.platform, "alike": fleets.alike, "battery": fleets.battery}
    rows = ",\n  ".join(json.dumps(fleet) for fleet in fleets.figures.to_dict("records"))
    return f'{json.dumps(head)[:-1]}, "fleets": [\n  {rows}\n]}}\n'


if __name__ == "__main__":
    path = Path(deboom.bench.__file__).parent / "data" / DATA
    replace_text(path, _json(draw_unselected(SEEDS)))
    print(path)
