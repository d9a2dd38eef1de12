"""Expected change of the level in cars, with an interval: draws of what nobody measured.

A model predicts the change by picks from what was measured. A car differs from it: data err, its
body gives way, its rubber is warmer or older than in the test, and stiffnesses follow amplitudes.
A draw measures again, draws a body that agrees with what is known of it, and rubber, and solves
powertrain, wheel ends and body with today's parts and with the picks. Priors and width factors
stand in `deboom.vehicles.change_prior`.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import numpy.typing as npt
from scipy.stats import t as student

from deboom.arrays import BoolArray, ComplexArray, IntArray, RealArray
from deboom.errors import InputError
from deboom.explore.space import checked_designs
from deboom.measurement.uncertainty import complex_normals
from deboom.mounts.mount import Mount, RubberInCar
from deboom.physics.sound_level import spl
from deboom.vehicles import change_prior as prior
from deboom.vehicles.booming_model import BoomingModel, CatalogueModel, Motion
from deboom.vehicles.coupled_motion import (
    CoupledMotion,
    FlexibleMotion,
    bracket_compliance,
    spring_shares,
    vars_of,
)
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import Fleet, Vehicle, paths_into, relative_noise

SHARE = 0.9
"""Probability that an interval states [1]."""

LINE_STEP = 2
"""Draws are solved on every second line; what the others change is the model's."""


class Information(Enum):
    """What is known of the bodies at their mounts, least first."""

    unknown = "bodies unknown"
    driving_points = "driving points"
    receptances = "receptances"


N_DRAWS = {Information.unknown: 160, Information.driving_points: 48, Information.receptances: 48}
"""Draws of bodies and rubber [1]: an unknown body is the same one for all vehicles and cheap."""

BODIES_TO_STRIKE = 3
"""Bodies of the prior whose driving points are taken as measured, to say what these would tell."""

BODIES_TO_RANK = 12
"""The same where measurements are ranked: soft bodies leave wide intervals, so a few say little."""

STRUCK_NOISE = 0.05
"""Relative noise of these driving points [1]."""


@dataclass(frozen=True, eq=False)
class Interval:
    """Expected change, and bounds that hold it with probability `SHARE`, alike in shape [dB]."""

    expected: RealArray
    low: RealArray
    high: RealArray

    def of(self, row: int) -> Interval:
        """Return the part of one row."""
        return Interval(self.expected[row], self.low[row], self.high[row])


@dataclass(frozen=True, eq=False)
class ExpectedChange:
    """Where the change of the level against today's parts is expected.

    - `information`: what was known of the bodies.
    - `cars`: mean level over the lines, in each vehicle, and at each further receiver, by each
      pick, (n, v) [dB].
    - `mean`, `worst`: mean of the ears, and the ear that gains least, (n,) [dB].
    - `peaks`: loudest line of the first load case, in each vehicle, (n, v) [dB]. Without
      receptances its expected value says little: state the bounds alone. Nothing is expected of
      vibrations, whose bounds would hold too few: nan.
    - `predicted`: `cars` as the model of the data has it, (n, v) [dB].
    - `with_points`: width that the intervals of ears are expected to have with driving points, over
      that in `cars`, (n,) [1]; nan where more than nothing is known of bodies.

    See Also
    --------
    deboom.vehicles.fleet_front.FleetFront, deboom.BoomingModel
    """

    information: Information
    cars: Interval
    mean: Interval
    worst: Interval
    peaks: Interval
    predicted: RealArray
    with_points: RealArray

    def at(self, rows: IntArray) -> ExpectedChange:
        """Return what is expected of some responses alone; mean and worst stay."""
        cars, peaks = (
            Interval(*(np.take(values, rows, axis=-1) for values in vars(part).values()))
            for part in (self.cars, self.peaks)
        )
        return replace(
            self, cars=cars, peaks=peaks, predicted=np.take(self.predicted, rows, axis=-1)
        )

    def of(self, pick: int) -> ExpectedChange:
        """Return what is expected of one pick, by its row."""
        cars, mean, worst, peaks = (
            part.of(pick) for part in (self.cars, self.mean, self.worst, self.peaks)
        )
        return replace(
            self,
            cars=cars,
            mean=mean,
            worst=worst,
            peaks=peaks,
            predicted=self.predicted[pick],
            with_points=self.with_points[pick],
        )


@dataclass(frozen=True, eq=False)
class ChangeDraws:
    """Changes against today's parts: of the model and of every draw.

    - `predicted` (n, v), `drawn` (d, n, v): mean level over the lines [dB].
    - `predicted_peak`, `drawn_peak`: loudest line of the first load case, likewise [dB].
    - `struck` (b, d, n, v): `drawn`, if the driving points of body b of the prior were measured;
      without a body where more than nothing is known [dB].
    - `ears`: numbers of the responses that are sounds.
    """

    information: Information
    predicted: RealArray
    drawn: RealArray
    predicted_peak: RealArray
    drawn_peak: RealArray
    struck: RealArray
    ears: IntArray


Model = BoomingModel | CatalogueModel
"""Levels by stiffness factors, or by parts of a catalogue and their factors."""


def expected_or_why(model: Model, expect: Callable[[], ExpectedChange]) -> ExpectedChange | str:
    """Return what is expected of a model's change, or the sentence that says why nothing is."""
    reason = _why_unexpected(model)
    try:
        return reason or expect()
    except InputError as error:
        return f"no expected change, because {error}"


def _why_unexpected(model: Model) -> str:
    """Say why nothing is expected of a model's change; empty where something is."""
    today = _with_todays_parts(model)
    if today.motion is Motion.prescribed:
        return (
            "no expected change, because the powertrain's motion is prescribed: a car answers "
            "other stiffnesses with another motion; search with coupled motion"
        )
    if today.motion is Motion.amplitude or today.factor is Factor.part:
        return (
            "no expected change, because it was judged with factors of the dynamic stiffness in "
            "coupled motion alone: search with these"
        )
    return ""


def _with_todays_parts(model: Model) -> BoomingModel:
    return model.models[0] if isinstance(model, CatalogueModel) else model


def expected_change(
    model: Model,
    again: Sequence[Model],
    fleet: Fleet,
    mounts: Sequence[Mount],
    picks: npt.ArrayLike,
    *,
    information: Information | None = None,
    weights: RealArray | None = None,
    seed: int = 1,
) -> ExpectedChange:
    """State the expected change by picks, at each receiver, in the mean and in the worst of ears.

    Parameters
    ----------
    model : BoomingModel or CatalogueModel
        Coupled motion of the data as measured, with factors of the dynamic stiffness.
    again : sequence of the same
        The same of the data measured again, see `deboom.vehicles.uncertain_data`.
    fleet : Fleet
        The model's vehicles, with the receptances of their bodies or without.
    mounts : sequence of Mount
        Mounts of the platform.
    picks : array_like, shape (n, k) or (n, v, k)
        Designs, the same in all vehicles or one for each [1]. Today's parts have all factors 1, and
        of a catalogue number 0.
    information : Information, optional
        What of the bodies is used; by default all that is known of every vehicle's.
    weights : array, shape (v,), optional
        Of the responses in the mean, in which vibrations have no part [1]; by default all alike.
    seed : int
        Of the draws, from 1: the same seed gives the same numbers.

    Raises
    ------
    InputError
        A model of which nothing is expected, see `expected_or_why`; driving points or receptances
        are asked for that not all vehicles have; no model of data measured again.

    Notes
    -----
    ``(diag(1/(x k K (A/A₀)^-s)) + Y_S + Y_B) g = u_free`` with today's and new factors x, rubber k,
    slope s of the stiffness over the amplitude A, receptances Y_S of powertrain and wheel ends and
    Y_B of the body. The expected change is a weighted sum of the model's change and the mean of the
    draws; the interval reaches from there as far as their 5 and 95 % quantiles from their mean,
    times a width factor (split conformal prediction on tuning platforms of the bench's families).
    """
    draws = change_draws(model, again, fleet, mounts, picks, information=information, seed=seed)
    return stated(draws, weights)


def stated(draws: ChangeDraws, weights: RealArray | None = None) -> ExpectedChange:
    """State intervals of draws, with the centres and width factors of the prior."""
    key, ears = draws.information.name, draws.ears
    of_ears = None if weights is None else weights[ears]
    of_model = fleet_statistics(np.take(draws.predicted, ears, axis=-1), of_ears)
    of_draws = fleet_statistics(np.take(draws.drawn, ears, axis=-1), of_ears)
    cars = interval(draws.predicted, draws.drawn, prior.CENTRE[key], prior.WIDTH[key])
    points = Information.driving_points.name
    struck = [
        interval(draws.predicted, drawn, prior.CENTRE[points], prior.WIDTH[points])
        for drawn in draws.struck
    ]
    widths = [
        np.mean(np.take(each.high - each.low, ears, axis=-1), axis=-1) for each in (cars, *struck)
    ]
    return ExpectedChange(
        information=draws.information,
        cars=cars,
        mean=interval(of_model[0], of_draws[0], prior.CENTRE[key], prior.MEAN_WIDTH[key]),
        worst=interval(of_model[1], of_draws[1], prior.CENTRE[key], prior.WORST_WIDTH[key]),
        peaks=_of_ears(
            interval(
                draws.predicted_peak, draws.drawn_peak, prior.PEAK_CENTRE, prior.PEAK_WIDTH[key]
            ),
            ears,
        ),
        predicted=draws.predicted,
        with_points=np.mean(widths[1:], axis=0) / widths[0]
        if struck
        else np.full(len(widths[0]), np.nan),
    )


def _of_ears(interval: Interval, ears: IntArray) -> Interval:
    """Return an interval (n, v) with nan for what is no ear."""
    heard = np.isin(np.arange(interval.expected.shape[-1]), ears)
    return Interval(*(np.where(heard, values, np.nan) for values in vars(interval).values()))


def fleet_statistics(
    changes: RealArray, weights: RealArray | None = None
) -> tuple[RealArray, RealArray]:
    """Return mean and largest of changes (..., v) over the vehicles, (...) each [dB]."""
    return np.average(changes, axis=-1, weights=weights), changes.max(axis=-1)


def interval(
    predicted: RealArray, drawn: RealArray, centre: tuple[float, float], width: float
) -> Interval:
    """Return the interval of changes (...) from draws (d, ...) [dB], see `expected_change`."""
    middle = drawn.mean(axis=0)
    low, high = np.quantile(drawn, [0.5 - SHARE / 2.0, 0.5 + SHARE / 2.0], axis=0)
    expected = centre[0] * predicted + centre[1] * middle
    below, above = np.hypot(middle - low, prior.FLOOR), np.hypot(high - middle, prior.FLOOR)
    return Interval(expected, expected - width * below, expected + width * above)


def half_width_of_others(changes: RealArray) -> float:
    """Return by how much the mean of further vehicles of a group may differ, `SHARE` [dB].

    ``t s / √v``, with the standard deviation s of the changes (v,) [dB] and Student's t of v - 1
    degrees of freedom: the vehicles are taken for a sample of further ones. One says nothing: nan.
    """
    if changes.size < 2:
        return float("nan")
    quantile = float(student.ppf(0.5 + SHARE / 2.0, changes.size - 1))
    return quantile * float(changes.std(ddof=1)) / float(np.sqrt(changes.size))


def change_draws(
    model: Model,
    again: Sequence[Model],
    fleet: Fleet,
    mounts: Sequence[Mount],
    picks: npt.ArrayLike,
    *,
    information: Information | None = None,
    seed: int = 1,
) -> ChangeDraws:
    """Draw changes by picks; parameters and errors as of `expected_change`."""
    draws = _Draws.of(model, again, fleet, mounts, picks, information=information, seed=seed)
    mean, peak = draws.drawn(draws.bodies)
    struck = np.empty((0, N_DRAWS[Information.driving_points], *mean.shape[1:]))
    if draws.bodies.information is Information.unknown:
        bodies = draws.struck(CarMeasurement.driving_points, BODIES_TO_STRIKE)
        struck = np.stack([draws.drawn(each)[0] for each in bodies])
    return ChangeDraws(
        information=draws.bodies.information,
        predicted=draws.predicted[0],
        drawn=mean,
        predicted_peak=draws.predicted[1],
        drawn_peak=peak,
        struck=struck,
        ears=draws.ears,
    )


class CarMeasurement(Enum):
    """A measurement that would tell more of a car than is known."""

    driving_points = "driving points of every vehicle, by a hammer"
    receptances = "receptances of every vehicle, by a hammer"
    brackets = "brackets of the body by a hammer"
    temperature = "a run at another temperature, and temperatures in use"


def widths_if_measured(
    model: Model,
    again: Sequence[Model],
    fleet: Fleet,
    mounts: Sequence[Mount],
    picks: npt.ArrayLike,
    *,
    weights: RealArray | None = None,
    seed: int = 1,
) -> dict[CarMeasurement | None, RealArray]:
    """State how wide the interval of the mean change is expected to be after a measurement.

    - other parameters and errors: as of `expected_change`.
    - returns: by measurement that would tell something new, and under None as it is now: width of
      `ExpectedChange.mean` by each pick, (n,) [dB].

    Bodies are drawn that agree with what is known, each is measured, and the interval is stated as
    it would be then; widths are medians over them, because a soft body leaves a wide interval
    however well it is known. A temperature takes its part off the rubber.
    """
    draws = _Draws.of(model, again, fleet, mounts, picks, seed=seed)
    state, ears = draws.bodies.information, draws.ears
    of_ears = None if weights is None else weights[ears]
    of_model = fleet_statistics(np.take(draws.predicted[0], ears, axis=-1), of_ears)[0]

    def width(bodies: _Bodies, mounts: Sequence[Mount] | None = None) -> RealArray:
        changes = np.take(draws.drawn(bodies, mounts)[0], ears, axis=-1)
        mean = fleet_statistics(changes, of_ears)[0]
        key = bodies.information.name
        stated = interval(of_model, mean, prior.CENTRE[key], prior.MEAN_WIDTH[key])
        return stated.high - stated.low

    def of_bodies(step: CarMeasurement) -> RealArray:
        each = [width(bodies) for bodies in draws.struck(step, BODIES_TO_RANK)]
        return np.asarray(np.median(each, axis=0))

    widths: dict[CarMeasurement | None, RealArray] = {None: width(draws.bodies)}
    if state is Information.unknown:
        for step in (
            CarMeasurement.driving_points,
            CarMeasurement.receptances,
            CarMeasurement.brackets,
        ):
            widths[step] = of_bodies(step)
    elif state is Information.driving_points:
        widths[CarMeasurement.receptances] = of_bodies(CarMeasurement.receptances)
    if not all(mount.rubber for mount in mounts):
        with_temperatures = [
            replace(mount, rubber=mount.rubber or RubberInCar()) for mount in mounts
        ]
        widths[CarMeasurement.temperature] = width(draws.bodies, with_temperatures)
    return widths


@dataclass(frozen=True, eq=False)
class _Draws:
    """What draws of the changes by picks are made of.

    - `bodies`: as far as they are known.
    - `measured`: load cases of each set of data measured again, with the springs of all designs.
    - `mounts`, `weights`: of the platform, and of the load cases [1].
    - `of_model`, `on_fewer` (2, n, v): changes of the model on all lines, and on those of the
      draws, see `_changes` [dB].
    - `per_vehicle`: numbers of picks and vehicles, where each vehicle has a design of its own.
    - `vehicle_of`: number of the vehicle of each response.
    - `ears`: numbers of the responses that are sounds.
    """

    bodies: _Bodies
    measured: list[list[_Case]]
    mounts: Sequence[Mount]
    weights: Sequence[float]
    of_model: RealArray
    on_fewer: RealArray
    per_vehicle: tuple[int, int] | None
    vehicle_of: tuple[int, ...]
    ears: IntArray
    seed: int

    @classmethod
    def of(
        cls,
        model: Model,
        again: Sequence[Model],
        fleet: Fleet,
        mounts: Sequence[Mount],
        picks: npt.ArrayLike,
        *,
        information: Information | None = None,
        seed: int,
    ) -> _Draws:
        """Prepare draws; parameters and errors as of `expected_change`."""
        if reason := _why_unexpected(model):
            raise InputError(reason)
        if not again:
            raise InputError("an expected change needs data measured again: draw some")
        states = [known_of_body(vehicle) for vehicle in fleet.vehicles]
        rank = list(Information).index
        information = information or min(states, key=rank)
        lacking = sum(rank(state) < rank(information) for state in states)
        if lacking:
            raise InputError(
                f"{information.value} are asked for, and {lacking} vehicles have none: measure "
                "them in all vehicles, or take the bodies as unknown"
            )
        each = np.atleast_2d(np.asarray(picks, dtype=float))
        n_variable = len(model.variable_names)
        today = np.ones(n_variable)
        today[: n_variable - len(_with_todays_parts(model).variable_names)] = 0.0
        rows = checked_designs(each.reshape(-1, each.shape[-1]), model.variable_names)
        designs = np.vstack([today, rows])
        lines = np.arange(0, model.n_lines, LINE_STEP)
        of_model = [model.levels(designs, name) for name in model.load_case_names]
        on_fewer = [levels[..., lines] for levels in of_model]
        return cls(
            bodies=_Bodies.of(fleet, mounts, model.frequency[lines], information),
            measured=[_cases_of(other, fleet, designs, lines) for other in again],
            mounts=mounts,
            weights=model.weights,
            of_model=_changes(of_model, model.weights),
            on_fewer=_changes(on_fewer, model.weights),
            per_vehicle=(each.shape[0], each.shape[1]) if each.ndim > 2 else None,
            vehicle_of=fleet.vehicle_of,
            ears=np.flatnonzero([receiver.is_sound for receiver in model.receivers]),
            seed=seed,
        )

    @property
    def predicted(self) -> RealArray:
        """Changes of the model, of the mean level and of the loudest line, (2, n, v) [dB]."""
        return self._by_pick(self.of_model)

    def drawn(self, bodies: _Bodies, mounts: Sequence[Mount] | None = None) -> RealArray:
        """Draw changes on bodies, (2, d, n, v) [dB]; `mounts` have another state of the rubber."""
        changes = []
        for number in range(N_DRAWS[bodies.information]):
            generator = np.random.default_rng([self.seed, zlib.crc32(b"expected change"), number])
            body = bodies.draw(generator)
            rubber = _Rubber.draw(generator, mounts or self.mounts)
            cases = self.measured[number % len(self.measured)]
            changes.append(_changes([case.levels(body, rubber) for case in cases], self.weights))
        levels = np.moveaxis(np.array(changes) + (self.of_model - self.on_fewer), 1, 0)
        return self._by_pick(levels)

    def struck(self, step: CarMeasurement, n_bodies: int) -> Iterator[_Bodies]:
        """Draw bodies that agree with what is known, as if each was measured."""
        for number in range(n_bodies):
            key = [self.seed, zlib.crc32(b"driving points"), number]
            yield self.bodies.struck(np.random.default_rng(key), step)

    def _by_pick(self, changes: RealArray) -> RealArray:
        """Return changes (..., n, v) of every vehicle with its own design, where it has one."""
        if self.per_vehicle is None:
            return changes
        shape = (*changes.shape[:-2], *self.per_vehicle, changes.shape[-1])
        return changes.reshape(shape)[..., self.vehicle_of, np.arange(len(self.vehicle_of))]


def known_of_body(vehicle: Vehicle) -> Information:
    """Tell how much is known of a vehicle's body."""
    if vehicle.receptance is None:
        return Information.unknown
    points = vehicle.has_driving_points_alone
    return Information.driving_points if points else Information.receptances


def _cases_of(model: Model, fleet: Fleet, designs: RealArray, lines: IntArray) -> list[_Case]:
    """Return the load cases on some lines, with the springs of designs and of the parts in them."""
    today, cases = _with_todays_parts(model), []
    sets = [(np.arange(len(designs)), today, designs)]
    if isinstance(model, CatalogueModel):
        sets = list(model.sets(designs))
    for number, case in enumerate(today.cases):
        assert isinstance(case, CoupledMotion)
        springs = np.empty((len(designs), len(lines), case.variables.size), dtype=complex)
        for rows, of_parts, factors in sets:
            moved = of_parts.cases[number]
            assert isinstance(moved, CoupledMotion)
            springs[rows] = moved.at_lines(lines).springs(of_parts.case_factors(factors))
        at_lines, loss = case.at_lines(lines), today.loss_factors
        cases.append(_Case.of(at_lines, springs, fleet, loss_factors=loss))
    return cases


def _changes(levels: Sequence[RealArray], weights: Sequence[float]) -> RealArray:
    """Return changes against the first design of levels (n, v, f) by load case, (2, n - 1, v) [dB].

    Of the weighted mean level, and of the loudest line of the first load case.
    """
    pairs = zip(weights, levels, strict=True)
    mean = np.sum([weight * each.mean(axis=-1) for weight, each in pairs], axis=0)
    both = np.stack([mean, levels[0].max(axis=-1)])
    return np.asarray(both[:, 1:] - both[:, :1])


@dataclass(frozen=True, eq=False)
class _Rubber:
    """Rubber of one draw, by mount: `factor` on the model's stiffness, `slope` over amplitude [1].

    The model has the stiffness that is expected in the car; temperatures differ from there.
    """

    factor: dict[str, float]
    slope: dict[str, float]

    @classmethod
    def draw(cls, generator: np.random.Generator, mounts: Sequence[Mount]) -> _Rubber:
        """Draw a factor that is common to all mounts, and what each has for itself."""
        names = [mount.name for mount in mounts]
        common = generator.standard_normal()
        spread = np.array([_spread_of_rubber(mount.rubber) for mount in mounts])
        factor = np.exp(
            spread * common + prior.RUBBER_MOUNT * generator.standard_normal(len(names))
        )
        slope = log_uniform(generator, prior.SLOPE)
        slope = slope * np.exp(prior.SLOPE_SPREAD * generator.standard_normal(len(names)))
        stated = [mount.rubber for mount in mounts]
        if any(stated):
            # one day: all mounts are as warm, and of rubber as strong
            day = generator.uniform(size=2)
            factor *= [
                each.on_the_road * each.at(*day) / each.factor if each else 1.0 for each in stated
            ]
        return cls(
            dict(zip(names, factor.tolist(), strict=True)),
            dict(zip(names, slope.tolist(), strict=True)),
        )


def _spread_of_rubber(rubber: RubberInCar | None) -> float:
    """Return the standard deviation of ln k that all mounts share, by what is known of it [1]."""
    if rubber is None:
        return prior.RUBBER_TEST
    return prior.RUBBER_AGE if rubber.spread is None else rubber.spread


@dataclass(frozen=True, eq=False)
class _Case:
    """Coupled motion of one load case on some lines, ready to stand on any body.

    - `motion`: one spring per direction, body at rest.
    - `springs` (n, f, s): stiffness of every design [N/m].
    - `amplitude` (f, s): of the measured motion [m].
    - `mounts`: mount of each spring.
    """

    motion: FlexibleMotion
    springs: ComplexArray
    amplitude: RealArray
    mounts: tuple[str, ...]

    @classmethod
    def of(
        cls, case: CoupledMotion, of_designs: ComplexArray, fleet: Fleet, *, loss_factors: bool
    ) -> _Case:
        """Take the motion of a model's case, and join elastic and lossy springs of a direction.

        - `fleet`: vehicles of the case.
        - `of_designs` (n, f, s): stiffness of the case's springs in every design [N/m].
        """
        bodies, springs, first = [], [], 0
        for body in case.bodies:
            n = body.variables.size
            of_body = of_designs[..., first : first + n]
            first += n
            if loss_factors:
                n //= 2
                of_body = of_body[..., :n] + of_body[..., n:]
                body = replace(
                    body,
                    forward=body.forward[:n],
                    stiffness=body.stiffness[:, :n] + body.stiffness[:, n:],
                    variables=body.variables[:n],
                    transfer=body.transfer[..., :n],
                )
            bodies.append(body)
            springs.append(of_body)
        rigid = CoupledMotion(**vars_of(case) | {"bodies": tuple(bodies)})
        n_springs, body_of = rigid.variables.size, np.array(fleet.vehicle_of)
        shape = (len(fleet.vehicles), case.frequency.size, n_springs, n_springs)
        receptance = np.zeros(shape, dtype=complex)
        motion = FlexibleMotion(**vars_of(rigid), receptance=receptance, body_of=body_of)
        names = tuple(case.variable_names[k].rpartition(" ")[0] for k in rigid.variables)
        return cls(motion, np.concatenate(springs, axis=-1), rigid.nominal_amplitude, names)

    def levels(self, bodies: ComplexArray, rubber: _Rubber) -> RealArray:
        """Return the levels of the designs on drawn bodies.

        - `bodies` (b, f, s, s): one for all vehicles, or one each [m/N].
        - returns (n, v, f) [dB(A)].
        """
        motion = self.motion
        factor = np.array([rubber.factor[mount] for mount in self.mounts])
        slope = np.array([rubber.slope[mount] for mount in self.mounts])
        compliance = np.moveaxis(1.0 / (factor * self.springs), -1, 0)
        rest = np.moveaxis(motion.source + bodies, (2, 3), (0, 1))
        nominal, slopes = self.amplitude.T[:, np.newaxis], slope[:, np.newaxis, np.newaxis]
        pressure = np.empty((len(self.springs), *motion.transfer.shape[:2]), dtype=complex)
        for number in range(len(bodies)):
            force = _forces(rest[:, :, number], motion.free.T, compliance)
            # a stiffness that falls with the amplitude
            reached = np.abs(force * compliance) / nominal
            softer = np.clip(reached**slopes, *SOFTENING)
            force = _forces(rest[:, :, number], motion.free.T, compliance * softer)
            at = motion.body_of == number if len(bodies) > 1 else slice(None)
            pressure[:, at] = np.einsum("snf,vfs->nvf", force, motion.transfer[at])
        return spl(pressure, motion.frequency, axis=-1)


SOFTENING = (0.3, 3.0)
"""Bounds of a compliance over that at the measured amplitude [1]: those of rubber."""


def _forces(rest: ComplexArray, free: ComplexArray, compliance: ComplexArray) -> ComplexArray:
    """Solve ``(diag(c) + Y) g = u`` for all designs and lines side by side.

    - `rest` (s, s, f): symmetric Y [m/N]; `free` (s, f): u [m]; `compliance` (s, n, f): c [m/N].
    - returns (s, n, f): g [N].

    Elimination without pivoting: springs with losses keep the pivots away from zero. Each step is
    one operation over all designs and lines; many small matrices in turn take six times as long.
    """
    n = len(rest)
    matrix = np.repeat(rest[:, :, np.newaxis], compliance.shape[1], axis=2)
    matrix[np.arange(n), np.arange(n)] += compliance
    force = np.repeat(free[:, np.newaxis], compliance.shape[1], axis=1)
    inverse = np.empty_like(compliance)
    for k in range(n):
        inverse[k] = 1.0 / matrix[k, k]
        column = matrix[k + 1 :, k]
        share = column * inverse[k]
        matrix[k + 1 :, k + 1 :] -= share[:, np.newaxis] * column
        force[k + 1 :] -= share * force[k]
    for k in reversed(range(n)):
        of_later_rows = (matrix[k + 1 :, k] * force[k + 1 :]).sum(axis=0)
        force[k] = (force[k] - of_later_rows) * inverse[k]
    return force


@dataclass(frozen=True, eq=False)
class _Bodies:
    """Bodies of the vehicles as far as they are known.

    - `frequency` (f,): lines of the draws [Hz].
    - `share` (s, p): parts of the force of every spring that enter the paths, see `spring_shares`.
    - `brackets` (f, s): what stated brackets give way at the springs [m/N].
    - `attachments` (p,): what gives way locally at each path; nan is drawn from the prior, and 0
      has a stated bracket of the body [m/N].
    - `lateral` (p,): paths along y. `pieces` (p,): pieces of a mount that share a path [1].
    - `receptance` (v, f, p, p): as measured, None where unknown [m/N]; `noise` (v,): relative [1].
    """

    information: Information
    frequency: RealArray
    share: RealArray
    brackets: ComplexArray
    attachments: RealArray
    lateral: BoolArray
    pieces: RealArray
    receptance: ComplexArray | None
    noise: RealArray

    @classmethod
    def of(
        cls,
        fleet: Fleet,
        mounts: Sequence[Mount],
        frequency: RealArray,
        information: Information,
    ) -> _Bodies:
        """Take what is known of a fleet's bodies on some lines."""
        paths = paths_into(mounts, fleet.vehicles[0].noise_transfer.inputs)
        bracketed = [m.name for m in mounts for each in m.brackets if each.side == "body"]
        receptance, noise = None, np.zeros(len(fleet.vehicles))
        if information is not Information.unknown:
            measured = [_on_lines(vehicle, list(paths), frequency) for vehicle in fleet.vehicles]
            receptance = np.stack([values for values, _ in measured])
            noise = np.array([of_pairs for _, of_pairs in measured])
            if information is Information.driving_points:
                noise = np.array([_noise_of_lines(vehicle) for vehicle in fleet.vehicles])
        return cls(
            information=information,
            frequency=frequency,
            share=spring_shares(mounts, list(paths)),
            brackets=bracket_compliance(mounts, frequency),
            attachments=np.array(
                [
                    0.0 if name.rpartition(" ")[0] in bracketed else np.nan
                    for name, _ in paths.values()
                ]
            ),
            lateral=np.array([path.endswith(" y") for path in paths]),
            pieces=np.array([len(channels) for _, channels in paths.values()], dtype=float),
            receptance=receptance,
            noise=noise,
        )

    def draw(self, generator: np.random.Generator) -> ComplexArray:
        """Draw receptances at the springs, (b, f, s, s): one body for all, or one each [m/N]."""
        springs = np.asarray(self.share @ self._paths(generator) @ self.share.T)
        if self.brackets.any():
            springs += self.brackets[..., np.newaxis] * np.eye(len(self.share))
        return springs

    def _paths(self, generator: np.random.Generator) -> ComplexArray:
        """Draw receptances between the paths, (b, f, p, p) [m/N]."""
        if self.receptance is None:
            return self._unknown(generator)[np.newaxis]
        if self.information is Information.driving_points:
            unknown = self._unknown(generator)
            return np.stack(
                [
                    _with_driving_points(unknown, _noisy(each, noise, generator))
                    for each, noise in zip(self._driving_points, self.noise, strict=True)
                ]
            )
        # noise of a mean of two functions; both of a pair have the same
        drawn = [
            _noisy(each, noise / np.sqrt(2.0), generator)
            for each, noise in zip(self.receptance, self.noise, strict=True)
        ]
        return np.stack([np.tril(y) + np.tril(y, -1).swapaxes(1, 2) for y in drawn])

    def struck(self, generator: np.random.Generator, step: CarMeasurement) -> _Bodies:
        """Draw bodies, and return these as if they were measured."""
        if step is CarMeasurement.brackets:
            return replace(self, attachments=self._attachments(generator))
        bodies = self._paths(generator)
        states = {
            CarMeasurement.driving_points: Information.driving_points,
            CarMeasurement.receptances: Information.receptances,
        }
        noise = np.full(len(bodies), STRUCK_NOISE)
        return replace(self, information=states[step], receptance=bodies, noise=noise)

    @property
    def _driving_points(self) -> ComplexArray:
        assert self.receptance is not None
        return self.receptance.diagonal(axis1=2, axis2=3)

    def _unknown(self, generator: np.random.Generator) -> ComplexArray:
        """Draw the receptance of a body between its paths from the prior, (f, p, p) [m/N]."""
        n_path, n_mode = (
            len(self.pieces),
            int(generator.integers(prior.MODES[0], prior.MODES[1] + 1)),
        )
        ends = generator.uniform(*prior.LOWEST), generator.uniform(*prior.HIGHEST)
        natural = 2.0 * np.pi * log_uniform(generator, ends, n_mode)
        damping = log_uniform(generator, prior.DAMPING, n_mode)
        sizes = log_uniform(generator, prior.SHAPE) * np.exp(
            prior.SHAPE_SPREAD * generator.standard_normal(n_mode)
        )
        shapes = sizes[:, np.newaxis] * generator.standard_normal((n_mode, n_path))
        shapes[:, self.lateral] *= generator.uniform(*prior.LATERAL)
        attachments = self._attachments(generator)
        omega = 2.0 * np.pi * self.frequency[:, np.newaxis]
        answer = 1.0 / (natural**2 - omega**2 + 2j * damping * natural * omega)
        modal = (shapes.T * answer[:, np.newaxis]) @ shapes
        return np.asarray(modal + np.diag(attachments))

    def _attachments(self, generator: np.random.Generator) -> RealArray:
        """Draw what gives way locally at each path, where it is not known, (p,) [m/N]."""
        stiffness = log_uniform(generator, prior.ATTACHMENT) * np.exp(
            prior.ATTACHMENT_SPREAD * generator.standard_normal(len(self.pieces))
        )
        drawn = 1.0 / (self.pieces * stiffness)
        return np.where(np.isnan(self.attachments), drawn, self.attachments)


def _with_driving_points(body: ComplexArray, measured: ComplexArray) -> ComplexArray:
    """Scale a body (f, p, p) line by line to measured driving points (f, p) [m/N].

    ``Y_ij √(Y'_ii/Y_ii) √(Y'_jj/Y_jj)``, no larger than ``√|Y'_ii Y'_jj|``: what passes from point
    to point never exceeds what the points themselves do.
    """
    scale = np.sqrt(measured / body.diagonal(axis1=1, axis2=2))
    scaled = scale[:, :, np.newaxis] * body * scale[:, np.newaxis]
    root = np.sqrt(np.abs(measured))
    bound = root[:, :, np.newaxis] * root[:, np.newaxis]
    return np.asarray(scaled * np.minimum(1.0, bound / np.maximum(np.abs(scaled), 1e-300)))


def _noisy(values: ComplexArray, noise: float, generator: np.random.Generator) -> ComplexArray:
    return values * (1.0 + noise * complex_normals(values.shape, generator))


def _on_lines(
    vehicle: Vehicle, paths: list[str], frequency: RealArray
) -> tuple[ComplexArray, float]:
    """Return a vehicle's receptance on some lines, its reciprocal part, and its relative noise."""
    assert vehicle.receptance is not None
    frf = vehicle.receptance.select(outputs=paths, inputs=paths)
    at = np.flatnonzero(np.isin(frf.frequency, frequency))
    if at.size != frequency.size:
        raise InputError(
            f"vehicle {vehicle.name}: its receptance has other lines than the model: bring both to "
            "the same lines"
        )
    values = frf.values[at]
    return (values + values.swapaxes(1, 2)) / 2.0, relative_noise(frf.values)


def _noise_of_lines(vehicle: Vehicle) -> float:
    """Estimate the noise of driving points over their size from what differs line by line [1].

    Second differences over the lines; their median stands resonances.
    """
    assert vehicle.receptance is not None
    paths = list(vehicle.receptance.inputs)
    points = vehicle.receptance.select(outputs=paths).values.diagonal(axis1=1, axis2=2)
    if len(points) < 3:
        return 0.0
    bent = np.abs(points[2:] - 2.0 * points[1:-1] + points[:-2]) ** 2 / np.abs(points[1:-1]) ** 2
    return float(np.sqrt(np.median(bent) / (6.0 * np.log(2.0))))


def log_uniform(
    generator: np.random.Generator, bounds: tuple[float, float], size: int | None = None
) -> RealArray:
    """Draw numbers whose logarithms are uniform between bounds, one or (size,)."""
    low, high = np.log(bounds)
    return np.asarray(np.exp(generator.uniform(low, high, size)))
