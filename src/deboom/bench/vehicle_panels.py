"""The panels around the cabin, each with an accelerometer and a microphone in front of it."""

from __future__ import annotations

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.body import Body, Cabin
from deboom.bench.ears import EARS, panel_pressure
from deboom.bench.parameters import read_data
from deboom.bench.vehicle_acquisition import AcquisitionErrors, Setup
from deboom.bench.vehicle_layout import EAR_NODES
from deboom.files.uff import UffFunction
from deboom.files.vehicle_panels import PanelRow

FIRST_PANEL_NODE = 601
FRF = 4

_PLACES = {
    "trunk floor": ((3.3, 0.0, -0.05), (0.0, 0.0, 1.0)),
    "rear bench": ((2.7, 0.0, 0.15), (-0.8, 0.0, 0.6)),
    "front floor": ((1.4, 0.0, -0.2), (0.0, 0.0, 1.0)),
    "front doors": ((1.5, -0.75, 0.25), (0.0, 1.0, 0.0)),
    "rear doors": ((2.4, -0.75, 0.25), (0.0, 1.0, 0.0)),
    "tailgate": ((3.7, 0.0, 0.45), (-1.0, 0.0, 0.0)),
    "roof": ((2.2, 0.0, 0.95), (0.0, 0.0, -1.0)),
    "windshield": ((0.9, 0.0, 0.7), (0.8, 0.0, -0.6)),
}
"""Accelerometer and inward normal of each panel [m], [1]; of doors, those of the left one."""


def panel_table(cabin: Cabin) -> list[PanelRow]:
    """Return the position sheet of the panels."""
    names = read_data("body_prior.json")["panels"]
    return [
        PanelRow(name, FIRST_PANEL_NODE + number, *_PLACES[name], area=float(area))
        for number, (name, area) in enumerate(zip(names, cabin.panel_areas, strict=True))
    ]


def panel_motion(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find how the panels move when a loudspeaker breathes at an ear.

    Returns
    -------
    array, shape (f, n_panel, n_ear)
        Displacement inwards per volume displacement [1/m²].
    """
    # the raised pressure pushes every panel outwards, against its shape
    modal_force = -panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    modal = modal_force * body.modal_receptance(frequency)[:, None, :]
    return np.swapaxes(modal @ body.shapes_at_panels, 1, 2)


def pressure_at_panels(cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the pressure at still panels when a loudspeaker breathes at an ear.

    Returns
    -------
    array, shape (f, n_panel, n_ear)
        Per volume acceleration [Pa/(m³/s²)].

    Notes
    -----
    A cabin answers alike with source and receiver exchanged: what a panel raises at the ear per
    volume displacement, the ear raises at the panel.
    """
    per_volume = panel_pressure(cabin, frequency) / cabin.panel_areas
    per_acceleration = per_volume / -((2 * np.pi * frequency) ** 2)[:, None, None]
    return np.swapaxes(per_acceleration, 1, 2)


def listen_at_panels(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> tuple[ComplexArray, ComplexArray]:
    """Acquire motion of and pressure at the panels, with the loudspeaker at each ear in turn.

    Returns
    -------
    motion : array, shape (f, n_panel, n_ear)
        Acceleration inwards per volume acceleration [(m/s²)/(m³/s²)].
    pressure : array, shape (f, n_panel, n_ear)
        [Pa/(m³/s²)].
    """
    n_panel = cabin.panel_areas.size
    gains = 1 + generator.normal(0, errors.accelerometer_gain, n_panel)
    microphones = 10 ** (generator.normal(0, errors.microphone_db, n_panel) / 20)
    motion = gains[:, None] * setup.source * panel_motion(body, cabin, frequency)
    pressure = microphones[:, None] * setup.source * pressure_at_panels(cabin, frequency)
    return (
        _noisy(motion, errors.relative, generator),
        _noisy(pressure, errors.relative, generator),
    )


def _noisy(exact: ComplexArray, relative: float, generator: np.random.Generator) -> ComplexArray:
    noise = generator.normal(0, 1 / np.sqrt(2), (2, *exact.shape))
    return np.asarray(exact * (1 + relative * (noise[0] + 1j * noise[1])))


def panel_functions(
    panels: list[PanelRow],
    values: ComplexArray,
    frequency: RealArray,
    quantity: tuple[str, str],
    vehicle: str,
) -> list[UffFunction]:
    """Return functions of the panels per volume acceleration at the ears, UFF type 4.

    Parameters
    ----------
    panels : list of PanelRow
    values : array, shape (f, n_panel, n_ear)
        [SI].
    frequency : array, shape (f,)
        [Hz].
    quantity : (str, str)
        Word of the UFF ordinate and its SI unit.
    vehicle : str
        For the title.
    """
    return [
        UffFunction(
            abscissa=frequency,
            values=values[:, row, column],
            function_type=FRF,
            response_node=panel.node,
            response_direction="scalar",
            reference_node=EAR_NODES[ear],
            reference_direction="scalar",
            ordinate=quantity[0],
            ordinate_unit=quantity[1],
            denominator="general",
            denominator_unit="m^3/s^2",
            id_lines=(f"{vehicle}, loudspeaker at {ear}, {quantity[0]}, {panel.panel}",),
            response_name=f"P{row + 1}",
            reference_name="LOUDSP 1",
        )
        for row, panel in enumerate(panels)
        for column, ear in enumerate(EARS)
    ]
