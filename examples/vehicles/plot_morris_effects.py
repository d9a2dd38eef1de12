"""
Elementary effects after Morris
===============================

A few trajectories separate variables that matter from those that do not, before a Sobol analysis
spends thousands of evaluations. SALib computes both.
"""

import deboom

# %%
# The shipped platform: how far a factor moves the level of each vehicle, per line.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
space = model.design_space()
effects = deboom.morris(model, space, trajectories=20, seed=1)
mean = effects.table.groupby("variable", sort=False).mean(numeric_only=True)
mean.sort_values("mu* per line [dB(A)]").tail(4)

# %%
# Effects that are large with little spread are straight; the others bend or interact. Bars reach
# from the least to the largest of the five cars.

of_cars = effects.table.groupby("variable", sort=False)
panels = []
for title, column in (("Size, mu*", "mu* [dB(A)]"), ("Spread, sigma", "sigma [dB(A)]")):
    values = of_cars[column].agg(["mean", "min", "max"]) / model.n_lines
    bounds = {"five cars": values.to_numpy().T}
    panels.append(deboom.plot.IntervalPanel("effect per line [dB]", bounds, title=title))
deboom.plot.interval_panels(list(mean.index), panels)

# %%
# The ranking agrees with the total Sobol indices.

total = deboom.sobol(model, space, n=128, seed=1).table.groupby("variable")["total [1]"].mean()
print("Morris", list(mean["mu* [dB(A)]"].nlargest(3).index))
print("Sobol ", list(total.nlargest(3).index))
