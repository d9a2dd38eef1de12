import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum, unit_of_response
from deboom.measurement.path_forces import (
    Receiver,
    blocked_forces_in_situ,
    forces_by_inversion,
    forces_by_mount_stiffness,
    validate_on_board,
)
from deboom.physics.force_inversion import (
    PLAIN,
    Inversion,
    Regularisation,
    invert_for_forces,
)

LINES = np.array([20.0, 30.0, 40.0])
PATHS = ("TSM x", "EnM x")
INDICATORS = ("strut", "rail", "carrier", "dash")
RNG = np.random.default_rng(1)
VALUES = RNG.normal(size=(3, 6, 2)) + 1j * RNG.normal(size=(3, 6, 2))
FORCE = RNG.normal(size=(3, 2)) + 1j * RNG.normal(size=(3, 2))
ALL = Frf(LINES, VALUES, (*INDICATORS, "floor", "roof"), PATHS, "m/s²/N")
RESPONSE = ALL @ Spectrum(LINES, FORCE, PATHS, "N")
KEPT_OUT = ("floor", "roof")
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
    one = Frf([1.0], [[[2.0]]], ("a",), ("b",), function) @ Spectrum([1.0], [[3.0]], ("b",), source)
    assert one.unit == response


@pytest.mark.parametrize(
    ("find", "receiver"),
    [
        (forces_by_inversion, Receiver.UNCOUPLED),
        (blocked_forces_in_situ, Receiver.ASSEMBLED),
    ],
)
def test_names_travel_through_the_inversion(find, receiver):
    turned = RESPONSE.select(tuple(reversed(RESPONSE.channels)))
    found = find(ACCELERANCE, turned)
    assert (found.force.channels, found.force.unit) == (PATHS, "N")
    assert found.receiver is receiver
    assert found.indicators == INDICATORS
    np.testing.assert_allclose(found.force.values, FORCE, rtol=1e-10)
    assert found.inversion.condition_number.shape == (3,)
    with pytest.raises(ValueError, match="read-only"):
        found.inversion.force[0] = 0


def test_forces_from_mount_stiffness_by_name():
    stiffness = Spectrum(LINES, np.full((3, 2), 2e5 + 1e4j), PATHS, "N/m")
    above = Spectrum(LINES, [[3e-4, 1e-4]] * 3, PATHS[::-1], "m")
    below = Spectrum(LINES, [[1e-4, 2e-4, 9e-4]] * 3, (*PATHS[::-1], "Du x"), "m")
    found = forces_by_mount_stiffness(stiffness, above, below)
    np.testing.assert_allclose(found.force.values, (2e5 + 1e4j) * np.array([[-1e-4, 2e-4]] * 3))
    assert found.receiver is Receiver.UNCOUPLED
    assert found.inversion is None


def test_validation_with_sensors_kept_out():
    forces = forces_by_inversion(ACCELERANCE, RESPONSE)
    result = validate_on_board(ALL.select(outputs=KEPT_OUT), forces, RESPONSE)
    assert result.measured.channels == KEPT_OUT
    for number in (result.relative_error, result.corr_f, result.corr_s, result.error_by_line):
        assert number.max() < 1e-10
    doubled = Spectrum(LINES, 2 * RESPONSE.values, RESPONSE.channels, RESPONSE.unit)
    wrong = validate_on_board(ALL.select(outputs=KEPT_OUT), forces, doubled)
    np.testing.assert_allclose(wrong.relative_error, 0.5)
    np.testing.assert_allclose(wrong.corr_s, 0.5)
    assert wrong.corr_f.max() < 1e-10


def test_validation_refuses_what_proves_nothing():
    forces = forces_by_inversion(ACCELERANCE, RESPONSE)
    validation = ALL.select(outputs=KEPT_OUT)
    with pytest.raises(InputError, match=r"\['strut'\] were indicators of the inversion"):
        validate_on_board(ALL.select(outputs=("strut", "roof")), forces, RESPONSE)
    with pytest.raises(InputError, match=r"paths \['EnM x'\] to the validation sensors"):
        validate_on_board(validation.select(inputs=PATHS[:1]), forces, RESPONSE)
    silent = RESPONSE.values * (np.arange(6) < 5)
    with pytest.raises(InputError, match=r"\['roof'\] measured nothing"):
        validate_on_board(validation, forces, Spectrum(LINES, silent, RESPONSE.channels, "m/s²"))
    with pytest.raises(InputError, match="which measured m:"):
        validate_on_board(
            validation, forces, Spectrum(LINES, RESPONSE.values, RESPONSE.channels, "m")
        )
    later = Spectrum(LINES + 1, RESPONSE.values, RESPONSE.channels, "m/s²")
    with pytest.raises(InputError, match="different frequency lines"):
        validate_on_board(validation, forces, later)


def test_more_unknown_forces_than_indicators_are_refused():
    with pytest.raises(InputError, match="2 unknown forces from 1 indicators"):
        forces_by_inversion(ALL.select(outputs=("roof",)), RESPONSE)


def test_singular_positions_are_refused_by_name():
    values = np.concatenate([VALUES, 3j * VALUES[:, :, :1]], axis=2)
    matrix = Frf(LINES, values, ALL.outputs, (*PATHS, "GeM x"), "m/s²/N")
    with pytest.raises(
        InputError, match=r"singular positions: forces at \['TSM x', 'GeM x'\] .*3 lines"
    ):
        forces_by_inversion(matrix, RESPONSE)


def test_a_path_that_no_indicator_sees_is_refused_by_name():
    matrix = Frf(LINES, VALUES * [1, 0], ALL.outputs, PATHS, "m/s²/N")
    with pytest.raises(InputError, match="force at EnM x moves no indicator"):
        forces_by_inversion(matrix, RESPONSE)


def test_a_line_at_0_hz_is_refused():
    lines = np.array([0.0, 30.0, 40.0])
    matrix = Frf(lines, VALUES, ALL.outputs, PATHS, "m/s²/N")
    with pytest.raises(InputError, match="0 Hz"):
        forces_by_inversion(matrix, Spectrum(lines, RESPONSE.values, ALL.outputs, "m/s²"))


@pytest.mark.parametrize(
    ("response", "message"),
    [
        (RESPONSE.select(INDICATORS[:3]), r"no response of the indicators of \['dash'\]"),
        (Spectrum(LINES + 1, RESPONSE.values, ALL.outputs, "m/s²"), "other frequency lines"),
        (
            Spectrum(LINES, RESPONSE.values, ALL.outputs, "m/s"),
            "responses of the indicators are in m/s",
        ),
    ],
)
def test_responses_that_do_not_belong_to_the_matrix_are_refused(response, message):
    with pytest.raises(InputError, match=message):
        forces_by_inversion(ACCELERANCE, response)


def test_motion_that_does_not_fit_is_refused():
    stiffness = Spectrum(LINES, np.ones((3, 2)), PATHS, "N/m")
    motion = Spectrum(LINES, np.ones((3, 2)), PATHS, "m")
    with pytest.raises(InputError, match=r"no receiver displacement of \['EnM x'\]"):
        forces_by_mount_stiffness(stiffness, motion, motion.select(PATHS[:1]))
    with pytest.raises(InputError, match="mount stiffness is in m"):
        forces_by_mount_stiffness(motion, motion, motion)


ONE = np.ones((3, 4))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((VALUES[:, :4], ONE[:2], PLAIN), "responses: shape"),
        ((VALUES[:, :4], ONE * np.nan, PLAIN), "responses: a number is not finite"),
        ((VALUES[:, :4], ONE, PLAIN, np.zeros(4)), "above 0"),
        ((VALUES[:, :4], ONE, PLAIN, np.ones(3)), "noise of the indicators: shape"),
        ((VALUES[:, :2], ONE[:, :2]), "2 unknown forces from as many indicators"),
    ],
)
def test_arrays_that_cannot_be_inverted_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        invert_for_forces(*arguments)


def test_a_fraction_outside_of_the_singular_values_is_refused():
    with pytest.raises(InputError, match="0 to 1"):
        Inversion(Regularisation.TIKHONOV, 1.5)


def test_silence_gives_no_force():
    found = invert_for_forces(VALUES, np.zeros((3, 6)))
    assert not found.force.any()
    assert not found.residual.any()


def test_noisy_sensors_count_less():
    response = RESPONSE.values.copy()
    response[:, 0] += 10
    noise = np.array([1e6, 1, 1, 1, 1, 1])
    weighted = invert_for_forces(VALUES, response, PLAIN, noise)
    np.testing.assert_allclose(weighted.force, FORCE, atol=1e-9)
    assert np.abs(invert_for_forces(VALUES, response, PLAIN).force - FORCE).max() > 0.1
