"""How often a fleet shows what the thesis reports, if nobody chose it.

The shipped fleet was chosen because it shows every phenomenon. These fleets were drawn from the
prior as they come, by ``benchmarks/write_fleet_rates.py``, on the true forces of the bench, and
each phenomenon is counted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.bench.powertrain import read_data

DATA = "unselected_fleets.json"


@dataclass(frozen=True)
class Rate:
    """How often one phenomenon shows in some unselected fleets, with its standard error [1]."""

    phenomenon: str
    rate: float
    standard_error: float
    n_fleets: int


@dataclass(frozen=True, eq=False)
class UnselectedFleets:
    """Drawn fleets, none of them chosen.

    - `platform`: whose figures these are to be held against.
    - `alike`, `battery`: vehicles of the first group, without and with the battery.
    - `figures`: one row per fleet, for designs within ±15 %: least correlation of two groups
      (summed over their vehicles) and of two alike vehicles, mean one of the battery's with those;
      whether TSM x and Du x have the largest total indices in each of the alike, and GeM x in the
      battery's.
    """

    platform: str
    alike: tuple[str, ...]
    battery: str
    figures: pd.DataFrame

    def values(self, figure: str) -> RealArray:
        """Return one figure of all fleets, shape (n_fleet,) [1]."""
        return self.figures[figure].to_numpy(float)

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
        n = len(self.figures)
        return {
            name: Rate(words, float(true.mean()), float(np.sqrt(true.var() / n)), n)
            for name, (words, true) in shown.items()
        }


def load_unselected() -> UnselectedFleets:
    """Return the fleets that ``benchmarks/write_fleet_rates.py`` has drawn."""
    data = read_data(DATA)
    figures = pd.DataFrame(data["fleets"])
    return UnselectedFleets(data["platform"], tuple(data["alike"]), data["battery"], figures)
