"""Elastic centre and reduction of a mount on a beam in closed form (thesis, figures 5 and 6).

A straight Euler-Bernoulli beam along x from its end A (x = 0) to its end B (x = L), of the exact
element that `test_viscoelastic_beam` holds against closed forms and finite elements.
"""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.elastic_centre import (
    centre_of_compliance,
    centre_of_stiffness,
    dynamic_centre_of_compliance,
    dynamic_centre_of_stiffness,
    dynamic_coupling,
    reduce_mount,
    reduction_error_in_operation,
    residual_coupling,
)
from deboom.physics.rigid_body import mass_matrix, mount_stiffness_matrix
from deboom.physics.viscoelastic_beam import ViscoelasticBeam, beam_stiffness

EXACT = 1e-10
LENGTH = 0.08  # [m]
AXIAL, TORSION, BENDING = 2.4e4, 11.0, 9.0  # EA [N], GJ and EI [N m²]
LINE_MASS, LINE_INERTIA = 1.9, 6e-4  # [kg/m], [kg m]
FREQUENCY = np.array([5.0, 20.0, 60.0, 140.0])
OMEGA = 2 * np.pi * FREQUENCY
LOSS = 1 + 0.1j


def beam(lines, loss=1e-15):
    """12×12 dynamic stiffness, motions of A then B: x y z rx ry rz."""
    radius = np.sqrt(LINE_INERTIA / LINE_MASS)
    element = ViscoelasticBeam(LENGTH, AXIAL, TORSION, BENDING, LINE_MASS, loss, radius)
    return beam_stiffness(element, lines)


STATIC = beam([1e-6])[0].real
CLAMPED = STATIC[:6, :6]  # B held: figure 5, loads at A


@pytest.mark.parametrize("centre", [centre_of_stiffness, centre_of_compliance])
def test_elastic_centre_of_a_clamped_beam_is_its_middle(centre):
    """12×12 → 6×6 by holding one end; fully diagonal at the middle, as figure 5 promises."""
    computed = centre(CLAMPED)
    np.testing.assert_allclose(computed.position, [LENGTH / 2, 0, 0], atol=1e-12)
    diagonal = [
        AXIAL / LENGTH,
        12 * BENDING / LENGTH**3,
        12 * BENDING / LENGTH**3,
        TORSION / LENGTH,
        BENDING / LENGTH,
        BENDING / LENGTH,
    ]
    np.testing.assert_allclose(computed.stiffness, np.diag(diagonal), atol=1e-8)
    assert computed.coupling < 1e-7
    assert residual_coupling(CLAMPED) == pytest.approx(np.sqrt(3) / 2, rel=1e-9)


def test_force_and_moment_at_the_centre_give_a_pure_motion_each():
    """Figure 6, by the tip deflections of a cantilever: F L³/3EI − M L²/2EI and so on."""
    compliance = np.linalg.inv(CLAMPED)
    middle = np.array([LENGTH / 2, 0, 0])
    # a: force along y at the rigid extension of A to the middle
    tip = compliance @ [0, 100.0, 0, *np.cross(middle, [0, 100.0, 0])]
    at_middle = tip[:3] + np.cross(tip[3:], middle)
    assert np.max(np.abs(tip[3:])) * LENGTH < EXACT * np.abs(at_middle[1])
    assert at_middle[1] == pytest.approx(100 * LENGTH**3 / (12 * BENDING), rel=1e-9)
    # b: moment about z
    tip = compliance @ [0, 0, 0, 0, 0, 3.0]
    at_middle = tip[:3] + np.cross(tip[3:], middle)
    assert tip[5] == pytest.approx(3.0 * LENGTH / BENDING, rel=1e-9)
    assert np.max(np.abs(at_middle)) < EXACT * np.abs(tip[5]) * LENGTH


def test_dynamic_elastic_centre_of_a_clamped_beam():
    """With its own mass the centre leaves the middle: k₁₂/k₁₁ of the plane, in closed form."""
    beta = (LINE_MASS * OMEGA**2 / BENDING) ** 0.25
    sin, cos = np.sin(beta * LENGTH), np.cos(beta * LENGTH)
    sinh, cosh = np.sinh(beta * LENGTH), np.cosh(beta * LENGTH)
    distance = sin * sinh / (sin * cosh + cos * sinh) / beta
    for find in (dynamic_centre_of_stiffness, dynamic_centre_of_compliance):
        computed = find(beam(FREQUENCY)[:, :6, :6] * LOSS)
        np.testing.assert_allclose(computed.position[:, 0], distance, rtol=1e-9)
        np.testing.assert_allclose(computed.position[:, 1:], 0, atol=1e-12)
        assert computed.coupling.max() < 1e-6
    assert distance[0] == pytest.approx(LENGTH / 2, rel=1e-3)
    assert np.all(np.diff(distance) > 0)
    assert distance[-1] > 1.005 * LENGTH / 2


def test_dynamic_centre_of_massless_mounts_is_the_static_one():
    """Loss factors alike move nothing; the coupling is that of the static stiffness."""
    rng = np.random.default_rng(2)
    stiffness = mount_stiffness_matrix(rng.normal(size=(4, 3)), rng.uniform(1, 3, (4, 3)) * 1e5)
    static = {
        dynamic_centre_of_stiffness: centre_of_stiffness(stiffness),
        dynamic_centre_of_compliance: centre_of_compliance(stiffness),
    }
    for find, static_centre in static.items():
        computed = find(stiffness * np.array([1.0, 1.3 + 0.2j])[:, np.newaxis, np.newaxis])
        np.testing.assert_allclose(
            computed.position, np.tile(static_centre.position, (2, 1)), rtol=1e-9
        )
        np.testing.assert_allclose(computed.coupling, static_centre.coupling, rtol=1e-6)


def test_dynamic_centre_of_a_mounted_body_goes_to_its_centre_of_gravity():
    """Springs alike in all directions: weighted mean of both points with weights k and −ω²m."""
    mass, rate = 50.0, 4e5
    springs, gravity = np.array([0.10, 0.02, -0.05]), np.array([-0.06, 0.04, 0.12])
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]) * 0.2
    stiffness = mount_stiffness_matrix(springs + corners, np.full((4, 3), rate / 4)) * LOSS
    body = mass_matrix(mass, np.diag([1.0, 1.5, 2.0]), gravity)
    frequency = np.array([0.1, 2.0, 25.0, 400.0])
    inertia = (2 * np.pi * frequency) ** 2
    computed = dynamic_centre_of_stiffness(stiffness - inertia[:, np.newaxis, np.newaxis] * body)
    # real least squares of (k − ω²m) r = k e − ω²m c with complex k
    lever = rate * LOSS - inertia * mass
    right = rate * LOSS * springs[:, np.newaxis] - (inertia * mass) * gravity[:, np.newaxis]
    expected = np.real(lever.conj() * right) / np.abs(lever) ** 2
    np.testing.assert_allclose(computed.position, expected.T, rtol=1e-8)
    np.testing.assert_allclose(computed.position[0], springs, atol=1e-4)
    np.testing.assert_allclose(computed.position[-1], gravity, atol=1e-3)


def test_beam_without_mass_reduces_to_one_point_exactly():
    matrices = np.stack([STATIC * LOSS] * 2)
    middle = LENGTH / 2
    mount = reduce_mount(matrices, [-middle, 0, 0], [middle, 0, 0], LENGTH)
    expected = CLAMPED.copy()
    expected = centre_of_stiffness(expected).stiffness * LOSS
    np.testing.assert_allclose(mount.one_point[0], expected, atol=1e-7)
    assert mount.condensation_error.max() < EXACT
    # what is left out: moments, the largest entry over the largest of all
    rotations = np.array([TORSION, BENDING, BENDING]) / LENGTH
    largest = max(np.abs(np.diag(expected)[:3]))
    np.testing.assert_allclose(
        mount.translation_error, rotations.max() / LENGTH**2 / largest * abs(LOSS), rtol=1e-9
    )


def test_away_from_the_centre_three_translations_cost_more():
    matrices = np.stack([STATIC * LOSS])
    at_centre = reduce_mount(matrices, [-LENGTH / 2, 0, 0], [LENGTH / 2, 0, 0], LENGTH)
    at_end = reduce_mount(matrices, [0, 0, 0], [LENGTH, 0, 0], LENGTH)
    assert at_end.condensation_error.max() < EXACT
    assert at_end.translation_error[0] > 3 * at_centre.translation_error[0]
    # a source that only moves to and fro feels neither step; one that turns about the end does
    shift, turn = np.zeros((1, 12), dtype=complex), np.zeros((1, 12), dtype=complex)
    shift[0, :3] = [1e-4, 2e-4, 1e-4]
    turn[0, 5] = 1e-3
    for errors in reduction_error_in_operation(at_centre, shift):
        assert errors.max() < EXACT
    turn[0, 1] = 1e-3 * LENGTH / 2
    assert reduction_error_in_operation(at_centre, turn)[1].max() < EXACT
    # F = 12 EI v/L³ + 6 EI φ/L² with v = φ L/2: half of it comes from the rotation left out
    assert reduction_error_in_operation(at_end, turn)[1][0] == pytest.approx(0.5, rel=1e-9)


def test_condensation_error_is_the_mass_of_the_rod():
    """Along the axis alone: own less transfer stiffness over both, in closed form."""
    matrices = np.zeros((FREQUENCY.size, 12, 12), dtype=complex)
    along = (slice(None), *np.ix_((0, 6), (0, 6)))
    matrices[along] = beam(FREQUENCY)[along]
    mount = reduce_mount(matrices, np.zeros(3), np.zeros(3), 1.0)
    wave = OMEGA * np.sqrt(LINE_MASS / AXIAL)
    transfer = AXIAL * wave / np.sin(wave * LENGTH)
    np.testing.assert_allclose(mount.translations[:, 0], transfer, rtol=1e-12)
    stiffness = AXIAL * wave / np.tan(wave * LENGTH)
    expected = (transfer - stiffness) / np.hypot(transfer, stiffness)
    np.testing.assert_allclose(mount.condensation_error, expected, rtol=1e-9)
    half = np.tan(wave * LENGTH / 2) * np.sin(wave * LENGTH)
    np.testing.assert_allclose(expected, half / np.hypot(1, np.cos(wave * LENGTH)), rtol=1e-9)
    # the source alone moves: transfer stiffness is what passes on, so nothing is lost
    motion = np.zeros((FREQUENCY.size, 12), dtype=complex)
    motion[:, 0] = 1e-4
    assert reduction_error_in_operation(mount, motion)[0].max() < EXACT


MOUNT = reduce_mount(STATIC[None], [-LENGTH / 2, 0, 0], [LENGTH / 2, 0, 0], LENGTH)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: reduce_mount(STATIC, np.zeros(3), np.zeros(3), 1.0), r"\(n_frequency, 12, 12\)"),
        (lambda: reduce_mount(STATIC[None], np.zeros(3), np.zeros(3), 0.0), "length is positive"),
        (lambda: reduce_mount(np.triu(STATIC)[None], np.zeros(3), np.zeros(3), 1.0), "reciprocal"),
        (lambda: dynamic_centre_of_stiffness(CLAMPED), "shape"),
        (lambda: dynamic_coupling(np.triu(CLAMPED)[None]), "not symmetric"),
        (lambda: dynamic_centre_of_stiffness(np.diag([1.0, 0, 0, 0, 0, 0])[None]), "one axis"),
        (lambda: dynamic_centre_of_compliance(np.diag([1.0, 0, 0, 0, 0, 0])[None]), "inverse"),
        (lambda: dynamic_coupling(np.diag([1.0, 0, 0, 0, 0, 0])[None]), "without an inverse"),
        (lambda: reduction_error_in_operation(MOUNT, np.ones((2, 12))), "twelve of both ends"),
        (lambda: reduction_error_in_operation(MOUNT, np.zeros((1, 12))), "passes no force"),
    ],
)
def test_what_has_no_centre_or_reduction_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()
