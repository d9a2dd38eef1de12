"""Nastran's punch files: two masses in closed form, a solver's layout, a platform from FE."""

import re
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from test_cli_platform import filled, made

from deboom.errors import InputError
from deboom.files.check import check_platform
from deboom.files.curves import read_curves
from deboom.files.nastran_punch import loads_of, read_punch
from deboom.files.platform import read_platform
from deboom.files.rows import NOISE_TRANSFER, ChannelRow
from deboom.files.tables import read_table
from deboom.files.uff import UffFunction, read_uff, write_uff

DATA = Path(__file__).parents[1] / "data" / "nastran-punch"
LINES = np.arange(20.0, 42.0, 5.0)
MASS = np.diag([2.0, 1.0])  # [kg]
STIFFNESS = np.array([[150e3, -50e3], [-50e3, 50e3]])  # [N/m]
PRESSURE = 2e4  # at the fluid point per motion of the second mass [Pa/m]


def receptance():
    """Receptance of both masses with 4 % structural damping, (f, 2, 2) [m/N]."""
    square = (2 * np.pi * LINES)[:, None, None] ** 2
    return np.linalg.inv(STIFFNESS * (1 + 0.04j) - square * MASS)


@pytest.mark.parametrize("name", ["two_masses_sort1.pch", "two_masses_sort2.pch"])
def test_functions_of_two_masses_are_the_closed_form_per_force_in_si(name):
    functions = {
        (function.reference_node, function.response_node, function.response_direction): function
        for function in read_punch(DATA / name)
    }
    exact = receptance()
    for column, (node, sign) in enumerate(((11, 1.0), (12, -1.0))):
        for row, response in enumerate((11, 12)):
            function = functions[node, response, "+x"]
            assert (function.ordinate, function.unit) == ("displacement", "m/N")
            assert function.reference_direction == ("+x" if sign > 0 else "-x")
            np.testing.assert_allclose(function.abscissa, LINES)
            np.testing.assert_allclose(function.values, sign * exact[:, row, column], rtol=3e-6)
        ear = functions[node, 901, "scalar"]
        assert (ear.ordinate, ear.unit) == ("pressure", "Pa/N")
        np.testing.assert_allclose(ear.values, sign * PRESSURE * exact[:, 1, column], rtol=3e-6)
    assert not np.any(functions[11, 12, "+z"].values)


def delivered(folder, name="two_masses_sort1"):
    for ending in (".pch", ".csv"):
        shutil.copy(DATA / f"{name}{ending}", folder / f"wagon{ending}")
    return folder / "wagon.pch"


def edited(ending, old, new, count=1):
    def edit(folder):
        path = folder / f"wagon{ending}"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, count))

    return edit


def modes(folder):
    shutil.copy(DATA / "fsi_modes.pch", folder / "wagon.pch")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda f: (f / "wagon.csv").unlink(), "states neither loads nor units: write wagon.csv"),
        (edited(".csv", "2,12,-x,2", "3,12,-x,2"), "subcase 2 is not in wagon.csv: add its row"),
        (edited(".csv", "2,12,-x,2", "3,12,-x,2"), "subcase 3 has no results over frequency"),
        (edited(".csv", "-x", "x"), "line 3: direction 'x': use one of +x, -x to -z"),
        (edited(".csv", "mm", "Hz"), "line 2: 'Hz' is no unit of length"),
        (edited(".csv", "+x,1,", "+x,-1,"), "line 2: the force is not positive"),
        (modes, "wagon.pch holds eigenvector: punch displacements"),
        (
            edited(".pch", "$REAL-IMAGINARY OUTPUT", "$REAL OUTPUT          "),
            "line 8: displacements of results that",
        ),
        (edited(".pch", "-CONT-", "$CONT =", 1), "line 8: a point has 3 numbers instead of 12"),
        (edited(".pch", "E-05", "F-05", 1), "is no number: punch it again"),
        (
            edited(".csv", "MPa,901", "MPa,", -1),
            "scalar point 901 may be acoustic, with a pressure, or a degree of freedom",
        ),
        (edited(".csv", ",901", ",901;902"), "acoustic_points '901;902': give numbers of points"),
        (edited(".csv", ",901", f",{'9' * 5000}"), "999': give numbers of points with blanks"),
        (
            edited(".csv", "MPa,901", "MPa,901 903"),
            "wagon.csv: subcase 1: acoustic point 903 has no pressure in wagon.pch",
        ),
        (
            edited(".pch", "$FREQUENCY =   2.5000000E+01", "$FREQUENCY =   2.0000000E+01"),
            "subcase 1: node 11 has its displacement at 20 Hz twice",
        ),
    ],
)
def test_what_is_wrong_in_a_punch_file_is_named(tmp_path, fault, words):
    path = delivered(tmp_path)
    fault(tmp_path)
    with pytest.raises(InputError) as caught:
        read_punch(path)
    assert words in str(caught.value), caught.value
    assert str(tmp_path) in str(caught.value)


def test_scalar_points_that_nobody_names_as_acoustic_are_passed_over(tmp_path):
    path = delivered(tmp_path)
    # a generalised coordinate of a substructure beside the ear
    blocks = re.findall(r"^ +901 .*\n(?:-CONT-.*\n){3}", path.read_text(), flags=re.M)
    text = path.read_text()
    for block in blocks:
        text = text.replace(block, block + block.replace("       901 ", "       777 "))
    path.write_text(text)
    nodes = {function.response_node for function in read_punch(path)}
    assert nodes == {11, 12, 901}


def punched(path, functions):
    """Write functions per force as a solver punches them: a subcase for each load."""
    loads = list(
        dict.fromkeys((each.reference_node, each.reference_direction) for each in functions)
    )
    fluid = {str(f.response_node) for f in functions if f.response_direction == "scalar"}
    points = " ".join(sorted(fluid))
    table = ["subcase,node,direction,force [N],length,pressure,acoustic_points"]
    lines = []
    for subcase, load in enumerate(loads, 1):
        table.append(f"{subcase},{load[0]},{load[1]},1,mm,MPa,{points}")
        here = [f for f in functions if (f.reference_node, f.reference_direction) == load]
        for node in dict.fromkeys(function.response_node for function in here):
            parts = {f.response_direction: f for f in here if f.response_node == node}
            fluid = "scalar" in parts
            order = ["scalar"] if fluid else ["+x", "+y", "+z"]
            scale = 1e-6 if fluid else 1e3
            lines += ["$TITLE   =", "$DISPLACEMENTS", "$REAL-IMAGINARY OUTPUT"]
            lines += [f"$SUBCASE ID ={subcase:12d}", f"$POINT ID ={node:12d}"]
            for k, frequency in enumerate(here[0].abscissa):
                values = np.zeros(6, dtype=complex)
                for place, direction in enumerate(order):
                    values[place] = scale * parts[direction].values[k] if direction in parts else 0
                numbers = [f"{v:18.9E}" for v in (*values.real, *values.imag)]
                first = f"{frequency:16.6E} {'S' if fluid else 'G'}"
                lines.append(first + "".join(numbers[:3]))
                lines += ["-CONT-            " + "".join(numbers[n : n + 3]) for n in (3, 6, 9)]
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".csv").write_text("\n".join(table) + "\n")


def with_receptance(folder):
    """Add the receptance of the wagon's body between its paths, and of the other car's."""
    rows = [row for row in read_table(folder / "channels.xlsx", ChannelRow)]
    paths = [row for row in rows if row.quantity == NOISE_TRANSFER]
    functions = []
    for vehicle in ("wagon", "cabrio"):
        lines = read_uff(folder / f"noise_transfer/{vehicle}.uff")[0].abscissa
        size = 1e-7 * np.exp(-0.02j * lines)
        functions = [
            UffFunction(
                lines, size / (1 + (path is not other)), 4, path.node, path.direction,
                other.node, other.direction, "displacement", "m", "force", "N",
            )
            for path in paths
            for other in paths
        ]  # fmt: skip
        write_uff(folder / f"noise_transfer/{vehicle}_body.uff", functions)
    toml = folder / "platform.toml"
    text = toml.read_text(encoding="utf-8")
    for vehicle in ("wagon", "cabrio"):
        line = f'noise_transfer = "noise_transfer/{vehicle}.uff"'
        assert line in text
        text = text.replace(line, f'{line}\nreceptance = "noise_transfer/{vehicle}_body.uff"')
    toml.write_text(text, encoding="utf-8")
    return folder


def test_a_platform_of_punched_functions_has_the_numbers_of_its_uff_files(tmp_path):
    folder = with_receptance(filled(made(tmp_path / "measured")))
    before = read_platform(folder)
    other = Path(shutil.copytree(folder, tmp_path / "fe"))
    toml = other / "platform.toml"
    text = toml.read_text(encoding="utf-8")
    for vehicle in ("wagon", "cabrio"):
        names = [f"noise_transfer/{vehicle}.uff", f"noise_transfer/{vehicle}_body.uff"]
        functions = [function for name in names for function in read_uff(other / name)]
        punched(other / f"noise_transfer/{vehicle}.pch", functions)
        for name in names:
            (other / name).unlink()
            text = text.replace(f'"{name}"', f'"noise_transfer/{vehicle}.pch"')
    toml.write_text(text, encoding="utf-8")
    after = read_platform(other)
    assert check_platform(other).faults == ()
    assert other / "noise_transfer/wagon.csv" in after.input_files
    for car, same in zip(after.fleet.vehicles, before.fleet.vehicles, strict=True):
        np.testing.assert_allclose(car.noise_transfer.values, same.noise_transfer.values, rtol=1e-8)
        np.testing.assert_allclose(car.receptance.values, same.receptance.values, rtol=1e-8)


def test_op2_is_named_with_the_export_that_works(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    (folder / "noise_transfer/wagon.op2").write_bytes(bytes(64))
    toml = folder / "platform.toml"
    text = toml.read_text(encoding="utf-8").replace("wagon.uff", "wagon.op2")
    toml.write_text(text, encoding="utf-8")
    (fault,) = check_platform(folder).faults
    assert "wagon.op2 is Nastran's OP2, which is not read" in fault
    assert "DISPLACEMENT(PUNCH,REAL)" in fault
    with pytest.raises(InputError, match="is Nastran's OP2, which is not read"):
        read_curves(folder / "noise_transfer/wagon.op2")


def test_the_table_of_the_guide_is_read(tmp_path):
    guide = Path(__file__).parents[2] / "docs" / "guides" / "vehicles-from-fe.md"
    (table,) = re.findall(r"```text\n(.*?)```", guide.read_text(encoding="utf-8"), flags=re.S)
    (tmp_path / "wagon.csv").write_text(table, encoding="utf-8")
    loads = loads_of(tmp_path / "wagon.pch")
    assert [(row.node, row.direction, row.force) for row in loads.values()] == [
        (101, "+x", 1.0),
        (101, "+y", 1.0),
        (101, "+z", 1.0),
    ]


def test_lines_without_numbers_are_passed_over_soon_and_their_number_is_limited(tmp_path):
    path = delivered(tmp_path)
    whole = path.read_text()
    path.write_text("$A = 1\n" * 600_000 + whole)
    begin = time.process_time()
    assert len(read_punch(path)) == len(read_punch(delivered(tmp_path)))
    assert time.process_time() - begin < 5.0  # 13 s where each line copies those before
    path.write_text("\n" * 2_000_001)
    with pytest.raises(InputError, match="has more than 2000000 lines"):
        read_punch(path)
