"""
Dynamic stiffness from a bench campaign
=======================================

From the raw channels of an engine test bench to the operating dynamic stiffness of the mounts
(thesis, figures 23 to 25). The bench is virtual, so the truth behind its files is known.
"""

import tempfile
from pathlib import Path

import numpy as np

import deboom
from deboom.bench.campaign import training_plan

# %%
# 27 runs in gears 5 to 7 with one set of mounts, written and read as a laboratory's files.

folder = Path(tempfile.mkdtemp()) / "campaign"
deboom.bench.write_campaign(folder, seed=1, plan=training_plan("M1"))
campaign = deboom.read_campaign(folder)

# %%
# Sensors become motion and force at the virtual points; their quotient is the stiffness. EnM y is
# hardly loaded in operation: a direction that the sensors do not resolve is marked, not guessed.

mounts = deboom.characterise(campaign, "M1")
table = mounts.table.set_index(["mount", "axis"])
table[["identified", "half_width_95 [1]", "r2_force [1]"]]

# %%
# One run of each mount along its main axis, beside the truth, which no identification reads.

panels = []
with np.load(folder / "truth" / "M1.npz") as truth:
    run, channels, true = truth["runs"][0], list(truth["channels"]), truth["stiffness"][0]
for name in ("EnM z", "GeM z", "TSM x"):
    measured = mounts.directions[name].measured
    lines = measured.run == run
    points = (measured.frequency[lines], np.abs(measured.stiffness[lines]) / 1e3)
    curve = np.abs(true[:, channels.index(name)]) / 1e3
    panel = deboom.plot.CurvePanel(
        name, points[0], {"truth": curve}, points={"from the channels": points}
    )
    panels.append(panel)
deboom.plot.curve_panels(panels, y_label=f"|K| in {run} [N/mm]")
