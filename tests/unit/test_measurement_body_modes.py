"""Modes of a body out of a vehicle's files, and their part of a report."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.fleet import NO_SPREAD
from deboom.bench.vehicle_writer import VehicleErrors, write_vehicle
from deboom.errors import InputError
from deboom.files.vehicle import read_vehicle
from deboom.measurement.body_modes import body_modes
from deboom.measurement.channels import Frf
from deboom.report import Report
from deboom.study.modal_report import append_modes, body_motion

pytest.importorskip("sdypy.EMA", reason="modal analysis is an extra")


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    errors = VehicleErrors(state=NO_SPREAD)
    folder = tmp_path_factory.mktemp("part") / "car"
    return read_vehicle(write_vehicle(folder, 1, errors=errors, load_cases=(), accelerance=False))


@pytest.fixture(scope="module")
def part(car):
    return body_modes(car)


def test_outputs_are_mount_points_and_panels(part):
    assert part.model.outputs[:3] == ("EnM x", "EnM y", "EnM z")
    assert part.model.outputs[-1] == "windshield"
    assert part.model.inputs == ("driver ear", "passenger ear")
    assert [place.label for place in part.places][3:6] == ["Du left", "Du right", "trunk floor"]
    assert [place.is_panel for place in part.places] == [False] * 5 + [True] * 8


def test_motion_is_along_the_directions_of_the_outputs(part):
    roof = [place.label for place in part.places].index("roof")
    moved = part.motion[:, roof]
    assert np.all(moved[:, :2] == 0)
    drawn = body_motion(part)
    assert np.asarray(drawn.normals)[roof].tolist() == [0.0, 0.0, -1.0]
    assert drawn.titles[0] == "23.7 Hz, ζ 2.8 %"


def in_report(modes, truth=None):
    report = Report("Modes")
    append_modes(report, modes, truth, "U06-1")
    return report


def test_a_report_has_what_is_known(part):
    few = replace(part, n_modes=2)
    report = in_report(few)
    assert list(report.tables) == ["modes", "panel_contributions"]
    assert "MAC with the truth [1]" not in report.tables["modes"]
    few = replace(few, panels=None)
    report = in_report(few, few.model.shapes)
    assert list(report.figures) == ["stabilisation", "mode_shapes"]
    assert report.tables["modes"]["MAC with the truth [1]"].to_numpy() == pytest.approx(1.0)


def test_a_vehicle_without_panels_has_modes_all_the_same(car):
    bare = body_modes(replace(car, panels=None))
    assert bare.panels is None
    assert len(bare.model.outputs) == 15


def test_what_cannot_be_answered_is_refused(car, part):
    with pytest.raises(InputError, match=r"modes from 20 to 80 Hz .* 12 asked for"):
        body_modes(car, n_modes=12)
    with pytest.raises(InputError, match="one column for each of the 23 outputs"):
        part.mac(np.ones((5, 15)))
    motion = car.panels.motion
    other = Frf(motion.frequency + 1, motion.values, motion.outputs, motion.inputs, motion.unit)
    with pytest.raises(InputError, match="other lines"):
        body_modes(replace(car, panels=replace(car.panels, motion=other)))
