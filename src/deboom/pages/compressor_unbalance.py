"""Running compressors, evaluated by five routes; virtual ones, against their truth."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.bench.truth import UnbalanceTruth, read_unbalance_truth
from deboom.choices import FolderKind
from deboom.compressor.acceptance import ComponentLimits, ComponentVerdict, component_verdicts
from deboom.compressor.hose_presence import HoseReaction, hose_reactions
from deboom.compressor.identification import Identification, IdentifyOptions
from deboom.compressor.identify import identify
from deboom.compressor.unbalance import (
    RouteResult,
    Unbalance,
    UnbalanceOptions,
    unbalance,
)
from deboom.errors import InputError
from deboom.files.compressor_model import read_fitted_bands
from deboom.files.folders import refuse_other_kind
from deboom.files.operating_test import read_operating_test
from deboom.files.run_folder import hash_files
from deboom.measurement.compressor_test import HoseState, OperatingTest

MODEL_FILE = "compressor_model"
"""Stem of the file of an identified compressor in a run."""
STEPS = 12
"""Of `measured_unbalance`, for progress."""
AUTOMATIC = "auto"
"""Route d, or e where the mounts have changed, no hose is seen and the hammer test has no alarm."""


@dataclass(frozen=True)
class UnbalancePlan:
    """What is asked of an operating test.

    - `route`: letter of the route whose results are headline and verdict, or `AUTOMATIC`.
    - `identify`: of the hammer test.
    - `unbalance`: of the sweeps.
    - `limits`: to be judged; None where there are none.
    - `identified` or None: run of ``deboom identify``, or its compressor_model.json: its lines are
      fitted again, and the hammer test must be the one that it was made from.
    - `truth`: compare with the truth of a virtual test.
    """

    route: str = AUTOMATIC
    identify: IdentifyOptions = field(default_factory=IdentifyOptions)
    unbalance: UnbalanceOptions = field(default_factory=UnbalanceOptions)
    limits: ComponentLimits | None = None
    identified: Path | None = None
    truth: bool = False


@dataclass(frozen=True, eq=False)
class MeasuredUnbalance:
    """One running compressor, evaluated.

    - `inputs_sha256`: hashes of the hammer test's files.
    - `with_hoses`: the chosen route on the sweeps with the hoses of the vehicle (thesis, figure
      62); None where there are none besides those of `evaluation`.
    - `reactions`: of the hoses, one per pressure with both kinds of hoses.
    - `verdicts`: one per limit.
    - `truth`: none where it is not known.
    - `seconds`: from the files to the verdicts [s].
    """

    evaluation: Unbalance
    inputs_sha256: Mapping[str, str]
    with_hoses: RouteResult | None
    reactions: tuple[HoseReaction, ...]
    limits: ComponentLimits | None
    verdicts: tuple[ComponentVerdict, ...]
    truth: UnbalanceTruth | None
    seconds: float

    @property
    def test(self) -> OperatingTest:
        """What was measured."""
        return self.evaluation.test

    @property
    def mounts_changed(self) -> str:
        """``yes`` or ``no``; ``unknown`` with hoses in the data, which look like other mounts."""
        if self.evaluation.hoses_seen:
            return "unknown"
        return "yes" if self.evaluation.state.changed else "no"

    @property
    def mount_state(self) -> str:
        """What the sweeps say of the mounts, in words."""
        if self.mounts_changed == "unknown":
            return (
                "Whether the mounts run in another state than they were struck in cannot be told: "
                "hoses are joined or visible, and push back like other mounts."
            )
        return self.evaluation.state.statement

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, limits and truth included."""
        more = [source.path for source in (self.limits, self.truth) if source is not None]
        return (*self.test.input_files, *more)


def measured_unbalance(
    folder: Path, plan: UnbalancePlan, step: Callable[[str], None]
) -> MeasuredUnbalance:
    """Evaluate the operating test of a folder.

    - `folder`: holds ``operation.toml``.
    - raises InputError: a test that cannot be read, identified or evaluated, a route that was not
      computed, `plan.identified` of another hammer test.
    """
    begin = time.perf_counter()
    with threadpool_limits(1):  # its matrices are too small to share
        step("reading")
        if not folder.is_dir():
            raise InputError(
                f"{folder}: there is no such folder; `deboom bench operation {folder}` writes a "
                "virtual test"
            )
        refuse_other_kind(folder, FolderKind.operation)
        test = read_operating_test(folder)
        truth = read_unbalance_truth(folder) if plan.truth else None
        hashes = hash_files(test.hammer.input_files, folder)
        options = _identify_options(plan, hashes)
        hammer = identify(test.hammer, options, step, hoses=test.hoses)
        evaluation = with_route(unbalance(test, hammer, plan.unbalance, step), plan.route)
        step("hoses")
        with_hoses = _with_hoses(test, hammer, evaluation)
        reactions = _reactions(evaluation, with_hoses)
        verdicts: tuple[ComponentVerdict, ...] = ()
        if plan.limits is not None:
            verdicts = component_verdicts(evaluation, plan.limits)
    seconds = time.perf_counter() - begin
    return MeasuredUnbalance(
        evaluation, hashes, with_hoses, reactions, plan.limits, verdicts, truth, seconds
    )


def _identify_options(plan: UnbalancePlan, hashes: Mapping[str, str]) -> IdentifyOptions:
    """Take over the lines of an earlier identification of the same hammer test."""
    if plan.identified is None:
        return plan.identify
    path = plan.identified
    path = path / f"{MODEL_FILE}.json" if path.is_dir() else path
    bands, earlier = read_fitted_bands(path)
    if sorted(earlier.values()) != sorted(hashes.values()):
        raise InputError(
            f"{path} was identified from another hammer test than that of these sweeps: identify "
            "the test in their folder, or leave out --identified"
        )
    return replace(plan.identify, bands=bands)


def with_route(evaluation: Unbalance, wanted: str) -> Unbalance:
    """Choose the route that counts: a letter, or `AUTOMATIC`.

    - raises InputError: a letter that no route has.
    """
    letters = [result.route.letter for result in evaluation.routes]
    if wanted == AUTOMATIC:
        # an update of the mounts is worth as much as the model that it updates, and hoses that
        # push back look like other mounts
        sound = not (evaluation.identification.alarms or evaluation.hoses_seen)
        updated = evaluation.state.changed and sound and "e" in letters
        wanted = "e" if updated else evaluation.chosen.route.letter
    if wanted not in letters:
        raise InputError(f"there is no route '{wanted}': choose {AUTOMATIC}, {', '.join(letters)}")
    route = evaluation.by_letter(wanted).route
    return replace(evaluation, options=replace(evaluation.options, chosen=route))


def _with_hoses(
    test: OperatingTest, hammer: Identification, evaluation: Unbalance
) -> RouteResult | None:
    """Evaluate the sweeps with the hoses of the vehicle by the chosen route."""
    used = {sweep.hoses for sweep in evaluation.chosen.sweeps}
    if HoseState.STANDARD in used or not test.with_hoses(HoseState.STANDARD):
        return None
    route = evaluation.chosen.route
    options = replace(evaluation.options, routes=(route,), chosen=route, hoses=HoseState.STANDARD)
    return unbalance(test, hammer, options).chosen


def _reactions(evaluation: Unbalance, with_hoses: RouteResult | None) -> tuple[HoseReaction, ...]:
    """Look for the reaction of the hoses where a pressure was run with both kinds."""
    if with_hoses is None:
        return ()
    joined = {sweep.pressure for sweep in with_hoses.sweeps}
    if not joined & {sweep.pressure for sweep in evaluation.chosen.sweeps}:
        return ()
    state = evaluation.state

    return hose_reactions(
        evaluation.test,
        evaluation.identification,
        change=lambda lines: np.asarray(np.interp(lines, state.frequency, state.curve)),
        sense=evaluation.sense.sense,
    )
