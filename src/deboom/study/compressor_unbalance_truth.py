"""The truth of a running virtual compressor, for comparison only: no route ever sees it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

if TYPE_CHECKING:
    from deboom.compressor.unbalance import RouteResult, SweepUnbalance

TRUTH_FILE = Path("truth") / "operation.json"
BANDS = ((20.0, 50.0), (50.0, 150.0))
"""Where line-by-line errors are stated: around the rigid-body modes, and above them [Hz]."""
SAME_LINE = 1e-6
"""Largest relative distance of a line of a sweep from one of the truth [1]."""


@dataclass(frozen=True, eq=False)
class UnbalanceTruth:
    """What truly turns and pushes.

    Parameters
    ----------
    path : Path
        Where it was read.
    static, dynamic : complex
        Of all sources together [kg m, kg m²].
    loads : mapping of str to array, shape (n_frequency, 6)
        Sweep → load at the virtual point at its lines, gas included [N, N m]; sweeps over time
        have none.
    lines : mapping of str to array, shape (n_frequency,)
        Sweep → its lines [Hz].
    """

    path: Path
    static: complex
    dynamic: complex
    loads: Mapping[str, ComplexArray]
    lines: Mapping[str, RealArray]

    def load_of(self, sweep: SweepUnbalance) -> ComplexArray | None:
        """Return the load at the lines of a sweep, shape (n_frequency, 6) [N, N m].

        None where it is not known there: nothing is interpolated.
        """
        if sweep.sweep not in self.loads:
            return None
        lines = self.lines[sweep.sweep]
        places = np.argmin(np.abs(lines[:, np.newaxis] - sweep.frequency), axis=0)
        if not np.allclose(lines[places], sweep.frequency, rtol=SAME_LINE, atol=0.0):
            return None
        return np.asarray(self.loads[sweep.sweep][places])


@dataclass(frozen=True)
class RouteErrors:
    """How far a route is from the truth, and y from z, rms over lines, sweeps and both directions.

    Parameters
    ----------
    static, dynamic : tuple of float
        One per band of `BANDS`, relative to the true unbalance [1]; the truth includes the rotating
        gas force, which passes as unbalance. Not a number where no line lies in the band.
    static_mismatch, dynamic_mismatch : tuple of float
        Of y and z, relative to the true unbalance [1].
    """

    static: tuple[float, ...]
    dynamic: tuple[float, ...]
    static_mismatch: tuple[float, ...]
    dynamic_mismatch: tuple[float, ...]


def read_unbalance_truth(folder: Path) -> UnbalanceTruth | None:
    """Read the truth beside a virtual operating test; None where there is none.

    Raises
    ------
    InputError
        A truth file that cannot be read.
    """
    path = folder / TRUTH_FILE
    if not path.is_file():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        static = complex(*content["static_unbalance_kg_m"])
        dynamic = complex(*content["dynamic_unbalance_kg_m2"])
        loads, lines = {}, {}
        for number, name in enumerate(content["sweeps"]):
            with np.load(path.parent / f"{number}.npz") as arrays:
                loads[str(name)] = arrays["load"]
                lines[str(name)] = arrays["frequency"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} is no truth of a running compressor: {error}") from None
    return UnbalanceTruth(path, static, dynamic, loads, lines)


def route_errors(result: RouteResult, truth: UnbalanceTruth) -> RouteErrors:
    """Compare a route with the truth, line by line.

    Parameters
    ----------
    result : RouteResult
    truth : UnbalanceTruth
        Of the same sweeps.

    Returns
    -------
    RouteErrors
    """
    rows = [_in_band(result, truth, low, high) for low, high in BANDS]
    return RouteErrors(*(tuple(column) for column in zip(*rows, strict=True)))


def _in_band(
    result: RouteResult, truth: UnbalanceTruth, low: float, high: float
) -> tuple[float, float, float, float]:
    """Errors of static and dynamic unbalance, then mismatch of y and z of both."""
    errors: tuple[list[ComplexArray], ...] = ([], [])
    apart: tuple[list[ComplexArray], ...] = ([], [])
    for sweep in result.sweeps:
        known = truth.load_of(sweep)
        if known is None:
            continue
        band = (sweep.frequency >= low) & (sweep.frequency <= high)
        square = (2 * np.pi * sweep.frequency[band]) ** 2
        load = known[band]
        for place, curve, true, size in (
            (0, sweep.static, load[:, 1] / square, abs(truth.static)),
            (1, sweep.dynamic, load[:, 5] / square, abs(truth.dynamic)),
        ):
            from_y, from_z = curve.from_y.value[band], curve.from_z.value[band]
            errors[place].extend([(from_y - true) / size, (from_z - true) / size])
            apart[place].append((from_y - from_z) / size)
    return _rms(errors[0]), _rms(errors[1]), _rms(apart[0]), _rms(apart[1])


def _rms(parts: list[ComplexArray]) -> float:
    values = np.concatenate(parts) if parts else np.empty(0)
    return float(np.sqrt(np.mean(np.abs(values) ** 2))) if values.size else math.nan
