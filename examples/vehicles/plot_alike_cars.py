"""
Alike cars do not sound alike
=============================

Noise transfer functions and levels of five cars of one group over each other (thesis, section
2.4.3 and figure 10, which finds 10 to 15 dB between alike cars). Four of the drawn ones are alike,
the fifth carries a battery.
"""

import matplotlib.pyplot as plt
import numpy as np

from deboom.bench.fleet import LITERATURE_SCATTER, load_fleet, noise_transfer
from deboom.bench.layout import FREQUENCY
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.powertrain import load_bench
from deboom.measurement.uncertainty import level_spread
from deboom.physics.sound_level import spl

# %%
# The same powertrain on the same mounts, at full load in fifth gear, in every car.

names = [f"U06-{number}" for number in range(1, 6)]
fleet, run = load_fleet(1), true_run(load_bench(), PlannedRun(5, 220.0), FREQUENCY)
transfer = [noise_transfer(fleet.bodies[name], fleet.cabin, FREQUENCY) for name in names]
path = run.channels.index("TSM x")
functions = np.array([20 * np.log10(np.abs(values[:, path]) / 1e-3) for values in transfer])
levels = np.array([spl((values * run.path_force).sum(axis=1), FREQUENCY) for values in transfer])

figure, (upper, lower) = plt.subplots(2, 1, figsize=(6.4, 6.4), layout="constrained", sharex=True)
spreads = {}
for axes, values, label in (
    (upper, functions, "TSM x [dB re 1 mPa/N]"),
    (lower, levels, "sound pressure [dB(A)]"),
):
    alike, every = level_spread(values[:4]), level_spread(values)
    axes.fill_between(FREQUENCY, every.lowest, every.highest, color="0.9", label="span of all five")
    for name, curve in zip(names, values, strict=True):
        dashed = name == names[-1]
        axes.plot(FREQUENCY, curve, linestyle="--" if dashed else "-", label=name)
    axes.set(ylabel=label)
    spreads[label] = alike.quantile(0.5), every.quantile(0.5)
upper.legend(ncols=2, fontsize="small")
lower.set(xlabel="frequency [Hz]")

# %%
# Largest minus smallest, median over the lines.

for label, (alike, every) in spreads.items():
    print(f"{label}: {alike:.1f} dB over four alike cars, {every:.1f} dB with the fifth")
assert all(every > alike > 2.0 for alike, every in spreads.values())

# %%
# Alike cars of the frozen fleet differ by less than the thesis's: the prior that it was drawn from
# gives panels of one drawing a few per cent of mass and stiffness. Fleets may be drawn wider, with
# ``deboom bench write --body-scatter 2`` on the command line.

median = {}
for factor in (1.0, LITERATURE_SCATTER):
    spans = []
    for seed in range(2, 12):
        drawn = load_fleet(seed, factor)
        cars = [noise_transfer(drawn.bodies[name], drawn.cabin, FREQUENCY) for name in names[:4]]
        heard = [spl((values * run.path_force).sum(axis=1), FREQUENCY) for values in cars]
        spans.append(level_spread(heard).quantile(0.5))
    median[factor] = float(np.median(spans))
print({f"scatter {factor:g}": f"{spread:.1f} dB" for factor, spread in median.items()})
assert median[1.0] < 10.0 < median[LITERATURE_SCATTER]
