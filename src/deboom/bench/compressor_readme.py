"""The text that lies beside the files of the virtual compressor test."""

from __future__ import annotations

from deboom.bench.compressor_functions import placed_impacts, placed_sensors
from deboom.bench.compressor_hits import HitPlan
from deboom.bench.compressor_plan import CompressorPlan
from deboom.bench.compressor_rig import Sheet
from deboom.files.operating_test_file import OperatingTestFile


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


def operation_readme(title: str, file: OperatingTestFile) -> str:
    """Return ``README.txt`` of the test on a running compressor: every file."""
    with_hoses = file.hammer_with_hoses
    text = [
        title,
        "=" * len(title),
        "",
        "A refrigerant compressor on its rubber mounts, struck with a hammer at rest,",
        "then run from 1000 to 9000 1/min at two pressures, with the standard hoses and with long",
        "soft ones that have masses on them. Nobody measured this.",
        "",
        "SI units; time factor e^{+jwt}; complex peak amplitudes; phase from the tacho's pulse,",
        "once per revolution, when the rotor's mark is on the y axis. UFF: binary, data set 58;",
        "order spectra are type 0 over the frequency of rotation, with the tacho's speed; channels",
        "over time are type 1, with its pulses.",
        "",
        "operation.toml         names every other file; hoses as drawn, deviations",
        f"{file.sensor_table:22} where the accelerometers stood in the sweeps",
        f"{file.hammer + '/':22} hammer test without hoses: see its README.txt",
        *([f"{with_hoses + '/':22} the same with the standard hoses"] if with_hoses else []),
        "sweeps/                one file per sweep",
        "truth/                 the exact values behind, for verification only",
    ]
    return "\n".join(text) + "\n"
