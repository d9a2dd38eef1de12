"""The command line of the running compressor: sweeps become unbalance, forces and verdicts."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer


class RouteChoice(Enum):
    """Whose numbers are headline and verdict."""

    auto = "auto"
    a = "a"
    b = "b"
    c = "c"
    d = "d"
    e = "e"


class HoseChoice(Enum):
    """Which sweeps are evaluated."""

    soft = "soft"
    standard = "standard"


class SenseChoice(Enum):
    """Sense of rotation about x."""

    positive = "positive"
    negative = "negative"


def unbalance(
    folder: Annotated[Path, typer.Argument(help="Folder with operation.toml.")],
    limits: Annotated[
        Path | None,
        typer.Option(
            help="TOML file of limits: pass, fail or undecided for each, and supplier_sheet.html "
            "and .xlsx in the run folder."
        ),
    ] = None,
    route: Annotated[
        RouteChoice,
        typer.Option(
            help="Whose numbers count. a: measured apparent mass (thesis); b: model at the virtual "
            "point; c: self-calibrated model; d: measured, self-calibrated; e: c with mounts "
            "brought up to date by the sweep. auto: d, or e where the mounts have changed, no "
            "hoses are seen in the sweeps and the hammer test gave no alarm."
        ),
    ] = RouteChoice.auto,
    identified: Annotated[
        Path | None,
        typer.Option(
            help="Run of `deboom identify` on this hammer test, or its compressor_model.json: its "
            "bands are fitted again. Another hammer test is refused."
        ),
    ] = None,
    hoses: Annotated[
        HoseChoice | None,
        typer.Option(help="Sweeps with these hoses. Default: soft ones where there are any."),
    ] = None,
    sense: Annotated[
        SenseChoice | None,
        typer.Option(
            help="Sense of rotation about x, positive from y to z; the sweeps must agree. "
            "Default: as they say."
        ),
    ] = None,
    band: Annotated[
        str, typer.Option(metavar="LOW-HIGH", help="Lines of the fit over all sweeps [Hz].")
    ] = "17-150",
    confidence: Annotated[float, typer.Option(help="Of bands and intervals.")] = 0.95,
    out: Annotated[
        Path, typer.Option(help="Folder that gets unbalance/<run>/ with all results.")
    ] = Path("results"),
    figures: Annotated[bool, typer.Option(help="Draw figures; without, tables alone.")] = True,
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
    from deboom.files.component_limits import read_component_limits
    from deboom.measurement.operating_sweep import HoseState
    from deboom.study.band_option import band_of
    from deboom.study.compressor_unbalance import UnbalancePlan
    from deboom.study.compressor_unbalance_command import unbalance_into_run
    from deboom.study.progress import progress_bar
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        options = UnbalanceOptions(
            hoses=None if hoses is None else HoseState(hoses.value),
            expected_sense=None if sense is None else RotationSense[sense.name.upper()],
            band=band_of(band),
            confidence=confidence,
        )
        plan = UnbalancePlan(
            route=route.value,
            unbalance=options,
            limits=None if limits is None else read_component_limits(limits),
            identified=identified,
        )
        with progress_bar("unbalance") as progress:
            run, decision = unbalance_into_run(folder, out, plan, progress, with_figures=figures)
    if decision:
        typer.echo(decision)
    typer.echo(run.as_posix())
