"""The report of a robust front of mount stiffnesses: what to build, and where it comes from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import RealArray
from deboom.choices import Pick
from deboom.common import N_PER_MM, PERCENT, listed
from deboom.errors import InputError
from deboom.explore.front import VERIFICATION, unbeaten
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM
from deboom.explore.result import Front
from deboom.explore.robust import Robust, RobustValues, chosen
from deboom.measurement.channels import LoadCase
from deboom.pages.front import heard, report_front
from deboom.pages.front_pictures import heard_by_the_driver, pictures_behind
from deboom.pages.motion import MotionReport, factor_name, motion_name, motion_report
from deboom.plot.style import mount_colours, signed, vehicle_colours
from deboom.report import Report
from deboom.vehicles.booming_model import BoomingModel, Motion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet_front import FleetFront, same_designs
from deboom.vehicles.free_directions import NOTICEABLE, DirectionFreedom, free_directions
from deboom.vehicles.limits import mount_price
from deboom.vehicles.platform import Platform, Runs

TELLING = 0.9
"""Share of the change that the parts named on top bring alone, at least [1]."""
AT_THE_EDGE = 0.005
"""Distance from a bound of the search at which a factor lies there [1]."""
FURTHER = 0.1
"""How much further than the search a factor at its edge is tried [1]."""
BESIDE_WIDTH = 3.6
"""Width of figures that share a row [inch]."""
TERMS = (
    "booming noise",
    "SPL",
    "SPLV",
    "booming peak",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "σ",
    "Pareto front",
    "no requirement",
    "no noticeable difference",
    "noise transfer function",
    "prescribed motion",
)


@dataclass(frozen=True, eq=False, kw_only=True)
class PlatformFront:
    """The front of a platform's mount stiffnesses, and what its report needs beside it.

    Levels are those of the first load case; objectives are those of all.

    Parameters
    ----------
    front : Front
        The front, verified.
    runs : Runs
        Platform, vehicles and load cases of the search.
    every : BoomingModel or None
        The same model in all load cases of the platform; None where they do not allow it.
    prescribed : Front or None
        The same search with prescribed motion.
    """

    front: Front
    runs: Runs
    every: BoomingModel | None = None
    prescribed: Front | None = None

    @property
    def platform(self) -> Platform:
        """With the forces of the search, measured or from response surfaces."""
        return self.runs.platform

    @property
    def load_case(self) -> LoadCase:
        """The load case whose levels are shown."""
        return self.platform.load_case(self.index.load_case_names[0])

    @property
    def stiffness_variables(self) -> tuple[str, ...]:
        """Variables that are stiffness factors; loss factors come after them."""
        return tuple(name for mount in self.platform.mounts for name in mount.variables)

    @cached_property
    def motion_report(self) -> MotionReport:
        """What there is to say about motion and stiffness factors, checked at the picks."""
        return motion_report(self.index, np.stack(list(self.front.named_designs.values())))

    @property
    def index(self) -> BoomingModel:
        """The model of the search."""
        model = self.front.model
        assert isinstance(model, BoomingModel)
        return model

    @cached_property
    def fleet(self) -> FleetFront:
        """Levels and booming peaks of the load case that is shown."""
        return FleetFront(self.front, self.load_case.order)

    @property
    def colours(self) -> dict[str, str]:
        """Colour of each vehicle, the same on every page of the platform."""
        return vehicle_colours(self.platform.fleet.names)

    @property
    def worst_vehicle(self) -> int:
        """Row of the vehicle that best-mean helps least."""
        return self.fleet.worst_vehicle(self.front.pick_designs[Pick.best_mean])

    @cached_property
    def nominal_stiffness(self) -> RealArray:
        """Mean |K| in the band at factor 1, of `stiffness_variables` [N/mm]; nan: not measured."""
        band = (float(self.fleet.frequency[0]), float(self.fleet.frequency[-1]))
        return self.runs.stiffness(self.load_case, band) * N_PER_MM

    @property
    def stiffness_state(self) -> str:
        """State that `nominal_stiffness` holds at, in words."""
        first, last = self.fleet.frequency[[0, -1]]
        return (
            f"the mean |K| in operation, {self.load_case.title}, {first:g}–{last:g} Hz; the "
            "supplier's sheet has the same factors at the state of its test"
        )

    @cached_property
    def freedom(self) -> DirectionFreedom:
        """How far each variable may leave best-mean before a vehicle changes noticeably."""
        return free_directions(
            self.index,
            self.front.pick_designs[Pick.best_mean],
            self.front.robust.space,
            without_effect=self.front.without_effect,
        )

    @cached_property
    def telling(self) -> list[int]:
        """Variables that bring `TELLING` of best-mean's change alone, the strongest first."""
        today, best = self.front.robust.space.nominal, self.front.pick_designs[Pick.best_mean]
        alone = np.where(np.eye(len(best), dtype=bool), best, today)
        order = np.argsort(
            [self.fleet.splv_change(design).mean() for design in alone], kind="stable"
        )
        whole = self.fleet.splv_change(best).mean()
        columns = [int(column) for column in order]
        for count in range(1, len(columns)):
            if self.only(columns[:count]) <= TELLING * whole:
                return columns[:count]
        return columns

    def only(self, columns: list[int]) -> float:
        """Mean change of the level if only some variables go to best-mean [dB]."""
        design = self.front.robust.space.nominal.copy()
        design[columns] = self.front.pick_designs[Pick.best_mean][columns]
        return float(self.fleet.splv_change(design).mean())

    def edges(self, design: RealArray) -> list[int]:
        """Variables with an effect whose factor lies at a bound of the search."""
        space = self.front.robust.space
        at = (design <= space.lower + AT_THE_EDGE) | (design >= space.upper - AT_THE_EDGE)
        free = np.isin(self.front.variables, self.front.without_effect)
        return [int(column) for column in np.flatnonzero(at & ~free)]

    @property
    def beyond(self) -> float:
        """What the telling variables at an edge bring, moved on by `FURTHER` [dB]."""
        space, best = self.front.robust.space, self.front.pick_designs[Pick.best_mean]
        moved = best.copy()
        for column in set(self.edges(best)) & set(self.telling):
            moved[column] += FURTHER if best[column] > space.nominal[column] else -FURTHER
        return float((self.fleet.splv_change(moved) - self.fleet.splv_change(best)).mean())

    @cached_property
    def as_softer_rubber(self) -> float:
        """Mean change by best-mean if its factors mean the rubber alone [dB]; nan: not known."""
        if factor_name(self.index) == Factor.part.value or self.index.loss_factors:
            return float("nan")
        try:
            part = self.runs.model(Motion.coupled, Factor.part)
            both = part(
                np.stack([self.front.robust.space.nominal, self.front.pick_designs[Pick.best_mean]])
            )
        except InputError:
            return float("nan")
        return float((both[1] - both[0]).mean() / self.index.n_lines)

    @cached_property
    def price(self) -> pd.DataFrame | str:
        """Sag, travel and modes of today's design and the picks, or why they are not known."""
        designs = {
            name: x[: len(self.stiffness_variables)] for name, x in self.front.named_designs.items()
        }
        try:
            requirements = mount_price(self.runs, self.index.factor)
            numbers = requirements(np.stack(list(designs.values())))
        except InputError as error:
            return str(error)
        labels = [f"{name} [{q.unit}]" for q in requirements.quantities for name in q.names]
        return pd.DataFrame({"number": labels, **dict(zip(designs, numbers, strict=True))})

    @cached_property
    def by_load_case(self) -> pd.DataFrame:
        """Change of the mean level by each pick in each load case and vehicle, no scatter [dB]."""
        if self.every is None:
            return pd.DataFrame()
        designs, rows = np.stack(list(self.front.named_designs.values())), []
        for name in self.every.load_case_names:
            level = self.every.levels(designs, name).mean(axis=2)
            for vehicle, changes in zip(self.fleet.vehicles, (level[1:] - level[0]).T, strict=True):
                rows.append(
                    {"load case": name, "vehicle": vehicle}
                    | dict(zip((f"{pick} [dB]" for pick in self.front.picks), changes, strict=True))
                )
        return pd.DataFrame(rows)

    @cached_property
    def judged_prescribed(self) -> dict[str, RobustValues]:
        """The front of prescribed motion as this model judges it, by its label."""
        if self.prescribed is None:
            return {}
        values = self.front.judge(self.prescribed.values.designs)
        rows = np.flatnonzero(unbeaten(values))
        rows = rows[np.argsort(values.mean_sum[rows], kind="stable")]
        return {"found with prescribed motion": chosen(values, rows)}


def front_report(view: PlatformFront) -> Report:
    """Report a robust front, for a reader who builds mounts."""
    first, last = view.fleet.frequency[0], view.fleet.frequency[-1]
    half = PERCENT * view.front.robust.space.tolerance.max()
    report = Report(
        f"What to build: {view.platform.title}",
        f"Which stiffnesses make {listed(view.fleet.vehicles)} quiet between {first:g} and "
        f"{last:g} Hz, and keep them quiet when parts scatter within ±{half:.0f} %?",
    )
    motion = view.motion_report
    report.explain(*(motion.terms.get(term, term) for term in TERMS))
    report.warn(*motion.warnings, view.front.robust.sample.warning)
    picks, best = _picks(view), view.front.pick_designs[Pick.best_mean]
    changes = view.fleet.splv_change(best)
    report.summary["n_front"] = view.front.counts["n_front"]
    for vehicle, splv in zip(view.fleet.vehicles, changes, strict=True):
        report.summary[f"splv_change_db_per_line_{vehicle}"] = float(splv)
    sigma = dict(zip(picks["design"], picks["change of sigma [%]"], strict=True))
    mean = dict(zip(picks["design"], picks["change [dB]"], strict=True))
    for name in view.front.picks:
        key = name.replace("-", "_")
        report.summary[f"mean_change_db_{key}"] = float(mean[name])
        report.summary[f"sigma_change_percent_{key}"] = float(sigma[name])
    report.summary["sigma_bias_percent"] = view.front.sigma_bias_percent
    report.summary["mean_bias_db_per_line"] = view.front.mean_bias * view.front.per_line
    report.summary |= motion.summary | view.front.counts
    report.facts |= {
        "motion": motion_name(view.index),
        "design_factor": factor_name(view.index),
        "kernel": view.index.kernel,
        "objectives": "; ".join(objective.name for objective in view.front.robust.objectives),
        "estimator": view.front.robust.estimator.kind,
        "tolerance_sample": view.front.robust.sample.kind,
        "tolerance_draws": view.front.robust.sample.n_samples,
        "verification_draws": view.front.judge.n_samples,
        "verification_scrambles": len(VERIFICATION),
    }
    report.inputs += view.platform.input_files

    _answer(report, view, picks)
    _choices(report, view, picks)
    heard_by_the_driver(report, view)
    _supplier(report, view)
    pictures_behind(report, view)
    _search(report, view)
    return report


def _answer(report: Report, view: PlatformFront, picks: pd.DataFrame) -> None:
    """Say what to build, what it brings, what it costs, and where the search ended."""
    best, space = view.front.pick_designs[Pick.best_mean], view.front.robust.space
    row = picks[picks["design"] == Pick.best_mean]
    mean, sigma = row[["change [dB]", "change of sigma [%]"]].to_numpy(float)[0]
    peaks = [
        (c.level_after - c.level_before, c.frequency, name)
        for name, changes in view.fleet.peak_changes(best).items()
        for c in changes
        if c.before
    ]
    at_peaks = f"{signed(min(peaks)[0], 1)} to {signed(max(peaks)[0], 1)} dB" if peaks else ""
    words = []
    for column in view.telling:
        nominal = view.nominal_stiffness[column] if column < len(view.nominal_stiffness) else np.nan
        factor = f"{best[column]:.2f} of today's"
        value, label = factor, "factor"
        if np.isfinite(nominal):
            value, label = (
                f"{best[column] * nominal:.0f} N/mm",
                f"mean |K|; today {nominal:.0f}, {factor}",
            )
        words.append(
            f"{view.front.variables[column]} {value} ({label.removesuffix(f', {factor}')})"
        )
        edge = ", at the edge of the search" if column in view.edges(best) else ""
        report.tile(f"{view.front.variables[column]} {value}", label + edge)
    report.tile(f"{signed(mean, 1)} dB", "at the driver's ear, mean of vehicles and lines")
    if peaks:
        report.tile(at_peaks.replace(" to ", " … "), "at the booming peaks")
    spread = "unchanged" if abs(sigma) < 1.0 else f"{signed(sigma, 0)} %"
    report.tile(f"σ {spread}", "scatter over the tolerance")

    these = "this one alone brings" if len(words) == 1 else f"these {len(words)} alone bring"
    sentences = [
        f"{', '.join(words)}: {signed(mean, 2)} dB at the driver's ear on average"
        + (f", {at_peaks} at the booming peaks" if peaks else "")
        + f", σ {spread}; {these} {signed(view.only(view.telling), 2)} dB."
    ]
    at_edge = [view.front.variables[c] for c in view.telling if c in view.edges(best)]
    if at_edge:
        verb = "lies" if len(at_edge) == 1 else "lie"
        sentences.append(
            f"{listed(tuple(at_edge))} {verb} at the edge of the search ({space.lower.min():g} to "
            f"{space.upper.max():g}); another {PERCENT * FURTHER:.0f} % would bring "
            f"a further {signed(view.beyond, 2)} dB (--bounds)."
        )
    sentences.append(f"N/mm are {view.stiffness_state}.")
    louder = [peak for peak in peaks if peak[0] > NOTICEABLE]
    if louder:
        change, frequency, vehicle = max(louder)
        sentences.append(
            f"{len(louder)} of {len(peaks)} booming peaks become louder, most of all {vehicle} at "
            f"{frequency:g} Hz, by {change:.1f} dB."
        )
    rubber = view.as_softer_rubber
    brings = "." if np.isnan(rubber) else f": here {signed(rubber, 1)} dB."
    if factor_name(view.index) != Factor.part.value:
        sentences.append(
            "A factor scales the whole curve of stiffness over preload, with the stops re-tuned; "
            f"softer rubber in the same shape rides deeper into its stops and brings less{brings}"
        )
    report.section("What to build", " ".join(sentences))
    report.figure(
        "pareto_front",
        lambda: view.front.picture(view.judged_prescribed, BESIDE_WIDTH),
        "Both objectives of the front, with today's mounts and the picks; down and left is "
        "better. Bars: one standard error over independent scrambles of the draws.",
    )
    worst = view.worst_vehicle
    report.figure(
        "worst_vehicle",
        lambda: heard(view.fleet, best, view.colours, rows=[worst], width=BESIDE_WIDTH),
        f"The vehicle that gains least, {view.fleet.vehicles[worst]}: SPL at the driver's ear with "
        "today's mounts (dashed) and with best-mean.",
    )
    if isinstance(view.price, str):
        report.text(f"The price in sag, travel and modes is not known: {view.price}.")
    else:
        shown = view.price[["number", "today's", Pick.best_mean]]
        sag = view.price["number"].str.contains("sag").any()
        report.table(
            "price",
            view.price,
            "The price: sag under the weight, travel at full torque and rigid-body modes."
            if sag
            else "The price: rigid-body modes. Without static curves (a mount library) sag and "
            "travel are not known.",
            {"today's": 1, "best-mean": 1},
            shown=shown,
        )


def _picks(view: PlatformFront) -> pd.DataFrame:
    """Tabulate today's design and the picks, verified."""
    rows = {name: (view.front.values, row) for name, row in view.front.picks.items()}
    return view.front.compared({"baseline": (view.front.baseline, 0), **rows})


def _choices(report: Report, view: PlatformFront, picks: pd.DataFrame) -> None:
    """Show the picks, under both motions, and in all load cases."""
    names = list(
        dict.fromkeys(
            " = ".join(name for name, other in view.front.picks.items() if other == row)
            for row in view.front.picks.values()
        )
    )
    missing = (
        ""
        if Pick.sigma_kept in view.front.picks
        else (
            " No design found keeps σ and every vehicle at today's and is quieter: today's stays."
        )
    )
    report.section(
        "The picks",
        "Best-mean: least mean level. None-louder: the same among designs in which no vehicle is "
        "louder than today. Sigma-kept: the same with no more scatter than today. Best-sigma: "
        f"least scatter. Here: {'; '.join(names)}.{missing}",
    )
    report.table(
        "picks",
        picks,
        f"Per vehicle and line, verified with {len(VERIFICATION)} scrambles of "
        f"{view.front.judge.n_samples} draws that the search never saw.",
        {"mean level [dB(A)]": 2, "sigma of the level [dB]": 3},
    )
    if view.prescribed is not None:
        _motions(report, view, view.prescribed)
    cases = view.by_load_case
    if len(cases):
        column = f"{Pick.best_mean} [dB]"
        worst = cases.iloc[int(cases[column].argmax())]
        by_case = cases.drop(columns="vehicle").groupby("load case", sort=False).mean()
        report.table(
            "load_cases",
            cases,
            "Change of the mean level in all load cases, mean over the vehicles. Best-mean does "
            f"least in {worst['load case']}, {worst['vehicle']}: {signed(worst[column], 1)} dB.",
            shown=by_case.reset_index(),
        )
        report.summary["worst_load_case"] = str(worst["load case"])
        report.summary["worst_load_case_change_db"] = float(worst[column])
    report_front(report, view.front)
    values, n_lines = view.front.values, view.index.n_lines
    points, vehicles = np.meshgrid(
        np.arange(1, len(values) + 1), view.fleet.vehicles, indexing="ij"
    )
    per_vehicle = {
        "point": points.ravel(),
        "vehicle": vehicles.ravel(),
        "SPLV mean [dB(A)]": values.mean.ravel(),
        "SPLV sigma [dB]": values.sigma.ravel(),
        "mean level of the lines [dB(A)]": values.mean.ravel() / n_lines,
        "sigma of that level [dB]": values.sigma.ravel() / n_lines,
    }
    report.table("per_vehicle", pd.DataFrame(per_vehicle))


def _motions(report: Report, view: PlatformFront, prescribed: Front) -> None:
    """Show the picks of both motions under both, and why they differ."""
    mine = motion_name(view.index)
    motions = {mine: view.front, "prescribed": prescribed}
    tables = []
    for found, searched in motions.items():
        designs = np.stack(list(searched.pick_designs.values()))
        table: dict[str, object] = {"pick": list(searched.picks), "found with": found}
        for judge, other in motions.items():
            values, today = other.judge(designs), other.baseline
            change = (values.mean_sum - today.mean_sum[0]) * view.front.per_line
            table[f"{judge} [dB]"] = change
            table[f"σ, {judge} [%]"] = PERCENT * (values.sigma_sum / today.sigma_sum[0] - 1.0)
        tables.append(pd.DataFrame(table))
    whole = pd.concat(tables, ignore_index=True)
    best = whole[whole["pick"] == Pick.best_mean][[f"{judge} [dB]" for judge in motions]]
    (own, _), (real, promised) = best.to_numpy(float)
    same = same_designs(prescribed.model, view.index, view.front.robust.space)
    report.text(
        f"The powertrain answers here ({mine} motion); with prescribed motion it stays as "
        f"measured. Prescribed motion promises {signed(promised, 2)} dB for its best-mean, {mine} "
        f"motion gives it {signed(real, 2)} dB and finds {signed(own, 2)} dB itself. Prescribed "
        f"motion ranks the same designs alike (correlation from "
        f"{same['correlation [1]'].min():.3f}) and sees "
        f"1/{same['slope [1]'].min():.2f} to 1/{same['slope [1]'].max():.2f} of what they do: "
        "a softer mount also moves more or less, which it leaves out."
    )
    report.table(
        "motions",
        whole,
        "Change of mean level and of σ by the picks of both motions, as each sees it.",
    )
    report.table("same_designs", same)
    report.summary |= {
        "benefit_db": -own,
        "benefit_prescribed_db": -real,
        "promised_prescribed_db": -promised,
        "r_min": float(same["correlation [1]"].min()),
        "slope_min": float(same["slope [1]"].min()),
        "slope_max": float(same["slope [1]"].max()),
        "seconds_both_searches": round(view.front.search.seconds + prescribed.search.seconds, 3),
    }


def _supplier(report: Report, view: PlatformFront) -> None:
    """Show the stiffnesses of the picks, and what is left open."""
    nominal, variables = view.nominal_stiffness, view.stiffness_variables
    n = len(variables)
    space, freedom = view.front.robust.space, view.freedom
    interval = freedom.interval[:n]
    free = np.isin(variables, view.front.without_effect)
    first, last = view.fleet.frequency[0], view.fleet.frequency[-1]
    report.section(
        "What the supplier should build",
        "The stiffnesses of best-mean within their bounds, and beside them those of the "
        f"other picks. N/mm are {view.stiffness_state}.",
    )
    report.figure(
        "stiffness_bars",
        partial(
            plot.stiffness_bars,
            variables,
            view.front.pick_designs[Pick.best_mean][:n],
            space.lower[:n],
            space.upper[:n],
            nominal,
            free.tolist(),
            interval,
            mount_colours([mount.name for mount in view.platform.mounts]),
            stiffness_label=f"mean |K|, {first:g}–{last:g} Hz [N/mm]",
        ),
        "Chosen stiffness of every mount and axis. The thin bracket spans the "
        f"range within which, {freedom.sentence}.",
    )
    table: dict[str, object] = {"variable": list(variables), "nominal [N/mm]": nominal}
    for name, design in view.front.pick_designs.items():
        table[f"{name} factor [1]"] = design[:n]
        table[f"{name} [N/mm]"] = nominal * design[:n]
    for column, end in (("from", 0), ("to", 1)):
        table[f"best-mean {column} [N/mm]"] = np.where(free, np.nan, nominal * interval[:, end])
    table["requirement"] = [need.value for need in freedom.needs[:n]]
    moved = freedom.move[:n].argmax(axis=1)
    table["largest change in its range [dB]"] = np.where(free, 0.0, freedom.move[:n].max(axis=1))
    table["changed most"] = np.where(free, "–", np.array(freedom.vehicles)[moved])
    stiffness = pd.DataFrame(table)
    columns = [
        "variable",
        "nominal [N/mm]",
        "best-mean [N/mm]",
        "best-mean from [N/mm]",
        "best-mean to [N/mm]",
        *(f"{name} [N/mm]" for name in view.front.picks if name != Pick.best_mean),
        "requirement",
        "largest change in its range [dB]",
        "changed most",
    ]
    report.table(
        "stiffness",
        stiffness,
        "Stiffnesses of the named designs. From and to: the range around best-mean "
        f"within which, {freedom.sentence}, scatter of the parts included; any in bounds: that "
        "holds for the whole range; as today: today's part lies in it.",
        {column: 0 for column in columns if column.endswith("[N/mm]")},
        shown=stiffness[columns],
    )
    if len(view.front.variables) > n:
        names, interval = view.front.variables[n:], freedom.interval[n:]
        free = np.isin(names, view.front.without_effect)
        losses: dict[str, object] = {"variable": list(names)}
        losses |= {f"{name} factor [1]": x[n:] for name, x in view.front.pick_designs.items()}
        for column, end in (("from", 0), ("to", 1)):
            losses[f"best-mean {column} [1]"] = np.where(free, np.nan, interval[:, end])
        report.table(
            "loss_factors",
            pd.DataFrame(losses),
            "Factors on the loss factor K''/K' at unchanged K'; a dash: no requirement.",
        )


def _search(report: Report, view: PlatformFront) -> None:
    """Say what was asked, with which data, and how the search went."""
    space, sampler, case = view.front.robust.space, view.front.robust.sample, view.load_case
    motion, search, lines = view.motion_report, view.front.search, view.fleet.frequency
    cases = ", ".join(
        f"{view.platform.load_case(part.load_case).title} (weight {weight:.3g})"
        for part, weight in zip(view.index.cases, view.index.weights, strict=True)
    )
    factors = "stiffness factors"
    if len(view.front.variables) > len(view.stiffness_variables):
        factors = "factors of stiffness (K' and K'' alike) and of loss (K'' alone, exactly made)"
    report.section(
        "What was asked, and how it was searched",
        f"{view.platform.title}: {view.platform.description}\n\n"
        f"Vehicles: {listed(view.fleet.vehicles)}. Load cases: {cases}. Lines: "
        f"{lines.size} between {lines[0]:g} and {lines[-1]:g} Hz, engine order "
        f"{case.order:g}. Motion: {motion_name(view.index)}; meaning of a stiffness "
        f"factor: {motion.summary['design_factor']}.\n\n"
        f"Design variables: {len(view.front.variables)} {factors}, each between "
        f"{space.lower.min():g} and {space.upper.max():g}. "
        f"Manufacturing scatter: ±{PERCENT * space.tolerance.max():.0f} % of the design's own "
        f"stiffness as three standard deviations, {sampler.n_samples} draws ({sampler.kind}). "
        "Two objectives, both as small as possible: the sum over the vehicles of the mean "
        "SPLV, and the sum of its standard deviation σ; shown divided by the number of vehicles "
        "and lines.\n\n"
        f"{search.algorithm}, {search.hypervolume.size} generations, {search.seconds:.1f} s. "
        f"{view.front.text} The search had its σ wrong by "
        f"{signed(view.front.sigma_bias_percent, 2)} % and its mean by "
        f"{signed(view.front.mean_bias * view.front.per_line, 3)} dB on average.\n\n"
        "\n\n".join((motion.text, aim_note(view.front.robust))).strip(),
        folded=True,
    )
    report.figure(
        "convergence",
        view.front.convergence_picture,
        "Hypervolume of the front over the generations, before gradients; flat means that more "
        "generations would not have helped.",
    )


def aim_note(robust: Robust) -> str:
    """Say what a report must say about objectives that are not the two sums; empty otherwise."""
    if robust.objectives == (MEAN_SUM, SIGMA_SUM):
        return ""
    first, second = (objective.name for objective in robust.objectives)
    return (
        f"The search minimised {first}, and {second}; picks are those of these objectives. Tables "
        "and figures show mean and sigma, in which the front is not a front."
    )
