"""The text that lies beside the files of a virtual electric car."""

from __future__ import annotations

from collections.abc import Sequence

from deboom.bench.compressor_hits import HitPlan
from deboom.bench.electric_places import EAR, EAR_NODE, FIRST_HOLDER_NODE, MICROPHONE, PointSheet


def readme_text(
    title: str,
    points: Sequence[PointSheet],
    names: Sequence[str],
    hits: HitPlan,
    *,
    with_hoses: bool,
) -> str:
    """Return ``README.txt``: every file, how it was measured, and the map of the nodes.

    Parameters
    ----------
    title : str
    points : sequence of PointSheet
        On the body.
    names : sequence of str
        Of the points in the files.
    hits : HitPlan
        On the body.
    with_hoses : bool
        Whether the compressor was struck with its hoses as well.
    """
    lines = hits.lines
    text = [
        title,
        "=" * len(title),
        "",
        "A refrigerant compressor in an electric car: struck on a rigid rig without hoses, run in",
        "the car with its own and with long soft hoses; and the body of the car, struck with the",
        "compressor taken out. With the errors of real sensors and hammers. Nobody measured this.",
        "",
        "SI units, complex peak amplitudes, time factor e^{+jwt}; positions count from the virtual",
        "point of the compressor, along its axes. UFF: binary, data set 58.",
        f"Body: {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, H1 of {hits.hits} hits",
        f"of about {hits.impulse:g} N s. Sweeps: first order, phase to the pulse of the tacho.",
        "",
        "car.toml                names the files of the body; points, tolerances",
        "operation.toml          names those of the compressor",
        "hammer/                 the compressor under the hammer, see its README.txt",
        *(["hammer_with_hoses/      the same with its hoses"] if with_hoses else []),
        "sensors.csv             accelerometers on the compressor while it ran",
        "sweeps/                 first order over speed: compressor, body side of every mount, ear",
        "ntf/positions.xlsx      sensors and impacts on the body",
        "ntf/pressure.uff        pressure at the ear per force (type 4), coherence (type 6)",
        "ntf/accelerance.uff     acceleration on the body per force (type 4)",
        "truth/                  the exact values behind, for verification only",
        "",
        f"    node {EAR_NODE:<4} {EAR}, {MICROPHONE}",
    ]
    for number, (point, name) in enumerate(zip(points, names, strict=True)):
        text.append(f"{name}:")
        if point.name.startswith("mount"):
            text.append(f"    node {FIRST_HOLDER_NODE + number:<4} accelerometer of the sweeps")
        text += [f"    node {row.node:<4} {row.sensor}" for row in point.sensors()]
        text += [
            f"    node {row.node:<4} {row.impact} ({row.uff_direction})" for row in point.impacts()
        ]
    return "\n".join(text) + "\n"
