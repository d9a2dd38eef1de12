"""
Elementary effects after Morris
===============================

A few trajectories tell variables that matter from those that do not, before a Sobol analysis
spends thousands of evaluations. SALib computes both.
"""

import matplotlib.pyplot as plt

import deboom

# %%
# The shipped platform: how far a factor moves the level of each vehicle, per line.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
space = model.design_space()
effects = deboom.morris(model, space, trajectories=20, seed=1)
mean = effects.table.groupby("variable", sort=False).mean(numeric_only=True)
mean.sort_values("mu* per line [dB(A)]").tail(4)

# %%
# Effects that are large with little spread are straight; those above the line bend or interact.

figure, axes = plt.subplots(layout="constrained")
reach, spread = (mean[f"{name} [dB(A)]"] / model.n_lines for name in ("mu*", "sigma"))
axes.scatter(reach, spread)
for name in reach.nlargest(5).index:
    axes.annotate(name, (reach[name], spread[name]))
axes.axline((0, 0), slope=1, color="k", linewidth=0.8)
axes.margins(0.12)
axes.set(xlabel="mu* per line [dB]", ylabel="sigma of the effects per line [dB]")

# %%
# The ranking agrees with the total Sobol indices.

total = deboom.sobol(model, space, n=128, seed=1).table
sobol = total.groupby("variable")["total [1]"].mean()
assert set(mean["mu* [dB(A)]"].nlargest(3).index) == set(sobol.nlargest(3).index)
assert mean["mu* [dB(A)]"].idxmax() == "TSM x"
