"""An identified compressor as a plain JSON file that other studies load."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from deboom.compressor.identify import IdentifiedCompressor
from deboom.compressor.model import GAIN_PARAMETERS, CompressorModel, GainFactor
from deboom.errors import InputError
from deboom.files.disk import read_document, replace_text

FORMAT = "deboom identified compressor"
VERSION = 1


def compressor_document(compressor: IdentifiedCompressor) -> dict[str, Any]:
    """Put a compressor into words and numbers that JSON knows; units stand in the keys.

    - `compressor`.
    """
    model = compressor.model
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": compressor.name,
        "mass_kg": model.mass,
        "centre_of_gravity_m": model.centre.tolist(),
        "inertia_about_centre_kg_m2": model.inertia.tolist(),
        "stiffness_at_virtual_point": model.stiffness.tolist(),
        "stiffness_units": "N/m, N/rad, N m/rad; static, times the gain it is dynamic",
        "gain": dict(zip(GAIN_PARAMETERS, model.gain.values.tolist(), strict=True)),
        "characteristic_length_m": compressor.length,
        "reference_frequency_hz": compressor.reference_frequency,
        "parameters": {
            "names": list(compressor.parameter_names),
            "values": compressor.values.tolist(),
            "covariance": compressor.covariance.tolist(),
        },
        "response": {
            "channels": list(compressor.channels),
            "matrix": compressor.response.tolist(),
        },
        "excitation": {
            "impacts": list(compressor.impacts),
            "matrix": compressor.excitation.tolist(),
        },
        "placement": {
            "names": list(compressor.placement_names),
            "errors": compressor.placement_errors.tolist(),
            "deviations": compressor.placement_deviations.tolist(),
        },
        "reduced_chi": compressor.reduced_chi,
        "bands_hz": [list(band) for band in compressor.bands],
        "alarms": list(compressor.alarms),
        "inputs_sha256": dict(compressor.inputs_sha256),
    }


def write_compressor_model(path: Path, compressor: IdentifiedCompressor) -> None:
    """Write a compressor; the file appears complete or not at all.

    - `path`: replaced if it is there.
    - `compressor`.
    - raises InputError: a folder that cannot be written.
    """
    document = compressor_document(compressor)
    replace_text(path, json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def read_compressor_model(path: Path) -> IdentifiedCompressor:
    """Read what `write_compressor_model` wrote; `model` is the compressor.

    - `path`.
    - raises InputError: the file is missing, no JSON, of another format or version, or lacks an
      entry.
    """
    kind = "identified compressor: `deboom identify` writes one"
    document = read_document(path, FORMAT, VERSION, kind, "identify the compressor again")
    try:
        return _compressor(document)
    except KeyError as error:
        raise InputError(f"{path} lacks the entry {error}: identify the compressor again") from None
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path} holds an entry of the wrong kind ({error}): identify the compressor again"
        ) from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _compressor(document: dict[str, Any]) -> IdentifiedCompressor:
    parameters, placement = document["parameters"], document["placement"]
    response, excitation = document["response"], document["excitation"]
    model = CompressorModel(
        float(document["mass_kg"]),
        np.array(document["centre_of_gravity_m"], dtype=float),
        np.array(document["inertia_about_centre_kg_m2"], dtype=float),
        np.array(document["stiffness_at_virtual_point"], dtype=float),
        GainFactor.of([document["gain"][name] for name in GAIN_PARAMETERS]),
    )
    return IdentifiedCompressor(
        name=str(document["name"]),
        model=model,
        length=float(document["characteristic_length_m"]),
        reference_frequency=float(document["reference_frequency_hz"]),
        parameter_names=tuple(parameters["names"]),
        values=np.array(parameters["values"], dtype=float),
        covariance=np.array(parameters["covariance"], dtype=float),
        channels=tuple(response["channels"]),
        response=np.array(response["matrix"], dtype=float),
        impacts=tuple(excitation["impacts"]),
        excitation=np.array(excitation["matrix"], dtype=float),
        placement_names=tuple(placement["names"]),
        placement_errors=np.array(placement["errors"], dtype=float),
        placement_deviations=np.array(placement["deviations"], dtype=float),
        reduced_chi=float(document["reduced_chi"]),
        bands=tuple((float(low), float(high)) for low, high in document["bands_hz"]),
        alarms=tuple(document["alarms"]),
        inputs_sha256=dict(document["inputs_sha256"]),
    )
