"""The hammer on the body of an electric car: pressure at the ear, acceleration at every point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_hits import HitPlan, hit_plan, without_noise
from deboom.bench.electric_body import MOTIONS, ElectricCarBody
from deboom.bench.electric_places import Setup
from deboom.bench.frozen import freeze_arrays

BODY_IMPULSE = 1.0
"""Of a usual hit on a body [N s]."""

BODY_PULSE = 0.005
"""Duration of the half sine of a soft tip on sheet metal [s]."""

BODY_BAND = (15.0, 150.0)
"""First and last line [Hz]."""

CABIN_NOISE = 1e-4
"""Amplitude spectral density of the background noise in a closed car in a quiet room [Pa/√Hz]."""


@dataclass(frozen=True, eq=False)
class BodyFrfs:
    """What the hammer finds, FRFs over the hits of every impact.

    Parameters
    ----------
    frequency : array, shape (f,)
        [Hz].
    pressure : array, shape (f, m)
        At the driver's ear per stated force of every impact [Pa/N].
    coherence : array, shape (f, m)
        Ordinary, of the pressure [1].
    acceleration : array, shape (f, n_channel, m)
        At the channels of all sensors on the body [m/s² per N].
    """

    frequency: RealArray
    pressure: ComplexArray
    coherence: RealArray
    acceleration: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def body_plan(*, noise_free: bool = False) -> HitPlan:
    """Return how a body is struck: the compressor's sensors and hits, a larger and softer hammer.

    Parameters
    ----------
    noise_free : bool
        Every hit where it should be, silent channels and a silent cabin.
    """
    plan = replace(hit_plan(), impulse=BODY_IMPULSE, pulse=BODY_PULSE, band=BODY_BAND)
    return without_noise(plan) if noise_free else plan


def strike_body(
    car: ElectricCarBody,
    setup: Setup,
    plan: HitPlan,
    cabin_noise: float,
    microphone: float,
    generator: np.random.Generator,
) -> BodyFrfs:
    """Strike the body around every point; the compressor and its hoses are taken out.

    Parameters
    ----------
    car : ElectricCarBody
        The truth.
    setup : Setup
        Where sensors and impacts should be, and are.
    plan : HitPlan
        How.
    cabin_noise : float
        Amplitude spectral density in the cabin [Pa/√Hz].
    microphone : float
        Stated over true pressure [1].
    generator : Generator
        Draws strength, scatter and noise.

    Returns
    -------
    BodyFrfs
        ``H₁ = Σ a f* / Σ |f|²`` over the hits.
    """
    lines = plan.lines
    transfer = microphone * car.noise_transfer(lines)
    accelerance = -((2 * np.pi * lines) ** 2)[:, None, None] * car.receptance(lines)
    seen = setup.response_rows @ accelerance
    pulse = _pulse(plan.pulse, lines)
    noise = np.full(len(setup.response_rows), plan.response_noise)
    colour = np.outer(np.sqrt(1 + (plan.corner / lines) ** 2), np.append(noise, 0.0))
    colour[:, -1] = cabin_noise
    deviation = colour * np.sqrt(plan.duration) / 2

    functions, coherences = [], []
    for number, (point, placed) in enumerate(zip(setup.points, setup.placed, strict=True)):
        columns = slice(len(MOTIONS) * number, len(MOTIONS) * (number + 1))
        answer = np.concatenate([seen[:, :, columns], transfer[:, None, columns]], axis=1)
        n_impact = len(point.sheet.impact_positions)
        off = plan.scatter * generator.standard_normal((plan.hits, n_impact, 2))
        scatter = np.einsum("hmt,mta->hma", off, point.sheet.across)
        wrenches = placed.excitation_rows(point.sheet, scatter)
        impulses = plan.impulse * generator.uniform(*plan.spread, (plan.hits, n_impact))
        for impact in range(n_impact):
            push = impulses[:, impact, None] * pulse
            response = np.einsum("fca,ha,hf->hfc", answer, wrenches[:, impact], push)
            response = response + deviation * _complex_normal(response.shape, generator)
            force = (1 + placed.hammer_gain) * push + (
                plan.force_noise * plan.impulse * _complex_normal(push.shape, generator)
            )
            function, coherence = _h1(force, response)
            functions.append(function)
            coherences.append(coherence[:, -1])
    matrix = np.stack(functions, axis=2)
    return BodyFrfs(
        frequency=lines,
        pressure=matrix[:, -1],
        coherence=np.stack(coherences, axis=1),
        acceleration=matrix[:, :-1],
    )


def _pulse(duration: float, frequency: RealArray) -> RealArray:
    """Spectrum of a half sine of impulse 1 about its middle [1]."""
    half_waves = 2 * frequency * duration
    sum_of_sincs = np.sinc((1 + half_waves) / 2) + np.sinc((1 - half_waves) / 2)
    return np.asarray(np.pi / 4 * sum_of_sincs)


def _h1(force: ComplexArray, response: ComplexArray) -> tuple[ComplexArray, RealArray]:
    cross: ComplexArray = np.einsum("hfc,hf->fc", response, force.conj())
    of_force = np.einsum("hf,hf->f", force, force.conj()).real[:, None]
    of_response = np.einsum("hfc,hfc->fc", response, response.conj()).real
    coherence = np.minimum(np.abs(cross) ** 2 / (of_force * of_response), 1.0)
    return np.asarray(cross / of_force), coherence


def _complex_normal(shape: tuple[int, ...], generator: np.random.Generator) -> ComplexArray:
    real, imaginary = generator.standard_normal((2, *shape))
    return np.asarray(real + 1j * imaginary)
