"""The page on mounts of a compressor that make cars quiet in spite of scatter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT, RealArray
from deboom.compressor.mounted_fleet import MountedFleet, travel_limit
from deboom.errors import listed
from deboom.explore.choices import Pick
from deboom.explore.result import RISEN, Front
from deboom.explore.robust import sigma_shares
from deboom.explore.selection import indifference_intervals
from deboom.explore.sensitivity import SobolIndices
from deboom.pages.compressor_noise import against_hearing
from deboom.pages.front import front_numbers, report_front, report_heard
from deboom.pages.front_answer import (
    VEHICLE_DECIMALS,
    cars_sentences,
    certainty_sentence,
    mean_levels,
    part_table,
    peaks_sentence,
    price_table,
    report_loudest,
    vehicle_table,
    weights_sentence,
)
from deboom.pages.limits import report_limits
from deboom.pages.robust_front import aim_note
from deboom.pages.sensitivity import index_table
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.plot.style import mount_colours, mount_of, signed, vehicle_colours
from deboom.report import Report, Step, Table
from deboom.vehicles.fleet_front import FleetFront
from deboom.vehicles.free_directions import NOTICEABLE

RISE = 1.0
"""Rise of a peak from which the page warns [dB]."""
TRIED = 11
"""Values of each stiffness that are tried for it."""
FURTHER = 1.25
"""Times the allowed travel, which the page offers as a next step [1]."""
COARSE = 5.0
"""Distance of lines between which a booming peak may hide [Hz]: a peak is about as wide."""
MOST_NAMED = 2
"""Stiffnesses in the headline: those that matter most."""
PLACES = "places"
UNEXPECTED = (
    "no expected change, because intervals were judged in cars with a powertrain alone; "
    "docs/validation.md compares the model with exact cars that have a compressor"
)


@dataclass(frozen=True, eq=False, kw_only=True)
class MountFront:
    """The front of a compressor's mounts, with all that its report needs.

    - `sobol`: of the chosen stiffnesses, uniform within their bounds; one output per car.
    - `exact` (v,) or None: what best-mean changes in the exact cars of a virtual bench [dB].
    - `band`: whose lines count [Hz].
    - `identical`: one part number for all mounts.
    - `tolerance`: half width of the scatter of a stiffness [1]; `place_tolerance`: of coordinates
      [mm].
    - `allowed_travel`: under 1 g, over today's [1].
    """

    front: Front
    model: MountedFleet
    sobol: SobolIndices
    exact: RealArray | None
    band: tuple[float, float]
    identical: bool
    tolerance: float
    place_tolerance: float
    allowed_travel: float

    @property
    def index(self) -> Any:
        """The model of the search."""
        return self.front.model

    @cached_property
    def fleet(self) -> FleetFront:
        """Levels and peaks of the first order of the rotor; what nobody hears counts no less."""
        return FleetFront(self.front, order=1.0, audible=True)

    @property
    def best(self) -> RealArray:
        """Best-mean, shape (k,)."""
        return self.front.pick_designs[Pick.best_mean]

    @property
    def chosen(self) -> list[int]:
        """Columns of a design that the search could choose; the others only scatter."""
        return np.flatnonzero(
            self.front.robust.space.upper > self.front.robust.space.lower
        ).tolist()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the chosen variables."""
        return tuple(self.front.variables[column] for column in self.chosen)

    @property
    def shades(self) -> dict[str, str]:
        """Colour of each mount."""
        return mount_colours(list(dict.fromkeys(mount_of(name) for name in self.names)))

    @property
    def importance(self) -> RealArray:
        """Total index of each chosen variable, mean over the cars, shape (n_chosen,) [1]."""
        return self.fleet.mean(self.sobol.total)

    @property
    def leading(self) -> str:
        """Chosen stiffness with the largest mean total index over the cars."""
        return self.names[int(np.argmax(self.importance))]

    @cached_property
    def change(self) -> RealArray:
        """Change of the mean level over lines and scatter by best-mean, shape (v,) [dB]."""
        after = self.front.values.mean[self.front.picks[Pick.best_mean]]
        return np.asarray((after - self.front.baseline.mean[0]) / self.index.n_lines)

    def heard_change(self, design: RealArray) -> RealArray:
        """Change of the mean level of what is heard in each car, over the scatter, (v,) [dB]."""
        before, after = mean_levels(self.fleet, design)
        return after - before

    def stiffness(self, design: RealArray) -> RealArray:
        """Mean |K| that each chosen variable stands for, shape (n_chosen,) [N/mm]."""
        variables = self.model.index.variables
        factors = variables.factors(design[np.newaxis])[0]
        values = factors * self.model.stiffness_at_reference.ravel() * N_PER_MM
        return np.array([values[variables.scaled[column]].mean() for column in self.chosen])

    def travel(self, design: RealArray) -> float:
        """Largest travel of a mount under 1 g over today's [1]."""
        return self.model.statics.travel_ratio(design, self.front.robust.space.nominal)

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Chosen variables that best-mean has at a bound, in words."""
        space = self.front.robust.space
        place = (self.best - space.lower)[self.chosen] / (space.upper - space.lower)[self.chosen]
        words = np.select([place < 0.01, place > 0.99], ["lower", "upper"], "")
        return tuple(f"{n} ({word})" for n, word in zip(self.names, words, strict=True) if word)

    @cached_property
    def indifference(self) -> RealArray:
        """Interval of each chosen variable around best-mean without a noticeable change, (n, 2)."""
        change = NOTICEABLE * self.index.n_lines
        both = np.column_stack(indifference_intervals(self.front.robust, self.best, change, TRIED))
        return np.asarray(both[self.chosen])

    @cached_property
    def groups(self) -> dict[str, list[int]]:
        """Columns that scatter together: a part number's axis, or places."""
        variables = self.model.index.variables
        scaled = variables.scaled
        groups: dict[str, list[int]] = {}
        for column, name in zip(self.chosen, self.names, strict=True):
            pieces = scaled.any(axis=1) & ~(scaled & ~scaled[column]).any(axis=1)
            groups[name] = np.flatnonzero(pieces).tolist()
        if variables.places.size:
            groups[PLACES] = variables.places.tolist()
        return groups


def mount_front_report(view: MountFront, run: str) -> Report:
    """Report which mounts make the cars quiet; `run`: name."""
    low, high = view.band
    report = Report(
        "Mounts of the compressor: quiet cars in spite of scatter",
        "Which stiffness of its mounts makes a compressor quiet in "
        f"{len(view.fleet.vehicles)} electric cars, {low:g} to {high:g} Hz, and keeps them "
        "quiet as parts scatter?",
    )
    report.explain("SPL", "stiffness factor", "dynamic stiffness", "tolerance", "σ")
    report.explain("Pareto front", "sensitivity index", "noise transfer function")
    report.warn(*view.model.alarms, _coarse_lines(view.fleet.frequency))
    report.assume(*view.model.assumed)
    _tell(report, view)
    _answer(report, view, run)
    report.facts["verification_draws"] = view.front.judge.n_samples
    report.facts["mounts"] = view.model.running.shares.statement
    report.facts["mount_state"] = view.model.running.source.state.statement
    report.inputs += view.model.fleet.inputs
    _choice(report, view)
    _cars(report, view)
    _matters(report, view)
    report_limits(report, view.front)
    _trust(report, view)
    search = view.front.search
    report.section(
        "How the search went",
        f"NSGA-II, {search.hypervolume.size} generations, {search.seconds:.1f} s. "
        f"{view.front.text} Every design was evaluated {view.front.robust.sample.n_samples} times "
        f"within its tolerance; the front was verified with {view.front.judge.n_samples} draws "
        f"that the search never saw. {aim_note(view.front.robust)}".strip(),
    )
    report_front(report, view.front)
    return report


def _coarse_lines(frequency: RealArray) -> str:
    """Say that peaks may hide between lines [Hz]; empty where they lie close enough."""
    step = float(np.diff(frequency).max(initial=0.0))
    if step <= COARSE:
        return ""
    return (
        f"Levels are computed every {step:g} Hz: a louder peak may lie between two lines. Take a "
        "smaller --line-step."
    )


def _tell(report: Report, view: MountFront) -> None:
    """Say the numbers of the run, and warn of booming peaks that become louder."""
    changes = [
        (peak.change, peak, car)
        for car, peaks in view.fleet.peak_changes(view.best).items()
        for peak in peaks
        if peak.counts
    ]
    today, new = _todays_and_new_stiffness(view)
    build = (
        f"{view.names[k]} × {new[k] / today[k]:.2f}"
        for k in np.argsort(view.importance)[: -1 - MOST_NAMED : -1]
    )
    heard = view.heard_change(view.best)
    mean_heard = float(view.fleet.mean(heard))
    if np.isfinite(mean_heard):
        report.number(
            "mean_heard_change_db",
            mean_heard,
            "dB",
            "change of the mean level of what is heard by best-mean, mean of the cars",
            headline="+.1f",
        )
    front_numbers(report, view.fleet, ", ".join(build))
    if changes:
        rise, peak, car = max(changes, key=lambda item: item[0])
        louder = len({name for change, _, name in changes if change > RISE})
        if louder:
            report.warn(
                f"Best-mean makes peaks louder: by up to {rise:.1f} dB, at {peak.frequency:.0f} Hz "
                f"({60 * peak.frequency:.0f} rpm) in {car}; {louder} of "
                f"{len(view.fleet.vehicles)} cars have a peak that rises by more than {RISE:g} dB."
            )
    for car, change in zip(view.fleet.vehicles, view.change, strict=True):
        report.number(
            f"level_change_db_{car}",
            float(change),
            "dB",
            "change of the mean level of the car over all lines and the scatter by best-mean",
        )
    for car, change in zip(view.fleet.vehicles, heard, strict=True):
        if np.isfinite(change):
            report.number(
                f"heard_change_db_{car}",
                float(change),
                "dB",
                "change of the mean level of what is heard in the car by best-mean",
            )
    report.number(
        "mean_change_db",
        float(view.fleet.mean(view.change)),
        "dB",
        "change of the mean level over all lines and the scatter by best-mean, mean of the cars",
    )
    report.number(
        "leading_stiffness", view.leading, "", "stiffness that matters most: largest Sobol index"
    )
    report.number(
        "leading_total_index",
        float(view.importance.max()),
        "1",
        "total Sobol index of the stiffness that matters most, mean of the cars",
    )
    report.number(
        "travel_ratio", view.travel(view.best), "1", "travel of best-mean under 1 g over today's"
    )
    report.number("at_bound", ", ".join(view.at_bound), "", "variables of best-mean at their bound")


def _answer(report: Report, view: MountFront, run: str) -> None:
    """Fill the first screen: which mounts, per car, at which price, how it sounds, what next."""
    report.answer(*_answer_in_words(view))
    fleet, best = view.fleet, view.best
    table = vehicle_table(fleet, best, target=fleet.todays_levels)
    report.panel(
        "Each car",
        Table(table.rename(columns={"vehicle": "car"}), "", VEHICLE_DECIMALS),
        "First order at the driver's ear, mean of what is heard. "
        f"{cars_sentences(fleet, table, 'the level of today')}",
        wide=True,
    )
    report.panel(
        "Mounts to change",
        _mounts_to_change(view),
        f"Tolerance ±{PERCENT * view.tolerance:.0f} %, places ±{view.place_tolerance:g} mm. The "
        "variance is that of the level as stiffness varies within the bounds of the search.",
        wide=True,
    )
    designs = np.stack([view.front.robust.space.nominal, best])
    modes, travel = view.model.statics.modes(designs), view.model.statics(designs)[:, 0]
    limit = travel_limit(view.model, view.front.robust.space, view.allowed_travel)
    price = price_table(
        ["travel under 1 g [mm]", "lowest mode [Hz]", "highest mode [Hz]"],
        today=[travel[0], modes[0, 0], modes[0, -1]],
        after=[travel[1], modes[1, 0], modes[1, -1]],
        allowed=[f"≤ {limit.at_most:.2f}", "–", "–"],
        decimals=2,
    )
    report.panel("What it costs", price)
    report_loudest(
        report, fleet, best, view.index.pressure, "first order", "compressor speed [rpm]"
    )
    report.panel(
        "What to do next",
        Step("deboom run compressor_front --cars FOLDER", "the same with measured cars"),
        Step("deboom run compressor_front --peak-rise 1", "no booming peak louder by more"),
        Step("deboom run compressor_front --reach 0.6", "let stiffness go further"),
        Step(
            f"deboom run compressor_front --travel {FURTHER * view.allowed_travel:.2g}",
            f"let mounts travel further than {view.allowed_travel:.2g} times today's travel",
        ),
        Step(f"deboom report {run} --supplier", "the sheet for the maker of the mounts"),
        wide=True,
    )


def _todays_and_new_stiffness(view: MountFront) -> tuple[RealArray, RealArray]:
    """Return the stiffness of each variable today and of the chosen design [N/mm]."""
    return view.stiffness(view.front.robust.space.nominal), view.stiffness(view.best)


def _answer_in_words(view: MountFront) -> tuple[str, ...]:
    """Return which stiffness changes by how much, who hears it, how sure, and how levels count."""
    fleet, best = view.fleet, view.best
    today, build = _todays_and_new_stiffness(view)
    moves = listed(
        tuple(
            f"{name} to {share:.2f}" for name, share in zip(view.names, build / today, strict=True)
        )
    )
    levels = fleet.levels(fleet.today)
    row, column = np.unravel_index(int(levels.argmax()), levels.shape)
    level, line = float(levels[row, column]), float(fleet.frequency[column])
    change = float(fleet.mean(view.heard_change(best)))
    return (
        f"Change {moves} of today's stiffness: {signed(change, 1)} dB on average of what is heard, "
        f"in the model; {peaks_sentence(fleet.peak_changes(best))}.",
        f"Today's loudest line has {level:.0f} dB(A), at {line:.0f} Hz in {fleet.vehicles[row]}, "
        f"{against_hearing(level, line)}. The new one has {fleet.levels(best).max():.0f} dB(A).",
        f"{_louder_peak(view)}{certainty_sentence(UNEXPECTED)}",
        "What not to trust: small changes. In the model mounts keep their gain over frequency for "
        "every stiffness, and do not soften with amplitude.",
        "A line that nobody hears counts as the threshold of hearing (ISO 226) in averages, and "
        "may rise in the picture; peaks keep their own level. Stiffness: |K| at "
        f"{view.model.reference_line:g} Hz. {weights_sentence(fleet)}Pressures: "
        f"{', '.join(view.index.case_names)}.",
    )


def _louder_peak(view: MountFront) -> str:
    """Say which design has no louder peak, if the chosen one has."""
    if Pick.none_louder not in view.front.picks:
        return (
            "Every design of the front makes some peak louder than today; the option --peak-rise "
            "forbids that. "
        )
    if float(view.fleet.peak_rise(view.best[np.newaxis])[0]) <= RISEN:
        return ""
    design = view.front.pick_designs[Pick.none_louder]
    change = float(view.fleet.mean(view.heard_change(design)))
    return (
        f"Without a louder peak the quietest design brings {signed(change, 1)} dB (none-louder). "
    )


def _mounts_to_change(view: MountFront) -> Table:
    """Tabulate each stiffness today and as chosen, what it brings alone, and its share."""
    best, nominal = view.best, view.front.robust.space.nominal
    today, build = _todays_and_new_stiffness(view)
    alone = np.where(np.eye(len(best), dtype=bool)[view.chosen], best, nominal)
    gains = view.fleet.mean(view.fleet.mean_levels(alone) - view.fleet.todays_levels)
    variance = "share of the variance [%]"
    table = part_table(
        view.names,
        share=build / today,
        today=today,
        alone=gains,
        decimals=1,
        beside={variance: PERCENT * view.importance},
    )
    return replace(table, decimals={**table.decimals, variance: 0})


def _choice(report: Report, view: MountFront) -> None:
    """Show the front, the named designs and their stiffness."""
    what = (
        "One part number for all mounts: an axial and a radial stiffness; pieces scatter on their "
        "own, and batch by batch together."
        if view.identical
        else "Every mount has an axial and a radial stiffness of its own."
    )
    reached = view.travel(view.best) > 0.98 * view.allowed_travel
    report.number(
        "travel_limit_reached",
        str(reached).lower(),
        "",
        "whether best-mean travels as far as is allowed",
    )
    report.section(
        "What to choose",
        f"{what} Mounts are placed within ± {view.place_tolerance:g} mm of where they are "
        "drawn.\n\nSofter mounts nearly always isolate better. The limit is the travel under 1 g: "
        f"no mount may move further than {view.allowed_travel:g} times today's."
        + (
            " Best-mean uses all of that: the limit, not the noise, decides."
            if reached
            else f" Best-mean uses {view.travel(view.best):.2f} times."
        )
        + (
            f" It is at the bound of the search in {', '.join(view.at_bound)}: --reach lets it go "
            "further."
            if view.at_bound
            else ""
        ),
    )
    report.figure(
        "pareto_front",
        view.front.picture,
        "Mean level of all lines, heard or not, against its scatter: the search minimised both. "
        "Each point is a design that none beats in both."
        if view.front.robust.n_objectives == 2
        else "Each pair of objectives; each point is a design that none beats in all of them.",
    )
    line, space, chosen = view.model.reference_line, view.front.robust.space, view.chosen
    report.figure(
        "stiffness_bars",
        lambda: plot.stiffness_bars(
            view.names,
            view.best[chosen],
            space.lower[chosen],
            space.upper[chosen],
            view.stiffness(space.nominal),
            [False] * len(chosen),
            view.indifference,
            view.shades,
            stiffness_label=f"|K| at {line:g} Hz [N/mm]",
        ),
        "Best-mean: stiffness factors within their bounds. The thin bars are ranges within which "
        f"the mean level stays within {NOTICEABLE} dB.",
    )
    picks = _picks(view)
    report.table(
        "picks",
        picks,
        "Named designs, verified; the change is that of what is heard. Travel and modes use the "
        f"stiffness at {view.index.frequency[0]:g} Hz, which is higher than the static stiffness: "
        "use them for comparison, not for a drawing.",
        shown=picks.drop(columns=["mean level [dB(A)]", "change [dB]"]),
    )
    caption = f"Dynamic stiffness |K| at {line:g} Hz, mean over the mounts and axes of a variable."
    report.table("stiffness", _stiffness(view), caption)


def _picks(view: MountFront) -> pd.DataFrame:
    """List the named designs with their levels, travel and modes."""
    rows = {name: (view.front.values, row) for name, row in view.front.picks.items()}
    picks = view.front.compared({"today's": (view.front.baseline, 0), **rows})
    designs = np.stack(list(view.front.named_designs.values()))
    heard = [float(view.fleet.mean(view.heard_change(design))) for design in designs]
    picks.insert(1, "change of what is heard [dB]", heard)
    modes = view.model.statics.modes(designs)
    picks["travel under 1 g [mm]"] = view.model.statics(designs)[:, 0]
    picks["lowest mode [Hz]"], picks["highest mode [Hz]"] = modes[:, 0], modes[:, -1]
    return picks


def _stiffness(view: MountFront) -> pd.DataFrame:
    """List the stiffness of each named design, and the range around best-mean."""
    nominal = view.stiffness(view.front.robust.space.nominal)
    table: dict[str, object] = {"stiffness": list(view.names)}
    for name, design in view.front.named_designs.items():
        table[f"{name} [N/mm]"] = view.stiffness(design)
    for end, bound in zip(("from", "to"), view.indifference.T, strict=True):
        table[f"{Pick.best_mean} {end} [N/mm]"] = nominal * bound
    return pd.DataFrame(table)


def _cars(report: Report, view: MountFront) -> None:
    """Show levels and peaks of every car."""
    report.section(
        "What it does in every car",
        "First order of the compressor at the driver's ear. Curves and peaks are those of the "
        "first pressure without scatter. Mean changes are those of the first table: of what is "
        "heard, over all pressures and the scatter.",
    )
    report_heard(
        report,
        view.fleet,
        view.best,
        vehicle_colours(view.fleet.vehicles),
        "Today and best-mean.",
        speed_label="rotor speed [rpm]",
        change=view.heard_change(view.best),
    )
    cars = view.fleet.vehicle_table(Pick.best_mean)
    report.table("cars", cars.rename(columns={"change [dB]": "change of all lines [dB]"}))
    peaks = view.fleet.peak_table(view.best)
    louder = peaks[peaks["change [dB]"] > RISE]
    caption = (
        f"Peaks of at least 6 dB prominence that rise by more than {RISE:g} dB; peaks.csv has all."
    )
    columns = [name for name in peaks if "prominence" not in str(name)]
    report.table("peaks", peaks, "" if louder.empty else caption, shown=louder[columns])


def _matters(report: Report, view: MountFront) -> None:
    """Show which stiffness is worth a supplier's effort."""
    report.section(
        "What matters to whoever makes the mounts",
        "Importance is the share of the variance of the level that comes from a stiffness, alone "
        "and together with others, when all vary within the bounds of the search (mean over the "
        f"cars). Most of all matters {view.leading}. deboom report RUN --supplier writes the sheet "
        "that the supplier quotes and signs, in English or German, with names or without.",
    )
    report.table("sobol", index_table(view.sobol, "stiffness"))
    caption = (
        "Required stiffness. Importance: share of the variance of the level within the range "
        "searched. Share of sigma: of the scatter between cars as built."
    )
    report.table("requirements", _requirements(view), caption)


def _requirements(view: MountFront) -> pd.DataFrame:
    """One row per chosen stiffness, and the places: what is wanted, and what tolerances cost."""
    today, wanted = view.stiffness(view.front.robust.space.nominal), view.stiffness(view.best)
    shares = sigma_shares(view.front.judge.sets[0], view.best).of_sum
    table = pd.DataFrame(
        {
            "requirement": list(view.names),
            "today [N/mm]": today,
            "wanted [N/mm]": wanted,
            "wanted / today [1]": wanted / today,
            "tolerance ± [%]": PERCENT * view.tolerance,
            "at least [N/mm]": wanted * (1 - view.tolerance),
            "at most [N/mm]": wanted * (1 + view.tolerance),
            "importance [1]": view.importance,
        }
    )
    table = table.set_index("requirement").reindex(list(view.groups)).reset_index()
    table["share of sigma [%]"] = [
        PERCENT * float(shares[columns].sum()) for columns in view.groups.values()
    ]
    return table


def _trust(report: Report, view: MountFront) -> None:
    """Say what the model leaves out."""
    running = view.model.running
    hoses = "Hoses are left out: theirs is a path of its own, which mounts do not change."
    if view.model.running.hoses is not None:
        hoses = "Hoses are in as identified beams."
    report.section(
        "How far to trust it",
        f"{running.shares.statement}\n\n{running.source.state.statement}\n\n"
        f"{hoses} Holders move as the free bodies do.",
    )
    if view.exact is not None:
        mean, predicted = (
            float(view.fleet.mean(change))
            for change in (view.exact, view.fleet.splv_change(view.best))
        )
        report.number(
            "exact_mean_change_db",
            mean,
            "dB",
            "change of the mean level by best-mean in the exact virtual cars, without scatter",
        )
        report.text(
            f"Without scatter best-mean changes the mean level by {signed(mean, 2)} dB in the "
            f"exact cars of the virtual bench, and by {signed(predicted, 2)} dB in the model."
        )
