"""Pictures of a first look: Campbell diagrams, cuts of orders, third octaves, matrices of pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd

from deboom import plot
from deboom.errors import InputError
from deboom.measurement.channels import TimeRecord
from deboom.measurement.signal_views import campbell, order_cuts, third_octaves
from deboom.measurement.tacho import ShaftAngle
from deboom.physics.sound_level import REFERENCE_PRESSURE
from deboom.plot import CurvePanel, HeatMap, PointMap
from deboom.report import Report

MOST_PANELS = 24
"""Panels of a picture; of more channels, impacts or paths the first ones are drawn."""
HIGHEST_HZ = 200.0
"""Highest line of a Campbell diagram, and upper edge of the third octaves [Hz]."""
STRONGEST = 5
"""Orders whose cuts are drawn, at most."""
LEAST_SHARE = 1e-3
"""Share of the power from which an order is drawn [1]."""
MOST_PAIRS = 40
"""Rows and columns of a matrix of pairs whose numbers are still legible."""
RECIPROCITY_CAPTION = (
    "Coherence criterion of each function and the one with response and reference exchanged, over "
    "all lines: 1 where they are equal, 0.5 where they have nothing in common, 0 where one has the "
    "other sign. Wide white rows and columns point to a sensor or a point that was struck."
)
_FLOOR = 1e-12


def panels_section(
    report: Report,
    title: str,
    stem: str,
    panels: Sequence[CurvePanel],
    caption: str,
    *,
    y_label: str,
    x_label: str = "frequency [Hz]",
    order: float | None = None,
    share_y: bool = False,
) -> None:
    """Show panels of curves in a section; of many the first `MOST_PANELS`."""
    left = len(panels) - MOST_PANELS
    more = f" The first {MOST_PANELS} of {len(panels)} are drawn." if left > 0 else ""
    report.section(title)
    report.figure(
        stem,
        partial(
            plot.curve_panels,
            panels[:MOST_PANELS],
            x_label=x_label,
            y_label=y_label,
            columns=3,
            order=order,
            share_y=share_y,
        ),
        f"{caption}{more}",
    )


def show_signals(
    report: Report, name: str, records: Mapping[str, TimeRecord], shaft: ShaftAngle | None
) -> None:
    """Show what signals of one recording contain.

    - `name`: of the recording, in titles and names of files.
    - `records`: quantity, such as ``acceleration``, to its channels.
    - `shaft`: what makes orders of them; None draws the spectrum over time.

    A record that is too short for a view is named in the text of the section.
    """
    maps, left_out = [], []
    for quantity, record in records.items():
        try:
            maps.append(_campbell_map(quantity, record, shaft))
        except InputError as error:
            left_out.append(f"No Campbell diagram of {quantity}: {error}.")
    report.section(f"{'Campbell diagram' if shaft else 'Waterfall'}: {name}", "\n\n".join(left_out))
    if maps:
        orders = (
            "Dashed lines are orders of the shaft; resonances and the mains lie level."
            if shaft
            else "Orders are inclined lines, resonances and the mains vertical ones."
        )
        report.figure(
            f"{'campbell' if shaft else 'waterfall'}_{name}",
            partial(plot.point_maps, maps, columns=2),
            f"Level of each line, root mean square over all channels. {orders}",
        )
    if shaft:
        _cuts(report, name, records, shaft)
    _bands(report, name, records)


def _unit_level(record: TimeRecord) -> tuple[float, str]:
    """Return the reference of a level and its label."""
    if record.unit == "Pa":
        return REFERENCE_PRESSURE, "dB re 20 µPa"
    return 1.0, f"dB re 1 {record.unit or 'unit'}"


def _campbell_map(quantity: str, record: TimeRecord, shaft: ShaftAngle | None) -> PointMap:
    if shaft is not None:  # instants before the first and behind the last pulse have no speed
        record = _between_pulses(record, shaft)
    spectrum = campbell(record, HIGHEST_HZ)
    reference, label = _unit_level(record)
    level = 20 * np.log10(np.maximum(spectrum.rms, _FLOOR) / reference)
    if shaft is None:
        frequency, time = np.meshgrid(spectrum.frequency, spectrum.time, indexing="ij")
        x, y, x_label, y_label = frequency, time, "frequency [Hz]", "time [s]"
        rays: dict[str, float] = {}
    else:
        speed = shaft.rpm(spectrum.time)
        frequency, rpm = np.meshgrid(spectrum.frequency, speed, indexing="ij")
        x, y, x_label, y_label = rpm, frequency, "shaft speed [1/min]", "frequency [Hz]"
        rays = {f"{order:g}": order / 60 for order in (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)}
    return PointMap(
        title=quantity,
        x=x.ravel(),
        y=y.ravel(),
        value=level.ravel(),
        x_label=x_label,
        y_label=y_label,
        value_label=f"rms {quantity} [{label}]",
        rays=rays,
    )


def _between_pulses(record: TimeRecord, shaft: ShaftAngle) -> TimeRecord:
    instants = record.start + np.arange(len(record.values)) / record.rate
    inside = (instants >= shaft.begin) & (instants <= shaft.end)
    values, start = record.values[inside], float(instants[np.argmax(inside)])
    return TimeRecord(values, record.rate, record.channels, record.unit, start)


def _cuts(report: Report, name: str, records: Mapping[str, TimeRecord], shaft: ShaftAngle) -> None:
    """Show the strongest orders over speed, and tell the share of each in a table."""
    panels, rows, left_out = [], [], []
    for quantity, record in records.items():
        try:
            cuts = order_cuts(record, shaft)
        except InputError as error:
            left_out.append(f"No cuts of {quantity}: {error}.")
            continue
        power = np.mean(cuts.rms**2, axis=0)
        share = power / float(np.mean(cuts.everything**2))
        strongest = sorted(k for k in np.argsort(power)[-STRONGEST:] if share[k] > LEAST_SHARE)
        curves = {f"order {cuts.orders[k]:g}": cuts.rms[:, k] for k in strongest}
        panels.append(
            CurvePanel(
                title=quantity,
                abscissa=cuts.rpm,
                curves={**curves, "everything": cuts.everything},
                y_label=f"rms {quantity} [{record.unit or 'unit of the file'}]",
                logarithmic=True,
            )
        )
        rows += [
            {
                "quantity": quantity,
                "order [1]": order,
                "rms": float(np.sqrt(power[k])),
                "unit": record.unit,
                "share of the power [%]": 100 * float(share[k]),
                "loudest at [1/min]": float(cuts.rpm[np.argmax(cuts.rms[:, k])]),
            }
            for k, order in enumerate(cuts.orders)
        ]
    report.section(f"Cuts of all orders: {name}", "\n\n".join(left_out))
    if not panels:
        return
    report.figure(
        f"orders_{name}",
        partial(
            plot.curve_panels,
            panels,
            x_label="shaft speed [1/min]",
            columns=min(len(panels), 2),
            dashed=("everything",),
        ),
        f"The {STRONGEST} strongest orders over speed, root mean square over all channels, by a "
        "Vold-Kalman filter that solves all orders together; everything is what was recorded in "
        "half a second about each speed.",
    )
    report.table(
        f"orders_{name}",
        pd.DataFrame(rows),
        "Every half order up to 6. What no order has is noise, or turns with another shaft.",
        {"rms": 4, "share of the power [%]": 1},
    )


def _bands(report: Report, name: str, records: Mapping[str, TimeRecord]) -> None:
    """Show third octaves of every channel."""
    panels, rows, left_out = [], [], []
    for quantity, record in records.items():
        try:
            bands = third_octaves(record, HIGHEST_HZ)
        except InputError as error:
            left_out.append(f"No third octaves of {quantity}: {error}.")
            continue
        reference, label = _unit_level(record)
        level = 20 * np.log10(np.maximum(bands.rms, _FLOOR) / reference)
        panels.append(
            CurvePanel(
                title=quantity,
                abscissa=bands.midband,
                curves={"median of the channels": np.median(level, axis=1)},
                ranges={"median of the channels": (level.min(axis=1), level.max(axis=1))},
                y_label=f"rms {quantity} [{label}]",
            )
        )
        rows += [
            {"quantity": quantity, "channel": channel}
            | {f"{band:g} Hz [dB]": value for band, value in zip(bands.nominal, each, strict=True)}
            for channel, each in zip(record.channels, level.T, strict=True)
        ]
    report.section(f"Third octaves: {name}", "\n\n".join(left_out))
    if not panels:
        return
    report.figure(
        f"third_octaves_{name}",
        partial(plot.curve_panels, panels, columns=min(len(panels), 2), log_frequency=True),
        "Third-octave levels of the whole recording at the middles of the bands, unweighted: "
        "median and range of the channels. Bands have straight edges; filters of IEC 61260-1 let "
        "a little of their neighbours in.",
    )
    report.table(f"third_octaves_{name}", pd.DataFrame(rows), "")


def stems(names: Sequence[str]) -> dict[str, str]:
    """Return names of figures for names of files: what no file name may have becomes ``_``."""
    return {name: "".join(c if c.isalnum() or c in "-_." else "_" for c in name) for name in names}


def matrix_section(
    report: Report,
    title: str,
    stem: str,
    values: Mapping[tuple[str, str], float],
    caption: str,
) -> None:
    """Show a number between 0 and 1 of each pair of response and reference, at a glance."""
    rows = tuple(dict.fromkeys(row for row, _ in values))
    columns = tuple(dict.fromkeys(column for _, column in values))
    legible = max(len(rows), len(columns)) <= MOST_PAIRS
    report.section(title)
    if legible:
        grid = np.array([[values.get((row, column), 0.0) for column in columns] for row in rows])
        texts = np.array(
            [
                [
                    f"{values[row, column]:.2f}" if (row, column) in values else ""
                    for column in columns
                ]
                for row in rows
            ]
        )
        heat_map = HeatMap(title, rows, columns, grid, texts=texts)
        report.figure(stem, partial(plot.heat_maps, [heat_map], columns=1), caption)
    table = pd.DataFrame(
        [(row, column, value) for (row, column), value in values.items()],
        columns=["response", "reference", "value [1]"],
    )
    report.table(stem, table, "" if legible else caption)
