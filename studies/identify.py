"""Identify a mounted compressor from its roving-hammer test.

FOLDER has compressor_test.toml, the position sheet (xlsx or CSV), frf.uff and coherence.uff,
or the hits over time in hits/. `deboom bench compressor FOLDER` writes a virtual one. Without
FOLDER a virtual compressor is measured, identified and compared with its truth: --seed 1 has the
mounts of the thesis's table 11, other seeds have random mounts.

The model is a rigid body on rubber mounts with a complex gain (thesis, 4.1 to 4.4). Centre of
gravity, inertia, the stiffness at the virtual point and the gain are fitted to the raw FRFs,
together with all errors of gain, position and angle (self-calibration).

Results: mass, centre of gravity, inertia, stiffness at the virtual point and the gain of the
rubber, each with its standard deviation; compressor_model.json, which other studies load; tables,
figures and report.html, which also says what the test cannot show. The test calibrates sensors and
impacts within the tolerances in compressor_test.toml, so state honest tolerances, and weigh the
compressor (weighed_mass_kg).

Check three things before you trust the result: the residuals over noise, the held-out lines, and
the checks of the test. reduced_chi2 should be near 1; above 2.25 it raises an alarm, for example
for a flexible receiver, hoses or unequal mounts. Alarms are printed and counted in summary.json
(n_alarms). If the model does not fit, its standard deviations are increased by the size of the
residuals. The output is the run folder; if there are alarms, a last line on the error stream says
"with alarms".

On virtual compressors the placement of sensors limits the accuracy, not noise (docs/validation.md).
Such a test can identify only 35 combinations of the thesis's 44 parameters. Position, rotation and
stiffness of single mounts cannot be identified, unless all mounts are one round part
(--identical-mounts).

Try: deboom bench compressor test, then deboom identify test
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from deboom.bench.choices import CalibrationLevel
from deboom.compressor.identification_results import CompressorTruth
from deboom.compressor.identified_compressor import IdentifyOptions
from deboom.compressor.inertance_fit import THESIS_BANDS
from deboom.errors import InputError
from deboom.measurement.compressor_test import InertanceTest, refuse_contradictions
from deboom.measurement.free_body import free_body
from deboom.measurement.virtual_point import (
    impact_geometry,
    sensor_geometry,
    virtual_point,
    virtual_point_frf,
)
from deboom.pages.identification import free_body_report, identification_report
from deboom.progress import counted, progress_bar
from deboom.report import Report
from deboom.runs.compressor_tests import (
    IDENTIFICATION_STEPS,
    Beside,
    identified_test,
    identified_virtual,
    read_test,
)
from deboom.runs.options import BAND, IdenticalMounts, Level, WithTruth, band_of

QUESTION = "Which compressor, or which free body, explains this hammer test?"


@dataclass(frozen=True)
class Options:
    """Which test is identified, from which lines, and what is free beside."""

    folder: Annotated[
        Path | None,
        Argument(help="Folder with compressor_test.toml; default: a virtual compressor."),
    ] = None
    seed: Annotated[int, Option(help="Seed of the virtual compressor, 1 or higher.")] = 1
    level: Level = CalibrationLevel.C2
    band: Annotated[
        list[str] | None,
        Option(
            "--band",
            "--bands",
            metavar=BAND,
            help="Band of the fit [Hz]; repeatable. Default: 10 30 (mounts) and 100 150 "
            "(mass line).",
        ),
    ] = None
    lines: Annotated[
        int,
        Option(
            help="Largest number of lines in the fit; of more lines an even selection is taken."
        ),
    ] = 72
    smallest_coherence: Annotated[
        float, Option(help="Smallest median of the coherence; below it nothing is identified.")
    ] = 0.8
    from_hits: Annotated[bool, Option(help="Compute the FRFs from the hits over time.")] = False
    thesis: Annotated[
        bool, Option(help="With a drawing, also fit position, tilt and stiffness of each mount.")
    ] = True
    identical_mounts: IdenticalMounts = False
    truth: WithTruth = False
    free: Annotated[
        bool,
        Option(
            "--free",
            help="The body is freely suspended: fit mass, centre of gravity and inertia to its "
            "mass lines. It works with --band (once), --from-hits, --truth, --hung and --out only.",
        ),
    ] = False
    hung: Annotated[
        bool, Option("--hung", help="With --free, also fit the cords of the suspension.")
    ] = False

    @property
    def bands(self) -> tuple[tuple[float, float], ...]:
        """Lines to fit, from and to [Hz]; empty where none are given."""
        return tuple(band_of(text) for text in self.band or ())


@dataclass(frozen=True, eq=False)
class Model:
    """A hammer test in a folder, with the truth of a virtual one where that is wanted."""

    folder: Path
    test: InertanceTest
    truth: CompressorTruth | None
    fit: IdentifyOptions


def prepare(options: Options) -> Model | None:
    """Read the test; None where a virtual compressor is to be measured."""
    fit = IdentifyOptions(
        bands=options.bands or THESIS_BANDS,
        largest_lines=options.lines,
        smallest_coherence=options.smallest_coherence,
    )
    if options.folder is None:
        if options.free or options.from_hits or fit != IdentifyOptions():
            raise InputError(
                "--free, --from-hits, --band, --lines and --smallest-coherence are for measured "
                "data: name the FOLDER"
            )
        return None
    test, truth = read_test(options.folder, from_hits=options.from_hits, truth=options.truth)
    return Model(options.folder, test, truth, fit)


def run(model: Model | None, options: Options) -> Report:
    """Identify the compressor, or the free body, and report it."""
    if model is not None and options.free:
        return _free_body(model, options)
    beside = Beside(thesis=options.thesis, identical_mounts=options.identical_mounts)
    with progress_bar("identify") as progress:
        step = counted(progress, IDENTIFICATION_STEPS)
        if model is None:
            print(f"no FOLDER: the virtual compressor of seed {options.seed}", file=sys.stderr)
            return identification_report(
                identified_virtual(options.seed, options.level, beside, step)
            )
        identified = identified_test(model.test, model.truth, model.fit, beside, step, model.folder)
    alarms = identified.identification.alarms
    for alarm in alarms:
        print(f"alarm: {alarm}", file=sys.stderr)
    if alarms:
        print(f"identified with alarms: {len(alarms)}", file=sys.stderr)
    return identification_report(identified, identified.input_files)


def _free_body(model: Model, options: Options) -> Report:
    """Fit the mass lines of a free or softly hung body, and report them."""
    test, truth = model.test, model.truth
    refuse_contradictions(test)
    inertance = virtual_point_frf(
        test.frf,
        response=virtual_point(sensor_geometry(test.sensors)),
        excitation=virtual_point(impact_geometry(test.impacts)),
    )
    lines, weighed = inertance.frequency, test.weighed_mass
    free = free_body(
        lines,
        inertance.values,
        band=options.bands[0] if options.bands else None,
        hung=options.hung,
        weighed=None if weighed is None else (weighed, test.weighed_mass_deviation),
        gain_deviation=max(test.tolerances.sensor_gain, test.tolerances.hammer_gain),
    )
    return free_body_report(test, inertance, free, truth)
