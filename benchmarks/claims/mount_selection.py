"""Mount selection.

Parts from the shipped catalogue (six per mount, 1296 sets) on the shipped platform: 120 sets are
really built into the virtual car. Its motion, amplitudes and preloads answer, and the change of the
mean level (U06, 20 to 60 Hz) is what the study had to predict from characterised surfaces. That the
search finds the front of all sets is held by tests.
"""

from pathlib import Path

import numpy as np

from claims import Claim, between
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.powertrain import load_bench, with_mount_set
from deboom.files.platform import read_platform
from deboom.mounts.surface_forces import Outside
from deboom.physics.sound_level import spl
from deboom.runs.runner import load_study
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.fleet import path_transfer
from deboom.vehicles.platform import MountSource, Runs

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
STUDY = load_study(PLATFORM.parents[1] / "mount_selection.py").module
SETS_BUILT = 120


def claims() -> list[Claim]:
    """Compare the prediction with the virtual car."""
    platform = read_platform(PLATFORM)
    runs = platform.runs(fleet=platform.fleet.group("U06"), mounts=MountSource.library_inside)
    catalogue = STUDY.platform_catalogue(platform, None)
    index = {
        motion: STUDY.catalogue_index(runs, catalogue, motion, Outside.KEEP_MEASURED)
        for motion in (Motion.prescribed, Motion.coupled)
    }
    sets = catalogue.all_sets()
    built = np.random.default_rng(1).choice(len(sets), SETS_BUILT, replace=False)
    today = _true_level(sets[0], runs)
    truth = np.array([_true_level(sets[row], runs) - today for row in built])
    rows = []
    for motion, least in ((Motion.coupled, 0.99), (Motion.prescribed, 0.90)):
        predicted = index[motion](np.hstack([sets, np.ones((len(sets), 12))]))
        change = predicted.mean(axis=1) / index[motion].n_lines
        change -= change[0]
        r = float(np.corrcoef(change[built], truth)[0, 1])
        slope = float(np.polyfit(change[built], truth, 1)[0])
        error = float(np.abs(change[built] - truth).max())
        best = int(np.argmin(change))
        gained = _true_level(sets[best], runs) - today
        rows += [
            Claim(
                f"predicted and true change of {SETS_BUILT} sets, {motion.value}: r [1]",
                f"at least {least:.2f}",
                f"{r:.4f} (slope {slope:.2f}, largest error {error:.3f} dB, spread of the truth "
                f"{truth.std():.2f} dB)",
                r >= least,
            ),
            between(
                f"true change of the quietest set beyond that predicted, {motion.value} [dB]",
                (-0.05, 0.05),
                gained - change[best],
                3,
            ),
        ]
    return rows


def _true_level(numbers: np.ndarray, runs: Runs) -> float:
    """Mean level of the group with a set of parts built into the virtual car [dB(A)]."""
    bench = load_bench()
    mounts = [mount.name for mount in runs.platform.mounts]
    name = "-".join(f"{mount}{int(n)}" for mount, n in zip(mounts, numbers, strict=True))
    frequency = runs.cases[0][0].force.frequency
    inside = (frequency >= runs.band[0]) & (frequency <= runs.band[1])
    run = true_run(with_mount_set(bench, name), PlannedRun(5, 220.0), frequency)
    paths = [f"{mount} {axis}" for mount in bench.mount_names for axis in "xyz"] + ["Du x"]
    transfer = path_transfer(runs.fleet, paths, frequency[inside], runs.band, name)
    pressure = np.einsum("vfp,fp->vf", transfer, run.path_force[inside])
    return float(spl(pressure, frequency[inside], axis=-1).mean())
