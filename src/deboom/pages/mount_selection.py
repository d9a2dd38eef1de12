"""The page on parts that are chosen from a catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT, ComplexArray, RealArray
from deboom.explore.choices import Pick
from deboom.explore.result import Front
from deboom.explore.robust import RobustValues
from deboom.explore.search import VERIFIED
from deboom.files.uncertain_index import expected_of_sets
from deboom.mounts.mount import Mount
from deboom.mounts.surface_forces import Outside
from deboom.pages.front import front_numbers, report_front
from deboom.pages.front_answer import (
    IN_TARGET,
    abbreviations,
    certainty_sentence,
    expected_column,
    expected_on_average,
    model_sentence,
    peaks_sentence,
    report_expected,
    report_expected_numbers,
    report_loudest,
    short_title,
    weights_sentence,
)
from deboom.pages.motion import motion_report, report_runs
from deboom.pages.robust_front import aim_note
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.report import Report, Step, Table
from deboom.vehicles.booming_model import CatalogueModel
from deboom.vehicles.catalogue import Catalogue, ordered_stiffness
from deboom.vehicles.expected_change import ExpectedChange, expected_or_why
from deboom.vehicles.fleet_front import FleetFront
from deboom.vehicles.platform import Runs

HEARD = 1.0
"""Difference of two levels from which one drive is told from another, about [dB].

H. Fastl, E. Zwicker, Psychoacoustics: facts and models, 3rd ed. 2007, ch. 7: 1 dB for tones of low
level, less for loud ones side by side.
"""
QUIETEST = "quietest parts as they are"


@dataclass(frozen=True, eq=False)
class Effect:
    """What a design does: its change of the mean level in the model [dB], and what is expected."""

    design: RealArray
    change: float
    expected: ExpectedChange | str

    @property
    def heard(self) -> float:
        """The mean change that is promised: the expected one, else the model's [dB]."""
        return self.change if isinstance(self.expected, str) else float(self.expected.mean.expected)


@dataclass(frozen=True, eq=False)
class Selection:
    """The front of parts and re-tuning, and every set of parts as they are, if not too many.

    - `runs`, `catalogue`: platform, and the parts that may stand at its mounts.
    - `outside`: what becomes of lines that a part was not measured for.
    - `retuning`: how far the stiffness of a part may be changed, ± [1].
    - `sets`, `set_front`: every set of parts as they are, and those on their front.
    - `picks`: today's and the named designs, with their parts.
    """

    runs: Runs
    catalogue: Catalogue
    outside: Outside
    retuning: float
    front: Front
    heard: FleetFront
    sets: RobustValues | None
    set_front: RobustValues | None
    picks: pd.DataFrame

    @property
    def retuned(self) -> str:
        """How far parts may be re-tuned, in words that follow “parts”."""
        return f" re-tuned within ±{100 * self.retuning:.0f} %" if self.retuning else ""

    @cached_property
    def expected(self) -> ExpectedChange | str:
        """What is expected of the designs of `picks` without today's; or why nothing is."""
        model: Any = self.front.model
        named = list(self.front.pick_designs.values())
        quietest = [] if self.set_front is None else [self.set_front.designs[0]]
        return expected_or_why(
            model,
            lambda: expected_of_sets(
                model,
                self.runs,
                self.catalogue,
                self.outside,
                np.stack([*quietest, *named]),
                weights=self.front.robust.weights,
                seed=self.front.search.seed,
            ),
        )

    def expected_of(self, design: str) -> ExpectedChange | str:
        """Return what is expected of a named design of `picks`; or why nothing is."""
        if isinstance(self.expected, str):
            return self.expected
        return self.expected.of(list(self.picks["design"][1:]).index(design))

    @property
    def best(self) -> RealArray:
        """The best-mean design: part numbers, then stiffness factors."""
        return np.asarray(self.front.values.designs[self.front.picks[Pick.best_mean]])

    @property
    def change(self) -> dict[str, float]:
        """Change of the mean level against today's parts by design [dB]."""
        return dict(zip(self.picks["design"], self.picks["change [dB]"], strict=True))

    @property
    def effects(self) -> dict[str, Effect]:
        """What parts as they are do, if known, and re-tuned ones."""
        retuned = {f"parts{self.retuned}": self._effect(Pick.best_mean, self.best)}
        if self.set_front is None:
            return retuned
        quietest = self.set_front.designs[0]
        return {"parts as they are": self._effect(QUIETEST, quietest)} | retuned

    def _effect(self, name: str, design: RealArray) -> Effect:
        return Effect(design, float(self.change[name]), self.expected_of(name))

    @property
    def is_heard(self) -> bool:
        """Whether the better of the effects is heard."""
        return min(effect.heard for effect in self.effects.values()) <= -HEARD

    def pressure(self, designs: RealArray) -> ComplexArray:
        """Return the pressure of designs (n, k) at the ears, (n, v, f) [Pa]."""
        n, model = len(self.catalogue.parts), cast("CatalogueModel", self.front.model)
        sets = [(np.rint(row[:n]).astype(int).tolist(), row[np.newaxis, n:]) for row in designs]
        of_sets = [model.of_parts(numbers).pressure(factors) for numbers, factors in sets]
        return np.concatenate(of_sets)[:, self.heard.ears]

    def parts(self, design: RealArray) -> Sequence[str]:
        """Return the name of each mount's part."""
        return self.catalogue.labels(design[: len(self.catalogue.parts)])

    def stiffness(self, design: RealArray) -> RealArray:
        """Return |K| of each direction in operation [N/mm]; nan where it was not identified."""
        return N_PER_MM * ordered_stiffness(self.runs, self.catalogue, design, self.outside)


def mount_selection_report(chosen: Selection, run: str) -> Report:
    """Report which parts to order; `run`: name."""
    front, catalogue = chosen.front, chosen.catalogue
    half = float(front.robust.space.tolerance.max())
    report = Report(
        "Mounts from the catalogue",
        f"Which parts of the catalogue make {', '.join(front.responses)} quiet, and keep them "
        f"quiet when stiffnesses scatter within ±{100 * half:.0f} %?",
    )
    report.explain(
        "booming noise",
        "SPLV",
        "dynamic stiffness",
        "tolerance",
        "σ",
        "Pareto front",
    )
    index: Any = front.model
    level = index.models[0]
    report.warn(
        "A direction that the characterisation of a part could not identify keeps the force of "
        "today's part. So does a line outside the measured region of the part.",
        *motion_report(level, np.ones((1, len(level.variable_names)))).warnings,
    )
    _numbers(report, chosen)
    report.facts["kernel"] = level.kernel
    report.inputs += [*chosen.runs.platform.input_files, *catalogue.inputs]
    report.answer(*_answer_in_words(chosen))
    _panels(report, chosen, run)
    _parts_section(report, chosen)
    _front_section(report, chosen)
    report.facts["verification_draws"] = VERIFIED
    designs = list(chosen.picks["design"][1:])
    report_expected(report, chosen.expected, designs, front.responses)
    report_front(report, front, beside=catalogue.columns(front.search.front.designs))
    if chosen.sets is not None and chosen.set_front is not None:
        report.table("part_sets", _set_table(catalogue, chosen.sets, chosen.set_front))
    report_runs(report, chosen.runs)
    return report


def _numbers(report: Report, chosen: Selection) -> None:
    """Say which parts to order, and what they bring."""
    catalogue, front = chosen.catalogue, chosen.front
    parts = chosen.parts(chosen.best)
    expected = chosen.expected_of(Pick.best_mean)
    report.number(
        "change_db_per_line",
        float(chosen.change[Pick.best_mean]),
        "dB",
        "change of the mean level by best-mean in the model, mean of the vehicles and lines",
        headline="+.2f" if isinstance(expected, str) else "",
    )
    report_expected_numbers(report, expected, front.responses)
    front_numbers(report, chosen.heard, ", ".join(parts))
    for mount, part in zip(catalogue.parts, parts, strict=True):
        report.number(f"part_{mount}", part, "", "part of best-mean at the mount")
    report.number("n_sets", catalogue.n_sets, "", "sets of parts of the catalogue")
    if chosen.set_front is not None:
        report.number(
            "change_parts_as_they_are_db_per_line",
            float(chosen.change[QUIETEST]),
            "dB",
            "change of the mean level by the quietest set without re-tuning, in the model",
        )
        report.number("n_set_front", len(chosen.set_front), "", "sets on the front of all sets")


def _answer_in_words(chosen: Selection) -> tuple[str, ...]:
    """Return what to order, how sure that is, how it was verified, and the names of the mounts."""
    front, expected = chosen.front, chosen.expected_of(Pick.best_mean)
    order = f"Order {', '.join(chosen.parts(chosen.best))}"
    advice = order if chosen.is_heard else "Order nothing new"
    # without re-tuning the search ends where the list of all sets does
    stated = list(chosen.effects.items())[: None if chosen.retuned else 1]
    words = [
        f"{what} bring {expected_on_average(effect.expected, effect.change)}"
        f"{', which nobody hears' if abs(effect.heard) < HEARD else ''}"
        for what, effect in stated
    ]
    return (
        f"{advice}: at best the {'; '.join(words)}.",
        certainty_sentence(expected),
        model_sentence(expected, float(chosen.change[Pick.best_mean])),
        f"Mean level at the driver's ear of {len(front.responses)} vehicles, verified with "
        f"{chosen.heard.n_cars} cars of each that the search has not seen. From drive to drive "
        f"nobody hears a difference below about {HEARD:g} dB. Best-mean in the model: "
        f"{peaks_sentence(chosen.heard.peak_changes(chosen.best))}.",
        weights_sentence(chosen.heard) + abbreviations(chosen.runs.platform.mounts),
    )


def _panels(report: Report, chosen: Selection, name_of_run: str) -> None:
    """Show each vehicle, what to order and what to do next."""
    runs, heard, effects = chosen.runs, chosen.heard, chosen.effects
    names = list(chosen.front.responses)
    loud = {"today [dB(A)]": heard.todays_levels}
    promised: dict[str, object] = {}
    gains = {}
    for what, effect in effects.items():
        promised |= expected_column(effect.expected, range(len(names)), f"{what}, ")
        gains[f"{what}, in the model [dB]"] = heard.splv_change(effect.design)
    share = PERCENT * heard.cars(chosen.best).share_within(heard.todays_levels)
    each = pd.DataFrame({"vehicle": names, **promised, **loud, **gains, IN_TARGET: share})
    report.panel(
        "Each vehicle",
        Table(each, "", dict.fromkeys((*loud, *gains), 1)),
        "Mean level with today's parts, and its change, without scatter; the first sentence is "
        f"with scatter. Target: the level of today, by {heard.n_cars} cars of each with "
        f"parts{chosen.retuned} as made.",
        wide=True,
    )
    parts = {"mount": [_titled(mount) for mount in runs.platform.mounts]}
    parts |= {what: list(chosen.parts(effect.design)) for what, effect in effects.items()}
    order = _order_table(chosen)
    decimals = {str(name): 0 if str(name).endswith("[N/mm]") else 2 for name in order.columns[1:]}
    first, last = runs.band
    report.panel(
        "What to order" if chosen.is_heard else "The best of the catalogue",
        Table(pd.DataFrame(parts), ""),
        Table(order, "", decimals),
        f"N/mm are the mean |K| in operation, {runs.cases[0][0].title}, {first:g}–{last:g} Hz, "
        "and so are shares of today's. A dash: not identified, today's part stays.",
        wide=True,
    )
    report_loudest(report, heard, chosen.best, chosen.pressure, runs.cases[0][0].title)
    report.panel(
        "What to do next",
        Step("deboom run mount_selection --catalogue FILE", "choose from other parts"),
        Step("deboom run front", "the effect of a part that is in no catalogue"),
        Step(f"deboom show {name_of_run}", "all numbers of this run"),
    )


def _titled(mount: Mount) -> str:
    """Return the name of a mount, with its title if it has one."""
    return f"{mount.name}, {short_title(mount)}" if short_title(mount) else mount.name


def _order_table(chosen: Selection) -> pd.DataFrame:
    """Tabulate the stiffness of each direction today and as chosen, and its re-tuning."""
    variables = [name for mount in chosen.runs.platform.mounts for name in mount.variables]
    n_mounts = len(chosen.catalogue.parts)
    today = chosen.stiffness(np.concatenate([np.zeros(n_mounts), np.ones(len(variables))]))
    built = {what: chosen.stiffness(each.design) for what, each in chosen.effects.items()}
    order: dict[str, object] = {"direction": variables}
    order |= {f"{what}, of today's [1]": stiffness / today for what, stiffness in built.items()}
    order["today [N/mm]"] = today
    order |= {f"{what} [N/mm]": stiffness for what, stiffness in built.items()}
    order["re-tuned to [1]"] = np.where(np.isfinite(today), chosen.best[n_mounts:], np.nan)
    return pd.DataFrame(order)


def _parts_section(report: Report, chosen: Selection) -> None:
    """Say what was chosen from, and list the order, the picks and the change of each vehicle."""
    catalogue, front, heard = chosen.catalogue, chosen.front, chosen.heard
    counts = ", ".join(
        f"{count} of {mount}"
        for mount, count in zip(catalogue.parts, catalogue.n_parts, strict=True)
    )
    tuned = "Parts are taken as they are."
    if chosen.retuning:
        tuned = f"Each part may be re-tuned within ±{100 * chosen.retuning:.0f} % per axis."
    report.section("What was chosen from", f"Parts to choose from: {counts}. {tuned}")
    report.table("order", _order_table(chosen))
    report.table(
        "picks",
        chosen.picks,
        "Today's and the named designs, per vehicle and line, evaluated with "
        f"{front.judge.n_samples} independent draws.",
        {"mean level [dB(A)]": 2, "change [dB]": 2, "sigma of the level [dB]": 3},
    )
    vehicles: dict[str, object] = {"vehicle": list(front.responses)}
    if chosen.set_front is not None:
        quietest = chosen.set_front.designs[0]
        vehicles["change, quietest parts as they are [dB]"] = heard.splv_change(quietest)
    vehicles["change, best-mean [dB]"] = heard.splv_change(chosen.best)
    report.table("vehicles", pd.DataFrame(vehicles), "Change of the mean level without scatter.")


def _front_section(report: Report, chosen: Selection) -> None:
    """Draw the front of the search beside every set of parts as they are."""
    front, robust = chosen.front, chosen.front.robust
    report.section("The front", f"{front.text} {aim_note(robust)}".strip())
    curves = {"front of the search": _objectives(front.search.front, front.per_line)}
    points = {}
    if chosen.sets is not None and chosen.set_front is not None:
        points["every set of parts as they are"] = _objectives(chosen.sets, front.per_line)
        curves["front of these sets"] = _objectives(chosen.set_front, front.per_line)
    mean, deviation = _objectives(robust(robust.space.nominal[np.newaxis, :]), front.per_line)
    report.figure(
        "fronts",
        lambda: plot.fronts(
            curves,
            points,
            {"today's parts": (float(mean[0]), float(deviation[0]))},
            mean_label="mean level over vehicles and lines [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
        "Both objectives, in the draws of the search.",
    )


def _set_table(catalogue: Catalogue, sets: RobustValues, set_front: RobustValues) -> pd.DataFrame:
    """Tabulate every set of parts as they are, and whether it is on their front."""
    on_front = {tuple(row) for row in set_front.designs.tolist()}
    return pd.DataFrame(
        {
            **catalogue.columns(sets.designs),
            "SPLV mean sum [dB(A)]": sets.mean_sum,
            "SPLV sigma sum [dB]": sets.sigma_sum,
            "on the front": [tuple(row) in on_front for row in sets.designs.tolist()],
        }
    )


def _objectives(values: RobustValues, per_line: float) -> tuple[RealArray, RealArray]:
    """Return mean level [dB(A)] and its σ [dB], over vehicles and lines, shape (n,) each."""
    return values.mean_sum * per_line, values.sigma_sum * per_line
