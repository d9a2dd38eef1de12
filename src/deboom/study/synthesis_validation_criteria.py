"""What a validation found beside what the thesis found and what was asked: one table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.study.result import Scalar
from deboom.study.synthesis_validation_numbers import (
    BY_HAMMER,
    BY_SURFACES,
    DESIGN,
    ON_ROAD,
    PEAK,
    Validation,
)
from deboom.study.synthesis_validation_transfer import BLOCKED, FUNCTIONS

BODY_MODES = (24.0, 30.0, 37.0, 40.0, 47.0)
"""Of the thesis's vehicle, figure 43 [Hz]."""


@dataclass(frozen=True)
class Criterion:
    """One figure that says whether a synthesis can be trusted.

    Parameters
    ----------
    name : str
        With its unit.
    measured : float
        What was found; nan where it could not be.
    thesis : str
        What the thesis reports; empty where it does not.
    most, least : float or None
        What was asked: not above, not below; both None for a figure without target.
    """

    name: str
    measured: float
    thesis: str = ""
    most: float | None = None
    least: float | None = None

    @property
    def target(self) -> str:
        """What was asked, in words."""
        if self.most is not None:
            return f"≤ {self.most:g}"
        return "" if self.least is None else f"≥ {self.least:g}"

    @property
    def holds(self) -> str:
        """``yes``, ``no``, or nothing where nothing was asked; unknown is not held."""
        if not self.target:
            return ""
        low = self.least is None or self.measured >= self.least
        high = self.most is None or self.measured <= self.most
        return "yes" if low and high else "no"


@dataclass(frozen=True)
class ModesAgainstTruth:
    """How far the modes lie from the true ones, each from the nearest.

    Parameters
    ----------
    frequency, damping : float
        Largest relative error of natural frequency and damping ratio [1].
    missed : int
        True modes, of as many of the lowest as were asked for, that none was near.
    """

    frequency: float
    damping: float
    missed: int


def criteria(
    result: Validation,
    comparisons: pd.DataFrame,
    causes: pd.DataFrame,
    forces: pd.DataFrame,
    modes: Mapping[str, Scalar],
    against_truth: ModesAgainstTruth | None = None,
) -> tuple[Criterion, ...]:
    """Gather the figures of a validation.

    Parameters
    ----------
    result : Validation
    comparisons, causes, forces : DataFrame
        Its tables, see `deboom.study.synthesis_validation_numbers`.
    modes : mapping of str to float
        ``mode_<n>_hz`` and ``mode_<n>_mac``; empty without modal analysis.
    against_truth : ModesAgainstTruth, optional
        Where the true modes are known.
    """
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    surfaces = comparisons[comparisons["comparison"] == BY_SURFACES]
    hammer = comparisons[comparisons["comparison"] == BY_HAMMER]
    found = [
        Criterion(
            "corr_f, complex pressure, median [%]", _median(road, "corr_f complex [%]"), "5", 5
        ),
        Criterion(
            "corr_f, complex pressure, largest [%]", float(road["corr_f complex [%]"].max()), "", 10
        ),
        Criterion("corr_f, magnitude, median [%]", _median(road, "corr_f magnitude [%]")),
        Criterion("corr_s, magnitude, median [%]", _median(road, "corr_s magnitude [%]"), "10", 15),
        Criterion(
            "corr_s, magnitude, largest [%]", float(road["corr_s magnitude [%]"].max()), "", 20
        ),
        Criterion(
            "corr_s, magnitude, over the measured pressure, median [%]",
            _median(road, "corr_s magnitude, over the reference [%]"),
        ),
        Criterion("corr_s, complex pressure, median [%]", _median(road, "corr_s complex [%]")),
        Criterion("peaks, synthesised against measured, largest [dB]", _largest(road), "3", 3),
        Criterion("peaks of one curve alone, share [%]", _unpaired(road)),
        Criterion("forces from surfaces, at peaks, largest [dB]", _largest(surfaces), "", 0.3),
    ]
    if result.design is not None:
        found += [
            Criterion(
                f"{what}, at peaks, largest [dB]",
                _largest(comparisons[comparisons["comparison"] == what]),
                "",
                0.5,
            )
            for what in dict.fromkeys(comparisons["comparison"])
            if what.startswith(DESIGN)
        ]
    found += [
        Criterion(
            "hammer against reciprocal, at peaks, median [dB]", _median(hammer, PEAK), "1 to 2"
        ),
        Criterion("hammer against reciprocal, at peaks, largest [dB]", _largest(hammer), "1 to 2"),
    ]
    if len(forces):
        inversion = "forces by inversion, rms error [%]"
        blocked = "bench forces, rms error [%]"
        judged = {
            "cost of blocked forces": BLOCKED,
            "cost of measured transfer functions": FUNCTIONS,
        }
        if forces[inversion].notna().any():
            found += [
                Criterion(
                    "interface forces by inversion on the road, rms error, largest [%]",
                    float(forces[inversion].max()),
                    "",
                    10,
                ),
                Criterion(
                    "bench forces as interface forces, rms error, largest [%]",
                    float(forces[blocked].max()),
                ),
            ]
            for name, what in judged.items():
                rows = causes[causes["what is compared"] == what]
                found.append(
                    Criterion(f"{name}, corr_f, median [%]", _median(rows, "corr_f complex [%]"))
                )
        found.append(
            Criterion(
                "held-out accelerometers, median error, largest [%]",
                float(forces["held-out accelerometers, median error [%]"].max()),
            )
        )
    if result.spread is not None:
        found.append(
            Criterion(
                f"spread over {len(result.data.vehicles)} vehicles of one drawing, median [dB]",
                result.spread.quantile(0.5),
                "10 to 15",
            )
        )
    found += [
        Criterion(f"mode {n}, natural frequency [Hz]", float(modes[f"mode_{n}_hz"]), f"{asked:g}")
        for n, asked in enumerate(BODY_MODES, 1)
        if f"mode_{n}_hz" in modes
    ]
    if against_truth is not None:
        found += [
            Criterion(
                "true modes among the lowest that were missed [1]", against_truth.missed, most=0
            ),
            Criterion(
                "natural frequencies against the truth, largest error [%]",
                100 * against_truth.frequency,
                most=0.5,
            ),
            Criterion(
                "damping ratios against the truth, largest error [%]",
                100 * against_truth.damping,
                most=15,
            ),
        ]
    macs = [float(value) for name, value in modes.items() if name.endswith("_mac")]
    if macs and np.isfinite(macs).all():
        found.append(
            Criterion(
                "shapes of the modes against the truth, least MAC [1]", min(macs), "", None, 0.95
            )
        )
    return tuple(found)


def criteria_table(found: tuple[Criterion, ...]) -> pd.DataFrame:
    """Write them down: name, measured, thesis, target, holds."""
    return pd.DataFrame(
        {
            "name": [one.name for one in found],
            "measured": [one.measured for one in found],
            "thesis": [one.thesis for one in found],
            "target": [one.target for one in found],
            "holds": [one.holds for one in found],
        }
    )


def headline_numbers(
    result: Validation, comparisons: pd.DataFrame, modes: Mapping[str, Scalar]
) -> dict[str, Scalar]:
    """Keys of ``summary.json``; the study's docstring explains them."""
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    numbers: dict[str, Scalar] = {
        "corr_f_percent": _median(road, "corr_f complex [%]"),
        "corr_s_percent": _median(road, "corr_s magnitude [%]"),
        "peak_deviation_db": _largest(road),
    }
    if result.design is not None:
        numbers["virtual_design_peak_db"] = result.design.peak_deviation
    return numbers | dict(modes)


def _median(rows: pd.DataFrame, column: str) -> float:
    return float(rows[column].median())


def _largest(rows: pd.DataFrame) -> float:
    return float(rows[PEAK].max())


def _unpaired(rows: pd.DataFrame) -> float:
    alone = float(rows["unpaired peaks"].sum())
    return 100 * alone / max(alone + 2 * float(rows["paired peaks"].sum()), 1.0)
