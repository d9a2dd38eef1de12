"""The text that lies beside the files of the virtual compressor test."""

from __future__ import annotations

from deboom.bench.compressor_functions import placed_impacts, placed_sensors
from deboom.bench.compressor_hits import HitPlan
from deboom.bench.compressor_plan import CompressorPlan
from deboom.bench.compressor_rig import Sheet


def readme_text(title: str, plan: CompressorPlan, hits: HitPlan, sheet: Sheet) -> str:
    """Return ``README.txt``: every file, how it was measured, and the map of the nodes."""
    lines = hits.lines
    step = lines[1] - lines[0]
    text = [
        title,
        "=" * len(title),
        "",
        "A refrigerant compressor on its rubber mounts, struck with a roving hammer; with the",
        "errors of real sensors, of a real hammer and of a tape measure. Nobody measured this.",
        "",
        f"{lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, {step:g} Hz apart; SI units; "
        "time factor e^{+jwt}.",
        f"H1 of {hits.hits} hits per impact, half sine of {1e3 * hits.pulse:g} ms and about "
        f"{hits.impulse:g} N s; blocks of {hits.duration:g} s.",
        "Positions count from the virtual point. Directions of responses are those of the sensor's",
        "own axes, directions of forces those of the position sheet. UFF: binary, data set 58.",
        "",
        "compressor_test.toml   names every other file; tolerances, weighed mass, drawing",
        "positions.xlsx         sheets sensors and impacts",
        "frf.uff                acceleration per force of each impact (type 4)",
        "coherence.uff          ordinary coherence of the hits (type 6)",
    ]
    if plan.hits:
        text.append("hits/                  every hit over time, one file per impact")
    text += [
        "truth/                 the exact values behind, for verification only",
        "",
        "Sensors:",
        *(f"    node {row.node:<4} {row.sensor}" for row in placed_sensors(sheet)),
        "Impacts:",
        *(
            f"    node {row.node:<4} {row.impact} ({row.uff_direction})"
            for row in placed_impacts(sheet)
        ),
    ]
    return "\n".join(text) + "\n"
