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

import numpy as np

import deboom

# the data in a clone, or downloaded beside this file
DATA = next(p for p in (Path("../../tests/data/bicycle-inertia"), Path()) if p.exists())


def read(name):
    """Return value and standard deviation of each line ``key = value+/-deviation``."""
    lines = [line.partition("=") for line in (DATA / name).read_text().splitlines()]
    pairs = {key.strip(): text.partition("+/-") for key, _, text in lines}
    return {key: (float(value), float(error or 0)) for key, (value, _, error) in pairs.items()}


# %%
# A rod of known size hangs on the wire first; the wheel swings about its rim, then on the wire.

names, swung, published = [], [], []
for bicycle in ("Browser", "Pista"):
    sheet, benchmark = read(f"{bicycle}Measured.txt"), read(f"{bicycle}Benchmark.txt")
    mass, length, diameter = sheet["mP"][0], sheet["lP"][0], sheet["dP"][0]
    rod = mass / 12 * (3 * (diameter / 2) ** 2 + length**2), 0.0
    swung += [
        deboom.torsion_inertia(sheet["TtF1"], sheet["TtP1"], rod),
        deboom.pendulum_inertia(sheet["mF"], sheet["lF"], sheet["TcF1"], sheet["g"]),
    ]
    published += [benchmark["IFxx"], benchmark["IFyy"]]
    names += [f"{bicycle}, about a diameter", f"{bicycle}, about the axle"]

# %%
# Both bicycles, with two standard deviations, beside the printed numbers.

groups = {"swing tests and deboom": swung, "as published": published}
bounds = {}
for label, pairs in groups.items():
    value, deviation = np.transpose(pairs)
    bounds[label] = (value, value - 2 * deviation, value + 2 * deviation)
panel = deboom.plot.IntervalPanel("inertia [kg m²]", bounds, title="Front wheels of two bicycles")
deboom.plot.interval_panels(names, [panel])
