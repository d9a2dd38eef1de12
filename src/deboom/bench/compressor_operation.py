"""The running compressor: what shakes it, its sweeps and a run-up as they are recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_rig import Laboratory, hit_plan, laboratory
from deboom.bench.compressor_truth import COMPRESSOR_DATA, Compressor, CompressorPlan, Hose
from deboom.bench.powertrain import read_data
from deboom.bench.signals import complex_normal, over_time, rotations, tacho_pulses
from deboom.choices import CalibrationLevel, HoseCase
from deboom.errors import InputError
from deboom.physics.rigid_body import skew

PRESSURES = (7.5, 13.5)
"""Of the gas at the outlet [bar]; the frozen data say how gas forces grow from first to second."""

LARGEST_SWEEPS = 200
AMPLITUDE_TOLERANCE = 1e-12
"""Between two sweeps of the search for the amplitudes [m]."""

LINE_STEP = 1.0
"""Of the sweeps [Hz]."""

SCATTER = 3e-3
"""Deviation of a complex amplitude from run to run, over the amplitude [1]; of the study."""

RATE = 2000.0
"""Samples per second of a record over time [Hz]."""

FIRST, LAST, DURATION, GRID_STEP = 49.5, 60.5, 11.0, 0.5
"""Rotation in a record over time [Hz], its duration [s], and the step between the steady states
that the run passes [Hz]. All of 1000 to 9000 1/min at 1 Hz/s would take more than two minutes and
20 MB; 50 to 60 Hz lie above the modes of the mounts, where a run-up of 1 Hz/s passes through steady
states only; a filter of 3 Hz leaves these lines."""

OTHER_ORDERS = ((2, 0.20, 0.7), (3, 0.10, -1.1))
"""Order, amplitude per amplitude of the first, and phase against it [rad]: gas pulsation."""

PULSE_SHARE, EDGE_SAMPLES = 0.5, 1.0
"""Share of a revolution that the tacho's pulse takes [1], and width of its edges in samples [1]."""


@dataclass(frozen=True)
class OperationPlan:
    """The compressor, what is done to it and what is recorded.

    - `compressor`: compressor as struck, without hoses, rigid; softening there is that of the hits.
    - `hoses`: True standard hoses.
    - `hammer_with_hoses`: strike it with the standard hoses as well.
    - `mount_storage`, `mount_loss`: real and imaginary part of the mounts' dynamic stiffness in
      operation, over those under the hammer [1].
    - `softening`: mounts soften with their amplitude while it runs.
    - `sense`: 1: the rotor turns from y to z; −1: from z to y.
    - `time_record`: whether a short run-up is recorded over time with tacho as well.
    - raises InputError: a factor that is not positive, another sense, a compressor with hoses or of
      two parts.
    """

    compressor: CompressorPlan = field(default_factory=CompressorPlan)
    hoses: HoseCase = HoseCase.SCATTERED
    hammer_with_hoses: bool = False
    mount_storage: float = 1.0
    mount_loss: float = 1.0
    softening: bool = False
    sense: int = 1
    time_record: bool = False

    def __post_init__(self) -> None:
        for name in ("mount_storage", "mount_loss"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"{name.replace('_', ' ')} {value} is no factor on a stiffness: give a "
                    "positive number, such as 0.9"
                )
        if self.sense not in (1, -1):
            raise InputError(
                f"sense {self.sense} is no sense of rotation: give 1 (from y to z) or -1"
            )
        if self.compressor.hoses is not None or self.compressor.flexible_body:
            raise InputError(
                "a running compressor is planned rigid and without hoses; its hoses are `hoses`"
            )


@dataclass(frozen=True)
class Unbalance:
    """One mass [kg] that goes round off the axis x, at a radius and an arm along x [m].

    The phase is the angle ahead of the tacho's mark, in the sense of rotation [rad].
    """

    name: str
    mass: float
    radius: float
    arm: float
    phase: float

    @property
    def rotating(self) -> complex:
        """``m r e^{jφ}`` [kg m]."""
        return complex(self.mass * self.radius * np.exp(1j * self.phase))


PARTS = (
    Unbalance("eccentric shaft", 0.031, 4.2e-3, -0.035, 0.0),
    Unbalance("orbiting scroll", 0.185, 4.2e-3, -0.062, 0.0),
    Unbalance("bushing", 0.022, 4.2e-3, -0.055, 0.12),
    Unbalance("rotor", 0.9, 9e-6, 0.020, 2.1),
)
"""As built; judgement. What they leave is what the two balance weights get wrong."""

WEIGHTS = (("balance weight", 0.017, -0.028), ("counterweight", 0.021, 0.064))
"""Name, radius [m] and arm [m]; mass and phase follow from what shall be left."""


@dataclass(frozen=True)
class Source:
    """All that acts on the compressor from inside at the first order.

    - `unbalances`: masses that go round.
    - `gas_force`, `gas_moment`: gas force along x [N], and moment about x [N m].
    - `rotating_gas_force`: gas force in the plane of y and z that turns with the rotor [N].
    - `rotor_inertia`: polar moment of the rotor [kg m²].
    - `sense`: 1 from y to z, −1 from z to y.
    """

    unbalances: tuple[Unbalance, ...]
    gas_force: complex
    gas_moment: complex
    rotating_gas_force: complex
    rotor_inertia: float
    sense: int

    @property
    def static_unbalance(self) -> complex:
        """Sum of the unbalances [kg m]."""
        return sum((part.rotating for part in self.unbalances), 0j)

    @property
    def dynamic_unbalance(self) -> complex:
        """Sum of arms times unbalances, about the virtual point [kg m²]."""
        return sum((part.arm * part.rotating for part in self.unbalances), 0j)

    def load(self, frequency: RealArray, gas_factor: float = 1.0) -> ComplexArray:
        """Return the load at the virtual point over the frequency of rotation, (f, 6) [N, N m].

        Phases count from the tacho's mark; force and moment of the gas have a factor, for its
        pressure.

        ``e^{jωt}`` along y is ``∓j e^{jωt}`` along z. A force F at x = a has the moment
        ``a e_x × F``.
        """
        squared = (2 * np.pi * np.asarray(frequency)) ** 2
        round_x = np.array([0.0, 1.0, -1j * self.sense])
        load = np.zeros((squared.size, 6), dtype=complex)
        load[:, 0] = gas_factor * self.gas_force
        load[:, 3] = gas_factor * self.gas_moment
        load[:, :3] += gas_factor * self.rotating_gas_force * round_x
        for part in self.unbalances:
            force = np.multiply.outer(squared, part.rotating * round_x)
            load[:, :3] += force
            load[:, 3:] += np.cross([part.arm, 0.0, 0.0], force)
        return load

    def gyroscopic(self, frequency: RealArray) -> ComplexArray:
        """Return what the turning rotor adds to the dynamic stiffness, (f, 6, 6) [N m/rad].

        Hermitian, so that it does no work, but not symmetric.

        The rotor's angular momentum ``h = ±J ω e_x`` turns with the body, which takes the moment
        ``θ̇ × h = ∓jJ ω² skew(e_x) θ``: ``±jJ skew(e_x)`` in the apparent mass.
        """
        squared = (2 * np.pi * np.asarray(frequency)) ** 2
        term = np.zeros((6, 6), dtype=complex)
        term[3:, 3:] = -1j * self.sense * self.rotor_inertia * skew([1.0, 0.0, 0.0])
        return np.multiply.outer(squared, term)


def true_source(sense: int = 1) -> Source:
    """Return the source of the frozen data; two balance weights leave its unbalances."""
    operation = read_data(COMPRESSOR_DATA)["operation"]

    def number(key: str) -> complex:
        return complex(*operation[key])

    left = np.array([number("static_unbalance_kg_m"), number("dynamic_unbalance_kg_m2")])
    for part in PARTS:
        left = left - part.rotating * np.array([1.0, part.arm])
    arms = np.array([[1.0, 1.0], [arm for *_, arm in WEIGHTS]])
    weights = tuple(
        Unbalance(name, float(abs(needed) / radius), radius, arm, float(np.angle(needed)))
        for (name, radius, arm), needed in zip(WEIGHTS, np.linalg.solve(arms, left), strict=True)
    )
    return Source(
        unbalances=PARTS + weights,
        gas_force=number("gas_force_x_N"),
        gas_moment=number("gas_moment_x_N_m"),
        rotating_gas_force=number("gas_force_rotating_N"),
        rotor_inertia=operation["rotor_polar_inertia_kg_m2"],
        sense=sense,
    )


@dataclass(frozen=True, eq=False)
class Running:
    """Steady states over speed.

    - `load` (f, 6): load of the source at the virtual point [N, N m].
    - `dynamic_stiffness` (f, 6, 6): dynamic stiffness with mounts as they are then, hoses and the
      turning rotor [N/m, N/rad, N m/rad].
    - `displacement` (f, 6): displacement of the virtual point [m, rad].
    - `amplitudes`, `factors` (f, n_mount): largest displacement of the body at each mount over a
      turn [m], and softening [1].
    """

    load: ComplexArray
    dynamic_stiffness: ComplexArray
    displacement: ComplexArray
    amplitudes: RealArray
    factors: RealArray


def running(
    compressor: Compressor, source: Source, frequency: RealArray, gas_factor: float = 1.0
) -> Running:
    """Run a rigid compressor at many speeds, with mounts in the state of operation and its hoses.

    ``Z(f, s) x = F`` with ``s_i`` the largest stroke of each mount: a fixed point per speed, taken
    half-way at a time, since near a resonance stiffness and stroke drive each other.
    """
    load = source.load(frequency, gas_factor)
    turning = source.gyroscopic(frequency)
    amplitudes = np.zeros((len(load), len(compressor.positions)))
    factors = np.ones_like(amplitudes)
    for _ in range(LARGEST_SWEEPS):
        if compressor.softening is not None:
            factors = compressor.softening.factor(amplitudes)
        stiffness = compressor.dynamic_stiffness(frequency, factors) + turning
        displacement = np.asarray(
            np.linalg.solve(stiffness, load[:, :, None])[:, :, 0], dtype=np.complex128
        )
        seen = strokes(displacement @ compressor.mount_rows.T)
        settled = np.all(np.abs(seen - amplitudes) < AMPLITUDE_TOLERANCE)
        if settled or compressor.softening is None:
            return Running(load, stiffness, displacement, seen, factors)
        amplitudes = (amplitudes + seen) / 2
    raise ArithmeticError("the amplitudes of a running compressor do not settle")


def strokes(displacement: ComplexArray) -> RealArray:
    """Return the largest length over a turn of vectors that each go round an ellipse, (f, n) [m].

    Of complex amplitudes (f, 3 n): ``|Re(x e^{jφ})|² = (x*·x + Re(e^{2jφ} x·x))/2`` is largest at
    ``(|x|² + |x·x|)/2``.
    """
    vectors = displacement.reshape(len(displacement), -1, 3)
    squares = np.sum(np.abs(vectors) ** 2, axis=2) + np.abs(np.sum(vectors**2, axis=2))
    return np.asarray(np.sqrt(squares / 2))


@dataclass(frozen=True, eq=False)
class Operation:
    """A compressor with its standard hoses that runs in its laboratory, and what shakes it."""

    laboratory: Laboratory
    source: Source


@dataclass(frozen=True, eq=False)
class Sweep:
    """One sweep over speed at a pressure of the gas [bar]; long soft hoses are none."""

    pressure: float
    hoses: tuple[Hose, ...]

    @property
    def state(self) -> Literal["soft", "standard"]:
        """State of the hoses, as the files call it."""
        return "standard" if self.hoses else "soft"

    @property
    def name(self) -> str:
        """Name, such as ``standard 7.5 bar``."""
        return f"{self.state} {self.pressure:g} bar"


@dataclass(frozen=True, eq=False)
class TrueSweep(Sweep):
    """One sweep on the rig as it truly is.

    - `frequency` (f,): frequency of the rotation [Hz].
    - `running`: steady states.
    - `acceleration` (f, n_channel): channels without noise [m/s²].
    """

    frequency: RealArray
    running: Running
    acceleration: ComplexArray


def operation(
    seed: int, level: CalibrationLevel, plan: OperationPlan, *, noise_free: bool = False
) -> Operation:
    """Set up the running compressor of a seed; parameters as for `laboratory`.

    The mounts are in another state than the hammer found them in. A hyperbola times a factor is one
    again: ``c (v∞ − 1/(m f + w₀)) = c v∞ − 1/(m f/c + w₀/c)``.
    """
    with_hoses = replace(plan.compressor, hoses=plan.hoses, softening=plan.softening)
    rig = laboratory(seed, level, with_hoses, noise_free=noise_free)
    factors = np.array([plan.mount_storage, plan.mount_loss])[:, None]
    factors = np.hstack([factors, 1 / factors, 1 / factors])
    gain = (rig.compressor.gain.reshape(2, 3) * factors).ravel()
    changed = replace(rig, compressor=replace(rig.compressor, gain=gain))
    return Operation(changed, true_source(plan.sense))


def speeds() -> RealArray:
    """Return the lines of the frozen sweeps, 1000 to 9000 1/min [Hz]."""
    low, high = read_data(COMPRESSOR_DATA)["operation"]["frequency_Hz"]
    return np.arange(low, high + LINE_STEP / 2, LINE_STEP)


def gas_factor(pressure: float) -> float:
    """Return the factor of one of `PRESSURES` on force and moment of the gas [1]."""
    second: float = read_data(COMPRESSOR_DATA)["operation"]["second_pressure_gas_factor"]
    return (1.0, second)[PRESSURES.index(pressure)]


def true_sweep(
    running_rig: Operation, pressure: float, *, soft: bool, frequency: RealArray
) -> TrueSweep:
    """Run the compressor at one of `PRESSURES` [bar] over `frequency` (f,) [Hz].

    Long soft hoses have masses on them and are mechanically absent.
    """
    rig, compressor = running_rig.laboratory, running_rig.laboratory.compressor
    if soft:
        compressor = replace(compressor, hoses=())
    run = running(compressor, running_rig.source, frequency, gas_factor(pressure))
    squared = (2 * np.pi * frequency[:, np.newaxis]) ** 2
    seen = -squared * run.displacement @ rig.placed.response_rows(rig.sheet).T
    return TrueSweep(pressure, compressor.hoses, frequency, run, seen)


def floor(frequency: RealArray) -> RealArray:
    """Return the deviation of a complex amplitude without signal, shape (f,) [m/s²]."""
    recorder = hit_plan()
    return np.asarray(recorder.response_noise * np.sqrt(1 + (recorder.corner / frequency) ** 2))


def measured(sweep: TrueSweep, generator: np.random.Generator) -> ComplexArray:
    """Return the order spectra of a sweep with scatter and noise, shape (f, n_channel) [m/s²]."""
    shape = sweep.acceleration.shape
    scatter, noise = (complex_normal(shape, generator) / np.sqrt(2) for _ in range(2))
    scattered = sweep.acceleration * (1 + SCATTER * scatter)
    return np.asarray(scattered + floor(sweep.frequency)[:, np.newaxis] * noise)


def run_up(
    running_rig: Operation, pressure: float, generator: np.random.Generator | None
) -> tuple[RealArray, RealArray]:
    """Run up with soft hoses and record over time; without a generator there is no noise.

    The tacho (n_sample,) has one pulse per revolution, 0 to 1, and the rotor's mark is on the y
    axis half-way up its edge; the acceleration is (n_sample, n_channel) [m/s²].
    """
    grid = np.arange(FIRST, LAST + GRID_STEP / 2, GRID_STEP)
    steady = true_sweep(running_rig, pressure, soft=True, frequency=grid).acceleration
    time = np.arange(round(DURATION * RATE)) / RATE
    slope = (LAST - FIRST) / DURATION
    # the record starts between two pulses
    angle = 2 * np.pi * (FIRST * time + slope * time**2 / 2 - 0.5)
    turning = rotations(angle, 1, OTHER_ORDERS)
    speed, level = FIRST + slope * time, float(floor(grid).mean())
    turns = angle / (2 * np.pi)
    tacho = tacho_pulses(turns, EDGE_SAMPLES * np.gradient(turns), PULSE_SHARE)
    return tacho, over_time((grid, steady), speed, turning, level, RATE, generator)
