"""Transfer path analysis."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.physics.sound_level import a_weighting, spl
from deboom.vehicles.path_analysis import analyse_paths, paths_by_axis

LINES = np.array([20.0, 40.0, 60.0])
PATHS = ("TSM x", "EnM x", "EnM z", "Du left x")
RNG = np.random.default_rng(3)
NTF = RNG.normal(size=(3, 1, 4)) + 1j * RNG.normal(size=(3, 1, 4))
FORCE = RNG.normal(size=(3, 4)) + 1j * RNG.normal(size=(3, 4))
TRANSFER = Frf(LINES, NTF, ("driver",), PATHS, "Pa/N")
FORCES = Spectrum(LINES, FORCE, PATHS, "N")


def test_contributions_add_up_by_name():
    turned = FORCES.select(PATHS[::-1])
    result = analyse_paths(TRANSFER, turned)
    assert (result.ear, result.paths) == ("driver", PATHS[::-1])
    np.testing.assert_allclose(result.contributions, (NTF[:, 0] * FORCE)[:, ::-1])
    np.testing.assert_allclose(result.pressure, np.sum(NTF[:, 0] * FORCE, axis=1))
    np.testing.assert_allclose(result.level, spl(result.pressure, LINES))
    np.testing.assert_allclose(result.path_levels[:, 3], spl(NTF[:, 0, 0] * FORCE[:, 0], LINES))


def test_partial_sums_of_figure_42():
    result = analyse_paths(TRANSFER, FORCES)
    sums = result.grouped(paths_by_axis(PATHS))
    assert sums.paths == ("x", "z")
    np.testing.assert_allclose(sums.pressure, result.pressure)
    np.testing.assert_allclose(sums.contributions[:, 1], result.contributions[:, 2])


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


def test_ranking_is_by_size_as_heard_and_shares_add_up():
    ranking = cancelling().table
    assert ranking["path"].tolist() == ["TSM x", "EnM x", "EnM z", "Du left x"]
    weight = 10 ** (a_weighting(LINES) / 10)
    size = np.sqrt(np.mean(weight * [25.0, 25.0, 81.0]))
    assert ranking["rms contribution [Pa]"][0] == pytest.approx(size)
    assert ranking["share of the energy [%]"].sum() == pytest.approx(100.0)
    against = cancelling().ranking((20, 40))["share of the energy [%]"][1]
    total, two = np.array([5.0 - 4.8 + 0.1, 5.0 - 4.8 + 2.0]), weight[:2]
    assert against == pytest.approx(-480.0 * (two @ total) / (two @ total**2))


def test_a_band_without_lines_or_a_sum_of_nothing_is_refused():
    with pytest.raises(InputError, match="no line between 41 and 42 Hz"):
        cancelling().ranking(band=(41, 42))
    silent = analyse_paths(TRANSFER, Spectrum(LINES, 0 * FORCE, PATHS, "N"))
    with pytest.raises(InputError, match="no energy to share"):
        silent.ranking()


@pytest.mark.parametrize(
    ("transfer", "force", "message"),
    [
        (TRANSFER.select(inputs=PATHS[:3]), FORCES, r"no noise .* paths \['Du left x'\]"),
        (TRANSFER, FORCES.select(PATHS[:3]), r"\['Du left x'\] have a noise transfer function"),
        (replace(TRANSFER, unit="m/s²/N"), FORCES, "are m/s², not Pa"),
        (replace(TRANSFER, frequency=LINES + 1), FORCES, "different frequency lines"),
        (
            Frf(LINES, np.ones((3, 2, 4)), ("driver", "passenger"), PATHS, "Pa/N"),
            FORCES,
            r"microphones \['driver', 'passenger'\]: select\(\) the one ear",
        ),
    ],
)
def test_what_does_not_belong_together_is_refused(transfer, force, message):
    with pytest.raises(InputError, match=message):
        analyse_paths(transfer, force)
