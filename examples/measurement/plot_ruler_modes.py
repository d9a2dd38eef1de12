"""
Modes of a measured ruler
=========================

A hammer went along ten lines of a clamped ruler with one accelerometer (data of pydvma). Poles
that several orders of the polynomial agree on are modes; their ratios are those of a clamped
beam. The thesis does the same with a car (figure 43).

Data to download:
:download:`npz <../../../tests/data/pydvma-ruler/ruler_ten_lines_0-600Hz.npz>`.
"""

from pathlib import Path

import numpy as np

import deboom
from deboom.measurement.channels import Frf
from deboom.physics.frf import FrfForm

# the data in a clone, or downloaded beside this file
DATA = next(p for p in (Path("../../tests/data/pydvma-ruler"), Path()) if p.exists())
BAND = (20.0, 400.0)

with np.load(DATA / "ruler_ten_lines_0-600Hz.npz") as measured:
    frequency, transfer = measured["freq_hz"], measured["tf"]
names = tuple(f"line {k}" for k in range(transfer.shape[1]))
frf = Frf(frequency, transfer[:, :, np.newaxis], names, ("hammer",), "any")

# %%
# Poles of all orders, and the clusters that they form.

chart = deboom.poles_over_orders(frf, FrfForm.INERTANCE, BAND, largest_order=16)
clusters = deboom.pole_clusters(chart)
# accelerometer and cable bring one broad pole; bending is damped by a few per cent at most
modes = np.array([cluster.frequency for cluster in clusters if cluster.damping < 0.03])

# %%
# The stabilisation chart: where the orders agree, there is a mode.

inside = (frequency >= BAND[0]) & (frequency <= BAND[1])
level = 20 * np.log10(np.abs(transfer[inside]).sum(axis=1))
deboom.plot.stabilisation_chart(
    frequency[inside],
    level,
    chart.frequency,
    chart.order,
    chart.stable,
    modes,
    level_label="sum of the FRFs [dB]",
)

# %%
# A uniform cantilever has its frequencies at 1 : 6.27 : 17.5 : 34.4; the ruler's first one
# lies below the band, so the ratios to the first mode inside it are 1 : 2.80 : 5.49 : 9.07.

print((modes / modes[0]).round(2))
