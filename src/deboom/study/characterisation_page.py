"""Page of a mount characterisation, for a reader who builds mounts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from deboom.mounts.error_budget import IDENTIFIED
from deboom.mounts.mount import AXES
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.characterisation import CharacterisedBench
from deboom.study.characterisation_motion import shown_run
from deboom.study.surface_check import PEAKS, RMS

R2_WARNING = (
    "A high R² is no accuracy: it compares the surface with what was measured, and a measuring "
    "chain that is half a degree askew is askew in every run. The error budget says how far to "
    "believe a direction."
)
TRUTH_WARNING = (
    "The errors against the truth are those of the virtual test bench, whose noise and alignment "
    "errors are stated, not those of a particular laboratory."
)
ALONE = " alone [%]"
"""Ends the names of the columns that take one source of error alone."""
STATIC_CAPTION = (
    "Real parts above, imaginary parts below, over the quasi-static force of the cells. The "
    "scatter of both is the projection of amplitude and frequency."
)


def characterisation_page(
    benches: Sequence[CharacterisedBench],
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
) -> Page:
    """Compose the page from the study's tables and figures; figures are those of the first bench.

    Parameters
    ----------
    benches : sequence of CharacterisedBench
        At least one.
    tables : mapping of str to DataFrame
        Those of the study's result.
    pictures : mapping of str to bytes
        Its figures, as PNG.
    """
    first = benches[0].result
    sections = (
        _asked(benches),
        _accuracy(tables),
        Section(
            "What was measured",
            f"{benches[0].title}: each point is one line of one run. The wheel torque stands for "
            "the preload; lines whose displacement hardly exceeds its noise are left out.",
            figures=_present(
                pictures,
                {
                    "map_magnitude": "Magnitude of the operating dynamic stiffness over wheel "
                    "torque and frequency.",
                    "map_phase": "Its phase: the loss angle.",
                    "map_amplitude": "Magnitude over wheel torque and displacement amplitude, "
                    "in decibels of the largest one of the direction.",
                },
            ),
        ),
        _transfer(tables, pictures),
        Section(
            "Characteristic curves",
            "The dynamic stiffness over the static force, as suppliers specify it.",
            figures=_present(
                pictures, {f"static_{axis}": f"Axis {axis}. {STATIC_CAPTION}" for axis in AXES}
            ),
        ),
        Section(
            "Measured against the response surface",
            f"{len(benches[0].check_runs)} full-load runs. Dashed: measured. Solid: the response "
            "surface at the measured torque, displacement and frequency.",
            figures=_present(pictures, _load_case_captions(pictures)),
        ),
        Section(
            "Motion of the powertrain",
            f"Run {shown_run(benches[0]).name}. The motion of the rigid body comes from all "
            "accelerometers together; each of them can be computed from it again.",
            figures=_present(
                pictures,
                {
                    "reprojected_acceleration": "One accelerometer beside each mount, in its own "
                    "axes: dashed as measured, solid as the rigid body moves there.",
                    "neighbour_acceleration": "Acceleration at the virtual point of each mount "
                    "(solid) and of the sensor beside it (dashed).",
                    "neighbour_stiffness_error": "Error of the stiffness if the sensor beside the "
                    "mount stood for its virtual point.",
                },
            ),
            tables=(
                Table(tables["neighbour"], "That error over all lines of the run."),
                Table(
                    tables["quality"],
                    "Whether the sensors agree, in the order in which a laboratory repairs things: "
                    "the first check needs the position sheet alone, the last leaves one sensor "
                    "out at a time and names the culprit.",
                    {"number [1]": 3},
                ),
            ),
        ),
    )
    known = "truth" in tables
    return Page(
        title="Mounts from raw sensors",
        question=(
            f"How stiff are {', '.join(mount.name for mount in first.campaign.mounts)} in "
            "operation, and how far may the answer be believed?"
        ),
        headlines=_headlines(benches, tables),
        terms=("dynamic stiffness",),
        warnings=(R2_WARNING, TRUTH_WARNING) if known else (R2_WARNING,),
        sections=sections,
    )


def _headlines(
    benches: Sequence[CharacterisedBench], tables: Mapping[str, pd.DataFrame]
) -> tuple[Headline, ...]:
    uncertainty = tables["uncertainty"].set_index("direction")
    found = uncertainty.index[uncertainty["identified"] == "identified"]
    headlines = [Headline(f"{len(found)} of {len(uncertainty)}", "directions identified")]
    if "truth" in tables and len(found):
        errors = tables["truth"].set_index("direction").loc[found, "error of |K|, median [%]"]
        headlines += [
            Headline(f"{errors.median():.1f} %", "rms error of an identified direction, median"),
            Headline(f"{errors.max():.1f} %", f"the largest of them, {errors.idxmax()}"),
        ]
    seconds = sorted(bench.seconds for bench in benches)[len(benches) // 2]
    headlines.append(Headline(f"{seconds:.0f} s", "per mount set, with error budget"))
    return tuple(headlines)


def _asked(benches: Sequence[CharacterisedBench]) -> Section:
    first = benches[0].result
    options = first.options
    complaints = [one.complaint for one in first.directions.values() if one.complaint]
    gears = sorted({run.gear for run in first.runs})
    text = (
        f"Mount set {first.mount_set} on {len(benches)} "
        f"{'benches' if len(benches) > 1 else 'bench'}: {len(first.runs)} runs with rising torque "
        f"in the gears {', '.join(map(str, gears))}, engine order {first.campaign.order:g}. "
        f"Preload variable: {options.preload.name.lower().replace('_', ' ')}.\n\n"
        "Accelerometers give the motion of the rigid powertrain and with it of the virtual point "
        "in each mount; cells below the mounts, calibrated by a shaker at the virtual point, give "
        "its force. Force over displacement is the operating dynamic stiffness. Complete cubics "
        "in preload, displacement amplitude and frequency, in pieces of the preload, are fitted "
        "to real and imaginary part."
    )
    if options.self_calibration:
        text += (
            " Before that the measuring chain calibrates itself: sensors on a rigid body must "
            "agree, and the forces of the mounts must be mass times acceleration."
        )
    return Section("What was asked, and with which data", "\n\n".join([text, *complaints]))


def _accuracy(tables: Mapping[str, pd.DataFrame]) -> Section:
    uncertainty = tables["uncertainty"]
    alone = [name for name in uncertainty.columns if name.endswith(ALONE)]
    sources = uncertainty[["direction", *alone]]
    shown = [
        Table(
            uncertainty.drop(columns=alone),
            "Half width of the 95 % band of the surface, median over its lines. Beyond "
            f"{100 * IDENTIFIED:.0f} % a direction is not identified.",
        ),
        Table(
            sources.rename(columns=lambda name: name.replace(ALONE, " [%]")),
            "The same half width if one stated tolerance alone were at work, without "
            "self-calibration.",
        ),
    ]
    if "truth" in tables:
        shown.append(
            Table(
                tables["truth"],
                "Rms error of the surface against the truth of the bench, median and 90 % quantile "
                "over the benches. Held-out: a surface fitted without the check runs, on those.",
            )
        )
    shown.append(
        Table(
            tables["r2"],
            "Coefficient of determination, median over the benches, beside tables 6 to 8 of the "
            "thesis. Held-out as above; a dash: not known.",
            {name: 2 for name in tables["r2"].columns if name.endswith("[%]")},
        )
    )
    if "all_gears" in tables:
        shown.append(
            Table(
                tables["all_gears"],
                "Surfaces over the gears above beside surfaces over all gears of the campaign, "
                "whose number of pieces a cross-validation chose (median of the real part); each "
                "judged on its own lines.",
                {name: 2 for name in tables["all_gears"].columns if name.startswith("R²")}
                | {"pieces over all gears": 0},
            )
        )
    return Section(
        "How far to believe it",
        "Three questions, three tables: what the measuring chain leaves unknown, how far the "
        "result is from the truth where the truth is known, and how well the surface follows what "
        "was measured.",
        tables=tuple(shown),
    )


def _transfer(tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]) -> Section:
    """How the cells below the mounts are calibrated, and whether moments matter."""
    shown = [
        Table(
            tables["force_transfer"],
            "Mean over frequency and repeats. Deviations are relative to the matrix's column; six "
            "loads: three forces and three moments.",
            {"condition number [1]": 2, "cells": 0, "loads": 0, "repeats": 0},
        )
    ]
    text = (
        "A shaker at the virtual point of each mount says what the cells below it make of a force "
        "there. The force in operation is the inverse of that matrix times the cells' force."
    )
    if "moments" in tables:
        cost = tables["moments"]
        by_case = cost.groupby("load case", sort=False)[[RMS, PEAKS]].max().reset_index()
        shown.append(
            Table(
                by_case,
                f"Largest difference in any of {cost['vehicle'].nunique()} vehicles.",
                {RMS: 3, PEAKS: 3},
            )
        )
        text += (
            "\n\nThree cells and pushes beside the virtual point give the moments as well. Leaving "
            f"them out changes booming peaks by up to {cost[PEAKS].max():.2g} dB. That is what "
            "moments change in the forces: noise transfer functions are known for forces alone, so "
            "the sound that the moments themselves make is not in it."
        )
    captions = {
        "cell_calibration": "Cells per newton of the shaker: along its axis, and across by "
        "cross-talk. The slope is the bench that gives way."
    }
    return Section(
        "Force transfer matrices",
        text,
        tables=tuple(shown),
        figures=_present(pictures, captions),
    )


def _load_case_captions(pictures: Mapping[str, bytes]) -> dict[str, str]:
    what = {"stiffness": "Dynamic stiffness", "force": "Dynamic force"}
    split = ((stem, *stem.partition("_")[::2]) for stem in pictures)
    return {stem: f"{what[kind]} of {mount}." for stem, kind, mount in split if kind in what}


def _present(pictures: Mapping[str, bytes], captions: Mapping[str, str]) -> tuple[Picture, ...]:
    return tuple(
        Picture(pictures[stem], alt=caption, caption=caption)
        for stem, caption in captions.items()
        if stem in pictures
    )
