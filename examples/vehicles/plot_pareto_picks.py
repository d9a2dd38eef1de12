"""
Designs picked from a front
===========================

Best-mean, best scatter and what is quieter without a vehicle louder than today: what the front
offers, in decibels per line and vehicle instead of sums over all of them.
"""

import numpy as np

import deboom

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
robust = deboom.Robust(model, model.design_space(bounds=0.20, tolerance=0.15), draws=32)
front = deboom.search(robust, population=40, generations=30, seed=1, verified_with=256)

picks = front.table[front.table["pick"] != ""]
picks[["pick", "mean per line and vehicle [dB(A)]", "sigma per line and vehicle [dB]"]]

# %%
# The front, verified by draws that the search has not seen, with today's design.

front.picture()

# %%
# What best-mean asks of the mounts, and what it does in each vehicle.

quietest = front.pick_designs["best-mean"]
factors = {
    name: round(float(x), 2) for name, x in zip(front.variables, quietest, strict=True) if x != 1
}
today, quiet = model(np.stack([robust.space.nominal, quietest]))
change = (quiet - today) / model.n_lines
print(factors)
print(
    {name: round(float(x), 2) for name, x in zip(front.responses, change, strict=True)},
    "dB per line",
)

# %%
# Another seed differs by chance alone: both fronts have converged, so that one of each shows it.

again = deboom.search(robust, population=40, generations=30, seed=2, verified_with=256)
difference = deboom.compare(front, again, draws=256)
print(difference.table.to_string(index=False))
print(difference.text)
