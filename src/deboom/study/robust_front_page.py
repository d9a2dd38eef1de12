"""Figures and page of a robust front, for a reader who builds mounts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.report import figures
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import mount_colours, signed, vehicle_colours
from deboom.study.aims import aim_note
from deboom.study.robust_front import ENERGY_BAND, NOTICEABLE, RobustFront

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
    "knee",
    "no requirement",
    "no noticeable difference",
    "noise transfer function",
    "prescribed motion",
)

PEAK_COLUMNS = (
    "vehicle",
    "frequency before [Hz]",
    "speed before [rpm]",
    "SPL before [dB(A)]",
    "prominence before [dB]",
    "frequency after [Hz]",
    "SPL after [dB(A)]",
    "change [dB]",
)
STIFFNESS_COLUMNS = (
    "variable",
    "nominal [N/mm]",
    "best mean [N/mm]",
    "best mean from [N/mm]",
    "best mean to [N/mm]",
    "best sigma [N/mm]",
    "knee [N/mm]",
    "requirement",
)


def front_figures(study: RobustFront) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    values, scale = study.verification.values, study.per_line
    design = study.pick_designs["best mean"]
    nominal = study.robust.space.nominal
    all_vehicles = vehicle_colours(study.platform.fleet.names)
    peaks = study.peak_changes(design)
    row, n_lines = study.picks["best mean"], study.index.n_lines
    n_stiffness = len(study.stiffness_variables)
    low, high = (f"{edge:g}" for edge in ENERGY_BAND)
    first, last = study.frequency[0], study.frequency[-1]
    return {
        "pareto_front": figures.pareto_front(
            values.mean_sum * scale,
            values.sigma_sum * scale,
            values.standard_error_mean_sum * scale,
            values.standard_error_sigma_sum * scale,
            (float(study.baseline.mean_sum[0]) * scale, float(study.baseline.sigma_sum[0]) * scale),
            {
                name: (float(values.mean_sum[at]) * scale, float(values.sigma_sum[at]) * scale)
                for name, at in study.picks.items()
            },
            mean_label="mean level over vehicles and lines [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
        "spl_curves": figures.spl_curves(
            study.frequency,
            study.load_case.order,
            study.shown_levels(nominal),
            study.shown_levels(design),
            study.vehicles,
            [[c.before.frequency for c in peaks[v] if c.before] for v in study.vehicles],
            [[c.after.frequency for c in peaks[v] if c.after] for v in study.vehicles],
            all_vehicles,
        ),
        "stiffness_bars": figures.stiffness_bars(
            study.stiffness_variables,
            design[:n_stiffness],
            study.robust.space.lower[:n_stiffness],
            study.robust.space.upper[:n_stiffness],
            study.nominal_stiffness,
            [name in study.without_effect for name in study.stiffness_variables],
            study.indifference[:n_stiffness],
            mount_colours([mount.name for mount in study.platform.mounts]),
            stiffness_label=f"mean |K|, {first:g}–{last:g} Hz [N/mm]",
        ),
        "per_vehicle_change": figures.per_vehicle_change(
            study.vehicles,
            study.splv_change(design),
            values.sigma[row] / n_lines,
            study.energy_change(design),
            study.energy_sigma(design),
            all_vehicles,
            level_label="change of the mean level [dB]",
            energy_label=f"change of energy {low}–{high} Hz [dB]",
        ),
        "convergence": figures.convergence(
            np.arange(1, study.search.hypervolume.size + 1),
            study.search.hypervolume * scale**2,
            hypervolume_label="hypervolume [dB²]",
        ),
    }


def front_page(
    study: RobustFront, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    """Compose the page from the study's tables and figures."""
    check, search = study.verification, study.search
    changes = study.splv_change(study.pick_designs["best mean"])
    peaks = tables["peaks"]["change [dB]"]
    sigma_drop = tables["picks"]["change of sigma [%]"].min()
    motion = study.motion_report
    first, last = study.frequency[0], study.frequency[-1]
    sampler = study.robust.sample
    half = study.robust.space.tolerance.max()
    cases = ", ".join(
        f"{study.platform.load_case(case.load_case).title} (weight {weight:.3g})"
        for case, weight in zip(study.index.contributions, study.index.weights, strict=True)
    )
    return Page(
        title="Robust mount stiffnesses",
        question=(
            f"Which stiffnesses make {_listed(study.vehicles)} quiet between {first:g} and "
            f"{last:g} Hz, and keep them quiet when parts scatter within ±{100 * half:.0f} %?"
        ),
        headlines=(
            Headline(
                f"{signed(float(changes.min()), 1)} … {signed(float(changes.max()), 1)} dB",
                "mean level per vehicle, best mean",
            ),
            Headline(f"{signed(float(peaks.min()), 1)} dB", "largest fall of a booming peak"),
            Headline(f"{signed(float(sigma_drop), 0)} %", "scatter σ, best sigma"),
            Headline(
                f"{signed(check.sigma_bias_percent, 1)} %",
                "bias of the search's σ, verified",
            ),
        ),
        terms=tuple(motion.terms.get(term, term) for term in TERMS),
        warnings=tuple(filter(None, (*motion.warnings, sampler.warning))),
        sections=(
            Section(
                "What was asked, and with which data",
                f"{study.platform.title}: {study.platform.description}\n\n"
                f"Vehicles: {_listed(study.vehicles)}. Load cases: {cases}. Lines: "
                f"{study.index.n_lines} between {first:g} and {last:g} Hz, engine order "
                f"{study.load_case.order:g}.\n\n"
                f"Design variables: {len(study.variables)} {_factors(study)}, each between "
                f"{study.robust.space.lower.min():g} and {study.robust.space.upper.max():g}. "
                f"Manufacturing scatter: ±{100 * half:.0f} % of the design's own stiffness as "
                f"three standard deviations, {sampler.n_samples} draws ({sampler.kind}).\n\n"
                "Two objectives, both as small as possible: the sum over the vehicles of the mean "
                "SPLV, and the sum of its standard deviation σ. The figures show both divided by "
                "the number of vehicles and lines, so that they read as dB of one line.",
            ),
            Section(
                "The front",
                f"{search.n_evaluated} designs were evaluated, {search.n_failed} failed; "
                f"{len(search.front)} are on the front. All points shown were evaluated again with "
                f"{check.n_samples} independent draws: the search had its σ wrong by "
                f"{signed(check.sigma_bias_percent, 2)} % and its mean by "
                f"{signed(check.mean_bias * study.per_line, 3)} dB on average.",
                figures=(
                    _picture(
                        pictures,
                        "pareto_front",
                        "Both objectives of every design of the front, with today's mounts and "
                        "the named picks. Bars are ± one standard error as if the draws were "
                        "independent, an upper bound for Sobol draws.",
                    ),
                ),
                tables=(
                    Table(
                        tables["picks"],
                        "Today's mounts and the named designs, per vehicle and line.",
                        {"mean level [dB(A)]": 2, "sigma of the level [dB]": 3},
                    ),
                ),
            ),
            Section(
                "What the driver hears",
                f"{study.load_case.title}. Best mean against today's mounts, without scatter.",
                figures=(
                    _picture(
                        pictures,
                        "spl_curves",
                        "Sound pressure level at the driver's ear, one panel per vehicle: "
                        "frequency below, engine speed above.",
                    ),
                ),
                tables=(
                    Table(
                        tables["peaks"][list(PEAK_COLUMNS)],
                        "Booming peaks: local maxima with a prominence of 6 dB or more, before and "
                        "after. A dash: no such peak within 1.5 Hz any more, the level is the "
                        "highest one there.",
                        {"prominence before [dB]": 1, "change [dB]": 1},
                    ),
                ),
            ),
            Section(
                "What the supplier should build",
                "The stiffnesses of best mean within their bounds, and beside them those of the "
                "other picks. Nominal is the mean magnitude of the dynamic stiffness measured in "
                f"operation ({study.load_case.title}).",
                figures=(
                    _picture(
                        pictures,
                        "stiffness_bars",
                        "Chosen stiffness of every mount and axis. The thin bracket spans the "
                        f"range within which the mean level stays within {NOTICEABLE} dB.",
                    ),
                ),
                tables=(
                    Table(
                        tables["stiffness"][list(STIFFNESS_COLUMNS)],
                        "Stiffnesses of the named designs. From and to: the range around best mean "
                        f"within which the mean level stays within {NOTICEABLE} dB.",
                        {c: 0 for c in STIFFNESS_COLUMNS if c.endswith("[N/mm]")},
                    ),
                    *_loss_factors(tables),
                ),
            ),
            Section(
                "Per vehicle",
                "What best mean changes in each vehicle, and how much the manufacturing scatter "
                "moves it.",
                figures=(
                    _picture(
                        pictures,
                        "per_vehicle_change",
                        "Change against today's mounts; whiskers are ± one σ of the scatter.",
                    ),
                ),
                tables=(
                    Table(
                        tables["vehicles"],
                        "Before: today's mounts; after: best mean. Levels are means over the lines "
                        "and over the scatter, changes are those of the designs without scatter; "
                        f"energy is that of {ENERGY_BAND[0]:g} to {ENERGY_BAND[1]:g} Hz.",
                    ),
                ),
            ),
            Section(
                "How the search went",
                f"NSGA-II, {search.hypervolume.size} generations, {search.seconds:.1f} s. Motion: "
                f"{study.motion}; meaning of a stiffness factor: "
                f"{motion.summary['design_factor']}; kernel: {study.index.kernel.name}.\n\n"
                "\n\n".join((motion.text, aim_note(study.robust), study.note)).strip(),
                figures=(
                    _picture(
                        pictures,
                        "convergence",
                        "Hypervolume of the front over the generations; flat means that more "
                        "generations would not have helped.",
                    ),
                ),
            ),
        ),
    )


def _factors(study: RobustFront) -> str:
    """Say what the variables are."""
    if len(study.variables) == len(study.stiffness_variables):
        return "stiffness factors"
    return "factors of stiffness (K' and K'' alike) and of loss (K'' alone, exactly made)"


def _loss_factors(tables: Mapping[str, pd.DataFrame]) -> tuple[Table, ...]:
    if "loss_factors" not in tables:
        return ()
    return (
        Table(
            tables["loss_factors"],
            "Factors on the loss factor K''/K' at unchanged K'; a dash: no requirement.",
        ),
    )


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


def _listed(names: tuple[str, ...]) -> str:
    if len(names) == 1:
        return names[0]
    return f"{', '.join(names[:-1])} and {names[-1]}"
