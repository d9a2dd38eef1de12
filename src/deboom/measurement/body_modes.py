"""Modes of a measured vehicle's body: poles and shapes at mounts and panels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement import modal
from deboom.measurement.channels import Frf
from deboom.measurement.measured_vehicle import MeasuredVehicle, Method
from deboom.measurement.sensors import SENSOR_AXES
from deboom.measurement.virtual_point import virtual_point, virtual_point_frf
from deboom.physics.frf import FrfForm

BAND = (20.0, 80.0)
"""The thesis finds five modes in it [Hz] (figure 43)."""
N_MODES = 5


@dataclass(frozen=True)
class Place:
    """A point whose motion was measured: mount, piece of a mount, or panel.

    Parameters
    ----------
    label : str
        Its name.
    position : (x, y, z)
        [m].
    directions : mapping of str to (x, y, z)
        Output to the unit vector along which it is positive [1].
    """

    label: str
    position: tuple[float, float, float]
    directions: Mapping[str, tuple[float, float, float]]

    @property
    def is_panel(self) -> bool:
        """Whether its motion is known along its normal only."""
        return len(self.directions) == 1


@dataclass(frozen=True, eq=False)
class BodyModes:
    """Modal analysis of one vehicle.

    Parameters
    ----------
    measured : Frf
        Outputs ``<point> x y z`` and panels, inputs the ears [(m/s²)/(m³/s²)].
    chart : StabilisationChart
        Poles of every order.
    model : ModalModel
        All modes of the band.
    places : tuple of Place
        Where the outputs are.
    panels : PanelContributions or None
        At the first ear; None without panels.
    n_modes : int
        Modes reported: those of lowest frequency.
    """

    measured: Frf
    chart: modal.StabilisationChart
    model: modal.ModalModel
    places: tuple[Place, ...]
    panels: modal.PanelContributions | None
    n_modes: int

    @property
    def frequency(self) -> RealArray:
        """Natural frequencies of the modes reported, shape (n_modes,) [Hz]."""
        return self.model.frequency[: self.n_modes]

    @property
    def motion(self) -> ComplexArray:
        """Shapes as vectors in vehicle axes, shape (n_modes, n_place, 3), in a common phase [1]."""
        shapes = modal.in_common_phase(self.model.shapes[: self.n_modes])
        vectors = np.zeros((len(shapes), len(self.places), 3), dtype=complex)
        for number, place in enumerate(self.places):
            for output, direction in place.directions.items():
                entry = shapes[:, self.model.outputs.index(output), np.newaxis]
                vectors[:, number] += entry * np.array(direction)
        return vectors

    def mac(self, truth: npt.ArrayLike, mount_points_only: bool = False) -> RealArray:
        """Compare the reported modes with true ones.

        Parameters
        ----------
        truth : array, shape (n_true, n_output)
            Shapes in increasing frequency; columns as ``model.outputs``.
        mount_points_only : bool
            Leave the panels out, which move most.

        Returns
        -------
        array, shape (n_modes, n_true)
            Modal assurance criterion [1].

        Raises
        ------
        InputError
            Shapes with another number of outputs.
        """
        outputs = self.model.outputs
        columns = list(range(len(outputs)))
        if mount_points_only:
            at_points = {n for place in self.places if not place.is_panel for n in place.directions}
            columns = [k for k, name in enumerate(outputs) if name in at_points]
        true_shapes = np.asarray(truth)
        if true_shapes.ndim != 2 or true_shapes.shape[1] != len(outputs):
            raise InputError(
                f"true shapes of shape {true_shapes.shape}: one row per mode, one column for each "
                f"of the {len(outputs)} outputs"
            )
        return modal.mac_matrix(
            self.model.shapes[: self.n_modes][:, columns], true_shapes[:, columns]
        )


def body_modes(
    vehicle: MeasuredVehicle, band: tuple[float, float] = BAND, n_modes: int = N_MODES
) -> BodyModes:
    """Identify the modes of a vehicle from the measurement with the loudspeaker.

    Parameters
    ----------
    vehicle : MeasuredVehicle
        With its reciprocal measurement.
    band : (lower, upper)
        Wider than the modes asked for, so that those above have their own poles [Hz].
    n_modes : int
        To report, from the lowest.

    Raises
    ------
    InputError
        Fewer modes than asked for; panels on other lines; else as `poles_over_orders`.
    """
    measured = _motion_under_the_loudspeaker(vehicle)
    chart = modal.poles_over_orders(measured, FrfForm.RECEPTANCE, band)
    clusters = modal.pole_clusters(chart)
    if len(clusters) < n_modes:
        frequencies = ", ".join(f"{cluster.frequency:.1f}" for cluster in clusters)
        raise InputError(
            f"vehicle {vehicle.name}: {len(clusters)} modes from {band[0]:g} to {band[1]:g} Hz "
            f"({frequencies} Hz), {n_modes} asked for: widen the band or ask for fewer"
        )
    form, auxiliary = FrfForm.RECEPTANCE, modal.auxiliary_clusters(chart)
    clusters, auxiliary = modal.refined_poles(measured, form, band, clusters, auxiliary)
    model = modal.modal_model(measured, form, band, clusters, auxiliary)
    panels = None
    if vehicle.panels is not None:
        panels = modal.panel_contributions(model, vehicle.panels, vehicle.ears[0])
    return BodyModes(measured, chart, model, _places(vehicle), panels, n_modes)


def _motion_under_the_loudspeaker(vehicle: MeasuredVehicle) -> Frf:
    """Return the FRFs of mount points, then panels; rotations have another unit and stay out."""
    names: list[str] = []
    blocks = []
    for point in vehicle.points:
        response = virtual_point(vehicle.geometry(point, Method.RECIPROCAL))
        blocks.append(virtual_point_frf(vehicle.reciprocal, response=response).values[:, :3])
        names += [f"{point} {axis}" for axis in SENSOR_AXES]
    measured = vehicle.reciprocal
    if vehicle.panels is not None:
        panels = vehicle.panels.motion
        if not np.array_equal(panels.frequency, measured.frequency):
            raise InputError(f"vehicle {vehicle.name}: panels and body sensors have other lines")
        if panels.added_decay_rate != measured.added_decay_rate:
            raise InputError(f"vehicle {vehicle.name}: panels and body sensors had other windows")
        blocks.append(panels.select(inputs=vehicle.ears).values)
        names += panels.outputs
    values = np.concatenate(blocks, axis=1)
    return replace(measured, values=values, outputs=tuple(names))


def _places(vehicle: MeasuredVehicle) -> tuple[Place, ...]:
    """Return where the outputs are, in their order."""
    unit = {axis: row for axis, row in zip(SENSOR_AXES, np.eye(3).tolist(), strict=True)}
    places = [
        Place(
            point,
            vehicle.position(point),
            {f"{point} {axis}": (x, y, z) for axis, (x, y, z) in unit.items()},
        )
        for point in vehicle.points
    ]
    if vehicle.panels is not None:
        panels = vehicle.panels
        for name, (x, y, z), (nx, ny, nz) in zip(
            panels.names, panels.positions.tolist(), panels.normals.tolist(), strict=True
        ):
            places.append(Place(name, (x, y, z), {name: (nx, ny, nz)}))
    return tuple(places)
