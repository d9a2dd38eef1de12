"""The folder of a roving-hammer test: what is written reads back, what is bad is named."""

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from broken_files import all_of, edits, function, refused
from broken_files import functions as rewritten

from deboom.errors import DataWarning, InputError
from deboom.files import rows, tables
from deboom.files.inertance_test import (
    INERTANCE_TEST_FILE,
    DrawingSection,
    DrawnMountSection,
    InertanceTestFile,
    ToleranceSection,
    read_inertance_test,
)
from deboom.files.schema import dump_toml
from deboom.files.uff import UffFunction, write_uff
from deboom.physics.rigid_body import rotation_matrix

LINES = np.array([10.0, 10.5, 11.0])
SENSORS = (
    rows.PlacedSensor("A1", 11, (0.08, 0.04, 0.045), (0.1, -0.2, 0.3)),
    rows.PlacedSensor("A2", 12, (-0.09, 0.04, -0.04), (0.0, 0.0, 0.0)),
    rows.PlacedSensor("A3", 13, (0.0, 0.06, -0.02), (0.0, 0.5, 0.0)),
)
IMPACTS = (
    rows.PlacedImpact("I1", 21, (-0.11, 0.04, 0.02), (1.0, 0.0, 0.0)),
    rows.PlacedImpact("I2", 21, (-0.11, 0.04, 0.02), (0.0, -1.0, 0.0)),
    rows.PlacedImpact("I3", 22, (0.09, 0.0, 0.02), (-1.0, 0.0, 0.0)),
    rows.PlacedImpact("I4", 23, (0.0, 0.06, -0.03), (0.0, 1.0, 0.0)),
    rows.PlacedImpact("I5", 24, (0.0, -0.02, 0.06), (0.0, 0.0, -1.0)),
    rows.PlacedImpact("I6", 25, (0.07, 0.02, -0.06), (0.6, 0.0, 0.8)),
)
CHANNELS = [(sensor, axis) for sensor in SENSORS for axis in "xyz"]
FILE = InertanceTestFile(
    format=1,
    title="six blows",
    sensor_table="positions.xlsx",
    impact_table="positions.xlsx",
    frf="frf.uff",
    coherence="coherence.uff",
    hits_per_impact=4,
    weighed_mass_kg=7.1,
    weighed_mass_deviation_kg=0.007,
    tolerances=ToleranceSection(
        **dict(zip(ToleranceSection.model_fields, (0.02, 0.001, 1.5, 0.01, 0.002, 3), strict=True))
    ),
    drawing=DrawingSection(
        mass_kg=6.8,
        centre_of_gravity_m=(0.0, 0.0, 0.001),
        inertia_kg_m2=((0.015, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.029)),
    ),
    mounts=(
        DrawnMountSection(
            name="mount 1",
            position_m=(-0.14, 0.0, 0.01),
            rotation_deg=(0.0, 0.0, 180.0),
            stiffness_n_per_m=(23000.0, 13000.0, 13000.0),
        ),
    ),
)


def measured():
    """FRFs and coherences, shape (3, 9, 6)."""
    generator = np.random.default_rng(1)
    real, imaginary, coherence = generator.uniform(0.1, 0.9, (3, 3, 9, 6))
    return real + 1j * imaginary, coherence


def functions(kind, values, lines=LINES):
    unit = {4: ("acceleration", "m/s^2", "force", "N"), 6: ("general", "1", "none", "")}[kind]
    return [
        UffFunction(
            lines,
            values[:, row, column],
            kind,
            sensor.node,
            f"+{axis}",
            impact.node,
            rows.uff_direction(impact.direction),
            *unit,
        )
        for row, (sensor, axis) in enumerate(CHANNELS)
        for column, impact in enumerate(IMPACTS)
    ]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inertance") / "test"
    folder.mkdir()
    frf, coherence = measured()
    write_uff(folder / "frf.uff", functions(4, frf), binary=True)
    write_uff(folder / "coherence.uff", functions(6, coherence), binary=True)
    rows.write_positions(folder / "positions.xlsx", SENSORS, IMPACTS)
    dump_toml(folder / INERTANCE_TEST_FILE, FILE)
    return folder


@pytest.fixture
def folder(written, tmp_path):
    return shutil.copytree(written, tmp_path / "copy")


def restate(folder, **changes):
    dump_toml(folder / INERTANCE_TEST_FILE, FILE.model_copy(update=changes))


def test_what_is_written_reads_back(written):
    frf, coherence = measured()
    test = read_inertance_test(written)
    assert test.name == "six blows"
    assert test.frf.outputs == tuple(f"{sensor.sensor} {axis}" for sensor, axis in CHANNELS)
    assert test.frf.inputs == tuple(impact.impact for impact in IMPACTS)
    assert test.frf.unit == "(m/s^2)/N"
    np.testing.assert_array_equal(test.frf.frequency, LINES)
    np.testing.assert_array_equal(test.frf.values, frf)
    np.testing.assert_array_equal(test.coherence, coherence)
    assert test.n_averages == 4
    for sensor, row in zip(test.sensors, SENSORS, strict=True):
        np.testing.assert_allclose(sensor.position, row.position, rtol=0, atol=1e-15)
        np.testing.assert_allclose(sensor.orientation, rotation_matrix(row.angles), atol=1e-12)
    for impact, row in zip(test.impacts, IMPACTS, strict=True):
        np.testing.assert_allclose(impact.position, row.position, rtol=0, atol=1e-15)
        np.testing.assert_allclose(impact.direction, row.direction, rtol=0, atol=1e-15)
    stated = test.tolerances
    assert (stated.sensor_gain, stated.hammer_gain) == (0.02, 0.01)
    assert (stated.sensor_position, stated.impact_position) == (0.001, 0.002)
    assert stated.impact_angle == pytest.approx(np.deg2rad(3.0))
    assert stated.sensor_angle == pytest.approx(np.deg2rad(1.5))
    assert (test.weighed_mass, test.weighed_mass_deviation) == (7.1, 0.007)
    assert test.drawing.mass == 6.8
    np.testing.assert_array_equal(test.drawing.centre, [0, 0, 0.001])
    (mount,) = test.drawing.mounts
    np.testing.assert_allclose(mount.rotation, [0, 0, np.pi])
    np.testing.assert_array_equal(mount.stiffness, [23000, 13000, 13000])
    read = [path.name for path in test.input_files]
    assert read == [INERTANCE_TEST_FILE, "positions.xlsx", "frf.uff", "coherence.uff"]


def test_csv_sheets_one_uff_file_and_nothing_known_besides(folder):
    """In any order, with a channel against its axis and functions that nobody asked for."""
    frf, coherence = measured()
    tables.write_table(folder / "sensors.csv", rows.PlacedSensor, SENSORS)
    tables.write_table(folder / "impacts.csv", rows.PlacedImpact, IMPACTS)
    everything = functions(4, frf) + functions(6, coherence)
    flipped = everything[0]
    everything[0] = replace(flipped, values=-flipped.values, response_direction="-x")
    power = replace(flipped, values=np.abs(flipped.values), function_type=2, response_node=999)
    write_uff(folder / "all.uff", [power, *reversed(everything)], binary=True)
    restate(
        folder,
        sensor_table="sensors.csv",
        impact_table="impacts.csv",
        frf="all.uff",
        coherence="all.uff",
        weighed_mass_kg=None,
        weighed_mass_deviation_kg=None,
        drawing=None,
        mounts=(),
    )
    test = read_inertance_test(folder)
    np.testing.assert_array_equal(test.frf.values, frf)
    np.testing.assert_array_equal(test.coherence, coherence)
    assert (test.weighed_mass, test.weighed_mass_deviation, test.drawing) == (None, 0.0, None)


def test_the_position_sheet_carries_no_time(written, tmp_path):
    rows.write_positions(tmp_path / "again.xlsx", SENSORS, IMPACTS)
    assert (tmp_path / "again.xlsx").read_bytes() == (written / "positions.xlsx").read_bytes()


def edit_sheet(folder, sheet, change):
    path = folder / "positions.xlsx"
    tables = pd.read_excel(path, sheet_name=None)
    tables[sheet] = change(tables[sheet])
    with pd.ExcelWriter(path) as writer:
        for name, table in tables.items():
            table.to_excel(writer, sheet_name=name, index=False)


def scaled(factor, unit):
    names = {f"{a} [mm]": f"{a} [{unit}]" for a in "xyz"}
    return lambda t: t.assign(**{name: factor * t[name] for name in names}).rename(columns=names)


@pytest.mark.parametrize(
    ("sheet", "change", "words"),
    [
        ("sensors", scaled(1, "m"), "its position is up to 80 m ... is the unit right?"),
        ("impacts", scaled(1e-3, "mm"), "the impacts lie within ... mm and m"),
        ("sensors", lambda t: t.iloc[:2], "2 triaxial accelerometers ... at least three"),
        ("impacts", lambda t: t.iloc[:5], "5 impacts ... at least six"),
        ("impacts", lambda t: t.assign(impact="I1"), "sheet 'impacts' line 3 ... already"),
        ("sensors", lambda t: t.assign(node=11), "node 11 already stands in line 2"),
        ("impacts", lambda t: t.replace({"dx": {0.6: 0.9}}), "positions.xlsx ... I6 ... unit ve"),
        ("impacts", lambda t: t.assign(dy=-t["dy"]), "reference node 21 -y is not ... they have i"),
    ],
)
def test_bad_position_sheets(folder, sheet, change, words):
    edit_sheet(folder, sheet, change)
    refused(read_inertance_test, folder, words)


def shifted(by):
    return lambda functions: [replace(f, abscissa=f.abscissa + by) for f in functions]


FRF, COHERENCE = "frf.uff", "coherence.uff"
BAD_FUNCTIONS = [
    (
        rewritten(COHERENCE, lambda functions: functions[:-1]),
        "function 'A3 z' per I6 ... is not in it",
    ),
    (function(FRF, 0, response_node=99), "node 99 +x is not in the tables; add it there, or"),
    (function(FRF, 0, reference_node=98), "reference node 98 +x is not in the tables"),
    (function(FRF, 0, response_direction="scalar"), "node 11 scalar is not in the tables; they ha"),
    (function(FRF, 0, reference_direction="scalar"), "node 21 scalar is not in the tables"),
    (function(FRF, 0, ordinate="velocity", ordinate_unit="m/s"), "is not in it: export it ... the"),
    (function(FRF, 0, values=np.ones(3)), "'A1 x' per I1 is real ... phase is needed"),
    (function(COHERENCE, 0, values=np.full(3, 1.1)), "a coherence lies between 0 and 1: export it"),
    (
        rewritten(COHERENCE, lambda functions: [replace(f, function_type=0) for f in functions]),
        "holds no coherence ... type 6",
    ),
    (rewritten(COHERENCE, shifted(0.5)), "coherence.uff has other lines than"),
]


def test_a_line_at_0_hz_is_left_out_and_said(folder):
    """Every analyser exports one; the lines above it are as without it."""
    all_of(rewritten(FRF, shifted(-10.0)), rewritten(COHERENCE, shifted(-10.0)))(folder)
    with pytest.warns(DataWarning) as warned:
        test = read_inertance_test(folder)
    frf, coherence = measured()
    np.testing.assert_array_equal(test.frf.frequency, LINES[1:] - 10.0)
    np.testing.assert_array_equal(test.frf.values, frf[1:])
    np.testing.assert_array_equal(test.coherence, coherence[1:])
    sentences = [str(each.message) for each in warned]
    for file, sentence in zip((FRF, COHERENCE), sentences, strict=True):
        assert sentence.startswith(str(folder / file))
        assert "the line at 0 Hz is left out" in sentence


@pytest.mark.parametrize(("fault", "words"), BAD_FUNCTIONS)
def test_bad_functions(folder, fault, words):
    fault(folder)
    refused(read_inertance_test, folder, words)


@pytest.mark.parametrize(
    ("fault", "words"),
    edits(
        """
coherence = "coherence.uff"\\n |  | 'frf' needs the key 'coherence' ... noise
hits_per_impact = 4\\n |  | needs the key 'hits_per_impact'
weighed_mass_deviation_kg = 0.007\\n |  | 'weighed_mass_deviation_kg' ... scales
weighed_mass_kg = 7.1\\n |  | needs the key 'weighed_mass_kg'
sensor_gain = 0.02 | sensor_gain = 0.0 | sensor_gain ... greater than 0
hits_per_impact = 4\\n | hits_per_impact = 4\\nhits = "hits"\\n | 'band_hz'
frf = "frf.uff"\\n |  | 'coherence' needs the key 'frf'
frf = "frf.uff"\\ncoherence = "coherence.uff"\\n |  | neither key 'frf' nor 'hits'
""",
        "compressor_test.toml",
    ),
)
def test_bad_facts(folder, fault, words):
    fault(folder)
    refused(read_inertance_test, folder, words)


def test_bad_facts_that_no_line_alone_makes(folder):
    with pytest.raises(InputError, match=r"two \[\[mounts\]\] are named 'mount 1'"):
        restate(folder, mounts=FILE.mounts * 2)
    with pytest.raises(InputError, match="'drawing' needs the key 'mounts'"):
        restate(folder, mounts=())
    with pytest.raises(InputError, match="'band_hz'"):
        restate(folder, hits="hits", band_hz=(150.0, 10.0))
    with pytest.raises(InputError, match="key 'hits' is missing"):
        read_inertance_test(folder, from_hits=True)
