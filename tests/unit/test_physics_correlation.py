import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.correlation import corr_f, corr_s, mac, msf

CURVES = np.random.default_rng(1).normal(size=(40, 3, 2)) @ np.array([1, 1j])


def test_curves_of_several_channels_are_compared_column_by_column():
    other = CURVES[:, ::-1]
    for function in (mac, msf, corr_f, corr_s):
        together = function(CURVES, other)
        one_by_one = [function(CURVES[:, i], other[:, i]) for i in range(3)]
        assert together.shape == (3,)
        np.testing.assert_allclose(together, one_by_one)


def test_broadcasting_gives_the_matrix_of_all_pairs():
    matrix = mac(CURVES[:, :, np.newaxis], CURVES[:, np.newaxis, :])
    assert matrix.shape == (3, 3)
    np.testing.assert_allclose(np.diag(matrix), 1)
    np.testing.assert_allclose(matrix, matrix.T)


def test_orthogonal_curves_have_nothing_in_common():
    assert mac([1, 1], [1, -1]) == 0
    assert corr_f([1, 1], [1, -1]) == 1
    assert msf([1, 1], [1, -1]) == 0


def test_a_curve_agrees_with_itself():
    assert corr_f(CURVES[:, 0], CURVES[:, 0]) == pytest.approx(0, abs=1e-14)
    assert corr_s(CURVES[:, 0], CURVES[:, 0]) == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize("function", [mac, msf, corr_f, corr_s])
def test_curves_that_cannot_be_compared_are_refused(function):
    with pytest.raises(InputError, match=r"\(40, 3\) and \(39, 3\) cannot be compared"):
        function(CURVES, CURVES[1:])
    with pytest.raises(InputError, match="cannot be compared"):
        function(1.0, 2.0)
    with pytest.raises(InputError, match="zero on all lines"):
        function(CURVES[:, 0], np.zeros(40))
    with pytest.raises(InputError, match="zero on all lines"):
        function(np.zeros(40), CURVES[:, 0])
