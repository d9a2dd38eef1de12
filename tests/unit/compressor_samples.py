"""An identified compressor that nobody had to strike."""

import numpy as np

from deboom.compressor.identify import IdentifiedCompressor
from deboom.compressor.model import CompressorModel, GainFactor
from deboom.compressor.parameters import MinimalParameters


def identified(**changes):
    """Make a compressor whose 35 parameters are known to 1 %, independent of each other."""
    parameters, rng = MinimalParameters(0.0591), np.random.default_rng(1)
    stiffness = np.diag([7e4, 5e4, 6e4, 400.0, 600.0, 650.0])
    gain = GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5])
    centre, inertia = np.array([0.0015, -0.002, 0.001]), np.diag([0.0158, 0.0291, 0.0302])
    values = parameters.values_of(CompressorModel(7.2, centre, inertia, stiffness, gain))
    fields = {
        "name": "test of a pump, 20 °C",
        "model": parameters.model(values),
        "length": 0.0591,
        "reference_frequency": 20.0,
        "parameter_names": parameters.names,
        "values": values,
        "covariance": np.diag(np.maximum(0.01 * np.abs(values), 1e-6) ** 2),
        "channels": ("A1 x", "A1 y", "A1 z"),
        "response": rng.standard_normal((3, 6)),
        "impacts": ("I01",),
        "excitation": rng.standard_normal((1, 6)),
        "placement_names": ("hammer gain",),
        "placement_errors": np.array([0.01]),
        "placement_deviations": np.array([0.002]),
        "reduced_chi": 0.98,
        "bands": ((10.0, 30.0), (100.0, 150.0)),
        "alarms": (),
        "inputs_sha256": {"frf.uff": "00ff"},
    }
    return IdentifiedCompressor(**(fields | changes))
