"""
Hoses as beams
==============

Refrigerant hoses pull at a compressor in operation. A hammer test with and without them (thesis,
figure 60) identifies their stiffness, mass and loss: a demonstrator for straight uniform hoses.
"""

import json
import tempfile
from pathlib import Path

import numpy as np

import deboom
from deboom.bench.compressor_rig import OperationPlan

folder = Path(tempfile.mkdtemp()) / "running"
deboom.bench.write_operating_test(folder, seed=1, plan=OperationPlan(hammer_with_hoses=True))
test = deboom.read_operating_test(folder)
hoses = deboom.identify_hoses(test, deboom.identify(test.hammer))
hoses.table

# %%
# The true hoses scatter around their drawing; the truth is read for this comparison only. Bending,
# mass and loss come closer than the catalogue says; torsion matters little and is known least.

truth = json.loads((folder / "truth" / "operation.json").read_text(encoding="utf-8"))["hoses"]
numbers = hoses.table["number"].unique()
true = np.array([[hose[name.replace(" ", "_")] for name in numbers] for hose in truth]).ravel()
half_width = 1.96 * hoses.table["standard deviation"]
drawn, identified = hoses.table["drawn"], hoses.table["identified"]
bounds = {
    "drawn": (drawn, drawn, drawn),
    "identified, 95 %": (identified, identified - half_width, identified + half_width),
}
panel = deboom.plot.IntervalPanel(
    "number over its true value [1]",
    {name: [values / true for values in of] for name, of in bounds.items()},
    title="Two hoses, identified at a compressor",
)
rows = hoses.table["hose"] + ", " + hoses.table["number"]
deboom.plot.interval_panels(rows.tolist(), [panel])
