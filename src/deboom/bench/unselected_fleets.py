"""How often a fleet shows what the thesis reports, if nobody chose it.

The shipped fleet was chosen because it shows every phenomenon. These fleets were drawn from the
prior as they come, by ``benchmarks/write_fleet_rates.py``, on the true forces of the bench, and
each phenomenon is counted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.powertrain import read_data

DATA = "unselected_fleets.json"


@dataclass(frozen=True)
class FleetFigures:
    """What one drawn fleet shows, for designs within ±15 %.

    - `seed`: seed of the draw.
    - `r_groups_min`: least correlation of two groups; a group's index is the sum over its vehicles
      [1].
    - `r_alike_min`: least correlation of two vehicles of the first group, without the one with the
      battery [1].
    - `r_battery_mean`: mean correlation of the vehicle with the battery and those [1].
    - `strut_and_wishbone_lead`: whether TSM x and Du x have the two largest total indices in each
      of those vehicles.
    - `gearbox_leads`: whether GeM x has the largest total index in the vehicle with the battery.
    """

    seed: int
    r_groups_min: float
    r_alike_min: float
    r_battery_mean: float
    strut_and_wishbone_lead: bool
    gearbox_leads: bool


@dataclass(frozen=True)
class Rate:
    """How often one phenomenon shows in some unselected fleets, with its standard error [1]."""

    phenomenon: str
    rate: float
    standard_error: float
    n_fleets: int


@dataclass(frozen=True)
class UnselectedFleets:
    """Drawn fleets, none of them chosen.

    The platform is the one whose figures these are to be held against; alike are the vehicles of
    the first group without the one with the battery.
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
        shown = {
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
            name: Rate(words, float(true.mean()), float(np.sqrt(true.var() / n)), n)
            for name, (words, true) in shown.items()
        }


def load_unselected() -> UnselectedFleets:
    """Return the fleets that ``benchmarks/write_fleet_rates.py`` has drawn."""
    data = read_data(DATA)
    fleets = tuple(FleetFigures(**fleet) for fleet in data["fleets"])
    return UnselectedFleets(data["platform"], tuple(data["alike"]), data["battery"], fleets)
