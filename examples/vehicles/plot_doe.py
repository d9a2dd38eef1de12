"""
A design of experiments, and main effects
=========================================

A Latin hypercube over the mount stiffnesses shows which of them moves the level, and how
straight: the slope of the scatter beside the exact gradient of the model.
"""

import matplotlib.pyplot as plt
import numpy as np

import deboom

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
experiment = deboom.doe(model, model.design_space(bounds=0.10), n=128, seed=1)
experiment.table.iloc[:4, -3:]

# %%
# Mean level over the three factors that the level follows most.

level = experiment.table["mean per line [dB(A)]"].to_numpy()
designs = experiment.doe.designs
slope = np.linalg.lstsq(np.c_[np.ones(len(designs)), designs], level, rcond=None)[0][1:]
most = np.argsort(-np.abs(slope))[:3]

figure, panels = plt.subplots(1, 3, figsize=(9, 3), sharey=True, layout="constrained")
for axes, k in zip(panels, most, strict=True):
    axes.plot(designs[:, k], level, ".")
    axes.axline((1, level.mean()), slope=slope[k], color="k", linewidth=0.8)
    axes.set(xlabel=f"factor on {model.variable_names[k]} [1]")
panels[0].set(ylabel="mean level per line [dB(A)]")

# %%
# The exact gradient at today's design says the same.

gradient = model.gradient(np.ones((1, 12)))[0].mean(axis=0) / model.n_lines
print(gradient[most].round(2), slope[most].round(2), "dB per 100 %")
assert model.variable_names[most[0]] == "TSM x"
assert np.allclose(gradient[most], slope[most], atol=0.15 * np.abs(slope).max())
