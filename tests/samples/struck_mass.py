"""One mass on a spring and a damper, struck: its response over time in closed form.

The push is ``F (1 − cos 2πt/T)/2`` for 0 ≤ t ≤ T. With poles p and residues R of the receptance, a
force e^{st} from t = 0 gives ``Σ R (e^{st} − e^{pt})/(s − p)``; the push is three such terms, and
minus the same from t = T. No convolution and no FFT take part.
"""

from __future__ import annotations

import numpy as np

from deboom.measurement.impact_test import HammerMeasurement

MASS, NATURAL, DAMPING = 3.0, 2 * np.pi * 37.0, 0.02
RATE, N_SAMPLE, PRETRIGGER = 8192.0, 16384, 0.0625
PUSH, DURATION = 150.0, 0.004
POLES = NATURAL * (-DAMPING + np.array([1j, -1j]) * np.sqrt(1 - DAMPING**2))


def force(time):
    """Of a hit of strength 1 [N]."""
    inside = (time > 0) & (time < DURATION)
    return np.where(inside, PUSH / 2 * (1 - np.cos(2 * np.pi * time / DURATION)), 0.0)


def motion(time, derivative, poles=POLES):
    """Displacement, or its time derivative; the acceleration carries the force itself, too."""
    residues = 1 / MASS / (poles - poles[::-1])
    turning = 2j * np.pi / DURATION
    answer = np.zeros(time.shape, dtype=complex)
    for amplitude, s in ((PUSH / 2, 0), (-PUSH / 4, turning), (-PUSH / 4, -turning)):
        for begin, sign in ((0.0, 1), (DURATION, -1)):
            t = np.maximum(time - begin, 0.0)
            for pole, residue in zip(poles, residues, strict=True):
                free = pole**derivative * np.exp(pole * t)
                steady = s**derivative * np.exp(s * t) if s or not derivative else 0
                term = amplitude * residue * (steady - free) / (s - pole)
                answer += sign * np.where(time > begin, term, 0)
    return answer.real


def inertance(s):
    """Acceleration per force at the Laplace variable s [m/s²/N]."""
    return s**2 / (MASS * (s - POLES[0]) * (s - POLES[1]))


def measured(n_hit=2, force_noise=0.0, response_noise=0.0, seed=1):
    """Hits of different strength on the same body; noise as standard deviation [N, m/s²]."""
    time = np.arange(N_SAMPLE) / RATE - PRETRIGGER
    strength = np.linspace(0.8, 1.2, n_hit)[:, np.newaxis]
    generator = np.random.default_rng(seed)
    push, answer = strength * force(time), strength * motion(time, 2)
    return HammerMeasurement(
        impact="I1",
        force=push + force_noise * generator.normal(size=push.shape),
        response=(answer + response_noise * generator.normal(size=push.shape))[:, :, np.newaxis],
        channels=("A1 x",),
        units=("m/s^2",),
        ranges=(np.inf,),
        rate=RATE,
        pretrigger=PRETRIGGER,
    )


def fitted_pole(frequency, values):
    """Pole of ``(b₀ + b₁ s + b₂ s²)/(s² + a₁ s + a₀)`` on s = jω: linear least squares."""
    s = 2j * np.pi * frequency / NATURAL
    system = np.column_stack([values, values * s, -np.ones_like(s), -s, -(s**2)])
    unknown = np.linalg.lstsq(
        np.vstack([system.real, system.imag]),
        -np.concatenate([(values * s**2).real, (values * s**2).imag]),
    )[0]
    roots = np.roots([1, unknown[1], unknown[0]]) * NATURAL
    return roots[roots.imag > 0][0]
