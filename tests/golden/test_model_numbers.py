"""What the models say of fixed designs and fixed measurements, pinned to what it was."""

import json

import numpy as np
import pytest
from write_model_numbers import BENCHES, NUMBERS, PATH, compute

WIDER = {
    "levels, amplitude-dependent motion": 1e-6,
    **{f"bench {kind}": 1e-6 for kind, *_ in BENCHES},
}
"""An iteration, which may end elsewhere on another processor, and last digits of texts."""


WHOLE = "characterised stiffness"
SLOW = pytest.mark.slow("writes, reads and characterises a whole campaign")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=SLOW) if name == WHOLE else name for name in NUMBERS]
)
def test_numbers_stay(name):
    pinned = json.loads(PATH.read_text(encoding="utf-8"))[name]
    computed = compute(name)
    assert computed.keys() == pinned.keys()
    for column, expected in pinned.items():
        numbers, values = np.array(expected), np.array(computed[column])
        scale = np.nanmax(np.abs(numbers))
        limit = WIDER.get(name, 1e-9) * max(scale, 1e-12)
        np.testing.assert_allclose(values, numbers, rtol=0.0, atol=limit, err_msg=column)
