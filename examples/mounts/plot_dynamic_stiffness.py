"""
Dynamic stiffness from a bench campaign
=======================================

From the raw channels of an engine test bench to the operating dynamic stiffness of the mounts
(thesis, figures 23 to 25). The bench is virtual, so the truth behind its files is known.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
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
# One run of the torque strut mount beside the truth, which no identification reads.

with np.load(folder / "truth" / "M1.npz") as truth:
    run = truth["runs"][0]
    true = truth["stiffness"][0, :, list(truth["channels"]).index("TSM x")]
measured = mounts.directions["TSM x"].measured
lines = measured.run == run
found, frequency = measured.stiffness[lines], measured.frequency[lines]

figure, axes = plt.subplots(layout="constrained")
axes.plot(frequency, np.abs(true) / 1e3, "k", label="truth")
axes.plot(frequency, np.abs(found) / 1e3, ".", label="from the channels")
axes.set(xlabel="frequency [Hz]", ylabel=f"|K| of TSM x in {run} [N/mm]")
axes.legend()

error = np.median(np.abs(found - true) / np.abs(true))
print(
    f"median error {100 * error:.1f} %, stated half width of 95 % "
    f"{100 * table.loc[('TSM', 'x'), 'half_width_95 [1]']:.1f} %"
)
assert error < 0.02
assert not table.loc[("EnM", "y"), "identified"]
