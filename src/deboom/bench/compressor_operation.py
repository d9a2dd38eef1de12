"""The running compressor: its unbalance and gas torque, sweeps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import expit

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_rig import Laboratory, hit_plan, laboratory
from deboom.bench.compressor_truth import (
    COMPRESSOR_DATA,
    CalibrationLevel,
    Compressor,
    CompressorPlan,
    Hose,
    HoseCase,
)
from deboom.bench.frozen import freeze_arrays
from deboom.bench.powertrain import read_data
from deboom.errors import InputError
from deboom.physics.rigid_body import skew

PRESSURES = (7.5, 13.5)
"""Of the gas at the outlet [bar]; the frozen data say how gas forces grow from first to second."""


@dataclass(frozen=True)
class OperationPlan:
    """The compressor, what is done to it and what is recorded.

    Parameters
    ----------
    compressor : CompressorPlan
        As struck, without hoses, rigid; softening there is that of the hits.
    hoses : HoseCase
        The true standard hoses.
    hammer_with_hoses : bool
        Strike it with the standard hoses as well.
    mount_storage, mount_loss : float
        Real and imaginary part of the mounts' dynamic stiffness in operation, over those under the
        hammer [1].
    softening : bool
        Mounts soften with their amplitude while it runs.
    sense : int
        1: the rotor turns from y to z; −1: from z to y.
    time_record : bool
        One short run-up over time with tacho as well.

    Raises
    ------
    InputError
        A factor that is not positive, another sense, a compressor with hoses or of two parts.
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

    @property
    def struck_with_hoses(self) -> CompressorPlan:
        """The compressor under the hammer with its standard hoses."""
        return replace(self.compressor, hoses=self.hoses)

    @property
    def running_with_hoses(self) -> CompressorPlan:
        """The compressor with its standard hoses, mounts as they are in operation."""
        return replace(self.compressor, hoses=self.hoses, softening=self.softening)


@dataclass(frozen=True)
class Unbalance:
    """One mass that goes round off the axis x.

    Parameters
    ----------
    name : str
        Such as ``orbiting scroll``.
    mass : float
        [kg]
    radius : float
        From the axis [m].
    arm : float
        Along x, from the virtual point [m].
    phase : float
        Angle ahead of the tacho's mark, in the sense of rotation [rad].
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

    Parameters
    ----------
    unbalances : tuple of Unbalance
    gas_force : complex
        Along x [N].
    gas_moment : complex
        About x [N m].
    rotating_gas_force : complex
        In the plane of y and z; it turns with the rotor [N].
    rotor_inertia : float
        Polar moment of the rotor [kg m²].
    sense : int
        1 from y to z, −1 from z to y.
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
        """Return the load at the virtual point, source by source.

        Parameters
        ----------
        frequency : array, shape (f,)
            Of the rotation [Hz].
        gas_factor : float
            On force and moment of the gas, which grow with its pressure [1].

        Returns
        -------
        array, shape (f, 6)
            Complex amplitude, phase from the tacho's mark [N, N m].

        Notes
        -----
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
        """Return what the turning rotor adds to the dynamic stiffness.

        Parameters
        ----------
        frequency : array, shape (f,)
            Of the rotation [Hz].

        Returns
        -------
        array, shape (f, 6, 6)
            Hermitian, so that it does no work, but not symmetric [N/m, N/rad, N m/rad].

        Notes
        -----
        The rotor's angular momentum ``h = ±J ω e_x`` turns with the body, which takes the moment
        ``θ̇ × h = ∓jJ ω² skew(e_x) θ``: ``±jJ skew(e_x)`` in the apparent mass.
        """
        squared = (2 * np.pi * np.asarray(frequency)) ** 2
        term = np.zeros((6, 6), dtype=complex)
        term[3:, 3:] = -1j * self.sense * self.rotor_inertia * skew([1.0, 0.0, 0.0])
        return np.multiply.outer(squared, term)


def true_source(sense: int = 1) -> Source:
    """Return the source of the frozen data, built from six unbalances that leave its sums.

    Parameters
    ----------
    sense : int
        1 from y to z, −1 from z to y.
    """
    operation = read_data(COMPRESSOR_DATA)["operation"]

    def number(key: str) -> complex:
        return complex(*operation[key])

    return Source(
        unbalances=balanced(number("static_unbalance_kg_m"), number("dynamic_unbalance_kg_m2")),
        gas_force=number("gas_force_x_N"),
        gas_moment=number("gas_moment_x_N_m"),
        rotating_gas_force=number("gas_force_rotating_N"),
        rotor_inertia=operation["rotor_polar_inertia_kg_m2"],
        sense=sense,
    )


def balanced(static: complex, dynamic: complex) -> tuple[Unbalance, ...]:
    """Add two balance weights to the parts of the compressor, which leave these sums.

    Parameters
    ----------
    static : complex
        [kg m].
    dynamic : complex
        About the virtual point [kg m²].
    """
    left = np.array([static, dynamic])
    for part in PARTS:
        left = left - part.rotating * np.array([1.0, part.arm])
    arms = np.array([[1.0, 1.0], [arm for *_, arm in WEIGHTS]])
    weights = tuple(
        Unbalance(name, float(abs(needed) / radius), radius, arm, float(np.angle(needed)))
        for (name, radius, arm), needed in zip(WEIGHTS, np.linalg.solve(arms, left), strict=True)
    )
    return PARTS + weights


LARGEST_SWEEPS = 200
AMPLITUDE_TOLERANCE = 1e-12
"""Between two sweeps of the search for the amplitudes [m]."""


@dataclass(frozen=True, eq=False)
class Running:
    """Steady states over speed.

    Parameters
    ----------
    load : array, shape (f, 6)
        Of the source at the virtual point [N, N m].
    dynamic_stiffness : array, shape (f, 6, 6)
        With mounts as they are then, hoses and the turning rotor [N/m, N/rad, N m/rad].
    displacement : array, shape (f, 6)
        Of the virtual point [m, rad].
    amplitudes : array, shape (f, n_mount)
        Largest displacement of the body at each mount over a turn [m].
    factors : array, shape (f, n_mount)
        Of softening [1].
    """

    load: ComplexArray
    dynamic_stiffness: ComplexArray
    displacement: ComplexArray
    amplitudes: RealArray
    factors: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def in_operation(compressor: Compressor, storage: float = 1.0, loss: float = 1.0) -> Compressor:
    """Return the compressor with its mounts in another state than the hammer found them in.

    Parameters
    ----------
    compressor : Compressor
        As struck.
    storage, loss : float
        Factors on the real and on the imaginary part of the dynamic stiffness: warmth, preload,
        amplitude [1].

    Notes
    -----
    A hyperbola times a factor is one again: ``c (v∞ − 1/(m f + w₀)) = c v∞ − 1/(m f/c + w₀/c)``.
    """
    factors = np.array([storage, loss])[:, None]
    hyperbolas = compressor.gain.reshape(2, 3) * np.hstack([factors, 1 / factors, 1 / factors])
    return replace(compressor, gain=hyperbolas.ravel())


def running(
    compressor: Compressor, source: Source, frequency: RealArray, gas_factor: float = 1.0
) -> Running:
    """Run a rigid compressor at many speeds.

    Parameters
    ----------
    compressor : Compressor
        With mounts in the state of operation, and with its hoses.
    source : Source
        What shakes it.
    frequency : array, shape (f,)
        Of the rotation [Hz].
    gas_factor : float
        On force and moment of the gas [1].

    Returns
    -------
    Running

    Notes
    -----
    ``Z(f, s) x = F`` with ``s_i`` the largest stroke of each mount: a fixed point per speed, taken
    half-way at a time, since near a resonance stiffness and stroke drive each other.
    """
    load = source.load(frequency, gas_factor)
    turning = source.gyroscopic(frequency)
    amplitudes = np.zeros((len(load), len(compressor.positions)))
    for _ in range(LARGEST_SWEEPS):
        factors = _factors(compressor, amplitudes)
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
    """Largest length over a turn of vectors that each go round an ellipse.

    Parameters
    ----------
    displacement : array, shape (f, 3 n)
        Complex amplitudes, three rows per vector [m].

    Returns
    -------
    array, shape (f, n)
        [m].

    Notes
    -----
    ``|Re(x e^{jφ})|² = (x*·x + Re(e^{2jφ} x·x))/2`` is largest at ``(|x|² + |x·x|)/2``.
    """
    vectors = displacement.reshape(len(displacement), -1, 3)
    squares = np.sum(np.abs(vectors) ** 2, axis=2) + np.abs(np.sum(vectors**2, axis=2))
    return np.asarray(np.sqrt(squares / 2))


def _factors(compressor: Compressor, amplitudes: RealArray) -> RealArray:
    if compressor.softening is None:
        return np.ones_like(amplitudes)
    return compressor.softening.factor(amplitudes)


RATE = 2000.0
"""Samples per second [Hz]."""
FIRST, LAST, DURATION = 49.5, 60.5, 11.0
"""Of the rotation [Hz], [s]; a filter of 3 Hz leaves the lines 50 to 60 Hz."""
GRID_STEP = 0.5
"""Between the steady states that the run passes [Hz]."""
OTHER_ORDERS = ((2, 0.20, 0.7), (3, 0.10, -1.1))
"""Order, amplitude per amplitude of the first, and phase against it [rad]: gas pulsation."""
ANALYSIS_SECONDS = 1.0
"""Record over which the noise of a channel falls to the floor of its order spectra [s]."""
PULSE_SHARE = 0.5
"""Share of a revolution that the pulse takes [1]."""
EDGE_SAMPLES = 1.0
"""Width of a pulse's edges in samples [1]: the recorder's filter."""


@dataclass(frozen=True, eq=False)
class RunUp:
    """What the recorder holds.

    Parameters
    ----------
    tacho : array, shape (n_sample,)
        One pulse per revolution, 0 to 1; the rotor's mark is on the y axis half-way up its edge.
    acceleration : array, shape (n_sample, n_channel)
        [m/s²].
    """

    tacho: RealArray
    acceleration: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def grid() -> RealArray:
    """Return the speeds at which `run_up` wants the steady states [Hz]."""
    return np.arange(FIRST, LAST + GRID_STEP / 2, GRID_STEP)


def run_up(
    steady: ComplexArray, floor: float, generator: np.random.Generator | None = None
) -> RunUp:
    """Run up and record.

    Parameters
    ----------
    steady : array, shape (n_grid, n_channel)
        First order of the channels on the `grid` [m/s²].
    floor : float
        Deviation of a complex order spectrum of each channel [m/s²].
    generator : Generator, optional
        Draws the noise; left out, there is none.

    Notes
    -----
    ``a(t) = Re Σ_q A_q(f(t)) e^{jqθ(t)}`` with the angle θ of the rotor, 0 at a pulse.
    """
    time = np.arange(round(DURATION * RATE)) / RATE
    slope = (LAST - FIRST) / DURATION
    # the record starts between two pulses
    angle = 2 * np.pi * (FIRST * time + slope * time**2 / 2 - 0.5)
    rotations = np.exp(1j * angle)
    for order, share, phase in OTHER_ORDERS:
        rotations = rotations + share * np.exp(1j * (order * angle + phase))
    clean = np.real(CubicSpline(grid(), steady)(FIRST + slope * time) * rotations[:, None])
    if generator is not None:
        noise = floor * np.sqrt(RATE * ANALYSIS_SECONDS) / 2
        clean = clean + noise * generator.standard_normal(clean.shape)
    return RunUp(_pulses(angle), clean)


def _pulses(angle: RealArray) -> RealArray:
    turns = angle / (2 * np.pi)
    within = np.mod(turns + 0.5, 1.0) - 0.5
    edge = EDGE_SAMPLES * np.gradient(turns)
    return np.asarray(expit(within / edge) * expit((PULSE_SHARE - within) / edge))


LINE_STEP = 1.0
"""Of the sweeps [Hz]."""
SCATTER = 3e-3
"""Deviation of a complex amplitude from run to run, over the amplitude [1]; of the study."""


@dataclass(frozen=True, eq=False)
class Operation:
    """A compressor that runs in its laboratory.

    Parameters
    ----------
    laboratory : Laboratory
        With the standard hoses, mounts in the state of operation.
    source : Source
        What shakes it.
    """

    laboratory: Laboratory
    source: Source


@dataclass(frozen=True, eq=False)
class TrueSweep:
    """One sweep as it truly is.

    Parameters
    ----------
    pressure : float
        [bar].
    hoses : tuple of Hose
        That the compressor feels; long soft hoses are none.
    frequency : array, shape (f,)
        Of the rotation [Hz].
    running : Running
        Steady states.
    acceleration : array, shape (f, n_channel)
        Of the channels without noise [m/s²].
    """

    pressure: float
    hoses: tuple[Hose, ...]
    frequency: RealArray
    running: Running
    acceleration: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def state(self) -> str:
        """Of the hoses, as the files call it."""
        return "standard" if self.hoses else "soft"

    @property
    def name(self) -> str:
        """Such as ``standard 7.5 bar``."""
        return f"{self.state} {self.pressure:g} bar"


def operation(
    seed: int, level: CalibrationLevel, plan: OperationPlan, *, noise_free: bool = False
) -> Operation:
    """Set up the running compressor of a seed; parameters as for `laboratory`."""
    there = laboratory(seed, level, plan.running_with_hoses, noise_free=noise_free)
    changed = in_operation(there.compressor, plan.mount_storage, plan.mount_loss)
    return Operation(Laboratory(changed, there.sheet, there.placed), true_source(plan.sense))


def speeds() -> RealArray:
    """Return the lines of the frozen sweeps, 1000 to 9000 1/min [Hz]."""
    low, high = read_data(COMPRESSOR_DATA)["operation"]["frequency_Hz"]
    return np.arange(low, high + LINE_STEP / 2, LINE_STEP)


def gas_factor(pressure: float) -> float:
    """Return the factor of one of `PRESSURES` on force and moment of the gas [1]."""
    second: float = read_data(COMPRESSOR_DATA)["operation"]["second_pressure_gas_factor"]
    return (1.0, second)[PRESSURES.index(pressure)]


def true_sweep(there: Operation, pressure: float, *, soft: bool, frequency: RealArray) -> TrueSweep:
    """Run the compressor at one pressure.

    Parameters
    ----------
    there : Operation
        What runs.
    pressure : float
        One of `PRESSURES` [bar].
    soft : bool
        Long soft hoses with masses on them, which are mechanically absent, instead of the standard
        ones.
    frequency : array, shape (f,)
        Of the rotation [Hz].
    """
    compressor = there.laboratory.compressor
    if soft:
        compressor = replace(compressor, hoses=())
    run = running(compressor, there.source, frequency, gas_factor(pressure))
    squared = (2 * np.pi * frequency[:, np.newaxis]) ** 2
    rows = there.laboratory.placed.response_rows(there.laboratory.sheet)
    seen = -squared * run.displacement @ rows.T
    return TrueSweep(pressure, compressor.hoses, frequency, run, seen)


def floor(frequency: RealArray) -> RealArray:
    """Return the deviation of a complex amplitude without signal, shape (f,) [m/s²]."""
    recorder = hit_plan()
    return np.asarray(recorder.response_noise * np.sqrt(1 + (recorder.corner / frequency) ** 2))


def measured(sweep: TrueSweep, generator: np.random.Generator) -> ComplexArray:
    """Return the order spectra of a sweep with scatter and noise, shape (f, n_channel) [m/s²]."""
    shape = sweep.acceleration.shape

    def normal() -> ComplexArray:
        real, imaginary = generator.standard_normal((2, *shape))
        return np.asarray((real + 1j * imaginary) / np.sqrt(2))

    scattered = sweep.acceleration * (1 + SCATTER * normal())
    return np.asarray(scattered + floor(sweep.frequency)[:, np.newaxis] * normal())
