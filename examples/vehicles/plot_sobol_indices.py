"""
Which stiffness matters: Sobol indices
======================================

SALib computes the indices; its problem dictionary is `problem` of the result. A linear model,
whose indices are known, shows that they are right; the platform shows what they say of a car
(thesis, figure 48).
"""

import deboom

# %%
# A sum of a and 2 b over the same range: shares of the variance are 1/5 and 4/5.

linear = deboom.ResponseFunction(lambda x: x @ [[1.0], [2.0]], ("a", "b"), ("y",), "dB")
deboom.sobol(linear, linear.design_space(), n=256).table

# %%
# Twelve stiffnesses of the shipped platform, vehicle by vehicle: the torque strut along the car
# carries most of the level.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
indices = deboom.sobol(model, model.design_space(), n=128, seed=1)
total = indices.table.pivot_table("total [1]", "response", "variable", sort=False)
heat = deboom.plot.HeatMap(
    "Total Sobol index [1]", tuple(total.index), tuple(total.columns), total.to_numpy()
)
deboom.plot.heat_maps([heat], columns=1)
