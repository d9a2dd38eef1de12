"""Families of cars: bodies, rubber and laboratories, each drawn apart from the others.

The bench's own prior has stiff brackets, mounts as they were tested, and a laboratory that errs as
it states. A family names another kind of body, and factors of rubber and laboratory that differ:
``attachments,stiffness=0.85,noise`` has bodies of that kind, mounts that are softer in the car than
in the test by 15 %, and a laboratory whose noise is drawn. What is not named stays as it is.

Bodies and laboratory belong to the seed of the measurement, rubber to the seed of the truth.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deboom.arrays import AXES, BoolArray, RealArray
from deboom.bench.fleet import BenchFleet, Body, load_fleet
from deboom.bench.powertrain import SIDES, SuspendedBody, VirtualBench
from deboom.bench.sensors import ErrorBudget
from deboom.bench.writing import write_json
from deboom.errors import InputError

BRACKETS = "brackets"
"""Bodies of the bench's own prior, see `deboom.bench.fleet.load_fleet`."""

_Bounds = tuple[float, float]


@dataclass(frozen=True)
class BodyKind:
    """Distribution of the bodies of one kind; bounds are those of log-uniform draws.

    - `modes`: fewest and most modes.
    - `frequency`: natural frequencies [Hz]. `swing`: those of one more mode, twice as live, such as
      of a battery on its bolts; None: there is none.
    - `damping`: damping ratios [1].
    - `shape`: size of the shapes at the mounts, one over the root of a modal mass [kg^-1/2].
    - `stiffness`: of an attachment by itself along one direction [N/m].
    - `panel`: size of the shapes at the panels [kg^-1/2]: it sets the level at the ear.
    - `source`: where the bounds come from.
    """

    modes: tuple[int, int]
    frequency: _Bounds
    damping: _Bounds
    shape: _Bounds
    stiffness: _Bounds
    panel: float
    source: str
    swing: _Bounds | None = None


KINDS: Mapping[str, BodyKind] = {
    "attachments": BodyKind(
        (16, 28), (12.0, 100.0), (0.003, 0.08), (0.015, 0.04), (2.5e6, 7e6), 0.02,
        "attachments on longitudinal members and subframes that give way beside the mounts, as "
        "Courteille et al. found them (European Journal of Mechanics A/Solids 24, 2005), and a "
        "mode per 3 to 5 Hz; bounds by judgement",
    ),
    "light": BodyKind(
        (10, 16), (16.0, 90.0), (0.01, 0.04), (0.03, 0.06), (4e6, 1.5e7), 0.015,
        "a small body of sheet metal, modal masses of 0.3 to 1 t; by judgement",
    ),
    "battery": BodyKind(
        (12, 18), (12.0, 90.0), (0.008, 0.06), (0.008, 0.025), (6e6, 2e7), 0.03,
        "a heavy body whose battery swings on its bolts between 20 and 40 Hz; by judgement",
        swing=(20.0, 40.0),
    ),
    "truck": BodyKind(
        (8, 14), (8.0, 70.0), (0.005, 0.03), (0.008, 0.03), (1e7, 4e7), 0.06,
        "a ladder frame with little damping and stiff brackets; by judgement",
    ),
}  # fmt: skip
"""Kinds of bodies beside `BRACKETS`."""

ATTACHMENT_SPREAD, SHAPE_SPREAD = 0.3, 0.3
"""Of the stiffness from direction to direction, and of the size of a shape from mode to mode,
log-normal [1]; judgement."""

CARRIER_SHARE = 0.5
"""Part of a shape that is common to all mounts along an axis: they stand on one front end [1];
judgement."""

LATERAL = (0.4, 1.0)
"""Shapes along y over those along x and z [1]; judgement."""

FREQUENCY_SCATTER, DAMPING_SCATTER, SHAPE_SCATTER = 0.01, 0.2, 0.1
"""Between cars of one drawing, log-normal, and of shapes over their size as well [1]: levels at the
ear then differ by about as much as in the bench's own fleets."""

VARIANT = 2.0
"""How much more the bodies of other groups differ than cars of one drawing [1]."""


@dataclass(frozen=True)
class Factor:
    """One factor of rubber or laboratory.

    - `low`, `high`: bounds of a stated value and of a draw.
    - `usual`: value where it is not named.
    - `ratio`: whether it is drawn log-uniformly; else uniformly.
    - `of_truth`: whether the seed of the truth draws it.
    - `meaning`: what it is, with its unit. `source`: where its bounds come from.
    """

    low: float
    high: float
    usual: float
    ratio: bool
    of_truth: bool
    meaning: str
    source: str


FACTORS: Mapping[str, Factor] = {
    "stiffness": Factor(
        0.85, 1.15, 1.0, True, True,
        "stiffness of all mounts in the car over that in the test [1]; the loss factor follows",
        "10 K warmer or colder, or some years older; by judgement, on temperature and loss see "
        "Gent, Engineering with Rubber, 3rd ed., Hanser, 2012",
    ),
    "apart": Factor(
        0.0, 0.1, 0.0, False, True,
        "half width within which each mount's stiffness in the car differs from the others' [1]",
        "a tolerance of 5 degrees of hardness either way; by judgement, on hardness and stiffness "
        "see the same book",
    ),
    "payne": Factor(
        0.4, 3.0, 1.0, True, True,
        "storage drop and loss of the filler's network over those of the bench's prior [1]",
        "from hardly to strongly filled rubber; by judgement, on bushings see García Tárrago et "
        "al., Polymer Testing 26, 2007, and Sjöberg, doctoral thesis, KTH, 2002",
    ),
    "noise": Factor(
        0.5, 4.0, 1.0, True, False,
        "noise of runs and functions from line to line over the stated one [1]; calibration and "
        "places stay",
        "receptances with 2.5 to 20 % noise, as coherences of 0.99 to 0.7 leave over five averages "
        "(Bendat and Piersol)",
    ),
    "gaps": Factor(
        0.0, 0.1, 0.0, False, False,
        "share of the lines that nobody measured [1]",
        "mains and idle harmonics that a laboratory cuts out; by judgement",
    ),
    "dead": Factor(
        0.0, 1.0, 0.0, False, False,
        "1: one accelerometer of the powertrain failed, and the laboratory leaves it out [1]",
        "by judgement",
    ),
}  # fmt: skip
"""What a family may name beside its kind of body."""

LOSS_PER_STIFFNESS = 1.5
"""Exponent by which the loss factor in the car over that in the test follows the ratio of their
stiffnesses: cold rubber loses more [1]; judgement."""


@dataclass(frozen=True, eq=False)
class Family:
    """One draw of a family.

    - `kind`: of `KINDS`, or `BRACKETS`.
    - `values`: each of `FACTORS` → its value.
    - `seed`, `truth_seed`: of measurement, bodies and laboratory; of powertrain and rubber.
    """

    kind: str
    values: Mapping[str, float]
    seed: int
    truth_seed: int

    def fleet(self, body_scatter: float = 1.0) -> BenchFleet:
        """Return the fleet that belongs to the seed, see `deboom.bench.fleet.load_fleet`."""
        if self.kind == BRACKETS:
            return load_fleet(self.seed, body_scatter)
        air = load_fleet(1)
        generator = _generator(self.seed, self.kind)
        base = _draw_base(KINDS[self.kind], air, generator)
        bodies: dict[str, Body] = {}
        group, of_group = "", base
        for name in air.bodies:
            if group != (group := name.rpartition("-")[0]):
                of_group = _scattered(base, VARIANT, generator) if bodies else base
            bodies[name] = _scattered(of_group, body_scatter, generator)
        return replace(air, bodies=bodies)

    def bench(self, bench: VirtualBench) -> VirtualBench:
        """Return a bench whose mounts have the family's dependence on the amplitude."""
        if (factor := self.values["payne"]) == 1.0:
            return bench
        return replace(
            bench,
            powertrain=_with_filler(bench.powertrain, factor),
            wheel_end=_with_filler(bench.wheel_end, factor),
        )

    def in_car(self, n_mount: int) -> tuple[RealArray, RealArray]:
        """Return what differs in the car from the test.

        - `n_mount`: mounts of the powertrain.
        - returns (n_channel,) twice: stiffness, and loss factor, over those in the test [1];
          channels as in `deboom.bench.operating_run.CoupledRun`.
        """
        apart = self.values["apart"]
        each = _generator(self.truth_seed, "mounts").uniform(1 - apart, 1 + apart, n_mount + 1)
        stiffness = self.values["stiffness"] * np.repeat(each, [len(AXES)] * n_mount + [len(SIDES)])
        loss = self.values["stiffness"] ** LOSS_PER_STIFFNESS
        return np.asarray(stiffness), np.full(stiffness.shape, loss)

    def budget(self, budget: ErrorBudget) -> ErrorBudget:
        """Return an error budget with the laboratory's noise."""
        noisy = {
            f"{quantity}_{level}": self.values["noise"] * getattr(budget, f"{quantity}_{level}")
            for quantity in ("acceleration", "force")
            for level in ("own", "norm", "floor")
        }
        return replace(budget, **noisy)

    def measured(self, frequency: RealArray) -> BoolArray:
        """Say which lines were measured; the first and the last one always are."""
        kept = _generator(self.seed, "gaps").random(frequency.size) >= self.values["gaps"]
        kept[[0, -1]] = True
        return np.asarray(kept)

    def dead_sensor(self, n_sensor: int) -> int | None:
        """Return the number of the accelerometer that failed, if one did."""
        if self.values["dead"] < 0.5:
            return None
        return int(_generator(self.seed, "dead sensor").integers(n_sensor))

    def write_truth(self, folder: Path) -> None:
        """Write what was drawn as ``family.json``."""
        truth = {"kind": self.kind, **self.values}
        write_json(folder / "family.json", truth)

    def refuse(self, names: tuple[str, ...], what: str) -> None:
        """Refuse factors that a kind of measurement does not have; raises InputError."""
        for name in names:
            if self.values[name] != FACTORS[name].usual:
                raise InputError(f"{what} has no '{name}': leave it out of the family")


def draw_family(words: str, seed: int, truth_seed: int) -> Family:
    """Draw what a family leaves open.

    Parameters
    ----------
    words : str
        Names, separated by commas: at most one of `KINDS` or `BRACKETS`, and any of `FACTORS`,
        either with a value, as in ``stiffness=0.9``, or to be drawn. Nothing: the bench's prior.
    seed, truth_seed : int
        Of measurement, bodies and laboratory, and of rubber; from 1.

    Raises
    ------
    InputError
        A name that is neither or comes twice, a value out of its bounds.
    """
    kinds, values = [], {name: factor.usual for name, factor in FACTORS.items()}
    stated: list[str] = []
    for word in filter(None, (word.strip() for word in words.split(","))):
        name, equals, value = (part.strip() for part in word.partition("="))
        if name in (BRACKETS, *KINDS) and not equals:
            kinds.append(name)
        elif name in FACTORS:
            owner = truth_seed if FACTORS[name].of_truth else seed
            values[name] = _value(name, value) if equals else _drawn(name, owner)
        else:
            raise InputError(
                f"unknown family '{word}': name one kind of body ({', '.join((BRACKETS, *KINDS))}) "
                f"and any factors ({', '.join(FACTORS)}), as in attachments,stiffness=0.9,noise"
            )
        stated.append(name)
    if len(kinds) > 1 or len(set(stated)) < len(stated):
        raise InputError(
            f"family '{words}' names something twice: one kind of body, each factor once"
        )
    return Family(kinds[0] if kinds else BRACKETS, values, seed, truth_seed)


def _value(name: str, text: str) -> float:
    """Read a stated value of a factor."""
    factor = FACTORS[name]
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not factor.low <= value <= factor.high:
        raise InputError(
            f"family factor {name}={text}: {factor.meaning}; give {factor.low:g} to {factor.high:g}"
        )
    return value


def _drawn(name: str, seed: int) -> float:
    factor, generator = FACTORS[name], _generator(seed, name)
    if factor.ratio:
        return float(log_uniform(generator, (factor.low, factor.high)))
    return float(generator.uniform(factor.low, factor.high))


def _generator(seed: int, purpose: str) -> np.random.Generator:
    """Give every purpose draws of its own, so that naming one factor leaves the others alone."""
    return np.random.default_rng([seed, zlib.crc32(f"family {purpose}".encode())])


def log_uniform(
    generator: np.random.Generator, bounds: _Bounds, size: int | None = None
) -> RealArray:
    """Draw numbers whose logarithms are uniform between bounds, one or (size,)."""
    low, high = np.log(bounds)
    return np.asarray(np.exp(generator.uniform(low, high, size)))


def _draw_base(kind: BodyKind, fleet: BenchFleet, generator: np.random.Generator) -> Body:
    """Draw the body of a platform."""
    n_path, n_panel = len(fleet.paths), fleet.cabin.panel_areas.size
    n_mode = int(generator.integers(kind.modes[0], kind.modes[1] + 1))
    frequencies = log_uniform(generator, kind.frequency, n_mode)
    size = log_uniform(generator, kind.shape)
    sizes = size * np.exp(SHAPE_SPREAD * generator.normal(size=n_mode))
    if kind.swing is not None:
        frequencies[0], sizes[0] = log_uniform(generator, kind.swing), 2.0 * size
    axis = [AXES.index(path[-1]) for path in fleet.paths]
    of_all = generator.normal(size=(n_mode, len(AXES)))[:, axis]
    of_path = np.sqrt(1.0 - CARRIER_SHARE**2) * generator.normal(size=(n_mode, n_path))
    at_paths = sizes[:, np.newaxis] * (CARRIER_SHARE * of_all + of_path)
    at_paths[:, np.array(axis) == AXES.index("y")] *= generator.uniform(*LATERAL)
    stiffness = log_uniform(generator, kind.stiffness) * np.exp(
        ATTACHMENT_SPREAD * generator.normal(size=n_path)
    )
    stiffness[-1] *= len(SIDES)  # both wishbone mounts as one path
    order = np.argsort(frequencies)
    return Body(
        frequencies=frequencies[order],
        damping_ratios=log_uniform(generator, kind.damping, n_mode),
        shapes_at_paths=at_paths[order],
        shapes_at_panels=kind.panel * generator.normal(size=(n_mode, n_panel)),
        local_stiffness=stiffness,
    )


def _scattered(body: Body, scatter: float, generator: np.random.Generator) -> Body:
    """Draw another car of the same drawing."""
    n_path = body.shapes_at_paths.shape[1]

    def normal(shape: tuple[int, ...] | int, deviation: float) -> RealArray:
        return np.asarray(scatter * deviation * generator.normal(size=shape))

    def around(shapes: RealArray) -> RealArray:
        return np.asarray(shapes + normal(shapes.shape, SHAPE_SCATTER * float(shapes.std())))

    at_paths = around(body.shapes_at_paths) * np.exp(normal(n_path, SHAPE_SCATTER))
    n_mode = body.frequencies.size
    return replace(
        body,
        frequencies=body.frequencies * np.exp(normal(n_mode, FREQUENCY_SCATTER)),
        damping_ratios=body.damping_ratios * np.exp(normal(n_mode, DAMPING_SCATTER)),
        shapes_at_paths=at_paths,
        shapes_at_panels=around(body.shapes_at_panels),
    )


def _with_filler(body: SuspendedBody, factor: float) -> SuspendedBody:
    """Scale the filler's network of every law."""
    mounts = []
    for mount in body.mounts:
        laws = tuple(
            replace(
                law,
                payne_storage=factor * law.payne_storage,
                payne_loss=factor * law.payne_loss,
            )
            for law in mount.laws
        )
        mounts.append(replace(mount, laws=laws))
    return replace(body, mounts=tuple(mounts))
