"""How much quieter do the vehicles become if all mounts are softer by the same factor?"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
from typer import Option

from deboom import plot
from deboom.report import Report
from deboom.runs.options import Seed
from deboom.runs.platform_options import MotionOptions, PlatformOptions


@dataclass(frozen=True)
class Options:
    """How far the mounts may be softened, on which platform."""

    seed: Seed = 1
    softest: Annotated[float, Option(help="Smallest common factor [1].")] = 0.8
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()


def prepare(options: Options) -> Any:
    """Read the platform and build its model."""
    return options.motion.model(options.platform.runs())


def run(model: Any, options: Options) -> Report:
    """Evaluate common factors and report."""
    factor = np.linspace(options.softest, 1.0, 9)
    levels = model(factor[:, np.newaxis] * np.ones(len(model.variable_names))) / model.n_lines
    mean = levels.mean(axis=1)
    best = int(mean.argmin())
    report = Report("All mounts softer alike")
    report.number("best_factor", factor[best], "1", "quietest common factor", headline=".2f")
    change = mean[best] - mean[-1]
    report.number("change_db", change, "dB", "mean change of the level there", headline="+.1f")
    report.section("Levels", "Mean level of the lines, per vehicle.")
    curves = dict(zip(model.response_names, levels.T, strict=True))
    panel = plot.CurvePanel("all mounts alike", factor, curves)
    picture = plot.curve_panels([panel], x_label="common factor [1]", y_label="level [dB(A)]")
    report.figure("levels", picture, "Level over the common factor.")
    frame = pd.DataFrame({"factor [1]": factor, "mean level [dB(A)]": mean})
    report.table("levels", frame, "Mean over the vehicles.")
    return report
