"""Mounts characterised under one engine predict the forces that another one measures on them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.measurement.campaign import Campaign
from deboom.mounts.body_record import body_record
from deboom.mounts.characterisation import CharacteriseOptions
from deboom.mounts.characterise import measuring_chains, training_runs
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount_state import MountState, main_axis, state_at, surface_over
from deboom.mounts.operating_map import OperatingMap, operating_maps
from deboom.study.characterisation_truth import SetTruth, read_set_truth
from deboom.study.second_engine_statics import static_prediction


@dataclass(frozen=True, eq=False)
class Prediction:
    """Forces of one direction under the second engine.

    Parameters
    ----------
    lines : OperatingMap
        What the second engine measured, without lines near the noise floor.
    stiffness : array, shape (n,)
        Of the library's surface at these lines [N/m]; without meaning outside.
    inside : array of bool, shape (n,)
        Lines within the region that the mount was measured in; only these are predicted.
    """

    lines: OperatingMap
    stiffness: ComplexArray
    inside: npt.NDArray[np.bool_]

    @property
    def force(self) -> ComplexArray:
        """Predicted force at the lines inside, shape (n_inside,) [N]."""
        return np.asarray((self.stiffness * self.lines.displacement)[self.inside])

    @property
    def measured(self) -> ComplexArray:
        """Measured force at the lines inside, shape (n_inside,) [N]."""
        return np.asarray(self.lines.force[self.inside])


@dataclass(frozen=True, eq=False)
class SecondEngine:
    """A second engine on mounts of the library.

    Parameters
    ----------
    title : str
        Such as ``bench 1``.
    mounts : tuple of CharacterisedMount
        As the library knows them.
    campaign : Campaign
        Of the second engine.
    maps : dict of str to OperatingMap
        What it measured, by ``<mount> <axis>``.
    predictions : dict of MountState to dict of str to Prediction
        By preload variable and ``<mount> <axis>``.
    static_force : dict of str to array, shape (n,)
        That the kinematic model gives at the lines of `maps`, from wheel torque and the suppliers'
        curves alone [N]; empty where a curve is missing.
    by_kinematics : dict of str to Prediction
        Over that static force instead of the measured one.
    truth : SetTruth or None
        Of the second engine, where it is known.
    seconds : float
        That it took [s].
    first_files : tuple of Path
        That the mounts were characterised from, or their library.
    """

    title: str
    mounts: tuple[CharacterisedMount, ...]
    campaign: Campaign
    maps: dict[str, OperatingMap]
    predictions: dict[MountState, dict[str, Prediction]]
    static_force: dict[str, RealArray]
    by_kinematics: dict[str, Prediction]
    truth: SetTruth | None
    seconds: float
    first_files: tuple[Path, ...] = ()

    @property
    def directions(self) -> tuple[str, ...]:
        """``<mount> <axis>`` of all that is predicted."""
        return tuple(self.predictions[MountState.MAIN_FORCE])

    def mount_of(self, name: str) -> CharacterisedMount:
        """Return the mount of a direction."""
        return next(one for one in self.mounts if one.mount.name == name.rpartition(" ")[0])

    def main_direction(self, name: str) -> str:
        """Return the direction along the main axis of the mount that a direction belongs to."""
        mount = self.mount_of(name)
        return f"{mount.mount.name} {main_axis(mount)}"

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.first_files, *self.campaign.input_files, *truth)


def second_engine(
    title: str,
    mounts: Sequence[CharacterisedMount],
    folder: Path,
    mount_set: str,
    options: CharacteriseOptions,
) -> SecondEngine:
    """Measure a second engine and predict its forces from the mounts' surfaces.

    Parameters
    ----------
    title : str
        For tables.
    mounts : sequence of CharacterisedMount
        Characterised under another engine.
    folder : Path
        Campaign of the second engine.
    mount_set : str
        Parts that were under it; the same parts.
    options : CharacteriseOptions
        Gears, what excites the second engine, pieces of the surfaces.

    Returns
    -------
    SecondEngine

    Raises
    ------
    InputError
        A campaign that cannot be read; a mount of it that is not among the mounts.

    Notes
    -----
    ``f = K(F₀, |s|, ω) s`` (thesis, eq. 30, 32; 3.6.2) with motion s and static force F₀ as the
    second engine measures them. Lines outside of the region in which the mount was measured are
    not predicted.
    """
    begin = time.perf_counter()
    campaign = read_campaign(folder, (mount_set,))
    known = {one.mount.name for one in mounts}
    missing = [one.name for one in campaign.mounts if one.name not in known]
    if missing:
        raise InputError(
            f"campaign {campaign.name} has the mounts {missing}, which are not among the "
            f"characterised ones, {sorted(known)}: characterise them, or name them alike"
        )
    runs = training_runs(campaign, mount_set, options)
    with threadpool_limits(1):  # its matrices are too small to share
        chains = measuring_chains(campaign, options)
        bodies = [chain.alignment.body for chain in chains]
        records = [body_record(body, runs, campaign.tolerances) for body in bodies]
        maps = operating_maps(chains, records, options.estimate)
        own = [one for one in mounts if one.mount.name in {m.name for m in campaign.mounts}]
        static_force = static_prediction(own, campaign, maps)
        predictions: dict[MountState, dict[str, Prediction]] = {one: {} for one in MountState}
        by_kinematics = {}
        for mount, axis, name in _directions(own, maps):
            for state in MountState:
                surface = surface_over(mount, axis, state, options.pieces)
                preload = state_at(maps, mount, axis, state)
                predictions[state][name] = _predicted(surface.predict_masked, preload, maps[name])
                if state is MountState.MAIN_FORCE and name in static_force:
                    by_kinematics[name] = _predicted(
                        surface.predict_masked, static_force[name], maps[name]
                    )
    return SecondEngine(
        title=title,
        mounts=tuple(own),
        campaign=campaign,
        maps=maps,
        predictions=predictions,
        static_force=static_force,
        by_kinematics=by_kinematics,
        truth=read_set_truth(folder, mount_set),
        seconds=time.perf_counter() - begin,
    )


def _directions(
    mounts: Sequence[CharacterisedMount], maps: dict[str, OperatingMap]
) -> list[tuple[CharacterisedMount, str, str]]:
    """Directions that both engines know, with enough lines for a surface."""
    return [
        (mount, one.axis, f"{mount.mount.name} {one.axis}")
        for mount in mounts
        for one in mount.directions
        if one.surface is not None and f"{mount.mount.name} {one.axis}" in maps
    ]


def _predicted(
    surface: Callable[..., tuple[ComplexArray, npt.NDArray[np.bool_]]],
    preload: RealArray,
    measured: OperatingMap,
) -> Prediction:
    stiffness, inside = surface(preload, measured.amplitude, measured.frequency)
    used = ~measured.near_floor
    return Prediction(measured.select(used), stiffness[used], inside[used])
