"""Transfer path analysis of a measured vehicle: from blows and sensors to its paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from deboom.arrays import ComplexArray
from deboom.errors import InputError
from deboom.measurement.campaign import MeasuredMount
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.measured_vehicle import MeasuredVehicle, Method
from deboom.measurement.sensors import SENSOR_AXES
from deboom.measurement.virtual_point import virtual_point


def piece_paths(mounts: Sequence[MeasuredMount]) -> dict[str, tuple[str, ...]]:
    """Return the paths into a body with what they consist of.

    Returns
    -------
    dict of str to tuple of str
        Path ``<mount> <axis>`` to its pieces ``<mount> [<piece>] <axis>``, for all transfer axes.
    """
    return {
        f"{mount.name} {axis}": mount.channels(axis)
        for mount in mounts
        for axis in mount.transfer_axes
    }


def path_accelerance(vehicle: MeasuredVehicle) -> Frf:
    """Return what the body's sensors show of a force at every path, source removed.

    Parameters
    ----------
    vehicle : MeasuredVehicle
        With accelerances from its hammer test.

    Returns
    -------
    Frf
        Outputs are the channels of all body sensors, inputs the pieces of `piece_paths`
        [(m/s²)/N]: the matrix of `path_forces.forces_by_inversion`.

    Raises
    ------
    InputError
        Accelerometers that were not recorded, or a path without blows around it.

    Notes
    -----
    Blows around a mount are referred to its virtual point by least squares, ``Y_VP = Y (U⁺)ᵀ``.
    Its moments are found and left out: mounts pass forces on.
    """
    measured = vehicle.accelerance
    if measured is None:
        raise InputError(
            f"vehicle {vehicle.name}: the accelerometers were not recorded in its hammer test, so "
            "no force can be found by inversion: use the stiffness of the mounts"
        )
    columns = []
    wanted = [piece for pieces in piece_paths(vehicle.mounts).values() for piece in pieces]
    at_points: dict[str, ComplexArray] = {}
    for piece in wanted:
        name, _, axis = piece.rpartition(" ")
        if name not in at_points:
            point = virtual_point(vehicle.geometry(name, Method.DIRECT))
            at_points[name] = measured.select(inputs=point.channels).values @ point.inverse.T
        columns.append(at_points[name][:, :, SENSOR_AXES.index(axis)])
    values = np.stack(columns, axis=2)
    return Frf(measured.frequency, values, measured.outputs, tuple(wanted), measured.unit)


def summed_over_pieces(force: Spectrum, paths: Mapping[str, Sequence[str]]) -> Spectrum:
    """Add the forces of the pieces that share a path.

    Parameters
    ----------
    force : Spectrum
        One channel per piece; further ones are not looked at [N].
    paths : mapping of str to sequence of str
        Path to its pieces, from `piece_paths`.

    Returns
    -------
    Spectrum
        One channel per path [N], for noise transfer functions per newton of the summed force.

    Raises
    ------
    InputError
        A piece without force.
    """
    for path, pieces in paths.items():
        missing = [piece for piece in pieces if piece not in force.channels]
        if missing:
            raise InputError(f"path {path} has no force of {missing}, there are {force.channels}")
    columns = [force.select(pieces).values.sum(axis=1) for pieces in paths.values()]
    return Spectrum(force.frequency, np.column_stack(columns), tuple(paths), force.unit)
