"""The dynamic stiffness of an identified compressor as a characteristic to be judged."""

import numpy as np
import pytest

from deboom.compressor.acceptance import Bounds
from deboom.compressor.component_limits import StiffnessLimit, stiffness_characteristic
from deboom.compressor.gain import GainFactor
from deboom.compressor.identified import IdentifiedCompressor
from deboom.compressor.minimal_parameters import MinimalParameters
from deboom.compressor.model import CompressorModel

LENGTH = 0.0591


def identified(**changes):
    """Make a compressor whose 35 parameters are known to 1 %, independent of each other."""
    parameters = MinimalParameters(LENGTH)
    stiffness = np.diag([7e4, 5e4, 6e4, 400.0, 600.0, 650.0])
    gain = GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5])
    inertia = np.diag([0.0158, 0.0291, 0.0302])
    values = parameters.values_of(CompressorModel(7.2, np.zeros(3), inertia, stiffness, gain))
    fields = {
        "name": "pump",
        "model": parameters.model(values),
        "length": LENGTH,
        "reference_frequency": 20.0,
        "parameter_names": parameters.names,
        "values": values,
        "covariance": np.diag(np.maximum(0.01 * np.abs(values), 1e-6) ** 2),
        "channels": (),
        "response": np.zeros((0, 6)),
        "impacts": (),
        "excitation": np.zeros((0, 6)),
        "placement_names": (),
        "placement_errors": np.zeros(0),
        "placement_deviations": np.zeros(0),
        "reduced_chi": 1.0,
        "bands": ((10.0, 30.0), (100.0, 150.0)),
        "alarms": (),
        "inputs_sha256": {},
    }
    return IdentifiedCompressor(**(fields | changes))


def limit(direction="x", band=(20.0, 20.0)):
    return StiffnessLimit(direction, band, Bounds(at_most=1.0))


def test_the_stiffness_at_the_reference_line():
    """There Re v is 1, so that |K| is K times |v|, and only K and v's loss are uncertain."""
    kept = identified()
    found = stiffness_characteristic(kept, limit("rz"))
    size = abs(kept.model.gain.at([20.0])[0]) * kept.model.stiffness[5, 5]
    assert found.values == pytest.approx([size])
    assert found.values[0] > kept.model.gain.real.at(20.0) * kept.model.stiffness[5, 5]
    assert 0.01 <= found.deviations[0] / found.values[0] < 0.02


def test_the_deviation_is_that_of_drawn_parameters():
    kept = identified()
    found = stiffness_characteristic(kept, limit("y", (15.0, 60.0)))
    rng, parameters = np.random.default_rng(3), MinimalParameters(LENGTH)
    drawn = []
    for _ in range(400):
        model = parameters.model(
            kept.values + rng.standard_normal(35) * np.sqrt(np.diag(kept.covariance))
        )
        drawn.append(np.abs(model.gain.at(found.lines)) * model.stiffness[1, 1])
    assert found.deviations == pytest.approx(np.std(drawn, axis=0), rel=0.2)


def test_a_model_with_an_alarm_proves_nothing():
    kept = identified(alarms=("The residuals are 3 times the noise.",))
    assert "not to be trusted: The residuals" in stiffness_characteristic(kept, limit()).doubt


def test_a_band_beyond_the_fitted_lines_proves_nothing():
    kept = identified()
    assert stiffness_characteristic(kept, limit(band=(10.0, 150.0))).doubt == ""
    assert "10–150 Hz" in stiffness_characteristic(kept, limit(band=(10.0, 200.0))).doubt
