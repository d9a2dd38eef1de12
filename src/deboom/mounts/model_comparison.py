"""Models of the dynamic stiffness side by side in one table."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray
from deboom.errors import InputError
from deboom.mounts.agreement import agreement
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.element_models import BergModel, KelvinVoigtModel
from deboom.mounts.regression_model import RegressionModel, gaussian_process, spline_surface
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.mounts.stiffness_model import StiffnessModel, StiffnessSamples

if TYPE_CHECKING:
    import pandas as pd

Fit = Callable[[StiffnessSamples], StiffnessModel]
"""How a model comes out of measured lines."""

PROCESS_LINES = 600
"""Lines that the Gaussian process is fitted to: its effort grows with their cube."""


def standard_models() -> dict[str, Fit]:
    """Models worth comparing: cubics in one, two and cross-validated pieces, and alternatives."""
    fit_surface = DynamicStiffnessSurface.fit

    def cubics(options: PieceOptions) -> Fit:
        return lambda samples: fit_surface(*samples.lines, options=options, run=samples.run)

    return {
        "one cubic": cubics(PieceOptions(pieces=1)),
        "two cubics, threshold": cubics(PieceOptions(split="threshold")),
        "two cubics, least squares": cubics(PieceOptions()),
        "cubics, cross-validated": cubics(PieceOptions(pieces="cv")),
        "Kelvin-Voigt": lambda samples: KelvinVoigtModel.fit(*samples.lines),
        "Berg": lambda samples: BergModel.fit(*samples.lines),
        "splines": lambda samples: RegressionModel.fit(*samples.lines, regressor=spline_surface()),
        "Gaussian process": lambda samples: RegressionModel.fit(
            *samples.lines, regressor=gaussian_process(), max_lines=PROCESS_LINES
        ),
    }


def compare_models(
    fits: Mapping[str, Fit],
    training: StiffnessSamples,
    check: StiffnessSamples,
    truth: ComplexArray | None = None,
) -> pd.DataFrame:
    """Fit several models to the same lines and hold them against others.

    Parameters
    ----------
    fits : mapping of str to callable
        Name of each model, and how it is fitted; `standard_models` gives some.
    training : StiffnessSamples
        Lines to fit, with the names of their runs where a model is cross-validated.
    check : StiffnessSamples
        Lines to compare with, such as runs held out. Those inside of every model's region count.
    truth : array, shape (n_check,), optional
        True stiffness at the lines of `check`, where a virtual bench knows it [N/m].

    Returns
    -------
    pandas.DataFrame
        One row per model: number of parameters, lines compared and their share, R² of both parts of
        stiffness and force, rms error against measurement (and truth), seconds to fit.

    Raises
    ------
    InputError
        No models; or no line to check inside of the region of all models.
    """
    import pandas as pd

    if not fits:
        raise InputError("there are no models to compare")
    variables = (check.preload, check.amplitude, check.frequency)
    models, seconds = {}, {}
    for name, fit in fits.items():
        begin = time.perf_counter()
        models[name] = fit(training)
        seconds[name] = time.perf_counter() - begin
    inside = np.all([model.inside(*variables) for model in models.values()], axis=0)
    if not inside.any():
        raise InputError("no line to check lies where all models were measured")
    compared = StiffnessSamples(
        check.preload[inside],
        check.displacement[inside],
        check.frequency[inside],
        check.stiffness[inside],
    )
    rows = []
    for name, model in models.items():
        modelled = model.predict(compared.preload, compared.amplitude, compared.frequency)
        result = agreement(compared, modelled)
        row = {
            "model": name,
            "parameters [1]": model.n_parameters,
            "lines compared [1]": result.n_lines,
            "share of lines [%]": 100 * result.n_lines / len(check),
            "R² Re K [%]": 100 * result.r2_real,
            "R² Im K [%]": 100 * result.r2_imag,
            "R² Re force [%]": 100 * result.r2_force_real,
            "R² Im force [%]": 100 * result.r2_force_imag,
            "rms error [%]": 100 * result.rms_error,
        }
        if truth is not None:
            true = np.asarray(truth)[inside]
            error = np.abs(modelled - true) / np.abs(true)
            row["rms error against truth [%]"] = 100 * float(np.sqrt(np.mean(error**2)))
        rows.append({**row, "time to fit [s]": seconds[name]})
    return pd.DataFrame(rows)
