"""One page for the supplier of a compressor's mounts."""

from __future__ import annotations

import pandas as pd

from deboom.files.workbook import workbook_bytes
from deboom.report.page import Headline, Page, Section, Table, render_page
from deboom.report.style import signed
from deboom.study.compressor_mounts import Hoses, Parts
from deboom.study.compressor_robust_front import CompressorFront
from deboom.study.compressor_robust_front_tables import car_table, pick_table, requirement_table

STEM = "supplier_sheet"


def mount_sheet(study: CompressorFront, source: str) -> dict[str, bytes]:
    """Write the page and the workbook for the supplier.

    Parameters
    ----------
    study : CompressorFront
    source : str
        Where the sheet comes from.

    Returns
    -------
    dict of str to bytes
        File name → content.
    """
    wanted, conditions = requirement_table(study), condition_table(study, source)
    cars = car_table(study)[["car", "change [dB]", "sigma today [dB]", "sigma then [dB]"]]
    one_decimal = {name: 1 for name in wanted.columns if name.endswith("[N/mm]")}
    page = Page(
        title="Mounts of the refrigerant compressor",
        question=(
            f"Dynamic stiffness |K| at {study.model.reference_line:g} Hz that makes "
            f"{len(study.cars)} electric cars quiet, what its tolerance costs, and which direction "
            "matters."
        ),
        headlines=(
            Headline(
                f"{signed(study.mean_change, 1)} dB", "first order in the cabin, mean of cars"
            ),
            Headline(study.leading, "matters most"),
        ),
        sections=(
            Section(
                "Requirement",
                "",
                tables=(
                    Table(
                        wanted,
                        "Importance: share of the variance of the level within the range searched. "
                        "Share of sigma: of the scatter between cars as built; last column: its "
                        "change if this tolerance alone were halved.",
                        one_decimal,
                    ),
                ),
            ),
            Section(
                "Effect",
                "",
                tables=(Table(cars, "Mean level of the lines, and its scatter."),),
            ),
            Section("Conditions", "", tables=(Table(conditions, "Under which these hold."),)),
        ),
        compact=True,
    )
    sheets = {
        "requirement": wanted,
        "effect": cars,
        "designs": pick_table(study),
        "conditions": conditions,
    }
    return {
        f"{STEM}.html": render_page(page).encode("utf-8"),
        f"{STEM}.xlsx": workbook_bytes(sheets, page.title),
    }


def condition_table(study: CompressorFront, source: str) -> pd.DataFrame:
    """List under which conditions the requirement holds, and where it comes from."""
    question, index = study.model.question, study.model.index
    places = "; ".join(
        f"{mount.name} " + ", ".join(f"{1e3 * value:.1f}" for value in mount.position)
        for mount in index.mounts
    )
    parts = "one part number" if question.parts is Parts.identical else "one part per mount"
    cases = zip(index.case_names, index.weights, strict=True)
    rows = {
        "mounts": f"{parts}; places x, y, z from the virtual point [mm]: {places}",
        "directions": "axial along the axis of the mount, radial across it, both alike",
        "stiffness": "magnitude of the complex dynamic stiffness; loss factor as today",
        "band": f"{index.frequency[0]:g}–{index.frequency[-1]:g} Hz, first order",
        "pressures": ", ".join(f"{name} (weight {weight:.2g})" for name, weight in cases),
        "tolerance": f"± {100 * question.tolerance:g} % is three standard deviations"
        + (
            f", {100 * question.batch:g} % of the variance from batch to batch"
            if question.parts is Parts.identical
            else ""
        ),
        "places": f"± {question.place_tolerance:g} mm is three standard deviations",
        "travel": f"under 1 g at most {study.travel_ratio:g} times today's; "
        f"reached {study.travel(study.best) / study.travel(study.space.nominal):.2f}",
        "hoses": "as identified" if question.hoses is Hoses.identified else "left out",
        "source": source,
    }
    return pd.DataFrame({"condition": list(rows), "value": list(rows.values())})
