"""The compressor of the bench's data, assembled a second time out of its parameters alone."""

import numpy as np
from scipy.spatial.transform import Rotation

from deboom.bench.compressor_truth import COMPRESSOR_DATA
from deboom.bench.powertrain import read_data

DATA = read_data(COMPRESSOR_DATA)


def cross(r):
    """``r × b = cross(r) b``, column by column."""
    return np.cross(r, np.eye(3)).T


def rows_along(angles, positions, degrees=False):
    """Motion of the body to that of points along their own axes, three rows each."""
    turns = Rotation.from_euler("xyz", angles, degrees=degrees).as_matrix()
    return np.vstack(
        [
            turn.T @ np.hstack([np.eye(3), -cross(r)])
            for turn, r in zip(turns, positions, strict=True)
        ]
    )


def table11():
    """Mass matrix, mount axes and their static stiffness."""
    truth = DATA["truth"]
    mass, centre = truth["mass_kg"], cross(truth["centre_of_gravity_m"])
    xx, yy, zz, xy, xz, yz = truth["inertia_about_cog_kg_m2_xx_yy_zz_xy_xz_yz"]
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - mass * centre @ centre
    whole = np.block([[mass * np.eye(3), -mass * centre], [mass * centre, about]])
    axes = rows_along(truth["mount_rotation_deg"], truth["mount_position_m"], degrees=True)
    stiffness = np.ravel(truth["mount_static_stiffness_N_per_m_axial_radial1_radial2"])
    return whole, axes, stiffness


def gain(f):
    truth = DATA["truth"]
    (a, b, c), (d, e, g) = truth["gain_real_vinf_m_w0"], truth["gain_imag_vinf_m_w0"]
    return a - 1 / (b * f + c) + 1j * (d - 1 / (e * f + g))


def mounts(f, storage=1.0, loss=1.0):
    """Dynamic stiffness of the mounts at the virtual point, in another state."""
    _, axes, stiffness = table11()
    felt = storage * gain(f).real + 1j * loss * gain(f).imag
    return axes.T @ np.diag(felt * stiffness) @ axes
