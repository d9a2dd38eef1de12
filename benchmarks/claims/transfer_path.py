"""Transfer path analysis.

Forces at the mounts by inversion, by mount stiffness and as blocked forces, on assemblies of
masses, springs and nine mounts that are solved directly
(`tests/samples/transfer_path_assembly.py`), and on the virtual bench's coupled vehicle. Noise of 1
% is complex and part of every single value, in the accelerances as in the responses; errors are the
rms over lines and paths against the rms force. The condition number is that of the matrix with its
columns scaled to norm 1. At a condition number just below 100, 1 % of noise may cost more than 10 %
on a single line: the bound holds over lines, and by far where sensors sit beside the mounts. Away
from them plain least squares misses it; regularisation, which is the default, takes the error of
the worst directions down.
"""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from claims import CASES, Claim, in_processes, over_draws
from deboom.bench.vehicle_writer import write_vehicle
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Spectrum
from deboom.measurement.measured_vehicle import path_accelerance
from deboom.measurement.path_forces import forces_by_inversion
from deboom.physics.force_inversion import CROSS_VALIDATED, PLAIN, invert_for_forces
from samples.transfer_path_assembly import (
    INDICATORS,
    INTERFACE,
    accelerance,
    receiver,
    source,
    with_noise,
)

GOOD = 100
BESIDE = np.arange(INDICATORS.size)
"""As many indicators as `INDICATORS`, but nine of them at the mounts."""
VEHICLES = [f"U06-{number}" for number in range(1, 6)]
MOUNT_SETS = [f"M{number}" for number in range(1, 6)]


def claims() -> list[Claim]:
    """Measure with noise, and with all errors of a laboratory."""
    return [*_assemblies_with_noise(), _laboratory()]


def _split(estimated, truth: np.ndarray) -> tuple[np.ndarray, ...]:
    """Condition numbers, and squared errors and forces of the lines where they are good."""
    good = estimated.condition_number < GOOD
    error, force = ((np.abs(f[good]) ** 2).sum(axis=1) for f in (estimated.force - truth, truth))
    return estimated.condition_number, error, force


def _noise_claim(what: str, results: Sequence[tuple[np.ndarray, ...]]) -> Claim:
    condition, error, force = (np.concatenate(part) for part in zip(*results, strict=True))
    rms = np.sqrt(error.sum() / force.sum())
    each = [100 * np.sqrt(e.sum() / f.sum()) for _, e, f in results]
    return Claim(
        f"1 % noise, {what}: interface forces where the condition number is below {GOOD}, rms",
        "≤ 10 %",
        f"{100 * rms:.1f} % (each of {len(each)}: median {np.median(each):.1f}, worst "
        f"{max(each):.1f} %; {100 * np.mean(condition < GOOD):.0f} % of the lines, median "
        f"condition {np.median(condition):.0f})",
        bool(rms <= 0.10),
    )


def _assemblies_with_noise() -> list[Claim]:
    rows = []
    for where, indicators in (("away from", INDICATORS), ("beside", BESIDE)):
        for rule, name in ((PLAIN, "least squares"), (CROSS_VALIDATED, "Tikhonov, GCV")):
            rng, results = np.random.default_rng(1), []
            for number in range(1, 6):
                for vehicle in range(1, 6):
                    body, _ = receiver(vehicle)
                    _, motion, force = source(number).run(body)
                    matrix = accelerance(np.linalg.inv(body)[:, indicators][:, :, INTERFACE])
                    response = accelerance(motion)[:, indicators]
                    noisy = with_noise(matrix, rng), with_noise(response, rng)
                    results.append(_split(invert_for_forces(*noisy, rule), force))
            what = f"25 assemblies, 22 sensors {where} the mounts, {name}"
            rows.append(_noise_claim(what, results))
    return rows


def _laboratory() -> Claim:
    return over_draws(
        "bench, all errors of a laboratory: interface forces of a drawn vehicle on a drawn "
        "powertrain, rms [%]",
        in_processes(_vehicle, CASES),
        {1.0: 15},
        1,
    )


def _vehicle(seed: int) -> float:
    vehicle, parts = VEHICLES[(seed - 1) % 5], MOUNT_SETS[(seed - 1) % 5]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "v"
        write_vehicle(folder, seed, vehicle, parts, truth_seed=seed)
        measured = read_vehicle(folder)
        with np.load(folder / "truth" / "g5_wot220.npz", allow_pickle=False) as truth:
            names, force = tuple(truth["channels"].tolist()), truth["force"]
    run = measured.run("g5_wot220")
    estimated = forces_by_inversion(path_accelerance(measured), run.acceleration).force
    true = Spectrum(estimated.frequency, force, names, "N").select(estimated.channels)
    error = np.linalg.norm(estimated.values - true.values) / np.linalg.norm(true.values)
    return 100 * float(error)
