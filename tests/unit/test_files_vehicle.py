"""A vehicle's folder: what does not fit together is refused in one sentence that names it."""

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from broken_files import edits, refused, without_sections

from deboom.bench.layout import LOAD_CASES
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import InputError
from deboom.files.uff import read_uff, write_uff
from deboom.files.vehicle import VEHICLE, read_vehicle
from deboom.measurement.modal import ModalModel, PoleCluster, panel_contributions
from deboom.physics.frf import FrfForm

DIRECT, RECIPROCAL = "noise_transfer/direct.uff", "noise_transfer/reciprocal.uff"
RUN = "operating/g5_wot120.uff"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """One vehicle without its accelerance, which is large."""
    folder = tmp_path_factory.mktemp("files") / "car"
    return write_vehicle(folder, 2, "U06-4", load_cases=LOAD_CASES[:1], accelerance=False)


@pytest.fixture
def folder(written, tmp_path):
    return shutil.copytree(written, tmp_path / "car")


def change(path, where, **fields):
    """Write the file again with some fields of one function changed."""
    functions = list(read_uff(path))
    functions[where] = replace(functions[where], **fields)
    write_uff(path, functions, binary=True)


def test_a_folder_is_read_without_accelerance(folder):
    vehicle = read_vehicle(folder)
    assert (vehicle.name, vehicle.group) == ("U06-4", "U06")
    assert vehicle.accelerance is None
    assert vehicle.points == ("EnM", "GeM", "TSM", "Du left", "Du right")
    assert vehicle.powertrain_mounts == ("EnM", "GeM", "TSM")
    assert [len(blows) for blows in vehicle.impacts.values()] == [9] * 5
    assert [len(sensors) for sensors in vehicle.body_sensors.values()] == [3] * 5
    run = vehicle.run("g5_wot120")
    assert (run.gear, run.total_ratio, run.order) == (5, 3.4, 1.5)
    assert run.pressure.channels == vehicle.ears


@pytest.mark.parametrize("file", [DIRECT, RUN])
def test_mixed_microphones_are_refused(folder, file):
    change(folder / file, 0, response_name="MIC9999")
    with pytest.raises(InputError, match=r"'MIC9999', but 'driver ear' is 'MIC2101'.*not be mixed"):
        read_vehicle(folder)


def restated(path, other):
    """Write all functions of a file again under the same label: another sign or quantity."""
    jw = 2j * np.pi
    functions = [
        replace(each, values=other(each.values, jw * each.abscissa)) for each in read_uff(path)
    ]
    write_uff(path, functions, binary=True)


@pytest.mark.parametrize(
    ("file", "other", "words"),
    [
        ("reciprocal.uff", lambda v, _: -v, "polarity reversed: of the loudspeaker"),
        ("direct.uff", lambda v, _: -v, "polarity reversed: of the loudspeaker, the microphone or"),
        ("reciprocal.uff", lambda v, jw: v * jw, "factor jω: volume velocity, stated as volume"),
        ("reciprocal.uff", lambda v, jw: -v * jw, "factor jω: .*; and polarity reversed"),
        ("reciprocal.uff", lambda v, jw: v / jw, "factor 1/jω: velocity of the body"),
        ("direct.uff", lambda v, _: v.conj(), "conjugated: either hammer or loudspeaker"),
        ("direct.uff", lambda v, _: v / 9.80665, r"a factor of 1?\d\.\d: unit or calibration"),
    ],
)
def test_loudspeaker_and_hammer_are_held_against_each_other_in_phase(folder, file, other, words):
    restated(folder / "noise_transfer" / file, other)
    with pytest.raises(InputError, match=rf"at the driver ear .* likeness of 0\.\d+, .*: {words}"):
        read_vehicle(folder)


def test_a_path_without_noise_transfer_function_is_refused(folder):
    functions = read_uff(folder / DIRECT)
    write_uff(folder / DIRECT, functions[1:], binary=True)
    with pytest.raises(InputError, match=r"hammer: pressure 'driver ear' per I1 x .*is not in it"):
        read_vehicle(folder)
    write_uff(folder / DIRECT, [functions[0], *functions], binary=True)
    with pytest.raises(InputError, match="is in it 2 times: keep one"):
        read_vehicle(folder)


@pytest.mark.parametrize(("table", "name"), [("sensors.csv", "B1"), ("impacts.csv", "I1 x")])
def test_what_lies_beside_a_mount_lies_near_it(folder, table, name):
    """On the other side of the car by a wrong sign, as no consistency of one point shows."""
    path = folder / table
    rows = pd.read_csv(path, keep_default_na=False)
    column = rows.columns[0]
    rows.loc[rows[column] == name, "y [m]"] -= 1.2
    rows.to_csv(path, index=False)
    with pytest.raises(InputError, match=rf"{table}: {name} lies 1\.\d+ m from EnM, which it is"):
        read_vehicle(folder)


def test_a_mount_without_blows_is_refused(folder):
    path = folder / "impacts.csv"
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(line for line in lines if ",TSM," not in line), encoding="utf-8")
    with pytest.raises(InputError, match=r"TSM has no blow of the hammer.*path without noise"):
        read_vehicle(folder)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"denominator_unit": "V"}, r"is in 'm/s\^2/V': export it in m/s\^2/m\^3/s\^2"),
        ({"function_type": 0}, "UFF function type 0: export it as 4"),
    ],
)
def test_a_loudspeaker_without_calibration_is_refused(folder, fields, sentence):
    change(folder / RECIPROCAL, 3, **fields)
    with pytest.raises(InputError, match=sentence):
        read_vehicle(folder)


@pytest.mark.parametrize(
    ("fault", "sentence"),
    edits(
        """
impacts.csv | I1 y,EnM | I1 x,EnM | impact 'I1 x' already stands in line 2
impacts.csv | ,+x, | ,along, | direction 'along': use one of +x
impacts.csv | I1 x,EnM | I1 x,XYZ | 'XYZ' is no mount or piece
impacts.csv | I1 y,EnM,,301,+y | I1 y,EnM,,301,+x | DoF 301 +x already stands
sensors.csv | B1,accelerometer,B&K 4321,EnM | B1,accelerometer,B&K 4321,X | 'X' is
channels.csv | B1 x, | B99 x, | no row for channel B1 x
vehicle.toml | dominant_order = 1.5 | dominant_order = 3.0 | is of order 1.5, not of order 3: corr
vehicle.toml | "A1" | "A99" | source_sensors ['A99'] are not in
vehicle.toml | gear = 5 | gear = 9 | is in gear 9, but total_ratios in [engine] has 7 gears
vehicle.toml | node = 902 | node = 901 | two [[ears]] have the node '901'
panels.csv | trunk floor,601,0.0,0.0,1.0 | trunk floor,601,0.0,0.0,2.0 | no unit vector
panels.csv | rear bench,602 | rear bench,601 | node 601 already stands
panels.csv | ,0.22\\n | ,-0.22\\n | area of 'roof' is not positive
"""
    ),
)
def test_tables_that_do_not_fit_are_refused(folder, fault, sentence):
    fault(folder)
    refused(read_vehicle, folder, sentence)


def test_panels_are_read_as_written(folder):
    panels = read_vehicle(folder).panels
    assert panels.names[:2] == ("trunk floor", "rear bench")
    assert panels.motion.outputs == panels.pressure.outputs == panels.names
    assert panels.motion.inputs == ("driver ear", "passenger ear")
    assert panels.pressure.unit == "Pa/(m^3/s^2)"
    assert np.linalg.norm(panels.normals, axis=1) == pytest.approx(1.0)
    assert panels.areas[0] == pytest.approx(0.11)


def test_a_vehicle_without_panels_is_read(folder):
    without_sections("vehicle.toml", "[panels]")(folder)
    assert read_vehicle(folder).panels is None


def model_of(panels, form=FrfForm.RECEPTANCE, frequency=40.0, outputs=None):
    names = panels.names if outputs is None else outputs
    constants, nothing = np.ones((1, len(names), 2), dtype=complex), np.zeros((len(names), 2))
    clusters = (PoleCluster(frequency, 0.0, 0.03, 0.0, 1.0),)
    parts = (constants, constants[:, :, 0], nothing, nothing, np.ones(1), np.zeros(1))
    return ModalModel(
        clusters, form, names, panels.motion.inputs, *parts, panels.motion, nothing, 0.0
    )


def test_contributions_follow_from_pressure_area_and_motion(folder):
    panels = read_vehicle(folder).panels
    contributions = panel_contributions(model_of(panels), panels, "driver ear")
    line = np.flatnonzero(panels.pressure.frequency == 40.0)[0]
    expected = -((2 * np.pi * 40.0) ** 2) * panels.pressure.values[line, :, 0] * panels.areas
    assert contributions.values[0] == pytest.approx(expected)
    assert contributions.pressure[0] == pytest.approx(expected.sum())
    assert contributions.shares.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("changes", "ear", "sentence"),
    [
        ({"form": FrfForm.INERTANCE}, "driver ear", "receptance-like"),
        ({"outputs": ("trunk floor",)}, "driver ear", r"knows nothing of \['rear bench'"),
        ({}, "rear ear", r"knows nothing of \['rear ear'\]"),
        ({"frequency": 90.0}, "driver ear", "from 20 to 80 Hz only"),
    ],
)
def test_contributions_that_cannot_be_known_are_refused(folder, changes, ear, sentence):
    panels = read_vehicle(folder).panels
    with pytest.raises(InputError, match=sentence):
        panel_contributions(model_of(panels, **changes), panels, ear)


def test_the_check_says_whether_the_stiffness_of_the_mounts_follows_from_the_car(folder):
    lines = dict(VEHICLE.lines(folder))
    assert "does not follow from this car" in lines["stiffness"]
    assert "were not recorded in its hammer test" in lines["stiffness"]
    assert "library" not in lines


def test_a_vehicle_states_tolerances_and_the_torque_of_its_runs(folder):
    vehicle = read_vehicle(folder)
    assert vehicle.tolerances.sensor_position == 0.002
    assert vehicle.assumed == ()
    assert vehicle.runs[0].engine_torque.max() == pytest.approx(120.0, rel=0.01)
    toml = folder / "vehicle.toml"
    text = toml.read_text(encoding="utf-8")
    toml.write_text(text.replace("sensor_angle_deg = 1.0\n", ""), encoding="utf-8")
    (sentence,) = read_vehicle(folder).assumed
    assert "sensor_angle_deg = 2.5" in sentence
