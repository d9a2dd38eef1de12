"""What seats and wheels feel of a front, beside what ears hear."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import IntArray, RealArray
from deboom.errors import listed
from deboom.explore.choices import Pick
from deboom.explore.front import nondominated
from deboom.pages.front_answer import PICTURE_WIDTH, expected_column
from deboom.pages.platform_front import PlatformFront
from deboom.physics.sound_level import energy_sum
from deboom.physics.vibration_level import rms_of_level
from deboom.plot.style import signed
from deboom.report import Picture, Report, Table
from deboom.vehicles.free_directions import NOTICEABLE
from deboom.vehicles.level_objectives import IdleLevel

_SHOWN_IN = {"acceleration": ("mm/s²", 1e3), "velocity": ("mm/s", 1e3), "displacement": ("µm", 1e6)}
"""Unit of the rms amplitude of each quantity, and what an SI unit is in it."""


TRADED = (
    "Boom against vibration: change of the mean level at all ears, and of the seat or wheel that "
    "gets worst{where}. Down and left is better. The line joins designs that none beats in both."
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


def idle_levels(view: PlatformFront, designs: RealArray) -> RealArray:
    """Return the level of each response at idle, of several runs the largest, (n, v) [dB]."""
    return IdleLevel(view.index, view.front.responses)(designs)


def worse_sentence(view: PlatformFront) -> str:
    """Name the seats and wheels that vibrate noticeably more with best-mean, the worst first."""
    rows = vibrating(view)
    felt = [view.front.responses[row] for row in rows]
    worse = dict(zip(felt, vibration_changes(view).tolist(), strict=True))
    if view.index.idle:
        today, best = idle_levels(view, np.stack([view.fleet.today, view.best]))
        names = [f"{name} at idle" for name in felt]
        worse |= dict(zip(names, (best - today)[rows].tolist(), strict=True))
    order = sorted((name for name in worse if worse[name] > NOTICEABLE), key=lambda n: -worse[n])
    if not order:
        return ""
    return f"More vibration: {listed(tuple(f'{n} ({signed(worse[n], 1)} dB)' for n in order))}. "


def vibration_table(view: PlatformFront) -> pd.DataFrame:
    """Tabulate level and rms of seats and wheels today and with best-mean, the worst first."""
    rows, best, n_lines = vibrating(view), view.front.picks[Pick.best_mean], view.index.n_lines
    before = view.front.baseline.mean[0, rows] / n_lines
    table = _levels_table(view, rows, before, view.front.values.mean[best, rows] / n_lines)
    stated = {view.front.responses[row]: view.index.receivers[row].target for row in rows}
    expected = view.expected_everywhere
    if not isinstance(expected, str):
        places = [view.front.responses.index(name) for name in table["receiver"]]
        for name, column in expected_column(expected.of(view.row_of_best), places).items():
            table.insert(4, name, column)
    column = [stated[name] for name in table["receiver"]]
    if any(target is not None for target in column):
        table.insert(4, "target [dB]", np.array(column, dtype=float))
    return table


def idle_table(view: PlatformFront) -> pd.DataFrame:
    """Tabulate the level of all receivers at idle today and with best-mean, the worst first."""
    today, best = idle_levels(view, np.stack([view.fleet.today, view.best]))
    return _levels_table(view, np.arange(len(today)), today, best)


def _levels_table(
    view: PlatformFront, rows: IntArray, before: RealArray, after: RealArray
) -> pd.DataFrame:
    """Tabulate levels of some responses before and after (v,) [dB], what grows most first."""
    listing = []
    for k in np.argsort(before - after, kind="stable"):
        receiver = view.index.receivers[rows[k]]
        rms = ["", ""]
        if not receiver.is_sound:
            unit, factor = _SHOWN_IN[receiver.quantity]
            both = [
                float(rms_of_level(level, receiver.quantity)) for level in (before[k], after[k])
            ]
            rms = [f"{factor * each:.3g} {unit}" for each in both]
        listing.append(
            {
                "receiver": view.front.responses[rows[k]],
                "level today [dB]": before[k],
                "with best-mean [dB]": after[k],
                "change [dB]": after[k] - before[k],
                "rms today": rms[0],
                "rms with best-mean": rms[1],
                "level is": receiver.level_unit,
            }
        )
    return pd.DataFrame(listing)


def orders_table(view: PlatformFront) -> pd.DataFrame:
    """Tabulate the level of each order at idle today and with best-mean, receiver by receiver."""
    designs, rows = np.stack([view.fleet.today, view.best]), []
    for idle in view.index.idle:
        for name, pair in zip(
            idle.response_names, idle.levels(designs).swapaxes(0, 1), strict=True
        ):
            for words, levels in zip(("today", Pick.best_mean), pair, strict=True):
                of_orders = zip(idle.orders, levels, strict=True)
                columns = {f"order {order:g} [dB]": level for order, level in of_orders}
                columns["all orders [dB]"] = float(energy_sum(levels))
                rows.append({"run": idle.run.name, "receiver": name, "design": words, **columns})
    return pd.DataFrame(rows)


def report_vibrations(report: Report, view: PlatformFront) -> None:
    """Fill the first screen with seats, wheels and idle; nothing where there are none."""
    if vibrating(view).size:
        felt = [view.front.responses[row] for row in vibrating(view)]
        for name, change in zip(felt, vibration_changes(view), strict=True):
            report.number(
                f"vibration_change_db_{name}",
                float(change),
                "dB",
                "change of the mean level of the lines at the receiver by best-mean over the "
                "scatter, in the model",
            )
        report.panel(
            "Seats and wheel",
            _shown(vibration_table(view)),
            _boom_against_vibration(view),
            "Mean level of the lines over the scatter, and the rms with that level; those that get "
            "worse first. No objective sums them with sound: limit them (--limits), or search for "
            "them as well (--also).",
            wide=True,
        )
    if view.index.idle:
        table = idle_table(view)
        for name, change in zip(table["receiver"], table["change [dB]"], strict=True):
            report.number(
                f"idle_change_db_{name}",
                float(change),
                "dB",
                "change of the level of all orders at idle at the receiver by best-mean, in the "
                "model without scatter",
            )
        vibrations = table[table["rms today"] != ""]
        shown = _shown(table if vibrations.empty else vibrations)
        report.panel("At idle", shown, _about_idle(view), wide=True)


def report_orders(report: Report, view: PlatformFront) -> None:
    """Show the level of each order at idle; nothing without a run at idle."""
    if view.index.idle:
        table = orders_table(view)
        report.section("Idle, order by order", folded=True)
        decimals = {name: 1 for name in table.columns if name.endswith("[dB]")}
        report.table("idle_orders", table, "Level of each engine order at idle.", decimals)


def _shown(table: pd.DataFrame) -> Table:
    return Table(table, "", {name: 1 for name in table.columns if name.endswith("[dB]")})


def _about_idle(view: PlatformFront) -> str:
    """Say what the levels at idle are of, and which orders are left out."""
    words = []
    for idle in view.index.idle:
        run = f"{idle.run.case.title}, orders {idle.orders[0]:g} to {idle.orders[-1]:g}"
        if idle.left_out.size:
            run += f" (no functions at {', '.join(f'{order:g}' for order in idle.left_out)})"
        words.append(run)
    return (
        f"Level of all orders together: {'; '.join(words)}. In the model without scatter, with the "
        'stiffnesses that the run itself shows. Limit it (statistic = "idle" in a file for '
        "--limits), or search for it as well (--also idle=RECEIVER)."
    )


def _boom_against_vibration(view: PlatformFront) -> Picture:
    """Draw what the designs of the search trade: level at the ears against the worst vibration.

    At idle, where a run at idle is known: there the seats and the wheel are felt most.
    """
    rows, n_lines = vibrating(view), view.index.n_lines
    evaluated, robust = view.front.search.evaluated, view.front.robust
    shown = ~evaluated.failed
    designs = np.stack(list(view.front.pick_designs.values()))
    today, picks = robust(robust.space.nominal[np.newaxis]).mean, robust(designs).mean

    def worst(change: RealArray) -> RealArray:
        return np.asarray(change[:, rows].max(axis=1))

    if view.index.idle:
        now = idle_levels(view, view.fleet.today[np.newaxis])
        felt = worst(idle_levels(view, evaluated.designs[shown]) - now)
        felt_of_picks = worst(idle_levels(view, designs) - now)
    else:
        felt = worst((evaluated.mean[shown] - today) / n_lines)
        felt_of_picks = worst((picks - today) / n_lines)
    sound = view.fleet.mean(view.evaluated_changes)
    both = np.column_stack([sound, felt])
    best = nondominated(both)
    edge = tuple(both[best][np.argsort(sound[best])].T)
    heard = view.fleet.mean((picks - today)[:, view.fleet.ears] / n_lines)
    named = {"today": (0.0, 0.0)} | {
        name: (float(x), float(y))
        for name, x, y in zip(view.front.pick_designs, heard, felt_of_picks, strict=True)
    }
    where = " at idle" if view.index.idle else ""
    caption = TRADED.format(where=where)
    return Picture(
        lambda: plot.fronts(
            {"none better in both": edge},
            {f"{len(felt)} designs of the search": (sound, felt)},
            named,
            mean_label="mean change at the ears [dB]",
            sigma_label=f"largest change of a vibration{where} [dB]",
            width=PICTURE_WIDTH,
        ),
        caption,
        caption,
    )
