"""
A design of experiments, and main effects
=========================================

A Latin hypercube over the mount stiffnesses shows which of them moves the level, and how
straight: the slope of the scatter beside the exact gradient of the model.
"""

import numpy as np

import deboom

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
experiment = deboom.doe(model, model.design_space(bounds=0.10), n=128, seed=1)
experiment.table.iloc[:4, -3:]

# %%
# The level of each car over the three factors that it follows most.

level = experiment.doe.computed / model.n_lines
designs = experiment.doe.designs
slope = np.linalg.lstsq(np.c_[np.ones(len(designs)), designs], level, rcond=None)[0][1:].mean(
    axis=1
)
most = np.argsort(-np.abs(slope))[:3]
deboom.plot.variable_grid(
    {f"{model.variable_names[k]} [1]": designs[:, k] for k in most},
    dict(zip(model.response_names, level.T, strict=True)),
    "mean level of the lines [dB(A)]",
)

# %%
# The exact gradient at today's design says the same as the slopes.

gradient = model.gradient(np.ones((1, 12)))[0].mean(axis=0) / model.n_lines
print(gradient[most].round(2), slope[most].round(2), "dB per 100 %")
