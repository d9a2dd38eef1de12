"""Static forces of a second engine from the kinematic model: torque and suppliers' curves alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from deboom.arrays import RealArray
from deboom.measurement.campaign import Campaign
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.mounts.mount_state import main_axis
from deboom.mounts.operating_map import OperatingMap
from deboom.vehicles.kinematic_model import library_model


def static_prediction(
    mounts: Sequence[CharacterisedMount],
    campaign: Campaign,
    maps: Mapping[str, OperatingMap],
) -> dict[str, RealArray]:
    """Find the static force along the main axis of each mount under the second powertrain.

    Parameters
    ----------
    mounts : sequence of CharacterisedMount
        With the suppliers' curves.
    campaign : Campaign
        Of the second engine; it says where its mounts sit.
    maps : mapping of str to OperatingMap
        Its lines, by ``<mount> <axis>``.

    Returns
    -------
    dict of str to array, shape (n,)
        By ``<mount> <axis>``: the force along the mount's main axis at the lines of that direction
        [N]. Empty if a mount has no curve for an axis.

    Raises
    ------
    InputError
        A torque that deflects a mount beyond its curve.
    """
    carrying = [one for one in mounts if one.mount.name in campaign.powertrain_mounts]
    if not carrying or any(
        direction.static_curve is None for one in carrying for direction in one.directions
    ):
        return {}
    places = {one.name: one.positions for one in campaign.mounts}
    moved = [_at(one, places[one.mount.name]) for one in carrying]
    model = library_model(moved)
    names = [name for name in maps if name.rpartition(" ")[0] in {m.mount.name for m in moved}]
    torque = maps[names[0]].wheel_torque
    state = model.equilibrium(torque)
    return {
        name: state.of(f"{one.mount.name} {main_axis(one)}")
        for one in moved
        for name in names
        if name.rpartition(" ")[0] == one.mount.name
        and np.array_equal(maps[name].wheel_torque, torque)
    }


def _at(
    mount: CharacterisedMount, positions: tuple[tuple[float, float, float], ...]
) -> CharacterisedMount:
    """Put a mount where the second powertrain has it."""
    known = mount.mount
    there = Mount(known.name, known.description, known.pieces, positions, known.transfer_axes)
    return replace(mount, mount=there)
