"""The part of an identified compressor's page that says what its test can and cannot tell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import pandas as pd

from deboom.compressor.identifiability import PRIOR_DOMINATED
from deboom.report.page import Section, Table
from deboom.study.compressor_identification_words import SHOWN_ROWS, in_words, pictures_of

if TYPE_CHECKING:
    from deboom.compressor.thesis_fit import ThesisFit
    from deboom.study.compressor_identification import IdentifiedTest

NARROW: Mapping[str, str] = {
    "parameter": "parameter",
    "unit": "unit",
    "start": "start",
    "fitted": "fitted",
    "truth": "truth",
    "posterior deviation": "±",
    "posterior over prior [1]": "left [1]",
    "verdict": "verdict",
}
"""Columns of the table of 44 numbers that the page has room for, and their short names."""


def limits_section(
    test: IdentifiedTest, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    """Say which parameters are seen, which are not, and which come from what was known before."""
    dominated = test.found.known.prior_dominated
    text = (
        "The 35 numbers of the minimal model are all seen. "
        + (
            f"Of them {', '.join(dominated)} come mostly from what was known before. "
            if dominated
            else "None of them comes mostly from what was known before. "
        )
        + "Many hang together, since the position error of one sensor moves several: the strongest "
        "correlations are listed."
    )
    shown = [
        Table(
            tables["correlations"].head(SHOWN_ROWS),
            f"The strongest of {len(tables['correlations'])} correlations beyond 0.8 in size.",
        )
    ]
    if test.thesis is not None:
        text += "\n\n" + _thesis_words(test.thesis)
        shown = [
            Table(tables["null_space"], "Changes that no test at one virtual point can see."),
            Table(tables["fits"], "Optimisers of the 44-number fit, one cost."),
            Table(
                in_words(tables["identifiability"]).rename(columns=NARROW)[
                    [name for name in NARROW.values() if name in _narrow_columns(tables)]
                ],
                "The thesis's numbers, from the drawing (its table 10) to the fit (its table 11). "
                "±: what is left of the bound, which counts as 1 σ before the test; left: its "
                "share. Invisible: nothing but the drawing is known of it. Prior-dominated: more "
                f"than {PRIOR_DOMINATED:.0%} is left. With others only: a part of it lies in a "
                "combination that no test at one point can see; read it together with the others, "
                "or not at all. Both judge what the self-calibrated test knows; the fit itself "
                "takes the places of the sheet for exact and may be further off.",
            ),
            *shown,
        ]
    else:
        text += (
            "\n\nThe test has no drawing: the thesis's single mount positions, rotations and "
            "stiffnesses were not fitted."
        )
    return Section(
        "What this test can and cannot say",
        text,
        figures=pictures_of(figures, ("knowledge",)),
        tables=tuple(shown),
    )


def _thesis_words(thesis: ThesisFit) -> str:
    seen = thesis.seen
    held = (
        f"The fit ends with {', '.join(thesis.fit.at_bound)} at a bound."
        if thesis.fit.at_bound
        else "No number ends at a bound."
    )
    return (
        f"The thesis fits {len(seen.names)} numbers. A hammer test at one virtual point sees "
        f"{seen.rank} combinations of them, whatever its noise: {len(seen.null_space)} changes "
        "leave every FRF as it is; the first table names them. Rotation x is a mount's rotation "
        "about its own axis: it matters only as far as the two radial stiffnesses differ. "
        "Mass, centre of gravity and inertia take no part in any of these and are unique; "
        "single positions, rotations and stiffnesses of mounts are not, and equally good fits "
        f"differ by millimetres and degrees. {held} Report the stiffness at the virtual point "
        "and the gain instead; or, where all mounts are one round part, enforce that "
        "(--identical-mounts)."
    )


def _narrow_columns(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    return [NARROW.get(str(name), "") for name in tables["identifiability"]]
