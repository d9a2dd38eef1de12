"""The mount supplier's sheet, and its way back.

`deboom report RUN --supplier` on a run of `studies/front.py` with a fifth of its budget
(60 × 40 designs, prescribed motion), seed 1. Deliveries of 60 strut mounts are drawn about the
band, from capable to hopeless; their true stiffness at the state of the sheet comes from the
bench's law, the supplier reads it with an expanded uncertainty of 2 % and fills in the workbook,
which is read back and judged. A verdict is wrong where a part passes whose true stiffness lies
outside of the band, or fails inside.

On the machine the preload rises from zero, as the torque of a run-up does: the rubber of the bench
remembers 0.25 mm of static deflection, and a machine that came down from above, or one without
memory, would measure 4 to 6 % more. One axis moves there, in the vehicle all do.
"""

import tempfile
import time
from pathlib import Path

import numpy as np
import openpyxl

from claims import Claim, at_most, draws
from deboom.bench.powertrain import (
    load_bench,
    operating_stiffness,
    play_operator,
    static_deflection,
)
from deboom.files.acceptance import read_measured_sheet, read_specification
from deboom.runs.runner import load_study, run_study
from deboom.runs.supplier_sheets import supplier_sheets
from deboom.supplier.delivery import Demand, PartVerdict, judged_delivery
from deboom.supplier.sources import SheetFiles
from deboom.vehicles.booming_model import Motion

STUDIES = Path(__file__).parents[2] / "studies"
DELIVERIES, PARTS = draws(60), 60
UNCERTAINTY = 0.02


def claims() -> list[Claim]:
    """Write sheets of a small run, compare their numbers, and judge deliveries."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        budget = {"generations": 40, "population": 60, "motion": Motion.prescribed, "with_": "none"}
        run = run_study(load_study(STUDIES / "front.py"), out, budget)
        box = {"front": run, "motion": Motion.prescribed}
        files = SheetFiles(box=run_study(load_study(STUDIES / "solution_box.py"), out, box))
        begin = time.perf_counter()
        written = supplier_sheets(
            run, anonymous=True, out=out / "sheets", studies=STUDIES, files=files
        )
        seconds = time.perf_counter() - begin
        workbook = next(p for p in written.files if p.name == "supplier_sheet_TSM_anonymous.xlsx")
        path = out / "filled.xlsx"
        in_newtons = _deliveries(workbook, path, with_today=False)
        as_ratio = _deliveries(workbook, path, with_today=True)
        errors = _errors_of_today([p for p in written.files if p.suffix == ".xlsx"])
    inside = sum(abs(error) <= stated for error, stated in errors.values())
    return [
        at_most("written, the model built again [s]", 30, seconds, 1),
        Claim(
            "today's |K| of EnM, GeM and TSM on a machine whose preload rises from zero, against "
            "the bench's law: error (stated ± 95 %) [%]",
            "all inside",
            f"{inside} of {len(errors)} inside: "
            + ", ".join(f"{n} {e:+.1f} ({s:.1f})" for n, (e, s) in errors.items()),
            inside == len(errors),
        ),
        *(
            at_most(
                f"{DELIVERIES} deliveries of {PARTS} parts against the band {how}: passed or "
                "failed wrongly; undecided [% of the parts]",
                [2.5, np.inf],
                shares,
            )
            for how, shares in (
                ("in N/mm", in_newtons),
                ("as true ratio to today's part, three readings of that one", as_ratio),
            )
        ),
    ]


def _true_stiffness(name: str, force: float, amplitude: float, frequency: float) -> float:
    """|K| of today's part by the bench's law on a machine: preload raised, one axis moves [N/m]."""
    body = load_bench().powertrain
    mount, _, axis = name.partition(" ")
    place = body.blocks[[m.name for m in body.mounts].index(mount)].start + "xyz".index(axis)
    load = np.zeros((1201, 6))
    load[:, 4] = np.arange(1201.0)
    deflection = static_deflection(body, load)
    static = body.laws[place].static_force(deflection[:, place])
    row = int(np.argmin(np.abs(static - force)))
    moved = np.zeros((1, deflection.shape[1]))
    moved[0, place] = amplitude
    remembered = play_operator(deflection, body.play)[[row]]
    return float(abs(operating_stiffness(body, remembered, moved, np.array([frequency]))[0, place]))


def _errors_of_today(workbooks: list[Path]) -> dict[str, tuple[float, float]]:
    """Error of today's stiffness by direction, and what the sheet states for it [%]."""
    errors = {}
    for path in workbooks:
        table = openpyxl.load_workbook(path)["data block"]
        header, *rows = ([cell.value for cell in row] for row in table)
        stated = {row[0]: row[header.index("today ± 95 % [%]")] for row in rows}
        for requirement in read_specification(path).directions:
            if requirement.today_n_per_mm is not None and not requirement.name.startswith("Du "):
                state = (
                    requirement.preload_n,
                    1e-3 * requirement.amplitude_mm,
                    requirement.frequency_hz,
                )
                true = 1e-3 * _true_stiffness(requirement.name, *state)
                error = 100.0 * (requirement.today_n_per_mm / true - 1.0)
                errors[requirement.name] = (error, float(stated[requirement.name]))
    return errors


def _deliveries(workbook: Path, path: Path, *, with_today: bool) -> tuple[float, float]:
    """Return the shares of wrongly judged and of undecided parts [%]."""
    sheet = read_specification(workbook)
    must = sheet.musts["x"]
    state = must.preload_n, 1e-3 * must.amplitude_mm, must.frequency_hz
    true = 1e-3 * _true_stiffness(must.name, *state)
    reference = true if with_today else must.today_n_per_mm
    lower, upper = must.lower, must.upper
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    random = np.random.default_rng(20)
    book = openpyxl.load_workbook(workbook)
    table = book["measured"]
    header, state = ([cell.value for cell in table[row]] for row in (1, 2))
    part, value = header.index("part"), header.index("|K| [N/mm]")
    wrong = undecided = 0
    for _ in range(DELIVERIES):
        centre = middle + half * random.uniform(-1.2, 1.2)
        stiffness = reference * random.normal(centre, half / random.uniform(2.0, 5.0), PARTS)
        pieces = np.array([*stiffness, *([true] * 3 if with_today else [])])
        read = pieces * (1.0 + 0.5 * UNCERTAINTY * random.standard_normal(pieces.size))
        table.delete_rows(2, table.max_row)
        for number, reading in enumerate(read):
            row = list(state)
            row[part] = f"P{number}" if number < PARTS else "today"
            row[part + 1], row[value] = "B1", float(reading)
            table.append(row)
        book.save(path)
        parts = read_measured_sheet(path, read_specification(path))
        delivery = judged_delivery(Demand.of_sheet(sheet, None), parts, None, UNCERTAINTY, seed=1)
        inside = (lower * reference <= stiffness) & (stiffness <= upper * reference)
        for judged, good in zip(delivery.parts, inside, strict=True):
            undecided += judged.verdict is PartVerdict.undecided
            wrong += judged.verdict is (PartVerdict.failed if good else PartVerdict.passed)
    scale = 100.0 / (DELIVERIES * PARTS)
    return wrong * scale, undecided * scale
