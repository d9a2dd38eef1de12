"""Functions that SDynPy saved are those of the same UFF file; nothing is unpickled."""

from pathlib import Path

import numpy as np
import pytest
from test_cli_platform import filled, made

from deboom.errors import InputError
from deboom.files.check import check_platform
from deboom.files.function_table import with_their_tables
from deboom.files.platform import read_platform
from deboom.files.sdynpy_npz import read_sdynpy
from deboom.files.uff import DIRECTION_CODE, read_uff

LINES = np.arange(20.0, 31.0)


def saved(path, functions, function_type=4):
    """Write what `NDDataArray.save` of SDynPy writes, by its documented record."""
    n, two = len(functions[0][-1]), len(functions[0][0])
    record = np.dtype(
        [
            ("abscissa", "float64", (n,)),
            ("ordinate", "complex128", (n,)),
            *((f"comment{k}", "<U80") for k in range(1, 6)),
            ("coordinate", [("node", "uint64"), ("direction", "int8")], (two,)),
        ]
    )
    data = np.zeros(len(functions), dtype=record)
    for row, (places, abscissa, values) in zip(data, functions, strict=True):
        row["abscissa"], row["ordinate"] = abscissa, values
        row["comment1"] = "by hand"
        row["coordinate"] = places
    np.savez(path, data=data, function_type=function_type)


def two_functions():
    return [([(1, 1), (101, -3)], LINES, LINES + 2j), ([(2, -2), (101, -3)], LINES, 3j * LINES)]


def delivered(folder, table="response,,acceleration,g\nreference,101,force,kN"):
    saved(folder / "body.npz", two_functions())
    (folder / "body.csv").write_text(f"role,node,quantity,unit\n{table}\n")
    return folder / "body.npz"


def with_directions(folder, *rows):
    path = delivered(folder)
    header = "role,node,direction,quantity,unit"
    path.with_suffix(".csv").write_text("\n".join([header, *rows]) + "\n")
    return path


def test_a_function_type_in_a_list_of_one_is_read(tmp_path):
    path = delivered(tmp_path)
    plain = read_sdynpy(path)
    saved(path, two_functions(), function_type=np.array([4]))
    assert [function.dof for function in read_sdynpy(path)] == [function.dof for function in plain]


@pytest.mark.parametrize(
    ("coordinate", "ordinate", "words"),
    [
        (("float64", (2,)), "complex128", "numbers do not fit together"),
        (([("knot", "uint64"), ("direction", "int8")], (2,)), "complex128", "do not fit together"),
        (([("node", "uint64"), ("direction", "int8")], (0,)), "complex128", "has 0 coordinates"),
        (([("node", "uint64"), ("direction", "int8")], (3,)), "complex128", "has 3 coordinates"),
        (([("node", "uint64"), ("direction", "int8")], (2,)), "<U5", "do not fit together"),
    ],
)
def test_records_of_other_fields_end_in_a_sentence(tmp_path, coordinate, ordinate, words):
    path = delivered(tmp_path)
    record = np.dtype(
        [
            ("abscissa", "float64", (2,)),
            ("ordinate", ordinate, (2,)),
            *((f"comment{k}", "<U80") for k in range(1, 6)),
            ("coordinate", *coordinate),
        ]
    )
    np.savez(path, data=np.zeros(2, dtype=record), function_type=4)
    path.with_suffix(".csv").write_text(
        "role,node,quantity,unit\nresponse,,acceleration,g\nreference,,force,N\n"
    )
    with pytest.raises(InputError, match=words):
        read_sdynpy(path)


def test_values_are_in_si_at_their_nodes(tmp_path):
    first, second = read_sdynpy(delivered(tmp_path))
    assert (first.response_node, first.response_direction) == (1, "+x")
    assert (second.response_node, second.response_direction) == (2, "-y")
    assert (first.reference_node, first.reference_direction) == (101, "-z")
    assert (first.ordinate, first.unit, first.id_lines[0]) == (
        "acceleration",
        "m/s^2/N",
        "by hand",
    )
    np.testing.assert_allclose(first.values, (LINES + 2j) * 9.80665 / 1000.0)


def test_files_that_were_read_include_the_tables_beside_them():
    named = ["a.uff", "b.npz", "c.pch", "b.npz", "b.csv", "run.wav"]
    names = [path.name for path in with_their_tables(map(Path, named))]
    assert names == ["a.uff", "b.npz", "b.csv", "c.pch", "c.csv", "run.wav", "run.csv"]


def test_a_node_may_have_another_quantity_along_each_direction(tmp_path):
    places = [(7, 1), (7, -2), (7, 0), (8, 3)]
    saved(tmp_path / "body.npz", [([at, (101, -3)], LINES, LINES + 2j) for at in places])
    (tmp_path / "body.csv").write_text(
        "role,node,direction,quantity,unit\nresponse,7,,velocity,mm/s\nresponse,7,+y,force,kN\n"
        "response,7,scalar,pressure,Pa\nresponse,,,acceleration,g\nreference,101,-z,force,N\n"
    )
    functions = read_sdynpy(tmp_path / "body.npz")
    assert [(each.ordinate, each.unit) for each in functions] == [
        ("velocity", "m/s/N"),
        ("force", "N/N"),
        ("pressure", "Pa/N"),
        ("acceleration", "m/s^2/N"),
    ]
    np.testing.assert_allclose(functions[1].values, 1e3 * (LINES + 2j))


def test_a_platform_of_saved_functions_has_the_numbers_of_its_uff_files(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    before = read_platform(folder)
    path = folder / "noise_transfer/wagon.uff"
    functions = [
        (
            [
                (function.response_node, 0),
                (function.reference_node, DIRECTION_CODE[function.reference_direction]),
            ],
            function.abscissa,
            function.values,
        )
        for function in read_uff(path)
    ]
    path.unlink()
    saved(path.with_suffix(".npz"), functions)
    path.with_suffix(".csv").write_text(
        "role,node,quantity,unit\nresponse,,pressure,Pa\nreference,,force,N\n"
    )
    toml = folder / "platform.toml"
    toml.write_text(toml.read_text(encoding="utf-8").replace("wagon.uff", "wagon.npz"))
    assert check_platform(folder).faults == ()
    after = read_platform(folder)
    for car, same in zip(after.fleet.vehicles, before.fleet.vehicles, strict=True):
        np.testing.assert_allclose(car.noise_transfer.values, same.noise_transfer.values)


class Trap:
    """An object whose unpickling would leave a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (Path(self.path).touch, ())


def pickled(folder):
    np.savez(folder / "body.npz", data=np.array([Trap(folder / "sprung")], dtype=object))


def other_arrays(folder):
    np.savez(folder / "body.npz", frequency=LINES)


def shock(folder):
    saved(folder / "body.npz", two_functions(), function_type=24)


def turned(folder):
    functions = two_functions()
    functions[1][0][0] = (2, 9)
    saved(folder / "body.npz", functions)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (pickled, "an array of objects"),
        (other_arrays, "holds frequency, and no functions of SDynPy: save them"),
        (shock, "is of SDynPy's function type 24"),
        (turned, "node 2 has direction 9, which is none of -6 to 6"),
        (lambda f: (f / "body.csv").unlink(), "states no units: write body.csv beside it"),
        (lambda f: delivered(f, "response,,force,kg"), "line 2: 'kg' is no unit of force"),
        (lambda f: delivered(f, "answer,,force,N"), "line 2: role 'answer': use response or"),
        (lambda f: delivered(f, "response,x,force,N"), "line 2: node 'x' is no whole number"),
        (
            lambda f: with_directions(f, "response,,+x,force,N"),
            "direction '+x': state it beside a node",
        ),
        (
            lambda f: with_directions(f, "response,1,x,force,N"),
            "direction 'x': state it beside a node, as one of scalar, +x",
        ),
        (
            lambda f: with_directions(f, "response,1,+x,force,N", "response,1,-x,force,N"),
            "response '1' x",
        ),
        (
            lambda f: delivered(f, "response,1,force,N"),
            "reference node 101 -z has no row in body.csv",
        ),
        (lambda f: (f / "body.npz").write_bytes(b"PK\x03\x04"), "it is damaged; save it again"),
    ],
)
def test_what_is_wrong_is_named_and_nothing_is_unpickled(tmp_path, fault, words):
    path = delivered(tmp_path)
    fault(tmp_path)
    with pytest.raises(InputError) as caught:
        read_sdynpy(path)
    assert words in str(caught.value), caught.value
    assert not (tmp_path / "sprung").exists()
