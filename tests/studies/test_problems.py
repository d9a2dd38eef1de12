"""deboom's searches as problems of pymoo: the same numbers as the studies, for any algorithm."""

from dataclasses import replace

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

import deboom
from deboom.bench.choices import CalibrationLevel
from deboom.bench.electric_car_writer import write_electric_car
from deboom.compressor.cabin_index import MountStatics
from deboom.files.catalogue import platform_catalogue

SMALL = {"vehicles": "U06", "band": (24, 30), "draws": 16}


@pytest.fixture(scope="module")
def platform():
    return deboom.read_platform("u06")


def test_the_objectives_are_those_of_a_search_and_nominal_is_the_level_of_the_design(platform):
    model = platform.model("U06", band=(24, 30))
    robust = deboom.Robust(model, model.design_space(), draws=16)
    designs = robust.space.lower + 0.3 * np.arange(3)[:, None] * robust.space.tolerance
    evaluated = deboom.BoomingProblem(platform, **SMALL).evaluate(
        designs, return_as_dictionary=True
    )
    assert np.array_equal(evaluated["F"], robust(designs).objectives)
    literal = deboom.BoomingProblem(platform, nominal=True, **SMALL).evaluate(
        designs, return_values_of=["F"]
    )
    assert literal[:, 0] == pytest.approx(model(designs).sum(axis=1), rel=1e-12)
    assert np.array_equal(literal[:, 1], evaluated["F"][:, 1])
    every = deboom.BoomingProblem(platform, band=(24, 30), draws=16)
    assert every.robust.evaluate.response_names == platform.fleet.names
    with pytest.raises(deboom.InputError, match="vehicle"):
        deboom.BoomingProblem(platform, vehicles="U66")


def test_any_algorithm_chooses_whole_parts(platform):
    problem = deboom.CatalogueProblem(platform, motion="prescribed", retuning=0.0, **SMALL)
    result = minimize(problem, NSGA2(8), ("n_gen", 3), seed=1)
    assert np.array_equal(result.pop.get("X"), np.rint(result.pop.get("X")))
    today = problem.evaluate(problem.robust.space.nominal, return_values_of=["F"])
    assert result.F[:, 0].min() < today[0]
    parts = problem.parts(result.X[np.argmin(result.F[:, 0])])
    assert set(parts) == {"EnM", "GeM", "TSM", "Du"}
    assert not all("today's" in part for part in parts.values())


def test_parts_of_a_catalogue_stand_as_the_mounts_of_the_vehicle(platform):
    tilted = [replace(m, rotations=((0.0, 0.5, 0.0),) * len(m.pieces)) for m in platform.mounts]
    catalogue = platform_catalogue(replace(platform, mounts=tuple(tilted)), None)
    standing = {m.name: m.rotations for m in tilted}
    parts = [(name, part) for name, parts in catalogue.parts.items() for part in parts]
    assert len(parts) > len(standing)
    assert all(part.mount.rotations == standing[name] for name, part in parts)


@pytest.mark.slow("measures a car and identifies its compressor")
def test_a_softer_compressor_mount_is_quieter_until_it_travels_too_far(tmp_path):
    folder = write_electric_car(tmp_path / "car", 1, "EV-1", None, CalibrationLevel.C2)
    car = deboom.read_electric_car(folder)
    problem = deboom.CompressorProblem(car, line_step=20.0, draws=8, place_tolerance=0.0)
    np.testing.assert_array_equal(problem.robust.evaluate.frequency, np.arange(20, 141, 20))
    space = problem.robust.space
    soft = np.where(space.upper > space.lower, 0.75, 1.0)
    evaluated = problem.evaluate(
        np.stack([space.nominal, soft, space.lower]), return_as_dictionary=True
    )
    assert evaluated["F"][1, 0] < evaluated["F"][0, 0]
    statics = problem.robust.limits.limits[0].number.response
    assert isinstance(statics, MountStatics)
    travel = statics(np.stack([space.nominal, soft, space.lower]))[:, 0]
    assert np.array_equal(evaluated["G"][:, 1] > 0.0, travel > 1.2 * travel[0])
    assert (evaluated["G"][0] < 0.0).all()
    for changes, message in (({"band": (0.0, 20.0)}, "rises from above"), ({"cars": []}, "no car")):
        with pytest.raises(deboom.InputError, match=message):
            deboom.CompressorProblem(**{"cars": car, **changes})
