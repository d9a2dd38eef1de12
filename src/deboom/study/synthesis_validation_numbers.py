"""Every comparison of a validation in one long table, and its peaks in another."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.measurement.level_spread import LevelSpread, level_spread
from deboom.physics.sound_level import spl
from deboom.study.synthesis_validation import Listening, Synthesis, syntheses
from deboom.study.synthesis_validation_data import ValidationData
from deboom.study.synthesis_validation_design import VirtualDesign, virtual_design
from deboom.study.synthesis_validation_transfer import RoadAnalysis, road_analyses
from deboom.vehicles.booming_peaks import BoomingPeak
from deboom.vehicles.pressure_comparison import PressureComparison

ON_ROAD = "synthesised against measured"
BY_SURFACES = "forces from surfaces against measured forces"
BY_HAMMER = "hammer against reciprocal functions"
DESIGN = "virtual design, "

PEAK = "largest peak deviation [dB]"


@dataclass(frozen=True, eq=False)
class Validation:
    """Everything that was compared.

    Parameters
    ----------
    data : ValidationData
    listening : Listening
    syntheses : tuple of Synthesis
        One per driven vehicle and mount set.
    design : VirtualDesign or None
        None for a campaign without a mix.
    roads : tuple of RoadAnalysis
        Vehicles whose accelerometers were recorded under the hammer.
    """

    data: ValidationData
    listening: Listening
    syntheses: tuple[Synthesis, ...]
    design: VirtualDesign | None
    roads: tuple[RoadAnalysis, ...]

    @property
    def shown(self) -> tuple[Synthesis, ...]:
        """Every vehicle once, with the mount set that figures show; those with most data first."""
        known = [one.synthesis for one in self.roads] + list(self.syntheses)
        first: dict[str, Synthesis] = {}
        for one in known:
            first.setdefault(one.driven.vehicle.name, one)
        return tuple(first[one.vehicle.name] for one in self.data.vehicles)

    @property
    def spread(self) -> LevelSpread | None:
        """Of the measured levels of all vehicles with one mount set; None for a single vehicle."""
        mount_set = self.syntheses[0].driven.mount_set
        levels = [
            spl(one.on_road.reference, one.on_road.frequency)
            for one in self.syntheses
            if one.driven.mount_set == mount_set
        ]
        return level_spread(levels) if len(levels) > 1 else None


def validate(data: ValidationData, listening: Listening) -> Validation:
    """Compare everything that the data allow.

    Raises
    ------
    InputError
        Data that do not fit together.
    """
    done = syntheses(data, listening)
    return Validation(
        data,
        listening,
        done,
        virtual_design(data, listening),
        road_analyses(data, done, listening),
    )


def comparison_table(result: Validation) -> pd.DataFrame:
    """One row per comparison, vehicle and mount set."""
    return pd.DataFrame(
        [
            {
                "comparison": what,
                "vehicle": vehicle,
                "mount set": mount_set,
                "corr_f complex [%]": 100 * one.corr_f,
                "corr_f magnitude [%]": 100 * one.corr_f_magnitude,
                "corr_s magnitude [%]": 100 * one.corr_s_magnitude,
                "corr_s complex [%]": 100 * one.corr_s,
                "corr_s magnitude, over the reference [%]": 100 * one.corr_s_of_reference,
                PEAK: one.peak_deviation,
                "paired peaks": len(one.peaks.pairs),
                "unpaired peaks": len(one.peaks.only_reference) + len(one.peaks.only_compared),
                "rms over all lines [dB]": one.rms_difference,
            }
            for what, vehicle, mount_set, one in _comparisons(result)
        ]
    )


def peak_table(result: Validation) -> pd.DataFrame:
    """One row per booming peak of either curve; a peak without partner stands alone."""
    rows = []
    for what, vehicle, mount_set, one in _comparisons(result):
        found = one.peaks
        pairs: list[tuple[BoomingPeak | None, BoomingPeak | None]] = [*found.pairs]
        pairs += [(peak, None) for peak in found.only_reference]
        pairs += [(None, peak) for peak in found.only_compared]
        for reference, compared in pairs:
            there = [peak for peak in (reference, compared) if peak is not None]
            rows.append(
                {
                    "comparison": what,
                    "vehicle": vehicle,
                    "mount set": mount_set,
                    "engine speed [rpm]": there[0].rpm,
                    "reference at [Hz]": reference.frequency if reference else np.nan,
                    "compared at [Hz]": compared.frequency if compared else np.nan,
                    "reference [dB(A)]": reference.level if reference else np.nan,
                    "compared [dB(A)]": compared.level if compared else np.nan,
                    "deviation [dB]": compared.level - reference.level
                    if reference and compared
                    else np.nan,
                }
            )
    return pd.DataFrame(rows)


def cause_table(result: Validation) -> pd.DataFrame:
    """One row per vehicle and cause: what of a synthesis loses how much."""
    return pd.DataFrame(
        [
            {
                "what is compared": what,
                "vehicle": road.synthesis.driven.vehicle.name,
                "mount set": road.synthesis.driven.mount_set,
                "corr_f complex [%]": 100 * one.corr_f,
                "corr_s magnitude [%]": 100 * one.corr_s_magnitude,
                PEAK: one.peak_deviation,
            }
            for road in result.roads
            for what, one in road.causes.items()
        ]
    )


def force_table(result: Validation) -> pd.DataFrame:
    """One row per analysed vehicle: forces by inversion on the road, and bench forces."""
    return pd.DataFrame(
        [
            {
                "vehicle": road.synthesis.driven.vehicle.name,
                "mount set": road.synthesis.driven.mount_set,
                "forces by inversion, rms error [%]": 100 * road.force_error,
                "bench forces, rms error [%]": 100 * road.blocked_error,
                "largest condition number [1]": road.largest_condition,
                "held-out accelerometers, median error [%]": 100
                * float(np.median(road.on_board.error_by_line)),
            }
            for road in result.roads
        ]
    )


def _comparisons(result: Validation) -> Iterator[tuple[str, str, str, PressureComparison]]:
    for what, of in (
        (ON_ROAD, "on_road"),
        (BY_SURFACES, "by_surfaces"),
        (BY_HAMMER, "by_hammer"),
    ):
        for one in result.syntheses:
            driven = one.driven
            yield what, driven.vehicle.name, driven.mount_set, getattr(one, of)
    if result.design is not None:
        for (vehicle, way), compared in result.design.comparisons.items():
            yield f"{DESIGN}{way.value}", vehicle, result.design.mix, compared
