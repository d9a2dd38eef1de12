"""Does a search that is killed and resumed find the front of one that is not?

NSGA-II on QUAD2, a robust problem with a known front. It takes a second or two: long enough
to be killed in, short enough for a campaign of kills.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pandas as pd
from typer import Option

from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.space import stiffness_factor_space
from deboom.report import Report
from deboom.runs.options import Seed
from deboom.runs.result import RunContext
from deboom.runs.search import SearchOptions
from samples.known_truth import quad2


@dataclass(frozen=True)
class Options:
    """How long is searched, and a file that counts as an input."""

    seed: Seed = 1
    search: SearchOptions = SearchOptions(generations=60, population=60)
    note: Annotated[Path | None, Option(help="A file that counts as an input.")] = None


def prepare(options: Options) -> Robust:
    """Build the robust response of QUAD2."""
    model = quad2(12, seed=options.seed)
    space = stiffness_factor_space(model.variable_names)
    return Robust(model, space, sobol_sample(12, seed=options.seed))


def run(robust: Robust, options: Options, context: RunContext | None = None) -> Report:
    """Search and return the front."""
    inputs = () if options.note is None else (options.note,)
    search = options.search.searched(robust, seed=options.seed, run=context, inputs=inputs)
    front = search.front
    columns = {"mean sum [1]": front.mean_sum, "sigma sum [1]": front.sigma_sum}
    designs = dict(zip(robust.space.labels, front.designs.T, strict=True))
    report = Report("QUAD2")
    report.section("Front")
    report.table("front", pd.DataFrame(columns | designs))
    report.number("n_evaluated", search.n_evaluated, "", "designs evaluated", headline="d")
    report.inputs += inputs
    return report
