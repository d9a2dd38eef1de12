"""Figures and page of the robust front of a compressor's mounts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.report import figures
from deboom.report.figures import CurvePanel, IndexBars
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import mount_colours, mount_of, signed, vehicle_colours
from deboom.study.compressor_mounts import Hoses, Parts
from deboom.study.compressor_robust_front import (
    FIRST_ORDER,
    NOTICEABLE,
    CompressorFront,
)
from deboom.study.compressor_robust_front_tables import N_PER_MM

TERMS = (
    "SPL",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "σ",
    "Pareto front",
    "knee",
    "sensitivity index",
    "noise transfer function",
)


def front_figures(study: CompressorFront) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    values, scale, base = study.verification.values, study.per_line, study.baseline
    colours, n = vehicle_colours(study.cars), study.n_lines
    peaks = study.peak_changes
    owners = mount_colours(list(dict.fromkeys(mount_of(name) for name in study.chosen_names)))
    chosen = list(study.chosen)
    row = study.picks["best mean"]
    low, high = study.frequency[0], study.frequency[-1]
    found = study.sobol
    columns = (found.first.T, found.total.T, found.total_interval.T, found.zero.T)
    pictures = {
        "pareto_front": figures.pareto_front(
            values.mean_sum * scale,
            values.sigma_sum * scale,
            values.standard_error_mean_sum * scale,
            values.standard_error_sigma_sum * scale,
            (float(base.mean_sum[0]) * scale, float(base.sigma_sum[0]) * scale),
            {
                name: (float(values.mean_sum[at]) * scale, float(values.sigma_sum[at]) * scale)
                for name, at in study.picks.items()
            },
            mean_label="mean level over cars and lines [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
        "spl_curves": figures.spl_curves(
            study.frequency,
            FIRST_ORDER,
            study.levels(study.space.nominal),
            study.levels(study.best),
            study.cars,
            [[c.before.frequency for c in peaks[car] if c.before] for car in study.cars],
            [[c.after.frequency for c in peaks[car] if c.after] for car in study.cars],
            colours,
        ),
        "stiffness_bars": figures.stiffness_bars(
            study.chosen_names,
            study.best[chosen],
            study.space.lower[chosen],
            study.space.upper[chosen],
            study.chosen_stiffness(study.space.nominal) * N_PER_MM,
            [False] * len(chosen),
            study.indifference,
            owners,
            stiffness_label=f"|K| at {study.model.reference_line:g} Hz [N/mm]",
        ),
        "per_car_change": figures.per_vehicle_change(
            study.cars,
            study.level_change(study.best),
            values.sigma[row] / n,
            study.energy_change(study.best),
            study.energy_sigma(study.best),
            colours,
            level_label="change of the mean level [dB]",
            energy_label=f"change of energy {low:g}–{high:g} Hz [dB]",
        ),
        "sobol": figures.index_bars(
            found.factors,
            [owners[mount_of(name)] for name in found.factors],
            [IndexBars(*one) for one in zip(found.outputs, *columns, strict=True)],
            x_label="share of the variance [1]",
        ),
        "convergence": figures.convergence(
            np.arange(1, len(study.search.hypervolume) + 1),
            study.search.hypervolume,
            hypervolume_label="hypervolume [dB²]",
        ),
    }
    if study.agreement is not None:
        pictures["agreement"] = figures.curve_panels(
            [
                CurvePanel(
                    car,
                    study.frequency,
                    {
                        "predicted": study.agreement.predicted[1, place],
                        "exact": study.agreement.exact[1, place],
                    },
                )
                for place, car in enumerate(study.cars)
            ],
            x_label="rotational frequency [Hz]",
            y_label="SPL [dB(A)]",
            dashed=("exact",),
            share_y=True,
        )
    return pictures


def front_page(
    study: CompressorFront, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    """Compose the page from the study's tables and figures."""
    base, check = study.baseline, study.verification.values
    row = study.picks["best mean"]
    sigma = 100 * (check.sigma_sum[row] / base.sigma_sum[0] - 1)
    question = study.model.question
    return Page(
        title="Mounts of the compressor: quiet cars in spite of scatter",
        question=(
            "Which stiffness of its mounts makes a compressor quiet in "
            f"{len(study.cars)} electric cars, {question.band[0]:g} to {question.band[1]:g} Hz, "
            "and keeps them quiet as parts scatter?"
        ),
        headlines=(
            Headline(f"{signed(study.mean_change, 1)} dB", "mean level, best mean against today"),
            Headline(f"{signed(float(sigma), 0)} %", "its σ over the tolerance"),
            Headline(
                f"{study.travel(study.best) / study.travel(study.space.nominal):.2f}",
                f"travel over today's; {study.travel_ratio:g} is allowed",
            ),
            Headline(study.leading, "stiffness that matters most"),
            *_agreement_headline(study),
        ),
        terms=TERMS,
        warnings=study.model.alarms,
        sections=(
            _choice(study, tables, pictures),
            _quiet(study, tables, pictures),
            _matters(study, tables, pictures),
            _trust(study, pictures),
            Section(
                "How the search went",
                f"NSGA-II, {study.search.hypervolume.size} generations, "
                f"{study.search.n_evaluated} designs, {study.search.seconds:.1f} s. Every design "
                f"was made {study.robust.sample.n_samples} times within its tolerance; the front "
                f"was verified with {study.verification.n_samples} draws that the search never "
                "saw.",
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


def _agreement_headline(study: CompressorFront) -> tuple[Headline, ...]:
    if study.agreement is None:
        return ()
    error = float(np.median(np.abs(study.agreement.peak_errors)))
    return (Headline(f"{error:.2f} dB", "median error of the model at peaks"),)


def _choice(
    study: CompressorFront, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Section:
    question = study.model.question
    what = (
        "One part number for all mounts: an axial and a radial stiffness; pieces scatter on their "
        "own, and batch by batch together."
        if question.parts is Parts.identical
        else "Every mount has an axial and a radial stiffness of its own."
    )
    place = (
        f" Mounts stand within ± {question.place_tolerance:g} mm of where they are."
        if question.place_tolerance
        else ""
    )
    bound = f" Best mean is at the bound of {', '.join(study.at_bound)}." if study.at_bound else ""
    reached = " It uses all the travel allowed." if study.limit_reached else ""
    return Section(
        "What to choose",
        f"{what}{place}\n\nSofter mounts nearly always isolate better. What holds them back is how "
        "far the compressor may travel: no mount may move further under 1 g along any axis than "
        f"{study.travel_ratio:g} times today's. Where the limit and the bounds of the search are "
        "reached, they and not the noise decide: the answer is as good as that limit."
        f"{reached}{bound}",
        figures=(
            _picture(
                pictures,
                "pareto_front",
                "Mean level against its scatter; every point is a design that no other beats.",
            ),
            _picture(
                pictures,
                "stiffness_bars",
                "Best mean: stiffness factors within their bounds. The thin bars are ranges within "
                f"which the mean level stays within {NOTICEABLE} dB.",
            ),
        ),
        tables=(
            Table(
                tables["picks"],
                "Named designs, verified. Travel and modes are with the stiffness at "
                f"{study.frequency[0]:g} Hz, which is more than at rest: compare them, do not "
                "take them for a static drawing.",
            ),
            Table(
                tables["stiffness"],
                f"Dynamic stiffness |K| at {study.model.reference_line:g} Hz, mean over what a "
                "variable stands for.",
                {c: 1 for c in tables["stiffness"].columns if c.endswith("[N/mm]")},
            ),
        ),
    )


def _quiet(
    study: CompressorFront, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Section:
    after = study.levels(study.best)
    change = after - study.levels(study.space.nominal)
    car, line = np.unravel_index(int(np.argmax(change)), change.shape)
    louder = (
        " Mounts move the resonances of the compressor: where it now swings, levels rise, most of "
        f"all by {change[car, line]:.1f} dB to {after[car, line]:.0f} dB(A) in {study.cars[car]} "
        f"at {study.frequency[line]:g} Hz ({60 * study.frequency[line]:.0f} rpm)."
        if change[car, line] > NOTICEABLE
        else ""
    )
    return Section(
        "What it does in every car",
        "First order of the compressor at the driver's ear. Curves and peaks are those of the "
        f"first pressure; levels and changes are weighted over all.{louder}",
        figures=(
            _picture(pictures, "spl_curves", "Today and best mean, without scatter."),
            _picture(
                pictures, "per_car_change", "Change against today; whiskers are ± one σ of scatter."
            ),
        ),
        tables=(
            Table(tables["cars"], "Levels are means over lines and scatter."),
            Table(tables["peaks"], "Peaks of at least 6 dB."),
        ),
    )


def _matters(
    study: CompressorFront, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Section:
    return Section(
        "What matters to whoever makes the mounts",
        "Importance is the share of the variance of the level that a stiffness is behind, "
        "couplings included, when all vary within the bounds of the search; mean over the cars. "
        f"The share of σ belongs to the tolerance at best mean. {study.leading} matters most. "
        "supplier_sheet.html is the page for the supplier.",
        figures=(
            _picture(
                pictures,
                "sobol",
                "Sobol indices: full bars alone, hatched ones coupled with others.",
            ),
        ),
        tables=(
            Table(
                tables["requirements"],
                "Required stiffness, and what tolerances are worth: change of σ if this one alone "
                "were halved.",
                {c: 1 for c in tables["requirements"].columns if c.endswith("[N/mm]")},
            ),
        ),
    )


def _trust(study: CompressorFront, pictures: Mapping[str, bytes]) -> Section:
    running, question = study.model.running, study.model.question
    rigid = np.abs(study.rigid_difference)
    hoses = (
        "Hoses are in as identified beams."
        if question.hoses is Hoses.identified
        else "Hoses are left out: theirs is a path of its own, which mounts do not change."
    )
    words = [
        running.shares.statement,
        running.source.state.statement,
        "Mounts keep their gain over frequency whatever their stiffness, and do not soften with "
        "amplitude. "
        f"{hoses}",
        "The holders of the mounts give way as the free bodies do, by accelerances measured with "
        "the compressor out. Rigid holders would move the level of a line by "
        f"{np.median(rigid):.2f} dB (median), {np.quantile(rigid, 0.9):.2f} dB (90 %).",
    ]
    shown: tuple[Picture, ...] = ()
    if study.agreement is not None and study.exact_change is not None:
        errors = np.abs(study.agreement.peak_errors)
        predicted, exact = study.agreement.changes
        rms = float(np.sqrt(np.mean((predicted - exact) ** 2)))
        words.append(
            f"On the virtual bench {len(exact)} designs within the bounds were compared with the "
            f"exact coupled solution: at peaks {np.median(errors):.2f} dB (median), "
            f"{np.quantile(errors, 0.9):.2f} dB (90 %); change of the mean level against today "
            f"{rms:.2f} dB (rms) of {float(np.sqrt(np.mean(exact**2))):.2f} dB. Best mean changes "
            f"it by {signed(float(study.exact_change.mean()), 2)} dB in the exact cars, and by "
            f"{signed(float(study.level_change(study.best).mean()), 2)} dB in the model."
        )
        shown = (
            _picture(
                pictures, "agreement", "One design that nobody measured: predicted and exact level."
            ),
        )
    return Section("How far to trust it", "\n\n".join(words), figures=shown)


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
