"""
Inertia of a measured bicycle wheel
===================================

Swing tests of two bicycles, published with their deviations: periods as a pendulum and on a
torsion wire give the inertia of the front wheel. What the authors printed is the judge.

Data to download:
:download:`BrowserMeasured.txt <../../../tests/data/bicycle-inertia/BrowserMeasured.txt>`,
:download:`BrowserBenchmark.txt <../../../tests/data/bicycle-inertia/BrowserBenchmark.txt>`,
:download:`PistaMeasured.txt <../../../tests/data/bicycle-inertia/PistaMeasured.txt>`,
:download:`PistaBenchmark.txt <../../../tests/data/bicycle-inertia/PistaBenchmark.txt>`.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import deboom

DATA = Path("../../tests/data/bicycle-inertia")  # or the folder of the files that you downloaded


def read(name):
    """Return value and standard deviation of each line ``key = value+/-deviation``."""
    lines = [line.partition("=") for line in (DATA / name).read_text().splitlines()]
    pairs = {key.strip(): text.partition("+/-") for key, _, text in lines}
    return {key: (float(value), float(error or 0)) for key, (value, _, error) in pairs.items()}


# %%
# A rod of known size hangs on the wire first; the wheel swings about its rim, then on the wire.


def wheel(sheet):
    """Return inertia and deviation about diameter and axle of the front wheel [kg m²]."""
    mass, length, diameter = sheet["mP"][0], sheet["lP"][0], sheet["dP"][0]
    rod = mass / 12 * (3 * (diameter / 2) ** 2 + length**2), 0.0
    about_diameter = deboom.torsion_inertia(sheet["TtF1"], sheet["TtP1"], rod)
    about_axle = deboom.pendulum_inertia(sheet["mF"], sheet["lF"], sheet["TcF1"], sheet["g"])
    return np.array([about_diameter, about_axle])


# %%
# Both bicycles, with two standard deviations, beside the printed numbers.

figure, axes = plt.subplots(layout="constrained")
for place, name in enumerate(("Browser", "Pista")):
    printed = read(f"{name}Benchmark.txt")
    published = np.array([printed["IFxx"], printed["IFyy"]])
    inertia = wheel(read(f"{name}Measured.txt"))
    at = [place - 0.2, place + 0.2]
    axes.bar(at, inertia[:, 0], 0.35, yerr=2 * inertia[:, 1], color=["C0", "C1"])
    axes.plot(at, published[:, 0], "kx")
    print(name, inertia.round(6).tolist())
    assert np.allclose(inertia[:, 0], published[:, 0], rtol=1e-9)
    assert np.allclose(inertia[1, 1], published[1, 1], rtol=1e-3)
axes.set_ylabel("inertia about diameter and axle [kg m²]")
axes.set_xticks([0, 1], ["Browser", "Pista"])
