"""
Alike cars do not sound alike
=============================

Noise transfer functions and levels of five cars of one group over each other (thesis, section
2.4.3 and figure 10, which finds 10 to 15 dB between alike cars). Four of the drawn ones are alike,
the fifth carries a battery.
"""

import numpy as np

import deboom
from deboom.bench.fleet import LITERATURE_SCATTER, load_fleet, noise_transfer
from deboom.bench.layout import FREQUENCY
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.powertrain import load_bench
from deboom.measurement.uncertainty import level_spread
from deboom.physics.sound_level import spl

# %%
# The same powertrain on the same mounts, at full load in fifth gear, in every car.

names = [f"U06-{number}" for number in range(1, 6)]
run = true_run(load_bench(), PlannedRun(5, 220.0), FREQUENCY)
path = run.channels.index("TSM x")


def heard(seed, scatter=1.0):
    """Return the functions of TSM x [dB re 1 mPa/N] and the levels [dB(A)] of a drawn fleet."""
    fleet = load_fleet(seed, scatter)
    transfer = [noise_transfer(fleet.bodies[name], fleet.cabin, FREQUENCY) for name in names]
    functions = [20 * np.log10(np.abs(values[:, path]) / 1e-3) for values in transfer]
    return functions, [spl((values * run.path_force).sum(axis=1), FREQUENCY) for values in transfer]


functions, levels = heard(1)
panels = [
    deboom.plot.CurvePanel(
        title, FREQUENCY, dict(zip(names, values, strict=True)), y_label=f"level [{unit}]"
    )
    for title, values, unit in (
        ("Noise transfer from TSM x", functions, "dB re 1 mPa/N"),
        ("Sound at full load", levels, "dB(A)"),
    )
]
deboom.plot.curve_panels(panels, columns=2, dashed=names[-1:])

# %%
# Largest minus smallest over four alike cars, median over the lines. The fleet of deboom differs by
# less than the thesis's: panels of one drawing differ by a few per cent. Fleets may be drawn wider,
# with ``deboom bench write --body-scatter 2`` on the command line.

for scatter in (1.0, LITERATURE_SCATTER):
    spreads = [level_spread(heard(seed, scatter)[1][:4]).quantile(0.5) for seed in range(2, 8)]
    print(f"scatter {scatter:g}: {np.median(spreads):.1f} dB")
