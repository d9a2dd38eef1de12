"""Modes of a trimmed body under the loudspeaker, for studies: what is found, as tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.measured_vehicle import MeasuredVehicle, Method
from deboom.measurement.modal_analysis import ModalModel, modal_model, poles_over_orders
from deboom.measurement.modal_poles import StabilisationChart, pole_clusters
from deboom.measurement.mode_shapes import in_common_phase, mac_matrix
from deboom.measurement.panels import PanelContributions, panel_contributions
from deboom.measurement.sensors import SENSOR_AXES
from deboom.measurement.virtual_point import virtual_point, virtual_point_frf
from deboom.physics.frf import FrfForm

BAND = (20.0, 80.0)
"""The thesis finds five modes in it [Hz] (figure 43)."""

N_MODES = 5


@dataclass(frozen=True)
class Place:
    """A point whose motion was measured.

    Parameters
    ----------
    label : str
        Mount, piece of a mount, or panel.
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
        """Whether it is known along its normal only."""
        return len(self.directions) == 1


@dataclass(frozen=True, eq=False)
class ModalPart:
    """Modal analysis of one vehicle.

    Parameters
    ----------
    vehicle : str
    measured : Frf
        Outputs ``<point> x y z`` and panels, inputs the ears [(m/s²)/(m³/s²)].
    chart : StabilisationChart
    model : ModalModel
        All modes of the band.
    places : tuple of Place
        Where the outputs are.
    panels : PanelContributions or None
        At the first ear; None without panels.
    n_modes : int
        Modes reported: those of lowest frequency.
    """

    vehicle: str
    measured: Frf
    chart: StabilisationChart
    model: ModalModel
    places: tuple[Place, ...]
    panels: PanelContributions | None
    n_modes: int

    @property
    def motion(self) -> ComplexArray:
        """Shapes as vectors in vehicle axes, shape (n_modes, n_place, 3), in a common phase [1]."""
        shapes = in_common_phase(self.model.shapes[: self.n_modes])
        vectors = np.zeros((len(shapes), len(self.places), 3), dtype=complex)
        for number, place in enumerate(self.places):
            for output, direction in place.directions.items():
                entry = shapes[:, self.model.outputs.index(output), np.newaxis]
                vectors[:, number] += entry * np.array(direction)
        return vectors


def body_motion_frf(vehicle: MeasuredVehicle) -> Frf:
    """Return how mount points and panels move under the loudspeaker.

    Returns
    -------
    Frf
        Outputs ``<point> x y z``, then panels; inputs the ears [(m/s²)/(m³/s²)]. Rotations of the
        virtual points are left out: their unit would have to be weighed against translations.
    """
    names: list[str] = []
    blocks = []
    for point in vehicle.points:
        seen = virtual_point(vehicle.geometry(point, Method.RECIPROCAL))
        blocks.append(virtual_point_frf(vehicle.reciprocal, response=seen).values[:, :3])
        names += [f"{point} {axis}" for axis in SENSOR_AXES]
    if vehicle.panels is not None:
        panels = vehicle.panels.motion
        if not np.array_equal(panels.frequency, vehicle.reciprocal.frequency):
            raise InputError(f"vehicle {vehicle.name}: panels and body sensors have other lines")
        blocks.append(panels.select(inputs=vehicle.ears).values)
        names += panels.outputs
    measured = vehicle.reciprocal
    values = np.concatenate(blocks, axis=1)
    return Frf(measured.frequency, values, tuple(names), measured.inputs, measured.unit)


def modal_part(
    vehicle: MeasuredVehicle, band: tuple[float, float] = BAND, n_modes: int = N_MODES
) -> ModalPart:
    """Identify the modes of a vehicle from the measurement with the loudspeaker.

    Parameters
    ----------
    vehicle : MeasuredVehicle
    band : tuple of float
        From, to [Hz]; wider than the modes asked for, so that those above have their own poles.
    n_modes : int
        To report, from the lowest.

    Returns
    -------
    ModalPart

    Raises
    ------
    InputError
        Fewer modes than asked for; else as `poles_over_orders`.
    """
    measured = body_motion_frf(vehicle)
    chart = poles_over_orders(measured, FrfForm.RECEPTANCE, band)
    clusters = pole_clusters(chart)
    if len(clusters) < n_modes:
        found = ", ".join(f"{cluster.frequency:.1f}" for cluster in clusters)
        raise InputError(
            f"vehicle {vehicle.name}: {len(clusters)} modes from {band[0]:g} to {band[1]:g} Hz "
            f"({found} Hz), {n_modes} asked for: widen the band or ask for fewer"
        )
    model = modal_model(measured, FrfForm.RECEPTANCE, band, clusters)
    panels = None
    if vehicle.panels is not None:
        panels = panel_contributions(model, vehicle.panels, vehicle.ears[0])
    return ModalPart(vehicle.name, measured, chart, model, _places(vehicle), panels, n_modes)


def _places(vehicle: MeasuredVehicle) -> tuple[Place, ...]:
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
        known = vehicle.panels
        for name, (x, y, z), (nx, ny, nz) in zip(
            known.names, known.positions.tolist(), known.normals.tolist(), strict=True
        ):
            places.append(Place(name, (x, y, z), {name: (nx, ny, nz)}))
    return tuple(places)


def truth_mac(part: ModalPart, truth: npt.ArrayLike, mount_points_only: bool = False) -> RealArray:
    """Compare the reported modes with true ones.

    Parameters
    ----------
    part : ModalPart
    truth : array, shape (n_true, n_output)
        In increasing frequency; columns as ``part.model.outputs``.
    mount_points_only : bool
        Leave the panels out, which move most.

    Returns
    -------
    array, shape (n_modes, n_true)
        Modal assurance criterion [1].
    """
    columns = list(range(len(part.model.outputs)))
    if mount_points_only:
        at_points = {
            name for place in part.places if not place.is_panel for name in place.directions
        }
        columns = [k for k, name in enumerate(part.model.outputs) if name in at_points]
    known = np.asarray(truth)
    if known.ndim != 2 or known.shape[1] != len(part.model.outputs):
        raise InputError(
            f"true shapes of shape {known.shape}: one row per mode, one column for each of the "
            f"{len(part.model.outputs)} outputs"
        )
    return mac_matrix(part.model.shapes[: part.n_modes][:, columns], known[:, columns])


def summary(part: ModalPart, truth: npt.ArrayLike | None = None) -> dict[str, float]:
    """Return ``mode_<n>_hz`` and, against true shapes, ``mode_<n>_mac``, n from 1."""
    numbers = {
        f"mode_{n}_hz": float(value)
        for n, value in enumerate(part.model.frequency[: part.n_modes], 1)
    }
    if truth is not None:
        agreement = np.diag(truth_mac(part, truth))
        numbers |= {f"mode_{n}_mac": float(value) for n, value in enumerate(agreement, 1)}
    return numbers


def modal_tables(part: ModalPart, truth: npt.ArrayLike | None = None) -> dict[str, pd.DataFrame]:
    """Return the modes with their spread over the orders and, if known, each panel's share."""
    clusters = part.model.clusters[: part.n_modes]
    numbers = [f"mode {n}" for n in range(1, len(clusters) + 1)]
    modes = pd.DataFrame(
        {
            "mode": numbers,
            "frequency [Hz]": [c.frequency for c in clusters],
            "spread of frequency [Hz]": [c.frequency_spread for c in clusters],
            "damping ratio [%]": [100 * c.damping for c in clusters],
            "spread of damping [%]": [100 * c.damping_spread for c in clusters],
            "orders that agree [%]": [100 * c.share for c in clusters],
            "complexity 1 - MPC [%]": 100 * part.model.complexity[: part.n_modes],
            "residues of one shape [%]": 100 * part.model.rank_one[: part.n_modes],
        }
    )
    if truth is not None:
        modes["MAC with the truth [1]"] = np.diag(truth_mac(part, truth))
        modes["MAC of mount points [1]"] = np.diag(truth_mac(part, truth, mount_points_only=True))
    tables = {"modes": modes}
    if part.panels is not None:
        shares = pd.DataFrame(
            100 * part.panels.shares[: part.n_modes],
            columns=[f"{panel} [%]" for panel in part.panels.panels],
        )
        shares.insert(0, "mode", numbers)
        tables["panel_contributions"] = shares
    return tables
