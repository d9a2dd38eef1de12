"""Designs of mounts: which number is what, and what is refused."""

import numpy as np
import pytest

from deboom.compressor.cabin_index import DATUM, mount_variables
from deboom.errors import InputError
from deboom.measurement.compressor_test import CompressorMount


def two_mounts():
    return tuple(
        CompressorMount(f"mount {n}", np.array([0.1 * n, 0, 0.05]), np.zeros(3), np.full(3, 1e4))
        for n in (1, 2)
    )


def test_identical_parts_share_and_pieces_differ():
    variables = mount_variables(two_mounts(), identical=True, pieces=True, places=False)
    assert variables.names == (
        "mounts axial",
        "mounts radial",
        "mount 1 axial piece",
        "mount 1 radial piece",
        "mount 2 axial piece",
        "mount 2 radial piece",
    )
    factors = variables.factors(np.array([[0.5, 2.0, 1.1, 1.0, 1.0, 0.9]]))
    np.testing.assert_allclose(factors, [[0.55, 2.0, 2.0, 0.5, 1.8, 1.8]])


def test_own_parts_and_places():
    variables = mount_variables(two_mounts(), identical=False, pieces=False, places=True)
    assert variables.names[:2] == ("mount 1 axial", "mount 1 radial")
    assert variables.names[4:] == tuple(f"mount {n} {axis}" for n in (1, 2) for axis in "xyz")
    assert variables.units == ("1",) * 4 + ("mm",) * 6
    design = np.array([[1.0, 1.0, 1.0, 1.0, *np.full(6, DATUM)]])
    np.testing.assert_array_equal(variables.offsets(design), np.zeros((1, 6)))
    design[0, 5] += 2.0
    np.testing.assert_allclose(variables.offsets(design), [[0, 2e-3, 0, 0, 0, 0]], atol=1e-15)


ALIKE = mount_variables(two_mounts(), identical=True, pieces=False, places=False)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: ALIKE.checked(np.ones((1, 3))), "with the 2 columns"),
        (lambda: ALIKE.checked([[1.0, np.nan]]), "mounts radial is nan"),
        (lambda: ALIKE.checked([[1.0, 0.0]]), "not positive"),
    ],
)
def test_what_does_not_fit_is_refused(build, words):
    with pytest.raises(InputError, match=words):
        build()
