"""The command ``accept``: a delivery judged into a run folder."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from deboom.common import Progress
from deboom.errors import InputError
from deboom.files.acceptance import (
    SupplierSpecification,
    box_file,
    holds_sheet,
    read_delivered_parts,
    read_measured_sheet,
    read_solution_box,
    read_specification,
)
from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.runs.runner import run_command
from deboom.supplier.acceptance import ENGLISH, delivery_report, supplier_verdict
from deboom.supplier.delivery import (
    Demand,
    judged_delivery,
    limited_axes,
)

COMMAND = "accept"


def accept_into_run(
    box_path: Path,
    parts_path: Path,
    out: Path,
    platform: Path | None,
    uncertainty: float | None,
    seed: int,
    progress: Progress,
    *,
    over_today: bool = False,
) -> Path:
    """Judge a delivery and write a run folder, which is returned.

    Parameters
    ----------
    box_path : Path
        Box, run folder of the study ``solution_box``, or workbook of a sheet as it was sent.
    parts_path : Path
        Table of parts, or workbook of a sheet that was filled in.
    out : Path
        Folder that gets ``accept/<run>/``.
    platform : Path or None
        Folder of the platform that the box was found for.
    uncertainty : float or None
        As for `judged_delivery`; None: the one that a sheet states, or 0.
    seed, over_today
        As for `judged_delivery`.
    progress : callable

    Raises
    ------
    InputError
        A box, a sheet, a table or a platform that cannot be read or do not fit together; see also
        `judged_delivery`. Nothing is left behind.
    """
    begin = time.perf_counter()
    progress(0, 3, "reading")
    path, language = box_file(box_path), ENGLISH
    if holds_sheet(parts_path):
        sheet = read_specification(parts_path)
        demand = _demand_of_sheet(path, sheet)
        parts = read_measured_sheet(parts_path, sheet)
        language = sheet.language
        stated = sheet.uncertainty if uncertainty is None else uncertainty
    else:
        demand = Demand.of_box(read_solution_box(path))
        axes = limited_axes(demand, over_today=over_today)
        parts = read_delivered_parts(parts_path, axes, over_today=over_today)
        stated = uncertainty
    known = 0.0 if stated is None else stated
    data = read_platform(platform) if platform is not None else None
    record: dict[str, Any] = {
        "study": COMMAND,
        "command": f"deboom accept {path.as_posix()} {parts_path.as_posix()}",
        "question": "Do these parts keep the acceptance box?",
        "seed": seed,
        "arguments": {
            "platform": platform.as_posix() if platform is not None else None,
            "uncertainty": known,
            "over-today": over_today,
            "seed": seed,
        },
    }

    def work() -> Report:
        progress(1, 3, "parts and cars")
        delivery = judged_delivery(demand, parts, data, known, seed, over_today=over_today)
        progress(2, 3, "tables and figures")
        files = data.input_files if data is not None else ()
        report = delivery_report(delivery, (path, parts_path, *files))
        judged_on = datetime.now(UTC).date().isoformat()
        page = supplier_verdict(delivery, language, judged_on)
        report.attach("supplier.html", page.html().encode())
        return report

    run = run_command(out, record, work, relative_to=None, begin=begin)
    progress(3, 3, "done")
    return run


def _demand_of_sheet(path: Path, returned: SupplierSpecification) -> Demand:
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
