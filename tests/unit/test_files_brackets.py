"""Brackets of the mounts: from the keys of a platform to what cars are expected to show."""

from __future__ import annotations

import shutil

import numpy as np
import pandas as pd
import pytest

from deboom.bench.layout import FREQUENCY, LOAD_CASES
from deboom.bench.platform_writer import write_platform
from deboom.errors import DataWarning, InputError
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import uncertain_index

RUN = tuple(case for case in LOAD_CASES if case.name == "g5_wot220")
STIFF = "[2500, 1000, 4000.0]"


@pytest.fixture(scope="module")
def rigid(tmp_path_factory):
    path = tmp_path_factory.mktemp("brackets") / "p"
    return write_platform(path, 1, groups=("U06-1", "U06-2"), load_cases=RUN)


@pytest.fixture
def folder(rigid, tmp_path):
    return shutil.copytree(rigid, tmp_path / "p")


def stated(folder, mount, brackets):
    toml = folder / "platform.toml"
    name = f'name = "{mount}"\n'
    assert toml.read_text().count(name) == 1
    key = f"{name}bracket_stiffness_n_per_mm = {brackets}\n"
    toml.write_text(toml.read_text().replace(name, key))
    return folder


def table(folder, values, unit="kN/mm", lines=FREQUENCY):
    columns = {"frequency [Hz]": lines}
    for axis, column in zip("xyz", np.broadcast_to(values, (lines.size, 3)).T, strict=True):
        columns |= {f"{axis} real [{unit}]": column.real, f"{axis} imag [{unit}]": column.imag}
    pd.DataFrame(columns).to_csv(folder / "tsm.csv", index=False)


def model(folder, **options):
    return read_platform(folder).model(mounts="spectra", **options)


def test_brackets_stand_in_series_with_their_mount_in_every_car(folder):
    stated(folder, "EnM", f"{{engine = {STIFF}, body = {STIFF}}}")
    table(folder, np.array([2.0 + 0.2j, 3.0, 4.0]) * (1 + 1e-3 * FREQUENCY[:, np.newaxis]))
    stated(folder, "TSM", '{body = "tsm.csv"}')
    case = model(folder).cases[0]
    gives = case.receptance.diagonal(axis1=2, axis2=3)
    names = [case.variable_names[k] for k in case.variables]
    at = names.index("EnM x")
    np.testing.assert_allclose(gives[..., at], 2 / 2.5e6)
    measured = (2e6 + 2e5j) * (1 + 1e-3 * case.frequency)
    np.testing.assert_allclose(gives[0, :, names.index("TSM x")], 1 / measured)
    assert not gives[..., names.index("GeM x")].any()
    assert folder / "tsm.csv" in read_platform(folder).input_files


def expected(folder):
    platform, index = read_platform(folder), model(folder)
    return uncertain_index(index, platform, ()).expected_change(np.full((1, 12), 0.9)).mean


def test_a_stated_bracket_of_the_body_takes_the_place_of_what_is_drawn(rigid, folder, tmp_path):
    soft = shutil.copytree(rigid, tmp_path / "soft")
    for mount in ("EnM", "GeM", "TSM"):
        stated(folder, mount, "{body = [1e6, 1e6, 1e6]}")
        stated(soft, mount, f"{{body = {STIFF}}}")
    unknown, stiff, yielding = (expected(path) for path in (rigid, folder, soft))
    assert stiff.high[0] - stiff.low[0] < unknown.high[0] - unknown.low[0]
    assert stiff.expected[0] < unknown.expected[0] < yielding.expected[0] < 0.0


WRONG = {
    "the body bracket of EnM is .* times as soft along x as the mount itself": (
        "EnM",
        "{body = [60, 1e4, 1e4]}",
        {},
    ),
    "tsm.csv: engine bracket of mount TSM: its lines are not those": (
        "TSM",
        '{engine = "tsm.csv"}',
        {"lines": FREQUENCY[::2]},
    ),
    "tsm.csv: engine bracket of mount TSM, x: 'm' is no unit of a stiffness": (
        "TSM",
        '{engine = "tsm.csv"}',
        {"unit": "m"},
    ),
    "engine bracket of mount TSM, x: the stiffness is negative": (
        "TSM",
        '{engine = "tsm.csv"}',
        {"values": -2.0},
    ),
    "tsm.uff: engine bracket of mount TSM: write it as a table": (
        "TSM",
        '{engine = "tsm.uff"}',
        {},
    ),
}


@pytest.mark.parametrize("sentence", WRONG)
def test_a_bracket_that_does_not_fit_is_named(folder, sentence):
    mount, brackets, changed = WRONG[sentence]
    table(folder, **({"values": 2.0 + 0.2j} | changed))
    stated(folder, mount, brackets)
    with pytest.raises(InputError, match=sentence):
        model(folder)


def test_prescribed_motion_says_that_brackets_do_not_count(rigid, folder):
    stated(folder, "EnM", f"{{engine = {STIFF}}}")
    with pytest.warns(DataWarning, match="brackets and rubber of EnM in the car do not count"):
        there = model(folder, motion="prescribed")
    design = np.full((1, 12), 0.9)
    np.testing.assert_array_equal(there(design), model(rigid, motion="prescribed")(design))


def test_a_bracket_of_an_unknown_mount_is_named(folder):
    toml = folder / "platform.toml"
    mount = '[[mounts]]\nname = "XXM"\ndescription = "x"\ntransfer_axes = ["x"]\n'
    bracket = f"bracket_stiffness_n_per_mm = {{engine = {STIFF}}}\n\n"
    text = toml.read_text().replace("[[mounts]]", f"{mount}{bracket}[[mounts]]", 1)
    toml.write_text(text)
    with pytest.raises(InputError, match=r"no row for mount 'XXM', piece '': add its position"):
        read_platform(folder)


def test_receptances_and_driving_points_hold_the_bracket_of_the_body(tmp_path):
    folder = write_platform(
        tmp_path / "p", 1, groups=("U06-1",), load_cases=RUN, driving_points=True
    )
    stated(folder, "EnM", f"{{body = {STIFF}}}")
    with pytest.raises(InputError, match=r"mount EnM has a bracket of the body.* vehicle U06-1"):
        read_platform(folder)
