"""Position sheets of pyFBS are read as deboom's own, in the same places and directions."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from deboom.bench.compressor_writer import write_compressor_test
from deboom.errors import InputError
from deboom.files.check import check_folder
from deboom.files.inertance_test import read_inertance_test, read_placed
from deboom.files.pyfbs_sheets import read_virtual_points
from deboom.files.rows import PlacedImpact, PlacedSensor
from deboom.files.tables import read_table

PUBLISHED = Path(__file__).parents[1] / "data" / "pyfbs-published"
PLACE, TURN, ALONG = (
    [f"{stem}_{n}" for n in (1, 2, 3)] for stem in ("Position", "Orientation", "Direction")
)


def published(name):
    return pd.read_csv(PUBLISHED / name)


def published_sheets():
    """Sheets of the published structure AB, with pyFBS's columns."""
    sensors = published("sensors_AB.csv")
    sensors.columns = ["Name", "Grouping", *PLACE, *TURN]
    channels = published("channels_from_orientation.csv").drop(columns="rz_deg")
    channels.columns = ["Name", *PLACE, *ALONG]
    point = published("virtual_point_1.csv")
    point.columns = ["Description", *PLACE, *ALONG]
    point.insert(0, "Name", "VP1")
    point.insert(2, "Grouping", 1)
    blank = {"Description": None, "Quantity": "Acceleration"}
    return {
        "Sensors_AB": sensors.assign(**blank),
        "Channels_AB": channels.assign(**blank, Grouping=100),
        "VP_Channels": point,
    }


def workbook(path, sheets):
    with pd.ExcelWriter(path) as book:
        for name, table in sheets.items():
            table.to_excel(book, sheet_name=name, index=False)
    return path


def test_published_sensors_lie_where_their_published_channels_do(tmp_path):
    sheets = published_sheets()
    sensors = read_placed(workbook(tmp_path / "AB.xlsx", sheets), PlacedSensor)
    assert [row.sensor for row in sensors] == [f"S{n}" for n in range(1, 10)]
    assert [row.node for row in sensors] == list(range(1, 10))
    table = sheets["Sensors_AB"]
    np.testing.assert_allclose([row.position for row in sensors], table[PLACE] / 1000)
    # Ry(-90°) turns x into z, and Rz leaves it there
    upright = next(row for row in sensors if row.sensor == "S4").orientation
    np.testing.assert_allclose(upright[:, 0], [0.0, 0.0, 1.0], atol=1e-7)
    for channel, along in zip(
        sheets["Channels_AB"]["Name"], sheets["Channels_AB"][ALONG].to_numpy(), strict=True
    ):
        row = next(row for row in sensors if row.sensor == channel[:-1])
        np.testing.assert_allclose(row.orientation[:, "xyz".index(channel[-1])], along, atol=2e-6)


def test_channels_alone_make_the_same_sensors(tmp_path):
    sheets = published_sheets()
    both = read_placed(workbook(tmp_path / "both.xlsx", sheets), PlacedSensor)[:2]
    alone = read_placed(
        workbook(tmp_path / "channels.xlsx", {"Channels_AB": sheets["Channels_AB"]}), PlacedSensor
    )
    assert [row.sensor for row in alone] == ["S1", "S2"]
    for left, other in zip(alone, both, strict=True):
        np.testing.assert_allclose(left.position, other.position, atol=1e-8)
        np.testing.assert_allclose(left.orientation, other.orientation, atol=2e-6)


def test_virtual_points_have_the_position_of_their_rows(tmp_path):
    path = workbook(tmp_path / "AB.xlsx", published_sheets())
    assert read_virtual_points(path) == {"1": pytest.approx((0.038895369, 0.34810701, 0.007))}


@pytest.fixture(scope="module")
def delivered(tmp_path_factory):
    return write_compressor_test(tmp_path_factory.mktemp("compressor") / "hammer", seed=3)


def as_pyfbs(folder):
    """Replace the position sheets of a hammer test by pyFBS's workbook."""
    toml = folder / "compressor_test.toml"
    text = toml.read_text(encoding="utf-8")
    tables = {}
    for key, kind in (("sensor_table", PlacedSensor), ("impact_table", PlacedImpact)):
        (line,) = (line for line in text.splitlines() if line.startswith(f"{key} = "))
        tables[kind] = read_table(folder / line.split('"')[1], kind)
        text = text.replace(line, f'{key} = "pyfbs.xlsx"')
    sensors = pd.DataFrame(
        [
            (row.sensor, row.node, *(1000 * np.array(row.position)), *np.degrees(row.angles))
            for row in tables[PlacedSensor]
        ],
        columns=["Name", "NodeNumber", *PLACE, *TURN],
    )
    impacts = pd.DataFrame(
        [
            (row.impact, row.node, *(1000 * np.array(row.position)), *row.direction)
            for row in tables[PlacedImpact]
        ],
        columns=["Name", "NodeNumber", *PLACE, *ALONG],
    )
    toml.write_text(text, encoding="utf-8")
    return workbook(folder / "pyfbs.xlsx", {"Sensors": sensors, "Impacts": impacts})


def test_a_hammer_test_with_sheets_of_pyfbs_has_the_same_numbers(delivered, tmp_path):
    folder = Path(shutil.copytree(delivered, tmp_path / "hammer"))
    as_pyfbs(folder)
    before, after = read_inertance_test(delivered), read_inertance_test(folder)
    assert np.array_equal(after.frf.values, before.frf.values)
    assert after.frf.outputs == before.frf.outputs
    for left, other in zip(after.sensors, before.sensors, strict=True):
        np.testing.assert_allclose(left.position, other.position, atol=1e-12)
        np.testing.assert_allclose(left.orientation, other.orientation, atol=1e-12)
    for left, other in zip(after.impacts, before.impacts, strict=True):
        np.testing.assert_allclose(left.position, other.position, atol=1e-12)
        np.testing.assert_allclose(left.direction, other.direction, atol=1e-12)
    assert check_folder(folder)[0] == ()


def changed(sheet, column, row, value):
    def change(sheets):
        sheets[sheet] = sheets[sheet].astype(object)
        sheets[sheet].loc[row, column] = value

    return change


def without(sheet, column):
    return lambda sheets: sheets.update({sheet: sheets[sheet].drop(columns=column)})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (without("Sensors_AB", "Orientation_2"), "sheet 'Sensors_AB': column 'Orientation_2' is"),
        (
            changed("Sensors_AB", "Position_1", 3, "?"),
            "line 5, column 'x': '?' is no finite number",
        ),
        (changed("Sensors_AB", "Name", 3, "S1"), "line 5: sensor 'S1' already stands in line 2"),
        (
            changed("Sensors_AB", "Orientation_3", 0, 90.0),
            "channel 'S1x' lies 0.00 mm and 44.8°",
        ),
        (changed("Sensors_AB", "Position_2", 1, 278.0), "channel 'S2y' lies 0.84 mm and 0.0°"),
        (
            lambda sheets: sheets.update({"Sensors_B": sheets["Sensors_AB"]}),
            "has the sheets Sensors_AB, Sensors_B: copy the one",
        ),
        (
            lambda sheets: (
                sheets.pop("Sensors_AB"),
                changed("Channels_AB", "Direction_1", 0, -0.7)(sheets),
            ),
            "line 2: the directions of S1x, S1y, S1z are no right-handed set",
        ),
        (
            lambda sheets: (
                sheets.pop("Sensors_AB"),
                changed("Channels_AB", "Name", 1, "mic")(sheets),
            ),
            "line 2: the channels S1x, mic, S1z are no triaxial sensor",
        ),
    ],
)
def test_what_does_not_fit_is_named(tmp_path, change, words):
    sheets = published_sheets()
    change(sheets)
    path = workbook(tmp_path / "AB.xlsx", sheets)
    with pytest.raises(InputError) as caught:
        read_placed(path, PlacedSensor)
    assert words in str(caught.value), caught.value
    assert str(path.parent) in str(caught.value)


def test_a_virtual_point_in_two_places_and_a_missing_sheet_are_named(tmp_path):
    sheets = published_sheets()
    changed("VP_Channels", "Position_3", 2, 9.0)(sheets)
    path = workbook(tmp_path / "AB.xlsx", sheets)
    with pytest.raises(InputError, match="line 4: virtual point 1 has two positions"):
        read_virtual_points(path)
    with pytest.raises(InputError, match="has no sheet 'impacts', only"):
        read_placed(path, PlacedImpact)
