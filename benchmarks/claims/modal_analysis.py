"""Modal analysis of the body.

The loudspeaker at each ear in turn, accelerometers at the mounts and on the panels, sdypy-EMA's
LSCF behind a guard. Vehicles of the bench with the errors of a good laboratory, their bodies the
same on all days unless stated.

A loudspeaker excites what an ear hears: a mode that hardly reaches an ear leaves no trace in these
FRFs, so neither the poles nor the rebuilt FRFs can tell of it. The hammer does excite it, but its
accelerations show mostly how the body gives way right under the mount: they do not stabilise. Of
the 11 vehicles that miss, two lack such a mode, four have one just below the first line, which
spoils the shapes of the others, three have two within 0.7 Hz, and two err by 18 and 23 % in the
damping of a mode of 7 and 8 %.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from claims import CASES, Claim
from deboom.bench.fleet import NO_SPREAD, load_fleet
from deboom.bench.layout import FREQUENCY
from deboom.bench.vehicle_writer import VehicleErrors, write_vehicle
from deboom.files.vehicle import read_vehicle
from deboom.measurement.body_modes import body_modes
from deboom.measurement.modal import LARGE_ERROR

N_MODES = 5


def _judged(vehicle: str, seed: int) -> tuple[bool, bool]:
    """Say whether the lowest modes hold the limits, and whether the rebuilt FRFs flag the model."""
    with TemporaryDirectory() as folder:
        errors = VehicleErrors(state=NO_SPREAD)
        options = {"errors": errors, "load_cases": (), "accelerance": False}
        path = write_vehicle(Path(folder) / "car", seed, vehicle, **options)
        car = read_vehicle(path)
        with np.load(path / "truth/vehicle.npz") as truth:
            at_points = truth["shapes_at_interfaces"][:, :, :3]
            shapes = np.hstack([at_points.reshape(len(at_points), -1), truth["shapes_at_panels"]])
            measured = truth["natural_frequencies"] >= FREQUENCY[0]
            true = truth["natural_frequencies"][measured], truth["damping_ratios"][measured]
    part = body_modes(car)
    frequency_error, damping_error = (
        np.abs(found[:N_MODES] / exact[:N_MODES] - 1).max()
        for found, exact in zip((part.model.frequency, part.model.damping), true, strict=True)
    )
    mac = min(np.diag(part.mac(shapes[measured], only)).min() for only in (False, True))
    holds = frequency_error <= 0.005 and damping_error <= 0.15 and mac >= 0.95
    return bool(holds), part.model.total_error > LARGE_ERROR


def claims() -> list[Claim]:
    held, flagged, missed = 0, 0, []
    for seed in CASES:
        names = list(load_fleet(seed).bodies)
        for place in (2 * seed, 2 * seed + 1):
            name = names[place % len(names)]
            holds, doubted = _judged(name, seed)
            held += holds
            if not holds:
                missed.append(f"{name} of fleet {seed}")
                flagged += doubted
    total = 2 * len(CASES)
    return [
        Claim(
            f"of {total} vehicles, two of each of {len(CASES)} fleets: whose five lowest modes "
            f"above the first line, {FREQUENCY[0]:g} Hz, all hold the three limits",
            "≥ 80 %",
            f"{held}; not {', '.join(missed)}; {flagged} of these flagged by the rebuilt FRFs",
            held >= 0.8 * total,
        )
    ]
