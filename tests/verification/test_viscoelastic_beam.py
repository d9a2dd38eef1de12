"""Exact beam element against closed forms and against a chain of finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Chebyshev
from scipy.optimize import brentq

from deboom.errors import InputError
from deboom.physics.rigid_body import forward_matrix, rotation_matrix
from deboom.physics.viscoelastic_beam import (
    SERIES_BELOW,
    ViscoelasticBeam,
    beam_congruence,
    beam_stiffness,
    frame_along,
)

BEAM = ViscoelasticBeam(
    length=0.36,
    tension=2100.0,
    torsion=3.0,
    bending=4.4,
    line_mass=0.3,
    loss_factor=0.12,
    torsion_radius=0.0077,
)
LOSSLESS = replace(BEAM, loss_factor=1e-9)
BENDING = (1, 5, 7, 11)


def frequency_of(wave, beam=LOSSLESS):
    return (wave / beam.length) ** 2 * np.sqrt(beam.bending / beam.line_mass) / (2 * np.pi)


def root(function, near):
    return brentq(lambda line: function(line).real, 0.9 * near, 1.1 * near, xtol=1e-12)


def determinant(dofs, beam=LOSSLESS):
    def at(line):
        return np.linalg.det(beam_stiffness(beam, [line])[0][np.ix_(dofs, dofs)] / 1e3)

    return at


@pytest.mark.parametrize("number", [4.730040744862704, 7.853204624095838, 10.995607838001671])
def test_clamped_and_free_natural_frequencies(number):
    """Free: the receptance has a pole. Clamped: the stiffness. Both solve cos x cosh x = 1."""
    expected = frequency_of(number)
    # at the pole itself the stiffness is singular, too: the inverse is interpolated from beside it
    lines = expected * (1 + 0.03 * np.cos(np.pi * (np.arange(10) + 0.5) / 10))
    receptance = np.linalg.inv(beam_stiffness(LOSSLESS, lines)[:, *np.ix_(BENDING, BENDING)])
    smooth = Chebyshev.fit(lines, 1 / receptance[:, 0, 0].real, 9)
    (free,) = (z.real for z in smooth.roots() if abs(z / expected - 1) < 0.03 and z.imag == 0)
    assert free == pytest.approx(expected, rel=1e-8)
    pole = root(lambda line: 1 / beam_stiffness(LOSSLESS, [line])[0, 5, 11], expected)
    assert pole == pytest.approx(expected, rel=1e-8)


def test_cantilever_bar_and_shaft():
    bent = frequency_of(1.875104068711961)
    assert root(determinant((7, 11)), bent) == pytest.approx(bent, rel=1e-8)
    sound = np.sqrt(LOSSLESS.tension / LOSSLESS.line_mass)
    stretched = sound / (4 * LOSSLESS.length)
    assert root(determinant((6,)), stretched) == pytest.approx(stretched, rel=1e-8)
    shear = np.sqrt(LOSSLESS.torsion / LOSSLESS.line_mass) / LOSSLESS.torsion_radius
    twisted = shear / (4 * LOSSLESS.length)
    short = replace(LOSSLESS, torsion=LOSSLESS.torsion / 100)
    assert root(determinant((9,), short), twisted / 10) == pytest.approx(twisted / 10, rel=1e-8)


def test_reciprocal_and_passive():
    stiffness = beam_stiffness(BEAM, np.linspace(1, 400, 200))
    np.testing.assert_allclose(stiffness, np.swapaxes(stiffness, 1, 2), rtol=1e-12)
    scale = np.tile(np.repeat([1.0, 10.0], 3), 2)
    dissipated = stiffness.imag * np.outer(scale, scale)
    assert np.linalg.eigvalsh(dissipated).min() > -1e-9 * np.abs(dissipated).max()


def test_series_meets_the_closed_form():
    """Entry by entry, with consistent masses worth 4e-7 of an entry or more."""
    slow = frequency_of(SERIES_BELOW)
    below, above = beam_stiffness(LOSSLESS, slow * (1 + np.array([-1e-9, 1e-9])))
    np.testing.assert_allclose(below.real, above.real, rtol=2e-10)


@pytest.mark.parametrize("direction", [[-0.3, 0.5, 0.81], [0, 0, 2], [0, 0, -1], [1, 0, 0]])
def test_frame(direction):
    frame = frame_along(direction)
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-14)
    assert np.linalg.det(frame) == pytest.approx(1)
    np.testing.assert_allclose(frame[:, 0], np.asarray(direction) / np.linalg.norm(direction))


def test_congruence_is_that_of_points_and_keeps_the_energy():
    first, second, frame = [-0.07, 0.035, 0.05], [0.1, 0.0, -0.02], frame_along([-0.3, 0.5, 0.81])
    turn = beam_congruence(frame, first, second)
    np.testing.assert_allclose(turn[:3, :6], frame.T @ forward_matrix(first), atol=1e-15)
    np.testing.assert_allclose(turn[6:9, 6:], frame.T @ forward_matrix(second), atol=1e-15)
    np.testing.assert_allclose(turn[3:6, 3:6], frame.T, atol=1e-15)
    motion = np.random.default_rng(1).standard_normal(12)
    stiffness = beam_stiffness(BEAM, [60.0])[0]
    seen = turn.T @ stiffness @ turn
    assert motion @ seen @ motion == pytest.approx((turn @ motion) @ stiffness @ (turn @ motion))
    # a round beam does not care how its frame is turned about its axis
    other = frame @ rotation_matrix([0.7, 0.0, 0.0])
    again = beam_congruence(other, first, second)
    np.testing.assert_allclose(again.T @ stiffness @ again, seen, atol=1e-9)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (lambda: replace(BEAM, length=0.0), "length is 0.0: give a number above 0"),
        (lambda: replace(BEAM, bending=np.nan), "bending is nan"),
        (lambda: beam_stiffness(BEAM, [0.0, 10.0]), "above 0 Hz"),
        (lambda: beam_stiffness(BEAM, 10.0), "above 0 Hz"),
        (lambda: beam_stiffness(BEAM, [10.0, 3e4]), "shorter than an eighth"),
        (lambda: frame_along([0, 0, 0]), "direction"),
        (lambda: frame_along([1, 0]), "direction"),
    ],
)
def test_refused(what, words):
    with pytest.raises(InputError, match=words):
        what()
