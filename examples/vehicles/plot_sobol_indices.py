"""
Which stiffness matters: Sobol indices
======================================

SALib computes the indices; its problem dictionary is `problem` of the result. A linear model,
whose indices are known, shows that they are right; the platform shows what they say of a car
(thesis, figure 48).
"""

import matplotlib.pyplot as plt
import numpy as np

import deboom

# %%
# A sum of a and 2 b over the same range: shares of the variance are 1/5 and 4/5.

linear = deboom.ResponseFunction(lambda x: x @ [[1.0], [2.0]], ("a", "b"), ("y",), "dB")
known = deboom.sobol(linear, linear.design_space(), n=256).table
assert np.allclose(known["total [1]"], [0.2, 0.8], atol=0.02)

# %%
# Twelve stiffnesses of the shipped platform, vehicle by vehicle.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
indices = deboom.sobol(model, model.design_space(), n=128, seed=1)
print(indices.problem["names"])
total = indices.table.pivot_table("total [1]", "variable", "response", sort=False)

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
total.plot.barh(ax=axes, width=0.8)
axes.invert_yaxis()
axes.set(xlabel="total Sobol index [1]", ylabel="")

# %%
# The torque strut along the car carries most of it.

assert total.mean(axis=1).idxmax() == "TSM x"
