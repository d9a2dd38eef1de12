"""A second engine as the result of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.result import StudyResult
from deboom.study.second_engine import SecondEngine
from deboom.study.second_engine_figures import second_engine_figures
from deboom.study.second_engine_numbers import (
    direction_numbers,
    force_table,
    preload_numbers,
    preload_table,
    second_engine_summary,
)

NOT_IDENTIFIED = (
    "A direction that is not identified was measured with an error that its error budget puts "
    "beyond use; its forces are shown, and prove nothing."
)


def second_engine_result(
    engines: Sequence[SecondEngine], inputs: tuple[Path, ...] = (), *, with_figures: bool = True
) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    engines : sequence of SecondEngine
        At least one; figures show the first, tables all.
    inputs : tuple of Path
        Files that stay; benches that were measured for the study leave none.
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        Tables ``forces``, ``preload`` and ``directions``, the numbers of every bench behind them.
    """
    numbers = direction_numbers(engines)
    tables = {
        "forces": force_table(numbers),
        "preload": preload_table(preload_numbers(engines)),
        "directions": numbers.rename(columns=_with_unit),
    }
    figures = second_engine_figures(engines[0]) if with_figures else {}
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=second_engine_summary(engines, numbers),
        page=_page(engines, tables, figures),
        inputs=inputs,
    )


def _with_unit(name: str) -> str:
    units = {"bench": "", "direction": "", "peak": " [dB]", "static_difference": " [N]"}
    return f"{name}{units.get(name, ' [1]')}"


def _page(
    engines: Sequence[SecondEngine],
    tables: Mapping[str, pd.DataFrame],
    figures: Mapping[str, bytes],
) -> Page:
    first, forces = engines[0], tables["forces"]
    found = forces[forces["identified"] == "identified"]
    known_from = sorted({one.identity.campaign for one in first.mounts})
    headlines = [
        Headline(
            f"{found['rms error of F [%]'].median():.1f} %",
            "rms error of the force, median over the identified directions",
        ),
        Headline(
            f"{found['lines inside [%]'].min():.0f} %",
            "least share of lines within the measured region",
        ),
    ]
    sections = (
        Section(
            "What was asked, and with which data",
            f"Mounts characterised in {', '.join(known_from)} carry another engine in "
            f"{first.campaign.name}, of order {first.campaign.order:g}; "
            f"{len(engines)} {'benches' if len(engines) > 1 else 'bench'}. The second engine gives "
            "its own motion at the mounts and its own static forces; the response surfaces give "
            "the dynamic stiffness at that preload, amplitude and frequency; their product is the "
            "predicted force. It is compared with the force that the cells under the second engine "
            "measured, which no surface has seen. Lines outside of the region in which a mount was "
            "measured are counted, and not predicted.",
        ),
        Section(
            "Predicted and measured forces",
            "",
            figures=tuple(
                _picture(
                    png,
                    f"Forces of {stem.partition('_')[2]}, the highest torque of each gear: real "
                    "parts above, imaginary parts below, as measured and as predicted.",
                )
                for stem, png in figures.items()
                if stem.startswith("force_")
            ),
            tables=(
                Table(
                    forces,
                    "Medians over the benches. The error is the rms of the force error over the "
                    "rms of the force; the peak is the largest difference of the highest force of "
                    "a run. Both engines' measuring chains have a part in it.",
                    {name: 2 for name in forces.columns if name.startswith(("R²", "peak"))},
                ),
            ),
        ),
        Section(
            "Which preload carries over",
            "The wheel torque of another powertrain loads a mount differently. Its own static "
            "force does carry over along the main axis of a mount, but not across: there the "
            "stiffness follows the force along the main axis. So every direction is predicted "
            "over the static force along the main axis. The kinematic model gives that force from "
            "wheel torque, the place of the mounts and the suppliers' curves alone.",
            figures=tuple(
                _picture(
                    png,
                    f"Dynamic stiffness along {stem.partition('_')[2]} as both engines measured "
                    "it, over the static force along the main axis; the scatter is amplitude and "
                    "frequency.",
                )
                for stem, png in figures.items()
                if stem.startswith("preload_")
            ),
            tables=(
                Table(tables["preload"], "Rms error of the predicted force by preload variable."),
            ),
        ),
    )
    doubtful = len(found) < len(forces)
    return Page(
        title="A second engine on mounts of the library",
        question=(
            "Do mounts that were characterised under one engine predict the forces that another "
            "engine measures on them?"
        ),
        headlines=tuple(headlines) if len(found) else (),
        terms=("dynamic stiffness",),
        warnings=(NOT_IDENTIFIED,) if doubtful else (),
        sections=sections,
    )


def _picture(png: bytes, caption: str) -> Picture:
    return Picture(png, alt=caption, caption=caption)
