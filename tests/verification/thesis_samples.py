"""The optimised mounts of the compressor, and how far results lie apart."""

import numpy as np

from deboom.physics.rigid_body import rotation_matrix

# thesis, table 11, in m, rad and N/m; axial = local x
POSITIONS = 1e-3 * np.array(
    [[-155.92, 3.750, 19.98], [-19.44, -67.495, 77.98], [-8.46, 73.576, 82.34]]
)
ORIENTATIONS = rotation_matrix(
    np.radians([[-4.9, -4.9, 185.0], [2.5, 43.3, 87.5], [2.2, 131.5, 89.4]])
)
STIFFNESS = 1e3 * np.array([[29.9, 10.8, 12.2], [29.7, 12.9, 11.8], [29.2, 10.6, 10.3]])


def deviation(value, reference):
    return np.linalg.norm(value - reference) / np.linalg.norm(reference)


def complex_normal(rng, *shape):
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)
