"""The roving hammer on the virtual compressor: blocks over time, and FRFs out of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_plan import COMPRESSOR_DATA
from deboom.bench.compressor_rig import Placed, Sheet
from deboom.bench.compressor_truth import Compressor
from deboom.bench.frozen import freeze_arrays
from deboom.bench.parameters import read_data

LARGEST_SWEEPS = 50
AMPLITUDE_TOLERANCE = 1e-10
"""Relative, between two sweeps of the search for the amplitude of a hit."""


@dataclass(frozen=True)
class HitPlan:
    """How the hammer strikes, and how it is recorded.

    Parameters
    ----------
    hits : int
        Per impact.
    pulse : float
        Duration of the half sine [s].
    impulse : float
        Of a usual hit [N s].
    spread : (float, float)
        Least and largest impulse, over the usual one [1].
    scatter : float
        Of the hits around the marked place, per axis across the push, 1 σ [m].
    response_noise : float
        Amplitude spectral density of each channel above `corner` [m/s²/√Hz].
    corner : float
        Below it the noise grows as 1/f [Hz].
    force_noise : float
        Of the real and of the imaginary part of the force spectrum, over that of a usual hit, 1 σ
        [1].
    rate : float
        Of the recorder [Hz].
    duration : float
        Of a block; its inverse is the spacing of the lines [s].
    pretrigger : float
        [s]
    band : (float, float)
        First and last line of the FRFs [Hz].
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
        """Of a block."""
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

    Parameters
    ----------
    force : array, shape (m, n_hit, n_sample)
        As the hammer states it [N].
    response : array, shape (m, n_hit, n_sample, n_channel)
        As the accelerometers state it [m/s²].
    factors : array, shape (m, n_hit, n_mount)
        Of softening [1].
    amplitudes : array, shape (m, n_hit, n_mount)
        Largest displacement of each mount [m]; 0 where mounts do not soften, and nobody asks.
    """

    force: RealArray
    response: RealArray
    factors: RealArray
    amplitudes: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


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

    Parameters
    ----------
    compressor : Compressor
        The truth.
    sheet, placed
        Where sensors and impacts should be, and are.
    plan : HitPlan
        How.
    generator : Generator
        Draws strength, scatter and noise.

    Returns
    -------
    Blows

    Notes
    -----
    The answer is the inverse Fourier transform of inertance times spectrum of the sampled push:
    that of a hammer which strikes again every block. After a block of 2 s the slowest mode has
    fallen to a thousandth, so a single blow would look the same; the FRF is exact either way.
    """
    n_impact = len(sheet.impact_positions)
    push = _pushes(plan, n_impact, generator)
    off = plan.scatter * generator.standard_normal((plan.hits, n_impact, 2))
    scatter = np.einsum("hmt,mta->hma", off, sheet.across)
    wrenches = placed.excitation_rows(sheet, scatter).swapaxes(0, 1)
    excitation = compressor.on_parts(
        wrenches.reshape(-1, 6), np.repeat(sheet.impact_positions, plan.hits, axis=0)
    ).reshape(n_impact, plan.hits, -1)
    channels = np.repeat(sheet.sensor_positions, 3, axis=0)
    response_rows = compressor.on_parts(placed.response_rows(sheet), channels)

    spectrum = np.fft.rfft(push)
    n_mount = len(compressor.positions)
    factors = np.ones((n_impact, plan.hits, n_mount))
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
    """Find how far each mount moves in one hit, where that decides how stiff it is.

    Parameters
    ----------
    compressor : Compressor
        With softening.
    load : array, shape (n_line, n_dof)
        Fourier transform of the sampled load on the lines of a block [N, N m].
    plan : HitPlan
        Of the blocks.

    Returns
    -------
    array, shape (n_mount,)
        Largest displacement over the block [m].

    Notes
    -----
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
    """Average the hits of each impact to FRFs.

    Parameters
    ----------
    blows : Blows
        Of all impacts.
    plan : HitPlan
        Of the blocks.

    Returns
    -------
    inertance : array, shape (f, n_channel, m)
        On `plan.lines` [m/s² per N].
    coherence : array, shape (f, n_channel, m)
        Ordinary [1].

    Notes
    -----
    ``H₁ = Σ a f* / Σ |f|²``, noise in the responses.
    """
    lines = np.isin(plan.spectrum_lines, plan.lines)
    force = np.fft.rfft(blows.force)[:, :, lines]
    response = np.fft.rfft(blows.response, axis=2)[:, :, lines]
    cross: ComplexArray = np.einsum("mhfc,mhf->fcm", response, force.conj())
    of_force = np.einsum("mhf,mhf->fm", force, force.conj()).real[:, None]
    of_response = np.einsum("mhfc,mhfc->fcm", response, response.conj()).real
    coherence = np.minimum(np.abs(cross) ** 2 / (of_force * of_response), 1.0)
    return np.asarray(cross / of_force), coherence


def exact_inertance(
    compressor: Compressor,
    sheet: Sheet,
    placed: Placed,
    frequency: RealArray,
    factors: RealArray,
) -> ComplexArray:
    """Return what the laboratory would find without noise and scatter.

    Parameters
    ----------
    compressor, sheet, placed
        What is struck, and where.
    frequency : array, shape (f,)
        [Hz].
    factors : array, shape (m, n_mount)
        Of softening, per impact.

    Returns
    -------
    array, shape (f, n_channel, m)
        [m/s² per N].
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
    real, imaginary = generator.standard_normal((2, *shape))
    return np.asarray(deviation[:, None] * (real + 1j * imaginary))
