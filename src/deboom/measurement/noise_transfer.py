"""Noise transfer functions: from what hammer or loudspeaker gave to pressure per force at a path.

Direct: a hammer pushes at a mount, a microphone listens at an ear, p/F. Reciprocal: a loudspeaker
breathes at the ear, accelerometers listen at the mount, a/Q̇. Either way three places around a
mount give the three forces and three moments of its virtual point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from deboom.errors import InputError
from deboom.measurement.channels import Frf, SideUnits, load_units, unit_sides
from deboom.measurement.virtual_point import ChannelGeometry, virtual_point

PRESSURE_PER_FORCE = "Pa/N"
ACCELERATION_PER_VOLUME_ACCELERATION = "(m/s^2)/(m^3/s^2)"
POINT_LOADS = ("x", "y", "z", "mx", "my", "mz")
"""Behind the name of a mount: forces [Pa/N], then moments about its virtual point [Pa/(N m)]."""


def reciprocal_noise_transfer(measured: Frf) -> Frf:
    """Turn a measurement with a loudspeaker at the ear into noise transfer functions [Pa/N].

    - `measured`: outputs are accelerometer channels, inputs are ears; acceleration along the
      channel per volume acceleration of the source, positive out of the loudspeaker
      [(m/s²)/(m³/s²)]; another unit, such as that of a volume velocity, raises InputError.

    ``p/F = -a/Q̇``, Lyamshev's reciprocity. The sign: a source that breathes out and a force on the
    wall of a cavity, inwards, both raise the pressure; but the raised pressure pushes the wall
    outwards. Valid for a linear vehicle at rest whose loudspeaker disturbs its cabin no more than
    the microphone does.
    """
    if measured.unit != ACCELERATION_PER_VOLUME_ACCELERATION:
        raise InputError(
            f"a reciprocal measurement is in {ACCELERATION_PER_VOLUME_ACCELERATION}, this one in "
            f"'{measured.unit}': calibrate the loudspeaker's volume acceleration first"
        )
    values = -np.swapaxes(measured.values, 1, 2)
    return replace(
        measured,
        values=values,
        outputs=measured.inputs,
        inputs=measured.outputs,
        unit=PRESSURE_PER_FORCE,
    )


def noise_transfer_at_points(measured: Frf, points: Mapping[str, ChannelGeometry]) -> Frf:
    """Refer noise transfer functions around the mounts to their virtual points (thesis, figure 7).

    Outputs are ears, inputs of the result ``<point> x``, ``y``, ``z`` [Pa/N] and ``<point> mx``,
    ``my``, ``mz`` [Pa/(N m)]. Raises InputError: no point, another unit, a channel that was not
    measured, channels that do not determine all six loads.

    - `measured`: inputs hold the channels of every geometry: blows of the hammer, or accelerometer
      channels after `reciprocal_noise_transfer` [Pa/N].
    - `points`: mount, or mount and piece such as ``Du left``, to its channels.

    ``Y_VP = Y (U⁺)ᵀ`` with the rows ``U = dᵀ [I, skew(r)ᵀ]`` of the channels, by least squares (van
    der Seijs et al., 2017). One blow beside a mount gives ``Y = Y_VP Uᵀ`` instead: force and moment
    together.
    """
    _check_unit(measured)
    if not points:
        raise InputError("no virtual point to refer noise transfer functions to: name at least one")
    blocks, names = [], []
    for name, geometry in points.items():
        point = virtual_point(geometry)
        blocks.append(measured.select(inputs=point.channels).values @ point.inverse.T)
        names += [f"{name} {load}" for load in POINT_LOADS]
    values = np.concatenate(blocks, axis=2)
    above, below = unit_sides(measured.unit)
    unit = SideUnits((above,) * len(measured.outputs), load_units(names, below))
    return replace(measured, values=values, inputs=tuple(names), unit=unit)


def noise_transfer_of_paths(
    points: Frf, paths: Mapping[str, Sequence[str]], ear: str | None = None
) -> Frf:
    """Choose the noise transfer functions that a transfer path analysis needs, at one ear or all.

    A path ``<mount> <axis>`` names the inputs that share its force evenly: one, or one per piece,
    such as ``Du x`` to ``Du left x`` and ``Du right x``; it is per newton of their summed force
    [Pa/N]. Raises InputError: a path without noise transfer function, no such ear.
    """
    for path, pieces in paths.items():
        missing = [piece for piece in pieces if piece not in points.inputs]
        if missing or not pieces:
            raise InputError(
                f"path '{path}' has no noise transfer function of {missing or 'any piece'}, there "
                f"are {list(points.inputs)}: measure it, or leave the path out"
            )
    chosen = points if ear is None else points.select(outputs=(ear,))
    _check_unit(chosen.select(inputs=[piece for pieces in paths.values() for piece in pieces]))
    columns = [chosen.select(inputs=pieces).values.mean(axis=2) for pieces in paths.values()]
    return replace(
        chosen, values=np.stack(columns, axis=2), inputs=tuple(paths), unit=PRESSURE_PER_FORCE
    )


def _check_unit(frf: Frf) -> None:
    if frf.unit != PRESSURE_PER_FORCE:
        raise InputError(
            f"a noise transfer function is in {PRESSURE_PER_FORCE}, this one in '{frf.unit}'"
        )
