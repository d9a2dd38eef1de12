"""The shipped platform is what the bench writes for seed 1, and its mount library fits it.

Written by ``deboom bench write … --seed 1`` and ``python benchmarks/write_library.py``.
"""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from deboom.bench.layout import FREQUENCY
from deboom.bench.platform_writer import write_platform
from deboom.files.library_export import read_library_json
from deboom.files.platform import CATALOGUE_FILE, read_platform
from deboom.files.rows import read_torque_table
from deboom.files.uff import read_uff
from deboom.mounts.surface_forces import surface_forces
from deboom.vehicles.platform import LIBRARY_FILE
from deboom.vehicles.surface_check import PEAKS, surface_check

SHIPPED = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
NOT_IDENTIFIED = ["EnM y", "GeM y", "TSM y"]
FILES = sorted(
    path.relative_to(SHIPPED).as_posix()
    for path in SHIPPED.rglob("*")
    if path.is_file() and path.name not in (LIBRARY_FILE, CATALOGUE_FILE, "programme.toml")
)


@pytest.fixture(scope="module")
def again(tmp_path_factory):
    return write_platform(tmp_path_factory.mktemp("golden") / "u06_f39_f45", seed=1)


def close(written, expected):
    """Agree to 1e-9 of the largest value of the curve."""
    return np.max(np.abs(written - expected)) <= 1e-9 * np.max(np.abs(expected))


def test_the_same_files(again):
    assert sorted(p.relative_to(again).as_posix() for p in again.rglob("*") if p.is_file()) == FILES
    assert sum((SHIPPED / name).stat().st_size for name in FILES) <= 20e6


@pytest.mark.parametrize("name", [name for name in FILES if name.endswith(".uff")])
def test_the_same_functions(again, name):
    shipped, written = read_uff(SHIPPED / name), read_uff(again / name)
    assert [f.dof for f in shipped] == [f.dof for f in written]
    for shipped_function, other in zip(shipped, written, strict=True):
        assert (
            shipped_function.unit,
            shipped_function.function_type,
            shipped_function.id_lines,
        ) == (
            other.unit,
            other.function_type,
            other.id_lines,
        )
        assert np.array_equal(shipped_function.abscissa, other.abscissa)
        assert close(other.values, shipped_function.values), shipped_function.dof


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


@pytest.fixture(scope="module")
def platform():
    return read_platform(SHIPPED)


@pytest.fixture(scope="module")
def mounts():
    return read_library_json(SHIPPED / LIBRARY_FILE)[1]


@pytest.fixture(scope="module")
def check(platform, mounts):
    pairs = [(case, surface_forces(case, mounts)) for case in platform.load_cases]
    return surface_check(platform.fleet, platform.mounts, pairs, (20, 60))


def test_every_mount_of_the_platform_is_in_it_once(platform, mounts):
    assert [mount.mount.name for mount in mounts] == [mount.name for mount in platform.mounts]
    for mount in mounts:
        assert (mount.identity.campaign, mount.identity.variant) == ("virtual_bench_1", "M0")
        for direction in mount.directions:
            name = f"{mount.mount.name} {direction.axis}"
            assert direction.quality.identified == (name not in NOT_IDENTIFIED)
            assert direction.surface is not None
            assert len(direction.map_points) == 0


def test_it_stays_small():
    assert (SHIPPED / LIBRARY_FILE).stat().st_size < 4e6


def test_every_line_of_every_load_case_is_inside_of_the_measured_region(check):
    assert check.kept == tuple(f"{name} (not identified)" for name in NOT_IDENTIFIED)


def test_surfaces_and_spectra_agree_at_every_booming_peak(check):
    assert len(check.table) == 6 * 15
    assert check.table["peaks"].min() >= 1
    assert not check.table["peaks of one curve only"].any()
    assert check.table[PEAKS].max() <= 0.3
    assert check.table["corr_f [1]"].max() < 0.001
