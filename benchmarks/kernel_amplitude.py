"""Amplitude-dependent motion: SPLV of a design with all draws, stiffnesses that follow amplitudes.

One evaluation is one design: `n_draws` draws x `n_vehicles` vehicles x `n_lines` lines, each line a
fixed point of 6x6 complex solutions. The loop takes draw by draw, all lines in one batched
`linalg.solve`, with six sweeps from rest; its second row goes on to the kernels' tolerance, as its
error shows to be necessary. All rivals use one thread and the same random data; stiffnesses soften
by about a tenth per doubled amplitude.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.vehicles.amplitude_motion import TOLERANCE, AmplitudeMotion
from deboom.vehicles.kernel_amplitude_numba import NUMBA_AMPLITUDE
from deboom.vehicles.kernel_amplitude_numpy import NUMPY_AMPLITUDE, NumpyAmplitudeKernel
from interleaved import quiet_seconds
from kernel_coupled import Shape, designs
from kernel_coupled import problem as coupled_problem

SHAPES = (
    Shape("100 draws x 5 vehicles x 321 lines, 4 powertrain mounts", 100, 5, 321, 4, 0, 16),
    Shape("128 draws x 5 vehicles x 161 lines, as shipped", 128, 5, 161, 3, 2, 16),
)
SWEEPS = 6
LARGEST = 2.0
"""Amplitude up to which the drawn stiffnesses soften [mm]."""
LOOP = f"loop over draws, {SWEEPS} sweeps from rest"
LOOP_TO_REST = "loop over draws, to the tolerance"
NUMPY_ROW, NUMBA_ROW = (f"kernel {kernel.name}" for kernel in (NUMPY_AMPLITUDE, NUMBA_AMPLITUDE))


def problem(shape: Shape, seed: int = 1, softening: float = 0.30) -> AmplitudeMotion:
    """Draw a powertrain whose stiffnesses fall by about `softening` in the first millimetre.

    Beyond `LARGEST` they stay. The load is such that one amplitude in twenty is above 1 mm.
    """
    coupled = coupled_problem(shape, seed)
    gain = 1e-3 / np.quantile(coupled.nominal_amplitude, 0.95)
    coupled = replace(coupled, load=gain * coupled.load, own_load=gain * coupled.own_load)
    amplitude = 1e3 * coupled.nominal_amplitude
    rng = np.random.default_rng(seed)
    slope = softening * rng.uniform(0.7, 1.3, amplitude.shape[1]) * (1 - 0.3j)
    law = np.stack(np.broadcast_arrays(1.0, -slope, 0.4 * slope, -0.05 * slope), axis=-1)
    cubic = law * amplitude[..., np.newaxis] ** np.arange(4)
    cubic /= cubic.sum(axis=-1, keepdims=True)
    cubic[amplitude > LARGEST] = [1.0, 0.0, 0.0, 0.0]
    highest = np.maximum(LARGEST / amplitude, 1.0)
    return AmplitudeMotion(coupled, cubic, np.zeros(amplitude.shape), highest)


def naive(motion: AmplitudeMotion, rows: RealArray, tolerance: float | None = None) -> RealArray:
    """Return the sums of levels draw by draw, as one would write it first."""
    base, n_body = motion.coupled, len(motion.coupled.forward)
    squared = base.angular_frequency_squared[:, np.newaxis]
    inertia = squared[..., np.newaxis] * base.mass_matrix
    nominal = np.hstack([base.stiffness, base.own_stiffness])
    transfer = np.concatenate([base.transfer, base.own_transfer], axis=2)
    c = motion.cubic
    levels = []
    for row in rows:
        factors = row[motion.variables]
        ratio = np.zeros(motion.lowest.shape)
        for sweep in range(SWEEPS if tolerance is None else 100):
            t = np.minimum(ratio, motion.highest)
            relative = c[..., 0] + t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3]))
            springs = factors * nominal * relative
            body = springs[:, :n_body, np.newaxis] * base.forward
            matrix = base.forward.T @ body - inertia
            moved = np.linalg.solve(matrix, base.load[..., np.newaxis])[..., 0]
            own = base.own_load / (springs[:, n_body:] - squared * base.own_mass)
            displacement = np.hstack([moved @ base.forward.T, own])
            before, ratio = ratio, np.abs(displacement) / motion.amplitude
            if tolerance and sweep and np.all(np.abs(ratio - before) <= tolerance * ratio):
                break
        pressure = np.einsum("vfi,fi->vf", transfer, springs * displacement)
        levels.append((20 * np.log10(np.abs(pressure))).sum(axis=-1))
    return np.array(levels)


def measure(shape: Shape, seconds: float) -> pd.DataFrame:
    """Time all rivals side by side; one row each."""
    motion, rows = problem(shape), designs(shape)
    one = rows[: shape.n_draws]
    few = one[:2]
    sums = {
        NUMPY_ROW: NUMPY_AMPLITUDE.prepare(motion),
        NUMBA_ROW: NUMBA_AMPLITUDE.prepare(motion),
    }
    calls: dict[str, Callable[[], object]] = {
        LOOP: lambda: naive(motion, few),
        LOOP_TO_REST: lambda: naive(motion, few, TOLERANCE),
        NUMPY_ROW: lambda: sums[NUMPY_ROW](one),
        NUMBA_ROW: lambda: sums[NUMBA_ROW](rows),
    }
    with threadpool_limits(1, user_api="blas"):
        quiet = pd.Series(quiet_seconds(calls, seconds, calls=2))
        exact = NumpyAmplitudeKernel(tolerance=1e-12).prepare(motion)(one)
        found = {
            LOOP: naive(motion, one),
            LOOP_TO_REST: naive(motion, one, TOLERANCE),
            NUMPY_ROW: sums[NUMPY_ROW](one),
            NUMBA_ROW: sums[NUMBA_ROW](one),
        }
    share = pd.Series({LOOP: len(few), LOOP_TO_REST: len(few), NUMPY_ROW: len(one)})
    share = (share / shape.n_draws).reindex(list(calls)).fillna(shape.n_designs)
    each = quiet[share.index] / share
    return pd.DataFrame(
        {
            "one evaluation [µs]": 1e6 * each,
            "x loop": each[LOOP] / each,
            "x loop to the tolerance": each[LOOP_TO_REST] / each,
            "sweeps per line": pd.Series({NUMBA_ROW: sums[NUMBA_ROW].sweeps(rows), LOOP: SWEEPS}),
            "largest error of the sum [dB]": {
                name: np.abs(level - exact).max() for name, level in found.items()
            },
        }
    ).loc[list(calls)]


def report() -> str:
    """Measure every shape and return the tables as text."""
    tables = []
    for shape in SHAPES:
        table = measure(shape, seconds=10.0)
        columns = {
            "one evaluation [µs]": "{:.0f}".format,
            "x loop": "{:.1f}".format,
            "x loop to the tolerance": "{:.1f}".format,
            "sweeps per line": "{:.2f}".format,
            "largest error of the sum [dB]": "{:.0e}".format,
        }
        tables.append(f"{shape.title}\n{table.to_string(formatters=columns, na_rep='')}")
    return "\n\n".join(tables)
