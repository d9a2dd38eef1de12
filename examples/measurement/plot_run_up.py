"""
From a run over time to the stiffness's spectra
===============================================

A run-up of the virtual bench, recorded over time with a tacho: `deboom.tracked_run` makes the
spectra of the dominant order, which the truth of steady running judges.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import deboom
from deboom.bench.campaign import NO_ERRORS, CampaignPlan, TimeRunPlan
from deboom.bench.operating_run import PlannedRun

# %%
# One run, order by order and over time, with sensors that have no errors.

plan = CampaignPlan(("M1",), (PlannedRun(5, 220.0),), time_run=TimeRunPlan())
folder = Path(tempfile.mkdtemp()) / "campaign"
deboom.bench.write_campaign(folder, 1, plan, NO_ERRORS)
campaign = deboom.read_campaign(folder)
tracked = deboom.tracked_run(deboom.read_time_run(folder, f"{plan.runs[0].name}_time"))
print("\n".join(tracked.report()))

# %%
# The same lines of the spectra that were written order by order.

steady = campaign.runs[0].acceleration
at = np.searchsorted(steady.frequency, tracked.order.spectrum.frequency - 1e-6)
same = np.abs(steady.frequency[at] - tracked.order.spectrum.frequency) < 1e-6
loud = np.abs(steady.values).max(axis=0).argsort()[-3:]

figure, axes = plt.subplots(layout="constrained")
for channel in loud:
    (line,) = axes.plot(steady.frequency[at], np.abs(steady.values[at, channel]))
    axes.plot(
        tracked.order.spectrum.frequency,
        np.abs(tracked.run.acceleration.values[:, channel]),
        "x",
        color=line.get_color(),
        label=steady.channels[channel],
    )
axes.set(xlabel="frequency of order 1.5 [Hz]", ylabel="acceleration [m/s²]")
axes.legend()

error = np.abs(tracked.run.acceleration.values[same] / steady.values[at][same])[:, loud] - 1
print(f"amplitudes of {same.sum()} lines agree within {100 * np.abs(error).max():.2f} %")
assert np.abs(error).max() < 0.01
