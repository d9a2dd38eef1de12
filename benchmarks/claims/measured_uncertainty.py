"""Uncertainty that was measured.

On the virtual bench the truth is known. Every replicate draws a fleet from the prior of bodies,
measures noise transfer functions on another day than the average one, instruments the powertrain
anew and runs it; from these data alone the pipeline states 90 % intervals of the mean level of the
lines (SPLV over their number), of the loudest line, and of what a design changes against today's.
Then the truth is looked up. A coverage counts every vehicle of every replicate; the vehicles of a
replicate share their forces, so the standard error in brackets is that over replicates.

Stated: forces as measured, every transfer function measured once, sizes of all errors from the
stated tolerances and priors. Library: two methods on two days, sizes from their differences, forces
from the surfaces of characterised mounts, of a bench with sensors of its own; their error budget is
the library's. These benches are few, each serves several replicates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from claims import Claim, draws
from deboom.bench.fleet import BodySpread, load_fleet, noise_transfer, scattered_body
from deboom.bench.operating_run import OperatingRun, PlannedRun, true_run
from deboom.bench.powertrain import DRAWING, load_bench
from deboom.bench.sensors import (
    ErrorBudget,
    TransferErrors,
    draw_instrumentation,
    measured_noise_transfer,
    measured_run,
)
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import UncertainIndex
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.measurement.uncertainty import method_difference, pivotal_interval
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.surface_forces import Outside, surface_forces
from deboom.runs.campaigns import characterise_virtual
from deboom.vehicles.booming_model import booming_model
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.platform import Platform
from deboom.vehicles.platform_uncertainty import force_sources, transfer_sources
from deboom.vehicles.uncertain_data import UncertainData, UncertaintySource
from write_library import PLATFORM

REPLICATES = draws(60)
DRAWS = 59
BENCHES = 3
"""Characterised for the library."""

GROUP = "U06"
BAND = (20.0, 60.0)
LINES = np.linspace(20.0, 80.0, 241)
GEAR, TORQUE = 5, 220.0
FIRST_FLEET = 101
DESIGN = {"TSM x": 0.85, "Du x": 0.9, "EnM x": 1.1, "GeM z": 0.9}
QUANTITIES = ("level", "loudest line", "change against today's", "mean of all vehicles: change")


def claims() -> list[Claim]:
    """Repeat the measurement and count."""
    rows = []
    for words, arm in (("stated", _stated), ("library", _library)):
        held = np.array([arm(number) for number in range(1, REPLICATES + 1)])
        for place, quantity in enumerate(QUANTITIES):
            per_replicate = held[:, place, 0]
            share = 100 * float(per_replicate.mean())
            error = 100 * float(per_replicate.std(ddof=1)) / np.sqrt(REPLICATES)
            width = np.median(held[:, place, 1])
            rows.append(
                Claim(
                    f"{words}: coverage of the 90 % interval, {quantity}, {REPLICATES} replicates "
                    "[%]",
                    "85 to 95",
                    f"{share:.1f} (± {error:.1f}), half width {width:.3f} dB",
                    85.0 <= share <= 95.0,
                )
            )
    return rows


@cache
def _platform() -> Platform:
    return read_platform(PLATFORM)


@cache
def _run() -> OperatingRun:
    return true_run(load_bench(), PlannedRun(GEAR, TORQUE), LINES)


def _stated(number: int) -> np.ndarray:
    bodies = _Bodies(number)
    return _held(bodies, bodies.measured(1), _measured_case(number), (), transfer_sources())


def _library(number: int) -> np.ndarray:
    bodies = _Bodies(number)
    fleet, sources = _both_ways(bodies)
    parts = _parts(number % BENCHES)
    case = surface_forces(_measured_case(number), parts, Outside.KEEP_MEASURED).load_case
    return _held(bodies, fleet, case, parts, sources)


def _both_ways(bodies: _Bodies) -> tuple[Fleet, Sequence[UncertaintySource]]:
    """Measure by two methods on two days; return their mean and what their difference says."""
    pairs = [
        (first.noise_transfer, other.noise_transfer)
        for first, other in zip(
            bodies.measured(1).vehicles, bodies.measured(2).vehicles, strict=True
        )
    ]
    means = [replace(first, values=(first.values + other.values) / 2) for first, other in pairs]
    vehicles = [Vehicle(n, GROUP, mean) for n, mean in zip(bodies.bodies, means, strict=True)]
    return Fleet(tuple(vehicles)), transfer_sources(method_difference(pairs), "both methods")


class _Bodies:
    """The vehicles of one replicate."""

    def __init__(self, number: int) -> None:
        self.number = number
        drawn = load_fleet(FIRST_FLEET + number)
        self.cabin, self.paths = drawn.cabin, drawn.paths
        self.bodies = {n: b for n, b in drawn.bodies.items() if n.startswith(f"{GROUP}-")}

    @property
    def true(self) -> Fleet:
        """As the vehicles are on average over the days."""
        return self._fleet([noise_transfer(b, self.cabin, LINES) for b in self.bodies.values()])

    def measured(self, method: int) -> Fleet:
        """As one method finds them on a day of its own."""
        generator = np.random.default_rng([self.number, method])
        return self._fleet(
            [
                measured_noise_transfer(
                    noise_transfer(
                        scattered_body(body, BodySpread(), generator), self.cabin, LINES
                    ),
                    TransferErrors(),
                    generator,
                )
                for body in self.bodies.values()
            ]
        )

    def _fleet(self, transfers: Sequence[np.ndarray]) -> Fleet:
        return Fleet(
            tuple(
                Vehicle(
                    name, GROUP, Frf(LINES, values[:, np.newaxis], ("ear",), self.paths, "Pa/N")
                )
                for name, values in zip(self.bodies, transfers, strict=True)
            )
        )


def _case(displacement: np.ndarray, force: np.ndarray) -> LoadCase:
    run = _run()
    return LoadCase(
        name="g5_wot220",
        title="",
        gear=GEAR,
        total_ratio=load_bench().total_ratios[GEAR - 1],
        torque_limit=TORQUE,
        order=load_bench().order_torque.order,
        displacement=Spectrum(LINES, displacement, run.channels, "m"),
        force=Spectrum(LINES, force, run.channels, "N"),
        engine_torque=run.engine_torque,
    )


def _measured_case(number: int) -> LoadCase:
    generator = np.random.default_rng([number, 0])
    budget = ErrorBudget()
    instrumentation = draw_instrumentation(load_bench(), budget, generator)
    measurement = measured_run(instrumentation, _run(), budget, generator)
    return _case(measurement.displacement, measurement.force)


@cache
def _parts(bench: int) -> tuple[CharacterisedMount, ...]:
    options = CharacteriseOptions()
    return characterise_virtual(
        FIRST_FLEET + bench, DRAWING, options, lambda *_: None
    ).result.mounts


def _held(
    bodies: _Bodies,
    fleet: Fleet,
    case: LoadCase,
    parts: Sequence[CharacterisedMount],
    of_transfer: Sequence[UncertaintySource],
) -> np.ndarray:
    """Share of the truth in its interval and median half width, shape (quantity, 2)."""
    mounts = _platform().mounts
    sources = (*of_transfer, *force_sources(mounts, (case,), parts, BAND))
    data = UncertainData(fleet, (case,), sources, BAND)
    measured = booming_model(fleet, mounts, [(case, 1.0)], BAND)
    truth = booming_model(
        bodies.true, mounts, [(_case(_run().displacement, _run().force), 1.0)], BAND
    )
    uncertain = UncertainIndex(measured, data, _platform())
    again = [_quantities(index) for index in uncertain.draws(DRAWS, seed=bodies.number)]
    values, true = _quantities(measured), _quantities(truth)
    shares = []
    for name in QUANTITIES:
        interval = pivotal_interval(values[name], np.array([repeated[name] for repeated in again]))
        shares.append((np.mean(interval.holds(true[name])), np.median(interval.half_width)))
    return np.array(shares)


def _quantities(index) -> Mapping[str, np.ndarray]:
    designs = np.ones((2, len(index.variable_names)))
    for name, factor in DESIGN.items():
        designs[1, index.variable_names.index(name)] = factor
    levels = index.levels(designs)
    mean = levels.mean(axis=2)
    change = mean[1] - mean[0]
    return dict(
        zip(QUANTITIES, (mean[0], levels[0].max(axis=1), change, change.mean()), strict=True)
    )
