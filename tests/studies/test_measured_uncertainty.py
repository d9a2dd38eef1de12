"""The study of measured uncertainty: what it says of a tiny search, and of a run."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from deboom.bench.layout import LOAD_CASES
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import uncertain_index
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import Motion, model_of_other_data
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.expected_change import CarMeasurement
from deboom.vehicles.uncertain_data import CALIBRATION, PATHS, MeasuredArrays
from pinned_pages import hold

STUDIES = Path(__file__).parents[2] / "studies"
STUDY = load_study("measured_uncertainty")
PLATFORM = STUDIES / "data" / "u06_f39_f45"
BUDGET = {"draws": 40, "generations": 2, "population": 8, "samples": 8}


def test_numbers_have_intervals_that_more_knowledge_never_widens(finished):
    hold(finished, "measured_uncertainty")
    for name in ("picks", "vehicles"):
        table = pd.read_csv(finished / f"{name}.csv")
        for low in table.filter(like=", from ["):
            assert np.all(table[low] <= table[low.replace(", from", ", to")])
    sources = pd.read_csv(finished / "sources.csv")
    assert sources["share of its variance [%]"].sum() == pytest.approx(100)
    # more knowledge never widens what it is about; cars that are known may give way more than most
    following = pd.read_csv(finished / "next.csv")
    in_cars = following["measurement"].isin([each.value for each in CarMeasurement])
    assert in_cars.sum() == len(CarMeasurement)
    columns = [column for column in following if column.endswith("± [dB]")]
    following = following[~in_cars]
    assert np.all(following[columns].iloc[1:] <= 1.005 * following[columns].iloc[0])


def test_cars_are_expected_to_differ_from_the_model_by_more_than_measurements_do(summary):
    low, expected, high = (
        summary[f"expected_change_db_mean{end}"] for end in ("_low", "", "_high")
    )
    assert low < expected < high
    assert high - low > 5 * summary["change_half_width_db"]


def test_the_designs_of_a_run_may_be_asked_about(tmp_path, monkeypatch):
    names = tuple(f"{m} {a}" for m in ("EnM", "GeM", "TSM", "Du") for a in "xyz")
    space = SimpleNamespace(names=names)
    front = SimpleNamespace(
        model=SimpleNamespace(space=space),
        designs=np.array([[0.9] * 12, [1.1] * 12]),
        front=SimpleNamespace(picks={"best-mean": 0}),
    )
    monkeypatch.setattr(STUDY.module, "compared_run", lambda *_: front)
    options = {**BUDGET, "front": tmp_path, "motion": Motion.prescribed}
    result = run_study(STUDY, tmp_path, options)

    picks = pd.read_csv(result / "picks.csv")
    assert picks["design"].tolist() == ["today's", "best-mean"]
    # all stiffnesses by 0.9: the level falls by 20 lg 0.9, and no error can change that
    assert picks["change [dB]"].iloc[1] == pytest.approx(20 * np.log10(0.9))
    assert picks["change, to [dB]"].iloc[1] == pytest.approx(20 * np.log10(0.9))
    # prescribed motion: the page says why, and no table pretends
    assert "no expected change, because" in (result / "report.html").read_text().lower()
    assert not (result / "expected.csv").exists()
    space.names = ("Rear x", *names[1:])
    with pytest.raises(InputError, match="take a front of the same mounts"):
        run_study(STUDY, tmp_path, options)


@pytest.mark.parametrize(
    ("motion", "factor", "loss_factors"),
    [
        (Motion.prescribed, Factor.dynamic, True),
        (Motion.amplitude, Factor.dynamic, False),
        (Motion.coupled, Factor.part, False),
    ],
)
def test_every_model_of_the_motion_is_built_again(motion, factor, loss_factors):
    platform = read_platform(PLATFORM)
    runs = platform.runs(fleet=platform.fleet.group("U06"), band=(25, 30))
    index = runs.model(motion, factor, loss_factors=loss_factors)
    uncertain = uncertain_index(index, runs.platform, runs.parts)
    designs = np.ones((2, len(index.variable_names)))
    designs[1, 6] = 0.9

    (fleet, cases), data = uncertain.data.measured, runs.platform
    same = model_of_other_data(index, fleet, data.mounts, data.powertrain, cases)
    again = uncertain.again(0, seed=1)

    assert (again.motion, again.factor) == (index.motion, index.factor)
    assert again.variable_names == index.variable_names
    assert np.allclose(same(designs), index(designs), atol=1e-8)
    moved = (again(designs) - index(designs)) / index.n_lines
    assert np.all(np.abs(moved[0]) > 1e-3)
    assert np.all(np.abs(moved[1] - moved[0]) < np.abs(moved).max())


def test_vehicles_measured_in_two_ways_replace_the_priors(tmp_path):
    folders = [
        write_vehicle(tmp_path / name, seed, name, load_cases=LOAD_CASES[:1], accelerance=False)
        for seed, name in ((2, "U06-1"), (3, "U06-2"), (4, "U06-3"))
    ]

    fleet, files = STUDY.module.measured_transfer(folders, None, (20.0, 60.0), averaged=False)
    mean, _ = STUDY.module.measured_transfer(folders, "driver ear", (20.0, 60.0), averaged=True)

    assert {source.origin for source in fleet} == {"both methods in U06-1, U06-2, U06-3"}
    ones = np.ones((1, 3, 2), dtype=complex)
    data = MeasuredArrays(
        frequency=np.arange(3.0),
        transfer=ones,
        transfer_around=ones.real,
        displacement=np.empty(0),
        force=np.empty(0),
        paths=(),
        channels=(),
        vehicle_of=np.array([0]),
        floor=np.full((1, 3), np.nan),
    )
    drawn = [
        {s.name: s.measured_again(data, np.random.default_rng(1)).transfer for s in sources}
        for sources in (fleet, mean)
    ]
    level = [20 * np.log10(np.abs(again[CALIBRATION])) for again in drawn]
    place = [again[PATHS] - 1 for again in drawn]
    assert level[0] == pytest.approx(np.sqrt(2) * level[1])
    assert place[0] == pytest.approx(np.sqrt(2) * place[1])
    # the bench: microphone 0.2 dB, hammer 0.1 dB; loudspeaker 0.5 dB; 3 vehicles tell little
    sizes = {source.name: float(source.size.split()[0]) for source in fleet}
    assert 0.05 < sizes[CALIBRATION] < 1.2
    assert 0.2 < sizes[PATHS] < 20.0
    assert folders[0] / "vehicle.toml" in files
    assert STUDY.module.measured_transfer([], None, (20.0, 60.0), averaged=False) == (None, ())
