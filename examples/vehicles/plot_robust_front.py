"""
A robust front by pymoo
=======================

The shipped platform, the five U06 vehicles: the sum of their levels against its scatter by
manufacture (thesis, figure 47). `deboom.RobustProblem` is a problem of pymoo, so any of its
algorithms will do.
"""

import matplotlib.pyplot as plt
import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

import deboom

platform = deboom.read_platform("u06")
model = platform.model(vehicles="U06", band=(24, 40), motion="coupled")
space = model.design_space(bounds=0.20, tolerance=0.15)
robust = deboom.Robust(model, space, draws=64, seed=1)

# %%
# pymoo minimises both objectives. Every design meets the same 64 draws of the scatter.

result = minimize(deboom.RobustProblem(robust), NSGA2(40), ("n_gen", 30), seed=1)

# %%
# `deboom.search` does the same, brings the front to convergence along exact gradients, and
# evaluates it with draws that the search has not seen. Objectives are sums over lines and
# vehicles; per line and vehicle they are easier to read.

front = deboom.search(robust, population=40, generations=30, seed=1, verified_with=256)
today = front.baseline.objectives[0]

figure, axes = plt.subplots(layout="constrained")
for sums, style in (
    (result.F, {"marker": "x", "label": "pymoo, as searched"}),
    (front.values.objectives, {"s": 14, "label": "deboom, verified"}),
    (today[np.newaxis], {"marker": "D", "color": "black", "label": "today"}),
):
    axes.scatter(*(front.per_line * sums).T, **style)
axes.set(xlabel="mean per line and vehicle [dB(A)]", ylabel="σ per line and vehicle [dB]")
axes.legend()

# %%
# The best-mean against today.

gain = (today[0] - front.values.objectives[:, 0].min()) * front.per_line
print(f"{gain:.2f} dB quieter per line and vehicle")
assert gain > 0.5
