"""Do mounts that were characterised under one engine predict the forces of another engine?

The second engine has another order, another motion and other sensors (thesis, 3.6.2), while the
held-out runs of mount_characterisation have the same engine and sensors. The study computes the
forces of the second engine from its motion, its static forces and the surfaces of the mounts, and
compares them with the measured forces. The mounts come from --campaign, where they are
characterised over the static force, or from a --library. Without --second the virtual test bench
measures both engines. Its truth is used only for comparison.

Result on six virtual benches: the forces of a second engine are predicted to 1 to 2 % rms along x
and to 1 to 6 % along z. The stiffness of both engines agrees over the static force along the
mount's main axis, not over the wheel torque or the static force across.

Keys of summary.json, with <dir> such as TSM_x: second_r2_force_real_<dir>,
second_r2_force_imag_<dir> [%]; second_rms_force_percent_<dir> (rms error over rms of the force);
second_peak_db_<dir> (largest difference of a run's highest force); second_inside_percent_<dir>
(lines within the measured region; the others are not predicted);
second_truth_error_percent_<dir> (rms error of |K| against the bench's truth);
second_static_difference_n_<dir> (kinematic model against cells, main axis); second_seconds.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import pandas as pd
from typer import Option

from deboom import plot
from deboom.arrays import BoolArray, ComplexArray, RealArray
from deboom.bench.campaign import CampaignPlan, second_engine_plan, training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import load_second_engine
from deboom.bench.truth import SetTruth, read_set_truth
from deboom.common import Progress
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.measurement.campaign import Campaign
from deboom.mounts.characterise import (
    CharacteriseOptions,
    characterise,
    measuring_chains,
    training_runs,
)
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.library import open_library
from deboom.mounts.measuring_chain import body_record
from deboom.mounts.operating_map import OperatingMap, Preload, operating_maps
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points, r_squared
from deboom.mounts.surface_forces import main_axis, smooth_static_force, surface_over_main_force
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.plot import CurvePanel
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.options import CubicPieces, MountSet, Seed, SelfCalibration
from deboom.vehicles.powertrain import library_model

if TYPE_CHECKING:
    from deboom.plot.style import Drawing

SECOND_BENCH = 500
"""Added to a seed for the second engine: another day, other sensors, the same mounts."""
STEPS_PER_ENGINE = 4
"""Of `virtual_engine`, for progress."""
DOT_SPACING = 6
"""Lines between the dots of a prediction, so that what was measured shows between them."""


@dataclass(frozen=True)
class Options:
    """Which engine runs on which mounts, and how both are measured."""

    seed: Seed = 1
    second: Annotated[
        Path | None, Option(help="Campaign folder of another engine on the same mounts.")
    ] = None
    campaign: Annotated[
        Path | None, Option(help="Campaign folder that characterises the mounts.")
    ] = None
    library: Annotated[
        str | None, Option(help="Library of characterised mounts, in place of --campaign.")
    ] = None
    library_campaign: Annotated[
        str | None, Option(help="Name of the campaign whose mounts are taken from the library.")
    ] = None
    mount_set: MountSet = "M1"
    pieces: CubicPieces = 2
    self_calibration: SelfCalibration = True

    def __post_init__(self) -> None:
        if self.second is None and (self.campaign is not None or self.library is not None):
            raise InputError(
                "--campaign and --library give mounts: name another engine with --second, or leave "
                "them out for virtual benches"
            )


def prepare(options: Options) -> CharacteriseOptions:
    """Return how mounts are characterised: over the static force, which carries over."""
    return CharacteriseOptions(
        preload=Preload.STATIC_FORCE,
        regressor=PiecewiseCubicRegressor(pieces=options.pieces),
        self_calibration=options.self_calibration,
        seed=options.seed,
    )


def run(how: CharacteriseOptions, options: Options) -> Report:
    """Measure both engines or read the second one, predict its forces and report."""
    report = Report(
        "Another engine on mounts of the library",
        "Do mounts that were characterised under one engine predict the measured forces of "
        "another engine?",
    )
    report.explain("dynamic stiffness")
    with progress_bar("second engine") as progress:
        if options.second is None:
            engine = virtual_engine(options.seed, options.mount_set, how, progress)
        else:
            engine = given_engine(
                options.second,
                options.campaign,
                options.library,
                options.library_campaign,
                options.mount_set,
                how,
                progress,
            )
            report.inputs += engine.input_files
    append_second_engine(report, engine)
    return report


@dataclass(frozen=True, eq=False)
class Prediction:
    """Forces of one direction under the second engine.

    ``lines`` are what it measured, without lines near the noise floor; ``stiffness`` is that of the
    library's surface at these lines, shape (n,) [N/m]; ``inside`` says which lie within the region
    that the mount was measured in: only these are predicted.
    """

    lines: OperatingMap
    stiffness: ComplexArray
    inside: BoolArray

    @property
    def force(self) -> ComplexArray:
        """Predicted force at the lines inside, shape (n_inside,) [N]."""
        return np.asarray((self.stiffness * self.lines.displacement)[self.inside])

    @property
    def measured(self) -> ComplexArray:
        """Measured force at the lines inside, shape (n_inside,) [N]."""
        return np.asarray(self.lines.force[self.inside])

    @property
    def error(self) -> float:
        """Rms of the force error over that of the force, at the lines inside [1]; nan if none."""
        if not self.inside.any():
            return float("nan")
        error = np.mean(np.abs(self.force - self.measured) ** 2)
        return float(np.sqrt(error / np.mean(np.abs(self.measured) ** 2)))

    @property
    def peak_difference(self) -> float:
        """Largest difference of a run's highest force, predicted over measured, or nan [dB]."""
        runs = self.lines.run[self.inside]
        force, measured = np.abs(self.force), np.abs(self.measured)
        differences = [
            20 * np.log10(force[runs == run].max() / measured[runs == run].max())
            for run in np.unique(runs)
        ]
        return float(max(differences, key=abs, default=np.nan))


@dataclass(frozen=True, eq=False)
class SecondEngine:
    """A second engine on mounts of the library.

    By ``<mount> <axis>``: ``maps``, what it measured; ``predictions``; and ``static_force`` at the
    lines, that the kinematic model gives from wheel torque and the suppliers' curves alone [N]
    (empty where a curve is missing). ``alarms`` say what contradicts its measuring chains.
    """

    title: str
    mounts: tuple[CharacterisedMount, ...]
    campaign: Campaign
    maps: dict[str, OperatingMap]
    predictions: dict[str, Prediction]
    static_force: dict[str, RealArray]
    truth: SetTruth | None
    seconds: float
    first_files: tuple[Path, ...] = ()
    alarms: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()

    def mount_of(self, name: str) -> CharacterisedMount:
        """Return the mount of a direction."""
        return next(
            candidate
            for candidate in self.mounts
            if candidate.mount.name == name.rpartition(" ")[0]
        )

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.first_files, *self.campaign.input_files, *truth)


def virtual_engine(
    seed: int,
    mount_set: str,
    how: CharacteriseOptions,
    progress: Progress,
    plans: tuple[CampaignPlan, CampaignPlan] | None = None,
) -> SecondEngine:
    """Measure both engines on virtual benches and keep no files.

    ``plans`` are those of the first and of the second engine; by default everything.
    """
    first_plan, second_plan = plans or (training_plan(mount_set), second_engine_plan(mount_set))
    title = f"bench {seed}"
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        first, second = Path(temporary) / "first", Path(temporary) / "second"
        progress(0, STEPS_PER_ENGINE, f"{title}: measuring the first engine")
        write_campaign(first, seed, first_plan)
        progress(1, STEPS_PER_ENGINE, f"{title}: characterising its mounts")
        mounts, _ = _mounts_of_campaign(first, mount_set, how)
        progress(2, STEPS_PER_ENGINE, f"{title}: measuring the second engine")
        write_campaign(second, seed + SECOND_BENCH, second_plan, bench=load_second_engine())
        progress(3, STEPS_PER_ENGINE, f"{title}: predicting its forces")
        engine = _second_engine(title, mounts, second, mount_set, how)
        progress(STEPS_PER_ENGINE, STEPS_PER_ENGINE, title)
    return engine


def given_engine(
    second: Path,
    first: Path | None,
    library: str | None,
    library_campaign: str | None,
    mount_set: str,
    how: CharacteriseOptions,
    progress: Progress,
) -> SecondEngine:
    """Predict the forces of a measured second engine, titled as the folder of its campaign.

    The mounts come from the first engine's campaign or from a library; InputError without either.
    """
    progress(0, 2, "mounts")
    if first is not None:
        mounts, files = _mounts_of_campaign(first, mount_set, how)
    elif library is not None:
        mounts = mounts_of_library(library, mount_set, library_campaign)
        files = (Path(library),) if Path(library).is_file() else ()
    else:
        raise InputError(
            "the mounts come from the first engine's campaign or from a library: give one of both"
        )
    progress(1, 2, "second engine")
    engine = _second_engine(second.name, mounts, second, mount_set, how)
    progress(2, 2, "")
    return replace(engine, first_files=files)


def _mounts_of_campaign(
    folder: Path, mount_set: str, how: CharacteriseOptions
) -> tuple[tuple[CharacterisedMount, ...], tuple[Path, ...]]:
    """Characterise one mount set of a campaign; return its mounts, and the files that were read."""
    campaign = read_campaign(folder, (mount_set,))
    return characterise(campaign, mount_set, how).mounts, campaign.input_files


def mounts_of_library(
    library: str, mount_set: str, campaign: str | None = None
) -> tuple[CharacterisedMount, ...]:
    """Take the mounts of one variant from a library; InputError: none, or of several campaigns."""
    with open_library(library) as opened:
        identities = opened.identities(variant=mount_set, campaign=campaign)
        campaigns = sorted({identity.campaign for identity in identities})
        if not identities:
            raise InputError(f"{opened.name}: no mount fits; `deboom library list` shows them all")
        if len(campaigns) > 1:
            raise InputError(
                f"{opened.name}: mount set {mount_set} is there from the campaigns "
                f"{', '.join(campaigns)}: choose one"
            )
        return tuple(opened.load(identity) for identity in identities)


def _second_engine(
    title: str,
    mounts: Sequence[CharacterisedMount],
    folder: Path,
    mount_set: str,
    how: CharacteriseOptions,
) -> SecondEngine:
    """Read a second engine's campaign and predict its forces from the mounts' surfaces.

    ``f = K(F₀, |s|, ω) s`` (thesis, eq. 30, 32; 3.6.2) with motion s and static force F₀ as the
    second engine measures them. Lines outside of the region in which the mount was measured are
    not predicted.
    """
    begin = time.perf_counter()
    campaign = read_campaign(folder, (mount_set,))
    characterised = {entry.mount.name for entry in mounts}
    missing = [entry.name for entry in campaign.mounts if entry.name not in characterised]
    if missing:
        raise InputError(
            f"campaign {campaign.name} has the mounts {missing}, which are not among the "
            f"characterised ones, {sorted(characterised)}: characterise them, or name them alike"
        )
    runs = training_runs(campaign, mount_set, how)
    carried = tuple(
        entry for entry in mounts if entry.mount.name in {m.name for m in campaign.mounts}
    )
    predictions: dict[str, Prediction] = {}
    chains = measuring_chains(campaign, how)
    bodies = [chain.alignment.body for chain in chains]
    records = [body_record(body, runs, campaign.tolerances) for body in bodies]
    maps = operating_maps(chains, records)
    static_force = _static_prediction(carried, campaign, maps)
    for mount in carried:
        loaded = maps[f"{mount.mount.name} {main_axis(mount)}"]
        measured = loaded.preload(Preload.STATIC_FORCE)
        preload = smooth_static_force(measured, loaded.frequency, loaded.run)
        for axis in (entry.axis for entry in mount.directions if entry.surface is not None):
            name = f"{mount.mount.name} {axis}"
            if name not in maps:
                continue
            surface = surface_over_main_force(mount, axis, how.regressor)
            predictions[name] = _predicted(surface, preload, maps[name])
    truth = read_set_truth(folder, mount_set)
    seconds = time.perf_counter() - begin
    alarms = [alarm for chain in chains for alarm in chain.alarms(campaign.excited)]
    return SecondEngine(
        title=title,
        mounts=carried,
        campaign=campaign,
        maps=maps,
        predictions=predictions,
        static_force=static_force,
        truth=truth,
        seconds=seconds,
        alarms=tuple(alarms),
        assumed=campaign.assumed,
    )


def _static_prediction(
    mounts: Sequence[CharacterisedMount], campaign: Campaign, maps: Mapping[str, OperatingMap]
) -> dict[str, RealArray]:
    """Find the static force along the main axis of each mount at the lines of each direction [N].

    From the wheel torque and the suppliers' curves, with the mounts where the second powertrain
    has them; empty if a mount has no curve for an axis.
    """
    carrying = [entry for entry in mounts if entry.mount.name in campaign.powertrain_mounts]
    if not carrying or any(
        direction.static_curve is None for entry in carrying for direction in entry.directions
    ):
        return {}
    of_campaign = {entry.name: entry for entry in campaign.mounts}
    moved = []
    for entry in carrying:
        new_place = of_campaign[entry.mount.name]
        placed = replace(entry.mount, positions=new_place.positions, rotations=new_place.rotations)
        moved.append(replace(entry, mount=placed))
    by_name = {entry.mount.name: entry for entry in moved}
    names = [name for name in maps if name.rpartition(" ")[0] in by_name]
    torque = maps[names[0]].wheel_torque
    model = library_model(moved)
    force = model.force(model.equilibrium(torque))
    return {
        name: force[:, model.column(f"{mount} {main_axis(by_name[mount])}")]
        for mount in by_name
        for name in names
        if name.rpartition(" ")[0] == mount and np.array_equal(maps[name].wheel_torque, torque)
    }


def _predicted(
    surface: DynamicStiffnessSurface, preload: RealArray, measured: OperatingMap
) -> Prediction:
    """Predict the lines of one direction."""
    used = ~measured.near_floor
    points = operating_points(preload, measured.amplitude, measured.frequency)[used]
    stiffness = surface.predict(points, extrapolate=True)
    return Prediction(measured.select(used), stiffness, surface.supported(points))


def engine_numbers(engine: SecondEngine) -> pd.DataFrame:
    """Return a row per direction; ratios as such, errors [1], levels [dB], forces [N]."""
    return pd.DataFrame([_row(engine, name) for name in engine.predictions])


def _row(engine: SecondEngine, name: str) -> dict[str, object]:
    """Return the numbers of one direction."""
    prediction = engine.predictions[name]
    mount, axis = engine.mount_of(name), name.rpartition(" ")[2]
    quality = mount.direction(axis).quality
    measured, force = prediction.measured, prediction.force
    several = measured.size > 1
    truth_error = static_difference = float("nan")
    if engine.truth is not None and prediction.inside.any():
        true = engine.truth.at(prediction.lines.select(prediction.inside))
        ratio = np.abs(prediction.stiffness[prediction.inside]) / np.abs(true)
        truth_error = float(np.sqrt(np.mean((ratio - 1) ** 2)))
    if name in engine.static_force and axis == main_axis(mount):
        difference = engine.static_force[name] - engine.maps[name].static_force
        static_difference = float(np.sqrt(np.mean(difference**2)))
    return {
        "bench": engine.title,
        "direction": name,
        "identified": float(quality.identified),
        "inside": float(np.mean(prediction.inside)),
        "r2_real": r_squared(measured.real, force.real) if several else np.nan,
        "r2_imag": r_squared(measured.imag, force.imag) if several else np.nan,
        "error": prediction.error,
        "peak": prediction.peak_difference,
        "half_width": np.nan if quality.half_width_95 is None else quality.half_width_95,
        "truth_error": truth_error,
        "static_difference": static_difference,
    }


def append_second_engine(report: Report, first: SecondEngine) -> None:
    """Report the forces of another engine."""
    numbers = engine_numbers(first)
    forces = _force_table(numbers)
    identified = forces[forces["identified"] == "identified"]
    report.summary |= _second_summary(first, numbers)
    report.warn(*first.alarms)
    report.assume(*first.assumed)
    if len(identified):
        report.tile(
            f"{identified['rms error of F [%]'].median():.1f} %",
            "rms error of a second engine's force, median over the identified directions",
        )
    if len(identified) < len(forces):
        report.warn(
            "A direction is not identified if its error budget is too large to use it. Forces of "
            "a second engine in such a direction prove nothing."
        )
    campaigns = ", ".join(sorted({entry.identity.campaign for entry in first.mounts}))
    report.section(
        "A second engine",
        f"Mounts characterised in {campaigns} carry another engine in {first.campaign.name}, of "
        f"order {first.campaign.order:g}. The forces are computed from the motion and static "
        "forces of this engine and from the surfaces of the mounts, and compared with the forces "
        "of its cells. Unlike in held-out runs of one campaign, engine, motion and sensors are "
        "different. Lines outside of the region in which a mount was measured are counted, and not "
        "predicted.",
    )
    main = [n for n in first.predictions if n.endswith(f" {main_axis(first.mount_of(n))}")]
    report.figure(
        "second_force",
        partial(_engine_forces, first, main or list(first.predictions)),
        "Forces along the main axis of each mount, the highest torque of each gear: real parts "
        "above, imaginary parts below, as measured and as predicted.",
    )
    report.table(
        "second_forces",
        forces,
        "Error: rms of the force error over the rms of the force; peak: largest difference of the "
        "highest force of a run. The preload is the static force along the main axis of the mount, "
        "which the kinematic model gives as well, from wheel torque, places and the suppliers' "
        "curves alone.",
        {name: 2 for name in forces.columns if name.startswith(("R²", "peak"))},
    )


def _second_summary(engine: SecondEngine, numbers: pd.DataFrame) -> dict[str, float]:
    """Gather the headline numbers of a second engine; the study's docstring explains the keys."""
    keys = {
        "r2_force_real": ("r2_real", 100.0),
        "r2_force_imag": ("r2_imag", 100.0),
        "rms_force_percent": ("error", 100.0),
        "peak_db": ("peak", 1.0),
        "inside_percent": ("inside", 100.0),
        "truth_error_percent": ("truth_error", 100.0),
        "static_difference_n": ("static_difference", 1.0),
    }
    by = numbers.set_index("direction")
    summary = {
        f"second_{key}_{str(name).replace(' ', '_')}": float(factor * value)
        for key, (column, factor) in keys.items()
        for name, value in by[column].dropna().items()
    }
    return {**summary, "second_seconds": round(engine.seconds, 3)}


def _force_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """List what came out per direction."""
    columns = {
        "lines inside [%]": 100 * numbers["inside"],
        "R² of Re F [%]": 100 * numbers["r2_real"],
        "R² of Im F [%]": 100 * numbers["r2_imag"],
        "rms error of F [%]": 100 * numbers["error"],
        "peak of F [dB]": numbers["peak"],
        "95 % half width of library K [%]": 100 * numbers["half_width"],
        "rms error of K against truth [%]": 100 * numbers["truth_error"],
        "static force, model against cells [N]": numbers["static_difference"],
    }
    is_identified = np.where(numbers["identified"] > 0.5, "identified", "not identified")
    table = pd.DataFrame(
        {"direction": numbers["direction"], "identified": is_identified, **columns}
    )
    return table.dropna(axis="columns", how="all")


def _engine_forces(engine: SecondEngine, names: list[str]) -> Drawing:
    """Run with the highest torque in each gear: real parts, then imaginary parts."""
    panels = []
    for part, of in (("Re", np.real), ("Im", np.imag)):
        for name in names:
            prediction = engine.predictions[name]
            lines = prediction.lines
            shown = np.isin(lines.run, _shown_runs(engine, lines))
            rpm = rpm_of_frequency(lines.frequency, engine.campaign.order)
            dots = np.flatnonzero(shown & prediction.inside)[::DOT_SPACING]
            force = prediction.stiffness * lines.displacement
            points = {
                "measured": (rpm[shown], of(lines.force[shown])),
                "predicted": (rpm[dots], of(force[dots])),
            }
            some = {label: pair for label, pair in points.items() if pair[0].size}
            panels.append(CurvePanel(f"{part} F, {name}", rpm, {}, some))
    return plot.curve_panels(
        panels, x_label="engine speed [rpm]", y_label="F [N]", columns=len(names)
    )


def _shown_runs(engine: SecondEngine, lines: OperatingMap) -> list[str]:
    """Labels of the runs with the highest torque in each gear; of a mount's pieces the first."""
    labels = list(dict.fromkeys(str(label) for label in lines.run))
    piece = labels[0].partition(" ")[2] if labels else ""
    runs = sorted(engine.campaign.runs, key=lambda run: (run.full_load, run.torque_limit))
    labelled = [(run.gear, " ".join(filter(None, (run.name, piece)))) for run in runs]
    return list({gear: label for gear, label in labelled if label in labels}.values())
