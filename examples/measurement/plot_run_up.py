"""
From a run over time to the stiffness's spectra
===============================================

A run-up of the virtual bench, recorded over time with a tacho: `deboom.tracked_run` makes the
spectra of the dominant order, which the truth of steady running judges.
"""

import tempfile
from pathlib import Path

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
recorded = deboom.read_time_run(folder, f"{plan.runs[0].name}_time")
tracked = deboom.tracked_run(recorded)
print("\n".join(tracked.report()))

# %%
# A second of the record, and the order that it contains beside the spectra of steady running.

steady = campaign.runs[0].acceleration
spectrum = tracked.run.acceleration
channel = int(np.abs(steady.values).max(axis=0).argmax())
name = steady.channels[channel]
second = slice(0, int(recorded.sample_rate))
panels = [
    deboom.plot.CurvePanel(
        f"Record of {name}",
        np.arange(second.stop) / recorded.sample_rate,
        {"record": recorded.acceleration[second, channel]},
        x_label="time [s]",
        y_label="acceleration [m/s²]",
    ),
    deboom.plot.CurvePanel(
        f"Its order {tracked.run.order:g}",
        steady.frequency,
        {"steady running": np.abs(steady.values[:, channel])},
        points={"out of the record": (spectrum.frequency, np.abs(spectrum.values[:, channel]))},
        x_label="frequency [Hz]",
        y_label="acceleration [m/s²]",
    ),
]
deboom.plot.curve_panels(panels, columns=2)
