"""The JSON file of an identified compressor: all of it is written, its bands are read back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from deboom.compressor.identified_compressor import Identification
from deboom.compressor.model import GAIN_PARAMETERS, MountsOverStroke
from deboom.compressor.parameters import MinimalParameters
from deboom.errors import InputError
from deboom.files.disk import read_document

FORMAT = "deboom identified compressor"
VERSION = 1
KIND = "identified compressor: `deboom identify` writes one"
REMEDY = "identify the compressor again"


def compressor_document(
    identification: Identification,
    inputs_sha256: Mapping[str, str],
    mounts: MountsOverStroke | None = None,
) -> dict[str, Any]:
    """Put a compressor into words and numbers that JSON knows; units stand in the keys.

    The compressor with the covariance of its parameters (placement errors integrated out), and what
    the test revealed of the placement: calibrated matrices from the virtual point's motion to the
    channels and from newtons of each impact to the wrench there.

    - `inputs_sha256`: name of each file of the hammer test → its hash.
    - `mounts`: how each mount softens with its stroke, where it is known.
    """
    calibrated = identification.calibrated
    model, n = calibrated.model, calibrated.values.size
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": identification.test.name,
        "mass_kg": model.mass,
        "centre_of_gravity_m": model.centre.tolist(),
        "inertia_about_centre_kg_m2": model.inertia.tolist(),
        "stiffness_at_virtual_point": model.stiffness.tolist(),
        "stiffness_units": "N/m, N/rad, N m/rad; static, times the gain it is dynamic",
        "gain": dict(zip(GAIN_PARAMETERS, model.gain.values.tolist(), strict=True)),
        "characteristic_length_m": identification.length,
        "reference_frequency_hz": MinimalParameters(identification.length).reference_frequency,
        "parameters": {
            "names": list(calibrated.parametrisation.names),
            "values": calibrated.values.tolist(),
            "covariance": calibrated.parameter_covariance.tolist(),
        },
        "response": {
            "channels": list(identification.test.frf.outputs),
            "matrix": calibrated.response_matrix.tolist(),
        },
        "excitation": {
            "impacts": list(identification.test.frf.inputs),
            "matrix": calibrated.excitation_matrix.tolist(),
        },
        "placement": {
            "names": list(calibrated.placement.names),
            "errors": calibrated.errors.tolist(),
            "deviations": np.sqrt(np.diag(calibrated.covariance)[n:]).tolist(),
        },
        "reduced_chi": calibrated.reduced_chi,
        "bands_hz": [list(band) for band in identification.options.bands],
        "alarms": list(identification.alarms),
        "inputs_sha256": dict(inputs_sha256),
    } | ({} if mounts is None else {"mounts_over_stroke": _in_words(mounts)})


def _in_words(mounts: MountsOverStroke) -> dict[str, Any]:
    factors = {
        part: {"limit": law.limit, "drop": law.drop, "scale_m": law.scale}
        for part, law in (("real", mounts.real), ("imaginary", mounts.imaginary))
    }
    return {
        "positions_m": mounts.positions.tolist(),
        "stiffness_at_virtual_point": mounts.stiffness.tolist(),
        "factor": "limit + drop/(1 + stroke/scale_m), on each part of the gain",
    } | factors


def read_fitted_bands(path: Path) -> tuple[tuple[tuple[float, float], ...], dict[str, str]]:
    """Read in which bands a compressor was fitted [Hz], and the hashes of its hammer test.

    - raises InputError: the file is missing, no JSON, of another format or version, or has no
      bands or hashes that can be read.
    """
    document = read_document(path, FORMAT, VERSION, KIND, REMEDY)
    try:
        bands = tuple((float(low), float(high)) for low, high in document["bands_hz"])
        return bands, {str(name): str(of) for name, of in document["inputs_sha256"].items()}
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} lacks bands or hashes ({error}): {REMEDY}") from None


MODEL_FILE = "compressor_model"
"""Stem of the file of an identified compressor in a run."""
