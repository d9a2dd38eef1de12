"""Tables of cells and strict TOML: what the campaign's files are made of."""

from typing import Annotated

import numpy as np
import pandas as pd
import pytest
from pydantic import Field

from deboom.errors import InputError
from deboom.files.campaign_tables import (
    SensorRow,
    read_curve,
    read_sensor_table,
    write_curve,
    write_sensor_table,
)
from deboom.files.strict_toml import StrictModel, dump_toml, load_toml
from deboom.files.table_cells import read_rows

ROWS = (
    SensorRow("A1", "accelerometer", "B&K 4321", "EnM", "", (0.1, -0.2, 0.3), (0.0, 0.1, 1.5)),
    SensorRow("C7", "force cell", "Kistler 9077C", "Du", "left", (1.0, 2.0, 3.0), (0.0, 0.0, -1.0)),
)


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_position_sheets_read_back(tmp_path, suffix):
    path = tmp_path / f"sensors{suffix}"
    write_sensor_table(path, ROWS)
    for one, other in zip(ROWS, read_sensor_table(path), strict=True):
        assert (one.sensor, one.kind, one.model, one.mount, one.piece) == (
            *(other.sensor, other.kind, other.model, other.mount, other.piece),
        )
        assert other.position == pytest.approx(one.position, rel=1e-12)
        assert other.angles == pytest.approx(one.angles, rel=1e-9)


def test_curves_read_back(tmp_path):
    deflection, force = np.linspace(-1e-3, 1e-3, 5), np.linspace(-80.0, 90.0, 5)
    write_curve(tmp_path / "curve.csv", deflection, force)
    assert (tmp_path / "curve.csv").read_text().startswith("deflection [mm],force [N]\n-1.0,")
    found = read_curve(tmp_path / "curve.csv")
    assert found[0] == pytest.approx(deflection, rel=1e-14)
    assert found[1] == pytest.approx(force, rel=1e-14)


WRONG_TABLES = {
    "": "is empty",
    "name,x [mm]\n": "has a header and no rows",
    "name,x [mm]\n\n,\n": "has a header and no rows",
    "name\nA\n": "column 'x' is missing; the columns are name, x, separated by commas",
    "name,x [mm],x [mm]\nA,1,2\n": "column 'x' is unknown or doubled",
    "name,x [mm],z\nA,1,2\n": "column 'z' is unknown or doubled",
    "name,x [mm]\n,1\n": "line 2: column 'name' is empty",
    "name,x [mm]\nA,\n": "line 2, column 'x': '' is no finite number",
    'name,x [mm]\nA,"1,5"\n': "line 2, column 'x': '1,5' is no finite number",
    "name,x [mm]\n\nA,nan\n": "line 3, column 'x': 'nan' is no finite number",
    "name,x [inch]\nA,1\n": r"column 'x \[inch\]': unknown unit 'inch'",
    "name,x [N]\nA,1\n": r"column 'x \[N\]' is not in m or a multiple",
    "name,x [mm]\nA,1,2,3\n": "is no comma-separated table",
}


def numbers_of(path):
    rows = read_rows(path, ("name",), {"x": "m"})
    return {row.filled("name"): row.number("x") for row in rows}


@pytest.mark.parametrize("text", WRONG_TABLES)
def test_wrong_tables_are_refused(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=WRONG_TABLES[text]):
        numbers_of(path)


def test_files_that_are_no_table_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_rows(tmp_path / "none.csv", ("name",), {})
    (tmp_path / "bytes.csv").write_bytes(b"name\n\xff\xfe\n")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        read_rows(tmp_path / "bytes.csv", ("name",), {})
    (tmp_path / "text.xlsx").write_text("name\nA\n", encoding="utf-8")
    with pytest.raises(InputError, match="is no Excel file"):
        read_rows(tmp_path / "text.xlsx", ("name",), {})
    pd.DataFrame().to_excel(tmp_path / "empty.xlsx", index=False)
    with pytest.raises(InputError, match="is empty"):
        read_rows(tmp_path / "empty.xlsx", ("name",), {})


class Part(StrictModel):
    """A section."""

    name: str
    mass_kg: Annotated[float, Field(gt=0)]


class Whole(StrictModel):
    """A file."""

    format: int
    best: Part
    parts: Annotated[tuple[Part, ...], Field(strict=False)] = ()


GOOD = 'format = 1\n\n[best]\nname = "a"\nmass_kg = 1.5\n\n[[parts]]\nname = "b µ"\nmass_kg = 2.0\n'


def test_toml_reads_back_byte_for_byte(tmp_path):
    whole = Whole(format=1, best=Part(name="a", mass_kg=1.5), parts=(Part(name="b µ", mass_kg=2),))
    dump_toml(tmp_path / "whole.toml", whole)
    assert (tmp_path / "whole.toml").read_text(encoding="utf-8") == GOOD
    assert load_toml(tmp_path / "whole.toml", Whole) == whole


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("format = 1", "form = 1", "unknown key 'form' in the top level; did you mean 'format'?"),
        ("mass_kg = 2.0", "mas = 2.0", r"unknown key 'mas' in \[\[parts\]\] 1; did you mean 'mass"),
        ("mass_kg = 1.5", "q = 1", r"unknown key 'q' in \[best\]; use name, mass_kg"),
        ("mass_kg = 1.5\n", "", r"key 'mass_kg' in \[best\] is missing: add it"),
        ("mass_kg = 1.5", "mass_kg = -1.5", r"key 'mass_kg' in \[best\] is -1.5: input should be"),
        ("format = 1", "format = '1'", "key 'format' in the top level is \"1\": input should be a"),
        ("format = 1", "format", "is not TOML"),
    ],
)
def test_wrong_keys_are_named(tmp_path, old, new, says):
    (tmp_path / "whole.toml").write_text(GOOD.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=says):
        load_toml(tmp_path / "whole.toml", Whole)


def test_toml_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load_toml(tmp_path / "none.toml", Whole)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        load_toml(tmp_path / "bytes.toml", Whole)
