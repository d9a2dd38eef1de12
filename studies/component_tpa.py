"""Which forces does a source bring into any car, and what will it sound like in another one?

Hammer tests and runs of a source in situ give its blocked forces, which do not depend on the
receiver. They are validated with sensors that the inversion left out, with hits on the source, and
at the ears. Then the free source is joined to the functions and mounts of another receiver, to
predict its sound there. Without --test a virtual drive unit is measured and compared with its
truth. docs/validation.md has the errors of many virtual units.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from deboom.bench.choices import CalibrationLevel
from deboom.bench.component import ComponentPlan
from deboom.bench.component_writer import write_component_test
from deboom.errors import InputError
from deboom.files.component_test import read_component_test, read_receiver
from deboom.measurement.component_tpa import ComponentTpa, InReceiver, component_tpa, in_receiver
from deboom.pages.component_tpa import Measured, Truth, component_tpa_report
from deboom.physics.force_inversion import CROSS_VALIDATED, PLAIN, Choice, Inversion
from deboom.progress import counted, progress_bar
from deboom.report import Report
from deboom.runs.options import Level, Seed

STEPS = 4
RULES = {
    "cross-validation": CROSS_VALIDATED,
    "l-curve": Inversion(amount=Choice.L_CURVE),
    "none": PLAIN,
}
"""Ways to invert, as the option names them."""


@dataclass(frozen=True)
class Options:
    """Which source was tested, and where it goes."""

    seed: Seed = 1
    level: Level = CalibrationLevel.C2
    test: Annotated[Path | None, Option(help="Folder with component.toml.")] = None
    receiver: Annotated[
        Path | None, Option(help="Folder with receiver.toml: another receiver for the source.")
    ] = None
    regularisation: Annotated[
        str,
        Option(help="Rule that chooses the regularisation: cross-validation, l-curve or none."),
    ] = "cross-validation"
    unmeasured_point: Annotated[
        bool,
        Option(help="Without --test: add a bracket between source and car that is not measured."),
    ] = False
    airborne: Annotated[
        float,
        Option(
            help="Without --test: energy through the air over energy through the structure [1]."
        ),
    ] = 0.0

    def __post_init__(self) -> None:
        if self.regularisation not in RULES:
            raise InputError(
                f"--regularisation {self.regularisation}: use one of {', '.join(RULES)}"
            )
        if self.test is None and self.receiver is not None:
            raise InputError("--receiver needs --test, the source that is put into it")


def prepare(options: Options) -> Inversion:
    """Return the rule of the inversion."""
    return RULES[options.regularisation]


def run(rule: Inversion, options: Options) -> Report:
    """Measure or read a test, analyse it, and report."""
    started = time.perf_counter()
    with progress_bar("component TPA") as bar:
        step = counted(bar, STEPS)
        if options.test is not None:
            step("reading the test")
            measured = analysed(options.test, options.receiver, rule, options.seed)
            return component_tpa_report(measured, time.perf_counter() - started)
        step("measuring a virtual drive unit")
        plan = ComponentPlan(
            unmeasured_point=float(options.unmeasured_point), airborne=options.airborne
        )
        with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
            folder = Path(scratch) / "test"
            write_component_test(folder, options.seed, options.level, plan, truth_seed=options.seed)
            step("inverting")
            started = time.perf_counter()
            measured = analysed(folder, folder / "receiver", rule, options.seed, has_truth=True)
        return component_tpa_report(measured, time.perf_counter() - started)


def analysed(
    folder: Path, receiver: Path | None, rule: Inversion, seed: int, *, has_truth: bool = False
) -> Measured:
    """Read a test, invert it, and put the source into the other receiver."""
    test = read_component_test(folder)
    result = component_tpa(test, rule, seed=seed)
    moved: tuple[InReceiver, ...] = ()
    inputs = test.input_files
    if receiver is not None:
        other = read_receiver(receiver)
        moved = in_receiver(result, other)
        inputs += other.input_files
    return Measured(
        result, moved, _truth(folder, result) if has_truth else {}, () if has_truth else inputs
    )


def _truth(folder: Path, result: ComponentTpa) -> dict[str, Truth]:
    """Read what the bench knows, of the stated loads and on the lines of each run."""
    truth_of_run = {}
    for run in result.runs:
        with np.load(folder / "truth" / f"{run.name.replace(' ', '_')}.npz") as truth:
            loads = truth["blocked"].reshape(len(run.frequency), -1, 6)
            stated = len(result.test.points[0].motions)
            truth_of_run[run.name] = Truth(
                loads[:, :, :stated].reshape(len(loads), -1),
                truth["pressure"],
                truth["second_pressure"],
            )
    return truth_of_run
