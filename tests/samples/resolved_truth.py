"""What designs really do on the virtual bench: statics and motion solved again with its own law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.powertrain import DirectionLaw, SuspendedBody, VirtualBench, load_bench
from deboom.files.library_export import read_library_json
from deboom.measurement.channels import LoadCase
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.physics.sound_level import spl
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.platform import LIBRARY_FILE, Platform

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
OPTIMUM = {"TSM x": 0.80, "Du x": 0.80, "EnM x": 1.20, "GeM x": 1.14}
"""The best-mean optimum of the study with prescribed motion."""


def optimum(names: Sequence[str]) -> RealArray:
    """Return that optimum as a row of designs."""
    return np.array([OPTIMUM.get(name, 1.0) for name in names])


def platform_parts(platform: Platform) -> tuple[CharacterisedMount, ...]:
    """Read the platform's mount library."""
    return read_library_json(platform.folder / LIBRARY_FILE)[1]


def scaled_bench(
    bench: VirtualBench, design: RealArray, names: Sequence[str], part: bool
) -> VirtualBench:
    """Scale the bench's mounts: the rubber itself (`part`), or its dynamic stiffness alone."""
    factors = dict(zip(names, design.tolist(), strict=True))

    def law(mount: DirectionLaw, factor: float) -> DirectionLaw:
        if not part:
            return replace(mount, dynamic_ratio=factor * mount.dynamic_ratio)
        stages = tuple(replace(s, stiffness=factor * s.stiffness) for s in mount.stages)
        return replace(mount, stiffness=factor * mount.stiffness, stages=stages)

    def body(body_data: SuspendedBody) -> SuspendedBody:
        mounts = tuple(
            replace(
                mount,
                laws=tuple(
                    law(direction, factors[f"{mount.name} {axis}"])
                    for direction, axis in zip(mount.laws, "xyz", strict=False)
                ),
            )
            for mount in body_data.mounts
        )
        return replace(body_data, mounts=mounts)

    return replace(bench, powertrain=body(bench.powertrain), wheel_end=body(bench.wheel_end))


def true_change(
    fleet: Fleet,
    paths: Sequence[str],
    load_case: LoadCase,
    torque_limit: float,
    designs: RealArray,
    names: Sequence[str],
    part: bool,
) -> RealArray:
    """Change of the mean level, 20 to 60 Hz, from nominal to designs (n, n_variable), (n, v) [dB].

    The forces are the bench's own, with statics and amplitudes of every design; the transfer
    functions are those of the files, so that only the forces are judged.
    """
    frequency = load_case.displacement.frequency
    inside = frequency <= 60.0
    ears = np.array(
        [v.noise_transfer.select(inputs=list(paths)).values[inside, 0] for v in fleet.vehicles]
    )
    levels = []
    for design in np.vstack([np.ones(len(names)), designs]):
        bench = scaled_bench(load_bench(), design, names, part)
        force = true_run(bench, PlannedRun(load_case.gear, torque_limit), frequency).path_force[
            inside
        ]
        pressure = np.einsum("vfp,fp->vf", ears, force)
        levels.append(spl(pressure, frequency[inside], axis=-1).mean(axis=-1))
    return np.asarray(levels[1:]) - levels[0]
