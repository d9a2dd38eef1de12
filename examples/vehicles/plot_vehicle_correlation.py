"""
Which vehicles go together
==========================

Vehicles whose levels rise and fall with the same designs can share one set of mounts. A design of
experiments over the mounts, and the correlation of all pairs of vehicles with intervals (thesis,
figure 45).
"""

import deboom

platform = deboom.read_platform("u06")
model = platform.model(vehicles="U06", band=(24, 40), motion="coupled")
experiment = deboom.doe(model, model.design_space(), n=96, seed=1)
correlated = deboom.correlation(experiment, resamples=200)

# %%
# Pearson's coefficient of each pair, and the ends of its 95 % interval: the fifth car goes its own
# way.

panels = [
    deboom.plot.HeatMap(title, correlated.names, correlated.names, values, limits=(0.8, 1.0))
    for title, values in (
        ("Correlation [1]", correlated.pearson),
        ("at least [1]", correlated.pearson_low),
    )
]
deboom.plot.heat_maps(panels, columns=2)
