"""The command line of deliveries: measured parts against an acceptance box."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def accept(
    box: Annotated[
        Path,
        typer.Argument(help="acceptance_box.json, or the run folder of the study solution_box."),
    ],
    parts: Annotated[Path, typer.Argument(help="Measured parts, xlsx or CSV.")],
    out: Annotated[
        Path, typer.Option(help="Folder that gets accept/<run>/ with all results.")
    ] = Path("results"),
    platform: Annotated[
        Path | None,
        typer.Option(
            help="Folder with platform.toml that the box was found for: then the levels of the "
            "cars that get these parts are predicted."
        ),
    ] = None,
    uncertainty: Annotated[
        float,
        typer.Option(
            help="Of a measured stiffness, relative, expanded to 95 %, such as 0.02: parts nearer "
            "than that to an end of their interval are undecided."
        ),
    ] = 0.0,
    over_today: Annotated[
        bool,
        typer.Option(
            help="The columns are x [1], y [1], z [1]: stiffness over that of today's part, both "
            "measured at one state on one machine.",
        ),
    ] = False,
    seed: Annotated[int, typer.Option(help="From 1. Of the predicted cars.")] = 1,
    template: Annotated[
        bool, typer.Option("--template", help="Write an empty table of parts and stop.")
    ] = False,
) -> None:
    """Hold the measured parts of a delivery against an acceptance box.

    PARTS has one row per part and the columns part, batch, mount, x [N/mm], y [N/mm], z [N/mm]: the
    magnitude of the dynamic stiffness at the condition that the box states. A cell may be empty
    where the box does not limit that axis. --template writes such a table, with a sheet of what to
    measure. A test machine holds one state, the box a mean over a run: with --over-today the
    columns are ratios to today's part at that state.

    What comes out: pass, fail or undecided for every part and batch with the reason, Cp and Cpk per
    axis with their lower bounds, and the levels of the cars that get their mounts from the batch;
    tables, figures and report.html. Keys of summary.json: n_parts, n_passed, n_failed,
    n_undecided; n_batches, n_batches_passed, n_batches_failed; cpk_at_least_smallest (95 %
    confidence), pieces_inside_at_least_smallest (share of a batch inside the box, lower end),
    cars_within_limit_smallest, share_stated. The last line of the output is the run folder.

    deboom run studies/solution_box.py, then deboom accept results/solution_box/RUN parts.xlsx
    --template, fill it in under another name, and deboom accept again.
    """
    from deboom.study.accept_command import accept_into_run, write_parts_template
    from deboom.study.progress import progress_bar
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        if template:
            write_parts_template(box, parts, over_today=over_today)
            typer.echo(parts.as_posix())
            return
        with progress_bar("accept") as progress:
            run = accept_into_run(
                *(box, parts, out, platform, uncertainty, seed, progress), over_today=over_today
            )
    typer.echo(run.as_posix())
