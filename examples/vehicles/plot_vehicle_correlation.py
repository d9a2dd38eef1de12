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
# Pearson's coefficient of each pair, and the interval of 95 %.

coefficients = (correlated.pearson, correlated.pearson_low, correlated.pearson_high)
figure = deboom.plot.scatter_matrix(
    correlated.names,
    experiment.doe.computed / experiment.n_lines,
    coefficients,
    {},
    value_label="mean level of the lines [dB(A)]",
)

# %%
# A vehicle correlates with itself perfectly, and every coefficient lies inside of its interval.

assert abs(correlated.pearson.diagonal() - 1.0).max() < 1e-12
assert (correlated.pearson_low <= correlated.pearson + 1e-12).all()
assert (correlated.pearson <= correlated.pearson_high + 1e-12).all()
