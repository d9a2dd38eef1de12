"""Which variables the levels of a fleet depend on: model runs and indices of one study."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, partial
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.sensitivity import (
    morris_analysis,
    morris_designs,
    pawn_analysis,
    sobol_analysis,
    sobol_designs,
)
from deboom.explore.sensitivity_inputs import (
    SensitivityInputs,
    design_inputs,
    tolerance_inputs,
)
from deboom.explore.sensitivity_measures import DistributionIndices, MorrisEffects
from deboom.explore.sobol_indices import (
    SobolIndices,
    base_rows,
    first_and_total,
    n_rows,
    sobol_indices,
)
from deboom.files.platform import Platform
from deboom.mounts.mount import Mount
from deboom.study.progress import Progress
from deboom.study.sensitivity_outputs import LevelOutputs, Ranked, ranked_output
from deboom.vehicles.load_case_index import LoadCaseIndex

AGREEMENT = 1e-12
"""How far the vectorised estimator may be from SALib [1]."""
LINE_POINTS = 1024
"""Base points behind the indices of single lines, at most."""
FIRST_POINTS = 64
"""Base points where the convergence begins."""
TRAJECTORIES = 50
"""Paths of Morris's method."""
PART = 2048  # designs evaluated at a time
LINES, PATHS, MOUNTS = "lines", "Morris", "by mount"
Jobs = dict[str, tuple[Callable[[RealArray], RealArray], RealArray]]


class Analysis(Enum):
    """What the variables do."""

    design = "design"
    """They are chosen: uniform within a range."""
    tolerance = "tolerance"
    """They scatter as parts do: gaussian, cut at three standard deviations."""


@dataclass(frozen=True)
class SensitivityPlan:
    """What is asked, and with which budget.

    Parameters
    ----------
    analysis : Analysis
        Whose indices are ranked; the other one stands beside it.
    ranked : Ranked
        What of the levels is ranked; the other one stands beside it.
    half_width : float
        Stiffness factors of the design analysis run within ``1 ± half_width`` [1].
    beside : float
        The same for the design analysis that stands beside it [1].
    tolerance : float
        Half width of the scatter, three standard deviations [1].
    n_base : int
        Base points, a power of two.
    n_resamples : int
        Behind every interval.
    seed : int
        From 1 upwards.
    """

    analysis: Analysis
    ranked: Ranked
    half_width: float
    beside: float
    tolerance: float
    n_base: int
    n_resamples: int
    seed: int

    def inputs(self, names: tuple[str, ...]) -> dict[str, SensitivityInputs]:
        """Return the variables of each analysis by its label; the ranked one comes first."""
        scatter = tolerance_inputs(stiffness_factor_space(names, 0.0, self.tolerance))
        every = {
            f"{Analysis.design.value} ±{100 * width:g} %": (
                Analysis.design,
                design_inputs(stiffness_factor_space(names, width, 0.0)),
            )
            for width in (self.half_width, self.beside)
        }
        label = f"{Analysis.tolerance.value} ±{100 * self.tolerance:g} % (3 σ)"
        every[label] = (Analysis.tolerance, scatter)
        order = sorted(every.items(), key=lambda item: item[1][0] is not self.analysis)
        return {label: inputs for label, (_, inputs) in order}


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Indices of a fleet, with all that its report needs.

    Parameters
    ----------
    platform : Platform
        As measured.
    index : LoadCaseIndex
        What was evaluated.
    plan : SensitivityPlan
        What was asked.
    label : str
        Of the ranked analysis.
    inputs : SensitivityInputs
        Its variables.
    indices : SobolIndices
        Of every vehicle, by SALib.
    salib_difference : float
        Largest difference of the vectorised estimator from SALib [1].
    by_mount : SobolIndices or None
        With the variables of each mount as one; None for a single mount.
    beside : mapping of str to SobolIndices
        Of the same vehicles, first and total, by label of what differs.
    lines : SobolIndices
        Of every vehicle and line, vehicle by vehicle, first and total.
    convergence : tuple of SobolIndices
        Of the first base points, more and more; first and total.
    morris : MorrisEffects
        Elementary effects in the same variables.
    pawn : DistributionIndices
        Of the base points.
    n_runs : int
        Designs that were evaluated.
    """

    platform: Platform
    index: LoadCaseIndex[Any, Any]
    plan: SensitivityPlan
    label: str
    inputs: SensitivityInputs
    indices: SobolIndices
    salib_difference: float
    by_mount: SobolIndices | None
    beside: Mapping[str, SobolIndices]
    lines: SobolIndices
    convergence: tuple[SobolIndices, ...]
    morris: MorrisEffects
    pawn: DistributionIndices
    n_runs: int

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return self.index.response_names

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the design variables."""
        return self.index.variable_names

    @cached_property
    def total_of_lines(self) -> RealArray:
        """Total index of the level of every line, shape (n_vehicle, n_variable, n_lines) [1]."""
        shape = (len(self.variables), len(self.vehicles), -1)
        return np.ascontiguousarray(self.lines.total.reshape(shape).transpose(1, 0, 2))

    @cached_property
    def ranking(self) -> dict[str, tuple[str, ...]]:
        """Variables of each vehicle by falling total index."""
        return ranking(self.indices)


def ranking(found: SobolIndices) -> dict[str, tuple[str, ...]]:
    """Return the factors by falling total index, for each output."""
    order = np.argsort(-found.total, axis=0, kind="stable")
    return {
        output: tuple(found.factors[place] for place in places)
        for output, places in zip(found.outputs, order.T, strict=True)
    }


def sensitivity(
    platform: Platform,
    index: LoadCaseIndex[Any, Any],
    plan: SensitivityPlan,
    progress: Progress | None = None,
) -> Sensitivity:
    """Run the designs and return all indices.

    Parameters
    ----------
    platform : Platform
        Its mounts are the groups.
    index : LoadCaseIndex
        To be evaluated.
    plan : SensitivityPlan
        What is asked.
    progress : callable, optional
        Called with the designs done, their number, and a text.

    Raises
    ------
    InputError
        A range, count or seed that cannot be used; a design without finite levels.
    RuntimeError
        The vectorised estimator and SALib do not agree.
    """
    (label, inputs), *others = plan.inputs(index.variable_names).items()
    d, names = inputs.n_variables, index.response_names
    ranked, outputs = ranked_output(index, plan.ranked), LevelOutputs(index)
    grouped = _by_mount(inputs, platform.mounts)
    saltelli = partial(sobol_designs, n_base=plan.n_base, seed=plan.seed)
    designs = saltelli(inputs)
    few = designs[: min(LINE_POINTS, plan.n_base) * n_rows(d, True)]
    paths = morris_designs(inputs, TRAJECTORIES, seed=plan.seed)
    jobs: Jobs = {
        label: (ranked, designs),
        LINES: (outputs, first_and_total(few, d)),
        PATHS: (ranked, paths),
        **{other: (ranked, saltelli(theirs, second_order=False)) for other, theirs in others},
    }
    if grouped is not None:
        jobs[MOUNTS] = (ranked, saltelli(grouped))
    values = _evaluated(jobs, progress)

    found, difference = _checked(values[label], inputs.factors, names, plan)
    by_mount = None
    if grouped is not None:
        by_mount, gap = _checked(values[MOUNTS], grouped.factors, names, plan)
        difference = max(difference, gap)
    indices = partial(
        sobol_indices,
        factors=inputs.factors,
        seed=plan.seed,
        second_order=False,
        n_resamples=plan.n_resamples,
    )
    of_lines, of_other = outputs.split(values[LINES], plan.ranked)
    beside = {other: indices(values[other], outputs=names) for other, _ in others}
    beside[f"{label}, {plan.ranked.other.words}"] = indices(of_other, outputs=names)
    alone = first_and_total(values[label], d).reshape(plan.n_base, -1, len(names))
    growing = [alone[:n].reshape(-1, len(names)) for n in _counts(plan.n_base)]
    return Sensitivity(
        platform=platform,
        index=index,
        plan=plan,
        label=label,
        inputs=inputs,
        indices=found,
        salib_difference=difference,
        by_mount=by_mount,
        beside=beside,
        lines=indices(of_lines, outputs=outputs.line_names),
        convergence=tuple(indices(part, outputs=names) for part in growing),
        morris=morris_analysis(inputs, paths, values[PATHS], names, seed=plan.seed),
        pawn=pawn_analysis(
            inputs, base_rows(designs, d, True), base_rows(values[label], d, True), names
        ),
        n_runs=sum(len(rows) for _, rows in jobs.values()),
    )


def _counts(n_base: int) -> list[int]:
    """Return the numbers of base points of the convergence, doubled up to all."""
    powers = [2**power for power in range(n_base.bit_length())]
    return [count for count in powers if count >= FIRST_POINTS] or [n_base]


def _by_mount(inputs: SensitivityInputs, mounts: tuple[Mount, ...]) -> SensitivityInputs | None:
    """Group the variables by mount; None where there is only one."""
    owner = {name: mount.name for mount in mounts for name in mount.variables}
    groups = [owner[name] for name in inputs.names]
    return inputs.grouped(groups) if len(set(groups)) > 1 else None


def _evaluated(jobs: Jobs, progress: Progress | None) -> dict[str, RealArray]:
    """Evaluate all designs, a part at a time."""
    total, done = sum(len(rows) for _, rows in jobs.values()), 0
    values = {}
    for name, (evaluate, rows) in jobs.items():
        parts = []
        for start in range(0, len(rows), PART):
            parts.append(evaluate(rows[start : start + PART]))
            done += len(parts[-1])
            if progress is not None:
                progress(done, total, name)
        values[name] = np.concatenate(parts)
    return values


def _checked(
    values: RealArray, factors: tuple[str, ...], names: tuple[str, ...], plan: SensitivityPlan
) -> tuple[SobolIndices, float]:
    """Return SALib's indices, and how far the vectorised ones are from them."""
    found, vectorised = (
        analyse(values, factors, names, seed=plan.seed, n_resamples=plan.n_resamples)
        for analyse in (sobol_analysis, sobol_indices)
    )
    difference = found.difference(vectorised)
    if not difference <= AGREEMENT:
        raise RuntimeError(
            f"the vectorised estimator and SALib differ by {difference:.1e}: one of them has "
            "changed, trust neither"
        )
    return found, difference
