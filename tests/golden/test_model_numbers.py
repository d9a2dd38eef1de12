"""What the models say of fixed designs and fixed measurements, pinned to what it was."""

import json

import numpy as np
import pytest
from write_model_numbers import NUMBERS, PATH, compute

ITERATIVE = {"levels, amplitude-dependent motion": 1e-6}
"""Parts that an iteration ends, which another processor may end elsewhere within its tolerance."""


# those of the compressor are held by the tests of its studies
@pytest.mark.parametrize("name", [name for name in NUMBERS if name != "compressor"])
def test_numbers_stay(name):
    pinned = json.loads(PATH.read_text(encoding="utf-8"))[name]
    found = compute(name)
    assert found.keys() == pinned.keys()
    for column, expected in pinned.items():
        numbers, values = np.array(expected), np.array(found[column])
        scale = np.nanmax(np.abs(numbers))
        limit = ITERATIVE.get(name, 1e-9) * max(scale, 1e-12)
        np.testing.assert_allclose(values, numbers, rtol=0.0, atol=limit, err_msg=column)
