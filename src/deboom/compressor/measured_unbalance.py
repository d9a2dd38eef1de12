"""Running compressors, evaluated by five routes; virtual ones, against their truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.acceptance import ComponentLimits, ComponentVerdict
from deboom.compressor.hose_presence import HoseReaction, hose_reactions
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.unbalance import RouteResult, SweepUnbalance, Unbalance, unbalance
from deboom.errors import InputError
from deboom.measurement.compressor_test import HoseState, OperatingTest

SAME_LINE = 1e-6
"""Largest relative distance of a line of a sweep from one of the truth [1]."""
AUTOMATIC = "auto"
"""Route d, or e where the mounts have changed, no hose is seen and the hammer test has no alarm."""


@dataclass(frozen=True, eq=False)
class UnbalanceTruth:
    """What truly turns and pushes.

    - `path`: where it was read.
    - `static`, `dynamic`: of all sources together [kg m, kg m²].
    - `loads` (n_frequency, 6): sweep → load at the virtual point at its lines, gas included [N, N
      m]; sweeps over time have none.
    - `lines` (n_frequency,): sweep → its lines [Hz].
    """

    path: Path
    static: complex
    dynamic: complex
    loads: Mapping[str, ComplexArray]
    lines: Mapping[str, RealArray]

    def load_of(self, sweep: SweepUnbalance) -> ComplexArray | None:
        """Return the load at the lines of a sweep (n_frequency, 6) [N, N m]; None where unknown."""
        if sweep.sweep not in self.loads:
            return None
        lines = self.lines[sweep.sweep]
        places = np.argmin(np.abs(lines[:, np.newaxis] - sweep.frequency), axis=0)
        if not np.allclose(lines[places], sweep.frequency, rtol=SAME_LINE, atol=0.0):
            return None  # nothing is interpolated
        return np.asarray(self.loads[sweep.sweep][places])


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


def sweeps_with_hoses(
    test: OperatingTest, hammer: Identification, evaluation: Unbalance
) -> RouteResult | None:
    """Evaluate the sweeps with the hoses of the vehicle by the chosen route."""
    used = {sweep.hoses for sweep in evaluation.chosen.sweeps}
    if HoseState.STANDARD in used or not test.with_hoses(HoseState.STANDARD):
        return None
    route = evaluation.chosen.route
    options = replace(evaluation.options, routes=(route,), chosen=route, hoses=HoseState.STANDARD)
    return unbalance(test, hammer, options).chosen


def reactions_of_hoses(
    evaluation: Unbalance, with_hoses: RouteResult | None
) -> tuple[HoseReaction, ...]:
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
