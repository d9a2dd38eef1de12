"""Mounts on a rig: transfer stiffness by the direct and by the indirect method of ISO 10846.

A shaker moves the input side, the output side is blocked: by force cells on a stiff frame (direct,
ISO 10846-2), or by a heavy mass whose acceleration gives the force (indirect, ISO 10846-3).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deboom.arrays import AXES, BoolArray, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.mounts.characterised_mount import (
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.mount import Mount

LEAST_FALL, STRAIGHT, LEAST_LINES = 0.1, 0.1, 8
"""Fall of Re K over its static value that may be a mass; rms of what a mass leaves of it over the
fall [1]; lines that tell it. Rubber alone rises with frequency."""
BLOCKED_DB = 20.0
"""By how much the input side must move more than the output side (ISO 10846-2 and -3) [dB]."""


@checked(
    preload="3", frequency="f increasing", input_motion="f 3", force="f 3", output_motion="f 3"
)
class RigRun:
    """One excitation of a mount on a rig, under one preload.

    - `axis`: along which the shaker pushes.
    - `preload` (3,): static force on the mount [N].
    - `input_motion`, `output_motion` (n_frequency, 3): displacement of both sides, complex peak
      [m]; None where the output side of the direct method was not measured.
    - `force` (n_frequency, 3): on the output side [N].
    """

    name: str
    axis: str
    preload: RealArray
    frequency: RealArray
    input_motion: ComplexArray
    force: ComplexArray
    output_motion: ComplexArray | None = None

    @property
    def deflection(self) -> ComplexArray:
        """Motion of the input side against the output side, (n_frequency, 3) [m]."""
        if self.output_motion is None:
            return self.input_motion
        return np.asarray(self.input_motion - self.output_motion)

    @property
    def blocked(self) -> BoolArray:
        """Lines on which the output side is still enough, (n_frequency,)."""
        if self.output_motion is None:
            return np.ones(self.frequency.size, dtype=bool)
        along = AXES.index(self.axis)
        moved = np.abs(self.output_motion[:, along])
        return np.asarray(moved * 10 ** (BLOCKED_DB / 20) <= np.abs(self.input_motion[:, along]))


@checked(preload="3", frequency="f", stiffness="f 3 3 ?", amplitude="f 3 ?", valid="f 3")
class RigStiffness:
    """Dynamic transfer stiffness of a mount under one preload.

    - `stiffness` (n_frequency, 3, 3): force along the first per deflection along the second axis
      [N/m]; a column of an axis that was not excited is nan.
    - `amplitude` (n_frequency, 3): deflection along each axis when excited there, peak [m].
    - `valid` (n_frequency, 3): whether the output side was blocked when this axis was excited.
    - `complete`: all three axes were excited, so that the deflections across are accounted for.
    """

    preload: RealArray
    frequency: RealArray
    stiffness: ComplexArray
    amplitude: RealArray
    valid: BoolArray
    complete: bool
    runs: tuple[str, ...]

    @property
    def series_mass(self) -> RealArray:
        """Mass that Re K along each axis falls by as ``k − m ω²``, (3,) [kg]; 0 where it does not.

        It lies between force cells and specimen, a flange, or is the specimen's own.
        """
        mass = np.zeros(len(AXES))
        squared = (2 * np.pi * self.frequency) ** 2
        for place in range(len(AXES)):
            storage = self.stiffness[:, place, place].real
            if self.frequency.size < LEAST_LINES or not np.isfinite(storage).all():
                continue
            slope, static = np.polyfit(squared, storage, 1)
            fall = -slope * np.ptp(squared)
            rest = float(np.std(storage - static - slope * squared))
            if fall > LEAST_FALL * abs(static) and rest < STRAIGHT * fall:
                mass[place] = -slope
        return mass

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence per axis whose stiffness falls as by a mass."""
        return tuple(
            f"{', '.join(self.runs)}: Re K along {axis} falls with ω² as by {mass:.2g} kg between "
            "force cells and specimen: state the flange there as flange_mass_kg, and force_side if "
            "the cells are on the side of the shaker; without one, only lines far below that "
            "resonance are stiffness"
            for axis, mass in zip(AXES, self.series_mass, strict=True)
            if mass
        )


def rig_stiffness(runs: Sequence[RigRun]) -> tuple[RigStiffness, ...]:
    """Return the transfer stiffness of a mount under each preload.

    Parameters
    ----------
    runs : sequence of RigRun
        Excitations along x, y and z, or some of them, under one or more preloads.

    Returns
    -------
    tuple of RigStiffness
        One per preload, in the order of the runs. With all three axes the full matrix,
        (n_frequency, 3, 3) [N/m].

    Raises
    ------
    InputError
        No run; an axis twice under one preload; unlike lines; deflections that do not tell the axes
        apart.

    Notes
    -----
    ``K = F S⁻¹`` with forces F and deflections S of the three excitations as columns; of one
    excitation ``K_aa = f_a/s_a``, and the forces across over the same deflection. ISO 10846 states
    ``k_21 = F_2/u_1`` with the output side blocked; for a mount whose own mass does not matter
    ``F_2 = k (u_1 − u_2)`` says the same and forgives what the output side moves. Lines on which it
    moves within 20 dB of the input side are not valid, whatever the method.
    """
    if not runs:
        raise InputError("no run of the rig: excite the mount along one axis at least")
    groups: dict[tuple[float, ...], list[RigRun]] = {}
    for run in runs:
        groups.setdefault(tuple(run.preload.tolist()), []).append(run)
    return tuple(_of_preload(group) for group in groups.values())


def _of_preload(runs: Sequence[RigRun]) -> RigStiffness:
    first = runs[0]
    by_axis = {run.axis: run for run in runs}
    if len(by_axis) < len(runs):
        twice = [run.axis for run in runs if [r.axis for r in runs].count(run.axis) > 1]
        preload = ", ".join(f"{force:g}" for force in first.preload)
        raise InputError(f"two runs along {twice[0]} under the preload ({preload}) N: keep one")
    for run in runs:
        if not np.array_equal(run.frequency, first.frequency):
            raise InputError(
                f"runs {first.name} and {run.name} have unlike lines: measure both on the same"
            )
    n_line = first.frequency.size
    stiffness = np.full((n_line, 3, 3), np.nan + 0j)
    amplitude, valid = np.full((n_line, 3), np.nan), np.zeros((n_line, 3), dtype=bool)
    for place, axis in enumerate(AXES):
        if axis in by_axis:
            run = by_axis[axis]
            along = run.deflection[:, place]
            if not np.all(along):
                raise InputError(f"run {run.name} does not move along {axis}: is it that axis?")
            amplitude[:, place], valid[:, place] = np.abs(along), run.blocked
            stiffness[:, :, place] = run.force / along[:, np.newaxis]
    complete = len(by_axis) == len(AXES)
    if complete:
        moved, pushed = (
            np.stack([values(by_axis[axis]) for axis in AXES], axis=2)
            for values in (lambda run: run.deflection, lambda run: run.force)
        )
        singular = np.linalg.svd(moved / np.linalg.norm(moved, axis=1)[:, np.newaxis])[1]
        if np.any(singular[:, -1] < 0.1):
            raise InputError(
                f"the excitations {', '.join(run.name for run in runs)} move the mount along "
                "nearly one line: excite it along three axes"
            )
        stiffness = pushed @ np.linalg.inv(moved)
    return RigStiffness(
        preload=first.preload,
        frequency=first.frequency,
        stiffness=stiffness,
        amplitude=amplitude,
        valid=valid,
        complete=complete,
        runs=tuple(run.name for run in runs),
    )


def rig_mount(
    identity: MountIdentity, measured: Sequence[RigStiffness], title: str
) -> CharacterisedMount:
    """Return what the mount library keeps of a mount on a rig.

    Its map points are those of the diagonal over all preloads, with confidence 0 where the output
    side was not blocked. No surface is fitted: a rig's few preloads identify none, and a direction
    without surface counts as not identified in studies of a platform.
    """
    directions = []
    for place, axis in enumerate(AXES):
        parts = [series for series in measured if np.isfinite(series.amplitude[:, place]).all()]
        if not parts:
            continue
        sizes = [series.frequency.size for series in parts]
        points = MapPoints(
            preload=np.repeat([series.preload[place] for series in parts], sizes),
            wheel_torque=np.zeros(sum(sizes)),
            amplitude=np.concatenate([series.amplitude[:, place] for series in parts]),
            frequency=np.concatenate([series.frequency for series in parts]),
            dynamic_stiffness=np.concatenate(
                [series.stiffness[:, place, place] for series in parts]
            ),
            confidence=np.concatenate([series.valid[:, place].astype(float) for series in parts]),
            run=np.repeat(["+".join(series.runs) for series in parts], sizes),
        )
        directions.append(CharacterisedDirection(axis, points, DirectionQuality(identified=False)))
    mount = Mount(identity.mount, title, ("",), ((0.0, 0.0, 0.0),), AXES)
    excited = [series.valid[np.isfinite(series.amplitude)] for series in measured]
    valid = float(np.mean(np.concatenate(excited)))
    quality = {"valid lines [1]": valid} | {
        f"mass seen in Re K along {axis} [kg]": float(mass)
        for axis, mass in zip(
            AXES, np.max([series.series_mass for series in measured], axis=0), strict=True
        )
        if mass
    }
    return CharacterisedMount(identity, mount, tuple(directions), quality)
