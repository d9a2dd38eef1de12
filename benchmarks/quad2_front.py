"""Does a search that is killed and resumed find the front of one that is not?

NSGA-II on QUAD2, a robust problem with a known front. It takes a second or two: long enough
to be killed in, short enough for a campaign of kills.

Key of summary.json: n_evaluated (designs).
"""

from pathlib import Path
from typing import Annotated

import pandas as pd
from typer import Option

from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.space import stiffness_factor_space
from deboom.explore.workers import workers_for
from deboom.report.page import Page
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext, StudyResult
from deboom.study.runner import run_script
from known_truth import quad2


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same front.")] = 1,
    generations: Annotated[int, Option(help="Generations of NSGA-II.")] = 60,
    population: Annotated[int, Option(help="Designs per generation.")] = 60,
    note: Annotated[Path | None, Option(help="A file that counts as an input.")] = None,
    workers: Annotated[int, Option(help="Processes.")] = 1,
    scheduler: Annotated[str | None, Option(help="Address of a Dask cluster.")] = None,
    run: RunContext | None = None,
) -> StudyResult:
    """Search and return the front."""
    model = quad2(12, seed=seed)
    space = stiffness_factor_space(model.variable_names)
    robust = RobustResponse(model, space, sobol_sample(12, seed=seed))
    inputs = () if note is None else (note,)
    checkpoint = run.checkpoint(inputs) if run else None
    with workers_for(robust, workers, scheduler) as spread, progress_bar("NSGA-II") as progress:
        search = nsga2(
            spread, population, generations, seed=seed, progress=progress, checkpoint=checkpoint
        )
    front = search.front
    columns = {"mean sum [1]": front.mean_sum, "sigma sum [1]": front.sigma_sum}
    designs = dict(zip(space.labels, front.designs.T, strict=True))
    return StudyResult(
        tables={"front": pd.DataFrame(columns | designs)},
        figures={},
        summary={"n_evaluated": search.n_evaluated},
        page=Page(title="QUAD2", question="", sections=(), provenance={}),
        inputs=inputs,
    )


if __name__ == "__main__":
    run_script(__file__)
