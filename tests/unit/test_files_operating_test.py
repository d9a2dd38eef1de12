"""The folder of a running compressor: what is written reads back, what is bad is named."""

import re
import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from broken_files import content, edited, edits, function, functions, refused

from deboom.bench.compressor_rig import OperationPlan
from deboom.bench.compressor_writer import write_operating_test
from deboom.files import operating_test
from deboom.files.inertance_test import read_placed
from deboom.files.rows import PlacedImpact, PlacedSensor, write_positions
from deboom.files.schema import dump_toml, load_toml

SENSORS = tuple(
    PlacedSensor(f"A{k}", 10 + k, (0.1 * k, 0.0, 0.05), (0.0, 0.0, 0.1)) for k in (1, 2, 3)
)
NODES = operating_test.SweepNodes(SENSORS, 1, (("mount 1", 31), ("mount 2", 32)), (("driver", 41),))
LINES = np.arange(17.0, 25.0)
WITH_HOSES = 'hammer_with_hoses = "hammer_with_hoses"'
RECORD = r'\[\[sweeps\]\]\nname = "soft 7.5 bar over time"\n(?:.+\n)+\n'
SOFT = "sweeps/soft_7.5_bar.uff"


def drawn(*shape):
    parts = np.random.default_rng(1).standard_normal((2, *shape))
    return parts[0] + 1j * parts[1]


def of_impacts(impacts, functions):
    nodes = [impact.node for impact in impacts]
    return [function for function in functions if function.reference_node in nodes]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Write a whole test, with a third of the impacts to be quick, and twice the same hammer."""
    folder = tmp_path_factory.mktemp("operation") / "test"
    write_operating_test(folder, 1, plan=OperationPlan(time_record=True))
    sheet = folder / "hammer/positions.xlsx"
    sensors, impacts = read_placed(sheet, PlacedSensor), read_placed(sheet, PlacedImpact)
    kept = impacts[::3]
    write_positions(sheet, sensors, kept)
    for name in ("frf.uff", "coherence.uff"):
        functions(f"hammer/{name}", partial(of_impacts, kept))(folder)
    shutil.copytree(folder / "hammer", folder / "hammer_with_hoses")
    return folder


@pytest.fixture
def whole_folder(written, tmp_path):
    folder = shutil.copytree(written, tmp_path / "test")
    edited("operation.toml", "sensor_table", f"{WITH_HOSES}\nsensor_table")(folder)
    return folder


@pytest.fixture
def test_folder(written, tmp_path):
    """Without the record and the second hammer test, which take their time."""
    folder = shutil.copytree(written, tmp_path / "test")
    path = folder / "operation.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(RECORD, "", text), encoding="utf-8")
    return folder


def test_spectra_read_back_with_holders_and_microphones(tmp_path):
    acceleration, holder, sound = drawn(8, 9), drawn(8, 6), drawn(8, 1)
    path = tmp_path / "sweep.uff"
    operating_test.write_sweep(path, NODES, LINES, (acceleration, holder, sound), notes=("a", "b"))
    sweep = operating_test.read_sweep(path, NODES)
    for spectrum, values in zip(sweep, (acceleration, holder, sound), strict=True):
        np.testing.assert_array_equal(spectrum.frequency, LINES)
        np.testing.assert_array_equal(spectrum.values, values)
    assert sweep[0].channels[:4] == ("A1 x", "A1 y", "A1 z", "A2 x")
    assert sweep[1].channels[3] == "mount 2 x"
    assert sweep[2].channels == ("driver",)
    assert [spectrum.unit for spectrum in sweep] == ["m/s^2", "m/s^2", "Pa"]
    # who does not ask for them does not get them
    assert operating_test.read_sweep(path, operating_test.SweepNodes(SENSORS, 1))[1:] == (
        None,
        None,
    )
    # a channel that was recorded against its axis
    turned = {"response_direction": "-y", "values": lambda f: -f.values}
    function(path.name, (11, "+y"), **turned)(tmp_path)
    np.testing.assert_array_equal(operating_test.read_sweep(path, NODES)[0].values, acceleration)


def test_a_whole_test_reads_back(whole_folder):
    test = operating_test.read_operating_test(whole_folder)
    assert [sweep.name for sweep in test.sweeps][-1] == "soft 7.5 bar over time"
    assert test.sweeps[0].frequency[[0, -1]].tolist() == [17, 150]
    assert test.sweeps[0].acceleration.channels == test.hammer.frf.outputs
    assert test.hammer_with_hoses is not None
    assert [hose.name for hose in test.hoses] == ["suction hose", "discharge hose"]
    assert np.linalg.norm(test.hoses[0].direction) == pytest.approx(1)
    assert all(path.is_file() for path in test.input_files)
    assert len(set(test.input_files)) == len(test.input_files) == 2 + 2 * 4 + 5
    # stated per part: a share of the amplitude, and a floor that grows below its corner
    sweep = test.sweeps[2]
    size = np.abs(sweep.acceleration.values)
    stated = (3e-3 * size) ** 2 + (4e-4**2 * (1 + (20 / sweep.frequency) ** 2))[:, None]
    np.testing.assert_allclose(sweep.deviation, np.sqrt(stated / 2), rtol=1e-9)


def test_holders_and_microphones_of_the_folder(test_folder):
    file = load_toml(test_folder / "operation.toml", operating_test.OperatingTestFile)
    sensors = read_placed(test_folder / file.sensor_table, PlacedSensor)
    nodes = operating_test.SweepNodes(sensors, 1, (("mount 1", 301),), (("driver", 901),))
    values, holder, sound = drawn(8, 18), drawn(8, 3), drawn(8, 1)
    operating_test.write_sweep(test_folder / SOFT, nodes, LINES, (values, holder, sound))
    time = np.arange(8000) / 2000.0
    turning = 2 * np.pi * (40 * time + time**2 - 0.25)
    channels = np.cos(turning)[:, None] * np.append(np.arange(1.0, 19.0), 3 * [0.5])
    parts = (channels[:, :18], channels[:, 18:], np.sin(turning)[:, None])
    pulses = np.clip(0.5 + 3 * np.sin(turning), 0, 1)
    operating_test.write_sweep(test_folder / "sweeps/record.uff", nodes, time, parts, pulses=pulses)
    spectra = file.sweeps[2]
    record = operating_test.SweepSection(
        name="over time",
        hoses="soft",
        pressure_bar=7.5,
        record="sweeps/record.uff",
        sample_rate_hz=2000.0,
    )
    changed = {
        "sweeps": (spectra, record),
        "holders": (operating_test.HolderSection(name="mount 1", node=301),),
        "microphones": (operating_test.MicrophoneSection(name="driver", node=901),),
    }
    dump_toml(test_folder / "operation.toml", file.model_copy(update=changed))
    spectra, tracked = operating_test.read_operating_test(test_folder).sweeps
    np.testing.assert_array_equal(spectra.holder.values, holder)
    assert spectra.sound.channels == ("driver",)
    # the pulse rises where the sine does: the cosine has phase 0, the sine −90°
    assert tracked.holder.channels == ("mount 1 x", "mount 1 y", "mount 1 z")
    np.testing.assert_allclose(tracked.holder.values, 0.5, atol=0.005)
    np.testing.assert_allclose(tracked.sound.values, -1j * np.ones((7, 1)), atol=0.01)
    assert np.all(tracked.deviation > 0)


TACHO = (1, "scalar")
OVER_TIME = "sweeps/soft_7.5_bar_over_time.uff"


def without_tacho(functions):
    return [f for f in functions if f.response_node != 1]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (functions(OVER_TIME, without_tacho), "soft_7.5_bar_over_time.uff ... no tacho"),
        (
            lambda folder: shutil.copy(folder / SOFT, folder / OVER_TIME),
            "over_time.uff ... sample_rate_hz",
        ),
        (
            function(OVER_TIME, TACHO, values=lambda f: 0 * f.values),
            "soft_7.5_bar_over_time.uff ... tacho carries no pulses",
        ),
        (
            edited("operation.toml", "sample_rate_hz = 2000.0", "sample_rate_hz = 1000.0"),
            "over_time.uff ... 0.0005 s apart",
        ),
        (edited("operation.toml", "sample_rate_hz = 2000.0", ""), "operation.toml ... 'record' an"),
    ],
)
def test_a_record_that_does_not_fit_is_named(whole_folder, fault, words):
    fault(whole_folder)
    refused(operating_test.read_operating_test, whole_folder, words)


A1_X = (101, "+x")
BROKEN = [
    (
        functions(SOFT, without_tacho),
        "sweep 'soft 7.5 bar' ... soft_7.5_bar.uff ... no tacho ... tacho_node",
    ),
    (
        function(SOFT, TACHO, values=lambda f: f.values / 2),
        "the tacho reads 510 rpm at 17 Hz ... repair the tacho",
    ),
    (function(SOFT, TACHO, values=lambda f: 1j * f.values), "the tacho (node 1) is complex"),
    *edits(
        """
A3,103,-95.0, | A3,103,-93.0, | A3 stands 2 mm and 0° ... the hammer test ... strike
,15.0637233 | ,25.0637233 | A1 stands 0 mm and ... the hammer test
,15.0637233 | ,-164.9362767 | A1 stands 0 mm and 180°
A3,103 | B3,103 | A1, A2, B3 ... not those of the hammer test
A3,103 | A3,193 | (node 193 +x) is not in it
""",
        "sensors.csv",
    ),
    (function(SOFT, A1_X, values=lambda f: 0 * f.values), "'A1 x' (node 101 +x) is dead ... repai"),
    (function(SOFT, A1_X, function_type=4), "'A1 x' ... type 4 ... 0 or 12 or 27"),
    (function(SOFT, A1_X, id_lines=("order 2",)), "of order 2 ... an unbalance is of order 1"),
    (content("hammer/compressor_test.toml", None), "compressor_test.toml cannot be read"),
    *edits(
        """
\\nspectra = "sweeps/soft_7.5_bar.uff" |  | 'soft 7.5 bar' ... 'spectra' ... 'record'
"standard 13.5 bar" | "standard 7.5 bar" | two [[sweeps]] are named
direction = [-0.3 | direction = [0.0, 0.0, 0.0] # [ | suction hose ... no length
\\n[deviations] | \\n[[holders]]\\nname = "m"\\nnode = 1\\n\\n[deviations] | node 1 stands
""",
        "operation.toml",
    ),
    (
        edited(
            "operation.toml",
            "[deviations]",
            '[[microphones]]\nname = "m"\nnode = 7\n\n[[holders]]\nname = "h"\nnode = 7\n\n'
            "[deviations]",
        ),
        "node 7 stands for two of tacho, holders",
    ),
]


@pytest.mark.parametrize(("fault", "words"), BROKEN)
def test_what_is_broken_is_named(test_folder, fault, words):
    fault(test_folder)
    refused(operating_test.read_operating_test, test_folder, words)


def test_sensors_and_impacts_that_differ_between_both_hammer_tests_are_named(whole_folder):
    sheet = whole_folder / "hammer_with_hoses/positions.xlsx"
    sensors, impacts = read_placed(sheet, PlacedSensor), read_placed(sheet, PlacedImpact)
    moved = replace(sensors[1], position=(0.08, -0.046, -0.04))
    write_positions(sheet, (sensors[0], moved, *sensors[2:]), impacts)
    refused(
        operating_test.read_operating_test,
        whole_folder,
        "sensor A2 stands 1 mm",
        "the hammer test with hoses",
    )
    other = replace(impacts[4], position=(0.095, -0.03, 0.027))
    write_positions(sheet, sensors, (*impacts[:4], other, *impacts[5:]))
    refused(
        operating_test.read_operating_test,
        whole_folder,
        "hammer_with_hoses",
        "I13 has another place",
        "strike the same points",
    )
