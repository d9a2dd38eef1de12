"""SPLV, gradient and peaks of a small fleet, pinned to what they were."""

from __future__ import annotations

import json

import numpy as np
import pytest
from write_vehicles_splv import PATH, compute


@pytest.mark.parametrize("name", ["splv", "gradient", "peaks"])
def test_numbers_stay(name):
    pinned = json.loads(PATH.read_text(encoding="utf-8"))
    np.testing.assert_allclose(compute()[name], pinned[name], rtol=1e-11, atol=1e-9)
