"""Sobol indices of many outputs: one matrix product for all resamples, against SALib's loop.

40 outputs of 12 variables, 4096 base points, first, total and second order, 100 resamples, on the
same values. SALib takes one output after another; its time for one is measured beside ours and
multiplied by the number of outputs. One thread.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.explore.sensitivity import (
    SensitivityInputs,
    SobolIndices,
    fast_sobol_indices,
    sobol_designs,
    sobol_indices,
)
from interleaved import quiet_seconds

N_VARIABLES, N_OUTPUTS, N_BASE, N_RESAMPLES = 12, 40, 4096, 100
OWN, SALIB = "vectorised", "SALib's loop, from one output"


def problem(seed: int = 1) -> tuple[tuple[str, ...], np.ndarray]:
    """Return variables and the values of smooth outputs with couplings, like levels."""
    names = tuple(f"x{place}" for place in range(N_VARIABLES))
    inputs = SensitivityInputs(names, np.full(N_VARIABLES, 0.85), np.full(N_VARIABLES, 1.15))
    designs = sobol_designs(inputs, N_BASE, seed=seed)
    random = np.random.default_rng(seed)
    parts = random.normal(size=(2, N_VARIABLES, N_OUTPUTS))
    return names, 20.0 * np.log10(np.abs(designs @ parts[0] + 1j * (designs @ parts[1])))


def largest_difference(indices: SobolIndices, others: SobolIndices) -> float:
    """Return the largest difference of any index or interval, relative to one plus its size."""
    arrays = [
        (getattr(indices, field.name), getattr(others, field.name))
        for field in fields(indices)
        if isinstance(getattr(indices, field.name), np.ndarray)
    ]
    return max(
        float((np.abs(one - two) / (1.0 + np.abs(two))).max(initial=0.0)) for one, two in arrays
    )


def measure(seconds: float) -> pd.DataFrame:
    """Time both side by side; one row each."""
    names, values = problem()
    outputs = [f"y{place}" for place in range(N_OUTPUTS)]
    options = {"seed": 1, "n_resamples": N_RESAMPLES}

    def own() -> object:
        return fast_sobol_indices(values, names, outputs, **options)

    def salib() -> object:
        return sobol_indices(values[:, :1], names, outputs[:1], **options)

    with threadpool_limits(1, user_api="blas"):
        quiet = pd.Series(quiet_seconds({OWN: own, SALIB: salib}, seconds, calls=2))
    each = quiet * [1, N_OUTPUTS]
    first = fast_sobol_indices(values[:, :1], names, outputs[:1], **options)
    difference = largest_difference(salib(), first)
    return pd.DataFrame(
        {
            "all outputs [s]": each,
            "x SALib": each[SALIB] / each,
            "largest difference [1]": [difference, np.nan],
        }
    )


def report() -> str:
    """Measure and return the table as text."""
    columns = {
        "all outputs [s]": "{:.2f}".format,
        "x SALib": "{:.0f}".format,
        "largest difference [1]": "{:.0e}".format,
    }
    return measure(10.0).to_string(formatters=columns, na_rep="")
