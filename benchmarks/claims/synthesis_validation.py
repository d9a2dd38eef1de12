"""Synthesised against measured sound.

The study `studies/synthesis_validation.py` on 20 benches, each with a fleet, 5th gear with full
load, 20 to 55 Hz at the driver's ear: five vehicles of one drawing with five mount sets each on the
first bench, one vehicle with two on each of the others. Bench forces times reciprocal noise
transfer functions against the microphone of the coupled car, whose body gives way, whose mounts are
3 % softer and which hears other paths; noise, sensor, hammer and loudspeaker errors throughout.
Response surfaces are fitted without the run that they predict. Mount sets in one vehicle share the
errors of its functions and other paths: cars are not independent. Ranges are of 10 to 90 %.

The first bench is no worst case. On four of 20 a peak misses 3 dB, most on the two whose interface
forces are furthest from bench forces: bench 3 (51 %, 6.5 dB) and bench 15 (38 %, 3.9 dB).
Inversion misses 10 % on benches 8, 12 and 17, whose largest condition numbers are below 10: the
body was another one on the day of the hammer. So was the lowest mode of benches 6, 8, 13 and 16
under the loudspeaker, by up to 2.2 %: without changes from day to day all five are within 0.1 %.
Bench 2 has modes at 37.35 and 38.19 Hz with 4.4 and 2.2 % of damping: without errors they are told
apart, with a laboratory's noise they are one. Damping misses 15 % on bench 11, in a mode of 7 %.

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

from functools import partial
from unittest.mock import patch

import matplotlib.pyplot as plt
import pandas as pd

from claims import Claim, at_most, draws, in_processes, reported
from deboom.mounts.characterise import CharacteriseOptions as Options
from deboom.report import Report
from deboom.study.runner import load_study
from deboom.vehicles import synthesis
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

SEEDS = range(1, 1 + draws(20))


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
    no_pictures = patch.object(Report, "figure", lambda *_: plt.close("all"))
    # no row shows an error budget
    few_chains = patch.object(synthesis, "CharacteriseOptions", partial(Options, draws=20))
    with no_pictures, few_chains:
        report = load_study("synthesis_validation").report({"seed": seed, **few})
    return {name: table.assign(seed=seed) for name, table in report.tables.items()}


def _words(values: pd.Series[float], digits: int = 1) -> str:
    low, middle, high = (f"{values.quantile(share):.{digits}f}" for share in (0.1, 0.5, 0.9))
    return middle if low == high else f"{middle} ({low} to {high})"


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
                f"{name}; held by {own['holds'].ne('no').sum()} of {len(own)} drawings",
                target or f"no claim; thesis {thesis}",
                _words(own["measured"], 3 if "MAC" in str(name) else 1),
                not target or bool((own["holds"] == "yes").all()),
            )
        )
    return rows
