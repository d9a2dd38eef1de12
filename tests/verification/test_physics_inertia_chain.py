"""Swing tests of two bicycles (tests/data/bicycle-inertia): periods → inertias, as printed.

The forward chain of the authors with the functions of the house; the way back, from the printed
inertias to the periods, stands in test_physics_rigid_body_measured.py.
"""

from pathlib import Path

import numpy as np
import pytest

from deboom.compressor.gain import GainFactor
from deboom.compressor.model import CompressorModel
from deboom.errors import InputError
from deboom.physics.mass_properties import mass_properties
from deboom.physics.rigid_body import mass_matrix, rotation_matrix

DATA = Path(__file__).parents[1] / "data" / "bicycle-inertia"
PRINTED = 1e-9  # twelve digits are printed
STEP = 1e-5  # of the differences that propagate the deviations, in standard deviations


def read(name):
    """Value and standard deviation of each line ``key = value+/-deviation``."""
    numbers = {}
    for line in (DATA / name).read_text(encoding="utf-8").splitlines():
        key, _, text = line.partition("=")
        value, _, deviation = text.partition("+/-")
        numbers[key.strip()] = (float(value), float(deviation or 0))
    return numbers


def swing(period):
    """Rate over inertia of an oscillator [1/s²]."""
    return (2 * np.pi / period) ** 2


def wire_rate(m):
    """Of the torsion wire, from a rod of known inertia [N m/rad]."""
    return m["mP"] / 12 * (3 * (m["dP"] / 2) ** 2 + m["lP"] ** 2) * swing(m["TtP1"])


def wheel(m, which):
    """Inertia about diameter and axle of front (F) or rear (R) wheel."""
    mass, arm = m[f"m{which}"], m[f"l{which}"]
    at_pivot = mass * m["g"] * arm / swing(m[f"Tc{which}1"])
    # parallel axes: what a point mass at the arm adds to the 6×6 matrix at the pivot
    carried = mass_matrix(mass, np.zeros((3, 3)), [0, 0, arm])[4, 4]
    return wire_rate(m) / swing(m[f"Tt{which}1"]), at_pivot - carried


def tensor(m, which, tilt):
    """Ixx, Ixz, Izz of frame (B) or fork (H) from three attitudes on the wire."""
    rows, seen = [], []
    for number in (1, 2, 3):
        turn = rotation_matrix([0.0, tilt - np.radians(m[f"alpha{which}{number}"]), 0.0])
        axis = turn[:, 0]  # the wire, in the axes of the part
        rows.append([axis[0] ** 2, 2 * axis[0] * axis[2], axis[2] ** 2])
        seen.append(wire_rate(m) / swing(m[f"Tt{which}{number}"]))
    return np.linalg.solve(rows, seen)


def tilt(m):
    """Steer axis tilt [rad]."""
    return np.pi / 2 - np.radians(m["gamma"])


def chain(m):
    """All inertias of the printed sheet that follow from masses, levers and periods [kg m²]."""
    fxx, fyy = wheel(m, "F")
    rxx, ryy = wheel(m, "R")
    bxx, bxz, bzz = tensor(m, "B", tilt(m))
    hxx, hxz, hzz = tensor(m, "H", tilt(m))
    return {
        "lam": tilt(m),
        "IFxx": fxx,
        "IFyy": fyy,
        "IRxx": rxx,
        "IRyy": ryy,
        "IBxx": bxx,
        "IBxz": bxz,
        "IBzz": bzz,
        "IHxx": hxx,
        "IHxz": hxz,
        "IHzz": hzz,
    }


@pytest.mark.parametrize("bicycle", ["Browser", "Pista"])
def test_inertias_from_periods_meet_the_printed_results(bicycle):
    measured = {key: value for key, (value, _) in read(f"{bicycle}Measured.txt").items()}
    printed = read(f"{bicycle}Benchmark.txt")
    for name, value in chain(measured).items():
        assert value == pytest.approx(printed[name][0], rel=PRINTED), name


@pytest.mark.parametrize("bicycle", ["Browser", "Pista"])
def test_standard_deviations_meet_the_printed_results(bicycle):
    """Linear propagation of all stated deviations, by differences; printed by another program."""
    sheet = read(f"{bicycle}Measured.txt")
    values = {key: value for key, (value, _) in sheet.items()}
    variance = dict.fromkeys(chain(values), 0.0)
    for key, (value, deviation) in sheet.items():
        if deviation == 0:
            continue
        up = chain(values | {key: value + STEP * deviation})
        down = chain(values | {key: value - STEP * deviation})
        for name in variance:
            variance[name] += ((up[name] - down[name]) / (2 * STEP)) ** 2
    printed = read(f"{bicycle}Benchmark.txt")
    for name, squared in variance.items():
        assert np.sqrt(squared) == pytest.approx(printed[name][1], rel=1e-4), name


def frame(bicycle):
    """Return the printed values, and tensor and centre of gravity of the frame."""
    printed = {key: value for key, (value, _) in read(f"{bicycle}Benchmark.txt").items()}
    inertia = np.array(
        [
            [printed["IBxx"], 0, printed["IBxz"]],
            [0, printed["IByy"], 0],
            [printed["IBxz"], 0, printed["IBzz"]],
        ]
    )
    return printed, inertia, np.array([printed["xB"], 0, printed["zB"]])


@pytest.mark.parametrize("bicycle", ["Browser", "Pista"])
def test_printed_frame_is_carried_to_another_point_and_back(bicycle):
    """Parallel axes in three dimensions."""
    printed, inertia, centre = frame(bicycle)
    body = mass_properties(mass_matrix(printed["mB"], inertia, centre))
    np.testing.assert_allclose(body.centre, centre, rtol=PRINTED, atol=1e-15)
    np.testing.assert_allclose(body.inertia, inertia, rtol=PRINTED, atol=1e-14)


def test_measured_frame_of_the_browser_is_no_possible_body():
    """A flat frame has Iyy = Ixx + Izz at most; swung apart from each other, they miss by 2 %."""
    printed, inertia, centre = frame("Browser")
    assert printed["IByy"] == pytest.approx(printed["IBxx"] + printed["IBzz"], rel=0.025)
    gain = GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5])
    with pytest.raises(InputError, match="no body has the principal moments"):
        CompressorModel(printed["mB"], centre, inertia, np.eye(6), gain)
    printed, inertia, centre = frame("Pista")
    possible = CompressorModel(printed["mB"], centre, inertia, np.eye(6), gain)
    np.testing.assert_allclose(mass_properties(possible.mass_matrix).inertia, inertia, rtol=1e-9)
