"""Exports of characterised mounts: complete, exact, with units, and nothing left out unsaid."""

import json

import numpy as np
import openpyxl
import pytest
from mounts_library_samples import assert_same, campaign, mount, wishbone

from deboom.errors import InputError
from deboom.files import library_export
from deboom.files.library_export import read_library_json, write_library_json, write_library_xlsx

MOUNTS = (mount(supplier="=Ø & Söhne"), wishbone())


def rows(workbook, sheet):
    header, *body = workbook[sheet].iter_rows(values_only=True)
    return [dict(zip(header, row, strict=True)) for row in body]


def test_json_gives_back_the_same_bit_for_bit(tmp_path):
    path = tmp_path / "mounts.json"
    write_library_json(path, [campaign()], MOUNTS)
    campaigns, mounts = read_library_json(path)
    assert_same(campaigns, (campaign(),))
    assert_same(mounts, MOUNTS)
    points = json.loads(path.read_text("utf-8"))["mounts"][0]["directions"][0]["map_points"]
    assert {name for name in points if not name.endswith("]")} == {"run"}


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda d: d.update(format="deboom mount library 2"), "its format is 'deboom mount librar"),
        (lambda d: d["mounts"][0].pop("pieces"), "the entry 'pieces' is missing; export it again"),
        (lambda d: d["mounts"][0]["identity"].update(colour="red"), "an entry is of another kind"),
        (lambda d: d.update(mounts=7), "an entry is of another kind"),
        (
            lambda d: d["mounts"][0]["directions"][0]["map_points"]["run"].update(dtype="O"),
            "an array is of object, not of numbers",
        ),
        (
            lambda d: d["mounts"][0]["directions"][0]["surface"].update(model="Spline"),
            "a surface of model Spline cannot be built",
        ),
        (
            lambda d: d["mounts"][0]["directions"][0]["surface"]["arrays"].pop("region_lower"),
            r"lacks the arrays \['region_lower'\]",
        ),
        (
            lambda d: d["mounts"][0]["directions"][0]["map_points"]["run"].update(shape=[3]),
            "an entry is of another kind .*reshape",
        ),
    ],
)
def test_json_that_was_changed_is_refused_by_name(tmp_path, spoil, sentence):
    path = tmp_path / "mounts.json"
    write_library_json(path, [campaign()], MOUNTS)
    document = json.loads(path.read_text("utf-8"))
    spoil(document)
    path.write_text(json.dumps(document), "utf-8")
    with pytest.raises(InputError, match=f"mounts.json: .*{sentence}"):
        read_library_json(path)


def test_the_spreadsheet_holds_every_number_with_its_unit(tmp_path):
    path = tmp_path / "mounts.xlsx"
    write_library_xlsx(path, [campaign()], MOUNTS)
    workbook = openpyxl.load_workbook(path)

    points = [row for row in rows(workbook, "map_points") if row["axis"] == "z"]
    expected = MOUNTS[0].direction("z").map_points
    real, imag = "dynamic_stiffness_real [N/m]", "dynamic_stiffness_imag [N/m]"
    stiffness = np.array([row[real] + 1j * row[imag] for row in points])
    np.testing.assert_allclose(stiffness, expected.dynamic_stiffness, rtol=1e-15)
    preload = [row["preload [N]"] for row in points]
    np.testing.assert_allclose(preload, expected.preload, rtol=1e-15)
    assert [row["run"] for row in points] == expected.run.tolist()

    directions = rows(workbook, "directions")
    assert [row["identified"] for row in directions] == [True, False, False, False]
    assert [row["r2_real [1]"] for row in directions] == [0.9991, None, None, None]
    assert directions[0]["frequency_upper [Hz]"] == 57.25
    highest = MOUNTS[0].direction("z").surface.ranges["preload"][1]
    assert directions[1]["wheel_torque_upper [N m]"] == pytest.approx(highest, rel=1e-15)

    pieces = rows(workbook, "mounts")
    assert [(row["mount"], row["piece"], row["y [m]"]) for row in pieces[1:]] == [
        ("Du", "left", -0.3),
        ("Du", "right", 0.3),
    ]
    curve = rows(workbook, "static_curves")
    force = MOUNTS[0].direction("x").static_curve.force
    np.testing.assert_allclose([row["force [N]"] for row in curve], force, rtol=1e-15)
    (quality,) = MOUNTS[0].quality.items()
    (row,) = rows(workbook, "quality")
    assert (row["quality"], row["value"]) == (quality[0], pytest.approx(quality[1], rel=1e-15))
    tolerances = {row["tolerance"]: row["value"] for row in rows(workbook, "campaigns")}
    assert tolerances == campaign().tolerances

    cells = [cell for row in workbook["mounts"].iter_rows() for cell in row]
    assert "=Ø & Söhne" in [cell.value for cell in cells]
    assert "f" not in {cell.data_type for cell in cells}  # text that looks like a formula is text


def test_a_sheet_that_would_overflow_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(library_export, "SHEET_ROWS", 100)
    with pytest.raises(
        InputError, match=r"map_points would have 450 rows and a sheet holds 100: exp"
    ):
        write_library_xlsx(tmp_path / "mounts.xlsx", [campaign()], MOUNTS)
    assert not list(tmp_path.iterdir())
