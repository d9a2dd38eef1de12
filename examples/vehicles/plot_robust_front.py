"""
A robust front by pymoo
=======================

The shipped platform, the five U06 vehicles: the sum of their levels against its scatter by
manufacture. `deboom.RobustProblem` is a problem of pymoo, so any of its algorithms will do.
"""

import matplotlib.pyplot as plt
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
# evaluates it with draws that the search has not seen.

front = deboom.search(robust, population=40, generations=30, seed=1, verified_with=256)
today = front.baseline.objectives[0]

figure, axes = plt.subplots(layout="constrained")
axes.scatter(*result.F.T, marker="x", label="pymoo, as searched")
axes.scatter(*front.values.objectives.T, s=14, label="deboom, verified")
axes.scatter(*today, marker="D", color="black", label="today")
axes.set(xlabel="Σ mean SPLV [dB(A)]", ylabel="Σ σ(SPLV) [dB]")
axes.legend()

# %%
# The best-mean in decibels per line and vehicle, which are easier to read than sums.

gain = (today[0] - front.values.objectives[:, 0].min()) * front.per_line
print(f"{gain:.2f} dB quieter per line and vehicle")
assert gain > 0.5
