"""The compressor's rig: sensors, impacts and hammer with their errors, sweeps and run-up."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.bench.choices import CalibrationLevel, HoseCase
from deboom.bench.compressor_truth import (
    COMPRESSOR_DATA,
    Compressor,
    CompressorPlan,
    Hose,
    true_compressor,
)
from deboom.bench.powertrain import read_data
from deboom.bench.signals import complex_normal, over_time, rotations, tacho_pulses
from deboom.bench.writing import check_seed, triple
from deboom.errors import InputError
from deboom.files.rows import PlacedImpact, PlacedSensor
from deboom.physics.rigid_body import forward_matrices, rotation_matrix, skew

LARGEST_SWEEPS = 50
FOR_UNBALANCE = 17
"""What tells the draw of an unbalance from other draws of its seed."""
AMPLITUDE_TOLERANCE = 1e-10
"""Relative, between two sweeps of the search for the amplitude of a hit."""


@dataclass(frozen=True)
class PlacementErrors:
    """Standard deviations: channel gain [1], position [m] and angle [rad] per axis, hammer [1]."""

    gain: float
    position: float
    angle: float
    hammer: float


NO_PLACEMENT_ERRORS = PlacementErrors(0.0, 0.0, 0.0, 0.0)
"""Everything as stated, for verification."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """The position sheet of the laboratory around one point.

    - `sensors`, `impacts`: rows of the n triaxial accelerometers and of the m impacts.
    - `origin` (3,): true place of the point that positions below count from [m].
    """

    sensors: tuple[PlacedSensor, ...]
    impacts: tuple[PlacedImpact, ...]
    origin: RealArray = field(default_factory=lambda: np.zeros(3))

    @property
    def sensor_positions(self) -> RealArray:
        """Places of the accelerometers, shape (n, 3) [m]."""
        return np.reshape([row.position for row in self.sensors], (-1, 3)) - self.origin

    @property
    def impact_positions(self) -> RealArray:
        """Places of the impacts, shape (m, 3) [m]."""
        return np.reshape([row.position for row in self.impacts], (-1, 3)) - self.origin

    @property
    def impact_directions(self) -> RealArray:
        """Unit vectors along which the hammer pushes, shape (m, 3) [1]."""
        return np.reshape([row.direction for row in self.impacts], (-1, 3))

    @property
    def across(self) -> RealArray:
        """Two unit vectors across the direction of each impact, shape (m, 2, 3)."""
        least = np.eye(3)[np.argmin(np.abs(self.impact_directions), axis=1)]
        first = np.cross(self.impact_directions, least)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        return np.stack([first, np.cross(self.impact_directions, first)], axis=1)


@dataclass(frozen=True, eq=False)
class Placed:
    """What is where, beside what the position sheet says.

    - `sheet`: the position sheet.
    - `sensor_gain` (n, 3): relative error of each channel [1].
    - `sensor_offset`, `sensor_turn` (n, 3): errors against the sheet; turns about the axes of the
      sensor itself [m], [rad].
    - `hammer_gain`: relative error of the force that the hammer states [1].
    - `impact_offset` (m, 3): errors against the sheet, across the stated direction [m].
    - `impact_directions` (m, 3): True unit vectors [1].
    """

    sheet: Sheet
    sensor_gain: RealArray
    sensor_offset: RealArray
    sensor_turn: RealArray
    hammer_gain: float
    impact_offset: RealArray
    impact_directions: RealArray

    def response_rows(self) -> RealArray:
        """Return motion of the virtual point → channels, shape (3 n, 6) [1, m]."""
        angles = np.reshape([row.angles for row in self.sheet.sensors], (-1, 3))
        turned = rotation_matrix(angles) @ rotation_matrix(self.sensor_turn)
        rows = forward_matrices(self.sheet.sensor_positions + self.sensor_offset, turned)
        return np.asarray((1 + self.sensor_gain).reshape(-1, 1) * rows)

    def excitation_rows(self, scatter: RealArray | float = 0.0) -> RealArray:
        """Return the wrench at the virtual point per true newton of an impact, (..., m, 6) [1, m].

        Hits may scatter around their place by (..., m, 3) [m].
        """
        places = self.sheet.impact_positions + self.impact_offset + scatter
        forces = np.broadcast_to(self.impact_directions, places.shape)
        return np.concatenate([forces, np.cross(places, forces)], axis=-1)

    def scattered_wrenches(
        self, hits: int, scatter: float, generator: np.random.Generator
    ) -> RealArray:
        """Draw the wrench of every hit around its place, shape (n_hit, m, 6) [1, m]."""
        off = scatter * generator.standard_normal((hits, len(self.sheet.impacts), 2))
        return self.excitation_rows(np.einsum("hmt,mta->hma", off, self.sheet.across))


def position_sheet() -> Sheet:
    """Return the position sheet of the frozen rig: 6 triaxial accelerometers, 18 impacts."""
    rig = read_data(COMPRESSOR_DATA)["rig"]
    sensors = zip(rig["sensor_position_m"], np.deg2rad(rig["sensor_rotation_deg"]), strict=True)
    impacts = zip(rig["impact_position_m"], rig["impact_direction"], strict=True)
    return Sheet(
        tuple(
            PlacedSensor(f"A{number}", 100 + number, triple(position), triple(angles))
            for number, (position, angles) in enumerate(sensors, 1)
        ),
        tuple(
            PlacedImpact(f"I{number:02d}", 200 + number, triple(position), triple(direction))
            for number, (position, direction) in enumerate(impacts, 1)
        ),
    )


def placement_errors(level: CalibrationLevel) -> PlacementErrors:
    """Return the standard deviations of a level."""
    rig = read_data(COMPRESSOR_DATA)["rig"]
    levels = rig["calibration_levels_gain_position_m_angle_deg_hammer"]
    gain, position, degrees, hammer = levels[level.value]
    return PlacementErrors(gain, position, float(np.deg2rad(degrees)), hammer)


def place(sheet: Sheet, errors: PlacementErrors, generator: np.random.Generator) -> Placed:
    """Glue the sensors on and mark the impacts, with the normal errors of a laboratory."""
    n_sensor, n_impact = len(sheet.sensors), len(sheet.impacts)

    def drawn(deviation: float, *shape: int) -> RealArray:
        return deviation * generator.standard_normal(shape)

    gain, offset, turn = (
        drawn(deviation, n_sensor, 3) for deviation in (errors.gain, errors.position, errors.angle)
    )
    hammer = float(drawn(errors.hammer, 1)[0])
    shifts, tilts = drawn(errors.position, n_impact, 2), drawn(errors.angle, n_impact, 2)
    leaning = sheet.impact_directions + np.einsum("mt,mta->ma", tilts, sheet.across)
    return Placed(
        sheet=sheet,
        sensor_gain=gain,
        sensor_offset=offset,
        sensor_turn=turn,
        hammer_gain=hammer,
        impact_offset=np.einsum("mt,mta->ma", shifts, sheet.across),
        impact_directions=leaning / np.linalg.norm(leaning, axis=1, keepdims=True),
    )


@dataclass(frozen=True)
class HitPlan:
    """How the hammer strikes, and how it is recorded.

    - `hits`: hits per impact.
    - `pulse`, `impulse`: duration of the half sine [s], and impulse of a usual hit [N s].
    - `scatter`: scatter of the hits around the marked place, per axis across the push, 1 σ [m].
    - `response_noise`, `corner`: amplitude spectral density of each channel above the corner
      [m/s²/√Hz], and the corner, below which it grows as 1/f [Hz].
    - `force_noise`: noise of the real and of the imaginary part of the force spectrum, over that of
      a usual hit, 1 σ [1].
    - `spread` (float, float): least and largest impulse, over the usual one [1].
    - `rate`: rate of the recorder [Hz].
    - `duration`, `pretrigger`: duration of a block, whose inverse is the spacing of the lines, and
      its pretrigger [s].
    - `band` (float, float): first and last line of the FRFs [Hz].
    """

    hits: int
    pulse: float
    impulse: float
    scatter: float
    response_noise: float
    corner: float
    force_noise: float
    spread: tuple[float, float] = (0.7, 1.3)
    rate: float = 1024.0
    duration: float = 2.0
    pretrigger: float = 0.05
    band: tuple[float, float] = (10.0, 150.0)

    @property
    def n_sample(self) -> int:
        """Samples of a block."""
        return round(self.rate * self.duration)

    @property
    def spectrum_lines(self) -> RealArray:
        """Lines of a block, from 0 to half of the rate [Hz]."""
        return np.asarray(np.fft.rfftfreq(self.n_sample, 1 / self.rate), dtype=np.float64)

    @property
    def lines(self) -> RealArray:
        """Lines of the FRFs [Hz]."""
        low, high = self.band
        lines = self.spectrum_lines
        return lines[(lines >= low) & (lines <= high)]


@dataclass(frozen=True, eq=False)
class Blows:
    """All hits on all impacts as the recorder holds them, and what the mounts did.

    - `force` (m, n_hit, n_sample): force that the hammer states [N].
    - `response` (m, n_hit, n_sample, n_channel): acceleration that the accelerometers state [m/s²].
    - `factors` (m, n_hit, n_mount): factors of softening [1].
    """

    force: RealArray
    response: RealArray
    factors: RealArray


def hit_plan() -> HitPlan:
    """Return the frozen plan of the rig, with noise N1."""
    return HitPlan(**read_data(COMPRESSOR_DATA)["rig"]["hits"])


def without_noise(plan: HitPlan) -> HitPlan:
    """Return the plan with every hit where it should be, and a silent recorder."""
    return replace(plan, scatter=0.0, response_noise=0.0, force_noise=0.0)


def strike(
    compressor: Compressor, placed: Placed, plan: HitPlan, generator: np.random.Generator
) -> Blows:
    """Strike every impact and record force and acceleration.

    The answer is the inverse Fourier transform of inertance times spectrum of the sampled push:
    that of a hammer which strikes again every block. After a block of 2 s the slowest mode has
    fallen to a thousandth, so a single blow would look the same; the FRF is exact either way.
    """
    sheet, n_impact = placed.sheet, len(placed.sheet.impacts)
    push = _pushes(plan, n_impact, generator)
    wrenches = placed.scattered_wrenches(plan.hits, plan.scatter, generator).swapaxes(0, 1)
    excitation = compressor.on_parts(
        wrenches.reshape(-1, 6), np.repeat(sheet.impact_positions, plan.hits, axis=0)
    ).reshape(n_impact, plan.hits, -1)
    channels = np.repeat(sheet.sensor_positions, 3, axis=0)
    response_rows = compressor.on_parts(placed.response_rows(), channels)

    spectrum = np.fft.rfft(push)
    factors = np.ones((n_impact, plan.hits, len(compressor.positions)))
    answer = np.empty((*spectrum.shape, len(response_rows)), dtype=complex)
    seen = None
    for impact, (wrench, forces) in enumerate(zip(excitation, spectrum, strict=True)):
        for hit in range(plan.hits):
            if compressor.softening is not None:
                load = forces[hit][:, None] * wrench[hit]
                amplitudes = mount_amplitudes(compressor, load, plan)
                factors[impact, hit] = compressor.softening.factor(amplitudes)
            if seen is None or compressor.softening is not None:
                inertance = compressor.inertance(plan.spectrum_lines, factors[impact, hit])
                seen = response_rows @ inertance
            answer[impact, hit] = (seen @ wrench[hit]) * forces[hit][:, None]

    answer += _response_noise(plan, answer.shape, generator)
    # white over time: the parts of its spectrum have this share of a usual hit's
    force_noise = plan.force_noise * plan.impulse * plan.rate * np.sqrt(2 / plan.n_sample)
    force = (1 + placed.hammer_gain) * push
    return Blows(
        force=force + force_noise * generator.standard_normal(push.shape),
        response=np.fft.irfft(answer, plan.n_sample, axis=2),
        factors=factors,
    )


def mount_amplitudes(compressor: Compressor, load: ComplexArray, plan: HitPlan) -> RealArray:
    """Find how far each mount moves in one hit under a load (n_line, n_dof), shape (n_mount,) [m].

    Fixed point ``s = max |x(t; factor(s))|``, one amplitude per mount and hit: rubber is as soft as
    its largest stroke makes it. A mount that is softer by a share moves further by half of it, and
    its stiffness answers with a twentieth of that: each sweep leaves some percent of the error.
    """
    softening = compressor.softening
    assert softening is not None
    amplitudes = np.full(len(compressor.positions), softening.reference)
    for _ in range(LARGEST_SWEEPS):
        stiffness = compressor.dynamic_stiffness(plan.spectrum_lines, softening.factor(amplitudes))
        motion = np.linalg.solve(stiffness, load[:, :, None])[:, :, 0]
        over_time = np.fft.irfft(motion @ compressor.mount_rows.T, plan.n_sample, axis=0)
        stroke = np.linalg.norm(over_time.reshape(plan.n_sample, -1, 3), axis=2).max(axis=0)
        settled = np.all(np.abs(stroke - amplitudes) < AMPLITUDE_TOLERANCE * stroke)
        amplitudes = np.asarray(stroke)
        if settled:
            return amplitudes
    raise ArithmeticError("the amplitude of a hit does not settle")


def averaged(blows: Blows, plan: HitPlan) -> tuple[ComplexArray, RealArray]:
    """Average the hits to FRFs [m/s² per N] and coherences [1], shape (f, n_channel, m)."""
    lines = np.isin(plan.spectrum_lines, plan.lines)
    force = np.fft.rfft(blows.force)[:, :, lines]
    response = np.fft.rfft(blows.response, axis=2)[:, :, lines]
    functions, coherences = zip(*map(first_estimate, force, response), strict=True)
    return np.stack(functions, axis=2), np.stack(coherences, axis=2)


def first_estimate(force: ComplexArray, response: ComplexArray) -> tuple[ComplexArray, RealArray]:
    """Estimate the FRFs of one impact, and their ordinary coherence, with noise in the responses.

    ``H₁ = Σ a f* / Σ |f|²`` of the spectra of force (n_hit, f) and responses (n_hit, f, n_channel);
    both results are (f, n_channel).
    """
    cross: ComplexArray = np.einsum("hfc,hf->fc", response, force.conj())
    of_force = np.einsum("hf,hf->f", force, force.conj()).real[:, None]
    of_response = np.einsum("hfc,hfc->fc", response, response.conj()).real
    coherence = np.minimum(np.abs(cross) ** 2 / (of_force * of_response), 1.0)
    return np.asarray(cross / of_force), coherence


def exact_inertance(
    compressor: Compressor, placed: Placed, frequency: RealArray, factors: RealArray
) -> ComplexArray:
    """Return what the laboratory would find without noise and scatter, (f, n_channel, m).

    Factors of softening are (m, n_mount), per impact [1]; result in m/s² per N.
    """
    channels = np.repeat(placed.sheet.sensor_positions, 3, axis=0)
    response = compressor.on_parts(placed.response_rows(), channels)
    excitation = compressor.on_parts(placed.excitation_rows(), placed.sheet.impact_positions)
    columns = [
        response @ compressor.inertance(frequency, factor) @ wrench
        for wrench, factor in zip(excitation, factors, strict=True)
    ]
    return np.asarray(np.stack(columns, axis=2) / (1 + placed.hammer_gain), dtype=np.complex128)


def _pushes(plan: HitPlan, n_impact: int, generator: np.random.Generator) -> RealArray:
    """Half sines of a true impulse that begin between two samples, shape (m, n_hit, n_sample)."""
    shape = (n_impact, plan.hits, 1)
    begin = plan.pretrigger + generator.uniform(0, 1 / plan.rate, shape)
    impulse = plan.impulse * generator.uniform(*plan.spread, shape)
    since = (np.arange(plan.n_sample) / plan.rate - begin) / plan.pulse
    pulse = np.sin(np.pi * since) * ((since >= 0) & (since <= 1))
    return np.asarray(impulse * np.pi / (2 * plan.pulse) * pulse)


def _response_noise(
    plan: HitPlan, shape: tuple[int, ...], generator: np.random.Generator
) -> ComplexArray:
    """Spectra of the channels' noise, shape (m, n_hit, n_line, n_channel); nothing at 0 Hz."""
    lines = plan.spectrum_lines
    density = np.zeros_like(lines)
    density[1:] = plan.response_noise * np.sqrt(1 + (plan.corner / lines[1:]) ** 2)
    # |X|² of n samples is n rate/2 times the one-sided density of power, half of it in each part
    deviation = density * np.sqrt(plan.n_sample * plan.rate) / 2
    return np.asarray(deviation[:, None] * complex_normal(shape, generator))


COMPRESSOR, PLACING, STRIKING, WEIGHING, STRIKING_WITH_HOSES, RUNNING = range(6)
"""What random numbers are for: one compressor under every level, and so on."""


@dataclass(frozen=True, eq=False)
class Laboratory:
    """A compressor with its sensors glued on and its impacts marked, as stated and as they are."""

    compressor: Compressor
    placed: Placed


def draw(seed: int, *purpose: int) -> np.random.Generator:
    """Return the random numbers of a seed for one purpose; a seed below 1 is refused."""
    check_seed(seed)
    return np.random.default_rng([seed, *purpose])


def laboratory(
    seed: int, level: CalibrationLevel, plan: CompressorPlan, *, noise_free: bool = False
) -> Laboratory:
    """Set up the laboratory of a seed, the same in every test that the seed writes.

    With hoses or without, the compressor is the same one. A seed below 1 is refused.
    """
    compressor = true_compressor(plan, draw(seed, COMPRESSOR))
    errors = NO_PLACEMENT_ERRORS if noise_free else placement_errors(level)
    return Laboratory(compressor, place(position_sheet(), errors, draw(seed, PLACING)))


PRESSURES = (7.5, 13.5)
"""Of the gas at the outlet [bar]; the frozen data say how gas forces grow from first to second."""

RUNNING_SWEEPS = 200
RUNNING_TOLERANCE = 1e-12
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


@checked(mount_storage=">0 <inf", mount_loss=">0 <inf", each_mount="m >0 <inf")
class OperationPlan:
    """The compressor, what is done to it and what is recorded.

    - `compressor`: compressor as struck, without hoses, rigid; softening there is that of the hits.
    - `hoses`: True standard hoses.
    - `hammer_with_hoses`: strike it with the standard hoses as well.
    - `mount_storage`, `mount_loss`: real and imaginary part of the mounts' dynamic stiffness in
      operation, over those under the hammer [1].
    - `softening`: mounts soften with their amplitude while it runs.
    - `sense`: 1: the rotor turns from y to z; −1: from z to y.
    - `truth_seed`: 1 is the frozen source; every other seed draws sizes and phases of unbalance and
      gas forces, and the sense.
    - `time_record`: whether a short run-up is recorded over time with tacho as well.
    - `each_mount` (n_mount,): in operation, a factor on both parts of each mount's stiffness
      besides; empty: there is none [1].
    - raises InputError: a factor that is not positive, another sense.
    """

    compressor: CompressorPlan = field(default_factory=CompressorPlan)
    hoses: HoseCase = HoseCase.SCATTERED
    hammer_with_hoses: bool = False
    mount_storage: float = 1.0
    mount_loss: float = 1.0
    softening: bool = False
    sense: int = 1
    time_record: bool = False
    truth_seed: int = 1
    each_mount: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.sense not in (1, -1):
            raise InputError(
                f"sense {self.sense} is no sense of rotation: give 1 (from y to z) or -1"
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


LARGEST_STATIC, LARGEST_DYNAMIC = 40e-6, 2500e-9
"""Of drawn unbalances, uniform from zero [kg m], [kg m²]."""

GAS_SPREAD = 3.0
"""Of drawn gas forces: amplitude over the frozen one, at most and at least its inverse [1]."""


def true_source(sense: int = 1, truth_seed: int = 1) -> Source:
    """Return the source of the frozen data; two balance weights leave its unbalances.

    Every `truth_seed` but 1 draws what they leave, the sense, and size and phase of each gas force.
    """
    operation = read_data(COMPRESSOR_DATA)["operation"]

    def number(key: str) -> complex:
        return complex(*operation[key])

    left = np.array([number("static_unbalance_kg_m"), number("dynamic_unbalance_kg_m2")])
    gas = np.array(
        [number(f"gas_{key}") for key in ("force_x_N", "moment_x_N_m", "force_rotating_N")]
    )
    if truth_seed != 1:
        generator = np.random.default_rng([truth_seed, FOR_UNBALANCE])
        sizes = generator.uniform(0, [LARGEST_STATIC, LARGEST_DYNAMIC])
        left = sizes * np.exp(1j * generator.uniform(0, 2 * np.pi, 2))
        sense *= int(generator.choice([1, -1]))
        larger = GAS_SPREAD ** generator.uniform(-1, 1, gas.size)
        gas = gas * larger * np.exp(1j * generator.uniform(0, 2 * np.pi, gas.size))
    for part in PARTS:
        left = left - part.rotating * np.array([1.0, part.arm])
    arms = np.array([[1.0, 1.0], [arm for *_, arm in WEIGHTS]])
    weights = tuple(
        Unbalance(name, float(abs(needed) / radius), radius, arm, float(np.angle(needed)))
        for (name, radius, arm), needed in zip(WEIGHTS, np.linalg.solve(arms, left), strict=True)
    )
    return Source(
        unbalances=PARTS + weights,
        gas_force=complex(gas[0]),
        gas_moment=complex(gas[1]),
        rotating_gas_force=complex(gas[2]),
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
    for _ in range(RUNNING_SWEEPS):
        if compressor.softening is not None:
            factors = compressor.softening.factor(amplitudes)
        stiffness = compressor.dynamic_stiffness(frequency, factors) + turning
        displacement = np.asarray(
            np.linalg.solve(stiffness, load[:, :, None])[:, :, 0], dtype=np.complex128
        )
        seen = strokes(displacement @ compressor.mount_rows.T)
        settled = np.all(np.abs(seen - amplitudes) < RUNNING_TOLERANCE)
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
    compressor = replace(rig.compressor, gain=gain)
    if plan.each_mount:
        apart = np.array(plan.each_mount)[:, np.newaxis]
        compressor = replace(compressor, stiffness=apart * compressor.stiffness)
    changed = replace(rig, compressor=compressor)
    return Operation(changed, true_source(plan.sense, plan.truth_seed))


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
    seen = -squared * run.displacement @ rig.placed.response_rows().T
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
