"""What seats and wheels feel of a front, beside what ears hear."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import IntArray, RealArray
from deboom.errors import listed
from deboom.explore.choices import Pick
from deboom.explore.front import nondominated
from deboom.pages.platform_front import PlatformFront
from deboom.physics.vibration_level import rms_of_level
from deboom.plot.style import signed
from deboom.report import Picture, Report, Table
from deboom.vehicles.free_directions import NOTICEABLE

_SHOWN_IN = {"acceleration": ("mm/s²", 1e3), "velocity": ("mm/s", 1e3), "displacement": ("µm", 1e6)}
"""Unit of the rms amplitude of each quantity, and what an SI unit is in it."""


TRADED = (
    "Boom against vibration: change of the mean level at all ears, and of the seat or wheel that "
    "gets worst. Down and left is better; where the cloud bends, ears gain and seats lose."
)


def vibrating(view: PlatformFront) -> IntArray:
    """Return the numbers of the responses that are vibrations."""
    every = np.arange(len(view.front.responses))
    return every[~np.isin(every, view.fleet.ears)]


def vibration_changes(view: PlatformFront) -> RealArray:
    """Return the change of the mean level of each vibration by best-mean over the scatter [dB]."""
    rows, best = vibrating(view), view.front.picks[Pick.best_mean]
    change = view.front.values.mean[best, rows] - view.front.baseline.mean[0, rows]
    return np.asarray(change / view.index.n_lines)


def worse_sentence(view: PlatformFront) -> str:
    """Name the seats and wheels that vibrate noticeably more with best-mean, the worst first."""
    rows, changes = vibrating(view), vibration_changes(view)
    order = [k for k in np.argsort(-changes, kind="stable") if changes[k] > NOTICEABLE]
    if not order:
        return ""
    named = [f"{view.front.responses[rows[k]]} ({signed(changes[k], 1)} dB)" for k in order]
    return f"More vibration: {listed(tuple(named))}. "


def vibration_table(view: PlatformFront) -> pd.DataFrame:
    """Tabulate level and rms of seats and wheels today and with best-mean, the worst first."""
    rows, changes = vibrating(view), vibration_changes(view)
    best, n_lines = view.front.picks[Pick.best_mean], view.index.n_lines
    before = view.front.baseline.mean[0, rows] / n_lines
    after = view.front.values.mean[best, rows] / n_lines
    listing = []
    for k in np.argsort(-changes, kind="stable"):
        receiver = view.index.receivers[rows[k]]
        unit, factor = _SHOWN_IN[receiver.quantity]
        rms = [float(rms_of_level(level[k], receiver.quantity)) for level in (before, after)]
        listing.append(
            {
                "receiver": view.front.responses[rows[k]],
                "level today [dB]": before[k],
                "with best-mean [dB]": after[k],
                "change [dB]": changes[k],
                "target [dB]": np.nan if receiver.target is None else receiver.target,
                "rms today": f"{factor * rms[0]:.3g} {unit}",
                "rms with best-mean": f"{factor * rms[1]:.3g} {unit}",
                "level is": receiver.level_unit,
            }
        )
    table = pd.DataFrame(listing)
    return table.drop(columns="target [dB]") if table["target [dB]"].isna().all() else table


def report_vibrations(report: Report, view: PlatformFront) -> None:
    """Fill the first screen with seats and wheels; nothing where there are none."""
    if not vibrating(view).size:
        return
    for name, change in zip(
        np.array(view.front.responses)[vibrating(view)], vibration_changes(view), strict=True
    ):
        report.number(
            f"vibration_change_db_{name}",
            float(change),
            "dB",
            "change of the mean level of the lines at the receiver by best-mean over the scatter, "
            "in the model",
        )
    table = vibration_table(view)
    decimals = {name: 1 for name in table.columns if name.endswith("[dB]")}
    report.panel(
        "Seats and wheel",
        Table(table, "", decimals),
        _boom_against_vibration(view),
        "Mean level of the lines over the scatter, and the rms with that level; those that get "
        "worse first. No objective sums them with sound: limit them (--limits), or search for "
        "them as well (--also).",
        wide=True,
    )


def _boom_against_vibration(view: PlatformFront) -> Picture:
    """Draw what the designs of the search trade: level at the ears against the worst vibration."""
    rows, n_lines = vibrating(view), view.index.n_lines
    evaluated, robust = view.front.search.evaluated, view.front.robust
    today = robust(robust.space.nominal[np.newaxis]).mean

    def worst(mean: RealArray) -> RealArray:
        return np.asarray(((mean - today)[:, rows] / n_lines).max(axis=1))

    sound = view.fleet.mean(view.evaluated_changes)
    felt = worst(evaluated.mean[~evaluated.failed])
    both = np.column_stack([sound, felt])
    best = nondominated(both)
    edge = tuple(both[best][np.argsort(sound[best])].T)
    picks = robust(np.stack(list(view.front.pick_designs.values()))).mean
    heard = view.fleet.mean((picks - today)[:, view.fleet.ears] / n_lines)
    named = {"today": (0.0, 0.0)} | {
        name: (float(x), float(y))
        for name, x, y in zip(view.front.pick_designs, heard, worst(picks), strict=True)
    }
    designs = {f"{len(felt)} designs of the search": (sound, felt)}
    return Picture(
        lambda: plot.fronts(
            {"none better in both": edge},
            designs,
            named,
            mean_label="mean change at the ears [dB]",
            sigma_label="largest change of a vibration [dB]",
        ),
        TRADED,
        TRADED,
    )
