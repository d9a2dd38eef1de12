"""Synthesised against measured sound.

The study `studies/synthesis_validation.py` on the shipped powertrain and mounts, with twenty drawn
fleets of the family brackets and a laboratory each, called benches here, 5th gear with full load,
20 to 55 Hz at the driver's ear: one vehicle with two mount sets on each drawn bench, the five
vehicles of group U06 with five mount sets each on the shipped one. No powertrain is drawn: with
drawn ones interface forces err by up to 11.0 %, not 7.3 %. Of the five vehicles the last carries a
battery: the four alike ones spread by 6.8 dB, where all five do by 12.6. Interface forces, from
blocked ones, the receptance of the source and that of the body (hammer accelerances), times
reciprocal noise transfer functions against the microphone of the coupled car, whose body gives way,
whose mounts are 3 % softer and which hears other paths; noise, sensor, hammer and loudspeaker
errors throughout. Response surfaces are fitted without the run that they predict. Mount sets in one
vehicle share the errors of its functions and other paths.

Blocked forces alone miss interface forces by 51 % on bench 3 and 38 % on bench 15, and booming
peaks there by 6.5 and 3.9 dB: the body gives way, which its receptance says. Inversion misses 10 %
on benches 8, 12 and 17, whose largest condition numbers are below 10: the body was another one on
the day of the hammer. So was the lowest mode of benches 6, 8, 13 and 16 under the loudspeaker, by
up to 2.2 %: without changes from day to day all five are within 0.1 %. Bench 2 has modes at 37.35
and 38.19 Hz with 4.4 and 2.2 % of damping: without errors they are told apart, with a laboratory's
noise they are one. Damping misses 15 % on bench 11, in a mode of 7 %.

corr_s is relative to the measured pressure (equation 34 leaves it open). Relative to the synthesis,
as it stood here before, the same curves gave 15.2 % for 17.4 %: a synthesis 1.176 times too loud
has 15 % there and 17.6 % here. Interface forces found on the road by inversion need no bench, with
the error of a laboratory's sensors and of a body that changes between two days.
"""

from __future__ import annotations

from functools import partial
from unittest.mock import patch

import matplotlib.pyplot as plt
import pandas as pd

from claims import CASES, Claim, in_processes, over_draws, reported
from deboom.mounts.characterise import CharacteriseOptions, characterise
from deboom.report import Report
from deboom.runs.runner import load_study
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

_WAYS = {
    "interface forces": "interface forces from bench forces and receptances",
    "forces by inversion": "interface forces by inversion",
    "bench forces": "bench forces in place of interface forces",
}


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    tables_of_cases = in_processes(_tables, CASES)
    comparisons, causes, forces, criteria = (
        pd.concat([tables[name] for tables in tables_of_cases], ignore_index=True)
        for name in ("comparisons", "causes", "forces", "validation")
    )
    return [
        *_road(comparisons),
        *_steps(comparisons),
        *_causes(causes, forces),
        *_rest(criteria),
    ]


def _tables(seed: int) -> dict[str, pd.DataFrame]:
    few = {} if seed == CASES[0] else {"vehicles": 1, "mount_sets": 2}
    no_pictures = patch.object(Report, "figure", lambda *_: plt.close("all"))
    # no row shows an error budget
    quickly = partial(characterise, options=CharacteriseOptions(draws=20))
    with no_pictures, patch.object(synthesis, "characterise", quickly):
        report = load_study("synthesis_validation").report({"seed": seed, **few})
    return {name: table.assign(seed=seed) for name, table in report.tables.items()}


def _by_bench(table: pd.DataFrame, names: str | list[str], share: float) -> pd.DataFrame:
    return table.groupby("seed")[names].quantile(share).reindex(CASES)


def _road(comparisons: pd.DataFrame) -> list[Claim]:
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    drawn = road[road["seed"] != CASES[0]]
    alone, paired = drawn["unpaired peaks"].sum(), drawn["paired peaks"].sum()
    return [
        over_draws(
            "corr_f of the complex pressure and corr_s of the magnitude, median of a bench's cars "
            "(thesis 5, 10) [%]",
            _by_bench(road, [CORR_F, CORR_S], 0.5),
            {1.0: [1, 10]},
            1,
        ),
        over_draws(
            f"booming peaks, {paired} pairs, {alone} of one curve alone, largest deviation of a "
            "bench (thesis 3) [dB]",
            _by_bench(road, PEAK, 1.0),
            {1.0: 3},
            1,
        ),
    ]


def _steps(comparisons: pd.DataFrame) -> list[Claim]:
    what = comparisons["comparison"]
    ways = dict.fromkeys(what[what.str.startswith(DESIGN)])
    rows = (
        (BY_SURFACES, "forces from surfaces, run held out, against measured forces", 38, 0.3),
        *((way, f"{way}, of a mix in every vehicle", 40, 0.5) for way in ways),
        (BY_HAMMER, "hammer against reciprocal functions (thesis 1 to 2)", 41, None),
    )
    return [
        over_draws(
            f"{topic}, at peaks, largest of a bench [dB] (figure {figure})",
            _by_bench(comparisons[what == kind], PEAK, 1.0),
            None if most is None else {1.0: most},
        )
        for kind, topic, figure, most in rows
    ]


def _causes(causes: pd.DataFrame, forces: pd.DataFrame) -> list[Claim]:
    kinds = causes["what is compared"]
    condition = forces["largest condition number [1]"].max()
    return [
        *(
            over_draws(
                f"{words}: corr_f, corr_s [%], peaks [dB], median of a bench's cars",
                _by_bench(causes[kinds == what], [CORR_F, CORR_S, PEAK], 0.5),
                digits=1,
            )
            for words, what in (
                ("blocked forces alone", BLOCKED),
                ("forces by inversion on the road, measured functions", INVERSION),
            )
        ),
        *(
            over_draws(
                f"{_WAYS[way]}, rms error over all directions of a bench [%]; largest "
                f"condition number {condition:.0f}",
                _by_bench(forces, f"{way}, rms error [%]", 0.5),
                limits,
                1,
            )
            for way, limits in (
                ("interface forces", {1.0: 10}),
                ("forces by inversion", {1.0: 10}),
                ("bench forces", None),
            )
        ),
    ]


def _rest(criteria: pd.DataFrame) -> list[Claim]:
    rows = []
    for name, group in criteria[
        criteria["name"].str.contains("against the truth|spread|missed")
    ].groupby("name", sort=False):
        target = group["target"].iloc[0]
        thesis = group["thesis"].iloc[0]
        cases = group.set_index("seed")["measured"].reindex(CASES)
        drawn = group[group["seed"] != CASES[0]]
        if drawn.empty:
            rows.append(reported(f"{name}, shipped; thesis {thesis}", f"{cases.iloc[0]:.1f}"))
            continue
        figure = over_draws("", cases, digits=3 if "MAC" in str(name) else 1).measured
        rows.append(
            Claim(
                f"{name}; held by {drawn['holds'].ne('no').sum()} of {len(drawn)} drawings",
                target or f"no claim; thesis {thesis}",
                figure,
                not target or bool((drawn["holds"] == "yes").all()),
            )
        )
    return rows
