"""The virtual compressor's own truth, for comparison only: no identification ever sees it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.gain import GainFactor
from deboom.compressor.minimal_parameters import MinimalParameters
from deboom.compressor.model import CompressorModel
from deboom.compressor.quantities import REFERENCE_FREQUENCY, quantities, quantity_deviations
from deboom.errors import InputError
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.rigid_body import rotation_matrix

if TYPE_CHECKING:
    import numpy.typing as npt

    from deboom.compressor.identical_fit import IdenticalFit
    from deboom.compressor.identify import Identification

TRUTH_FILE = Path("truth") / "truth.json"
RUBBER_LINES = np.arange(10.0, 30.5, 0.5)
"""Where the gain is judged: around the rigid-body modes [Hz]."""


@dataclass(frozen=True, eq=False)
class CompressorTruth:
    """What the compressor truly is.

    Parameters
    ----------
    path : Path
        Where it was read.
    model : CompressorModel
    mounts : tuple of CompressorMount
    """

    path: Path
    model: CompressorModel
    mounts: tuple[CompressorMount, ...]


@dataclass(frozen=True, eq=False)
class IdentificationErrors:
    """How far an identification is from the truth.

    Parameters
    ----------
    mass, inertia, stiffness, gain_real, gain_imaginary : float
        Relative [1]: inertia, the worst moment; stiffness, the Frobenius norm of K_VP with
        rotations scaled by the characteristic length; gain, the largest in 10-30 Hz, both with
        a real part of 1 at `REFERENCE_FREQUENCY`.
    centre : float
        Distance of the centre of gravity [m].
    scores : array, shape (n_parameters,)
        Errors of the parameters in units of their stated standard deviation [1].
    """

    mass: float
    centre: float
    inertia: float
    stiffness: float
    gain_real: float
    gain_imaginary: float
    scores: RealArray


def read_compressor_truth(folder: Path) -> CompressorTruth | None:
    """Read the truth beside a virtual test; None where there is none.

    Raises
    ------
    InputError
        A truth file that cannot be read.
    """
    path = folder / TRUTH_FILE
    if not path.is_file():
        return None
    try:
        truth = json.loads(path.read_text(encoding="utf-8"))
        model = CompressorModel(
            truth["mass_kg"],
            np.array(truth["centre_of_gravity_m"]),
            np.array(truth["inertia_kg_m2"]),
            np.array(truth["static_stiffness"]),
            GainFactor.of(truth["gain"]),
        )
        mounts = tuple(
            CompressorMount(
                mount["name"],
                np.array(mount["position_m"]),
                np.array(mount["rotation_rad"]),
                np.array(mount["stiffness_n_per_m"]),
            )
            for mount in truth["mounts"]
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: not the truth of a virtual compressor ({error}); write the test again"
        ) from None
    return CompressorTruth(path, model, mounts)


def errors_of(found: Identification, truth: CompressorTruth) -> IdentificationErrors:
    """Compare the result of an identification with the truth.

    Parameters
    ----------
    found : Identification
    truth : CompressorTruth

    Returns
    -------
    IdentificationErrors
    """
    model, true = found.calibrated.model, truth.model
    parametrisation = MinimalParameters(found.length)
    deviation = np.sqrt(np.diag(found.calibrated.parameter_covariance))
    unit = np.repeat([1.0, 1 / found.length], 3)
    stiffness, true_stiffness = (_stated(one) * np.outer(unit, unit) for one in (model, true))
    gain = _gain(model, RUBBER_LINES) / _gain(true, RUBBER_LINES) - 1
    moments = np.diag(model.inertia) / np.diag(true.inertia) - 1
    return IdentificationErrors(
        abs(model.mass / true.mass - 1),
        float(np.linalg.norm(model.centre - true.centre)),
        float(np.abs(moments).max()),
        float(np.linalg.norm(stiffness - true_stiffness) / np.linalg.norm(true_stiffness)),
        float(np.abs(gain[0]).max()),
        float(np.abs(gain[1]).max()),
        (found.calibrated.values - parametrisation.values_of(true)) / deviation,
    )


def quantity_scores(found: Identification, truth: CompressorTruth) -> RealArray:
    """Errors of what an engineer asks for, in units of their stated standard deviation [1]."""
    error = quantities(found.calibrated.model).values - quantities(truth.model).values
    return np.asarray(error / quantity_deviations(found.calibrated))


def mounting_errors(fit: IdenticalFit, truth: CompressorTruth) -> tuple[float, float]:
    """Largest error of place [m], and of the direction of the axis [rad], of identical mounts."""
    places, angles = [], []
    for found, true in zip(fit.mounts, truth.mounts, strict=True):
        places.append(float(np.linalg.norm(found.position - true.position)))
        along = found.orientation[:, 0] @ rotation_matrix(true.rotation)[:, 0]
        angles.append(float(np.arccos(np.clip(abs(along), 0.0, 1.0))))
    return max(places), max(angles)


def _stated(model: CompressorModel) -> RealArray:
    """K_VP at the reference line [N/m, N/rad, N m/rad]."""
    return np.asarray(model.stiffness * model.gain.real.at(REFERENCE_FREQUENCY))


def _gain(model: CompressorModel, lines: npt.ArrayLike) -> RealArray:
    """Real and imaginary part with a real part of 1 at the reference line, shape (2, f)."""
    values = model.gain.at(lines) / model.gain.real.at(REFERENCE_FREQUENCY)
    return np.stack([values.real, values.imag])
