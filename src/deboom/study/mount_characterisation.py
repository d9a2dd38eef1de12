"""Mounts characterised on one bench or several, beside the truth where it is known."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_plan import (
    LOW_GEAR_RUNS,
    NO_ERRORS,
    TRAINING_RUNS,
    CampaignErrors,
    CampaignPlan,
)
from deboom.bench.campaign_writer import write_campaign
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.files.platform import Platform, read_platform
from deboom.measurement.campaign import AXES, OperatingRun
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.measurement.force_transfer import (
    ForceTransferMatrix,
    force_transfer_matrix,
    moment_transfer_matrix,
    operating_force,
    without_moments,
)
from deboom.measurement.quality import quality_in_operation, quality_table
from deboom.measurement.sensors import Sensor
from deboom.measurement.virtual_point import sensor_geometry, virtual_point
from deboom.mounts.characterise import (
    STEPS,
    Characterisation,
    CharacteriseOptions,
    characterise,
    training_runs,
)
from deboom.mounts.error_budget import IDENTIFIED, DirectionBudget
from deboom.mounts.measuring_chain import (
    AlignmentEstimate,
    ErrorSource,
    MountPoint,
    body_record,
    stated_alignment,
)
from deboom.mounts.operating_map import OperatingMap, Preload, operating_maps
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.mounts.response_surface import (
    DynamicStiffnessSurface,
    StiffnessModel,
    agreement,
    compare_models,
    standard_models,
)
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.plot import CurvePanel, MapPanel
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.platform_model import PEAKS, RMS, level_differences
from deboom.study.pngs import curve_panels, map_panels
from deboom.study.progress import Progress
from deboom.study.result import Scalar, StudyResult
from deboom.vehicles.fleet import Band


@dataclass(frozen=True, eq=False)
class SetTruth:
    """True stiffness of all mounts of one set, run by run.

    Parameters
    ----------
    path : Path
        Where it was read.
    runs, channels : tuple of str
        Names along the first and the last axis.
    frequency : array, shape (n_frequency,)
        [Hz].
    stiffness : array, shape (n_run, n_frequency, n_channel)
        Complex dynamic stiffness [N/m].
    """

    path: Path
    runs: tuple[str, ...]
    channels: tuple[str, ...]
    frequency: RealArray
    stiffness: ComplexArray

    def at(self, measured: OperatingMap) -> ComplexArray:
        """Return the true stiffness at every line of a map, shape (n,) [N/m].

        Raises
        ------
        InputError
            A line that the truth does not know.
        """
        labels, inverse = np.unique(measured.run, return_inverse=True)
        places = []
        for label in labels:
            run, _, piece = str(label).partition(" ")
            channel = " ".join(filter(None, (measured.mount, piece, measured.axis)))
            if run not in self.runs or channel not in self.channels:
                raise InputError(f"{self.path}: no truth of channel {channel} in run {run}")
            places.append((self.runs.index(run), self.channels.index(channel)))
        rows = np.searchsorted(self.frequency, measured.frequency - 1e-6)
        known = self.frequency[np.minimum(rows, self.frequency.size - 1)]
        if not np.allclose(known, measured.frequency, rtol=0, atol=1e-6):
            raise InputError(f"{self.path}: its frequency lines are not those of the campaign")
        run_place, channel_place = np.array(places)[inverse].T
        return np.asarray(self.stiffness[run_place, rows, channel_place])


def read_set_truth(campaign_folder: Path, mount_set: str) -> SetTruth | None:
    """Read the truth of a virtual campaign.

    Parameters
    ----------
    campaign_folder : Path
        Folder of ``campaign.toml``.
    mount_set : str
        Parts on the bench.

    Returns
    -------
    SetTruth or None
        None for a campaign that nobody knows the truth of.
    """
    path = Path(campaign_folder) / "truth" / f"{mount_set}.npz"
    if not path.is_file():
        return None
    with np.load(path, allow_pickle=False) as arrays:
        return SetTruth(
            path=path,
            runs=tuple(arrays["runs"].tolist()),
            channels=tuple(arrays["channels"].tolist()),
            frequency=arrays["frequency"],
            stiffness=arrays["stiffness"],
        )


CHECK_CASES = ((5, 120.0), (5, 220.0), (6, 120.0), (6, 160.0), (6, 220.0), (7, 220.0))
"""Gear and torque limit [N m] of the full-load runs that surfaces are judged with: thesis, 3.5."""

STEPS_PER_BENCH = 2 + len(STEPS)
"""Measuring, reading, and the steps of the characterisation."""


@dataclass(frozen=True)
class MeasuredSo:
    """What virtual benches measure beside the training runs, and how well.

    Parameters
    ----------
    low_gears : bool
        Full load in gears 3 and 4 as well.
    noise_free : bool
        Without noise and with every sensor as stated: what is left is the error of the method.
    third_cell : bool
        Three cells below each powertrain mount, and pushes beside its virtual point: force transfer
        matrices with moments.
    """

    low_gears: bool = False
    noise_free: bool = False
    third_cell: bool = False


TRAINING = MeasuredSo()


@dataclass(frozen=True, eq=False)
class CharacterisedBench:
    """One bench whose mounts were characterised.

    Parameters
    ----------
    title : str
        Such as ``bench 1``.
    result : Characterisation
        Of one mount set.
    truth : SetTruth or None
        None where nobody knows it.
    seconds : float
        That the characterisation took, with its error budget [s].
    """

    title: str
    result: Characterisation
    truth: SetTruth | None
    seconds: float

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.result.campaign.input_files, *truth)

    @property
    def surfaces(self) -> dict[str, DynamicStiffnessSurface]:
        """Of every direction that has one."""
        found = ((name, one.surface) for name, one in self.result.directions.items())
        return {name: surface for name, surface in found if surface is not None}

    @cached_property
    def check_runs(self) -> tuple[OperatingRun, ...]:
        """Runs of `CHECK_CASES`; all full-load runs where the campaign has none of them."""
        full_load = [run for run in self.result.runs if run.full_load]
        named = [run for run in full_load if (run.gear, run.torque_limit) in CHECK_CASES]
        return tuple(named or full_load or self.result.runs)

    def in_check_runs(self, measured: OperatingMap) -> npt.NDArray[np.bool_]:
        """Say which lines of a map belong to the check runs, shape (n,)."""
        names = {run.name for run in self.check_runs}
        return np.array([str(label).partition(" ")[0] in names for label in measured.run])

    @cached_property
    def stated_maps(self) -> dict[str, OperatingMap]:
        """Maps with all chains as their position sheet states them, without self-calibration."""
        stated = [stated_alignment(chain.alignment) for chain in self.result.chains]
        return self._maps(stated, self.result.runs)

    @cached_property
    def all_gears_maps(self) -> dict[str, OperatingMap]:
        """Maps of every run with rising torque, whatever its gear."""
        options = replace(self.result.options, gears=None)
        runs = training_runs(self.result.campaign, self.result.mount_set, options)
        return self._maps(self.result.chains, runs)

    def _maps(
        self, chains: Sequence[AlignmentEstimate], runs: Sequence[OperatingRun]
    ) -> dict[str, OperatingMap]:
        tolerances = self.result.campaign.tolerances
        records = [body_record(chain.alignment.body, runs, tolerances) for chain in chains]
        return operating_maps(chains, records, self.result.options.estimate)

    def modelled(self, surface: DynamicStiffnessSurface, measured: OperatingMap) -> ComplexArray:
        """Stiffness of a surface at every line of a map, shape (n,) [N/m]."""
        points = measured.points(self.result.options.preload)
        return surface.predict(points, extrapolate=True)

    def fitted_to(
        self, measured: OperatingMap, regressor: PiecewiseCubicRegressor | None = None
    ) -> DynamicStiffnessSurface:
        """Fit a surface to a map, in pieces as the campaign's unless stated otherwise."""
        options = self.result.options
        samples = measured.samples(options.preload)
        surface = DynamicStiffnessSurface(
            regressor or options.regressor, preload_unit=options.preload.unit
        )
        return surface.fit(samples.points, samples.stiffness, groups=samples.run)


def characterise_folder(
    folder: Path,
    mount_set: str,
    options: CharacteriseOptions,
    title: str,
    progress: Callable[[int, str], None],
) -> CharacterisedBench:
    """Characterise one mount set of a campaign and find the truth, if there is any.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    mount_set : str
        Parts on the bench.
    options : CharacteriseOptions
        How.
    title : str
        Of the bench.
    progress : callable
        Called with steps done out of `STEPS_PER_BENCH`, and what comes next.

    Raises
    ------
    InputError
        A campaign that cannot be read or characterised.
    """
    progress(1, f"{title}: reading")
    campaign = read_campaign(folder, (mount_set,))

    def step(done: int, _total: int, text: str) -> None:
        progress(2 + done, f"{title}: {text}")

    begin = time.perf_counter()
    with threadpool_limits(1):  # its matrices are too small to share
        result = characterise(campaign, mount_set, options, step)
    seconds = time.perf_counter() - begin
    return CharacterisedBench(title, result, read_set_truth(folder, mount_set), seconds)


def characterise_given(
    folder: Path, mount_set: str, options: CharacteriseOptions, progress: Progress
) -> CharacterisedBench:
    """Characterise one mount set of a campaign that is there, under its own name.

    Raises
    ------
    InputError
        As `characterise_folder`.
    """

    def step(done: int, text: str) -> None:
        progress(done, STEPS_PER_BENCH, text)

    return characterise_folder(folder, mount_set, options, Path(folder).name, step)


def characterise_benches(
    seeds: Sequence[int],
    mount_set: str,
    options: CharacteriseOptions,
    progress: Progress,
    measured: MeasuredSo = TRAINING,
) -> tuple[CharacterisedBench, ...]:
    """Measure the training runs on virtual benches, characterise them, and keep no files.

    Parameters
    ----------
    seeds : sequence of int
        One bench each, from 1.
    mount_set : str
        Parts on all benches.
    options : CharacteriseOptions
        How they are characterised.
    progress : callable
        ``progress(done, total, text)``.
    measured : MeasuredSo
        What the benches measure.

    Raises
    ------
    InputError
        No seed, a seed below 1, or an unknown mount set.
    """
    if not seeds:
        raise InputError("there is no bench to characterise: ask for at least one")
    total = len(seeds) * STEPS_PER_BENCH
    runs = (*(LOW_GEAR_RUNS if measured.low_gears else ()), *TRAINING_RUNS)
    plan = CampaignPlan((mount_set,), runs, third_cell=measured.third_cell)
    errors = NO_ERRORS if measured.noise_free else CampaignErrors()
    benches = []
    for place, seed in enumerate(seeds):

        def step(done: int, text: str, before: int = place * STEPS_PER_BENCH) -> None:
            progress(before + done, total, text)

        title = f"bench {seed}"
        step(0, f"{title}: measuring")
        with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
            folder = Path(temporary) / "campaign"
            write_campaign(folder, seed, plan, errors)
            benches.append(characterise_folder(folder, mount_set, options, title, step))
    return tuple(benches)


@dataclass(frozen=True, eq=False)
class Reprojection:
    """One accelerometer, and what the motion of the whole body makes of it.

    Parameters
    ----------
    sensor : Sensor
        Beside one mount.
    measured, reprojected : array, shape (n_frequency, 3)
        In sensor axes [m/s²].
    """

    sensor: Sensor
    measured: ComplexArray
    reprojected: ComplexArray


@dataclass(frozen=True, eq=False)
class Neighbour:
    """A sensor in the place of the virtual point beside it, along one axis.

    Parameters
    ----------
    mount, axis, sensor : str
        Direction, and the sensor beside it.
    at_point, at_sensor : array, shape (n_frequency,)
        Acceleration at the virtual point and of the sensor, in vehicle axes [m/s²].
    """

    mount: str
    axis: str
    sensor: str
    at_point: ComplexArray
    at_sensor: ComplexArray

    @property
    def direction(self) -> str:
        """``<mount> <axis>``."""
        return f"{self.mount} {self.axis}"

    @property
    def error(self) -> RealArray:
        """Relative error of the stiffness magnitude by the sensor's motion, shape (n,)."""
        return np.asarray(np.abs(self.at_point) / np.abs(self.at_sensor) - 1)


def shown_run(bench: CharacterisedBench) -> OperatingRun:
    """Return the run that motions are shown of: of the check runs the one of most torque."""
    return max(bench.check_runs, key=lambda run: (run.torque_limit, -run.gear))


def reprojections(bench: CharacterisedBench) -> tuple[Reprojection, ...]:
    """Re-project the first sensor beside each mount of each rigid body, in the run shown."""
    run = shown_run(bench)
    found = []
    for chain in _rigid(bench):
        body = chain.alignment.body
        measured = run.acceleration.select(body.channels).values
        forward = chain.alignment.forward(chain.mean)
        again = np.asarray(measured @ np.linalg.pinv(forward).T @ forward.T, dtype=complex)
        for sensor in _beside_mounts(chain).values():
            columns = [body.channels.index(name) for name in sensor.channels]
            found.append(Reprojection(sensor, measured[:, columns], again[:, columns]))
    return tuple(found)


def neighbours(bench: CharacterisedBench) -> tuple[Neighbour, ...]:
    """Compare each virtual point of a rigid body with the first sensor beside it."""
    run = shown_run(bench)
    found = []
    for chain in _rigid(bench):
        body = chain.alignment.body
        at_points = run.acceleration.select(body.channels).values @ chain.motion_matrix.T
        beside = _beside_mounts(chain)
        for place, point in enumerate(body.points):
            if point.name not in beside:
                continue
            sensor = beside[point.name]
            turned = run.acceleration.select(sensor.channels).values @ sensor.orientation.T
            for row, axis in enumerate(AXES):
                if axis in point.axes:
                    column = at_points[:, 3 * place + row]
                    found.append(Neighbour(point.name, axis, sensor.name, column, turned[:, row]))
    return tuple(found)


def quality_of_motion(bench: CharacterisedBench) -> pd.DataFrame:
    """Judge the virtual points of each rigid body in the run shown, in the order of repair.

    Columns as of `deboom.measurement.quality.quality_table`; ``worst`` names a channel,
    sensor or motion, and leave-one-out the culprit with its likely fault.
    """
    run = shown_run(bench)
    tolerances = bench.result.campaign.tolerances
    rows: list[dict[str, object]] = []
    for chain in _rigid(bench):
        body = chain.alignment.body
        channels = {name for one in body.accelerometers for name in one.channels}
        off = sorted(channels - set(body.channels))
        point = virtual_point(sensor_geometry(body.accelerometers, switched_off=off))
        rows += quality_table(quality_in_operation(point, run.acceleration, tolerances=tolerances))
    return pd.DataFrame(rows, columns=["check", "number [1]", "limit", "verdict", "worst"])


def _rigid(bench: CharacterisedBench) -> list[AlignmentEstimate]:
    return [chain for chain in bench.result.chains if chain.alignment.body.is_rigid_body]


def _beside_mounts(chain: AlignmentEstimate) -> dict[str, Sensor]:
    """First sensor beside each point of a body whose three channels are all in use."""
    body = chain.alignment.body
    beside: dict[str, Sensor] = {}
    for point in body.points:
        for sensor in body.accelerometers:
            own = (sensor.mount, sensor.piece) == (point.mount, point.piece)
            if own and set(sensor.channels) <= set(body.channels):
                beside.setdefault(point.name, sensor)
    return beside


N_PER_MM = 1e-3
"""From N/m to N/mm."""
MICRO = 1e6
SHOWN_POINTS = 2000
"""Of a panel; more hide each other."""
SPEED = "engine speed [rpm]"
MEASURED = ", measured"


def characterisation_figures(bench: CharacterisedBench) -> dict[str, bytes]:
    """Draw all pictures of one bench; file stem → PNG."""
    maps = {name: _thinned(one) for name, one in usable_maps(bench).items()}
    figures = {
        "map_magnitude": _map(maps, lambda m: m.frequency, "frequency [Hz]", _magnitude),
        "map_phase": _map(maps, lambda m: m.frequency, "frequency [Hz]", _phase),
        "map_amplitude": _map(
            maps,
            lambda m: np.asarray(20 * np.log10(m.amplitude / m.amplitude.max())),
            "amplitude [dB]",
            _magnitude,
        ),
    }
    for axis in dict.fromkeys(one.axis for one in maps.values()):
        panels = _static_panels(bench, axis, maps)
        if panels:
            figures[f"static_{axis}"] = curve_panels(
                panels, x_label="static force [N]", y_label="K [N/mm]", columns=len(panels) // 2
            )
    for mount in dict.fromkeys(one.mount for one in maps.values()):
        names = [name for name in bench.surfaces if maps[name].mount == mount]
        if names:
            stem = mount.replace(" ", "_")
            figures[f"stiffness_{stem}"] = _load_cases(bench, names, of_force=False)
            figures[f"force_{stem}"] = _load_cases(bench, names, of_force=True)
    return figures | _motion_figures(bench)


def usable_maps(bench: CharacterisedBench) -> dict[str, OperatingMap]:
    """Return the maps of all directions that were ever loaded, without lines near the floor."""
    maps = {name: one.measured for name, one in bench.result.directions.items()}
    usable = {name: one.select(~one.near_floor) for name, one in maps.items()}
    return {name: one for name, one in usable.items() if len(one)}


def _thinned(measured: OperatingMap) -> OperatingMap:
    return measured.select(slice(None, None, max(1, len(measured) // SHOWN_POINTS)))


def _magnitude(measured: OperatingMap) -> tuple[RealArray, str]:
    return np.abs(measured.stiffness) * N_PER_MM, "|K| [N/mm]"


def _phase(measured: OperatingMap) -> tuple[RealArray, str]:
    return np.degrees(np.angle(measured.stiffness)), "phase of K [°]"


def _map(
    maps: dict[str, OperatingMap],
    height: Callable[[OperatingMap], RealArray],
    y_label: str,
    value: Callable[[OperatingMap], tuple[RealArray, str]],
) -> bytes:
    panels = [MapPanel(name, m.wheel_torque, height(m), value(m)[0]) for name, m in maps.items()]
    label = value(next(iter(maps.values())))[1]
    return map_panels(panels, x_label="wheel torque [N m]", y_label=y_label, value_label=label)


def _static_panels(
    bench: CharacterisedBench, axis: str, maps: dict[str, OperatingMap]
) -> list[CurvePanel]:
    """Real parts of all mounts, then imaginary parts, over the static force."""
    names = [
        name
        for name in bench.surfaces
        if maps[name].axis == axis and np.isfinite(maps[name].static_force).all()
    ]
    panels = []
    for part, of in (("Re", np.real), ("Im", np.imag)):
        for name in names:
            lines = maps[name]
            preload = lines.preload(Preload.STATIC_FORCE)
            modelled = bench.modelled(bench.surfaces[name], lines)
            points = {
                "measured": (preload, of(lines.stiffness) * N_PER_MM),
                "response surface": (preload, of(modelled) * N_PER_MM),
            }
            panels.append(CurvePanel(f"{part} K, {name}", preload, {}, points))
    return panels


def _load_cases(bench: CharacterisedBench, names: list[str], *, of_force: bool) -> bytes:
    """Check runs of one mount: real parts of its directions, then imaginary parts."""
    runs, order = bench.check_runs, bench.result.campaign.order
    common: RealArray = reduce(np.intersect1d, [run.frequency for run in runs])
    panels = []
    letter, unit = ("F", "N") if of_force else ("K", "N/mm")
    for part, of in (("Re", np.real), ("Im", np.imag)):
        for name in names:
            modelled: dict[str, RealArray] = {}
            measured: dict[str, RealArray] = {}
            for run in runs:
                lines = _lines_of(bench.result.directions[name].measured, run.name, common)
                surface = bench.modelled(bench.surfaces[name], lines)
                label = _case(run.gear, run.torque_limit)
                modelled[label] = of(_shown(surface, lines, of_force))
                measured[label + MEASURED] = of(_shown(lines.stiffness, lines, of_force))
            title = f"{part} {letter}, {name}"
            panels.append(CurvePanel(title, rpm_of_frequency(common, order), modelled | measured))
    return curve_panels(
        panels,
        x_label=SPEED,
        y_label=f"{letter} [{unit}]",
        columns=len(names),
        dashed=[_case(run.gear, run.torque_limit) + MEASURED for run in runs],
    )


def _case(gear: int, torque_limit: float) -> str:
    return f"gear {gear}, {torque_limit:g} N m"


def _lines_of(measured: OperatingMap, run: str, frequency: RealArray) -> OperatingMap:
    """Lines of one run; of a mount with several pieces those of the first."""
    labels = [str(label) for label in measured.run]
    own = next(label for label in labels if label.partition(" ")[0] == run)
    return measured.select((measured.run == own) & np.isin(measured.frequency, frequency))


def _shown(stiffness: ComplexArray, lines: OperatingMap, of_force: bool) -> ComplexArray:
    return stiffness * lines.displacement if of_force else stiffness * N_PER_MM


def _motion_figures(bench: CharacterisedBench) -> dict[str, bytes]:
    run = shown_run(bench)
    rpm = rpm_of_frequency(run.frequency, run.order)
    again, beside = reprojections(bench), neighbours(bench)
    if not again:
        return {}
    reprojected = [
        CurvePanel(
            f"{one.sensor.channels[row]}, {one.sensor.mount}",
            rpm,
            {
                f"{part}, {label}": of(values[:, row])
                for part, of in (("Re", np.real), ("Im", np.imag))
                for label, values in (("rigid body", one.reprojected), ("measured", one.measured))
            },
        )
        for one in again
        for row in range(3)
    ]
    motion = [
        CurvePanel(
            one.direction,
            rpm,
            {"virtual point": np.abs(one.at_point), "sensor beside": np.abs(one.at_sensor)},
        )
        for one in beside
    ]
    error = [
        CurvePanel(axis, rpm, {one.mount: 100 * one.error for one in beside if one.axis == axis})
        for axis in dict.fromkeys(one.axis for one in beside)
    ]
    return {
        "reprojected_acceleration": curve_panels(
            reprojected,
            x_label=SPEED,
            y_label="a [m/s²]",
            dashed=("Re, measured", "Im, measured"),
        ),
        "neighbour_acceleration": curve_panels(
            motion,
            x_label=SPEED,
            y_label="|a| [m/s²]",
            dashed=("sensor beside",),
        ),
        "neighbour_stiffness_error": curve_panels(error, x_label=SPEED, y_label="error of |K| [%]"),
    }


PARTS = ("real", "imag")


def direction_numbers(benches: Sequence[CharacterisedBench]) -> pd.DataFrame:
    """One row per bench and direction; plain ratios, nan where something is not known.

    Columns ``r2_<part>`` and ``r2_force_<part>`` compare the surface with its own lines, with the
    prefix ``check_`` a surface fitted without the check runs with those. ``error`` and its kin are
    rms relative errors of the magnitude against the truth, ``error_imag`` the median one of Im K.
    """
    rows = [_row(bench, name) for bench in benches for name in bench.surfaces]
    if not rows:
        raise InputError("no direction of any mount could be characterised: nothing to report")
    return pd.DataFrame(rows)


def all_gears_numbers(benches: Sequence[CharacterisedBench]) -> pd.DataFrame:
    """One row per bench and direction, for surfaces over all gears, pieces by cross-validation.

    Columns as in `direction_numbers`, and ``pieces`` of the real part.
    """
    rows: list[dict[str, object]] = []
    for bench in benches:
        for name in bench.surfaces:
            measured = bench.all_gears_maps[name]
            usable = measured.select(~measured.near_floor)
            surface = bench.fitted_to(usable, PiecewiseCubicRegressor(pieces="cv"))
            row: dict[str, object] = {"bench": bench.title, "direction": name}
            row["pieces"] = len(surface.real_.coefficients_)
            row |= _r2(bench, surface, usable)
            row |= _errors(bench, surface, usable)
            rows.append(row)
    return pd.DataFrame(rows)


def model_table(
    bench: CharacterisedBench, models: Mapping[str, StiffnessModel] | None = None
) -> pd.DataFrame:
    """Compare models of the stiffness, fitted without the check runs, on those of one bench.

    Parameters
    ----------
    bench : CharacterisedBench
        With its surfaces.
    models : mapping of str to StiffnessModel, optional
        Models by name; default are those of `standard_models`.

    Returns
    -------
    pandas.DataFrame
        One row per direction and model, see `compare_models`.

    Raises
    ------
    InputError
        No direction has lines in check runs and in others.
    """
    preload = bench.result.options.preload
    parts = []
    for name in bench.surfaces:
        measured = bench.result.directions[name].measured
        usable = measured.select(~measured.near_floor)
        check = bench.in_check_runs(usable)
        if check.all() or not check.any():
            continue
        held_out = usable.select(check)
        truth = None if bench.truth is None else bench.truth.at(held_out)
        chosen = standard_models() if models is None else models
        training, lines = usable.select(~check).samples(preload), held_out.samples(preload)
        try:
            table = compare_models(chosen, training, lines, truth)
        except InputError:  # its check runs lie where the others did not go
            continue
        table.insert(0, "direction", name)
        parts.append(table.drop(columns="time to fit [s]"))
    if not parts:
        raise InputError("models are compared on check runs: measure runs beside them, too")
    return pd.concat(parts, ignore_index=True)


def _row(bench: CharacterisedBench, name: str) -> dict[str, object]:
    one = bench.result.directions[name]
    surface, measured = bench.surfaces[name], one.measured
    usable = measured.select(~measured.near_floor)
    row: dict[str, object] = {
        "bench": bench.title,
        "direction": name,
        **_r2(bench, surface, usable),
    }
    row |= _budget(bench, name)
    if bench.truth is not None:
        row |= _errors(bench, surface, usable)
        stated = bench.stated_maps[name]
        row["error_stated"] = _errors(
            bench, bench.fitted_to(stated), stated.select(~stated.near_floor)
        )["error"]
    check = bench.in_check_runs(usable)
    if check.any() and not check.all():
        without = bench.fitted_to(usable.select(~check))
        held_out = usable.select(check)
        inside = without.supported(held_out.points(bench.result.options.preload))
        row["check_inside"] = float(inside.mean())
        held_out = held_out.select(inside)
        row |= {f"check_{key}": value for key, value in _r2(bench, without, held_out).items()}
        if bench.truth is not None:
            row["check_error"] = _errors(bench, without, held_out)["error"]
    return row


def _r2(
    bench: CharacterisedBench, surface: DynamicStiffnessSurface, lines: OperatingMap
) -> dict[str, float]:
    if len(lines) < 2:
        return {}
    found = agreement(lines.samples(bench.result.options.preload), bench.modelled(surface, lines))
    return {
        "r2_real": found.r2_real,
        "r2_imag": found.r2_imag,
        "r2_force_real": found.r2_force_real,
        "r2_force_imag": found.r2_force_imag,
    }


def _errors(
    bench: CharacterisedBench, surface: DynamicStiffnessSurface, lines: OperatingMap
) -> dict[str, float]:
    if bench.truth is None or not len(lines):
        return {"error": np.nan, "error_imag": np.nan}
    truth, modelled = bench.truth.at(lines), bench.modelled(surface, lines)
    relative = np.abs(modelled) / np.abs(truth) - 1
    return {
        "error": float(np.sqrt(np.mean(relative**2))),
        "error_imag": float(np.median(np.abs(modelled.imag / truth.imag - 1))),
    }


def _budget(bench: CharacterisedBench, name: str) -> dict[str, object]:
    one = bench.result.directions[name]
    budget = one.budget
    if budget is None:
        return {}
    row: dict[str, object] = {
        "half_width": budget.half_width_95,
        "half_width_imag": budget.imag_half_width_95,
        "half_width_stated": budget.stated_half_width,
        "misfit": budget.misfit,
        "repeatability": budget.repeatability,
        **{source.value: width for source, width in budget.sources.items()},
    }
    if bench.truth is not None:
        row["coverage"] = _coverage(bench, bench.truth, name, budget)
    return row


def _coverage(
    bench: CharacterisedBench, truth: SetTruth, name: str, budget: DirectionBudget
) -> float:
    r"""Share of the budget's lines whose true magnitude lies inside the stated band."""
    measured = bench.result.directions[name].measured
    usable = measured.select(~measured.near_floor)
    points = usable.samples(bench.result.options.preload).points
    scale = np.ptp(points, axis=0)
    rows = cKDTree(points / scale).query(budget.points / scale)[1]
    modelled = np.abs(bench.modelled(bench.surfaces[name], usable))
    relative = (np.abs(truth.at(usable)) / modelled - 1)[rows]
    return float(np.mean((budget.lower <= relative) & (relative <= budget.upper)))


def over_benches(numbers: pd.DataFrame, column: str, quantile: float = 0.5) -> pd.Series[float]:
    """Quantile over the benches of one column in percent, by direction; nan where not known."""
    names = numbers["direction"].drop_duplicates().tolist()
    if column not in numbers:
        return pd.Series(np.nan, index=names)
    values = numbers.groupby("direction", sort=False)[column].quantile(quantile)
    return 100.0 * values.reindex(names)


def identified(numbers: pd.DataFrame) -> pd.Series[bool]:
    """Whether the median half width over the benches is narrow enough, by direction."""
    return over_benches(numbers, "half_width") <= 100.0 * IDENTIFIED


R2_WARNING = (
    "A high R² is no accuracy: it compares the surface with what was measured, and a measuring "
    "chain that is half a degree askew is askew in every run. The error budget says how far to "
    "believe a direction."
)
TRUTH_WARNING = (
    "The errors against the truth are those of the virtual test bench, whose noise and alignment "
    "errors are stated, not those of a particular laboratory."
)
ALONE = " alone [%]"
"""Ends the names of the columns that take one source of error alone."""
STATIC_CAPTION = (
    "Real parts above, imaginary parts below, over the quasi-static force of the cells. The "
    "scatter of both is the projection of amplitude and frequency."
)


def characterisation_page(
    benches: Sequence[CharacterisedBench],
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
) -> Page:
    """Compose the page from the study's tables and figures; figures are those of the first bench.

    Parameters
    ----------
    benches : sequence of CharacterisedBench
        At least one.
    tables : mapping of str to DataFrame
        Those of the study's result.
    pictures : mapping of str to bytes
        Its figures, as PNG.
    """
    first = benches[0].result
    sections = (
        _asked(benches),
        _accuracy(tables),
        Section(
            "What was measured",
            f"{benches[0].title}: each point is one line of one run. The wheel torque stands for "
            "the preload; lines whose displacement hardly exceeds its noise are left out.",
            figures=_present(
                pictures,
                {
                    "map_magnitude": "Magnitude of the operating dynamic stiffness over wheel "
                    "torque and frequency.",
                    "map_phase": "Its phase: the loss angle.",
                    "map_amplitude": "Magnitude over wheel torque and displacement amplitude, "
                    "in decibels of the largest one of the direction.",
                },
            ),
        ),
        _transfer(tables, pictures),
        Section(
            "Characteristic curves",
            "The dynamic stiffness over the static force, as suppliers specify it.",
            figures=_present(
                pictures, {f"static_{axis}": f"Axis {axis}. {STATIC_CAPTION}" for axis in AXES}
            ),
        ),
        Section(
            "Measured against the response surface",
            f"{len(benches[0].check_runs)} full-load runs. Dashed: measured. Solid: the response "
            "surface at the measured torque, displacement and frequency.",
            figures=_present(pictures, _load_case_captions(pictures)),
        ),
        Section(
            "Motion of the powertrain",
            f"Run {shown_run(benches[0]).name}. The motion of the rigid body comes from all "
            "accelerometers together; each of them can be computed from it again.",
            figures=_present(
                pictures,
                {
                    "reprojected_acceleration": "One accelerometer beside each mount, in its own "
                    "axes: dashed as measured, solid as the rigid body moves there.",
                    "neighbour_acceleration": "Acceleration at the virtual point of each mount "
                    "(solid) and of the sensor beside it (dashed).",
                    "neighbour_stiffness_error": "Error of the stiffness if the sensor beside the "
                    "mount stood for its virtual point.",
                },
            ),
            tables=(
                Table(tables["neighbour"], "That error over all lines of the run."),
                Table(
                    tables["quality"],
                    "Whether the sensors agree, in the order in which a laboratory repairs things: "
                    "the first check needs the position sheet alone, the last leaves one sensor "
                    "out at a time and names the culprit.",
                    {"number [1]": 3},
                ),
            ),
        ),
    )
    known = "truth" in tables
    return Page(
        title="Mounts from raw sensors",
        question=(
            f"How stiff are {', '.join(mount.name for mount in first.campaign.mounts)} in "
            "operation, and how far may the answer be believed?"
        ),
        headlines=_headlines(benches, tables),
        terms=("dynamic stiffness",),
        warnings=(R2_WARNING, TRUTH_WARNING) if known else (R2_WARNING,),
        sections=sections,
    )


def _headlines(
    benches: Sequence[CharacterisedBench], tables: Mapping[str, pd.DataFrame]
) -> tuple[Headline, ...]:
    uncertainty = tables["uncertainty"].set_index("direction")
    found = uncertainty.index[uncertainty["identified"] == "identified"]
    headlines = [Headline(f"{len(found)} of {len(uncertainty)}", "directions identified")]
    if "truth" in tables and len(found):
        errors = tables["truth"].set_index("direction").loc[found, "error of |K|, median [%]"]
        headlines += [
            Headline(f"{errors.median():.1f} %", "rms error of an identified direction, median"),
            Headline(f"{errors.max():.1f} %", f"the largest of them, {errors.idxmax()}"),
        ]
    seconds = sorted(bench.seconds for bench in benches)[len(benches) // 2]
    headlines.append(Headline(f"{seconds:.0f} s", "per mount set, with error budget"))
    return tuple(headlines)


def _asked(benches: Sequence[CharacterisedBench]) -> Section:
    first = benches[0].result
    options = first.options
    complaints = [one.complaint for one in first.directions.values() if one.complaint]
    gears = sorted({run.gear for run in first.runs})
    text = (
        f"Mount set {first.mount_set} on {len(benches)} "
        f"{'benches' if len(benches) > 1 else 'bench'}: {len(first.runs)} runs with rising torque "
        f"in the gears {', '.join(map(str, gears))}, engine order {first.campaign.order:g}. "
        f"Preload variable: {options.preload.name.lower().replace('_', ' ')}.\n\n"
        "Accelerometers give the motion of the rigid powertrain and with it of the virtual point "
        "in each mount; cells below the mounts, calibrated by a shaker at the virtual point, give "
        "its force. Force over displacement is the operating dynamic stiffness. Complete cubics "
        "in preload, displacement amplitude and frequency, in pieces of the preload, are fitted "
        "to real and imaginary part."
    )
    if options.self_calibration:
        text += (
            " Before that the measuring chain calibrates itself: sensors on a rigid body must "
            "agree, and the forces of the mounts must be mass times acceleration."
        )
    return Section("What was asked, and with which data", "\n\n".join([text, *complaints]))


def _accuracy(tables: Mapping[str, pd.DataFrame]) -> Section:
    uncertainty = tables["uncertainty"]
    alone = [name for name in uncertainty.columns if name.endswith(ALONE)]
    sources = uncertainty[["direction", *alone]]
    shown = [
        Table(
            uncertainty.drop(columns=alone),
            "Half width of the 95 % band of the surface, median over its lines. Beyond "
            f"{100 * IDENTIFIED:.0f} % a direction is not identified.",
        ),
        Table(
            sources.rename(columns=lambda name: name.replace(ALONE, " [%]")),
            "The same half width if one stated tolerance alone were at work, without "
            "self-calibration.",
        ),
    ]
    if "truth" in tables:
        shown.append(
            Table(
                tables["truth"],
                "Rms error of the surface against the truth of the bench, median and 90 % quantile "
                "over the benches. Held-out: a surface fitted without the check runs, on those.",
            )
        )
    shown.append(
        Table(
            tables["r2"],
            "Coefficient of determination, median over the benches, beside tables 6 to 8 of the "
            "thesis. Held-out as above; a dash: not known.",
            {name: 2 for name in tables["r2"].columns if name.endswith("[%]")},
        )
    )
    if "all_gears" in tables:
        shown.append(
            Table(
                tables["all_gears"],
                "Surfaces over the gears above beside surfaces over all gears of the campaign, "
                "whose number of pieces a cross-validation chose (median of the real part); each "
                "judged on its own lines.",
                {name: 2 for name in tables["all_gears"].columns if name.startswith("R²")}
                | {"pieces over all gears": 0},
            )
        )
    if "models" in tables:
        shown.append(
            Table(
                tables["models"],
                "Other models of the stiffness beside the surface, which is two cubics by least "
                "squares: all fitted without the check runs and judged on those.",
                {name: 2 for name in tables["models"].columns if name.endswith("[%]")},
            )
        )
    return Section(
        "How far to believe it",
        "Three questions, three tables: what the measuring chain leaves unknown, how far the "
        "result is from the truth where the truth is known, and how well the surface follows what "
        "was measured.",
        tables=tuple(shown),
    )


def _transfer(tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]) -> Section:
    """How the cells below the mounts are calibrated, and whether moments matter."""
    shown = [
        Table(
            tables["force_transfer"],
            "Mean over frequency and repeats. Deviations are relative to the matrix's column; six "
            "loads: three forces and three moments.",
            {"condition number [1]": 2, "cells": 0, "loads": 0, "repeats": 0},
        )
    ]
    text = (
        "A shaker at the virtual point of each mount says what the cells below it make of a force "
        "there. The force in operation is the inverse of that matrix times the cells' force."
    )
    if "moments" in tables:
        cost = tables["moments"]
        by_case = cost.groupby("load case", sort=False)[[RMS, PEAKS]].max().reset_index()
        shown.append(
            Table(
                by_case,
                f"Largest difference in any of {cost['vehicle'].nunique()} vehicles.",
                {RMS: 3, PEAKS: 3},
            )
        )
        text += (
            "\n\nThree cells and pushes beside the virtual point give the moments as well. Leaving "
            f"them out changes booming peaks by up to {cost[PEAKS].max():.2g} dB. That is what "
            "moments change in the forces: noise transfer functions are known for forces alone, so "
            "the sound that the moments themselves make is not in it."
        )
    captions = {
        "cell_calibration": "Cells per newton of the shaker: along its axis, and across by "
        "cross-talk. The slope is the bench that gives way."
    }
    return Section(
        "Force transfer matrices",
        text,
        tables=tuple(shown),
        figures=_present(pictures, captions),
    )


def _load_case_captions(pictures: Mapping[str, bytes]) -> dict[str, str]:
    what = {"stiffness": "Dynamic stiffness", "force": "Dynamic force"}
    split = ((stem, *stem.partition("_")[::2]) for stem in pictures)
    return {stem: f"{what[kind]} of {mount}." for stem, kind, mount in split if kind in what}


def _present(pictures: Mapping[str, bytes], captions: Mapping[str, str]) -> tuple[Picture, ...]:
    return tuple(
        Picture(pictures[stem], alt=caption, caption=caption)
        for stem, caption in captions.items()
        if stem in pictures
    )


THESIS_R2 = {
    "EnM x": (99.978, 99.665, 99.975, 99.614),
    "EnM y": (60.865, 69.366, 87.228, 68.713),
    "EnM z": (99.249, 88.197, 99.518, 82.635),
    "GeM x": (99.654, 99.441, 99.794, 99.612),
    "GeM y": (92.474, 74.168, 92.146, 85.348),
    "GeM z": (99.441, 98.691, 99.612, 98.726),
    "TSM x": (99.976, 99.828, 99.975, 99.874),
    "TSM y": (99.912, 97.146, 99.949, 94.955),
    "TSM z": (99.969, 99.204, 99.976, 99.710),
}
"""Thesis, tables 6 to 8: R² of Re K, Im K, Re F, Im F [%]."""


def r2_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """R² of the surfaces per direction and part, median over benches, beside the thesis."""
    rows = []
    for place, (part, column) in enumerate((("real", "real"), ("imaginary", "imag"))):
        own, force, check, check_force = (
            over_benches(numbers, f"{prefix}_{column}")
            for prefix in ("r2", "r2_force", "check_r2", "check_r2_force")
        )
        for name in own.index:
            thesis = THESIS_R2.get(name, (np.nan,) * 4)
            rows.append(
                {
                    "direction": name,
                    "part": part,
                    "R² of stiffness [%]": own[name],
                    "thesis, stiffness [%]": thesis[place],
                    "R² of force [%]": force[name],
                    "thesis, force [%]": thesis[2 + place],
                    "held-out R² of stiffness [%]": check[name],
                    "held-out R² of force [%]": check_force[name],
                }
            )
    order = {name: place for place, name in enumerate(numbers["direction"].drop_duplicates())}
    return pd.DataFrame(rows).sort_values(
        "direction", key=lambda names: names.map(order), kind="stable", ignore_index=True
    )


def truth_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """Rms error of the surfaces against the bench's truth, over the benches."""
    columns = {
        "error of |K|, median [%]": over_benches(numbers, "error"),
        "error of |K|, 90 % [%]": over_benches(numbers, "error", 0.9),
        "error of Im K, median [%]": over_benches(numbers, "error_imag"),
        "held-out error of |K|, median [%]": over_benches(numbers, "check_error"),
        "held-out error of |K|, 90 % [%]": over_benches(numbers, "check_error", 0.9),
        "without self-calibration, median [%]": over_benches(numbers, "error_stated"),
        "without self-calibration, 90 % [%]": over_benches(numbers, "error_stated", 0.9),
    }
    return _by_direction(columns)


def uncertainty_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """List what the error budget makes of every direction, median over the benches."""
    columns = {
        "95 % half width of |K| [%]": over_benches(numbers, "half_width"),
        "95 % half width of Im K [%]": over_benches(numbers, "half_width_imag"),
        "without self-calibration [%]": over_benches(numbers, "half_width_stated"),
        "misfit of the surface [%]": over_benches(numbers, "misfit"),
        "repeatability of a line [%]": over_benches(numbers, "repeatability"),
        "truth inside the band [%]": _mean(numbers, "coverage"),
    }
    for source in ErrorSource:
        columns[f"{source.value} alone [%]"] = over_benches(numbers, source.value)
    table = _by_direction(columns)
    found = identified(numbers).to_numpy()
    table.insert(1, "identified", np.where(found, "identified", "not identified"))
    return table


def all_gears_table(numbers: pd.DataFrame, all_gears: pd.DataFrame) -> pd.DataFrame:
    """Surfaces over the chosen gears beside those over all gears with cross-validated pieces."""
    pieces = over_benches(all_gears, "pieces") / 100.0
    columns = {"pieces over all gears": pieces}
    for label, column in (
        ("R² of Re K", "r2_real"),
        ("R² of Im K", "r2_imag"),
        ("error of |K|", "error"),
    ):
        columns[f"{label}, chosen gears [%]"] = over_benches(numbers, column)
        columns[f"{label}, all gears [%]"] = over_benches(all_gears, column)
    return _by_direction(columns)


def neighbour_table(bench: CharacterisedBench) -> pd.DataFrame:
    """Stiffness error where a sensor beside the mount stands for its virtual point."""
    rows = [
        {
            "direction": one.direction,
            "sensor": one.sensor,
            "rms error of |K| [%]": 100.0 * float(np.sqrt(np.mean(one.error**2))),
            "median error of |K| [%]": 100.0 * float(np.median(one.error)),
        }
        for one in neighbours(bench)
    ]
    columns = ["direction", "sensor", "rms error of |K| [%]", "median error of |K| [%]"]
    return pd.DataFrame(rows, columns=columns)


def characterisation_summary(
    benches: Sequence[CharacterisedBench], numbers: pd.DataFrame
) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    by_key = {
        "r2_real": over_benches(numbers, "r2_real"),
        "r2_imag": over_benches(numbers, "r2_imag"),
        "r2_force_real": over_benches(numbers, "r2_force_real"),
        "r2_force_imag": over_benches(numbers, "r2_force_imag"),
        "r2_real_held_out": over_benches(numbers, "check_r2_real"),
        "r2_imag_held_out": over_benches(numbers, "check_r2_imag"),
        "truth_error_percent": over_benches(numbers, "error"),
        "truth_error_percent_90": over_benches(numbers, "error", 0.9),
        "truth_error_percent_held_out": over_benches(numbers, "check_error"),
        "truth_error_percent_stated": over_benches(numbers, "error_stated"),
        "half_width_95_percent": over_benches(numbers, "half_width"),
        "coverage_95_percent": _mean(numbers, "coverage"),
    }
    summary: dict[str, Scalar] = {"n_benches": len(benches)}
    for key, values in by_key.items():
        for name, value in values.dropna().items():
            summary[f"{key}_{str(name).replace(' ', '_')}"] = float(value)
    summary["n_identified"] = int(identified(numbers).sum())
    summary["seconds"] = round(float(np.median([bench.seconds for bench in benches])), 3)
    return summary


def _mean(numbers: pd.DataFrame, column: str) -> pd.Series[float]:
    """Mean over the benches in percent: that of a share of lines."""
    names = numbers["direction"].drop_duplicates().tolist()
    if column not in numbers:
        return pd.Series(np.nan, index=names)
    return 100.0 * numbers.groupby("direction", sort=False)[column].mean().reindex(names)


def _by_direction(columns: dict[str, pd.Series[float]]) -> pd.DataFrame:
    """Columns without a single known value are left out."""
    table = pd.DataFrame(columns).rename_axis("direction").reset_index()
    return table.dropna(axis="columns", how="all")


BAND: Band = (20.0, 60.0)


def force_transfer_matrices(bench: CharacterisedBench) -> dict[str, ForceTransferMatrix]:
    """Return the 3×3 matrix of every mount (piece) that a shaker calibrated."""
    runs = bench.result.campaign.shaker_runs
    return {
        point.name: force_transfer_matrix(runs, point.cells, point.mount, point.piece)
        for point in _points(bench)
        if point.calibrated
    }


def moment_transfer_matrices(bench: CharacterisedBench) -> dict[str, ForceTransferMatrix]:
    """Return the 6×6 matrix of every mount (piece) with pushes beside its virtual point."""
    campaign = bench.result.campaign
    pushed = {(run.mount, run.piece) for run in campaign.pushes}
    return {
        point.name: moment_transfer_matrix(campaign, point.mount, point.piece)
        for point in _points(bench)
        if (point.mount, point.piece) in pushed
    }


def force_transfer_table(matrices: Sequence[ForceTransferMatrix]) -> pd.DataFrame:
    """One row per mount: how constant its force transfer matrix is, and how well it inverts."""
    rows = [
        {
            "mount": " ".join(filter(None, (one.mount, one.piece))),
            "cells": len(one.cells),
            "loads": len(one.matrix),
            "repeats": min(one.repeats),
            "condition number [1]": one.condition_number,
            "residual [%]": 100 * one.residual,
            "largest change over frequency [%]": 100 * float(one.frequency_dependence.max()),
            "largest drift over repeats [%]": 100 * float(one.drift.max()),
        }
        for one in matrices
    ]
    columns = ["mount", "cells", "loads", "repeats", "condition number [1]", "residual [%]"]
    columns += ["largest change over frequency [%]", "largest drift over repeats [%]"]
    return pd.DataFrame(rows, columns=columns)


def force_transfer_figure(matrices: Mapping[str, ForceTransferMatrix]) -> bytes:
    """Draw every 3×3 matrix over frequency: along the shaker, and all that it shows across."""
    panels = [
        CurvePanel(
            f"{name}, {words}",
            one.frequency,
            {
                f"shaker along {axis}": np.linalg.norm(
                    one.response[:, kept[column], column], axis=1
                )
                for column, axis in enumerate(AXES)
            },
        )
        for kept, words in ((np.eye(3, dtype=bool), "along"), (~np.eye(3, dtype=bool), "across"))
        for name, one in matrices.items()
    ]
    return curve_panels(
        panels,
        x_label="frequency [Hz]",
        y_label="cells per shaker [N/N]",
        columns=len(matrices),
    )


def moment_cost_table(bench: CharacterisedBench, platform: Platform) -> pd.DataFrame:
    """Compare the sound at the ears with and without moments, check run by check run.

    Parameters
    ----------
    bench : CharacterisedBench
        Whose campaign has pushes beside the virtual points.
    platform : Platform
        Its vehicles listen.

    Returns
    -------
    DataFrame
        See `deboom.study.platform_model.level_differences`: forces out of the 6×6 matrices against
        those out of their 3×3 blocks.

    Raises
    ------
    InputError
        Vehicles without a noise transfer function for one of the forces.

    Notes
    -----
    Vehicles have noise transfer functions for forces alone. What is stated is what moments of the
    mounts change at the cells and so in the forces, not what the moments themselves radiate.
    """
    full = moment_transfer_matrices(bench)
    forces = {name: without_moments(one) for name, one in full.items()}
    tables = []
    for run in bench.check_runs:
        with_all, without = (_load_case(bench, run, known) for known in (full, forces))
        table = level_differences(platform.fleet, platform.mounts, with_all, without, BAND)
        table.insert(0, "load case", run.name)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _points(bench: CharacterisedBench) -> list[MountPoint]:
    return [point for chain in bench.result.chains for point in chain.alignment.body.points]


def _load_case(
    bench: CharacterisedBench, run: OperatingRun, transfers: Mapping[str, ForceTransferMatrix]
) -> LoadCase:
    """One run with its forces by these matrices; other mounts as they are characterised."""
    names: list[str] = []
    displacements, forces = [], []
    to_displacement = -1 / (2 * np.pi * run.frequency[:, np.newaxis]) ** 2
    for chain in bench.result.chains:
        body = chain.alignment.body
        motion = run.acceleration.select(body.channels).values @ chain.motion_matrix.T
        for place, point in enumerate(body.points):
            rows = [AXES.index(axis) for axis in point.axes]
            if point.name in transfers:
                force = operating_force(transfers[point.name], run.cell_force).values
            else:
                cells = run.cell_force.select(point.cell_channels).values
                force = cells @ point.force_matrix.T
            names += [f"{point.name} {axis}" for axis in point.axes]
            forces.append(force[:, rows])
            displacements.append(to_displacement * motion[:, [3 * place + row for row in rows]])
    channels = tuple(names)
    return LoadCase(
        name=run.name,
        title=run.name,
        gear=run.gear,
        total_ratio=run.total_ratio,
        torque_limit=run.torque_limit,
        order=run.order,
        displacement=Spectrum(run.frequency, np.hstack(displacements), channels, "m"),
        force=Spectrum(run.frequency, np.hstack(forces), channels, "N"),
    )


def characterisation_result(
    benches: Sequence[CharacterisedBench],
    inputs: tuple[Path, ...] = (),
    *,
    all_gears: bool = False,
    models: bool = False,
    with_figures: bool = True,
    platform: Path | None = None,
) -> StudyResult:
    """Make tables, figures, headline numbers and page of characterised benches.

    Parameters
    ----------
    benches : sequence of CharacterisedBench
        At least one; figures show the first, tables all.
    inputs : tuple of Path
        Files that stay; a bench that was measured for the study leaves none.
    all_gears : bool
        Whether surfaces over all gears, in pieces by cross-validation, are shown beside.
    models : bool
        Whether other models of the stiffness are shown beside, for the first bench.
    with_figures : bool
        Whether to draw; the tables take a fraction of the time.
    platform : Path, optional
        Folder with ``platform.toml``, whose vehicles say what it costs to leave moments out; looked
        at where the first bench's campaign has pushes beside its virtual points.

    Returns
    -------
    StudyResult
        Tables ``r2``, ``truth`` (where the truth is known), ``uncertainty``, ``neighbour``,
        ``quality``, ``force_transfer``, ``moments`` (where known), ``all_gears`` and ``models`` (if
        asked for) and ``directions``, the numbers of every bench behind them.
    """
    with threadpool_limits(1):  # its matrices are too small to share
        numbers = direction_numbers(benches)
        beside = all_gears_numbers(benches) if all_gears else None
    tables = {
        "r2": r2_table(numbers),
        "uncertainty": uncertainty_table(numbers),
        "neighbour": neighbour_table(benches[0]),
        "quality": quality_of_motion(benches[0]),
        "directions": numbers.rename(columns=lambda name: _with_unit(str(name))),
    }
    if any(bench.truth is not None for bench in benches):
        tables["truth"] = truth_table(numbers)
    matrices = force_transfer_matrices(benches[0])
    known = [*matrices.values(), *moment_transfer_matrices(benches[0]).values()]
    tables["force_transfer"] = force_transfer_table(known)
    summary = characterisation_summary(benches, numbers)
    if platform is not None and benches[0].result.campaign.pushes:
        vehicles = read_platform(platform)
        tables["moments"] = moment_cost_table(benches[0], vehicles)
        summary["moments_cost_at_peaks_db"] = float(tables["moments"][PEAKS].max())
        summary["moments_cost_rms_db"] = float(tables["moments"][RMS].max())
        inputs = (*inputs, *vehicles.input_files)
    if beside is not None:
        tables["all_gears"] = all_gears_table(numbers, beside)
    if models:
        tables["models"] = model_table(benches[0])
    figures = characterisation_figures(benches[0]) if with_figures else {}
    if with_figures and matrices:
        figures["cell_calibration"] = force_transfer_figure(matrices)
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=summary,
        page=characterisation_page(benches, tables, figures),
        inputs=inputs,
    )


def _with_unit(name: str) -> str:
    return name if name in ("bench", "direction") else f"{name} [1]"
