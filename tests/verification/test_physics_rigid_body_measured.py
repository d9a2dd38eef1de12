"""Mass properties against published mass matrices and measured swing tests (tests/data)."""

import json
from pathlib import Path

import numpy as np
import pytest

from deboom.physics.mass_properties import mass_properties
from deboom.physics.rigid_body import mass_matrix, rigid_body_modes, rotation_matrix

DATA = Path(__file__).parents[1] / "data"
PLATFORMS = json.loads((DATA / "benchmarks" / "benchmarks.json").read_text(encoding="utf-8"))[
    "rigid_mass_matrix_to_cg"
]["cases"]


@pytest.mark.parametrize(
    ("name", "mass"), [("OC3spar", 8089512.566), ("VolturnUS-S", 19118682.559)]
)
def test_published_mass_matrix_gives_the_printed_centre_of_gravity(name, mass):
    matrix = np.array(PLATFORMS[name]["M_struc"])
    body = mass_properties(matrix)
    assert body.mass == pytest.approx(mass, abs=1e-3)
    np.testing.assert_allclose(body.centre, PLATFORMS[name]["rCG"], rtol=1e-12, atol=1e-12)
    assert np.all(np.linalg.eigvalsh(body.inertia) > 0)
    np.testing.assert_allclose(
        mass_matrix(body.mass, body.inertia, body.centre), matrix, rtol=1e-12, atol=1e-4
    )


def read(name):
    """Value and standard deviation of each line ``key = value+/-deviation``."""
    numbers = {}
    for line in (DATA / "bicycle-inertia" / name).read_text(encoding="utf-8").splitlines():
        key, _, text = line.partition("=")
        value, _, deviation = text.partition("+/-")
        numbers[key.strip()] = (float(value), float(deviation or 0))
    return numbers


def period(inertia, rate):
    """Of one degree of freedom [s]."""
    frequency, _ = rigid_body_modes([[inertia]], [[rate]])
    return 1 / frequency[0]


@pytest.fixture(params=["Browser", "Pista"])
def bicycle(request):
    measured = {key: value for key, (value, _) in read(f"{request.param}Measured.txt").items()}
    printed = {key: value for key, (value, _) in read(f"{request.param}Benchmark.txt").items()}
    radius, length = measured["dP"] / 2, measured["lP"]
    rod = measured["mP"] / 12 * (3 * radius**2 + length**2)
    wire = rod * (2 * np.pi / measured["TtP1"]) ** 2  # torsional rate, from a rod of known inertia
    return measured, printed, wire


def test_wheel_on_a_knife_edge_swings_with_its_measured_period(bicycle):
    """Parallel axes: inertia at the pivot from the 6×6 matrix, gravity as the spring."""
    measured, printed, _ = bicycle
    mass, arm, g = measured["mF"], measured["lF"], measured["g"]
    about_centre = np.diag([printed["IFxx"], printed["IFyy"], printed["IFxx"]])
    at_pivot = mass_matrix(mass, about_centre, [0, 0, arm])
    assert period(at_pivot[4, 4], mass * g * arm) == pytest.approx(measured["TcF1"], rel=1e-8)


def test_wheel_on_a_wire_swings_with_its_measured_period(bicycle):
    measured, printed, wire = bicycle
    assert period(printed["IFxx"], wire) == pytest.approx(measured["TtF1"], rel=1e-8)


@pytest.mark.parametrize("hanging", [1, 2, 3])
def test_frame_on_a_wire_swings_with_its_measured_periods(bicycle, hanging):
    """The tensor, product included, turned into three attitudes: sign and sense of the rotation."""
    measured, printed, wire = bicycle
    tensor = np.array(
        [
            [printed["IBxx"], 0, printed["IBxz"]],
            [0, printed["IByy"], 0],
            [printed["IBxz"], 0, printed["IBzz"]],
        ]
    )
    attitude = printed["lam"] - np.radians(measured[f"alphaB{hanging}"])
    turn = rotation_matrix([0.0, attitude, 0.0])
    seen = measured[f"TtB{hanging}"]
    assert period((turn.T @ tensor @ turn)[0, 0], wire) == pytest.approx(seen, rel=1e-8)
    assert period((turn @ tensor @ turn.T)[0, 0], wire) != pytest.approx(seen, rel=1e-3)
