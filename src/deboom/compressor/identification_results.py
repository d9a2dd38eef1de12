"""Compressors identified from hammer tests, virtual ones compared with their truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.model import CompressorModel
from deboom.compressor.mount_shares import MountShares
from deboom.compressor.parameter_information import ALONE, PRIOR_DOMINATED, REFERENCE_FREQUENCY
from deboom.compressor.parameters import MinimalParameters, ThesisParameters
from deboom.compressor.thesis_parameter_fit import ThesisFit
from deboom.measurement.compressor_test import CompressorMount

if TYPE_CHECKING:
    import numpy.typing as npt

RUBBER_LINES = np.arange(10.0, 30.5, 0.5)
"""Where the gain is judged: around the rigid-body modes [Hz]."""
SMALLEST_SHARE = 1e-6
"""Of a parameter in the null space, above which it is visible with others only."""
_SHOWN_UNIT = {
    "m": ("mm", 1e3),
    "rad": ("°", 180 / np.pi),
    "N/m": ("N/mm", 1e-3),
    "kg m^2": ("kg cm²", 1e4),
}


@dataclass(frozen=True, eq=False)
class CompressorTruth:
    """What the compressor truly is, and the file that says so."""

    path: Path
    model: CompressorModel
    mounts: tuple[CompressorMount, ...]


@dataclass(frozen=True, eq=False)
class IdentificationErrors:
    """How far an identification is from the truth.

    - `mass`, `inertia`, `stiffness`, `gain_real`, `gain_imaginary`: relative [1]: inertia, the
      worst moment; stiffness, the Frobenius norm of K_VP with rotations scaled by the
      characteristic length; gain, the largest in 10-30 Hz, both with a real part of 1 at
      `REFERENCE_FREQUENCY`.
    - `centre`: distance of the centre of gravity [m].
    - `scores` (n_parameters,): errors of the parameters in units of their stated standard deviation
      [1].
    """

    mass: float
    centre: float
    inertia: float
    stiffness: float
    gain_real: float
    gain_imaginary: float
    scores: RealArray


def errors_of(identification: Identification, truth: CompressorTruth) -> IdentificationErrors:
    """Compare the result of an identification with the truth."""
    model, true = identification.calibrated.model, truth.model
    parametrisation = MinimalParameters(identification.length)
    deviation = np.sqrt(np.diag(identification.calibrated.parameter_covariance))
    unit = np.repeat([1.0, 1 / identification.length], 3)
    stiffness, true_stiffness = (
        _stated(compressor) * np.outer(unit, unit) for compressor in (model, true)
    )
    gain = _gain(model, RUBBER_LINES) / _gain(true, RUBBER_LINES) - 1
    moments = np.diag(model.inertia) / np.diag(true.inertia) - 1
    return IdentificationErrors(
        abs(model.mass / true.mass - 1),
        float(np.linalg.norm(model.centre - true.centre)),
        float(np.abs(moments).max()),
        float(np.linalg.norm(stiffness - true_stiffness) / np.linalg.norm(true_stiffness)),
        float(np.abs(gain[0]).max()),
        float(np.abs(gain[1]).max()),
        (identification.calibrated.values - parametrisation.values_of(true)) / deviation,
    )


def _stated(model: CompressorModel) -> RealArray:
    """K_VP at the reference line [N/m, N/rad, N m/rad]."""
    return np.asarray(model.stiffness * model.gain.real.at(REFERENCE_FREQUENCY))


def _gain(model: CompressorModel, lines: npt.ArrayLike) -> RealArray:
    """Real and imaginary part with a real part of 1 at the reference line, shape (2, f)."""
    values = model.gain.at(lines) / model.gain.real.at(REFERENCE_FREQUENCY)
    return np.stack([values.real, values.imag])


@dataclass(frozen=True, eq=False)
class IdentifiedTest:
    """One test, identified.

    - `thesis`: none without a drawing, or where it was not asked for.
    - `identical`: none where it was not asked for.
    - `truth`: none where it is not known.
    - `seconds`: of the identification alone [s].
    - `inputs_sha256`: hashes of the hammer test's files; empty where they do not stay.
    """

    identification: Identification
    thesis: ThesisFit | None
    identical: MountShares | None
    truth: CompressorTruth | None
    seconds: float
    inputs_sha256: Mapping[str, str]

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.identification.test.input_files, *truth)


def condition_at_100_hz(identification: Identification, length: float) -> float:
    """Condition number of the inertance near 100 Hz, rotations times a length [m], as below [1]."""
    nearest = int(np.argmin(np.abs(identification.inertance.frequency - 100.0)))
    return float(condition_numbers(identification, length)[nearest])


def condition_numbers(identification: Identification, length: float) -> RealArray:
    """Condition number of the measured inertance, rotations times a length, shape (f,) [1].

    - `length`: that counts as one radian [m]; 1 for SI units.
    """
    unit = np.repeat([1.0, length], 3)
    return np.asarray(np.linalg.cond(identification.inertance.values * np.outer(unit, unit)))


def calibrated_inertance(identification: Identification) -> ComplexArray:
    """Measured inertance at the virtual point by self-calibrated sensors and impacts, (f, 6, 6)."""
    response, excitation = (
        np.linalg.pinv(matrix)
        for matrix in (
            identification.calibrated.response_matrix,
            identification.calibrated.excitation_matrix,
        )
    )
    return np.asarray(response @ identification.raw.frf.values @ excitation.T)


def identifiability_table(test: IdentifiedTest, thesis: ThesisFit) -> pd.DataFrame:
    """Put the thesis's numbers side by side with their bounds and what the test says of each."""
    parametrisation = thesis.fit.parametrisation
    assert isinstance(parametrisation, ThesisParameters)
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
        "posterior deviation": factor * thesis.knowledge.posterior,
        "posterior over prior [1]": thesis.knowledge.ratio,
        "verdict": verdicts(thesis),
    }
    if test.truth is not None:
        names = tuple(mount.name for mount in test.truth.mounts)
        true = ThesisParameters(names).values_of(test.truth.model, test.truth.mounts)
        table["truth"] = factor * true
    return pd.DataFrame(table)


def verdicts(thesis: ThesisFit) -> list[str]:
    """Say of each of the thesis's numbers whether the test knows it."""
    words = []
    for share, ratio in zip(thesis.seen.participation, thesis.knowledge.ratio, strict=True):
        if share >= ALONE:
            words.append("invisible")
        elif ratio > PRIOR_DOMINATED:
            words.append("prior-dominated")
        elif share > SMALLEST_SHARE:
            words.append("with others only")
        else:
            words.append("identified")
    return words


def placement_table(test: IdentifiedTest) -> pd.DataFrame:
    """List errors of gain, place and angle of sensors and impacts, with what was known before."""
    calibration = test.identification.calibrated
    prior = calibration.placement.deviations(test.identification.test.tolerances)
    posterior = np.sqrt(np.diag(calibration.covariance)[calibration.values.size :])
    units = [_placement_unit(name) for name in calibration.placement.names]
    factor = np.array([scale for _, scale in units])
    return pd.DataFrame(
        {
            "error of": calibration.placement.names,
            "unit": [unit for unit, _ in units],
            "found": factor * calibration.errors,
            "posterior deviation": factor * posterior,
            "prior deviation": factor * prior,
            "posterior over prior [1]": posterior / prior,
        }
    )


def _placement_unit(name: str) -> tuple[str, float]:
    if " position " in name:
        return "mm", 1e3
    return ("°", 180 / np.pi) if " angle " in name else ("%", 100.0)
