"""The truth of a virtual measurement, read from the folder ``truth/``, for comparison only."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from deboom.compressor.identification_results import CompressorTruth
from deboom.compressor.measured_unbalance import UnbalanceTruth
from deboom.compressor.model import CompressorModel, GainFactor
from deboom.errors import InputError
from deboom.files.disk import read_arrays
from deboom.measurement.compressor_test import CompressorMount
from deboom.mounts.characterised_bench import SetTruth
from deboom.names import path_inside


def read_set_truth(campaign_folder: Path, mount_set: str) -> SetTruth | None:
    """Read the truth of a virtual campaign.

    - `campaign_folder`: folder of ``campaign.toml``.
    - `mount_set`: parts on the bench.
    - returns none for a campaign that nobody knows the truth of.
    """
    path = path_inside(Path(campaign_folder), f"truth/{mount_set}.npz")
    if not path.is_file():
        return None
    arrays = read_arrays(path, "write the virtual campaign again")
    return SetTruth(
        path=path,
        runs=tuple(arrays["runs"].tolist()),
        channels=tuple(arrays["channels"].tolist()),
        frequency=arrays["frequency"],
        stiffness=arrays["stiffness"],
    )


OPERATION_FILE = Path("truth") / "operation.json"


def read_unbalance_truth(folder: Path) -> UnbalanceTruth:
    """Read the truth beside a virtual operating test.

    - raises InputError: a truth file that is missing or cannot be read.
    """
    path = folder / OPERATION_FILE
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        static = complex(*content["static_unbalance_kg_m"])
        dynamic = complex(*content["dynamic_unbalance_kg_m2"])
        loads, lines = {}, {}
        for number, name in enumerate(content["sweeps"]):
            arrays = read_arrays(path.parent / f"{number}.npz", "write the virtual test again")
            loads[str(name)], lines[str(name)] = arrays["load"], arrays["frequency"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} is no truth of a running compressor: {error}") from None
    return UnbalanceTruth(path, static, dynamic, loads, lines)


def read_vehicle_truth(
    folder: Path, run: str
) -> tuple[Mapping[str, Any], Mapping[str, Any]] | None:
    """Read the truth of a virtual vehicle: arrays of its run, and of its body.

    - returns none for a vehicle that nobody knows the truth of.
    """
    paths = [path_inside(folder, f"truth/{name}.npz") for name in (run, "vehicle")]
    if not all(path.is_file() for path in paths):
        return None
    driven, body = (read_arrays(path, "write the virtual vehicle again") for path in paths)
    return driven, body


TRUTH_FILE = Path("truth") / "truth.json"


def read_compressor_truth(folder: Path) -> CompressorTruth:
    """Read the truth beside a virtual test.

    - raises InputError: a truth file that is missing or cannot be read.
    """
    path = folder / TRUTH_FILE
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
            f"{path}: not the truth of a virtual compressor ({error}); write the test again, or "
            "leave out --truth"
        ) from None
    return CompressorTruth(path, model, mounts)
