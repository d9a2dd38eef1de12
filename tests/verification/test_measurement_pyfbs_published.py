"""Geometry and quality of real rigs, as the authors of pyFBS published them."""

import csv
from pathlib import Path

import numpy as np
import pytest

from deboom.measurement.channel_geometry import sensor_geometry
from deboom.measurement.coherence import CHANCE
from deboom.measurement.conditioning import conditioning
from deboom.measurement.quality_check import QualityLimits
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.measurement.virtual_point import virtual_point
from deboom.physics.rigid_body import rotation_matrix

DATA = Path(__file__).parents[1] / "data" / "pyfbs-published"


def rows(name):
    with (DATA / name).open(newline="") as file:
        return list(csv.DictReader(file))


def numbers(row, *keys):
    return np.array([float(row[key]) for key in keys])


@pytest.fixture(scope="module")
def sensors():
    return {
        row["name"]: Sensor(
            row["name"],
            SensorKind.ACCELEROMETER,
            "",
            "",
            "",
            1e-3 * numbers(row, "x_mm", "y_mm", "z_mm"),
            rotation_matrix(np.deg2rad(numbers(row, "rx_deg", "ry_deg", "rz_deg"))),
        )
        for row in rows("sensors_AB.csv")
    }


@pytest.fixture(scope="module")
def first_point(sensors):
    position = 1e-3 * numbers(rows("virtual_point_1.csv")[0], "x_mm", "y_mm", "z_mm")
    return sensor_geometry([sensors[name] for name in ("S3", "S4", "S5")], position)


def test_three_sensors_determine_the_published_virtual_point(first_point):
    assert first_point.forward.shape == (9, 6)
    distances = 1e3 * np.linalg.norm(first_point.levers[::3], axis=1)
    assert distances == pytest.approx([32.3, 26.0, 32.7], abs=0.05)
    assert np.linalg.matrix_rank(first_point.forward) == 6
    assert np.linalg.cond(first_point.forward) == pytest.approx(48.9, abs=0.05)


def test_the_condition_number_is_an_artefact_of_the_metre(first_point):
    state = conditioning(first_point)
    assert state.length == pytest.approx(0.0303, abs=1e-4)
    assert 1.0 < state.condition_number < 2.0
    assert np.linalg.cond(first_point.forward * [1, 1, 1, 1e-3, 1e-3, 1e-3]) > 1e4


def test_the_forward_matrix_is_the_published_formula(first_point):
    # R_u of pyFBS, written out: direction times [I, (0 rz −ry; −rz 0 rx; ry −rx 0)]
    expected = [
        [*d, *(d @ [[0, z, -y], [-z, 0, x], [y, -x, 0]])]
        for d, (x, y, z) in zip(first_point.directions, first_point.levers, strict=True)
    ]
    assert first_point.forward == pytest.approx(np.array(expected), abs=1e-15)
    weights = np.diag(first_point.weights)
    forward = first_point.forward
    inverse = np.linalg.inv(forward.T @ weights @ forward) @ forward.T @ weights
    assert virtual_point(first_point).inverse == pytest.approx(inverse, rel=1e-9, abs=1e-9)


def test_channel_directions_follow_from_orientation(sensors):
    published = rows("channels_from_orientation.csv")
    assert len(published) == 6
    for row in published:
        sensor, axis = sensors[row["channel"][:2]], "xyz".index(row["channel"][2])
        direction = numbers(row, "dx", "dy", "dz")
        assert sensor.orientation[:, axis] == pytest.approx(direction, abs=1e-6)
        assert sensor.position == pytest.approx(
            1e-3 * numbers(row, "x_mm", "y_mm", "z_mm"), abs=1e-8
        )


def test_measured_virtual_points_are_far_from_perfect():
    reciprocity = np.loadtxt(DATA / "rubber_mount_vp2_reciprocity_6x6.csv", delimiter=",")
    pairs = reciprocity[np.triu_indices(6, k=1)]
    assert reciprocity == pytest.approx(reciprocity.T)
    assert np.diag(reciprocity) == pytest.approx(np.ones(6))
    # 0.5 is chance, so these values say: some pairs are reciprocal, some know nothing of each other
    assert pairs.min() > CHANCE
    assert np.count_nonzero(pairs > 0.95) == 3
    assert np.count_nonzero(pairs < CHANCE + 0.1) == 4
    kept = np.count_nonzero(pairs >= QualityLimits().reciprocity)
    assert kept == 7
    consistency = np.loadtxt(DATA / "lab_AB_measurement_consistency_15x15.csv", delimiter=",")
    assert consistency.min() > CHANCE
    assert np.mean(consistency > 0.95) < 0.3
    assert np.mean(consistency >= QualityLimits().specific_consistency) > 0.7
