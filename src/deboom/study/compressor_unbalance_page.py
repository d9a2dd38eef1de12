"""The page of a running compressor: what turns inside, and how far it may be believed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import pandas as pd

from deboom.compressor.source_load import case_name
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import signed
from deboom.study.component_verdicts import open_points, shown_verdicts
from deboom.study.compressor_identification_words import in_words
from deboom.study.compressor_unbalance_words import CAPTIONS

if TYPE_CHECKING:
    from deboom.study.compressor_unbalance import MeasuredUnbalance


def page_of(
    measured: MeasuredUnbalance,
    tables: Mapping[str, pd.DataFrame],
    figures: Mapping[str, bytes],
    more: Sequence[Section] = (),
) -> Page:
    """Write the page of one compressor.

    Parameters
    ----------
    measured : MeasuredUnbalance
    tables : mapping of str to DataFrame
        From `tables_of`, with ``verdicts`` where there are limits.
    figures : mapping of str to bytes
        May be empty.
    more : sequence of Section
        Of a study of several compressors; at the end.

    Returns
    -------
    Page
    """
    found = measured.found
    sections = [
        _asked(measured),
        *([_verdicts(measured)] if measured.verdicts else []),
        _moves(figures),
        _unbalance(measured, tables, figures),
        _routes(measured, tables, figures),
        *([_hoses(measured, tables, figures)] if measured.with_hoses is not None else []),
        *more,
    ]
    return Page(
        title=f"Unbalance: {measured.test.name}",
        question=(
            "Which unbalance turns inside this compressor, what does the gas do, and at which "
            "speeds may the answer be believed?"
        ),
        sections=tuple(sections),
        headlines=_headlines(measured),
        warnings=(*measured.kept.alarms, *found.alarms, *found.notices),
    )


def _headlines(measured: MeasuredUnbalance) -> tuple[Headline, ...]:
    sources = measured.found.chosen.sources
    static, dynamic = sources.static, sources.dynamic
    lines = [
        Headline(
            f"{1e6 * abs(static.value):.2f} g mm",
            f"static unbalance, {1e6 * static.lower:.2f} to {1e6 * static.upper:.2f}",
        ),
        Headline(
            f"{1e9 * abs(dynamic.value):.0f} g mm²",
            f"dynamic unbalance, {1e9 * dynamic.lower:.0f} to {1e9 * dynamic.upper:.0f}",
        ),
        Headline(
            f"{sources.remaining_chi:.2f}",
            "left by rotor, gas and mounts, over its noise; route "
            f"{measured.found.chosen.route.letter}",
        ),
    ]
    state = measured.found.state
    if measured.mounts_changed != "unknown":
        lines.append(
            Headline(
                f"{signed(100 * state.storage, 1)} % / {signed(100 * state.loss, 1)} %",
                "stiffness / damping of the mounts, running over struck",
            )
        )
    return tuple(lines)


def _asked(measured: MeasuredUnbalance) -> Section:
    found, test = measured.found, measured.test
    sweeps = "; ".join(
        f"{sweep.name}: {sweep.speed[0]:.0f}–{sweep.speed[-1]:.0f} rpm, "
        f"{sweep.frequency.size} lines"
        for sweep in test.sweeps
    )
    confidence = found.options.confidence
    return Section(
        "What was asked, and with which data",
        f"The hammer test on the resting compressor without hoses gives its apparent mass; the "
        f"accelerations of first order of the running one, times that mass, are the load inside. "
        f"Sweeps: {sweeps}.\n\n{found.sense.statement}\n\nAll bands and intervals hold with "
        f"{100 * confidence:g} %. They include noise of sweeps and hammer test, what the hammer "
        "test leaves open of placement and calibration, and what the mounts may have changed "
        "between hammer and operation.",
    )


def _verdicts(measured: MeasuredUnbalance) -> Section:
    undecided = open_points(measured.verdicts)
    return Section(
        "Does it keep its limits?",
        "Decided as ISO 14253-1 has it: a limit is kept where the value lies inside it by more "
        "than the guard band, broken where it lies outside by more; in between, nothing is proven. "
        "The guard band comes from the standard deviation, so that a part which breaks a limit "
        "passes with the stated risk at most. supplier_sheet.html is the page for the supplier.",
        tables=(
            Table(shown_verdicts(measured.verdicts), "Limits and verdicts."),
            *(() if undecided.empty else (Table(undecided, "Limits that are open."),)),
        ),
    )


def _moves(figures: Mapping[str, bytes]) -> Section:
    return Section(
        "How it moves",
        "The channels of all accelerometers are projected on the six motions of a rigid body. What "
        "is left tells a bending body, a loose sensor or a wrong sheet.",
        figures=pictures(figures, "figure_52"),
    )


def _unbalance(
    measured: MeasuredUnbalance, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    chosen = measured.found.chosen
    truth = " The truth of the virtual compressor is for comparison only." if measured.truth else ""
    shown = [
        Table(
            in_words(tables["sources"]),
            "Sources: unbalance, which grows with the square of the speed and is the same at every "
            "pressure; gas forces, which depend on pressure and not on speed. One weighted fit "
            "over all lines and sweeps; the phase counts from the tacho's mark.",
            {"phase [°]": 0},
        ),
        Table(
            tables["unexplained"], "What neither rotor nor gas explains, by bands: small is good."
        ),
    ]
    if len(tables["mask"]):
        shown.append(Table(tables["mask"], "Lines that are not to be trusted, and why."))
    return Section(
        "Unbalance and internal forces",
        f"By route {chosen.route.letter}, {chosen.route.title}. {measured.found.agreement}{truth}",
        figures=pictures(figures, "figure_61"),
        tables=tuple(shown),
    )


def _routes(
    measured: MeasuredUnbalance, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    routes = tables["routes"]
    shown = [
        name
        for name in map(str, routes)
        if not name.startswith(("error", "y/z")) and name != "residuals over noise [1]"
    ]
    compared = ["route", *(name for name in map(str, routes) if name.startswith(("error", "y/z")))]
    return Section(
        "Routes compared",
        f"{measured.mount_state}\n\nA disturbance below 50 Hz comes from mounts that run "
        "in another state than they were struck in (amplitude, temperature), not from conditioning "
        "of the inversion: where the mounts are as struck, all routes agree there.",
        figures=pictures(figures, "routes", "mount_state"),
        tables=(
            Table(
                routes[shown],
                "Global fit by each route; ± is one standard deviation.",
                {name: 0 if "mm²" in name else 2 for name in shown[2:]},
            ),
            Table(
                routes[compared],
                "Line by line, rms: agreement of y and z, and errors where the truth is known.",
                {name: 1 for name in compared[1:]},
            ),
        ),
    )


def _hoses(
    measured: MeasuredUnbalance, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    statements = "\n\n".join(
        f"At {case_name(one.pair.pressure)}: " + " ".join(band.statement for band in one.bands)
        for one in measured.reactions
    )
    return Section(
        "With the hoses of the vehicle",
        "The same evaluation on sweeps with the hoses joined: what the hoses push back appears as "
        "unbalance that is none, most where the hoses resonate.\n\n" + statements,
        figures=pictures(figures, "figure_62"),
        tables=(
            (
                Table(
                    tables["hose_reaction"],
                    "Reaction of the hoses over the force of the source, rms per band, against the "
                    "floor below which nothing would be seen.",
                ),
            )
            if "hose_reaction" in tables
            else ()
        ),
    )


def pictures(figures: Mapping[str, bytes], *stems: str) -> tuple[Picture, ...]:
    """Give the figures whose names begin so their captions, in this order."""
    return tuple(
        Picture(png, alt=CAPTIONS[name], caption=CAPTIONS[name])
        for stem in stems
        for name, png in figures.items()
        if name.startswith(stem)
    )
