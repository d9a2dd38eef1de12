"""The compressor's rig: sensors and impacts, their errors, and the roving hammer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_truth import (
    COMPRESSOR_DATA,
    Compressor,
    CompressorPlan,
    true_compressor,
)
from deboom.bench.powertrain import read_data
from deboom.bench.signals import complex_normal
from deboom.bench.writing import check_seed
from deboom.choices import CalibrationLevel
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

LARGEST_SWEEPS = 50
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
    """The position sheet of the laboratory.

    - `sensor_positions`, `sensor_angles` (n, 3): triaxial accelerometers; angles about the fixed
      axes x, then y, then z [m], [rad].
    - `impact_positions`, `impact_directions` (m, 3): impacts, and unit vectors along which the
      hammer pushes [m], [1].
    """

    sensor_positions: RealArray
    sensor_angles: RealArray
    impact_positions: RealArray
    impact_directions: RealArray

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names, such as ``A1``."""
        return tuple(f"A{number}" for number in range(1, len(self.sensor_positions) + 1))

    @property
    def impacts(self) -> tuple[str, ...]:
        """Names, such as ``I01``."""
        return tuple(f"I{number:02d}" for number in range(1, len(self.impact_positions) + 1))

    @property
    def across(self) -> RealArray:
        """Two unit vectors across the direction of each impact, shape (m, 2, 3)."""
        least = np.eye(3)[np.argmin(np.abs(self.impact_directions), axis=1)]
        first = np.cross(self.impact_directions, least)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        return np.stack([first, np.cross(self.impact_directions, first)], axis=1)


@dataclass(frozen=True, eq=False)
class Placed:
    """What the position sheet does not say.

    - `sensor_gain` (n, 3): relative error of each channel [1].
    - `sensor_offset`, `sensor_turn` (n, 3): errors against the sheet; turns about the axes of the
      sensor itself [m], [rad].
    - `hammer_gain`: relative error of the force that the hammer states [1].
    - `impact_offset` (m, 3): errors against the sheet, across the stated direction [m].
    - `impact_directions` (m, 3): True unit vectors [1].
    """

    sensor_gain: RealArray
    sensor_offset: RealArray
    sensor_turn: RealArray
    hammer_gain: float
    impact_offset: RealArray
    impact_directions: RealArray

    def response_rows(self, sheet: Sheet) -> RealArray:
        """Return motion of the virtual point → channels, shape (3 n, 6) [1, m]."""
        turned = rotation_matrix(sheet.sensor_angles) @ rotation_matrix(self.sensor_turn)
        rows = forward_matrices(sheet.sensor_positions + self.sensor_offset, turned)
        return np.asarray((1 + self.sensor_gain).reshape(-1, 1) * rows)

    def excitation_rows(self, sheet: Sheet, scatter: RealArray | None = None) -> RealArray:
        """Return the wrench at the virtual point per true newton of an impact, (..., m, 6) [1, m].

        Hits may scatter around their place by (..., m, 3) [m].
        """
        places = sheet.impact_positions + self.impact_offset
        places = places if scatter is None else places + scatter
        forces = np.broadcast_to(self.impact_directions, places.shape)
        return np.concatenate([forces, np.cross(places, forces)], axis=-1)

    def scattered_wrenches(
        self, sheet: Sheet, hits: int, scatter: float, generator: np.random.Generator
    ) -> RealArray:
        """Draw the wrench of every hit around its place, shape (n_hit, m, 6) [1, m]."""
        off = scatter * generator.standard_normal((hits, len(sheet.impact_positions), 2))
        return self.excitation_rows(sheet, np.einsum("hmt,mta->hma", off, sheet.across))


def position_sheet() -> Sheet:
    """Return the position sheet of the frozen rig: 6 triaxial accelerometers, 18 impacts."""
    rig = read_data(COMPRESSOR_DATA)["rig"]
    return Sheet(
        sensor_positions=np.array(rig["sensor_position_m"]),
        sensor_angles=np.deg2rad(rig["sensor_rotation_deg"]),
        impact_positions=np.array(rig["impact_position_m"]),
        impact_directions=np.array(rig["impact_direction"]),
    )


def placement_errors(level: CalibrationLevel) -> PlacementErrors:
    """Return the standard deviations of a level."""
    rig = read_data(COMPRESSOR_DATA)["rig"]
    levels = rig["calibration_levels_gain_position_m_angle_deg_hammer"]
    gain, position, degrees, hammer = levels[level.value]
    return PlacementErrors(gain, position, float(np.deg2rad(degrees)), hammer)


def place(sheet: Sheet, errors: PlacementErrors, generator: np.random.Generator) -> Placed:
    """Glue the sensors on and mark the impacts, with the normal errors of a laboratory."""
    n_sensor, n_impact = len(sheet.sensor_positions), len(sheet.impact_positions)

    def drawn(deviation: float, *shape: int) -> RealArray:
        return deviation * generator.standard_normal(shape)

    gain, offset, turn = (
        drawn(deviation, n_sensor, 3) for deviation in (errors.gain, errors.position, errors.angle)
    )
    hammer = float(drawn(errors.hammer, 1)[0])
    shifts, tilts = drawn(errors.position, n_impact, 2), drawn(errors.angle, n_impact, 2)
    leaning = sheet.impact_directions + np.einsum("mt,mta->ma", tilts, sheet.across)
    return Placed(
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
    - `amplitudes` (m, n_hit, n_mount): largest displacement of each mount [m]; 0 where mounts do
      not soften, and nobody asks.
    """

    force: RealArray
    response: RealArray
    factors: RealArray
    amplitudes: RealArray


def hit_plan() -> HitPlan:
    """Return the frozen plan of the rig, with noise N1."""
    rig = read_data(COMPRESSOR_DATA)["rig"]
    return HitPlan(
        hits=rig["hits"],
        pulse=rig["pulse_s"],
        impulse=rig["impulse_N_s"],
        scatter=rig["hit_scatter_m"],
        response_noise=rig["response_noise_m_s2_per_sqrtHz"],
        corner=rig["noise_corner_Hz"],
        force_noise=rig["force_noise_relative"],
    )


def without_noise(plan: HitPlan) -> HitPlan:
    """Return the plan with every hit where it should be, and a silent recorder."""
    return replace(plan, scatter=0.0, response_noise=0.0, force_noise=0.0)


def strike(
    compressor: Compressor,
    sheet: Sheet,
    placed: Placed,
    plan: HitPlan,
    generator: np.random.Generator,
) -> Blows:
    """Strike every impact and record force and acceleration.

    The answer is the inverse Fourier transform of inertance times spectrum of the sampled push:
    that of a hammer which strikes again every block. After a block of 2 s the slowest mode has
    fallen to a thousandth, so a single blow would look the same; the FRF is exact either way.
    """
    n_impact = len(sheet.impact_positions)
    push = _pushes(plan, n_impact, generator)
    wrenches = placed.scattered_wrenches(sheet, plan.hits, plan.scatter, generator).swapaxes(0, 1)
    excitation = compressor.on_parts(
        wrenches.reshape(-1, 6), np.repeat(sheet.impact_positions, plan.hits, axis=0)
    ).reshape(n_impact, plan.hits, -1)
    channels = np.repeat(sheet.sensor_positions, 3, axis=0)
    response_rows = compressor.on_parts(placed.response_rows(sheet), channels)

    spectrum = np.fft.rfft(push)
    factors = np.ones((n_impact, plan.hits, len(compressor.positions)))
    amplitudes = np.zeros_like(factors)
    answer = np.empty((*spectrum.shape, len(response_rows)), dtype=complex)
    seen = None
    for impact, (wrench, forces) in enumerate(zip(excitation, spectrum, strict=True)):
        for hit in range(plan.hits):
            if compressor.softening is not None:
                load = forces[hit][:, None] * wrench[hit]
                amplitudes[impact, hit] = mount_amplitudes(compressor, load, plan)
                factors[impact, hit] = compressor.softening.factor(amplitudes[impact, hit])
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
        amplitudes=amplitudes,
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
    compressor: Compressor,
    sheet: Sheet,
    placed: Placed,
    frequency: RealArray,
    factors: RealArray,
) -> ComplexArray:
    """Return what the laboratory would find without noise and scatter, (f, n_channel, m).

    Factors of softening are (m, n_mount), per impact [1]; result in m/s² per N.
    """
    channels = np.repeat(sheet.sensor_positions, 3, axis=0)
    response = compressor.on_parts(placed.response_rows(sheet), channels)
    excitation = compressor.on_parts(placed.excitation_rows(sheet), sheet.impact_positions)
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


class Purpose(IntEnum):
    """What random numbers are for: one compressor under every level, and so on."""

    COMPRESSOR = 0
    PLACING = 1
    STRIKING = 2
    WEIGHING = 3
    STRIKING_WITH_HOSES = 4
    RUNNING = 5


@dataclass(frozen=True, eq=False)
class Laboratory:
    """A compressor with its sensors glued on and its impacts marked, as stated and as they are."""

    compressor: Compressor
    sheet: Sheet
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
    compressor = true_compressor(plan, draw(seed, Purpose.COMPRESSOR))
    sheet = position_sheet()
    errors = NO_PLACEMENT_ERRORS if noise_free else placement_errors(level)
    return Laboratory(compressor, sheet, place(sheet, errors, draw(seed, Purpose.PLACING)))
