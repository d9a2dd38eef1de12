"""The command line of the compressor: a hammer test becomes an identified model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def identify(
    folder: Annotated[Path, typer.Argument(help="Folder with compressor_test.toml.")],
    out: Annotated[
        Path, typer.Option(help="Folder that gets identify/<run>/ with all results.")
    ] = Path("results"),
    band: Annotated[
        list[str] | None,
        typer.Option(
            "--band",
            "--bands",
            metavar="LOW-HIGH",
            help="Lines to fit [Hz]; repeatable. Default 10-30 and 100-150: the rigid-body modes, "
            "which know the mounts, and the mass line.",
        ),
    ] = None,
    lines: Annotated[
        int, typer.Option(help="Of the fit at most; denser ones are thinned evenly.")
    ] = 72,
    smallest_coherence: Annotated[
        float, typer.Option(help="Median below which nothing is identified.")
    ] = 0.8,
    held_out: Annotated[
        int, typer.Option(help="Predict every n-th impact from the others; 0 leaves it out.")
    ] = 6,
    from_hits: Annotated[
        bool, typer.Option(help="From the blocks over time, not from the FRFs.")
    ] = False,
    thesis: Annotated[
        bool,
        typer.Option(help="With a drawing: also fit each mount's place, tilt and stiffness."),
    ] = True,
    reference: Annotated[
        bool, typer.Option(help="These by a second optimiser as well (SLSQP).")
    ] = False,
    identical_mounts: Annotated[
        bool,
        typer.Option(
            help="All mounts are one round part: find where each sits and how it leans. Needs a "
            "drawing; the report says whether the test agrees.",
        ),
    ] = False,
    figures: Annotated[bool, typer.Option(help="Draw figures; without, tables alone.")] = True,
) -> None:
    """Identify a mounted compressor from its roving-hammer test.

    FOLDER holds compressor_test.toml, the position sheet (xlsx or CSV), frf.uff and coherence.uff,
    or the hits over time in hits/. `deboom bench compressor FOLDER` writes a virtual one.

    What comes out: mass, centre of gravity, inertia, stiffness at the virtual point and the gain of
    the rubber, each with its standard deviation; compressor_model.json, which other studies load;
    tables, figures and report.html, which also says what the test cannot tell. Sensors and impacts
    are calibrated by the test itself, within the tolerances that compressor_test.toml states: state
    them honestly, and weigh the compressor (weighed_mass_kg).

    Look at three things before you trust it: residuals over noise (reduced_chi2 near 1; above 2.25
    is an alarm: a flexible receiver, hoses, unequal mounts), the held-out impacts, and the checks
    of the test. The last line of the output is the run folder.

    deboom bench compressor test, then deboom identify test.
    """
    from deboom.compressor.identify import IdentifyOptions
    from deboom.compressor.objectives import THESIS_BANDS
    from deboom.study.band_option import band_of
    from deboom.study.compressor_identification import Beside
    from deboom.study.compressor_identify_command import identify_into_run
    from deboom.study.progress import progress_bar
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        options = IdentifyOptions(
            bands=tuple(band_of(text) for text in band) if band else THESIS_BANDS,
            largest_lines=lines,
            smallest_coherence=smallest_coherence,
            held_out=held_out,
        )
        beside = Beside(thesis=thesis, reference=reference, identical_mounts=identical_mounts)
        with progress_bar("identify") as progress:
            run = identify_into_run(
                folder,
                out,
                options,
                beside,
                progress,
                from_hits=from_hits,
                with_figures=figures,
            )
    typer.echo(run.as_posix())
