"""The text that lies beside a vehicle's files and says what each of them is."""

from __future__ import annotations

from deboom.bench.parameters import VirtualBench
from deboom.bench.platform_layout import FREQUENCY
from deboom.bench.vehicle_layout import (
    EAR_NODES,
    MICROPHONES,
    SensorPlace,
    body_sensor_places,
    impact_places,
    source_sensor_places,
)


def readme_text(bench: VirtualBench, vehicle: str, parts: str, seed: int) -> str:
    """Return ``README.txt``: every file, and the map from nodes to ears, blows and sensors."""
    title = f"Virtual vehicle {vehicle} with mount set {parts}, seed {seed}"
    blows: dict[int, list[str]] = {}
    for place in impact_places(bench):
        blows.setdefault(place.node, [f"{place.mount} {place.piece}".strip()]).append(
            f"{place.name} ({place.direction})"
        )
    text = [
        title,
        "=" * len(title),
        "",
        "Virtual measurements with the errors of real sensors, hammer and loudspeaker. Nobody",
        "measured this.",
        "",
        f"{FREQUENCY.size} lines from {FREQUENCY[0]:g} to {FREQUENCY[-1]:g} Hz, SI units, complex",
        "peak amplitudes, time factor e^{+jwt}; runs along the engine order "
        f"{bench.order_torque.order:g},",
        "phase to the tacho. x points rearward, y to the right, z up; positions count from the",
        "powertrain's centre of gravity. UFF files: binary, data set 58.",
        "",
        "vehicle.toml                    names every other file; ears, mounts, runs",
        "mounts.csv                      virtual point of every mount",
        "sensors.csv, channels.csv       accelerometers: position sheet, nodes",
        "impacts.csv                     blows of the hammer: position sheet, nodes, directions",
        "noise_transfer/direct.uff       pressure at the ears per force of each blow [Pa/N]",
        "noise_transfer/reciprocal.uff   acceleration on the body per volume acceleration of a",
        "                                loudspeaker at each ear [m/s^2 per m^3/s^2], out of it",
        "                                positive; pressure per force is its negative",
        "noise_transfer/accelerance.uff  acceleration on the body per force of each blow",
        "panels.csv                      panels of the cabin: node, place, inward normal, area",
        "noise_transfer/panel_*.uff      acceleration of the panels inwards, and pressure at them,",
        "                                per volume acceleration at the ears",
        "operating/RUN.uff               the driven car: pressure at the ears, acceleration on",
        "                                both sides of every mount (type 0)",
        "hammer/                         blows around one mount over time, where asked for",
        "truth/                          the exact values behind, for verification only",
        "",
        "Hammer and loudspeaker found the trimmed body without its powertrain, on different days;",
        "the runs are those of the complete car on its flexible body, mounts warmer than on the",
        "bench, with other paths.",
        "",
        *(f"    node {node:<4} {ear}, {MICROPHONES[ear]}" for ear, node in EAR_NODES.items()),
        "Blows:",
        *(f"    node {node:<4} {what[0]:<9} {', '.join(what[1:])}" for node, what in blows.items()),
        "Accelerometers on powertrain and wheel ends:",
        *_table(source_sensor_places(bench)),
        "Accelerometers on the body:",
        *_table(body_sensor_places(bench)),
    ]
    return "\n".join(text) + "\n"


def _table(places: tuple[SensorPlace, ...]) -> list[str]:
    return [
        f"    node {place.node:<4} {place.name:<4} {f'{place.mount} {place.piece}'.strip()}"
        for place in places
    ]
