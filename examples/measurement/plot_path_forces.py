"""
Forces at the paths, three ways
===============================

A source on two mounts shakes a flexible receiver (thesis, figure 8). Interface forces by inversion
of the receiver's accelerances and by mount stiffness agree with the truth; blocked forces, found in
situ, belong to the source and are others.
"""

import numpy as np

import deboom
from deboom.measurement.channels import Frf, Spectrum
from deboom.physics.transfer_path import assembled_frf, interface_force, mounted_source

rng = np.random.default_rng(1)
lines = np.arange(20.0, 140.5, 0.5)
omega = 2 * np.pi * lines[:, np.newaxis, np.newaxis]
paths, indicators = ("left z", "right z"), ("rail", "dash", "floor", "tunnel")

# %%
# The source is a rigid bar on two mounts; the receiver has five modes, seen at six places.

source = -np.linalg.inv([[12.0, 3.0], [3.0, 10.0]]) / omega**2
stiffness = np.array([2.0e5, 1.6e5]) * (1 + 0.1j) * np.ones((lines.size, 1))
natural, shapes = 2 * np.pi * np.array([31.0, 48.0, 77.0, 101.0, 128.0]), rng.normal(size=(5, 6))
modal = 1 / (20.0 * (natural**2 - omega[:, 0] ** 2 + 0.06j * natural * omega[:, 0]))
body = np.einsum("mo,fm,mi->foi", shapes, modal, shapes[:, :2])
free = (source @ np.array([30.0, 12.0])[:, np.newaxis])[:, :, 0]

behind = mounted_source(source, stiffness)
truth = interface_force(behind, body[:, :2], free)

# %%
# Inversion uses accelerations with 1 % noise, mount stiffness the motion on both sides of the
# mounts.

accelerance = Frf(lines, -(omega**2) * body[:, 2:], indicators, paths, "m/s^2/N")
exact = (accelerance @ Spectrum(lines, truth, paths, "N")).values
noise = rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape)
response = Spectrum(lines, exact + 0.007 * np.abs(exact).mean() * noise, indicators, "m/s^2")
inverted = deboom.forces_by_inversion(accelerance, response).force.values

above = free - np.einsum("fij,fj->fi", source, truth)
below = np.einsum("fij,fj->fi", body[:, :2], truth)
motion = (Spectrum(lines, values, paths, "m") for values in (above, below))
mounts = Spectrum(lines, stiffness, paths, "N/m")
deflected = deboom.forces_by_mount_stiffness(mounts, *motion).force.values

joined = -(omega**2) * assembled_frf(body[:, 2:], body[:, :2], behind, behind)
in_situ = deboom.blocked_forces_in_situ(Frf(lines, joined, indicators, paths, "m/s^2/N"), response)

panel = deboom.plot.CurvePanel(
    "Force of a source on its left mount",
    lines,
    {
        "true interface force": np.abs(truth[:, 0]),
        "mount stiffness": np.abs(deflected[:, 0]),
        "blocked force, in situ": np.abs(in_situ.force.values[:, 0]),
    },
    points={"inversion": (lines[::4], np.abs(inverted[::4, 0]))},
    logarithmic=True,
)
deboom.plot.curve_panels([panel], y_label="force at left z [N]", dashed=["mount stiffness"])
