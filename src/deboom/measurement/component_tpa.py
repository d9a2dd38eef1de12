"""Component TPA: blocked forces of a source in situ, what they explain, and where they lead.

Blocked forces belong to the source alone. Found on any receiver from responses in operation, by the
functions of the assembly, they predict the sound at its ears, and on another receiver what source
and receiver make of them together. Three things are compared with measurements: sensors that were
left out (on-board validation), hits on the source whose load is known (completeness of the
interface), and the ears. What all sensors show beyond the loads is held against its noise: a rest
that is no noise denies every force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.component_test import (
    ComponentTest,
    InterfacePoint,
    ReceiverTest,
    SourceRun,
    functions_at_points,
    motions_at_points,
)
from deboom.measurement.electric_car import tangents
from deboom.measurement.interface_completeness import (
    MOST_ATTENUATED,
    Completeness,
    Rest,
    attenuation_of,
    coherence_of,
    completeness,
    function_variance,
    hit_forces,
    prediction_variance,
    rest_of,
    shrinking_noise,
)
from deboom.measurement.path_forces import (
    OnBoardValidation,
    PathForces,
    blocked_forces_in_situ,
    validate_on_board,
)
from deboom.measurement.quality import QualityCheck, quality_of_frf
from deboom.measurement.sensors import PlacementTolerances, Tolerances
from deboom.measurement.uncertainty import COVERAGE, Interval, complex_normals, pivotal_interval
from deboom.measurement.virtual_point import RIGID_MOTIONS, impact_geometry
from deboom.physics.force_inversion import CROSS_VALIDATED, Inversion, InvertedForces
from deboom.physics.frf import FrfForm
from deboom.physics.sound_level import REFERENCE_PRESSURE
from deboom.physics.substructuring import Component, Joint, couple
from deboom.physics.transfer_path import contributions, energy_share
from deboom.tabled import Tabled

DRAWS = 100
"""Repetitions of a measurement in thought behind every interval."""
INCOMPLETE = 0.95
"""Coherence of predicted and measured, median over the lines, below which the report warns [1]."""
LARGEST_FOREIGN = 0.1
"""Share of the energy at an ear that may come another way before the report warns [1]."""
UNEXPLAINED, MUCH_WORSE = 0.3, 5.0
"""Error at sensors left out, over their responses and over that under hits on the source, from
which functions and operation are not of one assembly [1]."""


def level_difference(predicted: ComplexArray, measured: ComplexArray, axis: int) -> RealArray:
    """Return the level of predicted over measured energies, summed over an axis [dB]."""
    energies = [np.sum(np.abs(values) ** 2, axis=axis) for values in (predicted, measured)]
    return np.asarray(10.0 * np.log10(energies[0] / energies[1]))


@checked(loads="d f p", sound="d f e", attenuation="f")
class Repeated:
    """A measurement repeated in thought, and what of it cannot be trusted.

    - `loads` (n_draw, n_frequency, n_load): blocked forces [N, N m].
    - `sound` (n_draw, n_frequency, n_ear): pressure that they predict [Pa].
    - `attenuation` (n_frequency,): by which share the noise of the functions shrinks the loads
      along the direction that the indicators see least [1].
    """

    loads: ComplexArray
    sound: ComplexArray
    attenuation: RealArray

    @property
    def resolved(self) -> BoolArray:
        """Lines whose noise hides no load, (n_frequency,): `MOST_ATTENUATED` is not exceeded."""
        return np.asarray(self.attenuation <= MOST_ATTENUATED)


@checked(by_line="f", on_board_coherence="c")
class RunTpa(Tabled):
    """Blocked forces of one run, and what they explain.

    - `blocked`: forces [N] and moments [N m] at the points, with the inversion of each line.
    - `repeated`: the same measurement again in thought, for intervals.
    - `on_board`: predicted and measured at the sensors left out; None without any.
    - `on_board_level`, `on_board_coherence` (n_channel,): level of predicted over measured over all
      lines [dB], and their coherence over the lines [1].
    - `by_line` (n_frequency,): coherence of predicted and measured over the sensors left out, or,
      without any, of the indicators [1].
    - `rest`: what the loads leave at all sensors.
    - `complete`: whether noise explains that, in the run and under hits on the source.
    - `transfer`: ears per load, assembly [Pa/N, Pa/(N m)].
    - `sound`, `measured_sound`: at the ears, of the blocked forces and as recorded [Pa].

    See Also
    --------
    deboom.measurement.component_tpa.ComponentTpa, deboom.component_tpa
    deboom.measurement.path_forces.PathForces
    """

    name: str
    order: float
    blocked: PathForces
    repeated: Repeated
    on_board: OnBoardValidation | None
    on_board_level: RealArray
    on_board_coherence: RealArray
    by_line: RealArray
    rest: Rest
    complete: bool
    transfer: Frf
    sound: Spectrum
    measured_sound: Spectrum

    @property
    def inversion(self) -> InvertedForces:
        """Regularisation, condition number and residual of each line."""
        assert self.blocked.inversion is not None
        return self.blocked.inversion

    @property
    def frequency(self) -> RealArray:
        """Lines [Hz]."""
        return self.blocked.force.frequency

    @property
    def explained(self) -> RealArray:
        """Share of the indicators' energy that the blocked forces explain, (n_frequency,) [1]."""
        return np.asarray(1.0 - self.inversion.residual**2)

    @property
    def resolved(self) -> BoolArray:
        """Lines whose noise hides no load, (n_frequency,)."""
        return self.repeated.resolved

    @property
    def trusted(self) -> BoolArray:
        """Lines whose intervals hold, (n_frequency,): resolved ones of a complete interface."""
        return np.asarray(self.resolved & self.complete)

    @property
    def table(self) -> pd.DataFrame:
        """Complex blocked forces over frequency."""
        return self.blocked.table

    def force_interval(self, coverage: float = COVERAGE) -> Interval:
        """Return the magnitude of every blocked force with its interval, (f, load) [N, N m]."""
        return _magnitude_interval(self.blocked.force.values, self.repeated.loads, coverage)

    def sound_interval(self, coverage: float = COVERAGE) -> Interval:
        """Return the magnitude of the predicted pressure with its interval, (f, ear) [Pa]."""
        return _magnitude_interval(self.sound.values, self.repeated.sound, coverage)

    def contributions(self, ear: str) -> ComplexArray:
        """Return what each load brings to the pressure at an ear, (n_frequency, n_load) [Pa]."""
        values = self.transfer.select(outputs=(ear,)).values[:, 0]
        return contributions(values, self.blocked.force.values)

    def ranking(self, ear: str) -> pd.DataFrame:
        """Rank points and loads by what they bring to the sound at an ear over all lines.

        Energy of the contribution as a level re 20 µPa (RMS); its share of the energy of the sum,
        with its phase, below 0 where it takes away from the others; and how the level of the sum
        changes without it.
        """
        return ranked(self.contributions(ear), self.blocked.force.channels)


def ranked(parts: ComplexArray, loads: Sequence[str]) -> pd.DataFrame:
    """Rank contributions (n_frequency, n_load) [Pa]; see `RunTpa.ranking`."""
    total = parts.sum(axis=1)
    points = [load.rpartition(" ")[0] for load in loads]
    groups = {point: [k for k, p in enumerate(points) if p == point] for point in points}
    groups |= {load: [k] for k, load in enumerate(loads)}
    rows = []
    for name, members in groups.items():
        part = parts[:, members].sum(axis=1)
        shares = energy_share(np.stack([part, total - part], axis=1))
        rows.append(
            {
                "contribution": name,
                "what": "load" if name in loads else "point",
                "level [dB]": energy_level(part),
                "share of the energy [1]": float(shares[0]),
                "without it, the level changes by [dB]": energy_level(total - part)
                - energy_level(total),
            }
        )
    table = pd.DataFrame(rows)
    return table.sort_values(["what", "level [dB]"], ascending=[False, False], ignore_index=True)


def energy_level(pressure: ComplexArray) -> float:
    """Return the level of the energy of all lines of a pressure [Pa], peak amplitudes [dB]."""
    energy = float(np.sum(np.abs(pressure) ** 2)) / 2.0
    return 10.0 * float(np.log10(max(energy, np.finfo(float).tiny) / REFERENCE_PRESSURE**2))


def _magnitude_interval(values: ComplexArray, draws: ComplexArray, coverage: float) -> Interval:
    """Interval of a magnitude: of its logarithm, so that both ends are positive."""
    logarithm = pivotal_interval(np.log(np.abs(values)), np.log(np.abs(draws)), coverage)
    lower, upper = np.exp(logarithm.lower), np.exp(logarithm.upper)
    return Interval(np.exp(logarithm.value), lower, upper, coverage)


@dataclass(frozen=True, eq=False)
class ComponentTpa:
    """What a test of component TPA shows.

    - `completeness`: None where nobody struck the source beside its interface.
    - `quality`: name of each point to the checks of its sensors and hits.
    - `doubts`: sentences on what a reader must know before trusting the numbers.

    See Also
    --------
    deboom.component_tpa, deboom.measurement.component_tpa.RunTpa, deboom.in_receiver
    """

    test: ComponentTest
    runs: tuple[RunTpa, ...]
    completeness: Completeness | None
    quality: Mapping[str, tuple[QualityCheck, ...]]
    doubts: tuple[str, ...]

    def run(self, name: str) -> RunTpa:
        """Return a run by its name; an unknown one raises InputError."""
        for run in self.runs:
            if run.name == name:
                return run
        raise InputError(f"no run '{name}', there are {[run.name for run in self.runs]}")


def component_tpa(
    test: ComponentTest, inversion: Inversion = CROSS_VALIDATED, *, seed: int = 1
) -> ComponentTpa:
    """Find the blocked forces of a source in situ, validate them, and rank what they bring.

    Parameters
    ----------
    test : ComponentTest
        Functions of the assembly and spectra in operation, see `read_component_test`.
    inversion : Inversion
        Regularisation; by default Tikhonov, its amount by cross-validation at each line.
    seed : int
        From 1; of the simulated repeats of the measurement that give the intervals.

    Returns
    -------
    ComponentTpa
        Per run blocked forces, (n_frequency, n_load) [N, N m], with intervals, on-board validation
        and ranked contributions; completeness of the interface; quality of the virtual points.

    Raises
    ------
    InputError
        Functions that explain hits on the source but not the operation, which are those of another
        assembly; loads that the indicators do not tell apart.

    See Also
    --------
    deboom.read_component_test, deboom.measurement.component_tpa.ComponentTpa, deboom.in_receiver
    deboom.blocked_forces_in_situ

    Notes
    -----
    ``f_bl = (Y_AB)⁺ a`` with the assembly's functions from virtual points to indicators (Moorhouse,
    Elliott and Evans, Journal of Sound and Vibration 325, 2009), ``p = Y_AB f_bl`` at the ears.
    Gain and place of an indicator are the same in functions and operation and cancel; so does the
    hammer's gain in the pressure, not in the forces. Intervals repeat the measurement to first
    order: noise of operation and of the hits' functions, place, direction and gain of the hammer;
    what regularisation holds back is repeated with them, and so is, in its mean, how the noise of
    the functions shrinks what is divided by them, ``(YᴴY)⁻¹ E(δYᴴ (I − YY⁺) δY) f``. They hold for
    a complete interface: what a missing point or moment does is in no interval. Where what the
    loads leave at the sensors is no noise (`Rest`), no line is trusted.

    Examples
    --------
    >>> import deboom
    >>> result = deboom.component_tpa(deboom.read_component_test("drive"))  # doctest: +SKIP
    >>> result.runs[0].blocked.force.units[2:4]  # doctest: +SKIP
    ('N', 'N m')
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    at_points = functions_at_points(test.accelerance, test.points)
    to_ears = functions_at_points(test.pressure, test.points)
    complete = completeness(test, inversion) if test.source_hits else None
    hits_are_explained = complete is None or complete.rest.is_noise
    runs = tuple(
        _run_tpa(
            test,
            run,
            at_points,
            to_ears,
            inversion,
            np.random.default_rng([seed, number]),
            hits_are_explained=hits_are_explained,
        )
        for number, run in enumerate(test.runs)
    )
    for run in runs:
        refuse_other_assembly(test, run, complete)
    return ComponentTpa(
        test=test,
        runs=runs,
        completeness=complete,
        quality={point.name: _quality(test, point) for point in test.points},
        doubts=tuple(_doubts(runs, complete)),
    )


def _run_tpa(
    test: ComponentTest,
    run: SourceRun,
    at_points: Frf,
    to_ears: Frf,
    inversion: Inversion,
    generator: np.random.Generator,
    *,
    hits_are_explained: bool,
) -> RunTpa:
    rows = test.lines_of(run)
    at_points, to_ears = at_lines(at_points, rows), at_lines(to_ears, rows)
    # the same lines but for the digits that a file keeps
    response = replace(run.acceleration, frequency=at_points.frequency)
    sound = replace(run.sound, frequency=at_points.frequency).select(test.ears)
    indicators = at_points.select(outputs=test.indicator_channels)
    blocked = blocked_forces_in_situ(indicators, response, inversion)
    force, channels = blocked.force, test.all_channels
    columns = [run.acceleration.channels.index(name) for name in channels]
    of_functions = _variance(test, test.accelerance, test.coherence, rows, channels)
    deviation = np.sqrt(
        run.acceleration_deviation[:, columns] ** 2
        + prediction_variance(test.points, of_functions, force.values)
    )
    n_indicator = len(indicators.outputs)
    repeated = _repeated(
        test,
        rows,
        indicators,
        to_ears,
        blocked,
        of_functions[:, :n_indicator],
        deviation[:, :n_indicator],
        generator,
    )
    rest = rest_of(
        at_points.select(outputs=channels).values,
        response.select(channels).values,
        deviation**2,
        repeated.resolved,
    )
    on_board = None
    level, coherence = np.zeros((2, 0))
    fitted = indicators @ force
    by_line = coherence_of(fitted.values, response.select(fitted.channels).values, 1)
    if test.on_board:
        left_out = at_points.select(outputs=test.on_board_channels)
        on_board = validate_on_board(left_out, blocked, response)
        predicted, measured = on_board.predicted.values, on_board.measured.values
        level = level_difference(predicted, measured, 0)
        coherence = coherence_of(predicted, measured, 0)
        by_line = coherence_of(predicted, measured, 1)
    return RunTpa(
        name=run.name,
        order=run.order,
        blocked=blocked,
        repeated=repeated,
        on_board=on_board,
        on_board_level=level,
        on_board_coherence=coherence,
        by_line=by_line,
        rest=rest,
        complete=hits_are_explained and rest.is_noise,
        transfer=to_ears,
        sound=to_ears @ force,
        measured_sound=sound,
    )


def at_lines(frf: Frf, rows: slice) -> Frf:
    """Return some neighbouring lines of functions."""
    return replace(frf, frequency=frf.frequency[rows], values=frf.values[rows])


def _repeated(
    test: ComponentTest,
    rows: slice,
    indicators: Frf,
    to_ears: Frf,
    blocked: PathForces,
    of_functions: RealArray,
    deviation: RealArray,
    generator: np.random.Generator,
) -> Repeated:
    """Repeat a measurement in thought.

    Loads are the inversion of repeated responses, and act where and as the hits truly did. The
    sound needs no place: the functions to the ears have the errors of the same hits.
    """
    inverted = blocked.inversion
    assert inverted is not None
    force, matrix = blocked.force.values, indicators.values
    explained = np.einsum("fcp,fp->fc", matrix, force)
    again = explained + deviation * complex_normals((DRAWS, *deviation.shape), generator)
    blocked_force = np.einsum("fpc,dfc->dfp", inverted.gain, again)
    # noise of the functions makes their matrix larger, and what is divided by it smaller
    normal = np.swapaxes(matrix.conj(), 1, 2) @ matrix
    of_noise = shrinking_noise(test.points, of_functions)
    try:
        shrunk = np.linalg.solve(normal, of_noise @ force[:, :, np.newaxis])[:, :, 0]
    except np.linalg.LinAlgError:
        raise InputError(
            f"{test.name}: the functions of the points are the same along two directions, so that "
            "no interval can be given: place the sensors of a point farther apart"
        ) from None
    blocked_force = blocked_force - shrunk
    heard = np.einsum("fei,dfi->dfe", to_ears.values, blocked_force + shrunk)
    per_hit = _variance(test, test.pressure, test.pressure_coherence, rows, to_ears.outputs)
    at_ears = np.sqrt(prediction_variance(test.points, per_hit, force))
    heard = heard + at_ears * complex_normals(heard.shape, generator)
    heard *= 1.0 + test.microphone * generator.standard_normal((DRAWS, 1, heard.shape[2]))
    at_hits = hit_forces(test.points, force)
    # the hammer's errors are the same at all lines
    factor = 1.0 + test.tolerances.hammer_gain * generator.standard_normal(DRAWS)
    moved = np.zeros_like(blocked_force)
    first = 0
    for point in test.points:
        n_load = len(point.motions)
        forces = np.stack([at_hits[name] for name in point.impact_names], axis=1)
        change = _misplaced(point, forces, test.tolerances, generator)
        moved[:, :, first : first + n_load] = change[:, :, :n_load]
        first += n_load
    return Repeated(
        np.asarray(factor[:, np.newaxis, np.newaxis] * (blocked_force + moved)),
        heard,
        attenuation_of(matrix, of_noise),
    )


def _variance(
    test: ComponentTest, functions: Frf, coherence: RealArray, rows: slice, outputs: Sequence[str]
) -> RealArray:
    """Mean square of the noise of functions to the hits of all points, (f, n_output, n_impact)."""
    hits = [name for point in test.points for name in point.impact_names]
    part = at_lines(functions, rows)
    return function_variance(part, coherence[rows], test.n_averages, outputs, hits)


def _misplaced(
    point: InterfacePoint,
    forces: ComplexArray,
    tolerances: PlacementTolerances,
    generator: np.random.Generator,
) -> ComplexArray:
    """Change of six loads where the hits of a point fell beside their places and leant, (d, f, 6).

    A hit that lies δr off gives the moment ``δr × d`` besides; one that leans by δd gives ``δd``
    and ``r × δd``.
    """
    geometry = impact_geometry(point.impacts, point.position)
    change = np.zeros((DRAWS, len(point.impacts), 6))
    for across in tangents(geometry.directions):
        shape = (DRAWS, len(point.impacts), 1)
        off = tolerances.impact_position * generator.standard_normal(shape)
        lean = tolerances.impact_angle * generator.standard_normal(shape)
        change[..., 3:] += off * np.cross(across, geometry.directions)
        change[..., :3] += lean * across
        change[..., 3:] += lean * np.cross(geometry.levers, across)
    return np.asarray(np.einsum("fi,dia->dfa", forces, change))


def refuse_other_assembly(test: ComponentTest, run: RunTpa, complete: Completeness | None) -> None:
    """Refuse functions of another assembly than the one that ran.

    At sensors left out they reproduce hits on the source, which were struck with them, and not the
    operation. Raises InputError: so it is.
    """
    if complete is None or run.on_board is None:
        return
    of_hits, of_run = (
        float(np.median(error)) for error in (complete.error, run.on_board.error_by_line)
    )
    if complete.median >= INCOMPLETE and of_run > max(UNEXPLAINED, MUCH_WORSE * of_hits):
        raise InputError(
            f"{test.name}: at sensors left out, loads at the interface miss hits on the source by "
            f"{100 * of_hits:.0f} %, but run {run.name} by {100 * of_run:.0f} %: the functions are "
            "those of another assembly than the one that ran, or something else than the source "
            "moves these sensors; strike and run the same assembly, with the sensors where they "
            "were"
        )


def _quality(test: ComponentTest, point: InterfacePoint) -> tuple[QualityCheck, ...]:
    """Check a point's sensors and hits; nothing where they determine no six motions."""
    if not point.determined:
        return ()
    stated = test.tolerances
    tolerances = Tolerances(
        sensor_position=max(stated.sensor_position, stated.impact_position),
        sensor_angle=max(stated.sensor_angle, stated.impact_angle),
        sensor_gain=max(stated.sensor_gain, stated.hammer_gain),
    )
    whole = replace(point, motions=RIGID_MOTIONS)
    return quality_of_frf(
        whole.seen(), whole.struck(), test.accelerance, FrfForm.INERTANCE, tolerances=tolerances
    )


def incompleteness(runs: Sequence[RunTpa], complete: Completeness | None) -> list[str]:
    """Say where more than noise is left of the sensors' response, and that no force holds then."""
    if complete is not None and not complete.rest.is_noise:
        of_runs = max(run.rest.chi_squared for run in runs)
        return [
            "The interface is incomplete: what loads at the stated points leave of the response to "
            f"hits on the source is {complete.rest.chi_squared:.1f} times the noise that "
            f"coherences state (χ² per degree of freedom, 1 is complete, {complete.rest.limit:.1f} "
            f"is the limit; {of_runs:.1f} in the runs; completeness {complete.median:.3f}). A "
            "point, such as a hose or cable, or a moment is missing, or the noise is larger than "
            "stated. No blocked force and no interval is to be trusted, nor the sound on another "
            "receiver; the sound at the ears here hardly suffers."
        ]
    return [
        f"Run {run.name}: what the loads leave of the response is {run.rest.chi_squared:.1f} times "
        f"the stated noise (χ² per degree of freedom, {run.rest.limit:.1f} is the limit)"
        + (", though it is noise under hits on the source" if complete is not None else "")
        + ": something else than the source moves the sensors, one of them has changed since the "
        "hits, a point or a moment is missing, or the spectra are noisier than stated. No blocked "
        "force of this run and no interval is to be trusted."
        for run in runs
        if not run.complete
    ]


def _doubts(runs: Sequence[RunTpa], complete: Completeness | None) -> list[str]:
    """Say what a reader must know before trusting the numbers."""
    doubts = incompleteness(runs, complete)
    if complete is None:
        doubts.append(
            "Whether the interface is complete is not known: nobody struck the source beside it."
        )
    for run in runs:
        if not run.resolved.any():
            doubts.append(
                f"Run {run.name}: on every line the noise of the functions hides a load, so that "
                "no interval holds and nothing says whether the interface is complete."
            )
        if run.on_board is None:
            doubts.append(
                f"Run {run.name}: no sensor was left out of the inversion, so that nothing "
                "validates its forces."
            )
        elif (middle := float(np.median(run.by_line))) < INCOMPLETE:
            doubts.append(
                f"Run {run.name}: at sensors left out, predicted and measured have a coherence of "
                f"{middle:.2f} (median over the lines, {INCOMPLETE:g} is asked)."
            )
        for column, ear in enumerate(run.sound.channels):
            both = run.sound.values[:, column], run.measured_sound.values[:, column]
            lacking = both[1] - both[0]
            share = float(np.sum(np.abs(lacking) ** 2) / np.sum(np.abs(both[1]) ** 2))
            if share > LARGEST_FOREIGN:
                doubts.append(
                    f"Run {run.name}: {100 * share:.0f} % of the energy at {ear} is not that of "
                    "the blocked forces: it came through the air, by a path that was not measured, "
                    "or is noise."
                )
    return doubts


@checked(draws="d f e")
class InReceiver:
    """A source in another receiver: what its blocked forces bring to the ears there.

    - `transfer`: ears per blocked force, source and receiver joined [Pa/N, Pa/(N m)].
    - `sound`: predicted [Pa]; `draws` (n_draw, n_frequency, n_ear): by the repeated forces; errors
      of the functions of receiver and free source are in no interval.
    - `measured`: with the source in place; None where nobody listened [Pa].

    See Also
    --------
    deboom.in_receiver, deboom.measurement.component_tpa.ComponentTpa
    """

    run: str
    receiver: str
    loads: Spectrum
    transfer: Frf
    sound: Spectrum
    draws: ComplexArray
    measured: Spectrum | None

    def sound_interval(self, coverage: float = COVERAGE) -> Interval:
        """Return the magnitude of the predicted pressure with its interval, (f, ear) [Pa]."""
        return _magnitude_interval(self.sound.values, self.draws, coverage)

    def ranking(self, ear: str) -> pd.DataFrame:
        """Rank points and loads, see `RunTpa.ranking`."""
        values = self.transfer.select(outputs=(ear,)).values[:, 0]
        return ranked(contributions(values, self.loads.values), self.loads.channels)


def in_receiver(result: ComponentTpa, receiver: ReceiverTest) -> tuple[InReceiver, ...]:
    """Predict the sound of a source in another receiver, run by run.

    Parameters
    ----------
    result : ComponentTpa
        Of a test in which the source was measured on its own, hung up freely.
    receiver : ReceiverTest
        Functions of the other receiver without the source, and the mounts between, see
        `read_receiver`.

    Returns
    -------
    tuple of InReceiver
        Pressure at its ears, (n_frequency, n_ear) [Pa], with what each load brings.

    Raises
    ------
    InputError
        A source whose free functions were not measured; a receiver that lacks a point of the source
        or has others, or whose point has fewer degrees of freedom; unlike lines.

    See Also
    --------
    deboom.component_tpa, deboom.read_receiver, deboom.measurement.component_tpa.InReceiver
    deboom.physics.substructuring.couple

    Notes
    -----
    Frequency-based substructuring in its dual form (`deboom.physics.substructuring.couple`): free
    source and receiver are joined at the points, rigidly or by the compliance of mounts, and
    ``p = Y_joined f_bl``. Directions that a mount does not have, such as rotations of a 3 × 3
    stiffness, are not joined. Free functions below the modes of the cords are needed to be those of
    a free body.

    Examples
    --------
    >>> import deboom, tempfile
    >>> folder = f"{tempfile.mkdtemp()}/drive"
    >>> plan = deboom.bench.ComponentPlan(points=1, line_step=4.0)
    >>> path = deboom.bench.write_component_test(folder, plan=plan)
    >>> result = deboom.component_tpa(deboom.read_component_test(path))
    >>> moved = deboom.in_receiver(result, deboom.read_receiver(path / "receiver"))
    >>> moved[0].sound.channels
    ('driver ear', 'passenger ear')
    """
    transfer = _joined(result.test, receiver)
    return tuple(_moved(run, result.test, receiver, transfer) for run in result.runs)


def _joined(test: ComponentTest, receiver: ReceiverTest) -> Frf:
    """Ears of a receiver per blocked force of the source on it, on the lines of its functions."""
    if test.free is None:
        raise InputError(
            f"{test.name}: on another receiver the source answers as it does on its own: measure "
            "it hung up freely, and name the file as free_accelerance"
        )
    theirs = {point.name: point for point in receiver.points}
    missing = [point.name for point in test.points if point.name not in theirs]
    if missing or len(theirs) != len(test.points):
        raise InputError(
            f"{receiver.name}: it has the points {', '.join(theirs)}, the source has "
            f"{', '.join(point.name for point in test.points)}: these are functions of another "
            "assembly; name the same points in both"
        )
    points = [theirs[point.name] for point in test.points]
    lines = test.free.frequency
    if not np.array_equal(lines, receiver.accelerance.frequency):
        other = receiver.accelerance.frequency
        raise InputError(
            f"{receiver.name}: it has unlike lines, {other.size} from {other[0]:g} to "
            f"{other[-1]:g} Hz, the source {lines.size} from {lines[0]:g} to {lines[-1]:g} Hz: "
            "measure both on the same, nothing is interpolated"
        )
    per_acceleration = -1.0 / (2 * np.pi * lines)[:, np.newaxis, np.newaxis] ** 2
    source = motions_at_points(functions_at_points(test.free, test.points), test.points)
    body = motions_at_points(functions_at_points(receiver.accelerance, points), points)
    ears = functions_at_points(receiver.pressure, points)
    loads = source.inputs
    above = tuple(f"source {motion}" for motion in source.outputs)
    below = tuple(f"body {motion}" for motion in body.outputs)
    bodies = [
        Component(above, above, per_acceleration * source.values),
        Component(
            (*below, *ears.outputs),
            below,
            np.concatenate([per_acceleration * body.values, ears.values], axis=1),
        ),
    ]
    joints = [
        _joint(mine, other, receiver) for mine, other in zip(test.points, points, strict=True)
    ]
    whole = couple(bodies, joints)
    rows = [whole.outputs.index(ear) for ear in ears.outputs]
    columns = [whole.inputs.index(name) for name in above]
    return replace(ears, values=whole.receptance[:, rows][:, :, columns], inputs=loads)


def _joint(mine: InterfacePoint, other: InterfacePoint, receiver: ReceiverTest) -> Joint:
    stiffness = receiver.joints[other.name].stiffness
    n_joined = len(mine.motions) if stiffness is None else stiffness.shape[1]
    if min(len(mine.motions), len(other.motions)) < n_joined:
        raise InputError(
            f"{receiver.name}: point {other.name} is joined along {n_joined} degrees of freedom, "
            f"but the source has {len(mine.motions)} and the receiver {len(other.motions)}: "
            "measure as many on both"
        )
    first, second = (
        tuple(f"{side} {name}" for name in point.motion_names[:n_joined])
        for side, point in (("source", mine), ("body", other))
    )
    compliance = None if stiffness is None else np.asarray(np.linalg.inv(stiffness), complex)
    return Joint(first, second, compliance=compliance)


def _moved(run: RunTpa, test: ComponentTest, receiver: ReceiverTest, transfer: Frf) -> InReceiver:
    begin = int(np.searchsorted(transfer.frequency, run.frequency[0]))
    part = at_lines(transfer, slice(begin, begin + run.frequency.size))
    if not np.array_equal(part.frequency, run.frequency):
        raise InputError(
            f"{test.name}: run {run.name} and the free source have unlike lines: measure both on "
            "the same, nothing is interpolated"
        )
    return InReceiver(
        run=run.name,
        receiver=receiver.name,
        loads=run.blocked.force,
        transfer=part,
        sound=part @ run.blocked.force,
        draws=np.einsum("fei,dfi->dfe", part.values, run.repeated.loads),
        measured=receiver.measured.get(run.name),
    )
