"""Synthesised against measured sound.

The study `studies/synthesis_validation.py` on benches with a fleet each, 5th gear with full load,
20 to 55 Hz at the driver's ear: five vehicles of one drawing with five mount sets each on the first
bench; with `DRAWS=20` one vehicle with two mount sets on each of 19 others. Bench forces times
reciprocal noise transfer functions against the microphone of the coupled car, whose body gives way,
whose mounts are 3 % softer and which hears other paths; noise, sensor, hammer and loudspeaker
errors throughout. Response surfaces are fitted without the run that they predict. Of mount sets in
one vehicle the errors of its transfer functions and of its other paths are the same, so that cars
are not independent. Ranges are of 10 to 90 %.

Twenty drawings take 7 minutes of processor time instead of one. On 2026-11-23 they gave, over 63
cars, corr_f 3.5 % (0.3 to 9.0), corr_s 17.4 % (4.0 to 26.5), the largest peak deviation of a car
1.3 dB (0.4 to 3.1, worst 6.5), interface forces by inversion 8.5 % (7.5 to 10.8: more than the 10 %
asked in some), natural frequencies within 0.3 % (0.1 to 0.6), damping 4.8 % (3.5 to 8.7, beyond 15
in some), least MAC 0.998 (0.991 to 1.000, below 0.95 in some) and in some a mode that was missed:
the first drawing is no worst case.

corr_s is relative to the measured pressure (equation 34 leaves it open). Relative to the synthesis,
as it stood here before, the same curves gave 15.2 % (0.9 to 29.7) for 17.4 % (0.7 to 32.1): a
synthesis 1.176 times too loud has 15 % there and 17.6 % here. The 15 % asked stayed. The rows on
causes say why peaks miss 3 dB: blocked forces with transfer functions of the trimmed body alone
cost as much as everything together; with exact functions and nothing else wrong they leave 17.6 %
of corr_s and 2.7 dB, which no laboratory on such a bench passes. Interface forces found on the road
by inversion avoid that; their error is that of a laboratory's sensors and of a body that changes
between two days, not of 1 % noise.
"""

from __future__ import annotations

from unittest.mock import patch

import matplotlib.pyplot as plt
import pandas as pd

from claims import Claim, at_most, draws, in_processes, reported
from deboom.report import Report
from deboom.study.runner import load_study
from deboom.vehicles.synthesis import (
    BLOCKED,
    BY_HAMMER,
    BY_SURFACES,
    CORR_F,
    CORR_S,
    DESIGN,
    INVERSION,
    ON_ROAD,
    PEAK,
)

SEEDS = range(1, 1 + draws(1))


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    found = in_processes(_tables, SEEDS)
    comparisons, causes, forces, criteria = (
        pd.concat([tables[name] for tables in found], ignore_index=True)
        for name in ("comparisons", "causes", "forces", "validation")
    )
    return [
        *_road(comparisons),
        *_steps(comparisons),
        *_causes(causes, forces),
        *_rest(criteria),
    ]


def _tables(seed: int) -> dict[str, pd.DataFrame]:
    few = {} if seed == SEEDS[0] else {"vehicles": 1, "mount_sets": 2}
    with patch.object(Report, "figure", lambda *_: plt.close("all")):
        report = load_study("synthesis_validation").report({"seed": seed, **few})
    return {name: table.assign(seed=seed) for name, table in report.tables.items()}


def _words(values: pd.Series[float], digits: int = 1) -> str:
    if len(values) == 1:
        return f"{values.iloc[0]:.{digits}f}"
    low, middle, high = (f"{values.quantile(share):.{digits}f}" for share in (0.1, 0.5, 0.9))
    return f"{middle} ({low} to {high})"


def _road(comparisons: pd.DataFrame) -> list[Claim]:
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    corr_f, corr_s, peaks = road[CORR_F], road[CORR_S], road[PEAK].dropna()
    alone, paired = road["unpaired peaks"].sum(), road["paired peaks"].sum()
    first = road[road["seed"] == SEEDS[0]]
    return [
        at_most(
            f"corr_f of the complex pressure and corr_s of the magnitude, median of {len(road)} "
            "cars (thesis 5, 10) [%]",
            [5, 15],
            [corr_f.median(), corr_s.median()],
            1,
        ),
        reported(
            "the same, median (10 to 90 %); medians of the first bench [%]",
            f"{_words(corr_f)}; {_words(corr_s)}; {first[CORR_F].median():.1f}, "
            f"{first[CORR_S].median():.1f}",
        ),
        at_most(
            f"booming peaks, {paired} pairs, {alone} of one curve alone, largest deviation (thesis "
            "3) [dB]",
            3,
            peaks.max(),
            1,
        ),
        reported(
            "largest deviation of each car, median (10 to 90 %); largest of the first bench [dB]",
            f"{_words(peaks)}; {first[PEAK].max():.1f}",
        ),
    ]


def _steps(comparisons: pd.DataFrame) -> list[Claim]:
    what = comparisons["comparison"]
    surfaces = comparisons.loc[what == BY_SURFACES, PEAK].dropna()
    hammer = comparisons.loc[what == BY_HAMMER, PEAK].dropna()
    ways = {
        way: comparisons.loc[what == way, PEAK].dropna()
        for way in dict.fromkeys(what[what.str.startswith(DESIGN)])
    }
    return [
        at_most(
            "forces from surfaces, run held out, against measured forces at peaks, largest [dB] "
            "(figure 38)",
            0.3,
            surfaces.max(),
        ),
        *(
            at_most(
                f"{way}, of a mix in every vehicle, at peaks, largest [dB] (figure 40)",
                0.5,
                peaks.max(),
            )
            for way, peaks in ways.items()
        ),
        reported(
            "hammer against reciprocal functions at peaks, median (10 to 90 %) [dB] (figure 41; "
            "thesis 1 to 2)",
            _words(hammer),
        ),
    ]


def _causes(causes: pd.DataFrame, forces: pd.DataFrame) -> list[Claim]:
    rows = []
    for words, what in (
        ("blocked forces alone", BLOCKED),
        ("forces by inversion on the road, measured functions", INVERSION),
    ):
        own = causes[causes["what is compared"] == what]
        rows.append(
            reported(
                f"{words}: corr_f, corr_s [%], peaks [dB], medians (largest)",
                "; ".join(
                    f"{own[name].median():.1f} ({own[name].max():.1f})"
                    for name in (CORR_F, CORR_S, PEAK)
                ),
            )
        )
    inversion, blocked = (
        forces[f"{name}, rms error [%]"] for name in ("forces by inversion", "bench forces")
    )
    condition = forces["largest condition number [1]"].max()
    rows.append(
        Claim(
            "interface forces by inversion on the road, rms error over all directions, median "
            "(10 to 90 %) [%]; bench forces; largest condition number",
            "≤ 10 where the condition number is below 100",
            f"{_words(inversion)}; {_words(blocked)}; {condition:.0f}",
            bool(inversion.max() <= 10 and condition < 100),
        )
    )
    return rows


def _rest(criteria: pd.DataFrame) -> list[Claim]:
    rows = []
    for name, own in criteria[
        criteria["name"].str.contains("against the truth|spread|missed")
    ].groupby("name", sort=False):
        target = own["target"].iloc[0]
        thesis = own["thesis"].iloc[0]
        rows.append(
            Claim(
                f"{name}; drawings: {len(own)}",
                target or f"no claim; thesis {thesis}",
                _words(own["measured"], 3 if "MAC" in str(name) else 1),
                not target or bool((own["holds"] == "yes").all()),
            )
        )
    return rows
