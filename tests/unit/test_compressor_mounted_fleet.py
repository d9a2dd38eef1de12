"""How sure the stiffness of a compressor's mounts is: gain of the rubber, shares of the mounts."""

from types import SimpleNamespace

import numpy as np
import pytest

from deboom.compressor import mounted_fleet
from deboom.compressor.mounted_fleet import MountedFleet


def test_the_deviation_of_a_stiffness_is_that_of_gain_and_shares(monkeypatch):
    """A gain of 2 ± 0.06 and shares of 4 % make hypot(3 %, 4 %)."""

    def propagated(calibrated, quantity):
        assert quantity(calibrated.model) == [2.0]
        return np.array([[0.06**2]])

    monkeypatch.setattr(mounted_fleet, "propagated", propagated)
    gain = SimpleNamespace(at=lambda lines: np.full(len(lines), 2.0j))
    calibrated = SimpleNamespace(model=SimpleNamespace(gain=gain))
    fleet = SimpleNamespace(
        reference_line=20.0,
        identified=SimpleNamespace(calibrated=calibrated),
        running=SimpleNamespace(shares=SimpleNamespace(deviation_of_mean=lambda _: 0.04)),
    )
    deviation = MountedFleet.deviation_at_reference(fleet, np.full((3, 3), 1 / 9))
    assert deviation == pytest.approx(0.05)
