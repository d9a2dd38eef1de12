"""Mounts characterised under one engine predict the forces of another."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_plan import CampaignPlan, second_engine_plan, training_plan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.powertrain import load_second_engine
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.measurement.campaign import Campaign
from deboom.mounts.characterise import (
    CharacteriseOptions,
    characterise,
    measuring_chains,
    training_runs,
)
from deboom.mounts.characterised_mount import CharacterisedMount, MapPoints
from deboom.mounts.library import open_library
from deboom.mounts.measuring_chain import body_record
from deboom.mounts.mount import Mount
from deboom.mounts.operating_map import OperatingMap, operating_maps
from deboom.mounts.response_surface import (
    DynamicStiffnessSurface,
    operating_points,
    r_squared,
)
from deboom.mounts.surface_forces import MountState, main_axis, state_at, surface_over
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.plot import CurvePanel
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.mount_characterisation import SetTruth, read_set_truth
from deboom.study.pngs import curve_panels
from deboom.study.progress import Progress
from deboom.study.result import Scalar, StudyResult
from deboom.vehicles.powertrain import library_model


def static_prediction(
    mounts: Sequence[CharacterisedMount],
    campaign: Campaign,
    maps: Mapping[str, OperatingMap],
) -> dict[str, RealArray]:
    """Find the static force along the main axis of each mount under the second powertrain.

    Parameters
    ----------
    mounts : sequence of CharacterisedMount
        With the suppliers' curves.
    campaign : Campaign
        Of the second engine; it says where its mounts sit.
    maps : mapping of str to OperatingMap
        Its lines, by ``<mount> <axis>``.

    Returns
    -------
    dict of str to array, shape (n,)
        By ``<mount> <axis>``: the force along the mount's main axis at the lines of that direction
        [N]. Empty if a mount has no curve for an axis.

    Raises
    ------
    InputError
        A torque that deflects a mount beyond its curve.
    """
    carrying = [one for one in mounts if one.mount.name in campaign.powertrain_mounts]
    if not carrying or any(
        direction.static_curve is None for one in carrying for direction in one.directions
    ):
        return {}
    places = {one.name: one.positions for one in campaign.mounts}
    moved = [_at(one, places[one.mount.name]) for one in carrying]
    model = library_model(moved)
    names = [name for name in maps if name.rpartition(" ")[0] in {m.mount.name for m in moved}]
    torque = maps[names[0]].wheel_torque
    state = model.equilibrium(torque)
    return {
        name: state.of(f"{one.mount.name} {main_axis(one)}")
        for one in moved
        for name in names
        if name.rpartition(" ")[0] == one.mount.name
        and np.array_equal(maps[name].wheel_torque, torque)
    }


def _at(
    mount: CharacterisedMount, positions: tuple[tuple[float, float, float], ...]
) -> CharacterisedMount:
    """Put a mount where the second powertrain has it."""
    known = mount.mount
    there = Mount(known.name, known.description, known.pieces, positions, known.transfer_axes)
    return replace(mount, mount=there)


@dataclass(frozen=True, eq=False)
class Prediction:
    """Forces of one direction under the second engine.

    Parameters
    ----------
    lines : OperatingMap
        What the second engine measured, without lines near the noise floor.
    stiffness : array, shape (n,)
        Of the library's surface at these lines [N/m]; without meaning outside.
    inside : array of bool, shape (n,)
        Lines within the region that the mount was measured in; only these are predicted.
    """

    lines: OperatingMap
    stiffness: ComplexArray
    inside: npt.NDArray[np.bool_]

    @property
    def force(self) -> ComplexArray:
        """Predicted force at the lines inside, shape (n_inside,) [N]."""
        return np.asarray((self.stiffness * self.lines.displacement)[self.inside])

    @property
    def measured(self) -> ComplexArray:
        """Measured force at the lines inside, shape (n_inside,) [N]."""
        return np.asarray(self.lines.force[self.inside])


@dataclass(frozen=True, eq=False)
class SecondEngine:
    """A second engine on mounts of the library.

    Parameters
    ----------
    title : str
        Such as ``bench 1``.
    mounts : tuple of CharacterisedMount
        As the library knows them.
    campaign : Campaign
        Of the second engine.
    maps : dict of str to OperatingMap
        What it measured, by ``<mount> <axis>``.
    predictions : dict of MountState to dict of str to Prediction
        By preload variable and ``<mount> <axis>``.
    static_force : dict of str to array, shape (n,)
        That the kinematic model gives at the lines of `maps`, from wheel torque and the suppliers'
        curves alone [N]; empty where a curve is missing.
    by_kinematics : dict of str to Prediction
        Over that static force instead of the measured one.
    truth : SetTruth or None
        Of the second engine, where it is known.
    seconds : float
        That it took [s].
    first_files : tuple of Path
        That the mounts were characterised from, or their library.
    """

    title: str
    mounts: tuple[CharacterisedMount, ...]
    campaign: Campaign
    maps: dict[str, OperatingMap]
    predictions: dict[MountState, dict[str, Prediction]]
    static_force: dict[str, RealArray]
    by_kinematics: dict[str, Prediction]
    truth: SetTruth | None
    seconds: float
    first_files: tuple[Path, ...] = ()

    @property
    def directions(self) -> tuple[str, ...]:
        """``<mount> <axis>`` of all that is predicted."""
        return tuple(self.predictions[MountState.MAIN_FORCE])

    def mount_of(self, name: str) -> CharacterisedMount:
        """Return the mount of a direction."""
        return next(one for one in self.mounts if one.mount.name == name.rpartition(" ")[0])

    def main_direction(self, name: str) -> str:
        """Return the direction along the main axis of the mount that a direction belongs to."""
        mount = self.mount_of(name)
        return f"{mount.mount.name} {main_axis(mount)}"

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.first_files, *self.campaign.input_files, *truth)


def second_engine(
    title: str,
    mounts: Sequence[CharacterisedMount],
    folder: Path,
    mount_set: str,
    options: CharacteriseOptions,
) -> SecondEngine:
    """Measure a second engine and predict its forces from the mounts' surfaces.

    Parameters
    ----------
    title : str
        For tables.
    mounts : sequence of CharacterisedMount
        Characterised under another engine.
    folder : Path
        Campaign of the second engine.
    mount_set : str
        Parts that were under it; the same parts.
    options : CharacteriseOptions
        Gears, what excites the second engine, pieces of the surfaces.

    Returns
    -------
    SecondEngine

    Raises
    ------
    InputError
        A campaign that cannot be read; a mount of it that is not among the mounts.

    Notes
    -----
    ``f = K(F₀, |s|, ω) s`` (thesis, eq. 30, 32; 3.6.2) with motion s and static force F₀ as the
    second engine measures them. Lines outside of the region in which the mount was measured are
    not predicted.
    """
    begin = time.perf_counter()
    campaign = read_campaign(folder, (mount_set,))
    known = {one.mount.name for one in mounts}
    missing = [one.name for one in campaign.mounts if one.name not in known]
    if missing:
        raise InputError(
            f"campaign {campaign.name} has the mounts {missing}, which are not among the "
            f"characterised ones, {sorted(known)}: characterise them, or name them alike"
        )
    runs = training_runs(campaign, mount_set, options)
    with threadpool_limits(1):  # its matrices are too small to share
        chains = measuring_chains(campaign, options)
        bodies = [chain.alignment.body for chain in chains]
        records = [body_record(body, runs, campaign.tolerances) for body in bodies]
        maps = operating_maps(chains, records, options.estimate)
        own = [one for one in mounts if one.mount.name in {m.name for m in campaign.mounts}]
        static_force = static_prediction(own, campaign, maps)
        predictions: dict[MountState, dict[str, Prediction]] = {one: {} for one in MountState}
        by_kinematics = {}
        for mount, axis, name in _directions(own, maps):
            for state in MountState:
                surface = surface_over(mount, axis, state, options.regressor)
                preload = state_at(maps, mount, axis, state)
                predictions[state][name] = _predicted(surface, preload, maps[name])
                if state is MountState.MAIN_FORCE and name in static_force:
                    by_kinematics[name] = _predicted(surface, static_force[name], maps[name])
    return SecondEngine(
        title=title,
        mounts=tuple(own),
        campaign=campaign,
        maps=maps,
        predictions=predictions,
        static_force=static_force,
        by_kinematics=by_kinematics,
        truth=read_set_truth(folder, mount_set),
        seconds=time.perf_counter() - begin,
    )


def _directions(
    mounts: Sequence[CharacterisedMount], maps: dict[str, OperatingMap]
) -> list[tuple[CharacterisedMount, str, str]]:
    """Directions that both engines know, with enough lines for a surface."""
    return [
        (mount, one.axis, f"{mount.mount.name} {one.axis}")
        for mount in mounts
        for one in mount.directions
        if one.surface is not None and f"{mount.mount.name} {one.axis}" in maps
    ]


def _predicted(
    surface: DynamicStiffnessSurface, preload: RealArray, measured: OperatingMap
) -> Prediction:
    used = ~measured.near_floor
    points = operating_points(preload, measured.amplitude, measured.frequency)[used]
    stiffness = surface.predict(points, extrapolate=True)
    return Prediction(measured.select(used), stiffness, surface.supported(points))


N_PER_MM = 1e-3
"""From N/m to N/mm."""
DOT_SPACING = 6
"""Lines between the dots of a prediction, so that what was measured shows between them."""
SHOWN_POINTS = 1500
"""Of a panel; more hide each other."""


def second_engine_figures(engine: SecondEngine) -> dict[str, bytes]:
    """Draw all pictures of one bench; file stem → PNG."""
    figures = {}
    for mount in engine.mounts:
        names = [name for name in engine.directions if engine.mount_of(name) is mount]
        if names:
            stem = mount.mount.name.replace(" ", "_")
            figures[f"force_{stem}"] = _forces(engine, names)
    for axis in dict.fromkeys(name.rpartition(" ")[2] for name in engine.directions):
        names = [name for name in engine.directions if name.endswith(f" {axis}")]
        figures[f"preload_{axis}"] = curve_panels(
            [_preload_panel(engine, name) for name in names],
            x_label="static force along the main axis [N]",
            y_label="|K| [N/mm]",
            columns=min(2, len(names)),
        )
    return figures


def _forces(engine: SecondEngine, names: list[str]) -> bytes:
    """Run with the highest torque in each gear: real parts, then imaginary parts."""
    panels = []
    for part, of in (("Re", np.real), ("Im", np.imag)):
        for name in names:
            prediction = engine.predictions[MountState.MAIN_FORCE][name]
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
    return curve_panels(panels, x_label="engine speed [rpm]", y_label="F [N]", columns=len(names))


def _shown_runs(engine: SecondEngine, lines: OperatingMap) -> list[str]:
    """Labels of the runs with the highest torque in each gear; of a mount's pieces the first."""
    labels = list(dict.fromkeys(str(label) for label in lines.run))
    piece = labels[0].partition(" ")[2] if labels else ""
    runs = {" ".join(filter(None, (run.name, piece))): run for run in engine.campaign.runs}
    best = {
        run.gear: label
        for label, run in sorted(
            runs.items(), key=lambda item: (item[1].full_load, item[1].torque_limit)
        )
        if label in labels
    }
    return list(best.values())


def _preload_panel(engine: SecondEngine, name: str) -> CurvePanel:
    """Measured stiffness of both engines over the static force along the mount's main axis."""
    mount = engine.mount_of(name)
    axis = name.rpartition(" ")[2]
    first: MapPoints = mount.direction(axis).map_points
    along = mount.direction(engine.main_direction(name).rpartition(" ")[2]).map_points
    used = np.flatnonzero(first.confidence > 0)
    used = used[:: max(1, used.size // SHOWN_POINTS)]
    lines = engine.maps[name]
    preload = state_at(engine.maps, mount, axis, MountState.MAIN_FORCE)
    shown = np.flatnonzero(~lines.near_floor)
    shown = shown[:: max(1, shown.size // SHOWN_POINTS)]
    points = {
        "first engine": (
            along.preload[used],
            np.abs(first.dynamic_stiffness[used]) * N_PER_MM,
        ),
        "second engine": (preload[shown], np.abs(lines.stiffness[shown]) * N_PER_MM),
    }
    return CurvePanel(name, along.preload[used], {}, points)


BY_KINEMATICS = "static force by the kinematic model"


def direction_numbers(engines: Sequence[SecondEngine]) -> pd.DataFrame:
    """Return a row per bench and direction; ratios as such, errors [1], levels [dB], forces [N]."""
    return pd.DataFrame([_row(one, name) for one in engines for name in one.directions])


def preload_numbers(engines: Sequence[SecondEngine]) -> pd.DataFrame:
    """Return rms error of the force [1] per bench, direction and preload variable."""
    rows = []
    for one in engines:
        by_state = {state.value: found for state, found in one.predictions.items()}
        for label, found in (*by_state.items(), (BY_KINEMATICS, one.by_kinematics)):
            rows += [
                {
                    "bench": one.title,
                    "direction": name,
                    "preload": label,
                    "error": force_error(prediction),
                    "inside": float(np.mean(prediction.inside)),
                }
                for name, prediction in found.items()
            ]
    return pd.DataFrame(rows)


def force_error(prediction: Prediction) -> float:
    """Rms of the force error over that of the force, at the lines inside [1]; nan if none is."""
    if not prediction.inside.any():
        return float("nan")
    error = np.mean(np.abs(prediction.force - prediction.measured) ** 2)
    return float(np.sqrt(error / np.mean(np.abs(prediction.measured) ** 2)))


def peak_difference(prediction: Prediction) -> float:
    """Largest difference of the highest force of a run, predicted over measured [dB].

    With its sign, at the lines inside; nan if there is none.
    """
    runs = prediction.lines.run[prediction.inside]
    differences = [
        20
        * np.log10(
            np.abs(prediction.force[runs == run]).max()
            / np.abs(prediction.measured[runs == run]).max()
        )
        for run in np.unique(runs)
    ]
    return float(max(differences, key=abs, default=np.nan))


def force_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """List what came out per direction, median over the benches."""
    by = numbers.groupby("direction", sort=False)
    table = pd.DataFrame(
        {
            "identified": np.where(by["identified"].mean() > 0.5, "identified", "not identified"),
            "lines inside [%]": 100 * by["inside"].median(),
            "R² of Re F [%]": 100 * by["r2_real"].median(),
            "R² of Im F [%]": 100 * by["r2_imag"].median(),
            "rms error of F [%]": 100 * by["error"].median(),
            "peak of F [dB]": by["peak"].median(),
            "95 % half width of library K [%]": 100 * by["half_width"].median(),
            "rms error of K against truth [%]": 100 * by["truth_error"].median(),
            "static force, model against cells [N]": by["static_difference"].median(),
        },
        index=list(by.groups),
    )
    return table.rename_axis("direction").reset_index().dropna(axis="columns", how="all")


def preload_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """List the rms error of the force by preload variable, median over the benches."""
    median = numbers.groupby(["direction", "preload"], sort=False)["error"].median().unstack()
    order = [*(state.value for state in MountState), BY_KINEMATICS]
    directions = numbers["direction"].drop_duplicates()
    table = 100 * median.reindex(index=directions, columns=[c for c in order if c in median])
    return table.rename(columns=lambda name: f"{name} [%]").rename_axis("direction").reset_index()


def second_engine_summary(
    engines: Sequence[SecondEngine], numbers: pd.DataFrame
) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    keys: Mapping[str, tuple[str, float]] = {
        "r2_force_real": ("r2_real", 100.0),
        "r2_force_imag": ("r2_imag", 100.0),
        "rms_force_percent": ("error", 100.0),
        "peak_db": ("peak", 1.0),
        "inside_percent": ("inside", 100.0),
        "truth_error_percent": ("truth_error", 100.0),
        "static_difference_n": ("static_difference", 1.0),
    }
    by = numbers.groupby("direction", sort=False)
    summary: dict[str, Scalar] = {"n_benches": len(engines)}
    for key, (column, factor) in keys.items():
        for name, value in by[column].median().dropna().items():
            summary[f"{key}_{str(name).replace(' ', '_')}"] = float(factor * value)
    summary["seconds"] = round(float(np.median([one.seconds for one in engines])), 3)
    return summary


def _row(engine: SecondEngine, name: str) -> dict[str, object]:
    prediction = engine.predictions[MountState.MAIN_FORCE][name]
    quality = engine.mount_of(name).direction(name.rpartition(" ")[2]).quality
    measured, force = prediction.measured, prediction.force
    several = measured.size > 1
    half_width = np.nan if quality.half_width_95 is None else quality.half_width_95
    return {
        "bench": engine.title,
        "direction": name,
        "identified": float(quality.identified),
        "inside": float(np.mean(prediction.inside)),
        "r2_real": r_squared(measured.real, force.real) if several else np.nan,
        "r2_imag": r_squared(measured.imag, force.imag) if several else np.nan,
        "error": force_error(prediction),
        "peak": peak_difference(prediction),
        "half_width": half_width,
        "truth_error": _truth_error(engine, prediction),
        "static_difference": _static_difference(engine, name),
    }


def _truth_error(engine: SecondEngine, prediction: Prediction) -> float:
    if engine.truth is None or not prediction.inside.any():
        return float("nan")
    lines = prediction.lines.select(prediction.inside)
    true: ComplexArray = engine.truth.at(lines)
    ratio = np.abs(prediction.stiffness[prediction.inside]) / np.abs(true)
    return float(np.sqrt(np.mean((ratio - 1) ** 2)))


def _static_difference(engine: SecondEngine, name: str) -> float:
    """Rms difference between model and cells along the main axis of the mount [N]."""
    measured = engine.maps[name].static_force
    main = name in engine.static_force and name == engine.main_direction(name)
    return (
        float(np.sqrt(np.mean((engine.static_force[name] - measured) ** 2)))
        if main
        else float("nan")
    )


NOT_IDENTIFIED = (
    "A direction that is not identified was measured with an error that its error budget puts "
    "beyond use; its forces are shown, and prove nothing."
)


def second_engine_result(
    engines: Sequence[SecondEngine], inputs: tuple[Path, ...] = (), *, with_figures: bool = True
) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    engines : sequence of SecondEngine
        At least one; figures show the first, tables all.
    inputs : tuple of Path
        Files that stay; benches that were measured for the study leave none.
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        Tables ``forces``, ``preload`` and ``directions``, the numbers of every bench behind them.
    """
    numbers = direction_numbers(engines)
    tables = {
        "forces": force_table(numbers),
        "preload": preload_table(preload_numbers(engines)),
        "directions": numbers.rename(columns=_with_unit),
    }
    figures = second_engine_figures(engines[0]) if with_figures else {}
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=second_engine_summary(engines, numbers),
        page=_page(engines, tables, figures),
        inputs=inputs,
    )


def _with_unit(name: str) -> str:
    units = {"bench": "", "direction": "", "peak": " [dB]", "static_difference": " [N]"}
    return f"{name}{units.get(name, ' [1]')}"


def _page(
    engines: Sequence[SecondEngine],
    tables: Mapping[str, pd.DataFrame],
    figures: Mapping[str, bytes],
) -> Page:
    first, forces = engines[0], tables["forces"]
    found = forces[forces["identified"] == "identified"]
    known_from = sorted({one.identity.campaign for one in first.mounts})
    headlines = [
        Headline(
            f"{found['rms error of F [%]'].median():.1f} %",
            "rms error of the force, median over the identified directions",
        ),
        Headline(
            f"{found['lines inside [%]'].min():.0f} %",
            "least share of lines within the measured region",
        ),
    ]
    sections = (
        Section(
            "What was asked, and with which data",
            f"Mounts characterised in {', '.join(known_from)} carry another engine in "
            f"{first.campaign.name}, of order {first.campaign.order:g}; "
            f"{len(engines)} {'benches' if len(engines) > 1 else 'bench'}. The second engine gives "
            "its own motion at the mounts and its own static forces; the response surfaces give "
            "the dynamic stiffness at that preload, amplitude and frequency; their product is the "
            "predicted force. It is compared with the force that the cells under the second engine "
            "measured, which no surface has seen. Lines outside of the region in which a mount was "
            "measured are counted, and not predicted.",
        ),
        Section(
            "Predicted and measured forces",
            "",
            figures=tuple(
                _picture(
                    png,
                    f"Forces of {stem.partition('_')[2]}, the highest torque of each gear: real "
                    "parts above, imaginary parts below, as measured and as predicted.",
                )
                for stem, png in figures.items()
                if stem.startswith("force_")
            ),
            tables=(
                Table(
                    forces,
                    "Medians over the benches. The error is the rms of the force error over the "
                    "rms of the force; the peak is the largest difference of the highest force of "
                    "a run. Both engines' measuring chains have a part in it.",
                    {name: 2 for name in forces.columns if name.startswith(("R²", "peak"))},
                ),
            ),
        ),
        Section(
            "Which preload carries over",
            "The wheel torque of another powertrain loads a mount differently. Its own static "
            "force does carry over along the main axis of a mount, but not across: there the "
            "stiffness follows the force along the main axis. So every direction is predicted "
            "over the static force along the main axis. The kinematic model gives that force from "
            "wheel torque, the place of the mounts and the suppliers' curves alone.",
            figures=tuple(
                _picture(
                    png,
                    f"Dynamic stiffness along {stem.partition('_')[2]} as both engines measured "
                    "it, over the static force along the main axis; the scatter is amplitude and "
                    "frequency.",
                )
                for stem, png in figures.items()
                if stem.startswith("preload_")
            ),
            tables=(
                Table(tables["preload"], "Rms error of the predicted force by preload variable."),
            ),
        ),
    )
    doubtful = len(found) < len(forces)
    return Page(
        title="A second engine on mounts of the library",
        question=(
            "Do mounts that were characterised under one engine predict the forces that another "
            "engine measures on them?"
        ),
        headlines=tuple(headlines) if len(found) else (),
        terms=("dynamic stiffness",),
        warnings=(NOT_IDENTIFIED,) if doubtful else (),
        sections=sections,
    )


def _picture(png: bytes, caption: str) -> Picture:
    return Picture(png, alt=caption, caption=caption)


SECOND_BENCH = 500
"""Added to a seed for the second engine: another day, other sensors, the same mounts."""

STEPS_PER_BENCH = 4


def mounts_of_campaign(
    folder: Path, mount_set: str, options: CharacteriseOptions
) -> tuple[tuple[CharacterisedMount, ...], tuple[Path, ...]]:
    """Characterise one mount set of a campaign; its mounts, and the files that were read.

    Raises
    ------
    InputError
        A campaign that cannot be read or characterised.
    """
    campaign = read_campaign(folder, (mount_set,))
    with threadpool_limits(1):  # its matrices are too small to share
        return characterise(campaign, mount_set, options).mounts, campaign.input_files


def mounts_of_library(
    library: str, mount_set: str, campaign: str | None = None
) -> tuple[CharacterisedMount, ...]:
    """Take the mounts of one variant out of a library.

    Parameters
    ----------
    library : str
        SQLite file or database URL.
    mount_set : str
        Their variant.
    campaign : str, optional
        Where they were characterised; needed if several know the variant.

    Raises
    ------
    InputError
        No such library, no such mounts, or mounts of several campaigns.
    """
    with open_library(library) as opened:
        found = opened.identities(variant=mount_set, campaign=campaign)
        campaigns = sorted({one.campaign for one in found})
        if not found:
            raise InputError(f"{opened.name}: no mount fits; `deboom library list` shows them all")
        if len(campaigns) > 1:
            raise InputError(
                f"{opened.name}: mount set {mount_set} is there from the campaigns "
                f"{', '.join(campaigns)}: choose one"
            )
        return tuple(opened.load(one) for one in found)


def given_engine(
    second: Path,
    first: Path | None,
    library: str | None,
    library_campaign: str | None,
    mount_set: str,
    options: CharacteriseOptions,
    excited: tuple[str, ...],
    progress: Progress,
) -> SecondEngine:
    """Predict the forces of a measured second engine, under its campaign's name.

    Parameters
    ----------
    second : Path
        Campaign of the second engine.
    first : Path or None
        Campaign that the mounts are characterised from.
    library : str or None
        Or the library that they are taken from.
    library_campaign : str or None
        Whose mounts in the library, if several campaigns have this mount set.
    mount_set : str
        Parts under both engines.
    options : CharacteriseOptions
        How mounts are characterised.
    excited : tuple of str
        Loads that excite the second engine, see `CharacteriseOptions`.
    progress : callable
        ``progress(done, total, text)``.

    Raises
    ------
    InputError
        Not exactly one of campaign and library; as `second_engine`.
    """
    if (first is None) == (library is None):
        raise InputError(
            "the mounts come from the first engine's campaign or from a library: give one of both"
        )
    progress(0, 2, "mounts")
    if first is not None:
        mounts, files = mounts_of_campaign(first, mount_set, options)
    else:
        mounts = mounts_of_library(str(library), mount_set, library_campaign)
        files = (Path(str(library)),) if Path(str(library)).is_file() else ()
    progress(1, 2, "second engine")
    there = replace(options, excited=excited)
    done = second_engine(Path(second).name, mounts, second, mount_set, there)
    progress(2, 2, "")
    return replace(done, first_files=files)


def second_engines(
    seeds: Sequence[int],
    mount_set: str,
    options: CharacteriseOptions,
    progress: Progress,
    plans: tuple[CampaignPlan, CampaignPlan] | None = None,
) -> tuple[SecondEngine, ...]:
    """Measure both engines on virtual benches and keep no files.

    Parameters
    ----------
    seeds : sequence of int
        One bench each, from 1; the second engine gets sensors of its own.
    mount_set : str
        Parts under both engines.
    options : CharacteriseOptions
        How.
    progress : callable
        ``progress(done, total, text)``.
    plans : (CampaignPlan, CampaignPlan), optional
        Of the first and of the second engine; by default everything.

    Raises
    ------
    InputError
        No seed, a seed below 1, or an unknown mount set.
    """
    if not seeds:
        raise InputError("there is no bench to measure on: ask for at least one")
    first, second = plans or (training_plan(mount_set), second_engine_plan(mount_set))
    done = []
    for place, seed in enumerate(seeds):
        title = f"bench {seed}"

        def step(k: int, text: str, before: int = place * STEPS_PER_BENCH) -> None:
            progress(before + k, len(seeds) * STEPS_PER_BENCH, text)

        with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
            one, other = Path(temporary) / "first", Path(temporary) / "second"
            step(0, f"{title}: measuring the first engine")
            write_campaign(one, seed, first)
            step(1, f"{title}: characterising its mounts")
            mounts, _ = mounts_of_campaign(one, mount_set, options)
            step(2, f"{title}: measuring the second engine")
            write_campaign(
                other,
                seed + SECOND_BENCH,
                second,
                bench=load_second_engine(),
            )
            step(3, f"{title}: predicting its forces")
            done.append(second_engine(title, mounts, other, mount_set, options))
            step(4, title)
    return tuple(done)
