"""
A robust front by pymoo
=======================

The shipped platform, the five U06 vehicles: the sum of their levels against its scatter by
manufacture (thesis, figure 47). `deboom.RobustProblem` is a problem of pymoo, so any of its
algorithms will do.
"""

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
today = front.baseline.objectives[0] * front.per_line
by_pymoo = (result.F[result.F[:, 0].argsort()] * front.per_line).T
verified = (front.values.objectives * front.per_line).T
deboom.plot.fronts(
    {"pymoo, as searched": by_pymoo, "deboom, verified": verified},
    {},
    {"today": tuple(today)},
    mean_label="mean per line and vehicle [dB(A)]",
    sigma_label="σ per line and vehicle [dB]",
)

# %%
# The best-mean against today.

print(f"{today[0] - verified[0].min():.2f} dB quieter per line and vehicle")
