"""The text that lies beside a campaign's files and says what each of them is."""

from __future__ import annotations

from deboom.bench.campaign_entries import CHANNEL_TABLE, MOUNT_TABLE, SENSOR_TABLE
from deboom.bench.campaign_layout import (
    ACCELEROMETER_MODEL,
    CELL_MODEL,
    CELL_SHARES,
    ENGINE_NODE,
    TACHO_NODE,
    THREE_CELL_SHARES,
    Place,
    accelerometer_places,
    cell_places,
)
from deboom.bench.campaign_plan import CampaignPlan
from deboom.bench.parameters import VirtualBench
from deboom.bench.platform_layout import points


def readme_text(bench: VirtualBench, plan: CampaignPlan, seed: int) -> str:
    """Return ``README.txt``: every file, and the map from nodes to sensors and mounts."""
    order, lines = bench.order_torque.order, plan.frequency
    each = THREE_CELL_SHARES if plan.third_cell else CELL_SHARES
    shares = " and ".join(f"{100 * share:.0f} %" for share in each)
    carried = f"{'three' if plan.third_cell else 'two'} under a mount carry {shares}"
    pushes = [
        "shaker/MOUNT_PUSH_N.uff  the same of pushes beside the virtual point, see campaign.toml"
    ]
    title = f"Measurement campaign on the virtual bench, seed {seed}"
    text = [
        title,
        "=" * len(title),
        "",
        "Virtual measurements with the errors of real sensors, shaker and order tracking. Nobody",
        "measured this.",
        "",
        f"Mount sets: {', '.join(plan.mount_sets)}. M0 is as drawn; M1 and higher are units with",
        "their manufacturing spread, the same parts in every campaign.",
        "",
        f"Runs: {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, engine order {order:g},",
        "SI units, complex peak amplitudes, time factor e^{+jwt}, phase to the tacho. x points",
        "rearward, y to the right, z up; positions count from the powertrain's centre of gravity.",
        "UFF files: binary, data set 58.",
        "",
        "campaign.toml            names every other file; engine, data sheet, tolerances",
        f"{MOUNT_TABLE:<24} virtual point of every mount",
        f"{SENSOR_TABLE:<24} position sheet; angles turn vehicle axes into sensor axes, about the",
        "                         fixed axes x, then y, then z",
        f"{CHANNEL_TABLE:<24} which node and direction is which channel, and its unit",
        "runs/SET/RUN.uff         acceleration and cell force in sensor axes (type 0, complex),",
        "                         static force per direction, engine torque and speed (real)",
        "shaker/MOUNT_AXIS_N.uff  cells per newton of the shaker at the virtual point, repeat N",
        *(pushes if plan.third_cell else ()),
        "static_curves/           force over deflection of every direction, as suppliers send it",
        "time/                    a run over time with tacho, where there is one (type 1)",
        "truth/                   the exact values behind the measurements, for verification only",
        "",
        f"Accelerometers ({ACCELEROMETER_MODEL}):",
        *_table(accelerometer_places(bench)),
        f"Force cells ({CELL_MODEL}); {carried}, their sum is its force:",
        *_table(cell_places(bench, plan.third_cell)),
        "Static forces:",
        *(
            f"    node {point.node:<4} {point.channel(axis)}"
            for point in points(bench.mount_names)
            for axis in point.axes
        ),
        f"Engine torque and speed: node {ENGINE_NODE}. Tacho: node {TACHO_NODE}.",
    ]
    return "\n".join(text) + "\n"


def _table(places: tuple[Place, ...]) -> list[str]:
    return [
        f"    node {place.node:<4} {place.sensor:<4} {f'{place.mount} {place.piece}'.strip()}"
        for place in places
    ]
