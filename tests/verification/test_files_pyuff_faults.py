"""The documented faults of pyuff 2.5.8, each shown closed by the reader in front of it.

The files are judged here with a reader of their own, so that a fault cannot hide in the shared
code: set starts and ends counted in the bytes, headers cut by their columns.
"""

import re
import struct

import numpy as np
import pytest

from deboom.files.uff import UffFunction, read_uff, write_uff

LINES = 20.0 + 0.25 * np.arange(241)


def functions(n, complex_values=True, lines=LINES):
    rng = np.random.default_rng(1)
    values = rng.standard_normal((n, lines.size))
    if complex_values:
        values = values + 1j * rng.standard_normal((n, lines.size))
    units = ("acceleration", "rad/s^2", "force", "N")
    return [
        UffFunction(
            lines, values[i], 4, i + 1, "-rz", 1000 + i, "+y", *units, response_name="ten letter"
        )
        for i in range(n)
    ]


def blocks(data):
    """Cut a file into its sets: 58b by the announced bytes, others at their closing -1."""
    texts = []
    while data:
        assert data.startswith(b"    -1\n")
        header = data.split(b"\n", 2)[1]
        if header.startswith(b"    58b"):
            end_of_header = [m.end() for m in re.finditer(b"\n", data)][12]
            end = end_of_header + int(header[31:43])
        else:
            end = data.index(b"    -1\n", 7)
        assert data[end:].startswith(b"    -1\n")
        texts.append(data[:end])
        data = data[end + 7 :]
    return texts


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("complex_values", [False, True])
def test_all_sets_stand_between_single_separators(tmp_path, binary, complex_values):
    """Fault a: 'overwrite' doubles the -1 and destroys the first binary set."""
    written = functions(3, complex_values)
    write_uff(tmp_path / "a.uff", written, binary=binary)
    write_uff(tmp_path / "a.uff", written, binary=binary)  # over an existing file, too
    sets = blocks((tmp_path / "a.uff").read_bytes())
    kinds = [s.split(b"\n")[1][:7].strip() for s in sets]
    assert kinds == [b"164", *[b"58b" if binary else b"58"] * 3]


def test_binary_sets_announce_their_true_bytes(tmp_path):
    """A complex set announced 8 N bytes and holds 16 N; other readers count on the number."""
    (written,) = functions(1)
    write_uff(tmp_path / "a.uff", [written], binary=True)
    block = blocks((tmp_path / "a.uff").read_bytes())[1]
    payload = block[[m.end() for m in re.finditer(b"\n", block)][12] :]
    assert len(payload) == 16 * LINES.size
    numbers = struct.unpack(f"<{2 * LINES.size}d", payload)
    np.testing.assert_array_equal(np.array(numbers).view(complex), written.values)


@pytest.mark.parametrize("binary", [False, True])
def test_ten_letters_fill_their_field(tmp_path, binary):
    """Fault b: an 11th letter shifts node and direction, which read back as 0."""
    (written,) = functions(1)
    write_uff(tmp_path / "a.uff", [written], binary=binary)
    record = blocks((tmp_path / "a.uff").read_bytes())[1].split(b"\n")[7]
    assert record[31:41] == b"ten letter"
    assert int(record[41:51]) == 1
    assert int(record[51:55]) == -6
    assert int(record[66:76]) == 1000
    assert int(record[76:80]) == 2


@pytest.mark.parametrize("binary", [False, True])
def test_units_are_always_written(tmp_path, binary):
    """Fault f: unit fields may be left out; then writing fails or the file has no unit."""
    write_uff(tmp_path / "a.uff", functions(1), binary=binary)
    units, function = blocks((tmp_path / "a.uff").read_bytes())
    lines = units.split(b"\n")
    assert lines[1].strip() == b"164"
    assert int(lines[2][:10]) == 1
    assert [float(f.replace(b"D", b"e")) for f in lines[3].split()] == [1.0, 1.0, 1.0]
    records = function.split(b"\n")[9:12]
    assert [int(record[:10]) for record in records] == [18, 12, 13]
    assert [record[46:66].strip() for record in records] == [b"Hz", b"rad/s^2", b"N"]
    (read,) = read_uff(tmp_path / "a.uff")
    assert read.unit == "rad/s^2/N"
