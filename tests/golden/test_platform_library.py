"""The shipped platform's mount library: what is in it, and what it changes at the ears.

Written by ``python benchmarks/write_library.py``.
"""

from pathlib import Path

import pytest

from deboom.files.library_export import read_library_json
from deboom.files.platform import read_platform
from deboom.mounts.surface_forces import surface_forces
from deboom.study.platform_model import LIBRARY_FILE, PEAKS, surface_check

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
NOT_IDENTIFIED = ["EnM y", "GeM y", "TSM y"]


@pytest.fixture(scope="module")
def platform():
    return read_platform(PLATFORM)


@pytest.fixture(scope="module")
def mounts():
    return read_library_json(PLATFORM / LIBRARY_FILE)[1]


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
    assert (PLATFORM / LIBRARY_FILE).stat().st_size < 4e6


def test_every_line_of_every_load_case_is_inside_of_the_measured_region(check):
    assert check.kept == tuple(f"{name} (not identified)" for name in NOT_IDENTIFIED)


def test_surfaces_and_spectra_agree_at_every_booming_peak(check):
    assert len(check.table) == 6 * 15
    assert check.table["peaks"].min() >= 1
    assert not check.table["peaks of one curve only"].any()
    assert check.table[PEAKS].max() <= 0.3
    assert check.table["corr_f [1]"].max() < 0.001
