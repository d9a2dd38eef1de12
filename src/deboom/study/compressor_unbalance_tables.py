"""Tables of a running compressor."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from deboom.compressor.component_acceptance import DYNAMIC, STATIC
from deboom.compressor.source_load import PASCAL_PER_BAR, case_name
from deboom.study.compressor_unbalance_truth import BANDS, route_errors

if TYPE_CHECKING:
    from deboom.compressor.sources import Estimate
    from deboom.compressor.unbalance import RouteResult, SweepUnbalance, Unbalance
    from deboom.study.compressor_unbalance import MeasuredUnbalance

SHOWN = {"kg m": ("g mm", 1e6), "kg m^2": ("g mm²", 1e9), "kg m²": ("g mm²", 1e9)}
"""SI unit → unit of tables, and how many of it."""


def tables_of(measured: MeasuredUnbalance) -> dict[str, pd.DataFrame]:
    """Make all tables of one compressor; file stem → table."""
    found = measured.found
    tables = {
        "sources": source_table(measured),
        "routes": route_table(measured),
        "unexplained": residual_table(found),
        "mask": mask_table(found.chosen),
        "unbalance": pd.concat([curve_table(sweep) for sweep in found.chosen.sweeps]),
        "forces": pd.concat([force_table(sweep) for sweep in found.chosen.sweeps]),
        "motion": motion_table(found),
        "mount_state": state_table(found),
    }
    if measured.reactions:
        tables["hose_reaction"] = reaction_table(measured)
    return tables


def source_table(measured: MeasuredUnbalance) -> pd.DataFrame:
    """Tell what rotor and gas do: the fit over all sweeps by the chosen route."""
    sources = measured.found.chosen.sources
    named: list[tuple[str, Estimate]] = [(STATIC, sources.static), (DYNAMIC, sources.dynamic)]
    for gas in sources.gas:
        where = f", {case_name(gas.pressure)}"
        named += [
            (f"axial gas force{where}", gas.axial),
            (f"gas moment{where}", gas.moment),
            (f"rotating gas force{where}", gas.rotating),
        ]
    rows = []
    for name, estimate in named:
        unit, factor = SHOWN.get(estimate.unit, (estimate.unit, 1.0))
        rows.append(
            {
                "source": name,
                "unit": unit,
                "amplitude": factor * abs(estimate.value),
                "from": factor * estimate.lower,
                "to": factor * estimate.upper,
                "standard deviation": factor * estimate.deviation,
                "phase [°]": float(np.degrees(np.angle(estimate.value))),
            }
        )
    table = pd.DataFrame(rows)
    if measured.truth is not None:
        true = [1e6 * abs(measured.truth.static), 1e9 * abs(measured.truth.dynamic)]
        table["truth"] = [*true, *[np.nan] * (len(rows) - 2)]
    return table


def route_table(measured: MeasuredUnbalance) -> pd.DataFrame:
    """Put the routes side by side: global fit, agreement of y and z, errors where known."""
    rows = []
    for result in measured.found.routes:
        static, dynamic = result.sources.static, result.sources.dynamic
        row: dict[str, str | float] = {
            "route": result.route.letter,
            "what it does": result.route.title,
            "static [g mm]": 1e6 * abs(static.value),
            "± [g mm]": 1e6 * static.deviation,
            "dynamic [g mm²]": 1e9 * abs(dynamic.value),
            "± [g mm²]": 1e9 * dynamic.deviation,
            "residuals over noise [1]": result.sources.reduced_chi,
        }
        for band in BANDS:
            row[f"y/z mismatch {words(band)} [%]"] = 100 * mismatch(result, band)
        if measured.truth is not None:
            errors = route_errors(result, measured.truth)
            for place, band in enumerate(BANDS):
                row[f"error of u {words(band)} [%]"] = 100 * errors.static[place]
                row[f"error of u_d {words(band)} [%]"] = 100 * errors.dynamic[place]
        rows.append(row)
    return pd.DataFrame(rows)


def words(band: tuple[float, float]) -> str:
    """Write a band."""
    return f"{band[0]:g}–{band[1]:g} Hz"


def mismatch(result: RouteResult, band: tuple[float, float]) -> float:
    """Rms over lines and sweeps of |y − z| over their mean, static unbalance [1].

    Not a number where no line lies in the band.
    """
    parts = [
        sweep.static.mismatch[(sweep.frequency >= band[0]) & (sweep.frequency <= band[1])]
        for sweep in result.sweeps
    ]
    values = np.concatenate(parts)
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan


def residual_table(found: Unbalance) -> pd.DataFrame:
    """Say how much of the load no rotor and no gas explains, per band."""
    bands = found.chosen.sources.residual_bands
    return pd.DataFrame(
        {
            "band": [words((one.low, one.high)) for one in bands],
            "unexplained share of the load [%]": [100 * one.share for one in bands],
            "residuals over noise [1]": [one.reduced_chi for one in bands],
        }
    )


def mask_table(chosen: RouteResult) -> pd.DataFrame:
    """List what is not to be trusted, and why."""
    rows = [
        {
            "sweep": sweep.sweep,
            "unbalance": name,
            "why": reason.text,
        }
        for sweep in chosen.sweeps
        for name, curve in (("static", sweep.static), ("dynamic", sweep.dynamic))
        for reason in curve.reasons
    ]
    return pd.DataFrame(rows, columns=["sweep", "unbalance", "why"])


def curve_table(sweep: SweepUnbalance) -> pd.DataFrame:
    """Both unbalances of one sweep line by line, amplitudes."""
    table = {
        "sweep": [sweep.sweep] * sweep.frequency.size,
        "frequency [Hz]": sweep.frequency,
        "speed [rpm]": sweep.speed,
    }
    for name, curve, unit, factor in (
        ("static", sweep.static, "g mm", 1e6),
        ("dynamic", sweep.dynamic, "g mm²", 1e9),
    ):
        for part, values in (
            ("from y", np.abs(curve.from_y.value)),
            ("from z", np.abs(curve.from_z.value)),
            ("mean", np.abs(curve.mean)),
            ("mean from", curve.both.lower),
            ("mean to", curve.both.upper),
        ):
            table[f"{name} {part} [{unit}]"] = factor * values
        table[f"{name} trusted"] = curve.trusted
    return pd.DataFrame(table)


def force_table(sweep: SweepUnbalance) -> pd.DataFrame:
    """Write the load inside, complex, and the band of its amplitudes."""
    table = {
        "sweep": [sweep.sweep] * sweep.frequency.size,
        "frequency [Hz]": sweep.frequency,
    }
    for place, (name, unit) in enumerate(
        [*((f"F_{axis}", "N") for axis in "xyz"), *((f"M_{axis}", "N m") for axis in "xyz")]
    ):
        table[f"{name} real [{unit}]"] = sweep.load[:, place].real
        table[f"{name} imaginary [{unit}]"] = sweep.load[:, place].imag
        table[f"{name} amplitude from [{unit}]"] = sweep.load_lower[:, place]
        table[f"{name} amplitude to [{unit}]"] = sweep.load_upper[:, place]
    return pd.DataFrame(table)


def motion_table(found: Unbalance) -> pd.DataFrame:
    """Acceleration of the virtual point, complex, with its consistency."""
    frames = []
    for motion in found.motions:
        lines = motion.calibrated.frequency
        table = {"sweep": [motion.sweep] * lines.size, "frequency [Hz]": lines}
        for place, name in enumerate(motion.calibrated.channels):
            unit = "m/s²" if place < 3 else "rad/s²"
            table[f"{name} real [{unit}]"] = motion.calibrated.values[:, place].real
            table[f"{name} imaginary [{unit}]"] = motion.calibrated.values[:, place].imag
        table["consistency, sheet [1]"] = motion.consistency_by_sheet.overall
        table["consistency, calibrated [1]"] = motion.consistency_calibrated.overall
        frames.append(pd.DataFrame(table))
    return pd.concat(frames)


def state_table(found: Unbalance) -> pd.DataFrame:
    """Dynamic stiffness in operation over that under the hammer, minus 1, line by line."""
    state = found.state
    return pd.DataFrame(
        {
            "frequency [Hz]": state.frequency,
            "change, real [1]": state.curve.real,
            "change, imaginary [1]": state.curve.imag,
            "deviation [1]": state.curve_deviation,
        }
    )


def reaction_table(measured: MeasuredUnbalance) -> pd.DataFrame:
    """Say per band whether the hoses push back."""
    return pd.DataFrame(
        [
            {
                "pressure [bar]": reaction.pair.pressure / PASCAL_PER_BAR,
                "band": words((band.low, band.high)),
                "reaction over source [%]": 100 * band.share,
                "floor [%]": 100 * band.floor,
                "detected": bool(band.detected),
            }
            for reaction in measured.reactions
            for band in reaction.bands
        ]
    )
