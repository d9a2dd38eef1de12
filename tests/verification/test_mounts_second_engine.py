"""Forces of a second engine, predicted from the mounts of the first one, against its cells."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.mounts.surface_forces import predicted_forces

EXAMPLE = Path(__file__).parents[2] / "examples" / "mounts" / "plot_second_engine.py"


@pytest.mark.slow("characterises a campaign and predicts another engine's")
def test_forces_of_a_second_engine_are_predicted_along_and_across():
    """Errors along and across; a stiffness across follows the force along the main axis."""
    example = runpy.run_path(str(EXAMPLE))
    mounts, maps, forces = (example[name] for name in ("mounts", "maps", "forces"))
    assert set(forces) <= set(maps)
    strut = forces["TSM x"]
    assert strut.error < 0.04
    assert forces["TSM z"].error < 0.05
    assert strut.inside.mean() > 0.60
    assert strut.lines.force.size == np.sum(~maps["TSM x"].near_floor) == strut.inside.size
    peaks = [np.abs(force).max() for force in (strut.force, strut.measured)]
    assert peaks[0] == pytest.approx(peaks[1], rel=0.05)
    alone = {"TSM z": maps["TSM z"]}
    (torque_strut,) = (mount for mount in mounts if mount.mount.name == "TSM")
    with pytest.raises(InputError, match="measured no TSM x, along which mount TSM carries"):
        predicted_forces([torque_strut], alone, example["how"].regressor)
