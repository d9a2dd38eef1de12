"""A folder of an impact test: what is written reads back, and what is wrong is named."""

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from broken_files import edits, function, functions, refused

from deboom.errors import InputError
from deboom.files.hammer_test import HammerTestFile, read_hammer_test, write_hammer_test
from deboom.files.rows import HammerChannel, HammerPoint, SensorRow
from deboom.files.uff import read_uff
from deboom.files.units import parse_unit
from deboom.measurement.impact_test import HammerOptions, hammer_frfs

RATE, N_SAMPLE, PRETRIGGER = 5120.0, 640, 0.0125
METRES = parse_unit("m/s^2")
FACTS = HammerTestFile(
    format=1,
    title="a bracket",
    sample_rate_hz=RATE,
    pretrigger_s=PRETRIGGER,
    force_range_n=2000.0,
    impact_table="impacts.csv",
    channel_table="channels.csv",
    sensor_table="sensors.csv",
)
POINTS = (
    HammerPoint("EnM x", 7, "hits/EnM_x.uff", (0.1, 0.2, 0.3), (1.0, 0.0, 0.0)),
    HammerPoint("EnM z", 7, "hits/EnM_z.uff", (0.1, 0.2, 0.3), (0.0, 0.0, -1.0)),
    HammerPoint("I3", 8, "hits/I3.uff", (0.1, -0.2, 0.3), (0.6, 0.8, 0.0)),
)
CHANNELS = (
    HammerChannel("A1 x", "acceleration", 1, "+x", METRES, 500.0),
    HammerChannel("A1 y", "acceleration", 1, "-y", METRES),
    HammerChannel("A1 z", "acceleration", 1, "+z", METRES),
    HammerChannel("ear", "pressure", 901, "scalar", parse_unit("Pa"), 20.0),
)
SENSORS = (
    SensorRow("A1", "accelerometer", "PCB 356A15", "EnM", "", (0.0, 0.1, 0.0), (0.0, 0.1, 0.2)),
)


def blocks(seed=1):
    generator = np.random.default_rng(seed)
    time = np.arange(N_SAMPLE) / RATE - PRETRIGGER
    push = np.where((time > 0) & (time < 0.004), np.sin(np.pi * time / 0.004) ** 2, 0)
    return {
        point.impact: (
            push * generator.uniform(50, 90, size=(3, 1)),
            generator.normal(size=(3, N_SAMPLE, 4)),
        )
        for point in POINTS
    }


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("written") / "test"
    write_hammer_test(folder, FACTS, POINTS, CHANNELS, blocks(), SENSORS)
    return folder


@pytest.fixture
def folder(written, tmp_path):
    return Path(shutil.copytree(written, tmp_path / "test"))


@pytest.mark.parametrize("binary", [True, False])
def test_what_is_written_reads_back(tmp_path, binary):
    write_hammer_test(tmp_path, FACTS, POINTS, CHANNELS, blocks(), SENSORS, binary=binary)
    test = read_hammer_test(tmp_path)
    assert test.title == "a bracket"
    assert [impact.name for impact in test.impacts] == ["EnM x", "EnM z", "I3"]
    np.testing.assert_allclose(test.impacts[2].direction, [0.6, 0.8, 0])
    np.testing.assert_allclose(test.sensors[0].position, [0, 0.1, 0])
    for measurement in test.measurements:
        force, response = blocks()[measurement.impact]
        np.testing.assert_allclose(measurement.force, force, rtol=1e-10)
        np.testing.assert_allclose(measurement.response, response, rtol=1e-10)
        # the exact rate, not the one of six digits in UFF
        assert measurement.rate == RATE
        assert measurement.pretrigger == PRETRIGGER
        assert measurement.force_range == 2000
        assert measurement.ranges == (500, math.inf, math.inf, 20)
        assert measurement.units == ("m/s^2", "m/s^2", "m/s^2", "Pa")
    estimate = hammer_frfs(test, HammerOptions(band=(20, 400)))
    assert estimate.values.shape == (48, 4, 3)
    assert estimate.select(outputs=["ear"]).frf.unit == "Pa/N"


def test_a_channel_against_its_axis_is_turned(folder):
    """In the file, ``A1 y`` is recorded along -y."""
    stored = [f for f in read_uff(folder / "hits" / "I3.uff") if f.response_direction == "-y"]
    np.testing.assert_allclose(stored[0].values, -blocks()["I3"][1][0, :, 1])


@pytest.mark.parametrize(
    ("fault", "words"),
    edits(
        """
hammer_test.toml | 5120.0 | 5121.0 | sampled at 5119.99 Hz, hammer_test.toml says 5121
hammer_test.toml | 0.0125 | 0.02 | hammer_test.toml says 0.02 s before the trigger
impacts.csv | hits/I3.uff | ../I3.uff | not inside the folder
impacts.csv | hits/EnM_z.uff | hits/EnM_x.uff | already stands in line 2
impacts.csv | ,1.0,0.0,0.0 | ,0.0,1.0,0.0 | node 7 +x is not in the tables; they have it along +y, s
impacts.csv | ,0.6,0.8,0.0 | ,0.6,0.6,0.0 | I3: its direction has length
channels.csv | Pa,20.0 | Pa,-2 | a range is positive
channels.csv | Pa,20.0 | N,20.0 | no unit of it: use Pa
channels.csv | Pa,20.0 | kPa,20.0 | the channel table says 'kPa': correct
channels.csv | ear,pressure,901 | ear,pressure,902 | node 901 scalar is not in the tables; add it th
sensors.csv | A1, | A2, | sensors ['A2'] have a position and no channel
"""
    ),
)
def test_what_is_wrong_is_named(folder, fault, words):
    fault(folder)
    refused(read_hammer_test, folder, words)


I3 = "hits/I3.uff"


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (functions(I3, lambda f: f[:-1]), "hit 3: pressure 'ear' (node 901 scalar) is not in it:"),
        (functions(I3, lambda f: f[1:]), "hit 1: force 'I3' (node 8 scalar) is not in it: export"),
        (functions(I3, lambda f: f[5:]), "it holds hits [2, 3]: number them from 1 without a gap"),
        (functions(I3, lambda f: [*f, f[0]]), "hit 1: force 'I3' (node 8 scalar) is in it 2 times"),
        (function(I3, 0, id_lines=("run 1",)), "let it name the hit, such as 'hit 3'"),
        (
            function(I3, 0, abscissa=lambda f: f.abscissa[:-9], values=lambda f: f.values[:-9]),
            "differ: 631 and 640 lines; export all on the same",
        ),
        (function(I3, 0, function_type=0, abscissa_quantity="time"), "export real time blocks, ty"),
    ],
)
def test_blocks_that_do_not_fit_are_named(folder, fault, words):
    fault(folder)
    refused(read_hammer_test, folder, "I3.uff: impact 'I3': ", words)


def test_a_clock_that_starts_with_the_block(folder):
    def shift(functions):
        return [replace(f, abscissa=f.abscissa - f.abscissa[0]) for f in functions]

    functions(I3, shift)(folder)
    assert read_hammer_test(folder).measurements[2].pretrigger == PRETRIGGER


def test_a_folder_that_a_file_keeps_from_being_made(tmp_path):
    (tmp_path / "hits").write_text("a file in the way", encoding="utf-8")
    with pytest.raises(InputError, match="cannot be made"):
        write_hammer_test(tmp_path, FACTS, POINTS, CHANNELS, blocks(), SENSORS)


def test_without_sensors_and_ranges(tmp_path):
    facts = FACTS.model_copy(update={"sensor_table": None, "force_range_n": None})
    hits = {name: (force, response[:, :, :1]) for name, (force, response) in blocks().items()}
    write_hammer_test(tmp_path, facts, POINTS, CHANNELS[:1], hits)
    test = read_hammer_test(tmp_path)
    assert test.sensors == ()
    assert math.isinf(test.measurements[0].force_range)
    assert not (tmp_path / "sensors.csv").exists()
