"""Noise transfer functions: virtual points, choosing paths, and what is refused."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.noise_transfer import (
    noise_transfer_at_points,
    noise_transfer_of_paths,
    reciprocal_noise_transfer,
)
from deboom.measurement.sensors import Impact
from deboom.measurement.virtual_point import impact_geometry

FREQUENCY = np.array([20.0, 30.0, 40.0])
EARS = ("driver ear", "passenger ear")
RNG = np.random.default_rng(4)


def frf(inputs, outputs=EARS, unit="Pa/N", frequency=FREQUENCY):
    shape = (frequency.size, len(outputs), len(inputs))
    values = RNG.normal(size=shape) + 1j * RNG.normal(size=shape)
    return Frf(frequency, values, outputs, tuple(inputs), unit)


def blows(n=3):
    places = [(0.05, 0.0, 0.01), (-0.03, 0.04, 0.0), (-0.02, -0.05, -0.02)][:n]
    return [
        Impact(f"I{k} {axis}", np.array(place), sign * np.eye(3)[number])
        for k, place in enumerate(places, 1)
        for number, (axis, sign) in enumerate(zip("xyz", (1, -1, 1), strict=True))
    ]


POINT = frf([f"TSM {load}" for load in ("x", "y", "z", "mx", "my", "mz")])


def around(geometry):
    """Return what blows around the point show of its six functions."""
    values = POINT.values @ geometry.forward.T
    return Frf(FREQUENCY, values, EARS, geometry.channels, "Pa/N")


def test_nine_blows_give_three_forces_and_three_moments():
    geometry = impact_geometry(blows(), (0.0, 0.0, 0.0))
    found = noise_transfer_at_points(around(geometry), {"TSM": geometry})
    assert found.inputs == POINT.inputs
    np.testing.assert_allclose(found.values, POINT.values, atol=1e-12)


def test_what_does_not_determine_a_point_is_refused():
    geometry = impact_geometry(blows(2), (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="show only 5 of 6 motions"):
        noise_transfer_at_points(around(geometry), {"TSM": geometry})
    with pytest.raises(InputError, match="no virtual point"):
        noise_transfer_at_points(POINT, {})
    three = impact_geometry(blows(), (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="no input named"):
        noise_transfer_at_points(POINT, {"TSM": three})


def test_an_uncalibrated_loudspeaker_is_refused():
    with pytest.raises(InputError, match="calibrate the loudspeaker's volume acceleration"):
        reciprocal_noise_transfer(frf(EARS, ("B1 x",), "(m/s^2)/V"))
    with pytest.raises(InputError, match="a noise transfer function is in Pa/N"):
        noise_transfer_of_paths(frf(["TSM x"], unit="Pa/mm"), {"TSM x": ["TSM x"]})


def test_a_path_of_two_pieces_is_per_newton_of_their_sum():
    points = frf(["TSM x", "Du left x", "Du right x"])
    paths = {"TSM x": ["TSM x"], "Du x": ["Du left x", "Du right x"]}
    found = noise_transfer_of_paths(points, paths, "passenger ear")
    assert found.outputs == ("passenger ear",)
    assert found.inputs == ("TSM x", "Du x")
    halves = 0.5 * (points.values[:, 1, 1] + points.values[:, 1, 2])
    np.testing.assert_allclose(found.values[:, 0, 1], halves)


def test_a_path_without_noise_transfer_function_is_refused():
    with pytest.raises(InputError, match=r"path 'EnM x' has no noise transfer function of"):
        noise_transfer_of_paths(POINT, {"EnM x": ["EnM x"]})
    with pytest.raises(InputError, match="any piece"):
        noise_transfer_of_paths(POINT, {"EnM x": []})
    with pytest.raises(InputError, match="no output named"):
        noise_transfer_of_paths(POINT, {"TSM x": ["TSM x"]}, "rear ear")
