"""Unbalance and gas forces of a running compressor from its sweeps, by every route."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial

import numpy as np
import pandas as pd

from deboom.arrays import PERCENT, ComplexArray, RealArray, checked
from deboom.compressor.hammer_identification import calibration_of
from deboom.compressor.hose_presence import hoses_in_sweep
from deboom.compressor.identified_compressor import ALARM, HosePresence, Identification
from deboom.compressor.model import CompressorModel, ModalTable
from deboom.compressor.mount_shares import (
    HyperbolicMounts,
    SofteningMounts,
    changes_of_single_mounts,
    softening_mounts,
)
from deboom.compressor.operating_fit import (
    MountState,
    SenseOfRotation,
    SourceFit,
    fit_source,
    mount_state,
    sense_of_rotation,
)
from deboom.compressor.routes import (
    CALIBRATED_MEASUREMENT,
    CALIBRATED_MODEL,
    MEASURED,
    ONE_FACTOR,
    POINT_MODEL,
    STATED_AT,
    UPDATED,
    FactorOverFrequency,
    MountsApart,
    OperatingLoad,
    OperatingMotion,
    Route,
    RouteModel,
    operating_load,
    operating_motion,
)
from deboom.compressor.sources import (
    LoadUncertainty,
    ResidualBand,
    Sources,
    UnbalanceCurve,
    sources,
    unbalance_curve,
    unexplained_lines,
)
from deboom.compressor.unbalance_load import RotationSense
from deboom.errors import InputError
from deboom.measurement.compressor_test import HoseState, OperatingSweep, OperatingTest
from deboom.tabled import Tabled

AGREEMENT_ABOVE = 50.0
"""Where the agreement of y and z is judged: above the rigid-body modes [Hz]."""
BEYOND_MODES = 1.5
"""Times the highest rigid-body mode: from there on the body's inertia carries the load [1]."""
SMALLEST_LINES = 8
HOSES_ABOVE = 60.0
"""Hoses have their bending modes above [Hz]."""
VISIBLE_SHARE = 0.02
"""Of the load from which a rest is that of hoses [1]."""

Step = Callable[[str], None]


class SofteningLaw(Enum):
    """How a compressor's mount softens with its own stroke s."""

    PARABOLA = "parabola"
    """δ = a + b lg s + c lg² s with complex numbers."""
    HYPERBOLA = "hyperbola"
    """v_s∞ + 1/(m_s s + s_0) for real and imaginary part (thesis, eq. 54 and 55)."""


@checked(confidence=">0 <1")
class UnbalanceOptions:
    """How the load inside is found.

    - `routes`: routes that are compared.
    - `chosen`: the one that results are taken from; computed besides `routes`, if it must be.
    - `hoses`: sweeps to be used; by default those with soft hoses, or, where there are none, the
      others.
    - `expected_sense`: sense of rotation on the data sheet.
    - `band` (float, float): lines of the global fit [Hz].
    - `confidence`: confidence of all bands and intervals [1].
    - `softening`: law of mounts that soften with their own stroke, where one factor does not do.
    - raises InputError: a confidence outside 0 to 1.
    """

    routes: tuple[Route, ...] = (
        MEASURED,
        POINT_MODEL,
        CALIBRATED_MODEL,
        CALIBRATED_MEASUREMENT,
        UPDATED,
    )
    chosen: Route = CALIBRATED_MEASUREMENT
    hoses: HoseState | None = None
    expected_sense: RotationSense | None = None
    band: tuple[float, float] = (17.0, 150.0)
    confidence: float = 0.95
    softening: SofteningLaw = SofteningLaw.PARABOLA


@dataclass(frozen=True, eq=False)
class SweepUnbalance:
    """Unbalance line by line, for one sweep and one route.

    `frequency` (n_frequency,): frequency of the rotation [Hz]; `load` (n_frequency, 6): at the
    virtual point, complex peak [N, N m]; `load_lower`, `load_upper` (n_frequency, 6): band of its
    amplitudes [N, N m].
    """

    sweep: str
    pressure: float
    hoses: HoseState
    frequency: RealArray
    load: ComplexArray
    load_lower: RealArray
    load_upper: RealArray
    static: UnbalanceCurve
    dynamic: UnbalanceCurve

    @property
    def speed(self) -> RealArray:
        """Speed of the rotation, shape (n_frequency,) [1/min]."""
        return np.asarray(60.0 * self.frequency)


@dataclass(frozen=True, eq=False)
class RouteResult:
    """All that one route says."""

    route: Route
    sweeps: tuple[SweepUnbalance, ...]
    sources: Sources
    fit: SourceFit


@dataclass(frozen=True, eq=False)
class Unbalance(Tabled):
    """Everything that sweeps and hammer test say of the rotor, the gas and the mounts.

    `alarms`: reasons not to trust the results, in words; empty where there are none; `notices`:
    what was decided on the way; `hoses`: search for the drawn hoses in sweeps that are said to be
    without them.

    See Also
    --------
    deboom.unbalance, deboom.compressor.identified_compressor.Identification
    deboom.running_in_car
    """

    test: OperatingTest
    identification: Identification
    options: UnbalanceOptions
    motions: tuple[OperatingMotion, ...]
    sense: SenseOfRotation
    routes: tuple[RouteResult, ...]
    state: MountState
    alarms: tuple[str, ...]
    notices: tuple[str, ...]
    hoses: tuple[HosePresence, ...] = ()

    @property
    def chosen(self) -> RouteResult:
        """Result of the chosen route."""
        return self.by_letter(self.options.chosen.letter)

    @property
    def table(self) -> pd.DataFrame:
        """Amplitudes of the chosen route's unbalances and gas forces, with their intervals."""
        rows = {
            name: (
                estimate.unit,
                abs(estimate.value),
                estimate.lower,
                estimate.upper,
                estimate.deviation,
                float(np.degrees(np.angle(estimate.value))),
            )
            for name, estimate in self.chosen.sources.estimates.items()
        }
        columns = ["unit", "amplitude", "from", "to", "standard deviation", "phase [°]"]
        table = pd.DataFrame.from_dict(rows, orient="index", columns=columns)
        return table.rename_axis("source").reset_index()

    @property
    def model(self) -> CompressorModel:
        """The compressor of the hammer test, with how its mounts soften where a hyperbola says it.

        The hyperbola is that of the chosen route, or else of another one that has fitted one.
        """
        struck = self.identification.calibrated.model
        for result in (self.chosen, *self.routes):
            fit, law = result.fit, result.fit.change
            if isinstance(law, HyperbolicMounts):
                return replace(struck, mounts=law.over_stroke(fit.line_values[fit.change_slice]))
        return struck

    @property
    def used(self) -> tuple[OperatingSweep, ...]:
        """Sweeps that were used."""
        names = {sweep.sweep for sweep in self.chosen.sweeps}
        return tuple(sweep for sweep in self.test.sweeps if sweep.name in names)

    @property
    def hose_alarms(self) -> tuple[str, ...]:
        """Hoses that show in the sweeps whatever their label says, in words; empty without."""
        shown = tuple(hose.statement for hose in self.hoses if hose.visible)
        return shown or hose_alarms(self.used, self.chosen.sources.residual_bands)

    @property
    def hoses_seen(self) -> bool:
        """Whether the sweeps in use had the vehicle's hoses, by their label or by their loads."""
        joined = any(sweep.hoses is HoseState.STANDARD for sweep in self.used)
        return joined or bool(self.hose_alarms)

    @property
    def mismatch_above(self) -> float:
        """Static unbalance from y against that from z, rms above `AGREEMENT_ABOVE` [1]."""
        above = np.concatenate(
            [
                sweep.static.mismatch[sweep.frequency > AGREEMENT_ABOVE]
                for sweep in self.chosen.sweeps
            ]
        )
        return float(np.sqrt(np.mean(above**2)))

    @property
    def agreement(self) -> str:
        """How well y and z agree, and what that proves, in words."""
        result = self.chosen
        gas = result.sources.gas[0].rotating
        lowest = min(float(sweep.frequency[0]) for sweep in result.sweeps)
        share = abs(gas.value) / (abs(result.sources.static.value) * (2 * np.pi * lowest) ** 2)
        return (
            "Static unbalance from y and from z agree to "
            f"{PERCENT * self.mismatch_above:.1f} % above {AGREEMENT_ABOVE:g} Hz. That is "
            f"no proof: the rotating gas force of {abs(gas.value):.3f} ± {gas.deviation:.3f} N "
            f"passes the same check and makes up {PERCENT * share:.0f} % of the unbalance at "
            f"{lowest:g} Hz; only that it does not grow with the square of the speed tells it "
            "apart."
        )

    def by_letter(self, letter: str) -> RouteResult:
        """Return the result of the route of this letter.

        InputError: no such route.
        """
        for result in self.routes:
            if result.route.letter == letter:
                return result
        letters = ", ".join(result.route.letter for result in self.routes)
        raise InputError(f"there is no route {letter}, only {letters}")


def unbalance(
    test: OperatingTest,
    identification: Identification,
    options: UnbalanceOptions | None = None,
    step: Step | None = None,
) -> Unbalance:
    """Find unbalance and internal forces of a running compressor.

    Parameters
    ----------
    test : OperatingTest
        Sweeps of the running compressor.
    identification : Identification
        Identification of its hammer test without hoses.
    options : UnbalanceOptions, optional
        Routes and bands.
    step : callable of str, optional
        Receiver of progress messages.

    Returns
    -------
    Unbalance
        Static [kg m] and dynamic [kg m²] unbalance and gas loads with intervals by each route;
        ``alarms``; ``table``.

    Raises
    ------
    InputError
        An identification of other sensors; no sweep with these hoses; a sweep outside of the hammer
        test or one that never leaves the resonances; sweeps that turn against each other or against
        the data sheet, or show no sense of rotation.

    See Also
    --------
    deboom.identify, deboom.read_operating_test, deboom.compressor.unbalance.Unbalance
    deboom.running_in_car

    Notes
    -----
    Thesis, 4.2 and 4.4.1 (figures 52, 61 and 62), with the routes that the thesis lacks. Sweeps
    share the unbalance and the mounts; each pressure has its own gas.

    A route with update whose common factor leaves more than noise below 60 Hz tries mounts that
    soften with their own stroke (`SofteningMounts`, or `HyperbolicMounts`, thesis, eq. 54 and 55;
    needs a drawing of the mounts) and keeps them where Schwarz's criterion prefers them. So does
    the chosen route mounts that changed apart from each other (`MountsApart`), and all routes then
    take them.

    Examples
    --------
    >>> import deboom
    >>> test = deboom.read_operating_test("running")  # doctest: +SKIP
    >>> deboom.unbalance(test, deboom.identify(test.hammer)).table  # doctest: +SKIP
    """
    options = options or UnbalanceOptions()
    say = step or (lambda _: None)
    if identification.test.frf.outputs != test.hammer.frf.outputs:
        raise InputError(f"{test.name}: the identification is of other sensors than the sweeps")
    used, notices = sweeps_of(test, options.hoses)
    used, trimmed = within_hammer_test(used, identification.raw.frf.frequency)
    notices += trimmed
    refuse_resonant_sweep(used, identification.modes)
    say("motion at the virtual point")
    motions = tuple(
        operating_motion(sweep, identification.response, identification.calibrated.response_matrix)
        for sweep in used
    )
    say("calibration")
    calibration = calibration_of(identification)
    if calibration is not identification.calibrated:
        notices.append(
            "The foundation is not rigid: sensors and impacts are calibrated by the mass line "
            f"alone, which has a reduced χ of {calibration.reduced_chi:.2f}."
        )
    frequency = np.unique(np.concatenate([sweep.frequency for sweep in used]))
    say("sense of rotation")
    chosen = options.chosen.model(identification, calibration, frequency)
    sense = sense_of_rotation(
        chosen, [operating_load(chosen, sweep) for sweep in used], options.expected_sense
    )
    results, state_law, are_apart = [], FactorOverFrequency(), False
    for route in dict.fromkeys((options.chosen, *options.routes)):
        say(f"route {route.letter}: {route.title}")
        model = route.model(identification, calibration, frequency)
        model = model.with_rotor(test.rotor_inertia, sense.sense)
        loads = [operating_load(model, sweep) for sweep in used]
        solve = partial(fit_source, model, loads, sense.sense, band=options.band)
        factor = solve(route.update or state_law)
        fit, words = factor, ""
        if route.update is not None and factor.mismatch > 0:
            say(f"route {route.letter}: mounts that soften with their own stroke")
            laws = _softening_laws(identification, options.softening)
            fit, words = _softened(route, factor, loads, laws, solve)
        if are_apart or (route == options.chosen and factor.mismatch > 0):
            say(f"route {route.letter}: mounts that changed apart from each other")
            apart = solve(MountsApart())
            explains = apart.converged and apart.reduced_chi <= ALARM
            better = explains and apart.schwarz < fit.schwarz
            # errors of another route may feign what the chosen one shows of the mounts
            if better or (are_apart and fit is factor):
                fit, words = apart, ""
            are_apart |= better and route == options.chosen
        notices += [words] if words else []
        by_line = tuple(
            _line_by_line(model, load, sweep, fit, white, route, options)
            for load, sweep, white in zip(loads, used, fit.whitened, strict=True)
        )
        of_route = sources(fit, loads, identification.length, options.confidence)
        results.append(RouteResult(route, by_line, of_route, fit))
        if route == options.chosen:
            common = solve(ONE_FACTOR)
            resolved = factor if factor.change == state_law else solve(state_law)
    state = mount_state(
        common, resolved, state_law, identification.calibrated.model.gain, frequency
    )
    result = results[0]
    if are_apart:
        state = _apart_state(state, identification, chosen.mounts, result.fit)
    if options.chosen in options.routes:
        results.sort(key=lambda each: options.routes.index(each.route))
    hoses = _hoses(test, used, identification, sense)
    return Unbalance(
        test,
        identification,
        options,
        motions,
        sense,
        tuple(results),
        state,
        _alarms(identification, used, hoses, results, result, state),
        tuple(notices),
        hoses,
    )


def _hoses(
    test: OperatingTest,
    used: Sequence[OperatingSweep],
    identification: Identification,
    sense: SenseOfRotation,
) -> tuple[HosePresence, ...]:
    """Look for the hoses of the drawing in each sweep that should be free of them."""
    sought = [
        hoses_in_sweep(
            sweep, test.hoses, identification, rotor_inertia=test.rotor_inertia, sense=sense.sense
        )
        for sweep in used
        if test.hoses and sweep.hoses is not HoseState.STANDARD
    ]
    return tuple(presence for presence in sought if presence is not None)


def _alarms(
    identification: Identification,
    used: Sequence[OperatingSweep],
    hoses: Sequence[HosePresence],
    results: Sequence[RouteResult],
    chosen: RouteResult,
    state: MountState,
) -> tuple[str, ...]:
    """Return alarms of the hammer test, of visible hoses or else of the load, and of the fits."""
    alarms = [*identification.alarms]
    visible = [hose.statement for hose in hoses if hose.visible]
    alarms += visible or load_alarms(used, chosen.sources, chosen.fit.mismatch, state)
    unsettled = [result.route.letter for result in results if not result.fit.converged]
    if unsettled:
        alarms.append(
            f"The fit over all sweeps did not settle by route {', '.join(unsettled)}: its numbers "
            "and intervals are not to be trusted."
        )
    return tuple(alarms)


SOFTENING_SCALES = (10e-6, 20e-6, 40e-6, 80e-6, 160e-6)
"""Strokes among which that of a hyperbola is looked for [m]."""


SEEN_APART = 0.02
"""Change of a mount from which a report speaks of mounts that changed one by one [1]: in a car the
motion of the body, which is taken off, leaves a tenth of it."""


def _apart_state(
    state: MountState, identification: Identification, mounts: ComplexArray, fit: SourceFit
) -> MountState:
    """Say which mounts have changed; `mounts`: their part in the fit's apparent mass."""
    law, where = fit.change, fit.change_slice
    assert isinstance(law, MountsApart)
    values, covariance = fit.line_values[where], fit.line_covariance[where, where]
    drawn, parts = identification.test.drawing, softening_mounts(identification)
    single: dict[str, float] = {}
    if drawn is None or parts is None:
        change = np.tensordot(values, law.change_at(STATED_AT), axes=1).real
        along = np.linalg.eigvalsh((change + change.T) / 2)
        size = float(np.sqrt(np.mean(along**2)))
        words = (
            f"by {along[0]:+.0%} to {along[-1]:+.0%} along the directions of the body; a drawing "
            "of the mounts would tell which of them"
        )
    else:
        gain = complex(identification.calibrated.model.gain.at(np.array([STATED_AT]))[0])
        changes = changes_of_single_mounts(parts, mounts, law, values, covariance, gain)
        single = {
            mount.name: float(change) for mount, change in zip(drawn.mounts, changes, strict=True)
        }
        size = float(np.abs(changes).max())
        words = ", ".join(f"{name} {change:+.0%}" for name, change in single.items())
    if size < SEEN_APART:
        return state
    statement = (
        "The mounts in operation are not those that were struck, and have changed apart from each "
        f"other: {words} (real part at {STATED_AT:g} Hz). The numbers of all speeds together allow "
        "for it; below 50 Hz only a route that updates the mounts can be trusted line by line."
    )
    return replace(state, changed=True, statement=statement, single=single)


def _softening_laws(
    identification: Identification, law: SofteningLaw
) -> tuple[SofteningMounts, ...]:
    """Return mounts of the drawing that soften, one for each scale of a hyperbola."""
    mounts = softening_mounts(identification)
    if mounts is None:
        return ()
    if law is SofteningLaw.PARABOLA:
        return (mounts,)
    return tuple(
        HyperbolicMounts(mounts.positions, mounts.stiffness, scale) for scale in SOFTENING_SCALES
    )


def _softened(
    route: Route,
    factor: SourceFit,
    loads: Sequence[OperatingLoad],
    laws: Sequence[SofteningMounts],
    solve: Callable[[SofteningMounts], SourceFit],
) -> tuple[SourceFit, str]:
    """Return the fit with softening mounts and words on it if it is the better one by Schwarz.

    `factor`: the fit with one factor for all mounts, which is returned otherwise.
    """
    if laws:
        tried = [(solve(law), law) for law in laws]
        softened, mounts = min(tried, key=lambda fit_and_law: fit_and_law[0].schwarz)
        if softened.converged and softened.schwarz < factor.schwarz:
            return softened, _softening_notice(route, mounts, softened, factor, loads)
    return factor, ""


SEEN_SOFTENING = 0.01
"""Change of the stiffness over the strokes from which a report speaks of softening mounts [1]."""


def _softening_notice(
    route: Route,
    mounts: SofteningMounts,
    fit: SourceFit,
    factor: SourceFit,
    loads: Sequence[OperatingLoad],
) -> str:
    """Say that mounts which soften explain the sweeps better, and by how much; empty if hardly."""
    strokes = np.concatenate([mounts.strokes(load.frequency, load.motion) for load in loads])
    ends = np.array([strokes.min(), strokes.max()])
    small, large = np.abs(1 + mounts.change_at(fit.line_values[fit.change_slice], ends))
    if abs(large / small - 1) < SEEN_SOFTENING:
        return ""
    return (
        f"Route {route.letter}: mounts that soften with their own stroke explain the sweeps better "
        f"than one factor for all of them (reduced χ {fit.reduced_chi:.1f} instead of "
        f"{factor.reduced_chi:.1f}). From {1e6 * ends[0]:.0f} to {1e6 * ends[1]:.0f} µm their "
        f"dynamic stiffness changes by {large / small - 1:+.0%}."
    )


def _line_by_line(
    model: RouteModel,
    load: OperatingLoad,
    sweep: OperatingSweep,
    fit: SourceFit,
    whitened: ComplexArray,
    route: Route,
    options: UnbalanceOptions,
) -> SweepUnbalance:
    """Read both unbalances off the load at each line, in y and in z."""
    errors = LoadUncertainty(
        model, load, fit, updated=route.update is not None, confidence=options.confidence
    )
    square = (2 * np.pi * load.frequency) ** 2
    turn = 1j * fit.sense.value
    entry = np.eye(6) / square[:, np.newaxis, np.newaxis]
    curve = partial(
        unbalance_curve,
        errors,
        load.frequency,
        unexplained=unexplained_lines(whitened),
    )
    ones = np.ones((load.frequency.size, 1))
    bands = [errors.band(ones * np.eye(6)[axis]) for axis in range(6)]
    return SweepUnbalance(
        sweep.name,
        sweep.pressure,
        sweep.hoses,
        load.frequency,
        errors.load,
        np.stack([band.lower for band in bands], axis=1),
        np.stack([band.upper for band in bands], axis=1),
        curve(entry[:, 1], np.asarray(turn * entry[:, 2])),
        curve(np.asarray(-turn * entry[:, 4]), entry[:, 5]),
    )


def sweeps_of(
    test: OperatingTest, hoses: HoseState | None
) -> tuple[tuple[OperatingSweep, ...], list[str]]:
    """Choose the sweeps that show the load best, with notices.

    InputError: no sweep with the hoses that are wanted.
    """
    if hoses is not None:
        sweeps = test.with_hoses(hoses)
        if not sweeps:
            raise InputError(f"{test.name}: there is no sweep with {hoses.value} hoses")
        return sweeps, []
    for state in (HoseState.ABSENT, HoseState.SOFT):
        if test.with_hoses(state):
            return test.with_hoses(state), []
    return test.with_hoses(HoseState.STANDARD), [
        "There is no sweep with soft hoses: what the standard hoses do to the compressor is part "
        "of the loads."
    ]


def within_hammer_test(
    sweeps: Sequence[OperatingSweep], hammer: RealArray
) -> tuple[tuple[OperatingSweep, ...], list[str]]:
    """Leave out lines that the hammer test did not measure, with notices of what was left out.

    `hammer` (n,): lines of the hammer test [Hz]. InputError: a sweep that the hammer test hardly
    covers.
    """
    kept, notices = [], []
    for sweep in sweeps:
        inside = (sweep.frequency >= hammer[0]) & (sweep.frequency <= hammer[-1])
        if np.count_nonzero(inside) < SMALLEST_LINES:
            raise InputError(
                f"sweep {sweep.name} has {np.count_nonzero(inside)} lines within the hammer test's "
                f"{hammer[0]:g} to {hammer[-1]:g} Hz, at least {SMALLEST_LINES} are needed: strike "
                "and run over the same range, in steps of 1 Hz or so"
            )
        if not inside.all():
            notices.append(
                f"Sweep {sweep.name}: {np.count_nonzero(~inside)} lines outside of the hammer "
                f"test's {hammer[0]:g} to {hammer[-1]:g} Hz are left out."
            )
            parts = {
                name: replace(part, frequency=part.frequency[inside], values=part.values[inside])
                for name in ("acceleration", "holder", "sound")
                if (part := getattr(sweep, name)) is not None
            }
            sweep = replace(sweep, deviation=sweep.deviation[inside], **parts)
        kept.append(sweep)
    return tuple(kept), notices


def refuse_resonant_sweep(sweeps: Sequence[OperatingSweep], modes: ModalTable) -> None:
    """Refuse sweeps that never leave the rigid-body resonances, with an InputError."""
    highest = float(np.max(modes.frequency))
    for sweep in sweeps:
        above = np.count_nonzero(sweep.frequency >= BEYOND_MODES * highest)
        if above < min(SMALLEST_LINES, sweep.frequency.size):
            raise InputError(
                f"sweep {sweep.name} ends at {sweep.speed[-1]:.0f} 1/min and never leaves the "
                f"resonances of the mounted compressor, the highest of which lies at {highest:.1f} "
                f"Hz: {above} lines above {60 * BEYOND_MODES * highest:.0f} 1/min do not tell an "
                f"unbalance from a mount, at least {SMALLEST_LINES} are needed"
            )


def hose_alarms(sweeps: Sequence[OperatingSweep], bands: Sequence[ResidualBand]) -> tuple[str, ...]:
    """Report loads that look like hoses, in words; empty where there is nothing."""
    seen = [
        band
        for band in bands
        if band.low >= HOSES_ABOVE and band.share > VISIBLE_SHARE and band.reduced_chi > ALARM
    ]
    if not seen:
        return ()
    worst = max(seen, key=lambda band: band.share)
    text = (
        f"{PERCENT * worst.share:.1f} % of the load in {worst.low:g}-{worst.high:g} Hz comes from "
        "no rotor and no gas, as it does with hoses joined"
    )
    if all(sweep.hoses is not HoseState.STANDARD for sweep in sweeps):
        text += (
            f", though these are reported as {sweeps[0].hoses.value}: check what was joined, and "
            "how long and soft it is"
        )
    return (f"{text}. The state of the mounts cannot be told apart from them.",)


def load_alarms(
    sweeps: Sequence[OperatingSweep], sources: Sources, mismatch: float, state: MountState
) -> tuple[str, ...]:
    """Report what rotor, gas and mounts as struck do not explain, in words.

    `mismatch`: change of the mounts that no common factor describes, 1 σ per direction [1].
    """
    hoses = hose_alarms(sweeps, sources.residual_bands)
    if hoses:
        return hoses
    alarms = [state.statement] if state.changed else []
    if sources.remaining_chi > ALARM:
        alarms.append(
            f"The loads differ from rotor, gas and mounts by {sources.remaining_chi:.1f} times "
            f"their noise (alarm at {ALARM:g})."
        )
    elif sources.reduced_chi > ALARM:
        alarms.append(
            f"One factor for all mounts misses the loads by {sources.reduced_chi:.1f} times their "
            f"noise (alarm at {ALARM:g}): the mounts have changed by some {PERCENT * mismatch:.1f} "
            "% per direction besides, as they do where they soften with their own motion. The "
            "numbers of all speeds together allow for it."
        )
    return tuple(alarms)
