"""State of the rubber in cars: from the keys of a platform to what cars are expected to show."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.layout import LOAD_CASES
from deboom.bench.platform_writer import write_platform
from deboom.errors import InputError
from deboom.files.library_export import read_library_json
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import uncertain_index
from deboom.mounts.library_tables import from_document, to_document
from deboom.mounts.mount import RubberInCar

RUN = tuple(case for case in LOAD_CASES if case.name == "g5_wot220")
ALL = ("EnM", "GeM", "TSM", "Du")
STATED = """
[[rubber]]
mounts = ["EnM", "GeM", "TSM", "Du"]
test_temperature_c = 23.0
use_temperature_c = [40.0, 60.0]
stiffness_percent_per_k = [-1.2, -0.8]
source = "data sheet 12 of the supplier"
"""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("rubber") / "p"
    return write_platform(path, 1, groups=("U06-1", "U06-2"), load_cases=RUN)


@pytest.fixture
def folder(written, tmp_path):
    return shutil.copytree(written, tmp_path / "p")


def stated(folder, text=STATED, head=""):
    toml = folder / "platform.toml"
    toml.write_text(head + toml.read_text() + text)
    return folder


def model(folder):
    return read_platform(folder).model(mounts="spectra")


def change(folder):
    platform, index = read_platform(folder), model(folder)
    return uncertain_index(index, platform, ()).expected_change(np.full((1, 12), 0.9)).mean


def test_warm_rubber_is_a_factor_of_all_stiffnesses_under_the_same_load(written, folder):
    warm = model(stated(folder))
    # the middle of both ranges: 27 K times -1 % per kelvin
    softer = np.exp(-0.27)
    assert [mount.rubber.factor for mount in read_platform(folder).mounts] == pytest.approx(
        [softer] * 4
    )
    designs = np.random.default_rng(1).uniform(0.8, 1.2, (3, 12))
    np.testing.assert_allclose(warm(designs), model(written)(softer * designs), rtol=1e-12)


def test_a_stated_temperature_moves_the_expected_change_and_narrows_it(written, folder, tmp_path):
    as_tested = shutil.copytree(written, tmp_path / "as_tested")
    narrow = STATED.replace("[40.0, 60.0]", "[23.0, 23.0]")
    unknown, there, warm = (
        change(path) for path in (written, stated(as_tested, narrow), stated(folder))
    )
    assert there.high[0] - there.low[0] < unknown.high[0] - unknown.low[0]
    moved = [abs(float(each.expected[0] - unknown.expected[0])) for each in (there, warm)]
    assert moved[1] > 2.0 * moved[0]


def test_draws_have_all_mounts_as_warm_on_one_day():
    rubber = RubberInCar((-0.012, -0.008), (-10.0, 30.0))
    assert rubber.at(0.0, 0.0) == pytest.approx(np.exp(0.12))
    assert rubber.at(1.0, 1.0) == pytest.approx(np.exp(-0.24))
    assert rubber.factor == pytest.approx(np.exp(-0.10))


ROWS = """vehicle,mount set,EnM in the car over bench [1],TSM in the car over bench [1],taken over
U06-1,0,0.90,0.80,True
U06-2,0,0.81,0.88,True
F39-1,0,2.50,2.90,False
"""


def test_what_cars_say_of_their_mounts_is_taken_over(folder):
    (folder / "car_factors.csv").write_text(ROWS)
    platform = read_platform(stated(folder, "", 'car_factors = "car_factors.csv"\n'))
    rubber = {mount.name: mount.rubber for mount in platform.mounts}
    assert rubber["EnM"].factor == pytest.approx(np.sqrt(0.90 * 0.81))
    assert rubber["EnM"].spread == pytest.approx(np.log(0.90 / 0.81) / np.sqrt(2.0))
    assert rubber["GeM"] is None
    assert folder / "car_factors.csv" in platform.input_files
    both = STATED.replace('"GeM", ', "")
    with pytest.raises(InputError, match="both say how stiff EnM, TSM is in the car"):
        read_platform(stated(folder, both))
    for text, sentence in (
        (ROWS.replace("True", "False"), "no row was taken over"),
        (ROWS.replace("0.81", "-0.81"), "'EnM in the car over bench .1.' is 0 or less"),
        (ROWS.replace("0.81", "soft"), "soft"),
        ("vehicle\nU06-1\n", "taken over"),
    ):
        (folder / "car_factors.csv").write_text(text)
        with pytest.raises(InputError, match=sentence):
            read_platform(folder)


WRONG = (
    ("test_temperature_c", "test_temperature", "unknown key 'test_temperature' .* did you mean"),
    ("test_temperature_c = 23.0", "test_temperature_c = 296.0", "is it in K or °F"),
    ("[40.0, 60.0]", "[60.0, 40.0]", "state the lowest temperature in use, then the highest"),
    ("[-1.2, -0.8]", "[-0.012, -0.008]", "is it a share instead of per cent"),
    ("[-1.2, -0.8]", "[-0.8, -1.2]", "state the least and the largest change"),
    ('"Du"]', '"Du", "XXM"]', "names mount 'XXM', which is not among EnM, GeM, TSM, Du"),
    ('"Du"]', '"EnM"]', "two mounts of .*rubber.* are named 'EnM'"),
    (
        "stiffness_percent_per_k = [-1.2, -0.8]\n",
        "",
        "state stiffness_percent_per_k with its source, or name the library of another temperature",
    ),
)


@pytest.mark.parametrize(("old", "new", "sentence"), WRONG)
def test_a_state_that_does_not_fit_is_one_sentence(folder, old, new, sentence):
    assert STATED.count(old) == 1
    with pytest.raises(InputError, match=sentence) as caught:
        read_platform(stated(folder, STATED.replace(old, new)))
    assert len(str(caught.value).splitlines()) == 1


def test_a_library_keeps_the_temperature_of_its_campaign():
    campaigns, parts = read_library_json(read_platform("u06").library_file)
    plain = to_document(campaigns, parts)
    assert "test_temperature [°C]" not in plain["campaigns"][0]
    warm = replace(campaigns[0], test_temperature=31.5)
    document = to_document([warm], parts)
    assert document["campaigns"][0]["test_temperature [°C]"] == 31.5
    assert from_document(document)[0] == (warm,)


def at_another_temperature(folder, temperature, softer):
    """Write u06's library as it is, and once more with softer mounts at another temperature."""
    document = json.loads(read_platform("u06").library_file.read_text())
    (folder / "mounts.library.json").write_text(json.dumps(document))
    document["campaigns"][0]["test_temperature [°C]"] = temperature
    for mount in document["mounts"]:
        for direction in mount["directions"]:
            for part in ("real", "imag") if direction["surface"] else ():
                fit = direction["surface"]["arrays"][f"{part}_coefficients"]
                fit["values"] = [softer * value for value in fit["values"]]
    (folder / "warm.library.json").write_text(json.dumps(document))


MEASURED = STATED.replace("stiffness_percent_per_k = [-1.2, -0.8]\n", "").replace(
    'source = "data sheet 12 of the supplier"', 'other_library = "warm.library.json"'
)


def test_two_libraries_tell_the_change_per_kelvin(folder):
    at_another_temperature(folder, 63.0, softer=np.exp(-0.4))
    platform = read_platform(stated(folder, MEASURED))
    for mount in platform.mounts:
        # 40 K warmer
        np.testing.assert_allclose(mount.rubber.per_kelvin, -0.01, rtol=1e-9)
        assert mount.rubber.warmer == (17.0, 37.0)
    assert folder / "warm.library.json" in platform.input_files


@pytest.mark.parametrize("temperature", [None, 23.0])
def test_a_second_library_of_no_other_temperature_is_refused(folder, temperature):
    at_another_temperature(folder, temperature, softer=0.7)
    with pytest.raises(InputError, match="states no temperature other than the 23 °C"):
        read_platform(stated(folder, MEASURED))


def test_a_library_of_another_temperature_is_named(folder):
    u06 = read_platform("u06")
    document = json.loads(u06.library_file.read_text())
    document["campaigns"][0]["test_temperature [°C]"] = 30.0
    (folder / "mounts.library.json").write_text(json.dumps(document))
    fault = read_platform(stated(folder)).library_fault
    assert "at 30 °C, and [[rubber]] of platform.toml says 23 °C" in str(fault)
    document["campaigns"][0]["test_temperature [°C]"] = 23.0
    (folder / "mounts.library.json").write_text(json.dumps(document))
    assert read_platform(folder).library_fault is None
