"""Expected changes of families of cars: draw tuning and judging platforms, set factors, judge.

    python benchmarks/expected_change.py draw tuning FOLDER
    python benchmarks/expected_change.py factors FOLDER
    python benchmarks/expected_change.py draw judging OTHER
    python benchmarks/expected_change.py judge FOLDER OTHER

Families and seeds below were named before any platform of them was drawn. Every platform draws a
powertrain, mounts, five cars and a laboratory; steps along the model's gradient pick from the
measured data of each state of information; today's parts and the picks are driven in every car,
which the bench solves with the modes of its body and the rubber that is in the car.
`deboom.vehicles.change_prior` holds the factors that follow from the tuning platforms by one rule
(`factors`); two families take no part in them. A second judging takes new seeds and shows both.
"""

from __future__ import annotations

import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.families import BRACKETS, KINDS, draw_family
from deboom.bench.fleet import receiver_transfer
from deboom.bench.layout import LOAD_CASES
from deboom.bench.operating_run import drive
from deboom.bench.platform_writer import receiver_generator, write_platform
from deboom.bench.powertrain import load_bench
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import uncertain_index
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import spl
from deboom.vehicles import change_prior as prior
from deboom.vehicles.expected_change import Information, change_draws
from deboom.vehicles.fleet import Fleet

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from samples.driven_cars import CASE, GEAR, GROUP, PATHS, TORQUE, coupled_model, quieter_design

BODIES = (BRACKETS, *KINDS)
FAMILIES = (
    *BODIES,
    "attachments, temperature",
    "attachments, amplitude",
    "noise x 4",
)
"""The kinds of bodies with a mixture of rubber and laboratories, and three with one at its ends."""
LEFT_OUT = ("light", "truck")
"""Families that no factor is tuned on."""
TUNING, JUDGING, REPEATED = 1_000_000, 2_000_000, 3_000_000
"""First seeds: of tuning, of the judging, and of the section of ``make validate``."""
APART = 1000
"""Between the first seeds of two families."""
N_TUNING, N_JUDGING, N_REPEATED = 27, 40, 8
"""Platforms of each family: 162 of six families, 320, 64."""
MIXED = {"stiffness": 0.5, "apart": 0.5, "payne": 0.5, "noise": 0.5, "gaps": 0.25, "dead": 0.25}
"""How often a platform has each factor of rubber and laboratory."""
FELT = ", seats and wheels"
"""What the names of arrays of vibrations add to those of the drivers' ears."""
REPETITIONS = 16
"""Draws of the measurements."""
FORMER = {
    Information.unknown: (0.94, 0.022),
    Information.driving_points: (0.98, 0.005),
    Information.receptances: (0.98, 0.005),
}
"""What deboom stated before: part of the model's change that cars bring, and its deviation over the
change [1]. They followed from 440 cars of the family brackets alone."""
RUN = tuple(case for case in LOAD_CASES if case.name == CASE)


def words_of(family: str, seed: int) -> str:
    """Return what the bench is asked for."""
    generator = np.random.default_rng([seed, 1])
    kind = family.split(",")[0] if family != "noise x 4" else BODIES[seed % len(BODIES)]
    ends = {
        "attachments, temperature": {"stiffness": ("stiffness=0.85", "stiffness=1.15")[seed % 2]},
        "attachments, amplitude": {"payne": ("payne=0.4", "payne=3")[seed % 2]},
        "noise x 4": {"noise": "noise=4"},
    }.get(family, {})
    named = {name: name for name, often in MIXED.items() if generator.random() < often}
    if "dead" in named:
        named["dead"] = "dead=1"
    return ",".join((kind, *(named | ends).values()))


def platform(family: str, seed: int) -> dict[str, RealArray]:
    """Predict and drive one platform, in every state of information."""
    words = words_of(family, seed)
    drawn = draw_family(words, seed, seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p"
        options = {"load_cases": RUN, "groups": (GROUP,), "family": words, "receptance": True}
        write_platform(path, seed, truth_seed=seed, receivers=True, **options)
        data = read_platform(path)
    group = data.fleet.group(GROUP)
    felt = [not receiver.is_sound for receiver in group.receivers]
    rows = {"": np.unique(group.vehicle_of, return_index=True)[1], FELT: np.flatnonzero(felt)}
    at_rest = Fleet(tuple(replace(vehicle, receptance=None) for vehicle in group.vehicles))
    fleets = {
        Information.unknown: at_rest,
        Information.driving_points: Fleet(tuple(map(of_driving_points, group.vehicles))),
        Information.receptances: group,
    }
    models = {state: coupled_model(data, fleet) for state, fleet in fleets.items()}
    rigid = models[Information.unknown]
    again = list(uncertain_index(rigid, replace(data, fleet=at_rest), ()).draws(REPETITIONS, 1))
    designs, arrays = [np.ones(len(rigid.variable_names))], {}
    for state, model in models.items():
        drivers = Fleet(tuple(car.heard(by_driver=True) for car in fleets[state].vehicles))
        pick = quieter_design(coupled_model(data, drivers))
        designs.append(pick)
        draws = change_draws(model, again, group, data.mounts, pick, information=state, seed=seed)
        every = {
            "predicted": np.stack([draws.predicted[0], draws.predicted_peak[0]]),
            "drawn": np.stack([draws.drawn[:, 0], draws.drawn_peak[:, 0]], axis=1),
            "repeated": _repeated(model, again, pick),
        }
        for whose, of in rows.items():
            arrays |= {f"{state.name} {name}{whose}": each[..., of] for name, each in every.items()}
    true = _driven(drawn, group, np.array(designs), rigid.frequency)
    for number, state in enumerate(models, 1):
        for whose, of in rows.items():
            arrays[f"{state.name} true{whose}"] = (true[number] - true[0])[..., of]
    return {name: values.astype(np.float32) for name, values in arrays.items()}


def of_driving_points(vehicle: Any) -> Any:
    """Leave the driving points alone of a vehicle's receptance."""
    frf = vehicle.receptance.select(outputs=vehicle.receptance.inputs)
    values = np.eye(len(frf.inputs)) * frf.values
    return replace(vehicle, receptance=replace(frf, values=values))


def _repeated(model: Any, again: list[Any], pick: RealArray) -> RealArray:
    """Return the model's change from data measured again, on fixed bodies, (d, v) [dB]."""
    both, case = np.stack([np.ones_like(pick), pick]), model.cases[0]
    changes = []
    for rigid in again:
        other = rigid
        if hasattr(case, "receptance"):
            moved = replace(case, bodies=rigid.cases[0].bodies)
            other = replace(model, cases=(moved,))
        changes.append(np.diff(other(both), axis=0)[0] / model.n_lines)
    return np.array(changes)


def _driven(family: Any, cars: Fleet, designs: RealArray, lines: RealArray) -> RealArray:
    """Drive designs in every car: mean level and loudest line of all receivers, (n, 2, v) [dB]."""
    fleet, bench = family.fleet(), family.bench(load_bench(family.truth_seed))
    torque = bench.ramp.torque(TORQUE, rpm_of_frequency(lines, bench.order_torque.order))
    stiffness, loss = family.in_car(len(bench.mount_names))
    scales = {r: r.pressure_of_same_level(lines)[:, np.newaxis] for r in cars.receivers}
    levels: list[list[RealArray]] = []
    for design in designs:
        scale = stiffness * np.append(design[: PATHS - 1], [design[PATHS - 1]] * 2)
        levels.append([])
        for car in cars.vehicles:
            body = fleet.bodies[car.name]
            run = drive(bench, body, fleet.cabin, GEAR, torque, lines, scale, loss)
            own = receiver_generator(family.seed, car.name)
            transfer = receiver_transfer(body, fleet.cabin, lines, own)
            for receiver in car.transfers:
                answer = run.pressure[:, 0]
                if receiver.name:
                    felt = transfer[receiver.name] * scales[receiver]
                    answer = (felt * run.path_force).sum(axis=1)
                level = spl(answer, lines, axis=-1)
                levels[-1].append(np.array([level.mean(), level.max()]))
    return np.moveaxis(np.array(levels), 2, 1)


def draw(first: int, n_platform: int, families: tuple[str, ...], folder: Path) -> None:
    """Draw the platforms that a folder does not hold yet, family by family in turn."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(n_platform):
        for family in families:
            seed = first + APART * FAMILIES.index(family) + number
            path = folder / f"{seed}.npz"
            if path.exists():
                continue
            begin = time.process_time()
            try:
                arrays = platform(family, seed)
            except Exception:
                traceback.print_exc()
                print(f"{family}, seed {seed}: failed", flush=True)
                continue
            np.savez(path, **arrays)
            used = time.process_time() - begin
            words = words_of(family, seed)
            change = "; ".join(
                f"{s.name} {arrays[f'{s.name} true'][0].mean():.2f}, model "
                f"{arrays[f'{s.name} predicted'][0].mean():.2f}, draws "
                f"{arrays[f'{s.name} drawn'][:, 0].mean():.2f}"
                for s in Information
            )
            print(f"{seed} {words}: {change} ({used:.1f} s)", flush=True)


@dataclass(frozen=True, eq=False)
class Records:
    """One change per row: of a car, of the mean of a platform's cars, or of the worst of them.

    - `family` (r,): place in `FAMILIES`. `seed` (r,): of the platform.
    - `true`, `predicted` (r,): in the car, and by the model [dB].
    - `middle`, `below`, `above` (r,): mean of the draws, and how far their 5 and 95 % quantiles lie
      from it, at least `change_prior.FLOOR` [dB].
    - `repeated` (r,): standard deviation of the model's change over measurements [dB].
    """

    family: RealArray
    seed: RealArray
    true: RealArray
    predicted: RealArray
    middle: RealArray
    below: RealArray
    above: RealArray
    repeated: RealArray

    def of(self, rows: RealArray) -> Records:
        """Return some rows."""
        return Records(**{name: values[rows] for name, values in vars(self).items()})

    @property
    def weight(self) -> RealArray:
        """Weights with which all families count alike [1]."""
        count = np.bincount(self.family.astype(int), minlength=len(FAMILIES))
        return np.asarray(1.0 / count[self.family.astype(int)])


STATISTICS: dict[str, Callable[[RealArray], RealArray]] = {
    "cars": lambda changes: changes,
    "mean of vehicles": lambda changes: changes.mean(axis=-1, keepdims=True),
    "worst vehicle": lambda changes: changes.max(axis=-1, keepdims=True),
}


Platforms = dict[int, dict[str, RealArray]]
"""Seed → arrays of `platform`."""


def read(folder: Path) -> Platforms:
    """Read the platforms that `draw` kept."""
    return {int(path.stem): dict(np.load(path)) for path in sorted(folder.glob("*.npz"))}


def records(
    platforms: Platforms,
    state: Information,
    statistic: str = "cars",
    *,
    peak: bool = False,
    felt: bool = False,
) -> Records:
    """Arrange platforms in one state of information; `felt`: seats and wheels in place of ears."""
    words = FELT if felt else ""
    of, rows = STATISTICS[statistic], []
    for seed, arrays in platforms.items():
        true, predicted, drawn = (
            of(arrays[f"{state.name} {name}{words}"][..., int(peak), :].astype(float))
            for name in ("true", "predicted", "drawn")
        )
        repeated = of(arrays[f"{state.name} repeated{words}"].astype(float)).std(axis=0, ddof=1)
        middle, (low, high) = drawn.mean(axis=0), np.quantile(drawn, [0.05, 0.95], axis=0)
        sides = np.hypot(middle - low, prior.FLOOR), np.hypot(high - middle, prior.FLOOR)
        many = np.full(true.shape, seed % TUNING // APART), np.full(true.shape, seed)
        rows.append(np.stack([*many, true, predicted, middle, *sides, repeated]))
    return Records(*np.hstack(rows))


Judged = tuple[RealArray, RealArray, RealArray]
"""Expected change, lower and upper bound of every record [dB]."""


def quantile(values: RealArray, weight: RealArray, share: float) -> float:
    """Return a weighted quantile."""
    order = np.argsort(values)
    reached = np.cumsum(weight[order]) / weight.sum()
    return float(values[order][np.searchsorted(reached, share)])


def width(data: Records, expected: RealArray, below: RealArray, above: RealArray) -> float:
    """Return the factor on both sides that holds 90 % of the changes (split conformal)."""
    error = data.true - expected
    return quantile(np.where(error < 0, -error / below, error / above), data.weight, 0.9)


def by_draws(centre: tuple[float, float], factor: float) -> Callable[[Records], Judged]:
    """State intervals as `deboom.vehicles.expected_change.interval` does."""

    def state(data: Records) -> Judged:
        expected = centre[0] * data.predicted + centre[1] * data.middle
        return expected, expected - factor * data.below, expected + factor * data.above

    return state


def by_constants(brought: float, deviation: float, factor: float) -> Callable[[Records], Judged]:
    """State intervals by two constants, joined in squares with errors of measurement.

    - `brought`: part of the model's change that cars bring [1]; `deviation`: over the change [1].
    """

    def state(data: Records) -> Judged:
        half = factor * 1.645 * np.hypot(data.repeated, deviation * np.abs(data.predicted))
        expected = brought * data.predicted
        return expected, expected - half, expected + half

    return state


def score(data: Records, judged: Judged) -> float:
    """Return the mean interval score over families (Winkler) [dB]."""
    _, low, high = judged
    missed = np.maximum(low - data.true, 0.0) + np.maximum(data.true - high, 0.0)
    return float(np.average(high - low + 20.0 * missed, weights=data.weight))


def fitted_centre(data: Records) -> tuple[float, float]:
    """Return the parts of model and draws in the expected change, by least squares of the share."""
    root = np.sqrt(data.weight) / np.hypot(data.predicted, 0.5)
    columns = np.stack([data.predicted, data.middle], axis=1) * root[:, np.newaxis]
    model, draws = np.linalg.lstsq(columns, data.true * root, rcond=None)[0]
    return round(float(model), 2), round(float(draws), 2)


def tuned(data: Records, centre: tuple[float, float]) -> Callable[[Records], Judged]:
    """Set the width factor on tuning records."""
    expected = by_draws(centre, 0.0)(data)[0]
    return by_draws(centre, round(width(data, expected, data.below, data.above), 2))


def refitted(data: Records) -> Callable[[Records], Judged]:
    """Set the former constants on tuning records: what is brought, and least score by spread."""
    unit = data.weight / np.hypot(data.predicted, 0.5) ** 2
    brought = float(np.sum(unit * data.predicted * data.true) / np.sum(unit * data.predicted**2))
    tried = []
    for deviation in (0.02, 0.04, 0.06, 0.08, 0.1, 0.13, 0.16, 0.2, 0.3):
        expected, low, high = by_constants(brought, deviation, 1.0)(data)
        factor = width(data, expected, expected - low, high - expected)
        state = by_constants(brought, deviation, factor)
        tried.append((score(data, state(data)), deviation, state))
    return min(tried, key=lambda each: each[:2])[2]


def without_family(data: Records, rule: Callable[[Records], Callable[[Records], Judged]]) -> float:
    """Return the score of each family by what was tuned on the others, mean over families [dB]."""
    scores = []
    for family in np.unique(data.family):
        at = data.family == family
        scores.append(score(data.of(at), rule(data.of(~at))(data.of(at))))
    return float(np.mean(scores))


def factors(platforms: Platforms) -> None:
    """Print centres and width factors that follow from tuning platforms.

    The rule: of the mean of the draws, and of the fitted sum of model and draws, the centre with
    which the intervals of cars score lower in families that took no part; for the loudest line the
    mean of the draws; then, of each statistic, the least factor that holds 90 %. Where the former
    form with its constants refitted scores lower still, it is the better one.
    """
    print(f"{len(platforms)} platforms")
    for state in Information:
        cars = records(platforms, state)
        by_fit = without_family(cars, lambda data: tuned(data, fitted_centre(data)))
        alone = without_family(cars, lambda data: tuned(data, (0.0, 1.0)))
        centre = fitted_centre(cars) if by_fit < alone else (0.0, 1.0)
        print(
            f"{state.value}: score left out {alone:.2f} of draws, {by_fit:.2f} with the centre "
            f"{fitted_centre(cars)}, {without_family(cars, refitted):.2f} of constants: {centre}"
        )
        for statistic in STATISTICS:
            _print_width(records(platforms, state, statistic), centre, statistic)
        _print_width(records(platforms, state, peak=True), (0.0, 1.0), "cars, loudest line")


def _print_width(data: Records, centre: tuple[float, float], words: str) -> None:
    """Print a width factor with its bootstrap interval."""

    def factor(drawn: Records) -> float:
        expected = by_draws(centre, 0.0)(drawn)[0]
        return width(drawn, expected, drawn.below, drawn.above)

    low, high = np.quantile(resampled(data, factor), [0.05, 0.95])
    print(f"  {words}: width {factor(data):.2f} ({low:.2f} to {high:.2f})")


def resampled(data: Records, figure: Callable[[Records], float], times: int = 300) -> RealArray:
    """Return a figure over bootstrap samples of the platforms, drawn within families."""
    generator = np.random.default_rng(1)
    rows = {seed: np.flatnonzero(data.seed == seed) for seed in np.unique(data.seed)}
    of_family = [np.unique(data.seed[data.family == family]) for family in np.unique(data.family)]
    figures = []
    for _ in range(times):
        drawn = [generator.choice(seeds, len(seeds)) for seeds in of_family]
        figures.append(
            figure(data.of(np.concatenate([rows[seed] for each in drawn for seed in each])))
        )
    return np.array(figures)


def figures_of(data: Records, state: Callable[[Records], Judged]) -> dict[str, float]:
    """Return the share held, the bias over the size of the changes [%], score, half width [dB]."""
    expected, low, high = state(data)
    inside = (low <= data.true) & (data.true <= high)
    size = np.average(np.abs(data.true), weights=data.weight)
    large = np.abs(expected) > 1.0
    half = np.median((1.5 * (high - low) / np.abs(expected))[large]) if large.any() else np.nan
    return {
        "held": 100.0 * float(np.average(inside, weights=data.weight)),
        "bias": 100.0 * float(np.average(data.true - expected, weights=data.weight) / size),
        "score": score(data, (expected, low, high)),
        "half": float(half),
    }


def spread(data: Records, state: Callable[[Records], Judged]) -> tuple[float, ...]:
    """Return the 90 % bootstrap intervals of the share held and of the bias [%]."""
    held = resampled(data, lambda drawn: figures_of(drawn, state)["held"])
    bias = resampled(data, lambda drawn: figures_of(drawn, state)["bias"])
    return tuple(float(each) for each in np.quantile([held, bias], [0.05, 0.95], axis=1).T.ravel())


def in_force(state: Information, statistic: str, *, peak: bool) -> Callable[[Records], Judged]:
    """State intervals with the factors of `change_prior`."""
    if peak:
        return by_draws(prior.PEAK_CENTRE, prior.PEAK_WIDTH[state.name])
    widths = {
        "cars": prior.WIDTH,
        "mean of vehicles": prior.MEAN_WIDTH,
        "worst vehicle": prior.WORST_WIDTH,
    }
    return by_draws(prior.CENTRE[state.name], widths[statistic][state.name])


def former(state: Information) -> Callable[[Records], Judged]:
    """State intervals with the former constants."""
    return by_constants(*FORMER[state], 1.0)


def judge(tuning: Platforms, judging: Platforms) -> None:
    """Print what intervals hold in the judging platforms, family by family."""
    for state in Information:
        for statistic in STATISTICS:
            for peak in (False, True) if statistic == "cars" else (False,):
                data = records(judging, state, statistic, peak=peak)
                stated = in_force(state, statistic, peak=peak)
                print(f"== {state.value}, {statistic}{', loudest line' * peak}")
                families = [("mixture", np.ones(len(data.true), dtype=bool))]
                families += [(name, data.family == number) for number, name in enumerate(FAMILIES)]
                for name, at in families:
                    if not at.any():
                        continue
                    own = data.of(at)
                    shown = figures_of(own, stated)
                    low, high, off_low, off_high = spread(own, stated)
                    old = figures_of(own, former(state))
                    print(
                        f"{name:26s} held {shown['held']:3.0f} ({low:.0f} to {high:.0f}), bias "
                        f"{shown['bias']:+5.1f} ({off_low:+.1f} to {off_high:+.1f}), half of 3 dB "
                        f"{shown['half']:.2f}, score {shown['score']:.2f}; former constants hold "
                        f"{old['held']:3.0f}, score {old['score']:.2f}"
                    )
                if not peak:
                    new = figures_of(data, refitted(records(tuning, state, statistic)))
                    print(
                        f"former form refitted: holds {new['held']:.0f}, score {new['score']:.2f}"
                    )


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["draw", "tuning", folder]:
            in_tuning = tuple(family for family in FAMILIES if family not in LEFT_OUT)
            draw(TUNING, N_TUNING, in_tuning, Path(folder))
        case ["draw", "judging", folder]:
            draw(JUDGING, N_JUDGING, FAMILIES, Path(folder))
        case ["factors", folder]:
            factors(read(Path(folder)))
        case ["judge", tuning, judging]:
            judge(read(Path(tuning)), read(Path(judging)))
        case _:
            print(__doc__)
