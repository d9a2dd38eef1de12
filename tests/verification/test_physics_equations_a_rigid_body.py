"""Thesis, eq. 1-5, 14-28 and 39-44: the corrected form holds, the printed form fails.

The reference of each test is elementary mechanics written with cross products, energies and point
masses; it shares no code with the equations.
"""

import numpy as np
import pytest

from deboom.physics.elastic_centre import (
    centre_of_compliance,
    centre_of_stiffness,
    residual_coupling,
)
from deboom.physics.rigid_body import (
    forward_matrices,
    forward_matrix,
    mass_matrix,
    mount_stiffness_matrix,
    point_acceleration,
    rotation_matrix,
    shift_load,
    shift_matrix,
    shift_stiffness,
    skew,
)

EXACT = 1e-10

# thesis, table 11 (optimised mounts of the compressor), in m, rad and N/m; axial = local x
POSITIONS = 1e-3 * np.array(
    [[-155.92, 3.750, 19.98], [-19.44, -67.495, 77.98], [-8.46, 73.576, 82.34]]
)
ORIENTATIONS = rotation_matrix(
    np.radians([[-4.9, -4.9, 185.0], [2.5, 43.3, 87.5], [2.2, 131.5, 89.4]])
)
STIFFNESS = 1e3 * np.array([[29.9, 10.8, 12.2], [29.7, 12.9, 11.8], [29.2, 10.6, 10.3]])


def deviation(value, reference):
    return np.linalg.norm(value - reference) / np.linalg.norm(reference)


def spring_energy(motion):
    """Energy of the mounts under a body motion, by the travel along each of their axes."""
    translation, rotation = motion[:3], motion[3:]
    energy = 0.0
    for position, axes, stiffness in zip(POSITIONS, ORIENTATIONS, STIFFNESS, strict=True):
        travel = translation + np.cross(rotation, position)
        energy += 0.5 * sum(k * (axes[:, a] @ travel) ** 2 for a, k in enumerate(stiffness))
    return energy


def energy_hessian():
    """Second differences, exact for a quadratic form."""
    unit = np.eye(6)
    return np.array(
        [[(spring_energy(a + b) - spring_energy(a - b)) / 2 for a in unit] for b in unit]
    )


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def test_eq_2_lower_left_block_is_the_transpose_of_the_upper_right():
    stiffness = mount_stiffness_matrix(POSITIONS, STIFFNESS, ORIENTATIONS)
    printed = stiffness.copy()
    printed[3:, :3] = printed[:3, 3:]
    assert deviation(stiffness, energy_hessian()) < EXACT
    assert deviation(printed, energy_hessian()) > 0.01


def test_eq_3_motion_at_another_point(rng):
    e, motion = rng.normal(size=(2, 6))
    e = e[:3]
    at_e = np.concatenate([motion[:3] + np.cross(motion[3:], e), motion[3:]])
    assert deviation(shift_matrix(e) @ at_e, motion) < EXACT


def test_eq_5_load_and_stiffness_at_another_point(rng):
    """F_E = χᵀ F_O and K_E = χᵀ K_O χ; printed: χ F_O and χ⁻¹ K_O χ."""
    e = rng.normal(size=3)
    stiffness = energy_hessian()
    motion = rng.normal(size=6)
    load = stiffness @ motion
    motion_e = np.concatenate([motion[:3] + np.cross(motion[3:], e), motion[3:]])
    load_e = np.concatenate([load[:3], load[3:] - np.cross(e, load[:3])])
    chi = shift_matrix(e)

    assert deviation(shift_load(load, e), load_e) < EXACT
    assert deviation(chi @ load, load_e) > 0.1

    shifted = shift_stiffness(stiffness, e)
    printed = np.linalg.inv(chi) @ stiffness @ chi
    assert deviation(shifted @ motion_e, load_e) < EXACT
    assert deviation(printed @ motion_e, load_e) > 0.1
    assert deviation(shifted, shifted.T) < EXACT
    assert deviation(printed, printed.T) > 0.1


def test_eq_5_work_is_the_same_at_every_point(rng):
    e, motion, load = rng.normal(size=3), rng.normal(size=6), rng.normal(size=6)
    motion_e = np.linalg.solve(shift_matrix(e), motion)
    assert shift_load(load, e) @ motion_e == pytest.approx(load @ motion, rel=EXACT)


def test_elastic_centre_of_isotropic_springs_is_their_weighted_mean():
    """Springs equal in all directions are masses of statics: the centre is their centroid."""
    rates = np.array([1e5, 3e5, 2e5, 5e4])
    positions = np.array([[0.3, 0, 0], [0, 0.4, 0.1], [-0.2, 0.1, 0.3], [0, 0, -0.5]])
    stiffness = mount_stiffness_matrix(positions, np.repeat(rates[:, np.newaxis], 3, axis=1))
    for centre in (centre_of_stiffness(stiffness), centre_of_compliance(stiffness)):
        np.testing.assert_allclose(centre.position, np.average(positions, 0, rates), atol=1e-12)
        assert centre.coupling < EXACT


def test_elastic_centre_of_inclined_mounts_is_remote_and_gives_pure_translation():
    """Four mounts inclined like a pyramid: a force at the centre, above all of them, turns nothing.

    Height by hand: for a travel in y, two mounts push with k_r cos² + k_a sin² in y and, a distance
    b apart from the middle, with (k_a − k_r) sin cos in z; the other two with k_r in y.
    """
    tilt, b, radial, axial = np.radians(35.0), 0.3, 5e4, 3e5
    azimuth = np.arange(4) * np.pi / 2
    positions = b * np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=1)
    orientations = rotation_matrix(
        np.stack([0 * azimuth, np.full(4, -tilt), azimuth], axis=1)  # local z inwards and up
    )
    rates = np.tile([radial, radial, axial], (4, 1))
    stiffness = mount_stiffness_matrix(positions, rates, orientations)

    sine, cosine = np.sin(tilt), np.cos(tilt)
    height = b * (axial - radial) * sine * cosine
    height /= radial * (1 + cosine**2) + axial * sine**2
    for centre in (centre_of_stiffness(stiffness), centre_of_compliance(stiffness)):
        np.testing.assert_allclose(centre.position, [0, 0, height], atol=1e-12)
        assert centre.coupling < EXACT
    assert height > 0.1

    push = np.array([300.0, 1000.0, -200.0])
    motion = np.linalg.solve(stiffness, np.concatenate([push, np.cross([0, 0, height], push)]))
    assert np.max(np.abs(motion[3:])) < EXACT * np.max(np.abs(motion[:3]))


def test_section_2_3_2_not_every_stiffness_is_diagonalised_by_a_shift():
    """The thesis's own compressor keeps 5 % coupling at its best point, near both centres."""
    stiffness = mount_stiffness_matrix(POSITIONS, STIFFNESS, ORIENTATIONS)
    centres = [centre_of_stiffness(stiffness), centre_of_compliance(stiffness)]
    assert residual_coupling(stiffness) > 0.7
    for centre in centres:
        assert centre.coupling == pytest.approx(0.0543, abs=5e-4)
    steps = 0.01 * np.array(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3)).reshape(3, -1).T
    best = min(
        residual_coupling(shift_stiffness(stiffness, centres[0].position + step)) for step in steps
    )
    assert best > 0.05


def test_elastic_centre_blocks_are_symmetric():
    """What defines the two centres, checked on the matrices themselves."""
    stiffness = mount_stiffness_matrix(POSITIONS, STIFFNESS, ORIENTATIONS)
    at_stiffness = centre_of_stiffness(stiffness).stiffness[:3, 3:]
    at_compliance = np.linalg.inv(centre_of_compliance(stiffness).stiffness)[:3, 3:]
    for block in (at_stiffness, at_compliance):
        assert deviation(block, block.T) < 1e-9


def test_eq_14_to_19_linear_form(rng):
    """With no angular velocity the full form is the forward matrix times (a_B, α)."""
    position, acceleration, angular = rng.normal(size=(3, 3))
    direct = acceleration + np.cross(angular, position)
    full = point_acceleration(position, acceleration, angular, np.zeros(3))
    assert deviation(full, direct) < EXACT
    assert deviation(acceleration + skew(position).T @ angular, direct) < EXACT
    body = np.concatenate([acceleration, angular])
    assert deviation(forward_matrix(position) @ body, direct) < EXACT


def test_eq_14_omega_is_the_angular_acceleration_not_the_velocity(rng):
    """Rotation at constant speed: only the centripetal term is left."""
    position, spin = rng.normal(size=(2, 3))
    axis = spin / np.linalg.norm(spin)
    arm = position - axis * (axis @ position)
    at_constant_speed = point_acceleration(position, np.zeros(3), np.zeros(3), spin)
    assert deviation(at_constant_speed, -(spin @ spin) * arm) < EXACT
    assert deviation(np.cross(spin, position), at_constant_speed) > 0.1


def test_eq_20_21_28_forward_matrix_is_a_row_block(rng):
    """Printed as a column stack, 6×3, which does not even multiply a body acceleration."""
    position, body = rng.normal(size=3), rng.normal(size=6)
    printed = np.vstack([np.eye(3), skew(position).T])
    assert forward_matrix(position).shape == (3, 6)
    assert printed.shape == (6, 3)
    # read as its own transpose, the stack has the wrong sign of the rotation
    expected = body[:3] + np.cross(body[3:], position)
    assert deviation(forward_matrix(position) @ body, expected) < EXACT
    assert deviation(printed.T @ body, expected) > 0.1


def test_eq_23_to_26_each_sensor_has_its_own_rotation(rng):
    positions = rng.normal(size=(4, 3))
    orientations = rotation_matrix(rng.uniform(-3, 3, size=(4, 3)))
    body = rng.normal(size=6)
    readings = np.concatenate(
        [
            [axes[:, a] @ (body[:3] + np.cross(body[3:], position)) for a in range(3)]
            for position, axes in zip(positions, orientations, strict=True)
        ]
    )
    assert deviation(forward_matrices(positions, orientations) @ body, readings) < EXACT
    one_for_all = np.tile(orientations[0], (4, 1, 1))
    assert deviation(forward_matrices(positions, one_for_all) @ body, readings) > 0.1


def test_eq_26_27_three_points_off_a_line_are_needed(rng):
    """N = 2 gives a square matrix of rank 5, although only N ≠ 2 is said to need a pseudo-inverse.

    What it cannot see is the rotation about the line through the two sensors.
    """
    first, second, third = rng.normal(size=(3, 3))
    two = forward_matrices([first, second])
    assert two.shape == (6, 6)
    assert np.linalg.matrix_rank(two) == 5
    axis = second - first
    unseen = np.concatenate([np.cross(first, axis), axis])  # turns about the joining line
    assert np.linalg.norm(two @ unseen) < 1e-14 * np.linalg.norm(unseen) * 10
    collinear = forward_matrices([first, second, first + 0.3 * axis])
    assert np.linalg.matrix_rank(collinear) == 5
    assert np.linalg.matrix_rank(forward_matrices([first, second, third])) == 6


def point_masses(rng):
    """Make a body of many masses, with its centre of gravity away from the reference point."""
    positions = rng.normal(size=(300, 3)) * [0.08, 0.05, 0.04] + [0.01, -0.02, 0.015]
    masses = rng.uniform(0.01, 0.03, size=300)
    centre = masses @ positions / masses.sum()
    arms = positions - centre
    inertia = sum(
        m * ((r @ r) * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, arms, strict=True)
    )
    return masses, positions, centre, inertia


def test_eq_39_to_41_mass_matrix_of_point_masses(rng):
    """Moment r × F (printed F × r), inertia about the centre of gravity added."""
    masses, positions, centre, inertia = point_masses(rng)
    body = rng.normal(size=6)
    forces = masses[:, np.newaxis] * (body[:3] + np.cross(body[3:], positions))
    load = np.concatenate([forces.sum(0), np.cross(positions, forces).sum(0)])
    printed = np.concatenate([forces.sum(0), np.cross(forces, positions).sum(0)])
    matrix = mass_matrix(masses.sum(), inertia, centre)
    assert deviation(matrix @ body, load) < EXACT
    assert deviation(matrix @ body, printed) > 1e-3
    without = mass_matrix(masses.sum(), np.zeros((3, 3)), centre)
    assert deviation(without @ body, load) > 1e-3


def test_eq_44_assembly_of_rotated_mounts():
    """K = Σ V_iᵀ R_i diag(k_i) R_iᵀ V_i is the Hessian of the spring energy; 20 free entries."""
    stiffness = mount_stiffness_matrix(POSITIONS, STIFFNESS, ORIENTATIONS)
    assert deviation(stiffness, energy_hessian()) < EXACT
    transposed = np.swapaxes(ORIENTATIONS, 1, 2)
    assert deviation(mount_stiffness_matrix(POSITIONS, STIFFNESS, transposed), stiffness) > 0.01
    # mounts without rotational stiffness leave one of the 21 entries to the others
    assert abs(np.trace(stiffness[:3, 3:])) < EXACT * np.abs(stiffness[:3, 3:]).max()


def test_table_10_order_of_rotations():
    """Only with R = Rz Ry Rx do the axial axes of all three mounts point to the x axis."""
    positions = np.array([[-143.41, 0.10, 8.16], [-14.83, -67.94, 76.49], [-14.84, 67.09, 76.49]])
    angles = np.radians([[0, 0, 180], [0, 45, 90], [0, 135, 90]])
    axial = rotation_matrix(angles)[:, :, 0]
    np.testing.assert_allclose(axial[0], [-1, 0, 0], atol=1e-12)
    towards_axis = -positions[1:] * [0, 1, 1]
    towards_axis /= np.linalg.norm(towards_axis, axis=1, keepdims=True)
    cosine = np.sum(axial[1:] * towards_axis, axis=1)
    assert np.all(cosine > np.cos(np.radians(5)))
    single = [rotation_matrix(angles * axis) for axis in np.eye(3)]
    reverse = (single[0] @ single[1] @ single[2])[:, :, 0]
    assert np.all(np.abs(np.sum(reverse[1:] * towards_axis, axis=1)) < 0.9)
