"""Which parts of the mount catalogue make the U06 vehicles quiet, and keep them so?

One characterised part per mount is chosen from a library, and may be re-tuned a little per axis:
NSGA-II over part numbers (whole, without order) and stiffness factors, for the sum over the
vehicles of the mean SPLV, 20 to 60 Hz, and of its standard deviation over the tolerance. Where
there are not too many, every set of parts as they are is evaluated for comparison.

What it showed, with seed 1 and five further parts of each mount, which differ by 5 % (one sigma)
per axis: parts as they are give 0.2 dB per line, re-tuned within 5 % they give 0.9 dB. Built into
the virtual car, sets change as predicted (r 0.999; 0.95 had the motion been prescribed).

Keys of summary.json: part_<mount> (of best-mean); change_db_per_line (best-mean against today's
parts, verified, mean over vehicles and lines) and change_parts_as_they_are_db_per_line (quietest
set without re-tuning); sigma_change_percent_best_sigma; n_sets, n_set_front (sets, and those on
their front); n_front, n_evaluated (designs); sigma_bias_percent (search minus verification);
seconds_search; surface_difference_at_peaks_db (library against spectra).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from typer import Option

from deboom import plot
from deboom.arrays import RealArray
from deboom.common import N_PER_MM
from deboom.errors import InputError
from deboom.explore.front import pareto_front
from deboom.explore.robust import Robust, RobustValues, joined
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import VERIFIED
from deboom.explore.workers import workers_for
from deboom.mounts.surface_forces import Outside
from deboom.pages.front import report_front
from deboom.pages.front_answer import abbreviations, peaks_sentence, short_title
from deboom.pages.motion import motion_report, report_runs
from deboom.plot.style import signed
from deboom.report import Report, Step, Table
from deboom.runs.catalogue import (
    Catalogue,
    catalogue_index,
    ordered_stiffness,
    platform_catalogue,
)
from deboom.runs.options import Seed
from deboom.runs.platform_options import PlatformOptions
from deboom.runs.progress import progress_bar
from deboom.runs.result import RunContext, run_name
from deboom.runs.search import SearchOptions
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.fleet_front import FleetFront
from deboom.vehicles.platform import MountSource, Runs

HEARD = 1.0
"""Difference of two levels from which one drive is told from another, about [dB].

H. Fastl, E. Zwicker, Psychoacoustics: facts and models, 3rd ed. 2007, ch. 7: 1 dB for tones of low
level, less for loud ones side by side.
"""
BATCH = 100
"""Sets evaluated between two steps of the progress bar."""


@dataclass(frozen=True)
class Options:
    """Which parts are chosen from, for whom, and for how long is searched."""

    seed: Seed = 1
    search: SearchOptions = SearchOptions()
    samples: Annotated[int, Option(help="Tolerance draws per design; a power of two.")] = 128
    tolerance: Annotated[float, Option(help="Half width of the scatter, 3 sigma [1].")] = 0.15
    retuning: Annotated[float, Option(help="Parts may change by ± this; 0: as they are.")] = 0.05
    catalogue: Annotated[Path | None, Option(help="Library: exported JSON or database.")] = None
    mount: Annotated[list[str] | None, Option(help="Mount that may change; repeatable.")] = None
    every_set_up_to: Annotated[int, Option(help="Evaluate all sets if no more.")] = 5000
    platform: PlatformOptions = PlatformOptions(mounts=MountSource.library_inside)
    motion: Annotated[Motion, Option(help="Motion of the powertrain.")] = Motion.coupled

    def __post_init__(self) -> None:
        if self.platform.mounts is MountSource.spectra:
            raise InputError(
                "parts of a catalogue are known by their surfaces alone: take --mounts library or "
                "--mounts library-inside"
            )


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles with every set of parts, and the parts."""

    runs: Runs
    catalogue: Catalogue
    robust: Robust


def prepare(options: Options) -> Model:
    """Read platform and catalogue, and build the model of all parts."""
    runs = options.platform.runs()
    catalogue = platform_catalogue(runs.platform, options.catalogue, options.mount)
    index = catalogue_index(runs, catalogue, options.motion, _outside(options))
    space = catalogue.space(index.variable_names, options.retuning, options.tolerance)
    sample = sobol_sample(space.n_variables, options.samples, seed=options.seed)
    return Model(runs, catalogue, Robust(index, space, sample))


def _outside(options: Options) -> Outside:
    """Return what becomes of lines that a part was not measured for."""
    inside = options.platform.mounts is MountSource.library_inside
    return Outside.KEEP_MEASURED if inside else Outside.REFUSE


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Search, enumerate, verify and report."""
    runs, catalogue, robust = model.runs, model.catalogue, model.robust
    sets = None
    if catalogue.n_sets <= options.every_set_up_to:
        sets = every_set(model, options)
    files = (*runs.platform.input_files, *catalogue.inputs)
    front = options.search.front(
        robust,
        seed=options.seed,
        run=context,
        inputs=files,
        verified_with=VERIFIED,
        title="mount selection",
    )
    outside = _outside(options)
    search, heard = front.search, FleetFront(front)
    n_mounts = len(catalogue.parts)

    named = {"today's parts": (front.baseline, 0)}
    best_set: RealArray | None = None
    if sets is not None:
        set_front = pareto_front(sets)
        best_set = set_front.designs[0]
        named["quietest parts as they are"] = (front.judge.sets[0](set_front.designs[:1]), 0)
    named |= {name: (front.values, row) for name, row in front.picks.items()}
    picks = front.compared(named)
    designs = np.stack([values.designs[row] for values, row in named.values()])
    for place, (column, parts) in enumerate(catalogue.columns(designs).items()):
        picks.insert(1 + place, column, parts)
    change = dict(zip(picks["design"], picks["change [dB]"], strict=True))
    sigma = dict(zip(picks["design"], picks["change of sigma [%]"], strict=True))
    best = front.values.designs[front.picks["best-mean"]]

    half = float(robust.space.tolerance.max())
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
        "A direction that a part's characterisation could not identify keeps the force of today's "
        "part, and so does a line outside of the region that the part was measured in.",
        *motion_report(level, np.ones((1, len(level.variable_names)))).warnings,
    )
    parts_of_best = catalogue.labels(best[:n_mounts])
    for mount, part in zip(catalogue.parts, parts_of_best, strict=True):
        report.summary[f"part_{mount}"] = part
    report.summary["change_db_per_line"] = float(change["best-mean"])
    report.summary["sigma_change_percent_best_sigma"] = float(sigma["best-sigma"])
    if sets is not None:
        as_they_are = float(change["quietest parts as they are"])
        quietest = ", ".join(catalogue.labels(set_front.designs[0, :n_mounts]))
        report.tile(f"{signed(as_they_are, 2)} dB", f"mean level, parts as they are: {quietest}")
        report.summary["change_parts_as_they_are_db_per_line"] = as_they_are
        report.summary["n_set_front"] = len(set_front)
    retuned = f" re-tuned within ±{100 * options.retuning:.0f} %" if options.retuning else ""
    parts_named = f"mean level, parts{retuned}: {', '.join(parts_of_best)}"
    report.tile(f"{signed(change['best-mean'], 2)} dB", parts_named)
    report.summary |= {
        "n_sets": catalogue.n_sets,
        "n_front": len(search.front),
        "n_evaluated": search.n_evaluated,
        "sigma_bias_percent": front.sigma_bias_percent,
        "seconds_search": round(search.seconds, 3),
    }
    report.facts["kernel"] = level.kernel
    report.inputs += files

    effects = {f"parts{retuned}": (best, float(change["best-mean"]))}
    if best_set is not None:
        effects = {"parts as they are": (best_set, as_they_are)} | effects
    words = [
        f"{what} {signed(value, 1)} dB{', which nobody hears' if abs(value) < HEARD else ''}"
        for what, (_, value) in effects.items()
    ]
    worth = min(value for _, value in effects.values())
    advice = "Order nothing new" if worth > -HEARD else f"Order {', '.join(parts_of_best)}"
    report.answer(
        f"{advice}: at the best the catalogue's {'; '.join(words)}.",
        f"Mean level at the driver's ear of {len(front.responses)} vehicles, verified with "
        f"{front.judge.n_samples} draws that the search never saw; a difference below about "
        f"{HEARD:g} dB is not heard from drive to drive. Best-mean: {peaks_sentence(heard, best)}.",
        abbreviations(runs.platform.mounts),
    )
    gains = {f"{what} [dB]": heard.splv_change(design) for what, (design, _) in effects.items()}
    loud = {"today [dB(A)]": heard.todays_levels}
    each = pd.DataFrame({"vehicle": list(front.responses), **loud, **gains})
    report.panel(
        "Each vehicle",
        Table(each, "", dict.fromkeys((*loud, *gains), 1)),
        "Mean level with today's parts, and its change, without scatter.",
    )
    variables = [name for mount in runs.platform.mounts for name in mount.variables]
    now = np.concatenate([np.zeros(n_mounts), np.ones(len(variables))])
    today = N_PER_MM * ordered_stiffness(runs, catalogue, now, outside)
    built = {
        what: N_PER_MM * ordered_stiffness(runs, catalogue, design, outside)
        for what, (design, _) in effects.items()
    }
    order: dict[str, object] = {"direction": variables}
    order |= {f"{what}, of today's [1]": stiffness / today for what, stiffness in built.items()}
    order["today [N/mm]"] = today
    order |= {f"{what} [N/mm]": stiffness for what, stiffness in built.items()}
    is_measured = np.isfinite(np.asarray(order["today [N/mm]"], dtype=float))
    order["re-tuned to [1]"] = np.where(is_measured, best[n_mounts:], np.nan)
    frame = pd.DataFrame(order)
    decimals = {str(name): 0 if str(name).endswith("[N/mm]") else 2 for name in frame.columns[1:]}
    first, last = runs.band
    report.panel(
        "What to order" if worth <= -HEARD else "The best of the catalogue",
        Table(
            pd.DataFrame(
                {
                    "mount": [
                        f"{mount.name}, {short_title(mount)}" if short_title(mount) else mount.name
                        for mount in runs.platform.mounts
                    ],
                    **{
                        what: catalogue.labels(design[:n_mounts])
                        for what, (design, _) in effects.items()
                    },
                }
            ),
            "",
        ),
        Table(frame, "", decimals),
        f"N/mm are the mean |K| in operation, {runs.cases[0][0].title}, {first:g}–{last:g} Hz, "
        "and so are shares of today's. A dash: not identified, today's part stays.",
        wide=True,
    )
    run_of = run_name(context, "mount_selection")
    report.panel(
        "What to do next",
        Step("deboom run mount_selection --catalogue FILE", "choose from other parts"),
        Step("deboom run u06_robust_front", "what a part of no catalogue would bring"),
        Step(f"deboom show {run_of}", "all numbers of this run"),
    )

    counts = ", ".join(
        f"{count} of {mount}"
        for mount, count in zip(catalogue.parts, catalogue.n_parts, strict=True)
    )
    tuned = "Parts are taken as they are."
    if options.retuning:
        tuned = f"Each part may be re-tuned within ±{100 * options.retuning:.0f} % per axis."
    report.section("What was chosen from", f"Parts to choose from: {counts}. {tuned}")
    report.table("order", frame)
    report.table(
        "picks",
        picks,
        "Today's and the named designs, per vehicle and line, evaluated with "
        f"{front.judge.n_samples} independent draws.",
        {"mean level [dB(A)]": 2, "change [dB]": 2, "sigma of the level [dB]": 3},
    )
    vehicles: dict[str, object] = {"vehicle": list(front.responses)}
    if best_set is not None:
        vehicles["change, quietest parts as they are [dB]"] = heard.splv_change(best_set)
    vehicles["change, best-mean [dB]"] = heard.splv_change(best)
    report.table("vehicles", pd.DataFrame(vehicles), "Change of the mean level without scatter.")

    report.section("The front", front.text)
    curves = {"front of the search": _objectives(search.front, front.per_line)}
    points = {}
    if sets is not None:
        points["every set of parts as they are"] = _objectives(sets, front.per_line)
        curves["front of these sets"] = _objectives(set_front, front.per_line)
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
    report.facts["verification_draws"] = VERIFIED
    report_front(report, front, beside=catalogue.columns(search.front.designs))
    if sets is not None:
        on_front = {tuple(row) for row in set_front.designs.tolist()}
        table = {
            **catalogue.columns(sets.designs),
            "SPLV mean sum [dB(A)]": sets.mean_sum,
            "SPLV sigma sum [dB]": sets.sigma_sum,
            "on the front": [tuple(row) in on_front for row in sets.designs.tolist()],
        }
        report.table("part_sets", pd.DataFrame(table))

    report_runs(report, runs)
    return report


def _objectives(values: RobustValues, per_line: float) -> tuple[RealArray, RealArray]:
    """Return mean level [dB(A)] and its σ [dB], over vehicles and lines, shape (n,) each."""
    return values.mean_sum * per_line, values.sigma_sum * per_line


def every_set(model: Model, options: Options) -> RobustValues:
    """Evaluate every set of parts as they are, in the draws of the search."""
    catalogue, search = model.catalogue, options.search
    sets = catalogue.all_sets()
    factors = np.tile(model.robust.space.nominal[sets.shape[1] :], (len(sets), 1))
    designs = np.hstack([sets, factors])
    parts = []
    with (
        workers_for(model.robust, search.workers, search.scheduler) as spread,
        progress_bar("sets of parts") as progress,
    ):
        for start in range(0, len(designs), BATCH):
            parts.append(spread(designs[start : start + BATCH]))
            progress(min(start + BATCH, len(designs)), len(designs), "")
    values = joined(parts)
    if values.failed.any():
        raise InputError(f"the parts {catalogue.labels(sets[values.failed][0])} cannot be computed")
    return values
