"""The front of a search, verified: one table, one picture and one set of picks for every study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import BoolArray, RealArray
from deboom.explore.doe import sobol_designs
from deboom.explore.front import Replicates, search_bias, unbeaten
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.search import SearchResult
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.explore.space import DesignSpace
from deboom.plot.style import FULL_WIDTH, vehicle_colours
from deboom.report import Scalar
from deboom.tabled import Tabled
from deboom.vehicles.booming_model import BoomingModel
from deboom.vehicles.booming_peaks import PeakChange, compare_peaks

if TYPE_CHECKING:
    from deboom.plot.style import Drawing

PERCENT = 100.0
PEAK_COLUMNS = (
    "vehicle",
    "frequency before [Hz]",
    "speed before [rpm]",
    "SPL before [dB(A)]",
    "prominence before [dB]",
    "frequency after [Hz]",
    "speed after [rpm]",
    "SPL after [dB(A)]",
    "prominence after [dB]",
    "change [dB]",
)


@dataclass(frozen=True, eq=False)
class Front(Tabled):
    """A searched front whose designs were evaluated again with draws that the search never saw.

    Parameters
    ----------
    robust : RobustResponse
        Model, design space and draws of the search.
    search : SearchResult
        What was found.
    searched, values : RobustValues
        Designs of the front as the search saw them, and under the draws of the judge.
    judge : Replicates
        The model with draws that the search never saw.
    note : str
        What else there is to say about the search.
    """

    robust: RobustResponse
    search: SearchResult
    searched: RobustValues
    judge: Replicates
    values: RobustValues
    note: str = ""

    speed_label: ClassVar[str] = "engine speed [rpm]"
    """What turns, above a frequency axis."""

    @property
    def index(self) -> Any:
        """The model."""
        return self.robust.evaluate

    @property
    def order(self) -> float:
        """Order of the lines whose levels are shown, per revolution [1]."""
        return 1.0

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_frequency,) [Hz]."""
        return np.asarray(self.index.frequency)

    @property
    def colours(self) -> dict[str, str]:
        """Colour of each vehicle."""
        return vehicle_colours(self.vehicles)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the responses."""
        return tuple(self.index.response_names)

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the design variables."""
        return self.robust.space.names

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        return float(1.0 / (getattr(self.index, "n_lines", 1) * len(self.vehicles)))

    @cached_property
    def picks(self) -> dict[str, int]:
        """Rows by name of the pick, chosen on verified values; see `deboom.explore.selection`."""
        return pick(self.values, self.baseline)

    @cached_property
    def without_effect(self) -> tuple[str, ...]:
        """Variables that no response depends on."""
        return variables_without_effect(self.index, self.robust.space)

    @cached_property
    def pick_designs(self) -> dict[str, RealArray]:
        """Design of each pick, shape (k,); variables without effect are at nominal [1]."""
        designs = at_nominal(self.values.designs, self.robust.space, self.without_effect)
        return {name: designs[row] for name, row in self.picks.items()}

    @property
    def named_designs(self) -> dict[str, RealArray]:
        """Today's design and the picks, each of shape (k,) [1]."""
        return {"today's": self.robust.space.nominal, **self.pick_designs}

    @cached_property
    def baseline(self) -> RobustValues:
        """Today's design under the verification's draws; one row."""
        return self.judge(self.robust.space.nominal[np.newaxis, :])

    @cached_property
    def nondominated(self) -> BoolArray:
        """Designs that no other one beats when verified, shape (n,)."""
        return unbeaten(self.values)

    @property
    def mean_bias(self) -> float:
        """Mean sum in the search minus verified, mean over the designs [response unit]."""
        return search_bias(self.searched, self.values)[0]

    @property
    def sigma_bias_percent(self) -> float:
        """The same of the sigma sum, relative [%]; negative if the search was optimistic."""
        return search_bias(self.searched, self.values)[1]

    @cached_property
    def survivors(self) -> RealArray:
        """What is left of designs that fail in some draws of the verification, shape (n, 2).

        Share of draws that failed [1] and mean sum over the others [dB(A)]; 0 and NaN of a design
        that could be computed. Such designs are neither picks nor on the verified front.
        """
        rows = zip(self.values.designs, self.values.failed, strict=True)
        return np.array(
            [self.judge.sets[0].survivors(x) if failed else (0.0, np.nan) for x, failed in rows]
        )

    @property
    def table(self) -> pd.DataFrame:
        """One row per design: objectives as verified and as searched, as sums and per line."""
        names: dict[int, list[str]] = {}
        for name, row in self.picks.items():
            names.setdefault(row, []).append(name)
        n, unit, searched = len(self.values), self.index.response_unit, self.searched
        sums, scatter = ("SPLV ", "dB") if unit == "dB(A)" else ("", unit)
        share, mean = self.survivors.T
        failing = {
            "failed draws [1]": share,
            f"{sums}mean sum of the other draws [{unit}]": mean,
        }
        return pd.DataFrame(
            {
                "point": np.arange(1, n + 1),
                "pick": [" = ".join(names.get(row, ())) for row in range(n)],
                f"{sums}mean sum [{unit}]": self.values.mean_sum,
                f"{sums}sigma sum [{scatter}]": self.values.sigma_sum,
                f"standard error of mean sum [{scatter}]": self.values.standard_error_mean_sum,
                f"standard error of sigma sum [{scatter}]": self.values.standard_error_sigma_sum,
                f"{sums}mean sum in search [{unit}]": searched.mean_sum,
                f"{sums}sigma sum in search [{scatter}]": searched.sigma_sum,
                "non-dominated when verified": self.nondominated,
                f"mean per line and vehicle [{unit}]": self.per_line * self.values.mean_sum,
                f"sigma per line and vehicle [{scatter}]": self.per_line * self.values.sigma_sum,
                **(failing if share.any() else {}),
            }
        )

    def designs(self) -> pd.DataFrame:
        """Tabulate the variables of every design of the front [units of the space]."""
        designs = self.values.designs
        columns = dict(zip(self.robust.space.labels, designs.T, strict=True))
        return pd.DataFrame({"point": np.arange(1, len(designs) + 1), **columns})

    def convergence(self) -> pd.DataFrame:
        """Tabulate the hypervolume of the front so far, as the search saw it, by generation."""
        volume = self.search.hypervolume
        generation = np.arange(1, len(volume) + 1)
        return pd.DataFrame({"generation": generation, "hypervolume [dB²]": volume})

    def compared(self, designs: Mapping[str, tuple[RobustValues, int]]) -> pd.DataFrame:
        """Tabulate both objectives of named rows of verified values, per vehicle and line.

        - `designs`: values and their row by name; changes are against the first one.
        """
        mean = np.array([values.mean_sum[row] for values, row in designs.values()])
        sigma = np.array([values.sigma_sum[row] for values, row in designs.values()])
        return pd.DataFrame(
            {
                "design": list(designs),
                "mean level [dB(A)]": mean * self.per_line,
                "change [dB]": (mean - mean[0]) * self.per_line,
                "sigma of the level [dB]": sigma * self.per_line,
                "change of sigma [%]": PERCENT * (sigma / sigma[0] - 1.0),
            }
        )

    def splv_change(self, design: RealArray) -> RealArray:
        """Change of SPLV over the number of lines against today's design, shape (v,) [dB]."""
        both = self.index(np.stack([self.robust.space.nominal, design]))
        return np.asarray((both[1] - both[0]) / self.index.n_lines)

    def levels(self, design: RealArray) -> RealArray:
        """SPL of one design without scatter in the first case, shape (v, f) [dB(A)]."""
        return np.asarray(self.index.levels(design[np.newaxis, :])[0])

    def peak_changes(self, design: RealArray) -> dict[str, tuple[PeakChange, ...]]:
        """Booming peaks of each vehicle today and in one design."""
        before, after = self.levels(self.robust.space.nominal), self.levels(design)
        return {
            name: compare_peaks(before[row], after[row], self.frequency, self.order)
            for row, name in enumerate(self.vehicles)
        }

    def peak_table(self, design: RealArray) -> pd.DataFrame:
        """Tabulate today's booming peaks and what becomes of them in one design."""
        rows = []
        for vehicle, changes in self.peak_changes(design).items():
            for change in changes:
                states = [
                    (peak.frequency, peak.rpm, level, peak.prominence)
                    if peak
                    else (np.nan, np.nan, level, np.nan)
                    for peak, level in (
                        (change.before, change.level_before),
                        (change.after, change.level_after),
                    )
                ]
                difference = change.level_after - change.level_before
                rows.append((vehicle, *states[0], *states[1], difference))
        return pd.DataFrame(rows, columns=PEAK_COLUMNS)

    def vehicle_table(self, name: str) -> pd.DataFrame:
        """Tabulate level and σ of each vehicle today and in a pick, and the change of the level."""
        row, n_lines = self.picks[name], self.index.n_lines
        before, after = self.baseline.mean[0] / n_lines, self.values.mean[row] / n_lines
        return pd.DataFrame(
            {
                "vehicle": list(self.vehicles),
                "level before [dB(A)]": before,
                "level after [dB(A)]": after,
                "change [dB]": after - before,
                "sigma before [dB]": self.baseline.sigma[0] / n_lines,
                "sigma after [dB]": self.values.sigma[row] / n_lines,
            }
        )

    def heard(
        self,
        design: RealArray,
        rows: Sequence[int] | None = None,
        width: float = FULL_WIDTH,
        change: RealArray | None = None,
    ) -> Drawing:
        """Draw the levels of all vehicles, or of some rows, today and in one design.

        - `width`: of the figure [inch]; `change`: of each vehicle drawn, as a table beside says it
          [dB].
        """
        shown = list(range(len(self.vehicles)) if rows is None else rows)
        names, changes = [self.vehicles[row] for row in shown], self.peak_changes(design)
        return plot.spl_curves(
            self.frequency,
            self.order,
            self.levels(self.robust.space.nominal)[shown],
            self.levels(design)[shown],
            names,
            [[c.before.frequency for c in changes[name] if c.before] for name in names],
            [[c.after.frequency for c in changes[name] if c.after] for name in names],
            self.colours,
            speed_label=self.speed_label,
            change=change,
            width=width,
        )

    def picture(
        self, beside: Mapping[str, RobustValues] | None = None, width: float = FULL_WIDTH
    ) -> Drawing:
        """Draw the designs that are not dominated when verified, with the picks and today's.

        Parameters
        ----------
        beside : mapping of str to RobustValues, optional
            Further fronts of the same vehicles under the same judge, by their label.
        width : float
            Of the figure [inch].
        """
        values, scale, shown = self.values, self.per_line, self.nondominated
        return plot.pareto_front(
            values.mean_sum[shown] * scale,
            values.sigma_sum[shown] * scale,
            values.standard_error_mean_sum[shown] * scale,
            values.standard_error_sigma_sum[shown] * scale,
            None
            if self.baseline.failed[0]
            else (self.baseline.mean_sum[0] * scale, self.baseline.sigma_sum[0] * scale),
            {
                name: (float(values.mean_sum[row]) * scale, float(values.sigma_sum[row]) * scale)
                for name, row in self.picks.items()
            },
            mean_label="mean level over lines [dB(A)]",
            sigma_label="its σ [dB]",
            beside={
                name: (front.mean_sum * scale, front.sigma_sum * scale)
                for name, front in (beside or {}).items()
            },
            width=width,
        )

    def convergence_picture(self) -> Drawing:
        """Draw the hypervolume over the generations."""
        volume = self.search.hypervolume * self.per_line**2
        panel = plot.CurvePanel("", np.arange(1, volume.size + 1), {"hypervolume": volume})
        return plot.curve_panels(
            [panel], x_label="generation [1]", y_label="hypervolume [dB²]", columns=1
        )

    @property
    def text(self) -> str:
        """How many designs were evaluated and are left, in words."""
        text = (
            f"{self.search.n_evaluated} designs were evaluated, {self.search.n_failed} failed; "
            f"{len(self.search.front)} are on the front, of which tables and figures have "
            f"{len(self.values)}, evenly along it and with all picks. {self.note}"
        )
        share = self.survivors[:, 0]
        if share.any():
            text += (
                f" {np.count_nonzero(share)} of these could not be computed in up to "
                f"{PERCENT * share.max():.1f} % of the draws of the verification: the table gives "
                "that share and the mean of the other draws; they are no picks and not on the "
                "verified front."
            )
        if self.baseline.failed[0]:
            failed, mean = self.judge.sets[0].survivors(self.robust.space.nominal)
            text += (
                f" Today's design could not be computed in {PERCENT * failed:.1f} % of the draws, "
                "so that changes against it have no number; the mean over the other draws, "
                f"vehicles and lines is {mean * self.per_line:.2f} dB(A)."
            )
        return text

    @property
    def counts(self) -> dict[str, Scalar]:
        """Numbers of the search for ``summary.json``."""
        return {
            "n_front": len(self.search.front),
            "n_evaluated": self.search.n_evaluated,
            "n_failed": self.search.n_failed,
            "seconds_search": round(self.search.seconds, 3),
        }


def same_designs(
    prescribed: BoomingModel, other: BoomingModel, space: DesignSpace, n: int = 256
) -> pd.DataFrame:
    """Compare the changes of the mean level by the same designs under two models, by vehicle."""
    designs = sobol_designs(space, n, seed=1)
    both = np.vstack([space.nominal, designs])
    first, second = (index(both)[1:] - index(both)[0] for index in (prescribed, other))
    pairs = list(zip(first.T, second.T, strict=True))
    return pd.DataFrame(
        {
            "vehicle": list(other.response_names),
            "correlation [1]": [float(np.corrcoef(x, y)[0, 1]) for x, y in pairs],
            "slope [1]": [float(np.polyfit(x, y, 1)[0]) for x, y in pairs],
        }
    )
