"""
Inertia of a measured bicycle wheel
===================================

Swing tests of two bicycles, published with their deviations: periods as a pendulum and on a
torsion wire give the inertia of the front wheel, with the mass matrix of a body at its pivot.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from deboom.physics.rigid_body import mass_matrix, mass_properties

DATA = Path("../../tests/data/bicycle-inertia")


def read(name):
    """Return value and standard deviation of each line ``key = value+/-deviation``."""
    lines = [line.partition("=") for line in (DATA / name).read_text().splitlines()]
    pairs = {key.strip(): text.partition("+/-") for key, _, text in lines}
    return {key: (float(value), float(error or 0)) for key, (value, _, error) in pairs.items()}


def wheel(sheet):
    """Return inertia about diameter and axle of the front wheel [kg m²]."""
    rate = {key: (2 * np.pi / value) ** 2 for key, value in sheet.items() if key.startswith("T")}
    rod = sheet["mP"] / 12 * (3 * (sheet["dP"] / 2) ** 2 + sheet["lP"] ** 2)  # hangs on the wire
    at_pivot = sheet["mF"] * sheet["g"] * sheet["lF"] / rate["TcF1"]
    # the same wheel as a 6×6 matrix at the pivot: its lever adds to the inertia there
    lever = mass_matrix(sheet["mF"], np.zeros((3, 3)), [0, 0, sheet["lF"]])[4, 4]
    return np.array([rod * rate["TtP1"] / rate["TtF1"], at_pivot - lever])


# %%
# Both bicycles, beside what their authors printed; deviations by drawing the sheet again.

figure, axes = plt.subplots(layout="constrained")
rng = np.random.default_rng(1)
for place, name in enumerate(("Browser", "Pista")):
    sheet, printed = read(f"{name}Measured.txt"), read(f"{name}Benchmark.txt")
    found = wheel({key: value for key, (value, _) in sheet.items()})
    drawn = [
        wheel({key: value + error * rng.normal() for key, (value, error) in sheet.items()})
        for _ in range(400)
    ]
    published, deviation = np.transpose([printed["IFxx"], printed["IFyy"]])
    at = [place - 0.2, place + 0.2]
    axes.bar(at, found, 0.35, yerr=2 * np.std(drawn, axis=0), color=["C0", "C1"])
    axes.plot(at, published, "kx")
    assert np.allclose(found, published, rtol=1e-9)
    assert np.allclose(np.std(drawn, axis=0), deviation, rtol=0.15)
axes.set(
    ylabel="inertia of the front wheel [kg m²]", xticks=[0, 1], xticklabels=["Browser", "Pista"]
)

# %%
# To another point and back, nothing is lost.

body = mass_properties(mass_matrix(2.0, np.diag([*found[[0, 1, 0]]]), [0.4, 0.0, -0.3]))
print(f"mass {body.mass:.3f} kg, centre {body.centre.round(3)} m")
assert np.allclose(body.inertia, np.diag(found[[0, 1, 0]]))
