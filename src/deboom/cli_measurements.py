"""The command line of measurements: hammer tests, sweeps, order tracking, the mount library."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from deboom.choices import SofteningLaw


def identify(
    folder: Annotated[Path, typer.Argument(help="Folder with compressor_test.toml.")],
    out: Annotated[Path, typer.Option(help="Folder that gets identify/<run>/.")] = Path("results"),
    band: Annotated[
        list[str] | None,
        typer.Option(
            "--band",
            "--bands",
            metavar="LOW-HIGH",
            help="Lines to fit [Hz]; repeatable. Default 10-30 (mounts) and 100-150 (mass line).",
        ),
    ] = None,
    lines: Annotated[
        int, typer.Option(help="Most lines of the fit; denser ones are thinned evenly.")
    ] = 72,
    smallest_coherence: Annotated[
        float, typer.Option(help="Median below which nothing is identified.")
    ] = 0.8,
    from_hits: Annotated[
        bool, typer.Option(help="From the blocks over time, not from the FRFs.")
    ] = False,
    thesis: Annotated[
        bool, typer.Option(help="With a drawing: also each mount's place, tilt and stiffness.")
    ] = True,
    identical_mounts: Annotated[
        bool, typer.Option(help="With a drawing: place and lean of mounts of one round part.")
    ] = False,
    truth: Annotated[
        bool, typer.Option(help="Compare with truth/ of a virtual test, else never opened.")
    ] = False,
    free: Annotated[
        bool,
        typer.Option(
            "--free",
            help="The body hangs free: mass, centre of gravity and inertia from its mass lines. "
            "Of the other options --band (one), --from-hits, --truth, --hung and --out count.",
        ),
    ] = False,
    hung: Annotated[
        bool, typer.Option("--hung", help="With --free: fit the cords that it hangs from as well.")
    ] = False,
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
    is an alarm: a flexible receiver, hoses, unequal mounts), the held-out lines, and the checks
    of the test. Alarms go to the console and, counted, into summary.json (n_alarms): the standard
    deviations of a model that misses the test have grown by what its residuals say. The output is
    the run folder; a last line on the error stream says "with alarms" where there are any.

    deboom bench compressor test, then deboom identify test.
    """
    from deboom.compressor.identify import IdentifyOptions
    from deboom.compressor.virtual_point_fit import THESIS_BANDS
    from deboom.pages.compressor_identification import Beside
    from deboom.runs.identify import free_body_into_run, identify_into_run
    from deboom.runs.options import band_of
    from deboom.runs.progress import progress_bar

    if free:
        lines_of_fit = None if band is None else band_of(band[0])
        run = free_body_into_run(
            folder, out, lines_of_fit, hung=hung, from_hits=from_hits, with_truth=truth
        )
        typer.echo(run.as_posix())
        return
    options = IdentifyOptions(
        bands=tuple(band_of(text) for text in band) if band else THESIS_BANDS,
        largest_lines=lines,
        smallest_coherence=smallest_coherence,
    )
    beside = Beside(thesis=thesis, identical_mounts=identical_mounts)
    with progress_bar("identify") as progress:
        run, alarms = identify_into_run(
            *(folder, out, options, beside, progress), from_hits=from_hits, with_truth=truth
        )
    for alarm in alarms:
        typer.echo(f"alarm: {alarm}", err=True)
    typer.echo(run.as_posix())
    if alarms:
        typer.echo(f"identified with alarms: {len(alarms)}", err=True)


def unbalance(
    folder: Annotated[Path, typer.Argument(help="Folder with operation.toml.")],
    limits: Annotated[Path | None, typer.Option(help="TOML file of limits to judge by.")] = None,
    route: Annotated[
        Literal["auto", "a", "b", "c", "d", "e"], typer.Option(help="Route whose numbers count.")
    ] = "auto",
    identified: Annotated[
        Path | None, typer.Option(help="Run of `deboom identify`, whose bands are fitted again.")
    ] = None,
    hoses: Annotated[
        Literal["soft", "standard"] | None, typer.Option(help="Hoses of the sweeps; default: soft.")
    ] = None,
    sense: Annotated[
        Literal["positive", "negative"] | None,
        typer.Option(help="Rotation about x that sweeps must show; default: any."),
    ] = None,
    band: Annotated[
        str, typer.Option(metavar="LOW-HIGH", help="Lines of the fit over all sweeps [Hz].")
    ] = "17-150",
    confidence: Annotated[float, typer.Option(help="Confidence of bands and intervals.")] = 0.95,
    softening: Annotated[
        SofteningLaw, typer.Option(help="Law of mounts that soften with their own stroke, route e.")
    ] = SofteningLaw.PARABOLA,
    truth: Annotated[
        bool, typer.Option(help="Compare with truth/ of a virtual test, else never opened.")
    ] = False,
    out: Annotated[Path, typer.Option(help="Folder that gets unbalance/<run>/.")] = Path("results"),
) -> None:
    """Find the unbalance of a running compressor, and judge it against limits.

    FOLDER holds operation.toml, the hammer test on the resting compressor (hammer/) and sweeps over
    speed as spectra of first order or over time with a tacho. `deboom bench operation FOLDER`
    writes a virtual one.

    What comes out: static and dynamic unbalance with their intervals, gas forces, sense of
    rotation, the load inside over speed with its confidence band, and which lines cannot be trusted
    and why; five routes side by side; tables, figures and report.html.

    Look at three things before you trust it: residuals over noise, the state of the mounts (what
    ran is not always what was struck; then route e), and the hatched speeds. That y and z agree
    proves nothing: a gas force that turns with the rotor agrees as well.

    Routes. a: measured apparent mass (thesis); b: model at the virtual point; c: self-calibrated
    model; d: measured, self-calibrated; e: c with mounts brought up to date by the sweep. auto: d,
    or e where the mounts have changed, no hoses are seen and the hammer test gave no alarm. With
    --identified, another hammer test than that of the run is refused. With --limits the run folder
    gets supplier_sheet.html and .xlsx.

    A file of limits:

    \b
    format = 1
    risk_percent = 5.0
    [static_unbalance]
    at_most_g_mm = 25.0
    [dynamic_unbalance]
    at_most_g_mm2 = 1500.0
    [[stiffness]]
    direction = "x"
    from_hz = 20.0
    to_hz = 60.0
    at_least_n_per_mm = 60.0
    at_most_n_per_mm = 90.0

    [[stiffness]] is |K| of the compressor on its mounts at the origin of the position sheet;
    [[rotational_stiffness]] has directions rx, ry, rz and at_most_n_m_per_rad. A limit passes where
    the value keeps a guard band away from it, so that a bad part passes with at most risk_percent
    probability; it fails outside; in between it is undecided, and the sheet says what would decide.

    The last line of the output is the run folder; before it, with limits, the verdict.

    deboom bench operation test, then deboom unbalance test --limits limits.toml.
    """  # noqa: D301 - a real backspace keeps the lines of the file apart in the help
    from deboom.compressor.unbalance import UnbalanceOptions
    from deboom.compressor.unbalance_load import RotationSense
    from deboom.files.limits import read_component_limits
    from deboom.measurement.compressor_test import HoseState
    from deboom.pages.compressor_unbalance import UnbalancePlan
    from deboom.runs.options import band_of
    from deboom.runs.progress import progress_bar
    from deboom.runs.unbalance import unbalance_into_run

    options = UnbalanceOptions(
        hoses=None if hoses is None else HoseState(hoses),
        expected_sense=None if sense is None else RotationSense[sense.upper()],
        band=band_of(band),
        confidence=confidence,
        softening=softening,
    )
    plan = UnbalancePlan(
        route=route,
        unbalance=options,
        limits=None if limits is None else read_component_limits(limits),
        identified=identified,
        truth=truth,
    )
    with progress_bar("unbalance") as progress:
        run, decision = unbalance_into_run(folder, out, plan, progress)
    if decision:
        typer.echo(decision)
    typer.echo(run.as_posix())


def orders(
    campaign: Annotated[Path, typer.Argument(help="Folder with campaign.toml.")],
    time_run: Annotated[str, typer.Argument(help="One of its [[time_runs]].")],
    name: Annotated[
        str | None, typer.Option(help="Name of the operating run; default: alike.")
    ] = None,
    bandwidth: Annotated[float, typer.Option(help="Half-power width of the filter [Hz].")] = 3.0,
    other_order: Annotated[
        list[float] | None, typer.Option(help="A strong order beside, for the filter; repeatable.")
    ] = None,
    rpm_from: Annotated[float | None, typer.Option(help="Lowest line; default: the run's.")] = None,
    rpm_to: Annotated[float | None, typer.Option(help="Highest line; default: the run's.")] = None,
    rpm_step: Annotated[float, typer.Option(help="Distance between lines [1/min].")] = 10.0,
) -> None:
    """Make an operating run of a run over time, and add it to its campaign.

    The recording is a file of UFF, MDF, TDMS, HDF5, MATLAB, LabVIEW LVM, or WAV with a table of its
    calibration; docs/guides/your-own-data.md says what each needs.

    The tacho is repaired and gives the shaft's angle; the dominant order of all accelerometers and
    cells becomes complex spectra over engine speed, phase to the tacho, with engine torque and
    static forces at the same lines. The run gets a file (UFF) and an entry in campaign.toml;
    nothing is overwritten. `deboom characterise` uses it like any other run:

    deboom orders CAMPAIGN g5_wot220_time, then deboom characterise CAMPAIGN --library mounts.db.
    Both in one: deboom characterise CAMPAIGN --library mounts.db --time-runs.

    By default the orders beside the dominant one are 0.5, and twice and four times it.

    pulses_per_revolution counts the pitches of the tacho's wheel, missing teeth included, or the
    stripes of its tape. The gap or the seam that comes back with the revolution checks it; a seam
    is corrected. Channels that were sampled more slowly are resampled to the fastest.

    The output says what the spectra resolve: bandwidth, the finest detail that the run-up leaves,
    and what noise and neighbouring orders pretend; what checked the pulses per revolution, or that
    nothing did; and what was resampled.
    """
    from deboom.measurement.order_tracking import TrackingOptions
    from deboom.runs.campaigns import described_orders, orders_into_campaign

    options = TrackingOptions(
        bandwidth=bandwidth,
        other_orders=tuple(other_order) if other_order else None,
        lowest_rpm=rpm_from,
        highest_rpm=rpm_to,
        rpm_step=rpm_step,
    )
    tracked, path = orders_into_campaign(campaign, time_run, options, name)
    for line in described_orders(time_run, tracked, path):
        typer.echo(line)


if TYPE_CHECKING:
    from deboom.mounts.characterised_mount import CharacterisedMount

library_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="The mount library: an SQLite file, or a PostgreSQL URL.",
)

Where = Annotated[
    str, typer.Argument(metavar="LIBRARY", help="A file, or postgresql://user@host/database.")
]
Campaign = Annotated[str | None, typer.Option(help="Only mounts of this campaign.")]
MountName = Annotated[str | None, typer.Option("--mount", help="Only this mount, such as TSM.")]
Variant = Annotated[str | None, typer.Option(help="Only this variant, such as M3.")]
PartNumber = Annotated[str | None, typer.Option(help="Only this part number.")]
Serial = Annotated[str | None, typer.Option(help="Only this serial.")]


@library_app.command("list")
def list_mounts(library: Where) -> None:
    """List the mounts, one a line."""
    import pandas as pd

    from deboom.mounts.library import open_library

    with open_library(library) as opened:
        identities = opened.identities()
    typer.echo(pd.DataFrame(identities).to_string(index=False) if identities else "no mount")


@library_app.command()
def show(
    library: Where,
    campaign: Campaign = None,
    mount: MountName = None,
    variant: Variant = None,
    part_number: PartNumber = None,
    serial: Serial = None,
) -> None:
    """Show one mount: where it sits, and how far to believe each direction."""
    from deboom.mounts.library import open_library

    with open_library(library) as opened:
        matching = opened.identities(
            campaign=campaign, mount=mount, variant=variant, part_number=part_number, serial=serial
        )
        typer.echo(_described(opened.load(opened.only(matching))))


@library_app.command("import")
def import_mounts(
    library: Where,
    file: Annotated[Path, typer.Argument(help="A JSON export of another library.")],
    replace: Annotated[
        bool, typer.Option("--replace", help="Exchange mounts that are there already.")
    ] = False,
) -> None:
    """Import the mounts of a JSON export; a library that is missing is made."""
    from deboom.files.library_export import read_library_json
    from deboom.mounts.library import open_library

    campaigns, mounts = read_library_json(file)
    with open_library(library, create=True) as opened:
        opened.add(campaigns, mounts, replace=replace)
    typer.echo(f"{len(mounts)} mounts imported")


@library_app.command()
def export(
    library: Where,
    file: Annotated[Path, typer.Argument(help="What to write: .xlsx or .json.")],
    campaign: Campaign = None,
    mount: MountName = None,
    variant: Variant = None,
    part_number: PartNumber = None,
    serial: Serial = None,
) -> None:
    """Export mounts: spreadsheet (.xlsx) or everything (.json)."""
    from deboom.errors import InputError
    from deboom.files.library_export import write_library_json, write_library_xlsx
    from deboom.mounts.library import open_library

    with open_library(library) as opened:
        kind = file.suffix.lower()
        if kind not in (".xlsx", ".json"):
            raise InputError(f"{file}: name a file that ends with .xlsx or .json")
        identities = opened.identities(
            campaign=campaign, mount=mount, variant=variant, part_number=part_number, serial=serial
        )
        if not identities:
            raise InputError(f"{opened.name}: no mount fits; `deboom library list` shows them all")
        mounts = [opened.load(identity) for identity in identities]
        names = {identity.campaign for identity in identities}
        campaigns = [record for record in opened.campaigns() if record.name in names]
        write = write_library_xlsx if kind == ".xlsx" else write_library_json
        write(file, campaigns, mounts)
    typer.echo(file.as_posix())


def characterise(
    campaign: Annotated[Path, typer.Argument(help="Folder with campaign.toml.")],
    library: Annotated[str, typer.Option(help="Where mounts go: a file, or a PostgreSQL URL.")],
    mount_set: Annotated[list[str] | None, typer.Option(help="Only this; repeatable.")] = None,
    gear: Annotated[list[int] | None, typer.Option(help="Repeatable; default 5 6 7.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the error budget, from 1.")] = 1,
    replace: Annotated[
        bool, typer.Option("--replace", help="Exchange mounts that are there already.")
    ] = False,
    time_runs: Annotated[
        bool, typer.Option("--time-runs", help="First do `deboom orders` with its time runs.")
    ] = False,
) -> None:
    """Characterise the mounts of a measurement campaign and keep them in a library."""
    from deboom.mounts.characterise import CharacteriseOptions
    from deboom.runs.campaigns import characterise_into_library, described, track_untracked
    from deboom.runs.progress import progress_bar

    with progress_bar("characterise") as progress:
        if time_runs:
            track_untracked(campaign, typer.echo)
        gears = tuple(gear) if gear else CharacteriseOptions().gears
        options = CharacteriseOptions(gears=gears, seed=seed)
        results = characterise_into_library(
            campaign, library, options, progress, mount_sets=mount_set or (), overwrite=replace
        )
    for result in results:
        typer.echo(described(result))
    typer.echo(f"{sum(len(of_set.mounts) for of_set in results)} mounts kept in {library}")


def _described(value: CharacterisedMount) -> str:
    from deboom.mounts.library_tables import direction_table

    identity = [field.name for field in fields(value.identity)]
    directions = direction_table([value]).drop(columns=identity).set_index("axis")
    places = [
        f"{piece or 'virtual point'} at x {x:g}, y {y:g}, z {z:g} m"
        for piece, (x, y, z) in zip(value.mount.pieces, value.mount.positions, strict=True)
    ]
    numbers = [f"{name}: {number:.4g}" for name, number in value.quality.items()]
    heading = ": ".join(filter(None, (str(value.identity), value.mount.description)))
    table = directions.map(_short).T.to_string()
    return "\n".join([heading, *places, *numbers, "", table])


def _short(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if value is None or value != value:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
