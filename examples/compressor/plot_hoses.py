"""
Hoses as beams
==============

Refrigerant hoses pull at a compressor in operation. Struck with and without them (thesis, figure
60), it tells their stiffness, mass and loss: a demonstrator for straight uniform hoses.
"""

import json
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import deboom
from deboom.bench.compressor_rig import OperationPlan

folder = Path(tempfile.mkdtemp()) / "running"
deboom.bench.write_operating_test(folder, seed=1, plan=OperationPlan(hammer_with_hoses=True))
test = deboom.read_operating_test(folder)
found = deboom.identify_hoses(test, deboom.identify(test.hammer))
found.table

# %%
# The true hoses scatter around their drawing; the truth is read for this comparison only.

truth = json.loads((folder / "truth" / "operation.json").read_text(encoding="utf-8"))["hoses"]
names = [number.replace(" ", "_") for number in found.table["number"].unique()]
true = np.array([[hose[name] for name in names] for hose in truth]).ravel()
drawn, identified = found.table["drawn"] / true, found.table["identified"] / true

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
place = np.arange(len(true))
axes.bar(place - 0.2, drawn, 0.4, label="drawn")
axes.bar(place + 0.2, identified, 0.4, label="identified")
axes.axhline(1, color="k", linewidth=0.8)
axes.set(ylabel="number over truth [1]", xticks=place, ylim=(0.6, 1.4))
axes.set_xticklabels(found.table["number"], rotation=45, ha="right")
axes.legend()

# %%
# Bending, mass and loss come closer than the catalogue says; torsion matters little and is known
# least.

bending = (found.table["number"] == "bending").to_numpy()
print(f"bending off by {100 * np.abs(identified[bending] - 1).max():.1f} %")
assert np.abs(identified[bending] - 1).max() < 0.06
assert np.median(np.abs(identified - 1)) < 0.5 * np.median(np.abs(drawn - 1))
assert found.alarms == ()
