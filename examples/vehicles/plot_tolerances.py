"""
Which tolerances are worth their price?
=======================================

The same scatter of the level for less money: tight where it is heard, wide elsewhere. A
direction costs 1 at ±15 % and the reciprocal of its tolerance elsewhere.
"""

import matplotlib.pyplot as plt
import numpy as np

import deboom

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
robust = deboom.Robust(model, model.design_space(tolerance=0.15), draws=128)
allocation = deboom.allocate_tolerances(robust, np.ones(12), widest=0.30)
allocation.table

# %%
# Today all are at ±15 %.

figure, axes = plt.subplots(layout="constrained")
axes.barh(allocation.names, 100 * allocation.tolerance)
axes.axvline(15, color="k", linewidth=0.8)
axes.set(xlabel="tolerance, ± three standard deviations [%]")
axes.invert_yaxis()

# %%
# The sum of the standard deviations stays, the price falls.

today = robust(np.ones((1, 12))).sigma_sum[0]
print(f"price {allocation.total_cost:.1f} of 12, scatter {allocation.sigma_sum / today:.4f}")
assert np.isclose(allocation.sigma_sum, today, rtol=1e-4)
assert allocation.total_cost < 0.75 * 12
assert allocation.table["variable"][np.argmin(allocation.tolerance)] == "TSM x"
