"""
A compressor from hammer blows
==============================

Mass, centre of gravity, inertia, stiffness and gain of a mounted refrigerant compressor from 18
impacts (thesis, chapter 4 and figure 55), with standard deviations that contain the errors of the
sensors as well.
"""

import json
import tempfile
from pathlib import Path

import numpy as np

import deboom

folder = Path(tempfile.mkdtemp()) / "hammer"
deboom.bench.write_compressor_test(folder, seed=1)
test = deboom.read_inertance_test(folder)
compressor = deboom.identify(test)
table = compressor.table.set_index("quantity")
table.head(10)

# %%
# The bench knows the truth: the intervals contain it.

truth = json.loads((folder / "truth" / "truth.json").read_text(encoding="utf-8"))
rows = ["mass", "Ixx", "Iyy", "Izz"]
true = np.array([truth["mass_kg"], *(1e4 * np.diag(truth["inertia_kg_m2"]))])
value, deviation = table.loc[rows, ["value", "standard deviation"]].to_numpy().T
bounds = (value, value - 1.96 * deviation, value + 1.96 * deviation)
panel = deboom.plot.IntervalPanel(
    "difference to the truth [%]",
    {"identified, 95 %": [100 * (of / true - 1) for of in bounds]},
    title="Mass and moments of inertia from 18 hammer blows",
)
deboom.plot.interval_panels(rows, [panel])

# %%
# Driving point along z at the virtual point: measured, and as the model returns it.

lines, model = compressor.inertance.frequency, compressor.calibrated.model
stiffness = model.gain.at(lines)[:, np.newaxis, np.newaxis] * model.stiffness
omega = 2 * np.pi * lines[:, np.newaxis, np.newaxis]
identified = np.linalg.inv(model.mass_matrix - stiffness / omega**2)[:, 2, 2]
panel = deboom.plot.CurvePanel(
    "Measured and identified inertance z/z",
    lines,
    {"identified": np.abs(identified)},
    points={"measured": (lines, np.abs(compressor.inertance.values[:, 2, 2]))},
    logarithmic=True,
)
deboom.plot.curve_panels([panel], y_label="inertance z/z [1/kg]")

# %%
# Six rigid-body modes, and the reasons not to trust the model: none.

print("modes [Hz]", compressor.modes.frequency.round(1), compressor.modes.leading)
print("alarms", compressor.alarms)
