import numpy as np
import pytest

from deboom.measurement import path_forces
from deboom.measurement.channels import Frf, Spectrum, unit_of_response
from deboom.measurement.noise_transfer import noise_transfer_of_paths
from deboom.physics.force_inversion import PLAIN, invert_for_forces

LINES = np.array([20.0, 30.0, 40.0])
PATHS = ("TSM x", "EnM x")
INDICATORS = ("strut", "rail", "carrier", "dash")
RNG = np.random.default_rng(1)
VALUES = RNG.normal(size=(3, 6, 2)) + 1j * RNG.normal(size=(3, 6, 2))
FORCE = RNG.normal(size=(3, 2)) + 1j * RNG.normal(size=(3, 2))
ALL = Frf(LINES, VALUES, (*INDICATORS, "floor", "roof"), PATHS, "m/s²/N")
RESPONSE = ALL @ Spectrum(LINES, FORCE, PATHS, "N")
KEPT_OUT = ("floor", "roof")
EARS, PIECES = ("driver ear", "passenger ear"), ("TSM x", "Du left x", "Du right x")
ACCELERANCE = ALL.select(outputs=INDICATORS)


@pytest.mark.parametrize(
    ("function", "source", "response"),
    [
        ("Pa/N", "N", "Pa"),
        ("m/s²/N", "N", "m/s²"),
        ("(m/s^2)/N", "N", "m/s^2"),
        ("(m/s^2)/(m^3/s^2)", "m^3/s^2", "m/s^2"),
        ("N/m", "N", "N/m·N"),
    ],
)
def test_unit_of_a_response(function, source, response):
    assert unit_of_response(function, source) == response
    product = Frf([1.0], [[[2.0]]], ("a",), ("b",), function) @ Spectrum(
        [1.0], [[3.0]], ("b",), source
    )
    assert product.unit == response


@pytest.mark.parametrize(
    ("find", "receiver"),
    [
        (path_forces.forces_by_inversion, path_forces.Receiver.UNCOUPLED),
        (path_forces.blocked_forces_in_situ, path_forces.Receiver.ASSEMBLED),
    ],
)
def test_names_travel_through_the_inversion(find, receiver):
    turned = RESPONSE.select(tuple(reversed(RESPONSE.channels)))
    inverted = find(ACCELERANCE, turned)
    assert (inverted.force.channels, inverted.force.unit) == (PATHS, "N")
    assert inverted.receiver is receiver
    assert inverted.indicators == INDICATORS
    np.testing.assert_allclose(inverted.force.values, FORCE, rtol=1e-10)
    assert inverted.inversion.condition_number.shape == (3,)
    with pytest.raises(ValueError, match="read-only"):
        inverted.inversion.force[0] = 0


def test_forces_from_mount_stiffness_by_name():
    stiffness = Spectrum(LINES, np.full((3, 2), 2e5 + 1e4j), PATHS, "N/m")
    above = Spectrum(LINES, [[3e-4, 1e-4]] * 3, PATHS[::-1], "m")
    below = Spectrum(LINES, [[1e-4, 2e-4, 9e-4]] * 3, (*PATHS[::-1], "Du x"), "m")
    forces = path_forces.forces_by_mount_stiffness(stiffness, above, below)
    np.testing.assert_allclose(forces.force.values, (2e5 + 1e4j) * np.array([[-1e-4, 2e-4]] * 3))
    assert forces.receiver is path_forces.Receiver.UNCOUPLED
    assert forces.inversion is None


def test_validation_with_sensors_kept_out():
    forces = path_forces.forces_by_inversion(ACCELERANCE, RESPONSE)
    result = path_forces.validate_on_board(ALL.select(outputs=KEPT_OUT), forces, RESPONSE)
    assert result.measured.channels == KEPT_OUT
    for number in (result.relative_error, result.corr_f, result.corr_s, result.error_by_line):
        assert number.max() < 1e-10
    doubled = Spectrum(LINES, 2 * RESPONSE.values, RESPONSE.channels, RESPONSE.unit)
    wrong = path_forces.validate_on_board(ALL.select(outputs=KEPT_OUT), forces, doubled)
    np.testing.assert_allclose(wrong.relative_error, 0.5)
    np.testing.assert_allclose(wrong.corr_s, 0.5)
    assert wrong.corr_f.max() < 1e-10


def test_a_path_of_two_pieces_is_per_newton_of_their_sum():
    points = Frf(LINES, VALUES[:, :2].repeat(2, axis=2)[:, :, :3], EARS, PIECES, "Pa/N")
    paths = {"TSM x": PIECES[:1], "Du x": PIECES[1:]}
    transfer = noise_transfer_of_paths(points, paths, "passenger ear")
    assert (transfer.outputs, transfer.inputs) == (EARS[1:], ("TSM x", "Du x"))
    halves = 0.5 * (points.values[:, 1, 1] + points.values[:, 1, 2])
    np.testing.assert_allclose(transfer.values[:, 0, 1], halves)


def test_silence_gives_no_force():
    inverted = invert_for_forces(VALUES, np.zeros((3, 6)))
    assert not inverted.force.any()
    assert not inverted.residual.any()


def test_noisy_sensors_count_less():
    response = RESPONSE.values.copy()
    response[:, 0] += 10
    noise = np.array([1e6, 1, 1, 1, 1, 1])
    weighted = invert_for_forces(VALUES, response, PLAIN, noise)
    np.testing.assert_allclose(weighted.force, FORCE, atol=1e-9)
    assert np.abs(invert_for_forces(VALUES, response, PLAIN).force - FORCE).max() > 0.1


def nearly_alike(alike, n_line=60):
    """Two paths whose columns differ by little, functions with errors of 3 %."""
    random = np.random.default_rng(2)
    normal = lambda *shape: random.standard_normal((*shape, 2)) @ np.array([1.0, 1j])  # noqa: E731
    common, own = normal(n_line, 8, 1), normal(n_line, 8, 2)
    exact = common + alike * own
    force = 10 * normal(n_line, 2)
    seen = np.einsum("fmn,fn->fm", exact, force)
    measured = exact * (1 + 0.03 / np.sqrt(2) * normal(*exact.shape))
    lines, names = np.arange(n_line) + 20.0, tuple("abcdefgh")
    return (
        Frf(lines, measured, names, PATHS, "m/s²/N"),
        Spectrum(lines, seen, names, "m/s²"),
        force,
    )


@pytest.mark.parametrize("alike", [1.0, 0.1, 0.002])
def test_intervals_of_forces_hold_and_single_forces_that_are_not_told_are_named(alike):
    """Errors of the functions are in them, and what regularisation takes away."""
    functions, seen, force = nearly_alike(alike)
    found = path_forces.forces_by_inversion(functions, seen, function_error=0.03)
    error = np.abs(found.force.values - force)
    assert np.mean(error <= found.inversion.half_width) > 0.85
    wrong = np.linalg.norm(error, axis=0) / np.linalg.norm(force, axis=0)
    if alike == 0.002:
        assert np.all(wrong > 0.3)
        assert found.inversion.condition_number.max() > 30
        assert "TSM x ±" in found.verdict
        assert "condition number reaches" in found.verdict
    if alike == 1.0:
        assert np.all(wrong < 0.05)
        assert found.verdict == ""
    # the resultant is right in any case
    both = np.sum(found.force.values - force, axis=1)
    assert np.linalg.norm(both) < 0.25 * np.linalg.norm(force.sum(axis=1))
    assert "TSM x, half width at 90 % [N]" in found.table
    assert "condition number [1]" in found.table
