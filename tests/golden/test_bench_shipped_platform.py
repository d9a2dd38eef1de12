"""The shipped platform is what the bench writes for seed 1.

Written by ``deboom bench write studies/data/u06_f39_f45 --seed 1``.
"""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from deboom.bench.platform_writer import write_platform
from deboom.files.uff import read_uff

SHIPPED = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
FILES = sorted(p.relative_to(SHIPPED).as_posix() for p in SHIPPED.rglob("*") if p.is_file())


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


def test_the_same_texts(again):
    for name in ("README.txt", "mounts.csv", "channels.csv"):
        shipped = (SHIPPED / name).read_text(encoding="utf-8")
        assert (again / name).read_text(encoding="utf-8") == shipped
    for name, read in (("platform.toml", tomllib.loads), ("truth/powertrain.json", json.loads)):
        shipped, written = (
            read((folder / name).read_text(encoding="utf-8")) for folder in (SHIPPED, again)
        )
        assert written == shipped
