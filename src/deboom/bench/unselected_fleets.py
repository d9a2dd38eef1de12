"""How often a fleet shows what the thesis reports, if nobody chose it.

The shipped fleet was chosen because it shows every phenomenon. Here fleets are drawn from the prior
as they come, on the true forces of the bench, and each phenomenon is counted.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.fleet import draw_fleet, load_fleet, noise_transfer
from deboom.bench.layout import NAME
from deboom.bench.operating_run import full_load_run
from deboom.bench.powertrain import load_bench, read_data
from deboom.physics.sound_level import spl

DATA = "unselected_fleets.json"
GEAR, TORQUE_LIMIT = 5, 220.0
HALF_WIDTH = 0.15
N_DESIGNS = 300
N_SOBOL = 256
SEED = 5
BAND = np.linspace(20.0, 60.0, 161)
"""Lines of the index [Hz]."""


@dataclass(frozen=True)
class FleetFigures:
    """What one drawn fleet shows, for designs within ±15 %.

    Parameters
    ----------
    seed : int
        Of the draw.
    r_groups_min : float
        Least correlation of two groups; a group's index is the sum over its vehicles [1].
    r_alike_min : float
        Least correlation of two vehicles of the first group, without the one with the battery [1].
    r_battery_mean : float
        Mean correlation of the vehicle with the battery and those [1].
    strut_and_wishbone_lead : bool
        Whether TSM x and Du x have the two largest total indices in each of those vehicles.
    gearbox_leads : bool
        Whether GeM x has the largest total index in the vehicle with the battery.
    """

    seed: int
    r_groups_min: float
    r_alike_min: float
    r_battery_mean: float
    strut_and_wishbone_lead: bool
    gearbox_leads: bool


@dataclass(frozen=True)
class Rate:
    """How often one phenomenon shows in unselected fleets.

    Parameters
    ----------
    phenomenon : str
        In words.
    rate : float
        Share of the fleets [1].
    standard_error : float
        Of the rate [1].
    n_fleets : int
        Fleets drawn.
    """

    phenomenon: str
    rate: float
    standard_error: float
    n_fleets: int


@dataclass(frozen=True)
class UnselectedFleets:
    """Drawn fleets, none of them chosen.

    Parameters
    ----------
    platform : str
        Name of the bench's platform, whose figures these are to be held against.
    alike : tuple of str
        Vehicles of the first group without the one with the battery.
    battery : str
        That one.
    fleets : tuple of FleetFigures
        One per draw.
    """

    platform: str
    alike: tuple[str, ...]
    battery: str
    fleets: tuple[FleetFigures, ...]

    def values(self, figure: str) -> RealArray:
        """Return one figure of all fleets, shape (n_fleet,) [1]."""
        return np.array([getattr(fleet, figure) for fleet in self.fleets], dtype=float)

    def rates(self) -> dict[str, Rate]:
        """Return the rate of every phenomenon, by a short name."""
        groups, alike, battery = (
            self.values(name) for name in ("r_groups_min", "r_alike_min", "r_battery_mean")
        )
        alike_names = f"{self.alike[0]} to {self.alike[-1]}"
        found = {
            "groups": ("groups correlate above 0.9", groups > 0.9),
            "alike": (f"{alike_names} correlate above 0.9", alike > 0.9),
            "alike_closely": (f"{alike_names} correlate above 0.95", alike > 0.95),
            "battery": (
                f"{self.battery} correlates with them by 0.3 to 0.8 on average",
                (battery > 0.3) & (battery < 0.8),
            ),
            "strut_and_wishbone": (
                f"TSM x and Du x lead in each of {alike_names}",
                self.values("strut_and_wishbone_lead") > 0,
            ),
            "gearbox": (f"GeM x leads in {self.battery}", self.values("gearbox_leads") > 0),
            "correlations": (
                f"groups above 0.9, {alike_names} above 0.95, {self.battery} within 0.3 to 0.8",
                (groups > 0.9) & (alike > 0.95) & (battery > 0.3) & (battery < 0.8),
            ),
        }
        n = len(self.fleets)
        return {
            name: Rate(words, float(shown.mean()), float(np.sqrt(shown.var() / n)), n)
            for name, (words, shown) in found.items()
        }

    def to_json(self) -> str:
        """Return the text of the data file."""
        head = {"platform": self.platform, "alike": self.alike, "battery": self.battery}
        rows = ",\n  ".join(json.dumps(asdict(fleet)) for fleet in self.fleets)
        return f'{json.dumps(head)[:-1]}, "fleets": [\n  {rows}\n]}}\n'


def draw_unselected(seeds: Iterable[int]) -> UnselectedFleets:
    """Draw fleets and find what each of them shows; about 0.2 s per fleet.

    Parameters
    ----------
    seeds : iterable of int
        Of the draws.

    Notes
    -----
    Correlations are those of `N_DESIGNS` Latin hypercube designs within ±15 %, total indices
    Jansen's estimate from `N_SOBOL` times as many points as forces plus two, of the sum of dB over
    the lines.
    """
    force = full_load_run(load_bench(), GEAR, TORQUE_LIMIT, BAND).path_force
    fleets = tuple(_figures(seed, force) for seed in seeds)
    return UnselectedFleets(NAME, *_first_group(), fleets)


def load_unselected() -> UnselectedFleets:
    """Return the fleets that ``benchmarks/write_fleet_rates.py`` has drawn."""
    data: Mapping[str, Any] = read_data(DATA)
    fleets = tuple(FleetFigures(**fleet) for fleet in data["fleets"])
    return UnselectedFleets(data["platform"], tuple(data["alike"]), data["battery"], fleets)


def _first_group() -> tuple[tuple[str, ...], str]:
    """Vehicles of the first group without, and the one with the battery."""
    prior = read_data("body_prior.json")
    numbers = range(1, prior["vehicles_per_group"] + 1)
    names = [f"{prior['groups'][0]}-{number}" for number in numbers]
    battery: str = prior["battery"]["vehicle"]
    return tuple(name for name in names if name != battery), battery


def _figures(seed: int, force: ComplexArray) -> FleetFigures:
    prior = read_data("body_prior.json")
    paths = list(prior["paths"])
    alike, battery = _first_group()
    cabin, bodies = load_fleet(seed).cabin, draw_fleet(seed)
    pressures = {name: noise_transfer(body, cabin, BAND) * force for name, body in bodies.items()}
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
    return FleetFigures(
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
