"""Transfer path analysis.

Forces at the mounts by inversion, by mount stiffness and as blocked forces, on assemblies of
masses, springs and nine mounts that are solved directly (`benchmarks/transfer_path_assembly.py`),
and on the virtual bench's coupled vehicle. Noise of 1 % is complex and part of every single value,
in the accelerances as in the responses; errors are the rms over lines and paths against the rms
force. The condition number is that of the matrix with its columns scaled to norm 1. At a condition
number just below 100, 1 % of noise may cost more than 10 % on a single line: the bound holds over
lines, and by far where sensors sit beside the mounts. Away from them plain least squares misses it;
regularisation, which is the default, takes the error of the worst directions down.
"""

import tempfile
from pathlib import Path

import numpy as np

from claims import Claim, at_most
from deboom.bench.vehicle_writer import write_vehicle
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Spectrum
from deboom.measurement.measured_vehicle import path_accelerance
from deboom.measurement.path_forces import forces_by_inversion
from deboom.physics.force_inversion import CROSS_VALIDATED, PLAIN, invert_for_forces
from transfer_path_assembly import INDICATORS, INTERFACE, accelerance, receiver, source, with_noise

GOOD = 100
BESIDE = np.arange(INDICATORS.size)
"""As many indicators as `INDICATORS`, but nine of them at the mounts."""
VEHICLES = [f"U06-{number}" for number in range(1, 6)]
MOUNT_SETS = [f"M{number}" for number in range(1, 6)]


def claims() -> list[Claim]:
    """Measure with noise, and with all errors of a laboratory."""
    return [*_assemblies_with_noise(), _laboratory()]


def _deviation(ours: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm(ours - truth) / np.linalg.norm(truth))


class _Tally:
    """Errors and forces of lines, split by the condition number."""

    def __init__(self) -> None:
        self.error, self.force, self.condition, self.each = [], [], [], []

    def add(self, found, truth: np.ndarray) -> None:
        good = found.condition_number < GOOD
        error = np.sum(np.abs(found.force - truth) ** 2, axis=1)
        force = np.sum(np.abs(truth) ** 2, axis=1)
        self.error.append(error[good])
        self.force.append(force[good])
        self.condition.append(found.condition_number)
        self.each.append(np.sqrt(error[good].sum() / force[good].sum()))

    def claim(self, what: str) -> Claim:
        rms = np.sqrt(np.concatenate(self.error).sum() / np.concatenate(self.force).sum())
        condition = np.concatenate(self.condition)
        share = np.mean(condition < GOOD)
        return Claim(
            f"1 % noise, {what}: interface forces where the condition number is below {GOOD}, rms",
            "≤ 10 %",
            f"{100 * rms:.1f} % (each of {len(self.each)}: median {100 * np.median(self.each):.1f},"
            f" worst {100 * max(self.each):.1f} %; {100 * share:.0f} % of the lines, median "
            f"condition {np.median(condition):.0f})",
            bool(rms <= 0.10),
        )


def _assemblies_with_noise() -> list[Claim]:
    rows = []
    for where, indicators in (("away from", INDICATORS), ("beside", BESIDE)):
        for rule, name in ((PLAIN, "least squares"), (CROSS_VALIDATED, "Tikhonov, GCV")):
            rng, tally = np.random.default_rng(1), _Tally()
            for number in range(1, 6):
                for vehicle in range(1, 6):
                    body, _ = receiver(vehicle)
                    _, motion, force = source(number).run(body)
                    matrix = accelerance(np.linalg.inv(body)[:, indicators][:, :, INTERFACE])
                    response = accelerance(motion)[:, indicators]
                    noisy = with_noise(matrix, rng), with_noise(response, rng)
                    tally.add(invert_for_forces(*noisy, rule), force)
            rows.append(tally.claim(f"25 assemblies, 22 sensors {where} the mounts, {name}"))
    return rows


def _laboratory() -> Claim:
    """Everything a laboratory does wrong: places, angles, gains, other days, noise."""
    errors = []
    for vehicle, parts in zip(VEHICLES, MOUNT_SETS, strict=True):
        with tempfile.TemporaryDirectory() as temporary:
            folder = write_vehicle(Path(temporary) / "v", seed=1, vehicle=vehicle, parts=parts)
            measured = read_vehicle(folder)
            with np.load(folder / "truth" / "g5_wot220.npz", allow_pickle=False) as truth:
                names, force = tuple(truth["channels"].tolist()), truth["force"]
        run = measured.run("g5_wot220")
        found = forces_by_inversion(path_accelerance(measured), run.acceleration).force
        true = Spectrum(found.frequency, force, names, "N").select(found.channels)
        errors.append(_deviation(found.values, true.values))
    return at_most(
        "bench, all errors of a laboratory: interface forces of 5 vehicles, rms, median and worst "
        "[%]",
        15,
        [100 * np.median(errors), 100 * max(errors)],
        1,
    )
