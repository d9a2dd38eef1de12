"""The shipped platform is what the bench writes for seed 1.

Written by ``deboom bench write studies/data/u06_f39_f45 --seed 1``; the mount library
beside it has a test of its own.
"""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from deboom.bench.layout import FREQUENCY
from deboom.bench.platform_writer import write_platform
from deboom.files.rows import read_torque_table
from deboom.files.uff import read_uff
from deboom.study.platform_model import CATALOGUE_FILE, LIBRARY_FILE

SHIPPED = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
FILES = sorted(
    path.relative_to(SHIPPED).as_posix()
    for path in SHIPPED.rglob("*")
    if path.is_file() and path.name not in (LIBRARY_FILE, CATALOGUE_FILE, "programme.toml")
)


@pytest.fixture(scope="module")
def again(tmp_path_factory):
    return write_platform(tmp_path_factory.mktemp("golden") / "u06_f39_f45", seed=1)


def close(found, expected):
    """Agree to 1e-9 of the largest value of the curve."""
    largest = np.max(np.abs(expected))
    return np.max(np.abs(found - expected)) <= 1e-9 * largest


def test_the_same_files(again):
    assert sorted(p.relative_to(again).as_posix() for p in again.rglob("*") if p.is_file()) == FILES
    assert sum((SHIPPED / name).stat().st_size for name in FILES) <= 20e6


@pytest.mark.parametrize("name", [name for name in FILES if name.endswith(".uff")])
def test_the_same_functions(again, name):
    shipped, written = read_uff(SHIPPED / name), read_uff(again / name)
    assert [f.dof for f in shipped] == [f.dof for f in written]
    for one, other in zip(shipped, written, strict=True):
        assert (one.unit, one.function_type, one.id_lines) == (
            other.unit,
            other.function_type,
            other.id_lines,
        )
        assert np.array_equal(one.abscissa, other.abscissa)
        assert close(other.values, one.values), one.dof


@pytest.mark.parametrize("name", [name for name in FILES if name.endswith(".npz")])
def test_the_same_truth(again, name):
    with (
        np.load(SHIPPED / name, allow_pickle=False) as shipped,
        np.load(again / name, allow_pickle=False) as written,
    ):
        assert shipped.files == written.files
        for key in shipped.files:
            if shipped[key].dtype.kind == "U":
                assert np.array_equal(shipped[key], written[key])
            else:
                assert close(written[key], shipped[key]), key


@pytest.mark.parametrize("name", [name for name in FILES if name.endswith("_torque.csv")])
def test_the_same_engine_torque(again, name):
    shipped, written = (read_torque_table(folder / name, FREQUENCY) for folder in (SHIPPED, again))
    # two decimals are written; the last one may be rounded the other way elsewhere
    assert np.max(np.abs(written - shipped)) < 0.0101


def test_the_same_texts(again):
    for name in ("README.txt", "mounts.csv", "channels.csv"):
        shipped = (SHIPPED / name).read_text(encoding="utf-8")
        assert (again / name).read_text(encoding="utf-8") == shipped
    for name, read in (("platform.toml", tomllib.loads), ("truth/powertrain.json", json.loads)):
        shipped, written = (
            read((folder / name).read_text(encoding="utf-8")) for folder in (SHIPPED, again)
        )
        assert written == shipped
