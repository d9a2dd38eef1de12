"""The command line of results and platforms: runs, reports, deliveries, a folder to fill in."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from deboom.explore.choices import Pick, pick_or_file
from deboom.files.kinds import FolderKind, FunctionFiles
from deboom.language import Language

# Any: a pick or a path, which the parser tells apart
DESIGN = Annotated[
    Any,
    typer.Option(
        parser=pick_or_file,
        metavar="PICK|FILE",
        help=f"Design of the front: {', '.join(Pick)}; or one that the interactive page saved.",
    ),
]
STUDIES = Annotated[
    Path | None,
    typer.Option(help="Folder with the script of the run; default: the studies of deboom."),
]


def list_(
    results: Annotated[Path, typer.Argument(help="Folder with results.")] = Path("results"),
    html: Annotated[bool, typer.Option("--html", hidden=True)] = False,
) -> None:
    """List finished, running and unfinished runs: question, seed, date and headline numbers.

    An unfinished run was interrupted. `deboom run STUDY --resume RUN` continues it. `deboom serve`
    shows all runs in the browser.
    """
    from deboom.errors import InputError
    from deboom.runs.overview import list_lines

    if html:
        raise InputError(
            f"--html is no option any more: `deboom serve {results.as_posix()}` shows all runs in "
            "the browser"
        )
    for line in list_lines(results):
        typer.echo(line)


def show(
    run: Annotated[Path, typer.Argument(help="Folder or name of a run; see `deboom list`.")],
    keys: Annotated[
        bool,
        typer.Option("--keys", help="Show unit and meaning of each key of summary.json instead."),
    ] = False,
) -> None:
    """Show one run: question, answer, options, numbers, versions, and if a file was edited."""
    from deboom.files.run_folder import read_run
    from deboom.runs.overview import key_lines, show_lines

    for line in (key_lines if keys else show_lines)(read_run(run)):
        typer.echo(line)


def report(
    run: Annotated[
        Path, typer.Argument(help="Folder of a finished run: a front, sensitivity or correlation.")
    ],
    supplier: Annotated[
        bool, typer.Option("--supplier", help="Write sheets that a supplier can quote and sign.")
    ] = False,
    interactive: Annotated[
        bool, typer.Option("--interactive", help="Write a page with sliders, to explore designs.")
    ] = False,
    beside: Annotated[
        Path | None, typer.Option(help="Run whose front is drawn next to that of RUN.")
    ] = None,
    vehicle: Annotated[
        list[str] | None,
        typer.Option(help="Vehicle of the interactive page; repeatable; default: all."),
    ] = None,
    mount: Annotated[
        str | None, typer.Option(help="Mount of the sheet; default: one sheet for each mount.")
    ] = None,
    anonymous: Annotated[
        bool,
        typer.Option(
            "--anonymous",
            help="Replace names of vehicles by letters, and leave out limits and levels.",
        ),
    ] = False,
    decibels: Annotated[
        bool,
        typer.Option(help="Say on the sheet what parts and tolerances bring in the cabin."),
    ] = True,
    design: DESIGN = Pick.best_mean,
    box: Annotated[
        Path | None, typer.Option(help="Acceptance box, or a run of solution_box.")
    ] = None,
    tolerances: Annotated[Path | None, typer.Option(help="Run of tolerance_allocation.")] = None,
    sharing: Annotated[Path | None, typer.Option(help="Run of commonality.")] = None,
    since: Annotated[
        Path | None, typer.Option(help="Workbook of an older sheet; changes since then are marked.")
    ] = None,
    language: Annotated[Language, typer.Option(help="Language of the sheets.")] = Language.en,
    studies: STUDIES = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the files; default: RUN, and RUN/supplier for sheets."),
    ] = None,
) -> None:
    """Write further pages from a finished run: for a mount supplier, or to explore its front.

    --supplier writes two pages of A4 and a workbook for each mount of an engine or, from a run of
    compressor_front, of a compressor. They state one new stiffness, one band and one
    state per direction, the test of a part, the rules of acceptance, the demands on the process,
    and the worth of a better process. Bands and limits come from --box, or bands from --tolerances
    if there is no box, and part numbers from --sharing. programme.toml beside the platform gives
    drawing, volumes, weight forces and test conditions. From a run of sensitivity, the page
    shows the share of each direction in the noise, per vehicle. An existing sheet is not
    overwritten: give --out for the next revision.

    --interactive writes one offline page that contains the model. Sliders change every stiffness;
    the page computes the levels of all vehicles with their scatter, and improves a design within
    limits. In its lower part you select, pin and hear designs of a front or an experiment. --beside
    adds another front, and --vehicle chooses vehicles if the page would be too large. The model is
    built again from the options of the run; edited files are refused.
    """
    from deboom.errors import InputError

    if not (supplier or interactive):
        raise InputError(
            f"{run / 'report.html'} is the page of the run itself; say --supplier for the one "
            "that a mount supplier reads, --interactive for the one to explore the front"
        )
    if vehicle and not interactive:
        raise InputError("--vehicle belongs to --interactive: sheets are for all vehicles")
    if interactive:
        if anonymous or (not supplier and any((mount, box, tolerances, sharing, since))):
            raise InputError(
                "--anonymous, --mount, --box, --tolerances, --sharing and --since belong to "
                "--supplier: the other page shows everything by its name"
            )
        from deboom.runs.interactive_page import write_interactive_page

        page = write_interactive_page(
            run, studies=studies, out=out, beside=beside, vehicles=vehicle or ()
        )
        typer.echo(page.as_posix())
    if not supplier:
        return
    from deboom.runs.supplier_sheets import supplier_sheets
    from deboom.supplier.sources import SheetFiles

    if since is not None and mount is None:
        raise InputError("--since compares the sheets of one mount: say --mount")
    written = supplier_sheets(
        run,
        mount=mount,
        anonymous=anonymous,
        out=out,
        studies=studies,
        pick=design,
        files=SheetFiles(box, tolerances, sharing, since),
        language=language,
        decibels=decibels,
    )
    if written.missing:
        fields = ", ".join(written.missing)
        typer.echo(f"to be agreed, not in programme.toml: {fields}", err=True)
    for path in written.files:
        typer.echo(path.as_posix())


def listen(
    run: Annotated[Path, typer.Argument(help="Folder of a finished front study.")],
    design: DESIGN = Pick.best_mean,
    seconds: Annotated[float, typer.Option(help="Length of the run-up, 1 to 120 s.")] = 10.0,
    studies: STUDIES = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the WAV files; default: RUN/listen.")
    ] = None,
) -> None:
    """Hear a front: the run-up at the driver's ear with today's mounts and with a pick, as WAV.

    You hear the model; the page of the run says what cars are expected to show. All files have
    the same full scale, stated in pascals in listen.json, so that you can compare loudness. Only
    the engine order of the study is heard, from the first to the last frequency of its band, at a
    constant rise of speed. Use headphones: small loudspeakers do not play 20 to 60 Hz.

    `deboom look` tells how loud and how rough two of them are: a table beside each file has its
    calibration.

    Try: deboom listen results/front/RUN --seconds 15
    """
    from deboom.runs.listen import write_run_ups

    for path in write_run_ups(run, pick=design, seconds=seconds, studies=studies, out=out):
        typer.echo(path.as_posix())


def serve(
    results: Annotated[Path, typer.Argument(help="Folder with results.")] = Path("results"),
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port on this computer; 0 takes a free port.")
    ] = 0,
) -> None:
    """Look at results in the browser while searches run: fronts grow, runs are side by side.

    The page shows the results of the other commands and changes nothing. It is available on this
    computer only, at the printed address. The address contains a secret, so do not pass it on.
    Ctrl+C ends the server.

    Needs `pip install 'deboom[serve]'`. Try: deboom serve --port 8050
    """
    try:
        from deboom.runs.serve import serve_results
    except ModuleNotFoundError as error:
        from deboom.errors import InputError

        raise InputError(f"deboom serve needs {error.name}: pip install 'deboom[serve]'") from error

    for address in serve_results(results, port=port):
        typer.echo(address)


def evaluate(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="PLATFORM|RUN",
            help="Folder with platform.toml, u06 for the demonstration, or a run.",
        ),
    ],
    designs: Annotated[
        Path | None,
        typer.Argument(
            metavar="DESIGNS", help="Table of designs, .csv or .xlsx, or Dakota's parameters file."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Table of results, .csv or .xlsx, or Dakota's file."),
    ] = None,
    stdin: Annotated[
        bool, typer.Option("--stdin", help="Read lines of CSV, and answer each with one line.")
    ] = False,
    verified: Annotated[
        bool, typer.Option("--verified", help="Add the numbers that verify a front.")
    ] = False,
    draws: Annotated[
        int | None,
        typer.Option(help="Draws of the scatter of a platform, a power of two; default: 128."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of these draws; default: 1.")] = None,
    studies: STUDIES = None,
) -> None:
    """Evaluate designs for another program, such as modeFRONTIER, optiSLang, HEEDS or Dakota.

    DESIGNS has a column per variable, as `deboom.write_designs` writes it. Each row of the results
    has the sums of mean and sigma as a search sees them, level, sigma and loudest line of each
    vehicle, by how much the design is beyond each limit, and the rise of a booming peak. A row
    that cannot be computed has the reason in the column error; the exit code is 3 then, after all
    rows. A run has its own draws, seed, bounds and limits; the numbers are those of its front.csv.

    With --stdin the first line has the headers, and each line is answered at once. --verified adds
    the columns under the draws of the verification, which no search should see.

    Try: deboom evaluate my_platform designs.csv -o results.csv
    """
    from deboom.errors import InputError
    from deboom.files.dakota import is_dakota
    from deboom.runs.evaluate import evaluate_dakota, evaluate_lines, evaluate_table, opened_node

    if stdin == (designs is not None) or stdin == (out is not None):
        raise InputError("give DESIGNS with -o RESULTS, or --stdin alone")
    node = opened_node(source, draws=draws, seed=seed, verified=verified, studies=studies)
    failed = 0
    if designs is None or out is None:
        for line, is_failed in evaluate_lines(node, sys.stdin):
            typer.echo(line, nl=False)
            failed += is_failed
    else:
        failed = (evaluate_dakota if is_dakota(designs) else evaluate_table)(node, designs, out)
    if failed:
        typer.echo(f"deboom: designs that could not be computed: {failed}", err=True)
        raise typer.Exit(3)


def new(
    kind: Annotated[FolderKind, typer.Argument(help="Kind of measurement.")],
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder to make; it must not exist.")
    ],
    mount: Annotated[
        list[str] | None,
        typer.Option(
            help="Name of a mount, or NAME=left,right for two pieces of one part; repeatable."
        ),
    ] = None,
    vehicle: Annotated[
        list[str] | None, typer.Option(help="Name of a vehicle; repeatable.")
    ] = None,
    group: Annotated[str, typer.Option(help="Group of the vehicles.")] = "cars",
    load_case: Annotated[list[str] | None, typer.Option(help="Name of a run; repeatable.")] = None,
    files: Annotated[
        FunctionFiles, typer.Option(help="Format of the functions over frequency.")
    ] = FunctionFiles.uff,
) -> None:
    """Write a folder to fill in with measurements of your own.

    KIND is platform for noise transfer functions of vehicles and operating spectra at their mounts;
    campaign for runs of a powertrain on a bench, which characterise mounts; vehicle for one car
    with noise transfer functions measured in both directions; compressor for a roving-hammer test;
    operation for run-ups of a compressor; car for an electric car with its compressor; component
    for component TPA; hammer for hits over time.

    --mount names a mount of a platform, campaign or vehicle; =left,right names the pieces of one
    part number. The folder contains a TOML file with a comment on each key, tables with their
    columns and units, and a README. `deboom check FOLDER` lists what you still have to fill in.

    Try: deboom new platform my_platform --mount EnM --mount Du=left,right --vehicle car-1
    """
    from deboom.errors import InputError
    from deboom.files.folders import Names, first_steps, new_folder

    if kind is not FolderKind.platform and (vehicle or load_case):
        raise InputError("--vehicle and --load-case belong to a platform: leave them out")
    names = Names(
        mounts=mount or Names.mounts,
        vehicles=vehicle or Names.vehicles,
        group=group,
        load_cases=load_case or Names.load_cases,
        files=files,
    )
    new_folder(folder, kind, names)
    for line in first_steps(folder, kind):
        typer.echo(line, err=True)
    typer.echo(folder.as_posix())


def check(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER",
            help="Folder of any kind that `deboom new` writes, or u06, the demonstration.",
        ),
    ],
) -> None:
    """List what is missing or wrong in a folder of measurements, or show what was read.

    The kind of the folder follows from its file, such as platform.toml or campaign.toml. The checks
    have four stages: keys of this file, tables, files of functions, physics. The command lists all
    faults of the first stage that has any, and names the stages that it did not reach. Each fault
    names its file, the item and the remedy; the exit code is 2. Without a fault the command shows
    what was read, such as mounts, vehicles, lines and runs; the exit code is 0.
    """
    from deboom.files.check import check_folder
    from deboom.files.platform import platform_folder

    faults, waiting, summary = check_folder(platform_folder(folder))
    for number, fault in enumerate(faults, 1):
        typer.echo(f"{number:3}  {fault}", err=True)
    if faults:
        more = f"; not looked at yet: {', '.join(waiting)}" if waiting else ""
        what = "fault" if len(faults) == 1 else "faults"
        typer.echo(f"deboom: {len(faults)} {what} in {folder}{more}", err=True)
        raise typer.Exit(2)
    typer.echo(summary)


def thesis(
    out: Annotated[Path, typer.Option(help="Folder of all results.")] = Path("results"),
) -> None:
    """Run what the thesis of deboom's method ran, and write its figures and numbers side by side.

    The page follows the chapters of the thesis: each figure and table with its command, its
    picture, and the numbers of the runs next to those that the thesis prints. Everything runs on
    the virtual test bench and takes about a quarter of an hour. Finished runs of the same code are
    not run again, so an interrupted call goes on. The last line of the output is the page.
    """
    from deboom.runs.thesis import rerun_thesis

    typer.echo(rerun_thesis(out).as_posix())
