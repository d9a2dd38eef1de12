"""What turns in a running compressor, and the sheet for its supplier."""

from __future__ import annotations

import json
import math
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from enum import Enum
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_operation import OperationPlan
from deboom.bench.compressor_truth import CalibrationLevel, CompressorCase, CompressorPlan
from deboom.bench.compressor_writer import write_operating_test
from deboom.compressor.acceptance import (
    DYNAMIC,
    STATIC,
    ComponentLimits,
    Decision,
    Verdict,
    component_verdicts,
    overall,
)
from deboom.compressor.hose_presence import HoseReaction, hose_reactions
from deboom.compressor.identify import (
    Identification,
    IdentifiedCompressor,
    IdentifyOptions,
    identified_compressor,
    identify,
)
from deboom.compressor.routes import (
    CalibratedMeasurementRoute,
    CalibratedModelRoute,
    MeasuredRoute,
    UpdatedRoute,
)
from deboom.compressor.sources import PASCAL_PER_BAR, case_name
from deboom.compressor.unbalance import (
    RouteResult,
    Unbalance,
    UnbalanceOptions,
    unbalance,
)
from deboom.errors import InputError
from deboom.files.compressor_model import compressor_document, read_compressor_model
from deboom.files.operating_test import read_operating_test
from deboom.files.run_folder import environment_record, hash_files
from deboom.files.tables import workbook_bytes
from deboom.measurement.compressor_test import HoseState, OperatingTest
from deboom.plot import DotPanel, MaskedPanel
from deboom.plot.style import VEHICLE_PALETTE, signed
from deboom.report.page import Headline, Page, Picture, Section, Table, render_page
from deboom.study.compressor_identification import in_words
from deboom.study.pngs import dot_panels, masked_panels
from deboom.study.progress import Progress, counted
from deboom.study.result import Scalar, StudyResult
from deboom.study.runner import PACKAGES, command_of, run_command

if TYPE_CHECKING:
    from deboom.compressor.unbalance import RouteResult, SweepUnbalance

TRUTH_FILE = Path("truth") / "operation.json"
BANDS = ((20.0, 50.0), (50.0, 150.0))
"""Where line-by-line errors are stated: around the rigid-body modes, and above them [Hz]."""
SAME_LINE = 1e-6
"""Largest relative distance of a line of a sweep from one of the truth [1]."""


@dataclass(frozen=True, eq=False)
class UnbalanceTruth:
    """What truly turns and pushes.

    Parameters
    ----------
    path : Path
        Where it was read.
    static, dynamic : complex
        Of all sources together [kg m, kg m²].
    loads : mapping of str to array, shape (n_frequency, 6)
        Sweep → load at the virtual point at its lines, gas included [N, N m]; sweeps over time
        have none.
    lines : mapping of str to array, shape (n_frequency,)
        Sweep → its lines [Hz].
    """

    path: Path
    static: complex
    dynamic: complex
    loads: Mapping[str, ComplexArray]
    lines: Mapping[str, RealArray]

    def load_of(self, sweep: SweepUnbalance) -> ComplexArray | None:
        """Return the load at the lines of a sweep, shape (n_frequency, 6) [N, N m].

        None where it is not known there: nothing is interpolated.
        """
        if sweep.sweep not in self.loads:
            return None
        lines = self.lines[sweep.sweep]
        places = np.argmin(np.abs(lines[:, np.newaxis] - sweep.frequency), axis=0)
        if not np.allclose(lines[places], sweep.frequency, rtol=SAME_LINE, atol=0.0):
            return None
        return np.asarray(self.loads[sweep.sweep][places])


@dataclass(frozen=True)
class RouteErrors:
    """How far a route is from the truth, and y from z, rms over lines, sweeps and both directions.

    Parameters
    ----------
    static, dynamic : tuple of float
        One per band of `BANDS`, relative to the true unbalance [1]; the truth includes the rotating
        gas force, which passes as unbalance. Not a number where no line lies in the band.
    static_mismatch, dynamic_mismatch : tuple of float
        Of y and z, relative to the true unbalance [1].
    """

    static: tuple[float, ...]
    dynamic: tuple[float, ...]
    static_mismatch: tuple[float, ...]
    dynamic_mismatch: tuple[float, ...]


def read_unbalance_truth(folder: Path) -> UnbalanceTruth | None:
    """Read the truth beside a virtual operating test; None where there is none.

    Raises
    ------
    InputError
        A truth file that cannot be read.
    """
    path = folder / TRUTH_FILE
    if not path.is_file():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        static = complex(*content["static_unbalance_kg_m"])
        dynamic = complex(*content["dynamic_unbalance_kg_m2"])
        loads, lines = {}, {}
        for number, name in enumerate(content["sweeps"]):
            with np.load(path.parent / f"{number}.npz") as arrays:
                loads[str(name)] = arrays["load"]
                lines[str(name)] = arrays["frequency"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} is no truth of a running compressor: {error}") from None
    return UnbalanceTruth(path, static, dynamic, loads, lines)


def route_errors(result: RouteResult, truth: UnbalanceTruth) -> RouteErrors:
    """Compare a route with the truth, line by line.

    Parameters
    ----------
    result : RouteResult
    truth : UnbalanceTruth
        Of the same sweeps.

    Returns
    -------
    RouteErrors
    """
    rows = [_in_band(result, truth, low, high) for low, high in BANDS]
    return RouteErrors(*(tuple(column) for column in zip(*rows, strict=True)))


def _in_band(
    result: RouteResult, truth: UnbalanceTruth, low: float, high: float
) -> tuple[float, float, float, float]:
    """Errors of static and dynamic unbalance, then mismatch of y and z of both."""
    errors: tuple[list[ComplexArray], ...] = ([], [])
    apart: tuple[list[ComplexArray], ...] = ([], [])
    for sweep in result.sweeps:
        known = truth.load_of(sweep)
        if known is None:
            continue
        band = (sweep.frequency >= low) & (sweep.frequency <= high)
        square = (2 * np.pi * sweep.frequency[band]) ** 2
        load = known[band]
        for place, curve, true, size in (
            (0, sweep.static, load[:, 1] / square, abs(truth.static)),
            (1, sweep.dynamic, load[:, 5] / square, abs(truth.dynamic)),
        ):
            from_y, from_z = curve.from_y.value[band], curve.from_z.value[band]
            errors[place].extend([(from_y - true) / size, (from_z - true) / size])
            apart[place].append((from_y - from_z) / size)
    return _rms(errors[0]), _rms(errors[1]), _rms(apart[0]), _rms(apart[1])


def _rms(parts: list[ComplexArray]) -> float:
    values = np.concatenate(parts) if parts else np.empty(0)
    return float(np.sqrt(np.mean(np.abs(values) ** 2))) if values.size else math.nan


STEPS = 12
"""Of `measured_unbalance`, for progress."""
MODEL_FILE = "compressor_model"
"""Stem of the file of an identified compressor in a run."""
AUTOMATIC = "auto"
"""Route d, or e where the mounts have changed, no hose is seen and the hammer test has no alarm."""


@dataclass(frozen=True)
class UnbalancePlan:
    """What is asked of an operating test.

    Parameters
    ----------
    route : str
        Letter of the route whose results are headline and verdict, or `AUTOMATIC`.
    identify : IdentifyOptions
        Of the hammer test.
    unbalance : UnbalanceOptions
        Of the sweeps.
    limits : ComponentLimits or None
        To be judged; None where there are none.
    identified : Path or None
        Run of ``deboom identify``, or its compressor_model.json: its lines are fitted again, and
        the hammer test must be the one that it was made from.
    """

    route: str = AUTOMATIC
    identify: IdentifyOptions = field(default_factory=lambda: IdentifyOptions(held_out=0))
    unbalance: UnbalanceOptions = field(default_factory=UnbalanceOptions)
    limits: ComponentLimits | None = None
    identified: Path | None = None


@dataclass(frozen=True, eq=False)
class MeasuredUnbalance:
    """One running compressor, evaluated.

    Parameters
    ----------
    found : Unbalance
    kept : IdentifiedCompressor
        Of its hammer test.
    with_hoses : RouteResult or None
        The chosen route on the sweeps with the hoses of the vehicle (thesis, figure 62); None where
        there are none besides those of `found`.
    reactions : tuple of HoseReaction
        Of the hoses, one per pressure with both kinds of hoses.
    limits : ComponentLimits or None
    verdicts : tuple of Verdict
        One per limit.
    truth : UnbalanceTruth or None
        None where it is not known.
    seconds : float
        From the files to the verdicts [s].
    """

    found: Unbalance
    kept: IdentifiedCompressor
    with_hoses: RouteResult | None
    reactions: tuple[HoseReaction, ...]
    limits: ComponentLimits | None
    verdicts: tuple[Verdict, ...]
    truth: UnbalanceTruth | None
    seconds: float

    @property
    def test(self) -> OperatingTest:
        """What was measured."""
        return self.found.test

    @property
    def mounts_changed(self) -> str:
        """``yes`` or ``no``; ``unknown`` with hoses in the data, which look like other mounts."""
        if self.found.hoses_seen:
            return "unknown"
        return "yes" if self.found.state.changed else "no"

    @property
    def mount_state(self) -> str:
        """What the sweeps say of the mounts, in words."""
        if self.mounts_changed == "unknown":
            return (
                "Whether the mounts run in another state than they were struck in cannot be told: "
                "hoses are joined or visible, and push back like other mounts."
            )
        return self.found.state.statement

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, limits and truth included."""
        more = [one.path for one in (self.limits, self.truth) if one is not None]
        return (*self.test.input_files, *more)


def read_operation(folder: Path) -> OperatingTest:
    """Read an operating test.

    Raises
    ------
    InputError
        A folder that holds no test that can be read.
    """
    if not folder.is_dir():
        raise InputError(
            f"{folder}: there is no such folder; `deboom bench operation {folder}` writes a "
            "virtual test"
        )
    return read_operating_test(folder)


def measured_unbalance(
    folder: Path, plan: UnbalancePlan, step: Callable[[str], None]
) -> MeasuredUnbalance:
    """Evaluate the operating test of a folder.

    Parameters
    ----------
    folder : Path
        Holds ``operation.toml``.
    plan : UnbalancePlan
    step : callable of str
        Told what is being done.

    Returns
    -------
    MeasuredUnbalance

    Raises
    ------
    InputError
        A test that cannot be read, identified or evaluated, a route that was not computed.
    """
    begin = time.perf_counter()
    with threadpool_limits(1):  # its matrices are too small to share
        step("reading")
        test = read_operation(folder)
        truth = read_unbalance_truth(folder)
        hashes = hash_files(test.hammer.input_files, folder)
        options = _identify_options(plan, hashes)
        hammer = identify(test.hammer, options, step, hoses=test.hoses)
        kept = identified_compressor(hammer, options.bands, hashes)
        found = with_route(unbalance(test, hammer, plan.unbalance, step), plan.route)
        step("hoses")
        with_hoses = _with_hoses(test, hammer, found)
        reactions = _reactions(found, with_hoses)
        verdicts = () if plan.limits is None else component_verdicts(found, kept, plan.limits)
    seconds = time.perf_counter() - begin
    return MeasuredUnbalance(
        found, kept, with_hoses, reactions, plan.limits, verdicts, truth, seconds
    )


def _identify_options(plan: UnbalancePlan, hashes: Mapping[str, str]) -> IdentifyOptions:
    """Take over the lines of an earlier identification of the same hammer test."""
    if plan.identified is None:
        return plan.identify
    path = plan.identified
    path = path / f"{MODEL_FILE}.json" if path.is_dir() else path
    earlier = read_compressor_model(path)
    if sorted(earlier.inputs_sha256.values()) != sorted(hashes.values()):
        raise InputError(
            f"{path} was identified from another hammer test than that of these sweeps: identify "
            "the test in their folder, or leave out --identified"
        )
    return replace(plan.identify, bands=earlier.bands)


def with_route(found: Unbalance, wanted: str) -> Unbalance:
    """Choose the route that counts.

    Parameters
    ----------
    found : Unbalance
    wanted : str
        Its letter, or `AUTOMATIC`.

    Returns
    -------
    Unbalance

    Raises
    ------
    InputError
        A letter that no route has.
    """
    letters = [result.route.letter for result in found.routes]
    if wanted == AUTOMATIC:
        # an update of the mounts is worth as much as the model that it updates, and hoses that
        # push back look like other mounts
        sound = not (found.identification.alarms or found.hoses_seen)
        updated = found.state.changed and sound and "e" in letters
        wanted = "e" if updated else found.chosen.route.letter
    if wanted not in letters:
        raise InputError(f"there is no route '{wanted}': choose {AUTOMATIC}, {', '.join(letters)}")
    route = found.by_letter(wanted).route
    return replace(found, options=replace(found.options, chosen=route))


def _with_hoses(
    test: OperatingTest, hammer: Identification, found: Unbalance
) -> RouteResult | None:
    """Evaluate the sweeps with the hoses of the vehicle by the chosen route."""
    used = {sweep.hoses for sweep in found.chosen.sweeps}
    if HoseState.STANDARD in used or not test.with_hoses(HoseState.STANDARD):
        return None
    route = found.chosen.route
    options = replace(found.options, routes=(route,), chosen=route, hoses=HoseState.STANDARD)
    return unbalance(test, hammer, options).chosen


def _reactions(found: Unbalance, with_hoses: RouteResult | None) -> tuple[HoseReaction, ...]:
    """Look for the reaction of the hoses where a pressure was run with both kinds."""
    if with_hoses is None:
        return ()
    both = {sweep.pressure for sweep in with_hoses.sweeps}
    if not both & {sweep.pressure for sweep in found.chosen.sweeps}:
        return ()
    state = found.state

    def change(frequency: RealArray) -> ComplexArray:
        return np.asarray(np.interp(frequency, state.frequency, state.curve))

    return hose_reactions(found.test, found.identification, change=change, sense=found.sense.sense)


COMPARED = UnbalanceOptions(routes=(MeasuredRoute(), CalibratedMeasurementRoute(), UpdatedRoute()))
"""Routes of all compressors but the first."""
OUT_OF_CLASS = replace(COMPARED, routes=(*COMPARED.routes, CalibratedModelRoute()))
"""Those of softening mounts and a flexible receiver."""
STORAGE, LOSS = 0.9, 1.1
"""Real and imaginary part of the mounts' stiffness in operation over that struck, where changed."""


class MountCase(Enum):
    """What the mounts and what carries them are like."""

    UNCHANGED = "as struck"
    CHANGED = "−10 % / +10 %"
    SOFTENING = "softening"
    RECEIVER = "flexible receiver"


@dataclass(frozen=True)
class CaseErrors:
    """One virtual compressor in one state, by one route.

    Parameters
    ----------
    seed : int
    case : MountCase
    letter : str
        Of the route.
    errors : RouteErrors
        Line by line.
    static, dynamic : float
        Relative errors of the fit over all sweeps [1].
    gas_moment : float
        The same of the moment of the gas, the worse of all pressures [1].
    alarmed : bool
        Whether hammer test or sweeps gave an alarm.
    """

    seed: int
    case: MountCase
    letter: str
    errors: RouteErrors
    static: float
    dynamic: float
    gas_moment: float
    alarmed: bool


@dataclass(frozen=True, eq=False)
class VirtualRuns:
    """What a study of virtual compressors shows.

    Parameters
    ----------
    first : MeasuredUnbalance
        First compressor, mounts as struck.
    changed : Unbalance
        The same, mounts changed.
    changed_truth : UnbalanceTruth
    cases : tuple of CaseErrors
        Of all compressors, states and routes.
    """

    first: MeasuredUnbalance
    changed: Unbalance
    changed_truth: UnbalanceTruth
    cases: tuple[CaseErrors, ...]


def operation_plan(seed: int, case: MountCase) -> OperationPlan:
    """Plan the virtual test: seed 1 has the mounts of the thesis's table 11."""
    compressor = CompressorPlan(
        case=CompressorCase.TABLE11 if seed == 1 else CompressorCase.RANDOM,
        softening=case is MountCase.SOFTENING,
        flexible_receiver=case is MountCase.RECEIVER,
    )
    plan = OperationPlan(compressor, softening=case is MountCase.SOFTENING)
    if case is MountCase.CHANGED:
        return replace(plan, mount_storage=STORAGE, mount_loss=LOSS)
    return plan


def virtual_runs(
    seeds: Sequence[int],
    level: CalibrationLevel,
    plan: UnbalancePlan,
    progress: Progress,
    *,
    workers: int,
    special: bool = True,
) -> VirtualRuns:
    """Measure virtual compressors and evaluate each in both states.

    Parameters
    ----------
    seeds : sequence of int
        One compressor each.
    level : CalibrationLevel
        Of sensors and impacts.
    plan : UnbalancePlan
        Of the first compressor.
    progress : callable
    workers : int
        Processes beside this one; 0 does all here. The result is the same.
    special : bool
        The first compressor on a flexible receiver and with softening mounts as well.

    Returns
    -------
    VirtualRuns
    """
    pair = (MountCase.UNCHANGED, MountCase.CHANGED)
    tasks = [_Task(seed, level, pair, COMPARED) for seed in seeds[1:]]
    if special:
        tasks += [
            _Task(seeds[0], level, (case,), OUT_OF_CLASS)
            for case in (MountCase.SOFTENING, MountCase.RECEIVER)
        ]
    total = len(tasks) + len(pair)
    with (
        _spread(tasks, workers) as others,
        tempfile.TemporaryDirectory(prefix="deboom-") as scratch,
    ):
        folders = []
        for case in pair:
            folder = Path(scratch) / case.name.lower()
            write_operating_test(folder, seeds[0], level, operation_plan(seeds[0], case))
            folders.append(folder)
        progress(0, total, "first compressor")
        first = measured_unbalance(folders[0], plan, lambda _: None)
        assert first.truth is not None
        progress(1, total, "first compressor, mounts changed")
        struck = first.found.identification
        changed, truth = _evaluated(folders[1], struck, plan.unbalance)
        cases = _rows(seeds[0], MountCase.UNCHANGED, first.found, first.truth)
        cases += _rows(seeds[0], MountCase.CHANGED, changed, truth)
        for number, rows in enumerate(others, start=len(pair)):
            progress(number, total, "other compressors")
            cases += rows
    progress(total, total, "done")
    return VirtualRuns(first, changed, truth, tuple(cases))


def _evaluated(
    folder: Path, struck: Identification | None, options: UnbalanceOptions
) -> tuple[Unbalance, UnbalanceTruth]:
    """Read and evaluate a test; identify its hammer test unless that was done."""
    test, truth = read_operating_test(folder), read_unbalance_truth(folder)
    assert truth is not None
    with threadpool_limits(1):
        if struck is None:
            struck = identify(test.hammer, IdentifyOptions(held_out=0), hoses=test.hoses)
        return unbalance(test, struck, options), truth


@dataclass(frozen=True)
class _Task:
    """One compressor in several states."""

    seed: int
    level: CalibrationLevel
    cases: tuple[MountCase, ...]
    options: UnbalanceOptions


def _carried_out(task: _Task) -> list[CaseErrors]:
    """Measure and evaluate; states that differ in operation only share their hammer test."""
    rows: list[CaseErrors] = []
    struck: Identification | None = None
    with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
        for case in task.cases:
            folder = Path(scratch) / case.name.lower()
            write_operating_test(folder, task.seed, task.level, operation_plan(task.seed, case))
            found, truth = _evaluated(folder, struck, task.options)
            struck = found.identification
            rows += _rows(task.seed, case, found, truth)
    return rows


def _rows(seed: int, case: MountCase, found: Unbalance, truth: UnbalanceTruth) -> list[CaseErrors]:
    alarmed = bool(found.alarms)
    return [
        CaseErrors(
            seed,
            case,
            result.route.letter,
            route_errors(result, truth),
            abs(result.sources.static.value / truth.static - 1),
            abs(result.sources.dynamic.value / truth.dynamic - 1),
            _gas_error(result, truth),
            alarmed,
        )
        for result in found.routes
    ]


def _gas_error(result: RouteResult, truth: UnbalanceTruth) -> float:
    """Of the moment of the gas, which is all that acts about x; the worse pressure."""
    true = {
        sweep.pressure: complex(truth.loads[sweep.sweep][0, 3])
        for sweep in result.sweeps
        if sweep.sweep in truth.loads
    }
    return max(
        abs(gas.moment.value / true[gas.pressure] - 1)
        for gas in result.sources.gas
        if gas.pressure in true
    )


@contextmanager
def _spread(tasks: Sequence[_Task], workers: int) -> Iterator[Iterable[list[CaseErrors]]]:
    """Work tasks off in processes, or here; results come in the order of the tasks."""
    if workers == 0 or not tasks:
        yield map(_carried_out, tasks)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield pool.map(_carried_out, tasks)


AFFORDABLE = 20
"""Repetitions beyond which a part counts as lying on its limit."""


def verdict_table(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Write one row per limit.

    Parameters
    ----------
    verdicts : sequence of Verdict

    Returns
    -------
    DataFrame
        Values in the unit of each row; from and to are the value, guard band to each side.
    """
    rows = []
    for verdict in verdicts:
        unit, size = unit_of(verdict)
        low, high = verdict.bounds.low, verdict.bounds.high
        rows.append(
            {
                "characteristic": _place(verdict),
                "unit": unit,
                "at least": low / size if np.isfinite(low) else np.nan,
                "at most": high / size if np.isfinite(high) else np.nan,
                "measured": verdict.value / size,
                "guard band ±": verdict.pass_guard / size,
                "from": verdict.interval[0] / size,
                "to": verdict.interval[1] / size,
                "verdict": verdict.decision.value,
            }
        )
    return pd.DataFrame(rows)


def shown_verdicts(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Write the same for a page: four columns of words.

    Parameters
    ----------
    verdicts : sequence of Verdict

    Returns
    -------
    DataFrame
        Characteristic, limit, measured value with its guard band, verdict.
    """
    rows = []
    for verdict in verdicts:
        unit, size = unit_of(verdict)
        digits = decimals(verdict.pass_guard / size)
        bounds = [
            f"{sign} {bound / size:.5g}"
            for sign, bound in (("≥", verdict.bounds.at_least), ("≤", verdict.bounds.at_most))
            if bound is not None
        ]
        value, guard = verdict.value / size, verdict.pass_guard / size
        rows.append(
            {
                "characteristic": _place(verdict),
                "limit": f"{', '.join(bounds)} {unit}",
                "measured ± guard band": f"{value:.{digits}f} ± {guard:.{digits}f} {unit}",
                "verdict": verdict.decision.value,
            }
        )
    return pd.DataFrame(rows)


def decimals(uncertainty: float) -> int:
    """Decimals that show two digits of an uncertainty."""
    return max(1 - math.floor(math.log10(uncertainty)), 0)


def _place(verdict: Verdict) -> str:
    """Name the characteristic, and the line that decides where it has several."""
    if not verdict.line or "–" not in verdict.name or verdict.doubt:
        return verdict.name
    return f"{verdict.name}; decided at {verdict.line:.3g} Hz"


def unit_of(verdict: Verdict) -> tuple[str, float]:
    """Return the unit of a verdict's table, and its size in SI."""
    if verdict.name == STATIC:
        return "g mm", 1e-6
    if verdict.name == DYNAMIC:
        return "g mm²", 1e-9
    return ("N m/rad", 1.0) if "stiffness r" in verdict.name else ("N/mm", 1e3)


def open_points(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Say what was not decided, and which measurement would decide it.

    Parameters
    ----------
    verdicts : sequence of Verdict

    Returns
    -------
    DataFrame
        One row per limit that is undecided.
    """
    rows = [
        {"not decided": _place(verdict), "what would decide it": _remedy(verdict)}
        for verdict in verdicts
        if verdict.decision is Decision.UNDECIDED
    ]
    return pd.DataFrame(rows, columns=["not decided", "what would decide it"])


def _remedy(verdict: Verdict) -> str:
    if verdict.doubt:
        return f"{verdict.doubt[:1].upper()}{verdict.doubt[1:].rstrip('.')}."
    if verdict.repetitions > AFFORDABLE:
        return (
            "The value lies on its limit: no affordable measurement will decide it. Agree on the "
            "limit, or on who bears the uncertainty."
        )
    unit, size = unit_of(verdict)
    guard = verdict.pass_guard / size
    return (
        f"A guard band of ± {verdict.shrinkage * guard:.2g} {unit} instead of ± {guard:.2g}, if "
        f"the value stays: the mean of {verdict.repetitions} set-ups, sensors glued and impacts "
        f"placed anew, or sensors and impacts {1 / verdict.shrinkage:.2g} times better calibrated "
        "and placed."
    )


if TYPE_CHECKING:
    from deboom.study.compressor_unbalance import MeasuredUnbalance

STEM = "supplier_sheet"
WORDS = {
    Decision.PASS: "accepted",
    Decision.FAIL: "rejected",
    Decision.UNDECIDED: "not decided",
}


def component_sheet(measured: MeasuredUnbalance, command: str) -> dict[str, bytes]:
    """Write the page and the workbook for the supplier.

    Parameters
    ----------
    measured : MeasuredUnbalance
        With limits.
    command : str
        That makes the sheet again; empty where the page of a study states it.

    Returns
    -------
    dict of str to bytes
        File name → content.
    """
    assert measured.limits is not None
    conditions = condition_table(measured, command)
    undecided = open_points(measured.verdicts)
    page = Page(
        title=f"Acceptance of {measured.test.name}",
        question=rule(measured),
        headlines=_headlines(measured),
        sections=(
            Section(
                "Limits and verdicts",
                "",
                tables=(
                    Table(
                        shown_verdicts(measured.verdicts),
                        "The part lies above the value less its guard band with a probability of "
                        f"{1 - measured.limits.risk:.2g}, and as surely below the value plus it.",
                    ),
                ),
            ),
            _not_decided(undecided),
            Section(
                "Conditions",
                "",
                tables=(Table(conditions, "How it was measured."),),
            ),
        ),
        compact=True,
    )
    sheets = {
        "verdicts": verdict_table(measured.verdicts),
        "not decided": undecided,
        "conditions": conditions,
    }
    return {
        f"{STEM}.html": render_page(page).encode("utf-8"),
        f"{STEM}.xlsx": workbook_bytes(sheets, page.title),
    }


def _not_decided(undecided: pd.DataFrame) -> Section:
    title = "Not decided, and what would decide it"
    if undecided.empty:
        return Section(title, "Every limit was decided.")
    return Section(title, "", tables=(Table(undecided, "Limits that are open."),))


def rule(measured: MeasuredUnbalance) -> str:
    """State the decision rule with its risk."""
    assert measured.limits is not None
    risk = measured.limits.risk
    return (
        "Decided as ISO 14253-1 has it. A limit is kept where the measured value lies inside it by "
        f"more than the guard band: a part that breaks it passes with at most {risk:.2g} "
        "probability. It is broken where the value lies outside by as much or more. In between, "
        "the measurement proves neither."
    )


def condition_table(measured: MeasuredUnbalance, command: str) -> pd.DataFrame:
    """List under which conditions the values hold, and how they are computed again."""
    found, test = measured.found, measured.test
    alarms = [*measured.kept.alarms, *found.alarms]
    chosen = found.chosen
    sweeps = ", ".join(sweep.sweep for sweep in chosen.sweeps)
    low = min(sweep.speed[0] for sweep in chosen.sweeps)
    high = max(sweep.speed[-1] for sweep in chosen.sweeps)
    hammer = test.hammer
    weighed = "not weighed" if hammer.weighed_mass is None else f"{hammer.weighed_mass:.3f} kg"
    rows = {
        "sweeps": f"{sweeps}; {low:.0f}–{high:.0f} rpm; first order",
        "sense of rotation": found.sense.statement,
        "method": f"in situ, mounted; route {chosen.route.letter}: {chosen.route.title}",
        "hammer test": f"{len(hammer.sensors)} triaxial accelerometers, {len(hammer.impacts)} "
        f"impacts; mass on the scales: {weighed}",
        "unbalance": "about the rotor's axis x, moments about the origin of the position sheet",
        "stiffness": "of the compressor on its mounts, at that origin, at the hammer's amplitude",
        "mounts in operation": measured.mount_state,
        "alarms": " ".join(one for one in alarms if one != found.state.statement) or "none",
        "guard bands": "one-sided normal quantile times the standard deviation of noise, "
        "placement, calibration and state of the mounts together",
    }
    if command:
        rows["command"] = command
    return pd.DataFrame({"condition": list(rows), "in this test": list(rows.values())})


def _headlines(measured: MeasuredUnbalance) -> tuple[Headline, ...]:
    decisions = [verdict.decision for verdict in measured.verdicts]
    return (
        Headline(WORDS[overall(measured.verdicts)], "the part"),
        *(
            Headline(
                f"{decisions.count(decision)} of {len(decisions)}", f"limits: {decision.value}"
            )
            for decision in Decision
        ),
    )


if TYPE_CHECKING:
    from deboom.arrays import RealArray
    from deboom.compressor.sources import UnbalanceCurve
    from deboom.compressor.unbalance import RouteResult, SweepUnbalance, Unbalance
    from deboom.study.compressor_unbalance import MeasuredUnbalance, UnbalanceTruth

SIZES = {STATIC: ("|u| [g mm]", 1e6), DYNAMIC: ("|u_d| [g mm²]", 1e9)}
"""Name of an unbalance → label of its axis, and its unit per SI unit."""
FROM_Y, FROM_Z, TRUTH = "from y", "from z", "truth"
CHANGE = "in operation over struck, minus 1"
WITHOUT_HOSES, WITH_HOSES = "hoses cut off", "hoses of the vehicle"


def figures_of(measured: MeasuredUnbalance) -> dict[str, bytes]:
    """Draw all pictures of one compressor; file stem → PNG."""
    found, chosen = measured.found, measured.found.chosen
    figures = {
        "figure_52_motion": motion(found),
        "figure_61a_static": over_speed(measured, STATIC),
        "figure_61b_dynamic": over_speed(measured, DYNAMIC),
        "figure_61c_forces": forces(chosen),
        "routes": routes(found, measured.truth),
        "mount_state": mount_state(found),
    }
    if measured.with_hoses is not None:
        figures["figure_62_hoses"] = hoses(chosen, measured.with_hoses, measured.truth)
    return figures


def motion(found: Unbalance) -> bytes:
    """Figure 52: acceleration of the virtual point, and what no rigid body explains of it."""
    shown = found.motions[0]
    lines, values = shown.calibrated.frequency, np.abs(shown.calibrated.values)
    left = {
        "places of the sheet": shown.consistency_by_sheet,
        "places the hammer test found": shown.consistency_calibrated,
    }
    return masked_panels(
        [
            MaskedPanel(
                "Acceleration of the virtual point",
                "[m/s²]",
                lines,
                dict(zip(("x", "y", "z"), values.T[:3], strict=True)),
                note=shown.sweep,
            ),
            MaskedPanel(
                "Rotational acceleration",
                "[rad/s²]",
                lines,
                dict(zip(("about x", "about y", "about z"), values.T[3:], strict=True)),
            ),
            MaskedPanel(
                "Share of the channels that no rigid body explains",
                "[%]",
                lines,
                {
                    name: 100 * np.sqrt(np.clip(1 - one.overall**2, 0, None))
                    for name, one in left.items()
                },
                logarithmic=True,
            ),
        ]
    )


def over_speed(measured: MeasuredUnbalance, name: str) -> bytes:
    """Figures 61a and 61b: an unbalance from y and from z, one panel per sweep."""
    label, unit = SIZES[name]
    chosen, limits = measured.found.chosen, measured.limits
    bounds = None
    if limits is not None:
        bounds = limits.static_unbalance if name == STATIC else limits.dynamic_unbalance
    panels = []
    for sweep in chosen.sweeps:
        curve = curve_of(sweep, name)
        curves: dict[str, RealArray] = {
            FROM_Y: unit * np.abs(curve.from_y.value),
            FROM_Z: unit * np.abs(curve.from_z.value),
        }
        curves |= true_curve(measured.truth, sweep, name)
        panels.append(
            MaskedPanel(
                f"{name[0].upper()}{name[1:]}, {sweep.sweep}",
                label,
                sweep.frequency,
                curves,
                ranges={
                    FROM_Y: (unit * curve.from_y.lower, unit * curve.from_y.upper),
                    FROM_Z: (unit * curve.from_z.lower, unit * curve.from_z.upper),
                },
                masked=masks(curve),
                levels={} if bounds is None else {"limit": unit * bounds.high},
                note=f"route {chosen.route.letter}",
            )
        )
    return masked_panels(panels, dashed=(TRUTH,))


def forces(chosen: RouteResult) -> bytes:
    """Figure 61c: what rotor and gas do inside, forces and moments."""
    panels = []
    for what, unit, first, labels in (
        ("Internal forces", "[N]", 0, ("F_x: gas", "F_y: unbalance", "F_z: unbalance")),
        ("Internal moments", "[N m]", 3, ("M_x: gas", "M_y: unbalance", "M_z: unbalance")),
    ):
        for sweep in chosen.sweeps:
            columns = slice(first, first + 3)
            size = np.abs(sweep.load[:, columns]).T
            low, high = sweep.load_lower[:, columns].T, sweep.load_upper[:, columns].T
            panels.append(
                MaskedPanel(
                    f"{what}, {sweep.sweep}",
                    unit,
                    sweep.frequency,
                    dict(zip(labels, size, strict=True)),
                    ranges={name: (low[k], high[k]) for k, name in enumerate(labels)},
                )
            )
    return masked_panels(panels, columns=min(2, len(chosen.sweeps)))


def hoses(without: RouteResult, with_hoses: RouteResult, truth: UnbalanceTruth | None) -> bytes:
    """Figure 62: mean of y and z with the hoses of the vehicle against hoses cut off."""
    panels, pairs = [], _by_pressure(without, with_hoses)
    for name, (label, unit) in SIZES.items():
        for first, second in pairs:
            joined = np.interp(
                first.frequency,
                second.frequency,
                np.abs(curve_of(second, name).mean),
                left=np.nan,
                right=np.nan,
            )
            curves = {
                WITHOUT_HOSES: unit * np.abs(curve_of(first, name).mean),
                WITH_HOSES: unit * joined,
            }
            curves |= true_curve(truth, first, name)
            panels.append(
                MaskedPanel(
                    f"{name[0].upper()}{name[1:]}, {case_name(first.pressure)}",
                    label,
                    first.frequency,
                    curves,
                    masked=masks(curve_of(first, name)),
                )
            )
    return masked_panels(panels, columns=min(2, len(pairs)), dashed=(TRUTH,))


def routes(found: Unbalance, truth: UnbalanceTruth | None, letters: str = "abcde") -> bytes:
    """Compare the routes over the first sweep: mean of y and z."""
    panels = []
    for name, (label, unit) in SIZES.items():
        curves: dict[str, RealArray] = {}
        for result in found.routes:
            if result.route.letter in letters:
                curve = curve_of(result.sweeps[0], name)
                curves[f"{result.route.letter}: {result.route.title}"] = unit * np.abs(curve.mean)
        sweep = found.chosen.sweeps[0]
        curves |= true_curve(truth, sweep, name)
        panels.append(
            MaskedPanel(
                f"{name[0].upper()}{name[1:]}, {sweep.sweep}", label, sweep.frequency, curves
            )
        )
    return masked_panels(panels, dashed=(TRUTH,))


def mount_state(found: Unbalance) -> bytes:
    """Draw the change of the mounts' dynamic stiffness from the hammer test to operation."""
    state = found.state
    half = 2 * state.curve_deviation
    panels = []
    for title, of in (("Real part", np.real), ("Imaginary part", np.imag)):
        value = 100 * of(state.curve)
        panels.append(
            MaskedPanel(
                title,
                "change of stiffness [%]",
                state.frequency,
                {CHANGE: value},
                ranges={CHANGE: (value - 100 * half, value + 100 * half)},
                levels={"as struck": 0.0},
            )
        )
    return masked_panels(panels, columns=2)


def curve_of(sweep: SweepUnbalance, name: str) -> UnbalanceCurve:
    """Return the static or the dynamic unbalance of a sweep."""
    return sweep.static if name == STATIC else sweep.dynamic


def masks(curve: UnbalanceCurve) -> dict[str, npt.NDArray[np.bool_]]:
    """Say which lines cannot be trusted, by reason."""
    return {reason.text: reason.lines for reason in curve.reasons}


def true_curve(
    truth: UnbalanceTruth | None, sweep: SweepUnbalance, name: str
) -> dict[str, RealArray]:
    """Size of the true unbalance in units of `SIZES`, the rotating gas force included, if known."""
    load = None if truth is None else truth.load_of(sweep)
    if load is None:
        return {}
    across = np.abs(load[:, 1 if name == STATIC else 5])
    return {TRUTH: SIZES[name][1] * across / (2 * np.pi * sweep.frequency) ** 2}


def _by_pressure(
    without: RouteResult, with_hoses: RouteResult
) -> list[tuple[SweepUnbalance, SweepUnbalance]]:
    first, second = _widest(without), _widest(with_hoses)
    return [(first[pressure], second[pressure]) for pressure in first if pressure in second]


def _widest(result: RouteResult) -> dict[float, SweepUnbalance]:
    """Take the sweep with the most lines at each pressure."""
    found: dict[float, SweepUnbalance] = {}
    for sweep in result.sweeps:
        known = found.get(sweep.pressure)
        if known is None or sweep.frequency.size > known.frequency.size:
            found[sweep.pressure] = sweep
    return found


CAPTIONS: Mapping[str, str] = {
    "figure_52_motion": "Motion of the compressor over its speed (thesis, figure 52): first "
    "order, at the virtual point, the origin of the position sheet. Below: rms share of the "
    "channels that a rigid body cannot explain; it falls to the noise where the places that the "
    "hammer test found are used.",
    "figure_61a_static": "Static unbalance over speed (thesis, figure 61a), from the load in y "
    "and in z. A rotor makes both curves one horizontal line; a gas force that turns with it "
    "bends both alike at low speed. Shades: confidence bands. Hatched: not to be trusted, for the "
    "reason given.",
    "figure_61b_dynamic": "Dynamic unbalance about the virtual point (thesis, figure 61b), from "
    "the moments about z (y) and about y (z).",
    "figure_61c_forces": "Forces and moments inside (thesis, figure 61c). Unbalance grows with "
    "the square of the speed; the gas along and about x does not. Shades: confidence bands.",
    "figure_62_hoses": "Unbalance as it appears with the hoses of the vehicle against hoses cut "
    "off (thesis, figure 62). The difference is what the hoses push back.",
    "routes": "The routes side by side, first sweep. a: measured apparent mass times acceleration "
    "(thesis). b: model fitted at the virtual point. c: self-calibrated model. d: measured, with "
    "self-calibrated sensors and impacts. e: as c, mounts brought up to date by the sweep itself.",
    "mount_state": "Dynamic stiffness of the mounts in operation over that under the hammer, "
    "minus one, found from the sweeps; shades: two standard deviations. Away from 0 the hammer "
    "test no longer describes the mounts that run.",
    "changed_state": "The same compressor with mounts that changed between hammer and operation. "
    "Route a, as in the thesis's figure 61, goes wrong around the rigid-body modes; route e finds "
    "the change in the sweep and follows.",
    "errors": "Errors of static and dynamic unbalance, line by line, of every virtual compressor; "
    "the bar is the median.",
}


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
        headlines=_headlines_8(measured),
        warnings=(*measured.kept.alarms, *found.alarms, *found.notices),
    )


def _headlines_8(measured: MeasuredUnbalance) -> tuple[Headline, ...]:
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


if TYPE_CHECKING:
    from deboom.compressor.sources import Estimate
    from deboom.compressor.unbalance import RouteResult, SweepUnbalance, Unbalance
    from deboom.study.compressor_unbalance import MeasuredUnbalance

SHOWN = {"kg m": ("g mm", 1e6), "kg m^2": ("g mm²", 1e9), "kg m²": ("g mm²", 1e9)}
"""SI unit → unit of tables, and how many of it."""


def tables_of(measured: MeasuredUnbalance) -> dict[str, pd.DataFrame]:
    """Make all tables of one compressor; file stem → table."""
    found = measured.found
    tables = {
        "sources": source_table(measured),
        "routes": route_table(measured),
        "unexplained": residual_table(found),
        "mask": mask_table(found.chosen),
        "unbalance": pd.concat([curve_table(sweep) for sweep in found.chosen.sweeps]),
        "forces": pd.concat([force_table(sweep) for sweep in found.chosen.sweeps]),
        "motion": motion_table(found),
        "mount_state": state_table(found),
    }
    if measured.reactions:
        tables["hose_reaction"] = reaction_table(measured)
    return tables


def source_table(measured: MeasuredUnbalance) -> pd.DataFrame:
    """Tell what rotor and gas do: the fit over all sweeps by the chosen route."""
    sources = measured.found.chosen.sources
    named: list[tuple[str, Estimate]] = [(STATIC, sources.static), (DYNAMIC, sources.dynamic)]
    for gas in sources.gas:
        where = f", {case_name(gas.pressure)}"
        named += [
            (f"axial gas force{where}", gas.axial),
            (f"gas moment{where}", gas.moment),
            (f"rotating gas force{where}", gas.rotating),
        ]
    rows = []
    for name, estimate in named:
        unit, factor = SHOWN.get(estimate.unit, (estimate.unit, 1.0))
        rows.append(
            {
                "source": name,
                "unit": unit,
                "amplitude": factor * abs(estimate.value),
                "from": factor * estimate.lower,
                "to": factor * estimate.upper,
                "standard deviation": factor * estimate.deviation,
                "phase [°]": float(np.degrees(np.angle(estimate.value))),
            }
        )
    table = pd.DataFrame(rows)
    if measured.truth is not None:
        true = [1e6 * abs(measured.truth.static), 1e9 * abs(measured.truth.dynamic)]
        table["truth"] = [*true, *[np.nan] * (len(rows) - 2)]
    return table


def route_table(measured: MeasuredUnbalance) -> pd.DataFrame:
    """Put the routes side by side: global fit, agreement of y and z, errors where known."""
    rows = []
    for result in measured.found.routes:
        static, dynamic = result.sources.static, result.sources.dynamic
        row: dict[str, str | float] = {
            "route": result.route.letter,
            "what it does": result.route.title,
            "static [g mm]": 1e6 * abs(static.value),
            "± [g mm]": 1e6 * static.deviation,
            "dynamic [g mm²]": 1e9 * abs(dynamic.value),
            "± [g mm²]": 1e9 * dynamic.deviation,
            "residuals over noise [1]": result.sources.reduced_chi,
        }
        for band in BANDS:
            row[f"y/z mismatch {words(band)} [%]"] = 100 * mismatch(result, band)
        if measured.truth is not None:
            errors = route_errors(result, measured.truth)
            for place, band in enumerate(BANDS):
                row[f"error of u {words(band)} [%]"] = 100 * errors.static[place]
                row[f"error of u_d {words(band)} [%]"] = 100 * errors.dynamic[place]
        rows.append(row)
    return pd.DataFrame(rows)


def words(band: tuple[float, float]) -> str:
    """Write a band."""
    return f"{band[0]:g}–{band[1]:g} Hz"


def mismatch(result: RouteResult, band: tuple[float, float]) -> float:
    """Rms over lines and sweeps of |y − z| over their mean, static unbalance [1].

    Not a number where no line lies in the band.
    """
    parts = [
        sweep.static.mismatch[(sweep.frequency >= band[0]) & (sweep.frequency <= band[1])]
        for sweep in result.sweeps
    ]
    values = np.concatenate(parts)
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan


def residual_table(found: Unbalance) -> pd.DataFrame:
    """Say how much of the load no rotor and no gas explains, per band."""
    bands = found.chosen.sources.residual_bands
    return pd.DataFrame(
        {
            "band": [words((one.low, one.high)) for one in bands],
            "unexplained share of the load [%]": [100 * one.share for one in bands],
            "residuals over noise [1]": [one.reduced_chi for one in bands],
        }
    )


def mask_table(chosen: RouteResult) -> pd.DataFrame:
    """List what is not to be trusted, and why."""
    rows = [
        {
            "sweep": sweep.sweep,
            "unbalance": name,
            "why": reason.text,
        }
        for sweep in chosen.sweeps
        for name, curve in (("static", sweep.static), ("dynamic", sweep.dynamic))
        for reason in curve.reasons
    ]
    return pd.DataFrame(rows, columns=["sweep", "unbalance", "why"])


def curve_table(sweep: SweepUnbalance) -> pd.DataFrame:
    """Both unbalances of one sweep line by line, amplitudes."""
    table = {
        "sweep": [sweep.sweep] * sweep.frequency.size,
        "frequency [Hz]": sweep.frequency,
        "speed [rpm]": sweep.speed,
    }
    for name, curve, unit, factor in (
        ("static", sweep.static, "g mm", 1e6),
        ("dynamic", sweep.dynamic, "g mm²", 1e9),
    ):
        for part, values in (
            ("from y", np.abs(curve.from_y.value)),
            ("from z", np.abs(curve.from_z.value)),
            ("mean", np.abs(curve.mean)),
            ("mean from", curve.both.lower),
            ("mean to", curve.both.upper),
        ):
            table[f"{name} {part} [{unit}]"] = factor * values
        table[f"{name} trusted"] = curve.trusted
    return pd.DataFrame(table)


def force_table(sweep: SweepUnbalance) -> pd.DataFrame:
    """Write the load inside, complex, and the band of its amplitudes."""
    table = {
        "sweep": [sweep.sweep] * sweep.frequency.size,
        "frequency [Hz]": sweep.frequency,
    }
    for place, (name, unit) in enumerate(
        [*((f"F_{axis}", "N") for axis in "xyz"), *((f"M_{axis}", "N m") for axis in "xyz")]
    ):
        table[f"{name} real [{unit}]"] = sweep.load[:, place].real
        table[f"{name} imaginary [{unit}]"] = sweep.load[:, place].imag
        table[f"{name} amplitude from [{unit}]"] = sweep.load_lower[:, place]
        table[f"{name} amplitude to [{unit}]"] = sweep.load_upper[:, place]
    return pd.DataFrame(table)


def motion_table(found: Unbalance) -> pd.DataFrame:
    """Acceleration of the virtual point, complex, with its consistency."""
    frames = []
    for motion in found.motions:
        lines = motion.calibrated.frequency
        table = {"sweep": [motion.sweep] * lines.size, "frequency [Hz]": lines}
        for place, name in enumerate(motion.calibrated.channels):
            unit = "m/s²" if place < 3 else "rad/s²"
            table[f"{name} real [{unit}]"] = motion.calibrated.values[:, place].real
            table[f"{name} imaginary [{unit}]"] = motion.calibrated.values[:, place].imag
        table["consistency, sheet [1]"] = motion.consistency_by_sheet.overall
        table["consistency, calibrated [1]"] = motion.consistency_calibrated.overall
        frames.append(pd.DataFrame(table))
    return pd.concat(frames)


def state_table(found: Unbalance) -> pd.DataFrame:
    """Dynamic stiffness in operation over that under the hammer, minus 1, line by line."""
    state = found.state
    return pd.DataFrame(
        {
            "frequency [Hz]": state.frequency,
            "change, real [1]": state.curve.real,
            "change, imaginary [1]": state.curve.imag,
            "deviation [1]": state.curve_deviation,
        }
    )


def reaction_table(measured: MeasuredUnbalance) -> pd.DataFrame:
    """Say per band whether the hoses push back."""
    return pd.DataFrame(
        [
            {
                "pressure [bar]": reaction.pair.pressure / PASCAL_PER_BAR,
                "band": words((band.low, band.high)),
                "reaction over source [%]": 100 * band.share,
                "floor [%]": 100 * band.floor,
                "detected": bool(band.detected),
            }
            for reaction in measured.reactions
            for band in reaction.bands
        ]
    )


if TYPE_CHECKING:
    from pathlib import Path

    from deboom.study.compressor_unbalance import MeasuredUnbalance


def unbalance_result(
    measured: MeasuredUnbalance,
    *,
    command: str = "",
    inputs: tuple[Path, ...] = (),
    more_tables: Mapping[str, pd.DataFrame] | None = None,
    more_figures: Mapping[str, bytes] | None = None,
    more_sections: Sequence[Section] = (),
    more_summary: Mapping[str, Scalar] | None = None,
    with_figures: bool = True,
) -> StudyResult:
    """Make tables, figures, headline numbers and page of one compressor.

    Parameters
    ----------
    measured : MeasuredUnbalance
        Shown in detail.
    command : str
        Among the conditions of the supplier's sheet, which is written where there are limits.
    inputs : tuple of Path
        Files that stay; a test that was measured for the study leaves none.
    more_tables, more_figures, more_sections, more_summary
        Of a study of several compressors.
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
    """
    tables = {**tables_of(measured), **(more_tables or {})}
    attachments: dict[str, bytes] = {}
    if measured.limits is not None:
        tables["verdicts"] = verdict_table(measured.verdicts)
        attachments = component_sheet(measured, command)
    figures = {**figures_of(measured), **(more_figures or {})} if with_figures else {}
    return StudyResult(
        tables=tables,
        figures=figures,
        summary={**summary_of(measured), **(more_summary or {})},
        page=page_of(measured, tables, figures, more_sections),
        inputs=inputs,
        facts={"route": measured.found.chosen.route.letter},
        documents={MODEL_FILE: compressor_document(measured.kept)},
        attachments=attachments,
    )


def summary_of(measured: MeasuredUnbalance) -> dict[str, Scalar]:
    """Headline numbers of one compressor."""
    found, sources = measured.found, measured.found.chosen.sources
    summary: dict[str, Scalar] = {
        "route": found.chosen.route.letter,
        "u_stat_g_mm": 1e6 * abs(sources.static.value),
        "u_stat_deviation_g_mm": 1e6 * sources.static.deviation,
        "u_dyn_g_mm2": 1e9 * abs(sources.dynamic.value),
        "u_dyn_deviation_g_mm2": 1e9 * sources.dynamic.deviation,
        "sense": found.sense.sense.name.lower(),
        "mounts_changed": measured.mounts_changed,
        "reduced_chi": sources.reduced_chi,
        "remaining_chi": sources.remaining_chi,
        "n_alarms": len(found.alarms) + len(measured.kept.alarms),
    }
    if measured.truth is not None:
        summary["u_stat_first_error_percent"] = 100 * abs(
            sources.static.value / measured.truth.static - 1
        )
        summary["u_dyn_first_error_percent"] = 100 * abs(
            sources.dynamic.value / measured.truth.dynamic - 1
        )
    if measured.limits is not None:
        summary["decision"] = overall(measured.verdicts).value
    return summary | {"seconds": measured.seconds}


COMMAND = "unbalance"
SEED = 1
"""Nothing is drawn; a run folder states a seed all the same."""


def unbalance_into_run(
    folder: Path,
    out: Path,
    plan: UnbalancePlan,
    progress: Progress,
    *,
    with_figures: bool = True,
) -> tuple[Path, str]:
    """Evaluate the test of a running compressor and write a run folder.

    Parameters
    ----------
    folder : Path
        Holds ``operation.toml``.
    out : Path
        Folder that gets ``unbalance/<run>/``.
    plan : UnbalancePlan
    progress : callable
    with_figures : bool

    Returns
    -------
    run : Path
        The finished run folder.
    decision : str
        ``pass``, ``fail`` or ``undecided``; empty without limits.

    Raises
    ------
    InputError
        A test that cannot be read or evaluated, an output folder that cannot be written; nothing
        is left behind.
    """
    begin = time.perf_counter()
    record = _record(folder, plan, with_figures=with_figures)
    decision = ""

    def work() -> StudyResult:
        nonlocal decision
        measured = measured_unbalance(folder, plan, counted(progress, STEPS + 1))
        progress(STEPS, STEPS + 1, "tables and figures")
        decision = overall(measured.verdicts).value if measured.verdicts else ""
        return unbalance_result(
            measured,
            command=command_of(record),
            inputs=measured.input_files,
            with_figures=with_figures,
        )

    run = run_command(out, record, work, relative_to=folder, begin=begin)
    progress(STEPS + 1, STEPS + 1, "done")
    return run, decision


def _record(folder: Path, plan: UnbalancePlan, *, with_figures: bool) -> dict[str, Any]:
    """Gather what is known of a run before it begins."""
    options = plan.unbalance
    low, high = options.band
    return {
        "study": COMMAND,
        "command": f"deboom unbalance {folder.as_posix()}",
        "question": "Which unbalance turns inside this compressor?",
        "seed": SEED,
        "arguments": {
            "limits": None if plan.limits is None else plan.limits.path.as_posix(),
            "route": plan.route,
            "identified": None if plan.identified is None else plan.identified.as_posix(),
            "hoses": None if options.hoses is None else options.hoses.value,
            "sense": None
            if options.expected_sense is None
            else options.expected_sense.name.lower(),
            "band": f"{low:g}-{high:g}",
            "confidence": options.confidence,
            "figures": with_figures,
        },
        "environment": environment_record(PACKAGES),
    }


Errors = Callable[[CaseErrors], float]
COMPARED_12 = "ade"
"""Routes that all compressors were evaluated by."""
LOW, HIGH = 0, 1
"""Places of the bands 20-50 and 50-150 Hz."""
BASE: dict[str, Errors] = {
    "u_stat_error_percent_50_150": lambda one: one.errors.static[HIGH],
    "u_stat_error_percent_20_50": lambda one: one.errors.static[LOW],
    "u_dyn_error_percent_50_150": lambda one: one.errors.dynamic[HIGH],
}


def virtual_result(runs: VirtualRuns, *, with_figures: bool = True) -> StudyResult:
    """Make the result of a study of virtual compressors.

    Parameters
    ----------
    runs : VirtualRuns
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        The first compressor in detail, errors of all.
    """
    table = case_table(runs.cases)
    shown = table.drop(columns=[name for name in table if "y/z" in str(name)])
    decimals = {name: 1 for name in map(str, shown) if name.endswith("[%]")}
    figures = {}
    if with_figures:
        figures = {"changed_state": changed_state(runs), "errors": errors(runs.cases)}
    section = Section(
        "All virtual compressors, against their truth",
        "Every compressor was measured twice: mounts in operation as struck, and with real part "
        "−10\u00a0%, imaginary part +10\u00a0% of their stiffness. The first one also with mounts "
        "that soften with their amplitude, under the hammer as in operation, and on a flexible "
        "receiver with a mode inside the band. Errors are rms over lines, sweeps, y and z, "
        "relative to the true unbalance; the truth includes the rotating gas force. Global: error "
        "of the fit over all lines and both pressures. Medians over the compressors.",
        figures=pictures(figures, "changed_state", "errors"),
        tables=(Table(shown, "Median errors by state and route.", decimals),),
    )
    return unbalance_result(
        runs.first,
        more_tables={"errors": table, "cases": all_cases(runs.cases)},
        more_figures=figures,
        more_sections=(section,),
        more_summary=error_summary(runs.cases),
        with_figures=with_figures,
    )


def error_summary(cases: Sequence[CaseErrors]) -> dict[str, Scalar]:
    """Headline errors, medians over the compressors [%]; the study's docstring has the keys."""
    summary: dict[str, Scalar] = {}
    for suffix, case, letter in (
        ("", MountCase.UNCHANGED, "d"),
        ("_changed_route_a", MountCase.CHANGED, "a"),
        ("_changed_route_e", MountCase.CHANGED, "e"),
    ):
        for name, of in BASE.items():
            summary[name + suffix] = _median(cases, case, letter, of)
    own: dict[str, Errors] = {
        "u_dyn_error_percent_20_50": lambda one: one.errors.dynamic[LOW],
        "u_stat_global_percent": lambda one: one.static,
        "u_dyn_global_percent": lambda one: one.dynamic,
        "gas_moment_percent": lambda one: one.gas_moment,
        "yz_mismatch_percent_50_150": lambda one: one.errors.static_mismatch[HIGH],
    }
    summary |= {name: _median(cases, MountCase.UNCHANGED, "d", of) for name, of in own.items()}
    for prefix, case, letter in (
        ("softening_route_a", MountCase.SOFTENING, "a"),
        ("softening_route_e", MountCase.SOFTENING, "e"),
        ("receiver_route_d", MountCase.RECEIVER, "d"),
        ("receiver_route_c", MountCase.RECEIVER, "c"),
    ):
        rows = _of(cases, case, letter)
        if rows:
            summary[f"{prefix}_u_stat_percent_20_50"] = 100 * rows[0].errors.static[LOW]
            summary[f"{prefix}_u_stat_percent_50_150"] = 100 * rows[0].errors.static[HIGH]
    receiver = _of(cases, MountCase.RECEIVER, "d")
    if receiver:
        summary["receiver_alarm"] = "yes" if receiver[0].alarmed else "no"
    return summary


def case_table(cases: Sequence[CaseErrors]) -> pd.DataFrame:
    """Write medians by state and route."""
    rows = []
    for case in MountCase:
        for letter in sorted({one.letter for one in cases}):
            found = _of(cases, case, letter)
            if found:
                row: dict[str, str | int | float] = {
                    "mounts": case.value,
                    "route": letter,
                    "compressors": len(found),
                }
                for place, band in enumerate(BANDS):
                    for name, of in (
                        ("u", "static"),
                        ("u_d", "dynamic"),
                        ("y/z", "static_mismatch"),
                    ):
                        values = [getattr(one.errors, of)[place] for one in found]
                        row[f"{name} {words(band)} [%]"] = 100 * float(np.median(values))
                row["u, global [%]"] = 100 * float(np.median([one.static for one in found]))
                row["u_d, global [%]"] = 100 * float(np.median([one.dynamic for one in found]))
                rows.append(row)
    return pd.DataFrame(rows)


def all_cases(cases: Sequence[CaseErrors]) -> pd.DataFrame:
    """Write every case."""
    rows = []
    for one in cases:
        row: dict[str, str | int | float] = {
            "seed": one.seed,
            "mounts": one.case.value,
            "route": one.letter,
            "alarm": one.alarmed,
            "u, global [%]": 100 * one.static,
            "u_d, global [%]": 100 * one.dynamic,
            "gas moment, global [%]": 100 * one.gas_moment,
        }
        for place, band in enumerate(BANDS):
            row[f"u {words(band)} [%]"] = 100 * one.errors.static[place]
            row[f"u_d {words(band)} [%]"] = 100 * one.errors.dynamic[place]
        rows.append(row)
    return pd.DataFrame(rows)


def changed_state(runs: VirtualRuns) -> bytes:
    """Show changed mounts: the thesis's route against the one that follows."""
    panels = []
    label, unit = SIZES[STATIC]
    for letter in ("a", "e"):
        result = runs.changed.by_letter(letter)
        sweep = result.sweeps[0]
        curve = curve_of(sweep, STATIC)
        panels.append(
            MaskedPanel(
                f"Route {letter}: {result.route.title}",
                label,
                sweep.frequency,
                {
                    "from y": unit * np.abs(curve.from_y.value),
                    "from z": unit * np.abs(curve.from_z.value),
                }
                | true_curve(runs.changed_truth, sweep, STATIC),
                ranges={
                    "from y": (unit * curve.from_y.lower, unit * curve.from_y.upper),
                    "from z": (unit * curve.from_z.lower, unit * curve.from_z.upper),
                },
                masked=masks(curve),
                note=sweep.sweep,
            )
        )
    return masked_panels(panels, dashed=(TRUTH,))


def errors(cases: Sequence[CaseErrors]) -> bytes:
    """Dots of every compressor, by route and state."""
    states = {"as struck": MountCase.UNCHANGED, "changed": MountCase.CHANGED}
    colours = dict(zip(states, VEHICLE_PALETTE, strict=False))
    panels = []
    for name, of in (("u", "static"), ("u_d", "dynamic")):
        for place, band in enumerate(BANDS):
            values = {
                f"{letter}, {words_of}": {
                    words_of: [
                        100 * getattr(one.errors, of)[place] for one in _of(cases, state, letter)
                    ]
                }
                for letter in COMPARED_12
                for words_of, state in states.items()
            }
            panels.append(DotPanel(f"{name}, {words(band)} [%]", values))
    return dot_panels(panels, colours)


def _of(cases: Sequence[CaseErrors], case: MountCase, letter: str) -> list[CaseErrors]:
    return [one for one in cases if one.case is case and one.letter == letter]


def _median(cases: Sequence[CaseErrors], case: MountCase, letter: str, of: Errors) -> float:
    return 100 * float(np.median([of(one) for one in _of(cases, case, letter)]))
