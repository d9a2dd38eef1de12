"""Tables and headline numbers of measured uncertainty."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom.measurement.propagated_interval import Interval
from deboom.study.measured_uncertainty import TODAY, MeasuredAgain
from deboom.study.next_measurement import HERE, SERIES, candidates, questions
from deboom.study.result import Scalar

PERCENT = 100.0
AS_IT_IS = "none: as it is"


def source_table(found: MeasuredAgain, design: str) -> pd.DataFrame:
    """One row per source: its size, where that comes from, and what it does to the mean."""
    level, change = found.variances(None), found.variances(design)
    totals = [sum(float(v[-1]) for v in of.values()) for of in (level, change)]
    rows = []
    for source in found.study.uncertain.data.sources:
        own = [float(of[source.name][-1]) for of in (level, change)]
        shares = [
            PERCENT * v / total if total > 0 else 0.0 for v, total in zip(own, totals, strict=True)
        ]
        rows.append(
            {
                "source": source.name,
                "size, 1 σ": source.size,
                "from": source.origin,
                "σ of the level [dB]": np.sqrt(own[0]),
                "share of its variance [%]": shares[0],
                "σ of the change [dB]": np.sqrt(own[1]),
                "share of that variance [%]": shares[1],
            }
        )
    return pd.DataFrame(rows)


def pick_table(found: MeasuredAgain) -> pd.DataFrame:
    """One row per named design: mean of the vehicles, with 90 % intervals."""
    table: dict[str, object] = {"design": list(found.study.names)}
    for what, unit, interval in (
        ("mean level", "dB(A)", found.mean_level),
        ("change", "dB", found.mean_change),
        ("sigma", "dB", found.sigma),
    ):
        table |= _columns(what, unit, interval, slice(None))
    table["quieter than today's [%]"] = PERCENT * found.quieter[:, 0]
    return pd.DataFrame(table)


def vehicle_table(found: MeasuredAgain) -> pd.DataFrame:
    """One row per named design and vehicle: level, loudest line and changes, with intervals."""
    rows = []
    for place, name in enumerate(found.study.names):
        columns: dict[str, object] = {
            "design": [name] * len(found.study.vehicles),
            "vehicle": list(found.study.vehicles),
        }
        for what, unit, interval in (
            ("mean level", "dB(A)", found.level),
            ("change", "dB", found.change),
            ("loudest line", "dB(A)", found.loudest),
            ("change of the loudest line", "dB", found.change_of_loudest),
        ):
            columns |= _columns(what, unit, interval, place)
        rows.append(pd.DataFrame(columns))
    return pd.concat(rows, ignore_index=True)


def front_table(found: MeasuredAgain) -> pd.DataFrame:
    """One row per design of the front: both objectives, per vehicle and line, with intervals."""
    table: dict[str, object] = {"point": np.arange(1, len(found.study.front) + 1)}
    for what, unit, interval in (
        ("mean level", "dB(A)", found.front_level),
        ("change", "dB", found.front_change),
        ("sigma", "dB", found.front_sigma),
    ):
        table |= _columns(what, unit, interval, slice(None))
    table["on the front in [% of draws]"] = PERCENT * found.front_kept
    return pd.DataFrame(table)


def probability_table(found: MeasuredAgain) -> pd.DataFrame:
    """Probability that the design of the row is quieter than that of the column."""
    columns = {
        f"than {name} [%]": PERCENT * column
        for name, column in zip(found.study.names, found.quieter.T, strict=True)
    }
    return pd.DataFrame({"quieter": list(found.study.names), **columns})


def ranking_table(found: MeasuredAgain) -> pd.DataFrame:
    """One row per vehicle: which directions scatter it, and how sure their order is."""
    names = found.study.robust.space.names
    rows = []
    for place, vehicle in enumerate(found.study.vehicles):
        share = found.measured.share[place]
        order = np.argsort(-share, kind="stable")
        first, second = order[0], order[1]
        rows.append(
            {
                "vehicle": vehicle,
                "first": names[first],
                "its share [%]": PERCENT * share[first],
                "first in [% of draws]": PERCENT * found.leads[place, first],
                "second": names[second],
                "share of the second [%]": PERCENT * share[second],
                "second in [% of draws]": PERCENT * found.rank_kept[place, second],
            }
        )
    return pd.DataFrame(rows)


def next_table(found: MeasuredAgain, design: str) -> pd.DataFrame:
    """One row per measurement that may come next: expected half widths of the 90 % intervals.

    Those that narrow the first question most come first; of equals, the next question decides.
    """
    asked = questions(found, design)
    rows: list[dict[str, object]] = []
    for measurement in (None, *candidates(found)):
        row: dict[str, object] = {"measurement": measurement.name if measurement else AS_IT_IS}
        for one in asked:
            after = one.now if measurement is None else one.after(measurement)
            # fewer effective degrees of freedom may outweigh a gain in what hardly counts
            gain = max(1.0 - after / one.now, 0.0) if one.now > 0.0 else 0.0
            row |= {f"{one.name}, ± [dB]": after, f"{one.name}: narrower by [%]": PERCENT * gain}
        rows.append(row)
    table = pd.DataFrame(rows)
    gains = [f"{one.name}: narrower by [%]" for one in asked]
    rest = table.iloc[1:].sort_values(gains, ascending=False, kind="stable")
    return pd.concat([table.iloc[:1], rest], ignore_index=True)


def best_next(following: pd.DataFrame, question: str) -> tuple[str, float]:
    """Return the measurement that narrows a question most, and by how much [%]."""
    gains = following[f"{question}: narrower by [%]"]
    row = int(gains.to_numpy().argmax())
    return str(following["measurement"].iloc[row]), float(gains.iloc[row])


def uncertainty_summary(found: MeasuredAgain, design: str) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    place = found.study.names.index(design)
    following = next_table(found, design)
    asked = [one.name for one in questions(found, design)]
    here, series = (
        best_next(following, name if name in asked else HERE) for name in (HERE, SERIES)
    )
    level, change = found.mean_level, found.mean_change
    summary: dict[str, Scalar] = {
        "level_db": float(level.value[0]),
        "level_half_width_db": float(level.half_width[0]),
        "change_db": float(change.value[place]),
        "change_lower_db": float(change.lower[place]),
        "change_upper_db": float(change.upper[place]),
        "change_half_width_db": float(change.half_width[place]),
        "probability_quieter": float(found.quieter[place, 0]),
        "front_half_width_db": float(np.median(found.front_change.half_width)),
        "front_kept_share": float(found.front_kept.mean()),
        "next_measurement": here[0],
        "next_narrower_percent": here[1],
        "next_measurement_series": series[0],
        "next_narrower_percent_series": series[1],
        "least_leading_share": float(found.leads.max(axis=1).min()),
    }
    for vehicle, half in zip(found.study.vehicles, found.change.half_width[place], strict=True):
        summary[f"change_half_width_db_{vehicle}"] = float(half)
    return summary


def best_pick(found: MeasuredAgain) -> str:
    """Return the design whose change is asked about: the first besides today's."""
    return next(name for name in found.study.names if name != TODAY)


def _columns(what: str, unit: str, interval: Interval, place: int | slice) -> dict[str, object]:
    return {
        f"{what} [{unit}]": interval.value[place],
        f"{what}, from [{unit}]": interval.lower[place],
        f"{what}, to [{unit}]": interval.upper[place],
    }
