"""Mounts from the car alone, on virtual cars of five kinds of bodies.

Four cars of each kind, with drawn powertrains and mounts, rubber that is softer or harder in the
car than on the bench, and the sensors and hammer of a good laboratory. A direction is identified by
the rule of `deboom.mounts.mounts_in_car`; its interval holds a line if the true stiffness of that
run and line lies in it. Designs are picked along the gradient of a platform that was measured on
the test bench, and of the same with the load case of the car in place of the bench's; both are
driven in five cars by the bench's own equations. Seeds and kinds were named before any of these
cars was drawn; bands, weights and tolerances were set on others.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from claims import Claim, at_least, at_most, between, draws, in_processes, reported
from deboom.arrays import RealArray
from deboom.bench.families import draw_family
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import DRAWING
from deboom.bench.vehicle_writer import write_vehicle
from deboom.files.platform import read_platform
from deboom.runs.campaigns import mounts_in_given_car
from expected_change import BODIES, RUN, _driven
from samples.driven_cars import CASE, GROUP, coupled_model, quieter_design

FIRST, APART, CARS = 6000, 100, 4
"""Seed of the first car, between those of two kinds of bodies, and cars of each kind."""
WITHIN = {"x": 0.10, "z": 0.20}
"""Error of |K| that an identified direction may have [1]."""


@dataclass(frozen=True, eq=False)
class Judged:
    """One car: per direction whether it is identified, error and width of each line; gains [dB]."""

    directions: tuple[str, ...]
    identified: RealArray
    error: RealArray
    half_width: RealArray
    gain_of_bench: RealArray
    gain_of_car: RealArray

    def along(self, axis: str) -> RealArray:
        """Say which directions of an axis are identified."""
        return self.identified & np.array([name[-1] == axis for name in self.directions])


def claims() -> list[Claim]:
    """Measure twenty cars; two processes."""
    cases = [
        (kind, FIRST + APART * number + car)
        for number, kind in enumerate(BODIES)
        for car in range(draws(CARS))
    ]
    cars = in_processes(_judged, *zip(*cases, strict=True))
    rows = []
    for axis, bound in WITHIN.items():
        errors = np.concatenate([np.median(car.error, axis=0)[car.along(axis)] for car in cars])
        every = sum(name[-1] == axis for car in cars for name in car.directions)
        held = np.concatenate(
            [(car.error <= car.half_width)[:, car.along(axis)].ravel() for car in cars]
        )
        rows += [
            reported(
                f"directions along {axis} that are identified",
                f"{errors.size} of {every}, wrong by {100 * np.median(errors):.1f} % in the median",
            ),
            at_least(
                f"identified along {axis}: share within {100 * bound:.0f} % [%]",
                90,
                [100 * float(np.mean(errors <= bound))],
                0,
            ),
            between(
                f"identified along {axis}: lines whose truth lies in the 90 % interval [%]",
                (85, 97),
                [100 * float(held.mean())],
                0,
            ),
        ]
    bench, car = (
        np.array([each.mean() for each in gains])
        for gains in zip(*((c.gain_of_bench, c.gain_of_car) for c in cars), strict=True)
    )
    return [
        *rows,
        at_most(
            "directions along y that are identified, of 60",
            6,
            [float(sum(int(each.along("y").sum()) for each in cars))],
            0,
        ),
        at_least(
            "gain in true cars of designs by the car's data, over those by the bench's: mean [%]",
            90,
            [100 * float(car.mean() / bench.mean())],
            0,
        ),
        reported(
            "the same of each platform [%]",
            f"{100 * np.median(car / bench):.0f} ({100 * np.min(car / bench):.0f} to "
            f"{100 * np.max(car / bench):.0f})",
        ),
    ]


def _judged(kind: str, seed: int) -> Judged:
    words = f"{kind},stiffness,apart"
    family = draw_family(words, seed, seed)
    with tempfile.TemporaryDirectory() as scratch:
        platform = read_platform(
            write_platform(
                Path(scratch) / "platform",
                seed,
                truth_seed=seed,
                load_cases=RUN,
                groups=(GROUP,),
                family=words,
            )
        )
        folder = Path(scratch) / "car"
        write_vehicle(folder, seed, parts=DRAWING, truth_seed=seed, family=words)
        measured = mounts_in_given_car(folder, 1, lambda *_: None)
    result = measured.result
    truth = np.vstack([measured.truth[run.name] for run in result.runs])
    (case,) = [case for case in result.load_cases if case.name == CASE]
    model = coupled_model(platform, platform.fleet)
    of_car = coupled_model(replace(platform, load_cases=(case,)), platform.fleet)
    picks = [quieter_design(model), quieter_design(of_car)]
    designs = np.array([np.ones_like(picks[0]), *picks])
    levels = _driven(family, platform.fleet, designs, model.frequency)[:, 0]
    return Judged(
        directions=result.directions,
        identified=np.array(list(result.identified.values())),
        error=np.abs(np.abs(result.stiffness) / np.abs(truth) - 1),
        half_width=np.vstack([run.half_width for run in result.runs]),
        gain_of_bench=levels[0] - levels[1],
        gain_of_car=levels[0] - levels[2],
    )
