"""Panels of a vehicle's folder, and what their contributions refuse."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.vehicle_writer import NO_VEHICLE_ERRORS, write_vehicle
from deboom.errors import InputError
from deboom.files.rows import PanelRow, read_table
from deboom.files.uff import read_uff, write_uff
from deboom.files.vehicle import read_vehicle
from deboom.measurement.modal import ModalModel, PoleCluster, panel_contributions
from deboom.physics.frf import FrfForm

MOTION = "noise_transfer/panel_motion.uff"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("panels") / "car"
    return write_vehicle(folder, 1, errors=NO_VEHICLE_ERRORS, load_cases=(), accelerance=False)


@pytest.fixture
def folder(written, tmp_path):
    return shutil.copytree(written, tmp_path / "car")


def test_panels_are_read_as_written(folder):
    panels = read_vehicle(folder).panels
    assert panels.names[:2] == ("trunk floor", "rear bench")
    assert panels.motion.outputs == panels.pressure.outputs == panels.names
    assert panels.motion.inputs == ("driver ear", "passenger ear")
    assert panels.pressure.unit == "Pa/(m^3/s^2)"
    assert np.linalg.norm(panels.normals, axis=1) == pytest.approx(1.0)
    assert panels.areas[0] == pytest.approx(0.11)


def test_a_vehicle_without_panels_is_read(folder):
    path = folder / "vehicle.toml"
    text = path.read_text(encoding="utf-8")
    start = text.index("[panels]")
    end = text.index("[", start + 1)
    path.write_text(text[:start] + text[end:], encoding="utf-8")
    assert read_vehicle(folder).panels is None


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("trunk floor,601,0.0,0.0,1.0", "trunk floor,601,0.0,0.0,2.0", "no unit vector"),
        ("rear bench,602", "rear bench,601", "node 601 already stands"),
        ("front floor,603", "front floor,x", "no whole number from 1"),
        ("area [m^2]", "area", "no unit"),
        (",0.22\n", ",-0.22\n", "area of 'roof' is not positive"),
    ],
)
def test_a_faulty_position_sheet_is_refused(folder, old, new, sentence):
    path = folder / "panels.csv"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_table(path, PanelRow)


def test_a_missing_function_and_other_lines_are_refused(folder):
    functions = list(read_uff(folder / MOTION))
    write_uff(folder / MOTION, functions[1:], binary=True)
    with pytest.raises(InputError, match="acceleration 'trunk floor' per driver ear"):
        read_vehicle(folder)
    short = [replace(f, abscissa=f.abscissa[1:], values=f.values[1:]) for f in functions]
    write_uff(folder / MOTION, short, binary=True)
    with pytest.raises(InputError, match="have different lines"):
        read_vehicle(folder)


def model_of(panels, form=FrfForm.RECEPTANCE, frequency=40.0, outputs=None):
    names = panels.names if outputs is None else outputs
    constants = np.ones((1, len(names), 2), dtype=complex)
    clusters = (PoleCluster(frequency, 0.0, 0.03, 0.0, 1.0),)
    nothing = np.zeros((len(names), 2))
    return ModalModel(
        clusters,
        form,
        names,
        panels.motion.inputs,
        constants,
        constants[:, :, 0],
        nothing,
        nothing,
        np.ones(1),
        np.zeros(1),
        panels.motion,
        nothing,
        0.0,
    )


def test_contributions_follow_from_pressure_area_and_motion(folder):
    panels = read_vehicle(folder).panels
    found = panel_contributions(model_of(panels), panels, "driver ear")
    line = np.flatnonzero(panels.pressure.frequency == 40.0)[0]
    expected = -((2 * np.pi * 40.0) ** 2) * panels.pressure.values[line, :, 0] * panels.areas
    assert found.values[0] == pytest.approx(expected)
    assert found.pressure[0] == pytest.approx(expected.sum())
    assert found.shares.sum() == pytest.approx(1.0)


def test_contributions_that_cannot_be_known_are_refused(folder):
    panels = read_vehicle(folder).panels
    with pytest.raises(InputError, match="receptance-like"):
        panel_contributions(model_of(panels, FrfForm.INERTANCE), panels, "driver ear")
    with pytest.raises(InputError, match="knows nothing of \\['windshield'\\]"):
        panel_contributions(model_of(panels, outputs=panels.names[:-1]), panels, "driver ear")
    with pytest.raises(InputError, match="knows nothing of \\['rear ear'\\]"):
        panel_contributions(model_of(panels), panels, "rear ear")
    with pytest.raises(InputError, match="from 20 to 80 Hz only"):
        panel_contributions(model_of(panels, frequency=90.0), panels, "driver ear")
