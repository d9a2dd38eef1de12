"""The text that lies beside the measurement files and says what each of them is."""

from __future__ import annotations

from deboom.arrays import RealArray
from deboom.bench.fleet import FROZEN_SEED, BenchFleet
from deboom.bench.measurement_files import (
    CHANNEL_TABLE,
    MOUNT_TABLE,
    ear_nodes,
    noise_transfer_file,
    operating_file,
    torque_file,
)
from deboom.bench.platform_layout import LOAD_CASES, TITLE, paths, points


def readme_text(
    fleet: BenchFleet, mount_names: tuple[str, ...], frequency: RealArray, order: float, seed: int
) -> str:
    """Return ``README.txt``: every file, and the map from nodes and directions to channels."""
    origin = "the frozen fleet" if seed == FROZEN_SEED else "a fleet drawn from the prior"
    lines = [
        TITLE,
        "=" * len(TITLE),
        "",
        "Virtual measurements of the deboom bench, with the errors of real sensors. Written by",
        f"    deboom bench write FOLDER --seed {seed}",
        f"({origin}). Nobody measured this in a car.",
        "",
        f"All spectra: {frequency.size} lines from {frequency[0]:g} to {frequency[-1]:g} Hz, "
        f"engine order {order:g}, SI units,",
        "complex peak amplitudes, time factor e^{+jwt}. x points rearward, y to the right, z up;",
        "positions count from the powertrain's centre of gravity. UFF files: ASCII, data set 58.",
        "",
        "platform.toml      names every other file; engine, gear ratios, data sheet",
        f"{MOUNT_TABLE:<18} position of the virtual point of every mount",
        f"{CHANNEL_TABLE:<18} which node and direction is which channel, and its unit",
        "truth/             the exact values behind the measurements, for verification only;",
        "                   no study reads it, and deleting it changes no result",
        "",
        "Operating displacement [m] and force on the body [N] at the virtual points, type 0:",
        *(f"    {operating_file(case):<28} {case.title}" for case in LOAD_CASES),
        "    node direction   channel",
        *(
            f"    {point.node}  +{axis}          {point.channel(axis)}"
            for point in points(mount_names)
            for axis in point.axes
        ),
        "",
        "Engine torque at every line [N m]:",
        *(f"    {torque_file(case)}" for case in LOAD_CASES),
        "",
        "Noise transfer functions [Pa/N], type 4; response = ear node, reference = path:",
        *(
            f"    {noise_transfer_file(vehicle):<28} driver's ear of {vehicle}: node {node}"
            for vehicle, node in ear_nodes(fleet).items()
        ),
        "    node direction   path",
        *(f"    {path.node}  +{path.axis}          {path.name}" for path in paths(mount_names)),
        "    Du x: the same force on both wishbone mounts in phase, per newton of their sum.",
    ]
    return "\n".join(lines) + "\n"
