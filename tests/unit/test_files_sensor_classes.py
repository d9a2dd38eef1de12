"""Folders without tolerances: defaults by class of sensor are said, and widen intervals."""

import json
import re
import shutil
import warnings
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from deboom.bench.campaign import CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.choices import CalibrationLevel
from deboom.bench.compressor_rig import placement_errors
from deboom.bench.compressor_writer import tolerance_section, write_compressor_test
from deboom.compressor.hammer_identification import identify
from deboom.compressor.identified_compressor import IdentifyOptions
from deboom.errors import DataWarning, InputError
from deboom.files.campaign import ToleranceEntry, read_campaign
from deboom.files.check import check_folder
from deboom.files.inertance_test import ToleranceSection, read_inertance_test
from deboom.files.platform import read_platform
from deboom.files.schema import values_of
from deboom.files.sensor_classes import completed
from deboom.measurement.sensor_classes import CLASS_DEFAULTS
from deboom.measurement.sensors import PlacementTolerances, Tolerances
from deboom.mounts.characterise import characterise
from deboom.mounts.characterised_mount import ASSUMED
from deboom.pages.motion import report_runs
from deboom.report import Report
from deboom.runs.runner import load_study, run_study
from samples.campaign_runs import SEVEN_RUNS

GUIDE = Path(__file__).parents[2] / "docs" / "guides" / "your-own-data.md"
PLAN = CampaignPlan(("M1",), SEVEN_RUNS, 2, frequency=np.linspace(20.0, 80.0, 41))


def without(folder, copy, *sections, name="campaign.toml"):
    """Copy a folder and take sections out of its file."""
    shutil.copytree(folder, copy)
    text = (copy / name).read_text(encoding="utf-8")
    for section in sections:
        text, count = re.subn(rf"^\[{section}\]\n(?:(?!\[).*\n)*", "", text, flags=re.M)
        assert count == 1
    (copy / name).write_text(text, encoding="utf-8")
    return copy


@pytest.fixture(scope="module")
def stated(tmp_path_factory):
    return write_campaign(tmp_path_factory.mktemp("campaign") / "stated", 1, PLAN)


@pytest.fixture(scope="module")
def light(stated, tmp_path_factory):
    """Return the same campaign without tolerances and without the powertrain."""
    return without(stated, tmp_path_factory.mktemp("light") / "light", "tolerances", "powertrain")


def test_no_default_is_narrower_than_what_laboratories_state():
    names = {field.name for kind in (Tolerances, PlacementTolerances) for field in fields(kind)}
    assert set(CLASS_DEFAULTS) == names
    least = vars(Tolerances()) | {"sensor_gain": 0.0}
    worst = values_of(tolerance_section(CalibrationLevel.C3))
    assert placement_errors(CalibrationLevel.C3).gain == worst["sensor_gain"] == 0.03
    for name, default in CLASS_DEFAULTS.items():
        assert default.value >= max(least.get(name, 0.0), worst.get(name, 0.0)), name
        assert default.reason


def test_the_guide_lists_every_default():
    text = GUIDE.read_text(encoding="utf-8")
    factors = {"mm": 1e3, "°": 180 / np.pi, "%": 100.0, "N m": 1.0, "N": 1.0, "m/s²": 1.0}
    rows = re.findall(r"^\| (.+) \| `(\w+)` \| ([\d.]+) (\S+(?: m)?) \| (.+) \|$", text, flags=re.M)
    listed = {
        name: (sensor, float(value) / factors[unit], why) for sensor, name, value, unit, why in rows
    }
    assert list(listed) == list(CLASS_DEFAULTS)
    for name, default in CLASS_DEFAULTS.items():
        sensor, value, why = listed[name]
        assert (sensor, why) == (default.sensor, default.reason)
        assert value == pytest.approx(default.value, rel=5e-3)


@pytest.mark.parametrize("section", [ToleranceEntry, ToleranceSection])
def test_what_is_stated_stays_and_what_is_not_is_said(section):
    keys = list(section.model_fields)
    whole = section(**dict.fromkeys(keys, 0.01))
    assert completed(whole, "a.toml") == (whole, ())
    filled, (words,) = completed(section(**{keys[0]: 0.01}), "a.toml")
    assert getattr(filled, keys[0]) == 0.01
    assert words.startswith(f"{len(keys) - 1} tolerances are defaults of their sensors' classes")
    assert words.endswith("state what you know in [tolerances] of a.toml.")
    said = dict(re.findall(r"(\w+) = ([\d.]+)", words))
    assert list(said) != keys
    assert {key: float(value) for key, value in said.items()} == {
        key: pytest.approx(getattr(filled, key), rel=1e-2) for key in keys[1:]
    }
    stated_alone = section(**dict.fromkeys(keys[1:], 0.01))
    _, (words,) = completed(stated_alone, "a.toml")
    assert words.startswith("1 tolerance is a default of its sensor's class")


def test_a_light_campaign_gives_wider_intervals_and_says_why(stated, light):
    told = read_campaign(light)
    assert told.mass_matrix is None
    assert len(told.assumed) == 2
    assert told.assumed[0].startswith("15 tolerances are defaults")
    assert "no [powertrain]" in told.assumed[1]
    assert read_campaign(stated).assumed == ()
    narrow, wide = (
        characterise(read_campaign(folder), "M1").directions for folder in (stated, light)
    )
    assert list(narrow) == list(wide)
    for name, direction in narrow.items():
        assert direction.budget.half_width_95 < wide[name].budget.half_width_95, name
    # rough, but of use
    assert sum(direction.budget.identified for direction in wide.values()) >= 4


def test_checks_say_what_is_assumed(stated, light):
    faults, waiting, summary = check_folder(light)
    assert (faults, waiting) == ((), ())
    assert len(re.findall("^ASSUMED  ", summary, flags=re.M)) == 2
    assert "ASSUMED" not in check_folder(stated)[2]


def test_page_and_record_of_a_light_campaign_name_the_defaults(
    light, tmp_path, few_chains, no_pictures
):
    folder = run_study(load_study("mount_characterisation"), tmp_path, {"campaign": light})
    page = (folder / "report.html").read_text(encoding="utf-8")
    before = page.partition("Before you trust these numbers")[2]
    assert "15 tolerances are defaults" in before
    assert "states no [powertrain]" in before
    facts = json.loads((folder / "run.json").read_text(encoding="utf-8"))["facts"]
    assert "sensor_gain = 0.0346" in facts["assumed"]
    assert "[powertrain]" in facts["assumed"]


def test_mounts_in_a_library_carry_their_defaults_to_the_pages_of_a_platform(light, few_chains):
    (mount, *_) = characterise(read_campaign(light), "M1").mounts
    assumed = [each.settings[ASSUMED] for each in mount.directions if each.surface is not None]
    assert assumed
    assert all("15 tolerances are defaults" in sentence for sentence in assumed)
    platform = read_platform("u06")
    first, *others = platform.library
    directions = [
        replace(each, settings={**each.settings, ASSUMED: assumed[0]}) for each in first.directions
    ]
    marked = replace(platform, library=(replace(first, directions=tuple(directions)), *others))
    with pytest.warns(DataWarning, match="rest on defaults"):
        runs = marked.runs()
    page = Report("A platform", "Is it quiet?")
    report_runs(page, runs)
    assert [sentence for sentence in page.warnings if "rest on defaults" in sentence]
    assert "15 tolerances are defaults" in page.facts["assumed"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert platform.runs().assumed == ()
    assert platform.runs(mounts="spectra").assumed == marked.runs(mounts="spectra").assumed == ()


def test_what_needs_the_powertrain_asks_for_it_by_name(light, stated):
    assert read_campaign(stated).needed_mass_matrix("this").shape == (6, 6)
    with pytest.raises(InputError, match=r"section \[powertrain\] with mass_kg"):
        read_campaign(light).needed_mass_matrix("the motion of the engine in a vehicle")


def test_a_compressor_without_tolerances_has_wider_deviations(tmp_path):
    folder = write_compressor_test(tmp_path / "stated", 1, CalibrationLevel.C2)
    rough = without(folder, tmp_path / "rough", "tolerances", name="compressor_test.toml")
    tests = [read_inertance_test(each) for each in (folder, rough)]
    assert tests[0].assumed == ()
    assert "6 tolerances are defaults" in tests[1].assumed[0]
    assert "ASSUMED" in check_folder(rough)[2]
    few = IdentifyOptions(largest_lines=24)
    narrow, wide = (
        np.sqrt(np.diag(identify(test, few).calibrated.parameter_covariance)) for test in tests
    )
    assert np.all(wide > 0.98 * narrow)
    assert np.median(wide / narrow) > 1.1
