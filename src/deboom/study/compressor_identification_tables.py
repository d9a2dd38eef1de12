"""Tables of an identified compressor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from deboom.compressor.identifiability import ALONE, PRIOR_DOMINATED
from deboom.compressor.quantities import quantities, quantity_deviations
from deboom.compressor.thesis_parameters import ThesisParameters
from deboom.measurement.quality_check import quality_table
from deboom.study.compressor_identification_truth import errors_of, mounting_errors

if TYPE_CHECKING:
    from deboom.arrays import RealArray
    from deboom.compressor.identical_fit import IdenticalFit
    from deboom.compressor.thesis_fit import ThesisFit
    from deboom.study.compressor_identification import IdentifiedTest

_SHOWN_UNIT = {"m": ("mm", 1e3), "rad": ("°", 180 / np.pi), "N/m": ("N/mm", 1e-3)}
_SHOWN_UNIT |= {"kg m^2": ("kg cm²", 1e4)}
SMALLEST_SHARE = 1e-6
"""Of a parameter in the null space, above which it is visible with others only."""


def tables_of(tests: Sequence[IdentifiedTest]) -> dict[str, pd.DataFrame]:
    """Make all tables: of the first compressor in detail, of all of them in ``cases``."""
    first = tests[0]
    tables = {
        "parameters": parameter_table(first),
        "modes": mode_table(first),
        "quality": pd.DataFrame(quality_table(first.found.quality)),
        "knowledge": knowledge_table(first),
        "placement": placement_table(first),
        "correlations": correlation_table(first),
        "held_out": held_out_table(first),
    }
    if first.thesis is not None:
        tables["identifiability"] = identifiability_table(first, first.thesis)
        tables["null_space"] = null_space_table(first.thesis)
        tables["fits"] = fit_table(first.thesis)
    if first.identical is not None:
        tables["identical_mounts"] = identical_table(first.identical)
    if all(test.truth is not None for test in tests):
        tables["cases"] = case_table(tests)
    return tables


def parameter_table(test: IdentifiedTest) -> pd.DataFrame:
    """Tell what was found: start, identified, standard deviation, truth where it is known."""
    found = test.found
    identified = quantities(found.calibrated.model)
    start = quantities(found.point.parametrisation.model(found.start))
    table = {
        "parameter": identified.names,
        "unit": identified.units,
        "start": start.values,
        "identified": identified.values,
        "standard deviation": quantity_deviations(found.calibrated),
    }
    if test.truth is not None:
        table["truth"] = quantities(test.truth.model).values
    return pd.DataFrame(table)


def mode_table(test: IdentifiedTest) -> pd.DataFrame:
    """Rigid-body modes of the identified compressor."""
    modes = test.found.modes
    shares = {
        f"energy {motion} [%]": 100 * modes.energy[row]
        for row, motion in enumerate(("x", "y", "z", "rx", "ry", "rz"))
    }
    return pd.DataFrame(
        {
            "mode": [f"{number}, mainly {name}" for number, name in enumerate(modes.leading, 1)],
            "frequency [Hz]": modes.frequency,
            "loss factor [1]": modes.loss_factor,
            **shares,
        }
    )


def identifiability_table(test: IdentifiedTest, thesis: ThesisFit) -> pd.DataFrame:
    """Put the thesis's numbers side by side with their bounds and what the test says of each."""
    parametrisation = thesis.fit.parametrisation
    shown = [_SHOWN_UNIT.get(unit, (unit, 1.0)) for unit in parametrisation.units]
    factor = np.array([scale for _, scale in shown])
    held = set(thesis.fit.at_bound)
    table = {
        "parameter": parametrisation.names,
        "unit": [unit for unit, _ in shown],
        "start": factor * thesis.start,
        "lower bound": factor * thesis.bounds.lower,
        "upper bound": factor * thesis.bounds.upper,
        "fitted": factor * thesis.fit.values,
        "at its bound": ["yes" if name in held else "" for name in parametrisation.names],
        "share in the null space [1]": thesis.seen.participation,
        "posterior deviation": factor * thesis.known.posterior,
        "posterior over prior [1]": thesis.known.ratio,
        "verdict": verdicts(thesis),
    }
    if test.truth is not None:
        names = tuple(mount.name for mount in test.truth.mounts)
        true = ThesisParameters(names).values_of(test.truth.model, test.truth.mounts)
        table["truth"] = factor * true
    return pd.DataFrame(table)


def null_space_table(thesis: ThesisFit) -> pd.DataFrame:
    """Say in words which changes leave every measurement as it is."""
    own_axis = (" rotation x", "'s rotation about its own axis")
    return pd.DataFrame(
        {
            "change": [str(number) for number in range(1, 1 + len(thesis.seen.null_space))],
            "in words": [one.statement.replace(*own_axis) for one in thesis.seen.null_space],
        }
    )


def verdicts(thesis: ThesisFit) -> list[str]:
    """Say of each of the thesis's numbers whether the test knows it."""
    words = []
    for share, ratio in zip(thesis.seen.participation, thesis.known.ratio, strict=True):
        if share >= ALONE:
            words.append("invisible")
        elif ratio > PRIOR_DOMINATED:
            words.append("prior-dominated")
        elif share > SMALLEST_SHARE:
            words.append("with others only")
        else:
            words.append("identified")
    return words


def fit_table(thesis: ThesisFit) -> pd.DataFrame:
    """Optimisers of the thesis's fit side by side."""
    fits = [("least squares, trf", thesis.fit, thesis.seconds)]
    if thesis.reference is not None:
        fits.append(("SLSQP, near to GRG", thesis.reference, thesis.reference_seconds))
    return pd.DataFrame(
        {
            "optimiser": [name for name, _, _ in fits],
            "cost [1]": [fit.cost for _, fit, _ in fits],
            "evaluations": [fit.n_evaluations for _, fit, _ in fits],
            "time [s]": [seconds for _, _, seconds in fits],
            "parameters at a bound": [len(fit.at_bound) for _, fit, _ in fits],
            "converged": [fit.converged for _, fit, _ in fits],
        }
    )


def knowledge_table(test: IdentifiedTest) -> pd.DataFrame:
    """Tell of each minimal parameter what was known, and what is known now."""
    known = test.found.known
    dominated = set(known.prior_dominated)
    finite = np.isfinite(known.prior)
    return pd.DataFrame(
        {
            "parameter": known.names,
            "identified [1]": test.found.calibrated.values,
            "posterior deviation [1]": known.posterior,
            "prior deviation [1]": np.where(finite, known.prior, np.nan),
            "posterior over prior [1]": known.ratio,
            "mark": ["prior-dominated" if name in dominated else "" for name in known.names],
        }
    )


def placement_table(test: IdentifiedTest) -> pd.DataFrame:
    """Errors of gains, places and angles that the test revealed."""
    kept = test.kept
    prior = test.found.calibrated.placement.deviations(test.found.test.tolerances)
    shown = [_placement_unit(name) for name in kept.placement_names]
    factor = np.array([scale for _, scale in shown])
    return pd.DataFrame(
        {
            "error of": kept.placement_names,
            "unit": [unit for unit, _ in shown],
            "found": factor * kept.placement_errors,
            "posterior deviation": factor * kept.placement_deviations,
            "prior deviation": factor * prior,
            "posterior over prior [1]": kept.placement_deviations / prior,
        }
    )


def correlation_table(test: IdentifiedTest) -> pd.DataFrame:
    """Pairs of parameters that the test hardly tells apart."""
    pairs = test.found.known.strong_correlations
    return pd.DataFrame(
        {
            "parameter": [one for one, _, _ in pairs],
            "and": [other for _, other, _ in pairs],
            "correlation [1]": [value for _, _, value in pairs],
        }
    )


def held_out_table(test: IdentifiedTest) -> pd.DataFrame:
    """Predictions of what took no part in the fit."""
    checks = test.found.held_out
    return pd.DataFrame(
        {
            "held out": [check.what for check in checks],
            "reduced χ [1]": [check.reduced_chi for check in checks],
            "error over measured, rms [%]": [100 * check.relative_error for check in checks],
        }
    )


def identical_table(fit: IdenticalFit) -> pd.DataFrame:
    """Place, tilt and stiffness of identical round mounts."""
    parametrisation, n = fit.calibrated.parametrisation, len(fit.drawn)
    values = fit.calibrated.values[10 : 10 + 5 * n]
    deviation = fit.deviations
    unit = ["mm"] * (3 * n) + ["°"] * (2 * n)
    factor = np.array([1e3] * (3 * n) + [180 / np.pi] * (2 * n))
    stiffness = fit.mounts[0].stiffness[:2]
    rows: dict[str, list[object] | RealArray] = {
        "parameter": [
            *parametrisation.names[10 : 10 + 5 * n],
            "axial stiffness",
            "radial stiffness",
        ],
        "unit": [*unit, "N/mm", "N/mm"],
        "identified": np.concatenate([factor * values, 1e-3 * stiffness]),
        "standard deviation": np.concatenate(
            [factor * deviation[: 5 * n], 1e-3 * stiffness * deviation[5 * n :]]
        ),
    }
    return pd.DataFrame(rows)


def case_table(tests: Sequence[IdentifiedTest]) -> pd.DataFrame:
    """Errors of every compressor against its truth."""
    rows = []
    for test in tests:
        assert test.truth is not None
        error = errors_of(test.found, test.truth)
        row: dict[str, object] = {
            "compressor": test.found.test.name,
            "mass [%]": 100 * error.mass,
            "centre of gravity [mm]": 1e3 * error.centre,
            "inertia [%]": 100 * error.inertia,
            "K_VP [%]": 100 * error.stiffness,
            "Re gain [%]": 100 * error.gain_real,
            "Im gain [%]": 100 * error.gain_imaginary,
            "within 1 σ [%]": 100 * float(np.mean(np.abs(error.scores) < 1)),
            "reduced χ [1]": test.found.calibrated.reduced_chi,
            "time [s]": test.seconds,
        }
        if test.identical is not None:
            place, angle = mounting_errors(test.identical, test.truth)
            row |= {"mount place [mm]": 1e3 * place, "mount axis [°]": float(np.degrees(angle))}
        rows.append(row)
    return pd.DataFrame(rows)


def _placement_unit(name: str) -> tuple[str, float]:
    if " position " in name:
        return "mm", 1e3
    return ("°", 180 / np.pi) if " angle " in name else ("%", 100.0)
