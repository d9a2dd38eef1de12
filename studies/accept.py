"""Judge the measured parts of a delivery by an acceptance box or by a supplier's sheet.

PARTS is the workbook of deboom report --supplier, with its sheet “measured” filled in. The parts
are compared with the required intervals at the preload, amplitude and frequency of the workbook,
which must be those of the box. PARTS may also be a table with one row per part and the columns
part, batch, mount, x [N/mm], y [N/mm], z [N/mm]: the magnitude of the dynamic stiffness at the
state of the box. Leave a cell empty where the box does not limit the axis. With --over-today the
columns are ratios to today's part, both measured at the same state on the same machine. A part
nearer to an end of its interval than --uncertainty is undecided. --platform, the folder with which
the box was computed, predicts the levels of the cars that get these parts.

Results: pass, fail or undecided for every part and batch, with the reason; Cp and Cpk per axis with
their lower bounds, compared with the demanded Cpk; the levels of the cars with mounts of the batch;
tables, figures and report.html. supplier.html has the verdicts and the rules, and nothing about the
vehicles. The last line of the output is the run folder.

Try: deboom report RUN --supplier --box BOX, fill in the workbook, then deboom accept BOX WORKBOOK
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from deboom.errors import InputError
from deboom.files.acceptance import (
    DeliveredPart,
    SupplierSpecification,
    box_file,
    holds_sheet,
    read_delivered_parts,
    read_measured_sheet,
    read_solution_box,
    read_specification,
)
from deboom.files.platform import read_platform
from deboom.language import Language
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.supplier.acceptance import delivery_report, supplier_verdict
from deboom.supplier.delivery import Demand, judged_delivery, limited_axes
from deboom.vehicles.platform import Platform

QUESTION = "Do these parts keep the acceptance box?"


@dataclass(frozen=True)
class Options:
    """Which parts are judged, and by what."""

    box: Annotated[
        Path, Argument(help="Run of solution_box, an acceptance box, or a supplier's sheet.")
    ]
    parts: Annotated[
        Path, Argument(help="Table of measured parts, or the supplier's workbook, filled in.")
    ]
    platform: Annotated[
        Path | None, Option(help="Platform folder of the box, to predict the levels of the cars.")
    ] = None
    uncertainty: Annotated[
        float | None,
        Option(help="Relative error of a measured stiffness, 95 % [1]; default: from the sheet."),
    ] = None
    over_today: Annotated[
        bool, Option(help="The columns are ratios to today's part, not N/mm.")
    ] = False
    seed: Annotated[int, Option(help="Seed of the predicted cars, 1 or higher.")] = 1


@dataclass(frozen=True, eq=False)
class Model:
    """A delivery, what it must keep, and the platform whose cars get it.

    - `box`: file of the box, or of the sheet as it was sent.
    - `uncertainty`: of a measured stiffness, relative, expanded to 95 % [1].
    - `language`: of the page for the supplier.
    """

    box: Path
    demand: Demand
    parts: tuple[DeliveredPart, ...]
    uncertainty: float
    language: Language
    platform: Platform | None


def prepare(options: Options) -> Model:
    """Read the box or sheet, the measured parts, and the platform."""
    box, stated = box_file(options.box), options.uncertainty
    language = Language.en
    if holds_sheet(options.parts):
        sheet = read_specification(options.parts)
        demand, language = demand_of_sheet(box, sheet), Language(sheet.language)
        parts = read_measured_sheet(options.parts, sheet)
        stated = sheet.uncertainty if stated is None else stated
    else:
        demand = Demand.of_box(read_solution_box(box))
        axes = limited_axes(demand, over_today=options.over_today)
        parts = read_delivered_parts(options.parts, axes, over_today=options.over_today)
    platform = None if options.platform is None else read_platform(options.platform)
    return Model(box, demand, tuple(parts), stated or 0.0, language, platform)


def demand_of_sheet(path: Path, returned: SupplierSpecification) -> Demand:
    """Hold a returned sheet against the box, or against the sheet as it was sent."""
    if path.suffix.lower() != ".xlsx":
        return Demand.of_sheet(returned, read_solution_box(path))
    sent = read_specification(path)
    if sent.checksum != returned.checksum:
        raise InputError(
            f"the filled-in sheet has the checksum {returned.checksum[:12]}, {path} "
            f"{sent.checksum[:12]}: it answers another sheet"
        )
    return Demand.of_sheet(sent, None)


def run(model: Model, options: Options) -> Report:
    """Judge the parts, and report to the vehicle side and to the supplier."""
    with progress_bar("accept") as progress:
        progress(0, 1, "parts and cars")
        delivery = judged_delivery(
            model.demand,
            model.parts,
            model.platform,
            model.uncertainty,
            options.seed,
            over_today=options.over_today,
        )
        progress(1, 1, "done")
    files = () if model.platform is None else model.platform.input_files
    report = delivery_report(delivery, (model.box, options.parts, *files))
    judged_on = datetime.now(UTC).date().isoformat()
    page = supplier_verdict(delivery, model.language, judged_on)
    report.attach("supplier.html", page.html().encode())
    return report
