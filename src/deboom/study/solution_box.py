"""The numbers behind the report of an acceptance box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace
from deboom.explore.selection import variables_without_effect
from deboom.explore.solution_box import Box, BoxQuestion
from deboom.explore.solution_box_peers import (
    BisectionBox,
    VolumeRatio,
    bisection_box,
    tolerance_box,
    trade_off,
    volume_ratio,
)
from deboom.explore.solution_box_reach import UnreachableLimit
from deboom.explore.solution_box_search import BoxEffort, FoundBox, largest_box
from deboom.explore.solution_box_share import (
    VerifiedShare,
    box_sample,
    face_shares,
    verified_share,
)
from deboom.mounts.operating_stiffness import mean_operating_stiffness
from deboom.study.mount_source import Operation
from deboom.study.progress import Progress
from deboom.vehicles.limit_responses import MeanLevel, PeakLevel
from deboom.vehicles.load_case_index import LoadCaseIndex

SHOWN_PARTS = 4096
"""Parts of the box whose levels are drawn, and of each of its faces."""
CURVE = (-0.5, -0.25, 0.0, 0.25, 0.5, 0.75)
"""Steps of the curve over the limit, in parts of what the limit could be lowered by at most [1]."""
CURVE_EFFORT = BoxEffort(starts=1, fine=((0.15, 1024),), calibration=16384)


@dataclass(frozen=True, eq=False)
class BoxStudy:
    """An acceptance box with what it is compared with.

    Parameters
    ----------
    runs : Operation
        Platform, vehicles and load cases.
    index : LoadCaseIndex
        The model.
    space : DesignSpace
        Designs and their tolerance.
    point : array, shape (k,)
        The Pareto point [1].
    found : FoundBox
        The largest box, verified.
    bisection : BisectionBox
        About the Pareto point.
    curve : sequence of (float, FoundBox or UnreachableLimit)
        What the limits were lowered by [dB], and the box there.
    seed : int
    """

    runs: Operation
    index: LoadCaseIndex[Any, Any]
    space: DesignSpace
    point: RealArray
    found: FoundBox
    bisection: BisectionBox
    curve: Sequence[tuple[float, FoundBox | UnreachableLimit]]
    seed: int

    @property
    def question(self) -> BoxQuestion:
        """What was asked."""
        return self.found.question

    @property
    def response(self) -> MeanLevel | PeakLevel:
        """What is limited."""
        response = self.question.response
        assert isinstance(response, MeanLevel | PeakLevel)
        return response

    @property
    def box(self) -> Box:
        """The largest box."""
        return self.found.box

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names."""
        return self.question.response.response_names

    @property
    def variables(self) -> tuple[str, ...]:
        """Names."""
        return self.question.names

    @property
    def tolerance(self) -> float:
        """Half width of the box that is compared with [1]."""
        return float(self.space.tolerance.max())

    @property
    def band(self) -> tuple[float, float]:
        """Lines that count [Hz]."""
        if isinstance(self.response, PeakLevel):
            return self.response.band
        return float(self.index.frequency[0]), float(self.index.frequency[-1])

    @cached_property
    def plain(self) -> Box:
        """The box of one tolerance about the Pareto point."""
        return tolerance_box(self.variables, self.point, self.tolerance)

    @cached_property
    def plain_share(self) -> VerifiedShare:
        """What it keeps, of the parts that verify the largest box."""
        return self.verified(self.plain, self.question)

    @cached_property
    def bisection_share(self) -> VerifiedShare:
        """What the box of the bisection keeps, of the same parts."""
        return self.verified(self.bisection.box, self.question)

    @cached_property
    def effective(self) -> npt.NDArray[np.bool_]:
        """Variables that a vehicle depends on, shape (k,)."""
        free = variables_without_effect(self.index, self.space)
        return np.array([name not in free for name in self.variables])

    @cached_property
    def over_plain(self) -> VolumeRatio:
        """The largest box over that of one tolerance."""
        return volume_ratio(self.box, self.plain, self.effective)

    @cached_property
    def over_bisection(self) -> VolumeRatio:
        """The largest box over that of the bisection."""
        return volume_ratio(self.box, self.bisection.box, self.effective)

    @cached_property
    def shown_excess(self) -> RealArray:
        """Levels of some parts of the box, above their limits, (SHOWN_PARTS, n_vehicle) [dB]."""
        return self.question.excess(self.question.parts(self.box, self._unit))

    @cached_property
    def faces(self) -> RealArray:
        """Share of the parts at each end of each interval, shape (2, k) [1]."""
        return face_shares(self.question, self.box, self._unit)

    @property
    def missed(self) -> RealArray:
        """Share of the verified parts that miss the limit of each vehicle, shape (n_vehicle,)."""
        return np.asarray(1.0 - self.found.verified.by_response)

    @property
    def on_bounds(self) -> npt.NDArray[np.bool_]:
        """Ends of intervals with an effect that the bounds set, not the limit, shape (2, k)."""
        span = self.question.upper - self.question.lower
        near = np.stack(
            [self.box.lower - self.question.lower, self.question.upper - self.box.upper]
        )
        return np.asarray((near <= 1e-6 * span) & self.effective)

    @property
    def ends_on_bounds(self) -> int:
        """How many these are."""
        return int(self.on_bounds.sum())

    @property
    def binding(self) -> str:
        """Vehicle that most parts miss."""
        return self.vehicles[int(np.argmax(self.missed))]

    @cached_property
    def reference_stiffness(self) -> RealArray:
        """Mean |K| over the lines of the first load case, shape (k,) [N/m]; nan: not measured."""
        lines = self.index.frequency
        case = self.runs.cases[0][0]
        edges = (float(lines[0]), float(lines[-1]))
        by_mount = [
            mean_operating_stiffness(mount, case, edges) for mount in self.runs.platform.mounts
        ]
        return np.concatenate(by_mount)

    @cached_property
    def identified(self) -> npt.NDArray[np.bool_]:
        """Directions whose stiffness is known well enough to be asked in N/m, shape (k,)."""
        known = {
            f"{part.mount.name} {one.axis}": one.surface is not None and one.quality.identified
            for part in self.runs.parts
            for one in part.directions
        }
        return np.array([known.get(name, not self.runs.parts) for name in self.variables])

    @property
    def condition(self) -> str:
        """At which the reference stiffness was read."""
        lines, case = self.index.frequency, self.runs.cases[0][0]
        return (
            f"mean magnitude of the dynamic stiffness of one piece over {lines[0]:g} to "
            f"{lines[-1]:g} Hz, load case {case.name}, motion as in that run"
        )

    def verified(self, box: Box, question: BoxQuestion) -> VerifiedShare:
        """Verify another box with the parts that verified the largest one."""
        check = self.found.verified
        return verified_share(
            question, box, seed=self.seed, n_parts=check.n_parts, confidence=check.confidence
        )

    @property
    def _unit(self) -> RealArray:
        size = len(self.variables)
        return box_sample(size, SHOWN_PARTS, seed=self.seed, purpose="parts of a box to show")


def box_study(
    runs: Operation,
    index: LoadCaseIndex[Any, Any],
    space: DesignSpace,
    point: RealArray,
    question: BoxQuestion,
    *,
    seed: int,
    curve: bool = True,
    workers: int = 1,
    progress: Progress,
) -> BoxStudy:
    """Find the box of a question, those at other limits, and what they are compared with.

    Parameters
    ----------
    runs, index, space, point
        See `BoxStudy`.
    question : BoxQuestion
    seed : int
    curve : bool
        Whether boxes at other limits are found too.
    workers : int
        Processes.
    progress : callable
        See `deboom.study.progress.Progress`.

    Raises
    ------
    InputError
        See `deboom.explore.solution_box_search.largest_box`; variables of the platform that the
        model has not.
    """
    variables = tuple(name for mount in runs.platform.mounts for name in mount.variables)
    if question.names != variables:
        raise InputError(
            f"the model has the variables {list(question.names)}, the mounts {list(variables)}: an "
            "acceptance box needs exactly the stiffness factors of the mounts"
        )
    found = largest_box(question, seed=seed, points=[point], workers=workers, progress=progress)
    steps = [part * found.room for part in CURVE if part != 0.0] if curve else []
    boxes = trade_off(
        question, steps, seed=seed, points=[point], effort=CURVE_EFFORT, workers=workers
    )
    pairs = sorted([(0.0, found), *zip(steps, boxes, strict=True)], key=lambda one: one[0])
    bisection = bisection_box(question, point, seed=seed)
    return BoxStudy(runs, index, space, point, found, bisection, tuple(pairs), seed)
