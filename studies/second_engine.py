"""Do mounts characterised under one engine predict the forces of another one?

A mount does not know what it carries (thesis, 3.6.2): the response surfaces that a three-cylinder
engine gave, at the motion and static force that a four-cylinder engine of order 2 measures, must
give the forces that its own cells measure. Without --second the virtual test bench measures both
engines on the same mounts, each with sensors of its own. A user names the campaign of the second
engine, and the first one's campaign or a library.

What it showed on six virtual benches: forces along x are predicted to 1 to 2 % rms, along z to 1 to
6 % (misalignment of two measuring chains). The preload that carries over is the static force along
the mount's main axis; neither wheel torque nor the static force across does. A surface inside its
measured region may still err where all its lines had one amplitude per preload and frequency.

Keys of summary.json, with <dir> such as TSM_x, medians over benches: r2_force_real_<dir>,
r2_force_imag_<dir> [%]; rms_force_percent_<dir> (rms error over rms of the force); peak_db_<dir>
(largest difference of a run's highest force); inside_percent_<dir> (lines within the region that
the mount was measured in; the others are not predicted); truth_error_percent_<dir> (rms error of
|K|, where the truth is known); static_difference_n_<dir> (kinematic model against cells, main
axis); n_benches; seconds (second engine alone).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.errors import InputError
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.operating_map import Preload
from deboom.report import Report
from deboom.study.options import Seed
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext
from deboom.study.second_engine import given_engine, second_engine_result, second_engines

FIGURES = True
"""Whether the report has pictures."""


@dataclass(frozen=True)
class Options:
    """Which engines, on which mounts."""

    seed: Seed = 1
    benches: Annotated[int, Option(help="Virtual benches; medians deserve six.")] = 1
    second: Annotated[Path | None, Option(help="Campaign of the second engine.")] = None
    first: Annotated[Path | None, Option(help="Campaign of the first engine.")] = None
    library: Annotated[str | None, Option(help="Or a library with its mounts.")] = None
    library_campaign: Annotated[str | None, Option(help="Whose mounts in the library.")] = None
    mount_set: Annotated[str, Option(help="Parts under both engines.")] = "M1"
    balanced: Annotated[
        bool, Option(help="Balancer shafts: torque alone excites; else z and its moment, too.")
    ] = True

    def __post_init__(self) -> None:
        if self.second is None and (self.first is not None or self.library is not None):
            raise InputError("name the campaign of the second engine with --second")
        if self.second is not None and self.benches > 1:
            raise InputError("--benches asks for virtual benches: leave out --second, or --benches")


def prepare(options: Options) -> CharacteriseOptions:
    """Return how mounts are characterised."""
    return CharacteriseOptions(preload=Preload.STATIC_FORCE, folds=0, seed=options.seed)


def run(how: CharacteriseOptions, options: Options, context: RunContext | None = None) -> Report:  # noqa: ARG001
    """Characterise under one engine, predict for the other, compare and report."""
    excited = ("my",) if options.balanced else ("fz", "mx", "my")
    with progress_bar("second engine") as progress:
        if options.second is not None:
            source = (options.first, options.library, options.library_campaign)
            given = given_engine(options.second, *source, options.mount_set, how, excited, progress)
            return second_engine_result([given], given.input_files, with_figures=FIGURES).report()
        seeds = range(options.seed, options.seed + options.benches)
        engines = second_engines(seeds, options.mount_set, how, progress)
    return second_engine_result(engines, with_figures=FIGURES).report()
