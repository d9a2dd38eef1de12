"""The same reduction and inversion in pyFBS 1.0.7, where it is installed (2 GB with its viewers).

Its published geometry of a rig stands in tests/data/pyfbs-published; what is compared is what its
notebook of in-situ TPA does: virtual points, pseudo-inverse, on-board prediction.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from deboom.bench import ComponentPlan, write_component_test
from deboom.files.component_test import read_component_test
from deboom.measurement.component_tpa import component_tpa
from deboom.measurement.sensors import Impact, Sensor, SensorKind
from deboom.measurement.virtual_point import impact_geometry, sensor_geometry, virtual_point
from deboom.physics.force_inversion import PLAIN
from deboom.physics.rigid_body import rotation_matrix

vpt = pytest.importorskip("pyfbs.interface.vpt", exc_type=ImportError)
PUBLISHED = Path(__file__).parents[1] / "data" / "pyfbs-published"


def rows_of(geometry, group):
    """Channels or hits as pyFBS's tables have them, from the virtual point [m]."""
    columns = {
        f"{word}_{k + 1}": values[:, k]
        for word, values in (("Position", geometry.levers), ("Direction", geometry.directions))
        for k in range(3)
    }
    table = pd.DataFrame(columns).assign(Grouping=group, Quantity="Acceleration")
    return table.assign(Description=list(geometry.channels), Name=list(geometry.channels))


def virtual_rows(names, group):
    point = {f"Position_{k + 1}": 0.0 for k in range(3)}
    directions = np.vstack([np.eye(3)] * 2)
    columns = {f"Direction_{k + 1}": directions[:, k] for k in range(3)}
    table = pd.DataFrame(columns).assign(**point, Grouping=group, Quantity="Acceleration")
    return table.assign(Description=names, Name=names)


def transformation(sensors, impacts, **weights):
    return vpt.VPT(
        rows_of(sensors, 1),
        rows_of(impacts, 1),
        virtual_rows(["ux", "uy", "uz", "rx", "ry", "rz"], 1),
        virtual_rows(["fx", "fy", "fz", "mx", "my", "mz"], 1),
        **weights,
    )


@pytest.fixture(scope="module")
def published():
    """Three sensors around the published virtual point, and hits at their places."""
    sheet = pd.read_csv(PUBLISHED / "sensors_AB.csv").set_index("name").loc[["S3", "S4", "S5"]]
    point = pd.read_csv(PUBLISHED / "virtual_point_1.csv")[["x_mm", "y_mm", "z_mm"]].iloc[0] / 1e3
    places = sheet[["x_mm", "y_mm", "z_mm"]].to_numpy() / 1e3
    turns = rotation_matrix(np.deg2rad(sheet[["rx_deg", "ry_deg", "rz_deg"]].to_numpy()))
    sensors = [
        Sensor(name, SensorKind.ACCELEROMETER, "", "", "", place, turn)
        for name, place, turn in zip(sheet.index, places, turns, strict=True)
    ]
    impacts = [
        Impact(f"{name} {axis}", place, push)
        for name, place in zip(sheet.index, places, strict=True)
        for axis, push in zip("xyz", np.eye(3), strict=True)
    ]
    at = point.to_numpy()
    return sensor_geometry(sensors, at), impact_geometry(impacts, at)


def test_virtual_points_are_those_of_pyfbs_with_weights_and_without(published):
    sensors, impacts = published
    theirs = transformation(sensors, impacts)
    assert np.allclose(theirs.ru, sensors.forward)
    assert np.allclose(theirs.tu, virtual_point(sensors).inverse)
    assert np.allclose(theirs.tf, virtual_point(impacts).inverse.T)
    weight = np.linspace(0.5, 3.0, 9)
    # of loads theirs weighs squared forces, ours squared residuals of a motion: the inverse
    weighted = transformation(sensors, impacts, wu=np.diag(weight), wf=np.diag(1 / weight))
    assert np.allclose(weighted.tu, virtual_point(sensors, weight=weight).inverse)
    assert np.allclose(weighted.tf, virtual_point(impacts, weight=weight).inverse.T)


def test_in_situ_forces_and_on_board_prediction_are_those_of_the_notebook(tmp_path):
    plan = ComponentPlan(points=1, line_step=4.0)
    test = read_component_test(write_component_test(tmp_path / "test", 4, plan=plan, truth_seed=3))
    point, run = test.points[0], test.runs[0]
    theirs = transformation(
        sensor_geometry(point.sensors, point.position),
        impact_geometry(point.impacts, point.position),
    )
    functions = test.accelerance.select(inputs=point.impact_names)
    y_42 = functions.select(outputs=test.indicator_channels).values @ theirs.tf
    y_32 = functions.select(outputs=test.on_board_channels).values @ theirs.tf
    u_4 = run.acceleration.select(test.indicator_channels).values[:, :, np.newaxis]
    forces = np.linalg.pinv(y_42) @ u_4
    ours = component_tpa(test, PLAIN).runs[0]
    assert np.allclose(ours.blocked.force.values, forces[:, :, 0], rtol=1e-6)
    assert np.allclose(ours.on_board.predicted.values, (y_32 @ forces)[:, :, 0], rtol=1e-6)
