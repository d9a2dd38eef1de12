"""
The unbalance inside a running compressor
=========================================

Speed sweeps and the model of the hammer test give the unbalance that nobody can weigh (thesis,
section 4.2 and figures 61 and 62): 20 g mm and 1200 g mm² in this virtual compressor, beside gas
forces.
"""

import tempfile
from pathlib import Path

import numpy as np

import deboom

folder = Path(tempfile.mkdtemp()) / "running"
deboom.bench.write_operating_test(folder, seed=1)
test = deboom.read_operating_test(folder)
rotor = deboom.unbalance(test, deboom.identify(test.hammer))
rotor.table

# %%
# Line by line, with the band of everything that is not known exactly. Gas that rotates with the
# rotor adds to the curve below 3000 1/min and is not in the band: there the truth lies outside.

panels = []
for sweep in rotor.chosen.sweeps:
    band = sweep.static.both
    panel = deboom.plot.CurvePanel(
        f"Static unbalance, sweep {sweep.sweep}",
        sweep.speed,
        {"identified": 1e6 * np.abs(band.value), "truth": np.full(sweep.speed.size, 20.0)},
        ranges={"identified": (1e6 * band.lower, 1e6 * band.upper)},
    )
    panels.append(panel)
deboom.plot.curve_panels(
    panels,
    x_label="speed [1/min]",
    y_label="static unbalance [g mm]",
    columns=2,
    dashed=["truth"],
    share_y=True,
)

# %%
# The fit over all lines separates the unbalance from gas that turns along with it.

sources = rotor.chosen.sources
static, dynamic = 1e6 * abs(sources.static.value), 1e9 * abs(sources.dynamic.value)
print(f"{static:.2f} g mm, {dynamic:.0f} g mm², alarms {rotor.alarms}")
