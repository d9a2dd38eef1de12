"""Coupled motion of smooth data: interpolated over frequency in plain numpy, against exact loops.

Stiffnesses and loads are smooth functions of frequency, as computed ones are; the kernel compares
itself with the exact solution and refuses others. One thread; calls of 256 draws, short enough for
a quiet moment.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numba import NUMBA_COUPLED
from deboom.vehicles.kernel_smooth_numpy import SMOOTH_COUPLED
from interleaved import quiet_seconds
from kernel_coupled import LOOP, SHAPES, Shape, batched, designs, loop, problem

SMOOTH_ROW = f"kernel {SMOOTH_COUPLED.name}"


def smooth_problem(shape: Shape, seed: int = 1) -> CoupledMotion:
    """Draw a plausible powertrain under a load that is a smooth function of frequency."""
    motion = problem(shape, seed)
    lines = motion.frequency
    place = (lines - 40.0) / 20.0
    load = np.zeros((lines.size, 6), dtype=complex)
    load[:, 2] = 30.0 * (lines / 30.0) ** 2 * np.exp(1.1j)
    load[:, 3] = 150.0 * (30.0 / lines) ** 0.3 * np.exp(0.2j * place)
    load[:, 4] = 25.0 * np.exp(-0.5j) * (1.0 + 0.2 * place)
    load[:, 5] = 10.0 * np.exp(0.7j)
    return replace(motion, load=load)


def measure(shape: Shape, seconds: float) -> pd.DataFrame:
    """Time all rivals side by side; one row each."""
    motion, rows = smooth_problem(shape), designs(replace(shape, n_designs=16))[:256]
    one, few = rows[: shape.n_draws], rows[: max(shape.n_draws // 32, 1)]
    kernels = {f"kernel {k.name}": k for k in (NUMPY_COUPLED, SMOOTH_COUPLED, NUMBA_COUPLED)}
    sums = {name: kernel.prepare(motion) for name, kernel in kernels.items()}
    n_rows = {LOOP: len(few), **dict.fromkeys(sums, len(rows))}
    n_rows[f"kernel {NUMPY_COUPLED.name}"] = len(one)
    calls = {name: (lambda s=s, n=n_rows[name]: s(rows[:n])) for name, s in sums.items()}
    with threadpool_limits(1, user_api="blas"):
        quiet = pd.Series(quiet_seconds({LOOP: lambda: loop(motion, few), **calls}, seconds))
        exact = batched(motion, one)
    each = quiet / pd.Series(n_rows) * shape.n_draws
    errors = {name: np.abs(level_sum(one) - exact).max() for name, level_sum in sums.items()}
    return pd.DataFrame(
        {
            "one evaluation [µs]": 1e6 * each,
            "x loop": each[LOOP] / each,
            "largest error of the sum [dB]": pd.Series(errors),
        }
    ).loc[list(n_rows)]


def report() -> str:
    """Measure every shape and return the tables as text."""
    columns = {
        "one evaluation [µs]": "{:.0f}".format,
        "x loop": "{:.1f}".format,
        "largest error of the sum [dB]": "{:.0e}".format,
    }
    tables = [
        f"{shape.title}\n{measure(shape, 10.0).to_string(formatters=columns, na_rep='')}"
        for shape in SHAPES
    ]
    return "\n\n".join(tables)
