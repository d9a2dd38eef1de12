"""
Which tolerances are worth their price?
=======================================

The same scatter of the level for less money: tight where it is heard, wide elsewhere. A
direction costs 1 at ±15 % and the reciprocal of its tolerance elsewhere.
"""

import numpy as np

import deboom

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
robust = deboom.Robust(model, model.design_space(tolerance=0.15), draws=128)
allocation = deboom.allocate_tolerances(robust, np.ones(12), widest=0.30)
allocation.table

# %%
# Today all are at ±15 %, and cost 1 each.

cheapest, today = 100 * allocation.tolerance, np.full(12, 15.0)
panels = [
    deboom.plot.IntervalPanel(
        "tolerance, ± three standard deviations [%]",
        {"today": [today] * 3, "cheapest": [cheapest] * 3},
    ),
    deboom.plot.IntervalPanel(
        "price [1]", {"today": [today / 15] * 3, "cheapest": [15 / cheapest] * 3}
    ),
]
deboom.plot.interval_panels(allocation.names, panels)

# %%
# The sum of the standard deviations stays, the price falls.

scatter = allocation.sigma_sum / robust(np.ones((1, 12))).sigma_sum[0]
print(f"price {allocation.total_cost:.1f} of 12, scatter {scatter:.4f} of today's")
