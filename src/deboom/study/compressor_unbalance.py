"""From a test on a running compressor to its unbalance: read, identify, unbalance, judge."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.acceptance import Verdict
from deboom.compressor.component_acceptance import component_verdicts
from deboom.compressor.component_limits import ComponentLimits
from deboom.compressor.hose_reaction import HoseReaction, hose_reactions
from deboom.compressor.identified import IdentifiedCompressor, identified_compressor
from deboom.compressor.identify import Identification, IdentifyOptions, identify
from deboom.compressor.operating_checks import hose_alarms
from deboom.compressor.unbalance import RouteResult, Unbalance, UnbalanceOptions, unbalance
from deboom.errors import InputError
from deboom.files.compressor_model import read_compressor_model
from deboom.files.operating_test import read_operating_test
from deboom.files.run_folder import hash_files
from deboom.measurement.operating_sweep import HoseState, OperatingTest
from deboom.study.compressor_unbalance_truth import UnbalanceTruth, read_unbalance_truth

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
        if hoses_seen(self.found):
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
        hammer = identify(test.hammer, options, step)
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
        sound = not (found.identification.alarms or hoses_seen(found))
        updated = found.state.changed and sound and "e" in letters
        wanted = "e" if updated else found.chosen.route.letter
    if wanted not in letters:
        raise InputError(f"there is no route '{wanted}': choose {AUTOMATIC}, {', '.join(letters)}")
    route = found.by_letter(wanted).route
    return replace(found, options=replace(found.options, chosen=route))


def hoses_seen(found: Unbalance) -> bool:
    """Whether the sweeps that were used had the vehicle's hoses, by their name or their loads."""
    names = {sweep.sweep for sweep in found.chosen.sweeps}
    used = [sweep for sweep in found.test.sweeps if sweep.name in names]
    joined = any(sweep.hoses is HoseState.STANDARD for sweep in used)
    return joined or bool(hose_alarms(used, found.chosen.sources.residual_bands))


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
