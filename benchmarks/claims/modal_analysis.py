"""Modal analysis of the body.

The loudspeaker at each ear in turn, accelerometers at the mounts and on the panels, sdypy-EMA's
LSCF behind a guard, poles refined by maximum likelihood. Vehicles of the bench with the errors of a
good laboratory, their bodies the same on all days unless stated. Bodies are of the family brackets:
eight modes each, with damping ratios of 1.3 % and more; other families, which have up to a mode per
3 Hz and ratios from 0.3 %, were not judged here.

A loudspeaker excites what an ear hears: a mode that hardly reaches an ear leaves no trace in these
FRFs, so neither the poles nor the rebuilt FRFs can tell of it. The hammer does excite it, but its
accelerations show mostly how the body gives way right under the mount: they do not stabilise. Of
the vehicles that miss, three lack such a mode, one has two modes within 0.2 Hz, and one has a mode
below the cavity's 58 Hz whose shape at the mounts reaches a MAC of 0.94.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from claims import CASES, Claim, reported
from deboom.arrays import RealArray
from deboom.bench.fleet import NO_SPREAD, load_fleet
from deboom.bench.layout import FREQUENCY
from deboom.bench.vehicle_writer import VehicleErrors, write_vehicle
from deboom.files.vehicle import read_vehicle
from deboom.measurement.body_modes import body_modes
from deboom.measurement.modal import (
    LARGE_ERROR,
    auxiliary_clusters,
    modal_model,
    pole_clusters,
)
from deboom.physics.frf import FrfForm

N_MODES = 5


@dataclass(frozen=True)
class _Judged:
    """How the lowest modes of a vehicle compare with its true ones.

    - `holds`: all three limits; `flagged`: the rebuilt FRFs tell that the model lacks something.
    - `damping_error` (n_mode,): of the damping ratio [1]; `mac` (n_mode,): the lower one of all
      outputs and of the mount points [1].
    """

    holds: bool
    flagged: bool
    damping_error: RealArray
    mac: RealArray


def _judged(vehicle: str, seed: int) -> tuple[_Judged, _Judged]:
    """Judge modes with the poles of the orders, and with those that maximum likelihood refines."""
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
    refined = body_modes(car)
    of_orders = modal_model(
        refined.measured,
        FrfForm.RECEPTANCE,
        refined.chart.band,
        pole_clusters(refined.chart),
        auxiliary_clusters(refined.chart),
    )
    judged = []
    for part in (replace(refined, model=of_orders), refined):
        frequency_error, damping_error = (
            np.abs(estimated[:N_MODES] / exact[:N_MODES] - 1)
            for estimated, exact in zip(
                (part.model.frequency, part.model.damping), true, strict=True
            )
        )
        mac = np.min([np.diag(part.mac(shapes[measured], only)) for only in (False, True)], axis=0)
        holds = frequency_error.max() <= 0.005 and damping_error.max() <= 0.15 and mac.min() >= 0.95
        judged.append(
            _Judged(bool(holds), part.model.total_error > LARGE_ERROR, damping_error, mac)
        )
    return judged[0], judged[1]


def claims() -> list[Claim]:
    judged: dict[str, tuple[_Judged, _Judged]] = {}
    for seed in CASES:
        names = list(load_fleet(seed).bodies)
        for place in (2 * seed, 2 * seed + 1):
            name = names[place % len(names)]
            judged[f"{name} of fleet {seed}"] = _judged(name, seed)
    total = len(judged)
    missed = {name: after for name, (_, after) in judged.items() if not after.holds}
    of_orders = sum(before.holds for before, _ in judged.values())
    held = [pair for pair in judged.values() if pair[0].holds]
    damping = [_rms([pair[which].damping_error for pair in held]) for which in (0, 1)]
    likeness = [1 - float(np.median([pair[which].mac for pair in held])) for which in (0, 1)]
    return [
        Claim(
            f"of {total} vehicles, two of each of {len(CASES)} fleets: whose five lowest modes "
            f"above the first line, {FREQUENCY[0]:g} Hz, all hold the three limits",
            "≥ 80 %",
            f"{total - len(missed)}; not {', '.join(missed)}; "
            f"{sum(each.flagged for each in missed.values())} of these flagged by the rebuilt FRFs",
            total - len(missed) >= 0.8 * total,
        ),
        reported(
            "the same with the poles of the orders, without maximum likelihood after it; rms error "
            "of damping of those that hold then, before and after; 1 − MAC, median",
            f"{of_orders}; {100 * damping[0]:.1f} and {100 * damping[1]:.1f} %; "
            f"{likeness[0]:.5f} and {likeness[1]:.5f}",
        ),
    ]


def _rms(errors: list[RealArray]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))
