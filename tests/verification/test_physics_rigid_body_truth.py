"""Rigid bodies against the thesis, measurements and closed forms."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eig
from scipy.spatial.transform import Rotation
from thesis_samples import ORIENTATIONS, POSITIONS, STIFFNESS, deviation

from deboom.compressor.model import CompressorModel, GainFactor
from deboom.errors import InputError
from deboom.physics.elastic_centre import (
    centre_of_compliance,
    centre_of_stiffness,
    residual_coupling,
)
from deboom.physics.rigid_body import (
    ROTATION_ORDERS,
    characteristic_length,
    forward_matrices,
    forward_matrix,
    mass_matrix,
    mass_properties,
    mount_stiffness_matrix,
    point_acceleration,
    rigid_body_modes,
    rotation_matrix,
    shift_load,
    shift_matrix,
    shift_stiffness,
    skew,
)

EXACT = 1e-10


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
    shift = np.array([0.1, -0.05, 0.2])
    for find, centre in zip((centre_of_stiffness, centre_of_compliance), centres, strict=True):
        assert centre.coupling == pytest.approx(0.0543, abs=5e-4)
        # they are points of the body, wherever the stiffness is given
        moved = find(shift_stiffness(stiffness, shift))
        np.testing.assert_allclose(moved.position, centre.position - shift, atol=1e-12)
        assert moved.coupling == pytest.approx(centre.coupling, rel=1e-9)
    steps = 0.01 * np.array(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3)).reshape(3, -1).T
    best = min(
        residual_coupling(shift_stiffness(stiffness, centres[0].position + step)) for step in steps
    )
    assert best > 0.05


def test_eq_14_to_28_forward_matrix_is_a_row_block(rng):
    """With no angular velocity the full form is the forward matrix times (a_B, α).

    Printed as a column stack, 6×3, which does not even multiply a body acceleration.
    """
    position, acceleration, angular = rng.normal(size=(3, 3))
    direct = acceleration + np.cross(angular, position)
    full = point_acceleration(position, acceleration, angular, np.zeros(3))
    assert deviation(full, direct) < EXACT
    assert deviation(acceleration + skew(position).T @ angular, direct) < EXACT
    body = np.concatenate([acceleration, angular])
    assert forward_matrix(position).shape == (3, 6)
    assert deviation(forward_matrix(position) @ body, direct) < EXACT
    # read as its own transpose, the stack has the wrong sign of the rotation
    assert deviation(np.vstack([np.eye(3), skew(position).T]).T @ body, direct) > 0.1


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
    assert np.linalg.matrix_rank(forward_matrices([first, second, first + 0.3 * axis])) == 5
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


def test_eq_2_and_44_assembly_of_rotated_mounts():
    """K = Σ V_iᵀ R_i diag(k_i) R_iᵀ V_i is the Hessian of the spring energy; 20 free entries."""
    stiffness = mount_stiffness_matrix(POSITIONS, STIFFNESS, ORIENTATIONS)
    printed = stiffness.copy()  # eq. 2 repeats the upper right block at the lower left
    printed[3:, :3] = printed[:3, 3:]
    assert deviation(printed, energy_hessian()) > 0.01
    assert deviation(stiffness, energy_hessian()) < EXACT
    transposed = np.swapaxes(ORIENTATIONS, 1, 2)
    assert deviation(mount_stiffness_matrix(POSITIONS, STIFFNESS, transposed), stiffness) > 0.01
    # mounts without rotational stiffness leave one of the 21 entries to the others
    assert abs(np.trace(stiffness[:3, 3:])) < EXACT * np.abs(stiffness[:3, 3:]).max()
    factor = np.linspace(1.0, 1.5, 5)[:, np.newaxis, np.newaxis] * (1 + 0.2j)
    for shape in ((5, 3, 3), (5, 9)):
        lines = mount_stiffness_matrix(POSITIONS, (factor * STIFFNESS).reshape(shape), ORIENTATIONS)
        np.testing.assert_allclose(lines, factor * stiffness, rtol=1e-13, atol=1e-9)


def test_table_10_order_of_rotations():
    """Only with R = Rz Ry Rx do the axial axes of all three mounts point to the x axis."""
    positions = np.array([[-143.41, 0.10, 8.16], [-14.83, -67.94, 76.49], [-14.84, 67.09, 76.49]])
    angles = np.radians([[0, 0, 180], [0, 45, 90], [0, 135, 90]])
    axial = rotation_matrix(angles)[:, :, 0]
    np.testing.assert_allclose(axial[0], [-1, 0, 0], atol=1e-12)
    towards_axis = -positions[1:] * [0, 1, 1]
    towards_axis /= np.linalg.norm(towards_axis, axis=1, keepdims=True)
    assert np.all(np.sum(axial[1:] * towards_axis, axis=1) > np.cos(np.radians(5)))
    single = [rotation_matrix(angles * axis) for axis in np.eye(3)]
    reverse = (single[0] @ single[1] @ single[2])[:, :, 0]
    assert np.all(np.abs(np.sum(reverse[1:] * towards_axis, axis=1)) < 0.9)


DATA = Path(__file__).parents[1] / "data" / "bicycle-inertia"


def frame(bicycle):
    """Return the printed values, and tensor and centre of gravity of the frame."""
    lines = (DATA / f"{bicycle}Benchmark.txt").read_text(encoding="utf-8").splitlines()
    pairs = (line.partition("+/-")[0].partition("=") for line in lines)
    printed = {key.strip(): float(value) for key, _, value in pairs}
    inertia = np.array(
        [
            [printed["IBxx"], 0, printed["IBxz"]],
            [0, printed["IByy"], 0],
            [printed["IBxz"], 0, printed["IBzz"]],
        ]
    )
    return printed, inertia, np.array([printed["xB"], 0, printed["zB"]])


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


PLATFORMS = json.loads(
    (DATA.parent / "benchmarks" / "benchmarks.json").read_text(encoding="utf-8")
)["rigid_mass_matrix_to_cg"]["cases"]


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


def test_mass_properties_of_a_measured_matrix_need_a_tolerance(rng):
    inertia = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])
    centre = np.array([0.02, -0.11, 0.3])
    measured = mass_matrix(193.5, inertia, centre) + rng.normal(size=(6, 6)) * 0.02
    with pytest.raises(InputError, match="deviates by") as refused:
        mass_properties(measured)
    # a deviation counts the same whether lengths are in metres or in millimetres
    units = np.repeat([1.0, 1e3], 3)
    with pytest.raises(InputError, match=re.escape(str(refused.value))):
        mass_properties(measured * np.outer(units, units))
    body = mass_properties(measured, tolerance=0.05)
    assert body.mass == pytest.approx(193.5, abs=0.05)
    np.testing.assert_allclose(body.centre, centre, atol=5e-4)
    assert mass_properties(measured, deviation=np.ones((6, 6))).mass == body.mass
    with pytest.raises(InputError, match="standard deviations of an entry"):
        mass_properties(measured, deviation=np.full((6, 6), 1e-6))
    sphere = 0.4 * 3.0 * 0.2**2 * np.eye(3)
    assert characteristic_length(3.0, sphere) == pytest.approx(0.2 * np.sqrt(0.4))


TAU = 2 * np.pi


def test_symmetric_body_on_four_mounts_in_its_plane_of_gravity():
    """Nothing couples: √(Σk/m) for the translations, √(Σk·arm²/J) for the rotations."""
    mass, inertia = 193.5, np.array([11.0, 6.8, 9.6])
    a, b = 0.25, 0.45
    k = np.array([110e3, 90e3, 150e3])
    positions = np.array([[a, b, 0], [a, -b, 0], [-a, b, 0], [-a, -b, 0]])
    frequency, shapes = rigid_body_modes(
        mass_matrix(mass, np.diag(inertia)), mount_stiffness_matrix(positions, np.tile(k, (4, 1)))
    )
    translations = np.sqrt(4 * k / mass)
    arms = 4 * np.array([k[2] * b**2, k[2] * a**2, k[0] * b**2 + k[1] * a**2])
    expected = np.concatenate([translations, np.sqrt(arms / inertia)]) / TAU
    np.testing.assert_allclose(frequency, np.sort(expected), rtol=1e-12)
    moving = np.abs(shapes).argmax(axis=0)
    np.testing.assert_array_equal(moving, np.argsort(expected))
    modal_mass = np.array([mass, mass, mass, *inertia])[moving]
    np.testing.assert_allclose(shapes[moving, np.arange(6)], modal_mass**-0.5, rtol=1e-12)


def test_modes_do_not_depend_on_point_axes_or_solver():
    """Shifted reference point, turned axes, and scipy's unsymmetric eigenvalue solver."""
    positions = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
    rates = 1e3 * np.array([[110, 90, 150], [190, 140, 220], [75, 50, 55]])
    inertia = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])
    mass, springs = mass_matrix(193.5, inertia), mount_stiffness_matrix(positions, rates)
    frequency, shapes = rigid_body_modes(mass, springs)

    squared = eig(springs, mass, right=False)
    np.testing.assert_allclose(np.sort(np.sqrt(squared.real)) / TAU, frequency, rtol=1e-10)
    residual = springs @ shapes - mass @ shapes * (TAU * frequency) ** 2
    assert np.max(np.abs(residual)) < 1e-10 * np.max(np.abs(springs @ shapes))

    point = np.array([0.4, -0.7, 0.2])
    moved = rigid_body_modes(shift_stiffness(mass, point), shift_stiffness(springs, point))[0]
    np.testing.assert_allclose(moved, frequency, rtol=1e-10)

    turn = rotation_matrix([0.3, -0.8, 1.9])
    turned = rigid_body_modes(
        mass_matrix(193.5, turn @ inertia @ turn.T),
        mount_stiffness_matrix(positions @ turn.T, rates, np.tile(turn, (3, 1, 1))),
    )[0]
    np.testing.assert_allclose(turned, frequency, rtol=1e-10)


def test_rotation_matrix_is_scipys_extrinsic_xyz():
    angles = np.random.default_rng(21).uniform(-3, 3, size=(20, 3))
    np.testing.assert_allclose(
        rotation_matrix(angles), Rotation.from_euler("xyz", angles).as_matrix(), atol=1e-14
    )


def test_point_acceleration_is_the_second_derivative_of_the_path():
    """A point of a body that travels and swings about a fixed axis."""
    point, axis = np.array([0.31, -0.17, 0.23]), np.array([0.6, 0.0, 0.8])

    def turned(t):
        return Rotation.from_rotvec(0.7 * np.sin(3 * t) * axis).apply(point)

    def place(t):
        return turned(t) + np.array([0.2 * t**3, np.sin(2 * t), np.exp(-t)])

    t, h = 0.2, 2e-3
    differences = np.array([-1, 16, -30, 16, -1]) / (12 * h**2)
    measured = sum(w * place(t + i * h) for i, w in zip(range(-2, 3), differences, strict=True))
    travel = np.array([1.2 * t, -4 * np.sin(2 * t), np.exp(-t)])
    rotation = -6.3 * np.sin(3 * t) * axis
    full = point_acceleration(turned(t), travel, rotation, 2.1 * np.cos(3 * t) * axis)
    np.testing.assert_allclose(full, measured, atol=2e-7)
    linear = forward_matrix(turned(t)) @ np.concatenate([travel, rotation])
    assert np.max(np.abs(linear - measured)) > 0.1


@pytest.mark.parametrize("order", ROTATION_ORDERS)
def test_every_order_of_rotations_is_scipys(order):
    angles = np.array([[0.3, -0.7, 1.9], [2.0, 0.1, -0.4]])
    axes = [axis for axis in order if axis != "R"]
    turned = angles[:, ["xyz".index(axis) for axis in axes]]
    # capital letters: about axes that turn along, the leftmost matrix first
    expected = Rotation.from_euler("".join(axes).upper(), turned).as_matrix()
    assert rotation_matrix(angles, order) == pytest.approx(expected, abs=1e-14)


def test_an_unknown_order_of_rotations_is_refused():
    with pytest.raises(InputError, match="unknown order of rotations 'zyx', use one of RzRyRx"):
        rotation_matrix([0.0, 0.0, 0.0], "zyx")
