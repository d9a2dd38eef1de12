"""Transfer path analysis and the comparison of noise transfer functions."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.physics.sound_level import a_weighting, spl
from deboom.vehicles.path_analysis import (
    Measure,
    analyse_paths,
    compare_noise_transfer,
    paths_by_axis,
)

LINES = np.array([20.0, 40.0, 60.0])
PATHS = ("TSM x", "EnM x", "EnM z", "Du left x")
RNG = np.random.default_rng(3)
NTF = RNG.normal(size=(3, 1, 4)) + 1j * RNG.normal(size=(3, 1, 4))
FORCE = RNG.normal(size=(3, 4)) + 1j * RNG.normal(size=(3, 4))
TRANSFER = Frf(LINES, NTF, ("driver",), PATHS, "Pa/N")
FORCES = Spectrum(LINES, FORCE, PATHS, "N")
AIR = Frf(LINES, NTF[:, :, :1], ("driver",), ("intake",), "Pa/(m³/s)")
STRENGTH = Spectrum(LINES, [[2.0], [3.0], [4j]], ("intake",), "m³/s")


def test_contributions_add_up_by_name():
    turned = FORCES.select(PATHS[::-1])
    result = analyse_paths(TRANSFER, turned)
    assert (result.ear, result.paths) == ("driver", PATHS[::-1])
    np.testing.assert_allclose(result.contributions, (NTF[:, 0] * FORCE)[:, ::-1])
    np.testing.assert_allclose(result.pressure, np.sum(NTF[:, 0] * FORCE, axis=1))
    np.testing.assert_allclose(result.level, spl(result.pressure, LINES))
    np.testing.assert_allclose(result.path_levels[:, 3], spl(NTF[:, 0, 0] * FORCE[:, 0], LINES))


def test_airborne_noise_is_a_path_of_its_own_and_zero_by_default():
    without = analyse_paths(TRANSFER, FORCES)
    result = analyse_paths(TRANSFER, FORCES, AIR, STRENGTH)
    assert result.paths == (*PATHS, "intake")
    np.testing.assert_allclose(
        result.pressure - without.pressure, NTF[:, 0, 0] * STRENGTH.values[:, 0]
    )


def test_partial_sums_of_figure_42():
    result = analyse_paths(TRANSFER, FORCES)
    groups = {"TSM x": ("TSM x",), "all z": ("EnM z",), "rest": ("Du left x", "EnM x")}
    sums = result.grouped(groups)
    assert sums.paths == ("TSM x", "all z", "rest")
    np.testing.assert_allclose(sums.pressure, result.pressure)
    np.testing.assert_allclose(
        sums.contributions[:, 2], result.contributions[:, 1] + result.contributions[:, 3]
    )


def test_groups_by_axis():
    assert paths_by_axis(PATHS) == {"x": ("TSM x", "EnM x", "Du left x"), "z": ("EnM z",)}


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ({"x": PATHS[:3]}, r"leave out \['Du left x'\]"),
        ({"x": PATHS, "y": ("GeM y",)}, r"name \['GeM y'\], which do not exist"),
        ({"x": PATHS, "y": PATHS[:1]}, r"duplicated path in the groups \['TSM x'\]"),
    ],
)
def test_groups_hold_every_path_once(groups, message):
    with pytest.raises(InputError, match=message):
        analyse_paths(TRANSFER, FORCES).grouped(groups)


def cancelling():
    """Two large paths against each other, and a small one that makes the sound."""
    force = np.array([[5.0, -4.8, 0.1, 0.0], [5.0, -4.8, 2.0, 0.0], [9.0, 0.0, 0.0, 0.0]])
    return analyse_paths(
        Frf(LINES, np.ones((3, 1, 4)), ("driver",), PATHS, "Pa/N"),
        Spectrum(LINES, force, PATHS, "N"),
    )


def test_ranking_says_by_what():
    by_share = cancelling().ranking(band=(20, 40), a_weighted=False)
    assert (by_share.measure, by_share.band) == (Measure.ENERGY_SHARE, (20, 40))
    assert [one.path for one in by_share.paths] == ["TSM x", "EnM z", "Du left x", "EnM x"]
    assert sum(one.energy_share for one in by_share.paths) == pytest.approx(1.0)
    assert by_share.paths[-1].energy_share < 0
    by_size = cancelling().ranking(Measure.MAGNITUDE, (20, 40), a_weighted=False)
    assert [one.path for one in by_size.paths] == ["TSM x", "EnM x", "EnM z", "Du left x"]
    assert by_size.paths[0].magnitude == pytest.approx(5.0)


def test_a_weighting_counts_lines_as_heard():
    result = cancelling().ranking(Measure.MAGNITUDE)
    weight = 10 ** (a_weighting(LINES) / 10)
    expected = np.sqrt(np.mean(weight * np.array([25.0, 25.0, 81.0])))
    assert result.paths[0].magnitude == pytest.approx(expected)
    assert result.band == (20.0, 60.0)


def test_a_band_without_lines_or_a_sum_of_nothing_is_refused():
    with pytest.raises(InputError, match="no line between 41 and 42 Hz"):
        cancelling().ranking(band=(41, 42))
    silent = analyse_paths(TRANSFER, Spectrum(LINES, 0 * FORCE, PATHS, "N"))
    with pytest.raises(InputError, match="no energy to share"):
        silent.ranking()


def _frf(**changes):
    fields = {
        "frequency": LINES,
        "values": NTF,
        "outputs": ("driver",),
        "inputs": PATHS,
        "unit": "Pa/N",
    }
    return Frf(**{**fields, **changes})


@pytest.mark.parametrize(
    ("transfer", "force", "message"),
    [
        (TRANSFER.select(inputs=PATHS[:3]), FORCES, r"no noise .* paths \['Du left x'\]"),
        (TRANSFER, FORCES.select(PATHS[:3]), r"\['Du left x'\] have a noise transfer function"),
        (_frf(unit="m/s²/N"), FORCES, "are m/s², not Pa"),
        (_frf(frequency=LINES + 1), FORCES, "different frequency lines"),
        (
            _frf(values=np.ones((3, 2, 4)), outputs=("driver", "passenger")),
            FORCES,
            r"microphones \['driver', 'passenger'\]: select\(\) the one ear",
        ),
    ],
)
def test_what_does_not_belong_together_is_refused(transfer, force, message):
    with pytest.raises(InputError, match=message):
        analyse_paths(transfer, force)


def test_airborne_paths_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="give both, or none"):
        analyse_paths(TRANSFER, FORCES, AIR)
    other_ear = Frf(LINES, AIR.values, ("passenger",), ("intake",), AIR.unit)
    with pytest.raises(InputError, match="lead to driver, the acoustic ones to passenger"):
        analyse_paths(TRANSFER, FORCES, other_ear, STRENGTH)
    same_name = Frf(LINES, AIR.values, ("driver",), ("TSM x",), AIR.unit)
    strength = Spectrum(LINES, STRENGTH.values, ("TSM x",), "m³/s")
    with pytest.raises(InputError, match=r"duplicated path \['TSM x'\]"):
        analyse_paths(TRANSFER, FORCES, same_name, strength)
    later = (
        Frf(LINES + 1, AIR.values, ("driver",), ("intake",), AIR.unit),
        Spectrum(LINES + 1, STRENGTH.values, ("intake",), "m³/s"),
    )
    with pytest.raises(InputError, match="forces and airborne sources"):
        analyse_paths(TRANSFER, FORCES, *later)


FREQUENCY = np.linspace(20.0, 40.0, 41)
RNG_2 = np.random.default_rng(6)
PATHS_2 = ("EnM x", "TSM x")
VALUES = RNG_2.normal(size=(41, 1, 2)) + 1j * RNG_2.normal(size=(41, 1, 2))
FORCE_2 = Spectrum(FREQUENCY, RNG_2.normal(size=(41, 2)) + 1j, PATHS_2, "N")


def ntf(values=VALUES, ear="driver ear", paths=PATHS_2, frequency=FREQUENCY):
    return Frf(frequency, values, (ear,), paths, "Pa/N")


def test_a_calibration_error_is_all_scale_and_no_shape():
    found = compare_noise_transfer(ntf(), ntf(1.1 * VALUES), FORCE_2)
    np.testing.assert_allclose(found.corr_f, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.corr_s, 0.1, rtol=1e-12)
    np.testing.assert_allclose(found.level_difference, 20 * np.log10(1.1))
    np.testing.assert_allclose(found.spl_difference, 20 * np.log10(1.1))


def test_contributions_stay_apart_and_sum_to_the_pressure():
    second = VALUES.copy()
    second[:, :, 1] *= -1
    found = compare_noise_transfer(ntf(), ntf(second[:, :, ::-1], paths=PATHS_2[::-1]), FORCE_2)
    assert found.paths == PATHS_2
    np.testing.assert_allclose(found.contributions[1, :, 0], found.contributions[0, :, 0])
    np.testing.assert_allclose(found.contributions[1, :, 1], -found.contributions[0, :, 1])
    by_hand = VALUES[:, 0, 0] * FORCE_2.values[:, 0] + VALUES[:, 0, 1] * FORCE_2.values[:, 1]
    np.testing.assert_allclose(found.pressure[0], by_hand)


def test_mixed_microphones_missing_paths_and_other_lines_are_refused():
    with pytest.raises(InputError, match="different microphones cannot be compared"):
        compare_noise_transfer(ntf(), ntf(ear="passenger ear"), FORCE_2)
    with pytest.raises(InputError, match=r"second set has no noise transfer function of \['TSM x'"):
        compare_noise_transfer(ntf(), ntf(paths=("EnM x", "GeM x")), FORCE_2)
    with pytest.raises(InputError, match="first set and the forces have different"):
        compare_noise_transfer(ntf(frequency=FREQUENCY + 1), ntf(), FORCE_2)
