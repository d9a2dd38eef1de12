"""The truth of a virtual measurement, read from the folder ``truth/``, for comparison only."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.disk import read_arrays
from deboom.names import path_inside


class MeasuredLines(Protocol):
    """Lines of one direction of a mount, as measured: `run` and `frequency` [Hz] of each, (n,)."""

    @property
    def mount(self) -> str:
        """Name of the mount."""

    @property
    def axis(self) -> str:
        """Axis of the mount."""

    @property
    def run(self) -> npt.NDArray[np.str_]:
        """Run of each line, with the piece where a mount has several."""

    @property
    def frequency(self) -> RealArray:
        """Frequency of each line [Hz]."""


@dataclass(frozen=True, eq=False)
class SetTruth:
    """True stiffness of all mounts of one set, run by run.

    - `path`: where it was read.
    - `runs`, `channels`: names along the first and the last axis.
    - `frequency` (n_frequency,): [Hz].
    - `stiffness` (n_run, n_frequency, n_channel): complex dynamic stiffness [N/m].
    """

    path: Path
    runs: tuple[str, ...]
    channels: tuple[str, ...]
    frequency: RealArray
    stiffness: ComplexArray

    def at(self, measured: MeasuredLines) -> ComplexArray:
        """Return the true stiffness at every line of a map, shape (n,) [N/m].

        - raises InputError: a line, run or channel that the truth does not know.
        """
        labels, inverse = np.unique(measured.run, return_inverse=True)
        places = []
        for label in labels:
            run, _, piece = str(label).partition(" ")
            channel = " ".join(filter(None, (measured.mount, piece, measured.axis)))
            if run not in self.runs or channel not in self.channels:
                raise InputError(f"{self.path}: no truth of channel {channel} in run {run}")
            places.append((self.runs.index(run), self.channels.index(channel)))
        rows = np.searchsorted(self.frequency, measured.frequency - 1e-6)
        nearest = self.frequency[np.minimum(rows, self.frequency.size - 1)]
        if not np.allclose(nearest, measured.frequency, rtol=0, atol=1e-6):
            raise InputError(f"{self.path}: its frequency lines are not those of the campaign")
        run_place, channel_place = np.array(places)[inverse].T
        return np.asarray(self.stiffness[run_place, rows, channel_place])


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


SAME_LINE = 1e-6
"""Largest relative distance of a line of a sweep from one of the truth [1]."""


class SweepLines(Protocol):
    """Lines of a sweep: its name `sweep` and their `frequency` [Hz], (n,)."""

    @property
    def sweep(self) -> str:
        """Name of the sweep."""

    @property
    def frequency(self) -> RealArray:
        """Frequency of each line [Hz]."""


@dataclass(frozen=True, eq=False)
class UnbalanceTruth:
    """What truly turns and pushes.

    - `path`: where it was read.
    - `static`, `dynamic`: of all sources together [kg m, kg m²].
    - `loads` (n_frequency, 6): sweep → load at the virtual point at its lines, gas included [N, N
      m]; sweeps over time have none.
    - `lines` (n_frequency,): sweep → its lines [Hz].
    """

    path: Path
    static: complex
    dynamic: complex
    loads: Mapping[str, ComplexArray]
    lines: Mapping[str, RealArray]

    def load_of(self, sweep: SweepLines) -> ComplexArray | None:
        """Return the load at the lines of a sweep (n_frequency, 6) [N, N m]; None where unknown."""
        if sweep.sweep not in self.loads:
            return None
        lines = self.lines[sweep.sweep]
        places = np.argmin(np.abs(lines[:, np.newaxis] - sweep.frequency), axis=0)
        if not np.allclose(lines[places], sweep.frequency, rtol=SAME_LINE, atol=0.0):
            return None  # nothing is interpolated
        return np.asarray(self.loads[sweep.sweep][places])


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
