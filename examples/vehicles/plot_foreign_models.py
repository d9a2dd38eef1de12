"""
Models that are not deboom's
============================

A supplier's Excel table and a Gaussian process of scikit-learn take the place of the booming
model: whatever turns designs into responses gives a front, an index and a tolerance.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.gaussian_process import GaussianProcessRegressor

import deboom

# %%
# Levels and slopes out of an Excel sheet: one row per vehicle, one column per factor.

sheet = pd.read_excel(Path("../../docs/guides/supplier_levels.xlsx"), index_col="vehicle")
today, slopes = sheet.iloc[:, 0].to_numpy(), sheet.iloc[:, 1:].to_numpy()
names = tuple(name.removesuffix(" [dB]") for name in sheet.columns[1:])
table = deboom.ResponseFunction(
    lambda designs: today + (designs - 1.0) @ slopes.T, names, tuple(sheet.index), "dB(A)"
)
front = deboom.search(deboom.Robust(table, table.design_space()), population=20, generations=15)
front.table.iloc[:3, 1:4]

# %%
# A regressor that learned 128 designs of the platform's model, and the front that it promises.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
space = model.design_space(bounds=0.20)
known = deboom.doe(model, space, n=128, seed=1).doe
regressor = GaussianProcessRegressor(normalize_y=True).fit(known.designs, known.responses)
learned = deboom.ResponseFunction(
    regressor.predict, model.variable_names, model.response_names, "dB(A)", model.n_lines
)
robust = deboom.Robust(learned, space, draws=32)
promised = deboom.search(robust, population=20, generations=15, verified_with=64)

# %%
# The model itself judges: how far is what the regressor promises?

true = deboom.Robust(model, space, draws=64, seed=2)(promised.values.designs)
scale = promised.per_line
figure, axes = plt.subplots(layout="constrained")
axes.plot(promised.values.mean_sum * scale, promised.values.sigma_sum * scale, "o", label="learned")
axes.plot(true.mean_sum * scale, true.sigma_sum * scale, "x", label="the model")
axes.set(xlabel="mean level per line [dB(A)]", ylabel="its σ [dB]")
axes.legend()

off = np.abs(true.mean_sum - promised.values.mean_sum) * scale
print(f"the regressor is off by up to {off.max():.2f} dB per line")
assert off.max() < 0.3
assert front.table["mean per line and vehicle [dB(A)]"].min() < today.mean()
